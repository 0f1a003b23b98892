//! From the tests that a campaign performed to records of the results repository.

use std::collections::BTreeMap;
use std::mem::discriminant;
use std::path::Path;

use sesame_base::observation::{MetricObservation, Observation, OperationEffect, Outcome, WallTime};
use sesame_plan::{CampaignPlan, Choice, MetricId, OperationId, Span, TestOperation, condition as plan_condition};
use sesame_record::{LeftOutOperations, Origin, RecordError, Recorder, ResultSet, SplitOperation, Status, TestRecord};

use crate::extents;
use crate::notes::{Counted, Kind, Notes};
use crate::original::{Activation, Campaign, Condition, Domain, Operand, Operation, OperationKind, Original, Test};
use crate::parts::{Effect, Part, called, matching};
use crate::writer::Mapped;
use crate::xml::{cleaned, printable};

/// How much was recorded.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Recorded {
    /// Tests.
    pub tests: usize,
    /// Sets of them.
    pub sets: usize,
}

/// One campaign of a file with its plan.
struct Importer<'o> {
    original: &'o Original,
    mapped: &'o Mapped,
    plan: &'o CampaignPlan,
    metrics: BTreeMap<&'o str, MetricId>,
    operations: BTreeMap<&'o str, OperationId>,
}

/// Records what a campaign performed into a folder that holds no results.
pub(crate) fn record(
    original: &Original,
    mapped: &Mapped,
    at: usize,
    plan: &CampaignPlan,
    folder: &Path,
    notes: &mut Notes,
) -> Result<Recorded, RecordError> {
    let campaign = &original.campaigns[at];
    let plan = &with_objectives(plan, mapped.objectives.get(&at));
    let metrics = (0..).zip(&plan.metrics).map(|(id, metric)| (metric.name.as_str(), MetricId(id))).collect();
    let operations =
        (0..).zip(&plan.operations).map(|(id, operation)| (operation.name.as_str(), OperationId(id))).collect();
    let importer = Importer { original, mapped, plan, metrics, operations };
    let mut recorder = Recorder::create(folder, plan, plan.campaign.seed, 0)?;
    let mut beside = Beside::default();
    // In one transaction: to wait for the disk after each test would take longer than everything else.
    let tests = campaign.tests.iter().enumerate();
    recorder.commit_all(tests.map(|(index, test)| importer.test(at, index, test, &mut beside, notes)))?;
    recorder.put_split_operations(&beside.split)?;
    recorder.put_left_out_operations(&beside.left_out)?;
    recorder.put_original_extents(&extents::original(mapped, plan, &importer.operations))?;
    let names: Vec<(u32, String)> =
        campaign.tests.iter().enumerate().map(|(index, test)| (number_of(index), printable(&test.name))).collect();
    recorder.put_original_names(names.iter().map(|(number, name)| (*number, name.as_str())))?;
    let sets = importer.sets(at, campaign, notes);
    for set in &sets {
        recorder.put_result_set(set)?;
    }
    recorder.finish("it was imported")?;
    Ok(Recorded { tests: campaign.tests.len(), sets: sets.len() })
}

/// What is recorded in addition to tests, for those that are not in the results as they are in the file.
#[derive(Debug, Default)]
struct Beside {
    split: Vec<SplitOperation>,
    left_out: Vec<LeftOutOperations>,
}

/// The plan of results: that of the campaign in the space, with objectives where only the original has them.
fn with_objectives(plan: &CampaignPlan, names: Option<&Vec<String>>) -> CampaignPlan {
    let mut plan = plan.clone();
    let Some(names) = names else { return plan };
    let position = |name: &String| plan.metrics.iter().position(|metric| metric.name == *name);
    let ids = names.iter().filter_map(position).filter_map(|at| u32::try_from(at).ok().map(MetricId));
    plan.campaign.objectives = ids.collect();
    plan
}

/// The number of a performed test: T0 is the reference run, which the original never made.
fn number_of(index: usize) -> u32 {
    u32::try_from(index + 1).expect("a file holds fewer than 2^32 tests")
}

impl Importer<'_> {
    fn test(&self, campaign: usize, index: usize, test: &Test, beside: &mut Beside, notes: &mut Notes) -> TestRecord {
        let mut operations = Vec::new();
        let mut effects = Vec::new();
        let mut left_out = LeftOutOperations { test: number_of(index), operations: 0 };
        let mut reasons: Vec<String> = Vec::new();
        for operation in &test.operations {
            let first = operations.len();
            let found = self.operations(operation, notes).unwrap_or_else(|why| {
                left_out.operations += 1;
                if !reasons.contains(&why) {
                    reasons.push(why);
                }
                Vec::new()
            });
            for (held, effect) in found {
                let position = operations.len();
                if position > first {
                    beside.split.push(SplitOperation { test: number_of(index), position, first });
                }
                operations.push(held);
                effects.push(effect);
            }
        }
        let mut warnings = Vec::new();
        if left_out.operations > 0 {
            beside.left_out.push(left_out);
            warnings.push(left_out.warning(&reasons));
        }
        let metrics = self.values(test, notes);
        let mut parents = Vec::new();
        for &parent in &test.parents {
            match self.original.test(parent) {
                Some((of, at)) if of == campaign => parents.push(number_of(at)),
                _ => notes.say(Kind::LeftOut, "parents of tests that are in no list of the same campaign"),
            }
        }
        TestRecord {
            number: number_of(index),
            origin: Origin::Search,
            generation: None,
            parents,
            test: sesame_plan::Test { operations },
            simulator_seed: 0,
            duplicate_of: None,
            observation: Observation {
                outcome: Outcome::Unknown,
                end: self.plan.campaign.end_after,
                operations: effects,
                unheard: Vec::new(),
                unreached: Vec::new(),
                traffic: Vec::new(),
                course: None,
                altered: None,
                metrics,
                monitors: Vec::new(),
                messages: 0,
                warnings,
                wall: WallTime::default(),
            },
        }
    }

    /// The values that were measured in a test, by metric of the plan.
    fn values(&self, test: &Test, notes: &mut Notes) -> Vec<MetricObservation> {
        let mut metrics = vec![MetricObservation::default(); self.plan.metrics.len()];
        let mut measured = vec![false; metrics.len()];
        notes.lose(Counted::Value, "metrics of performed tests that have no value", test.without_value);
        for value in &test.values {
            let Some(at) = self.original.measured(value) else {
                notes.lose(Counted::Value, "values of performed tests that are of no metric of the file", 1);
                continue;
            };
            let name = self.mapped.metrics[at].as_deref();
            let Some(&id) = name.and_then(|name| self.metrics.get(name)) else {
                let name = printable(&self.original.metrics[at].name);
                notes.lose(Counted::Value, format!("values of `{name}`, which is not a metric here"), 1);
                continue;
            };
            let name = &self.plan.metric(id).name;
            if !value.value.is_finite() {
                notes.lose(Counted::Value, format!("values of `{name}` that are not finite numbers"), 1);
                continue;
            }
            if std::mem::replace(&mut measured[id.index()], true) {
                notes.lose(Counted::Value, format!("values of `{name}` that a later one of the same test replaces"), 1);
            }
            if self.original.is_named_only(value) {
                let text = format!("values that refer to no metric are of `{name}`, which has their name");
                notes.say(Kind::Mapped, text);
            }
            let default = self.original.metrics[at].default;
            metrics[id.index()] = MetricObservation::whole(Some(value.value), default != Some(value.value), Vec::new());
        }
        metrics
    }

    /// What an operation of a test became: one for each part that can be said, or why there is none.
    fn operations(
        &self,
        operation: &Operation,
        notes: &mut Notes,
    ) -> Result<Vec<(TestOperation, OperationEffect)>, String> {
        let at = self.mapped.holders.find(self.original, operation);
        let Some(at) = at.filter(|&at| !self.mapped.parts[at].is_empty()) else {
            let text = "operations of performed tests whose operation of the space was left out";
            notes.lose(Counted::Operation, text, 1);
            let called = called(operation);
            return Err(format!("{called} of the space was left out"));
        };
        let template = &self.mapped.holders.operations[at];
        let mut held = Vec::new();
        let mut left_out = Vec::new();
        for part in &self.mapped.parts[at] {
            match self.part(operation, template, part, notes) {
                Ok(done) => held.push(done),
                Err(why) => left_out.push((&part.name, why)),
            }
        }
        let text = |name: &str, why: &str| format!("`{name}` in performed tests where {why}");
        if held.is_empty() {
            // As one operation, whatever number of parts it has.
            let (name, why) = left_out.into_iter().next().expect("an operation has at least one part");
            notes.lose(Counted::Operation, text(name, &why), 1);
            return Err(format!("`{name}`: {why}"));
        }
        for (name, why) in left_out {
            notes.say(Kind::LeftOut, text(name, &why));
        }
        Ok(held)
    }

    fn part(
        &self,
        operation: &Operation,
        template: &Operation,
        part: &Part,
        notes: &mut Notes,
    ) -> Result<(TestOperation, OperationEffect), String> {
        let id = *self.operations.get(part.name.as_str()).ok_or("the campaign does not use it")?;
        let parameters = choices(operation, template, &part.effect)?;
        let offline = matches!(part.effect, Effect::Custom { offline: true, .. });
        let (activation, planned) =
            if offline { (sesame_plan::Activation::Offline, None) } else { self.activation(operation, notes)? };
        if offline && !matches!(operation.activation, Activation::Missing) {
            let text = format!("when `{}` was active in performed tests: it acts before the start here", part.name);
            notes.say(Kind::LeftOut, text);
        }
        // Activity by time was never measured: the original switched by the clock alone.
        let active = operation.recorded.filter(|_| !offline).or(planned);
        // An activation of length 0 was one: it has a point, as it had for the original.
        let over = self.plan.campaign.end_after;
        let intervals = active.and_then(|(start, end)| {
            let whole = Span { start, end };
            let cut = Span { start: start.max(0.0), end: end.min(over) };
            if cut != whole {
                let text = format!("activity of `{}` in performed tests is cut at the end of the test", part.name);
                notes.say(Kind::Changed, text);
            }
            (cut.start <= cut.end).then_some(cut)
        });
        let operation_seed = operation.seed.cast_unsigned();
        let test_operation = TestOperation { operation: id, activation, parameters, operation_seed, messages: None };
        let effect = OperationEffect { intervals: intervals.into_iter().collect(), ..OperationEffect::default() };
        Ok((test_operation, effect))
    }

    /// When an operation was to be active, and the window if time decided it.
    fn activation(
        &self,
        operation: &Operation,
        notes: &mut Notes,
    ) -> Result<(sesame_plan::Activation, Option<(f64, f64)>), String> {
        let condition = |condition: &Option<Condition>| match condition {
            Some(condition) => self.condition(condition).map(Some),
            None => Ok(None),
        };
        match &operation.activation {
            Activation::Time(start, end) => {
                let (first, last) = (start.min(*end), start.max(*end));
                // Nothing happens before a test begins.
                let (start, end) = (first.max(0.0), last.max(0.0));
                if first < 0.0 {
                    let called = called(operation);
                    notes.say(Kind::Changed, format!("{called} in performed tests: windows begin at 0s, not before"));
                }
                Ok((sesame_plan::Activation::Time { start, end }, Some((start, end))))
            }
            Activation::Condition(start, end) => match (condition(start)?, condition(end)?) {
                (Some(start), Some(end)) => Ok((sesame_plan::Activation::Condition { start, end, times: 1 }, None)),
                (Some(start), None) => {
                    let length = self.plan.campaign.end_after;
                    Ok((sesame_plan::Activation::ConditionFor { start, length, times: 1 }, None))
                }
                (None, _) => Err("nothing starts it".to_owned()),
            },
            Activation::ConditionFor(start, length) => match condition(start)? {
                Some(start) => {
                    // Times are whole nanoseconds.
                    let length = length.max(1e-9);
                    Ok((sesame_plan::Activation::ConditionFor { start, length, times: 1 }, None))
                }
                None => Err("nothing starts it".to_owned()),
            },
            Activation::Missing => Err("it does not say when it is active".to_owned()),
        }
    }

    fn condition(&self, condition: &Condition) -> Result<plan_condition::Condition, String> {
        let metric = |reference| {
            let name = self.original.metric(reference).and_then(|at| self.mapped.metrics[at].as_deref());
            let id = name.and_then(|name| self.metrics.get(name)).copied();
            id.ok_or_else(|| "its condition compares something that is not a metric".to_owned())
        };
        Ok(match condition {
            Condition::Compare(left, by, right) => plan_condition::Condition::Compare {
                left: plan_condition::Operand::Variable(metric(*left)?),
                by: (*by).into(),
                right: match *right {
                    Operand::Metric(right) => plan_condition::Operand::Variable(metric(right)?),
                    Operand::Integer(value) => plan_condition::Operand::Number(value as f64),
                },
            },
            Condition::And(a, b) => {
                plan_condition::Condition::And(Box::new(self.condition(a)?), Box::new(self.condition(b)?))
            }
            Condition::Or(a, b) => {
                plan_condition::Condition::Or(Box::new(self.condition(a)?), Box::new(self.condition(b)?))
            }
        })
    }

    /// The sets of a campaign, under names of their own, their generations in the order of evaluations.
    fn sets(&self, campaign: usize, of: &Campaign, notes: &mut Notes) -> Vec<ResultSet> {
        let evaluations = |name: &str| name.rsplit('-').next().and_then(|last| last.parse::<u64>().ok());
        let mut generations: Vec<u64> = of.sets.iter().filter_map(|set| evaluations(&set.name)).collect();
        generations.sort_unstable();
        generations.dedup();
        let mut taken: BTreeMap<String, usize> = BTreeMap::new();
        let mut sets = Vec::new();
        for set in &of.sets {
            let plain = printable(&set.name);
            let plain = if plain.is_empty() { "set".to_owned() } else { plain };
            let times = taken.entry(plain.clone()).or_default();
            *times += 1;
            let name = if *times == 1 { plain } else { format!("{plain}-{times}") };
            let mut members = Vec::new();
            for &member in &set.members {
                match self.original.test(member) {
                    Some((at, index)) if at == campaign => members.push(number_of(index)),
                    _ => notes.say(Kind::LeftOut, "members of result sets that are not tests of the same campaign"),
                }
            }
            let generation =
                evaluations(&set.name).and_then(|evaluations| generations.binary_search(&evaluations).ok());
            sets.push(ResultSet {
                name,
                generation: generation.and_then(|generation| u32::try_from(generation).ok()),
                status: if set.last { Status::Final } else { Status::Intermediate },
                members,
            });
        }
        sets
    }
}

/// What a test chose for the parameters of a part.
fn choices(operation: &Operation, template: &Operation, effect: &Effect) -> Result<Vec<Choice>, String> {
    let domain = |at: usize| {
        let (
            OperationKind::RandomValue { values: held, .. } | OperationKind::Custom { parameters: held },
            OperationKind::RandomValue { values: permitted, .. } | OperationKind::Custom { parameters: permitted },
        ) = (&operation.kind, &template.kind)
        else {
            return Err("it does something else".to_owned());
        };
        matching(held, permitted, at).map(|set| &set.domain).ok_or_else(|| "it has no value of its own".to_owned())
    };
    Ok(match (effect, &operation.kind) {
        (&Effect::Value { set, .. }, _) => match *domain(set)? {
            Domain::Reals(low, high) => vec![Choice::Range { low: low.min(high), high: low.max(high) }],
            Domain::Integers(low, high) => {
                vec![Choice::Range { low: low.min(high) as f64, high: low.max(high) as f64 }]
            }
            _ => return Err("it does not choose numbers".to_owned()),
        },
        // What the original used of a range is its lower end.
        (Effect::Loss, OperationKind::PacketLoss { keep }) => vec![Choice::Value { value: 1.0 - keep.0.min(keep.1) }],
        (Effect::Delay { randomised: false }, OperationKind::Latency { delay, .. }) => {
            vec![Choice::Value { value: delay.0.min(delay.1) }]
        }
        (Effect::Delay { randomised: true }, OperationKind::Latency { delay, .. }) => {
            vec![Choice::Range { low: delay.0.min(delay.1), high: delay.0.max(delay.1) }]
        }
        (Effect::Custom { parameters, .. }, _) => {
            let mut chosen = Vec::new();
            for (name, at) in parameters {
                let held = domain(*at)?;
                if !is_permitted(template, *at, held) {
                    return Err(format!("what it chooses for `{name}` is of another kind than its template permits"));
                }
                chosen.push(match held {
                    Domain::Reals(low, high) => Choice::Value { value: low.min(*high) },
                    Domain::Integers(low, high) => Choice::Value { value: *low.min(high) as f64 },
                    Domain::Points(low, _) => Choice::Point { point: *low },
                    Domain::Texts(texts) => match texts.first() {
                        Some(text) => Choice::Text { text: cleaned(text) },
                        None => return Err("it chooses no text".to_owned()),
                    },
                    Domain::Other(_) => {
                        return Err("it chooses a kind of value that the original never read".to_owned());
                    }
                });
            }
            chosen
        }
        (Effect::Blackhole, _) => Vec::new(),
        (Effect::Loss | Effect::Delay { .. }, _) => return Err("it does something else".to_owned()),
    })
}

/// Whether what an operation chooses from a value set is of the kind that its template has at this position.
fn is_permitted(template: &Operation, at: usize, held: &Domain) -> bool {
    let OperationKind::Custom { parameters } = &template.kind else { return false };
    parameters.get(at).is_some_and(|set| discriminant(&set.domain) == discriminant(held))
}
