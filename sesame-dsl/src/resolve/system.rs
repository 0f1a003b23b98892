//! Topics and nodes of the system, and the fields that paths into messages lead to.

use std::collections::{BTreeMap, HashSet};
use std::hash::Hash;

use super::elements::Reading;
use super::words::type_in_words;
use super::{Kind, Resolver};
use crate::diagnostic::{Code, Diagnostic};
use crate::model::{self, Channel, Id as _, Simulator, TopicId, Type};
use crate::similar::most_similar;
use crate::span::Span;
use crate::syntax::ast::{self, Name};
use crate::units::Unit;

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
        self.defined_messages();
        self.services();
        self.nodes();
        simulator
    }

    fn topics(&mut self) {
        let mut paths: BTreeMap<String, Span> = BTreeMap::new();
        for topic in self.ast_topics() {
            let ty = self.type_of(&topic.ty);
            let ty = ty.filter(|ty| self.has_a_layout(topic, ty));
            let members = self.topic_paths(&topic.path, "topic");
            for member in members.iter().flatten() {
                if let Some(&first) = paths.get(member) {
                    self.same_path("topics", member, topic.path.span, first);
                } else {
                    paths.insert(member.clone(), topic.path.span);
                }
            }
            let resolved = ty.zip(members).map(|(ty, paths)| model::Topic {
                declaration: self.declaration(&topic.head),
                written: topic.path.text.clone(),
                paths,
                ty,
                channel: Channel::Topic,
            });
            self.system.topics.push(resolved);
        }
    }

    pub(super) fn same_path(&mut self, what: &str, path: &str, again: Span, first: Span) {
        let diagnostic = Diagnostic::new(Code::SAME_PATH, again, format!("two {what} have the path `{path}`"))
            .label("used again here")
            .secondary(first, "first used here");
        let of_a_group = [again, first].iter().any(|path| self.text(*path).contains('{'));
        self.report(if of_a_group {
            diagnostic.note("each path belongs to one topic: remove it from the group, or use the group instead")
        } else {
            diagnostic
        });
    }

    /// Whether a topic carries what its simulator can: in ROS a message with a ROS type.
    fn has_a_layout(&mut self, topic: &ast::Topic, ty: &Type) -> bool {
        if !self.is_of_ros() {
            return true;
        }
        let diagnostic = Diagnostic::new(
            Code::NOT_ROS,
            topic.ty.span,
            format!("topic `{}` does not carry a message of ROS", topic.head.name.text),
        );
        let diagnostic = match ty {
            Type::Message(id) => {
                let Some(message) = self.system.messages[id.index()].as_ref() else { return true };
                if message.interface.is_some() {
                    return true;
                }
                let name = &message.declaration.name;
                diagnostic
                    .label(format!("message `{name}` has no ROS type"))
                    .secondary(message.declaration.span, "the message is declared here")
                    .note(format!(
                        "write its type after its name, for example `message {name} = \"cell_msgs/msg/{name}\"`"
                    ))
            }
            other => {
                let example = match other {
                    Type::Bool => "std_msgs/msg/Bool",
                    Type::Int(_) => "std_msgs/msg/Int32",
                    Type::Text => "std_msgs/msg/String",
                    Type::Point(_) => "geometry_msgs/msg/Point",
                    _ => "std_msgs/msg/Float64",
                };
                let name = example.rsplit('/').next().unwrap_or_default();
                diagnostic.label("in ROS a topic carries messages").note(format!(
                    "declare the message, for example `message {name} = \"{example}\"`, and write `{name}` here"
                ))
            }
        };
        self.report(diagnostic);
        false
    }

    /// The paths of a topic or service: one, or the members of its group. In ROS they are absolute.
    pub(super) fn topic_paths(&mut self, path: &ast::Text, what: &str) -> Option<Vec<String>> {
        if path.text.trim().is_empty() {
            return None;
        }
        match expand_group(&path.text) {
            Ok(paths) if self.is_of_ros() => paths.iter().map(|name| self.absolute(name, path.span, what)).collect(),
            Ok(paths) => Some(paths),
            Err(why) => {
                let title = format!("`{}` is not the path of a {what}", path.text);
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
            let rest = self.rest_of_node(node, publishes.as_deref(), subscribes.as_deref());
            let lists = publishes.zip(subscribes).zip(rest);
            let resolved = lists.map(|((publishes, subscribes), rest)| model::Node {
                declaration: self.declaration(&node.head),
                publishes,
                subscribes,
                named: rest.named,
                launch: rest.launch,
                answers: rest.answers,
                every_step: rest.every_step,
                broker: rest.broker,
            });
            self.system.nodes.push(resolved);
        }
    }

    /// The path of a topic as it is written.
    pub(super) fn path_of_topic(&self, topic: TopicId) -> Option<&'a ast::Text> {
        let paths = self.ast_topics().map(|topic| &topic.path);
        let of_services = self.ast_services().flat_map(|service| [&service.path, &service.path]);
        paths.chain(of_services).nth(topic.index())
    }

    /// What a path refers to: its topic, and the type at its end. `None` was reported, here or before.
    pub(super) fn field(&mut self, path: &'a ast::Path) -> Option<(model::FieldPath, Type)> {
        let index = self.find(&path.topic, Kind::Topic)?;
        if let Some(step) = path.elements.first() {
            let title = format!("`{}` is in a list, but a field is needed", self.text(path.span));
            let label = "elements of a list cannot be used here";
            self.report(Diagnostic::new(Code::WRONG_TYPE, step.span(), title).label(label));
            return None;
        }
        let topic = self.system.topics[index].as_ref()?;
        let mut ty = topic.ty.clone();
        let mut holder = format!("topic `{}`", path.topic.text);
        for name in &path.fields {
            let Some(found) = self.field_in(&ty, &holder, name) else {
                self.note_on_members(index, name);
                return None;
            };
            ty = found;
            holder = format!("field `{}`", name.text);
        }
        let fields = path.fields.iter().map(|name| name.text.clone()).collect();
        Some((model::FieldPath { topic: TopicId::from_index(index), fields }, ty))
    }

    /// Adds to the last report, of a field that does not exist, what to write if the member of a group was meant.
    pub(super) fn note_on_members(&mut self, topic: usize, name: &Name) {
        let Some(topic) = self.system.topics[topic].as_ref() else { return };
        let is_member = |path: &String| path.split('/').any(|part| part == name.text);
        let (Some(last), Some(member)) = (self.diagnostics.last_mut(), topic.paths.iter().find(|path| is_member(path)))
        else {
            return;
        };
        if topic.paths.len() > 1 && last.span == name.span {
            let group = &topic.declaration.name;
            last.notes.push(format!(
                "`{group}` is a group of {} topics: `each of {group}` stands for each of them, `max of {group}` for \
                 the greatest value, and `{group}` alone for the least",
                topic.paths.len()
            ));
            last.notes.push(format!(
                "to name one of them, declare `{member}` as a topic of its own, instead of a member of the group"
            ));
        }
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
                    None => diagnostic.note(format!("its fields are {}", super::words::list(&known))),
                };
            }
            self.report(diagnostic);
            return None;
        };
        Some(field.ty.clone())
    }

    /// What a formula reads at a path that leads to a single number, with its unit.
    pub(super) fn number_read(
        &mut self,
        path: &'a ast::Path,
        word: Option<(ast::Members, Span)>,
    ) -> Option<(Reading, Option<Unit>)> {
        let read = self.reading(path, word)?;
        let other = match &read.ty {
            Type::Int(unit) | Type::Real(unit) => {
                let unit = unit.clone();
                return Some((read, unit));
            }
            other => other.clone(),
        };
        let written = self.text(path.span);
        let title = format!("a formula needs a number, but `{written}` is {}", type_in_words(&other));
        let mut diagnostic = Diagnostic::new(Code::WRONG_TYPE, path.span, title).label("expected a number");
        let parts: Vec<String> = match other {
            Type::Message(id) => {
                let fields = self.system.messages[id.index()].iter().flat_map(|message| &message.fields);
                let numbers = fields.filter(|field| matches!(field.ty, Type::Int(_) | Type::Real(_)));
                numbers.take(3).map(|field| field.declaration.name.clone()).collect()
            }
            Type::Point(ref unit) => {
                let unit = unit.as_ref().map_or("", Unit::text);
                diagnostic = diagnostic
                    .note("`distance(p, q)` is the distance of two points")
                    .note(format!("`distance({written}, (0, 0, 0){unit})` is its length"));
                ["x", "y", "z"].map(str::to_owned).into()
            }
            Type::Text => {
                diagnostic = diagnostic.note(format!("a text can be compared, for example `{written} == \"ready\"`"));
                Vec::new()
            }
            Type::List(_) => {
                diagnostic = diagnostic.note(format!("`{written}[0]` is its first element")).note(
                    "`min of`, `max of`, `mean of`, `sum of`, `count of` and `length of` make one value of a list",
                );
                Vec::new()
            }
            _ => Vec::new(),
        };
        let what = if matches!(other, Type::Point(_)) { "coordinate" } else { "field" };
        for name in parts {
            diagnostic = diagnostic.suggest(format!("use its {what} `{name}`"), path.span.end(), format!(".{name}"));
        }
        self.report(diagnostic);
        None
    }
}

/// The members of the group in a path without mistakes; none if there is no group.
pub(super) fn members_of_path(path: &str) -> Vec<&str> {
    let group = path.split_once('{').and_then(|(_, rest)| rest.split_once('}'));
    group.map_or(Vec::new(), |(members, _)| members.split(',').collect())
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
