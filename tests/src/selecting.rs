//! Choices of tests for a laboratory with fixed seeds, for benchmarks, and Python's solvers on the same ones: CP-SAT of
//! `ortools`, and outer approximation over `HiGHS`, by `tests/suite/selecting.py`.

use serde::{Deserialize, Serialize};

use sesame_rng::Stream;
use sesame_select::ranking::{Better, Key, Scale, qualities};
use sesame_select::{Pairs, Problem, Test};

use crate::python::asked;

/// The variable that names a Python with ortools and highspy; `./test --long` sets it to one that it makes.
pub const PYTHON: &str = "SESAME_SOLVERS_PYTHON";

/// Where the points of an instance are.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Points {
    /// Anywhere in the unit cube, with any quality.
    Uniform,
    /// Near thirty centres, with qualities near those of their centre: near-duplicates, as fronts have them.
    Clustered,
    /// The tests of a campaign of the gearbox cell: first its front, then the front of the other tests, and so on.
    /// Beyond the recorded tests come others near them, since a longer campaign has more of the same.
    Front,
}

/// A campaign's tests: T1, T2 and P1, and the distance to a safety zone, which is better if it is smaller.
const FRONT: &str = include_str!("../bench/data/kuka_cell_front.csv");

/// How far a test beyond the recorded ones is at most from one of them, on each axis.
const BESIDE: f64 = 0.005;

/// Points and qualities of the recorded tests. A test is ranked among all of them, as `sesamec select` does it.
fn front() -> Vec<(Vec<f64>, f64)> {
    let number = |text: &str| -> f64 { text.parse().expect("the data are numbers") };
    let rows: Vec<Vec<f64>> = FRONT.lines().skip(1).map(|line| line.split(',').map(number).collect()).collect();
    let distances: Vec<f64> = rows.iter().map(|row| row[3]).collect();
    let key = Key { values: &distances, better: Better::Lower };
    let ranked = qualities(&[key], Scale::Average).expect("every test has a distance");
    rows.into_iter().zip(ranked).map(|(row, quality)| (row[..3].to_vec(), quality)).collect()
}

/// A choice to be made.
#[derive(Debug, Clone, Copy)]
pub struct Choice {
    /// How many tests there are.
    pub tests: usize,
    /// About how many are affordable.
    pub budget: u32,
    /// The weight of diversity.
    pub lambda: f64,
    /// Where the points are.
    pub points: Points,
    /// Whether costs are whole numbers from 1 to 9; otherwise each test costs 1.
    pub uneven: bool,
    /// Seed.
    pub seed: u64,
}

impl Choice {
    /// The choice as a problem in three dimensions.
    pub fn problem(self) -> Problem {
        let mut stream = Stream::derive(self.seed, "choice of tests", &[self.tests as u64]);
        let centres: Vec<[f64; 4]> = (0..30).map(|_| std::array::from_fn(|_| stream.unit())).collect();
        let recorded = if self.points == Points::Front { front() } else { Vec::new() };
        let test = |at: usize| {
            let (point, quality) = match self.points {
                Points::Uniform => ((0..3).map(|_| stream.unit()).collect(), stream.unit()),
                Points::Clustered => {
                    let centre = centres[stream.below(centres.len())];
                    let point = centre[..3].iter().map(|x| (x + 0.01 * stream.normal()).clamp(0.0, 1.0)).collect();
                    (point, (centre[3] + stream.uniform(-0.05, 0.05)).clamp(0.0, 1.0))
                }
                Points::Front if at < recorded.len() => recorded[at].clone(),
                Points::Front => {
                    let (point, quality) = &recorded[at % recorded.len()];
                    let beside = |x: &f64| (x + stream.uniform(-BESIDE, BESIDE)).clamp(0.0, 1.0);
                    (point.iter().map(beside).collect(), (quality + stream.uniform(-BESIDE, BESIDE)).clamp(0.0, 1.0))
                }
            };
            let cost = if self.uneven { 1.0 + stream.below(9) as f64 } else { 1.0 };
            Test { point, quality, cost, forced: false }
        };
        let tests = (0..self.tests).map(test).collect();
        // The cheapest ones are chosen more often than others.
        let budget = f64::from(self.budget) * if self.uneven { 2.0 } else { 1.0 };
        Problem::new(tests, self.lambda, budget, Pairs::Unordered).expect("it is valid")
    }
}

/// A choice, as Python is asked for it.
#[derive(Debug, Clone, Serialize)]
pub struct Request {
    /// `cp-sat` or `highs`.
    pub solver: &'static str,
    /// The tests' points.
    pub points: Vec<Vec<f64>>,
    /// Their qualities.
    pub qualities: Vec<f64>,
    /// Their costs.
    pub costs: Vec<f64>,
    /// What the costs of those that are chosen add up to at most.
    pub budget: f64,
    /// The weight of diversity.
    pub lambda: f64,
    /// Wall time after which the solver stops.
    pub seconds: f64,
}

impl Request {
    /// The request for a choice.
    pub fn of(choice: Choice, solver: &'static str, seconds: f64) -> Self {
        let problem = choice.problem();
        Request {
            solver,
            points: problem.tests().iter().map(|test| test.point.clone()).collect(),
            qualities: problem.tests().iter().map(|test| test.quality).collect(),
            costs: problem.tests().iter().map(|test| test.cost).collect(),
            budget: problem.budget(),
            lambda: choice.lambda,
            seconds,
        }
    }
}

/// What a solver made of a choice.
#[derive(Debug, Clone, Deserialize)]
pub struct Solved {
    /// Wall time, with the construction of its models.
    pub seconds: f64,
    /// The value of what it chose; 0 if it found nothing.
    pub value: f64,
    /// What it proved that no choice exceeds.
    pub bound: f64,
    /// Whether it says that its choice is the best.
    pub proved: bool,
}

/// The answer to a request, or why there is none; `None` where nobody named a Python that has the packages. One that is
/// named has to work.
pub fn ask(request: &Request) -> Option<Result<Solved, String>> {
    let mut line = serde_json::to_vec(request).expect("a request is data");
    line.push(b'\n');
    let said = asked(PYTHON, "selecting.py", line)?;
    Some(serde_json::from_str(said.trim()).expect("an answer is JSON of its kind"))
}
