//! Simulators that the plan launches: the peer in `tests/simulator2.py`, if `SESAME_SIMLOG` names a Python for it.

use std::path::PathBuf;

use sesame_base::time::SimTime;
use sesame_lifecycle::launch::LaunchError;
use sesame_plan::testing::{self, minimal, node, topic, topics};
use sesame_plan::{Command, Launch, Ready, ReadyWhen, TopicId, Type, WireNames};
use sesame_relay::metric::MetricTable;
use sesame_relay::relay::Relay;

use super::*;
use crate::client::Stepped;

const STEP: u64 = 20_000_000;

fn python() -> Option<PathBuf> {
    sesame_peers::named("SESAME_SIMLOG")
}

/// A plan that launches the peer with these arguments.
fn launching(arguments: &[&str]) -> Option<CampaignPlan> {
    let program = python()?.display().to_string();
    let own = ["simulator2.py", "--port", "{port}"];
    let arguments = own.iter().chain(arguments).map(|&argument| argument.to_owned()).collect();
    let mut plan = minimal();
    plan.topics = vec![topic("point", &["point"], Type::Point { unit: None })];
    plan.nodes = vec![sesame_plan::Node { every_step: vec![TopicId(0)], publishes: topics(&[0]), ..node("simulator") }];
    let ready = Ready { when: ReadyWhen::Port { port: "{port}".to_owned() }, within: 20.0 };
    let launch = Launch { command: Command { program, arguments }, ready: Some(ready) };
    plan.simulator = testing::simlog("http://127.0.0.1:{port}");
    plan.simulator.lifecycle.launch = Some(launch);
    plan.validate().expect("the plan is sound");
    Some(plan)
}

fn run(system: &mut System, plan: &CampaignPlan, steps: u64) -> Result<Progress, TransportError> {
    let wires = WireTable::new(plan);
    let test = sesame_plan::Test::default();
    let metrics = MetricTable::new(plan, &wires, &[]).expect("there are none");
    let mut relay = Relay::new(plan, &wires, &test, metrics.start(), &[]).expect("it is the empty test");
    system.reset(1, &mut relay)?;
    let until = SimTime::from_nanos(i64::try_from(steps * STEP).expect("runs are short"));
    while system.now() < until {
        system.advance(until, &mut relay)?;
    }
    system.advance(until, &mut relay)
}

fn system(plan: &CampaignPlan) -> System {
    transport(plan, &PathBuf::from(concat!(env!("CARGO_MANIFEST_DIR"), "/tests")), false)
}

/// With a simulator by grpcio.
mod real {
    use super::*;

    #[test]
    fn each_run_launches_the_simulator_afresh() {
        let Some(plan) = launching(&["--goes-on"]) else { return };
        let mut system = system(&plan);
        for _ in 0..2 {
            // It would refuse a simulator whose time goes on.
            assert_eq!(run(&mut system, &plan, 50), Ok(Progress::Ended));
        }
        assert!(system.launched.is_started());
        system.close();
        assert!(!system.launched.is_started(), "nothing is left behind");
    }

    #[test]
    fn a_program_that_ends_is_named() {
        let Some(plan) = launching(&["--die-at", "5"]) else { return };
        let ended = run(&mut system(&plan), &plan, 50).unwrap_err();
        assert!(
            matches!(&ended, TransportError::Launch(LaunchError::Ended { what, .. }) if what.contains("simulator2.py")),
            "{ended}"
        );
    }
}

#[test]
fn what_a_step_waits_for_is_named_by_its_path() {
    let mut plan = minimal();
    plan.topics = vec![topic("states", &["left/states", "right/states"], Type::Bool)];
    plan.nodes = vec![sesame_plan::Node { every_step: vec![TopicId(0)], publishes: topics(&[0]), ..node("arms") }];
    let wires = WireTable::new(&plan);
    let mut round = Round::new(&Promises::new(&plan, &wires), None, None);
    assert_eq!(round.awaited(&wires), "the end of a step");
    round.stepped = Some(Stepped { ended: false, clock_ms: None });
    assert_eq!(round.awaited(&wires), "a message of the step (1 on `left/states`, 1 on `right/states`)");
}

#[test]
fn settings_that_are_left_out_have_their_defaults() {
    let json = r#"{"url": "http://localhost:8089", "step_ns": 20000000, "protocol": "v2"}"#;
    let simlog: Simlog = serde_json::from_str(json).unwrap();
    assert_eq!(simlog.names, WireNames::default());
    assert_eq!((simlog.settle_ns, &simlog.cut, &simlog.marker, &simlog.ca), (5_000_000, &Vec::new(), &None, &None));
}
