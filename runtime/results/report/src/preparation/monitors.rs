//! Verification of monitors [SESAME 2023, §3.3.4]: what they decide on recordings of the same tests in simulation and
//! in a lab.

use serde::Serialize;

use crate::facts::monitors::MonitorsCompared;

/// What monitors decide in simulation and in a lab.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct MonitorTesting {
    /// The lab.
    pub lab: String,
    /// Per test that was recorded on both sides.
    pub tests: Vec<MonitorTest>,
    /// Each deviation from what is required, as a sentence.
    pub objections: Vec<String>,
}

/// A test recorded on both sides.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct MonitorTest {
    /// The test.
    pub test: String,
    /// What monitors decide: the first recording is that of the simulation, the second that of the lab.
    pub compared: MonitorsCompared,
}

/// Judges what monitors decide in these tests.
pub fn monitors(lab: &str, tests: Vec<MonitorTest>) -> MonitorTesting {
    let in_test = |of_test: &MonitorTest| {
        let test = of_test.test.clone();
        of_test.compared.objections().into_iter().map(move |objection| format!("in `{test}` {objection}"))
    };
    let objections = tests.iter().flat_map(in_test).collect();
    MonitorTesting { lab: lab.to_owned(), tests, objections }
}
