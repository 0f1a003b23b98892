//! Simulators that do what no simulator should: what comes of each, what it costs the worker, and that nothing is left.
//!
//! `tests/hostile` is the simulator, a program whose modes have the names that stand here; each mode is a known test.

use std::collections::{BTreeMap, BTreeSet};
use std::fmt::Write as _;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::time::Duration;
use std::{fs, thread};

use sesame_base::observation::Outcome;
use sesame_record::{Origin, Repository};
use sesame_tests::{Done, Project, Runner, done, shared};

/// What is to come of a mode.
#[derive(Debug, Clone, Copy)]
enum Expected {
    /// The test goes to its end.
    Completed,
    /// A crash whose words hold this.
    Crash(&'static str),
    /// It is stopped.
    Timeout,
}

use Expected::{Completed, Crash, Timeout};

/// How much memory a worker may take that runs these modes, in MiB: a line and what is made of it are held in memory.
const FEW: u64 = 24;
const MANY: u64 = 160;

/// What is left over when an answer in the middle of a test has moved all after it.
const MOVED: &str = "comes after everything was answered: `{\"publish\":[{\"topic\":\"control\",\"value\":-1}]}`";

/// Modes that hardly cost the worker anything.
const SMALL: &[(&str, Expected)] = &[
    ("says_half_a_line_and_waits", Timeout),
    ("says_half_a_line_and_exits", Crash("ended (exit status: 0) while the end of its step to 0.150 s was awaited")),
    ("writes_byte_by_byte", Completed),
    ("ends_its_line_as_windows_does", Completed),
    ("says_an_empty_line", Crash("is not JSON")),
    ("says_a_byte_order_mark", Crash("is not JSON")),
    ("says_what_is_not_utf8", Crash("is not UTF-8")),
    ("says_random_bytes", Crash("is not UTF-8")),
    ("says_what_is_not_json", Crash("line 7 since the simulator's reset is not JSON: `Loading map...`")),
    ("says_null", Crash("is not of the protocol")),
    ("says_a_list", Crash("is not of the protocol")),
    ("says_an_unknown_word", Crash("is not of the protocol")),
    ("says_two_objects_in_a_line", Crash("is not JSON")),
    ("says_a_word_twice", Crash("is not of the protocol")),
    ("says_an_unknown_field", Crash("unknown field `message`")),
    ("says_deliver", Crash("is not of the protocol")),
    ("says_ready_in_a_step", Crash("says `ready` while the end of its step to 0.150 s was awaited")),
    ("publishes_without_end", Crash("has more than 100000 messages in the step to 0.150 s")),
    ("publishes_nothing", Completed),
    ("publishes_on_a_topic_it_did_not_name", Crash("has a message on `nowhere`")),
    ("publishes_a_topic_twice_in_a_message", Crash("duplicate field `topic`")),
    ("publishes_no_value", Crash("missing field `value`")),
    ("publishes_a_field_twice", Crash("is not of its declared type: field `speed`")),
    ("publishes_a_message_without_a_field", Crash("is not of its declared type")),
    ("publishes_a_point_of_two_numbers", Crash("is not of its declared type: field `position`")),
    ("publishes_nan_bare", Crash("write such a number as the string \"NaN\"")),
    ("publishes_nan_as_text", Completed),
    ("publishes_infinity_as_text", Completed),
    ("publishes_a_number_beyond_reals", Crash("is not of its declared type")),
    ("publishes_the_largest_real", Completed),
    ("publishes_the_smallest_real", Completed),
    ("publishes_minus_zero", Completed),
    ("publishes_a_number_of_a_hundred_thousand_digits", Completed),
    ("publishes_a_text_for_a_real", Crash("expected real, found text")),
    ("publishes_null_for_a_real", Crash("expected real, found null")),
    ("publishes_a_whole_number_beyond_64_bits", Crash("is not of its declared type")),
    ("publishes_a_whole_number_of_400_digits", Crash("is not of its declared type")),
    ("publishes_a_fraction_for_a_whole_number", Crash("is not of its declared type")),
    ("publishes_a_whole_number_with_a_point", Completed),
    ("publishes_nul_in_a_text", Completed),
    ("publishes_escapes_and_markup_in_a_text", Completed),
    ("publishes_half_a_surrogate", Crash("is not of its declared type")),
    ("fails_with_markup", Crash("drop table tests")),
    ("answers_twice_at_once", Crash(MOVED)),
    ("answers_twice_one_after_the_other", Crash(MOVED)),
    ("answers_twice_with_a_pause", Crash(MOVED)),
    ("answers_200000_times", Crash("comes after everything was answered: `{\"done\":{}}`")),
    ("ends_twice", Crash("comes after everything was answered: `{\"done\":{\"ended\":true}}`")),
    ("answers_twice_at_the_end", Crash("comes after everything was answered: `{\"done\":{}}`")),
    ("speaks_long_after_its_last_answer", Completed),
    ("answers_the_next_reset_wrongly", Completed),
    ("exits_at_the_next_reset", Completed),
    ("exits_after_its_last_answer", Completed),
    (
        "exits_with_3",
        Crash(
            "ended (exit status: 3) while the end of its step to 0.150 s was awaited; the last lines of its standard error:\nthe gripper is stuck",
        ),
    ),
    ("exits_with_0", Crash("ended (exit status: 0)")),
    ("aborts", Crash("ended (signal: 6 (SIGABRT)")),
    ("kills_itself", Crash("ended (signal: 9 (SIGKILL))")),
    ("kills_its_group", Crash("ended (signal: 9 (SIGKILL))")),
    ("kills_its_keeper", Crash("ended (signal: 9 (SIGKILL))")),
    ("kills_its_worker_once", Completed),
    ("kills_its_worker_each_time", Crash("the worker process ended: signal: 9 (SIGKILL)")),
    ("stops_its_worker", Timeout),
    ("stops_its_keeper", Timeout),
    ("stops_itself", Timeout),
    ("never_answers", Timeout),
    ("answers_late", Timeout),
    ("never_reads", Timeout),
    ("closes_its_output", Crash("closed its standard output, but did not exit, while")),
    ("closes_its_input", Crash("ended (exit status: 0)")),
    ("closes_its_standard_error", Completed),
    ("starts_children", Completed),
    ("starts_children_and_exits", Crash("ended (exit status: 3)")),
    (
        "starts_a_child_that_holds_its_output_and_exits",
        Crash(
            "ended (exit status: 3) while the end of its step to 0.150 s was awaited; the last lines of its standard error:\nthe child has it now",
        ),
    ),
    ("starts_a_session", Completed),
    ("starts_a_session_that_holds_its_output_and_exits", Crash("ended (exit status: 3)")),
    ("starts_a_daemon", Completed),
    ("starts_one_that_is_another_each_moment", Completed),
    ("starts_one_that_ignores_signals", Completed),
    ("starts_many_that_end", Completed),
    ("ignores_the_end_of_its_input", Completed),
    ("holds_its_own_input_open", Completed),
    ("says_bye_after_the_end_of_its_input", Completed),
    ("floods_standard_error", Completed),
    ("floods_standard_error_without_end", Timeout),
    ("takes_much_memory", Completed),
];

/// Modes that send the worker as much as it takes.
const LARGE: &[(&str, Expected)] = &[
    ("says_a_long_line", Crash("is longer than 16777216 bytes")),
    ("says_a_line_without_end", Crash("is longer than 16777216 bytes")),
    ("says_an_unknown_field_of_a_megabyte", Crash("unknown field `xxx")),
    ("nests_a_million_lists_in_the_protocol", Crash("is not JSON")),
    ("publishes_more_than_a_step_may_in_one_line", Crash("has more than 100000 messages in the step to 0.150 s")),
    ("publishes_on_a_topic_with_a_name_of_eight_megabytes", Crash("has a message on `xxx")),
    ("publishes_a_million_lists_for_a_real", Crash("expected real, found a list")),
    ("publishes_a_text_of_eight_megabytes", Completed),
    ("publishes_a_list_of_a_million_numbers", Completed),
    ("publishes_a_million_lists_in_a_field_of_its_own", Completed),
    ("publishes_a_million_lists_on_a_topic_of_its_own", Completed),
    ("fails_with_ten_megabytes", Crash("the simulator failed: xxx")),
];

/// Ends the runner itself, so it is in none of the others.
const KILLS_THE_RUNNER: &str = "kills_the_runner";

/// How long a test may take, in seconds: little where it takes for ever, and enough where it comes to its end.
const LITTLE: &str = "3";
const ENOUGH: &str = "120";

/// What marks a process that a test of this file has started, and all below it.
const MARK: &str = "SESAME_HOSTILE_MARK";

/// A topic of each kind, and a known test for each mode.
fn space(modes: &[String]) -> String {
    let mut space = format!(
        "space hostile
        system {{
          simulator hostile = process \"{}\" {{ step 50ms }}
          message Pose {{ position: point[m]  speed: real[m/s] }}
          topic control = \"control\" : real
          topic number  = \"number\"  : real
          topic whole   = \"whole\"   : int
          topic note    = \"note\"    : text
          topic samples = \"samples\" : list of real
          topic pose    = \"pose\"    : Pose
        }}
        metric heard maximise default 0 = last(number)
        metric fuzzing_time minimise = fuzzing_time()
        operation mode on control = stuck at [0, {}] within [0s, 1s]\n",
        env!("CARGO_BIN_EXE_hostile"),
        modes.len()
    );
    for (number, mode) in modes.iter().enumerate() {
        writeln!(space, "test {mode} {{ mode value {number} from 0.12s to 0.5s }}").unwrap();
    }
    space
        + "campaign all {
          objectives fuzzing_time, heard
          operations mode 1..1 per test
          activate   by time
          search     random { evaluations 10  seed 1 }
          end        after 0.5s
        }"
}

/// The runner, in a folder of this name.
fn runner(name: &str) -> Runner {
    shared(name, "hostile", "all", |key| {
        let listed = done(std::process::Command::new(env!("CARGO_BIN_EXE_hostile")).arg("--list")).expect(0).out;
        let modes: Vec<String> = listed.lines().map(str::to_owned).collect();
        let known = SMALL.iter().chain(LARGE).map(|(name, _)| *name).chain([KILLS_THE_RUNNER]);
        let known: BTreeSet<&str> = known.collect();
        assert_eq!(known, modes.iter().map(String::as_str).collect(), "each mode is tested once");
        assert_eq!(known.len(), modes.len());
        Project::new(key, &space(&modes), "anything")
    })
}

/// What came of some modes.
struct Ran {
    /// Where its results are.
    folder: PathBuf,
    said: Done,
    outcomes: BTreeMap<String, Outcome>,
    /// The most that a worker took, in MiB.
    peak: u64,
}

/// Runs these modes as known tests, each once; afterwards no process may be left.
fn run(results: &str, modes: &[&str], workers: &str, limit: &str) -> Ran {
    let runner = runner(&format!("hostile_{results}"));
    let folder = runner.folder.join(results);
    let limits = ["--timeout", limit, "--reference-timeout", ENOUGH];
    let arguments = [&["known", "--results", results, "--workers", workers], &limits[..], modes].concat();
    let mark = format!("{results}-{}", std::process::id());
    let mut command = runner.command(&arguments);
    command.env(MARK, &mark);
    let watch = Watch::start(mark.clone());
    let said = done(&mut command);
    let peak = watch.end();
    nothing_is_left(&mark);
    let repository = Repository::open(&folder.join("known")).unwrap_or_else(|error| panic!("{error}: {}", said.err));
    let plan = repository.plan().clone();
    let mut outcomes = BTreeMap::new();
    for row in repository.tests().unwrap() {
        match row.origin {
            Origin::Known(id) => {
                outcomes.insert(plan.tests[id.index()].name.clone(), row.outcome);
            }
            _ => assert_eq!(row.outcome, Outcome::Completed, "without disturbance it behaves well: {}", said.err),
        }
    }
    assert_eq!(outcomes.len(), modes.len(), "{}", said.err);
    Ran { folder, said, outcomes, peak }
}

/// The largest part of memory that workers of a marked run had at once, watched as it runs.
struct Watch {
    stop: Arc<AtomicBool>,
    peak: Arc<AtomicU64>,
    thread: thread::JoinHandle<()>,
}

impl Watch {
    fn start(mark: String) -> Watch {
        let (stop, peak) = (Arc::new(AtomicBool::new(false)), Arc::new(AtomicU64::new(0)));
        let (stopped, highest) = (Arc::clone(&stop), Arc::clone(&peak));
        let watch = move || {
            while !stopped.load(Ordering::Relaxed) {
                for (id, line) in marked(&mark) {
                    if line.contains(" worker ") {
                        highest.fetch_max(peak_of(id).unwrap_or(0), Ordering::Relaxed);
                    }
                }
                thread::sleep(Duration::from_millis(20));
            }
        };
        Watch { stop, peak, thread: thread::spawn(watch) }
    }

    fn end(self) -> u64 {
        self.stop.store(true, Ordering::Relaxed);
        self.thread.join().unwrap();
        self.peak.load(Ordering::Relaxed)
    }
}

/// The most memory that a process ever had, in MiB, where the system says it.
fn peak_of(id: u32) -> Option<u64> {
    let status = fs::read_to_string(format!("/proc/{id}/status")).ok()?;
    let line = status.lines().find_map(|line| line.strip_prefix("VmHWM:"))?;
    Some(line.trim().trim_end_matches(" kB").parse::<u64>().ok()? / 1024)
}

/// The living processes with this mark, and their command lines.
fn marked(mark: &str) -> Vec<(u32, String)> {
    let wanted = format!("{MARK}={mark}");
    let Ok(folder) = fs::read_dir("/proc") else { return Vec::new() };
    let ids = folder.filter_map(|entry| entry.ok()?.file_name().to_str()?.parse().ok());
    let is_marked = |id: &u32| {
        let environment = fs::read(format!("/proc/{id}/environ")).unwrap_or_default();
        environment.split(|&byte| byte == 0).any(|variable| variable == wanted.as_bytes())
    };
    let line =
        |id| String::from_utf8_lossy(&fs::read(format!("/proc/{id}/cmdline")).unwrap_or_default()).replace('\0', " ");
    // What has ended and is not reaped has no environment.
    ids.filter(is_marked).map(|id| (id, line(id))).collect()
}

/// Insists that no process with this mark lives; a runner that was killed cannot wait for the last of them.
#[track_caller]
fn nothing_is_left(mark: &str) {
    let gone = sesame_patience::comes(|| marked(mark).is_empty());
    assert!(gone, "left behind: {:#?}", marked(mark));
}

/// Whether the system shows what these tests look at. Elsewhere nobody could say what is left.
fn shown_here() -> bool {
    let shown = Path::new("/proc/self/environ").exists() && peak_of(std::process::id()).is_some();
    if !shown {
        eprintln!("skipped: this system does not show its processes in /proc");
    }
    shown
}

#[track_caller]
fn came_out_as_expected(ran: &Ran, expected: &[(&str, Expected)], bound: u64) {
    let mut wrong = Vec::new();
    for (mode, expected) in expected {
        let outcome = &ran.outcomes[*mode];
        let right = match (expected, outcome) {
            (Completed, Outcome::Completed) | (Timeout, Outcome::Timeout { .. }) => true,
            (Crash(words), Outcome::Crash { message }) => message.contains(words) && message.len() < 5000,
            _ => false,
        };
        if !right {
            let detail: String = outcome.detail().unwrap_or_default().chars().take(300).collect();
            wrong.push(format!("{mode} is to be {expected:?}, but it is {}: {detail}", outcome.word()));
        }
    }
    assert!(wrong.is_empty(), "{}\n{}", wrong.join("\n"), ran.said.err);
    eprintln!("a worker took {} MiB at most", ran.peak);
    assert!(ran.peak > 0, "no worker was seen");
    assert!(ran.peak <= bound, "a worker took {} MiB, more than {bound}", ran.peak);
}

fn names<'a>(modes: &[(&'a str, Expected)]) -> Vec<&'a str> {
    modes.iter().map(|(name, _)| *name).collect()
}

#[test]
fn each_kind_of_misbehaviour_is_the_outcome_of_its_own_test_and_leaves_no_process() {
    if !shown_here() {
        return;
    }
    let (stuck, small): (Vec<_>, Vec<_>) = SMALL.iter().copied().partition(|(_, answer)| matches!(answer, Timeout));
    let of_small = run("small", &names(&small), "2", ENOUGH);
    came_out_as_expected(&of_small, &small, FEW);
    let of_stuck = run("stuck", &names(&stuck), "2", LITTLE);
    came_out_as_expected(&of_stuck, &stuck, FEW);
    let log = |ran: &Ran, worker| ran.folder.join(format!("known/workers/{worker}/output.log"));
    let logs = [&of_small, &of_stuck].into_iter().flat_map(|ran| [log(ran, 1), log(ran, 2)]);
    let logged: u64 = logs.filter_map(|log| fs::metadata(log).ok()).map(|file| file.len()).sum();
    assert!((2 << 20..4 << 20).contains(&logged), "two floods of standard error are logged, but not whole: {logged}");
}

#[test]
fn what_a_simulator_sends_takes_no_more_of_its_workers_memory_than_is_bounded() {
    if !shown_here() {
        return;
    }
    came_out_as_expected(&run("large", &names(LARGE), "2", ENOUGH), LARGE, MANY);
}

/// Which test a worker runs after which depends on the number of workers; nothing else may.
#[test]
fn an_answer_too_many_is_blamed_on_its_own_test_with_any_number_of_workers() {
    if !shown_here() {
        return;
    }
    let modes: Vec<&str> = names(SMALL)
        .into_iter()
        .filter(|name| {
            ["answers_", "ends_", "speaks_", "exits_", "publishes_the", "says_a"]
                .iter()
                .any(|part| name.starts_with(part))
        })
        .filter(|&name| name != "answers_late")
        .collect();
    assert!(modes.len() >= 15, "{modes:?}");
    let digests: BTreeSet<String> = ["1", "2", "3"]
        .into_iter()
        .map(|workers| run(&format!("answers{workers}"), &modes, workers, ENOUGH).said.digest())
        .collect();
    assert_eq!(digests.len(), 1);
}

#[test]
fn a_simulator_has_time_to_end_by_itself_at_the_end_of_a_campaign_and_after_a_timeout() {
    if !shown_here() {
        return;
    }
    for after in ["publishes_nothing", "stops_its_worker"] {
        let results = format!("bye_{after}");
        let ran = run(&results, &["says_bye_after_the_end_of_its_input", after], "1", LITTLE);
        let bye = ran.folder.join("known/workers/1/bye");
        assert_eq!(fs::read_to_string(&bye).unwrap_or_default(), "bye", "{after}");
    }
}

#[test]
fn nothing_is_left_of_a_simulator_that_kills_the_runner() {
    if !shown_here() {
        return;
    }
    let mark = format!("killed-{}", std::process::id());
    let runner = runner("hostile_killed");
    let mut command = runner.command(&["known", "--results", "killed", "--workers", "2", KILLS_THE_RUNNER]);
    let said = done(command.env(MARK, &mark));
    assert_eq!(said.code, None, "{}", said.err);
    nothing_is_left(&mark);
}
