//! What large campaigns cost afterwards: their size on disk, taking one up again, reporting on it, its digest; and what
//! the supervisor holds in memory while one runs.
//!
//! A runner is generated, built and run with one worker. Its tests last 500 steps, and two metrics change with each
//! step that is disturbed: one to two hundred points a test.

use std::fs;
use std::path::Path;
use std::time::{Duration, Instant};

use rusqlite::Connection;
use sesame_tests::{Project, Runner};

const SPACE: &str = r#"
space grown
system {
  simulator sim = in_process "faulty_sim::Faulty" { crate "simulator"  step 10ms }
  topic level = "faulty/level" : real
}
metric fuzzing_time = fuzzing_time()
metric highest maximise default 0 = max(level) outbound
metric lowest minimise default 0 = min(level) outbound
metric now default 0 = last(level) outbound

operation shift on level = random offset [-5, 5]
operation lose  on level = packet loss [0%, 100%]

campaign seeking {
  objectives highest, lowest
  observes   fuzzing_time, now
  operations shift, lose   1..5 per test
  search     nsga2 { population 100  evaluations 100 }
  end        after 5s
}
"#;

/// What a command took: time, and the memory that its process had at most before it closed the results, and in the end.
struct Took {
    time: Duration,
    running: u64,
    most: u64,
}

/// Runs the runner to its end, watching its memory where the system shows it.
fn watched(runner: &Runner, arguments: &[&str], results: &Path) -> Took {
    let begun = Instant::now();
    let mut child = runner.command(arguments).stdout(std::process::Stdio::null()).spawn().expect("the runner starts");
    let status = format!("/proc/{}/status", child.id());
    let log = results.join("results.sqlite-wal");
    let (mut running, mut most) = (0, 0);
    let ended = loop {
        let shown = fs::read_to_string(&status).unwrap_or_default();
        let line = shown.lines().find_map(|line| line.strip_prefix("VmHWM:"));
        most = line.and_then(|line| line.trim_end_matches("kB").trim().parse().ok()).unwrap_or(most);
        // The log is there as long as tests are recorded.
        if log.exists() {
            running = most;
        }
        if let Some(ended) = child.try_wait().expect("it can be waited for") {
            break ended;
        }
        std::thread::sleep(Duration::from_millis(1));
    };
    assert!(ended.success(), "{arguments:?}");
    Took { time: begun.elapsed(), running, most }
}

/// Removes the last test, which is the final reference run, so that `resume` goes through all others.
fn unfinish(results: &Path) {
    let open = Connection::open(results.join("results.sqlite")).expect("the results can be opened");
    open.pragma_update(None, "foreign_keys", false).expect("it can be set");
    let last: i64 = open.query_row("SELECT max(number) FROM tests", [], |row| row.get(0)).expect("there are tests");
    for (table, column) in
        [("metric_values", "test"), ("series_pieces", "test"), ("wall_times", "test"), ("tests", "number")]
    {
        open.execute(&format!("DELETE FROM {table} WHERE {column} = ?1"), [last]).expect("rows can be deleted");
    }
    open.execute_batch(
        "DELETE FROM result_set_members WHERE result_set = 'final'; DELETE FROM result_sets WHERE status = 'final'; \
         UPDATE campaign SET stop = NULL",
    )
    .expect("rows can be deleted");
}

fn main() {
    // Cargo tells whether it measures or only tries that this works.
    let measured = std::env::args().any(|word| word == "--bench");
    let counts: &[u32] = if measured { &[1_000, 10_000, 100_000] } else { &[100] };
    let project = Project::new("grown_campaigns", SPACE, "faulty");
    let runner = project.build("seeking");
    println!("| tests | size | `resume` | `report` | `digest` | supervisor while running | with the page |");
    println!("|---:|---:|---:|---:|---:|---:|---:|");
    for count in counts {
        let count = count.to_string();
        let folder = project.folder.join(&count);
        let results = folder.join("1");
        let [folder, shown] = [&folder, &results].map(|path| path.to_str().expect("it is text"));
        let run = watched(&runner, &["run", "--workers", "1", "--evaluations", &count, "--results", folder], &results);
        let size = fs::metadata(results.join("results.sqlite")).expect("there are results").len();
        let whole = runner.run(&["digest", "--results", shown]).expect(0).out;
        let report = watched(&runner, &["report", "--results", shown], &results);
        let digest = watched(&runner, &["digest", "--results", shown], &results);
        unfinish(&results);
        let resume = watched(&runner, &["resume", "--workers", "1", shown], &results);
        assert_eq!(runner.run(&["digest", "--results", shown]).expect(0).out, whole, "resuming gives what was there");
        let [resumed, reported, digested] = [resume, report, digest].map(|measured| measured.time.as_secs_f64());
        println!(
            "| {count} | {:.1} MB | {resumed:.2} s | {reported:.2} s | {digested:.2} s | {} MB | {} MB |",
            size as f64 / 1e6,
            run.running / 1000,
            run.most / 1000
        );
        fs::remove_dir_all(folder).expect("the results can be removed");
    }
}
