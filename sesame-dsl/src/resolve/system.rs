//! Topics and nodes of the system, and the fields that paths into messages lead to.

use super::elements::Reading;
use super::services::TakenPaths;
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
        self.count_nodes();
        let simulator = self.simulators().next().and_then(|simulator| self.simulator(simulator));
        self.messages();
        let mut taken = TakenPaths::default();
        self.topics(&mut taken);
        self.defined_messages();
        self.services(&mut taken);
        self.actions(&mut taken);
        self.nodes();
        simulator
    }

    fn topics(&mut self, taken: &mut TakenPaths) {
        for topic in self.ast_topics() {
            let ty = self.type_of(&topic.ty);
            let ty = ty.filter(|ty| self.has_a_layout(topic, ty));
            let members = self.topic_paths(&topic.path, "topic");
            for member in members.iter().flat_map(|(paths, _)| paths) {
                self.take_path(taken, Channel::Topic, member, topic.path.span);
            }
            let resolved = ty.zip(members).map(|(ty, (paths, members))| model::Topic {
                declaration: self.declaration(&topic.head),
                written: topic.path.text.clone(),
                paths,
                members,
                ty,
                channel: Channel::Topic,
                action: None,
            });
            self.system.topics.push(resolved);
        }
    }

    pub(super) fn same_path(&mut self, what: &str, path: &str, again: Span, first: Span) {
        // Services and actions are looked at after topics, wherever they stand.
        let swapped = again.file == first.file && again < first;
        let (again, first) = if swapped { (first, again) } else { (again, first) };
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

    /// The paths of a topic, service or action: one, or those of the members of its group, with their names. In ROS the
    /// paths are absolute.
    pub(super) fn topic_paths(&mut self, path: &ast::Text, what: &str) -> Option<(Vec<String>, Vec<String>)> {
        if path.text.trim().is_empty() {
            return None;
        }
        let members = self.expanded(path, what)?;
        let is_group = members.len() > 1;
        let (mut paths, names): (Vec<String>, Vec<String>) =
            members.into_iter().map(|member| (member.path, member.name)).unzip();
        if self.is_of_ros() {
            let absolute = paths.iter().map(|name| self.absolute(name, path.span, what));
            paths = absolute.collect::<Option<_>>()?;
        }
        Some((paths, if is_group { names } else { Vec::new() }))
    }

    /// The path of a topic as it is written.
    pub(super) fn path_of_topic(&self, topic: TopicId) -> Option<&'a ast::Text> {
        let paths = self.ast_topics().map(|topic| &topic.path);
        let of_services = self.ast_services().flat_map(|service| [&service.path, &service.path]);
        let of_actions = self.ast_actions().flat_map(|action| action.parts.iter().map(|_| &action.path));
        paths.chain(of_services).chain(of_actions).nth(topic.index())
    }

    /// What a path refers to: its topic, and the type at its end. `None` was reported, here or before.
    pub(super) fn field(&mut self, path: &'a ast::Path) -> Option<(model::FieldPath, Type)> {
        let index = self.find(&path.topic, Kind::Topic)?;
        if let Some(member) = &path.member {
            let title = format!("`{}` is one member of a group, which cannot be used here", self.text(path.span));
            let label = "expected the topic without a member";
            self.report(Diagnostic::new(Code::UNPAIRED, member.span, title).label(label));
            return None;
        }
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
            let named = topic.paths.iter().position(|path| path == member).and_then(|at| topic.members.get(at));
            let named = named.map(|named| sesame_plan::with_member(group, named));
            last.notes.extend(named.map(|named| format!("`{named}` is this one alone")));
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
