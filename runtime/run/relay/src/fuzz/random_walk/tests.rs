//! A random walk compared with a straight sum of its steps, and its distribution over many seeds.

use std::collections::BTreeMap;

use proptest::prelude::*;

use sesame_base::time::SimTime;
use sesame_plan::testing::{operation, use_of};
use sesame_plan::{Choice, OperationKind, Step};

use crate::fuzz::{Action, Disturbance, KeyedRng, MessageContext, OnWire};
use crate::value::Value;

/// A walk of all elements of a list, or of the whole message.
fn walk(sigma: f64, seed: u64, each: bool) -> Disturbance {
    let mut walk = operation(0, OperationKind::RandomWalk);
    walk.places = if each { vec![vec![Step::Each]] } else { Vec::new() };
    let used = use_of(0, 0.0, 10.0, vec![Choice::Value { value: sigma }], seed);
    let mut disturbance = Disturbance::new(&walk, &used, &[]).unwrap();
    disturbance.begin();
    disturbance
}

/// A message that comes when the operation has been active for some milliseconds.
#[derive(Debug, Clone, Copy)]
struct At {
    millis: i64,
    member: u64,
    index: u64,
}

fn apply(walk: &mut Disturbance, seed: u64, at: At, message: &mut Value) -> Action {
    let active = SimTime::from_nanos(at.millis * 1_000_000);
    let draws = KeyedRng::new(seed, at.member, at.index);
    let now = SimTime::from_seconds(3.0) + active;
    walk.apply(MessageContext { now, active, on: OnWire { member: at.member, target: 0 }, draws }, message)
}

/// Where the walk of a zero is at each of these milliseconds, as numbers; points are three, lists as many as they have.
fn walked(sigma: f64, seed: u64, member: u64, zero: &Value, millis: &[i64]) -> Vec<Vec<f64>> {
    let mut walk = walk(sigma, seed, matches!(zero, Value::List(_)));
    let one = |(index, &millis): (u64, &i64)| {
        let mut message = zero.clone();
        apply(&mut walk, seed, At { millis, member, index }, &mut message);
        numbers(&message)
    };
    (0..).zip(millis).map(one).collect()
}

fn numbers(value: &Value) -> Vec<f64> {
    match value {
        Value::Real(x) => vec![*x],
        Value::Int(n) => vec![*n as f64],
        Value::Point(point) => point.to_vec(),
        Value::List(items) => items.iter().flat_map(numbers).collect(),
        other => panic!("{other:?} has no numbers"),
    }
}

/// A message of a list: milliseconds after the previous one, the member, how long the list is, whether the walk begins
/// anew before it, whether its first element is not a number, and the type of its elements.
type Event = (i64, u64, usize, bool, bool);

proptest! {
    #[test]
    fn a_walk_is_the_sum_of_its_steps(
        seed: u64,
        sigma in 0.0..9.0f64,
        whole: bool,
        events in prop::collection::vec((0i64..400, 0u64..3, 0usize..4, prop::bool::weighted(0.1), any::<bool>()), 0..40),
    ) {
        let events: Vec<Event> = events;
        let mut walk = walk(sigma, seed, true);
        let mut published = [0u64; 3];
        // By member and position: the steps so far, as the message's index and the time that the step took in seconds.
        let mut steps: BTreeMap<(u64, usize), Vec<(u64, f64)>> = BTreeMap::new();
        let mut last: BTreeMap<(u64, usize), i64> = BTreeMap::new();
        let mut now = 0;
        for (gap, member, length, afresh, nan) in events {
            now += gap;
            if afresh {
                walk.begin();
                (now, steps, last) = (gap, BTreeMap::new(), BTreeMap::new());
            }
            let index = published[usize::try_from(member).unwrap()];
            published[usize::try_from(member).unwrap()] += 1;
            let item = |at: usize| match (whole, at) {
                (true, _) => Value::Int(7),
                (false, 0) if nan => Value::Real(f64::NAN),
                (false, _) => Value::Real(0.5),
            };
            let mut message = Value::List((0..length).map(item).collect());
            apply(&mut walk, seed, At { millis: now, member, index }, &mut message);
            for (at, found) in numbers(&message).into_iter().enumerate() {
                let taken = now - last.insert((member, at), now).unwrap_or(0);
                let steps = steps.entry((member, at)).or_default();
                steps.push((index, taken as f64 / 1e3));
                let draw = |index| KeyedRng::new(seed, member, index).normal(8 * at as u64);
                let sum: f64 = steps.iter().map(|&(index, seconds)| sigma * libm::sqrt(seconds) * draw(index)).sum();
                match item(at) {
                    Value::Int(_) => prop_assert!((found - 7.0 - sum).abs() <= 0.5 + 1e-9, "{} is {}", found, sum),
                    _ if nan && at == 0 => prop_assert!(found.is_nan()),
                    _ => prop_assert!((found - 0.5 - sum).abs() < 1e-9, "{} is {}", found, sum),
                }
            }
        }
    }

    #[test]
    fn without_a_deviation_nothing_changes(seed: u64, x: f64, n: i64, millis in prop::collection::vec(0i64..5_000, 1..9)) {
        let mut millis = millis;
        millis.sort_unstable();
        for value in [Value::Real(x), Value::Int(n), Value::Point([x, -x, 0.0])] {
            let mut walk = walk(0.0, seed, false);
            for (index, &millis) in (0..).zip(&millis) {
                let mut message = value.clone();
                let action = apply(&mut walk, seed, At { millis, member: 0, index }, &mut message);
                prop_assert_eq!(action, Action::Unchanged);
                prop_assert_eq!(&message, &value);
            }
        }
    }

    #[test]
    fn the_same_seed_gives_the_same_bits(seed: u64, sigma in 0.0..9.0f64) {
        let millis: Vec<i64> = (1..50).map(|n| n * 37).collect();
        let bits = || -> Vec<u64> {
            let walked = walked(sigma, seed, 0, &Value::Point([0.0; 3]), &millis);
            walked.into_iter().flatten().map(f64::to_bits).collect()
        };
        prop_assert_eq!(bits(), bits());
    }
}

const SEEDS: u64 = 4_000;

/// The walk is at the ends of these vectors, per seed.
fn ends(member: u64, zero: &Value, millis: &[i64]) -> Vec<Vec<f64>> {
    (0..SEEDS).map(|seed| walked(0.5, seed, member, zero, millis).pop().unwrap()).collect()
}

/// The mean of products of numbers whose own means are 0.
fn covariance(pairs: impl Iterator<Item = (f64, f64)>) -> f64 {
    pairs.map(|(a, b)| a * b).sum::<f64>() / SEEDS as f64
}

#[test]
fn the_variance_grows_with_the_time_and_not_with_the_number_of_messages() {
    for seconds in [1, 4] {
        let until = 1000 * seconds;
        let rates: [Vec<i64>; 4] = [
            vec![until],
            (0..=10 * seconds).map(|n| 100 * n).collect(),
            // Two messages at each time.
            (0..=20 * seconds).map(|n| n / 2 * 100).collect(),
            // Ever less often.
            (1..20).map(|n| n * n * 10).filter(|&millis| millis < until).chain([until]).collect(),
        ];
        for millis in &rates {
            let expected = 0.25 * seconds as f64;
            let ends: Vec<f64> = ends(0, &Value::Real(0.0), millis).into_iter().flatten().collect();
            let mean = ends.iter().sum::<f64>() / ends.len() as f64;
            let variance = covariance(ends.iter().map(|&x| (x, x)));
            // Five standard errors, of the mean and of the variance of normally distributed numbers.
            let (of_mean, of_variance) = ((expected / SEEDS as f64).sqrt(), expected * (2.0 / SEEDS as f64).sqrt());
            assert!(mean.abs() < 5.0 * of_mean, "{} messages in {seconds} s: mean {mean}", millis.len());
            assert!(
                (variance - expected).abs() < 5.0 * of_variance,
                "{} messages in {seconds} s: variance {variance}, not {expected}",
                millis.len()
            );
        }
    }
}

#[test]
fn the_steps_after_a_time_do_not_depend_on_the_walk_until_then() {
    let millis: Vec<i64> = (1..=20).map(|n| 100 * n).collect();
    let pairs = (0..SEEDS).map(|seed| {
        let walked = walked(0.5, seed, 0, &Value::Real(0.0), &millis);
        (walked[9][0], walked[19][0] - walked[9][0])
    });
    let correlation = covariance(pairs) / 0.25;
    assert!(correlation.abs() < 5.0 / (SEEDS as f64).sqrt(), "{correlation}");
}

#[test]
fn coordinates_elements_and_members_walk_independently() {
    let millis: Vec<i64> = (1..=10).map(|n| 100 * n).collect();
    let list = Value::List(vec![Value::Real(0.0); 3]);
    let point = Value::Point([0.0; 3]);
    let mut ends: Vec<Vec<Vec<f64>>> = vec![ends(0, &point, &millis), ends(0, &list, &millis)];
    // Three members, as if they were coordinates.
    let members = [0, 1, 2].map(|member| self::ends(member, &Value::Real(0.0), &millis));
    let of_seed = |seed: usize| members.iter().map(|of_member| of_member[seed][0]).collect();
    ends.push((0..members[0].len()).map(of_seed).collect());
    for (what, ends) in ["coordinates", "elements", "members"].iter().zip(&ends) {
        for (one, other) in [(0, 1), (0, 2), (1, 2)] {
            let correlation = covariance(ends.iter().map(|end| (end[one], end[other]))) / 0.25;
            assert!(correlation.abs() < 5.0 / (SEEDS as f64).sqrt(), "{what} {one} and {other}: {correlation}");
        }
    }
}

#[test]
fn messages_at_the_same_time_are_at_the_same_place_of_the_walk() {
    let walked = walked(2.0, 5, 0, &Value::Real(0.0), &[0, 0, 300, 300, 300, 700]);
    assert_eq!((walked[0][0], walked[1][0]), (0.0, 0.0), "it starts at 0");
    assert!(walked[2] == walked[3] && walked[3] == walked[4], "{walked:?}");
    assert!(walked[1] != walked[2] && walked[4] != walked[5], "{walked:?}");
}
