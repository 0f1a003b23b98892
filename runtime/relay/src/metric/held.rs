//! The values that formulas hold: the last value of each input, and of each member of a group.

use sesame_plan::{CampaignPlan, Input, Members, TopicId};

use crate::metric::expression::{Held, greatest, least};
use crate::value::Value;

/// The held value of an input whose last value was not finite.
const NOT_FINITE: Held = [f64::NAN; 3];

/// Reads the values of the inputs that a message on a topic has, with their positions, and returns whether all of them
/// are finite. The error is a missing field.
pub(super) fn hear(
    inputs: &[Input],
    topic: TopicId,
    value: &Value,
    heard: &mut Vec<(usize, Held)>,
) -> Result<bool, String> {
    heard.clear();
    let mut all_finite = true;
    for (at, input) in inputs.iter().enumerate().filter(|(_, input)| input.field.topic == topic) {
        let held = match value.at(&input.field.path) {
            Some(Value::Point(point)) => *point,
            Some(Value::Real(x)) => [*x, 0.0, 0.0],
            Some(Value::Int(n)) => [*n as f64, 0.0, 0.0],
            Some(Value::Bool(b)) => [f64::from(u8::from(*b)), 0.0, 0.0],
            _ => return Err(input.field.path.join(".")),
        };
        let finite = held.iter().all(|x| x.is_finite());
        all_finite &= finite;
        heard.push((at, if finite { held } else { NOT_FINITE }));
    }
    Ok(all_finite)
}

/// The last values of the inputs of a formula.
#[derive(Debug, Clone)]
pub(super) struct HeldInputs {
    /// Per input: the last value of each member.
    members: Vec<Vec<Option<Held>>>,
    /// Per input: the value computed from them.
    inputs: Vec<Held>,
    /// Per input: whether there was a message at all.
    known: Vec<bool>,
}

impl HeldInputs {
    /// Before the first message.
    pub(super) fn new(inputs: &[Input], plan: &CampaignPlan) -> Self {
        HeldInputs {
            members: inputs.iter().map(|input| vec![None; plan.topic(input.field.topic).paths.len()]).collect(),
            inputs: vec![[0.0; 3]; inputs.len()],
            known: vec![false; inputs.len()],
        }
    }

    /// Takes the values that [`hear`] found in a message on the `member`th path of its topic.
    pub(super) fn hold(&mut self, inputs: &[Input], heard: &[(usize, Held)], member: usize) {
        for &(at, value) in heard {
            self.known[at] = true;
            let members = &mut self.members[at];
            members[member] = Some(value);
            let join: fn(f64, f64) -> f64 = match inputs[at].members {
                Members::Each => {
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

    /// Makes one member of a group the latest, if each member has a formula.
    pub(super) fn turn_to(&mut self, inputs: &[Input], topic: TopicId, member: usize) {
        for (at, input) in inputs.iter().enumerate() {
            if input.field.topic == topic && input.members == Members::Each {
                self.inputs[at] = self.members[at][member].unwrap_or(self.inputs[at]);
            }
        }
    }

    /// The held values of all inputs, once all had a message and while the last ones are finite.
    pub(super) fn values(&self) -> Option<&[Held]> {
        let usable = !self.known.contains(&false) && self.inputs.iter().all(|held| !held[0].is_nan());
        usable.then_some(&self.inputs)
    }
}
