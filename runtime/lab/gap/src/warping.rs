//! Dynamic time warping: how alike two series are if each may locally run ahead of the other.

/// Two series, one stretched onto the other.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Warping {
    /// The root of the least sum of squared differences along a path, in the unit of the values.
    pub distance: f64,
    /// How many pairs of values the path has, the shortest of those with this sum.
    pub steps: usize,
}

impl Warping {
    /// The root mean square of the differences along the path: the distance, normalised by the path's length.
    pub fn rms(self) -> f64 {
        self.distance / libm::sqrt(self.steps as f64)
    }
}

/// The DTW distance [Sakoe and Chiba 1978] of two series that have values, with paths that pair values at most `band`
/// places apart; a band that could not bridge their different lengths is widened to do so.
///
/// Takes time proportional to the length times the band.
pub fn dtw(a: &[f64], b: &[f64], band: usize) -> Warping {
    assert!(!a.is_empty() && !b.is_empty(), "series that are compared have values");
    let band = band.max(a.len().abs_diff(b.len())).min(a.len().max(b.len()));
    let width = 2 * band + 1;
    // For each place in a row: the least sum of squares up to it, and the pairs of the shortest path with this sum. The
    // place `k` of row `i` pairs the values `i` and `i + k - band`.
    let none = (f64::INFINITY, 0usize);
    let mut previous = vec![none; width + 1];
    let mut current = vec![none; width + 1];
    for (i, &x) in a.iter().enumerate() {
        for k in 0..width {
            let Some(j) = (i + k).checked_sub(band).filter(|&j| j < b.len()) else {
                current[k] = none;
                continue;
            };
            let left = if k == 0 { none } else { current[k - 1] };
            let from = [previous[k], previous[k + 1], left].into_iter().reduce(|a, b| if less(b, a) { b } else { a });
            let (sum, steps) = if i == 0 && j == 0 { (0.0, 0) } else { from.expect("there are three") };
            current[k] = (sum + (x - b[j]) * (x - b[j]), steps + 1);
        }
        // Right of the row there is nothing.
        current[width] = none;
        std::mem::swap(&mut previous, &mut current);
    }
    let (sum, steps) = previous[b.len() - 1 + band - (a.len() - 1)];
    Warping { distance: libm::sqrt(sum), steps }
}

fn less(a: (f64, usize), b: (f64, usize)) -> bool {
    a.0 < b.0 || (a.0 == b.0 && a.1 < b.1)
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    #[test]
    fn a_late_step_costs_nothing_within_the_band() {
        let a = [0.0, 0.0, 1.0, 1.0, 1.0, 1.0];
        let b = [0.0, 0.0, 0.0, 0.0, 1.0, 1.0];
        assert_eq!(dtw(&a, &b, 2), Warping { distance: 0.0, steps: 8 });
        // Without a band it is the Euclidean distance.
        assert_eq!(dtw(&a, &b, 0), Warping { distance: libm::sqrt(2.0), steps: 6 });
        assert_eq!(dtw(&a, &b, 1).distance, 1.0);
        assert!((dtw(&a, &b, 0).rms() - libm::sqrt(2.0 / 6.0)).abs() < 1e-15);
        assert_eq!(dtw(&[3.0], &[1.0, 2.0], 0), Warping { distance: libm::sqrt(5.0), steps: 2 });
    }

    /// The whole matrix, as in the textbook.
    fn naive(a: &[f64], b: &[f64], band: usize) -> (f64, usize) {
        let band = band.max(a.len().abs_diff(b.len()));
        let mut matrix = vec![vec![(f64::INFINITY, 0); b.len()]; a.len()];
        for i in 0..a.len() {
            for j in (0..b.len()).filter(|&j| i.abs_diff(j) <= band) {
                let mut best = if i + j == 0 { (0.0, 0) } else { (f64::INFINITY, 0) };
                for (di, dj) in [(1, 1), (1, 0), (0, 1)] {
                    if i >= di && j >= dj && less(matrix[i - di][j - dj], best) {
                        best = matrix[i - di][j - dj];
                    }
                }
                matrix[i][j] = (best.0 + (a[i] - b[j]) * (a[i] - b[j]), best.1 + 1);
            }
        }
        matrix[a.len() - 1][b.len() - 1]
    }

    fn any_series() -> impl Strategy<Value = Vec<f64>> {
        prop::collection::vec(prop_oneof![-3.0..3.0f64, (-2i32..2).prop_map(f64::from)], 1..20)
    }

    proptest! {
        #[test]
        fn the_band_gives_what_the_whole_matrix_gives(a in any_series(), b in any_series(), band in 0usize..25) {
            let ours = dtw(&a, &b, band);
            let (sum, steps) = naive(&a, &b, band);
            prop_assert_eq!(ours, Warping { distance: libm::sqrt(sum), steps });
            prop_assert!((dtw(&b, &a, band).distance - ours.distance).abs() < 1e-12, "sides can be swapped");
            prop_assert!(dtw(&a, &b, band + 1).distance <= ours.distance, "a wider band finds no worse path");
            prop_assert_eq!(dtw(&a, &a, band).distance, 0.0);
        }
    }
}
