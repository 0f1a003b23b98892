//! A made-up campaign and a made-up lab for tests: the lab repeats tests of the campaign, and differs as it is told to.

use std::collections::BTreeMap;
use std::path::Path;

use sesame_base::observation::Observation;
use sesame_plan::testing::lab;
use sesame_plan::{Dimension, Lab, LabTolerance, MetricId};
use sesame_record::{MetricValue, Origin, Recorder, Repetition, Repository, ScannedTest, sample};
use sesame_rng::Stream;
use sesame_search::sspr::Convention;

use crate::gap::LabRun;

/// The metric that counts collisions.
pub const COLLISIONS: MetricId = MetricId(0);

/// The metric that measures how long a test disturbed.
pub const FUZZING_TIME: MetricId = MetricId(1);

/// What a lab makes of a value of the simulation, given the T1 of its test.
pub type Made = fn(f64, f64) -> f64;

/// A campaign of which 24 tests were run again five times, and as many runs of them in a lab. Collisions are
/// about 5, fuzzing times as in the sample of a campaign. The results of the campaign go into the folder.
pub fn study(folder: &Path, collisions: Made, fuzzing_time: Made) -> (Vec<LabRun>, Repository) {
    let plan = sample::plan();
    drop(sample::campaign(folder, &plan, 60));
    let mut recorder = Recorder::reopen(folder, 1).expect("the results were just made");
    let mut places = BTreeMap::new();
    let mut keep = |test: ScannedTest| {
        let is_own = test.origin != Origin::Reference && test.duplicate_of.is_none();
        let complete = test.values.iter().all(|value| value.value.is_some());
        if let Some(point) = test.point(&plan, Convention::Ours).filter(|_| is_own && complete) {
            places.insert(test.number, point.get(Dimension::T1).expect("every point has a T1"));
        }
    };
    recorder.repository().scan(&mut keep).expect("the results can be read");
    let mut stream = Stream::derive(1, "lab", &[]);
    let mut noisy = |observed: &Observation| {
        let mut observed = observed.clone();
        observed.metrics[COLLISIONS.index()].value = Some(5.0 + 0.2 * stream.normal());
        let time = observed.metrics[FUZZING_TIME.index()].value.expect("the test was kept since it has all values");
        observed.metrics[FUZZING_TIME.index()].value = Some(time + 0.1 * stream.normal());
        observed
    };
    let mut runs = Vec::new();
    for (test, t1) in places.into_iter().take(24) {
        let record = recorder.repository().test(test).expect("the test was recorded");
        for position in 1..=5 {
            let simulated = noisy(&record.observation);
            recorder
                .put_repetition(&Repetition::of(test, position, 1, &simulated), &[])
                .expect("the results can be written");
            let mut measured = noisy(&record.observation);
            for (metric, made) in [(COLLISIONS, collisions), (FUZZING_TIME, fuzzing_time)] {
                let value = &mut measured.metrics[metric.index()].value;
                *value = value.map(|value| made(value, t1));
            }
            let mut row = recorder.repository().row(test).expect("the test was recorded");
            row.values = measured.metrics.iter().map(MetricValue::from).collect();
            runs.push(LabRun { of: test, row });
        }
    }
    (runs, recorder.finish("done").expect("the results can be written"))
}

/// A lab that takes a difference of 1 in either metric for none.
pub fn tolerant() -> Lab {
    let tolerance = |metric, value| LabTolerance { metric, value };
    Lab { tolerances: vec![tolerance(COLLISIONS, 1.0), tolerance(FUZZING_TIME, 1.0)], ..lab("lab") }
}
