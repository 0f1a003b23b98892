//! What the start of a system waits for, reported when it takes long, so that nobody looks at a silent terminal.

use std::time::{Duration, Instant};

/// How long a start waits before it is reported, and the least time between two reports.
const TOLD_AFTER: Duration = Duration::from_secs(10);

/// How many missing things are listed one by one.
const TOLD: usize = 4;

/// Receives what a start waits for, in a sentence.
pub type Tell = Box<dyn FnMut(&str) + Send>;

/// The start of a system, as far as it waits for something.
#[derive(Default)]
pub(super) struct Waiting {
    tell: Option<Tell>,
    /// Since when it waits, or when it reported last.
    since: Option<Instant>,
    told: String,
}

impl Waiting {
    pub(super) fn tell(&mut self, tell: Tell) {
        self.tell = Some(tell);
    }

    /// What is missing now, each in a phrase. The same is reported once.
    pub(super) fn lacks(&mut self, missing: &[String], now: Instant) {
        if missing.is_empty() {
            self.since = None;
            self.told.clear();
            return;
        }
        let since = *self.since.get_or_insert(now);
        if now.duration_since(since) < TOLD_AFTER {
            return;
        }
        let more = missing.len().saturating_sub(TOLD);
        let first = missing[..missing.len() - more].join("; ");
        let missing = if more > 0 { format!("{first}; and {more} more") } else { first };
        if missing != self.told
            && let Some(tell) = &mut self.tell
        {
            tell(&missing);
            self.told = missing;
            self.since = Some(now);
        }
    }
}

#[cfg(test)]
mod tests {
    use std::sync::{Arc, Mutex};

    use super::*;

    #[test]
    fn what_is_missing_is_reported_after_ten_seconds_and_when_it_changes() {
        let told = Arc::new(Mutex::new(Vec::new()));
        let mut waiting = Waiting::default();
        let listener = Arc::clone(&told);
        waiting.tell(Box::new(move |missing| listener.lock().unwrap().push(missing.to_owned())));
        let began = Instant::now();
        let mut at = |second: u64, missing: &[&str]| {
            let missing: Vec<String> = missing.iter().map(|&phrase| phrase.to_owned()).collect();
            waiting.lacks(&missing, began + Duration::from_secs(second));
            std::mem::take(&mut *told.lock().unwrap())
        };
        let nothing: [&str; 0] = [];
        assert_eq!(at(0, &["nobody publishes on `/odom`"]), nothing);
        assert_eq!(at(9, &["nobody publishes on `/odom`"]), nothing);
        assert_eq!(at(10, &["nobody publishes on `/odom`"]), ["nobody publishes on `/odom`"]);
        assert_eq!(at(25, &["nobody publishes on `/odom`"]), nothing, "it is reported once");
        assert_eq!(at(26, &["nobody subscribes to `/cmd`"]), ["nobody subscribes to `/cmd`"]);
        assert_eq!(at(27, &["nobody publishes on `/odom`"]), nothing, "not so soon after the last time");
        assert_eq!(at(28, &[]), nothing);
        assert_eq!(at(60, &["nobody publishes on `/odom`"]), nothing, "another start");
    }
}
