//! Traces of the simulation and of the lab above each other.

use std::collections::BTreeMap;

use sesame_analysis::traces::{Signal, Signals, TraceGap, TracedTest};
use sesame_base::test_number::TestNumber;
use sesame_present::axis::Axis;
use sesame_present::markup::Markup;

use crate::study::figure::{Figure, Plot, path};

/// The size of a figure, in pixels.
const SIZE: [f64; 2] = [340.0, 300.0];

/// The edges of the plot of the signals in it, and of that of their differences.
const SIGNAL: [f64; 4] = [52.0, 26.0, 330.0, 146.0];
const DIFFERENCE: [f64; 4] = [52.0, 192.0, 330.0, 260.0];

/// Signals drawn of each test at most: those that are furthest apart, for their spread.
const SIGNALS: usize = 3;

/// Tests drawn at most.
const TESTS: usize = 12;

/// Runs of the lab drawn of each test at most.
const RUNS: usize = 5;

/// Columns into which a line is divided; of each, the least and the greatest value are drawn.
const COLUMNS: usize = 150;

/// The signals that differ most, of each test. `after` is what the compensated simulation published, by test.
pub(super) fn figures(
    traced: &[TracedTest],
    after: &BTreeMap<u32, Signals>,
    gap: &TraceGap,
) -> Vec<(u32, Vec<Figure>)> {
    traced.iter().take(TESTS).map(|test| (test.test, of_test(test, after.get(&test.test), gap))).collect()
}

fn of_test(test: &TracedTest, after: Option<&Signals>, gap: &TraceGap) -> Vec<Figure> {
    let mut signals: Vec<(f64, &str)> = gap
        .comparisons
        .iter()
        .filter(|compared| compared.test == test.test)
        .filter_map(|compared| Some((compared.apart()?, compared.signal.as_str())))
        .collect();
    signals.sort_by(|one, other| other.0.total_cmp(&one.0).then_with(|| one.1.cmp(other.1)));
    signals
        .into_iter()
        .take(SIGNALS)
        .filter_map(|(_, name)| {
            let simulation = test.simulation.get(name)?;
            let lab: Vec<&Signal> = test.lab.iter().filter_map(|run| run.get(name)).take(RUNS).collect();
            let after = after.and_then(|after| after.get(name));
            Some(figure(test.test, name, simulation, &lab, after))
        })
        .collect()
}

fn figure(test: u32, name: &str, simulation: &Signal, lab: &[&Signal], after: Option<&Signal>) -> Figure {
    let all = || std::iter::once(simulation).chain(lab.iter().copied()).chain(after);
    let across = Axis::round(all().flat_map(|signal| signal.times.iter().copied()).chain([0.0]), 6);
    let up = Axis::round(all().flat_map(|signal| signal.values.iter().copied()), 4);
    let plot = Plot { across: across.clone(), up, edges: SIGNAL };
    let mut drawn = Markup::default();
    plot.frame(&mut drawn, "", name);
    for run in lab {
        path(&mut drawn, "lab", places(&plot, run));
    }
    path(&mut drawn, "simulation", places(&plot, simulation));
    if let Some(after) = after {
        path(&mut drawn, "compensated", places(&plot, after));
    }
    let before: Vec<Signal> = lab.iter().map(|run| difference(run, simulation)).collect();
    let after = after.zip(lab.first()).map(|(after, run)| difference(run, after));
    let differences = before.iter().chain(&after).flat_map(|signal| signal.values.iter().copied());
    let plot = Plot { across, up: Axis::round(differences.chain([0.0]), 3), edges: DIFFERENCE };
    plot.frame(&mut drawn, "time [s]", "lab − simulation");
    for run in &before {
        path(&mut drawn, "lab", places(&plot, run));
    }
    if let Some(after) = &after {
        path(&mut drawn, "compensated", places(&plot, after));
    }
    let test = TestNumber(test);
    Figure::new(&format!("trace-{test}-{name}"), format!("{name} of {test}"), SIZE, drawn)
}

/// How much greater one signal is than another, at its own times, where the other one is known. Between its times, the
/// other one is taken to change evenly.
fn difference(one: &Signal, other: &Signal) -> Signal {
    let mut difference = Signal::default();
    for (&time, &value) in one.times.iter().zip(&one.values) {
        let after = other.times.partition_point(|&at| at < time);
        let known = |at: usize| Some((*other.times.get(at)?, *other.values.get(at)?));
        let there = match (after.checked_sub(1).and_then(known), known(after)) {
            (_, Some((at, value))) if at <= time => value,
            (Some((from, low)), Some((to, high))) => low + (high - low) * (time - from) / (to - from),
            _ => continue,
        };
        difference.times.push(time);
        difference.values.push(value - there);
    }
    difference
}

/// A line that looks like the whole: in each column, the first, least, greatest and last value in their order.
fn places(plot: &Plot, signal: &Signal) -> Vec<[f64; 2]> {
    let [left, _, right, _] = plot.edges;
    let column = |time: f64| libm::floor((plot.x(time) - left) / (right - left) * COLUMNS as f64);
    let mut drawn: Vec<usize> = Vec::new();
    let mut begin = 0;
    while begin < signal.times.len() {
        let of = column(signal.times[begin]);
        let end = (begin..signal.times.len()).find(|&at| column(signal.times[at]) != of).unwrap_or(signal.times.len());
        let by_value = |one: &usize, other: &usize| signal.values[*one].total_cmp(&signal.values[*other]);
        let mut kept = vec![begin, end - 1];
        kept.extend((begin..end).min_by(by_value));
        kept.extend((begin..end).max_by(by_value));
        kept.sort_unstable();
        kept.dedup();
        drawn.extend(kept);
        begin = end;
    }
    drawn.into_iter().map(|at| [plot.x(signal.times[at]), plot.y(signal.values[at])]).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_difference_is_taken_where_both_signals_are_known() {
        let one = Signal { times: vec![0.0, 1.0, 1.5, 3.0, 9.0], values: vec![5.0, 5.0, 5.0, 5.0, 5.0] };
        let other = Signal { times: vec![1.0, 2.0, 4.0], values: vec![1.0, 3.0, 3.0] };
        let difference = difference(&one, &other);
        assert_eq!(difference, Signal { times: vec![1.0, 1.5, 3.0], values: vec![4.0, 3.0, 2.0] });
    }

    #[test]
    fn a_long_line_is_thinned_and_keeps_its_peaks() {
        let times: Vec<f64> = (0..20_000).map(|at| f64::from(at) / 100.0).collect();
        let values: Vec<f64> = (0..20_000).map(|at| if at == 7_777 { 9.0 } else { f64::from(at % 3) }).collect();
        let signal = Signal { times, values };
        let plot = Plot { across: Axis::exact(0.0, 200.0, 4), up: Axis::exact(0.0, 10.0, 4), edges: SIGNAL };
        let places = places(&plot, &signal);
        assert!(places.len() <= 4 * (COLUMNS + 1), "{}", places.len());
        let top = places.iter().map(|place| place[1]).fold(f64::INFINITY, f64::min);
        assert_eq!(top, plot.y(9.0));
        assert!(places.windows(2).all(|pair| pair[0][0] <= pair[1][0]));
    }
}
