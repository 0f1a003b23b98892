//! The values that formulas hold: the last value of each input, and of each member of a group.

use sesame_plan::{CampaignPlan, InList, Input, Members, Reduction, TextTest, TopicId, value_path_in_words};

use crate::elements::{Found, visit};
use crate::metric::expression::{Held, greatest, least};
use crate::value::Value;

/// The held value of an input whose last value was not finite.
pub(super) const NOT_FINITE: Held = [f64::NAN; 3];

/// The values that a message has of a formula's inputs, by their positions.
#[derive(Debug, Clone, Default)]
pub(crate) struct HeardValues {
    /// Of inputs that are one value.
    values: Vec<(usize, Held)>,
    /// Of inputs that are each value of a list.
    lists: Vec<(usize, Vec<Held>)>,
    /// The first input for which several elements of a list were there, although it is one value.
    several: Option<usize>,
}

/// For each input of a formula, whether a message may lack its value.
#[derive(Debug, Clone)]
pub(crate) struct Optional(Vec<bool>);

impl Optional {
    pub(crate) fn new(inputs: &[Input], plan: &CampaignPlan) -> Self {
        Optional(inputs.iter().map(|input| plan.may_lack(&input.field)).collect())
    }
}

/// What a message is for a formula.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Read {
    /// All values that it has are finite.
    Finite,
    /// Some are not.
    NotFinite,
    /// It lacks an optional value, so that it is as if it had not come.
    Lacking,
}

impl HeardValues {
    /// Whether there was none, as if the message had not come.
    pub(crate) fn is_nothing(&self) -> bool {
        self.values.is_empty() && self.lists.is_empty()
    }

    /// Puts another value of an input in the place of the one that was heard, if one was; `None` takes it out.
    pub(super) fn replace(&mut self, input: usize, by: impl FnOnce(Held) -> Option<Held>) {
        let Some(at) = self.values.iter().position(|(of, _)| *of == input) else { return };
        match by(self.values[at].1) {
            Some(value) => self.values[at].1 = value,
            None => _ = self.values.remove(at),
        }
    }

    /// The values of inputs that are one value.
    pub(crate) fn values(&self) -> &[(usize, Held)] {
        &self.values
    }

    /// What to say of inputs that are one value although a list has several for them.
    pub(crate) fn note(&self, inputs: &[Input]) -> Option<String> {
        let input = &inputs[self.several?];
        let steps = input.list.as_ref().map_or(&[][..], |list| &list.steps);
        let path = format!("{}{}", input.field.path.join("."), value_path_in_words(steps));
        Some(format!("several elements are `{path}`; the first one counts"))
    }
}

/// Reads the values of the inputs that a message on the `member`th path of a topic has. The error is a missing field
/// that is not optional.
pub(crate) fn hear(
    inputs: &[Input],
    optional: &Optional,
    (topic, member): (TopicId, usize),
    value: &Value,
    heard: &mut HeardValues,
) -> Result<Read, String> {
    heard.values.clear();
    heard.lists.clear();
    heard.several = None;
    let mut read = Read::Finite;
    for (at, input) in inputs.iter().enumerate().filter(|(_, input)| input.reads(topic, member)) {
        let path = &input.field.path;
        let held = match (&input.list, value.at(path)) {
            (Some(list), Some(found)) => match in_list(list, input, value, found, at, heard) {
                Some(held) => Some(held),
                None => continue,
            },
            (None, Some(found)) => held_of(Found::Value(found), input.text.as_ref()),
            (None, None) => value.coordinate_at(path).map(number),
            (Some(_), None) => None,
        };
        let Some(held) = held else {
            heard.values.clear();
            heard.lists.clear();
            return if optional.0[at] { Ok(Read::Lacking) } else { Err(path.join(".")) };
        };
        let finite = is_finite(held);
        if !finite {
            read = Read::NotFinite;
        }
        heard.values.push((at, if finite { held } else { NOT_FINITE }));
    }
    Ok(read)
}

/// What a list in a message is for an input; `None` if the message is as if it had not come, or all is in `heard`.
fn in_list(
    list: &InList,
    input: &Input,
    message: &Value,
    found: &Value,
    at: usize,
    heard: &mut HeardValues,
) -> Option<Held> {
    let beside = input.field.path.split_last().and_then(|(_, outer)| match message.at(outer) {
        Some(Value::Record(record)) => Some(record),
        _ => None,
    });
    let mut first = None;
    let mut count = 0_u64;
    let mut each = Vec::new();
    let mut reduced: Option<f64> = None;
    visit(found, beside, &list.steps, &mut |found| {
        match (list.reduction, found) {
            (Reduction::Count, found) => {
                count += u64::from(!matches!(found, Found::Value(Value::Bool(false))));
                return;
            }
            (Reduction::Length, Found::Value(Value::List(items))) => {
                first = first.or(Some(number(items.len() as f64)));
                return;
            }
            _ => {}
        }
        let Some(held) = held_of(found, input.text.as_ref()) else { return };
        if list.reduction != Reduction::First && !is_finite(held) {
            return;
        }
        count += 1;
        match list.reduction {
            Reduction::Each => each.push(held),
            Reduction::First => first = first.or(Some(held)),
            Reduction::Min => reduced = Some(reduced.map_or(held[0], |before| least(before, held[0]))),
            Reduction::Max => reduced = Some(reduced.map_or(held[0], |before| greatest(before, held[0]))),
            Reduction::Sum | Reduction::Mean => reduced = Some(reduced.unwrap_or(0.0) + held[0]),
            Reduction::Count | Reduction::Length => {}
        }
    });
    match list.reduction {
        Reduction::First => {
            if count > 1 {
                heard.several = heard.several.or(Some(at));
            }
            first
        }
        Reduction::Length => first,
        Reduction::Each => {
            heard.lists.push((at, each));
            None
        }
        Reduction::Min | Reduction::Max => reduced.map(number),
        Reduction::Sum => Some(number(reduced.unwrap_or(0.0))),
        Reduction::Mean => reduced.map(|sum| number(sum / count as f64)),
        Reduction::Count => Some(number(count as f64)),
    }
}

/// A value as an input holds it; `None` if it is not of a type that can be held.
fn held_of(found: Found<'_>, text: Option<&TextTest>) -> Option<Held> {
    match (found, text) {
        (Found::Coordinate(coordinate), None) => Some(number(coordinate)),
        (Found::Value(Value::Point(point)), None) => Some(*point),
        (Found::Value(value), None) => value.number().map(number),
        (Found::Value(Value::Text(text)), Some(TextTest::Is(wanted))) => Some(truth(text == wanted.as_str())),
        (Found::Value(Value::Text(text)), Some(TextTest::IsNot(other))) => Some(truth(text != other.as_str())),
        (_, Some(_)) => None,
    }
}

fn number(number: f64) -> Held {
    [number, 0.0, 0.0]
}

pub(super) fn is_finite(held: Held) -> bool {
    held.iter().all(|x| x.is_finite())
}

fn is_each(input: &Input) -> bool {
    input.list.as_ref().is_some_and(|list| list.reduction == Reduction::Each)
}

fn truth(holds: bool) -> Held {
    [f64::from(u8::from(holds)), 0.0, 0.0]
}

/// The number of members whose last values an input holds.
pub(super) fn members_of(input: &Input, plan: &CampaignPlan) -> usize {
    if input.only().is_some() { 1 } else { plan.topic(input.field.topic).paths.len() }
}

/// The last values of the inputs of a formula.
#[derive(Debug, Clone)]
pub(crate) struct HeldInputs {
    /// Per input: the last value of each member.
    members: Vec<Vec<Option<Held>>>,
    /// Per input: the value computed from them.
    inputs: Vec<Held>,
    /// Per input: whether there was a message at all.
    known: Vec<bool>,
    /// Per input that is each value of a list: these values, in the last message.
    lists: Vec<(usize, Vec<Held>)>,
}

impl HeldInputs {
    /// Before the first message.
    pub(crate) fn new(inputs: &[Input], plan: &CampaignPlan) -> Self {
        HeldInputs {
            members: inputs.iter().map(|input| vec![None; members_of(input, plan)]).collect(),
            inputs: vec![[0.0; 3]; inputs.len()],
            known: vec![false; inputs.len()],
            lists: (0..inputs.len()).filter(|&at| is_each(&inputs[at])).map(|at| (at, Vec::new())).collect(),
        }
    }

    /// How many values the lists have of which a formula is evaluated for each; `None` for a formula without.
    pub(super) fn elements(&self) -> Option<usize> {
        self.lists.iter().map(|(_, values)| values.len()).min()
    }

    /// Makes inputs that are each value of a list the value at this place.
    pub(super) fn turn_to_element(&mut self, element: usize) {
        for (at, values) in &self.lists {
            self.inputs[*at] = values[element];
        }
    }

    /// As [`HeldInputs::new`], for values of one member or pair: those of the others are neither taken nor kept.
    pub(super) fn of_one(inputs: &[Input], plan: &CampaignPlan) -> Self {
        let mut held = HeldInputs::new(inputs, plan);
        for (members, input) in held.members.iter_mut().zip(inputs) {
            if matches!(input.members, Members::Each | Members::First | Members::Second) {
                *members = Vec::new();
            }
        }
        held
    }

    /// Takes the values that [`hear`] found in a message on the `member`th path of its topic.
    pub(crate) fn hold(&mut self, inputs: &[Input], heard: &HeardValues, member: usize) {
        for (at, values) in &heard.lists {
            self.known[*at] = true;
            if let Some((_, held)) = self.lists.iter_mut().find(|(of, _)| of == at) {
                held.clone_from(values);
            }
        }
        self.hold_values(inputs, &heard.values, member);
    }

    /// As [`HeldInputs::hold`], for values that are not in lists.
    pub(crate) fn hold_values(&mut self, inputs: &[Input], heard: &[(usize, Held)], member: usize) {
        for &(at, value) in heard {
            self.known[at] = true;
            let members = &mut self.members[at];
            if let [last] = members.as_mut_slice() {
                (*last, self.inputs[at]) = (Some(value), value);
                continue;
            }
            if let Some(last) = members.get_mut(member) {
                *last = Some(value);
            }
            let join: fn(f64, f64) -> f64 = match inputs[at].members {
                Members::Each | Members::First | Members::Second | Members::Only(_) => {
                    self.inputs[at] = value;
                    continue;
                }
                Members::Min => least,
                Members::Max => greatest,
                Members::Sum => |a, b| a + b,
            };
            // Points are never combined: they come from a single topic.
            let joined = members.iter().flatten().copied().reduce(|a, b| [join(a[0], b[0]), a[1], a[2]]);
            self.inputs[at] = joined.unwrap_or(value);
        }
    }

    /// Makes inputs that are of each member those of this one. Returns whether it had a message for all of them.
    pub(super) fn turn_to(&mut self, inputs: &[Input], member: usize) -> bool {
        self.turn(inputs, |input| (input.members == Members::Each).then_some(member))
    }

    /// Makes inputs that are of a pair, or of each member, those of this one. Returns whether both had a message for
    /// all of them.
    pub(super) fn turn_to_pair(&mut self, inputs: &[Input], (first, second): (usize, usize)) -> bool {
        self.turn(inputs, |input| match input.members {
            Members::First | Members::Each => Some(first),
            Members::Second => Some(second),
            _ => None,
        })
    }

    fn turn(&mut self, inputs: &[Input], member: impl Fn(&Input) -> Option<usize>) -> bool {
        let mut known = true;
        for (at, input) in inputs.iter().enumerate() {
            let Some(member) = member(input) else { continue };
            match self.members[at].get(member).copied().flatten() {
                Some(value) => self.inputs[at] = value,
                None => known = false,
            }
        }
        known
    }

    /// The held values of all inputs, once all had a message and while the last ones are finite.
    pub(crate) fn values(&self) -> Option<&[Held]> {
        let usable = !self.known.contains(&false) && self.inputs.iter().all(|held| !held[0].is_nan());
        usable.then_some(&self.inputs)
    }
}
