//! The end of a run, and what is left of it.

use sesame_base::observation::{Course, MetricObservation, MonitorObservation, OperationEffect, Traffic, Unreached};
use sesame_base::time::SimTime;
use sesame_plan::Span;

use crate::fuzz::{Disturbance, HELD_LIMIT};
use crate::relay::{COPIES_LIMIT, PUBLISHED_LIMIT, Phase, Relay};

/// The result of a run.
pub struct Finished {
    /// Per operation of the test, in its order.
    pub operations: Vec<OperationEffect>,
    /// Names on the wire that operations of the plan act on and that had no receiver, in order of declaration.
    pub unheard: Vec<String>,
    /// In a run without operations: those of the plan that would have found no message.
    pub unreached: Vec<Unreached>,
    /// What nodes published on each wire that spoke.
    pub traffic: Vec<Traffic>,
    /// In a run without operations: when messages came, and what happened in them.
    pub course: Option<Course>,
    /// Per metric of the plan.
    pub metrics: Vec<MetricObservation>,
    /// Per monitor of the plan.
    pub monitors: Vec<MonitorObservation>,
    /// Warnings for the user.
    pub warnings: Vec<String>,
    /// The number of messages published.
    pub messages: u64,
}

impl Relay<'_> {
    /// The result of a run that ended or broke off at `end`: messages still held are lost, open intervals are closed.
    pub fn finish(mut self, end: SimTime) -> Finished {
        self.begin_time();
        self.phase = Phase::Over;
        self.advance_to(end, &mut Vec::new());
        // Even if no message came at the end: the reach of metrics is asked for this time.
        self.tell_time(end);
        // What a run that broke off makes of the values of its last instant may be a hazard.
        self.metrics.break_off();
        self.monitors_break_off();
        let operations: Vec<OperationEffect> = self
            .operations
            .iter()
            .take(self.order.len())
            .map(|stage| OperationEffect {
                intervals: stage.activity.intervals(end),
                tails: stage.tails(end),
                counters: stage.counters,
                first_touch: stage.first_touch.map(SimTime::seconds),
                last_touch: stage.last_touch.map(SimTime::seconds),
            })
            .collect();
        let timed = self.operations.iter().zip(&operations).filter(|(stage, _)| stage.timed);
        let busy: Vec<Span> = timed.flat_map(|(_, operation)| operation.busy()).collect();
        let (mut metrics, mut warnings) = self.metrics.finish(&busy);
        let mut monitors = Vec::new();
        if let Some(run) = self.monitors {
            let (shown, mut noted) = run.finish(end, &mut metrics, self.ended);
            monitors = shown;
            warnings.append(&mut noted);
        }
        for stage in &self.operations {
            if let Disturbance::Custom(custom) = &stage.disturbance
                && let Some(mismatch) = &custom.mismatch
            {
                warnings.push(format!("operation `{}`: {mismatch}", stage.name));
            }
        }
        if self.overflowed {
            warnings
                .push(format!("more than {HELD_LIMIT} messages were held back at once; the oldest were let go early"));
        }
        if self.flooded {
            warnings.push(format!("copies of copies: more than {COPIES_LIMIT} in one event are not made"));
        }
        if self.publishing.endless {
            warnings.push(format!(
                "monitors cause each other's messages without end: more than {PUBLISHED_LIMIT} in one event are not sent"
            ));
        }
        let unheard = self.acted_on.iter().filter(|wire| !self.heard[wire.index()]);
        let unheard = unheard.map(|&wire| self.wires.path(wire).to_owned()).collect();
        let (unreached, traffic) = (self.traffic.unreached(), self.traffic.traffic());
        let course = self.course.map(|course| course.course(end));
        Finished {
            operations,
            unheard,
            unreached,
            traffic,
            course,
            metrics,
            monitors,
            warnings,
            messages: self.messages,
        }
    }
}
