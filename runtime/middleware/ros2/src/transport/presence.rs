//! Who is there, compared with who should be: what is missing, and what is wrong with those who are there.

use std::cell::Cell;
use std::collections::BTreeSet;
use std::time::{Duration, Instant};

use rustdds::GUID;
use sesame_base::gathered::gathered;
use sesame_lifecycle::launch::LaunchError;
use sesame_plan::{CampaignPlan, NodeId};
use sesame_relay::transport::TransportError;
use sesame_relay::wire::Line;

use super::served::Served;
use super::session::{ClockReader, Connected, Session, Stepper};
use super::wall_clock::now;
use super::watch::{DeclaredEndpoint, Present, Role};
use crate::dds::{DdsError, Endpoint};
use crate::graph::{DISCOVERY_TOPIC, NAMES};
use crate::names;

/// How often it is looked for names meanwhile.
const LOOK: Duration = Duration::from_millis(20);

/// What names the node of a publisher or subscriber.
pub(super) type Name<'a> = &'a dyn Fn(GUID) -> String;

impl Session {
    /// What is judged with the names of nodes: if one is needed that is yet to come, it is awaited for a moment.
    /// Messages meanwhile are passed on.
    pub(super) fn named<T>(&mut self, judge: impl Fn(&Self, Name<'_>) -> T) -> Result<T, DdsError> {
        let limit = now() + NAMES;
        loop {
            let awaited = Cell::new(false);
            let judged = judge(self, &|guid| {
                awaited.set(awaited.get() || self.will_be_named(guid));
                self.name(guid)
            });
            if !awaited.get() || now() >= limit {
                return Ok(judged);
            }
            for incoming in self.wait(Some(LOOK))? {
                self.pass_on(incoming)?;
            }
        }
    }

    /// Begins a run: what was delivered before belongs to none.
    pub(super) fn begin(&mut self, plan: &CampaignPlan) {
        self.services.iter_mut().for_each(Served::begin);
        let mut watch = std::mem::take(&mut self.watch);
        watch.begin(|| self.present(plan));
        self.watch = watch;
    }

    /// Notes who has come and gone since the last look. Of nodes that are `absent`, nothing is expected.
    pub(super) fn look_around(&mut self, plan: &CampaignPlan, now: Instant, absent: &BTreeSet<String>) {
        let present = self.present(plan);
        self.notes.extend(self.watch.look(now, present, absent));
    }

    /// Who is at the wires and at the clock.
    fn present(&self, plan: &CampaignPlan) -> Vec<Present> {
        let mut endpoints = Vec::new();
        let mut declare = |role, path: &str, topic: String, most| {
            endpoints.push(DeclaredEndpoint { role, path: path.to_owned(), topic, most });
        };
        for Connected { line, .. } in &self.lines {
            let declared = declared(plan, line);
            for source in &line.sources {
                let most = if source.publisher.is_some() { 1 } else { declared };
                declare(Role::Publishes, &line.path, names::topic(&source.path), Some(most));
            }
            if line.cut {
                // Whoever publishes there gets past the relay.
                declare(Role::Publishes, &line.path, names::topic(&line.path), Some(0));
                for sink in &line.sinks {
                    declare(Role::Subscribes, &line.path, names::topic(&sink.path), None);
                }
            } else {
                declare(Role::Subscribes, &line.path, names::topic(&line.path), None);
            }
        }
        for service in &self.services {
            declare(Role::Serves, &service.path, names::request(&service.server()), None);
        }
        if let ClockReader::Topic { path, .. } = &self.clock {
            declare(Role::Publishes, path, names::topic(path), None);
        }
        let (publishers, subscribers) = (self.publishers(), self.subscribers());
        let mut present = Vec::new();
        for declared in endpoints {
            let all = if declared.role == Role::Publishes { &publishers } else { &subscribers };
            present.extend(all.iter().filter(|endpoint| endpoint.topic == declared.topic).map(|endpoint| Present {
                guid: endpoint.guid,
                declared: declared.clone(),
                name: self.nodes.name(endpoint.guid).map(str::to_owned),
                will_be_named: self.will_be_named(endpoint.guid),
            }));
        }
        present
    }

    /// The node of a publisher or subscriber; without a name, its participant.
    fn name(&self, guid: GUID) -> String {
        self.nodes.name(guid).map_or_else(|| format!("participant {:?}", guid.prefix), str::to_owned)
    }

    /// Whether the name of its node is yet to come: participants of ROS say the names of their nodes, others never do.
    pub(super) fn will_be_named(&self, guid: GUID) -> bool {
        let of_ros = |endpoint: &Endpoint| endpoint.topic == DISCOVERY_TOPIC && endpoint.guid.prefix == guid.prefix;
        self.nodes.name(guid).is_none() && self.publishers().iter().any(of_ros)
    }

    /// What is equal for endpoints of one node, which may subscribe to a topic more than once: its participant with its
    /// name. Until a name is known that is yet to come, it is the participant; of what never has a name, each endpoint
    /// stands for a node.
    fn one_node(&self, guid: GUID) -> impl Ord {
        let name = self.nodes.name(guid);
        (guid.prefix, name, (name.is_none() && !self.will_be_named(guid)).then_some(guid))
    }

    /// Why the system will not become complete as long as the same nodes are there.
    pub(super) fn hopeless(&self, name: Name<'_>) -> Option<TransportError> {
        if let Some(not_cut) = self.not_cut(name) {
            return Some(TransportError::Wiring(not_cut));
        }
        let wrong = self.wrong_types(true, name);
        (!wrong.is_empty()).then(|| {
            TransportError::from(LaunchError::Failed {
                what: "the system".to_owned(),
                problem: format!("cannot become complete: {}", gathered(&wrong).join("; ")),
                last_lines: String::new(),
            })
        })
    }

    /// What is still missing before time zero, each in a phrase; empty if nothing is.
    pub(super) fn missing(&self, plan: &CampaignPlan) -> Vec<String> {
        let subscribers = self.subscribers();
        let mut missing = Vec::new();
        // A guest waits for nobody at its topics: who comes later is found then.
        for Connected { line, readers, .. } in self.lines.iter().filter(|_| !plan.is_guest()) {
            for (source, reader) in line.sources.iter().zip(readers) {
                if reader.is_none() {
                    let who = source.publisher.map_or("nobody publishes on".to_owned(), |node| {
                        format!("node `{}` does not publish on", plan.node(node).name)
                    });
                    missing.push(format!("{who} `{}`", source.path));
                }
            }
            let (topic, member) = (line.topic, line.member);
            let declared = (0u32..).map(NodeId).zip(&plan.nodes).filter(|(_, node)| node.subscribes_to(topic, member));
            for sink in &line.sinks {
                let expected: Vec<String> = declared
                    .clone()
                    .filter(|(id, _)| match sink.subscriber {
                        Some(subscriber) => subscriber == *id,
                        None => !line.sinks.iter().any(|sink| sink.subscriber == Some(*id)),
                    })
                    .map(|(_, node)| format!("`{}`", node.name))
                    .collect();
                let dds_topic = names::topic(&sink.path);
                let here = subscribers.iter().filter(|endpoint| endpoint.topic == dds_topic);
                let there = here.map(|endpoint| self.one_node(endpoint.guid)).collect::<BTreeSet<_>>().len();
                if there < expected.len() {
                    missing.push(format!(
                        "{there} of {} subscribe to `{}`: {}",
                        expected.len(),
                        sink.path,
                        expected.join(", ")
                    ));
                }
            }
        }
        missing.extend(self.parameters.values().filter_map(|parameters| parameters.missing(&subscribers)));
        missing.extend(self.lifecycles.values().filter_map(|lifecycle| lifecycle.missing(&subscribers)));
        missing.extend(self.services.iter().filter_map(|service| service.missing(&subscribers)));
        if let ClockReader::Topic { path, reader: None } = &self.clock {
            missing.push(format!("nobody publishes the clock `{path}`"));
        }
        let stepper = if let Stepper::Service(caller) = &self.step { Some(caller) } else { None };
        for caller in self.reset.iter().chain(stepper).filter(|caller| caller.client.is_none()) {
            missing.push(format!("nobody serves `{}`", caller.path));
        }
        if let Stepper::Topic { path, writer: None } = &self.step {
            missing.push(format!("nobody subscribes to `{path}`"));
        }
        missing
    }

    /// Where messages get past the relay: who publishes directly on a topic that is cut, and who hears it.
    pub(super) fn not_cut(&self, name: Name<'_>) -> Option<String> {
        let (publishers, subscribers) = (self.publishers(), self.subscribers());
        for service in &self.services {
            if let Some(server) = service.direct_server(&subscribers) {
                return Some(format!(
                    "service `{path}` is not cut: `{}` serves it directly; start the server with `--ros-args -r \
                     {path}:={path}/undisturbed` (`sesamec explain wiring` lists all remappings)",
                    name(server.guid),
                    path = service.path,
                ));
            }
        }
        self.lines.iter().filter(|connected| connected.line.cut).find_map(|Connected { line, .. }| {
            let topic = names::topic(&line.path);
            let publisher = publishers.iter().find(|endpoint| endpoint.topic == topic)?;
            let heard = subscribers.iter().find(|endpoint| endpoint.topic == topic);
            let by = heard.map_or("nobody".to_owned(), |reader| format!("`{}`", name(reader.guid)));
            Some(format!(
                "topic `{path}` is not cut: `{}` publishes on it directly, heard by {by}; start the publisher with \
                 `--ros-args -r {path}:={path}/undisturbed` (`sesamec explain wiring` lists all remappings)",
                name(publisher.guid),
                path = line.path,
            ))
        })
    }

    /// Subscribers that will hear nothing because they ask for more than the publishers offer, each in a sentence.
    pub(super) fn unmatched(&self, name: Name<'_>) -> Vec<String> {
        let subscribers = self.subscribers();
        let mut unmatched = Vec::new();
        for Connected { line, qos, .. } in &self.lines {
            for sink in &line.sinks {
                let topic = names::topic(&sink.path);
                for subscriber in subscribers.iter().filter(|endpoint| endpoint.topic == topic) {
                    if let Some(policy) = qos.compliance_failure_wrt(&subscriber.qos) {
                        unmatched.push(format!(
                            "`{}` hears nothing on `{}`: it asks for another {policy:?} than the publishers offer",
                            name(subscriber.guid),
                            sink.path,
                        ));
                    }
                }
            }
        }
        unmatched
    }

    /// Where more nodes publish than the space declares, each in a sentence.
    pub(super) fn crowded(&self, plan: &CampaignPlan, name: Name<'_>) -> Vec<String> {
        let publishers = self.publishers();
        let mut crowded = Vec::new();
        // A guest does not know how many there are.
        if plan.is_guest() {
            return crowded;
        }
        for Connected { line, .. } in &self.lines {
            let declared = declared(plan, line);
            for source in &line.sources {
                let topic = names::topic(&source.path);
                let there: Vec<&Endpoint> = publishers.iter().filter(|endpoint| endpoint.topic == topic).collect();
                let most = if source.publisher.is_some() { 1 } else { declared };
                if there.len() > most {
                    let mut names: Vec<String> = there.iter().map(|present| name(present.guid)).collect();
                    names.sort_unstable();
                    let names: Vec<String> = names.iter().map(|name| format!("`{name}`")).collect();
                    crowded.push(format!("{} publish on `{}`: {}", names.len(), source.path, names.join(", ")));
                }
            }
        }
        crowded
    }

    /// Who publishes another type than is declared, each in a sentence; if `alone`, only where nobody publishes the
    /// declared one.
    pub(super) fn wrong_types(&self, alone: bool, name: Name<'_>) -> Vec<String> {
        let publishers = self.publishers();
        let mut wrong = Vec::new();
        for Connected { line, interface, type_name, readers, .. } in &self.lines {
            for (source, _) in line.sources.iter().zip(readers).filter(|(_, reader)| !alone || reader.is_none()) {
                let topic = names::topic(&source.path);
                let others =
                    publishers.iter().filter(|publisher| publisher.topic == topic && publisher.type_name != *type_name);
                wrong.extend(others.map(|other| {
                    let found = names::interface(&other.type_name).unwrap_or_else(|| other.type_name.clone());
                    format!("`{}` publishes `{found}` on `{}`; expected `{}`", name(other.guid), source.path, interface)
                }));
            }
        }
        wrong
    }
}

/// How many nodes publish on a line, by what the space declares; without nodes one.
fn declared(plan: &CampaignPlan, line: &Line) -> usize {
    plan.nodes.iter().filter(|node| node.publishes_on(line.topic, line.member)).count().max(1)
}
