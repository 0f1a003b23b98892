//! Campaigns whose tests are vectors: every test holds the same operations, each once and without a window, and chooses
//! nothing but numbers.
//!
//! Operations before the start or after the end of a run make such campaigns: a test is then the numbers that they
//! choose. As nothing is hit or missed in time, a process over these numbers foresees what a test does.

use sesame_plan::{Activation, Choice, ChoiceKind, Test, TestOperation};
use sesame_rng::derive_seed;

use crate::space::parameter_space::ParameterSpace;
use crate::space::range::Range;
use crate::space::test_space::ActivationSpace;
use crate::space::test_space::TestSpace;

/// What turns vectors of the unit box into tests.
#[derive(Debug, Clone)]
pub(super) struct Vectors {
    test_space: TestSpace,
    variables: usize,
    seed: u64,
}

impl Vectors {
    /// The vectors that the tests of a campaign are; `None` if they are none, or if there is nothing to choose.
    pub(super) fn from_space(test_space: &TestSpace, seed: u64) -> Option<Self> {
        let kinds = test_space.operations();
        let once = test_space.fewest() == kinds.len() && test_space.most() == kinds.len();
        let mut variables = 0;
        for kind in kinds {
            if kind.activation != ActivationSpace::Offline {
                return None;
            }
            for parameter in &kind.parameters {
                variables += match parameter {
                    _ if parameter.is_fixed() => 0,
                    ParameterSpace::Number(_, ChoiceKind::Value) => 1,
                    ParameterSpace::Point(axes) => axes.iter().filter(|axis| !axis.is_fixed()).count(),
                    ParameterSpace::Number(_, ChoiceKind::Range) | ParameterSpace::Items(_) => return None,
                };
            }
        }
        (once && variables > 0).then(|| Vectors { test_space: test_space.clone(), variables, seed })
    }

    /// How many numbers a test chooses.
    pub(super) fn variables(&self) -> usize {
        self.variables
    }

    /// The test of a vector of the unit box, as long as there are [variables](Vectors::variables). `number` tells the
    /// draws of tests apart.
    pub(super) fn test(&self, vector: &[f64], number: u64) -> Test {
        assert!(vector.len() == self.variables, "a vector has as many numbers as a test chooses");
        let mut shares = vector.iter().copied();
        let mut choose = |range: &Range| {
            if range.is_fixed() {
                return range.low;
            }
            range.at(shares.next().expect("each variable has its number"))
        };
        let mut operations = Vec::with_capacity(self.test_space.operations().len());
        for (at, kind) in (0u64..).zip(self.test_space.operations()) {
            let choice = |parameter: &ParameterSpace| match parameter {
                ParameterSpace::Number(range, _) => Choice::Value { value: choose(range) },
                ParameterSpace::Point(axes) => Choice::Point { point: axes.each_ref().map(&mut choose) },
                ParameterSpace::Items(items) => Choice::Text { text: items[0].clone() },
            };
            operations.push(TestOperation {
                operation: kind.operation,
                activation: Activation::Offline,
                parameters: kind.parameters.iter().map(choice).collect(),
                operation_seed: derive_seed(self.seed, "vector", &[number, at]),
                messages: None,
            });
        }
        Test { operations }
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use sesame_plan::{ActivationMode, CampaignPlan, Count, Domain, Moment, OperationKind};

    use super::*;
    use crate::space::test_space::tests::{any_timed_plan, broken_rule};

    /// All operations before the start, and each in every test.
    fn all_before_the_start(mut plan: CampaignPlan) -> CampaignPlan {
        plan.campaign.activation = ActivationMode::Time;
        for operation in &mut plan.operations {
            operation.kind = OperationKind::Custom { moment: Moment::BeforeStart };
            operation.topic = None;
            for parameter in &mut operation.parameters {
                if let Domain::Number { shape, .. } = &mut parameter.domain {
                    *shape = ChoiceKind::Value;
                }
            }
        }
        let kinds = u32::try_from(plan.campaign.operations.len()).unwrap();
        plan.campaign.count = Count { min: kinds, max: kinds };
        plan
    }

    proptest! {
        #[test]
        fn every_vector_is_a_permitted_test_that_holds_each_operation_once(
            plan in any_timed_plan(), shares in prop::collection::vec(0.0..=1.0f64, 40), number: u64,
        ) {
            let plan = all_before_the_start(plan);
            let test_space = TestSpace::from_plan(&plan).unwrap();
            let texts = plan.campaign.operations.iter().flat_map(|&id| &plan.operation(id).parameters);
            let chosen = texts.clone().any(|parameter| {
                let items = |items: &Vec<String>| items.len() > 1;
                matches!(&parameter.domain, Domain::Texts { texts: of } | Domain::Files { files: of } if items(of))
            });
            let Some(vectors) = Vectors::from_space(&test_space, 1) else {
                let fixed = test_space.operations().iter().all(|operation| operation.parameters.iter().all(ParameterSpace::is_fixed));
                prop_assert!(chosen || fixed, "numbers are to be chosen, and nothing else");
                return Ok(());
            };
            prop_assert!(!chosen);
            let test = vectors.test(&shares[..vectors.variables()], number);
            prop_assert_eq!(broken_rule(&plan, &test), None);
            let held: Vec<_> = test.operations.iter().map(|operation| operation.operation).collect();
            prop_assert_eq!(held, plan.campaign.operations);
        }
    }

    #[test]
    fn tests_that_differ_in_windows_or_in_what_they_hold_are_no_vectors() {
        let plan = || {
            crate::testing::synthetic_robots::SYNTHETIC_ROBOTS[0]
                .plan(sesame_plan::Search::new(sesame_plan::Strategy::Random, 1))
        };
        assert!(Vectors::from_space(&TestSpace::from_plan(&plan()).unwrap(), 1).is_none(), "windows");
        let fixed = all_before_the_start(plan());
        assert_eq!(Vectors::from_space(&TestSpace::from_plan(&fixed).unwrap(), 1).unwrap().variables(), 2);
        let mut fewer = fixed;
        fewer.campaign.count.min = 1;
        assert!(Vectors::from_space(&TestSpace::from_plan(&fewer).unwrap(), 1).is_none(), "one operation or two");
    }
}
