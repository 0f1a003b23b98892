//! Gaussian process regression: what is to be expected of a place, and how surely, by a few dozen measurements elsewhere.
//!
//! Ordinary kriging with a Matérn 5/2 correlation (Rasmussen and Williams 2006, sections 2.2 and 4.2). Places are known by
//! how far they are from each other only, in components that weigh differently: variables of a vector, kinds of operations of a
//! test. Weights and noise are those of the greatest likelihood on a coarse grid, with a mild preference for weights alike.

/// Squared distances between places, in components.
#[derive(Debug, Clone)]
pub(super) struct Separations {
    places: usize,
    components: usize,
    /// Of each pair `(row, column)` with `column < row`, row by row, its components.
    squares: Vec<f64>,
}

impl Separations {
    /// Those of no places.
    pub(super) fn new(components: usize) -> Self {
        Separations { places: 0, components, squares: Vec::new() }
    }

    /// Adds a place, with its components to each earlier one in turn.
    pub(super) fn add(&mut self, to_earlier: &[f64]) {
        debug_assert_eq!(to_earlier.len(), self.places * self.components);
        self.squares.extend_from_slice(to_earlier);
        self.places += 1;
    }

    /// The mean squared distance of a pair; 1 where all are in one place.
    fn scale(&self) -> f64 {
        let pairs = self.squares.len() / self.components.max(1);
        let mean = self.squares.iter().sum::<f64>() / pairs.max(1) as f64;
        if mean > 0.0 { mean } else { 1.0 }
    }
}

/// A fitted field.
#[derive(Debug, Clone)]
pub(super) struct Field {
    weights: Vec<f64>,
    noise: f64,
    factor: Factor,
    /// The inverse of the correlation times the values without their mean.
    pull: Vec<f64>,
    /// The inverse of the correlation times ones.
    level: Vec<f64>,
    mean: f64,
    variance: f64,
    /// Logarithm of the likelihood, but for constants.
    likelihood: f64,
}

/// Mean squared distances per squared length of correlation that are compared at first.
const LENGTHS: [f64; 5] = [0.1, 0.4, 1.5, 6.0, 24.0];
/// Shares of the variance that are noise.
const NOISES: [f64; 3] = [1e-6, 1e-3, 1e-1];
/// How often the weight of each component is tried higher and lower, and by what factor.
const SWEEPS: usize = 2;
const FACTOR: f64 = 4.0;
/// Standard deviation of the logarithms of weights around the common one.
const SPREAD: f64 = 1.5;

impl Field {
    /// The field of the greatest likelihood; there is at least one value, and as many as places.
    pub(super) fn fitted(separations: &Separations, values: &[f64]) -> Field {
        let scale = separations.scale();
        let mut best: Option<Field> = None;
        for inverse in LENGTHS {
            for noise in NOISES {
                let weights = vec![inverse / scale; separations.components];
                let field = Field::of(separations, values, weights, noise);
                if best.as_ref().is_none_or(|best| field.likelihood > best.likelihood) {
                    best = Some(field);
                }
            }
        }
        let mut best = best.expect("some were compared");
        if separations.components < 2 {
            return best;
        }
        let common = libm::log(best.weights[0]);
        let preference = |weights: &[f64]| {
            weights.iter().map(|&w| (libm::log(w) - common) / SPREAD).map(|x| -0.5 * x * x).sum::<f64>()
        };
        let mut reached = best.likelihood;
        for _ in 0..SWEEPS {
            for component in 0..separations.components {
                for factor in [FACTOR, 1.0 / FACTOR] {
                    let mut weights = best.weights.clone();
                    weights[component] *= factor;
                    let preference = preference(&weights);
                    let field = Field::of(separations, values, weights, best.noise);
                    if field.likelihood + preference > reached {
                        reached = field.likelihood + preference;
                        best = field;
                        break;
                    }
                }
            }
        }
        best
    }

    /// The field of the same weights and noise, of other places and values.
    pub(super) fn refitted(&self, separations: &Separations, values: &[f64]) -> Field {
        Field::of(separations, values, self.weights.clone(), self.noise)
    }

    fn of(separations: &Separations, values: &[f64], weights: Vec<f64>, noise: f64) -> Field {
        let places = separations.places;
        debug_assert_eq!(values.len(), places);
        let mut correlations = Vec::with_capacity(places * (places + 1) / 2);
        let mut pairs = separations.squares.chunks_exact(separations.components.max(1));
        for row in 0..places {
            for _ in 0..row {
                correlations.push(correlation(&weights, pairs.next().expect("there is one of each pair")));
            }
            correlations.push(1.0 + noise + 1e-10);
        }
        let factor = Factor::of(correlations, places);
        let level = factor.solve(&vec![1.0; places]);
        let total: f64 = level.iter().sum();
        let mean = level.iter().zip(values).map(|(level, value)| level * value).sum::<f64>() / total;
        let residuals: Vec<f64> = values.iter().map(|value| value - mean).collect();
        let pull = factor.solve(&residuals);
        let variance = residuals.iter().zip(&pull).map(|(a, b)| a * b).sum::<f64>().max(0.0) / places as f64;
        let likelihood = -0.5 * places as f64 * libm::log(variance.max(1e-300)) - factor.log_of_diagonal();
        Field { weights, noise, factor, pull, level, mean, variance, likelihood }
    }

    /// Mean and standard deviation of a place's value without noise, from its components to each place in turn.
    pub(super) fn at(&self, separations: &[f64]) -> (f64, f64) {
        let near: Vec<f64> =
            separations.chunks_exact(self.weights.len().max(1)).map(|of| correlation(&self.weights, of)).collect();
        let mean = self.mean + near.iter().zip(&self.pull).map(|(a, b)| a * b).sum::<f64>();
        let known = self.factor.forward(&near);
        let explained: f64 = known.iter().map(|x| x * x).sum();
        let total: f64 = self.level.iter().sum();
        let unlike = 1.0 - near.iter().zip(&self.level).map(|(a, b)| a * b).sum::<f64>();
        let share = (1.0 - explained + unlike * unlike / total).max(0.0);
        (mean, libm::sqrt(self.variance * share))
    }
}

fn correlation(weights: &[f64], squares: &[f64]) -> f64 {
    let square: f64 = weights.iter().zip(squares).map(|(weight, square)| weight * square).sum();
    let scaled = libm::sqrt(5.0 * square);
    (1.0 + scaled + scaled * scaled / 3.0) * libm::exp(-scaled)
}

/// A lower triangular matrix whose product with its transpose is a positive definite one (Cholesky).
#[derive(Debug, Clone)]
struct Factor {
    /// Rows up to the diagonal, one after the other.
    rows: Vec<f64>,
    size: usize,
}

impl Factor {
    /// Of a symmetric matrix, given as rows up to the diagonal.
    fn of(mut rows: Vec<f64>, size: usize) -> Factor {
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
        Factor { rows, size }
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

    fn separations(places: &[Vec<f64>]) -> Separations {
        let mut separations = Separations::new(places[0].len());
        for (at, place) in places.iter().enumerate() {
            separations.add(&to_each(place, &places[..at]));
        }
        separations
    }

    fn to_each(place: &[f64], others: &[Vec<f64>]) -> Vec<f64> {
        others.iter().flat_map(|other| place.iter().zip(other).map(|(a, b)| (a - b) * (a - b))).collect()
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
        fn expectations_are_those_of_kriging_solved_naively(
            places in prop::collection::vec(prop::collection::vec(0.0..1.0f64, 2), 2..8),
            values in prop::collection::vec(-5.0..5.0f64, 8),
            at in prop::collection::vec(0.0..1.0f64, 2),
        ) {
            let values = &values[..places.len()];
            let separations = separations(&places);
            let field = Field::of(&separations, values, vec![2.0, 0.5], 0.01);
            let (mean, deviation) = field.at(&to_each(&at, &places));

            // The best linear unbiased prediction: correlations bordered by ones for the unknown mean.
            let n = places.len();
            let near = |a: &[f64], b: &Vec<f64>| correlation(&[2.0, 0.5], &to_each(a, std::slice::from_ref(b)));
            let mut matrix: Vec<Vec<f64>> = (0..n)
                .map(|i| {
                    let row = (0..n).map(|j| near(&places[i], &places[j]) + if i == j { 0.01 } else { 0.0 });
                    row.chain([1.0]).collect()
                })
                .collect();
            matrix.push([vec![1.0; n], vec![0.0]].concat());
            let right: Vec<f64> = places.iter().map(|place| near(&at, place)).chain([1.0]).collect();
            let weights = naive(matrix, right.clone());
            let expected: f64 = weights.iter().zip(values).map(|(w, v)| w * v).sum();
            prop_assert!((mean - expected).abs() < 1e-5, "{} and {}", mean, expected);
            let share = 1.0 - weights.iter().zip(&right).map(|(w, r)| w * r).sum::<f64>();
            prop_assert!((deviation * deviation - field.variance * share).abs() < 1e-4 * (1.0 + field.variance));
        }
    }

    #[test]
    fn a_fit_finds_the_variable_that_matters_and_is_sure_only_where_it_knows() {
        let mut stream = sesame_rng::Stream::derive(1, "test", &[]);
        let places: Vec<Vec<f64>> = (0..30).map(|_| (0..3).map(|_| stream.unit()).collect()).collect();
        let values: Vec<f64> = places.iter().map(|place| libm::sin(6.0 * place[1])).collect();
        let field = Field::fitted(&separations(&places), &values);
        assert!(field.weights[1] > 3.0 * field.weights[0] && field.weights[1] > 3.0 * field.weights[2]);
        for at in [0.2, 0.5, 0.8] {
            let (mean, deviation) = field.at(&to_each(&[0.5, at, 0.5], &places));
            assert!((mean - libm::sin(6.0 * at)).abs() < 0.1, "{mean} at {at}");
            assert!(deviation < field.at(&to_each(&[0.5, at + 3.0, 0.5], &places)).1);
        }
    }

    #[test]
    fn values_all_alike_leave_no_doubt_and_no_place_better() {
        let places = vec![vec![0.1], vec![0.6], vec![0.9]];
        let field = Field::fitted(&separations(&places), &[4.0; 3]);
        assert_eq!(field.at(&to_each(&[0.3], &places)), (4.0, 0.0));
    }
}
