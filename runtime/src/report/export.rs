//! A test that was found, as a `test` block for the `.sesame` file.
//!
//! Every number is written so that the language reads back exactly the one that was used, in the unit of its field: the
//! block is the same test, bit for bit.

use std::fmt::Write as _;

use serde::Serialize;
use sesame_plan::{Activation, CampaignPlan, Choice, MetricId, Moment, OperationKind};

use crate::observation::Outcome;
use crate::record::{RecordError, Repository, TestRecord};

/// A test in the words of the language.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct Exported {
    /// The test's name in the results.
    pub test: String,
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
    /// It disturbs nothing, and a `test` block disturbs something.
    #[error("T{0} disturbs nothing, so there is no `test` to write; every run of a campaign begins with it")]
    Undisturbed(u32),
}

/// The test that a user calls `T158`, `158`, or by the name of a known test, as a block of the language.
///
/// The block has a `name` of its own, by default one that the space does not use yet. It expects of each objective the
/// value that was measured; in a campaign without objectives, of each metric that a requirement bounds.
pub fn export(repository: &Repository, test: &str, name: Option<&str>) -> Result<Exported, ExportError> {
    let record = repository.test(repository.find(test)?)?;
    if record.test.operations.is_empty() {
        return Err(ExportError::Undisturbed(record.number));
    }
    let plan = repository.plan();
    let name = name.map_or_else(|| free_name(plan, record.number), str::to_owned);
    let block = block(plan, repository.campaign().seed, &record, &name);
    Ok(Exported { test: format!("T{}", record.number), name, block })
}

fn block(plan: &CampaignPlan, seed: u64, record: &TestRecord, name: &str) -> String {
    let mut text = format!("/// T{} of `{}`, seed {seed}.\ntest {name} {{\n", record.number, plan.campaign.name);
    for used in &record.test.operations {
        let operation = plan.operation(used.operation);
        let _ = write!(text, "  {}", operation.name);
        for (parameter, choice) in operation.parameters.iter().zip(&used.parameters) {
            let written = |x: f64| match (&operation.kind, &parameter.unit) {
                // Probabilities are percentages in the language.
                (OperationKind::PacketLoss, _) => format!("{}%", decimal(x, 2)),
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
        let Activation::Time { start, end } = used.activation;
        let seconds = |time| quantity(time, Some("s"));
        let _ = match operation.kind {
            OperationKind::Custom { moment: Moment::BeforeStart } => write!(text, " before start"),
            OperationKind::Custom { moment: Moment::AfterEnd } => write!(text, " after end"),
            _ => write!(text, " from {} to {}", seconds(start), seconds(end)),
        };
        let _ = writeln!(text, " seed {}", used.draw_seed);
    }
    expectations(&mut text, plan, record);
    text.push_str("}\n");
    text
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

/// A name for the block that nothing in the plan has.
fn free_name(plan: &CampaignPlan, number: u32) -> String {
    let names = [&plan.space, &plan.simulator.name, &plan.campaign.name];
    let mut taken: Vec<&str> = names.into_iter().map(String::as_str).collect();
    taken.extend(plan.messages.iter().map(|it| it.name.as_str()));
    taken.extend(plan.topics.iter().map(|it| it.name.as_str()));
    taken.extend(plan.nodes.iter().map(|it| it.name.as_str()));
    taken.extend(plan.metrics.iter().map(|it| it.name.as_str()));
    taken.extend(plan.requirements.iter().map(|it| it.name.as_str()));
    taken.extend(plan.operations.iter().map(|it| it.name.as_str()));
    taken.extend(plan.tests.iter().map(|it| it.name.as_str()));
    let name = format!("{}_T{number}", plan.campaign.name);
    let more = (2u32..).map(|n| format!("{name}_{n}"));
    std::iter::once(name.clone()).chain(more).find(|name| !taken.contains(&name.as_str())).unwrap_or(name)
}

/// A number with its unit glued on, as the language has it.
fn quantity(x: f64, unit: Option<&str>) -> String {
    format!("{}{}", decimal(x, 0), unit.unwrap_or_default())
}

/// The shortest decimal that reads back as this number, its point moved right by so many digits.
fn decimal(x: f64, shift: i32) -> String {
    // The shortest digits that tell the number from all others, as `d.ddde-x`.
    let scientific = format!("{:e}", x + 0.0);
    let (mantissa, exponent) = scientific.split_once('e').expect("a number in scientific notation has an exponent");
    let exponent = exponent.parse::<i32>().expect("an exponent is a small whole number") + shift;
    let (sign, mantissa) = mantissa.strip_prefix('-').map_or(("", mantissa), |mantissa| ("-", mantissa));
    let digits: String = mantissa.chars().filter(char::is_ascii_digit).collect();
    if !(-6..=15).contains(&exponent) && x != 0.0 {
        let (first, rest) = digits.split_at(1);
        let point = if rest.is_empty() { "" } else { "." };
        return format!("{sign}{first}{point}{rest}e{exponent}");
    }
    let whole = usize::try_from(exponent + 1).unwrap_or(0);
    if whole == 0 {
        let zeros = "0".repeat(usize::try_from(-exponent - 1).unwrap_or(0));
        return format!("{sign}0.{zeros}{digits}");
    }
    if digits.len() <= whole {
        let zeros = if x == 0.0 { String::new() } else { "0".repeat(whole - digits.len()) };
        let digits = if x == 0.0 { "0" } else { &digits };
        return format!("{sign}{digits}{zeros}");
    }
    let (whole, fraction) = digits.split_at(whole);
    format!("{sign}{whole}.{fraction}")
}

/// Whether a name can be that of a test; the words of the language are refused when the block is read.
#[cfg(feature = "campaign")]
pub(crate) fn is_name(name: &str) -> bool {
    let mut characters = name.chars();
    characters.next().is_some_and(|first| first.is_ascii_alphabetic() || first == '_')
        && characters.all(|c| c.is_ascii_alphanumeric() || c == '_')
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

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
        assert!(refused.to_string().starts_with("T0 disturbs nothing"), "{refused}");
    }

    #[test]
    fn a_name_that_is_taken_is_not_given_again() {
        let mut plan = sample::plan();
        assert_eq!(free_name(&plan, 9), "coverage_experiment_T9");
        plan.tests[0].name = "coverage_experiment_T9".to_owned();
        plan.metrics[0].name = "coverage_experiment_T9_2".to_owned();
        assert_eq!(free_name(&plan, 9), "coverage_experiment_T9_3");
    }

    #[test]
    fn numbers_are_written_as_people_write_them() {
        let written = [0.0, -0.0, 18.0, -0.27, 100.0, 1e15, 1e16, 0.1 + 0.2, 1.5e-6, 1.5e-7].map(|x| decimal(x, 0));
        assert_eq!(
            written,
            ["0", "0", "18", "-0.27", "100", "1000000000000000", "1e16", "0.30000000000000004", "0.0000015", "1.5e-7"]
        );
        assert_eq!([0.0, 1.0, 0.4, 0.123, 0.07, 1e-9].map(|x| decimal(x, 2)), ["0", "100", "40", "12.3", "7", "1e-7"]);
    }

    proptest! {
        #[test]
        fn every_number_reads_back_as_it_was(bits in any::<u64>(), unit in 0.0..=1.0f64) {
            for x in [f64::from_bits(bits), unit].into_iter().filter(|x| x.is_finite()) {
                let written = decimal(x, 0);
                prop_assert_eq!(written.parse::<f64>().unwrap(), x);
                let digits = written.strip_prefix('-').unwrap_or(&written);
                prop_assert!(digits.starts_with(|c: char| c.is_ascii_digit()) && !digits.contains(".e"), "{}", written);
            }
            let (digits, exponent) = decimal(unit, 2).split_once('e').map_or_else(
                || (decimal(unit, 2), -2),
                |(digits, exponent)| (digits.to_owned(), exponent.parse::<i32>().unwrap() - 2),
            );
            prop_assert_eq!(format!("{digits}e{exponent}").parse::<f64>().unwrap(), unit);
        }
    }
}
