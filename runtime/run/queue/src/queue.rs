//! The queue as supervisor and agents see it: the seam between what they decide and where messages are kept.
//!
//! All that passes is bytes that [`crate::token::Token`] has signed; the queue itself trusts nobody and needs no
//! secret.

use std::time::Duration;

/// How long an agent counts as present after it last said so.
pub const PRESENT: Duration = Duration::from_secs(3);

/// How often an agent says that it is there.
pub const HERE: Duration = Duration::from_secs(1);

/// How long to wait before an unreachable queue is tried again.
pub const PAUSE: Duration = Duration::from_millis(200);

/// The largest file that passes through a queue.
pub const LARGEST_FILE: u64 = 1 << 30;

/// Why a queue cannot be used.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum QueueError {
    /// It cannot be reached at the moment. What was asked for may or may not have happened, and may be asked again.
    #[error("{place} cannot be reached: {reason}")]
    Unreachable {
        /// Where the queue is.
        place: String,
        /// Why.
        reason: String,
    },
    /// It does not do what was asked, and will not if asked again.
    #[error("{place}: {reason}")]
    Refused {
        /// Where the queue is.
        place: String,
        /// Why.
        reason: String,
    },
}

/// A queue of tests and results of campaigns, with their files. All names of campaigns are [campaign
/// ids](crate::announcement::is_campaign_id).
///
/// What returned without an error has happened, and survives the end of the program that keeps the queue. A call that
/// failed as unreachable may be made again: calls have the same effect once and twice, except that a test may be
/// delivered twice, and a result. Messages differ: one that is equal to an earlier one may be taken for the same.
pub trait Queue: Send + Sync {
    /// Where it is, for people.
    fn place(&self) -> String;

    /// Makes room for the messages and files of a campaign, if there is none, without announcing it.
    fn make_room(&self, campaign: &str) -> Result<(), QueueError>;

    /// Announces a campaign that has room, or announces it anew.
    fn announce(&self, campaign: &str, announcement: &[u8]) -> Result<(), QueueError>;

    /// All campaigns that are announced, each with its announcement.
    fn announcements(&self) -> Result<Vec<(String, Vec<u8>)>, QueueError>;

    /// Removes the tests of a campaign that are not finished. Who runs one goes on, and its result comes.
    fn withdraw(&self, campaign: &str) -> Result<(), QueueError>;

    /// Removes a campaign with its tests, results and files.
    fn remove(&self, campaign: &str) -> Result<(), QueueError>;

    /// Puts a test of an announced campaign in.
    fn put_test(&self, campaign: &str, test: &[u8]) -> Result<(), QueueError>;

    /// Takes a test, the oldest that nobody has; `None` if there is none within `wait`. The same test is taken by one
    /// agent at a time, as long as that one holds it.
    fn take_test(&self, campaign: &str, wait: Duration) -> Result<Option<Box<dyn Held>>, QueueError>;

    /// Puts in what came of a test.
    fn put_result(&self, campaign: &str, result: &[u8]) -> Result<(), QueueError>;

    /// Takes a result; `None` if there is none within `wait`. It is gone from the queue: if the supervisor dies before
    /// it has recorded the result, the test is run again.
    fn take_result(&self, campaign: &str, wait: Duration) -> Result<Option<Vec<u8>>, QueueError>;

    /// Keeps a file of a campaign under its hash.
    fn put_file(&self, campaign: &str, hash: &str, content: &[u8]) -> Result<(), QueueError>;

    /// Whether the campaign has this file.
    fn has_file(&self, campaign: &str, hash: &str) -> Result<bool, QueueError>;

    /// A file of a campaign; `None` if it has none of this hash. The caller compares content and hash.
    fn file(&self, campaign: &str, hash: &str) -> Result<Option<Vec<u8>>, QueueError>;

    /// Removes a file that is not needed any more.
    fn remove_file(&self, campaign: &str, hash: &str) -> Result<(), QueueError>;

    /// Says that an agent is there, or a supervisor. It counts as present for [`PRESENT`].
    fn present(&self, agent: &str, presence: &[u8]) -> Result<(), QueueError>;

    /// Says that an agent has left.
    fn absent(&self, agent: &str) -> Result<(), QueueError>;

    /// What all say that are present.
    fn presences(&self) -> Result<Vec<Vec<u8>>, QueueError>;
}

/// A test that was taken. As long as this lives, and the process with it, nobody else gets the test; if it is dropped,
/// or the process dies, the test is delivered to somebody else after seconds.
pub trait Held: Send {
    /// The test as it was put in.
    fn test(&self) -> &[u8];

    /// How often it was delivered, this time included: each time before, the agent that had it was lost or cut off.
    fn deliveries(&self) -> u64;

    /// Its result is in the queue, or it was put back, so this message leaves the queue.
    fn finish(self: Box<Self>) -> Result<(), QueueError>;
}

/// The URL of a queue as people may read it: who logs in, and with which password, is left out.
pub fn without_secrets(url: &str) -> String {
    let (scheme, rest) = url.split_once("://").map_or(("", url), |(scheme, rest)| (scheme, rest));
    let host = rest.rsplit_once('@').map_or(rest, |(_, host)| host);
    if scheme.is_empty() { host.to_owned() } else { format!("{scheme}://{host}") }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_url_is_shown_without_its_password() {
        for (url, shown) in [
            ("nats://127.0.0.1:4222", "nats://127.0.0.1:4222"),
            ("tls://robot:se@cret@broker:4222", "tls://broker:4222"),
            ("robot:secret@broker", "broker"),
        ] {
            assert_eq!(without_secrets(url), shown);
        }
    }
}
