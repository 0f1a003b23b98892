use std::collections::BTreeSet;

use proptest::prelude::*;

use sesame_base::observation::Outcome;
use sesame_plan::OperationId;
use sesame_present::table::TextOptions;
use sesame_record::{TestRow, sample};

use super::*;
use crate::regions::feature::Part;
use crate::regions::tree::simplest_between;

/// Rows of a tree's node: those for which each question of the path is answered so.
fn rows_of(columns: &Columns, path: &[Step], rows: usize) -> Vec<usize> {
    let is_in = |&row: &usize| {
        path.iter().all(|step| {
            let number = columns.values[step.question.column][row];
            let answer = !number.is_nan() && {
                let at = step.question.threshold;
                if step.question.at_most { number <= at } else { number > at }
            };
            answer == step.holds
        })
    };
    (0..rows).filter(is_in).collect()
}

/// The least impurity that one question can leave of some rows: every question is asked of every row.
fn least_impurity(columns: &Columns, rows: &[usize], labels: &[Option<bool>], least: usize) -> f64 {
    let impurity = |rows: &[usize]| {
        let n = rows.len() as f64;
        let k = rows.iter().filter(|&&row| labels[row] == Some(true)).count() as f64;
        if rows.is_empty() { 0.0 } else { k * (n - k) / n }
    };
    let mut lowest = impurity(rows);
    for column in &columns.values {
        for &at in rows {
            for at_most in [true, false] {
                let holds = |&row: &usize| if at_most { column[row] <= column[at] } else { column[row] > column[at] };
                let (yes, no): (Vec<usize>, Vec<usize>) = rows.iter().copied().partition(holds);
                // A question that splits off exactly the rows without a number is none that lies between two numbers.
                let numbers = rows.iter().filter(|&&row| !column[row].is_nan()).count();
                if yes.len() >= least && no.len() >= least && yes.len() < numbers {
                    lowest = lowest.min(impurity(&yes) + impurity(&no));
                }
            }
        }
    }
    lowest
}

proptest! {
    /// The oracle draws a side of the tests in every way there is.
    #[test]
    fn chance_is_the_share_of_all_ways_to_divide(labels in prop::collection::vec(any::<bool>(), 2..12), side in 1usize..11) {
        prop_assume!(side < labels.len());
        let failing = |of: u32| labels.iter().enumerate().filter(|(at, fails)| **fails && of >> at & 1 == 1).count();
        let all = Tally { tests: labels.len(), failing: failing(u32::MAX) };
        let ways: Vec<u32> = (0..1u32 << labels.len()).filter(|of| of.count_ones() as usize == side).collect();
        for observed in 0..=side {
            let other = side - observed;
            if observed > all.failing || other > all.tests - all.failing {
                continue;
            }
            let more = observed as f64 >= all.failing as f64 * side as f64 / all.tests as f64;
            let as_uneven = ways.iter().filter(|&&of| if more { failing(of) >= observed } else { failing(of) <= observed });
            let expected = (2.0 * as_uneven.count() as f64 / ways.len() as f64).min(1.0);
            let found = super::tree::chance(all, Tally { tests: side, failing: observed });
            prop_assert!((found - expected).abs() < 1e-9, "{found} and {expected}");
        }
    }
}

fn growth(depth: u32, least: usize) -> Growth {
    Growth { depth, least }
}

proptest! {
    #[test]
    fn the_first_question_is_the_best_of_all(
        table in prop::collection::vec((prop::option::of(0i32..8), 0i32..5, prop::option::of(0i32..3), any::<bool>()), 2..40),
        least in 1usize..4,
    ) {
        let number = |value: Option<i32>| value.map_or(f64::NAN, |value| f64::from(value) * 0.37);
        let columns = Columns::new(vec![
            table.iter().map(|row| number(row.0)).collect(),
            table.iter().map(|row| number(Some(row.1))).collect(),
            table.iter().map(|row| number(row.2)).collect(),
        ]);
        let labels: Vec<Option<bool>> = table.iter().map(|row| Some(row.3)).collect();
        let all: Vec<usize> = (0..table.len()).collect();
        let naive = least_impurity(&columns, &all, &labels, least);
        let found = columns.whole_tree(&labels, growth(1, least));
        let tally = |node: &TreeNode| (node.tally.tests as f64, node.tally.failing as f64);
        let impurity = |(n, k): (f64, f64)| k * (n - k) / n;
        let left = match &found.split {
            Some(split) => impurity(tally(&split.holds)) + impurity(tally(&split.fails)),
            None => impurity(tally(&found)),
        };
        prop_assert!((left - naive).abs() < 1e-9, "{left} and {naive}");
    }

    #[test]
    fn every_row_is_in_one_leaf_and_each_leaf_counts_its_rows(
        table in prop::collection::vec((prop::option::of(0i32..9), 0i32..9, prop::option::of(any::<bool>())), 2..120),
        depth in 0u32..5, least in 1usize..6,
    ) {
        let columns = Columns::new(vec![
            table.iter().map(|row| row.0.map_or(f64::NAN, f64::from)).collect(),
            table.iter().map(|row| f64::from(row.1)).collect(),
        ]);
        let labels: Vec<Option<bool>> = table.iter().map(|row| row.2).collect();
        for tree in [columns.whole_tree(&labels, growth(depth, least)), columns.tree(&labels, growth(depth, least))] {
            let mut counted = Tally::default();
            leaves(&tree, &mut Vec::new(), &mut |path, tally| {
                for path in [path.to_vec(), simplified(path)] {
                    let rows = rows_of(&columns, &path, table.len());
                    let rows: Vec<bool> = rows.into_iter().filter_map(|row| labels[row]).collect();
                    let failing = rows.iter().filter(|&&fails| fails).count();
                    assert_eq!(tally, Tally { tests: rows.len(), failing });
                }
                assert!(path.len() <= depth as usize && (path.is_empty() || tally.tests >= least));
                counted.tests += tally.tests;
                counted.failing += tally.failing;
            });
            prop_assert_eq!(counted, tree.tally);
        }
    }

    #[test]
    fn a_threshold_lies_where_it_should_and_is_short(low in -1e3..1e3f64, more in 1e-9..10.0f64) {
        let high = low + more;
        let between = simplest_between(low, high);
        prop_assert!(low <= between && between < high);
        let decimals = |x: f64| format!("{x}").split_once('.').map_or(0, |(_, decimals)| decimals.len());
        prop_assert!(decimals(between) <= decimals(low).max(1) && (more < 1.0 || decimals(between) == 0));
    }
}

#[test]
fn what_was_planted_is_found_and_nothing_else() {
    let mut stream = sesame_rng::Stream::derive(7, "test", &[]);
    let mut random = |n: usize| (0..n).map(|_| stream.unit()).collect::<Vec<f64>>();
    let n = 400;
    let (a, b, c) = (random(n), random(n), random(n));
    let planted: Vec<Option<bool>> = a.iter().zip(&b).map(|(a, b)| Some(*a <= 0.31 && *b > 0.62)).collect();
    let columns = Columns::new(vec![c, a, b]);
    let tree = columns.tree(&planted, growth(3, 5));
    let mut failing = Vec::new();
    leaves(&tree, &mut Vec::new(), &mut |path, tally| {
        if tally.failing > 0 {
            failing.push((simplified(path), tally));
        }
    });
    let [(path, tally)] = failing.as_slice() else { panic!("{failing:?}") };
    assert_eq!(tally.failing, tally.tests);
    let mut thresholds: Vec<(usize, f64)> =
        path.iter().map(|step| (step.question.column, step.question.threshold)).collect();
    thresholds.sort_by_key(|(column, _)| *column);
    assert!((thresholds[0].1 - 0.31).abs() < 0.02 && (thresholds[1].1 - 0.62).abs() < 0.02, "{thresholds:?}");
}

#[test]
fn chance_is_no_region() {
    let mut found = 0;
    for seed in 0..60 {
        let mut stream = sesame_rng::Stream::derive(seed, "test", &[]);
        let columns = Columns::new((0..6).map(|_| (0..150).map(|_| stream.unit()).collect()).collect());
        let noise: Vec<Option<bool>> = (0..150).map(|_| Some(stream.chance(0.3))).collect();
        found += usize::from(columns.tree(&noise, growth(1, 5)).split.is_some());
    }
    assert!(found <= 3, "one in twenty at most: {found} of 60");
}

fn repository() -> (tempfile::TempDir, Repository) {
    let folder = tempfile::tempdir().unwrap();
    let repository = sample::campaign(folder.path(), &sample::plan(), 300);
    (folder, repository)
}

/// The numbers of a test as they are read off its record.
fn naive_number(repository: &Repository, number: u32, feature: Feature) -> Option<f64> {
    let plan = repository.plan();
    let record = repository.test(number).unwrap();
    let point = sesame_search::sspr::observed_point(plan, &record.test, &record.observation);
    let windows = |id: OperationId| -> Vec<(f64, f64)> {
        let of = record.test.operations.iter().filter(|used| used.operation == id);
        of.map(|used| match used.activation {
            sesame_plan::Activation::Time { start, end } => (start, end),
            _ => panic!("windows of time"),
        })
        .collect()
    };
    let mean = |numbers: Vec<f64>| (!numbers.is_empty()).then(|| numbers.iter().sum::<f64>() / numbers.len() as f64);
    match feature {
        Feature::Dimension(dimension) => point.and_then(|point| point.get(dimension)),
        Feature::Count(id) => Some(windows(id).len() as f64),
        Feature::Start(id) => mean(windows(id).iter().map(|window| window.0).collect()),
        Feature::Length(id) => mean(windows(id).iter().map(|window| window.1 - window.0).collect()),
        Feature::Share(id) => {
            let of = record.test.operations.iter().filter(|used| used.operation == id);
            mean(
                of.map(|used| match used.parameters[0] {
                    sesame_plan::Choice::Range { low, high } => (high - low) / 0.6,
                    sesame_plan::Choice::Value { value } => value,
                    _ => panic!("numbers"),
                })
                .collect(),
            )
        }
        Feature::Parameter(id, at, part) => {
            let of = record.test.operations.iter().filter(|used| used.operation == id);
            mean(
                of.map(|used| match (&used.parameters[at], part) {
                    (sesame_plan::Choice::Range { low, high }, Part::Middle) => (low + high) / 2.0,
                    (sesame_plan::Choice::Range { low, high }, Part::Width) => high - low,
                    (sesame_plan::Choice::Value { value }, Part::Value) => *value,
                    _ => panic!("numbers"),
                })
                .collect(),
            )
        }
    }
}

/// Counts the tests of each rule anew: a label says whether a test fails, `None` for one that does not count.
fn assert_counted(repository: &Repository, regions: &Regions, label: impl Fn(&TestRow) -> Option<bool>) {
    let rows = repository.tests().unwrap();
    let mut seen = 0;
    for rule in &regions.rules {
        let mut tally = Tally::default();
        for row in rows.iter().filter(|row| row.origin != Origin::Reference && row.duplicate_of.is_none()) {
            let here = rule.path.iter().all(|step| {
                let number = naive_number(repository, row.number, regions.plan_features[step.question.column]);
                let answer = number.is_some_and(|number| {
                    if step.question.at_most {
                        number <= step.question.threshold + 1e-12
                    } else {
                        number > step.question.threshold + 1e-12
                    }
                });
                answer == step.holds
            });
            if let Some(fails) = label(row).filter(|_| here) {
                tally.tests += 1;
                tally.failing += usize::from(fails);
            }
        }
        assert_eq!(rule.tally, tally, "{}: {}", regions.title(), rule.sentence());
        seen += tally.tests;
    }
    assert_eq!(seen, regions.all.tests);
    assert!(regions.rules[0].tally.share() >= regions.rules.last().unwrap().tally.share());
}

#[test]
fn the_counts_of_each_rule_are_those_of_the_tests_that_it_describes() {
    let (_folder, repository) = repository();
    let found = regions(&repository, &Selection::default(), None, 3).unwrap();
    let targets: Vec<&str> = found.iter().map(|regions| regions.target.as_str()).collect();
    assert_eq!(targets, ["R1", "R2", "R3", "R4", "crash", "timeout"]);
    for regions in &found {
        assert_counted(&repository, regions, |row| match regions.target.as_str() {
            "crash" => Some(matches!(row.outcome, Outcome::Crash { .. })),
            "timeout" => Some(matches!(row.outcome, Outcome::Timeout { .. })),
            name => violates(&repository, name, row),
        });
    }
    insta::assert_snapshot!("regions", table(&found).text(TextOptions { width: None, colour: false }));
    let svg = found[0].svg(repository.plan());
    assert!(roxmltree::Document::parse(&svg).is_ok());
    insta::assert_snapshot!("regions_svg", svg.replace("><", ">\n<"));
}

/// Whether a test violates the requirement of this name; `None` if it is inconclusive.
fn violates(repository: &Repository, name: &str, row: &TestRow) -> Option<bool> {
    let requirement = repository.plan().requirements.iter().find(|requirement| requirement.name == name).unwrap();
    match row.verdict(requirement) {
        Verdict::Violated => Some(true),
        Verdict::Satisfied => Some(false),
        Verdict::Inconclusive => None,
    }
}

#[test]
fn by_cause_the_tests_that_hold_no_other_cause_are_divided_in_units() {
    let (_folder, repository) = repository();
    let all = Selection::default();
    let causes = crate::causes::causes(&repository, &all).unwrap();
    let found = regions_by_cause(&repository, &all, None, 3).unwrap();
    assert_eq!(found.len(), causes.len());
    for (cause, regions) in causes.iter().zip(&found) {
        let plan = repository.plan();
        let names: Vec<String> = cause.operations.iter().map(|act| act.name(plan)).collect();
        assert_eq!(regions.cause.as_ref(), Some(&names));
        assert_eq!(regions.target, plan.requirement(cause.requirement).name);
        let others = causes.iter().filter(|other| other.requirement == cause.requirement && *other != cause);
        let others: Vec<_> = others.map(|other| &other.operations).collect();
        assert_counted(&repository, regions, |row| {
            let acts = row.test.operations.iter().zip(&row.idle).filter(|(_, idle)| !**idle);
            let acts: BTreeSet<crate::causes::Act> = acts.map(|(used, _)| crate::causes::Act::of(plan, used)).collect();
            let holds = cause.operations.is_subset(&acts) && !others.iter().any(|set| set.is_subset(&acts));
            holds.then(|| violates(&repository, &regions.target, row)).flatten()
        });
    }
    insta::assert_snapshot!("regions_by_cause", table(&found).text(TextOptions { width: None, colour: false }));

    let of_one = regions_by_cause(&repository, &all, Some("R4"), 3).unwrap();
    assert!(!of_one.is_empty() && of_one.iter().all(|regions| regions.target == "R4"));
    let error = regions_by_cause(&repository, &all, Some("crash"), 3).unwrap_err().to_string();
    assert_eq!(error, "`crash` has no causes: only requirements have");
}

#[test]
fn one_requirement_is_asked_for_by_its_name() {
    let (_folder, repository) = repository();
    let one = regions(&repository, &Selection::default(), Some("R2"), 3).unwrap();
    assert_eq!((one.len(), one[0].target.as_str(), one[0].all.failing, one[0].rules.len()), (1, "R2", 3, 1));
    assert_eq!(one[0].rules[0].sentence(), "everywhere");
    let error = regions(&repository, &Selection::default(), Some("R9"), 3).unwrap_err().to_string();
    assert!(error.contains("`R9`") && error.contains("R1, R2, R3, R4"), "{error}");
}
