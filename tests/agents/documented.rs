//! What the page on agents proposes is what Kubernetes and GitHub read, as their own schemas say.

use std::process::Command;

use sesame_tests::{done, workspace};

/// Insists that a program of the Python environment accepts a file in `examples/agents`, and refuses it with this
/// changed.
fn accepted(program: &str, arguments: &[&str], file: &str, (right, wrong): (&str, &str)) {
    let Some(python) = sesame_peers::named("SESAME_NATS") else { return };
    let file = workspace().join("examples/agents").join(file);
    let judge = |file: &std::path::Path| done(Command::new(python.with_file_name(program)).args(arguments).arg(file));
    judge(&file).expect(0);
    let text = std::fs::read_to_string(&file).expect("the example is there");
    assert!(text.contains(right));
    let folder = tempfile::tempdir().expect("a folder can be made");
    let changed = folder.path().join("changed.yaml");
    std::fs::write(&changed, text.replace(right, wrong)).expect("a file can be written");
    assert_ne!(judge(&changed).code, Some(0), "{wrong}");
}

#[test]
fn kubernetes_reads_the_manifest() {
    accepted("kubernetes-validate", &["--strict"], "kubernetes.yaml", ("replicas: 10", "replicas: ten"));
}

#[test]
fn github_reads_the_workflow() {
    let schema = ["--builtin-schema", "vendor.github-workflows"];
    accepted("check-jsonschema", &schema, "github.yml", ("runs-on: ubuntu-24.04", "run-on: ubuntu-24.04"));
}
