//! The start of a system: whoever appears is connected, until everything is there.

use std::time::Duration;

use sesame_base::gathered::gathered;
use sesame_lifecycle::launch::{LaunchError, Launched, Probe};
use sesame_plan::CampaignPlan;
use sesame_relay::transport::TransportError;

use super::service::Client;
use super::session::{ClockReader, Connected, Session, Stepper};
use super::wall_clock::{SETTLE, now};
use crate::dds::{DdsError, Endpoint, Sample, mirrored};
use crate::graph::NodeEntities;
use crate::names;

/// How often it is looked who is there while nothing else happens.
const LOOK: Duration = Duration::from_millis(20);

/// How long nobody may appear or leave before a system that is ready, and lacks something because of a node that is
/// there, is given up: those that are started together appear within such a time, and nothing else will mend it.
const STANDS: Duration = Duration::from_secs(3);

impl Session {
    /// Connects to whoever has appeared; true if somebody new was found.
    pub(super) fn discover(&mut self) -> Result<bool, DdsError> {
        let (publishers, subscribers) = (self.publishers(), self.subscribers());
        let mut found = false;
        for connected in &mut self.lines {
            let Connected { line, type_name, readers, writers, qos, .. } = connected;
            for (source, reader) in line.sources.iter().zip(readers.iter_mut()) {
                let topic = names::topic(&source.path);
                let of_topic = publishers.iter().filter(|endpoint| endpoint.topic == topic);
                let fitting: Vec<&Endpoint> = of_topic.filter(|endpoint| endpoint.type_name == *type_name).collect();
                if reader.is_none() && !fitting.is_empty() {
                    *qos = mirrored(fitting.iter().map(|endpoint| &endpoint.qos));
                    *reader = Some(self.dds.read(&topic, type_name, qos)?);
                    found = true;
                }
            }
            // What only the runner publishes has no quality of service to take, and a guest waits for nobody.
            if !line.cut || readers.is_empty() || readers.iter().any(Option::is_some) {
                for (sink, writer) in line.sinks.iter().zip(writers.iter_mut()).filter(|(_, writer)| writer.is_none()) {
                    *writer = Some(self.dds.publish(&names::topic(&sink.path), type_name, qos)?);
                    found = true;
                }
            }
        }
        for service in &mut self.services {
            found |= service.offer(&publishers, &subscribers, &mut self.dds)?;
        }
        if let ClockReader::Topic { path, reader: reader @ None } = &mut self.clock {
            let topic = names::topic(path);
            let mut clocks = publishers.iter().filter(|endpoint| endpoint.topic == topic).peekable();
            if clocks.peek().is_some() {
                let qos = mirrored(clocks.map(|endpoint| &endpoint.qos));
                *reader = Some(self.dds.read(&topic, &names::type_name("rosgraph_msgs/msg/Clock"), &qos)?);
                found = true;
            }
        }
        let stepper = if let Stepper::Service(caller) = &mut self.step { Some(caller) } else { None };
        for caller in self.reset.iter_mut().chain(stepper) {
            if caller.client.is_none() {
                caller.client = Client::connect(&caller.path, &subscribers, &publishers, &mut self.dds)?;
                found |= caller.client.is_some();
            }
        }
        if let Stepper::Topic { path, writer: writer @ None } = &mut self.step {
            let topic = names::topic(path);
            if subscribers.iter().any(|endpoint| endpoint.topic == topic) {
                *writer = Some(self.dds.publish(&topic, &names::type_name("std_msgs/msg/Empty"), &mirrored([]))?);
                found = true;
            }
        }
        if found {
            self.announce()?;
        }
        Ok(found)
    }

    /// Says what node this is, so that it is visible in the graph.
    fn announce(&self) -> Result<(), DdsError> {
        let readers = self.lines.iter().flat_map(|connected| connected.readers.iter().flatten());
        let writers = self.lines.iter().flat_map(|connected| connected.writers.iter().flatten());
        let node = NodeEntities {
            name: self.name.clone(),
            readers: readers.filter_map(|&reader| self.dds.reader_guid(reader)).map(|guid| guid.to_bytes()).collect(),
            writers: writers.filter_map(|&writer| self.dds.writer_guid(writer)).map(|guid| guid.to_bytes()).collect(),
        };
        if let Some(sample) = self.info.write(self.dds.guid().to_bytes(), &node) {
            self.dds.write(self.info_writer, Sample(sample), None)?;
        }
        Ok(())
    }

    /// Whether something has happened that programs are awaited for.
    fn shows(&self, probe: Probe) -> bool {
        match probe {
            Probe::Topic(topic) => self.heard.contains(&topic),
            Probe::Clock => self.ticks.is_some_and(|(first, latest)| latest > first),
        }
    }

    /// Waits until the launched programs are ready, everything is there, and nobody has appeared for a moment. Messages
    /// from before are passed on.
    pub(super) fn assemble(
        &mut self,
        plan: &CampaignPlan,
        launched: &mut Launched,
        within: Duration,
    ) -> Result<(), TransportError> {
        let mut changed = now();
        let mut ready_since = None;
        let mut known = (0, 0);
        loop {
            let found = self.discover()?;
            let count = (self.publishers().len(), self.subscribers().len());
            if found || count != known {
                known = count;
                changed = now();
            }
            // Programs have limits of their own; the system as a whole has one from when they are ready.
            if ready_since.is_none() && launched.poll_ready(&mut |probe| self.shows(probe))? {
                ready_since = Some(now());
            }
            launched.check()?;
            let missing = self.missing(plan);
            launched.lacks(&missing);
            if let Some(since) = ready_since {
                if missing.is_empty() && changed.elapsed() >= SETTLE {
                    break;
                }
                let stands = changed.elapsed().min(since.elapsed()) >= STANDS;
                if stands
                    && !missing.is_empty()
                    && let Some(error) = self.named(Session::hopeless)?
                {
                    return Err(error);
                }
                if since.elapsed() >= within {
                    if let Some(not_cut) = self.named(Session::not_cut)? {
                        return Err(TransportError::Wiring(not_cut));
                    }
                    let lacks = missing.is_empty().then(|| "its nodes keep changing".to_owned());
                    let wrong = self.named(|session, name| session.wrong_types(false, name))?;
                    let why: Vec<String> =
                        missing.into_iter().chain(lacks).chain(wrong).chain(self.notes.drain(..)).collect();
                    return Err(TransportError::from(LaunchError::Failed {
                        what: "the system".to_owned(),
                        problem: format!("is not complete after {} s: {}", within.as_secs(), gathered(&why).join("; ")),
                        last_lines: String::new(),
                    }));
                }
            }
            for incoming in self.wait(Some(LOOK))? {
                self.pass_on(incoming)?;
            }
        }
        if let Some(not_cut) = self.named(Session::not_cut)? {
            return Err(TransportError::Wiring(not_cut));
        }
        let notes = self.named(|session, name| {
            [session.wrong_types(false, name), session.unmatched(name), session.crowded(plan, name)].concat()
        })?;
        for note in notes {
            self.note(note);
        }
        Ok(())
    }
}
