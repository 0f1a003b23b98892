mod messages;

use std::collections::BTreeSet;

use proptest::prelude::*;
use proptest::test_runner::TestCaseResult;

use sesame_base::observation::AlteredMessage;
use sesame_plan::condition::ConditionEnd;
use sesame_plan::{
    Activation, ActivationMode, Choice, ChoiceKind, Domain, Messages, OperationId, OperationKind, Search, Strategy,
    TestOperation,
};
use sesame_rng::Stream;

use super::*;
use crate::shrink::axis;
use crate::space::initial::fresh_test;
use crate::space::test_space::TestSpace;
use crate::space::test_space::tests::{any_plan, broken_rule};
use crate::testing::synthetic_robots::SYNTHETIC_ROBOTS;

/// How a test that fails with the simulator's seed 7 is shrunk.
fn shrinking(test: Test, runs: u32, evaluations: u32) -> Shrinking {
    Shrinking {
        name: "T1".to_owned(),
        test,
        failing: Failing::Crash,
        simulator_seed: 7,
        runs,
        evaluations,
        messages: false,
        when: false,
    }
}

/// Shrinks a test as long as a run of it fails by `fails`.
fn shrunk(shrink: Shrink, fails: impl FnMut(&Test, u64) -> bool) -> Shrink {
    shrunk_to_messages(shrink, fails, |_, _| unreachable!("no messages were asked for"))
}

/// The same, where a run lists what it altered by `altered`.
fn shrunk_to_messages(
    mut shrink: Shrink,
    mut fails: impl FnMut(&Test, u64) -> bool,
    mut altered: impl FnMut(&Test, u64) -> AlteredMessages,
) -> Shrink {
    let mut number = 0;
    loop {
        let asked = shrink.ask();
        if asked.is_empty() {
            assert!(!shrink.lists_altered());
            return shrink;
        }
        let lists = shrink.lists_altered();
        let told: Vec<Shown> = asked
            .into_iter()
            .map(|candidate| {
                number += 1;
                let (test, seed) = (&candidate.test, candidate.simulator_seed.unwrap());
                Shown { number, failed: fails(test, seed), altered: lists.then(|| altered(test, seed)) }
            })
            .collect();
        shrink.learn(&told);
    }
}

fn smallest(shrink: &Shrink) -> Option<&Test> {
    Some(&shrink.tried()[*shrink.accepted().last()?].test)
}

/// A test as text.
fn content(test: &Test) -> String {
    serde_json::to_string(test).unwrap()
}

/// A number that looks random and is the same for the same test.
fn scattered(test: &Test, seed: u64) -> f64 {
    let mut sum = seed;
    for byte in content(test).bytes() {
        sum = derive_seed(sum, "scattered", &[u64::from(byte)]);
    }
    Stream::derive(sum, "scattered", &[]).unit()
}

/// What of a test is larger or stronger than it was, if anything: read off the tests themselves.
fn grown(before: &Test, after: &Test) -> Option<String> {
    let mut left = before.operations.iter();
    for used in &after.operations {
        let was = left.find(|old| old.operation_seed == used.operation_seed && old.operation == used.operation)?;
        let inside = match (&was.activation, &used.activation) {
            (Activation::Time { start: a, end: b }, Activation::Time { start, end }) => {
                a <= start && start < end && end <= b
            }
            (Activation::ConditionFor { length: a, times: n, .. }, Activation::ConditionFor { length, times, .. }) => {
                length <= a && (1..=*n).contains(times)
            }
            (Activation::Condition { times: n, .. }, Activation::Condition { times, .. }) => (1..=*n).contains(times),
            (Activation::Offline, Activation::Offline) => true,
            _ => false,
        };
        let milder = was.parameters.iter().zip(&used.parameters).all(|pair| match pair {
            (Choice::Value { value: a }, Choice::Value { value }) => value.abs() <= a.abs() + 1e-9 || value == a,
            (Choice::Range { low: a, high: b }, Choice::Range { low, high }) => high - low <= b - a + 1e-9,
            (Choice::Text { text: a }, Choice::Text { text }) => a == text,
            (Choice::Point { .. }, Choice::Point { .. }) => true,
            _ => false,
        });
        if !inside || !milder {
            return Some(format!("{was:?} became {used:?}"));
        }
    }
    None
}

/// Every test that is one step smaller, in any order.
fn one_step_smaller(space: &ShrinkSpace, test: &Test) -> Vec<Test> {
    let mut found = Vec::new();
    if test.operations.len() > space.fewest {
        for place in 0..test.operations.len() {
            let mut less = test.clone();
            less.operations.remove(place);
            found.push(less);
        }
    }
    for (place, used) in test.operations.iter().enumerate() {
        for activation in space.simpler(used) {
            let mut simpler = test.clone();
            simpler.operations[place].activation = activation;
            found.push(simpler);
        }
    }
    for dial in axis::times(test).into_iter().chain(axis::parameters(test)) {
        if dial.steps(space, test) > 0 {
            found.push(dial.shrink_along(space, test, 1));
        }
    }
    found
}

/// Shrinks a test of a plan, of which a share of all tests fails at random.
fn is_smallest(plan: &CampaignPlan, seed: u64, share: f64) -> TestCaseResult {
    let test_space = TestSpace::from_plan(plan).unwrap();
    let mut original = fresh_test(&test_space, &mut Stream::derive(seed, "test", &[]));
    for (at, used) in (0u64..).zip(&mut original.operations) {
        used.operation_seed = at;
    }
    let fails = |test: &Test, _| *test == original || scattered(test, seed) < share;
    let mut asked = BTreeSet::new();
    let mut repeated = false;
    // Whatever is asked for is permitted, windows of the smallest test that lie elsewhere too.
    let when = Shrinking { when: true, ..shrinking(original.clone(), 1, 100_000) };
    let shrink = shrunk(Shrink::with_resolution(plan, when, 0.1), |test, run| {
        repeated |= !asked.insert(content(test));
        fails(test, run)
    });
    prop_assert!(!repeated, "no test is run twice");
    let found = smallest(&shrink).unwrap();
    prop_assert!(fails(found, 7) && shrink.is_minimal());
    for smaller in one_step_smaller(&shrink.space, found) {
        prop_assert!(!fails(&smaller, 7), "{:?} can be shrunk: {:?}", found, smaller);
    }
    // A search gives every test as many activations as there may be; fewer are permitted too.
    let with_all_times = |mut test: Test| {
        if let ActivationMode::Condition { space } = &plan.campaign.activation {
            for used in &mut test.operations {
                if let Activation::Condition { times, .. } | Activation::ConditionFor { times, .. } =
                    &mut used.activation
                {
                    *times = space.times;
                }
            }
        }
        test
    };
    for tried in shrink.tried() {
        prop_assert_eq!(broken_rule(plan, &with_all_times(tried.test.clone())), None);
    }
    let by_time = |used: &&TestOperation| matches!(used.activation, Activation::Time { .. });
    let varied = shrink.variations();
    prop_assert!(varied.len() <= variations::OF_EACH * found.operations.iter().filter(by_time).count());
    for Varied { operation, window, fails: failed, fresh: _ } in varied {
        let mut test = found.clone();
        test.operations[operation].activation = Activation::Time { start: window.start, end: window.end };
        prop_assert_eq!(failed, fails(&test, 7));
    }
    for dial in axis::times(found).into_iter().chain(axis::parameters(found)) {
        let round = dial.rounded(&shrink.space, found);
        prop_assert!(round.is_none_or(|round| !fails(&round, 7)), "{:?} has more digits than it needs", found);
    }
    prop_assert_eq!(grown(&original, found), None);
    prop_assert!(strength(plan, found) <= strength(plan, &original) + 1e-9);
    prop_assert!(found.operations.len() <= original.operations.len());
    Ok(())
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(32))]

    #[test]
    fn the_smallest_test_fails_is_permitted_and_cannot_be_shrunk_by_one_step(
        plan in any_plan(), seed: u64, share in 0.05..0.95f64,
    ) {
        is_smallest(&plan, seed, share)?;
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(1_000))]

    #[test]
    #[ignore = "long: a thousand plans"]
    fn the_smallest_test_of_many_plans_cannot_be_shrunk_by_one_step(
        plan in any_plan(), seed: u64, share in 0.05..0.95f64,
    ) {
        is_smallest(&plan, seed, share)?;
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(64))]

    /// The oracle tries every combination of steps of every operation. What fails here needs some operations, each over
    /// some time and with some loss, so that one test is the smallest.
    #[test]
    fn on_small_spaces_it_is_the_smallest_of_all(
        needs in prop::collection::vec((0.0..60.0f64, 0.0..1.0f64, 0.0..1.0f64, any::<bool>()), 1..6), seed: u64,
    ) {
        let plan = losses();
        let mut stream = Stream::derive(seed, "test", &[]);
        let mut original = Test::default();
        for (at, &(moment, loss, _, _)) in (0u64..).zip(&needs) {
            original.operations.push(TestOperation {
                operation: OperationId(u32::try_from(at % 2).unwrap()),
                activation: Activation::Time { start: stream.uniform(0.0, moment), end: stream.uniform(moment + 0.1, 65.0) },
                parameters: vec![Choice::Value { value: loss }],
                operation_seed: at,
                messages: None,
            });
        }
        let is_needed = |at: usize| needs[at].3 || at == 0;
        // Some are needed at a moment, some over the second half of their window too.
        let enough = |used: &TestOperation| {
            let at = usize::try_from(used.operation_seed).unwrap();
            let (moment, loss, part, _) = needs[at];
            let Activation::Time { end: last, .. } = original.operations[at].activation else { panic!("windows") };
            let (&Activation::Time { start, end }, &Choice::Value { value }) = (&used.activation, &used.parameters[0])
            else { panic!("windows and values") };
            start <= moment && end >= moment + (last - moment) * part && value >= loss * part
        };
        let fails = |test: &Test| {
            let holds = |at: usize| test.operations.iter().any(|used| used.operation_seed == at as u64 && enough(used));
            (0..needs.len()).filter(|&at| is_needed(at)).all(holds)
        };
        let shrink = shrunk(Shrink::with_resolution(&plan, shrinking(original.clone(), 1, 100_000), 0.1), |test, _| fails(test));
        let found = smallest(&shrink).unwrap();
        prop_assert_eq!(found.operations.len(), (0..needs.len()).filter(|&at| is_needed(at)).count());
        let size = |used: &TestOperation| match (&used.activation, &used.parameters[0]) {
            (Activation::Time { start, end }, Choice::Value { value }) => (end - start, *value),
            _ => panic!("windows and values"),
        };
        for used in &found.operations {
            // Operations do not depend on each other here, so each is looked at by itself.
            let mut all = vec![Test { operations: vec![original.operations[usize::try_from(used.operation_seed).unwrap()].clone()] }];
            for at in 0..3 {
                all = all.iter().flat_map(|test| turned_anyhow(&shrink.space, test, at)).collect();
            }
            let sizes = all.iter().map(|test| &test.operations[0]).filter(|used| enough(used)).map(size);
            let (shortest, mildest) = sizes.fold((f64::INFINITY, f64::INFINITY), |a, b| (a.0.min(b.0), a.1.min(b.1)));
            let (length, value) = size(used);
            // Round numbers may take it further.
            prop_assert!(length < shortest + 1e-6, "{:?}: {} s is possible", used, shortest);
            prop_assert!(value < mildest + 1e-6, "{:?}: {} is possible", used, mildest);
        }
    }
}

/// Two operations that lose messages, one to five per test.
fn losses() -> CampaignPlan {
    let mut plan = SYNTHETIC_ROBOTS[0].plan(Search::new(Strategy::Random, 1));
    for operation in &mut plan.operations {
        operation.kind = OperationKind::PacketLoss;
        operation.parameters[0].domain =
            Domain::Number { low: 0.0, high: 1.0, shape: ChoiceKind::Value, integer: false };
    }
    plan
}

/// A test with one of its dials turned in every way, and as it is.
fn turned_anyhow(space: &ShrinkSpace, test: &Test, dial: usize) -> Vec<Test> {
    let dial = [axis::times(test), axis::parameters(test)].concat()[dial];
    let turned = (1..=dial.steps(space, test)).map(|steps| dial.shrink_along(space, test, steps));
    std::iter::once(test.clone()).chain(turned).collect()
}

/// A test of these operations: which, its window, its sub-range or value.
fn offsets(operations: &[(u32, (f64, f64), Choice)]) -> Test {
    let used = |(at, (operation, (start, end), choice)): (u64, &(u32, (f64, f64), Choice))| TestOperation {
        operation: OperationId(*operation),
        activation: Activation::Time { start: *start, end: *end },
        parameters: vec![choice.clone()],
        operation_seed: at,
        messages: None,
    };
    Test { operations: (0u64..).zip(operations).map(used).collect() }
}

fn range(low: f64, high: f64) -> Choice {
    Choice::Range { low, high }
}

/// The only operation of a test: its window and its sub-range.
fn only(test: &Test) -> (f64, f64, f64, f64) {
    let [used] = test.operations.as_slice() else { panic!("{test:?}") };
    let (&Activation::Time { start, end }, &Choice::Range { low, high }) = (&used.activation, &used.parameters[0])
    else {
        panic!("{test:?}")
    };
    (start, end, low, high)
}

#[test]
fn a_made_up_robot_shows_what_of_a_test_mattered() {
    let robot = &SYNTHETIC_ROBOTS[0];
    let plan = robot.plan(Search::new(Strategy::Random, 1));
    // Only an offset above 0.2 on the second signal between 30 s and 33 s counts, on the average of its sub-range.
    let original = offsets(&[
        (0, (1.0, 7.0), range(0.0, 0.3)),
        (1, (20.0, 60.0), range(0.2, 0.3)),
        (0, (16.0, 28.0), range(-0.3, 0.0)),
    ]);
    assert!(robot.measure(&original).1 > 0.0);
    let shrink = shrunk(Shrink::new(&plan, shrinking(original, 1, 200)), |test, _| robot.measure(test).1 > 0.0);
    let (start, end, low, high) = only(smallest(&shrink).unwrap());
    assert!(end - start < 0.9 && 29.0 < start && end < 33.7, "{start} to {end}");
    assert!(f64::midpoint(low, high) > 0.2 && high - low < 0.02 && high < 0.215, "{low} to {high}");
    assert!(shrink.is_minimal() && shrink.tried().len() < 80, "{} tests", shrink.tried().len());
}

#[test]
fn windows_of_the_smallest_test_lie_elsewhere_to_show_when_it_fails() {
    let plan = losses();
    let original = Test {
        operations: vec![TestOperation {
            operation: OperationId(0),
            activation: Activation::Time { start: 10.0, end: 50.0 },
            parameters: vec![Choice::Value { value: 1.0 }],
            operation_seed: 1,
            messages: None,
        }],
    };
    // Only what is lost at 30 s matters.
    let fails = |test: &Test, _| match test.operations[0].activation {
        Activation::Time { start, end } => start <= 30.0 && 30.0 < end,
        _ => false,
    };
    let with = |when, evaluations| {
        shrunk(Shrink::new(&plan, Shrinking { when, ..shrinking(original.clone(), 1, evaluations) }), fails)
    };
    let (without, whole) = (with(false, 500), with(true, 500));
    assert_eq!((without.variations(), smallest(&without)), (Vec::new(), smallest(&whole)));
    let varied = whole.variations();
    assert_eq!(varied.len(), 48);
    assert_eq!(whole.tried().len(), without.tried().len() + 48, "all of them after the others");
    assert_eq!(varied.iter().filter(|varied| varied.fresh).count(), 16);
    for fresh in [false, true] {
        let of = varied.iter().filter(|varied| varied.fresh == fresh);
        let fail = of.clone().filter(|varied| varied.fails).count();
        assert!((3..of.count() - 3).contains(&fail), "both kinds are among them: {varied:?}");
    }
    // With few runs left there are fewer.
    let needed = u32::try_from(without.tried().len()).unwrap();
    assert_eq!(with(true, needed + 10).variations(), varied[..10]);
    assert_eq!(with(true, needed - 1).variations(), []);
}

#[test]
fn windows_close_in_from_both_ends_down_to_the_shortest_that_is_permitted() {
    let plan = SYNTHETIC_ROBOTS[0].plan(Search::new(Strategy::Random, 1));
    let original = offsets(&[(0, (2.0, 50.0), range(-0.2, 0.25))]);
    let shrink = shrunk(Shrink::new(&plan, shrinking(original.clone(), 1, 500)), |_, _| true);
    let (start, end, low, high) = only(smallest(&shrink).unwrap());
    assert!((end - start - 0.065).abs() < 1e-9, "a thousandth of 65 s: {start} to {end}");
    assert_eq!((low, high), (0.0, 0.0), "an offset is mildest at zero");
    let shrink = shrunk(Shrink::new(&plan, shrinking(original, 1, 500)), |test, _| {
        let (start, end, low, high) = only(test);
        start <= 10.0 && end >= 41.0 && low <= -0.1 && high >= 0.1
    });
    let (start, end, low, high) = only(smallest(&shrink).unwrap());
    assert!(9.35 < start && start <= 10.0 && (41.0..41.65).contains(&end), "{start} to {end}");
    assert!(-0.1061 < low && low <= -0.1 && (0.1..0.1061).contains(&high), "{low} to {high}");
}

#[test]
fn a_sub_range_that_lies_off_its_mild_end_goes_there_as_a_whole() {
    let plan = SYNTHETIC_ROBOTS[0].plan(Search::new(Strategy::Random, 1));
    for sign in [1.0, -1.0] {
        let ends = |a: f64, b: f64| range((a * sign).min(b * sign), (a * sign).max(b * sign));
        let original = offsets(&[(0, (2.0, 50.0), ends(0.2, 0.3))]);
        let shrink = shrunk(Shrink::new(&plan, shrinking(original, 1, 500)), |test, _| {
            let (_, _, low, high) = only(test);
            f64::midpoint(low, high) * sign >= 0.1
        });
        let (_, _, low, high) = only(smallest(&shrink).unwrap());
        let middle = f64::midpoint(low, high) * sign;
        assert!((0.1..0.106).contains(&middle) && high - low < 0.0121, "{low} to {high}");
    }
}

#[test]
fn a_value_goes_to_what_disturbs_least_of_its_kind() {
    let least = |kind: OperationKind, name: &str, low: f64, high: f64| {
        let mut plan = losses();
        plan.operations[0].kind = kind;
        plan.operations[0].parameters[0].name = name.to_owned();
        plan.operations[0].parameters[0].domain =
            Domain::Number { low, high, shape: ChoiceKind::Value, integer: false };
        let original = offsets(&[(0, (2.0, 50.0), Choice::Value { value: low * 0.4 + high * 0.6 })]);
        let shrink = shrunk(Shrink::new(&plan, shrinking(original, 1, 500)), |_, _| true);
        let Choice::Value { value } = smallest(&shrink).unwrap().operations[0].parameters[0] else { panic!("a value") };
        value
    };
    assert_eq!(least(OperationKind::PacketLoss, "loss", 0.1, 1.0), 0.1);
    assert_eq!(least(OperationKind::BurstLoss, "leave", 0.1, 0.9), 0.9);
    assert_eq!(least(OperationKind::BurstLoss, "enter", 0.1, 0.9), 0.1);
    assert_eq!(least(OperationKind::RateLimit, "rate", 1.0, 50.0), 50.0);
    assert_eq!(least(OperationKind::Scale, "factor", 0.5, 3.0), 1.0);
    assert_eq!(least(OperationKind::Scale, "factor", 1.5, 3.0), 1.5);
    assert_eq!(least(OperationKind::Bias, "bias", -3.0, 3.0), 0.0);
    assert_eq!(least(OperationKind::Bias, "bias", -3.0, -1.0), -1.0);
    assert_eq!(
        least(OperationKind::Bias, "bias", 1e17, 1e17 + 64.0),
        1e17,
        "a hundredth of the range is lost in rounding"
    );
    assert_eq!(
        least(OperationKind::StuckAt { truth: None }, "value", 0.0, 10.0),
        6.0,
        "no value is milder than another"
    );
}

#[test]
fn a_condition_loses_what_does_not_matter_and_activations_get_fewer_and_shorter() {
    use sesame_base::condition::testing::{above, and, below, or};
    let robot = &SYNTHETIC_ROBOTS[0];
    let length = ConditionEnd::Length { low: 1.0, high: 15.0 };
    let mut plan = robot.plan_by_condition(Search::new(Strategy::Random, 1), length);
    if let ActivationMode::Condition { space } = &mut plan.campaign.activation {
        space.times = 3;
    }
    let start = and(or(above(2, 3.0), below(3, 4.0)), and(above(4, 2.0), below(2, 19.0)));
    let mut original = offsets(&[(0, (0.0, 1.0), range(0.1, 0.3))]);
    original.operations[0].activation = Activation::ConditionFor { start, length: 12.0, times: 3 };
    let shrink = shrunk(Shrink::new(&plan, shrinking(original, 1, 500)), |test, _| {
        let Activation::ConditionFor { start, length, times } = &test.operations[0].activation else { panic!() };
        sesame_base::condition::mentions(start, &|metric| metric == sesame_base::condition::testing::variable(4))
            && *length > 4.0
            && *times > 1
    });
    let Activation::ConditionFor { start, length, times } = &smallest(&shrink).unwrap().operations[0].activation else {
        panic!()
    };
    assert_eq!((start, *times), (&above(4, 2.0), 2));
    assert!((4.0..4.66).contains(length), "{length}");
}

#[test]
fn with_several_runs_a_test_has_to_fail_in_each() {
    let plan = SYNTHETIC_ROBOTS[0].plan(Search::new(Strategy::Random, 1));
    let original = offsets(&[(0, (2.0, 50.0), range(-0.2, 0.25)), (1, (2.0, 50.0), range(-0.2, 0.25))]);
    let mut seeds = BTreeSet::new();
    // With the seed of the test everything fails, with the others only what has both operations.
    let shrink = shrunk(Shrink::new(&plan, shrinking(original, 3, 900)), |test, seed| {
        seeds.insert(seed);
        seed == 7 || test.operations.len() == 2
    });
    assert!(seeds.len() == 3 && seeds.contains(&7));
    assert_eq!(smallest(&shrink).unwrap().operations.len(), 2);
    assert!(
        shrink.tried().iter().all(|tried| tried.failed == Some(if tried.test.operations.len() == 2 { 3 } else { 1 }))
    );
    assert!(shrink.tried().iter().zip(0u32..).all(|(tried, at)| tried.number == 1 + 3 * at));
}

#[test]
fn when_the_evaluations_are_used_up_the_smallest_so_far_is_told_as_such() {
    let plan = SYNTHETIC_ROBOTS[0].plan(Search::new(Strategy::Random, 1));
    let original = offsets(&[(0, (2.0, 50.0), range(-0.2, 0.25)), (1, (2.0, 50.0), range(-0.2, 0.25))]);
    let whole = shrunk(Shrink::new(&plan, shrinking(original.clone(), 1, 500)), |test, _| test.operations.len() == 2)
        .tried()
        .len();
    for evaluations in 1..=60 {
        let shrink = shrunk(Shrink::new(&plan, shrinking(original.clone(), 1, evaluations)), |test, _| {
            test.operations.len() == 2
        });
        assert!(shrink.tried().len() <= evaluations as usize);
        assert_eq!(shrink.is_minimal(), evaluations as usize >= whole, "{evaluations} of {whole}");
        assert_eq!(smallest(&shrink).unwrap().operations.len(), 2);
        let ended = shrink.ended().unwrap();
        assert_eq!(
            ended,
            if shrink.is_minimal() {
                "no single step is left that still fails"
            } else {
                "all evaluations were used up"
            }
        );
    }
}

#[test]
fn a_test_that_does_not_fail_again_is_left_as_it_is() {
    let plan = SYNTHETIC_ROBOTS[0].plan(Search::new(Strategy::Random, 1));
    let original = offsets(&[(0, (2.0, 50.0), range(-0.2, 0.25))]);
    let shrink = shrunk(Shrink::new(&plan, shrinking(original, 2, 500)), |_, seed| seed == 7);
    assert_eq!((smallest(&shrink), shrink.tried().len(), shrink.tried()[0].failed), (None, 1, Some(1)));
    assert_eq!(shrink.ended().as_deref(), Some("the test did not fail again"));
}
