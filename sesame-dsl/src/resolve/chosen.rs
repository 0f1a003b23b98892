//! On which members of a group an operation acts: those that are named, or as many as a test chooses.

use std::collections::BTreeSet;

use super::Resolver;
use super::words::list;
use crate::diagnostic::{Code, Diagnostic};
use crate::groups::expand;
use crate::model::{self, Domain, Id as _, MembersOf, Parameter};
use crate::span::Span;
use crate::syntax::ast::{self, Chosen, OperationBody};

/// The most choices of members that a test may have.
const MOST_CHOICES: usize = 1_000;

/// Members of a group: their positions, with the names of all members.
struct Candidates {
    positions: Vec<u32>,
    names: Vec<String>,
    /// Whether they are all members.
    all: bool,
}

impl Candidates {
    /// Whether these are members of the same names, in any order.
    fn are_like(&self, other: &Candidates) -> bool {
        let names = |of: &Candidates| of.names_of(&of.positions).map(str::to_owned).collect::<BTreeSet<_>>();
        names(self) == names(other)
    }

    /// The members that have the names of these members of another group, which is like this one.
    fn like(&self, other: &Candidates, these: &[u32]) -> Vec<u32> {
        let names: Vec<&str> = other.names_of(these).collect();
        let of_these = |&position: &u32| names.contains(&self.names[position as usize].as_str());
        self.positions.iter().copied().filter(of_these).collect()
    }

    fn names_of(&self, positions: &[u32]) -> impl Iterator<Item = &str> {
        positions.iter().map(|&position| self.names[position as usize].as_str())
    }

    fn in_words(&self) -> String {
        list(&self.names_of(&self.positions).collect::<Vec<_>>())
    }
}

impl<'a> Resolver<'a> {
    /// On which members of the groups of its topics an operation acts, which is written into its targets, and the
    /// parameter by which a test chooses them. `None` was reported.
    #[expect(clippy::option_option, reason = "the outer one is for what was reported")]
    pub(super) fn members_of_targets(
        &mut self,
        body: &'a OperationBody,
        targets: &mut [model::Target],
    ) -> Option<Option<Parameter>> {
        let mut of_each: Vec<(Candidates, Span)> = Vec::new();
        for (target, written) in targets.iter_mut().zip(&body.targets) {
            let candidates = self.candidates_of_topic(target)?;
            let Some(chosen) = body.chosen else {
                // An operation on a whole group of topics needs no list of members, like one on a single topic.
                let some = candidates.filter(|candidates| !candidates.all);
                target.members = some.map(|candidates| MembersOf::These(candidates.positions));
                continue;
            };
            let Some(candidates) = candidates else {
                self.needs_a_group(chosen, written.span);
                return None;
            };
            if let Some((first, at)) = of_each.first()
                && !candidates.are_like(first)
            {
                let [other, title] = [*at, written.span].map(|span| self.text(span));
                let title = format!("`{title}` has other members to choose from than `{other}`");
                let diagnostic = Diagnostic::new(Code::UNPAIRED, written.span, title)
                    .label(format!("it has {}", candidates.in_words()))
                    .secondary(*at, format!("it has {}", first.in_words()))
                    .note("a test chooses members, and the operation acts on these in all of its topics");
                self.report(diagnostic);
                return None;
            }
            of_each.push((candidates, written.span));
        }
        let (Some(chosen), Some((first, _))) = (body.chosen, of_each.first()) else { return Some(None) };
        let (choices, parameter) = self.choice_of(chosen, first)?;
        for (target, (candidates, _)) in targets.iter_mut().zip(&of_each) {
            let own = choices.iter().map(|these| candidates.like(first, these)).collect();
            target.members = Some(MembersOf::Chosen(own));
        }
        Some(Some(parameter))
    }

    /// On which nodes of a group an operation acts, and the parameter by which a test chooses them. `None` was
    /// reported.
    pub(super) fn members_of_node(
        &mut self,
        resource: &'a ast::Resource,
    ) -> Option<(Option<MembersOf>, Option<Parameter>)> {
        let candidates = self.candidates_of_node(resource)?;
        match (candidates, resource.chosen) {
            (None, None) => Some((None, None)),
            (None, Some(chosen)) => {
                self.needs_a_group(chosen, resource.span);
                None
            }
            (Some(candidates), None) => Some((Some(MembersOf::These(candidates.positions)), None)),
            (Some(candidates), Some(chosen)) => {
                let (choices, parameter) = self.choice_of(chosen, &candidates)?;
                Some((Some(MembersOf::Chosen(choices)), Some(parameter)))
            }
        }
    }

    fn needs_a_group(&mut self, chosen: Chosen, span: Span) {
        let title = format!("`{}` needs a group, and this is none", self.text(chosen.span));
        let diagnostic = Diagnostic::new(Code::UNPAIRED, span, title)
            .label("it has no members to choose from")
            .note("a group has braces in its path, such as `\"/{r1,r2}/odom\"`");
        self.report(diagnostic);
    }

    /// The choices that a test has among members, and the parameter by which it makes one. `None` was reported.
    fn choice_of(&mut self, chosen: Chosen, candidates: &Candidates) -> Option<(Vec<Vec<u32>>, Parameter)> {
        let Candidates { positions, names, .. } = candidates;
        let (least, most) = self.how_many(&chosen, positions.len())?;
        let Some(choices) = choices(positions, least, most) else {
            let title = format!("`{}` permits more than {MOST_CHOICES} choices of members", self.text(chosen.span));
            let diagnostic = Diagnostic::new(Code::TOO_LARGE, chosen.span, title)
                .label("expected fewer members")
                .note("name the members to choose from, such as `one of odom[r1], odom[r2]`");
            self.report(diagnostic);
            return None;
        };
        let name = |&member: &u32| names[member as usize].as_str();
        let texts = choices.iter().map(|these| these.iter().map(name).collect::<Vec<_>>().join(", ")).collect();
        let parameter = Parameter {
            name: if most == 1 { "member" } else { "members" }.to_owned(),
            doc: String::new(),
            unit: None,
            domain: Domain::Texts(texts),
        };
        Some((choices, parameter))
    }

    /// The members of a group of topics on which an operation acts; `None` inside for one topic.
    #[expect(clippy::option_option, reason = "the outer one is for what was reported")]
    fn candidates_of_topic(&self, target: &model::Target) -> Option<Option<Candidates>> {
        let topic = self.system.topics.get(target.topic.index())?.as_ref()?;
        let count = topic.members.len();
        if count == 0 {
            return Some(None);
        }
        let named = match &target.members {
            Some(MembersOf::These(these)) if these.len() < count => Some(these.clone()),
            _ => None,
        };
        let all = named.is_none();
        let positions = named.unwrap_or_else(|| (0u32..).take(count).collect());
        Some(Some(Candidates { positions, names: topic.members.clone(), all }))
    }

    /// The members of a group of nodes on which an operation acts; `None` inside for one node.
    #[expect(clippy::option_option, reason = "the outer one is for what was reported")]
    fn candidates_of_node(&mut self, resource: &'a ast::Resource) -> Option<Option<Candidates>> {
        let nodes = self.nodes_named(&resource.node)?;
        if nodes.len() == 1 {
            return Some(None);
        }
        let declared = self.names.get(resource.node.name.text.as_str())?.index;
        let named = self.ast_nodes().nth(declared)?.named.as_ref()?;
        let names: Vec<String> = expand(&named.text).ok()?.into_iter().map(|member| member.name).collect();
        Some(Some(Candidates { positions: (0u32..).take(names.len()).collect(), names, all: true }))
    }

    /// How many members a test chooses at least and at most.
    fn how_many(&mut self, chosen: &Chosen, of: usize) -> Option<(usize, usize)> {
        let [least, most] = [chosen.least.value?, chosen.most.value?];
        let (title, label) = if least > most {
            ("the first number is greater than the second".to_owned(), "swap the two".to_owned())
        } else if least == 0 {
            ("an operation acts on at least one member".to_owned(), "expected 1 or more".to_owned())
        } else if most > of as u64 {
            (format!("there are only {of} members to choose from"), format!("expected at most {of}"))
        } else {
            return Some((usize::try_from(least).ok()?, usize::try_from(most).ok()?));
        };
        self.report(Diagnostic::new(Code::OUT_OF_RANGE, chosen.span, title).label(label));
        None
    }

    /// The number of wires that an operation may act on.
    pub(super) fn wires_acted_on(&self, operation: &model::Operation) -> Option<usize> {
        let mut wires = 0;
        for model::Target { topic, members, .. } in &operation.targets {
            let count = self.system.topics.get(topic.index())?.as_ref()?.paths.len();
            let permitted = |member: &u32| members.as_ref().is_none_or(|members| members.may_have(*member));
            let links = |member: u32| {
                let nodes = operation.to.iter().filter_map(|node| self.system.nodes[node.index()].as_ref());
                let hears =
                    |node: &&model::Node| node.subscribes.iter().any(|used| used.topic == *topic && used.has(member));
                nodes.filter(hears).count()
            };
            let of_topic = (0u32..).take(count).filter(permitted);
            wires += if operation.to.is_empty() { of_topic.count() } else { of_topic.map(links).sum() };
        }
        Some(wires)
    }

    /// Reports the members of a group where all are meant.
    pub(super) fn of_all_members(&mut self, target: &model::Target, span: Span) -> Option<()> {
        let Some(MembersOf::These(these)) = &target.members else { return Some(()) };
        let first = these.first()?;
        let topic = self.system.topics.get(target.topic.index())?.as_ref()?;
        let member = sesame_plan::with_member(&topic.declaration.name, topic.members.get(*first as usize)?);
        let title = format!("`{member}` is one member of a group, which cannot be used here");
        self.report(Diagnostic::new(Code::UNPAIRED, span, title).label("expected the whole group"));
        None
    }
}

/// All choices of so many of these members, the smallest first; `None` if there are too many.
fn choices(of: &[u32], least: usize, most: usize) -> Option<Vec<Vec<u32>>> {
    let mut found: Vec<Vec<u32>> = Vec::new();
    let mut of_size: Vec<Vec<u32>> = vec![Vec::new()];
    for size in 1..=most {
        let longer = |these: &Vec<u32>| {
            let from =
                these.last().map_or(0, |last| of.iter().position(|member| member == last).map_or(0, |at| at + 1));
            let more: Vec<Vec<u32>> = of[from..].iter().map(|&next| [&these[..], &[next]].concat()).collect();
            more
        };
        let mut next = Vec::new();
        for these in &of_size {
            next.extend(longer(these));
            if next.len() > 100 * MOST_CHOICES {
                return None;
            }
        }
        of_size = next;
        if size >= least {
            found.extend(of_size.iter().cloned());
        }
        if found.len() > MOST_CHOICES {
            return None;
        }
    }
    Some(found)
}

#[cfg(test)]
mod tests {
    use super::choices;

    #[test]
    fn choices_are_the_subsets_of_the_permitted_sizes_the_smallest_first() {
        assert_eq!(choices(&[0, 2, 5], 1, 1).unwrap(), [vec![0], vec![2], vec![5]]);
        assert_eq!(choices(&[0, 2, 5], 1, 2).unwrap()[3..], [vec![0, 2], vec![0, 5], vec![2, 5]]);
        assert_eq!(choices(&[0, 2, 5], 3, 3).unwrap(), [vec![0, 2, 5]]);
        let of: Vec<u32> = (0..20).collect();
        assert_eq!(choices(&of, 2, 2).map(|all| all.len()), Some(190));
        assert_eq!(choices(&of, 3, 3), None, "1140 are too many");
        assert_eq!(choices(&of, 10, 10), None);
    }
}
