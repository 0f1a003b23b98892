//! Everything that reads results.

use std::path::Path;

use sesame_analysis as analysis;
use sesame_analysis::{Run, Selection, compare, coverage, front, indicators, regions, sspr, tests as tests_of};
use sesame_base::observation::Observation;
use sesame_base::visible::is_hidden;
use sesame_plan::Dimension;
use sesame_record::{Repository, differences};
use sesame_report as report;
use sesame_report::TextOptions;
use sesame_search as search;
use sesame_search::coverage::Grid;
use sesame_search::sspr::Convention;

/// How many readers answered, and how many refused.
pub(super) struct Read {
    /// Readers that gave an answer.
    pub(super) answered: u32,
    /// Readers that refused, or did not find what they were asked for.
    pub(super) refused: u32,
}

/// Everything that reads results, one after the other.
pub(super) fn read_all(folder: &Path) -> Read {
    let mut read = Read { answered: 0, refused: 0 };
    let mut said = |answer: Result<(), String>| match answer {
        Ok(()) => read.answered += 1,
        Err(words) => {
            read.refused += 1;
            assert!(!words.contains(|c| is_hidden(c) && c != '\n'), "hidden characters in {words:?}");
            assert!(!words.is_empty());
        }
    };
    let repository = match Repository::open(folder) {
        Ok(repository) => repository,
        Err(error) => {
            said(Err(error.to_string()));
            return read;
        }
    };
    let (plan, all) = (repository.plan(), Selection::default());
    let options = TextOptions { width: Some(100), colour: false };
    macro_rules! ask {
        ($question:expr, $then:expr) => {
            said(
                $question
                    .map(|answer| {
                        let _ = $then(answer);
                    })
                    .map_err(|error| error.to_string()),
            )
        };
    }
    let shown = |dataset: analysis::Table| (dataset.text(options), dataset.csv(), dataset.json());
    ask!(repository.digest(), |digest| digest);
    ask!(repository.sessions(), |sessions| sessions);
    ask!(repository.entered_runs(), |runs| runs);
    ask!(analysis::campaigns(std::slice::from_ref(&repository), analysis::Readers::Programs), shown);
    ask!(tests_of(&repository, &all), shown);
    ask!(front(&repository, &all), shown);
    ask!(sspr(&repository, &all, &Dimension::ALL, Convention::Ours), shown);
    ask!(indicators(&repository, None), |analysis: analysis::IndicatorAnalysis| shown(analysis.dataset()));
    let drawn = |found: Vec<regions::Regions>| {
        shown(regions::table(&found));
        for of in &found {
            drop(of.svg(plan));
        }
    };
    ask!(regions::regions(&repository, &all, None, 3), drawn);
    ask!(regions::regions_by_cause(&repository, &all, None, 3), drawn);
    if let Some(goal) = &plan.campaign.coverage {
        match Grid::new(goal.axes.clone()) {
            Ok(grid) => ask!(
                coverage(&repository, &all, grid, goal.hits, Convention::Paper),
                |analysis: analysis::CoverageAnalysis| (shown(analysis.curve()), shown(analysis.cells()))
            ),
            Err(error) => said(Err(error.to_string())),
        }
    }
    ask!(report::summary(&repository), |summary| (report::summary_text(&summary, options), report::junit(&summary)));
    ask!(report::page(&repository), |page| page);
    ask!(report::list(&repository), |list| report::list_text(&list, options));
    for name in ["reference", "T1", "T17", "T20", "T44"] {
        ask!(report::show(&repository, name), |test| report::test_text(&test, options));
        ask!(report::export(&repository, name, None, report::Expected::Values), |exported| exported);
        ask!(repository.find(name).and_then(|number| repository.test(number)), |record: sesame_record::TestRecord| {
            let nothing = Observation { metrics: Vec::new(), operations: Vec::new(), ..record.observation.clone() };
            differences(plan, &record.test, &record.observation, &nothing)
        });
    }
    ask!(crate::cli::asked_beside_reports(&repository, "T17"), |answer| answer);
    let runs = [0, 1].map(|_| Repository::open(folder));
    if let [Ok(one), Ok(other)] = runs {
        let runs = [("a", one), ("b", other)].map(|(group, repository)| Run { group: group.to_owned(), repository });
        ask!(compare(&runs, None, None), |comparison: analysis::Comparison| (
            shown(comparison.runs()),
            shown(comparison.groups()),
            shown(comparison.pairs())
        ));
    }
    // What a run that goes on asks first; tests without number would take their time.
    if plan.campaign.search.evaluations() < 10_000 && plan.campaign.neighbours.unwrap_or(0) < 10_000 {
        ask!(search::strategy(plan, 1), |strategy: Box<dyn search::Strategy>| drop(strategy));
    }
    read
}
