//! The plan of one campaign, as data.
//!
//! The generator writes it as `campaign.plan.json` into the runner's crate, the runner reads it at start-up, and the
//! results repository keeps a copy, so that reports speak in the names of the `.sesame` file. It is the only thing
//! generator and runtime share, hence a crate of its own with no logic beyond look-ups.
//!
//! Guarantees of every plan that was read: every id is in range, every number is finite, every range has `low <= high`
//! ([`CampaignPlan::validate`]). Of a plan written by the generator moreover: times are in seconds of simulation time;
//! every other quantity is in the unit its field, metric or topic declares (the unit on the wire), probabilities are in
//! `0..=1`.

pub mod action;
mod brokers;
mod bus;
mod campaign;
mod compensation;
pub mod condition;
mod confirmation;
mod coverage;
mod exploration;
mod formula;
mod id;
mod lab;
mod lifecycle;
pub mod mavlink;
mod meaning;
mod messages;
mod metric;
mod model;
mod monitor;
mod monitor_program;
mod objective;
mod operation;
mod operation_kind;
pub mod python;
mod ros2;
mod score;
mod search;
mod simlog;
mod simulator;
pub mod stl;
mod stop;
mod system;
mod task;
mod test;
#[cfg(any(test, feature = "testing"))]
pub mod testing;
mod validate;
mod wiring;

pub use brokers::*;
pub use bus::*;
pub use campaign::*;
pub use compensation::*;
pub use confirmation::*;
pub use coverage::*;
pub use exploration::*;
pub use formula::*;
pub use id::*;
pub use lab::*;
pub use lifecycle::*;
pub use messages::*;
pub use metric::*;
pub use model::*;
pub use monitor::*;
pub use monitor_program::NotAlone;
pub use objective::Objective;
pub use operation::*;
pub use operation_kind::*;
pub use ros2::*;
pub use score::*;
pub use search::*;
pub use simlog::*;
pub use simulator::*;
pub use stop::*;
pub use system::*;
pub use task::*;
pub use test::*;
pub use validate::PlanError;
pub use wiring::{Remapping, Renamed};

/// The version of this schema. A runner refuses a plan of another version: both come from one release.
pub const SCHEMA: u32 = 2;
