//! A project from outside, with links and manifests made to lead a generation elsewhere: nothing outside of the output
//! folder is touched.
#![cfg(unix)]

use std::collections::BTreeMap;
use std::fs;
use std::os::unix::fs::{MetadataExt as _, symlink};
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::sync::LazyLock;

use proptest::prelude::*;
use sesame_codegen::emit::emit;
use sesame_codegen::files::Tree;
use sesame_codegen::output::{Error, Mode, apply};

use crate::command::{project, sesamec};
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
    Link { at: prop::sample::Index, kind: Place, to: &'static str },
    /// A folder or a file in such a place.
    Other { at: prop::sample::Index, kind: Place, folder: bool },
    /// What a manifest claims to have generated.
    Claim { of: prop::sample::Index, path: &'static str, right: bool, runner: bool },
}

#[derive(Debug, Clone, Copy)]
enum Place {
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
    let kinds = prop::sample::select(&[Place::File, Place::Folder, Place::Temporary, Place::Temporary]);
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
            Place::File => file,
            Place::Folder => file.parent().filter(|&folder| folder != out).unwrap_or(&file).to_owned(),
            Place::Temporary => {
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

#[test]
fn a_folder_of_runners_that_is_a_link_is_only_used_when_it_is_named() {
    let folder = tempfile::tempdir().unwrap();
    let file = project(folder.path(), "");
    let (elsewhere, link) = (folder.path().join("elsewhere"), folder.path().join("runners"));
    fs::create_dir(&elsewhere).unwrap();
    symlink("elsewhere", &link).unwrap();
    assert!(!sesamec(&["generate", &file]));
    assert!(!sesamec(&["generate", &file, "--force"]));
    assert_eq!(fs::read_dir(&elsewhere).unwrap().count(), 0);
    assert!(sesamec(&["generate", &file, "-o", link.to_str().unwrap()]));
    assert!(elsewhere.join("day/Cargo.toml").is_file());
}

#[test]
fn formatting_a_folder_leaves_links_alone() {
    let folder = tempfile::tempdir().unwrap();
    fs::create_dir(folder.path().join("spaces")).unwrap();
    fs::write(folder.path().join("mine.sesame"), "space a  \n").unwrap();
    fs::write(folder.path().join("spaces/b.sesame"), "space b  \n").unwrap();
    symlink("../mine.sesame", folder.path().join("spaces/a.sesame")).unwrap();
    assert!(sesamec(&["fmt", folder.path().join("spaces").to_str().unwrap()]));
    assert_eq!(fs::read_to_string(folder.path().join("mine.sesame")).unwrap(), "space a  \n");
    assert_eq!(fs::read_to_string(folder.path().join("spaces/b.sesame")).unwrap(), "space b\n");
}

/// What the real command says, and whether it did what it was asked for; it must not wait for anything.
#[track_caller]
fn said(folder: &Path, arguments: &[&str]) -> (bool, String) {
    let logs = tempfile::tempdir().unwrap();
    let log = |name| fs::File::create(logs.path().join(name)).unwrap();
    let mut command = Command::new(env!("CARGO_BIN_EXE_sesamec"))
        .args(arguments)
        .current_dir(folder)
        .stdin(Stdio::null())
        .stdout(log("out"))
        .stderr(log("err"))
        .spawn()
        .unwrap();
    let mut status = None;
    let ends = sesame_patience::comes(|| {
        status = command.try_wait().unwrap();
        status.is_some()
    });
    if !ends {
        command.kill().unwrap();
        panic!("{arguments:?} waits for ever");
    }
    let status = status.expect("it has ended");
    let said = ["out", "err"].map(|name| String::from_utf8(fs::read(logs.path().join(name)).unwrap()).unwrap());
    assert!(status.code().is_some_and(|code| code < 2), "{arguments:?}: {status}: {}", said[1]);
    (status.success(), said.concat())
}

const SPACE: &str = "space s\nsystem {\n  simulator sim = process \"./sim.py\" { step 20ms }\n  \
                     topic a = \"a\" : int\n}\nmetric hits maximise default 0 { hook on a }\n\
                     operation cut on a = blackhole\ncampaign c { objectives hits  operations cut 1 per test\n  \
                     search random { evaluations 3 }  end after 3s }\n";

#[test]
fn pipes_and_devices_in_the_place_of_files_are_refused_by_every_command() {
    let folder = tempfile::tempdir().unwrap();
    let at = |name: &str| folder.path().join(name);
    fs::write(at("s.sesame"), SPACE).unwrap();
    fs::write(at("sim.py"), "").unwrap();
    fs::write(at("importing.sesame"), format!("{SPACE}import \"pipe.sesame\"\nimport \"zero.sesame\"\n")).unwrap();
    let pipe = |name: &str| assert!(Command::new("mkfifo").arg(at(name)).status().unwrap().success());
    for name in ["pipe.sesame", "pipe.model"] {
        pipe(name);
    }
    for (name, target) in [("zero.sesame", "/dev/zero"), ("zero.model", "/dev/zero"), ("folder.sesame", ".")] {
        symlink(target, at(name)).unwrap();
    }
    let refused = |arguments: &[&str], words: &str| {
        let (done, text) = said(folder.path(), arguments);
        assert!(!done && text.contains(words), "{arguments:?}: {text}");
    };
    for (name, what) in [("pipe", "a pipe"), ("zero", "a device"), ("folder", "a folder")] {
        let words = format!("it is {what}, not a regular file");
        let space = format!("{name}.sesame");
        let own: [&[&str]; 5] = [
            &["check", &space],
            &["generate", &space],
            &["fmt", "--check", &space],
            &["explain", "c", &space],
            &["import", &format!("{name}.model"), "-o", "out"],
        ];
        let count = if name == "folder" { 2 } else { 5 };
        for arguments in &own[..count] {
            refused(arguments, &words);
        }
    }
    refused(&["check", "importing.sesame"], "it is a pipe, not a regular file");
    refused(&["check", "importing.sesame"], "it is a device, not a regular file");
    pipe("sesame.toml");
    refused(&["generate", "s.sesame"], "sesame.toml: it is a pipe, not a regular file");
    assert!(!at("out").exists() && !at("runners").exists());
}

#[test]
fn what_is_not_a_space_is_never_quoted() {
    let folder = tempfile::tempdir().unwrap();
    let at = |name: &str| folder.path().join(name);
    let secret = "PASSWORD=tell_nobody";
    fs::write(at("secret"), format!("{secret}\n")).unwrap();
    for name in ["leak.sesame", "sesame.toml"] {
        symlink("secret", at(name)).unwrap();
    }
    fs::write(at("sim.py"), "").unwrap();
    fs::write(at("s.sesame"), SPACE).unwrap();
    let absolute = at("secret");
    let imports = format!("import \"secret\" import \"leak.sesame\" import \"{}\"", absolute.display());
    fs::write(at("importing.sesame"), format!("{SPACE}{imports}")).unwrap();
    for format in ["human", "short", "json", "github"] {
        for (file, words) in [("importing.sesame", "must end in `.sesame`"), ("leak.sesame", "a file of another kind")]
        {
            let (done, text) = said(folder.path(), &["check", file, "--format", format]);
            assert!(!done && !text.contains("tell_nobody") && text.contains(words), "{text}");
        }
    }
    for arguments in [&["generate", "s.sesame"][..], &["fmt", "leak.sesame"], &["run", "s.sesame"]] {
        let (done, text) = said(folder.path(), arguments);
        assert!(!done && !text.contains("tell_nobody") && text.contains("a file of another kind"), "{text}");
    }
    assert_eq!(fs::read_to_string(at("secret")).unwrap(), format!("{secret}\n"));
}

#[test]
fn no_message_of_the_command_holds_what_a_terminal_obeys() {
    let folder = tempfile::tempdir().unwrap();
    let at = |name: &str| folder.path().join(name);
    let hostile = "\u{1b}]0;owned\u{7}\u{9b}31m\u{202e}\r";
    let space = SPACE.replace("metric hits", &format!("// {hostile}\n/// {hostile}\nmetric hits"));
    fs::write(at("s.sesame"), format!("{space}   // {hostile}\n")).unwrap();
    fs::write(at("bad.sesame"), format!("{space}import \"{hostile}\" topic \"{hostile}\"")).unwrap();
    fs::write(at("sim.py"), "").unwrap();
    fs::write(at("bad.model"), format!("<a x=\"{hostile}\"><{hostile}")).unwrap();
    fs::write(at("plain.model"), format!("{hostile} is not XML")).unwrap();
    let missing = format!("missing{hostile}.sesame");
    let commands: [&[&str]; 13] = [
        &["check", "s.sesame"],
        &["check", "bad.sesame"],
        &["check", "bad.sesame", "--format", "short"],
        &["check", "bad.sesame", "--format", "github"],
        &["check", "bad.sesame", "--format", "json"],
        &["fmt", "bad.sesame"],
        &["fmt", "--check", "s.sesame"],
        &["check", &missing],
        &["explain", "c", "s.sesame"],
        &["import", "bad.model", "-o", "out"],
        &["import", "plain.model", "-o", "out"],
        &["generate", "s.sesame", "--runtime", "0.1.0", "--dry-run"],
        &["results", "tests", &missing],
    ];
    for arguments in commands {
        let (_, text) = said(folder.path(), arguments);
        let obeyed = |c: char| (c.is_control() && !"\n\t".contains(c)) || ('\u{202a}'..='\u{202e}').contains(&c);
        assert!(!text.is_empty() && !text.contains(obeyed), "{arguments:?}: {text:?}");
    }
    // What is generated edited by hand, shown as a difference.
    let generate = ["generate", "s.sesame", "--runtime", "0.1.0"];
    assert!(said(folder.path(), &generate).0);
    fs::write(at("runners/README.md"), hostile).unwrap();
    let (done, text) = said(folder.path(), &generate);
    assert!(!done && text.contains("README.md") && text.contains("\u{fffd}]0;owned"), "{text:?}");
    assert!(!text.contains('\u{1b}') && !text.contains('\r'), "{text:?}");
}

#[test]
fn an_error_that_quotes_megabytes_is_short() {
    let folder = tempfile::tempdir().unwrap();
    let at = |name: &str| folder.path().join(name);
    let long = "a".repeat(2 << 20);
    fs::write(at("s.sesame"), SPACE).unwrap();
    fs::write(at("sim.py"), "").unwrap();
    fs::write(at("bad.sesame"), format!("{SPACE}metric {long} = {long}(a) {long}")).unwrap();
    fs::write(at("sesame.toml"), format!("{long} = {long}")).unwrap();
    fs::write(at("tag.model"), format!("<TestingSpace><{long}></b></TestingSpace>")).unwrap();
    fs::write(at("value.model"), format!("<TestingSpace><metrics dir=\"{long}\" {long}></TestingSpace>")).unwrap();
    let commands: [&[&str]; 7] = [
        &["check", "bad.sesame"],
        &["check", "bad.sesame", "--format", "short"],
        &["check", "bad.sesame", "--format", "github"],
        &["fmt", "bad.sesame"],
        &["generate", "s.sesame"],
        &["import", "tag.model", "-o", "out"],
        &["import", "value.model", "-o", "out"],
    ];
    for arguments in commands {
        let (done, text) = said(folder.path(), arguments);
        assert!(!done && text.len() < 50_000, "{arguments:?}: {} bytes", text.len());
    }
}
