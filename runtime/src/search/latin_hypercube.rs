//! Latin hypercube sampling (`McKay` et al. 1979): tests spread evenly over each of their choices.
//!
//! A baseline like random tests, only that nothing is left to luck along a single choice: of n tests, one has its first
//! window's length in the shortest n-th part of all lengths, one in the next, and so on; likewise for every other choice
//! of every operation. Campaigns by condition have no such choices and are not sampled so.

use sesame_plan::{Activation, Choice, Shape, Test, TestOperation};

use crate::rng::{Stream, derive_seed, keyed_unit};
use crate::search::choice::PermittedChoice;
use crate::search::in_turn::InTurn;
use crate::search::permitted::{PermittedActivation, PermittedOperation};
use crate::search::range::Range;
use crate::search::{Candidate, Evaluated, Permitted, Strategy};

/// As many tests as evaluations, spread evenly over each choice, in generations of 50. Nothing is learned from results.
#[derive(Debug, Clone)]
pub struct LatinHypercube {
    permitted: Permitted,
    seed: u64,
    /// Per choice, the order in which its strata are taken.
    strata: Vec<Vec<usize>>,
    turn: InTurn,
}

impl LatinHypercube {
    /// So many tests of what is permitted.
    pub fn new(permitted: Permitted, evaluations: u32, seed: u64) -> Self {
        LatinHypercube { permitted, seed, strata: Vec::new(), turn: InTurn::new(evaluations) }
    }

    /// The value of the `index`th test for a choice, in `0..1`: each of as many equal parts holds one test's.
    fn value(&mut self, choice: usize, index: u32) -> f64 {
        while self.strata.len() <= choice {
            let mut stream = Stream::derive(self.seed, "latin hypercube", &[self.strata.len() as u64]);
            self.strata.push(stream.permutation(self.turn.evaluations as usize));
        }
        let stratum = self.strata[choice][index as usize] as f64;
        let within = keyed_unit(derive_seed(self.seed, "in stratum", &[]), u64::from(index), choice as u64);
        ((stratum + within) / f64::from(self.turn.evaluations)).min(BELOW_ONE)
    }

    fn test(&mut self, index: u32) -> Test {
        let mut next = 0;
        let mut value = |search: &mut Self| {
            next += 1;
            search.value(next - 1, index)
        };
        let (fewest, most) = (self.permitted.fewest(), self.permitted.most());
        let length = fewest + place(value(self), most - fewest + 1);
        let operations = (0..length)
            .map(|slot| {
                let chosen = value(self);
                let at = weighted(self.permitted.operations(), chosen);
                let kind = self.permitted.operations()[at].clone();
                let activation = match kind.activation {
                    PermittedActivation::Time(window) => {
                        let (start, end) = interval(window, [value(self), value(self)]);
                        Activation::Time { start, end }
                    }
                    _ => Activation::Offline,
                };
                let parameters = kind.parameters.iter().map(|it| choice(it, || value(self))).collect();
                let draw_seed = derive_seed(self.seed, "draws", &[u64::from(index), slot as u64]);
                TestOperation { operation: kind.operation, activation, parameters, draw_seed }
            })
            .collect();
        Test { operations }
    }
}

/// The greatest number below 1.
const BELOW_ONE: f64 = 1.0 - f64::EPSILON / 2.0;

/// The place of a value in `0..1` among so many equal parts.
fn place(value: f64, parts: usize) -> usize {
    #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "it is below the number of parts")]
    let place = libm::floor(value * parts as f64) as usize;
    place.min(parts - 1)
}

/// An operation, each as likely as it is to be included in a fresh test; all alike where none is.
fn weighted(operations: &[PermittedOperation], value: f64) -> usize {
    let total: f64 = operations.iter().map(|it| it.inclusion).sum();
    if total <= 0.0 {
        return place(value, operations.len());
    }
    let mut left = value * total;
    let found = operations.iter().position(|it| {
        left -= it.inclusion;
        left < 0.0
    });
    found.unwrap_or(operations.len() - 1)
}

/// An interval, uniform over all that fit: the first value decides its length, the second where it lies.
fn interval(range: Range, [length, place]: [f64; 2]) -> (f64, f64) {
    let room = range.high - range.low - range.shortest;
    // Of all pairs of ends, the share that is longer than x is (1 - x)².
    let length = range.shortest + room * (1.0 - libm::sqrt(1.0 - length));
    let start = range.low + (range.high - range.low - length) * place;
    (start.max(range.low), (start + length).min(range.high))
}

fn choice(permitted: &PermittedChoice, mut value: impl FnMut() -> f64) -> Choice {
    let number = |range: &Range, value: f64| {
        if range.integer {
            (range.low + libm::floor(value * (range.high - range.low + 1.0))).min(range.high)
        } else {
            (range.low + value * (range.high - range.low)).min(range.high)
        }
    };
    match permitted {
        PermittedChoice::Number(range, Shape::Value) => Choice::Value { value: number(range, value()) },
        PermittedChoice::Number(range, Shape::Range) => {
            let (low, high) = interval(*range, [value(), value()]);
            let whole = |x: f64| if range.integer { libm::rint(x) } else { x };
            Choice::Range { low: whole(low), high: whole(high) }
        }
        PermittedChoice::Point(axes) => {
            Choice::Point { point: [0, 1, 2].map(|axis: usize| number(&axes[axis], value())) }
        }
        PermittedChoice::Items(items) => Choice::Text { text: items[place(value(), items.len())].clone() },
    }
}

impl Strategy for LatinHypercube {
    fn ask(&mut self) -> Vec<Candidate> {
        let mut turn = self.turn;
        let batch = turn.ask(|index| self.test(index));
        self.turn = turn;
        batch
    }

    fn tell(&mut self, results: &[Evaluated]) {
        self.turn.tell(results.len());
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;
    use crate::search::landscape::LANDSCAPES;
    use crate::search::permitted::tests::{any_timed_plan, broken_rule};

    #[test]
    fn each_choice_has_one_test_in_each_of_its_equal_parts() {
        let plan = LANDSCAPES[0].plan(sesame_plan::Search::Random { evaluations: 1 });
        let mut search = LatinHypercube::new(Permitted::of(&plan).unwrap(), 40, 3);
        for choice in 0..8 {
            let mut strata: Vec<usize> = (0..40).map(|index| place(search.value(choice, index), 40)).collect();
            strata.sort_unstable();
            assert_eq!(strata, (0..40).collect::<Vec<_>>());
        }
        // Numbers of operations follow from the first choice: of 40 tests with one to five, eight each.
        let mut lengths = [0; 6];
        (0..40).for_each(|index| lengths[search.test(index).operations.len()] += 1);
        assert_eq!(lengths, [0, 8, 8, 8, 8, 8]);
    }

    proptest! {
        #[test]
        fn tests_are_permitted(plan in any_timed_plan(), seed: u64) {
            let mut search = LatinHypercube::new(Permitted::of(&plan).unwrap(), 20, seed);
            for index in 0..20 {
                prop_assert_eq!(broken_rule(&plan, &search.test(index)), None);
            }
        }
    }
}
