//! A simulator that is a program of its own, in any language, stepped in lock-step by lines of JSON.
//!
//! The runner starts it without a shell, once per worker if it can be reset and once per test otherwise, and ends it
//! with all that it started. The relay sits between the simulator's publishers and its subscribers: what is published
//! with `publish` is there for its subscribers in the same step, what is published with `done` in the next.

mod child;
mod protocol;
mod session;

use std::io::BufReader;
use std::path::Path;
use std::process::{ChildStdin, ChildStdout};

use sesame_plan::CampaignPlan;

use self::child::{Program, Running};
use self::session::{Fault, Session};
use super::{Capabilities, Connect, Place, Transport, TransportError};
use crate::relay::Exchange;
use crate::simulator::Progress;
use crate::time::SimTime;

#[cfg(all(feature = "campaign", target_os = "linux"))]
pub(crate) use self::child::become_simulator;

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

struct Process {
    program: Program,
    connection: Option<Connection>,
    plan: CampaignPlan,
    now: SimTime,
    step: SimTime,
}

struct Connection {
    session: Session<BufReader<ChildStdout>, ChildStdin>,
    running: Running,
}

impl Process {
    fn new(plan: &CampaignPlan, folder: std::path::PathBuf, in_runner: bool) -> Self {
        let sesame_plan::Transport::Process { program, arguments, step_ns } = &plan.simulator.transport else {
            unreachable!("the generator connects each kind of simulator by its own transport")
        };
        Process {
            program: Program { name: program.clone(), arguments: arguments.clone(), folder, in_runner },
            connection: None,
            plan: plan.clone(),
            now: SimTime::ZERO,
            step: SimTime::from_nanos(i64::try_from(*step_ns).unwrap_or(i64::MAX)),
        }
    }

    /// Says what became of the simulator. Whatever it is, it is not talked to again.
    fn explain(&mut self, fault: Fault) -> TransportError {
        let connection = self.connection.take();
        match (fault, connection) {
            (Fault::Gone(awaited), Some(Connection { session, running })) => {
                // It may wait for its input to end.
                drop(session);
                let (how, last_words) = running.post_mortem();
                TransportError::Gone { command: self.program.shown(), how, awaited, last_words }
            }
            (Fault::Gone(_), None) => unreachable!("only a simulator that was there can go"),
            (Fault::Wrong(error), _) => error,
        }
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
        let connection = match &mut self.connection {
            Some(connection) => connection,
            empty => {
                let (running, stdin, stdout) = self.program.start()?;
                let session = Session::new(BufReader::with_capacity(1 << 16, stdout), stdin);
                empty.insert(Connection { session, running })
            }
        };
        connection.running.forget_words();
        let reset = connection.session.reset(&self.plan, seed, self.step, relay);
        reset.map_err(|fault| self.explain(fault))
    }

    fn advance(&mut self, until: SimTime, relay: &mut dyn Exchange) -> Result<Progress, TransportError> {
        let Some(connection) = &mut self.connection else {
            return Err(TransportError::Simulator("it was stepped before it was started".to_owned()));
        };
        if self.now + self.step > until {
            return Ok(Progress::Ended);
        }
        self.now = self.now + self.step;
        let step = connection.session.step(&self.plan, self.now, relay);
        step.map_err(|fault| self.explain(fault))
    }

    fn now(&self) -> SimTime {
        self.now
    }

    fn close(&mut self) {
        if let Some(Connection { session, running }) = self.connection.take() {
            // The end of its input is the simulator's sign to end.
            drop(session);
            running.close();
        }
    }
}

impl Drop for Process {
    fn drop(&mut self) {
        self.close();
    }
}

#[cfg(test)]
mod tests;
