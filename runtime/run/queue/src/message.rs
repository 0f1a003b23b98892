//! What supervisor and agents say to each other through the queue.

use std::collections::BTreeSet;
use std::time::Duration;

use serde::{Deserialize, Serialize};
use serde_json::value::RawValue;

use crate::token::{Kind, Token};

/// A test on its way to an agent.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub struct Work {
    /// The number of the job: no other one of the campaign has it at the same time.
    pub number: u32,
    /// Which attempt this is, from 0; later ones follow faults of machines.
    pub attempt: u32,
    /// The job, as JSON.
    pub job: Box<RawValue>,
    /// The [edition](crate::announcement::Announcement::edition) of the campaign that it belongs to.
    pub edition: String,
    /// The session of the supervisor that put it in: equal tests of two sessions are two messages.
    pub session: String,
    /// How often an agent has put it back into the queue in this attempt.
    pub put_back: u32,
    /// Machines that had a fault with this test. They leave it to others, as long as there are some.
    pub avoid: BTreeSet<String>,
    /// How long it may take.
    pub limit: Limit,
    /// Whether what the run recorded comes back with the result.
    pub records: bool,
}

impl Work {
    /// The hash of the job and of what it is run with: what [`Ended::job`] says of its result.
    pub fn digest(&self) -> String {
        digest_of(format!("{}\n{}", self.edition, self.job.get()).as_bytes())
    }
}

/// How long a test may take, in wall time.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub struct Limit {
    /// After this time a test is stopped, on a machine as fast as the one of the reference run.
    pub timeout: Duration,
    /// How long the reference run took; `None` until it has ended. A slower machine gives its tests more time.
    pub reference: Option<Duration>,
}

/// Who an agent is.
#[derive(Debug, Clone, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
pub struct AgentName {
    /// The name of its machine.
    pub machine: String,
    /// What tells it from other agents, of this machine and of all times.
    pub id: String,
}

/// What came of a test on an agent.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub struct Ended {
    /// The number of the job.
    pub number: u32,
    /// Which attempt it was.
    pub attempt: u32,
    /// The hash of the job, as [`Work::digest`] gives it: a result is of the job that was asked for, or of none.
    pub job: String,
    /// Who ran it.
    pub agent: AgentName,
    /// What came of it.
    pub outcome: EndedAs,
}

/// How a test ended on an agent.
#[derive(Debug, Clone, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum EndedAs {
    /// It was run.
    Ran {
        /// The result of the job, as JSON.
        result: Box<RawValue>,
        /// Why the environment on this machine broke it off, if it did: this says nothing about the system.
        fault: Option<String>,
        /// The file of what the run recorded, by its hash.
        recorded: Option<String>,
    },
    /// The agent could not run it at all, for this reason.
    NotRun {
        /// Why not.
        reason: String,
    },
    /// It was delivered so often, and never finished, that nobody should try it again.
    Poison {
        /// How many agents were lost with it, or were not heard for too long while they had it.
        lost: u64,
    },
}

/// A supervisor that is there, and goes on with its campaign.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct Supervision {
    /// The campaign.
    pub campaign: String,
}

impl Supervision {
    /// The name under which a campaign's supervisor says that it is there.
    pub fn name(campaign: &str) -> String {
        format!("campaign-{campaign}")
    }

    /// Reads what a supervisor with this token says, of whichever campaign.
    pub fn read(token: &Token, sealed: &[u8]) -> Option<Supervision> {
        let body = sealed.splitn(2, |&byte| byte == b'\n').nth(1)?;
        // Not trusted: it only says which campaign the signature has to be for.
        let said: Supervision = serde_json::from_slice(body).ok()?;
        token.open(Kind::Supervision, &said.campaign, sealed).ok().filter(|read: &Supervision| *read == said)
    }
}

/// An agent that is there.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct Presence {
    /// Who it is.
    pub agent: AgentName,
    /// How many tests it runs at once.
    pub workers: u32,
    /// How many it runs now.
    pub busy: u32,
    /// How many it has finished since it started.
    pub finished: u64,
    /// The version of its program.
    pub version: String,
    /// The campaign it works for.
    pub campaign: Option<String>,
    /// Why it does not work for a campaign that is announced, each with its reason.
    pub refused: Vec<(String, String)>,
}

/// The hash of bytes: SHA-256 in hexadecimal digits.
pub fn digest_of(bytes: &[u8]) -> String {
    use sha2::Digest as _;
    crate::token::hex(&sha2::Sha256::digest(bytes))
}

/// The same of all that can be read, and how long it is.
pub fn digest_of_all(mut from: impl std::io::Read) -> std::io::Result<(String, u64)> {
    use sha2::Digest as _;
    let (mut hash, mut length, mut piece) = (sha2::Sha256::new(), 0, vec![0; 1 << 16]);
    loop {
        match from.read(&mut piece) {
            Ok(0) => return Ok((crate::token::hex(&hash.finalize()), length)),
            Ok(read) => {
                hash.update(&piece[..read]);
                length += read as u64;
            }
            Err(error) if error.kind() == std::io::ErrorKind::Interrupted => {}
            Err(error) => return Err(error),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn messages_are_read_as_they_were_sealed_and_jobs_and_results_keep_every_byte() {
        let token = Token::random().unwrap();
        let json = || RawValue::from_string("{ \"x\": 1.50,  \"y\": \"\\u00e9\" }".to_owned()).unwrap();
        let limit = Limit { timeout: Duration::from_millis(1500), reference: Some(Duration::from_nanos(1)) };
        let avoid = BTreeSet::from(["lab".to_owned()]);
        let (edition, session) = ("1".to_owned(), "2".to_owned());
        let work =
            Work { number: 7, attempt: 1, job: json(), edition, session, put_back: 3, avoid, limit, records: true };
        let read: Work = token.open(Kind::Work, "a", &token.seal(Kind::Work, "a", &work)).unwrap();
        assert_eq!(format!("{read:?}"), format!("{work:?}"));

        let agent = AgentName { machine: "lab".to_owned(), id: "1".to_owned() };
        for outcome in [
            EndedAs::Ran { result: json(), fault: Some("a fault".to_owned()), recorded: Some("00".to_owned()) },
            EndedAs::NotRun { reason: "no simulator".to_owned() },
            EndedAs::Poison { lost: 10 },
        ] {
            let job = work.digest();
            let ended = Ended { number: 7, attempt: 1, job, agent: agent.clone(), outcome };
            let read: Ended = token.open(Kind::Ended, "a", &token.seal(Kind::Ended, "a", &ended)).unwrap();
            assert_eq!(format!("{read:?}"), format!("{ended:?}"));
        }
    }
}
