//! The tests that are run in a lab: the choice itself, and how it depends on what it is made by.

use std::collections::{BTreeMap, BTreeSet};

use sesame_base::test_number::TestNumber;
use sesame_plan::{CampaignPlan, Dimension, Lab};
use sesame_present::table::Table;
use sesame_record::{RecordError, Repository};
use sesame_search::sspr::Convention;
use sesame_select::sweep::{Stretch, Sweep, sweep};
use sesame_select::{Invalid, Marginal, Pairs, Problem, Selection, State, Test, choose, marginal};

use crate::Datum;
use crate::Selection as Looked;
use crate::candidates::{Candidate, Candidates, Terms, candidates, qualities};

/// Why nothing is chosen.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum ChoiceError {
    /// Nothing can be compared.
    #[error("none of these tests is a candidate")]
    NoCandidates,
    /// A test that is given as run already is not a candidate.
    #[error("T{test} is not a candidate, so it cannot count as run")]
    NotACandidate {
        /// Its number.
        test: u32,
    },
    /// The numbers are not a problem to be solved.
    #[error("{0}")]
    Invalid(String),
}

impl From<Invalid> for ChoiceError {
    fn from(invalid: Invalid) -> Self {
        ChoiceError::Invalid(invalid.to_string())
    }
}

/// Why no tests are chosen for a lab.
#[derive(Debug, thiserror::Error)]
pub enum LabChoiceError {
    /// The results cannot be read.
    #[error(transparent)]
    Record(#[from] RecordError),
    /// There is nothing to choose.
    #[error(transparent)]
    Choice(#[from] ChoiceError),
}

/// The tests of the latest front that are chosen for a lab as its `budget` says, of all tests if there is no front;
/// `None` for a lab without a budget.
pub fn choice_for(
    repository: &Repository,
    lab: &Lab,
    stop: &mut dyn FnMut() -> bool,
) -> Result<Option<Choice>, LabChoiceError> {
    let (Some(terms), Some(budget)) = (Terms::of_lab(repository.plan(), lab), &lab.budget) else { return Ok(None) };
    let set = repository.latest_result_set()?.map(|set| set.name);
    let found = candidates(repository, &Looked::of(repository, set.as_deref())?, &terms)?;
    let none = BTreeSet::new();
    Ok(Some(Choosing::new(&found, &terms, budget.lambda, &none)?.best(stop)))
}

/// A choice among candidates.
#[derive(Debug, Clone, PartialEq)]
pub struct Choice {
    /// The weight of difference against interest.
    pub lambda: f64,
    /// What the tests may cost that were not run already.
    pub budget: f64,
    /// The numbers of the chosen tests, ascending; those that were run already are among them.
    pub tests: Vec<u32>,
    /// Its value [SESAME 2023, Algorithm 1].
    pub value: f64,
    /// Whether it is proved to be the best.
    pub state: State,
    /// How far the best choice may be above it, as a share of its value; 0 if it is proved.
    pub gap: f64,
    /// What the tests cost that were not run already.
    pub cost: f64,
}

/// The problem of choosing among candidates.
#[derive(Debug, Clone, PartialEq)]
pub struct Choosing<'a> {
    candidates: &'a Candidates,
    qualities: BTreeMap<u32, f64>,
    problem: Problem,
}

impl<'a> Choosing<'a> {
    /// Takes candidates, and the weight of difference against interest in `0..=1`. Tests that were run already are in
    /// every choice and cost nothing: the budget is for others.
    pub fn new(
        candidates: &'a Candidates,
        terms: &Terms,
        lambda: f64,
        run: &BTreeSet<u32>,
    ) -> Result<Self, ChoiceError> {
        if candidates.tests.is_empty() {
            return Err(ChoiceError::NoCandidates);
        }
        let is_candidate = |number: &u32| candidates.tests.iter().any(|candidate| candidate.number == *number);
        if let Some(&test) = run.iter().find(|number| !is_candidate(number)) {
            return Err(ChoiceError::NotACandidate { test });
        }
        let qualities = qualities(&candidates.measured, terms.convention);
        let test = |candidate: &Candidate| {
            let forced = run.contains(&candidate.number);
            Test {
                point: candidate.point.clone(),
                // Without anything to rank by, all are equally interesting.
                quality: if terms.rank.is_empty() { 0.0 } else { qualities[&candidate.number] },
                cost: if forced { 0.0 } else { candidate.cost },
                forced,
            }
        };
        let pairs = if terms.convention == Convention::Ours { Pairs::Unordered } else { Pairs::Ordered };
        let tests = candidates.tests.iter().map(test).collect();
        let problem = Problem::new(tests, lambda, terms.budget, pairs)?;
        Ok(Choosing { candidates, qualities, problem })
    }

    /// What is chosen from; positions in a [`Sweep`] are positions in it.
    pub fn candidates(&self) -> &'a Candidates {
        self.candidates
    }

    /// The best choice, or the best that was found until `stop` said yes.
    pub fn best(&self, stop: &mut dyn FnMut() -> bool) -> Choice {
        self.of(choose(&self.problem, stop), self.problem.lambda(), self.problem.budget())
    }

    /// All weights of difference at which the choice changes, and the choices between them.
    pub fn sweep(&self, stop: &mut dyn FnMut() -> bool) -> Sweep {
        sweep(&self.problem, stop)
    }

    /// The stretches of a sweep, a row each: the weights, the chosen tests, and which enter and leave from one stretch
    /// to the next.
    pub fn sweep_table(&self, sweep: &Sweep) -> Table {
        let mut table = Table::new(["lambda_from", "lambda_to", "tests", "enter", "leave"].map(str::to_owned));
        let names = |tests: &[usize]| {
            let name = |&at: &usize| TestNumber(self.candidates.tests[at].number).to_string();
            let names: Vec<String> = tests.iter().map(name).collect();
            if names.is_empty() { Datum::Missing } else { Datum::Text(names.join(" ")) }
        };
        for (at, Stretch { from, to, chosen, enter, leave }) in sweep.stretches.iter().enumerate() {
            // Nothing enters the first choice.
            let enter = if at == 0 { &[][..] } else { enter };
            table.row([Datum::Real(*from), Datum::Real(*to), names(chosen), names(enter), names(leave)]);
        }
        table
    }

    /// What the smallest greater budget would buy with which another test can be added to a choice. `None` if all tests
    /// are chosen.
    pub fn next_budget(&self, best: &Choice, stop: &mut dyn FnMut() -> bool) -> Option<Choice> {
        let chosen = |at: &usize| best.tests.contains(&self.candidates.tests[*at].number);
        let chosen = (0..self.candidates.tests.len()).filter(chosen).collect();
        let best = Selection { chosen, value: best.value, state: best.state };
        let Marginal { budget, selection, .. } = marginal(&self.problem, &best, None, stop)?;
        Some(self.of(selection, self.problem.lambda(), budget))
    }

    fn of(&self, selection: Selection, lambda: f64, budget: f64) -> Choice {
        let gap = selection.gap();
        let Selection { chosen, value, state } = selection;
        Choice {
            lambda,
            budget,
            tests: chosen.iter().map(|&at| self.candidates.tests[at].number).collect(),
            value,
            state,
            gap,
            cost: self.problem.cost(&chosen),
        }
    }

    /// The chosen tests: their cost, whether they are among those that the lab has run, the values that they are ranked
    /// by, their quality (0 to 1), and where they are.
    pub fn table(&self, plan: &CampaignPlan, terms: &Terms, choice: &Choice, run: &BTreeSet<u32>) -> Table {
        let mut columns = vec!["test".to_owned(), "cost".to_owned(), "run".to_owned()];
        columns.extend(terms.rank.iter().map(|key| plan.metric(key.metric).name.clone()));
        columns.push("quality".to_owned());
        columns.extend(terms.over.iter().map(|dimension: &Dimension| dimension.name().to_owned()));
        let mut table = Table::new(columns);
        for candidate in self.candidates.tests.iter().filter(|candidate| choice.tests.contains(&candidate.number)) {
            let head = [
                Datum::test(candidate.number),
                Datum::Real(candidate.cost),
                Datum::Truth(run.contains(&candidate.number)),
            ];
            let values = candidate.values.iter().map(|&value| Datum::Real(value));
            let quality = Datum::real(self.qualities.get(&candidate.number).copied());
            let point = candidate.point.iter().map(|&coordinate| Datum::Real(coordinate));
            table.row(head.into_iter().chain(values).chain([quality]).chain(point));
        }
        table
    }
}

impl Choice {
    /// Whether it is proved, in words.
    pub fn proof(&self) -> String {
        match self.state {
            State::Proved => "proved to be the best".to_owned(),
            State::TiesOpen => "proved to be the best; not all choices of the same value were compared".to_owned(),
            State::Open { .. } => format!("not proved: the best is at most {:.2} % better", 100.0 * self.gap),
        }
    }
}

#[cfg(test)]
mod tests {
    use sesame_plan::{LabCost, MetricId, RankKey, RankOrder};
    use sesame_record::sample;

    use super::*;
    use crate::candidates::LeftOut;

    fn terms(budget: f64) -> Terms {
        Terms {
            over: vec![Dimension::T1, Dimension::T2],
            rank: vec![RankKey { metric: MetricId(0), order: RankOrder::Descending }],
            cost: LabCost { base: 1.0, per_operation: 0.5 },
            costs: BTreeMap::new(),
            exclude: Vec::new(),
            budget,
            confirmed: false,
            convention: Convention::Ours,
        }
    }

    /// All candidates of the sample's sixty tests.
    fn found(terms: &Terms) -> Candidates {
        let folder = tempfile::tempdir().unwrap();
        let repository = sample::campaign(folder.path(), &sample::plan(), 60);
        candidates(&repository, &Looked::default(), terms).unwrap()
    }

    fn never() -> impl FnMut() -> bool {
        || false
    }

    #[test]
    fn a_choice_keeps_the_budget_is_proved_and_no_exchange_of_two_tests_is_better() {
        let terms = terms(9.0);
        let found = found(&terms);
        let run = BTreeSet::new();
        let choosing = Choosing::new(&found, &terms, 0.5, &run).unwrap();
        let best = choosing.best(&mut never());
        assert!(best.cost <= 9.0 && best.tests.len() >= 3, "{best:?}");
        assert_eq!((best.state, best.gap), (State::Proved, 0.0));
        let at = |number: u32| found.tests.iter().position(|test| test.number == number).unwrap();
        let chosen: Vec<usize> = best.tests.iter().map(|&number| at(number)).collect();
        for out in 0..chosen.len() {
            for other in (0..found.tests.len()).filter(|other| !chosen.contains(other)) {
                let mut exchanged = chosen.clone();
                exchanged[out] = other;
                let fits = choosing.problem.cost(&exchanged) <= 9.0;
                assert!(!fits || choosing.problem.value(&exchanged) <= best.value + 1e-9);
            }
        }
        let table = choosing.table(&sample::plan(), &terms, &best, &run);
        assert_eq!(table.columns(), ["test", "cost", "run", "collision_occurrence", "quality", "T1", "T2"]);
        assert_eq!(table.rows().len(), best.tests.len());
    }

    #[test]
    fn tests_that_were_run_stay_in_the_choice_and_leave_the_budget_to_others() {
        let terms = terms(6.0);
        let found = found(&terms);
        let none = BTreeSet::new();
        let before = Choosing::new(&found, &terms, 0.5, &none).unwrap().best(&mut never());
        let outsider =
            found.tests.iter().map(|test| test.number).find(|number| !before.tests.contains(number)).unwrap();
        let run = BTreeSet::from([outsider]);
        let again = Choosing::new(&found, &terms, 0.5, &run).unwrap().best(&mut never());
        assert!(again.tests.contains(&outsider) && again.cost <= 6.0);
        assert!(again.tests.len() > before.tests.len(), "{before:?} {again:?}");
        let stranger = BTreeSet::from([9999]);
        let refused = Choosing::new(&found, &terms, 0.5, &stranger).unwrap_err().to_string();
        assert_eq!(refused, "T9999 is not a candidate, so it cannot count as run");
    }

    #[test]
    fn a_sweep_says_what_enters_and_leaves_and_more_money_never_buys_less() {
        let terms = terms(6.0);
        let found = found(&terms);
        let run = BTreeSet::new();
        let choosing = Choosing::new(&found, &terms, 0.5, &run).unwrap();
        let sweep = choosing.sweep(&mut never());
        assert!(sweep.proved && sweep.stretches.len() > 1, "{sweep:?}");
        let table = choosing.sweep_table(&sweep);
        assert_eq!(table.columns(), ["lambda_from", "lambda_to", "tests", "enter", "leave"]);
        for pair in sweep.stretches.windows(2) {
            let [Stretch { to, chosen: before, .. }, Stretch { from, chosen: after, .. }] = pair else { continue };
            assert_eq!(to, from);
            // Where they meet, both are the best.
            let at = choosing.problem.clone().with_lambda(*to).unwrap();
            assert!((at.value(before) - at.value(after)).abs() < 1e-9);
        }
        let Datum::Text(entered) = &table.rows()[1][3] else { panic!("{:?}", table.rows()) };
        let at = |name: &str| found.tests.iter().position(|test| format!("T{}", test.number) == name).unwrap();
        for entered in entered.split(' ').map(at) {
            assert!(!sweep.stretches[0].chosen.contains(&entered) && sweep.stretches[1].chosen.contains(&entered));
        }
        let middle = choosing.best(&mut never());
        let more = choosing.next_budget(&middle, &mut never()).unwrap();
        assert!(more.value >= middle.value && more.budget > middle.cost);
        // Stopped at once, it is still a choice, and says that it is not proved.
        let stopped = choosing.best(&mut || true);
        assert!(stopped.cost <= 6.0 && !stopped.tests.is_empty());
        assert!(stopped.value <= middle.value + 1e-9 && stopped.value * (1.0 + stopped.gap) >= middle.value - 1e-9);
    }

    #[test]
    fn a_test_may_have_a_cost_of_its_own() {
        let mut terms = terms(6.0);
        let found = found(&terms);
        let none = BTreeSet::new();
        let before = Choosing::new(&found, &terms, 0.5, &none).unwrap().best(&mut never());
        let dear = before.tests[0];
        terms.costs = BTreeMap::from([(dear, 100.0)]);
        let found = self::found(&terms);
        assert!(
            found.left_out.iter().any(|(number, why)| *number == dear && *why == LeftOut::TooExpensive { cost: 100.0 })
        );
        terms.costs = BTreeMap::from([(dear, 0.0)]);
        let found = self::found(&terms);
        let after = Choosing::new(&found, &terms, 0.5, &none).unwrap().best(&mut never());
        assert!(after.tests.contains(&dear) && after.value >= before.value);
    }

    #[test]
    fn without_candidates_nothing_is_chosen() {
        let terms = terms(0.5);
        let found = found(&terms);
        let run = BTreeSet::new();
        let refused = Choosing::new(&found, &terms, 0.5, &run).unwrap_err();
        assert_eq!(refused, ChoiceError::NoCandidates);
    }
}
