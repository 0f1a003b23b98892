//! A monitor as a program of its own decides what the runner's own monitor decides.

use std::fs;
use std::path::Path;

use serde_json::Value;
use sesame_tests::{Done, Project, command, done, fresh_folder, workspace};

use crate::monitors::rows;

/// The space of a robot that a monitor stops, with these monitors and this simulator.
fn space(simulator: &str, more_topics: &str, monitors: &str) -> String {
    format!(
        r#"space alone
system {{
  simulator cell = process {simulator}
  message Drive {{ speed: real[m/s]  gear: int }}
  topic light = "camera/light"   : int
  topic gap   = "cell/gap"       : real[m]
  topic drive = "robot/drive"    : Drive
  topic lamp  = "robot/lamp"     : bool
  topic state = "eddi/transport" : int
  {more_topics}
}}
{monitors}
metric nearest minimise default 10m = min(gap)
metric dark_lamp                    = count(not lamp)
metric fuzzing_time minimise        = fuzzing_time()
operation dazzle on light = stuck at [190, 210]
operation late   on light = latency [0ms, 500ms]
operation lose   on light = packet loss [0%, 100%]
operation drop   on drive = packet loss [0%, 100%]
test blinded {{ dazzle value 200 from 4s to 12s }}
test delayed {{ late delay 135ms from 2s to 9s }}
test lost    {{ lose loss 60% from 1s to 12s }}
test driven  {{ drop loss 100% from 4s to 6s }}
campaign watch {{
  objectives nearest, fuzzing_time
  observes   dark_lamp
  operations dazzle, late, lose, drop 1..2 per test
  search     random {{ evaluations 4  seed 5 }}
  end        after 13s
  record     mcap all
}}
"#
    )
}

const BUILT_IN: &str = r"
/// Stops the robot.
eddi transport publishes state {
  demand    sees from eddi camera
  evidence  far = gap > 500mm
  guarantee fast  integrity 2 = sees and far
  otherwise halted  mitigate with drive.speed = 0m/s
}
eddi camera publishes sight {
  evidence  clear  = light > 180
  evidence  bright = light > 120  held 330ms  stale after 250ms is unknown
  guarantee sees_well  integrity 2 = bright and clear
  guarantee sees       integrity 1 = bright
  otherwise blind
}
";

const EXTERNAL: &str = "eddi transport external on state { guarantee fast integrity 2  otherwise halted }";

/// A project in a folder of its own, with the simulator of the robot.
fn project(name: &str, space: &str) -> Project {
    let folder = fresh_folder(name);
    fs::copy(workspace().join("tests/simulators/watched/sim.py"), folder.join("sim.py")).unwrap();
    fs::copy(workspace().join("tests/simulators/watched/freely.py"), folder.join("freely.py")).unwrap();
    fs::write(folder.join("alone.sesame"), space).unwrap();
    Project { space: folder.join("alone.sesame"), runners: folder.join("runners"), folder }
}

fn on(program: &Path, recording: &Path) -> Done {
    done(command(program).args(["--format", "json", "--recording"]).arg(recording))
}

/// Decisions in lines of JSON, of one run if it is named: time, monitor, state.
fn decisions(lines: &str, run: Option<u64>) -> Vec<String> {
    let parsed = lines.lines().map(|line| serde_json::from_str::<Value>(line).unwrap());
    let of_run = parsed.filter(|line| run.is_none() || line["run"].as_u64() == run);
    let mut all: Vec<(f64, String, String)> = of_run
        .map(|line| {
            let text = |key: &str| line[key].as_str().unwrap().to_owned();
            (line["time_s"].as_f64().unwrap(), text("monitor"), text("state"))
        })
        .collect();
    // As the query below has them; decisions of one monitor at one moment stay in order.
    all.sort_by(|a, b| (a.0.total_cmp(&b.0)).then_with(|| a.1.cmp(&b.1)));
    all.into_iter().map(|(time, monitor, state)| format!("{time:?} {monitor} {state}")).collect()
}

/// The same as results have them.
fn recorded(results: &Path, test: &str) -> Vec<String> {
    let of = "SELECT time_s || ' ' || monitor || ' ' || state FROM decisions WHERE test_name =";
    rows(results, &format!("{of} '{test}' ORDER BY time_s, monitor, position"))
}

#[test]
fn beside_the_cell_and_on_recordings_it_decides_what_the_runner_decides() {
    let python = r#""python3" "sim.py" { step 100ms }"#;
    let inside = project("alone_inside", &space(python, "topic sight = \"eddi/sight\" : text", BUILT_IN));
    inside.sesamec("known", &["-c", "watch", "--workers", "1"]).expect(0);
    let results = inside.runners.join("watch/results/known");
    let program = inside.monitor("transport");
    // On recordings.
    let tests = ["T0", "T1", "T2", "T3", "T4"];
    for test in tests {
        let trace = results.join(format!("traces/{test}.mcap"));
        let again = on(&program, &trace).expect(0);
        assert_eq!(decisions(&again.out, None), recorded(&results, test), "{test}");
    }
    let text = done(command(&program).arg("--recording").arg(results.join("traces/T0.mcap"))).expect(0).out;
    let first: Vec<&str> = text.lines().take(5).collect();
    let expected = [
        "0 s  camera  blind",
        "0 s  transport  halted",
        "0.43 s  camera  sees_well  camera.bright is true (held long enough)",
        "0.43 s  transport  fast  camera.bright is true (held long enough)",
        "4 s  camera  sees  camera.clear is false (message 39 on camera/light)",
    ];
    assert_eq!(first, expected);
    // Beside the cell.
    let shown = program.display();
    let beside = format!(r#""{shown}" "--decisions" "decisions.json" "--" "python3" "sim.py" {{ step 100ms }}"#);
    let outside = project("alone_outside", &space(&beside, "", EXTERNAL));
    outside.sesamec("known", &["-c", "watch", "--workers", "1"]).expect(0);
    let theirs = outside.runners.join("watch/results/known");
    let lines = fs::read_to_string(outside.folder.join("decisions.json")).unwrap();
    for (run, test) in (1..).zip(tests) {
        assert_eq!(decisions(&lines, Some(run)), recorded(&results, test), "{test}");
        // What others hear of it comes at the ends of steps.
        let states = |results: &Path| {
            let of = "SELECT state FROM decisions WHERE monitor = 'transport' AND test_name =";
            rows(results, &format!("{of} '{test}' ORDER BY position"))
        };
        assert_eq!(states(&theirs), states(&results), "{test}");
    }
    // Nothing else of the tests has changed: what is sent to stop the robot stops it at the same moment.
    let metrics = "SELECT name || ' ' || nearest || ' ' || dark_lamp || ' ' || outcome FROM results ORDER BY number";
    assert_eq!(rows(&theirs, metrics), rows(&results, metrics));
    assert!(recorded(&results, "T1") != recorded(&results, "T0"), "operations matter");
}

#[test]
fn beside_a_cell_that_runs_freely_it_decides_what_the_recording_shows() {
    let python = r#""python3" "freely.py" { free running }"#;
    // Both hear the camera in wall time, and each of them when its process has its turn: what is stale would be so for
    // one of them alone if a message were as late as that.
    let monitors = BUILT_IN.replace("stale after 250ms", "stale after 1500ms");
    assert!(monitors != BUILT_IN);
    let inside = project("alone_inside_freely", &space(python, "topic sight = \"eddi/sight\" : text", &monitors));
    let program = inside.monitor("transport");
    let shown = program.display();
    let beside = format!(r#""{shown}" "--decisions" "decisions.json" "--" "python3" "freely.py" {{ free running }}"#);
    let external = space(&beside, "", EXTERNAL).replace("after 13s", "after 6s");
    let external = external.replace("from 4s to 12s", "from 1s to 3s");
    let outside = project("alone_outside_freely", &external);
    outside.sesamec("known", &["-c", "watch", "blinded", "--workers", "1"]).expect(0);
    let traces = outside.runners.join("watch/results/known/traces");
    let lines = fs::read_to_string(outside.folder.join("decisions.json")).unwrap();
    // The simulator cannot be reset, so each test has a process of its own, and the last one has written the file.
    // The monitor goes on until it is ended, a moment after the test.
    let within = |mut all: Vec<String>| {
        all.retain(|line| line.split(' ').next().unwrap().parse::<f64>().unwrap() < 5.9);
        all
    };
    let decided = within(decisions(&lines, Some(1)));
    let on_recording = |test: &str| {
        let trace = traces.join(format!("{test}.mcap"));
        within(decisions(&on(&program, &trace).expect(0).out, None))
    };
    assert!([on_recording("T0"), on_recording("T1"), on_recording("T2")].contains(&decided), "{decided:#?}");
    let silent = decided.iter().any(|line| line.ends_with("camera blind") && !line.starts_with("0.0"));
    assert!(decided.len() > 6 && silent, "{decided:#?}");
}

#[test]
fn what_cannot_be_generated_or_run_is_said_with_a_remedy() {
    let python = r#""python3" "sim.py" { step 100ms }"#;
    let inside = project("alone_refused", &space(python, "topic sight = \"eddi/sight\" : text", BUILT_IN));
    let refused = |name: &str| inside.sesamec("generate", &["--eddi", name]).expect(1).err;
    assert!(
        refused("transprot").contains("no monitor `transprot`; did you mean `transport`?"),
        "{}",
        refused("transprot")
    );
    let outside = project("alone_refused_external", &space(python, "", EXTERNAL));
    let refused = outside.sesamec("generate", &["--eddi", "transport"]).expect(1).err;
    assert!(refused.contains("monitor `transport` is external"), "{refused}");
    let program = inside.monitor("transport");
    let said = |arguments: &[&str]| done(command(&program).args(arguments));
    assert!(said(&[]).expect(1).err.contains("give it behind `--`"));
    assert!(said(&["--recording", "gone.mcap"]).expect(1).err.contains("cannot read the recording"));
    assert!(
        said(&["--", "./no_such_program"]).expect(1).err.contains("cannot start the simulator `./no_such_program`")
    );
    assert!(said(&["--recording", "a", "--", "b"]).code == Some(2));
    let help = said(&["--help"]).expect(0).out;
    assert!(help.contains("Stops the robot.") && help.contains("It relies on `camera`"), "{help}");
}
