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
mod optimise;
mod raised;
mod simulator;
mod types;
mod value;

use std::ffi::OsString;

use pyo3::exceptions::PyRuntimeError;
use pyo3::prelude::*;
use pyo3::types::PyDict;
use sesame_plan::{CampaignPlan, python};

/// The functions that the package calls.
#[pymodule]
mod _native {
    use super::{
        Bound, OsString, Py, PyAny, PyDict, PyResult, Python, hooks, plan_of, plan_text, pyfunction, simulator,
    };

    #[pymodule_export]
    use super::simulator::Bus;

    #[pymodule_export]
    use super::hooks::{MetricContext, OperationContext, RunContext};

    #[pymodule_export]
    use super::optimise::{Evolution, Falsification};

    /// The version of the package, which is that of the program.
    #[pymodule_export]
    #[expect(non_upper_case_globals, reason = "Python's name for it")]
    const __version__: &str = env!("CARGO_PKG_VERSION");

    /// Serves the supervisor that started this process as a worker, and returns the exit code: with a class in place
    /// of the simulator's program, and with the registered hooks. `arguments` are those that the supervisor gave.
    #[pyfunction]
    fn worker(py: Python<'_>, arguments: Vec<OsString>, simulator: Option<Py<PyAny>>) -> PyResult<u8> {
        let (metrics, operations) = hooks::register(py, plan_of(&arguments)?)?;
        let connect = simulator.map(|class| simulator::connect(py, class)).transpose()?;
        // The user's threads go on while this one waits for tests.
        Ok(py.detach(|| sesame_runtime::cli::worker(metrics, operations, connect, &arguments)))
    }

    /// What a plan needs of hooks and says of their types: `space`, the name of its file; `name`, its own; `metrics`,
    /// the methods of each hook that it calls; `operations`, the method of each; `messages` and `parameters`, the
    /// attributes of each.
    #[pyfunction]
    fn needs<'py>(py: Python<'py>, plan: &str) -> PyResult<Bound<'py, PyDict>> {
        super::needs(py, &plan_text(plan)?)
    }
}

fn needs<'py>(py: Python<'py>, plan: &CampaignPlan) -> PyResult<Bound<'py, PyDict>> {
    let (metrics, operations) = (PyDict::new(py), PyDict::new(py));
    for metric in &plan.metrics {
        if let Some(topics) = hooks::inputs(plan, &metric.source) {
            metrics.set_item(&metric.name, hooks::methods(&topics))?;
        }
    }
    let (messages, parameters) = (PyDict::new(py), PyDict::new(py));
    for operation in &plan.operations {
        if let Some(method) = hooks::method_of(plan, operation) {
            operations.set_item(&operation.name, method)?;
            let names = operation.parameters.iter().map(|parameter| python::attribute(&parameter.name));
            parameters.set_item(&operation.name, names.collect::<Vec<_>>())?;
        }
    }
    for message in &plan.messages {
        let names = message.fields.iter().map(|field| python::attribute(&field.name));
        messages.set_item(&message.name, names.collect::<Vec<_>>())?;
    }
    let needs = PyDict::new(py);
    needs.set_item("space", &plan.source)?;
    needs.set_item("name", &plan.space)?;
    for (name, part) in
        [("metrics", metrics), ("operations", operations), ("messages", messages), ("parameters", parameters)]
    {
        needs.set_item(name, part)?;
    }
    Ok(needs)
}

/// The plan that a worker gets with these arguments.
fn plan_of(arguments: &[OsString]) -> PyResult<CampaignPlan> {
    let file = arguments.iter().skip_while(|argument| *argument != "--runner").nth(1);
    let file = file.ok_or_else(|| PyRuntimeError::new_err("a worker needs the file with its plan"))?;
    let sent = sesame_runtime::Interpreted::read(std::path::Path::new(file));
    plan_text(&sent.map_err(|error| PyRuntimeError::new_err(format!("cannot read {}: {error}", file.display())))?.plan)
}

fn plan_text(text: &str) -> PyResult<CampaignPlan> {
    serde_json::from_str(text).map_err(|error| PyRuntimeError::new_err(format!("cannot read the plan: {error}")))
}
