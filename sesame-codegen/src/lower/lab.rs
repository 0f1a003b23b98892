//! Labs.

use sesame_dsl::model::physical::Physical;
use sesame_plan as plan;

use super::selection::Selection;

impl Selection {
    pub(super) fn lab(&self, lab: &Physical) -> plan::Lab {
        plan::Lab {
            name: lab.declaration.name.clone(),
            doc: lab.declaration.doc.clone(),
            repeats: lab.repeats,
            cost: lab.cost,
            exclude: lab
                .exclude
                .iter()
                .map(|&(metric, bound)| plan::LabExclusion { metric: self.metric(metric), bound })
                .collect(),
            rank: lab
                .rank
                .iter()
                .map(|&(metric, order)| plan::RankKey { metric: self.metric(metric), order })
                .collect(),
            budget: lab.budget.clone(),
            tolerances: lab
                .tolerance
                .iter()
                .map(|&(metric, value)| plan::LabTolerance { metric: self.metric(metric), value })
                .collect(),
            interlock: lab.interlock.iter().map(|&metric| self.metric(metric)).collect(),
        }
    }
}
