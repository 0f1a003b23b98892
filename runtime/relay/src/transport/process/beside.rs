//! A monitor as a process of its own beside a simulator that is a program: between the runner and the simulator, it
//! passes the protocol through and adds what the monitor publishes.
//!
//! For the runner it is a part of the simulator: it subscribes to the topics of evidence, and publishes states and
//! mitigation, so operations disturb both as for any other part. It hears what is delivered and nothing else.
//!
//! In lock-step, what a monitor decides is published within the same step: before the simulator hears the message that
//! caused it, the relay has what the monitor says about it. What the simulator sends with the end of a step goes to the
//! relay just before it, so that the monitor hears it at once. The simulator still receives it with the next step.

mod freely;
mod hearing;
mod in_step;
mod request;

use std::io::{BufReader, Read, Write};
use std::sync::mpsc::{Receiver, RecvTimeoutError, SyncSender, sync_channel};
use std::thread;
use std::time::Duration;

use sesame_plan::CampaignPlan;

use self::hearing::Hearing;
use self::request::Request;
use super::protocol::{LINE_LIMIT, Line, Read as ReadLine, Ready, SimulatorMessage, read_line};
use crate::metric::MetricTable;
use crate::monitor::Decided;
use crate::transport::TransportError;
use crate::wire::WireTable;

/// How many lines are read ahead of each side.
const READ_AHEAD: usize = 1 << 12;

/// Why a monitor cannot go on between a runner and a simulator, in words for the user.
#[derive(Debug, thiserror::Error)]
pub enum BesideError {
    /// The simulator has ended, or its output is closed, while the runner waits for it.
    #[error("the program behind `--` ended while {awaited} was awaited")]
    Ended {
        /// What it was expected to send next, as a phrase.
        awaited: &'static str,
    },
    /// The simulator sent something that is not part of the protocol.
    #[error("the program behind `--`: {0}")]
    Simulator(TransportError),
    /// The runner sent something that is not part of the protocol.
    #[error("the runner sent what this monitor does not understand ({problem}); both must be of one release")]
    Runner {
        /// The problem.
        problem: String,
    },
    /// A message is not what the monitor expects.
    #[error("a message on `{path}` is not of the type that the space of the monitor declares: {reason}")]
    WrongType {
        /// The topic.
        path: String,
        /// The difference.
        reason: String,
    },
}

/// The two sides of the monitor. Each ends when its stream does.
#[derive(Debug)]
pub struct Beside<RI, RO, SI, SO> {
    /// What the runner says.
    pub from_runner: RI,
    /// What the runner hears.
    pub to_runner: RO,
    /// What the simulator says.
    pub from_simulator: SI,
    /// What the simulator hears.
    pub to_simulator: SO,
}

/// Runs the monitors of a plan between a runner and a simulator until the runner closes its stream. `decided` is told
/// of each decision, and in which run it was made, counted from 1.
pub fn beside<RI, RO, SI, SO>(
    plan: &CampaignPlan,
    sides: Beside<RI, RO, SI, SO>,
    decided: &mut dyn FnMut(u32, &Decided),
) -> Result<(), BesideError>
where
    RI: Read + Send + 'static,
    RO: Write,
    SI: Read + Send + 'static,
    SO: Write,
{
    let wires = WireTable::new(plan);
    let table =
        MetricTable::new(plan, &wires, &[]).map_err(|error| BesideError::Runner { problem: error.to_string() })?;
    let Beside { from_runner, mut to_runner, from_simulator, mut to_simulator } = sides;
    let (queue, lines) = sync_channel(READ_AHEAD);
    read(from_runner, Side::Runner, queue.clone());
    read(from_simulator, Side::Simulator, queue);
    let mut between = Between {
        lines,
        closed: [false; 2],
        to_runner: &mut to_runner,
        to_simulator: &mut to_simulator,
        line: Line::default(),
    };
    let mut run = 0;
    let mut reset = between.runner()?;
    while let Some(line) = reset {
        let Request::Reset(asked) = Request::parse(&line)? else {
            return Err(BesideError::Runner { problem: "a test did not begin with `reset`".to_owned() });
        };
        run += 1;
        between.say_to_simulator(&line);
        let metrics = table.start();
        let mut tell = |what: &Decided| decided(run, what);
        let hearing = Hearing::new(plan, &wires, &metrics, &mut tell);
        reset = match asked.step {
            Some(_) => in_step::run(&mut between, hearing)?,
            None => freely::run(&mut between, hearing)?,
        };
    }
    Ok(())
}

/// Who said something.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Side {
    Runner,
    Simulator,
}

/// What was read of a side.
enum Received {
    Line(Vec<u8>),
    TooLong,
    End,
}

/// Reads the lines of a side in a thread of its own, until its stream ends or nobody takes them.
fn read(stream: impl Read + Send + 'static, side: Side, queue: SyncSender<(Side, Received)>) {
    thread::spawn(move || {
        let mut stream = BufReader::with_capacity(1 << 16, stream);
        loop {
            let mut line = Vec::new();
            let received = match read_line(&mut stream, LINE_LIMIT, &mut line) {
                ReadLine::Line => Received::Line(line),
                ReadLine::TooLong => Received::TooLong,
                ReadLine::End => Received::End,
            };
            let is_last = !matches!(received, Received::Line(_));
            if queue.send((side, received)).is_err() || is_last {
                return;
            }
        }
    });
}

/// The streams of both sides.
struct Between<'a> {
    lines: Receiver<(Side, Received)>,
    /// Whether the runner, and the simulator, has closed its stream.
    closed: [bool; 2],
    to_runner: &'a mut dyn Write,
    to_simulator: &'a mut dyn Write,
    /// The last line of the simulator.
    line: Line,
}

/// A line of a side; without one, the side has closed its stream.
type Said = (Side, Option<Vec<u8>>);

impl Between<'_> {
    /// The next line of either side, waited for at most this long; `None` if there was none. A side that has closed its
    /// stream says so once, by no line.
    fn next(&mut self, wait: Option<Duration>) -> Result<Option<Said>, BesideError> {
        let received = match wait {
            Some(wait) => self.lines.recv_timeout(wait),
            None => self.lines.recv().map_err(|_| RecvTimeoutError::Disconnected),
        };
        match received {
            Ok((side, Received::Line(line))) => {
                self.line.number += u64::from(side == Side::Simulator);
                Ok(Some((side, Some(line))))
            }
            Ok((Side::Simulator, Received::TooLong)) => Err(BesideError::Simulator(self.line.too_long(LINE_LIMIT))),
            Ok((Side::Runner, Received::TooLong)) => {
                Err(BesideError::Runner { problem: format!("a line of more than {LINE_LIMIT} bytes") })
            }
            Ok((side, Received::End)) => {
                self.closed[side as usize] = true;
                Ok(Some((side, None)))
            }
            Err(RecvTimeoutError::Timeout) => Ok(None),
            Err(RecvTimeoutError::Disconnected) => Ok(Some((Side::Runner, None))),
        }
    }

    /// The next line of the runner, while the simulator waits; `None` if the runner has closed its stream.
    fn runner(&mut self) -> Result<Option<Vec<u8>>, BesideError> {
        loop {
            if self.closed[Side::Runner as usize] {
                return Ok(None);
            }
            match self.next(None)? {
                Some((Side::Runner, line)) => return Ok(line),
                // Before the first line, and between tests, it may end; whoever waits for it is told then.
                Some((Side::Simulator, None)) | None => {}
                Some((Side::Simulator, Some(line))) => {
                    self.line.bytes = line;
                    let problem = format!("comes after everything was answered: {}", self.line.shown());
                    let remedy = "give one answer to each line; in this test there is one too many";
                    return Err(BesideError::Simulator(self.line.wrong(problem, remedy)));
                }
            }
        }
    }

    /// The next line of the simulator, while the runner waits; false if the runner has closed its stream.
    fn simulator(&mut self, awaited: &'static str) -> Result<bool, BesideError> {
        if self.closed[Side::Simulator as usize] {
            return Err(BesideError::Ended { awaited });
        }
        loop {
            match self.next(None)? {
                Some((Side::Simulator, Some(line))) => {
                    self.line.bytes = line;
                    return Ok(true);
                }
                Some((Side::Simulator, None)) => return Err(BesideError::Ended { awaited }),
                Some((Side::Runner, None)) => return Ok(false),
                Some((Side::Runner, Some(line))) => {
                    let shown: String = String::from_utf8_lossy(&line).chars().take(100).collect();
                    let problem = format!("it did not wait for {awaited}, but sent `{}`", shown.escape_debug());
                    return Err(BesideError::Runner { problem });
                }
                None => {}
            }
        }
    }

    /// Sends a line, without its end. An error is ignored: whoever does not listen any more says so by the end of what
    /// it says.
    fn say_to_runner(&mut self, line: &[u8]) {
        say(self.to_runner, line);
    }

    /// The same to the simulator.
    fn say_to_simulator(&mut self, line: &[u8]) {
        say(self.to_simulator, line);
    }

    /// Waits for the simulator's answer to `reset`, and tells the runner of it, with the topics and first messages of
    /// the monitors. What comes before it from a simulator that runs freely is of the test before. False if there is
    /// no run: the runner has closed its stream, or the simulator has failed.
    fn ready(&mut self, hearing: &mut Hearing<'_, '_>, freely: bool) -> Result<Option<Clocked>, BesideError> {
        const AWAITED: &str = "its answer to `reset`";
        self.line.number = 0;
        loop {
            if !self.simulator(AWAITED)? {
                return Ok(None);
            }
            let line = std::mem::take(&mut self.line);
            let parsed = line.parse().map_err(BesideError::Simulator)?;
            let answer = match &parsed {
                SimulatorMessage::Ready(ready) => Ok(hearing.ready(ready)),
                SimulatorMessage::Failed(_) => Err(None),
                _ if freely => Err(Some(())),
                other => {
                    let error = line.out_of_turn(other, AWAITED, "answer `reset` with `ready`");
                    return Err(BesideError::Simulator(error));
                }
            };
            let clocked = if let SimulatorMessage::Ready(Ready { clock: true, .. }) = parsed {
                Clocked::BySimulator
            } else {
                Clocked::ByWall
            };
            drop(parsed);
            self.line.number = line.number;
            match answer {
                Ok(ready) => {
                    self.say_to_runner(&ready);
                    return Ok(Some(clocked));
                }
                Err(None) => {
                    self.say_to_runner(&line.bytes);
                    return Ok(None);
                }
                Err(Some(())) => {}
            }
        }
    }
}

/// What time is in a run that nobody steps.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Clocked {
    ByWall,
    BySimulator,
}

fn say(stream: &mut dyn Write, line: &[u8]) {
    let whole = [line, b"\n"].concat();
    stream.write_all(&whole).and_then(|()| stream.flush()).ok();
}

#[cfg(test)]
mod tests;
