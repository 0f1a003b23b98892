//! The Sesame language, as the command uses it: text → diagnostics, and a plan for each campaign.

use sesame_dsl::diagnostic::{Diagnostic, Severity, page, render};
use sesame_dsl::model::Space;
use sesame_dsl::source::SourceMap;

use crate::cli::{Checked, Diagnosed, Language, Look};
use crate::lower::lower;

/// The language of this version.
pub const SESAME: Language = Language { check, format, explain: page };

/// What the plan names as its generator.
const GENERATOR: &str = concat!("sesamec ", env!("CARGO_PKG_VERSION"));

fn check(file: &str, text: &str, look: Look) -> Checked {
    let mut sources = SourceMap::new();
    let root = sources.add(file, text);
    let analysis = sesame_dsl::analyse(&sources, root);
    let Diagnosed { diagnostics, errors } = diagnosed(&analysis.diagnostics, &sources, look);
    // A plan names the file without its folder: the same space gives the same plan wherever it lies.
    let source = file.rsplit(['/', std::path::MAIN_SEPARATOR]).next().unwrap_or(file);
    let (summary, plans) = match &analysis.model {
        Some(space) => {
            let plans = space.campaigns.iter().map(|(campaign, _)| lower(space, campaign, source, GENERATOR)).collect();
            (summary(space), plans)
        }
        None => (String::new(), Vec::new()),
    };
    Checked { diagnostics, errors, summary, plans }
}

fn format(file: &str, text: &str, look: Look) -> Result<String, Diagnosed> {
    let mut sources = SourceMap::new();
    let root = sources.add(file, text);
    sesame_dsl::format::format(&sources, root).map_err(|errors| diagnosed(&errors, &sources, look))
}

fn diagnosed(diagnostics: &[Diagnostic], sources: &SourceMap, look: Look) -> Diagnosed {
    let text = match look {
        Look::Human { colour } => render::human(diagnostics, sources, colour),
        Look::Short => render::short(diagnostics, sources),
        Look::Json => render::json(diagnostics, sources),
        Look::Github => render::github(diagnostics, sources),
    };
    let errors = diagnostics.iter().filter(|found| found.severity() == Severity::Error).count();
    Diagnosed { diagnostics: text, errors }
}

/// What a space holds, for example `4 campaigns, 9 operations, 6 metrics, 2 requirements`.
fn summary(space: &Space) -> String {
    let counts = [
        (space.campaigns.iter().count(), "campaign"),
        (space.operations.iter().count(), "operation"),
        (space.metrics.iter().count(), "metric"),
        (space.requirements.iter().count(), "requirement"),
    ];
    let counted = counts.map(|(n, what)| if n == 1 { format!("1 {what}") } else { format!("{n} {what}s") });
    counted.join(", ")
}

#[cfg(test)]
mod tests {
    use super::*;

    const PLAIN: Look = Look::Human { colour: false };

    #[test]
    fn the_space_of_a_new_project_is_correct() {
        let runtime = crate::environment::RuntimeChoice::Version("1.0.0".into());
        let files =
            crate::project::files(std::path::Path::new("demo"), Some(&runtime), &crate::emit::Templates::default())
                .unwrap();
        let checked = check("some/demo.sesame", &files["demo.sesame"], PLAIN);
        assert_eq!((checked.errors, checked.diagnostics.as_str()), (0, ""));
        assert_eq!(checked.summary, "1 campaign, 2 operations, 2 metrics, 1 requirement");
        assert_eq!(checked.plans[0].plan.source, "demo.sesame");
        assert_eq!(checked.plans[0].hooks[0].metric, "close_calls");
    }

    #[test]
    fn mistakes_are_counted_and_nothing_is_planned() {
        let checked = check("a.sesame", "space a\nmetric", PLAIN);
        assert!(checked.errors > 0 && checked.plans.is_empty());
        assert!(checked.diagnostics.contains("a.sesame"), "{}", checked.diagnostics);
    }
}
