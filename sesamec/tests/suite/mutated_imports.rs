//! Files of the original platform with something changed in them at random: each is imported whole, as a space without
//! errors in the one layout, or refused without a trace.

use std::collections::BTreeSet;
use std::fs;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::{Path, PathBuf};
use std::process::{Command, ExitCode, Stdio};
use std::time::{Duration, Instant};

use sesame_record::Repository;
use sesamec::cli::{Shell, run};
use sesamec::frontend::SESAME;

const WHOLE: &str = include_str!("../originals/arm.model");

/// Longest that an import may take, on a machine with much else to do; usual is a hundredth of it.
const MAX_TIME: Duration = Duration::from_secs(60);

/// What stands in the place of a value.
const VALUES: &[&str] = &[
    "",
    "0",
    "-1",
    "-0.0",
    "1e308",
    "-1e308",
    "1e-320",
    "NaN",
    "Infinity",
    "-Infinity",
    "9223372036854775807",
    "-9223372036854775808",
    "4294967296",
    "70.0",
    "200000000",
    "true",
    "metric",
    "seed",
    "../../x",
    "a b",
    "ü",
    "&quot;}//&#10;",
    "&#x1b;[31m",
    "&#0;",
    "_m0",
    "_m3",
    "_o0",
    "_o6",
    "_p0",
    "_p1",
    "_v1",
    "_t3",
    "_nobody",
    "//@campaigns.1/@performedTests.0",
    "//@campaigns.99/@performedTests.99999999999999999999",
    "LOWEST",
    "EQUALS",
    "AND",
    "INTERMEDIATE",
    "TestingMM:RepeatedExecution",
    "TestingMM:NSGAWithCoverageCells",
    "_1:FixedTimeActivation",
    "_1:ConditionBasedActivation",
    "_1:BlackholeNetworkOperation",
    "_1:CustomFuzzingOperation",
    "_1:StringSet",
    "_3:CompositeCondition",
    "geometry_msgs/Twist.linear.X",
];

/// Numbers from a seed (`SplitMix64`).
pub(crate) struct Draws(pub(crate) u64);

impl Draws {
    fn bits(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9E37_79B9_7F4A_7C15);
        let mut x = self.0;
        x = (x ^ (x >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
        x = (x ^ (x >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
        x ^ (x >> 31)
    }

    pub(crate) fn below(&mut self, n: usize) -> usize {
        usize::try_from(self.bits() % u64::try_from(n.max(1)).unwrap()).unwrap()
    }
}

/// A file in pieces: tags, what is between them, and within tags the values of attributes.
fn pieces(text: &str) -> Vec<&str> {
    let mut pieces = Vec::new();
    let mut rest = text;
    while !rest.is_empty() {
        let end = match rest.as_bytes()[0] {
            b'"' => rest[1..].find('"').map_or(rest.len(), |at| at + 2),
            b'>' => 1,
            b'<' => rest.find([' ', '>', '"']).unwrap_or(rest.len()),
            _ => rest.find(['"', '<', '>']).unwrap_or(rest.len()),
        };
        let (piece, after) = rest.split_at(end.max(1));
        pieces.push(piece);
        rest = after;
    }
    pieces
}

/// The elements of a file that lie in another and stand on lines of their own, as ranges of lines.
fn elements(text: &str) -> Vec<(usize, usize)> {
    let lines: Vec<&str> = text.lines().collect();
    let indent = |line: &str| line.len() - line.trim_start().len();
    let opens = |line: &str| line.trim_start().starts_with('<') && !line.trim_start().starts_with("</");
    let mut found = Vec::new();
    for (at, line) in lines.iter().enumerate().skip(2).filter(|(_, line)| opens(line)) {
        let name = line.trim_start()[1..].split([' ', '>', '/']).next().unwrap_or_default();
        let close = format!("</{name}>");
        let ends = |line: &str| line.trim_end().ends_with("/>") || line.contains(&close);
        if ends(line) {
            found.push((at, at + 1));
        } else if let Some(length) =
            lines[at..].iter().position(|other| indent(other) == indent(line) && other.contains(&close))
        {
            found.push((at, at + length + 1));
        }
    }
    found
}

/// A file with one to three things in it changed.
fn mutated(draws: &mut Draws) -> Vec<u8> {
    let mut text = WHOLE.to_owned();
    for _ in 0..=draws.below(3) {
        match draws.below(12) {
            // Any bytes.
            0 => {
                let mut bytes = text.into_bytes();
                let at = draws.below(bytes.len());
                let end = (at + 1 + draws.below(5)).min(bytes.len());
                match draws.below(3) {
                    0 => bytes[at] ^= 1 << draws.below(8),
                    1 => drop(bytes.drain(at..end)),
                    _ => bytes.truncate(at.max(1)),
                }
                match String::from_utf8(bytes) {
                    Ok(whole) => text = whole,
                    Err(broken) => return broken.into_bytes(),
                }
            }
            // An element goes, comes again, or into another.
            1..=4 => {
                let found = elements(&text);
                if found.is_empty() {
                    continue;
                }
                let mut lines: Vec<&str> = text.lines().collect();
                let (from, to) = found[draws.below(found.len())];
                let moved: Vec<&str> = lines[from..to].to_vec();
                match draws.below(3) {
                    0 => drop(lines.drain(from..to)),
                    1 => drop(lines.splice(from..from, moved)),
                    _ => {
                        let (elsewhere, _) = found[draws.below(found.len())];
                        lines.splice(elsewhere..elsewhere, moved);
                    }
                }
                text = lines.join("\n");
            }
            // A piece goes, or two change places.
            5 => {
                let mut parts = pieces(&text);
                let (one, other) = (draws.below(parts.len()), draws.below(parts.len()));
                if draws.below(2) == 0 {
                    parts.swap(one, other);
                } else {
                    parts.remove(one);
                }
                text = parts.concat();
            }
            // A value becomes another.
            _ => {
                let mut parts = pieces(&text);
                let values: Vec<usize> = (0..parts.len()).filter(|&at| parts[at].starts_with('"')).collect();
                if values.is_empty() {
                    continue;
                }
                let at = values[draws.below(values.len())];
                let other = if draws.below(4) == 0 {
                    parts[values[draws.below(values.len())]].to_owned()
                } else {
                    format!("\"{}\"", VALUES[draws.below(VALUES.len())])
                };
                parts[at] = &other;
                text = parts.concat();
            }
        }
    }
    text.into_bytes()
}

/// All names below a folder.
fn names(folder: &Path) -> BTreeSet<PathBuf> {
    let mut all = BTreeSet::new();
    let mut folders = vec![folder.to_owned()];
    while let Some(folder) = folders.pop() {
        for entry in fs::read_dir(folder).unwrap() {
            let path = entry.unwrap().path();
            if path.is_dir() {
                folders.push(path.clone());
            }
            all.insert(path);
        }
    }
    all
}

fn sesamec(arguments: &[&str]) -> bool {
    let arguments = ["sesamec"].iter().chain(arguments);
    run(Shell::silent(), &SESAME, arguments) == ExitCode::SUCCESS
}

/// Imports that many mutations; how many of them were imported.
fn imports(seed: u64, count: usize) -> usize {
    let folder = tempfile::tempdir().unwrap();
    let (file, out) = (folder.path().join("arm.model"), folder.path().join("out"));
    let mut draws = Draws(seed);
    let mut whole = 0;
    for number in 0..count {
        let bytes = mutated(&mut draws);
        fs::write(&file, &bytes).unwrap();
        // What is not there, or empty, is both a folder for an import.
        let empty = number % 2 == 0;
        if empty {
            fs::create_dir(&out).unwrap();
        }
        let before = names(folder.path());
        let start = Instant::now();
        let done = catch_unwind(AssertUnwindSafe(|| {
            sesamec(&["import", file.to_str().unwrap(), "-o", out.to_str().unwrap()])
        }));
        let shown = || format!("mutation {number} of seed {seed}:\n{}", String::from_utf8_lossy(&bytes));
        let done = done.unwrap_or_else(|_| panic!("a panic, {}", shown()));
        assert!(start.elapsed() < MAX_TIME, "{:?}, {}", start.elapsed(), shown());
        assert!(fs::read(&file).unwrap() == bytes, "the file was changed, {}", shown());
        if done {
            whole += 1;
            let (space, results) = (out.join("arm.sesame"), out.join("results"));
            let space = space.to_str().unwrap();
            assert!(sesamec(&["check", space]), "what was written has errors, {}", shown());
            assert!(sesamec(&["fmt", "--check", space]), "what was written is not formatted, {}", shown());
            for campaign in fs::read_dir(&results).into_iter().flatten() {
                let repository = Repository::open(&campaign.unwrap().path());
                let tests = repository.and_then(|repository| repository.tests());
                assert!(tests.is_ok_and(|tests| !tests.is_empty()), "{}", shown());
            }
            let new = names(folder.path());
            assert!(new.iter().all(|path| before.contains(path) || path.starts_with(&out)), "{new:?}, {}", shown());
            fs::remove_dir_all(&out).unwrap();
        } else {
            assert_eq!(names(folder.path()), before, "something was written, {}", shown());
            if empty {
                fs::remove_dir(&out).unwrap();
            }
        }
    }
    whole
}

#[test]
fn a_changed_file_is_imported_whole_or_nothing_is_written() {
    let whole = imports(1, 150);
    assert!((50..150).contains(&whole), "{whole} of 150 were imported: there is little to learn from such mutations");
}

#[test]
#[ignore = "long: imports ten thousand files"]
fn ten_thousand_mutations_are_imported_whole_or_refused_without_a_trace() {
    let whole = imports(2, 10_000);
    println!("{whole} of 10000 mutations were imported, the others refused");
    assert!((2_000..10_000).contains(&whole), "{whole}");
}

#[test]
fn what_is_not_mutated_is_imported() {
    let folder = tempfile::tempdir().unwrap();
    let (file, out) = (folder.path().join("arm.model"), folder.path().join("out"));
    fs::write(&file, WHOLE).unwrap();
    assert!(sesamec(&["import", file.to_str().unwrap(), "-o", out.to_str().unwrap()]));
    assert!(sesamec(&["fmt", "--check", out.join("arm.sesame").to_str().unwrap()]));
    for campaign in ["first_campaign", "by_condition", "copies"] {
        assert!(out.join("results").join(campaign).join("results.sqlite").is_file(), "{campaign}");
    }
    let text = fs::read_to_string(out.join("arm.sesame")).unwrap();
    // A campaign of 8 s repeats the test too, in which other operations begin later.
    assert!(text.contains("push offset [-0.15, 0.15] from 6s to 18s"), "{text}");
    assert!(!text.contains("lose loss 50% from"), "{text}");
}

/// A file whose import takes a while: the first performed test is there so many times.
fn large(times: usize) -> String {
    let (before, test) = WHOLE.split_once("    <performedTests ").unwrap();
    let (test, after) = test.split_once("</performedTests>\n").unwrap();
    let tests = format!("    <performedTests {test}</performedTests>\n").repeat(times);
    [before, &tests, after].concat()
}

#[test]
fn an_import_that_is_killed_leaves_nothing_half_imported() {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("arm.model");
    fs::write(&file, large(150)).unwrap();
    let import = |out: &Path| {
        let mut command = Command::new(env!("CARGO_BIN_EXE_sesamec"));
        command.args(["import".as_ref(), file.as_os_str(), "-o".as_ref(), out.as_os_str()]);
        command.stdin(Stdio::null()).stdout(Stdio::null()).stderr(Stdio::null());
        command
    };
    let begun = Instant::now();
    let whole = folder.path().join("whole");
    assert!(import(&whole).status().unwrap().success());
    let (all, mut takes) = (names(&whole).len(), begun.elapsed());
    let (mut killed, mut tries) = (0, 0);
    while killed < 6 {
        let out = folder.path().join("out");
        let there = tries % 2 == 0;
        if there {
            fs::create_dir(&out).unwrap();
        }
        let mut import = import(&out).spawn().unwrap();
        std::thread::sleep(takes * killed / 7);
        import.kill().unwrap();
        tries += 1;
        if import.wait().unwrap().success() {
            // The kill came too late: the machine was busier when the time was taken. The next one comes earlier.
            takes /= 2;
        } else {
            killed += 1;
        }
        // All of it, or nothing that could be taken for a space or for results.
        let found = if out.exists() { names(&out) } else { BTreeSet::new() };
        let hidden = out.join(".sesamec-import");
        let seen = found.iter().filter(|path| !path.starts_with(&hidden)).count();
        assert!(seen == 0 || seen == all, "{found:?}");
        // The next import into the folder is as the first.
        if seen == 0 {
            assert!(sesamec(&["import", file.to_str().unwrap(), "-o", out.to_str().unwrap()]));
            assert_eq!(names(&out).len(), all);
        }
        fs::remove_dir_all(&out).unwrap();
    }
    println!("{killed} of {tries} were killed before they were done");
    let left: Vec<_> = fs::read_dir(folder.path()).unwrap().map(|entry| entry.unwrap().file_name()).collect();
    assert_eq!(left.len(), 2, "{left:?}");
}
