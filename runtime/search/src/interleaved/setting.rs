//! What all parts of the search share: the campaign's tests, what the reference run says of them, and single operations
//! that are as strong, as long and as well placed as is wanted.

use std::collections::BTreeSet;

use sesame_plan::{Activation, CampaignPlan, Choice, Span, Test, TestOperation};
use sesame_rng::Stream;

use super::moments::Moments;
use crate::evolve::predict::VariableTrajectories;
use crate::shrink::strength;
use crate::space::initial::fresh_activation;
use crate::space::range::Range;
use crate::space::test_space::{ActivationSpace, OperationSpace, TestSpace};

/// How many conditions are compared for the one that holds when it is wanted.
const CONDITIONS: usize = 6;

/// What does not change while a search goes on.
#[derive(Debug, Clone)]
pub(super) struct Setting {
    pub(super) plan: CampaignPlan,
    pub(super) space: TestSpace,
    pub(super) moments: Moments,
    /// The values of the variables of conditions in the reference run, in campaigns by condition.
    trajectories: Option<VariableTrajectories>,
}

impl Setting {
    pub(super) fn new(
        plan: CampaignPlan,
        space: TestSpace,
        moments: Moments,
        trajectories: Option<VariableTrajectories>,
    ) -> Self {
        Setting { plan, space, moments, trajectories }
    }

    /// An operation of the test space.
    pub(super) fn kind(&self, kind: usize) -> &OperationSpace {
        &self.space.operations()[kind]
    }

    /// The operations that a search may use: those that fresh tests include, or all if they include none.
    pub(super) fn usable(&self) -> Vec<usize> {
        let all = 0..self.space.operations().len();
        let likely: Vec<usize> = all.clone().filter(|&kind| self.kind(kind).inclusion > 0.0).collect();
        if likely.is_empty() { all.collect() } else { likely }
    }

    /// Per operation of a test, which one of the test space it is.
    pub(super) fn kinds_of(&self, test: &Test) -> Vec<usize> {
        let kinds = self.space.operations();
        let place = |used: &TestOperation| kinds.iter().position(|kind| kind.is_of(used));
        test.operations.iter().filter_map(place).collect()
    }

    /// The operations of the test space that a test holds.
    pub(super) fn held(&self, test: &Test) -> BTreeSet<usize> {
        self.kinds_of(test).into_iter().collect()
    }

    /// An operation with these choices.
    pub(super) fn operation(
        &self,
        kind: usize,
        activation: Activation,
        parameters: Vec<Choice>,
        stream: &mut Stream,
    ) -> TestOperation {
        let operation = self.kind(kind).operation;
        TestOperation { operation, activation, parameters, operation_seed: stream.bits(), messages: None }
    }

    /// An activation that covers as much of a stretch of time as is permitted; `None` if no permitted window lies in
    /// it. Where conditions switch, the best of several.
    pub(super) fn over(&self, kind: usize, stretch: Span, stream: &mut Stream) -> Option<Activation> {
        match &self.kind(kind).activation {
            ActivationSpace::Offline => Some(Activation::Offline),
            ActivationSpace::Time(range) => {
                let (start, end) = (stretch.start.max(range.low), stretch.end.min(range.high));
                let end = end.min(start + range.longest);
                (end - start >= range.shortest.max(self.moments.grain)).then_some(Activation::Time { start, end })
            }
            ActivationSpace::Condition { .. } => {
                let inside = |activation: &Activation| {
                    self.spans_of(kind, activation).iter().map(|span| overlap(*span, stretch)).sum::<f64>()
                };
                self.best_condition(kind, inside, stream)
            }
        }
    }

    /// Draws several fresh conditions and returns the one that measures most. The measure is above zero for conditions
    /// that will do.
    pub(super) fn best_condition(
        &self,
        kind: usize,
        measure: impl Fn(&Activation) -> f64,
        stream: &mut Stream,
    ) -> Option<Activation> {
        let mut best: Option<(f64, Activation)> = None;
        for _ in 0..CONDITIONS {
            let activation = fresh_activation(self.kind(kind), stream);
            let measured = measure(&activation);
            if best.as_ref().is_none_or(|(most, _)| measured > *most) {
                best = Some((measured, activation));
            }
        }
        best.map(|(_, activation)| activation)
    }

    /// When an operation would be active in the undisturbed system.
    pub(super) fn spans_of(&self, kind: usize, activation: &Activation) -> Vec<Span> {
        match activation {
            &Activation::Time { start, end } => vec![Span { start, end }],
            Activation::Offline => vec![Span { start: 0.0, end: self.moments.end }],
            Activation::Condition { .. } | Activation::ConditionFor { .. } => {
                let Some(trajectories) = &self.trajectories else { return Vec::new() };
                trajectories.intervals_of(&self.plan, self.kind(kind).operation, activation)
            }
        }
    }

    /// How strong a single operation is, from 0 to 1.
    pub(super) fn strength(&self, used: &TestOperation) -> f64 {
        strength(&self.plan, &Test { operations: vec![used.clone()] })
    }

    /// The window in which an operation by time may be active.
    pub(super) fn window(&self, kind: usize) -> Option<Range> {
        match self.kind(kind).activation {
            ActivationSpace::Time(range) => Some(range),
            _ => None,
        }
    }
}

fn overlap(a: Span, b: Span) -> f64 {
    (a.end.min(b.end) - a.start.max(b.start)).max(0.0)
}
