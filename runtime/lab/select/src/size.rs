//! One number of tests, from all candidates to those that matter.

use crate::instance::Instance;
use crate::problem::Problem;
use crate::start;
use crate::subproblem::{Fate, Subproblem};
use crate::tree::Search;

/// The most rounds of the first ascent.
const ROUNDS: usize = 400;
/// As long as this share of tests goes out, the ascent is repeated on those that are left.
const SHARE: f64 = 0.9;

/// The choices of one number of tests.
pub(crate) struct Size {
    pub(crate) instance: Instance,
    /// All choices; `None` once it is proved that none is good enough, and if the search was stopped before they were
    /// looked at.
    pub(crate) root: Option<Subproblem>,
    /// No choice of this size has a greater value.
    pub(crate) bound: f64,
}

impl Size {
    /// Finds good choices of this size, and bounds all of them roughly.
    pub(crate) fn new(problem: &Problem, usable: &[usize], size: usize, search: &mut Search<'_>) -> Self {
        let mut instance = Instance::new(problem, usable.to_vec(), size);
        // Once the search was stopped, one good choice of any size is enough.
        let enough = search.stopped() && search.incumbent.choice().is_some();
        let starts = if enough { Vec::new() } else { start::choices(&mut instance) };
        for choice in &starts {
            search.offer(&instance, choice);
        }
        let root = starts.first().map(|best| Subproblem::new(&mut instance, best));
        let mut own: Vec<f64> = (0..instance.len()).map(|at| instance.own(at)).collect();
        own.sort_by(|a, b| b.total_cmp(a));
        let pairs = (size * (size - 1) / 2) as f64;
        let bound = own.iter().take(size).sum::<f64>() + pairs * problem.distance_weight() * problem.diameter();
        // There may be many sizes, each with rows of its own.
        instance.forget();
        Size { instance, root, bound }
    }

    /// Leaves out what cannot be part of a choice that is good enough, or everything. Returns false if the search was
    /// stopped before.
    pub(crate) fn reduce(&mut self, search: &mut Search<'_>) -> bool {
        let Some(mut root) = self.root.take() else { return true };
        root.bound = root.bound.min(self.bound);
        loop {
            if search.stopped() {
                self.root = Some(root);
                return false;
            }
            let before = root.free.len();
            // Choices of the same value are kept, since one of them may have smaller numbers.
            let threshold = search.incumbent.equal();
            let alive = root.settle(&mut self.instance, threshold, ROUNDS);
            self.bound = self.bound.min(root.bound);
            if !alive {
                self.instance.forget();
                return true;
            }
            let these: Vec<usize> = (0..self.instance.len()).filter(|&at| root.fate[at] != Fate::Out).collect();
            if these.len() < self.instance.len() {
                let mut smaller = self.instance.among(&these);
                root = root.among(&mut smaller, &these);
                self.instance = smaller;
                self.round(&root, search);
            }
            if root.free.len() as f64 > SHARE * before as f64 || root.free.len() <= root.left(&self.instance) {
                self.instance.gather();
                root.least = vec![0; self.instance.groups];
                root.most = vec![self.instance.size; self.instance.groups];
                self.root = Some(root);
                return true;
            }
        }
    }

    /// The same for the proved value: afterwards only tests of choices with about this value may be left.
    pub(crate) fn reduce_to(&mut self, search: &mut Search<'_>, goal: f64) -> bool {
        let Some(mut root) = self.root.take() else { return true };
        let stopped = search.stopped();
        if stopped || root.settle(&mut self.instance, goal, ROUNDS) {
            self.root = Some(root);
        }
        !stopped
    }

    /// Improves the choice that the greatest fractions suggest.
    fn round(&mut self, root: &Subproblem, search: &mut Search<'_>) {
        let mut order = root.free.clone();
        order.sort_by(|&a, &b| root.fraction[b].total_cmp(&root.fraction[a]).then(a.cmp(&b)));
        let mut chosen = root.inside.clone();
        chosen.extend(order.iter().take(root.left(&self.instance)));
        let cost: f64 = chosen.iter().map(|&at| self.instance.cost[at]).sum();
        if chosen.len() == self.instance.size && cost <= self.instance.limit {
            start::improve(&mut self.instance, &mut chosen);
            search.offer(&self.instance, &chosen);
        }
    }
}
