//! A lab in place of the simulator: the same runner, plan and hooks, which reach other robots.

use sesame_plan::{CampaignPlan, Lab};
use sesame_relay::transport::Connect;

use crate::runner::Runner;

/// Why a lab cannot be used.
#[derive(Debug, thiserror::Error)]
pub(crate) enum LabError {
    /// The space has none.
    #[error("the space has no lab; a `physical` block describes one, and `sesamec generate` takes it into the plan")]
    None,
    /// The space has others.
    #[error("there is no lab `{asked}`, there is {known}")]
    Unknown {
        /// Its name.
        asked: String,
        /// The names of those that are there.
        known: String,
    },
    /// The space has several, and none was named.
    #[error("the space has several labs; name one with `--lab`: {known}")]
    Ambiguous {
        /// Their names.
        known: String,
    },
    /// People run its tests.
    #[error("lab `{name}` has no simulator; if people run its tests, `sesamec lab form` prints a form for the results")]
    Unreachable {
        /// Its name.
        name: String,
    },
}

/// The lab of this name; without one, the only lab that there is.
pub(crate) fn find<'a>(plan: &'a CampaignPlan, name: Option<&str>) -> Result<&'a Lab, LabError> {
    let known = || plan.labs.iter().map(|lab| format!("`{}`", lab.name)).collect::<Vec<_>>().join(", ");
    match (name, &plan.labs[..]) {
        (_, []) => Err(LabError::None),
        (None, [lab]) => Ok(lab),
        (None, _) => Err(LabError::Ambiguous { known: known() }),
        (Some(name), labs) => labs
            .iter()
            .find(|lab| lab.name == name)
            .ok_or_else(|| LabError::Unknown { asked: name.to_owned(), known: known() }),
    }
}

/// The runner and its plan with a lab in place of the simulator.
pub(crate) fn in_lab(runner: Runner, plan: CampaignPlan, name: &str) -> Result<(Runner, CampaignPlan), LabError> {
    let lab = find(&plan, Some(name))?;
    let Some(simulator) = lab.simulator.clone() else { return Err(LabError::Unreachable { name: name.to_owned() }) };
    // Programs of a lab lie beside the space, as those of its simulator do.
    let folder = runner.directory.join(&runner.space);
    let connect = Connect::new(crate::interpreted::connect, folder);
    Ok((Runner { connect, ..runner }, CampaignPlan { simulator, ..plan }))
}

#[cfg(test)]
mod tests {
    use sesame_plan::testing::{lab, minimal};

    use super::*;

    #[test]
    fn a_lab_is_found_by_its_name_or_because_it_is_the_only_one() {
        let labs = |labs: &[&str]| CampaignPlan { labs: labs.iter().map(|name| lab(name)).collect(), ..minimal() };
        let found = |plan: &CampaignPlan, name: Option<&str>| match find(plan, name) {
            Ok(lab) => lab.name.clone(),
            Err(error) => error.to_string(),
        };
        assert_eq!(found(&labs(&["hall"]), None), "hall");
        assert_eq!(found(&labs(&["hall", "yard"]), Some("yard")), "yard");
        assert_eq!(found(&labs(&["hall", "yard"]), Some("attic")), "there is no lab `attic`, there is `hall`, `yard`");
        assert_eq!(
            found(&labs(&["hall", "yard"]), None),
            "the space has several labs; name one with `--lab`: `hall`, `yard`"
        );
        assert!(found(&labs(&[]), None).starts_with("the space has no lab"));
    }
}
