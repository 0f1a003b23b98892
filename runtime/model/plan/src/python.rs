//! What a campaign's hooks in Python are to whoever starts or writes them.

use std::borrow::Cow;

use serde::{Deserialize, Serialize};

/// The hooks of a space that may be in Python, as a worker has to know of them.
#[derive(Debug, Clone, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct PythonHooks {
    /// The file that registers them, in the folder of the space; `None` if only the process that forks workers does.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub file: Option<String>,
    /// All metrics of the space that are hooks, measured by the campaign or not.
    pub metrics: Vec<String>,
    /// All custom operations of the space, used by the campaign or not.
    pub operations: Vec<String>,
    /// Which of them are filled in in Rust, each with its file as people know it.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub in_rust: Vec<(String, String)>,
}

/// Names that a field or parameter cannot have in Python: keywords, and what annotations of generated classes speak of.
const TAKEN: [&str; 42] = [
    "False", "None", "True", "and", "as", "assert", "async", "await", "bool", "break", "class", "continue", "def",
    "del", "elif", "else", "except", "finally", "float", "for", "from", "global", "if", "import", "in", "int", "is",
    "lambda", "list", "nonlocal", "not", "or", "pass", "raise", "return", "self", "sesamec", "str", "try", "while",
    "with", "yield",
];

/// The name in Python of a field, a parameter or a message: its own, with `_` behind it if Python cannot have it. Two
/// names never become one.
pub fn attribute(name: &str) -> Cow<'_, str> {
    // Inside of a class, a name that begins with two underscores is another, unless it ends with two as well.
    if name.starts_with("__") {
        return Cow::Owned(format!("{name}__"));
    }
    if is_taken(name.trim_end_matches('_')) { Cow::Owned(format!("{name}_")) } else { Cow::Borrowed(name) }
}

/// The name that comes to this one in Python.
pub fn named(attribute: &str) -> &str {
    if let Some(name) = attribute.strip_suffix("__").filter(|name| name.starts_with("__")) {
        return name;
    }
    match attribute.strip_suffix('_') {
        Some(name) if is_taken(name.trim_end_matches('_')) => name,
        _ => attribute,
    }
}

fn is_taken(name: &str) -> bool {
    TAKEN.binary_search(&name).is_ok()
}

/// The method of a hook that gets the messages of a topic.
pub fn method(topic: &str) -> String {
    match topic {
        // These are called at the start and the end of a run.
        "start" | "end" => format!("on_{topic}_message"),
        _ => format!("on_{topic}"),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_python_cannot_have_gets_an_underscore_and_no_two_names_meet() {
        let names = ["class", "class_", "class__", "speed", "speed_", "self", "None", "__x", "__x__", "_x", "match"];
        let made: Vec<_> = names.iter().map(|name| attribute(name)).collect();
        let expected =
            ["class_", "class__", "class___", "speed", "speed_", "self_", "None_", "__x__", "__x____", "_x", "match"];
        assert_eq!(made, expected);
        assert!(made.iter().zip(names).all(|(made, name)| named(made) == name));
        assert!(TAKEN.is_sorted());
    }
}
