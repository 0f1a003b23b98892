//! What the digest is of: all content, and nothing else.

use rusqlite::Connection;
use serde_json::Value;

use sesame_base::observation::{Outcome, WallTime};
use sesame_plan::{Activation, CampaignPlan, Choice, KnownTestId, Type, testing};

use super::{conditional_record, digest_of, folder};
use crate::{DATABASE, Event, EventKind, Origin, Recorder, Repository, ResultSet, Status, TestRecord, sample};

#[test]
fn the_digest_does_not_depend_on_wall_times_sessions_and_the_order_of_writing() {
    let plan = sample::plan();
    let mut records = sample::records(&plan, 30);
    let digest = digest_of(&records);
    assert_eq!(digest.len(), 64);
    for record in &mut records {
        record.observation.wall = WallTime { run: record.observation.wall.run + 1.0 };
    }
    records.reverse();
    let folder = folder();
    let mut recorder = Recorder::create(folder.path(), &plan, 42, 8).unwrap();
    for record in &records {
        recorder.commit(record).unwrap();
    }
    recorder.put_event(&Event { kind: EventKind::Session, test: None, text: "resumed".to_owned() }).unwrap();
    let repository = recorder.finish("all evaluations done").unwrap();
    assert_eq!(repository.digest().unwrap(), digest);
    drop(repository);
    assert_eq!(super::digest(&folder.path().join(DATABASE)).unwrap(), digest);
}

#[test]
fn the_digest_tells_campaigns_sets_and_warnings_apart() {
    let plan = sample::plan();
    let records = sample::records(&plan, 3);
    let with = |change: &dyn Fn(&mut Recorder), seed, stop: &str| {
        let folder = folder();
        let mut recorder = Recorder::create(folder.path(), &plan, seed, 1).unwrap();
        for record in &records {
            recorder.commit(record).unwrap();
        }
        change(&mut recorder);
        recorder.finish(stop).unwrap().digest().unwrap()
    };
    let set = |members: &[u32], status| ResultSet {
        name: "front".to_owned(),
        generation: None,
        status,
        members: members.to_vec(),
    };
    let warning = |text: &str| Event { kind: EventKind::Warning, test: None, text: text.to_owned() };
    let digests = [
        with(&|_| {}, 42, "done"),
        with(&|_| {}, 43, "done"),
        with(&|_| {}, 42, "stopped"),
        with(&|r| r.put_result_set(&set(&[1, 2], Status::Final)).unwrap(), 42, "done"),
        with(&|r| r.put_result_set(&set(&[2, 1], Status::Final)).unwrap(), 42, "done"),
        with(&|r| r.put_result_set(&set(&[1, 2], Status::Intermediate)).unwrap(), 42, "done"),
        with(&|r| r.put_event(&warning("a")).unwrap(), 42, "done"),
        with(&|r| r.put_event(&warning("b")).unwrap(), 42, "done"),
    ];
    for (at, digest) in digests.iter().enumerate() {
        assert!(!digests[..at].contains(digest), "case {at} equals an earlier one");
    }
    let twice = with(
        &|r| {
            r.put_event(&warning("a")).unwrap();
            r.put_event(&warning("a")).unwrap();
        },
        42,
        "done",
    );
    assert_eq!(twice, digests[6], "a warning said again when a run is resumed is one warning");
    let replaced = with(
        &|r| {
            r.put_result_set(&set(&[1], Status::Intermediate)).unwrap();
            r.put_result_set(&set(&[1, 2], Status::Final)).unwrap();
        },
        42,
        "done",
    );
    assert_eq!(replaced, digests[3], "a set of the same name is replaced");
}

/// One kind of change to one test's record.
fn change(record: &mut TestRecord, kind: usize) {
    let next_up = |x: &mut f64| *x = x.next_up();
    let observation = &mut record.observation;
    match kind {
        0 => record.simulator_seed ^= 1 << 63,
        1 => record.parents.push(1),
        2 => record.generation = record.generation.map_or(Some(0), |_| None),
        3 => next_up(&mut observation.end),
        4 => observation.messages += 1,
        5 => observation.outcome = Outcome::Timeout { limit: 31.0 },
        6 => observation.outcome = Outcome::Crash { message: "other".to_owned() },
        7 => observation.warnings.push("a warning".to_owned()),
        8 => next_up(&mut observation.metrics[2].series[0].0),
        9 => next_up(&mut observation.metrics[2].series[0].1),
        10 => observation.metrics[0].set = !observation.metrics[0].set,
        11 => observation.metrics[4].value = None,
        22 => observation.metrics[4].reach.low = None,
        23 => next_up(observation.metrics[4].reach.high.as_mut().expect("it has a value")),
        24 => observation.metrics[4].not_finite = Some(1.5),
        12 => drop(observation.metrics[2].series.pop()),
        13 => record.test.operations[0].operation_seed ^= 1,
        14 => observation.operations[0].counters.seen += 1,
        15 => observation.operations[0].counters.side_effects += 1,
        16 => next_up(&mut observation.operations[0].intervals[0].end),
        17 => observation.operations[0].first_touch = Some(0.5),
        18 => {
            let Activation::Time { start, .. } = &mut record.test.operations[0].activation else {
                panic!("the regression test has a window")
            };
            *start = start.next_down();
        }
        19 => record.origin = Origin::Known(KnownTestId(0)),
        20 => match &mut record.test.operations[0].parameters[0] {
            Choice::Range { high, .. } => next_up(high),
            Choice::Value { value } => next_up(value),
            Choice::Point { point } => next_up(&mut point[1]),
            Choice::Text { text } => text.push('.'),
        },
        _ => observation.operations.clear(),
    }
}

#[test]
fn any_kind_of_change_to_a_condition_changes_the_digest() {
    use sesame_plan::condition::{Comparison, Condition};
    let plan = sample::plan();
    let mut seen = std::collections::BTreeSet::from([digest_of(&[conditional_record(&plan)])]);
    let changes: [fn(&mut Activation, &mut Activation); 6] = [
        |until, _| {
            if let Activation::Condition { times, .. } = until {
                *times += 1;
            }
        },
        |until, _| {
            if let Activation::Condition { start, end, .. } = until {
                std::mem::swap(start, end);
            }
        },
        |until, _| {
            if let Activation::Condition { end: Condition::Compare { by, .. }, .. } = until {
                *by = Comparison::Equal;
            }
        },
        |until, lasting| *until = lasting.clone(),
        |_, lasting| {
            if let Activation::ConditionFor { length, .. } = lasting {
                *length = length.next_up();
            }
        },
        |_, lasting| {
            if let Activation::ConditionFor { times, .. } = lasting {
                *times += 1;
            }
        },
    ];
    for (kind, change) in changes.into_iter().enumerate() {
        let mut record = conditional_record(&plan);
        let [until, _, lasting] = &mut record.test.operations[..] else { panic!("three operations") };
        change(&mut until.activation, &mut lasting.activation);
        assert!(seen.insert(digest_of(&[record])), "change {kind} goes unnoticed");
    }
}

#[test]
fn any_kind_of_change_to_a_test_changes_the_digest() {
    let plan = sample::plan();
    let record = sample::record(&plan, 3, Origin::Search, plan.tests[0].test.clone());
    let before = digest_of(std::slice::from_ref(&record));
    assert_eq!(digest_of(std::slice::from_ref(&record)), before);
    let mut seen = std::collections::BTreeSet::from([before]);
    for kind in 0..25 {
        let mut changed = record.clone();
        change(&mut changed, kind);
        assert!(seen.insert(digest_of(&[changed])), "change {kind} goes unnoticed");
    }
}

#[test]
fn every_byte_of_a_series_is_in_the_digest_and_a_piece_that_nothing_is_written_as_is_damage() {
    let folder = folder();
    let whole = sample::campaign(folder.path(), &sample::plan(), 30).digest().unwrap();
    let open = Connection::open(folder.path().join(DATABASE)).unwrap();
    let one = "WHERE test = 3 AND metric = 2 AND position = 0";
    let after = |change: &str| {
        open.execute_batch("BEGIN").unwrap();
        assert_eq!(open.execute(&format!("UPDATE series_pieces SET {change} {one}"), []).unwrap(), 1, "{change}");
        open.execute_batch("COMMIT").unwrap();
        let read = Repository::open(folder.path()).unwrap();
        (read.digest().unwrap(), read.test(3).map(|_| ()).map_err(|error| error.to_string()))
    };
    let numbers: Vec<u8> =
        open.query_row(&format!("SELECT numbers FROM series_pieces {one}"), [], |row| row.get(0)).unwrap();
    for at in 0..numbers.len() {
        let mut changed = numbers.clone();
        changed[at] ^= 1;
        let digits = changed.iter().map(|byte| format!("{byte:02x}")).collect::<Vec<_>>().concat();
        let (digest, read) = after(&format!("numbers = x'{digits}'"));
        assert_ne!(digest, whole, "byte {at}");
        assert_eq!(read, Ok(()));
    }
    for change in [
        "numbers = x'7ff0000000000000'",
        "numbers = x''",
        "times = x'01020304050607080910'",
        "points = 0",
        "points = -1",
        "start_ns = 9223372036854775807, tick_ns = 9223372036854775807",
        "tick_ns = NULL",
    ] {
        let (digest, read) = after(change);
        assert_ne!(digest, whole, "{change}");
        let said = read.expect_err(change);
        assert!(said.contains(DATABASE), "{change}: {said}");
    }
}

/// Where each number, text and truth value of this value is.
fn leaves(at: &str, value: &Value) -> Vec<String> {
    match value {
        Value::Object(of) => of.iter().flat_map(|(key, value)| leaves(&format!("{at}/{key}"), value)).collect(),
        Value::Array(of) => {
            of.iter().enumerate().flat_map(|(key, value)| leaves(&format!("{at}/{key}"), value)).collect()
        }
        _ => vec![at.to_owned()],
    }
}

/// Whether what is there in a plan is only for people.
fn is_for_people(pointer: &str) -> bool {
    let of_requirement = pointer.starts_with("/requirements/") && pointer.ends_with("/text");
    of_requirement
        || ["/generator", "/source"].contains(&pointer)
        || ["/doc", "/line"].iter().any(|key| pointer.ends_with(key))
}

#[test]
fn the_digest_is_over_all_of_a_plan_but_what_is_only_for_people() {
    let mut plan = sample::plan();
    plan.messages = vec![testing::message("Zone", vec![testing::field("level", Type::Bool)])];
    plan.nodes = vec![testing::node("arm")];
    plan.validate().unwrap();
    let folder = folder();
    let repository = sample::campaign(folder.path(), &plan, 20);
    let digest = |plan: &CampaignPlan| super::super::digest::of_connection(&repository.connection, plan).unwrap();
    let whole = digest(&plan);
    assert_eq!(whole, repository.digest().unwrap());
    let json = serde_json::to_value(&plan).unwrap();
    let (mut for_people, mut seen) = (Vec::new(), std::collections::BTreeSet::from([whole.clone()]));
    for pointer in leaves("", &json) {
        let mut changed = json.clone();
        let leaf = changed.pointer_mut(&pointer).unwrap();
        *leaf = match &*leaf {
            Value::String(text) => Value::from(format!("{text} once more")),
            Value::Bool(truth) => Value::from(!truth),
            Value::Number(number) => {
                number.as_u64().map_or_else(|| (number.as_f64().unwrap() + 0.001).into(), |whole| (whole + 1).into())
            }
            _ => Value::from(1),
        };
        // Words of a few, and numbers of things that are not there.
        let Ok(changed) = serde_json::from_value::<CampaignPlan>(changed) else { continue };
        if is_for_people(&pointer) {
            for_people.push(pointer.clone());
            assert_eq!(digest(&changed), whole, "{pointer}");
            assert!(changed.same_model(&plan), "{pointer}");
        } else {
            assert!(seen.insert(digest(&changed)), "{pointer}");
        }
    }
    assert!(for_people.len() >= 20 && seen.len() > 60, "{for_people:?}, {} others", seen.len());
}
