//! How many messages came, and how fast.

use std::time::Duration;

/// The messages of a topic that arrived: how many, and when the first and the last one did.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Arrivals {
    messages: u64,
    first: Duration,
    last: Duration,
}

impl Arrivals {
    /// One more came, at this time since the beginning of the scan.
    pub fn add(&mut self, at: Duration) {
        if self.messages == 0 {
            self.first = at;
        }
        self.messages += 1;
        self.last = at;
    }

    /// How many came.
    pub fn messages(&self) -> u64 {
        self.messages
    }

    /// The messages per second between the first and the last, if there were two.
    pub fn rate(&self) -> Option<f64> {
        let seconds = self.last.saturating_sub(self.first).as_secs_f64();
        (self.messages > 1 && seconds > 0.0).then(|| (self.messages - 1) as f64 / seconds)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_rate_needs_two_messages() {
        let mut arrivals = Arrivals::default();
        assert_eq!((arrivals.messages(), arrivals.rate()), (0, None));
        arrivals.add(Duration::from_secs(3));
        assert_eq!((arrivals.messages(), arrivals.rate()), (1, None));
        arrivals.add(Duration::from_millis(3100));
        arrivals.add(Duration::from_millis(3200));
        assert_eq!((arrivals.messages(), arrivals.rate()), (3, Some(10.0)));
    }
}
