//! Runtime monitors of the original (EDDIs, as `ConSert`s): what of them is in a file, as `external` monitors.
//!
//! A file has no certificates. It has the variables on which a `ConSert` says whether a guarantee holds, named
//! `CONSERT/guarantee_NAME`, and metrics of how long before a violation it warned. What the `ConSert` decides from is
//! neither in the file nor guessed here: what became of it is a note.

use std::fmt::Write as _;

use sesame_notation::{Unit, doc_comment};

use crate::naming::Names;
use crate::notes::Kind;
use crate::original::{Metric, MetricSource};
use crate::writer::{Writer, called_before};
use crate::xml::printable;

/// How the last part of the name of a variable begins on which a `ConSert` says whether a guarantee holds.
const GUARANTEE: &str = "guarantee";

/// What the name of a metric of warnings contains.
const WARNING: &str = "WarningTime";

/// How the name of a metric ends that regards one guarantee only, `…HighOnly`.
const ONLY: &str = "Only";

/// Words of strength in names of guarantees, the strongest first.
const STRENGTHS: [&str; 3] = ["high", "medium", "low"];

/// How many monitors a space may have, and guarantees a monitor.
const MOST: usize = 1000;

/// A `ConSert`, in the names of the space.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Consert {
    /// Its name.
    name: String,
    /// Its guarantees, the strongest first.
    guarantees: Vec<Guarantee>,
}

#[derive(Debug, Clone, PartialEq)]
struct Guarantee {
    name: String,
    /// The topic, or the field of it, that says whether it holds.
    said_by: String,
    topic: String,
}

impl Guarantee {
    fn strength(&self) -> Option<usize> {
        STRENGTHS.iter().position(|strength| self.has_word(strength))
    }

    fn has_word(&self, word: &str) -> bool {
        self.name.split('_').any(|part| part.eq_ignore_ascii_case(word))
    }
}

/// A metric of warnings that is to be written as a lead time.
pub(crate) struct Warned {
    metric: usize,
    /// Its name in the space.
    pub(crate) name: String,
    monitor: String,
    hazard: usize,
}

impl Writer<'_> {
    /// The `ConSert`s of the file, as monitors of the space.
    pub(crate) fn monitors(&mut self) -> String {
        let mut found: Vec<(String, Vec<Guarantee>)> = Vec::new();
        for ((path, _), topic) in self.original.system.variables.iter().zip(&self.topics) {
            let Some((topic, ty)) = topic else { continue };
            let (group, last) = path.rsplit_once('/').unwrap_or(("", path));
            let Some(start) = last.get(..GUARANTEE.len()) else { continue };
            let Some(field) = self.messages.truth(ty).filter(|_| start.eq_ignore_ascii_case(GUARANTEE)) else {
                continue;
            };
            let guarantee = Guarantee {
                name: last[GUARANTEE.len()..].to_owned(),
                said_by: format!("{topic}{field}"),
                topic: topic.clone(),
            };
            match found.iter_mut().find(|(known, _)| known == group) {
                Some((_, guarantees)) if guarantees.iter().any(|other| other.topic == *topic) => {}
                Some((_, guarantees)) => guarantees.push(guarantee),
                None => found.push((group.to_owned(), vec![guarantee])),
            }
        }
        let mut text = String::new();
        for (group, mut guarantees) in found {
            let shown = printable(&group);
            if guarantees.len() > MOST || self.conserts.len() == MOST {
                self.notes.say(Kind::LeftOut, format!("ConSert `{shown}`: there are more than {MOST}, or it has more"));
                continue;
            }
            let name = self.names.take(&group, "monitor");
            let mut inner = Names::default();
            for guarantee in &mut guarantees {
                guarantee.name = inner.take(&guarantee.name, "guarantee");
            }
            let by_words = guarantees.iter().all(|guarantee| guarantee.strength().is_some());
            if by_words {
                // Stable: equal ones stay in the order of the file.
                guarantees.sort_by_key(Guarantee::strength);
            }
            self.notes.say(
                Kind::Mapped,
                format!(
                    "ConSert `{shown}` is an `external` monitor: what it says is watched. What it decides from is not in \
                     the file"
                ),
            );
            if guarantees.len() > 1 {
                let order: Vec<String> = guarantees.iter().map(|guarantee| format!("`{}`", guarantee.name)).collect();
                let by = if by_words { "by the words in their names" } else { "in the order of the file" };
                let order = order.join(", ");
                self.notes.say(
                    Kind::Changed,
                    format!("ConSert `{shown}`: the file does not say which guarantee is stronger; {by}: {order}"),
                );
            }
            let consert = Consert { name, guarantees };
            let doc = format!("In the original a process of its own, ConSert `{shown}`.");
            text.push('\n');
            text.push_str(&doc_comment(&doc));
            write_monitor(&mut text, &consert.name, &consert.guarantees);
            self.conserts.push(consert);
        }
        text
    }

    /// Whether a metric is of how long a `ConSert` warned before a hazard; declares a monitor of one guarantee if it
    /// regards one only.
    pub(crate) fn warned(&mut self, at: usize, monitors: &mut String) -> Option<Warned> {
        let original = self.original;
        let metric = &original.metrics[at];
        if metric.source != MetricSource::Code || !metric.name.contains(WARNING) {
            return None;
        }
        let consert = self.conserts.iter().find(|consert| self.hears(metric, consert))?.clone();
        let shown = printable(&metric.name);
        let Some(hazard) = self.hazard_of(metric) else {
            self.notes.say(
                Kind::Noted,
                format!("metric `{shown}` stays a hook: no other metric of what it hears says what it warns of"),
            );
            return None;
        };
        let mut monitor = consert.name.clone();
        if let Some(word) = only(&metric.name) {
            let mut meant = consert.guarantees.iter().filter(|guarantee| guarantee.has_word(word));
            let (Some(guarantee), None) = (meant.next(), meant.next()) else {
                let text = format!("metric `{shown}` stays a hook: no one guarantee is `{}`", printable(word));
                self.notes.say(Kind::Noted, text);
                return None;
            };
            monitor = self.names.take(&format!("{}_{}", consert.name, word.to_ascii_lowercase()), "monitor");
            let text = format!("metric `{shown}` regards one guarantee, so it has a monitor of its own, `{monitor}`");
            self.notes.say(Kind::Mapped, text);
            let doc = format!("One guarantee of `{}`.", consert.name);
            monitors.push('\n');
            monitors.push_str(&doc_comment(&doc));
            write_monitor(monitors, &monitor, std::slice::from_ref(guarantee));
        }
        let name = self.name("metric", &metric.name);
        Some(Warned { metric: at, name, monitor, hazard })
    }

    /// Metrics of warnings as lead times, and the requirements whose hazards they are about. To be called when all
    /// metrics have their names.
    pub(crate) fn lead_times(&mut self, warned: &[Warned]) -> String {
        let mut text = String::new();
        let mut requirements: Vec<(usize, String)> = Vec::new();
        for &Warned { metric: at, ref name, ref monitor, hazard } in warned {
            let original = self.original;
            let metric = &original.metrics[at];
            let of_hazard = self.mapped.metrics[hazard].clone().expect("a metric of hazards was written");
            let known = requirements.iter().find(|(of, _)| *of == hazard).map(|(_, name)| name.clone());
            let requirement = known.unwrap_or_else(|| {
                let requirement = self.names.take("R1", "requirement");
                requirements.push((hazard, requirement.clone()));
                requirement
            });
            let shown = printable(&metric.name);
            let none = none_of(&original.metrics[hazard]);
            self.notes.say(
                Kind::Changed,
                format!(
                    "metric `{shown}` is `lead_time({monitor}, {requirement})`: a hazard is that `{of_hazard}` is \
                     beyond {none}, its value without one. Its Java code may say otherwise"
                ),
            );
            text.push('\n');
            if *name != metric.name {
                text.push_str(&doc_comment(&called_before(&metric.name)));
            }
            let direction = if metric.highest { "maximise" } else { "minimise" };
            let value = |word: &str, seconds: Option<f64>| {
                seconds.map_or(String::new(), |seconds| format!(" {word} {}", Unit::SECONDS.number(seconds)))
            };
            let (default, initial) = (value("default", metric.default), value("initial", metric.initial));
            let _ = writeln!(text, "metric {name} {direction}{default}{initial} = lead_time({monitor}, {requirement})");
        }
        for (hazard, requirement) in requirements {
            let metric = &self.original.metrics[hazard];
            let name = self.mapped.metrics[hazard].as_deref().expect("a metric of hazards was written");
            let bound = if metric.highest { "<=" } else { ">=" };
            let none = Unit::None.number(none_of(metric));
            let _ = writeln!(
                text,
                "\n// The file has no bounds: this one is the value of the metric without a hazard.\n\
                 requirement {requirement} \"There is no hazard of {name}\" = {name} {bound} {none}"
            );
        }
        text
    }

    fn hears(&self, metric: &Metric, consert: &Consert) -> bool {
        let heard = metric.related.iter().filter_map(|&reference| self.topic(reference));
        heard.into_iter().any(|(topic, _)| consert.guarantees.iter().any(|guarantee| guarantee.topic == *topic))
    }

    /// The metric of the hazards that a metric of warnings is about: it hears something of what that one hears, and no
    /// guarantee. Those that are optimised come first, since violations are what a search looks for.
    fn hazard_of(&self, warning: &Metric) -> Option<usize> {
        let heard: Vec<&str> = warning
            .related
            .iter()
            .filter_map(|&reference| self.topic(reference))
            .map(|(topic, _)| topic.as_str())
            .collect();
        let fits = |metric: &Metric| {
            metric.source == MetricSource::Code
                && !self.conserts.iter().any(|consert| self.hears(metric, consert))
                && metric
                    .related
                    .iter()
                    .filter_map(|&reference| self.topic(reference))
                    .any(|(topic, _)| heard.contains(&topic.as_str()))
        };
        let metrics = self.original.metrics.iter().enumerate().filter(|(_, metric)| fits(metric));
        metrics.min_by_key(|(at, metric)| (!metric.optimised, *at)).map(|(at, _)| at)
    }
}

/// The value of a metric in a test without hazards.
fn none_of(metric: &Metric) -> f64 {
    metric.default.or(metric.initial).unwrap_or(0.0)
}

/// The word of the one guarantee that a metric regards, `High` of `WarningTimeHighOnly`.
fn only(name: &str) -> Option<&str> {
    let (_, after) = name.split_once(WARNING)?;
    let word = after.strip_suffix(ONLY)?.trim_matches('_');
    (!word.is_empty()).then_some(word)
}

fn write_monitor(text: &mut String, name: &str, guarantees: &[Guarantee]) {
    let mut inner = Names::default();
    for guarantee in guarantees {
        inner.take(&guarantee.name, "guarantee");
    }
    let evidence: Vec<String> =
        guarantees.iter().map(|guarantee| inner.take(&format!("says_{}", guarantee.name), "evidence")).collect();
    let otherwise = inner.take("no_guarantee", "no_guarantee");
    let _ = writeln!(text, "eddi {name} external {{");
    for (evidence, guarantee) in evidence.iter().zip(guarantees) {
        let _ = writeln!(text, "  evidence {evidence} = {}", guarantee.said_by);
    }
    for ((at, guarantee), evidence) in (0..).zip(guarantees).zip(&evidence) {
        let _ = writeln!(text, "  guarantee {} integrity {} = {evidence}", guarantee.name, guarantees.len() - at);
    }
    let _ = writeln!(text, "  otherwise {otherwise}\n}}");
}
