//! The plan and the task that results hold, read and checked.

use sesame_plan::{CampaignPlan, Task};

/// The plan and the task of results. `task` is what is recorded of the task: nothing for a campaign.
pub(super) fn read(plan: &str, task: Option<&str>) -> Result<(CampaignPlan, Task), String> {
    let plan: CampaignPlan = serde_json::from_str(plan).map_err(|error| format!("its plan cannot be read: {error}"))?;
    let task = task.map_or(Ok(Task::Campaign), serde_json::from_str);
    let task = task.map_err(|error| format!("its task cannot be read: {error}"))?;
    plan.validate_task(&task).map_err(|error| format!("its task is not sound: {error}"))?;
    Ok((plan, task))
}

#[cfg(test)]
mod tests {
    use serde_json::json;

    use super::*;
    use crate::sample;

    #[test]
    fn a_plan_or_task_that_is_not_sound_is_refused() {
        let refused = |plan: &str, task: Option<&str>| read(plan, task).unwrap_err();
        assert!(refused("{}", None).contains("its plan cannot be read: missing field `schema`"));
        let plan = serde_json::to_string(&sample::plan()).unwrap();
        let later = plan.replacen("\"schema\":2", "\"schema\":3", 1);
        assert!(refused(&later, None).contains("is 3, this release knows 2"));
        let known = json!({ "kind": "known", "tests": [9] }).to_string();
        assert!(refused(&plan, Some(&known)).contains("its task is not sound: tests[0]: there is no test 9"));
        assert!(refused(&plan, Some("{}")).contains("its task cannot be read"));
    }
}
