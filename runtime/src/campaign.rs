//! A campaign: ask the search for tests, run them in worker processes, record what was observed, tell the search.
//!
//! The supervisor alone owns search and results. Tests run in workers, so that a simulator or hook that crashes or
//! hangs takes nothing with it. Nothing here depends on how many workers there are: tests are numbered when they are
//! asked for, and told in that order.

mod again;
mod alone;
mod conduct;
mod frames;
mod link;
mod pool;
#[cfg(any(not(unix), test))]
mod port;
mod traced;
mod worker;
mod worker_process;

pub use again::{Further, confirm_further};
pub use alone::{AloneSettings, run_alone};
pub use conduct::{CampaignError, Conducted, Progress, Settings, Unheard, conduct, patience};
pub use link::Address;
pub use pool::{Ended, Job, Pool, PoolError, PoolSettings};
pub use traced::TraceOrder;
pub use worker::serve;
