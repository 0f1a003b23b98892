//! Whether a campaign can be done with the metrics, operations and tests of its plan.

use crate::condition::{ConditionEnd, ConditionSpace, Variable};
use crate::{
    ActivationMode, BoostedChildren, Campaign, CampaignPlan, Confirmation, CoverageGoal, Exploration, Search,
    Statistic, StopRule,
};

use super::check::{
    Checked, at, at_least_one, distinct, each, filled, finite, integers, name, ordered, positive, positive_share,
    require, share, unit, wrong,
};

impl CampaignPlan {
    pub(super) fn sound_campaign(&self, campaign: &Campaign) -> Checked {
        at("name", name(&campaign.name))?;
        each("objectives", &campaign.objectives, |&id| {
            self.has_metric(id)?;
            let metric = self.metric(id);
            require(metric.direction.is_some(), || format!("the metric `{}` has no direction", metric.name))
        })?;
        at("objectives", distinct(&campaign.objectives))?;
        each("operations", &campaign.operations, |&id| self.has_operation(id))?;
        at("operations", distinct(&campaign.operations))?;
        let (min, max) = (campaign.count.min, campaign.count.max);
        at("count", require(min <= max, || format!("runs from {min} to {max}")))?;
        if let ActivationMode::Condition { space } = &campaign.activation {
            at("activation.space", self.condition_space(space))?;
            each("operations", &campaign.operations, |&id| {
                let operation = self.operation(id);
                let fits = operation.lengths.is_none_or(|lengths| space.end.lengths(Some(lengths)).is_some());
                require(fits, || format!("no activation of `{}` has a permitted length", operation.name))
            })?;
        }
        at("search", self.sound_search(&campaign.search))?;
        at("coverage", campaign.coverage.as_ref().map_or(Ok(()), coverage))?;
        at("exploration", campaign.exploration.as_ref().map_or(Ok(()), exploration))?;
        at("confirm", campaign.confirm.as_ref().map_or(Ok(()), confirmation))?;
        at("neighbours", campaign.neighbours.map_or(Ok(()), at_least_one))?;
        each("stop", &campaign.stop, stop_rule)?;
        at("end_after", positive(campaign.end_after))?;
        at("end_when", campaign.end_when.as_ref().map_or(Ok(()), |condition| self.condition(condition)))
    }

    fn condition_space(&self, space: &ConditionSpace) -> Checked {
        let ConditionSpace { variables, depth, integers: whole, end, times } = space;
        at("variables", filled(variables))?;
        each("variables", variables, |variable| {
            unit(variable.unit.as_ref())?;
            at("metric", self.has_metric(variable.metric))?;
            at("low", variable.low.map_or(Ok(()), finite))?;
            at("high", variable.high.map_or(Ok(()), finite))?;
            let ends = variable.low.zip(variable.high);
            if let Some(step) = variable.step {
                at("step", positive(step))?;
                let steps = ends.map_or(0.0, |(low, high)| (high - low) / step);
                let fits = (1.0..=Variable::MOST_STEPS).contains(&steps);
                at("step", require(fits, || format!("makes {steps} steps")))?;
            }
            ends.map_or(Ok(()), |(low, high)| require(low <= high, || format!("runs from {low} to {high}")))
        })?;
        at("depth", at_least_one(*depth))?;
        let most = ConditionSpace::MOST_DEPTH;
        at("depth", require(*depth <= most, || format!("is {depth}, more than {most}")))?;
        at("integers", integers(*whole))?;
        if let ConditionEnd::Length { low, high } = *end {
            at("end", positive(low))?;
            at("end", ordered(low, high))?;
        }
        at("times", at_least_one(*times))
    }

    fn sound_search(&self, search: &Search) -> Checked {
        match search {
            Search::Strategy { strategy, evaluations: _ } => match strategy.not_permitted() {
                None => Ok(()),
                Some((setting, _)) => {
                    at("strategy", at(setting.keyword(), wrong(format!("must be {}", setting.bounds()))))
                }
            },
            Search::Repeat { test, times: _ } => at("test", self.has_test(*test)),
        }
    }
}

fn coverage(goal: &CoverageGoal) -> Checked {
    at("axes", filled(&goal.axes))?;
    at("axes", distinct(goal.axes.iter().map(|axis| axis.dimension)))?;
    each("axes", &goal.axes, |axis| {
        ordered(axis.low, axis.high)?;
        require(axis.low < axis.high, || "ends where it begins".to_owned())?;
        at("cells", at_least_one(axis.cells))
    })?;
    at("hits", at_least_one(goal.hits))?;
    at("stop_at", goal.stop_at.map_or(Ok(()), share))
}

fn exploration(exploration: &Exploration) -> Checked {
    match exploration {
        Exploration::Boost { every_generations, children, tries: _ } => {
            at("every_generations", at_least_one(*every_generations))?;
            match children {
                BoostedChildren::Every { iterations } => at("children.iterations", at_least_one(*iterations)),
                BoostedChildren::Falling { .. } => Ok(()),
            }
        }
        Exploration::Construct { share: some, until } => {
            at("share", share(*some))?;
            at("until", until.map_or(Ok(()), share))
        }
        Exploration::Novelty { neighbours, over } => {
            at("neighbours", at_least_one(*neighbours))?;
            at("over", filled(over))
        }
        Exploration::Predict { candidates } => at("candidates", at_least_one(*candidates)),
    }
}

fn confirmation(confirmation: &Confirmation) -> Checked {
    at("times", at_least_one(confirmation.times))?;
    match confirmation.by {
        Statistic::Mean | Statistic::Median => Ok(()),
        Statistic::Quantile { share } => at("by.share", positive_share(share)),
    }
}

fn stop_rule(rule: &StopRule) -> Checked {
    match *rule {
        StopRule::WallTime { seconds } => at("seconds", positive(seconds)),
        StopRule::Stagnation { generations, below } => {
            at("generations", at_least_one(generations))?;
            at("below", positive(below))
        }
        StopRule::Discovery { below } => at("below", positive_share(below)),
        StopRule::Completeness { share } => at("share", positive_share(share)),
        StopRule::NoNewCause { tests } => at("tests", at_least_one(tests)),
        StopRule::EveryPair => Ok(()),
    }
}
