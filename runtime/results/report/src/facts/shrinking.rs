//! How a test was shrunk: the test before and after, and every test that was tried on the way.

mod triggers;

use std::collections::BTreeMap;

use serde::Serialize;

use sesame_base::observation::{ALTERED_LISTED, AlteredMessage, AlteredMessages, Course};
use sesame_base::test_number::TestNumber;
use sesame_notation as notation;
use sesame_plan::{
    Activation, CampaignPlan, Choice, Dimension, Failing, MetricId, RequirementId, Shrinking as Task, Test,
    TestOperation,
};
use sesame_present::number::{self, fixed};
use sesame_record::{MetricValue, Origin, RecordError, Repository, TestRow, fails};
use sesame_search::shrink::{MessagesEnd, Phase, Shown, Shrink, ShrinkEach, Threshold, strength};
use sesame_search::{Strategy as _, sspr};

use crate::export::shrunk_block;
use crate::facts::show::{OperationReport, operations as operation_reports};
use crate::facts::wording::{bounds_on, counted, operations, value_of};

pub use triggers::ShrinkTrigger;
use triggers::triggers;

/// How a test was shrunk.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Shrinking {
    /// The test's name in the results that it was found in.
    pub test: String,
    /// How it fails: `violates R1 and R3`, `crashes`, `times out`.
    pub fails: String,
    /// The number of runs in which a test had to fail.
    pub runs: u32,
    /// Whether no single step shrinks the smallest test further: all of them were tried.
    pub minimal: bool,
    /// The original test in these results; `None` if it has not run yet.
    pub before: Option<TestSize>,
    /// The smallest test that still fails; `None` if not even the original failed again.
    pub after: Option<TestSize>,
    /// The operations of the smallest test.
    pub operations: Vec<OperationReport>,
    /// How far the test was reduced to single messages, if that was asked for and there is a smallest test. Left out
    /// otherwise.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub messages: Option<ShrunkMessages>,
    /// When its operations have to act, if that was asked for. Left out otherwise.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub when: Option<Vec<ShrinkTrigger>>,
    /// Where parameters of the smallest test begin to matter, before it was reduced to single messages. Parameters that
    /// may have their mildest values have no threshold.
    pub thresholds: Vec<ShrinkThreshold>,
    /// The smallest test as a `test` block of the language.
    pub block: Option<String>,
    /// Every test that was tried, in the order in which they were asked for.
    pub steps: Vec<ShrinkStep>,
}

/// Where a parameter begins to matter: one step further towards its mildest value, the smallest test does not fail.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct ShrinkThreshold {
    /// The operation.
    pub operation: String,
    /// The position of the operation in the smallest test, from 0.
    pub position: usize,
    /// The parameter.
    pub parameter: String,
    /// Its unit; `null` for probabilities and plain numbers.
    pub unit: Option<String>,
    /// The mildest choice that was seen to fail.
    pub fails: Choice,
    /// The strongest choice that was seen not to fail.
    pub passes: Choice,
    /// `fails` in words.
    pub fails_text: String,
    /// `passes` in words.
    pub passes_text: String,
}

/// How far a test was reduced to single messages.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct ShrunkMessages {
    /// Whether it was; otherwise `text` says why not.
    pub reduced: bool,
    /// What the smallest test alters, as in ``three `odom` messages, at 12.40, 12.45 and 12.50 s``, or why the test was
    /// not reduced to messages.
    pub text: String,
    /// The messages that the smallest test alters, by operation; none if it was not reduced to messages.
    pub left: Vec<LeftMessage>,
}

/// A message that an operation of the smallest test alters.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct LeftMessage {
    /// The operation.
    pub operation: String,
    /// The position of the operation in the test, from 0.
    pub position: usize,
    /// The topic of the message.
    pub topic: String,
    /// The name of the message on the wire.
    pub path: String,
    /// The number of the message among those published there, from 0.
    pub number: u64,
    /// When the operation altered it, in seconds of simulation time; `null` if no run was left to tell.
    pub time: Option<f64>,
}

/// How large a test is.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct TestSize {
    /// Its name in these results.
    pub test: TestNumber,
    /// Its number in these results.
    pub number: u32,
    /// How many operations it has.
    pub operations: usize,
    /// The same in words.
    pub operations_text: String,
    /// How long its operations were active in total, in seconds of simulation time, as observed; `None` where the run
    /// could not report it.
    pub active_time: Option<f64>,
    /// P1 of its run: the mean of its parameters as shares of what is permitted.
    pub intensity: Option<f64>,
    /// How strong its operations are in total, each from 0 to 1 ([`sesame_search::shrink::strength`]).
    pub strength: f64,
    /// The values in its run of the metrics that its failure concerns.
    pub values: Vec<NamedValue>,
}

/// A test that was tried.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct ShrinkStep {
    /// Its name in these results; with several runs, the name of the first.
    pub test: TestNumber,
    /// The test that it was made of.
    pub base: Option<TestNumber>,
    /// The phase of the shrink that tried it.
    pub tried: String,
    /// The difference from the test that it was made of.
    pub change: String,
    /// In how many of its runs it failed.
    pub failed: u32,
    /// Whether it was accepted: the next tests were made of it.
    pub kept: bool,
    /// The values in its first run of the metrics that its failure concerns.
    pub values: Vec<NamedValue>,
}

/// The value of a metric in a run.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct NamedValue {
    /// The metric.
    pub metric: String,
    /// Its value.
    pub value: Option<f64>,
    /// The value with its unit, in words.
    #[serde(skip)]
    pub(crate) text: String,
}

impl Shrinking {
    /// Numbers of the original and of the smallest test, if there is a smaller one.
    pub(crate) fn ends(&self) -> Vec<u32> {
        let mut ends: Vec<u32> = self.before.iter().chain(&self.after).map(|size| size.number).collect();
        ends.dedup();
        ends
    }
}

/// How each test of a shrink was shrunk; none if these results are of no shrink. The search is replayed over the
/// recorded tests.
pub(crate) fn shrinkings(repository: &Repository, rows: &[TestRow]) -> Result<Vec<Shrinking>, RecordError> {
    let (plan, tasks) = (repository.plan(), repository.task().shrinkings());
    if tasks.is_empty() {
        return Ok(Vec::new());
    }
    let mut search = ShrinkEach::new(plan, tasks);
    let rows: BTreeMap<u32, &TestRow> = rows.iter().map(|row| (row.number, row)).collect();
    let mut altered = repository.altered_messages(&(0..=u32::MAX))?;
    let mut number = 0;
    loop {
        let asked = search.ask();
        let failing = &tasks[search.current()].failing;
        let mut results = Vec::with_capacity(asked.len());
        for candidate in &asked {
            number += 1;
            let Some(row) = rows.get(&number).filter(|row| row.test == candidate.test) else { break };
            let failed = fails(plan, failing, &row.outcome, |id| row.value(id));
            results.push(Shown { number, failed, altered: altered.remove(&number) });
        }
        // Only whole generations of an unfinished run count.
        if asked.is_empty() || results.len() < asked.len() {
            break;
        }
        search.learn(&results);
    }
    let describes = tasks.iter().any(|task| task.when);
    let course = if describes { course(repository, rows.values())? } else { Course::default() };
    let each = tasks.iter().zip(search.each());
    each.map(|(task, search)| shrinking(repository, &rows, &course, task, search)).collect()
}

/// What happened in the undisturbed run; nothing, if there is none.
fn course<'r>(repository: &Repository, mut rows: impl Iterator<Item = &'r &'r TestRow>) -> Result<Course, RecordError> {
    let reference = rows.find(|row| row.origin == Origin::Reference);
    let record = reference.map(|row| repository.test(row.number)).transpose()?;
    Ok(record.and_then(|record| record.observation.course).unwrap_or_default())
}

/// How one test was shrunk.
fn shrinking(
    repository: &Repository,
    rows: &BTreeMap<u32, &TestRow>,
    course: &Course,
    task: &Task,
    search: &Shrink,
) -> Result<Shrinking, RecordError> {
    let plan = repository.plan();
    let (name, failing) = (&task.name, &task.failing);
    let metrics = metrics(plan, failing);
    let kept = search.accepted();
    let steps = search.tried().iter().enumerate().filter_map(|(at, tried)| {
        let row = rows.get(&tried.number)?;
        Some(ShrinkStep {
            test: TestNumber(tried.number),
            base: tried.base.map(|base| TestNumber(search.tried()[base].number)),
            tried: tried.phase.words().to_owned(),
            change: match tried.base {
                Some(_) if tried.phase == Phase::Listing => {
                    "unchanged, to list the messages that are altered".to_owned()
                }
                Some(base) => change(plan, &search.tried()[base].test, &tried.test),
                None => format!("{name} unchanged"),
            },
            failed: tried.failed?,
            kept: kept.contains(&at),
            values: values(plan, &metrics, |id| row.value(id)),
        })
    });
    let steps: Vec<ShrinkStep> = steps.collect();
    let size = |at: usize| size(repository, rows, &metrics, search.tried()[at].number);
    let before = if steps.is_empty() { None } else { Some(size(0)?) };
    let after = kept.last().map(|&at| size(at)).transpose()?;
    let (mut block, mut operations) = (None, Vec::new());
    if let Some(after) = &after {
        let record = repository.test(after.number)?;
        // The smallest test of several causes is shrunk for each of them.
        let of_cause = match failing {
            Failing::Violation { requirements, .. } if repository.task().shrinkings().len() > 1 => {
                let names = requirements.iter().flat_map(|&id| ["_", plan.requirement(id).name.as_str()]);
                names.collect()
            }
            _ => String::new(),
        };
        block = Some(shrunk_block(plan, repository.campaign().seed, &record, name, &of_cause));
        operations = operation_reports(plan, &record);
    }
    Ok(Shrinking {
        test: name.clone(),
        fails: words(plan, failing),
        runs: search.runs(),
        minimal: search.is_minimal(),
        before,
        after,
        operations,
        messages: kept.last().and_then(|&smallest| messages(plan, search, smallest)),
        when: task.when.then(|| triggers(plan, course, search)),
        thresholds: thresholds(plan, search),
        block,
        steps,
    })
}

/// The most messages whose times are all said.
const ALL_TIMES: usize = 6;

/// Altered messages with their times, as in ``three `odom` messages, at 12.40, 12.45 and 12.50 s``. Where several
/// operations alter messages, each of them has a part of its own.
fn altered_words(messages: &[LeftMessage]) -> String {
    let of_each: Vec<&[LeftMessage]> =
        messages.chunk_by(|a, b| (a.position, &a.topic) == (b.position, &b.topic)).collect();
    let words = of_each.iter().map(|messages| {
        let of = if of_each.len() > 1 { format!("`{}` alters ", messages[0].operation) } else { String::new() };
        format!("{of}{}", altered_by_one(messages))
    });
    words.collect::<Vec<_>>().join("; ")
}

/// The messages of one topic that one operation alters, of which there is one at least.
fn altered_by_one(messages: &[LeftMessage]) -> String {
    let count = match messages.len() {
        count @ 1..=10 => {
            ["one", "two", "three", "four", "five", "six", "seven", "eight", "nine", "ten"][count - 1].to_owned()
        }
        count => count.to_string(),
    };
    let word = if messages.len() == 1 { "message" } else { "messages" };
    let what = format!("{count} `{}` {word}", messages[0].topic);
    let times: Option<Vec<f64>> = messages.iter().map(|message| message.time).collect();
    let Some(mut times) = times else {
        let numbers: Vec<String> = messages.iter().map(|message| message.number.to_string()).collect();
        return match numbers.as_slice() {
            [one] => format!("{what}, number {one}"),
            [first, .., last] if numbers.len() > ALL_TIMES => format!("{what}, from number {first} to {last}"),
            _ => format!("{what}, numbers {}", number::join_words(&numbers)),
        };
    };
    times.sort_by(f64::total_cmp);
    let in_hundredths = times.iter().all(|time| (libm::rint(time * 100.0) - time * 100.0).abs() < 1e-6);
    let decimals = if in_hundredths { 2 } else { 3 };
    let times: Vec<String> = times.iter().map(|&time| number::fixed(time, decimals)).collect();
    match times.as_slice() {
        [first, .., last] if times.len() > ALL_TIMES => format!("{what}, from {first} to {last} s"),
        _ => format!("{what}, at {} s", number::join_words(&times)),
    }
}

/// Where parameters of the smallest test begin to matter.
fn thresholds(plan: &CampaignPlan, search: &Shrink) -> Vec<ShrinkThreshold> {
    let of = |(at, threshold): (usize, Threshold)| {
        let Threshold { operation: position, parameter, fails, passes } = threshold;
        let operation = plan.operation(search.tried()[at].test.operations[position].operation);
        let declared = &operation.parameters[parameter];
        let text = |choice: &Choice| number::choice(&operation.kind, declared, choice);
        ShrinkThreshold {
            operation: operation.name.clone(),
            position,
            parameter: declared.name.clone(),
            unit: declared.unit.clone(),
            fails_text: text(&fails),
            passes_text: text(&passes),
            fails,
            passes,
        }
    };
    search.thresholds().into_iter().map(of).collect()
}

/// How far a test was reduced to messages; `None` if that was not asked for, or the reduction has not come that far.
fn messages(plan: &CampaignPlan, search: &Shrink, smallest: usize) -> Option<ShrunkMessages> {
    let not = |text: String| ShrunkMessages { reduced: false, text, left: Vec::new() };
    Some(match search.messages()? {
        MessagesEnd::Reduced => {
            let left = left(plan, &search.tried()[smallest].test, search.altered_by(smallest));
            ShrunkMessages { reduced: true, text: altered_words(&left), left }
        }
        MessagesEnd::NoneAltered => not("its operations alter no messages".to_owned()),
        MessagesEnd::TooMany => not(format!("its operations alter more than {ALTERED_LISTED} messages")),
        MessagesEnd::NotReproduced => {
            not("it does not fail in each run when its operations alter only the messages that they altered".to_owned())
        }
        MessagesEnd::OutOfRuns => not("the evaluations were used up".to_owned()),
    })
}

/// The messages that a test lists, with the times at which a run altered them.
fn left(plan: &CampaignPlan, test: &Test, altered: Option<&AlteredMessages>) -> Vec<LeftMessage> {
    let altered: &[AlteredMessage] = match altered {
        Some(AlteredMessages::Listed(messages)) => messages,
        Some(AlteredMessages::TooMany) | None => &[],
    };
    let mut left = Vec::new();
    for (position, used) in test.operations.iter().enumerate() {
        let operation = plan.operation(used.operation);
        let Some(messages) = &used.messages else { continue };
        let wires = plan.wires_of(operation);
        for run in messages.runs() {
            left.extend((run.first..=run.last).map(|number| {
                let is_it = |message: &&AlteredMessage| {
                    (message.operation as usize, message.wire, message.number) == (position, run.wire, number)
                };
                let wire = wires.get(run.wire as usize);
                LeftMessage {
                    operation: operation.name.clone(),
                    position,
                    topic: wire.map(|(topic, _)| plan.topic(*topic).name.clone()).unwrap_or_default(),
                    path: wire.map(|(_, path)| path.clone()).unwrap_or_default(),
                    number,
                    time: altered.iter().find(is_it).map(|message| message.time),
                }
            }));
        }
    }
    left
}

fn words(plan: &CampaignPlan, failing: &Failing) -> String {
    match failing {
        Failing::Crash => "crashes".to_owned(),
        Failing::Timeout => "times out".to_owned(),
        Failing::Violation { requirements, .. } => {
            let names: Vec<String> = requirements.iter().map(|&id| plan.requirement(id).name.clone()).collect();
            format!("violates {}", number::join_words(&names))
        }
    }
}

/// The metrics that a failing is about, each once.
fn metrics(plan: &CampaignPlan, failing: &Failing) -> Vec<MetricId> {
    let Failing::Violation { requirements, .. } = failing else { return Vec::new() };
    let mut metrics: Vec<MetricId> =
        requirements.iter().map(|&id: &RequirementId| plan.requirement(id).metric).collect();
    metrics.sort_unstable();
    metrics.dedup();
    metrics
}

fn values(plan: &CampaignPlan, metrics: &[MetricId], value: impl Fn(MetricId) -> MetricValue) -> Vec<NamedValue> {
    let named = |&id: &MetricId| {
        let metric = plan.metric(id);
        let shown = value(id);
        let text = value_of(plan, id, shown, &bounds_on(plan, id));
        NamedValue { metric: metric.name.clone(), value: shown.value, text }
    };
    metrics.iter().map(named).collect()
}

fn size(
    repository: &Repository,
    rows: &BTreeMap<u32, &TestRow>,
    metrics: &[MetricId],
    number: u32,
) -> Result<TestSize, RecordError> {
    let plan = repository.plan();
    let record = repository.test(number)?;
    let effects = &record.observation.operations;
    let spans = effects.iter().flat_map(|effect| &effect.intervals);
    let active: f64 = spans.map(|span| span.length()).sum();
    let row = rows.get(&number);
    let point = sspr::observed_point(plan, &record.test, &record.observation);
    Ok(TestSize {
        test: TestNumber(number),
        number,
        operations: record.test.operations.len(),
        operations_text: row.map_or_else(String::new, |row| operations(plan, row)),
        active_time: (effects.len() == record.test.operations.len()).then_some(active),
        intensity: point.and_then(|point| point.get(Dimension::P1)),
        strength: strength(plan, &record.test),
        values: values(plan, metrics, |id| row.map_or_else(MetricValue::default, |row| row.value(id))),
    })
}

/// How a test differs from the one that it was made of.
fn change(plan: &CampaignPlan, base: &Test, test: &Test) -> String {
    let name = |used: &TestOperation| plan.operation(used.operation).name.as_str();
    let mut kept = test.operations.iter().peekable();
    let mut out = Vec::new();
    let mut changes = Vec::new();
    for was in &base.operations {
        let is_it = |used: &TestOperation| TestOperation { messages: was.messages.clone(), ..used.clone() } == *was;
        let same_number = test.operations.len() == base.operations.len();
        let Some(used) = kept.next_if(|used| same_number || is_it(used)) else {
            out.push(name(was));
            continue;
        };
        let kind = plan.operation(used.operation);
        if was.activation != used.activation {
            changes.push(format!("{} {}", name(used), activation(plan, &used.activation)));
        }
        for ((parameter, was), choice) in kind.parameters.iter().zip(&was.parameters).zip(&used.parameters) {
            if was != choice {
                changes.push(format!("{} {}", name(used), number::choice(&kind.kind, parameter, choice)));
            }
        }
        if let Some(messages) = used.messages.as_ref().filter(|_| was.messages != used.messages) {
            let before = was.messages.as_ref().map_or(String::new(), |before| format!(" of {}", before.count()));
            changes.push(format!("{} alters only {}{before} messages", name(used), messages.count()));
        }
    }
    if !out.is_empty() {
        changes.insert(0, format!("without {}", number::join_words(&counted(out))));
    }
    changes.join("; ")
}

fn activation(plan: &CampaignPlan, activation: &Activation) -> String {
    let words = |condition| notation::condition::write(condition, &plan.metrics);
    let often = |times: u32| if times == 1 { String::new() } else { format!(" at most {times} times") };
    match activation {
        Activation::Time { start, end } => format!("from {} s to {} s", fixed(*start, 2), fixed(*end, 2)),
        Activation::Condition { start, end, times } => {
            format!("when {} until {}{}", words(start), words(end), often(*times))
        }
        Activation::ConditionFor { start, length, times } => {
            format!("when {} for {} s{}", words(start), fixed(*length, 2), often(*times))
        }
        Activation::Offline => "before or after the run".to_owned(),
    }
}

#[cfg(test)]
mod tests {
    use sesame_plan::Task;
    use sesame_record::{Recorder, TestRecord, sample};

    use super::*;
    use crate::{TextOptions, page, summary, summary_text};

    /// A test of the sample campaign, shrunk as far as so many runs.
    fn recorded(most: usize) -> (tempfile::TempDir, Repository) {
        let plan = sample::plan();
        let found = sample::records(&plan, 60);
        let fails_r1 =
            |record: &TestRecord| record.observation.metrics.first().and_then(|metric| metric.value) > Some(0.0);
        let found = found.iter().find(|record| record.number > 20 && fails_r1(record)).unwrap();
        assert!(found.test.operations.len() > 1);
        let failing = Failing::Violation { requirements: vec![RequirementId(0)], margins: Vec::new() };
        let task = Task::Shrink(sesame_plan::Shrinking {
            name: format!("T{}", found.number),
            test: found.test.clone(),
            failing: failing.clone(),
            simulator_seed: 9,
            runs: 1,
            evaluations: 200,
            messages: false,
            when: false,
        });
        let plan = task.plan(&plan);
        let folder = tempfile::tempdir().unwrap();
        let mut recorder = Recorder::create_for(folder.path(), &plan, &task, 42, 1).unwrap();
        recorder.commit(&sample::record(&plan, 0, Origin::Reference, Test::default())).unwrap();
        let mut search = Shrink::new(&plan, task.shrinkings()[0].clone());
        let mut number = 0;
        loop {
            let asked = search.ask();
            let mut told = Vec::new();
            for candidate in &asked {
                number += 1;
                let observation = sample::observe(&plan, &candidate.test, 9);
                let record = sample::record(&plan, number, Origin::Search, candidate.test.clone());
                let record = TestRecord { parents: candidate.parents.clone(), observation, ..record };
                let value = |id: MetricId| {
                    let shown = &record.observation.metrics[id.index()];
                    MetricValue::from(shown)
                };
                let failing = fails(&plan, &failing, &record.observation.outcome, value);
                recorder.commit(&record).unwrap();
                told.push(Shown { number, failed: failing, altered: None });
                if number as usize == most {
                    return (folder, recorder.finish("stopped").unwrap());
                }
            }
            if asked.is_empty() {
                return (folder, recorder.finish(&search.ended().unwrap()).unwrap());
            }
            search.learn(&told);
        }
    }

    #[test]
    fn what_became_of_a_test_is_told_with_the_way_there() {
        let (_folder, repository) = recorded(usize::MAX);
        let summary = summary(&repository).unwrap();
        let shrinking = summary.shrinking.as_ref().unwrap();
        let (before, after) = (shrinking.before.as_ref().unwrap(), shrinking.after.as_ref().unwrap());
        assert!(shrinking.minimal && after.operations < before.operations && after.active_time < before.active_time);
        assert!(after.strength < before.strength && after.values[0].value > Some(0.0));
        assert_eq!(shrinking.steps.iter().rfind(|step| step.kept).unwrap().test, after.test);
        insta::assert_snapshot!("shrinking", summary_text(&summary, TextOptions { width: Some(110), colour: false }));
        let html = page(&repository).unwrap();
        assert!(html.contains(" shrunk") && html.contains("Every test that was tried"));
        for end in shrinking.ends() {
            assert!(html.contains(&format!("id=\"T{end}\"")), "T{end} has a timeline");
        }
    }

    #[test]
    fn an_unfinished_way_is_told_as_far_as_it_went() {
        let (_folder, whole) = recorded(usize::MAX);
        let whole = summary(&whole).unwrap().shrinking.unwrap();
        for most in 1..=whole.steps.len() {
            let (_folder, repository) = recorded(most);
            let part = summary(&repository).unwrap().shrinking.unwrap();
            let steps = part.steps.iter().map(|step| (&step.test, &step.change, step.failed));
            let expected = whole.steps.iter().map(|step| (&step.test, &step.change, step.failed));
            assert!(part.steps.len() <= most && steps.eq(expected.take(part.steps.len())));
            assert!(part.after.is_none_or(|after| after.number as usize <= most));
        }
    }
}
