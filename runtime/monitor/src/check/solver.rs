//! Whether literals can hold together: a search for values of the nodes below them that justify each other, with the
//! comparisons of numbers decided on the way (DPLL(T), [Nieuwenhuis et al. 2006]).

use super::logic::{Literal, Logic, Node};
use super::theory::{Comparison, Theory};

/// How many nodes are looked at for one question before it is given up.
const PATIENCE: u64 = 400_000;

/// The answer to a question.
#[derive(Debug)]
pub(super) enum Answer {
    /// They can. The values of nodes, where they matter, and what follows for numbers.
    Yes(Vec<Option<bool>>, Theory),
    /// They cannot.
    No,
    /// Not decided.
    GivenUp,
}

/// Whether these literals can hold together. `comparisons` says, per node, which comparison an atom is; `theory` is what
/// is known of the numbers in them. `laws` always hold; one of which only one part matters says nothing about the goals
/// and must be such that the rest can always be chosen accordingly.
pub(super) fn solve(
    logic: &Logic,
    comparisons: &[Option<Comparison>],
    theory: Theory,
    goals: &[Literal],
    laws: &[Literal],
    work: &mut u64,
) -> Answer {
    let mut solver = Solver::new(logic, comparisons, theory);
    let mut goals = goals.to_vec();
    solver.add_to_what_matters(&goals);
    let mut laws: Vec<Literal> = laws.to_vec();
    let mut before = usize::MAX;
    while goals.len() != before {
        before = goals.len();
        laws.retain(|&law| {
            let Node::AtLeast { parts, .. } = &logic.nodes()[law.node()] else { return false };
            let concerned = parts.iter().filter(|part| solver.matters[part.node()]).count() > 1;
            if concerned {
                goals.push(law);
                solver.add_to_what_matters(&[law]);
            }
            !concerned
        });
    }
    let answer = solver.run(&goals);
    *work += solver.work;
    match answer {
        Some(true) => Answer::Yes(solver.values, solver.theory),
        Some(false) => Answer::No,
        None => Answer::GivenUp,
    }
}

struct Decision {
    /// How many values were set before it.
    trail: usize,
    /// How much was known of numbers before it.
    theory: usize,
    /// What was tried; its negation is next.
    literal: Literal,
    /// Whether the negation is being tried.
    turned: bool,
}

struct Solver<'a> {
    logic: &'a Logic,
    comparisons: &'a [Option<Comparison>],
    theory: Theory,
    /// Per node: whether the goals depend on it.
    matters: Vec<bool>,
    /// Per term: the nodes of atoms that compare it with a number.
    atoms_of: Vec<Vec<u32>>,
    values: Vec<Option<bool>>,
    /// Per node: how many of its parts hold, and how many do not.
    holding: Vec<usize>,
    failing: Vec<usize>,
    /// Nodes in the order in which they got values, and how many of them have been followed up.
    trail: Vec<usize>,
    followed: usize,
    decisions: Vec<Decision>,
    work: u64,
}

impl<'a> Solver<'a> {
    fn new(logic: &'a Logic, comparisons: &'a [Option<Comparison>], theory: Theory) -> Self {
        let size = logic.nodes().len();
        let mut values = vec![None; size];
        values[Literal::TRUE.node()] = Some(true);
        Solver {
            logic,
            comparisons,
            theory,
            matters: vec![false; size],
            atoms_of: Vec::new(),
            values,
            holding: vec![0; size],
            failing: vec![0; size],
            trail: Vec::new(),
            followed: 0,
            decisions: Vec::new(),
            work: size as u64 / 8,
        }
    }

    fn add_to_what_matters(&mut self, goals: &[Literal]) {
        let mut waiting: Vec<usize> = goals.iter().map(|goal| goal.node()).collect();
        while let Some(node) = waiting.pop() {
            if std::mem::replace(&mut self.matters[node], true) {
                continue;
            }
            if let Node::AtLeast { parts, .. } = &self.logic.nodes()[node] {
                waiting.extend(parts.iter().map(|part| part.node()));
            }
            if let Some(Comparison::AtMost(term, _)) = self.comparisons.get(node).copied().flatten() {
                self.atoms_of.resize(self.atoms_of.len().max(term + 1), Vec::new());
                self.atoms_of[term].push(u32::try_from(node).expect("nodes are counted in 32 bits"));
            }
        }
    }

    /// `None` if it is given up.
    fn run(&mut self, goals: &[Literal]) -> Option<bool> {
        let mut fits = goals.iter().all(|&goal| self.set(goal)) && self.follow();
        loop {
            if self.work > PATIENCE {
                return None;
            }
            if fits {
                let Some(literal) = self.unjustified() else { return Some(true) };
                let (trail, theory) = (self.trail.len(), self.theory.mark());
                self.decisions.push(Decision { trail, theory, literal, turned: false });
                fits = self.set(literal) && self.follow();
                continue;
            }
            loop {
                let Some(decision) = self.decisions.last_mut() else { return Some(false) };
                let (trail, theory, turned) = (decision.trail, decision.theory, decision.turned);
                let literal = !decision.literal;
                decision.turned = true;
                self.go_back(trail, theory);
                if !turned {
                    fits = self.set(literal) && self.follow();
                    break;
                }
                self.decisions.pop();
            }
        }
    }

    fn value(&self, literal: Literal) -> Option<bool> {
        self.values[literal.node()].map(|value| value == literal.is_positive())
    }

    /// Makes a literal hold; false if it does not already.
    fn set(&mut self, literal: Literal) -> bool {
        if let Some(value) = self.values[literal.node()] {
            return value == literal.is_positive();
        }
        self.values[literal.node()] = Some(literal.is_positive());
        self.trail.push(literal.node());
        true
    }

    /// Follows up all values that were set; false if they contradict each other.
    fn follow(&mut self) -> bool {
        while let Some(&node) = self.trail.get(self.followed) {
            self.followed += 1;
            self.count(node, 1);
            let logic = self.logic;
            let fits = self.compare(node)
                && self.examine(node)
                && logic
                    .users(node)
                    .iter()
                    .all(|&(user, _)| !self.matters[user as usize] || self.examine(user as usize));
            if !fits {
                return false;
            }
        }
        true
    }

    /// Counts the value of a node among the parts of all that it is part of, or (with -1) no longer.
    fn count(&mut self, node: usize, by: isize) {
        let Some(value) = self.values[node] else { return };
        for &(user, positive) in self.logic.users(node) {
            let counts = if value == positive { &mut self.holding } else { &mut self.failing };
            let count = &mut counts[user as usize];
            *count = count.wrapping_add_signed(by);
        }
    }

    /// Tells the theory about an atom, and sets atoms that follow.
    fn compare(&mut self, node: usize) -> bool {
        let (Some(comparison), Some(holds)) = (self.comparisons.get(node).copied().flatten(), self.values[node]) else {
            return true;
        };
        if !self.theory.add(comparison, holds) {
            return false;
        }
        let Comparison::AtMost(term, _) = comparison else { return true };
        let (least, most) = self.theory.range(term);
        for at in 0..self.atoms_of[term].len() {
            let other = self.atoms_of[term][at] as usize;
            let Some(Comparison::AtMost(_, bound)) = self.comparisons[other] else { continue };
            if self.values[other].is_none() && (most <= bound || least > bound) {
                self.values[other] = Some(most <= bound);
                self.trail.push(other);
            }
        }
        true
    }

    /// What the values of a node and of its parts say about each other.
    fn examine(&mut self, node: usize) -> bool {
        self.work += 1;
        let logic = self.logic;
        let Node::AtLeast { need, parts } = &logic.nodes()[node] else { return true };
        let spare = parts.len() - need;
        let literal = Literal::of(node);
        if self.holding[node] >= *need {
            if !self.set(literal) {
                return false;
            }
        } else if self.failing[node] > spare && !self.set(!literal) {
            return false;
        }
        let rest = match self.values[node] {
            Some(true) if self.failing[node] == spare && self.holding[node] < *need => true,
            Some(false) if self.holding[node] == need - 1 && self.failing[node] <= spare => false,
            _ => return true,
        };
        self.work += parts.len() as u64;
        parts.iter().all(|&part| self.value(part).is_some() || self.set(if rest { part } else { !part }))
    }

    /// A part to be set for a node whose value does not follow from its parts yet.
    fn unjustified(&self) -> Option<Literal> {
        self.trail.iter().find_map(|&node| {
            let Node::AtLeast { need, parts } = &self.logic.nodes()[node] else { return None };
            let value = self.values[node]?;
            let justified = if value { self.holding[node] >= *need } else { self.failing[node] > parts.len() - need };
            if justified {
                return None;
            }
            let open = parts.iter().copied().find(|&part| self.value(part).is_none())?;
            Some(if value { open } else { !open })
        })
    }

    fn go_back(&mut self, trail: usize, theory: usize) {
        while self.trail.len() > trail {
            let Some(node) = self.trail.pop() else { break };
            if self.followed > self.trail.len() {
                self.followed = self.trail.len();
                self.count(node, -1);
            }
            self.values[node] = None;
        }
        self.theory.go_back(theory);
    }
}
