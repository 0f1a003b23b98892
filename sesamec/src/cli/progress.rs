//! How far a build by cargo is: crates that are done, of all that it takes. Pure.
//!
//! Cargo names each crate when it has built it. How many there will be comes from `cargo metadata`, which resolves the
//! same features and platforms.

use std::collections::{BTreeMap, BTreeSet};
use std::time::Duration;

use serde::Deserialize;

/// Crates that are still being built are named when there are no more than these.
const NAMED: usize = 3;

/// The widest line of progress: one that a terminal wraps could not be overwritten.
const COLUMNS: usize = 68;

/// What `cargo build --message-format=json-render-diagnostics` writes about one target.
#[derive(Debug, Deserialize)]
pub(super) struct CargoMessage {
    pub(super) reason: String,
    package_id: Option<String>,
    target: Option<Target>,
    pub(super) executable: Option<std::path::PathBuf>,
}

#[derive(Debug, Deserialize)]
struct Target {
    kind: Vec<String>,
}

/// What `cargo metadata` says about the packages of a build.
#[derive(Debug, Deserialize)]
pub(super) struct Metadata {
    packages: Vec<Package>,
    resolve: Resolve,
}

#[derive(Debug, Deserialize)]
struct Package {
    id: String,
    name: String,
}

#[derive(Debug, Deserialize)]
struct Resolve {
    nodes: Vec<ResolvedPackage>,
    root: Option<String>,
}

#[derive(Debug, Deserialize)]
struct ResolvedPackage {
    id: String,
    deps: Vec<Dependency>,
}

#[derive(Debug, Deserialize)]
struct Dependency {
    pkg: String,
    dep_kinds: Vec<DependencyKind>,
}

#[derive(Debug, Deserialize)]
struct DependencyKind {
    kind: Option<String>,
}

impl Metadata {
    /// The packages that a build of the root takes, itself included: names by id. Those that only tests need are not
    /// among them.
    fn needed(self) -> BTreeMap<String, String> {
        let mut names: BTreeMap<String, String> =
            self.packages.into_iter().map(|package| (package.id, package.name)).collect();
        let nodes: BTreeMap<&str, &ResolvedPackage> =
            self.resolve.nodes.iter().map(|node| (node.id.as_str(), node)).collect();
        let mut needed: BTreeSet<&str> = BTreeSet::new();
        let mut open: Vec<&str> = self.resolve.root.as_deref().into_iter().collect();
        while let Some(id) = open.pop() {
            if needed.insert(id) {
                let for_builds =
                    |dependency: &&Dependency| dependency.dep_kinds.iter().any(|of| of.kind.as_deref() != Some("dev"));
                let dependencies = nodes.get(id).into_iter().flat_map(|node| &node.deps);
                open.extend(dependencies.filter(for_builds).map(|dependency| dependency.pkg.as_str()));
            }
        }
        names.retain(|id, _| needed.contains(id.as_str()));
        names
    }
}

/// The crates of a build.
#[derive(Debug, Default)]
pub(super) struct Crates {
    /// Names by package id; `None` until `cargo metadata` has answered.
    all: Option<BTreeMap<String, String>>,
    done: BTreeSet<String>,
}

impl Crates {
    /// Counts what a message says. A package is done with its library or program, not with its build script.
    pub(super) fn hear(&mut self, message: &CargoMessage) {
        let built =
            message.target.as_ref().is_some_and(|target| !target.kind.iter().any(|kind| kind == "custom-build"));
        if let ("compiler-artifact", true, Some(id)) = (message.reason.as_str(), built, &message.package_id) {
            self.done.insert(id.clone());
        }
    }

    /// Takes in which crates there are.
    pub(super) fn expect(&mut self, metadata: Metadata) {
        self.all = Some(metadata.needed());
    }

    /// How far the build of a campaign's runner is, on one line.
    pub(super) fn line(&self, campaign: &str, elapsed: Duration) -> String {
        let seconds = elapsed.as_secs();
        let Some(all) = &self.all else {
            return fitting(format!("{campaign}: {}, {seconds} s", crates(self.done.len())));
        };
        let left: Vec<&str> =
            all.iter().filter(|(id, _)| !self.done.contains(*id)).map(|(_, name)| name.as_str()).collect();
        let line = format!("{campaign}: {} of {}, {seconds} s", all.len() - left.len(), crates(all.len()));
        if left.is_empty() || left.len() > NAMED {
            return fitting(line);
        }
        fitting(format!("{line}, still {}", left.join(", ")))
    }
}

fn crates(count: usize) -> String {
    if count == 1 { "1 crate".to_owned() } else { format!("{count} crates") }
}

/// A line of a width that no terminal wraps.
fn fitting(line: String) -> String {
    if line.chars().count() <= COLUMNS {
        return line;
    }
    let mut line: String = line.chars().take(COLUMNS - 1).collect();
    line.push('…');
    line
}

#[cfg(test)]
mod tests {
    use super::*;

    fn artifact(id: &str, kind: &str) -> CargoMessage {
        let text = format!(
            r#"{{"reason":"compiler-artifact","package_id":"{id}","target":{{"kind":["{kind}"]}},"fresh":true}}"#
        );
        serde_json::from_str(&text).unwrap()
    }

    /// A runner that needs `runtime`, which needs `sqlite` and, to be built, `cc`; `insta` is for its tests alone.
    fn metadata() -> Metadata {
        let dependency = |on: &str, kind: &str| format!(r#"{{"pkg":"{on}","dep_kinds":[{{"kind":{kind}}}]}}"#);
        let node = |id: &str, deps: &[String]| format!(r#"{{"id":"{id}","deps":[{}]}}"#, deps.join(","));
        let packages = ["runner", "runtime", "sqlite", "cc", "insta", "elsewhere"]
            .map(|name| format!(r#"{{"id":"{name}","name":"{name}"}}"#));
        let nodes = [
            node("runner", &[dependency("runtime", "null"), dependency("insta", "\"dev\"")]),
            node("runtime", &[dependency("sqlite", "null"), dependency("cc", "\"build\"")]),
            node("sqlite", &[dependency("cc", "\"build\"")]),
            node("cc", &[]),
            node("insta", &[dependency("elsewhere", "null")]),
        ];
        let (packages, nodes) = (packages.join(","), nodes.join(","));
        let text = format!(r#"{{"packages":[{packages}],"resolve":{{"root":"runner","nodes":[{nodes}]}}}}"#);
        serde_json::from_str(&text).unwrap()
    }

    #[test]
    fn packages_are_counted_once_and_without_those_of_tests() {
        let mut crates = Crates::default();
        let line = |crates: &Crates, seconds| crates.line("stress", Duration::from_secs(seconds));
        crates.hear(&artifact("cc", "lib"));
        assert_eq!(line(&crates, 1), "stress: 1 crate, 1 s", "how many there are is not known yet");
        crates.expect(metadata());
        assert_eq!(line(&crates, 2), "stress: 1 of 4 crates, 2 s, still runner, runtime, sqlite");
        crates.hear(&artifact("sqlite", "custom-build"));
        assert_eq!(line(&crates, 3), "stress: 1 of 4 crates, 3 s, still runner, runtime, sqlite", "a build script");
        // A package that is built for the host and for the target is announced twice.
        crates.hear(&artifact("sqlite", "lib"));
        crates.hear(&artifact("sqlite", "lib"));
        assert_eq!(line(&crates, 4), "stress: 2 of 4 crates, 4 s, still runner, runtime");
        crates.hear(&artifact("runtime", "lib"));
        crates.hear(&artifact("runner", "bin"));
        assert_eq!(line(&crates, 61), "stress: 4 of 4 crates, 61 s");
    }

    #[test]
    fn a_crate_that_nobody_expected_does_not_make_more_done_than_there_are() {
        let mut crates = Crates::default();
        crates.expect(metadata());
        for id in ["runner", "runtime", "sqlite", "cc", "unexpected"] {
            crates.hear(&artifact(id, "lib"));
        }
        assert_eq!(crates.line("stress", Duration::ZERO), "stress: 4 of 4 crates, 0 s");
    }

    #[test]
    fn only_artifacts_are_counted() {
        let mut crates = Crates::default();
        let script = r#"{"reason":"build-script-executed","package_id":"sqlite"}"#;
        let end = r#"{"reason":"build-finished","success":true}"#;
        for text in [script, end] {
            crates.hear(&serde_json::from_str(text).unwrap());
        }
        assert_eq!(crates.line("stress", Duration::ZERO), "stress: 0 crates, 0 s");
    }

    #[test]
    fn a_line_fits_a_terminal() {
        let mut crates = Crates::default();
        crates.expect(metadata());
        let line = crates.line(&"x".repeat(200), Duration::ZERO);
        assert_eq!((line.chars().count(), line.ends_with('…')), (COLUMNS, true));
    }
}
