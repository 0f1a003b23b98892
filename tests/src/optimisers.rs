//! The Python packages pygmo and pymoo, whose NSGA-II ours is compared with.

use std::io::Write as _;
use std::process::{Command, Stdio};

use serde::{Deserialize, Serialize};

use crate::workspace;

/// The variable that names a Python with pygmo and pymoo; `./test --long` makes one and sets it.
pub const PYTHON: &str = "SESAME_OPTIMISERS_PYTHON";

/// One run of NSGA-II on a published problem, with crossover 0.9 of index 15 and mutation of one variable on average
/// with index 20.
#[derive(Debug, Clone, Serialize)]
pub struct Run {
    /// `pygmo` or `pymoo`.
    pub library: &'static str,
    /// The problem's name in small letters.
    pub problem: &'static str,
    /// Members of the population.
    pub population: u32,
    /// Evaluations in total.
    pub evaluations: u32,
    /// Seed.
    pub seed: u64,
}

/// What a library made of a run.
#[derive(Debug, Clone, Deserialize)]
pub struct Ran {
    /// Wall time, without starting Python.
    pub seconds: f64,
    /// The objectives of the final population.
    pub front: Vec<Vec<f64>>,
}

/// Points to be sorted.
#[derive(Debug, Clone, Serialize)]
pub struct Sort {
    /// Objective values, smaller being better; finite.
    pub points: Vec<Vec<f64>>,
}

/// What pymoo made of points.
#[derive(Debug, Clone, Deserialize)]
pub struct Sorted {
    /// Positions of the points by front, ascending.
    pub fronts: Vec<Vec<usize>>,
    /// Their crowding distances: the mean over objectives, -1 for an infinite one.
    pub crowding: Vec<Vec<f64>>,
}

/// The answers to requests, in their order; `None` where nobody named a Python that has the packages. One that is named
/// has to work.
pub fn ask<Request: Serialize, Answer: for<'a> Deserialize<'a>>(requests: &[Request]) -> Option<Vec<Answer>> {
    let python = std::env::var_os(PYTHON)?;
    let mut child = Command::new(&python)
        .arg(workspace().join("tests/suite/optimisers.py"))
        .stdin(Stdio::piped())
        .stdout(Stdio::piped())
        .spawn()
        .unwrap_or_else(|error| panic!("{PYTHON} names {}, which does not start: {error}", python.display()));
    let mut asked = Vec::new();
    for request in requests {
        serde_json::to_writer(&mut asked, request).expect("a request is data");
        asked.push(b'\n');
    }
    let mut input = child.stdin.take().expect("it is piped");
    let asking = std::thread::spawn(move || input.write_all(&asked));
    let output = child.wait_with_output().expect("a process that started ends");
    assert!(output.status.success(), "pygmo or pymoo failed; make them anew with `./test --long`");
    asking.join().expect("writing does not panic").expect("all requests are read");
    let said = String::from_utf8(output.stdout).expect("Python prints JSON");
    let answers: Vec<Answer> =
        said.lines().map(|line| serde_json::from_str(line).expect("an answer is JSON of its kind")).collect();
    assert_eq!(answers.len(), requests.len(), "every request has an answer");
    Some(answers)
}
