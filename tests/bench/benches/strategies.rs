//! What strategies cost in addition to the simulations: seconds spent in whole campaigns of 100, 1,000 and 10,000 tests
//! in which nothing is simulated, and how they grow. With each test come its point, the front, the cells, and the rules
//! that stop.

use std::sync::Arc;
use std::time::{Duration, Instant};

use sesame_base::observation::{Counters, MetricObservation, Observation, OperationEffect, Outcome, WallTime};
use sesame_optimise::front::Front;
use sesame_plan::condition::{ConditionEnd, ConditionSpace, Integers, Variable};
use sesame_plan::{
    Activation, ActivationMode, BoostedChildren, Bound, CampaignPlan, CoverageGoal, Dimension, Exploration, MetricId,
    Requirement, Search, Span, StopRule, Strategy,
};
use sesame_rng::Stream;
use sesame_search as search;
use sesame_search::coverage::{Coverage, Grid};
use sesame_search::{Candidate, Evaluated, StopRules, sspr};

const FIXED: Exploration =
    Exploration::Boost { every_generations: 2, children: BoostedChildren::Every { iterations: 2 }, tries: 10 };
const LINEAR: Exploration = Exploration::Boost {
    every_generations: 1,
    children: BoostedChildren::Falling { first: 10, last: 1, drop: 1 },
    tries: 10,
};

/// The search with so many tests.
type Searched = fn(u32) -> Search;

fn nsga2(evaluations: u32) -> Search {
    Search::new(Strategy::Nsga2 { population: 10 }, evaluations)
}

fn interleaved(evaluations: u32) -> Search {
    Search::new(Strategy::Interleaved { keep_causes: false }, evaluations)
}

/// The row in which many tests violate the requirement, so that their causes are looked for.
const VIOLATED: &str = "`interleaved`, with violations";

/// The space of the benchmarks with the paper's cells, and a rule that looks at the front after each generation.
fn plan(search: Search, exploration: Option<Exploration>) -> CampaignPlan {
    let mut plan = sesame_bench::plan();
    let grid = Grid::parse("T1:0:1:6,T2:0:0.5:6,P1:0:1:3").expect("it is a grid");
    plan.campaign.coverage = Some(CoverageGoal { axes: grid.axes().to_vec(), hits: 1, stop_at: None });
    plan.campaign.search = search;
    if matches!(exploration, Some(Exploration::Predict { .. })) {
        let variable = Variable { metric: MetricId(1), unit: None, low: Some(0.0), high: Some(100.0), step: None };
        let integers = Integers { lowest: 1, highest: 100 };
        let end = ConditionEnd::Condition;
        let space = ConditionSpace { variables: vec![variable], depth: 4, integers, end, times: 3 };
        plan.campaign.activation = ActivationMode::Condition { space };
    }
    // Only falsification and the interleaved search need it, and it is hard to violate.
    let bound = Bound::AtLeast { value: -1e9 };
    plan.requirements.push(Requirement { name: "R1".to_owned(), text: String::new(), metric: MetricId(1), bound });
    plan.campaign.exploration = exploration;
    plan.campaign.stop =
        vec![StopRule::Discovery { below: 0.0 }, StopRule::Stagnation { generations: 1_000_000, below: 0.01 }];
    plan
}

/// A run as if everything had gone as planned; conditions hold at some time. The metric is a walk up and down.
fn observe(plan: &CampaignPlan, number: u32, operations: &[sesame_plan::TestOperation]) -> Observation {
    let mut stream = Stream::derive(1, "run", &[u64::from(number)]);
    let mut touched = 0.0;
    let effects = operations
        .iter()
        .map(|operation| {
            let interval = if let Activation::Time { start, end } = operation.activation {
                Span { start, end }
            } else {
                let start = stream.uniform(0.0, 500.0);
                Span { start, end: start + stream.uniform(1.0, 400.0) }
            };
            touched += interval.end - interval.start;
            OperationEffect {
                intervals: vec![interval],
                tails: Vec::new(),
                counters: Counters { seen: 100, changed: 100, ..Counters::default() },
                first_touch: Some(interval.start),
                last_touch: Some(interval.end),
            }
        })
        .collect();
    let level = touched * stream.uniform(0.0, 1.0);
    let series = (0u32..100).map(|at| (10.0 * f64::from(at), f64::from(at % 20) * 5.0)).collect();
    Observation {
        outcome: Outcome::Completed,
        end: plan.campaign.end_after,
        operations: effects,
        unheard: Vec::new(),
        unreached: Vec::new(),
        traffic: Vec::new(),
        course: None,
        altered: None,
        metrics: vec![
            MetricObservation::whole(Some(touched), true, Vec::new()),
            MetricObservation::whole(Some(-level), true, series),
        ],
        monitors: Vec::new(),
        messages: 10_000,
        warnings: Vec::new(),
        wall: WallTime::default(),
    }
}

/// Seconds that a campaign spends in addition to its runs.
fn spent(plan: &CampaignPlan) -> Duration {
    let mut spent = Duration::ZERO;
    let begun = Instant::now();
    let mut strategy = search::strategy(plan, 1).expect("the campaign can be searched");
    strategy.begin(&observe(plan, 0, &[]));
    let series = strategy.reads_series();
    let goal = plan.campaign.coverage.as_ref().expect("the campaign counts cells");
    let mut coverage = Coverage::new(Grid::new(goal.axes.clone()).expect("it is a grid"), goal.hits);
    let mut front = Front::default();
    let mut rules = StopRules::from_plan(plan);
    let mut number = 0;
    spent += begun.elapsed();
    loop {
        let begun = Instant::now();
        let asked = strategy.ask();
        spent += begun.elapsed();
        if asked.is_empty() {
            break;
        }
        let mut told = Vec::with_capacity(asked.len());
        for Candidate { test, .. } in asked {
            number += 1;
            let observation = observe(plan, number, &test.operations);
            let begun = Instant::now();
            let fitness = search::fitness(plan, &observation);
            front.add(number, &fitness);
            let point = sspr::observed_point(plan, &test, &observation);
            if let Some(point) = &point {
                coverage.add(point);
            }
            let run = Arc::new(if series { observation } else { observation.without_series() });
            told.push(Evaluated { number, test, fitness, point, run, fresh_runs: Vec::new() });
            spent += begun.elapsed();
        }
        let begun = Instant::now();
        strategy.tell(&told);
        rules.tell(&told);
        assert_eq!(rules.reached(Duration::ZERO), None, "every test of the budget is run");
        spent += begun.elapsed();
    }
    assert_eq!(number, plan.campaign.search.evaluations());
    spent
}

fn main() {
    // Cargo tells whether it measures or only tries that this works.
    let measured = std::env::args().any(|word| word == "--bench");
    let counts: &[u32] = if measured { &[100, 1_000, 10_000] } else { &[100] };
    // Words select the strategies whose names hold one of them.
    let words: Vec<String> = std::env::args().skip(1).filter(|word| !word.starts_with('-')).collect();
    let strategies: [(&str, Searched, Option<Exploration>); 13] = [
        ("`nsga2`", nsga2, None),
        ("`boost fixed`", nsga2, Some(FIXED)),
        ("`boost linear`", nsga2, Some(LINEAR)),
        ("`construct`", nsga2, Some(Exploration::Construct { share: 0.5, until: None })),
        ("`predict`", nsga2, Some(Exploration::Predict { candidates: 20 })),
        ("`map_elites`", |evaluations| Search::new(Strategy::MapElites { population: 10 }, evaluations), None),
        ("`random`", |evaluations| Search::new(Strategy::Random, evaluations), None),
        ("`latin_hypercube`", |evaluations| Search::new(Strategy::LatinHypercube, evaluations), None),
        ("`sobol`", |evaluations| Search::new(Strategy::Sobol, evaluations), None),
        ("`novelty`", nsga2, Some(Exploration::Novelty { neighbours: 10, over: Dimension::ALL.to_vec() })),
        ("`falsification`", |evaluations| Search::new(Strategy::Falsification { population: 1 }, evaluations), None),
        ("`interleaved`", interleaved, None),
        (VIOLATED, interleaved, None),
    ];
    let is_selected = |name: &str| words.is_empty() || words.iter().any(|word| name.contains(word.as_str()));
    println!("| strategy | {} |", counts.iter().map(u32::to_string).collect::<Vec<_>>().join(" | "));
    println!("|---|{}", "---:|".repeat(counts.len()));
    for (name, search, exploration) in strategies.into_iter().filter(|(name, ..)| is_selected(name)) {
        let row = counts.iter().map(|&count| {
            let mut plan = plan(search(count), exploration.clone());
            if name == VIOLATED {
                plan.requirements[0].bound = Bound::AtLeast { value: -300.0 };
            }
            // The quickest of five is the one least disturbed by other work of the machine; one that takes long is
            // disturbed little.
            let first = spent(&plan);
            let more = if measured && first < Duration::from_secs(1) { 4 } else { 0 };
            let quickest = (0..more).map(|_| spent(&plan)).fold(first, Duration::min);
            format!("{:.1} µs", 1e6 * quickest.as_secs_f64() / f64::from(count))
        });
        println!("| {name} | {} |", row.collect::<Vec<_>>().join(" | "));
    }
}
