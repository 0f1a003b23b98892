use proptest::prelude::*;

use sesame_plan::Comparison;
use sesame_plan::stl::{Formula, Interval};

use super::*;

/// Samples of two signals in the order of their times, in ticks, and the end of the trace.
#[derive(Debug, Clone)]
struct Trace {
    samples: Vec<(i64, usize, f64)>,
    end: i64,
}

const SIGNALS: usize = 2;

fn signal(signal: u32, comparison: Comparison, constant: f64) -> Formula {
    Formula::Predicate { signal, comparison, constant }
}

fn not(of: Formula) -> Formula {
    Formula::Not { of: Box::new(of) }
}

fn always(interval: Interval, of: Formula) -> Formula {
    Formula::Always { interval, of: Box::new(of) }
}

fn eventually(interval: Interval, of: Formula) -> Formula {
    Formula::Eventually { interval, of: Box::new(of) }
}

fn until(interval: Interval, left: Formula, right: Formula) -> Formula {
    Formula::Until { interval, weak: false, left: Box::new(left), right: Box::new(right) }
}

fn weak_until(interval: Interval, left: Formula, right: Formula) -> Formula {
    Formula::Until { interval, weak: true, left: Box::new(left), right: Box::new(right) }
}

fn implies(left: Formula, right: Formula) -> Formula {
    Formula::Implies { left: Box::new(left), right: Box::new(right) }
}

/// An interval in whole seconds.
fn seconds(from: u32, to: u32) -> Interval {
    Interval { from: f64::from(from), to: Some(f64::from(to)) }
}

/// `x > 0` of the first signal: its robustness is the signal.
fn x() -> Formula {
    signal(0, Comparison::Above, 0.0)
}

/// `y > 0` of the second signal.
fn y() -> Formula {
    signal(1, Comparison::Above, 0.0)
}

/// The robustness of a trace whose ticks have this many nanoseconds.
fn robustness(formula: &Formula, trace: &Trace, tick: i64) -> Option<f64> {
    robustness_by(Monitor::new(formula, SIGNALS).unwrap(), trace, tick)
}

/// The same over whole windows.
fn robustness_over_whole(formula: &Formula, trace: &Trace, tick: i64) -> Option<f64> {
    robustness_by(Monitor::new(formula, SIGNALS).unwrap().over_whole_windows(), trace, tick)
}

fn robustness_by(mut monitor: Monitor, trace: &Trace, tick: i64) -> Option<f64> {
    for &(time, signal, value) in &trace.samples {
        monitor.push(SimTime::from_nanos(time * tick), signal, value);
    }
    monitor.finish(SimTime::from_nanos(trace.end * tick))
}

/// Samples of both signals at each second from 0 on, up to the end of the trace.
fn sampled(xs: &[f64], ys: &[f64]) -> Trace {
    let of = |signal, values: &[f64]| (0..).zip(values).map(|(t, &v)| (t, signal, v)).collect::<Vec<_>>();
    let mut samples = [of(0, xs), of(1, ys)].concat();
    samples.sort_by_key(|sample| sample.0);
    let end = samples.last().unwrap().0;
    Trace { samples, end }
}

const SECOND: i64 = 1_000_000_000;

// The definitions, applied to every instant of a grid that is finer than all that happens.

/// The value of a signal: that of its last sample up to a time.
fn held(trace: &Trace, signal: usize, time: i64) -> Option<f64> {
    trace.samples.iter().rfind(|sample| sample.1 == signal && sample.0 <= time).map(|sample| sample.2)
}

fn signals_of(formula: &Formula) -> Vec<usize> {
    match formula {
        Formula::Predicate { signal, .. } => vec![*signal as usize],
        Formula::Not { of } | Formula::Always { of, .. } | Formula::Eventually { of, .. } => signals_of(of),
        Formula::And { left, right }
        | Formula::Or { left, right }
        | Formula::Implies { left, right }
        | Formula::Until { left, right, .. } => [signals_of(left), signals_of(right)].concat(),
    }
}

/// The robustness at each instant from `start` to the end of the trace.
fn by_definition(formula: &Formula, trace: &Trace, start: i64, whole: bool) -> Vec<f64> {
    let of = |formula: &Formula| by_definition(formula, trace, start, whole);
    let both = |left, right, join: fn(f64, f64) -> f64| -> Vec<f64> {
        of(left).into_iter().zip(of(right)).map(|(l, r)| join(l, r)).collect()
    };
    let ticks = |seconds| usize::try_from(SimTime::from_seconds(seconds).nanos()).unwrap();
    let window = |at: usize, interval: &Interval, length: usize| {
        let end = interval.to.map_or(length, |to| length.min(at + ticks(to) + 1));
        (at + ticks(interval.from)).min(end)..end
    };
    // The instants at which there is a robustness, of an operator on what has this many.
    let defined = |interval: &Interval, length: usize| {
        length.saturating_sub(ticks(if whole { interval.to.unwrap_or(interval.from) } else { interval.from }))
    };
    let least = |values: &[f64]| values.iter().copied().fold(f64::INFINITY, f64::min);
    let greatest = |values: &[f64]| values.iter().copied().fold(f64::NEG_INFINITY, f64::max);
    match formula {
        Formula::Predicate { signal, comparison, constant } => (start..=trace.end)
            .map(|time| {
                let value = held(trace, *signal as usize, time).unwrap();
                match comparison {
                    _ if value.is_nan() => f64::NEG_INFINITY,
                    Comparison::Above | Comparison::AtLeast => value - constant,
                    Comparison::Below | Comparison::AtMost => constant - value,
                    Comparison::Equal => -f64::abs(value - constant),
                    Comparison::NotEqual => f64::abs(value - constant),
                }
            })
            .collect(),
        Formula::Not { of: inner } => of(inner).into_iter().map(|value| -value).collect(),
        Formula::And { left, right } => both(left, right, f64::min),
        Formula::Or { left, right } => both(left, right, f64::max),
        Formula::Implies { left, right } => both(left, right, |l, r| f64::max(-l, r)),
        Formula::Always { interval, of: inner } => {
            let inner = of(inner);
            let n = inner.len();
            (0..defined(interval, n)).map(|at| least(&inner[window(at, interval, n)])).collect()
        }
        Formula::Eventually { interval, of: inner } => {
            let inner = of(inner);
            let n = inner.len();
            (0..defined(interval, n)).map(|at| greatest(&inner[window(at, interval, n)])).collect()
        }
        Formula::Until { interval, weak, left, right } => {
            let (left, right) = (of(left), of(right));
            let n = left.len().min(right.len());
            let arrive = |at: usize, s: usize| right[s].min(least(&left[at..=s]));
            let hold = |at: usize| least(&left[at..window(at, interval, n).end]);
            let best = |at| {
                let arrived = greatest(&window(at, interval, n).map(|s| arrive(at, s)).collect::<Vec<f64>>());
                if *weak { arrived.max(hold(at)) } else { arrived }
            };
            (0..defined(interval, n)).map(best).collect()
        }
    }
}

/// The robustness by definition, where the trace is known.
fn naive(formula: &Formula, trace: &Trace) -> Option<f64> {
    naive_by(formula, trace, false)
}

/// The same, over cut windows or over whole ones only.
fn naive_by(formula: &Formula, trace: &Trace, whole: bool) -> Option<f64> {
    let first = |signal| trace.samples.iter().find(|sample| sample.1 == signal).map(|sample| sample.0);
    let starts: Option<Vec<i64>> = signals_of(formula).into_iter().map(first).collect();
    let robustness = by_definition(formula, trace, starts?.into_iter().max()?, whole);
    Some(robustness.first().copied().unwrap_or(f64::INFINITY))
}

#[test]
fn a_trace_that_breaks_off_says_what_no_continuation_can_change() {
    let reach = |formula: &Formula, trace: &Trace| {
        let mut monitor = Monitor::new(formula, SIGNALS).unwrap();
        for &(time, signal, value) in &trace.samples {
            monitor.push(SimTime::from_nanos(time * SECOND), signal, value);
        }
        monitor.reach(SimTime::from_nanos(trace.end * SECOND))
    };
    let broken = Trace { end: 3, ..sampled(&[2.0, -1.0, 4.0], &[-3.0, -2.0, -3.0]) };
    let (least, greatest) = (f64::NEG_INFINITY, f64::INFINITY);
    assert_eq!(reach(&always(Interval::UNBOUNDED, x()), &broken), (least, -1.0));
    assert_eq!(reach(&eventually(Interval::UNBOUNDED, y()), &broken), (-2.0, greatest));
    assert_eq!(reach(&always(seconds(0, 2), x()), &broken), (-1.0, -1.0), "its window is over");
    assert_eq!(reach(&always(seconds(5, 9), x()), &broken), (least, greatest));
    // The request at 2 s was answered by -2 until now, and the answer has time until 4 s.
    let answered = always(Interval::UNBOUNDED, implies(x(), eventually(seconds(0, 1), y())));
    assert_eq!(reach(&answered, &broken), (least, -2.0));
    assert_eq!(reach(&x(), &Trace { samples: vec![(0, 1, 1.0)], end: 5 }), (least, greatest), "it has not begun");
}

/// Small numbers, so that many are equal and many windows end where something jumps.
fn any_value() -> impl Strategy<Value = f64> {
    prop_oneof![
        20 => (-4..=4i32).prop_map(f64::from),
        1 => Just(f64::NAN),
        1 => Just(f64::INFINITY),
        1 => Just(f64::NEG_INFINITY),
    ]
}

/// Up to 24 samples, several at one time at times, of signals that may begin late or never.
fn any_trace() -> impl Strategy<Value = Trace> {
    let sample = (0..4i64, 0..SIGNALS, any_value());
    (0..3i64, proptest::collection::vec(sample, 1..24), 0..6i64).prop_map(|(first, steps, rest)| {
        let mut time = first;
        let samples: Vec<_> = steps
            .into_iter()
            .map(|(step, signal, value)| {
                time += step;
                (time, signal, value)
            })
            .collect();
        Trace { samples, end: time + rest }
    })
}

/// Intervals in ticks of a nanosecond: of no length, unbounded, and longer than traces among them.
fn any_interval() -> impl Strategy<Value = Interval> {
    let bounded = (0..8u32, 0..12u32).prop_map(|(from, length)| (from, Some(from + length)));
    let unbounded = (0..4u32).prop_map(|from| (from, None));
    let long = (0..90u32, 0..90u32).prop_map(|(from, length)| (from, Some(from + length)));
    prop_oneof![6 => bounded, 2 => unbounded, 1 => long]
        .prop_map(|(from, to)| Interval { from: f64::from(from) * 1e-9, to: to.map(|to| f64::from(to) * 1e-9) })
}

fn any_predicate() -> impl Strategy<Value = Formula> {
    let comparison = prop_oneof![
        Just(Comparison::Below),
        Just(Comparison::AtMost),
        Just(Comparison::Above),
        Just(Comparison::AtLeast),
        Just(Comparison::Equal),
        Just(Comparison::NotEqual),
    ];
    (0..2u32, comparison, -2..=2i32).prop_map(|(index, comparison, c)| signal(index, comparison, f64::from(c)))
}

/// Formulas of up to four levels.
fn any_formula() -> impl Strategy<Value = Formula> {
    any_predicate().prop_recursive(4, 16, 2, |part| {
        let two = || (part.clone(), part.clone()).prop_map(|(left, right)| (Box::new(left), Box::new(right)));
        prop_oneof![
            1 => part.clone().prop_map(not),
            1 => two().prop_map(|(left, right)| Formula::And { left, right }),
            1 => two().prop_map(|(left, right)| Formula::Or { left, right }),
            1 => two().prop_map(|(left, right)| Formula::Implies { left, right }),
            2 => (any_interval(), part.clone()).prop_map(|(interval, of)| always(interval, of)),
            2 => (any_interval(), part.clone()).prop_map(|(interval, of)| eventually(interval, of)),
            3 => (any_interval(), any::<bool>(), two())
                .prop_map(|(interval, weak, (left, right))| Formula::Until { interval, weak, left, right }),
        ]
    })
}

/// The formula with all intervals stretched.
fn stretched(formula: &Formula, factor: f64) -> Formula {
    let part = |of: &Formula| Box::new(stretched(of, factor));
    let stretch = |interval: Interval| Interval { from: interval.from * factor, to: interval.to.map(|to| to * factor) };
    match formula {
        Formula::Predicate { .. } => formula.clone(),
        Formula::Not { of } => Formula::Not { of: part(of) },
        Formula::And { left, right } => Formula::And { left: part(left), right: part(right) },
        Formula::Or { left, right } => Formula::Or { left: part(left), right: part(right) },
        Formula::Implies { left, right } => Formula::Implies { left: part(left), right: part(right) },
        Formula::Always { interval, of } => Formula::Always { interval: stretch(*interval), of: part(of) },
        Formula::Eventually { interval, of } => Formula::Eventually { interval: stretch(*interval), of: part(of) },
        Formula::Until { interval, weak, left, right } => {
            Formula::Until { interval: stretch(*interval), weak: *weak, left: part(left), right: part(right) }
        }
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(1_000))]

    #[test]
    fn a_signal_has_the_robustness_at_the_time_that_decides_it(
        interval in any_interval(), first in any_formula(), second in any_predicate(), shape in 0..4, trace in any_trace(),
        whole in any::<bool>(),
    ) {
        let formula = match shape {
            0 => always(interval, first),
            1 => eventually(interval, first),
            2 => Formula::And {
                left: Box::new(always(interval, first)),
                right: Box::new(always(Interval::UNBOUNDED, second)),
            },
            _ => implies(always(interval, first), eventually(Interval::UNBOUNDED, second)),
        };
        let mut monitor = Monitor::new(&formula, SIGNALS).unwrap().keeping_its_signal();
        if whole {
            monitor = monitor.over_whole_windows();
        }
        for &(time, signal, value) in &trace.samples {
            monitor.push(SimTime::from_nanos(time), signal, value);
        }
        let plain = if whole { robustness_over_whole(&formula, &trace, 1) } else { robustness(&formula, &trace, 1) };
        let kept = monitor.finish_with_signal(SimTime::from_nanos(trace.end));
        prop_assert_eq!(kept.as_ref().map(|kept| kept.0), plain);
        if let Some((robustness, signal)) = kept && robustness.is_finite() {
            let points = signal.thinned(&[]);
            prop_assert!(points.is_sorted_by(|a, b| a.0 <= b.0), "{:?}", points);
            let values = points.iter().map(|point| point.1);
            let decisive = if quantifier(&formula) == Some(Quantifier::Always) {
                values.fold(f64::INFINITY, f64::min)
            } else {
                values.fold(f64::NEG_INFINITY, f64::max)
            };
            prop_assert_eq!(decisive, robustness);
        }
    }

    #[test]
    fn always_is_as_defined(interval in any_interval(), of in any_predicate(), trace in any_trace()) {
        let formula = always(interval, of);
        prop_assert_eq!(robustness(&formula, &trace, 1), naive(&formula, &trace));
    }

    #[test]
    fn eventually_is_as_defined(interval in any_interval(), of in any_predicate(), trace in any_trace()) {
        let formula = eventually(interval, of);
        prop_assert_eq!(robustness(&formula, &trace, 1), naive(&formula, &trace));
    }

    #[test]
    fn a_weak_until_is_an_until_or_an_always(
        interval in any_interval(), left in any_formula(), right in any_predicate(), trace in any_trace(),
        whole in any::<bool>(),
    ) {
        let formula = weak_until(interval, left.clone(), right.clone());
        let all_through = always(Interval { from: 0.0, ..interval }, left.clone());
        let either = Formula::Or { left: Box::new(until(interval, left, right)), right: Box::new(all_through) };
        let by = if whole { robustness_over_whole } else { robustness };
        prop_assert_eq!(by(&formula, &trace, 1), by(&either, &trace, 1));
        prop_assert_eq!(by(&formula, &trace, 1), naive_by(&formula, &trace, whole));
    }

    #[test]
    fn until_is_as_defined(
        interval in any_interval(), left in any_predicate(), right in any_predicate(), trace in any_trace(),
    ) {
        let formula = until(interval, left, right);
        prop_assert_eq!(robustness(&formula, &trace, 1), naive(&formula, &trace));
    }

    // Outermost operators are asked for one time only; inner ones for a stretch of times that ends, or for all.
    #[test]
    fn every_operator_is_as_defined_at_all_times(
        outer in any_interval(), inner in any_interval(), left in any_predicate(), right in any_predicate(),
        trace in any_trace(),
    ) {
        for inner in [always(inner, left.clone()), eventually(inner, left.clone()), until(inner, left, right)] {
            for formula in [always(outer, inner.clone()), eventually(outer, inner)] {
                prop_assert_eq!(robustness(&formula, &trace, 1), naive(&formula, &trace));
            }
        }
    }

    #[test]
    fn nested_formulas_are_as_defined(formula in any_formula(), trace in any_trace()) {
        prop_assert_eq!(robustness(&formula, &trace, 1), naive(&formula, &trace));
    }

    // The definitions are applied to every third of a tick: nothing happens between ticks. The last instant of a trace
    // lasts a tick, so all thirds of it belong to the trace.
    #[test]
    fn time_is_dense(formula in any_formula(), trace in any_trace()) {
        let finer = Trace {
            samples: trace.samples.iter().map(|&(time, signal, value)| (3 * time, signal, value)).collect(),
            end: 3 * trace.end + 2,
        };
        prop_assert_eq!(robustness(&formula, &trace, 1), naive(&stretched(&formula, 3.0), &finer));
    }

    // The trace is cut where any of its samples may be the last one heard, and the rest of it is one of many
    // continuations.
    #[test]
    fn no_continuation_leaves_the_reach(formula in any_formula(), trace in any_trace(), cut in 0..60i64) {
        let now = cut.min(trace.end);
        for whole in [false, true] {
            let monitor = Monitor::new(&formula, SIGNALS).unwrap();
            let mut monitor = if whole { monitor.over_whole_windows() } else { monitor };
            for &(time, signal, value) in trace.samples.iter().filter(|sample| sample.0 <= now) {
                monitor.push(SimTime::from_nanos(time), signal, value);
            }
            let (least, greatest) = monitor.reach(SimTime::from_nanos(now));
            // An infinite robustness is not a value, but no bound was given.
            if let Some(value) = naive_by(&formula, &trace, whole) {
                prop_assert!((least..=greatest).contains(&value), "{value} of [{least}, {greatest}] at {now}, {whole}");
            }
        }
    }

    #[test]
    fn nested_formulas_over_whole_windows_are_as_defined(formula in any_formula(), trace in any_trace()) {
        prop_assert_eq!(robustness_over_whole(&formula, &trace, 1), naive_by(&formula, &trace, true));
    }

    #[test]
    fn every_operator_over_whole_windows_is_as_defined_at_all_times(
        outer in any_interval(), inner in any_interval(), left in any_predicate(), right in any_predicate(),
        trace in any_trace(),
    ) {
        for inner in [always(inner, left.clone()), eventually(inner, left.clone()), until(inner, left, right)] {
            for formula in [always(outer, inner.clone()), eventually(outer, inner)] {
                prop_assert_eq!(robustness_over_whole(&formula, &trace, 1), naive_by(&formula, &trace, true));
            }
        }
    }

    // The reach of these is exact: the worst and the best continuation come to its ends.
    #[test]
    fn the_reach_of_one_operator_is_no_wider_than_continuations_make_it(
        interval in any_interval(), trace in any_trace(), finally in any::<bool>(),
    ) {
        let formula = if finally { eventually(interval, x()) } else { always(interval, x()) };
        let mut monitor = Monitor::new(&formula, SIGNALS).unwrap();
        for &(time, signal, value) in &trace.samples {
            monitor.push(SimTime::from_nanos(time), signal, value);
        }
        let now = trace.end + 1;
        let (least, greatest) = monitor.reach(SimTime::from_nanos(now));
        for (extreme, expected) in [(f64::NEG_INFINITY, least), (f64::INFINITY, greatest)] {
            let mut ahead = trace.clone();
            ahead.samples.push((now, 0, extreme));
            ahead.end = now + 200;
            if trace.samples.iter().any(|sample| sample.1 == 0) {
                prop_assert_eq!(robustness(&formula, &ahead, 1), Some(expected));
            }
        }
    }

    #[test]
    fn a_formula_survives_the_plan_file(formula in any_formula()) {
        let written = serde_json::to_string(&formula).unwrap();
        prop_assert_eq!(serde_json::from_str::<Formula>(&written).unwrap(), formula);
    }

    #[test]
    fn a_sample_that_repeats_the_value_changes_nothing(formula in any_formula(), trace in any_trace()) {
        let mut repeated = trace.clone();
        for time in (0..=trace.end).rev() {
            let after = trace.samples.partition_point(|sample| sample.0 <= time);
            for signal in 0..SIGNALS {
                if let Some(value) = held(&trace, signal, time) {
                    repeated.samples.insert(after, (time, signal, value));
                }
            }
        }
        prop_assert_eq!(robustness(&formula, &repeated, 1), robustness(&formula, &trace, 1));
    }
}

#[test]
fn a_jump_at_the_very_end_of_a_window_is_seen_and_one_after_it_is_not() {
    let trace = sampled(&[5.0, 5.0, 1.0, 5.0], &[]);
    assert_eq!(robustness(&always(seconds(0, 2), x()), &trace, SECOND), Some(1.0));
    let short = Interval { from: 0.0, to: Some(1.999_999_999) };
    assert_eq!(robustness(&always(short, x()), &trace, SECOND), Some(5.0));
    assert_eq!(robustness(&always(seconds(3, 3), x()), &trace, SECOND), Some(5.0));
}

#[test]
fn a_value_counts_up_to_the_next_sample_and_not_at_it() {
    let trace = sampled(&[1.0, 5.0, 5.0], &[]);
    assert_eq!(robustness(&always(seconds(1, 2), x()), &trace, SECOND), Some(5.0));
    let early = Interval { from: 0.999_999_999, to: Some(2.0) };
    assert_eq!(robustness(&always(early, x()), &trace, SECOND), Some(1.0));
}

#[test]
fn a_sample_at_the_end_of_the_trace_counts() {
    let trace = sampled(&[5.0, 5.0, -1.0], &[]);
    assert_eq!(robustness(&always(Interval::UNBOUNDED, x()), &trace, SECOND), Some(-1.0));
}

#[test]
fn windows_are_cut_at_the_end_of_the_trace() {
    let trace = sampled(&[3.0, 2.0, 4.0], &[]);
    assert_eq!(robustness(&always(seconds(1, 100), x()), &trace, SECOND), Some(2.0));
    assert_eq!(robustness(&eventually(seconds(1, 100), x()), &trace, SECOND), Some(4.0));
    assert_eq!(robustness(&eventually(seconds(2, 100), not(x())), &trace, SECOND), Some(-4.0));
}

#[test]
fn over_whole_windows_a_request_shortly_before_the_end_asks_for_nothing() {
    let answered = always(Interval::UNBOUNDED, implies(x(), eventually(seconds(0, 2), y())));
    let trace = sampled(&[3.0, -1.0, -1.0, -1.0, 2.0], &[-5.0, -5.0, 0.5, -5.0, -5.0]);
    assert_eq!(robustness(&answered, &trace, SECOND), Some(-2.0));
    assert_eq!(robustness_over_whole(&answered, &trace, SECOND), Some(0.5));
    // Windows without end are never cut, and one that is whole to the last instant counts.
    assert_eq!(robustness_over_whole(&eventually(Interval::UNBOUNDED, y()), &trace, SECOND), Some(0.5));
    assert_eq!(robustness_over_whole(&always(seconds(0, 4), x()), &trace, SECOND), Some(-1.0));
    assert_eq!(robustness_over_whole(&always(seconds(0, 5), x()), &trace, SECOND), Some(f64::INFINITY));
}

#[test]
fn a_window_behind_the_end_of_the_trace_asks_for_nothing() {
    let trace = sampled(&[3.0, 2.0, 4.0], &[1.0]);
    assert_eq!(robustness(&always(seconds(3, 5), x()), &trace, SECOND), Some(f64::INFINITY));
    assert_eq!(robustness(&eventually(seconds(3, 5), x()), &trace, SECOND), Some(f64::INFINITY));
    assert_eq!(robustness(&until(seconds(3, 5), x(), y()), &trace, SECOND), Some(f64::INFINITY));
    let often = always(Interval::UNBOUNDED, eventually(seconds(1, 2), x()));
    assert_eq!(robustness(&often, &trace, SECOND), Some(4.0), "the last second asks for nothing");
}

#[test]
fn until_needs_both_sides_at_the_moment_of_the_change() {
    let interval = Interval::UNBOUNDED;
    let handed_over = sampled(&[2.0, 2.0, -1.0], &[-3.0, -3.0, 4.0]);
    assert_eq!(robustness(&until(interval, x(), y()), &handed_over, SECOND), Some(-1.0));
    let overlapping = sampled(&[2.0, 2.0, 1.0, -1.0], &[-3.0, -3.0, 4.0, 4.0]);
    assert_eq!(robustness(&until(interval, x(), y()), &overlapping, SECOND), Some(1.0));
    let at_once = sampled(&[2.0, -1.0], &[3.0, -3.0]);
    assert_eq!(robustness(&until(interval, x(), y()), &at_once, SECOND), Some(2.0));
}

#[test]
fn a_response_is_as_robust_as_its_worst_request() {
    let answered = implies(x(), eventually(seconds(0, 2), y()));
    let formula = always(Interval::UNBOUNDED, answered);
    let trace = sampled(&[-1.0, 3.0, -1.0, -1.0, 2.0, -1.0, -1.0], &[-5.0, -5.0, 0.5, -5.0, -5.0, -5.0, 7.0]);
    assert_eq!(robustness(&formula, &trace, SECOND), Some(0.5));
    let unanswered = sampled(&[-1.0, 3.0, -1.0, -1.0, 2.0, -1.0, -1.0], &[-5.0, -5.0, 0.5, -5.0, -5.0, -5.0, -4.0]);
    assert_eq!(robustness(&formula, &unanswered, SECOND), Some(-2.0));
}

#[test]
fn the_trace_begins_when_every_signal_of_the_formula_is_known() {
    let formula =
        Formula::And { left: Box::new(always(Interval::UNBOUNDED, x())), right: Box::new(always(seconds(0, 1), y())) };
    // `x` is -9 at first and 4 when `y` comes, so -9 is not part of the trace; `y` drops more than 1 s after it began.
    let samples = vec![(0, 0, -9.0), (2, 0, 4.0), (5, 1, 3.0), (7, 1, -2.0)];
    assert_eq!(robustness(&formula, &Trace { samples, end: 9 }, SECOND), Some(3.0));
}

#[test]
fn without_a_sample_of_every_signal_of_the_formula_there_is_no_robustness() {
    let trace = Trace { samples: vec![(0, 0, 1.0), (3, 0, 2.0)], end: 5 };
    assert_eq!(robustness(&until(Interval::UNBOUNDED, x(), y()), &trace, SECOND), None);
    assert_eq!(robustness(&always(Interval::UNBOUNDED, x()), &trace, SECOND), Some(1.0));
}

#[test]
fn of_several_samples_at_one_time_the_last_counts() {
    let trace = Trace { samples: vec![(0, 0, -7.0), (0, 0, 2.0), (1, 0, -9.0), (1, 0, 3.0)], end: 2 };
    assert_eq!(robustness(&always(Interval::UNBOUNDED, x()), &trace, SECOND), Some(2.0));
}

#[test]
fn nan_keeps_no_comparison() {
    let trace = sampled(&[1.0, f64::NAN], &[]);
    for comparison in [Comparison::Above, Comparison::AtMost, Comparison::Equal, Comparison::NotEqual] {
        let formula = always(Interval::UNBOUNDED, signal(0, comparison, 0.0));
        assert_eq!(robustness(&formula, &trace, SECOND), Some(f64::NEG_INFINITY), "{comparison:?}");
    }
}

#[test]
fn what_is_no_formula_is_refused_with_its_reason() {
    let refusal = |formula: &Formula| Monitor::new(formula, 2).unwrap_err().to_string();
    let interval = |from, to| not(always(Interval { from, to }, x()));
    assert!(refusal(&interval(2.0, Some(1.0))).contains("an interval from 2 s to 1 s"));
    assert!(refusal(&interval(-1.0, None)).contains("an interval from -1 s to inf s"));
    assert!(refusal(&interval(0.0, Some(f64::NAN))).contains("an interval from 0 s to NaN s"));
    assert!(refusal(&signal(0, Comparison::Below, f64::NAN)).contains("signal 0 is compared with NaN"));
    assert!(refusal(&signal(2, Comparison::Below, 1.0)).contains("names signal 2 of 2; name one below 2"));
}

/// The most pieces held at any time on a trace of this many seconds on which everything changes every second, and in
/// the way that keeps most of them: every value is a record of all that follow.
fn most_held(formula: &Formula, length: i64) -> usize {
    let mut monitor = Monitor::new(formula, SIGNALS).unwrap();
    (0..length)
        .map(|time| {
            for signal in 0..SIGNALS {
                let rising = signal == 0;
                let value = if rising { time as f64 } else { -(time as f64) };
                monitor.push(SimTime::from_nanos(time * SECOND), signal, value);
            }
            monitor.root.held() + monitor.robustness.len()
        })
        .max()
        .unwrap()
}

#[test]
fn memory_is_bounded_by_the_windows() {
    let within = seconds(0, 20);
    let bounded = [
        always(Interval::UNBOUNDED, eventually(within, y())),
        always(Interval::UNBOUNDED, implies(x(), eventually(within, y()))),
        eventually(Interval::UNBOUNDED, until(within, x(), y())),
        until(Interval::UNBOUNDED, always(within, x()), until(seconds(5, 20), y(), x())),
    ];
    for formula in bounded {
        let held = most_held(&formula, 1_000);
        assert!((10..200).contains(&held), "{held} pieces for {formula:?}");
        assert_eq!(held, most_held(&formula, 5_000), "{formula:?}");
    }
}

#[test]
fn an_outermost_operator_keeps_nothing_of_its_window() {
    for interval in [Interval::UNBOUNDED, seconds(0, 800), seconds(300, 800), Interval { from: 300.0, to: None }] {
        for formula in [always(interval, x()), eventually(interval, y()), until(interval, x(), y())] {
            let held = most_held(&formula, 1_000);
            assert!(held <= 8, "{held} pieces for {formula:?}");
        }
    }
}
