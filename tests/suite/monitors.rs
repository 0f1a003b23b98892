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
    // The missed hazard is in the results, and in all that is shown of them.
    let hazards = "SELECT test_name || ' ' || monitor || ' ' || requirement || ' ' || time_s || ' ' || foreseen FROM hazards \
                   ORDER BY test";
    assert_eq!(rows(&results, hazards)[0], "T1 transport R1 9.1 0");
    let show = |arguments: &[&str]| {
        let all = [&["-c", "attacks"], arguments, &["--results", results.to_str().unwrap()]].concat();
        project.sesamec("show", &all).expect(0).out
    };
    let shown = show(&["T1"]);
    assert!(shown.contains("R1         9.100 s  MISSED"), "{shown}");
    assert!(shown.contains("`fast` does not hold because `far` is false; sent `drive.speed = 0m/s`"), "{shown}");
    let moment = show(&["T1", "--at", "9.1s"]);
    assert!(moment.contains("transport: fast\n") && moment.contains("`fast` holds because "), "{moment}");
    assert!(moment.contains("    `far` true since 0.100 s: message 0 of cell/gap\n"), "{moment}");
    let json: serde_json::Value = serde_json::from_str(&show(&["T1", "--at", "9600ms", "--format", "json"])).unwrap();
    assert_eq!(json["monitors"][0]["state"], "halted");
    assert_eq!(json["monitors"][0]["why"][0]["because"][0]["evidence"], "far");
    let list = project.sesamec("list", &["-c", "attacks", "--results", results.to_str().unwrap()]).expect(0).out;
    assert!(list.lines().nth(2).unwrap().contains("R1 by transport"), "{list}");
    let page = fs::read_to_string(results.join("report.html")).unwrap();
    assert!(page.contains("hazard of R1 missed by transport") && page.contains("id=\"certificates\""));
    // What a monitor says is changed on its way, and not what it decides.
    assert_eq!(decisions("T3", "transport"), decisions("T0", "transport"));
}

#[test]
fn a_mended_certificate_is_compared_with_the_one_of_before_in_the_same_tests() {
    let project = watched("monitors_mended");
    project.sesamec("known", &["-c", "attacks"]).expect(0);
    // It hears the gap as well as the camera, and stops where less than two metres are left.
    let mended = fs::read_to_string(&project.space).unwrap();
    let mended = mended.replace("evidence  far = gap > 500mm", "evidence  far = gap > 2m");
    fs::write(&project.space, mended).unwrap();
    // The tests expect what the monitor of before misses.
    project.sesamec("known", &["-c", "attacks"]).expect(3);
    let [before, after] = ["known", "known-2"].map(|name| project.runners.join("attacks/results").join(name));
    let arguments = ["-c", "attacks", "--results", after.to_str().unwrap(), "--before", before.to_str().unwrap()];
    let report = project.sesamec("report", &arguments).expect(3).out;
    assert!(report.contains("Before and after the mend"), "{report}");
    assert!(report.contains("Of 5 tests in both results, hazards were missed in 2 before and in 0 after"), "{report}");
    assert!(!report.contains("not only the monitors differ"), "{report}");
    let page = fs::read_to_string(after.join("report.html")).unwrap();
    assert!(page.contains("Before: hazard of R1 by transport MISSED") && page.contains("After: no hazard missed"));
}

#[test]
fn decisions_and_scores_are_the_same_with_any_number_of_workers_in_replays_and_from_recordings() {
    let project = watched("monitors_again");
    let digests = ["1", "2"].map(|workers| {
        let more = ["-c", "attacks", "--", "--workers", workers, "--evaluations", "48"];
        project.sesamec("run", &more).expect(0).digest()
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
