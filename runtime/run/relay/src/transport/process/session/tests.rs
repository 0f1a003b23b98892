//! The protocol against a simulator whose lines are given: since both sides take turns, its whole part can be written
//! down before.

use sesame_plan::testing::{latency, node, operation, plan, test_of, use_of};
use sesame_plan::{Choice, Distribution, Drain, NodeId, Operation, OperationKind, Test, Type};

use super::*;
use crate::metric::MetricTable;
use crate::relay::{Finished, Relay};
use crate::wire::WireTable;

const STEP: SimTime = SimTime::from_nanos(100_000_000);

const READY: &str = r#"{"ready":{"publishes":["arm/command","zones/Z1","zones/Z2","own"],"subscribes":["arm/command","own","zones/Z1"]}}"#;

/// What came of a conversation.
struct Talk {
    /// What the runner said, line by line.
    orders: Vec<String>,
    /// How it ended, after the steps that were asked for.
    end: Result<Progress, Fault>,
    finished: Finished,
}

impl Talk {
    fn error(self) -> String {
        match self.end {
            Err(Fault::Wrong(error)) => error.to_string(),
            other => panic!("{other:?} is not an error"),
        }
    }
}

/// Resets, takes steps, and gives what was said.
fn talk_about(operations: Vec<Operation>, test: &Test, steps: u32, said: &str) -> Talk {
    talk_with(&plan(operations), test, steps, said)
}

/// The same with another plan.
fn talk_with(plan: &CampaignPlan, test: &Test, steps: u32, said: &str) -> Talk {
    let wires = WireTable::new(plan);
    let metrics = MetricTable::new(plan, &wires, &[]).unwrap();
    let mut relay = Relay::new(plan, &wires, test, metrics.start(), &[]).unwrap();
    let mut session = Session::with_limit(said.as_bytes(), Vec::new(), 1000);
    let mut now = SimTime::ZERO;
    let end = (|| {
        session.reset(plan, 7, STEP, &mut relay)?;
        let mut progress = Progress::Running;
        for _ in 0..steps {
            now = now + STEP;
            progress = session.step(plan, now, &mut relay)?;
        }
        Ok(progress)
    })();
    let orders = String::from_utf8(session.output).unwrap().lines().map(str::to_owned).collect();
    Talk { orders, end, finished: relay.finish(now) }
}

/// A conversation without disturbance, after a good answer to `reset`.
fn talk(steps: u32, said: &[&str]) -> Talk {
    let said: String = [READY].iter().chain(said).flat_map(|line| [line, "\n"]).collect();
    talk_about(Vec::new(), &test_of(Vec::new()), steps, &said)
}

#[test]
fn a_reset_tells_seed_step_and_topics_and_a_step_its_time() {
    let talk = talk(2, &[r#"{"done":{}}"#, r#"{"done":{"ended":true}}"#]);
    assert_eq!(
        talk.orders,
        [
            r#"{"reset":{"seed":7,"step":0.1,"intercepted":[],"topics":["arm/command","zones/Z1","zones/Z2"]}}"#,
            r#"{"step":{"time":0.1,"messages":[]}}"#,
            r#"{"step":{"time":0.2,"messages":[]}}"#,
        ]
    );
    assert!(matches!(talk.end, Ok(Progress::Ended)));
}

#[test]
fn what_is_published_is_delivered_in_the_same_step_and_what_comes_with_done_in_the_next() {
    let talk = talk(
        2,
        &[
            r#"{"publish":[{"topic":"arm/command","value":1.50},{"topic":"zones/Z2","value":{"level":1,"count":2}}]}"#,
            r#"{"done":{"messages":[{"topic":"arm/command","value":2.5}]}}"#,
            r#"{"done":{}}"#,
        ],
    );
    assert_eq!(talk.orders[2], r#"{"deliver":[{"topic":"arm/command","value":1.50}]}"#);
    assert_eq!(talk.orders[3], r#"{"step":{"time":0.2,"messages":[{"topic":"arm/command","value":2.5}]}}"#);
    assert_eq!(talk.finished.messages, 3, "the relay sees what has no subscriber too");
    assert_eq!(talk.finished.metrics[1].value, Some(2.5));
    assert_eq!(talk.finished.metrics[1].series, [(0.1, 2.5)], "the last of a moment");
}

#[test]
fn what_the_simulator_delivers_itself_is_measured_and_does_not_come_back() {
    let delivered = r#"{"topic":"arm/command","value":1.5,"delivered":true}"#;
    let later = r#"{"topic":"arm/command","value":2.5}"#;
    let talk = talk(2, &[&format!(r#"{{"done":{{"messages":[{delivered},{later}]}}}}"#), r#"{"done":{}}"#]);
    assert_eq!(talk.orders[2], r#"{"step":{"time":0.2,"messages":[{"topic":"arm/command","value":2.5}]}}"#);
    assert_eq!((talk.finished.messages, talk.finished.metrics[1].value), (2, Some(2.5)));
}

#[test]
fn what_an_operation_may_change_the_simulator_must_not_deliver_itself() {
    let operations = vec![operation(0, OperationKind::Blackhole)];
    let uses = vec![use_of(0, 5.0, 6.0, vec![], 1)];
    let delivered = r#"{"publish":[{"topic":"arm/command","value":1.5,"delivered":true}]}"#;
    let talk = talk_about(operations, &test_of(uses), 1, &format!("{READY}\n{delivered}\n"));
    assert!(talk.orders[0].contains(r#""intercepted":["arm/command"]"#), "{:?}", talk.orders);
    let error = talk.error();
    assert!(error.contains("says that a message on `arm/command` was delivered"), "{error}");
}

#[test]
fn messages_of_time_zero_come_with_ready() {
    let ready = READY.replace("\"publishes\"", r#""messages":[{"topic":"arm/command","value":3}],"publishes""#);
    let said = format!("{ready}\n{{\"done\":{{}}}}\n");
    let talk = talk_about(Vec::new(), &test_of(Vec::new()), 1, &said);
    assert_eq!(talk.finished.metrics[1].series, [(0.0, 3.0)]);
    assert_eq!(talk.orders[1], r#"{"step":{"time":0.1,"messages":[{"topic":"arm/command","value":3}]}}"#);
}

#[test]
fn topics_of_the_simulator_alone_are_delivered_as_they_are() {
    let talk = talk(1, &[r#"{"publish":[{"topic":"own","value":{"any": [null]}}]}"#, r#"{"done":{}}"#]);
    assert_eq!(talk.orders[2], r#"{"deliver":[{"topic":"own","value":{"any": [null]}}]}"#);
    assert_eq!(talk.finished.messages, 0);
}

#[test]
fn an_operation_stands_between_publisher_and_subscriber() {
    let operations =
        vec![operation(0, OperationKind::Blackhole), operation(0, latency(Distribution::Fixed, Drain::Finish))];
    let uses = vec![use_of(0, 0.1, 0.2, vec![], 1), use_of(1, 0.2, 0.3, vec![Choice::Value { value: 0.15 }], 2)];
    let publish = |x: u32| format!(r#"{{"publish":[{{"topic":"arm/command","value":{x}}}]}}"#);
    let steps: String = (1..=4).flat_map(|step| [publish(step), "\n{\"done\":{}}\n".to_owned()]).collect();
    let said = format!("{READY}\n{steps}");
    let talk = talk_about(operations, &test_of(uses), 4, &said);
    let lines: Vec<&str> = talk.orders[1..].iter().map(String::as_str).collect();
    assert_eq!(
        lines,
        [
            r#"{"step":{"time":0.1,"messages":[]}}"#,
            r#"{"deliver":[]}"#, // lost
            r#"{"step":{"time":0.2,"messages":[]}}"#,
            r#"{"deliver":[]}"#, // held until 0.35 s, and with it its successor
            r#"{"step":{"time":0.3,"messages":[]}}"#,
            r#"{"deliver":[]}"#,
            r#"{"step":{"time":0.4,"messages":[{"topic":"arm/command","value":2.0},{"topic":"arm/command","value":3.0}]}}"#,
            r#"{"deliver":[{"topic":"arm/command","value":4.0}]}"#,
        ]
    );
    assert_eq!(talk.finished.operations[0].counters.dropped, 1);
}

#[test]
fn what_operations_want_of_nodes_comes_with_the_step_in_which_they_begin_and_end() {
    let mut plan = plan(vec![
        operation(0, OperationKind::Slow { node: NodeId(0) }),
        operation(0, OperationKind::Kill { node: NodeId(1) }),
    ]);
    plan.nodes = vec![node("arm"), node("gate")];
    let share = vec![Choice::Value { value: 0.25 }];
    // The first begins within the second step.
    let test = test_of(vec![use_of(0, 0.13, 0.3, share, 1), use_of(1, 0.3, 0.4, vec![], 2)]);
    let offers = |nodes: &str| READY.replace("\"publishes\"", &format!("\"nodes\":{nodes},\"publishes\""));
    let said = |nodes: &str| format!("{}\n{}", offers(nodes), "{\"done\":{}}\n".repeat(5));
    let talk = talk_with(&plan, &test, 5, &said(r#"{"arm":["pause","slow"],"gate":["kill"],"more":["slow"]}"#));
    let lines: Vec<&str> = talk.orders[1..].iter().map(String::as_str).collect();
    assert_eq!(
        lines,
        [
            r#"{"step":{"time":0.1,"messages":[]}}"#,
            r#"{"step":{"time":0.2,"orders":[{"node":"arm","order":"slow","share":0.25}],"messages":[]}}"#,
            r#"{"step":{"time":0.3,"orders":[{"node":"arm","order":"resume"},{"node":"gate","order":"kill"}],"messages":[]}}"#,
            r#"{"step":{"time":0.4,"orders":[{"node":"gate","order":"restart"}],"messages":[]}}"#,
            r#"{"step":{"time":0.5,"messages":[]}}"#,
        ]
    );
    assert!(talk.finished.operations.iter().all(|used| used.counters.side_effects == 1));

    // It is refused in every run, also in those that do not use the operation.
    let refused = talk_with(&plan, &test_of(vec![]), 5, &said(r#"{"arm":["pause","slow"]}"#)).error();
    assert!(
        refused.starts_with("the simulator does not offer to kill node `gate`, as operation `kill` needs"),
        "{refused}"
    );
    let unknown = talk_with(&plan, &test, 5, &said(r#"{"arm":["stop"]}"#)).error();
    assert!(unknown.contains("unknown variant `stop`, expected one of `pause`, `slow`, `kill`"), "{unknown}");
}

#[test]
fn what_the_answer_to_reset_does_not_list_as_subscribed_nobody_hears() {
    let lost = |subscribes: &str| {
        let ready = format!(
            r#"{{"ready":{{"publishes":["arm/command","zones/Z1","zones/Z2"],"subscribes":[{subscribes}],"resets":true}}}}"#
        );
        let step = r#"{"publish":[{"topic":"arm/command","value":1}]}"#;
        let said = format!("{ready}\n{step}\n{{\"done\":{{}}}}\n");
        let hole = vec![operation(0, OperationKind::Blackhole)];
        let talk = talk_about(hole, &test_of(vec![use_of(0, 0.0, 1.0, vec![], 1)]), 1, &said);
        assert!(talk.end.is_ok(), "{:?}", talk.end);
        let counters = talk.finished.operations[0].counters;
        (counters.dropped, counters.unheard, talk.finished.unheard)
    };
    assert_eq!(lost(r#""arm/command""#), (1, 0, vec![]));
    assert_eq!(lost(r#""zones/Z1""#), (0, 1, vec!["arm/command".to_owned()]));
}

#[test]
fn a_changed_message_keeps_what_is_not_declared() {
    let kind = sesame_plan::testing::offset(sesame_plan::ValueMode::Absolute, false);
    let uses = vec![use_of(0, 0.0, 1.0, vec![Choice::Range { low: 5.0, high: 5.0 }], 1)];
    let said = format!(
        "{READY}\n{}\n{{\"done\":{{}}}}\n",
        r#"{"publish":[{"topic":"zones/Z1","value":{"x":[1.0,null],"level":1,"count":2}}]}"#
    );
    let talk = talk_about(vec![sesame_plan::testing::at(&["level"], operation(1, kind))], &test_of(uses), 1, &said);
    assert_eq!(talk.orders[2], r#"{"deliver":[{"topic":"zones/Z1","value":{"x":[1.0,null],"level":5.0,"count":2}}]}"#);
}

#[test]
fn every_topic_of_the_space_must_be_the_simulators() {
    let said = r#"{"ready":{"publishes":["arm/comand","zones/Z1","zones/Z2"]}}"#;
    let talk = talk_about(Vec::new(), &test_of(Vec::new()), 0, &format!("{said}\n"));
    assert_eq!(talk.error(), "the simulator has no topic `arm/command`; did you mean `arm/comand`?");
}

#[test]
fn what_cannot_be_understood_is_named_with_its_line_and_a_remedy() {
    let long = format!(r#"{{"failed":"{}"}}"#, "x".repeat(1000));
    let cases = [
        vec!["Simulator 1.0 starting"],
        vec![r#"{"done":{}}"#, "0.1"],
        vec![r#"{"publish":[{"topic":"arm/command","value":NaN}]}"#],
        vec![r#"{"publish":[{"topic":"arm/command","value":"NaN"#],
        vec![r#"{"publish":{"topic":"arm/command","value":1}}"#],
        vec![r#"{"done":{"message":[]}}"#],
        vec![r#"{"step":{}}"#],
        vec![READY],
        vec![r#"{"publish":[{"topic":"nobody/knows","value":1}]}"#],
        vec![r#"{"publish":[{"topic":"arm/command","value":"fast"}]}"#],
        vec![r#"{"publish":[{"topic":"zones/Z1","value":{"level":1}}]}"#],
        vec![r#"{"failed":"the gripper is stuck"}"#],
        vec![long.as_str()],
        vec![""],
    ];
    let said: Vec<String> = cases.iter().map(|lines| talk(2, lines).error()).collect();
    insta::assert_snapshot!(said.join("\n\n"));
}

#[test]
fn text_that_is_not_utf8_is_named() {
    let plan = plan(Vec::new());
    let wires = WireTable::new(&plan);
    let metrics = MetricTable::new(&plan, &wires, &[]).unwrap();
    let mut relay = Relay::new(&plan, &wires, &test_of(Vec::new()), metrics.start(), &[]).unwrap();
    let mut session = Session::new(&b"\xff\n"[..], Vec::new());
    match session.reset(&plan, 7, STEP, &mut relay) {
        Err(Fault::Wrong(error)) => assert!(error.to_string().contains("is not UTF-8"), "{error}"),
        other => panic!("{other:?}"),
    }
}

#[test]
fn a_simulator_that_is_gone_is_told_from_one_that_is_wrong() {
    for said in ["", &READY[..20], &format!("{READY}\n"), &format!("{READY}\n{{\"done\":")] {
        let talk = talk_about(Vec::new(), &test_of(Vec::new()), 1, said);
        assert!(matches!(talk.end, Err(Fault::Disconnected(_))), "{said}: {:?}", talk.end);
    }
}

#[test]
fn a_flood_of_messages_is_stopped() {
    let plan = plan(Vec::new());
    let wires = WireTable::new(&plan);
    let metrics = MetricTable::new(&plan, &wires, &[]).unwrap();
    let mut relay = Relay::new(&plan, &wires, &test_of(Vec::new()), metrics.start(), &[]).unwrap();
    let message = r#"{"topic":"own","value":1}"#;
    let many = vec![message; 10_000].join(",");
    let publish = format!("{{\"publish\":[{many}]}}\n");
    let said = format!("{READY}\n{}", publish.repeat(11));
    let mut session = Session::new(said.as_bytes(), std::io::sink());
    session.reset(&plan, 7, STEP, &mut relay).unwrap();
    match session.step(&plan, STEP, &mut relay) {
        Err(Fault::Wrong(error)) => insta::assert_snapshot!(error.to_string()),
        other => panic!("{other:?}"),
    }
}

#[test]
fn lines_are_counted_from_the_last_reset() {
    let plan = plan(Vec::new());
    let wires = WireTable::new(&plan);
    let metrics = MetricTable::new(&plan, &wires, &[]).unwrap();
    let said = format!("{READY}\n{{\"done\":{{}}}}\n{READY}\nhello\n");
    let mut session = Session::new(said.as_bytes(), Vec::new());
    for last in [false, true] {
        let mut relay = Relay::new(&plan, &wires, &test_of(Vec::new()), metrics.start(), &[]).unwrap();
        session.reset(&plan, 7, STEP, &mut relay).unwrap();
        match session.step(&plan, STEP, &mut relay) {
            Ok(Progress::Running) if !last => {}
            Err(Fault::Wrong(TransportError::Protocol { line: 2, .. })) if last => {}
            other => panic!("{other:?}"),
        }
    }
}

#[test]
fn payloads_are_checked_by_type_on_every_message_not_only_the_first() {
    assert!(matches!(plan(Vec::new()).topics[0].ty, Type::Real { .. }));
    let good = r#"{"publish":[{"topic":"arm/command","value":1}]}"#;
    let bad = r#"{"publish":[{"topic":"arm/command","value":true}]}"#;
    let error = talk(1, &[good, bad]).error();
    assert_eq!(error, "a message on `arm/command` is not of its declared type: expected real, found bool");
}
