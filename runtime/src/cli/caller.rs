//! How the user calls a runner's commands, so that what messages propose can be pasted.

use serde::{Deserialize, Serialize};
use sesame_base::shell::quoted;

/// The environment variable in which `sesamec` tells a compiled runner how it was called, as JSON.
pub const CALLER: &str = "SESAME_CALLER";

/// The words before and after the name of a command.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct Caller {
    /// The program, for example `sesamec`, or `cargo run --`.
    pub program: String,
    /// What follows the command's name: the `.sesame` file and its campaign; nothing for a runner itself.
    pub arguments: Vec<String>,
}

impl Caller {
    /// As the environment says; without that, as this process was called.
    pub(super) fn of_this_process() -> Self {
        if let Some(caller) = std::env::var(CALLER).ok().and_then(|text| serde_json::from_str(&text).ok()) {
            return caller;
        }
        let program = if std::env::var_os("CARGO_PKG_NAME").is_some() {
            "cargo run --".to_owned()
        } else {
            let program = std::env::args().next().unwrap_or_default();
            quoted(&program)
        };
        Caller { program, arguments: Vec::new() }
    }

    /// A command as it can be pasted into a shell.
    pub fn command(&self, name: &str, arguments: &[&str]) -> String {
        let arguments = self.arguments.iter().map(String::as_str).chain(arguments.iter().copied());
        arguments
            .fold(format!("{} {name}", self.program), |command, argument| format!("{command} {}", quoted(argument)))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_proposed_command_survives_the_shell() {
        let caller = Caller { program: "sesamec".to_owned(), arguments: vec!["my cell.sesame".to_owned()] };
        assert_eq!(caller.command("resume", &["results/42"]), "sesamec resume 'my cell.sesame' results/42");
        assert_eq!(caller.command("show", &["it's"]), "sesamec show 'my cell.sesame' 'it'\\''s'");
        assert_eq!(caller.command("show", &["", "$(x)"]), "sesamec show 'my cell.sesame' '' '$(x)'");
    }
}
