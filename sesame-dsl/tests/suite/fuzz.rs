//! A search for texts that the front end cannot take: panics, hangs, time or memory beyond what a text of its size may
//! cost.
//!
//! Files of the corpus are mutated, by words and by bytes. What gives an answer of a kind that was not seen before is
//! kept and mutated further, so the search gets ever deeper into the language. It runs in a process of its own with a
//! limit of memory, which says what it is at before it tries it: so the text that ended it is always known.
//!
//! `SESAME_FUZZ_MINUTES` says how long (1 if not said), `SESAME_FUZZ_SEED` which mutations, `SESAME_FUZZ_KEEP` a folder
//! for what is kept: all of it in `kept`, in `worth_keeping` what would make the corpus better.

use std::collections::BTreeSet;
use std::hash::{DefaultHasher, Hasher as _};
use std::path::{Path, PathBuf};
use std::process::Command;
use std::time::{Duration, Instant};

use crate::sound::has_a_sound_answer;
use sesame_dsl::Analysis;

/// Most a text grows to.
const MAX_BYTES: usize = 12_000;
/// Longest that a text of [`MAX_BYTES`] may take, on a machine with much else to do; usual is a hundredth of it.
const MAX_TIME: Duration = Duration::from_secs(60);
/// Memory of the whole process, all kept texts included.
const MAX_MEMORY_KIB: u64 = 1 << 20;

/// Folders of texts to begin with. `fuzzed` holds what earlier searches kept.
const CORPUS: [&str; 4] = ["good", "bad", "format", "fuzzed"];

/// Words and signs that mean something somewhere, besides those of the corpus.
const WORDS: &[&str] = &[
    "{",
    "}",
    "[",
    "]",
    "(",
    ")",
    "\"",
    "\\",
    "//",
    "///",
    "=",
    "==",
    "<=",
    "!=",
    "..",
    ".",
    ",",
    ":",
    "-",
    "- ",
    "*",
    "/",
    "%",
    "0",
    "-0",
    "1e999",
    "1e-999",
    "18446744073709551616",
    "0.1rad",
    "5ms",
    "1m/s^2",
    "m^-99999999999",
    "ü",
    "µs",
    "\u{FEFF}",
    "\r",
    "\r\n",
    "\u{2028}",
    "\u{0}",
    "\u{202e}",
    "🤖",
    "e\u{301}",
    "\t",
    "\"a{b,c}\"",
    "\"{a,}\"",
    "\"\\\"\"",
    "not",
    "(1, 2, 3)m",
    "list of",
    "_",
    "r#type",
];

/// Numbers from a seed (`SplitMix64`).
struct Draws(u64);

impl Draws {
    fn bits(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9E37_79B9_7F4A_7C15);
        let mut x = self.0;
        x = (x ^ (x >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
        x = (x ^ (x >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
        x ^ (x >> 31)
    }

    fn below(&mut self, n: usize) -> usize {
        usize::try_from(self.bits() % u64::try_from(n.max(1)).expect("64 bits")).expect("below n")
    }

    fn one<'a>(&mut self, of: &'a [String]) -> &'a str {
        &of[self.below(of.len())]
    }
}

#[expect(clippy::disallowed_methods, reason = "the crate is pure; its tests read their corpus")]
fn texts_in(folder: &Path) -> Vec<String> {
    let Ok(entries) = std::fs::read_dir(folder) else { return Vec::new() };
    let mut files: Vec<PathBuf> = entries.map(|entry| entry.expect("the corpus can be listed").path()).collect();
    files.sort();
    files.iter().map(|file| std::fs::read_to_string(file).expect("the corpus is text")).collect()
}

fn corpus() -> Vec<String> {
    let tests = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests");
    CORPUS.iter().flat_map(|folder| texts_in(&tests.join(folder))).collect()
}

/// The pieces of a text: words, numbers with their units, signs, spaces, and whole quoted texts.
fn pieces(text: &str) -> Vec<&str> {
    let mut pieces = Vec::new();
    let mut rest = text;
    while let Some(first) = rest.chars().next() {
        let word = |c: char| c.is_alphanumeric() || c == '_';
        let length = if word(first) {
            rest.find(|c| !word(c)).unwrap_or(rest.len())
        } else if first == '"' {
            rest[1..].find(['"', '\n']).map_or(1, |end| end + 2)
        } else if first.is_whitespace() {
            rest.find(|c: char| !c.is_whitespace()).unwrap_or(rest.len())
        } else {
            first.len_utf8()
        };
        let (piece, after) = rest.split_at(length);
        pieces.push(piece);
        rest = after;
    }
    pieces
}

/// A text made of a kept one, and sometimes of another.
fn mutated(draws: &mut Draws, kept: &[String], words: &[String]) -> String {
    // The shorter one of two: short texts are tried faster.
    let mut text = std::cmp::min_by_key(draws.one(kept), draws.one(kept), |text| text.len()).to_owned();
    for _ in 0..=draws.below(6) {
        let mut parts: Vec<&str> = pieces(&text);
        let at = draws.below(parts.len() + 1);
        let longest = if draws.below(4) == 0 { 60 } else { 5 };
        let some = 1 + draws.below(longest);
        let end = (at + some).min(parts.len());
        let other;
        match draws.below(10) {
            0 => drop(parts.drain(at..end)),
            1 | 2 => parts.insert(at, draws.one(words)),
            3 | 4 if at < parts.len() => parts[at] = draws.one(words),
            5 => {
                let stretch = parts[at..end].repeat(1 + draws.below(3));
                parts.splice(at..at, stretch);
            }
            // The same again and again: what costs more than its length shows here.
            6 if draws.below(8) == 0 => {
                let stretch = parts[at..end].repeat(1 + draws.below(400));
                parts.splice(at..at, stretch);
            }
            7 if at < parts.len() => {
                let with = draws.below(parts.len());
                parts.swap(at, with);
            }
            8 => {
                other = draws.one(kept);
                let others = pieces(other);
                let from = draws.below(others.len() + 1);
                let to = (from + 1 + draws.below(60)).min(others.len());
                parts.splice(at..end, others[from..to].iter().copied());
            }
            _ => {
                let mut bytes = parts.concat().into_bytes();
                let place = draws.below(bytes.len() + 1);
                match bytes.get_mut(place) {
                    Some(byte) => *byte ^= 1 << draws.below(8),
                    None => bytes.push(b'{'),
                }
                text = String::from_utf8_lossy(&bytes).into_owned();
                continue;
            }
        }
        text = parts.concat();
    }
    let mut end = text.len().min(MAX_BYTES);
    while !text.is_char_boundary(end) {
        end -= 1;
    }
    text.truncate(end);
    text
}

/// A message without what it quotes.
fn without_quotes(message: &str) -> String {
    message.split('`').step_by(2).collect::<String>().chars().filter(|c| !c.is_ascii_digit()).collect()
}

fn hash(of: impl std::hash::Hash) -> u64 {
    let mut hasher = DefaultHasher::new();
    of.hash(&mut hasher);
    hasher.finish()
}

/// The kinds of an answer: each mistake with what was said of it, what two were met in a row, what a model holds.
fn kinds(analysis: &Analysis) -> BTreeSet<u64> {
    let mut kinds = BTreeSet::new();
    let mut before = 0;
    for found in &analysis.diagnostics {
        let shape = (found.suggestions.len(), found.secondary.len(), found.notes.len());
        let kind = hash((found.code.text(), without_quotes(&found.title), without_quotes(&found.label), shape));
        kinds.extend([kind, hash((before, found.code.text()))]);
        before = hash(found.code.text());
    }
    if let Some(model) = &analysis.model {
        let model = format!("{model:?}");
        let words: Vec<&str> = model.split(|c: char| !c.is_ascii_alphabetic()).filter(|word| word.len() > 2).collect();
        kinds.extend(words.windows(2).map(hash));
    }
    kinds
}

/// What a text costs and gives; the suggestions of its first mistakes are tried as well.
fn tried(text: &str) -> BTreeSet<u64> {
    let (file, analysis) = has_a_sound_answer(text);
    let suggestions = analysis.diagnostics.iter().take(3).flat_map(|found| &found.suggestions);
    // An imported file may have mistakes too; a suggestion for those does not change this text.
    for suggestion in suggestions.filter(|suggestion| suggestion.edits.iter().all(|(span, _)| span.file == file)) {
        let mut edits = suggestion.edits.clone();
        edits.sort_by_key(|(span, _)| std::cmp::Reverse(span.lo));
        let mut mended = text.to_owned();
        for (span, replacement) in &edits {
            mended.replace_range(span.range(), replacement);
        }
        has_a_sound_answer(&mended);
    }
    kinds(&analysis)
}

#[expect(clippy::disallowed_methods, reason = "the crate is pure; its tests are told how long to search")]
fn told(name: &str) -> Option<String> {
    std::env::var(name).ok()
}

#[test]
fn what_earlier_searches_kept_has_a_sound_answer() {
    for text in corpus() {
        tried(&text);
    }
}

#[test]
fn mutations_of_the_corpus_have_a_sound_answer() {
    let kept = corpus();
    let words: Vec<String> = WORDS.iter().map(|&word| word.to_owned()).collect();
    let mut draws = Draws(1);
    for _ in 0..200 {
        tried(&mutated(&mut draws, &kept, &words));
    }
}

/// The search itself, in the process that [`no_text_is_too_much_for_the_front_end`] starts.
#[test]
#[ignore = "long: started by the search"]
#[expect(clippy::disallowed_methods, reason = "the crate is pure; its tests keep texts, and time it")]
fn search() {
    let Some(keep) = told("SESAME_FUZZ_KEEP").map(PathBuf::from) else { return };
    let minutes: f64 = told("SESAME_FUZZ_MINUTES").map_or(1.0, |minutes| minutes.parse().expect("a number of minutes"));
    let seed = told("SESAME_FUZZ_SEED").map_or(1, |seed| seed.parse().expect("a whole number"));
    let mut kept = corpus();
    kept.extend(texts_in(&keep.join("kept")));
    let mut words: Vec<String> = WORDS.iter().map(|&word| word.to_owned()).collect();
    let known: BTreeSet<&str> = kept.iter().flat_map(|text| pieces(text)).filter(|piece| piece.len() < 40).collect();
    words.extend(known.into_iter().map(str::to_owned));
    let mut slowest = Duration::ZERO;
    let mut attempt = |text: &str| {
        std::fs::write(keep.join("trying.sesame"), text).expect("there is room for a text");
        let before = Instant::now();
        let kinds = tried(text);
        slowest = slowest.max(before.elapsed());
        assert!(before.elapsed() < MAX_TIME, "{:?} for {} bytes", before.elapsed(), text.len());
        (kinds, slowest)
    };
    let mut seen: BTreeSet<u64> = kept.iter().flat_map(|text| attempt(text).0).collect();
    let mut draws = Draws(seed);
    let (start, mut tries) = (Instant::now(), 0u64);
    let mut said = start;
    while start.elapsed().as_secs_f64() < 60.0 * minutes {
        let text = mutated(&mut draws, &kept, &words);
        let (kinds, slowest) = attempt(&text);
        tries += 1;
        if kinds.iter().any(|kind| !seen.contains(kind)) {
            seen.extend(kinds);
            std::fs::write(keep.join("kept").join(format!("{:016x}.sesame", hash(&text))), &text)
                .expect("there is room for a text");
            kept.push(text);
        }
        if said.elapsed() > Duration::from_secs(60) {
            println!("{tries} texts, {} kinds of answers, slowest {slowest:?}", seen.len());
            said = Instant::now();
        }
    }
    println!("{tries} texts, {} kinds of answers, {} kept", seen.len(), kept.len());
    // What is worth a place in the corpus: short texts that give several kinds of answers which no shorter one gives.
    let folder = keep.join("worth_keeping");
    std::fs::create_dir_all(&folder).expect("there is room for a folder");
    let mut given: BTreeSet<u64> = corpus().iter().flat_map(|text| attempt(text).0).collect();
    kept.sort_by_key(String::len);
    for text in kept.iter().filter(|text| text.len() < 2_000) {
        let kinds = attempt(text).0;
        if kinds.difference(&given).count() >= 12 {
            given.extend(kinds);
            std::fs::write(folder.join(format!("{:016x}.sesame", hash(text))), text).expect("there is room for a text");
        }
    }
}

/// Ends of the process are told apart by whether it says so itself: a panic does, a stack or memory that ran out does
/// not; a hang is ended here.
#[test]
#[ignore = "long: searches for as long as SESAME_FUZZ_MINUTES says"]
#[expect(clippy::disallowed_methods, reason = "the crate is pure; its tests keep texts, and time it")]
fn no_text_is_too_much_for_the_front_end() {
    let keep =
        told("SESAME_FUZZ_KEEP").map_or_else(|| Path::new(env!("CARGO_TARGET_TMPDIR")).join("fuzz"), PathBuf::from);
    std::fs::create_dir_all(keep.join("kept")).expect("there is room for a folder");
    let trying = keep.join("trying.sesame");
    std::fs::write(&trying, "").expect("there is room for a text");
    let program = std::env::current_exe().expect("a test has a program");
    // A limit of memory is the shell's to set: doing it here would need code that Rust calls unsafe.
    let mut child = Command::new("sh")
        .args(["-c", &format!("ulimit -v {MAX_MEMORY_KIB}; exec \"$@\""), "sh"])
        .arg(&program)
        .args(["--exact", "fuzz::search", "--ignored", "--nocapture"])
        .env("SESAME_FUZZ_KEEP", &keep)
        .spawn()
        .expect("there is a shell");
    let status = loop {
        if let Some(status) = child.try_wait().expect("a process that started can be waited for") {
            break status;
        }
        let since = trying.metadata().and_then(|text| text.modified()).ok().and_then(|at| at.elapsed().ok());
        if since.is_some_and(|since| since > 3 * MAX_TIME) {
            child.kill().expect("a process of ours can be ended");
        }
        std::thread::sleep(Duration::from_millis(200));
    };
    assert!(status.success(), "{status}: the front end could not take {}", trying.display());
}
