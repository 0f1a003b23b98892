//! Simulators that run freely.

use super::*;

/// A simulator that runs freely and does this after its answer to `reset`, in a run of at most an hour in which `lag`
/// holds commands back for 0.3 s; what its run showed.
fn free_running(ready: &str, after: &str) -> Option<(Observation, f64)> {
    let lag = operation(0, latency(Distribution::Fixed, Drain::Finish));
    free_running_in(vec![lag], vec![use_of(0, 0.0, 3600.0, vec![Choice::Value { value: 0.3 }], 1)], ready, after)
}

/// The same with other operations, on a node `arm` too, in a test of these uses.
fn free_running_in(
    operations: Vec<Operation>,
    uses: Vec<TestOperation>,
    ready: &str,
    after: &str,
) -> Option<(Observation, f64)> {
    if !python() {
        return None;
    }
    let program = format!(
        r#"
import json, sys
def say(what): print(json.dumps(what), flush=True)
def command(value): say({{"publish": [{{"topic": "arm/command", "value": value}}]}})
def hear(): return json.loads(sys.stdin.readline())
TOPICS = ["arm/command", "zones/Z1", "zones/Z2"]
reset = hear()["reset"]
assert "step" not in reset, reset
say({{"ready": {{"publishes": TOPICS, "subscribes": TOPICS {ready}}}}})
{after}
"#
    );
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("sim.py"), program).unwrap();
    let mut plan = plan_of("python3", &["sim.py"]);
    plan.campaign.end_after = 3600.0;
    plan.nodes = vec![node("arm")];
    plan.operations = operations;
    plan.operations.iter_mut().for_each(|operation| operation.within = Span { start: 0.0, end: 3600.0 });
    let Declared::Process { step_ns, .. } = &mut plan.simulator.transport else { unreachable!() };
    *step_ns = None;
    let mut transport = transport(&plan, folder.path().to_owned(), false);
    assert!(!transport.capabilities().lock_stepped);
    let wires = WireTable::new(&plan);
    let metrics = MetricTable::new(&plan, &wires, &[]).unwrap();
    let test = test_of(uses);
    let started = Instant::now();
    let observed = evaluate(&plan, &wires, &metrics, transport.as_mut(), &test, 1, &mut Custom::none()).unwrap();
    Some((observed, started.elapsed().as_secs_f64()))
}

#[test]
fn a_held_message_reaches_a_silent_free_running_simulator_when_it_is_due() {
    let after = r#"
command(1.5)
assert hear() == {"deliver": [{"topic": "arm/command", "value": 1.5}]}
say({"done": {"ended": True}})
sys.stdin.readline()
"#;
    let Some((observed, took)) = free_running("", after) else { return };
    assert_eq!(observed.outcome, Outcome::Completed);
    assert!((0.3..60.0).contains(&observed.end) && took < 60.0, "it ended at {} s, after {took} s", observed.end);
    assert_eq!(observed.operations[0].counters.delayed, 1);
}

#[test]
fn a_free_running_simulator_may_have_a_clock_of_its_own() {
    // An hour of simulation in a moment: held messages come when the simulator's clock has come so far.
    let after = r#"
heard = []
for step in range(1, 36001):
    say({"time": step / 10})
    if step == 1: command(7.0)
    if step == 3 or step == 4: say({"publish": [{"topic": "zones/Z1", "value": {"level": 1.0, "count": step}}]})
    if step == 3: heard += hear()["deliver"]
    if step == 4: heard += hear()["deliver"] + hear()["deliver"]
topics = [message["topic"] for message in heard]
assert topics == ["zones/Z1", "arm/command", "zones/Z1"], topics
command(8.0)
sys.stdin.readline()
"#;
    let Some((observed, took)) = free_running(r#", "clock": True"#, after) else { return };
    assert_eq!(observed.outcome, Outcome::Completed);
    assert!(took < 120.0, "{took} s");
    assert_eq!(observed.end, 3600.0);
    assert_eq!(observed.metrics[1].series, [(0.1, 7.0)]);
}

#[test]
fn a_free_running_simulator_is_told_what_its_nodes_are_to_do_also_while_it_is_silent() {
    let after = r#"
def orders(*expected):
    heard = hear()["orders"]
    assert heard == list(expected), heard
command(1.0)
assert hear()["deliver"]
orders({"node": "arm", "order": "pause"})
orders({"node": "arm", "order": "resume"})
say({"done": {"ended": True}})
"#;
    let pause = operation(0, OperationKind::Pause { node: NodeId(0) });
    let uses = vec![use_of(0, 0.1, 0.3, vec![], 1)];
    let Some((observed, took)) = free_running_in(vec![pause], uses, r#", "nodes": {"arm": ["pause"]}"#, after) else {
        return;
    };
    assert_eq!(observed.outcome, Outcome::Completed);
    assert_eq!(observed.operations[0].counters.side_effects, 1);
    assert!(took >= 0.3, "{took}");
}

#[test]
fn what_a_free_running_simulator_does_wrong_is_reported_with_a_remedy() {
    let mut reported = Vec::new();
    for (ready, after) in [
        ("", "say({'time': 1.0})"),
        (", 'clock': True", "say({'time': 1.0})\nsay({'time': 0.5})"),
        ("", "say({'done': {}})"),
        ("", "say({'ready': {}})"),
        ("", "say({'failed': 'the map is missing'})"),
        ("", "print('Loading map', flush=True)"),
        ("", "sys.exit(3)"),
    ] {
        let Some((observed, _)) = free_running(ready, after) else { return };
        match observed.outcome {
            // A clock that goes back is not known to be the system's fault.
            Outcome::Crash { message } | Outcome::WrongClock { message } => reported.push(message),
            other => panic!("{after}: {other:?}"),
        }
    }
    insta::assert_snapshot!(reported.join("\n"));
}

#[test]
fn a_free_running_simulator_that_resets_is_started_once_and_its_late_messages_are_discarded() {
    if !python() {
        return;
    }
    let program = r#"
import json, sys
def say(what): print(json.dumps(what), flush=True)
open("starts", "a").write("x")
TOPICS = ["arm/command", "zones/Z1", "zones/Z2"]
for line in sys.stdin:
    request = json.loads(line)
    if "reset" in request:
        say({"ready": {"publishes": TOPICS, "subscribes": TOPICS, "resets": True, "clock": True}})
        say({"publish": [{"topic": "arm/command", "value": request["reset"]["seed"]}]})
        say({"time": 2.0})
        say({"publish": [{"topic": "arm/command", "value": 99}]})
"#;
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("sim.py"), program).unwrap();
    let plan = plan_of("python3", &["sim.py"]);
    let mut transport =
        FreeRunning::new(&plan, program_of(&plan, folder.path().to_owned()), launched_of(&plan, folder.path()));
    let wires = WireTable::new(&plan);
    let metrics = MetricTable::new(&plan, &wires, &[]).unwrap();
    for seed in [3, 4] {
        let observed =
            evaluate(&plan, &wires, &metrics, &mut transport, &test_of(Vec::new()), seed, &mut Custom::none()).unwrap();
        assert_eq!((observed.outcome, observed.end), (Outcome::Completed, 1.0));
        assert_eq!(observed.metrics[1].series, [(0.0, seed as f64)]);
    }
    assert_eq!(std::fs::read(folder.path().join("starts")).unwrap(), b"x");
}
