//! Topics of MQTT at brokers: at which its publishers are, and at which its subscribers.

use std::collections::BTreeSet;

use crate::{Broker, CampaignPlan, Mqtt, NodeId, TopicId};

/// A broker by its position among [all](Mqtt::all).
pub type BrokerAt = usize;

impl Mqtt {
    /// Each broker once, that of the simulator first.
    pub fn all(&self) -> Vec<&Broker> {
        let mut all = vec![&self.broker];
        for (_, broker) in &self.brokers {
            if !all.contains(&broker) {
                all.push(broker);
            }
        }
        all
    }

    /// The broker of a node.
    pub fn of(&self, node: NodeId) -> BrokerAt {
        let own = self.brokers.iter().find(|(of, _)| *of == node).map(|(_, broker)| broker);
        own.and_then(|own| self.all().into_iter().position(|broker| broker == own)).unwrap_or(0)
    }

    /// The brokers of a topic's publishers; that of the simulator if no node says that it publishes it.
    pub fn publishers(&self, plan: &CampaignPlan, topic: TopicId) -> BTreeSet<BrokerAt> {
        self.brokers_of(plan, |node| node.publishes(topic))
    }

    /// The brokers of a topic's subscribers; that of the simulator if no node says that it subscribes to it.
    pub fn subscribers(&self, plan: &CampaignPlan, topic: TopicId) -> BTreeSet<BrokerAt> {
        self.brokers_of(plan, |node| node.subscribes(topic))
    }

    fn brokers_of(&self, plan: &CampaignPlan, is: impl Fn(&crate::Node) -> bool) -> BTreeSet<BrokerAt> {
        let nodes = (0..).map(NodeId).zip(&plan.nodes).filter(|(_, node)| is(node));
        let brokers: BTreeSet<BrokerAt> = nodes.map(|(id, _)| self.of(id)).collect();
        if brokers.is_empty() { BTreeSet::from([0]) } else { brokers }
    }
}
