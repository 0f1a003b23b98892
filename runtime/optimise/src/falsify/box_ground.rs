//! The unit box as a ground: what falsification is compared with other implementations on. No campaign uses it.

use sesame_rng::Stream;

use crate::falsify::Ground;
use crate::sobol::SobolPoints;

/// Vectors of numbers in `0..=1`.
#[derive(Debug, Clone)]
pub struct UnitBox {
    variables: usize,
    points: SobolPoints,
}

impl UnitBox {
    /// The box of so many variables, at least one.
    pub fn new(variables: usize, seed: u64) -> Self {
        assert!(variables > 0, "there is something to vary");
        UnitBox { variables, points: SobolPoints::new(seed) }
    }
}

impl Ground for UnitBox {
    type Place = Vec<f64>;

    fn spread(&mut self, index: u32) -> Vec<f64> {
        (0..self.variables).map(|variable| self.points.value(variable, index)).collect()
    }

    fn anywhere(&self, stream: &mut Stream) -> Vec<f64> {
        (0..self.variables).map(|_| stream.unit()).collect()
    }

    fn near(&self, place: &Vec<f64>, reach: f64, stream: &mut Stream) -> Vec<f64> {
        // All variables, or a few: many a requirement hangs on one.
        let share = if stream.chance(0.5) { 1.0 } else { 1.5 / self.variables as f64 };
        let certain = stream.below(self.variables);
        place
            .iter()
            .enumerate()
            .map(|(variable, &x)| {
                let moves = stream.chance(share) || variable == certain;
                let step = reach * stream.normal();
                if moves { (x + step).clamp(0.0, 1.0) } else { x }
            })
            .collect()
    }

    fn components(&self) -> usize {
        self.variables
    }

    fn separation(&self, a: &Vec<f64>, b: &Vec<f64>, squares: &mut Vec<f64>) {
        squares.extend(a.iter().zip(b).map(|(a, b)| (a - b) * (a - b)));
    }
}
