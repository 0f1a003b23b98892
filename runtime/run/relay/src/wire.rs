//! Topics as they are on the wire: every member of a topic group is a wire of its own, and so is the way of its
//! messages to a subscriber that operations distinguish.

mod line;
mod primitive;
mod wanted;

use std::collections::BTreeMap;

use sesame_plan::{CampaignPlan, NodeId, Operation, TopicId};

pub use self::line::{Line, Sink, Source, lines, service_lines};
pub use self::primitive::{bits_of, seconds_and_nanos, value_of};
pub use self::wanted::{Wanted, wanted};

/// A single topic on the wire: position in [`WireTable`].
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct Wire(u32);

impl Wire {
    /// The position in the table.
    pub fn index(self) -> usize {
        self.0 as usize
    }
}

/// All wires of a plan: topics in declaration order, the members of a group one after another. Behind them come the
/// [`Link`]s.
#[derive(Debug, Clone)]
pub struct WireTable {
    paths: Vec<Path>,
    by_path: BTreeMap<String, Wire>,
    links: Vec<Link>,
}

/// A path of a topic.
#[derive(Debug, Clone)]
struct Path {
    name: String,
    topic: TopicId,
    /// Its position among the paths of the topic.
    member: usize,
}

/// The way of a wire's messages to one subscriber, where operations tell it apart from the others (`to NODE`). Its
/// messages have passed all operations that act on every subscriber.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Link {
    /// Its own wire.
    pub wire: Wire,
    /// The wire from which its messages branch off.
    pub of: Wire,
    /// The subscriber.
    pub to: NodeId,
    path: String,
}

impl WireTable {
    /// The wires of a plan's topics.
    pub fn new(plan: &CampaignPlan) -> Self {
        let paths: Vec<_> = (0u32..)
            .zip(&plan.topics)
            .flat_map(|(id, topic)| {
                let path =
                    move |(member, name): (usize, &String)| Path { name: name.clone(), topic: TopicId(id), member };
                topic.paths.iter().enumerate().map(path)
            })
            .collect();
        let by_path = (0u32..).zip(&paths).map(|(at, path)| (path.name.clone(), Wire(at))).collect();
        let mut table = WireTable { paths, by_path, links: Vec::new() };
        let mut links = Vec::new();
        for of in table.iter() {
            for to in plan.told_apart(table.topic(of), table.member(of)) {
                let wire = Wire(u32::try_from(table.len() + links.len()).unwrap_or(u32::MAX));
                let path = format!("{}/to/{}", table.path(of), plan.node(to).name_in_paths());
                links.push(Link { wire, of, to, path });
            }
        }
        table.links = links;
        table
    }

    /// The ways to subscribers that operations tell apart from the others.
    pub fn links(&self) -> &[Link] {
        &self.links
    }

    /// The number of wires with all links.
    pub fn len_with_links(&self) -> usize {
        self.paths.len() + self.links.len()
    }

    /// The link that has this wire, if it is none of a topic's own.
    pub fn link(&self, wire: Wire) -> Option<&Link> {
        self.links.get(wire.index().checked_sub(self.paths.len())?)
    }

    /// The wire of a name, matched exactly.
    pub fn find(&self, path: &str) -> Option<Wire> {
        self.by_path.get(path).copied()
    }

    /// The wire of a name, matched exactly, and of this topic where one is named: a service's request and reply have
    /// one name, but are two topics.
    pub fn find_of(&self, plan: &CampaignPlan, path: &str, topic: Option<&str>) -> Option<Wire> {
        let Some(topic) = topic else { return self.find(path) };
        let is_it = |wire: &Wire| plan.topic(self.topic(*wire)).name == topic;
        let usual = self.find(path).filter(is_it);
        usual.or_else(|| self.iter().find(|wire| self.path(*wire) == path && is_it(wire)))
    }

    /// The name of a wire.
    pub fn path(&self, wire: Wire) -> &str {
        self.link(wire).map_or_else(|| self.paths[wire.index()].name.as_str(), |link| &link.path)
    }

    /// The topic a wire belongs to.
    pub fn topic(&self, wire: Wire) -> TopicId {
        self.of_topic(wire).topic
    }

    /// The position of a wire's path among those of its topic: which member of a group it is.
    pub fn member(&self, wire: Wire) -> usize {
        self.of_topic(wire).member
    }

    /// The path from which a link branches off, or a wire's own.
    fn of_topic(&self, wire: Wire) -> &Path {
        &self.paths[self.link(wire).map_or(wire, |link| link.of).index()]
    }

    /// The wires on whose messages an operation may act: the links to the subscribers that it names, or else the wires
    /// of its topics. If one is a group, only those of the members that the operation may disturb.
    pub fn acted_on(&self, operation: &Operation) -> impl Iterator<Item = Wire> {
        let links = self.links.iter().filter(|link| operation.to.contains(&link.to)).map(|link| link.wire);
        let own = self.iter().filter(|_| operation.to.is_empty());
        let acts = |wire| operation.may_act_on(self.topic(wire), self.member(wire));
        own.chain(links).filter(move |&wire| acts(wire))
    }

    /// All wires of topics, in order, without links.
    pub fn iter(&self) -> impl Iterator<Item = Wire> + use<> {
        (0u32..).take(self.paths.len()).map(Wire)
    }

    /// The number of wires without links.
    pub fn len(&self) -> usize {
        self.paths.len()
    }

    /// Whether there are no wires.
    pub fn is_empty(&self) -> bool {
        self.paths.is_empty()
    }
}
