//! The simulator of all cases: a robot that publishes what a script says, hears what it subscribes to, and has faults.
//!
//! What it publishes depends on its script, the step, and a state that only the messages it receives change. So the
//! same script without faults is the same robot: up to a crash it publishes the same, and a number that is none stands
//! in the place of the number that the other publishes.

use std::cell::RefCell;

use sesame_relay::simulator::{Bus, Port, Progress, Setup, Simulator, SimulatorError};
use sesame_relay::value::{Fields, Record, Value};
use sesame_rng::keyed_unit;

/// What a robot does in one run.
#[derive(Debug, Clone)]
pub(crate) struct Script {
    /// Its topics, in the order in which it opens them.
    pub(crate) lines: Vec<Line>,
    /// It fails in this step, after this many messages of it.
    pub(crate) crash: Option<(u32, usize)>,
    /// Its scenario is over after this step.
    pub(crate) over: Option<u32>,
    /// Numbers that it does not know.
    pub(crate) blanks: Vec<Blank>,
    /// Lines of which it publishes half of the messages twice, one right after the other.
    pub(crate) doubled: Vec<usize>,
    /// Parameters that it asks for, whose values change nothing.
    pub(crate) parameters: Vec<String>,
}

/// One topic on the wire.
#[derive(Debug, Clone)]
pub(crate) struct Line {
    pub(crate) path: String,
    pub(crate) carries: Carries,
    /// Whether it hears the topic.
    pub(crate) subscribed: bool,
    /// Whether what it hears there changes its state.
    pub(crate) moves: bool,
    /// Most messages in a step.
    pub(crate) most: u32,
    /// Its values hold for so many steps.
    pub(crate) holds: u32,
    /// How much of the state is in its values.
    pub(crate) gain: f64,
    /// What decides its values.
    pub(crate) seed: u64,
}

/// What a topic carries.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Carries {
    Real,
    Int,
    Bool,
    /// `Zone { level: real, count: int, inside: bool, name: text }`.
    Zone,
}

/// From one step to another, this share of the messages of a topic has a number that is none.
#[derive(Debug, Clone)]
pub(crate) struct Blank {
    pub(crate) line: usize,
    pub(crate) from: u32,
    pub(crate) to: u32,
    pub(crate) share: f64,
    pub(crate) number: f64,
}

thread_local! {
    /// The script of the robot that is started next on this thread: a simulator is told nothing but its seed.
    static SCRIPT: RefCell<Option<Script>> = const { RefCell::new(None) };
}

/// Puts a script where the next robot finds it.
pub(crate) fn set_script(script: Script) {
    SCRIPT.with_borrow_mut(|place| *place = Some(script));
}

pub(crate) struct Robot {
    script: Script,
    ports: Vec<Port>,
    step: u32,
    state: f64,
}

impl Simulator for Robot {
    fn start(setup: &Setup, bus: &mut Bus<'_>) -> Result<Self, SimulatorError> {
        let script = SCRIPT.with_borrow_mut(Option::take).expect("a script is set before each run");
        for parameter in &script.parameters {
            setup.parameter(parameter, 0.0);
        }
        let ports: Vec<Port> = script.lines.iter().map(|line| bus.open(&line.path)).collect();
        for (line, &port) in script.lines.iter().zip(&ports) {
            if line.subscribed {
                bus.subscribe(port);
            }
        }
        let mut robot = Robot { script, ports, step: 0, state: 0.0 };
        // Over the protocol of processes nothing arrives before the first step.
        robot.publish(bus, false)?;
        Ok(robot)
    }

    fn step(&mut self, bus: &mut Bus<'_>) -> Result<Progress, SimulatorError> {
        self.step += 1;
        self.hear(bus);
        self.publish(bus, true)?;
        Ok(if self.script.over == Some(self.step) { Progress::Ended } else { Progress::Running })
    }
}

impl Robot {
    fn hear(&mut self, bus: &mut Bus<'_>) {
        for (line, &port) in self.script.lines.iter().zip(&self.ports) {
            while let Some(message) = bus.receive(port) {
                let number = number_of(&message);
                if line.moves && number.is_finite() {
                    // In quarters, so that all sums are exact.
                    self.state = ((self.state * 0.5 + number * 0.5) * 4.0).round().clamp(-32.0, 32.0) / 4.0;
                }
            }
        }
    }

    fn publish(&mut self, bus: &mut Bus<'_>, hears: bool) -> Result<(), SimulatorError> {
        // Where each message comes in the step depends on its own line alone: a further line moves no other.
        let mut messages: Vec<(f64, usize, u32)> = Vec::new();
        for (at, line) in self.script.lines.iter().enumerate() {
            let count = (draw(line.seed, self.step, 0) * f64::from(line.most + 1)) as u32;
            messages.extend((0..count).map(|n| (draw(line.seed, self.step, 1000 + n), at, n)));
        }
        messages.sort_by(|a, b| a.0.total_cmp(&b.0));
        let unread: Vec<bool> = self.script.lines.iter().map(|line| line.path.starts_with("unread/")).collect();
        let mut sent = 0;
        for (_, line, n) in messages {
            if self.script.crash == Some((self.step, sent)) && !unread[line] {
                return Err(SimulatorError("out of breath".to_owned()));
            }
            sent += usize::from(!unread[line]);
            let message = self.message(line, n);
            if self.script.doubled.contains(&line) && draw(self.script.lines[line].seed, self.step, 4000 + n) < 0.5 {
                bus.publish(self.ports[line], message.clone());
            }
            bus.publish(self.ports[line], message);
            if hears {
                self.hear(bus);
            }
        }
        match self.script.crash {
            Some((step, after)) if step == self.step && sent <= after => {
                Err(SimulatorError("out of breath".to_owned()))
            }
            _ => Ok(()),
        }
    }

    fn message(&self, at: usize, n: u32) -> Value {
        let line = &self.script.lines[at];
        let held = self.step / line.holds.max(1);
        // Several messages of one step differ by a little.
        let base = (draw(line.seed, held, 2) * 33.0).floor() - 16.0 + f64::from(n);
        let truth = base / 4.0 + (line.gain * self.state * 4.0).round() / 4.0;
        let blank = |blank: &&Blank| {
            blank.line == at
                && (blank.from..blank.to).contains(&self.step)
                && draw(line.seed, self.step, 2000 + n) < blank.share
        };
        let level = self.script.blanks.iter().find(blank).map_or(truth, |blank| blank.number);
        let whole = truth.floor() as i64;
        match line.carries {
            Carries::Real => Value::Real(level),
            Carries::Int => Value::Int(whole),
            Carries::Bool => Value::Bool(truth > 0.0),
            Carries::Zone => {
                let fields = Fields::new(["level", "count", "inside", "name"]);
                let name = ["a", "b", "c"][(draw(line.seed, self.step, 3000 + n) * 3.0) as usize];
                Record::new(&fields, vec![level.into(), whole.into(), (truth > 1.0).into(), name.into()]).into()
            }
        }
    }
}

/// The number that a message is about.
pub(crate) fn number_of(message: &Value) -> f64 {
    match message {
        Value::Record(record) => record.get("level").map_or(0.0, number_of),
        Value::Real(x) => *x,
        Value::Int(n) => *n as f64,
        Value::Bool(b) => f64::from(u8::from(*b)),
        _ => 0.0,
    }
}

fn draw(seed: u64, step: u32, n: u32) -> f64 {
    keyed_unit(seed, u64::from(step), u64::from(n))
}
