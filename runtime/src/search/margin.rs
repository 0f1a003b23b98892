//! Margins: how far the requirements of a space are from their violation in one run.

use sesame_plan::{Bound, CampaignPlan};

use crate::observation::{Observation, Outcome};

/// How far a requirement is from its violation in one test.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Margin {
    /// The margin, never NaN, smaller where the requirement is nearer to its violation; `None` where the run says nothing.
    pub value: Option<f64>,
    /// Whether it is violated.
    pub violated: bool,
}

impl Margin {
    /// That of a bound of which a metric has this value, which is not NaN.
    pub fn of(bound: Bound, value: f64) -> Self {
        Margin { value: Some(to_bound(bound, value)), violated: !bound.holds(value) }
    }
}

/// The margin of each requirement of the plan, in its order.
///
/// A margin is in the unit of the requirement's metric: how far the metric may still move before it breaks the bound, and
/// negative by how far it has moved beyond. A metric without a value has none. Of a run that crashed or hung a violation
/// stands, and nothing else is known.
pub fn margins(plan: &CampaignPlan, observation: &Observation) -> Vec<Margin> {
    let whole = match observation.outcome {
        Outcome::Completed | Outcome::Void | Outcome::Unknown => true,
        Outcome::Crash { .. } | Outcome::Timeout { .. } => false,
    };
    let margin = |requirement: &sesame_plan::Requirement| {
        let value = observation.metrics.get(requirement.metric.index()).and_then(|metric| metric.value);
        let Some(value) = value.filter(|value| !value.is_nan()) else {
            return Margin { value: None, violated: false };
        };
        let margin = Margin::of(requirement.bound, value);
        if whole || margin.violated { margin } else { Margin { value: None, ..margin } }
    };
    plan.requirements.iter().map(margin).collect()
}

/// How far a value is from breaking a bound.
fn to_bound(bound: Bound, x: f64) -> f64 {
    // Infinite values at infinite bounds are as far as can be.
    let ahead = |difference: f64| if difference.is_nan() { f64::INFINITY } else { difference };
    match bound {
        Bound::AtMost { value } | Bound::Below { value } => ahead(value - x),
        Bound::AtLeast { value } | Bound::Above { value } => ahead(x - value),
        Bound::Equal { value } => -(x - value).abs(),
        Bound::Within { low, high } => ahead(x - low).min(ahead(high - x)),
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    proptest! {
        #[test]
        fn margins_are_negative_where_a_bound_is_broken_and_positive_where_it_is_kept(
            x in -5i32..5, at in -5i32..5, width in 0i32..5,
        ) {
            let (x, value, high) = (f64::from(x), f64::from(at), f64::from(at + width));
            let bounds = [
                Bound::AtMost { value }, Bound::Below { value }, Bound::AtLeast { value }, Bound::Above { value },
                Bound::Equal { value }, Bound::Within { low: value, high },
            ];
            for bound in bounds {
                let margin = to_bound(bound, x);
                prop_assert!(if bound.holds(x) { margin >= 0.0 } else { margin <= 0.0 }, "{bound:?} of {x}: {margin}");
                // The way to the violation is that long: what moves less stays on its side.
                for nearer in [x - margin.abs() / 2.0, x + margin.abs() / 2.0] {
                    prop_assert!(margin == 0.0 || bound.holds(nearer) == bound.holds(x), "{bound:?} of {x}");
                }
            }
        }
    }
}
