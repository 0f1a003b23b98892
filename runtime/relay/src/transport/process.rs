//! A simulator that is a program of its own, in any language, stepped in lock-step by lines of JSON.
//!
//! The runner starts it without a shell, once per worker if it can be reset and once per test otherwise, and ends it
//! with all that it started. The relay sits between the simulator's publishers and its subscribers: what is published
//! with `publish` is there for its subscribers in the same step, what is published with `done` in the next.

mod child;
#[cfg(target_os = "linux")]
mod keeper;
mod protocol;
mod session;
mod words;

use std::io::BufReader;
use std::mem;
use std::path::{Path, PathBuf};
use std::process::ChildStdout;
use std::time::{Duration, Instant};

use sesame_base::time::SimTime;
use sesame_plan::CampaignPlan;

use self::child::{Input, PostMortem, Program, Running};
use self::session::{Fault, Session};
use crate::relay::Exchange;
use crate::simulator::Progress;
use crate::transport::{Aside, Capabilities, Connect, Place, Transport, TransportError};

pub use self::child::end_simulators;
#[cfg(target_os = "linux")]
pub use self::keeper::{become_simulator, keep_simulator};

/// Reaches a simulator that is a program: `runner` is the folder of the runner's crate, `space` the folder of the
/// `.sesame` file as seen from there. To be called by a runner only: its program keeps watch over the simulator.
pub const fn process(runner: &'static str, space: &'static str) -> Connect {
    Connect { make: connect, place: Place { runner, space } }
}

fn connect(plan: &CampaignPlan, place: Place) -> Box<dyn Transport> {
    let folder = Path::new(place.runner).join(place.space);
    // Shown in messages, so without the way there and back; one that is not there is reported when it is needed.
    let folder = folder.canonicalize().unwrap_or(folder);
    Box::new(Process::new(plan, folder, true))
}

/// How long the end of a run waits for an answer too many: two steps, but no less and no more than this.
const SHORTEST_WAIT: Duration = Duration::from_millis(1);
const LONGEST_WAIT: Duration = Duration::from_millis(100);

struct Process {
    program: Program,
    connection: Option<Connection>,
    plan: CampaignPlan,
    now: SimTime,
    step: SimTime,
    aside: Aside,
}

struct Connection {
    // Dropped first: the end of its input is the simulator's sign to end.
    session: Session<BufReader<ChildStdout>, Input>,
    running: Running,
    /// Steps of this run, and the time that passed since its first began.
    steps: u32,
    stepping: Instant,
}

impl Process {
    fn new(plan: &CampaignPlan, folder: PathBuf, in_runner: bool) -> Self {
        let sesame_plan::Transport::Process { program, arguments, step_ns } = &plan.simulator.transport else {
            unreachable!("the generator connects each kind of simulator by its own transport")
        };
        Process {
            program: Program { name: program.clone(), arguments: arguments.clone(), folder, in_runner },
            connection: None,
            plan: plan.clone(),
            now: SimTime::ZERO,
            step: SimTime::from_nanos(i64::try_from(*step_ns).unwrap_or(i64::MAX)),
            aside: Aside::default(),
        }
    }

    /// Says what became of the simulator. Whatever it is, it is not talked to again.
    fn explain(&mut self, fault: Fault) -> TransportError {
        let connection = self.connection.take();
        match (fault, connection) {
            (Fault::Gone(awaited), Some(Connection { session, running, .. })) => {
                // It may wait for its input to end.
                drop(session);
                let PostMortem { how, last_words, killed } = running.post_mortem();
                self.aside.killed |= killed;
                TransportError::Gone { command: self.program.shown(), how, awaited, last_words }
            }
            (Fault::Gone(_), None) => unreachable!("only a simulator that was there can go"),
            (Fault::Wrong(error), _) => error,
        }
    }

    /// Begins a run with the process that there is, or with a new one.
    fn begin(&mut self, seed: u64, relay: &mut dyn Exchange) -> Result<(), Fault> {
        let connection = match &mut self.connection {
            Some(connection) => connection,
            empty => {
                let (running, input, output) = self.program.start()?;
                let session = Session::new(BufReader::with_capacity(1 << 16, output), input);
                empty.insert(Connection { session, running, steps: 0, stepping: Instant::now() })
            }
        };
        connection.running.forget_words();
        connection.session.reset(&self.plan, seed, self.step, relay)?;
        connection.steps = 0;
        connection.stepping = Instant::now();
        Ok(())
    }

    /// Whether the simulator has answered this run's reset.
    fn is_ready(&self) -> bool {
        self.connection.as_ref().is_some_and(|connection| connection.session.is_ready())
    }

    /// Insists that the simulator says nothing more at the end of its run. An answer too many would be taken for one to the
    /// next run's orders: it is this run's fault, and not the next one's.
    fn nothing_is_waiting(&mut self) -> Result<(), TransportError> {
        let Some(Connection { session, steps, stepping, .. }) = &mut self.connection else { return Ok(()) };
        // Answers that come one too early all through a run end with one that is not there yet: it takes a step.
        let step = stepping.elapsed() / (*steps).max(1);
        if !waiting::for_a_while(session.input(), (2 * step).clamp(SHORTEST_WAIT, LONGEST_WAIT)) {
            return Ok(());
        }
        let error = session.answer_too_many();
        Err(self.explain(Fault::Wrong(error)))
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
        // What a process does that was used before may be the fault of the run before: this run begins anew then.
        if let Some(Connection { session, .. }) = &mut self.connection {
            let late = waiting::for_a_while(session.input(), Duration::ZERO).then(|| session.answer_too_many().into());
            let fault = match late {
                Some(late) => late,
                None => match self.begin(seed, relay) {
                    Ok(()) => return Ok(()),
                    Err(fault) if self.is_ready() => return Err(self.explain(fault)),
                    Err(fault) => fault,
                },
            };
            let killed = self.aside.killed;
            let why = self.explain(fault);
            // That it was killed meanwhile does not touch this run.
            self.aside.killed = killed;
            let what = "the simulator was started anew before this test, for what it did after the one before";
            self.aside.notes.push(format!("{what}: {why}"));
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
            self.nothing_is_waiting()?;
        }
        Ok(progress)
    }

    fn now(&self) -> SimTime {
        self.now
    }

    fn close(&mut self) {
        self.connection = None;
    }

    fn aside(&mut self) -> Aside {
        mem::take(&mut self.aside)
    }
}

/// Whether a simulator has said something that was not read.
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
        // A pipe that cannot be looked into will be read, and that tells.
        poll(&mut pipes, time.try_into().ok().as_ref()).is_ok() && pipes[0].revents().contains(PollFlags::IN)
    }

    /// The standard library cannot look into a pipe: what waits there is noticed at the next reset.
    #[cfg(not(unix))]
    fn in_the_pipe(_: &ChildStdout, _: Duration) -> bool {
        false
    }
}

#[cfg(test)]
mod tests;
