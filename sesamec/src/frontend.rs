//! The Sesame language as the command uses it: text → diagnostics, and a plan for each campaign.

use std::path::Path;

use sesame_codegen::input::{self, Unreadable};
use sesame_codegen::lower::{lower, lower_monitor, simulator};
use sesame_codegen::plan::{MonitorPlan, RunnerPlan};
use sesame_dsl::Analysis;
use sesame_dsl::diagnostic::{Diagnostic, MEANINGS, Severity, page, render};
use sesame_dsl::index::Kind;
use sesame_dsl::model::Space;
use sesame_dsl::source::SourceMap;
use sesame_dsl::span::Span;
use sesame_plan::NotAlone;

use crate::certificate;
use crate::interfaces::Files;
use crate::uses;

/// The language as the command needs it.
#[derive(Debug, Clone, Copy)]
pub struct Language {
    /// Checks a space: its path, which diagnostics show and imports are relative to, its text, and how diagnostics are
    /// to look.
    pub check: fn(file: &str, text: &str, look: Look) -> Checked,
    /// Formats a text in the same way: the text in the one layout, or diagnostics of its syntax errors.
    pub format: fn(file: &str, text: &str, look: Look) -> Result<String, Diagnosed>,
    /// The page of a diagnostic's code.
    pub explain: fn(code: &str) -> Option<&'static str>,
    /// Every code of a diagnostic, with what it is about.
    pub codes: fn() -> Vec<(&'static str, &'static str)>,
    /// What a space declares by a name, and what mentions it, even if the space has errors; or why that cannot be told.
    pub find: fn(file: &str, text: &str, name: &str) -> Result<Found, String>,
    /// Lists everything that a space declares.
    pub declarations: fn(file: &str, text: &str) -> Declarations,
}

/// How diagnostics look.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Look {
    /// For people, with the lines they speak of.
    Human {
        /// With colours.
        colour: bool,
    },
    /// One line each.
    Short,
    /// One JSON object and line each.
    Json,
    /// One workflow command of GitHub each.
    Github,
}

/// Diagnostics of a text with errors.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Diagnosed {
    /// As text.
    pub diagnostics: String,
    /// How many of them are errors.
    pub errors: usize,
}

/// A thing of a space.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Found {
    /// Whether it is a campaign.
    pub campaign: bool,
    /// Its definition and its uses.
    pub text: String,
    /// Its uses alone; empty if it has none.
    pub uses: String,
    /// Definition and uses as one line of JSON.
    pub json: String,
    /// How many errors the space has. What could not be read is not among the uses.
    pub errors: usize,
}

/// Everything that a space declares.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Declarations {
    /// As text, a line each.
    pub text: String,
    /// As one line of JSON.
    pub json: String,
    /// How many errors the space has. What could not be read is not listed.
    pub errors: usize,
}

/// What came of checking a space.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Checked {
    /// Errors and warnings as text; empty when there are none.
    pub diagnostics: String,
    /// How many of them are errors.
    pub errors: usize,
    /// How many of them are warnings.
    pub warnings: usize,
    /// What could not be decided about monitors, one sentence each.
    pub undecided: Vec<String>,
    /// What the space holds, for example `4 campaigns, 9 operations`.
    pub summary: String,
    /// A plan for each campaign; empty when there are errors.
    pub plans: Vec<RunnerPlan>,
    /// Each monitor by its name, with its plan as a program of its own, or why it cannot be one; empty when there are
    /// errors.
    pub monitors: Vec<(String, Result<MonitorPlan, NotAlone>)>,
    /// What the space says and no runner uses yet, one sentence each.
    pub notes: Vec<String>,
}

/// The language of this version.
pub const SESAME: Language = Language { check, format, explain: page, codes, find, declarations };

fn codes() -> Vec<(&'static str, &'static str)> {
    MEANINGS.iter().map(|(code, meaning)| (code.text(), *meaning)).collect()
}

/// What the plan names as its generator.
const GENERATOR: &str = concat!("sesamec ", env!("CARGO_PKG_VERSION"));

fn check(file: &str, text: &str, look: Look) -> Checked {
    let mut sources = SourceMap::new();
    let root = sources.add(file, text);
    sesame_dsl::load_imports(&mut sources, root, read);
    let analysis = sesame_dsl::analyse_with(&sources, root, &Files::default());
    let Diagnosed { diagnostics, errors } = diagnosed(&analysis.diagnostics, &sources, look);
    let warnings = analysis.diagnostics.iter().filter(|found| found.severity() == Severity::Warning).count();
    // A plan names the file without its folder: the same space gives the same plan wherever it lies.
    let source = file.rsplit(['/', std::path::MAIN_SEPARATOR]).next().unwrap_or(file);
    let undecided = undecided(&analysis.undecided, &sources);
    let monitors = analysis.model.iter().flat_map(|space| {
        let named = move |id| space.eddis[id].declaration.name.clone();
        space.eddis.iter().map(move |(id, _)| (named(id), lower_monitor(space, id, source, GENERATOR)))
    });
    let monitors = monitors.collect();
    let (summary, plans, notes) = match &analysis.model {
        Some(space) => {
            let plans = space.campaigns.iter().map(|(campaign, _)| lower(space, campaign, source, GENERATOR)).collect();
            (summary(space), plans, not_used(space, &sources))
        }
        None => (String::new(), Vec::new(), Vec::new()),
    };
    Checked { diagnostics, errors, warnings, undecided, summary, plans, monitors, notes }
}

/// What could not be decided about monitors, with its places.
fn undecided(undecided: &[(Span, String)], sources: &SourceMap) -> Vec<String> {
    let at = |span: Span| format!("{}:{}", sources.file(span.file).name(), sources.position(span).line);
    undecided.iter().map(|(span, text)| format!("{text} ({})", at(*span))).collect()
}

/// An imported file, or why there is none.
fn read(name: &str) -> Result<String, String> {
    input::text(Path::new(name)).map_err(|unreadable| match unreadable {
        Unreadable::System(error) => format!("it cannot be read: {error}"),
        other => other.to_string(),
    })
}

/// What a space says and no runner uses, or not yet, with its places.
fn not_used(space: &Space, sources: &SourceMap) -> Vec<String> {
    let at = |span: Span| {
        let file = space.files.get(&span.file).map_or("", String::as_str);
        format!("{file}:{}", sources.position(span).line)
    };
    let mut notes = Vec::new();
    let simulator = simulator(space, &space.simulator);
    if let (Some(budget), Some(_)) = (&space.lifecycle.relay_budget, simulator.step_ns()) {
        let why = if simulator.properties().in_runner {
            "an in-process simulator is stepped without delay"
        } else {
            "in lock-step time stands still while messages pass through the relay"
        };
        notes.push(format!("`relay budget` ({}) has no effect: {why}", at(budget.span)));
    }
    notes
}

fn format(file: &str, text: &str, look: Look) -> Result<String, Diagnosed> {
    let mut sources = SourceMap::new();
    let root = sources.add(file, text);
    sesame_dsl::format::format(&sources, root).map_err(|errors| diagnosed(&errors, &sources, look))
}

fn find(file: &str, text: &str, name: &str) -> Result<Found, String> {
    let mut sources = SourceMap::new();
    let root = sources.add(file, text);
    sesame_dsl::load_imports(&mut sources, root, read);
    let Analysis { index, model, diagnostics, .. } = sesame_dsl::analyse_with(&sources, root, &Files::default());
    let id = uses::find(&sources, &index, file, name)?;
    let declared = index.definition(id).span;
    let certificate = model.and_then(|space| certificate::certificate(&space, &sources, &index, declared));
    Ok(Found {
        campaign: index.definition(id).kind == Kind::Campaign,
        text: uses::text(&sources, &index, id, certificate.as_ref()),
        uses: uses::uses(&sources, &index, id),
        json: uses::json(&sources, &index, id, certificate.as_ref()),
        errors: errors(&diagnostics),
    })
}

fn declarations(file: &str, text: &str) -> Declarations {
    let mut sources = SourceMap::new();
    let root = sources.add(file, text);
    sesame_dsl::load_imports(&mut sources, root, read);
    let Analysis { index, diagnostics, .. } = sesame_dsl::analyse_with(&sources, root, &Files::default());
    Declarations {
        text: uses::list(&sources, &index),
        json: uses::list_json(&sources, &index),
        errors: errors(&diagnostics),
    }
}

fn errors(diagnostics: &[Diagnostic]) -> usize {
    diagnostics.iter().filter(|found| found.severity() == Severity::Error).count()
}

fn diagnosed(diagnostics: &[Diagnostic], sources: &SourceMap, look: Look) -> Diagnosed {
    let text = match look {
        Look::Human { colour } => render::human(diagnostics, sources, colour),
        Look::Short => render::short(diagnostics, sources),
        Look::Json => render::json(diagnostics, sources),
        Look::Github => render::github(diagnostics, sources),
    };
    Diagnosed { diagnostics: text, errors: errors(diagnostics) }
}

/// What a space holds, for example `4 campaigns, 9 operations, 6 metrics, 2 requirements`.
fn summary(space: &Space) -> String {
    let counts = [
        (space.campaigns.iter().count(), "campaign"),
        (space.operations.iter().count(), "operation"),
        (space.metrics.values().filter(|metric| !metric.is_of_part()).count(), "metric"),
        (space.requirements.iter().count(), "requirement"),
    ];
    let counted = counts.map(|(n, what)| if n == 1 { format!("1 {what}") } else { format!("{n} {what}s") });
    counted.join(", ")
}

#[cfg(test)]
mod tests {
    use sesame_codegen::emit::Templates;
    use sesame_codegen::environment::RuntimeChoice;
    use sesame_codegen::project::{self, Simulator};
    use sesame_runtime::transport::is_built_in;

    use super::*;

    const PLAIN: Look = Look::Human { colour: false };

    /// The check of a new project's space.
    fn new_project(simulator: Simulator) -> Checked {
        let runtime = RuntimeChoice::Version("1.0.0".into());
        let templates = Templates::default();
        let files = project::files(Path::new("demo"), simulator, Some(&runtime), &templates).unwrap();
        check("some/demo.sesame", &files["demo.sesame"], PLAIN)
    }

    #[test]
    fn the_space_of_a_new_project_is_correct() {
        let checked = new_project(Simulator::Rust);
        assert_eq!((checked.errors, checked.diagnostics.as_str()), (0, ""));
        assert_eq!(checked.summary, "1 campaign, 2 operations, 2 metrics, 1 requirement");
        assert_eq!(checked.plans[0].plan.source, "demo.sesame");
        assert_eq!(checked.plans[0].hooks[0].metric, "close_calls");
        assert!(checked.plans[0].needs_a_runner(is_built_in) && checked.plans[0].has_hooks());
    }

    #[test]
    fn the_space_of_a_new_project_in_python_is_correct_and_needs_no_rust() {
        let checked = new_project(Simulator::Python);
        assert_eq!((checked.errors, checked.diagnostics.as_str()), (0, ""));
        assert_eq!(checked.summary, "1 campaign, 2 operations, 3 metrics, 1 requirement");
        assert!(!checked.plans[0].needs_a_runner(is_built_in) && !checked.plans[0].has_hooks());
    }

    #[test]
    fn the_examples_deserve_no_warning() {
        let examples = Path::new(env!("CARGO_MANIFEST_DIR")).join("../examples");
        for name in ["kuka_cell/kuka_cell", "two_robots/two_robots", "warehouse/vda5050"] {
            let file = examples.join(format!("{name}.sesame"));
            let text = std::fs::read_to_string(&file).unwrap();
            let checked = check(file.to_str().unwrap(), &text, PLAIN);
            assert_eq!((checked.diagnostics.as_str(), checked.warnings), ("", 0));
            assert!(checked.notes.is_empty(), "{:?}", checked.notes);
        }
    }

    #[test]
    fn imports_are_read_beside_the_file_that_imports_and_named_as_seen_from_the_space() {
        let folder = tempfile::tempdir().unwrap();
        let spaces = folder.path().join("spaces");
        std::fs::create_dir_all(&spaces).unwrap();
        let cell = "system {\n  simulator sim = in_process \"cell_sim::Cell\" { crate \"simulator\"  step 20ms }\n\
                    topic a = \"a\" : int }\nmetric hits maximise default 0 { hook on a }\n\
                    operation cut on a = blackhole\n";
        std::fs::write(folder.path().join("cell.sesame"), cell).unwrap();
        let demo = "space demo import \"../cell.sesame\" campaign c { objectives hits  operations cut 1 per test\n\
                    search random { evaluations 3 }  end after 3s }";
        let file = spaces.join("demo.sesame");
        let checked = check(file.to_str().unwrap(), demo, PLAIN);
        assert_eq!(checked.diagnostics, "");
        let runner = &checked.plans[0];
        assert_eq!((runner.hooks[0].source.as_str(), runner.hooks[0].line), ("../cell.sesame", 4));
        assert_eq!(runner.system_folder(), Path::new(".."), "the simulator's crate is beside the file that names it");
        assert_eq!(runner.plan.source, "demo.sesame");
        std::fs::create_dir(spaces.join("folder.sesame")).unwrap();
        let missing =
            check(file.to_str().unwrap(), "space demo import \"folder.sesame\" import \"gone.sesame\"", PLAIN);
        assert!(missing.diagnostics.contains("it is a folder, not a regular file"), "{}", missing.diagnostics);
        assert!(missing.diagnostics.contains("there is no such file"), "{}", missing.diagnostics);
    }

    #[test]
    fn what_no_runner_uses_is_said_with_its_place() {
        let text = include_str!("../../sesame-dsl/tests/good/blocks.sesame");
        let checked = check("spaces/blocks.sesame", text, PLAIN);
        assert_eq!(checked.diagnostics, "");
        assert_eq!(
            checked.notes,
            ["`relay budget` (blocks.sesame:7) has no effect: in lock-step time stands still while messages pass \
                 through the relay",]
        );
    }

    #[test]
    fn the_shapes_of_a_lab_are_in_its_plans_in_metres() {
        let text = include_str!("../../sesame-dsl/tests/good/blocks.sesame");
        let checked = check("blocks.sesame", text, PLAIN);
        let shapes = serde_json::to_string_pretty(&checked.plans[0].plan.labs[0].shapes).unwrap();
        insta::assert_snapshot!(shapes);
    }

    #[test]
    fn monitors_that_are_too_large_to_be_checked_are_named() {
        let evidence = (0..700).map(|at| format!("evidence e{at} = a > {at}\n")).collect::<Vec<_>>().concat();
        let guarantees = (0..300).map(|at| format!("guarantee g{at} integrity {} = e{at}\n", at + 1));
        let guarantees = guarantees.collect::<Vec<_>>().concat();
        let text = format!(
            "space a system {{ simulator s = in_process \"a::A\" {{ step 1s }} topic a = \"a\" : int topic b = \"b\" : int }}
             eddi large publishes b {{ {evidence} {guarantees} otherwise none }}"
        );
        let checked = check("a.sesame", &text, PLAIN);
        let said = "the guarantees of `large` are not checked: they and what they need are too many (a.sesame:2)";
        assert_eq!((checked.errors, checked.undecided), (0, vec![said.to_owned()]));
    }

    #[test]
    fn mistakes_are_counted_and_nothing_is_planned() {
        let checked = check("a.sesame", "space a\nmetric", PLAIN);
        assert!(checked.errors > 0 && checked.plans.is_empty());
        assert!(checked.diagnostics.contains("a.sesame"), "{}", checked.diagnostics);
    }
}
