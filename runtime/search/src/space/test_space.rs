//! The space of a campaign's tests: which operations, how many, when, and how strong.
//!
//! Every strategy draws from these tests and from no others. Single operations are made of what [`OperationSpace`]
//! says; what holds of several copies of one operation, [`TestSpace::settle`] brings about in a test that was put
//! together, and [`TestSpace::permits_copies`] tells:
//!
//! - no two copies have the same operation seed, so that each has random draws of its own;
//! - [`Copies::Apart`], by time: their windows are disjoint;
//! - [`Copies::Apart`], by condition: nothing, as the relay makes a copy wait while another is active;
//! - [`Copies::Apart`], before the start or after the end: there is one, as all would act at the same moment;
//! - [`Copies::Once`]: there is one.

use std::collections::BTreeSet;

use sesame_base::observation::Observation;
use sesame_plan::condition::{Condition, ConditionEnd, ConditionSpace, Constraint};
use sesame_plan::{
    Activation, ActivationMode, CampaignPlan, Choice, Copies, Count, Lengths, MembersOf, OperationId, Test,
    TestOperation, Times,
};
use sesame_rng::Stream;

use crate::SearchError;
use crate::space::condition::grown;
use crate::space::heard::Heard;
use crate::space::initial::{TRIES, fresh_activation, fresh_operation};
use crate::space::parameter_space::ParameterSpace;
use crate::space::range::Range;
use crate::space::separation;
use crate::space::strongest::Strongest;

/// How often a first condition is tried before a campaign is said to have none; so rarely does one try fail where there
/// are any that this is certain enough.
const FIRST_TRIES: u64 = 100;

/// All that a campaign's tests may be.
#[derive(Debug, Clone, PartialEq)]
pub struct TestSpace {
    operations: Vec<OperationSpace>,
    count: Count,
    copies: Copies,
    conditions: Option<ConditionSpace>,
}

/// One operation as far as a campaign permits it.
#[derive(Debug, Clone, PartialEq)]
pub struct OperationSpace {
    /// Which.
    pub operation: OperationId,
    /// When it may be active.
    pub activation: ActivationSpace,
    /// Its parameters, in the operation's order.
    pub parameters: Vec<ParameterSpace>,
    /// How it disturbs most.
    pub strongest: Strongest,
    /// When there are messages that it could disturb.
    pub heard: Heard,
    /// Probability that a fresh test includes it.
    pub inclusion: f64,
}

/// When a campaign permits an operation to be active.
#[derive(Debug, Clone, PartialEq)]
pub enum ActivationSpace {
    /// Never, as it acts before the start or after the end: there is nothing to choose.
    Offline,
    /// In a window of time inside this range, which lies in `within` and the campaign, and as long as it permits.
    Time(Range),
    /// As conditions say.
    Condition {
        /// What they are grown from.
        space: ConditionSpace,
        /// What the start conditions contain.
        constraints: Vec<Constraint>,
        /// A start condition and an end condition that are permitted, for when many tries give no others.
        first: Box<[Condition; 2]>,
    },
}

impl OperationSpace {
    /// Whether an operation of a test is one of these, also as to the members of a group that it acts on.
    pub(crate) fn is_of(&self, used: &TestOperation) -> bool {
        let members = match (self.parameters.last(), used.parameters.last()) {
            (Some(ParameterSpace::Items(items)), Some(Choice::Text { text })) => items.contains(text),
            _ => true,
        };
        self.operation == used.operation && members
    }
}

impl ActivationSpace {
    /// What limits how many copies fit into a test.
    pub fn times(&self) -> Times {
        match self {
            ActivationSpace::Offline => Times::Offline,
            ActivationSpace::Time(range) => Times::Windows {
                room: range.high - range.low,
                lengths: range.longest.is_finite().then_some(Lengths { low: range.shortest, high: range.longest }),
            },
            ActivationSpace::Condition { .. } => Times::Windows { room: f64::INFINITY, lengths: None },
        }
    }

    /// What the start conditions of an operation contain.
    pub fn constraints(&self) -> &[Constraint] {
        match self {
            ActivationSpace::Condition { constraints, .. } => constraints,
            ActivationSpace::Offline | ActivationSpace::Time(_) => &[],
        }
    }
}

impl TestSpace {
    /// What a plan's campaign permits. Operations that could only begin at or after its end are left out.
    pub fn from_plan(plan: &CampaignPlan) -> Result<Self, SearchError> {
        let campaign = &plan.campaign;
        let name = || campaign.name.clone();
        let count = Count { min: campaign.count.min.max(1), max: campaign.count.max };
        if count.min > count.max {
            return Err(SearchError::Count { campaign: name(), min: campaign.count.min, max: campaign.count.max });
        }
        let conditions = match &campaign.activation {
            ActivationMode::Time => None,
            ActivationMode::Condition { space } => Some(space.clone()),
        };
        let mut operations = Vec::new();
        for &id in &campaign.operations {
            let operation = plan.operation(id);
            let offline = operation.kind.is_offline();
            let windows = Range::windows_of(operation, campaign.end_after);
            if !offline && windows.is_none() {
                continue;
            }
            let mut parameters = Vec::new();
            for parameter in &operation.parameters {
                let parameter_space = ParameterSpace::from_domain(&parameter.domain).ok_or_else(|| {
                    SearchError::NoWholeNumber { operation: operation.name.clone(), parameter: parameter.name.clone() }
                })?;
                parameters.push(parameter_space);
            }
            operations.push(OperationSpace {
                operation: id,
                activation: match (&conditions, windows) {
                    _ if offline => ActivationSpace::Offline,
                    (_, None) => continue,
                    (None, Some(windows)) => ActivationSpace::Time(windows),
                    (Some(space), Some(_)) => {
                        let mut space = space.clone();
                        if let Some(Lengths { low, high }) = space.end.lengths(operation.lengths) {
                            space.end = ConditionEnd::Length { low, high };
                        }
                        let none = || SearchError::NoCondition { campaign: name(), operation: operation.name.clone() };
                        ActivationSpace::Condition {
                            constraints: operation.constraints.clone(),
                            first: Box::new(first_conditions(&space, &operation.constraints).ok_or_else(none)?),
                            space,
                        }
                    }
                },
                strongest: Strongest::of(operation, &parameters),
                parameters,
                heard: Heard::of(plan, id),
                inclusion: operation.inclusion,
            });
        }
        if operations.is_empty() {
            return Err(SearchError::NoOperation { campaign: name() });
        }
        let test_space = TestSpace { operations, count, copies: campaign.copies, conditions };
        let most = test_space.most();
        if most < test_space.fewest() {
            return Err(SearchError::TooFew { campaign: name(), min: count.min, most });
        }
        Ok(test_space)
    }

    /// The same space, with an operation of its own for each choice of members of an operation whose tests choose
    /// members of a group: one robot's radio is another danger than another's. Operations with very many choices stay
    /// one.
    #[must_use]
    pub(crate) fn with_members_apart(mut self, plan: &CampaignPlan) -> Self {
        /// The most choices of which each is an operation of its own.
        const MOST_APART: usize = 24;
        let apart = |kind: OperationSpace| {
            let operation = plan.operation(kind.operation);
            let chosen = matches!(operation.members, Some(MembersOf::Chosen(_)));
            let Some(ParameterSpace::Items(items)) = kind.parameters.last().filter(|_| chosen) else {
                return vec![kind];
            };
            if items.len() > MOST_APART {
                return vec![kind];
            }
            let of = |item: &String| {
                let mut one = kind.clone();
                *one.parameters.last_mut().expect("it has one") = ParameterSpace::Items(vec![item.clone()]);
                one.strongest = Strongest::of(operation, &one.parameters);
                one
            };
            items.iter().map(of).collect()
        };
        self.operations = self.operations.into_iter().flat_map(apart).collect();
        self
    }

    /// Learns from the reference run when there are messages to disturb.
    pub fn take_reference(&mut self, reference: &Observation) {
        for kind in &mut self.operations {
            kind.heard.take_reference(reference);
        }
    }

    /// Whether each window of a test meets a message of the reference run, as far as that is known.
    pub fn is_heard(&self, test: &Test) -> bool {
        test.operations.iter().all(|used| match used.activation {
            Activation::Time { start, end } => {
                self.find(used.operation).is_none_or(|kind| kind.heard.is_in((start, end)))
            }
            _ => true,
        })
    }

    /// What holds of several copies of one operation.
    pub fn copies(&self) -> Copies {
        self.copies
    }

    /// How many copies of an operation a test may hold.
    pub fn most_copies(&self, kind: &OperationSpace) -> usize {
        match (self.copies, &kind.activation) {
            // A copy waits while another one is active.
            (Copies::Apart, ActivationSpace::Condition { .. }) => usize::MAX,
            (copies, activation) => copies.most(activation.times()) as usize,
        }
    }

    /// Whether a test of these operations may hold one more copy of an operation.
    pub fn has_room(&self, operations: &[TestOperation], kind: &OperationSpace) -> bool {
        operations.iter().filter(|operation| operation.operation == kind.operation).count() < self.most_copies(kind)
    }

    /// Whether the copies of each operation in a test of this campaign are permitted.
    pub fn permits_copies(&self, test: &Test) -> bool {
        let mut draws = BTreeSet::new();
        let drawn_alone =
            test.operations.iter().all(|operation| draws.insert((operation.operation, operation.operation_seed)));
        drawn_alone
            && self.operations.iter().all(|kind| {
                let copies = places_of(test, kind.operation);
                if copies.len() > self.most_copies(kind) {
                    return false;
                }
                let Some(windows) = self.windows_apart(test, kind, &copies) else { return true };
                let mut settled = windows.clone();
                if let ActivationSpace::Time(range) = kind.activation {
                    separation::nearest(range, &mut settled);
                }
                settled == windows
            })
    }

    /// Makes the copies of each operation in a test what they have to be, and changes nothing else: too many copies
    /// leave the test, each as likely as the others, and where too few operations remain fresh ones of other kinds come
    /// in; windows are moved apart to the nearest ones; a copy that draws like an earlier one gets an
    /// operation seed of its own. A test that is permitted already stays as it is and takes nothing from the stream.
    pub fn settle(&self, test: &mut Test, stream: &mut Stream) {
        for kind in &self.operations {
            let mut copies = places_of(test, kind.operation);
            while copies.len() > self.most_copies(kind) {
                test.operations.remove(copies[stream.below(copies.len())]);
                copies = places_of(test, kind.operation);
            }
        }
        while test.operations.len() < self.fewest() {
            let kinds: Vec<_> = self.operations.iter().filter(|kind| self.has_room(&test.operations, kind)).collect();
            let kind = kinds[stream.below(kinds.len())];
            let place = stream.below(test.operations.len() + 1);
            test.operations.insert(place, fresh_operation(kind, stream));
        }
        self.settle_windows(test, separation::nearest);
        let mut draws = BTreeSet::new();
        for operation in &mut test.operations {
            while !draws.insert((operation.operation, operation.operation_seed)) {
                operation.operation_seed = stream.bits();
            }
        }
    }

    /// Draws the windows of a permitted test anew that meet no message of the reference run, as far as several tries
    /// find others. A test without such windows stays as it is and takes nothing from the stream.
    pub fn settle_on_messages(&self, test: &mut Test, stream: &mut Stream) {
        for _ in 0..TRIES {
            if self.is_heard(test) {
                break;
            }
            for used in &mut test.operations {
                let Some(kind) = self.find(used.operation) else { continue };
                if let (&Activation::Time { start, end }, ActivationSpace::Time(_)) =
                    (&used.activation, &kind.activation)
                    && !kind.heard.is_in((start, end))
                {
                    used.activation = fresh_activation(kind, stream);
                }
            }
            self.settle(test, stream);
        }
    }

    /// Moves the windows of copies apart in this way, if they have to be.
    pub fn settle_windows(&self, test: &mut Test, way: fn(Range, &mut [(f64, f64)])) {
        for kind in &self.operations {
            let copies = places_of(test, kind.operation);
            let (Some(mut windows), ActivationSpace::Time(range)) =
                (self.windows_apart(test, kind, &copies), &kind.activation)
            else {
                continue;
            };
            way(*range, &mut windows);
            for (&place, (start, end)) in copies.iter().zip(windows) {
                test.operations[place].activation = Activation::Time { start, end };
            }
        }
    }

    /// The windows of copies that must not overlap; `None` where they may, and where there is one.
    fn windows_apart(&self, test: &Test, kind: &OperationSpace, copies: &[usize]) -> Option<Vec<(f64, f64)>> {
        let by_time = matches!(kind.activation, ActivationSpace::Time(_));
        if self.copies != Copies::Apart || !by_time || copies.len() < 2 {
            return None;
        }
        let window = |&place: &usize| match test.operations[place].activation {
            Activation::Time { start, end } => Some((start, end)),
            _ => None,
        };
        copies.iter().map(window).collect()
    }

    /// The operations, in the campaign's order; at least one.
    pub fn operations(&self) -> &[OperationSpace] {
        &self.operations
    }

    /// What conditions are grown from; `None` where operations are active in windows of time.
    pub fn conditions(&self) -> Option<&ConditionSpace> {
        self.conditions.as_ref()
    }

    /// The least number of operations of a test, at least 1.
    pub fn fewest(&self) -> usize {
        self.count.min as usize
    }

    /// The greatest number of operations of a test, at least [`TestSpace::fewest`].
    pub fn most(&self) -> usize {
        let copies = self.operations.iter().fold(0usize, |sum, kind| sum.saturating_add(self.most_copies(kind)));
        copies.min(self.count.max as usize)
    }

    /// What is permitted of an operation; `None` for one that the campaign does not use.
    pub fn find(&self, operation: OperationId) -> Option<&OperationSpace> {
        self.operations.iter().find(|operation_space| operation_space.operation == operation)
    }
}

/// Where in a test the copies of an operation are.
fn places_of(test: &Test, operation: OperationId) -> Vec<usize> {
    (0..test.operations.len()).filter(|&at| test.operations[at].operation == operation).collect()
}

/// A start condition and an end condition that are permitted, if there are any. No seed decides them, since a campaign
/// can be searched with every seed or with none.
fn first_conditions(space: &ConditionSpace, constraints: &[Constraint]) -> Option<[Condition; 2]> {
    let first = |constraints: &[Constraint]| {
        (0..FIRST_TRIES).find_map(|at| grown(space, constraints, &mut Stream::derive(0, "first condition", &[at])))
    };
    Some([first(constraints)?, first(&[])?])
}

#[cfg(test)]
pub(crate) mod tests {
    use proptest::prelude::*;

    use sesame_base::condition::constant::has_constant_part;
    use sesame_plan::condition::{ConditionEnd, Integers};
    use sesame_plan::{Activation, Choice, ChoiceKind, Domain, Drain, Operation, OperationKind, Search, Span, Test};

    use super::*;
    use crate::space::condition::contains;
    use crate::space::condition::tests::{any_constraints, any_space, wrong};
    use crate::testing::synthetic_robots::SYNTHETIC_ROBOTS;

    /// Plans by time with up to five operations of varied windows and parameters, and varied counts.
    pub(crate) fn any_timed_plan() -> impl Strategy<Value = CampaignPlan> {
        let ends = || (0.0..100.0f64, 0.0..100.0f64).prop_map(|(a, b)| (a.min(b), a.max(b)));
        let parameter =
            (ends(), any::<bool>(), any::<bool>(), any::<bool>()).prop_map(|((a, b), value, integer, fixed)| {
                Domain::Number {
                    low: if integer { libm::floor(a) - 50.0 } else { a - 50.0 },
                    high: if fixed {
                        if integer { libm::floor(a) - 50.0 } else { a - 50.0 }
                    } else {
                        b - 50.0 + f64::from(integer)
                    },
                    shape: if value { ChoiceKind::Value } else { ChoiceKind::Range },
                    integer,
                }
            });
        let point = (ends(), ends(), -9.0..9.0f64)
            .prop_map(|(x, y, z)| Domain::Point { low: [x.0, y.0, z], high: [x.1, y.1, z] });
        let items = |n: usize| (0..n).map(|item| format!("item {item}")).collect();
        let texts = (1usize..4).prop_map(move |n| Domain::Texts { texts: items(n) });
        let files = (1usize..3).prop_map(move |n| Domain::Files { files: items(n) });
        let domain = prop_oneof![4 => parameter, 1 => point, 1 => texts, 1 => files];
        let parameter = domain.prop_map(|domain| sesame_plan::testing::parameter("p", domain));
        let lengths = prop_oneof![3 => Just(None), 1 => (0.0..0.5f64, 0.001..1.5f64).prop_map(Some)];
        let operation = (ends(), proptest::collection::vec(parameter, 0..4), 0.0..=1.0f64, 0u32..5, lengths).prop_map(
            |((start, end), parameters, inclusion, kind, lengths)| {
                // What is varied follows from the parameters, and from the kind only whether there is a window.
                const BEFORE_START: OperationKind = OperationKind::Custom { moment: sesame_plan::Moment::BeforeStart };
                let kind = if kind == 0 {
                    BEFORE_START
                } else {
                    OperationKind::Latency { distribution: sesame_plan::Distribution::Fixed, drain: Drain::Finish }
                };
                let within = Span { start, end: end + 0.01 };
                // Shares of the permitted window, the least and what the greatest is more; none before the start.
                let lengths = lengths.filter(|_| kind != BEFORE_START).map(|(low, more)| {
                    let low = if low < 0.1 { 0.0 } else { low * within.length() };
                    Lengths { low, high: low + if more < 0.1 { 0.0 } else { more * within.length() } }
                });
                let lengths = lengths.filter(|lengths| lengths.high > 0.0);
                Operation {
                    within,
                    lengths,
                    inclusion,
                    ..sesame_plan::testing::operation_with("o", 0, kind, parameters)
                }
            },
        );
        let copies = prop_oneof![Just(Copies::Apart), Just(Copies::MayOverlap), Just(Copies::Once)];
        let plans = (proptest::collection::vec(operation, 1..6), 1u32..4, 0u32..6, 0.5..120.0f64, copies).prop_map(
            |(operations, min, more, end_after, copies)| {
                let mut plan =
                    SYNTHETIC_ROBOTS[0].plan(Search::new(sesame_plan::Strategy::Nsga2 { population: 7 }, 40));
                plan.campaign.operations = (0u32..).map(OperationId).take(operations.len()).collect();
                plan.campaign.count = Count { min, max: min + more };
                plan.campaign.end_after = end_after;
                plan.operations = operations;
                for operation in plan.operations.iter_mut().filter(|operation| operation.kind.is_offline()) {
                    operation.within = Span { start: 0.0, end: end_after };
                }
                plan.operations[0].within.start = plan.operations[0].within.start.min(end_after / 2.0);
                plan.campaign.copies = copies;
                plan
            },
        );
        plans.prop_filter("room for the least number of operations", |plan| TestSpace::from_plan(plan).is_ok())
    }

    /// Such plans, by time or by condition.
    pub(crate) fn any_plan() -> impl Strategy<Value = CampaignPlan> {
        let conditional =
            (any_timed_plan(), any_space(), any_constraints()).prop_map(|(mut plan, space, constraints)| {
                plan.operations[0].constraints = constraints;
                for operation in &mut plan.operations {
                    operation.lengths = operation.lengths.filter(|_| space.end.lengths(operation.lengths).is_some());
                }
                plan.campaign.activation = ActivationMode::Condition { space };
                plan
            });
        let grows = conditional.prop_filter("conditions to grow", |plan| TestSpace::from_plan(plan).is_ok());
        prop_oneof![any_timed_plan(), grows]
    }

    /// What of an activation by condition the plan does not permit.
    fn broken_condition(space: &ConditionSpace, constraints: &[Constraint], activation: &Activation) -> Option<String> {
        let (start, times) = match (activation, space.end) {
            (Activation::Condition { start, end, times }, ConditionEnd::Condition) => {
                if has_constant_part(end, &space.variables) {
                    return Some("a constant end".to_owned());
                }
                if let Some(wrong) = wrong(end, space, space.depth) {
                    return Some(wrong);
                }
                (start, times)
            }
            (Activation::ConditionFor { start, length, times }, ConditionEnd::Length { low, high }) => {
                if !(low..=high).contains(length) {
                    return Some(format!("length {length}"));
                }
                (start, times)
            }
            _ => return Some("kind of activation".to_owned()),
        };
        if *times != space.times || has_constant_part(start, &space.variables) {
            return Some(format!("{times} times from {start:?}"));
        }
        if !constraints.iter().all(|constraint| contains(start, constraint)) {
            return Some(format!("{start:?} lacks one of {constraints:?}"));
        }
        wrong(start, space, space.depth)
    }

    /// Two copies of one operation in a test that the plan does not permit together, if there are any.
    pub(crate) fn broken_copies(plan: &CampaignPlan, test: &Test) -> Option<String> {
        for (at, second) in test.operations.iter().enumerate() {
            for first in test.operations[..at].iter().filter(|first| first.operation == second.operation) {
                let offline = plan.operation(second.operation).kind.is_offline();
                let overlap = match (&first.activation, &second.activation) {
                    (Activation::Time { start: a, end: b }, Activation::Time { start: c, end: d }) => a < d && c < b,
                    _ => false,
                };
                let wrong = match plan.campaign.copies {
                    Copies::Apart => overlap || offline,
                    Copies::MayOverlap => false,
                    Copies::Once => true,
                };
                if wrong || first.operation_seed == second.operation_seed {
                    return Some(format!("{first:?} and {second:?}"));
                }
            }
        }
        None
    }

    /// What of the plan a test breaks, if anything: read off the plan itself.
    pub(crate) fn broken_rule(plan: &CampaignPlan, test: &Test) -> Option<String> {
        let count = plan.campaign.count;
        if !(count.min.max(1)..=count.max).contains(&u32::try_from(test.operations.len()).ok()?) {
            return Some(format!("{} operations", test.operations.len()));
        }
        if let Some(broken) = broken_copies(plan, test) {
            return Some(broken);
        }
        for applied in &test.operations {
            let operation = plan.operation(applied.operation);
            match (&applied.activation, &plan.campaign.activation) {
                (Activation::Offline, _) if operation.kind.is_offline() => {}
                (activation, _) if operation.kind.is_offline() => {
                    return Some(format!("{activation:?} of an offline operation"));
                }
                (&Activation::Time { start, end }, ActivationMode::Time) => {
                    let within = operation.within;
                    let room = within.end.min(plan.campaign.end_after) - within.start;
                    let longest = operation.lengths.map_or(room, |lengths| lengths.high.min(room));
                    if end - start < longest * 0.000_999
                        || operation.lengths.is_some_and(|lengths| !lengths.contain(end - start))
                    {
                        return Some(format!("window {start} to {end}"));
                    }
                    if !(within.start <= start && start < end && end <= within.end && start < plan.campaign.end_after) {
                        return Some(format!("window {start} to {end}"));
                    }
                }
                (&Activation::ConditionFor { length, .. }, _)
                    if operation.lengths.is_some_and(|lengths| !lengths.contain(length)) =>
                {
                    return Some(format!("length {length}"));
                }
                (activation, ActivationMode::Condition { space }) => {
                    let broken = broken_condition(space, &operation.constraints, activation);
                    if broken.is_some() {
                        return broken;
                    }
                }
                _ => return Some("kind of activation".to_owned()),
            }
            if applied.parameters.len() != operation.parameters.len() {
                return Some("number of parameters".to_owned());
            }
            for (choice, parameter) in applied.parameters.iter().zip(&operation.parameters) {
                let fits = match (&parameter.domain, choice) {
                    (Domain::Point { low, high }, Choice::Point { point }) => {
                        (0..3).all(|axis| (low[axis]..=high[axis]).contains(&point[axis]))
                    }
                    (Domain::Texts { texts: items } | Domain::Files { files: items }, Choice::Text { text }) => {
                        items.contains(text)
                    }
                    (Domain::Number { low: least, high: most, shape, integer }, choice) => {
                        let (low, high) = match (choice, shape) {
                            (Choice::Value { value }, ChoiceKind::Value) => (*value, *value),
                            (Choice::Range { low, high }, ChoiceKind::Range) => (*low, *high),
                            _ => return Some("shape of a parameter".to_owned()),
                        };
                        let whole = !integer || (libm::trunc(low) == low && libm::trunc(high) == high);
                        *least <= low && low <= high && high <= *most && whole
                    }
                    _ => false,
                };
                if !fits {
                    return Some(format!("choice {choice:?} of {parameter:?}"));
                }
            }
        }
        None
    }

    #[test]
    fn what_cannot_be_searched_is_refused_with_its_reason() {
        let plan = || SYNTHETIC_ROBOTS[0].plan(Search::new(sesame_plan::Strategy::Random, 10));
        let refusal = |plan: &CampaignPlan| TestSpace::from_plan(plan).map_err(|e| e.to_string()).unwrap_err();

        let mut ends_early = plan();
        ends_early.operations.iter_mut().for_each(|op| op.within = Span { start: 70.0, end: 80.0 });
        assert!(refusal(&ends_early).contains("no operation that may be active before its end"));

        let mut none_allowed = plan();
        none_allowed.campaign.count = Count { min: 0, max: 0 };
        assert!(refusal(&none_allowed).contains("permits 0 to 0 operations per test"));

        let mut no_number = plan();
        let offset = &mut no_number.operations[1].parameters[0];
        offset.domain = Domain::Number { low: 0.2, high: 0.8, shape: ChoiceKind::Range, integer: true };
        assert!(refusal(&no_number).contains("the range of `offset` in operation `jitter1` contains no whole number"));

        let mut unreachable = SYNTHETIC_ROBOTS[0]
            .plan_by_condition(Search::new(sesame_plan::Strategy::Random, 10), ConditionEnd::Condition);
        let bounds = Integers { lowest: 30, highest: 40 };
        unreachable.operations[1].constraints = vec![Constraint::Integer { bounds }];
        assert!(refusal(&unreachable).contains("no start condition of operation `jitter1`"));
    }

    #[test]
    fn operations_that_begin_after_the_campaign_are_left_out_and_others_are_clipped() {
        let mut plan = SYNTHETIC_ROBOTS[0].plan(Search::new(sesame_plan::Strategy::Random, 10));
        plan.operations[0].within = Span { start: 70.0, end: 80.0 };
        plan.operations[1].within = Span { start: 60.0, end: 90.0 };
        let test_space = TestSpace::from_plan(&plan).unwrap();
        let [only] = test_space.operations() else { panic!("{test_space:?}") };
        let ActivationSpace::Time(window) = only.activation else { panic!("{only:?}") };
        assert_eq!((only.operation, window.low, window.high), (OperationId(1), 60.0, 70.0));
    }
}
