//! Robustness of signal temporal logic compared with that of another tool, on random formulas and uniformly sampled
//! traces.
//!
//! On such traces our dense time and rtamt's discrete time are the same: all interval ends are whole samples, and no
//! robustness changes between samples. There is one difference of meaning, and one of notation. rtamt asks of
//! `left until right` that `left` hold up to the sample before the one at which `right` does; ours, as Donzé and Maler
//! define it, that it hold at that one too. So ours is written `left until (left and right)` for rtamt. And rtamt has
//! no unbounded interval that begins later than now, so the length of the trace stands for infinity.

use std::fmt::Write as _;

use proptest::prelude::*;
use proptest::strategy::ValueTree as _;
use proptest::test_runner::TestRunner;

use sesame_base::time::SimTime;
use sesame_plan::Comparison;
use sesame_plan::stl::{Formula, Interval};
use sesame_stl::Monitor;
use sesame_tests::rtamt::{Case, PYTHON, answers};

const CASES: usize = 1_000;

/// Nanoseconds between samples. rtamt counts samples, so that this is ours alone.
const PERIOD: i64 = 20_000_000;

/// A number that has few digits, so that its text is the same number for everybody.
fn any_number() -> impl Strategy<Value = f64> {
    (-4_000..=4_000i32).prop_map(|thousandths| f64::from(thousandths) / 1_000.0)
}

/// In samples.
fn any_interval() -> impl Strategy<Value = Interval> {
    let bounded = (0..10u32, 0..12u32).prop_map(|(from, length)| (from, Some(from + length)));
    let unbounded = (0..4u32).prop_map(|from| (from, None));
    prop_oneof![3 => bounded, 1 => unbounded]
        .prop_map(|(from, to)| Interval { from: f64::from(from), to: to.map(f64::from) })
}

fn any_formula() -> impl Strategy<Value = Formula> {
    let comparison = prop_oneof![
        Just(Comparison::Below),
        Just(Comparison::AtMost),
        Just(Comparison::Above),
        Just(Comparison::AtLeast),
        Just(Comparison::Equal),
        Just(Comparison::NotEqual),
    ];
    let predicate = (0..2u32, comparison, any_number()).prop_map(|(signal, comparison, constant)| Formula::Predicate {
        signal,
        comparison,
        constant,
    });
    predicate.prop_recursive(4, 16, 2, |part| {
        let one = || part.clone().prop_map(Box::new);
        prop_oneof![
            1 => one().prop_map(|of| Formula::Not { of }),
            1 => (one(), one()).prop_map(|(left, right)| Formula::And { left, right }),
            1 => (one(), one()).prop_map(|(left, right)| Formula::Or { left, right }),
            1 => (one(), one()).prop_map(|(left, right)| Formula::Implies { left, right }),
            2 => (any_interval(), one()).prop_map(|(interval, of)| Formula::Always { interval, of }),
            2 => (any_interval(), one()).prop_map(|(interval, of)| Formula::Eventually { interval, of }),
            3 => (any_interval(), any::<bool>(), one(), one())
                .prop_map(|(interval, weak, left, right)| Formula::Until { interval, weak, left, right }),
        ]
    })
}

/// The formula in rtamt's words, for a trace of this many samples.
fn words(formula: &Formula, samples: usize) -> String {
    let of = |formula: &Formula| words(formula, samples);
    let interval = |interval: &Interval| match (interval.from, interval.to) {
        (0.0, None) => String::new(),
        (from, None) => format!("[{from}:{}]", (samples as f64).max(from)),
        (from, Some(to)) => format!("[{from}:{to}]"),
    };
    match formula {
        Formula::Predicate { signal, comparison, constant } => {
            let comparison = match comparison {
                Comparison::Below => "<",
                Comparison::AtMost => "<=",
                Comparison::Above => ">",
                Comparison::AtLeast => ">=",
                Comparison::Equal => "==",
                Comparison::NotEqual => "!==",
            };
            format!("({} {comparison} {constant})", ["x", "y"][*signal as usize])
        }
        Formula::Not { of: inner } => format!("(not {})", of(inner)),
        Formula::And { left, right } => format!("({} and {})", of(left), of(right)),
        Formula::Or { left, right } => format!("({} or {})", of(left), of(right)),
        Formula::Implies { left, right } => format!("({} -> {})", of(left), of(right)),
        Formula::Always { interval: i, of: inner } => format!("(always{} {})", interval(i), of(inner)),
        Formula::Eventually { interval: i, of: inner } => format!("(eventually{} {})", interval(i), of(inner)),
        Formula::Until { interval: i, weak, left, right } => {
            let (left, right) = (of(left), of(right));
            let until = format!("({left} until{} ({left} and {right}))", interval(i));
            if !weak {
                return until;
            }
            format!("({until} or (always{} {left}))", interval(&Interval { from: 0.0, ..*i }))
        }
    }
}

/// The formula with its intervals in seconds.
fn in_seconds(formula: &Formula) -> Formula {
    let part = |of: &Formula| Box::new(in_seconds(of));
    let seconds = |samples: f64| samples * SimTime::from_nanos(PERIOD).seconds();
    let scaled = |interval: &Interval| Interval { from: seconds(interval.from), to: interval.to.map(seconds) };
    match formula {
        Formula::Predicate { .. } => formula.clone(),
        Formula::Not { of } => Formula::Not { of: part(of) },
        Formula::And { left, right } => Formula::And { left: part(left), right: part(right) },
        Formula::Or { left, right } => Formula::Or { left: part(left), right: part(right) },
        Formula::Implies { left, right } => Formula::Implies { left: part(left), right: part(right) },
        Formula::Always { interval, of } => Formula::Always { interval: scaled(interval), of: part(of) },
        Formula::Eventually { interval, of } => Formula::Eventually { interval: scaled(interval), of: part(of) },
        Formula::Until { interval, weak, left, right } => {
            Formula::Until { interval: scaled(interval), weak: *weak, left: part(left), right: part(right) }
        }
    }
}

fn robustness(formula: &Formula, x: &[f64], y: &[f64]) -> f64 {
    let mut monitor = Monitor::new(&in_seconds(formula), 2).unwrap();
    let mut now = SimTime::ZERO;
    for (sample, (&x, &y)) in (0..).zip(x.iter().zip(y)) {
        now = SimTime::from_nanos(sample * PERIOD);
        monitor.push(now, 0, x);
        monitor.push(now, 1, y);
    }
    monitor.finish(now).unwrap()
}

#[test]
#[ignore = "long: needs Python's rtamt"]
fn robustness_is_that_of_rtamt_on_a_thousand_random_formulas() {
    let mut runner = TestRunner::deterministic();
    let trace = proptest::collection::vec((any_number(), any_number()), 2..60);
    let drawn: Vec<(Formula, Case)> = (0..CASES)
        .map(|_| {
            let (formula, trace) = (any_formula(), &trace).new_tree(&mut runner).unwrap().current();
            let (x, y): (Vec<f64>, Vec<f64>) = trace.into_iter().unzip();
            let case = Case { formula: words(&formula, x.len()), x, y };
            (formula, case)
        })
        .collect();
    let cases: Vec<Case> = drawn.iter().map(|(_, case)| case.clone()).collect();
    let Some(answers) = answers(&cases) else {
        println!("skipped: {PYTHON} names no Python with rtamt 0.4.10; `./test --long` makes one");
        return;
    };
    let mut differences = String::new();
    let (mut infinite, mut positive) = (0, 0);
    for ((formula, case), answer) in drawn.iter().zip(&answers) {
        let ours = robustness(formula, &case.x, &case.y);
        infinite += usize::from(ours.is_infinite());
        positive += usize::from(ours > 0.0);
        if ours != answer.robustness {
            writeln!(differences, "{ours} instead of {} for {case:?}", answer.robustness).unwrap();
        }
    }
    assert!(differences.is_empty(), "{differences}");
    println!("{CASES} formulas, no difference; {positive} kept, {infinite} empty");
    // Otherwise the formulas would say little.
    assert!((CASES / 4..CASES * 3 / 4).contains(&positive) && infinite < CASES / 4, "{positive}, {infinite}");
}
