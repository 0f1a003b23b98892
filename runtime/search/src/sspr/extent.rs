//! Between what a campaign's tests lie in the reduced parameter space.

use sesame_plan::{ActivationMode, CampaignPlan, ChoiceKind, Dimension};

use crate::space::parameter_space::ParameterSpace;
use crate::space::test_space::{OperationSpace, TestSpace};
use crate::sspr::{Class, Window};

/// The least and the greatest value of a dimension over all tests that a campaign permits; `None` where no test has
/// one.
///
/// These are the ends of each dimension alone: not every combination of them can be had, which is what
/// [`Feasible`](crate::coverage::Feasible) tells. Where conditions switch operations, any times inside their windows
/// count as possible.
pub fn extent(plan: &CampaignPlan, test_space: &TestSpace, dimension: Dimension) -> Option<(f64, f64)> {
    let timed: Vec<Timing> =
        test_space.operations().iter().filter_map(|operation| Timing::of(plan, operation)).collect();
    if timed.is_empty() {
        return None;
    }
    let by_condition = matches!(plan.campaign.activation, ActivationMode::Condition { .. });
    let offline = timed.len() < test_space.operations().len();
    let (fewest, most) = (test_space.fewest(), test_space.most());
    // One that acts outside the run, or whose conditions never hold, counts in no dimension.
    let fewest = if offline || by_condition { 1 } else { fewest };
    let least = |of: fn(&Timing) -> f64| timed.iter().map(of).fold(f64::INFINITY, f64::min);
    let greatest = |of: fn(&Timing) -> f64| timed.iter().map(of).fold(f64::NEG_INFINITY, f64::max);
    let midpoints = (
        least(|timing| timing.window.start + timing.window.shortest / 2.0),
        greatest(|timing| timing.window.end - timing.window.shortest / 2.0),
    );
    let several = most > 1 || by_condition;
    match dimension {
        Dimension::T1 => Some(midpoints),
        Dimension::T2 => {
            Some((least(|timing| timing.window.shortest), greatest(|timing| timing.window.greatest_length())))
        }
        Dimension::T3 => Some((0.0, if several { (midpoints.1 - midpoints.0) / 2.0 } else { 0.0 })),
        Dimension::P1 => shares(plan, test_space).into_iter().reduce(|a, b| (a.0.min(b.0), a.1.max(b.1))),
        Dimension::P2 => {
            let all = shares(plan, test_space);
            let (low, high) = all.iter().copied().reduce(|a, b| (a.0.min(b.0), a.1.max(b.1)))?;
            let several = most > 1 || timed.iter().any(|timing| timing.numbers > 1);
            Some((0.0, if several { (high - low) / 2.0 } else { 0.0 }))
        }
        Dimension::O0 => Some((fewest as f64, most as f64)),
        Dimension::O1 => Some(counted(&timed, Class::Value, fewest, most)),
        Dimension::O2 => Some(counted(&timed, Class::Loss, fewest, most)),
        Dimension::O3 => Some(counted(&timed, Class::Delay, fewest, most)),
    }
}

/// An operation that is active during the run: its window, its class, and how many numbers it has that count.
struct Timing {
    window: Window,
    class: Class,
    numbers: usize,
}

impl Timing {
    fn of(plan: &CampaignPlan, operation: &OperationSpace) -> Option<Timing> {
        let window = Window::of(plan, operation)?;
        let numbers = operation.parameters.iter().map(|parameter| shares_of(parameter).len()).sum();
        Some(Timing { window, class: plan.operation(operation.operation).kind.class(), numbers })
    }
}

/// Between what each number of the operations lies that are active during the run, as a share of what is permitted.
fn shares(plan: &CampaignPlan, test_space: &TestSpace) -> Vec<(f64, f64)> {
    let active =
        test_space.operations().iter().filter(|operation| !plan.operation(operation.operation).kind.is_offline());
    active.flat_map(|operation| operation.parameters.iter().flat_map(shares_of)).collect()
}

fn shares_of(parameter: &ParameterSpace) -> Vec<(f64, f64)> {
    match parameter {
        ParameterSpace::Number(range, ChoiceKind::Value | ChoiceKind::Range) if range.low < range.high => {
            vec![(0.0, 1.0)]
        }
        ParameterSpace::Point(axes) => axes.iter().filter(|axis| axis.low < axis.high).map(|_| (0.0, 1.0)).collect(),
        ParameterSpace::Number(..) | ParameterSpace::Items(_) => Vec::new(),
    }
}

/// How many operations of a class a test can have.
fn counted(timed: &[Timing], class: Class, fewest: usize, most: usize) -> (f64, f64) {
    let of_class = timed.iter().filter(|timing| timing.class == class).count();
    let least = if of_class == timed.len() { fewest } else { 0 };
    let greatest = if of_class > 0 { most } else { 0 };
    (least as f64, greatest as f64)
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use sesame_rng::Stream;

    use super::*;
    use crate::space::initial::fresh_test;
    use crate::space::test_space::tests::any_timed_plan;
    use crate::sspr::{Convention, Point, planned};

    proptest! {
        #[test]
        fn every_test_lies_inside(plan in any_timed_plan(), seed: u64) {
            let test_space = TestSpace::from_plan(&plan).unwrap();
            for n in 0..60 {
                let test = fresh_test(&test_space, &mut Stream::derive(seed, "test", &[n]));
                let Some(point) = Point::from_disturbances(&planned(&plan, &test).unwrap(), Convention::Ours) else { continue };
                for dimension in Dimension::ALL {
                    let Some(value) = point.get(dimension) else { continue };
                    let (low, high) = extent(&plan, &test_space, dimension).unwrap();
                    prop_assert!(low - 1e-9 <= value && value <= high + 1e-9, "{dimension:?}: {value} in {low}..{high}");
                }
            }
        }
    }

    #[test]
    fn the_cells_of_the_papers_table_have_the_ends_that_table_gives_them() {
        let plan = crate::testing::synthetic_robots::SYNTHETIC_ROBOTS[0]
            .plan(sesame_plan::Search::new(sesame_plan::Strategy::Random, 1));
        let test_space = TestSpace::from_plan(&plan).unwrap();
        let of = |dimension| extent(&plan, &test_space, dimension).unwrap();
        assert_eq!(of(Dimension::P1), (0.0, 1.0));
        assert_eq!(of(Dimension::P2), (0.0, 0.5));
        assert_eq!(of(Dimension::O0), (1.0, 5.0));
        let (t1, t3) = (of(Dimension::T1), of(Dimension::T3));
        assert!(t1.0 < 0.001 && t1.1 > 0.999 && (t3.1 - 0.5).abs() < 0.001, "{t1:?} {t3:?}");
    }
}
