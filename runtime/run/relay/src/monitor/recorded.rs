//! What monitors hear in a recording, kept so that they can decide on it again: as it was recorded, or with delays.

use std::collections::{BTreeMap, BTreeSet};
use std::sync::Arc;

use sesame_base::observation::ChangeCause;
use sesame_base::time::SimTime;
use sesame_monitor::difference::Course;
use sesame_monitor::tolerance::{Conditions, RecordedMessage, Recording, Tolerance, tolerances};
use sesame_monitor::{Changes, EvidenceChange, EvidenceId, Network, Reading, Run, Truth};
use sesame_plan::{CampaignPlan, MonitorId, Side};

use super::evidence::{Sources, truth_of};
use crate::metric::{HeardValues, HeldInputs, Memories, Optional, hear};
use crate::value::Value;
use crate::wire::{Wire, WireTable};

/// What monitors hear in a recording.
#[derive(Debug)]
pub struct RecordedMonitors<'p> {
    plan: &'p CampaignPlan,
    wires: &'p WireTable,
    network: Arc<Network>,
    /// Per wire: its position among the paths of its topic.
    members: Vec<usize>,
    streams: Vec<Stream>,
    /// Per wire: the streams of its messages as published and as delivered, where evidence hears them.
    of_wire: Vec<[Option<u32>; 2]>,
    recording: Recording,
    /// Per message: what evidence reads in it.
    contents: Vec<Vec<Content>>,
    /// Of evidence that had a message: which of its inputs a message may lack, and what it remembers.
    readers: BTreeMap<EvidenceId, (Optional, Memories)>,
    /// Per message: its number among those published on its wire.
    indices: Vec<u64>,
    warnings: Vec<String>,
}

/// The messages of a wire on one side.
#[derive(Debug)]
struct Stream {
    wire: Wire,
    /// What hears them.
    evidence: Vec<EvidenceId>,
}

/// What a piece of evidence reads in a message: per input.
type Content = (EvidenceId, HeardValues);

/// What monitors do on a recording.
#[derive(Debug, Clone, PartialEq)]
pub struct Heard {
    /// Changes of evidence, and decisions.
    pub course: Course,
    /// Per change of evidence: what changed it.
    pub causes: Vec<ChangeCause>,
}

impl<'p> RecordedMonitors<'p> {
    /// Before the first message. The network is that of the plan's monitors.
    pub fn new(plan: &'p CampaignPlan, wires: &'p WireTable, network: Arc<Network>) -> Self {
        let members = wires.iter().map(|wire| wires.member(wire)).collect();
        let (mut streams, mut of_wire) = (Vec::<Stream>::new(), vec![[None; 2]; wires.len()]);
        let mut read = vec![Vec::new(); network.evidence_count()];
        for wire in wires.iter() {
            for id in (0..).map(EvidenceId).take(network.evidence_count()) {
                let evidence = evidence_of(plan, &network, id);
                if !evidence.inputs.iter().any(|input| input.reads(wires.topic(wire), wires.member(wire))) {
                    continue;
                }
                let stream = *of_wire[wire.index()][place(evidence.side)].get_or_insert_with(|| {
                    streams.push(Stream { wire, evidence: Vec::new() });
                    u32::try_from(streams.len() - 1).expect("a plan has fewer than 2^31 topics")
                });
                streams[stream as usize].evidence.push(id);
                read[id.index()].push(stream);
            }
        }
        let recording = Recording { messages: Vec::new(), streams: read, end: SimTime::ZERO };
        RecordedMonitors {
            plan,
            wires,
            network,
            members,
            streams,
            of_wire,
            recording,
            contents: Vec::new(),
            readers: BTreeMap::new(),
            indices: Vec::new(),
            warnings: Vec::new(),
        }
    }

    /// Adds a message, as it was published or as it was delivered.
    pub fn add(&mut self, at: SimTime, side: Side, wire: Wire, index: u64, value: &Value) {
        let Some(stream) = self.of_wire[wire.index()][place(side)] else { return };
        let mut content: Vec<Content> = Vec::new();
        let of = (self.wires.topic(wire), self.wires.member(wire));
        for id in self.streams[stream as usize].evidence.clone() {
            let inputs = &evidence_of(self.plan, &self.network, id).inputs;
            let new = || (Optional::new(inputs, self.plan), Memories::new(inputs, self.plan));
            let (optional, memories) = self.readers.entry(id).or_insert_with(new);
            let mut heard = HeardValues::default();
            let read = hear(inputs, optional, of, value, &mut heard);
            if read.is_ok() {
                // Messages of a topic that are late are late together, so what was computed from them stays.
                memories.remember(&mut heard, of.1, at);
            }
            match read {
                Ok(_) if heard.is_nothing() => {}
                Ok(_) => content.push((id, heard)),
                Err(lacking) => self.note(id, wire, &lacking),
            }
        }
        // A message that is delivered at once is one event for both sides.
        let last = self.recording.messages.last().zip(self.indices.last());
        let joined = last.is_some_and(|(last, &number)| {
            let other = &self.streams[last.stream as usize];
            last.at == at && number == index && other.wire == wire && last.stream != stream
        });
        self.recording.messages.push(RecordedMessage { at, stream, joined });
        self.contents.push(content);
        self.indices.push(index);
    }

    /// As a run of the relay does, the first message that lacks a value is noted.
    fn note(&mut self, id: EvidenceId, wire: Wire, lacking: &str) {
        if !self.warnings.is_empty() {
            return;
        }
        let (monitor, at) = self.network.owner(id);
        let monitor = self.plan.monitor(monitor);
        let (name, path) = (&monitor.evidence[at as usize].name, self.wires.path(wire));
        self.warnings.push(format!(
            "monitor `{}`: a message on `{path}` has no value `{lacking}` for `{name}`, which does not hear it; delay \
             tolerances count it as unknown",
            monitor.name
        ));
    }

    /// The recording ends then.
    pub fn end(&mut self, end: SimTime) {
        self.recording.end = end;
    }

    /// The monitors, compiled together.
    pub fn network(&self) -> &Arc<Network> {
        &self.network
    }

    /// What the user should know.
    pub fn warnings(&self) -> &[String] {
        &self.warnings
    }

    /// How many messages monitors hear. One that is heard as it was published and as it was delivered is two.
    pub fn messages(&self) -> usize {
        self.recording.messages.len()
    }

    /// The names on the wire of topics that evidence reads, each with the evidence that reads it, in the order of
    /// topics.
    pub fn topics(&self) -> Vec<(&'p str, Vec<EvidenceId>)> {
        let of_topic = |streams: Vec<u32>| {
            let read = streams.iter().flat_map(|&stream| self.streams[stream as usize].evidence.iter().copied());
            let mut read: Vec<EvidenceId> = read.collect();
            read.sort_unstable();
            (self.wires.path(self.streams[streams[0] as usize].wire), read)
        };
        self.by_wire().into_iter().map(of_topic).collect()
    }

    /// The streams of each wire that evidence hears.
    fn by_wire(&self) -> Vec<Vec<u32>> {
        let all = self.of_wire.iter().map(|sides| sides.iter().flatten().copied().collect());
        all.filter(|streams: &Vec<u32>| !streams.is_empty()).collect()
    }

    /// How late messages of each of the [topics](RecordedMonitors::topics) may be before these monitors decide
    /// otherwise.
    pub fn tolerances(&self, monitors: &[MonitorId]) -> Vec<Tolerance> {
        let by_wire = self.by_wire();
        let sets: Vec<&[u32]> = by_wire.iter().map(Vec::as_slice).collect();
        tolerances(&self.network, &self.recording, &mut Contents(self), &sets, monitors)
    }

    /// What monitors do on the recording.
    pub fn decide(&self) -> Heard {
        let mut found = Heard { course: Course::default(), causes: Vec::new() };
        let mut changes = Changes::default();
        let mut run = Run::start(Arc::clone(&self.network), &mut changes);
        let mut held: Vec<HeldInputs> = (0..)
            .map(EvidenceId)
            .take(self.network.evidence_count())
            .map(|id| HeldInputs::new(&evidence_of(self.plan, &self.network, id).inputs, self.plan))
            .collect();
        let wire_of = |stream: &u32| self.streams[*stream as usize].wire;
        let sources = self.recording.streams.iter().map(|streams| Sources::new(streams.iter().map(wire_of)));
        let mut sources: Vec<Sources> = sources.collect();
        // Per evidence: the position of the last message that it heard.
        let mut latest: Vec<usize> = vec![0; self.network.evidence_count()];
        let by = |latest: &[usize], change: &EvidenceChange| {
            let position = latest[change.evidence.index()];
            let wire = wire_of(&self.recording.messages[position].stream);
            ChangeCause::Message { topic: self.wires.path(wire).to_owned(), index: self.indices[position] }
        };
        let numbered: Vec<(usize, &RecordedMessage)> = self.recording.messages.iter().enumerate().collect();
        for instant in numbered.chunk_by(|(_, one), (_, next)| one.at == next.at) {
            let at = instant[0].1.at;
            found.pass(&mut run, at, &mut changes);
            let mut waiting = BTreeSet::new();
            for event in instant.chunk_by(|_, (_, next)| next.joined) {
                let mut heard: Vec<Reading> = Vec::new();
                for (position, message) in event {
                    let wire = wire_of(&message.stream);
                    for (id, content) in &self.contents[*position] {
                        let evidence = evidence_of(self.plan, &self.network, *id);
                        held[id.index()].hold(&evidence.inputs, content, self.members[wire.index()]);
                        sources[id.index()].spoke(wire, at);
                        latest[id.index()] = event[0].0;
                        if sources[id.index()].are_several() {
                            waiting.insert(*id);
                        } else {
                            heard.push(Reading::now(at, *id, truth_of(evidence, &held[id.index()], at)));
                        }
                    }
                }
                run.observe(at, &heard, &mut changes);
                found.take(&mut changes, Some(&|change| by(&latest, change)));
            }
            let settled = waiting.iter().filter_map(|&evidence| {
                let truth = truth_of(evidence_of(self.plan, &self.network, evidence), &held[evidence.index()], at);
                Some(Reading { evidence, truth, oldest: sources[evidence.index()].oldest()? })
            });
            run.observe(at, &settled.collect::<Vec<_>>(), &mut changes);
            found.take(&mut changes, Some(&|change| by(&latest, change)));
        }
        found.pass(&mut run, self.recording.end, &mut changes);
        found.course.end = self.recording.end;
        found
    }
}

impl Heard {
    /// Timers until this instant, and at it.
    fn pass(&mut self, run: &mut Run, to: SimTime, changes: &mut Changes) {
        run.advance(to, changes);
        self.take(changes, None);
    }

    fn take(&mut self, changes: &mut Changes, message: Option<&dyn Fn(&EvidenceChange) -> ChangeCause>) {
        self.causes.extend(changes.evidence.iter().map(|change| match message {
            Some(message) => message(change),
            None if change.truth == Truth::True => ChangeCause::Held,
            None => ChangeCause::Stale,
        }));
        self.course.take(changes);
    }
}

/// The place of a side among the streams of a wire.
fn place(side: Side) -> usize {
    match side {
        Side::Inbound => 0,
        Side::Outbound => 1,
    }
}

fn evidence_of<'p>(plan: &'p CampaignPlan, network: &Network, id: EvidenceId) -> &'p sesame_plan::Evidence {
    let (monitor, at) = network.owner(id);
    &plan.monitor(monitor).evidence[at as usize]
}

/// Conditions over the messages of a recording.
struct Contents<'a>(&'a RecordedMonitors<'a>);

impl Conditions for Contents<'_> {
    fn truth(&mut self, id: EvidenceId, heard: usize, latest: &[usize]) -> Truth {
        let RecordedMonitors { plan, network, members, streams, recording, contents, .. } = self.0;
        let evidence = evidence_of(plan, network, id);
        let mut held = HeldInputs::new(&evidence.inputs, plan);
        for &message in latest {
            let wire = streams[recording.messages[message].stream as usize].wire;
            for (_, content) in contents[message].iter().filter(|(of, _)| *of == id) {
                held.hold(&evidence.inputs, content, members[wire.index()]);
            }
        }
        truth_of(evidence, &held, recording.messages[heard].at)
    }
}
