//! How long messages were on their way through the relay: how many took how long, in a memory of fixed size.
//!
//! It is wall time, and never part of what a run is compared by.

use std::collections::BTreeMap;
use std::time::Duration;

use serde::{Deserialize, Serialize};

/// Each power of two is divided into so many buckets, as a power of two: what is read is at most 3 % too small.
const FINE: u16 = 5;

/// As many as there are nanoseconds in 64 bits, in buckets.
const BUCKETS: u16 = (64 - FINE + 1) << FINE;

/// How long each of many messages took, to within 3 %. Those of several runs can be taken together.
#[derive(Debug, Clone, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(try_from = "Stored", into = "Stored")]
pub struct Latencies {
    /// How many messages by the logarithm of the time they took.
    counts: BTreeMap<u16, u64>,
    /// The longest time, in nanoseconds.
    longest: u64,
}

/// What is written: buckets with their counts, and the longest time in nanoseconds.
#[derive(Clone, Serialize, Deserialize)]
struct Stored {
    counts: Vec<(u16, u64)>,
    longest: u64,
}

impl Latencies {
    /// A message took so long.
    pub fn record(&mut self, took: Duration) {
        let nanos = u64::try_from(took.as_nanos()).unwrap_or(u64::MAX);
        let count = self.counts.entry(bucket(nanos)).or_default();
        *count = count.saturating_add(1);
        self.longest = self.longest.max(nanos);
    }

    /// Takes those of another run with them.
    pub fn add(&mut self, other: &Latencies) {
        for (&bucket, &more) in &other.counts {
            let count = self.counts.entry(bucket).or_default();
            *count = count.saturating_add(more);
        }
        self.longest = self.longest.max(other.longest);
    }

    /// How many messages there were.
    pub fn messages(&self) -> u64 {
        self.counts.values().fold(0, |sum, &count| sum.saturating_add(count))
    }

    /// The time that so many of a hundred messages took at most, in seconds, at most 3 % too small; `None` without a
    /// message. `percent` is in `1..=100`.
    pub fn percentile(&self, percent: u8) -> Option<f64> {
        let rank = (u128::from(self.messages()) * u128::from(percent)).div_ceil(100);
        let mut below = 0u128;
        let found = self.counts.iter().find(|(_, count)| {
            below += u128::from(**count);
            below >= rank
        });
        found.map(|(&bucket, _)| Duration::from_nanos(least(bucket)).as_secs_f64())
    }

    /// The longest time, in seconds; `None` without a message.
    pub fn longest(&self) -> Option<f64> {
        (!self.counts.is_empty()).then(|| Duration::from_nanos(self.longest).as_secs_f64())
    }
}

impl From<Latencies> for Stored {
    fn from(Latencies { counts, longest }: Latencies) -> Self {
        Stored { counts: counts.into_iter().collect(), longest }
    }
}

impl TryFrom<Stored> for Latencies {
    type Error = String;

    fn try_from(Stored { counts, longest }: Stored) -> Result<Self, String> {
        if let Some((bucket, _)) = counts.iter().find(|(bucket, _)| *bucket >= BUCKETS) {
            return Err(format!("there is no bucket {bucket}; the last one is {}", BUCKETS - 1));
        }
        // Messages without count would have a longest time and no others.
        let counts: BTreeMap<u16, u64> = counts.into_iter().filter(|(_, count)| *count > 0).collect();
        Ok(Latencies { counts, longest })
    }
}

/// The bucket of so many nanoseconds.
fn bucket(nanos: u64) -> u16 {
    let octave = (u64::BITS - nanos.leading_zeros()).saturating_sub(u32::from(FINE) + 1);
    // The highest bit of `nanos >> octave` is set, unless the octave is the first.
    u16::try_from((u64::from(octave) << FINE) + (nanos >> octave)).unwrap_or(BUCKETS - 1)
}

/// The least number of nanoseconds of a bucket.
fn least(bucket: u16) -> u64 {
    let octave = (bucket >> FINE).saturating_sub(1);
    u64::from(bucket - (octave << FINE)) << octave
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    fn of(milliseconds: impl IntoIterator<Item = f64>) -> Latencies {
        let mut latencies = Latencies::default();
        milliseconds.into_iter().for_each(|latency| latencies.record(Duration::from_secs_f64(latency / 1000.0)));
        latencies
    }

    #[test]
    fn percentiles_are_times_that_were_taken_and_runs_can_be_taken_together() {
        assert_eq!((Latencies::default().percentile(50), Latencies::default().longest()), (None, None));
        let mut all = of((0..98).map(|_| 0.25));
        all.add(&of([7.2, 7.2]));
        assert_eq!(all.messages(), 100);
        assert_eq!(all.percentile(50), Some(0.000_249_856));
        assert_eq!(all.percentile(98), all.percentile(50));
        let most = all.percentile(99).unwrap();
        assert!((0.0072 * 0.97..=0.0072).contains(&most), "{most}");
        assert_eq!(all.longest(), Some(0.0072));
    }

    #[test]
    fn what_is_written_comes_back_and_what_cannot_be_is_refused() {
        let all = of([0.1, 3.0, 3.0, 900.0]);
        let text = serde_json::to_string(&all).unwrap();
        assert_eq!(serde_json::from_str::<Latencies>(&text).unwrap(), all);
        let said = serde_json::from_str::<Latencies>(r#"{"counts": [[1920, 1]], "longest": 1}"#).unwrap_err();
        assert!(said.to_string().contains("there is no bucket 1920"), "{said}");
        let many = format!(r#"{{"counts": [[1919, {0}], [1918, {0}]], "longest": 1}}"#, u64::MAX);
        let many: Latencies = serde_json::from_str(&many).unwrap();
        assert_eq!(many.messages(), u64::MAX);
        assert!(many.percentile(100).is_some(), "counts of others do not overflow");
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
