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
#[cfg(target_os = "linux")]
mod keeper;
pub mod launch;
mod limits;
mod output;
pub mod process_group;
mod program;

#[cfg(target_os = "linux")]
pub use keeper::{Kept, become_program, keep, use_keeper};
pub use program::{Alarm, Input, PostMortem, Program, Running, StartError, end_programs};
