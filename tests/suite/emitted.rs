//! Generated crates really compile, and say it in our words when a hook is wrong.

#[path = "../../sesame-codegen/tests/suite/plans.rs"]
mod plans;

use std::fs;
use std::path::Path;

use sesame_codegen::emit::{Templates, emit};
use sesame_codegen::environment::{EnvironmentOptions, environment};
use sesame_codegen::output::{Mode, apply};
use sesame_codegen::plan::RunnerPlan;

use sesame_tests::{Done, cargo, fresh_folder, turn, workspace};

use self::plans::{awkward, small, with_program};

/// A project with a simulator that does nothing, and its runners.
fn generated(folder: &Path, plans: &[RunnerPlan]) {
    let runtime = sesame_codegen::environment::checkout_runtime().expect("tests run in a checkout");
    let manifest = format!(
        "[package]\nname = \"kuka_cell_sim\"\nedition = \"2024\"\n[workspace]\n[dependencies]\nsesame-runtime.path = {}\n",
        toml::Value::from(runtime.canonicalize().unwrap().to_str().unwrap())
    );
    fs::create_dir_all(folder.join("simulator/src")).unwrap();
    fs::write(folder.join("simulator/Cargo.toml"), manifest).unwrap();
    fs::write(
        folder.join("simulator/src/lib.rs"),
        "use sesame_runtime::simulator::*;
        pub struct Cell;
        impl Simulator for Cell {
            fn start(_: &Setup, _: &mut Bus<'_>) -> Result<Self, SimulatorError> { Ok(Cell) }
            fn step(&mut self, _: &mut Bus<'_>) -> Result<Progress, SimulatorError> { Ok(Progress::Running) }
        }",
    )
    .unwrap();
    let out = folder.join("runners");
    let environment =
        environment(&folder.join("kuka_cell.sesame"), &out, plans, &EnvironmentOptions::default()).unwrap();
    apply(&out, &emit(plans, &environment).unwrap(), Mode::Write).unwrap();
}

/// Builds a runner; what rustc says.
fn build(folder: &Path, runner: &str) -> (bool, String) {
    let Done { code, err, .. } = cargo(&turn(), &folder.join("runners").join(runner), &["build", "--quiet"]);
    (code == Some(0), err)
}

#[test]
fn fresh_stubs_of_every_type_and_name_compile_without_a_warning() {
    let folder = fresh_folder("stubs_of_every_type");
    generated(&folder, &[awkward(), small("coverage")]);
    for runner in ["type", "coverage"] {
        let (compiles, said) = build(&folder, runner);
        assert!(compiles, "{said}");
        assert!(!said.contains("src/generated") && !said.contains("hooks/"), "{said}");
    }
}

#[test]
fn a_runner_for_a_program_compiles_without_a_simulator_crate() {
    let folder = fresh_folder("program_without_a_crate");
    generated(&folder, &[with_program("coverage")]);
    fs::remove_dir_all(folder.join("simulator")).unwrap();
    let (compiles, said) = build(&folder, "coverage");
    assert!(compiles && !said.contains("src/generated"), "{said}");
}

#[test]
fn a_hook_without_its_impl_is_named_with_its_line_in_the_space() {
    let folder = fresh_folder("hook_without_impl");
    generated(&folder, &[small("coverage")]);
    fs::write(
        folder.join("runners/hooks/collision_occurrence.rs"),
        "#[derive(Default)]\npub struct CollisionOccurrence {}\n",
    )
    .unwrap();
    let (compiles, said) = build(&folder, "coverage");
    assert!(!compiles);
    assert!(said.contains("error[E0277]: metric `collision_occurrence` (kuka_cell.sesame:31) has no hook"), "{said}");
    assert_eq!(said.matches("error[").count(), 1, "{said}");
}

#[test]
fn a_hook_without_its_struct_is_named_with_its_line_in_the_space() {
    let folder = fresh_folder("hook_without_struct");
    generated(&folder, &[small("coverage")]);
    fs::write(folder.join("runners/hooks/collision_occurrence.rs"), "").unwrap();
    let (compiles, said) = build(&folder, "coverage");
    assert!(!compiles);
    assert!(said.contains("// metric `collision_occurrence` (kuka_cell.sesame:31)"), "{said}");
}

#[test]
fn hooks_may_share_a_file_of_their_own() {
    let folder = fresh_folder("hooks_with_a_file");
    generated(&folder, &[small("coverage")]);
    let hook = folder.join("runners/hooks/collision_occurrence.rs");
    let filled =
        fs::read_to_string(&hook).unwrap().replace("ctx.unimplemented();", "ctx.add(shared::ONE);") + "\nmod shared;\n";
    fs::write(&hook, filled).unwrap();
    fs::write(hook.with_file_name("shared.rs"), "pub const ONE: f64 = 1.0;\n").unwrap();
    let (compiles, said) = build(&folder, "coverage");
    assert!(compiles && !said.contains("hooks/"), "{said}");
}

#[test]
fn the_simulator_of_a_new_project_passes_its_own_tests() {
    let folder = fresh_folder("new_simulator");
    let project = folder.join("demo");
    sesame_codegen::output::create(
        &project,
        &sesame_codegen::project::files(
            &project,
            sesame_codegen::project::Simulator::Rust,
            None,
            &Templates::default(),
        )
        .unwrap(),
    )
    .unwrap();
    fs::copy(workspace().join("Cargo.lock"), project.join("simulator/Cargo.lock")).unwrap();
    // Nobody else needs the relay without features, so optimising it would only take time.
    let plain = ["--config", "profile.dev.package.sesame-relay.opt-level=0"];
    let tested = cargo(&turn(), &project.join("simulator"), &[&["test", "--quiet"], &plain[..]].concat()).expect(0);
    assert!(tested.out.contains("1 passed"), "{}", tested.out);
}
