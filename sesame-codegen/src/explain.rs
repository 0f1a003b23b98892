//! A campaign as its runner understands it, for people: everything that was left out is written out, and what its
//! search grows conditions from is a grammar.
//!
//! The first part is `.sesame` text that has the same plan as the campaign it explains.

use std::fmt::Write as _;

use sesame_plan::condition::{Comparison, ConditionEnd, ConditionSpace, Constraint, Integers, Variable};
use sesame_plan::{
    ActivationMode, BoostedChildren, CampaignPlan, Confirmation, Copies, CoverageGoal, Distribution, Domain, Drain,
    Exploration, MetricSource, Operation, OperationKind, Parameter, Recorded, Search, Statistic, StopRule,
    place_in_words,
};

/// More whole numbers than these are not written out one by one.
const INTEGERS_SHOWN: i128 = 40;

/// The campaign of a plan with its defaults and its operations, and the grammar of its conditions if it has one.
pub fn campaign(plan: &CampaignPlan) -> String {
    let mut out = format!("// {}, with every default written out\n", plan.source);
    for operation in &plan.operations {
        writeln!(out, "{}", operation_line(plan, operation)).expect("a string takes all text");
    }
    out.push('\n');
    for line in plan.campaign.doc.lines() {
        writeln!(out, "{}", format!("/// {line}").trim_end()).expect("a string takes all text");
    }
    writeln!(out, "campaign {} {{", plan.campaign.name).expect("a string takes all text");
    for (word, clause) in clauses(plan) {
        writeln!(out, "  {word:<10} {clause}").expect("a string takes all text");
    }
    out.push_str("}\n");
    if let ActivationMode::Condition { space } = &plan.campaign.activation {
        out.push('\n');
        out.push_str(&grammar(plan, space));
    }
    out
}

fn clauses(plan: &CampaignPlan) -> Vec<(&'static str, String)> {
    let campaign = &plan.campaign;
    let metric = |index: usize| plan.metrics[index].name.clone();
    let objectives: Vec<String> = campaign.objectives.iter().map(|id| metric(id.index())).collect();
    let observed: Vec<String> = plan.metrics.iter().map(|metric| metric.name.clone()).collect();
    let observed: Vec<String> = observed.into_iter().filter(|name| !objectives.contains(name)).collect();
    let mut clauses = Vec::new();
    if !objectives.is_empty() {
        clauses.push(("objectives", objectives.join(", ")));
    }
    if !observed.is_empty() {
        clauses.push(("observes", observed.join(", ")));
    }
    let seed = campaign.seed;
    let neighbours = campaign.neighbours.map_or(String::new(), |count| format!("  neighbours {count}"));
    let searches = match &campaign.search {
        Search::Strategy { strategy, evaluations } => {
            let (keyword, settings) = (strategy.kind().properties().keyword, strategy.settings());
            format!("{keyword} {{ {settings}evaluations {evaluations}  seed {seed}{neighbours} }}")
        }
        Search::Repeat { test, times } => {
            let test = &plan.tests[test.index()];
            // Only a campaign that observes has a test without operations.
            clauses.push(match test.test.operations.as_slice() {
                [] => ("passive", format!("{times} times {{ seed {seed} }}")),
                _ => ("repeat", format!("{} {times} times {{ seed {seed} }}", test.name)),
            });
            clauses.extend(record(plan));
            clauses.push(("end", format!("after {}s", campaign.end_after)));
            return clauses;
        }
    };
    let operations: Vec<&str> =
        campaign.operations.iter().map(|id| plan.operations[id.index()].name.as_str()).collect();
    let count = campaign.count;
    let copies = match campaign.copies {
        Copies::Apart => "",
        Copies::MayOverlap => " may overlap",
        Copies::Once => " each at most once",
    };
    let operations = format!("{}   {}..{} per test{copies}", operations.join(", "), count.min, count.max);
    clauses.push(("operations", operations));
    clauses.push(("activate", format!("by {}", activation(plan, &campaign.activation))));
    clauses.push(("search", searches));
    if let Some(goal) = &campaign.coverage {
        clauses.push(("coverage", coverage(goal)));
    }
    if let Some(exploration) = &campaign.exploration {
        clauses.push(explored(exploration));
    }
    if let Some(Confirmation { times, by, violations }) = campaign.confirm {
        let by = match by {
            Statistic::Mean => "mean".to_owned(),
            Statistic::Median => "median".to_owned(),
            Statistic::Quantile { share } => format!("quantile {}%", percent(share)),
        };
        let violations = if violations { "  violations" } else { "" };
        clauses.push(("confirm", format!("{times} times {{ by {by}{violations} }}")));
    }
    if !campaign.stop.is_empty() {
        let rules: Vec<String> = campaign.stop.iter().map(stop_rule).collect();
        clauses.push(("stop", format!("{{ {} }}", rules.join("  "))));
    }
    clauses.extend(record(plan));
    clauses.push(("end", format!("after {}s", campaign.end_after)));
    clauses
}

/// A failsafe has become the number of evaluations.
fn coverage(goal: &CoverageGoal) -> String {
    let axes = goal
        .axes
        .iter()
        .map(|axis| format!("{} [{}, {}] cells {}   ", axis.dimension.name(), axis.low, axis.high, axis.cells));
    let stop = goal.stop_at.map(|share| format!("   stop at {}%", percent(share))).unwrap_or_default();
    format!("{{ {}hits {}{stop} }}", axes.collect::<String>(), goal.hits)
}

/// The clause of an exploration.
fn explored(exploration: &Exploration) -> (&'static str, String) {
    match exploration {
        Exploration::Boost { every_generations, children, tries } => {
            let (kind, children) = match children {
                BoostedChildren::Every { iterations } => ("fixed", format!("every {iterations} iterations")),
                BoostedChildren::Falling { first, last, drop } => {
                    ("linear", format!("from {first} to {last}  drop {drop}"))
                }
            };
            ("boost", format!("{kind} {{ every {every_generations} generations  {children}  tries {tries} }}"))
        }
        Exploration::Construct { share, until } => {
            let until = until.map_or(String::new(), |until| format!("  until {}%", percent(until)));
            ("construct", format!("{{ share {}%{until} }}", percent(*share)))
        }
        Exploration::Novelty { neighbours, over } => {
            let over: Vec<&str> = over.iter().map(|dimension| dimension.name()).collect();
            ("novelty", format!("{{ neighbours {neighbours}  over {} }}", over.join(", ")))
        }
        Exploration::Predict { candidates } => ("predict", format!("{{ candidates {candidates} }}")),
    }
}

fn stop_rule(rule: &StopRule) -> String {
    match *rule {
        StopRule::WallTime { seconds } => format!("time {seconds}s"),
        StopRule::Stagnation { generations, below } => {
            format!("stagnation {generations} generations below {}%", percent(below))
        }
        StopRule::Discovery { below } => format!("discovery below {}%", percent(below)),
        StopRule::Completeness { share } => format!("completeness {}%", percent(share)),
    }
}

fn record(plan: &CampaignPlan) -> Option<(&'static str, String)> {
    let which = match plan.campaign.record? {
        Recorded::Failing => "failing",
        Recorded::All => "all",
    };
    Some(("record", format!("mcap {which}")))
}

fn activation(plan: &CampaignPlan, mode: &ActivationMode) -> String {
    let ActivationMode::Condition { space } = mode else { return "time".to_owned() };
    let variables = space.variables.iter().map(|variable| {
        let metric = &plan.metrics[variable.metric.index()];
        match (variable.low, variable.high) {
            (Some(low), Some(high)) => format!("{} in {}", metric.name, range(low, high, metric.unit.as_deref())),
            // What is known of one end only follows from the metric itself.
            _ => metric.name.clone(),
        }
    });
    let variables = variables.collect::<Vec<_>>().join(", ");
    let Integers { lowest, highest } = space.integers;
    let end = match space.end {
        ConditionEnd::Condition => String::new(),
        ConditionEnd::Length { low, high } => format!(" for {}", range(low, high, Some("s"))),
    };
    format!(
        "condition over {variables} {{ depth {}  integers [{lowest}, {highest}] }}{end} at most {} times",
        space.depth, space.times
    )
}

fn operation_line(plan: &CampaignPlan, operation: &Operation) -> String {
    let mut line = format!("operation {}", operation.name);
    if let Some(topic) = operation.topic {
        let topic = plan.topic(topic).name.as_str();
        let mut targets: Vec<String> =
            operation.places.iter().map(|place| format!("{topic}{}", place_in_words(place))).collect();
        if targets.is_empty() {
            targets.push(topic.to_owned());
        }
        line = format!("{line} on {}", targets.join(", "));
    }
    line = format!("{line} = {}", disturbance(operation));
    if !operation.kind.is_offline() {
        let within = range(operation.within.start, operation.within.end, Some("s"));
        line = format!("{line} within {within}");
    }
    line = format!("{line} priority {} inclusion {}%", operation.priority, percent(operation.inclusion));
    if !operation.timed {
        line.push_str(" untimed");
    }
    if !operation.constraints.is_empty() {
        line = format!("{line} start contains {}", contained(plan, operation).join(", "));
    }
    line
}

/// What an operation does and permits, as the language has it.
fn disturbance(operation: &Operation) -> String {
    let words = operation.kind.words();
    let probability = operation.kind.has_probabilities();
    let permitted: Vec<String> = operation.parameters.iter().map(|it| permitted(it, probability)).collect();
    match &operation.kind {
        OperationKind::Custom { .. } => {
            let parameters = operation.parameters.iter().map(|it| format!("{}: {}  ", it.name, domain(it)));
            format!("{words} {{ {}}}", parameters.collect::<String>())
        }
        OperationKind::RandomText { texts } => format!("{words} {}", quoted(texts)),
        OperationKind::RandomValue { .. } if operation.parameters.len() == 3 => {
            let ends = |high: bool| {
                let end = |it: &Parameter| match it.domain {
                    Domain::Number { low, high: most, .. } => if high { most } else { low }.to_string(),
                    _ => String::new(),
                };
                let [x, y, z] = [0, 1, 2].map(|axis| end(&operation.parameters[axis]));
                format!("({x}, {y}, {z}){}", operation.parameters[0].unit.as_deref().unwrap_or_default())
            };
            format!("{words} [{}, {}]", ends(false), ends(true))
        }
        OperationKind::BurstLoss => {
            let clauses =
                operation.parameters.iter().zip(&permitted).map(|(it, range)| format!("{} {range}  ", it.name));
            let whole = operation.parameters.iter().all(|it| it.name != "loss");
            let loss = if whole { "loss [100%, 100%]  " } else { "" };
            format!("{words} {{ {}{loss}}}", clauses.collect::<String>())
        }
        OperationKind::Latency { distribution, drain } => {
            let distribution = match distribution {
                Distribution::Fixed => "fixed",
                Distribution::Uniform => "uniform",
                Distribution::Normal => "normal",
            };
            format!("{words} {} {distribution} drain {}", permitted.join(" "), drain_word(*drain))
        }
        OperationKind::Reorder { drain } => format!("{words} {} drain {}", permitted.join(" "), drain_word(*drain)),
        _ if permitted.is_empty() => words.to_owned(),
        _ => format!("{words} {}", permitted.join(" ")),
    }
}

fn drain_word(drain: Drain) -> &'static str {
    match drain {
        Drain::Finish => "finish",
        Drain::Flush => "flush",
        Drain::Drop => "drop",
    }
}

/// What is permitted for a parameter of any operation but a custom one.
fn permitted(parameter: &Parameter, probability: bool) -> String {
    let unit = parameter.unit.as_deref();
    match &parameter.domain {
        Domain::Number { low, high, .. } if probability => format!("[{}%, {}%]", percent(*low), percent(*high)),
        Domain::Number { low, high, .. } => range(*low, *high, unit),
        Domain::Point { low, high } => {
            let point = |[x, y, z]: [f64; 3]| format!("({x}, {y}, {z}){}", unit.unwrap_or_default());
            format!("[{}, {}]", point(*low), point(*high))
        }
        Domain::Texts { texts: items } | Domain::Files { files: items } => format!("one of {}", quoted(items)),
    }
}

fn quoted(items: &[String]) -> String {
    items.iter().map(|item| sesame_dsl::quoted(item)).collect::<Vec<_>>().join(", ")
}

/// What a parameter of a custom operation permits.
fn domain(parameter: &Parameter) -> String {
    let unit = parameter.unit.as_deref().unwrap_or_default();
    match &parameter.domain {
        Domain::Number { low, high, integer, .. } => {
            let word = if *integer { "int" } else { "real" };
            format!("{word} {}", range(*low, *high, parameter.unit.as_deref()))
        }
        Domain::Point { low, high } => {
            let point = |[x, y, z]: [f64; 3]| format!("({x}, {y}, {z}){unit}");
            format!("point [{}, {}]", point(*low), point(*high))
        }
        Domain::Texts { texts } => format!("one of {}", quoted(texts)),
        Domain::Files { files } => format!("file one of {}", quoted(files)),
    }
}

fn contained(plan: &CampaignPlan, operation: &Operation) -> Vec<String> {
    let constraints = operation.constraints.iter().map(|constraint| match *constraint {
        Constraint::Variable { metric } => plan.metrics[metric.index()].name.clone(),
        Constraint::Integer { bounds } => format!("integer [{}, {}]", bounds.lowest, bounds.highest),
    });
    constraints.collect()
}

/// The conditions that a search grows, in the notation of ISO 14977. The names are those of the paper's Table 1.
fn grammar(plan: &CampaignPlan, space: &ConditionSpace) -> String {
    let name = |variable: &Variable| plan.metrics[variable.metric.index()].name.as_str();
    let signs = [Comparison::Below, Comparison::Above, Comparison::Equal].map(|by| format!("\"{}\"", by.sign()));
    let variables: Vec<String> = space.variables.iter().map(|variable| format!("\"{}\"", name(variable))).collect();
    let Integers { lowest, highest } = space.integers;
    let integers = if i128::from(highest) - i128::from(lowest) < INTEGERS_SHOWN {
        (lowest..=highest).map(|integer| format!("\"{integer}\"")).collect::<Vec<_>>().join(" | ")
    } else {
        format!("? a whole number from {lowest} to {highest} ?")
    };
    let rules = [
        ("compCond", "compCond, logicOp, compCond | basicCond".to_owned()),
        ("basicCond", "expr, binComp, var".to_owned()),
        ("expr", "var | int".to_owned()),
        ("logicOp", "\"and\" | \"or\"".to_owned()),
        ("binComp", signs.join(" | ")),
        ("int", integers),
        ("var", variables.join(" | ")),
    ];
    let mut out = format!("(* the conditions of {}, in EBNF *)\n", plan.campaign.name);
    for (left, right) in rules {
        writeln!(out, "{left:<9} = {right} ;").expect("a string takes all text");
    }
    let mut notes = vec![match space.depth {
        1 => "a condition has 1 level: it is one comparison".to_owned(),
        depth => format!("a condition has at most {depth} levels; a comparison alone is one"),
    }];
    notes.push("no comparison is of a variable with itself or decided by what is known of its variables".to_owned());
    for variable in &space.variables {
        let metric = &plan.metrics[variable.metric.index()];
        let unit = metric.unit.as_deref().unwrap_or_default();
        let known = match (variable.low, variable.high) {
            (Some(low), Some(high)) => Some(format!("is in {}", range(low, high, metric.unit.as_deref()))),
            (Some(low), None) => Some(format!("is {low}{unit} or more")),
            (None, Some(high)) => Some(format!("is {high}{unit} or less")),
            (None, None) => None,
        };
        let compared = (!unit.is_empty()).then(|| format!("is compared with whole numbers of {unit}"));
        let initial = match (&metric.source, metric.initial) {
            (MetricSource::FuzzingTime, _) => None,
            (_, Some(initial)) => Some(format!("is {initial}{unit} before it is first set")),
            (_, None) => Some("is unknown before it is first set".to_owned()),
        };
        let said: Vec<String> = known.into_iter().chain(compared).chain(initial).collect();
        notes.push(format!("{} {}", metric.name, said.join(", ")));
    }
    for operation in plan.operations.iter().filter(|operation| !operation.constraints.is_empty()) {
        let contained = contained(plan, operation).join(", ");
        notes.push(format!("the start condition of {} contains {contained}", operation.name));
    }
    notes.push(match space.end {
        ConditionEnd::Condition => "an activation ends by a condition of its own, of the same grammar".to_owned(),
        ConditionEnd::Length { low, high } => format!("an activation lasts from {low}s to {high}s"),
    });
    notes.push(match space.times {
        1 => "an operation is activated at most once in a test".to_owned(),
        times => format!("an operation is activated at most {times} times in a test"),
    });
    for note in notes {
        writeln!(out, "(* {note} *)").expect("a string takes all text");
    }
    out
}

fn range(low: f64, high: f64, unit: Option<&str>) -> String {
    let unit = unit.unwrap_or_default();
    format!("[{low}{unit}, {high}{unit}]")
}

/// A probability in per cent: the decimals that are read as exactly this probability.
fn percent(probability: f64) -> f64 {
    let scientific = format!("{probability:e}");
    let (digits, exponent) = scientific.split_once('e').expect("a number in scientific notation has an exponent");
    let exponent: i32 = exponent.parse().expect("an exponent is a small whole number");
    format!("{digits}e{}", exponent + 2).parse().expect("digits and an exponent are a number")
}

#[cfg(test)]
mod tests {
    use sesame_dsl::source::SourceMap;

    use super::*;

    const CELL: &str = r#"
        space cell
        system {
          simulator sim = in_process "cell_sim::Cell" { crate "simulator"  step 20ms }
          message Zone { name: text  level: real[mm] }
          topic link = "link" : real[rad]
          topic zones = "zones/{A,B}" : Zone
        }
        metric collisions maximise default 0 { hook on zones }
        metric near initial 9 = last(zones.level / 1mm)
        metric pace: real[m/s] { hook on link }
        metric time minimise = fuzzing_time()
        requirement R1 "nothing is hit" = collisions <= 0
        test still { lose loss 7% when near > 1 until near < 0.5 at most 2 times }
    "#;
    const OPERATIONS: &str = "
        operation swing on link = random offset [-18deg, 18deg] within [0s, 1min] start contains near, integer [2, 3]
        operation level on zones.level = random absolute [0m, 1m] inclusion 7%
        operation roam on zones.level = random walk [0m, 5mm]
        operation lose on link = packet loss [0%, 7%] priority -1
        operation lag on link = latency [0ms, 300ms] uniform drain drop
        operation late on link = latency [0.1s, 0.7s]
        operation cut on zones = blackhole untimed
        operation bend on link = custom {
          points: int [3, 20]  gain: real [0.5, 2]  reach: real[mm] [-10cm, 1m]
          shift: point [(-2, -2, 0)m, (2, 2, 0.5)m]  frame: one of \"a \\\"b\\\"\", \"c\"
          map: file one of \"maps/hall.yaml\", \"other.yaml\"
        } within [1s, 50s] start contains near
        operation spoil = custom before start { file: file one of \"a.yaml\" } inclusion 30%
        operation tidy = custom after end { } priority 2
    ";
    const EVERYTHING: &str = "
        /// Of two
        ///
        /// paragraphs.
        campaign all { objectives time, collisions  operations swing, level, lose, lag, late, cut, bend, spoil, tidy 1..3 per test
          activate by condition over near in [0, 10], pace in [-1km/h, 36km/h], time { integers [-3, 30] }
            for [1s, 15s] at most 3 times
          search nsga2 { population 4  evaluations 8 }  end after 1min }";
    const DEFAULTS: &str = "
        campaign some { objectives time  operations cut, swing 1 per test may overlap
          activate by condition over near, collisions { integers [1, 1000]  depth 1 }
          search random { evaluations 8  seed 7 }  end after 70s }";
    const BY_TIME: &str = "
        campaign timed { objectives time  operations cut, swing, roam 1 per test  observes pace
          search random { evaluations 8 }  record mcap failing  end after 70s
          coverage { T1 [0, 1] cells 6  O0 [0.5, 1.5] cells 1  hits 2  stop at 7%  failsafe 30 } }";
    const BOOSTED: &str = "
        campaign boosted { objectives time  operations cut, swing 1..3 per test
          search nsga2 { population 4  evaluations 8 }  confirm 5 times
          coverage { T1 [0, 1] cells 6  O0 [0.5, 3.5] cells 3  hits 2  stop at 50% }
          boost linear { every 3 generations  from 4 to 1 }  end after 70s }";
    const CONSTRUCTED: &str = "
        campaign constructed { objectives time  operations cut, swing 1..3 per test
          search nsga2 { population 4  evaluations 8  neighbours 3 }  confirm 10 times { by quantile 90% }
          coverage { T1 [0, 1] cells 6 }  construct { share 30%  until 7% }
          stop { time 1.5h  stagnation 5 generations below 2%  discovery below 3%  completeness 90% }  end after 70s }";
    const PREDICTED: &str = "
        campaign predicted { objectives time  operations cut, swing 1..3 per test
          activate by condition over near, collisions
          search nsga2 { population 4  evaluations 8 }
          coverage { T1 [0, 1] cells 6 }  predict { }  end after 70s }";
    const ELITES: &str = "
        campaign elites { objectives time  operations cut, swing 1..3 per test
          search map_elites { population 4  evaluations 8 }  confirm 2 times { by median  violations }  coverage { T1 [0, 1] cells 6 }  end after 70s }";
    const LATIN: &str = "
        campaign latin { objectives time  operations cut, swing 1..2 per test each at most once
          search latin_hypercube { evaluations 8 }  end after 70s }";
    const SOBOL: &str = "
        campaign even { objectives time  operations cut, swing 1..3 per test
          search sobol { evaluations 8 }  end after 70s }";
    const FALSIFIED: &str = "
        campaign falsified { objectives time  operations cut, swing 1..3 per test
          search falsification { evaluations 8  population 2 }  end after 70s }";
    const NOVEL: &str = "
        campaign novel { objectives time  operations cut, swing 1..3 per test
          search nsga2 { population 4  evaluations 8 }  novelty { over T1, O2 }  end after 70s }";
    const AGAIN: &str = "campaign again { repeat still 3 times  end after 70s  record mcap failing }";
    const WATCH: &str = "campaign watch { passive 3 times { seed 4 }  observes near  end after 70s  record mcap all }";

    fn plan(campaign: &str) -> CampaignPlan {
        let mut sources = SourceMap::new();
        let file = sources.add("cell.sesame", format!("{CELL}{campaign}"));
        let analysis = sesame_dsl::analyse(&sources, file);
        let space = analysis.model.unwrap_or_else(|| panic!("{campaign}\n{:#?}", analysis.diagnostics));
        let id = space.campaigns.iter().next().expect("there is a campaign").0;
        crate::lower::lower(&space, id, "cell.sesame", "sesamec 0.0.0").plan
    }

    #[test]
    fn what_is_explained_has_the_same_plan() {
        let texts = [
            EVERYTHING,
            DEFAULTS,
            BY_TIME,
            BOOSTED,
            CONSTRUCTED,
            PREDICTED,
            ELITES,
            LATIN,
            SOBOL,
            FALSIFIED,
            NOVEL,
            AGAIN,
            WATCH,
        ];
        for text in texts {
            // Operations that a campaign leaves out are still needed by the known test.
            let original = plan(&format!("{OPERATIONS}{text}"));
            let explained = campaign(&original);
            let mut source = explained.split("\n(* ").next().expect("there is a first part").to_owned();
            if !source.contains("operation lose") {
                source.push_str("operation lose on link = packet loss [0%, 7%] priority -1");
            }
            assert_eq!(plan(&source), original, "{explained}");
        }
    }

    #[test]
    fn a_campaign_by_condition_with_everything_said() {
        insta::assert_snapshot!(campaign(&plan(&format!("{OPERATIONS}{EVERYTHING}"))));
    }

    #[test]
    fn a_campaign_by_condition_with_defaults() {
        insta::assert_snapshot!(campaign(&plan(&format!("{OPERATIONS}{DEFAULTS}"))));
    }

    #[test]
    fn explorations_with_their_defaults() {
        let explained =
            [BOOSTED, CONSTRUCTED, PREDICTED, NOVEL].map(|text| campaign(&plan(&format!("{OPERATIONS}{text}"))));
        let clauses = explained.iter().flat_map(|text| text.lines()).map(str::trim).filter(|line| {
            ["coverage", "boost", "construct", "predict", "novelty", "confirm", "stop"]
                .iter()
                .any(|word| line.starts_with(&format!("{word} ")))
        });
        insta::assert_snapshot!(clauses.collect::<Vec<_>>().join("\n"), @r"
coverage   { T1 [0, 1] cells 6   O0 [0.5, 3.5] cells 3   hits 2   stop at 50% }
boost      linear { every 3 generations  from 4 to 1  drop 1  tries 10 }
confirm    5 times { by mean }
coverage   { T1 [0, 1] cells 6   hits 1 }
construct  { share 30%  until 7% }
confirm    10 times { by quantile 90% }
stop       { time 5400s  stagnation 5 generations below 2%  discovery below 3%  completeness 90% }
coverage   { T1 [0, 1] cells 6   hits 1 }
predict    { candidates 20 }
novelty    { neighbours 10  over T1, O2 }
        ");
    }

    #[test]
    fn a_repetition() {
        insta::assert_snapshot!(campaign(&plan(&format!("{OPERATIONS}{AGAIN}"))));
    }

    #[test]
    fn a_campaign_that_only_observes() {
        insta::assert_snapshot!(campaign(&plan(&format!("{OPERATIONS}{WATCH}"))));
    }

    #[test]
    fn the_reference_shows_a_grammar_as_it_is_printed() {
        let explained = campaign(&plan(
            "metric made = last(link)
             operation cut on zones = blackhole  operation lose on link = packet loss [0%, 7%]
             campaign in_bursts { objectives time  operations cut, lose 1 per test
               activate by condition over near, made { depth 3  integers [0, 12] } for [1s, 15s] at most 3 times
               search random { evaluations 8 }  end after 70s }",
        ));
        let shown: Vec<&str> = explained
            .lines()
            .skip_while(|line| !line.starts_with("(* the conditions"))
            .take_while(|line| line.starts_with("(* the conditions") || line.ends_with(';'))
            .collect();
        assert_eq!(shown.len(), 8);
        assert!(include_str!("../../docs/language.md").contains(&shown.join("\n")), "{explained}");
    }
}
