//! The tests of a campaign: a line for each, or everything on one.

use std::collections::BTreeMap;
use std::path::PathBuf;

use serde::Serialize;

use sesame_analysis::confirmed::{ConfirmedTest, confirmed_test};
use sesame_base::observation::{Counters, MetricObservation, OperationEffect};
use sesame_base::robustness;
use sesame_base::test_number::TestNumber;
use sesame_gap::proportion::wilson;
use sesame_notation as notation;
use sesame_plan::stl::Formula;
use sesame_plan::{Activation, Bound, CampaignPlan, Choice, Metric, MetricId, MetricSource, Span, Task, Test};
use sesame_present::number;
use sesame_record::{
    EventKind, Judge, MetricValue, Origin, RecordError, Repetition, Repository, Tally, TestRecord, TestRow, Verdict,
    verdict, violation_spans,
};

use crate::facts::certificate::campaign::missed_by_test;
use crate::facts::certificate::test::{MonitorReport, monitors};
use crate::facts::readable;
use crate::facts::repetition::run_word;
use crate::facts::stacked::{Stacked, stacked_in};
use crate::facts::wording;

/// A line in the list of all tests.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct ListedTest {
    /// Its name.
    pub test: TestNumber,
    /// `reference`, `search`, or the name of a regression test.
    pub origin: String,
    /// The generation it belongs to.
    pub generation: Option<u32>,
    /// What a run is called in a campaign that repeats a test or observes, instead of searching; `None` for others.
    #[serde(skip)]
    pub(crate) repeats: Option<&'static str>,
    /// `completed`, `no_effect`, `unknown`, `crash` or `timeout`; if the environment broke it off, `launch_failed`,
    /// `disconnect` or `wrong_clock`.
    pub outcome: String,
    /// The equal test whose result stands for this one.
    pub duplicate_of: Option<TestNumber>,
    /// Whether it is on the front.
    pub front: bool,
    /// A value per metric of the plan, in the order of the list's `metrics`.
    pub values: Vec<MetricValue>,
    /// The value of each metric, by its name; `None` where there is none.
    pub measured: BTreeMap<String, Option<f64>>,
    /// Names of the requirements it violates.
    pub violates: Vec<String>,
    /// Hazards that monitors missed in it, as in `R1 by transport`.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub missed: Vec<String>,
    /// Its operations, as in `jitter_link0 ×2, lose_link0 (no effect)`.
    pub operations: String,
}

/// All tests of a campaign.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct TestList {
    /// Names of the plan's metrics.
    pub metrics: Vec<String>,
    /// Their units.
    pub units: Vec<Option<String>>,
    /// Whether the space has monitors.
    #[serde(skip)]
    pub(crate) monitors: bool,
    /// The tests, by number.
    pub tests: Vec<ListedTest>,
}

/// Everything on one test.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct TestReport {
    /// Its name.
    pub test: TestNumber,
    /// Its number.
    pub number: u32,
    /// `reference`, `search`, or the name of a regression test.
    pub origin: String,
    /// The generation it belongs to.
    pub generation: Option<u32>,
    /// What a run is called in a campaign that repeats a test or observes, instead of searching; `None` for others.
    #[serde(skip)]
    pub(crate) repeats: Option<&'static str>,
    /// The tests it was made of.
    pub parents: Vec<TestNumber>,
    /// The simulator's seed in its run.
    pub simulator_seed: u64,
    /// The equal test whose result stands for this one.
    pub duplicate_of: Option<TestNumber>,
    /// `completed`, `no_effect`, `unknown`, `crash` or `timeout`; if the environment broke it off, `launch_failed`,
    /// `disconnect` or `wrong_clock`.
    pub outcome: String,
    /// What is known of a crash or timeout.
    pub detail: Option<String>,
    /// Simulation time at which it ended, in seconds.
    pub end: f64,
    /// Messages the relay handled.
    pub messages: u64,
    /// Whether it is on the front.
    pub front: bool,
    /// Its operations.
    pub operations: Vec<OperationReport>,
    /// The operations whose copies acted at the same time.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub stacked: Vec<Stacked>,
    /// All metrics of the plan.
    pub metrics: Vec<MetricReport>,
    /// All requirements of the space.
    pub requirements: Vec<VerdictReport>,
    /// All monitors of the space, if it has any and their decisions were recorded.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub monitors: Vec<MonitorReport>,
    /// Findings of its fresh runs, if it was run again.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub confirmed: Option<ConfirmedTest>,
    /// Warnings for the user.
    pub warnings: Vec<String>,
    /// Notes of the session in which it ran, such as the last stderr lines of its worker.
    pub notes: Vec<String>,
    /// Its trace, or that of the test whose result stands for it.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub trace: Option<PathBuf>,
}

/// One operation of a test.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct OperationReport {
    /// The operation's name in the space.
    pub operation: String,
    /// Its kind in words.
    pub kind: String,
    /// The topic it disturbs, the first if they are several; `None` for one that acts on no messages.
    pub topic: Option<String>,
    /// The other topics that it disturbs at the same time.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub further_topics: Vec<String>,
    /// The node or the parameter it acts on, in the words of the language; `None` for one that acts on messages, before
    /// the start or after the end.
    pub resource: Option<String>,
    /// When it was to be active, in seconds; `None` where conditions decide that, and for one that acts before the
    /// start or after the end.
    pub planned: Option<Span>,
    /// What switched it on and off, in the words of the language; `None` where a planned window did, and for one that
    /// acts before the start or after the end.
    pub conditions: Option<String>,
    /// The only messages that it alters while it is active, as the list of a `test` block: `248..250, 12 on 2`. Left
    /// out where it alters all.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub messages: Option<String>,
    /// When it was seen to be active, in seconds; `None` where the run could not report it.
    pub observed: Option<Vec<Span>>,
    /// What the test chose.
    pub choices: Vec<ChoiceReport>,
    /// The seed of its random draws.
    pub operation_seed: u64,
    /// What it counted; `None` where the run could not report it.
    pub counters: Option<Counters>,
    /// Simulation time of its first effect, in seconds.
    pub first_touch: Option<f64>,
    /// Simulation time of its last effect, in seconds.
    pub last_touch: Option<f64>,
}

impl OperationReport {
    /// The topics that it disturbs, each once.
    pub fn topics(&self) -> impl Iterator<Item = &str> {
        self.topic.iter().chain(&self.further_topics).map(String::as_str)
    }

    /// What it acts on: topics, or a node or parameter; empty for one that acts before the start or after the end.
    pub fn target_in_words(&self) -> String {
        match &self.resource {
            Some(resource) => resource.clone(),
            None => self.topics().collect::<Vec<_>>().join(", "),
        }
    }
}

/// What a test chose for a parameter.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct ChoiceReport {
    /// The parameter.
    pub parameter: String,
    /// Its unit; `None` for probabilities and plain numbers.
    pub unit: Option<String>,
    /// The value, sub-range, point or text.
    pub choice: Choice,
    /// Parameter and choice in words, as in `offset 0.27…0.29 rad`.
    pub text: String,
}

/// A metric in one test.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct MetricReport {
    /// Its name.
    pub metric: String,
    /// Its unit; `None` for a plain number.
    pub unit: Option<String>,
    /// Its value.
    pub value: Option<f64>,
    /// The name of the constant that its value is, if the value was set and it is clear which constant is meant.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub constant: Option<String>,
    /// Whether the value was set; otherwise it is the default.
    pub set: bool,
    /// How often it changed.
    pub changes: usize,
    /// For a robustness: its signal over time, as change points `[seconds, value]`; the last one ends it and repeats
    /// the value before. The least value is the robustness (for an `eventually`, the greatest).
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub robustness: Vec<(f64, f64)>,
}

impl MetricReport {
    /// Its value in words.
    pub(crate) fn value_text(&self) -> String {
        let shown = MetricValue::whole(self.value, self.set);
        wording::value_text(shown, self.unit.as_deref(), self.constant.as_deref(), &[])
    }
}

/// A requirement in one test.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct VerdictReport {
    /// Its name.
    pub requirement: String,
    /// Its sentence.
    pub text: String,
    /// The metric it bounds.
    pub metric: String,
    /// The bound in words.
    pub bound: String,
    /// The verdict of the test: from its fresh runs if it was run again, else from its only run.
    pub verdict: Verdict,
    /// The verdict of its first run.
    pub first: Verdict,
    /// The verdicts of its fresh runs, if it was run again.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub fresh: Option<FreshVerdicts>,
    /// The metric's value in the first run, in words.
    pub value: String,
    /// When the metric's series was outside the bound in the first run, in seconds; for a robustness, when its signal
    /// was.
    pub outside: Vec<Span>,
    /// For a robustness: when its signal had the value of the whole in the first run, in seconds.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub decided_at: Option<f64>,
    /// Whether it is not known when the bound was violated, since the results were recorded without robustness signals.
    #[serde(skip)]
    pub(crate) unrecorded: bool,
}

/// The verdicts of a test's fresh runs on a requirement.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct FreshVerdicts {
    /// How many say what.
    #[serde(flatten)]
    pub tally: Tally,
    /// The 95 % Wilson interval of the probability that a run violates it; `None` if all are inconclusive.
    pub interval: Option<[f64; 2]>,
}

/// All tests of a campaign.
pub fn list(repository: &Repository) -> Result<TestList, RecordError> {
    let plan = repository.plan();
    let front = repository.latest_result_set()?.map_or_else(Vec::new, |set| set.members);
    let judge = repository.judge()?;
    let rows = repository.tests()?;
    let missed = missed_by_test(repository, &rows)?;
    let missed = |row: &TestRow| missed.get(&row.duplicate_of.unwrap_or(row.number)).cloned().unwrap_or_default();
    Ok(TestList {
        monitors: !plan.monitors.is_empty(),
        metrics: plan.metrics.iter().map(|metric| metric.name.clone()).collect(),
        units: plan.metrics.iter().map(|metric| metric.unit.clone()).collect(),
        tests: rows
            .iter()
            .map(|row| ListedTest {
                missed: missed(row),
                ..listed(plan, repository.task(), &judge, row, front.contains(&row.number))
            })
            .collect(),
    })
}

fn listed(plan: &CampaignPlan, task: &Task, judge: &Judge<'_>, row: &TestRow, front: bool) -> ListedTest {
    ListedTest {
        test: TestNumber(row.number),
        origin: origin(plan, row.origin),
        generation: row.generation,
        repeats: run_word(plan, task).filter(|_| row.origin == Origin::Search),
        outcome: row.outcome.word().to_owned(),
        duplicate_of: row.duplicate_of.map(TestNumber),
        front,
        values: row.values.clone(),
        measured: plan
            .metrics
            .iter()
            .zip(&row.values)
            .map(|(metric, shown)| (metric.name.clone(), shown.value))
            .collect(),
        violates: wording::violated(plan, judge, row),
        missed: Vec::new(),
        operations: wording::operations(plan, row),
    }
}

fn origin(plan: &CampaignPlan, origin: Origin) -> String {
    match origin {
        Origin::Known(id) => plan.test(id).name.clone(),
        Origin::Reference | Origin::Search => origin.word().to_owned(),
    }
}

/// Everything on the test that a user calls `T158`, `158`, `reference`, or by the name of a regression test.
pub fn show(repository: &Repository, name: &str) -> Result<TestReport, RecordError> {
    let record = repository.test(repository.find(name)?)?;
    let front = repository.latest_result_set()?.is_some_and(|set| set.members.contains(&record.number));
    let ran = record.duplicate_of.unwrap_or(record.number);
    let mut report = report_on(repository.plan(), repository.task(), &record, repository.judge()?.runs(ran), front);
    let notes = repository.events()?.into_iter();
    let notes = notes.filter(|event| event.kind == EventKind::Session && event.test == Some(ran));
    report.notes = notes.map(|event| event.text).collect();
    report.confirmed = confirmed_test(repository, record.number, front)?;
    report.trace = repository.trace(record.number, record.duplicate_of);
    Ok(report)
}

/// Everything on a test, from its record and its fresh runs, without the findings of fresh runs, notes and trace.
pub(crate) fn report_on(
    plan: &CampaignPlan,
    task: &Task,
    record: &TestRecord,
    fresh: &[Repetition],
    front: bool,
) -> TestReport {
    let observation = &record.observation;
    TestReport {
        test: TestNumber(record.number),
        number: record.number,
        origin: origin(plan, record.origin),
        generation: record.generation,
        repeats: run_word(plan, task).filter(|_| record.origin == Origin::Search),
        parents: record.parents.iter().copied().map(TestNumber).collect(),
        simulator_seed: record.simulator_seed,
        duplicate_of: record.duplicate_of.map(TestNumber),
        outcome: observation.outcome.word().to_owned(),
        detail: observation.outcome.detail(),
        end: observation.end,
        messages: observation.messages,
        front,
        operations: operations(plan, record),
        stacked: stacked_in(plan, record),
        metrics: (0..)
            .map(MetricId)
            .zip(&plan.metrics)
            .map(|(id, metric)| {
                let shown = observation.metrics.get(id.index());
                let value = shown.and_then(|shown| shown.value);
                let set = shown.is_some_and(|shown| shown.set);
                let constant = wording::constant_of(plan, id, MetricValue::whole(value, set));
                MetricReport {
                    metric: metric.name.clone(),
                    unit: metric.unit.clone(),
                    value,
                    constant: constant.map(str::to_owned),
                    set,
                    changes: shown.map_or(0, |shown| shown.series.len()),
                    robustness: shown.map_or_else(Vec::new, |shown| shown.robustness.clone()),
                }
            })
            .collect(),
        requirements: verdicts(plan, record, fresh),
        monitors: monitors(plan, observation),
        confirmed: None,
        warnings: observation.warnings.iter().map(|text| readable::sentence(plan, text)).collect(),
        notes: Vec::new(),
        trace: None,
    }
}

/// The operations that had an effect in a test, or whose effect is unknown, and what they did.
pub(crate) fn acting(plan: &CampaignPlan, record: &TestRecord) -> Vec<OperationReport> {
    let acts = |used: &OperationReport| used.counters.is_none_or(|counters| counters.any_effect());
    operations(plan, record).into_iter().filter(acts).collect()
}

/// The operations of a test, and what they did.
pub(crate) fn operations(plan: &CampaignPlan, record: &TestRecord) -> Vec<OperationReport> {
    reports(plan, &record.test, &record.observation.operations)
}

/// The operations of a test that has not been run.
pub fn operations_of(plan: &CampaignPlan, test: &Test) -> Vec<OperationReport> {
    reports(plan, test, &[])
}

fn reports(plan: &CampaignPlan, test: &Test, effects: &[OperationEffect]) -> Vec<OperationReport> {
    let reports = test.operations.iter().enumerate().map(|(position, used)| {
        let operation = plan.operation(used.operation);
        let effect = effects.get(position);
        let mut topics = operation.topics().map(|topic| plan.topic(topic).name.clone());
        let (planned, conditions) = match used.activation {
            Activation::Time { start, end } => (Some(Span { start, end }), None),
            Activation::Condition { .. } | Activation::ConditionFor { .. } => {
                (None, Some(notation::activation(plan, used)))
            }
            Activation::Offline => (None, None),
        };
        OperationReport {
            operation: operation.name.clone(),
            kind: operation.kind.words().to_owned(),
            topic: topics.next(),
            further_topics: topics.collect(),
            resource: notation::resource(plan, operation),
            planned,
            conditions,
            messages: used.messages.as_ref().map(notation::messages),
            observed: effect.map(|effect| effect.intervals.clone()),
            choices: operation
                .parameters
                .iter()
                .zip(&used.parameters)
                .map(|(parameter, choice)| ChoiceReport {
                    parameter: parameter.name.clone(),
                    unit: parameter.unit.clone(),
                    choice: choice.clone(),
                    text: number::choice(&operation.kind, parameter, choice),
                })
                .collect(),
            operation_seed: used.operation_seed,
            counters: effect.map(|effect| effect.counters),
            first_touch: effect.and_then(|effect| effect.first_touch),
            last_touch: effect.and_then(|effect| effect.last_touch),
        }
    });
    reports.collect()
}

fn verdicts(plan: &CampaignPlan, record: &TestRecord, fresh: &[Repetition]) -> Vec<VerdictReport> {
    let observation = &record.observation;
    let reports = plan.requirements.iter().map(|requirement| {
        let metric = plan.metric(requirement.metric);
        let shown = observation.metrics.get(requirement.metric.index());
        let value = observation.value(requirement.metric);
        let first = verdict(requirement.bound, &observation.outcome, value);
        let tally = Tally::of(fresh.iter().map(|run| run.verdict(requirement)));
        let interval = wilson(tally.violated, tally.conclusive());
        let outside =
            shown.map_or_else(Vec::new, |shown| violated_when(metric, shown, requirement.bound, observation.end));
        VerdictReport {
            requirement: requirement.name.clone(),
            text: requirement.text.clone(),
            metric: metric.name.clone(),
            bound: wording::bound_of(plan, requirement),
            verdict: tally.verdict(first),
            first,
            fresh: (!fresh.is_empty()).then_some(FreshVerdicts { tally, interval }),
            value: wording::value_of(plan, requirement.metric, value, &[requirement.bound]),
            unrecorded: first == Verdict::Violated && outside.is_empty() && formula_of(metric).is_some(),
            outside,
            decided_at: shown.and_then(|shown| decided_at(metric, shown)),
        }
    });
    reports.collect()
}

/// The formula of which a metric is the robustness.
fn formula_of(metric: &Metric) -> Option<&Formula> {
    match &metric.source {
        MetricSource::Robustness { robustness } => Some(&robustness.formula),
        _ => None,
    }
}

/// When a metric was outside a bound: by its series, or by the signal of a robustness.
pub(crate) fn violated_when(metric: &Metric, shown: &MetricObservation, bound: Bound, end: f64) -> Vec<Span> {
    match formula_of(metric) {
        Some(formula) => {
            let lost = |value| robustness::lost(&shown.robustness, robustness::quantifier(formula), bound, value);
            shown.value.filter(|_| shown.set).map_or_else(Vec::new, lost)
        }
        None => violation_spans(&shown.series, bound, end),
    }
}

/// When the signal of a robustness had the value of the whole; `None` for other metrics, and where none was recorded.
pub(crate) fn decided_at(metric: &Metric, shown: &MetricObservation) -> Option<f64> {
    robustness::decided_at(&shown.robustness, robustness::quantifier(formula_of(metric)?))
}
