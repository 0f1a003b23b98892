//! The life of a program and of everything that it starts: from its start to the end of its last process.
//!
//! Nothing here knows what a program says or is told: a transport gets its standard input and output, and decides when
//! the program is started and closed. Processes are ended reliably on Linux and as well as possible elsewhere:
//! [`process_group`] ends the processes that stay in a group, [`descendants`] also finds those that left it.

#![expect(
    clippy::disallowed_methods,
    clippy::disallowed_types,
    reason = "an adapter: it starts, watches and ends processes"
)]

pub mod descendants;
#[cfg(all(feature = "process", target_os = "linux"))]
mod keeper;
#[cfg(feature = "process")]
pub mod launch;
#[cfg(feature = "process")]
mod limits;
#[cfg(feature = "process")]
mod output;
pub mod process_group;
#[cfg(feature = "process")]
mod program;

#[cfg(all(feature = "process", target_os = "linux"))]
pub(crate) use keeper::{Kept, become_program, keep};
#[cfg(feature = "process")]
pub(crate) use program::{Alarm, Input, PostMortem, Program, Running, StartError, end_programs};
