//! Fitness, and when one is better than another: constrained dominance (Deb et al. 2002, definition 1).

use std::cmp::Ordering;

/// What the search knows of an evaluated solution. Smaller is better.
#[derive(Debug, Clone, PartialEq)]
pub enum Fitness {
    /// Its objective values, each oriented so that smaller is better, in the order of the problem's objectives; never
    /// NaN, possibly infinite, never an infeasible solution's.
    Measured(Vec<f64>),
    /// It breaks the problem's constraints: by how much in total, positive and finite. Smaller is better, and every
    /// measured solution is better still.
    Infeasible {
        /// The total violation.
        violation: f64,
    },
    /// It has no fitness: worse than everything else, equal to every other such solution, and on no front.
    Unfit(Unfit),
}

impl Fitness {
    /// The objective values of a measured solution.
    pub fn objectives(&self) -> Option<&[f64]> {
        match self {
            Fitness::Measured(objectives) => Some(objectives),
            Fitness::Infeasible { .. } | Fitness::Unfit(_) => None,
        }
    }
}

/// Why a test has no fitness.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Unfit {
    /// None of its operations had an effect.
    Void,
    /// An objective has neither a value nor a default, although the system did not fail.
    Unmeasured,
    /// The simulator or a hook failed.
    Crash,
    /// It was stopped at its wall-clock limit.
    Timeout,
}

/// Whether `a` is at least as good as `b` everywhere and better somewhere.
pub fn dominates(a: &Fitness, b: &Fitness) -> bool {
    match (a, b) {
        (Fitness::Measured(a), Fitness::Measured(b)) => dominates_in_all(a, b),
        (Fitness::Infeasible { violation: a }, Fitness::Infeasible { violation: b }) => a < b,
        _ => class(a) < class(b),
    }
}

/// Pareto dominance of objective values, smaller being better. Equal vectors do not dominate each other.
pub fn dominates_in_all(a: &[f64], b: &[f64]) -> bool {
    debug_assert_eq!(a.len(), b.len(), "solutions of one problem have the same objectives");
    let mut better = false;
    for (x, y) in a.iter().zip(b) {
        if x > y {
            return false;
        }
        better |= x < y;
    }
    better
}

/// The order by the first objective, then the second, and so on: a total order, as there is no NaN, in which a
/// solution never comes after one that it dominates.
pub fn lexicographic(a: &[f64], b: &[f64]) -> Ordering {
    a.iter().zip(b).map(|(x, y)| ascending(*x, *y)).find(|order| order.is_ne()).unwrap_or(Ordering::Equal)
}

/// The order of two numbers, the zeros being equal. There is no NaN in a [`Fitness`].
pub(crate) fn ascending(x: f64, y: f64) -> Ordering {
    debug_assert!(!x.is_nan() && !y.is_nan(), "objective values are never NaN");
    if x < y {
        Ordering::Less
    } else if x > y {
        Ordering::Greater
    } else {
        Ordering::Equal
    }
}

fn class(fitness: &Fitness) -> u8 {
    match fitness {
        Fitness::Measured(_) => 0,
        Fitness::Infeasible { .. } => 1,
        Fitness::Unfit(_) => 2,
    }
}

#[cfg(test)]
pub(crate) mod tests {
    use proptest::prelude::*;

    use super::*;

    /// Fitness values with many ties, some infinite, infeasible or unfit, all of `n` objectives.
    pub(crate) fn any_fitness(n: usize) -> impl Strategy<Value = Fitness> {
        let value = prop_oneof![
            8 => (0i32..6).prop_map(f64::from),
            4 => -2.0..6.0f64,
            1 => Just(-0.0),
            1 => Just(f64::INFINITY),
            1 => Just(f64::NEG_INFINITY),
        ];
        prop_oneof![
            12 => proptest::collection::vec(value, n).prop_map(Fitness::Measured),
            1 => (1i32..3).prop_map(|violation| Fitness::Infeasible { violation: f64::from(violation) }),
            1 => Just(Fitness::Unfit(Unfit::Void)),
            1 => Just(Fitness::Unfit(Unfit::Crash)),
        ]
    }

    /// Up to 40 fitness values of one problem with 1 to 4 objectives.
    pub(crate) fn any_population() -> impl Strategy<Value = Vec<Fitness>> {
        (1usize..=4).prop_flat_map(|n| proptest::collection::vec(any_fitness(n), 0..40))
    }

    #[test]
    fn measured_beats_infeasible_beats_unfit() {
        let bad = Fitness::Measured(vec![f64::INFINITY]);
        let slight = Fitness::Infeasible { violation: 0.1 };
        let severe = Fitness::Infeasible { violation: 7.0 };
        let void = Fitness::Unfit(Unfit::Void);
        let ladder = [&bad, &slight, &severe, &void];
        for (i, a) in ladder.iter().enumerate() {
            for (j, b) in ladder.iter().enumerate() {
                assert_eq!(dominates(a, b), i < j, "{a:?} over {b:?}");
            }
        }
        assert!(
            !dominates(&void, &Fitness::Unfit(Unfit::Timeout)) && !dominates(&Fitness::Unfit(Unfit::Timeout), &void)
        );
    }

    proptest! {
        #[test]
        fn dominance_is_a_strict_partial_order(
            (a, b, c) in (1usize..4).prop_flat_map(|n| (any_fitness(n), any_fitness(n), any_fitness(n))),
        ) {
            prop_assert!(!dominates(&a, &a));
            prop_assert!(!(dominates(&a, &b) && dominates(&b, &a)));
            prop_assert!(!(dominates(&a, &b) && dominates(&b, &c)) || dominates(&a, &c));
        }
    }
}
