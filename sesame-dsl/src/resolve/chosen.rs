//! On which members of a group an operation acts: those that are named, or as many as a test chooses.

use super::Resolver;
use crate::diagnostic::{Code, Diagnostic};
use crate::groups::expand;
use crate::model::{self, Domain, Id as _, MembersOf, Parameter, TopicId};
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

impl<'a> Resolver<'a> {
    /// On which members of a group an operation acts, and the parameter by which a test chooses them. `None` was
    /// reported.
    pub(super) fn members_acted_on(
        &mut self,
        body: &'a OperationBody,
        target: Option<&model::Target>,
    ) -> Option<(Option<MembersOf>, Option<Parameter>)> {
        let (candidates, chosen, span) = match (target, &body.target, &body.resource) {
            (Some(found), Some(written), _) => (self.candidates_of_topic(found)?, written.chosen, written.span),
            (None, _, Some(resource)) => (self.candidates_of_node(resource)?, resource.chosen, resource.span),
            _ => return Some((None, None)),
        };
        let of_nodes = target.is_none();
        let Some(Candidates { positions, names, all }) = candidates else {
            let Some(chosen) = chosen else { return Some((None, None)) };
            let title = format!("`{}` needs a group, and this is none", self.text(chosen.span));
            let diagnostic = Diagnostic::new(Code::UNPAIRED, span, title)
                .label("it has no members to choose from")
                .note("a group has braces in its path, such as `\"/{r1,r2}/odom\"`");
            self.report(diagnostic);
            return None;
        };
        let Some(chosen) = chosen else {
            // An operation on a whole group of topics needs no list of members, like one on a single topic.
            return Some(((!all || of_nodes).then_some(MembersOf::These(positions)), None));
        };
        let (least, most) = self.how_many(&chosen, positions.len())?;
        let choices = choices(&positions, least, most);
        let Some(choices) = choices else {
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
        Some((Some(MembersOf::Chosen(choices)), Some(parameter)))
    }

    /// The members of a group of topics on which an operation acts; `None` inside for one topic.
    #[expect(clippy::option_option, reason = "the outer one is for what was reported")]
    fn candidates_of_topic(&self, target: &model::Target) -> Option<Option<Candidates>> {
        let topic = self.system.topics.get(target.topic.index())?.as_ref()?;
        let count = topic.members.len();
        if count == 0 {
            return Some(None);
        }
        let all = target.named.is_empty() || target.named.len() == count;
        let positions = if all { (0u32..).take(count).collect() } else { target.named.clone() };
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
    pub(super) fn wires_acted_on(&self, topic: TopicId, operation: &model::Operation) -> Option<usize> {
        let count = self.system.topics.get(topic.index())?.as_ref()?.paths.len();
        let permitted = |member: &u32| operation.members.as_ref().is_none_or(|members| members.may_have(*member));
        let links = |member: u32| {
            let nodes = operation.to.iter().filter_map(|node| self.system.nodes[node.index()].as_ref());
            let hears =
                |node: &&model::Node| node.subscribes.iter().any(|used| used.topic == topic && used.has(member));
            nodes.filter(hears).count()
        };
        let wires = (0u32..).take(count).filter(permitted);
        Some(if operation.to.is_empty() { wires.count() } else { wires.map(links).sum() })
    }

    /// Reports the members of a group where all are meant.
    pub(super) fn of_all_members(&mut self, target: &model::Target, span: Span) -> Option<()> {
        let Some(&first) = target.named.first() else { return Some(()) };
        let topic = self.system.topics.get(target.topic.index())?.as_ref()?;
        let member = sesame_plan::with_member(&topic.declaration.name, topic.members.get(first as usize)?);
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
