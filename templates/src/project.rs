//! Texts of a new project, as `sesamec new` makes it.

/// The space.
pub const SPACE: &str = include_str!("../project/space.sesame.tera");
/// The simulator's code.
pub const SIMULATOR: &str = include_str!("../project/simulator/lib.rs.tera");
/// The README.
pub const README: &str = include_str!("../project/readme.md.tera");
/// The settings.
pub const SETTINGS: &str = include_str!("../project/sesame.toml.tera");

/// The space of a project in Python.
pub const PYTHON_SPACE: &str = include_str!("../project/python/space.sesame.tera");
/// The simulator in Python.
pub const PYTHON_SIMULATOR: &str = include_str!("../project/python/sim.py.tera");
/// The README of a project in Python.
pub const PYTHON_README: &str = include_str!("../project/python/readme.md.tera");
