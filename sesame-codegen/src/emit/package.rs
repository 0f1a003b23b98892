//! `Cargo.toml` of a runner.

use std::collections::BTreeMap;
use std::fmt::Write as _;

use toml::Value;

/// The manifest. Names of packages and dependencies are checked by those who made them; values are printed by toml.
pub(super) fn cargo_toml(note: &str, package: &str, dependencies: &BTreeMap<String, Value>) -> String {
    let mut text = format!(
        "# {note}\n\
         # What hooks need goes into [dependencies] of the sesame.toml beside the .sesame file.\n\
         \n\
         [package]\n\
         name = {}\n\
         version = \"0.0.0\"\n\
         edition = \"2024\"\n\
         publish = false\n\
         \n\
         [dependencies]\n",
        Value::from(package)
    );
    for (name, value) in dependencies {
        writeln!(text, "{} = {value}", key(name)).expect("text grows as needed");
    }
    text.push_str(
        "\n\
         # The runner is a workspace of its own, whatever folder it lies in.\n\
         [workspace]\n\
         \n\
         # What rarely changes runs at full speed; hooks and generated code are built quickly.\n\
         [profile.dev]\n\
         opt-level = 1\n\
         debug = \"line-tables-only\"\n\
         \n\
         [profile.dev.package.\"*\"]\n\
         opt-level = 3\n\
         debug = false\n",
    );
    text
}

/// A key: bare where TOML permits it, quoted otherwise.
fn key(name: &str) -> String {
    let bare = !name.is_empty() && name.bytes().all(|b| b.is_ascii_alphanumeric() || b == b'-' || b == b'_');
    if bare { name.to_owned() } else { Value::from(name).to_string() }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn hostile_dependencies_stay_data() {
        let name = "x\"]\n[evil";
        let value: Value = toml::from_str("version = \"1\"\nfeatures = [\"a\\\"\\n[evil]\"]").unwrap();
        let text = cargo_toml("note", "space-campaign", &BTreeMap::from([(name.to_owned(), value.clone())]));
        let parsed: toml::Table = toml::from_str(&text).unwrap();
        assert_eq!(parsed["dependencies"][name], value);
        assert_eq!(parsed.keys().collect::<Vec<_>>(), ["dependencies", "package", "profile", "workspace"]);
    }
}
