//! A test that was found, as a `test` block for the `.sesame` file.
//!
//! Every number is written so that the language reads back exactly the one that was used, in the unit of its field: the
//! block is the same test, bit for bit.

use std::fmt::Write as _;

use serde::Serialize;

use sesame_base::condition;
use sesame_base::decimal::{decimal, quantity};
use sesame_base::observation::Outcome;
use sesame_base::test_number::TestNumber;
use sesame_plan::{Activation, CampaignPlan, Choice, MetricId, Moment, OperationKind, TestOperation};

use crate::record::{RecordError, Repository, TestRecord};

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

/// Why a test cannot be written in the language.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum ExportError {
    /// It cannot be read.
    #[error(transparent)]
    Record(#[from] RecordError),
    /// It has no operations, and a `test` block has at least one.
    #[error("{0} is a reference run: it has no operations that a `test` could hold")]
    Undisturbed(TestNumber),
}

/// The test that a user calls `T158`, `158`, or by the name of a regression test, as a block of the language.
///
/// The block has a `name` of its own, by default one that the space does not use yet. It expects of each objective the
/// value that was measured; in a campaign without objectives, of each metric that a requirement bounds.
pub fn export(repository: &Repository, test: &str, name: Option<&str>) -> Result<Exported, ExportError> {
    let record = repository.test(repository.find(test)?)?;
    if record.test.operations.is_empty() {
        return Err(ExportError::Undisturbed(TestNumber(record.number)));
    }
    let plan = repository.plan();
    let name = name.map_or_else(
        || free_name(plan, &format!("{}_{}", plan.campaign.name, TestNumber(record.number))),
        str::to_owned,
    );
    let doc =
        format!("{} of `{}`, seed {}.", TestNumber(record.number), plan.campaign.name, repository.campaign().seed);
    let block = block(plan, &doc, &record, &name);
    Ok(Exported { test: TestNumber(record.number), name, block })
}

/// The block of a test that was made out of another one, `original`, in a campaign of this seed.
pub(super) fn shrunk_block(plan: &CampaignPlan, seed: u64, record: &TestRecord, original: &str) -> String {
    let name = free_name(plan, &format!("{}_{original}_shrunk", plan.campaign.name));
    block(plan, &format!("{original} of `{}`, seed {seed}, shrunk.", plan.campaign.name), record, &name)
}

fn block(plan: &CampaignPlan, doc: &str, record: &TestRecord, name: &str) -> String {
    let mut text = format!("/// {doc}\ntest {name} {{\n");
    for used in &record.test.operations {
        let operation = plan.operation(used.operation);
        let _ = write!(text, "  {}", operation.name);
        for (parameter, choice) in operation.parameters.iter().zip(&used.parameters) {
            let written = |x: f64| match (&operation.kind, &parameter.unit) {
                // Probabilities are percentages in the language.
                (kind, _) if kind.has_probabilities() => format!("{}%", decimal(x, 2)),
                (_, unit) => quantity(x, unit.as_deref()),
            };
            let _ = match choice {
                Choice::Value { value } => write!(text, " {} {}", parameter.name, written(*value)),
                Choice::Range { low, high } => {
                    write!(text, " {} [{}, {}]", parameter.name, written(*low), written(*high))
                }
                Choice::Point { point } => {
                    let [x, y, z] = point.map(|coordinate| decimal(coordinate, 0));
                    let unit = parameter.unit.as_deref().unwrap_or_default();
                    write!(text, " {} ({x}, {y}, {z}){unit}", parameter.name)
                }
                Choice::Text { text: chosen } => {
                    let escaped = chosen.replace('\\', "\\\\").replace('"', "\\\"");
                    write!(text, " {} \"{escaped}\"", parameter.name)
                }
            };
        }
        let _ = writeln!(text, " {} seed {}", activation(plan, used), used.operation_seed);
    }
    expectations(&mut text, plan, record);
    text.push_str("}\n");
    text
}

/// When an operation is active, in the words of the language.
pub(super) fn activation(plan: &CampaignPlan, used: &TestOperation) -> String {
    let seconds = |time: &f64| quantity(*time, Some("s"));
    let words = |condition| condition::text::write(condition, &plan.metrics);
    let often = |times: &u32| if *times == 1 { String::new() } else { format!(" at most {times} times") };
    match &used.activation {
        Activation::Time { start, end } => format!("from {} to {}", seconds(start), seconds(end)),
        Activation::Condition { start, end, times } => {
            format!("when {} until {}{}", words(start), words(end), often(times))
        }
        Activation::ConditionFor { start, length, times } => {
            format!("when {} for {}{}", words(start), seconds(length), often(times))
        }
        Activation::Offline => match plan.operation(used.operation).kind {
            OperationKind::Custom { moment: Moment::AfterEnd } => "after end".to_owned(),
            _ => "before start".to_owned(),
        },
    }
}

fn expectations(text: &mut String, plan: &CampaignPlan, record: &TestRecord) {
    let outcome = &record.observation.outcome;
    if matches!(outcome, Outcome::Crash { .. } | Outcome::Timeout { .. }) {
        let _ = writeln!(text, "  // Its run ended as a {}, so there is no value to expect.", outcome.word());
        return;
    }
    let mut metrics = plan.campaign.objectives.clone();
    if metrics.is_empty() {
        metrics.extend(plan.requirements.iter().map(|requirement| requirement.metric));
        metrics.sort();
        metrics.dedup();
    }
    for id in metrics {
        let metric = plan.metric(id);
        match value(record, id) {
            Some(value) => {
                let _ = writeln!(text, "  expect {} == {}", metric.name, quantity(value, metric.unit.as_deref()));
            }
            None => {
                let _ = writeln!(text, "  // `{}` has no value to expect.", metric.name);
            }
        }
    }
}

fn value(record: &TestRecord, metric: MetricId) -> Option<f64> {
    record.observation.metrics.get(metric.index())?.value
}

/// A name for the block that nothing in the plan has: this one, or with a number behind it.
fn free_name(plan: &CampaignPlan, name: &str) -> String {
    let names = [&plan.space, &plan.simulator.name, &plan.campaign.name];
    let mut taken: Vec<&str> = names.into_iter().map(String::as_str).collect();
    taken.extend(plan.messages.iter().map(|it| it.name.as_str()));
    taken.extend(plan.topics.iter().map(|it| it.name.as_str()));
    taken.extend(plan.nodes.iter().map(|it| it.name.as_str()));
    taken.extend(plan.metrics.iter().map(|it| it.name.as_str()));
    taken.extend(plan.requirements.iter().map(|it| it.name.as_str()));
    taken.extend(plan.operations.iter().map(|it| it.name.as_str()));
    taken.extend(plan.tests.iter().map(|it| it.name.as_str()));
    let more = (2u32..).map(|n| format!("{name}_{n}"));
    let names = std::iter::once(name.to_owned()).chain(more);
    names.into_iter().find(|name| !taken.contains(&name.as_str())).unwrap_or_else(|| name.to_owned())
}

/// Whether a name can be that of a test; the words of the language are refused when the block is read.
pub fn is_name(name: &str) -> bool {
    let mut characters = name.chars();
    characters.next().is_some_and(|first| first.is_ascii_alphabetic() || first == '_')
        && characters.all(|c| c.is_ascii_alphanumeric() || c == '_')
}

#[cfg(test)]
mod tests {
    use sesame_plan::condition::ConditionEnd;
    use sesame_plan::{OperationId, Test};

    use super::*;
    use crate::record::sample;

    #[test]
    fn a_block_says_all_there_is_to_a_test() {
        let folder = tempfile::tempdir().unwrap();
        let repository = sample::campaign(folder.path(), &sample::plan(), 60);
        let blocks = ["T2", "T9", "T23", "known_jitter"].map(|test| export(&repository, test, None).unwrap().block);
        insta::assert_snapshot!(blocks.join("\n"));
        let named = export(&repository, "T9", Some("worst")).unwrap();
        assert!(named.block.contains("\ntest worst {\n"), "{}", named.block);
        let refused = export(&repository, "reference", None).unwrap_err();
        assert!(refused.to_string().starts_with("T0 is a reference run"), "{refused}");
    }

    #[test]
    fn a_block_says_what_switches_an_operation() {
        let plan = sample::plan();
        let record = sample::record(&plan, 5, crate::record::Origin::Search, sample::conditional_test());
        insta::assert_snapshot!(block(&plan, "T5 of `coverage_experiment`, seed 42.", &record, "by_condition"), @r"
        /// T5 of `coverage_experiment`, seed 42.
        test by_condition {
          jitter_link0 offset [-0.1rad, 0.2rad] when arm_distance < 450mm and (1.5m/s < top_speed or arm_distance < 450mm) until 1.5m/s < top_speed seed 11
          jitter_link1 offset [-0.1rad, 0.2rad] from 1.5s to 20s seed 11
          cut_link1 when 1.5m/s < top_speed for 0.30000000000000004s at most 3 times seed 11
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
        };
        let record = sample::record(&plan, 5, crate::record::Origin::Search, Test { operations: vec![used] });
        let before = block(&plan, "T5 of `coverage_experiment`, seed 42.", &record, "spoilt");
        assert!(before.contains("\n  spoil way \"hot\" before start seed 11\n"), "{before}");
        plan.operations[4].kind = OperationKind::Custom { moment: Moment::AfterEnd };
        let after = block(&plan, "T5 of `coverage_experiment`, seed 42.", &record, "spoilt");
        assert!(after.contains("\n  spoil way \"hot\" after end seed 11\n"), "{after}");
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
