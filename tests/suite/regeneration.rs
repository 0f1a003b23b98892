//! A space grows while its hooks are already written.

use std::fs;
use std::path::Path;

use sesame_tests::{Project, workspace};

fn project(name: &str) -> Project {
    let space = fs::read_to_string(workspace().join("tests/simulators/faulty/space.sesame")).unwrap();
    Project::new(name, &space.replace("NAME", name), "faulty")
}

fn edit(path: &Path, from: &str, to: &str) {
    let text = fs::read_to_string(path).unwrap();
    assert!(text.contains(from), "no `{from}` in {text}");
    fs::write(path, text.replace(from, to)).unwrap();
}

const FILLED: &str = "if heard > 0.0 { ctx.set(heard); } // mine";

#[test]
fn a_new_metric_and_operation_leave_earlier_hooks_as_they_are() {
    let project = project("growing");
    assert_eq!(project.sesamec("generate", &["--check"]).code, Some(1), "nothing is there yet");
    project.sesamec("generate", &[]).expect(0);
    let hook = project.runners.join("hooks/fragile.rs");
    edit(&hook, "ctx.unimplemented();", FILLED);
    let mine = fs::read(&hook).unwrap();
    project.sesamec("generate", &["--check"]).expect(0);

    edit(
        &project.space,
        "campaign harmless {",
        "metric loudest { hook on heard }\n\
         operation lose_level on level = packet loss [0%, 100%] within [0s, 1s]\n\n\
         campaign harmless {",
    );
    edit(&project.space, "operations do_nothing   1..3", "observes loudest  operations do_nothing, lose_level   1..3");
    let check = project.sesamec("generate", &["--check"]).expect(1);
    assert!(check.err.contains("loudest.rs is missing"), "{}", check.err);
    assert!(!project.runners.join("hooks/loudest.rs").exists(), "`--check` writes nothing");

    let said = project.sesamec("generate", &[]).expect(0).err;
    assert!(said.contains("loudest.rs: fill this in"), "{said}");
    assert_eq!(fs::read(&hook).unwrap(), mine, "byte for byte");
    assert!(fs::read_to_string(project.runners.join("hooks/loudest.rs")).unwrap().contains("ctx.unimplemented()"));
    project.sesamec("generate", &["--check"]).expect(0);

    let ran = project.run("harmless", &[]).expect(0);
    assert!(ran.err.contains("the hook of metric `loudest` is not filled in yet"), "{}", ran.err);
}

#[test]
fn without_its_impl_a_hook_is_named_by_rustc_with_its_line_in_the_space() {
    let project = project("bare");
    project.sesamec("generate", &["--campaign", "harmless"]).expect(0);
    fs::write(project.runners.join("hooks/fragile.rs"), "#[derive(Default)]\npub struct Fragile;\n").unwrap();
    let line = fs::read_to_string(&project.space).unwrap().lines().position(|line| line.contains("metric fragile"));
    let said = project.run("harmless", &[]).expect(1).err;
    let place = format!("metric `fragile` (bare.sesame:{}) has no hook", line.unwrap() + 1);
    assert!(said.contains(&place), "{place}: {said}");
    assert!(said.contains("cannot build the runner"), "{said}");
}

#[test]
fn an_objective_with_an_unfilled_stub_is_named_before_anything_is_simulated() {
    let project = project("unfilled_objective");
    let refused = project.run("harmless", &[]).expect(1);
    assert!(refused.err.contains("the hook of `fragile` is not filled in yet"), "{}", refused.err);
    assert!(refused.err.contains("--allow-unimplemented"), "{}", refused.err);
    assert_eq!(refused.out, "");
    assert!(!project.runners.join("harmless/results").exists(), "nothing was simulated");
    let allowed = project.run("harmless", &["--", "--allow-unimplemented"]).expect(0);
    assert!(allowed.out.contains("front of"), "{}", allowed.out);
}
