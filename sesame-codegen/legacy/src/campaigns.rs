//! Campaigns of the original, and the tests that they repeat, in the words of the language.

use std::collections::BTreeMap;
use std::fmt::Write as _;
use std::mem::discriminant;

use crate::notes::Kind;
use crate::original::{
    Activation, ActivationMode, Approach, Campaign, Comparison, Condition, Coverage, Domain, MetricSource, Operand,
    Operation, OperationKind, Original, Reference, Test,
};
use crate::parts::{Effect, matching};
use crate::writer::{Writer, number, percent, quoted_text};
use crate::xml::printable;

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
    let mut lines: Vec<String> = Vec::new();
    // What else its tests have values or conditions of is measured too, so that results have a place for it.
    let measured = campaign.tests.iter().flat_map(|test| test.values.iter().map(|&(metric, _)| metric));
    let compared = campaign.tests.iter().flat_map(|test| &test.operations).flat_map(compared_by);
    let mut observed = names(writer, &mut campaign.metrics.iter().copied().chain(measured).chain(compared));
    let end = end_of(original, campaign);
    if campaign.limit.is_none() {
        let text = format!("campaign `{shown}` does not say when its tests end: after {}s now", number(end));
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
            let Some(lines) = held_by(writer, repeated, over).or_else(|| undisturbed(writer, repeated, end)) else {
                return leave_out(writer, "nothing of the test that it repeats can be said");
            };
            let name = known_test(writer, repeated, &lines, tests);
            known.insert(place, name.clone());
            name
        };
        lines.push(format!("repeat   {test} {} times", times.max(1)));
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
        let most = operations.len().max(longest.unwrap_or(0));
        lines.push(format!("objectives {}", objectives.join(", ")));
        observed.retain(|name| !objectives.contains(name));
        // The original platform lets copies of one operation act together.
        lines.push(format!("operations {}   1..{most} per test may overlap", operations.join(", ")));
        activation(writer, campaign, &shown, &mut observed, &mut lines);
        search(writer, campaign, &shown, &mut lines);
    }
    if !observed.is_empty() {
        lines.push(format!("observes {}", observed.join(", ")));
    }
    lines.push(format!("end      after {}s", number(end)));
    let name = writer.name("campaign", &campaign.name);
    text.push('\n');
    if name != campaign.name {
        let _ = writeln!(text, "/// In the original: `{shown}`.");
    }
    let _ = writeln!(text, "campaign {name} {{\n  {}\n}}", lines.join("\n  "));
    Some(name)
}

fn activation(
    writer: &mut Writer<'_>,
    campaign: &Campaign,
    shown: &str,
    observed: &mut Vec<String>,
    lines: &mut Vec<String>,
) {
    let Some(depth) = by_condition(campaign) else {
        lines.push("activate by time".to_owned());
        return;
    };
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
        lines.push("activate by time".to_owned());
        return;
    }
    observed.retain(|name| !over.contains(&name.as_str()));
    let settings = if depth == 0 { String::new() } else { format!(" {{ depth {} }}", depth.min(10)) };
    lines.push(format!("activate by condition over {}{settings}", over.join(", ")));
}

fn search(writer: &mut Writer<'_>, campaign: &Campaign, shown: &str, lines: &mut Vec<String>) {
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
            lines.push(format!("search   nsga2 {{ population {settled}  evaluations {total} }}"));
            if let Some(coverage) = coverage {
                lines.extend(cells(writer, coverage, shown));
            }
        }
        approach => {
            let total = performed.max(100);
            if *approach == Approach::Unsaid {
                writer.notes.say(Kind::Changed, format!("campaign `{shown}` does not say how it searches: at random"));
            }
            lines.push(format!("search   random {{ evaluations {total} }}"));
        }
    }
}

fn cells(writer: &mut Writer<'_>, coverage: &Coverage, shown: &str) -> Option<String> {
    let mut axes = String::new();
    let mut taken: Vec<&str> = Vec::new();
    for (dimension, low, high, count) in &coverage.dimensions {
        let (name, low, high) = match dimension.as_str() {
            "T1_TIME_MIDPOINT_MEAN" => ("T1", *low, *high),
            "T2_TIME_LENGTH_MEAN" => ("T2", *low, *high),
            "T3_TIME_MIDPOINT_VAR" => ("T3", *low, *high),
            "P1_PARAMETER_MEAN" => ("P1", *low, *high),
            "P2_PARAMETER_VARIANCE" => {
                let text =
                    format!("campaign `{shown}`: P2 is a standard deviation, no variance; its cells are converted");
                writer.notes.say(Kind::Changed, text);
                ("P2", low.max(0.0).sqrt(), high.max(0.0).sqrt())
            }
            "O0_TOTAL_COUNT" => ("O0", *low, *high),
            "O1_FUZZRANGE_COUNT" => ("O1", *low, *high),
            // The original has these two the other way round.
            "O2_DELAY_COUNT" => ("O3", *low, *high),
            "O3_DELETION_COUNT" => ("O2", *low, *high),
            other => {
                let other = printable(other);
                writer.notes.say(Kind::LeftOut, format!("campaign `{shown}`: there is no dimension `{other}`"));
                continue;
            }
        };
        if low >= high || *count == 0 || taken.contains(&name) {
            writer.notes.say(Kind::LeftOut, format!("campaign `{shown}`: the cells of {name} are no cells"));
            continue;
        }
        taken.push(name);
        let _ = write!(axes, "{name} [{}, {}] cells {count}   ", number(low), number(high));
    }
    if axes.is_empty() {
        let text = format!(
            "campaign `{shown}`: the file does not say which cells its coverage counts; add `coverage {{ … }}`"
        );
        writer.notes.say(Kind::LeftOut, text);
        return None;
    }
    let stop = if coverage.target > 0.0 && coverage.target <= 1.0 {
        format!("   stop at {}", percent(coverage.target))
    } else {
        String::new()
    };
    Some(format!("coverage {{ {axes}hits {}{stop} }}", coverage.hits.max(1)))
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

/// A test that is repeated, as a known test of these lines; its name.
fn known_test(writer: &mut Writer<'_>, test: &Test, lines: &str, text: &mut String) -> String {
    let name = writer.name("test", &test.name);
    text.push('\n');
    if name != *test.name {
        let _ = writeln!(text, "/// In the original: `{}`.", printable(&test.name));
    }
    let _ = writeln!(text, "test {name} {{\n{lines}}}");
    name
}

/// A line for a known test that disturbs nothing: an operation that adds 0, or loses nothing.
fn undisturbed(writer: &mut Writer<'_>, test: &Test, end: f64) -> Option<String> {
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
                Some((holder, format!("{} offset [0, 0]", part.name)))
            }
            _ => None,
        },
        (Effect::Loss, OperationKind::PacketLoss { keep }) if keep.0.max(keep.1) >= 1.0 => {
            Some((holder, format!("{} loss 0%", part.name)))
        }
        _ => None,
    });
    let (holder, harmless) = harmless.next()?;
    let (from, to) = match holder.activation {
        Activation::Time(from, to) if from.max(0.0) < to.min(end) => (from.max(0.0), to.min(end)),
        _ => (0.0, end),
    };
    let shown = printable(&test.name);
    writer.notes.say(Kind::Changed, format!("known test `{shown}` disturbs nothing: it holds `{harmless}`"));
    Some(format!("  {harmless} from {}s to {}s\n", number(from), number(to)))
}

/// The operations of a known test, a line for each; `None` if there is none that can be said. The test is over after so
/// many seconds.
fn held_by(writer: &mut Writer<'_>, test: &Test, over: f64) -> Option<String> {
    let shown = printable(&test.name);
    let mut lines = String::new();
    for operation in &test.operations {
        let Some(at) = writer.mapped.holders.find(writer.original, operation) else { continue };
        let template = writer.mapped.holders.operations[at].clone();
        for part in writer.mapped.parts[at].clone() {
            let offline = matches!(part.effect, Effect::Custom { offline: true, .. });
            let window =
                if offline { Ok("before start".to_owned()) } else { window(writer, operation, &template, over) };
            match window.and_then(|window| Ok((window, choices(operation, &template, &part.effect)?))) {
                Ok((window, choices)) => {
                    let seed = if operation.seed == 0 || offline {
                        String::new()
                    } else {
                        format!("   seed {}", operation.seed.cast_unsigned())
                    };
                    let _ = writeln!(lines, "  {}{choices} {window}{seed}", part.name);
                }
                Err(why) => {
                    writer.notes.say(Kind::LeftOut, format!("known test `{shown}`, operation `{}`: {why}", part.name));
                }
            }
        }
    }
    (!lines.is_empty()).then_some(lines)
}

/// A delay as far as a template permits it, in seconds.
fn permitted_delay(template: &Operation, delay: f64) -> f64 {
    let delay = match template.kind {
        OperationKind::Latency { delay: of, .. } => delay.clamp(of.0.min(of.1), of.0.max(of.1)),
        _ => delay,
    };
    delay.max(0.0)
}

/// What a test chooses, in words, each after a blank. What its template does not permit is the nearest that it does, so
/// that the space is right.
fn choices(operation: &Operation, template: &Operation, effect: &Effect) -> Result<String, String> {
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
            format!(" {word} [{}, {}]", number(low), number(high))
        }
        (Effect::Loss, OperationKind::PacketLoss { keep }) => {
            let chosen = match template.kind {
                OperationKind::PacketLoss { keep: of } => keep.0.min(keep.1).clamp(of.0.min(of.1), of.0.max(of.1)),
                _ => keep.0.min(keep.1),
            };
            format!(" loss {}", percent(1.0 - chosen.clamp(0.0, 1.0)))
        }
        (Effect::Delay { randomised: false }, OperationKind::Latency { delay, .. }) => {
            format!(" delay {}s", number(permitted_delay(template, delay.0.min(delay.1))))
        }
        (Effect::Delay { randomised: true }, OperationKind::Latency { delay, .. }) => {
            let (low, high) = (delay.0.min(delay.1), delay.0.max(delay.1));
            let (low, high) = (permitted_delay(template, low), permitted_delay(template, high));
            format!(" delay [{}s, {}s]", number(low), number(high))
        }
        (Effect::Custom { parameters, .. }, _) => {
            let mut text = String::new();
            for (name, at) in parameters {
                let chosen = domain(*at)?;
                if permitted.get(*at).is_some_and(|set| discriminant(&set.domain) != discriminant(chosen)) {
                    return Err(format!("what it chooses for `{name}` is of another kind than its template permits"));
                }
                let chosen = match chosen {
                    Domain::Reals(low, high) => number(within(low.min(*high), *high, *at).0),
                    Domain::Integers(low, high) => {
                        let low = *low.min(high);
                        match permitted.get(*at).map(|set| &set.domain) {
                            Some(&Domain::Integers(from, to)) => low.clamp(from.min(to), from.max(to)).to_string(),
                            _ => low.to_string(),
                        }
                    }
                    Domain::Points(low, _) => {
                        let mut point = *low;
                        if let Some(Domain::Points(from, to)) = permitted.get(*at).map(|set| &set.domain) {
                            for axis in 0..3 {
                                point[axis] = point[axis].clamp(from[axis].min(to[axis]), from[axis].max(to[axis]));
                            }
                        }
                        format!("({}, {}, {})", number(point[0]), number(point[1]), number(point[2]))
                    }
                    Domain::Texts(texts) => {
                        let offered = |text: &str| match permitted.get(*at).map(|set| &set.domain) {
                            Some(Domain::Texts(offered)) => offered.iter().any(|it| **it == *text),
                            _ => true,
                        };
                        match texts.first().filter(|text| offered(text)) {
                            Some(text) => quoted_text(text),
                            None => return Err("it chooses no text that its template offers".to_owned()),
                        }
                    }
                    Domain::Other(_) => return Err("it chooses something that nothing is like".to_owned()),
                };
                let _ = write!(text, " {name} {chosen}");
            }
            text
        }
        (Effect::Blackhole, _) => String::new(),
        (Effect::Loss | Effect::Delay { .. }, _) => return Err("it does something else than its template".to_owned()),
    })
}

/// When an operation of a known test is active, in words.
fn window(writer: &Writer<'_>, operation: &Operation, template: &Operation, over: f64) -> Result<String, String> {
    let forever = "1000000s";
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
                return Err(format!("its window begins when the test is over, after {}s", number(over)));
            }
            if start < end { Ok(format!("from {}s to {}s", number(start), number(end))) } else { never() }
        }
        Activation::Condition(start, end) => {
            let start = match start.as_ref().map(|it| settled(writer, it)).transpose()? {
                Some(Truth::Sometimes(words)) => words,
                Some(Truth::Always) => return Err("it begins at once, which is no condition".to_owned()),
                Some(Truth::Never) | None => return never(),
            };
            match end.as_ref().map(|it| settled(writer, it)).transpose()? {
                Some(Truth::Sometimes(end)) => Ok(format!("when {start} until {end}")),
                Some(Truth::Always) => Err("it ends at once, which is no condition".to_owned()),
                Some(Truth::Never) | None => Ok(format!("when {start} for {forever}")),
            }
        }
        Activation::ConditionFor(start, length) => match start.as_ref().map(|it| settled(writer, it)).transpose()? {
            Some(Truth::Sometimes(words)) if *length > 0.0 => Ok(format!("when {words} for {}s", number(*length))),
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
    Sometimes(String),
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
            (Truth::Sometimes(a), Truth::Sometimes(b)) => Truth::Sometimes(format!("({a}) and ({b})")),
        },
        Condition::Or(a, b) => match both(a, b)? {
            (Truth::Always, _) | (_, Truth::Always) => Truth::Always,
            (Truth::Never, other) | (other, Truth::Never) => other,
            (Truth::Sometimes(a), Truth::Sometimes(b)) => Truth::Sometimes(format!("({a}) or ({b})")),
        },
        Condition::Compare(left, by, right) => {
            let named = |metric: Reference| {
                let source = writer.original.metric(metric).map(|at| &writer.original.metrics[at].source);
                writer.metric(metric).zip(source).ok_or_else(|| "its condition compares what is no metric".to_owned())
            };
            let (variable, source) = named(*left)?;
            let sign = match by {
                Comparison::Less => "<",
                Comparison::Greater => ">",
                Comparison::Equal => "==",
            };
            let timed = *source == MetricSource::FuzzingTime;
            match *right {
                Operand::Integer(value) if timed && value < 0 => match by {
                    Comparison::Greater => Truth::Always,
                    Comparison::Less | Comparison::Equal => Truth::Never,
                },
                Operand::Integer(0) if timed && *by == Comparison::Less => Truth::Never,
                Operand::Integer(value) => {
                    Truth::Sometimes(format!("{variable} {sign} {value}{}", if timed { "s" } else { "" }))
                }
                Operand::Metric(other) => match named(other)? {
                    (other, _) if other == variable && *by == Comparison::Equal => Truth::Always,
                    (other, _) if other == variable => Truth::Never,
                    (_, source) if (*source == MetricSource::FuzzingTime) != timed => {
                        return Err("its condition compares seconds with a plain number".to_owned());
                    }
                    (other, _) => Truth::Sometimes(format!("{variable} {sign} {other}")),
                },
            }
        }
    })
}
