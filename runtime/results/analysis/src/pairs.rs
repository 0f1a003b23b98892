//! Which operations acted together, and in which parts of the run: the coverage of pairs of operations.
//!
//! It follows from the recorded tests of any campaign, whatever its strategy. A run has [`PARTS`] parts of equal length
//! up to the end of the campaign's tests. An operation acted in a part if its first or its last effect is in it, or if
//! it was active there between these two. Of imported tests nobody knows the effects, so there an operation acted
//! wherever it was active. One that acts before the start or after the end of a run acts in no part of it.
//!
//! Reference runs, duplicates, and runs that the environment broke off do not count. As for [causes](crate::causes),
//! a requirement that a reference run violates is left out: no operation is needed to violate it.

use std::collections::{BTreeMap, BTreeSet};
use std::fmt::Write as _;

use sesame_plan::{CampaignPlan, OperationId, RequirementId, Span};
use sesame_present::number::plural;
use sesame_record::{Origin, RecordError, Repository, ScannedOperation, ScannedTest, Verdict};

use crate::{Datum, Selection, Table};

/// Into how many parts a run is divided.
pub const PARTS: usize = 4;

/// What the tests show in which two operations acted, or one.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct Acted {
    /// How many these are.
    pub tests: u32,
    /// In how many of them both acted in the same part of the run, for each part.
    pub parts: [u32; PARTS],
    /// How many of them violate a requirement.
    pub violating: u32,
    /// How many of them violate each of [`Pairs::requirements`].
    pub of_requirements: Vec<u32>,
}

/// How many pairs of operations acted together.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct PairCounts {
    /// All pairs.
    pub pairs: usize,
    /// Those of which both acted in one test.
    pub together: usize,
    /// Pairs in parts of the run, where both may be active then or were.
    pub in_parts: usize,
    /// Those of which both acted in that part of one test.
    pub together_in_parts: usize,
}

/// A pair that did not act together in each part of the run in which it may.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Untried {
    /// The positions of the operations, the lower one first.
    pub pair: (usize, usize),
    /// In how many tests both acted.
    pub tests: u32,
    /// The parts of the run in which they did not both act, and may.
    pub parts: [bool; PARTS],
}

/// Which operations of a campaign acted together. Operations are named by their position among [`Pairs::operations`].
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Pairs {
    /// The operations of the campaign, in order of declaration.
    pub operations: Vec<OperationId>,
    /// The requirements whose violations are counted: those that no reference run violates.
    pub requirements: Vec<RequirementId>,
    /// Whether there are pairs: tests of the campaign may hold two operations, or a recorded one did.
    may_combine: bool,
    /// For each operation the parts of the run in which it may be active.
    reach: Vec<[bool; PARTS]>,
    /// For each operation what is known of it with each one before it; the last is that of the operation itself.
    acted: Vec<Vec<Acted>>,
}

/// A test that counts.
#[derive(Debug, Clone, PartialEq, Eq)]
struct Trial {
    /// The operations that acted, by position, and the parts of the run in which each did.
    acting: BTreeMap<usize, [bool; PARTS]>,
    /// The requirements that it violates.
    violates: BTreeSet<RequirementId>,
}

/// Which operations acted together in the tests of a selection.
pub fn pairs(repository: &Repository, selection: &Selection) -> Result<Pairs, RecordError> {
    let (plan, judge) = (repository.plan(), repository.judge()?);
    let operations: BTreeSet<OperationId> = plan.campaign.operations.iter().copied().collect();
    let operations: Vec<OperationId> = operations.into_iter().collect();
    let declared = || (0..).map(RequirementId).zip(&plan.requirements);
    let violated = |test: &ScannedTest| -> BTreeSet<RequirementId> {
        let violates = declared().filter(|(_, of)| judge.verdict_of_scanned(test, of) == Verdict::Violated);
        violates.map(|(id, _)| id).collect()
    };
    let mut of_reference = BTreeSet::new();
    let mut trials: Vec<Trial> = Vec::new();
    repository.scan(&mut |test| {
        if test.origin == Origin::Reference {
            of_reference.extend(violated(&test));
        } else if test.duplicate_of.is_none() && !test.outcome.is_of_environment() && selection.holds(test.number) {
            let acting = acting(plan, &operations, &test);
            if !acting.is_empty() {
                trials.push(Trial { acting, violates: violated(&test) });
            }
        }
    })?;
    let requirements = declared().map(|(id, _)| id).filter(|id| !of_reference.contains(id)).collect();
    Ok(count(plan, operations, requirements, &trials))
}

/// The operations that acted in a test, by position among these, and the parts of the run in which each did.
fn acting(plan: &CampaignPlan, operations: &[OperationId], test: &ScannedTest) -> BTreeMap<usize, [bool; PARTS]> {
    let mut acting: BTreeMap<usize, [bool; PARTS]> = BTreeMap::new();
    for used in &test.operations {
        let Ok(at) = operations.binary_search(&used.operation) else { continue };
        // What acts outside of a run has no effect that could be counted in it.
        if used.acted || plan.operation(used.operation).kind.is_offline() {
            let parts = parts_of(used, plan.campaign.end_after);
            let known = acting.entry(at).or_default();
            known.iter_mut().zip(parts).for_each(|(known, part)| *known |= part);
        }
    }
    acting
}

/// The ends of a part of a run of this length.
fn part(number: usize, length: f64) -> Span {
    let edge = |number: usize| length * number as f64 / PARTS as f64;
    Span { start: edge(number), end: edge(number + 1) }
}

fn overlaps(part: Span, other: Span) -> bool {
    other.start < other.end && other.start < part.end && part.start < other.end
}

/// The parts of a run in which an operation acted.
fn parts_of(used: &ScannedOperation, length: f64) -> [bool; PARTS] {
    let mut parts = [false; PARTS];
    // An effect beyond an end of the run is one of the part there.
    let number = |time: f64| (1..PARTS).filter(|&number| part(number, length).start <= time).count();
    if let Some(Span { start, end }) = used.touched {
        parts[number(start)] = true;
        parts[number(end)] = true;
    }
    let Span { start: first, end: last } =
        used.touched.unwrap_or(Span { start: f64::NEG_INFINITY, end: f64::INFINITY });
    for interval in &used.intervals {
        let effective = Span { start: interval.start.max(first), end: interval.end.min(last) };
        for (at, acted) in parts.iter_mut().enumerate() {
            *acted |= overlaps(part(at, length), effective);
        }
    }
    parts
}

/// Counts the tests in which each operation and each two of them acted.
fn count(
    plan: &CampaignPlan,
    operations: Vec<OperationId>,
    requirements: Vec<RequirementId>,
    trials: &[Trial],
) -> Pairs {
    let reach = operations.iter().map(|&id| {
        let operation = plan.operation(id);
        let may_act = |at: usize| overlaps(part(at, plan.campaign.end_after), operation.within);
        std::array::from_fn(|at| !operation.kind.is_offline() && may_act(at))
    });
    let nothing = || Acted { of_requirements: vec![0; requirements.len()], ..Acted::default() };
    let mut acted: Vec<Vec<Acted>> =
        (1..=operations.len()).map(|others| std::iter::repeat_with(nothing).take(others).collect()).collect();
    let mut may_combine = operations.len() > 1 && plan.campaign.count.max > 1;
    for Trial { acting, violates } in trials {
        let violates: Vec<bool> = requirements.iter().map(|id| violates.contains(id)).collect();
        may_combine |= acting.len() > 1;
        for (&second, of_second) in acting {
            for (&first, of_first) in acting.range(..=second) {
                let Acted { tests, parts, violating, of_requirements } = &mut acted[second][first];
                *tests += 1;
                let both = of_first.iter().zip(of_second).map(|(first, second)| *first && *second);
                parts.iter_mut().zip(both).for_each(|(part, both)| *part += u32::from(both));
                *violating += u32::from(violates.contains(&true));
                of_requirements.iter_mut().zip(&violates).for_each(|(of, &violated)| *of += u32::from(violated));
            }
        }
    }
    Pairs { reach: reach.collect(), operations, requirements, may_combine, acted }
}

impl Pairs {
    /// What is known of two operations, the lower one first, or of one if both are the same.
    pub fn of(&self, first: usize, second: usize) -> &Acted {
        &self.acted[second][first]
    }

    /// Each two operations, the lower one first. There are none where tests hold one operation each.
    pub fn pairs(&self) -> impl Iterator<Item = (usize, usize)> + '_ {
        let count = if self.may_combine { self.operations.len() } else { 0 };
        (0..count).flat_map(move |first| (first + 1..count).map(move |second| (first, second)))
    }

    /// The parts of the run in which two operations may be active, or acted; of one if both are the same.
    pub fn reach(&self, first: usize, second: usize) -> [bool; PARTS] {
        let acted = self.of(first, second).parts;
        std::array::from_fn(|at| acted[at] > 0 || (self.reach[first][at] && self.reach[second][at]))
    }

    /// How many pairs acted together.
    pub fn counts(&self) -> PairCounts {
        let mut counts = PairCounts::default();
        for (first, second) in self.pairs() {
            let acted = self.of(first, second);
            counts.pairs += 1;
            counts.together += usize::from(acted.tests > 0);
            counts.in_parts += self.reach(first, second).iter().filter(|&&may| may).count();
            counts.together_in_parts += acted.parts.iter().filter(|&&tests| tests > 0).count();
        }
        counts
    }

    /// The pairs that did not act together in each part of the run in which they may: first those that never did, then
    /// those that did in few parts.
    pub fn untried(&self) -> Vec<Untried> {
        let of = |pair: (usize, usize)| {
            let (acted, may) = (self.of(pair.0, pair.1), self.reach(pair.0, pair.1));
            let parts = std::array::from_fn(|at| may[at] && acted.parts[at] == 0);
            Untried { pair, tests: acted.tests, parts }
        };
        let open = |untried: &Untried| untried.parts.iter().filter(|&&open| open).count();
        let mut found: Vec<Untried> = self.pairs().map(of).filter(|of| of.tests == 0 || open(of) > 0).collect();
        found.sort_by_key(|untried| (untried.tests > 0, PARTS - open(untried)));
        found
    }

    /// How many pairs acted together, as in `44 of 45 pairs of operations acted together, 97 of 180 in the same quarter
    /// of the run`; `None` without pairs.
    pub fn sentence(&self) -> Option<String> {
        let PairCounts { pairs, together, in_parts, together_in_parts } = self.counts();
        let mut sentence = format!("{together} of {} of operations acted together", plural(pairs, "pair", "pairs"));
        if in_parts > 0 {
            let _ = write!(sentence, ", {together_in_parts} of {in_parts} in the same quarter of the run");
        }
        (pairs > 0).then_some(sentence)
    }

    /// A row for each operation, then one for each two. There is no number for a part of the run in which an operation
    /// may not be active.
    pub fn table(&self, plan: &CampaignPlan) -> Table {
        let of_parts = (1..=PARTS).map(|part| format!("part_{part}"));
        let of_requirements = self.requirements.iter().map(|&id| format!("violating_{}", plan.requirement(id).name));
        let mut columns: Vec<String> = ["first", "second", "together"].map(str::to_owned).to_vec();
        columns.extend(of_parts.chain(["violating".to_owned()]).chain(of_requirements));
        let mut table = Table::new(columns);
        let whole = |count: u32| Datum::Whole(i64::from(count));
        let alone = (0..self.operations.len()).map(|at| (at, at));
        for (first, second) in alone.chain(self.pairs()) {
            let name = |at: usize| Datum::text(&plan.operation(self.operations[at]).name);
            let Acted { tests, parts, violating, of_requirements } = self.of(first, second);
            let other = if first == second { Datum::Missing } else { name(second) };
            let may = self.reach(first, second);
            let parts = parts.iter().zip(may).map(|(&tests, may)| if may { whole(tests) } else { Datum::Missing });
            let violated = [*violating].into_iter().chain(of_requirements.iter().copied()).map(whole);
            table.row([name(first), other, whole(*tests)].into_iter().chain(parts).chain(violated));
        }
        table
    }
}

#[cfg(test)]
mod tests;
