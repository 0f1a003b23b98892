//! Labs.

use crate::{CampaignPlan, Lab, LabCost, RankOrder};

use super::bound;
use super::check::{Checked, at, at_least_one, distinct, each, filled, finite, name, positive, require, share};

fn not_negative(number: f64) -> Checked {
    finite(number)?;
    require(number >= 0.0, || format!("{number} is below 0"))
}

impl CampaignPlan {
    pub(super) fn sound_lab(&self, lab: &Lab) -> Checked {
        at("name", name(&lab.name))?;
        at("simulator", lab.simulator.as_ref().map_or(Ok(()), |simulator| self.sound_simulator(simulator)))?;
        at("repeats", at_least_one(lab.repeats))?;
        let LabCost { base, per_operation } = lab.cost;
        at("cost.base", not_negative(base))?;
        at("cost.per_operation", not_negative(per_operation))?;
        at("cost", positive(base + per_operation))?;
        each("exclude", &lab.exclude, |exclusion| {
            at("metric", self.has_metric(exclusion.metric))?;
            at("bound", bound(exclusion.bound))
        })?;
        at("rank", distinct(lab.rank.iter().map(|key| key.metric)))?;
        each("rank", &lab.rank, |key| {
            at("metric", self.has_metric(key.metric))?;
            if let RankOrder::ClosestTo { value } = key.order { at("value", finite(value)) } else { Ok(()) }
        })?;
        if let Some(budget) = &lab.budget {
            at("budget.limit", positive(budget.limit))?;
            at("budget.lambda", share(budget.lambda))?;
            at("budget.over", filled(&budget.over))?;
            at("budget.over", distinct(&budget.over))?;
        }
        at("tolerances", distinct(lab.tolerances.iter().map(|tolerance| tolerance.metric)))?;
        each("tolerances", &lab.tolerances, |tolerance| {
            at("metric", self.has_metric(tolerance.metric))?;
            at("value", not_negative(tolerance.value))
        })?;
        at("interlock", distinct(&lab.interlock))?;
        each("interlock", &lab.interlock, |&metric| self.has_metric(metric))
    }
}
