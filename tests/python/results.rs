//! Results in programs and notebooks: as frames of pandas and polars, as tests that run again, and as figures.

use std::fs;
use std::path::PathBuf;

use rusqlite::Connection;
use sesame_patience::until;
use sesame_peers::{Ended, named};
use sesame_tests::{command, done, sesamec, workspace};

use crate::package::{CART, Place};

/// A place whose campaign has a metric of each kind, and a Python with what users have beside the package.
fn place(name: &str) -> Option<(Place, PathBuf)> {
    let python = named("SESAME_PYTHON_PEERS")?;
    let place = Place::new(name, CART)?;
    place.change_space(
        "/// How long operations were active",
        "metric margin default 10m = robustness(always clearance > 0.5m)\n/// How long operations were active",
    );
    place.change_space("observes   too_close", "observes   too_close, margin");
    Some((place, python))
}

/// What checks in Python begin with: a run with the class, and how the program prints an analysis.
const RUN: &str = r#"
import json, math, os, sqlite3, subprocess, sesamec
from sim import World

run = sesamec.run("cart/cart.sesame", simulator=World, evaluations=40)

def printed(*command):
    command = [os.environ["SESAMEC"], *command, "--format", "json"]
    return json.loads(subprocess.run(command, stdout=subprocess.PIPE, check=True).stdout)
"#;

#[test]
fn frames_hold_what_the_program_prints() {
    let Some((place, python)) = place("python_frames") else { return };
    let program = RUN.to_owned()
        + r#"
import pandas, polars

def missing(value):
    return value is None or value is pandas.NA or isinstance(value, float) and math.isnan(value)

def same(frame, rows):
    "Every column that is printed, value by value."
    assert len(frame) == len(rows) > 0, (len(frame), len(rows))
    for row, expected in zip(frame, rows):
        for column, value in expected.items():
            assert row[column] == value or value is None and missing(row[column]), (column, row, expected)

for analysis in ("front", "causes", "indicators", "tests"):
    expected = printed("results", analysis, str(run.folder))
    table = getattr(run, analysis)
    same(table("records"), expected)
    pandas_frame, polars_frame = table(), table("polars")
    assert isinstance(pandas_frame, pandas.DataFrame) and isinstance(polars_frame, polars.DataFrame)
    same(pandas_frame.reset_index().to_dict("records"), expected)
    same(polars_frame.to_dicts(), expected)
assert run.front().index.name == run.tests().index.name == "test"
assert run.tests().loc[run.front().index, "operations"].notna().all()
assert run.tests().attrs["units"] == {"closest": "m", "too_close": "s", "margin": "m", "fuzzing_time": "s"}
assert list(run.tests().dtypes[["generation", "closest"]]) == ["int64", "float64"]
assert run.tests("polars").schema["closest"] == polars.Float64

for row, requirement in zip(run.requirements("records"), run.summary["requirements"], strict=True):
    for column in ("requirement", "text", "metric", "violated", "satisfied", "inconclusive"):
        assert row[column] == requirement[column], column
assert (row["low"], row["low_excluded"], row["high"]) == (0.5, False, None)

shown = printed("show", "cart/cart.sesame", "T2")
test = run["T2"]
assert (test.outcome, test.end_s, test.messages) == (shown["outcome"], shown["end"], shown["messages"])
assert test.simulator_seed == shown["simulator_seed"]
assert test.metrics == {metric["metric"]: metric["value"] for metric in shown["metrics"]}
assert list(test.objectives) == ["fuzzing_time", "closest"]
assert test.verdicts == {verdict["requirement"]: verdict["verdict"] for verdict in shown["requirements"]}
for operation, said in zip(test.operations, shown["operations"], strict=True):
    assert operation.operation == said["operation"] and operation.seed == said["operation_seed"]
    assert operation.active == tuple((span["start"], span["end"]) for span in said["observed"])
    assert operation.effects == said["counters"]
    for choice in said["choices"]:
        kind = choice["choice"]
        value = kind["value"] if "value" in kind else (kind["low"], kind["high"])
        assert operation.choices[choice["parameter"]] == value, said
assert run.digest == printed("digest", "cart/cart.sesame")["digest"] == sesamec.open_run(run.folder).digest
opened = sesamec.open_run("cart/cart.sesame")
assert opened.folder == run.folder and opened.space == run.space
# The page is written anew only where it is asked for.
written = os.stat(run.summary["report"]).st_mtime_ns
assert opened.summary == run.summary and os.stat(run.summary["report"]).st_mtime_ns == written
assert len(run) == 40 and len(list(run)) == 40 and "T40" in run and "T99" not in run
try:
    run["T99"]
except KeyError as error:
    assert "has no test T99" in str(error)
else:
    raise AssertionError("there is no such test")
"#;
    done(&mut place.script(python, &program)).expect(0);
}

#[test]
fn series_are_decoded_as_the_view_of_the_database_decodes_them() {
    let Some((place, python)) = place("python_series") else { return };
    let program = RUN.to_owned()
        + r#"
database = sqlite3.connect(f"file:{run.path}?mode=ro", uri=True)

def viewed(view, test, metric):
    sql = f"SELECT time_s, value FROM {view} WHERE test_name = ? AND metric = ? ORDER BY position"
    return database.execute(sql, (test, metric)).fetchall()

points = 0
for metric in run.metrics:
    decoded = {}
    for row in run.series(metric, frame="records"):
        decoded.setdefault(row["test"], []).append((row["time_s"], row["value"]))
    for test in ("T0", *run.tests().index):
        assert viewed("series", test, metric) == decoded.get(test, []), (test, metric)
        points += len(decoded.get(test, []))
assert points > 1000, points

robust = run["T2"].robustness("margin", "records")
assert [(row["time_s"], row["margin"]) for row in robust] == viewed("robustness", "T2", "margin") != []
assert run["T2"].robustness("closest", "records") == []
closest = run["T2"].series("closest")
assert list(closest.columns) == ["time_s", "closest"] and closest.attrs["units"] == {"time_s": "s", "closest": "m"}
assert closest["closest"].iloc[-1] == run["T2"].metrics["closest"]
assert list(run.series("closest", ["T2", "T1"]).index.unique()) == ["T2", "T1"]
for wrong in (lambda: run.series("closet"), lambda: run.series("closest", ["T77"])):
    try:
        wrong()
    except KeyError as error:
        assert "closet" in str(error) or "T77" in str(error), error
    else:
        raise AssertionError("there is no such series")
"#;
    done(&mut place.script(python, &program)).expect(0);
}

#[test]
fn results_of_the_version_before_have_the_values_that_the_program_prints() {
    let Some((place, python)) = place("python_earlier_results") else { return };
    let earlier = workspace().join("runtime/results/record/src/fixtures/results_of_schema_7.sql");
    fs::create_dir(place.folder.join("earlier")).unwrap();
    let made = Connection::open(place.folder.join("earlier/results.sqlite")).unwrap();
    made.execute_batch(&fs::read_to_string(earlier).unwrap()).unwrap();
    drop(made);
    let program = r#"
import json, os, sqlite3, subprocess, sesamec
run = sesamec.open_run("earlier")
for analysis in ("front", "causes", "tests", "indicators"):
    command = [os.environ["SESAMEC"], "results", analysis, "earlier", "--format", "json"]
    expected = json.loads(subprocess.run(command, stdout=subprocess.PIPE, check=True).stdout)
    for row, printed in zip(getattr(run, analysis)("records"), expected, strict=True):
        assert row | printed == row, (row, printed)
database = sqlite3.connect("file:earlier/results.sqlite?mode=ro", uri=True)
count = 0
for test in ("T0", *run.tests().index):
    for metric in run.metrics:
        sql = "SELECT time_s, value FROM series WHERE test_name = ? AND metric = ? ORDER BY position"
        points = database.execute(sql, (test, metric)).fetchall()
        assert [tuple(row.values()) for row in run[test].series(metric, "records")] == points, (test, metric)
        count += len(points)
assert count > 100, count
"#;
    done(&mut place.script(python, program)).expect(0);
}

#[test]
fn without_pandas_a_table_is_a_frame_of_polars_and_without_both_a_list() {
    let Some((place, python)) = place("python_frames_without") else { return };
    let program = RUN.to_owned()
        + r#"
import sys
import polars
sys.modules["pandas"] = None
assert isinstance(run.tests(), polars.DataFrame)
sys.modules["polars"] = None
assert run.tests() == run.tests("records") and isinstance(run.tests()[0], dict)
try:
    run.tests("csv")
except ValueError as error:
    assert "csv" in str(error)
"#;
    done(&mut place.script(python, &program)).expect(0);
}

#[test]
fn a_test_shrinks_replays_and_becomes_a_test_block_with_the_class_as_with_a_program() {
    let Some(place) = Place::new("python_again", CART) else { return };
    let program = r#"
import sesamec
from sim import World

def again(simulator, results):
    run = sesamec.run("cart/cart.sesame", simulator=simulator, results=results)
    violates = next(test for test in run if test.violates == ["R1"] and len(test.operations) > 1)
    small = violates.shrink("--into", results)
    assert violates.replay() == {**violates.replay(), "same": True, "differences": []}
    assert small.violates == ["R1"] and len(small.operations) <= len(violates.operations)
    assert small.run.folder.parent == run.folder.parent and small.run.summary["shrinking"]["minimal"]
    return run.digest, violates.name, small.name, small.run.digest, violates.export(), small.replay()["same"]

with_class, as_program = again(World, "class"), again(None, "program")
assert with_class == as_program, (with_class, as_program)

# In this process: where the class is, and nowhere else.
class Broken(World):
    def step(self, bus):
        raise RuntimeError("this class is used")
run = sesamec.open_run("class/1", space="cart/cart.sesame", simulator=Broken)
replay = run["T1"].replay()
assert not replay["same"] and "this class is used" in str(replay), replay

block = run["T1"].export("kept", pin=True, into="cart/cart.sesame")
assert open("cart/cart.sesame").read().endswith("\n" + block) and "test kept {" in block and "expect closest ==" in block
"#;
    done(&mut place.python(program)).expect(0);
}

#[test]
fn results_can_be_read_while_a_campaign_runs_and_nothing_is_written() {
    let slow =
        CART.replace("        self.speed +=", "        __import__(\"time\").sleep(0.0005)\n        self.speed +=");
    let Some(place) = Place::new("python_read_meanwhile", &slow) else { return };
    let program = "import sesamec\nfrom sim import World\n\
                   sesamec.run('cart/cart.sesame', simulator=World, results='results', evaluations=30)\n";
    let mut running = Ended(place.python(program).spawn().unwrap());
    let database = place.folder.join("results/1/results.sqlite");
    let tests = || {
        let open = Connection::open_with_flags(&database, rusqlite::OpenFlags::SQLITE_OPEN_READ_ONLY).ok()?;
        open.query_row("SELECT count(*) FROM tests", [], |row| row.get::<_, u32>(0)).ok()
    };
    until("some tests are recorded", || tests().is_some_and(|tests| tests > 5));
    let reading = "import sesamec\nrun = sesamec.open_run('results/1')\n\
                   assert run.stop is None and len(run) > 3 and 'unfinished' in repr(run), repr(run)\n\
                   assert run.tests('records')[0]['test'] == 'T1' and run['T1'].series('closest', 'records')\n";
    place.write("reading.py", reading);
    done(place.with_package("python3").arg("reading.py")).expect(0);
    assert!(running.0.wait().unwrap().success());
    let before = fs::read(&database).unwrap();
    let reading = reading.replace("is None and", "is not None and").replace("'unfinished' in", "'unfinished' not in");
    place.write("reading.py", &reading);
    done(place.with_package("python3").arg("reading.py")).expect(0);
    assert_eq!(fs::read(&database).unwrap(), before);
    let files = fs::read_dir(place.folder.join("results/1")).unwrap().count();
    assert_eq!(files, 4, "database, lock, page and workers, as the run left them");
}

#[test]
fn what_is_not_a_readable_results_file_is_refused_with_a_sentence() {
    let Some(place) = Place::new("python_refused", CART) else { return };
    place.run("", "results='results', evaluations=4").expect(0);
    fs::write(place.folder.join("notes.sqlite"), "notes").unwrap();
    Connection::open(place.folder.join("other.sqlite")).unwrap().execute_batch("CREATE TABLE a (b)").unwrap();
    for (copy, version) in [("newer", 99), ("older", 3)] {
        let copy = place.folder.join(copy);
        fs::create_dir(&copy).unwrap();
        fs::copy(place.folder.join("results/1/results.sqlite"), copy.join("results.sqlite")).unwrap();
        Connection::open(copy.join("results.sqlite")).unwrap().pragma_update(None, "user_version", version).unwrap();
    }
    let program = r#"
import sesamec
for path, words in {
    "newer": "has version 99 of the format, and 7 and 8 are read here; a newer sesamec has written it",
    "older": "has version 3 of the format, and 7 and 8 are read here; it is too old",
    "notes.sqlite": "is not a readable results file: file is not a database",
    "other.sqlite": "is not a results file of Sesame",
    "cart": "it has no results.sqlite",
    "cart/cart.sesame": "cart.sesame has no results yet; `sesamec run cart/cart.sesame` makes some",
}.items():
    try:
        sesamec.open_run(path)
    except sesamec.NotResults as error:
        assert words in str(error), (path, error)
    else:
        raise AssertionError(path)
moved = sesamec.open_run("results/1")
assert moved["T1"].metrics["closest"] is not None
try:
    moved["T1"].replay()
except FileNotFoundError as error:
    assert "sesamec.open_run(..., space=" in str(error), error
assert sesamec.open_run("results/1", space="cart/cart.sesame")["T1"].export().startswith("/// T1")
try:
    sesamec.run("cart/nothing.sesame")
except sesamec.Failed as error:
    assert "cannot read cart/nothing.sesame" in str(error) and error.code == 1, error
"#;
    done(&mut place.python(program)).expect(0);
}

#[test]
fn notebooks_show_the_figures_of_the_page() {
    let Some(place) = Place::new("python_figures", CART) else { return };
    let program = r#"
import sesamec, pathlib
from sim import World
run = sesamec.run("cart/cart.sesame", simulator=World, results="results")
pathlib.Path("run.html").write_text(run._repr_html_())
pathlib.Path("test.html").write_text(run["T2"]._repr_html_())
print(repr(run), repr(run["T2"]), sep="\n")
"#;
    let looks = done(&mut place.python(program)).expect(0).out.clone();
    assert!(looks.starts_with("<Run first of cart, seed 1: 80 tests, front of "), "{looks}");
    assert!(looks.contains("<Test T2: completed at 20 s, fuzzing_time 20 s, closest "), "{looks}");
    let read = |file: &str| fs::read_to_string(place.folder.join(file)).unwrap();
    let page = read("results/1/report.html");
    let between = |text: &str, from: &str, to: &str| {
        let (_, rest) = text.split_once(from).unwrap_or_else(|| panic!("no {from}"));
        format!("{from}{}{to}", rest.split_once(to).unwrap().0)
    };
    let (run, test) = (read("run.html"), read("test.html"));
    // The timeline of a test, with its tables.
    let timeline = between(&page, "<article class=\"test\" id=\"T2\">", "</figure>");
    assert!(timeline.contains("<svg class=\"plot\"") && test.contains(&timeline));
    // The dots of the front, which lead nowhere here.
    let without_links = page.replace("</a>", "");
    let dots = between(&without_links, "<circle class=\"dot front\"", "</circle>");
    assert!(run.contains(&dots), "{dots}");
    for piece in [&run, &test] {
        let (_, markup) = piece.split_once("</style>").unwrap();
        roxmltree::Document::parse(&format!("<div>{markup}</div>")).unwrap();
        assert!(!piece.contains("<script") && piece.matches("<style>").count() == 1);
        // The style is that of the page, and applies to nothing but the figures.
        let style = between(piece, "<style>", "</style>");
        assert!(style.starts_with("<style>\n.sesame-figures {\n& {") && style.ends_with("}\n</style>"), "{style}");
        assert!(style.contains(".scatter") && !style.contains(":root") && !style.contains("body {"));
    }
}

/// The tables and views of a page: a section each, and the columns of its table.
fn columns_on(page: &str) -> Vec<(String, Vec<String>)> {
    let mut found: Vec<(String, Vec<String>)> = Vec::new();
    for line in page.lines() {
        let name_of =
            |text: &str| text.strip_prefix('`').and_then(|rest| rest.split_once('`')).map(|it| it.0.to_owned());
        if let Some(name) = line.strip_prefix("### ").and_then(name_of) {
            found.push((name, Vec::new()));
        } else if let Some(column) = line.strip_prefix("| ").and_then(name_of)
            && let Some((_, columns)) = found.last_mut()
        {
            columns.push(column);
        }
    }
    found
}

#[test]
fn the_page_on_the_format_has_the_tables_and_columns_of_real_results() {
    let Some(place) = Place::new("python_format", CART) else { return };
    // Tables of monitors are there only if the space has any.
    place.change_space("  node cart ", "  topic guarded = \"cart/guarded\" : bool\n  node cart ");
    place.change_space(
        "/// How close",
        "eddi guard publishes guarded {\n  evidence far = clearance > 1m\n  guarantee fine integrity 1 = far\n  \
         otherwise near\n}\n/// How close",
    );
    place.run("", "results='results', evaluations=4").expect(0);
    let open = Connection::open(place.folder.join("results/1/results.sqlite")).unwrap();
    let page = fs::read_to_string(workspace().join("docs/format.md")).unwrap();
    let text = |sql: &str| -> Vec<String> {
        let mut statement = open.prepare(sql).unwrap();
        statement.query_map([], |row| row.get(0)).unwrap().map(Result::unwrap).collect()
    };
    let version: i64 = open.pragma_query_value(None, "user_version", |row| row.get(0)).unwrap();
    assert!(page.contains(&format!("version {version} of the format")), "the version is {version}");
    let metrics = text("SELECT name FROM metrics ORDER BY id");
    let (public, rest) = page.split_once("\n## Everything else\n").expect("a section on what is not public");
    let public = columns_on(public);
    for (name, columns) in &public {
        let mut real = text(&format!("SELECT name FROM pragma_table_info('{name}') ORDER BY cid"));
        if ["results", "front"].contains(&name.as_str()) {
            assert_eq!(real.split_off(real.len() - metrics.len()), metrics, "a column for each metric");
        }
        assert_eq!(columns, &real, "the columns of {name}");
    }
    for name in text("SELECT name FROM sqlite_master WHERE type IN ('table', 'view') AND name NOT LIKE 'sqlite_%'") {
        let listed = public.iter().any(|(public, _)| *public == name) || rest.contains(&format!("`{name}`"));
        assert!(listed, "docs/format.md says nothing of {name}");
    }
}

/// The examples in this language on a page of the documentation, in their order.
pub(crate) fn examples(page: &str, language: &str) -> Vec<String> {
    let page = fs::read_to_string(workspace().join("docs").join(page)).expect("there is such a page");
    let begin = format!("\n```{language}\n");
    let examples = page.split(begin.as_str()).skip(1);
    examples.filter_map(|rest| Some(rest.split("\n```").next()?.to_owned() + "\n")).collect()
}

#[test]
fn the_examples_of_the_page_on_results_run() {
    let Some(python) = named("SESAME_PYTHON_PEERS") else { return };
    let Some(place) = Place::new("python_examples", CART) else { return };
    let before = "import os\nos.chdir('cart')\nimport sesamec\nfrom sim import World\n\
                  sesamec.run('cart.sesame', simulator=World)\n";
    let program = before.to_owned() + &examples("python-results.md", "python").concat();
    let shown = done(&mut place.script(python, &program)).expect(0).out;
    for part in ["<Run first of cart, seed 1: 80 tests", "'too_close': 's'", "violates R1", "shape: ("] {
        assert!(shown.contains(part), "{part}: {shown}");
    }
    let space = fs::read_to_string(place.folder.join("cart/cart.sesame")).unwrap();
    assert!(space.contains("\ntest hits_the_wall {\n"), "{space}");
    done(command(sesamec()).args(["check", "cart.sesame"]).current_dir(place.folder.join("cart"))).expect(0);
}
