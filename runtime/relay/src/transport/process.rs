//! A simulator that is a program of its own, in any language: stepped in lock-step by lines of JSON, or running freely.
//!
//! The runner starts it without a shell, once per worker if it can be reset and once per test otherwise, and ends it
//! with all that it started. The relay sits between the simulator's publishers and its subscribers: what is published
//! with `publish` is there for its subscribers in the same step, what is published with `done` in the next.

#![expect(
    clippy::disallowed_methods,
    reason = "an adapter: it waits for a program, and measures how long its steps take"
)]

mod free_running;
mod protocol;
mod session;

#[cfg(target_os = "linux")]
use std::ffi::{OsStr, OsString};
use std::io::BufReader;
#[cfg(target_os = "linux")]
use std::io::Write as _;
use std::mem;
use std::path::{Path, PathBuf};
use std::process::ChildStdout;
#[cfg(target_os = "linux")]
use std::process::ExitCode;
use std::time::{Duration, Instant};

use sesame_base::time::SimTime;
use sesame_plan::CampaignPlan;

use self::free_running::FreeRunning;
use self::session::{Fault, Session};
use crate::lifecycle::{self, Input, PostMortem, Program, Running, StartError};
use crate::relay::Exchange;
use crate::simulator::Progress;
use crate::transport::{Capabilities, Connect, Incidents, Place, Transport, TransportError};

/// Ends all simulators of this process with everything they started. It does the same as closing each of them, but may
/// be called from any thread, even while another one communicates with them.
pub fn end_simulators() {
    lifecycle::end_programs();
}

/// Starts a simulator, waits until it has ended, and ends everything it leaves behind: what a runner does as the keeper
/// of its worker's simulator.
#[cfg(target_os = "linux")]
pub fn keep_simulator(worker: u32, report: &Path, program: &OsStr, arguments: &[OsString]) -> ExitCode {
    lifecycle::keep(worker, report, program, arguments, send_failed)
}

/// Replaces this process by a simulator that ends when its keeper does, even if the keeper is killed while the
/// simulator hangs. Only returns if that fails.
#[cfg(target_os = "linux")]
pub fn become_simulator(keeper: u32, program: &OsStr, arguments: &[OsString]) -> ExitCode {
    lifecycle::become_program(keeper, program, arguments, send_failed)
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

/// Connects to a simulator that is a program: `runner` is the folder of the runner's crate, `space` the folder of the
/// `.sesame` file, relative to it. Only a runner may call this: its own executable becomes the simulator's keeper.
pub const fn process(runner: &'static str, space: &'static str) -> Connect {
    Connect { make: connect, place: Place { runner, space } }
}

fn connect(plan: &CampaignPlan, place: Place) -> Box<dyn Transport> {
    let folder = Path::new(place.runner).join(place.space);
    // Shown in messages, so without `..`. If the folder does not exist, starting the simulator reports it.
    let folder = folder.canonicalize().unwrap_or(folder);
    transport(plan, folder, true)
}

/// The transport to the program of a plan, in this folder.
fn transport(plan: &CampaignPlan, folder: PathBuf, in_runner: bool) -> Box<dyn Transport> {
    let sesame_plan::Transport::Process { program, arguments, step_ns } = &plan.simulator.transport else {
        unreachable!("the generator connects each kind of simulator by its own transport")
    };
    let program = Program { name: program.clone(), arguments: arguments.clone(), folder, in_runner };
    match step_ns {
        Some(step) => {
            Box::new(Process::new(plan, program, SimTime::from_nanos(i64::try_from(*step).unwrap_or(i64::MAX))))
        }
        None => Box::new(FreeRunning::new(plan, program)),
    }
}

/// The error about a simulator that closed its output although something was awaited.
fn disconnected(
    program: &Program,
    running: Option<Running>,
    awaited: String,
    incidents: &mut Incidents,
) -> TransportError {
    let Some(running) = running else { unreachable!("only a connected simulator can disconnect") };
    let PostMortem { how, last_lines, killed } = running.post_mortem();
    incidents.killed |= killed;
    TransportError::Disconnected { command: program.shown(), how, awaited, last_lines }
}

/// The note about a simulator that was restarted, because of a fault that may belong to the previous test.
fn restarted(reason: &TransportError) -> String {
    format!("the simulator was restarted before this test, because of a fault after the previous one: {reason}")
}

/// How long the end of a run waits for a surplus answer: two steps, within these limits.
const SHORTEST_WAIT: Duration = Duration::from_millis(1);
const LONGEST_WAIT: Duration = Duration::from_millis(100);

/// A program that is stepped in lock-step.
struct Process {
    program: Program,
    connection: Option<Connection>,
    plan: CampaignPlan,
    now: SimTime,
    step: SimTime,
    incidents: Incidents,
}

struct Connection {
    // Dropped first: the end of its input tells the simulator to exit.
    session: Session<BufReader<ChildStdout>, Input>,
    running: Running,
    /// The steps of this run, and when its first step began.
    steps: u32,
    stepping: Instant,
}

impl Process {
    fn new(plan: &CampaignPlan, program: Program, step: SimTime) -> Self {
        Process {
            program,
            connection: None,
            plan: plan.clone(),
            now: SimTime::ZERO,
            step,
            incidents: Incidents::default(),
        }
    }

    /// The error for a fault. The connection is closed: a simulator is never used after a fault.
    fn explain(&mut self, fault: Fault) -> TransportError {
        let running = self.connection.take().map(|Connection { session, running, .. }| {
            // The simulator may be waiting for the end of its input.
            drop(session);
            running
        });
        match fault {
            Fault::Disconnected(awaited) => disconnected(&self.program, running, awaited, &mut self.incidents),
            Fault::Wrong(error) => error,
        }
    }

    /// Begins a run with the existing process, or with a new one.
    fn begin(&mut self, seed: u64, relay: &mut dyn Exchange) -> Result<(), Fault> {
        let connection = match &mut self.connection {
            Some(connection) => connection,
            empty => {
                let (running, input, output) = self.program.start().map_err(TransportError::from)?;
                let session = Session::new(BufReader::with_capacity(1 << 16, output), input);
                empty.insert(Connection { session, running, steps: 0, stepping: Instant::now() })
            }
        };
        connection.running.clear_stderr();
        connection.session.reset(&self.plan, seed, self.step, relay)?;
        connection.steps = 0;
        connection.stepping = Instant::now();
        Ok(())
    }

    /// Whether the simulator has answered this run's reset.
    fn is_ready(&self) -> bool {
        self.connection.as_ref().is_some_and(|connection| connection.session.is_ready())
    }

    /// Checks that the simulator sends nothing more at the end of its run. A surplus answer would be taken for an
    /// answer to the first request of the next run, although it is an error of this run.
    fn check_no_surplus_answer(&mut self) -> Result<(), TransportError> {
        let Some(Connection { session, steps, stepping, .. }) = &mut self.connection else { return Ok(()) };
        // If every answer of a run comes one request too early, the surplus one is sent only after the last step's
        // computation.
        let step = stepping.elapsed() / (*steps).max(1);
        if !waiting::for_a_while(session.input(), (2 * step).clamp(SHORTEST_WAIT, LONGEST_WAIT)) {
            return Ok(());
        }
        let error = session.surplus_answer();
        Err(self.explain(Fault::Wrong(error)))
    }
}

impl From<StartError> for TransportError {
    fn from(StartError { command, folder, reason }: StartError) -> Self {
        TransportError::NotStarted { command, folder, reason }
    }
}

impl Transport for Process {
    fn capabilities(&self) -> Capabilities {
        let resets = self.connection.as_ref().is_some_and(|connection| connection.session.resets());
        Capabilities { lock_stepped: true, resets }
    }

    fn reset(&mut self, seed: u64, relay: &mut dyn Exchange) -> Result<(), TransportError> {
        self.now = SimTime::ZERO;
        if !self.capabilities().resets {
            self.close();
        }
        // A fault of a process that was used before may belong to the previous run, so this run starts a new process.
        if let Some(Connection { session, .. }) = &mut self.connection {
            let late = waiting::for_a_while(session.input(), Duration::ZERO).then(|| session.surplus_answer().into());
            let fault = match late {
                Some(late) => late,
                None => match self.begin(seed, relay) {
                    Ok(()) => return Ok(()),
                    Err(fault) if self.is_ready() => return Err(self.explain(fault)),
                    Err(fault) => fault,
                },
            };
            let killed = self.incidents.killed;
            let why = self.explain(fault);
            // That the old process was killed does not concern this run.
            self.incidents.killed = killed;
            self.incidents.notes.push(restarted(&why));
        }
        self.begin(seed, relay).map_err(|fault| self.explain(fault))
    }

    fn advance(&mut self, until: SimTime, relay: &mut dyn Exchange) -> Result<Progress, TransportError> {
        let Some(connection) = &mut self.connection else {
            return Err(TransportError::Simulator("it was stepped before it was started".to_owned()));
        };
        let mut progress = Progress::Ended;
        if self.now + self.step <= until {
            self.now = self.now + self.step;
            connection.steps += 1;
            let step = connection.session.step(&self.plan, self.now, relay);
            progress = step.map_err(|fault| self.explain(fault))?;
        }
        if progress == Progress::Ended {
            self.check_no_surplus_answer()?;
        }
        Ok(progress)
    }

    fn now(&self) -> SimTime {
        self.now
    }

    fn close(&mut self) {
        self.connection = None;
    }

    fn incidents(&mut self) -> Incidents {
        mem::take(&mut self.incidents)
    }
}

/// Whether a simulator has sent something that was not read.
mod waiting {
    use std::io::BufReader;
    use std::process::ChildStdout;
    use std::time::Duration;

    /// Whether it has, or does so within this time.
    pub(super) fn for_a_while(input: &BufReader<ChildStdout>, time: Duration) -> bool {
        !input.buffer().is_empty() || in_the_pipe(input.get_ref(), time)
    }

    #[cfg(unix)]
    fn in_the_pipe(pipe: &ChildStdout, time: Duration) -> bool {
        use rustix::event::{PollFd, PollFlags, poll};

        let mut pipes = [PollFd::new(pipe, PollFlags::IN)];
        // If polling fails, so will reading.
        poll(&mut pipes, time.try_into().ok().as_ref()).is_ok() && pipes[0].revents().contains(PollFlags::IN)
    }

    /// The standard library cannot poll a pipe: what is in it is noticed at the next reset.
    #[cfg(not(unix))]
    fn in_the_pipe(_: &ChildStdout, _: Duration) -> bool {
        false
    }
}

#[cfg(test)]
mod tests;
