//! Which sets of operations were seen to violate a requirement, and which were tried together: for the rules that stop
//! a search by its causes.

use std::collections::BTreeSet;

use sesame_base::observation::Observation;
use sesame_plan::{CampaignPlan, OperationId};

use crate::Evaluated;
use crate::margin::{evaluated_margins, margins};

/// What the tests of a search have shown so far.
#[derive(Debug, Clone)]
pub(super) struct Seen {
    plan: CampaignPlan,
    /// For each requirement that the undisturbed system keeps the sets of operations that violate it, none of which
    /// contains another one. A requirement that it violates without any operation has no causes.
    smallest: Vec<Option<Vec<BTreeSet<OperationId>>>>,
    /// Since how many tests none of them changed.
    unchanged: u32,
    /// Operations that had an effect in a test.
    effective: BTreeSet<OperationId>,
    /// Each two operations that acted in one test, the lower one first.
    together: BTreeSet<(OperationId, OperationId)>,
    /// Each two operations that were in one test, whether they acted or not.
    held: BTreeSet<(OperationId, OperationId)>,
}

impl Seen {
    pub(super) fn new(plan: &CampaignPlan) -> Seen {
        Seen {
            smallest: vec![Some(Vec::new()); plan.requirements.len()],
            unchanged: 0,
            effective: BTreeSet::new(),
            together: BTreeSet::new(),
            held: BTreeSet::new(),
            plan: plan.clone(),
        }
    }

    pub(super) fn begin(&mut self, reference: &Observation) {
        for (smallest, margin) in self.smallest.iter_mut().zip(margins(&self.plan, reference)) {
            *smallest = smallest.take().filter(|_| !margin.violated);
        }
    }

    pub(super) fn tell(&mut self, result: &Evaluated) {
        self.unchanged += 1;
        let of = |wanted: &dyn Fn(usize) -> bool| -> BTreeSet<OperationId> {
            let used = result.test.operations.iter().enumerate();
            used.filter(|(at, _)| wanted(*at)).map(|(_, used)| used.operation).collect()
        };
        let acting = of(&|at| result.acted(at));
        self.held.extend(pairs(&of(&|_| true)));
        self.together.extend(pairs(&acting));
        self.effective.extend(&acting);
        if acting.is_empty() {
            return;
        }
        let margins = evaluated_margins(&self.plan, result);
        for (smallest, margin) in self.smallest.iter_mut().zip(margins) {
            let Some(smallest) = smallest else { continue };
            if margin.violated && !smallest.iter().any(|known| known.is_subset(&acting)) {
                smallest.retain(|known| !acting.is_subset(known));
                smallest.push(acting.clone());
                self.unchanged = 0;
            }
        }
    }

    /// Since how many tests there was no new cause.
    pub(super) fn unchanged(&self) -> u32 {
        self.unchanged
    }

    /// How many causes there are.
    pub(super) fn causes(&self) -> usize {
        self.smallest.iter().flatten().map(Vec::len).sum()
    }

    /// How many pairs of operations there are, if each was tried. A pair was tried if both operations acted in one
    /// test, or if one of the two never acts in any and both were in one test, or if causes of all requirements are in
    /// it. A campaign whose tests hold one operation never tries a pair.
    pub(super) fn pairs_if_tried(&self) -> Option<usize> {
        let campaign = &self.plan.campaign;
        if campaign.count.max < 2 {
            return None;
        }
        let all: BTreeSet<OperationId> = campaign.operations.iter().copied().collect();
        let causes: Vec<&Vec<BTreeSet<OperationId>>> = self.smallest.iter().flatten().collect();
        let is_tried = |&(first, second): &(OperationId, OperationId)| {
            let both = BTreeSet::from([first, second]);
            self.together.contains(&(first, second))
                || (self.held.contains(&(first, second)) && !both.is_subset(&self.effective))
                || !causes.is_empty() && causes.iter().all(|known| known.iter().any(|cause| cause.is_subset(&both)))
        };
        let mut count = 0;
        for pair in pairs(&all) {
            if !is_tried(&pair) {
                return None;
            }
            count += 1;
        }
        Some(count)
    }
}

/// Each two of these, the lower one first.
fn pairs(of: &BTreeSet<OperationId>) -> impl Iterator<Item = (OperationId, OperationId)> + '_ {
    of.iter().enumerate().flat_map(|(at, &first)| of.iter().skip(at + 1).map(move |&second| (first, second)))
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use proptest::prelude::*;

    use sesame_base::observation::{Counters, MetricObservation, Observation, OperationEffect, Outcome};
    use sesame_optimise::dominance::Fitness;
    use sesame_plan::testing::{requirement, test_of, use_of};
    use sesame_plan::{Bound, Count, Search, Strategy};

    use super::*;
    use crate::testing::synthetic_robots::SYNTHETIC_ROBOTS;

    const OPERATIONS: u32 = 4;

    fn plan(max: u32) -> CampaignPlan {
        let mut plan = SYNTHETIC_ROBOTS[0].plan(Search::new(Strategy::Random, 1));
        plan.requirements = vec![requirement("kept", 0, Bound::AtMost { value: 0.0 })];
        plan.campaign.operations = (0..OPERATIONS).map(OperationId).collect();
        plan.campaign.count = Count { min: 1, max };
        plan
    }

    /// A test of these operations, of which those without an effect are marked.
    fn result(number: u32, operations: &[(u32, bool)], violates: bool) -> Evaluated {
        let uses = operations.iter().map(|&(at, _)| use_of(at, 0.0, 1.0, vec![], 1)).collect();
        let effects = operations.iter().map(|&(_, acts)| OperationEffect {
            counters: Counters { changed: u64::from(acts), ..Counters::default() },
            ..OperationEffect::default()
        });
        let value = MetricObservation::whole(Some(f64::from(u8::from(violates))), true, Vec::new());
        let run = Observation {
            operations: effects.collect(),
            metrics: vec![value],
            ..Observation::without_run(Outcome::Completed)
        };
        Evaluated {
            number,
            test: test_of(uses),
            fitness: Fitness::Measured(vec![0.0]),
            point: None,
            run: Arc::new(run),
            fresh_runs: Vec::new(),
        }
    }

    #[test]
    fn a_violation_that_a_known_cause_explains_is_no_new_cause() {
        let mut seen = Seen::new(&plan(3));
        seen.tell(&result(1, &[(0, true), (1, true)], true));
        assert_eq!((seen.causes(), seen.unchanged()), (1, 0));
        seen.tell(&result(2, &[(0, true), (1, true), (2, true)], true));
        assert_eq!((seen.causes(), seen.unchanged()), (1, 1));
        // The operation that had no effect is not to blame: what is left is smaller than what was known.
        seen.tell(&result(3, &[(0, true), (1, false)], true));
        assert_eq!((seen.causes(), seen.unchanged()), (1, 0));
        seen.tell(&result(4, &[(2, true)], false));
        assert_eq!((seen.causes(), seen.unchanged()), (1, 1));
    }

    #[test]
    fn what_the_undisturbed_system_violates_has_no_causes() {
        let mut plan = plan(3);
        plan.requirements.push(requirement("violated at once", 0, Bound::AtLeast { value: 5.0 }));
        let mut seen = Seen::new(&plan);
        seen.begin(&result(1, &[], false).run);
        seen.tell(&result(2, &[(0, true)], false));
        assert_eq!((seen.causes(), seen.unchanged()), (0, 1));
        seen.tell(&result(3, &[(1, true)], true));
        assert_eq!((seen.causes(), seen.unchanged()), (1, 0));
    }

    #[test]
    fn pairs_that_cannot_act_or_hold_known_causes_need_not_act_together() {
        let mut seen = Seen::new(&plan(2));
        seen.tell(&result(1, &[(0, true)], true));
        for (number, second) in [(2, 2), (3, 3)] {
            assert_eq!(seen.pairs_if_tried(), None, "before {number}");
            seen.tell(&result(number, &[(1, true), (second, second != 3)], false));
        }
        // Nothing was said about 2 and 3 yet, and 3 never has an effect.
        assert_eq!(seen.pairs_if_tried(), None);
        seen.tell(&result(4, &[(2, true), (3, false)], false));
        assert_eq!(seen.pairs_if_tried(), Some(6));
        let mut alone = Seen::new(&plan(1));
        (0..OPERATIONS).for_each(|at| alone.tell(&result(at, &[(at, true)], false)));
        assert_eq!(alone.pairs_if_tried(), None);
    }

    proptest! {
        /// Beside a reading of all tests at once.
        #[test]
        fn what_is_known_after_a_search_is_what_its_tests_say_together(
            tests in prop::collection::vec((prop::collection::btree_map(0..OPERATIONS, any::<bool>(), 1..4), any::<bool>()), 1..30),
        ) {
            let mut seen = Seen::new(&plan(3));
            for (number, (operations, violates)) in (1..).zip(&tests) {
                let used: Vec<(u32, bool)> = operations.iter().map(|(&at, &acts)| (at, acts)).collect();
                seen.tell(&result(number, &used, *violates));
            }
            let acting = |operations: &std::collections::BTreeMap<u32, bool>| -> BTreeSet<u32> {
                operations.iter().filter(|(_, acts)| **acts).map(|(at, _)| *at).collect()
            };
            let violating: BTreeSet<BTreeSet<u32>> =
                tests.iter().filter(|(_, violates)| *violates).map(|(used, _)| acting(used)).collect();
            let violating: Vec<_> = violating.into_iter().filter(|set| !set.is_empty()).collect();
            let smallest = violating.iter().filter(|set| !violating.iter().any(|o| o != *set && o.is_subset(set)));
            prop_assert_eq!(seen.causes(), smallest.count());
            let pairs: Vec<(u32, u32)> = (0..OPERATIONS).flat_map(|a| (a + 1..OPERATIONS).map(move |b| (a, b))).collect();
            let acts = |at: u32| tests.iter().any(|(used, _)| acting(used).contains(&at));
            let tried = pairs.iter().all(|(a, b)| {
                let both = BTreeSet::from([*a, *b]);
                tests.iter().any(|(used, _)| both.is_subset(&acting(used)))
                    || violating.iter().any(|set| set.is_subset(&both))
                    || ((!acts(*a) || !acts(*b)) && tests.iter().any(|(used, _)| both.iter().all(|at| used.contains_key(at))))
            });
            prop_assert_eq!(seen.pairs_if_tried().is_some(), tried);
        }
    }
}
