//! The PLC of the cell: executes the motion programmes, sends the targets, receives the measurements of the axes.

use sesame_runtime::simulator::{Bus, Port};
use sesame_runtime::time::SimTime;

use crate::arm::{self, R3200, R270072, R270073, STATE_FIELDS};
use crate::conveyor::{self, INFEED, OUTFEED};
use crate::program::{Programs, TAKT_SECONDS};
use crate::sequence::{Sequence, Signals};

/// A group of axes as the PLC sees it.
#[derive(Debug, Clone)]
struct Station<const N: usize> {
    sequence: Sequence<N>,
    targets: [Port; N],
    feedback: Port,
    measured: [f64; N],
}

/// The PLC.
#[derive(Debug, Clone)]
pub struct Plc {
    arms: [Station<6>; 3],
    conveyors: [Station<1>; 2],
    signals: Signals,
    cycle_begun: SimTime,
    cycle_done: bool,
    cycle_time: Port,
}

impl Plc {
    /// A PLC about to begin its first cycle; opens its topics.
    pub fn open(programs: Programs, bus: &mut Bus<'_>) -> Self {
        let Programs { arms, homes, conveyors } = programs;
        let arm_names = [R3200.name, R270073.name, R270072.name];
        let mut arm_parts = arms.into_iter().zip(homes);
        let arms = arm_names.map(|name| {
            let (sequence, measured) = arm_parts.next().expect("there is a programme for each arm");
            let targets = std::array::from_fn(|link| bus.open(&arm::target_topic(name, link)));
            listening(Station { sequence, targets, feedback: bus.open(&arm::state_topic(name)), measured }, bus)
        });
        let mut conveyor_sequences = conveyors.into_iter();
        let conveyors = [INFEED.name, OUTFEED.name].map(|name| {
            let sequence = conveyor_sequences.next().expect("there is a programme for each conveyor");
            let targets = [bus.open(&conveyor::target_topic(name))];
            let feedback = bus.open(&conveyor::measured_topic(name));
            listening(Station { sequence, targets, feedback, measured: [0.0] }, bus)
        });
        Plc {
            arms,
            conveyors,
            signals: Signals::default(),
            cycle_begun: SimTime::ZERO,
            cycle_done: false,
            cycle_time: bus.open(CYCLE_TIME_TOPIC),
        }
    }

    /// One PLC cycle: reads the measurements of the axes, advances the sequences, sends all targets.
    ///
    /// `paused` is for how long the product arm's sequence has been held up since the last cycle.
    pub fn scan(&mut self, paused: SimTime, bus: &mut Bus<'_>) {
        self.arms[0].sequence.pause(paused);
        let now = bus.now();
        if self.cycle_done && now - self.cycle_begun >= SimTime::from_seconds(TAKT_SECONDS) {
            self.begin_cycle(now);
        }
        for station in &mut self.arms {
            while let Some(message) = bus.receive(station.feedback) {
                for (measured, name) in station.measured.iter_mut().zip(STATE_FIELDS) {
                    *measured = message.number_at(&[name]).unwrap_or(*measured);
                }
            }
            station.go_on(&mut self.signals, bus);
        }
        for station in &mut self.conveyors {
            while let Some(message) = bus.receive(station.feedback) {
                station.measured[0] = message.number_at::<&str>(&[]).unwrap_or(station.measured[0]);
            }
            station.go_on(&mut self.signals, bus);
        }
        if !self.cycle_done && self.is_all_done() {
            self.cycle_done = true;
            bus.publish(self.cycle_time, (now - self.cycle_begun).seconds());
        }
    }

    fn is_all_done(&self) -> bool {
        self.arms.iter().all(|station| station.sequence.is_done())
            && self.conveyors.iter().all(|station| station.sequence.is_done())
    }

    fn begin_cycle(&mut self, now: SimTime) {
        self.signals = Signals::default();
        self.cycle_begun = now;
        self.cycle_done = false;
        self.arms.iter_mut().for_each(|station| station.sequence.restart(now));
        self.conveyors.iter_mut().for_each(|station| station.sequence.restart(now));
    }
}

impl<const N: usize> Station<N> {
    fn go_on(&mut self, signals: &mut Signals, bus: &mut Bus<'_>) {
        self.sequence.advance(bus.now(), &self.measured, signals);
        for (&port, &set_point) in self.targets.iter().zip(self.sequence.set_points()) {
            bus.publish(port, set_point);
        }
    }
}

fn listening<const N: usize>(station: Station<N>, bus: &mut Bus<'_>) -> Station<N> {
    bus.subscribe(station.feedback);
    station
}

/// The topic on which the time of each completed cycle is published, in s.
pub const CYCLE_TIME_TOPIC: &str = "cell/cycle_time";
