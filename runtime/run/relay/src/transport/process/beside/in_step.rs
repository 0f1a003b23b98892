//! A run that the runner steps: both sides wait for each other, and the monitor is between them in each turn.

use serde_json::value::RawValue;

use sesame_base::time::SimTime;

use super::between::Between;
use super::error::BesideError;
use super::hearing::{Hearing, publish};
use super::request::{Request, Step};
use crate::relay::PUBLISHED_LIMIT;
use crate::transport::process::protocol::{Message, SimulatorMessage, request};

/// What the simulator sends at the end of a step, before which the runner has all its messages.
const ENDED: [&[u8]; 2] = [b"{\"done\":{}}", b"{\"done\":{\"ended\":true}}"];

/// A run. The next line of the runner that is of another one; `None` if it has closed its stream.
pub(super) fn run(between: &mut Between<'_>, mut hearing: Hearing<'_, '_>) -> Result<Option<Vec<u8>>, BesideError> {
    if between.ready(&mut hearing, false)?.is_none() {
        return between.runner();
    }
    let mut run = Run { between, hearing, for_next_step: Vec::new() };
    loop {
        let Some(line) = run.between.runner()? else { return Ok(None) };
        match Request::parse(&line)? {
            Request::Step(step) => run.step(&step)?,
            Request::Reset(_) => return Ok(Some(line)),
            Request::Deliver(_) => {
                return Err(BesideError::Runner { problem: "messages that nothing was published for".to_owned() });
            }
            Request::Orders(_) => {
                return Err(BesideError::Runner { problem: "orders outside of a step".to_owned() });
            }
        }
    }
}

struct Run<'b, 'c, 'p, 't> {
    between: &'b mut Between<'c>,
    hearing: Hearing<'p, 't>,
    /// What was delivered of the messages at the end of the last step.
    for_next_step: Vec<u8>,
}

impl Run<'_, '_, '_, '_> {
    fn step(&mut self, step: &Step<'_>) -> Result<(), BesideError> {
        let time = SimTime::from_seconds(step.time);
        let mut delivered = std::mem::take(&mut self.for_next_step);
        self.hearing.delivered(&step.messages, &mut delivered)?;
        self.hearing.pass_to(time);
        self.publish(&mut delivered)?;
        let mut line = Vec::new();
        request::step(&mut line, time, &step.orders, &delivered);
        self.between.say_to_simulator(line.trim_ascii_end());
        loop {
            if !self.between.simulator("the end of its step")? {
                return Ok(());
            }
            let line = std::mem::take(&mut self.between.line);
            self.between.line.number = line.number;
            let mut delivered = Vec::new();
            match line.parse().map_err(BesideError::Simulator)? {
                SimulatorMessage::Publish(messages) => {
                    self.pass_on(&messages, &mut delivered)?;
                    let mut line = Vec::new();
                    request::deliver(&mut line, &delivered);
                    self.between.say_to_simulator(line.trim_ascii_end());
                }
                SimulatorMessage::Done(done) => {
                    self.pass_on(&done.messages, &mut delivered)?;
                    self.for_next_step = delivered;
                    self.between.say_to_runner(ENDED[usize::from(done.ended)]);
                    return Ok(());
                }
                SimulatorMessage::Failed(_) => {
                    self.between.say_to_runner(&line.bytes);
                    return Ok(());
                }
                other @ (SimulatorMessage::Ready(_) | SimulatorMessage::Time(_)) => {
                    let error = line.out_of_turn(&other, "the end of its step", "end a step with `done`");
                    return Err(BesideError::Simulator(error));
                }
            }
        }
    }

    /// Passes messages of the simulator on, so that what monitors publish comes directly after the message that caused
    /// it. What is delivered of all is added to what the simulator is sent.
    fn pass_on(&mut self, messages: &[Message<'_>], delivered: &mut Vec<u8>) -> Result<(), BesideError> {
        let mut together = Vec::new();
        for (at, Message { topic, value, .. }) in messages.iter().enumerate() {
            let value: &RawValue = value;
            request::message(&mut together, topic, None, |out| out.extend_from_slice(value.get().as_bytes()));
            if self.hearing.hears(topic) || at + 1 == messages.len() {
                let line = [&b"{\"publish\":["[..], &together, b"]}"].concat();
                together.clear();
                if !self.relay(&line, delivered)? {
                    return Ok(());
                }
                self.publish(delivered)?;
            }
        }
        Ok(())
    }

    /// Publishes what monitors have to say, one message after another; they hear what is delivered of it.
    fn publish(&mut self, delivered: &mut Vec<u8>) -> Result<(), BesideError> {
        let mut published = 0;
        while let Some((path, value)) = self.hearing.publication() {
            published += 1;
            if !self.relay(&publish(path, &value), delivered)? {
                return Ok(());
            }
            if published == PUBLISHED_LIMIT {
                self.hearing.give_up();
            }
        }
        Ok(())
    }

    /// Has a line's messages relayed, and hears what is delivered; false if the runner has closed its stream.
    fn relay(&mut self, line: &[u8], delivered: &mut Vec<u8>) -> Result<bool, BesideError> {
        self.between.say_to_runner(line);
        let Some(answer) = self.between.runner()? else { return Ok(false) };
        let Request::Deliver(messages) = Request::parse(&answer)? else {
            return Err(BesideError::Runner { problem: "`publish` was not answered with `deliver`".to_owned() });
        };
        self.hearing.delivered(&messages, delivered)?;
        Ok(true)
    }
}
