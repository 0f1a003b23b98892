//! A run that is stopped, in good order or not, goes on to what it would have been.

use std::cell::RefCell;
use std::fs;
use std::os::unix::process::{CommandExt as _, ExitStatusExt as _};
use std::path::Path;
use std::process::{Child, Stdio};
use std::thread::sleep;
use std::time::{Duration, Instant};

use nix::sys::signal::{Signal, kill, killpg};
use nix::unistd::Pid;
use proptest::prelude::*;
use proptest::test_runner::{RngSeed, TestRunner};

use sesame_base::observation::Outcome;
use sesame_patience as patience;
use sesame_record::{RecordError, Repository};
use sesame_tests::{Done, Runner};

use crate::faults::faulty;

/// Slows each of the 100 steps of a test down, so that there is a middle to stop in: 60 tests take some seconds.
const PAUSE_US: &str = "500";

/// A campaign in the background, in a process group of its own as a shell makes one.
pub(crate) struct Running {
    process: Child,
    folder: std::path::PathBuf,
}

impl Running {
    pub(crate) fn start(runner: &Runner, results: &str, workers: &str) -> Running {
        let mut command = runner.command(&["--results", results, "--workers", workers]);
        command.env("PAUSE_US", PAUSE_US).process_group(0).stdout(Stdio::piped()).stderr(Stdio::piped());
        Running { process: command.spawn().unwrap(), folder: runner.folder.join(results).join("3") }
    }

    fn pid(&self) -> Pid {
        Pid::from_raw(i32::try_from(self.process.id()).unwrap())
    }

    pub(crate) fn signal(&self, signal: Signal) {
        kill(self.pid(), signal).unwrap();
    }

    /// Waits until so many tests are recorded.
    pub(crate) fn until_recorded(&mut self, tests: usize) {
        patience::until(format_args!("{tests} tests are recorded"), || {
            assert!(self.process.try_wait().unwrap().is_none(), "it ended before {tests} tests were recorded");
            recorded(&self.folder) >= tests
        });
    }

    pub(crate) fn ended(self) -> (std::process::ExitStatus, Done) {
        let output = self.process.wait_with_output().unwrap();
        (output.status, Done::of(&output))
    }
}

/// How far a run is on its way, in the tests that it has recorded: wall time tells it only on a machine that is always
/// equally busy.
pub(crate) struct Clock {
    /// How many tests are recorded in the end.
    tests: usize,
    /// How long it took until the first one was, from one to the next, and from the last one to the end of the run.
    first: Duration,
    next: Duration,
    last: Duration,
}

impl Clock {
    /// Watches an unbroken run to its end.
    pub(crate) fn of(process: &mut Child, recorded: impl Fn() -> usize) -> Clock {
        let started = Instant::now();
        let (mut first, mut latest, mut tests) = (None, Duration::ZERO, 0);
        while process.try_wait().unwrap().is_none() {
            let now = recorded();
            if now > tests {
                (tests, latest) = (now, started.elapsed());
                first.get_or_insert(latest);
            }
            sleep(Duration::from_millis(2));
        }
        let (whole, tests) = (started.elapsed(), recorded());
        let first = first.unwrap_or(whole);
        let next = latest.saturating_sub(first) / u32::try_from(tests.max(1)).unwrap();
        Clock { tests, first, next, last: whole.saturating_sub(latest) }
    }

    /// Waits until a run has come this share of its way, or has ended.
    pub(crate) fn wait(&self, process: &mut Child, moment: f64, recorded: impl Fn() -> usize) {
        let way = moment * (self.tests + 1) as f64;
        let before = (0..=self.tests).rev().find(|&tests| tests as f64 <= way).unwrap_or(0);
        patience::until(format_args!("{before} tests are recorded"), || {
            recorded() >= before || process.try_wait().unwrap().is_some()
        });
        // And somewhere on the way to the next one. It does not matter where that is: every outcome is right.
        let step = match before {
            0 => self.first,
            _ if before >= self.tests => self.last,
            _ => self.next,
        };
        sleep(step.mul_f64(way - before as f64));
    }
}

fn recorded(folder: &Path) -> usize {
    Repository::open(folder).and_then(|repository| repository.tests()).map_or(0, |tests| tests.len())
}

/// The worker processes of a runner's program that are alive, of all supervisors.
fn workers(runner: &Runner) -> Vec<Pid> {
    let wanted = format!("{} worker ", runner.program.display());
    processes().into_iter().filter(|(_, words)| words.starts_with(&wanted)).map(|(pid, _)| Pid::from_raw(pid)).collect()
}

/// All processes with their command lines: from `/proc` where there is one, since not every Linux has `ps`.
fn processes() -> Vec<(i32, String)> {
    if let Ok(entries) = fs::read_dir("/proc") {
        let pids = entries.filter_map(|entry| entry.unwrap().file_name().to_str()?.parse().ok());
        let read = |pid: i32| {
            // What has ended meanwhile has no command line.
            let line = fs::read(format!("/proc/{pid}/cmdline")).unwrap_or_default();
            (pid, String::from_utf8_lossy(&line).replace('\0', " "))
        };
        return pids.map(read).collect();
    }
    let said = sesame_tests::done(std::process::Command::new("ps").args(["-A", "-o", "pid=,args="])).expect(0).out;
    let split = |line: &str| line.trim().split_once(' ').map(|(pid, words)| (pid.parse().unwrap(), words.to_owned()));
    said.lines().filter_map(split).collect()
}

/// Insists that all processes of a runner's program are gone, which may take workers a moment. One that was only just
/// being started has its supervisor's command line yet, and its lock.
#[track_caller]
pub(crate) fn no_worker_is_left(runner: &Runner) {
    let program = format!("{} ", runner.program.display());
    let left = || processes().into_iter().filter(|(_, words)| words.starts_with(&program)).collect::<Vec<_>>();
    let gone = patience::comes(|| left().is_empty());
    assert!(gone, "left behind: {:?}", left());
}

fn uninterrupted(runner: &Runner) -> String {
    runner.run(&["--results", "uninterrupted"]).expect(0).digest()
}

fn resumed(runner: &Runner, results: &str) -> String {
    let folder = format!("{results}/3");
    let digest = runner.run(&["resume", &folder]).expect(0).digest();
    assert_eq!(recorded(&runner.folder.join(&folder)), 62);
    digest
}

#[test]
fn ctrl_c_stops_in_good_order_and_resume_gives_what_an_unbroken_run_gives() {
    let runner = faulty("stopped", "harmless");
    let whole = uninterrupted(&runner);
    for (at, tests) in [1, 7, 30].into_iter().enumerate() {
        let results = format!("stopped{at}");
        let mut running = Running::start(&runner, &results, "2");
        running.until_recorded(tests);
        // To all of the group, as a terminal does.
        killpg(running.pid(), Signal::SIGINT).unwrap();
        let (_, said) = running.ended();
        let said = said.expect(130);
        let advice = format!(" resume {}\n", Path::new(&results).join("3").display());
        assert!(said.err.contains(&advice), "{}", said.err);
        assert_eq!(said.out, "");
        no_worker_is_left(&runner);
        let tests = Repository::open(&runner.folder.join(&results).join("3")).unwrap().tests().unwrap();
        assert!(tests.iter().all(|row| row.outcome == Outcome::Completed), "nothing is taken for a crash: {tests:?}");
        assert_eq!(resumed(&runner, &results), whole);
        let again = runner.run(&["resume", &format!("{results}/3")]).expect(1);
        assert!(again.err.contains("finished"), "{}", again.err);
    }
}

#[test]
fn a_run_in_progress_is_not_resumed_by_another_process_but_can_be_read() {
    let runner = faulty("busy", "harmless");
    let mut running = Running::start(&runner, "busy", "1");
    running.until_recorded(3);
    // It is in progress until its worker goes on, however long the others take.
    let [worker] = workers(&runner)[..] else { panic!("there is one worker") };
    kill(worker, Signal::SIGSTOP).unwrap();
    let refused = runner.run(&["resume", "busy/3"]).expect(1);
    assert!(refused.err.contains(&format!("process {} is writing", running.pid())), "{}", refused.err);
    assert!(runner.run(&["list", "--results", "busy/3"]).expect(0).out.contains("T1"));
    kill(worker, Signal::SIGCONT).unwrap();
    let (status, _) = running.ended();
    assert!(status.success());
}

/// How far a run was when it was killed.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
enum Progress {
    /// It had no results yet.
    HardlyBegun,
    /// With so many tests recorded.
    Recorded(usize),
    /// All was recorded but the page.
    AllButThePage,
    /// The kill came too late.
    Ended,
}

/// Whom a kill hits.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
enum Victim {
    Supervisor,
    Worker,
}

/// Kills the supervisor or a worker after this share of a run's way, and resumes where there is something to resume.
fn killed_at(runner: &Runner, victim: Victim, moment: f64, whole: &str, clock: &Clock) -> Progress {
    let results = format!("killed{moment:.6}");
    let mut running = Running::start(runner, &results, "2");
    clock.wait(&mut running.process, moment, || recorded(&running.folder));
    let tests = match victim {
        Victim::Supervisor => {
            kill(running.pid(), Signal::SIGKILL).unwrap();
            0
        }
        Victim::Worker => {
            // With both of them busy, which one does not matter.
            let worker = workers(runner).first().copied();
            let killed = worker.is_some_and(|worker| kill(worker, Signal::SIGKILL).is_ok());
            if killed { recorded(&running.folder) } else { usize::MAX }
        }
    };
    let (status, said) = running.ended();
    no_worker_is_left(runner);
    let folder = format!("{results}/3");
    let progress = if status.signal() == Some(9) {
        match Repository::open(&runner.folder.join(&folder)) {
            Err(error) => {
                // There is nothing yet, and nothing half done either: no test can have ended.
                assert!(matches!(error, RecordError::Missing { .. }), "killed after {moment} of its time: {error}");
                assert!(!said.err.contains("harmless "), "killed after {moment} of its time: {}", said.err);
                runner.run(&["resume", &folder]).expect(1);
                Progress::HardlyBegun
            }
            Ok(repository) if repository.campaign().stop.is_some() => {
                // There is nothing to go on with, and nothing is missing.
                assert_eq!(runner.run(&["report", "--results", &folder]).expect(0).digest(), whole);
                Progress::AllButThePage
            }
            Ok(repository) => {
                let tests = repository.tests().unwrap().len();
                drop(repository);
                let next = runner.run(&["--results", &results, "--evaluations", "1"]).expect(0);
                assert!(next.err.contains("an earlier run is unfinished"), "{}", next.err);
                assert_eq!(resumed(runner, &results), whole, "killed with {tests} tests recorded");
                Progress::Recorded(tests)
            }
        }
    } else if victim == Victim::Worker && status.code() == Some(1) {
        // A worker that cannot even start ends the run.
        assert!(said.err.contains("cannot start worker"), "{}", said.err);
        match Repository::open(&runner.folder.join(&folder)) {
            Err(error) => assert!(matches!(error, RecordError::Missing { .. }), "{error}"),
            Ok(repository) => {
                drop(repository);
                assert_eq!(resumed(runner, &results), whole);
            }
        }
        Progress::HardlyBegun
    } else {
        assert_eq!(said.expect(0).digest(), whole, "{victim:?} killed with {tests} tests recorded");
        if tests < 62 { Progress::Recorded(tests) } else { Progress::Ended }
    };
    fs::remove_dir_all(runner.folder.join(&results)).unwrap();
    progress
}

fn killed_at_random_moments(name: &str, moments: u32) {
    let runner = faulty(name, "harmless");
    let whole = uninterrupted(&runner);
    let mut slow = Running::start(&runner, "slow", "2");
    let clock = Clock::of(&mut slow.process, || recorded(&slow.folder));
    let (status, said) = slow.ended();
    assert!(status.success(), "{}", said.err);
    assert_eq!(said.digest(), whole, "wall time decides nothing");
    let config =
        ProptestConfig { cases: moments, failure_persistence: None, rng_seed: RngSeed::Fixed(1), ..Default::default() };
    let kills = RefCell::new(Vec::new());
    TestRunner::new(config)
        .run(&(0.0..1.0f64), |moment| {
            let victim = if kills.borrow().len() % 2 == 0 { Victim::Supervisor } else { Victim::Worker };
            let progress = killed_at(&runner, victim, moment, &whole, &clock);
            eprintln!("{victim:?} killed after {:.0} % of the way: {progress:?}", moment * 100.0);
            kills.borrow_mut().push((victim, progress));
            Ok(())
        })
        .unwrap();
    let mut kills = kills.into_inner();
    kills.sort_unstable();
    eprintln!("{kills:?}");
    let middle = kills.iter().filter(|(_, progress)| matches!(progress, Progress::Recorded(1..))).count();
    assert!(2 * middle > kills.len(), "most kills are in the middle of a run: {kills:?}");
}

#[test]
fn a_run_killed_at_any_moment_loses_nothing_that_cannot_be_taken_up_again() {
    killed_at_random_moments("killed", 6);
}

#[test]
#[ignore = "long: a hundred kills"]
fn a_run_killed_at_a_hundred_moments_loses_nothing_that_cannot_be_taken_up_again() {
    killed_at_random_moments("killed_often", 100);
}

#[test]
fn a_killed_worker_leaves_no_trace_in_results_but_a_note() {
    let runner = faulty("worker_killed", "harmless");
    let whole = uninterrupted(&runner);
    let mut running = Running::start(&runner, "results", "1");
    running.until_recorded(5);
    let [worker] = workers(&runner)[..] else { panic!("there is one worker") };
    kill(worker, Signal::SIGKILL).unwrap();
    let (status, said) = running.ended();
    assert!(status.success(), "{}", said.err);
    assert_eq!(said.digest(), whole);
    let listed = (1..=62).map(|test| runner.run(&["show", &format!("T{test}"), "--results", "results/3"]).out);
    let noted = listed.filter(|shown| shown.contains("the test was run again")).count();
    assert_eq!(noted, 1, "one test was running");
    no_worker_is_left(&runner);
}

/// A test that is killed each time is not run for ever.
#[test]
fn a_worker_that_is_killed_each_time_is_a_crash_of_its_test() {
    let runner = faulty("killed_each_time", "harmless");
    let mut command = runner.command(&["--results", "results"]);
    let said = Done::of(&command.env("FAULT", "kill").output().unwrap()).expect(1);
    assert!(said.err.contains("signal: 9 (SIGKILL)"), "{}", said.err);
    assert!(said.err.contains("the reference run failed"), "{}", said.err);
}
