//! Analyses of a results file of 100,000 tests: each within 500 MB, and how long each takes.
#![cfg(target_os = "linux")]

use std::fs;
use std::io::{BufRead as _, BufReader, Read as _};
use std::path::Path;
use std::process::Stdio;
use std::time::{Duration, Instant};

use sesame_base::observation::{Counters, MetricObservation, Observation, OperationEffect, Outcome, WallTime};
use sesame_codegen::lower::lower;
use sesame_dsl::source::SourceMap;
use sesame_optimise::dominance::Fitness;
use sesame_optimise::front::Front;
use sesame_plan::{Activation, CampaignPlan, Direction, Metric, MetricId, Span};
use sesame_record::{GenerationCoverage, Origin, Recorder, Repository, ResultSet, Status, TestRecord};
use sesame_report as report;
use sesame_rng::Stream;
use sesame_search as search;
use sesame_search::coverage::{Coverage, Grid};
use sesame_search::indicators::Indicators;
use sesame_search::space::TestSpace;
use sesame_search::space::fresh_test;
use sesame_search::sspr;
use sesame_tests::{command, fresh_folder, optimised_sesamec};

const TESTS: u32 = 100_000;
const POPULATION: u32 = 250;
/// What an analysis may have of memory.
const MOST_MEMORY_KB: u64 = 500_000;

const SPACE: &str = r#"
space large

system {
  simulator sim = in_process "sim::Sim" { crate "simulator"  step 1ms }
  topic command = "arm/command" : real[rad]
  topic level   = "arm/level"   : real[m]
}

metric first minimise default 0m = last(level)

operation jitter on command = random offset [-0.3rad, 0.3rad]
operation lose   on command = packet loss [0%, 100%]
operation lag    on command = latency [0ms, 500ms] uniform

campaign all {
  objectives first
  operations jitter, lose, lag   1..5 per test
  search     nsga2 { population 250  evaluations 100000  seed 1 }
  coverage   { T1 [0, 1] cells 6   T2 [0, 0.5] cells 6   P1 [0, 1] cells 3   hits 1 }
  end        after 100s
}
"#;

/// The space's plan with so many objectives.
fn plan(objectives: u32) -> CampaignPlan {
    let mut sources = SourceMap::new();
    let root = sources.add("large.sesame", SPACE);
    let analysis = sesame_dsl::analyse(&sources, root);
    let space = analysis.model.unwrap_or_else(|| panic!("the space is sound: {:?}", analysis.diagnostics));
    let mut plan = lower(&space, space.campaign("all").unwrap(), "large.sesame", "large").plan;
    let metric = plan.metrics[0].clone();
    for (name, direction) in [("second", Direction::Maximise), ("third", Direction::Minimise)] {
        plan.metrics.push(Metric { name: name.to_owned(), direction: Some(direction), ..metric.clone() });
    }
    plan.campaign.objectives = (0..objectives).map(MetricId).collect();
    plan
}

/// Values that come nearer to a sphere (a circle, of two objectives) around the ideal the later the test: fronts of a
/// search that goes on getting better, with very many tests on them.
fn values(objectives: u32, number: u32, stream: &mut Stream) -> [f64; 3] {
    let mut place: [f64; 3] = std::array::from_fn(|_| stream.uniform(0.01, 1.0));
    if objectives == 2 {
        place[2] = 0.0;
    }
    let length = length_of(place);
    let late = f64::from(number) / f64::from(TESTS);
    let radius = 1.0 + stream.unit() * (1.0 - 0.95 * late);
    let [first, second, third] = place.map(|x| 10.0 * radius * x / length);
    [first, -second, third]
}

fn length_of([x, y, z]: [f64; 3]) -> f64 {
    (x * x + y * y + z * z).sqrt()
}

fn record(plan: &CampaignPlan, permitted: &TestSpace, number: u32) -> TestRecord {
    let mut stream = Stream::derive(1, "large", &[u64::from(number)]);
    let test = fresh_test(permitted, &mut stream);
    let effect = |activation: &Activation| {
        let Activation::Time { start, end } = *activation else { unreachable!("a campaign by time") };
        let counters = Counters { seen: 100, changed: 100, ..Counters::default() };
        let intervals = vec![Span { start, end }];
        OperationEffect { intervals, tails: Vec::new(), counters, first_touch: Some(start), last_touch: Some(end) }
    };
    let objectives = u32::try_from(plan.campaign.objectives.len()).unwrap();
    let metric = |value: f64| {
        let series = (0..5u32).map(|at| (f64::from(at) + 1.0, value * f64::from(at + 1) / 5.0)).collect();
        MetricObservation::whole(Some(value), true, series)
    };
    TestRecord {
        number,
        origin: Origin::Search,
        generation: Some((number - 1) / POPULATION),
        parents: if number > POPULATION { vec![number - POPULATION, number - POPULATION + 1] } else { Vec::new() },
        simulator_seed: 1,
        duplicate_of: None,
        observation: Observation {
            outcome: if number % 50 == 7 { Outcome::NoEffect } else { Outcome::Completed },
            end: 100.0,
            operations: test.operations.iter().map(|operation| effect(&operation.activation)).collect(),
            unheard: Vec::new(),
            unreached: Vec::new(),
            traffic: Vec::new(),
            course: None,
            altered: None,
            metrics: values(objectives, number, &mut stream).map(metric).to_vec(),
            monitors: Vec::new(),
            messages: 10_000,
            warnings: Vec::new(),
            wall: WallTime::default(),
        },
        test,
    }
}

/// Records a campaign as a runner does, generation by generation.
fn generate(folder: &Path, plan: &CampaignPlan, tests: u32) -> usize {
    let permitted = TestSpace::from_plan(plan).unwrap();
    let goal = plan.campaign.coverage.as_ref().unwrap();
    let mut coverage = Coverage::new(Grid::new(goal.axes.clone()).unwrap(), goal.hits);
    let mut recorder = Recorder::create(folder, plan, 1, 1).unwrap();
    let (mut front, mut indicators) = (Front::default(), Indicators::new(None));
    // Sorted out once for each generation, which is a hundred times as fast as test by test.
    let mut standing: Vec<(u32, Fitness)> = Vec::new();
    for number in 1..=tests {
        let record = record(plan, &permitted, number);
        recorder.commit(&record).unwrap();
        let fitness = search::fitness(plan, &record.observation);
        indicators.add(&record.observation.outcome, false, &fitness);
        standing.push((number, fitness));
        if let Some(point) = sspr::observed_point(plan, &record.test, &record.observation)
            && record.observation.outcome != Outcome::NoEffect
        {
            coverage.add(&point);
        }
        if number % POPULATION == 0 {
            front = Front::from_tests(standing.iter().map(|(number, fitness)| (*number, fitness)));
            let members = front.numbers();
            standing.retain(|(number, _)| members.binary_search(number).is_ok());
            let generation = number / POPULATION - 1;
            let set = |name, generation, status| ResultSet { name, generation, status, members: front.numbers() };
            let name = format!("generation-{generation}");
            recorder.put_result_set(&set(name, Some(generation), Status::Intermediate)).unwrap();
            recorder.put_indicators(&indicators.after(generation, &front), indicators.reference()).unwrap();
            let (covered, cells) = (coverage.covered(), coverage.grid().len());
            let after = GenerationCoverage { generation, evaluations: number, covered, cells, feasible: 96 };
            recorder.put_coverage(&after).unwrap();
            if number == tests {
                recorder.put_result_set(&set("final".to_owned(), None, Status::Final)).unwrap();
            }
        }
    }
    recorder.finish("all tests were evaluated").unwrap();
    front.members().len()
}

/// What a command took: wall time, of memory the most that was resident in kB, and the lines it printed.
struct Took {
    time: Duration,
    memory: u64,
    lines: usize,
}

/// Runs an analysis with as much memory as it may have, and no more: one that wants more is ended.
fn analysis(sesamec: &Path, arguments: &[&str]) -> Took {
    let limited = format!("ulimit -v {MOST_MEMORY_KB}; exec \"$0\" results \"$@\"");
    let begun = Instant::now();
    let mut child = command("sh")
        .args(["-c", &limited])
        .arg(sesamec)
        .args(arguments)
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .unwrap();
    let (out, mut err) = (child.stdout.take().unwrap(), child.stderr.take().unwrap());
    let read = std::thread::spawn(move || BufReader::new(out).lines().map_while(Result::ok).count());
    // The system keeps the most that was ever resident, so that the last look is what counts.
    let (mut memory, status) = (0, format!("/proc/{}/status", child.id()));
    let ended = loop {
        let shown = fs::read_to_string(&status).unwrap_or_default();
        let most = shown.lines().find_map(|line| line.strip_prefix("VmHWM:"));
        memory = most.and_then(|most| most.trim_end_matches("kB").trim().parse().ok()).unwrap_or(memory);
        if let Some(ended) = child.try_wait().unwrap() {
            break ended;
        }
        std::thread::sleep(Duration::from_millis(1));
    };
    let time = begun.elapsed();
    let mut said = String::new();
    err.read_to_string(&mut said).unwrap();
    assert!(ended.success(), "{arguments:?}: {said}");
    Took { time, memory, lines: read.join().unwrap() }
}

#[test]
#[ignore = "long: 100,000 tests, twice"]
fn each_analysis_of_100_000_tests_takes_less_than_500_mb() {
    let sesamec = optimised_sesamec();
    let root = fresh_folder("large_results");
    for objectives in [2, 3] {
        let folder = root.join(objectives.to_string());
        let begun = Instant::now();
        let front = generate(&folder, &plan(objectives), TESTS);
        let file = fs::metadata(folder.join("results.sqlite")).unwrap().len() / 1_000_000;
        println!(
            "{objectives} objectives, {front} tests on the front: {file} MB, written in {:.0} s",
            begun.elapsed().as_secs_f64()
        );
        let shown = folder.to_str().unwrap();
        let asked: [&[&str]; 8] = [
            &["campaigns", shown],
            &["tests", shown],
            &["front", shown],
            &["sspr", shown],
            &["coverage", shown],
            &["indicators", shown],
            &["indicators", "--reference", if objectives == 2 { "30,-30" } else { "30,-30,30" }, shown],
            &["compare", shown, shown],
        ];
        for arguments in asked {
            let arguments = [arguments, &["--format", "csv"]].concat();
            let took = analysis(sesamec, &arguments);
            let named: Vec<&str> = arguments.iter().copied().filter(|argument| !argument.contains('/')).collect();
            let named = named[..named.len() - 2].join(" ");
            println!("{named:<28} {:>6.2} s {:>6} kB {:>7} lines", took.time.as_secs_f64(), took.memory, took.lines);
            assert!(took.lines > 1, "{named} said nothing");
        }
        let front = Repository::open(&folder).unwrap().latest_result_set().unwrap().unwrap().members.len();
        assert!(front > 200, "{front}: a small front would show little");
    }
}

#[test]
#[ignore = "long: 10,000 tests, twice"]
fn the_page_of_10_000_tests_is_small() {
    let root = fresh_folder("large_pages");
    for objectives in [2, 3] {
        let folder = root.join(objectives.to_string());
        let front = generate(&folder, &plan(objectives), 10_000);
        let begun = Instant::now();
        let path = folder.join("report.html");
        report::write_page(&Repository::open(&folder).unwrap(), &path).unwrap();
        let (took, size) = (begun.elapsed().as_secs_f64(), fs::metadata(&path).unwrap().len());
        println!("{objectives} objectives, {front} tests on the front: {} kB, in {took:.1} s", size / 1000);
        assert!(size < 4_000_000, "{size} bytes");
    }
}
