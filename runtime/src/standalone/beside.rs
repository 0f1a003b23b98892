//! The monitor between a runner and a simulator that it starts.

use std::ffi::{OsStr, OsString};
use std::io;
use std::process::{Child, Command, ExitCode, Stdio};
use std::thread;
use std::time::{Duration, Instant};

use sesame_plan::CampaignPlan;
use sesame_relay::monitor::Decided;
use sesame_relay::transport::{Beside, beside};

use crate::output::Failure;
use crate::standalone::show::Shown;

/// How long the simulator may take to exit after the end of its input; the runner gives as long to both.
const EXIT_WITHIN: Duration = Duration::from_millis(800);

/// How often it is looked whether it has.
const LOOK: Duration = Duration::from_millis(5);

pub(super) fn run(
    plan: &CampaignPlan,
    program: &OsStr,
    arguments: &[OsString],
    shown: &mut Shown<'_>,
) -> Result<ExitCode, Failure> {
    let shown_program = program.display();
    let mut simulator = Command::new(program)
        .args(arguments)
        .stdin(Stdio::piped())
        .stdout(Stdio::piped())
        .spawn()
        .map_err(|error| Failure(format!("cannot start the simulator `{shown_program}`: {error}")))?;
    let (Some(to_simulator), Some(from_simulator)) = (simulator.stdin.take(), simulator.stdout.take()) else {
        return Err(Failure(format!("the simulator `{shown_program}` has no streams")));
    };
    let sides = Beside { from_runner: io::stdin(), to_runner: io::stdout(), from_simulator, to_simulator };
    let mut failure = None;
    let mut tell = |run: u32, decided: &Decided| {
        if failure.is_none() {
            failure = shown.record(Some(run), decided).err();
        }
    };
    let ended = beside(plan, sides, &mut tell);
    end(&mut simulator);
    ended?;
    failure.map_or(Ok(ExitCode::SUCCESS), Err)
}

/// Ends the simulator, whose input is closed.
fn end(simulator: &mut Child) {
    let limit = Instant::now() + EXIT_WITHIN;
    while Instant::now() < limit {
        match simulator.try_wait() {
            Ok(None) => thread::sleep(LOOK),
            Ok(Some(_)) | Err(_) => return,
        }
    }
    // It may have ended meanwhile.
    simulator.kill().ok();
    simulator.wait().ok();
}
