//! The interleaved search: combinatorial interaction testing with windows aligned to what happens in the undisturbed
//! system, attribution of each violation to its smallest set of operations, and goal-directed search between them.
//!
//! What is dangerous lies at the ends of ranges and at events, and uniform draws seldom do. So each operation is tried
//! alone first, as strong and as long as it may be ([opening]); then each two together ([pairs]), over the whole run
//! and over parts of it; then copies [in a row](in_a_row). Meanwhile and afterwards tests come from windows that are
//! [aligned] with the moments of the reference run ([moments]), from the [near misses](near_misses) so far, and from
//! uniform draws.
//!
//! A test that violates a requirement is reduced to the operations that are to blame ([causes]); each question is a
//! test of the campaign. If they are several, each of them is tried [alone] in other ways. Operations that are known to
//! be dangerous alone are drawn seldom from then on, so that one loud cause does not hide the others.
//!
//! A generation always has the same size, and a stream of its own decides its tests. So the tests are the same for any
//! number of workers, and a search resumes once it has the recorded results.

mod aligned;
mod alone;
mod causes;
mod in_a_row;
mod moments;
mod near_misses;
mod opening;
mod pairs;
mod setting;
#[cfg(test)]
mod tests;
mod tried;

use std::collections::{BTreeSet, VecDeque};

use sesame_base::observation::Observation;
use sesame_plan::{CampaignPlan, Test};
use sesame_rng::Stream;

use causes::{Attribution, Cause, Causes, Next};
use moments::Moments;
use near_misses::{Kept, Ran};
use pairs::Pairs;
use setting::Setting;
use tried::Tried;

use crate::evolve::predict::VariableTrajectories;
use crate::falsification::TestDomain;
use crate::margin::{evaluated_margins, margins};
use crate::space::initial::fresh_test;
use crate::space::test_space::TestSpace;
use crate::test_key::TestKey;
use crate::{Candidate, Evaluated, Strategy};

/// Tests of a generation: a constant, so that the number of workers decides nothing.
const GENERATION: usize = 8;
/// How many of them may be questions of attributions, as long as there is time for other tests.
const QUESTIONS: usize = GENERATION * 3 / 4;
/// How many different operations the tests of the last generation hold that answer no question, and those of the one
/// before it: what they show needs no attribution for which there is no time any more.
const AT_THE_END: [usize; 2] = [1, 2];

/// The shares of the sources of tests once the opening is over and each two operations were tried together; the rest is
/// aligned.
const PAIRWISE: f64 = 0.15;
const UNIFORM: f64 = 0.20;
const NEAR_MISSES: f64 = 0.25;

/// How often a test of copies in a row takes the place of one of these, as long as there is one.
const IN_A_ROW: f64 = 0.3;

/// How often an operation is drawn that is a cause of every requirement alone, or of one.
const DRAWN_IF_ALWAYS_A_CAUSE: f64 = 0.1;
const DRAWN_IF_A_CAUSE: f64 = 0.4;

/// How often a uniform test is drawn again that a known cause explains, or that meets no message.
const TRIES: usize = 8;

/// An interleaved search by ask and tell.
pub(crate) struct Interleaved {
    setting: Setting,
    /// Where the surrogate of near misses searches; none where conditions switch operations.
    domain: Option<TestDomain>,
    seed: u64,
    /// Whether known causes are avoided.
    avoids_causes: bool,
    /// The requirements that the undisturbed system keeps: their positions, and the scale of their margins.
    requirements: Vec<(usize, f64)>,
    /// Of these the margins of the undisturbed system in their scale.
    undisturbed: Vec<f64>,
    left_out: Vec<String>,
    opening: VecDeque<(usize, Test)>,
    pairs: Pairs,
    tried: Tried,
    causes: Causes,
    attributions: Vec<Attribution>,
    /// Tests of single operations out of causes of several.
    alone: VecDeque<Test>,
    /// Tests of copies in a row that were not asked for yet, each with its operation.
    rows: VecDeque<(usize, Test)>,
    ran: Vec<Ran>,
    asked: Vec<Asked>,
    generation: u32,
    left: u32,
}

/// A test that was asked for, and what for.
struct Asked {
    test: Test,
    /// The attribution that it answers, by position, and the operations of the attribution's test that it holds.
    question: Option<(usize, BTreeSet<usize>)>,
}

impl Interleaved {
    /// A search before its first test.
    pub(crate) fn new(plan: &CampaignPlan, space: TestSpace, evaluations: u32, avoids_causes: bool, seed: u64) -> Self {
        let nothing = Observation::without_run(sesame_base::observation::Outcome::Completed);
        let domain = space.conditions().is_none().then(|| TestDomain::new(space.clone(), seed));
        let space = space.with_members_apart(plan);
        let moments = Moments::from_reference(plan, &space, &nothing);
        let mut search = Interleaved {
            setting: Setting::new(plan.clone(), space, moments, None),
            domain,
            seed,
            avoids_causes,
            requirements: (0..plan.requirements.len()).map(|requirement| (requirement, 1.0)).collect(),
            undisturbed: vec![f64::INFINITY; plan.requirements.len()],
            left_out: Vec::new(),
            opening: VecDeque::new(),
            pairs: Pairs::default(),
            tried: Tried::default(),
            causes: Causes::default(),
            attributions: Vec::new(),
            alone: VecDeque::new(),
            rows: VecDeque::new(),
            ran: Vec::new(),
            asked: Vec::new(),
            generation: 0,
            left: evaluations,
        };
        search.open();
        search
    }

    fn open(&mut self) {
        let mut stream = Stream::derive(self.seed, "interleaved opening", &[]);
        self.opening = opening::opening(&self.setting, &mut stream).into();
        let usable = self.setting.usable();
        let mut rows: Vec<(usize, usize, Test)> = Vec::new();
        for kind in usable {
            let tests = in_a_row::in_a_row(&self.setting, kind, &mut stream);
            rows.extend(tests.into_iter().enumerate().map(|(rank, test)| (rank, kind, test)));
        }
        // The weightiest moments of each operation first.
        rows.sort_by_key(|(rank, kind, _)| (*rank, *kind));
        self.rows = rows.into_iter().map(|(_, kind, test)| (kind, test)).collect();
    }

    /// Whether an operation alone is a cause of every requirement.
    fn is_always_a_cause(&self, kind: usize) -> bool {
        self.avoids_causes
            && !self.requirements.is_empty()
            && (0..self.requirements.len()).all(|requirement| self.causes.is_alone(requirement, kind))
    }

    /// Whether known causes explain a violation of every requirement by a test with these operations, so that it would
    /// show nothing new.
    fn is_explained(&self, held: &BTreeSet<usize>) -> bool {
        self.avoids_causes
            && !self.requirements.is_empty()
            && (0..self.requirements.len()).all(|requirement| self.causes.explain(requirement, held))
    }

    /// The operations to draw from: those known to be dangerous alone only seldom.
    fn pool(&self, stream: &mut Stream) -> Vec<usize> {
        let usable = self.setting.usable();
        let drawn = |&kind: &usize, stream: &mut Stream| {
            let is_alone = |requirement| self.causes.is_alone(requirement, kind);
            let share = if !self.avoids_causes {
                1.0
            } else if self.is_always_a_cause(kind) {
                DRAWN_IF_ALWAYS_A_CAUSE
            } else if (0..self.requirements.len()).any(is_alone) {
                DRAWN_IF_A_CAUSE
            } else {
                1.0
            };
            stream.chance(share * self.setting.kind(kind).inclusion.clamp(f64::MIN_POSITIVE, 1.0))
        };
        let pool: Vec<usize> = usable.iter().copied().filter(|kind| drawn(kind, stream)).collect();
        if pool.is_empty() { usable } else { pool }
    }

    /// The next test that answers no question, with the tests it was made from.
    fn choose(&mut self, stream: &mut Stream) -> (Test, Vec<u32>) {
        while let Some((kind, test)) = self.opening.pop_front() {
            if !self.is_always_a_cause(kind) {
                return (test, Vec::new());
            }
        }
        while let Some(test) = self.alone.pop_front() {
            if self.like(&test).is_none() && !self.is_explained(&self.setting.held(&test)) {
                return (test, Vec::new());
            }
        }
        let paired: Vec<usize> =
            self.setting.usable().into_iter().filter(|&kind| !self.is_always_a_cause(kind)).collect();
        let mut pairs = std::mem::take(&mut self.pairs);
        let share = stream.unit();
        let is_known = |first: usize, second: usize| self.is_explained(&BTreeSet::from([first, second]));
        let is_complete = pairs.first_level_is_complete(&self.setting, &paired, &is_known);
        if is_complete
            && stream.chance(IN_A_ROW)
            && let Some(test) = self.next_in_a_row()
        {
            self.pairs = pairs;
            return (test, Vec::new());
        }
        let is_known = |first: usize, second: usize| self.is_explained(&BTreeSet::from([first, second]));
        let source = if is_complete { share } else { 0.0 };
        let found = if source < PAIRWISE {
            pairs.next(&self.setting, &paired, &is_known, stream).map(|test| (test, Vec::new()))
        } else if source < PAIRWISE + UNIFORM {
            self.uniform(stream).map(|test| (test, Vec::new()))
        } else if source < PAIRWISE + UNIFORM + NEAR_MISSES {
            let pool = self.pool(stream);
            let explained = |requirement: usize, held: &BTreeSet<usize>| self.causes.explain(requirement, held);
            let domain = self.domain.as_ref();
            let kept: Vec<Kept> = (0..)
                .zip(&self.undisturbed)
                .map(|(requirement, &undisturbed)| Kept { undisturbed, causes: self.causes.count(requirement) })
                .collect();
            near_misses::step(&self.setting, domain, &self.ran, &kept, explained, &pool, stream)
        } else {
            None
        };
        self.pairs = pairs;
        found.unwrap_or_else(|| {
            let pool = |stream: &mut Stream| self.pool(stream);
            (aligned::aligned(&self.setting, &self.tried, pool, stream), Vec::new())
        })
    }

    /// The next test of copies in a row that could show something new.
    fn next_in_a_row(&mut self) -> Option<Test> {
        while let Some((kind, test)) = self.rows.pop_front() {
            let shows_something = !self.requirements.is_empty() && self.like(&test).is_none();
            if shows_something && !self.is_always_a_cause(kind) {
                return Some(test);
            }
        }
        None
    }

    /// A test with no more different operations than this, if there is a limit and the campaign permits so few.
    fn of_few_kinds(&self, test: Test, most: Option<usize>, stream: &mut Stream) -> Test {
        let kinds = self.setting.kinds_of(&test);
        let different: Vec<usize> = kinds.iter().copied().collect::<BTreeSet<usize>>().into_iter().collect();
        let Some(most) = most.filter(|&most| most < different.len()) else { return test };
        let kept: Vec<usize> = stream.permutation(different.len())[..most].iter().map(|&at| different[at]).collect();
        let operations = kinds.iter().zip(&test.operations).filter(|(kind, _)| kept.contains(kind));
        let fewer = Test { operations: operations.map(|(_, used)| used.clone()).collect() };
        if fewer.operations.len() < self.setting.space.fewest() { test } else { fewer }
    }

    /// A fresh test that could show something new, if several tries find one.
    fn uniform(&self, stream: &mut Stream) -> Option<Test> {
        let space = &self.setting.space;
        let mut fresh = (0..TRIES).map(|_| fresh_test(space, stream));
        fresh.find(|test| space.is_heard(test) && !self.is_explained(&self.setting.held(test)))
    }

    /// Takes what one test came to.
    fn learn(&mut self, asked: Asked, result: &Evaluated) {
        let plan = &self.setting.plan;
        let all = evaluated_margins(plan, result);
        let of = |&(requirement, scale): &(usize, f64)| {
            (all[requirement].value.map(|value| value / scale), all[requirement].violated)
        };
        let (margins, violated): (Vec<Option<f64>>, Vec<bool>) = self.requirements.iter().map(of).unzip();
        self.tried.add(&self.setting, &asked.test);
        let effects = &result.run.operations;
        let had_effect = effects.is_empty() || effects.iter().any(|effect| effect.counters.any_effect());
        let kinds = self.setting.kinds_of(&asked.test);
        let held: BTreeSet<usize> = kinds.iter().copied().collect();
        if let [kind] = held.iter().copied().collect::<Vec<_>>()[..] {
            for requirement in (0..violated.len()).filter(|&requirement| violated[requirement]) {
                self.causes.add(Cause { requirement, kinds: [kind].into() });
            }
        }
        let about = asked.question.as_ref().map(|(at, _)| self.attributions[*at].requirement);
        if let Some((at, positions)) = asked.question {
            let requirement = self.attributions[at].requirement;
            self.attributions[at].answer(positions, violated[requirement]);
        }
        for requirement in (0..violated.len()).filter(|&requirement| violated[requirement]) {
            if about == Some(requirement) || self.causes.explain(requirement, &held) {
                continue;
            }
            let is_asked = |attribution: &Attribution| {
                attribution.requirement == requirement && attribution.all_kinds().is_subset(&held)
            };
            if self.attributions.iter().any(is_asked) {
                continue;
            }
            // What had no effect is not to blame.
            let blamed: Vec<usize> = (0..kinds.len()).filter(|&at| result.acted(at)).collect();
            let blamed = if blamed.len() < self.setting.space.fewest() { (0..kinds.len()).collect() } else { blamed };
            let test = Test { operations: blamed.iter().map(|&at| asked.test.operations[at].clone()).collect() };
            let kinds = blamed.iter().map(|&at| kinds[at]).collect();
            let fewest = self.setting.space.fewest();
            self.attributions.push(Attribution::new(test, kinds, requirement, result.number, fewest));
        }
        let key = TestKey::of_disturbance(plan, &asked.test);
        self.ran.push(Ran { number: result.number, test: asked.test, key, held, margins, violated, had_effect });
    }

    /// What was run that disturbs the same as a test.
    fn like(&self, test: &Test) -> Option<&Ran> {
        let key = TestKey::of_disturbance(&self.setting.plan, test);
        self.ran.iter().find(|ran| ran.key == key)
    }

    /// Ends the attributions that have no more questions, and returns those of the others: first those about the
    /// requirements of which the fewest causes are known. What a test that was run answers is not asked.
    fn questions(&mut self, stream: &mut Stream) -> Vec<(usize, BTreeSet<usize>)> {
        let mut questions = Vec::new();
        let mut open = Vec::new();
        for mut attribution in std::mem::take(&mut self.attributions) {
            let requirement = attribution.requirement;
            loop {
                let sets = match attribution.next(&self.causes) {
                    Next::Ask(sets) => sets,
                    Next::Done(found) => {
                        for kinds in found {
                            let test = attribution.test_of(&kinds);
                            let several = kinds.len() > 1;
                            if self.causes.add(Cause { requirement, kinds }) && several {
                                self.alone.extend(alone::alone(&self.setting, &test, stream));
                            }
                        }
                        break;
                    }
                };
                let mut unknown = Vec::new();
                for positions in sets {
                    match self.like(&attribution.subset(&positions)) {
                        Some(ran) => attribution.answer(positions, ran.violated[requirement]),
                        None => unknown.push(positions),
                    }
                }
                if !unknown.is_empty() {
                    questions.extend(unknown.into_iter().map(|positions| (open.len(), positions)));
                    open.push(attribution);
                    break;
                }
            }
        }
        questions.sort_by_key(|(at, _): &(usize, _)| self.causes.count(open[*at].requirement));
        self.attributions = open;
        questions
    }
}

impl Strategy for Interleaved {
    fn begin(&mut self, reference: &Observation) {
        self.setting.space.take_reference(reference);
        let (plan, space) = (&self.setting.plan, &self.setting.space);
        self.domain = self.domain.is_some().then(|| TestDomain::new(space.clone(), self.seed));
        let moments = Moments::from_reference(plan, space, reference);
        let trajectories = VariableTrajectories::from_observation(plan, reference);
        (self.requirements, self.undisturbed) = (Vec::new(), Vec::new());
        for (requirement, margin) in margins(plan, reference).into_iter().enumerate() {
            if margin.violated {
                let name = &plan.requirements[requirement].name;
                self.left_out.push(format!(
                    "requirement `{name}` is violated without any operation, so the search looks for no causes of it"
                ));
                continue;
            }
            let scale = margin.value.filter(|value| value.is_finite() && *value > 1e-9).unwrap_or(1.0);
            self.requirements.push((requirement, scale));
            self.undisturbed.push(margin.value.map_or(f64::INFINITY, |value| value / scale));
        }
        self.setting = Setting::new(plan.clone(), self.setting.space.clone(), moments, trajectories);
        self.open();
    }

    fn reads_series(&self) -> bool {
        // The values of the variables of conditions in the reference run.
        self.setting.space.conditions().is_some()
    }

    fn ask(&mut self) -> Vec<Candidate> {
        assert!(self.asked.is_empty(), "a generation is told before the next is asked");
        let size = GENERATION.min(self.left as usize);
        let generation = self.generation;
        let mut stream = Stream::derive(self.seed, "interleaved", &[u64::from(generation)]);
        let mut candidates = Vec::with_capacity(size);
        let candidate =
            |test: Test, parents| Candidate { test, parents, generation, known: None, simulator_seed: None };
        let later = (self.left as usize - size).div_ceil(GENERATION);
        let at_the_end = AT_THE_END.get(later).copied();
        let room = if at_the_end.is_some() { size } else { QUESTIONS.min(size) };
        for (at, positions) in self.questions(&mut stream).into_iter().take(room) {
            let attribution = &self.attributions[at];
            let test = attribution.subset(&positions);
            candidates.push(candidate(test.clone(), vec![attribution.number]));
            self.asked.push(Asked { test, question: Some((at, positions)) });
        }
        while candidates.len() < size {
            let (test, parents) = self.choose(&mut stream);
            let mut test = self.of_few_kinds(test, at_the_end, &mut stream);
            self.setting.space.settle_on_messages(&mut test, &mut stream);
            // The tests of one generation see each other, too.
            self.tried.add(&self.setting, &test);
            candidates.push(candidate(test.clone(), parents));
            self.asked.push(Asked { test, question: None });
        }
        self.generation += 1;
        #[expect(clippy::cast_possible_truncation, reason = "at most as many as a generation has")]
        let asked = size as u32;
        self.left -= asked;
        candidates
    }

    fn tell(&mut self, results: &[Evaluated]) {
        let asked = std::mem::take(&mut self.asked);
        assert!(asked.len() == results.len(), "exactly the generation asked last is told");
        for (asked, result) in asked.into_iter().zip(results) {
            self.learn(asked, result);
        }
    }

    fn given_up(&self) -> Vec<String> {
        self.left_out.clone()
    }
}
