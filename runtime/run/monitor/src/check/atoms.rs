//! What conditions are made of: each input and term that occurs in them once, and the atoms over these.

use std::collections::BTreeMap;

use sesame_plan::{Input, Members, Reduction, Side};

use super::logic::{Literal, Logic};
use super::theory::{Comparison, Term, TermIndex, TermKind};
use crate::network::EvidenceId;

/// What is known of the values of an input, besides that its numbers are finite.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Values {
    /// The least number.
    pub least: f64,
    /// The greatest number, which is not less.
    pub greatest: f64,
    /// Whether its numbers are whole.
    pub whole: bool,
    /// Whether its topic is a group of topics.
    pub group: bool,
}

impl Values {
    /// Any values of one topic.
    pub const ANY: Values = Values { least: f64::MIN, greatest: f64::MAX, whole: false, group: false };
}

/// An input as evidence hears it.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct Known {
    pub(super) side: Side,
    /// Without a test of its text.
    pub(super) input: Input,
    /// The evidence that alone hears it so, for values of one member of a group at a time.
    owner: Option<EvidenceId>,
    /// Whether what is known of it leaves out how it relates to others, so that values chosen for it prove nothing.
    pub(super) loose: bool,
}

/// All atoms.
pub(super) struct Atoms {
    pub(super) logic: Logic,
    /// Per node: the comparison that it is.
    pub(super) comparisons: Vec<Option<Comparison>>,
    pub(super) terms: Vec<Term>,
    /// Comparisons of terms with each other.
    pub(super) orders: Vec<(TermIndex, TermIndex)>,
    pub(super) inputs: Vec<Known>,
    /// Per term that is an input: which.
    pub(super) input_terms: BTreeMap<usize, TermIndex>,
    named_terms: BTreeMap<String, TermIndex>,
    loose_terms: Vec<bool>,
    at_most: BTreeMap<(TermIndex, u64), Literal>,
    ordered: BTreeMap<(TermIndex, TermIndex), Literal>,
    pub(super) flags: BTreeMap<usize, Literal>,
    pub(super) texts: BTreeMap<usize, BTreeMap<String, Literal>>,
    /// Atoms that are only a name: whether a topic was heard, whether a number is one.
    named: BTreeMap<String, Literal>,
}

impl Atoms {
    pub(super) fn new() -> Self {
        Atoms {
            logic: Logic::new(),
            comparisons: Vec::new(),
            terms: Vec::new(),
            orders: Vec::new(),
            inputs: Vec::new(),
            input_terms: BTreeMap::new(),
            named_terms: BTreeMap::new(),
            loose_terms: Vec::new(),
            at_most: BTreeMap::new(),
            ordered: BTreeMap::new(),
            flags: BTreeMap::new(),
            texts: BTreeMap::new(),
            named: BTreeMap::new(),
        }
    }

    /// The number of an input of evidence.
    pub(super) fn input(&mut self, evidence: EvidenceId, side: Side, input: &Input) -> usize {
        if let Some(at) = self.find(evidence, side, input) {
            return at;
        }
        let input = Input { text: None, ..input.clone() };
        let owner = owner(evidence, &input);
        // What the least, the greatest and the sum of the same values have to do with each other is not known here, nor
        // what their rates and earlier values have to do with them.
        let other = |known: &Known| known.side == side && known.input.field == input.field;
        let mut loose = owner.is_some();
        for known in self.inputs.iter_mut().filter(|known| other(known)) {
            (known.loose, loose) = (true, true);
        }
        self.inputs.push(Known { side, input, owner, loose });
        self.inputs.len() - 1
    }

    /// The number of an input of evidence, if it has one.
    pub(super) fn find(&self, evidence: EvidenceId, side: Side, input: &Input) -> Option<usize> {
        self.inputs.iter().position(|known| {
            let of = |input: &Input| (input.field.clone(), input.members, input.list.clone(), input.memory.clone());
            let same = of(&known.input) == of(input);
            same && (known.side, known.owner) == (side, owner(evidence, input))
        })
    }

    /// Whether values chosen for a term prove nothing.
    pub(super) fn is_loose(&self, term: TermIndex) -> bool {
        self.loose_terms[term]
            || self.input_terms.iter().any(|(&input, &at)| at == term && self.inputs[input].loose)
            || match self.terms[term].kind {
                TermKind::Own => false,
                TermKind::Difference(a, b) => self.is_loose(a) || self.is_loose(b),
                TermKind::Sum(of, _) => self.is_loose(of),
            }
    }

    fn add_term(&mut self, term: Term, loose: bool) -> TermIndex {
        self.terms.push(term);
        self.loose_terms.push(loose);
        self.terms.len() - 1
    }

    /// The term that an input is.
    pub(super) fn input_term(&mut self, input: usize, values: Values) -> TermIndex {
        if let Some(&term) = self.input_terms.get(&input) {
            return term;
        }
        let term = Term { kind: TermKind::Own, range: (values.least, values.greatest), whole: values.whole };
        let term = self.add_term(term, false);
        self.input_terms.insert(input, term);
        term
    }

    /// A term made of others.
    pub(super) fn made_term(&mut self, kind: TermKind) -> TermIndex {
        let same = |term: &Term| term.kind == kind;
        if let Some(at) = self.terms.iter().position(same) {
            return at;
        }
        let range = (f64::NEG_INFINITY, f64::INFINITY);
        self.add_term(Term { kind, range, whole: false }, false)
    }

    /// A term of which nothing is known but what it is called.
    pub(super) fn named_term(&mut self, name: String) -> TermIndex {
        if let Some(&term) = self.named_terms.get(&name) {
            return term;
        }
        let range = (f64::NEG_INFINITY, f64::INFINITY);
        let term = self.add_term(Term { kind: TermKind::Own, range, whole: false }, true);
        self.named_terms.insert(name, term);
        term
    }

    fn comparison(&mut self, comparison: Comparison) -> Literal {
        let literal = self.logic.atom();
        self.comparisons.resize(literal.node() + 1, None);
        self.comparisons[literal.node()] = Some(comparison);
        literal
    }

    /// That a term is at most a number.
    pub(super) fn at_most(&mut self, term: TermIndex, most: f64) -> Literal {
        let Term { range, whole, .. } = self.terms[term];
        let most = if whole { most.floor() } else { most };
        // There are two zeros, which are equal.
        let most = if most == 0.0 { 0.0 } else { most };
        if most >= range.1 {
            return Literal::TRUE;
        }
        if most < range.0 {
            return Literal::FALSE;
        }
        let key = (term, most.to_bits());
        if let Some(&known) = self.at_most.get(&key) {
            return known;
        }
        let literal = self.comparison(Comparison::AtMost(term, most));
        self.at_most.insert(key, literal);
        literal
    }

    /// That one term is at most another.
    pub(super) fn ordered(&mut self, a: TermIndex, b: TermIndex) -> Literal {
        if a == b {
            return Literal::TRUE;
        }
        if let Some(&known) = self.ordered.get(&(a, b)) {
            return known;
        }
        let literal = self.comparison(Comparison::Ordered(a, b));
        self.orders.push((a, b));
        self.ordered.insert((a, b), literal);
        literal
    }

    /// That an input is true.
    pub(super) fn flag(&mut self, input: usize) -> Literal {
        if let Some(&known) = self.flags.get(&input) {
            return known;
        }
        let literal = self.logic.atom();
        self.flags.insert(input, literal);
        literal
    }

    /// That the text of an input is this one.
    pub(super) fn text(&mut self, input: usize, text: &str) -> Literal {
        if let Some(&known) = self.texts.get(&input).and_then(|texts| texts.get(text)) {
            return known;
        }
        let literal = self.logic.atom();
        self.texts.entry(input).or_default().insert(text.to_owned(), literal);
        literal
    }

    /// Something that is only a name.
    pub(super) fn named(&mut self, name: String) -> Literal {
        if let Some(&known) = self.named.get(&name) {
            return known;
        }
        let literal = self.logic.atom();
        self.named.insert(name, literal);
        literal
    }

    /// What always holds: a text is at most one of several. Where an input holds if one of many texts is this one, the
    /// others may be other texts.
    pub(super) fn laws(&mut self) -> Vec<Literal> {
        let of_any = |input: &Input| {
            let reduction = input.list.as_ref().map(|list| list.reduction);
            input.members == Members::Max || !matches!(reduction, None | Some(Reduction::First | Reduction::Min))
        };
        let several =
            self.texts.iter().filter(|(input, texts)| texts.len() > 1 && !of_any(&self.inputs[**input].input));
        let several: Vec<Vec<Literal>> = several.map(|(_, texts)| texts.values().copied().collect()).collect();
        several.into_iter().map(|literals| !self.logic.at_least(2, literals)).collect()
    }
}

/// The evidence that alone hears an input so: what the value of one member of a group has to do with that which other
/// evidence hears is not known.
fn owner(evidence: EvidenceId, input: &Input) -> Option<EvidenceId> {
    matches!(input.members, Members::Each | Members::First | Members::Second).then_some(evidence)
}
