//! A topic to which the node subscribes, with its publishers.

use std::collections::BTreeMap;
use std::sync::Arc;

use sesame_codec::ros1::Codec;

/// A topic to which the node subscribes.
#[derive(Debug)]
pub(crate) struct Subscription {
    pub(crate) topic: String,
    /// Its declared type as ROS 1 names it.
    pub(crate) ty: String,
    /// Its declared layout, with which that of its publishers is compared.
    pub(crate) codec: Option<Arc<Codec>>,
    /// The publications that get their type from its publishers, by position.
    pub(crate) feeds: Vec<usize>,
    /// Its publishers by their addresses.
    pub(super) publishers: BTreeMap<String, Publisher>,
    /// Whether a connection of it was lost.
    pub(super) lost: bool,
}

#[derive(Debug, Default)]
pub(super) struct Publisher {
    /// Whether the master names it. One that it no longer names is listened to until it closes the connection.
    pub(super) listed: bool,
    /// Its node, while it is connected.
    pub(super) node: Option<String>,
}

impl Subscription {
    pub(crate) fn new(topic: &str, ty: &str, codec: Option<Arc<Codec>>, feeds: Vec<usize>) -> Self {
        let (topic, ty) = (topic.to_owned(), ty.to_owned());
        Subscription { topic, ty, codec, feeds, publishers: BTreeMap::new(), lost: false }
    }

    /// The nodes to whose messages it listens.
    pub(crate) fn connected(&self) -> impl Iterator<Item = &str> {
        self.publishers.values().filter_map(|publisher| publisher.node.as_deref())
    }
}
