//! Which comparisons of numbers can be true together.
//!
//! A *term* is a number that conditions compare: an input, the difference of two inputs, an input with a constant
//! added, or anything else, about which nothing more is known than that it is the same each time. All terms are
//! numbers in floating point, infinities included, so `t < 5` is `t <= 4.999…`: bounds of one term by constants are
//! decided exactly in floating point. Orders between terms, and what differences of inputs say about the inputs, are
//! decided by bounds on differences of real numbers, which are weakened where a difference in floating point was
//! rounded. So what contradicts here contradicts in floating point; the reverse may fail by a rounding.

use sesame_base::differences::{Bound, Differences};

/// The position of a term.
pub(super) type TermIndex = usize;

/// What is known of the structure of a term.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum TermKind {
    /// A number on its own.
    Own,
    /// A difference in floating point of two terms.
    Difference(TermIndex, TermIndex),
    /// A sum in floating point of a term and a constant.
    Sum(TermIndex, f64),
}

/// A term.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Term {
    pub(super) kind: TermKind,
    /// The least and greatest value.
    pub(super) range: (f64, f64),
    /// Whether it takes whole numbers only.
    pub(super) whole: bool,
}

/// A comparison.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Comparison {
    /// The term is at most this number. If not, it is at least the next number.
    AtMost(TermIndex, f64),
    /// The first term is at most the second. If not, it is above.
    Ordered(TermIndex, TermIndex),
}

/// Something that was known before, to go back to.
#[derive(Debug, Clone)]
enum Before {
    Range(TermIndex, (f64, f64)),
    Group(usize, Differences),
}

/// A set of comparisons that does not contradict itself, as far as is known.
#[derive(Debug, Clone)]
pub(super) struct Theory {
    terms: Vec<Term>,
    /// What is known of each term by itself.
    ranges: Vec<(f64, f64)>,
    /// Per term: its group of terms that are compared with each other, and its place among its differences.
    groups_of: Vec<Option<(usize, usize)>>,
    groups: Vec<Differences>,
    /// Per term: those made of it.
    made_of: Vec<Vec<TermIndex>>,
    before: Vec<Before>,
}

impl Theory {
    /// Nothing is known but what terms are. `orders` are all comparisons of terms with each other that will be asked.
    /// `None` if the terms contradict themselves.
    pub(super) fn new(terms: &[Term], orders: &[(TermIndex, TermIndex)]) -> Option<Self> {
        let mut groups_of = vec![None; terms.len()];
        let mut groups = Vec::new();
        for members in grouped(terms, orders) {
            for (place, &term) in members.iter().enumerate() {
                groups_of[term] = Some((groups.len(), place + 1));
            }
            groups.push(Differences::new(members.len()));
        }
        let mut made_of = vec![Vec::new(); terms.len()];
        for (at, term) in terms.iter().enumerate() {
            match term.kind {
                TermKind::Own => {}
                TermKind::Sum(of, _) => made_of[of].push(at),
                TermKind::Difference(a, b) => [a, b].into_iter().for_each(|of| made_of[of].push(at)),
            }
        }
        let ranges = terms.iter().map(|term| term.range).collect();
        let mut theory = Theory { terms: terms.to_vec(), ranges, groups_of, groups, made_of, before: Vec::new() };
        let mut sums: Vec<(TermIndex, f64, TermIndex)> = Vec::new();
        let mut fits = true;
        for (at, term) in terms.iter().enumerate() {
            fits &= theory.narrow(at, term.range);
            if let TermKind::Sum(of, plus) = term.kind {
                sums.push((of, plus, at));
            }
        }
        // Among sums of one term and constants, a greater constant never gives a smaller sum.
        sums.extend(sums.clone().into_iter().map(|(of, ..)| (of, 0.0, of)));
        sums.sort_by(|a, b| a.0.cmp(&b.0).then(a.1.total_cmp(&b.1)));
        sums.dedup();
        for pair in sums.windows(2).filter(|pair| pair[0].0 == pair[1].0) {
            fits &= theory.bound(pair[0].2, pair[1].2, Bound { most: 0.0, below: false });
        }
        theory.before.clear();
        fits.then_some(theory)
    }

    /// Adds that a comparison holds or does not; false if that contradicts what is known.
    pub(super) fn add(&mut self, comparison: Comparison, holds: bool) -> bool {
        match (comparison, holds) {
            (Comparison::AtMost(term, most), true) => {
                self.ranges[term].1 <= most || self.narrow(term, (f64::NEG_INFINITY, most))
            }
            (Comparison::AtMost(term, most), false) => {
                let least = if self.terms[term].whole { most + 1.0 } else { most.next_up() };
                self.ranges[term].0 >= least || self.narrow(term, (least, f64::INFINITY))
            }
            (Comparison::Ordered(a, b), true) => self.bound(a, b, Bound { most: 0.0, below: false }),
            (Comparison::Ordered(a, b), false) => {
                let ((of_a, plus_a), (of_b, plus_b)) = (self.sum(a), self.sum(b));
                // What is below in floating point is below in exact arithmetic; the difference of two numbers is
                // rounded, so the bound is the next one.
                let exact = plus_a == 0.0 || plus_b == 0.0;
                let difference = plus_a - plus_b;
                let most = if exact { difference } else { difference.next_up() };
                self.bound(b, a, Bound { most: 0.0, below: true })
                    && (of_a == of_b || self.bound(of_b, of_a, Bound { most, below: true }))
            }
        }
    }

    /// The number of the group of terms with which a term has to do; for one that is compared with numbers only, a
    /// number of its own.
    pub(super) fn group(&self, term: TermIndex) -> usize {
        let member = match self.terms[term].kind {
            TermKind::Difference(of, _) => of,
            TermKind::Own | TermKind::Sum(..) => term,
        };
        self.groups_of[member].map_or(self.groups.len() + member, |(group, _)| group)
    }

    /// Whether a term is not made of others.
    pub(super) fn is_own(&self, term: TermIndex) -> bool {
        self.terms[term].kind == TermKind::Own
    }

    /// What is known of a term by itself.
    pub(super) fn range(&self, term: TermIndex) -> (f64, f64) {
        self.ranges[term]
    }

    /// What is known of the bounds on a term, those that follow from its order to others included: the least and the
    /// greatest value, and whether it is neither.
    pub(super) fn bounds(&self, term: TermIndex) -> (Bound, Bound) {
        let (least, most) = self.ranges[term];
        let own = (Bound { most: -least, below: false }, Bound { most, below: false });
        let Some((group, place)) = self.groups_of[term] else { return own };
        let tighter = |a: Bound, b: Bound| if b.most < a.most || (b.most == a.most && b.below) { b } else { a };
        let known = &self.groups[group];
        (tighter(own.0, known.bound(0, place)), tighter(own.1, known.bound(place, 0)))
    }

    /// How much is known, for [`Theory::go_back`].
    pub(super) fn mark(&self) -> usize {
        self.before.len()
    }

    /// Forgets what was added since.
    pub(super) fn go_back(&mut self, mark: usize) {
        while self.before.len() > mark {
            match self.before.pop() {
                Some(Before::Range(term, range)) => self.ranges[term] = range,
                Some(Before::Group(group, differences)) => self.groups[group] = differences,
                None => {}
            }
        }
    }

    /// A term as a term and what is added to it.
    fn sum(&self, term: TermIndex) -> (TermIndex, f64) {
        match self.terms[term].kind {
            TermKind::Sum(of, plus) => (of, plus),
            TermKind::Own | TermKind::Difference(..) => (term, 0.0),
        }
    }

    /// Adds that a term is in a range.
    fn narrow(&mut self, term: TermIndex, range: (f64, f64)) -> bool {
        let known = self.ranges[term];
        let range = (known.0.max(range.0), known.1.min(range.1));
        self.before.push(Before::Range(term, known));
        self.ranges[term] = range;
        if range.0 > range.1 {
            return false;
        }
        // Rounding keeps order, so what a term is made of bounds it exactly.
        for at in 0..self.made_of[term].len() {
            let made = self.made_of[term][at];
            let range = match self.terms[made].kind {
                TermKind::Own => continue,
                TermKind::Sum(_, plus) => (range.0 + plus, range.1 + plus),
                TermKind::Difference(a, b) => {
                    let (a, b) = (self.ranges[a], self.ranges[b]);
                    (a.0 - b.1, a.1 - b.0)
                }
            };
            let known = self.ranges[made];
            if (range.0 > known.0 || range.1 < known.1) && !self.narrow(made, range) {
                return false;
            }
        }
        let fits = self.bound_by_zero(term, range);
        match self.terms[term].kind {
            TermKind::Own | TermKind::Sum(..) => fits,
            // What is at most a number after rounding is below the next number before.
            TermKind::Difference(a, b) => {
                let below = |most: f64| Bound { most, below: true };
                fits && (range.1 == f64::INFINITY || self.bound(a, b, below(range.1.next_up())))
                    && (range.0 == f64::NEG_INFINITY || self.bound(b, a, below(-range.0.next_down())))
            }
        }
    }

    fn bound_by_zero(&mut self, term: TermIndex, range: (f64, f64)) -> bool {
        let Some((group, place)) = self.groups_of[term] else { return true };
        let bound = |most| Bound { most, below: false };
        (range.1 == f64::INFINITY || self.bound_places(group, place, 0, bound(range.1)))
            && (range.0 == f64::NEG_INFINITY || self.bound_places(group, 0, place, bound(-range.0)))
    }

    /// Adds a bound on the difference of two terms.
    fn bound(&mut self, a: TermIndex, b: TermIndex, bound: Bound) -> bool {
        match (self.groups_of[a], self.groups_of[b]) {
            (Some((group, row)), Some((_, column))) => self.bound_places(group, row, column, bound),
            // A term that is compared with itself only.
            _ => !bound.below,
        }
    }

    fn bound_places(&mut self, group: usize, row: usize, column: usize, bound: Bound) -> bool {
        let Some(tighter) = self.groups[group].with(row, column, bound) else { return false };
        self.before.push(Before::Group(group, std::mem::replace(&mut self.groups[group], tighter)));
        true
    }
}

/// Groups of two and more terms that are compared with each other, or of which one is made of the other.
fn grouped(terms: &[Term], orders: &[(TermIndex, TermIndex)]) -> Vec<Vec<TermIndex>> {
    let mut group: Vec<TermIndex> = (0..terms.len()).collect();
    let mut join = |a: TermIndex, b: TermIndex| {
        let (from, to) = (group[a], group[b]);
        group.iter_mut().filter(|group| **group == from).for_each(|group| *group = to);
    };
    for &(a, b) in orders {
        join(a, b);
    }
    for (at, term) in terms.iter().enumerate() {
        match term.kind {
            TermKind::Own => {}
            TermKind::Difference(a, b) => join(a, b),
            TermKind::Sum(of, _) => join(at, of),
        }
    }
    let members = |of: TermIndex| (0..terms.len()).filter(|&at| group[at] == of).collect::<Vec<_>>();
    (0..terms.len()).map(members).filter(|members| members.len() > 1).collect()
}
