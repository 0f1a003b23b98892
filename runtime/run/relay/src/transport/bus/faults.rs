//! A bus in memory on which everything goes wrong that can: presence is found late or lost, topics fall silent,
//! messages come in floods, notes have no end, clocks stop, leap or go back, and connections die at any moment.
//!
//! Whatever happens, a test without evidence is never satisfied, and what the environment did is never a finding about
//! the system.

use std::collections::VecDeque;
use std::path::PathBuf;
use std::time::{Duration, Instant};

use proptest::prelude::*;

use sesame_base::observation::{MetricValue, Observation, Outcome};
use sesame_base::silence::{distrust, silences};
use sesame_base::verdict::{Verdict, verdict};
use sesame_plan::testing::{metric, minimal, operation_with, requirement, ros2, test_of, topic, use_of};
use sesame_plan::{
    Bound, CampaignPlan, Clock, FieldRef, MetricSource, OperationKind, Ros, Simulator, Span, TopicId, Type, Wiring,
};

use super::{Bus, Event, Settings, on_bus};
use crate::evaluate::{Custom, evaluate};
use crate::metric::MetricTable;
use crate::transport::TransportError;
use crate::value::Value;
use crate::wire::{Line, WireTable};
use sesame_lifecycle::launch::LaunchContext;

/// The system ticks each twentieth of a second for five seconds, and says how far it is from a wall and how fast it is.
const TICK: i64 = 50_000_000;
const TICKS: usize = 100;
const DISTANCE: usize = 0;
const SPEED: usize = 1;

/// What goes wrong in a run, by ticks.
#[derive(Debug, Clone)]
enum Fault {
    /// A topic says nothing from this tick on, for so many ticks.
    Silence { line: usize, from: usize, ticks: usize },
    /// Each message of a topic comes so often in this tick.
    Flood { line: usize, at: usize, times: usize },
    /// So many notes come at once, each another one.
    Notes { at: usize, count: usize },
    /// The clock goes back by so many ticks.
    Back { at: usize, ticks: i64 },
    /// It leaps ahead by so many seconds.
    Leap { at: usize, seconds: i64 },
    /// The connection is lost for good.
    Dies { at: usize },
    /// It is lost, and not found again before the run has ended.
    AwayAtTheEnd,
    /// A subscriber is found so late; never, if after the end.
    FoundLate { at: usize },
}

fn fault() -> impl Strategy<Value = Fault> {
    let tick = 0..TICKS;
    prop_oneof![
        3 => (0usize..2, tick.clone(), 1..TICKS).prop_map(|(line, from, ticks)| Fault::Silence { line, from, ticks }),
        1 => (0usize..2, tick.clone(), 1usize..200).prop_map(|(line, at, times)| Fault::Flood { line, at, times }),
        1 => (tick.clone(), 1usize..50).prop_map(|(at, count)| Fault::Notes { at, count }),
        1 => (30..TICKS, 2i64..20).prop_map(|(at, ticks)| Fault::Back { at, ticks }),
        1 => (30..TICKS, 6i64..4000).prop_map(|(at, seconds)| Fault::Leap { at, seconds }),
        1 => tick.clone().prop_map(|at| Fault::Dies { at }),
        1 => Just(Fault::AwayAtTheEnd),
        1 => (0..2 * TICKS).prop_map(|at| Fault::FoundLate { at }),
    ]
}

/// What happens in the course of a run.
enum Next {
    Event(Event),
    Lost,
}

struct Faulty {
    faults: Vec<Fault>,
    /// The distance in each tick.
    distances: Vec<f64>,
    next: VecDeque<Next>,
    /// How many ticks have passed.
    passed: usize,
}

impl Faulty {
    fn begin(&mut self) {
        self.passed = 0;
        self.next.clear();
        let mut shown = 0;
        for tick in 0..=TICKS + 1 {
            for fault in &self.faults {
                match *fault {
                    Fault::Back { at, ticks } if at == tick => shown -= ticks * TICK,
                    Fault::Leap { at, seconds } if at == tick => shown += seconds * 1_000_000_000,
                    Fault::Dies { at } if at == tick => self.next.push_back(Next::Lost),
                    Fault::Notes { at, count } if at == tick => {
                        let notes = (0..count).map(|note| Next::Event(Event::Note(format!("note {note} of {tick}"))));
                        self.next.extend(notes);
                    }
                    _ => {}
                }
            }
            self.next.push_back(Next::Event(Event::Clock(shown)));
            let distance = self.distances[tick % self.distances.len()];
            for (line, value) in [(DISTANCE, distance), (SPEED, 1.0)] {
                for _ in 0..self.times(line, tick) {
                    let (value, arrived) = (Value::Real(value), now());
                    self.next.push_back(Next::Event(Event::Message { line, source: 0, value, call: None, arrived }));
                }
            }
            shown += TICK;
        }
    }

    /// How often a topic speaks in a tick.
    fn times(&self, line: usize, tick: usize) -> usize {
        let silent = |fault: &Fault| matches!(*fault, Fault::Silence { line: of, from, ticks } if of == line && (from..from + ticks).contains(&tick));
        let flood = |fault: &Fault| match *fault {
            Fault::Flood { line: of, at, times } if of == line && at == tick => Some(times),
            _ => None,
        };
        if self.faults.iter().any(silent) { 0 } else { self.faults.iter().find_map(flood).unwrap_or(1) }
    }

    fn found_at(&self) -> usize {
        let late = |fault: &Fault| if let Fault::FoundLate { at } = fault { Some(*at) } else { None };
        self.faults.iter().filter_map(late).max().unwrap_or(0)
    }
}

impl Bus for Faulty {
    fn connect(&mut self, _: &[Line], _: &dyn Fn(&str) -> String) -> Result<bool, TransportError> {
        self.begin();
        Ok(true)
    }

    fn receive(&mut self, _: Duration) -> Result<Option<Event>, TransportError> {
        match self.next.pop_front() {
            Some(Next::Event(event)) => {
                self.passed += usize::from(matches!(event, Event::Clock(_)));
                Ok(Some(event))
            }
            // All that was to happen has happened: the clock stands still, and the test waits for no wall time.
            None => Err(TransportError::Silent { awaited: "a tick".to_owned(), limit: 0.0 }),
            Some(Next::Lost) => {
                Err(TransportError::ConnectionLost { to: "the bus".to_owned(), how: "it was closed".to_owned() })
            }
        }
    }

    fn is_connected(&self) -> bool {
        !self.faults.iter().any(|fault| matches!(fault, Fault::AwayAtTheEnd))
    }

    fn is_heard(&self, _: usize) -> bool {
        self.passed > self.found_at()
    }

    fn publish(&mut self, _: usize, _: usize, _: &Value, _: Option<u64>) -> Result<(), TransportError> {
        Ok(())
    }

    fn disconnect(&mut self) {}
}

#[expect(clippy::disallowed_methods, reason = "an adapter's test")]
fn now() -> Instant {
    Instant::now()
}

/// At the end, the distance must be a metre at least; the speed may be lost.
fn plan() -> CampaignPlan {
    let real = || Type::Real { unit: None };
    let last = |topic| MetricSource::Last { input: FieldRef { topic: TopicId(topic), path: Vec::new() } };
    let distance = sesame_plan::Metric { default: Some(99.0), ..metric("distance_left", last(0)) };
    let whole = Span { start: 0.0, end: 5.0 };
    let mut plan = CampaignPlan {
        topics: vec![topic("distance", &["distance"], real()), topic("speed", &["speed"], real())],
        metrics: vec![distance, metric("speed_seen", last(1))],
        requirements: vec![requirement("R1", 0, Bound::AtLeast { value: 1.0 })],
        operations: vec![sesame_plan::Operation {
            within: whole,
            ..operation_with("lose", 1, OperationKind::Blackhole, Vec::new())
        }],
        ..minimal()
    };
    plan.campaign.end_after = 5.0;
    let wiring = vec![Wiring::default(), Wiring { cut: true, ..Wiring::default() }];
    let clock = Clock::Topic { path: "clock".to_owned() };
    plan.simulator = Simulator { ros: Some(Ros { clock, ..Ros::default() }), ..ros2(0, wiring) };
    plan
}

/// A run of a test with these faults: from one to two seconds no speed is heard, if it is disturbed.
fn ran(plan: &CampaignPlan, faults: &[Fault], distances: &[f64], disturbed: bool) -> Observation {
    let bus = Faulty { faults: faults.to_vec(), distances: distances.to_vec(), next: VecDeque::new(), passed: 0 };
    let settings = Settings { has_clock: true, resets: false, addresses: Vec::new() };
    let context = LaunchContext { in_runner: false, ..LaunchContext::of_worker(PathBuf::from(".")) };
    let mut transport = on_bus(plan, Box::new(bus), settings, context);
    let wires = WireTable::new(plan);
    let metrics = MetricTable::new(plan, &wires, &[]).unwrap();
    let operations = if disturbed { vec![use_of(0, 1.0, 2.0, Vec::new(), 1)] } else { Vec::new() };
    let test = test_of(operations);
    evaluate(plan, &wires, &metrics, &mut *transport, &test, 1, &mut Custom::none()).unwrap()
}

proptest! {
    #[test]
    fn a_run_without_evidence_is_never_satisfied_and_what_the_environment_did_is_no_finding(
        (faults, distances) in campaign(),
    ) {
        holds(&faults, &distances)?;
    }
}

#[test]
#[ignore = "long: 100,000 runs"]
fn of_100_000_runs_without_evidence_none_is_satisfied() {
    let config = ProptestConfig { cases: 100_000, ..ProptestConfig::default() };
    let mut runner = proptest::test_runner::TestRunner::new(config);
    runner.run(&campaign(), |(faults, distances)| holds(&faults, &distances)).unwrap();
}

/// Faults, at most one of them of the clock, and distances.
fn campaign() -> impl Strategy<Value = (Vec<Fault>, Vec<f64>)> {
    let of_clock = |fault: &&Fault| matches!(fault, Fault::Back { .. } | Fault::Leap { .. });
    let faults = prop::collection::vec(fault(), 0..4)
        .prop_filter("clocks do one thing wrong", move |faults| faults.iter().filter(of_clock).count() < 2);
    let distance = prop_oneof![9 => 1.5f64..9.0, 1 => 0.1f64..0.9];
    (faults, prop::collection::vec(distance, 1..40))
}

fn holds(faults: &[Fault], distances: &[f64]) -> Result<(), TestCaseError> {
    let plan = plan();
    let reference = ran(&plan, &[], &[5.0], false);
    prop_assert_eq!(&reference.outcome, &Outcome::Completed);
    let mut run = ran(&plan, faults, distances, true);
    let found = silences(&reference, &run);
    distrust(&plan, &found, &mut run.metrics);

    // Only the environment breaks runs off here, and it is never taken for the system.
    let breaks = |fault: &Fault| {
        matches!(fault, Fault::Back { .. } | Fault::Leap { .. } | Fault::Dies { .. } | Fault::AwayAtTheEnd)
    };
    let broke_off = !run.outcome.is_whole();
    prop_assert!(!broke_off || run.outcome.is_of_environment(), "{:?}", run.outcome);
    prop_assert_eq!(broke_off, faults.iter().any(breaks) || run.traffic.is_empty(), "{:?}", run.outcome);

    // What was heard of the distance, by a judge of its own.
    let bus = Faulty { faults: faults.to_vec(), distances: distances.to_vec(), next: VecDeque::new(), passed: 0 };
    let last = (0..TICKS).rev().find(|&tick| bus.times(DISTANCE, tick) > 0);
    let distance = last.map(|tick| distances[tick % distances.len()]);
    // Twenty ticks are a second, which is longer than ten of the longest gaps.
    let silent = TICKS - last.unwrap_or(0);
    match verdict(plan.requirements[0].bound, &run.outcome, MetricValue::from(&run.metrics[0])) {
        Verdict::Satisfied => {
            prop_assert!(!broke_off && silent <= 21, "heard last at {:?}", last);
            prop_assert!(distance.is_some_and(|distance| distance >= 1.0));
        }
        Verdict::Violated => prop_assert!(!broke_off && distance.is_some_and(|distance| distance < 1.0)),
        Verdict::Inconclusive => prop_assert!(broke_off || silent >= 20, "heard last at {:?}", last),
    }

    // A subscriber that is there at the end was there all the time.
    let speaks = (21..39).any(|tick| bus.times(SPEED, tick) > 0);
    if !broke_off && speaks {
        let effect = run.operations[0].counters.any_effect();
        prop_assert!(bus.found_at() >= TICKS - 1 || effect, "{:?}", run.operations[0].counters);
        prop_assert!(bus.found_at() <= TICKS + 1 || !effect, "{:?}", run.operations[0].counters);
    }
    Ok(())
}
