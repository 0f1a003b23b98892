//! Exploitation of near misses: steps from the tests that came nearest to a violation that no known cause explains.
//!
//! Half of the steps are proposals of a surrogate of the margins, as in a [falsification](crate::falsification); the
//! others change windows, choices and operations a little, or halve and double windows. Where conditions switch
//! operations, the search uses no surrogate: steps are mutations as in NSGA-II.

use std::collections::BTreeSet;

use sesame_optimise::falsify::propose;
use sesame_plan::{Activation, Test};
use sesame_rng::Stream;

use super::aligned;
use super::moments::weighted;
use super::setting::Setting;
use crate::evolve::variation::{Rates, mutate};
use crate::falsification::TestDomain;
use crate::space::range::{Range, StepSizes};
use crate::test_key::TestKey;

/// From how many of the best tests of a requirement steps are made.
const BEST: usize = 6;
/// How many tests a surrogate is fitted to.
const FITTED: usize = 80;
/// How large a small step is.
const STEPS: StepSizes = StepSizes { finest: 0.01, boldest: 0.2 };

/// A test that was run, and how near it came to violating each requirement.
#[derive(Debug, Clone)]
pub(super) struct Ran {
    /// The caller's number.
    pub(super) number: u32,
    pub(super) test: Test,
    /// What tells its disturbance apart from others.
    pub(super) key: TestKey,
    /// The operations of the test space that it holds.
    pub(super) held: BTreeSet<usize>,
    /// Per requirement of the search the margin, as a share of the reference run's; `None` where it is not known.
    pub(super) margins: Vec<Option<f64>>,
    /// Per requirement, whether it is violated.
    pub(super) violated: Vec<bool>,
    /// Whether an operation had an effect.
    pub(super) had_effect: bool,
}

/// A requirement that the undisturbed system keeps.
#[derive(Debug, Clone, Copy)]
pub(super) struct Kept {
    /// Its margin without a disturbance, in the scale of margins.
    pub(super) undisturbed: f64,
    /// How many causes of it are known.
    pub(super) causes: usize,
}

/// A step from one of the tests that came nearest to a violation of a requirement: any of those that can be approached,
/// likelier one of which few causes are known. `explained` are tests that a known cause explains.
pub(super) fn step(
    setting: &Setting,
    domain: Option<&TestDomain>,
    ran: &[Ran],
    requirements: &[Kept],
    explained: impl Fn(usize, &BTreeSet<usize>) -> bool,
    pool: &[usize],
    stream: &mut Stream,
) -> Option<(Test, Vec<u32>)> {
    let mut near: Vec<Vec<(f64, usize)>> = Vec::new();
    let mut need: Vec<f64> = Vec::new();
    for (requirement, kept) in requirements.iter().enumerate() {
        let counts = |run: &Ran| run.had_effect && !run.violated[requirement] && !explained(requirement, &run.held);
        let counted = ran.iter().enumerate().filter(|(_, run)| counts(run));
        let with_margin = counted.filter_map(|(at, run)| Some((run.margins[requirement]?, at)));
        let mut margins: Vec<(f64, usize)> = with_margin.collect();
        margins.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
        // Only what is nearer than the undisturbed system leads anywhere.
        if margins.first().is_some_and(|(least, _)| *least < kept.undisturbed - 1e-6) {
            near.push(margins);
            need.push(1.0 / (1.0 + kept.causes as f64));
        }
    }
    if near.is_empty() {
        return None;
    }
    let near = &near[weighted(need.iter().copied(), stream)];
    if let Some(domain) = domain.filter(|_| stream.chance(0.5)) {
        // The nearest ones, and the latest others.
        let (nearest, others) = near.split_at(near.len().min(FITTED / 2));
        let mut others: Vec<(f64, usize)> = others.to_vec();
        others.sort_by_key(|(_, at)| std::cmp::Reverse(*at));
        others.truncate(FITTED - FITTED / 2);
        let fitted = nearest
            .iter()
            .chain(&others)
            .map(|&(margin, at)| (domain.embedded(ran[at].test.clone(), vec![ran[at].number]), Some(margin)));
        let known: Vec<_> = fitted.collect();
        let proposed = propose(domain, &known, stream);
        return Some((proposed.test, proposed.parents));
    }
    let best = near.len().min(BEST);
    let (_, at) = near[stream.below(best).min(stream.below(best))];
    Some((changed(setting, &ran[at].test, pool, stream), vec![ran[at].number]))
}

/// A test a step away.
fn changed(setting: &Setting, test: &Test, pool: &[usize], stream: &mut Stream) -> Test {
    let mut test = test.clone();
    if setting.space.conditions().is_some() {
        mutate(&mut test, &setting.space, &Rates::by_condition(), stream);
        return test;
    }
    let kinds = setting.kinds_of(&test);
    let mut is_changed = false;
    // Almost always one round is enough; a test without anything to choose cannot change.
    for _ in 0..20 {
        for (&kind, used) in kinds.iter().zip(&mut test.operations) {
            let before = used.clone();
            if stream.chance(0.5)
                && let (Activation::Time { start, end }, Some(range)) = (&mut used.activation, setting.window(kind))
            {
                (*start, *end) = window(setting, kind, range, (*start, *end), stream);
            }
            for (parameter, chosen) in used.parameters.iter_mut().enumerate() {
                let space = &setting.kind(kind).parameters[parameter];
                if !space.is_fixed() && stream.chance(0.5) {
                    *chosen = if stream.chance(0.4) {
                        aligned::choice(setting, kind, parameter, stream)
                    } else {
                        space.near(chosen, STEPS, stream)
                    };
                }
            }
            if *used != before {
                used.operation_seed = stream.bits();
                is_changed = true;
            }
        }
        if is_changed {
            break;
        }
    }
    let structure = stream.unit();
    let operations = &mut test.operations;
    if structure < 0.15 && operations.len() > setting.space.fewest() {
        operations.remove(stream.below(operations.len()));
    } else if structure < 0.45 && operations.len() < setting.space.most() {
        let kind = pool[stream.below(pool.len())];
        if setting.space.has_room(operations, setting.kind(kind)) {
            let meeting = match operations[stream.below(operations.len())].activation {
                Activation::Time { start, .. } if stream.chance(0.3) => Some(start),
                _ => None,
            };
            let added = aligned::operation(setting, kind, meeting, stream);
            operations.push(added);
        }
    }
    setting.space.settle(&mut test, stream);
    test
}

/// A window a step away: drawn anew, halved, doubled, or moved.
fn window(setting: &Setting, kind: usize, range: Range, (start, end): (f64, f64), stream: &mut Stream) -> (f64, f64) {
    let way = stream.unit();
    if way < 0.25 {
        return aligned::window(setting, kind, range, None, stream);
    }
    if way < 0.45 {
        let factor = if stream.chance(0.5) { 2.0 } else { 0.5 };
        let fixed = [start, end, f64::midpoint(start, end)][stream.below(3)];
        let scaled =
            ((fixed - (fixed - start) * factor).max(range.low), (fixed + (end - fixed) * factor).min(range.high));
        let scaled = (scaled.0, scaled.1.min(scaled.0 + range.longest));
        if scaled.1 - scaled.0 >= range.shortest.max(setting.moments.grain) {
            return scaled;
        }
        return (start, end);
    }
    range.interval_near((start, end), STEPS, stream)
}
