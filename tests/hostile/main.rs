//! A simulator that does in each test what no simulator should: the tests across crates choose what by its name.
//!
//! It publishes `-1` on `control` in each step; what is delivered in its place is the number of a mode, which it then
//! acts on once. `--list` prints the modes in the order of their numbers.

use std::fs;
use std::io::{BufRead as _, Write as _};
use std::os::fd::OwnedFd;
use std::os::unix::process::CommandExt as _;
use std::path::PathBuf;
use std::process::{Command, Stdio, exit};
use std::thread::sleep;
use std::time::Duration;

use rustix::process::{Pid, Signal, kill_process, kill_process_group};

const READY: &str = r#"{"ready":{"publishes":["control","number","whole","note","samples","pose","own"],"subscribes":["control","own"],"resets":true}}"#;
const DONE: &str = r#"{"done":{}}"#;

/// Steps in a test.
const STEPS: u32 = 10;

/// The longest that anything here lives when nobody ends it: for longer than any test waits.
const LIFE: Duration = Duration::from_secs(600);

/// What a mode does.
enum Act {
    /// It says these bytes and a line's end where its answer is awaited.
    Says(&'static [u8]),
    /// It says what this makes.
    Makes(fn() -> Vec<u8>),
    /// It does something, and then answers as it should.
    Does(fn(&mut Hostile)),
    /// It does something in place of its answer.
    Instead(fn(&mut Hostile)),
}

use Act::{Does, Instead, Makes, Says};

const MODES: &[(&str, Act)] = &[
    // Lines.
    ("says_a_long_line", Makes(|| vec![b'x'; 64 << 20])),
    (
        "says_a_line_without_end",
        Instead(|_| {
            loop {
                write(&[b'x'; 1 << 16]);
            }
        }),
    ),
    (
        "says_half_a_line_and_waits",
        Instead(|_| {
            write(br#"{"done":"#);
            sleep(LIFE);
        }),
    ),
    (
        "says_half_a_line_and_exits",
        Instead(|_| {
            write(br#"{"done":"#);
            exit(0);
        }),
    ),
    (
        "writes_byte_by_byte",
        Instead(|_| {
            for byte in DONE.bytes().chain([b'\n']) {
                write(&[byte]);
                sleep(Duration::from_millis(2));
            }
        }),
    ),
    ("ends_its_line_as_windows_does", Says(b"{\"done\":{}}\r")),
    ("says_an_empty_line", Says(b"")),
    ("says_a_byte_order_mark", Says(b"\xef\xbb\xbf{\"done\":{}}")),
    ("says_what_is_not_utf8", Says(b"{\"done\":{\"\xff\":1}}")),
    ("says_random_bytes", Says(b"\x00\x9c\x1b\x07\xf0\x28\x8c\x28\x03")),
    // What is not of the protocol.
    ("says_what_is_not_json", Says(b"Loading map...")),
    ("says_null", Says(b"null")),
    ("says_a_list", Says(b"[]")),
    ("says_an_unknown_word", Says(br#"{"hello":{}}"#)),
    ("says_two_objects_in_a_line", Says(br#"{"done":{}}{"done":{}}"#)),
    ("says_a_word_twice", Says(br#"{"done":{},"done":{}}"#)),
    ("says_an_unknown_field", Says(br#"{"done":{"message":[]}}"#)),
    ("says_an_unknown_field_of_a_megabyte", Makes(|| quoted("{\"done\":{\"", 1 << 20, "\":1}}"))),
    ("says_deliver", Says(br#"{"deliver":[]}"#)),
    ("says_ready_in_a_step", Says(READY.as_bytes())),
    ("nests_a_million_lists_in_the_protocol", Makes(|| vec![b'['; 1 << 20])),
    // Messages.
    (
        "publishes_without_end",
        Instead(|_| {
            loop {
                let many = vec![r#"{"topic":"own","value":1}"#; 1000].join(",");
                say(format!("{{\"publish\":[{many}]}}").as_bytes());
                order();
            }
        }),
    ),
    (
        "publishes_more_than_a_step_may_in_one_line",
        Makes(|| {
            let many = vec![r#"{"topic":"own","value":1}"#; 100_001].join(",");
            format!("{{\"done\":{{\"messages\":[{many}]}}}}").into_bytes()
        }),
    ),
    (
        "publishes_nothing",
        Does(|_| {
            say(br#"{"publish":[]}"#);
            order();
        }),
    ),
    ("publishes_on_a_topic_it_did_not_name", Makes(|| done(r#"{"topic":"nowhere","value":1}"#))),
    (
        "publishes_on_a_topic_with_a_name_of_eight_megabytes",
        Makes(|| quoted("{\"done\":{\"messages\":[{\"topic\":\"", 8 << 20, "\",\"value\":1}]}}")),
    ),
    ("publishes_a_topic_twice_in_a_message", Makes(|| done(r#"{"topic":"number","topic":"number","value":1}"#))),
    ("publishes_no_value", Makes(|| done(r#"{"topic":"number"}"#))),
    ("publishes_a_field_twice", Makes(|| done(r#"{"topic":"pose","value":{"position":[0,0,0],"speed":1,"speed":2}}"#))),
    ("publishes_a_message_without_a_field", Makes(|| done(r#"{"topic":"pose","value":{"speed":1}}"#))),
    ("publishes_a_point_of_two_numbers", Makes(|| done(r#"{"topic":"pose","value":{"position":[0,0],"speed":1}}"#))),
    // Numbers.
    ("publishes_nan_bare", Makes(|| number("NaN"))),
    ("publishes_nan_as_text", Makes(|| number("\"NaN\""))),
    ("publishes_infinity_as_text", Makes(|| number("\"-Infinity\""))),
    ("publishes_a_number_beyond_reals", Makes(|| number("1e999"))),
    ("publishes_the_largest_real", Makes(|| number("1.7976931348623157e308"))),
    ("publishes_the_smallest_real", Makes(|| number("-5e-324"))),
    ("publishes_minus_zero", Makes(|| number("-0.0"))),
    ("publishes_a_number_of_a_hundred_thousand_digits", Makes(|| number(&format!("1.{}", "3".repeat(100_000))))),
    ("publishes_a_text_for_a_real", Makes(|| number("\"fast\""))),
    ("publishes_null_for_a_real", Makes(|| number("null"))),
    ("publishes_a_million_lists_for_a_real", Makes(|| number(&nested(1 << 20)))),
    ("publishes_a_whole_number_beyond_64_bits", Makes(|| whole("18446744073709551615"))),
    ("publishes_a_whole_number_of_400_digits", Makes(|| whole(&"9".repeat(400)))),
    ("publishes_a_fraction_for_a_whole_number", Makes(|| whole("3.5"))),
    ("publishes_a_whole_number_with_a_point", Makes(|| whole("3.0"))),
    // Texts and lists.
    ("publishes_nul_in_a_text", Makes(|| note(r"a\u0000b"))),
    ("publishes_escapes_and_markup_in_a_text", Makes(|| note(r"\u001b[31m</script><script>alert(1)</script>"))),
    ("publishes_half_a_surrogate", Makes(|| note(r"\ud800"))),
    ("publishes_a_text_of_eight_megabytes", Makes(|| note(&"x".repeat(8 << 20)))),
    (
        "publishes_a_list_of_a_million_numbers",
        Makes(|| done(&format!("{{\"topic\":\"samples\",\"value\":[{}]}}", vec!["1"; 1_000_000].join(",")))),
    ),
    (
        "publishes_a_million_lists_in_a_field_of_its_own",
        Makes(|| {
            done(&format!(
                "{{\"topic\":\"pose\",\"value\":{{\"position\":[0,0,0],\"speed\":1,\"more\":{}}}}}",
                nested(1 << 20)
            ))
        }),
    ),
    (
        "publishes_a_million_lists_on_a_topic_of_its_own",
        Makes(|| done(&format!("{{\"topic\":\"own\",\"value\":{}}}", nested(1 << 20)))),
    ),
    // Failures in its own words.
    ("fails_with_markup", Says(br#"{"failed":"\u001b[2J<script>alert(1)</script>'; drop table tests; --"}"#)),
    ("fails_with_ten_megabytes", Makes(|| quoted("{\"failed\":\"", 10 << 20, "\"}"))),
    // Answers too many.
    (
        "answers_twice_at_once",
        Instead(|hostile| {
            say(b"{\"done\":{}}\n{\"done\":{}}");
            hostile.ahead = true;
        }),
    ),
    (
        "answers_twice_one_after_the_other",
        Instead(|hostile| {
            say(DONE.as_bytes());
            say(DONE.as_bytes());
            hostile.ahead = true;
        }),
    ),
    (
        "answers_twice_with_a_pause",
        Instead(|hostile| {
            say(DONE.as_bytes());
            sleep(Duration::from_millis(30));
            say(DONE.as_bytes());
            hostile.ahead = true;
        }),
    ),
    ("answers_200000_times", Makes(|| vec![DONE; 200_000].join("\n").into_bytes())),
    ("ends_twice", Says(b"{\"done\":{\"ended\":true}}\n{\"done\":{\"ended\":true}}")),
    (
        "answers_twice_at_the_end",
        Does(|hostile| {
            hostile.at_the_end = Some(|_| say(b"{\"done\":{}}\n{\"done\":{}}"));
        }),
    ),
    (
        "speaks_long_after_its_last_answer",
        Does(|hostile| {
            hostile.at_the_end = Some(|_| {
                say(DONE.as_bytes());
                // The run is over when the runner speaks again.
                std::io::stdin().lock().fill_buf().ok();
                say(DONE.as_bytes());
            });
        }),
    ),
    ("answers_the_next_reset_wrongly", Does(|hostile| hostile.at_reset = Some(|_| say(DONE.as_bytes())))),
    ("exits_at_the_next_reset", Does(|hostile| hostile.at_reset = Some(|_| exit(9)))),
    (
        "exits_after_its_last_answer",
        Does(|hostile| {
            hostile.at_the_end = Some(|_| {
                say(DONE.as_bytes());
                exit(7);
            });
        }),
    ),
    // Ways to end, and not to.
    (
        "exits_with_3",
        Instead(|_| {
            eprintln!("the gripper is stuck");
            exit(3);
        }),
    ),
    ("exits_with_0", Instead(|_| exit(0))),
    ("aborts", Instead(|_| std::process::abort())),
    ("kills_itself", Instead(|_| signal(std::process::id(), Signal::KILL))),
    (
        "kills_its_group",
        Instead(|_| {
            child("sleep", true).spawn().ok();
            kill_process_group(rustix::process::getpgrp(), Signal::KILL).ok();
        }),
    ),
    (
        "kills_its_keeper",
        Instead(|_| {
            child("setsid", false).spawn().ok();
            signal(parent(std::process::id()), Signal::KILL);
            sleep(LIFE);
        }),
    ),
    (
        "kills_its_worker_once",
        Does(|_| {
            let killed =
                PathBuf::from(std::env::var_os("SESAME_WORKER_FOLDER").unwrap_or_default()).join("killed_once");
            if fs::File::create_new(killed).is_ok() {
                signal(worker(), Signal::KILL);
                sleep(LIFE);
            }
        }),
    ),
    (
        "kills_its_worker_each_time",
        Instead(|_| {
            signal(worker(), Signal::KILL);
            sleep(LIFE);
        }),
    ),
    (
        "kills_the_runner",
        Instead(|_| {
            child("setsid", false).spawn().ok();
            signal(parent(worker()), Signal::KILL);
            sleep(LIFE);
        }),
    ),
    (
        "stops_its_worker",
        Instead(|_| {
            signal(worker(), Signal::STOP);
            sleep(LIFE);
        }),
    ),
    (
        "stops_itself",
        Instead(|_| {
            signal(std::process::id(), Signal::STOP);
            sleep(LIFE);
        }),
    ),
    (
        "stops_its_keeper",
        Instead(|_| {
            child("setsid", false).spawn().ok();
            signal(parent(std::process::id()), Signal::STOP);
            sleep(LIFE);
        }),
    ),
    ("never_answers", Instead(|_| sleep(LIFE))),
    ("answers_late", Does(|hostile| hostile.pause = Duration::from_millis(600))),
    (
        "never_reads",
        Instead(|_| {
            let many = vec![r#"{"topic":"own","value":1}"#; 1000].join(",");
            for _ in 0..90 {
                say(format!("{{\"publish\":[{many}]}}").as_bytes());
            }
            sleep(LIFE);
        }),
    ),
    (
        "closes_its_output",
        Instead(|_| {
            rustix::stdio::dup2_stdout(null()).ok();
            sleep(LIFE);
        }),
    ),
    (
        "closes_its_input",
        Does(|_| {
            rustix::stdio::dup2_stdin(null()).ok();
        }),
    ),
    (
        "closes_its_standard_error",
        Does(|hostile| {
            hostile.standard_error = rustix::io::dup(rustix::stdio::stderr()).ok();
            rustix::stdio::dup2_stderr(null()).ok();
        }),
    ),
    // Processes that it starts.
    (
        "starts_children",
        Does(|_| {
            for _ in 0..30 {
                child("sleep", false).spawn().ok();
            }
        }),
    ),
    (
        "starts_children_and_exits",
        Instead(|_| {
            for _ in 0..30 {
                child("sleep", false).spawn().ok();
            }
            exit(3);
        }),
    ),
    (
        "starts_a_child_that_holds_its_output_and_exits",
        Instead(|_| {
            eprintln!("the child has it now");
            child("sleep", true).spawn().ok();
            exit(3);
        }),
    ),
    (
        "starts_a_session",
        Does(|_| {
            child("setsid", false).spawn().ok();
        }),
    ),
    (
        "starts_a_session_that_holds_its_output_and_exits",
        Instead(|_| {
            child("setsid", true).spawn().ok();
            exit(3);
        }),
    ),
    (
        "starts_a_daemon",
        Does(|_| {
            child("daemon", false).status().ok();
        }),
    ),
    (
        "starts_one_that_is_another_each_moment",
        Does(|_| {
            child("hare", false).spawn().ok();
        }),
    ),
    (
        "starts_one_that_ignores_signals",
        Does(|_| {
            let own = std::env::current_exe().unwrap_or_default();
            let mut shell = Command::new("sh");
            let shell = shell.args(["-c", "trap '' TERM HUP INT QUIT; exec \"$0\" child sleep"]).arg(own);
            shell.stdin(Stdio::null()).stdout(Stdio::null()).spawn().ok();
        }),
    ),
    (
        "starts_many_that_end",
        Does(|_| {
            for _ in 0..200 {
                child("gone", false).spawn().ok();
            }
        }),
    ),
    ("ignores_the_end_of_its_input", Does(|hostile| hostile.after_input = Some(|| sleep(LIFE)))),
    (
        "holds_its_own_input_open",
        Does(|hostile| {
            hostile.held = fs::File::options().write(true).open("/proc/self/fd/0").ok();
            hostile.after_input = Some(|| sleep(LIFE));
        }),
    ),
    (
        "says_bye_after_the_end_of_its_input",
        Does(|hostile| {
            hostile.after_input = Some(|| {
                let folder = PathBuf::from(std::env::var_os("SESAME_WORKER_FOLDER").unwrap_or_default());
                // One that is killed at the end of its input does not come to this; a second is what it is given.
                sleep(Duration::from_millis(100));
                fs::write(folder.join("bye"), "bye").ok();
            });
        }),
    ),
    // Floods in addition to the protocol.
    (
        "floods_standard_error",
        Does(|_| {
            let line = [vec![b'e'; 1023], vec![b'\n']].concat();
            for _ in 0..20_000 {
                std::io::stderr().write_all(&line).ok();
            }
        }),
    ),
    (
        "floods_standard_error_without_end",
        Instead(|_| {
            loop {
                std::io::stderr().write_all(&[b'e'; 1 << 16]).ok();
            }
        }),
    ),
    ("takes_much_memory", Does(|hostile| hostile.memory = vec![1; 200 << 20])),
];

fn main() {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let words: Vec<&str> = arguments.iter().map(String::as_str).collect();
    match words[..] {
        ["--list"] => {
            for (name, _) in MODES {
                println!("{name}");
            }
        }
        ["child", kind] => live(kind),
        _ => Hostile::default().run(),
    }
}

/// A simulator.
#[derive(Default)]
struct Hostile {
    acted: bool,
    step: u32,
    pause: Duration,
    /// It has given an answer too many, so that each of its answers comes a request too early.
    ahead: bool,
    /// An answer that it says together with the next one. The runner looks only for a moment for what comes after the
    /// last answer of a run; so that no test depends on how long that is, it is there already.
    unsaid: Vec<u8>,
    at_the_end: Option<fn(&mut Hostile)>,
    at_reset: Option<fn(&mut Hostile)>,
    after_input: Option<fn()>,
    held: Option<fs::File>,
    /// What it closed in its test: which test comes next in this process depends on how busy the machine is, and that
    /// test says something there.
    standard_error: Option<OwnedFd>,
    memory: Vec<u8>,
}

impl Hostile {
    fn run(&mut self) {
        while let Some(told) = order() {
            if told.starts_with("{\"reset\"") {
                let at_reset = self.at_reset.take();
                (self.acted, self.step, self.pause, self.at_the_end) = (false, 0, Duration::ZERO, None);
                self.ahead = false;
                self.unsaid.clear();
                if let Some(kept) = self.standard_error.take() {
                    rustix::stdio::dup2_stderr(kept).ok();
                }
                match at_reset {
                    Some(act) => act(self),
                    None => say(READY.as_bytes()),
                }
                continue;
            }
            self.step += 1;
            let publish = br#"{"publish":[{"topic":"control","value":-1}]}"#;
            say(&[&std::mem::take(&mut self.unsaid)[..], publish].concat());
            let Some(deliver) = order() else { break };
            sleep(self.pause);
            // A message that it published itself is not the number of a mode.
            let mode = deliver.split("\"value\":").nth(1).and_then(|rest| rest.split(['.', '}']).next()?.parse().ok());
            let asked = mode.filter(|_: &usize| !self.acted).map(|mode| {
                self.acted = true;
                &MODES[mode].1
            });
            match asked {
                Some(Says(bytes)) => say(bytes),
                Some(Makes(make)) => say(&make()),
                Some(Instead(act)) => act(self),
                Some(Does(act)) => {
                    act(self);
                    say(DONE.as_bytes());
                }
                None => match self.at_the_end.filter(|_| self.step == STEPS) {
                    Some(act) => act(self),
                    None if self.ahead && self.step == STEPS - 1 => self.unsaid = format!("{DONE}\n").into_bytes(),
                    None => say(DONE.as_bytes()),
                },
            }
        }
        if let Some(act) = self.after_input {
            act();
        }
    }
}

/// What the runner says next; `None` when it says nothing more.
fn order() -> Option<String> {
    let mut line = String::new();
    std::io::stdin().lock().read_line(&mut line).ok().filter(|&length| length > 0)?;
    Some(line)
}

/// Says a line; all of it in one piece.
fn say(line: &[u8]) {
    write(&[line, b"\n"].concat());
}

fn write(bytes: &[u8]) {
    let mut output = std::io::stdout().lock();
    if output.write_all(bytes).and_then(|()| output.flush()).is_err() {
        exit(0);
    }
}

/// The life of a child.
fn live(kind: &str) {
    match kind {
        "gone" => {}
        "setsid" => {
            rustix::process::setsid().ok();
            sleep(LIFE);
        }
        "daemon" => {
            rustix::process::setsid().ok();
            child("setsid", false).spawn().ok();
        }
        // For longer than any test waits.
        "hare" => {
            rustix::process::setsid().ok();
            sleep(Duration::from_millis(20));
            let left = std::env::var("HARE").ok().and_then(|left| left.parse().ok()).unwrap_or(12_000u32);
            if left > 0 {
                child("hare", false).env("HARE", (left - 1).to_string()).spawn().ok();
            }
        }
        _ => sleep(LIFE),
    }
}

/// A child of this kind; it may hold our output.
fn child(kind: &str, holds_output: bool) -> Command {
    let mut child = Command::new(std::env::current_exe().unwrap_or_default());
    child.arg0(format!("hostile-{kind}")).args(["child", kind]).stdin(Stdio::null());
    if !holds_output {
        child.stdout(Stdio::null()).stderr(Stdio::null());
    }
    child
}

fn null() -> fs::File {
    fs::File::options().read(true).write(true).open("/dev/null").expect("it is there on all systems")
}

fn signal(process: u32, signal: Signal) {
    if let Some(process) = Pid::from_raw(process.cast_signed()) {
        kill_process(process, signal).ok();
    }
}

/// The process above the keeper.
fn worker() -> u32 {
    parent(parent(std::process::id()))
}

fn parent(process: u32) -> u32 {
    let status = fs::read_to_string(format!("/proc/{process}/status")).unwrap_or_default();
    let line = status.lines().find_map(|line| line.strip_prefix("PPid:"));
    // No process has this number; it is not to be one that is ended.
    line.and_then(|id| id.trim().parse().ok()).filter(|&id| id > 1).unwrap_or(u32::MAX >> 1)
}

fn done(message: &str) -> Vec<u8> {
    format!("{{\"done\":{{\"messages\":[{message}]}}}}").into_bytes()
}

fn number(value: &str) -> Vec<u8> {
    done(&format!("{{\"topic\":\"number\",\"value\":{value}}}"))
}

fn whole(value: &str) -> Vec<u8> {
    done(&format!("{{\"topic\":\"whole\",\"value\":{value}}}"))
}

fn note(text: &str) -> Vec<u8> {
    done(&format!("{{\"topic\":\"note\",\"value\":\"{text}\"}}"))
}

fn nested(depth: usize) -> String {
    format!("{}{}", "[".repeat(depth), "]".repeat(depth))
}

fn quoted(before: &str, length: usize, after: &str) -> Vec<u8> {
    format!("{before}{}{after}", "x".repeat(length)).into_bytes()
}
