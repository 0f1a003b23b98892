//! Runtime monitors in a run: they hear messages, decide, and say what is to be published.
//!
//! A monitor is a subscriber. Its evidence is evaluated at each message of its topic: as delivered, or as published
//! where the space says `inbound`. A message that is delivered at once is one event for both. Evidence that reads
//! several topics, or several members of a group, is evaluated once per instant, after all its messages.
//!
//! Nothing is published here: whoever runs the monitors takes what is to be published and passes it on, as messages of
//! the same instant. A recording that is fed to metrics takes nothing, because what was published is in it.

mod decided;
mod evidence;
mod outlet;
mod record;
#[cfg(feature = "recordings")]
pub mod recorded;
mod scores;

use std::collections::VecDeque;
use std::sync::Arc;

use sesame_base::observation::{ChangeCause, MetricObservation, MonitorObservation};
use sesame_base::time::SimTime;
use sesame_monitor::{Changes, EvidenceId, Network, Reading, Run, Truth};
use sesame_plan::{CampaignPlan, Evidence, MetricId, MonitorId, Side, TopicId};

use crate::metric::Metrics;
use crate::value::Value;
use crate::wire::{Wire, WireTable};

pub use decided::{Cause, Decided};

use decided::Told;
use evidence::{Came, EvidenceState};
use outlet::Outlets;
use record::Record;
use scores::Scores;

/// The monitors of one run.
pub(crate) struct Monitors<'p> {
    plan: &'p CampaignPlan,
    wires: &'p WireTable,
    /// Per wire: its topic, and its position among the topic's paths.
    members: Vec<(TopicId, usize)>,
    run: Run,
    listeners: Listeners,
    evidence: Vec<EvidenceState<'p>>,
    /// What evidence with one source heard in the event at hand, each at most once, and of which message.
    heard: Vec<(EvidenceId, Truth)>,
    /// The event at hand, and per evidence the last one in which it heard something.
    event: u64,
    last_heard: Vec<u64>,
    message: Option<(Wire, u64)>,
    /// Per evidence with several sources: the last message that it heard.
    latest: Vec<Option<(Wire, u64)>>,
    /// Evidence with several sources that heard something in the instant at hand, each once.
    waiting: Vec<EvidenceId>,
    is_waiting: Vec<bool>,
    /// What these came to. Kept to be used again, like the next.
    settled: Vec<Reading>,
    changes: Changes,
    /// Before this instant no evidence changes if nothing is heard until then.
    due: Option<SimTime>,
    outlets: Outlets<'p>,
    /// What is to be published.
    outbox: VecDeque<(Wire, Value)>,
    record: Record,
    scores: Scores<'p>,
    told: Told,
    /// The first problem with a message.
    problem: Option<String>,
}

/// Per wire: the evidence that hears its messages.
struct Listeners {
    published: Vec<Vec<EvidenceId>>,
    delivered: Vec<Vec<EvidenceId>>,
}

impl Listeners {
    fn new(plan: &CampaignPlan, wires: &WireTable, network: &Network) -> Self {
        let mut listeners =
            Listeners { published: vec![Vec::new(); wires.len()], delivered: vec![Vec::new(); wires.len()] };
        for position in (0..).take(network.evidence_count()) {
            let id = EvidenceId(position);
            let (monitor, at) = network.owner(id);
            let evidence = &plan.monitor(monitor).evidence[at as usize];
            let of = match evidence.side {
                Side::Inbound => &mut listeners.published,
                Side::Outbound => &mut listeners.delivered,
            };
            for wire in read_by(evidence, wires) {
                of[wire.index()].push(id);
            }
        }
        listeners
    }

    fn of(&self, side: Side, wire: Wire) -> &[EvidenceId] {
        match side {
            Side::Inbound => &self.published[wire.index()],
            Side::Outbound => &self.delivered[wire.index()],
        }
    }
}

/// The wires of the topics that evidence reads.
fn read_by<'a>(evidence: &'a Evidence, wires: &'a WireTable) -> impl Iterator<Item = Wire> + use<'a> {
    let reads = |wire| evidence.inputs.iter().any(|input| input.reads(wires.topic(wire), wires.member(wire)));
    wires.iter().filter(move |&wire| reads(wire))
}

impl<'p> Monitors<'p> {
    /// The monitors of the plan of these metrics, at time zero; `None` for a plan without monitors.
    pub(crate) fn new(metrics: &Metrics<'p>, wires: &'p WireTable) -> Option<Self> {
        let (plan, network) = (metrics.plan(), metrics.network()?);
        let members = wires.iter().map(|wire| (wires.topic(wire), wires.member(wire))).collect();
        let all = (0..).take(network.evidence_count()).map(|at| network.owner(EvidenceId(at)));
        let evidence = all.map(|(monitor, at)| &plan.monitor(monitor).evidence[at as usize]);
        let state = |evidence: &'p Evidence| EvidenceState::new(evidence, plan, read_by(evidence, wires));
        let evidence: Vec<_> = evidence.map(state).collect();
        let listeners = Listeners::new(plan, wires, network);
        let mut changes = Changes::default();
        let run = Run::start(Arc::clone(network), &mut changes);
        let mut monitors = Monitors {
            plan,
            wires,
            members,
            run,
            listeners,
            event: 1,
            last_heard: vec![0; evidence.len()],
            latest: vec![None; evidence.len()],
            waiting: Vec::new(),
            is_waiting: vec![false; evidence.len()],
            evidence,
            heard: Vec::new(),
            settled: Vec::new(),
            message: None,
            changes,
            due: None,
            outlets: Outlets::new(plan, wires),
            outbox: VecDeque::new(),
            record: Record::new(plan),
            scores: Scores::new(plan),
            told: Told::new(),
            problem: None,
        };
        monitors.take_changes(None, false);
        monitors.told.only_if_asked();
        Some(monitors)
    }

    /// From now on, decisions are kept until they are [taken](Monitors::take_decided); those of time zero are there.
    pub(crate) fn tell(&mut self) {
        self.told.ask();
    }

    /// Whether there is something to [take](Monitors::take_decided).
    #[inline]
    pub(crate) fn has_decided(&self) -> bool {
        self.told.has_decided()
    }

    /// What was decided since the last call, if [somebody wants to be told](Monitors::tell).
    pub(crate) fn take_decided(&mut self) -> Vec<Decided> {
        self.told.take()
    }

    /// These monitors send no mitigation.
    pub(crate) fn withhold(&mut self, monitors: &[MonitorId]) {
        self.outlets.withhold(monitors);
    }

    /// Whether evidence hears this wire's messages as they are delivered.
    pub(crate) fn hears_delivered(&self, wire: Wire) -> bool {
        !self.listeners.of(Side::Outbound, wire).is_empty()
    }

    /// A message, as it was published or as it is delivered. Nothing is decided before [`Monitors::decide`], or the
    /// next message.
    pub(crate) fn hear(&mut self, now: SimTime, side: Side, wire: Wire, index: u64, value: &Value) {
        if side == Side::Outbound {
            self.outlets.remember(wire, value);
        }
        let count = self.listeners.of(side, wire).len();
        if count == 0 {
            return;
        }
        let again = |id: &EvidenceId| self.last_heard[id.index()] == self.event;
        let other = self.message.is_some_and(|message| message != (wire, index));
        if other || self.listeners.of(side, wire).iter().any(again) {
            self.decide(now);
        }
        self.message = Some((wire, index));
        let member = self.members[wire.index()];
        for at in 0..count {
            let id = self.listeners.of(side, wire)[at];
            let evidence = &mut self.evidence[id.index()];
            match evidence.hear(wire, member, now, value) {
                Err(lacking) => {
                    self.note(id, wire, &lacking);
                }
                Ok(Came::Nothing) => {}
                Ok(Came::Waits) => {
                    self.latest[id.index()] = Some((wire, index));
                    if !std::mem::replace(&mut self.is_waiting[id.index()], true) {
                        self.waiting.push(id);
                    }
                }
                Ok(Came::Truth(truth)) => {
                    self.last_heard[id.index()] = self.event;
                    self.heard.push((id, truth));
                }
            }
        }
    }

    fn note(&mut self, id: EvidenceId, wire: Wire, lacking: &str) {
        let (monitor, at) = self.run.network().owner(id);
        let monitor = self.plan.monitor(monitor);
        let evidence = &monitor.evidence[at as usize].name;
        let path = self.wires.path(wire);
        self.problem.get_or_insert_with(|| {
            format!("monitor `{}`: a message on `{path}` has no value `{lacking}` for `{evidence}`", monitor.name)
        });
    }

    /// Ends an event: monitors decide on what was heard in it.
    pub(crate) fn decide(&mut self, now: SimTime) {
        let Some(message) = self.message.take() else { return };
        self.run.observe_alone(now, &self.heard, &mut self.changes);
        self.heard.clear();
        self.event += 1;
        self.take_changes(Some(message), true);
    }

    /// Whether evidence waits for the end of this instant.
    #[inline]
    pub(crate) fn wait(&self) -> bool {
        !self.waiting.is_empty()
    }

    /// Ends an instant, or goes on to its end after messages that monitors published: they decide on evidence with
    /// several sources. Returns whether there was any.
    pub(crate) fn settle(&mut self, now: SimTime) -> bool {
        self.settle_those(now, |_| true)
    }

    /// As [`Monitors::settle`], of an instant in which the run broke off: evidence of which a source had no message in
    /// it is left out, because that instant was perhaps not over.
    pub(crate) fn settle_whole(&mut self, now: SimTime) -> bool {
        self.settle_those(now, |oldest| oldest == now)
    }

    fn settle_those(&mut self, now: SimTime, counts: impl Fn(SimTime) -> bool) -> bool {
        if self.waiting.is_empty() {
            return false;
        }
        self.decide(now);
        for evidence in self.waiting.drain(..) {
            self.is_waiting[evidence.index()] = false;
            let state = &self.evidence[evidence.index()];
            if let Some(oldest) = state.sources().oldest().filter(|&oldest| counts(oldest)) {
                self.settled.push(Reading { evidence, truth: state.truth(now), oldest });
            }
        }
        self.run.observe(now, &self.settled, &mut self.changes);
        self.settled.clear();
        self.event += 1;
        self.take_changes(None, true);
        true
    }

    /// Evidence that waits is not evaluated any more.
    pub(crate) fn stop_waiting(&mut self) {
        for evidence in self.waiting.drain(..) {
            self.is_waiting[evidence.index()] = false;
        }
    }

    /// Time passes: what is due until this instant, and at it, happens.
    pub(crate) fn advance(&mut self, now: SimTime) {
        if self.due.is_none_or(|due| due > now) {
            return;
        }
        self.run.advance(now, &mut self.changes);
        self.take_changes(None, false);
    }

    /// When something happens next even without a message, other than the [end of an instant](Monitors::wait).
    pub(crate) fn next_due(&self) -> Option<SimTime> {
        self.due.into_iter().chain(self.scores.next_due()).min()
    }

    /// Records what has changed, because of messages or of time, and queues what is to be published.
    fn take_changes(&mut self, message: Option<(Wire, u64)>, by_messages: bool) {
        self.due = self.run.due_not_before();
        // Most messages change nothing.
        if self.changes.is_empty() {
            return;
        }
        let mut changes = std::mem::take(&mut self.changes);
        for change in &changes.evidence {
            let latest = || self.latest[change.evidence.index()].filter(|_| by_messages);
            let cause = match message.or_else(latest) {
                Some((wire, index)) => ChangeCause::Message { topic: self.wires.path(wire).to_owned(), index },
                None if change.truth == Truth::True => ChangeCause::Held,
                None => ChangeCause::Stale,
            };
            self.told.changed(self.run.network(), change, &cause);
            self.record.change(self.run.network(), change, cause);
        }
        for decision in &changes.decisions {
            self.record.decision(decision);
            self.told.decided(decision);
            self.scores.decided(decision);
            self.outlets.publish(self.plan, decision, &mut self.outbox);
        }
        self.scores.changed();
        self.told.end_changes();
        changes.clear();
        self.changes = changes;
    }

    /// The next message that is to be published.
    pub(crate) fn publication(&mut self) -> Option<(Wire, Value)> {
        self.outbox.pop_front()
    }

    /// Whether there is something to publish.
    pub(crate) fn has_publication(&self) -> bool {
        !self.outbox.is_empty()
    }

    /// Nothing more is to be published: returns how many messages are given up.
    pub(crate) fn give_up(&mut self) -> usize {
        std::mem::take(&mut self.outbox).len()
    }

    /// Sets the metrics that are scores to what they are now, if something has changed.
    pub(crate) fn show(&mut self, now: SimTime, metrics: &mut Metrics<'_>) {
        self.scores.show(now, &self.run, metrics);
    }

    /// Sets what grows while time passes.
    pub(crate) fn tick(&mut self, now: SimTime, metrics: &mut Metrics<'_>) {
        self.scores.tick(now, metrics);
    }

    /// Whether a score of time in a state grows now.
    pub(crate) fn grows(&self, metric: MetricId) -> bool {
        self.scores.grows(metric)
    }

    /// Whether a requirement is violated at this moment and was not before. That is a hazard if it is so at the end of
    /// the instant.
    pub(crate) fn sees_hazard(&self, metrics: &Metrics<'_>, fuzzing_time: SimTime) -> bool {
        self.scores.sees_hazard(metrics, fuzzing_time)
    }

    /// The instant is over. Returns whether there was a hazard in it.
    pub(crate) fn end_instant(&mut self, now: SimTime, metrics: &mut Metrics<'_>, fuzzing_time: SimTime) -> bool {
        self.scores.end_instant(now, &self.run, metrics, fuzzing_time)
    }

    /// The run has come to its end, and metrics have their last values.
    pub(crate) fn end(&mut self, now: SimTime, metrics: &mut Metrics<'_>, fuzzing_time: SimTime) {
        self.decide(now);
        self.settle(now);
        self.advance(now);
        self.scores.end(now, &self.run, metrics, fuzzing_time);
    }

    /// The run broke off: scores are what they are now, unless it had come to its end.
    pub(crate) fn break_off(&mut self, now: SimTime, metrics: &mut Metrics<'_>) {
        self.scores.break_off(now, &self.run, metrics);
    }

    /// What the monitors did, and warnings for the user. Scores of requirements whose violation is known only when all
    /// is over are put in their place among the metrics.
    pub(crate) fn finish(
        self,
        end: SimTime,
        metrics: &mut [MetricObservation],
        whole: bool,
    ) -> (Vec<MonitorObservation>, Vec<String>) {
        let hazards = self.scores.finish(end, metrics, whole);
        let mut warnings: Vec<String> = self.problem.into_iter().collect();
        let mut monitors = self.record.finish(&mut warnings);
        for (monitor, hazards) in monitors.iter_mut().zip(hazards) {
            monitor.hazards = hazards;
        }
        (monitors, warnings)
    }
}
