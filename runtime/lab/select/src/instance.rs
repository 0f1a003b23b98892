//! The problem for one number of tests: maximise `linear·x + ½ x'Ax` over 0-1 vectors with `Σ x = size` and
//! `cost·x ≤ limit`, where `A` holds the weighted distances.
//!
//! `A` is conditionally negative semidefinite, so the objective is concave on vectors of one sum [Spiers et al. 2023].
//! Its diagonal may be anything, if the linear part makes up for it: `x² = x`. A great diagonal makes the objective
//! smaller between the 0-1 vectors, and so the bounds better; [`crate::diagonal`] chooses it.
//!
//! Rows of `A` are computed when they are needed and kept while there is room: ten thousand tests would fill 800 MB.

use std::collections::VecDeque;

use crate::problem::Problem;

/// Numbers that kept rows may hold together: 64 MB.
const ROOM: usize = 8_000_000;

/// Tests are near to each other if their distance is at most this share of the greatest one.
const NEAR: f64 = 0.06;

/// A problem of one size, over some of the tests.
#[derive(Debug, Clone)]
pub(crate) struct Instance {
    /// How many tests are chosen.
    pub(crate) size: usize,
    /// What they may cost.
    pub(crate) limit: f64,
    /// The tests' positions in the problem, ascending.
    pub(crate) names: Vec<usize>,
    /// What each test adds by itself, without the correction for the diagonal.
    own: Vec<f64>,
    pub(crate) cost: Vec<f64>,
    pub(crate) forced: Vec<bool>,
    /// Whether costs differ from test to test, so that the limit is more than a number of tests.
    pub(crate) uneven: bool,
    /// Tests that are near to each other have one number, from 0 to below [`Instance::groups`].
    pub(crate) group: Vec<usize>,
    pub(crate) groups: usize,
    axes: Vec<Vec<f64>>,
    weight: f64,
    diagonal: Vec<f64>,
    rows: Vec<Vec<f64>>,
    kept: VecDeque<usize>,
}

impl Instance {
    pub(crate) fn new(problem: &Problem, names: Vec<usize>, size: usize) -> Self {
        let tests = problem.tests();
        let of = |at: &usize| &tests[*at];
        let each = (1.0 - problem.lambda()) * (size as f64 - 1.0);
        let dimensions = tests.first().map_or(0, |test| test.point.len());
        let cost: Vec<f64> = names.iter().map(|at| of(at).cost).collect();
        Instance {
            size,
            limit: problem.limit(),
            own: names.iter().map(|at| each * of(at).quality).collect(),
            forced: names.iter().map(|at| of(at).forced).collect(),
            uneven: costliest(&cost, size) > problem.limit(),
            cost,
            axes: (0..dimensions).map(|axis| names.iter().map(|at| of(at).point[axis]).collect()).collect(),
            group: vec![0; names.len()],
            groups: 1,
            weight: problem.distance_weight(),
            diagonal: vec![0.0; names.len()],
            rows: vec![Vec::new(); names.len()],
            kept: VecDeque::new(),
            names,
        }
    }

    /// How many tests there are.
    pub(crate) fn len(&self) -> usize {
        self.names.len()
    }

    /// The same problem over these of its tests, ascending positions. The diagonal is left out.
    pub(crate) fn among(&self, these: &[usize]) -> Self {
        let pick = |values: &[f64]| -> Vec<f64> { these.iter().map(|&at| values[at]).collect() };
        let cost = pick(&self.cost);
        Instance {
            size: self.size,
            limit: self.limit,
            names: these.iter().map(|&at| self.names[at]).collect(),
            own: pick(&self.own),
            forced: these.iter().map(|&at| self.forced[at]).collect(),
            uneven: costliest(&cost, self.size) > self.limit,
            cost,
            axes: self.axes.iter().map(|axis| pick(axis)).collect(),
            group: these.iter().map(|&at| self.group[at]).collect(),
            groups: self.groups,
            weight: self.weight,
            diagonal: vec![0.0; these.len()],
            rows: vec![Vec::new(); these.len()],
            kept: VecDeque::new(),
        }
    }

    /// What a test adds by itself, as the linear part that belongs to the diagonal has it.
    pub(crate) fn linear(&self, at: usize) -> f64 {
        self.own[at] - 0.5 * self.diagonal[at]
    }

    /// What a test adds by itself.
    pub(crate) fn own(&self, at: usize) -> f64 {
        self.own[at]
    }

    pub(crate) fn diagonal(&self, at: usize) -> f64 {
        self.diagonal[at]
    }

    pub(crate) fn set_diagonal(&mut self, diagonal: Vec<f64>) {
        for (at, value) in diagonal.iter().enumerate() {
            if let Some(own) = self.rows[at].get_mut(at) {
                *own = *value;
            }
        }
        self.diagonal = diagonal;
    }

    /// Puts tests that are near to each other into groups: each goes to the first group whose first test is near
    /// enough.
    pub(crate) fn gather(&mut self) {
        let side = |axis: &Vec<f64>| {
            axis.iter().copied().fold(f64::NEG_INFINITY, f64::max) - axis.iter().copied().fold(f64::INFINITY, f64::min)
        };
        let far: f64 = self.axes.iter().map(side).map(|side| side * side).sum();
        let near = NEAR * NEAR * far;
        let mut firsts: Vec<usize> = Vec::new();
        for at in 0..self.len() {
            let square = |first: usize| -> f64 {
                self.axes.iter().map(|axis| axis[at] - axis[first]).map(|side| side * side).sum()
            };
            let group = firsts.iter().position(|&first| square(first) <= near);
            self.group[at] = group.unwrap_or(firsts.len());
            if group.is_none() {
                firsts.push(at);
            }
        }
        self.groups = firsts.len();
    }

    /// A row of `A`.
    pub(crate) fn row(&mut self, at: usize) -> &[f64] {
        if self.rows[at].is_empty() {
            let count = self.len();
            let mut row = if (self.kept.len() + 1) * count > ROOM {
                let oldest = self.kept.pop_front().expect("one row always fits");
                std::mem::take(&mut self.rows[oldest])
            } else {
                vec![0.0; count]
            };
            row.fill(0.0);
            for axis in &self.axes {
                let mine = axis[at];
                for (sum, other) in row.iter_mut().zip(axis) {
                    let side = mine - other;
                    *sum += side * side;
                }
            }
            let weight = self.weight;
            for sum in &mut row {
                *sum = weight * sum.sqrt();
            }
            row[at] = self.diagonal[at];
            self.rows[at] = row;
            self.kept.push_back(at);
        }
        &self.rows[at]
    }

    /// Gives back the memory of all rows.
    pub(crate) fn forget(&mut self) {
        for at in self.kept.drain(..) {
            self.rows[at] = Vec::new();
        }
    }

    /// One entry of `A`.
    pub(crate) fn pair(&self, one: usize, other: usize) -> f64 {
        if one == other {
            return self.diagonal[one];
        }
        if let Some(value) = self.rows[one].get(other).or_else(|| self.rows[other].get(one)) {
            return *value;
        }
        let square: f64 = self.axes.iter().map(|axis| (axis[one] - axis[other]) * (axis[one] - axis[other])).sum();
        self.weight * square.sqrt()
    }

    /// The objective at a 0-1 vector.
    pub(crate) fn value(&self, chosen: &[usize]) -> f64 {
        let mut value = 0.0;
        for (at, &one) in chosen.iter().enumerate() {
            value += self.own[one];
            for &other in &chosen[at + 1..] {
                value += self.pair(one, other);
            }
        }
        value
    }
}

/// What the most expensive tests cost together.
fn costliest(cost: &[f64], count: usize) -> f64 {
    let mut cost = cost.to_vec();
    cost.sort_by(|a, b| b.total_cmp(a));
    cost.iter().take(count).sum()
}
