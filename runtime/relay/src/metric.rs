//! Metrics: numbers computed from the messages of a test.

use std::collections::BTreeMap;

use sesame_base::observation::Reach;
use sesame_base::time::SimTime;
use sesame_plan::Trend;

use crate::value::{Text, Value};

mod aggregate;
mod engine;
mod expression;
mod held;
mod probe;
mod robustness;
#[cfg(test)]
mod tests;

pub use engine::{MetricError, MetricTable, Metrics};
pub(crate) use probe::sample;
pub use probe::unimplemented_hooks;

/// A user's metric hook as the runtime calls it. Generated code implements it around the typed hook trait.
pub trait Hook {
    /// Before the first message of a run.
    fn on_start(&mut self, ctx: &mut Context);
    /// A message on the metric's `input`th topic, as declared; [`Context::topic`] tells the member of a group.
    fn on_message(&mut self, input: usize, value: &Value, ctx: &mut Context);
    /// After the last message of a run.
    fn on_end(&mut self, ctx: &mut Context);
}

/// A hook that generated code registers.
#[derive(Debug, Clone, Copy)]
pub struct HookEntry {
    /// The metric's name in the space.
    pub metric: &'static str,
    /// A fresh hook; every run gets its own.
    pub build: fn() -> Box<dyn Hook>,
}

/// What a hook is told, and where it puts its value.
#[derive(Debug, Default)]
pub struct Context {
    now: SimTime,
    topic: Text,
    value: Option<f64>,
    series: Vec<(f64, f64)>,
    last_times: BTreeMap<String, SimTime>,
    unimplemented: bool,
    problem: Option<String>,
    /// The only way in which the value may change, and whether it went the other way.
    trend: Option<Trend>,
    turned: bool,
    /// When it first read a number that was not finite, and the value at that time.
    not_finite: Option<(SimTime, Option<f64>)>,
}

impl Context {
    /// Simulation time in seconds.
    pub fn now(&self) -> f64 {
        self.now.seconds()
    }

    /// Name on the wire of the topic the message came on; a member when the input is a group.
    pub fn topic(&self) -> &str {
        &self.topic
    }

    /// The metric's value so far in this run.
    pub fn value(&self) -> Option<f64> {
        self.value
    }

    /// Sets the metric's value. What is not finite is refused and reported as a warning of the run; from then on the run says
    /// no more of a requirement than if it had broken off.
    pub fn set(&mut self, value: f64) {
        if !value.is_finite() {
            self.note(format!("refused the value {value} at {}", self.now));
            self.read_not_finite();
            return;
        }
        if self.value == Some(value) {
            return;
        }
        if let Some(before) = self.value {
            let (turned, word) = match self.trend {
                Some(Trend::Rising) => (value < before, "rising"),
                Some(Trend::Falling) => (value > before, "falling"),
                None => (false, ""),
            };
            if turned {
                self.turned = true;
                self.note(format!("it is declared `{word}`, but its hook set {value} after {before} at {}", self.now));
            }
        }
        self.value = Some(value);
        let time = self.now.seconds();
        match self.series.last_mut() {
            Some(last) if last.0 == time => last.1 = value,
            _ => self.series.push((time, value)),
        }
    }

    /// Adds to the metric's value, which starts at zero.
    pub fn add(&mut self, amount: f64) {
        self.set(self.value.unwrap_or(0.0) + amount);
    }

    /// True the first time and then whenever at least this much simulation time has passed since it was last true:
    /// makes a count independent of the rate of messages.
    pub fn every_seconds(&mut self, period: f64) -> bool {
        self.every_seconds_for("", period)
    }

    /// As [`Context::every_seconds`], with a clock of its own for each key.
    pub fn every_seconds_for(&mut self, key: &str, period: f64) -> bool {
        let period = SimTime::from_seconds(period);
        match self.last_times.get_mut(key) {
            Some(last) if self.now - *last < period => false,
            Some(last) => {
                *last = self.now;
                true
            }
            None => {
                self.last_times.insert(key.to_owned(), self.now);
                true
            }
        }
    }

    /// Says that this hook is not filled in yet.
    pub fn unimplemented(&mut self) {
        self.unimplemented = true;
    }

    /// Says that a message was not of its declared type; generated code does.
    pub fn mismatch(&mut self, mismatch: &crate::message::Mismatch) {
        self.note(format!("a message on `{}` is not of its declared type: {mismatch}", self.topic));
    }

    /// A number that it reads now is not finite.
    fn read_not_finite(&mut self) {
        let now = (self.now, self.value);
        self.not_finite.get_or_insert(now);
    }

    /// What is left for the value from some time on, when it was this.
    fn onwards(&self, value: Option<f64>) -> Reach {
        Reach::onwards(self.trend.filter(|_| !self.turned), value)
    }

    /// Keeps the first problem of a run for its warnings.
    fn note(&mut self, problem: String) {
        self.problem.get_or_insert(problem);
    }
}
