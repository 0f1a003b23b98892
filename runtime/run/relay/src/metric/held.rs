//! The values that formulas hold: the last value of each input, and of each member of a group.

use sesame_plan::{CampaignPlan, Input, Members, TextTest, TopicId};

use crate::metric::expression::{Held, greatest, least};
use crate::value::Value;

/// The held value of an input whose last value was not finite.
const NOT_FINITE: Held = [f64::NAN; 3];

/// Reads the values of the inputs that a message on a topic has, with their positions, and returns whether all of them
/// are finite. The error is a missing field.
pub(crate) fn hear(
    inputs: &[Input],
    topic: TopicId,
    value: &Value,
    heard: &mut Vec<(usize, Held)>,
) -> Result<bool, String> {
    heard.clear();
    let mut all_finite = true;
    for (at, input) in inputs.iter().enumerate().filter(|(_, input)| input.field.topic == topic) {
        let path = &input.field.path;
        let number = |number: f64| [number, 0.0, 0.0];
        let held = match (value.at(path), &input.text) {
            (Some(Value::Point(point)), None) => Some(*point),
            (Some(value), None) => value.number().map(number),
            (None, None) => value.coordinate_at(path).map(number),
            (Some(Value::Text(text)), Some(TextTest::Is(wanted))) => Some(truth(text == wanted.as_str())),
            (Some(Value::Text(text)), Some(TextTest::IsNot(other))) => Some(truth(text != other.as_str())),
            (_, Some(_)) => None,
        };
        let Some(held) = held else { return Err(path.join(".")) };
        let finite = held.iter().all(|x| x.is_finite());
        all_finite &= finite;
        heard.push((at, if finite { held } else { NOT_FINITE }));
    }
    Ok(all_finite)
}

fn truth(holds: bool) -> Held {
    [f64::from(u8::from(holds)), 0.0, 0.0]
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
}

impl HeldInputs {
    /// Before the first message.
    pub(crate) fn new(inputs: &[Input], plan: &CampaignPlan) -> Self {
        HeldInputs {
            members: inputs.iter().map(|input| vec![None; plan.topic(input.field.topic).paths.len()]).collect(),
            inputs: vec![[0.0; 3]; inputs.len()],
            known: vec![false; inputs.len()],
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
    pub(crate) fn hold(&mut self, inputs: &[Input], heard: &[(usize, Held)], member: usize) {
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
                Members::Each | Members::First | Members::Second => {
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
