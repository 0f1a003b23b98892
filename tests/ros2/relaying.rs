//! A runner between peers, in this process: a space as text, and its system driven by hand or by whole runs.

use std::path::PathBuf;
use std::time::{Duration, Instant};

use sesame_base::observation::Observation;
use sesame_patience::Watch;
use sesame_plan::{CampaignPlan, Test};
use sesame_relay::evaluate::{Custom, Run, evaluate_tapped};
use sesame_relay::metric::MetricTable;
use sesame_relay::relay::{Exchange as _, Finished, Listener, Relay};
use sesame_relay::transport::Transport;
use sesame_relay::transport::relay_latency::AddedOnWire;
use sesame_relay::wire::{Wire, WireTable};
use sesame_tests::{relay_for_a_moment, workspace};
use sesamec::frontend::{Look, SESAME};

use crate::environment::Domain;
use crate::peer::{LIMIT, Peer};

/// The plan of the only campaign in this text.
pub(crate) fn plan(text: &str) -> CampaignPlan {
    let [plan] = &plans("peers.sesame", text)[..] else { panic!("there is one campaign") };
    plan.clone()
}

/// The plans of all campaigns in the text of a file.
pub(crate) fn plans(file: &str, text: &str) -> Vec<CampaignPlan> {
    let checked = (SESAME.check)(file, text, Look::Short);
    assert_eq!(checked.errors, 0, "{text}\n{}", checked.diagnostics);
    checked.plans.into_iter().map(|runner| runner.plan).collect()
}

/// A space in which one topic, `/peer`, is cut, with declarations of nodes and operations, of which one may be named
/// `lost`. A node named `clock` makes it one with a clock. `end` says when a run ends: `2s`, or `9s or when heard > 0`.
pub(crate) fn space(domain: &Domain, kind: &str, nodes: &str, operations: &str, end: &str) -> String {
    format!(
        "space peers\n\
         system {{\n\
           simulator peers = ros2 {{ domain {domain}  {clock} }}\n\
           message Peer = \"{kind}\" {fields}\n\
           topic peer = \"/peer\" : Peer\n\
           {nodes}\n\
         }}\n\
         metric disturbed minimise = fuzzing_time()\n\
         operation hole on peer = blackhole\n\
         {operations}\n\
         campaign look {{\n\
           objectives disturbed\n\
           operations hole{more}   1 per test\n\
           search     random {{ evaluations 1 }}\n\
           end        after {end}\n\
         }}\n",
        domain = domain.number,
        clock = if nodes.contains("clock") { "clock \"/clock\"" } else { "" },
        more = if operations.contains("lost") { ", lost" } else { "" },
        fields = fields(kind),
    )
}

/// The layout of a message of the peers, in the language.
fn fields(kind: &str) -> &'static str {
    match kind {
        "std_msgs/msg/String" => "{ data: text }",
        "std_msgs/msg/Float64" => "{ data: real }",
        "geometry_msgs/msg/PointStamped" => {
            "{ header: Header  point: point }\n\
             message Header = \"std_msgs/msg/Header\" { stamp: real[s]  frame_id: text }"
        }
        "sensor_msgs/msg/JointState" => {
            "{ header: Header  name: list of text  position: list of real  velocity: list of real  effort: list of real }\n\
             message Header = \"std_msgs/msg/Header\" { stamp: real[s]  frame_id: text }"
        }
        _ => "",
    }
}

/// Who publishes and who hears.
pub(crate) struct Exchange<'a> {
    /// The publisher.
    pub(crate) from: &'a Peer,
    /// Publishers that nobody hears, which begin at the same time.
    pub(crate) beside: &'a [&'a Peer],
    /// The subscribers.
    pub(crate) to: &'a [&'a Peer],
    /// After how many messages each subscriber says how many it has heard, if the publisher waits for that: it is told
    /// to go on when all have arrived. Else it publishes all at once.
    pub(crate) batch: Option<u64>,
    /// Whether subscribers are to be told when the first message comes that is no probe.
    pub(crate) begins: bool,
}

impl<'a> Exchange<'a> {
    /// All at once, from one to others.
    pub(crate) fn new(from: &'a Peer, to: &'a [&'a Peer]) -> Self {
        Exchange { from, beside: &[], to, batch: None, begins: false }
    }

    /// Whether all subscribers have heard enough.
    fn have_ended(&self) -> bool {
        self.to.iter().all(|peer| peer.is_done())
    }
}

/// What came of it.
pub(crate) struct Exchanged {
    pub(crate) finished: Finished,
    /// How many messages of the run were probes.
    probes: u64,
}

impl Exchanged {
    /// How many messages there were that count.
    pub(crate) fn messages(&self) -> u64 {
        self.finished.messages - self.probes
    }

    /// How many an operation dropped of those that count, if it dropped all probes.
    pub(crate) fn dropped(&self) -> u64 {
        self.finished.operations[0].counters.dropped - self.probes
    }
}

/// How long the first probe has before a second one is sent. It may be long, as a probe is only needed again if the
/// last one was lost. Each later probe has twice as long as the one before, so that a slow machine catches up with the
/// latest.
const FIRST_WAIT: Duration = Duration::from_secs(1);

/// Sends probes until the latest one has been heard by all.
#[derive(Default)]
struct Probing {
    /// How many the publisher has been told to send, in earlier runs too.
    latest: u64,
    sent: u32,
    begun: Option<Instant>,
    next: Option<Instant>,
}

impl Probing {
    fn is_over(&mut self, from: &Peer, to: &[&Peer]) -> bool {
        let heard: Vec<u64> = to.iter().map(|peer| peer.told("heard")).collect();
        if self.sent > 0 && heard.iter().all(|&latest| latest == self.latest) {
            return true;
        }
        let begun = self.begun.get_or_insert_with(Instant::now);
        assert!(begun.elapsed() < LIMIT, "of {} probes, the latest that each peer heard: {heard:?}", self.latest);
        if self.next.is_none_or(|next| Instant::now() >= next) {
            self.latest = from.probe();
            self.next = Some(Instant::now() + FIRST_WAIT * (1 << self.sent));
            self.sent += 1;
        }
        false
    }
}

/// A system of peers with the runner between them.
pub(crate) struct System {
    plan: CampaignPlan,
    transport: Box<dyn Transport>,
    /// What the transport has noted, and nobody has taken.
    noted: Vec<String>,
    /// Over a transport that does not return from what it does, once it was driven by hand: whole runs may be long. It
    /// is dropped last.
    watch: Option<Watch>,
}

impl System {
    pub(crate) fn new(plan: CampaignPlan) -> Self {
        System::in_folder(plan, workspace().join("tests/ros2"))
    }

    /// One whose plan names files in a folder.
    pub(crate) fn in_folder(plan: CampaignPlan, folder: PathBuf) -> Self {
        let connect = match &plan.simulator.transport {
            sesame_plan::Transport::Rosbridge(_) => sesame_rosbridge::rosbridge(folder),
            _ => sesame_ros2::ros2(folder),
        };
        let transport = connect.transport(&plan);
        System { plan, transport, noted: Vec::new(), watch: None }
    }

    /// A whole run of a test, as campaigns make them, and what the transport noted.
    pub(crate) fn run(&mut self, test: &Test) -> (Observation, Vec<String>) {
        self.run_tapped(test, None)
    }

    /// How long messages were kept since it was asked last.
    pub(crate) fn added(&mut self) -> Vec<AddedOnWire> {
        self.transport.added()
    }

    /// The same, with somebody who listens.
    pub(crate) fn run_tapped(&mut self, test: &Test, tap: Option<&mut dyn Listener>) -> (Observation, Vec<String>) {
        let wires = WireTable::new(&self.plan);
        let metrics = MetricTable::new(&self.plan, &wires, &[]).expect("the metrics need no hooks");
        self.watch = None;
        let (transport, custom) = (&mut *self.transport, &mut Custom::none());
        let run = Run { test, simulator_seed: 1, withheld: &[], lists_altered: false };
        let run = evaluate_tapped(&self.plan, &wires, &metrics, transport, &run, custom, tap);
        (run.expect("the test fits the plan"), self.transport.incidents().notes)
    }

    /// A run that lasts until something holds, which is asked every few milliseconds with what was noted. `ready` is
    /// called when the system is complete.
    pub(crate) fn relay_until(
        &mut self,
        test: &Test,
        ready: impl FnOnce(),
        mut done: impl FnMut(&[String]) -> bool,
    ) -> Finished {
        let mut noted = Vec::new();
        let finished = self.drive(test, ready, |_, transport| {
            noted.append(&mut transport.incidents().notes);
            done(&noted)
        });
        self.noted.append(&mut noted);
        finished
    }

    /// A run that lasts until all peers have heard a probe from the publisher, so that whatever is between them knows
    /// both sides.
    pub(crate) fn introduce(&mut self, from: &Peer, to: &[&Peer]) {
        let mut probing = Probing::default();
        let ready = || [from].iter().chain(to).for_each(|peer| peer.await_match());
        self.relay_until(&Test::default(), ready, |_| probing.is_over(from, to));
    }

    /// A run in which a peer publishes what others are to hear. Before anything counts, probes go all the way: who is
    /// matched on one side may take a moment longer on the other. The run lasts until all subscribers have ended.
    pub(crate) fn exchange(&mut self, test: &Test, exchange: &Exchange<'_>) -> Exchanged {
        self.exchange_until(test, exchange, |_| exchange.have_ended())
    }

    /// The same, until something else holds, which is asked with how many messages that count the runner has seen.
    pub(crate) fn exchange_until(
        &mut self,
        test: &Test,
        exchange: &Exchange<'_>,
        mut done: impl FnMut(u64) -> bool,
    ) -> Exchanged {
        let Exchange { from, beside, to, batch, begins } = *exchange;
        let (mut probing, mut probes, mut batches) = (Probing::default(), None, 0);
        let finished = self.drive(
            test,
            || {
                from.await_match();
                for peer in beside.iter().chain(to) {
                    peer.await_match();
                }
            },
            |seen, _| {
                if probes.is_none() {
                    if !probing.is_over(from, to) {
                        return false;
                    }
                    probes = Some(seen);
                    for peer in to.iter().filter(|_| begins) {
                        peer.go();
                        peer.await_said("begun");
                    }
                    for peer in beside {
                        peer.go();
                    }
                }
                // So few are on their way that no queue between here and there is too short for them.
                let heard = to.iter().map(|peer| peer.told("count")).min().unwrap_or_default();
                if batch.map_or(batches == 0, |batch| heard >= batches * batch) {
                    from.go();
                    batches += 1;
                }
                done(seen - probes.unwrap_or_default())
            },
        );
        Exchanged { finished, probes: probes.unwrap_or_default() }
    }

    /// A run that lasts until something holds, which is asked with how many messages the runner has seen. It fails when
    /// no message comes for longer than peers wait for one, so that a peer that never ends shows where it is.
    fn drive(
        &mut self,
        test: &Test,
        ready: impl FnOnce(),
        mut done: impl FnMut(u64, &mut dyn Transport) -> bool,
    ) -> Finished {
        let wires = WireTable::new(&self.plan);
        let metrics = MetricTable::new(&self.plan, &wires, &[]).expect("the metrics need no hooks");
        let mut relay = Relay::new(&self.plan, &wires, test, metrics.start(), &[]).expect("the test fits the plan");
        let paths = self.plan.topics.iter().flat_map(|topic| &topic.paths);
        let topics: Vec<Wire> = paths.filter_map(|path| wires.find(path)).collect();
        let watch = self.watch.insert(Watch::over("the runner"));
        relay.begin();
        self.transport.reset(1, &mut relay).unwrap_or_else(|error| panic!("{error}"));
        watch.goes_on();
        ready();
        let (mut seen, mut since) = (0, Instant::now());
        loop {
            watch.goes_on();
            let now: u64 = topics.iter().map(|&wire| relay.next_index(wire)).sum();
            if now > seen {
                (seen, since) = (now, Instant::now());
            }
            assert!(since.elapsed() < 2 * LIMIT, "after {seen} messages no more come, and the run is not over");
            if done(seen, &mut *self.transport) {
                return relay.finish(self.transport.now());
            }
            relay_for_a_moment(&mut *self.transport, &mut relay).unwrap_or_else(|error| panic!("{error}"));
        }
    }

    /// Begins a run, which is to fail: how.
    pub(crate) fn reset(&mut self) -> String {
        let wires = WireTable::new(&self.plan);
        let metrics = MetricTable::new(&self.plan, &wires, &[]).expect("the metrics need no hooks");
        let test = Test::default();
        let mut relay = Relay::new(&self.plan, &wires, &test, metrics.start(), &[]).expect("the test fits the plan");
        relay.begin();
        self.transport.reset(1, &mut relay).expect_err("the system is not complete").to_string()
    }

    pub(crate) fn plan(&self) -> &CampaignPlan {
        &self.plan
    }

    /// What the transport noted since the last call, without who has left: peers leave when they have done their part.
    pub(crate) fn notes(&mut self) -> Vec<String> {
        let mut notes = self.all_notes();
        notes.retain(|note| !note.contains("` no longer "));
        notes
    }

    /// What the transport noted since the last call.
    pub(crate) fn all_notes(&mut self) -> Vec<String> {
        self.noted.append(&mut self.transport.incidents().notes);
        std::mem::take(&mut self.noted)
    }
}
