//! One run of one test.
//!
//! Messages and simulation time go in, messages and an [`Observation`](sesame_base::observation::Observation) come out.
//! The core is sans-IO: the [`relay`], the fuzzing operations ([`fuzz`]), the metrics ([`metric`]).
//! `runtime/clippy.toml` enforces it. The adapters around it expect the lint: [`transport`]s reach simulators, and
//! [`evaluate`] puts one run together.

// These macros panic where nothing can be written: on a full disk, or after the reader has gone.
#![warn(clippy::print_stdout, clippy::print_stderr)]

mod angle;
mod elements;
pub mod evaluate;
#[cfg(feature = "recordings")]
pub mod feed;
pub mod files;
pub mod fuzz;
#[cfg(any(feature = "process", feature = "recordings", feature = "serve"))]
pub mod json;
pub mod message;
pub mod metric;
pub mod monitor;
pub mod panic_capture;
pub mod relay;
pub mod simulator;
pub mod transport;
pub mod value;
pub mod wire;
