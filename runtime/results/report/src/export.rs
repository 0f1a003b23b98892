//! A test that was found, as a `test` block for the `.sesame` file.
//!
//! Every number is written so that the language reads back exactly the one that was used, in the unit of its field: the
//! block is the same test, bit for bit.

use std::collections::BTreeSet;

use serde::Serialize;

use sesame_base::test_number::TestNumber;
use sesame_notation as notation;
use sesame_plan::{Bound, CampaignPlan, Expectation, MetricId, Requirement};
use sesame_present::number;
use sesame_record::{RecordError, Repetition, Repository, TestRecord, Verdict, verdict};

use crate::facts::causes::causes;
use crate::facts::wording::outcome_words;

/// A test in the words of the language.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct Exported {
    /// The test's name in the results.
    pub test: TestNumber,
    /// The name of the block.
    pub name: String,
    /// The block.
    pub block: String,
}

/// What an exported test expects.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Expected {
    /// That requirements are satisfied.
    Requirements,
    /// The values that were measured.
    Values,
}

/// Why a test cannot be written in the language.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum ExportError {
    /// It cannot be read.
    #[error(transparent)]
    Record(#[from] RecordError),
    /// Some of its operations could not be imported.
    #[error("{0} held operations that were not imported, so a `test` could not do what it did")]
    NotWhole(TestNumber),
    /// It has no operations, and a `test` block has at least one.
    #[error("{0} is a reference run: it has no operations that a `test` could hold")]
    Undisturbed(TestNumber),
}

/// The test that a user calls `T158`, `158`, or by the name of a regression test, as a block of the language.
///
/// The block has a `name` of its own, by default one that the space does not use yet. It names the simulator's seed of
/// the run, so it has the same values in any campaign that ends at the same time.
pub fn export(
    repository: &Repository,
    test: &str,
    name: Option<&str>,
    expected: Expected,
) -> Result<Exported, ExportError> {
    let record = repository.test(repository.find(test)?)?;
    if !repository.left_out_operations(record.number..=record.number)?.is_empty() {
        return Err(ExportError::NotWhole(TestNumber(record.number)));
    }
    if record.test.operations.is_empty() {
        return Err(ExportError::Undisturbed(TestNumber(record.number)));
    }
    let plan = repository.plan();
    let name = name.map_or_else(
        || free_name(plan, &format!("{}_{}", plan.campaign.name, TestNumber(record.number))),
        str::to_owned,
    );
    let doc = found_by(plan, repository.campaign().seed, &TestNumber(record.number).to_string(), "");
    let expectations = match expected {
        Expected::Requirements => requirements(plan, &record),
        Expected::Values => {
            let runs = repository.repetitions()?.remove(&record.duplicate_of.unwrap_or(record.number));
            values(plan, &record, &runs.unwrap_or_default())
        }
    };
    let block = block(plan, &doc, &record, &name, expectations);
    Ok(Exported { test: TestNumber(record.number), name, block })
}

/// The smallest test of each cause as a block of its own, by number. A test that is the smallest of several causes is
/// one block, which expects all requirements that it violates.
pub fn export_causes(repository: &Repository, expected: Expected) -> Result<Vec<Exported>, ExportError> {
    let smallest: BTreeSet<u32> = causes(repository)?.causes.iter().map(|cause| cause.test.0).collect();
    smallest.into_iter().map(|test| export(repository, &TestNumber(test).to_string(), None, expected)).collect()
}

/// The block of a test that was made out of another one, `original`, in a campaign of this seed. `of` tells its name
/// apart from those of other blocks that were made out of the same test.
pub(super) fn shrunk_block(plan: &CampaignPlan, seed: u64, record: &TestRecord, original: &str, of: &str) -> String {
    let name = free_name(plan, &format!("{}_{original}{of}_shrunk", plan.campaign.name));
    block(plan, &found_by(plan, seed, original, ", shrunk"), record, &name, requirements(plan, record))
}

/// Which campaign a test is from, and on what its values depend besides the test and the simulator's seed.
fn found_by(plan: &CampaignPlan, seed: u64, test: &str, how: &str) -> String {
    let campaign = &plan.campaign;
    let end = notation::Unit::SECONDS.number(campaign.end_after);
    format!("{test} of `{}`{how} (seed {seed}, end after {end}).", campaign.name)
}

fn block(plan: &CampaignPlan, doc: &str, record: &TestRecord, name: &str, expectations: Vec<String>) -> String {
    let operations = record.test.operations.iter().map(|used| notation::test_operation(plan, used));
    let seed = [notation::simulator_seed(record.simulator_seed)];
    notation::test_block(doc, name, operations.chain(seed).chain(expectations))
}

/// What a system that works does in the test: it satisfies the requirements that the test violates, or if there are
/// none, those that it satisfies. So the test fails for as long as the weakness is there that it found. What was
/// measured is a comment.
fn requirements(plan: &CampaignPlan, record: &TestRecord) -> Vec<String> {
    let observation = &record.observation;
    let of = |wanted: Verdict| {
        plan.requirements.iter().filter(move |requirement| {
            verdict(requirement.bound, &observation.outcome, observation.value(requirement.metric)) == wanted
        })
    };
    let violated: Vec<&Requirement> = of(Verdict::Violated).collect();
    let expected = if violated.is_empty() { of(Verdict::Satisfied).collect() } else { violated };
    let mut lines = not_whole(record).into_iter().collect::<Vec<_>>();
    for requirement in expected {
        let metric = plan.metric(requirement.metric);
        let measured = value(record, requirement.metric).map(|value| {
            let value = number::beside(value, &[requirement.bound], metric.unit.as_deref());
            format!("// `{}` was {value}.", metric.name)
        });
        lines.extend(measured);
        lines.push(notation::expected_requirement(&requirement.name));
    }
    if lines.is_empty() {
        lines.push("// No requirement was judged, so there is nothing to expect.".to_owned());
    }
    lines
}

/// That the run of a test did not come to its end.
fn not_whole(record: &TestRecord) -> Option<String> {
    let outcome = &record.observation.outcome;
    (!outcome.is_whole()).then(|| format!("// Its run ended as a {}.", outcome_words(outcome.word())))
}

/// The measured values of each objective and of each metric with which the test violates a requirement; without
/// objectives, of each metric that a requirement bounds. Where fresh runs measured others, the values between the least
/// and the greatest are expected.
fn values(plan: &CampaignPlan, record: &TestRecord, fresh: &[Repetition]) -> Vec<String> {
    let outcome = &record.observation.outcome;
    if let Some(line) = not_whole(record) {
        return vec![line];
    }
    let mut metrics = plan.campaign.objectives.clone();
    let searched = !metrics.is_empty();
    for requirement in &plan.requirements {
        let value = record.observation.value(requirement.metric);
        let expected = !searched || verdict(requirement.bound, outcome, value) == Verdict::Violated;
        if expected && !metrics.contains(&requirement.metric) {
            metrics.push(requirement.metric);
        }
    }
    if !searched {
        metrics.sort();
    }
    let expected = metrics.into_iter().map(|metric| {
        let Some(first) = value(record, metric) else {
            return format!("// `{}` has no value to expect.", plan.metric(metric).name);
        };
        let others = fresh.iter().filter(|run| run.outcome.is_whole()).filter_map(|run| run.value(metric).value);
        let (low, high) = others.fold((first, first), |(low, high), value| (low.min(value), high.max(value)));
        let bound = if low < high { Bound::Within { low, high } } else { Bound::Equal { value: first } };
        notation::expectation(&Expectation { metric, bound }, &plan.metrics)
    });
    expected.collect()
}

fn value(record: &TestRecord, metric: MetricId) -> Option<f64> {
    record.observation.metrics.get(metric.index())?.value
}

/// A name for the block that nothing in the plan has: this one, or with a number behind it.
fn free_name(plan: &CampaignPlan, name: &str) -> String {
    let names = [&plan.space, &plan.simulator.name, &plan.campaign.name];
    let mut taken: Vec<&str> = names.into_iter().map(String::as_str).collect();
    taken.extend(plan.messages.iter().map(|message| message.name.as_str()));
    taken.extend(plan.topics.iter().map(|topic| topic.name.as_str()));
    taken.extend(plan.nodes.iter().map(|node| node.name.as_str()));
    taken.extend(plan.metrics.iter().map(|metric| metric.name.as_str()));
    taken.extend(plan.requirements.iter().map(|requirement| requirement.name.as_str()));
    taken.extend(plan.operations.iter().map(|operation| operation.name.as_str()));
    taken.extend(plan.tests.iter().map(|test| test.name.as_str()));
    let more = (2u32..).map(|n| format!("{name}_{n}"));
    let names = std::iter::once(name.to_owned()).chain(more);
    names.into_iter().find(|name| !taken.contains(&name.as_str())).unwrap_or_else(|| name.to_owned())
}

#[cfg(test)]
mod tests {
    use sesame_base::observation::Reach;
    use sesame_plan::condition::ConditionEnd;
    use sesame_plan::{Activation, Choice, Moment, OperationId, OperationKind, Test, TestOperation};
    use sesame_record::sample;

    use super::*;

    #[test]
    fn a_block_says_all_there_is_to_a_test() {
        let folder = tempfile::tempdir().unwrap();
        let repository = sample::campaign(folder.path(), &sample::plan(), 60);
        let blocks = ["T2", "T9", "T23", "known_jitter"]
            .map(|test| export(&repository, test, None, Expected::Requirements).unwrap().block);
        insta::assert_snapshot!(blocks.join("\n"));
        let named = export(&repository, "T9", Some("worst"), Expected::Values).unwrap();
        assert!(named.block.contains("\ntest worst {\n"), "{}", named.block);
        let refused = export(&repository, "reference", None, Expected::Requirements).unwrap_err();
        assert!(refused.to_string().starts_with("T0 is a reference run"), "{refused}");
    }

    #[test]
    fn a_block_says_what_switches_an_operation() {
        let plan = sample::plan();
        let record = sample::record(&plan, 5, sesame_record::Origin::Search, sample::conditional_test());
        insta::assert_snapshot!(block(&plan, "T5 of `coverage_experiment`, seed 42.", &record, "by_condition", values(&plan, &record, &[])), @r"
        /// T5 of `coverage_experiment`, seed 42.
        test by_condition {
          jitter_link0 offset [-0.1rad, 0.2rad] when arm_distance < 450mm and (1.5m/s < top_speed or arm_distance < 450mm) until 1.5m/s < top_speed seed 11
          jitter_link1 offset [-0.1rad, 0.2rad] from 1.5s to 20s seed 11
          cut_link1 when 1.5m/s < top_speed for 0.30000000000000004s at most 3 times seed 11
          simulator seed 18446744073709551610
          expect fuzzing_time == 39.8s
          expect collision_occurrence == 5
        }
        ");
    }

    #[test]
    fn a_block_says_that_an_operation_acts_beside_the_run() {
        let mut plan = sample::offline_plan(ConditionEnd::Condition);
        let used = TestOperation {
            operation: OperationId(4),
            activation: Activation::Offline,
            parameters: vec![Choice::Text { text: "hot".to_owned() }],
            operation_seed: 11,
            messages: None,
        };
        let record = sample::record(&plan, 5, sesame_record::Origin::Search, Test { operations: vec![used] });
        let before = block(&plan, "T5 of `coverage_experiment`, seed 42.", &record, "spoilt", Vec::new());
        assert!(before.contains("\n  spoil way \"hot\" before start seed 11\n"), "{before}");
        plan.operations[4].kind = OperationKind::Custom { moment: Moment::AfterEnd };
        let after = block(&plan, "T5 of `coverage_experiment`, seed 42.", &record, "spoilt", Vec::new());
        assert!(after.contains("\n  spoil way \"hot\" after end seed 11\n"), "{after}");
    }

    #[test]
    fn a_block_expects_the_objectives_and_the_metrics_of_violated_requirements() {
        let mut plan = sample::plan();
        let mut record = sample::record(&plan, 5, sesame_record::Origin::Search, sample::conditional_test());
        plan.campaign.objectives.truncate(1);
        let objective = plan.campaign.objectives[0];
        plan.requirements.retain(|requirement| requirement.metric != objective);
        plan.requirements.truncate(1);
        plan.requirements[0].bound = Bound::AtMost { value: 5.0 };
        let bounded = plan.requirements[0].metric;
        let name = plan.metric(bounded).name.clone();
        for (value, expected) in [(5.0, 1), (6.0, 2)] {
            let measured = &mut record.observation.metrics[bounded.index()];
            (measured.value, measured.reach) = (Some(value), Reach { low: Some(value), high: Some(value) });
            let lines = values(&plan, &record, &[]);
            assert_eq!(lines.len(), expected, "{value}: {lines:?}");
            assert_eq!(lines.iter().any(|line| line.contains(&name)), expected == 2, "{lines:?}");
        }
        plan.campaign.objectives.clear();
        record.observation.metrics[bounded.index()].value = Some(5.0);
        assert!(values(&plan, &record, &[])[0].contains(&name), "without objectives, of all requirements");
    }

    #[test]
    fn a_name_that_is_taken_is_not_given_again() {
        let mut plan = sample::plan();
        assert_eq!(free_name(&plan, "coverage_experiment_T9"), "coverage_experiment_T9");
        plan.tests[0].name = "coverage_experiment_T9".to_owned();
        plan.metrics[0].name = "coverage_experiment_T9_2".to_owned();
        assert_eq!(free_name(&plan, "coverage_experiment_T9"), "coverage_experiment_T9_3");
    }
}
