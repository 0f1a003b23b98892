//! What a metric says of a runtime monitor: its state, and how well it foresaw what it is there to foresee.
//!
//! A *hazard* is the first moment at which the metric of a requirement is outside its bound. It is *foreseen* if the
//! monitor was in its safe state at that moment, and *missed* otherwise. A *stay* is the time without interruption in
//! one state.

use serde::{Deserialize, Serialize};

use crate::{RequirementId, Trend};

/// What a metric says of a monitor.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(tag = "kind", rename_all = "snake_case")]
pub enum Score {
    /// How many hazards of a requirement it missed: 0 or 1 in a test.
    MissedHazards {
        /// Which requirement.
        requirement: RequirementId,
    },
    /// How many hazards of a requirement it foresaw: 0 or 1 in a test.
    ForeseenHazards {
        /// Which requirement.
        requirement: RequirementId,
    },
    /// How many of its stays in the safe state had no hazard in them.
    FalseAlarms {
        /// The requirement.
        requirement: RequirementId,
        /// A hazard so many seconds after the beginning of a stay is one of the stay, even if it is over; positive.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        within: Option<f64>,
    },
    /// How long before a hazard that it foresaw it went into the safe state, in seconds. No value without one.
    LeadTime {
        /// Which requirement.
        requirement: RequirementId,
    },
    /// The time that it spent in a state, in seconds.
    TimeIn {
        /// Which state.
        state: MonitorState,
    },
    /// How often its state changed.
    Changes,
    /// Its shortest stay in a state that ended, in seconds; no value before its first change.
    ShortestStay,
    /// How often its mitigation was sent.
    Mitigations,
    /// The integrity of its state: 0 for the safe state.
    Integrity,
    /// Whether a part of it holds: 1 or 0. No value as long as that was never known, and after that the last one that
    /// was.
    Holds {
        /// Which part.
        part: MonitorPart,
    },
}

impl Score {
    /// Its name in the language.
    pub const fn name(self) -> &'static str {
        match self {
            Score::MissedHazards { .. } => "missed_hazards",
            Score::ForeseenHazards { .. } => "foreseen_hazards",
            Score::FalseAlarms { .. } => "false_alarms",
            Score::LeadTime { .. } => "lead_time",
            Score::TimeIn { .. } => "time_in",
            Score::Changes => "changes_of",
            Score::ShortestStay => "shortest_stay",
            Score::Mitigations => "mitigations",
            Score::Integrity => "integrity",
            Score::Holds { .. } => "holds",
        }
    }

    /// The requirement whose hazards it counts.
    pub const fn requirement(self) -> Option<RequirementId> {
        match self {
            Score::MissedHazards { requirement }
            | Score::ForeseenHazards { requirement }
            | Score::FalseAlarms { requirement, .. }
            | Score::LeadTime { requirement } => Some(requirement),
            Score::TimeIn { .. }
            | Score::Changes
            | Score::ShortestStay
            | Score::Mitigations
            | Score::Integrity
            | Score::Holds { .. } => None,
        }
    }

    /// The unit of its value; `None` for a plain number.
    pub const fn unit(self) -> Option<&'static str> {
        match self {
            Score::LeadTime { .. } | Score::TimeIn { .. } | Score::ShortestStay => Some("s"),
            Score::MissedHazards { .. }
            | Score::ForeseenHazards { .. }
            | Score::FalseAlarms { .. }
            | Score::Changes
            | Score::Mitigations
            | Score::Integrity
            | Score::Holds { .. } => None,
        }
    }

    /// The only way in which it changes during a run, where that is known.
    pub const fn trend(self) -> Option<Trend> {
        match self {
            Score::MissedHazards { .. }
            | Score::ForeseenHazards { .. }
            | Score::FalseAlarms { .. }
            | Score::TimeIn { .. }
            | Score::Changes
            | Score::Mitigations => Some(Trend::Rising),
            // A test has one hazard of a requirement, so the lead time has one value.
            Score::ShortestStay | Score::LeadTime { .. } => Some(Trend::Falling),
            Score::Integrity | Score::Holds { .. } => None,
        }
    }

    /// Whether it has a value from time zero on.
    pub const fn always_has_a_value(self) -> bool {
        !matches!(self, Score::LeadTime { .. } | Score::ShortestStay | Score::Holds { .. })
    }
}

/// A state of a monitor.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum MonitorState {
    /// The guarantee at this position is the strongest one that holds: position in [`crate::Monitor::guarantees`].
    Guarantee(u32),
    /// No guarantee holds: the safe state.
    Otherwise,
}

/// A part of a monitor that is true, false or unknown.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum MonitorPart {
    /// Evidence: position in [`crate::Monitor::evidence`].
    Evidence(u32),
    /// A demand: position in [`crate::Monitor::demands`].
    Demand(u32),
    /// What a guarantee needs, whether or not a stronger one holds as well: position in
    /// [`crate::Monitor::guarantees`].
    Guarantee(u32),
    /// Whether no guarantee holds; never unknown.
    Otherwise,
}
