//! Services and actions that nodes serve and call: their topics, as if a node listed each.

use std::ops::Range;

use super::nodes::{Listed, Said};
use super::{Kind, Resolver, list};
use crate::diagnostic::{Code, Diagnostic};
use crate::model::{Channel, Id as _, TopicId};
use crate::similar::most_similar;
use crate::span::Span;
use crate::syntax::ast::{self, WithMember};

impl<'a> Resolver<'a> {
    /// Adds the topics of services and actions to what a node publishes and subscribes to: a server publishes all but
    /// requests, a client requests only. A list becomes `None` if there is a mistake.
    pub(super) fn parts_listed(
        &mut self,
        clauses: &'a [(Span, Vec<WithMember>)],
        serves: bool,
        mut lists: [&mut Option<Vec<Listed>>; 2],
    ) {
        for listed in self.single(clauses, if serves { "serves" } else { "calls" }).into_iter().flatten() {
            if self.parts_of_one(listed, serves, &mut lists).is_none() {
                for list in &mut lists {
                    **list = None;
                }
            }
        }
    }

    /// Adds the topics of one service or action. `None` was reported.
    fn parts_of_one(
        &mut self,
        listed: &'a WithMember,
        serves: bool,
        lists: &mut [&mut Option<Vec<Listed>>; 2],
    ) -> Option<()> {
        for topic in self.parts_named(&listed.name)?.map(TopicId::from_index) {
            let declared = self.system.topics.get(topic.index())?.as_ref()?;
            let is_request = declared.channel == Channel::Request;
            let said = self.said(topic, listed)?;
            let Some(list) = lists[usize::from(is_request == serves)].as_mut() else { continue };
            let Some(known) = list.iter_mut().find(|known| known.topic == topic) else {
                let members = self.members_of_topic(topic);
                list.push(Listed { topic, said, members, span: listed.span });
                continue;
            };
            if !known.takes(&said) {
                let before = known.span;
                self.listed_twice(listed.span, before);
                return None;
            }
        }
        Some(())
    }

    /// The topics of the service or action of this name. `None` was reported.
    fn parts_named(&mut self, name: &'a ast::Name) -> Option<Range<usize>> {
        let known = self.names.get(name.text.as_str()).copied();
        if let Some(parts) = known.and_then(|known| self.topics_of(known.kind, known.index)) {
            return Some(parts);
        }
        if self.silent.contains(name.text.as_str()) {
            return None;
        }
        if let Some(known) = known {
            let is = known.kind.with_article();
            let title = format!("`{}` is {is}, not a service or an action", name.text);
            let mut diagnostic = Diagnostic::new(Code::OTHER_KIND, name.span, title)
                .label("expected a service or an action")
                .secondary(known.span, format!("declared as {is} here"));
            if known.kind == Kind::Topic {
                diagnostic = diagnostic.note("topics stand after `publishes` and `subscribes`");
            }
            self.report(diagnostic);
            return None;
        }
        self.silent.insert(&name.text);
        // An import that failed may have declared it.
        if self.file.incomplete {
            return None;
        }
        let title = format!("no service or action named `{}`", name.text);
        let mut diagnostic = Diagnostic::new(Code::UNKNOWN_NAME, name.span, title).label("not found in this space");
        let declared: Vec<&str> =
            [Kind::Service, Kind::Action].into_iter().flat_map(|kind| self.names_of(kind)).collect();
        if self.compared.more(declared.len()) {
            diagnostic = match most_similar(&name.text, declared.iter().copied()) {
                Some(similar) => diagnostic.did_you_mean(name.span, similar),
                None if declared.is_empty() => diagnostic.note("this space declares no services and no actions"),
                None if declared.len() <= 8 => diagnostic.note(format!("there are {}", list(&declared))),
                None => diagnostic,
            };
        }
        self.report(diagnostic);
        None
    }
}

impl Listed {
    /// Adds further members, if both name some and none twice.
    fn takes(&mut self, said: &Said) -> bool {
        let (Said::These(known), Said::These(more)) = (&mut self.said, said) else { return false };
        if known.iter().any(|member| more.contains(member)) {
            return false;
        }
        known.extend(more);
        known.sort_unstable();
        true
    }
}
