//! A runner that was generated with all it needs goes where there is neither a checkout nor a project.

use std::fs;
use std::path::{Path, PathBuf};

use sesame_tests::{Project, command, done, sesamec, workspace};

/// A folder outside of this checkout, another one for each. It stays when the test is over: files that come out the
/// same are not written again, and so cargo need not compile them again.
fn far_away() -> PathBuf {
    let name = workspace().display().to_string().replace(['/', '\\', ':'], "-");
    std::env::temp_dir().join(format!("sesame-vendored{name}"))
}

fn every_file(folder: &Path, visit: &mut impl FnMut(&Path)) {
    for entry in fs::read_dir(folder).unwrap() {
        let path = entry.unwrap().path();
        if path.is_dir() { every_file(&path, visit) } else { visit(&path) }
    }
}

/// The runner of a campaign in a folder that nothing leads out of; its project is gone.
fn vendored() -> PathBuf {
    let space = fs::read_to_string(workspace().join("tests/simulators/faulty/space.sesame")).unwrap();
    let project = Project::new("vendored", &space.replace("NAME", "vendored"), "faulty");
    project.sesamec("generate", &[]).expect(0);
    let hook = project.runners.join("hooks/fragile.rs");
    let stub = fs::read_to_string(&hook).unwrap();
    fs::write(&hook, stub.replace("ctx.unimplemented();", "if heard > 0.0 { ctx.set(heard); }")).unwrap();

    let out = far_away();
    let mut generate = command(sesamec());
    generate
        .args(["generate", "--vendor", "--campaign", "harmless", "--force"])
        .arg(&project.space)
        .arg("-o")
        .arg(&out);
    let runner = out.join("harmless");
    for of_before in ["results", "src/hooks"] {
        if runner.join(of_before).exists() {
            fs::remove_dir_all(runner.join(of_before)).unwrap();
        }
    }
    done(&mut generate).expect(0);
    let again = done(generate.arg("--dry-run")).expect(0);
    assert_eq!(again.out, "", "what is generated is not generated again");
    fs::remove_dir_all(&project.folder).unwrap();
    runner
}

#[test]
fn a_vendored_runner_has_all_it_needs_and_speaks_of_no_checkout() {
    let runner = vendored();
    let here = workspace().display().to_string();
    every_file(&runner, &mut |path| {
        let text = String::from_utf8_lossy(&fs::read(path).unwrap()).into_owned();
        assert!(!text.contains(&here), "{} speaks of the checkout", path.display());
        let manifest = path.file_name().is_some_and(|name| name == "Cargo.toml");
        assert!(!manifest || !text.contains("../.."), "{} leads out of the runner", path.display());
    });
    // Cargo finds every crate: those without a source of their own lie in the runner.
    let mut metadata = command(env!("CARGO"));
    metadata.args(["metadata", "--format-version", "1", "--offline"]).current_dir(&runner);
    let metadata = done(&mut metadata).expect(0).json();
    let packages = metadata["packages"].as_array().unwrap();
    let paths = packages.iter().filter(|package| package["source"].is_null());
    let paths: Vec<&str> = paths.map(|package| package["manifest_path"].as_str().unwrap()).collect();
    assert!(paths.iter().any(|path| path.contains("runtime")), "{paths:?}");
    let inside = fs::canonicalize(&runner).unwrap();
    assert!(paths.iter().all(|path| Path::new(path).starts_with(&inside)), "{paths:?}");
}

#[test]
#[ignore = "long: compiles a copy of the whole runtime"]
fn a_vendored_runner_builds_and_runs_with_no_checkout_and_no_project_near() {
    let runner = vendored();
    // So far away cargo does not find the settings of the suite's runners.
    let mut run = command(env!("CARGO"));
    run.args(["run", "--quiet", "--", "run", "--workers", "2"]).env("CARGO_PROFILE_DEV_OPT_LEVEL", "0");
    let ran = done(run.current_dir(&runner)).expect(0);
    assert!(ran.out.contains("front of"), "{}", ran.out);
    assert!(!ran.err.contains("warning"), "{}", ran.err);
    assert!(runner.join("results/3/results.sqlite").is_file());
}
