//! The pages of `sesamec explain` against the compiler: the wrong example of a page gives its code and no other, the
//! right one gives nothing.
//!
//! An example with a `space` is a whole file, one that begins with a declaration of a system stands inside the system
//! of [`STANDARD`], and any other stands after it.

use sesame_dsl::diagnostic::{CODES, render};
use sesame_dsl::source::SourceMap;
use sesame_dsl::{analyse, load_imports};

/// What the examples of all pages may refer to.
const STANDARD: &str = r#"space cell
system {
  simulator cell_sim = in_process "sim::Cell" { crate "sim"  step 20ms }
  message Zone { zone: text  level: real[mm]  closed: bool }
  topic link0 = "joints/link0"  : real[rad]
  topic link1 = "joints/link1"  : real[rad]
  topic speed = "cell/speed"    : real[m/s]
  topic zones = "zones/{Z1,Z2}" : Zone
  topic place = "base/place"    : point[m]
  topic places = "places/{A,B}" : point[m]
}
metric time minimise = fuzzing_time()
metric farthest      = max(link1)
metric peak_speed    = max(speed)
metric clearance     = min(zones.level)
metric nearest       = min(distance(place, each of places))
operation jitter on link0 = random offset [-0.3rad, 0.3rad] within [0s, 65s]
operation lose   on link0 = packet loss [0%, 50%] within [0s, 65s]
test known { jitter offset [0.1rad, 0.2rad] from 8s to 57s }
campaign base {
  objectives time  observes farthest, peak_speed, clearance, nearest
  operations jitter, lose 1..5 per test
  search     nsga2 { population 10  evaluations 200 }
  end        after 70s
}
"#;

/// What an example may leave to its reader: an operation, a metric or a campaign that uses it.
const LEFT_OUT: [&str; 3] = ["W0002", "W0004", "W0011"];

/// The file that an example stands in.
fn file_of(example: &str) -> String {
    let first = example.split_whitespace().next().expect("an example has words");
    if example.lines().any(|line| line.starts_with("space ") || line.starts_with("system ")) {
        return example.to_owned();
    }
    if ["message", "topic", "node"].contains(&first) {
        return STANDARD.replacen("system {\n", &format!("system {{\n{example}\n"), 1);
    }
    format!("{STANDARD}{example}")
}

/// The codes that an example gives, without repetition, and the diagnostics as text.
fn codes(example: &str) -> (Vec<&'static str>, String) {
    let mut sources = SourceMap::new();
    let file = sources.add("example.sesame", file_of(example));
    load_imports(&mut sources, file, |name| match name {
        "cell.sesame" => Ok("metric highest = max(link0)".to_owned()),
        _ => Err("there is no such file".to_owned()),
    });
    let analysis = analyse(&sources, file);
    let mut codes: Vec<&str> = analysis.diagnostics.iter().map(|found| found.code.text()).collect();
    codes.sort_unstable();
    codes.dedup();
    (codes, render::human(&analysis.diagnostics, &sources, false))
}

/// The wrong examples of all pages as files, with their codes.
pub(crate) fn wrong_examples() -> impl Iterator<Item = (String, String)> {
    CODES.iter().map(|(code, page)| (format!("page of {code}"), file_of(example(page, "Wrong"))))
}

/// The example of a page after a line such as `Wrong:`.
fn example<'a>(page: &'a str, heading: &str) -> &'a str {
    let (_, after) = page.split_once(&format!("\n{heading}:\n\n```sesame\n")).expect("each page has both examples");
    after.split_once("\n```\n").expect("an example ends").0
}

#[test]
fn the_wrong_example_of_a_page_gives_its_code_and_the_right_one_nothing() {
    let mut failures: Vec<String> = Vec::new();
    for (code, page) in CODES {
        let others = |found: &Vec<&'static str>| {
            found.iter().copied().filter(|other| *other != code.text() && !LEFT_OUT.contains(other)).collect::<Vec<_>>()
        };
        let (found, said) = codes(example(page, "Wrong"));
        if !found.contains(&code.text()) || !others(&found).is_empty() {
            failures.push(format!("--- {code}, wrong: {found:?}\n{said}"));
        }
        let (found, said) = codes(example(page, "Right"));
        if found.contains(&code.text()) || !others(&found).is_empty() {
            failures.push(format!("--- {code}, right: {found:?}\n{said}"));
        }
    }
    assert!(failures.is_empty(), "{}", failures.join("\n"));
}
