//! Variation of tests: crossover of their lists of operations, mutation of single operations and of the list.
//!
//! A mutated operation draws with a new seed; one that a child has from a parent with that parent's, also if its window
//! had to give way to another copy. Of copies that come to one child with equal seeds, the later gets a new one: two
//! copies never draw alike. A child is never one of the tests
//! asked before in the same campaign (apart from operation seeds), unless [`Rates::tries`] attempts to change it all
//! fail.
//!
//! # Rates
//!
//! Chosen on four synthetic robots with hidden phases of vulnerability, hits to be maximised and active time minimised.
//! What counts is the hypervolume of the final front, as a multiple of random search's with the same budget (geometric
//! mean over the robots; 200 seeds with population 10 and 210 evaluations, 60 seeds with 20 and 1000). The default
//! reaches 1.51 and 1.70. Of each rate, the default and what other values do to that:
//!
//! | rate        | default    | population 10, 210 evaluations   | population 20, 1000 evaluations  |
//! |-------------|------------|----------------------------------|----------------------------------|
//! | `crossover` | 0.9        | 0: 1.32, 0.5: 1.47               | 0: 1.56, 0.5: 1.66               |
//! | `window`    | 0.4        | 0.1: 1.40, 0.2: 1.41, 0.8: 1.54  | 0.1: 1.57, 0.2: 1.63, 0.8: 1.68  |
//! | `parameter` | 0.3        | 0: 1.46, 0.1: 1.49, 0.8: 1.49    | 0: 1.66, 0.1: 1.70, 0.8: 1.62    |
//! | `fresh`     | 0.2        | 0: 1.43, 0.5: 1.53, 1: 1.41      | 0: 1.59, 0.5: 1.64, 1: 1.48      |
//! | `retarget`  | 0.05       | 0: 1.49, 0.2: 1.49               | 0: 1.67, 0.2: 1.62               |
//! | `add`       | 0.8        | 0.1: 1.17, 0.4: 1.34             | 0.1: 1.37, 0.4: 1.55             |
//! | `duplicate` | 0.5        | 0: 1.31, 0.25: 1.42, 0.8: 1.55   | 0: 1.43, 0.25: 1.59, 0.8: 1.68   |
//! | `drop`      | 0.2        | 0: 1.49, 0.5: 1.47               | 0: 1.67, 0.5: 1.64               |
//! | `steps`     | 0.01, 0.2  | 0.01, 0.05: 1.44; 0.1, 0.5: 1.50 | 0.01, 0.05: 1.64; 0.1, 0.5: 1.66 |
//!
//! Growth has to be much likelier than loss: selection for little active time empties lists and shortens windows by
//! itself, and without a steady supply of operations a small population ends among short tests that hit nothing. With
//! `add` 0.1, `duplicate` 0.05 and `drop` 0.15 it comes to 0.92 and 1.08: worse than chance on the smaller budget.
//!
//! # Rates by condition
//!
//! The paper's platform regrows a part of a condition in two of three operations and crosses conditions place by place;
//! how often is best was measured on the same robots with conditions over two positions and a count of parts
//! (population 10, 210 evaluations, 8 to 16 seeds). With the rates above and conditions that end activations, evolution
//! comes to 0.79 of chance: a condition says little about how long an operation is active, so selection runs into tests
//! of one active step that hit nothing. Changing conditions twice as often (`window` 0.8) and regrowing half the time
//! (`fresh` 0.5) gives 1.22; `fresh` 0.8 gives 1.03, and without `exchange` the rates above give 0.59. With lengths of
//! 1 s to 15 s it gives 1.93. What remains is uneven: by end conditions 1.2 to 2.0 on three robots, and 0.7 on one
//! where two operations have to meet in a short phase.

use std::collections::BTreeSet;

use sesame_optimise::nsga2::{Child, Heritage, Variation};
use sesame_plan::condition::{Condition, ConditionEnd, ConditionSpace, Constraint};
use sesame_plan::{Activation, Test, TestOperation};
use sesame_rng::Stream;

use crate::space::condition::{self, contains};
use crate::space::initial::{fresh_operation, fresh_test};
use crate::space::range::{Range, StepSizes};
use crate::space::test_space::{ActivationSpace, OperationSpace, TestSpace};
use crate::test_key::TestKey;

/// How often what is varied. All are probabilities except `steps` and `tries`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Rates {
    /// Of each pair: that its lists are crossed.
    pub crossover: f64,
    /// Of each two operations at the same place in the lists of a pair that was to be crossed: that their start
    /// conditions exchange parts, and by a draw of their own their end conditions.
    pub exchange: f64,
    /// Of each operation: that its window changes, or one of its conditions, or its length.
    pub window: f64,
    /// Of each parameter of each operation: that it changes.
    pub parameter: f64,
    /// Of each change of a window, length or parameter: that it is drawn anew instead of moved a little. Of each change
    /// of a condition: that a part of it is grown anew, instead of one sign, number or variable changed.
    pub fresh: f64,
    /// Of each operation: that a fresh instance of another operation takes its place and keeps its window or
    /// conditions, as far as that is permitted there.
    pub retarget: f64,
    /// Of each test: that a fresh operation joins it.
    pub add: f64,
    /// Of each test: that a copy of one of its operations, with its window or conditions changed, joins it.
    pub duplicate: f64,
    /// Of each test: that an operation leaves it.
    pub drop: f64,
    /// How far windows and parameters move.
    pub steps: StepSizes,
    /// How often a child that equals an earlier test is mutated again.
    pub tries: u32,
}

impl Default for Rates {
    fn default() -> Self {
        Rates {
            crossover: 0.9,
            exchange: 0.2,
            window: 0.4,
            parameter: 0.3,
            fresh: 0.2,
            retarget: 0.05,
            add: 0.8,
            duplicate: 0.5,
            drop: 0.2,
            steps: StepSizes { finest: 0.01, boldest: 0.2 },
            tries: 20,
        }
    }
}

impl Rates {
    /// The default rates where conditions switch.
    pub fn by_condition() -> Self {
        Rates { window: 0.8, fresh: 0.5, ..Rates::default() }
    }
}

/// [`Variation`] of the tests of one campaign.
#[derive(Debug, Clone)]
pub struct TestVariation {
    test_space: TestSpace,
    rates: Rates,
    seed: u64,
    /// All tests made so far, by their [`key`]: whole they would be most of what a search of many tests holds in
    /// memory.
    made: BTreeSet<TestKey>,
}

impl TestVariation {
    /// Variation of what is permitted, at these rates, with all draws from streams of the seed.
    pub fn new(test_space: TestSpace, rates: Rates, seed: u64) -> Self {
        TestVariation { test_space, rates, seed, made: BTreeSet::new() }
    }

    /// Mutates a permitted test once more.
    pub(crate) fn mutate_again(&self, test: &mut Test, stream: &mut Stream) {
        mutate(test, &self.test_space, &self.rates, stream);
    }

    /// Notes a test that was made elsewhere. False if it was made before.
    pub(crate) fn claim(&mut self, test: &Test) -> bool {
        self.made.insert(TestKey::without_seeds(test))
    }
}

impl Variation for TestVariation {
    type Genome = Test;

    fn initial(&mut self, index: u64) -> Test {
        let test = fresh_test(&self.test_space, &mut Stream::derive(self.seed, "initial", &[index]));
        self.made.insert(TestKey::without_seeds(&test));
        test
    }

    fn offspring(&mut self, parents: [&Test; 2], generation: u64, pair: u64) -> [Child<Test>; 2] {
        let mut stream = Stream::derive(self.seed, "crossover", &[generation, pair]);
        let crossed = if stream.chance(self.rates.crossover) {
            let crossed = crossover(parents, &self.test_space, &mut stream);
            exchange_conditions(parents, crossed, &self.test_space, &self.rates, &mut stream)
        } else {
            None
        };
        let [first, second] = match crossed {
            Some([a, b]) => [(a, Heritage::Both), (b, Heritage::Both)],
            None => [(parents[0].clone(), Heritage::First), (parents[1].clone(), Heritage::Second)],
        };
        let mut place = 2 * pair;
        [first, second].map(|(mut genome, heritage)| {
            let mut stream = Stream::derive(self.seed, "mutation", &[generation, place]);
            place += 1;
            mutate(&mut genome, &self.test_space, &self.rates, &mut stream);
            for _ in 0..self.rates.tries {
                if !self.made.contains(&TestKey::without_seeds(&genome)) {
                    break;
                }
                let k = stream.below(genome.operations.len());
                change_somehow(&mut genome.operations[k], &self.test_space, &self.rates, &mut stream);
                self.test_space.settle(&mut genome, &mut stream);
            }
            self.made.insert(TestKey::without_seeds(&genome));
            Child { genome, heritage }
        })
    }
}

/// One-point crossover of two lists: each is cut in two, and the tails are exchanged. The cuts are uniform over all
/// that leave both children with a permitted number of operations and exchange neither nothing nor everything; `None`
/// when there are none such. Copies of one operation that come together [settle](TestSpace::settle).
pub(crate) fn crossover([a, b]: [&Test; 2], test_space: &TestSpace, stream: &mut Stream) -> Option<[Test; 2]> {
    let (a, b) = (&a.operations, &b.operations);
    let lengths = test_space.fewest()..=test_space.most();
    let mut cuts = Vec::new();
    for i in 0..=a.len() {
        for j in 0..=b.len() {
            let fits = lengths.contains(&(i + b.len() - j)) && lengths.contains(&(j + a.len() - i));
            let idle = (i == 0 && j == 0) || (i == a.len() && j == b.len());
            if fits && !idle {
                cuts.push((i, j));
            }
        }
    }
    if cuts.is_empty() {
        return None;
    }
    let (i, j) = cuts[stream.below(cuts.len())];
    Some([[&a[..i], &b[j..]].concat(), [&b[..j], &a[i..]].concat()].map(|operations| {
        let mut test = Test { operations };
        test_space.settle(&mut test, stream);
        test
    }))
}

/// Exchanges parts of conditions between two tests, the children of a crossover or, where there was none, their
/// parents; start conditions with start conditions, end conditions with end conditions. `None` where neither changed
/// anything.
fn exchange_conditions(
    parents: [&Test; 2],
    crossed: Option<[Test; 2]>,
    test_space: &TestSpace,
    rates: &Rates,
    stream: &mut Stream,
) -> Option<[Test; 2]> {
    let Some(space) = test_space.conditions() else { return crossed };
    let mut changed = crossed.is_some();
    let [mut a, mut b] = crossed.unwrap_or_else(|| parents.map(Clone::clone));
    for (a, b) in a.operations.iter_mut().zip(&mut b.operations) {
        // Both draws are made in any case, so that later ones do not depend on them.
        let [starts, ends] = [(); 2].map(|()| stream.chance(rates.exchange));
        let [of_a, of_b] = [&*a, &*b].map(|operation| kind_of(operation, test_space).activation.constraints());
        match (&mut a.activation, &mut b.activation) {
            (Activation::Condition { start: c, end: e, .. }, Activation::Condition { start: d, end: f, .. }) => {
                changed |= starts && condition::exchange([(c, of_a), (d, of_b)], space, stream);
                changed |= ends && condition::exchange([(e, &[]), (f, &[])], space, stream);
            }
            (Activation::ConditionFor { start: c, .. }, Activation::ConditionFor { start: d, .. }) => {
                changed |= starts && condition::exchange([(c, of_a), (d, of_b)], space, stream);
            }
            _ => {}
        }
    }
    changed.then_some([a, b])
}

/// Mutates a permitted test; the result is permitted too. Perhaps nothing changes.
pub(crate) fn mutate(test: &mut Test, test_space: &TestSpace, rates: &Rates, stream: &mut Stream) {
    for at in 0..test.operations.len() {
        mutate_operation(&mut test.operations, at, test_space, rates, stream);
    }
    // Each is decided by a draw of its own, whether or not the list has room for it.
    let [add, duplicate, drop] = [rates.add, rates.duplicate, rates.drop].map(|rate| stream.chance(rate));
    let operations = &mut test.operations;
    if drop && operations.len() > test_space.fewest() {
        operations.remove(stream.below(operations.len()));
    }
    if duplicate && operations.len() < test_space.most() {
        let has_room = |it: &&TestOperation| test_space.has_room(operations, kind_of(it, test_space));
        let originals: Vec<&TestOperation> = operations.iter().filter(has_room).collect();
        if !originals.is_empty() {
            let mut copy = originals[stream.below(originals.len())].clone();
            change_somehow(&mut copy, test_space, rates, stream);
            operations.insert(stream.below(operations.len() + 1), copy);
        }
    }
    if add && operations.len() < test_space.most() {
        // As the list is not full, there is one.
        let kinds: Vec<_> =
            test_space.operations().iter().filter(|kind| test_space.has_room(operations, kind)).collect();
        let kind = kinds[stream.below(kinds.len())];
        let place = stream.below(operations.len() + 1);
        operations.insert(place, fresh_operation(kind, stream));
    }
    test_space.settle(test, stream);
}

fn mutate_operation(
    operations: &mut [TestOperation],
    at: usize,
    test_space: &TestSpace,
    rates: &Rates,
    stream: &mut Stream,
) {
    if test_space.operations().len() > 1 && stream.chance(rates.retarget) {
        let current = operations[at].operation;
        let is_other = |kind: &&OperationSpace| kind.operation != current && test_space.has_room(operations, kind);
        let others: Vec<_> = test_space.operations().iter().filter(is_other).collect();
        if !others.is_empty() {
            retarget(&mut operations[at], others[stream.below(others.len())], stream);
        }
    }
    let operation = &mut operations[at];
    if stream.chance(rates.window) {
        change_activation(operation, test_space, rates, stream);
    }
    let kind = kind_of(operation, test_space);
    for (choice, parameter_space) in operation.parameters.iter_mut().zip(&kind.parameters) {
        if !parameter_space.is_fixed() && stream.chance(rates.parameter) {
            *choice = if stream.chance(rates.fresh) {
                parameter_space.fresh(stream)
            } else {
                parameter_space.near(choice, rates.steps, stream)
            };
            operation.operation_seed = stream.bits();
        }
    }
}

/// Puts a fresh instance of another operation in an operation's place, with the same window or the same conditions
/// where that one permits them.
fn retarget(operation: &mut TestOperation, kind: &OperationSpace, stream: &mut Stream) {
    let mut fresh = fresh_operation(kind, stream);
    match (&operation.activation, &kind.activation) {
        (&Activation::Time { start, end }, ActivationSpace::Time(window)) => {
            let (start, end) = (start.max(window.low), end.min(window.high));
            if end - start >= window.shortest {
                fresh.activation = Activation::Time { start, end };
            }
        }
        (
            kept @ (Activation::Condition { start, .. } | Activation::ConditionFor { start, .. }),
            ActivationSpace::Condition { constraints, .. },
        ) if constraints.iter().all(|constraint| contains(start, constraint)) => fresh.activation = kept.clone(),
        // What is kept is not permitted there, or one of them is offline and has nothing to keep or to be given.
        _ => {}
    }
    *operation = fresh;
}

/// Changes the activation, or, of an offline operation, which has none to choose, each parameter.
fn change_somehow(operation: &mut TestOperation, test_space: &TestSpace, rates: &Rates, stream: &mut Stream) {
    let kind = kind_of(operation, test_space);
    if kind.activation != ActivationSpace::Offline {
        return change_activation(operation, test_space, rates, stream);
    }
    for (choice, parameter_space) in operation.parameters.iter_mut().zip(&kind.parameters) {
        if !parameter_space.is_fixed() {
            *choice = parameter_space.near(choice, rates.steps, stream);
            operation.operation_seed = stream.bits();
        }
    }
}

/// Changes a window, or one of what takes its place: a start condition, an end condition, a length, each alike; if
/// there is one to choose.
fn change_activation(operation: &mut TestOperation, test_space: &TestSpace, rates: &Rates, stream: &mut Stream) {
    let kind = kind_of(operation, test_space);
    match (&mut operation.activation, &kind.activation) {
        (Activation::Offline, ActivationSpace::Offline) => return,
        (Activation::Time { start, end }, ActivationSpace::Time(window)) => {
            (*start, *end) = if stream.chance(rates.fresh) {
                window.interval(stream)
            } else {
                window.interval_near((*start, *end), rates.steps, stream)
            };
        }
        (Activation::Condition { start, end, .. }, ActivationSpace::Condition { space, constraints, .. }) => {
            let (condition, constraints) =
                if stream.chance(0.5) { (start, constraints.as_slice()) } else { (end, [].as_slice()) };
            *condition = condition::changed(condition, space, constraints, (rates.fresh, rates.steps), stream);
        }
        (Activation::ConditionFor { start, length, .. }, ActivationSpace::Condition { space, constraints, .. }) => {
            change_start_or_length((start, length), constraints, space, rates, stream);
        }
        (activation, activation_space) => unreachable!("{activation_space:?} gives no {activation:?}"),
    }
    operation.operation_seed = stream.bits();
}

fn change_start_or_length(
    (start, length): (&mut Condition, &mut f64),
    constraints: &[Constraint],
    space: &ConditionSpace,
    rates: &Rates,
    stream: &mut Stream,
) {
    let range = match space.end {
        ConditionEnd::Length { low, high } => Range::between(low, high),
        ConditionEnd::Condition => Range::between(*length, *length),
    };
    if range.is_fixed() || stream.chance(0.5) {
        *start = condition::changed(start, space, constraints, (rates.fresh, rates.steps), stream);
    } else if stream.chance(rates.fresh) {
        *length = range.number(stream);
    } else {
        *length = range.number_near(*length, rates.steps, stream);
    }
}

fn kind_of<'a>(operation: &TestOperation, test_space: &'a TestSpace) -> &'a OperationSpace {
    test_space.find(operation.operation).expect("a test of a campaign holds operations of that campaign")
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use sesame_plan::{CampaignPlan, Copies, Search, Strategy};

    use super::*;
    use crate::space::test_space::tests::{any_plan, broken_rule};
    use crate::test_key::identity;
    use crate::testing::synthetic_robots::SYNTHETIC_ROBOTS;

    /// Nothing happens.
    const IDLE: Rates = Rates {
        crossover: 0.0,
        exchange: 0.0,
        window: 0.0,
        parameter: 0.0,
        fresh: 0.0,
        retarget: 0.0,
        add: 0.0,
        duplicate: 0.0,
        drop: 0.0,
        steps: StepSizes { finest: 0.01, boldest: 0.2 },
        tries: 20,
    };

    fn seeds(test: &Test) -> BTreeSet<u64> {
        test.operations.iter().map(|operation| operation.operation_seed).collect()
    }

    proptest! {
        #[test]
        fn offspring_are_permitted_over_many_generations(plan in any_plan(), seed: u64) {
            let mut variation = TestVariation::new(TestSpace::from_plan(&plan).unwrap(), Rates::default(), seed);
            let mut tests = [variation.initial(0), variation.initial(1)];
            for generation in 1..30 {
                let [a, b] = &tests;
                tests = variation.offspring([a, b], generation, 0).map(|child| child.genome);
                for test in &tests {
                    prop_assert_eq!(broken_rule(&plan, test), None);
                }
            }
        }

        #[test]
        fn crossover_exchanges_tails_and_loses_nothing(plan in any_plan(), seed: u64) {
            let plan = overlapping(plan);
            let test_space = TestSpace::from_plan(&plan).unwrap();
            let mut stream = Stream::derive(seed, "test", &[]);
            let [a, b] = [(); 2].map(|()| fresh_test(&test_space, &mut stream));
            if let Some([c, d]) = crossover([&a, &b], &test_space, &mut stream) {
                prop_assert_eq!(broken_rule(&plan, &c), None);
                prop_assert_eq!(broken_rule(&plan, &d), None);
                prop_assert!(seeds(&c) != seeds(&a) && seeds(&c) != seeds(&b));
                let both = |x: &Test, y: &Test| identity(&Test { operations: [&x.operations[..], &y.operations].concat() });
                prop_assert_eq!(both(&c, &d), both(&a, &b));
                prop_assert_eq!(&seeds(&c) | &seeds(&d), &seeds(&a) | &seeds(&b));
            } else {
                // Only lists of one operation, or of the one permitted length 1, have no cut in between.
                prop_assert!(a.operations.len() == 1 || b.operations.len() == 1, "{} {}", a.operations.len(), b.operations.len());
            }
        }

        #[test]
        fn an_operation_has_a_new_draw_seed_exactly_when_it_is_new_or_changed(plan in any_plan(), seed: u64) {
            let test_space = TestSpace::from_plan(&plan).unwrap();
            let mut stream = Stream::derive(seed, "test", &[]);
            let before = fresh_test(&test_space, &mut stream);
            let mut after = before.clone();
            let rates = Rates { steps: StepSizes { finest: 0.01, boldest: 0.02 }, ..Rates::default() };
            mutate(&mut after, &test_space, &rates, &mut stream);
            for operation in &after.operations {
                match before.operations.iter().find(|old| old.operation_seed == operation.operation_seed) {
                    // Only a window that gives way to another copy's changes alone.
                    Some(old) => {
                        let copies = after.operations.iter().filter(|it| it.operation == operation.operation).count();
                        let kept = TestOperation { activation: old.activation.clone(), ..operation.clone() };
                        let gives_way = plan.campaign.copies == Copies::Apart && copies > 1;
                        prop_assert_eq!(old, if gives_way { &kept } else { operation });
                    }
                    // A step may end where it began, at an end of the range; a new seed alone is then what changed.
                    None => prop_assert!(!before.operations.contains(operation)),
                }
            }
        }
    }

    /// The plan with copies that may overlap: there, crossover leaves operations as they are.
    fn overlapping(mut plan: CampaignPlan) -> CampaignPlan {
        plan.campaign.copies = Copies::MayOverlap;
        plan
    }

    #[test]
    fn an_operation_that_a_child_gets_twice_from_one_ancestor_draws_for_itself_the_second_time() {
        let plan = SYNTHETIC_ROBOTS[0].plan(Search::new(Strategy::Random, 1));
        let test_space = TestSpace::from_plan(&plan).unwrap();
        let mut met = 0;
        for seed in 0..200 {
            let mut stream = Stream::derive(seed, "test", &[]);
            let parent = fresh_test(&test_space, &mut stream);
            let mut turned = parent.clone();
            turned.operations.reverse();
            let Some(children) = crossover([&parent, &turned], &test_space, &mut stream) else { continue };
            for child in children {
                assert!(test_space.permits_copies(&child), "{child:?}");
                met += u32::from(!seeds(&child).is_subset(&seeds(&parent)));
            }
        }
        assert!(met > 20, "{met} children met a twin");
    }

    /// Offspring of two tests by condition when only this is varied.
    fn offspring_of(rates: Rates, end: ConditionEnd, seed: u64) -> ([Test; 2], [Child<Test>; 2]) {
        let plan = SYNTHETIC_ROBOTS[2].plan_by_condition(Search::new(Strategy::Random, 1), end);
        let mut variation = TestVariation::new(TestSpace::from_plan(&plan).unwrap(), rates, seed);
        let tests = [variation.initial(0), variation.initial(1)];
        let children = variation.offspring([&tests[0], &tests[1]], 1, 0);
        (tests, children)
    }

    #[test]
    fn conditions_of_a_pair_exchange_parts_and_keep_their_operations() {
        let only = Rates { exchange: 1.0, crossover: 1.0, tries: 0, ..IDLE };
        let mut unlike = 0;
        for seed in 0..50 {
            let (parents, children) = offspring_of(only, ConditionEnd::Condition, seed);
            assert!(children.iter().all(|child| child.heritage == Heritage::Both));
            let operations = |tests: [&Test; 2]| {
                let all = tests.into_iter().flat_map(|test| &test.operations);
                let mut all: Vec<_> =
                    all.map(|it| (it.operation_seed, it.operation, format!("{:?}", it.parameters))).collect();
                all.sort();
                all
            };
            let [a, b] = &parents;
            assert_eq!(operations([&children[0].genome, &children[1].genome]), operations([a, b]));
            let before: Vec<&Activation> =
                [a, b].iter().flat_map(|it| &it.operations).map(|it| &it.activation).collect();
            let new = children.iter().flat_map(|child| &child.genome.operations);
            unlike += u32::from(new.filter(|it| !before.contains(&&it.activation)).count() >= 1);
        }
        // Now and then conditions are exchanged whole.
        assert!(unlike >= 45, "{unlike} of 50 pairs");
    }

    #[test]
    fn conditions_and_lengths_are_mutated() {
        let (mut starts, mut lengths, mut kept) = (0, 0, 0);
        for seed in 0..100 {
            let only = Rates { window: 1.0, tries: 0, ..IDLE };
            let (parents, children) = offspring_of(only, ConditionEnd::Length { low: 1.0, high: 15.0 }, seed);
            for (parent, child) in parents.iter().zip(&children) {
                for (old, new) in parent.operations.iter().zip(&child.genome.operations) {
                    assert!(old.parameters == new.parameters && old.operation_seed != new.operation_seed);
                    match (&old.activation, &new.activation) {
                        (
                            Activation::ConditionFor { start: a, length: n, .. },
                            Activation::ConditionFor { start: b, length: m, .. },
                        ) => {
                            starts += u32::from(a != b);
                            lengths += u32::from(n != m);
                            kept += u32::from(a == b && n == m);
                        }
                        other => panic!("{other:?}"),
                    }
                }
            }
        }
        assert!(starts > 200 && lengths > 200 && kept < 20, "{starts} {lengths} {kept}");
    }

    #[test]
    fn tests_that_differ_in_their_conditions_are_different_tests() {
        let (tests, _) = offspring_of(IDLE, ConditionEnd::Condition, 1);
        let mut other = tests[0].clone();
        other.operations[0].operation_seed += 1;
        assert_eq!(identity(&other), identity(&tests[0]));
        assert_eq!(TestKey::without_seeds(&other), TestKey::without_seeds(&tests[0]));
        let Activation::Condition { start, end, .. } = &mut other.operations[0].activation else { panic!("{other:?}") };
        std::mem::swap(start, end);
        assert_ne!(identity(&other), identity(&tests[0]));
        assert_ne!(TestKey::without_seeds(&other), TestKey::without_seeds(&tests[0]));
    }

    #[test]
    fn each_way_of_mutation_does_what_its_name_says() {
        let plan = SYNTHETIC_ROBOTS[2].plan(Search::new(Strategy::Random, 1));
        let test_space = TestSpace::from_plan(&plan).unwrap();
        let before = (0..100)
            .map(|i| fresh_test(&test_space, &mut Stream::derive(1, "test", &[i])))
            .find(|test| test.operations.len() == 3)
            .expect("lists of three are common");
        let mutated = |rates: Rates| {
            let mut test = before.clone();
            mutate(&mut test, &test_space, &rates, &mut Stream::derive(9, "mutation", &[]));
            test.operations
        };
        let old = &before.operations;
        let kept = |new: &[TestOperation]| new.iter().filter(|operation| old.contains(operation)).count();

        assert_eq!(mutated(IDLE), *old);
        let moved = mutated(Rates { window: 1.0, ..IDLE });
        assert!(moved.iter().zip(old).all(|(n, o)| n.activation != o.activation && n.parameters == o.parameters));
        let tuned = mutated(Rates { parameter: 1.0, ..IDLE });
        assert!(tuned.iter().zip(old).all(|(n, o)| n.activation == o.activation && n.parameters != o.parameters));
        let retargeted = mutated(Rates { retarget: 1.0, ..IDLE });
        assert!(retargeted.iter().zip(old).all(|(n, o)| n.operation != o.operation && n.activation == o.activation));
        let longer = mutated(Rates { add: 1.0, ..IDLE });
        assert_eq!((longer.len(), kept(&longer)), (4, 3));
        let copied = mutated(Rates { duplicate: 1.0, ..IDLE });
        assert_eq!((copied.len(), kept(&copied)), (4, 3));
        let copy = copied.iter().find(|operation| !old.contains(operation)).expect("the copy differs in its window");
        assert!(old.iter().any(|o| o.operation == copy.operation && o.parameters == copy.parameters));
        let shorter = mutated(Rates { drop: 1.0, ..IDLE });
        assert_eq!((shorter.len(), kept(&shorter)), (2, 2));
    }
}
