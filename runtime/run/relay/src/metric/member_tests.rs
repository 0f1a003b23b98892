//! Formulas that read a member of a group by its name, and pairs of two groups, beside naive oracles: a topic of its
//! own for the member, or a loop over all instants.

use proptest::collection::vec;
use proptest::prelude::*;

use sesame_base::time::SimTime;
use sesame_plan::stl::{self, Interval, Robustness};
use sesame_plan::testing::{plan, topic};
use sesame_plan::{
    Aggregate, CampaignPlan, Comparison, Condition, Distance, Expression, FieldRef, Formula, Input, Members,
    MetricSource, Point, Side, TopicId, Type,
};

use crate::metric::MetricTable;
use crate::value::Value;
use crate::wire::WireTable;

const ROBOTS: TopicId = TopicId(0);
const PEOPLE: TopicId = TopicId(1);
const ALONE: TopicId = TopicId(2);

/// The paths of the first two groups, by position, and the topic of its own.
const PATHS: [&str; 6] = ["robots/a", "robots/b", "robots/c", "people/d", "people/e", "alone"];

/// A message: the instant in tenths of a second, the position of its path, and where it is along the x axis.
type Sent = (i64, usize, f64);

fn system() -> CampaignPlan {
    let mut plan = plan(Vec::new());
    let groups = [("robots", &PATHS[..3]), ("people", &PATHS[3..5]), ("alone", &PATHS[5..])];
    plan.topics = groups.map(|(name, paths)| topic(name, paths, Type::Point { unit: None })).to_vec();
    plan
}

fn input(topic: TopicId, members: Members) -> Input {
    Input::new(FieldRef { topic, path: Vec::new() }, members)
}

fn x_of(topic: TopicId, members: Members) -> Input {
    Input::new(FieldRef { topic, path: vec!["x".to_owned()] }, members)
}

fn apart() -> Expression {
    Expression::Distance(Box::new(Distance { from: Point::Input(0), to: Point::Input(1), scale: 1.0 }))
}

fn above(of: Expression) -> Condition {
    Condition::Compare { left: of, by: Comparison::Above, right: Expression::Constant(2.0) }
}

/// Every aggregate of an expression.
fn aggregates(of: &Expression) -> Vec<Aggregate> {
    let of = || of.clone();
    vec![
        Aggregate::Last { of: of() },
        Aggregate::Min { of: of() },
        Aggregate::Max { of: of() },
        Aggregate::Mean { of: of() },
        Aggregate::Count { of: above(of()) },
        Aggregate::Duration { of: above(of()) },
    ]
}

fn formula(inputs: Vec<Input>, aggregate: Aggregate) -> MetricSource {
    let formula = Formula { inputs, aggregate, when: None, every: None, per: None, side: Side::Inbound };
    MetricSource::Formula { formula }
}

/// That an expression is above two at all times, and that it becomes so again within half a second.
fn temporal(inputs: &[Input], of: &Expression) -> Vec<MetricSource> {
    let predicate = || stl::Formula::Predicate { signal: 0, comparison: Comparison::Above, constant: 2.0 };
    let always = |of| stl::Formula::Always { interval: Interval::UNBOUNDED, of: Box::new(of) };
    let soon = stl::Formula::Eventually { interval: Interval { from: 0.0, to: Some(0.5) }, of: Box::new(predicate()) };
    let source = |formula| MetricSource::Robustness {
        robustness: Robustness {
            inputs: inputs.to_vec(),
            signals: vec![of.clone()],
            formula,
            side: Side::Inbound,
            whole_windows: false,
        },
    };
    vec![source(always(predicate())), source(always(soon))]
}

/// The value of a metric after these messages, in a run that ends at 3 s, or breaks off.
fn value(source: MetricSource, sent: &[Sent], ends: bool) -> Option<f64> {
    let mut plan = system();
    plan.metrics.truncate(1);
    plan.metrics[0].source = source;
    plan.validate().unwrap();
    let wires = WireTable::new(&plan);
    let table = MetricTable::new(&plan, &wires, &[]).unwrap();
    let mut metrics = table.start();
    metrics.begin();
    for &(time, path, x) in sent {
        let now = SimTime::from_nanos(time * 100_000_000);
        metrics.advance_to(now);
        metrics.message(now, wires.find(PATHS[path]).unwrap(), &Value::Point([x, 0.0, 0.0]));
    }
    if ends {
        metrics.end(SimTime::from_seconds(3.0));
    }
    metrics.finish(&[]).0.remove(0).value
}

fn streams() -> impl Strategy<Value = Vec<Sent>> {
    vec((0i64..20, 0usize..5, -5i32..6), 0..30).prop_map(|mut sent| {
        sent.sort_by_key(|message| message.0);
        sent.into_iter().map(|(time, path, x)| (time, path, f64::from(x))).collect()
    })
}

/// Where each path is after an instant, and which of them spoke in it, for all instants with a message.
fn instants(sent: &[Sent]) -> Vec<([Option<f64>; 5], [bool; 5])> {
    let mut at = [None; 5];
    let mut found: Vec<(i64, [Option<f64>; 5], [bool; 5])> = Vec::new();
    for &(time, path, x) in sent {
        at[path] = Some(x);
        if found.last().is_none_or(|last| last.0 != time) {
            found.push((time, at, [false; 5]));
        }
        let last = found.last_mut().expect("there is one");
        (last.1, last.2[path]) = (at, true);
    }
    found.into_iter().map(|(_, at, spoke)| (at, spoke)).collect()
}

/// The distances of pairs at every instant in which one of both spoke, once both have.
fn distances(sent: &[Sent], pairs: &[(usize, usize)]) -> Vec<f64> {
    let of_instant = |(at, spoke): ([Option<f64>; 5], [bool; 5])| {
        let told = pairs.iter().filter(move |(one, other)| spoke[*one] || spoke[*other]);
        let apart = told.filter_map(|&(one, other)| Some((at[one]? - at[other]?).abs()));
        apart.collect::<Vec<f64>>()
    };
    instants(sent).into_iter().flat_map(of_instant).collect()
}

proptest! {
    #[test]
    fn a_member_is_read_as_a_topic_of_its_own_would_be(sent in streams(), member in 0usize..3, ends in any::<bool>()) {
        let only = Members::Only(u32::try_from(member).unwrap());
        // The same with the member's messages on a topic of their own. Those of others have nothing to do with it.
        let own = |path: usize| if path == member { 5 } else { path };
        let moved: Vec<Sent> = sent.iter().map(|&(time, path, x)| (time, own(path), x)).collect();
        let x = Expression::Input(0);
        let named = aggregates(&x).into_iter().map(|of| formula(vec![x_of(ROBOTS, only)], of));
        let alone = aggregates(&x).into_iter().map(|of| formula(vec![x_of(ALONE, Members::Min)], of));
        let named = named.chain(temporal(&[x_of(ROBOTS, only)], &x));
        let alone = alone.chain(temporal(&[x_of(ALONE, Members::Min)], &x));
        for (named, alone) in named.zip(alone) {
            let found = value(named.clone(), &sent, ends);
            prop_assert_eq!(found, value(alone, &moved, ends), "{:?}", named);
        }
    }

    #[test]
    fn a_member_and_each_other_are_as_pairs_with_it(sent in streams(), member in 0usize..3) {
        let only = Members::Only(u32::try_from(member).unwrap());
        let inputs = || vec![input(ROBOTS, only), input(ROBOTS, Members::Each)];
        let pairs: Vec<(usize, usize)> = (0..3).filter(|&other| other != member).map(|other| (member, other)).collect();
        agree(inputs, &distances(&sent, &pairs), &sent)?;
    }

    #[test]
    fn each_of_one_group_meets_each_of_another(sent in streams()) {
        let inputs = || vec![input(ROBOTS, Members::First), input(PEOPLE, Members::Second)];
        let pairs: Vec<(usize, usize)> = (0..3).flat_map(|one| (3..5).map(move |other| (one, other))).collect();
        agree(inputs, &distances(&sent, &pairs), &sent)?;
    }

    #[test]
    fn two_members_are_read_together(sent in streams()) {
        let inputs = || vec![input(ROBOTS, Members::Only(0)), input(ROBOTS, Members::Only(2))];
        agree(inputs, &distances(&sent, &[(0, 2)]), &sent)?;
    }
}

/// Whether the formulas over a distance are what the distances at all instants come to.
fn agree(inputs: impl Fn() -> Vec<Input>, distances: &[f64], sent: &[Sent]) -> Result<(), TestCaseError> {
    let of = |aggregate| value(formula(inputs(), aggregate), sent, true);
    let all = || distances.iter().copied();
    prop_assert_eq!(of(Aggregate::Min { of: apart() }), all().reduce(f64::min));
    prop_assert_eq!(of(Aggregate::Max { of: apart() }), all().reduce(f64::max));
    let count = all().filter(|distance| *distance > 2.0).count() as f64;
    let counted = of(Aggregate::Count { of: above(apart()) });
    prop_assert_eq!(counted, (!distances.is_empty()).then_some(count));
    let [always, _] = temporal(&inputs(), &apart()).try_into().expect("there are two");
    prop_assert_eq!(value(always, sent, true), all().reduce(f64::min).map(|least| least - 2.0));
    Ok(())
}
