//! Runs over a bus whose events are written down.

use std::collections::VecDeque;
use std::path::PathBuf;
use std::time::Duration;

use sesame_base::time::SimTime;
use sesame_plan::testing::{minimal, operation, test_of, use_of};
use sesame_plan::{Activation, Choice, Command, Launch, OperationKind, Ready, ReadyWhen, TestOperation};

use super::*;
use crate::metric::MetricTable;
use crate::relay::{Exchange, Relay};
use crate::wire::WireTable;

/// A bus with a clock. Each reset is followed by ticks.
struct Written {
    events: VecDeque<Event>,
    after_reset: Vec<i64>,
}

impl Bus for Written {
    fn connect(&mut self, _: &[Line], _: &dyn Fn(&str) -> String) -> Result<bool, TransportError> {
        Ok(true)
    }

    fn receive(&mut self, _: Duration) -> Result<Option<Event>, TransportError> {
        Ok(self.events.pop_front())
    }

    fn publish(&mut self, _: usize, _: usize, _: &Value, _: Option<u64>) -> Result<(), TransportError> {
        Ok(())
    }

    fn reset(&mut self, _: Duration) -> Result<(), TransportError> {
        self.events.extend(self.after_reset.iter().copied().map(Event::Clock));
        Ok(())
    }

    fn disconnect(&mut self) {}
}

/// The time after some events, of two runs in which the same ticks follow each reset.
fn times(resets: bool, before: &[i64], after_reset: &[i64], events: usize) -> Vec<Result<i64, TransportError>> {
    let plan = minimal();
    let events_before = before.iter().copied().map(Event::Clock).collect();
    let bus = Written { events: events_before, after_reset: after_reset.to_vec() };
    let settings = Settings { has_clock: true, resets, addresses: Vec::new() };
    let context = LaunchContext { in_runner: false, ..LaunchContext::of_worker(PathBuf::from(".")) };
    let mut transport = on_bus(&plan, Box::new(bus), settings, context);
    let mut run = || {
        let wires = WireTable::new(&plan);
        let metrics = MetricTable::new(&plan, &wires, &[]).unwrap();
        let mut relay = Relay::new(&plan, &wires, &test_of(Vec::new()), metrics.start(), &[]).unwrap();
        relay.begin();
        transport.reset(1, &mut relay)?;
        for _ in 0..events {
            transport.advance(SimTime::from_seconds(1_000.0), &mut relay)?;
        }
        Ok(transport.now().nanos())
    };
    (0..2).map(|_| run()).collect()
}

#[test]
fn ticks_from_before_a_reset_are_not_time_zero() {
    // At the second reset, two ticks of the first run are still on their way.
    let times = times(true, &[70], &[80, 90, 5, 6, 8, 10], 2);
    assert_eq!(times, [Ok(3), Ok(3)], "from 5 to 8");
}

#[test]
fn a_clock_that_goes_on_after_a_reset_counts_from_what_it_shows_then() {
    // At the first reset it is waited in vain for a tick that goes back; at the second one, it does.
    assert_eq!(times(true, &[], &[5, 6, 7], 1), [Ok(0), Ok(1)], "from 7, and from 5 to 6");
}

#[test]
fn without_a_reset_the_first_tick_is_time_zero() {
    let times = times(false, &[70, 75], &[80, 90], 1);
    assert_eq!(times[0], Ok(5), "from 70 to 75");
}

#[test]
fn what_is_launched_with_the_scene_of_a_test_is_kept_while_tests_have_the_same_although_a_service_resets_it() {
    let folder = tempfile::tempdir().unwrap();
    let mut plan = minimal();
    let (parameter, usual) = (None, Some(0.5));
    plan.operations = vec![operation(0, OperationKind::Scene { parameter, usual })];
    let place = format!("x:={{{}}}", plan.operations[0].name);
    let script = "echo \"$0\" >> log; echo up; exec sleep 1000".to_owned();
    plan.simulator.lifecycle.launch = Some(Launch {
        command: Command { program: "sh".to_owned(), arguments: vec!["-c".to_owned(), script, place] },
        ready: Some(Ready { when: ReadyWhen::Line { text: "up".to_owned() }, within: 120.0 }),
    });
    let bus = Written { events: VecDeque::new(), after_reset: vec![5, 6] };
    let settings = Settings { has_clock: true, resets: true, addresses: Vec::new() };
    let context = LaunchContext { in_runner: false, ..LaunchContext::of_worker(folder.path().to_owned()) };
    let mut transport = on_bus(&plan, Box::new(bus), settings, context);
    let wires = WireTable::new(&plan);
    let metrics = MetricTable::new(&plan, &wires, &[]).unwrap();
    let mut launched_after = |chosen: Option<f64>| {
        let used = |value| TestOperation {
            activation: Activation::Offline,
            ..use_of(0, 0.0, 1.0, vec![Choice::Value { value }], 1)
        };
        let test = test_of(chosen.map(used).into_iter().collect());
        let mut relay = Relay::new(&plan, &wires, &test, metrics.start(), &[]).unwrap();
        assert!(relay.parameters().is_empty(), "the simulator is not asked for it");
        relay.begin();
        transport.reset(1, &mut relay).unwrap();
        std::fs::read_to_string(folder.path().join("log")).unwrap().lines().map(str::to_owned).collect::<Vec<_>>()
    };
    assert_eq!(launched_after(None), ["x:=0.5"]);
    assert_eq!(launched_after(Some(0.5)), ["x:=0.5"]);
    assert_eq!(launched_after(Some(-2.0)), ["x:=0.5", "x:=-2.0"]);
    assert_eq!(launched_after(Some(-2.0)), ["x:=0.5", "x:=-2.0"]);
    assert_eq!(launched_after(None), ["x:=0.5", "x:=-2.0", "x:=0.5"]);
}
