//! Gaussian process regression: the mean and the standard deviation of a value at a point, from a few dozen values
//! elsewhere.
//!
//! Ordinary kriging with a Matérn 5/2 correlation [Rasmussen and Williams 2006, sections 2.2 and 4.2]. Of points only
//! their squared distances are known, in components with a weight each: variables of a vector, kinds of operations of a
//! test. Weights and noise maximise the likelihood on a coarse grid, with a mild preference for equal weights.

/// Squared distances between points, in components.
#[derive(Debug, Clone)]
pub(super) struct SquaredDistances {
    points: usize,
    components: usize,
    /// For each pair `(row, column)` with `column < row`, row by row: its components.
    squares: Vec<f64>,
}

impl SquaredDistances {
    /// No points yet.
    pub(super) fn new(components: usize) -> Self {
        SquaredDistances { points: 0, components, squares: Vec::new() }
    }

    /// Adds a point with its components to each earlier point in turn.
    pub(super) fn add(&mut self, to_earlier: &[f64]) {
        debug_assert_eq!(to_earlier.len(), self.points * self.components);
        self.squares.extend_from_slice(to_earlier);
        self.points += 1;
    }

    /// The mean squared distance of a pair; 1 if all points coincide.
    fn scale(&self) -> f64 {
        let pairs = self.squares.len() / self.components.max(1);
        let mean = self.squares.iter().sum::<f64>() / pairs.max(1) as f64;
        if mean > 0.0 { mean } else { 1.0 }
    }
}

/// A Gaussian process fitted to values at points.
#[derive(Debug, Clone)]
pub(super) struct GaussianProcess {
    weights: Vec<f64>,
    noise: f64,
    factor: CholeskyFactor,
    /// The inverse of the correlation matrix times the values minus their mean: `α` of the textbook.
    alpha: Vec<f64>,
    /// The inverse of the correlation matrix times a vector of ones.
    beta: Vec<f64>,
    mean: f64,
    variance: f64,
    /// Logarithm of the likelihood, up to a constant.
    likelihood: f64,
}

/// Mean squared distances in squared correlation lengths that are compared first.
const LENGTHS: [f64; 5] = [0.1, 0.4, 1.5, 6.0, 24.0];
/// Shares of the variance that are noise.
const NOISES: [f64; 3] = [1e-6, 1e-3, 1e-1];
/// How often a greater and a smaller weight is tried for each component, and by what factor.
const SWEEPS: usize = 2;
const FACTOR: f64 = 4.0;
/// Standard deviation of the logarithms of weights around the common one.
const SPREAD: f64 = 1.5;

impl GaussianProcess {
    /// The process with the greatest likelihood. There is at least one value, and as many as points.
    pub(super) fn fit(distances: &SquaredDistances, values: &[f64]) -> GaussianProcess {
        let scale = distances.scale();
        let mut best: Option<GaussianProcess> = None;
        for inverse in LENGTHS {
            for noise in NOISES {
                let weights = vec![inverse / scale; distances.components];
                let process = GaussianProcess::new(distances, values, weights, noise);
                if best.as_ref().is_none_or(|best| process.likelihood > best.likelihood) {
                    best = Some(process);
                }
            }
        }
        let mut best = best.expect("some were compared");
        if distances.components < 2 {
            return best;
        }
        let common = libm::log(best.weights[0]);
        let preference = |weights: &[f64]| {
            weights.iter().map(|&w| (libm::log(w) - common) / SPREAD).map(|x| -0.5 * x * x).sum::<f64>()
        };
        let mut reached = best.likelihood;
        for _ in 0..SWEEPS {
            for component in 0..distances.components {
                for factor in [FACTOR, 1.0 / FACTOR] {
                    let mut weights = best.weights.clone();
                    weights[component] *= factor;
                    let preference = preference(&weights);
                    let process = GaussianProcess::new(distances, values, weights, best.noise);
                    if process.likelihood + preference > reached {
                        reached = process.likelihood + preference;
                        best = process;
                        break;
                    }
                }
            }
        }
        best
    }

    /// A process with the same weights and noise over other points and values.
    pub(super) fn refit(&self, distances: &SquaredDistances, values: &[f64]) -> GaussianProcess {
        GaussianProcess::new(distances, values, self.weights.clone(), self.noise)
    }

    fn new(distances: &SquaredDistances, values: &[f64], weights: Vec<f64>, noise: f64) -> GaussianProcess {
        let points = distances.points;
        debug_assert_eq!(values.len(), points);
        let mut correlations = Vec::with_capacity(points * (points + 1) / 2);
        let mut pairs = distances.squares.chunks_exact(distances.components.max(1));
        for row in 0..points {
            for _ in 0..row {
                correlations.push(correlation(&weights, pairs.next().expect("there is one of each pair")));
            }
            correlations.push(1.0 + noise + 1e-10);
        }
        let factor = CholeskyFactor::new(correlations, points);
        let beta = factor.solve(&vec![1.0; points]);
        let total: f64 = beta.iter().sum();
        let mean = beta.iter().zip(values).map(|(beta, value)| beta * value).sum::<f64>() / total;
        let residuals: Vec<f64> = values.iter().map(|value| value - mean).collect();
        let alpha = factor.solve(&residuals);
        let variance = residuals.iter().zip(&alpha).map(|(a, b)| a * b).sum::<f64>().max(0.0) / points as f64;
        let likelihood = -0.5 * points as f64 * libm::log(variance.max(1e-300)) - factor.log_of_diagonal();
        GaussianProcess { weights, noise, factor, alpha, beta, mean, variance, likelihood }
    }

    /// The mean and standard deviation of the value at a point without noise, from its squared distances to each point
    /// in turn.
    pub(super) fn predict(&self, distances: &[f64]) -> (f64, f64) {
        let near: Vec<f64> =
            distances.chunks_exact(self.weights.len().max(1)).map(|of| correlation(&self.weights, of)).collect();
        let mean = self.mean + near.iter().zip(&self.alpha).map(|(a, b)| a * b).sum::<f64>();
        let known = self.factor.forward(&near);
        let explained: f64 = known.iter().map(|x| x * x).sum();
        let total: f64 = self.beta.iter().sum();
        let unlike = 1.0 - near.iter().zip(&self.beta).map(|(a, b)| a * b).sum::<f64>();
        let share = (1.0 - explained + unlike * unlike / total).max(0.0);
        (mean, libm::sqrt(self.variance * share))
    }
}

fn correlation(weights: &[f64], squares: &[f64]) -> f64 {
    let square: f64 = weights.iter().zip(squares).map(|(weight, square)| weight * square).sum();
    let scaled = libm::sqrt(5.0 * square);
    (1.0 + scaled + scaled * scaled / 3.0) * libm::exp(-scaled)
}

/// The Cholesky factor of a positive definite matrix: lower triangular.
#[derive(Debug, Clone)]
struct CholeskyFactor {
    /// Rows up to the diagonal, one after the other.
    rows: Vec<f64>,
    size: usize,
}

impl CholeskyFactor {
    /// Factorises a symmetric matrix, given as rows up to the diagonal.
    fn new(mut rows: Vec<f64>, size: usize) -> CholeskyFactor {
        for row in 0..size {
            let (above, this) = rows.split_at_mut(row * (row + 1) / 2);
            for column in 0..row {
                let start = column * (column + 1) / 2;
                let other = &above[start..=start + column];
                let sum: f64 = this[..column].iter().zip(other).map(|(a, b)| a * b).sum();
                this[column] = (this[column] - sum) / other[column];
            }
            let sum: f64 = this[..row].iter().map(|x| x * x).sum();
            this[row] = libm::sqrt((this[row] - sum).max(1e-12));
        }
        CholeskyFactor { rows, size }
    }

    fn row(&self, row: usize) -> &[f64] {
        let start = row * (row + 1) / 2;
        &self.rows[start..=start + row]
    }

    /// The solution of `factor x = right`.
    fn forward(&self, right: &[f64]) -> Vec<f64> {
        let mut solution: Vec<f64> = Vec::with_capacity(self.size);
        for (row, &right) in right.iter().enumerate() {
            let of = self.row(row);
            let sum: f64 = of.iter().zip(&solution).map(|(a, b)| a * b).sum();
            solution.push((right - sum) / of[row]);
        }
        solution
    }

    /// The solution of `factor factorᵀ x = right`.
    fn solve(&self, right: &[f64]) -> Vec<f64> {
        let mut solution = self.forward(right);
        for row in (0..self.size).rev() {
            let of = self.row(row);
            solution[row] /= of[row];
            let value = solution[row];
            solution[..row].iter_mut().zip(of).for_each(|(x, a)| *x -= a * value);
        }
        solution
    }

    /// Half the logarithm of the determinant of the product.
    fn log_of_diagonal(&self) -> f64 {
        (0..self.size).map(|row| libm::log(self.row(row)[row])).sum()
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    fn distances(points: &[Vec<f64>]) -> SquaredDistances {
        let mut distances = SquaredDistances::new(points[0].len());
        for (at, point) in points.iter().enumerate() {
            distances.add(&to_each(point, &points[..at]));
        }
        distances
    }

    fn to_each(point: &[f64], others: &[Vec<f64>]) -> Vec<f64> {
        others.iter().flat_map(|other| point.iter().zip(other).map(|(a, b)| (a - b) * (a - b))).collect()
    }

    /// Gaussian elimination with pivoting.
    fn naive(mut matrix: Vec<Vec<f64>>, mut right: Vec<f64>) -> Vec<f64> {
        let n = right.len();
        for column in 0..n {
            let by_size = |a: &usize, b: &usize| matrix[*a][column].abs().total_cmp(&matrix[*b][column].abs());
            let pivot = (column..n).max_by(by_size).unwrap();
            matrix.swap(column, pivot);
            right.swap(column, pivot);
            let head = matrix[column].clone();
            for row in (0..n).filter(|&row| row != column) {
                let factor = matrix[row][column] / head[column];
                matrix[row].iter_mut().zip(&head).for_each(|(x, h)| *x -= factor * h);
                right[row] -= factor * right[column];
            }
        }
        (0..n).map(|row| right[row] / matrix[row][row]).collect()
    }

    proptest! {
        #[test]
        fn predictions_are_those_of_kriging_solved_naively(
            points in prop::collection::vec(prop::collection::vec(0.0..1.0f64, 2), 2..8),
            values in prop::collection::vec(-5.0..5.0f64, 8),
            at in prop::collection::vec(0.0..1.0f64, 2),
        ) {
            let values = &values[..points.len()];
            let distances = distances(&points);
            let process = GaussianProcess::new(&distances, values, vec![2.0, 0.5], 0.01);
            let (mean, deviation) = process.predict(&to_each(&at, &points));

            // The best linear unbiased prediction: correlations bordered by ones for the unknown mean.
            let n = points.len();
            let near = |a: &[f64], b: &Vec<f64>| correlation(&[2.0, 0.5], &to_each(a, std::slice::from_ref(b)));
            let mut matrix: Vec<Vec<f64>> = (0..n)
                .map(|i| {
                    let row = (0..n).map(|j| near(&points[i], &points[j]) + if i == j { 0.01 } else { 0.0 });
                    row.chain([1.0]).collect()
                })
                .collect();
            matrix.push([vec![1.0; n], vec![0.0]].concat());
            let right: Vec<f64> = points.iter().map(|point| near(&at, point)).chain([1.0]).collect();
            let weights = naive(matrix, right.clone());
            let expected: f64 = weights.iter().zip(values).map(|(w, v)| w * v).sum();
            prop_assert!((mean - expected).abs() < 1e-5, "{} and {}", mean, expected);
            let share = 1.0 - weights.iter().zip(&right).map(|(w, r)| w * r).sum::<f64>();
            prop_assert!((deviation * deviation - process.variance * share).abs() < 1e-4 * (1.0 + process.variance));
        }
    }

    #[test]
    fn a_fit_finds_the_variable_that_matters_and_is_certain_only_near_known_points() {
        let mut stream = sesame_rng::Stream::derive(1, "test", &[]);
        let points: Vec<Vec<f64>> = (0..30).map(|_| (0..3).map(|_| stream.unit()).collect()).collect();
        let values: Vec<f64> = points.iter().map(|point| libm::sin(6.0 * point[1])).collect();
        let process = GaussianProcess::fit(&distances(&points), &values);
        assert!(process.weights[1] > 3.0 * process.weights[0] && process.weights[1] > 3.0 * process.weights[2]);
        for at in [0.2, 0.5, 0.8] {
            let (mean, deviation) = process.predict(&to_each(&[0.5, at, 0.5], &points));
            assert!((mean - libm::sin(6.0 * at)).abs() < 0.1, "{mean} at {at}");
            assert!(deviation < process.predict(&to_each(&[0.5, at + 3.0, 0.5], &points)).1);
        }
    }

    #[test]
    fn equal_values_are_predicted_everywhere_with_certainty() {
        let points = vec![vec![0.1], vec![0.6], vec![0.9]];
        let process = GaussianProcess::fit(&distances(&points), &[4.0; 3]);
        assert_eq!(process.predict(&to_each(&[0.3], &points)), (4.0, 0.0));
    }
}
