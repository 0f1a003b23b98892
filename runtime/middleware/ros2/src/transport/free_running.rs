//! Runs whose time nobody steps: it is shown by the simulator's clock, or it is wall time.

use std::time::{Duration, Instant};

use sesame_base::time::SimTime;
use sesame_lifecycle::launch::Launched;
use sesame_relay::relay::Exchange;
use sesame_relay::simulator::Progress;
use sesame_relay::transport::TransportError;

use super::session::{ClockReader, Incoming, Session};
use super::wall_clock::now;
use super::watch::LOOK;
use super::{SILENCE, System, Zero, silent};

impl System {
    /// Waits for what comes next: a message, a tick of the clock, or the moment at which the relay has something to do.
    pub(super) fn run_freely(&mut self, until: SimTime, relay: &mut dyn Exchange) -> Result<Progress, TransportError> {
        self.now = self.zero.wall_clock(self.now).min(until);
        relay.advance(self.now, &mut self.deliveries);
        self.carry_out(relay)?;
        if self.now >= until {
            return Ok(Progress::Ended);
        }
        let timeout = match self.zero {
            Zero::Wall(_) => {
                let due = relay.next_due().map_or(until, |due| due.min(until));
                Duration::from_nanos(u64::try_from((due - self.now).nanos()).unwrap_or(0))
            }
            Zero::Clock(_) | Zero::Steps => SILENCE.saturating_sub(self.ticked.elapsed()),
        };
        let timeout = self.slow_down().map_or(timeout, |next| next.min(timeout)).min(LOOK);
        let Some(session) = &mut self.session else { return Ok(Progress::Ended) };
        let incoming = session.wait_watching(timeout, &mut self.launched)?;
        // What came in came while it was waited for.
        self.now = self.zero.wall_clock(self.now).min(until);
        if let Zero::Clock(zero) = self.zero {
            // A simulator that is paused may go on to publish the time at which it was.
            let is_tick =
                |incoming: &Incoming| matches!(incoming, Incoming::Clock(nanos) if nanos - zero > self.now.nanos());
            if incoming.iter().any(is_tick) {
                self.ticked = now();
            } else if self.ticked.elapsed() >= SILENCE {
                return Err(session.no_tick());
            }
        }
        for incoming in incoming {
            match incoming {
                Incoming::Message(message) => {
                    let Some(session) = &mut self.session else { return Ok(Progress::Ended) };
                    session.relay_at_once(self.now, message, relay, &mut self.deliveries)?;
                }
                Incoming::Clock(nanos) => {
                    let Zero::Clock(zero) = self.zero else { continue };
                    let time = SimTime::from_nanos(nanos - zero);
                    self.ticks.tick(self.now, time)?;
                    self.now = time.min(until);
                    relay.advance(self.now, &mut self.deliveries);
                }
                Incoming::Stepped(_) | Incoming::Reset(_) => {}
            }
            self.carry_out(relay)?;
        }
        Ok(Progress::Running)
    }

    /// Publishes what is delivered, and does what operations want done.
    fn carry_out(&mut self, relay: &mut dyn Exchange) -> Result<(), TransportError> {
        let Some(session) = &mut self.session else {
            return Err(TransportError::Simulator("it was advanced before it was started".to_owned()));
        };
        session.deliver(&mut self.deliveries, &mut |_| {})?;
        self.obey(relay)
    }
}

impl Session {
    /// Waits for a tick of the clock; messages that come before it are passed on. It returns what the clock shows.
    pub(super) fn tick(&mut self, launched: &mut Launched, limit: Instant) -> Result<i64, TransportError> {
        loop {
            let mut time = None;
            let left = limit.saturating_duration_since(now());
            for incoming in self.wait_watching(left, launched)? {
                match incoming {
                    Incoming::Clock(nanos) => time = Some(nanos),
                    other => self.pass_on(other)?,
                }
            }
            if let Some(time) = time {
                return Ok(time);
            }
            if left.is_zero() {
                return Err(self.no_tick());
            }
        }
    }

    /// That the clock stands still.
    fn no_tick(&self) -> TransportError {
        let on = match &self.clock {
            ClockReader::Topic { path, .. } => format!(", on `{path}`,"),
            ClockReader::Wall => String::new(),
        };
        silent(format!("a tick of the clock of the simulator{on}"))
    }

    /// As [`Session::wait`], and looks meanwhile whether the launched programs still run.
    pub(super) fn wait_watching(
        &mut self,
        timeout: Duration,
        launched: &mut Launched,
    ) -> Result<Vec<Incoming>, TransportError> {
        let limit = now() + timeout;
        loop {
            let left = limit.saturating_duration_since(now());
            let incoming = self.wait(Some(left.min(WATCH)))?;
            if !incoming.is_empty() {
                return Ok(incoming);
            }
            launched.check()?;
            if left.is_zero() {
                return Ok(incoming);
            }
        }
    }
}

/// How often it is looked whether launched programs still run, while nothing comes in.
const WATCH: Duration = Duration::from_millis(100);
