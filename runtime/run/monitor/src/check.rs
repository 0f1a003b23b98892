//! Whether certificates say anything: guarantees that can never hold, always hold, or are never the state; evidence
//! that decides nothing; and orders that contradict what they promise.
//!
//! Decided exactly, through demands, with what evidence has to do with each other because it reads the same values:
//! `p > 5bar` and `p < 3bar` exclude each other. Not by patterns: each question is whether some formula over the
//! comparisons in all conditions can hold, which is searched to the end. What the search cannot decide within a bound
//! on its work is listed as undecided, never as a finding.
//!
//! **What is known of conditions.** Comparisons of inputs, sums of an input and constants, multiples of an input, and
//! differences of two inputs, all in floating point; inputs that are true or false; texts; minima, maxima and absolute
//! values of these. Functions, products of inputs, points, the time, and values of single members of groups are not
//! looked into: equal expressions have equal values, and that is all.
//!
//! **No finding is false.** Findings that say *never* or *always* hold whatever the numbers are that are not looked
//! into, and whatever evidence is stale, not held for long enough or not known yet, as far as they speak of such
//! moments; more than what can happen is considered. Findings that say that something *may happen* have a witness:
//! values under which the conditions were computed. Less than what can happen is considered.

mod arithmetic;
mod atoms;
mod condition;
mod logic;
mod solver;
mod theory;
mod witness;
mod worlds;

use std::collections::BTreeSet;

use sesame_base::time::SimTime;
use sesame_plan::{Evidence, Gate, Guarantee, Input, Monitor, MonitorId, SafeState, Side};

use crate::network::{EvidenceId, Invalid, Network};
use crate::truth::Truth;
use solver::Answer;
use worlds::{Sight, Worlds};

pub use atoms::Values;
pub use witness::Value;

/// What is wrong with monitors.
#[derive(Debug, Clone, PartialEq)]
pub enum Finding {
    /// This guarantee can never hold.
    Never {
        /// The monitor.
        monitor: MonitorId,
        /// The position of the guarantee.
        guarantee: u32,
    },
    /// This guarantee always holds once each topic has had a message, as long as no evidence is stale and all numbers
    /// are finite.
    Always {
        /// The monitor.
        monitor: MonitorId,
        /// The position of the guarantee.
        guarantee: u32,
    },
    /// This guarantee can hold, but is never the state: whenever it holds, a stronger one does.
    NeverState {
        /// The monitor.
        monitor: MonitorId,
        /// The position of the guarantee.
        guarantee: u32,
        /// Stronger guarantees of which then at least one holds: one if one is enough, otherwise all.
        by: Vec<u32>,
    },
    /// This evidence decides nothing: with a constant in its place the monitor would always be in the same state.
    Redundant {
        /// The monitor.
        monitor: MonitorId,
        /// The position of the evidence.
        evidence: u32,
        /// The constant.
        as_if: bool,
    },
    /// The stronger guarantee may hold while the weaker one does not, although whoever demands the weaker one is
    /// content with the stronger one.
    Order {
        /// The monitor.
        monitor: MonitorId,
        /// The position of the stronger guarantee: the weakest of those that may.
        stronger: u32,
        /// The position of the weaker guarantee.
        weaker: u32,
        /// When that happens.
        witness: Witness,
    },
}

/// A moment at which something happens.
#[derive(Debug, Clone, PartialEq)]
pub struct Witness {
    /// When it is.
    pub when: When,
    /// What inputs are then, each where evidence hears it. Others do not matter.
    pub inputs: Vec<(Side, Input, Value)>,
    /// What evidence is then, by position in the network. Unknown evidence does not matter.
    pub evidence: Vec<Truth>,
}

/// When a witness is.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum When {
    /// Messages with these values have come for so long that all that must be held was held.
    Settled,
    /// So long after the first messages, of one instant, which had these values as all since then.
    Started(SimTime),
    /// All topics have been silent since messages with these values for so long that whatever can be stale is.
    Silent,
}

/// Something that was asked.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Question {
    /// Whether a guarantee can hold: the monitor, and the guarantee's position.
    Never(MonitorId, u32),
    /// Whether a guarantee always holds.
    Always(MonitorId, u32),
    /// Whether a guarantee can be the state.
    NeverState(MonitorId, u32),
    /// Whether evidence decides anything: the monitor, and the evidence's position.
    Redundant(MonitorId, u32),
    /// Whether a guarantee may hold without a weaker one: the monitor, and the weaker guarantee's position.
    Order(MonitorId, u32),
}

/// What a check found.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Report {
    /// What is wrong, by monitor: guarantees from the strongest on, then evidence.
    pub findings: Vec<Finding>,
    /// What was not decided within the bound on the work.
    pub undecided: Vec<Question>,
    /// What would be a finding if values had been found under which it happens: it may be one, or not.
    pub unproven: Vec<Question>,
}

/// How much work a check may take, by default: some seconds.
const PATIENCE: u64 = 50_000_000;

/// Checks monitors, given what is known of the values of inputs (without tests of their texts).
pub fn check(monitors: &[Monitor], values: &dyn Fn(&Input) -> Values) -> Result<Report, Invalid> {
    check_within(monitors, values, &mut { PATIENCE })
}

/// [`check`] with so much work at most, of which the rest is left.
pub fn check_within(
    monitors: &[Monitor],
    values: &dyn Fn(&Input) -> Values,
    work: &mut u64,
) -> Result<Report, Invalid> {
    let network = Network::new(monitors)?;
    let mut checker = Checker {
        worlds: Worlds::new(&network, monitors, values, *work),
        network: &network,
        monitors,
        report: Report::default(),
    };
    checker.worlds.add_implications();
    for monitor in (0..).map(MonitorId).take(monitors.len()) {
        let never = checker.guarantees(monitor);
        checker.orders(monitor, &never);
        checker.evidence(monitor);
    }
    *work = work.saturating_sub(checker.worlds.work());
    Ok(checker.report)
}

/// Whether all of these pieces of evidence can be true at one moment; `None` if that was not decided with so much work,
/// of which the rest is left.
pub fn together(evidence: &[&Evidence], values: &dyn Fn(&Input) -> Values, work: &mut u64) -> Option<bool> {
    if evidence.is_empty() {
        return Some(true);
    }
    let gates: Vec<Gate> = (0..).map(Gate::Evidence).take(evidence.len()).collect();
    let all = Guarantee { name: String::new(), doc: String::new(), integrity: 1, gate: Gate::All(gates) };
    let monitor = Monitor {
        name: String::new(),
        doc: String::new(),
        publishes: None,
        demands: Vec::new(),
        evidence: evidence.iter().copied().cloned().collect(),
        guarantees: vec![all],
        otherwise: SafeState { name: String::new(), doc: String::new(), mitigation: None },
        line: 0,
    };
    let monitors = [monitor];
    let network = Network::new(&monitors).ok()?;
    let mut worlds = Worlds::new(&network, &monitors, values, *work);
    let all = worlds.guarantees(MonitorId(0), Sight::Settled);
    let answer = worlds.ask(&all);
    *work = work.saturating_sub(worlds.work());
    match answer {
        Answer::Yes(..) => Some(true),
        Answer::No => Some(false),
        Answer::GivenUp => None,
    }
}

struct Checker<'a> {
    worlds: Worlds<'a>,
    network: &'a Network,
    monitors: &'a [Monitor],
    report: Report,
}

impl Checker<'_> {
    /// Guarantees that never or always hold, or are never the state. Returns those that never hold.
    fn guarantees(&mut self, monitor: MonitorId) -> BTreeSet<u32> {
        let settled = self.worlds.guarantees(monitor, Sight::Settled);
        let fresh = self.worlds.guarantees(monitor, Sight::Fresh);
        let possible = self.worlds.guarantees(monitor, Sight::Possible);
        let mut never = BTreeSet::new();
        for (at, guarantee) in (0..self.network.guarantees(monitor)).enumerate() {
            match self.worlds.ask(&[settled[at]]) {
                Answer::Yes(..) => {}
                Answer::No => {
                    never.insert(guarantee);
                    self.report.findings.push(Finding::Never { monitor, guarantee });
                    continue;
                }
                Answer::GivenUp => self.report.undecided.push(Question::Never(monitor, guarantee)),
            }
            match self.worlds.ask(&[!fresh[at]]) {
                Answer::Yes(..) => {}
                Answer::No => self.report.findings.push(Finding::Always { monitor, guarantee }),
                Answer::GivenUp => self.report.undecided.push(Question::Always(monitor, guarantee)),
            }
            let stronger: Vec<u32> = (0..guarantee).filter(|stronger| !never.contains(stronger)).collect();
            let without = |of: &[u32]| -> Vec<_> {
                let others = of.iter().map(|&stronger| !possible[stronger as usize]);
                std::iter::once(possible[at]).chain(others).collect()
            };
            match self.worlds.ask(&without(&stronger)) {
                Answer::No if !stronger.is_empty() => {
                    let enough =
                        stronger.iter().copied().find(|&one| matches!(self.worlds.ask(&without(&[one])), Answer::No));
                    let by = enough.map_or(stronger, |one| vec![one]);
                    self.report.findings.push(Finding::NeverState { monitor, guarantee, by });
                }
                Answer::No | Answer::Yes(..) => {}
                Answer::GivenUp => self.report.undecided.push(Question::NeverState(monitor, guarantee)),
            }
        }
        never
    }

    /// Guarantees that may hold without weaker ones.
    fn orders(&mut self, monitor: MonitorId, never: &BTreeSet<u32>) {
        let moments = self.worlds.moments();
        for weaker in 1..self.network.guarantees(monitor) {
            let (mut undecided, mut unproven) = (false, false);
            let found = (0..weaker).rev().filter(|stronger| !never.contains(stronger)).find_map(|stronger| {
                let mut asked = BTreeSet::new();
                moments.iter().find_map(|moment| {
                    let [holds, fails] = self.worlds.sure(monitor, moment, stronger, weaker);
                    if !asked.insert((holds, fails)) {
                        return None;
                    }
                    match self.worlds.ask(&[holds, fails]) {
                        Answer::No => None,
                        Answer::GivenUp => {
                            undecided = true;
                            None
                        }
                        Answer::Yes(found, theory) => {
                            let witness = self.worlds.witness(moment, &found, &theory);
                            let witness = witness.filter(|(_, moment)| {
                                moment.guarantee(monitor, stronger).holds()
                                    && !moment.guarantee(monitor, weaker).holds()
                            });
                            unproven |= witness.is_none();
                            witness.map(|(witness, _)| Finding::Order { monitor, stronger, weaker, witness })
                        }
                    }
                })
            });
            match found {
                Some(finding) => self.report.findings.push(finding),
                None if undecided => self.report.undecided.push(Question::Order(monitor, weaker)),
                None if unproven => self.report.unproven.push(Question::Order(monitor, weaker)),
                None => {}
            }
        }
    }

    /// Evidence that decides nothing.
    fn evidence(&mut self, monitor: MonitorId) {
        for position in (0..).take(self.monitors[monitor.index()].evidence.len()) {
            let id: EvidenceId = self.network.evidence(monitor, position);
            let own = self.worlds.evidence(id);
            let [with, without] = [true, false].map(|holds| self.worlds.guarantees_if(monitor, id, holds));
            let mut undecided = false;
            let replaced = [true, false].into_iter().find(|&as_if| {
                // The state is another one: a guarantee holds only with the evidence, and no stronger one holds anyway.
                let differs = if as_if { !own } else { own };
                let mut anyway = vec![differs];
                let mut can_differ = false;
                for (&with, &without) in with.iter().zip(&without) {
                    anyway.push(!without);
                    if with == without {
                        continue;
                    }
                    let goals: Vec<_> = anyway.iter().copied().chain([with]).collect();
                    match self.worlds.ask(&goals) {
                        Answer::No => {}
                        Answer::Yes(..) => {
                            can_differ = true;
                            break;
                        }
                        Answer::GivenUp => {
                            (can_differ, undecided) = (true, true);
                            break;
                        }
                    }
                }
                !can_differ
            });
            match replaced {
                Some(as_if) => {
                    self.report.findings.push(Finding::Redundant { monitor, evidence: position, as_if });
                }
                None if undecided => self.report.undecided.push(Question::Redundant(monitor, position)),
                None => {}
            }
        }
    }
}
