//! What is chosen as diversity counts more and more.
//!
//! The value of one choice is a line in λ, from its qualities at 0 to its distances at 1. So the best choices form the
//! upper envelope of lines. Where the lines of two choices of the envelope cross, either the best choice is on no line
//! above them, and the envelope bends there, or it is another one, and the search goes on to both sides of it.

use crate::choose::{Selection, State, choose};
use crate::incumbent::TOLERANCE;
use crate::problem::Problem;

/// Values of λ between which one choice is the best.
#[derive(Debug, Clone, PartialEq)]
pub struct Stretch {
    /// From this λ on.
    pub from: f64,
    /// Up to this λ.
    pub to: f64,
    /// The positions of the tests, ascending.
    pub chosen: Vec<usize>,
    /// Which of them the stretch before does not contain.
    pub enter: Vec<usize>,
    /// Which tests of the stretch before are not chosen any more.
    pub leave: Vec<usize>,
}

/// All stretches from λ = 0 to 1.
#[derive(Debug, Clone, PartialEq)]
pub struct Sweep {
    /// In the order of λ, each beginning where the one before ends. Where two meet, both are equally good.
    pub stretches: Vec<Stretch>,
    /// Whether all values are proved, so that there are no other stretches. Otherwise `stop` ended the search.
    pub proved: bool,
}

/// The choice at each of these λ.
pub fn at(
    problem: &Problem,
    lambdas: &[f64],
    stop: &mut dyn FnMut() -> bool,
) -> Result<Vec<Selection>, crate::Invalid> {
    lambdas.iter().map(|&lambda| Ok(choose(&problem.clone().with_lambda(lambda)?, stop))).collect()
}

/// The tests of `after` that `before` does not contain, and those of `before` that `after` does not; all ascending.
pub fn changes(before: &[usize], after: &[usize]) -> (Vec<usize>, Vec<usize>) {
    let without = |these: &[usize], others: &[usize]| -> Vec<usize> {
        these.iter().copied().filter(|at| others.binary_search(at).is_err()).collect()
    };
    (without(after, before), without(before, after))
}

/// All λ at which the choice changes, and the choices between them.
pub fn sweep(problem: &Problem, stop: &mut dyn FnMut() -> bool) -> Sweep {
    let mut solver = Solver { problem, stop, proved: true };
    let (first, last) = (solver.line(0.0), solver.line(1.0));
    let mut bends: Vec<(f64, Vec<usize>)> = vec![(0.0, first.chosen.clone())];
    solver.between(&first, &last, &mut bends);
    let mut stretches: Vec<Stretch> = Vec::new();
    for (at, (from, chosen)) in bends.iter().enumerate() {
        let to = bends.get(at + 1).map_or(1.0, |(next, _)| *next);
        // A choice that is the best at one λ only is not a stretch.
        if to <= *from {
            continue;
        }
        let before = stretches.last().map_or(&[][..], |stretch| &stretch.chosen);
        let (enter, leave) = changes(before, chosen);
        stretches.push(Stretch { from: *from, to, chosen: chosen.clone(), enter, leave });
    }
    Sweep { stretches, proved: solver.proved }
}

/// The best choice at a λ, and its line.
#[derive(Clone)]
struct Line {
    lambda: f64,
    chosen: Vec<usize>,
    quality: f64,
    distance: f64,
}

impl Line {
    fn value(&self, lambda: f64) -> f64 {
        (1.0 - lambda) * self.quality + lambda * self.distance
    }
}

struct Solver<'a> {
    problem: &'a Problem,
    stop: &'a mut dyn FnMut() -> bool,
    proved: bool,
}

impl Solver<'_> {
    fn line(&mut self, lambda: f64) -> Line {
        let problem = self.problem.clone().with_lambda(lambda).expect("it is from 0 to 1");
        let Selection { chosen, state, .. } = choose(&problem, self.stop);
        self.proved &= !matches!(state, State::Open { .. });
        let (quality, distance) = problem.parts(&chosen);
        Line { lambda, chosen, quality, distance }
    }

    /// Adds the λ at which the choice changes between two λ, with what is chosen from there.
    fn between(&mut self, first: &Line, last: &Line, bends: &mut Vec<(f64, Vec<usize>)>) {
        if first.chosen == last.chosen {
            return;
        }
        // How much better the first is at its own λ, and the last at its own.
        let ahead = first.value(first.lambda) - last.value(first.lambda);
        let behind = last.value(last.lambda) - first.value(last.lambda);
        let equal = |line: &Line| TOLERANCE * line.value(line.lambda).abs();
        if ahead <= equal(first) && behind <= equal(last) {
            // They are equally good everywhere between.
            return;
        }
        let share = (ahead / (ahead + behind)).clamp(0.0, 1.0);
        let lambda = first.lambda + share * (last.lambda - first.lambda);
        let inner = lambda > first.lambda + TOLERANCE && lambda < last.lambda - TOLERANCE;
        if inner && self.proved {
            let middle = self.line(lambda);
            let crossing = first.value(lambda).max(last.value(lambda));
            if middle.value(lambda) > crossing * (1.0 + TOLERANCE) {
                self.between(first, &middle, bends);
                self.between(&middle, last, bends);
                return;
            }
        }
        bends.push((lambda, last.chosen.clone()));
    }
}
