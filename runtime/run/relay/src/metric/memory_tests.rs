//! Previous values, rates and integrals in formulas, beside naive oracles that look at the whole stream at once.

use proptest::prelude::*;

use sesame_base::time::SimTime;
use sesame_plan::stl::{self, Interval, Robustness};
use sesame_plan::testing::{plan, topic};
use sesame_plan::{
    Aggregate, Comparison, Condition, Expression, FieldRef, Formula, Input, Members, Memory, MetricSource, Side,
    TopicId, Transport, Type,
};

use crate::metric::MetricTable;
use crate::value::{Fields, Record, Value};
use crate::wire::WireTable;

/// A message: milliseconds, path, number.
type Sent = (i64, &'static str, f64);

const ROBOTS: [&str; 2] = ["robots/a", "robots/b"];

/// What the `x` of robots is, and what is computed from its successive values.
fn input(members: Members, memory: &[Memory]) -> Input {
    let field = FieldRef { topic: TopicId(0), path: vec!["x".to_owned()] };
    Input { field, members, list: None, text: None, memory: memory.to_vec() }
}

fn formula(input: Input, aggregate: Aggregate) -> Formula {
    Formula { inputs: vec![input], aggregate, when: None, every: None, per: None, side: Side::Inbound }
}

/// The value after a run of ten seconds, in a system with steps of 100 ms or without.
fn measured(source: MetricSource, stepped: bool, sent: &[Sent]) -> Option<f64> {
    let mut plan = plan(Vec::new());
    plan.topics = vec![topic("robots", &ROBOTS, Type::Text), topic("lamp", &["lamp"], Type::Text)];
    let step_ns = stepped.then_some(100_000_000);
    plan.simulator.transport = Transport::Process { program: "hall".to_owned(), arguments: Vec::new(), step_ns };
    plan.metrics.truncate(1);
    plan.metrics[0].source = source;
    let wires = WireTable::new(&plan);
    let table = MetricTable::new(&plan, &wires, &[]).unwrap();
    let mut metrics = table.start();
    metrics.begin();
    let fields = Fields::new(["x", "name"]);
    for &(time, path, x) in sent {
        let name = if x >= 0.0 { "up" } else { "down" };
        let message = Record::new(&fields, vec![Value::Real(x), Value::from(name)]).into();
        metrics.message(SimTime::from_nanos(time * 1_000_000), wires.find(path).unwrap(), &message);
    }
    metrics.end(SimTime::from_seconds(10.0));
    metrics.finish(&[]).0.remove(0).value
}

fn value(formula: Formula, stepped: bool, sent: &[Sent]) -> Option<f64> {
    measured(MetricSource::Formula { formula }, stepped, sent)
}

#[test]
fn an_integral_is_that_until_the_end_of_the_run() {
    let sent = [(1_000, ROBOTS[0], 3.0), (4_000, ROBOTS[0], -1.0)];
    let energy = || input(Members::Only(0), &[Memory::Integral]);
    let of = Expression::Integral(0);
    for stepped in [true, false] {
        assert_eq!(value(formula(energy(), Aggregate::Last { of: of.clone() }), stepped, &sent), Some(3.0));
        let most = value(formula(energy(), Aggregate::Max { of: of.clone() }), stepped, &sent).unwrap();
        assert!((most - 9.0).abs() < 1e-6, "{most}");
        assert_eq!(value(formula(energy(), Aggregate::Mean { of: of.clone() }), stepped, &sent), Some(4.5), "messages");
    }
}

#[test]
fn an_integral_in_a_comparison_is_followed_between_messages() {
    let sent = [(1_000, ROBOTS[0], 3.0), (4_000, ROBOTS[0], 0.0)];
    let above =
        Condition::Compare { left: Expression::Integral(0), by: Comparison::AtLeast, right: Expression::Constant(4.5) };
    let long = |stepped| {
        let of = above.clone();
        value(formula(input(Members::Only(0), &[Memory::Integral]), Aggregate::Duration { of }), stepped, &sent)
    };
    assert_eq!(long(false), Some(10.0 - 2.5));
    assert_eq!(long(true), Some(10.0 - 2.5));
}

#[test]
fn messages_of_another_topic_are_no_next_value() {
    let mut changes = formula(
        input(Members::Only(0), &[Memory::Previous]),
        Aggregate::Last { of: Expression::Sum(vec![Expression::Input(0), Expression::Input(1)]) },
    );
    let lamp = FieldRef { topic: TopicId(1), path: vec!["x".to_owned()] };
    changes.inputs.push(Input { field: lamp, ..input(Members::Min, &[]) });
    let sent = [(0, ROBOTS[0], 5.0), (100, ROBOTS[0], 7.0), (200, "lamp", 0.5), (300, "lamp", 0.25)];
    assert_eq!(value(changes, true, &sent), Some(5.25));
}

#[test]
fn each_key_has_a_memory_of_its_own() {
    let mut of = formula(input(Members::Only(0), &[Memory::Previous]), Aggregate::Max { of: Expression::Input(0) });
    of.per = Some(FieldRef { topic: TopicId(0), path: vec!["name".to_owned()] });
    let sent = [(0, ROBOTS[0], 5.0), (100, ROBOTS[0], -2.0), (200, ROBOTS[0], -1.0), (300, ROBOTS[0], 3.0)];
    assert_eq!(value(of.clone(), true, &sent), Some(5.0));
    assert_eq!(value(of, true, &sent[..3]), Some(-2.0));
}

#[test]
fn a_robustness_begins_when_there_is_a_rate_and_each_member_has_its_own() {
    let steady = |members, sent: &[Sent]| {
        let above = stl::Formula::Predicate { signal: 0, comparison: Comparison::Above, constant: 0.0 };
        let formula = stl::Formula::Always { interval: Interval::UNBOUNDED, of: Box::new(above) };
        let inputs = vec![input(members, &[Memory::Rate])];
        let signals = vec![Expression::Input(0)];
        let robustness = Robustness { inputs, signals, formula, side: Side::Inbound, whole_windows: false };
        measured(MetricSource::Robustness { robustness }, true, sent)
    };
    let sent = [(0, ROBOTS[0], 5.0), (500, ROBOTS[1], 1.0), (1_000, ROBOTS[0], 7.0), (1_000, ROBOTS[1], 1.5)];
    assert_eq!(steady(Members::Each, &sent), Some(1.0));
    assert_eq!(steady(Members::Only(0), &sent), Some(2.0));
    assert_eq!(steady(Members::Each, &sent[..2]), None);
}

proptest! {
    /// The greatest rate of any robot and the last value before the last one, with robots that speak at any times.
    #[test]
    fn members_have_memories_of_their_own(
        sent in prop::collection::vec((0..400_i64, 0..2_usize, -20..20_i32), 1..20),
    ) {
        let mut time = 0;
        let sent: Vec<Sent> = sent.into_iter().map(|(after, robot, x)| {
            time += (after - 100).max(0);
            (time, ROBOTS[robot], f64::from(x))
        }).collect();
        let rate_at = |at: usize| {
            let (now, robot, x) = sent[at];
            let before = sent[..at].iter().rev().find(|message| message.1 == robot && message.0 < now)?;
            Some((x - before.2) / ((now - before.0) as f64 * 1e-3))
        };
        let expected = (0..sent.len()).filter_map(rate_at).reduce(f64::max);
        let of = Expression::Input(0);
        let rates = formula(input(Members::Each, &[Memory::Rate]), Aggregate::Max { of });
        let found = value(rates, true, &sent);
        match (found, expected) {
            (Some(found), Some(expected)) => prop_assert!((found - expected).abs() < 1e-9, "{found} {expected}"),
            (found, expected) => prop_assert_eq!(found, expected),
        }
        let previous = |robot: &str| {
            let all: Vec<f64> = sent.iter().filter(|message| message.1 == robot).map(|message| message.2).collect();
            all.len().checked_sub(2).map(|at| all[at])
        };
        let expected = ROBOTS.into_iter().filter_map(previous).reduce(|a, b| a + b);
        let of = Expression::Input(0);
        let sum = formula(input(Members::Sum, &[Memory::Previous]), Aggregate::Last { of });
        prop_assert_eq!(value(sum, true, &sent), expected);
    }
}
