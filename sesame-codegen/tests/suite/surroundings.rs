//! Where runners find the runtime, the simulator and what hooks need.

use std::fs;
use std::path::Path;

use sesame_codegen::environment::{EnvironmentOptions, Error, RuntimeChoice, checkout_runtime, environment};
use sesame_codegen::plan::RunnerPlan;

use crate::plans::{small, with_program};

/// A project in a folder: a simulator crate, and a `sesame.toml` if it is not empty.
fn project(folder: &Path, settings: &str) {
    fs::create_dir_all(folder.join("simulator")).unwrap();
    fs::write(folder.join("simulator/Cargo.toml"), "[package]\nname = \"kuka-cell-sim\"\n").unwrap();
    if !settings.is_empty() {
        fs::write(folder.join("sesame.toml"), settings).unwrap();
    }
}

fn dependencies(folder: &Path, plan: RunnerPlan, runtime: Option<&str>) -> Result<String, String> {
    let runtime = runtime.map(|text| RuntimeChoice::parse(text).unwrap());
    let found = environment(
        &folder.join("kuka_cell.sesame"),
        &folder.join("runners"),
        &[plan],
        &EnvironmentOptions { runtime, ..EnvironmentOptions::default() },
    );
    let lines = |(name, value): (&String, &toml::Value)| format!("{name} = {value}");
    let mentioned = |error: &Error| error.to_string().replace(&folder.display().to_string(), "PROJECT");
    found
        .map(|environment| environment.dependencies.iter().map(lines).collect::<Vec<_>>().join("\n"))
        .map_err(|errors| errors.iter().map(mentioned).collect::<Vec<_>>().join("\n"))
}

#[test]
fn a_simulator_beside_the_space_is_reached_by_a_relative_path_and_its_own_name() {
    let folder = tempfile::tempdir().unwrap();
    project(folder.path(), "");
    assert_eq!(
        dependencies(folder.path(), small("c"), Some("0.1.0")).unwrap(),
        "kuka_cell_sim = { package = \"kuka-cell-sim\", path = \"../../simulator\" }\nsesame-runtime = \"0.1.0\""
    );
}

#[test]
fn the_settings_choose_the_runtime_and_bring_dependencies_with_their_paths_adjusted() {
    let folder = tempfile::tempdir().unwrap();
    project(
        folder.path(),
        "[runtime]\nversion = \"0.3\"\n[dependencies]\ngeometry = { path = \"my/geometry\" }\nlibm = \"0.2\"\n",
    );
    assert_eq!(
        dependencies(folder.path(), small("c"), None).unwrap(),
        "geometry = { path = \"../../my/geometry\" }\n\
         kuka_cell_sim = { package = \"kuka-cell-sim\", path = \"../../simulator\" }\n\
         libm = \"0.2\"\n\
         sesame-runtime = { version = \"0.3\" }"
    );
}

#[test]
fn the_command_line_wins_over_the_settings() {
    let folder = tempfile::tempdir().unwrap();
    project(folder.path(), "[runtime]\nversion = \"0.3\"\n");
    assert!(dependencies(folder.path(), small("c"), Some("0.4.0")).unwrap().contains("sesame-runtime = \"0.4.0\""));
}

#[test]
fn a_checkout_build_uses_the_runtime_of_its_checkout_and_its_locked_versions() {
    let folder = tempfile::tempdir().unwrap();
    project(folder.path(), "");
    let out = folder.path().join("runners");
    let found =
        environment(&folder.path().join("kuka_cell.sesame"), &out, &[small("c")], &EnvironmentOptions::default())
            .unwrap();
    let path = found.dependencies["sesame-runtime"]["path"].as_str().unwrap();
    fs::create_dir_all(out.join("c")).unwrap();
    assert_eq!(
        out.join("c").join(path).canonicalize().unwrap(),
        checkout_runtime().expect("tests run in a checkout").canonicalize().unwrap()
    );
    assert!(found.lock.expect("the workspace has a lock file").contains("name = \"sesame-runtime\""));
}

#[test]
fn the_lock_file_of_the_first_sibling_runner_by_name_comes_first() {
    let folder = tempfile::tempdir().unwrap();
    project(folder.path(), "");
    let out = folder.path().join("runners");
    // The right one is neither the oldest nor the newest, and one of many: no folder lists it first by chance.
    for name in (150..200).chain(100..150).map(|number| format!("runner_{number}")) {
        fs::create_dir_all(out.join(&name)).unwrap();
        fs::write(out.join(format!("{name}/Cargo.lock")), format!("of {name}")).unwrap();
    }
    fs::create_dir_all(out.join("a")).unwrap();
    let found =
        environment(&folder.path().join("kuka_cell.sesame"), &out, &[small("c")], &EnvironmentOptions::default())
            .unwrap();
    assert_eq!(found.lock.as_deref(), Some("of runner_100"));
}

#[test]
fn all_that_is_wrong_is_said_at_once() {
    let folder = tempfile::tempdir().unwrap();
    project(folder.path(), "[dependencies]\nsesame_runtime = \"1\"\nkuka_cell_sim = \"1\"\n");
    insta::assert_snapshot!(dependencies(folder.path(), small("c"), Some("path:nowhere")).unwrap_err());
}

#[test]
fn a_missing_simulator_says_where_it_was_looked_for_and_how_to_name_it() {
    let folder = tempfile::tempdir().unwrap();
    let missing = dependencies(folder.path(), small("c"), Some("1.0.0")).unwrap_err();
    let unnamed = RunnerPlan { simulator_crate: None, ..small("c") };
    let unnamed = dependencies(folder.path(), unnamed, Some("1.0.0")).unwrap_err();
    insta::assert_snapshot!(format!("{missing}\n{unnamed}"));
}

#[test]
fn a_program_needs_no_crate_and_its_folder_is_known_as_seen_from_the_runner() {
    let folder = tempfile::tempdir().unwrap();
    assert_eq!(dependencies(folder.path(), with_program("c"), Some("1.0.0")).unwrap(), "sesame-runtime = \"1.0.0\"");
    let found = |out: &str| {
        let space = folder.path().join("kuka_cell.sesame");
        let plan = RunnerPlan { system_file: "shared/cell.sesame".to_owned(), ..with_program("c") };
        let found = environment(&space, &folder.path().join(out), &[plan], &EnvironmentOptions::default()).unwrap();
        (found.space_folder, found.simulator_folder)
    };
    fs::create_dir(folder.path().join("shared")).unwrap();
    assert_eq!(found("runners"), ("../..".to_owned(), "../../shared".to_owned()));
    assert_eq!(found("else/where"), ("../../..".to_owned(), "../../../shared".to_owned()));
}

#[test]
fn a_program_that_is_given_by_its_path_must_be_there() {
    let folder = tempfile::tempdir().unwrap();
    let mut plan = with_program("c");
    let sesame_plan::Transport::Process { program, .. } = &mut plan.plan.simulator.transport else { unreachable!() };
    "bin/robots".clone_into(program);
    let missing = dependencies(folder.path(), plan.clone(), Some("1.0.0")).unwrap_err();
    assert_eq!(
        missing,
        "kuka_cell.sesame gives the simulator's program as `bin/robots`, but PROJECT/bin/robots does not exist"
    );
    fs::create_dir(folder.path().join("bin")).unwrap();
    fs::write(folder.path().join("bin/robots"), "").unwrap();
    assert!(dependencies(folder.path(), plan, Some("1.0.0")).is_ok());
}

#[test]
fn a_misspelt_setting_is_an_error() {
    let folder = tempfile::tempdir().unwrap();
    project(folder.path(), "[dependancies]\nlibm = \"0.2\"\n");
    assert!(dependencies(folder.path(), small("c"), Some("1.0.0")).unwrap_err().contains("dependancies"));
}

#[test]
fn a_runtime_is_a_folder_or_a_version() {
    assert_eq!(RuntimeChoice::parse("path:../runtime"), Ok(RuntimeChoice::Folder("../runtime".into())));
    assert_eq!(RuntimeChoice::parse("=0.1.0"), Ok(RuntimeChoice::Version("=0.1.0".into())));
    assert!(RuntimeChoice::parse("../runtime").is_err());
    assert!(RuntimeChoice::parse("path:").is_err());
}

#[test]
fn runners_in_the_checkout_of_their_runtime_share_its_target_folder_and_others_have_their_own() {
    let target = |out: &Path, runtime: &Path| {
        let runtime = RuntimeChoice::parse(&format!("path:{}", runtime.display())).unwrap();
        let options = EnvironmentOptions { runtime: Some(runtime), ..EnvironmentOptions::default() };
        environment(&out.with_file_name("kuka_cell.sesame"), out, &[small("c")], &options).unwrap().target
    };
    let folder = tempfile::tempdir().unwrap();
    let checkout = folder.path().join("checkout");
    let (inside, outside) = (checkout.join("examples/cell"), folder.path().join("cell"));
    project(&inside, "");
    project(&outside, "");
    fs::create_dir(checkout.join("runtime")).unwrap();
    fs::write(checkout.join("runtime/Cargo.toml"), "[package]\nname = \"sesame-runtime\"\n").unwrap();
    fs::write(checkout.join("Cargo.lock"), "").unwrap();
    let runtime = checkout.join("runtime");
    assert_eq!(target(&inside.join("runners"), &runtime).as_deref(), Some("../../../target"));
    assert_eq!(target(&outside.join("runners"), &runtime), None);
    fs::remove_file(checkout.join("Cargo.lock")).unwrap();
    assert_eq!(target(&inside.join("runners"), &runtime), None, "a runtime by itself is not a checkout");
}
