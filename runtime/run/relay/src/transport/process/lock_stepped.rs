//! A program that is stepped in lock-step: it waits for each step, and says when the step is done.

#![expect(
    clippy::disallowed_methods,
    reason = "an adapter: it waits for a program, and measures how long its steps take"
)]

use std::io::{self, BufReader, Read};
use std::mem;
use std::process::ChildStdout;
use std::sync::atomic::Ordering;
use std::time::{Duration, Instant};

use sesame_base::time::SimTime;
use sesame_plan::CampaignPlan;

use crate::relay::Exchange;
use crate::simulator::Progress;
use crate::transport::process::fault::{explain, note_restart};
use crate::transport::process::launched::health;
use crate::transport::process::session::{Fault, Session};
use crate::transport::{Capabilities, Incidents, Transport, TransportError};
use sesame_lifecycle::launch::Launched;
use sesame_lifecycle::{Alarm, Input, Program, Running};

/// How long the end of a run waits for a surplus answer: two steps, within these limits.
const SHORTEST_WAIT: Duration = Duration::from_millis(1);
const LONGEST_WAIT: Duration = Duration::from_millis(100);

/// A program that is stepped in lock-step.
pub(super) struct LockStepped {
    program: Program,
    connection: Option<Connection>,
    // Dropped after the simulator, which may need it to the end.
    pub(super) launched: Launched,
    pub(super) plan: CampaignPlan,
    now: SimTime,
    step: SimTime,
    /// The least and the most that the end of a run waits for a surplus answer. Tests have limits of their own.
    pub(super) surplus: (Duration, Duration),
    incidents: Incidents,
}

struct Connection {
    // Dropped first: the end of its input tells the simulator to exit.
    session: Session<BufReader<Attended>, Input>,
    running: Running,
    /// The steps of this run, and when its first step began.
    steps: u32,
    stepping: Instant,
}

impl LockStepped {
    pub(super) fn new(plan: &CampaignPlan, program: Program, launched: Launched, step: SimTime) -> Self {
        LockStepped {
            program,
            launched,
            connection: None,
            plan: plan.clone(),
            now: SimTime::ZERO,
            step,
            surplus: (SHORTEST_WAIT, LONGEST_WAIT),
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

    /// The error for a fault. The connection is closed: a simulator is never used after a fault. If a launched program
    /// has ended, that comes first: the simulator may have failed for want of it.
    fn explain(&mut self, fault: Fault) -> TransportError {
        let ended = health(&mut self.launched, &mut self.incidents).err();
        let running = self.disconnect();
        let error = match ended {
            Some(ended) => ended,
            None => explain(&self.program, running, fault, &mut self.incidents),
        };
        self.close();
        error
    }

    /// Begins a run with the existing process, or with a new one.
    fn begin(&mut self, seed: u64, relay: &mut dyn Exchange) -> Result<(), Fault> {
        let connection = match &mut self.connection {
            Some(connection) => connection,
            empty => {
                let scene = relay.arguments();
                self.launched.start_first(seed, scene, "after its reset").map_err(TransportError::from)?;
                let (running, input, output) = self.program.start().map_err(TransportError::from)?;
                let output = Attended { pipe: output, alarm: self.launched.alarm() };
                let session = Session::new(BufReader::with_capacity(1 << 16, output), input);
                empty.insert(Connection { session, running, steps: 0, stepping: Instant::now() })
            }
        };
        connection.running.clear_output();
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
        let (least, most) = self.surplus;
        if !waiting::for_a_while(session.input(), (2 * step).clamp(least, most)) {
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
        if !self.capabilities().resets || !self.launched.are_of(relay.arguments()) {
            self.close();
        }
        // A fault of a process that was used before may belong to the previous run, so this run starts a new process.
        if let Some(Connection { session, .. }) = &mut self.connection {
            let late =
                || waiting::for_a_while(session.input(), Duration::ZERO).then(|| session.surplus_answer().into());
            let ended = health(&mut self.launched, &mut Incidents::default()).err();
            let fault = match ended.map(Fault::Wrong).or_else(late) {
                Some(fault) => fault,
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
            if let Err(ended) = health(&mut self.launched, &mut self.incidents) {
                return Err(self.explain(ended.into()));
            }
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
        self.launched.end();
    }

    fn incidents(&mut self) -> Incidents {
        self.incidents.notes.append(&mut self.launched.take_notes());
        mem::take(&mut self.incidents)
    }
}

/// The output of a simulator. It ends, too, when a launched program has ended: the simulator may wait for it for ever.
struct Attended {
    pipe: ChildStdout,
    alarm: Option<Alarm>,
}

impl Read for Attended {
    fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
        if let Some(alarm) = &self.alarm {
            while !waiting::or_ended(&self.pipe, LONGEST_WAIT) {
                if alarm.load(Ordering::Relaxed) {
                    return Ok(0);
                }
            }
        }
        self.pipe.read(buffer)
    }
}

/// Whether a simulator has sent something that was not read.
mod waiting {
    use std::io::BufReader;
    use std::process::ChildStdout;
    use std::time::Duration;

    /// Whether it has, or does so within this time.
    pub(super) fn for_a_while(input: &BufReader<super::Attended>, time: Duration) -> bool {
        !input.buffer().is_empty() || system::in_the_pipe(&input.get_ref().pipe, time)
    }

    /// Whether a read does not wait for longer than this: something has come, or the pipe is closed.
    pub(super) fn or_ended(pipe: &ChildStdout, time: Duration) -> bool {
        system::in_the_pipe_or_closed(pipe, time)
    }

    #[cfg(unix)]
    mod system {
        use rustix::event::{PollFd, PollFlags, poll};

        use super::{ChildStdout, Duration};

        pub(super) fn in_the_pipe(pipe: &ChildStdout, time: Duration) -> bool {
            polled(pipe, time).is_some_and(|events| events.contains(PollFlags::IN))
        }

        pub(super) fn in_the_pipe_or_closed(pipe: &ChildStdout, time: Duration) -> bool {
            polled(pipe, time).is_none_or(|events| !events.is_empty())
        }

        /// If polling fails, so will reading.
        fn polled(pipe: &ChildStdout, time: Duration) -> Option<PollFlags> {
            let mut pipes = [PollFd::new(pipe, PollFlags::IN)];
            poll(&mut pipes, time.try_into().ok().as_ref()).ok()?;
            Some(pipes[0].revents())
        }
    }

    /// The standard library cannot poll a pipe: what is in it is noticed at the next reset.
    #[cfg(not(unix))]
    mod system {
        use super::{ChildStdout, Duration};

        pub(super) fn in_the_pipe(_: &ChildStdout, _: Duration) -> bool {
            false
        }

        pub(super) fn in_the_pipe_or_closed(_: &ChildStdout, _: Duration) -> bool {
            true
        }
    }
}
