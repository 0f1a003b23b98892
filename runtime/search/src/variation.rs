//! Variations of a test along one dimension of the reduced space: the same operations, stronger or milder, later or
//! earlier, longer or shorter. They show where a reality gap begins and ends [SESAME 2023, Section 4.6].

use sesame_plan::{Activation, CampaignPlan, Choice, ChoiceKind, Copies, Dimension, Domain, Parameter, Span, Test};

use crate::sspr::{Convention, Point, disturbance, planned};

/// The shortest window that a variation has, in seconds.
const SHORTEST: f64 = 0.01;

/// Halvings of the stretch in which a coordinate is looked for: more than a number has digits.
const HALVINGS: u32 = 60;

/// Why a test cannot be varied.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum VaryError {
    /// Only a run shows this coordinate, or operations would have to be added or taken away.
    #[error("tests are varied along {}, not along {asked}", if *by_time { "T1, T2 and P1" } else { "P1, since conditions decide when their operations act" })]
    Dimension {
        /// The dimension.
        asked: &'static str,
        /// Whether the operations of the test have windows.
        by_time: bool,
    },
    /// It has no room along this dimension.
    #[error("{0} of this test cannot be anything else")]
    Fixed(&'static str),
}

/// How far a test can be varied along a dimension: the least and the greatest coordinate.
pub fn reach(plan: &CampaignPlan, test: &Test, dimension: Dimension) -> Result<[f64; 2], VaryError> {
    let family = Family::of(plan, test, dimension)?;
    let [low, high] = family.ends.map(|at| family.coordinate(at));
    match (low, high) {
        (Some(low), Some(high)) if high - low > 1e-9 => Ok([low, high]),
        _ => Err(VaryError::Fixed(dimension.name())),
    }
}

/// The test as near to this coordinate as it can be, with the same operations and, apart from what the dimension says,
/// the same choices.
pub fn vary(plan: &CampaignPlan, test: &Test, dimension: Dimension, to: f64) -> Result<Test, VaryError> {
    reach(plan, test, dimension)?;
    let family = Family::of(plan, test, dimension)?;
    let [mut low, mut high] = family.ends;
    for _ in 0..HALVINGS {
        let middle = f64::midpoint(low, high);
        if family.coordinate(middle).is_some_and(|coordinate| coordinate < to) {
            low = middle;
        } else {
            high = middle;
        }
    }
    Ok(family.member(high))
}

/// The coordinate of a test as it is planned; `None` if it has none, or only a run shows it.
pub fn coordinate(plan: &CampaignPlan, test: &Test, dimension: Dimension) -> Option<f64> {
    let disturbances = planned(plan, test).or_else(|| {
        // When conditions switch operations, how strong they are does not depend on when.
        (dimension == Dimension::P1).then(|| {
            let always = |id| plan.operation(id).within;
            let operations = test.operations.iter();
            operations
                .map(|operation| {
                    disturbance(plan, operation.operation, &operation.parameters, vec![always(operation.operation)])
                })
                .collect()
        })
    })?;
    Point::from_disturbances(&disturbances, Convention::Ours)?.get(dimension)
}

/// The variations of a test along a dimension, numbered so that the coordinate rises with the number.
struct Family<'a> {
    plan: &'a CampaignPlan,
    test: &'a Test,
    dimension: Dimension,
    /// The first and the last number.
    ends: [f64; 2],
}

impl<'a> Family<'a> {
    fn of(plan: &'a CampaignPlan, test: &'a Test, dimension: Dimension) -> Result<Self, VaryError> {
        let windows: Vec<(Span, Span)> = test
            .operations
            .iter()
            .filter_map(|operation| match operation.activation {
                Activation::Time { start, end } => {
                    Some((Span { start, end }, plan.operation(operation.operation).within))
                }
                _ => None,
            })
            .collect();
        let by_time = !windows.is_empty();
        let ends = match dimension {
            Dimension::P1 => [-1.0, 1.0],
            // Seconds by which all windows are moved, so that copies stay apart.
            Dimension::T1 if by_time => {
                let earlier = windows.iter().map(|(window, within)| within.start - window.start);
                let later = windows.iter().map(|(window, within)| within.end - window.end);
                [earlier.fold(f64::NEG_INFINITY, f64::max).min(0.0), later.fold(f64::INFINITY, f64::min).max(0.0)]
            }
            // By what the lengths of all windows are multiplied.
            Dimension::T2 if by_time => [0.0, longest(plan, test)],
            _ => return Err(VaryError::Dimension { asked: dimension.name(), by_time }),
        };
        Ok(Family { plan, test, dimension, ends })
    }

    fn member(&self, at: f64) -> Test {
        let mut test = self.test.clone();
        for used in &mut test.operations {
            let operation = self.plan.operation(used.operation);
            match (self.dimension, &mut used.activation) {
                (Dimension::P1, _) => {
                    for (parameter, choice) in operation.parameters.iter().zip(&mut used.parameters) {
                        strengthen(parameter, choice, at);
                    }
                }
                (Dimension::T1, Activation::Time { start, end }) => {
                    let length = *end - *start;
                    *start = (*start + at).max(operation.within.start);
                    *end = (*start + length).min(operation.within.end);
                }
                (Dimension::T2, Activation::Time { start, end }) => {
                    let (middle, length) = (f64::midpoint(*start, *end), *end - *start);
                    let shortest = operation.lengths.map_or(0.0, |lengths| lengths.low).max(SHORTEST).min(length);
                    let half = (length * at).max(shortest) / 2.0;
                    *start = (middle - half).max(operation.within.start);
                    *end = (middle + half).min(operation.within.end);
                }
                _ => {}
            }
        }
        test
    }

    fn coordinate(&self, at: f64) -> Option<f64> {
        coordinate(self.plan, &self.member(at), self.dimension)
    }
}

/// By how much the windows of a test can be lengthened about their middles, so that each stays within what its
/// operation permits, and copies of an operation stay apart where they must not overlap.
fn longest(plan: &CampaignPlan, test: &Test) -> f64 {
    let windows = || {
        test.operations.iter().filter_map(|operation| match operation.activation {
            Activation::Time { start, end } => Some((operation.operation, Span { start, end })),
            _ => None,
        })
    };
    let mut longest = f64::INFINITY;
    for (at, (operation, window)) in windows().enumerate() {
        let middle = f64::midpoint(window.start, window.end);
        let half = window.length() / 2.0;
        if half <= 0.0 {
            continue;
        }
        let declared = plan.operation(operation);
        let room = (middle - declared.within.start).min(declared.within.end - middle);
        longest = longest.min(room / half);
        if let Some(lengths) = declared.lengths {
            longest = longest.min(lengths.high / window.length());
        }
        if plan.campaign.copies == Copies::MayOverlap {
            continue;
        }
        for (_, (_, other)) in windows().enumerate().filter(|(other, (of, _))| *other != at && *of == operation) {
            let apart = (f64::midpoint(other.start, other.end) - middle).abs();
            longest = longest.min(apart / (half + other.length() / 2.0));
        }
    }
    if longest.is_finite() { longest.max(1.0) } else { 1.0 }
}

/// Moves what was chosen for a parameter by this share of what is permitted, as far as that goes.
fn strengthen(parameter: &Parameter, choice: &mut Choice, by: f64) {
    let moved = |value: f64, low: f64, high: f64| (value + by * (high - low)).clamp(low, high);
    match (&parameter.domain, choice) {
        (&Domain::Number { low, high, integer, .. }, Choice::Value { value }) => {
            let to = moved(*value, low, high);
            *value = if integer { libm::round(to) } else { to };
        }
        // For a range, only its width counts.
        (&Domain::Number { low, high, shape: ChoiceKind::Range, integer }, Choice::Range { low: from, high: to }) => {
            let width = ((*to - *from) + by * (high - low)).clamp(0.0, high - low);
            let middle = f64::midpoint(*from, *to).clamp(low + width / 2.0, high - width / 2.0);
            let ends = [(middle - width / 2.0).max(low), (middle + width / 2.0).min(high)];
            [*from, *to] = if integer { ends.map(libm::round) } else { ends };
        }
        (Domain::Point { low, high }, Choice::Point { point }) => {
            for axis in 0..3 {
                point[axis] = moved(point[axis], low[axis], high[axis]);
            }
        }
        _ => {}
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;
    use sesame_plan::OperationKind;
    use sesame_plan::testing::{operation_with, plan, test_of, use_of, value};

    use super::*;

    /// Two operations: one with a value, one with a value and a sub-range.
    fn two() -> CampaignPlan {
        let range = sesame_plan::testing::range("width", -1.0, 3.0);
        plan(vec![
            operation_with("bias", 0, OperationKind::Bias, vec![value("bias", 0.0, 2.0)]),
            operation_with("both", 0, OperationKind::Bias, vec![value("bias", -1.0, 1.0), range]),
        ])
    }

    fn windows(test: &Test) -> Vec<(f64, f64)> {
        test.operations
            .iter()
            .map(|operation| match operation.activation {
                Activation::Time { start, end } => (start, end),
                _ => panic!("the test is by time"),
            })
            .collect()
    }

    fn any_test() -> impl Strategy<Value = Test> {
        let ends = (0.0..4.0f64, 0.05..0.9f64, 5.0..8.0f64, 0.05..1.9f64);
        (ends, 0.0..2.0f64, -1.0..1.0f64, (-1.0..1.0f64, 0.0..2.0f64), 0.0..2.0f64).prop_map(
            |((start, length, later, longer), bias, other, (low, width), again)| {
                test_of(vec![
                    use_of(0, start, start + length, vec![Choice::Value { value: bias }], 1),
                    use_of(0, later, later + longer, vec![Choice::Value { value: again }], 2),
                    use_of(
                        1,
                        start,
                        later,
                        vec![Choice::Value { value: other }, Choice::Range { low, high: low + width }],
                        3,
                    ),
                ])
            },
        )
    }

    proptest! {
        #[test]
        fn a_variation_is_where_it_is_wanted_and_changes_nothing_else(
            test in any_test(), at in 0usize..3, share in -0.2..1.2f64
        ) {
            let plan = two();
            let dimension = [Dimension::P1, Dimension::T1, Dimension::T2][at];
            let [low, high] = reach(&plan, &test, dimension).unwrap();
            let here = coordinate(&plan, &test, dimension).unwrap();
            prop_assert!(low - 1e-9 <= here && here <= high + 1e-9, "{low} {here} {high}");
            let wanted = low + share * (high - low);
            let varied = vary(&plan, &test, dimension, wanted).unwrap();
            let found = coordinate(&plan, &varied, dimension).unwrap();
            prop_assert!((found - wanted.clamp(low, high)).abs() < 1e-9, "{found} instead of {wanted}");
            plan.validate_test(&varied).unwrap();
            let choices = |test: &Test| test.operations.iter().map(|operation| operation.parameters.clone()).collect::<Vec<_>>();
            prop_assert_eq!(choices(&varied) == choices(&test), dimension != Dimension::P1 || varied == test);
            let seeds = |test: &Test| test.operations.iter().map(|operation| operation.operation_seed).collect::<Vec<_>>();
            prop_assert_eq!(seeds(&varied), seeds(&test));
            let (before, after) = (windows(&test), windows(&varied));
            for (was, is) in before.iter().zip(&after) {
                prop_assert!(0.0 <= is.0 && is.0 < is.1 && is.1 <= 10.0, "{is:?}");
                let (length, now) = (was.1 - was.0, is.1 - is.0);
                let (middle, moved) = (f64::midpoint(was.0, was.1), f64::midpoint(is.0, is.1));
                match dimension {
                    Dimension::T1 => prop_assert!((length - now).abs() < 1e-9),
                    Dimension::T2 => prop_assert!((middle - moved).abs() < 1e-6),
                    _ => prop_assert_eq!(was, is),
                }
            }
            // Copies of the first operation stay apart.
            prop_assert!(after[0].1 <= after[1].0 + 1e-9, "{after:?}");
        }
    }

    #[test]
    fn what_cannot_be_varied_is_refused() {
        let plan = two();
        let test = test_of(vec![use_of(0, 0.0, 10.0, vec![Choice::Value { value: 1.0 }], 1)]);
        assert_eq!(reach(&plan, &test, Dimension::P1), Ok([0.0, 1.0]));
        assert_eq!(vary(&plan, &test, Dimension::T1, 0.2), Err(VaryError::Fixed("T1")));
        let error = reach(&plan, &test, Dimension::O0).unwrap_err();
        assert_eq!(error.to_string(), "tests are varied along T1, T2 and P1, not along O0");
    }
}
