//! Variation of tests: crossover of their lists of operations, mutation of single operations and of the list.
//!
//! A mutated operation draws with a new seed; a copied one with that of its parent. A child is never one of the tests
//! asked before in the same campaign (draw seeds aside), unless [`Rates::tries`] attempts to change it all fail.

use std::collections::BTreeSet;

use sesame_plan::{Activation, Choice, Shape, Test, TestOperation};

use crate::rng::Stream;
use crate::search::initial::{fresh_operation, fresh_test};
use crate::search::nsga2::{Child, Heritage, Variation};
use crate::search::permitted::{Permitted, PermittedOperation};
use crate::search::range::{Range, StepSizes, fresh_choice};

/// How often what is varied. All are probabilities except `steps` and `tries`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Rates {
    /// Of each pair: that its lists are crossed.
    pub crossover: f64,
    /// Of each operation: that its window changes.
    pub window: f64,
    /// Of each parameter of each operation: that it changes.
    pub parameter: f64,
    /// Of each change of a window or parameter: that it is drawn anew instead of moved a little.
    pub fresh: f64,
    /// Of each operation: that a fresh instance of another operation takes its place and keeps its window, as far as
    /// that is permitted there.
    pub retarget: f64,
    /// Of each test: that a fresh operation joins it.
    pub add: f64,
    /// Of each test: that a copy of one of its operations, with its window moved, joins it.
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
            window: 0.3,
            parameter: 0.3,
            fresh: 0.2,
            retarget: 0.05,
            add: 0.1,
            duplicate: 0.05,
            drop: 0.15,
            steps: StepSizes { finest: 0.01, boldest: 0.3 },
            tries: 20,
        }
    }
}

/// [`Variation`] of the tests of one campaign.
#[derive(Debug, Clone)]
pub struct TestVariation {
    permitted: Permitted,
    rates: Rates,
    seed: u64,
    /// All tests made so far, as [`identity`] has them.
    made: BTreeSet<Vec<Vec<u64>>>,
}

impl TestVariation {
    /// Variation of what is permitted, at these rates, with all draws from streams of the seed.
    pub fn new(permitted: Permitted, rates: Rates, seed: u64) -> Self {
        TestVariation { permitted, rates, seed, made: BTreeSet::new() }
    }
}

impl Variation for TestVariation {
    type Genome = Test;

    fn initial(&mut self, index: u64) -> Test {
        let test = fresh_test(&self.permitted, &mut Stream::derive(self.seed, "initial", &[index]));
        self.made.insert(identity(&test));
        test
    }

    fn offspring(&mut self, parents: [&Test; 2], generation: u64, pair: u64) -> [Child<Test>; 2] {
        let mut stream = Stream::derive(self.seed, "crossover", &[generation, pair]);
        let crossed =
            if stream.chance(self.rates.crossover) { crossover(parents, &self.permitted, &mut stream) } else { None };
        let [first, second] = match crossed {
            Some([a, b]) => [(a, Heritage::Both), (b, Heritage::Both)],
            None => [(parents[0].clone(), Heritage::First), (parents[1].clone(), Heritage::Second)],
        };
        let mut place = 2 * pair;
        [first, second].map(|(mut genome, heritage)| {
            let mut stream = Stream::derive(self.seed, "mutation", &[generation, place]);
            place += 1;
            mutate(&mut genome, &self.permitted, &self.rates, &mut stream);
            for _ in 0..self.rates.tries {
                if !self.made.contains(&identity(&genome)) {
                    break;
                }
                let k = stream.below(genome.operations.len());
                change_window(&mut genome.operations[k], &self.permitted, &self.rates, &mut stream);
            }
            self.made.insert(identity(&genome));
            Child { genome, heritage }
        })
    }
}

/// What tells two tests apart: their operations in any order, without draw seeds.
fn identity(test: &Test) -> Vec<Vec<u64>> {
    let mut operations: Vec<Vec<u64>> = test
        .operations
        .iter()
        .map(|operation| {
            let Activation::Time { start, end } = operation.activation;
            let mut numbers = vec![u64::from(operation.operation.0), start.to_bits(), end.to_bits()];
            for choice in &operation.parameters {
                match *choice {
                    Choice::Value { value } => numbers.push(value.to_bits()),
                    Choice::Range { low, high } => numbers.extend([low.to_bits(), high.to_bits()]),
                }
            }
            numbers
        })
        .collect();
    operations.sort_unstable();
    operations
}

/// One-point crossover of two lists: each is cut in two, and the tails are exchanged. The cuts are uniform over all that
/// leave both children with a permitted number of operations and exchange neither nothing nor everything; `None` when
/// there are none such.
pub fn crossover([a, b]: [&Test; 2], permitted: &Permitted, stream: &mut Stream) -> Option<[Test; 2]> {
    let (a, b) = (&a.operations, &b.operations);
    let lengths = permitted.fewest()..=permitted.most();
    let mut cuts = Vec::new();
    for i in 0..=a.len() {
        for j in 0..=b.len() {
            let permitted = lengths.contains(&(i + b.len() - j)) && lengths.contains(&(j + a.len() - i));
            let idle = (i == 0 && j == 0) || (i == a.len() && j == b.len());
            if permitted && !idle {
                cuts.push((i, j));
            }
        }
    }
    if cuts.is_empty() {
        return None;
    }
    let (i, j) = cuts[stream.below(cuts.len())];
    Some([[&a[..i], &b[j..]].concat(), [&b[..j], &a[i..]].concat()].map(|operations| Test { operations }))
}

/// Mutates a permitted test; the result is permitted too. Perhaps nothing changes.
pub fn mutate(test: &mut Test, permitted: &Permitted, rates: &Rates, stream: &mut Stream) {
    for operation in &mut test.operations {
        mutate_operation(operation, permitted, rates, stream);
    }
    // Each is decided by a draw of its own, whether or not the list has room for it.
    let [add, duplicate, drop] = [rates.add, rates.duplicate, rates.drop].map(|rate| stream.chance(rate));
    let operations = &mut test.operations;
    if drop && operations.len() > permitted.fewest() {
        operations.remove(stream.below(operations.len()));
    }
    if duplicate && operations.len() < permitted.most() {
        let mut copy = operations[stream.below(operations.len())].clone();
        change_window(&mut copy, permitted, rates, stream);
        operations.insert(stream.below(operations.len() + 1), copy);
    }
    if add && operations.len() < permitted.most() {
        let kind = &permitted.operations()[stream.below(permitted.operations().len())];
        let place = stream.below(operations.len() + 1);
        operations.insert(place, fresh_operation(kind, stream));
    }
}

fn mutate_operation(operation: &mut TestOperation, permitted: &Permitted, rates: &Rates, stream: &mut Stream) {
    if permitted.operations().len() > 1 && stream.chance(rates.retarget) {
        retarget(operation, permitted, stream);
    }
    if stream.chance(rates.window) {
        change_window(operation, permitted, rates, stream);
    }
    let kind = kind_of(operation, permitted);
    for (choice, &(range, shape)) in operation.parameters.iter_mut().zip(&kind.parameters) {
        if !range.is_fixed() && stream.chance(rates.parameter) {
            *choice = changed_choice(*choice, range, shape, rates, stream);
            operation.draw_seed = stream.bits();
        }
    }
}

/// Puts a fresh instance of another operation in an operation's place, with the same window where that one permits it.
fn retarget(operation: &mut TestOperation, permitted: &Permitted, stream: &mut Stream) {
    let others: Vec<_> = permitted.operations().iter().filter(|kind| kind.operation != operation.operation).collect();
    let kind = others[stream.below(others.len())];
    let Activation::Time { start, end } = operation.activation;
    let mut fresh = fresh_operation(kind, stream);
    let (start, end) = (start.max(kind.window.low), end.min(kind.window.high));
    if end - start >= kind.window.shortest {
        fresh.activation = Activation::Time { start, end };
    }
    *operation = fresh;
}

fn change_window(operation: &mut TestOperation, permitted: &Permitted, rates: &Rates, stream: &mut Stream) {
    let window = kind_of(operation, permitted).window;
    let Activation::Time { start, end } = operation.activation;
    let (start, end) = if stream.chance(rates.fresh) {
        window.interval(stream)
    } else {
        window.interval_near((start, end), rates.steps, stream)
    };
    operation.activation = Activation::Time { start, end };
    operation.draw_seed = stream.bits();
}

fn changed_choice(choice: Choice, range: Range, shape: Shape, rates: &Rates, stream: &mut Stream) -> Choice {
    if stream.chance(rates.fresh) {
        return fresh_choice(range, shape, stream);
    }
    match choice {
        Choice::Value { value } => Choice::Value { value: range.number_near(value, rates.steps, stream) },
        Choice::Range { low, high } => {
            let (low, high) = range.interval_near((low, high), rates.steps, stream);
            Choice::Range { low, high }
        }
    }
}

fn kind_of<'a>(operation: &TestOperation, permitted: &'a Permitted) -> &'a PermittedOperation {
    permitted.find(operation.operation).expect("a test of a campaign holds operations of that campaign")
}
