//! A simulator that is a program and runs freely: nobody steps it, and it receives messages as they are delivered.
//!
//! Simulation time is the simulator's own clock, if it sends its time, and wall time since its answer to `reset`
//! otherwise. The transport sleeps until the next line of the simulator or until the relay has something to do,
//! whichever is first: a message that an operation holds back is delivered when it is due, even if the simulator is
//! silent.

#![expect(clippy::disallowed_methods, reason = "an adapter: it waits for a program, in a thread of its own")]

use std::io::{BufReader, Write};
use std::mem;
use std::process::ChildStdout;
use std::sync::atomic::Ordering;
use std::sync::mpsc::{self, Receiver, RecvTimeoutError};
use std::thread;
use std::time::{Duration, Instant};

use sesame_base::time::SimTime;
use sesame_plan::CampaignPlan;

use crate::relay::Exchange;
use crate::simulator::Progress;
use crate::transport::clock::Ticks;
use crate::transport::node_orders::NodeOrders;
use crate::transport::process::fault::{explain, note_restart};
use crate::transport::process::launched::health;
use crate::transport::process::protocol::{LINE_LIMIT, Line, Read, SimulatorMessage, read_line, request};
use crate::transport::process::session::{Fault, Json, open, publish};
use crate::transport::relay_latency::{Added, AddedOnWire, join, objections};
use crate::transport::topics::Topics;
use crate::transport::{Capabilities, Incidents, Transport, TransportError, wall_time_since};
use crate::wire::WireTable;
use sesame_lifecycle::launch::Launched;
use sesame_lifecycle::{Alarm, Input, Program, Running};

/// How many lines are read ahead. The simulator's output is read while a line to it is written, so a simulator that
/// writes before it reads does not block the runner.
const READ_AHEAD: usize = 1 << 16;

/// How often it is looked whether a launched program has ended.
const ALARM: Duration = Duration::from_millis(100);

pub(super) struct FreeRunning {
    program: Program,
    connection: Option<Connection>,
    // Dropped after the simulator, which may need it to the end.
    launched: Launched,
    plan: CampaignPlan,
    now: SimTime,
    incidents: Incidents,
    /// How long messages were kept, of connections that have ended since it was asked for.
    added: Vec<AddedOnWire>,
}

struct Connection {
    // Dropped first: the end of its input tells the simulator to exit.
    input: Input,
    lines: Receiver<Received>,
    /// Set when a launched program has ended.
    alarm: Option<Alarm>,
    line: Line,
    /// When the line came.
    arrived: Instant,
    topics: Topics<Json>,
    orders: NodeOrders,
    /// How long messages were kept.
    added: Added,
    clock: Clock,
    ticks: Ticks,
    resets: bool,
    running: Running,
}

/// What was read of the simulator's output.
enum Received {
    /// A line, and when its end came.
    Line(Vec<u8>, Instant),
    TooLong,
}

/// What simulation time is.
#[derive(Debug, Clone, Copy)]
enum Clock {
    /// Wall time since this moment.
    Wall(Instant),
    /// The time that the simulator sends.
    Simulator,
}

impl FreeRunning {
    pub(super) fn new(plan: &CampaignPlan, program: Program, launched: Launched) -> Self {
        FreeRunning {
            program,
            launched,
            connection: None,
            plan: plan.clone(),
            now: SimTime::ZERO,
            incidents: Incidents::default(),
            added: Vec::new(),
        }
    }

    /// Takes what the relay has added, and notes if that is more than its budget.
    fn judge_budget(&mut self) {
        let Some(connection) = &mut self.connection else { return };
        let new = connection.added.take(&WireTable::new(&self.plan));
        if let Some(budget) = self.plan.simulator.lifecycle.relay_budget {
            self.incidents.notes.append(&mut objections(budget, &new));
        }
        join(&mut self.added, new);
    }

    /// Closes the connection, and returns the process.
    fn disconnect(&mut self) -> Option<Running> {
        self.judge_budget();
        self.connection.take().map(|connection| {
            // The simulator may be waiting for the end of its input.
            drop(connection.input);
            connection.running
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
        let (connection, was_used) = match &mut self.connection {
            Some(connection) => (connection, true),
            empty => {
                let scene = relay.arguments();
                self.launched.start_first(seed, scene, "after its reset").map_err(TransportError::from)?;
                (empty.insert(Connection::start(&self.program, self.launched.alarm())?), false)
            }
        };
        connection.running.clear_output();
        connection.reset(&self.plan, seed, was_used, relay)
    }
}

impl Connection {
    fn start(program: &Program, alarm: Option<Alarm>) -> Result<Self, TransportError> {
        let (running, input, output) = program.start()?;
        let (lines, mut topics) = (read_lines(output), Topics::default());
        topics.passed = Some(Vec::new());
        Ok(Connection {
            input,
            lines,
            alarm,
            line: Line::default(),
            arrived: Instant::now(),
            topics,
            orders: NodeOrders::default(),
            added: Added::default(),
            clock: Clock::Simulator,
            ticks: Ticks::default(),
            resets: false,
            running,
        })
    }

    /// Waits for the next line, at most for this long; false if there was none.
    fn receive(&mut self, wait: Option<Duration>, awaited: &str) -> Result<bool, Fault> {
        let received = self.next_line(wait);
        self.line.number += u64::from(received.is_ok());
        match received {
            Ok(Received::Line(bytes, arrived)) => {
                self.line.bytes = bytes;
                self.arrived = arrived;
                Ok(true)
            }
            Ok(Received::TooLong) => Err(self.line.too_long(LINE_LIMIT).into()),
            Err(RecvTimeoutError::Timeout) => Ok(false),
            Err(RecvTimeoutError::Disconnected) => Err(Fault::Disconnected(awaited.to_owned())),
        }
    }

    fn next_line(&self, wait: Option<Duration>) -> Result<Received, RecvTimeoutError> {
        let Some(alarm) = &self.alarm else {
            return match wait {
                Some(wait) => self.lines.recv_timeout(wait),
                None => self.lines.recv().map_err(|_| RecvTimeoutError::Disconnected),
            };
        };
        // The end of a launched program is the end of the run, too.
        let begun = Instant::now();
        loop {
            let left = wait.map_or(ALARM, |wait| wait.saturating_sub(begun.elapsed()));
            match self.lines.recv_timeout(left.min(ALARM)) {
                Err(RecvTimeoutError::Timeout) if alarm.load(Ordering::Relaxed) => {
                    return Err(RecvTimeoutError::Disconnected);
                }
                Err(RecvTimeoutError::Timeout) if wait.is_none_or(|wait| begun.elapsed() < wait) => {}
                received => return received,
            }
        }
    }

    /// Sets the simulator to time zero. One that was used before may still send messages of its last run; they are
    /// discarded.
    fn reset(&mut self, plan: &CampaignPlan, seed: u64, was_used: bool, relay: &mut dyn Exchange) -> Result<(), Fault> {
        const AWAITED: &str = "its answer to `reset`";
        self.topics.clear();
        self.orders = NodeOrders::default();
        let (mut line, wires) = (Vec::new(), relay.wires());
        let paths = wires.iter().map(|wire| wires.path(wire));
        request::reset(&mut line, seed, None, relay.parameters(), None::<std::iter::Empty<&str>>, paths);
        send(&mut self.input, &line);
        self.line.number = 0;
        loop {
            self.receive(None, AWAITED)?;
            let ready = match self.line.parse()? {
                SimulatorMessage::Ready(ready) => ready,
                SimulatorMessage::Failed(reason) => return Err(TransportError::Simulator(reason).into()),
                _ if was_used => continue,
                other => return Err(self.line.out_of_turn(&other, AWAITED, "answer `reset` with `ready`").into()),
            };
            ready.takes(relay.parameters())?;
            self.resets = ready.resets;
            self.clock = if ready.clock { Clock::Simulator } else { Clock::Wall(Instant::now()) };
            open(&mut self.topics, plan, &ready, relay)?;
            publish(&mut self.topics, plan, SimTime::ZERO, &ready.messages, relay, &self.line)?;
            break;
        }
        self.deliver();
        // They came with the answer, before the run began.
        self.topics.passed.iter_mut().for_each(Vec::clear);
        Ok(())
    }

    /// Sends what was delivered.
    fn deliver(&mut self) {
        if !self.topics.format.outbox.is_empty() {
            let mut line = Vec::new();
            request::deliver(&mut line, &self.topics.format.outbox);
            self.topics.format.outbox.clear();
            send(&mut self.input, &line);
        }
    }

    /// Sends what operations want done to nodes since the last call.
    fn give_orders(&mut self, plan: &CampaignPlan, now: SimTime, relay: &mut dyn Exchange) {
        let orders = self.orders.take(plan, now, relay);
        if !orders.is_empty() {
            let mut line = Vec::new();
            request::orders(&mut line, &orders);
            send(&mut self.input, &line);
        }
    }

    /// Simulation time by the wall clock, or the latest time that the simulator sent.
    fn time(&self, latest: SimTime) -> SimTime {
        match self.clock {
            Clock::Wall(start) => wall_time_since(start),
            Clock::Simulator => latest,
        }
    }

    /// Advances the relay, and sends what operations want done to nodes, then what is due.
    fn advance_to(&mut self, plan: &CampaignPlan, now: SimTime, relay: &mut dyn Exchange) {
        relay.advance(now, &mut self.topics.deliveries);
        self.give_orders(plan, now, relay);
        self.topics.deliver(relay, None);
        self.deliver();
    }

    /// How long nothing happens without a line of the simulator; `None` for as long as there is none.
    fn pause(&self, now: SimTime, until: SimTime, relay: &dyn Exchange) -> Option<Duration> {
        match self.clock {
            Clock::Wall(_) => {
                let due = relay.next_due().map_or(until, |due| due.min(until));
                Some(Duration::from_nanos(u64::try_from((due - now).nanos()).unwrap_or(0)))
            }
            Clock::Simulator => None,
        }
    }

    /// Carries out the line that was received at `now`, and returns the time after it.
    fn carry_out(
        &mut self,
        plan: &CampaignPlan,
        now: SimTime,
        relay: &mut dyn Exchange,
    ) -> Result<(SimTime, Progress), TransportError> {
        let (time, progress) = match self.line.parse()? {
            SimulatorMessage::Publish(messages) => {
                publish(&mut self.topics, plan, now, &messages, relay, &self.line)?;
                (now, Progress::Running)
            }
            SimulatorMessage::Done(done) => {
                publish(&mut self.topics, plan, now, &done.messages, relay, &self.line)?;
                if !done.ended {
                    let problem = "says `done`, but this simulator takes no steps".to_owned();
                    let remedy = "send messages with `publish`, and `\"ended\": true` at the end of the scenario";
                    return Err(self.line.wrong(problem, remedy));
                }
                (now, Progress::Ended)
            }
            SimulatorMessage::Time(seconds) => {
                let time = SimTime::from_seconds(seconds);
                if matches!(self.clock, Clock::Wall(_)) {
                    let remedy = "say `\"clock\": true` in `ready` if the simulator has a clock of its own";
                    return Err(self.line.wrong("says `time` without a clock".to_owned(), remedy));
                }
                if !seconds.is_finite() {
                    let problem = format!("sets the time to {seconds} s");
                    return Err(self.line.wrong(problem, "send times that are finite"));
                }
                self.ticks.tick(now, time)?;
                (time, Progress::Running)
            }
            SimulatorMessage::Failed(reason) => return Err(TransportError::Simulator(reason)),
            other @ SimulatorMessage::Ready(_) => {
                return Err(self.line.out_of_turn(&other, "a message", "answer each `reset` once"));
            }
        };
        self.topics.published = 0;
        self.give_orders(plan, now, relay);
        self.deliver();
        for wire in self.topics.passed.iter_mut().flat_map(|passed| passed.drain(..)) {
            self.added.record(wire, self.arrived.elapsed());
        }
        Ok((time, progress))
    }
}

impl Transport for FreeRunning {
    fn capabilities(&self) -> Capabilities {
        let resets = self.connection.as_ref().is_some_and(|connection| connection.resets);
        Capabilities { lock_stepped: false, resets }
    }

    fn reset(&mut self, seed: u64, relay: &mut dyn Exchange) -> Result<(), TransportError> {
        self.now = SimTime::ZERO;
        if !self.capabilities().resets || !self.launched.are_of(relay.arguments()) {
            self.close();
        }
        if self.connection.is_some() {
            // A fault of a process that was used before may belong to the previous run.
            let ended = health(&mut self.launched, &mut Incidents::default());
            let Err(fault) = ended.map_err(Fault::from).and_then(|()| self.begin(seed, relay)) else { return Ok(()) };
            let running = self.disconnect();
            note_restart(&self.program, running, fault, &mut self.incidents);
        }
        self.begin(seed, relay).map_err(|fault| self.explain(fault))
    }

    fn advance(&mut self, until: SimTime, relay: &mut dyn Exchange) -> Result<Progress, TransportError> {
        let Some(connection) = &mut self.connection else {
            return Err(TransportError::Simulator("it was advanced before it was started".to_owned()));
        };
        if let Err(ended) = health(&mut self.launched, &mut self.incidents) {
            return Err(self.explain(ended.into()));
        }
        self.now = connection.time(self.now).min(until);
        connection.advance_to(&self.plan, self.now, relay);
        if self.now >= until {
            return Ok(Progress::Ended);
        }
        let pause = connection.pause(self.now, until, relay);
        let received = match connection.receive(pause, "a message or the end of the scenario") {
            Ok(received) => received,
            Err(fault) => return Err(self.explain(fault)),
        };
        self.now = connection.time(self.now).min(until);
        if !received || self.now >= until {
            return Ok(Progress::Running);
        }
        match connection.carry_out(&self.plan, self.now, relay) {
            Ok((time, progress)) => {
                self.now = time.min(until);
                Ok(progress)
            }
            Err(error) => Err(self.explain(error.into())),
        }
    }

    fn now(&self) -> SimTime {
        self.now
    }

    fn close(&mut self) {
        self.judge_budget();
        self.connection = None;
        self.launched.end();
    }

    fn incidents(&mut self) -> Incidents {
        self.judge_budget();
        self.incidents.notes.append(&mut self.launched.take_notes());
        mem::take(&mut self.incidents)
    }

    fn added(&mut self) -> Vec<AddedOnWire> {
        self.judge_budget();
        mem::take(&mut self.added)
    }
}

/// Sends a line. An error is ignored: a simulator that has closed its input may still have sent the reason.
fn send(input: &mut Input, line: &[u8]) {
    input.write_all(line).and_then(|()| input.flush()).ok();
}

/// Reads lines in a thread of its own until the output ends or the receiver is dropped.
fn read_lines(output: ChildStdout) -> Receiver<Received> {
    let (sender, lines) = mpsc::sync_channel(READ_AHEAD);
    thread::spawn(move || {
        let mut output = BufReader::with_capacity(1 << 16, output);
        loop {
            let mut line = Vec::new();
            let received = match read_line(&mut output, LINE_LIMIT, &mut line) {
                Read::Line => Received::Line(line, Instant::now()),
                Read::TooLong => Received::TooLong,
                Read::End => return,
            };
            let is_last = matches!(received, Received::TooLong);
            if sender.send(received).is_err() || is_last {
                return;
            }
        }
    });
    lines
}
