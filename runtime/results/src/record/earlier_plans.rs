//! Plans that earlier releases kept in their results, converted as they are read. The file keeps what it holds, and so
//! its digest.
//!
//! In plans of schema 1, the commands `known` and `shrink` put what they did in the place of the campaign's search;
//! since schema 2 this is a [`Task`] beside the plan.

use serde::Deserialize;
use serde_json::{Value, json};

use sesame_plan::{CampaignPlan, Task};

/// The plan and the task of results. `task` is what is recorded of the task: nothing for a campaign.
pub(super) fn read(plan: &str, task: Option<&str>) -> Result<(CampaignPlan, Task), String> {
    #[derive(Deserialize)]
    struct Version {
        schema: u32,
    }
    let failed = |error: serde_json::Error| format!("its plan cannot be read: {error}");
    let version: Version = serde_json::from_str(plan).map_err(failed)?;
    let (plan, task): (CampaignPlan, Task) = if version.schema == 1 {
        let mut value: Value = serde_json::from_str(plan).map_err(failed)?;
        let task = from_schema_1(&mut value).ok_or("its plan cannot be read: it is not a plan of schema 1")?;
        let plan = serde_json::from_value(value).map_err(failed)?;
        (plan, serde_json::from_value(task).map_err(|error| format!("its task cannot be read: {error}"))?)
    } else {
        let task = task.map_or(Ok(Task::Campaign), serde_json::from_str);
        (
            serde_json::from_str(plan).map_err(failed)?,
            task.map_err(|error| format!("its task cannot be read: {error}"))?,
        )
    };
    plan.validate_task(&task).map_err(|error| format!("its task is not sound: {error}"))?;
    Ok((plan, task))
}

/// Converts a plan of schema 1, and returns the task that it held. `None` if a part of it is not what it has to be.
fn from_schema_1(plan: &mut Value) -> Option<Value> {
    plan["schema"] = json!(2);
    for test in plan.get_mut("tests")?.as_array_mut()? {
        for operation in test.get_mut("test")?.get_mut("operations")?.as_array_mut()? {
            let operation = operation.as_object_mut()?;
            let seed = operation.remove("draw_seed")?;
            operation.insert("operation_seed".to_owned(), seed);
        }
    }
    let mut task = json!({ "kind": "campaign" });
    let search = plan.get("campaign")?.get("search")?.clone();
    let evaluations = search.get("evaluations");
    // What a campaign searched for is not known where something else stood in its place; nothing asks for it there.
    let unknown = |evaluations: Value| json!({ "kind": "strategy", "strategy": { "kind": "random" }, "evaluations": evaluations });
    let search = match search.get("kind")?.as_str()? {
        "repeat" => search,
        "known" => {
            let tests = search.get("tests")?.as_array()?.len();
            task = search;
            unknown(json!(tests))
        }
        "shrink" => {
            let position = usize::try_from(search.get("test")?.as_u64()?).ok()?;
            let known = plan.get("tests")?.get(position)?.clone();
            let evaluations = evaluations?.clone();
            task = search;
            task["name"] = known.get("name")?.clone();
            task["test"] = known.get("test")?.clone();
            unknown(evaluations)
        }
        _ => {
            let evaluations = evaluations?.clone();
            let mut strategy = search;
            strategy.as_object_mut()?.remove("evaluations");
            json!({ "kind": "strategy", "strategy": strategy, "evaluations": evaluations })
        }
    };
    plan["campaign"]["search"] = search;
    Some(task)
}

#[cfg(test)]
mod tests {
    use sesame_plan::{Failing, KnownTestId, RequirementId, Search, Shrinking, Strategy};

    use super::*;
    use crate::record::sample;

    /// The sample's plan as schema 1 had it, with this search.
    fn of_schema_1(search: &Value) -> String {
        let mut plan = serde_json::to_value(sample::plan()).unwrap();
        plan["schema"] = json!(1);
        plan["campaign"]["search"] = search.clone();
        serde_json::to_string(&plan).unwrap().replace("operation_seed", "draw_seed")
    }

    fn converted(search: &Value) -> (CampaignPlan, Task) {
        read(&of_schema_1(search), None).unwrap()
    }

    #[test]
    fn searches_of_plans_of_schema_1_are_those_of_today() {
        let strategies = [
            (json!({ "kind": "nsga2", "population": 10 }), Strategy::Nsga2 { population: 10 }),
            (json!({ "kind": "map_elites", "population": 4 }), Strategy::MapElites { population: 4 }),
            (json!({ "kind": "falsification", "population": 1 }), Strategy::Falsification { population: 1 }),
            (json!({ "kind": "latin_hypercube" }), Strategy::LatinHypercube),
            (json!({ "kind": "sobol" }), Strategy::Sobol),
            (json!({ "kind": "random" }), Strategy::Random),
        ];
        for (mut search, strategy) in strategies {
            search["evaluations"] = json!(210);
            let (plan, task) = converted(&search);
            assert_eq!((plan.campaign.search.clone(), task), (Search::new(strategy, 210), Task::Campaign));
            assert_eq!(plan.tests, sample::plan().tests);
        }
        let (plan, task) = converted(&json!({ "kind": "repeat", "test": 0, "times": 7 }));
        assert_eq!(plan.campaign.search, Search::Repeat { test: KnownTestId(0), times: 7 });
        assert_eq!(task.repeated(&plan).map(|repeated| (repeated.name, repeated.times)), Some(("known_jitter", 7)));
    }

    #[test]
    fn what_commands_put_in_the_place_of_a_search_is_a_task() {
        let (_, task) = converted(&json!({ "kind": "known", "tests": [0] }));
        assert_eq!(task, Task::Known { tests: vec![KnownTestId(0)], lab: None });
        let shrink = json!({
            "kind": "shrink", "test": 0, "failing": { "kind": "violation", "requirements": [1] },
            "simulator_seed": u64::MAX, "runs": 2, "evaluations": 90,
        });
        let (plan, task) = converted(&shrink);
        let expected = Shrinking {
            name: "known_jitter".to_owned(),
            test: plan.tests[0].test.clone(),
            failing: Failing::Violation { requirements: vec![RequirementId(1)], margins: Vec::new() },
            simulator_seed: u64::MAX,
            runs: 2,
            evaluations: 90,
        };
        assert_eq!(task, Task::Shrink(expected));
    }

    #[test]
    fn a_plan_or_task_that_is_not_sound_is_refused() {
        let refused = |plan: &str, task: Option<&str>| read(plan, task).unwrap_err();
        assert!(refused("{}", None).contains("missing field `schema`"));
        assert!(refused(r#"{ "schema": 1 }"#, None).contains("not a plan of schema 1"));
        assert!(refused(r#"{ "schema": 3 }"#, None).contains("is 3, this release knows 2"));
        let known = json!({ "kind": "known", "tests": [9] });
        assert!(refused(&of_schema_1(&known), None).contains("there is no test 9"));
        let plan = serde_json::to_string(&sample::plan()).unwrap();
        assert!(
            refused(&plan, Some(&known.to_string())).contains("its task is not sound: tests[0]: there is no test 9")
        );
        assert!(refused(&plan, Some("{}")).contains("its task cannot be read"));
    }
}
