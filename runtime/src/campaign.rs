//! A campaign: ask the search for tests, run them in worker processes, record what was observed, tell the search.
//!
//! The supervisor alone owns search and results. Tests run in workers, so that a simulator or hook that crashes or
//! hangs takes nothing with it. Nothing here depends on how many workers there are: tests are numbered when they are
//! asked for, and told in that order.
//!
//! `run` is the campaign, step by step; `evaluator` hands its tests to an `executor` and records the results;
//! `observers` follow the search; `events` tell listeners what happens.

#[cfg(feature = "agents")]
mod agent;
#[cfg(feature = "agents")]
mod agents;
#[cfg(unix)]
mod asked;
mod confirmation;
mod error;
mod evaluator;
mod events;
mod executor;
#[cfg(target_os = "linux")]
mod fork_server;
mod link;
mod numbering;
mod observer;
mod observers;
mod pool;
#[cfg(any(not(unix), test))]
mod port;
mod protocol;
#[cfg(feature = "process")]
pub(crate) mod python;
mod reference;
mod run;
mod settings;
pub(crate) mod silence;
mod single;
mod traces;
mod worker;
mod worker_process;
mod worker_program;

#[cfg(feature = "agents")]
pub use agent::{AgentSettings, work};
#[cfg(feature = "agents")]
pub use agents::Fleet;
#[cfg(feature = "agents")]
pub(crate) use agents::strangers;
pub use confirmation::{Confirmations, confirm_recorded};
pub use error::CampaignError;
pub use events::{CampaignEvent, Listener, Progress};
pub use executor::{Executor, ExecutorError, Job, JobResult, Machines, TraceRequest};
pub use link::Address;
pub use pool::{Pool, PoolSettings, Retries};
pub use reference::Ineffective;
pub use run::{CampaignEnd, Place, run_campaign};
pub use settings::{Settings, default_timeout};
pub use single::{SingleSettings, run_single};
pub use worker::serve;
pub use worker_program::WorkerProgram;

/// Whether the process that started this one carries out the tests of campaigns.
pub(crate) fn carries_out_tests() -> bool {
    #[cfg(unix)]
    return asked::carries_out_tests();
    #[cfg(not(unix))]
    false
}

/// Whether another process forks the workers of this one.
pub(crate) fn forks_workers() -> bool {
    #[cfg(target_os = "linux")]
    return fork_server::ForkServer::of_this_process().is_some();
    #[cfg(not(target_os = "linux"))]
    false
}
