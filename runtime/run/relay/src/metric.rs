//! Metrics: numbers computed from the messages of a test.

use std::collections::BTreeMap;
use std::sync::Arc;

use sesame_base::observation::Reach;
use sesame_base::time::SimTime;
use sesame_plan::Trend;

use crate::value::{Text, Value};

mod aggregate;
mod attendance;
mod engine;
mod expression;
#[cfg(test)]
mod group_tests;
mod growth;
mod held;
#[cfg(test)]
mod list_tests;
#[cfg(test)]
mod member_tests;
mod memory;
#[cfg(test)]
mod memory_tests;
mod probe;
mod region;
mod robustness;
mod tally;
#[cfg(test)]
mod tests;

pub use engine::{MetricError, MetricTable, Metrics};
pub(crate) use engine::{Shown, next_mark};
pub use expression::Scene;
pub(crate) use expression::{Given, Moment, holds};
pub(crate) use held::{HeardValues, HeldInputs, Optional, hear};
pub(crate) use memory::Memories;
pub(crate) use probe::sample;
pub use probe::unimplemented_hooks;

/// A user's metric hook as the runtime calls it. Generated code implements it around the typed hook trait.
pub trait Hook {
    /// Before the first message of a run.
    fn on_start(&mut self, ctx: &mut Context);
    /// A message on the metric's `input`th topic, in order of declaration; for a group, [`Context::topic`] is the
    /// member.
    fn on_message(&mut self, input: usize, value: &Value, ctx: &mut Context);
    /// After the last message of a run.
    fn on_end(&mut self, ctx: &mut Context);
}

/// A hook that generated code registers.
#[derive(Debug, Clone, Copy)]
pub struct HookEntry {
    /// The metric's name in the space.
    pub metric: &'static str,
    /// Creates a hook for the metric of this name; every run has its own.
    pub build: fn(&str) -> Box<dyn Hook>,
}

/// The context of a hook, in which it sets its value.
#[derive(Debug, Default)]
pub struct Context {
    now: SimTime,
    /// What the clock of the simulator's stamps showed at time zero, in seconds.
    zero: f64,
    /// The parameters of the space for which the test chose a value.
    scene: Arc<Scene>,
    topic: Text,
    value: Option<f64>,
    series: Vec<(f64, f64)>,
    last_times: BTreeMap<String, SimTime>,
    unimplemented: bool,
    problem: Option<String>,
    /// The only direction in which the value may change, and whether it changed in the other one.
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

    /// What a formula is given besides the values of messages.
    fn given(&self) -> Given<'_> {
        Given { now: self.now, zero: self.zero, scene: &self.scene }
    }

    /// Name on the wire of the message's topic; if the input is a group, the name of the member.
    pub fn topic(&self) -> &str {
        &self.topic
    }

    /// The metric's value so far in this run.
    pub fn value(&self) -> Option<f64> {
        self.value
    }

    /// Sets the metric's value. A value that is not finite is refused, with a warning of the run; from then on
    /// requirements on the metric are decided as if the run had broken off.
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

    /// True the first time, and then whenever at least this much simulation time has passed since it was last true.
    /// This makes a count independent of the rate of messages.
    pub fn every_seconds(&mut self, period: f64) -> bool {
        self.every_seconds_for("", period)
    }

    /// As [`Context::every_seconds`], with a separate clock for each key.
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

    /// Marks this hook as not implemented yet.
    pub fn unimplemented(&mut self) {
        self.unimplemented = true;
    }

    /// Reports that a message was not of its declared type. For generated code.
    pub fn mismatch(&mut self, mismatch: &crate::message::Mismatch) {
        self.note(format!("a message on `{}` is not of its declared type: {mismatch}", self.topic));
    }

    /// It has just read a number that is not finite.
    fn read_not_finite(&mut self) {
        let now = (self.now, self.value);
        self.not_finite.get_or_insert(now);
    }

    /// The values that it can still reach from a time on at which it had this value.
    fn onwards(&self, value: Option<f64>) -> Reach {
        Reach::onwards(self.trend.filter(|_| !self.turned), value)
    }

    /// Keeps the first problem of a run for its warnings.
    fn note(&mut self, problem: String) {
        self.problem.get_or_insert(problem);
    }
}
