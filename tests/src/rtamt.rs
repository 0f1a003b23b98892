//! The Python package rtamt, whose robustness of signal temporal logic ours is compared with.

use std::fmt::Write as _;

use crate::python::asked;

/// The variable that names a Python with rtamt; `./test --long` makes one and sets it.
pub const PYTHON: &str = "SESAME_RTAMT_PYTHON";

/// A formula in rtamt's words, over two signals sampled once per second from 0 s on.
#[derive(Debug, Clone)]
pub struct Case {
    /// The formula; its signals are called `x` and `y`.
    pub formula: String,
    /// Samples of `x`, finite.
    pub x: Vec<f64>,
    /// Samples of `y`, as many.
    pub y: Vec<f64>,
}

/// What rtamt makes of a case.
#[derive(Debug, Clone, Copy)]
pub struct Answer {
    /// The robustness at 0 s.
    pub robustness: f64,
    /// How long that took, in seconds of wall time, without parsing.
    pub seconds: f64,
}

/// What rtamt makes of these cases, by its offline monitor for discrete time; `None` where nobody named a Python that
/// has it. One that is named has to work.
pub fn answers(cases: &[Case]) -> Option<Vec<Answer>> {
    let mut lines = String::new();
    for Case { formula, x, y } in cases {
        // Both print finite numbers so that reading gives the very same ones.
        writeln!(lines, "{{\"formula\": {formula:?}, \"x\": {x:?}, \"y\": {y:?}}}").expect("a String takes all text");
    }
    let said = asked(PYTHON, "robustness.py", lines.into_bytes())?;
    let number = |word: Option<&str>| word.and_then(|word| word.parse().ok()).expect("an answer has two numbers");
    let answers: Vec<Answer> = said
        .lines()
        .map(|line| {
            let mut words = line.split(' ');
            Answer { robustness: number(words.next()), seconds: number(words.next()) }
        })
        .collect();
    assert_eq!(answers.len(), cases.len(), "every case has an answer");
    Some(answers)
}
