//! What `./release` makes, once for all tests of a run.

use std::fs;
use std::path::{Path, PathBuf};

use sesame_tests::{command, done, this_run, turn, workspace};

use crate::steps::{on_path, read};

/// The folder of a release. `SESAME_RELEASE_FILES` names one that is there already; otherwise this workspace is
/// released, in its own target folder, which takes many minutes.
pub(crate) fn released() -> PathBuf {
    if let Some(folder) = std::env::var_os("SESAME_RELEASE_FILES") {
        let folder = workspace().join(folder);
        assert!(folder.join("SHA256SUMS").is_file(), "{} is not a release", folder.display());
        return folder;
    }
    let program = std::env::current_exe().expect("a test has a program");
    let target = program.ancestors().nth(3).expect("cargo puts test programs three folders deep");
    let (files, stamp) = (target.join("release-files"), target.join("across/released"));
    // The script empties its folder of work.
    let _turn = turn();
    if fs::read_to_string(&stamp).ok().as_deref() != Some(this_run()) {
        let mut release = command(workspace().join("release"));
        release.args(["wheel", "static", "deb", "crates", "bom"]);
        if on_path("buildah") {
            release.arg("container");
        }
        release.env("CARGO_TARGET_DIR", target).env_remove("CARGO_NET_OFFLINE").current_dir(workspace());
        release.env("DEBFULLNAME", "A Maintainer").env("DEBEMAIL", "maintainer@sesame.example");
        let released = done(&mut release).expect(0);
        eprintln!("{}", released.out);
        fs::write(&stamp, this_run()).expect("a stamp can be written");
    }
    files
}

/// The one file of a release whose name begins and ends so.
pub(crate) fn file(begins: &str, ends: &str) -> PathBuf {
    let folder = released();
    let fits = |path: &Path| {
        let name = path.file_name().and_then(|name| name.to_str()).unwrap_or_default();
        name.starts_with(begins) && name.ends_with(ends)
    };
    let entries = fs::read_dir(&folder).expect("a release is a folder");
    let found: Vec<PathBuf> =
        entries.map(|entry| entry.expect("it can be listed").path()).filter(|it| fits(it)).collect();
    let [file] = &found[..] else { panic!("{begins}…{ends} in {}: {found:?}", folder.display()) };
    file.clone()
}

#[test]
#[ignore = "long: makes a release"]
fn the_checksums_are_those_of_all_files() {
    let folder = released();
    done(command("sha256sum").args(["--check", "--strict", "--quiet", "SHA256SUMS"]).current_dir(&folder)).expect(0);
    let listed = read(&folder.join("SHA256SUMS"));
    let mut folders = vec![folder.clone()];
    while let Some(here) = folders.pop() {
        for entry in fs::read_dir(here).expect("a folder can be listed") {
            let path = entry.expect("it can be listed").path();
            if path.is_dir() {
                folders.push(path);
                continue;
            }
            let name = path.strip_prefix(&folder).expect("it is in there").display().to_string();
            assert!(name == "SHA256SUMS" || listed.contains(&format!("  {name}\n")), "{name}");
        }
    }
    crate::materials::agrees_with_the_lock(&file("sesamec-", ".cdx.json"));
}
