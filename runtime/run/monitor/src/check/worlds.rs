//! What evidence can be at a moment, for each kind of moment that questions are about, and what follows for guarantees.

use std::collections::{BTreeMap, BTreeSet};

use sesame_base::time::SimTime;
use sesame_plan::{Condition, Evidence, Input, Monitor, MonitorId, StaleIs};

use super::atoms::{Atoms, Values};
use super::condition::{Reader, Sure};
use super::logic::Literal;
use super::solver::{Answer, solve};
use super::theory::Theory;
use super::witness::{self, Value};
use super::{When, Witness};
use crate::network::{EvidenceId, Network};
use crate::truth::Truth;
use crate::why::Moment;

/// The share of all work that one question may take.
const ONE_QUESTION: u64 = 10;

/// The moments that a question is about.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub(super) enum Sight {
    /// Evidence is what its condition says.
    Settled,
    /// All evidence is known and fresh, but it may not have been held for long enough.
    Fresh,
    /// Any moment: evidence may be unknown, stale, or not held for long enough.
    Possible,
}

/// Literals for everything, and answers.
pub(super) struct Worlds<'a> {
    network: &'a Network,
    evidence: Vec<&'a Evidence>,
    atoms: Atoms,
    theory: Theory,
    /// Texts exclude each other.
    laws: Vec<Literal>,
    /// Per evidence: its condition, if what is not looked into may be anything, and if it is never sure.
    free: Vec<Literal>,
    sure: Vec<Sure>,
    /// Per sight and evidence: that it is true.
    seen: BTreeMap<Sight, Vec<Literal>>,
    /// Per sight and node of the network's circuit: that it is true.
    nodes: BTreeMap<Sight, Vec<Literal>>,
    /// What each piece of evidence reads: inputs, and topics by side.
    reads: Vec<(BTreeSet<usize>, BTreeSet<String>)>,
    work: u64,
    /// How much work all questions together may take.
    limit: u64,
}

impl<'a> Worlds<'a> {
    pub(super) fn new(
        network: &'a Network,
        monitors: &'a [Monitor],
        values: &'a dyn Fn(&Input) -> Values,
        limit: u64,
    ) -> Self {
        let mut atoms = Atoms::new();
        let evidence: Vec<&Evidence> = monitors.iter().flat_map(|monitor| &monitor.evidence).collect();
        // All inputs first: whether values of one prove anything depends on which others there are.
        let mut reads = Vec::new();
        for (id, evidence) in (0..).map(EvidenceId).zip(&evidence) {
            let inputs = evidence.inputs.iter().map(|input| atoms.input(id, evidence.side, input)).collect();
            reads.push((inputs, BTreeSet::new()));
        }
        let (mut free, mut sure) = (Vec::new(), Vec::new());
        for (id, evidence) in (0..).map(EvidenceId).zip(&evidence) {
            let mut read = |free| {
                let atoms = &mut atoms;
                Reader { atoms, evidence, id, values, free }.condition(&evidence.condition)
            };
            free.push(read(true).holds);
            sure.push(read(false));
        }
        let laws = atoms.laws();
        let mut fresh = Vec::new();
        let mut possible = Vec::new();
        for (id, evidence) in (0..).map(EvidenceId).zip(&evidence) {
            let at = id.index();
            let steady = (evidence.held > 0.0).then(|| atoms.named(format!("steady {at}")));
            let is_fresh = evidence.stale.map(|_| atoms.named(format!("fresh {at}")));
            let (known, topics) = known(&mut atoms, evidence, id, values);
            reads[at].1 = topics;
            fresh.push(atoms.logic.all([free[at]].into_iter().chain(steady)));
            possible.push(atoms.logic.all([free[at]].into_iter().chain(steady).chain(is_fresh).chain(known)));
        }
        let theory = Theory::new(&atoms.terms, &atoms.orders).expect("an input has at least one value");
        let seen = [(Sight::Settled, free.clone()), (Sight::Fresh, fresh), (Sight::Possible, possible)];
        let mut worlds = Worlds {
            network,
            evidence,
            atoms,
            theory,
            laws,
            free,
            sure,
            seen: BTreeMap::from(seen),
            nodes: BTreeMap::new(),
            reads,
            work: 0,
            limit,
        };
        // What always holds is held for long enough at some time, and from then on.
        for at in 0..worlds.evidence.len() {
            if worlds.evidence[at].held > 0.0 && matches!(worlds.ask(&[!worlds.free[at]]), Answer::No) {
                worlds.seen.entry(Sight::Fresh).or_default()[at] = Literal::TRUE;
            }
        }
        for sight in [Sight::Settled, Sight::Fresh, Sight::Possible] {
            let evidence = worlds.seen[&sight].clone();
            let nodes = worlds.circuit(&evidence);
            worlds.nodes.insert(sight, nodes);
        }
        worlds
    }

    /// Adds that evidence is true when other evidence is that says more, reads all that it reads, must be held at least
    /// as long, is stale at least as early, and does not change later in an instant: what reads several topics changes
    /// at its end.
    pub(super) fn add_implications(&mut self) {
        for more in 0..self.evidence.len() {
            for less in 0..self.evidence.len() {
                let (a, b) = (self.evidence[more], self.evidence[less]);
                let early = match (a.stale, b.stale) {
                    (_, None) => true,
                    (Some(a), Some(b)) => {
                        a.after <= b.after && (a.all <= b.all) && self.reads[more].1 == self.reads[less].1
                    }
                    (None, Some(_)) => false,
                };
                let free_to_fall = b.held > 0.0 || b.stale.is_some();
                let together = self.reads[less].1.len() > 1 || self.reads[more].1 == self.reads[less].1;
                if more == less || !free_to_fall || !early || !together || a.held < b.held {
                    continue;
                }
                if !self.reads[less].0.is_subset(&self.reads[more].0)
                    || !self.reads[less].1.is_subset(&self.reads[more].1)
                {
                    continue;
                }
                if matches!(self.ask(&[self.free[more], !self.free[less]]), Answer::No) {
                    for sight in [Sight::Fresh, Sight::Possible] {
                        let (a, b) = (self.seen[&sight][more], self.seen[&sight][less]);
                        let law = self.atoms.logic.any([!a, b]);
                        self.laws.push(law);
                    }
                }
            }
        }
    }

    /// The work that all questions took.
    pub(super) fn work(&self) -> u64 {
        self.work
    }

    /// Whether these can hold together.
    pub(super) fn ask(&mut self, goals: &[Literal]) -> Answer {
        if goals.contains(&Literal::FALSE) {
            return Answer::No;
        }
        let patience = (self.limit / ONE_QUESTION).min(self.limit.saturating_sub(self.work));
        if patience == 0 {
            return Answer::GivenUp;
        }
        let theory = self.theory.clone();
        solve(&self.atoms.logic, &self.atoms.comparisons, theory, goals, &self.laws, patience, &mut self.work)
    }

    /// That a piece of evidence is true at any moment.
    pub(super) fn evidence(&self, evidence: EvidenceId) -> Literal {
        self.seen[&Sight::Possible][evidence.index()]
    }

    /// That the guarantees of a monitor hold.
    pub(super) fn guarantees(&self, monitor: MonitorId, sight: Sight) -> Vec<Literal> {
        self.of_guarantees(monitor, &self.nodes[&sight])
    }

    /// That the guarantees of a monitor hold at any moment, if a piece of its evidence is replaced by a constant.
    pub(super) fn guarantees_if(&mut self, monitor: MonitorId, evidence: EvidenceId, holds: bool) -> Vec<Literal> {
        let mut seen = self.seen[&Sight::Possible].clone();
        seen[evidence.index()] = if holds { Literal::TRUE } else { Literal::FALSE };
        let nodes = self.circuit(&seen);
        self.of_guarantees(monitor, &nodes)
    }

    fn of_guarantees(&self, monitor: MonitorId, nodes: &[Literal]) -> Vec<Literal> {
        let positions = 0..self.network.guarantees(monitor);
        positions.map(|at| nodes[self.network.guarantee_node(monitor, at) as usize]).collect()
    }

    /// That the nodes of the circuit are true, from that evidence is.
    fn circuit(&mut self, evidence: &[Literal]) -> Vec<Literal> {
        let circuit = self.network.circuit();
        let mut nodes = vec![Literal::FALSE; circuit.size()];
        nodes[..evidence.len()].copy_from_slice(evidence);
        for &node in circuit.order() {
            let (need, parts) = circuit.threshold(node).expect("nodes in the order have parts");
            nodes[node as usize] = self.atoms.logic.at_least(need, parts.iter().map(|&part| nodes[part as usize]));
        }
        nodes
    }

    /// Moments at which it is known which evidence is true, from what conditions say: each really happens.
    pub(super) fn moments(&self) -> Vec<When> {
        let mut held: Vec<SimTime> = vec![SimTime::ZERO];
        held.extend(self.evidence.iter().map(|evidence| SimTime::from_seconds(evidence.held)));
        held.sort_unstable();
        held.dedup();
        // After the longest, all is settled.
        held.pop();
        let silent = self.evidence.iter().any(|evidence| evidence.stale.is_some()).then_some(When::Silent);
        [When::Settled].into_iter().chain(silent).chain(held.into_iter().map(When::Started)).collect()
    }

    /// That a guarantee holds for sure, and that a weaker one does not, at such a moment.
    pub(super) fn sure(&mut self, monitor: MonitorId, when: &When, stronger: u32, weaker: u32) -> [Literal; 2] {
        let sure: Vec<Sure> = (0..self.evidence.len())
            .map(|at| match falls(self.evidence[at], *when) {
                Some(_) => Sure { holds: Literal::FALSE, fails: Literal::TRUE },
                None => self.sure[at],
            })
            .collect();
        let holds: Vec<Literal> = sure.iter().map(|sure| sure.holds).collect();
        let may_hold: Vec<Literal> = sure.iter().map(|sure| !sure.fails).collect();
        let (holds, may_hold) = (self.circuit(&holds), self.circuit(&may_hold));
        let node = |at| self.network.guarantee_node(monitor, at) as usize;
        [holds[node(stronger)], !may_hold[node(weaker)]]
    }

    /// Values under which that is so, and the moment that they make; `None` if none were found, because numbers that
    /// are exact in theory are rounded.
    pub(super) fn witness(
        &self,
        when: &When,
        found: &[Option<bool>],
        theory: &Theory,
    ) -> Option<(Witness, Moment<'a>)> {
        let values = witness::values(&self.atoms, found, theory)?;
        let known = |id: EvidenceId, at: u32| {
            let declared = self.evidence[id.index()];
            let input = self.atoms.find(id, declared.side, &declared.inputs[at as usize])?;
            values.get(&input).filter(|_| !self.atoms.inputs[input].loose).cloned()
        };
        let truths: Vec<Truth> = self
            .evidence
            .iter()
            .zip((0..).map(EvidenceId))
            .map(|(evidence, id)| {
                let raw = witness::truth(&evidence.condition, evidence, &|input| known(id, input));
                match falls(evidence, *when) {
                    Some(truth) if raw == Truth::True || *when == When::Silent => truth,
                    _ => raw,
                }
            })
            .collect();
        let moment = Moment::new(self.network, |evidence| truths[evidence.index()]);
        let inputs = values.into_iter().map(|(input, value)| {
            let known = &self.atoms.inputs[input];
            (known.side, known.input.clone(), value)
        });
        Some((Witness { when: *when, inputs: inputs.collect::<Vec<(_, _, Value)>>(), evidence: truths }, moment))
    }
}

/// What evidence is at such a moment although its condition may hold; `None` if it is what its condition says.
fn falls(evidence: &Evidence, when: When) -> Option<Truth> {
    match when {
        When::Settled => None,
        When::Started(after) => (SimTime::from_seconds(evidence.held) > after).then_some(Truth::False),
        When::Silent => evidence.stale.map(|stale| match stale.is {
            StaleIs::False => Truth::False,
            StaleIs::Unknown => Truth::Unknown,
        }),
    }
}

/// That everything that evidence reads is known, and the topics that it reads.
fn known(
    atoms: &mut Atoms,
    evidence: &Evidence,
    id: EvidenceId,
    values: &dyn Fn(&Input) -> Values,
) -> (Vec<Literal>, BTreeSet<String>) {
    let mut flags = BTreeSet::new();
    collect_flags(&evidence.condition, &mut flags);
    let mut known = Vec::new();
    let mut topics = BTreeSet::new();
    for (at, input) in (0..).zip(&evidence.inputs) {
        let number = atoms.input(id, evidence.side, input);
        let topic = if values(&atoms.inputs[number].input).group {
            format!("heard input {number}")
        } else {
            format!("heard {:?} {:?}", evidence.side, input.field.topic)
        };
        known.push(atoms.named(topic.clone()));
        topics.insert(topic);
        if !flags.contains(&at) {
            known.push(atoms.named(format!("finite {number}")));
        }
    }
    (known, topics)
}

/// Inputs that are true or false.
fn collect_flags(of: &Condition, flags: &mut BTreeSet<u32>) {
    match of {
        Condition::Constant(_) | Condition::Compare { .. } => {}
        Condition::Input(at) => _ = flags.insert(*at),
        Condition::Same { left, right } => [left, right].into_iter().for_each(|part| collect_flags(part, flags)),
        Condition::All(parts) | Condition::Any(parts) => parts.iter().for_each(|part| collect_flags(part, flags)),
        Condition::Not(of) => collect_flags(of, flags),
    }
}
