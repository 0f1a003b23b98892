//! Bounds on differences between variables, and between a variable and a number: what follows from them, and whether
//! they contradict each other.
//!
//! A set of such bounds contradicts itself exactly when the bounds around some cycle add up to less than nothing. Sums
//! are rounded up, so that what contradicts here contradicts in exact arithmetic; the reverse may fail by a rounding.

/// How much a difference is at most, or what it is below.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Bound {
    /// The number; infinity if nothing is known.
    pub most: f64,
    /// Whether the difference is below it.
    pub below: bool,
}

impl Bound {
    const NONE: Bound = Bound { most: f64::INFINITY, below: false };

    fn is_tighter_than(self, other: Bound) -> bool {
        self.most < other.most || (self.most == other.most && self.below && !other.below)
    }

    fn plus(self, other: Bound) -> Bound {
        let sum = self.most + other.most;
        // What rounding took from the sum, without any rounding (Knuth's two-sum).
        let other_part = sum - self.most;
        let lost = (self.most - (sum - other_part)) + (other.most - other_part);
        Bound { most: if lost > 0.0 { sum.next_up() } else { sum }, below: self.below || other.below }
    }
}

/// The tightest bounds on all differences that follow from those that were added.
#[derive(Debug, Clone, PartialEq)]
pub struct Differences {
    size: usize,
    /// At `row * size + column`: the bound on the value of the row less that of the column.
    bounds: Vec<Bound>,
}

impl Differences {
    /// Bounds on this many variables, about which nothing is known. Place 0 is the number zero, places from 1 on are
    /// variables.
    pub fn new(variables: usize) -> Self {
        let size = variables + 1;
        let zero = Bound { most: 0.0, below: false };
        let bound = |at: usize| if at / size == at % size { zero } else { Bound::NONE };
        Differences { size, bounds: (0..size * size).map(bound).collect() }
    }

    /// The bound on the value of one place less that of another.
    pub fn bound(&self, row: usize, column: usize) -> Bound {
        self.bounds[row * self.size + column]
    }

    /// These bounds with one more, on the value of one place less that of another; `None` where that contradicts them.
    pub fn with(&self, row: usize, column: usize, new: Bound) -> Option<Self> {
        let cycle = new.plus(self.bound(column, row));
        if cycle.most < 0.0 || (cycle.most == 0.0 && cycle.below) {
            return None;
        }
        let mut tighter = self.clone();
        if !new.is_tighter_than(self.bound(row, column)) {
            return Some(tighter);
        }
        for from in 0..self.size {
            for to in 0..self.size {
                let way = self.bound(from, row).plus(new).plus(self.bound(column, to));
                let bound = &mut tighter.bounds[from * self.size + to];
                if way.is_tighter_than(*bound) {
                    *bound = way;
                }
            }
        }
        Some(tighter)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn at_most(most: f64) -> Bound {
        Bound { most, below: false }
    }

    #[test]
    fn bounds_add_up_along_a_chain() {
        let chain = Differences::new(3).with(1, 2, at_most(1.0)).unwrap().with(2, 3, Bound { most: 2.0, below: true });
        assert_eq!(chain.unwrap().bound(1, 3), Bound { most: 3.0, below: true });
    }

    #[test]
    fn a_cycle_of_less_than_nothing_contradicts() {
        let known = Differences::new(2).with(1, 2, at_most(1.0)).unwrap();
        assert!(known.with(2, 1, at_most(-1.0)).is_some());
        assert!(known.with(2, 1, Bound { most: -1.0, below: true }).is_none());
        assert!(known.with(2, 1, at_most(-1.5)).is_none());
    }

    #[test]
    fn rounding_makes_no_contradiction() {
        // 0.1 + 0.2 is more than 0.3 as computed; the exact sum of these numbers is less than what is computed.
        let sum = Differences::new(3).with(1, 2, at_most(0.1)).unwrap().with(2, 3, at_most(0.2)).unwrap();
        assert!(sum.bound(1, 3).most >= 0.1 + 0.2);
        let tiny = Differences::new(3).with(1, 2, at_most(1.0)).unwrap().with(2, 3, at_most(1e-30)).unwrap();
        assert_eq!(tiny.bound(1, 3).most, 1.0_f64.next_up());
    }
}
