//! Message types, topics, nodes, the simulator.

use std::collections::{BTreeMap, HashSet};
use std::hash::Hash;

use super::{Kind, Resolver};
use crate::diagnostic::{Code, Diagnostic};
use crate::model::{self, Id as _, MessageId, Simulator, TopicId, Transport, Type};
use crate::similar::most_similar;
use crate::span::Span;
use crate::syntax::ast::{self, Name, TypeKind};
use crate::units::{Dimension, Unit, dimension};

/// How a simulator's program moves on in time.
enum Pace {
    /// When it is told to, by this much.
    LockStepped { step_ns: u64 },
    /// By its own clock.
    FreeRunning,
}

impl<'a> Resolver<'a> {
    pub(super) fn ast_messages(&self) -> impl Iterator<Item = &'a ast::Message> + use<'a> {
        self.file.systems.iter().flat_map(|system| &system.messages)
    }

    pub(super) fn ast_topics(&self) -> impl Iterator<Item = &'a ast::Topic> + use<'a> {
        self.file.systems.iter().flat_map(|system| &system.topics)
    }

    pub(super) fn ast_nodes(&self) -> impl Iterator<Item = &'a ast::Node> + use<'a> {
        self.file.systems.iter().flat_map(|system| &system.nodes)
    }

    pub(super) fn system(&mut self) -> Option<Simulator> {
        let simulator = self.simulators().next().and_then(|simulator| self.simulator(simulator));
        self.messages();
        self.topics();
        self.nodes();
        simulator
    }

    // ----- the simulator

    fn simulator(&mut self, simulator: &'a ast::Simulator) -> Option<Simulator> {
        let name = &simulator.head.name;
        let transport = match simulator.transport.as_ref()? {
            ast::Transport::InProcess(in_process) => {
                let path = self.rust_path(&in_process.path);
                let folder = self.single(&in_process.crates, "crate");
                let step_ns = self.step_of(name, &in_process.steps, in_process.has_errors);
                let crate_folder = folder.map(|folder| folder.text.clone());
                Transport::InProcess { path: path?, crate_folder, step_ns: step_ns? }
            }
            ast::Transport::Process(process) => {
                let program = self.program(&process.program);
                let pace = self.pace_of(name, process);
                // Empty texts were reported where they were read.
                let arguments = process.arguments.iter().map(|argument| argument.text.clone()).collect();
                let step_ns = match pace? {
                    Pace::LockStepped { step_ns } => Some(step_ns),
                    Pace::FreeRunning => None,
                };
                Transport::Process { program: program?, arguments, step_ns }
            }
        };
        Some(Simulator { declaration: self.declaration(&simulator.head), transport })
    }

    /// How a program moves on in time; nothing if that is not clear.
    fn pace_of(&mut self, name: &Name, process: &'a ast::Process) -> Option<Pace> {
        let Some((free, ())) = process.free_running.first() else {
            let step_ns = self.step_of(name, &process.steps, process.has_errors)?;
            return Some(Pace::LockStepped { step_ns });
        };
        self.single(&process.free_running, "free running");
        if let Some((step, _)) = process.steps.first() {
            let title = "a simulator that runs freely has no step".to_owned();
            let diagnostic = Diagnostic::new(Code::CLAUSE_TWICE, *step, title)
                .label("remove `step`, or `free running`")
                .secondary(*free, "it runs freely");
            self.report(diagnostic);
            return None;
        }
        Some(Pace::FreeRunning)
    }

    fn step_of(&mut self, name: &Name, steps: &'a [(Span, ast::Quantity)], has_errors: bool) -> Option<u64> {
        let step = self.single(steps, "step");
        if step.is_none() && !has_errors {
            self.missing(name, "its step size", "step 20ms");
        }
        self.step(step?)
    }

    /// The program and each argument are texts of their own. A path with spaces must begin like `./my robots/`, so that
    /// a whole command line in one text is recognised.
    pub(super) fn program(&mut self, program: &ast::Text) -> Option<String> {
        if program.text.trim().is_empty() {
            return None;
        }
        let first = program.text.split_whitespace().next().unwrap_or_default();
        if !program.text.contains(char::is_whitespace) || first.contains('/') {
            return Some(program.text.clone());
        }
        let parts: Vec<String> = program.text.split_whitespace().map(|part| format!("\"{part}\"")).collect();
        let title = format!("`{}` is not a program", program.text);
        let diagnostic = Diagnostic::new(Code::BAD_PATH, program.span, title)
            .label("write the program and each argument as a text of its own; no shell splits them")
            .suggest("split the command into a program and its arguments", program.span, parts.join(" "));
        self.report(diagnostic);
        None
    }

    fn rust_path(&mut self, path: &ast::Text) -> Option<String> {
        if path.text.trim().is_empty() {
            return None;
        }
        let identifier = |part: &str| {
            part.starts_with(|first: char| first.is_ascii_alphabetic() || first == '_')
                && part.bytes().all(|byte| byte.is_ascii_alphanumeric() || byte == b'_')
                && !matches!(part, "self" | "Self" | "super" | "crate" | "_")
        };
        let parts: Vec<&str> = path.text.split("::").collect();
        if parts.len() >= 2 && parts.iter().all(|part| identifier(part)) {
            return Some(path.text.clone());
        }
        let title = format!("`{}` is not the path of a Rust type", path.text);
        let diagnostic = Diagnostic::new(Code::BAD_PATH, path.span, title)
            .label("expected a crate and a type, for example `kuka_cell_sim::Cell`");
        self.report(diagnostic);
        None
    }

    fn step(&mut self, step: &ast::Quantity) -> Option<u64> {
        let nanoseconds = Unit::parse("ns").expect("`ns` is in the table");
        let seconds = Unit::seconds();
        self.value(step, Some(&seconds), "a step size")?;
        let unit = step.unit.as_ref().and_then(|unit| Unit::parse(&unit.text).ok())?;
        let value = unit.convert(step.value, &nanoseconds);
        // A whole number of nanoseconds in decimals may differ from it by a rounding error.
        let rounded = value.round();
        if (1.0..=3.6e12).contains(&rounded) && (value - rounded).abs() <= rounded * 1e-12 {
            #[expect(
                clippy::cast_possible_truncation,
                clippy::cast_sign_loss,
                reason = "it is whole and in 1..=3.6e12"
            )]
            return Some(rounded as u64);
        }
        let title = format!("`{}` is not a valid step size", self.text(step.span));
        let label = "expected a whole number of nanoseconds from 1ns to 1h";
        self.report(Diagnostic::new(Code::OUT_OF_RANGE, step.span, title).label(label));
        None
    }

    // ----- messages

    fn messages(&mut self) {
        let messages: Vec<&'a ast::Message> = self.ast_messages().collect();
        let (order, cyclic) = self.topological_order(&messages);
        self.system.message_ids = vec![MessageId::from_index(0); messages.len()];
        for (id, &index) in order.iter().enumerate() {
            self.system.message_ids[index] = MessageId::from_index(id);
        }
        // The number of values of each message, by its id.
        let mut values: Vec<u64> = Vec::new();
        for &index in &order {
            let message = self.message(messages[index]).filter(|_| !cyclic[index]);
            let held = message.iter().flat_map(|message| &message.fields);
            let count = held.map(|field| values_in(&field.ty, &values)).fold(0, u64::saturating_add);
            values.push(count);
            if count > MAX_VALUES {
                self.too_many_values(messages[index], message.as_ref(), count, &values);
            }
            self.system.messages.push(message.filter(|_| count <= MAX_VALUES));
        }
    }

    /// Reports a message that is too large, unless a message in it is too large and was reported.
    fn too_many_values(
        &mut self,
        message: &ast::Message,
        resolved: Option<&model::Message>,
        count: u64,
        values: &[u64],
    ) {
        let fields = resolved.map_or(&[][..], |message| &message.fields);
        if fields.iter().any(|field| values_in(&field.ty, values) > MAX_VALUES) {
            return;
        }
        let name = &message.head.name;
        let title = format!("message `{}` has {count} values, but the limit is {MAX_VALUES}", name.text);
        let mut diagnostic = Diagnostic::new(Code::LARGE_MESSAGE, name.span, title)
            .label("including the values of the messages in it")
            .note("a list counts as one of its elements");
        let largest = fields.iter().max_by_key(|field| values_in(&field.ty, values));
        if let Some(field) = largest
            && values_in(&field.ty, values) > 1
        {
            let of = values_in(&field.ty, values);
            diagnostic = diagnostic.secondary(field.declaration.span, format!("this field alone has {of} values"));
        }
        self.report(diagnostic);
    }

    /// Positions of messages such that each comes after those it contains, and which of them contain themselves.
    fn topological_order(&mut self, messages: &[&'a ast::Message]) -> (Vec<usize>, Vec<bool>) {
        #[derive(Clone, Copy, PartialEq)]
        enum Mark {
            New,
            Open,
            Done,
        }
        // Contained messages by position, with the place of the mention. Unknown names are reported where types are.
        let contained: Vec<Vec<(usize, Span)>> = messages
            .iter()
            .map(|message| {
                let names = message.fields.iter().filter_map(|field| message_name(&field.ty));
                names
                    .filter_map(|name| {
                        let definition = self.names.get(name.text.as_str())?;
                        (definition.kind == Kind::Message).then_some((definition.index, name.span))
                    })
                    .collect()
            })
            .collect();
        let mut marks = vec![Mark::New; messages.len()];
        let mut cyclic = vec![false; messages.len()];
        let mut order = Vec::new();
        for root in 0..messages.len() {
            if marks[root] != Mark::New {
                continue;
            }
            // An explicit stack: a chain of messages may be as long as the file.
            marks[root] = Mark::Open;
            let mut stack = vec![(root, 0)];
            while let Some((message, next)) = stack.pop() {
                let Some(&(inner, mention)) = contained[message].get(next) else {
                    marks[message] = Mark::Done;
                    order.push(message);
                    continue;
                };
                stack.push((message, next + 1));
                match marks[inner] {
                    Mark::Done => {}
                    Mark::New => {
                        marks[inner] = Mark::Open;
                        stack.push((inner, 0));
                    }
                    Mark::Open => {
                        let start = stack.iter().position(|&(open, _)| open == inner).unwrap_or(0);
                        let cycle: Vec<usize> = stack[start..].iter().map(|&(open, _)| open).collect();
                        for &member in &cycle {
                            cyclic[member] = true;
                        }
                        self.recursive(messages, &cycle, mention);
                    }
                }
            }
        }
        (order, cyclic)
    }

    fn recursive(&mut self, messages: &[&'a ast::Message], cycle: &[usize], mention: Span) {
        let name = |index: usize| &messages[index].head.name;
        let first = name(cycle[0]);
        let title = if cycle.len() == 1 {
            format!("message `{}` contains itself", first.text)
        } else {
            let through: Vec<&str> = cycle.iter().skip(1).map(|&index| name(index).text.as_str()).collect();
            format!("message `{}` contains itself through {}", first.text, super::list(&through))
        };
        let diagnostic = Diagnostic::new(Code::RECURSIVE_MESSAGE, mention, title)
            .label("a value of this type would be infinite")
            .secondary(first.span, "declared here");
        self.report(diagnostic);
    }

    fn message(&mut self, message: &'a ast::Message) -> Option<model::Message> {
        let mut first: BTreeMap<&str, Span> = BTreeMap::new();
        let mut fields = Vec::new();
        let mut complete = !message.has_errors;
        for field in &message.fields {
            let name = &field.head.name;
            if let Some(&before) = first.get(name.text.as_str()) {
                let title = format!("field `{}` of `{}` is defined twice", name.text, message.head.name.text);
                self.defined_twice(title, name.span, before);
                complete = false;
            }
            first.entry(&name.text).or_insert(name.span);
            match self.type_of(&field.ty) {
                Some(ty) => fields.push(model::Field { declaration: self.declaration(&field.head), ty }),
                None => complete = false,
            }
        }
        if message.fields.is_empty() && !message.has_errors {
            self.missing(&message.head.name, "a field", "level: real[mm]");
            complete = false;
        }
        complete.then(|| model::Message { declaration: self.declaration(&message.head), fields })
    }

    pub(super) fn type_of(&mut self, ty: &'a ast::Type) -> Option<Type> {
        let unit = match &ty.unit {
            Some(name) => Some(self.unit(name)?),
            None => None,
        };
        let without_unit = |resolver: &mut Self, found: Type| match &ty.unit {
            None => Some(found),
            Some(unit) => {
                let title = format!("`{}` cannot have a unit", resolver.text(ty.span));
                let brackets = Span { lo: unit.span.lo - 1, hi: unit.span.hi + 1, ..unit.span };
                let diagnostic = Diagnostic::new(Code::WRONG_TYPE, unit.span, title)
                    .label("only `int`, `real` and `point` can have a unit")
                    .suggest("remove the unit", brackets, "");
                resolver.report(diagnostic);
                None
            }
        };
        match &ty.kind {
            TypeKind::Bool => without_unit(self, Type::Bool),
            TypeKind::Text => without_unit(self, Type::Text),
            TypeKind::Int => Some(Type::Int(unit)),
            TypeKind::Real => Some(Type::Real(unit)),
            TypeKind::Point => Some(Type::Point(unit)),
            TypeKind::List(of) => Some(Type::List(Box::new(self.type_of(of)?))),
            TypeKind::Message(name) => {
                let index = self.find_type(name)?;
                without_unit(self, Type::Message(self.system.message_ids[index]))
            }
        }
    }

    fn find_type(&mut self, name: &'a Name) -> Option<usize> {
        const SCALARS: [&str; 5] = ["bool", "int", "real", "text", "point"];
        const ELSEWHERE: [(&str, &str); 9] = [
            ("float", "real"),
            ("double", "real"),
            ("number", "real"),
            ("f64", "real"),
            ("integer", "int"),
            ("i64", "int"),
            ("string", "text"),
            ("String", "text"),
            ("boolean", "bool"),
        ];
        if self.names.contains_key(name.text.as_str()) || self.silent.contains(name.text.as_str()) {
            return self.find(name, Kind::Message);
        }
        self.silent.insert(&name.text);
        if self.file.incomplete {
            return None;
        }
        let comparable = self.compared.more(self.names.len());
        let messages = if comparable { self.names_of(Kind::Message) } else { Vec::new() };
        let similar = ELSEWHERE
            .iter()
            .find(|(word, _)| *word == name.text)
            .map(|(_, meant)| *meant)
            .or_else(|| most_similar(&name.text, messages.iter().copied().chain(SCALARS)));
        let mut diagnostic = Diagnostic::new(Code::UNKNOWN_NAME, name.span, format!("no type named `{}`", name.text))
            .label("not a built-in type and not a message of this space");
        diagnostic = match similar {
            Some(similar) => diagnostic.did_you_mean(name.span, similar),
            None => diagnostic.note(
                "the types are `bool`, `int`, `real`, `text`, `point`, `list of …` and the messages of this space",
            ),
        };
        self.report(diagnostic);
        None
    }

    // ----- topics and nodes

    fn topics(&mut self) {
        let mut paths: BTreeMap<String, Span> = BTreeMap::new();
        for topic in self.ast_topics() {
            let ty = self.type_of(&topic.ty);
            let members = self.topic_paths(&topic.path);
            for member in members.iter().flatten() {
                if let Some(&first) = paths.get(member) {
                    let diagnostic = Diagnostic::new(
                        Code::SAME_PATH,
                        topic.path.span,
                        format!("two topics have the path `{member}`"),
                    )
                    .label("used again here")
                    .secondary(first, "first used here");
                    self.report(diagnostic);
                } else {
                    paths.insert(member.clone(), topic.path.span);
                }
            }
            let resolved = ty.zip(members).map(|(ty, paths)| model::Topic {
                declaration: self.declaration(&topic.head),
                written: topic.path.text.clone(),
                paths,
                ty,
            });
            self.system.topics.push(resolved);
        }
    }

    /// The paths of a topic: one, or the members of its group.
    fn topic_paths(&mut self, path: &ast::Text) -> Option<Vec<String>> {
        if path.text.trim().is_empty() {
            return None;
        }
        match expand_group(&path.text) {
            Ok(paths) => Some(paths),
            Err(why) => {
                let title = format!("`{}` is not the path of a topic", path.text);
                self.report(Diagnostic::new(Code::BAD_PATH, path.span, title).label(why));
                None
            }
        }
    }

    fn nodes(&mut self) {
        for node in self.ast_nodes() {
            let mut topics = |clauses: &'a [(Span, Vec<Name>)], word: &str| -> Option<Vec<TopicId>> {
                let Some(names) = self.single(clauses, word) else { return Some(vec![]) };
                let found = self.find_all(names, Kind::Topic)?;
                Some(found.into_iter().map(TopicId::from_index).collect())
            };
            let publishes = topics(&node.publishes, "publishes");
            let subscribes = topics(&node.subscribes, "subscribes");
            let resolved = publishes.zip(subscribes).map(|(publishes, subscribes)| model::Node {
                declaration: self.declaration(&node.head),
                publishes,
                subscribes,
            });
            self.system.nodes.push(resolved);
        }
    }

    // ----- fields

    /// What a path refers to: its topic, and the type at its end. `None` was reported, here or before.
    pub(super) fn field(&mut self, path: &'a ast::Path) -> Option<(model::FieldPath, Type)> {
        let index = self.find(&path.topic, Kind::Topic)?;
        let topic = self.system.topics[index].as_ref()?;
        let mut ty = topic.ty.clone();
        let mut holder = format!("topic `{}`", path.topic.text);
        for name in &path.fields {
            ty = self.field_in(&ty, &holder, name)?;
            holder = format!("field `{}`", name.text);
        }
        let fields = path.fields.iter().map(|name| name.text.clone()).collect();
        Some((model::FieldPath { topic: TopicId::from_index(index), fields }, ty))
    }

    /// The type of a field of a value of this type; `holder` is that value in words.
    pub(super) fn field_in(&mut self, ty: &Type, holder: &str, name: &'a Name) -> Option<Type> {
        let Type::Message(id) = ty else {
            let title = format!("{holder} has no fields");
            let label = format!("it is {}", type_in_words(ty));
            self.report(Diagnostic::new(Code::WRONG_TYPE, name.span, title).label(label));
            return None;
        };
        let message = self.system.messages[id.index()].as_ref()?;
        let Some(field) = message.fields.iter().find(|field| field.declaration.name == name.text) else {
            let known: Vec<&str> = message.fields.iter().map(|field| field.declaration.name.as_str()).collect();
            let mut diagnostic = Diagnostic::new(
                Code::UNKNOWN_NAME,
                name.span,
                format!("message `{}` has no field named `{}`", message.declaration.name, name.text),
            )
            .label("unknown field")
            .secondary(message.declaration.span, "the message is declared here");
            if self.compared.more(known.len()) {
                diagnostic = match most_similar(&name.text, known.iter().copied()) {
                    Some(similar) => diagnostic.did_you_mean(name.span, similar),
                    None => diagnostic.note(format!("its fields are {}", super::list(&known))),
                };
            }
            self.report(diagnostic);
            return None;
        };
        Some(field.ty.clone())
    }

    /// A path to a single number: with its unit, and whether it is whole.
    pub(super) fn number_field(
        &mut self,
        path: &'a ast::Path,
        user: &str,
    ) -> Option<(model::FieldPath, Option<Unit>, bool)> {
        let (found, ty) = self.field(path)?;
        match ty {
            Type::Int(unit) => Some((found, unit, true)),
            Type::Real(unit) => Some((found, unit, false)),
            other => {
                let is = type_in_words(&other);
                let title = format!("{user} needs a number, but `{}` is {is}", self.text(path.span));
                let mut diagnostic = Diagnostic::new(Code::WRONG_TYPE, path.span, title).label("expected a number");
                if let Type::Message(id) = other
                    && let Some(message) = self.system.messages[id.index()].as_ref()
                {
                    let numbers = message.fields.iter().filter(|it| matches!(it.ty, Type::Int(_) | Type::Real(_)));
                    for field in numbers.take(3) {
                        let name = &field.declaration.name;
                        diagnostic =
                            diagnostic.suggest(format!("use its field `{name}`"), path.span.end(), format!(".{name}"));
                    }
                }
                self.report(diagnostic);
                None
            }
        }
    }
}

/// The most values that a message may have: a runner represents each message as one Rust value.
const MAX_VALUES: u64 = 10_000;

/// The number of values of a type, given those of messages by their ids.
fn values_in(ty: &Type, messages: &[u64]) -> u64 {
    match ty {
        Type::Bool | Type::Int(_) | Type::Real(_) | Type::Text => 1,
        Type::Point(_) => 3,
        Type::List(of) => values_in(of, messages),
        // Messages that contain themselves have no order, and were reported.
        Type::Message(id) => messages.get(id.index()).copied().unwrap_or(0),
    }
}

/// The message a type mentions, inside of lists too.
fn message_name(ty: &ast::Type) -> Option<&Name> {
    match &ty.kind {
        TypeKind::Message(name) => Some(name),
        TypeKind::List(of) => message_name(of),
        _ => None,
    }
}

pub(super) fn type_in_words(ty: &Type) -> String {
    let unit = |unit: &Option<Unit>| match unit {
        Some(it) if dimension(Some(it)) != Dimension::NONE => format!(" in `{}`", it.text()),
        _ => String::new(),
    };
    match ty {
        Type::Bool => "a `bool`".to_owned(),
        Type::Int(it) => format!("an integer{}", unit(it)),
        Type::Real(it) => format!("a number{}", unit(it)),
        Type::Text => "a `text`".to_owned(),
        Type::Point(it) => format!("a point{}", unit(it)),
        Type::List(_) => "a list".to_owned(),
        Type::Message(_) => "a message".to_owned(),
    }
}

/// Expands a path with at most one group, `zones/{A,B}/level`.
fn expand_group(path: &str) -> Result<Vec<String>, String> {
    if let Some(c) = path.chars().find(|c| c.is_whitespace() || c.is_control()) {
        return Err(format!("a path cannot contain {}", if c == ' ' { "spaces".to_owned() } else { format!("{c:?}") }));
    }
    let Some((before, rest)) = path.split_once('{') else {
        return if path.contains('}') {
            Err("`}` without a matching `{`".to_owned())
        } else {
            Ok(vec![path.to_owned()])
        };
    };
    if before.contains('}') {
        return Err("`}` without a matching `{`".to_owned());
    }
    let Some((group, after)) = rest.split_once('}') else { return Err("the group is not closed".to_owned()) };
    if group.contains('{') || after.contains(['{', '}']) {
        return Err("a path can have at most one group, as in `zones/{Z1,Z2}`".to_owned());
    }
    let members: Vec<&str> = group.split(',').collect();
    if members.contains(&"") {
        return Err("the group has an empty member".to_owned());
    }
    if let Some(member) = first_twice(&members) {
        return Err(format!("the group lists `{member}` twice"));
    }
    Ok(members.into_iter().map(|member| format!("{before}{member}{after}")).collect())
}

/// The first member that occurs a second time.
fn first_twice<T: Hash + Eq>(members: &[T]) -> Option<&T> {
    let mut known = HashSet::with_capacity(members.len());
    members.iter().find(|&member| !known.insert(member))
}

#[cfg(test)]
mod tests {
    use std::cell::Cell;
    use std::hash::{Hash, Hasher};

    use super::{expand_group, first_twice};

    /// A member that counts how often it is compared.
    struct Counted<'a>(usize, &'a Cell<usize>);

    impl PartialEq for Counted<'_> {
        fn eq(&self, other: &Self) -> bool {
            self.1.set(self.1.get() + 1);
            self.0 == other.0
        }
    }

    impl Eq for Counted<'_> {}

    impl Hash for Counted<'_> {
        fn hash<H: Hasher>(&self, state: &mut H) {
            self.0.hash(state);
        }
    }

    #[test]
    fn work_on_a_group_grows_with_its_members_and_not_with_their_square() {
        let compared = Cell::new(0);
        let count = 100_000;
        let mut members: Vec<Counted<'_>> = (0..count).map(|n| Counted(n, &compared)).collect();
        assert!(first_twice(&members).is_none());
        members.push(Counted(7, &compared));
        assert_eq!(first_twice(&members).map(|member| member.0), Some(7));
        assert!(compared.get() < count, "{} comparisons", compared.get());
    }

    #[test]
    fn a_group_is_written_out_in_order() {
        assert_eq!(expand_group("a/{Z2,Z1}/x").unwrap(), ["a/Z2/x", "a/Z1/x"]);
        assert_eq!(expand_group("/plain").unwrap(), ["/plain"]);
        assert_eq!(expand_group("{one}").unwrap(), ["one"]);
    }

    #[test]
    fn malformed_groups_are_refused() {
        for path in ["a b", "a/{", "a/}", "}{", "{a,}", "{}", "{a,a}", "{a}{b}", "{a{b}}", "a\tb"] {
            assert!(expand_group(path).is_err(), "{path}");
        }
    }
}
