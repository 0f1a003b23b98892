//! The lines of a run, as a node of ROS 1 has them.

use std::sync::Arc;

use sesame_codec::ros1::Codec;
use sesame_interfaces::ros1::type_name;
use sesame_plan::{CampaignPlan, Channel, Interface};
use sesame_relay::transport::TransportError;
use sesame_relay::wire::{Line, Sink, wanted};

use super::lost::lost;
use crate::master::AskError;
use crate::node::{Node, Publication, Service, Subscription};

/// What a subscription is for.
#[derive(Debug, Clone, Copy)]
pub(super) enum Role {
    Clock,
    Source { line: usize, source: usize },
}

/// The clock of the simulator.
#[derive(Debug)]
pub(super) struct Clocked {
    pub(super) path: String,
    pub(super) subscription: usize,
}

/// A line with what the node has for it, by positions.
#[derive(Debug)]
pub(super) struct Wired {
    pub(super) line: Line,
    pub(super) interface: String,
    pub(super) codec: Arc<Codec>,
    /// The subscription of each source of a topic.
    pub(super) sources: Vec<usize>,
    /// The publication of each sink of a topic.
    pub(super) sinks: Vec<usize>,
    /// The service, of a line that is one direction of it.
    pub(super) service: usize,
}

/// A line by absolute names, with a codec for its messages.
pub(super) fn wire(plan: &CampaignPlan, interfaces: &[Interface], line: &Line) -> Result<Wired, TransportError> {
    let topic = plan.topic(line.topic);
    let problem = |problem: &str| {
        TransportError::Wiring(format!("the messages of topic `{}` have no layout: {problem}", topic.name))
    };
    let interface = topic.interface.as_deref().ok_or_else(|| problem("it names no interface"))?;
    let codec = Codec::new(interfaces, interface, &wanted(plan, line.topic));
    let codec = Arc::new(codec.map_err(|error| problem(&error.to_string()))?);
    let mut line = line.clone();
    let sources = line.sources.iter_mut().map(|source| &mut source.path);
    let sinks = line.sinks.iter_mut().map(|sink| &mut sink.path);
    for path in sources.chain(sinks).chain([&mut line.path]) {
        *path = absolute(path);
    }
    let interface = type_name(interface);
    Ok(Wired { line, interface, codec, sources: Vec::new(), sinks: Vec::new(), service: 0 })
}

impl Wired {
    /// What is published at a sink of a topic. Where nobody else publishes, its type is that of the space.
    fn publication(&self, sink: &Sink, interfaces: &[Interface]) -> Result<Publication, TransportError> {
        if !self.line.sources.is_empty() {
            return Ok(Publication::new(&sink.path));
        }
        let publication = Publication::of_space(&sink.path, interfaces, &self.interface);
        publication
            .map_err(|error| TransportError::Wiring(format!("nothing can be published on `{}`: {error}", sink.path)))
    }

    /// Subscribes to the sources of a topic; `each` is called for each before anything comes from it.
    pub(super) fn subscribe(
        &mut self,
        node: &Node,
        interfaces: &[Interface],
        mut each: impl FnMut(usize),
    ) -> Result<(), TransportError> {
        let lost = |error: AskError| lost(&node.master.at, &error.to_string());
        for sink in &self.line.sinks {
            let publication = self.publication(sink, interfaces)?;
            self.sinks.push(node.add_publication(publication).map_err(lost)?);
        }
        for (at, source) in self.line.sources.iter().enumerate() {
            each(at);
            let codec = Some(Arc::clone(&self.codec));
            let subscription = Subscription::new(&source.path, &self.interface, codec, self.sinks.clone());
            self.sources.push(node.subscribe(subscription).map_err(lost)?);
        }
        Ok(())
    }

    /// Has a service served, of which this is one direction, at this position; the other direction may be there.
    pub(super) fn serve(
        &mut self,
        node: &Node,
        others: &[Wired],
        services: &mut Vec<[Option<usize>; 2]>,
        position: usize,
    ) {
        let is_other = |other: &&Wired| other.line.channel != Channel::Topic && other.line.path == self.line.path;
        self.service = others.iter().find(is_other).map_or_else(
            || {
                services.push([None, None]);
                let server = format!("{}/undisturbed", self.line.path);
                node.add_service(Service::new(&self.line.path, &server))
            },
            |other| other.service,
        );
        services[self.service][usize::from(self.line.channel == Channel::Reply)] = Some(position);
    }
}

/// A name of ROS with the slash that it has in the graph.
pub(super) fn absolute(path: &str) -> String {
    if path.starts_with('/') { path.to_owned() } else { format!("/{path}") }
}

/// The time of a `rosgraph_msgs/Clock` in nanoseconds; `None` if the message is none.
pub(super) fn clock(message: &[u8]) -> Option<i64> {
    let [seconds, nanos] = message.as_chunks::<4>().0 else { return None };
    let (seconds, nanos) = (u32::from_le_bytes(*seconds), u32::from_le_bytes(*nanos));
    (message.len() == 8 && nanos < 1_000_000_000).then(|| i64::from(seconds) * 1_000_000_000 + i64::from(nanos))
}

/// The reply of `std_srvs/Trigger`: whether it was done, or else why not. `None` if it is none.
pub(super) fn trigger(reply: &[u8]) -> Option<Result<(), String>> {
    let (success, rest) = reply.split_first()?;
    let (length, message) = rest.split_first_chunk()?;
    if u32::from_le_bytes(*length) as usize != message.len() {
        return None;
    }
    Some(if *success == 0 { Err(String::from_utf8_lossy(message).into_owned()) } else { Ok(()) })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn clocks_and_replies_are_read() {
        assert_eq!(clock(&[2, 0, 0, 0, 1, 0, 0, 0]), Some(2_000_000_001));
        assert_eq!(clock(&[255; 8]), None, "so many nanoseconds are seconds");
        assert_eq!(clock(&[0; 7]), None);
        assert_eq!(clock(&[0; 9]), None);
        assert_eq!(trigger(&[1, 0, 0, 0, 0]), Some(Ok(())));
        assert_eq!(trigger(&[0, 2, 0, 0, 0, b'n', b'o']), Some(Err("no".to_owned())));
        assert_eq!(trigger(&[1, 2, 0, 0, 0]), None);
        assert_eq!(trigger(&[]), None);
    }
}
