//! What a test chooses for a parameter of the space is, in formulas of metrics, as good as a written number, and so is
//! the usual value of a parameter for which it chooses none.

use sesame_plan::testing;
use sesame_plan::{
    Activation, Aggregate, Choice, ChoiceKind, Condition, Domain, Expression, MetricSource, OperationId, OperationKind,
    TestOperation,
};
use sesame_rng::Stream;

use super::{compare_activity, compare_ends, compare_metrics};
use crate::adapter;
use crate::case::Case;
use crate::properties::all_hold;
use crate::words;

/// A case in which numbers of formulas have become parameters of the space.
struct Chosen {
    case: Case,
    stream: Stream,
    numbers: usize,
}

impl Chosen {
    fn of(case: &Case) -> Chosen {
        let stream = Stream::derive(case.number, "scenes", &[]);
        let mut chosen = Chosen { case: case.clone(), stream, numbers: 0 };
        let mut metrics = std::mem::take(&mut chosen.case.plan.metrics);
        for metric in &mut metrics {
            match &mut metric.source {
                MetricSource::Formula { formula } => {
                    formula.when.iter_mut().for_each(|when| chosen.condition(when));
                    match &mut formula.aggregate {
                        Aggregate::Last { of }
                        | Aggregate::Min { of }
                        | Aggregate::Max { of }
                        | Aggregate::Mean { of } => chosen.expression(of),
                        Aggregate::Count { of } | Aggregate::Duration { of } => chosen.condition(of),
                    }
                }
                MetricSource::Robustness { robustness } => {
                    robustness.signals.iter_mut().for_each(|signal| chosen.expression(signal));
                }
                _ => {}
            }
        }
        chosen.case.plan.metrics = metrics;
        chosen
    }

    fn condition(&mut self, of: &mut Condition) {
        match of {
            Condition::Constant(_) | Condition::Input(_) => {}
            Condition::Compare { left, right, by: _ } => {
                self.expression(left);
                self.expression(right);
            }
            Condition::Same { left, right } => {
                self.condition(left);
                self.condition(right);
            }
            Condition::All(of) | Condition::Any(of) => of.iter_mut().for_each(|of| self.condition(of)),
            Condition::Not(of) => self.condition(of),
        }
    }

    fn expression(&mut self, of: &mut Expression) {
        match of {
            Expression::Constant(number) => *of = self.parameter(*number),
            Expression::Negate(of) | Expression::Absolute(of) | Expression::Unary { of, .. } => self.expression(of),
            Expression::Divide { value: left, by: right } | Expression::Binary { left, right, .. } => {
                self.expression(left);
                self.expression(right);
            }
            Expression::Sum(of) | Expression::Product(of) | Expression::Min(of) | Expression::Max(of) => {
                for of in of {
                    self.expression(of);
                }
            }
            Expression::Input(_)
            | Expression::Integral(_)
            | Expression::Distance(_)
            | Expression::SignedDistance(_)
            | Expression::Time
            | Expression::Now
            | Expression::Scene { .. } => {}
        }
    }

    /// A parameter that has this value in the test: because it is chosen, or because it is the usual one of a parameter
    /// that the campaign may lack.
    fn parameter(&mut self, value: f64) -> Expression {
        self.numbers += 1;
        let name = format!("scene{}", self.numbers);
        let is_chosen = self.stream.chance(0.6);
        let usual = if is_chosen { value + 1.0 } else { value };
        if is_chosen || self.stream.chance(0.5) {
            let domain =
                Domain::Number { low: value - 2.0, high: value + 2.0, shape: ChoiceKind::Value, integer: false };
            let known_as = format!("simulator/{name}");
            self.case.script.parameters.push(known_as.clone());
            let kind = OperationKind::Scene { parameter: Some(known_as), usual: Some(usual) };
            let parameters = vec![testing::parameter("value", domain)];
            let operations = &mut self.case.plan.operations;
            let operation = OperationId(u32::try_from(operations.len()).unwrap());
            operations.push(testing::operation_with(&name, 0, kind, parameters));
            if is_chosen {
                self.case.test.operations.push(TestOperation {
                    operation,
                    activation: Activation::Offline,
                    parameters: vec![Choice::Value { value }],
                    operation_seed: 0,
                    messages: None,
                });
            }
        }
        Expression::Scene { operation: name, usual }
    }
}

fn differences(case: &Case) -> Vec<String> {
    let other = Chosen::of(case).case;
    let (before, _) = adapter::run(&case.plan, &case.test, &case.script);
    let (now, _) = adapter::run(&other.plan, &other.test, &other.script);
    let mut wrong = Vec::new();
    // A scene always has an effect.
    compare_ends(&before, &now, true, &mut wrong);
    for (at, metric) in case.plan.metrics.iter().enumerate() {
        compare_metrics(metric, &before.metrics[at], &now.metrics[at], &mut wrong);
    }
    for ((used, before), now) in case.test.operations.iter().zip(&before.operations).zip(&now.operations) {
        compare_activity(&case.plan.operation(used.operation).name, before, now, &mut wrong);
    }
    if !wrong.is_empty() {
        wrong.push(format!("before:\n{}\nnow:\n{}", words::case(case), words::case(&other)));
    }
    wrong
}

#[test]
fn what_a_test_chooses_for_the_space_is_as_good_as_a_written_number() {
    all_hold(0..600, differences);
}

#[test]
#[ignore = "long: 100,000 random spaces, each run twice"]
fn what_a_test_chooses_for_the_space_is_as_good_as_a_written_number_in_many_cases() {
    all_hold(2_000..102_000, differences);
}

/// Otherwise the property would hold of nothing.
#[test]
fn many_cases_have_numbers_in_formulas() {
    let cases = (0..200).map(Case::of).filter(|case| Chosen::of(case).numbers > 0).count();
    assert!(cases > 50, "{cases}");
}
