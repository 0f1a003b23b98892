//! How often the strategies violate a requirement within 80 evaluations, on published problems compared with published
//! figures.

use std::fmt::Write as _;
use std::sync::Arc;

use sesame_base::observation::{MetricObservation, Observation, Outcome};
use sesame_dsl::analyse;
use sesame_dsl::source::SourceMap;
use sesame_optimise::dominance::Fitness;
use sesame_optimise::falsify::{Falsifier, Margin, Settings as FalsifierSettings, UnitBox};
use sesame_optimise::nsga2::{Nsga2, Settings, Survival, Told};
use sesame_optimise::problems::FalsificationProblem;
use sesame_optimise::problems::RealVariation;
use sesame_optimise::sobol::SobolPoints;
use sesame_plan::{Activation, CampaignPlan, Choice, Test, TestOperation};
use sesame_record::Repository;
use sesame_rng::{Stream, keyed_unit};
use sesame_search::Evaluated;
use sesame_tests::Project;

const BUDGET: u32 = 80;
/// The seeds that are reported. What is tuned, is tuned on mo3d with seeds from 1000 on.
const SEEDS: std::ops::RangeInclusive<u64> = 1..=50;

/// A space with requirements, and a campaign per search that this room is about.
const SPACE: &str = r#"
space falsified
system {
  simulator faulty = in_process "faulty_sim::Faulty" { crate "simulator"  step 10ms }
  topic level  = "faulty/level"         : real[m]
}

metric fuzzing_time minimise = fuzzing_time()
metric highest maximise default 0m = max(level) outbound

requirement R1 "The level stays low" = highest <= 5.5m

operation lift on level = random offset [0m, 3m] within [0s, 1s]
operation cut on level = packet loss [0%, 100%] within [0s, 1s]

campaign falsifying {
  objectives fuzzing_time, highest
  operations lift, cut   1..3 per test
  search     falsification { evaluations 24  population 2  seed 3 }
  end        after 1s
}
campaign even      from falsifying { search sobol { evaluations 24  seed 3 } }
campaign wandering from falsifying { search nsga2 { population 6  evaluations 24  seed 3 }  novelty { over T1, T2, O0 } }
"#;

/// A published problem as a campaign: what is left open in capitals.
const PROBLEM: &str = r#"
space published
system {
  simulator model = in_process "model_sim::Model" { crate "simulator"  step 100ms }
  topic a = "signal/a" : real
  topic b = "signal/b" : real
  topic c = "signal/c" : real
  topic first  = "margin/first"  : real
  topic second = "margin/second" : real
  topic third  = "margin/third"  : real
}
metric fuzzing_time minimise = fuzzing_time()
metric m1 minimise = min(first)
metric m2 minimise = min(second)
metric m3 minimise = min(third)
requirement R1 "The first margin is kept"  = m1 > 0
requirement R2 "The second margin is kept" = m2 > 0
requirement R3 "The third margin is kept"  = m3 > 0
OPERATIONS
campaign look { objectives OBJECTIVES  operations CHOICE per test  search SEARCH  end after 30s }
"#;

/// How a problem becomes a campaign.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Posed {
    /// Signals are stuck in windows of time; where none is, mo3d has 0, and the car half throttle and no brake.
    Windows,
    /// One operation before the start chooses all numbers: a test is a vector.
    Setup,
}

type Attempt = fn(FalsificationProblem, u64) -> Option<usize>;

const STRATEGIES: [(&str, Attempt); 5] = [
    ("falsification", falsification),
    ("nsga2, population 10", nsga2),
    ("random", random),
    ("latin_hypercube", latin_hypercube),
    ("sobol", sobol),
];

/// Evaluations until the first violation, of a search that asks for vectors and is told margins.
fn first_violation(
    problem: FalsificationProblem,
    mut ask: impl FnMut() -> Vec<Vec<f64>>,
    mut tell: impl FnMut(Vec<(Vec<f64>, Vec<f64>)>),
) -> Option<usize> {
    let mut evaluated = 0;
    loop {
        let batch = ask();
        if batch.is_empty() {
            return None;
        }
        let mut results = Vec::new();
        for x in batch {
            evaluated += 1;
            let margins = problem.margins(&x);
            if margins.iter().any(|&margin| margin <= 0.0) {
                return Some(evaluated);
            }
            results.push((x, margins));
        }
        tell(results);
    }
}

fn falsification(problem: FalsificationProblem, seed: u64) -> Option<usize> {
    let settings = FalsifierSettings { requirements: problem.requirements(), evaluations: BUDGET, batch: 1, seed };
    let search = std::cell::RefCell::new(Falsifier::new(UnitBox::new(problem.variables(), seed), settings));
    first_violation(
        problem,
        || search.borrow_mut().ask(),
        |results| {
            let margin = |value: f64| Margin { value: Some(value), violated: value <= 0.0 };
            let told = results.into_iter().map(|(x, margins)| (x, margins.into_iter().map(margin).collect()));
            search.borrow_mut().tell(told.collect());
        },
    )
}

/// The margins of all requirements are its objectives.
fn nsga2(problem: FalsificationProblem, seed: u64) -> Option<usize> {
    let settings = Settings { population: 10, evaluations: BUDGET, seed, survival: Survival::Crowded };
    let search = std::cell::RefCell::new(Nsga2::new(settings, RealVariation::usual(problem.variables(), seed)));
    let mut number = 0;
    first_violation(
        problem,
        || search.borrow_mut().ask().into_iter().map(|asked| asked.genome).collect(),
        |results| {
            let told = results.into_iter().map(|(genome, margins)| {
                number += 1;
                Told { number, genome, fitness: Fitness::Measured(margins) }
            });
            search.borrow_mut().tell(told);
        },
    )
}

/// The number of the first violation among vectors whose coordinates depend on nothing but their place.
fn sampled(problem: FalsificationProblem, mut value: impl FnMut(usize, u32) -> f64) -> Option<usize> {
    let mut all: Vec<Vec<f64>> =
        (0..BUDGET).map(|index| (0..problem.variables()).map(|variable| value(variable, index)).collect()).collect();
    first_violation(problem, || std::mem::take(&mut all), |_| {})
}

fn random(problem: FalsificationProblem, seed: u64) -> Option<usize> {
    sampled(problem, |variable, index| keyed_unit(seed, u64::from(index), variable as u64))
}

fn latin_hypercube(problem: FalsificationProblem, seed: u64) -> Option<usize> {
    let strata: Vec<Vec<usize>> = (0u64..)
        .take(problem.variables())
        .map(|variable| Stream::derive(seed, "strata", &[variable]).permutation(BUDGET as usize))
        .collect();
    sampled(problem, |variable, index| {
        let within = keyed_unit(seed, u64::from(index), variable as u64);
        (strata[variable][index as usize] as f64 + within) / f64::from(BUDGET)
    })
}

fn sobol(problem: FalsificationProblem, seed: u64) -> Option<usize> {
    let mut points = SobolPoints::new(seed);
    sampled(problem, |variable, index| points.value(variable, index))
}

/// The 95 % interval of Wilson for a share, in per cent.
fn wilson(hits: usize, of: usize) -> [f64; 2] {
    let (n, z) = (of as f64, 1.959_964);
    let share = hits as f64 / n;
    let middle = (share + z * z / (2.0 * n)) / (1.0 + z * z / n);
    let half = z / (1.0 + z * z / n) * (share * (1.0 - share) / n + z * z / (4.0 * n * n)).sqrt();
    [100.0 * (middle - half), 100.0 * (middle + half)]
}

/// Violations found, and the mean number of evaluations of those.
fn row(table: &mut String, problem: FalsificationProblem, name: &str, attempt: Attempt) -> usize {
    let found: Vec<usize> = SEEDS.filter_map(|seed| attempt(problem, seed)).collect();
    let [low, high] = wilson(found.len(), 50);
    let mean = found.iter().sum::<usize>() as f64 / found.len() as f64;
    let most = found.iter().max().map_or("–".to_owned(), ToString::to_string);
    writeln!(table, "| `{name}` | {} of 50 | {low:.0} to {high:.0} % | {mean:.1} | {most} |", found.len()).unwrap();
    found.len()
}

fn table(problem: FalsificationProblem, strategies: &[(&str, Attempt)]) -> (String, Vec<usize>) {
    let mut table = format!(
        "{}\n| strategy | violated within 80 | 95 % | evaluations of these, mean | at most |\n|---|---:|---:|---:|---:|\n",
        problem.name()
    );
    let found = strategies.iter().map(|(name, attempt)| row(&mut table, problem, name, *attempt)).collect();
    (table, found)
}

/// What a campaign searches by, in its own words, and its objectives.
const SEARCHES: [(&str, &str, &str); 6] = [
    ("falsification", "falsification { evaluations 80 }", "m1, m2, m3"),
    ("nsga2, objectives the margins", "nsga2 { population 10  evaluations 80 }", "m1, m2, m3"),
    ("nsga2, and the disturbance", "nsga2 { population 10  evaluations 80 }", "fuzzing_time, m1, m2, m3"),
    ("random", "random { evaluations 80 }", "m1, m2, m3"),
    ("latin_hypercube", "latin_hypercube { evaluations 80 }", "m1, m2, m3"),
    ("sobol", "sobol { evaluations 80 }", "m1, m2, m3"),
];

/// The plan of a problem that is a campaign.
fn posed(problem: FalsificationProblem, posed: Posed, search: &str, objectives: &str) -> CampaignPlan {
    let pieces = |names: [&str; 2]| -> String {
        names.iter().flat_map(|name| (1..=6).map(move |piece| format!("{name}{piece}: real [0, 1]  "))).collect()
    };
    let (operations, choice) = match (problem, posed) {
        (FalsificationProblem::Mo3d, Posed::Windows) => (
            ["a", "b", "c"].map(|name| format!("operation on_{name} on {name} = stuck at [-15, 15]\n")).concat(),
            "on_a, on_b, on_c 3",
        ),
        (FalsificationProblem::Transmission, Posed::Windows) => (
            "operation throttle on a = stuck at [0, 1]\noperation brake on b = stuck at [0, 1]".to_owned(),
            "throttle, brake 2..12",
        ),
        (FalsificationProblem::Mo3d, Posed::Setup) => (
            "operation setup = custom before start { a: real [-15, 15]  b: real [-15, 15]  c: real [-15, 15] }"
                .to_owned(),
            "setup 1",
        ),
        (FalsificationProblem::Transmission, Posed::Setup) => {
            (format!("operation setup = custom before start {{ {} }}", pieces(["throttle", "brake"])), "setup 1")
        }
    };
    let text = PROBLEM
        .replace("OPERATIONS", &operations)
        .replace("OBJECTIVES", objectives)
        .replace("CHOICE", choice)
        .replace("SEARCH", search);
    let mut sources = SourceMap::new();
    let file = sources.add("published.sesame", text.as_str());
    let analysis = analyse(&sources, file);
    let space = analysis.model.unwrap_or_else(|| panic!("{text}\n{:#?}", analysis.diagnostics));
    sesame_codegen::lower::lower(&space, space.campaign("look").unwrap(), "published.sesame", "sesamec").plan
}

/// Active time, and the least margins of a run of 30 s.
fn run(problem: FalsificationProblem, plan: &CampaignPlan, test: &Test) -> (f64, Vec<f64>) {
    let chosen = |operation: &TestOperation| -> Vec<f64> {
        let value = |choice: &Choice| if let Choice::Value { value } = choice { *value } else { panic!("{choice:?}") };
        operation.parameters.iter().map(value).collect()
    };
    let unit = |value: f64| if problem == FalsificationProblem::Mo3d { (value + 15.0) / 30.0 } else { value };
    if test.operations[0].activation == Activation::Offline {
        let vector: Vec<f64> = chosen(&test.operations[0]).into_iter().map(unit).collect();
        return (0.0, problem.margins(&vector));
    }
    // What a signal is at a time: of several operations on it the last one decides.
    let signal = |topic: usize, default: f64, time: f64| {
        let on = |operation: &&TestOperation| {
            let Activation::Time { start, end } = operation.activation else { panic!("by time") };
            let of = plan.operation(operation.operation).topic.unwrap().index();
            of == topic && start <= time && time < end
        };
        test.operations.iter().rfind(on).map_or(default, |operation| unit(chosen(operation)[0]))
    };
    let length = |operation: &TestOperation| match operation.activation {
        Activation::Time { start, end } => end - start,
        _ => 0.0,
    };
    let active = test.operations.iter().map(length).sum();
    let margins = if problem == FalsificationProblem::Mo3d {
        let at = |step: u32| problem.margins(&[0, 1, 2].map(|topic| signal(topic, 0.5, f64::from(step) / 10.0)));
        (0..300).map(at).reduce(|a, b| a.iter().zip(b).map(|(a, b)| a.min(b)).collect()).unwrap()
    } else {
        let pieces = |topic, default| (0..6).map(move |piece| (topic, default, 5.0 * f64::from(piece) + 2.5));
        let all = pieces(0, 0.5).chain(pieces(1, 0.0)).map(|(topic, default, time)| signal(topic, default, time));
        problem.margins(&all.collect::<Vec<f64>>())
    };
    (active, margins)
}

/// Tests until the first violation of a requirement, of a campaign with this seed.
fn tests_until_violated(problem: FalsificationProblem, plan: &CampaignPlan, seed: u64) -> Option<usize> {
    let mut strategy = sesame_search::strategy(plan, seed).unwrap();
    let mut number = 0;
    loop {
        let batch = strategy.ask();
        if batch.is_empty() {
            return None;
        }
        let mut results = Vec::new();
        for candidate in batch {
            number += 1;
            let (active, margins) = run(problem, plan, &candidate.test);
            let value = |name: &str| match name {
                "m1" => margins[0],
                "m2" => margins[1],
                "m3" => margins[2],
                _ => active,
            };
            let mut run = Observation::without_run(Outcome::Completed);
            let metrics = plan.metrics.iter().map(|metric| Some(value(&metric.name)));
            run.metrics = metrics.map(|value| MetricObservation::whole(value, true, Vec::new())).collect();
            if sesame_search::margins(plan, &run).iter().any(|margin| margin.violated) {
                return Some(number);
            }
            results.push(Evaluated {
                number: u32::try_from(number).unwrap(),
                test: candidate.test,
                fitness: sesame_search::fitness(plan, &run),
                point: None,
                run: Arc::new(run),
                fresh_runs: Vec::new(),
            });
        }
        strategy.tell(&results);
    }
}

fn row_of_campaigns(table: &mut String, problem: FalsificationProblem, how: Posed, search: usize) -> usize {
    let (name, text, objectives) = SEARCHES[search];
    let plan = posed(problem, how, text, objectives);
    let found: Vec<usize> = SEEDS.filter_map(|seed| tests_until_violated(problem, &plan, seed)).collect();
    let [low, high] = wilson(found.len(), 50);
    let mean = found.iter().sum::<usize>() as f64 / found.len() as f64;
    let most = found.iter().max().map_or("–".to_owned(), ToString::to_string);
    writeln!(table, "| `{name}` | {} of 50 | {low:.0} to {high:.0} % | {mean:.1} | {most} |", found.len()).unwrap();
    found.len()
}

#[test]
fn campaigns_of_vectors_find_violations_as_the_vectors_themselves_do() {
    let problem = FalsificationProblem::Mo3d;
    let plan = posed(problem, Posed::Setup, SEARCHES[0].1, SEARCHES[0].2);
    for seed in 1..=5 {
        assert_eq!(tests_until_violated(problem, &plan, seed), falsification(problem, seed), "seed {seed}");
    }
}

/// Prints the tables of docs/falsification.md. Nothing is asserted of the car disturbed in windows: there falsification
/// does no better than chance.
#[test]
#[ignore = "long: 1,200 searches, half of them of a simulated car"]
fn strategies_on_published_falsification_problems_as_campaigns() {
    for problem in FalsificationProblem::ALL {
        for how in [Posed::Windows, Posed::Setup] {
            let mut table = format!("{}, {how:?}\n", problem.name());
            let found: Vec<usize> =
                (0..SEARCHES.len()).map(|search| row_of_campaigns(&mut table, problem, how, search)).collect();
            println!("{table}");
            let chance_is_as_good = problem == FalsificationProblem::Transmission && how == Posed::Windows;
            assert!(chance_is_as_good || found[1..].iter().all(|&other| other <= found[0]), "{table}");
        }
    }
}

#[test]
fn runners_search_so_with_any_number_of_workers() {
    let project = Project::new("falsified", SPACE, "faulty");
    for campaign in ["falsifying", "even", "wandering"] {
        let runner = project.build(campaign);
        let whole = runner.run(&["--results", "whole", "--workers", "2"]).expect(0);
        let repository = Repository::open(&runner.folder.join("whole/3")).unwrap();
        // The search, and a reference run before and after it.
        assert_eq!(repository.tests().unwrap().len(), 26, "{campaign}");
        assert_eq!(runner.run(&["--results", "alone", "--workers", "1"]).expect(0).digest(), whole.digest());
        if campaign == "falsifying" {
            let bred = |number| !repository.test(number).unwrap().parents.is_empty();
            assert!((1..=24).any(bred), "some tests come from others");
        }
    }
}

#[test]
fn falsification_is_surer_than_the_best_published_on_mo3d() {
    let (table, found) = table(FalsificationProblem::Mo3d, &STRATEGIES[..2]);
    assert!(found[0] > 46 && found[1] < found[0], "{table}");
}

#[test]
fn intervals_of_shares_are_those_of_wilson() {
    let [low, high] = wilson(46, 50);
    assert!((low - 81.2).abs() < 0.05 && (high - 96.8).abs() < 0.05, "{low} to {high}");
    assert!((wilson(50, 50)[0] - 92.9).abs() < 0.05);
}

#[test]
#[ignore = "long: 500 searches, half of them of a simulated car"]
fn strategies_on_published_falsification_problems() {
    for problem in FalsificationProblem::ALL {
        let (table, found) = table(problem, &STRATEGIES);
        println!("{table}");
        assert!(found[1..].iter().all(|&other| other <= found[0]), "{table}");
    }
}
