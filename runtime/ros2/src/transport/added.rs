//! What the relay adds to the way of messages in a run, compared with its budget.
//!
//! Only notes are made of it: it is wall time, and never part of results.

use std::time::Duration;

use sesame_plan::RelayBudget;

/// Each power of two is divided into so many buckets, as a power of two: what is read is at most 3 % too small.
const FINE: u32 = 5;

/// As many as there are nanoseconds in 64 bits, in buckets.
const BUCKETS: usize = (64 - FINE as usize + 1) << FINE;

/// Below so many messages there is no one in a hundred.
const FEWEST: u64 = 100;

/// How long messages were on their way through the relay, in a memory of fixed size.
pub(super) struct Added {
    budget: RelayBudget,
    /// How many messages by the logarithm of what was added.
    counts: Box<[u64; BUCKETS]>,
}

impl Added {
    pub(super) fn new(budget: RelayBudget) -> Self {
        Added { budget, counts: Box::new([0; BUCKETS]) }
    }

    /// A message was passed on so long after it had come.
    pub(super) fn record(&mut self, added: Duration) {
        self.counts[bucket(u64::try_from(added.as_nanos()).unwrap_or(u64::MAX))] += 1;
    }

    /// Where the budget was exceeded, each in a sentence. Then everything begins anew.
    pub(super) fn judge(&mut self) -> Vec<String> {
        let counts = std::mem::replace(&mut self.counts, Box::new([0; BUCKETS]));
        let all: u64 = counts.iter().sum();
        if all < FEWEST {
            return Vec::new();
        }
        let [half, most] = [50, 99].map(|percent| quantile(&counts[..], (all * percent).div_ceil(100)));
        let mut notes = Vec::new();
        if let Some(latency) = self.budget.latency.filter(|&latency| most > latency) {
            notes.push(format!(
                "the relay added {} to one message in a hundred; the budget is {} latency",
                shown(most),
                shown(latency)
            ));
        }
        if let Some(jitter) = self.budget.jitter.filter(|&jitter| most - half > jitter) {
            notes.push(format!(
                "what the relay added varied by {}: it was {} for every second message and {} for one in a hundred; the \
                 budget is {} jitter",
                shown(most - half),
                shown(half),
                shown(most),
                shown(jitter)
            ));
        }
        notes
    }
}

/// The bucket of so many nanoseconds.
fn bucket(nanos: u64) -> usize {
    let octave = (u64::BITS - nanos.leading_zeros()).saturating_sub(FINE + 1);
    // Of `nanos >> octave` the highest bit is set, unless the octave is the first.
    ((octave as usize) << FINE) + usize::try_from(nanos >> octave).unwrap_or(0)
}

/// The least number of nanoseconds of a bucket.
fn least(bucket: usize) -> u64 {
    let octave = (bucket >> FINE).saturating_sub(1);
    ((bucket - (octave << FINE)) as u64) << octave
}

/// What was added to the message of this rank, in seconds.
fn quantile(counts: &[u64], rank: u64) -> f64 {
    let mut below = 0;
    let found = counts.iter().position(|count| {
        below += count;
        below >= rank
    });
    Duration::from_nanos(least(found.unwrap_or(0))).as_secs_f64()
}

/// A time in milliseconds, down to microseconds.
fn shown(seconds: f64) -> String {
    let text = format!("{:.3}", seconds * 1000.0);
    let text = text.trim_end_matches('0').trim_end_matches('.');
    format!("{text} ms")
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    fn milliseconds(number: f64) -> Duration {
        Duration::from_secs_f64(number / 1000.0)
    }

    fn judged(budget: RelayBudget, added: impl IntoIterator<Item = f64>) -> Vec<String> {
        let mut measured = Added::new(budget);
        added.into_iter().for_each(|added| measured.record(milliseconds(added)));
        let notes = measured.judge();
        assert!(measured.judge().is_empty(), "it begins anew");
        notes
    }

    #[test]
    fn a_budget_that_is_exceeded_is_said_with_figures_and_one_that_is_kept_is_not() {
        let budget = RelayBudget { latency: Some(0.005), jitter: Some(0.002) };
        let slow = |share: usize| (0..1000).map(move |at| if at % 100 < share { 7.2 } else { 0.25 });
        assert_eq!(judged(budget, slow(0)), [""; 0]);
        assert_eq!(judged(budget, slow(1)), [""; 0], "less than one in a hundred is more than that");
        assert_eq!(
            judged(budget, slow(2)),
            [
                "the relay added 7.078 ms to one message in a hundred; the budget is 5 ms latency",
                "what the relay added varied by 6.828 ms: it was 0.25 ms for every second message and 7.078 ms for one in \
                 a hundred; the budget is 2 ms jitter",
            ]
        );
        let steady = judged(budget, [7.2; 200]);
        assert_eq!(steady, ["the relay added 7.078 ms to one message in a hundred; the budget is 5 ms latency"]);
        assert_eq!(judged(budget, [7.2; 99]), [""; 0], "too few to tell");
        assert_eq!(judged(RelayBudget { latency: None, jitter: Some(0.002) }, [7.2; 200]), [""; 0]);
    }

    #[test]
    fn times_are_shown_in_milliseconds_without_needless_digits() {
        let shown = [0.005, 0.000_001, 0.25, 0.012_345_6, 1.5].map(shown);
        assert_eq!(shown, ["5 ms", "0.001 ms", "250 ms", "12.346 ms", "1500 ms"]);
    }

    proptest! {
        #[test]
        fn a_bucket_is_never_above_what_is_in_it_and_at_most_3_percent_below(nanos: u64, shift in 0u32..64) {
            let nanos = nanos >> shift;
            let least = least(bucket(nanos));
            prop_assert!(least <= nanos);
            prop_assert!(nanos - least <= nanos / 32);
            prop_assert!(bucket(nanos) < BUCKETS);
        }
    }
}
