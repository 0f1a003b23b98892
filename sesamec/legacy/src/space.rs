//! From an [`Original`] to the text of a `.sesame` file, and what in it stands for what.

use std::collections::BTreeMap;
use std::fmt::Write as _;

use sesame_notation::{self as notation, Clauses, Unit, doc_comment, quoted};
use sesame_plan::condition::Integers;
use sesame_plan::{self as plan, ChoiceKind};

use crate::campaigns;
use crate::dialect::Dialect;
use crate::lacks::NO_NEGATIVE_DELAY;
use crate::naming::Names;
use crate::notes::{Kind, Notes};
use crate::original::{
    Activation, ActivationMode, Approach, Constraint, Domain, MetricSource, Operation, OperationKind, Original,
    Reference,
};
use crate::parts::{Effect, Holders, Part, called, ordered};
use crate::types::{Messages, Type};
use crate::writer::{Mapped, Writer, called_before, meant};
use crate::xml::{cleaned, printable};

/// Maps a whole space. The error says what it lacks.
pub(crate) fn map(original: &Original, file: &str, notes: &mut Notes) -> Result<Mapped, String> {
    dialect(original, notes);
    let mut names = Names::default();
    let space = names.take(&original.name, "space");
    let holders = Holders::of(original);
    let mut writer = Writer {
        original,
        notes,
        names,
        first_ends: first_ends(original, &holders),
        mapped: Mapped { holders, ..Mapped::default() },
        messages: Messages::default(),
        conserts: Vec::new(),
        topics: Vec::new(),
    };
    let topics = writer.topics();
    if writer.topics.iter().all(Option::is_none) {
        return Err("it declares no variables, so there is nothing that could be disturbed".to_owned());
    }
    let mut monitors = writer.monitors();
    let metrics = writer.metrics(&mut monitors);
    // Fields that only operations speak of are declared by them, so messages come last.
    let operations = writer.operations();
    let (tests, campaigns) = campaigns::write(&mut writer);
    let system = writer.system(&topics);
    let called = printable(file);
    let mut text = format!(
        "// Imported by sesamec from {called}. The file is yours: units, names and simulator are for you to settle.\n\
         space {space}\n\n{system}\n"
    );
    for part in [monitors, metrics, operations, tests, campaigns] {
        if !part.is_empty() {
            let _ = write!(text, "\n{}", part.trim_start_matches('\n'));
        }
    }
    writer.mapped.text = text;
    Ok(writer.mapped)
}

fn first_ends(original: &Original, holders: &Holders) -> Vec<f64> {
    let mut ends = vec![f64::INFINITY; holders.operations.len()];
    for campaign in &original.campaigns {
        let end = campaigns::end_of(original, campaign);
        let included = campaign.included.iter().filter_map(|&reference| original.operation(reference));
        for at in included.chain(holders.used_by(original, &campaign.tests)) {
            ends[at] = ends[at].min(end);
        }
    }
    ends
}

fn dialect(original: &Original, notes: &mut Notes) {
    for ((old, new), &times) in &original.dialect.renamed {
        notes.times(Kind::Renamed, format!("`{old}` is `{new}` since"), times);
    }
    for (name, &times) in &original.dialect.left_out {
        notes.times(Kind::LeftOut, format!("`{name}`: {}", Dialect::why(name)), times);
    }
}

impl Writer<'_> {
    fn topics(&mut self) -> Vec<(String, String, Type)> {
        let mut written: Vec<(String, String, Type)> = Vec::new();
        let mut paths: BTreeMap<String, usize> = BTreeMap::new();
        for (name, ty) in &self.original.system.variables {
            let path: String = name
                .chars()
                .take(200)
                .map(|c| if c.is_whitespace() || c.is_control() || "{}\"\\".contains(c) { '_' } else { c })
                .collect();
            if path.is_empty() {
                self.notes.say(Kind::LeftOut, "a variable without a name");
                self.topics.push(None);
                continue;
            }
            if path != *name {
                self.notes.say(Kind::Changed, format!("variable `{}` is `{path}` now", printable(name)));
            }
            if let Some(&at) = paths.get(&path) {
                let (topic, _, ty) = written[at].clone();
                self.topics.push(Some((topic, ty)));
                continue;
            }
            let topic = self.names.take(&path, "topic");
            let ty = self.messages.of(self.original, *ty, &mut self.names);
            paths.insert(path.clone(), written.len());
            self.topics.push(Some((topic.clone(), ty.clone())));
            written.push((topic, path, ty));
        }
        written
    }

    fn system(&mut self, topics: &[(String, String, Type)]) -> String {
        let mut text = "system {\n".to_owned();
        let simulator = self.original.system.simulator.clone().unwrap_or_default();
        if simulator.kind.is_empty() {
            let text = "the file names no simulator: the line of the simulator is a placeholder to be replaced";
            self.notes.say(Kind::Noted, text);
        } else {
            let (kind, address) = (printable(&simulator.kind), printable(&simulator.address));
            let at = if address.is_empty() { String::new() } else { format!(" at {address}") };
            let doc = format!("In the original: {kind}{at}. Name your simulator here.");
            let _ = write!(text, "  {}", doc_comment(&doc));
            self.notes.say(Kind::Changed, format!("simulator {kind}{at}: its line is a placeholder to be replaced"));
        }
        let step = simulator.step_ms.filter(|step| (0.001..=3_600_000.0).contains(step));
        // Times are whole nanoseconds.
        let step = (step.unwrap_or(20.0) * 1e6).round() / 1e6;
        let sut = self.names.take("system_under_test", "system_under_test");
        let step = Unit::Symbol("ms").number(step);
        let _ = writeln!(text, "  simulator {sut} = process \"simulator\" {{ step {step} }}\n");
        for empty in self.messages.empty() {
            self.notes.say(Kind::Changed, format!("message `{empty}`: the file does not say what it holds"));
        }
        let messages = self.messages.write();
        if !messages.is_empty() {
            let _ = writeln!(text, "{messages}");
        }
        let (longest, widest) = topics
            .iter()
            .fold((0, 0), |(name, path), (topic, at, _)| (name.max(topic.len()), path.max(at.chars().count() + 2)));
        for (topic, path, ty) in topics {
            let path = quoted(path);
            let _ = writeln!(text, "  topic {topic:longest$} = {path:widest$} : {}", self.messages.words(ty));
        }
        let mut first = true;
        for node in &self.original.system.nodes {
            let list = |word: &str, references: &[Reference]| -> Option<String> {
                let mut names: Vec<&str> = Vec::new();
                for (name, _) in references.iter().filter_map(|&reference| self.topic(reference)) {
                    if !names.contains(&name.as_str()) {
                        names.push(name);
                    }
                }
                (!names.is_empty()).then(|| format!("{word} {}", names.join(", ")))
            };
            let clauses: Vec<String> =
                list("publishes", &node.publishes).into_iter().chain(list("subscribes", &node.subscribes)).collect();
            if clauses.is_empty() {
                continue;
            }
            let name = self.name("node", &node.name);
            let blank = if std::mem::take(&mut first) { "\n" } else { "" };
            let _ = writeln!(text, "{blank}  node {name} {{ {} }}", clauses.join("   "));
        }
        text.push('}');
        text
    }

    fn metrics(&mut self, monitors: &mut String) -> String {
        let mut text = String::new();
        let mut warnings = Vec::new();
        let published: Vec<Reference> =
            self.original.system.nodes.iter().flat_map(|node| node.publishes.iter().copied()).collect();
        for (at, metric) in self.original.metrics.iter().enumerate() {
            let shown = printable(&metric.name);
            if metric.source == MetricSource::Timing {
                self.notes.say(Kind::LeftOut, format!("metric `{shown}`: it is not a number, it only kept time"));
                self.mapped.metrics.push(None);
                continue;
            }
            if let Some(warned) = self.warned(at, monitors) {
                self.mapped.metrics.push(Some(warned.name.clone()));
                warnings.push(warned);
                continue;
            }
            let name = self.name("metric", &metric.name);
            let direction = if metric.highest { "maximise" } else { "minimise" };
            text.push('\n');
            if name != metric.name {
                text.push_str(&doc_comment(&called_before(&metric.name)));
            }
            if metric.source == MetricSource::FuzzingTime {
                let _ = writeln!(text, "metric {name} {direction} = fuzzing_time()");
                self.notes.say(Kind::Mapped, format!("metric `{shown}` is `fuzzing_time()`, which is always known"));
            } else {
                let mut topics: Vec<&str> = Vec::new();
                let heard = if metric.related.is_empty() { &published } else { &metric.related };
                for (topic, _) in heard.iter().filter_map(|&reference| self.topic(reference)) {
                    if !topics.contains(&topic.as_str()) {
                        topics.push(topic);
                    }
                }
                if topics.is_empty() {
                    topics = self.topics.iter().flatten().map(|(topic, _)| topic.as_str()).collect();
                    topics.sort_unstable();
                    topics.dedup();
                }
                if metric.related.is_empty() {
                    let _ = writeln!(text, "// It heard everything: keep the topics that it needs.");
                }
                let default =
                    metric.default.map_or(String::new(), |default| format!(" default {}", Unit::None.number(default)));
                let initial =
                    metric.initial.map_or(String::new(), |initial| format!(" initial {}", Unit::None.number(initial)));
                let _ =
                    writeln!(text, "metric {name} {direction}{default}{initial} {{ hook on {} }}", topics.join(", "));
                self.notes
                    .say(Kind::Mapped, format!("metric `{shown}` is a hook: its Java code is to be written in Rust"));
            }
            self.mapped.metrics.push(Some(name));
        }
        text.push_str(&self.lead_times(&warnings));
        text
    }

    fn operations(&mut self) -> String {
        let mut text = String::new();
        let holders = self.mapped.holders.operations.clone();
        for (at, operation) in holders.iter().enumerate() {
            let parts = self.operation(at, operation, &mut text);
            self.mapped.parts.push(parts);
        }
        text
    }

    fn operation(&mut self, at: usize, operation: &Operation, text: &mut String) -> Vec<Part> {
        let called = called(operation);
        let others = std::mem::take(self.notes);
        let clauses = self.clauses(at, operation, &called);
        let of_clauses = std::mem::replace(self.notes, others);
        let parts = self.parts(operation, &called, &clauses, text);
        // Lines about clauses are true only where the clauses are written.
        let has_none = |part: &Part| matches!(part.effect, Effect::Custom { offline: true, .. });
        if !parts.iter().all(has_none) {
            self.notes.take_in(of_clauses);
        }
        parts
    }

    /// The operations that one of the original becomes, with these clauses.
    fn parts(&mut self, operation: &Operation, called: &str, clauses: &str, text: &mut String) -> Vec<Part> {
        let topic = operation.variable.and_then(|reference| self.topic(reference)).cloned();
        let wanted = if operation.name.is_empty() {
            let topic = topic.as_ref().map_or("", |(name, _)| name);
            format!("{}_{topic}", kind_word(&operation.kind))
        } else {
            operation.name.to_string()
        };
        if let OperationKind::Custom { parameters } = &operation.kind {
            return self.custom(operation, parameters, topic, &wanted, clauses, text);
        }
        let Some((topic, ty)) = topic else {
            self.notes.say(Kind::LeftOut, format!("{called}: it names no variable"));
            return Vec::new();
        };
        self.note_unpublished(operation, called, &topic);
        let mut parts = Vec::new();
        match &operation.kind {
            OperationKind::RandomValue { relative, values } => {
                if values.is_empty() {
                    self.notes.say(Kind::LeftOut, format!("{called}: it has no values to draw from"));
                }
                let mode = if *relative { "offset" } else { "absolute" };
                for (set, value) in values.iter().enumerate() {
                    let (low, high) = match value.domain {
                        Domain::Reals(low, high) => ordered(low, high, called, self.notes),
                        Domain::Integers(low, high) => {
                            let (low, high) = ordered(low, high, called, self.notes);
                            (low as f64, high as f64)
                        }
                        _ => {
                            let text = format!("{called}: the original drew numbers only, and not what it has");
                            self.notes.say(Kind::LeftOut, text);
                            continue;
                        }
                    };
                    // By convention the first step of a path is the message, and the last is in small letters.
                    let mut path: Vec<String> = value.name.split('.').skip(1).map(str::to_owned).collect();
                    if let Some(last) = path.last_mut() {
                        *last = last.to_ascii_lowercase();
                    }
                    if !matches!(ty, Type::Message(_)) {
                        path.clear();
                    }
                    if let Err(why) = self.messages.reach(&ty, &path, &mut self.names) {
                        let path = printable(&value.name);
                        self.notes.say(Kind::LeftOut, format!("{called}, its value `{path}`: {why}"));
                        continue;
                    }
                    let wanted = match path.last() {
                        Some(last) if values.len() > 1 => format!("{wanted}_{last}"),
                        _ => wanted.clone(),
                    };
                    let name = self.declared_name(&wanted, operation, text);
                    let place = std::iter::once(&topic).chain(&path).map(String::as_str).collect::<Vec<_>>().join(".");
                    let range = Unit::None.range(low, high);
                    let _ = writeln!(text, "operation {name} on {place} = random {mode} {range}{clauses}");
                    parts.push(Part { name, effect: Effect::Value { set, relative: *relative } });
                }
                if parts.len() > 1 {
                    let names: Vec<&str> = parts.iter().map(|part| part.name.as_str()).collect();
                    self.notes
                        .say(Kind::Mapped, format!("{called} draws several values: it is {} now", names.join(", ")));
                }
            }
            OperationKind::PacketLoss { keep } => {
                let (low, high) = ordered(keep.0, keep.1, called, self.notes);
                if low < 0.0 || high > 1.0 {
                    let text = format!("{called}: its probability [{low}, {high}] is cut to what lies between 0 and 1");
                    self.notes.say(Kind::Changed, text);
                }
                let (low, high) = (low.clamp(0.0, 1.0), high.clamp(0.0, 1.0));
                let loss = Unit::Share.range(meant(1.0 - high), meant(1.0 - low));
                self.notes.say(
                    Kind::Flipped,
                    format!("{called}: it kept messages with [{low}, {high}], which is `packet loss {loss}`"),
                );
                let name = self.declared_name(&wanted, operation, text);
                let _ = writeln!(text, "operation {name} on {topic} = packet loss {loss}{clauses}");
                parts.push(Part { name, effect: Effect::Loss });
            }
            OperationKind::Latency { delay, randomised } => {
                if *delay == (0.0, 0.0) {
                    let text = format!("{called}: the file gives no range of delays, so it delays by 0s");
                    self.notes.say(Kind::Noted, text);
                }
                if delay.0.min(delay.1) < 0.0 {
                    let text = format!("{called}: {}, so its range begins at 0s", NO_NEGATIVE_DELAY.says);
                    self.notes.say(Kind::Changed, text);
                }
                let (low, high) = ordered(delay.0.max(0.0), delay.1.max(0.0), called, self.notes);
                let uniform = if *randomised { " uniform" } else { "" };
                let name = self.declared_name(&wanted, operation, text);
                let range = Unit::SECONDS.range(low, high);
                let _ = writeln!(text, "operation {name} on {topic} = latency {range}{uniform}{clauses}");
                parts.push(Part { name, effect: Effect::Delay { randomised: *randomised } });
            }
            OperationKind::Blackhole => {
                let name = self.declared_name(&wanted, operation, text);
                let _ = writeln!(text, "operation {name} on {topic} = blackhole{clauses}");
                parts.push(Part { name, effect: Effect::Blackhole });
            }
            OperationKind::Other(kind) => {
                let kind = printable(kind);
                self.notes.say(
                    Kind::LeftOut,
                    format!("{called}: `{kind}` was declared in the original and never did anything"),
                );
            }
            OperationKind::Custom { .. } => unreachable!("custom operations were written above"),
        }
        parts
    }

    fn custom(
        &mut self,
        operation: &Operation,
        sets: &[crate::original::ValueSet],
        topic: Option<(String, Type)>,
        wanted: &str,
        clauses: &str,
        text: &mut String,
    ) -> Vec<Part> {
        let called = called(operation);
        let mut inner = Names::default();
        let mut parameters = Vec::new();
        let mut lines = String::new();
        for (at, set) in sets.iter().enumerate() {
            let of = format!("{called}, `{}`", printable(&set.name));
            let domain = match &set.domain {
                Domain::Reals(low, high) => {
                    let (low, high) = ordered(*low, *high, &of, self.notes);
                    plan::Domain::Number { low, high, shape: ChoiceKind::Value, integer: false }
                }
                Domain::Integers(low, high) => {
                    let (low, high) = ordered(*low, *high, &of, self.notes);
                    plan::Domain::Number { low: low as f64, high: high as f64, shape: ChoiceKind::Value, integer: true }
                }
                Domain::Points(one, other) => {
                    let axis = |axis: usize, notes: &mut Notes| ordered(one[axis], other[axis], &of, notes);
                    let axes = [axis(0, self.notes), axis(1, self.notes), axis(2, self.notes)];
                    plan::Domain::Point { low: axes.map(|(low, _)| low), high: axes.map(|(_, high)| high) }
                }
                Domain::Texts(texts) => {
                    let mut offered: Vec<String> = Vec::new();
                    for text in texts.iter().map(|text| cleaned(text)) {
                        if !text.is_empty() && !offered.contains(&text) {
                            offered.push(text);
                        }
                    }
                    if offered.is_empty() {
                        self.notes.say(Kind::LeftOut, format!("{of}: there is nothing to choose from"));
                        continue;
                    }
                    plan::Domain::Texts { texts: offered }
                }
                Domain::Other(kind) => {
                    self.notes.say(Kind::LeftOut, format!("{of}: the original never read a `{}`", printable(kind)));
                    continue;
                }
            };
            let name = inner.take(&set.name, "parameter");
            let _ = writeln!(lines, "  {name}: {}", notation::custom_domain(&domain, Unit::None));
            parameters.push((name, at));
        }
        let name = self.declared_name(wanted, operation, text);
        let block = if lines.is_empty() { "{ }".to_owned() } else { format!("{{\n{lines}}}") };
        self.notes.say(Kind::Mapped, format!("{called} is custom: its Java code is to be written in Rust"));
        let offline = topic.is_none();
        if let Some((topic, _)) = topic {
            self.note_unpublished(operation, &called, &topic);
            let _ = writeln!(text, "operation {name} on {topic} = custom {block}{clauses}");
        } else {
            self.notes.say(Kind::Changed, format!("{called} names no variable: it is called before the start"));
            let _ = writeln!(text, "operation {name} = custom before start {block}");
        }
        vec![Part { name, effect: Effect::Custom { parameters, offline } }]
    }

    /// Notes that no node of the file publishes what an operation disturbs.
    fn note_unpublished(&mut self, operation: &Operation, called: &str, topic: &str) {
        let original = self.original;
        let disturbed = operation.variable.and_then(|variable| original.variable(variable));
        let published = original.system.nodes.iter().flat_map(|node| &node.publishes);
        if !published.into_iter().any(|&variable| original.variable(variable) == disturbed) {
            self.notes
                .say(Kind::Noted, format!("{called}: no node of the file publishes `{topic}`, which it disturbs"));
        }
    }

    /// The name of an operation, and above its line what it was called.
    fn declared_name(&mut self, wanted: &str, operation: &Operation, text: &mut String) -> String {
        let name = self.name("operation", wanted);
        if !operation.name.is_empty() && name != *operation.name {
            text.push_str(&doc_comment(&called_before(&operation.name)));
        }
        name
    }

    fn clauses(&mut self, at: usize, operation: &Operation, called: &str) -> String {
        let mut clauses = Clauses::default();
        if let Activation::Time(start, end) = operation.activation {
            let (start, end) = ordered(start, end, &format!("the window of {called}"), self.notes);
            if start < 0.0 && end > 0.0 {
                let start = Unit::SECONDS.number(start);
                self.notes.say(Kind::Changed, format!("{called}: its window begins at {start}: at 0s now"));
            }
            clauses.within = self.permitted(at);
            if clauses.within.is_none() {
                let why = if start.max(0.0) < end { "begins when tests are over" } else { "is empty" };
                self.notes.say(Kind::Changed, format!("{called}: its window {why}, so it may be active at any time"));
            }
        }
        if operation.priority != 0 {
            clauses.priority = Some(operation.priority);
        }
        clauses.untimed = !operation.timed;
        if (0.0..1.0).contains(&operation.inclusion) {
            clauses.inclusion = Some(meant(operation.inclusion));
        }
        let mut left_out = 0;
        for constraint in &operation.constraints {
            match self.constraint(at, constraint) {
                Some(text) if clauses.start_contains.contains(&text) => {}
                Some(text) => clauses.start_contains.push(text),
                None => left_out += 1,
            }
        }
        if left_out > 0 {
            self.notes.say(
                Kind::LeftOut,
                format!(
                    "{called}, what its start conditions contain: the campaigns that use it grow no such conditions"
                ),
            );
        }
        clauses.write()
    }

    /// A constraint that every campaign by condition with this operation can meet.
    fn constraint(&self, at: usize, constraint: &Constraint) -> Option<String> {
        let mut using = self.original.campaigns.iter().filter(|campaign| {
            matches!(campaign.activation, Some(ActivationMode::Condition { .. }))
                && !matches!(campaign.approach, Approach::Repeat { .. })
                && campaign.included.iter().any(|&reference| self.original.operation(reference) == Some(at))
        });
        match *constraint {
            Constraint::Metric(metric) => {
                let name = self.metric(metric)?;
                let offers = |campaign: &crate::original::Campaign| {
                    campaign.condition_metrics.iter().any(|&reference| self.metric(reference) == Some(name))
                };
                using.all(offers).then(|| name.to_owned())
            }
            Constraint::Integer(low, high) => {
                // Conditions compare with whole numbers from 1 to 20.
                let bounds = Integers { lowest: low.min(high).max(1), highest: high.max(low).min(20) };
                (bounds.lowest <= bounds.highest).then(|| notation::integer_constraint(bounds))
            }
        }
    }
}

fn kind_word(kind: &OperationKind) -> &'static str {
    match kind {
        OperationKind::RandomValue { .. } => "value",
        OperationKind::PacketLoss { .. } => "packet_loss",
        OperationKind::Latency { .. } => "latency",
        OperationKind::Blackhole => "blackhole",
        OperationKind::Custom { .. } => "custom",
        OperationKind::Other(_) => "other",
    }
}
