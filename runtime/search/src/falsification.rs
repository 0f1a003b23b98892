//! Focused falsification of a campaign: [`falsify`](sesame_optimise::falsify) over its tests.
//!
//! Tests contain different operations, so they are not vectors. Their distance is measured operation by operation: each
//! kind of operation that the campaign permits is a component of its own, in which a test is the sum of a bump per
//! operation of that kind, over where its window lies, how long it is, and its parameters. So a test is near another
//! when it disturbs the same at about the same time about as strongly, and adding, dropping or exchanging an operation
//! is a step of a certain length. Candidates come from the best tests by mutation.
//!
//! Where every test holds the same operations, each once and without a window, and chooses nothing but numbers, tests
//! are vectors ([vectors]): these are searched as such, and the process alone decides what is tried.

mod vectors;

use vectors::Vectors;

use sesame_base::observation::Observation;
use sesame_optimise::falsify::{Falsifier, SearchDomain, Settings, UnitBox};
use sesame_plan::{Activation, CampaignPlan, Choice, Test};
use sesame_rng::Stream;

use crate::evolve::variation::{Rates, crossover, mutate};
use crate::margin::evaluated_margins;
use crate::sample::sampled_search::Sampling;
use crate::sample::sobol::Sobol;
use crate::space::initial::fresh_test;
use crate::space::parameter_space::ParameterSpace;
use crate::space::range::{Range, StepSizes};
use crate::space::test_space::ActivationSpace;
use crate::space::test_space::TestSpace;
use crate::{Candidate, Evaluated, Strategy};

/// Width of the bump of an operation, as a share of what is permitted; times the root of how many coordinates it has.
const WIDTH: f64 = 0.3;
/// Texts and files are no nearer to one another than this, in shares of what is permitted.
const APART: f64 = 8.0;

/// A focused falsification of the requirements of a campaign by time.
#[derive(Debug, Clone)]
pub(crate) struct Falsification {
    plan: CampaignPlan,
    search: Inner,
    generation: u32,
    /// How many tests were asked for.
    number: u64,
}

/// What is searched.
#[derive(Debug, Clone)]
enum Inner {
    Tests { search: Box<Falsifier<TestDomain>>, asked: Vec<EmbeddedTest> },
    Vectors { search: Box<Falsifier<UnitBox>>, vectors: Vectors, asked: Vec<Vec<f64>> },
}

impl Falsification {
    /// A search before its first test. `settings` say how many requirements there are: what
    /// [`margins`](crate::margins) are told of.
    pub(crate) fn new(plan: &CampaignPlan, test_space: TestSpace, settings: Settings) -> Self {
        let search = if let Some(vectors) = Vectors::from_space(&test_space, settings.seed) {
            let search = Falsifier::new(UnitBox::new(vectors.variables(), settings.seed), settings);
            Inner::Vectors { search: Box::new(search), vectors, asked: Vec::new() }
        } else {
            let search = Falsifier::new(TestDomain::new(test_space, settings.seed), settings);
            Inner::Tests { search: Box::new(search), asked: Vec::new() }
        };
        Falsification { plan: plan.clone(), search, generation: 0, number: 0 }
    }
}

impl Strategy for Falsification {
    fn begin(&mut self, reference: &Observation) {
        match &mut self.search {
            Inner::Tests { search, .. } => search.domain_mut().take_reference(reference),
            // Vectors have no windows.
            Inner::Vectors { .. } => {}
        }
    }

    fn ask(&mut self) -> Vec<Candidate> {
        let generation = self.generation;
        self.generation += 1;
        let candidate =
            |test: Test, parents| Candidate { test, parents, generation, known: None, simulator_seed: None };
        match &mut self.search {
            Inner::Tests { search, asked } => {
                *asked = search.ask();
                asked.iter().map(|embedded| candidate(embedded.test.clone(), embedded.parents.clone())).collect()
            }
            Inner::Vectors { search, vectors, asked } => {
                *asked = search.ask();
                let tests = (self.number..).zip(&*asked).map(|(number, vector)| vectors.test(vector, number));
                let candidates: Vec<Candidate> = tests.map(|test| candidate(test, Vec::new())).collect();
                self.number += asked.len() as u64;
                candidates
            }
        }
    }

    fn tell(&mut self, results: &[Evaluated]) {
        let plan = &self.plan;
        let margins = |result: &Evaluated| evaluated_margins(plan, result);
        let told = "exactly the generation asked last is told";
        match &mut self.search {
            Inner::Tests { search, asked } => {
                assert!(results.len() == asked.len(), "{told}");
                let embedded = std::mem::take(asked).into_iter().zip(results).map(|(mut embedded, result)| {
                    embedded.number = Some(result.number);
                    (embedded, margins(result))
                });
                search.tell(embedded.collect());
            }
            Inner::Vectors { search, asked, .. } => {
                assert!(results.len() == asked.len(), "{told}");
                let embedded = std::mem::take(asked).into_iter().zip(results);
                search.tell(embedded.map(|(vector, result)| (vector, margins(result))).collect());
            }
        }
    }
}

/// The tests of a campaign by time.
#[derive(Debug, Clone)]
pub(crate) struct TestDomain {
    test_space: TestSpace,
    spread: Sobol,
}

/// A test among the others.
#[derive(Debug, Clone)]
pub(crate) struct EmbeddedTest {
    pub(crate) test: Test,
    /// For each operation: its kind's place in the campaign, and its coordinates in shares of what is permitted.
    operations: Vec<(usize, Vec<f64>)>,
    /// Per kind, the square of its sum of bumps.
    squares: Vec<f64>,
    /// The caller's number, once it was evaluated.
    number: Option<u32>,
    /// The numbers of the tests that it was made from: none, one or two.
    pub(crate) parents: Vec<u32>,
}

impl TestDomain {
    /// The tests of a test space.
    pub(crate) fn new(test_space: TestSpace, seed: u64) -> Self {
        let spread = Sobol::new(test_space.clone(), seed);
        TestDomain { test_space, spread }
    }

    fn take_reference(&mut self, reference: &Observation) {
        self.test_space.take_reference(reference);
        self.spread.begin(reference);
    }

    /// A test of the test space among the others.
    pub(crate) fn embedded(&self, test: Test, parents: Vec<u32>) -> EmbeddedTest {
        let kinds = self.test_space.operations();
        let mut operations = Vec::with_capacity(test.operations.len());
        for operation in &test.operations {
            let kind = kinds.iter().position(|kind| kind.operation == operation.operation);
            let kind = kind.expect("a test holds what the campaign permits");
            let mut coordinates = Vec::new();
            if let (&Activation::Time { start, end }, ActivationSpace::Time(window)) =
                (&operation.activation, &kinds[kind].activation)
            {
                interval(*window, start, end, &mut coordinates);
            }
            for (choice, parameter_space) in operation.parameters.iter().zip(&kinds[kind].parameters) {
                chosen(choice, parameter_space, &mut coordinates);
            }
            operations.push((kind, coordinates));
        }
        let mut squares = vec![0.0; kinds.len()];
        for (kind, a) in &operations {
            let alike = operations.iter().filter(|(other, _)| other == kind).map(|(_, b)| overlap(a, b));
            squares[*kind] += alike.sum::<f64>();
        }
        EmbeddedTest { test, operations, squares, number: None, parents }
    }
}

impl SearchDomain for TestDomain {
    type Point = EmbeddedTest;

    fn quasi_random(&mut self, index: u32) -> EmbeddedTest {
        let test = self.spread.test(index).expect("points never run out");
        self.embedded(test, Vec::new())
    }

    fn random(&self, stream: &mut Stream) -> EmbeddedTest {
        self.embedded(fresh_test(&self.test_space, stream), Vec::new())
    }

    fn perturb(&self, place: &EmbeddedTest, step: f64, stream: &mut Stream) -> EmbeddedTest {
        // What a test holds changes seldom, and hardly ever where only small steps are wanted.
        let structure = (0.5 * step).min(0.15);
        let rates = Rates {
            window: 0.5,
            parameter: 0.5,
            fresh: 0.2 * step,
            retarget: structure,
            add: structure,
            duplicate: structure,
            drop: structure,
            steps: StepSizes { finest: 0.5 * step, boldest: step },
            ..Rates::default()
        };
        let mut test = place.test.clone();
        mutate(&mut test, &self.test_space, &rates, stream);
        self.embedded(test, place.number.map_or_else(|| place.parents.clone(), |number| vec![number]))
    }

    /// Half of the tests are not left to expectations: hits and misses of operations make plateaus and jumps that a
    /// smooth process does not foresee. In turn there are fresh tests, and children of the best as an evolution breeds
    /// them.
    fn explore(&self, turn: u32, best: &[&EmbeddedTest], stream: &mut Stream) -> Option<EmbeddedTest> {
        if turn.is_multiple_of(2) {
            return Some(self.random(stream));
        }
        let [first, second] = [(); 2].map(|()| best[stream.below(best.len())]);
        let rates = Rates::default();
        let crossed = stream
            .chance(rates.crossover)
            .then(|| crossover([&first.test, &second.test], &self.test_space, stream).map(|[child, _]| child));
        let crossed = crossed.flatten();
        let parents = if crossed.is_some() { vec![first.number, second.number] } else { vec![first.number] };
        let mut test = crossed.unwrap_or_else(|| first.test.clone());
        mutate(&mut test, &self.test_space, &rates, stream);
        let mut parents: Vec<u32> = parents.into_iter().flatten().collect();
        parents.dedup();
        Some(self.embedded(test, parents))
    }

    fn components(&self) -> usize {
        self.test_space.operations().len()
    }

    fn squared_distances(&self, a: &EmbeddedTest, b: &EmbeddedTest, squares: &mut Vec<f64>) {
        let begin = squares.len();
        squares.extend(a.squares.iter().zip(&b.squares).map(|(a, b)| a + b));
        for (kind, at) in &a.operations {
            for (_, other) in b.operations.iter().filter(|(other, _)| other == kind) {
                squares[begin + kind] -= 2.0 * overlap(at, other);
            }
        }
        // A difference of equal sums may come out below zero by rounding.
        squares[begin..].iter_mut().for_each(|square| *square = square.max(0.0));
    }
}

/// Middle and length of an interval, as shares of what is permitted.
fn interval(range: Range, low: f64, high: f64, coordinates: &mut Vec<f64>) {
    let width = range.high - range.low;
    if width > 0.0 {
        coordinates.push((f64::midpoint(low, high) - range.low) / width);
        coordinates.push((high - low) / range.greatest_length());
    }
}

/// The coordinates of a choice.
fn chosen(choice: &Choice, parameter_space: &ParameterSpace, coordinates: &mut Vec<f64>) {
    let mut number = |range: &Range, value: f64| {
        let width = range.high - range.low;
        if width > 0.0 {
            coordinates.push((value - range.low) / width);
        }
    };
    match (choice, parameter_space) {
        (Choice::Value { value }, ParameterSpace::Number(range, _)) => number(range, *value),
        (&Choice::Range { low, high }, ParameterSpace::Number(range, _)) => interval(*range, low, high, coordinates),
        (Choice::Point { point }, ParameterSpace::Point(axes)) => {
            point.iter().zip(axes).for_each(|(value, range)| number(range, *value));
        }
        (Choice::Text { text }, ParameterSpace::Items(items)) => {
            let place = items.iter().position(|item| item == text).unwrap_or(items.len());
            coordinates.push(APART * place as f64);
        }
        // A choice of another kind is none that this campaign made.
        _ => {}
    }
}

/// How much the bumps of two operations of a kind have in common, 1 for equal ones: a product of Cauchy kernels, which
/// is positive definite and takes no powers.
fn overlap(a: &[f64], b: &[f64]) -> f64 {
    let width = WIDTH * WIDTH * a.len().max(1) as f64;
    a.iter().zip(b).map(|(a, b)| 1.0 / (1.0 + (a - b) * (a - b) / width)).product()
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use sesame_plan::{Search, Strategy};

    use super::*;
    use crate::margin::margins;
    use crate::space::test_space::tests::{any_timed_plan, broken_rule};
    use crate::testing::synthetic_robots::{SYNTHETIC_ROBOTS, SyntheticRobot};

    proptest! {
        #[test]
        fn tests_are_permitted_and_separations_are_squared_distances(plan in any_timed_plan(), seed: u64) {
            let test_space = TestSpace::from_plan(&plan).unwrap();
            let mut domain = TestDomain::new(test_space, seed);
            let mut stream = Stream::derive(seed, "test", &[]);
            let mut places = vec![domain.quasi_random(0), domain.quasi_random(1), domain.random(&mut stream)];
            for step in [0.01, 0.1, 0.5] {
                let from = places[stream.below(places.len())].clone();
                places.push(domain.perturb(&from, step, &mut stream));
            }
            let between = |a: usize, b: usize| {
                let mut squares = Vec::new();
                domain.squared_distances(&places[a], &places[b], &mut squares);
                libm::sqrt(squares.iter().sum::<f64>())
            };
            for a in 0..places.len() {
                prop_assert_eq!(broken_rule(&plan, &places[a].test), None);
                prop_assert!(between(a, a) < 1e-6);
                for b in 0..places.len() {
                    prop_assert!((between(a, b) - between(b, a)).abs() < 1e-6);
                    for c in 0..places.len() {
                        prop_assert!(between(a, c) <= between(a, b) + between(b, c) + 1e-6);
                    }
                }
            }
        }
    }

    /// Fewer hits being required: how many tests the first violation takes.
    fn tests_until_violated(robot: &SyntheticRobot, hits: f64, search: Search, seed: u64) -> usize {
        let mut plan = robot.plan(search);
        plan.requirements.push(SyntheticRobot::fewer_hits_than(hits));
        let run = robot.campaign_of(&plan, crate::strategy(&plan, seed).unwrap().as_mut());
        run.tests.iter().position(|result| margins(&plan, &result.run)[0].violated).map_or(usize::MAX, |at| at + 1)
    }

    #[test]
    fn the_seed_decides_and_results_told_again_bring_a_search_back_to_where_it_was() {
        let robot = &SYNTHETIC_ROBOTS[1];
        let mut plan = robot.plan(Search::new(Strategy::Falsification { population: 3 }, 26));
        plan.requirements.push(SyntheticRobot::fewer_hits_than(20.0));
        let start = |seed| crate::strategy(&plan, seed).unwrap();
        let whole = robot.campaign_of(&plan, start(8).as_mut()).tests;
        assert_eq!(whole.len(), 26);
        assert_ne!(whole, robot.campaign_of(&plan, start(9).as_mut()).tests);
        let (mut resumed, mut told) = (start(8), 0);
        while told < whole.len() {
            let asked = resumed.ask();
            let stored = &whole[told..told + asked.len()];
            for (candidate, result) in asked.iter().zip(stored) {
                assert_eq!(candidate.test, result.test);
                let before = u32::try_from(told).unwrap();
                assert!(candidate.parents.len() <= 2 && candidate.parents.iter().all(|&parent| parent <= before));
            }
            told += asked.len();
            resumed.tell(stored);
        }
        assert_eq!(resumed.ask(), []);
    }

    /// Prints how many of 20 searches find 40 hits within 80 tests on each of the synthetic robots; nothing is
    /// asserted, as twenty are few.
    #[test]
    #[ignore = "long: 240 searches of up to 80 tests"]
    fn strategies_on_synthetic_robots() {
        let searches = [
            ("falsification", Search::new(Strategy::Falsification { population: 1 }, 80)),
            ("nsga2", Search::new(Strategy::Nsga2 { population: 10 }, 80)),
            ("random", Search::new(Strategy::Random, 80)),
        ];
        println!("| strategy | {} |", SYNTHETIC_ROBOTS.each_ref().map(|robot| robot.name).join(" | "));
        for (name, search) in searches {
            let found = SYNTHETIC_ROBOTS.each_ref().map(|robot| {
                let found = (1..=20).filter(|&seed| tests_until_violated(robot, 40.0, search.clone(), seed) <= 80);
                found.count().to_string()
            });
            println!("| {name} | {} |", found.join(" | "));
        }
    }

    #[test]
    fn a_requirement_that_chance_rarely_violates_falls_within_a_few_dozen_tests() {
        let median = |search: Search| {
            let mut tests: Vec<usize> =
                (1..=5).map(|seed| tests_until_violated(&SYNTHETIC_ROBOTS[3], 40.0, search.clone(), seed)).collect();
            tests.sort_unstable();
            tests[2]
        };
        let found = median(Search::new(Strategy::Falsification { population: 1 }, 60));
        let drawn = median(Search::new(Strategy::Random, 1_000));
        assert!(found <= 60 && found < drawn, "{found} tests, and {drawn} by chance");
    }
}
