//! Conditions of evidence as literals: one that holds if the condition does for sure, one if it does not for sure.
//!
//! What is known completely gives a literal and its negation. About the rest (functions, products of inputs, points,
//! values of single members of groups) there are two ways to think. *Free*: it may be true or false, as long as equal
//! comparisons are equal and comparisons of one term agree; whatever is impossible then is impossible. *Sure*: it is
//! neither for sure; whatever is possible then is possible.

use sesame_plan::{Comparison, Condition, Evidence, Expression, Input, TextTest};

use super::arithmetic::{Core, boundary, chain, constant, is_number, text};
use super::atoms::{Atoms, Known, Values};
use super::logic::Literal;
use super::theory::{TermIndex, TermKind};
use crate::network::EvidenceId;

/// Whether something holds for sure, and whether it does not for sure. Never both.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Sure {
    pub(super) holds: Literal,
    pub(super) fails: Literal,
}

impl Sure {
    fn exactly(holds: Literal) -> Self {
        Sure { holds, fails: !holds }
    }

    fn not(self) -> Self {
        Sure { holds: self.fails, fails: self.holds }
    }
}

/// A piece of evidence whose condition is read.
pub(super) struct Reader<'a> {
    pub(super) atoms: &'a mut Atoms,
    pub(super) evidence: &'a Evidence,
    pub(super) id: EvidenceId,
    pub(super) values: &'a dyn Fn(&Input) -> Values,
    /// Whether what is not known completely may be either, rather than neither for sure.
    pub(super) free: bool,
}

impl Reader<'_> {
    /// A condition.
    pub(super) fn condition(&mut self, of: &Condition) -> Sure {
        match of {
            Condition::Constant(holds) => Sure::exactly(if *holds { Literal::TRUE } else { Literal::FALSE }),
            Condition::Input(at) => self.flag(*at),
            Condition::Compare { left, by, right } => self.compare(left, *by, right),
            Condition::Same { left, right } => {
                let (a, b) = (self.condition(left), self.condition(right));
                let both = self.all(&[a, b]);
                let neither = self.all(&[a.not(), b.not()]);
                self.any(&[both, neither])
            }
            Condition::All(parts) => {
                let parts: Vec<Sure> = parts.iter().map(|part| self.condition(part)).collect();
                self.all(&parts)
            }
            Condition::Any(parts) => {
                let parts: Vec<Sure> = parts.iter().map(|part| self.condition(part)).collect();
                self.any(&parts)
            }
            Condition::Not(of) => self.condition(of).not(),
        }
    }

    fn all(&mut self, parts: &[Sure]) -> Sure {
        let holds = self.atoms.logic.all(parts.iter().map(|part| part.holds));
        let fails = self.atoms.logic.any(parts.iter().map(|part| part.fails));
        Sure { holds, fails }
    }

    fn any(&mut self, parts: &[Sure]) -> Sure {
        let parts: Vec<Sure> = parts.iter().map(|part| part.not()).collect();
        self.all(&parts).not()
    }

    /// What is decided by this literal, unless that proves nothing.
    fn unless_loose(&self, holds: Literal, loose: bool) -> Sure {
        if loose && !self.free && ![Literal::TRUE, Literal::FALSE].contains(&holds) {
            return Sure { holds: Literal::FALSE, fails: Literal::FALSE };
        }
        Sure::exactly(holds)
    }

    /// The number of an input.
    pub(super) fn input(&mut self, at: u32) -> usize {
        self.atoms.input(self.id, self.evidence.side, &self.evidence.inputs[at as usize])
    }

    fn flag(&mut self, at: u32) -> Sure {
        let input = self.input(at);
        let Known { input: known, loose, .. } = &self.atoms.inputs[input];
        let (loose, group) = (*loose, (self.values)(known).group);
        let (holds, loose) = match &self.evidence.inputs[at as usize].text {
            None => (self.atoms.flag(input), loose),
            // That all members of a group have a text, or one of them, excludes less than that one topic has it.
            Some(test) if group => (self.atoms.named(format!("text {input} {test:?}")), true),
            Some(TextTest::Is(wanted)) => (self.atoms.text(input, wanted), loose),
            Some(TextTest::IsNot(other)) => (!self.atoms.text(input, other), loose),
        };
        self.unless_loose(holds, loose)
    }

    fn compare(&mut self, left: &Expression, by: Comparison, right: &Expression) -> Sure {
        match by {
            Comparison::AtMost => self.below(left, false, right),
            Comparison::Below => self.below(left, true, right),
            Comparison::AtLeast => self.below(right, false, left),
            Comparison::Above => self.below(right, true, left),
            Comparison::Equal => {
                let both = [self.below(left, false, right), self.below(right, false, left)];
                self.all(&both)
            }
            Comparison::NotEqual => {
                let either = [self.below(left, true, right), self.below(right, true, left)];
                self.any(&either)
            }
        }
    }

    /// Whether one number is at most another, or below it; with a NaN it is not.
    fn below(&mut self, left: &Expression, strictly: bool, right: &Expression) -> Sure {
        let compare = move |left: f64, right: f64| if strictly { left < right } else { left <= right };
        if is_number(left) && is_number(right) {
            if let Some(found) = self.below_each(left, strictly, right) {
                return found;
            }
            match (constant(left), constant(right)) {
                (Some(left), Some(right)) => {
                    return Sure::exactly(if compare(left, right) { Literal::TRUE } else { Literal::FALSE });
                }
                (None, Some(right)) => {
                    if let Some(found) = self.against_constant(left, &|left| compare(left, right)) {
                        return found;
                    }
                }
                (Some(left), None) => {
                    if let Some(found) = self.against_constant(right, &|right| compare(left, right)) {
                        return found;
                    }
                }
                (None, None) => {}
            }
        }
        self.ordered(left, strictly, right)
    }

    /// The same for extremes and absolute values: it is so for all, or for any, of what they are made of.
    fn below_each(&mut self, left: &Expression, strictly: bool, right: &Expression) -> Option<Sure> {
        let signs = |of: &Expression| [of.clone(), Expression::Negate(Box::new(of.clone()))];
        let (parts, all): (Vec<Sure>, bool) = match (left, right) {
            (Expression::Max(parts), _) => (parts.iter().map(|part| self.below(part, strictly, right)).collect(), true),
            (Expression::Min(parts), _) => {
                (parts.iter().map(|part| self.below(part, strictly, right)).collect(), false)
            }
            (Expression::Absolute(of), _) => {
                (signs(of).iter().map(|part| self.below(part, strictly, right)).collect(), true)
            }
            (_, Expression::Max(parts)) => (parts.iter().map(|part| self.below(left, strictly, part)).collect(), false),
            (_, Expression::Min(parts)) => (parts.iter().map(|part| self.below(left, strictly, part)).collect(), true),
            (_, Expression::Absolute(of)) => {
                (signs(of).iter().map(|part| self.below(left, strictly, part)).collect(), false)
            }
            _ => return None,
        };
        Some(if all { self.all(&parts) } else { self.any(&parts) })
    }

    /// Whether a chain has a property that only the numbers up to some number have, or lack.
    fn against_constant(&mut self, of: &Expression, holds: &dyn Fn(f64) -> bool) -> Option<Sure> {
        let chain = chain(of)?;
        let (term, negated) = self.core(chain.core)?;
        let signed = |core: f64| if negated { -core } else { core };
        let holds = |core: f64| holds(chain.apply(signed(core)));
        let range = self.atoms.terms[term].range;
        let literal = match boundary(range, &holds) {
            None if holds(range.0) => Literal::TRUE,
            None => Literal::FALSE,
            Some(last) => {
                let at_most = self.atoms.at_most(term, last);
                if holds(range.0) { at_most } else { !at_most }
            }
        };
        Some(self.unless_loose(literal, self.atoms.is_loose(term)))
    }

    /// The term of a core, and whether the core is its negative.
    fn core(&mut self, core: Core) -> Option<(TermIndex, bool)> {
        match core {
            Core::Input(at) => Some((self.input_term(at), false)),
            Core::Difference(a, b) => {
                let (a, b) = (self.input_term(a), self.input_term(b));
                if a == b {
                    return None;
                }
                Some((self.atoms.made_term(TermKind::Difference(a.min(b), a.max(b))), a > b))
            }
        }
    }

    fn input_term(&mut self, at: u32) -> TermIndex {
        let input = self.input(at);
        let values = (self.values)(&self.atoms.inputs[input].input);
        self.atoms.input_term(input, values)
    }

    /// A comparison of two numbers of which at least one is not a constant.
    fn ordered(&mut self, left: &Expression, strictly: bool, right: &Expression) -> Sure {
        if [left, right].into_iter().filter_map(constant).any(f64::is_nan) {
            return Sure::exactly(Literal::FALSE);
        }
        let literal = match (constant(left), constant(right)) {
            (_, Some(right)) => {
                let left = self.term(left);
                self.atoms.at_most(left, if strictly { right.next_down() } else { right })
            }
            (Some(left), _) => {
                let right = self.term(right);
                !self.atoms.at_most(right, if strictly { left } else { left.next_down() })
            }
            (None, None) => {
                let (left, right) = (self.term(left), self.term(right));
                if strictly { !self.atoms.ordered(right, left) } else { self.atoms.ordered(left, right) }
            }
        };
        let mut loose = false;
        let mut parts = vec![Sure::exactly(literal)];
        for side in [left, right] {
            if constant(side).is_some() {
                continue;
            }
            let term = self.term(side);
            loose |= self.atoms.is_loose(term);
            if !is_number(side) {
                parts.push(Sure::exactly(self.atoms.named(format!("number {term}"))));
            }
        }
        let all = self.all(&parts);
        self.unless_loose(all.holds, loose)
    }

    /// The term that an expression is.
    fn term(&mut self, of: &Expression) -> TermIndex {
        match chain(of).and_then(|chain| chain.sum()) {
            Some((input, 0.0)) => self.input_term(input),
            Some((input, plus)) => {
                let input = self.input_term(input);
                self.atoms.made_term(TermKind::Sum(input, plus))
            }
            None => {
                let inputs: Vec<usize> = (0..).take(self.evidence.inputs.len()).map(|at| self.input(at)).collect();
                let mut name = text(of, &|at| inputs[at as usize]);
                if of.reads_time() {
                    // Each piece of evidence reads the time of its own messages.
                    name = format!("{name} of {}", self.id.0);
                }
                self.atoms.named_term(name)
            }
        }
    }
}
