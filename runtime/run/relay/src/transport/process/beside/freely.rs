//! A run that nobody steps: both sides say what they have to say at any time.

use std::time::{Duration, Instant};

use sesame_base::time::SimTime;

use super::between::{Between, Clocked, Side};
use super::error::BesideError;
use super::hearing::{Hearing, publish};
use super::request::Request;
use crate::relay::PUBLISHED_LIMIT;
use crate::transport::process::protocol::{SimulatorMessage, request};

/// How long the monitor waits with what is due without a message: what was delivered before may still be on its way,
/// and is to be heard first.
const SETTLE: Duration = Duration::from_millis(5);

/// A run. The next line of the runner that is of another one; `None` if it has closed its stream.
pub(super) fn run(between: &mut Between<'_>, mut hearing: Hearing<'_, '_>) -> Result<Option<Vec<u8>>, BesideError> {
    let Some(clocked) = between.ready(&mut hearing, true)? else { return between.runner() };
    let mut time = Time { clocked, shown: SimTime::ZERO, at: Instant::now() };
    let mut line = Vec::new();
    loop {
        let wait = hearing.next_due().and_then(|due| time.until(due));
        match between.next(wait)? {
            None => hearing.pass_to(time.settled()),
            Some((Side::Runner, None)) => return Ok(None),
            Some((Side::Simulator, None)) => return Err(BesideError::Ended { awaited: "a message" }),
            Some((Side::Runner, Some(said))) => match Request::parse(&said)? {
                Request::Deliver(messages) => {
                    let mut delivered = Vec::new();
                    hearing.delivered(&messages, &mut delivered)?;
                    if !delivered.is_empty() {
                        line.clear();
                        request::deliver(&mut line, &delivered);
                        between.say_to_simulator(line.trim_ascii_end());
                    }
                }
                Request::Orders(orders) => {
                    line.clear();
                    request::orders(&mut line, &orders);
                    between.say_to_simulator(line.trim_ascii_end());
                }
                Request::Reset(_) => return Ok(Some(said)),
                Request::Step(_) => {
                    return Err(BesideError::Runner { problem: "a step in a run that nobody steps".to_owned() });
                }
            },
            Some((Side::Simulator, Some(said))) => {
                between.line.bytes = said;
                if let SimulatorMessage::Time(seconds) = between.line.parse().map_err(BesideError::Simulator)? {
                    time.show(SimTime::from_seconds(seconds));
                }
                let said = std::mem::take(&mut between.line.bytes);
                between.say_to_runner(&said);
            }
        }
        let mut published = 0;
        while let Some((path, value)) = hearing.publication() {
            between.say_to_runner(&publish(path, &value));
            published += 1;
            if published == PUBLISHED_LIMIT {
                hearing.give_up();
            }
        }
    }
}

/// Simulation time, as far as this process knows it: the runner, who is told later that the simulator is ready, is
/// behind it.
struct Time {
    clocked: Clocked,
    /// What the simulator's clock shows.
    shown: SimTime,
    /// Since when it shows that; of wall time, when that was zero.
    at: Instant,
}

impl Time {
    fn show(&mut self, time: SimTime) {
        if self.clocked == Clocked::BySimulator && time > self.shown {
            (self.shown, self.at) = (time, Instant::now());
        }
    }

    /// How long it is until something that is due can happen; `None` while only the simulator's clock can tell.
    fn until(&self, due: SimTime) -> Option<Duration> {
        let since = self.at.elapsed();
        match self.clocked {
            Clocked::ByWall => {
                let due = Duration::from_nanos(u64::try_from(due.nanos()).unwrap_or(0)) + SETTLE;
                Some(due.saturating_sub(since))
            }
            Clocked::BySimulator => (due <= self.shown).then(|| SETTLE.saturating_sub(since)),
        }
    }

    /// Until when everything that was delivered has been heard.
    fn settled(&self) -> SimTime {
        match self.clocked {
            Clocked::ByWall => {
                let settled = self.at.elapsed().saturating_sub(SETTLE);
                SimTime::from_nanos(i64::try_from(settled.as_nanos()).unwrap_or(i64::MAX))
            }
            Clocked::BySimulator => self.shown,
        }
    }
}
