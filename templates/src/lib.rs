//! The texts of this project that people read and edit: stubs, READMEs, new projects and the report's shell.
//!
//! Templates contain loops and simple conditions only: names, types and sentences are computed by the code that fills
//! them in.

pub mod project;
pub mod report;
pub mod runner;

/// The templates that the generator fills in, by the names under which they can be replaced.
pub const ALL: &[(&str, &str)] = &[
    ("project/readme.md.tera", project::README),
    ("project/sesame.toml.tera", project::SETTINGS),
    ("project/python/readme.md.tera", project::PYTHON_README),
    ("project/python/sim.py.tera", project::PYTHON_SIMULATOR),
    ("project/python/space.sesame.tera", project::PYTHON_SPACE),
    ("project/simulator/lib.rs.tera", project::SIMULATOR),
    ("project/space.sesame.tera", project::SPACE),
    ("runner/hook.rs.tera", runner::HOOK),
    ("runner/hooks.py.tera", runner::PYTHON_HOOKS),
    ("runner/monitor_readme.md.tera", runner::MONITOR_README),
    ("runner/operation_hook.rs.tera", runner::OPERATION_HOOK),
    ("runner/runner_readme.md.tera", runner::RUNNER_README),
    ("runner/shared_readme.md.tera", runner::SHARED_README),
];
