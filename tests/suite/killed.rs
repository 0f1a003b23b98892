//! Campaigns on a simulator that starts other processes, which are ended in every way there is: nothing is left of
//! them, and results are what they would have been.

use std::cell::RefCell;
use std::collections::BTreeSet;
use std::fs;
use std::os::unix::process::CommandExt as _;
use std::path::Path;
use std::process::{Child, Stdio};
use std::thread::sleep;
use std::time::Duration;

use nix::sys::signal::{Signal, kill, killpg};
use nix::unistd::Pid;
use proptest::prelude::*;
use proptest::test_runner::{RngSeed, TestRunner};

use sesame_base::observation::Outcome;
use sesame_patience as patience;
use sesame_peers::has_python3;
use sesame_record::{Repository, TestRow, Verdict};
use sesame_tests::{Done, Project, Runner, workspace};

use crate::interruption::Clock;

/// The runner of a campaign on the simulator that starts others; `None`, with the reason, without a Python.
fn breeding(name: &str, campaign: &str) -> Option<Runner> {
    if !has_python3() {
        return None;
    }
    let space = fs::read_to_string(workspace().join("tests/simulators/breeding/space.sesame")).unwrap();
    // Simulators run in the project's folder, by which their processes are found, so each test has one of its own.
    Some(Project::new(name, &space.replace("NAME", name), "breeding").build(campaign))
}

/// What a process is in a campaign.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
enum Role {
    Supervisor,
    Worker,
    Simulator,
    /// Something that a simulator started.
    Other,
    /// What sees to it that a simulator ends, with all that it started.
    Keeper,
    /// It is only being started, and still has the command line of the one that starts it.
    Starting,
}

/// Whether a process was forked and has not become a program of its own (`PF_FORKNOEXEC`).
fn is_starting(pid: i32) -> bool {
    const FORKED: u64 = 0x40;
    let said = fs::read_to_string(format!("/proc/{pid}/stat")).unwrap_or_default();
    // The name in parentheses may contain anything; the flags are the seventh word after it.
    let flags = said.rsplit(')').next().and_then(|words| words.split_whitespace().nth(6)?.parse::<u64>().ok());
    flags.is_some_and(|flags| flags & FORKED != 0)
}

/// The living processes of a project: those that work in its folder.
fn processes(runner: &Runner) -> Vec<(Role, Pid)> {
    let folder = runner.folder.canonicalize().unwrap();
    let pids = fs::read_dir("/proc").unwrap().filter_map(|entry| entry.unwrap().file_name().to_str()?.parse().ok());
    let role = |pid: i32| {
        // What has ended meanwhile, or is not reaped, has no folder and no command line.
        let place = fs::read_link(format!("/proc/{pid}/cwd")).ok()?;
        let line = fs::read(format!("/proc/{pid}/cmdline")).ok()?;
        let words: Vec<_> = line.split(|&byte| byte == 0).map(String::from_utf8_lossy).collect();
        if !place.starts_with(&folder) || line.is_empty() {
            return None;
        }
        let role = match &words[..] {
            [program, ..] if Path::new(&**program) == runner.program && is_starting(pid) => Role::Starting,
            [program, word, ..] if Path::new(&**program) == runner.program => match &**word {
                "worker" => Role::Worker,
                "simulator" => Role::Keeper,
                "simulated" => Role::Starting,
                _ => Role::Supervisor,
            },
            [_, script, ..] if script.ends_with("/sim.py") => Role::Simulator,
            _ => Role::Other,
        };
        Some((role, Pid::from_raw(pid)))
    };
    pids.filter_map(role).collect()
}

fn with_role(runner: &Runner, role: Role) -> Vec<Pid> {
    processes(runner).into_iter().filter(|&(found, _)| found == role).map(|(_, pid)| pid).collect()
}

/// Insists that nothing of a project's lives, after what workers and simulators are given to end.
#[track_caller]
fn nothing_is_left(runner: &Runner, why: &str) {
    if !patience::comes(|| processes(runner).is_empty()) {
        let left = processes(runner);
        for (_, pid) in &left {
            kill(*pid, Signal::SIGKILL).ok();
        }
        panic!("{why}: left behind: {left:?}");
    }
}

/// A command of a runner in the background, in a process group of its own as a shell makes one.
fn start(runner: &Runner, arguments: &[&str], fault: &str) -> Child {
    let mut command = runner.command(arguments);
    command.env("PAUSE_US", "3000").env("FAULT", fault).process_group(0);
    command.stdout(Stdio::piped()).stderr(Stdio::piped()).spawn().unwrap()
}

fn pid(process: &Child) -> Pid {
    Pid::from_raw(i32::try_from(process.id()).unwrap())
}

fn recorded(folder: &Path) -> Vec<TestRow> {
    Repository::open(folder).and_then(|repository| repository.tests()).unwrap_or_default()
}

/// Waits until so many tests are recorded and a simulator is there.
fn until_recorded(runner: &Runner, process: &mut Child, results: &str, tests: usize) {
    let folder = runner.folder.join(results).join("3");
    patience::until(format_args!("{tests} tests are recorded"), || {
        assert!(process.try_wait().unwrap().is_none(), "it ended before {tests} tests were recorded");
        recorded(&folder).len() >= tests && !with_role(runner, Role::Simulator).is_empty()
    });
}

/// Whether both simulators have been ready for a test.
fn both_are_ready(runner: &Runner, results: &str) -> bool {
    let workers = runner.folder.join(results).join("3/workers");
    ["1", "2"].iter().all(|worker| workers.join(worker).join("ready").exists())
}

/// Lets simulators that wait go on, or those to come wait.
fn go_on(runner: &Runner, go_on: bool) {
    let on = runner.folder.join("on");
    if go_on { fs::write(on, "").unwrap() } else { fs::remove_file(on).unwrap_or_default() }
}

/// How many simulators noted this in the folders of a run's workers.
fn noted(runner: &Runner, results: &str, what: &str) -> usize {
    let workers = fs::read_dir(runner.folder.join(results).join("3/workers")).unwrap();
    let read = |folder: fs::DirEntry| fs::read_to_string(folder.path().join(what)).unwrap_or_default();
    workers.map(|folder| read(folder.unwrap()).lines().count()).sum()
}

#[test]
fn nothing_that_a_simulator_started_is_left_however_its_campaign_ends() {
    let Some(runner) = breeding("breeding", "quiet") else { return };
    let whole = runner.run(&["--results", "whole", "--workers", "2"]).expect(0).digest();
    nothing_is_left(&runner, "a campaign that ended");
    let all = [Role::Supervisor, Role::Worker, Role::Simulator, Role::Other];

    for victim in [Role::Supervisor, Role::Worker, Role::Simulator] {
        let results = format!("{victim:?}");
        go_on(&runner, false);
        let mut process = start(&runner, &["--results", &results, "--workers", "2"], "waits");
        until_recorded(&runner, &mut process, &results, 3);
        let there: BTreeSet<Role> = processes(&runner).into_iter().map(|(role, _)| role).collect();
        assert!(there.is_superset(&BTreeSet::from(all)), "there is something to leave behind: {there:?}");
        kill(with_role(&runner, victim)[0], Signal::SIGKILL).unwrap();
        go_on(&runner, true);
        let said = Done::of(&process.wait_with_output().unwrap());
        nothing_is_left(&runner, &format!("{victim:?} killed"));
        let said = match victim {
            Role::Supervisor => runner.run(&["resume", &format!("{results}/3")]),
            _ => said,
        };
        assert_eq!(said.expect(0).digest(), whole, "{victim:?} killed");
        nothing_is_left(&runner, &format!("{victim:?} killed, and resumed"));
    }

    // To all of the group, as a terminal does.
    go_on(&runner, false);
    let mut process = start(&runner, &["--results", "stopped", "--workers", "2"], "waits");
    until_recorded(&runner, &mut process, "stopped", 3);
    killpg(pid(&process), Signal::SIGINT).unwrap();
    Done::of(&process.wait_with_output().unwrap()).expect(130);
    nothing_is_left(&runner, "stopped");

    // What does not hang has as long as it takes.
    let hang = ["--results", "hang", "--workers", "2", "--timeout", "4", "--reference-timeout", "120"];
    let hang = [&hang[..], &["--evaluations", "3", "--fail-on", "nothing"]].concat();
    let said = Done::of(&start(&runner, &hang, "hang").wait_with_output().unwrap()).expect(0);
    let timeouts = recorded(&runner.folder.join("hang/3")).into_iter();
    assert!(timeouts.filter(|row| matches!(row.outcome, Outcome::Timeout { .. })).count() >= 2, "{}", said.out);
    nothing_is_left(&runner, "timeouts");

    // In the middle of a test that hangs, with nobody left to stop it.
    let mut process = start(&runner, &["--results", "alone", "--workers", "1", "--timeout", "600"], "hang");
    until_recorded(&runner, &mut process, "alone", 1);
    patience::until("a test hangs", || noted(&runner, "alone", "hangs") > 0);
    kill(pid(&process), Signal::SIGKILL).unwrap();
    process.wait().unwrap();
    nothing_is_left(&runner, "killed while a test hangs");
}

#[test]
fn simulators_have_time_to_end_once_their_input_is_closed() {
    let Some(runner) = breeding("given_time", "quiet") else { return };
    for (results, signal) in [("whole", None), ("stopped", Some(Signal::SIGINT)), ("killed", Some(Signal::SIGKILL))] {
        go_on(&runner, false);
        let mut process = start(&runner, &["--results", results, "--workers", "2"], "waits");
        until_recorded(&runner, &mut process, results, 1);
        // One that is only just starting has other things to do than to end.
        patience::until("both simulators are ready", || {
            assert!(process.try_wait().unwrap().is_none(), "it ended before both simulators were ready");
            both_are_ready(&runner, results)
        });
        match signal {
            Some(signal) => kill(pid(&process), signal).unwrap(),
            None => go_on(&runner, true),
        }
        let ended = process.wait_with_output().unwrap();
        assert_eq!(ended.status.success(), signal.is_none(), "{signal:?}");
        nothing_is_left(&runner, results);
        let notes = (noted(&runner, results, "started"), noted(&runner, results, "ended"));
        assert_eq!(notes, (2, 2), "{signal:?}");
    }
}

/// A shell may start others before it becomes the runner; one of these may leave something behind while the runner
/// runs.
#[test]
fn what_a_runner_has_below_it_from_the_start_is_left_alone() {
    let Some(runner) = breeding("earlier_children", "quiet") else { return };
    let script = format!(
        "sleep 1001 & sh -c 'until [ -e go ]; do sleep 0.05; done; sleep 1002 & exit' & \
         exec '{}' --results results --workers 2",
        runner.program.display()
    );
    let mut shell = sesame_tests::command("sh");
    shell.args(["-c", &script]).env("FAULT", "waits").current_dir(&runner.folder).process_group(0);
    let mut process = shell.stdout(Stdio::null()).stderr(Stdio::null()).spawn().unwrap();
    let others = || {
        let line = |pid: Pid| fs::read_to_string(format!("/proc/{pid}/cmdline")).unwrap_or_default();
        let is_ours = |pid: &Pid| matches!(line(*pid).split('\0').nth(1), Some("1001" | "1002"));
        with_role(&runner, Role::Other).into_iter().filter(is_ours).collect::<Vec<_>>()
    };
    until_recorded(&runner, &mut process, "results", 1);
    fs::write(runner.folder.join("go"), "").unwrap();
    patience::until("both are there", || others().len() == 2);
    kill(with_role(&runner, Role::Worker)[0], Signal::SIGKILL).unwrap();
    go_on(&runner, true);
    assert!(process.wait().unwrap().success());
    let left = others();
    for &other in &left {
        kill(other, Signal::SIGKILL).unwrap();
    }
    assert_eq!(left.len(), 2, "{left:?}");
    nothing_is_left(&runner, "the runner ended");
}

/// Descriptors of sockets of a process, by their number in the tables of `/proc/net`.
fn sockets(pid: Pid) -> Vec<String> {
    let Ok(open) = fs::read_dir(format!("/proc/{pid}/fd")) else { return Vec::new() };
    let links = open.filter_map(|entry| fs::read_link(entry.ok()?.path()).ok());
    links.filter_map(|link| Some(link.to_str()?.strip_prefix("socket:[")?.strip_suffix(']')?.to_owned())).collect()
}

#[test]
fn a_running_campaign_has_no_port_and_no_socket_with_a_name() {
    let Some(runner) = breeding("no_port", "quiet") else { return };
    let mut process = start(&runner, &["--results", "results", "--workers", "2"], "waits");
    let table = |name: &str| fs::read_to_string(format!("/proc/net/{name}")).unwrap_or_default();
    let mut seen = 0;
    while process.try_wait().unwrap().is_none() {
        let all_are_there = both_are_ready(&runner, "results");
        let held: Vec<String> = processes(&runner).into_iter().flat_map(|(_, pid)| sockets(pid)).collect();
        for name in ["tcp", "tcp6", "udp", "udp6", "raw", "packet"] {
            for line in table(name).lines().skip(1) {
                let inode = line.split_whitespace().nth(9).unwrap_or_default();
                assert!(!held.iter().any(|socket| socket == inode), "{name}: {line}");
            }
        }
        for line in table("unix").lines().skip(1) {
            let columns: Vec<&str> = line.split_whitespace().collect();
            if held.iter().any(|socket| columns.get(6) == Some(&socket.as_str())) {
                assert_eq!(columns.len(), 7, "a name: {line}");
                seen += 1;
            }
        }
        // They were seen once at least.
        if all_are_there {
            go_on(&runner, true);
        }
        sleep(Duration::from_millis(20));
    }
    assert!(seen > 0, "supervisor and workers are connected");
    Done::of(&process.wait_with_output().unwrap()).expect(0);
}

#[test]
fn a_simulator_that_is_killed_each_time_is_a_crash_that_says_so() {
    let Some(runner) = breeding("killed_sim", "quiet") else { return };
    let arguments = ["--results", "results", "--workers", "2", "--fail-on", "nothing", "--evaluations", "4"];
    let said = Done::of(&start(&runner, &arguments, "killed").wait_with_output().unwrap()).expect(0);
    let rows = recorded(&runner.folder.join("results/3"));
    let crashes: Vec<_> = rows.iter().filter(|row| matches!(row.outcome, Outcome::Crash { .. })).collect();
    assert!(crashes.len() >= 3, "{rows:?}");
    for row in crashes {
        let detail = row.outcome.detail().unwrap();
        assert!(detail.starts_with("killed twice, by a user or by the system because memory was short: "), "{detail}");
        let shown = runner.run(&["show", &format!("T{}", row.number), "--results", "results/3"]).expect(0).out;
        assert!(shown.contains("the simulator was killed while it ran this test"), "{shown}");
    }
    assert!(rows.iter().all(|row| row.number != 0 || row.outcome == Outcome::Completed), "{}", said.out);
    nothing_is_left(&runner, "simulators killed");
}

#[test]
fn a_reference_run_that_is_killed_is_run_again_by_resume() {
    let Some(runner) = breeding("killed_reference", "quiet") else { return };
    let whole = runner.run(&["--results", "whole"]).expect(0).digest();
    let process = start(&runner, &["--results", "results"], "killed without disturbance");
    let said = Done::of(&process.wait_with_output().unwrap()).expect(1);
    for part in ["killed twice", "T0 is not recorded", "resume results/3", "--workers"] {
        assert!(said.err.contains(part), "{part}: {}", said.err);
    }
    assert!(recorded(&runner.folder.join("results/3")).is_empty());
    assert_eq!(runner.run(&["resume", "results/3"]).expect(0).digest(), whole);
}

#[test]
fn there_are_never_more_workers_than_tests_and_too_many_are_refused_before_anything_starts() {
    let Some(runner) = breeding("many_workers", "quiet") else { return };
    let refused = runner.run(&["--results", "refused", "--workers", "100000"]).expect(2);
    for part in ["at most 512", "Leave the option out"] {
        assert!(refused.err.contains(part), "{}", refused.err);
    }
    assert!(!runner.folder.join("refused").exists());
    runner.run(&["--results", "results", "--workers", "512", "--evaluations", "3"]).expect(0);
    assert_eq!(fs::read_dir(runner.folder.join("results/3/workers")).unwrap().count(), 3);
}

/// Whom a kill hits.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
enum Victim {
    Supervisor,
    Worker,
    Simulator,
    Everything,
}

const VICTIMS: [Victim; 4] = [Victim::Supervisor, Victim::Worker, Victim::Simulator, Victim::Everything];

/// What is killed: a command, where its results are, and their digest if nobody kills anything.
struct Work {
    arguments: Vec<String>,
    folder: String,
    whole: String,
    clock: Clock,
}

impl Work {
    /// Measures it.
    fn of(runner: &Runner, into: &str, arguments: &dyn Fn(&str) -> Vec<String>, name: &str) -> Work {
        let words = arguments("uninterrupted");
        let folder = runner.folder.join("uninterrupted").join(name);
        let mut process = start(runner, &words.iter().map(String::as_str).collect::<Vec<_>>(), "");
        let clock = Clock::of(&mut process, || recorded(&folder).len());
        let said = Done::of(&process.wait_with_output().unwrap()).expect(0);
        Work { arguments: arguments(into), folder: format!("{into}/{name}"), whole: said.digest(), clock }
    }

    /// Kills it after this share of its way, resumes it if there is something to resume, and compares. Says how many
    /// tests were recorded when it was killed; `None` if it had ended, or hardly begun.
    fn killed(&self, runner: &Runner, victim: Victim, moment: f64) -> Option<usize> {
        let words: Vec<&str> = self.arguments.iter().map(String::as_str).collect();
        let mut process = start(runner, &words, "");
        self.clock.wait(&mut process, moment, || recorded(&runner.folder.join(&self.folder)).len());
        let folder = runner.folder.join(&self.folder);
        let tests = recorded(&folder).len();
        let hit = match victim {
            Victim::Supervisor => kill(pid(&process), Signal::SIGKILL).is_ok(),
            Victim::Worker | Victim::Simulator => {
                let role = if victim == Victim::Worker { Role::Worker } else { Role::Simulator };
                with_role(runner, role).first().is_some_and(|&victim| kill(victim, Signal::SIGKILL).is_ok())
            }
            Victim::Everything => {
                // One that was only just started is hit in the next round.
                let mut rounds = 0;
                patience::until("everything is gone", || {
                    let left = processes(runner);
                    for (_, pid) in &left {
                        kill(*pid, Signal::SIGKILL).ok();
                    }
                    rounds += usize::from(!left.is_empty());
                    left.is_empty()
                });
                rounds > 0
            }
        };
        let output = process.wait_with_output().unwrap();
        let why = format!("{victim:?} killed after {:.1} % of the way, {tests} tests recorded", moment * 100.0);
        nothing_is_left(runner, &why);
        if output.status.code().is_some() {
            let said = Done::of(&output);
            assert_eq!(said.code, Some(0), "{why}: {}", said.err);
            assert_eq!(said.digest(), self.whole, "{why}");
        } else if Repository::open(&folder).is_err() {
            return None;
        } else if Repository::open(&folder).unwrap().campaign().stop.is_some() {
            assert_eq!(runner.run(&["report", "--results", &self.folder]).expect(0).digest(), self.whole, "{why}");
            return None;
        } else {
            assert_eq!(runner.run(&["resume", &self.folder]).expect(0).digest(), self.whole, "{why}");
            nothing_is_left(runner, &format!("{why}, and resumed"));
        }
        hit.then_some(tests)
    }
}

/// Kills a campaign that confirms and records traces, and the making smaller of a test, at random moments.
fn killed_at_random_moments(name: &str, kills: u32) {
    let Some(runner) = breeding(name, "thorough") else { return };
    let campaign =
        |into: &str| ["--results", into, "--workers", "2", "--fail-on", "nothing"].map(str::to_owned).to_vec();
    let campaign = Work::of(&runner, "killed", &campaign, "3");
    let repository = Repository::open(&runner.folder.join("uninterrupted/3")).unwrap();
    let requirement = &repository.plan().requirements[0];
    let rows = repository.tests().unwrap();
    let violating = rows.iter().filter(|row| row.verdict(requirement) == Verdict::Violated);
    let largest = violating.max_by_key(|row| row.test.operations.len()).expect("some tests violate");
    let test = format!("T{}", largest.number);
    let smaller = |into: &str| {
        ["shrink", &test, "--results", "uninterrupted/3", "--into", into, "--workers", "2", "--fail-on", "nothing"]
            .map(str::to_owned)
            .to_vec()
    };
    let smaller = Work::of(&runner, "smaller", &smaller, &format!("shrink-{test}"));
    let config =
        ProptestConfig { cases: kills, failure_persistence: None, rng_seed: RngSeed::Fixed(1), ..Default::default() };
    let hits = RefCell::new(Vec::new());
    TestRunner::new(config)
        .run(&(0.0..1.0f64), |moment| {
            let at = hits.borrow().len();
            let victim = VICTIMS[at % VICTIMS.len()];
            // One in five comes into the making smaller.
            let work = if at % 5 == 4 { &smaller } else { &campaign };
            let tests = work.killed(&runner, victim, moment);
            eprintln!("{}: {victim:?} killed after {:.0} %: {tests:?} tests", work.arguments[0], moment * 100.0);
            fs::remove_dir_all(runner.folder.join(&work.folder)).unwrap();
            hits.borrow_mut().push((victim, tests));
            Ok(())
        })
        .unwrap();
    let hits = hits.into_inner();
    // In its last part, a run writes its page, without workers and simulators. The moments are shares of the way, which
    // is the same however busy the machine is.
    let middle = hits.iter().filter(|(_, tests)| tests.is_some_and(|tests| tests > 0)).count();
    assert!(2 * middle > hits.len(), "most kills are in the middle of a run: {hits:?}");
}

#[test]
fn results_are_the_same_after_any_process_is_killed_and_no_process_is_left() {
    killed_at_random_moments("killed_some", 8);
}

/// `SESAME_KILLS` says how many, if not two hundred.
#[test]
#[ignore = "long: two hundred kills"]
fn results_are_the_same_after_two_hundred_kills_and_no_process_is_left() {
    let kills = std::env::var("SESAME_KILLS").map_or(200, |text| text.parse().expect("a number of kills"));
    killed_at_random_moments("killed_two_hundred", kills);
}
