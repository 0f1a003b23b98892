//! `Cargo.toml` of a runner.

use std::collections::BTreeMap;
use std::fmt::Write as _;

use toml::{Table, Value};

/// What a campaign hardly uses and the compiler would optimise for long, with the level it gets instead of 3.
///
/// SQLite's is that of the workspace, which builds it for `sesamec` in the same way: runners in a checkout share that.
const LESS_OPTIMISED: [(&str, u8); 12] = [
    ("clap_builder", 0),
    ("console", 0),
    ("indicatif", 0),
    ("libsqlite3-sys", 1),
    ("sesame-analysis", 1),
    ("sesame-lifecycle", 1),
    ("sesame-notation", 1),
    ("sesame-plan", 1),
    ("sesame-present", 1),
    ("sesame-record", 1),
    ("sesame-report", 1),
    ("sesame-runtime", 1),
];

/// The same of a monitor, which links less.
const LESS_OPTIMISED_IN_MONITORS: [(&str, u8); 4] =
    [("clap_builder", 0), ("sesame-lifecycle", 1), ("sesame-plan", 1), ("sesame-runtime", 1)];

/// What a crate is.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Kind {
    /// The runner of a campaign.
    Runner,
    /// A monitor as a program of its own.
    Monitor,
}

/// The dependencies, with these features of the runtime.
pub(super) fn with_features(dependencies: &BTreeMap<String, Value>, features: &[&str]) -> BTreeMap<String, Value> {
    let mut dependencies = dependencies.clone();
    if let Some(runtime) = dependencies.get_mut("sesame-runtime") {
        let mut table = match &*runtime {
            Value::Table(table) => table.clone(),
            version => Table::from_iter([("version".to_owned(), version.clone())]),
        };
        // What the user asks for in [runtime] comes first.
        let wanted = table.entry("features").or_insert_with(|| Value::Array(Vec::new()));
        if let Some(wanted) = wanted.as_array_mut() {
            for &feature in features {
                if !wanted.iter().any(|known| known.as_str() == Some(feature)) {
                    wanted.push(feature.into());
                }
            }
        }
        *runtime = Value::Table(table);
    }
    dependencies
}

/// The manifest. Names of packages and dependencies are checked by those who made them; values are printed by toml.
pub(super) fn cargo_toml(
    kind: Kind,
    note: &str,
    package: &str,
    dependencies: &BTreeMap<String, Value>,
    vendored: bool,
) -> String {
    let (hooks, less_optimised) = match kind {
        Kind::Runner => (
            "# What hooks need goes into [dependencies] of the sesame.toml beside the .sesame file.\n",
            &LESS_OPTIMISED[..],
        ),
        Kind::Monitor => ("", &LESS_OPTIMISED_IN_MONITORS[..]),
    };
    let mut text = format!(
        "# {note}\n\
         {hooks}\
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
        writeln!(text, "{name} = {value}").expect("text grows as needed");
    }
    text.push_str(
        "\n\
         # It is a workspace of its own, in any folder.\n\
         [workspace]\n",
    );
    if vendored {
        text.push_str("exclude = [\"vendor\"]\n");
    }
    text.push_str(match kind {
        Kind::Runner => {
            "\n# Simulator and runtime run at full speed. Hooks and generated code are built quickly, since they change; build\n\
             # scripts and macros are not optimised at all (a profile for package.\"*\" would do that too, and take twice as long).\n"
        }
        Kind::Monitor => "\n# The runtime runs at full speed.\n",
    });
    text.push_str(
        "[profile.dev]\n\
         opt-level = 3\n\
         debug = false\n\
         \n",
    );
    let own = format!("[profile.dev.package.{package}]\nopt-level = 1\ndebug = \"line-tables-only\"\n\n");
    text.push_str(&own);
    text.push_str("# What has little to do in a campaign, and would take long to optimise.\n");
    for (name, level) in less_optimised {
        writeln!(text, "[profile.dev.package.{name}]\nopt-level = {level}").expect("text grows as needed");
    }
    text
}

/// Whether a dependency's name is one that cargo knows of, and so a bare key of TOML.
pub(crate) fn is_dependency(name: &str) -> bool {
    !name.is_empty() && name.bytes().all(|byte| byte.is_ascii_alphanumeric() || byte == b'-' || byte == b'_')
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn features_are_added_to_every_kind_of_dependency_on_the_runtime() {
        let with = |runtime: Value| {
            let dependencies = BTreeMap::from([("sesame-runtime".to_owned(), runtime)]);
            with_features(&dependencies, &["a", "b"])["sesame-runtime"].to_string()
        };
        assert_eq!(with("=1".into()), "{ features = [\"a\", \"b\"], version = \"=1\" }");
        let table: Value = toml::from_str("path = \"p\"\nfeatures = [\"b\", \"c\"]").unwrap();
        assert_eq!(with(table), "{ features = [\"b\", \"c\", \"a\"], path = \"p\" }");
    }

    #[test]
    fn hostile_dependencies_stay_data() {
        assert!(!is_dependency("x\"]\n[evil"));
        let value: Value = toml::from_str("version = \"1\"\nfeatures = [\"a\\\"\\n[evil]\"]").unwrap();
        let text = cargo_toml(
            Kind::Runner,
            "note",
            "space-campaign",
            &BTreeMap::from([("x".to_owned(), value.clone())]),
            false,
        );
        let parsed: toml::Table = toml::from_str(&text).unwrap();
        assert_eq!(parsed["dependencies"]["x"], value);
        assert_eq!(parsed.keys().collect::<Vec<_>>(), ["dependencies", "package", "profile", "workspace"]);
    }
}
