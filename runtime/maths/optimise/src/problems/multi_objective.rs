//! Published problems with known fronts, over the unit box: for comparisons of NSGA-II with other implementations.
//!
//! ZDT1 to ZDT3: Zitzler, Deb and Thiele 2000. DTLZ2: Deb, Thiele, Laumanns and Zitzler 2002.

use std::f64::consts::PI;

use crate::dominance::Fitness;
use crate::nsga2::{Nsga2, Settings, Survival, Told};
use crate::problems::RealVariation;

/// A problem: objectives of a vector of numbers in `0..=1`, all to be minimised.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Problem {
    /// Two objectives, 30 variables, a convex front.
    Zdt1,
    /// Two objectives, 30 variables, a concave front.
    Zdt2,
    /// Two objectives, 30 variables, a front of five pieces.
    Zdt3,
    /// Three objectives, 12 variables, an eighth of a sphere.
    Dtlz2,
}

impl Problem {
    /// All of them.
    pub const ALL: [Problem; 4] = [Problem::Zdt1, Problem::Zdt2, Problem::Zdt3, Problem::Dtlz2];

    /// Its name in small letters.
    pub fn name(self) -> &'static str {
        match self {
            Problem::Zdt1 => "zdt1",
            Problem::Zdt2 => "zdt2",
            Problem::Zdt3 => "zdt3",
            Problem::Dtlz2 => "dtlz2",
        }
    }

    /// How many variables it has, as it is usually posed.
    pub fn variables(self) -> usize {
        if self == Problem::Dtlz2 { 12 } else { 30 }
    }

    /// Where hypervolumes are usually measured from: 1.1 in each objective.
    pub fn reference(self) -> &'static [f64] {
        if self == Problem::Dtlz2 { &[1.1; 3] } else { &[1.1; 2] }
    }

    /// The hypervolume of the exact front.
    pub fn exact_hypervolume(self) -> f64 {
        match self {
            // The square above the front 1 - sqrt(x), and the margins: 2/3 + 0.1 + 0.1 + 0.01.
            Problem::Zdt1 => 2.0 / 3.0 + 0.21,
            // Above 1 - x²: 1/3 and the margins.
            Problem::Zdt2 => 1.0 / 3.0 + 0.21,
            Problem::Zdt3 => zdt3_exact(),
            // The cube without an eighth of the unit ball.
            Problem::Dtlz2 => 1.1 * 1.1 * 1.1 - PI / 6.0,
        }
    }

    /// The objectives of a vector.
    pub fn evaluate(self, x: &[f64]) -> Vec<f64> {
        let zdt = |shape: fn(f64, f64) -> f64| {
            let others = x.len().saturating_sub(1).max(1) as f64;
            let g = 1.0 + 9.0 * x[1..].iter().sum::<f64>() / others;
            vec![x[0], g * shape(x[0], x[0] / g)]
        };
        match self {
            Problem::Zdt1 => zdt(|_, ratio| 1.0 - libm::sqrt(ratio)),
            Problem::Zdt2 => zdt(|_, ratio| 1.0 - ratio * ratio),
            Problem::Zdt3 => zdt(|first, ratio| 1.0 - libm::sqrt(ratio) - ratio * libm::sin(10.0 * PI * first)),
            Problem::Dtlz2 => dtlz2(x, 3),
        }
    }
}

/// DTLZ2 with any number of objectives, at least 2, of more variables than that: the front is the part of the unit
/// sphere in which all objectives are positive.
pub fn dtlz2(x: &[f64], objectives: usize) -> Vec<f64> {
    let (angles, others) = x.split_at(objectives - 1);
    let radius = 1.0 + others.iter().map(|x| (x - 0.5) * (x - 0.5)).sum::<f64>();
    (0..objectives)
        .map(|at| {
            let cosines = &angles[..objectives - 1 - at];
            let product = cosines.iter().fold(radius, |product, x| product * libm::cos(x * PI / 2.0));
            if at == 0 { product } else { product * libm::sin(angles[objectives - 1 - at] * PI / 2.0) }
        })
        .collect()
}

/// The exact volume of ZDT3 by a fine sum: its front is the part of a known curve that nothing on it dominates.
fn zdt3_exact() -> f64 {
    let steps = 2_000_000u32;
    let (mut best, mut volume) = (1.1f64, 0.0);
    for step in 0..steps {
        let x = f64::from(step) / f64::from(steps);
        best = best.min(1.0 - libm::sqrt(x) - x * libm::sin(10.0 * PI * x));
        volume += (1.1 - best) / f64::from(steps);
    }
    volume + 0.1 * (1.1 - best)
}

/// The objectives of the final population of a run of NSGA-II with the usual operators ([`RealVariation::usual`]).
pub fn approximate(problem: Problem, population: u32, evaluations: u32, seed: u64) -> Vec<Vec<f64>> {
    let settings = Settings { population, evaluations, seed, survival: Survival::Crowded };
    evolve(settings, problem.variables(), |x| problem.evaluate(x))
}

/// The objectives of the final population of a run of NSGA-III on [`dtlz2`] with the usual operators and nine variables
/// more than objectives, as it is usually posed.
pub fn approximate_dtlz2(objectives: usize, population: u32, evaluations: u32, seed: u64) -> Vec<Vec<f64>> {
    let settings = Settings { population, evaluations, seed, survival: Survival::ReferencePoints };
    evolve(settings, objectives + 9, |x| dtlz2(x, objectives))
}

fn evolve(settings: Settings, variables: usize, evaluate: impl Fn(&[f64]) -> Vec<f64>) -> Vec<Vec<f64>> {
    let mut search = Nsga2::new(settings, RealVariation::usual(variables, settings.seed));
    let mut number = 0;
    loop {
        let batch = search.ask();
        if batch.is_empty() {
            break;
        }
        search.tell(batch.into_iter().map(|asked| {
            number += 1;
            let fitness = Fitness::Measured(evaluate(&asked.genome));
            Told { number, genome: asked.genome, fitness }
        }));
    }
    search.population().iter().filter_map(|member| member.fitness.objectives()).map(<[f64]>::to_vec).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_best_vectors_lie_on_the_known_fronts() {
        let mut best = vec![0.0; 30];
        best[0] = 0.25;
        assert_eq!(Problem::Zdt1.evaluate(&best), [0.25, 0.5]);
        assert_eq!(Problem::Zdt2.evaluate(&best), [0.25, 0.9375]);
        assert_eq!(Problem::Zdt3.evaluate(&best)[0], 0.25);
        assert!((Problem::Zdt3.evaluate(&best)[1] - 0.25).abs() < 1e-12, "sin(2.5 π) is 1");
        let sphere = Problem::Dtlz2.evaluate(&[0.3, 0.7, 0.5, 0.5, 0.5, 0.5, 0.5, 0.5, 0.5, 0.5, 0.5, 0.5]);
        assert!((sphere.iter().map(|x| x * x).sum::<f64>() - 1.0).abs() < 1e-12);
        assert_eq!(Problem::Dtlz2.evaluate(&[0.0; 12])[2], 0.0);
        let five = dtlz2(&[0.3, 0.7, 0.1, 0.9, 0.5, 0.5], 5);
        assert!(five.len() == 5 && (five.iter().map(|x| x * x).sum::<f64>() - 1.0).abs() < 1e-12);
    }

    #[test]
    fn exact_volumes_are_the_published_ones() {
        assert!((Problem::Zdt1.exact_hypervolume() - 0.8767).abs() < 1e-4);
        assert!((Problem::Zdt2.exact_hypervolume() - 0.5433).abs() < 1e-4);
        assert!((Problem::Dtlz2.exact_hypervolume() - 0.8074).abs() < 1e-4);
        assert!((1.3..1.4).contains(&Problem::Zdt3.exact_hypervolume()), "{}", Problem::Zdt3.exact_hypervolume());
    }
}
