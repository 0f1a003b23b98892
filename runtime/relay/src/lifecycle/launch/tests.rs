//! Launched programs that are real processes. They are written in Python.

use std::fs;
use std::path::Path;
use std::time::Instant;

use sesame_plan::Ready;
use sesame_plan::testing::{minimal, node};

use super::*;

/// Whether there is a Python here. In the pipeline there must be.
fn python() -> bool {
    let found = std::process::Command::new("python3").arg("--version").output();
    let found = found.is_ok_and(|output| output.status.success());
    assert!(found || std::env::var_os("CI").is_none(), "python3 is needed");
    if !found {
        eprintln!("skipped: there is no python3 here");
    }
    found
}

fn command(program: &str, arguments: &[&str]) -> Command {
    Command { program: program.to_owned(), arguments: arguments.iter().map(|&text| text.to_owned()).collect() }
}

/// A program in Python, and when it is ready.
fn launch(program: &str, ready: Option<(ReadyWhen, f64)>) -> Launch {
    launch_with(program, &[], ready)
}

fn launch_with(program: &str, arguments: &[&str], ready: Option<(ReadyWhen, f64)>) -> Launch {
    let arguments = [&["-u", "-c", program][..], arguments].concat();
    Launch { command: command("python3", &arguments), ready: ready.map(|(when, within)| Ready { when, within }) }
}

fn line(text: &str) -> ReadyWhen {
    ReadyWhen::Line { text: text.to_owned() }
}

/// A system that launches this, in a folder of its own.
struct System {
    folder: tempfile::TempDir,
    launched: Launched,
}

fn system(whole: Option<Launch>, nodes: Vec<Launch>, terminate: Option<Command>) -> System {
    let mut plan = minimal();
    plan.topics = vec![sesame_plan::testing::topic("pose", &["pose"], sesame_plan::Type::Bool)];
    plan.simulator.lifecycle.launch = whole;
    plan.simulator.lifecycle.terminate = terminate;
    for (at, launch) in nodes.into_iter().enumerate() {
        plan.nodes.push(sesame_plan::Node { launch: Some(launch), ..node(&format!("n{at}")) });
    }
    let folder = tempfile::tempdir().unwrap();
    let place = Place {
        worker: 7,
        folder: folder.path().to_owned(),
        space: folder.path().to_owned(),
        domain: 42,
        environment: vec![("ROS_DOMAIN_ID".to_owned(), "42".to_owned())],
        ros_args: BTreeMap::from([(Part::System, vec!["--ros-args".to_owned(), "-r".to_owned(), "a:=b".to_owned()])]),
        in_runner: false,
    };
    let launched = Launched::new(&plan, place);
    System { folder, launched }
}

impl System {
    fn file(&self, name: &str) -> String {
        fs::read_to_string(self.folder.path().join(name)).unwrap_or_default()
    }

    /// Waits until a file has this content.
    #[track_caller]
    fn becomes(&self, name: &str, content: &str) {
        let started = Instant::now();
        while self.file(name) != content {
            assert!(started.elapsed() < Duration::from_secs(20), "{name}: {:?}", self.file(name));
            thread::sleep(PAUSE);
        }
    }

    fn started(&mut self) -> Result<(), TransportError> {
        self.launched.start(5)?;
        self.launched.await_ready(&mut |_| false)
    }
}

/// Writes its process number, then does this.
fn numbered(file: &str, then: &str) -> String {
    format!("import os, sys, time, signal\nopen('{file}', 'w').write(str(os.getpid()))\n{then}")
}

fn is_alive(process: &str) -> bool {
    let stat = fs::read_to_string(Path::new("/proc").join(process).join("stat")).unwrap_or_default();
    !stat.is_empty() && !stat.contains(") Z ")
}

fn is_stopped(process: &str) -> bool {
    fs::read_to_string(Path::new("/proc").join(process).join("stat")).unwrap_or_default().contains(") T ")
}

#[test]
fn a_program_gets_what_its_worker_has_of_its_own_and_an_empty_input() {
    if !python() {
        return;
    }
    let program = "import os, sys\n\
                   said = sys.argv[1:] + [os.environ[name] for name in\n\
                   \x20 ('SESAME_WORKER', 'SESAME_WORKER_FOLDER', 'SESAME_SEED', 'ROS_DOMAIN_ID')]\n\
                   said.append(repr(sys.stdin.read()) + os.getcwd())\n\
                   open('said', 'w').write(' '.join(said)); print('done')\n\
                   import time; time.sleep(1000)";
    let arguments = ["{worker}", "d{domain}", "{folder}/x", "{seed}", "{ros-args}", "{port}"];
    let mut system = system(Some(launch_with(program, &arguments, Some((line("done"), 20.0)))), Vec::new(), None);
    system.started().unwrap();
    let folder = system.folder.path().canonicalize().unwrap().display().to_string();
    let given = system.folder.path().display().to_string();
    let port = system.launched.port().unwrap();
    assert_eq!(system.file("said"), format!("7 d42 {given}/x 5 --ros-args -r a:=b {port} 7 {given} 5 42 ''{folder}"));
}

#[test]
fn the_system_is_ready_before_nodes_are_launched_and_each_readiness_is_awaited() {
    if !python() {
        return;
    }
    let order = |name: &str, then: &str| format!("import time, sys\nopen('order', 'a').write('{name}')\n{then}");
    let whole = order(
        "s",
        "time.sleep(0.3)\nopen('order', 'a').write('S')\nprint('the system is up', file=sys.stderr)\ntime.sleep(1000)",
    );
    let port = order(
        "p",
        "import socket\ntime.sleep(0.3)\nserver = socket.create_server(('127.0.0.1', int(sys.argv[1])))\n\
         open('order', 'a').write('P')\ntime.sleep(1000)",
    );
    let when = ReadyWhen::Port { port: "{port}".to_owned() };
    let asked = order("t", "time.sleep(1000)");
    let mut system = system(
        Some(launch(&whole, Some((line("system is up"), 20.0)))),
        vec![
            launch_with(&port, &["{port}"], Some((when, 20.0))),
            launch(&asked, Some((ReadyWhen::Topic { topic: TopicId(0) }, 20.0))),
            launch(&asked, Some((ReadyWhen::Clock, 20.0))),
        ],
        None,
    );
    system.launched.start(1).unwrap();
    let mut probes = Vec::new();
    let mut rounds = 0;
    system
        .launched
        .await_ready(&mut |probe| {
            probes.push(probe);
            rounds += 1;
            rounds > 10
        })
        .unwrap();
    assert!(probes.contains(&Probe::Topic(TopicId(0))) && probes.contains(&Probe::Clock));
    let order = system.file("order");
    assert!(order.starts_with("sS") && order.contains('P'), "{order}");
    system.launched.check().unwrap();
}

#[test]
fn a_failed_launch_says_which_program_what_was_awaited_for_how_long_and_its_last_lines() {
    if !python() {
        return;
    }
    let failed = |launch: Launch| {
        let mut system = system(None, vec![launch], None);
        let error = system.started().unwrap_err();
        assert!(!system.launched.is_started(), "it is ended");
        assert_eq!(error.fault(), crate::transport::Fault::LaunchFailed);
        error.to_string().replace(&*system.folder.path().to_string_lossy(), "FOLDER")
    };
    let ready = |when| Some((when, 0.5));
    let said = [
        // Time enough for it to say something, whatever else the machine does.
        failed(launch("import time; print('loading'); time.sleep(1000)", Some((line("ready"), 5.0)))),
        failed(launch("import time; time.sleep(1000)", ready(ReadyWhen::Port { port: "{port}".to_owned() }))),
        failed(launch("import time; time.sleep(1000)", ready(ReadyWhen::Port { port: "x{worker}".to_owned() }))),
        failed(launch("import time; time.sleep(1000)", ready(ReadyWhen::Clock))),
        failed(launch("import sys; print('no map'); sys.exit(3)", Some((line("ready"), 20.0)))),
        failed(launch("import os; os.kill(os.getpid(), 11)", Some((line("ready"), 20.0)))),
        failed(Launch { command: command("no_such_program", &["{port}"]), ready: None }),
    ];
    insta::assert_snapshot!(said.join("\n"));
}

#[test]
fn a_launched_program_that_ends_later_is_named_with_its_last_lines_and_is_the_systems_fault() {
    if !python() {
        return;
    }
    let program =
        "import sys, time\nprint('up'); time.sleep(0.2); print('out of memory', file=sys.stderr); sys.exit(9)";
    let mut system = system(None, vec![launch(program, Some((line("up"), 20.0)))], None);
    system.started().unwrap();
    let alarm = system.launched.alarm().unwrap();
    let error = loop {
        if let Err(error) = system.launched.check() {
            break error;
        }
        thread::sleep(PAUSE);
    };
    assert_eq!(error.fault(), crate::transport::Fault::Crash);
    let error = error.to_string();
    assert!(error.starts_with("the program `python3 -u -c "), "{error}");
    assert!(error.contains("` of node `n0` ended (exit status: 9); the last lines that it wrote:\nup\nout of memory"));
    assert!(alarm.load(std::sync::atomic::Ordering::Relaxed));
    assert!(!system.launched.is_started());
}

#[cfg(target_os = "linux")]
#[test]
fn a_node_is_paused_resumed_killed_and_started_again_with_all_its_processes() {
    if !python() {
        return;
    }
    let program = numbered(
        "parent",
        "child = os.fork()\n\
         if child == 0: os.setsid(); open('child', 'w').write(str(os.getpid()))\n\
         else: open('starts', 'a').write('x'); print('up')\n\
         time.sleep(1000)",
    );
    let mut system = system(None, vec![launch(&program, Some((line("up"), 20.0)))], None);
    assert!(!system.launched.pause(NodeId(0)), "it does not run yet");
    system.started().unwrap();
    while system.file("child").is_empty() {
        thread::sleep(PAUSE);
    }
    let (parent, child) = (system.file("parent"), system.file("child"));
    let eventually = |holds: &dyn Fn() -> bool| {
        let started = Instant::now();
        while !holds() {
            assert!(started.elapsed() < Duration::from_secs(20));
            thread::sleep(PAUSE);
        }
    };
    assert!(system.launched.pause(NodeId(0)));
    eventually(&|| is_stopped(&parent) && is_stopped(&child));
    system.launched.check().unwrap();
    assert!(system.launched.resume(NodeId(0)));
    assert!(!system.launched.resume(NodeId(0)), "it is not paused any more");
    eventually(&|| !is_stopped(&parent) && !is_stopped(&child));

    assert!(system.launched.kill(NodeId(0)));
    assert!(!system.launched.kill(NodeId(0)));
    eventually(&|| !is_alive(&parent) && !is_alive(&child));
    system.launched.check().unwrap();
    assert!(!system.launched.alarm().unwrap().load(std::sync::atomic::Ordering::Relaxed), "it was to end");

    assert!(system.launched.restart(NodeId(0)).unwrap());
    system.launched.await_ready(&mut |_| false).unwrap();
    assert_eq!(system.file("starts"), "xx");
    assert!(system.launched.restart(NodeId(0)).unwrap(), "also while it runs");
    assert!(!system.launched.restart(NodeId(1)).unwrap(), "the plan does not launch it");
    system.launched.await_ready(&mut |_| false).unwrap();
    assert!(system.launched.pause(NodeId(0)));
    let parent = system.file("parent");
    let started = Instant::now();
    system.launched.end();
    assert!(!is_alive(&parent) && started.elapsed() < Duration::from_secs(2), "a paused node is resumed to end");
}

#[test]
fn the_end_runs_terminate_then_asks_each_program_and_kills_what_does_not_listen() {
    if !python() {
        return;
    }
    let polite = numbered(
        "polite",
        "signal.signal(signal.SIGTERM, lambda *_: (open('order', 'a').write('t'), sys.exit(0)))\nprint('up')\ntime.sleep(1000)",
    );
    let deaf = numbered("deaf", "signal.signal(signal.SIGTERM, signal.SIG_IGN)\nprint('up')\ntime.sleep(1000)");
    let up = || Some((line("up"), 20.0));
    let end = command("python3", &["-c", "open('order', 'a').write('T'); print('gone already'); exit(4)"]);
    let mut system = system(Some(launch(&polite, up())), vec![launch(&deaf, up())], Some(end));
    system.started().unwrap();
    let (polite, deaf) = (system.file("polite"), system.file("deaf"));
    system.launched.end();
    assert_eq!(system.file("order"), "Tt");
    assert!(!is_alive(&polite) && !is_alive(&deaf));
    let notes = system.launched.take_notes();
    assert!(notes[0].contains("ended (exit status: 4):\ngone already"), "a note, no error: {notes:?}");
    system.launched.end();
    assert_eq!((system.file("order").as_str(), system.launched.take_notes().len()), ("Tt", 0), "only once");
}

#[test]
fn terminate_is_run_when_the_worker_is_told_to_end() {
    if !python() {
        return;
    }
    let end = command("python3", &["-c", "open('order', 'a').write('T')"]);
    let mut system = system(Some(launch("import time; time.sleep(1000)", None)), Vec::new(), Some(end));
    system.started().unwrap();
    terminate_all();
    system.becomes("order", "T");
    system.launched.end();
    assert_eq!(system.file("order"), "T");
}
