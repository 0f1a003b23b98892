//! Members of groups in formulas: which of them an input reads, and which of several groups belong together.

use super::Resolver;
use super::system::members_of_path;
use crate::diagnostic::{Code, Diagnostic};
use crate::model::{FieldPath, Id as _, Input, Members, TopicId};
use crate::span::Span;
use crate::syntax::ast::{self, Path};

/// The most pairs of a group's members: each has a state of its own during a run.
const MOST_PAIRS: usize = 100_000;

impl<'a> Resolver<'a> {
    /// Which members of a group a path stands for.
    pub(super) fn members(
        &mut self,
        path: &'a Path,
        field: &FieldPath,
        members: Option<(ast::Members, Span)>,
    ) -> Option<Members> {
        let Some((members, word)) = members else { return Some(Members::Min) };
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
        let title = format!("`{}` is one topic, not a group", path.topic.text);
        if matches!(members, ast::Members::EachPair) {
            let diagnostic = Diagnostic::new(Code::UNPAIRED, span, title)
                .label("a pair needs a group of two or more members")
                .note("a group is a topic with several paths, such as `\"poses/{a,b}\"`");
            self.report(diagnostic);
            return None;
        }
        let diagnostic = Diagnostic::new(Code::IDLE_CLAUSE, span, title)
            .label(format!("`{} of` combines the members of a group", self.text(word)));
        let remove = format!("remove `{} of`", self.text(word));
        self.report(diagnostic.suggest(remove, Span { hi: path.span.lo, ..word }, ""));
        None
    }

    /// The two inputs of each pair of a group's members.
    pub(super) fn pair_of(&mut self, path: &'a Path, field: &FieldPath, word: Span) -> Option<[Input; 2]> {
        self.is_group(path, field, ast::Members::EachPair, word)?;
        let count = self.members_of(field);
        let pairs = count * count.saturating_sub(1) / 2;
        if pairs > MOST_PAIRS {
            let title = format!("`{}` has {pairs} pairs of members, but the limit is {MOST_PAIRS}", path.topic.text);
            self.report(Diagnostic::new(Code::TOO_LARGE, word.to(path.span), title).label("too many pairs"));
            return None;
        }
        let of = |members| Input { field: field.clone(), members, list: None, text: None };
        Some([of(Members::First), of(Members::Second)])
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
        let (each, pairs) = (topics(&[Members::Each]), topics(&[Members::First, Members::Second]));
        if !pairs.is_empty() && (pairs.len() > 1 || !each.is_empty()) {
            let title = if each.is_empty() {
                "`each pair of` refers to two groups in one formula"
            } else {
                "`each pair of` and `each of` cannot be combined in one formula"
            };
            let diagnostic = Diagnostic::new(Code::UNPAIRED, whole, title)
                .label("expected the pairs of one group")
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
            diagnostic = diagnostic.secondary(span, format!("with the members {}", super::words::list(names)));
        }
        let sorted = |mut names: Vec<&'a str>| {
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

    fn names_of_members(&self, topic: TopicId) -> Vec<&'a str> {
        self.path_of_topic(topic).map_or(Vec::new(), |path| members_of_path(&path.text))
    }
}
