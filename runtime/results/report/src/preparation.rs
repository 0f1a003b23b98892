//! What preparatory testing found [SESAME 2023, §3.3]: whether the scenario holds without disturbance, in simulation
//! and in a lab; what the relay adds; whether regression tests show the same on both sides; and whether monitors decide
//! the same there.
//!
//! Each step has its facts, which serialise to JSON as they are. Tables, sentences, text and page are made of them.

mod known;
mod mitm;
mod monitors;
mod null;
mod page;
mod series;
mod sides;
mod tables;
#[cfg(test)]
mod tests;
mod text;

use serde::Serialize;

pub use known::{ExpectationSides, KnownSides, KnownTesting, known};
pub use mitm::{AddedToTopic, Budget, Drift, MitmTesting, Stage, mitm};
pub use monitors::{MonitorTest, MonitorTesting, monitors};
pub use null::{NullTesting, null};
pub use page::{Files, page};
pub use sides::{MetricSides, RequirementSides, Values, VerdictCounts};
pub use text::text;

/// The steps of preparatory testing that were carried out.
#[derive(Debug, Clone, PartialEq, Default, Serialize)]
pub struct Preparation {
    /// The scenario without disturbance (2A).
    #[serde(skip_serializing_if = "Option::is_none")]
    pub null: Option<NullTesting>,
    /// What the relay adds (2B).
    #[serde(skip_serializing_if = "Option::is_none")]
    pub mitm: Option<MitmTesting>,
    /// Regression tests on both sides (2C).
    #[serde(skip_serializing_if = "Option::is_none")]
    pub known: Option<KnownTesting>,
    /// What monitors decide on both sides (2D).
    #[serde(skip_serializing_if = "Option::is_none")]
    pub monitors: Option<MonitorTesting>,
    /// Steps that were left out, each with the reason, in a sentence.
    pub left_out: Vec<String>,
}

impl Preparation {
    /// All that is not as required, a sentence each.
    pub fn objections(&self) -> Vec<&str> {
        let null = self.null.iter().flat_map(|null| &null.objections);
        let mitm = self.mitm.iter().flat_map(|mitm| &mitm.objections);
        let known = self.known.iter().flat_map(|known| &known.objections);
        let monitors = self.monitors.iter().flat_map(|monitors| &monitors.objections);
        null.chain(mitm).chain(known).chain(monitors).map(String::as_str).collect()
    }

    /// Requirements that are not satisfied by regression tests, as these were expected to, as in `R2 by pit`.
    pub(crate) fn unsatisfied(&self) -> Vec<String> {
        self.known.iter().flat_map(KnownTesting::unsatisfied).collect()
    }

    /// The steps that were carried out, and whether each passed.
    pub fn steps(&self) -> Vec<(&'static str, bool)> {
        let null = self.null.as_ref().map(|null| ("null", null.objections.is_empty()));
        let mitm = self.mitm.as_ref().map(|mitm| ("mitm", mitm.objections.is_empty()));
        let known = self.known.as_ref().map(|known| ("known", known.objections.is_empty()));
        let monitors = self.monitors.as_ref().map(|monitors| ("monitors", monitors.objections.is_empty()));
        [null, mitm, known, monitors].into_iter().flatten().collect()
    }
}
