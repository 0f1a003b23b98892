//! Whether literals can hold together: a search for values of the nodes below them that justify each other, with the
//! comparisons of numbers decided on the way (DPLL(T) [Nieuwenhuis et al. 2006]). Each value knows on which decisions
//! it depends, so that a contradiction undoes those that led to it and not those that happened to come later
//! [Prosser 1993].

use super::logic::{Literal, Logic, LogicNode};
use super::theory::{Comparison, Theory};

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

/// Whether these literals can hold together. `comparisons` says, per node, which comparison an atom is; `theory` is
/// what is known of the numbers in them. `laws` always hold; one of which only one part matters says nothing about the
/// goals and must be such that the rest can always be chosen accordingly. After a look at `patience` nodes it gives up.
pub(super) fn solve(
    logic: &Logic,
    comparisons: &[Option<Comparison>],
    theory: Theory,
    goals: &[Literal],
    laws: &[Literal],
    patience: u64,
    work: &mut u64,
) -> Answer {
    let mut solver = Solver::new(logic, comparisons, theory);
    solver.patience = patience;
    let mut goals = goals.to_vec();
    solver.add_to_what_matters(&goals);
    let mut laws: Vec<Literal> = laws.to_vec();
    let mut before = usize::MAX;
    while goals.len() != before {
        before = goals.len();
        laws.retain(|&law| {
            let LogicNode::AtLeast { parts, .. } = &logic.nodes()[law.node()] else { return false };
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
    literal: Literal,
}

/// A set of decisions, by their level. All levels from the last one on share one place.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
struct Levels(u128);

impl Levels {
    const NONE: Levels = Levels(0);
    const SHARED: usize = 127;

    fn one(level: usize) -> Self {
        Levels(1 << level.min(Levels::SHARED))
    }

    fn and(self, other: Levels) -> Self {
        Levels(self.0 | other.0)
    }

    /// The latest level, if there are so many decisions; `None` if there is none.
    fn latest(self, decisions: usize) -> Option<usize> {
        let latest = 127_usize.checked_sub(self.0.leading_zeros() as usize)?;
        Some(if latest == Levels::SHARED { decisions - 1 } else { latest })
    }

    /// Those before a level, which is the latest.
    fn before(self, level: usize) -> Self {
        if level > Levels::SHARED { self } else { Levels(self.0 & !(1 << level)) }
    }
}

/// The decisions that led to a contradiction.
type Fits = Result<(), Levels>;

struct Solver<'a> {
    logic: &'a Logic,
    comparisons: &'a [Option<Comparison>],
    theory: Theory,
    /// Per node: whether the goals depend on it.
    matters: Vec<bool>,
    /// Per term: the nodes of atoms that compare it with a number.
    atoms_of: Vec<Vec<u32>>,
    /// All nodes of atoms that compare terms, with the group of the terms.
    compared: Vec<(usize, u32)>,
    values: Vec<Option<bool>>,
    /// Per node with a value: on what it depends.
    depends: Vec<Levels>,
    /// Per node: how many of its parts hold, and how many do not.
    holding: Vec<usize>,
    failing: Vec<usize>,
    /// Nodes in the order in which they got values, and how many of them have been followed up.
    trail: Vec<usize>,
    followed: usize,
    decisions: Vec<Decision>,
    work: u64,
    patience: u64,
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
            compared: Vec::new(),
            values,
            depends: vec![Levels::NONE; size],
            holding: vec![0; size],
            failing: vec![0; size],
            trail: Vec::new(),
            followed: 0,
            decisions: Vec::new(),
            work: size as u64 / 8,
            patience: 0,
        }
    }

    fn add_to_what_matters(&mut self, goals: &[Literal]) {
        let mut waiting: Vec<usize> = goals.iter().map(|goal| goal.node()).collect();
        while let Some(node) = waiting.pop() {
            if std::mem::replace(&mut self.matters[node], true) {
                continue;
            }
            if let LogicNode::AtLeast { parts, .. } = &self.logic.nodes()[node] {
                waiting.extend(parts.iter().map(|part| part.node()));
            }
            let Some(comparison) = self.comparisons.get(node).copied().flatten() else { continue };
            let atom = u32::try_from(node).expect("nodes are counted in 32 bits");
            let (Comparison::AtMost(term, _) | Comparison::Ordered(term, _)) = comparison;
            self.compared.push((self.theory.group(term), atom));
            if let Comparison::AtMost(term, _) = comparison {
                self.atoms_of.resize(self.atoms_of.len().max(term + 1), Vec::new());
                self.atoms_of[term].push(atom);
            }
        }
    }

    /// `None` if it is given up.
    fn run(&mut self, goals: &[Literal]) -> Option<bool> {
        let mut fits = goals.iter().try_for_each(|&goal| self.set(goal, Levels::NONE)).and_then(|()| self.follow());
        loop {
            if self.work > self.patience {
                return None;
            }
            fits = match fits {
                Ok(()) => {
                    let Some(literal) = self.unjustified() else { return Some(true) };
                    let (level, trail, theory) = (self.decisions.len(), self.trail.len(), self.theory.mark());
                    self.decisions.push(Decision { trail, theory, literal });
                    self.set(literal, Levels::one(level)).and_then(|()| self.follow())
                }
                Err(levels) => {
                    let Some(level) = levels.latest(self.decisions.len()) else { return Some(false) };
                    let Decision { trail, theory, literal } = self.decisions[level];
                    self.decisions.truncate(level);
                    self.go_back(trail, theory);
                    // With the decisions before it, its negation follows.
                    self.set(!literal, levels.before(level)).and_then(|()| self.follow())
                }
            }
        }
    }

    fn value(&self, literal: Literal) -> Option<bool> {
        self.values[literal.node()].map(|value| value == literal.is_positive())
    }

    /// Makes a literal hold, because of some decisions.
    fn set(&mut self, literal: Literal, because: Levels) -> Fits {
        let node = literal.node();
        match self.values[node] {
            Some(value) if value == literal.is_positive() => Ok(()),
            Some(_) => Err(because.and(self.depends[node])),
            None => {
                self.values[node] = Some(literal.is_positive());
                self.depends[node] = because;
                self.trail.push(node);
                Ok(())
            }
        }
    }

    /// Follows up all values that were set.
    fn follow(&mut self) -> Fits {
        while let Some(&node) = self.trail.get(self.followed) {
            self.followed += 1;
            self.count(node, 1);
            self.compare(node)?;
            self.examine(node)?;
            let logic = self.logic;
            for &(user, _) in logic.users(node) {
                if self.matters[user as usize] {
                    self.examine(user as usize)?;
                }
            }
        }
        Ok(())
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
    fn compare(&mut self, node: usize) -> Fits {
        let (Some(comparison), Some(holds)) = (self.comparisons.get(node).copied().flatten(), self.values[node]) else {
            return Ok(());
        };
        let fits = self.theory.add(comparison, holds);
        let Comparison::AtMost(term, _) = comparison else {
            let Comparison::Ordered(term, _) = comparison else { return Ok(()) };
            return if fits { Ok(()) } else { Err(self.because_of_group(term)) };
        };
        let (least, most) = self.theory.range(term);
        // What is known of a term by itself comes from its own atoms, unless it is made of others.
        let own = self.theory.is_own(term) && (fits || least > most);
        let because = if own { self.because_of(self.atoms_of[term].iter()) } else { self.because_of_group(term) };
        if !fits {
            return Err(because);
        }
        for at in 0..self.atoms_of[term].len() {
            let other = self.atoms_of[term][at] as usize;
            let Some(Comparison::AtMost(_, bound)) = self.comparisons[other] else { continue };
            if self.values[other].is_none() && (most <= bound || least > bound) {
                let literal = Literal::of(other);
                self.set(if most <= bound { literal } else { !literal }, because)?;
            }
        }
        Ok(())
    }

    fn because_of_group(&self, term: usize) -> Levels {
        let group = self.theory.group(term);
        self.because_of(self.compared.iter().filter(|(of, _)| *of == group).map(|(_, atom)| atom))
    }

    /// The decisions on which values of these nodes depend.
    fn because_of<'b>(&self, nodes: impl Iterator<Item = &'b u32>) -> Levels {
        let known = nodes.map(|&node| node as usize).filter(|&node| self.values[node].is_some());
        known.fold(Levels::NONE, |levels, node| levels.and(self.depends[node]))
    }

    /// The decisions on which it depends that so many of these parts hold, or do not.
    fn because_of_parts(&self, parts: &[Literal], hold: bool, count: usize) -> Levels {
        let so = parts.iter().filter(|&&part| self.value(part) == Some(hold)).take(count);
        so.fold(Levels::NONE, |levels, part| levels.and(self.depends[part.node()]))
    }

    /// What the values of a node and of its parts say about each other.
    fn examine(&mut self, node: usize) -> Fits {
        self.work += 1;
        let logic = self.logic;
        let LogicNode::AtLeast { need, parts } = &logic.nodes()[node] else { return Ok(()) };
        let (holding, failing, spare) = (self.holding[node], self.failing[node], parts.len() - need);
        let literal = Literal::of(node);
        if holding >= *need {
            if self.values[node] != Some(true) {
                self.set(literal, self.because_of_parts(parts, true, *need))?;
            }
            return Ok(());
        }
        if failing > spare {
            if self.values[node] != Some(false) {
                self.set(!literal, self.because_of_parts(parts, false, spare + 1))?;
            }
            return Ok(());
        }
        let rest = match self.values[node] {
            Some(true) if failing == spare => true,
            Some(false) if holding + 1 == *need => false,
            _ => return Ok(()),
        };
        self.work += parts.len() as u64;
        let because = self.because_of_parts(parts, !rest, parts.len()).and(self.depends[node]);
        for &part in parts {
            if self.value(part).is_none() {
                self.set(if rest { part } else { !part }, because)?;
            }
        }
        Ok(())
    }

    /// A part to be set for a node whose value does not follow from its parts yet.
    fn unjustified(&self) -> Option<Literal> {
        self.trail.iter().find_map(|&node| {
            let LogicNode::AtLeast { need, parts } = &self.logic.nodes()[node] else { return None };
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
