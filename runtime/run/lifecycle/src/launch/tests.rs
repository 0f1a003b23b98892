//! Launched programs that are real processes. They are written in Python.

use std::fs;
use std::path::Path;
use std::sync::{Mutex, MutexGuard, PoisonError};

use sesame_patience as patience;
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

/// How long a program may take to be ready that will be, in seconds.
const SOON: f64 = 120.0;

/// What waits in a program until a file is there.
const AWAIT: &str = "import os, time\ndef wait_for(file):\n    while not os.path.exists(file): time.sleep(0.005)\n";

/// Held by tests whose systems have a command that ends them: telling the worker to end is telling all of its systems.
fn alone() -> MutexGuard<'static, ()> {
    static ALONE: Mutex<()> = Mutex::new(());
    ALONE.lock().unwrap_or_else(PoisonError::into_inner)
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
    let context = LaunchContext {
        worker: 7,
        folder: folder.path().to_owned(),
        space: folder.path().to_owned(),
        domain: 42,
        environment: vec![("ROS_DOMAIN_ID".to_owned(), "42".to_owned())],
        ros_args: BTreeMap::from([(Part::System, vec!["--ros-args".to_owned(), "-r".to_owned(), "a:=b".to_owned()])]),
        in_runner: false,
    };
    let launched = Launched::new(&plan, context);
    System { folder, launched }
}

impl System {
    fn file(&self, name: &str) -> String {
        fs::read_to_string(self.folder.path().join(name)).unwrap_or_default()
    }

    /// Waits until a file has this content.
    #[track_caller]
    fn becomes(&self, name: &str, content: &str) {
        let becomes = patience::comes(|| self.file(name) == content);
        assert!(becomes, "{name}: {:?}", self.file(name));
    }

    /// Lets a program go on that waits for this file.
    fn let_go(&self, file: &str) {
        fs::write(self.folder.path().join(file), "").unwrap();
    }

    fn started(&mut self) -> Result<(), LaunchError> {
        self.launched.start(5, &[])?;
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
    let mut system = system(Some(launch_with(program, &arguments, Some((line("done"), SOON)))), Vec::new(), None);
    system.started().unwrap();
    let folder = system.folder.path().canonicalize().unwrap().display().to_string();
    let given = system.folder.path().display().to_string();
    let port = system.launched.port().unwrap();
    assert_eq!(system.file("said"), format!("7 d42 {given}/x 5 --ros-args -r a:=b {port} 7 {given} 5 42 ''{folder}"));
}

#[test]
fn a_program_has_the_scene_of_its_start_in_its_arguments_and_so_has_one_that_is_started_again() {
    if !python() {
        return;
    }
    let program = "import sys, time\nopen('said', 'a').write(sys.argv[1] + ' ')\nprint('up')\ntime.sleep(1000)";
    let end = command("python3", &["-c", "import sys; open('ended', 'a').write(sys.argv[1] + ' ')", "{start_x}"]);
    let node = launch_with(program, &["start_x:={start_x}"], Some((line("up"), SOON)));
    let _alone = alone();
    let mut system = system(None, vec![node], Some(end));
    let scene = |value: &str| vec![("start_x".to_owned(), value.to_owned())];
    for value in ["0.5", "-2.0"] {
        system.launched.start(5, &scene(value)).unwrap();
        system.launched.await_ready(&mut |_| false).unwrap();
    }
    assert!(system.launched.are_of(&scene("-2.0")) && !system.launched.are_of(&scene("0.5")));
    assert!(system.launched.restart(NodeId(0)).unwrap());
    system.launched.await_ready(&mut |_| false).unwrap();
    assert_eq!(system.file("said"), "start_x:=0.5 start_x:=-2.0 start_x:=-2.0 ");
    system.launched.end();
    assert_eq!(system.file("ended"), "0.5 -2.0 ");
}

#[test]
fn the_system_is_ready_before_nodes_are_launched_and_each_readiness_is_awaited() {
    if !python() {
        return;
    }
    let order = |name: &str, then: &str| format!("{AWAIT}import sys\nopen('order', 'a').write('{name}')\n{then}");
    let whole = order(
        "s",
        "wait_for('up')\nopen('order', 'a').write('S')\nprint('the system is up', file=sys.stderr)\ntime.sleep(1000)",
    );
    let port = order(
        "p",
        "import socket\nwait_for('listen')\nopen('order', 'a').write('P')\n\
         server = socket.create_server(('127.0.0.1', int(sys.argv[1])))\ntime.sleep(1000)",
    );
    let when = ReadyWhen::Port { port: "{port}".to_owned() };
    let asked = order("t", "time.sleep(1000)");
    let mut system = system(
        Some(launch(&whole, Some((line("system is up"), SOON)))),
        vec![
            launch_with(&port, &["{port}"], Some((when, SOON))),
            launch(&asked, Some((ReadyWhen::Topic { topic: TopicId(0) }, SOON))),
            launch(&asked, Some((ReadyWhen::Clock, SOON))),
        ],
        None,
    );
    system.launched.start(1, &[]).unwrap();
    system.becomes("order", "s");
    assert!(!system.launched.poll_ready(&mut |_| true).unwrap());
    assert_eq!((system.launched.begun, system.file("order").as_str()), (1, "s"), "no node before the system is ready");

    system.let_go("up");
    let mut probes = Vec::new();
    patience::until("the nodes are launched", || {
        let mut asked = |probe| {
            probes.push(probe);
            false
        };
        assert!(!system.launched.poll_ready(&mut asked).unwrap(), "no node is ready");
        system.launched.begun == 4
    });
    assert!(probes.contains(&Probe::Topic(TopicId(0))) && probes.contains(&Probe::Clock));
    patience::until("all nodes run", || system.file("order").len() == 5);
    assert!(system.file("order").starts_with("sS"), "{}", system.file("order"));
    assert!(!system.launched.poll_ready(&mut |_| true).unwrap(), "nobody listens at the port");

    system.let_go("listen");
    system.launched.await_ready(&mut |_| false).unwrap();
    assert!(system.file("order").ends_with('P'), "{}", system.file("order"));
    system.launched.check().unwrap();
}

#[test]
fn a_failed_launch_says_which_program_what_was_awaited_for_how_long_and_its_last_lines() {
    if !python() {
        return;
    }
    let failed = |says: &str, launch: Launch| {
        let mut system = system(None, vec![launch], None);
        let error = system.launched.start(5, &[]).and_then(|()| {
            // What it says is heard before its time is over, whatever else the machine does.
            patience::until("it speaks", || system.launched.parts[0].1.last_lines().contains(says));
            system.launched.await_ready(&mut |_| false)
        });
        let error = error.unwrap_err();
        assert!(!system.launched.is_started(), "it is ended");
        assert!(matches!(error, LaunchError::Failed { .. }), "{error}");
        error.to_string().replace(&*system.folder.path().to_string_lossy(), "FOLDER")
    };
    let ready = |when| Some((when, 0.5));
    let said = [
        failed("loading", launch("import time; print('loading'); time.sleep(1000)", ready(line("ready")))),
        failed("", launch("import time; time.sleep(1000)", ready(ReadyWhen::Port { port: "{port}".to_owned() }))),
        failed("", launch("import time; time.sleep(1000)", ready(ReadyWhen::Port { port: "x{worker}".to_owned() }))),
        failed("", launch("import time; time.sleep(1000)", ready(ReadyWhen::Clock))),
        failed("", launch("import sys; print('no map'); sys.exit(3)", Some((line("ready"), SOON)))),
        failed("", launch("import os; os.kill(os.getpid(), 11)", Some((line("ready"), SOON)))),
        failed("", Launch { command: command("no_such_program", &["{port}"]), ready: None }),
    ];
    insta::assert_snapshot!(said.join("\n"));
}

#[test]
fn a_launched_program_that_ends_later_is_named_with_its_last_lines() {
    if !python() {
        return;
    }
    let program = format!(
        "{AWAIT}import sys\nprint('up'); wait_for('end'); print('out of memory', file=sys.stderr); sys.exit(9)"
    );
    let mut system = system(None, vec![launch(&program, Some((line("up"), SOON)))], None);
    system.started().unwrap();
    let alarm = system.launched.alarm().unwrap();
    system.launched.check().unwrap();
    system.let_go("end");
    let error = patience::until_some("the end of the program", || system.launched.check().err());
    assert!(matches!(error, LaunchError::Ended { .. }), "{error}");
    let error = error.to_string();
    assert!(error.starts_with("the program `python3 -u -c "), "{error}");
    let ended = "` of node `n0` ended (exit status: 9); the last lines that it wrote:\nup\nout of memory";
    assert!(error.contains(ended), "{error}");
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
         else:\n\
         \x20   signal.signal(signal.SIGTERM, lambda *_: (open('asked', 'a').write('x'), sys.exit(0)))\n\
         \x20   open('starts', 'a').write('x'); print('up')\n\
         time.sleep(1000)",
    );
    let mut system = system(None, vec![launch(&program, Some((line("up"), SOON)))], None);
    assert!(!system.launched.pause(NodeId(0)), "it does not run yet");
    system.started().unwrap();
    patience::until("the child runs", || !system.file("child").is_empty());
    let (parent, child) = (system.file("parent"), system.file("child"));
    assert!(system.launched.pause(NodeId(0)));
    patience::until("both are stopped", || is_stopped(&parent) && is_stopped(&child));
    system.launched.check().unwrap();
    assert!(system.launched.resume(NodeId(0)));
    assert!(!system.launched.resume(NodeId(0)), "it is not paused any more");
    patience::until("both go on", || !is_stopped(&parent) && !is_stopped(&child));

    assert!(system.launched.kill(NodeId(0)));
    assert!(!system.launched.kill(NodeId(0)));
    patience::until("both are gone", || !is_alive(&parent) && !is_alive(&child));
    system.launched.check().unwrap();
    assert!(!system.launched.alarm().unwrap().load(std::sync::atomic::Ordering::Relaxed), "it was to end");

    assert!(system.launched.restart(NodeId(0)).unwrap());
    system.launched.await_ready(&mut |_| false).unwrap();
    assert_eq!(system.file("starts"), "xx");
    assert!(system.launched.restart(NodeId(0)).unwrap(), "also while it runs");
    assert!(!system.launched.restart(NodeId(1)).unwrap(), "the plan does not launch it");
    system.launched.await_ready(&mut |_| false).unwrap();
    // The processes of the earlier starts are gone.
    patience::until("its child runs", || !system.file("child").is_empty() && is_alive(&system.file("child")));
    assert!(system.launched.pause(NodeId(0)));
    let parent = system.file("parent");
    patience::until("it is stopped", || is_stopped(&parent));
    assert_eq!(system.file("asked"), "");
    system.launched.end();
    assert!(!is_alive(&parent));
    assert_eq!(system.file("asked"), "x", "a paused node is resumed to end by itself");
    // What left its group is ended by a keeper, and there is none here.
    let child = system.file("child").parse().ok().and_then(rustix::process::Pid::from_raw);
    rustix::process::kill_process(child.unwrap(), rustix::process::Signal::KILL).unwrap();
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
    let _alone = alone();
    let up = || Some((line("up"), SOON));
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
    let _alone = alone();
    let end = command("python3", &["-c", "open('order', 'a').write('T')"]);
    let mut system = system(Some(launch("import time; time.sleep(1000)", None)), Vec::new(), Some(end));
    system.started().unwrap();
    terminate_all();
    system.becomes("order", "T");
    system.launched.end();
    assert_eq!(system.file("order"), "T");
}
