//! What is known of a test that may tell whether it fails, in numbers: its point in the reduced space, and of each
//! operation how often, when, how long and how strong.

use sesame_plan::{CampaignPlan, ChoiceKind, Dimension, Domain, OperationId, Span};
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
    };
    features.iter().map(|feature| number(feature).unwrap_or(f64::NAN)).collect()
}

fn mean(numbers: impl Iterator<Item = f64>) -> Option<f64> {
    let (sum, count) = numbers.fold((0.0, 0u32), |(sum, count), number| (sum + number, count + 1));
    (count > 0).then(|| sum / f64::from(count))
}

/// How strong an operation is, in the name and the unit of its parameter: `skew above 0.2 s`, or of a parameter that is
/// a sub-range how wide that is. `None` for an operation that has several parameters, or none of numbers.
fn strength(plan: &CampaignPlan, id: OperationId, share: f64, way: &str) -> Option<String> {
    let operation = plan.operation(id);
    let [parameter] = &operation.parameters[..] else { return None };
    let Domain::Number { low, high, shape, .. } = parameter.domain else { return None };
    let (factor, unit) = number::scale(&operation.kind, parameter, high);
    let written = |value: f64| number::with_unit(number::number(value * factor), unit);
    Some(match shape {
        ChoiceKind::Value => format!("{} {way} {}", parameter.name, written(low + share * (high - low))),
        ChoiceKind::Range => format!("{} {way} {} wide", parameter.name, written(share * (high - low))),
    })
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
            Feature::Share(id) => {
                let what = strength(plan, id, question.threshold, way);
                self.of_operation(plan, id, &what.unwrap_or_else(|| format!("has parameters {way} {at}")), missing)
            }
        }
    }

    fn of_operation(self, plan: &CampaignPlan, id: OperationId, what: &str, missing: bool) -> String {
        let name = &plan.operation(id).name;
        match (missing, self) {
            (false, _) => format!("{name} {what}"),
            (true, Feature::Share(_)) => format!("{name} {what} or there is none"),
            (true, _) => format!("{name} {what} or never"),
        }
    }
}
