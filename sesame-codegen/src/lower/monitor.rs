//! Runtime monitors, from the model to the plan.

use sesame_dsl::model::eddi::{self, Eddi};
use sesame_dsl::model::{EddiId, Id as _, Space};
use sesame_plan as plan;

use super::formula::{field, inputs, side};
use super::id::{raw, topic_id};

pub(super) fn monitor(space: &Space, monitor: &Eddi) -> plan::Monitor {
    plan::Monitor {
        name: monitor.declaration.name.clone(),
        doc: monitor.declaration.doc.clone(),
        publishes: monitor.publishes.map(topic_id),
        demands: monitor.demands.iter().map(|demand| demanded(space, demand)).collect(),
        evidence: monitor.evidence.iter().map(evidence).collect(),
        guarantees: monitor.guarantees.iter().map(guarantee).collect(),
        otherwise: plan::SafeState {
            name: monitor.otherwise.declaration.name.clone(),
            doc: monitor.otherwise.declaration.doc.clone(),
            mitigation: monitor.otherwise.mitigation.as_ref().map(mitigation),
        },
        line: monitor.declaration.line,
    }
}

pub(super) fn monitor_id(id: EddiId) -> plan::MonitorId {
    plan::MonitorId(raw(id.index()))
}

/// A demand has the name of the guarantee, whose position in the other monitor is by integrity.
fn demanded(space: &Space, demand: &eddi::Demand) -> plan::Demand {
    let name = &demand.declaration.name;
    let guarantees = &space.eddis[demand.eddi].guarantees;
    let at = guarantees.iter().position(|guarantee| guarantee.declaration.name == *name);
    let at = at.expect("a demand names a guarantee of the other monitor");
    plan::Demand { name: name.clone(), monitor: monitor_id(demand.eddi), guarantee: raw(at) }
}

fn evidence(evidence: &eddi::Evidence) -> plan::Evidence {
    plan::Evidence {
        name: evidence.declaration.name.clone(),
        doc: evidence.declaration.doc.clone(),
        inputs: inputs(&evidence.inputs),
        condition: evidence.condition.clone(),
        held: evidence.held,
        stale: evidence.stale,
        side: side(!evidence.inbound),
    }
}

fn guarantee(guarantee: &eddi::Guarantee) -> plan::Guarantee {
    plan::Guarantee {
        name: guarantee.declaration.name.clone(),
        doc: guarantee.declaration.doc.clone(),
        integrity: guarantee.integrity,
        gate: guarantee.gate.clone(),
    }
}

fn mitigation(mitigation: &eddi::Mitigation) -> plan::Mitigation {
    plan::Mitigation { field: field(&mitigation.field), value: mitigation.value.clone() }
}

#[cfg(test)]
mod tests {
    use sesame_dsl::analyse;
    use sesame_dsl::source::SourceMap;
    use sesame_plan::testing::compact::Base;
    use sesame_plan::{CampaignPlan, Gate, MitigationValue, MonitorId, TopicId};

    use crate::lower::lower;

    const CELL: &str = r#"
        space cell
        system {
          simulator sim = in_process "cell_sim::Cell" { step 20ms }
          topic pressure = "brakes/pressure" : real[kPa]
          topic light    = "camera/light"    : int
          topic state    = "eddi/state"      : int
          topic belt     = "eddi/belt"       : text
          topic speed    = "belt/speed"      : real[m/s]
          topic limit    = "plc/limit"       : int
        }
        /// Watches the transport.
        eddi transport publishes state {
          demand    stopped from eddi conveyor
          /// Enough to brake.
          evidence  brakes_ok = pressure >= 4bar held 100ms stale after 200ms is false
          evidence  sees      = light > 120 stale after 1min is unknown
          guarantee slow  integrity 2 = brakes_ok and (sees or stopped)
          guarantee fast  integrity 3 = brakes_ok and sees and stopped
          otherwise halted  mitigate with limit = 0
        }
        eddi conveyor publishes belt {
          evidence  still   = speed < 1cm/s and speed > -1cm/s
          evidence  slow    = speed < 10cm/s
          guarantee moving  integrity 1 = slow
          guarantee stopped integrity 2 = still
          otherwise rolls
        }
        metric fastest maximise default 0m/s = max(speed)
        operation lose on light = packet loss [0%, 50%]
        campaign look { objectives fastest  operations lose 1 per test
                        search random { evaluations 8 }  end after 10s }
    "#;

    fn lowered(text: &str) -> CampaignPlan {
        let mut sources = SourceMap::new();
        let file = sources.add("cell.sesame", text);
        let analysis = analyse(&sources, file);
        let space = analysis.model.unwrap_or_else(|| panic!("{:#?}", analysis.diagnostics));
        let plan = lower(&space, space.campaign("look").unwrap(), "cell.sesame", "sesamec 0.0.0").plan;
        plan.validate().unwrap();
        let read: CampaignPlan = serde_json::from_str(&serde_json::to_string(&plan).unwrap()).unwrap();
        assert_eq!(read, plan);
        plan
    }

    #[test]
    fn a_monitor_arrives_with_positions_seconds_and_the_units_of_the_wire() {
        let plan = lowered(CELL);
        let [transport, conveyor] = plan.monitors.as_slice() else { panic!("{:?}", plan.monitors) };
        assert_eq!(transport.publishes, Some(TopicId(2)));
        let integrity: Vec<_> =
            transport.guarantees.iter().map(|guarantee| (guarantee.name.as_str(), guarantee.integrity)).collect();
        assert_eq!(integrity, [("fast", 3), ("slow", 2)]);
        let demand = &transport.demands[0];
        assert_eq!((demand.monitor, demand.guarantee), (MonitorId(1), 0), "the strongest guarantee comes first");
        assert_eq!(conveyor.guarantees[0].name, "stopped");
        let expected = Gate::All(vec![Gate::Evidence(0), Gate::Any(vec![Gate::Evidence(1), Gate::Demand(0)])]);
        assert_eq!(transport.guarantees[1].gate, expected);
        let mitigation = transport.otherwise.mitigation.as_ref().unwrap();
        assert_eq!((mitigation.field.topic, &mitigation.value), (TopicId(5), &MitigationValue::Int(0)));
        insta::assert_snapshot!(Base::default().compact(&crate::lower::tests::tree(&transport.evidence)));
    }

    #[test]
    fn external_monitors_arrive_as_evidence_of_what_they_say_and_scores_with_units_and_trends() {
        let more = r#"
            topic plc = "plc/state" : int  topic plug = "plug" : bool  topic word = "word" : text }
            eddi numbers external on plc { guarantee weak integrity 2  guarantee strong integrity 7  otherwise none }
            eddi truth   external on plug { guarantee high integrity 1  otherwise low }
            eddi words   external on word { guarantee ready integrity 1  otherwise waits }
            eddi own     external { evidence e = plug inbound  evidence f = plc > 3  evidence g = plug
                                    guarantee ok integrity 1 = 2 of (e, f, g)  otherwise bad }
            requirement R1 "it is slow" = fastest <= 2m/s
            metric missed maximise = missed_hazards(transport, R1)
            metric alarms maximise = false_alarms(transport, R1) within 1min
            metric lead = lead_time(transport, R1)
            metric slow_for = time_in(transport.slow)
            metric rolling = holds(conveyor.rolls)
            test worst { lose loss 10% when not transport.sees until numbers.strong }
        "#;
        let text = CELL.replacen(
            "topic limit    = \"plc/limit\"       : int\n        }",
            &format!("topic limit = \"plc/limit\" : int {more}"),
            1,
        );
        let text =
            text.replace("objectives fastest", "objectives fastest  observes missed, alarms, lead, slow_for, rolling");
        let plan = lowered(&text);
        let lines = plan.monitors[..4].iter().map(|monitor| serde_json::to_string(monitor).unwrap());
        let scores = plan.metrics.iter().map(|metric| {
            let source = serde_json::to_string(&metric.source).unwrap();
            format!("{} {:?} {:?} {source}", metric.name, metric.unit, metric.trend)
        });
        insta::assert_snapshot!(lines.chain(scores).collect::<Vec<_>>().join("\n"));
    }

    #[test]
    fn the_deepest_guarantee_can_be_read_again_from_the_plan() {
        let nested = format!("{}(sees or stopped){}", "2 of (stopped, sees, ".repeat(14), " or brakes_ok)".repeat(14));
        let text = CELL.replace("brakes_ok and (sees or stopped)", &nested);
        assert_eq!(lowered(&text).monitors[0].guarantees[1].gate.depth(), Gate::MOST_DEPTH);
    }

    #[test]
    fn a_space_without_monitors_has_the_plan_that_it_had_before_there_were_any() {
        let begin = CELL.find("        /// Watches").unwrap();
        let end = CELL.find("        metric fastest").unwrap();
        let without = lowered(&format!("{}{}", &CELL[..begin], &CELL[end..]));
        assert!(!serde_json::to_string(&without).unwrap().contains("monitors"));
        assert_eq!(lowered(CELL).model_difference(&without).unwrap(), "monitor `transport` was removed");
    }
}
