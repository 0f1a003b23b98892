//! Exceptions of the user's Python code, as the outcome of a test and as a note of its run.

use pyo3::prelude::*;

/// What was raised and where, in a sentence that is the same wherever the files are; and the traceback.
pub(crate) fn told(error: &PyErr) -> (String, String) {
    Python::attach(|py| {
        let told = || {
            let world = py.import("sesamec._world")?;
            world.getattr("told")?.call1((error.value(py), error.traceback(py)))?.extract()
        };
        told().unwrap_or_else(|_: PyErr| (error.to_string(), error.to_string()))
    })
}
