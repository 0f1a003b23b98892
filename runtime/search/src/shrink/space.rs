//! What smaller means: the shortest windows, the neutral end of each parameter, and how far one step goes.

use sesame_plan::condition::{Condition, ConditionSpace};
use sesame_plan::{
    Activation, ActivationMode, CampaignPlan, Choice, ChoiceKind, Copies, Domain, Lengths, MembersOf, OperationId,
    Test, TestOperation,
};

use crate::space::condition::is_allowed;
use crate::space::parameter_space::ParameterSpace;
use crate::space::range::Range;

/// One step as a share of what is permitted: of an operation's window, and of a parameter's range. Whole numbers go by
/// the nearest whole number of this size, and by 1 at least.
pub const RESOLUTION: f64 = 0.01;

/// The ways in which the tests of a campaign can be shrunk.
#[derive(Debug, Clone)]
pub(super) struct ShrinkSpace {
    /// Operations that a test holds at least.
    pub(super) fewest: usize,
    /// Whether windows of copies of an operation must not overlap.
    pub(super) apart: bool,
    resolution: f64,
    operations: Vec<Bounds>,
    conditions: Option<ConditionSpace>,
}

/// The bounds of one operation of the plan.
#[derive(Debug, Clone)]
struct Bounds {
    window: Range,
    lengths: Option<Lengths>,
    constraints: Vec<sesame_plan::condition::Constraint>,
    parameters: Vec<Option<Parameter>>,
    /// For an operation whose tests choose members of a group: each choice with its members.
    members: Vec<(Choice, Vec<u32>)>,
}

/// A parameter that can be made milder.
#[derive(Debug, Clone)]
enum Parameter {
    Number(NeutralValue),
    /// A point: its coordinates, each by itself.
    Point([NeutralValue; 3]),
}

/// A permitted range of numbers, and where in it a disturbance is mildest.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct NeutralValue {
    /// The number that disturbs least; `None` where no number is milder than another, so that only narrower sub-ranges
    /// are milder.
    pub(super) end: Option<f64>,
    /// How far one step goes.
    pub(super) step: f64,
}

impl ShrinkSpace {
    /// The space of a plan's campaign, in steps of this share of what is permitted.
    pub(super) fn from_plan(plan: &CampaignPlan, resolution: f64) -> ShrinkSpace {
        let campaign = &plan.campaign;
        let conditions = match &campaign.activation {
            ActivationMode::Time => None,
            ActivationMode::Condition { space } => Some(space.clone()),
        };
        let operations = plan.operations.iter().map(|operation| {
            let whole = || {
                let end = operation.within.end.min(campaign.end_after).max(operation.within.start);
                Range::window(operation.within.start, end)
            };
            let texts = operation.choices_of_members().unwrap_or_default();
            let members = match &operation.members {
                Some(MembersOf::Chosen(choices)) => {
                    let texts = texts.iter().map(|text| Choice::Text { text: text.clone() });
                    texts.zip(choices.iter().cloned()).collect()
                }
                _ => Vec::new(),
            };
            let parameters = operation.parameters.iter().enumerate().map(|(at, parameter)| {
                let neutral = |range: Range, shape| {
                    let step = (range.high - range.low) * resolution;
                    let step = if range.integer { libm::round(step).max(1.0) } else { step };
                    let end = operation.neutral_value(at).map(|end| end.clamp(range.low, range.high));
                    // A value that is not stronger than another is left as it is.
                    let known = end.is_some() || shape == ChoiceKind::Range;
                    (known && !range.is_fixed()).then_some(NeutralValue { end, step })
                };
                match ParameterSpace::from_domain(&parameter.domain)? {
                    ParameterSpace::Number(range, shape) => neutral(range, shape).map(Parameter::Number),
                    ParameterSpace::Point(axes) => {
                        let fixed = |range: Range| NeutralValue { end: Some(range.low), step: 0.0 };
                        operation.neutral_value(at)?;
                        Some(Parameter::Point(axes.map(|axis| neutral(axis, ChoiceKind::Value).unwrap_or(fixed(axis)))))
                    }
                    ParameterSpace::Items(_) => None,
                }
            });
            Bounds {
                window: Range::windows_of(operation, campaign.end_after).unwrap_or_else(whole),
                lengths: operation.lengths,
                constraints: operation.constraints.clone(),
                parameters: parameters.collect(),
                members,
            }
        });
        ShrinkSpace {
            fewest: campaign.count.min.max(1) as usize,
            apart: campaign.copies != Copies::MayOverlap,
            resolution,
            operations: operations.collect(),
            conditions,
        }
    }

    fn bounds(&self, operation: OperationId) -> &Bounds {
        &self.operations[operation.index()]
    }

    /// The choices of an operation of a test with fewer of the members of its group, none of them another one: those
    /// with the fewest first.
    pub(super) fn fewer_members(&self, used: &TestOperation) -> Vec<Vec<Choice>> {
        let members = &self.bounds(used.operation).members;
        let Some((chosen, others)) = used.parameters.split_last() else { return Vec::new() };
        let Some((_, of_test)) = members.iter().find(|(choice, _)| choice == chosen) else { return Vec::new() };
        let is_fewer = |these: &Vec<u32>| these.len() < of_test.len() && these.iter().all(|one| of_test.contains(one));
        let mut fewer: Vec<&(Choice, Vec<u32>)> = members.iter().filter(|(_, these)| is_fewer(these)).collect();
        fewer.sort_by_key(|(_, these)| these.len());
        fewer.into_iter().map(|(choice, _)| [others, std::slice::from_ref(choice)].concat()).collect()
    }

    /// The windows that an operation may have.
    pub(super) fn window(&self, operation: OperationId) -> Range {
        self.bounds(operation).window
    }

    /// The shortest window of an operation, in seconds.
    pub(super) fn shortest(&self, operation: OperationId) -> f64 {
        self.bounds(operation).window.shortest
    }

    /// The shortest activation by condition of an operation, in seconds.
    pub(super) fn shortest_length(&self, operation: OperationId) -> f64 {
        let by_condition = self.conditions.as_ref().and_then(|space| space.end.lengths(self.bounds(operation).lengths));
        by_condition.map_or_else(|| self.shortest(operation), |lengths| lengths.low)
    }

    /// How much of a window or length one step takes away, in seconds.
    pub(super) fn time_step(&self, operation: OperationId) -> f64 {
        self.bounds(operation).window.greatest_length() * self.resolution
    }

    /// What is milder of a number; `None` where nothing is, and for a point.
    pub(super) fn number(&self, operation: OperationId, parameter: usize) -> Option<NeutralValue> {
        match self.bounds(operation).parameters.get(parameter)? {
            Some(Parameter::Number(neutral)) => Some(*neutral),
            _ => None,
        }
    }

    /// What is milder of a point's coordinates; `None` where nothing is, and for a number.
    pub(super) fn point(&self, operation: OperationId, parameter: usize) -> Option<[NeutralValue; 3]> {
        match self.bounds(operation).parameters.get(parameter)? {
            Some(Parameter::Point(axes)) => Some(*axes),
            _ => None,
        }
    }

    /// Simpler conditions of an operation: each `and` or `or` gives way to one of its sides. What the campaign demands
    /// of conditions they keep, if the operation's own keep it.
    pub(super) fn simpler(&self, used: &TestOperation) -> Vec<Activation> {
        let constraints = &self.bounds(used.operation).constraints;
        let may_start = |condition: &Condition| self.allows(condition, constraints);
        let may_end = |condition: &Condition| self.allows(condition, &[]);
        match &used.activation {
            Activation::Time { .. } | Activation::Offline => Vec::new(),
            Activation::ConditionFor { start, length, times } => {
                let demanding = may_start(start);
                let starts = simplified(start).into_iter().filter(|condition| !demanding || may_start(condition));
                starts.map(|start| Activation::ConditionFor { start, length: *length, times: *times }).collect()
            }
            Activation::Condition { start, end, times } => {
                let (demanding_start, demanding_end) = (may_start(start), may_end(end));
                let starts = simplified(start).into_iter().filter(|condition| !demanding_start || may_start(condition));
                let ends = simplified(end).into_iter().filter(|condition| !demanding_end || may_end(condition));
                let with_start = starts.map(|start| Activation::Condition { start, end: end.clone(), times: *times });
                let with_end = ends.map(|end| Activation::Condition { start: start.clone(), end, times: *times });
                with_start.chain(with_end).collect()
            }
        }
    }

    fn allows(&self, condition: &Condition, constraints: &[sesame_plan::condition::Constraint]) -> bool {
        self.conditions.as_ref().is_some_and(|space| is_allowed(condition, space, constraints))
    }
}

/// What makes one condition of two: `and` or `or`.
type Join = fn(Box<Condition>, Box<Condition>) -> Condition;

/// A condition with one `and` or `or` in it replaced by one of its sides, in each way; those that leave out most come
/// first.
fn simplified(condition: &Condition) -> Vec<Condition> {
    let (a, b, join): (_, _, Join) = match condition {
        Condition::Compare { .. } => return Vec::new(),
        Condition::And(a, b) => (a, b, Condition::And),
        Condition::Or(a, b) => (a, b, Condition::Or),
    };
    let mut found = vec![(**a).clone(), (**b).clone()];
    found.extend(simplified(a).into_iter().map(|a| join(Box::new(a), b.clone())));
    found.extend(simplified(b).into_iter().map(|b| join(a.clone(), Box::new(b))));
    found
}

/// How strong a test is: the sum over its operations, of which each counts from 0 to 1. An operation counts the mean,
/// over its numbers, of how far each is from where it is mildest, as a share of how far it may be; of a sub-range the
/// end counts that is farther away, and where no number is milder than another its width. One without such a number
/// counts 1.
pub fn strength(plan: &CampaignPlan, test: &Test) -> f64 {
    test.operations.iter().map(|used| strength_of(plan, used)).sum()
}

fn strength_of(plan: &CampaignPlan, used: &TestOperation) -> f64 {
    let operation = plan.operation(used.operation);
    let mut shares = Vec::new();
    for (at, (parameter, choice)) in operation.parameters.iter().zip(&used.parameters).enumerate() {
        let end = operation.neutral_value(at);
        let mut add = |(low, high): (f64, f64), (from, to): (f64, f64), shape| {
            let share = match end.map(|end| end.clamp(low, high)) {
                Some(end) => (from - end).abs().max((to - end).abs()) / (high - end).max(end - low),
                None if shape == ChoiceKind::Range => (to - from) / (high - low),
                None => return,
            };
            if low < high {
                shares.push(share);
            }
        };
        match (&parameter.domain, choice) {
            (&Domain::Number { low, high, shape, .. }, &Choice::Value { value }) => {
                add((low, high), (value, value), shape);
            }
            (&Domain::Number { low, high, shape, .. }, &Choice::Range { low: from, high: to }) => {
                add((low, high), (from, to), shape);
            }
            (Domain::Point { low, high }, Choice::Point { point }) => {
                for axis in 0..3 {
                    add((low[axis], high[axis]), (point[axis], point[axis]), ChoiceKind::Value);
                }
            }
            _ => {}
        }
    }
    if shares.is_empty() { 1.0 } else { shares.iter().sum::<f64>() / shares.len() as f64 }
}
