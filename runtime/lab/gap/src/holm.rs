//! P values of many questions at once: over tests and metrics, say, of one comparison.

/// Adjusted p values after Holm's step-down procedure [Holm 1979], in the order of the given ones, each in `0..=1`.
///
/// To reject what is at most α keeps the probability of any false rejection at α or below, however the questions depend
/// on each other. Questions that have no p value are not part of the family and are left out before.
pub fn adjusted(p: &[f64]) -> Vec<f64> {
    assert!(p.iter().all(|p| (0.0..=1.0).contains(p)), "p values are probabilities");
    let mut order: Vec<usize> = (0..p.len()).collect();
    order.sort_by(|&a, &b| p[a].total_cmp(&p[b]));
    let mut adjusted = vec![0.0; p.len()];
    let mut greatest: f64 = 0.0;
    for (rank, &at) in order.iter().enumerate() {
        greatest = greatest.max((p.len() - rank) as f64 * p[at]).min(1.0);
        adjusted[at] = greatest;
    }
    adjusted
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    #[test]
    fn an_example_is_what_the_procedure_says() {
        let adjusted = adjusted(&[0.01, 0.04, 0.03, 0.005]);
        let expected = [0.03, 0.06, 0.06, 0.02];
        assert!(adjusted.iter().zip(expected).all(|(a, b)| (a - b).abs() < 1e-15), "{adjusted:?}");
        assert!(super::adjusted(&[]).is_empty());
    }

    proptest! {
        /// The procedure as it is defined: reject from the smallest on, and stop at the first that is too great.
        #[test]
        fn what_is_rejected_is_what_stepping_down_rejects(
            p in prop::collection::vec(prop_oneof![0.0..1.0f64, 0.0..0.05f64, Just(0.01)], 1..12), alpha in 0.001..0.5f64,
        ) {
            let mut order: Vec<usize> = (0..p.len()).collect();
            order.sort_by(|&a, &b| p[a].total_cmp(&p[b]));
            let mut rejected = vec![false; p.len()];
            for (rank, &at) in order.iter().enumerate() {
                if (p.len() - rank) as f64 * p[at] > alpha {
                    break;
                }
                rejected[at] = true;
            }
            let ours: Vec<bool> = adjusted(&p).iter().map(|&p| p <= alpha).collect();
            prop_assert_eq!(ours, rejected);
        }
    }
}
