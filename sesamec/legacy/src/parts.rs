//! Operations of the original as operations of a `.sesame` file: one for each value that an operation draws, none for
//! what cannot be said.

use std::collections::BTreeMap;

use crate::notes::{Kind, Notes};
use crate::original::{Activation, Domain, Operation, OperationKind, Original, Test, ValueSet};
use crate::xml::printable;

/// What an operation of the original became.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Part {
    /// Its name in the `.sesame` file.
    pub(crate) name: String,
    /// What it does, and where its choices come from.
    pub(crate) effect: Effect,
}

/// What a part does.
#[derive(Debug, Clone, PartialEq)]
pub(crate) enum Effect {
    /// Draws from the value set at this position.
    Value { set: usize, relative: bool },
    /// Loses messages.
    Loss,
    /// Delays messages.
    Delay { randomised: bool },
    /// Drops all messages.
    Blackhole,
    /// User code with the value sets at these positions, under these names.
    Custom { parameters: Vec<(String, usize)>, offline: bool },
}

/// What tells operations of tests apart that name no operation of the space: kind, variable and name.
type Stray = (u8, Option<usize>, String);

/// All operations that tests hold: those of the space, then those that tests hold without naming one of the space, each
/// with the widest window and ranges that any of them has.
#[derive(Debug, Clone, Default, PartialEq)]
pub(crate) struct Holders {
    pub(crate) operations: Vec<Operation>,
    strays: BTreeMap<Stray, usize>,
}

impl Holders {
    pub(crate) fn of(original: &Original) -> Holders {
        let mut holders = Holders { operations: original.operations.clone(), strays: BTreeMap::new() };
        let tests = original.campaigns.iter().flat_map(|campaign| &campaign.tests);
        for operation in tests.flat_map(|test| &test.operations) {
            if template(original, operation).is_some() {
                continue;
            }
            let key = stray(original, operation);
            if let Some(&at) = holders.strays.get(&key) {
                widen(&mut holders.operations[at], operation);
            } else {
                holders.strays.insert(key, holders.operations.len());
                holders.operations.push(Operation { recorded: None, seed: 0, ..operation.clone() });
            }
        }
        holders
    }

    /// The position of what an operation of a test is one of.
    pub(crate) fn find(&self, original: &Original, operation: &Operation) -> Option<usize> {
        template(original, operation).or_else(|| self.strays.get(&stray(original, operation)).copied())
    }

    /// The positions of what a test holds, each once.
    pub(crate) fn used_by<'t>(&self, original: &Original, tests: impl IntoIterator<Item = &'t Test>) -> Vec<usize> {
        let operations = tests.into_iter().flat_map(|test| &test.operations);
        let mut used: Vec<usize> = operations.filter_map(|operation| self.find(original, operation)).collect();
        used.sort_unstable();
        used.dedup();
        used
    }
}

fn template(original: &Original, operation: &Operation) -> Option<usize> {
    let at = original.operation(operation.template?)?;
    // A copy that was turned into something else by hand is not one of them any more.
    (word(&original.operations[at].kind) == word(&operation.kind)).then_some(at)
}

fn stray(original: &Original, operation: &Operation) -> Stray {
    let variable = operation.variable.and_then(|reference| original.variable(reference));
    (word(&operation.kind), variable, operation.name.to_string())
}

fn word(kind: &OperationKind) -> u8 {
    match kind {
        OperationKind::RandomValue { relative: false, .. } => 0,
        OperationKind::RandomValue { relative: true, .. } => 1,
        OperationKind::PacketLoss { .. } => 2,
        OperationKind::Latency { randomised: false, .. } => 3,
        OperationKind::Latency { randomised: true, .. } => 4,
        OperationKind::Blackhole => 5,
        OperationKind::Custom { .. } => 6,
        OperationKind::Other(_) => 7,
    }
}

fn widen(held: &mut Operation, by: &Operation) {
    if let (Activation::Time(start, end), Activation::Time(from, to)) = (&mut held.activation, &by.activation) {
        (*start, *end) = (start.min(*from), end.max(*to));
    }
    let wider = |range: &mut (f64, f64), by: (f64, f64)| *range = (range.0.min(by.0), range.1.max(by.1));
    match (&mut held.kind, &by.kind) {
        (OperationKind::PacketLoss { keep }, OperationKind::PacketLoss { keep: other }) => wider(keep, *other),
        (OperationKind::Latency { delay, .. }, OperationKind::Latency { delay: other, .. }) => wider(delay, *other),
        (
            OperationKind::RandomValue { values: sets, .. } | OperationKind::Custom { parameters: sets },
            OperationKind::RandomValue { values: others, .. } | OperationKind::Custom { parameters: others },
        ) => {
            for (set, other) in sets.iter_mut().zip(others) {
                match (&mut set.domain, &other.domain) {
                    (Domain::Reals(low, high), Domain::Reals(from, to)) => {
                        (*low, *high) = (low.min(*from), high.max(*to));
                    }
                    (Domain::Integers(low, high), Domain::Integers(from, to)) => {
                        (*low, *high) = ((*low).min(*from), (*high).max(*to));
                    }
                    (Domain::Points(low, high), Domain::Points(from, to)) => {
                        for axis in 0..3 {
                            low[axis] = low[axis].min(from[axis]);
                            high[axis] = high[axis].max(to[axis]);
                        }
                    }
                    (Domain::Texts(texts), Domain::Texts(others)) => {
                        let new: Vec<_> = others.iter().filter(|text| !texts.contains(text)).cloned().collect();
                        texts.extend(new);
                    }
                    _ => {}
                }
            }
        }
        _ => {}
    }
}

/// The value set of an operation that stands for one of its template: of the same name, or else at the same place. Of
/// several of one name it is the one that comes as late among them.
pub(crate) fn matching<'s>(sets: &'s [ValueSet], template: &[ValueSet], at: usize) -> Option<&'s ValueSet> {
    let wanted = template.get(at)?;
    let same_name = |set: &&ValueSet| !wanted.name.is_empty() && set.name == wanted.name;
    let before = template[..at].iter().filter(same_name).count();
    sets.iter().filter(same_name).nth(before).or_else(|| sets.get(at))
}

/// Bounds in their order. Reversed ones are noted.
pub(crate) fn ordered<T: PartialOrd + std::fmt::Display>(low: T, high: T, of: &str, notes: &mut Notes) -> (T, T) {
    if low <= high {
        return (low, high);
    }
    notes.say(Kind::Swapped, format!("the bounds of {of}: [{low}, {high}] is [{high}, {low}] now"));
    (high, low)
}

/// How an operation is spoken of.
pub(crate) fn called(operation: &Operation) -> String {
    match printable(&operation.name) {
        name if name.is_empty() => "an operation without a name".to_owned(),
        name => format!("operation `{name}`"),
    }
}
