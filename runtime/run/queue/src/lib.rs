//! Tests of one campaign on many machines: the queue between its supervisor and the agents that run them.
//!
//! The supervisor announces a campaign, puts its tests into a [queue](queue::Queue), and takes results out of it. An
//! agent finds announced campaigns, takes one test after another, and puts in what came of it. What a test is, and how
//! it is run, nobody here knows: jobs and results pass as JSON.
//!
//! The queue redelivers what an agent took and did not finish. What the supervisor concludes from results is decided
//! by [`dispatch`], without a clock and without a connection, and what an agent does with a test by [`intake`]: so the
//! same code can be tried against thousands of imagined machines. [`folder`] and [`nats`] are adapters.
//!
//! Anyone with the [token] can run programs on agents. All messages are signed with it, and no others are read.

pub mod announcement;
pub mod bundle;
pub mod dispatch;
pub mod folder;
pub mod intake;
pub mod message;
#[cfg(feature = "nats")]
pub mod nats;
pub mod queue;
pub mod simulation;
pub mod token;
