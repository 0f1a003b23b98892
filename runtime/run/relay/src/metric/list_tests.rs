//! Formulas over lists, beside a naive oracle that looks at the whole stream at once.

use proptest::prelude::*;

use sesame_base::time::SimTime;
use sesame_plan::testing::plan;
use sesame_plan::{
    Aggregate, CampaignPlan, Compared, Comparison, Condition, Distance, Expression, FieldRef, Filter, FilterKey,
    Finite, Formula, InList, Input, Members, MetricSource, Point, Reduction, Side, Step, TextTest, TopicId, Type,
};

use crate::metric::MetricTable;
use crate::value::{Fields, Record, Value};
use crate::wire::WireTable;

/// An element: its name and its number.
type Element = (&'static str, f64);

const NAMES: [&str; 3] = ["elbow", "wrist", "base"];

fn system() -> CampaignPlan {
    let mut plan = plan(Vec::new());
    let mut topic = plan.topics[0].clone();
    topic.paths = vec!["a".to_owned(), "b".to_owned()];
    topic.ty = Type::Text;
    plan.topics = vec![topic];
    plan.metrics.truncate(1);
    plan
}

/// A message with these elements, as two parallel lists and as a list of records.
fn payload(elements: &[Element]) -> Value {
    let part = Fields::new(["name", "number", "at"]);
    let names = elements.iter().map(|(name, _)| Value::from(*name)).collect();
    let numbers = elements.iter().map(|(_, number)| Value::Real(*number)).collect();
    let parts = elements.iter().map(|&(name, number)| {
        let values = vec![Value::from(name), Value::Real(number), Value::Point([number, 0.0, 0.0])];
        Record::new(&part, values).into()
    });
    let fields = Fields::new(["names", "numbers", "parts"]);
    Record::new(&fields, vec![Value::List(names), Value::List(numbers), Value::List(parts.collect())]).into()
}

fn in_list(list: &str, steps: Vec<Step>, reduction: Reduction) -> Input {
    Input {
        field: FieldRef { topic: TopicId(0), path: vec![list.to_owned()] },
        members: Members::Min,
        list: Some(InList { steps, reduction }),
        text: None,
        memory: Vec::new(),
    }
}

fn named(key: FilterKey, name: &str) -> Step {
    Step::Filter(Filter { key, by: Comparison::Equal, with: Compared::Text(name.to_owned()) })
}

fn field(name: &str) -> Step {
    Step::Field(name.to_owned())
}

fn parallel(name: &str) -> Step {
    named(FilterKey::Parallel("names".to_owned()), name)
}

fn own(name: &str) -> Step {
    named(FilterKey::Own(vec!["name".to_owned()]), name)
}

fn above(limit: f64) -> Step {
    let with = Compared::Number { value: Finite(limit), unit: None };
    Step::Filter(Filter { key: FilterKey::Own(Vec::new()), by: Comparison::Above, with })
}

/// Value and warnings of a formula after a run with these messages on one path, one each second.
fn measured(inputs: Vec<Input>, aggregate: Aggregate, sent: &[Vec<Element>]) -> (Option<f64>, Vec<String>) {
    let mut plan = system();
    let formula = Formula { inputs, aggregate, when: None, every: None, per: None, side: Side::Inbound };
    plan.topics[0].paths.truncate(1);
    plan.metrics[0].source = MetricSource::Formula { formula };
    let wires = WireTable::new(&plan);
    let table = MetricTable::new(&plan, &wires, &[]).unwrap();
    let mut metrics = table.start();
    metrics.begin();
    for (second, elements) in (0..).zip(sent) {
        metrics.message(SimTime::from_nanos(second * 1_000_000_000), wires.find("a").unwrap(), &payload(elements));
    }
    metrics.end(SimTime::from_seconds(100.0));
    let (mut observed, warnings) = metrics.finish(&[]);
    (observed.remove(0).value, warnings)
}

fn value(input: Input, aggregate: fn(Expression) -> Aggregate, sent: &[Vec<Element>]) -> Option<f64> {
    measured(vec![input], aggregate(Expression::Input(0)), sent).0
}

fn last(of: Expression) -> Aggregate {
    Aggregate::Last { of }
}

fn greatest(of: Expression) -> Aggregate {
    Aggregate::Max { of }
}

fn count(limit: f64) -> Aggregate {
    let (left, right) = (Expression::Input(0), Expression::Constant(limit));
    Aggregate::Count { of: Condition::Compare { left, by: Comparison::Above, right } }
}

#[test]
fn an_element_by_its_key_is_found_wherever_it_is() {
    let sent = [vec![("elbow", 1.0), ("wrist", 2.0)], vec![("wrist", 4.0), ("elbow", 3.0)]];
    for (list, steps) in [("numbers", vec![parallel("elbow")]), ("parts", vec![own("elbow"), field("number")])] {
        let input = || in_list(list, steps.clone(), Reduction::First);
        assert_eq!(value(input(), last, &sent), Some(3.0), "{list}");
        assert_eq!(value(input(), |of| Aggregate::Mean { of }, &sent), Some(2.0), "{list}");
    }
    let at = vec![own("wrist"), field("at"), field("x")];
    assert_eq!(value(in_list("parts", at, Reduction::First), last, &sent), Some(4.0), "a coordinate");
}

#[test]
fn a_message_without_the_element_is_as_if_it_had_not_come() {
    let sent = [vec![("elbow", 1.0)], vec![("wrist", 9.0)], vec![], vec![("elbow", 3.0)]];
    let elbow = || in_list("numbers", vec![parallel("elbow")], Reduction::First);
    assert_eq!(measured(vec![elbow()], count(0.0), &sent).0, Some(2.0), "two of four messages have it");
    // The parts of a transform tree come in messages of their own.
    let both = vec![elbow(), in_list("numbers", vec![parallel("wrist")], Reduction::First)];
    let apart = Expression::Sum(vec![Expression::Input(1), Expression::Negate(Box::new(Expression::Input(0)))]);
    assert_eq!(measured(both, Aggregate::Last { of: apart }, &sent).0, Some(6.0));
    assert_eq!(value(in_list("numbers", vec![Step::Element(1)], Reduction::First), last, &sent), None);
    assert_eq!(value(in_list("numbers", vec![Step::Each], Reduction::Min), last, &sent), Some(3.0));
    assert_eq!(
        value(in_list("numbers", vec![Step::Each], Reduction::Sum), |of| Aggregate::Min { of }, &sent),
        Some(0.0)
    );
    assert_eq!(value(in_list("numbers", Vec::new(), Reduction::Length), |of| Aggregate::Min { of }, &sent), Some(0.0));
}

#[test]
fn of_several_elements_the_first_counts_and_that_is_noted() {
    let sent = [vec![("elbow", 1.0), ("elbow", 2.0)]];
    let input = in_list("numbers", vec![parallel("elbow")], Reduction::First);
    let (value, warnings) = measured(vec![input], Aggregate::Last { of: Expression::Input(0) }, &sent);
    assert_eq!(value, Some(1.0));
    assert!(
        warnings[0].contains("several elements are `numbers[names == \"elbow\"]`; the first one counts"),
        "{warnings:?}"
    );
}

#[test]
fn numbers_that_are_not_finite_are_left_out_of_many_and_open_as_one() {
    let sent = [vec![("elbow", f64::INFINITY), ("wrist", 2.0), ("base", f64::NAN), ("base", 4.0)]];
    let of = |reduction| value(in_list("numbers", vec![Step::Each], reduction), last, &sent);
    assert_eq!([Reduction::Min, Reduction::Max, Reduction::Mean].map(of), [Some(2.0), Some(4.0), Some(3.0)]);
    assert_eq!([Reduction::Sum, Reduction::Count].map(of), [Some(6.0), Some(4.0)]);
    assert_eq!(value(in_list("numbers", vec![Step::Element(0)], Reduction::First), last, &sent), None);
}

#[test]
fn texts_and_truths_hold_of_all_or_of_any() {
    let sent = [vec![("elbow", 1.0), ("wrist", 2.0)], vec![("elbow", 1.0)], vec![("base", 1.0)]];
    let of = |reduction| {
        let text = Some(TextTest::Is("elbow".to_owned()));
        let input = Input { text, ..in_list("names", vec![Step::Each], reduction) };
        measured(vec![input], Aggregate::Count { of: Condition::Input(0) }, &sent).0
    };
    assert_eq!(of(Reduction::Min), Some(1.0), "of all");
    assert_eq!(of(Reduction::Max), Some(2.0), "of any");
}

#[test]
fn the_distance_of_each_element_counts() {
    let sent = [vec![("elbow", -3.0), ("wrist", 5.0)], vec![], vec![("elbow", 2.0)]];
    let steps = vec![Step::Each, field("at")];
    let from = Point::Constant([0.0; 3]);
    let of = Expression::Distance(Box::new(Distance { from, to: Point::Input(0), scale: 1.0 }));
    let input = || vec![in_list("parts", steps.clone(), Reduction::Each)];
    assert_eq!(measured(input(), Aggregate::Min { of: of.clone() }, &sent).0, Some(2.0));
    assert_eq!(measured(input(), Aggregate::Max { of: of.clone() }, &sent).0, Some(5.0));
    assert_eq!(measured(input(), Aggregate::Mean { of: of.clone() }, &sent).0, Some(10.0 / 3.0));
}

const REDUCTIONS: [Reduction; 6] =
    [Reduction::Min, Reduction::Max, Reduction::Sum, Reduction::Mean, Reduction::Count, Reduction::First];

fn element() -> impl Strategy<Value = Element> {
    (prop::sample::select(&NAMES), (-8i32..9).prop_map(|n| f64::from(n) / 2.0))
}

proptest! {
    #[test]
    fn a_reduction_is_what_the_chosen_elements_make(
        sent in prop::collection::vec(prop::collection::vec(element(), 0..5), 1..6),
        first in 0u32..4, length in 0u32..4, limit in -4i32..4, chosen in 0usize..5, reduced in 0usize..6,
    ) {
        let limit = f64::from(limit);
        let step = match chosen {
            0 => Step::Each,
            1 => Step::Element(first),
            2 => Step::Elements { first, last: first + length },
            3 => parallel("elbow"),
            _ => above(limit),
        };
        let reduction = REDUCTIONS[reduced];
        let expected = sent.iter().filter_map(|elements| {
            let of_step = |&(at, (name, number)): &(usize, &Element)| match chosen {
                0 => true,
                1 => at == first as usize,
                2 => (first as usize..=(first + length) as usize).contains(&at),
                3 => *name == "elbow",
                _ => *number > limit,
            };
            let numbers: Vec<f64> = elements.iter().enumerate().filter(of_step).map(|(_, element)| element.1).collect();
            match reduction {
                Reduction::Min => numbers.into_iter().reduce(f64::min),
                Reduction::Max => numbers.into_iter().reduce(f64::max),
                Reduction::Sum => Some(numbers.iter().sum()),
                Reduction::Mean => (!numbers.is_empty()).then(|| numbers.iter().sum::<f64>() / numbers.len() as f64),
                Reduction::Count => Some(numbers.len() as f64),
                _ => numbers.first().copied(),
            }
        });
        let expected = expected.reduce(f64::max);
        prop_assert_eq!(value(in_list("numbers", vec![step], reduction), greatest, &sent), expected);
    }
}
