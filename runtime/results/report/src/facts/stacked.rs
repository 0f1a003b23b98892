//! Copies of one operation that acted at the same time: how many, and the sums of their choices.
//!
//! This is computed from the observed intervals. Where a campaign keeps copies apart, only regression tests can have
//! any.

use std::collections::{BTreeMap, BTreeSet};

use serde::Serialize;

use sesame_plan::{CampaignPlan, Choice, Domain, Operation, OperationId, OperationKind, Span, Test, ValueMode};
use sesame_present::number;
use sesame_record::TestRecord;

/// An operation whose copies acted at the same time.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Stacked {
    /// The operation.
    pub operation: String,
    /// The most copies that were active at once: 2 or more.
    pub copies: usize,
    /// The sums of their choices, per parameter whose choices add up.
    pub sums: Vec<StackedSum>,
}

/// The sum of the choices of copies for one parameter.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct StackedSum {
    /// The parameter.
    pub parameter: String,
    /// Its unit.
    pub unit: Option<String>,
    /// The greatest sum at any moment, away from zero.
    pub up_to: f64,
    /// The greatest value that the operation declares, away from zero.
    pub declared: f64,
}

impl Stacked {
    /// In words, as in `bias 3 at once: offset up to 0.78 m, declared up to 0.26 m`.
    pub fn words(&self) -> String {
        let sums: Vec<String> = self
            .sums
            .iter()
            .map(|summed| {
                let [sum, declared] =
                    [summed.up_to, summed.declared].map(|value| number::quantity(value, summed.unit.as_deref()));
                format!("{} up to {sum}, declared up to {declared}", summed.parameter)
            })
            .collect();
        let colon = if sums.is_empty() { "" } else { ": " };
        format!("{} {} at once{colon}{}", self.operation, self.copies, sums.join("; "))
    }
}

/// The operations whose copies acted at the same time in a recorded test.
pub(crate) fn stacked_in(plan: &CampaignPlan, record: &TestRecord) -> Vec<Stacked> {
    let observed: Vec<&[Span]> =
        record.observation.operations.iter().map(|operation| operation.intervals.as_slice()).collect();
    stacked(plan, &record.test, &observed)
}

/// The operations of a test whose copies acted at the same time, in the plan's order. `observed` are the intervals of
/// each operation of the test, as far as they are known.
fn stacked(plan: &CampaignPlan, test: &Test, observed: &[&[Span]]) -> Vec<Stacked> {
    let mut copies: BTreeMap<OperationId, Vec<usize>> = BTreeMap::new();
    for (at, used) in test.operations.iter().enumerate().take(observed.len()) {
        copies.entry(used.operation).or_default().push(at);
    }
    copies.into_iter().filter_map(|(id, places)| of_one(plan.operation(id), test, &places, observed)).collect()
}

fn of_one(operation: &Operation, test: &Test, places: &[usize], observed: &[&[Span]]) -> Option<Stacked> {
    // Sweeps over the moments at which copies begin or end; between two of them nothing changes.
    let mut edges: Vec<(f64, bool, usize)> = Vec::new();
    for &at in places {
        for span in observed[at].iter().filter(|span| span.start < span.end) {
            edges.extend([(span.start, true, at), (span.end, false, at)]);
        }
    }
    edges.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
    let mut active: BTreeSet<usize> = BTreeSet::new();
    let mut most = 0;
    let mut sums = vec![0.0f64; operation.parameters.len()];
    for moment in edges.chunk_by(|a, b| a.0 == b.0) {
        for &(_, begins, at) in moment {
            if begins {
                active.insert(at);
            } else {
                active.remove(&at);
            }
        }
        if active.len() < 2 {
            continue;
        }
        most = most.max(active.len());
        for (parameter, greatest) in sums.iter_mut().enumerate() {
            let ends = active.iter().filter_map(|&at| ends(test.operations[at].parameters.get(parameter)?));
            let (low, high) = ends.fold((0.0, 0.0), |(low, high), (from, to)| (low + from, high + to));
            *greatest = greatest.max(f64::abs(low)).max(f64::abs(high));
        }
    }
    let parameters = operation.parameters.iter().zip(sums).filter(|_| adds_up(&operation.kind));
    let sums = parameters.filter_map(|(parameter, up_to)| {
        let &Domain::Number { low, high, .. } = &parameter.domain else { return None };
        let declared = low.abs().max(high.abs());
        Some(StackedSum { parameter: parameter.name.clone(), unit: parameter.unit.clone(), up_to, declared })
    });
    (most > 1).then(|| Stacked { operation: operation.name.clone(), copies: most, sums: sums.collect() })
}

fn ends(choice: &Choice) -> Option<(f64, f64)> {
    match *choice {
        Choice::Value { value } => Some((value, value)),
        Choice::Range { low, high } => Some((low, high)),
        Choice::Point { .. } | Choice::Text { .. } => None,
    }
}

/// Whether two copies that act on one message do what one copy with the sum of their choices does, at the most.
fn adds_up(kind: &OperationKind) -> bool {
    match kind {
        OperationKind::RandomValue { mode, .. } => *mode == ValueMode::Offset,
        OperationKind::Bias | OperationKind::Drift | OperationKind::ClockSkew | OperationKind::Latency { .. } => true,
        _ => false,
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use sesame_plan::{Activation, Search, TestOperation};
    use sesame_search::testing::synthetic_robots::SYNTHETIC_ROBOTS;

    use super::*;

    type Drawn = (u32, (f64, f64), Vec<(f64, f64)>);

    fn drawn() -> impl Strategy<Value = Vec<Drawn>> {
        let pair = || (0i32..12, 0i32..12).prop_map(|(a, b)| (f64::from(a.min(b)), f64::from(a.max(b))));
        // Intervals of one copy do not overlap.
        let intervals = prop::collection::vec(pair(), 0..3).prop_map(|mut spans| {
            spans.sort_by(|a, b| a.partial_cmp(b).unwrap());
            let mut free = 0.0;
            spans.retain(|&(start, end)| {
                let keep = start >= free;
                free = if keep { end } else { free };
                keep
            });
            spans
        });
        let choice = (-3i32..=3, -3i32..=3).prop_map(|(a, b)| (f64::from(a.min(b)) / 10.0, f64::from(a.max(b)) / 10.0));
        prop::collection::vec((0u32..2, choice, intervals), 0..6)
    }

    fn test_of(drawn: &[Drawn]) -> (Test, Vec<Vec<Span>>) {
        let operations = drawn.iter().map(|&(operation, (low, high), _)| TestOperation {
            operation: OperationId(operation),
            activation: Activation::Time { start: 0.0, end: 1.0 },
            parameters: vec![Choice::Range { low, high }],
            operation_seed: 0,
            messages: None,
        });
        let spans =
            drawn.iter().map(|disturbance| disturbance.2.iter().map(|&(start, end)| Span { start, end }).collect());
        (Test { operations: operations.collect() }, spans.collect())
    }

    proptest! {
        /// Beside every moment between two edges, looked at by itself.
        #[test]
        fn what_was_stacked_is_what_moments_say(drawn in drawn()) {
            let plan = SYNTHETIC_ROBOTS[0].plan(Search::new(sesame_plan::Strategy::Random, 1));
            let (test, spans) = test_of(&drawn);
            let observed: Vec<&[Span]> = spans.iter().map(Vec::as_slice).collect();
            let found = stacked(&plan, &test, &observed);
            let mut expected = Vec::new();
            for id in 0..2 {
                let (mut most, mut up_to) = (0, 0.0f64);
                for moment in 0..12 {
                    let now = f64::from(moment) + 0.5;
                    let active: Vec<&Drawn> =
                        drawn.iter().filter(|disturbance| disturbance.0 == id && disturbance.2.iter().any(|&(a, b)| a <= now && now < b)).collect();
                    if active.len() > 1 {
                        most = most.max(active.len());
                        let [low, high] = [active.iter().map(|disturbance| disturbance.1.0).sum::<f64>(), active.iter().map(|disturbance| disturbance.1.1).sum()];
                        up_to = up_to.max(low.abs()).max(high.abs());
                    }
                }
                if most > 1 {
                    expected.push((format!("jitter{id}"), most, up_to));
                }
            }
            prop_assert_eq!(found.len(), expected.len());
            for (found, (name, most, up_to)) in found.iter().zip(expected) {
                prop_assert_eq!((&found.operation, found.copies), (&name, most));
                prop_assert!((found.sums[0].up_to - up_to).abs() < 1e-9 && found.sums[0].declared == 0.3);
            }
        }
    }

    #[test]
    fn three_offsets_at_once_are_told_with_their_sum_and_what_is_declared() {
        let plan = SYNTHETIC_ROBOTS[0].plan(Search::new(sesame_plan::Strategy::Random, 1));
        let at = |start: f64, end: f64| (0, (0.2, 0.26), vec![(start, end)]);
        let words = |drawn: &[Drawn]| {
            let (test, spans) = test_of(drawn);
            let observed: Vec<&[Span]> = spans.iter().map(Vec::as_slice).collect();
            stacked(&plan, &test, &observed).iter().map(Stacked::words).collect::<Vec<_>>()
        };
        let three = words(&[at(0.0, 5.0), at(2.0, 9.0), at(4.0, 6.0)]);
        assert_eq!(three, ["jitter0 3 at once: offset up to 0.78 rad, declared up to 0.3 rad"]);
        assert_eq!(words(&[at(0.0, 5.0), at(5.0, 9.0)]), [""; 0], "one after the other");
    }
}
