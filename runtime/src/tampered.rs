//! Results that something was done to, before all that reads results: each is read, or refused in words, and stays as
//! it is.
//!
//! What is done to them: bytes are overwritten or cut off; values, rows and tables are changed in SQL; the plan inside
//! is changed token by token and branch by branch. A change is known by its number, so that one which is too much for a
//! reader can be made again.

use std::fs;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::{Path, PathBuf};
use std::sync::mpsc::{RecvTimeoutError, channel};
use std::time::Duration;

use rusqlite::Connection;
use rusqlite::types::Value as Sql;
use serde_json::Value as Json;

use sesame_base::observation::{Observation, OperationEffect, Outcome};
use sesame_plan::condition::{ConditionEnd, ConditionSpace};
use sesame_plan::testing::{field, message};
use sesame_plan::{
    Activation, ActivationMode, BoostedChildren, Bound, CampaignPlan, Confirmation, CoverageGoal, Dimension, Domain,
    Expectation, Exploration, Failing, GridAxis, KnownTestId, MessageId, MessageType, MetricId, MetricSource,
    OperationId, RequirementId, Search, Shrinking, Statistic, StopRule, Strategy, Task, TopicId, Type,
};
use sesame_results::analysis::{
    self, Run, Selection, compare, coverage, front, indicators, regions, sspr, tests as tests_of,
};
use sesame_results::record::{
    DATABASE, GenerationCoverage, Origin, Recorder, Repetition, Repository, differences, sample,
};
use sesame_results::report::{self, TextOptions};
use sesame_rng::Stream;
use sesame_search as search;
use sesame_search::coverage::Grid;
use sesame_search::sspr::Convention;

/// A run's folder as it is before anything is done to it: the database, and its log where there is one.
struct Whole {
    name: &'static str,
    database: Vec<u8>,
    log: Option<Vec<u8>>,
}

/// What is in a folder of results.
fn taken(name: &'static str, folder: &Path) -> Whole {
    let database = fs::read(folder.join(DATABASE)).unwrap();
    let log = fs::read(folder.join(format!("{DATABASE}-wal"))).ok();
    Whole { name, database, log }
}

fn again(recorder: &mut Recorder, plan: &CampaignPlan, test: u32) {
    let record = recorder.repository().test(test).unwrap();
    for position in 1..=3 {
        let mut observed = sample::observe(plan, &record.test, u64::from(position));
        if position == 2 {
            observed.outcome = Outcome::Crash { message: "again".to_owned() };
        }
        recorder.put_repetition(&Repetition::of(test, position, 9, &observed), &["a word".to_owned()]).unwrap();
    }
}

/// A plan with all that a search by time can have.
fn rich() -> CampaignPlan {
    let mut plan = sample::plan();
    let axis = |dimension, high, cells| GridAxis { dimension, low: 0.0, high, cells };
    let axes = vec![axis(Dimension::T1, 1.0, 4), axis(Dimension::P1, 1.0, 3)];
    plan.campaign.coverage = Some(CoverageGoal { axes, hits: 1, stop_at: Some(0.9) });
    let children = BoostedChildren::Falling { first: 9, last: 2, drop: 1 };
    plan.campaign.exploration = Some(Exploration::Boost { every_generations: 2, children, tries: 5 });
    plan.campaign.confirm = Some(Confirmation { times: 3, by: Statistic::Quantile { share: 0.5 }, violations: true });
    plan.campaign.stop =
        vec![StopRule::Stagnation { generations: 3, below: 0.01 }, StopRule::Completeness { share: 0.9 }];
    let bound = plan.requirements[0].bound;
    plan.tests[0].expectations = vec![Expectation { metric: MetricId(0), bound }];
    plan
}

/// Results of every kind, small.
fn wholes() -> Vec<Whole> {
    let mut wholes = Vec::new();
    {
        let folder = tempfile::tempdir().unwrap();
        let plan = rich();
        drop(sample::campaign_with_fronts(folder.path(), &plan, 45));
        let mut recorder = Recorder::reopen(folder.path(), 1).unwrap();
        again(&mut recorder, &plan, 1);
        again(&mut recorder, &plan, 17);
        for generation in 0..4 {
            let coverage = GenerationCoverage { generation, evaluations: 10, covered: 3, cells: 12, feasible: 11 };
            recorder.put_coverage(&coverage).unwrap();
        }
        recorder.finish("all evaluations done").unwrap();
        wholes.push(taken("searched", folder.path()));
    }
    {
        let folder = tempfile::tempdir().unwrap();
        let plan = sample::offline_plan(ConditionEnd::Length { low: 0.5, high: 4.0 });
        let mut recorder = Recorder::create(folder.path(), &plan, 7, 1).unwrap();
        for record in &sample::records(&plan, 12) {
            recorder.commit(record).unwrap();
        }
        let conditional = sample::record(&plan, 20, Origin::Search, sample::conditional_test());
        recorder.commit(&conditional).unwrap();
        // As a kill leaves it: with its log.
        wholes.push(taken("killed", folder.path()));
        recorder.finish("all evaluations done").unwrap();
        wholes.push(taken("by condition", folder.path()));
    }
    {
        let folder = tempfile::tempdir().unwrap();
        let plan = sample::plan();
        let mut recorder = Recorder::create(folder.path(), &plan, 1, 0).unwrap();
        for number in 1..6 {
            let test = plan.tests[0].test.clone();
            let mut record = sample::record(&plan, number, Origin::Search, test);
            record.observation.outcome = Outcome::Unknown;
            for effect in &mut record.observation.operations {
                *effect = OperationEffect { intervals: effect.intervals.clone(), ..OperationEffect::default() };
            }
            recorder.commit(&record).unwrap();
        }
        recorder.put_original_names([(1, "Test_001"), (2, "Test_002")]).unwrap();
        recorder.finish("imported").unwrap();
        wholes.push(taken("imported", folder.path()));
    }
    {
        let folder = tempfile::tempdir().unwrap();
        let mut plan = sample::plan();
        let task = Task::Shrink(Shrinking {
            name: "known_jitter".to_owned(),
            test: plan.tests[0].test.clone(),
            failing: Failing::Violation { requirements: vec![RequirementId(0)] },
            simulator_seed: u64::MAX,
            runs: 1,
            evaluations: 12,
        });
        plan = task.plan(&plan);
        let mut recorder = Recorder::create_for(folder.path(), &plan, &task, 1, 0).unwrap();
        recorder.commit(&sample::record(&plan, 0, Origin::Reference, sesame_plan::Test::default())).unwrap();
        let mut search = search::strategy_of_task(&plan, &task, 1).unwrap();
        let (mut number, mut asked) = (1, search.ask());
        while !asked.is_empty() && number < 12 {
            let mut told = Vec::new();
            for candidate in asked {
                let record = sample::record(&plan, number, Origin::Search, candidate.test.clone());
                recorder.commit(&record).unwrap();
                told.push(search::Evaluated {
                    number,
                    test: candidate.test,
                    fitness: search::fitness(&plan, &record.observation),
                    point: None,
                    run: std::sync::Arc::new(record.observation),
                    fresh_runs: Vec::new(),
                });
                number += 1;
            }
            search.tell(&told);
            asked = search.ask();
        }
        recorder.finish("nothing more to try").unwrap();
        wholes.push(taken("shrunk", folder.path()));
    }
    wholes
}

const NUMBERS: [&str; 22] = [
    "0",
    "-0.0",
    "1",
    "-1",
    "0.5",
    "7",
    "40",
    "255",
    "65536",
    "2147483648",
    "4294967295",
    "4294967296",
    "9007199254740993",
    "9223372036854775807",
    "-9223372036854775808",
    "18446744073709551615",
    "1e-320",
    "1e300",
    "-1.7976931348623157e308",
    "1.7976931348623157e308",
    "1e400",
    "null",
];

const TEXTS: [&str; 8] =
    ["", "\u{1b}[31mred\u{7}", "T1", "reference", "<script>alert(1)</script>", "a\nb", "known_jitter", "日本\u{202e}"];

/// The ends of the tokens of a JSON text, and whether each is one that can be another: a number, a text, a word.
fn tokens(text: &str) -> Vec<(usize, usize)> {
    let bytes = text.as_bytes();
    let (mut found, mut at) = (Vec::new(), 0);
    while at < bytes.len() {
        let start = at;
        match bytes[at] {
            b'"' => {
                at += 1;
                while at < bytes.len() && bytes[at] != b'"' {
                    at += if bytes[at] == b'\\' { 2 } else { 1 };
                }
                at += 1;
            }
            b'{' | b'}' | b'[' | b']' | b':' | b',' | b' ' | b'\n' => {
                at += 1;
                continue;
            }
            _ => {
                while at < bytes.len() && !b"{}[]:, \n".contains(&bytes[at]) {
                    at += 1;
                }
            }
        }
        found.push((start, at.min(bytes.len())));
    }
    found
}

/// All places in a JSON value, by pointers.
fn places(value: &Json, here: &str, found: &mut Vec<String>) {
    found.push(here.to_owned());
    match value {
        Json::Array(items) => {
            items.iter().enumerate().for_each(|(at, item)| places(item, &format!("{here}/{at}"), found));
        }
        Json::Object(members) => {
            for (key, member) in members {
                places(member, &format!("{here}/{}", key.replace('~', "~0").replace('/', "~1")), found);
            }
        }
        _ => {}
    }
}

fn one_of<'a, T: ?Sized>(stream: &mut Stream, of: &'a [&'a T]) -> &'a T {
    of[stream.below(of.len())]
}

/// A plan that is not quite what it was.
fn changed_plan(plan: &str, stream: &mut Stream) -> String {
    let found = tokens(plan);
    if !plan.bytes().any(|byte| byte.is_ascii_digit()) {
        return plan.to_owned();
    }
    let (start, end) = found[stream.below(found.len())];
    match stream.below(5) {
        // A digit.
        0 => {
            let numbers: Vec<usize> = (0..plan.len()).filter(|&at| plan.as_bytes()[at].is_ascii_digit()).collect();
            let at = numbers[stream.below(numbers.len())];
            format!("{}{}{}", &plan[..at], one_of(stream, &["0", "1", "4", "9", "40", "-"]), &plan[at + 1..])
        }
        // A token in the place of another, for a number most often a number.
        1 => {
            let number = plan.as_bytes()[start].is_ascii_digit() || plan.as_bytes()[start] == b'-';
            let (other, another) = found[stream.below(found.len())];
            let put = if number || stream.chance(0.3) {
                one_of(stream, &NUMBERS).to_owned()
            } else if stream.chance(0.5) {
                plan[other..another].to_owned()
            } else {
                serde_json::to_string(one_of(stream, &TEXTS)).unwrap()
            };
            format!("{}{put}{}", &plan[..start], &plan[end..])
        }
        // A number in the place of another, all over the plan.
        2 => {
            let numbers: Vec<_> = found.iter().filter(|(start, _)| plan.as_bytes()[*start].is_ascii_digit()).collect();
            if numbers.is_empty() {
                return plan.to_owned();
            }
            let &&(start, end) = &numbers[stream.below(numbers.len())];
            format!("{}{}{}", &plan[..start], one_of(stream, &NUMBERS), &plan[end..])
        }
        // A branch removed, doubled, or put in the place of another.
        _ => {
            let Ok(mut value) = serde_json::from_str::<Json>(plan) else { return plan.to_owned() };
            let mut found = Vec::new();
            places(&value, "", &mut found);
            let place = found[stream.below(found.len())].clone();
            let other = value.pointer(&found[stream.below(found.len())]).cloned().unwrap();
            let Some((parent, last)) = place.rsplit_once('/') else { return plan.to_owned() };
            let way = stream.below(4);
            match value.pointer_mut(parent).unwrap() {
                Json::Array(items) => {
                    let at: usize = last.parse().unwrap();
                    match way {
                        0 => drop(items.remove(at)),
                        1 => items.insert(at, items[at].clone()),
                        2 => items.swap(0, at),
                        _ => items[at] = other,
                    }
                }
                Json::Object(members) => match way {
                    0 => drop(members.remove(&last.replace("~1", "/").replace("~0", "~"))),
                    1 => drop(members.insert("stray".to_owned(), other)),
                    _ => drop(members.insert(last.replace("~1", "/").replace("~0", "~"), other)),
                },
                _ => {}
            }
            value.to_string()
        }
    }
}

fn hostile_value(stream: &mut Stream, connection: &Connection, table: &str, column: &str) -> Sql {
    let number = *NUMBERS[..21].get(stream.below(21)).unwrap();
    match stream.below(6) {
        0 => Sql::Null,
        1 => Sql::Text((*one_of(stream, &TEXTS)).to_owned()),
        2 => Sql::Real(number.parse().unwrap()),
        3 => number.parse().map_or(Sql::Integer(3), Sql::Integer),
        4 => Sql::Real(f64::INFINITY),
        // What is elsewhere in the column.
        _ => connection
            .query_row(&format!("SELECT {column} FROM {table} ORDER BY random() LIMIT 1"), [], |row| row.get(0))
            .unwrap_or(Sql::Integer(1)),
    }
}

/// Names in a schema, in their order.
fn names(connection: &Connection, sql: &str) -> Vec<String> {
    let mut statement = connection.prepare(sql).unwrap();
    let found = statement.query_map([], |row| row.get(0)).unwrap();
    found.collect::<Result<_, _>>().unwrap()
}

/// Changes values, rows and tables. What SQLite itself refuses is not done.
fn change_in_sql(file: &Path, stream: &mut Stream) {
    let connection = Connection::open(file).unwrap();
    let freely = "PRAGMA foreign_keys = OFF; PRAGMA ignore_check_constraints = ON; PRAGMA synchronous = OFF;";
    connection.execute_batch(freely).unwrap();
    let tables = names(&connection, "SELECT name FROM sqlite_schema WHERE type = 'table' ORDER BY name");
    for _ in 0..=stream.below(3) {
        let table = &tables[stream.below(tables.len())];
        let columns = names(&connection, &format!("SELECT name FROM pragma_table_info('{table}') ORDER BY cid"));
        // It was dropped before.
        if columns.is_empty() {
            continue;
        }
        let column = &columns[stream.below(columns.len())];
        let keys =
            names(&connection, &format!("SELECT name FROM pragma_table_info('{table}') WHERE pk > 0 ORDER BY pk"));
        let keys = keys.join(", ");
        let rows: i64 = connection.query_row(&format!("SELECT count(*) FROM {table}"), [], |row| row.get(0)).unwrap();
        let chosen = stream.below(usize::try_from(rows.max(1)).unwrap());
        let one = format!("({keys}) IN (SELECT {keys} FROM {table} LIMIT 1 OFFSET {chosen})");
        let value = hostile_value(stream, &connection, table, column);
        // SQLite refuses some of it, as it should.
        let _ = match stream.below(12) {
            0 => connection.execute(&format!("DELETE FROM {table} WHERE {one}"), []),
            1 => connection.execute(&format!("UPDATE {table} SET {column} = ?1"), [value]),
            2 => connection.execute(&format!("DELETE FROM {table} WHERE {column} = ?1"), [value]),
            3 if stream.chance(0.2) => {
                let kind = one_of(stream, &["TABLE", "VIEW"]);
                connection.execute_batch(&format!("DROP {kind} {table}")).map(|()| 0)
            }
            _ => connection.execute(&format!("UPDATE {table} SET {column} = ?1 WHERE {one}"), [value]),
        };
    }
}

fn change_in_plan(file: &Path, stream: &mut Stream) {
    let connection = Connection::open(file).unwrap();
    let plan: String = connection.query_row("SELECT plan FROM campaign", [], |row| row.get(0)).unwrap();
    let mut changed = changed_plan(&plan, stream);
    if stream.chance(0.2) && serde_json::from_str::<Json>(&changed).is_ok() {
        changed = changed_plan(&changed, stream);
    }
    connection.pragma_update(None, "synchronous", false).unwrap();
    connection.execute("UPDATE campaign SET plan = ?1", [changed]).unwrap();
}

fn change_bytes(bytes: &mut Vec<u8>, stream: &mut Stream) {
    for _ in 0..=stream.below(3) {
        let from = stream.below(bytes.len());
        let count = if stream.chance(0.7) { stream.below(4) } else { stream.below(400) };
        let to = (from + 1 + count).min(bytes.len());
        let byte = u8::try_from(stream.below(256)).unwrap();
        if stream.chance(0.5) {
            bytes[from..to].fill(byte);
        } else {
            bytes[from..to].iter_mut().for_each(|it| *it ^= byte);
        }
    }
    if stream.chance(0.1) {
        bytes.truncate(1 + stream.below(bytes.len()));
    }
}

/// Makes the change of this number, in this folder. Gives what was changed, for words.
fn tampered(wholes: &[Whole], number: u64, folder: &Path) -> String {
    let mut stream = Stream::derive(11, "tampering", &[number]);
    let whole = &wholes[stream.below(wholes.len())];
    let file = folder.join(DATABASE);
    let log = folder.join(format!("{DATABASE}-wal"));
    for old in [&log, &folder.join(format!("{DATABASE}-shm")), &folder.join(format!("{DATABASE}-journal"))] {
        let _ = fs::remove_file(old);
    }
    fs::write(&file, &whole.database).unwrap();
    if let Some(content) = &whole.log {
        fs::write(&log, content).unwrap();
    }
    let how = match stream.below(10) {
        0..2 => {
            let (file, whole) = match &whole.log {
                Some(log_bytes) if stream.chance(0.5) => (&log, log_bytes),
                _ => (&file, &whole.database),
            };
            let mut bytes = whole.clone();
            change_bytes(&mut bytes, &mut stream);
            fs::write(file, bytes).unwrap();
            "bytes"
        }
        2..6 => {
            change_in_sql(&file, &mut stream);
            "values"
        }
        _ => {
            change_in_plan(&file, &mut stream);
            "plan"
        }
    };
    format!("change {number}: {how} of `{}`", whole.name)
}

/// What reading came to: refused or not, and how far it came.
struct Read {
    /// Readers that gave an answer.
    answered: u32,
    /// Readers that refused, or found nothing that was asked for.
    refused: u32,
}

/// Everything that reads results, one after the other.
fn read_all(folder: &Path) -> Read {
    let mut read = Read { answered: 0, refused: 0 };
    let mut said = |answer: Result<(), String>| match answer {
        Ok(()) => read.answered += 1,
        Err(words) => {
            read.refused += 1;
            assert!(!words.chars().any(|c| c.is_control() && c != '\n'), "control characters in {words:?}");
            assert!(!words.is_empty());
        }
    };
    let repository = match Repository::open(folder) {
        Ok(repository) => repository,
        Err(error) => {
            said(Err(error.to_string()));
            return read;
        }
    };
    let (plan, all) = (repository.plan(), Selection::default());
    let options = TextOptions { width: Some(100), colour: false };
    macro_rules! ask {
        ($question:expr, $then:expr) => {
            said(
                $question
                    .map(|answer| {
                        let _ = $then(answer);
                    })
                    .map_err(|error| error.to_string()),
            )
        };
    }
    let shown = |dataset: analysis::Table| (dataset.text(options), dataset.csv(), dataset.json());
    ask!(repository.digest(), |digest| digest);
    ask!(repository.sessions(), |sessions| sessions);
    ask!(analysis::campaigns(std::slice::from_ref(&repository)), shown);
    ask!(tests_of(&repository, &all), shown);
    ask!(front(&repository, &all), shown);
    ask!(sspr(&repository, &all, &Dimension::ALL, Convention::Ours), shown);
    ask!(indicators(&repository, None), |it: analysis::IndicatorAnalysis| shown(it.dataset()));
    ask!(regions::regions(&repository, &all, None, 3), |found: Vec<regions::Regions>| {
        shown(regions::table(&found));
        for of in &found {
            drop(of.svg(plan));
        }
    });
    if let Some(goal) = &plan.campaign.coverage {
        match Grid::new(goal.axes.clone()) {
            Ok(grid) => ask!(
                coverage(&repository, &all, grid, goal.hits, Convention::Paper),
                |it: analysis::CoverageAnalysis| (shown(it.curve()), shown(it.cells()))
            ),
            Err(error) => said(Err(error.to_string())),
        }
    }
    ask!(report::summary(&repository), |summary| (report::summary_text(&summary, options), report::junit(&summary)));
    ask!(report::page(&repository), |page| page);
    ask!(report::list(&repository), |list| report::list_text(&list, options));
    for name in ["reference", "T1", "T17", "T20", "T44"] {
        ask!(report::show(&repository, name), |test| report::test_text(&test, options));
        ask!(report::export(&repository, name, None), |exported| exported);
        ask!(
            repository.find(name).and_then(|number| repository.test(number)),
            |record: sesame_results::record::TestRecord| {
                let nothing = Observation { metrics: Vec::new(), operations: Vec::new(), ..record.observation.clone() };
                differences(plan, &record.test, &record.observation, &nothing)
            }
        );
    }
    ask!(crate::cli::asked_beside_reports(&repository, "T17"), |answer| answer);
    let runs = [0, 1].map(|_| Repository::open(folder));
    if let [Ok(one), Ok(other)] = runs {
        let runs = [("a", one), ("b", other)].map(|(group, repository)| Run { group: group.to_owned(), repository });
        ask!(compare(&runs, None, None), |it: analysis::Comparison| (
            shown(it.runs()),
            shown(it.groups()),
            shown(it.pairs())
        ));
    }
    // What a run that goes on asks first; tests without number would take their time.
    if plan.campaign.search.evaluations() < 10_000 && plan.campaign.neighbours.unwrap_or(0) < 10_000 {
        ask!(search::strategy(plan, 1), |strategy: Box<dyn search::Strategy>| drop(strategy));
    }
    read
}

/// Reads what was done to results, and insists on an answer in time and an untouched file. Gives how many answers there
/// were, and how many refusals.
fn all_are_read_or_refused(numbers: std::ops::Range<u64>) -> (u32, u32) {
    let wholes = wholes();
    let folder = tempfile::tempdir().unwrap();
    let (ask, asked) = channel::<PathBuf>();
    let (answer, answered) = channel();
    let reader = std::thread::spawn(move || {
        for folder in asked {
            let read = catch_unwind(AssertUnwindSafe(|| read_all(&folder)));
            if answer.send(read.map_err(|_| ())).is_err() {
                break;
            }
        }
    });
    let (mut answers, mut refusals, mut troubles) = (0, 0, Vec::new());
    for number in numbers {
        // What ends the whole process, such as a stack that overflows, leaves at least this.
        if number % 100 == 0 {
            println!("from change {number}");
        }
        let done = tampered(&wholes, number, folder.path());
        let before = fs::read(folder.path().join(DATABASE)).unwrap();
        ask.send(folder.path().to_owned()).unwrap();
        match answered.recv_timeout(Duration::from_secs(60)) {
            Ok(Ok(read)) => {
                answers += read.answered;
                refusals += read.refused;
            }
            Ok(Err(())) => troubles.push(format!("{done}: a reader panics")),
            Err(RecvTimeoutError::Timeout) => panic!("{done}: no answer after a minute"),
            Err(RecvTimeoutError::Disconnected) => panic!("{done}: the reader is gone"),
        }
        if fs::read(folder.path().join(DATABASE)).unwrap() != before {
            troubles.push(format!("{done}: the file was changed"));
        }
        assert!(troubles.len() < 20, "{}", troubles.join("\n"));
    }
    drop(ask);
    reader.join().unwrap();
    assert!(troubles.is_empty(), "{}", troubles.join("\n"));
    (answers, refusals)
}

/// A change to a plan, and what is then said of it.
type Altered = (fn(&mut CampaignPlan), &'static str);

#[test]
fn each_thing_that_later_code_relies_on_is_asked_for() {
    let by_time: &[Altered] = &[
        (|plan| plan.schema += 1, "schema: is 3, this release knows 2"),
        (
            |plan| plan.campaign.objectives[0] = MetricId(40),
            "campaign.objectives[0]: there is no metric 40, there are 5",
        ),
        (|plan| plan.metrics[1].direction = None, "campaign.objectives[0]: the metric `fuzzing_time` has no direction"),
        (
            |plan| plan.campaign.objectives[1] = plan.campaign.objectives[0],
            "campaign.objectives: MetricId(1) is there twice",
        ),
        (|plan| plan.campaign.operations[2] = OperationId(4), "campaign.operations[2]: there is no operation 4"),
        (|plan| plan.campaign.count.min = 6, "campaign.count: runs from 6 to 5"),
        (|plan| plan.campaign.end_after = 0.0, "campaign.end_after: 0 is not above 0"),
        (
            |plan| plan.campaign.search = Search::new(Strategy::Nsga2 { population: 0 }, 1),
            "campaign.search.strategy.population: must be at least 1",
        ),
        (
            |plan| plan.campaign.search = Search::Repeat { test: KnownTestId(1), times: 1 },
            "campaign.search.test: there is no test 1",
        ),
        (|plan| plan.campaign.neighbours = Some(0), "campaign.neighbours: must be at least 1"),
        (|plan| plan.campaign.confirm.as_mut().unwrap().times = 0, "campaign.confirm.times: must be at least 1"),
        (|plan| plan.campaign.coverage.as_mut().unwrap().axes[1].cells = 0, "campaign.coverage.axes[1].cells: must be"),
        (
            |plan| plan.campaign.coverage.as_mut().unwrap().axes[1].dimension = Dimension::T1,
            "campaign.coverage.axes: T1 is there twice",
        ),
        (|plan| plan.requirements[3].metric = MetricId(5), "requirements[3].metric: there is no metric 5"),
        (
            |plan| plan.requirements[0].bound = Bound::Within { low: 1.0, high: 0.0 },
            "requirements[0].bound: runs from 1 to 0",
        ),
        (
            |plan| plan.requirements[1].bound = Bound::Above { value: f64::NAN },
            "requirements[1].bound: NaN is not finite",
        ),
        (
            |plan| plan.metrics[0].source = MetricSource::Hook { topics: vec![TopicId(3)] },
            "metrics[0].source.topics[0]: there is no topic 3",
        ),
        (|plan| plan.metrics[2].name = "fuzzing_time".to_owned(), "metrics: \"fuzzing_time\" is there twice"),
        (
            |plan| plan.metrics[2].name = "\u{1b}[2J".to_owned(),
            "metrics[2].name: \"\\u{1b}[2J\" has control characters",
        ),
        (|plan| plan.topics[0].ty = Type::Message { id: MessageId(0) }, "topics[0].type.id: there is no message 0"),
        (|plan| plan.topics[0].paths.clear(), "topics[0].paths: there is none"),
        (
            |plan| plan.messages.push(containing_itself()),
            "messages[0].fields[0].type.of.id: message 0 contains message 0",
        ),
        (|plan| plan.operations[0].topic = None, "operations[0].topic: it acts on one"),
        (|plan| plan.operations[2].within.end = -1.0, "operations[2].within: runs from 0 to -1"),
        (|plan| plan.operations[2].inclusion = 1.5, "operations[2].inclusion: 1.5 is not in 0..=1"),
        (
            |plan| plan.tests[0].test.operations[0].parameters.clear(),
            "tests[0].test.operations[0].parameters: there are 0",
        ),
        (
            |plan| plan.tests[0].test.operations[0].activation = Activation::Offline,
            "tests[0].test.operations[0].activation: `jitter_link1` acts during the run",
        ),
        (
            |plan| plan.tests[0].expectations[0].metric = MetricId(9),
            "tests[0].expectations[0].metric: there is no metric 9",
        ),
    ];
    let by_condition: &[Altered] = &[
        (
            |plan| space_of(plan).variables[1].metric = MetricId(7),
            "activation.space.variables[1].metric: there is no metric 7",
        ),
        (|plan| space_of(plan).variables.clear(), "campaign.activation.space.variables: there is none"),
        (
            |plan| space_of(plan).integers.highest = 0,
            "campaign.activation.space.integers: there are no whole numbers from 1 to 0",
        ),
        (|plan| space_of(plan).integers.highest = i64::MAX, "campaign.activation.space.integers: there are no"),
        (|plan| space_of(plan).depth = 0, "campaign.activation.space.depth: must be at least 1"),
        (|plan| space_of(plan).depth = 2_000_000, "campaign.activation.space.depth: is 2000000, more than 10"),
        (
            |plan| plan.operations[4].parameters[0].domain = Domain::Texts { texts: Vec::new() },
            "operations[4].parameters[0].domain: there is none",
        ),
        (|plan| plan.operations[4].topic = Some(TopicId(0)), "operations[4].topic: it acts on none"),
    ];
    let conditional = sample::offline_plan(ConditionEnd::Condition);
    for (whole, altered) in [(rich(), by_time), (conditional, by_condition)] {
        whole.validate().unwrap();
        for (alter, words) in altered {
            let mut plan = whole.clone();
            alter(&mut plan);
            let said = plan.validate().unwrap_err().to_string();
            assert!(said.contains(words), "{said:?} does not say {words:?}");
            // What is not finite cannot be written in JSON, and does not come out of it.
            let read = serde_json::from_str::<CampaignPlan>(&serde_json::to_string(&plan).unwrap());
            let read = read.unwrap_err().to_string();
            assert!(read.contains(words) || read.contains("null"), "{read:?} does not say {words:?}");
        }
    }
}

fn containing_itself() -> MessageType {
    let ty = Type::List { of: Box::new(Type::Message { id: MessageId(0) }) };
    message("Loop", vec![field("again", ty)])
}

fn space_of(plan: &mut CampaignPlan) -> &mut ConditionSpace {
    match &mut plan.campaign.activation {
        ActivationMode::Condition { space } => space,
        ActivationMode::Time => panic!("conditions switch its operations"),
    }
}

#[test]
fn whatever_is_done_to_results_they_are_read_or_refused_and_stay_as_they_are() {
    let (answers, refusals) = all_are_read_or_refused(0..60);
    assert!(answers > 0 && refusals > 0, "what is done leaves some results whole, and spoils others");
}

#[test]
#[ignore = "long: 35,000 changes to results, each before all that reads results"]
fn of_35_000_changes_to_results_none_is_too_much() {
    let number = |name| std::env::var(name).ok().and_then(|text| text.parse().ok());
    let first = number("SESAME_TAMPERING_FROM").unwrap_or(1_000);
    let last = first + number("SESAME_TAMPERING_COUNT").unwrap_or(35_000);
    let parts = std::thread::available_parallelism().map_or(1, |it| it.get() as u64);
    let edge = |part: u64| first + (last - first) * part / parts;
    std::thread::scope(|scope| {
        for part in 0..parts {
            scope.spawn(move || all_are_read_or_refused(edge(part)..edge(part + 1)));
        }
    });
}

/// A shrunk test that was gone to for ever, and generations that end before those before them.
#[test]
fn changes_that_were_once_too_much_are_read_or_refused() {
    for change in [20_827, 22_243] {
        all_are_read_or_refused(change..change + 1);
    }
}
