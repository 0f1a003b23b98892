//! The messages of one step: which are expected, which have come, and what time the simulator says it is.

use std::collections::BTreeMap;

use sesame_base::time::SimTime;
use sesame_plan::CampaignPlan;
use sesame_relay::transport::TransportError;
use sesame_relay::wire::{Wire, WireTable};

use super::Session;
use super::lines::Lines;
use crate::client::{Heard, Stepped};

/// What the simulator's own time is ahead of the run's, in nanoseconds.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Start(i128);

/// One step.
pub(super) struct Round {
    pub(super) heard: Vec<Heard>,
    pub(super) stepped: Option<Stepped>,
    /// Per wire: how many more messages are expected than have come. Only wires of which somebody says it are here.
    owed: BTreeMap<Wire, i64>,
    /// The stream of the marker.
    marker: Option<usize>,
    marked: bool,
}

impl Round {
    pub(super) fn new(plan: &CampaignPlan, wires: &WireTable, marker: Option<usize>) -> Self {
        let mut owed = BTreeMap::new();
        let answers = |topic| plan.nodes.iter().flat_map(|node| &node.answers).any(|answer| answer.with == topic);
        let every = |topic| plan.nodes.iter().flat_map(|node| &node.every_step).filter(|&&it| it == topic).count();
        for wire in wires.iter() {
            let topic = wires.topic(wire);
            let count = every(topic);
            if count > 0 || answers(topic) {
                owed.insert(wire, i64::try_from(count).unwrap_or(i64::MAX));
            }
        }
        Round { heard: Vec::new(), stepped: None, owed, marker, marked: false }
    }

    /// Counts the answers to a message that is delivered on this wire. Of groups of one size, one member answers
    /// another; else all members answer.
    pub(super) fn owe(&mut self, plan: &CampaignPlan, wires: &WireTable, wire: Wire) {
        let to = wires.topic(wire);
        let member = |wire: Wire| wires.iter().take_while(|&it| it != wire).filter(|&it| wires.topic(it) == to).count();
        for answer in plan.nodes.iter().flat_map(|node| &node.answers).filter(|answer| answer.to == to) {
            let with: Vec<Wire> = wires.iter().filter(|&it| wires.topic(it) == answer.with).collect();
            let alike = with.len() == plan.topic(to).paths.len();
            for (at, with) in with.into_iter().enumerate() {
                if !alike || at == member(wire) {
                    *self.owed.entry(with).or_default() += 1;
                }
            }
        }
    }

    pub(super) fn take(&mut self, lines: &Lines, heard: &mut Vec<Heard>) {
        for heard in heard.drain(..) {
            if Some(heard.stream) == self.marker {
                self.marked = true;
                continue;
            }
            if let Some(owed) = lines.of_stream(heard.stream).and_then(|line| self.owed.get_mut(&line.wire)) {
                *owed -= 1;
            }
            self.heard.push(heard);
        }
    }

    /// Whether all that is expected has come.
    pub(super) fn is_complete(&self) -> bool {
        if self.marker.is_some() { self.marked } else { self.owed.values().all(|&owed| owed <= 0) }
    }

    /// Whether nothing can come that is not expected.
    pub(super) fn is_certain(&self, lines: &Lines) -> bool {
        self.marker.is_some() || lines.iter().all(|line| self.owed.contains_key(&line.wire))
    }

    /// What has not come, as a phrase.
    pub(super) fn awaited(&self, plan: &CampaignPlan, lines: &Lines) -> String {
        if self.stepped.is_none() {
            return "the end of a step".to_owned();
        }
        if self.marker.is_some() {
            return "the marker of the end of a step".to_owned();
        }
        let owed = lines.iter().filter_map(|line| {
            let &count = self.owed.get(&line.wire).filter(|&&count| count > 0)?;
            Some(format!("{count} on `{}`", plan.topic(line.topic).name))
        });
        format!("a message of the step ({})", owed.collect::<Vec<_>>().join(", "))
    }
}

impl Session {
    /// Compares the simulator's time with that of the run: by its clock, or else by the stamps of messages.
    pub(super) fn look_at_time(
        &mut self,
        now: SimTime,
        step: SimTime,
        stepped: Option<Stepped>,
        heard: &[Heard],
        first_run: &mut Option<Start>,
    ) -> Result<(), TransportError> {
        let (run, step) = (i128::from(now.nanos()), i128::from(step.nanos()));
        let clock = stepped.and_then(|stepped| stepped.clock_ms).map(|clock| i128::from(clock) * 1_000_000);
        let stamps = heard.iter().filter_map(|heard| heard.message.stamp()).map(i128::from);
        let stamps: Vec<i128> = if clock.is_some() { Vec::new() } else { stamps.collect() };
        let Some(latest) = clock.or_else(|| stamps.iter().copied().max()) else { return Ok(()) };
        let Some(Start(start)) = self.start else {
            let start = latest - run;
            let Start(first) = *first_run.get_or_insert(Start(start));
            if start > first + step {
                let seconds = (start as f64) / 1e9;
                return Err(TransportError::Wiring(format!(
                    "the simulator did not begin anew: its time goes on from {seconds:.3} s; declare what launches it, so \
                     that each test starts it"
                )));
            }
            self.start = Some(Start(start));
            return Ok(());
        };
        if clock.is_some() && latest < start + run - step {
            let time = |time: i128| SimTime::from_nanos(i64::try_from(time - start).unwrap_or(i64::MAX));
            return Err(TransportError::ClockBack { from: time(start + run - step), to: time(latest) });
        }
        if stamps.iter().any(|&stamp| stamp - start <= run - step) {
            self.note(
                "messages came after their step was complete, so equal tests may differ: declare the topics that are \
                 published `every step`, or a longer settling time"
                    .to_owned(),
            );
        }
        Ok(())
    }
}
