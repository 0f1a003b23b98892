//! Labs, and what brings a simulation closer to one.

use crate::{CampaignPlan, Compensation, Fitted, Lab, LabCost, RankOrder, ShapeForm, ShapePlace};

use super::bound;
use super::check::{Checked, at, at_least_one, distinct, each, filled, finite, name, positive, require, share};

fn not_negative(number: f64) -> Checked {
    finite(number)?;
    require(number >= 0.0, || format!("{number} is below 0"))
}

/// A value that something of a simulation can be set to.
fn level(what: &Fitted, value: f64) -> Checked {
    if what.is_not_negative() { not_negative(value) } else { finite(value) }
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
        each("interlock", &lab.interlock, |&metric| self.has_metric(metric))?;
        at("shapes", distinct(lab.shapes.iter().map(|shape| &shape.name)))?;
        each("shapes", &lab.shapes, |shape| {
            at("name", name(&shape.name))?;
            match &shape.form {
                ShapeForm::Sphere { radius } => at("form.radius", positive(*radius)),
                ShapeForm::Box { edges } => each("form.edges", edges, |&edge| positive(edge)),
            }?;
            match &shape.place {
                ShapePlace::Pose { pose } => at("place.pose", name(pose)),
                ShapePlace::Fixed { centre } => each("place.centre", centre, |&coordinate| finite(coordinate)),
            }?;
            at("expand", not_negative(shape.expand))
        })?;
        at("fits", distinct(lab.fits.iter().map(|fit| &fit.what)))?;
        each("fits", &lab.fits, |fit| {
            at("what", self.sound_fitted(&fit.what))?;
            at("low", level(&fit.what, fit.low))?;
            at("high", level(&fit.what, fit.high))?;
            require(fit.low <= fit.high, || format!("{} is above {}", fit.low, fit.high))
        })
    }

    pub(super) fn sound_compensation(&self, compensation: &Compensation) -> Checked {
        at("lab", name(&compensation.lab))?;
        at("adjustments", distinct(compensation.adjustments.iter().map(|adjustment| &adjustment.what)))?;
        each("adjustments", &compensation.adjustments, |adjustment| {
            at("what", self.sound_fitted(&adjustment.what))?;
            at("levels", filled(&adjustment.levels))?;
            each("levels", &adjustment.levels, |&value| level(&adjustment.what, value))
        })
    }

    fn sound_fitted(&self, what: &Fitted) -> Checked {
        if let Fitted::Parameter { name: parameter } = what {
            at("name", name(parameter))?;
        }
        what.topic().map_or(Ok(()), |topic| at("topic", self.has_topic(topic)))
    }
}
