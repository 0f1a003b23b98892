//! The arguments of launched programs, as far as a campaign knows them before its tests.

use std::collections::BTreeMap;

use sesame_dsl::model::Space;
use sesame_plan as plan;

use super::operation::operation;

/// The plan with the usual values of scenes that its tests never choose in the arguments of what it launches.
pub(super) fn launched_as_usual(mut plan: plan::CampaignPlan, space: &Space) -> plan::CampaignPlan {
    let is_chosen = |name: &str| plan.operations.iter().any(|operation| operation.name == name);
    let usual = space.operations.values().filter_map(|declared| {
        let plan::OperationKind::Scene { parameter: None, usual: Some(usual) } = declared.kind else { return None };
        let name = declared.declaration.name.clone();
        let value = operation(declared, plan.campaign.end_after, Vec::new()).as_argument(usual);
        (!is_chosen(&name)).then_some((name, value))
    });
    let usual: BTreeMap<String, String> = usual.collect();
    for argument in plan.commands_mut().flat_map(|command| &mut command.arguments) {
        *argument = plan::fill_placeholders(argument, |word| usual.get(word).cloned());
    }
    plan
}

#[cfg(test)]
mod tests {
    use sesame_dsl::analyse;
    use sesame_dsl::source::SourceMap;

    use crate::lower::lower;

    #[test]
    fn a_campaign_launches_with_the_usual_values_of_scenes_that_its_tests_do_not_choose() {
        let text = "space s system {
              simulator robots = mqtt \"mqtt://127.0.0.1:1883\"
              topic place = \"place\" : real[m]
              launch \"./world\" \"{boxes}\" \"x:={start_x}\"
              terminate \"./end\" \"{boxes}\"
              node robot { publishes place  launch \"./robot\" \"{start_x}/{boxes}/{worker}\" }
            }
            metric far maximise default 0m = max(place)
            parameter start_x: real[m] in [-200cm, 2m] default -1m
            parameter boxes: int in [0, 6] default 0
            operation lag on place = latency [0s, 1s]
            campaign both { objectives far  operations start_x, boxes 1 per test
                            search random { evaluations 2 }  end after 5s }
            campaign boxed from both { operations boxes, lag 1 per test }
            campaign watch { passive 2 times  observes far  end after 5s }";
        let mut sources = SourceMap::new();
        let file = sources.add("s.sesame", text.to_owned());
        let analysis = analyse(&sources, file);
        let space = analysis.model.unwrap_or_else(|| panic!("{:#?}", analysis.diagnostics));
        let arguments = |campaign: &str| {
            let plan = lower(&space, space.campaign(campaign).unwrap(), "s.sesame", "sesamec 0.0.0").plan;
            plan.validate().unwrap();
            plan.commands().flat_map(|command| &command.arguments).cloned().collect::<Vec<_>>()
        };
        assert_eq!(arguments("both"), ["{boxes}", "x:={start_x}", "{start_x}/{boxes}/{worker}", "{boxes}"]);
        assert_eq!(arguments("boxed"), ["{boxes}", "x:=-1.0", "-1.0/{boxes}/{worker}", "{boxes}"]);
        assert_eq!(arguments("watch"), ["0", "x:=-1.0", "-1.0/0/{worker}", "0"]);
    }
}
