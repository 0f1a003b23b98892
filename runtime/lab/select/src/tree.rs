//! Branch and bound for one number of tests.

use crate::diagonal;
use crate::incumbent::Incumbent;
use crate::instance::Instance;
use crate::subproblem::Subproblem;

/// An instance is rebuilt when at least this many of its tests, and half of them, are out.
const SHRINK: usize = 24;
/// Up to this many free tests, the last two are chosen by trying all pairs.
const PAIRS: usize = 400;

/// What a search reports to and asks.
pub(crate) struct Search<'a> {
    pub(crate) incumbent: Incumbent,
    stop: &'a mut dyn FnMut() -> bool,
    stopped: bool,
    /// The search ends with the first choice of at least this value.
    pub(crate) goal: Option<f64>,
    /// Parts that were looked at.
    pub(crate) parts: u64,
}

impl<'a> Search<'a> {
    pub(crate) fn new(stop: &'a mut dyn FnMut() -> bool) -> Self {
        Search { incumbent: Incumbent::default(), stop, stopped: false, goal: None, parts: 0 }
    }

    /// Asks whether to stop; once is enough.
    pub(crate) fn stopped(&mut self) -> bool {
        self.stopped = self.stopped || (self.stop)();
        self.stopped
    }

    /// Whether the search was stopped, without asking.
    pub(crate) fn was_stopped(&self) -> bool {
        self.stopped
    }

    pub(crate) fn threshold(&self) -> f64 {
        self.goal.unwrap_or_else(|| self.incumbent.threshold())
    }

    fn reached(&self) -> bool {
        self.goal.is_some_and(|goal| self.incumbent.value >= goal)
    }

    /// Offers a choice, by positions in the instance.
    pub(crate) fn offer(&mut self, instance: &Instance, chosen: &[usize]) {
        let mut chosen = chosen.to_vec();
        chosen.sort_unstable();
        let value = instance.value(&chosen);
        if value >= self.incumbent.equal() {
            self.incumbent.offer(value, chosen.iter().map(|&at| instance.names[at]).collect());
        }
    }

    /// Looks at all choices in a part that may be worth it. Returns the bound of those that were not looked at because
    /// the search was stopped, negative infinity without any.
    pub(crate) fn explore(&mut self, instance: &mut Instance, root: Subproblem) -> f64 {
        let (mut here, free) = (0, root.free.clone());
        let mut parts = vec![root];
        let mut open = f64::NEG_INFINITY;
        while let Some(mut part) = parts.pop() {
            if self.reached() {
                break;
            }
            if part.bound < self.threshold() {
                continue;
            }
            if self.stopped() {
                return parts.iter().map(|part| part.bound).fold(open.max(part.bound), f64::max);
            }
            self.parts += 1;
            here += 1;
            if here == diagonal::patience(free.len()) && diagonal::tighten(instance, &part, &free) {
                for part in parts.iter_mut().chain([&mut part]) {
                    part.refresh(instance);
                }
            }
            if !part.settle(instance, self.threshold(), 12) {
                continue;
            }
            let left = part.left(instance);
            if left == part.free.len() {
                let cost: f64 = part.free.iter().map(|&at| instance.cost[at]).sum();
                if cost <= part.money {
                    let all: Vec<usize> = part.inside.iter().chain(&part.free).copied().collect();
                    self.offer(instance, &all);
                }
                continue;
            }
            if left == 0 {
                self.offer(instance, &part.inside);
                continue;
            }
            if left == 1 || (left == 2 && part.free.len() <= PAIRS) {
                self.finish(instance, &part);
                continue;
            }
            if let Some(whole) = part.whole(instance) {
                self.offer(instance, &whole);
            }
            let active = part.free.len() + part.inside.len();
            if instance.len() > SHRINK && 2 * active <= instance.len() {
                let mut these: Vec<usize> = part.free.iter().chain(&part.inside).copied().collect();
                these.sort_unstable();
                let mut smaller = instance.among(&these);
                let part = part.among(&mut smaller, &these);
                open = open.max(self.explore(&mut smaller, part));
                continue;
            }
            if let Some((group, below)) = part.branch_group(instance) {
                let mut fewer = part.clone();
                fewer.most[group] = below;
                part.least[group] = below + 1;
                parts.push(fewer);
                parts.push(part);
                continue;
            }
            let at = part.branch(instance);
            let mut without = part.clone();
            if without.put_out(instance, at) {
                parts.push(without);
            }
            if part.put_in(instance, at) {
                parts.push(part);
            }
        }
        open
    }

    /// Offers all choices of a part in which one or two tests are left that are worth it.
    fn finish(&mut self, instance: &mut Instance, part: &Subproblem) {
        let mut gain: Vec<f64> = part.free.iter().map(|&at| instance.own(at)).collect();
        for &at in &part.inside {
            let row = instance.row(at);
            for (gain, &free) in gain.iter_mut().zip(&part.free) {
                *gain += row[free];
            }
        }
        let value = instance.value(&part.inside);
        let mut chosen = part.inside.clone();
        let mut order: Vec<usize> = (0..part.free.len()).collect();
        order.sort_by(|&a, &b| gain[b].total_cmp(&gain[a]).then(a.cmp(&b)));
        for (rank, &first) in order.iter().enumerate() {
            let one = part.free[first];
            chosen.push(one);
            if part.left(instance) == 1 {
                if value + gain[first] < self.threshold() {
                    return;
                }
                if instance.cost[one] <= part.money {
                    self.offer(instance, &chosen);
                }
            } else {
                instance.row(one);
                let farthest = part.free.iter().map(|&at| instance.pair(one, at)).fold(0.0, f64::max);
                for &second in &order[rank + 1..] {
                    let other = part.free[second];
                    let base = value + gain[first] + gain[second];
                    if base + farthest < self.threshold() {
                        break;
                    }
                    let fits = instance.cost[one] + instance.cost[other] <= part.money;
                    if fits && base + instance.pair(one, other) >= self.threshold() {
                        chosen.push(other);
                        self.offer(instance, &chosen);
                        chosen.pop();
                    }
                }
            }
            chosen.pop();
        }
    }
}
