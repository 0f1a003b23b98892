//! What manifests say to registries, which has to agree.

use std::collections::BTreeSet;

use serde_json::Value;
use sesame_tests::{command, done, workspace};
use toml::Table;

use crate::steps::{Action, read};

fn table(file: &str) -> Table {
    read(&workspace().join(file)).parse().unwrap_or_else(|error| panic!("{file}: {error}"))
}

/// The version of all crates.
fn version() -> String {
    table("Cargo.toml")["workspace"]["package"]["version"].as_str().expect("it is text").to_owned()
}

/// Every crate of the workspace, as cargo sees it.
fn packages() -> Vec<Value> {
    let mut metadata = command(env!("CARGO"));
    metadata.args(["metadata", "--format-version", "1", "--no-deps", "--locked"]).current_dir(workspace());
    done(&mut metadata).expect(0).json()["packages"].as_array().expect("there are packages").clone()
}

#[test]
fn one_version_stands_everywhere() {
    let version = version();
    let root = table("Cargo.toml");
    for (name, dependency) in root["workspace"]["dependencies"].as_table().expect("it is a table") {
        if let Some(said) = dependency.get("path").and(dependency.get("version")) {
            assert_eq!(said.as_str(), Some(version.as_str()), "{name}");
        }
    }
    for package in packages().iter().filter(|package| !package["publish"].is_array()) {
        assert_eq!(package["version"], version.as_str(), "{}", package["name"]);
    }
    let wheel = table("python/pyproject.toml");
    assert_eq!(wheel["project"].get("version"), None, "the wheel has the version of its crate");
    assert_eq!(table("python/Cargo.toml")["package"]["version"]["workspace"].as_bool(), Some(true));
    assert_eq!(Action::read(&read(&workspace().join("action.yml"))).defaults["version"], version);
    let gitlab = read(&workspace().join("examples/ci/gitlab-ci.yml"));
    assert!(gitlab.contains(&format!("SESAMEC: \"sesamec=={version}\"")), "{gitlab}");
}

#[test]
fn another_version_is_written_everywhere_by_one_command() {
    let folder = sesame_tests::fresh_folder("set-version");
    let files = ["Cargo.toml", "action.yml", "examples/ci/gitlab-ci.yml"];
    for file in files.into_iter().chain(["release"]) {
        std::fs::create_dir_all(folder.join(file).parent().expect("it is in a folder")).unwrap();
        std::fs::copy(workspace().join(file), folder.join(file)).unwrap();
    }
    // Cargo would look for the crates, which are not here.
    std::fs::create_dir(folder.join("bin")).unwrap();
    std::os::unix::fs::symlink("/bin/true", folder.join("bin/cargo")).unwrap();
    let path = std::env::join_paths([folder.join("bin"), "/usr/bin".into(), "/bin".into()]).unwrap();
    let set = |version: &str| done(command(folder.join("release")).args(["--set-version", version]).env("PATH", &path));
    set("2.3.4").expect(0);
    let old = format!("\"{}\"", version());
    for file in files {
        let (before, after) = (read(&workspace().join(file)), read(&folder.join(file)));
        let ours: Vec<&str> = after.lines().filter(|line| line.contains("2.3.4")).collect();
        let changed = before.lines().zip(after.lines()).filter(|(before, after)| before != after).count();
        assert!(changed > 0 && changed == ours.len(), "{file}: {ours:?}");
        let left = after.lines().filter(|line| line.contains(&old) && line.contains("sesame")).count();
        assert_eq!(left, 0, "{file}");
    }
    assert!(set("next").expect(1).err.contains("`next` is not a version"));
}

#[test]
fn whatever_a_published_crate_needs_is_published_with_its_licences() {
    let packages = packages();
    let name = |package: &Value| package["name"].as_str().expect("a package has a name").to_owned();
    let published: Vec<&Value> = packages.iter().filter(|package| !package["publish"].is_array()).collect();
    let names: BTreeSet<String> = published.iter().map(|package| name(package)).collect();
    assert!(names.contains("sesamec") && names.contains("sesame-runtime"), "{names:?}");
    assert!(names.len() < packages.len(), "tests and examples are not published");
    for package in published {
        let of_it = name(package);
        for dependency in package["dependencies"].as_array().expect("there is a list") {
            let needed = dependency["kind"] != "dev" && !dependency["path"].is_null();
            assert!(!needed || names.contains(&name(dependency)), "{of_it} needs {}", dependency["name"]);
            // Cargo leaves out what only tests need, if it has no version.
            assert!(!needed || dependency["req"] != "*", "{of_it}: {} has no version", dependency["name"]);
        }
        let manifest = std::path::Path::new(package["manifest_path"].as_str().expect("it is a path"));
        for licence in ["LICENSE-APACHE", "LICENSE-MIT"] {
            let text = read(&manifest.with_file_name(licence));
            assert_eq!(text, read(&workspace().join(licence)), "{of_it}");
        }
    }
}

#[test]
fn the_command_has_every_transport_unless_it_is_built_without() {
    let features = table("sesamec/Cargo.toml")["features"].as_table().expect("it is a table").clone();
    let default = features["default"].as_array().expect("it is a list");
    let contains = |feature: &str| {
        let of = |name: &str| {
            features[name].as_array().is_some_and(|parts| parts.iter().any(|it| it.as_str() == Some(feature)))
        };
        default.iter().filter_map(toml::Value::as_str).any(|name| name == feature || of(name))
    };
    let missing: Vec<&String> = features.keys().filter(|name| *name != "default" && !contains(name)).collect();
    assert!(missing.is_empty(), "{missing:?}");
}

#[test]
fn the_script_explains_its_pieces_and_refuses_others() {
    let release = |arguments: &[&str]| done(command(workspace().join("release")).args(arguments));
    let help = release(&["--help"]).expect(0).out;
    let script = read(&workspace().join("release"));
    let pieces = script.lines().find_map(|line| line.strip_prefix("all=(")).expect("it lists them");
    for piece in pieces.trim_end_matches(')').split(' ') {
        assert!(help.contains(&format!("\n  {piece} ")), "{piece} is not explained:\n{help}");
        assert!(script.contains(&format!("\n{piece}() {{\n")), "{piece}");
    }
    assert!(help.ends_with("how to publish it.\n"), "{help}");
    let refused = release(&["wheels"]).expect(2);
    assert_eq!(
        refused.err,
        format!("error: `wheels` is not a piece of a release; there are {}\n", pieces.trim_end_matches(')'))
    );
}
