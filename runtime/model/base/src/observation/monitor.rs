//! What a runtime monitor did in one run: its decisions, and the evidence that led to them.

use serde::{Deserialize, Serialize};

use sesame_plan::{MonitorState, RequirementId};

/// The most decisions and changes of evidence of one run that are kept, those of all its monitors together.
pub const CHANGES_KEPT: usize = 10_000;

/// What a runtime monitor did in one run. It follows from the run like everything else, and explains the scores of the
/// monitor; it is neither part of the digest nor compared when a run is repeated.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
pub struct MonitorObservation {
    /// Its decisions in order of time; the first one is that of time zero.
    pub decisions: Vec<MonitorDecision>,
    /// Changes of its evidence in order of time. Before its first change, evidence is unknown.
    pub evidence: Vec<EvidenceChange>,
    /// The hazards that it was to foresee, in order of time; see
    /// [`hazards_to_foresee`](sesame_plan::CampaignPlan::hazards_to_foresee).
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub hazards: Vec<MonitorHazard>,
    /// How many later decisions and changes are left out, because a run keeps at most [`CHANGES_KEPT`].
    #[serde(default, skip_serializing_if = "is_zero")]
    pub omitted: u64,
}

#[expect(clippy::trivially_copy_pass_by_ref, reason = "serde calls it with a reference")]
fn is_zero(number: &u64) -> bool {
    *number == 0
}

/// A monitor began with a state, or changed it.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct MonitorDecision {
    /// Simulation time in seconds.
    pub time: f64,
    /// The state from then on.
    pub state: MonitorState,
}

/// A run lost a requirement: from a moment on, nothing could satisfy it.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct MonitorHazard {
    /// Which.
    pub requirement: RequirementId,
    /// Simulation time in seconds.
    pub time: f64,
    /// For how long the monitor had been in its safe state, in seconds; `None` if it was not, so that it missed the
    /// hazard.
    pub lead: Option<f64>,
}

/// The value of a piece of evidence changed.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct EvidenceChange {
    /// Simulation time in seconds.
    pub time: f64,
    /// Which: its position among the monitor's evidence.
    pub evidence: u32,
    /// Its value from then on; `None` is unknown.
    pub holds: Option<bool>,
    /// What changed it.
    pub cause: ChangeCause,
}

/// What changed the value of evidence.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
#[serde(tag = "kind", rename_all = "snake_case")]
pub enum ChangeCause {
    /// A message.
    Message {
        /// The topic's name on the wire.
        topic: String,
        /// The message's number among those published on that topic, from 0.
        index: u64,
    },
    /// Its condition had held for as long as it must.
    Held,
    /// Its topics had been silent for too long.
    Stale,
}

impl ChangeCause {
    /// One word for tables and the database.
    pub const fn word(&self) -> &'static str {
        match self {
            ChangeCause::Message { .. } => "message",
            ChangeCause::Held => "held",
            ChangeCause::Stale => "stale",
        }
    }
}
