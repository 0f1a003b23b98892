//! Runs of a system on a bus.

use std::collections::{BTreeMap, BTreeSet};
use std::mem;
use std::time::{Duration, Instant};

use sesame_base::gathered::gathered;
use sesame_base::time::SimTime;
use sesame_plan::{CampaignPlan, Channel, TopicId, is_shared};

use crate::relay::{Delivery, Exchange};
use crate::simulator::Progress;
use crate::transport::bus::{Bus, Event, Settings};
use crate::transport::clock::Ticks;
use crate::transport::relay_latency::{Added, AddedOnWire, FEWEST, objections};
use crate::transport::{Capabilities, Incidents, Transport, TransportError, wall_clock, wall_time_since};
use crate::wire::{Line, Wire, WireTable, lines, service_lines};
use sesame_lifecycle::launch::{LaunchContext, LaunchError, Launched, Probe};

/// How long a system may take until it is complete, from when its programs are ready: these have limits of their own.
const COMPLETE_WITHIN: Duration = Duration::from_secs(30);

/// How long the clock may stand still.
const SILENCE: Duration = Duration::from_secs(10);

/// How often it is looked whether launched programs still run, while nothing comes in.
const WATCH: Duration = Duration::from_millis(100);

/// How often it is looked who listens: presence may be found late.
const LOOK: Duration = Duration::from_millis(500);

/// How many messages that belong to calls are remembered; the oldest are forgotten.
const CALLS: usize = 10_000;

pub(super) struct System {
    plan: CampaignPlan,
    settings: Settings,
    // Disconnected before the programs are ended: they may want to say goodbye.
    bus: Box<dyn Bus>,
    launched: Launched,
    connected: bool,
    lines: Vec<Line>,
    /// Where the deliveries of a wire go: the positions of a line and of its sink.
    sinks: BTreeMap<Wire, (usize, usize)>,
    now: SimTime,
    zero: Zero,
    /// When it was looked last who listens.
    looked: Instant,
    ticks: Ticks,
    /// When the clock went on last.
    ticked: Instant,
    /// What the clock showed last, in this run or before it.
    shown: Option<i64>,
    deliveries: Vec<Delivery>,
    /// To which calls messages of this run belong, by their wires and numbers.
    calls: BTreeMap<(Wire, u64), u64>,
    incidents: Incidents,
    added: Added,
    /// The same with the way through a server, if the bus hears itself.
    returned: Added,
    /// What was taken of that, and nobody has asked for.
    judged: Vec<AddedOnWire>,
    wires: WireTable,
    /// What was noted in this run: each note is made once.
    said: BTreeSet<String>,
}

/// Where simulation time is counted from.
#[derive(Debug, Clone, Copy)]
enum Zero {
    /// From this moment of wall time.
    Wall(Instant),
    /// From this time of the clock, in nanoseconds.
    Clock(i64),
}

impl Zero {
    /// Simulation time now where it is wall time; else what it was.
    fn wall_clock(self, was: SimTime) -> SimTime {
        match self {
            Zero::Wall(zero) => wall_time_since(zero),
            Zero::Clock(_) => was,
        }
    }
}

/// What was heard since the programs were launched.
#[derive(Debug, Default)]
struct Heard {
    topics: BTreeSet<TopicId>,
    /// The first and the latest time of the clock.
    ticks: Option<(i64, i64)>,
}

impl Heard {
    fn shows(&self, probe: Probe) -> bool {
        match probe {
            Probe::Topic(topic) => self.topics.contains(&topic),
            Probe::Clock => self.ticks.is_some_and(|(first, latest)| latest > first),
        }
    }
}

impl System {
    pub(super) fn new(plan: &CampaignPlan, bus: Box<dyn Bus>, settings: Settings, context: LaunchContext) -> Self {
        System {
            launched: Launched::new(plan, context),
            plan: plan.clone(),
            settings,
            bus,
            connected: false,
            lines: Vec::new(),
            sinks: BTreeMap::new(),
            now: SimTime::ZERO,
            zero: Zero::Wall(Instant::now()),
            looked: Instant::now(),
            ticks: Ticks::default(),
            ticked: Instant::now(),
            shown: None,
            deliveries: Vec::new(),
            calls: BTreeMap::new(),
            incidents: Incidents::default(),
            added: Added::default(),
            returned: Added::default(),
            judged: Vec::new(),
            wires: WireTable::new(plan),
            said: BTreeSet::new(),
        }
    }

    /// Connects to the system, which is started if the plan says how.
    fn begin(&mut self, seed: u64, relay: &mut dyn Exchange) -> Result<(), TransportError> {
        if !self.connected || !self.settings.resets || !self.launched.are_of(relay.arguments()) {
            self.end();
            self.is_own()?;
            self.lines = lines(&self.plan, relay.wires());
            self.lines.extend(service_lines(&self.plan, relay.wires()));
            let sinks = self
                .lines
                .iter()
                .enumerate()
                .flat_map(|(at, line)| line.sinks.iter().enumerate().map(move |(sink, of)| (of.wire, (at, sink))));
            self.sinks = sinks.collect();
            self.launched.reserve_port()?;
            let launched = &self.launched;
            self.bus.listen(&|address| launched.fill(address))?;
            self.launched.start(seed, relay.arguments())?;
            self.assemble(COMPLETE_WITHIN)?;
        }
        self.bus.reset(SILENCE)?;
        self.calls.clear();
        self.said.clear();
        self.look(relay);
        self.zero = if self.settings.has_clock {
            Zero::Clock(self.first_tick()?)
        } else {
            self.pass_on_all()?;
            Zero::Wall(Instant::now())
        };
        relay.clock_at_zero(match self.zero {
            Zero::Wall(_) => wall_clock(),
            Zero::Clock(nanos) => SimTime::from_nanos(nanos).seconds(),
        });
        self.ticked = Instant::now();
        match relay.parameters() {
            [] => Ok(()),
            [(name, _), ..] => {
                let problem = format!(
                    "the parameter `{name}` cannot be set over this transport; remove its `fit`, or take `process` or \
                     `ros2`"
                );
                Err(TransportError::Wiring(problem))
            }
        }
    }

    /// Tells the relay who listens, as far as the bus knows by now.
    fn look(&mut self, relay: &mut dyn Exchange) {
        self.looked = Instant::now();
        for (at, line) in self.lines.iter().enumerate() {
            if self.bus.is_heard(at) {
                relay.found(line.wire);
                line.sinks.iter().for_each(|sink| relay.found(sink.wire));
            }
        }
    }

    /// A bus without placeholders in its address serves one worker.
    fn is_own(&self) -> Result<(), TransportError> {
        let worker = self.launched.worker();
        match self.settings.addresses.iter().find(|address| is_shared(address)) {
            Some(address) if worker > 1 => {
                let problem = format!(
                    "all workers would use the one system at `{address}`, and worker {worker} is not the first; give \
                     each worker its own with `{{port}}` or `{{worker}}` in the address, or use `--workers 1`"
                );
                Err(TransportError::Wiring(problem))
            }
            _ => Ok(()),
        }
    }

    /// Waits until the launched programs are ready, the bus is connected, and everything is there. Messages from before
    /// go on unchanged.
    fn assemble(&mut self, within: Duration) -> Result<(), TransportError> {
        let mut ready_since: Option<Instant> = None;
        let mut heard = Heard::default();
        loop {
            if self.launched.poll_ready(&mut |probe| heard.shows(probe))? {
                ready_since.get_or_insert_with(Instant::now);
            }
            if !self.connected {
                let launched = &self.launched;
                self.connected = self.bus.connect(&self.lines, &|address| launched.fill(address))?;
            }
            let missing = if self.connected { self.bus.missing() } else { vec![self.unreachable()] };
            self.launched.lacks(&missing);
            if ready_since.is_some() && missing.is_empty() {
                return Ok(());
            }
            if ready_since.is_some_and(|since| since.elapsed() >= within) {
                return Err(TransportError::from(LaunchError::Failed {
                    what: "the system".to_owned(),
                    problem: format!("is not complete after {} s: {}", within.as_secs(), gathered(&missing).join("; ")),
                    last_lines: String::new(),
                }));
            }
            if !self.connected {
                std::thread::sleep(Duration::from_millis(20));
            } else if let Some(event) = self.bus.receive(Duration::from_millis(20))? {
                self.pass_on(event, &mut heard)?;
            }
        }
    }

    fn unreachable(&self) -> String {
        format!("nothing answers at {}", self.addresses())
    }

    /// That the connection is lost when a run comes to its end.
    fn away(&self) -> TransportError {
        let how = "it was lost before the end of the run, and not found again by then".to_owned();
        TransportError::ConnectionLost { to: self.addresses(), how }
    }

    fn addresses(&self) -> String {
        let addresses: Vec<String> =
            self.settings.addresses.iter().map(|address| self.launched.fill(address)).collect();
        format!("`{}`", addresses.join("`, `"))
    }

    /// Passes something on that belongs to no run.
    fn pass_on(&mut self, event: Event, heard: &mut Heard) -> Result<(), TransportError> {
        match event {
            Event::Message { line, value, call, .. } => {
                heard.topics.insert(self.lines[line].topic);
                let sinks = if self.lines[line].cut { self.lines[line].sinks.len() } else { 0 };
                for sink in 0..sinks {
                    self.bus.publish(line, sink, &value, call)?;
                }
            }
            Event::Clock(nanos) => {
                self.shown = Some(nanos);
                let (first, latest) = heard.ticks.get_or_insert((nanos, nanos));
                (*first, *latest) = ((*first).min(nanos), (*latest).max(nanos));
            }
            Event::Note(note) => self.note(note),
            Event::Returned { .. } => {}
        }
        Ok(())
    }

    /// Passes on what has come until now. More than comes in a moment is of the next run.
    fn pass_on_all(&mut self) -> Result<(), TransportError> {
        let limit = Instant::now() + WATCH;
        while Instant::now() < limit
            && let Some(event) = self.bus.receive(Duration::ZERO)?
        {
            self.pass_on(event, &mut Heard::default())?;
        }
        Ok(())
    }

    /// What the clock shows when it ticks next; messages that come before are passed on. After a reset, ticks from
    /// before it may still come: it is waited a moment for one that goes back, which those of some simulators never do.
    fn first_tick(&mut self) -> Result<i64, TransportError> {
        let limit = Instant::now() + SILENCE;
        let mut heard = Heard::default();
        // What the clock shows, and until when it may go back.
        let mut latest: Option<(i64, Instant)> = None;
        while Instant::now() < limit {
            let left = latest.map_or(WATCH, |(_, settled)| settled.saturating_duration_since(Instant::now()));
            match self.bus.receive(left)? {
                Some(Event::Clock(nanos)) => {
                    let went_back = self.shown.replace(nanos).is_some_and(|shown| nanos < shown);
                    if went_back || !self.settings.resets {
                        return Ok(nanos);
                    }
                    latest = Some((nanos, latest.map_or_else(|| Instant::now() + WATCH, |(_, settled)| settled)));
                }
                Some(event) => self.pass_on(event, &mut heard)?,
                None => {
                    self.launched.check()?;
                    // What came in the meantime was looked at, even if this process had to wait for its turn.
                    if let Some((nanos, _)) = latest.filter(|_| left.is_zero()) {
                        return Ok(nanos);
                    }
                }
            }
        }
        latest.map(|(nanos, _)| nanos).ok_or_else(no_tick)
    }

    /// Waits for what comes next: a message, a tick of the clock, or the moment at which the relay has something to do.
    fn run(&mut self, until: SimTime, relay: &mut dyn Exchange) -> Result<Progress, TransportError> {
        self.now = self.zero.wall_clock(self.now).min(until);
        relay.advance(self.now, &mut self.deliveries);
        self.deliver()?;
        if self.now >= until || self.looked.elapsed() >= LOOK {
            self.look(relay);
        }
        if self.now >= until {
            return Ok(Progress::Ended);
        }
        let timeout = match self.zero {
            Zero::Wall(_) => {
                let due = relay.next_due().map_or(until, |due| due.min(until));
                Duration::from_nanos(u64::try_from((due - self.now).nanos()).unwrap_or(0))
            }
            Zero::Clock(_) => SILENCE.saturating_sub(self.ticked.elapsed()),
        };
        let received = self.bus.receive(timeout.min(WATCH))?;
        // What was received came while it was waited for.
        self.now = self.zero.wall_clock(self.now).min(until);
        match received {
            None => self.launched.check()?,
            Some(Event::Note(note)) => self.note(note),
            Some(Event::Clock(nanos)) => self.tick(nanos, until, relay)?,
            Some(Event::Returned { line, added }) => self.returned.record(self.lines[line].wire, added),
            Some(Event::Message { line, source, value, call, arrived }) => {
                self.message(line, source, value, call, relay);
                let sink_of = |delivery: &Delivery| {
                    self.sinks.get(&delivery.wire).filter(|(of, _)| *of == line && self.lines[line].cut)
                };
                let passed: Vec<usize> = self.deliveries.iter().filter_map(sink_of).map(|&(_, sink)| sink).collect();
                self.deliver()?;
                for &sink in &passed {
                    self.bus.came(line, sink, arrived);
                }
                if !passed.is_empty() {
                    self.added.record(self.lines[line].wire, arrived.elapsed());
                }
            }
        }
        if matches!(self.zero, Zero::Clock(_)) && self.ticked.elapsed() >= SILENCE {
            return Err(no_tick());
        }
        Ok(Progress::Running)
    }

    fn tick(&mut self, nanos: i64, until: SimTime, relay: &mut dyn Exchange) -> Result<(), TransportError> {
        self.shown = Some(nanos);
        let Zero::Clock(zero) = self.zero else { return Ok(()) };
        let time = SimTime::from_nanos(nanos.saturating_sub(zero));
        self.ticks.tick(self.now, time)?;
        // A simulator that is paused may go on to publish the time at which it was.
        if time > self.now {
            self.ticked = Instant::now();
        }
        self.now = time.min(until);
        relay.advance(self.now, &mut self.deliveries);
        self.deliver()
    }

    fn message(
        &mut self,
        line: usize,
        source: usize,
        value: crate::value::Value,
        call: Option<u64>,
        relay: &mut dyn Exchange,
    ) {
        let (wire, publisher) = (self.lines[line].wire, self.lines[line].sources[source].publisher);
        if let Some(call) = call {
            self.calls.insert((wire, relay.next_index(wire)), call);
            if self.calls.len() > CALLS {
                self.calls.pop_first();
            }
        }
        relay.message_from(self.now, wire, publisher, value, &mut self.deliveries);
    }

    /// Publishes what is delivered; what was only listened to stays where it is.
    fn deliver(&mut self) -> Result<(), TransportError> {
        for delivery in self.deliveries.drain(..) {
            let Some(&(line, sink)) = self.sinks.get(&delivery.wire) else { continue };
            if self.lines[line].takes(&delivery) {
                let call = self.calls.get(&(self.lines[line].wire, delivery.index)).copied();
                self.bus.publish(line, sink, &delivery.value, call)?;
            }
        }
        Ok(())
    }

    fn note(&mut self, note: String) {
        if self.said.insert(note.clone()) {
            self.incidents.notes.push(note);
        }
    }

    /// Takes what the relay has added, with the way through a server if messages came back from it, and notes if that
    /// is more than its budget.
    fn judge_budget(&mut self) {
        let mut added = self.added.take(&self.wires);
        let returned = self.returned.take(&self.wires);
        for kept in &mut added {
            if let Some(whole) = returned.iter().find(|whole| whole.path == kept.path) {
                kept.latencies.clone_from(&whole.latencies);
            } else if self.bus.hears_itself() && self.is_topic(&kept.path) && kept.latencies.messages() >= FEWEST {
                self.note(format!(
                    "what is published on `{}` does not come back from the server: what the relay adds is measured \
                     without the way through the server",
                    kept.path
                ));
            }
        }
        if let Some(budget) = self.plan.simulator.lifecycle.relay_budget {
            self.incidents.notes.append(&mut objections(budget, &added));
        }
        self.judged.extend(added);
    }

    fn is_topic(&self, path: &str) -> bool {
        self.lines.iter().any(|line| line.channel == Channel::Topic && line.path == path)
    }

    /// Ends the connection, and all that was started.
    fn end(&mut self) {
        if mem::take(&mut self.connected) {
            self.bus.disconnect();
        }
        self.launched.end();
        self.incidents.notes.append(&mut self.launched.take_notes());
    }

    fn fail(&mut self, error: TransportError) -> TransportError {
        // The outcome of a run that was stopped says for how long nothing came, and has no room for what it was.
        if matches!(error, TransportError::Silent { .. }) {
            self.incidents.notes.push(error.to_string());
        }
        // The connection may have been lost because a program has ended: then that is what happened.
        let error = match (&error, self.launched.check()) {
            (TransportError::ConnectionLost { .. } | TransportError::Silent { .. }, Err(ended)) => ended.into(),
            _ => error,
        };
        self.incidents.killed |= self.launched.was_killed();
        self.end();
        error
    }
}

impl Transport for System {
    fn capabilities(&self) -> Capabilities {
        Capabilities { lock_stepped: false, resets: self.settings.resets }
    }

    fn reset(&mut self, seed: u64, relay: &mut dyn Exchange) -> Result<(), TransportError> {
        self.now = SimTime::ZERO;
        self.deliveries.clear();
        self.begin(seed, relay).map_err(|error| self.fail(error))
    }

    fn advance(&mut self, until: SimTime, relay: &mut dyn Exchange) -> Result<Progress, TransportError> {
        if !self.connected {
            return Err(TransportError::Simulator("it was advanced before it was started".to_owned()));
        }
        self.run(until, relay).map_err(|error| self.fail(error))
    }

    fn now(&self) -> SimTime {
        self.now
    }

    fn ended(&mut self) -> Result<(), TransportError> {
        if self.bus.is_connected() {
            return Ok(());
        }
        let away = self.away();
        Err(self.fail(away))
    }

    fn tell_waiting(&mut self, tell: Box<dyn FnMut(&str) + Send>) {
        self.launched.tell_waiting(tell);
    }

    fn close(&mut self) {
        self.end();
    }

    fn added(&mut self) -> Vec<AddedOnWire> {
        self.judge_budget();
        mem::take(&mut self.judged)
    }

    fn incidents(&mut self) -> Incidents {
        self.judge_budget();
        mem::take(&mut self.incidents)
    }
}

/// That the clock stands still.
fn no_tick() -> TransportError {
    TransportError::Silent { awaited: "a tick of the clock of the simulator".to_owned(), limit: SILENCE.as_secs_f64() }
}

#[cfg(test)]
mod tests {
    use std::path::{Path, PathBuf};

    use sesame_plan::testing::minimal;
    use sesame_plan::{Command, Launch, Ready, ReadyWhen};

    use super::*;
    use crate::value::Value;

    /// A bus that reports a missing node until it was asked so often; then it makes a file.
    struct Incomplete {
        left: u32,
        file: PathBuf,
    }

    impl Bus for Incomplete {
        fn connect(&mut self, _: &[Line], _: &dyn Fn(&str) -> String) -> Result<bool, TransportError> {
            Ok(true)
        }

        fn missing(&mut self) -> Vec<String> {
            self.left = self.left.saturating_sub(1);
            if self.left > 0 {
                return vec!["nobody publishes on `/peer`".to_owned()];
            }
            std::fs::write(&self.file, "").unwrap();
            Vec::new()
        }

        fn receive(&mut self, _: Duration) -> Result<Option<Event>, TransportError> {
            Ok(None)
        }

        fn publish(&mut self, _: usize, _: usize, _: &Value, _: Option<u64>) -> Result<(), TransportError> {
            Ok(())
        }

        fn reset(&mut self, _: Duration) -> Result<(), TransportError> {
            Ok(())
        }

        fn disconnect(&mut self) {}
    }

    /// Assembles a system whose program is ready once a file is there. A node is missing until the bus was asked so
    /// often. The limit is zero: what is missing once the program is ready is an error at once.
    fn assembled(folder: &Path, ready_at: &str, missing: u32) -> Result<(), TransportError> {
        let script = format!("while [ ! -e {ready_at} ]; do sleep 0.02; done; echo ready; exec sleep 1000");
        let mut plan = minimal();
        plan.simulator.lifecycle.launch = Some(Launch {
            command: Command { program: "sh".to_owned(), arguments: vec!["-c".to_owned(), script] },
            ready: Some(Ready { when: ReadyWhen::Line { text: "ready".to_owned() }, within: 120.0 }),
        });
        let bus = Incomplete { left: missing, file: folder.join("complete") };
        let settings = Settings { has_clock: false, resets: false, addresses: Vec::new() };
        let context = LaunchContext { in_runner: false, ..LaunchContext::of_worker(folder.to_owned()) };
        let mut system = System::new(&plan, Box::new(bus), settings, context);
        system.launched.start(1, &[])?;
        system.assemble(Duration::ZERO)
    }

    #[test]
    fn the_limit_of_a_system_begins_when_its_programs_are_ready() {
        let folder = tempfile::tempdir().unwrap();
        assert_eq!(assembled(folder.path(), "complete", 5), Ok(()));

        let folder = tempfile::tempdir().unwrap();
        std::fs::write(folder.path().join("there"), "").unwrap();
        let error = assembled(folder.path(), "there", u32::MAX).unwrap_err().to_string();
        assert!(error.contains("is not complete after 0 s: nobody publishes on `/peer`"), "{error}");
    }
}
