//! Members of groups by their names: `odom[r1]`.

use super::words::{article, list};
use super::{Kind, Resolver};
use crate::diagnostic::{Code, Diagnostic};
use crate::groups::{Expanded, expand};
use crate::model::{Id as _, TopicId};
use crate::similar::most_similar;
use crate::span::Span;
use crate::syntax::ast::{self, Text};

impl Resolver<'_> {
    /// What a path stands for; reports one with a mistake.
    pub(super) fn expanded(&mut self, path: &Text, what: &str) -> Option<Vec<Expanded>> {
        match expand(&path.text) {
            Ok(members) => Some(members),
            Err(why) => {
                let title = format!("`{}` is not the path of {}", path.text, article(what));
                self.report(Diagnostic::new(Code::BAD_PATH, path.span, title).label(why));
                None
            }
        }
    }

    /// The members of a topic; a single one without a name if it is not a group.
    pub(super) fn members_of_topic(&self, topic: TopicId) -> Vec<Expanded> {
        self.path_of_topic(topic).and_then(|path| expand(&path.text).ok()).unwrap_or_default()
    }

    /// The position of a member by its name, of the group that is declared as `name` at `declared`.
    pub(super) fn member_named(
        &mut self,
        members: &[Expanded],
        wanted: &str,
        span: Span,
        (what, name, declared): (&str, &str, Span),
    ) -> Option<u32> {
        let found = members.iter().position(|member| member.name == wanted);
        if let Some(found) = found.filter(|_| members.len() > 1) {
            return u32::try_from(found).ok();
        }
        let diagnostic = if members.len() < 2 {
            Diagnostic::new(Code::UNPAIRED, span, format!("`{name}` is one {what}, not a group"))
                .label("only a group has members")
                .secondary(declared, format!("the {what} is declared here"))
                .note("a group has braces in its path, such as `\"/{r1,r2}/odom\"`")
        } else {
            let known: Vec<&str> = members.iter().map(|member| member.name.as_str()).collect();
            let diagnostic =
                Diagnostic::new(Code::UNKNOWN_NAME, span, format!("the group `{name}` has no member `{wanted}`"))
                    .label("unknown member")
                    .secondary(declared, format!("the {what} is declared here"));
            match most_similar(wanted, known.iter().copied()).filter(|_| self.compared.more(known.len())) {
                Some(similar) => diagnostic.did_you_mean(span, format!("[{}]", sesame_plan::in_brackets(similar))),
                None if known.len() <= 8 => diagnostic.note(format!("its members are {}", list(&known))),
                None => diagnostic,
            }
        };
        self.report(diagnostic);
        None
    }

    /// How to write a member of a topic, for example.
    pub(super) fn example_of_member(&self, topic: TopicId) -> String {
        let topic = self.system.topics.get(topic.index()).and_then(Option::as_ref);
        let member = topic.and_then(|topic| Some((&topic.declaration.name, topic.members.first()?)));
        member.map_or(String::new(), |(topic, member)| format!("`{}`", sesame_plan::with_member(topic, member)))
    }

    /// As [`Resolver::example_of_member`], for the topic of a path.
    pub(super) fn example_of_path(&self, path: &ast::Path) -> String {
        let topic = self.names.get(path.topic.text.as_str()).filter(|topic| topic.kind == Kind::Topic);
        topic.map_or(String::new(), |topic| self.example_of_member(TopicId::from_index(topic.index)))
    }

    /// The member of a topic that a path or list names in brackets. `None` was reported.
    pub(super) fn named_member(&mut self, topic: TopicId, name: &ast::Name, wanted: &str, span: Span) -> Option<u32> {
        let members = self.members_of_topic(topic);
        let declared = self.system.topics[topic.index()].as_ref()?;
        let what = match self.names.get(name.text.as_str()).map(|named| named.kind) {
            Some(kind @ (Kind::Service | Kind::Action)) => kind.word(),
            _ => Kind::Topic.word(),
        };
        self.member_named(&members, wanted, span, (what, &name.text, declared.declaration.span))
    }
}
