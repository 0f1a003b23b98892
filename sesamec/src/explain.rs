//! A campaign as its runner understands it, for people: everything that was left out is written out, and what its
//! search grows conditions from is a grammar.
//!
//! The first part is `.sesame` text that has the same plan as the campaign it explains.

use std::fmt::Write as _;

use sesame_notation::{self as notation, Unit};
use sesame_plan::condition::{Comparison, ConditionEnd, ConditionSpace, Integers, Variable};
use sesame_plan::{ActivationMode, CampaignPlan, MetricSource};

/// More whole numbers than these are not written out one by one.
const INTEGERS_SHOWN: i128 = 40;

/// The campaign of a plan with its defaults and its operations, and the grammar of its conditions if it has one.
pub fn campaign(plan: &CampaignPlan) -> String {
    let mut out = format!("// {}, with every default written out\n", plan.source);
    for operation in &plan.operations {
        writeln!(out, "{}", notation::operation(plan, operation)).expect("a string takes all text");
    }
    out.push('\n');
    out.push_str(&notation::campaign(plan));
    if let ActivationMode::Condition { space } = &plan.campaign.activation {
        out.push('\n');
        out.push_str(&grammar(plan, space));
    }
    out
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
    let stepped = space.variables.iter().any(|variable| variable.step.is_some());
    let rules = [
        ("compCond", "compCond, logicOp, compCond | basicCond".to_owned()),
        ("basicCond", "expr, binComp, var".to_owned()),
        ("expr", if stepped { "var | int | step" } else { "var | int" }.to_owned()),
        ("logicOp", "\"and\" | \"or\"".to_owned()),
        ("binComp", signs.join(" | ")),
        ("int", integers),
        ("step", "? a number of a variable that has its own ?".to_owned()),
        ("var", variables.join(" | ")),
    ];
    let mut out = format!("(* the conditions of {}, in EBNF *)\n", plan.campaign.name);
    for (left, right) in rules.into_iter().filter(|(left, _)| stepped || *left != "step") {
        writeln!(out, "{left:<9} = {right} ;").expect("a string takes all text");
    }
    let mut notes = vec![match space.depth {
        1 => "a condition has 1 level: it is one comparison".to_owned(),
        depth => format!("a condition has at most {depth} levels; a comparison alone is one"),
    }];
    notes.push("no comparison is of a variable with itself or decided by what is known of its variables".to_owned());
    for variable in &space.variables {
        let metric = &plan.metrics[variable.metric.index()];
        let unit = Unit::named(metric.unit.as_deref());
        let known = match (variable.low, variable.high) {
            (Some(low), Some(high)) => Some(format!("is in {}", unit.range(low, high))),
            (Some(low), None) => Some(format!("is {} or more", unit.number(low))),
            (None, Some(high)) => Some(format!("is {} or less", unit.number(high))),
            (None, None) => None,
        };
        let compared = match (variable.step, &metric.unit) {
            (Some(step), _) => Some(format!("is compared with numbers of its own, {} apart", unit.number(step))),
            (None, Some(unit)) => Some(format!("is compared with whole numbers of {unit}")),
            (None, None) => None,
        };
        let initial = match (&metric.source, metric.initial) {
            (MetricSource::FuzzingTime, _) => None,
            (MetricSource::Monitor { score, .. }, _) if score.always_has_a_value() => None,
            (_, Some(initial)) => Some(format!("is {} before it is first set", unit.number(initial))),
            (_, None) => Some("is unknown before it is first set".to_owned()),
        };
        let said: Vec<String> = known.into_iter().chain(compared).chain(initial).collect();
        notes.push(format!("{} {}", metric.name, said.join(", ")));
    }
    for operation in plan.operations.iter().filter(|operation| !operation.constraints.is_empty()) {
        let contained = operation.constraints.iter().map(|comparison| notation::constraint(comparison, &plan.metrics));
        let contained = contained.collect::<Vec<_>>().join(", ");
        notes.push(format!("the start condition of {} contains {contained}", operation.name));
    }
    notes.push(match space.end {
        ConditionEnd::Condition => "an activation ends by a condition of its own, of the same grammar".to_owned(),
        ConditionEnd::Length { low, high } => {
            let [low, high] = [low, high].map(|seconds| Unit::SECONDS.number(seconds));
            format!("an activation lasts from {low} to {high}")
        }
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
        sesame_codegen::lower::lower(&space, id, "cell.sesame", "sesamec 0.0.0").plan
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
        assert!(include_str!("../../docs/language/conditions.md").contains(&shown.join("\n")), "{explained}");
    }
}
