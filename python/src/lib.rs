//! The native part of the Python module `sesamec`: a process of Python as a worker of a campaign, whose simulator and
//! hooks are Python.
//!
//! The supervisor is the program `sesamec`, as for every other campaign: it starts workers, records results and ends
//! what hangs. So nothing here knows of searches or of results, and a crash of the user's code takes its worker with it
//! and nothing else.

#![expect(
    clippy::unused_self,
    clippy::needless_pass_by_value,
    reason = "what Python calls is a method of its object, and takes what Python hands over"
)]

mod hooks;
mod raised;
mod simulator;
mod value;

use std::ffi::OsString;

use pyo3::exceptions::PyRuntimeError;
use pyo3::prelude::*;
use pyo3::types::PyDict;
use sesame_plan::CampaignPlan;

/// The functions that the package calls.
#[pymodule]
mod _native {
    use super::{Bound, OsString, Py, PyAny, PyDict, PyResult, Python, hooks, plan_of, pyfunction, simulator};

    #[pymodule_export]
    use super::simulator::Bus;

    #[pymodule_export]
    use super::hooks::{MetricContext, OperationCall, RunCall};

    /// Serves the supervisor that started this process as a worker, and returns the exit code: with a class in place
    /// of the simulator's program, and classes of hooks by the names of their metrics and operations. `arguments` are
    /// those that the supervisor gave.
    #[pyfunction]
    fn worker(
        py: Python<'_>,
        arguments: Vec<OsString>,
        simulator: Option<Py<PyAny>>,
        metrics: Bound<'_, PyDict>,
        operations: Bound<'_, PyDict>,
    ) -> PyResult<u8> {
        let plan = plan_of(&arguments)?;
        let (metrics, operations) = hooks::register(py, plan, metrics, operations)?;
        let connect = simulator.map(|class| simulator::connect(py, class)).transpose()?;
        // The user's threads go on while this one waits for tests.
        Ok(py.detach(|| sesame_runtime::cli::worker(metrics, operations, connect, &arguments)))
    }
}

/// The plan that a worker gets with these arguments.
fn plan_of(arguments: &[OsString]) -> PyResult<CampaignPlan> {
    let file = arguments.iter().skip_while(|argument| *argument != "--runner").nth(1);
    let file = file.ok_or_else(|| PyRuntimeError::new_err("a worker needs the file with its plan"))?;
    let read = sesame_runtime::Interpreted::read(std::path::Path::new(file));
    let plan = read.and_then(|sent| Ok(serde_json::from_str(&sent.plan)?));
    plan.map_err(|error| PyRuntimeError::new_err(format!("cannot read {}: {error}", file.display())))
}
