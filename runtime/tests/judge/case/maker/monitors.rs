//! Random monitors, and metrics that score them.

use sesame_plan::testing;
use sesame_plan::{
    Condition, Demand, Evidence, FieldRef, Gate, Input, Members, Metric, Mitigation, MitigationValue, Monitor,
    MonitorPart, MonitorState, RequirementId, Score, Side, Stale, StaleIs, TopicId, Type,
};

use super::Maker;

/// What monitors hear, and what they send.
#[derive(Debug, Clone, Copy)]
pub(in crate::case) struct Watching {
    /// The side on which they hear; without it, each piece of evidence has a side of its own.
    pub(in crate::case) side: Option<Side>,
    /// Whether each piece of evidence reads one topic with one member.
    pub(in crate::case) one_wire: bool,
    /// A topic that carries a number, on which one of them may send mitigation: of two, the order would be that of
    /// their declarations.
    pub(in crate::case) mitigated: Option<TopicId>,
}

/// How often evidence is drawn that may not be what it has to be.
const TRIES: u32 = 20;

impl Maker {
    /// A monitor on each of these topics, on which they publish as `Bool` and `Int` in turn; fewer, if there is nothing
    /// to hear.
    pub(in crate::case) fn monitors(&mut self, states: &[TopicId], watching: Watching) -> Vec<Monitor> {
        let mut monitors: Vec<Monitor> = Vec::new();
        for &TopicId(state) in states {
            let mut evidence: Vec<Evidence> = Vec::new();
            let wanted = usize::try_from(self.between(1, 3)).unwrap();
            for _ in 0..TRIES {
                if evidence.len() < wanted {
                    let name = format!("e{}", evidence.len());
                    evidence.extend(self.evidence(&name, watching));
                }
            }
            if evidence.is_empty() {
                break;
            }
            let mut monitor = testing::monitor(&format!("monitor{}", monitors.len()), state, evidence, Vec::new());
            if let Some(before) = monitors.last().filter(|_| self.chance(0.5)) {
                let of = u32::try_from(monitors.len() - 1).unwrap();
                monitor.demands =
                    vec![Demand { name: before.guarantees[0].name.clone(), ..testing::demand("d", of, 0) }];
            }
            let strong = self.gate(&monitor, 2);
            let weak = self.gate(&monitor, 1);
            monitor.guarantees = vec![testing::guarantee("strong", 2, strong), testing::guarantee("weak", 1, weak)];
            if let Some(topic) = watching.mitigated.filter(|_| monitors.is_empty() && self.chance(0.7)) {
                let field = FieldRef { topic, path: Vec::new() };
                let value = MitigationValue::Real(self.quarters(-2, 2));
                monitor.otherwise.mitigation = Some(Mitigation { field, value });
            }
            monitors.push(monitor);
        }
        monitors
    }

    fn evidence(&mut self, name: &str, watching: Watching) -> Option<Evidence> {
        let (mut inputs, numbers) = self.inputs(true)?;
        let topic = inputs[0].field.topic;
        let of_one_wire =
            self.topics[topic.index()].paths.len() == 1 && inputs.iter().all(|input| input.field.topic == topic);
        if watching.one_wire && !of_one_wire {
            return None;
        }
        for Input { members, .. } in inputs.iter_mut().filter(|input| input.members == Members::Each) {
            *members = Members::Max;
        }
        let condition = loop {
            let condition = self.condition(inputs.len(), numbers, 1);
            if !Condition::reads_time(&condition) {
                break condition;
            }
        };
        let held = if self.chance(0.4) { self.ticks(1, 6) } else { 0.0 };
        let stale = self.chance(0.5).then(|| Stale {
            after: self.ticks(1, 8),
            is: if self.chance(0.5) { StaleIs::False } else { StaleIs::Unknown },
            all: self.chance(0.3),
        });
        let side = watching.side.unwrap_or_else(|| self.side());
        Some(Evidence { inputs, condition, held, stale, side, ..testing::evidence_above(name, 0, 0.0) })
    }

    fn gate(&mut self, of: &Monitor, depth: u32) -> Gate {
        let (evidence, demands) = (of.evidence.len(), of.demands.len());
        if depth == 0 || self.chance(0.3) {
            let at = self.stream.below(evidence + demands);
            let number = |at: usize| u32::try_from(at).unwrap();
            return if at < evidence { Gate::Evidence(number(at)) } else { Gate::Demand(number(at - evidence)) };
        }
        let parts: Vec<Gate> = (0..self.between(2, 3)).map(|_| self.gate(of, depth - 1)).collect();
        match self.between(0, 2) {
            0 => Gate::All(parts),
            1 => Gate::Any(parts),
            _ => Gate::AtLeast { count: 2, of: parts },
        }
    }

    /// Scores of a monitor of each kind; of hazards for this requirement, if there is one.
    pub(in crate::case) fn scores(&mut self, monitor: u32, requirement: Option<RequirementId>) -> Vec<Metric> {
        let mut scores = vec![
            Score::TimeIn { state: MonitorState::Otherwise },
            Score::TimeIn { state: MonitorState::Guarantee(0) },
            Score::Changes,
            Score::ShortestStay,
            Score::Mitigations,
            Score::Integrity,
            Score::Holds { part: MonitorPart::Evidence(0) },
        ];
        scores.extend(requirement.into_iter().flat_map(|requirement| {
            let within = self.chance(0.5).then(|| self.ticks(1, 10));
            [
                Score::MissedHazards { requirement },
                Score::ForeseenHazards { requirement },
                Score::FalseAlarms { requirement, within },
                Score::LeadTime { requirement },
            ]
        }));
        scores.into_iter().map(|score| testing::score("score", monitor, score)).collect()
    }

    /// The type of the state of the monitor at a position.
    pub(in crate::case) fn state_type(at: usize) -> Type {
        if at.is_multiple_of(2) { Type::Bool } else { Type::Int { unit: None } }
    }
}
