//! The smallest set of leaves that forces a node, by branch and bound.
//!
//! The bound of a gate is what its cheapest parts cost: their sum where no leaf can serve two parts, otherwise the
//! dearest of them. So on a tree, where each leaf is read once, the first set that is tried is the smallest.

use crate::circuit::{Circuit, NodeIndex};

/// How many sets of choices are looked at before the search is given up.
const PATIENCE: u32 = 20_000;

/// More than any set has.
const NEVER: u32 = u32::MAX / 2;

/// A smallest set of leaves, in order, and whether that is proved. `leaf` says which nodes count as leaves besides
/// those without parts, `candidate` which leaves may be in the set. If `holds`, the set forces the root to hold,
/// otherwise it forces it not to.
pub(super) fn smallest(
    circuit: &Circuit,
    root: NodeIndex,
    leaf: &dyn Fn(NodeIndex) -> bool,
    candidate: &dyn Fn(NodeIndex) -> bool,
    holds: bool,
) -> (Vec<NodeIndex>, bool) {
    let mut search = Search::new(circuit, root, leaf, candidate, holds);
    search.branch(0);
    let proved = search.patience > 0;
    if !proved {
        search.leave_out();
    }
    let set = search.best.unwrap_or_default();
    let mut set: Vec<NodeIndex> = set.into_iter().map(|at| search.gates[at].node).collect();
    set.sort_unstable();
    (set, proved)
}

/// A node that the root reaches.
struct Gate {
    node: NodeIndex,
    /// How many parts are needed; 0 for a leaf.
    need: usize,
    /// Parts by position, which is before this one's.
    parts: Vec<usize>,
    /// Whether no leaf serves two parts.
    disjoint: bool,
}

#[derive(Clone, Copy, PartialEq)]
enum Choice {
    Open,
    Chosen,
    Banned,
}

struct Search {
    /// All nodes that matter, each after its parts: the last one is the root.
    gates: Vec<Gate>,
    choices: Vec<Choice>,
    /// Per node: at least so many more leaves are needed for it.
    costs: Vec<u32>,
    best: Option<Vec<usize>>,
    patience: u32,
}

impl Search {
    fn new(
        circuit: &Circuit,
        root: NodeIndex,
        leaf: &dyn Fn(NodeIndex) -> bool,
        candidate: &dyn Fn(NodeIndex) -> bool,
        holds: bool,
    ) -> Self {
        let mut gates: Vec<Gate> = Vec::new();
        let mut place = vec![None; circuit.size()];
        let mut supports: Vec<Vec<u64>> = Vec::new();
        // A node is left for the second time when all its parts have their places.
        let mut waiting = vec![(root, false)];
        while let Some((node, left)) = waiting.pop() {
            if place[node as usize].is_some() {
                continue;
            }
            let threshold = circuit.threshold(node).filter(|_| node == root || !leaf(node));
            if let (Some((_, parts)), false) = (threshold, left) {
                waiting.push((node, true));
                waiting.extend(parts.iter().rev().map(|&part| (part, false)));
                continue;
            }
            let at = gates.len();
            place[node as usize] = Some(at);
            let Some((need, parts)) = threshold else {
                gates.push(Gate { node, need: 0, parts: Vec::new(), disjoint: true });
                let mut support = vec![0; at / 64 + 1];
                support[at / 64] = 1 << (at % 64);
                supports.push(if candidate(node) { support } else { Vec::new() });
                continue;
            };
            let need = if holds { need } else { parts.len() + 1 - need };
            let parts: Vec<usize> = parts.iter().filter_map(|&part| place[part as usize]).collect();
            let mut union: Vec<u64> = Vec::new();
            let mut disjoint = true;
            for &part in &parts {
                let support = &supports[part];
                union.resize(union.len().max(support.len()), 0);
                for (all, more) in union.iter_mut().zip(support) {
                    disjoint &= *all & more == 0;
                    *all |= more;
                }
            }
            supports.push(union);
            gates.push(Gate { node, need, parts, disjoint });
        }
        let choice = |gate: &Gate| {
            if gate.need == 0 && !candidate(gate.node) { Choice::Banned } else { Choice::Open }
        };
        let choices = gates.iter().map(choice).collect();
        Search { costs: vec![0; gates.len()], choices, gates, best: None, patience: PATIENCE }
    }

    /// Computes all costs; returns the root's.
    fn bound(&mut self) -> u32 {
        let mut cheapest = Vec::new();
        for (at, gate) in self.gates.iter().enumerate() {
            self.costs[at] = if gate.need == 0 {
                match self.choices[at] {
                    Choice::Open => 1,
                    Choice::Chosen => 0,
                    Choice::Banned => NEVER,
                }
            } else {
                cheapest.clear();
                cheapest.extend(gate.parts.iter().map(|&part| self.costs[part]));
                cheapest.sort_unstable();
                if gate.disjoint {
                    cheapest[..gate.need].iter().fold(0, |sum: u32, cost| sum.saturating_add(*cost).min(NEVER))
                } else {
                    cheapest[gate.need - 1]
                }
            };
        }
        self.costs.last().copied().unwrap_or(0)
    }

    /// Looks for sets smaller than the best one among those that follow from the choices made.
    fn branch(&mut self, chosen: usize) {
        if self.patience == 0 {
            return;
        }
        self.patience -= 1;
        let cost = self.bound();
        let limit = self.best.as_ref().map_or(NEVER as usize, Vec::len);
        if cost >= NEVER || chosen + cost as usize >= limit {
            return;
        }
        if cost == 0 {
            self.best = Some((0..self.gates.len()).filter(|&at| self.choices[at] == Choice::Chosen).collect());
            return;
        }
        let leaf = self.open_leaf();
        for (choice, more) in [(Choice::Chosen, 1), (Choice::Banned, 0)] {
            self.choices[leaf] = choice;
            self.branch(chosen + more);
        }
        self.choices[leaf] = Choice::Open;
    }

    /// The first leaf that the cheapest way to the root lacks.
    fn open_leaf(&self) -> usize {
        let mut at = self.gates.len() - 1;
        while self.gates[at].need > 0 {
            let lacking = self.gates[at].parts.iter().copied().filter(|&part| self.costs[part] > 0);
            at = lacking.min_by_key(|&part| self.costs[part]).expect("a gate that costs something lacks a part");
        }
        at
    }

    /// Leaves out of the best set what is not needed.
    fn leave_out(&mut self) {
        let Some(mut best) = self.best.take() else { return };
        for choice in self.choices.iter_mut().filter(|choice| **choice != Choice::Banned) {
            *choice = Choice::Banned;
        }
        for &leaf in &best {
            self.choices[leaf] = Choice::Chosen;
        }
        best.retain(|&leaf| {
            self.choices[leaf] = Choice::Banned;
            let needed = self.bound() > 0;
            if needed {
                self.choices[leaf] = Choice::Chosen;
            }
            needed
        });
        self.best = Some(best);
    }
}
