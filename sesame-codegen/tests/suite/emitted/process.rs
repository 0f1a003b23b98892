//! A runner for a simulator that is a program: generated, built and run, with Python on the other side.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};

use sesame_patience as patience;

/// Whether there is a Python here. In the pipeline there must be.
fn python() -> bool {
    let found = Command::new("python3").arg("--version").output().is_ok_and(|output| output.status.success());
    assert!(found || std::env::var_os("CI").is_none(), "python3 is needed");
    if !found {
        eprintln!("skipped: there is no python3 here");
    }
    found
}

/// The example `two_robots` in a folder, and the program of its campaign `crossing`.
fn built(folder: &Path) -> PathBuf {
    let example = Path::new(env!("CARGO_MANIFEST_DIR")).join("../examples/two_robots");
    for file in ["two_robots.sesame", "sim.py"] {
        fs::copy(example.join(file), folder.join(file)).unwrap();
    }
    let generated = Command::new(env!("CARGO_BIN_EXE_sesamec"))
        .args(["generate", "two_robots.sesame", "--campaign", "crossing"])
        .current_dir(folder)
        .output()
        .unwrap();
    assert!(generated.status.success(), "{}", String::from_utf8_lossy(&generated.stderr));
    let target = Path::new(env!("CARGO_TARGET_TMPDIR")).join("emitted");
    let built = Command::new(env!("CARGO"))
        .args(["build", "--offline", "--quiet", "--color", "never"])
        .args(["--config", "profile.dev.opt-level=0", "--config", "profile.dev.package.libsqlite3-sys.opt-level=0"])
        .current_dir(folder.join("runners/crossing"))
        .env("CARGO_TARGET_DIR", &target)
        .env_remove("RUSTFLAGS")
        .output()
        .unwrap();
    assert!(built.status.success(), "{}", String::from_utf8_lossy(&built.stderr));
    target.join("debug/two_robots-crossing")
}

fn run(program: &Path, arguments: &[&str]) -> String {
    let output = Command::new(program).arg("run").args(arguments).output().unwrap();
    let said = String::from_utf8_lossy(&output.stdout).into_owned();
    assert!(output.status.success(), "{said}{}", String::from_utf8_lossy(&output.stderr));
    said
}

fn digest(said: &str) -> &str {
    said.lines().find_map(|line| line.trim().strip_prefix("Digest ")).expect("a run ends with its digest")
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
    if !python() {
        return;
    }
    let folder = tempfile::tempdir().unwrap();
    let program = built(folder.path());
    let results = |name: &str| folder.path().join(name).to_str().expect("it is text").to_owned();
    let one = run(&program, &["--evaluations", "12", "--workers", "1", "--results", &results("one")]);
    let two = run(&program, &["--evaluations", "12", "--workers", "2", "--results", &results("two")]);
    assert_eq!(digest(&one), digest(&two));
    assert!(one.contains("R1") && !one.contains("crash"), "{one}");

    #[cfg(target_os = "linux")]
    no_simulator_outlives_its_worker(folder.path(), &program);
}

/// Kills a supervisor while a simulator of its workers is caught in a loop.
#[cfg(target_os = "linux")]
fn no_simulator_outlives_its_worker(folder: &Path, program: &Path) {
    fs::write(folder.join("sim.py"), CAUGHT).unwrap();
    let results = folder.join("caught");
    let mut supervisor = Command::new(program)
        .args(["run", "--workers", "1", "--results"])
        .arg(&results)
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
