//! The modules of SimlogAPI are those that its files give.

use std::fs;
use std::process::Command;

use sesame_tests::{fresh_folder, workspace};

#[test]
#[ignore = "long: compiles the generator of the modules"]
fn the_modules_of_simlog_are_those_that_its_files_give() {
    let package = workspace().join("runtime/middleware/simlog");
    let made = fresh_folder("simlog_generated_anew");
    let ran = Command::new(env!("CARGO"))
        .args(["run", "--quiet", "--locked", "--manifest-path"])
        .arg(package.join("generate/Cargo.toml"))
        .arg("--target-dir")
        .arg(workspace().join("target/generate"))
        .arg("--")
        .arg(&made)
        .status();
    assert!(ran.expect("cargo starts").success());
    let modules: Vec<_> =
        fs::read_dir(&made).expect("a folder was written").map(|entry| entry.unwrap().path()).collect();
    assert_eq!(modules.len(), 3, "{modules:?}");
    for module in modules {
        let here = package.join("src/proto").join(module.file_name().expect("it is a file"));
        let same = fs::read_to_string(&module).unwrap() == fs::read_to_string(&here).unwrap();
        assert!(same, "{} differs: call `cargo run` in {}", here.display(), package.join("generate").display());
    }
}
