//! Services of ROS: each is two topics, for its requests and its replies.

use sesame_plan::{Channel, Interface};

use super::Resolver;
use crate::diagnostic::{Code, Diagnostic};
use crate::model::{self, Type};
use crate::span::Span;
use crate::syntax::ast;

impl<'a> Resolver<'a> {
    pub(super) fn ast_services(&self) -> impl Iterator<Item = &'a ast::Service> + use<'a> {
        self.file.systems.iter().flat_map(|system| &system.services)
    }

    /// Adds the topics of all services to those that are there.
    pub(super) fn services(&mut self) {
        let mut paths: std::collections::BTreeMap<String, Span> = std::collections::BTreeMap::new();
        for service in self.ast_services() {
            let members = self.topic_paths(&service.path, "service");
            for member in members.iter().flat_map(|(paths, _)| paths) {
                match paths.get(member) {
                    Some(&first) => self.same_path("services", member, service.path.span, first),
                    None => _ = paths.insert(member.clone(), service.path.span),
                }
            }
            let directions = self.directions(service);
            let topics = members.zip(directions);
            for (at, channel) in [Channel::Request, Channel::Reply].into_iter().enumerate() {
                let head = if at == 0 { &service.request } else { &service.reply };
                let topic = topics.as_ref().map(|((paths, members), types)| model::Topic {
                    declaration: self.declaration(head),
                    written: service.path.text.clone(),
                    paths: paths.clone(),
                    members: members.clone(),
                    ty: types[at].clone(),
                    channel,
                });
                self.system.topics.push(topic);
            }
        }
    }

    /// The messages of a service: its requests, then its replies.
    fn directions(&mut self, service: &'a ast::Service) -> Option<[Type; 2]> {
        let name = self.ros_type(&service.ros_type, "srv");
        if let Some((kind, simulator)) = self.other_than_ros() {
            let title = format!("simulator kind `{kind}` has no services");
            let diagnostic = Diagnostic::new(Code::NOT_ROS, service.head.name.span, title)
                .label("only a simulator of ROS has services; declare a topic instead")
                .secondary(simulator, "the simulator is declared here");
            self.report(diagnostic);
            return None;
        }
        let (name, at) = (name?, service.ros_type.span);
        let mut found: Vec<Vec<Interface>> = Vec::new();
        for direction in ["Request", "Response"] {
            match self.layout(&format!("{name}_{direction}"), at) {
                Ok(Some(layout)) => found.push(layout),
                Ok(None) => {
                    self.not_found(
                        &name,
                        at,
                        "with one of the services that are always known: `std_srvs/srv/Empty`, `SetBool` and `Trigger`",
                    );
                    return None;
                }
                Err(()) => return None,
            }
        }
        let mut types = found.iter().map(|layout| {
            self.keep(layout);
            let last = layout.last().expect("a layout that was found is the last");
            Type::Message(self.implicit(last, layout, at))
        });
        let mut next = || types.next().expect("there are two directions");
        Some([next(), next()])
    }
}
