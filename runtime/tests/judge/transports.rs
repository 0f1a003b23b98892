//! A run says the same wherever its simulator is: a type inside the runner, or a program of its own that is served over
//! the protocol of processes.
//!
//! The cases are those of the judge. This program is the runner and the simulator: it starts itself as the keeper of
//! its simulator and as the simulator, so it has no test harness.
#![cfg_attr(
    target_os = "linux",
    expect(
        dead_code,
        clippy::cast_possible_truncation,
        clippy::cast_sign_loss,
        clippy::disallowed_methods,
        clippy::unwrap_used,
        reason = "cases are made as the judge makes them, and the judge uses the rest; it starts itself"
    )
)]

#[cfg(target_os = "linux")]
mod adapter;
#[cfg(target_os = "linux")]
mod case;
#[cfg(target_os = "linux")]
mod hooks;
#[cfg(target_os = "linux")]
mod ledger;
#[cfg(target_os = "linux")]
mod robot;
#[cfg(target_os = "linux")]
mod words;

#[cfg(target_os = "linux")]
mod runner {
    use std::ffi::OsString;
    use std::path::Path;
    use std::process::ExitCode;
    use std::{env, io};

    use sesame_runtime::plan::Transport;
    use sesame_runtime::simulator::{Simulator as _, serve};
    use sesame_runtime::transport::{become_simulator, in_process, keep_simulator, process};

    use crate::adapter::{self, STEP, said};
    use crate::case::{Added, Case};
    use crate::ledger::Message;
    use crate::robot::{Robot, set_script};
    use crate::words;

    /// The word with which this program is started as a simulator.
    const SIMULATOR: &str = "be-the-robot";

    const TEST: &str = "a_run_says_the_same_inside_the_runner_and_in_a_program_of_its_own";
    const LONG_TEST: &str = "a_run_says_the_same_inside_the_runner_and_in_a_program_of_its_own_in_many_cases";

    pub(super) fn main() -> ExitCode {
        let words: Vec<String> = env::args().skip(1).collect();
        let has = |word: &str| words.iter().any(|other| other == word);
        if has("--list") {
            println!("{}: test", if has("--ignored") { LONG_TEST } else { TEST });
            if !has("--ignored") {
                println!("{LONG_TEST}: test");
            }
            return ExitCode::SUCCESS;
        }
        match words.first().map(String::as_str) {
            Some(SIMULATOR) => return simulate(),
            Some(role @ ("simulator" | "simulated")) => return keep(role, &words),
            _ => {}
        }
        let named = |name: &str| words.iter().all(|word| word.starts_with('-') || name == word || !has("--exact"));
        if has("--ignored") && named(LONG_TEST) {
            println!("test {LONG_TEST}");
            all_hold(2_000..102_000);
        } else if !has("--ignored") && named(TEST) {
            println!("test {TEST}");
            all_hold(0..60);
        }
        ExitCode::SUCCESS
    }

    /// What a runner is started as by itself: the keeper of a simulator, or what becomes the simulator.
    fn keep(role: &str, words: &[String]) -> ExitCode {
        let split = words.iter().position(|word| word == "--").expect("a runner says what it starts");
        let background = words[..split].iter().any(|word| word == "--background");
        let parent = words[1].parse().expect("a runner says who it is");
        let words_of_program: Vec<OsString> = words[split + 1..].iter().map(OsString::from).collect();
        let (program, arguments) = words_of_program.split_first().expect("a runner says what it starts");
        if role == "simulator" {
            keep_simulator(parent, Path::new(&words[2]), program, arguments, background)
        } else {
            become_simulator(parent, program, arguments, background)
        }
    }

    /// The case that a test is about: every other one has monitors.
    fn case_of(number: u64) -> Case {
        let case = Case::of(number);
        if number.is_multiple_of(2) { case } else { case.with_unread(Added::All).case }
    }

    /// Serves the robot of the case whose number is the seed.
    fn simulate() -> ExitCode {
        let served = serve(io::stdin().lock(), io::stdout().lock(), |setup, bus| {
            set_script(case_of(setup.seed).script);
            Robot::start(setup, bus)
        });
        if served.is_ok() { ExitCode::SUCCESS } else { ExitCode::FAILURE }
    }

    fn all_hold(numbers: std::ops::Range<u64>) {
        let only = env::var("JUDGE_CASE").ok().and_then(|number| number.parse().ok());
        let numbers = only.map_or(numbers, |number: u64| number..number + 1);
        for number in numbers {
            let case = case_of(number);
            // A program sends the messages of time zero with the words that it is ready. If it fails before, nobody
            // has heard them.
            if matches!(case.script.crash, Some((0, _))) {
                continue;
            }
            let wrong = differences(&case);
            assert!(wrong.is_empty(), "case {number}:\n{}\n\n{}", wrong.join("\n"), words::case(&case));
        }
    }

    fn differences(case: &Case) -> Vec<String> {
        let mut served = case.plan.clone();
        let program = env::current_exe().expect("this program has a path").display().to_string();
        let step_ns = Some(STEP.unsigned_abs());
        served.simulator.transport = Transport::Process { program, arguments: vec![SIMULATOR.to_owned()], step_ns };
        let seed = case.number;
        let within = in_process::<Robot>().transport(&case.plan);
        let (before, told) = adapter::run_over(within, &case.plan, &case.test, seed, &case.script);
        let beside = process(env::temp_dir()).transport(&served);
        let (now, told_now) = adapter::run_over(beside, &served, &case.test, seed, &case.script);
        let mut wrong = Vec::new();
        if before.outcome.word() != now.outcome.word() || before.end != now.end {
            wrong.push(format!("it ended with {:?}, as a program with {:?}", before.outcome, now.outcome));
        }
        if before.operations != now.operations {
            wrong.push(format!("operations: {:?}, as a program {:?}", before.operations, now.operations));
        }
        if before.metrics != now.metrics {
            wrong.push(format!("metrics: {:?}, as a program {:?}", before.metrics, now.metrics));
        }
        if before.monitors != now.monitors {
            wrong.push(format!("monitors: {:?}, as a program {:?}", before.monitors, now.monitors));
        }
        for requirement in &case.plan.requirements {
            let (before, now) = (said(requirement, &before), said(requirement, &now));
            if before != now {
                wrong.push(format!("{}: {before:?}, as a program {now:?}", requirement.name));
            }
        }
        let alike = |a: &[Message], b: &[Message]| a.len() == b.len() && a.iter().zip(b).all(|(a, b)| a.is(b));
        if !alike(&told.published, &told_now.published) {
            wrong.push("what is published".to_owned());
        }
        if !alike(&told.delivered, &told_now.delivered) {
            wrong.push("what is delivered".to_owned());
        }
        wrong
    }
}

#[cfg(target_os = "linux")]
fn main() -> std::process::ExitCode {
    runner::main()
}

#[cfg(not(target_os = "linux"))]
fn main() {}
