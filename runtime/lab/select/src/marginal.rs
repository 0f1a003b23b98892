//! What more budget would buy.

use crate::choose::{Selection, choose};
use crate::problem::Problem;

/// A choice with more budget.
#[derive(Debug, Clone, PartialEq)]
pub struct Marginal {
    /// The greater budget.
    pub budget: f64,
    /// What is chosen with it.
    pub selection: Selection,
    /// How much more that is worth. The value of a choice grows with the square of its size, so gains are compared at
    /// one size of the budget only.
    pub gain: f64,
}

/// The choice with `step` more budget. Without a step, the budget is the least one with which another test can be added
/// to the selection; a smaller one may already allow to exchange tests for better and more expensive ones. `None` if
/// all tests are chosen, or if the step is not a positive number.
pub fn marginal(
    problem: &Problem,
    selection: &Selection,
    step: Option<f64>,
    stop: &mut dyn FnMut() -> bool,
) -> Option<Marginal> {
    let others = (0..problem.tests().len()).filter(|at| selection.chosen.binary_search(at).is_err());
    let cheapest = others.map(|at| problem.tests()[at].cost).reduce(f64::min)?;
    let budget = match step {
        Some(step) if step > 0.0 => problem.budget() + step,
        Some(_) => return None,
        None => problem.budget().max(problem.cost(&selection.chosen) + cheapest),
    };
    let problem = problem.clone().with_budget(budget).ok()?;
    let more = choose(&problem, stop);
    Some(Marginal { budget, gain: more.value - selection.value, selection: more })
}
