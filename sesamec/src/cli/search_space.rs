//! What a campaign's tests can be, and what it costs to run them: the part of `sesamec explain` that needs the search.

use std::fmt::Write as _;

use sesame_notation::Unit;
use sesame_plan::condition::{Comparison, ConditionEnd, ConditionSpace, Variable};
use sesame_plan::{CampaignPlan, ChoiceKind, Confirmation, Copies, Dimension};
use sesame_search::coverage::{Feasible, Grid};
use sesame_search::space::ParameterSpace;
use sesame_search::space::TestSpace;
use sesame_search::space::{ActivationSpace, OperationSpace};
use sesame_search::sspr::extent;
use sesame_search::strategy;

/// A number that may be anything in a range counts as so many values.
const STEPS: f64 = 100.0;
/// Reference runs of a campaign, one before and one after its tests.
const REFERENCE_RUNS: u64 = 2;

/// The space that a campaign searches, and its cost in simulated time, as comments of a `.sesame` file.
pub(super) fn described(plan: &CampaignPlan) -> String {
    let mut lines = Vec::new();
    if plan.campaign.search.strategy().is_some() {
        match TestSpace::from_plan(plan) {
            Ok(test_space) => {
                space(plan, &test_space, &mut lines);
                let counted = strategy(plan, plan.campaign.seed).ok().and_then(|search| search.tests());
                lines.extend(counted.map(|tests| (plan.campaign.search.keyword(), counted_tests(tests))));
            }
            Err(error) => lines.push(("tests", error.to_string())),
        }
    }
    let runs = u64::from(plan.campaign.search.evaluations()) + REFERENCE_RUNS;
    let end = plan.campaign.end_after;
    lines.push((
        "cost",
        format!(
            "at most {runs} runs of {end} s, {REFERENCE_RUNS} of them reference runs: {} of simulated time",
            duration(runs as f64 * end)
        ),
    ));
    if let Some(confirmation) = plan.campaign.confirm {
        let tests = plan.campaign.search.evaluations();
        lines.push(("confirming", confirming(confirmation, tests, plan.campaign.objectives.len())));
    }
    let mut out = String::new();
    for (name, line) in lines {
        writeln!(out, "// {name:<15} {line}").expect("a string takes all text");
    }
    out
}

fn space(plan: &CampaignPlan, permitted: &TestSpace, lines: &mut Vec<(&str, String)>) {
    let kinds = permitted.operations();
    let (fewest, most) = (permitted.fewest(), permitted.most());
    let copies: Vec<usize> = kinds.iter().map(|kind| permitted.most_copies(kind)).collect();
    let ways = total(&chosen(&vec![0.0; kinds.len()], &copies, most)[fewest..]);
    let count = if fewest == most { format!("{fewest}") } else { format!("{fewest} to {most}") };
    let apart = match plan.campaign.copies {
        Copies::Apart => "; copies of one are never active at the same time",
        Copies::MayOverlap => "; copies of one may be active at the same time",
        Copies::Once => ", each at most once",
    };
    let ways = format!("{} ways to choose them", power(ways));
    lines.push(("operations", format!("{count} per test, of {}: {ways}{apart}", kinds.len())));
    let numbers: Vec<usize> = kinds.iter().map(numbers).collect();
    let per_operation = match (numbers.iter().min(), numbers.iter().max()) {
        (Some(least), Some(greatest)) if least < greatest => format!("{least} to {greatest}"),
        (Some(least), _) => format!("{least}"),
        (None, _) => "0".to_owned(),
    };
    let chosen_by_each = if permitted.conditions().is_some() { "numbers and conditions" } else { "numbers" };
    lines.push(("choices", format!("{per_operation} {chosen_by_each} per operation, and a seed for its draws")));
    let sizes: Vec<f64> = kinds.iter().map(size).collect();
    let size = total(&chosen(&sizes, &copies, most)[fewest..]);
    // Windows that have to lie apart are fewer than all; how many is not counted.
    let bound =
        if permitted.copies() == Copies::Apart && copies.iter().any(|&copies| copies > 1) { "at most " } else { "" };
    lines.push(("size", format!("{bound}{} tests, seeds left out, with numbers in steps of 1 %", power(size))));

    let extents = Dimension::ALL.iter().filter_map(|&dimension| {
        let (low, high) = extent(plan, permitted, dimension)?;
        Some(format!("{} {}", dimension.name(), Unit::None.range(rounded(low), rounded(high))))
    });
    let extents: Vec<String> = extents.collect();
    lines.push(("reduced (SSPR)", extents.join("  ")));
    let goal = plan.campaign.coverage.as_ref();
    if let Some(grid) = goal.and_then(|goal| Grid::new(goal.axes.clone()).ok()) {
        let feasible = Feasible::from_plan(plan, &grid);
        let known = if feasible.is_exact() { "" } else { ", as far as known" };
        lines.push(("cells", format!("{} of {} can be reached{known}", feasible.count(), grid.len())));
    }
}

/// How many tests a search can choose from.
fn counted_tests(tests: u128) -> String {
    if tests == u128::MAX { "more than 10^38 tests".to_owned() } else { format!("{tests} tests") }
}

/// How many runs it may take to confirm what a search of so many tests finds.
fn confirming(confirmation: Confirmation, tests: u32, objectives: usize) -> String {
    let times = confirmation.times;
    let most = f64::from(tests) * f64::from(times);
    let likely = (entering(tests, objectives) * f64::from(times)).round();
    let or = if confirmation.violations { " or violates a requirement" } else { "" };
    format!(
        "at most {most} more runs, {times} for each test that enters the front{or}: about {likely} for the front if tests \
         were drawn independently, more where a search improves"
    )
}

/// How many tests can be expected to enter a front as they come, of so many whose values of so many objectives are
/// independent of each other and of the other tests'.
///
/// E(n, m) of n such tests with m objectives are expected to be on the front: E(n, 1) = 1, and E(n, m) is the sum of
/// E(i, m − 1) / i over i up to n (Bentley et al. 1978). The nth is as likely on it as each other, so E(n, m) / n is
/// the probability that it enters, and the sum of these is E(n, m + 1).
fn entering(tests: u32, objectives: usize) -> f64 {
    let mut expected = vec![1.0; tests as usize];
    for _ in 0..objectives {
        let mut sum = 0.0;
        for (at, value) in expected.iter_mut().enumerate() {
            sum += *value / (at + 1) as f64;
            *value = sum;
        }
    }
    expected.last().copied().unwrap_or_default()
}

/// How many numbers, points' coordinates, texts and conditions a test chooses for an operation.
fn numbers(operation: &OperationSpace) -> usize {
    let activation = match operation.activation {
        ActivationSpace::Offline => 0,
        ActivationSpace::Time(_) | ActivationSpace::Condition { .. } => 2,
    };
    let parameters = operation.parameters.iter().map(|parameter| match parameter {
        ParameterSpace::Number(_, ChoiceKind::Range) => 2,
        ParameterSpace::Number(_, ChoiceKind::Value) | ParameterSpace::Items(_) => 1,
        ParameterSpace::Point(_) => 3,
    });
    activation + parameters.sum::<usize>()
}

/// The decimal logarithm of the number of ways to choose all of an operation.
fn size(operation: &OperationSpace) -> f64 {
    // Two ordered ends in so many steps.
    let pair = |steps: f64| (steps * (steps + 1.0) / 2.0).log10();
    let activation = match &operation.activation {
        ActivationSpace::Offline => 0.0,
        // Windows of bounded lengths have a beginning and a length.
        ActivationSpace::Time(range) if range.longest.is_finite() => {
            let several = |width: f64| if width > 0.0 { STEPS.log10() } else { 0.0 };
            several(range.high - range.low - range.longest) + several(range.longest - range.shortest)
        }
        ActivationSpace::Time(_) => pair(STEPS),
        ActivationSpace::Condition { space, .. } => {
            let end = match space.end {
                ConditionEnd::Condition => conditions(space),
                ConditionEnd::Length { low, high } => {
                    if low < high {
                        STEPS.log10()
                    } else {
                        0.0
                    }
                }
            };
            conditions(space) + end
        }
    };
    let parameters = operation.parameters.iter().map(|parameter| match parameter {
        ParameterSpace::Number(range, shape) => {
            let steps = match (range.integer, range.high - range.low) {
                (_, width) if width <= 0.0 => 1.0,
                (true, width) => (width + 1.0).min(STEPS),
                (false, _) => STEPS,
            };
            match shape {
                ChoiceKind::Value => steps.log10(),
                ChoiceKind::Range => pair(steps),
            }
        }
        ParameterSpace::Point(axes) => axes.iter().filter(|axis| axis.low < axis.high).count() as f64 * STEPS.log10(),
        ParameterSpace::Items(items) => (items.len() as f64).log10(),
    });
    activation + parameters.sum::<f64>()
}

/// The decimal logarithm of the number of condition trees of a grammar, constant ones among them.
fn conditions(space: &ConditionSpace) -> f64 {
    let signs = [Comparison::Below, Comparison::Above, Comparison::Equal].len() as f64;
    let variables = space.variables.len() as f64;
    let integers = space.integers.highest as f64 - space.integers.lowest as f64 + 1.0;
    let numbers = |variable: &Variable| match (variable.step, variable.low, variable.high) {
        (Some(step), Some(low), Some(high)) => ((high - low) / step).floor() + 1.0,
        _ => integers,
    };
    let numbers = space.variables.iter().map(numbers).sum::<f64>();
    let comparisons = (signs * (variables * (variables - 1.0) + numbers)).log10();
    (1..space.depth).fold(comparisons, |smaller, _| total(&[comparisons, 2f64.log10() + 2.0 * smaller]))
}

/// Per number of operations, from none to `most`, the decimal logarithm of the number of ways to choose them, of kinds
/// each of which has so many variants (a logarithm too). Their order does not matter, and each kind may come as often
/// as `copies` says.
fn chosen(kinds: &[f64], copies: &[usize], most: usize) -> Vec<f64> {
    let mut ways = vec![f64::NEG_INFINITY; most + 1];
    ways[0] = 0.0;
    for (size, &copies) in kinds.iter().zip(copies) {
        ways = (0..=most)
            .map(|count| {
                let with = (0..=count.min(copies)).map(|of_this| ways[count - of_this] + of_this as f64 * size);
                total(&with.collect::<Vec<_>>())
            })
            .collect();
    }
    ways
}

/// The logarithm of the sum of numbers given by their logarithms.
fn total(logarithms: &[f64]) -> f64 {
    let greatest = logarithms.iter().copied().fold(f64::NEG_INFINITY, f64::max);
    if greatest == f64::NEG_INFINITY {
        return greatest;
    }
    greatest + logarithms.iter().map(|logarithm| 10f64.powf(logarithm - greatest)).sum::<f64>().log10()
}

/// A number given by its logarithm: whole as far as people count, then as a power of ten.
fn power(logarithm: f64) -> String {
    if logarithm < 6.0 { format!("{:.0}", 10f64.powf(logarithm)) } else { format!("about 10^{logarithm:.0}") }
}

fn rounded(value: f64) -> f64 {
    (value * 1e3).round() / 1e3
}

/// A length of time in the units that people use for it.
fn duration(seconds: f64) -> String {
    let (hours, rest) = ((seconds / 3600.0).floor(), seconds % 3600.0);
    let (minutes, seconds) = ((rest / 60.0).floor(), (rest % 60.0 * 10.0).round() / 10.0);
    match (hours > 0.0, minutes > 0.0) {
        (true, _) => format!("{hours} h {minutes} min"),
        (false, true) => format!("{minutes} min {seconds} s"),
        (false, false) => format!("{seconds} s"),
    }
}

#[cfg(test)]
mod tests {
    use sesame_codegen::lower::lower;
    use sesame_dsl::analyse;
    use sesame_dsl::source::SourceMap;

    use super::*;

    const CELL: &str = r#"
        space cell
        system {
          simulator sim = in_process "cell_sim::Cell" { crate "simulator"  step 20ms }
          topic link0 = "joints/link0" : real[rad]
        }
        metric time minimise = fuzzing_time()
        operation shake on link0 = random offset [-0.3rad, 0.3rad] within [0s, 65s]
        campaign systematic { objectives time  operations shake 1 per test
                              search grid { levels 4  evaluations 100 }  end after 70s }
        campaign larger from systematic { operations shake 1..3 per test }
        campaign huge from systematic { operations shake 60 per test  search grid { levels 64  evaluations 100 } }
        campaign drawn from systematic { search sobol { evaluations 100 } }
    "#;

    #[test]
    fn of_a_grid_it_is_said_how_many_tests_there_are() {
        let mut sources = SourceMap::new();
        let file = sources.add("cell.sesame", CELL);
        let space = analyse(&sources, file).model.unwrap();
        let grid = |campaign: &str| {
            let plan = lower(&space, space.campaign(campaign).unwrap(), "cell.sesame", "sesamec 0.0.0").plan;
            described(&plan).lines().find(|line| line.starts_with("// grid ")).map(str::to_owned)
        };
        assert_eq!(grid("systematic").unwrap(), "// grid            60 tests");
        assert_eq!(grid("larger").unwrap(), "// grid            1560 tests");
        assert_eq!(grid("huge").unwrap(), "// grid            more than 10^38 tests");
        assert_eq!(grid("drawn"), None);
    }

    #[test]
    fn ways_to_choose_are_multisets() {
        // Two kinds have 2, 3, 4, 5 and 6 multisets of 1 to 5.
        let ways: Vec<f64> =
            chosen(&[0.0, 0.0], &[9, 9], 5).iter().map(|logarithm| 10f64.powf(*logarithm).round()).collect();
        assert_eq!(ways, [1.0, 2.0, 3.0, 4.0, 5.0, 6.0]);
        assert_eq!(power(total(&chosen(&[0.0, 0.0], &[9, 9], 5)[1..])), "20");
        // Ten and a hundred variants: two of them are 100, 1000 or 10000.
        assert!((10f64.powf(chosen(&[1.0, 2.0], &[9, 9], 2)[2]) - 11_100.0).abs() < 1e-6);
        // Each at most once: both or one of them, or none.
        let once: Vec<f64> =
            chosen(&[0.0, 0.0], &[1, 1], 3).iter().map(|logarithm| 10f64.powf(*logarithm).round()).collect();
        assert_eq!(once, [1.0, 2.0, 1.0, 0.0]);
    }

    /// The nth of n tests is the best so far with a probability of 1/n; with two objectives, by hand: 1, 3/4 and 11/18.
    #[test]
    fn tests_that_enter_a_front_are_as_many_as_there_are_records() {
        assert!((entering(4, 1) - (1.0 + 1.0 / 2.0 + 1.0 / 3.0 + 1.0 / 4.0)).abs() < 1e-12);
        assert!((entering(3, 2) - (1.0 + 3.0 / 4.0 + 11.0 / 18.0)).abs() < 1e-12);
        assert!(entering(0, 2).abs() < 1e-12);
    }

    #[test]
    fn the_cost_of_confirming_says_what_is_confirmed() {
        let confirmation = Confirmation { times: 4, by: sesame_plan::Statistic::Mean, violations: true };
        let said = confirming(confirmation, 60, 2);
        assert!(
            said.starts_with(
                "at most 240 more runs, 4 for each test that enters the front or violates a requirement: "
            )
        );
        let front_only = confirming(Confirmation { violations: false, ..confirmation }, 60, 2);
        assert_eq!(front_only, said.replace(" or violates a requirement", ""));
    }

    #[test]
    fn long_times_are_told_in_hours() {
        assert_eq!(duration(14_840.0), "4 h 7 min");
        assert_eq!(duration(212.0), "3 min 32 s");
        assert_eq!(duration(7.25), "7.3 s");
    }
}
