//! A runner for a simulator that is a program: generated, built and run, with Python on the other side.

use std::fs;
use std::process::Stdio;

use sesame_patience as patience;
use sesame_peers::has_python3;
use sesame_tests::{Project, Runner, fresh_folder, workspace};

/// The example `two_robots` with its simulator, in a folder of its own, and the runner of its campaign `crossing`.
fn built(name: &str) -> Runner {
    let folder = fresh_folder(name);
    let example = workspace().join("examples/two_robots");
    for file in ["two_robots.sesame", "sim.py"] {
        fs::copy(example.join(file), folder.join(file)).unwrap();
    }
    Project { space: folder.join("two_robots.sesame"), runners: folder.join("runners"), folder }.build("crossing")
}

/// A simulator that notes its process, and is caught in a loop once it hears nothing in a step.
#[cfg(target_os = "linux")]
const CAUGHT: &str = r#"
import json, os, sys
def note(name): open(os.path.join(os.environ["SESAME_WORKER_FOLDER"], name), "a").write(f"{os.getpid()}\n")
def answer(what):
    print(json.dumps(what), flush=True)
    return json.loads(sys.stdin.readline() or "null")
note("started")
EAST = "robots/east/pose"
TOPICS = [EAST, "robots/north/pose", "crossing/completed"]
order = json.loads(sys.stdin.readline())
while order:
    if "reset" in order:
        order = answer({"ready": {"publishes": TOPICS, "subscribes": [EAST], "resets": True}})
        continue
    pose = {"position": [0, 0, 0], "velocity": 1}
    heard = answer({"publish": [{"topic": EAST, "value": pose}]})["deliver"]
    if not heard:
        note("caught")
        while True: pass
    results = [{"topic": "crossing/completed", "value": 50}]
    order = answer({"done": {"messages": results}})
"#;

#[test]
fn a_campaign_on_a_python_program_gives_the_same_results_on_any_number_of_workers() {
    if !has_python3() {
        return;
    }
    let runner = built("python_program");
    let one = runner.run(&["run", "--evaluations", "12", "--workers", "1", "--results", "one"]).expect(0);
    let two = runner.run(&["run", "--evaluations", "12", "--workers", "2", "--results", "two"]).expect(0);
    assert_eq!(one.digest(), two.digest());
    assert!(one.out.contains("R1") && !one.out.contains("crash"), "{}", one.out);

    #[cfg(target_os = "linux")]
    no_simulator_outlives_its_worker(&runner);
}

/// Kills a supervisor while a simulator of its workers is caught in a loop.
#[cfg(target_os = "linux")]
fn no_simulator_outlives_its_worker(runner: &Runner) {
    fs::write(runner.folder.join("sim.py"), CAUGHT).unwrap();
    let results = runner.folder.join("caught");
    let mut supervisor = runner
        .command(&["run", "--workers", "1", "--results", "caught"])
        .stdout(Stdio::null())
        .stderr(Stdio::null())
        .spawn()
        .unwrap();
    let noted = |name: &str| -> Vec<u32> {
        let text = fs::read_to_string(results.join("42/workers/1").join(name)).unwrap_or_default();
        text.lines().map(|line| line.parse().expect("it is a process")).collect()
    };
    patience::until("a simulator is caught", || {
        assert!(supervisor.try_wait().unwrap().is_none(), "nothing was lost in any test");
        !noted("caught").is_empty()
    });
    supervisor.kill().unwrap();
    supervisor.wait().unwrap();
    let lives = |process: &u32| {
        let state = fs::read_to_string(format!("/proc/{process}/stat")).unwrap_or_default();
        !state.is_empty() && !state.contains(") Z ")
    };
    assert!(!noted("started").is_empty());
    patience::until("no simulator is left", || !noted("started").iter().any(lives));
}
