//! What formulas compute from successive messages: previous values, rates and integrals.
//!
//! Each value that is read has a memory of its own, and so has each member of a group, whose messages come at times of
//! their own. Between messages a value holds, as everywhere in formulas: so an integral grows by the last value until
//! the next message, and no line is drawn between two samples. A value that is not finite says nothing about those
//! before and after it, so previous values and rates begin anew behind it, and an integral rests.

use sesame_base::time::SimTime;
use sesame_plan::{CampaignPlan, Input, Memory};

use crate::metric::expression::Held;
use crate::metric::held::{HeardValues, NOT_FINITE, is_finite, members_of};

/// The memories of all inputs of a formula.
#[derive(Debug, Clone, Default)]
pub(crate) struct Memories {
    /// Per input that has any, with its position: the stages of each member.
    inputs: Vec<(usize, Vec<Vec<Stage>>)>,
}

impl Memories {
    /// Before the first message.
    pub(crate) fn new(inputs: &[Input], plan: &CampaignPlan) -> Self {
        let remembered = inputs.iter().enumerate().filter(|(_, input)| !input.memory.is_empty());
        let stages = |input: &Input| input.memory.iter().copied().map(Stage::new).collect::<Vec<Stage>>();
        let members = |input: &Input| vec![stages(input); members_of(input, plan)];
        Memories { inputs: remembered.map(|(at, input)| (at, members(input))).collect() }
    }

    /// Whether there is nothing to remember.
    pub(crate) fn is_empty(&self) -> bool {
        self.inputs.is_empty()
    }

    /// Remembers the values that a message on the `member`th path of a topic has, and puts what is computed from them
    /// in their place. Values that need more messages than came are taken out.
    pub(crate) fn remember(&mut self, heard: &mut HeardValues, member: usize, now: SimTime) {
        for (at, members) in &mut self.inputs {
            let stages = match members.as_mut_slice() {
                [one] => one,
                members => &mut members[member],
            };
            heard.replace(*at, |value| stages.iter_mut().try_fold(value, |value, stage| stage.take(value, now)));
        }
    }
}

/// What one computation keeps of the values that it got.
#[derive(Debug, Clone)]
enum Stage {
    Previous(Option<Held>),
    Rate {
        last: Option<(SimTime, Held)>,
        /// The last one of an earlier instant.
        earlier: Option<(SimTime, Held)>,
    },
    Integral {
        sum: f64,
        since: Option<(SimTime, f64)>,
    },
    Unwrapped {
        turn: f64,
        /// What it came to last.
        last: Option<f64>,
    },
}

impl Stage {
    fn new(memory: Memory) -> Self {
        match memory {
            Memory::Previous => Stage::Previous(None),
            Memory::Rate => Stage::Rate { last: None, earlier: None },
            Memory::Integral => Stage::Integral { sum: 0.0, since: None },
            Memory::Unwrapped { turn } => Stage::Unwrapped { turn: turn.0, last: None },
        }
    }

    /// Takes the next value, at this time. Returns what is computed, if there is anything yet.
    fn take(&mut self, value: Held, now: SimTime) -> Option<Held> {
        let finite = is_finite(value);
        match self {
            Stage::Previous(last) => {
                let previous = std::mem::replace(last, finite.then_some(value));
                if finite { previous } else { Some(NOT_FINITE) }
            }
            Stage::Rate { last, earlier } => {
                if !finite {
                    (*last, *earlier) = (None, None);
                    return Some(NOT_FINITE);
                }
                // Of several messages of an instant the last one counts: no time passes between them.
                if last.is_some_and(|(time, _)| time < now) {
                    *earlier = *last;
                }
                *last = Some((now, value));
                let (time, before) = (*earlier)?;
                let seconds = (now - time).seconds();
                let rate = [0, 1, 2].map(|axis| (value[axis] - before[axis]) / seconds);
                is_finite(rate).then_some(rate)
            }
            Stage::Integral { sum, since } => {
                if let Some((time, held)) = *since {
                    *sum += held * (now - time).seconds();
                }
                *since = finite.then_some((now, value[0]));
                if !finite {
                    return Some(NOT_FINITE);
                }
                sum.is_finite().then_some([*sum, value[0], now.seconds()])
            }
            Stage::Unwrapped { turn, last } => {
                if !finite {
                    *last = None;
                    return Some(NOT_FINITE);
                }
                let turns = last.map_or(0.0, |last| libm::round((last - value[0]) / *turn));
                let followed = value[0] + turns * *turn;
                *last = Some(followed);
                Some([followed, 0.0, 0.0])
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;
    use crate::metric::expression::integral;

    /// A message: milliseconds, value.
    type Sent = (i64, f64);

    /// What the last of these messages comes to, by one computation after the other.
    fn taken(memory: &[Memory], sent: &[Sent]) -> Option<f64> {
        let mut stages: Vec<Stage> = memory.iter().copied().map(Stage::new).collect();
        let mut last = None;
        for &(time, value) in sent {
            let value = if value.is_finite() { [value, 0.0, 0.0] } else { NOT_FINITE };
            let now = SimTime::from_nanos(time * 1_000_000);
            last = stages.iter_mut().try_fold(value, |value, stage| stage.take(value, now));
        }
        last.map(|held| held[0]).filter(|value| value.is_finite())
    }

    /// The messages after the last one that is not finite.
    fn unbroken(sent: &[Sent]) -> &[Sent] {
        let broken = sent.iter().rposition(|(_, value)| !value.is_finite());
        broken.map_or(sent, |at| &sent[at + 1..])
    }

    fn previous(sent: &[Sent]) -> Option<f64> {
        let of = unbroken(sent);
        of.len().checked_sub(2).map(|at| of[at].1)
    }

    fn rate(sent: &[Sent]) -> Option<f64> {
        let of = unbroken(sent);
        let last = of.last()?;
        let earlier = of.iter().rev().find(|(time, _)| *time < last.0)?;
        Some((last.1 - earlier.1) / ((last.0 - earlier.0) as f64 * 1e-3))
    }

    /// As a sum over milliseconds, each with the value that it begins with.
    fn integral_until(sent: &[Sent], end: i64) -> f64 {
        let value_at = |time: i64| sent.iter().rev().find(|(sent, _)| *sent <= time).map_or(0.0, |(_, value)| *value);
        let finite = |value: f64| if value.is_finite() { value } else { 0.0 };
        (0..end).map(|time| finite(value_at(time))).sum::<f64>() * 1e-3
    }

    fn any_sent() -> impl Strategy<Value = Vec<Sent>> {
        let value = prop_oneof![8 => (-20..20_i32).prop_map(f64::from), 1 => Just(f64::NAN)];
        prop::collection::vec((0..40_i64, value), 1..12).prop_map(|steps| {
            let mut time = 0;
            let step = |(after, value): (i64, f64)| {
                time += (after - 5).max(0);
                (time, value)
            };
            steps.into_iter().map(step).collect()
        })
    }

    fn close(found: Option<f64>, expected: Option<f64>) -> bool {
        match (found, expected) {
            (Some(found), Some(expected)) => (found - expected).abs() <= 1e-9 * expected.abs().max(1.0),
            (found, expected) => found == expected,
        }
    }

    proptest! {
        #[test]
        fn each_computation_is_that_of_all_messages_so_far(sent in any_sent()) {
            prop_assert_eq!(taken(&[Memory::Previous], &sent), previous(&sent));
            prop_assert!(close(taken(&[Memory::Rate], &sent), rate(&sent)));
            let &(end, value) = sent.last().unwrap();
            let expected = value.is_finite().then(|| integral_until(&sent, end));
            prop_assert!(close(taken(&[Memory::Integral], &sent), expected));
        }

        #[test]
        fn computations_of_computations_get_their_values_as_if_these_were_sent(sent in any_sent()) {
            let rates = (1..=sent.len()).filter_map(|count| {
                let broken = !sent[count - 1].1.is_finite();
                let rate = if broken { Some(f64::NAN) } else { rate(&sent[..count]) };
                rate.map(|rate| (sent[count - 1].0, rate))
            });
            let rates: Vec<Sent> = rates.collect();
            let is_told = rates.last().is_some_and(|last| last.0 == sent.last().unwrap().0) && rate(&sent).is_some();
            let expected = is_told.then(|| rate(&rates)).flatten();
            prop_assert!(close(taken(&[Memory::Rate, Memory::Rate], &sent), expected));
        }
    }

    proptest! {
        /// What turns by less than half a turn from one message to the next, and is sent without whole turns.
        #[test]
        fn an_angle_that_is_followed_has_all_its_turns(steps in prop::collection::vec(-179..180_i32, 1..30)) {
            let mut stage = Stage::new(Memory::Unwrapped { turn: sesame_plan::Finite(360.0) });
            let mut turned = 0;
            for step in steps {
                turned += step;
                let sent = [f64::from((turned + 180).rem_euclid(360) - 180), 0.0, 0.0];
                prop_assert_eq!(stage.take(sent, SimTime::ZERO), Some([f64::from(turned), 0.0, 0.0]));
            }
        }
    }

    #[test]
    fn between_messages_an_integral_grows_by_the_last_value() {
        let mut stage = Stage::new(Memory::Integral);
        stage.take([3.0, 0.0, 0.0], SimTime::from_seconds(1.0)).unwrap();
        let held = stage.take([-2.0, 0.0, 0.0], SimTime::from_seconds(5.0)).unwrap();
        assert_eq!([5.0, 6.0, 11.0].map(|time| integral(held, time)), [12.0, 10.0, 0.0]);
    }
}
