//! The Python packages SciPy, statsmodels and dtaidistance, whose statistics ours are compared with.

use serde::{Deserialize, Serialize};

use crate::python::asked;

/// The variable that names a Python with SciPy, statsmodels and dtaidistance; `./test --long` makes one and sets it.
pub const PYTHON: &str = "SESAME_GAP_PYTHON";

/// What is asked.
#[derive(Debug, Clone, Serialize)]
#[serde(rename_all = "snake_case", tag = "ask")]
pub enum Question {
    /// Two samples of two values or more each, with spread.
    Samples {
        /// The simulation's.
        simulation: Vec<f64>,
        /// The lab's.
        lab: Vec<f64>,
        /// The tolerance.
        tolerance: f64,
        /// The level of the equivalence test.
        alpha: f64,
    },
    /// BCa and percentile intervals of the difference of means, by ten thousand resamples.
    Bootstrap {
        /// The simulation's.
        simulation: Vec<f64>,
        /// The lab's.
        lab: Vec<f64>,
    },
    /// The probability that an equivalence test shows that two equal means are equal.
    Power {
        /// Standard deviations of simulation and lab.
        deviations: [f64; 2],
        /// Runs of simulation and lab.
        runs: [usize; 2],
        /// The tolerance.
        tolerance: f64,
        /// The level.
        alpha: f64,
    },
    /// P values to be adjusted after Holm.
    Holm {
        /// The p values.
        p: Vec<f64>,
    },
    /// Two counts of trials, each with those that were seen.
    Shares {
        /// Seen, and all.
        a: [usize; 2],
        /// Seen, and all.
        b: [usize; 2],
    },
    /// Two series and a band for the DTW distance.
    Warping {
        /// The one.
        a: Vec<f64>,
        /// The other.
        b: Vec<f64>,
        /// How many places apart values may be paired.
        band: usize,
    },
    /// Differences with standard errors, for Cochran's Q.
    Pooled {
        /// The differences.
        differences: Vec<f64>,
        /// Their standard errors.
        errors: Vec<f64>,
    },
    /// Samples, for Welch's F over their means.
    Means {
        /// Three or more samples.
        samples: Vec<Vec<f64>>,
    },
}

/// The numbers in an answer, in the order that the script says.
#[derive(Debug, Clone, Deserialize)]
pub struct Answer(pub Vec<f64>);

/// The answers to questions, in their order; `None` where nobody named a Python that has the packages. One that is
/// named has to work.
pub fn ask(questions: &[Question]) -> Option<Vec<Answer>> {
    let mut lines = Vec::new();
    for question in questions {
        serde_json::to_writer(&mut lines, question).expect("a question is data");
        lines.push(b'\n');
    }
    let said = asked(PYTHON, "gap.py", lines)?;
    let answers: Vec<Answer> =
        said.lines().map(|line| serde_json::from_str(line).expect("an answer is numbers")).collect();
    assert_eq!(answers.len(), questions.len(), "every question has an answer");
    Some(answers)
}
