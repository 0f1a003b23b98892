//! When a formula is computed, for which members of its groups, and from which values: found in the complete list of
//! messages, by the words of the documentation.

use std::collections::BTreeMap;

use sesame_plan::{Aggregate, CampaignPlan, Expression, FieldRef, Formula, Input, Members, TopicId, stl};
use sesame_relay::value::Value;

use crate::adapter::STEP;
use crate::ledger::Message;

/// One computation of a formula.
#[derive(Debug, Clone)]
pub(crate) struct Computed {
    /// When, in nanoseconds.
    pub(crate) time: i64,
    /// The member or pair of its groups; 0 for a formula without any.
    pub(crate) of: usize,
    /// The value of each input.
    pub(crate) values: Vec<f64>,
}

/// What a formula is computed of.
#[derive(Debug, Clone, PartialEq)]
pub(crate) enum Units {
    /// The values of its inputs, once.
    One,
    /// Each of so many members.
    Members(usize),
    /// Each pair of different members.
    Pairs(Vec<(usize, usize)>),
}

impl Units {
    pub(crate) fn of(plan: &CampaignPlan, inputs: &[Input]) -> Units {
        let count = |input: &Input| plan.topic(input.field.topic).paths.len();
        if let Some(first) = inputs.iter().find(|input| input.members == Members::First) {
            let count = count(first);
            let pairs = (0..count).flat_map(|first| (first + 1..count).map(move |second| (first, second)));
            return Units::Pairs(pairs.collect());
        }
        match inputs.iter().find(|input| input.members == Members::Each) {
            Some(each) => Units::Members(count(each)),
            None => Units::One,
        }
    }

    pub(crate) fn count(&self) -> usize {
        match self {
            Units::One => 1,
            Units::Members(count) => *count,
            Units::Pairs(pairs) => pairs.len(),
        }
    }

    /// The member whose value an input has in a unit; `None` if the input has the values of all members.
    fn member(&self, unit: usize, input: &Input) -> Option<usize> {
        match (input.members, self) {
            (Members::Each, _) => Some(unit),
            (Members::First, Units::Pairs(pairs)) => Some(pairs[unit].0),
            (Members::Second, Units::Pairs(pairs)) => Some(pairs[unit].1),
            _ => None,
        }
    }
}

/// Whether an input has a value of its own for each member or pair.
fn is_of_one_member(input: &Input) -> bool {
    matches!(input.members, Members::Each | Members::First | Members::Second)
}

/// How a formula is computed.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) enum When {
    /// At each message.
    Message,
    /// Once at each instant with a message, when all messages of that instant are known.
    Instant,
    /// The same, and once at each step of the simulator.
    Step,
}

impl When {
    /// When a formula with an aggregate is computed.
    pub(crate) fn of(plan: &CampaignPlan, formula: &Formula) -> When {
        let reads_time = match &formula.aggregate {
            Aggregate::Min { of } | Aggregate::Max { of } => of.reads_time(),
            Aggregate::Duration { of } => of.reads_time(),
            // These count messages.
            Aggregate::Last { .. } | Aggregate::Mean { .. } | Aggregate::Count { .. } => false,
        };
        let counts_messages =
            matches!(formula.aggregate, Aggregate::Last { .. } | Aggregate::Mean { .. } | Aggregate::Count { .. });
        let if_time = !counts_messages && formula.when.as_ref().is_some_and(sesame_plan::Condition::reads_time);
        if reads_time || if_time { When::Step } else { When::of_inputs(plan, &formula.inputs) }
    }

    /// When the signals of a temporal formula are computed.
    pub(crate) fn of_robustness(of: &stl::Robustness) -> When {
        if of.signals.iter().any(Expression::reads_time) { When::Step } else { When::Instant }
    }

    fn of_inputs(plan: &CampaignPlan, inputs: &[Input]) -> When {
        let several_topics = inputs.iter().any(|input| input.field.topic != inputs[0].field.topic);
        let combines = |input: &Input| input.members != Members::Each && plan.topic(input.field.topic).paths.len() > 1;
        if several_topics || inputs.iter().any(combines) { When::Instant } else { When::Message }
    }
}

/// Which member of a topic a wire is.
pub(crate) fn member(plan: &CampaignPlan, topic: TopicId, path: &str) -> Option<usize> {
    plan.topic(topic).paths.iter().position(|of| of == path)
}

/// The number that a field has in a message.
pub(crate) fn number(message: &Value, path: &[String]) -> Option<f64> {
    let value = path.iter().try_fold(message, |value, name| match value {
        Value::Record(record) => record.get(name),
        _ => None,
    })?;
    match value {
        Value::Real(x) => Some(*x),
        Value::Int(n) => Some(*n as f64),
        Value::Bool(b) => Some(f64::from(u8::from(*b))),
        _ => None,
    }
}

/// What tells messages apart.
pub(crate) fn key(plan: &CampaignPlan, per: &FieldRef, message: &Message) -> Option<String> {
    member(plan, per.topic, &message.path)?;
    let Value::Record(record) = &message.value else { return None };
    Some(match record.get(&per.path[0])? {
        Value::Text(text) => text.to_string(),
        other => format!("{other:?}"),
    })
}

/// Which messages a formula hears.
pub(crate) struct Hearing<'a> {
    pub(crate) plan: &'a CampaignPlan,
    pub(crate) inputs: &'a [Input],
    /// Everything that was published or delivered, in order.
    pub(crate) messages: &'a [Message],
    /// With `per`: the field, and one of its keys. Other messages of the field's topic are not heard, and nothing is
    /// computed before the instant of the first one that is.
    pub(crate) key: Option<(&'a FieldRef, &'a str)>,
    pub(crate) when: When,
    /// The last moment at which a step can have been over.
    pub(crate) steps: i64,
}

/// All computations of a formula, in order.
pub(crate) fn computations(hearing: &Hearing<'_>) -> Vec<Computed> {
    let Hearing { plan, inputs, key: own, .. } = *hearing;
    let units = Units::of(plan, inputs);
    let mut last: Vec<Vec<Option<f64>>> =
        inputs.iter().map(|input| vec![None; plan.topic(input.field.topic).paths.len()]).collect();
    let mut computed = Vec::new();
    let mut begun = own.is_none();
    for (time, messages) in instants(hearing) {
        // A step concerns every member, as does a message that an input reads which is not of one member.
        let mut all = hearing.when == When::Step && time % STEP == 0 && time <= hearing.steps;
        let mut spoke: Vec<usize> = Vec::new();
        for message in messages {
            begun |= own.is_some_and(|(per, _)| key(plan, per, message).is_some());
            for (of, input) in inputs.iter().enumerate() {
                let Some(member) = member(plan, input.field.topic, &message.path) else { continue };
                last[of][member] = number(&message.value, &input.field.path);
                if is_of_one_member(input) {
                    spoke.retain(|&other| other != member);
                    spoke.push(member);
                } else {
                    all = true;
                }
            }
        }
        if !begun {
            continue;
        }
        for of in concerned(&units, all, &spoke) {
            let value = |(at, input): (usize, &Input)| {
                let known = last[at].iter().flatten().copied();
                match (units.member(of, input), input.members) {
                    (Some(member), _) => last[at][member],
                    (None, Members::Max) => known.reduce(f64::max),
                    (None, Members::Sum) => known.reduce(|a, b| a + b),
                    (None, _) => known.reduce(f64::min),
                }
            };
            let values: Option<Vec<f64>> = inputs.iter().enumerate().map(value).collect();
            computed.extend(values.map(|values| Computed { time, of, values }));
        }
    }
    computed
}

/// The moments at which something may be computed, with the messages that are new then.
fn instants<'a>(hearing: &Hearing<'a>) -> Vec<(i64, Vec<&'a Message>)> {
    let Hearing { plan, inputs, key: own, .. } = *hearing;
    let is_read = |message: &&Message| {
        inputs.iter().any(|input| member(plan, input.field.topic, &message.path).is_some())
            && own.is_none_or(|(per, own)| key(plan, per, message).is_none_or(|key| key == own))
    };
    let heard = hearing.messages.iter().filter(is_read);
    if hearing.when == When::Message {
        return heard.map(|message| (message.time, vec![message])).collect();
    }
    let mut instants: BTreeMap<i64, Vec<&Message>> = BTreeMap::new();
    if hearing.when == When::Step {
        for step in 0..=hearing.steps.div_euclid(STEP) {
            instants.insert(step * STEP, Vec::new());
        }
    }
    for message in heard {
        instants.entry(message.time).or_default().push(message);
    }
    instants.into_iter().collect()
}

/// The units that are computed at a moment: first those that were silent, then those that spoke, the latest last.
fn concerned(units: &Units, all: bool, spoke: &[usize]) -> Vec<usize> {
    match units {
        Units::One => vec![0],
        Units::Members(count) => {
            let silent = (0..*count).filter(|member| all && !spoke.contains(member));
            silent.chain(spoke.iter().copied()).collect()
        }
        Units::Pairs(pairs) => {
            let speaks = |&(a, b): &(usize, usize)| all || spoke.contains(&a) || spoke.contains(&b);
            (0..pairs.len()).filter(|&at| speaks(&pairs[at])).collect()
        }
    }
}
