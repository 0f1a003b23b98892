//! When the undisturbed system has messages that an operation could disturb: a window without any is not worth a test.

use sesame_base::observation::{Observation, RARE};
use sesame_base::silence::wires;
use sesame_plan::{CampaignPlan, OperationId, Span};
use sesame_rng::Stream;

use crate::space::range::Range;

/// When there are messages that an operation could disturb. Until a reference run is known, there may always be some.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Heard {
    /// The positions of the wires of the operation's topic; none if it needs no messages.
    wires: Vec<u32>,
    /// Stretches with messages, by their beginnings; `None` where nothing is known, or the operation needs no messages.
    stretches: Option<Vec<Span>>,
    /// The times of its messages if there are few, in order; else empty.
    rare: Vec<f64>,
    /// The usual time between two messages, in seconds, if it is known.
    period: Option<f64>,
}

impl Heard {
    /// What is known of the messages on which an operation may act before the reference run.
    pub(crate) fn of(plan: &CampaignPlan, operation: OperationId) -> Heard {
        let operation = plan.operation(operation);
        let acted_on = (0..).zip(wires(plan)).filter(|(_, wire)| operation.may_act_on(wire.topic, wire.member));
        Heard { wires: acted_on.map(|(wire, _)| wire).collect(), ..Heard::default() }
    }

    /// Learns from the reference run.
    pub(crate) fn take_reference(&mut self, reference: &Observation) {
        let Some(course) = reference.course.as_ref().filter(|_| !self.wires.is_empty()) else { return };
        let on_topic = course.heard.iter().filter(|heard| self.wires.contains(&heard.wire));
        let mut stretches: Vec<Span> = on_topic.flat_map(|heard| heard.stretches.iter().copied()).collect();
        stretches.sort_by(|a, b| a.start.total_cmp(&b.start));
        let traffic = reference.traffic.iter().filter(|traffic| self.wires.contains(&traffic.wire));
        let messages: u64 = traffic.clone().map(|traffic| traffic.messages).sum();
        self.rare =
            if messages <= RARE as u64 { stretches.iter().map(|span| span.start).collect() } else { Vec::new() };
        self.period = traffic.map(|traffic| traffic.median_gap).filter(|gap| *gap > 0.0).reduce(f64::min);
        self.stretches = Some(stretches);
    }

    /// Whether a window meets a message, as far as is known.
    pub(crate) fn is_in(&self, (start, end): (f64, f64)) -> bool {
        let Some(stretches) = &self.stretches else { return true };
        // Stretches of several wires may overlap, so their ends need not be in order; they nearly are.
        stretches.iter().take_while(|span| span.start < end).any(|span| span.end >= start)
    }

    /// A window of this length that meets a message, at any place in what is permitted; `None` if there is no message,
    /// or nothing is known.
    pub(crate) fn around_a_message(&self, range: Range, length: f64, stream: &mut Stream) -> Option<(f64, f64)> {
        let inside = |span: &Span| (span.start.max(range.low), span.end.min(range.high));
        let stretches = self.stretches.iter().flatten().map(inside);
        let permitted: Vec<(f64, f64)> = stretches.filter(|(start, end)| start <= end && *start < range.high).collect();
        if permitted.is_empty() {
            return None;
        }
        let (first, last) = permitted[stream.below(permitted.len())];
        let message = stream.uniform(first, last);
        let start = (message - length * stream.unit()).clamp(range.low, (range.high - length).max(range.low));
        Some((start, (start + length).min(range.high)))
    }

    /// The times of its messages if there are few, in order; else none.
    pub(crate) fn rare(&self) -> &[f64] {
        &self.rare
    }

    /// The usual time between two messages, in seconds, if it is known.
    pub(crate) fn period(&self) -> Option<f64> {
        self.period
    }
}
