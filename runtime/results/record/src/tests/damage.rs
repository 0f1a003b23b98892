//! What cannot be recorded, and what cannot be read: refused, and said what is wrong.

use rusqlite::Connection;

use sesame_base::test_number::TestNumber;
use sesame_plan::condition::ConditionEnd;
use sesame_plan::{Activation, Choice, OperationId, TestOperation};

use super::{commit_all, conditional_record, folder};
use crate::{DATABASE, Origin, RecordError, Recorder, Repository, SCHEMA, sample};

#[test]
fn a_test_that_cannot_be_recorded_leaves_nothing_behind() {
    let folder = folder();
    let records = sample::records(&sample::plan(), 5);
    let mut recorder = commit_all(folder.path(), &records[..3]);
    let mut bad = records[3].clone();
    bad.observation.metrics[2].series[0].1 = f64::NAN;
    let error = recorder.commit(&bad).unwrap_err();
    assert!(error.to_string().starts_with("test T3 cannot be recorded (a value in a series is NaN)"), "{error}");
    // What would be refused when it is read.
    let mut unfit = records[3].clone();
    unfit.test.operations[0].activation = sesame_plan::Activation::Time { start: -1.0, end: 2.0 };
    let error = recorder.commit(&unfit).unwrap_err().to_string();
    assert!(error.contains("operations[0].activation") && error.contains("before the start"), "{error}");
    let error = recorder.commit(&records[2]).unwrap_err();
    assert!(matches!(error, RecordError::TestExists { number: TestNumber(2), .. }), "{error}");
    assert_eq!(recorder.repository().tests().unwrap().len(), 3);
    recorder.commit(&records[3]).unwrap();
    assert_eq!(recorder.repository().test(3).unwrap(), records[3]);
}

#[test]
fn what_is_no_repository_of_this_release_is_refused_with_what_to_do() {
    let folder = folder();
    let path = folder.path().join(DATABASE);
    let refused = |expected: &str| {
        let error = Repository::open(&path).unwrap_err();
        let text = error.to_string();
        assert!(text.contains(expected), "{text}");
        assert!(text.ends_with(&path.display().to_string()), "the path comes last: {text}");
        assert!(Recorder::resume(folder.path(), 1).is_err(), "nor is it written to");
        error
    };
    assert!(matches!(refused("no results here"), RecordError::Missing { .. }));
    std::fs::write(&path, "").unwrap();
    assert!(matches!(refused("the file is empty"), RecordError::Damaged { .. }));
    std::fs::write(&path, "time,value\n1,2\n".repeat(100)).unwrap();
    assert!(matches!(refused("not an SQLite file"), RecordError::Foreign { .. }));
    std::fs::remove_file(&path).unwrap();
    Connection::open(&path).unwrap().execute_batch("CREATE TABLE notes (text TEXT)").unwrap();
    assert!(matches!(refused("of another program"), RecordError::Foreign { .. }));
    std::fs::remove_file(&path).unwrap();

    drop(sample::campaign(folder.path(), &sample::plan(), 30));
    let whole = std::fs::read(&path).unwrap();
    let open = Connection::open(&path).unwrap();
    open.pragma_update(None, "user_version", SCHEMA + 1).unwrap();
    drop(open);
    let later = refused(&format!("schema {}, this release reads {SCHEMA}", SCHEMA + 1));
    assert!(matches!(later, RecordError::Newer { known: SCHEMA, .. }));
    Connection::open(&path).unwrap().pragma_update(None, "user_version", 1).unwrap();
    let told = format!("schema 1, this release reads {SCHEMA}; read them with the release that wrote them");
    assert!(matches!(refused(&told), RecordError::Older { found: 1, known: SCHEMA, .. }));
    for length in [whole.len() / 2, 4096, 700] {
        std::fs::write(&path, &whole[..length]).unwrap();
        assert!(matches!(refused("restore the file"), RecordError::Damaged { .. }), "cut to {length} bytes");
    }
    std::fs::write(&path, &whole).unwrap();
    assert_eq!(Repository::open(&path).unwrap().tests().unwrap().len(), 32, "the file itself may be named");
}

#[test]
fn a_test_of_which_only_parts_are_left_is_damage_for_those_who_read_and_those_who_go_on() {
    let folder = folder();
    let records = sample::records(&sample::plan(), 3);
    drop(commit_all(folder.path(), &records[..4]));
    let connection = Connection::open(folder.path().join(DATABASE)).unwrap();
    connection.pragma_update(None, "foreign_keys", false).unwrap();
    for number in [0u32, 3] {
        connection.execute("DELETE FROM tests WHERE number = ?1", [number]).unwrap();
        let gone = format!("T{number} is gone, and some of what was recorded of it is still there");
        let repository = Repository::open(folder.path()).unwrap();
        for said in [repository.tests().map(drop), repository.scan(&mut drop)] {
            let said = said.unwrap_err().to_string();
            assert!(said.contains(&gone), "{said}");
        }
        let mut resumed = Recorder::resume(folder.path(), 1).unwrap();
        let said = resumed.commit(&records[number as usize]).unwrap_err().to_string();
        assert!(said.contains(&gone), "{said}");
        drop(resumed);
        let tables = ["metric_values", "operations", "choices", "intervals", "series_pieces", "wall_times"];
        for table in tables {
            connection.execute(&format!("DELETE FROM {table} WHERE test = ?1"), [number]).unwrap();
        }
    }
}

#[test]
fn positions_with_gaps_and_numbers_that_are_never_recorded_are_damage() {
    let changes = [
        ("DELETE FROM metric_values WHERE test = 1 AND metric = 1", "of the values of T1, number 1 is missing"),
        ("DELETE FROM metric_values WHERE test = 1 AND metric = 4", "there are 4 values of 5 metrics"),
        ("UPDATE operations SET position = 3 WHERE test = 1", "of the operations of T1, number 0 is missing"),
        ("DELETE FROM choices WHERE test = 1", "parameters: there are 0 instead of 1"),
        ("UPDATE choices SET position = 1 WHERE test = 1", "of the choices of T1, number 0 is missing"),
        (
            "UPDATE choices SET low = NULL, high = NULL, text = 'x' WHERE test = 1",
            "is of another kind than its parameter",
        ),
        ("UPDATE choices SET high = -9 WHERE test = 1", "runs from 0.27 to -9"),
        ("UPDATE operations SET start_s = 9e999 WHERE test = 1", "inf is recorded where only finite numbers are"),
        ("UPDATE tests SET end_s = -9e999 WHERE number = 1", "-inf is recorded where only finite numbers are"),
        ("UPDATE tests SET outcome = 'timeout', time_limit_s = -1 WHERE number = 1", "cannot have ended as `timeout`"),
        ("UPDATE metric_values SET reach_high = 9e999", "inf is recorded where only finite numbers are"),
    ];
    for (change, words) in changes {
        let folder = folder();
        drop(commit_all(folder.path(), &sample::records(&sample::plan(), 3)));
        Connection::open(folder.path().join(DATABASE)).unwrap().execute_batch(change).unwrap();
        let said = Repository::open(folder.path()).unwrap().tests().unwrap_err().to_string();
        assert!(said.contains(words), "{change}: {said}");
    }
    for seconds in ["-1", "1e300"] {
        let folder = folder();
        drop(commit_all(folder.path(), &sample::records(&sample::plan(), 3)));
        let connection = Connection::open(folder.path().join(DATABASE)).unwrap();
        connection.execute_batch(&format!("UPDATE wall_times SET run_s = {seconds}")).unwrap();
        let said = Repository::open(folder.path()).unwrap().test(1).unwrap_err().to_string();
        assert!(said.contains("the run of T1 took"), "{said}");
    }
}

#[test]
fn a_number_in_a_condition_that_is_none_is_refused() {
    use sesame_plan::condition::{Condition, Operand};
    let folder = folder();
    let plan = sample::plan();
    let mut record = conditional_record(&plan);
    if let Activation::Condition { end: Condition::Compare { left, .. }, .. } =
        &mut record.test.operations[0].activation
    {
        *left = Operand::Number(f64::NAN);
    }
    let mut recorder = Recorder::create(folder.path(), &plan, 1, 1).unwrap();
    let refused = recorder.commit(&record).unwrap_err().to_string();
    assert!(refused.starts_with("test T3 cannot be recorded (a number in a condition is NaN)"), "{refused}");
}

#[test]
fn an_activation_that_does_not_fit_its_operation_is_damage() {
    let folder = folder();
    let plan = sample::offline_plan(ConditionEnd::Condition);
    let offline = TestOperation {
        operation: OperationId(4),
        activation: Activation::Offline,
        parameters: vec![Choice::Text { text: "hot".to_owned() }],
        operation_seed: 1,
        messages: None,
    };
    let mut test = sample::conditional_test();
    test.operations.push(offline);
    let mut recorder = Recorder::create(folder.path(), &plan, 42, 2).unwrap();
    recorder.commit(&sample::record(&plan, 3, Origin::Search, test)).unwrap();
    let refused = |change: &str| {
        let changing = Connection::open(folder.path().join(DATABASE)).unwrap();
        assert_eq!(changing.execute(change, []).unwrap(), 1, "{change}");
        recorder.repository().test(3).unwrap_err().to_string()
    };
    let nothing = refused("UPDATE operations SET start_s = NULL, end_s = NULL WHERE position = 1");
    assert!(nothing.contains("switched neither by time nor by condition"), "{nothing}");
    refused("UPDATE operations SET start_s = 1, end_s = 2 WHERE position = 3");
    let window = refused("UPDATE operations SET start_s = 1.5, end_s = 20 WHERE position = 1");
    assert!(window.contains("T3 has `spoil` during the run, which acts before or after it"), "{window}");
}
