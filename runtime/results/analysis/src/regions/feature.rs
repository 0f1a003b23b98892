//! What is known of a test that may tell whether it fails, in numbers: its point in the reduced space, and of each
//! operation how often, when, how long and how strong.

use std::collections::BTreeSet;

use sesame_plan::{CampaignPlan, Choice, ChoiceKind, Dimension, Domain, OperationId, Span};
use sesame_present::number;
use sesame_record::ScannedTest;
use sesame_search::sspr::{Convention, disturbance};

use crate::regions::tree::Question;

/// One number of a test.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Feature {
    /// A coordinate of its point, as observed.
    Dimension(Dimension),
    /// How many times an operation is in it.
    Count(OperationId),
    /// The mean start of an operation's windows in seconds, as planned; where conditions switch it, as observed.
    Start(OperationId),
    /// The mean length of an operation's windows in seconds, likewise.
    Length(OperationId),
    /// The mean of an operation's parameters, as shares of what is permitted (as P1 has them).
    Share(OperationId),
    /// The mean of one of its parameters, by its position, in the unit in which it is written.
    Parameter(OperationId, usize, Part),
}

/// What of a parameter is a number.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Part {
    /// Its value.
    Value,
    /// The middle of a sub-range.
    Middle,
    /// The width of a sub-range.
    Width,
}

/// All numbers of tests of a plan, in the order in which they are preferred.
pub(super) fn features(plan: &CampaignPlan) -> Vec<Feature> {
    let dimensions = Dimension::ALL.map(Feature::Dimension);
    let mut used = plan.campaign.operations.clone();
    used.sort_unstable();
    let of_operation = |id: OperationId| {
        let offline = plan.operation(id).kind.is_offline();
        let timed = (!offline).then_some([Feature::Start(id), Feature::Length(id)]);
        let strong = (!plan.operation(id).parameters.is_empty()).then_some(Feature::Share(id));
        [Feature::Count(id)].into_iter().chain(timed.into_iter().flatten()).chain(strong)
    };
    dimensions.into_iter().chain(used.into_iter().flat_map(of_operation)).collect()
}

/// The numbers of what these operations do in a test: each parameter that is a number, when, for how long, and how
/// often.
pub(super) fn features_in_units(plan: &CampaignPlan, operations: &BTreeSet<OperationId>) -> Vec<Feature> {
    let of_operation = |&id: &OperationId| {
        let operation = plan.operation(id);
        let timed = (!operation.kind.is_offline()).then_some([Feature::Start(id), Feature::Length(id)]);
        let parts = operation.parameters.iter().enumerate().flat_map(move |(at, parameter)| {
            let parts: &[Part] = match &parameter.domain {
                Domain::Number { shape: ChoiceKind::Value, .. } => &[Part::Value],
                Domain::Number { shape: ChoiceKind::Range, .. } => &[Part::Middle, Part::Width],
                _ => &[],
            };
            parts.iter().map(move |&part| Feature::Parameter(id, at, part))
        });
        parts.chain(timed.into_iter().flatten()).chain([Feature::Count(id)]).collect::<Vec<_>>()
    };
    operations.iter().flat_map(of_operation).collect()
}

/// The numbers of a test, a NaN for one that it does not have.
pub(super) fn numbers(plan: &CampaignPlan, features: &[Feature], test: &ScannedTest) -> Vec<f64> {
    let point = test.point(plan, Convention::Ours);
    let of = |id: OperationId| test.operations.iter().filter(move |operation| operation.operation == id);
    let spans = |id: OperationId| {
        of(id).flat_map(|operation| match operation.planned {
            Some(planned) => vec![planned],
            None => operation.intervals.clone(),
        })
    };
    let number = |feature: &Feature| match *feature {
        Feature::Dimension(dimension) => point.and_then(|point| point.get(dimension)),
        Feature::Count(id) => Some(of(id).count() as f64),
        Feature::Start(id) => mean(spans(id).map(|span| span.start)),
        Feature::Length(id) => mean(spans(id).map(Span::length)),
        Feature::Share(id) => mean(of(id).flat_map(|operation| {
            let disturbance = disturbance(plan, id, &operation.choices, Vec::new());
            let class = disturbance.class;
            disturbance
                .parameters
                .into_iter()
                .filter_map(move |parameter| parameter.normalised(class, Convention::Ours))
        })),
        Feature::Parameter(id, at, part) => {
            let factor = written(plan, id, at).0;
            mean(of(id).filter_map(|operation| part.of(operation.choices.get(at)?)).map(|number| number * factor))
        }
    };
    features.iter().map(|feature| number(feature).unwrap_or(f64::NAN)).collect()
}

fn mean(numbers: impl Iterator<Item = f64>) -> Option<f64> {
    let (sum, count) = numbers.fold((0.0, 0u32), |(sum, count), number| (sum + number, count + 1));
    (count > 0).then(|| sum / f64::from(count))
}

impl Part {
    fn of(self, choice: &Choice) -> Option<f64> {
        match (self, choice) {
            (Part::Value, Choice::Value { value }) => Some(*value),
            (Part::Middle, Choice::Range { low, high }) => Some(f64::midpoint(*low, *high)),
            (Part::Width, Choice::Range { low, high }) => Some(high - low),
            _ => None,
        }
    }
}

/// The unit in which a parameter is written, and by what its values are multiplied for that.
fn written(plan: &CampaignPlan, id: OperationId, at: usize) -> (f64, Option<&str>) {
    let operation = plan.operation(id);
    let parameter = &operation.parameters[at];
    let highest = match parameter.domain {
        Domain::Number { high, .. } => high,
        _ => f64::INFINITY,
    };
    number::scale(&operation.kind, parameter, highest)
}

/// How strong an operation is, in the name and the unit of its parameter: `skew above 0.2 s`; for a sub-range, how
/// wide it is. Several numbers have no unit in common: for these it is the mean of how far each goes from the least to
/// the greatest that is permitted.
fn strength(plan: &CampaignPlan, id: OperationId, share: f64, way: &str) -> String {
    let operation = plan.operation(id);
    if let [parameter] = &operation.parameters[..]
        && let Domain::Number { low, high, shape, .. } = parameter.domain
    {
        let (factor, unit) = written(plan, id, 0);
        let text = |value: f64| number::with_unit(number::number(value * factor), unit);
        return match shape {
            ChoiceKind::Value => format!("{} {way} {}", parameter.name, text(low + share * (high - low))),
            ChoiceKind::Range => format!("{} {way} {} wide", parameter.name, text(share * (high - low))),
        };
    }
    let names: Vec<&str> = operation.parameters.iter().map(|parameter| parameter.name.as_str()).collect();
    format!("{} {way} {} % of what is permitted, in the mean", names.join(", "), number::number(100.0 * share))
}

impl Feature {
    /// What holds of a test of which this question holds, or does not; `missing` says whether tests may be meant that
    /// have no such number. Thresholds have all their digits.
    pub(super) fn words(self, plan: &CampaignPlan, question: Question, holds: bool, missing: bool) -> String {
        let at = number::exact(question.threshold);
        let at_most = question.at_most == holds;
        let missing = missing && !holds;
        let way = if at_most { "at most" } else { "above" };
        match self {
            Feature::Dimension(dimension) => {
                let none = match (missing, dimension) {
                    (false, _) => "",
                    (true, Dimension::P1 | Dimension::P2) => " or no parameters",
                    (true, _) => " or nothing active",
                };
                format!("{} {way} {at}{none}", dimension.name())
            }
            Feature::Count(id) => {
                let name = &plan.operation(id).name;
                match (at_most, question.threshold) {
                    (true, 0.0) => format!("no {name}"),
                    (false, 0.0) => name.clone(),
                    (true, _) => format!("{name} at most {at}×"),
                    (false, threshold) => format!("{name} at least {}×", number::exact(threshold + 1.0)),
                }
            }
            Feature::Start(id) => {
                self.of_operation(plan, id, &format!("starts {} {at} s", if at_most { "by" } else { "after" }), missing)
            }
            Feature::Length(id) => self.of_operation(
                plan,
                id,
                &format!("lasts {} {at} s", if at_most { "at most" } else { "over" }),
                missing,
            ),
            Feature::Share(id) => self.of_operation(plan, id, &strength(plan, id, question.threshold, way), missing),
            Feature::Parameter(id, at, part) => {
                let name = &plan.operation(id).parameters[at].name;
                let threshold = number::with_unit(number::exact(question.threshold), written(plan, id, at).1);
                let what = match part {
                    Part::Value => format!("{name} {way} {threshold}"),
                    Part::Middle => format!("middle of {name} {way} {threshold}"),
                    Part::Width => format!("{name} {way} {threshold} wide"),
                };
                self.of_operation(plan, id, &what, missing)
            }
        }
    }

    fn of_operation(self, plan: &CampaignPlan, id: OperationId, what: &str, missing: bool) -> String {
        let name = &plan.operation(id).name;
        match (missing, self) {
            (false, _) => format!("{name} {what}"),
            (true, Feature::Share(_) | Feature::Parameter(..)) => format!("{name} {what} or there is none"),
            (true, _) => format!("{name} {what} or never"),
        }
    }
}

#[cfg(test)]
mod tests {
    use sesame_plan::testing::{operation_with, parameter, plan, range, value};
    use sesame_plan::{OperationKind, Parameter};

    use super::*;

    #[test]
    fn parameters_are_asked_for_in_the_units_in_which_they_are_written() {
        let said = |kind, parameters: Vec<Parameter>| {
            let plan = plan(vec![operation_with("o", 0, kind, parameters)]);
            let features = features_in_units(&plan, &BTreeSet::from([OperationId(0)]));
            let question = Question { column: 0, threshold: 2.5, at_most: true };
            let words = |feature: &Feature| feature.words(&plan, question, false, false);
            features.iter().map(words).collect::<Vec<_>>().join(", ")
        };
        let seconds = |parameter: Parameter| Parameter { unit: Some("s".to_owned()), ..parameter };
        let times = "o starts after 2.5 s, o lasts over 2.5 s, o at least 3.5×";
        let stale = said(OperationKind::Stale, vec![seconds(value("delay", 0.0, 0.4))]);
        assert_eq!(stale, format!("o delay above 2.5 ms, {times}"));
        let bias = said(OperationKind::Bias, vec![seconds(range("offset", -0.4, 0.4))]);
        assert_eq!(bias, format!("o middle of offset above 2.5 s, o offset above 2.5 s wide, {times}"));
        let several = said(OperationKind::BurstLoss, vec![value("enter", 0.0, 0.1), value("leave", 0.2, 0.8)]);
        assert_eq!(several, format!("o enter above 2.5 %, o leave above 2.5 %, {times}"));
        let point = parameter("bias", Domain::Point { low: [0.0; 3], high: [1.0; 3] });
        assert_eq!(said(OperationKind::Bias, vec![point]), times, "a point is not a number");
    }

    #[test]
    fn how_strong_an_operation_is_is_said_in_the_names_and_units_of_its_parameters() {
        let said = |kind, parameters: Vec<Parameter>| {
            let plan = plan(vec![operation_with("o", 0, kind, parameters)]);
            let question = Question { column: 0, threshold: 0.25, at_most: true };
            [true, false].map(|holds| Feature::Share(OperationId(0)).words(&plan, question, holds, false))
        };
        let seconds = |parameter: Parameter| Parameter { unit: Some("s".to_owned()), ..parameter };
        let skew = said(OperationKind::ClockSkew, vec![seconds(value("skew", 0.0, 0.8))]);
        assert_eq!(skew, ["o skew at most 0.2 s", "o skew above 0.2 s"]);
        let wide = said(OperationKind::Bias, vec![seconds(range("offset", -0.4, 0.4))]);
        assert_eq!(wide, ["o offset at most 0.2 s wide", "o offset above 0.2 s wide"]);
        let several = said(OperationKind::BurstLoss, vec![value("enter", 0.0, 0.1), value("leave", 0.2, 0.8)]);
        assert_eq!(several[1], "o enter, leave above 25 % of what is permitted, in the mean");
        let point = parameter("bias", Domain::Point { low: [0.0; 3], high: [1.0; 3] });
        assert_eq!(said(OperationKind::Bias, vec![point])[1], "o bias above 25 % of what is permitted, in the mean");
    }
}
