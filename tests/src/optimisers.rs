//! The Python packages pygmo and pymoo, whose NSGA-II ours is compared with.

use serde::{Deserialize, Serialize};

use sesame_optimise::problems::approximate_dtlz2;

use crate::python::asked;

/// The variable that names a Python with pygmo and pymoo; `./test --long` makes one and sets it.
pub const PYTHON: &str = "SESAME_OPTIMISERS_PYTHON";

/// One run of NSGA-II, or NSGA-III, on a published problem, with crossover 0.9 of index 15 and mutation of one variable
/// on average with index 20.
#[derive(Debug, Clone, Serialize)]
pub struct Run {
    /// `pygmo` or `pymoo`, whose NSGA-II it is, or `pymoo nsga3`.
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

/// DTLZ2 with many objectives, as NSGA-III solves it in the suite and in the benchmarks.
#[derive(Debug, Clone, Copy)]
pub struct ManyObjectives {
    /// The problem's name in a [`Run`].
    pub problem: &'static str,
    /// How many objectives.
    pub objectives: usize,
    /// As many members as there are reference points, rounded up to an even number.
    pub population: u32,
    /// Evaluations in total.
    pub evaluations: u32,
}

impl ManyObjectives {
    /// With three and with five objectives.
    pub const ALL: [ManyObjectives; 2] = [
        ManyObjectives { problem: "dtlz2_3", objectives: 3, population: 92, evaluations: 23_000 },
        ManyObjectives { problem: "dtlz2_5", objectives: 5, population: 212, evaluations: 42_400 },
    ];

    /// The final population of Sesame's NSGA-III.
    pub fn approximated(self, seed: u64) -> Vec<Vec<f64>> {
        approximate_dtlz2(self.objectives, self.population, self.evaluations, seed)
    }

    /// The request that pymoo's NSGA-III does the same.
    pub fn request(self, seed: u64) -> Run {
        let ManyObjectives { problem, population, evaluations, .. } = self;
        Run { library: "pymoo nsga3", problem, population, evaluations, seed }
    }
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

/// Points whose distance to a front is asked for.
#[derive(Debug, Clone, Serialize)]
pub struct Distance {
    /// The front, smaller being better; finite.
    pub front: Vec<Vec<f64>>,
    /// The points.
    pub points: Vec<Vec<f64>>,
}

/// What pymoo made of a distance.
#[derive(Debug, Clone, Copy, Deserialize)]
pub struct Distant {
    /// IGD of the points.
    pub igd: f64,
    /// IGD⁺ of the points.
    pub igd_plus: f64,
    /// IGD with the objectives scaled so that those of the front lie from 0 to 1.
    pub igd_scaled: f64,
    /// IGD⁺ with the objectives scaled in the same way.
    pub igd_plus_scaled: f64,
}

/// The answers to requests, in their order; `None` where nobody named a Python that has the packages. One that is named
/// has to work.
pub fn ask<Request: Serialize, Answer: for<'a> Deserialize<'a>>(requests: &[Request]) -> Option<Vec<Answer>> {
    let mut lines = Vec::new();
    for request in requests {
        serde_json::to_writer(&mut lines, request).expect("a request is data");
        lines.push(b'\n');
    }
    let said = asked(PYTHON, "optimisers.py", lines)?;
    let answers: Vec<Answer> =
        said.lines().map(|line| serde_json::from_str(line).expect("an answer is JSON of its kind")).collect();
    assert_eq!(answers.len(), requests.len(), "every request has an answer");
    Some(answers)
}
