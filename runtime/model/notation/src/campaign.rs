//! Campaigns: a block with one clause for each thing that a campaign says.

use sesame_plan::condition::{ConditionEnd, ConditionSpace, Integers};
use sesame_plan::{
    ActivationMode, BoostedChildren, CampaignPlan, Confirmation, Copies, CoverageGoal, Exploration, MetricId, Recorded,
    Search, Statistic, StopRule, Strategy,
};

use crate::condition;
use crate::text::block;
use crate::unit::Unit;

/// A clause of a campaign: its word, and what follows it.
pub type Clause = (&'static str, String);

/// The campaign of a plan as a `campaign` block, with every default written out. A failsafe is written as the number of
/// evaluations, which it has become in the plan.
pub fn campaign(plan: &CampaignPlan) -> String {
    campaign_block(&plan.campaign.doc, &plan.campaign.name, clauses(plan))
}

/// A `campaign` block of a name with these clauses.
pub fn campaign_block(doc: &str, name: &str, clauses: impl IntoIterator<Item = Clause>) -> String {
    let members = clauses.into_iter().map(|(word, said)| format!("{word:<10} {said}"));
    block(doc, &format!("campaign {name}"), members)
}

fn clauses(plan: &CampaignPlan) -> Vec<Clause> {
    let campaign = &plan.campaign;
    let mut clauses = Vec::new();
    if !campaign.objectives.is_empty() {
        clauses.push(("objectives", metrics(plan, campaign.objectives.iter().copied())));
    }
    let observed = (0..).map(MetricId).take(plan.metrics.len()).filter(|id| !campaign.objectives.contains(id));
    let observed = metrics(plan, observed);
    if !observed.is_empty() {
        clauses.push(("observes", observed));
    }
    match &campaign.search {
        Search::Strategy { strategy, evaluations } => {
            let operations: Vec<&str> =
                campaign.operations.iter().map(|&id| plan.operation(id).name.as_str()).collect();
            let (count, copies) = (campaign.count, campaign.copies);
            clauses.push(operations_clause(&operations, (count.min, count.max), copies));
            clauses.push(("activate", format!("by {}", activation_mode(plan, &campaign.activation))));
            clauses.push(search_clause(*strategy, *evaluations, Some(campaign.seed), campaign.neighbours));
            clauses.extend(campaign.coverage.as_ref().map(coverage_clause));
            clauses.extend(campaign.exploration.as_ref().map(exploration_clause));
            clauses.extend(campaign.confirm.map(confirmation_clause));
            if !campaign.stop.is_empty() {
                let rules: Vec<String> = campaign.stop.iter().map(stop_rule).collect();
                clauses.push(("stop", format!("{{ {} }}", rules.join("  "))));
            }
        }
        Search::Repeat { test, times } => {
            let test = plan.test(*test);
            let seed = campaign.seed;
            // Only a campaign that observes has a test without operations.
            clauses.push(match test.test.operations.as_slice() {
                [] => ("passive", format!("{times} times {{ seed {seed} }}")),
                _ => repeat_clause(&test.name, *times, Some(seed)),
            });
        }
    }
    clauses.extend(campaign.record.map(|which| {
        let which = match which {
            Recorded::Failing => "failing",
            Recorded::All => "all",
        };
        ("record", format!("mcap {which}"))
    }));
    let when = campaign.end_when.as_ref().map(|condition| condition::write(condition, &plan.metrics));
    clauses.push(end_clause(campaign.end_after, when.as_deref()));
    clauses
}

fn metrics(plan: &CampaignPlan, ids: impl Iterator<Item = MetricId>) -> String {
    ids.map(|id| plan.metric(id).name.as_str()).collect::<Vec<_>>().join(", ")
}

/// `operations`: which ones a test may contain, how many at least and at most, and what holds of copies.
pub fn operations_clause(names: &[&str], (least, most): (u32, u32), copies: Copies) -> Clause {
    let copies = match copies {
        Copies::Apart => "",
        Copies::MayOverlap => " may overlap",
        Copies::Once => " each at most once",
    };
    ("operations", format!("{}   {least}..{most} per test{copies}", names.join(", ")))
}

/// `search`: a strategy with its settings. Without a seed, the language's default holds.
pub fn search_clause(strategy: Strategy, evaluations: u32, seed: Option<u64>, neighbours: Option<u32>) -> Clause {
    let (keyword, settings) = (strategy.kind().properties().keyword, strategy.settings());
    let seed = seed.map(|seed| format!("  seed {seed}")).unwrap_or_default();
    let neighbours = neighbours.map(|count| format!("  neighbours {count}")).unwrap_or_default();
    ("search", format!("{keyword} {{ {settings}evaluations {evaluations}{seed}{neighbours} }}"))
}

/// `repeat`: a test by its name. Without a seed, the language's default holds.
pub fn repeat_clause(test: &str, times: u32, seed: Option<u64>) -> Clause {
    let seed = seed.map(|seed| format!(" {{ seed {seed} }}")).unwrap_or_default();
    ("repeat", format!("{test} {times} times{seed}"))
}

/// `coverage`: a grid of cells.
pub fn coverage_clause(goal: &CoverageGoal) -> Clause {
    let axes = goal.axes.iter().map(|axis| {
        format!("{} {} cells {}   ", axis.dimension.name(), Unit::None.range(axis.low, axis.high), axis.cells)
    });
    let stop = goal.stop_at.map(|share| format!("   stop at {}", Unit::Share.number(share))).unwrap_or_default();
    ("coverage", format!("{{ {}hits {}{stop} }}", axes.collect::<String>(), goal.hits))
}

/// `end`: when a test ends, in seconds, and what ends it before.
pub fn end_clause(seconds: f64, when: Option<&str>) -> Clause {
    let when = when.map(|condition| format!(" or when {condition}")).unwrap_or_default();
    ("end", format!("after {}{when}", Unit::SECONDS.number(seconds)))
}

/// How a search explores, with every number.
pub fn exploration_clause(exploration: &Exploration) -> Clause {
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
            let until = until.map(|until| format!("  until {}", Unit::Share.number(until))).unwrap_or_default();
            ("construct", format!("{{ share {}{until} }}", Unit::Share.number(*share)))
        }
        Exploration::Novelty { neighbours, over } => {
            let over: Vec<&str> = over.iter().map(|dimension| dimension.name()).collect();
            ("novelty", format!("{{ neighbours {neighbours}  over {} }}", over.join(", ")))
        }
        Exploration::Predict { candidates } => ("predict", format!("{{ candidates {candidates} }}")),
    }
}

fn confirmation_clause(Confirmation { times, by, violations }: Confirmation) -> Clause {
    let by = match by {
        Statistic::Mean => "mean".to_owned(),
        Statistic::Median => "median".to_owned(),
        Statistic::Quantile { share } => format!("quantile {}", Unit::Share.number(share)),
    };
    let violations = if violations { "  violations" } else { "" };
    ("confirm", format!("{times} times {{ by {by}{violations} }}"))
}

fn stop_rule(rule: &StopRule) -> String {
    match *rule {
        StopRule::WallTime { seconds } => format!("time {}", Unit::SECONDS.number(seconds)),
        StopRule::Stagnation { generations, below } => {
            format!("stagnation {generations} generations below {}", Unit::Share.number(below))
        }
        StopRule::Discovery { below } => format!("discovery below {}", Unit::Share.number(below)),
        StopRule::Completeness { share } => format!("completeness {}", Unit::Share.number(share)),
        StopRule::NoNewCause { tests } => format!("no new cause in {tests} tests"),
        StopRule::EveryPair => "every pair".to_owned(),
    }
}

fn activation_mode(plan: &CampaignPlan, mode: &ActivationMode) -> String {
    match mode {
        ActivationMode::Time => "time".to_owned(),
        ActivationMode::Condition { space } => condition_space(plan, space),
    }
}

fn condition_space(plan: &CampaignPlan, space: &ConditionSpace) -> String {
    let variables = space.variables.iter().map(|variable| {
        let metric = plan.metric(variable.metric);
        let unit = Unit::named(metric.unit.as_deref());
        match (variable.low, variable.high) {
            (Some(low), Some(high)) => {
                let step = variable.step.map_or(String::new(), |step| format!(" step {}", unit.number(step)));
                format!("{} in {}{step}", metric.name, unit.range(low, high))
            }
            // What is known of one end only follows from the metric itself.
            _ => metric.name.clone(),
        }
    });
    let variables = variables.collect::<Vec<_>>().join(", ");
    let Integers { lowest, highest } = space.integers;
    let end = match space.end {
        ConditionEnd::Condition => String::new(),
        ConditionEnd::Length { low, high } => format!(" for {}", Unit::SECONDS.range(low, high)),
    };
    format!(
        "condition over {variables} {{ depth {}  integers [{lowest}, {highest}] }}{end} at most {} times",
        space.depth, space.times
    )
}
