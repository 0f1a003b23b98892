//! What an agent does with a test that the queue delivers, and how long the test may take on its machine. It has no
//! clock and no connection.

use std::time::Duration;

use crate::message::{AgentName, Limit, Work};

/// A test that was delivered more often is not tried again: each time, its agent was lost with it.
pub const MOST_DELIVERIES: u64 = 10;

/// How often machines that had a fault with a test leave it to others. If it comes back after that, no others are
/// there, and one of them tries again.
const POLITE: u32 = 3;

/// How long a machine keeps a test that it leaves to others before it puts it back, so that others come first.
const REST: Duration = Duration::from_secs(1);

/// What an agent does with a test.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Decision {
    /// It runs it.
    Run,
    /// It puts it back for others, after this time.
    LeaveToOthers(Duration),
    /// It says that nobody should try it again, since this many agents were lost with it.
    Poison {
        /// How many.
        lost: u64,
    },
}

/// Decides about a test that is delivered for the `deliveries`-th time.
pub fn decide(me: &AgentName, work: &Work, deliveries: u64) -> Decision {
    if deliveries > MOST_DELIVERIES {
        Decision::Poison { lost: deliveries - 1 }
    } else if work.avoid.contains(&me.machine) && work.put_back < POLITE {
        Decision::LeaveToOthers(REST)
    } else {
        Decision::Run
    }
}

/// What an agent knows of its machine, as far as it matters for a campaign.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct Experience {
    /// Whether a run has ever ended here as a whole. Until then, what breaks off may be for lack of what the simulator
    /// needs.
    succeeded: bool,
    /// How long a run without disturbance takes here, once that was measured.
    own: Option<Duration>,
}

impl Experience {
    /// How long a test may take here: longer in the ratio of the reference runs if this machine is slower than the one
    /// of the campaign's reference run, never shorter.
    pub fn timeout(&self, limit: Limit) -> Duration {
        match (self.own, limit.reference) {
            (Some(own), Some(reference)) if own > reference && !reference.is_zero() => {
                limit.timeout.mul_f64(own.as_secs_f64() / reference.as_secs_f64())
            }
            _ => limit.timeout,
        }
    }

    /// Whether a test that did not end as a whole says nothing yet: a run without disturbance has to show first that
    /// this machine can run the campaign, and if the test was stopped after its time, how long that takes here.
    pub fn doubts(&self, timed_out: bool, limit: Limit) -> bool {
        !self.succeeded || timed_out && self.own.is_none() && limit.reference.is_some()
    }

    /// A run has ended as a whole.
    pub fn succeeded(&mut self) {
        self.succeeded = true;
    }

    /// A run without disturbance has ended as a whole, and took this long.
    pub fn measured(&mut self, own: Duration) {
        self.succeeded = true;
        self.own = Some(own);
    }
}

#[cfg(test)]
mod tests {
    use serde_json::value::RawValue;

    use super::*;

    fn work(avoid: &[&str], put_back: u32) -> Work {
        let limit = Limit { timeout: Duration::from_secs(60), reference: None };
        let avoid = avoid.iter().map(|&name| name.to_owned()).collect();
        let (job, edition, session) = (RawValue::NULL.to_owned(), String::new(), String::new());
        Work { number: 1, attempt: 0, job, edition, session, put_back, avoid, limit, records: false }
    }

    #[test]
    fn a_test_is_left_to_others_three_times_and_given_up_after_ten_deliveries() {
        let me = AgentName { machine: "a".to_owned(), id: "1".to_owned() };
        assert_eq!(decide(&me, &work(&[], 0), 1), Decision::Run);
        assert_eq!(decide(&me, &work(&["b"], 0), 1), Decision::Run);
        for put_back in 0..3 {
            assert_eq!(decide(&me, &work(&["a"], put_back), 1), Decision::LeaveToOthers(REST));
        }
        assert_eq!(decide(&me, &work(&["a"], 3), 1), Decision::Run);
        assert_eq!(decide(&me, &work(&[], 0), 10), Decision::Run);
        assert_eq!(decide(&me, &work(&[], 0), 11), Decision::Poison { lost: 10 });
    }

    #[test]
    fn a_slower_machine_has_more_time_in_the_ratio_of_the_reference_runs() {
        let limit = |reference| Limit { timeout: Duration::from_secs(60), reference };
        let second = Duration::from_secs(1);
        let mut experience = Experience::default();
        assert_eq!(experience.timeout(limit(Some(second))), 60 * second);
        experience.measured(3 * second);
        assert_eq!(experience.timeout(limit(Some(second))), 180 * second);
        assert_eq!(experience.timeout(limit(Some(6 * second))), 60 * second, "never less");
        assert_eq!(experience.timeout(limit(None)), 60 * second);
        assert_eq!(experience.timeout(limit(Some(Duration::ZERO))), 60 * second);
    }

    #[test]
    fn what_breaks_off_counts_once_the_machine_has_shown_what_it_can() {
        let limit = |reference| Limit { timeout: Duration::from_secs(60), reference };
        let known = limit(Some(Duration::from_secs(1)));
        let mut experience = Experience::default();
        assert!(experience.doubts(false, known) && experience.doubts(false, limit(None)));
        experience.succeeded();
        assert!(!experience.doubts(false, known) && experience.doubts(true, known));
        assert!(!experience.doubts(true, limit(None)), "there is nothing to compare with");
        experience.measured(Duration::from_secs(1));
        assert!(!experience.doubts(true, known));
    }
}
