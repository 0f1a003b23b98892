//! The choice itself: every number of tests that may be worth it, the value first, then the smallest numbers.

use crate::incumbent::TOLERANCE;
use crate::problem::Problem;
use crate::size::Size;
use crate::ties;
use crate::tree::Search;

/// What is known about a selection.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum State {
    /// No choice has a greater value, and none of the same value has smaller numbers.
    Proved,
    /// No choice has a greater value. Whether another of the same value has smaller numbers was not settled.
    TiesOpen,
    /// The search was stopped. No choice has a value greater than the bound.
    Open {
        /// At least the value of the selection.
        bound: f64,
    },
}

/// Chosen tests.
#[derive(Debug, Clone, PartialEq)]
pub struct Selection {
    /// The positions of the tests in the problem, ascending.
    pub chosen: Vec<usize>,
    /// What the choice is worth: [`Problem::value`].
    pub value: f64,
    /// What is known about it.
    pub state: State,
}

impl Selection {
    /// How far the best choice may be above this one, as a share of this one's value; 0 if the value is proved.
    pub fn gap(&self) -> f64 {
        match self.state {
            State::Proved | State::TiesOpen => 0.0,
            State::Open { bound } if bound <= self.value => 0.0,
            State::Open { bound } => (bound - self.value) / self.value,
        }
    }
}

/// The choice with the greatest value within the budget [SESAME 2023, Algorithm 1].
///
/// Values that differ by less than a share of 10⁻⁹ are equal. Of choices with equal values the one with the smaller
/// numbers is taken: their ascending positions are compared like words in a dictionary. Choices of two tests and more
/// are compared by value. Where the budget is enough for one only, that is the one with the best quality, and
/// without a test that is cheap enough the selection is empty. Costs may exceed the budget by a share of 10⁻⁹, which
/// sums of decimal fractions need.
///
/// `stop` is asked again and again, also during long computations; once it says yes, the best choice so far is returned
/// together with a bound. The result is a function of the problem and of the number of the question that was answered
/// with yes.
pub fn choose(problem: &Problem, stop: &mut dyn FnMut() -> bool) -> Selection {
    let tests = problem.tests();
    let forced: Vec<usize> = (0..tests.len()).filter(|&at| tests[at].forced).collect();
    let money = problem.limit() - problem.cost(&forced);
    let usable: Vec<usize> = (0..tests.len()).filter(|&at| tests[at].forced || tests[at].cost <= money).collect();
    let most = most_tests(problem, &usable, forced.len(), money);
    let proved = |chosen: Vec<usize>| Selection { value: problem.value(&chosen), chosen, state: State::Proved };
    if most < 2 {
        let best =
            usable.iter().copied().reduce(|best, at| if tests[at].quality > tests[best].quality { at } else { best });
        return proved(if forced.is_empty() { best.into_iter().collect() } else { forced });
    }
    if most == forced.len() {
        return proved(forced);
    }
    if worthless(problem, &usable) {
        return proved(first_choice(problem, &usable, &forced, money));
    }
    let mut search = Search::new(stop);
    let least = if all_can_grow(problem, &usable, money, most) { most } else { forced.len().max(2) };
    let mut sizes = Vec::new();
    let mut bound = f64::NEG_INFINITY;
    for size in (least..=most).rev() {
        let size = Size::new(problem, &usable, size, &mut search);
        if size.bound < search.incumbent.equal() {
            // A smaller size is bounded by less.
            break;
        }
        sizes.push(size);
    }
    let mut stopped = false;
    for size in &mut sizes {
        stopped = stopped || !size.reduce(&mut search);
    }
    // Also if that was before the first size was reduced.
    stopped |= search.was_stopped();
    for size in &mut sizes {
        if size.bound < search.threshold() {
            continue;
        }
        if stopped {
            bound = bound.max(size.bound);
        } else if let Some(root) = size.root.clone() {
            bound = bound.max(search.explore(&mut size.instance, root));
        }
    }
    let value = search.incumbent.value;
    let chosen = search.incumbent.choice().expect("greedy choices exist where two tests are cheap enough").clone();
    let mut selection = Selection { value: problem.value(&chosen), chosen, state: State::Proved };
    if bound > value * (1.0 + TOLERANCE) {
        selection.state = State::Open { bound };
    } else if bound > f64::NEG_INFINITY {
        selection.state = State::TiesOpen;
    } else if search.incumbent.crowded {
        if !ties::smallest(&mut sizes, &mut search, &mut selection.chosen) {
            selection.state = State::TiesOpen;
        }
        selection.value = problem.value(&selection.chosen);
    }
    selection
}

/// How many tests are affordable: the forced ones and the cheapest of the others.
fn most_tests(problem: &Problem, usable: &[usize], forced: usize, money: f64) -> usize {
    let mut cost: Vec<f64> =
        usable.iter().map(|&at| &problem.tests()[at]).filter(|test| !test.forced).map(|test| test.cost).collect();
    cost.sort_by(f64::total_cmp);
    let mut spent = 0.0;
    let others = cost.iter().take_while(|cost| {
        spent += **cost;
        spent <= money
    });
    forced + others.count()
}

/// Whether no choice is worth anything: all qualities that count and all distances that count are 0.
fn worthless(problem: &Problem, usable: &[usize]) -> bool {
    let tests = problem.tests();
    let apart = usable.iter().any(|&at| tests[at].point != tests[usable[0]].point);
    let good = usable.iter().any(|&at| tests[at].quality > 0.0);
    !(apart && problem.lambda() > 0.0 || good && problem.lambda() < 1.0)
}

/// The choice with the smallest numbers among all choices of two and more tests.
fn first_choice(problem: &Problem, usable: &[usize], forced: &[usize], mut money: f64) -> Vec<usize> {
    let tests = problem.tests();
    let mut chosen: Vec<usize> = Vec::new();
    for (place, &at) in usable.iter().enumerate() {
        let missing = forced.iter().filter(|forced| !chosen.contains(forced)).count();
        if chosen.len() >= 2 && missing == 0 {
            break;
        }
        if tests[at].forced {
            chosen.push(at);
            continue;
        }
        // One more test must be affordable in addition to it, unless there is one already.
        let rest = money - tests[at].cost;
        let enough = chosen.len() + missing >= 1 || usable[place + 1..].iter().any(|&other| tests[other].cost <= rest);
        if rest >= 0.0 && enough {
            money = rest;
            chosen.push(at);
        }
    }
    chosen
}

/// Whether every choice that is smaller than the greatest has room for another test. Then it is worth less than with
/// that test, and only the greatest size counts: by the triangle inequality another test adds at least the share
/// 1 / (size − 1) of the value.
fn all_can_grow(problem: &Problem, usable: &[usize], money: f64, most: usize) -> bool {
    let forced = usable.iter().filter(|&&at| problem.tests()[at].forced).count();
    let mut cost: Vec<f64> =
        usable.iter().map(|&at| &problem.tests()[at]).filter(|test| !test.forced).map(|test| test.cost).collect();
    cost.sort_by(|a, b| b.total_cmp(a));
    cost.iter().take(most - forced).sum::<f64>() <= money
}
