//! The streams of a runner and a simulator, between which a monitor is.

use std::io::{BufReader, Read, Write};
use std::sync::mpsc::{Receiver, RecvTimeoutError, SyncSender};
use std::thread;
use std::time::Duration;

use super::error::BesideError;
use super::hearing::Hearing;
use crate::transport::process::protocol::{LINE_LIMIT, Line, Read as ReadLine, Ready, SimulatorMessage, read_line};

/// Who said something.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Side {
    Runner,
    Simulator,
}

/// What was read of a side.
pub(super) enum Received {
    Line(Vec<u8>),
    TooLong,
    End,
}

/// Reads the lines of a side in a thread of its own, until its stream ends or nobody takes them.
pub(super) fn read(stream: impl Read + Send + 'static, side: Side, queue: SyncSender<(Side, Received)>) {
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
pub(super) struct Between<'a> {
    pub(super) lines: Receiver<(Side, Received)>,
    /// Whether the runner, and the simulator, has closed its stream.
    pub(super) closed: [bool; 2],
    pub(super) to_runner: &'a mut dyn Write,
    pub(super) to_simulator: &'a mut dyn Write,
    /// The last line of the simulator.
    pub(super) line: Line,
}

/// A line of a side; without one, the side has closed its stream.
pub(super) type Said = (Side, Option<Vec<u8>>);

impl Between<'_> {
    /// The next line of either side, waited for at most this long; `None` if there was none. A side that has closed its
    /// stream says so once, by no line.
    pub(super) fn next(&mut self, wait: Option<Duration>) -> Result<Option<Said>, BesideError> {
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
    pub(super) fn runner(&mut self) -> Result<Option<Vec<u8>>, BesideError> {
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
    pub(super) fn simulator(&mut self, awaited: &'static str) -> Result<bool, BesideError> {
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
    pub(super) fn say_to_runner(&mut self, line: &[u8]) {
        say(self.to_runner, line);
    }

    /// The same to the simulator.
    pub(super) fn say_to_simulator(&mut self, line: &[u8]) {
        say(self.to_simulator, line);
    }

    /// Waits for the simulator's answer to `reset`, and tells the runner of it, with the topics and first messages of
    /// the monitors. What comes before it from a simulator that runs freely is of the test before. False if there is
    /// no run: the runner has closed its stream, or the simulator has failed.
    pub(super) fn ready(
        &mut self,
        hearing: &mut Hearing<'_, '_>,
        freely: bool,
    ) -> Result<Option<Clocked>, BesideError> {
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
pub(super) enum Clocked {
    ByWall,
    BySimulator,
}

fn say(stream: &mut dyn Write, line: &[u8]) {
    let whole = [line, b"\n"].concat();
    stream.write_all(&whole).and_then(|()| stream.flush()).ok();
}
