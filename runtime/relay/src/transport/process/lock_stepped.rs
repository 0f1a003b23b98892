//! A program that is stepped in lock-step: it waits for each step, and says when the step is done.

#![expect(
    clippy::disallowed_methods,
    reason = "an adapter: it waits for a program, and measures how long its steps take"
)]

use std::io::BufReader;
use std::mem;
use std::process::ChildStdout;
use std::time::{Duration, Instant};

use sesame_base::time::SimTime;
use sesame_plan::CampaignPlan;

use crate::lifecycle::{Input, Program, Running};
use crate::relay::Exchange;
use crate::simulator::Progress;
use crate::transport::process::fault::{explain, note_restart};
use crate::transport::process::session::{Fault, Session};
use crate::transport::{Capabilities, Incidents, Transport, TransportError};

/// How long the end of a run waits for a surplus answer: two steps, within these limits.
const SHORTEST_WAIT: Duration = Duration::from_millis(1);
const LONGEST_WAIT: Duration = Duration::from_millis(100);

/// A program that is stepped in lock-step.
pub(super) struct LockStepped {
    program: Program,
    connection: Option<Connection>,
    pub(super) plan: CampaignPlan,
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

impl LockStepped {
    pub(super) fn new(plan: &CampaignPlan, program: Program, step: SimTime) -> Self {
        LockStepped {
            program,
            connection: None,
            plan: plan.clone(),
            now: SimTime::ZERO,
            step,
            incidents: Incidents::default(),
        }
    }

    /// Closes the connection, and returns the process.
    fn disconnect(&mut self) -> Option<Running> {
        self.connection.take().map(|Connection { session, running, .. }| {
            // The simulator may be waiting for the end of its input.
            drop(session);
            running
        })
    }

    /// The error for a fault. The connection is closed: a simulator is never used after a fault.
    fn explain(&mut self, fault: Fault) -> TransportError {
        let running = self.disconnect();
        explain(&self.program, running, fault, &mut self.incidents)
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

impl Transport for LockStepped {
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
            let running = self.disconnect();
            note_restart(&self.program, running, fault, &mut self.incidents);
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
