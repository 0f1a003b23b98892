//! Texts of generated runners.

/// The user's first version of a metric hook.
pub const HOOK: &str = include_str!("../runner/hook.rs.tera");
/// The user's first version of all hooks of a space, in Python.
pub const PYTHON_HOOKS: &str = include_str!("../runner/hooks.py.tera");
/// The user's first version of an operation hook.
pub const OPERATION_HOOK: &str = include_str!("../runner/operation_hook.rs.tera");
/// The README of the folder that holds the runners of a space.
pub const SHARED_README: &str = include_str!("../runner/shared_readme.md.tera");
/// The README of a runner.
pub const RUNNER_README: &str = include_str!("../runner/runner_readme.md.tera");
/// The README of a monitor that is a program of its own.
pub const MONITOR_README: &str = include_str!("../runner/monitor_readme.md.tera");
