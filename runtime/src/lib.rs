//! What a generated SESAME test runner links: one name for the crates of the runtime, the campaign, and the command
//! line.
//!
//! The crates below this one are re-exported under the names of their rooms, so that a runner, its hooks and its
//! simulator depend on `sesame-runtime` alone. Nothing here knows the `.sesame` language: a runner gets its campaign as
//! a [`sesame_plan::CampaignPlan`].

#![cfg_attr(
    any(feature = "campaign", feature = "standalone"),
    expect(
        clippy::disallowed_methods,
        clippy::disallowed_types,
        reason = "an adapter: it drives processes, and reads and writes files"
    )
)]
// These macros panic where nothing can be written: on a full disk, or after the reader has gone.
#![warn(clippy::print_stdout, clippy::print_stderr)]

#[cfg(feature = "campaign")]
pub mod campaign;
#[cfg(feature = "campaign")]
mod changed_files;
#[cfg(feature = "campaign")]
pub mod cli;
#[cfg(all(feature = "campaign", feature = "process", feature = "mcap"))]
mod fitting;
#[cfg(all(feature = "campaign", feature = "process"))]
mod interpreted;
#[cfg(all(feature = "campaign", feature = "process"))]
mod lab;
#[cfg(any(feature = "campaign", feature = "standalone"))]
mod output;
#[cfg(feature = "campaign")]
mod runner;
#[cfg(feature = "standalone")]
pub mod standalone;
#[cfg(feature = "campaign")]
#[cfg(test)]
mod tampered;
pub mod transport;

#[cfg(feature = "campaign")]
pub use cli::main;
#[cfg(all(feature = "campaign", feature = "process"))]
pub use interpreted::Interpreted;
#[cfg(feature = "campaign")]
pub use runner::Runner;
#[cfg(feature = "campaign")]
pub use sesame_analysis as analysis;
pub use sesame_base::{activation, condition, observation, time, verdict};
#[cfg(feature = "campaign")]
pub use sesame_optimise as optimise;
pub use sesame_plan as plan;
#[cfg(feature = "campaign")]
pub use sesame_record as record;
#[cfg(feature = "mcap")]
pub use sesame_recording as trace;
pub use sesame_relay::{evaluate, fuzz, message, metric, relay, simulator, value, wire};
#[cfg(feature = "campaign")]
pub use sesame_report as report;
pub use sesame_rng as rng;
#[cfg(feature = "campaign")]
pub use sesame_search as search;
#[cfg(feature = "campaign")]
pub use sesame_search::{coverage, sspr};
#[cfg(feature = "simlog-server")]
pub use sesame_simlog::server as simlog_server;

/// The version of the interface between generated code and this crate.
pub const GENERATOR_ABI: u32 = 4;

/// Fails to compile when generated code was written for another version of the interface.
#[macro_export]
macro_rules! assert_generator_abi {
    ($abi:literal) => {
        const _: () = assert!(
            $crate::GENERATOR_ABI == $abi,
            "this runner was generated for another version of sesame-runtime: run `sesamec generate` again"
        );
        // Cargo builds the crate anew where this is another folder: two projects with spaces and campaigns of the same
        // names have runners that cargo cannot tell apart, and would take one for the other.
        const _: ::core::option::Option<&str> = ::core::option_env!("SESAME_RUNNER");
    };
}
