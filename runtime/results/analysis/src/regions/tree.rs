//! A small decision tree over columns of numbers (CART; Breiman, Friedman, Olshen and Stone 1984).
//!
//! It guarantees: each split is the one of least Gini impurity among all that leave enough rows on both sides, the
//! first in the order of columns and thresholds if several are; a split stays only if it is not a chance effect, by
//! Fisher's exact test at 5 % over all questions that were weighed for it (Bonferroni); the same data give the same
//! tree.

use sesame_gap::proportion::wilson;

/// Columns of numbers, a NaN where a row has none.
#[derive(Debug, Clone, Default)]
pub(super) struct Columns {
    pub(super) values: Vec<Vec<f64>>,
    /// Per column its rows that have a number, in ascending order of it.
    order: Vec<Vec<u32>>,
}

/// What is asked of a row: whether its number in a column is at most a threshold, or above it. Of a row without a
/// number neither holds.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Question {
    pub(super) column: usize,
    pub(super) at_most: bool,
    pub(super) threshold: f64,
}

/// How many rows there are, and how many of them fail.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Tally {
    /// Tests.
    pub tests: usize,
    /// Those that fail.
    pub failing: usize,
}

/// A tree.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct TreeNode {
    pub(super) tally: Tally,
    pub(super) split: Option<Box<Split>>,
}

/// A question with what lies below it.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Split {
    pub(super) question: Question,
    /// Whether rows here have no number in the question's column.
    pub(super) missing: bool,
    /// The questions that were weighed, this one included.
    weighed: u64,
    pub(super) holds: TreeNode,
    pub(super) fails: TreeNode,
}

/// How far a tree grows.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Growth {
    /// Questions above a leaf at most.
    pub(super) depth: u32,
    /// Rows in a leaf at least.
    pub(super) least: usize,
}

impl Tally {
    /// The share that fails, and its 95 % Wilson interval; `None` without a test.
    pub fn share(self) -> Option<(f64, [f64; 2])> {
        let interval = wilson(self.failing, self.tests)?;
        Some((self.failing as f64 / self.tests as f64, interval))
    }

    fn without(self, other: Tally) -> Tally {
        Tally { tests: self.tests - other.tests, failing: self.failing - other.failing }
    }

    fn add(&mut self, fails: bool) {
        self.tests += 1;
        self.failing += usize::from(fails);
    }

    /// Half of the Gini impurity times the number of rows.
    fn impurity(self) -> f64 {
        let (n, k) = (self.tests as f64, self.failing as f64);
        k * (n - k) / n
    }
}

impl Question {
    /// Whether it holds of a number.
    pub(super) fn holds(self, number: f64) -> bool {
        if self.at_most { number <= self.threshold } else { number > self.threshold }
    }
}

impl Columns {
    /// Columns of these values, all equally long.
    pub(super) fn new(values: Vec<Vec<f64>>) -> Columns {
        let order = values.iter().map(|column| {
            let rows = (0u32..).zip(column).filter(|(_, value)| !value.is_nan());
            let mut rows: Vec<u32> = rows.map(|(row, _)| row).collect();
            rows.sort_unstable_by(|&a, &b| column[a as usize].total_cmp(&column[b as usize]).then(a.cmp(&b)));
            rows
        });
        Columns { order: order.collect(), values }
    }

    /// The tree of the rows that have a label: whether they fail.
    pub(super) fn tree(&self, labels: &[Option<bool>], growth: Growth) -> TreeNode {
        let mut node = self.whole_tree(labels, growth);
        prune(&mut node);
        node
    }

    /// The same with splits that tell nothing.
    pub(super) fn whole_tree(&self, labels: &[Option<bool>], growth: Growth) -> TreeNode {
        let fails: Vec<bool> = labels.iter().map(|label| label.unwrap_or(false)).collect();
        let labelled = |row: &u32| labels[*row as usize].is_some();
        let order = self.order.iter().map(|rows| rows.iter().copied().filter(labelled).collect()).collect();
        let mut tally = Tally::default();
        labels.iter().flatten().for_each(|&fails| tally.add(fails));
        let mut side = vec![false; fails.len()];
        self.grow(order, tally, &fails, &mut side, growth)
    }

    fn grow(&self, order: Vec<Vec<u32>>, tally: Tally, fails: &[bool], side: &mut [bool], growth: Growth) -> TreeNode {
        let leaf = TreeNode { tally, split: None };
        if growth.depth == 0 || tally.failing == 0 || tally.failing == tally.tests {
            return leaf;
        }
        let (best, weighed) = self.best(&order, tally, fails, growth.least);
        let Some(question) = best else { return leaf };
        let missing = order[question.column].len() < tally.tests;
        let mut below = Tally::default();
        // Which rows hold is marked by the question's own column; rows without a number there are marked by none.
        for &row in order.iter().flatten() {
            side[row as usize] = false;
        }
        for &row in &order[question.column] {
            let holds = question.holds(self.values[question.column][row as usize]);
            side[row as usize] = holds;
            if holds {
                below.add(fails[row as usize]);
            }
        }
        let (mut held, mut other) = (Vec::with_capacity(order.len()), Vec::with_capacity(order.len()));
        for rows in order {
            let (holds, not): (Vec<u32>, Vec<u32>) = rows.into_iter().partition(|&row| side[row as usize]);
            held.push(holds);
            other.push(not);
        }
        let growth = Growth { depth: growth.depth - 1, ..growth };
        let holds = self.grow(held, below, fails, side, growth);
        let fails = self.grow(other, tally.without(below), fails, side, growth);
        TreeNode { tally, split: Some(Box::new(Split { question, missing, weighed, holds, fails })) }
    }

    /// The question of least impurity, if one is better than none, and how many were weighed.
    fn best(&self, order: &[Vec<u32>], tally: Tally, fails: &[bool], least: usize) -> (Option<Question>, u64) {
        let (mut best, mut weighed) = (None, 0);
        let mut lowest = tally.impurity();
        for (column, rows) in order.iter().enumerate() {
            let values = &self.values[column];
            let mut present = Tally::default();
            for &row in rows {
                present.add(fails[row as usize]);
            }
            let mut up_to = Tally::default();
            for pair in rows.windows(2) {
                up_to.add(fails[pair[0] as usize]);
                let (below, above) = (values[pair[0] as usize], values[pair[1] as usize]);
                if below >= above {
                    continue;
                }
                // Where every row has a number, the one question is the other's negation.
                let both = present.tests < tally.tests;
                for (at_most, holds) in
                    [(true, up_to), (false, present.without(up_to))].into_iter().take(1 + usize::from(both))
                {
                    let other = tally.without(holds);
                    if holds.tests < least.max(1) || other.tests < least.max(1) {
                        continue;
                    }
                    weighed += 1;
                    let impurity = holds.impurity() + other.impurity();
                    if impurity < lowest {
                        lowest = impurity;
                        best = Some(Question { column, at_most, threshold: simplest_between(below, above) });
                    }
                }
            }
        }
        (best, weighed)
    }
}

/// How likely chance may be to make a split that stays.
const CHANCE: f64 = 0.05;

/// Takes back splits that may be chance, from below: those on whose both sides there is no other split.
fn prune(node: &mut TreeNode) {
    let Some(split) = &mut node.split else { return };
    prune(&mut split.holds);
    prune(&mut split.fails);
    let below = split.holds.split.is_some() || split.fails.split.is_some();
    if !below && split.weighed as f64 * chance(node.tally, split.holds.tally) >= CHANCE {
        node.split = None;
    }
}

/// The probability that chance divides failing tests between two sides as unevenly as this, or more so in the same
/// direction, twice (Fisher's exact test).
pub(super) fn chance(all: Tally, side: Tally) -> f64 {
    // The side on which more tests fail than would by chance.
    let expected = all.failing as f64 * side.tests as f64 / all.tests as f64;
    let side = if side.failing as f64 >= expected { side } else { all.without(side) };
    let choose = |n: usize, k: usize| log_factorial(n) - log_factorial(k) - log_factorial(n - k);
    let kept = all.tests - all.failing;
    let ways = choose(all.tests, side.tests);
    let most = side.tests.min(all.failing);
    let tail = (side.failing..=most)
        .filter(|&k| side.tests - k <= kept)
        .map(|k| libm::exp(choose(all.failing, k) + choose(kept, side.tests - k) - ways));
    (2.0 * tail.sum::<f64>()).min(1.0)
}

fn log_factorial(n: usize) -> f64 {
    libm::lgamma(n as f64 + 1.0)
}

/// The number with the fewest decimals that is at least the one and less than the other.
pub(super) fn simplest_between(low: f64, high: f64) -> f64 {
    let middle = f64::midpoint(low, high);
    let mut scale = 1.0;
    for _ in 0..15 {
        for rounded in [libm::floor(middle * scale), libm::ceil(middle * scale)] {
            let number = rounded / scale;
            if low <= number && number < high {
                return number;
            }
        }
        scale *= 10.0;
    }
    low
}
