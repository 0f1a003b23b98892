//! Campaigns of the original, and the tests that they repeat, in the words of the language.

use std::collections::{BTreeMap, BTreeSet};

use sesame_notation::{self as notation, Clause, Unit};
use sesame_plan::{Copies, CoverageGoal, Dimension, GridAxis, Strategy};

use crate::boosting;
use crate::known_tests::{harmless_member, held_by, known_test};
use crate::lacks::PASSIVE;
use crate::notes::Kind;
use crate::original::{
    Activation, ActivationMode, Approach, Campaign, Condition, Coverage, Operand, Operation, Original, Reference,
};
use crate::writer::{Writer, called_before, meant};
use crate::xml::printable;

/// How operations are activated that have windows of time.
const BY_TIME: &str = "time";

/// When the tests of a campaign end, in seconds. Where a campaign does not say it is the original's own constant, or
/// later where its operations are.
pub(crate) fn end_of(original: &Original, campaign: &Campaign) -> f64 {
    if let Some(limit) = campaign.limit.filter(|&limit| limit > 0.0) {
        return limit;
    }
    let included = campaign
        .included
        .iter()
        .filter_map(|&reference| original.operation(reference))
        .map(|at| &original.operations[at]);
    let performed = campaign.tests.iter().flat_map(|test| &test.operations);
    let last = included.chain(performed).map(|operation| match operation.activation {
        Activation::Time(start, end) => start.max(end),
        _ => 0.0,
    });
    last.fold(100.0, f64::max)
}

/// The test that a campaign repeats, as the positions of its campaign and its own, and whether the campaign names it.
fn repeated(original: &Original, at: usize) -> Option<((usize, usize), bool)> {
    let campaign = &original.campaigns[at];
    let Approach::Repeat { test, .. } = campaign.approach else { return None };
    // What it performed are copies of the test it repeated.
    let first = || (!campaign.tests.is_empty()).then_some(((at, 0), false));
    test.and_then(|reference| original.test(reference)).map(|place| (place, true)).or_else(first)
}

/// When a test is over in the first of the campaigns that repeat it, in seconds.
fn first_end(original: &Original, place: (usize, usize)) -> f64 {
    let repeating = (0..original.campaigns.len())
        .filter(|&at| repeated(original, at).is_some_and(|(repeated, _)| repeated == place));
    repeating.map(|at| end_of(original, &original.campaigns[at])).fold(f64::INFINITY, f64::min)
}

/// Whether the tests of a campaign switch operations by conditions: as it says, or as those that it performed do.
fn by_condition(campaign: &Campaign) -> Option<u32> {
    let conditional = |operation: &Operation| {
        matches!(operation.activation, Activation::Condition(..) | Activation::ConditionFor(..))
    };
    match campaign.activation {
        Some(ActivationMode::Condition { depth }) => Some(depth),
        Some(ActivationMode::Time) => None,
        None => campaign.tests.iter().flat_map(|test| &test.operations).any(conditional).then_some(0),
    }
}

/// All known tests and all campaigns.
pub(crate) fn write(writer: &mut Writer<'_>) -> (String, String) {
    let (mut tests, mut campaigns) = (String::new(), String::new());
    let mut known: BTreeMap<(usize, usize), String> = BTreeMap::new();
    let original = writer.original;
    for campaign in &original.campaigns {
        let name = campaign_text(writer, campaign, &mut known, &mut tests, &mut campaigns);
        writer.mapped.campaigns.push(name);
    }
    (tests, campaigns)
}

/// One campaign; its name, if there is a way to say it. There is one for every campaign that performed tests, so that
/// their results have a place: where nothing of what it did can be said, it only observes.
fn campaign_text(
    writer: &mut Writer<'_>,
    campaign: &Campaign,
    known: &mut BTreeMap<(usize, usize), String>,
    tests: &mut String,
    text: &mut String,
) -> Option<String> {
    let original = writer.original;
    let shown = printable(&campaign.name);
    let names = |writer: &Writer<'_>, metrics: &mut dyn Iterator<Item = usize>| -> Vec<String> {
        let mut names: Vec<String> = Vec::new();
        for name in metrics.filter_map(|at| writer.mapped.metrics[at].as_ref()) {
            if !names.contains(name) {
                names.push(name.clone());
            }
        }
        names
    };
    let repeats = matches!(campaign.approach, Approach::Repeat { .. });
    // Lines that are true only if the campaign is kept are written once that is decided.
    let mut of_it: Vec<(Kind, String)> = Vec::new();
    let of_campaign = || campaign.metrics.iter().filter_map(|&metric| original.metric(metric));
    let mut objectives = names(writer, &mut of_campaign().filter(|&at| original.metrics[at].optimised));
    if objectives.is_empty() {
        objectives = names(writer, &mut of_campaign());
        if !objectives.is_empty() && !repeats {
            let text = format!("campaign `{shown}` marks no metric for optimisation: all that it has are objectives");
            of_it.push((Kind::Noted, text));
        }
    }
    if objectives.is_empty() && !repeats {
        objectives = writer.mapped.metrics.iter().flatten().cloned().collect();
        of_it.push((Kind::Changed, format!("campaign `{shown}` measures nothing: all metrics are objectives now")));
    }
    // What else its tests have values or conditions of is measured too, so that results have a place for it.
    let measured: BTreeSet<usize> =
        campaign.tests.iter().flat_map(|test| &test.values).filter_map(|value| original.measured(value)).collect();
    let compared: BTreeSet<usize> = campaign
        .tests
        .iter()
        .flat_map(|test| &test.operations)
        .flat_map(compared_by)
        .filter_map(|metric| original.metric(metric))
        .collect();
    let mut observed = names(writer, &mut of_campaign().chain(measured).chain(compared.iter().copied()));
    odd_tests(writer, campaign, &shown, &compared);
    let end = end_of(original, campaign);
    if campaign.limit.is_none() {
        let after = Unit::SECONDS.number(end);
        let text = format!("campaign `{shown}` does not say when its tests end: after {after} now");
        of_it.push((Kind::Changed, text));
    }

    let found = if repeats {
        repetition(writer, campaign, &shown, end, known, tests)
    } else {
        search(writer, campaign, &shown, &objectives, &mut observed)
    };
    let mut clauses = match found {
        Ok(clauses) => clauses,
        Err(why) if campaign.tests.is_empty() => {
            writer.notes.say(Kind::LeftOut, format!("campaign `{shown}`: {why}"));
            return None;
        }
        Err(why) => {
            observed.extend(objectives.iter().filter(|name| !observed.contains(name)).cloned().collect::<Vec<_>>());
            let kept = if repeats || objectives.is_empty() { "" } else { ", with its objectives" };
            let text = format!("campaign `{shown}`: {why}, {}; its results are kept{kept}", PASSIVE.says);
            writer.notes.say(Kind::Changed, text);
            if !repeats {
                writer.mapped.objectives.insert(writer.mapped.campaigns.len(), objectives);
            }
            let times = match campaign.approach {
                Approach::Repeat { times, .. } => times.max(1),
                _ => 1,
            };
            vec![("passive", format!("{times} times"))]
        }
    };
    for (kind, text) in of_it {
        writer.notes.say(kind, text);
    }
    if !observed.is_empty() {
        clauses.push(("observes", observed.join(", ")));
    }
    clauses.push(notation::end_clause(end, None));
    let name = writer.name("campaign", &campaign.name);
    let doc = if name == campaign.name { String::new() } else { called_before(&campaign.name) };
    text.push('\n');
    text.push_str(&notation::campaign_block(&doc, &name, clauses));
    Some(name)
}

/// Notes what is odd about the tests of a campaign, whose conditions compare these metrics.
fn odd_tests(writer: &mut Writer<'_>, campaign: &Campaign, shown: &str, compared: &BTreeSet<usize>) {
    let idle = campaign.tests.iter().filter(|test| test.operations.is_empty()).count();
    if idle > 0 {
        let text = format!("campaign `{shown}`: performed tests without operations, which disturb nothing");
        writer.notes.times(Kind::Noted, text, idle);
    }
    let operations = || campaign.tests.iter().flat_map(|test| &test.operations);
    let with_itself = operations().filter(|operation| compares_with_itself(writer.original, operation)).count();
    if with_itself > 0 {
        let text = format!(
            "campaign `{shown}`: conditions of performed tests that compare a metric with itself, which decides nothing"
        );
        writer.notes.times(Kind::Noted, text, with_itself);
    }
    let offered: BTreeSet<usize> =
        campaign.condition_metrics.iter().filter_map(|&metric| writer.original.metric(metric)).collect();
    let others: Vec<&str> =
        compared.difference(&offered).filter_map(|&metric| writer.mapped.metrics[metric].as_deref()).collect();
    if !others.is_empty() {
        let others = others.join(", ");
        let text = format!(
            "campaign `{shown}`: conditions of its tests compare what is not among its condition metrics: {others}"
        );
        writer.notes.say(Kind::Noted, text);
    }
}

/// What a campaign does that repeats a test; the error says why it cannot.
fn repetition(
    writer: &mut Writer<'_>,
    campaign: &Campaign,
    shown: &str,
    end: f64,
    known: &mut BTreeMap<(usize, usize), String>,
    tests: &mut String,
) -> Result<Vec<Clause>, String> {
    let original = writer.original;
    let Approach::Repeat { times, .. } = campaign.approach else { return Err("it does not repeat a test".to_owned()) };
    let Some((place, named)) = repeated(original, writer.mapped.campaigns.len()) else {
        return Err("the test that it repeats is not in the file".to_owned());
    };
    let test = if let Some(name) = known.get(&place) {
        name.clone()
    } else {
        let repeated = &original.campaigns[place.0].tests[place.1];
        let over = first_end(original, place);
        let members = held_by(writer, repeated, over);
        let members = if members.is_empty() {
            let harmless = harmless_member(writer, repeated, over.min(end));
            vec![harmless.ok_or("nothing of the test that it repeats can be said")?]
        } else {
            members
        };
        let name = known_test(writer, repeated, members, tests);
        known.insert(place, name.clone());
        name
    };
    if !named {
        let text =
            format!("campaign `{shown}`: the test that it repeats is not in the file; it repeats its first copy");
        writer.notes.say(Kind::Changed, text);
    }
    Ok(vec![notation::repeat_clause(&test, times.max(1), None)])
}

/// What a campaign does that searches; the error says why it cannot. What it has as objectives it does not observe
/// besides.
fn search(
    writer: &mut Writer<'_>,
    campaign: &Campaign,
    shown: &str,
    objectives: &[String],
    observed: &mut Vec<String>,
) -> Result<Vec<Clause>, String> {
    let original = writer.original;
    let mut held: Vec<usize> =
        campaign.included.iter().filter_map(|&reference| original.operation(reference)).collect();
    held.extend(writer.mapped.holders.used_by(original, &campaign.tests));
    held.sort_unstable();
    held.dedup();
    let uses_all = held.iter().all(|&at| writer.mapped.parts[at].is_empty()) && !campaign.tests.is_empty();
    if uses_all {
        // All that can be active before its tests end.
        let end = end_of(original, campaign);
        let acts = |&at: &usize| writer.permitted(at).is_none_or(|window| window.start < end);
        held = (0..writer.mapped.parts.len()).filter(acts).collect();
    }
    let operations: Vec<&str> =
        held.iter().flat_map(|&at| &writer.mapped.parts[at]).map(|part| part.name.as_str()).collect();
    if operations.is_empty() {
        return Err("none of its operations can be said".to_owned());
    }
    if objectives.is_empty() {
        return Err("it measures nothing that could be an objective".to_owned());
    }
    if uses_all {
        writer.notes.say(Kind::Changed, format!("campaign `{shown}` has no operations: it may use all now"));
    }
    let parts = |operation: &Operation| {
        writer.mapped.holders.find(original, operation).map_or(0, |at| writer.mapped.parts[at].len())
    };
    let longest = campaign.tests.iter().map(|test| test.operations.iter().map(parts).sum::<usize>()).max();
    let most = u32::try_from(operations.len().max(longest.unwrap_or(0))).unwrap_or(u32::MAX);
    observed.retain(|name| !objectives.contains(name));
    let mut clauses = vec![
        ("objectives", objectives.join(", ")),
        // The original platform lets copies of one operation act together.
        notation::operations_clause(&operations, (1, most), Copies::MayOverlap),
    ];
    let activation = activation(writer, campaign, shown, observed);
    let by_time = activation == BY_TIME;
    clauses.push(("activate", format!("by {activation}")));
    strategy(writer, campaign, shown, by_time, &mut clauses);
    Ok(clauses)
}

/// By what the tests of a campaign switch operations. Variables of conditions are observed anyway.
fn activation(writer: &mut Writer<'_>, campaign: &Campaign, shown: &str, observed: &mut Vec<String>) -> String {
    let Some(depth) = by_condition(campaign) else { return BY_TIME.to_owned() };
    if campaign.activation.is_none() {
        let text = format!("campaign `{shown}` does not say how operations are switched; its tests do it by condition");
        writer.notes.say(Kind::Changed, text);
    }
    let mut over: Vec<&str> = Vec::new();
    for name in campaign.condition_metrics.iter().filter_map(|&reference| writer.metric(reference)) {
        if !over.contains(&name) {
            over.push(name);
        }
    }
    if over.is_empty() {
        writer.notes.say(Kind::Changed, format!("campaign `{shown}` has no condition metrics: it activates by time"));
        return BY_TIME.to_owned();
    }
    observed.retain(|name| !over.contains(&name.as_str()));
    let settings = if depth == 0 { String::new() } else { format!(" {{ depth {} }}", depth.min(10)) };
    format!("condition over {}{settings}", over.join(", "))
}

/// How a campaign finds its tests, and the cells that it counts.
fn strategy(writer: &mut Writer<'_>, campaign: &Campaign, shown: &str, by_time: bool, clauses: &mut Vec<Clause>) {
    let performed = u32::try_from(campaign.tests.len()).unwrap_or(u32::MAX);
    match &campaign.approach {
        Approach::Nsga { population, evaluations, coverage, boosting } => {
            let settled = population.max(&2).saturating_add(population % 2);
            let total = (*evaluations).max(settled);
            if (settled, total) != (*population, *evaluations) {
                let text = format!(
                    "campaign `{shown}`: population {population} and {evaluations} evaluations are {settled} and {total} now"
                );
                writer.notes.say(Kind::Changed, text);
            }
            clauses.push(notation::search_clause(Strategy::Nsga2 { population: settled }, total, None, None));
            let cells = coverage.as_ref().and_then(|coverage| cells(writer, coverage, shown));
            clauses.extend(cells.as_ref().map(notation::coverage_clause));
            if let Some(boosting) = boosting {
                clauses.extend(boosting::clause(writer, boosting, shown, by_time, cells.is_some()));
            }
        }
        approach => {
            let total = performed.max(100);
            if *approach == Approach::Missing {
                writer.notes.say(Kind::Changed, format!("campaign `{shown}` does not say how it searches: at random"));
            }
            clauses.push(notation::search_clause(Strategy::Random, total, None, None));
        }
    }
}

fn cells(writer: &mut Writer<'_>, coverage: &Coverage, shown: &str) -> Option<CoverageGoal> {
    let mut axes: Vec<GridAxis> = Vec::new();
    for (dimension, low, high, count) in &coverage.dimensions {
        let (dimension, low, high) = match dimension.as_str() {
            "T1_TIME_MIDPOINT_MEAN" => (Dimension::T1, *low, *high),
            "T2_TIME_LENGTH_MEAN" => (Dimension::T2, *low, *high),
            "T3_TIME_MIDPOINT_VAR" => (Dimension::T3, *low, *high),
            "P1_PARAMETER_MEAN" => (Dimension::P1, *low, *high),
            "P2_PARAMETER_VARIANCE" => {
                let text =
                    format!("campaign `{shown}`: P2 is a standard deviation, no variance; its cells are converted");
                writer.notes.say(Kind::Changed, text);
                (Dimension::P2, low.max(0.0).sqrt(), high.max(0.0).sqrt())
            }
            "O0_TOTAL_COUNT" => (Dimension::O0, *low, *high),
            "O1_FUZZRANGE_COUNT" => (Dimension::O1, *low, *high),
            // The original has these two the other way round.
            "O2_DELAY_COUNT" => (Dimension::O3, *low, *high),
            "O3_DELETION_COUNT" => (Dimension::O2, *low, *high),
            other => {
                let other = printable(other);
                writer.notes.say(Kind::LeftOut, format!("campaign `{shown}`: there is no dimension `{other}`"));
                continue;
            }
        };
        if low >= high || *count == 0 || axes.iter().any(|axis| axis.dimension == dimension) {
            let name = dimension.name();
            writer.notes.say(Kind::LeftOut, format!("campaign `{shown}`: the cells of {name} are not cells"));
            continue;
        }
        axes.push(GridAxis { dimension, low, high, cells: *count });
    }
    if axes.is_empty() {
        let text = format!(
            "campaign `{shown}`: it counts no coverage, since the file does not say which cells; add `coverage {{ … }}`"
        );
        writer.notes.say(Kind::Changed, text);
        return None;
    }
    let stop_at = (coverage.target > 0.0 && coverage.target <= 1.0).then(|| meant(coverage.target));
    Some(CoverageGoal { axes, hits: coverage.hits.max(1), stop_at })
}

/// The conditions of an operation.
fn conditions(operation: &Operation) -> impl Iterator<Item = &Condition> {
    let (start, end) = match &operation.activation {
        Activation::Condition(start, end) => (start.as_ref(), end.as_ref()),
        Activation::ConditionFor(start, _) => (start.as_ref(), None),
        Activation::Time(..) | Activation::Missing => (None, None),
    };
    start.into_iter().chain(end)
}

/// Shows every comparison in a condition.
fn comparisons(condition: &Condition, each: &mut impl FnMut(Reference, Operand)) {
    match condition {
        Condition::Compare(left, _, right) => each(*left, *right),
        Condition::And(a, b) | Condition::Or(a, b) => {
            comparisons(a, each);
            comparisons(b, each);
        }
    }
}

/// The metrics that the conditions of an operation compare.
fn compared_by(operation: &Operation) -> Vec<Reference> {
    let mut metrics = Vec::new();
    for condition in conditions(operation) {
        comparisons(condition, &mut |left, right| {
            metrics.push(left);
            if let Operand::Metric(right) = right {
                metrics.push(right);
            }
        });
    }
    metrics
}

fn compares_with_itself(original: &Original, operation: &Operation) -> bool {
    let mut found = false;
    for condition in conditions(operation) {
        comparisons(condition, &mut |left, right| {
            let Operand::Metric(right) = right else { return };
            found |= original.metric(left).is_some() && original.metric(left) == original.metric(right);
        });
    }
    found
}
