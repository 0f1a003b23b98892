//! A subproblem of the search: some tests are in, some are out, and the others are free. Its relaxation lets free tests
//! be chosen in fractions and charges a price for cost beyond the limit; the maximum is approached by moving fractions
//! from one test to another, each time by the exact best amount (as SMO does for support vector machines [Platt 1998]).
//!
//! Since the objective is concave, its tangent plane at any point is above it. So every step of the ascent gives a
//! valid bound of all choices in the part: the sum of the best scores of the plane. It also bounds the choices that
//! contain one test, or do not, which decides about tests without branching.
//!
//! A part may also say how many tests of a group of near-duplicates are chosen. Without the one that it branches on,
//! the relaxation would choose its neighbours to the same amount, and the bound would hardly fall; without its group it
//! falls at once. The best tests that the numbers of all groups permit are found by going through them by score, as in
//! every matroid, and what takes the place of one test is one other test.

use crate::instance::Instance;

/// Fractions closer than this to 0 and 1 are whole.
const WHOLE: f64 = 1e-13;

/// A group of which this little more can be chosen, or less, is left alone.
const SLACK: f64 = 1e-9;
/// A group whose number is this far from a whole one is decided before its tests.
const APART: f64 = 0.1;

/// What is decided about a test.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Fate {
    Free,
    In,
    Out,
}

/// A subproblem of branch and bound.
#[derive(Debug, Clone)]
pub(crate) struct Subproblem {
    pub(crate) fate: Vec<Fate>,
    /// The free tests, ascending.
    pub(crate) free: Vec<usize>,
    /// The tests that are in, in the order in which this was decided.
    pub(crate) inside: Vec<usize>,
    /// How much of each test is chosen.
    pub(crate) fraction: Vec<f64>,
    /// The slope of the objective at the fractions.
    slope: Vec<f64>,
    /// What a unit of cost is charged.
    price: f64,
    /// How many tests of each group are chosen at least, and at most.
    pub(crate) least: Vec<usize>,
    pub(crate) most: Vec<usize>,
    /// What is left for free tests.
    pub(crate) money: f64,
    /// No choice in this part has a greater value.
    pub(crate) bound: f64,
}

/// A tangent plane, summed over the best free tests that the groups permit.
struct Tangent {
    price: f64,
    bound: f64,
    /// Whether each free test is among them.
    taken: Vec<bool>,
    /// What those of each group score at least, and those in groups that can do without one.
    last: Vec<f64>,
    last_of_any: f64,
    /// What the others of each group score at most, and the others in groups with room.
    next: Vec<f64>,
    next_of_any: f64,
    /// Whether a group has room for another test, and whether it can do without one.
    room: Vec<bool>,
    spare: Vec<bool>,
}

/// A price, and how much more than the money is spent at it.
type Priced = (f64, f64);

impl Subproblem {
    /// All choices of an instance, with one of them as the beginning of the ascent.
    pub(crate) fn new(instance: &mut Instance, start: &[usize]) -> Self {
        let count = instance.len();
        let mut subproblem = Subproblem {
            fate: vec![Fate::Free; count],
            free: (0..count).filter(|&at| !instance.forced[at]).collect(),
            inside: (0..count).filter(|&at| instance.forced[at]).collect(),
            fraction: vec![0.0; count],
            slope: Vec::new(),
            price: 0.0,
            least: vec![0; instance.groups],
            most: vec![instance.size; instance.groups],
            money: instance.limit,
            bound: f64::INFINITY,
        };
        for &at in &subproblem.inside {
            subproblem.fate[at] = Fate::In;
            subproblem.money -= instance.cost[at];
        }
        for &at in start {
            subproblem.fraction[at] = 1.0;
        }
        subproblem.refresh(instance);
        subproblem
    }

    /// This part in an instance that has only these of its tests, of which none that is left out is in.
    pub(crate) fn among(&self, instance: &mut Instance, these: &[usize]) -> Self {
        let mut subproblem = Subproblem {
            fate: these.iter().map(|&at| self.fate[at]).collect(),
            free: Vec::new(),
            inside: self.inside.iter().map(|at| these.binary_search(at).expect("what is in stays")).collect(),
            fraction: these.iter().map(|&at| self.fraction[at]).collect(),
            slope: Vec::new(),
            price: self.price,
            least: self.least.clone(),
            most: self.most.clone(),
            money: self.money,
            bound: self.bound,
        };
        subproblem.free = (0..these.len()).filter(|&at| subproblem.fate[at] == Fate::Free).collect();
        subproblem.refresh(instance);
        subproblem
    }

    /// Computes the slope anew.
    pub(crate) fn refresh(&mut self, instance: &mut Instance) {
        self.slope = (0..instance.len()).map(|at| instance.linear(at)).collect();
        for at in 0..instance.len() {
            let fraction = self.fraction[at];
            if fraction != 0.0 {
                for (slope, distance) in self.slope.iter_mut().zip(instance.row(at)) {
                    *slope += fraction * distance;
                }
            }
        }
    }

    /// How many free tests a choice contains.
    pub(crate) fn left(&self, instance: &Instance) -> usize {
        instance.size - self.inside.len()
    }

    fn score(&self, instance: &Instance, at: usize) -> f64 {
        self.slope[at] - self.price * instance.cost[at]
    }

    /// Moves an amount of one test to another.
    fn transfer(&mut self, instance: &mut Instance, from: usize, to: usize, amount: f64) {
        self.fraction[to] = snapped(self.fraction[to] + amount);
        self.fraction[from] = snapped(self.fraction[from] - amount);
        for (slope, distance) in self.slope.iter_mut().zip(instance.row(to)) {
            *slope += amount * distance;
        }
        for (slope, distance) in self.slope.iter_mut().zip(instance.row(from)) {
            *slope -= amount * distance;
        }
    }

    /// How much of each group is chosen.
    fn sums(&self, instance: &Instance) -> Vec<f64> {
        let mut sums = vec![0.0; instance.groups];
        for &at in self.inside.iter().chain(&self.free) {
            sums[instance.group[at]] += self.fraction[at];
        }
        sums
    }

    /// Moves what a group has too much of to others, and to a group what it lacks.
    fn repair(&mut self, instance: &mut Instance, sums: &mut [f64]) {
        for group in 0..instance.groups {
            loop {
                let over = sums[group] - self.most[group] as f64;
                let under = self.least[group] as f64 - sums[group];
                if over.max(under) <= WHOLE {
                    break;
                }
                // Either this group gives and another one takes, or the other way round.
                let (mut to, mut from) = ((f64::NEG_INFINITY, usize::MAX), (f64::INFINITY, usize::MAX));
                for &at in &self.free {
                    let (score, its) = (self.score(instance, at), instance.group[at]);
                    let takes = if its == group { under > 0.0 } else { over > 0.0 && self.room(its, sums) > WHOLE };
                    let gives = if its == group { over > 0.0 } else { under > 0.0 && self.spare(its, sums) > WHOLE };
                    if takes && self.fraction[at] < 1.0 && score > to.0 {
                        to = (score, at);
                    }
                    if gives && self.fraction[at] > 0.0 && score < from.0 {
                        from = (score, at);
                    }
                }
                let (to, from) = (to.1, from.1);
                if to == usize::MAX || from == usize::MAX {
                    break;
                }
                let (taking, giving) = (instance.group[to], instance.group[from]);
                let others = if taking == group { self.spare(giving, sums) } else { self.room(taking, sums) };
                let amount = over.max(under).min(others).min(1.0 - self.fraction[to]).min(self.fraction[from]);
                sums[taking] += amount;
                sums[giving] -= amount;
                self.transfer(instance, from, to, amount);
            }
        }
    }

    /// How much more of a group may be chosen.
    fn room(&self, group: usize, sums: &[f64]) -> f64 {
        self.most[group] as f64 - sums[group]
    }

    /// How much less of a group may be chosen.
    fn spare(&self, group: usize, sums: &[f64]) -> f64 {
        sums[group] - self.least[group] as f64
    }

    /// The test to which the steepest permitted step leads.
    fn steepest(&self, instance: &Instance, sums: &[f64]) -> Option<usize> {
        let mut best = vec![(f64::NEG_INFINITY, usize::MAX); instance.groups];
        let mut worst = vec![f64::INFINITY; instance.groups];
        for &at in &self.free {
            let (score, group, fraction) = (self.score(instance, at), instance.group[at], self.fraction[at]);
            if fraction < 1.0 && score > best[group].0 {
                best[group] = (score, at);
            }
            if fraction > 0.0 && score < worst[group] {
                worst[group] = score;
            }
        }
        let can_lose = |group: &usize| self.spare(*group, sums) > SLACK;
        let worst_of_any =
            (0..instance.groups).filter(can_lose).map(|group| worst[group]).fold(f64::INFINITY, f64::min);
        let rise = |group: usize| {
            let others = if self.room(group, sums) > SLACK { worst_of_any } else { f64::INFINITY };
            best[group].0 - worst[group].min(others)
        };
        let steepest = (0..instance.groups).max_by(|&a, &b| rise(a).total_cmp(&rise(b)).then(b.cmp(&a)))?;
        (best[steepest].1 != usize::MAX).then_some(best[steepest].1)
    }

    /// Takes the best of these steps up to this number of times. Returns whether there is none left that is worth it.
    fn ascend(&mut self, instance: &mut Instance, steps: usize) -> bool {
        let mut sums = self.sums(instance);
        if instance.groups > 1 {
            self.repair(instance, &mut sums);
        }
        for _ in 0..steps {
            let Some(to) = self.steepest(instance, &sums) else { return true };
            let high = self.score(instance, to);
            let own = instance.group[to];
            instance.row(to);
            let mut chosen = (0.0, usize::MAX, 0.0);
            let least = 1e-11 * (high.abs() + 1e-300);
            for &at in &self.free {
                if self.fraction[at] > 0.0 && at != to {
                    let rise = high - self.score(instance, at);
                    if rise > least {
                        let bend = instance.pair(to, at) - 0.5 * (instance.diagonal(to) + instance.diagonal(at));
                        let amount = if bend > 0.0 { (0.5 * rise / bend).min(1.0) } else { 1.0 };
                        let mut amount = amount.min(1.0 - self.fraction[to]).min(self.fraction[at]);
                        let group = instance.group[at];
                        if group != own {
                            amount = amount.min(self.spare(group, &sums)).min(self.room(own, &sums));
                        }
                        let gain = amount * (rise - amount * bend);
                        if amount > 0.0 && gain > chosen.0 {
                            chosen = (gain, at, amount);
                        }
                    }
                }
            }
            let (_, from, amount) = chosen;
            if from == usize::MAX {
                return true;
            }
            sums[instance.group[from]] -= amount;
            sums[own] += amount;
            self.transfer(instance, from, to, amount);
        }
        false
    }

    /// The tangent plane at the fractions, with a price of cost.
    fn tangent(&self, instance: &Instance, price: f64, order: &mut Vec<(f64, usize)>) -> Tangent {
        let left = self.left(instance);
        let mut bound = price * self.money;
        for &at in self.inside.iter().chain(&self.free) {
            bound -= 0.5 * self.fraction[at] * (self.slope[at] - instance.linear(at));
        }
        bound += self.inside.iter().map(|&at| self.slope[at]).sum::<f64>();
        order.clear();
        let score = |at: usize| self.slope[at] - price * instance.cost[at];
        order.extend(self.free.iter().enumerate().map(|(place, &at)| (score(at), place)));
        let better = |a: &(f64, usize), b: &(f64, usize)| b.0.total_cmp(&a.0).then(a.1.cmp(&b.1));
        if instance.groups == 1 && left < order.len() && left > 0 {
            order.select_nth_unstable_by(left - 1, better);
            order[..left].sort_unstable_by(better);
        } else {
            order.sort_unstable_by(better);
        }
        let (mut need, mut room) = (self.least.clone(), self.most.clone());
        for &at in &self.inside {
            let group = instance.group[at];
            need[group] = need[group].saturating_sub(1);
            room[group] = room[group].saturating_sub(1);
        }
        let count = instance.groups;
        let mut plane = Tangent {
            price,
            bound,
            taken: vec![false; order.len()],
            last: vec![f64::INFINITY; count],
            last_of_any: f64::INFINITY,
            next: vec![f64::NEG_INFINITY; count],
            next_of_any: f64::NEG_INFINITY,
            room: Vec::new(),
            spare: vec![false; count],
        };
        // What the groups need comes from them; the others are the best of what they have room for.
        let needed: usize = need.iter().sum();
        let mut others = left.saturating_sub(needed);
        for &(score, place) in order.iter() {
            let group = instance.group[self.free[place]];
            let take = if need[group] > 0 {
                need[group] -= 1;
                true
            } else if others > 0 && room[group] > 0 {
                others -= 1;
                plane.spare[group] = true;
                true
            } else {
                false
            };
            if take {
                room[group] = room[group].saturating_sub(1);
                plane.bound += score;
                plane.taken[place] = true;
                plane.last[group] = score;
            } else {
                plane.next[group] = plane.next[group].max(score);
            }
        }
        if needed > left || others > 0 || need.iter().any(|&need| need > 0) {
            plane.bound = f64::NEG_INFINITY;
        }
        plane.room = room.iter().map(|&room| room > 0).collect();
        for group in 0..count {
            if plane.spare[group] {
                plane.last_of_any = plane.last_of_any.min(plane.last[group]);
            }
            if plane.room[group] {
                plane.next_of_any = plane.next_of_any.max(plane.next[group]);
            }
        }
        plane
    }

    /// The price at which the tangent plane gives the best bound, found by bisection: the bound is convex in it.
    fn best_tangent(&self, instance: &Instance, scores: &mut Vec<(f64, usize)>) -> Tangent {
        let mut best = self.tangent(instance, self.price, scores);
        if !instance.uneven {
            return best;
        }
        let left = self.left(instance);
        let mut order: Vec<(f64, f64)> = Vec::with_capacity(self.free.len());
        // What the best tests of the plane cost at a price.
        let mut spent = |price: f64| -> f64 {
            order.clear();
            order.extend(self.free.iter().map(|&at| (self.slope[at] - price * instance.cost[at], instance.cost[at])));
            if left == 0 || left > order.len() {
                return 0.0;
            }
            order.select_nth_unstable_by(left - 1, |a, b| b.0.total_cmp(&a.0).then(a.1.total_cmp(&b.1)));
            order[..left].iter().map(|(_, cost)| cost).sum()
        };
        let (mut low, mut high) = (0.0, (2.0 * self.price).max(1e-6));
        if spent(0.0) <= self.money {
            let free = self.tangent(instance, 0.0, scores);
            return if free.bound < best.bound { free } else { best };
        }
        let mut tries = 0;
        while spent(high) > self.money && tries < 60 {
            (low, high, tries) = (high, 2.0 * high, tries + 1);
        }
        for _ in 0..20 {
            let middle = 0.5 * (low + high);
            if spent(middle) > self.money { low = middle } else { high = middle }
        }
        for price in [low, high] {
            let other = self.tangent(instance, price, scores);
            if other.bound < best.bound {
                best = other;
            }
        }
        best
    }

    /// A lower bound of the relaxation's maximum at the current price.
    fn relaxed(&self, instance: &Instance) -> f64 {
        let mut value = self.price * self.money;
        for &at in &self.inside {
            value += 0.5 * (self.slope[at] + instance.linear(at));
        }
        for &at in &self.free {
            let fraction = self.fraction[at];
            if fraction > 0.0 {
                value += fraction * (0.5 * (self.slope[at] + instance.linear(at)) - self.price * instance.cost[at]);
            }
        }
        value
    }

    /// Ascends until the bound is below `threshold`, or it is clear that it will not be, or `rounds` are over; then
    /// decides about tests that no choice of at least `threshold` contains, or that all of them contain. Returns
    /// whether the part may hold such a choice.
    pub(crate) fn settle(&mut self, instance: &mut Instance, threshold: f64, rounds: usize) -> bool {
        let mut scores = Vec::with_capacity(self.free.len());
        // The last price that was too low, and the last one that was too high.
        let (mut low, mut high): (Option<Priced>, Option<Priced>) = (None, None);
        for _ in 0..rounds {
            let done = self.ascend(instance, 12);
            let plane = self.tangent(instance, self.price, &mut scores);
            self.bound = self.bound.min(plane.bound);
            if self.bound < threshold {
                return false;
            }
            let relaxed = self.relaxed(instance);
            let settled = done || plane.bound - relaxed <= 0.05 * (plane.bound - threshold);
            if !settled {
                continue;
            }
            if !instance.uneven {
                break;
            }
            let spent: f64 = self.free.iter().map(|&at| self.fraction[at] * instance.cost[at]).sum();
            let excess = spent - self.money;
            if (excess <= 0.0 && self.price == 0.0) || excess.abs() <= 1e-3 * self.money.abs() {
                break;
            }
            if excess > 0.0 {
                low = Some((self.price, excess));
            } else {
                high = Some((self.price, excess));
            }
            self.price = match (low, high) {
                (Some((low, over)), Some((high, under))) => {
                    if high - low <= 1e-6 * high {
                        break;
                    }
                    low + (high - low) * (over / (over - under)).clamp(0.1, 0.9)
                }
                (Some((low, _)), None) => (1.5 * low).max(self.slope_per_cost(instance)),
                (None, Some((high, _))) if high > 1e-9 => 0.5 * high,
                _ => 0.0,
            };
        }
        let plane = self.best_tangent(instance, &mut scores);
        self.bound = self.bound.min(plane.bound);
        self.bound >= threshold && self.decide(instance, threshold, &plane)
    }

    /// A small price to begin with.
    fn slope_per_cost(&self, instance: &Instance) -> f64 {
        let most = self.free.iter().map(|&at| self.slope[at]).fold(0.0, f64::max);
        let cost = self.free.iter().map(|&at| instance.cost[at]).fold(0.0, f64::max);
        if cost > 0.0 { 0.05 * most / cost } else { 0.0 }
    }

    fn decide(&mut self, instance: &mut Instance, threshold: f64, plane: &Tangent) -> bool {
        let (mut out, mut inside) = (Vec::new(), Vec::new());
        let fits = self.most_for_one(instance);
        for (place, &at) in self.free.iter().enumerate() {
            let score = self.slope[at] - plane.price * instance.cost[at];
            let group = instance.group[at];
            if instance.cost[at] > fits {
                out.push(at);
            } else if plane.taken[place] {
                // One other test takes its place: one of its group, or any if the group can do without it.
                let any = if plane.spare[group] { plane.next_of_any } else { f64::NEG_INFINITY };
                if plane.bound - score + plane.next[group].max(any) < threshold {
                    inside.push(at);
                }
            } else {
                // It takes the place of one other test: of its group, or of any if the group has room.
                let any = if plane.room[group] { plane.last_of_any } else { f64::INFINITY };
                if plane.bound - plane.last[group].min(any) + score < threshold {
                    out.push(at);
                }
            }
        }
        if out.is_empty() && inside.is_empty() {
            return true;
        }
        // Their fractions move only after all is decided, since what they move to must be free.
        out.iter().all(|&at| self.put_out(instance, at)) && inside.iter().all(|&at| self.put_in(instance, at))
    }

    /// The most that one free test may cost: the others cost at least as much as the cheapest.
    fn most_for_one(&self, instance: &Instance) -> f64 {
        let left = self.left(instance);
        if !instance.uneven || left == 0 || left > self.free.len() {
            return f64::INFINITY;
        }
        let mut cost: Vec<f64> = self.free.iter().map(|&at| instance.cost[at]).collect();
        cost.select_nth_unstable_by(left - 1, f64::total_cmp);
        self.money - cost[..left - 1].iter().sum::<f64>()
    }

    /// Decides that a free test is in. Returns whether enough others can be free.
    pub(crate) fn put_in(&mut self, instance: &mut Instance, at: usize) -> bool {
        if self.left(instance) == 0 || instance.cost[at] > self.money {
            return false;
        }
        self.remove_free(at);
        while self.fraction[at] < 1.0 {
            let below = |a: &&usize, b: &&usize| self.score(instance, **a).total_cmp(&self.score(instance, **b));
            let Some(&from) = self.free.iter().filter(|&&at| self.fraction[at] > 0.0).min_by(below) else {
                // What rounding took away.
                self.fraction[at] = 1.0;
                self.refresh(instance);
                break;
            };
            let amount = (1.0 - self.fraction[at]).min(self.fraction[from]);
            self.transfer(instance, from, at, amount);
        }
        self.fate[at] = Fate::In;
        self.inside.push(at);
        self.money -= instance.cost[at];
        true
    }

    /// Decides that a free test is out. Returns whether enough are left.
    pub(crate) fn put_out(&mut self, instance: &mut Instance, at: usize) -> bool {
        self.remove_free(at);
        self.fate[at] = Fate::Out;
        if self.free.len() < self.left(instance) {
            return false;
        }
        while self.fraction[at] > 0.0 {
            let below = |a: &&usize, b: &&usize| self.score(instance, **a).total_cmp(&self.score(instance, **b));
            let Some(&to) = self.free.iter().filter(|&&at| self.fraction[at] < 1.0).max_by(below) else {
                self.fraction[at] = 0.0;
                self.refresh(instance);
                break;
            };
            let amount = self.fraction[at].min(1.0 - self.fraction[to]);
            self.transfer(instance, at, to, amount);
        }
        true
    }

    fn remove_free(&mut self, at: usize) {
        let place = self.free.binary_search(&at).expect("only free tests are decided");
        self.free.remove(place);
    }

    /// The test to branch on: of those chosen in fractions the greatest one, and without one the worst that is whole.
    pub(crate) fn branch(&self, instance: &Instance) -> usize {
        let fractional = self.free.iter().copied().filter(|&at| self.fraction[at] > 0.0 && self.fraction[at] < 1.0);
        let greatest = fractional.max_by(|&a, &b| self.fraction[a].total_cmp(&self.fraction[b]).then(b.cmp(&a)));
        greatest.unwrap_or_else(|| {
            let whole = self.free.iter().copied().filter(|&at| self.fraction[at] >= 1.0);
            let worst = whole.min_by(|&a, &b| self.score(instance, a).total_cmp(&self.score(instance, b)));
            worst.unwrap_or(self.free[0])
        })
    }

    /// The group to branch on, with the number of its tests rounded down: the one whose number is the least whole.
    pub(crate) fn branch_group(&self, instance: &Instance) -> Option<(usize, usize)> {
        if instance.groups == 1 {
            return None;
        }
        let sums = self.sums(instance);
        let apart = |group: usize| (sums[group] - sums[group].round()).abs();
        let group = (0..instance.groups).max_by(|&a, &b| apart(a).total_cmp(&apart(b)).then(b.cmp(&a)))?;
        if apart(group) < APART {
            return None;
        }
        let below = (0..instance.size).take_while(|&number| number as f64 + 1.0 <= sums[group]).count();
        (self.least[group] <= below && below < self.most[group]).then_some((group, below))
    }

    /// The choice that the fractions are, if they are whole and it costs no more than the limit.
    pub(crate) fn whole(&self, instance: &Instance) -> Option<Vec<usize>> {
        if self.free.iter().any(|&at| self.fraction[at] > 0.0 && self.fraction[at] < 1.0) {
            return None;
        }
        let mut chosen: Vec<usize> = self.free.iter().copied().filter(|&at| self.fraction[at] >= 1.0).collect();
        let cost: f64 = chosen.iter().map(|&at| instance.cost[at]).sum();
        chosen.extend(&self.inside);
        chosen.sort_unstable();
        (chosen.len() == instance.size && cost <= self.money).then_some(chosen)
    }
}

fn snapped(fraction: f64) -> f64 {
    if fraction < WHOLE {
        0.0
    } else if fraction > 1.0 - WHOLE {
        1.0
    } else {
        fraction
    }
}
