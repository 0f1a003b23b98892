//! A worker that is killed leaves nothing of what it launched, with real keepers: this program is a runner, its own
//! worker, and the keeper of what the worker launches, so it has no test harness.

#![cfg_attr(
    target_os = "linux",
    expect(clippy::disallowed_methods, clippy::disallowed_types, clippy::unwrap_used, reason = "a test of processes")
)]

#[cfg(target_os = "linux")]
mod linux {
    use std::ffi::OsString;
    use std::path::{Path, PathBuf};
    use std::process::{Child, Command, ExitCode, Stdio};
    use std::time::Duration;
    use std::{env, fs, thread};

    use sesame_lifecycle::launch::{LaunchContext, Launched};
    use sesame_patience as patience;
    use sesame_plan::testing::{minimal, node};
    use sesame_plan::{CampaignPlan, Launch, Ready, ReadyWhen};
    use sesame_relay::transport::{become_simulator, end_simulators, keep_simulator};

    /// Starts a process in a session of its own, writes both numbers, and waits without listening to anybody.
    const PROGRAM: &str = "import os, signal, sys, time\n\
        signal.signal(signal.SIGTERM, signal.SIG_IGN)\n\
        assert sys.stdin.read() == ''\n\
        child = os.fork()\n\
        if child == 0: os.setsid()\n\
        else: open(sys.argv[1], 'w').write(f'{os.getpid()} {child}'); print('up')\n\
        time.sleep(1000)";

    pub(super) fn main() -> ExitCode {
        let words: Vec<OsString> = env::args_os().skip(1).collect();
        match words.first().and_then(|word| word.to_str()) {
            Some(role @ ("simulator" | "simulated")) => {
                let split = words.iter().position(|word| word == "--").unwrap();
                let background = words[..split].iter().any(|word| word == "--background");
                let parent = words[1].to_str().unwrap().parse().unwrap();
                let (program, arguments) = words[split + 1..].split_first().unwrap();
                if role == "simulator" {
                    keep_simulator(parent, Path::new(&words[2]), program, arguments, background)
                } else {
                    become_simulator(parent, program, arguments, background)
                }
            }
            // What nextest asks of a program with tests.
            Some("--list") => {
                if !words.iter().any(|word| word == "--ignored") {
                    println!("a_worker_leaves_nothing_of_what_it_launched_however_it_ends: test");
                }
                ExitCode::SUCCESS
            }
            Some("worker") => worker(&PathBuf::from(&words[1]), words[2].to_str().unwrap()),
            _ if Command::new("python3").arg("--version").output().is_err() => {
                assert!(env::var_os("CI").is_none(), "python3 is needed");
                eprintln!("skipped: there is no python3 here");
                ExitCode::SUCCESS
            }
            _ => {
                for end in ["is killed", "ends", "is told to end", "finds no program"] {
                    println!("a worker that {end}");
                    nothing_is_left(end);
                }
                ExitCode::SUCCESS
            }
        }
    }

    fn launch(program: &str, arguments: &[&str]) -> Launch {
        let arguments = arguments.iter().map(|&argument| argument.to_owned()).collect();
        let command = sesame_plan::Command { program: program.to_owned(), arguments };
        Launch { command, ready: Some(Ready { when: ReadyWhen::Line { text: "up".to_owned() }, within: 120.0 }) }
    }

    fn plan(end: &str) -> CampaignPlan {
        let mut plan = minimal();
        plan.simulator.lifecycle.launch = Some(launch("python3", &["-u", "-c", PROGRAM, "system"]));
        let node_program = if end == "finds no program" { "no_such_program" } else { "python3" };
        let with = launch(node_program, &["-u", "-c", PROGRAM, "node"]);
        plan.nodes.push(sesame_plan::Node { launch: Some(with), ..node("n") });
        plan.simulator.lifecycle.terminate = Some(sesame_plan::Command {
            program: "python3".to_owned(),
            arguments: vec!["-c".to_owned(), "open('terminated', 'w')".to_owned()],
        });
        plan
    }

    /// What a worker does: launches, says so, and then ends in some way.
    fn worker(folder: &Path, end: &str) -> ExitCode {
        let mut launched = Launched::new(&plan(end), LaunchContext::of_worker(folder.to_owned()));
        launched.start(1, &[]).unwrap();
        let ready = launched.await_ready(&mut |_| false);
        if end == "finds no program" {
            let error = ready.unwrap_err().to_string();
            assert!(error.contains("the program `no_such_program "), "{error}");
            assert!(error.contains("cannot start `no_such_program`: there is no such program"), "{error}");
            return ExitCode::SUCCESS;
        }
        ready.unwrap();
        launched.check().unwrap();
        fs::write(folder.join("ready"), "").unwrap();
        match end {
            "ends" => drop(launched),
            "is told to end" => {
                end_simulators();
                // As a worker does, without its destructors.
                std::process::exit(0);
            }
            _ => thread::sleep(Duration::from_secs(1000)),
        }
        ExitCode::SUCCESS
    }

    fn nothing_is_left(end: &str) {
        let folder = tempfile::tempdir().unwrap();
        let mut worker: Child = Command::new("/proc/self/exe")
            .arg("worker")
            .arg(folder.path())
            .arg(end)
            .current_dir(folder.path())
            .stdin(Stdio::null())
            .spawn()
            .unwrap();
        if end == "is killed" {
            patience::until("it is ready", || folder.path().join("ready").exists());
            worker.kill().unwrap();
        }
        let status = worker.wait().unwrap();
        assert_eq!(status.success(), end != "is killed", "{status}");
        assert_eq!(folder.path().join("terminated").exists(), end != "is killed");
        let processes = |file: &str| fs::read_to_string(folder.path().join(file)).unwrap_or_default();
        let all: Vec<String> =
            format!("{} {}", processes("system"), processes("node")).split_whitespace().map(str::to_owned).collect();
        assert_eq!(all.len(), if end == "finds no program" { 2 } else { 4 });
        // Nothing works in the folder any more, keepers included.
        patience::until("nothing is left", || {
            let mut all = fs::read_dir("/proc").unwrap().filter_map(Result::ok);
            !all.any(|entry| fs::read_link(entry.path().join("cwd")).is_ok_and(|cwd| cwd == folder.path()))
        });
    }
}

#[cfg(target_os = "linux")]
fn main() -> std::process::ExitCode {
    linux::main()
}

#[cfg(not(target_os = "linux"))]
fn main() {}
