//! What a test of a search costs in addition to its simulation, by the number of tests: relay, worker, search,
//! database, page.
//!
//! A runner is generated, built and run with one worker; its database knows what the runs themselves took.

use sesame_record::Repository;
use sesame_tests::Project;

const SPACE: &str = r#"
space cost
system {
  simulator sim = in_process "faulty_sim::Faulty" { crate "simulator"  step 10ms }
  topic level = "faulty/level" : real
}
metric fuzzing_time minimise = fuzzing_time()
metric highest maximise default 0 = max(level)

operation shift on level = random offset [-5, 5]
operation lose  on level = packet loss [0%, 100%]

campaign seeking {
  objectives fuzzing_time, highest
  operations shift, lose   1..5 per test
  search     nsga2 { population 100  evaluations 100 }
  end        after 5s
}
"#;

fn main() {
    // Cargo tells whether it measures or only tries that this works.
    let counts: &[u32] = if std::env::args().any(|word| word == "--bench") { &[100, 1_000, 10_000] } else { &[100] };
    let project = Project::new("cost_of_tests", SPACE, "faulty");
    let runner = project.build("seeking");
    println!("| tests | wall time | of that in runs | beside them, per test |");
    println!("|---:|---:|---:|---:|");
    for count in counts {
        let count = count.to_string();
        let results = project.folder.join(&count);
        let told =
            ["run", "--workers", "1", "--evaluations", &count, "--results", results.to_str().expect("it is text")];
        runner.run(&told).expect(0);
        let repository = Repository::open(&results.join("1")).expect("the run recorded its results");
        let session = repository.sessions().expect("they can be read").remove(0);
        let whole = session.ended_at.expect("it has ended") - session.started_at;
        let tests = repository.tests().expect("they can be read");
        let runs: f64 = tests
            .iter()
            .filter(|test| test.duplicate_of.is_none())
            .map(|test| repository.test(test.number).expect("it can be read").observation.wall.run)
            .sum();
        let beside = 1e3 * (whole - runs) / tests.len() as f64;
        println!("| {count} | {whole:.2} s | {runs:.2} s | {beside:.3} ms |");
    }
}
