//! The gearbox cell over SimlogAPI, as a program that the space launches: a campaign as a user runs it.

use std::fs;

use sesame_tests::{Project, command, done, fresh_folder, kuka_cell_simlog, sesamec};

/// A space of the served cell, in which one joint of the product arm may be disturbed.
fn project(name: &str) -> Project {
    let folder = fresh_folder(name);
    let space = folder.join("served.sesame");
    let text = format!(
        "space served\n\
         system {{\n\
           simulator cell = simlog \"http://127.0.0.1:{{port}}\" {{ step 20ms }}\n\
           launch \"{}\" \"--simlog\" \"127.0.0.1:{{port}}\" {{ ready when port \"{{port}}\" within 120s }}\n\
           message SafetyZone {{ zone: text  level: real[mm] }}\n\
           topic link0 = \"joints/R3200ProductMove/Link0/R/position\" : real[rad]\n\
           topic zones = \"safetyzones/{{Z1,Z2,Z3}}\" : SafetyZone\n\
           node plc   {{ publishes link0    every step link0 }}\n\
           node r3200 {{ subscribes link0   publishes zones   every step zones }}\n\
         }}\n\
         metric nearest minimise default 5000mm = min(zones.level)\n\
         metric disturbed minimise = fuzzing_time()\n\
         requirement R1 \"It stays away\" = nearest >= 1mm\n\
         operation jitter on link0 = random offset [-0.3rad, 0.3rad] within [0s, 8s]\n\
         test leaning {{ jitter offset [0.3rad, 0.3rad] from 0s to 5s  expect disturbed >= 4s }}\n\
         campaign close {{\n\
           objectives nearest, disturbed\n\
           operations jitter 1 per test\n\
           activate by time\n\
           search random {{ evaluations 4 }}\n\
           end after 8s\n\
         }}\n",
        kuka_cell_simlog().display()
    );
    fs::write(&space, text).unwrap();
    Project { space, runners: folder.join("runners"), folder }
}

#[test]
fn a_campaign_over_simlog_finds_the_same_twice() {
    let project = project("served");
    let run = |workers: &str| {
        let mut sesamec = command(sesamec());
        sesamec.args(["run", "served.sesame", "--", "--workers", workers]);
        done(sesamec.current_dir(&project.folder)).expect(0)
    };
    let (first, second) = (run("1"), run("2"));
    assert_eq!(first.digest(), second.digest());
    let mut list = command(sesamec());
    list.args(["list", "served.sesame", "--format", "json"]);
    let listed = done(list.current_dir(&project.folder)).expect(0).out;
    let listed: serde_json::Value = serde_json::from_str(&listed).unwrap();
    let rows = listed["tests"].as_array().unwrap_or_else(|| panic!("{listed}"));
    assert_eq!(rows.iter().filter(|row| row["operations"] == "jitter").count(), 4, "{listed}");
    assert!(rows.iter().all(|row| row["outcome"] == "completed"), "{listed}");
    // What is disturbed matters to the cell.
    let nearest = |row: &serde_json::Value| row["measured"]["nearest"].to_string();
    assert!(rows.iter().any(|row| nearest(row) != nearest(&rows[0])), "{listed}");
}

#[test]
fn a_simulator_that_speaks_simlog_is_prepared() {
    let project = project("served_prepared");
    let mut sesamec = command(sesamec());
    sesamec.args(["prepare", "served.sesame", "--runs", "1", "--format", "json"]);
    let said = done(sesamec.current_dir(&project.folder)).expect(0).out;
    let found: serde_json::Value = serde_json::from_str(&said).unwrap();
    assert_eq!((&found["passed"], &found["mitm"]["lock_stepped"]), (&true.into(), &true.into()), "{found:#}");
    let stages = found["mitm"]["stages"].as_array().unwrap_or_else(|| panic!("{found:#}"));
    assert_eq!(stages.len(), 2, "nothing is relayed, then the joint is: {found:#}");
    assert_eq!(found["known"]["tests"][0]["expectations"][0]["simulation"], "satisfied", "{found:#}");
    let page = fs::read_to_string(project.runners.join("close/results/prepare/report.html")).unwrap();
    assert!(["id=\"null\"", "id=\"mitm\"", "id=\"known\""].iter().all(|section| page.contains(section)));
}
