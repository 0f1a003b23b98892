//! Simulators that are real processes, correct and faulty ones. They are written in Python.

#![expect(clippy::disallowed_types, reason = "a test that looks for Python starts it")]

use std::path::Path;
use std::process::Command;
use std::sync::Arc;
use std::time::{Duration, Instant};

use sesame_base::observation::{Observation, Outcome};
use sesame_patience as patience;
use sesame_plan::condition::{Comparison, Condition, Operand};
use sesame_plan::testing::{latency, node, operation, plan, test_of, use_of};
use sesame_plan::{
    CampaignPlan, Choice, Distribution, Drain, NodeId, Operation, OperationKind, Span, Test, TestOperation,
    Transport as Declared,
};

use super::*;
use crate::evaluate::{Custom, Run, evaluate, evaluate_tapped};
use crate::metric::MetricTable;
use crate::relay::Listener;
use crate::transport::Incidents;
use crate::value::Value;
use crate::wire::{Wire, WireTable};

mod freely;

/// Says what a simulator of the fixture's plan says first, and then does something else with each order.
const FRAME: &str = r#"
import json, sys
def say(what): print(json.dumps(what), flush=True)
TOPICS = ["arm/command", "zones/Z1", "zones/Z2"]
for line in sys.stdin:
    order = json.loads(line)
    if "reset" in order:
        count = order["reset"]["seed"]
        say({"ready": {"publishes": TOPICS, "subscribes": TOPICS, "resets": RESETS}})
        continue
    time = order["step"]["time"]
    count += 1
"#;

const STEP: &str = r#"
    say({"publish": [{"topic": "arm/command", "value": count}]})
    received = json.loads(sys.stdin.readline())["deliver"]
    assert received == [{"topic": "arm/command", "value": count}], received
    say({"done": {}})
"#;

/// Whether there is a Python here. In the pipeline there must be.
fn python() -> bool {
    let found = Command::new("python3").arg("--version").output().is_ok_and(|output| output.status.success());
    assert!(found || std::env::var_os("CI").is_none(), "python3 is needed");
    if !found {
        eprintln!("skipped: there is no python3 here");
    }
    found
}

fn plan_of(program: &str, arguments: &[&str]) -> CampaignPlan {
    let mut plan = plan(Vec::new());
    plan.campaign.end_after = 1.0;
    plan.simulator.transport = Declared::Process {
        program: program.to_owned(),
        arguments: arguments.iter().map(|&argument| argument.to_owned()).collect(),
        step_ns: Some(100_000_000),
    };
    plan
}

/// The transport of a plan whose program is stepped.
fn stepped(plan: &CampaignPlan, folder: PathBuf) -> LockStepped {
    let launched = launched_of(plan, &folder);
    LockStepped::new(plan, program_of(plan, folder), launched, SimTime::from_nanos(100_000_000))
}

fn launched_of(plan: &CampaignPlan, folder: &Path) -> Launched {
    Launched::new(plan, LaunchContext { in_runner: false, ..LaunchContext::of_worker(folder.to_owned()) })
}

fn program_of(plan: &CampaignPlan, folder: PathBuf) -> Program {
    let Declared::Process { program, arguments, .. } = plan.simulator.transport.clone() else { unreachable!() };
    Program { name: program, arguments, folder, environment: Vec::new(), in_runner: false }
}

fn run(transport: &mut LockStepped, seed: u64) -> Observation {
    run_of(transport, &test_of(Vec::new()), seed)
}

fn run_of(transport: &mut LockStepped, test: &Test, seed: u64) -> Observation {
    let plan = transport.plan.clone();
    let wires = WireTable::new(&plan);
    let metrics = MetricTable::new(&plan, &wires, &[]).unwrap();
    evaluate(&plan, &wires, &metrics, transport, test, seed, &mut Custom::none()).unwrap()
}

/// A Python program as the simulator, in a folder of its own.
struct Python {
    folder: tempfile::TempDir,
    transport: LockStepped,
}

fn python_of(program: &str) -> Option<Python> {
    if !python() {
        return None;
    }
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("sim.py"), program.replace("RESETS", "True")).unwrap();
    let transport = stepped(&plan_of("python3", &["sim.py"]), folder.path().to_owned());
    Some(Python { folder, transport })
}

/// The cause of the crash of a simulator that steps like this.
fn crash(step: &str) -> Option<String> {
    let mut python = python_of(&format!("{FRAME}{step}"))?;
    match run(&mut python.transport, 1).outcome {
        Outcome::Crash { message } => Some(message),
        other => panic!("{other:?} is not a crash"),
    }
}

#[test]
fn a_run_goes_to_its_end_with_every_message_delivered_in_its_step() {
    let Some(mut python) = python_of(&format!("{FRAME}{STEP}")) else { return };
    let observation = run(&mut python.transport, 10);
    assert_eq!(observation.outcome, Outcome::Completed);
    assert_eq!((observation.end, observation.messages), (1.0, 10));
    assert_eq!(observation.metrics[1].value, Some(20.0));
}

/// The plan of the examples of the documentation.
fn cart(program: &str) -> CampaignPlan {
    let mut plan = plan_of("python3", &[program]);
    plan.topics.truncate(1);
    plan.topics[0].paths = vec!["cart/target".to_owned()];
    plan.topics.push(plan.topics[0].clone());
    plan.topics[1].paths = vec!["cart/position".to_owned()];
    plan.metrics[1].source = sesame_plan::MetricSource::Last {
        input: sesame_plan::FieldRef { topic: sesame_plan::TopicId(1), path: vec![] },
    };
    plan
}

#[test]
fn the_example_of_the_documentation_is_a_simulator() {
    if !python() {
        return;
    }
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("src/transport/process");
    let plan = cart("minimal.py");
    let mut transport = stepped(&plan, folder);
    let first = run(&mut transport, 1);
    assert_eq!(first.outcome, Outcome::Completed);
    let position = (0..10).fold(0.0, |position: f64, _| position + (1.0 - position) * 0.1);
    assert_eq!(first.metrics[1].value, Some(position));
    assert_eq!(run(&mut transport, 1).metrics, first.metrics, "it begins anew");
}

#[test]
fn the_example_of_the_documentation_does_to_its_node_what_operations_want() {
    if !python() {
        return;
    }
    let node = NodeId(0);
    let mut plan = cart("nodes.py");
    plan.nodes = vec![sesame_plan::testing::node("controller")];
    plan.operations = [OperationKind::Pause { node }, OperationKind::Slow { node }, OperationKind::Kill { node }]
        .map(|kind| operation(0, kind))
        .to_vec();
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("src/transport/process");
    let mut transport = stepped(&plan, folder);
    // A run has ten steps, and the controller counts its own.
    let mut ticks = |uses| {
        let observed = run_of(&mut transport, &test_of(uses), 1);
        assert_eq!(observed.outcome, Outcome::Completed);
        observed.metrics[1].value.map(|position| (position * 10.0).round())
    };
    assert_eq!(ticks(vec![]), Some(10.0));
    assert_eq!(ticks(vec![use_of(0, 0.2, 0.6, vec![], 1)]), Some(6.0));
    assert_eq!(ticks(vec![use_of(1, 0.2, 0.6, vec![Choice::Value { value: 0.25 }], 1)]), Some(7.0));
    assert_eq!(ticks(vec![use_of(2, 0.2, 0.6, vec![], 1)]), Some(5.0));
}

#[test]
fn the_free_running_example_of_the_documentation_is_a_simulator() {
    if !python() {
        return;
    }
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("src/transport/process");
    let mut plan = cart("free_running.py");
    // It ends when the cart moves: how long that takes is up to the machine.
    plan.campaign.end_after = 600.0;
    let (left, right) = (Operand::Variable(sesame_plan::MetricId(1)), Operand::Number(0.0));
    plan.campaign.end_when = Some(Condition::Compare { left, by: Comparison::Above, right });
    let mut transport = FreeRunning::new(&plan, program_of(&plan, folder.clone()), launched_of(&plan, &folder));
    let wires = WireTable::new(&plan);
    let metrics = MetricTable::new(&plan, &wires, &[]).unwrap();
    let observed =
        evaluate(&plan, &wires, &metrics, &mut transport, &test_of(Vec::new()), 1, &mut Custom::none()).unwrap();
    assert_eq!(observed.outcome, Outcome::Completed);
    assert!(observed.end < 600.0, "the target came back through the relay, and the cart moves");
    assert_eq!(observed.metrics[1].value, Some(0.05));
}

#[test]
fn a_simulator_that_resets_is_started_once_and_another_for_each_run() {
    let program = format!("open('starts', 'a').write('x')\n{FRAME}{STEP}");
    for (resets, starts) in [("True", 1), ("False", 3)] {
        let Some(mut python) = python_of(&program.replace("RESETS", resets)) else { return };
        let runs: Vec<_> = (0..3).map(|_| run(&mut python.transport, 10)).collect();
        assert!(runs.iter().all(|run| run.outcome == Outcome::Completed && run.metrics == runs[0].metrics));
        let started = std::fs::read(python.folder.path().join("starts")).unwrap();
        assert_eq!(started.len(), starts, "resets: {resets}");
    }
}

#[test]
fn what_simulators_do_wrong_is_said_with_place_and_remedy() {
    let steps = [
        ("prints", "    print('hello')\n    say({'done': {}})"),
        ("raises", "    if time > 0.25: raise ValueError('out of the world')\n    say({'done': {}})"),
        ("exits", "    sys.exit(3)"),
        ("fails in words", "    say({'failed': 'the map is missing'})"),
        ("is killed", "    import os, signal\n    os.kill(os.getpid(), signal.SIGKILL)"),
        ("floods a line", "    while True: sys.stdout.write('x' * 65536)"),
    ];
    let mut said = Vec::new();
    for (what, step) in steps {
        let Some(crash) = crash(step) else { return };
        // How much a traceback shows differs from one Python to the next.
        let lines = crash.lines().filter(|line| !line.trim_start().starts_with(['F', '^']));
        said.push(format!("{what}: {}", lines.collect::<Vec<_>>().join("\n")));
    }
    insta::assert_snapshot!(said.join("\n"));
}

#[test]
fn a_simulator_that_closes_its_output_and_stays_is_ended() {
    let step = "    import os, time\n    os.close(1)\n    time.sleep(1000)";
    let Some(crash) = crash(step) else { return };
    assert!(
        crash.contains("closed its standard output, but did not exit, while the end of its step to 0.100 s"),
        "{crash}"
    );
}

#[test]
fn the_next_run_begins_with_a_new_process_after_a_crash() {
    let step = format!("    if count == 5: sys.exit(1)\n{STEP}");
    let Some(mut python) = python_of(&format!("{FRAME}{step}")) else { return };
    assert!(matches!(run(&mut python.transport, 1).outcome, Outcome::Crash { .. }));
    assert_eq!(run(&mut python.transport, 10).outcome, Outcome::Completed);
}

#[cfg(unix)]
#[test]
fn a_simulator_that_ends_has_ended_even_if_a_child_holds_its_output() {
    let step = "    import subprocess\n    print('the last words', file=sys.stderr)\n    \
                say({'publish': []})\n    subprocess.Popen(['sleep', '1000'])\n    sys.exit(3)";
    let started = Instant::now();
    let Some(crash) = crash(step) else { return };
    assert_eq!(
        crash,
        "the simulator `python3 sim.py` ended (exit status: 3) while the end of its step to 0.100 s was awaited; the last \
         lines of its standard error:\nthe last words"
    );
    assert!(started.elapsed() < patience::LIMIT, "and not only when the child ends");
}

#[cfg(unix)]
#[test]
fn that_a_simulator_was_killed_is_told_apart_from_other_ends() {
    for (signal, killed) in [("SIGKILL", true), ("SIGTERM", false)] {
        let step = format!("    import os, signal\n    os.kill(os.getpid(), signal.{signal})");
        let Some(mut python) = python_of(&format!("{FRAME}{step}")) else { return };
        assert!(matches!(run(&mut python.transport, 1).outcome, Outcome::Crash { .. }));
        assert_eq!(python.transport.incidents(), Incidents { killed, notes: Vec::new() });
        assert_eq!(python.transport.incidents(), Incidents::default(), "it is reported once");
    }
}

/// Runs a simulator three times that does this at the end of its first run; the crashes, and what is noted of the
/// others. A `surplus` answer belongs to the first run, whose end waits for it.
fn after_the_last_answer(what: &str, surplus: bool) -> Option<(Vec<Option<String>>, Vec<String>)> {
    let program = format!(
        "import os\nfrom time import sleep\n{}",
        FRAME
            .replace("    if \"reset\" in order:", "    if AT_RESET: AT_RESET.pop()()\n    if \"reset\" in order:")
            .replace("for line in", "AT_RESET = []\nfor line in")
    );
    let step = format!("{STEP}    if time > 0.99 and count == 11:\n        {what}\n");
    let mut python = python_of(&format!("{program}{step}"))?;
    let mut notes = Vec::new();
    let crashes = [1, 20, 30].map(|seed| {
        let usual = python.transport.surplus;
        if surplus && seed == 1 {
            python.transport.surplus = (patience::LIMIT, patience::LIMIT);
        }
        let outcome = run(&mut python.transport, seed).outcome;
        python.transport.surplus = usual;
        if what.contains(LATE) && seed == 1 {
            let file = |name| python.folder.path().join(name);
            std::fs::write(file("over"), "").unwrap();
            patience::until("it has spoken late", || file("spoken").exists());
        }
        notes.extend(python.transport.incidents().notes);
        match outcome {
            Outcome::Crash { message } => Some(message),
            Outcome::Completed => None,
            other => panic!("{other:?}"),
        }
    });
    Some((crashes.to_vec(), notes))
}

/// Waits until the run is over.
const LATE: &str = "while not os.path.exists('over'): sleep(0.005)";

#[cfg(unix)]
#[test]
fn an_answer_too_many_is_the_crash_of_its_own_run_and_no_fault_of_the_next() {
    let Some((crashes, notes)) = after_the_last_answer("say({'done': {}})", true) else { return };
    let crash = "line 22 since the simulator's reset comes after everything was answered: `{\"done\": {}}`; give one \
                 answer to each line; in this test there is one too many";
    assert_eq!(crashes, [Some(crash.to_owned()), None, None]);
    assert!(notes.is_empty(), "{notes:?}");
}

#[test]
fn what_a_simulator_does_between_two_runs_is_noted_and_the_next_begins_with_a_new_process() {
    let before = "the simulator was restarted before this test, because of a fault after the previous one: ";
    let late = format!("{LATE}\n        say({{'done': {{}}}})\n        open('spoken', 'w')");
    for (what, noted) in [
        (late.as_str(), "comes after everything was answered"),
        (
            "sys.exit(4)",
            "the simulator `python3 sim.py` ended (exit status: 4) while its answer to `reset` was awaited",
        ),
        ("AT_RESET.append(lambda: say({'done': {}}))", "says `done` while its answer to `reset` was awaited"),
        ("AT_RESET.append(lambda: print('Loading map', flush=True))", "is not JSON: `Loading map`"),
    ] {
        let Some((crashes, notes)) = after_the_last_answer(what, false) else { return };
        assert_eq!(crashes, [None, None, None], "{what}: {notes:?}");
        let [note] = &notes[..] else { panic!("{what}: {notes:?}") };
        assert!(note.starts_with(before) && note.contains(noted), "{what}: {note}");
    }
}

#[test]
fn a_program_that_is_not_there_is_named() {
    let folder = tempfile::tempdir().unwrap();
    let start = |program: &str, folder: &Path| {
        let mut transport = stepped(&plan_of(program, &["a b", "c"]), folder.to_owned());
        match run(&mut transport, 1).outcome {
            Outcome::Crash { message } => message.replace(&*folder.to_string_lossy(), "FOLDER"),
            other => panic!("{other:?} is not a crash"),
        }
    };
    std::fs::write(folder.path().join("data"), "").unwrap();
    let said = [
        start("no_such_program", folder.path()),
        start("./data", folder.path()),
        start("sim", &folder.path().join("gone")).replace("FOLDER/gone", "FOLDER"),
    ];
    insta::assert_snapshot!(said.join("\n"));
}

#[cfg(unix)]
#[test]
fn closing_ends_what_the_simulator_started_too() {
    let program = format!(
        "import subprocess\nchild = subprocess.Popen(['sleep', '1000'])\nopen('child', 'w').write(str(child.pid))\n{FRAME}{STEP}"
    );
    let Some(mut python) = python_of(&program) else { return };
    assert_eq!(run(&mut python.transport, 1).outcome, Outcome::Completed);
    let id: i32 = std::fs::read_to_string(python.folder.path().join("child")).unwrap().parse().unwrap();
    let id = rustix::process::Pid::from_raw(id).unwrap();
    assert!(rustix::process::test_kill_process(id).is_ok(), "it lives as long as the simulator");
    python.transport.close();
    // It is killed; the process that inherited it may need a moment to notice.
    let gone = || {
        let status = std::fs::read_to_string(format!("/proc/{}/stat", id.as_raw_pid())).unwrap_or_default();
        rustix::process::test_kill_process(id).is_err() || status.contains(") Z ")
    };
    patience::until("its child is gone", gone);
}

#[test]
fn the_simulator_knows_the_folder_of_its_worker_and_not_the_workers_secret() {
    let step = "    import os\n    say({'failed': str([os.path.isdir(os.environ['SESAME_WORKER_FOLDER']), \
                'SESAME_WORKER_TOKEN' in os.environ, os.path.isfile('sim.py')])})";
    let Some(crash) = crash(step) else { return };
    assert_eq!(crash, "the simulator failed: [True, False, True]");
}

#[test]
fn connections_of_several_threads_do_not_meet() {
    if !python() {
        return;
    }
    let program = Arc::new(format!("{FRAME}{STEP}"));
    let threads: Vec<_> = (0..3u64)
        .map(|seed| {
            let program = Arc::clone(&program);
            std::thread::spawn(move || {
                let mut python = python_of(&program).expect("Python is there");
                run(&mut python.transport, seed).metrics[1].value
            })
        })
        .collect();
    let values: Vec<_> = threads.into_iter().map(|thread| thread.join().unwrap()).collect();
    assert_eq!(values, [Some(10.0), Some(11.0), Some(12.0)]);
}

/// What a program in Python is launched with, ready at the line `up`.
fn launch_of(program: &str) -> sesame_plan::Launch {
    let arguments = ["-u", "-c", program].map(str::to_owned).to_vec();
    sesame_plan::Launch {
        command: sesame_plan::Command { program: "python3".to_owned(), arguments },
        ready: Some(sesame_plan::Ready { when: sesame_plan::ReadyWhen::Line { text: "up".to_owned() }, within: 120.0 }),
    }
}

/// A stepped simulator in addition to which this is launched.
fn launching(resets: &str, step: &str, launched: &str) -> Option<Python> {
    if !python() {
        return None;
    }
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("sim.py"), format!("{FRAME}{step}").replace("RESETS", resets)).unwrap();
    let mut plan = plan_of("python3", &["sim.py"]);
    plan.simulator.lifecycle.launch = Some(launch_of(launched));
    let transport = stepped(&plan, folder.path().to_owned());
    Some(Python { folder, transport })
}

#[test]
fn what_is_launched_is_there_before_the_simulator_and_anew_for_each_test_unless_it_resets() {
    // It takes a moment, so that a simulator that did not wait for it would miss it. Nothing else depends on how long.
    let launched = "import time\ntime.sleep(0.2)\nopen('launched', 'a').write('x')\nprint('up')\ntime.sleep(1000)";
    let step = format!("    assert open('launched').read()\n{STEP}");
    for (resets, starts) in [("True", 1), ("False", 3)] {
        let Some(mut python) = launching(resets, &step, launched) else { return };
        for _ in 0..3 {
            assert_eq!(run(&mut python.transport, 10).outcome, Outcome::Completed);
        }
        let started = std::fs::read(python.folder.path().join("launched")).unwrap();
        assert_eq!(started.len(), starts, "resets: {resets}");
        python.transport.close();
        assert!(!python.transport.launched.is_started());
    }
}

/// A program that is ready, and ends when the simulator waits.
const BROKEN_BRIDGE: &str = "import os, time\nprint('up')\nwhile not os.path.exists('waits'): time.sleep(0.005)\n\
                             raise SystemExit('the bridge broke')";

#[test]
fn the_end_of_what_was_launched_is_a_crash_even_if_the_simulator_waits_for_it_for_ever() {
    let step = "    open('waits', 'w')\n    __import__('time').sleep(1000)";
    let Some(mut python) = launching("True", step, BROKEN_BRIDGE) else { return };
    let started = Instant::now();
    let Outcome::Crash { message } = run(&mut python.transport, 1).outcome else { panic!("it is a crash") };
    assert!(
        message.contains("of the system ended (exit status: 1); the last lines that it wrote:\nup\nthe bridge broke")
    );
    assert!(started.elapsed() < patience::LIMIT, "and not only when the simulator ends");
}

#[test]
fn what_is_launched_ends_a_free_running_simulator_too() {
    if !python() {
        return;
    }
    let folder = tempfile::tempdir().unwrap();
    let program = "import json, sys, time\nT = ['arm/command', 'zones/Z1', 'zones/Z2']\nsys.stdin.readline()\n\
                   print(json.dumps({'ready': {'publishes': T, 'subscribes': T, 'clock': True}}), flush=True)\nopen('waits', 'w')\n\
                   time.sleep(1000)";
    std::fs::write(folder.path().join("sim.py"), program).unwrap();
    let mut plan = plan_of("python3", &["sim.py"]);
    let Declared::Process { step_ns, .. } = &mut plan.simulator.transport else { unreachable!() };
    *step_ns = None;
    plan.simulator.lifecycle.launch = Some(launch_of(BROKEN_BRIDGE));
    let mut transport = transport(&plan, folder.path().to_owned(), false);
    let wires = WireTable::new(&plan);
    let metrics = MetricTable::new(&plan, &wires, &[]).unwrap();
    let test = test_of(Vec::new());
    let observed = evaluate(&plan, &wires, &metrics, transport.as_mut(), &test, 1, &mut Custom::none()).unwrap();
    let Outcome::Crash { message } = observed.outcome else { panic!("{:?} is not a crash", observed.outcome) };
    assert!(message.contains("the bridge broke"), "{message}");
}

/// A free-running simulator that publishes four messages on a topic that it subscribes to, and ends when it has heard
/// them.
const ECHO: &str = r#"
import json, sys
def say(what): print(json.dumps(what), flush=True)
TOPICS = ["arm/command", "zones/Z1", "zones/Z2"]
for line in sys.stdin:
    if "reset" in json.loads(line):
        say({"ready": {"publishes": TOPICS, "subscribes": ["arm/command"], "clock": True, "resets": True}})
        for at in range(4):
            say({"publish": [{"topic": "arm/command", "value": at}]})
            sys.stdin.readline()
        say({"done": {"ended": True}})
"#;

#[test]
fn what_a_slow_listener_adds_is_measured_on_the_wire_of_each_message_and_handed_out_once() {
    struct Slow;
    impl Listener for Slow {
        #[expect(clippy::disallowed_methods, reason = "it is slow on purpose")]
        fn published(&mut self, _: SimTime, _: Wire, _: u64, _: &Value) {
            std::thread::sleep(Duration::from_millis(20));
        }
        fn delivered(&mut self, _: SimTime, _: Wire, _: u64, _: &Value) {}
    }
    if !python() {
        return;
    }
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("sim.py"), ECHO).unwrap();
    let mut plan = plan_of("python3", &["sim.py"]);
    let Declared::Process { step_ns, .. } = &mut plan.simulator.transport else { unreachable!() };
    *step_ns = None;
    let mut transport = transport(&plan, folder.path().to_owned(), false);
    let wires = WireTable::new(&plan);
    let metrics = MetricTable::new(&plan, &wires, &[]).unwrap();
    let test = test_of(Vec::new());
    let run = Run { test: &test, simulator_seed: 1, withheld: &[], lists_altered: false };
    for _ in 0..2 {
        let mut custom = Custom::none();
        let observed = evaluate_tapped(&plan, &wires, &metrics, transport.as_mut(), &run, &mut custom, Some(&mut Slow));
        assert_eq!(observed.unwrap().outcome, Outcome::Completed);
        let added = transport.added();
        let [on_wire] = &added[..] else { panic!("one wire has subscribers: {added:?}") };
        assert_eq!((on_wire.path.as_str(), on_wire.latencies.messages()), ("arm/command", 4));
        let half = on_wire.latencies.percentile(50).unwrap();
        assert!(half > 0.019, "{half}");
        assert!(transport.added().is_empty());
        assert_eq!(transport.incidents().notes, [""; 0], "there is no budget");
    }
}
