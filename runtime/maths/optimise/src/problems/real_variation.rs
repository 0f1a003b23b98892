//! Variation of vectors of real numbers: the usual operators of NSGA-II, for comparisons with other implementations.
//!
//! Simulated binary crossover in its bounded form and polynomial mutation (Deb and Agrawal 1995; Deb 2001).

use sesame_rng::Stream;

use crate::nsga2::{Child, Heritage, Variation};

/// Variation of vectors inside the unit box.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RealVariation {
    /// Length of a genome.
    pub variables: usize,
    /// Probability that a pair is crossed.
    pub crossover: f64,
    /// Distribution index of the crossover: the larger, the closer to the parents.
    pub crossover_index: u32,
    /// Probability that a variable is mutated.
    pub mutation: f64,
    /// Distribution index of the mutation: the larger, the smaller the steps.
    pub mutation_index: u32,
    /// The seed of all draws.
    pub seed: u64,
}

impl RealVariation {
    /// The settings of Deb et al. 2002: crossover 0.9 with index 15, mutation of one variable on average with index 20.
    pub fn usual(variables: usize, seed: u64) -> Self {
        let mutation = 1.0 / variables as f64;
        RealVariation { variables, crossover: 0.9, crossover_index: 15, mutation, mutation_index: 20, seed }
    }
}

impl Variation for RealVariation {
    type Genome = Vec<f64>;

    fn initial(&mut self, index: u64) -> Vec<f64> {
        let mut stream = Stream::derive(self.seed, "initial", &[index]);
        (0..self.variables).map(|_| stream.unit()).collect()
    }

    fn offspring(&mut self, parents: [&Vec<f64>; 2], generation: u64, pair: u64) -> [Child<Vec<f64>>; 2] {
        let mut stream = Stream::derive(self.seed, "crossover", &[generation, pair]);
        let mut children = parents.map(Clone::clone);
        let crossed = stream.chance(self.crossover);
        if crossed {
            let [a, b] = &mut children;
            for (xs, ys) in a.chunks_mut(64).zip(b.chunks_mut(64)) {
                let mut coins = stream.bits();
                for (x, y) in xs.iter_mut().zip(ys) {
                    if coins & 1 == 1 {
                        (*x, *y) = binary_crossover(*x, *y, self.crossover_index, &mut stream);
                    }
                    coins >>= 1;
                }
            }
        }
        let [first, second] = if crossed { [Heritage::Both; 2] } else { [Heritage::First, Heritage::Second] };
        let mut place = 2 * pair;
        let mut child = |mut genome: Vec<f64>, heritage| {
            let mut stream = Stream::derive(self.seed, "mutation", &[generation, place]);
            place += 1;
            for x in &mut genome {
                if stream.chance(self.mutation) {
                    *x = polynomial_mutation(*x, self.mutation_index, &mut stream);
                }
            }
            Child { genome, heritage }
        };
        let [a, b] = children;
        [child(a, first), child(b, second)]
    }
}

/// Simulated binary crossover of two numbers in `0..=1`; the results are in `0..=1` too, in random order.
pub fn binary_crossover(a: f64, b: f64, index: u32, stream: &mut Stream) -> (f64, f64) {
    let (low, high) = if a < b { (a, b) } else { (b, a) };
    // Parents this close have the same children but for rounding.
    if high - low < 1e-14 {
        return (a, b);
    }
    let draw = stream.unit();
    let spread = |margin: f64| {
        let beta = 1.0 + 2.0 * margin / (high - low);
        let alpha = 2.0 - 1.0 / power(beta, index + 1);
        let ratio = if draw * alpha <= 1.0 { draw * alpha } else { 1.0 / (2.0 - draw * alpha) };
        root(ratio, index + 1)
    };
    let middle = low + high;
    let below = (0.5 * (middle - spread(low) * (high - low))).clamp(0.0, 1.0);
    let above = (0.5 * (middle + spread(1.0 - high) * (high - low))).clamp(0.0, 1.0);
    if stream.chance(0.5) { (above, below) } else { (below, above) }
}

/// Polynomial mutation of a number in `0..=1`; the result is in `0..=1` too.
pub fn polynomial_mutation(x: f64, index: u32, stream: &mut Stream) -> f64 {
    let draw = stream.unit();
    let step = if draw < 0.5 {
        root(2.0 * draw + (1.0 - 2.0 * draw) * power(1.0 - x, index + 1), index + 1) - 1.0
    } else {
        1.0 - root(2.0 * (1.0 - draw) + (2.0 * draw - 1.0) * power(x, index + 1), index + 1)
    };
    (x + step).clamp(0.0, 1.0)
}

/// `base` to the whole power `n`, by squaring: multiplications alone are both exact enough and several times faster
/// than a general power, which would be half of the cost of a whole benchmark.
fn power(base: f64, n: u32) -> f64 {
    let (mut result, mut square, mut left) = (1.0, base, n);
    while left > 0 {
        if left & 1 == 1 {
            result *= square;
        }
        square *= square;
        left >>= 1;
    }
    result
}

/// The `n`th root of a number that is not negative. Square roots are one instruction: the usual index of the crossover,
/// 15, needs four of them and no power.
fn root(mut x: f64, mut n: u32) -> f64 {
    while n > 1 && n.is_multiple_of(2) {
        x = libm::sqrt(x);
        n /= 2;
    }
    if n == 1 { x } else { libm::pow(x, 1.0 / f64::from(n)) }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::hypervolume::hypervolume;
    use crate::problems::{Problem, approximate};

    fn zdt1_hypervolume(evaluations: u32, seed: u64) -> f64 {
        let front = approximate(Problem::Zdt1, 100, evaluations, seed);
        let points: Vec<&[f64]> = front.iter().map(Vec::as_slice).collect();
        hypervolume(&points, &[1.1, 1.1])
    }

    #[test]
    fn zdt1_is_approached_within_a_tenth_of_the_usual_budget_and_reached_within_half() {
        assert!(zdt1_hypervolume(2_500, 1) > 0.2);
        let median = {
            let mut volumes: Vec<f64> = (1..=3).map(|seed| zdt1_hypervolume(12_500, seed)).collect();
            volumes.sort_by(f64::total_cmp);
            volumes[1]
        };
        // The exact front has 0.8766 (2/3 of the unit square and the margins up to the reference).
        assert!((0.85..0.8767).contains(&median), "{median}");
    }

    #[test]
    fn power_and_root_undo_each_other() {
        for (x, n) in [(0.3, 1), (0.3, 16), (1.7, 21), (0.99, 21), (1.0, 5)] {
            assert!((root(power(x, n), n) - x).abs() < 1e-14, "{x} to the {n}");
            assert!((power(x, n) / libm::pow(x, f64::from(n)) - 1.0).abs() < 1e-13, "{x} to the {n}");
        }
    }

    #[test]
    fn operators_stay_in_the_unit_box_and_near_the_parents() {
        let mut stream = Stream::derive(5, "test", &[]);
        let mut near = 0;
        for _ in 0..2_000 {
            let (a, b) = (stream.unit(), stream.unit());
            let (c, d) = binary_crossover(a, b, 15, &mut stream);
            let e = polynomial_mutation(a, 20, &mut stream);
            assert!([c, d, e].iter().all(|x| (0.0..=1.0).contains(x)));
            near += u32::from((e - a).abs() < 0.1);
        }
        assert!(near > 1_600, "most mutations are small: {near} of 2000");
        for x in [0.0, 1.0] {
            assert!((0.0..=1.0).contains(&polynomial_mutation(x, 20, &mut stream)));
            assert_eq!(binary_crossover(x, x, 15, &mut stream), (x, x));
        }
    }
}
