//! Whether monitors refer to what they have, and whether none depends on itself.

use crate::{
    CampaignPlan, Demand, Evidence, Gate, Guarantee, MetricSource, Monitor, MonitorId, MonitorPart, MonitorState,
    RequirementId, SafeState, Score,
};

use super::check::{Checked, at, at_least_one, distinct, each, filled, finite, id, name, positive, require, wrong};

impl CampaignPlan {
    pub(super) fn sound_monitors(&self) -> Checked {
        few(&self.monitors)?;
        distinct(self.monitors.iter().map(|monitor| &monitor.name))?;
        self.monitors
            .iter()
            .enumerate()
            .try_for_each(|(index, monitor)| at(&format!("[{index}]"), self.sound_monitor(monitor)))?;
        self.no_monitor_depends_on_itself()
    }

    fn sound_monitor(&self, monitor: &Monitor) -> Checked {
        let Monitor { name: own, doc: _, publishes, demands, evidence, guarantees, otherwise, line: _ } = monitor;
        at("name", name(own))?;
        if let Some(topic) = *publishes {
            at("publishes", self.has_topic(topic))?;
            let fits = self.state_on(topic).is_some();
            let name = || &self.topic(topic).name;
            at("publishes", require(fits, || format!("`{}` is not one topic of a bool, an int or a text", name())))?;
        }
        at("demands", few(demands))?;
        each("demands", demands, |demand| self.sound_demand(demand))?;
        at("evidence", filled(evidence))?;
        at("evidence", few(evidence))?;
        each("evidence", evidence, |evidence| self.sound_evidence(evidence))?;
        let watched = evidence.iter().map(|evidence| &evidence.name);
        at("evidence", distinct(watched.chain(demands.iter().map(|demand| &demand.name))))?;
        at("guarantees", filled(guarantees))?;
        at("guarantees", few(guarantees))?;
        each("guarantees", guarantees, |guarantee| sound_guarantee(monitor, guarantee))?;
        let states = guarantees.iter().map(|guarantee| &guarantee.name);
        at("guarantees", distinct(states.chain([&otherwise.name])))?;
        let fall = guarantees.is_sorted_by(|stronger, weaker| stronger.integrity > weaker.integrity);
        at("guarantees", require(fall, || "their integrity does not fall from one to the next".to_owned()))?;
        let gates = guarantees.iter().map(|guarantee| guarantee.gate.size()).sum::<usize>();
        let most = Monitor::MOST_GATES;
        at("guarantees", require(gates <= most, || format!("have {gates} gates, more than {most}")))?;
        at("otherwise", self.sound_safe_state(otherwise, publishes.is_none()))
    }

    fn sound_demand(&self, demand: &Demand) -> Checked {
        at("name", name(&demand.name))?;
        at("monitor", self.has_monitor(demand.monitor))?;
        let guarantees = &self.monitor(demand.monitor).guarantees;
        at("guarantee", id("guarantee", demand.guarantee as usize, guarantees.len()))
    }

    fn sound_evidence(&self, evidence: &Evidence) -> Checked {
        at("name", name(&evidence.name))?;
        self.sound_condition(&evidence.inputs, &evidence.condition)?;
        at("condition", require(!evidence.condition.reads_time(), || "reads the time".to_owned()))?;
        let held = evidence.held;
        at("held", finite(held))?;
        at("held", require(held >= 0.0, || format!("{held} is below 0")))?;
        at("stale.after", evidence.stale.map_or(Ok(()), |stale| positive(stale.after)))
    }

    fn sound_safe_state(&self, otherwise: &SafeState, external: bool) -> Checked {
        at("name", name(&otherwise.name))?;
        let Some(mitigation) = &otherwise.mitigation else { return Ok(()) };
        at("mitigation", require(!external, || "is there, but nothing is sent for an external monitor".to_owned()))?;
        at("mitigation.field", self.field(&mitigation.field))?;
        match mitigation.value {
            crate::MitigationValue::Real(value) => at("mitigation.value", finite(value)),
            _ => Ok(()),
        }
    }

    /// Removes monitors whose demands are all of removed ones, until none is left or all that are left depend on
    /// themselves or on such.
    fn no_monitor_depends_on_itself(&self) -> Checked {
        let mut open: Vec<usize> = self.monitors.iter().map(|monitor| monitor.demands.len()).collect();
        let mut demanded_by: Vec<Vec<usize>> = vec![Vec::new(); self.monitors.len()];
        for (index, monitor) in self.monitors.iter().enumerate() {
            monitor.demands.iter().for_each(|demand| demanded_by[demand.monitor.index()].push(index));
        }
        let mut ready: Vec<usize> = (0..open.len()).filter(|&index| open[index] == 0).collect();
        while let Some(settled) = ready.pop() {
            for &index in &demanded_by[settled] {
                open[index] -= 1;
                if open[index] == 0 {
                    ready.push(index);
                }
            }
        }
        match open.iter().position(|&demands| demands > 0) {
            None => Ok(()),
            Some(index) => at(&format!("[{index}].demands"), wrong("form a cycle")),
        }
    }

    pub(super) fn sound_score(&self, of: MonitorId, score: Score) -> Checked {
        at("monitor", self.has_monitor(of))?;
        let monitor = self.monitor(of);
        let checked = match score {
            Score::MissedHazards { requirement }
            | Score::ForeseenHazards { requirement }
            | Score::LeadTime { requirement } => self.has_hazards(requirement),
            Score::FalseAlarms { requirement, within } => {
                self.has_hazards(requirement)?;
                at("within", within.map_or(Ok(()), positive))
            }
            Score::TimeIn { state: MonitorState::Guarantee(index) }
            | Score::Holds { part: MonitorPart::Guarantee(index) } => {
                id("guarantee", index as usize, monitor.guarantees.len())
            }
            Score::Holds { part: MonitorPart::Evidence(index) } => {
                id("evidence", index as usize, monitor.evidence.len())
            }
            Score::Holds { part: MonitorPart::Demand(index) } => id("demand", index as usize, monitor.demands.len()),
            Score::Mitigations => require(monitor.otherwise.mitigation.is_some(), || {
                format!("monitor `{}` has no mitigation", monitor.name)
            }),
            Score::TimeIn { state: MonitorState::Otherwise }
            | Score::Holds { part: MonitorPart::Otherwise }
            | Score::Changes
            | Score::ShortestStay
            | Score::Integrity => Ok(()),
        };
        at("score", checked)
    }

    /// A hazard is what happens to the system, not how a monitor foresaw one: so no score depends on itself.
    fn has_hazards(&self, requirement: RequirementId) -> Checked {
        self.has_requirement(requirement)?;
        let requirement = self.requirement(requirement);
        at("metric", self.has_metric(requirement.metric))?;
        let itself_a_score = match &self.metric(requirement.metric).source {
            MetricSource::Monitor { score, .. } => score.requirement().is_some(),
            _ => false,
        };
        require(!itself_a_score, || format!("requirement `{}` bounds a score of hazards", requirement.name))
    }

    fn has_monitor(&self, monitor: MonitorId) -> Checked {
        id("monitor", monitor.index(), self.monitors.len())
    }
}

fn few<T>(parts: &[T]) -> Checked {
    let most = Monitor::MOST_PARTS;
    require(parts.len() <= most, || format!("there are {}, more than {most}", parts.len()))
}

fn sound_guarantee(monitor: &Monitor, guarantee: &Guarantee) -> Checked {
    at("name", name(&guarantee.name))?;
    at("integrity", at_least_one(guarantee.integrity))?;
    at("gate", sound_gate(monitor, &guarantee.gate, Gate::MOST_DEPTH))
}

/// A gate, of which so many more may be inside of each other: so the depth is known before anything else walks it.
fn sound_gate(monitor: &Monitor, gate: &Gate, room: usize) -> Checked {
    let Some(room) = room.checked_sub(1) else {
        return wrong(format!("is more than {} gates deep", Gate::MOST_DEPTH));
    };
    match gate {
        Gate::Evidence(index) => return id("evidence", *index as usize, monitor.evidence.len()),
        Gate::Demand(index) => return id("demand", *index as usize, monitor.demands.len()),
        Gate::All(of) | Gate::Any(of) => require(of.len() >= 2, || "combines fewer than two".to_owned())?,
        Gate::AtLeast { count, of } => {
            require(of.len() >= 2, || "combines fewer than two".to_owned())?;
            at_least_one(*count)?;
            require(*count as usize <= of.len(), || format!("needs {count} of {}", of.len()))?;
        }
    }
    gate.parts().iter().try_for_each(|part| sound_gate(monitor, part, room))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::{demand, evidence_above, guarantee, minimal, monitor, requirement, score, topic};
    use crate::{Bound, Mitigation, MitigationValue, TopicId, Type};

    /// Two monitors, the first of which relies on the second; scores of the first; a requirement on one of them.
    fn watched() -> CampaignPlan {
        let evidence = || vec![evidence_above("pressure_ok", 0, 4.0), evidence_above("light_ok", 1, 120.0)];
        let three = vec![Gate::Evidence(0), Gate::Evidence(1), Gate::Demand(0)];
        let strong = guarantee("fast", 3, Gate::All(vec![Gate::Evidence(0), Gate::Any(three.clone())]));
        let weak = guarantee("slow", 1, Gate::AtLeast { count: 2, of: three });
        let still = guarantee("still", 1, Gate::Evidence(1));
        let transport =
            Monitor { demands: vec![demand("still", 1, 0)], ..monitor("transport", 2, evidence(), vec![strong, weak]) };
        let real = || Type::Real { unit: None };
        CampaignPlan {
            topics: vec![
                topic("pressure", &["pressure"], real()),
                topic("light", &["light"], real()),
                topic("state", &["state"], Type::Bool),
                topic("belt", &["belt/a", "belt/b"], Type::Text),
            ],
            metrics: vec![
                score("integrity", 0, Score::Integrity),
                score("missed", 0, Score::MissedHazards { requirement: RequirementId(0) }),
                score("time", 0, Score::TimeIn { state: MonitorState::Guarantee(1) }),
                score("relies", 0, Score::Holds { part: MonitorPart::Demand(0) }),
            ],
            requirements: vec![
                requirement("R1", 0, Bound::AtLeast { value: 1.0 }),
                requirement("R2", 1, Bound::AtMost { value: 0.0 }),
            ],
            monitors: vec![transport, Monitor { publishes: None, ..monitor("belt", 2, evidence(), vec![still]) }],
            ..minimal()
        }
    }

    fn said(change: impl FnOnce(&mut CampaignPlan)) -> String {
        let mut plan = watched();
        plan.validate().unwrap();
        change(&mut plan);
        plan.validate().unwrap_err().to_string()
    }

    #[test]
    fn ids_names_and_counts_of_monitors_are_checked() {
        assert_eq!(said(|plan| plan.monitors[1].name = "transport".into()), "monitors: \"transport\" is there twice");
        let group = "monitors[0].publishes: `belt` is not one topic of a bool, an int or a text";
        assert_eq!(said(|plan| plan.monitors[0].publishes = Some(TopicId(3))), group);
        let gone = "monitors[0].demands[0].guarantee: there is no guarantee 1, there are 1";
        assert_eq!(said(|plan| plan.monitors[0].demands[0].guarantee = 1), gone);
        let empty = "monitors[1].evidence: there is none";
        assert_eq!(said(|plan| plan.monitors[1].evidence.clear()), empty);
        let late = "monitors[0].evidence[1].held: -1 is below 0";
        assert_eq!(said(|plan| plan.monitors[0].evidence[1].held = -1.0), late);
        let twice = "monitors[0].evidence: \"still\" is there twice";
        assert_eq!(said(|plan| plan.monitors[0].evidence[1].name = "still".into()), twice);
        let equal = "monitors[0].guarantees: their integrity does not fall from one to the next";
        assert_eq!(said(|plan| plan.monitors[0].guarantees[1].integrity = 3), equal);
        let none = "monitors[0].guarantees[1].integrity: must be at least 1";
        assert_eq!(said(|plan| plan.monitors[0].guarantees[1].integrity = 0), none);
        let state = "monitors[1].guarantees: \"still\" is there twice";
        assert_eq!(said(|plan| plan.monitors[1].otherwise.name = "still".into()), state);
        let condition = "monitors[0].evidence[0].condition: there is no input 0, there are 1";
        let time = said(|plan| plan.monitors[0].evidence[0].condition = crate::Condition::Input(1));
        assert_eq!(time, condition.replace("input 0", "input 1"));
        let field = crate::FieldRef { topic: TopicId(0), path: Vec::new() };
        let mitigation = Some(Mitigation { field, value: MitigationValue::Real(0.0) });
        let external = "monitors[1].otherwise.mitigation: is there, but nothing is sent for an external monitor";
        assert_eq!(said(|plan| plan.monitors[1].otherwise.mitigation = mitigation), external);
    }

    #[test]
    fn gates_fit_and_are_neither_deep_nor_many() {
        let with = |gate: Gate| said(|plan| plan.monitors[0].guarantees[0].gate = gate);
        let place = "monitors[0].guarantees[0].gate: ";
        assert_eq!(with(Gate::Evidence(2)), format!("{place}there is no evidence 2, there are 2"));
        assert_eq!(with(Gate::Demand(1)), format!("{place}there is no demand 1, there are 1"));
        assert_eq!(with(Gate::All(vec![Gate::Evidence(0)])), format!("{place}combines fewer than two"));
        let three = vec![Gate::Evidence(0); 3];
        let at_least = |count| Gate::AtLeast { count, of: three.clone() };
        assert_eq!(with(at_least(4)), format!("{place}needs 4 of 3"));
        assert_eq!(with(at_least(0)), format!("{place}must be at least 1"));
        let nested = |levels| {
            (1..levels).fold(Gate::Evidence(0), |inner, _| Gate::AtLeast { count: 1, of: vec![inner, Gate::Demand(0)] })
        };
        assert_eq!(with(nested(31)), format!("{place}is more than 30 gates deep"));
        let many = "monitors[0].guarantees: have 10006 gates, more than 10000";
        assert_eq!(with(Gate::Any(vec![Gate::Demand(0); 10_001])), many);
        let mut deepest = watched();
        deepest.monitors[0].guarantees[0].gate = nested(30);
        deepest.validate().unwrap();
    }

    #[test]
    fn a_cycle_of_demands_is_refused_and_a_long_chain_is_not() {
        let cycle = said(|plan| plan.monitors[1].demands = vec![demand("fast", 0, 0)]);
        assert_eq!(cycle, "monitors[0].demands: form a cycle");
        assert_eq!(
            said(|plan| plan.monitors[0].demands[0].monitor = MonitorId(0)),
            "monitors[0].demands: form a cycle"
        );
        let mut plan = watched();
        let link = plan.monitors[0].clone();
        plan.monitors = (0..1000u32)
            .map(|index| Monitor {
                name: format!("m{index}"),
                demands: if index == 0 { Vec::new() } else { vec![demand("still", index - 1, 0)] },
                guarantees: vec![guarantee("still", 1, Gate::Evidence(0))],
                ..link.clone()
            })
            .collect();
        plan.metrics.truncate(1);
        plan.requirements.truncate(1);
        plan.validate().unwrap();
    }

    #[test]
    fn a_score_is_of_something_and_never_of_itself() {
        let with = |of: Score| said(|plan| plan.metrics[3] = score("relies", 0, of));
        let place = "metrics[3].source.score: ";
        let own = Score::MissedHazards { requirement: RequirementId(1) };
        assert_eq!(with(own), format!("{place}requirement `R2` bounds a score of hazards"));
        let unknown = Score::LeadTime { requirement: RequirementId(9) };
        assert_eq!(with(unknown), format!("{place}there is no requirement 9, there are 2"));
        let zero = Score::FalseAlarms { requirement: RequirementId(0), within: Some(0.0) };
        assert_eq!(with(zero), format!("{}.within: 0 is not above 0", place.trim_end_matches(": ")));
        assert_eq!(with(Score::Mitigations), format!("{place}monitor `transport` has no mitigation"));
        let state = Score::TimeIn { state: MonitorState::Guarantee(2) };
        assert_eq!(with(state), format!("{place}there is no guarantee 2, there are 2"));
        let part = Score::Holds { part: MonitorPart::Evidence(2) };
        assert_eq!(with(part), format!("{place}there is no evidence 2, there are 2"));
        let monitor = said(|plan| plan.metrics[3] = score("relies", 2, Score::Integrity));
        assert_eq!(monitor, "metrics[3].source.monitor: there is no monitor 2, there are 2");
        // A requirement that bounds no metric of the plan is reported as such.
        assert!(said(|plan| plan.requirements[0].metric = crate::MetricId(9)).contains("there is no metric 9"));
    }
}
