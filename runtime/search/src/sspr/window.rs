//! Where an operation's intervals may lie.

use sesame_plan::CampaignPlan;

use crate::space::test_space::{ActivationSpace, OperationSpace};

/// Where the intervals of an operation may lie, in shares of its permitted window.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Window {
    pub(crate) start: f64,
    pub(crate) end: f64,
    /// How long an interval is at least.
    pub(crate) shortest: f64,
    /// How long an interval is at most; infinite where `start` and `end` are the only limit.
    pub(crate) longest: f64,
}

impl Window {
    /// Intervals of any length between two shares.
    pub(crate) fn anywhere(start: f64, end: f64) -> Window {
        Window { start, end, shortest: 0.0, longest: f64::INFINITY }
    }

    /// How long an interval is at most, as a number.
    pub(crate) fn greatest_length(&self) -> f64 {
        self.longest.min(self.end - self.start)
    }

    /// The window of an operation in a campaign; `None` for one that acts before the start or after the end. Where
    /// conditions switch an operation, its intervals may be as short as they like.
    pub(crate) fn of(plan: &CampaignPlan, operation_space: &OperationSpace) -> Option<Window> {
        let within = plan.operation(operation_space.operation).within;
        let share = |time: f64| (time - within.start) / within.length();
        Some(match &operation_space.activation {
            ActivationSpace::Offline => return None,
            ActivationSpace::Time(range) => Window {
                start: share(range.low),
                end: share(range.high),
                shortest: range.shortest / within.length(),
                longest: range.longest / within.length(),
            },
            ActivationSpace::Condition { .. } => Window::anywhere(0.0, share(within.end.min(plan.campaign.end_after))),
        })
    }
}
