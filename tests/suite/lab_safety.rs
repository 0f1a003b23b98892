//! Briefings and recordings for a lab, of robots that a program simulates.

use std::fs;
use std::path::{Path, PathBuf};

use sesame_tests::{Done, Project, command, done, fresh_folder, sesamec, workspace};

/// The example of two robots, in a lab in which both are spheres: a campaign that runs them together, one in which
/// `north` does not hear `east` until late, and one of a dangerous test.
fn two_robots(name: &str) -> Project {
    let folder = fresh_folder(name);
    let example = workspace().join("examples/two_robots");
    fs::copy(example.join("sim.py"), folder.join("sim.py")).unwrap();
    let text = fs::read_to_string(example.join("two_robots.sesame")).unwrap();
    let campaign = |name: &str, what: &str| {
        format!("campaign {name} {{\n  {what}\n  observes clearance\n  end after 70s\n  record mcap all\n}}\n")
    };
    let more = [
        "test deaf { cut_east from 0s to 60s }\n".to_owned(),
        campaign("together", "passive 1 times"),
        campaign("alone", "repeat deaf 1 times"),
        campaign("dangerous", "repeat silent_departure 2 times"),
        "physical hall {\n  interlock clearance\n  exclude when clearance < -3m\n  \
         shape east  = sphere 500mm on pose \"robots/east/pose\"\n  \
         shape north = sphere 500mm on pose \"robots/north/pose.position\"   expand 200mm\n}\n"
            .to_owned(),
    ];
    let space = folder.join("two_robots.sesame");
    fs::write(&space, text + &more.concat()).unwrap();
    Project { space, runners: folder.join("runners"), folder }
}

/// Runs a campaign, and gives the folder of its results.
fn ran(project: &Project, campaign: &str) -> PathBuf {
    project.sesamec("run", &["--campaign", campaign, "--", "--fail-on", "nothing"]).expect(0);
    let results = project.runners.join(campaign).join("results");
    let mut folders = fs::read_dir(results).unwrap().map(|entry| entry.unwrap().path());
    folders.find(|folder| folder.is_dir()).unwrap()
}

fn lab(arguments: &[&str], files: &[&Path]) -> Done {
    let (subcommand, options) = arguments.split_first().unwrap();
    done(command(sesamec()).args(["lab", subcommand]).args(files).args(options))
}

/// Text on one line.
fn solid(text: &str) -> String {
    text.split_whitespace().collect::<Vec<_>>().join(" ")
}

#[test]
fn a_robot_that_waits_is_found_to_be_coupled_and_a_sheet_warns_of_it() {
    let project = two_robots("lab_safety");
    let [together, alone] = ["together", "alone"].map(|campaign| ran(&project, campaign).join("traces/T1.mcap"));

    // Recorded together they keep away from each other, and nothing has to be concluded.
    let found = lab(&["contacts"], &[&project.space, &together]).expect(0);
    assert!(found.out.contains("`east` and `north` do not touch from"), "{}", found.out);
    assert!(!found.out.contains("coupled"), "{}", found.out);

    // `north` alone does not wait, so it seems to run into `east`; but its motion depends on what it hears.
    let apart = [project.space.as_path(), &alone, &together];
    let found = lab(&["contacts", "--second", "east"], &apart).expect(0);
    let said = solid(&found.out);
    assert!(said.contains("`east` and `north` touch first at"), "{said}");
    assert!(said.contains("the robot reads messages that depend on what was removed. The method does not hold."));
    let with = together.to_str().unwrap();
    let rows = lab(&["contacts", "--second", "east", "--together", with, "--format", "json"], &apart).expect(0).json();
    assert_eq!((&rows[0]["motion"], &rows[0]["one"]), (&"coupled".into(), &"east".into()), "{rows}");
    assert!(rows[0]["least_distance_m"].as_f64().unwrap() < 0.0 && rows[0]["first_contact_s"].is_number(), "{rows}");
    assert!(rows[0]["margins_touch_s"].as_f64() < rows[0]["first_contact_s"].as_f64(), "{rows}");

    // An interlock 20 cm around `north` acts where they would touch, too late for robots that need half an hour.
    let results = ran(&project, "dangerous");
    let folder = results.display().to_string();
    project.sesamec("replay", &["T1", "--record", "--campaign", "dangerous", "--results", &folder]).expect(0);
    let rows = lab(&["interlocks", "--format", "json"], &[&results]).expect(0).json();
    assert_eq!((&rows[1]["test"], &rows[1]["interlock"]), (&"T1".into(), &"prevents".into()), "{rows}");
    assert!(rows[1]["lead_s"].as_f64().unwrap() > 0.0, "{rows}");
    let late = solid(&lab(&["interlocks", "T1", "--lead", "1800"], &[&results]).expect(0).out);
    assert!(late.contains("an interlock acts too late or not at all in T1."), "{late}");

    // The sheet of a dangerous test, as text and as a page.
    let sheet = ["brief", "T1", "--reaction", "0.3", "--deceleration", "1.5", "--present", "pilot: drives north"];
    let said = solid(&lab(&sheet, &[&results]).expect(0).out);
    for part in [
        "T1 of two_robots, campaign dangerous, lab hall",
        "WARNING: east and north, run one at a time: The motion is coupled",
        "pilot: drives north",
        "from 15 s to 21 s: blackhole (cut_east) on topic east",
        "The interlock of clearance ends the test; it stands for a violation of R1.",
        "No interlock may depend on what is disturbed: east.",
        "the recorded pose of east",
        "Safety zones must be wider by",
        "east touches north first at",
        "R1 (The robots keep a metre between them): violated, outside its bound from",
        "clearance < -3m, which the lab excludes",
    ] {
        assert!(said.contains(part), "{part} is not in\n{said}");
    }
    let page = project.folder.join("briefing.html");
    let write = ["brief", "T1", "T2", "--format", "html", "-o", page.to_str().unwrap()];
    lab(&write, &[&results]).expect(0);
    let html = fs::read_to_string(&page).unwrap();
    assert_eq!(html.matches("<section class=\"briefing\">").count(), 2);
    assert!(lab(&write, &[&results]).expect(1).err.contains("choose a file that does not exist"));
}

#[test]
fn what_cannot_be_found_in_recordings_is_refused_with_what_to_do() {
    let project = two_robots("lab_safety_refused");
    let text = fs::read_to_string(&project.space).unwrap();
    fs::write(&project.space, text.replace("pose \"robots/east/pose\"", "pose \"robots/west/pose\"")).unwrap();
    let trace = ran(&project, "together").join("traces/T1.mcap");
    let refused = |arguments: &[&str], files: &[&Path]| lab(&[&["contacts"], arguments].concat(), files).expect(1).err;
    let unknown = refused(&[], &[&project.space, &trace]);
    let known = "there is no pose `robots/west/pose`; the recording has `robots/east/pose`, `robots/north/pose`.";
    assert!(solid(&unknown).contains(known), "{unknown}");
    let shape = refused(&["--second", "south"], &[&project.space, &trace, &trace]);
    assert!(shape.contains("lab `hall` has no shape `south`; it has `east`, `north`"), "{shape}");
    let second = lab(&["contacts"], &[&project.space, &trace, &trace]).expect(2);
    assert!(second.err.contains("--second"), "{}", second.err);
    let space = refused(&[], &[&project.space, &project.space]);
    assert!(space.contains("this is no recording that can be read"), "{space}");
}
