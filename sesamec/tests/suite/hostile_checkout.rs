//! A project from outside, with links, pipes and texts made to lead the command elsewhere: it reads only files of their
//! kind, quotes only spaces, and prints nothing that a terminal obeys.
#![cfg(unix)]

use std::fs;
use std::os::unix::fs::symlink;
use std::path::Path;
use std::process::{Command, Stdio};

use crate::command::{project, sesamec};

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
