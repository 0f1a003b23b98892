//! Files of the corpus against their blessed outcome, one test for each file: `good/` gives models, `bad/` gives
//! diagnostics. `systems/` are ten systems as their engineers would describe them, without a line of Rust.

mod blessed;
mod files;

use std::collections::{BTreeMap, BTreeSet};
use std::process::ExitCode;

use libtest_mimic::{Arguments, Trial};
use sesame_dsl::diagnostic::render;
use sesame_dsl::model::{MetricSource, Space};
use sesame_plan::testing::compact::{Base, Tree, variant, variants};

use blessed::{readable, tree, without_places};
use files::{analyse_text, corpus};

/// The files in `good/` that say what is ordinary, each of what those before it do not have. Their snapshots list that,
/// and those of all files leave it out.
const BASES: [&str; 2] = ["base", "base_of_ros"];

fn main() -> ExitCode {
    let mut tests = of_each("good", "good", gives_its_model);
    tests.extend(of_each("good", "hides_nothing", hides_nothing));
    tests.extend(of_each("bad", "bad", gives_its_diagnostics));
    tests.extend(of_each("systems", "systems", needs_no_rust));
    tests.push(Trial::test("the_bases_have_what_many_files_have", || {
        the_bases_have_what_many_files_have();
        Ok(())
    }));
    libtest_mimic::run(&Arguments::from_args(), tests).exit_code()
}

/// A test for each file of a folder, with the beginning of its name.
fn of_each(folder: &'static str, group: &'static str, check: fn(&str, &str)) -> Vec<Trial> {
    let test = |(name, text): (String, String)| {
        Trial::test(format!("{group}::{name}"), move || {
            check(&name, &text);
            Ok(())
        })
    };
    corpus(folder).into_iter().map(test).collect()
}

/// The model of a file without errors, and what is said about it.
fn model(name: &str, text: &str) -> (Space, String) {
    let (sources, analysis) = analyse_text(name, text);
    let said = render::human(&analysis.diagnostics, &sources, false);
    assert!(!analysis.has_errors(), "{said}");
    (analysis.model.unwrap_or_else(|| panic!("{name} has no errors and no model")), said)
}

/// What these files say is ordinary.
fn base(files: &[&str]) -> Base {
    let texts = corpus("good");
    let text = |name: &str| &texts.iter().find(|(file, _)| file == name).expect("a base is in good/").1;
    let models: Vec<Tree> = files.iter().map(|name| readable(tree(&model(name, text(name)).0))).collect();
    Base::of(&models)
}

fn gives_its_model(name: &str, text: &str) {
    let (model, said) = model(name, text);
    let mut parts = vec![said];
    if let Some(at) = BASES.iter().position(|base| *base == name) {
        let ordinary = base(&BASES[..=at]).ordinary(&base(&BASES[..at]));
        parts.push(format!("What is ordinary:\n{ordinary}"));
    }
    parts.push(base(&BASES).compact(&readable(tree(&model))));
    parts.retain(|part| !part.is_empty());
    insta::with_settings!({ omit_expression => true }, {
        insta::assert_snapshot!(format!("good_{name}"), parts.join("\n"));
    });
}

/// If anything in a model were something else, its snapshot would be another.
fn hides_nothing(name: &str, text: &str) {
    let base = base(&BASES);
    let model = without_places(tree(&model(name, text).0));
    let shown = base.compact(&readable(model.clone()));
    // All changes of all models would take minutes.
    let step = 1 + variants(&model) / 100;
    for number in (0..).step_by(step) {
        let Some(other) = variant(&model, number) else { break };
        if other != model {
            assert!(base.compact(&readable(other)) != shown, "change {number} is hidden");
        }
    }
}

/// A type that many files have is in a base, so that a new field of it changes one snapshot.
fn the_bases_have_what_many_files_have() {
    let base = base(&BASES);
    let mut files: BTreeMap<String, BTreeSet<String>> = BTreeMap::new();
    for (name, text) in corpus("good") {
        readable(tree(&model(&name, &text).0)).each_struct(&mut |key, _| {
            files.entry(key.to_owned()).or_default().insert(name.clone());
        });
    }
    files.retain(|key, files| files.len() > 2 && !base.has(key));
    assert!(files.is_empty(), "declare these in one of {BASES:?}, in their plainest form: {files:#?}");
}

fn gives_its_diagnostics(name: &str, text: &str) {
    let (sources, analysis) = analyse_text(name, text);
    assert!(!analysis.diagnostics.is_empty(), "{name} is not bad");
    assert_eq!(analysis.model.is_some(), !analysis.has_errors(), "{name}");
    insta::assert_snapshot!(format!("bad_{name}"), render::human(&analysis.diagnostics, &sources, false));
}

fn needs_no_rust(name: &str, text: &str) {
    let (sources, analysis) = analyse_text(name, text);
    assert!(analysis.diagnostics.is_empty(), "{}", render::human(&analysis.diagnostics, &sources, false));
    let model = analysis.model.unwrap_or_else(|| panic!("{name} has no errors and no model"));
    let hooks = model.metrics.iter().filter(|(_, metric)| matches!(metric.source, MetricSource::Hook { .. }));
    assert_eq!(hooks.count(), 0, "{name}");
    assert!(model.metrics.len() > 10 && model.requirements.len() > 4 && model.operations.len() > 5, "{name}");
}
