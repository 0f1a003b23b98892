//! What is chosen from, under which budget, and what a choice is worth.

use std::fmt;

/// A cost may exceed the budget by this share, which is what sums of decimal fractions need.
const ROUNDING: f64 = 1e-9;

/// A test that the laboratory could perform.
#[derive(Debug, Clone, PartialEq)]
pub struct Test {
    /// Where it is in the reduced space of tests; finite. Distances are Euclidean, so the caller normalises the
    /// dimensions.
    pub point: Vec<f64>,
    /// The metric ranking `MR`, from 0 (worst) to 1 (best).
    pub quality: f64,
    /// What the test costs, in the unit of the budget; at least 0. A test that costs more than the budget is never
    /// chosen.
    pub cost: f64,
    /// Every choice contains the test. A test that was performed already is forced with cost 0, if the budget is what
    /// is left of it.
    pub forced: bool,
}

/// How often a pair of tests counts in the sum of distances.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Pairs {
    /// Once.
    Unordered,
    /// Twice, as the paper's Table 4 has it.
    Ordered,
}

/// Tests, a budget, and the weight of diversity.
#[derive(Debug, Clone, PartialEq)]
pub struct Problem {
    tests: Vec<Test>,
    lambda: f64,
    budget: f64,
    pairs: Pairs,
}

/// Why something is not a problem to be solved. Tests are named by their positions.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Invalid {
    /// λ is not in 0..=1.
    Lambda(f64),
    /// The budget is negative or not finite.
    Budget(f64),
    /// The test's cost is negative or not finite.
    Cost(usize, f64),
    /// The test's quality is not in 0..=1.
    Quality(usize, f64),
    /// A coordinate of the test's point is not finite.
    Coordinate(usize, f64),
    /// The test's point has another number of dimensions than the first one's, or none.
    Dimensions(usize, usize),
    /// The points are so far apart that their distances are not finite.
    Spread,
    /// The forced tests cost more than the budget.
    Forced(f64, f64),
}

impl fmt::Display for Invalid {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match *self {
            Invalid::Lambda(lambda) => write!(f, "λ is {lambda}, which is not in 0 to 1"),
            Invalid::Budget(budget) => write!(f, "the budget is {budget}, which is not a finite number from 0"),
            Invalid::Cost(test, cost) => write!(f, "test {test} costs {cost}, which is not a finite number from 0"),
            Invalid::Quality(test, quality) => write!(f, "test {test} has quality {quality}, which is not in 0 to 1"),
            Invalid::Coordinate(test, x) => write!(f, "test {test} has a coordinate {x}, which is not finite"),
            Invalid::Dimensions(test, 0) => write!(f, "test {test} has a point without dimensions"),
            Invalid::Dimensions(test, dimensions) => {
                write!(f, "test {test} has a point of {dimensions} dimensions, and the first test has others")
            }
            Invalid::Spread => write!(f, "the points are too far apart: their distances are not finite"),
            Invalid::Forced(cost, budget) => {
                write!(f, "the forced tests cost {cost}, which is more than the budget of {budget}")
            }
        }
    }
}

impl std::error::Error for Invalid {}

impl Problem {
    /// A problem, if it is one. `lambda` is the weight of diversity, from 0 (quality alone) to 1 (distances alone).
    pub fn new(tests: Vec<Test>, lambda: f64, budget: f64, pairs: Pairs) -> Result<Self, Invalid> {
        let dimensions = tests.first().map_or(0, |test| test.point.len());
        for (at, test) in tests.iter().enumerate() {
            if test.point.is_empty() || test.point.len() != dimensions {
                return Err(Invalid::Dimensions(at, test.point.len()));
            }
            if let Some(&x) = test.point.iter().find(|x| !x.is_finite()) {
                return Err(Invalid::Coordinate(at, x));
            }
            if !(0.0..=1.0).contains(&test.quality) {
                return Err(Invalid::Quality(at, test.quality));
            }
            if !(test.cost.is_finite() && test.cost >= 0.0) {
                return Err(Invalid::Cost(at, test.cost));
            }
        }
        let problem = Problem { tests, lambda: 0.0, budget: f64::MAX, pairs };
        let count = problem.tests.len() as f64;
        if !(problem.diameter() * count * count * 4.0).is_finite() {
            return Err(Invalid::Spread);
        }
        problem.with_lambda(lambda)?.with_budget(budget)
    }

    /// The same problem with another weight of diversity.
    pub fn with_lambda(mut self, lambda: f64) -> Result<Self, Invalid> {
        if !(0.0..=1.0).contains(&lambda) {
            return Err(Invalid::Lambda(lambda));
        }
        self.lambda = lambda;
        Ok(self)
    }

    /// The same problem with another budget.
    pub fn with_budget(mut self, budget: f64) -> Result<Self, Invalid> {
        if !(budget.is_finite() && budget >= 0.0) {
            return Err(Invalid::Budget(budget));
        }
        self.budget = budget;
        let forced = self.tests.iter().filter(|test| test.forced).map(|test| test.cost).sum();
        if forced > self.limit() {
            return Err(Invalid::Forced(forced, budget));
        }
        Ok(self)
    }

    /// What is chosen from. Positions in this list are the numbers of the tests.
    pub fn tests(&self) -> &[Test] {
        &self.tests
    }

    /// The weight of diversity.
    pub fn lambda(&self) -> f64 {
        self.lambda
    }

    /// What a choice may cost.
    pub fn budget(&self) -> f64 {
        self.budget
    }

    /// What costs are compared with: the budget with room for rounding.
    pub(crate) fn limit(&self) -> f64 {
        self.budget * (1.0 + ROUNDING)
    }

    /// What a choice costs.
    pub fn cost(&self, chosen: &[usize]) -> f64 {
        chosen.iter().map(|&at| self.tests[at].cost).sum()
    }

    /// `Value` of [SESAME 2023, Algorithm 1]: `(1 − λ)(|PC| − 1) Σ MR + 2 λ Σ D / √dimensions`. The number says nothing
    /// about a single test, whose value is 0.
    pub fn value(&self, chosen: &[usize]) -> f64 {
        let (quality, distance) = self.parts(chosen);
        (1.0 - self.lambda) * quality + self.lambda * distance
    }

    /// What λ weighs: `(|PC| − 1) Σ MR` and `2 Σ D / √dimensions`.
    pub(crate) fn parts(&self, chosen: &[usize]) -> (f64, f64) {
        let quality: f64 = chosen.iter().map(|&at| self.tests[at].quality).sum();
        let mut distance = 0.0;
        for (at, &one) in chosen.iter().enumerate() {
            for &other in &chosen[at + 1..] {
                distance += apart(&self.tests[one].point, &self.tests[other].point);
            }
        }
        (chosen.len().saturating_sub(1) as f64 * quality, self.per_distance() * distance)
    }

    /// What a distance between two tests counts at λ = 1.
    fn per_distance(&self) -> f64 {
        let counted = match self.pairs {
            Pairs::Unordered => 2.0,
            Pairs::Ordered => 4.0,
        };
        let dimensions = self.tests.first().map_or(1, |test| test.point.len());
        counted / (dimensions as f64).sqrt()
    }

    /// What a distance between two tests adds to the value.
    pub(crate) fn distance_weight(&self) -> f64 {
        self.lambda * self.per_distance()
    }

    /// No two tests are farther apart: the diagonal of the box that contains all points.
    pub(crate) fn diameter(&self) -> f64 {
        let dimensions = self.tests.first().map_or(0, |test| test.point.len());
        let side = |axis: usize| {
            let along = || self.tests.iter().map(|test| test.point[axis]);
            along().fold(f64::NEG_INFINITY, f64::max) - along().fold(f64::INFINITY, f64::min)
        };
        (0..dimensions).map(side).map(|side| side * side).sum::<f64>().sqrt()
    }
}

/// The Euclidean distance [SESAME 2023, Equation 1].
fn apart(one: &[f64], other: &[f64]) -> f64 {
    one.iter().zip(other).map(|(a, b)| (a - b) * (a - b)).sum::<f64>().sqrt()
}
