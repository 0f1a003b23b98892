//! Runs that the environment broke off.

use std::path::Path;

use sesame_base::observation::{Observation, Outcome};

use super::{plan, records};
use crate::{Recorder, Repetition, Repository};

/// How such a run ends, one outcome of each kind.
pub fn outcomes_of_environment() -> [Outcome; 3] {
    let message = || "the bridge is away".to_owned();
    [
        Outcome::LaunchFailed { message: message() },
        Outcome::Disconnect { message: message() },
        Outcome::WrongClock { message: message() },
    ]
}

/// Records a campaign whose last three tests ended so, the last of them with the first of these outcomes, and was run
/// again with the second.
pub fn broken_off(folder: &Path) -> Repository {
    let plan = plan();
    let mut records = records(&plan, 20);
    for (record, outcome) in records.iter_mut().rev().zip(outcomes_of_environment()) {
        record.observation = Observation::without_run(outcome);
        record.duplicate_of = None;
    }
    let mut recorder =
        Recorder::create(folder, &plan, plan.campaign.seed, 2).expect("what is made up here can be recorded");
    for record in &records {
        recorder.commit(record).expect("what is made up here can be recorded");
    }
    let number = records.last().expect("there are tests").number;
    let [_, again, _] = outcomes_of_environment();
    let again = Repetition::of(number, 1, 7, &Observation::without_run(again));
    recorder.put_repetition(&again, &[]).expect("what is made up here can be recorded");
    recorder.finish("all evaluations done").expect("what is made up here can be recorded")
}
