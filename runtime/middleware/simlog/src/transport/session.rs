//! The connection of one run: messages between the simulator and the relay, and the simulator's own time.

use sesame_base::time::SimTime;
use sesame_plan::CampaignPlan;
use sesame_relay::relay::{Delivery, Exchange};
use sesame_relay::transport::TransportError;
use sesame_relay::transport::round::Promises;

use super::lines::Lines;
use super::round::Round;
use crate::client::{Client, ClientError, Heard, Stepped};

/// What the simulator's own time is ahead of the run's, in nanoseconds.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Start(i128);

impl Start {
    /// The simulator's own time in the middle of the step that ends at this time of the run.
    pub(super) fn middle_of(self, end: SimTime, step: SimTime) -> i128 {
        self.0 + i128::from(end.nanos()) - i128::from(step.nanos()) / 2
    }
}

/// The connection of one run.
pub(super) struct Session {
    pub(super) client: Client,
    pub(super) lines: Lines,
    /// The stream of the marker, if there is one.
    pub(super) marker: Option<usize>,
    /// What the simulator's own time was when this run began.
    pub(super) start: Option<Start>,
    /// What was noted, each once.
    pub(super) notes: Vec<String>,
}

impl Session {
    /// Takes what was heard through the relay, in the order of wires.
    pub(super) fn relay(
        &mut self,
        plan: &CampaignPlan,
        now: SimTime,
        mut heard: Vec<Heard>,
        relay: &mut dyn Exchange,
        deliveries: &mut Vec<Delivery>,
    ) -> Result<(), TransportError> {
        heard.sort_by_key(|heard| heard.stream);
        for Heard { stream, message } in heard {
            let Some(line) = self.lines.of_stream_mut(stream) else { continue };
            let (wire, topic) = (line.wire, line.topic);
            let value = line.take(message, relay.next_index(wire)).map_err(|mismatch| TransportError::WrongType {
                path: relay.wires().path(wire).to_owned(),
                reason: format!("{mismatch}; topic `{}` declares it", plan.topic(topic).name),
            })?;
            relay.message(now, wire, value, deliveries);
        }
        Ok(())
    }

    /// Publishes what is delivered, and notes who will answer it. What was only listened to is where it belongs.
    pub(super) fn deliver(
        &mut self,
        promises: &Promises,
        deliveries: &mut Vec<Delivery>,
        relay: &dyn Exchange,
        now: SimTime,
        round: &mut Round,
    ) -> Result<(), TransportError> {
        let mut published = Vec::new();
        for delivery in deliveries.drain(..) {
            let Some(line) = self.lines.of_wire(delivery.wire) else { continue };
            match line.written(&delivery, now) {
                Ok(None) => {}
                Ok(Some(written)) => {
                    round.owe(promises, delivery.wire);
                    published.push(written);
                }
                Err(mismatch) => {
                    let path = relay.wires().path(delivery.wire);
                    self.note(format!("a message on `{path}` cannot be written and is dropped: {mismatch}"));
                }
            }
        }
        if published.is_empty() { Ok(()) } else { self.client.publish(published).map_err(fault) }
    }

    pub(super) fn note(&mut self, note: String) {
        if !self.notes.contains(&note) {
            self.notes.push(note);
        }
    }

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

/// The error of a run for one of its client.
pub(super) fn fault(error: ClientError) -> TransportError {
    match error {
        ClientError::Lost { url, how } => TransportError::ConnectionLost { to: url, how },
        ClientError::Unreachable { url, how, .. } => {
            TransportError::ConnectionLost { to: url, how: format!("nobody answers there: {how}") }
        }
        ClientError::Silent { url, what, limit } => {
            TransportError::Silent { awaited: format!("the answer of {url} to {what}"), limit: limit.as_secs_f64() }
        }
        ClientError::Refused { .. } => TransportError::Simulator(error.to_string()),
        ClientError::Url { .. } | ClientError::NoTopic { .. } | ClientError::Overflow { .. } => {
            TransportError::Wiring(error.to_string())
        }
    }
}
