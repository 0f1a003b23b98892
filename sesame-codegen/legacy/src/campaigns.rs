//! Campaigns of the original, and the tests that they repeat, in the words of the language.

use std::collections::BTreeMap;
use std::mem::discriminant;

use sesame_notation::{self as notation, Clause, Unit, activation_named, quoted};
use sesame_plan::condition as grown;
use sesame_plan::{self as plan, Copies, CoverageGoal, Dimension, GridAxis, MetricId, Strategy};

use crate::notes::Kind;
use crate::original::{
    Activation, ActivationMode, Approach, Campaign, Comparison, Condition, Coverage, Domain, MetricSource, Operand,
    Operation, OperationKind, Original, Reference, Test,
};
use crate::parts::{Effect, matching};
use crate::writer::{Writer, called_before, meant};
use crate::xml::{cleaned, printable};

/// Levels of a condition that the language permits.
const MOST_LEVELS: u32 = 40;

/// When the tests of a campaign end, in seconds. Where a campaign does not say it is the original's own constant, or
/// later where its operations are.
pub(crate) fn end_of(original: &Original, campaign: &Campaign) -> f64 {
    if let Some(limit) = campaign.limit.filter(|&limit| limit > 0.0) {
        return limit;
    }
    let included = campaign.included.iter().filter_map(|&it| original.operation(it)).map(|at| &original.operations[at]);
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
    test.and_then(|it| original.test(it)).map(|place| (place, true)).or_else(first)
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

/// One campaign; its name, if there is a way to say it.
fn campaign_text(
    writer: &mut Writer<'_>,
    campaign: &Campaign,
    known: &mut BTreeMap<(usize, usize), String>,
    tests: &mut String,
    text: &mut String,
) -> Option<String> {
    let original = writer.original;
    let shown = printable(&campaign.name);
    let leave_out = |writer: &mut Writer<'_>, why: &str| {
        writer.notes.say(Kind::LeftOut, format!("campaign `{shown}`: {why}"));
        None
    };
    let names = |writer: &Writer<'_>, metrics: &mut dyn Iterator<Item = Reference>| -> Vec<String> {
        let mut names: Vec<String> = Vec::new();
        for name in metrics.filter_map(|it| writer.metric(it)) {
            if !names.iter().any(|known| known == name) {
                names.push(name.to_owned());
            }
        }
        names
    };
    let optimised = |&it: &Reference| original.metric(it).is_some_and(|at| original.metrics[at].optimised);
    let mut objectives = names(writer, &mut campaign.metrics.iter().copied().filter(optimised));
    if objectives.is_empty() {
        objectives = names(writer, &mut campaign.metrics.iter().copied());
    }
    if objectives.is_empty() && !matches!(campaign.approach, Approach::Repeat { .. }) {
        objectives = writer.mapped.metrics.iter().flatten().cloned().collect();
        writer.notes.say(Kind::Changed, format!("campaign `{shown}` measures nothing: it has all objectives now"));
    }
    let mut clauses: Vec<Clause> = Vec::new();
    // What else its tests have values or conditions of is measured too, so that results have a place for it.
    let measured = campaign.tests.iter().flat_map(|test| test.values.iter().map(|&(metric, _)| metric));
    let compared = campaign.tests.iter().flat_map(|test| &test.operations).flat_map(compared_by);
    let mut observed = names(writer, &mut campaign.metrics.iter().copied().chain(measured).chain(compared));
    let end = end_of(original, campaign);
    if campaign.limit.is_none() {
        let after = Unit::SECONDS.number(end);
        let text = format!("campaign `{shown}` does not say when its tests end: after {after} now");
        writer.notes.say(Kind::Changed, text);
    }

    if let Approach::Repeat { times, .. } = campaign.approach {
        let Some((place, named)) = repeated(original, writer.mapped.campaigns.len()) else {
            return leave_out(writer, "the test that it repeats is not in the file");
        };
        if !named {
            let text =
                format!("campaign `{shown}`: the test that it repeats is not in the file; it repeats its first copy");
            writer.notes.say(Kind::Changed, text);
        }
        let test = if let Some(name) = known.get(&place) {
            name.clone()
        } else {
            let repeated = &original.campaigns[place.0].tests[place.1];
            let over = first_end(original, place);
            let Some(members) = held_by(writer, repeated, over).or_else(|| harmless_member(writer, repeated, end))
            else {
                return leave_out(writer, "nothing of the test that it repeats can be said");
            };
            let name = known_test(writer, repeated, members, tests);
            known.insert(place, name.clone());
            name
        };
        clauses.push(notation::repeat_clause(&test, times.max(1), None));
    } else {
        let mut held: Vec<usize> = campaign.included.iter().filter_map(|&it| original.operation(it)).collect();
        held.extend(writer.mapped.holders.used_by(original, &campaign.tests));
        held.sort_unstable();
        held.dedup();
        if held.iter().all(|&at| writer.mapped.parts[at].is_empty()) && !campaign.tests.is_empty() {
            writer.notes.say(Kind::Changed, format!("campaign `{shown}` has no operations: it may use all now"));
            held = (0..writer.mapped.parts.len()).collect();
        }
        let operations: Vec<&str> =
            held.iter().flat_map(|&at| &writer.mapped.parts[at]).map(|part| part.name.as_str()).collect();
        if operations.is_empty() {
            return leave_out(writer, "none of its operations can be said");
        }
        if objectives.is_empty() {
            return leave_out(writer, "it measures nothing that could be an objective");
        }
        let parts = |operation: &Operation| {
            writer.mapped.holders.find(original, operation).map_or(0, |at| writer.mapped.parts[at].len())
        };
        let longest = campaign.tests.iter().map(|test| test.operations.iter().map(parts).sum::<usize>()).max();
        let most = u32::try_from(operations.len().max(longest.unwrap_or(0))).unwrap_or(u32::MAX);
        clauses.push(("objectives", objectives.join(", ")));
        observed.retain(|name| !objectives.contains(name));
        // The original platform lets copies of one operation act together.
        clauses.push(notation::operations_clause(&operations, (1, most), Copies::MayOverlap));
        clauses.push(("activate", format!("by {}", activation(writer, campaign, &shown, &mut observed))));
        search(writer, campaign, &shown, &mut clauses);
    }
    if !observed.is_empty() {
        clauses.push(("observes", observed.join(", ")));
    }
    clauses.push(notation::end_clause(end));
    let name = writer.name("campaign", &campaign.name);
    let doc = if name == campaign.name { String::new() } else { called_before(&campaign.name) };
    text.push('\n');
    text.push_str(&notation::campaign_block(&doc, &name, clauses));
    Some(name)
}

/// By what the tests of a campaign switch operations. Variables of conditions are observed anyway.
fn activation(writer: &mut Writer<'_>, campaign: &Campaign, shown: &str, observed: &mut Vec<String>) -> String {
    let Some(depth) = by_condition(campaign) else { return "time".to_owned() };
    if campaign.activation.is_none() {
        let text = format!("campaign `{shown}` does not say how operations are switched; its tests do it by condition");
        writer.notes.say(Kind::Changed, text);
    }
    let mut over: Vec<&str> = Vec::new();
    for name in campaign.condition_metrics.iter().filter_map(|&it| writer.metric(it)) {
        if !over.contains(&name) {
            over.push(name);
        }
    }
    if over.is_empty() {
        writer.notes.say(Kind::Changed, format!("campaign `{shown}` has no condition metrics: it activates by time"));
        return "time".to_owned();
    }
    observed.retain(|name| !over.contains(&name.as_str()));
    let settings = if depth == 0 { String::new() } else { format!(" {{ depth {} }}", depth.min(10)) };
    format!("condition over {}{settings}", over.join(", "))
}

fn search(writer: &mut Writer<'_>, campaign: &Campaign, shown: &str, clauses: &mut Vec<Clause>) {
    let performed = u32::try_from(campaign.tests.len()).unwrap_or(u32::MAX);
    match &campaign.approach {
        Approach::Nsga { population, evaluations, coverage } => {
            let settled = population.max(&2).saturating_add(population % 2);
            let total = (*evaluations).max(settled);
            if (settled, total) != (*population, *evaluations) {
                let text = format!(
                    "campaign `{shown}`: population {population} and {evaluations} evaluations are {settled} and {total} now"
                );
                writer.notes.say(Kind::Changed, text);
            }
            clauses.push(notation::search_clause(Strategy::Nsga2 { population: settled }, total, None, None));
            if let Some(coverage) = coverage {
                clauses.extend(cells(writer, coverage, shown).as_ref().map(notation::coverage_clause));
            }
        }
        approach => {
            let total = performed.max(100);
            if *approach == Approach::Unsaid {
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
            writer.notes.say(Kind::LeftOut, format!("campaign `{shown}`: the cells of {name} are no cells"));
            continue;
        }
        axes.push(GridAxis { dimension, low, high, cells: *count });
    }
    if axes.is_empty() {
        let text = format!(
            "campaign `{shown}`: the file does not say which cells its coverage counts; add `coverage {{ … }}`"
        );
        writer.notes.say(Kind::LeftOut, text);
        return None;
    }
    let stop_at = (coverage.target > 0.0 && coverage.target <= 1.0).then(|| meant(coverage.target));
    Some(CoverageGoal { axes, hits: coverage.hits.max(1), stop_at })
}

/// The metrics that the conditions of an operation compare.
pub(crate) fn compared_by(operation: &Operation) -> Vec<Reference> {
    fn collect(condition: &Condition, into: &mut Vec<Reference>) {
        match condition {
            Condition::Compare(left, _, right) => {
                into.push(*left);
                if let Operand::Metric(right) = right {
                    into.push(*right);
                }
            }
            Condition::And(a, b) | Condition::Or(a, b) => {
                collect(a, into);
                collect(b, into);
            }
        }
    }
    let mut metrics = Vec::new();
    match &operation.activation {
        Activation::Condition(start, end) => {
            [start, end].into_iter().flatten().for_each(|condition| collect(condition, &mut metrics));
        }
        Activation::ConditionFor(start, _) => start.iter().for_each(|condition| collect(condition, &mut metrics)),
        Activation::Time(..) | Activation::Unsaid => {}
    }
    metrics
}

/// A test that is repeated, as a regression test with these members; its name.
fn known_test(writer: &mut Writer<'_>, test: &Test, members: Vec<String>, text: &mut String) -> String {
    let name = writer.name("test", &test.name);
    let doc = if name == *test.name { String::new() } else { called_before(&test.name) };
    text.push('\n');
    text.push_str(&notation::test_block(&doc, &name, members));
    name
}

/// The member of a regression test that disturbs nothing: an operation that adds 0, or loses nothing.
fn harmless_member(writer: &mut Writer<'_>, test: &Test, end: f64) -> Option<Vec<String>> {
    if !test.operations.is_empty() {
        return None;
    }
    let holders = &writer.mapped.holders.operations;
    let parts =
        holders.iter().zip(&writer.mapped.parts).flat_map(|(holder, parts)| parts.iter().map(move |it| (holder, it)));
    let mut harmless = parts.filter_map(|(holder, part)| match (&part.effect, &holder.kind) {
        (&Effect::Value { set, relative: true }, OperationKind::RandomValue { values, .. }) => match values[set].domain
        {
            Domain::Reals(low, high) if low.min(high) <= 0.0 && low.max(high) >= 0.0 => {
                Some((holder, &part.name, "offset", Unit::None.range(0.0, 0.0)))
            }
            _ => None,
        },
        (Effect::Loss, OperationKind::PacketLoss { keep }) if keep.0.max(keep.1) >= 1.0 => {
            Some((holder, &part.name, "loss", Unit::Share.number(0.0)))
        }
        _ => None,
    });
    let (holder, name, parameter, nothing) = harmless.next()?;
    let (start, end) = match holder.activation {
        Activation::Time(from, to) if from.max(0.0) < to.min(end) => (from.max(0.0), to.min(end)),
        _ => (0.0, end),
    };
    let (shown, harmless) = (printable(&test.name), format!("{name} {parameter} {nothing}"));
    let window = when(writer, &plan::Activation::Time { start, end });
    let member = notation::test_member(name, [(parameter, nothing)], &window, None);
    writer.notes.say(Kind::Changed, format!("known test `{shown}` disturbs nothing: it holds `{harmless}`"));
    Some(vec![member])
}

/// The operations of a regression test, as members of its block; `None` if none of them can be translated. The test is
/// over after so many seconds.
fn held_by(writer: &mut Writer<'_>, test: &Test, over: f64) -> Option<Vec<String>> {
    let shown = printable(&test.name);
    let mut members = Vec::new();
    for operation in &test.operations {
        let Some(at) = writer.mapped.holders.find(writer.original, operation) else { continue };
        let template = writer.mapped.holders.operations[at].clone();
        for part in writer.mapped.parts[at].clone() {
            let offline = matches!(part.effect, Effect::Custom { offline: true, .. });
            let window =
                if offline { Ok(plan::Activation::Offline) } else { window(writer, operation, &template, over) };
            match window.and_then(|window| Ok((window, choices(operation, &template, &part.effect)?))) {
                Ok((window, choices)) => {
                    let seed = (operation.seed != 0 && !offline).then(|| operation.seed.cast_unsigned());
                    members.push(notation::test_member(&part.name, choices, &when(writer, &window), seed));
                }
                Err(why) => {
                    writer.notes.say(Kind::LeftOut, format!("known test `{shown}`, operation `{}`: {why}", part.name));
                }
            }
        }
    }
    (!members.is_empty()).then_some(members)
}

/// When an operation of a regression test is active, as text. The metrics of a condition are those of the original, by
/// position.
fn when(writer: &Writer<'_>, activation: &plan::Activation) -> String {
    let before_start = plan::OperationKind::Custom { moment: plan::Moment::BeforeStart };
    activation_named(activation, &before_start, &|metric| {
        let at = metric.index();
        let name = writer.mapped.metrics[at].as_deref();
        let name = name.expect("a condition compares metrics that were translated");
        (name, if is_timed(writer, at) { Unit::SECONDS } else { Unit::None })
    })
}

fn is_timed(writer: &Writer<'_>, metric: usize) -> bool {
    writer.original.metrics[metric].source == MetricSource::FuzzingTime
}

/// A delay as far as a template permits it, in seconds.
fn permitted_delay(template: &Operation, delay: f64) -> f64 {
    let delay = match template.kind {
        OperationKind::Latency { delay: of, .. } => delay.clamp(of.0.min(of.1), of.0.max(of.1)),
        _ => delay,
    };
    delay.max(0.0)
}

/// What a test chooses, by parameter. What its template does not permit is the nearest that it does, so that the space
/// is right.
fn choices<'e>(
    operation: &Operation,
    template: &Operation,
    effect: &'e Effect,
) -> Result<Vec<(&'e str, String)>, String> {
    let sets = |operation: &Operation| match &operation.kind {
        OperationKind::RandomValue { values: sets, .. } | OperationKind::Custom { parameters: sets } => sets.clone(),
        _ => Vec::new(),
    };
    let (held, permitted) = (sets(operation), sets(template));
    let domain = |at: usize| {
        let chosen = matching(&held, &permitted, at).map(|set| &set.domain);
        chosen.ok_or_else(|| "it has no value of its own there".to_owned())
    };
    let within = |low: f64, high: f64, at: usize| match permitted.get(at).map(|set| &set.domain) {
        Some(&Domain::Reals(from, to)) => {
            let (from, to) = (from.min(to), from.max(to));
            (low.clamp(from, to), high.clamp(from, to))
        }
        Some(&Domain::Integers(from, to)) => {
            let (from, to) = (from.min(to) as f64, from.max(to) as f64);
            (low.clamp(from, to), high.clamp(from, to))
        }
        _ => (low, high),
    };
    Ok(match (effect, &operation.kind) {
        (&Effect::Value { set, relative }, _) => {
            let (low, high) = match *domain(set)? {
                Domain::Reals(low, high) => (low.min(high), low.max(high)),
                Domain::Integers(low, high) => (low.min(high) as f64, low.max(high) as f64),
                _ => return Err("it does not choose numbers".to_owned()),
            };
            let (low, high) = within(low, high, set);
            let word = if relative { "offset" } else { "value" };
            vec![(word, Unit::None.range(low, high))]
        }
        (Effect::Loss, OperationKind::PacketLoss { keep }) => {
            let chosen = match template.kind {
                OperationKind::PacketLoss { keep: of } => keep.0.min(keep.1).clamp(of.0.min(of.1), of.0.max(of.1)),
                _ => keep.0.min(keep.1),
            };
            vec![("loss", Unit::Share.number(meant(1.0 - chosen.clamp(0.0, 1.0))))]
        }
        (Effect::Delay { randomised: false }, OperationKind::Latency { delay, .. }) => {
            vec![("delay", Unit::SECONDS.number(permitted_delay(template, delay.0.min(delay.1))))]
        }
        (Effect::Delay { randomised: true }, OperationKind::Latency { delay, .. }) => {
            let (low, high) = (delay.0.min(delay.1), delay.0.max(delay.1));
            let (low, high) = (permitted_delay(template, low), permitted_delay(template, high));
            vec![("delay", Unit::SECONDS.range(low, high))]
        }
        (Effect::Custom { parameters, .. }, _) => {
            let mut all = Vec::new();
            for (name, at) in parameters {
                let chosen = domain(*at)?;
                if permitted.get(*at).is_some_and(|set| discriminant(&set.domain) != discriminant(chosen)) {
                    return Err(format!("what it chooses for `{name}` is of another kind than its template permits"));
                }
                let chosen = match chosen {
                    Domain::Reals(low, high) => Unit::None.number(within(low.min(*high), *high, *at).0),
                    Domain::Integers(low, high) => {
                        let low = *low.min(high);
                        Unit::None.number(match permitted.get(*at).map(|set| &set.domain) {
                            Some(&Domain::Integers(from, to)) => low.clamp(from.min(to), from.max(to)) as f64,
                            _ => low as f64,
                        })
                    }
                    Domain::Points(low, _) => {
                        let mut point = *low;
                        if let Some(Domain::Points(from, to)) = permitted.get(*at).map(|set| &set.domain) {
                            for axis in 0..3 {
                                point[axis] = point[axis].clamp(from[axis].min(to[axis]), from[axis].max(to[axis]));
                            }
                        }
                        Unit::None.point(point)
                    }
                    Domain::Texts(texts) => {
                        let offered = |text: &str| match permitted.get(*at).map(|set| &set.domain) {
                            Some(Domain::Texts(offered)) => offered.iter().any(|it| **it == *text),
                            _ => true,
                        };
                        match texts.first().filter(|text| offered(text)) {
                            Some(text) => quoted(&cleaned(text)),
                            None => return Err("it chooses no text that its template offers".to_owned()),
                        }
                    }
                    Domain::Other(_) => return Err("it chooses something that nothing is like".to_owned()),
                };
                all.push((name.as_str(), chosen));
            }
            all
        }
        (Effect::Blackhole, _) => Vec::new(),
        (Effect::Loss | Effect::Delay { .. }, _) => return Err("it does something else than its template".to_owned()),
    })
}

/// When an operation of a regression test is active. The metrics of a condition are those of the original, by position.
fn window(
    writer: &Writer<'_>,
    operation: &Operation,
    template: &Operation,
    over: f64,
) -> Result<plan::Activation, String> {
    let forever = 1e6;
    let times = 1;
    let never = || Err("it is never active".to_owned());
    match &operation.activation {
        Activation::Time(start, end) => {
            let (mut start, mut end) = (start.min(*end).max(0.0), start.max(*end));
            if let Activation::Time(from, to) = template.activation
                && from.max(0.0) < to
            {
                (start, end) = (start.max(from), end.min(to));
            }
            if start >= over {
                return Err(format!("its window begins when the test is over, after {}", Unit::SECONDS.number(over)));
            }
            if start < end { Ok(plan::Activation::Time { start, end }) } else { never() }
        }
        Activation::Condition(start, end) => {
            let start = match start.as_ref().map(|it| settled(writer, it)).transpose()? {
                Some(Truth::Sometimes(start)) => start,
                Some(Truth::Always) => return Err("it begins at once, which is no condition".to_owned()),
                Some(Truth::Never) | None => return never(),
            };
            match end.as_ref().map(|it| settled(writer, it)).transpose()? {
                Some(Truth::Sometimes(end)) => Ok(plan::Activation::Condition { start, end, times }),
                Some(Truth::Always) => Err("it ends at once, which is no condition".to_owned()),
                Some(Truth::Never) | None => Ok(plan::Activation::ConditionFor { start, length: forever, times }),
            }
        }
        Activation::ConditionFor(start, length) => match start.as_ref().map(|it| settled(writer, it)).transpose()? {
            Some(Truth::Sometimes(start)) if *length > 0.0 => {
                Ok(plan::Activation::ConditionFor { start, length: *length, times })
            }
            Some(Truth::Always) => Err("it begins at once, which is no condition".to_owned()),
            _ => never(),
        },
        Activation::Unsaid => Err("it does not say when it is active".to_owned()),
    }
}

/// A condition, unless it goes one way in every test.
enum Truth {
    Always,
    Never,
    Sometimes(grown::Condition),
}

fn settled(writer: &Writer<'_>, condition: &Condition) -> Result<Truth, String> {
    settled_at(writer, condition, 1)
}

fn settled_at(writer: &Writer<'_>, condition: &Condition, level: u32) -> Result<Truth, String> {
    if level > MOST_LEVELS {
        return Err(format!("its condition has more than {MOST_LEVELS} levels"));
    }
    let both = |a: &Condition, b: &Condition| -> Result<(Truth, Truth), String> {
        Ok((settled_at(writer, a, level + 1)?, settled_at(writer, b, level + 1)?))
    };
    Ok(match condition {
        Condition::And(a, b) => match both(a, b)? {
            (Truth::Never, _) | (_, Truth::Never) => Truth::Never,
            (Truth::Always, other) | (other, Truth::Always) => other,
            (Truth::Sometimes(a), Truth::Sometimes(b)) => {
                Truth::Sometimes(grown::Condition::And(Box::new(a), Box::new(b)))
            }
        },
        Condition::Or(a, b) => match both(a, b)? {
            (Truth::Always, _) | (_, Truth::Always) => Truth::Always,
            (Truth::Never, other) | (other, Truth::Never) => other,
            (Truth::Sometimes(a), Truth::Sometimes(b)) => {
                Truth::Sometimes(grown::Condition::Or(Box::new(a), Box::new(b)))
            }
        },
        Condition::Compare(left, by, right) => {
            let named = |metric: Reference| {
                let at = writer.original.metric(metric).filter(|&at| writer.mapped.metrics[at].is_some());
                at.ok_or_else(|| "its condition compares something that is not a metric".to_owned())
            };
            let variable = named(*left)?;
            let timed = is_timed(writer, variable);
            let comparison = |right: grown::Operand| {
                Truth::Sometimes(grown::Condition::Compare { left: operand(variable), by: (*by).into(), right })
            };
            match *right {
                Operand::Integer(value) if timed && value < 0 => match by {
                    Comparison::Greater => Truth::Always,
                    Comparison::Less | Comparison::Equal => Truth::Never,
                },
                Operand::Integer(0) if timed && *by == Comparison::Less => Truth::Never,
                Operand::Integer(value) => comparison(grown::Operand::Number(value as f64)),
                Operand::Metric(other) => match named(other)? {
                    other if other == variable && *by == Comparison::Equal => Truth::Always,
                    other if other == variable => Truth::Never,
                    other if is_timed(writer, other) != timed => {
                        return Err("its condition compares seconds with a plain number".to_owned());
                    }
                    other => comparison(operand(other)),
                },
            }
        }
    })
}

/// A metric of the original, by position, as a variable of a condition.
fn operand(metric: usize) -> grown::Operand {
    grown::Operand::Variable(MetricId(u32::try_from(metric).expect("a file has fewer than 2^32 metrics")))
}
