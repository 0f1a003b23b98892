//! Services of ROS, each two topics, for its requests and its replies; and actions of ROS 2, each three services and
//! two topics ([`sesame_plan::action`]).

use std::collections::BTreeMap;
use std::ops::Range;

use sesame_plan::{Channel, SimulatorKind, action};

use super::{Kind, Resolver};
use crate::diagnostic::{Code, Diagnostic};
use crate::interfaces;
use crate::model::{self, Type};
use crate::span::Span;
use crate::syntax::ast::{self, Head};

/// What a path of a topic stands for, and the names of the members of its group.
type Paths = (Vec<String>, Vec<String>);

impl<'a> Resolver<'a> {
    pub(super) fn ast_services(&self) -> impl Iterator<Item = &'a ast::Service> + use<'a> {
        self.file.systems.iter().flat_map(|system| &system.services)
    }

    pub(super) fn ast_actions(&self) -> impl Iterator<Item = &'a ast::Action> + use<'a> {
        self.file.systems.iter().flat_map(|system| &system.actions)
    }

    /// The positions of the topics of a service or an action among all topics; `None` for what is neither.
    pub(super) fn topics_of(&self, kind: Kind, index: usize) -> Option<Range<usize>> {
        const OF_SERVICE: usize = 2;
        let (of, each) = match kind {
            Kind::Service => (0, OF_SERVICE),
            Kind::Action => (OF_SERVICE * self.ast_services().count(), action::PARTS.len()),
            _ => return None,
        };
        let first = self.ast_topics().count() + of + each * index;
        Some(first..first + each)
    }

    /// Adds the topics of all services to those that are there.
    pub(super) fn services(&mut self, taken: &mut TakenPaths) {
        for service in self.ast_services() {
            let paths = self.topic_paths(&service.path, "service");
            for path in paths.iter().flat_map(|(paths, _)| paths) {
                self.take_path(taken, Channel::Request, path, service.path.span);
            }
            let types = self.types_of_service(service);
            let directions = [(&service.request, Channel::Request), (&service.reply, Channel::Reply)];
            for (at, (head, channel)) in directions.into_iter().enumerate() {
                let ty = types.as_ref().map(|types| types[at].clone());
                self.add_part(head, &service.path.text, paths.clone(), ty, channel, None);
            }
        }
    }

    /// Adds the topics of all actions to those that are there.
    pub(super) fn actions(&mut self, taken: &mut TakenPaths) {
        for action in self.ast_actions() {
            let paths = self.topic_paths(&action.path, "action");
            let types = self.types_of_action(action);
            let mut free = true;
            for (at, (head, part)) in action.parts.iter().zip(&action::PARTS).enumerate() {
                let paths = paths.as_ref().map(|(paths, members)| {
                    (paths.iter().map(|path| part.path_of(path)).collect::<Vec<_>>(), members.clone())
                });
                // Both directions of a service have its path. If two actions are equal, one of their parts says so for
                // all.
                if free && part.channel != Channel::Reply {
                    for path in paths.iter().flat_map(|(paths, _)| paths) {
                        free &= self.take_path(taken, part.channel, path, action.path.span);
                    }
                }
                let ty = types.as_ref().map(|types| types[at].clone());
                let written = part.path_of(&action.path.text);
                self.add_part(head, &written, paths, ty, part.channel, Some(&action.head));
            }
        }
    }

    /// Adds a topic of a service, or of the action of this head.
    fn add_part(
        &mut self,
        head: &Head,
        written: &str,
        paths: Option<Paths>,
        ty: Option<Type>,
        channel: Channel,
        action: Option<&Head>,
    ) {
        let topic = paths.zip(ty).map(|((paths, members), ty)| model::Topic {
            declaration: self.declaration(head),
            written: written.to_owned(),
            paths,
            members,
            ty,
            channel,
            action: action.map(|head| head.name.text.clone()),
        });
        self.system.topics.push(topic);
    }

    /// Reports what a kind of simulator does not have.
    fn report_missing_in(&mut self, (kind, simulator): (&str, Span), what: &str, at: Span, label: &str) {
        let title = format!("simulator kind `{kind}` has no {what}");
        let diagnostic = Diagnostic::new(Code::NOT_ROS, at, title)
            .label(label)
            .secondary(simulator, "the simulator is declared here");
        self.report(diagnostic);
    }

    /// The messages of a service: its requests, then its replies.
    fn types_of_service(&mut self, service: &'a ast::Service) -> Option<Vec<Type>> {
        let name = self.ros_type(&service.ros_type, "srv");
        if let Some(other) = self.other_than_ros() {
            let label = "only a simulator of ROS has services; declare a topic instead";
            self.report_missing_in(other, "services", service.head.name.span, label);
            return None;
        }
        let (name, at) = (name?, service.ros_type.span);
        let remedy = "with one of the services that are always known: `std_srvs/srv/Empty`, `SetBool` and `Trigger`";
        let directions = ["Request", "Response"].map(|direction| format!("{name}_{direction}"));
        self.types_of_parts(&name, at, &directions, remedy)
    }

    /// The messages of an action, in the order of its parts.
    fn types_of_action(&mut self, written: &'a ast::Action) -> Option<Vec<Type>> {
        let name = self.ros_type(&written.ros_type, "action");
        if let Some(other) = self.without_actions() {
            let label = "only a simulator of kind `ros2` has actions";
            self.report_missing_in(other, "actions", written.head.name.span, label);
            return None;
        }
        let name = name?;
        let remedy = format!(
            "and declare what it consists of: messages with blocks, of the types `{name}_Goal`, `{name}_Result` and \
             `{name}_Feedback`"
        );
        let parts = action::PARTS.map(|part| part.interface_of(&name));
        self.types_of_parts(&name, written.ros_type.span, &parts, &remedy)
    }

    /// The kind of the simulator and where it is declared, if neither it nor some lab has actions.
    fn without_actions(&self) -> Option<(&'static str, Span)> {
        let labs = self.file.physicals.iter().flat_map(|lab| &lab.simulators);
        let mut labs = labs.filter_map(|(_, simulator)| simulator.transport.as_ref());
        let (kind, simulator) = self.kind()?;
        let has = kind == SimulatorKind::Ros2 || labs.any(|lab| lab.kind == SimulatorKind::Ros2);
        (!has).then_some((kind.properties().keyword, simulator))
    }

    /// The messages of these types, of which a service or an action of this type consists.
    fn types_of_parts(&mut self, name: &str, at: Span, parts: &[String], remedy: &str) -> Option<Vec<Type>> {
        let mut types = Vec::new();
        for part in parts {
            match self.message_of(part, at) {
                Ok(Some(ty)) => types.push(ty),
                Ok(None) => {
                    self.not_found(name, at, remedy);
                    return None;
                }
                Err(()) => return None,
            }
        }
        Some(types)
    }

    /// The message of an interface: the one that the space declares, else one like it; `None` if no folder has the
    /// interface. Mistakes are reported.
    fn message_of(&mut self, interface: &str, at: Span) -> Result<Option<Type>, ()> {
        if let Some(id) = self.declared_message(interface) {
            return Ok(Some(Type::Message(id)));
        }
        let found = match self.layout(interface, at)? {
            Some(found) => found,
            None => match self.layout_of_blocks(interface, at)? {
                Some(found) => found,
                None => return Ok(None),
            },
        };
        self.keep(&found);
        let last = found.last().expect("a layout that was found is the last");
        Ok(Some(Type::Message(self.implicit(last, &found, at))))
    }

    /// The layout of a message of an action, if the space declares the goal, result or feedback in it with a block.
    fn layout_of_blocks(&mut self, interface: &str, at: Span) -> Result<Option<Vec<sesame_plan::Interface>>, ()> {
        let messages = action::messages(interfaces::defined_in(interface));
        let Some(message) = messages.into_iter().find(|message| message.name == interface) else { return Ok(None) };
        let mut found = Vec::new();
        for field in &message.fields {
            let sesame_plan::WireType::Interface { name } = interfaces::innermost(&field.ty) else { continue };
            let kept = self.system.ros.interfaces.iter().find(|kept| kept.name == *name).cloned();
            match kept {
                Some(kept) => found.push(kept),
                None => match self.layout(name, at)? {
                    Some(layout) => found.extend(layout),
                    None => return Ok(None),
                },
            }
        }
        found.push(message);
        Ok(Some(found))
    }

    /// Notes the path of a topic or service. False, and reported, if it was taken before.
    pub(super) fn take_path(&mut self, taken: &mut TakenPaths, channel: Channel, path: &str, span: Span) -> bool {
        let (paths, what) = match channel {
            Channel::Topic => (&mut taken.topics, "topics"),
            Channel::Request | Channel::Reply => (&mut taken.services, "services"),
        };
        let Some(&first) = paths.get(path) else {
            paths.insert(path.to_owned(), span);
            return true;
        };
        self.same_path(what, path, span, first);
        false
    }
}

/// The paths of topics and of services, with the places that have them.
#[derive(Debug, Default)]
pub(super) struct TakenPaths {
    topics: BTreeMap<String, Span>,
    services: BTreeMap<String, Span>,
}
