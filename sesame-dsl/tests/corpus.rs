//! Files of the corpus against their blessed outcome, one test for each file: `good/` gives models, `bad/` gives
//! diagnostics. `systems/` are ten systems as their engineers would describe them, without a line of Rust.

mod files;

use std::process::ExitCode;

use libtest_mimic::{Arguments, Trial};
use sesame_dsl::diagnostic::render;
use sesame_dsl::model::MetricSource;

use files::{analyse_text, corpus};

fn main() -> ExitCode {
    let mut tests = of_each("good", gives_its_model);
    tests.extend(of_each("bad", gives_its_diagnostics));
    tests.extend(of_each("systems", needs_no_rust));
    libtest_mimic::run(&Arguments::from_args(), tests).exit_code()
}

/// A test for each file of a folder.
fn of_each(folder: &'static str, check: fn(&str, &str)) -> Vec<Trial> {
    let test = |(name, text): (String, String)| {
        Trial::test(format!("{folder}::{name}"), move || {
            check(&name, &text);
            Ok(())
        })
    };
    corpus(folder).into_iter().map(test).collect()
}

fn gives_its_model(name: &str, text: &str) {
    let (sources, analysis) = analyse_text(name, text);
    let said = render::human(&analysis.diagnostics, &sources, false);
    assert!(!analysis.has_errors(), "{said}");
    let model = analysis.model.unwrap_or_else(|| panic!("{name} has no errors and no model"));
    insta::assert_snapshot!(format!("good_{name}"), format!("{said}{}", without_places(&format!("{model:#?}"))));
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

/// A model's debug text without spans and scales, whose numbers nobody can check by eye.
fn without_places(model: &str) -> String {
    let mut out = String::new();
    let mut skipping: Option<String> = None;
    for line in model.lines() {
        let indent = &line[..line.len() - line.trim_start().len()];
        match &skipping {
            Some(end) if line == end => skipping = None,
            Some(_) => {}
            None if ["span: Span {", "dimension: Dimension {", "scale: Scale {"].contains(&line.trim_start()) => {
                skipping = Some(format!("{indent}}},"));
            }
            None => out.extend([line, "\n"]),
        }
    }
    out
}
