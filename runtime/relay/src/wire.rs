//! Topics as they are on the wire: every member of a topic group is a wire of its own.

use std::collections::BTreeMap;

use sesame_plan::{CampaignPlan, TopicId};

/// A single topic on the wire: position in [`WireTable`].
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct Wire(u32);

impl Wire {
    /// The position in the table.
    pub fn index(self) -> usize {
        self.0 as usize
    }
}

/// All wires of a plan: topics in declaration order, the members of a group one after another.
#[derive(Debug, Clone)]
pub struct WireTable {
    paths: Vec<(String, TopicId)>,
    by_path: BTreeMap<String, Wire>,
}

impl WireTable {
    /// The wires of a plan's topics.
    pub fn new(plan: &CampaignPlan) -> Self {
        let paths: Vec<_> = (0u32..)
            .zip(&plan.topics)
            .flat_map(|(id, topic)| topic.paths.iter().map(move |path| (path.clone(), TopicId(id))))
            .collect();
        let by_path = (0u32..).zip(&paths).map(|(at, (path, _))| (path.clone(), Wire(at))).collect();
        WireTable { paths, by_path }
    }

    /// The wire of a name, matched exactly.
    pub fn find(&self, path: &str) -> Option<Wire> {
        self.by_path.get(path).copied()
    }

    /// The name of a wire.
    pub fn path(&self, wire: Wire) -> &str {
        &self.paths[wire.index()].0
    }

    /// The topic a wire belongs to.
    pub fn topic(&self, wire: Wire) -> TopicId {
        self.paths[wire.index()].1
    }

    /// All wires, in order.
    pub fn iter(&self) -> impl Iterator<Item = Wire> + use<> {
        (0u32..).take(self.paths.len()).map(Wire)
    }

    /// The number of wires.
    pub fn len(&self) -> usize {
        self.paths.len()
    }

    /// Whether there are no wires.
    pub fn is_empty(&self) -> bool {
        self.paths.is_empty()
    }
}
