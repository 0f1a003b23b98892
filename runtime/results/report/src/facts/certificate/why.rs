//! Why a guarantee held or did not: the smallest evidence that decided, with what had caused its values.

use serde::Serialize;

use sesame_base::observation::ChangeCause;
use sesame_monitor::gate::Leaf;
use sesame_monitor::why::{Why, sentence};
use sesame_monitor::{State, Truth};
use sesame_plan::Monitor;

use crate::facts::certificate::history::Values;

/// Why a guarantee held, or did not.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct WhyReport {
    /// The guarantee.
    pub guarantee: String,
    /// Its integrity.
    pub integrity: u32,
    /// `true`, `false` or `unknown`.
    pub holds: String,
    /// The evidence that decided: whatever all other evidence was, the guarantee would have been the same.
    pub because: Vec<BecauseReport>,
    /// Whether no smaller set of evidence would have decided; else none of it can be left out, but another set may be
    /// smaller.
    pub smallest: bool,
    /// All of it in a sentence.
    pub sentence: String,
}

/// Evidence that decided.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct BecauseReport {
    /// The monitor to which it belongs.
    pub monitor: String,
    /// Its name.
    pub evidence: String,
    /// Its value: `true`, `false` or `unknown`.
    pub is: String,
    /// Since when, in seconds.
    pub since: f64,
    /// What made it so; `None` if it has been unknown from the beginning.
    pub cause: Option<ChangeCause>,
    /// The demands through which it matters, beginning at the monitor of the guarantee, each with the monitor that has
    /// it, as in `transport.sees`. Empty for that monitor's own evidence.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub through: Vec<String>,
}

/// A reason with names, at a moment with these values.
pub(super) fn explained(why: &Why, values: &Values<'_>) -> WhyReport {
    let monitors = &values.plan().monitors;
    let guarantee = &monitors[why.monitor.index()].guarantees[why.guarantee as usize];
    let because = why.because.iter().filter_map(|cause| {
        // Reasons go through demands to evidence.
        let Leaf::Evidence(at) = cause.leaf else { return None };
        let monitor = &monitors[cause.monitor.index()];
        let last = values.last(cause.monitor, at);
        let through = cause.through.iter().map(|&(monitor, at)| {
            let monitor = &monitors[monitor.index()];
            format!("{}.{}", monitor.name, monitor.demands[at as usize].name)
        });
        Some(BecauseReport {
            monitor: monitor.name.clone(),
            evidence: monitor.evidence[at as usize].name.clone(),
            is: cause.truth.to_string(),
            since: last.map_or(0.0, |change| change.time),
            cause: last.map(|change| change.cause.clone()),
            through: through.collect(),
        })
    });
    WhyReport {
        guarantee: guarantee.name.clone(),
        integrity: guarantee.integrity,
        holds: why.truth.to_string(),
        because: because.collect(),
        smallest: why.smallest,
        sentence: sentence(why, monitors),
    }
}

/// The name of a state, and its integrity: 0 of the safe state.
pub(super) fn named(monitor: &Monitor, state: State) -> (&str, u32) {
    match state {
        State::Guarantee(at) => {
            let guarantee = &monitor.guarantees[at as usize];
            (&guarantee.name, guarantee.integrity)
        }
        State::Safe => (&monitor.otherwise.name, 0),
    }
}

/// The value of evidence in results.
pub(super) fn word(holds: Option<bool>) -> String {
    holds.map_or(Truth::Unknown, Truth::from).to_string()
}

/// What changed evidence, in words.
pub(crate) fn cause_text(cause: &ChangeCause) -> String {
    match cause {
        ChangeCause::Message { topic, index } => format!("message {index} of {topic}"),
        ChangeCause::Held => "its condition had held for long enough".to_owned(),
        ChangeCause::Stale => "its topics had been silent for too long".to_owned(),
    }
}

impl BecauseReport {
    /// As in `` `far` false since 9.600 s: message 95 of cell/gap ``. Evidence of another monitor than `explained` has
    /// its monitor's name.
    pub(crate) fn words(&self, explained: &str) -> String {
        let of = if self.monitor == explained { String::new() } else { format!(" of `{}`", self.monitor) };
        let name = format!("`{}`{of} {}", self.evidence, self.is);
        match &self.cause {
            Some(cause) => format!("{name} since {:.3} s: {}", self.since, cause_text(cause)),
            None => format!("{name} from the beginning"),
        }
    }
}
