//! Campaigns that need no Rust are interpreted: nothing is generated or compiled, and everything else is the same.

use std::fs;

use sesame_patience as patience;
use sesame_tests::{Done, Project, command, done, fresh_folder, sesamec, workspace};

/// A copy of the example with a simulator in Python, with fewer tests.
pub(crate) fn two_robots(name: &str) -> Project {
    let folder = fresh_folder(name);
    let example = workspace().join("examples/two_robots");
    fs::copy(example.join("sim.py"), folder.join("sim.py")).unwrap();
    let text = fs::read_to_string(example.join("two_robots.sesame")).unwrap();
    let space = folder.join("two_robots.sesame");
    fs::write(&space, text.replace("evaluations 100", "evaluations 20")).unwrap();
    Project { space, runners: folder.join("runners"), folder }
}

/// What a simulator in Python begins with: `answer` says something, and returns the next order, or nothing at the end.
const ANSWER: &str = r#"
import json, sys

def answer(what):
    print(json.dumps(what), flush=True)
    return json.loads(sys.stdin.readline() or "null")
"#;

/// A space, and its simulator in Python, `sim.py`, which begins with [`ANSWER`].
pub(crate) fn in_python(name: &str, space: &str, text: &str, simulator: &str) -> Project {
    let folder = fresh_folder(name);
    fs::write(folder.join("sim.py"), [ANSWER, simulator].concat()).unwrap();
    fs::write(folder.join(space), text).unwrap();
    Project { space: folder.join(space), runners: folder.join("runners"), folder }
}

/// `sesamec` in the project's folder, where cargo is a program that fails.
pub(crate) fn without_cargo(project: &Project, arguments: &[&str]) -> Done {
    let broken = project.folder.join("broken");
    fs::create_dir_all(&broken).unwrap();
    std::os::unix::fs::symlink("/bin/false", broken.join("cargo")).ok();
    let path = std::env::var_os("PATH").unwrap();
    let path = std::env::join_paths(std::iter::once(broken).chain(std::env::split_paths(&path))).unwrap();
    done(command(sesamec()).env("PATH", path).args(arguments).current_dir(&project.folder))
}

/// The command that a message proposes, below its text, as the arguments after the program's name.
fn proposed(said: &str) -> Vec<&str> {
    let command = said.lines().find_map(|line| line.strip_prefix("    sesamec "));
    command.unwrap_or_else(|| panic!("no command in:\n{said}")).split(' ').collect()
}

#[test]
fn an_interpreted_campaign_and_its_crate_have_the_same_digest() {
    let project = two_robots("interpreted");
    let run = ["run", "two_robots.sesame", "--campaign", "crossing"];
    let interpreted = without_cargo(&project, &run).expect(0);
    assert!(!project.runners.join("crossing/Cargo.toml").exists(), "nothing is generated");
    assert!(project.runners.join("crossing/results/42/results.sqlite").is_file());
    let built = project.run("crossing", &["--build"]).expect(0);
    assert!(project.runners.join("crossing/Cargo.toml").is_file());
    assert!(project.runners.join("crossing/results/42-2/results.sqlite").is_file(), "{}", built.out);
    assert_eq!(interpreted.digest(), built.digest());

    // Each continues and repeats what the other one recorded.
    let replay = ["replay", "two_robots.sesame", "--campaign", "crossing", "T7", "--results", "42-2"];
    without_cargo(&project, &replay).expect(0);
    let runner = project.build("crossing");
    let mut replay = command(&runner.program);
    done(replay.args(["replay", "T7", "--results"]).arg(project.runners.join("crossing/results/42"))).expect(0);
}

#[test]
fn tests_end_as_soon_as_their_condition_holds() {
    let project = two_robots("interpreted_ends");
    let text = fs::read_to_string(&project.space).unwrap();
    let mut changed = text;
    for (from, to) in [
        ("end        after 70s", "end        after 70s or when heard > 200"),
        ("  activate   by time", "  observes   heard\n  activate   by time"),
        // No trip is completed by then.
        ("requirement R2 \"All trips are made in a minute\"       = completion <= 60s", ""),
        ("metric fuzzing_time", "metric heard = count(east.position.x > -1km)\nmetric fuzzing_time"),
    ] {
        assert!(changed.contains(from), "{from}");
        changed = changed.replacen(from, to, 1);
    }
    fs::write(&project.space, changed).unwrap();
    let digests = ["1", "2"].map(|workers| {
        let run = ["run", "two_robots.sesame", "-c", "crossing", "--", "--workers", workers];
        without_cargo(&project, &run).expect(0).digest()
    });
    assert_eq!(digests[0], digests[1]);
    let show = ["show", "two_robots.sesame", "T0", "-c", "crossing", "--format", "json"];
    let shown = without_cargo(&project, &show).expect(0).json();
    assert_eq!(shown["outcome"], "completed");
    // Two hundred messages, one every 50 ms, and the one that makes it true.
    let end = shown["end"].as_f64().unwrap();
    assert!((10.0..10.2).contains(&end), "{end}");
    let heard = shown["metrics"].as_array().unwrap().iter().find(|metric| metric["metric"] == "heard").unwrap();
    assert_eq!(heard["value"], 201.0);
}

#[test]
fn an_interpreted_campaign_that_is_stopped_is_resumed_by_the_command_that_it_proposes() {
    use std::io::{BufRead as _, BufReader};
    use std::process::Stdio;

    let project = two_robots("interpreted_stopped");
    // After the first few runs its simulator stands still for as long as a file is there, and says so.
    let still = "def main():\n    import os, time\n    runs = 0\n";
    let reset = "        if \"reset\" in order:\n            runs += 1\n            \
                 while runs > 3 and os.path.exists(\"still\"):\n                \
                 open(\"stands\", \"w\")\n                time.sleep(0.005)\n";
    let simulator = project.folder.join("sim.py");
    let text = fs::read_to_string(&simulator).unwrap();
    let text = text.replacen("def main():\n", still, 1).replacen("        if \"reset\" in order:\n", reset, 1);
    assert!(text.contains("import os, time") && text.contains("stands"), "{text}");
    fs::write(&simulator, text).unwrap();
    let whole = without_cargo(&project, &["run", "two_robots.sesame", "-c", "crossing"]).expect(0);
    let mut stopped = command(sesamec());
    stopped.args(["run", "two_robots.sesame", "-c", "crossing"]).current_dir(&project.folder);
    fs::write(project.folder.join("still"), "").unwrap();
    let mut stopped = stopped.stdout(Stdio::piped()).stderr(Stdio::piped()).spawn().unwrap();
    patience::until("a test is in progress", || {
        assert!(stopped.try_wait().unwrap().is_none(), "it ended before it could be stopped");
        project.folder.join("stands").exists()
    });
    interrupt(stopped.id());
    let said: Vec<String> = BufReader::new(stopped.stderr.take().unwrap()).lines().map(Result::unwrap).collect();
    assert_eq!(stopped.wait().unwrap().code(), Some(130), "{said:?}");
    fs::remove_file(project.folder.join("still")).unwrap();
    let said = said.join("\n");
    let resumed = without_cargo(&project, &proposed(&said)).expect(0);
    assert_eq!(resumed.digest(), whole.digest());
}

/// As Ctrl-C does.
fn interrupt(process: u32) {
    let status = std::process::Command::new("kill").args(["-INT", &process.to_string()]).status().unwrap();
    assert!(status.success());
}

#[test]
fn every_command_of_a_runner_works_from_the_project_without_cargo() {
    let project = two_robots("interpreted_commands");
    let of = ["two_robots.sesame", "-c", "crossing"];
    let sesamec = |command: &str, more: &[&str]| without_cargo(&project, &[&[command], &of[..], more].concat());
    let digest = sesamec("run", &[]).expect(0).digest();
    assert_eq!(sesamec("digest", &[]).expect(0).out.trim(), digest);
    assert!(sesamec("list", &[]).expect(0).out.contains("T20"));
    assert!(sesamec("show", &["T20", "--format", "json"]).expect(0).out.contains("\"requirements\""));
    assert!(sesamec("export", &["T20"]).expect(0).out.contains("test "));
    assert!(sesamec("report", &[]).expect(0).out.contains("report.html"));
    sesamec("known", &["silent_departure"]).expect(0);
    sesamec("repeat", &["T20", "2"]).expect(0);
    sesamec("confirm", &["T20", "--times", "1"]).expect(0);
    sesamec("replay", &["T20", "--results", "42"]).expect(0);
    let shrunk = sesamec("shrink", &["T20", "--evaluations", "3", "--results", "42"]);
    assert!(matches!(shrunk.code, Some(0 | 1)), "{}", shrunk.err);
    // Results are shown even while the space has errors.
    fs::write(&project.space, "space two_robots mistake").unwrap();
    assert!(sesamec("list", &["--results", "42"]).expect(0).out.contains("T20"));
    sesamec("replay", &["T20"]).expect(1);
}

#[test]
fn a_campaign_with_a_hook_is_built_and_its_commands_work_from_the_project_too() {
    let project = Project::kuka_cell("from_the_project");
    let campaign = ["--campaign", "coverage_experiment"];
    let digest = project.run("coverage_experiment", &["--", "--evaluations", "6"]).expect(0).digest();
    let sesamec = |command: &str, more: &[&str]| project.sesamec(command, &[&campaign[..], more].concat());
    assert_eq!(sesamec("digest", &[]).expect(0).out.trim(), digest);
    let replayed = sesamec("replay", &["T3", "--format", "json"]).expect(0);
    assert!(replayed.out.contains("\"same\": true"), "{}", replayed.out);
    assert!(sesamec("known", &["--workers", "1", "--fail-on", "violation,crash"]).err.contains("Took"));
}

#[test]
fn an_objective_whose_hook_is_a_stub_is_told_of_before_the_build() {
    let space = fs::read_to_string(workspace().join("tests/simulators/faulty/space.sesame")).unwrap();
    let project = Project::new("unfilled", &space.replace("NAME", "unfilled"), "faulty");
    let said = project.sesamec("run", &["--campaign", "harmless"]).expect(1).err;
    assert!(said.contains("is not filled in yet") && said.contains("hooks/"), "{said}");
    assert!(!said.contains("Building") && !said.contains("Built"), "{said}");
}

#[test]
fn two_spaces_in_one_folder_may_have_campaigns_of_one_name_and_nothing_is_written_through_a_link() {
    let project = two_robots("interpreted_beside");
    let run = |space: &str| without_cargo(&project, &["run", space, "-c", "crossing"]);
    run("two_robots.sesame").expect(0);
    // A variant has the campaigns of the space that it imports.
    fs::write(project.folder.join("other.sesame"), "space other\nimport \"two_robots.sesame\"\n").unwrap();
    let told = without_cargo(&project, &["run", "other.sesame", "-c", "crossing", "-o", "runners"]).expect(1);
    assert!(told.err.contains("crossing belongs to `two_robots.sesame`, not to `other.sesame`"), "{}", told.err);
    let told = without_cargo(&project, &["list", "other.sesame", "-c", "crossing"]).expect(1);
    assert!(told.err.contains("runners/other.sesame/crossing/results"), "{}", told.err);
    let said = run("other.sesame").expect(0);
    assert!(said.out.contains("runners/other.sesame/crossing/results/42/report.html"), "{}", said.out);
    for command in ["list", "replay"] {
        let test = (command == "replay").then_some("T3");
        let command = [&[command, "other.sesame", "-c", "crossing"][..], test.as_slice()].concat();
        without_cargo(&project, &command).expect(0);
    }
    assert!(!project.runners.join("crossing/results/42-2").exists(), "the first space's folder is its own");
    // A renamed space keeps its results.
    fs::remove_dir_all(project.runners.join("other.sesame")).unwrap();
    fs::rename(&project.space, project.folder.join("other.sesame")).unwrap();
    without_cargo(&project, &["replay", "other.sesame", "-c", "crossing", "T3"]).expect(0);
    without_cargo(&project, &["list", "other.sesame", "-c", "crossing"]).expect(0);

    let elsewhere = project.folder.join("elsewhere");
    fs::rename(project.runners.join("crossing"), &elsewhere).unwrap();
    std::os::unix::fs::symlink(&elsewhere, project.runners.join("crossing")).unwrap();
    let told = run("other.sesame").expect(1);
    assert!(told.err.contains("crossing is a link"), "{}", told.err);
    assert!(!elsewhere.join("results/42-2").exists());
}

#[test]
fn results_are_shown_while_their_space_has_errors_if_they_are_named() {
    let project = two_robots("interpreted_broken");
    without_cargo(&project, &["run", "two_robots.sesame", "-c", "crossing"]).expect(0);
    fs::write(&project.space, "space two_robots\nmetric").unwrap();
    let list = ["list", "two_robots.sesame", "--results", "runners/crossing/results/42"];
    assert!(without_cargo(&project, &list).expect(0).out.contains("T20"));
}
