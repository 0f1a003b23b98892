//! Where secrets are. Only whoever connects reads them; the space says where they are, and never what they are.

use sesame_notation::quoted;
use sesame_plan::Secret;

/// Where a secret is, if it is anywhere.
pub(super) fn secret(variable: Option<&String>, file: Option<&String>) -> Option<Secret> {
    match (variable, file) {
        (Some(name), _) => Some(Secret::Environment { name: name.clone() }),
        (None, Some(path)) => Some(Secret::File { path: path.clone() }),
        (None, None) => None,
    }
}

/// The line of a simulator that says where a secret is.
pub(super) fn secret_line(word: &str, secret: &Secret) -> String {
    match secret {
        Secret::Environment { name } => format!("{word} from env {}", quoted(name)),
        Secret::File { path } => format!("{word} from file {}", quoted(path)),
    }
}
