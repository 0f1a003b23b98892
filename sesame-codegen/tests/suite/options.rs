//! What the options of `generate` change: where hooks are, what is copied into a runner, and the texts for people.

use std::collections::BTreeMap;
use std::fs;
use std::path::Path;

use sesame_codegen::emit::{Environment, HooksFolder, Problem, Templates, emit};
use sesame_codegen::environment::{EnvironmentOptions, Error, RuntimeChoice, environment};
use sesame_codegen::output::{Change, Mode, Orphan, apply};

use crate::plans::{small, with_program};

/// Writes files of these texts.
fn write(folder: &Path, files: &[(&str, &str)]) {
    for (path, text) in files {
        let path = folder.join(path);
        fs::create_dir_all(path.parent().unwrap()).unwrap();
        fs::write(path, text).unwrap();
    }
}

fn own_hooks(shared: &[(&str, &str)]) -> Environment {
    let shared = shared.iter().map(|&(path, text)| (path.to_owned(), text.to_owned())).collect();
    Environment { hooks: HooksFolder::Own { shared }, ..crate::placed::environment() }
}

#[test]
fn a_self_contained_runner_has_its_hooks_in_its_own_folder_and_starts_from_the_shared_ones() {
    let environment = own_hooks(&[("top_speed.rs", "// filled in"), ("limits.rs", "// shared by hooks")]);
    let trees = emit(&[small("a")], &environment).unwrap();
    let text = |path: &str| trees[1].files[path].text();
    assert_eq!(text("src/hooks/top_speed.rs"), "// filled in");
    assert_eq!(text("src/hooks/limits.rs"), "// shared by hooks");
    assert!(text("src/hooks/collision_occurrence.rs").contains("ctx.unimplemented()"));
    assert!(text("src/generated/registry.rs").contains("#[path = \"../hooks/collision_occurrence.rs\"]"));
    assert!(text("README.md").contains("(src/hooks/collision_occurrence.rs)"), "{}", text("README.md"));
    assert!(text("src/main.rs").contains("sesamec generate kuka_cell.sesame --self-contained`"));
    assert!(text(".gitignore").contains("/target/"));
}

#[test]
fn a_runner_that_carries_more_is_not_overwritten_by_one_that_carries_less() {
    let out = tempfile::tempdir().unwrap();
    let own = emit(&[small("a")], &own_hooks(&[])).unwrap();
    apply(out.path(), &own[1..], Mode::Write).unwrap();
    let shared = emit(&[small("a")], &crate::placed::environment()).unwrap();
    let error = apply(out.path(), &shared, Mode::Write).unwrap_err();
    assert!(
        error.to_string().contains("was generated with `--self-contained`: pass `--self-contained` again"),
        "{error}"
    );
    assert!(!out.path().join("hooks").exists());

    let report = apply(out.path(), &shared, Mode::Force).unwrap();
    assert!(
        report
            .orphans
            .contains(&Orphan::Hook { path: "a/src/hooks/top_speed.rs".into(), of: "metric `top_speed`".into() })
    );
    assert!(out.path().join("a/src/hooks/top_speed.rs").exists(), "a user's file is never deleted");
}

#[test]
fn an_update_is_shown_as_a_diff_and_nothing_is_written() {
    let out = tempfile::tempdir().unwrap();
    let trees = |doc: &str| {
        let mut plan = small("a");
        plan.plan.campaign.doc = doc.to_owned();
        emit(&[plan], &crate::placed::environment()).unwrap()
    };
    apply(out.path(), &trees("Before."), Mode::Write).unwrap();
    let report = apply(out.path(), &trees("After."), Mode::Check).unwrap();
    let readme = report.files.iter().find(|file| file.path == "a/README.md").unwrap();
    assert_eq!(readme.change, Change::Updated);
    let diff = readme.diff.as_deref().unwrap();
    assert!(diff.contains("\n-> Before.\n+> After.\n"), "{diff}");
    assert!(fs::read_to_string(out.path().join("a/README.md")).unwrap().contains("Before."));
}

#[test]
fn an_edited_file_is_only_overwritten_in_thought_by_a_forced_check() {
    let out = tempfile::tempdir().unwrap();
    let trees = emit(&[small("a")], &crate::placed::environment()).unwrap();
    apply(out.path(), &trees, Mode::Write).unwrap();
    let main = out.path().join("a/src/main.rs");
    fs::write(&main, "fn main() {}\n").unwrap();
    assert!(apply(out.path(), &trees, Mode::Check).is_err());
    let report = apply(out.path(), &trees, Mode::CheckForce).unwrap();
    assert_eq!(report.count(Change::Updated), 1);
    assert_eq!(fs::read_to_string(&main).unwrap(), "fn main() {}\n");
}

fn templates(files: &[(&str, &str)]) -> Result<Templates, Vec<Problem>> {
    Templates::replacing(files.iter().map(|&(name, text)| (name.to_owned(), text.to_owned())).collect())
}

#[test]
fn a_template_is_replaced_by_its_name() {
    let replaced = templates(&[("runner/hook.rs.tera", "// {{ metric }} of {{ space }}\n")]).unwrap();
    let environment = Environment { templates: replaced, ..crate::placed::environment() };
    let trees = emit(&[small("a")], &environment).unwrap();
    assert_eq!(trees[0].files["hooks/top_speed.rs"].text(), "// top_speed of kuka_cell\n");
    let usual = emit(&[small("a")], &crate::placed::environment()).unwrap();
    assert_eq!(trees[0].files["README.md"], usual[0].files["README.md"]);
}

#[test]
fn templates_that_replace_nothing_or_are_none_are_named() {
    let problems = templates(&[("runner/hok.rs.tera", ""), ("runner/hook.rs.tera", "{% for %}")]).unwrap_err();
    let said: Vec<String> = problems.iter().map(ToString::to_string).collect();
    assert!(
        said[0].starts_with("there is no template `runner/hok.rs.tera` to replace; there are project/"),
        "{said:?}"
    );
    assert!(said[1].starts_with("the template `runner/hook.rs.tera` cannot be filled in: "), "{said:?}");
}

#[test]
fn a_template_that_speaks_of_what_there_is_not_is_named() {
    let replaced = templates(&[("runner/hook.rs.tera", "{{ nothing }}")]).unwrap();
    let environment = Environment { templates: replaced, ..crate::placed::environment() };
    let problems = emit(&[small("a"), small("b")], &environment).unwrap_err();
    let said: Vec<String> = problems.iter().map(ToString::to_string).collect();
    assert_eq!(said.len(), 1, "{said:?}");
    assert!(said[0].contains("runner/hook.rs.tera") && said[0].contains("nothing"), "{said:?}");
}

/// A project in `project/`, a runtime in `checkout/` that takes things from a workspace, and the runner's surroundings.
fn vendored(folder: &Path, more: &[(&str, &str)]) -> Result<Environment, Vec<Error>> {
    write(
        folder,
        &[
            (
                "checkout/Cargo.toml",
                "[workspace]\npackage.version = \"1.2.3\"\npackage.edition = \"2024\"\nlints.rust.unsafe_code = \"forbid\"\n\
                 [workspace.dependencies]\nsesame-plan = { path = \"runtime/model/plan\", version = \"1.2.3\" }\n\
                 libm = { version = \"0.2\", features = [\"a\"] }\nserde = \"1\"\ninsta = \"1\"\n",
            ),
            (
                "checkout/runtime/Cargo.toml",
                "[package]\nname = \"sesame-runtime\"\nversion.workspace = true\nedition.workspace = true\n\
                 [dependencies]\nsesame-plan = { workspace = true, optional = true }\nserde.workspace = true\n\
                 libm = { workspace = true, features = [\"b\"] }\n\
                 [dev-dependencies]\ninsta.workspace = true\n[lints]\nworkspace = true\n",
            ),
            ("checkout/runtime/src/lib.rs", "// the runtime"),
            ("checkout/runtime/tests/suite.rs", "// tests"),
            ("checkout/runtime/target/debug/junk", "junk"),
            ("checkout/runtime/.hidden", "hidden"),
            ("checkout/runtime/model/plan/Cargo.toml", "[package]\nname = \"sesame-plan\"\nversion.workspace = true\n"),
            ("checkout/runtime/model/plan/src/lib.rs", "// the plan"),
            (
                "project/simulator/Cargo.toml",
                "[package]\nname = \"kuka_cell_sim\"\n[workspace]\n[profile.dev]\nopt-level = 3\n\
                 [dependencies]\nsesame-runtime = { git = \"https://example.org\", tag = \"v1\", features = [\"f\"] }\n\
                 [target.'cfg(unix)'.dependencies]\nphysics = { path = \"../physics\", package = \"my-physics\" }\n",
            ),
            ("project/simulator/src/lib.rs", "// the simulator"),
            ("project/simulator/meshes/arm.stl", "a mesh"),
            ("project/physics/Cargo.toml", "[package]\nname = \"my-physics\"\n"),
            ("project/physics/src/lib.rs", "// physics"),
        ],
    );
    write(folder, more);
    let runtime = RuntimeChoice::Folder(folder.join("checkout/runtime"));
    let options = EnvironmentOptions { runtime: Some(runtime), vendor: true, ..EnvironmentOptions::default() };
    let project = folder.join("project");
    environment(&project.join("kuka_cell.sesame"), &project.join("runners"), &[small("a")], &options)
}

#[test]
fn a_vendored_runner_has_every_crate_that_is_in_a_folder_and_manifests_that_need_no_workspace() {
    let folder = tempfile::tempdir().unwrap();
    let environment = vendored(folder.path(), &[]).unwrap();
    let paths: Vec<&str> = environment.vendored.keys().map(String::as_str).collect();
    assert_eq!(
        paths,
        [
            "vendor/kuka_cell_sim/Cargo.toml",
            "vendor/kuka_cell_sim/meshes/arm.stl",
            "vendor/kuka_cell_sim/src/lib.rs",
            "vendor/my-physics/Cargo.toml",
            "vendor/my-physics/src/lib.rs",
            "vendor/sesame-plan/Cargo.toml",
            "vendor/sesame-plan/src/lib.rs",
            "vendor/sesame-runtime/Cargo.toml",
            "vendor/sesame-runtime/src/lib.rs",
        ]
    );
    let manifests = ["kuka_cell_sim", "my-physics", "sesame-plan", "sesame-runtime"].map(|package| {
        let text = String::from_utf8_lossy(&environment.vendored[&format!("vendor/{package}/Cargo.toml")]);
        format!("═══ {package}\n{text}")
    });
    insta::assert_snapshot!(manifests.join("\n"));
    let trees = emit(&[small("a")], &environment).unwrap();
    let manifest: toml::Table = toml::from_str(&trees[1].files["Cargo.toml"].text()).unwrap();
    assert_eq!(manifest["dependencies"]["sesame-runtime"]["path"].as_str(), Some("vendor/sesame-runtime"));
    assert_eq!(manifest["dependencies"]["kuka_cell_sim"]["path"].as_str(), Some("vendor/kuka_cell_sim"));
    assert_eq!(manifest["workspace"]["exclude"][0].as_str(), Some("vendor"));
    assert_eq!(trees[1].options.keys().collect::<Vec<_>>(), ["runtime", "vendor"]);
    assert!(trees[1].files.contains_key("src/hooks/top_speed.rs"));
}

#[test]
fn a_file_that_is_no_text_is_vendored_as_it_is() {
    let folder = tempfile::tempdir().unwrap();
    fs::create_dir_all(folder.path().join("project/simulator/meshes")).unwrap();
    let mesh = [0_u8, 255, 254, 13, 10];
    fs::write(folder.path().join("project/simulator/meshes/hand.stl"), mesh).unwrap();
    let environment = vendored(folder.path(), &[]).unwrap();
    let out = folder.path().join("elsewhere");
    let trees = emit(&[small("a")], &environment).unwrap();
    apply(&out, &trees[1..], Mode::Write).unwrap();
    assert_eq!(fs::read(out.join("a/vendor/kuka_cell_sim/meshes/hand.stl")).unwrap(), mesh);
    assert!(!apply(&out, &trees[1..], Mode::Write).unwrap().out_of_date());
}

#[test]
fn crates_that_cannot_be_vendored_say_why() {
    let said = |more: &[(&str, &str)]| {
        let folder = tempfile::tempdir().unwrap();
        let errors = vendored(folder.path(), more).unwrap_err();
        errors[0].to_string().replace(&folder.path().canonicalize().unwrap().display().to_string(), "HERE")
    };
    let twice = said(&[("project/physics/Cargo.toml", "[package]\nname = \"sesame-plan\"\n")]);
    assert!(twice.contains("its package `sesame-plan` is called like the one in"), "{twice}");
    let orphan = said(&[("project/physics/Cargo.toml", "[package]\nname = \"p\"\nversion.workspace = true\n")]);
    assert!(orphan.contains("it inherits `package.version`, which no workspace around it has"), "{orphan}");
    let named = said(&[("project/physics/Cargo.toml", "[package]\nname = \"../evil\"\n")]);
    assert!(named.contains("`../evil` is not the name of a package"), "{named}");
    let missing = said(&[(
        "project/simulator/Cargo.toml",
        "[package]\nname = \"kuka_cell_sim\"\n[dependencies]\nx.path = \"x\"\n",
    )]);
    assert!(missing.contains("HERE/project/simulator/x/Cargo.toml"), "{missing}");
}

#[test]
fn a_runtime_that_is_in_no_folder_cannot_be_vendored() {
    let folder = tempfile::tempdir().unwrap();
    let options = EnvironmentOptions {
        runtime: Some(RuntimeChoice::Version("0.1.0".into())),
        vendor: true,
        ..EnvironmentOptions::default()
    };
    let space = folder.path().join("kuka_cell.sesame");
    let errors = environment(&space, &folder.path().join("runners"), &[with_program("a")], &options).unwrap_err();
    assert!(matches!(errors[..], [Error::RuntimeHasNoFolder]), "{errors:?}");
}

#[test]
fn the_settings_name_a_folder_of_templates_and_the_command_line_another() {
    let folder = tempfile::tempdir().unwrap();
    write(
        folder.path(),
        &[
            ("sesame.toml", "templates = \"texts\"\n"),
            ("texts/runner/hook.rs.tera", "// of the settings"),
            ("others/runner/hook.rs.tera", "// of the command line"),
            ("wrong/hook.rs.tera", ""),
        ],
    );
    let stub = |templates: Option<&str>| {
        let options = EnvironmentOptions {
            runtime: Some(RuntimeChoice::Version("0.1.0".into())),
            templates: templates.map(|name| folder.path().join(name)),
            ..EnvironmentOptions::default()
        };
        let space = folder.path().join("kuka_cell.sesame");
        let found = environment(&space, &folder.path().join("runners"), &[with_program("a")], &options)?;
        Ok(emit(&[with_program("a")], &found).unwrap()[0].files["hooks/top_speed.rs"].text().into_owned())
    };
    let stub = |templates| stub(templates).map_err(|errors: Vec<Error>| errors[0].to_string());
    assert_eq!(stub(None).unwrap(), "// of the settings");
    assert_eq!(stub(Some("others")).unwrap(), "// of the command line");
    assert!(stub(Some("wrong")).unwrap_err().contains("there is no template `hook.rs.tera` to replace"));
}

#[test]
fn the_generators_own_templates_can_be_taken_as_a_start() {
    let all: BTreeMap<String, String> =
        sesame_templates::ALL.iter().map(|&(name, text)| (name.to_owned(), text.to_owned())).collect();
    let environment = Environment { templates: Templates::replacing(all).unwrap(), ..crate::placed::environment() };
    assert_eq!(emit(&[small("a")], &environment).unwrap(), emit(&[small("a")], &crate::placed::environment()).unwrap());
}
