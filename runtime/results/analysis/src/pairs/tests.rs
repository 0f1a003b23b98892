use proptest::prelude::*;

use sesame_base::observation::{Counters, MetricObservation, Observation, OperationEffect, Outcome};
use sesame_plan::{Activation, ActivationMode, Choice, Test, TestOperation, condition};
use sesame_present::table::TextOptions;
use sesame_record::{Recorder, TestRecord, sample};

use super::*;

/// Half seconds of a run of 70 s.
const SLOTS: u32 = 140;
/// The operation that acts before the start.
const SPOIL: u32 = 4;

fn seconds(slot: u32) -> f64 {
    f64::from(slot) / 2.0
}

/// The sample with an operation before the start.
fn plan() -> CampaignPlan {
    let mut plan = sample::offline_plan(condition::ConditionEnd::Condition);
    plan.campaign.activation = ActivationMode::Time;
    plan
}

/// A use of an operation; all times are in half seconds.
#[derive(Debug, Clone)]
struct Used {
    operation: u32,
    /// From its first effect to its last.
    effects: Option<(u32, u32)>,
    /// When it was active.
    active: Vec<(u32, u32)>,
}

/// What is made up of a test.
#[derive(Debug, Clone)]
struct MadeUp {
    used: Vec<Used>,
    violates: [bool; 4],
    kind: Kind,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Kind {
    Usual,
    Reference,
    Duplicate,
    BrokenOff,
    Imported,
}

fn span() -> impl Strategy<Value = (u32, u32)> {
    (0..SLOTS, 0..SLOTS).prop_map(|(one, other)| (one.min(other), one.max(other)))
}

fn made_up() -> impl Strategy<Value = MadeUp> {
    let active = prop::collection::vec(span().prop_map(|(start, end)| (start, end + 1)), 0..3);
    let used = (0..=SPOIL, prop::option::weighted(0.8, span()), active);
    let used = used.prop_map(|(operation, effects, active)| match operation {
        SPOIL => Used { operation, effects: None, active: Vec::new() },
        _ => Used { operation, effects, active },
    });
    let kind = prop::sample::select(vec![
        Kind::Usual,
        Kind::Usual,
        Kind::Usual,
        Kind::Reference,
        Kind::Duplicate,
        Kind::BrokenOff,
        Kind::Imported,
    ]);
    let violates = prop::array::uniform4(prop::bool::weighted(0.1));
    (prop::collection::vec(used, 0..5), violates, kind).prop_map(|(used, violates, kind)| MadeUp {
        used: if kind == Kind::Reference { Vec::new() } else { used },
        violates,
        kind,
    })
}

fn record(number: u32, test: &MadeUp) -> TestRecord {
    let choices = |operation: u32| match operation {
        0 | 1 => vec![Choice::Range { low: -0.1, high: 0.1 }],
        2 => vec![Choice::Value { value: 0.5 }],
        SPOIL => vec![Choice::Text { text: "cold".to_owned() }],
        _ => Vec::new(),
    };
    let operations = test.used.iter().map(|used| TestOperation {
        operation: OperationId(used.operation),
        activation: match used.operation {
            SPOIL => Activation::Offline,
            _ => Activation::Time { start: 0.0, end: 65.0 },
        },
        parameters: choices(used.operation),
        operation_seed: 1,
        messages: None,
    });
    let effects = test.used.iter().map(|used| {
        let effect = OperationEffect {
            intervals: used.active.iter().map(|&(from, to)| Span { start: seconds(from), end: seconds(to) }).collect(),
            ..OperationEffect::default()
        };
        match used.effects.filter(|_| test.kind != Kind::Imported) {
            Some((first, last)) => OperationEffect {
                counters: Counters { seen: 9, dropped: 3, ..Counters::default() },
                first_touch: Some(seconds(first)),
                last_touch: Some(seconds(last)),
                ..effect
            },
            None => effect,
        }
    });
    let [zones, speed, distance, cycle] = test.violates;
    let value = |violates: bool, bad: f64, good: f64| if violates { bad } else { good };
    let values =
        [value(zones, 3.0, 0.0), 1.0, value(speed, 2.75, 1.5), value(cycle, 80.0, 68.0), value(distance, 100.0, 300.0)];
    TestRecord {
        number,
        origin: if test.kind == Kind::Reference { Origin::Reference } else { Origin::Search },
        generation: None,
        parents: Vec::new(),
        test: Test { operations: operations.collect() },
        simulator_seed: 1,
        duplicate_of: (test.kind == Kind::Duplicate).then_some(0),
        observation: Observation {
            operations: effects.collect(),
            metrics: values.map(|value| MetricObservation::whole(Some(value), true, Vec::new())).to_vec(),
            end: 70.0,
            ..Observation::without_run(match test.kind {
                Kind::Imported => Outcome::Unknown,
                Kind::BrokenOff => Outcome::Disconnect { message: "gone".to_owned() },
                _ => Outcome::Completed,
            })
        },
    }
}

/// The results of these tests, after an undisturbed one that violates nothing.
fn recorded(plan: &CampaignPlan, tests: &[MadeUp]) -> (tempfile::TempDir, Repository) {
    let folder = tempfile::tempdir().unwrap();
    let mut recorder = Recorder::create(folder.path(), plan, 1, 1).unwrap();
    let first = MadeUp { used: Vec::new(), violates: [false; 4], kind: Kind::Reference };
    let records: Vec<TestRecord> =
        [first].iter().chain(tests).zip(0..).map(|(test, number)| record(number, test)).collect();
    recorder.commit_all(records).unwrap();
    let repository = recorder.finish("all evaluations done").unwrap();
    (folder, repository)
}

/// The quarters of half seconds in which a use acted, looked at one by one; `None` if it did not act.
fn quarters(used: &Used, kind: Kind) -> Option<BTreeSet<u32>> {
    let quarter = |slot: u32| slot / (SLOTS / 4);
    let is_active = |slot: u32| used.active.iter().any(|&(from, to)| (from..to).contains(&slot));
    match (used.operation, kind, used.effects) {
        (SPOIL, ..) => Some(BTreeSet::new()),
        (_, Kind::Imported, _) => Some((0..SLOTS).filter(|&slot| is_active(slot)).map(quarter).collect()),
        (.., None) => None,
        (.., Some((first, last))) => {
            let between = (first..last).filter(|&slot| is_active(slot));
            Some(between.chain([first, last]).map(quarter).collect())
        }
    }
}

/// What a test that counts says of an operation: whether it acted, and in which quarters.
fn says(test: &MadeUp, operation: u32) -> Option<BTreeSet<u32>> {
    let uses = test.used.iter().filter(|used| used.operation == operation);
    uses.filter_map(|used| quarters(used, test.kind)).reduce(|all, more| all.union(&more).copied().collect())
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(64))]

    /// Beside a look at each half second of each test, for each two operations.
    #[test]
    fn pairs_are_those_that_a_look_at_each_half_second_finds(tests in prop::collection::vec(made_up(), 0..20)) {
        let plan = plan();
        let (_folder, repository) = recorded(&plan, &tests);
        let found = pairs(&repository, &Selection::default()).unwrap();
        let references = || tests.iter().filter(|test| test.kind == Kind::Reference);
        // In order of declaration, R3 bounds the distance and R4 the cycle.
        let counted: Vec<usize> = (0..4).filter(|&at| !references().any(|test| test.violates[at])).collect();
        let requirements: Vec<usize> = found.requirements.iter().map(|id| id.index()).collect();
        prop_assert_eq!(&requirements, &counted);
        let counting: Vec<&MadeUp> =
            tests.iter().filter(|test| matches!(test.kind, Kind::Usual | Kind::Imported)).collect();
        for second in 0..=SPOIL {
            for first in 0..=second {
                let both = |test: &&&MadeUp| says(test, first).is_some() && says(test, second).is_some();
                let both: Vec<&MadeUp> = counting.iter().filter(both).copied().collect();
                let acted = found.of(first as usize, second as usize);
                prop_assert_eq!(acted.tests as usize, both.len());
                for (quarter, &count) in (0..).zip(&acted.parts) {
                    let then = |operation: u32, test: &MadeUp| says(test, operation).unwrap().contains(&quarter);
                    let together = both.iter().filter(|test| then(first, test) && then(second, test)).count();
                    prop_assert_eq!(count as usize, together, "{} and {} in {}", first, second, quarter);
                }
                let violates = |test: &MadeUp, at: usize| test.violates[at] && counted.contains(&at);
                let any = both.iter().filter(|test| (0..4).any(|at| violates(test, at))).count();
                prop_assert_eq!(acted.violating as usize, any);
                for (&at, &count) in counted.iter().zip(&acted.of_requirements) {
                    prop_assert_eq!(count as usize, both.iter().filter(|test| violates(test, at)).count());
                }
            }
        }
        let all: Vec<(usize, usize)> = found.pairs().collect();
        prop_assert_eq!(all.len(), 10);
        let counts = found.counts();
        let together = |pair: &(usize, usize)| found.of(pair.0, pair.1).tests > 0;
        prop_assert_eq!(counts.together, all.iter().filter(|pair| together(pair)).count());
        prop_assert_eq!(counts.in_parts, 6 * PARTS, "six pairs have no operation before the start");
        let missing: usize = found.untried().iter().map(|of| of.parts.iter().filter(|&&open| open).count()).sum();
        prop_assert_eq!(counts.in_parts - counts.together_in_parts, missing);
        prop_assert_eq!(found.untried().iter().filter(|of| of.tests == 0).count(), counts.pairs - counts.together);
        prop_assert_eq!(found.table(&plan).rows().len(), 15);
    }
}

fn usual(used: Vec<Used>) -> MadeUp {
    MadeUp { used, violates: [true, false, false, false], kind: Kind::Usual }
}

fn used(operation: u32, effects: Option<(u32, u32)>) -> Used {
    Used { operation, effects, active: effects.into_iter().collect() }
}

#[test]
fn a_table_has_each_operation_and_each_two() {
    let folder = tempfile::tempdir().unwrap();
    let repository = sample::covering(folder.path());
    let found = pairs(&repository, &Selection::default()).unwrap();
    let table = found.table(repository.plan());
    insta::assert_snapshot!("pairs", table.text(TextOptions { width: None, colour: false }));
    insta::assert_snapshot!("pairs_csv", table.csv());
    insta::assert_snapshot!("pairs_sentence", found.sentence().unwrap());
    let json: serde_json::Value = serde_json::from_str(&table.json()).unwrap();
    assert_eq!(json.as_array().unwrap().len(), 4 + 6);
    insta::assert_snapshot!("pairs_json", json[4]);
}

#[test]
fn only_the_tests_of_the_set_that_is_asked_for_count() {
    let folder = tempfile::tempdir().unwrap();
    let repository = sample::covering(folder.path());
    let front = Selection::of(&repository, Some("front")).unwrap();
    let [all, few] = [Selection::default(), front].map(|selection| pairs(&repository, &selection).unwrap());
    assert!(few.of(0, 0).tests < all.of(0, 0).tests);
    assert_eq!(few.requirements, all.requirements);
}

#[test]
fn a_campaign_whose_tests_hold_one_operation_has_no_pairs() {
    let mut plan = plan();
    plan.campaign.count.max = 1;
    let (_folder, repository) = recorded(&plan, &[usual(vec![used(0, Some((10, 20)))])]);
    let found = pairs(&repository, &Selection::default()).unwrap();
    assert_eq!((found.pairs().count(), found.sentence(), found.untried()), (0, None, Vec::new()));
    assert_eq!(found.table(&plan).rows().len(), 5, "a row for each operation");
    // A regression test may hold more.
    let (_folder, repository) = recorded(&plan, &[usual(vec![used(0, Some((10, 20))), used(1, Some((12, 30)))])]);
    let found = pairs(&repository, &Selection::default()).unwrap();
    assert_eq!(found.counts().together, 1);

    plan.campaign.operations.truncate(1);
    plan.campaign.count.max = 5;
    let (_folder, repository) = recorded(&plan, &[usual(vec![used(0, Some((10, 20)))])]);
    let found = pairs(&repository, &Selection::default()).unwrap();
    assert_eq!((found.pairs().count(), found.of(0, 0).violating), (0, 1));
    plan.campaign.operations.clear();
    let (_folder, repository) = recorded(&plan, &[]);
    assert!(pairs(&repository, &Selection::default()).unwrap().table(&plan).is_empty());
}

#[test]
fn operations_without_effect_did_not_act() {
    let plan = plan();
    let idle = Used { active: vec![(0, 100)], ..used(1, None) };
    let (_folder, repository) = recorded(&plan, &[usual(vec![used(0, Some((10, 20))), idle])]);
    let found = pairs(&repository, &Selection::default()).unwrap();
    assert_eq!((found.of(0, 0).tests, found.of(0, 1).tests, found.of(1, 1).tests), (1, 0, 0));
    assert_eq!(
        found.sentence().unwrap(),
        "0 of 10 pairs of operations acted together, 0 of 24 in the same quarter of the run"
    );
}

#[test]
fn imported_tests_without_times_acted_in_no_part_of_the_run() {
    let plan = plan();
    let test = MadeUp { kind: Kind::Imported, ..usual(vec![used(0, None), used(1, None)]) };
    let (_folder, repository) = recorded(&plan, &[test]);
    let found = pairs(&repository, &Selection::default()).unwrap();
    assert_eq!((found.of(0, 1).tests, found.of(0, 1).parts), (1, [0; PARTS]));
}

#[test]
fn between_two_activations_an_operation_does_not_act() {
    let plan = plan();
    let twice = Used { operation: 0, effects: Some((2, 130)), active: vec![(0, 10), (120, 140)] };
    let (_folder, repository) = recorded(&plan, &[usual(vec![twice, used(1, Some((0, 139)))])]);
    let found = pairs(&repository, &Selection::default()).unwrap();
    assert_eq!((found.of(0, 1).parts, found.of(1, 1).parts), ([1, 0, 0, 1], [1; PARTS]));
}

#[test]
fn a_part_that_a_window_does_not_reach_need_not_be_tried() {
    let mut plan = plan();
    plan.operations[1].within = Span { start: 0.0, end: 17.5 };
    let (_folder, repository) = recorded(&plan, &[]);
    let found = pairs(&repository, &Selection::default()).unwrap();
    assert_eq!(found.reach(0, 1), [true, false, false, false]);
    assert_eq!(found.counts().in_parts, 3 * PARTS + 3);
    let row = &found.table(&plan).rows()[5];
    assert_eq!(row[3..7], [Datum::Whole(0), Datum::Missing, Datum::Missing, Datum::Missing]);
    // An effect may come later, as what was held back does.
    let test = usual(vec![used(0, Some((0, 100))), used(1, Some((0, 40)))]);
    let (_folder, repository) = recorded(&plan, &[test]);
    let found = pairs(&repository, &Selection::default()).unwrap();
    assert_eq!(found.reach(0, 1), [true, true, false, false]);
}
