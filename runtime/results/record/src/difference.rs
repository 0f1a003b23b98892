//! What differs between two runs of one test, in words.

use serde::Serialize;

use sesame_base::observation::{Counters, MetricObservation, Observation, OperationEffect, Outcome};
use sesame_plan::{CampaignPlan, Span, Test};

/// Something in which two runs of one test differ.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct Difference {
    /// What it is, for example ``metric `cycle_time` ``.
    pub what: String,
    /// What it was in the earlier run.
    pub before: String,
    /// What it was in the later run.
    pub after: String,
}

/// All that differs between two runs of a test of this plan, compared bit for bit: how they ended, what each operation
/// did, and every metric with its series. Wall times and limits of wall time are not compared, nor are warnings, which
/// follow from the rest.
pub fn differences(plan: &CampaignPlan, test: &Test, before: &Observation, after: &Observation) -> Vec<Difference> {
    let mut found = Differences::default();
    found.compare("the outcome", &outcome(&before.outcome), &outcome(&after.outcome), Clone::clone);
    found.compare("the end of the run", &before.end, &after.end, |end| format!("{end} s"));
    found.compare("the number of messages", &before.messages, &after.messages, u64::to_string);
    for (at, used) in test.operations.iter().enumerate() {
        let name = format!("operation {} (`{}`)", at + 1, plan.operation(used.operation).name);
        let [before, after] = [before, after].map(|run| run.operations.get(at));
        match (before, after) {
            (Some(before), Some(after)) => found.operation(&name, before, after),
            (before, after) => {
                let word = |effect: &Option<_>| if effect.is_some() { "reported" } else { "not reported" }.to_owned();
                found.compare(&format!("the effect of {name}"), &before, &after, word);
            }
        }
    }
    for (at, metric) in plan.metrics.iter().enumerate() {
        let name = format!("metric `{}`", metric.name);
        let [before, after] = [before, after].map(|run| run.metrics.get(at));
        match (before, after) {
            (Some(before), Some(after)) => found.metric(&name, before, after),
            (before, after) => {
                let word = |shown: &Option<_>| if shown.is_some() { "reported" } else { "not reported" }.to_owned();
                found.compare(&name, &before, &after, word);
            }
        }
    }
    found.0
}

#[derive(Default)]
struct Differences(Vec<Difference>);

impl Differences {
    fn compare<T: PartialEq>(&mut self, what: &str, before: &T, after: &T, word: impl Fn(&T) -> String) {
        if before != after {
            self.0.push(Difference { what: what.to_owned(), before: word(before), after: word(after) });
        }
    }

    fn operation(&mut self, name: &str, before: &OperationEffect, after: &OperationEffect) {
        let words = |spans: &Vec<Span>| {
            let words: Vec<String> = spans.iter().map(|Span { start, end }| format!("{start} to {end} s")).collect();
            if words.is_empty() { "never".to_owned() } else { words.join(", ") }
        };
        self.compare(&format!("the active time of {name}"), &before.intervals, &after.intervals, words);
        self.compare(&format!("the tail of {name}"), &before.tails, &after.tails, words);
        self.compare(&format!("the effect of {name}"), &before.counters, &after.counters, |counters| {
            let Counters { seen, changed, dropped, delayed, queued, injected, side_effects, unheard } = counters;
            format!(
                "{seen} seen, {changed} changed, {dropped} dropped, {delayed} delayed, {queued} queued, \
                 {injected} injected, {side_effects} side effects, {unheard} unheard"
            )
        });
        let touches = |effect: &OperationEffect| (effect.first_touch, effect.last_touch);
        self.compare(&format!("the touches of {name}"), &touches(before), &touches(after), |touches| {
            let word = |time: Option<f64>| time.map_or("never".to_owned(), |time| format!("{time} s"));
            format!("first {}, last {}", word(touches.0), word(touches.1))
        });
    }

    fn metric(&mut self, name: &str, before: &MetricObservation, after: &MetricObservation) {
        let value = |shown: &MetricObservation| (shown.value, shown.set);
        if value(before) == value(after) {
            self.compare(&format!("what {name} could have been"), &before.reach, &after.reach, |reach| {
                let end = |end: Option<f64>| end.map_or("any".to_owned(), |end| end.to_string());
                format!("{} to {}", end(reach.low), end(reach.high))
            });
        }
        self.compare(&format!("what is not finite for {name}"), &before.not_finite, &after.not_finite, |time| {
            time.map_or("never".to_owned(), |time| format!("from {time} s on"))
        });
        let word = |value: &(Option<f64>, bool)| match *value {
            (None, _) => "no value".to_owned(),
            (Some(value), true) => value.to_string(),
            (Some(value), false) => format!("{value} (never set)"),
        };
        self.compare(name, &value(before), &value(after), word);
        let longest = before.series.len().max(after.series.len());
        let Some(at) = (0..longest).find(|&at| before.series.get(at) != after.series.get(at)) else { return };
        let what = format!("the series of {name}, change {}", at + 1);
        self.compare(&what, &before.series.get(at), &after.series.get(at), |point| {
            point.map_or("none".to_owned(), |(time, value)| format!("{value} at {time} s"))
        });
    }
}

fn outcome(outcome: &Outcome) -> String {
    match outcome.message() {
        Some(message) => format!("{}: {message}", outcome.word()),
        // How long a timeout was waited for is wall time, and left out.
        None => outcome.word().to_owned(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sample;

    fn said(change: impl FnOnce(&mut Observation)) -> Vec<(String, String, String)> {
        let plan = sample::plan();
        let test = &plan.tests[0].test;
        let before = sample::observe(&plan, test, 1);
        let mut after = before.clone();
        change(&mut after);
        let differences = differences(&plan, test, &before, &after);
        differences.into_iter().map(|difference| (difference.what, difference.before, difference.after)).collect()
    }

    #[test]
    fn runs_that_differ_only_in_wall_time_are_the_same() {
        assert_eq!(said(|run| run.wall.run *= 3.0), []);
        let plan = sample::plan();
        let mut slow = sample::observe(&plan, &Test::default(), 1);
        slow.outcome = Outcome::Timeout { limit: 60.0 };
        let slower = Observation { outcome: Outcome::Timeout { limit: 61.0 }, ..slow.clone() };
        assert_eq!(differences(&plan, &Test::default(), &slow, &slower), []);
    }

    #[test]
    fn the_last_bit_of_a_value_is_a_difference() {
        let found = said(|run| run.metrics[1].value = run.metrics[1].value.map(f64::next_up));
        assert_eq!(found, [("metric `fuzzing_time`".into(), "49".into(), "49.00000000000001".into())]);
    }

    #[test]
    fn everything_observed_is_compared() {
        let whats = |change: fn(&mut Observation)| said(change).into_iter().map(|(what, ..)| what).collect::<Vec<_>>();
        assert_eq!(whats(|run| run.outcome = Outcome::NoEffect), ["the outcome"]);
        assert_eq!(whats(|run| run.end = 1.0), ["the end of the run"]);
        assert_eq!(whats(|run| run.messages += 1), ["the number of messages"]);
        let operation = "operation 1 (`jitter_link1`)";
        assert_eq!(whats(|run| run.operations[0].counters.seen += 1), [format!("the effect of {operation}")]);
        assert_eq!(whats(|run| run.operations[0].intervals.clear()), [format!("the active time of {operation}")]);
        assert_eq!(whats(|run| run.operations[0].last_touch = None), [format!("the touches of {operation}")]);
        assert_eq!(whats(|run| run.operations.clear()), [format!("the effect of {operation}")]);
        assert_eq!(whats(|run| run.metrics[0].set = false), ["metric `collision_occurrence`"]);
        assert_eq!(whats(|run| run.metrics.truncate(4)), ["metric `arm_distance`"]);
    }

    #[test]
    fn the_first_change_of_a_series_that_differs_is_named() {
        let found = said(|run| run.metrics[2].series[1].1 += 0.5);
        let [(what, before, after)] = &found[..] else { panic!("{found:?}") };
        assert_eq!(what, "the series of metric `top_speed`, change 2");
        assert_eq!(before.split(" at ").nth(1), after.split(" at ").nth(1));
        let cut = said(|run| run.metrics[2].series.truncate(1));
        assert_eq!((cut[0].0.as_str(), cut[0].2.as_str()), ("the series of metric `top_speed`, change 2", "none"));
    }
}
