//! Where a runner lives. Cargo knows a package at the root of a workspace by its name only, so that it may take the
//! runner of one project for that of another: of a copy, or where projects share a target folder.

use std::path::Path;

use super::Failure;

/// The environment variable in which `sesamec` tells cargo and the program in which folder the runner is. What
/// generated code was compiled for depends on it.
pub const RUNNER: &str = "SESAME_RUNNER";

/// Refuses to run for a runner in another folder than the one that this program was compiled for.
pub(super) fn check(compiled_for: &Path) -> Result<(), Failure> {
    let of_cargo = || std::env::var_os("CARGO_MANIFEST_DIR").filter(|folder| is_runner(Path::new(folder)));
    match std::env::var_os(RUNNER).or_else(of_cargo) {
        Some(wanted) => same(compiled_for, Path::new(&wanted)).map_err(Failure),
        None => Ok(()),
    }
}

fn is_runner(folder: &Path) -> bool {
    folder.join("campaign.plan.json").is_file()
}

fn same(compiled_for: &Path, wanted: &Path) -> Result<(), String> {
    let place = |folder: &Path| folder.canonicalize().unwrap_or_else(|_| folder.to_owned());
    if place(compiled_for) == place(wanted) {
        return Ok(());
    }
    Err(format!(
        "this program was built for the runner in {}, and is asked to run for the one in {}: cargo confuses them, \
         because their spaces and campaigns have the same names and they share a target folder, or because one is a \
         copy of the other; `touch {}` and run it again",
        compiled_for.display(),
        wanted.display(),
        wanted.join("src/main.rs").display()
    ))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_program_runs_for_the_folder_that_it_was_built_for_only() {
        let folder = tempfile::tempdir().unwrap();
        let (one, two) = (folder.path().join("one"), folder.path().join("two"));
        std::fs::create_dir_all(&one).unwrap();
        std::fs::create_dir_all(&two).unwrap();
        assert_eq!(same(&one, &one.join("../one")), Ok(()));
        let said = same(&one, &two).unwrap_err();
        assert!(
            said.contains("was built for the runner in") && said.contains("two/src/main.rs` and run it again"),
            "{said}"
        );
        assert!(!is_runner(&one));
    }
}
