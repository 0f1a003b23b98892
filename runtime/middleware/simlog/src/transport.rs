//! The transport to a simulator that speaks SimlogAPI, stepped in lock-step.
//!
//! Topics on which operations act are cut: the simulator hands their messages to the runner, and subscribers hear what
//! the runner publishes instead. Time stands still between steps, so what is published in a step reaches its
//! subscribers in the next one, disturbed or not. All other topics are only listened to.
//!
//! When the messages of a step are complete: in version 3, when the message of the marker has come. Else, when the
//! simulator has answered the step, and everything has come that is owed by what nodes publish `every step` and by what
//! they answer ([`round`](sesame_relay::transport::round)). If a topic is heard of which no node says how many messages
//! it has, nothing may have come for a settling time as well; a message that is later than that goes through the relay
//! in the step after, which is noted where its time stamp shows it.
//!
//! A run begins with a new connection and the length of a step. The plan launches the simulator afresh, or else the
//! simulator must begin anew then, as ours do; one whose time goes on from the run before is refused.

mod lines;
mod round;
mod session;

use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

use sesame_base::time::SimTime;
use sesame_lifecycle::launch::{LaunchContext, Launched};
use sesame_plan::{CampaignPlan, Simlog};
use sesame_relay::relay::{Delivery, Exchange};
use sesame_relay::simulator::Progress;
use sesame_relay::transport::bus::secret::trusted;
use sesame_relay::transport::round::Promises;
use sesame_relay::transport::{Capabilities, Connect, Incidents, Transport, TransportError};
use sesame_relay::wire::WireTable;

use self::lines::Lines;
use self::round::Round;
use self::session::{Session, Start, fault};
use crate::client::{Client, ClientOptions};

/// How long nothing may come in while something must.
const SILENCE: Duration = Duration::from_secs(10);

/// How long a simulator is waited for to acknowledge what is listened to: some do not until their first message.
const ACKNOWLEDGED: Duration = Duration::from_millis(300);

/// For how long nothing may come in before the first step is taken, if nothing longer is declared.
const QUIET: Duration = Duration::from_millis(50);

/// How long messages may come in before the first step: a simulator that publishes by itself never stops.
const LONGEST_START: Duration = Duration::from_secs(1);

/// How long the messages of the last step are waited for: a simulation that has ended need not publish them.
const LAST_WORDS: Duration = Duration::from_millis(500);

/// Within which time it is noticed that a program has ended.
const NOTICED: Duration = Duration::from_secs(1);

/// How often it is looked whether a launched program has ended.
const LOOK: Duration = Duration::from_millis(100);

/// The variable with the token that is sent with each call, if there is one.
const TOKEN: &str = "SESAME_SIMLOG_TOKEN";

/// Connects to a simulator that speaks SimlogAPI. Launched programs run in this folder, and names of files are seen
/// from it. If the variable `SESAME_SIMLOG_TOKEN` is set, its token goes with each call.
pub fn simlog(folder: PathBuf) -> Connect {
    Connect::new(connect, folder)
}

fn connect(plan: &CampaignPlan, folder: &Path) -> Box<dyn Transport> {
    Box::new(transport(plan, folder, true))
}

fn transport(plan: &CampaignPlan, folder: &Path, in_runner: bool) -> System {
    let sesame_plan::Transport::Simlog(settings) = &plan.simulator.transport else {
        unreachable!("the generator connects each kind of simulator by its own transport")
    };
    let context = LaunchContext { in_runner, ..LaunchContext::of_worker(folder.to_owned()) };
    System {
        launched: Launched::new(plan, context),
        promises: Promises::new(plan, &WireTable::new(plan)),
        plan: plan.clone(),
        settings: settings.clone(),
        folder: folder.to_owned(),
        session: None,
        now: SimTime::ZERO,
        start: None,
        deliveries: Vec::new(),
        incidents: Incidents::default(),
    }
}

/// A simulator with what is around it.
struct System {
    plan: CampaignPlan,
    /// What its nodes promise to publish in a step.
    promises: Promises,
    settings: Simlog,
    folder: PathBuf,
    // Ended before the launched programs: what is launched may want to say goodbye.
    session: Option<Session>,
    launched: Launched,
    now: SimTime,
    /// What the simulator's own time was when its first run began.
    start: Option<Start>,
    deliveries: Vec<Delivery>,
    incidents: Incidents,
}

impl System {
    fn step(&self) -> SimTime {
        SimTime::from_nanos(i64::try_from(self.settings.step_ns).unwrap_or(i64::MAX))
    }

    fn options(&self) -> Result<ClientOptions, TransportError> {
        let url = |url: &String| self.launched.fill(url);
        let ca = self.settings.ca.as_ref().map(|file| trusted(file, &self.folder)).transpose()?;
        Ok(ClientOptions {
            topics_url: self.settings.topics_url.as_ref().map(url),
            ca,
            token: std::env::var(TOKEN).ok(),
            patience: SILENCE,
            ..ClientOptions::new(&url(&self.settings.url), self.settings.protocol)
        })
    }

    /// Starts what the plan launches, and connects.
    fn begin(&mut self, seed: u64, relay: &mut dyn Exchange) -> Result<(), TransportError> {
        if let Some((name, _)) = relay.parameters().first() {
            let problem = format!("SimlogAPI sets no parameters of a simulator, and a compensation sets `{name}`");
            return Err(TransportError::Wiring(problem));
        }
        self.session = None;
        self.launched.start_first(seed, relay.arguments(), "once it is connected")?;
        let mut client = Client::connect(&self.options()?).map_err(fault)?;
        client.set_step(milliseconds(self.settings.step_ns)).map_err(fault)?;
        let lines = Lines::open(&self.plan, &self.settings, relay.wires(), &mut client).map_err(fault)?;
        let marker = self.settings.marker.as_ref().map(|name| client.listen(name, "")).transpose().map_err(fault)?;
        client.await_streams(ACKNOWLEDGED).map_err(fault)?;
        lines.tell_subscribers(relay);
        let session = Session { client, lines, marker, start: None, notes: Vec::new() };
        let session = self.session.insert(session);
        // What was published before the first step, which must not be taken for messages of that step.
        let (mut heard, limit) = (Vec::new(), now() + LONGEST_START);
        let quiet = QUIET.max(Duration::from_nanos(self.settings.settle_ns));
        loop {
            let mut more = session.client.take(quiet).map_err(fault)?;
            let over = more.is_empty() || now() >= limit;
            heard.append(&mut more);
            if over {
                break;
            }
        }
        session.relay(&self.plan, SimTime::ZERO, heard, relay, &mut self.deliveries)
    }

    /// Takes one step, unless it would lead beyond `until`.
    fn take_step(&mut self, until: SimTime, relay: &mut dyn Exchange) -> Result<Progress, TransportError> {
        let step = self.step();
        let Some(session) = &mut self.session else {
            return Err(TransportError::Simulator("it was stepped before it was started".to_owned()));
        };
        if self.now + step > until {
            return Ok(Progress::Ended);
        }
        self.now = self.now + step;
        // What was held back reaches its subscribers before the step begins.
        relay.advance(self.now, &mut self.deliveries);
        let before = session.start.or(self.start).map(|start| start.middle_of(self.now, step));
        let mut round = Round::new(&self.promises, session.marker, before);
        session.deliver(&self.promises, &mut self.deliveries, relay, self.now, &mut round)?;
        let answer = session.client.begin_step();
        let settle = Duration::from_nanos(self.settings.settle_ns);
        let mut began = now();
        loop {
            self.launched.check()?;
            if round.stepped.is_none() {
                round.stepped = answer.wait(Duration::from_millis(1)).map_err(fault)?;
            }
            let complete = round.stepped.is_some() && round.is_complete();
            if complete && round.is_certain(&self.promises, &session.lines) {
                break;
            }
            let ended = round.stepped.is_some_and(|stepped| stepped.ended);
            let wait = if complete {
                settle
            } else if ended {
                LAST_WORDS
            } else if round.stepped.is_none() {
                Duration::from_millis(1)
            } else {
                LOOK
            };
            let mut heard = session.client.take(wait).map_err(fault)?;
            if heard.is_empty() && (complete || ended) {
                break;
            }
            if !heard.is_empty() {
                began = now();
            }
            round.take(&session.lines, &mut heard);
            if began.elapsed() > SILENCE {
                let awaited = round.awaited(relay.wires());
                return Err(TransportError::Silent { awaited, limit: SILENCE.as_secs_f64() });
            }
        }
        let Round { heard, stepped, .. } = round;
        session.look_at_time(self.now, step, stepped, &heard, &mut self.start)?;
        session.relay(&self.plan, self.now, heard, relay, &mut self.deliveries)?;
        let ended = stepped.is_some_and(|stepped| stepped.ended);
        Ok(if ended { Progress::Ended } else { Progress::Running })
    }

    fn fail(&mut self, error: TransportError) -> TransportError {
        // A launched program that has ended comes first: the connection may be lost for want of it. A connection is
        // lost before a process has ended.
        let lost = matches!(error, TransportError::ConnectionLost { .. }) && self.launched.is_started();
        let limit = if lost { now() + NOTICED } else { now() };
        let error = loop {
            match self.launched.check() {
                Err(ended) => break ended.into(),
                Ok(()) if now() >= limit => break error,
                Ok(()) => std::thread::sleep(Duration::from_millis(5)),
            }
        };
        if matches!(error, TransportError::Silent { .. }) {
            self.incidents.notes.push(error.to_string());
        }
        self.incidents.killed |= self.launched.was_killed();
        self.close();
        error
    }

    fn collect_notes(&mut self) {
        if let Some(session) = &mut self.session {
            for note in session.notes.drain(..) {
                if !self.incidents.notes.contains(&note) {
                    self.incidents.notes.push(note);
                }
            }
        }
        self.incidents.notes.append(&mut self.launched.take_notes());
    }
}

impl Transport for System {
    fn capabilities(&self) -> Capabilities {
        Capabilities { lock_stepped: true, resets: false }
    }

    fn reset(&mut self, seed: u64, relay: &mut dyn Exchange) -> Result<(), TransportError> {
        self.now = SimTime::ZERO;
        self.deliveries.clear();
        let begun = self.begin(seed, relay);
        self.collect_notes();
        begun.map_err(|error| self.fail(error))
    }

    fn advance(&mut self, until: SimTime, relay: &mut dyn Exchange) -> Result<Progress, TransportError> {
        let advanced = self.take_step(until, relay);
        self.collect_notes();
        advanced.map_err(|error| self.fail(error))
    }

    fn now(&self) -> SimTime {
        self.now
    }

    fn close(&mut self) {
        self.collect_notes();
        self.session = None;
        self.launched.end();
        self.incidents.notes.append(&mut self.launched.take_notes());
    }

    fn incidents(&mut self) -> Incidents {
        std::mem::take(&mut self.incidents)
    }
}

/// Whole milliseconds, as plans have them.
fn milliseconds(nanoseconds: u64) -> i64 {
    i64::try_from(nanoseconds / 1_000_000).unwrap_or(i64::MAX)
}

fn now() -> Instant {
    Instant::now()
}

#[cfg(test)]
mod tests;
