//! A simulator that is a program of its own, in any language: stepped in lock-step by lines of JSON, or running freely.
//!
//! The runner starts it without a shell, once per worker if it can be reset and once per test otherwise, and ends it
//! with all that it started. The relay sits between the simulator's publishers and its subscribers: what is published
//! with `publish` is there for its subscribers in the same step, what is published with `done` in the next.

#![expect(
    clippy::disallowed_methods,
    reason = "an adapter: the keeper answers in place of a simulator that cannot be started"
)]

mod beside;
mod fault;
mod free_running;
mod launched;
mod lock_stepped;
mod protocol;
mod session;

#[cfg(target_os = "linux")]
use std::ffi::{OsStr, OsString};
#[cfg(target_os = "linux")]
use std::io::Write as _;
use std::path::{Path, PathBuf};
#[cfg(target_os = "linux")]
use std::process::ExitCode;

use sesame_base::time::SimTime;
use sesame_plan::CampaignPlan;

use self::free_running::FreeRunning;
use self::lock_stepped::LockStepped;
use crate::transport::{Connect, Transport};
#[cfg(target_os = "linux")]
use sesame_lifecycle::launch::{LaunchContext, Launched};
use sesame_lifecycle::{Kept, Program};

pub use self::beside::{Beside, BesideError, beside};

/// Ends all simulators of this process with everything they started. It does the same as closing each of them, but may
/// be called from any thread, even while another one communicates with them.
///
/// Before that, it runs the commands with which spaces end what they launch.
pub fn end_simulators() {
    sesame_lifecycle::launch::terminate_all();
    sesame_lifecycle::end_programs();
}

/// Starts a simulator, or a program in the background that a plan launches, waits until it has ended, and ends
/// everything it leaves behind: what a runner does as the keeper of its worker's programs.
#[cfg(target_os = "linux")]
pub fn keep_simulator(
    worker: u32,
    report: &Path,
    program: &OsStr,
    arguments: &[OsString],
    background: bool,
) -> ExitCode {
    sesame_lifecycle::keep(worker, report, &Kept { program, arguments, background }, refused(background))
}

/// Replaces this process by a simulator, or a program in the background, that ends when its keeper does, even if the
/// keeper is killed while it hangs. Only returns if that fails.
#[cfg(target_os = "linux")]
pub fn become_simulator(keeper: u32, program: &OsStr, arguments: &[OsString], background: bool) -> ExitCode {
    sesame_lifecycle::become_program(keeper, program, arguments, refused(background))
}

/// How the worker is told that a program cannot be started.
#[cfg(target_os = "linux")]
fn refused(background: bool) -> fn(&str) {
    if background { say_refused } else { send_failed }
}

/// Says it as the last words of a program in the background.
#[cfg(target_os = "linux")]
fn say_refused(reason: &str) {
    // If this fails, the worker has ended and reads nothing.
    writeln!(std::io::stderr(), "{reason}").ok();
}

/// Sends `failed` in place of the simulator, which cannot be started.
#[cfg(target_os = "linux")]
fn send_failed(reason: &str) {
    let mut line = b"{\"failed\":".to_vec();
    crate::json::quoted(reason, &mut line);
    line.extend_from_slice(b"}\n");
    // If this fails, the worker has ended and reads nothing.
    let mut output = std::io::stdout();
    output.write_all(&line).and_then(|()| output.flush()).ok();
}

/// Connects to a simulator that is a program and runs in this folder. Only a runner may call this: its own executable
/// becomes the simulator's keeper.
pub fn process(folder: PathBuf) -> Connect {
    Connect { make: connect, folder }
}

fn connect(plan: &CampaignPlan, folder: &Path) -> Box<dyn Transport> {
    // Shown in messages, so without `..`. If the folder does not exist, starting the simulator reports it.
    let folder = folder.canonicalize().unwrap_or_else(|_| folder.to_owned());
    transport(plan, folder, true)
}

/// The transport to the program of a plan, in this folder.
fn transport(plan: &CampaignPlan, folder: PathBuf, in_runner: bool) -> Box<dyn Transport> {
    let Some((program, arguments)) = plan.simulator.program() else {
        unreachable!("the generator connects each kind of simulator by its own transport")
    };
    let launched = Launched::new(plan, LaunchContext { in_runner, ..LaunchContext::of_worker(folder.clone()) });
    let program =
        Program { name: program.to_owned(), arguments: arguments.to_vec(), folder, environment: Vec::new(), in_runner };
    match plan.simulator.step_ns() {
        Some(step) => Box::new(LockStepped::new(
            plan,
            program,
            launched,
            SimTime::from_nanos(i64::try_from(step).unwrap_or(i64::MAX)),
        )),
        None => Box::new(FreeRunning::new(plan, program, launched)),
    }
}

#[cfg(test)]
mod tests;
