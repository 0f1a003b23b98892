//! Certificates over time: for each monitor of a test its states and its evidence, against the violations of
//! requirements. The lanes share the time axis of the test's timeline.

use std::fmt::Write as _;

use sesame_present::axis::Axis;
use sesame_present::markup::{Markup, coordinate, percent};

use crate::facts::certificate::test::{DecisionReport, EvidenceReport, HazardReport, MonitorReport};
use crate::facts::certificate::why::cause_text;
use crate::html::timeline::{backdrop, row};
use crate::tables::monitors::{foreseen_text, seconds};

/// Height of the band of states, of a line of names above it, and of a lane of evidence, in pixels.
const BAND: f64 = 26.0;
const LINE: f64 = 16.0;
const EVIDENCE: f64 = 16.0;

/// Changes that are closer together than this share of the width are drawn as one.
const CLOSE: f64 = 1.0 / 400.0;

/// About the width of a plot in letters of a name.
const LETTERS: f64 = 105.0;

/// Monitors with more evidence than this have it folded away.
const SHOWN: usize = 8;

/// The most decisions that a picture is described with in words.
const SPOKEN: usize = 12;

/// How many tones guarantees have: the strongest has the last one.
const TONES: usize = 4;

/// Draws the lanes of monitors; `end` is the end of the run, and when it broke off if it did.
pub(crate) fn lanes(
    markup: &mut Markup,
    time: &Axis,
    monitors: &[MonitorReport],
    (end, broke_off): (f64, Option<f64>),
) {
    for monitor in monitors {
        states(markup, time, monitor, (end, broke_off));
        if monitor.evidence.len() > SHOWN {
            let names: Vec<&str> = monitor.evidence.iter().map(|evidence| evidence.evidence.as_str()).collect();
            markup.open("details", &[("class", "idle")]);
            markup.element("summary", &[], &format!("evidence of {}: {}", monitor.monitor, names.join(", ")));
        }
        for shown in &monitor.evidence {
            evidence(markup, time, monitor, shown, (end, broke_off));
        }
        if monitor.evidence.len() > SHOWN {
            markup.close();
        }
    }
}

/// A span of something that stays the same.
struct Stretch<T> {
    start: f64,
    end: f64,
    /// What it is; or how many changes there are in it, if they are too close together to be drawn.
    what: Result<T, usize>,
}

/// Stretches of what holds from each of these times on, in order; changes that are very close become one stretch.
fn stretches<T>(changes: Vec<(f64, T)>, time: &Axis, end: f64) -> Vec<Stretch<T>> {
    let starts: Vec<f64> = changes.iter().map(|change| change.0).collect();
    let mut all: Vec<Stretch<T>> = Vec::new();
    for (at, (start, what)) in changes.into_iter().enumerate() {
        let until = starts.get(at + 1).copied().unwrap_or(end).min(end);
        // What is over within its instant is not seen.
        if until <= start && at + 1 < starts.len() {
            continue;
        }
        let is_short = |start: f64, end: f64| time.share(end) - time.share(start) < CLOSE;
        match all.last_mut() {
            Some(last) if is_short(start, until) && (last.what.is_err() || is_short(last.start, last.end)) => {
                last.what = Err(last.what.as_ref().err().copied().unwrap_or(1) + 1);
                last.end = until;
            }
            _ => all.push(Stretch { start, end: until, what: Ok(what) }),
        }
    }
    all
}

fn states(markup: &mut Markup, time: &Axis, monitor: &MonitorReport, (end, broke_off): (f64, Option<f64>)) {
    let above = names_above(time, &monitor.hazards);
    let mitigated = monitor.decisions.iter().any(|decision| decision.mitigation.is_some());
    let lines = above.iter().map(|(_, line)| line + 1).max().unwrap_or(0) + usize::from(mitigated);
    let top = LINE * lines as f64;
    row(markup, |markup| {
        markup.element("b", &[], &monitor.monitor);
        let kind = if monitor.external { "external monitor" } else { "monitor" };
        markup.element("span", &[("class", "quiet")], kind);
        for hazard in &monitor.hazards {
            let class = if hazard.is_missed() { "hazard-of missed" } else { "hazard-of quiet" };
            let words = format!("{} {} {}", sign(hazard), hazard.requirement, foreseen_text(hazard));
            markup.element("span", &[("class", class), ("title", &hazard_title(monitor, hazard))], &words);
        }
        if monitor.omitted > 0 {
            let words = format!("{} later changes not kept", monitor.omitted);
            markup.element("span", &[("class", "note")], &words);
        }
    });
    let (tall, label) = (coordinate(top + BAND), spoken(monitor));
    markup.open("svg", &[("class", "plot states"), ("height", &tall), ("role", "img"), ("aria-label", &label)]);
    backdrop(markup, time, broke_off);
    let changes = monitor.decisions.iter().map(|decision| (decision.at, decision)).collect();
    for Stretch { start, end, what } in stretches(changes, time, end) {
        let (class, name, title, tone) = match what {
            Ok(decision) => {
                let tone = tone(monitor, decision);
                let class = tone.map_or("state safe".to_owned(), |tone| format!("state g{tone}"));
                (class, Some(decision.state.as_str()), decision_title(monitor, decision), tone)
            }
            Err(count) => ("state changing".to_owned(), None, changing(&monitor.monitor, count, start, end), None),
        };
        let height = tone.map_or(BAND, |tone| BAND * (0.5 + 0.5 * tone as f64 / TONES as f64));
        let span = Drawn { class: &class, start, end, y: top + BAND - height, height };
        span.draw(markup, time, name.unwrap_or("changing"), &title);
        if let Some(name) = name {
            let fits = LETTERS * (time.share(end) - time.share(start)) > name.chars().count() as f64 + 1.5;
            let class = if fits { "state-name" } else { "state-name out" };
            let (x, y) = (percent(time.share(start)), coordinate(top + BAND - 8.0));
            let until = percent(time.share(end));
            let attributes = [("class", class), ("x", x.as_str()), ("y", &y), ("dx", "5"), ("data-until", &until)];
            markup.element("text", &attributes, name);
        }
    }
    for decision in &monitor.decisions {
        let Some(sent) = &decision.mitigation else { continue };
        let (x, y) = (percent(time.share(decision.at)), coordinate(top - 4.0));
        markup.open("text", &[("class", "mark middle"), ("x", &x), ("y", &y)]);
        markup.element("title", &[], &format!("mitigation sent at {}: {sent}", seconds(decision.at)));
        markup.text("▼");
        markup.close();
    }
    hazard_lines(markup, time, monitor);
    for (hazard, line) in above {
        let class = if hazard.is_missed() { "hazard-name missed" } else { "hazard-name" };
        let at = time.share(hazard.at);
        let class = if at > 0.7 { format!("{class} end") } else { class.to_owned() };
        let (x, y) = (percent(at), coordinate(LINE * line as f64 + 12.0));
        let dx = if at > 0.7 { "-6" } else { "6" };
        markup.element("text", &[("class", &class), ("x", &x), ("y", &y), ("dx", dx)], &hazard_name(hazard));
    }
    markup.close();
    markup.close();
}

fn evidence(
    markup: &mut Markup,
    time: &Axis,
    monitor: &MonitorReport,
    shown: &EvidenceReport,
    (end, broke_off): (f64, Option<f64>),
) {
    markup.open("div", &[("class", "row evidence")]);
    markup.open("div", &[("class", "label"), ("title", &format!("{} = {}", shown.evidence, shown.condition))]);
    markup.element("b", &[], &shown.evidence);
    markup.close();
    let mut said = format!("{} of {}: unknown", shown.evidence, monitor.monitor);
    for change in shown.changes.iter().take(SPOKEN) {
        let _ = write!(said, ", {} from {}", change.is, seconds(change.at));
    }
    let tall = coordinate(EVIDENCE);
    markup.open("svg", &[("class", "plot"), ("height", &tall), ("role", "img"), ("aria-label", &said)]);
    backdrop(markup, time, broke_off);
    let unknown = (0.0, ("unknown", "nothing heard yet".to_owned()));
    let changes = shown.changes.iter().map(|change| (change.at, (change.is.as_str(), cause_text(&change.cause))));
    for Stretch { start, end, what } in stretches(std::iter::once(unknown).chain(changes).collect(), time, end) {
        let (is, title) = match what {
            Ok((is, cause)) => {
                let title = format!("{} {is} from {} to {}: {cause}", shown.evidence, seconds(start), seconds(end));
                (is, title)
            }
            Err(count) => ("changing", changing(&shown.evidence, count, start, end)),
        };
        let (y, height) = if is == "false" { (EVIDENCE - 3.0, 3.0) } else { (2.0, EVIDENCE - 2.0) };
        let class = format!("evidence-is {is}");
        Drawn { class: &class, start, end, y, height }.draw(markup, time, is, &title);
    }
    hazard_lines(markup, time, monitor);
    markup.close();
    markup.close();
}

/// A rectangle in a lane.
struct Drawn<'a> {
    class: &'a str,
    start: f64,
    end: f64,
    y: f64,
    height: f64,
}

impl Drawn<'_> {
    fn draw(&self, markup: &mut Markup, time: &Axis, state: &str, title: &str) {
        let (x, width) = (time.share(self.start), time.share(self.end) - time.share(self.start));
        let (x, width) = (percent(x), percent(width.max(0.0005)));
        let (y, height) = (coordinate(self.y), coordinate(self.height));
        let place = [("x", x.as_str()), ("y", &y), ("width", &width), ("height", &height)];
        markup.open("rect", &[&[("class", self.class), ("data-state", state)][..], &place].concat());
        markup.element("title", &[], title);
        markup.close();
    }
}

/// The tone of a guarantee, from 1 for the weakest to [`TONES`] for the strongest; `None` of the safe state.
fn tone(monitor: &MonitorReport, decision: &DecisionReport) -> Option<usize> {
    let guarantees = monitor.states.len().saturating_sub(1).max(1);
    let stronger = monitor.states.iter().position(|state| state.state == decision.state)?;
    (!decision.is_safe()).then(|| (TONES * (guarantees - stronger.min(guarantees - 1))).div_ceil(guarantees))
}

fn hazard_lines(markup: &mut Markup, time: &Axis, monitor: &MonitorReport) {
    for hazard in &monitor.hazards {
        let x = percent(time.share(hazard.at));
        let class = if hazard.is_missed() { "hazard missed" } else { "hazard" };
        markup.open("line", &[("class", class), ("x1", &x), ("x2", &x), ("y1", "0"), ("y2", "100%")]);
        markup.element("title", &[], &hazard_title(monitor, hazard));
        markup.close();
    }
}

/// The lines above the states on which the names of hazards stand, so that none covers another.
fn names_above<'a>(time: &Axis, hazards: &'a [HazardReport]) -> Vec<(&'a HazardReport, usize)> {
    let mut taken: Vec<Vec<(f64, f64)>> = Vec::new();
    let mut placed = Vec::new();
    for hazard in hazards {
        let (at, length) = (time.share(hazard.at), (hazard_name(hazard).chars().count() as f64 + 2.0) / LETTERS);
        let span = if at > 0.7 { (at - length, at) } else { (at, at + length) };
        let is_free = |spans: &Vec<(f64, f64)>| spans.iter().all(|other| span.1 < other.0 || other.1 < span.0);
        let line = taken.iter().position(is_free).unwrap_or(taken.len());
        if line == taken.len() {
            taken.push(Vec::new());
        }
        taken[line].push(span);
        placed.push((hazard, line));
    }
    placed
}

fn sign(hazard: &HazardReport) -> &'static str {
    if hazard.is_missed() { "✗" } else { "✓" }
}

fn hazard_name(hazard: &HazardReport) -> String {
    match hazard.lead {
        Some(lead) if lead > 0.0 => format!("{} {} foreseen, {}", sign(hazard), hazard.requirement, seconds(lead)),
        Some(_) => format!("{} {} detected", sign(hazard), hazard.requirement),
        None => format!("{} {} MISSED", sign(hazard), hazard.requirement),
    }
}

fn hazard_title(monitor: &MonitorReport, hazard: &HazardReport) -> String {
    let HazardReport { requirement, text, at, .. } = hazard;
    let how = match hazard.lead {
        Some(lead) if lead > 0.0 => format!("{} had been in its safe state for {}", monitor.monitor, seconds(lead)),
        Some(_) => format!("{} went into its safe state in that instant", monitor.monitor),
        None => format!("MISSED: {} was not in its safe state", monitor.monitor),
    };
    format!("{requirement} ({text}) was lost at {}. {how}", seconds(*at))
}

/// What a decision was, and why.
fn decision_title(monitor: &MonitorReport, decision: &DecisionReport) -> String {
    let from = seconds(decision.at);
    let kind = if decision.is_safe() { "safe state".to_owned() } else { format!("integrity {}", decision.integrity) };
    let mut title =
        format!("{}: {} ({kind}) from {from} to {}", monitor.monitor, decision.state, seconds(decision.until));
    if decision.cause.is_some() {
        let _ = write!(title, "\nCaused by: {}", decision.cause_text().replace('`', ""));
    }
    for why in &decision.why {
        let _ = write!(title, "\n{}", why.sentence.replace('`', ""));
        for because in &why.because {
            let _ = write!(title, "\n  {}", because.words(&monitor.monitor).replace('`', ""));
        }
    }
    if let Some(sent) = &decision.mitigation {
        let _ = write!(title, "\nSent: {sent}");
    }
    title
}

fn changing(what: &str, count: usize, start: f64, end: f64) -> String {
    format!("{what} changes {count} times from {} to {}", seconds(start), seconds(end))
}

/// A monitor's test in words.
fn spoken(monitor: &MonitorReport) -> String {
    let mut words = format!("{}:", monitor.monitor);
    for (at, decision) in monitor.decisions.iter().take(SPOKEN).enumerate() {
        let before = if at == 0 { "" } else { "," };
        let _ = write!(words, "{before} {} from {}", decision.state, seconds(decision.at));
    }
    if monitor.decisions.len() > SPOKEN {
        let _ = write!(words, ", and {} changes more", monitor.decisions.len() - SPOKEN);
    }
    for hazard in &monitor.hazards {
        let _ = write!(words, "; hazard of {} at {} {}", hazard.requirement, seconds(hazard.at), foreseen_text(hazard));
    }
    words
}
