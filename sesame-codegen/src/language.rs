//! The Sesame language, as the command uses it: text → diagnostics, and a plan for each campaign.

use sesame_dsl::diagnostic::{Severity, page, render};
use sesame_dsl::model::Space;
use sesame_dsl::source::SourceMap;

use crate::cli::{Checked, Language};
use crate::lower::lower;

/// The language of this version.
pub const SESAME: Language = Language { check, explain: page };

/// What the plan names as its generator.
const GENERATOR: &str = concat!("sesamec ", env!("CARGO_PKG_VERSION"));

fn check(file: &str, text: &str, colour: bool) -> Checked {
    let mut sources = SourceMap::new();
    let root = sources.add(file, text);
    let analysis = sesame_dsl::analyse(&sources, root);
    let errors = analysis.diagnostics.iter().filter(|found| found.severity() == Severity::Error).count();
    let diagnostics = render::human(&analysis.diagnostics, &sources, colour);
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

    #[test]
    fn the_space_of_a_new_project_is_correct() {
        let runtime = crate::environment::RuntimeChoice::Version("1.0.0".into());
        let files = crate::project::files(std::path::Path::new("demo"), Some(&runtime)).unwrap();
        let checked = check("some/demo.sesame", &files["demo.sesame"], false);
        assert_eq!((checked.errors, checked.diagnostics.as_str()), (0, ""));
        assert_eq!(checked.summary, "1 campaign, 2 operations, 2 metrics, 1 requirement");
        assert_eq!(checked.plans[0].plan.source, "demo.sesame");
        assert_eq!(checked.plans[0].hooks[0].metric, "close_calls");
    }

    #[test]
    fn mistakes_are_counted_and_nothing_is_planned() {
        let checked = check("a.sesame", "space a\nmetric", false);
        assert!(checked.errors > 0 && checked.plans.is_empty());
        assert!(checked.diagnostics.contains("a.sesame"), "{}", checked.diagnostics);
    }
}
