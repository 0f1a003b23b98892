//! A campaign: ask the search for tests, run them in worker processes, record what was observed, tell the search.
//!
//! The supervisor alone owns search and results. Tests run in workers, so that a simulator or hook that crashes or
//! hangs takes nothing with it. Nothing here depends on how many workers there are: tests are numbered when they are
//! asked for, and told in that order.

mod conduct;
mod confirmation;
mod link;
mod pool;
#[cfg(any(not(unix), test))]
mod port;
mod protocol;
mod single;
mod traces;
mod worker;
mod worker_process;

pub use conduct::{CampaignError, Conducted, Progress, Settings, Unheard, conduct, patience};
pub use confirmation::{Further, confirm_further};
pub use link::Address;
pub use pool::{Ended, Job, Pool, PoolError, PoolSettings};
pub use single::{AloneSettings, run_alone};
pub use traces::TraceOrder;
pub use worker::serve;
