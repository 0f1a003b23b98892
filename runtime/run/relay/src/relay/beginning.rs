//! What a run begins with: the values of the parameters of the space.

use std::sync::Arc;

use sesame_plan::{CampaignPlan, OperationKind};

use crate::fuzz::Disturbance;
use crate::metric::Scene;
use crate::relay::stage::Stage;

/// The parameters of the space for which the test chose a value.
pub(super) fn chosen(operations: &[Stage]) -> Arc<Scene> {
    let scenes = operations.iter().filter_map(|stage| match stage.disturbance {
        Disturbance::Scene(value) => Some((stage.name.clone(), value)),
        _ => None,
    });
    scenes.collect()
}

/// The values with which a run begins: those that the test chooses, and the usual values of the others.
#[derive(Default)]
pub(super) struct Beginning {
    /// The values of the simulator's parameters, by their names.
    pub(super) parameters: Vec<(String, f64)>,
    /// The values in the arguments of launched programs, by the names of their placeholders.
    pub(super) arguments: Vec<(String, String)>,
}

impl Beginning {
    pub(super) fn of(plan: &CampaignPlan, chosen: &Scene) -> Self {
        let mut beginning = Beginning::default();
        for operation in &plan.operations {
            let OperationKind::Scene { parameter, usual } = &operation.kind else { continue };
            let chosen = chosen.iter().find(|(name, _)| *name == operation.name).map(|&(_, value)| value);
            let Some(value) = chosen.or(*usual) else { continue };
            match parameter {
                Some(parameter) => beginning.parameters.push((parameter.clone(), value)),
                None => beginning.arguments.push((operation.name.clone(), operation.as_argument(value))),
            }
        }
        beginning
    }
}
