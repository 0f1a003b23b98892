//! Which topic at which broker is for what: where messages come from, and where they go.

use std::collections::BTreeMap;

use sesame_plan::{BrokerAt, CampaignPlan, Mqtt};
use sesame_relay::wire::Line;

/// A topic at a broker.
pub(crate) type Topic = (BrokerAt, String);

/// What a topic at a broker is for.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) enum Role {
    /// Messages of a source of a line, by their positions. They also go to these topics as they are, where a topic is
    /// not cut and its subscribers are at other brokers.
    Source { line: usize, source: usize, on_to: Vec<BrokerAt> },
    /// Messages that the runner published on a sink, and that come back.
    Sink { line: usize, sink: usize },
}

/// Where messages come from and go.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub(crate) struct Routes {
    /// What the runner subscribes to.
    pub(crate) heard: BTreeMap<Topic, Role>,
    /// For each line, and each of its sinks, the topics on which its messages are published.
    pub(crate) said: Vec<Vec<Vec<Topic>>>,
}

impl Routes {
    /// The routes of these lines. With `echoes`, what the runner publishes is heard, too.
    pub(crate) fn new(plan: &CampaignPlan, mqtt: &Mqtt, lines: &[Line], echoes: bool) -> Routes {
        let mut routes = Routes::default();
        for (at, line) in lines.iter().enumerate() {
            let publishers = mqtt.publishers(plan, line.topic);
            let subscribers = mqtt.subscribers(plan, line.topic);
            for (source, of) in line.sources.iter().enumerate() {
                let brokers: Vec<BrokerAt> = match of.publisher {
                    Some(node) => vec![mqtt.of(node)],
                    None => publishers.iter().copied().collect(),
                };
                for broker in brokers {
                    // Where no subscriber is at the broker of a publisher, the publisher keeps its name.
                    let keeps = of.publisher.is_none() && line.cut && !subscribers.contains(&broker);
                    let path = if keeps { &line.path } else { &of.path };
                    let on_to = if line.cut {
                        Vec::new()
                    } else {
                        subscribers.iter().copied().filter(|&other| other != broker).collect()
                    };
                    routes.heard.insert((broker, path.clone()), Role::Source { line: at, source, on_to });
                }
            }
            let said = line.sinks.iter().map(|sink| {
                let brokers: Vec<BrokerAt> = match sink.subscriber {
                    Some(node) => vec![mqtt.of(node)],
                    None => subscribers.iter().copied().collect(),
                };
                brokers.into_iter().map(|broker| (broker, sink.path.clone())).collect::<Vec<Topic>>()
            });
            let said: Vec<Vec<Topic>> = said.collect();
            if echoes {
                for (sink, topics) in said.iter().enumerate() {
                    // One broker is enough: a message comes back once.
                    if let Some(topic) = topics.first() {
                        routes.heard.entry(topic.clone()).or_insert(Role::Sink { line: at, sink });
                    }
                }
            }
            routes.said.push(said);
        }
        routes
    }

    /// The topics at a broker that the runner subscribes to; for each, whether it hears what it publishes itself.
    pub(crate) fn subscriptions(&self, broker: BrokerAt) -> Vec<(String, bool)> {
        let here = self.heard.iter().filter(|((at, _), _)| *at == broker);
        here.map(|((_, topic), role)| (topic.clone(), matches!(role, Role::Sink { .. }))).collect()
    }
}
