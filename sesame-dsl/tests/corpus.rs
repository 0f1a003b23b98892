//! Files of the corpus against their blessed outcome, one test for each file: `good/` gives models, `bad/` gives
//! diagnostics.

mod files;

use std::process::ExitCode;

use libtest_mimic::{Arguments, Trial};
use sesame_dsl::diagnostic::render;

use files::{analyse_text, corpus};

fn main() -> ExitCode {
    let folders: [(&str, fn(&str, &str)); 2] = [("good", gives_its_model), ("bad", gives_its_diagnostics)];
    let tests = folders.into_iter().flat_map(|(folder, check)| {
        corpus(folder).into_iter().map(move |(name, text)| {
            Trial::test(format!("{folder}::{name}"), move || {
                check(&name, &text);
                Ok(())
            })
        })
    });
    libtest_mimic::run(&Arguments::from_args(), tests.collect()).exit_code()
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
