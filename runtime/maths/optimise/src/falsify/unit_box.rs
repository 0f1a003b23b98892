//! The unit box as a search domain: for comparisons with other implementations, and for tests that are plain vectors.

use sesame_rng::Stream;

use crate::falsify::SearchDomain;
use crate::sobol::SobolPoints;

/// Vectors of numbers in `0..=1`.
#[derive(Debug, Clone)]
pub struct UnitBox {
    variables: usize,
    points: SobolPoints,
}

impl UnitBox {
    /// The box with this many variables, at least one.
    pub fn new(variables: usize, seed: u64) -> Self {
        assert!(variables > 0, "a box has a variable");
        UnitBox { variables, points: SobolPoints::new(seed) }
    }
}

impl SearchDomain for UnitBox {
    type Point = Vec<f64>;

    fn quasi_random(&mut self, index: u32) -> Vec<f64> {
        (0..self.variables).map(|variable| self.points.value(variable, index)).collect()
    }

    fn random(&self, stream: &mut Stream) -> Vec<f64> {
        (0..self.variables).map(|_| stream.unit()).collect()
    }

    fn perturb(&self, point: &Vec<f64>, step: f64, stream: &mut Stream) -> Vec<f64> {
        // All variables, or few: many requirements depend on one variable only.
        let share = if stream.chance(0.5) { 1.0 } else { 1.5 / self.variables as f64 };
        let certain = stream.below(self.variables);
        point
            .iter()
            .enumerate()
            .map(|(variable, &x)| {
                let moves = stream.chance(share) || variable == certain;
                let change = step * stream.normal();
                if moves { (x + change).clamp(0.0, 1.0) } else { x }
            })
            .collect()
    }

    fn components(&self) -> usize {
        self.variables
    }

    fn squared_distances(&self, a: &Vec<f64>, b: &Vec<f64>, squares: &mut Vec<f64>) {
        squares.extend(a.iter().zip(b).map(|(a, b)| (a - b) * (a - b)));
    }
}

#[cfg(test)]
mod tests {
    use super::super::{Falsifier, Margin, Settings};
    use super::*;

    /// The first of 50 evaluations that violates a requirement, which a hundredth of a square does.
    fn first_violation(seed: u64) -> Option<usize> {
        let settings = Settings { requirements: 1, evaluations: 50, batch: 1, seed };
        let mut search = Falsifier::new(UnitBox::new(2, seed), settings);
        let mut margins: Vec<f64> = Vec::new();
        while margins.len() < 50 && margins.iter().all(|&margin| margin >= 0.0) {
            let asked = search.ask();
            let told = asked.into_iter().map(|point| {
                let value = point.iter().map(|x| (x - 0.8) * (x - 0.8)).sum::<f64>() - 0.003;
                margins.push(value);
                (point, vec![Margin { value: Some(value), violated: value < 0.0 }])
            });
            search.tell(told.collect());
        }
        margins.iter().position(|&margin| margin < 0.0).map(|at| at + 1)
    }

    #[test]
    fn what_chance_finds_in_four_of_ten_searches_is_found_in_all() {
        let found: Vec<_> = (1..=10).map(first_violation).collect();
        assert!(found.iter().all(|found| found.is_some_and(|first| first <= 20)), "{found:?}");
    }
}
