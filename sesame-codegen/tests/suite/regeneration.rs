//! What becomes of files that are there already.

use std::fs;
use std::path::Path;
use std::time::SystemTime;

use sesame_codegen::emit::emit;
use sesame_codegen::output::{Change, Error, Mode, Orphan, Report, apply};
use sesame_codegen::plan::RunnerPlan;

use crate::placed::environment;
use crate::plans::{hook, measured, small};

fn generate(out: &Path, plans: &[RunnerPlan], mode: Mode) -> Result<Report, Error> {
    apply(out, &emit(plans, &environment()).unwrap(), mode)
}

fn files(folder: &Path) -> Vec<(String, SystemTime, String)> {
    let mut found = Vec::new();
    let mut folders = vec![folder.to_owned()];
    while let Some(folder) = folders.pop() {
        for entry in fs::read_dir(folder).unwrap() {
            let path = entry.unwrap().path();
            if path.is_dir() {
                folders.push(path);
            } else {
                let modified = path.metadata().unwrap().modified().unwrap();
                found.push((path.display().to_string(), modified, fs::read_to_string(&path).unwrap()));
            }
        }
    }
    found.sort();
    found
}

#[test]
fn a_second_generation_touches_nothing() {
    let out = tempfile::tempdir().unwrap();
    let first = generate(out.path(), &[small("a"), small("b")], Mode::Write).unwrap();
    assert_eq!(first.count(Change::Created), first.files.len());
    let before = files(out.path());
    let second = generate(out.path(), &[small("a"), small("b")], Mode::Write).unwrap();
    assert_eq!(files(out.path()), before);
    assert!(!second.out_of_date());
    assert_eq!(second.count(Change::Kept), 2, "the hooks");
    assert_eq!(second.count(Change::Unchanged), second.files.len() - 2);
}

#[test]
fn no_temporary_file_is_left() {
    let out = tempfile::tempdir().unwrap();
    generate(out.path(), &[small("a")], Mode::Write).unwrap();
    assert!(files(out.path()).iter().all(|(path, ..)| !path.contains(".sesame-new")));
}

#[test]
fn a_filled_hook_is_never_touched_not_even_by_force() {
    let out = tempfile::tempdir().unwrap();
    generate(out.path(), &[small("a")], Mode::Write).unwrap();
    let hook = out.path().join("hooks/collision_occurrence.rs");
    fs::write(&hook, "// mine").unwrap();
    let mut changed = small("a");
    changed.hooks[0].inputs.push(sesame_plan::TopicId(2));
    generate(out.path(), &[changed], Mode::Force).unwrap();
    assert_eq!(fs::read_to_string(&hook).unwrap(), "// mine");
}

#[test]
fn a_new_metric_brings_a_new_stub() {
    let out = tempfile::tempdir().unwrap();
    generate(out.path(), &[small("a")], Mode::Write).unwrap();
    let mut more = small("a");
    more.hooks.push(hook("near_misses", 40, &[1]));
    measured(&mut more, "near_misses");
    let report = generate(out.path(), &[more], Mode::Write).unwrap();
    let created: Vec<&str> =
        report.files.iter().filter(|file| file.change == Change::Created).map(|file| file.path.as_str()).collect();
    assert_eq!(created, ["hooks/near_misses.rs"]);
    assert_eq!(report.count(Change::Kept), 2);
}

#[test]
fn a_hook_is_named_when_its_inputs_change() {
    let out = tempfile::tempdir().unwrap();
    generate(out.path(), &[small("a")], Mode::Write).unwrap();
    let mut changed = small("a");
    changed.plan.messages[0].fields[1].ty = sesame_plan::Type::Real { unit: Some("m".into()) };
    changed.hooks[0].inputs.push(sesame_plan::TopicId(2));
    let report = generate(out.path(), &[changed.clone()], Mode::Write).unwrap();
    insta::assert_debug_snapshot!(report.changed_hooks);
    assert_eq!(generate(out.path(), &[changed], Mode::Write).unwrap().changed_hooks, []);
}

#[test]
fn an_edited_machine_file_is_refused_with_a_diff_and_nothing_is_written() {
    let out = tempfile::tempdir().unwrap();
    generate(out.path(), &[small("a")], Mode::Write).unwrap();
    let main = out.path().join("a/src/main.rs");
    let edited = fs::read_to_string(&main).unwrap().replace("mod generated;", "mod generated;\nmod mine;");
    fs::write(&main, &edited).unwrap();
    let before = files(out.path());
    let mut more = small("a");
    more.hooks.push(hook("near_misses", 40, &[1]));
    let error = generate(out.path(), &[more.clone()], Mode::Write).unwrap_err();
    insta::assert_snapshot!(error);
    assert_eq!(files(out.path()), before);
    assert!(generate(out.path(), &[more.clone()], Mode::Check).is_err());
    generate(out.path(), &[more], Mode::Force).unwrap();
    assert!(!fs::read_to_string(&main).unwrap().contains("mod mine;"));
}

#[test]
fn a_foreign_file_in_the_way_is_refused() {
    let out = tempfile::tempdir().unwrap();
    fs::create_dir_all(out.path().join("a/src")).unwrap();
    fs::write(out.path().join("a/src/main.rs"), "fn main() {}\n").unwrap();
    assert!(matches!(generate(out.path(), &[small("a")], Mode::Write), Err(Error::Edited { .. })));
    assert!(!out.path().join("hooks").exists());
}

#[test]
fn checking_writes_nothing_and_tells() {
    let out = tempfile::tempdir().unwrap();
    assert!(generate(out.path(), &[small("a")], Mode::Check).unwrap().out_of_date());
    assert_eq!(files(out.path()), []);
    generate(out.path(), &[small("a")], Mode::Write).unwrap();
    assert!(!generate(out.path(), &[small("a")], Mode::Check).unwrap().out_of_date());
    fs::remove_file(out.path().join("hooks/top_speed.rs")).unwrap();
    assert!(generate(out.path(), &[small("a")], Mode::Check).unwrap().out_of_date());
}

#[test]
fn a_hook_without_a_metric_and_a_runner_without_a_campaign_are_reported_and_kept() {
    let out = tempfile::tempdir().unwrap();
    generate(out.path(), &[small("a"), small("b")], Mode::Write).unwrap();
    let mut less = small("a");
    less.hooks.pop();
    for _ in 0..2 {
        let report = generate(out.path(), &[less.clone()], Mode::Write).unwrap();
        assert_eq!(
            report.orphans,
            [
                Orphan::Hook { path: "hooks/top_speed.rs".into(), of: "metric `top_speed`".into() },
                Orphan::Runner { folder: "b".into() }
            ]
        );
        assert!(out.path().join("hooks/top_speed.rs").exists());
        assert!(out.path().join("b/Cargo.toml").exists());
    }
    // Once the user has thrown them away, there is nothing left to say.
    fs::remove_file(out.path().join("hooks/top_speed.rs")).unwrap();
    fs::remove_dir_all(out.path().join("b")).unwrap();
    assert_eq!(generate(out.path(), &[less], Mode::Write).unwrap().orphans, []);
}

/// Adds a machine file to the manifest of runner `a`, as an older generator might have.
fn with_former_machine_file(out: &Path, path: &str, contents: &str) {
    let manifest = out.join("a/.sesame/manifest.json");
    let mut json: serde_json::Value = serde_json::from_str(&fs::read_to_string(&manifest).unwrap()).unwrap();
    let hash = "e9aae8e5b0f5ce4e6c6b1b3ae9fcd2c3f4a3a6a5d0c0e0e0e0e0e0e0e0e0e0e0";
    let known = json["files"]["src/main.rs"].clone();
    json["files"][path] =
        if contents.is_empty() { serde_json::json!({"owner": "machine", "hash": hash}) } else { known };
    fs::write(&manifest, json.to_string()).unwrap();
    let file = out.join("a").join(path);
    let main = fs::read_to_string(out.join("a/src/main.rs")).unwrap();
    fs::write(file, if contents.is_empty() { "edited".to_owned() } else { main }).unwrap();
}

#[test]
fn a_machine_file_of_an_older_generator_is_removed_unless_it_was_edited() {
    let out = tempfile::tempdir().unwrap();
    generate(out.path(), &[small("a")], Mode::Write).unwrap();
    with_former_machine_file(out.path(), "src/old.rs", "as generated");
    with_former_machine_file(out.path(), "src/older.rs", "");
    let report = generate(out.path(), &[small("a")], Mode::Write).unwrap();
    assert_eq!(report.count(Change::Removed), 1);
    assert!(!out.path().join("a/src/old.rs").exists());
    assert_eq!(report.orphans, [Orphan::Edited { path: "a/src/older.rs".into() }]);
    assert!(out.path().join("a/src/older.rs").exists());
}

#[test]
fn a_manifest_cannot_make_it_delete_elsewhere() {
    let out = tempfile::tempdir().unwrap();
    generate(out.path(), &[small("a")], Mode::Write).unwrap();
    with_former_machine_file(out.path(), "../precious.rs", "as generated");
    generate(out.path(), &[small("a")], Mode::Write).unwrap();
    assert!(out.path().join("precious.rs").exists());
}

#[test]
fn runners_of_another_space_are_not_overwritten() {
    let out = tempfile::tempdir().unwrap();
    generate(out.path(), &[small("a")], Mode::Write).unwrap();
    let mut other = small("a");
    other.plan.source = "other.sesame".into();
    let error = generate(out.path(), &[other], Mode::Write).unwrap_err();
    assert!(matches!(&error, Error::OtherSpace { other, .. } if other == "kuka_cell.sesame"), "{error}");
}

#[test]
fn a_damaged_manifest_is_an_error_that_says_what_to_do() {
    let out = tempfile::tempdir().unwrap();
    generate(out.path(), &[small("a")], Mode::Write).unwrap();
    for damage in ["", "{", "{\"schema\": 99}"] {
        fs::write(out.path().join("a/.sesame/manifest.json"), damage).unwrap();
        let error = generate(out.path(), &[small("a")], Mode::Force).unwrap_err();
        assert!(matches!(error, Error::Manifest { .. }), "{error}");
    }
}

#[test]
fn a_lock_file_is_a_start_for_cargo_and_then_cargos() {
    let out = tempfile::tempdir().unwrap();
    let seeded = |lock: &str| {
        let environment = sesame_codegen::emit::Environment { lock: Some(lock.to_owned()), ..environment() };
        apply(out.path(), &emit(&[small("a")], &environment).unwrap(), Mode::Write).unwrap()
    };
    seeded("version = 4\n");
    fs::write(out.path().join("a/Cargo.lock"), "by cargo").unwrap();
    assert!(!seeded("version = 5\n").out_of_date());
    assert_eq!(fs::read_to_string(out.path().join("a/Cargo.lock")).unwrap(), "by cargo");
}
