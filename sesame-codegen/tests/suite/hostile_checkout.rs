//! A project from outside, with links and manifests made to lead a generation elsewhere: nothing outside of the output
//! folder is touched.
#![cfg(unix)]

use std::collections::BTreeMap;
use std::fs;
use std::os::unix::fs::{MetadataExt as _, symlink};
use std::path::{Path, PathBuf};
use std::sync::LazyLock;

use proptest::prelude::*;
use sesame_codegen::emit::emit;
use sesame_codegen::files::Tree;
use sesame_codegen::output::{Error, Mode, apply};

use crate::placed::environment;
use crate::plans::small;

static TREES: LazyLock<Vec<Tree>> = LazyLock::new(|| emit(&[small("day"), small("night")], &environment()).unwrap());

/// Every name below a folder, but for one folder in it: what it holds or leads to, and when it was last changed.
fn snapshot(folder: &Path, except: &Path) -> BTreeMap<PathBuf, (Vec<u8>, i64, i64)> {
    let mut all = BTreeMap::new();
    let mut folders = vec![folder.to_owned()];
    while let Some(folder) = folders.pop() {
        for entry in fs::read_dir(&folder).unwrap() {
            let path = entry.unwrap().path();
            if path == except {
                continue;
            }
            let metadata = fs::symlink_metadata(&path).unwrap();
            let mut what = format!("{:o} ", metadata.mode()).into_bytes();
            if metadata.is_symlink() {
                what.extend(fs::read_link(&path).unwrap().as_os_str().as_encoded_bytes());
            } else if metadata.is_file() {
                what.extend(fs::read(&path).unwrap());
            } else {
                folders.push(path.clone());
            }
            // Names that come and go in a folder change its time, even if it looks the same afterwards.
            all.insert(path, (what, metadata.mtime(), metadata.mtime_nsec()));
        }
    }
    all
}

/// What somebody put into the output folder.
#[derive(Debug, Clone)]
enum Trap {
    /// A link in the place of something that is generated, or beside it.
    Link { at: prop::sample::Index, kind: TrapSite, to: &'static str },
    /// A folder or a file in such a place.
    Other { at: prop::sample::Index, kind: TrapSite, folder: bool },
    /// What a manifest claims to have generated.
    Claim { of: prop::sample::Index, path: &'static str, right: bool, runner: bool },
}

#[derive(Debug, Clone, Copy)]
enum TrapSite {
    /// A generated file.
    File,
    /// The folder of one.
    Folder,
    /// A name as a temporary file beside it might have.
    Temporary,
}

const TARGETS: &[&str] = &[
    "outside",
    "outside/victim",
    "outside/folder",
    "outside/new",
    "outside/folder/new/er",
    "space/simulator",
    "space",
    "",
];

/// What manifests claim; `trap` is a link to the folder outside.
const CLAIMS: &[&str] = &[
    "../../outside/victim",
    "../../../outside/victim",
    "trap/victim",
    "trap",
    "trap/folder/main.rs",
    "trap/folder",
    "src/../trap/victim",
    "/etc/hostname",
    "",
    ".",
    "..",
    "a\\b",
];

/// The SHA-256 of `mine`, which is what files outside hold.
const SHA_OF_MINE: &str = "3fd30542fe3f61b14bd4a4b2dc0b6fb30fa6f63ebce52dd1778aaa8c4dc02cff";

fn trap() -> impl Strategy<Value = Trap> {
    let kinds = prop::sample::select(&[TrapSite::File, TrapSite::Folder, TrapSite::Temporary, TrapSite::Temporary]);
    prop_oneof![
        5 => (any::<prop::sample::Index>(), kinds.clone(), prop::sample::select(TARGETS))
            .prop_map(|(at, kind, to)| Trap::Link { at, kind, to }),
        1 => (any::<prop::sample::Index>(), kinds, any::<bool>())
            .prop_map(|(at, kind, folder)| Trap::Other { at, kind, folder }),
        3 => (any::<prop::sample::Index>(), prop::sample::select(CLAIMS), any::<bool>(), any::<bool>())
            .prop_map(|(of, path, right, runner)| Trap::Claim { of, path, right, runner }),
    ]
}

/// Removes what is at a place, without following it.
fn clear(path: &Path) {
    match fs::symlink_metadata(path) {
        Ok(found) if found.is_dir() => fs::remove_dir_all(path).unwrap(),
        Ok(_) => fs::remove_file(path).unwrap(),
        Err(_) => {}
    }
}

/// A folder with a space, its runners and what is outside.
fn scene(all: &Path) -> PathBuf {
    for folder in ["outside/folder", "space/simulator", "space/runners"] {
        fs::create_dir_all(all.join(folder)).unwrap();
    }
    for file in ["outside/victim", "outside/folder/main.rs", "outside/Cargo.toml", "space/simulator/Cargo.toml"] {
        fs::write(all.join(file), "mine").unwrap();
    }
    all.join("space/runners")
}

/// Whether a path is below a folder without a link on the way, so that a trap may be set there.
fn is_plain(path: &Path, below: &Path) -> bool {
    let parents = path.ancestors().skip(1).take_while(|folder| folder.starts_with(below));
    parents.into_iter().all(|folder| fs::symlink_metadata(folder).is_ok_and(|found| found.is_dir()))
}

fn set(trap: &Trap, all: &Path, out: &Path, generated: &[String]) {
    let place = |at: &prop::sample::Index, kind| {
        let file = out.join(at.get(generated));
        match kind {
            TrapSite::File => file,
            TrapSite::Folder => file.parent().filter(|&folder| folder != out).unwrap_or(&file).to_owned(),
            TrapSite::Temporary => {
                let name = file.file_name().unwrap().to_str().unwrap();
                file.with_file_name(format!("{name}.sesame-new-{}", std::process::id()))
            }
        }
    };
    match trap {
        Trap::Link { at, kind, to } => {
            let place = place(at, *kind);
            if is_plain(&place, out) {
                clear(&place);
                symlink(all.join(to), place).unwrap();
            }
        }
        Trap::Other { at, kind, folder } => {
            let place = place(at, *kind);
            if is_plain(&place, out) {
                clear(&place);
                if *folder { fs::create_dir(place).unwrap() } else { fs::write(place, "other").unwrap() }
            }
        }
        Trap::Claim { of, path, right, runner } => {
            let manifests: Vec<&String> = generated.iter().filter(|path| path.ends_with("manifest.json")).collect();
            let path_of_manifest = out.join(of.get(&manifests));
            if !is_plain(&path_of_manifest, out) || !path_of_manifest.is_file() || path_of_manifest.is_symlink() {
                return;
            }
            let link = path_of_manifest.parent().unwrap().parent().unwrap().join("trap");
            if is_plain(&link, out) && fs::symlink_metadata(&link).is_err() {
                symlink(all.join("outside"), link).unwrap();
            }
            // Another trap may have taken its place.
            let text = fs::read(&path_of_manifest).unwrap();
            let Ok(mut manifest) = serde_json::from_slice::<serde_json::Value>(&text) else { return };
            let hash = if *right { SHA_OF_MINE } else { "0" };
            manifest["files"][path] = serde_json::json!({ "owner": "machine", "hash": hash });
            if *runner {
                manifest["runners"] = serde_json::json!([path, "trap", "day"]);
            }
            fs::write(path_of_manifest, manifest.to_string()).unwrap();
        }
    }
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 120, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn generating_touches_nothing_outside_any_output_folder(
        traps in prop::collection::vec(trap(), 1..6),
        modes in prop::collection::vec(
            prop::sample::select(&[Mode::Write, Mode::Force, Mode::Check, Mode::CheckForce]), 1..4),
        fresh: bool,
    ) {
        let all = tempfile::tempdir().unwrap();
        let out = scene(all.path());
        let first = apply(&out, &TREES, Mode::Write).unwrap();
        let generated: Vec<String> = first.files.into_iter().map(|file| file.path).collect();
        if fresh {
            // The folders stay, so that links can be set where files are to come.
            for path in generated.iter().filter(|path| !path.ends_with("manifest.json")) {
                fs::remove_file(out.join(path)).unwrap();
            }
        }
        for trap in &traps {
            set(trap, all.path(), &out, &generated);
        }
        let before = snapshot(all.path(), &out);
        for mode in modes {
            let answer = apply(&out, &TREES, mode);
            prop_assert_eq!(snapshot(all.path(), &out), before.clone(), "{:?}: {:?}", mode, answer);
            if let Err(error) = answer {
                prop_assert!(
                    !matches!(error, Error::Io { .. }),
                    "what is in the way is told with its remedy: {}", error
                );
            }
        }
    }
}

/// The three ways in which a generation was once led outside.
#[test]
fn links_and_manifests_that_lead_outside_are_refused_or_replaced_and_never_followed() {
    let all = tempfile::tempdir().unwrap();
    let out = scene(all.path());
    let trees = emit(&[small("day")], &environment()).unwrap();
    let victim = all.path().join("outside/victim");
    let generate = |mode| apply(&out, &trees, mode);

    // A link in the place of a temporary file.
    fs::create_dir_all(out.join("day")).unwrap();
    symlink(&victim, out.join("day/Cargo.toml.sesame-new")).unwrap();
    symlink(&victim, out.join(format!("day/Cargo.toml.sesame-new-{}", std::process::id()))).unwrap();
    generate(Mode::Write).unwrap();
    assert!(fs::symlink_metadata(out.join("day/Cargo.toml")).unwrap().is_file());

    // A generated file that is a link: which counts as edited by hand, replaced by force, and its text is not
    // shown.
    clear(&out.join("day/Cargo.toml"));
    symlink(&victim, out.join("day/Cargo.toml")).unwrap();
    let refused = generate(Mode::Write).unwrap_err().to_string();
    assert!(refused.contains("day/Cargo.toml\nit is now a link") && !refused.contains("mine"), "{refused}");
    generate(Mode::Force).unwrap();
    assert!(fs::symlink_metadata(out.join("day/Cargo.toml")).unwrap().is_file());

    // A hook that is a link is the user's, and stays one.
    clear(&out.join("hooks/top_speed.rs"));
    symlink(&victim, out.join("hooks/top_speed.rs")).unwrap();
    generate(Mode::Force).unwrap();
    assert!(out.join("hooks/top_speed.rs").is_symlink());

    // A folder that is a link.
    fs::rename(out.join("day/src"), all.path().join("outside/src")).unwrap();
    symlink("../../../outside/src", out.join("day/src")).unwrap();
    for mode in [Mode::Write, Mode::Force, Mode::Check] {
        let refused = generate(mode).unwrap_err();
        assert!(matches!(&refused, Error::Link { path } if path.ends_with("day/src")), "{refused}");
        assert!(refused.to_string().contains("remove the link"), "{refused}");
    }
    clear(&out.join("day/src"));

    // A manifest that claims to have generated what is outside.
    symlink("../../outside", out.join("link")).unwrap();
    let manifest = out.join(".sesame/manifest.json");
    let mut claimed: serde_json::Value = serde_json::from_slice(&fs::read(&manifest).unwrap()).unwrap();
    claimed["files"]["link/victim"] = serde_json::json!({ "owner": "machine", "hash": SHA_OF_MINE });
    fs::write(&manifest, claimed.to_string()).unwrap();
    generate(Mode::Write).unwrap();
    assert_eq!(fs::read_to_string(&victim).unwrap(), "mine");
}
