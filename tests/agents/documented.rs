//! What the documentation proposes is what Kubernetes, GitHub and GitLab read, as their own schemas say.

use std::process::Command;

use sesame_tests::{done, workspace};

/// Insists that a program of the Python environment accepts a file, and refuses it with this changed.
fn accepted(program: &str, arguments: &[&str], file: &str, (right, wrong): (&str, &str)) {
    let Some(python) = sesame_peers::named("SESAME_NATS") else { return };
    let file = workspace().join(file);
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
    accepted(
        "kubernetes-validate",
        &["--strict"],
        "examples/agents/kubernetes.yaml",
        ("replicas: 10", "replicas: ten"),
    );
}

#[test]
fn github_reads_the_workflows_and_the_action() {
    let schema = ["--builtin-schema", "vendor.github-workflows"];
    let change = ("runs-on: ubuntu-24.04", "run-on: ubuntu-24.04");
    accepted("check-jsonschema", &schema, "examples/agents/github.yml", change);
    accepted("check-jsonschema", &schema, "examples/ci/github.yml", change);
    let schema = ["--builtin-schema", "vendor.github-actions"];
    accepted("check-jsonschema", &schema, "action.yml", ("using: composite", "using: composed"));
}

#[test]
fn gitlab_reads_the_jobs() {
    let schema = ["--builtin-schema", "vendor.gitlab-ci"];
    accepted("check-jsonschema", &schema, "examples/ci/gitlab-ci.yml", ("  script:", "  scripts:"));
}
