//! What a generated SESAME test runner links.
//!
//! The core (relay, fuzzing operations, metrics, search) is sans-IO: messages and time in, messages and decisions out.
//! Processes, sockets, files and clocks live in the rooms around it. Nothing here knows the `.sesame` language: a
//! runner gets its campaign as a [`sesame_plan::CampaignPlan`].

// These macros panic where nothing can be written: on a full disk, or after the reader has gone.
#![warn(clippy::print_stdout, clippy::print_stderr)]

pub mod activation;
#[cfg(feature = "report")]
pub mod analysis;
#[cfg(feature = "campaign")]
pub mod campaign;
pub mod changed_files;
#[cfg(feature = "campaign")]
mod cli;
pub mod condition;
pub mod coverage;
mod decimal;
#[cfg(feature = "campaign")]
mod descendants;
pub mod evaluate;
#[cfg(test)]
mod fixture;
pub mod fuzz;
#[cfg(any(feature = "process", feature = "mcap"))]
mod json;
mod last_panic;
pub mod message;
pub mod metric;
pub mod observation;
#[cfg(any(feature = "campaign", feature = "process"))]
mod process_group;
#[cfg(feature = "record")]
pub mod record;
pub mod relay;
#[cfg(feature = "report")]
pub mod report;
pub mod rng;
#[cfg(feature = "campaign")]
mod runner;
pub mod search;
pub mod simulator;
pub mod sspr;
pub mod stl;
pub mod time;
#[cfg(feature = "mcap")]
pub mod trace;
pub mod transport;
pub mod value;
pub mod verdict;
#[cfg(any(feature = "record", feature = "mcap"))]
mod visible;
pub mod wire;

#[cfg(feature = "campaign")]
pub use runner::{Runner, main};
pub use sesame_plan as plan;

/// The version of the interface between generated code and this crate.
pub const GENERATOR_ABI: u32 = 1;

/// Fails to compile when generated code was written for another version of the interface.
#[macro_export]
macro_rules! assert_generator_abi {
    ($abi:literal) => {
        const _: () = assert!(
            $crate::GENERATOR_ABI == $abi,
            "this runner was generated for another version of sesame-runtime: run `sesamec generate` again"
        );
    };
}
