//! Results of earlier releases.

use std::path::Path;

use rusqlite::Connection;

use crate::{DATABASE, RecordError, Recorder, Repository};

const SCHEMA_7: &str = include_str!("../fixtures/results_of_schema_7.sql");

/// What its first releases did not record.
const ROBUSTNESS: &str = "DROP VIEW robustness; DROP VIEW robustness_points; DROP TABLE robustness_pieces";

/// Makes results as a runner of schema 7 recorded them, in this folder: with robustness over time, or without it, as
/// the first releases of that schema did.
pub fn of_schema_7(folder: &Path, robustness: bool) {
    let results = Connection::open(folder.join(DATABASE)).expect("a database can be made");
    results.execute_batch(SCHEMA_7).expect("what was recorded once can be recorded");
    if !robustness {
        results.execute_batch(ROBUSTNESS).expect("the results have these tables");
    }
}

/// Records everything in a repository once more, as this release does, into this folder.
pub fn recorded_again(folder: &Path, repository: &Repository) -> Result<Repository, RecordError> {
    let facts = repository.campaign();
    let mut recorder = Recorder::create(folder, &facts.plan, facts.seed, 2)?;
    for number in repository.numbers()? {
        recorder.commit(&repository.test(number)?)?;
    }
    for repetition in repository.repetitions()?.values().flatten() {
        recorder.put_repetition(repetition, &[])?;
    }
    for set in repository.result_sets()? {
        recorder.put_result_set(&set)?;
    }
    for coverage in repository.coverage()? {
        recorder.put_coverage(&coverage)?;
    }
    let reference = repository.reference_point()?.map(|point| {
        facts.plan.objectives().zip(point).map(|(objective, value)| objective.oriented(value)).collect::<Vec<_>>()
    });
    for indicators in repository.indicators()? {
        recorder.put_indicators(&indicators, reference.as_deref())?;
    }
    for event in repository.events()?.into_iter().filter(|event| event.test.is_none()) {
        recorder.put_event(&event)?;
    }
    recorder.finish(facts.stop.as_deref().unwrap_or_default())
}
