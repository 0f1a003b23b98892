//! Members of groups in formulas: which of them an input reads, and which of several groups belong together.

use super::Resolver;
use crate::diagnostic::{Code, Diagnostic};
use crate::model::{FieldPath, Id as _, Input, Members, TopicId, Type};
use crate::span::Span;
use crate::syntax::ast::{self, Path};

/// The most pairs of a group's members: each has a state of its own during a run.
const MOST_PAIRS: usize = 100_000;

impl<'a> Resolver<'a> {
    /// Which members of a group a path stands for, of which `only` may be named.
    pub(super) fn members(
        &mut self,
        path: &'a Path,
        field: &FieldPath,
        only: Option<u32>,
        members: Option<(ast::Members, Span)>,
    ) -> Option<Members> {
        let Some((members, word)) = members else { return Some(only.map_or(Members::Min, Members::Only)) };
        if only.is_some() {
            self.is_one(self.text(path.span), members, word.to(path.span), word);
            return None;
        }
        self.is_group(path, field, members, word)?;
        Some(match members {
            // The three words for lists alone were refused before.
            ast::Members::Min | ast::Members::Mean | ast::Members::Count | ast::Members::Length => Members::Min,
            ast::Members::Max => Members::Max,
            ast::Members::Sum => Members::Sum,
            ast::Members::Each => Members::Each,
            ast::Members::EachPair => {
                let span = word.to(path.span);
                let title = format!("`{}` is a pair of values, but one value is needed", self.text(span));
                let diagnostic = Diagnostic::new(Code::UNPAIRED, span, title)
                    .label("`each pair of` is only allowed as the argument of `distance`")
                    .note("for example `min(distance(each pair of poses.position))`");
                self.report(diagnostic);
                return None;
            }
        })
    }

    /// Checks that there are members to choose from.
    fn is_group(&mut self, path: &'a Path, field: &FieldPath, members: ast::Members, word: Span) -> Option<()> {
        let count = self.members_of(field);
        let span = word.to(path.span);
        if count != 1 {
            return Some(());
        }
        self.is_one(&path.topic.text, members, span, word);
        None
    }

    /// Reports a word for the members of a group before one topic, or one member.
    fn is_one(&mut self, what: &str, members: ast::Members, span: Span, word: Span) {
        let title = format!("`{what}` is one topic, not a group");
        if matches!(members, ast::Members::EachPair) {
            let diagnostic = Diagnostic::new(Code::UNPAIRED, span, title)
                .label("a pair needs a group of two or more members")
                .note("a group is a topic with several paths, such as `\"poses/{a,b}\"`");
            self.report(diagnostic);
            return;
        }
        let diagnostic = Diagnostic::new(Code::IDLE_CLAUSE, span, title)
            .label(format!("`{} of` combines the members of a group", self.text(word)));
        let remove = format!("remove `{} of`", self.text(word));
        // Up to the path, which is what is left of it.
        let behind = self.text(span)[(word.hi - word.lo) as usize..].trim_start();
        let behind = behind.strip_prefix("of").map_or(behind, str::trim_start);
        let path = span.hi - u32::try_from(behind.len()).expect("files are small");
        self.report(diagnostic.suggest(remove, Span { hi: path, ..word }, ""));
    }

    /// The member of a group that a path names, and what is left of its choices of elements. A number is a member
    /// directly behind the name of a group whose topics are not lists.
    pub(super) fn member_of_path(&mut self, topic: TopicId, path: &'a Path) -> Option<(Option<u32>, &'a [ast::Step])> {
        let elements = path.elements.as_slice();
        if let Some(member) = &path.member {
            let Some(wanted) = &member.name else { return Some((None, elements)) };
            return Some((Some(self.named_member(topic, &path.topic, wanted, member.span)?), elements));
        }
        match elements {
            [ast::Step::Element(count, span), rest @ ..] if self.may_name_a_member(topic, path) => {
                let wanted = self.text(count.span);
                Some((Some(self.named_member(topic, &path.topic, wanted, *span)?), rest))
            }
            _ => Some((None, elements)),
        }
    }

    /// Whether a number behind the name of a topic is a member.
    pub(super) fn may_name_a_member(&self, topic: TopicId, path: &Path) -> bool {
        let topic = self.system.topics.get(topic.index()).and_then(Option::as_ref);
        let of_group = topic.is_some_and(|topic| topic.paths.len() > 1 && !matches!(topic.ty, Type::List(_)));
        of_group && path.fields.is_empty()
    }

    /// The two inputs of each pair of a group's members or, with the members of another group, of each member of one
    /// with each of the other.
    pub(super) fn pair_of(
        &mut self,
        (path, field): (&'a Path, &FieldPath),
        other: Option<&FieldPath>,
        word: Span,
    ) -> Option<[Input; 2]> {
        self.is_group(path, field, ast::Members::EachPair, word)?;
        let count = self.members_of(field);
        let pairs = match other {
            None => count * count.saturating_sub(1) / 2,
            Some(other) => count.saturating_mul(self.members_of(other)),
        };
        if pairs > MOST_PAIRS {
            let title = format!("`{}` has {pairs} pairs of members, but the limit is {MOST_PAIRS}", path.topic.text);
            self.report(Diagnostic::new(Code::TOO_LARGE, word.to(path.span), title).label("too many pairs"));
            return None;
        }
        let of = |field: &FieldPath, members| Input {
            field: field.clone(),
            members,
            list: None,
            text: None,
            memory: Vec::new(),
        };
        Some([of(field, Members::First), of(other.unwrap_or(field), Members::Second)])
    }

    /// Checks that the members which a formula reads one by one belong together: those of one group, those at the same
    /// place of several groups, or the pairs of one group.
    pub(super) fn members_fit(&mut self, inputs: &[Input], whole: Span) -> Option<()> {
        let topics = |of: &[Members]| {
            let mut topics: Vec<TopicId> = Vec::new();
            for input in inputs.iter().filter(|input| of.contains(&input.members)) {
                if !topics.contains(&input.field.topic) {
                    topics.push(input.field.topic);
                }
            }
            topics
        };
        let each = topics(&[Members::Each]);
        let [first, second] = [Members::First, Members::Second].map(|side| topics(&[side]));
        let several = first.len() > 1 || second.len() > 1;
        if several || !first.is_empty() && !each.is_empty() {
            let title = if several {
                "`each pair of` refers to different groups in one formula"
            } else {
                "`each pair of` and `each of` cannot be combined in one formula"
            };
            let diagnostic = Diagnostic::new(Code::UNPAIRED, whole, title)
                .label("expected the same pairs in all of it")
                .note("the formula is evaluated for each pair of members");
            self.report(diagnostic);
            return None;
        }
        let Some((&first, others)) = each.split_first() else { return Some(()) };
        others.iter().try_for_each(|&other| self.same_members(first, other, whole))
    }

    /// Checks that two groups have the same members, which are then paired.
    pub(super) fn same_members(&mut self, first: TopicId, other: TopicId, whole: Span) -> Option<()> {
        let [of_first, of_other] = [first, other].map(|topic| self.names_of_members(topic));
        if of_first == of_other {
            return Some(());
        }
        let name = |topic: TopicId| self.system.topics[topic.index()].as_ref().map(|topic| &topic.declaration.name);
        let title = format!("`{}` and `{}` have different members", name(first)?, name(other)?);
        let mut diagnostic = Diagnostic::new(Code::UNPAIRED, whole, title).label("the members cannot be paired");
        for (topic, names) in [(first, &of_first), (other, &of_other)] {
            let span = self.path_of_topic(topic)?.span;
            let names: Vec<&str> = names.iter().map(String::as_str).collect();
            diagnostic = diagnostic.secondary(span, format!("with the members {}", super::words::list(&names)));
        }
        let sorted = |mut names: Vec<String>| {
            names.sort_unstable();
            names
        };
        let note = if sorted(of_first) == sorted(of_other) {
            "list the members of both groups in the same order: they are paired by their places"
        } else {
            "the formula is evaluated for each member, with the values that this member has in both groups"
        };
        self.report(diagnostic.note(note));
        None
    }

    fn names_of_members(&self, topic: TopicId) -> Vec<String> {
        let members = self.members_of_topic(topic);
        if members.len() < 2 { Vec::new() } else { members.into_iter().map(|member| member.name).collect() }
    }
}
