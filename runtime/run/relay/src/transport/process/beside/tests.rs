use std::io::{BufRead as _, BufReader, PipeReader, PipeWriter, pipe};
use std::sync::{Arc, Mutex};
use std::thread;

use serde_json::{Value as Json, json};
use sesame_base::time::SimTime;
use sesame_plan::testing::{
    evidence_above, guarantee, latency, minimal, monitor, node, operation, test_of, topic, use_of,
};
use sesame_plan::{
    CampaignPlan, Choice, Distribution, Drain, Evidence, FieldRef, Gate, Mitigation, MitigationValue, Monitor,
    MonitorId, NodeId, OperationKind, Stale, StaleIs, Test, TopicId, Type,
};

use super::request::Delivered;
use super::*;
use crate::relay::{Listener, Relay};
use crate::transport::process::session::Session;
use crate::value::Value;
use crate::wire::Wire;

const STEP: SimTime = SimTime::from_nanos(100_000_000);
const STEPS: i64 = 40;

/// A monitor of levels that sends `stop`, with and without a runner that has it.
fn plans() -> [CampaignPlan; 2] {
    let mut plan = minimal();
    let real = || Type::Real { unit: None };
    plan.topics = vec![
        topic("level", &["level"], real()),
        topic("state", &["state"], Type::Bool),
        topic("stop", &["stop"], Type::Bool),
    ];
    let high = Evidence {
        held: 0.17,
        stale: Some(Stale { after: 0.23, is: StaleIs::Unknown, all: false }),
        ..evidence_above("high", 0, 1.0)
    };
    let gate = Gate::Any(vec![Gate::Evidence(0), Gate::Evidence(1)]);
    let mut cell: Monitor =
        monitor("cell", 1, vec![high, evidence_above("top", 0, 2.5)], vec![guarantee("ok", 1, gate)]);
    let field = FieldRef { topic: TopicId(2), path: Vec::new() };
    cell.otherwise.mitigation = Some(Mitigation { field, value: MitigationValue::Bool(true) });
    plan.nodes = vec![node("cell")];
    plan.operations = vec![
        operation(0, latency(Distribution::Fixed, Drain::Flush)),
        operation(0, OperationKind::Slow { node: NodeId(0) }),
    ];
    let without = plan.clone();
    plan.monitors = vec![cell];
    [plan, without]
}

/// Levels are late by 130 ms from 1 s to 3 s, so that they are due between steps. Meanwhile the cell is told to be
/// slow.
fn late() -> Test {
    let value = |value| vec![Choice::Value { value }];
    test_of(vec![use_of(0, 1.0, 3.0, value(0.13), 1), use_of(1, 1.5, 2.5, value(0.5), 2)])
}

/// The cell: it publishes levels at the start, in the middle and at the end of steps, and is silent for a while. What
/// it hears is written down.
fn cell(requests: PipeReader, mut answers: PipeWriter, heard: &Mutex<Vec<Json>>) {
    let mut lines = BufReader::new(requests).lines().map_while(Result::ok);
    let mut answer = |what: Json| writeln!(answers, "{what}").unwrap();
    let level = |at: i64| json!({"topic": "level", "value": (at * 7 % 5) as f64});
    while let Some(line) = lines.next() {
        let order: Json = serde_json::from_str(&line).unwrap();
        if order["reset"].is_object() {
            assert!(order["reset"]["topics"].as_array().unwrap().len() == 3);
            answer(json!({"ready": {"publishes": ["level", "stop"], "subscribes": ["level", "stop"], "resets": true,
                                    "nodes": {"cell": ["slow"]},
                                    "messages": [level(3)]}}));
            continue;
        }
        let time = order["step"]["time"].as_f64().unwrap();
        #[expect(clippy::cast_possible_truncation, reason = "there are few steps")]
        let at = (time * 10.0).round() as i64;
        let mut all = order["step"]["messages"].as_array().unwrap().clone();
        if !(12..17).contains(&(at % 20)) {
            answer(json!({"publish": [level(at), level(at + 1)]}));
            let delivered: Json = serde_json::from_str(&lines.next().unwrap()).unwrap();
            all.extend(delivered["deliver"].as_array().unwrap().clone());
        }
        all.retain(|message| message["topic"] == "stop");
        heard.lock().unwrap().push(json!([time, all, order["step"]["orders"]]));
        answer(json!({"done": {"messages": if at % 3 == 0 { vec![level(at + 2)] } else { vec![] }}}));
    }
}

/// What monitors decided: when, and in which state they were then.
#[derive(Default)]
struct Decisions(Vec<String>);

impl Listener for Decisions {
    fn published(&mut self, _: SimTime, _: Wire, _: u64, _: &Value) {}
    fn delivered(&mut self, _: SimTime, _: Wire, _: u64, _: &Value) {}
    fn decided(&mut self, decided: &Decided) {
        self.0.push(format!("{} {:?}", decided.at.nanos(), decided.state));
    }
}

/// A run of a test, over these streams.
fn run(plan: &CampaignPlan, test: &Test, from: PipeReader, to: PipeWriter) -> Vec<String> {
    let wires = WireTable::new(plan);
    let table = MetricTable::new(plan, &wires, &[]).unwrap();
    let mut decisions = Decisions::default();
    let relay = Relay::new(plan, &wires, test, table.start(), &[]).unwrap();
    let mut relay = relay.tapped(&mut decisions);
    relay.begin();
    let mut session = Session::new(BufReader::new(from), to);
    session.reset(plan, 1, STEP, &mut relay).unwrap();
    let mut now = SimTime::ZERO;
    for _ in 0..STEPS {
        now = now + STEP;
        session.step(plan, now, &mut relay).unwrap();
    }
    relay.end(now);
    drop(relay);
    decisions.0
}

/// The decisions of a test, and what the cell heard, with the monitor in the runner or beside the cell.
fn decided(beside_the_cell: bool, test: &Test) -> (Vec<String>, Vec<Json>) {
    let [with, without] = plans();
    let heard = Arc::new(Mutex::new(Vec::new()));
    let (requests, to_cell) = pipe().unwrap();
    let (from_cell, answers) = pipe().unwrap();
    let hears = Arc::clone(&heard);
    let cell = thread::spawn(move || cell(requests, answers, &hears));
    let decisions = if beside_the_cell {
        let alone = with.of_monitor_alone(MonitorId(0)).unwrap();
        let (from_runner, to_monitor) = pipe().unwrap();
        let (from_monitor, to_runner) = pipe().unwrap();
        let monitor = thread::spawn(move || {
            let mut said = Vec::new();
            let sides = Beside { from_runner, to_runner, from_simulator: from_cell, to_simulator: to_cell };
            let mut tell = |run: u32, decided: &Decided| {
                assert_eq!(run, 1);
                said.push(format!("{} {:?}", decided.at.nanos(), decided.state));
            };
            beside(&alone, sides, &mut tell).unwrap();
            said
        });
        assert!(run(&without, test, from_monitor, to_monitor).is_empty(), "the runner has no monitor");
        monitor.join().unwrap()
    } else {
        run(&with, test, from_cell, to_cell)
    };
    cell.join().unwrap();
    let heard = heard.lock().unwrap().clone();
    (decisions, heard)
}

#[test]
fn a_monitor_beside_the_cell_decides_what_one_in_the_runner_decides_to_the_nanosecond() {
    let undisturbed = decided(false, &Test { operations: Vec::new() });
    let late = late();
    let disturbed = decided(false, &late);
    assert_ne!(undisturbed.0, disturbed.0);
    let between_steps = |decisions: &[String]| decisions.iter().any(|decision| !decision.contains("00000000 "));
    assert!(between_steps(&disturbed.0) && disturbed.0.len() > 20, "{:#?}", disturbed.0);
    assert!(disturbed.1.iter().any(|step| !step[1].as_array().unwrap().is_empty()), "mitigation is sent");
    let orders: Vec<&Json> = disturbed.1.iter().map(|step| &step[2]).filter(|orders| !orders.is_null()).collect();
    let slow = json!([{"node": "cell", "order": "slow", "share": 0.5}]);
    assert_eq!(orders, [&slow, &json!([{"node": "cell", "order": "resume"}])]);
    assert_eq!(decided(true, &Test { operations: Vec::new() }), undisturbed);
    assert_eq!(decided(true, &late), disturbed, "decisions, and what the cell hears in each step");
}

#[test]
fn what_time_alone_decides_is_told_when_it_passes() {
    let [with, _] = plans();
    let alone = with.of_monitor_alone(MonitorId(0)).unwrap();
    let wires = WireTable::new(&alone);
    let table = MetricTable::new(&alone, &wires, &[]).unwrap();
    let mut told = Vec::new();
    let mut tell = |decided: &Decided| told.push(decided.at);
    let mut hearing = Hearing::new(&alone, &wires, &table.start(), &mut tell);
    let value = serde_json::value::to_raw_value(&2.0).unwrap();
    let level = Delivered { topic: "level".into(), time: 0.1, value: &value };
    hearing.delivered(&[level], &mut Vec::new()).unwrap();
    hearing.pass_to(SimTime::from_seconds(1.0));
    // The level counts as high after 170 ms, and as stale a nanosecond after 230 ms.
    assert_eq!(told, [0, 270_000_000, 330_000_001].map(SimTime::from_nanos));
}

#[test]
fn what_does_not_belong_to_the_protocol_is_an_error_that_says_whose() {
    let [with, _] = plans();
    let alone = with.of_monitor_alone(MonitorId(0)).unwrap();
    let wrong = |runner: &str, simulator: &str| {
        let sides = Beside {
            from_runner: std::io::Cursor::new(runner.as_bytes().to_vec()),
            to_runner: Vec::new(),
            from_simulator: std::io::Cursor::new(simulator.as_bytes().to_vec()),
            to_simulator: Vec::new(),
        };
        beside(&alone, sides, &mut |_, _| {}).map_err(|error| error.to_string())
    };
    assert_eq!(wrong("", ""), Ok(()));
    let no_reset = wrong("{\"deliver\":[]}\n", "").unwrap_err();
    assert!(no_reset.starts_with("the runner sent what this monitor does not understand"), "{no_reset}");
}
