//! A new project: a space with a simulator of its own, so that its first run works.

use std::collections::BTreeMap;
use std::path::Path;

use serde::Serialize;
use toml::Value;

use crate::emit::{Problem, Templates};
use crate::environment::{self, RuntimeChoice};
use crate::names;

/// The line that fills in the hook of a new project.
pub const HOOK_LINE: &str = "if clearance < 0.5 && ctx.every_seconds(0.2) { ctx.add(1.0); }";

/// The hook of a new project, inside its folder.
pub const HOOK_FILE: &str = "runners/hooks/close_calls.rs";

/// Why there is no project of a name.
#[derive(Debug, thiserror::Error)]
pub enum Error {
    /// The name cannot be that of a space.
    #[error("`{}` cannot be the name of a space: use lower-case letters, digits and `_`, a letter first", name.escape_debug())]
    Name {
        /// The name.
        name: String,
    },
    /// A template of the user's.
    #[error(transparent)]
    Template(#[from] Problem),
    /// The runtime was not found.
    #[error(transparent)]
    Runtime(#[from] environment::Error),
}

#[derive(Serialize)]
struct Project<'a> {
    name: &'a str,
    hook_line: &'a str,
}

/// What the simulator of a new project is written in.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Simulator {
    /// A crate that runners link.
    Rust,
    /// A program of its own: no Rust, so nothing is compiled.
    Python,
}

/// The files of a project, by path inside its folder. `runtime` says where a simulator in Rust takes the runtime from.
pub fn files(
    folder: &Path,
    simulator: Simulator,
    runtime: Option<&RuntimeChoice>,
    templates: &Templates,
) -> Result<BTreeMap<String, String>, Error> {
    let name = folder.file_name().and_then(|name| name.to_str()).unwrap_or_default();
    let plain = name.starts_with(|first: char| first.is_ascii_lowercase()) && names::snake(name) == name;
    if !plain || !names::check(name) {
        return Err(Error::Name { name: name.to_owned() });
    }
    let project = Project { name, hook_line: HOOK_LINE };
    let space = format!("{name}.sesame");
    Ok(match simulator {
        Simulator::Rust => {
            let runtime = environment::runtime_for(&folder.join("simulator"), runtime)?;
            [
                (space, templates.render("project/space.sesame.tera", &project)?),
                ("README.md".to_owned(), templates.render("project/readme.md.tera", &project)?),
                ("sesame.toml".to_owned(), templates.render("project/sesame.toml.tera", &project)?),
                (".gitignore".to_owned(), "target/\n".to_owned()),
                ("simulator/Cargo.toml".to_owned(), simulator_manifest(name, &runtime)),
                ("simulator/src/lib.rs".to_owned(), templates.render("project/simulator/lib.rs.tera", &project)?),
            ]
            .into()
        }
        Simulator::Python => [
            (space, templates.render("project/python/space.sesame.tera", &project)?),
            ("README.md".to_owned(), templates.render("project/python/readme.md.tera", &project)?),
            (".gitignore".to_owned(), "/runners/*/results/\n__pycache__/\n".to_owned()),
            ("sim.py".to_owned(), templates.render("project/python/sim.py.tera", &project)?),
        ]
        .into(),
    })
}

/// The simulator's `Cargo.toml`. The name is an identifier, and toml prints the value.
fn simulator_manifest(name: &str, runtime: &Value) -> String {
    format!(
        "[package]\n\
         name = \"{name}_sim\"\n\
         version = \"0.1.0\"\n\
         edition = \"2024\"\n\
         publish = false\n\
         \n\
         [dependencies]\n\
         sesame-runtime = {runtime}\n\
         \n\
         # A crate of its own, even if the project lies in a workspace.\n\
         [workspace]\n"
    )
}
