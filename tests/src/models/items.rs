//! The items of a space, each made so that it is valid with those before it.

use std::fmt::Write as _;

use super::draw::Draw;
use super::words::{Names, docs, file, own_names, path, quoted, text};

/// Units that are not time; the empty one is none.
const UNITS: &[&str] = &["", "mm", "m", "rad", "deg", "m/s", "%", "N", "Hz", "kg*m^2", "W/A/s", ""];

/// A type: as it is written, and what can be measured of it.
#[derive(Clone)]
enum Type {
    Int(&'static str),
    Real(&'static str),
    Point(&'static str),
    Bool,
    Text,
    List(Box<Type>),
    Message(usize),
}

struct MessageType {
    name: String,
    fields: Vec<(String, Type)>,
}

struct Topic {
    name: String,
    ty: Type,
    group: bool,
}

/// A path to one value, with its unit.
#[derive(Clone)]
pub(super) struct Field {
    pub(super) written: String,
    pub(super) unit: &'static str,
    pub(super) whole: bool,
}

struct Metric {
    name: String,
    unit: &'static str,
    /// It may stand in conditions: any number may pass it.
    boundless: bool,
    /// It has a direction, and a value in every test.
    objective: bool,
}

pub(super) enum Kind {
    /// The word before the range, the range, its unit, and whether numbers are whole.
    Range {
        word: &'static str,
        range: (f64, f64),
        unit: &'static str,
    },
    /// The same for each of several single values.
    Values(Vec<(&'static str, (f64, f64), String)>),
    Nothing,
    Custom {
        parameters: Vec<(String, String)>,
        moment: Option<&'static str>,
    },
}

struct Operation {
    name: String,
    kind: Kind,
    within: Option<(f64, f64)>,
    /// Its lengths are bounded, so a test says how long it is active.
    bounded: bool,
}

/// A space that grows.
pub(super) struct Space {
    pub(super) draw: Draw,
    pub(super) files: Vec<String>,
    names: Names,
    messages: Vec<MessageType>,
    topics: Vec<Topic>,
    metrics: Vec<Metric>,
    operations: Vec<Operation>,
    tests: Vec<String>,
}

fn bracketed(unit: &str) -> String {
    if unit.is_empty() { String::new() } else { format!("[{unit}]") }
}

/// A range in a unit.
pub(super) fn written((low, high): (f64, f64), unit: &str) -> String {
    format!("[{low}{unit}, {high}{unit}]")
}

impl Space {
    pub(super) fn new(draw: Draw) -> Self {
        Space {
            draw,
            files: Vec::new(),
            names: Names::default(),
            messages: Vec::new(),
            topics: Vec::new(),
            metrics: Vec::new(),
            operations: Vec::new(),
            tests: Vec::new(),
        }
    }

    fn name(&mut self, kind: &'static str) -> String {
        self.names.take(&mut self.draw, kind)
    }

    fn unit(&mut self) -> &'static str {
        UNITS[self.draw.below(UNITS.len() - 1)]
    }

    pub(super) fn head(&mut self) -> String {
        let name = self.name("space");
        format!("{}space {name}\n", docs(&mut self.draw))
    }

    // ----- the system

    fn ty(&mut self, messages: usize) -> Type {
        match self.draw.below(if messages > 0 { 10 } else { 8 }) {
            0 => Type::Bool,
            1 => Type::Text,
            2 => Type::Int(self.unit()),
            3..=5 => Type::Real(self.unit()),
            6 => Type::Point(self.unit()),
            7 => Type::List(Box::new(self.ty(messages))),
            _ => Type::Message(self.draw.below(messages)),
        }
    }

    fn written_type(&self, ty: &Type) -> String {
        match ty {
            Type::Bool => "bool".to_owned(),
            Type::Text => "text".to_owned(),
            Type::Int(unit) => format!("int{}", bracketed(unit)),
            Type::Real(unit) => format!("real{}", bracketed(unit)),
            Type::Point(unit) => format!("point{}", bracketed(unit)),
            Type::List(of) => format!("list of {}", self.written_type(of)),
            Type::Message(at) => self.messages[*at].name.clone(),
        }
    }

    pub(super) fn system(&mut self) -> String {
        let mut members = Vec::new();
        for at in 0..self.draw.between(0, 4) {
            let name = self.name("message");
            let n = self.draw.between(1, 5);
            let names = own_names(&mut self.draw, n);
            let fields: Vec<(String, Type)> = names.into_iter().map(|name| (name, self.ty(at))).collect();
            let lines: Vec<String> = fields
                .iter()
                .map(|(name, ty)| format!("{}    {name}: {}\n", docs(&mut self.draw), self.written_type(ty)))
                .collect();
            members.push(format!("{}  message {name} {{\n{}  }}\n", docs(&mut self.draw), lines.concat()));
            self.messages.push(MessageType { name, fields });
        }
        for at in 0..self.draw.between(1, 6) {
            let name = self.name("topic");
            // The first carries a number, so that there is always something to measure and to disturb.
            let ty = if at == 0 { Type::Real(self.unit()) } else { self.ty(self.messages.len()) };
            let path = quoted(&path(&mut self.draw, at));
            members.push(format!("{}  topic {name} = {path} : {}\n", docs(&mut self.draw), self.written_type(&ty)));
            self.topics.push(Topic { name, ty, group: path.contains('{') });
        }
        let simulator = self.name("simulator");
        let step = *self.draw.one(&["20ms", "0.1s", "50000us"]);
        let doc = docs(&mut self.draw);
        members.push(format!(
            "{doc}  simulator {simulator} = in_process \"anything_sim::Anything\" {{ crate \"simulator\"  step {step} }}\n"
        ));
        if self.draw.chance(0.4) {
            let name = self.name("node");
            let topics = self.topics.len();
            let (publishes, subscribes) = (self.draw.some(topics, 3), self.draw.some(topics, 3));
            let list = |of: &[usize]| of.iter().map(|&at| self.topics[at].name.as_str()).collect::<Vec<_>>().join(", ");
            let lists = format!("publishes {}  subscribes {}", list(&publishes), list(&subscribes));
            members.push(format!("{}  node {name} {{ {lists} }}\n", docs(&mut self.draw)));
        }
        if self.draw.chance(0.2) {
            // A simulator of this kind has nothing to launch.
            members.push(format!("  relay budget {{ latency 5ms }} // {}\n", quoted(&text(&mut self.draw))));
        }
        let order = self.draw.0.permutation(members.len());
        let members: String = order.into_iter().map(|at| members[at].as_str()).collect();
        format!("system {{\n{members}}}\n")
    }

    /// All single numbers below a type.
    fn numbers(&self, written: &str, ty: &Type, found: &mut Vec<Field>) {
        match ty {
            Type::Int(unit) => found.push(Field { written: written.to_owned(), unit, whole: true }),
            Type::Real(unit) => found.push(Field { written: written.to_owned(), unit, whole: false }),
            Type::Message(at) => {
                for (name, ty) in &self.messages[*at].fields {
                    self.numbers(&format!("{written}.{name}"), ty, found);
                }
            }
            _ => {}
        }
    }

    pub(super) fn field(&mut self) -> Field {
        let mut found = Vec::new();
        for topic in &self.topics {
            self.numbers(&topic.name, &topic.ty, &mut found);
        }
        self.draw.one(&found).clone()
    }

    pub(super) fn topic(&mut self) -> String {
        let topic = self.draw.below(self.topics.len());
        self.topics[topic].name.clone()
    }

    /// A range that suits a field: of whole numbers for one that has these.
    pub(super) fn range_of(&mut self, field: &Field) -> (f64, f64) {
        let (low, high) = self.draw.range();
        if field.whole { (low.round(), high.round()) } else { (low, high) }
    }

    /// A topic or a field of one that is a text, if there is any.
    pub(super) fn text_place(&mut self) -> Option<String> {
        let mut found = Vec::new();
        for topic in &self.topics {
            match &topic.ty {
                Type::Text => found.push(topic.name.clone()),
                Type::Message(at) => {
                    let texts = self.messages[*at].fields.iter().filter(|(_, ty)| matches!(ty, Type::Text));
                    found.extend(texts.map(|(name, _)| format!("{}.{name}", topic.name)));
                }
                _ => {}
            }
        }
        if found.is_empty() { None } else { Some(self.draw.one(&found).clone()) }
    }

    /// A topic or a field of one that is a point, with its unit, and whether its topic is a group.
    fn point_place(&mut self) -> Option<(String, &'static str, bool)> {
        let mut found = Vec::new();
        for topic in &self.topics {
            match &topic.ty {
                Type::Point(unit) => found.push((topic.name.clone(), *unit, topic.group)),
                Type::Message(at) => {
                    for (name, ty) in &self.messages[*at].fields {
                        if let Type::Point(unit) = ty {
                            found.push((format!("{}.{name}", topic.name), *unit, topic.group));
                        }
                    }
                }
                _ => {}
            }
        }
        if found.is_empty() { None } else { Some(self.draw.one(&found).clone()) }
    }

    /// A formula over points, texts and the time, with its unit; over a number where there is no other.
    fn geometry(&mut self) -> (String, &'static str) {
        let bound = self.draw.number();
        let corner = self.draw.number();
        if let Some((point, unit, group)) = self.point_place().filter(|_| self.draw.chance(0.8)) {
            let each = if group { "each of " } else { "" };
            let corners = format!("({corner}, {corner}, -1), ({}, {}, 20)", corner + 1.0, corner + 2.5);
            return match self.draw.below(if group { 5 } else { 4 }) {
                0 => (format!("= max({each}{point}.x)"), unit),
                1 => (format!("= min(distance({each}{point}, ({bound}, {corner}, 0){unit}))"), unit),
                2 => (format!("= max(signed_distance({each}{point}, box({corners}){unit}))"), unit),
                3 => (format!("= duration({each}{point}.z > {bound}{unit} and sqrt(4) > 1)"), "s"),
                _ => (format!("= min(distance(each pair of {point}))"), unit),
            };
        }
        if let Some(place) = self.text_place().filter(|_| self.draw.chance(0.5)) {
            let sign = *self.draw.one(&["==", "!="]);
            return (format!("= count({place} {sign} {})", quoted(&text(&mut self.draw))), "");
        }
        let Field { written, unit, .. } = self.field();
        (format!("= count(sin({corner}rad) < 0.5 or {written} > {bound}{unit})"), "")
    }

    // ----- metrics and requirements

    pub(super) fn metrics(&mut self) -> Vec<String> {
        let mut items = Vec::new();
        let time = self.name("hook");
        items.push(format!("{}metric {time} minimise = fuzzing_time()\n", docs(&mut self.draw)));
        self.metrics.push(Metric { name: time, unit: "s", boundless: false, objective: true });
        for _ in 0..self.draw.between(1, 6) {
            let name = self.name("hook");
            let field = self.field();
            let bound = format!("{}{}", self.draw.number(), field.unit);
            let (clause, source, unit, boundless) = match self.draw.below(12) {
                9.. => {
                    let (formula, unit) = self.geometry();
                    (String::new(), formula, unit, false)
                }
                0..=2 => {
                    let topics = self.draw.some(self.topics.len(), 3);
                    let unit = self.unit();
                    let topics: Vec<&str> = topics.iter().map(|&at| self.topics[at].name.as_str()).collect();
                    let ty = if unit.is_empty() { String::new() } else { format!(": real[{unit}]") };
                    (ty, format!("{{ hook on {} }}", topics.join(", ")), unit, true)
                }
                3 => (String::new(), format!("= last({})", field.written), field.unit, true),
                4 => (String::new(), format!("= mean({})", field.written), field.unit, true),
                5 => (String::new(), format!("= count({} > {bound})", field.written), "", false),
                6 => (String::new(), format!("= duration({} < {bound})", field.written), "s", false),
                7 => {
                    let formula = format!("= when {0} != {bound} then {0} * 2", field.written);
                    (String::new(), formula, field.unit, true)
                }
                _ => (String::new(), format!("= robustness(always {} < {bound})", field.written), field.unit, false),
            };
            let objective = self.draw.chance(0.6);
            let direction = if objective { *self.draw.one(&[" maximise", " minimise"]) } else { "" };
            let default = if objective { format!(" default {}{unit}", self.draw.number()) } else { String::new() };
            items.push(format!("{}metric {name}{clause}{direction}{default} {source}\n", docs(&mut self.draw)));
            self.metrics.push(Metric { name, unit, boundless, objective });
        }
        for _ in 0..self.draw.between(0, 3) {
            let name = self.name("requirement");
            let sentence = quoted(&text(&mut self.draw));
            let metric = self.draw.below(self.metrics.len());
            let bound = self.bound(metric);
            let metric = self.metrics[metric].name.clone();
            items.push(format!("{}requirement {name} {sentence} = {metric} {bound}\n", docs(&mut self.draw)));
        }
        items
    }

    fn bound(&mut self, metric: usize) -> String {
        let unit = self.metrics[metric].unit;
        let (low, high) = self.draw.range();
        match self.draw.below(3) {
            0 => format!("in {}", written((low, high), unit)),
            1 => format!("<= {high}{unit}"),
            _ => format!("> {low}{unit}"),
        }
    }

    // ----- operations

    pub(super) fn operations(&mut self) -> Vec<String> {
        let mut items = Vec::new();
        for at in 0..self.draw.between(1, 6) {
            let choice = if at == 0 { self.draw.below(5) } else { self.draw.below(14) };
            let name = self.name(if (6..9).contains(&choice) { "hook" } else { "operation" });
            let topic = self.topic();
            let time = *self.draw.one(&[(0.0, 100.0), (0.0, 0.0), (20.0, 500.0)]);
            let (target, source, kind) = match choice {
                0 | 1 => {
                    let field = self.field();
                    let range = self.range_of(&field);
                    let mode = if choice == 0 { "offset" } else { "absolute" };
                    let word = if choice == 0 { "offset" } else { "value" };
                    let source = format!("random {mode} {}", written(range, field.unit));
                    (field.written, source, Kind::Range { word, range, unit: field.unit })
                }
                2 => {
                    let range = (0.0, 100.0);
                    let source = format!("packet loss {}", written(range, "%"));
                    (topic, source, Kind::Values(vec![("loss", range, "%".to_owned())]))
                }
                3 => {
                    let drain = *self.draw.one(&["", " drain flush", " drain drop", " drain finish"]);
                    let source = format!("latency {}{drain}", written(time, "ms"));
                    (topic, source, Kind::Values(vec![("delay", time, "ms".to_owned())]))
                }
                4 => {
                    let source = format!("latency {} uniform", written(time, "ms"));
                    (topic, source, Kind::Range { word: "delay", range: time, unit: "ms" })
                }
                5 => (topic, "blackhole".to_owned(), Kind::Nothing),
                9.. => self.disturbance(),
                _ => {
                    let moment = *self.draw.one(&[None, None, Some("before start"), Some("after end")]);
                    let n = self.draw.below(5);
                    let names = own_names(&mut self.draw, n);
                    let parameters: Vec<(String, String, String)> =
                        names.into_iter().map(|name| self.parameter(name)).collect();
                    let declared: Vec<String> =
                        parameters.iter().map(|(name, domain, _)| format!("  {name}: {domain}\n")).collect();
                    let moment_word = moment.map_or(String::new(), |moment| format!("{moment} "));
                    let source = format!("custom {moment_word}{{\n{}}}", declared.concat());
                    let parameters = parameters.into_iter().map(|(name, _, choice)| (name, choice)).collect();
                    (topic, source, Kind::Custom { parameters, moment })
                }
            };
            let during = !matches!(kind, Kind::Custom { moment: Some(_), .. });
            let within =
                (during && self.draw.chance(0.5)).then(|| *self.draw.one(&[(0.0, 0.9), (0.2, 0.6), (0.0, 5.0)]));
            let mut clauses = within.map_or(String::new(), |within| format!(" within {}", written(within, "s")));
            if self.draw.chance(0.3) {
                let priority = self.draw.number().round();
                write!(clauses, " priority {priority}").expect("a string takes all text");
            }
            if self.draw.chance(0.3) {
                clauses += " inclusion 62.5%";
            }
            if during && self.draw.chance(0.2) {
                clauses += " untimed";
            }
            let bounded = during && self.draw.chance(0.3);
            if bounded {
                // Long enough for all windows of the tests.
                clauses += " for [0s, 5s]";
            }
            let on = if during { format!(" on {target}") } else { String::new() };
            items.push(format!("{}operation {name}{on} = {source}{clauses}\n", docs(&mut self.draw)));
            self.operations.push(Operation { name, kind, within, bounded });
        }
        items
    }

    /// A parameter of a custom operation: its name, what it permits, and a choice.
    fn parameter(&mut self, name: String) -> (String, String, String) {
        let unit = self.unit();
        let (low, high) = self.draw.range();
        let (domain, choice) = match self.draw.below(5) {
            0 => {
                let (low, high) = (low.round(), high.round());
                (format!("int{} {}", bracketed(unit), written((low, high), unit)), format!("{high}{unit}"))
            }
            1 => (format!("real {}", written((low, high), unit)), format!("{low}{unit}")),
            2 => {
                let corner = |at: f64| format!("({at}, {at}, {at}){unit}");
                (format!("point{} [{}, {}]", bracketed(unit), corner(low), corner(high)), corner(low))
            }
            3 => {
                let texts: Vec<String> =
                    (0..self.draw.between(1, 3)).map(|at| quoted(&format!("{}{at}", text(&mut self.draw)))).collect();
                (format!("one of {}", texts.join(", ")), self.draw.one(&texts).clone())
            }
            _ => {
                let path = file(&mut self.draw, self.files.len());
                let written = quoted(&path);
                self.files.push(path);
                (format!("file one of {written}"), written)
            }
        };
        (name, domain, choice)
    }

    // ----- known tests

    /// A comparison that no model decides, with a metric that any number may pass; `None` if there is none.
    fn comparison(&mut self) -> Option<String> {
        let variables: Vec<usize> = (0..self.metrics.len()).filter(|&at| self.metrics[at].boundless).collect();
        if variables.is_empty() {
            return None;
        }
        let variable = *self.draw.one(&variables);
        let sign = *self.draw.one(&["<", ">", "=="]);
        let Metric { name, unit, .. } = &self.metrics[variable];
        let number = format!("{}{unit}", self.draw.number());
        Some(if self.draw.chance(0.5) { format!("{name} {sign} {number}") } else { format!("{number} {sign} {name}") })
    }

    pub(super) fn tests(&mut self) -> Vec<String> {
        let mut items = Vec::new();
        for _ in 0..self.draw.between(0, 3) {
            let name = self.name("test");
            let mut lines = String::new();
            for at in self.draw.some(self.operations.len(), 3) {
                let Operation { name, kind, within, bounded } = &self.operations[at];
                let (name, within, bounded) = (name.clone(), *within, *bounded);
                let (choices, moment) = match kind {
                    Kind::Range { word, range, unit } => {
                        (format!("{word} {}", written(self.draw.part(*range), unit)), None)
                    }
                    Kind::Values(values) => {
                        let choices: Vec<String> = values
                            .iter()
                            .map(|(word, range, unit)| format!("{word} {}{unit}", self.draw.part(*range).0))
                            .collect();
                        (choices.join(" "), None)
                    }
                    Kind::Nothing => (String::new(), None),
                    Kind::Custom { parameters, moment } => {
                        let choices: Vec<String> =
                            parameters.iter().map(|(name, choice)| format!("{name} {choice}")).collect();
                        (choices.join(" "), *moment)
                    }
                };
                let (from, to) = within.unwrap_or((0.1, 0.8));
                let condition = if self.draw.chance(0.3) { self.comparison().zip(self.comparison()) } else { None };
                let activation = match (moment, condition) {
                    (Some(moment), _) => moment.to_owned(),
                    (None, Some((start, end))) if !bounded && self.draw.chance(0.5) => {
                        format!("when {start} until {end}")
                    }
                    (None, Some((one, _))) => format!("when {one} for 200ms at most 2 times"),
                    (None, None) => format!("from {from}s to {to}s"),
                };
                writeln!(lines, "  {name} {choices} {activation}").expect("a string takes all text");
                if self.draw.chance(0.3) {
                    lines.truncate(lines.trim_end().len());
                    let seed = self.draw.below(1000);
                    writeln!(lines, " seed {seed}").expect("a string takes all text");
                }
            }
            if self.draw.chance(0.5) {
                let metric = self.draw.below(self.metrics.len());
                let bound = self.bound(metric);
                writeln!(lines, "  expect {} {bound}", self.metrics[metric].name).expect("a string takes all text");
            }
            items.push(format!("{}test {name} {{\n{lines}}}\n", docs(&mut self.draw)));
            self.tests.push(name);
        }
        items
    }

    // ----- campaigns

    pub(super) fn campaigns(&mut self) -> (Vec<String>, Vec<String>) {
        let (mut names, mut items) = (Vec::new(), Vec::new());
        // The campaigns that search, for others to start from.
        let mut searches: Vec<String> = Vec::new();
        for _ in 0..self.draw.between(1, 3) {
            let name = self.name("campaign");
            if !searches.is_empty() && self.draw.chance(0.4) {
                let from = self.draw.one(&searches).clone();
                let metrics = self.draw.some(self.metrics.len(), 2);
                let member = match self.draw.below(3) {
                    0 => "search random { evaluations 2 }".to_owned(),
                    1 => "passive 2 times { seed 7 }".to_owned(),
                    _ => format!("observes {}", self.list_metrics(&metrics)),
                };
                items.push(format!("{}campaign {name} from {from} {{ {member} }}\n", docs(&mut self.draw)));
                names.push(name);
                continue;
            }
            let mut members = vec!["end after 1s".to_owned()];
            let repeated = self.draw.chance(0.25) && !self.tests.is_empty();
            if repeated {
                let test = self.draw.one(&self.tests).clone();
                members.push(format!("repeat {test} 2 times {{ seed {} }}", self.draw.0.bits()));
            } else {
                members.extend(self.search());
                searches.push(name.clone());
            }
            if self.draw.chance(0.3) {
                let metrics = self.draw.some(self.metrics.len(), 3);
                members.push(format!("observes {}", self.list_metrics(&metrics)));
            }
            if self.draw.chance(0.3) {
                members.push((*self.draw.one(&["record mcap all", "record mcap failing"])).to_owned());
            }
            let order = self.draw.0.permutation(members.len());
            let members: Vec<&str> = order.into_iter().map(|at| members[at].as_str()).collect();
            items.push(format!("{}campaign {name} {{\n  {}\n}}\n", docs(&mut self.draw), members.join("\n  ")));
            names.push(name);
        }
        (names, items)
    }

    // ----- monitors and labs

    pub(super) fn monitor(&mut self) -> Option<String> {
        let state = |topic: &Topic| !topic.group && matches!(topic.ty, Type::Bool | Type::Int("") | Type::Text);
        let topics: Vec<usize> = (0..self.topics.len()).filter(|&at| state(&self.topics[at])).collect();
        if topics.is_empty() || self.draw.chance(0.5) {
            return None;
        }
        let name = self.name("eddi");
        let topic = *self.draw.one(&topics);
        let (topic, truth) = (self.topics[topic].name.clone(), matches!(self.topics[topic].ty, Type::Bool));
        let names = own_names(&mut self.draw, 4);
        let Field { written, unit, .. } = self.field();
        let bound = self.draw.number();
        let [evidence, strong, weak, otherwise] = &names[..] else { unreachable!("there are four names") };
        let docs = docs(&mut self.draw);
        let watched = format!("  evidence {evidence} = {written} >= {bound}{unit} held 100ms  stale after 1s is false");
        // Which form it has follows from its names, so that spaces are those that they were with one form.
        Some(match evidence.len() % 4 {
            0 => format!(
                "{docs}eddi {name} external {{\n{watched} inbound\n  guarantee {strong} integrity 2 = \
                 2 of ({evidence}, {evidence}, {evidence})\n  otherwise {otherwise}\n}}\n"
            ),
            1 if truth => format!(
                "{docs}eddi {name} external on {topic} {{\n  guarantee {strong} integrity 2\n  otherwise {otherwise}\n}}\n"
            ),
            1 => format!(
                "{docs}eddi {name} external on {topic} {{\n  guarantee {weak} integrity 3\n  \
                 guarantee {strong} integrity 7\n  otherwise {otherwise}\n}}\n"
            ),
            _ => format!(
                "{docs}eddi {name} publishes {topic} {{\n{watched}\n  guarantee {strong} integrity 2 = {evidence}\n  \
                 guarantee {weak} integrity 1 = {evidence} or {evidence}\n  otherwise {otherwise}\n}}\n"
            ),
        })
    }

    pub(super) fn lab(&mut self) -> Option<String> {
        if self.draw.chance(0.7) {
            return None;
        }
        let name = self.name("physical");
        let names = own_names(&mut self.draw, 2);
        let metric = self.draw.below(self.metrics.len());
        let bound = self.bound(metric);
        let (metric, unit) = (self.metrics[metric].name.clone(), self.metrics[metric].unit);
        let order = match self.draw.below(3) {
            0 => "ascending".to_owned(),
            1 => "descending".to_owned(),
            _ => format!("closest to 2{unit}"),
        };
        // They must not contain control characters.
        let [pose, parameter] =
            [(); 2].map(|()| quoted(&format!("a{}", text(&mut self.draw).replace(char::is_control, ""))));
        Some(format!(
            "{}physical {name} {{\n  simulator {} = simlog \"http://lab:8089\" {{ step 20ms }}\n  repeats 3\n  \
             exclude when {metric} {bound}\n  rank by {metric} {order}\n  tolerance {metric} 2{unit}\n  \
             shape {} = sphere 300mm on pose {pose}\n  fit parameter {parameter} [0.5, 1.5]\n}}\n",
            docs(&mut self.draw),
            names[0],
            names[1]
        ))
    }

    fn list_metrics(&self, of: &[usize]) -> String {
        of.iter().map(|&at| self.metrics[at].name.as_str()).collect::<Vec<_>>().join(", ")
    }

    /// What a campaign that searches says.
    fn search(&mut self) -> Vec<String> {
        let possible: Vec<usize> = (0..self.metrics.len()).filter(|&at| self.metrics[at].objective).collect();
        let objectives: Vec<usize> = self.draw.some(possible.len(), 3).into_iter().map(|at| possible[at]).collect();
        let operations = self.draw.some(self.operations.len(), 4);
        let bounded = operations.iter().any(|&at| self.operations[at].bounded);
        let operations: Vec<&str> = operations.iter().map(|&at| self.operations[at].name.as_str()).collect();
        let operations = operations.join(", ");
        // There may be operations outside the run only, which a test holds once unless copies may overlap.
        let count = *self.draw.one(&[
            "1 per test each at most once",
            "1..3 per test",
            "2 per test may overlap",
            "3..4 per test may overlap",
        ]);
        let search = *self.draw.one(&[
            "search random { evaluations 1 }",
            "search nsga2 { population 2  evaluations 2  seed 18446744073709551615 }",
        ]);
        let mut members = vec![
            format!("objectives {}", self.list_metrics(&objectives)),
            format!("operations {operations} {count}"),
            search.to_owned(),
        ];
        let variables: Vec<usize> = (0..self.metrics.len()).filter(|&at| self.metrics[at].boundless).collect();
        if !variables.is_empty() && self.draw.chance(0.4) {
            let chosen: Vec<usize> = self.draw.some(variables.len(), 3).into_iter().map(|at| variables[at]).collect();
            let lengths: &[&str] = &[" for [10ms, 0.3s]", "", " { depth 3  integers [-5, 9] } at most 3 times"];
            let length = *self.draw.one(if bounded { &lengths[..1] } else { lengths });
            members.push(format!("activate by condition over {}{length}", self.list_metrics(&chosen)));
        } else if self.draw.chance(0.5) {
            members.push("activate by time".to_owned());
        }
        if self.draw.chance(0.3) {
            let coverage = self.draw.one(&[
                "coverage { T1 [0, 1] cells 6  T2 [0, 0.5] cells 6  P1 [0, 1] cells 3 }",
                "coverage { O0 [0.5, 4.5] cells 4  hits 2  stop at 12.5%  failsafe 4 }",
            ]);
            members.push((*coverage).to_owned());
        }
        members
    }
}
