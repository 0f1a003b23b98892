//! Monitors run in campaigns: they stop a robot, are deceived, and are attacked at the worst moment.

use std::fs;
use std::path::Path;

use rusqlite::Connection;
use sesame_tests::{Project, fresh_folder, workspace};

/// A copy of the space whose robot is stopped by a monitor.
fn watched(name: &str) -> Project {
    let folder = fresh_folder(name);
    for file in ["sim.py", "watched.sesame"] {
        fs::copy(workspace().join("tests/simulators/watched").join(file), folder.join(file)).unwrap();
    }
    Project { space: folder.join("watched.sesame"), runners: folder.join("runners"), folder }
}

/// What a query of results gives, a text for each row.
pub(crate) fn rows(results: &Path, sql: &str) -> Vec<String> {
    let open = Connection::open(results.join("results.sqlite")).unwrap();
    let mut statement = open.prepare(sql).unwrap();
    statement.query_map([], |row| row.get(0)).unwrap().collect::<Result<_, _>>().unwrap()
}

#[test]
fn a_monitor_stops_the_robot_and_misses_what_operations_hide_from_it() {
    let project = watched("monitors");
    project.sesamec("known", &["-c", "attacks"]).expect(0);
    let results = project.runners.join("attacks/results/known");
    let decisions = |test: &str, monitor: &str| {
        let of = "SELECT time_s || ' ' || state FROM decisions WHERE test_name =";
        rows(&results, &format!("{of} '{test}' AND monitor = '{monitor}' ORDER BY position"))
    };
    // Undisturbed, the robot stops when the light is gone, and stays where it is. The evidence has to hold for 300 ms.
    assert_eq!(decisions("T0", "transport"), ["0.0 halted", "0.4 fast", "5.0 halted", "11.3 fast"]);
    assert_eq!(decisions("T0", "camera"), ["0.0 blind", "0.4 sees_well", "4.0 sees", "5.0 blind", "11.3 sees_well"]);
    let nearest = rows(&results, "SELECT CAST(round(nearest, 3) AS TEXT) FROM results WHERE number = 0");
    assert_eq!(nearest, ["5.0"]);
    // The monitor that is deceived stops it too late; what it is not told of, the oracle knows.
    assert_eq!(decisions("T1", "transport"), ["0.0 halted", "0.4 fast", "9.6 halted"]);
    assert_eq!(decisions("T1", "oracle"), ["0.0 bad", "0.1 good", "5.0 bad", "11.0 good"]);
    let hazard = "SELECT CAST(time_s AS TEXT) FROM series WHERE metric = 'missed' AND test = 1 AND value = 1";
    assert_eq!(rows(&results, hazard), ["9.1"]);
    // The operation begins when evidence turns false, and acts on what comes after that.
    let changes = "SELECT evidence || ' ' || time_s || ' ' || holds || ' ' || cause || coalesce(' ' || path || ' ' || \
                   message, '') FROM evidence WHERE test = 2 AND monitor = 'camera' ORDER BY position";
    let expected = [
        "clear 0.1 1 message camera/light 0",
        "bright 0.1 0 message camera/light 0",
        "bright 0.4 1 held",
        "clear 4.0 0 message camera/light 39",
        "clear 4.1 1 message camera/light 40",
    ];
    assert_eq!(rows(&results, changes)[..5], expected);
    // What a monitor says is changed on its way, and not what it decides.
    assert_eq!(decisions("T3", "transport"), decisions("T0", "transport"));
}

#[test]
fn decisions_and_scores_are_the_same_with_any_number_of_workers_in_replays_and_from_recordings() {
    let project = watched("monitors_again");
    let digests = ["1", "2"].map(|workers| {
        let run = project.sesamec("run", &["-c", "attacks", "--", "--workers", workers]).expect(0);
        run.digest()
    });
    assert_eq!(digests[0], digests[1]);
    let results = ["5", "5-2"].map(|name| project.runners.join("attacks/results").join(name));
    let all =
        "SELECT test || monitor || position || ' ' || time_s || state FROM decisions ORDER BY test, monitor, position";
    assert_eq!(rows(&results[0], all), rows(&results[1], all));
    let missed = rows(&results[0], "SELECT name FROM results WHERE missed = 1");
    assert!(!missed.is_empty(), "the search finds a missed hazard");
    for test in [missed[0].as_str(), "T0"] {
        let same = project.sesamec("replay", &["-c", "attacks", test, "--results", "5"]).expect(0);
        assert!(same.out.contains("came out the same, bit for bit"), "{}", same.out);
        let trace = results[0].join(format!("traces/{test}.mcap"));
        let fed = project.sesamec("replay-recording", &["-c", "attacks", trace.to_str().unwrap()]).expect(0);
        assert!(!fed.out.contains("differ"), "{}", fed.out);
        assert!(fed.out.matches(" equal").count() >= 8, "{}", fed.out);
    }
}
