//! A monitor as a process of its own beside a simulator that is a program: between the runner and the simulator, it
//! passes the protocol through and adds what the monitor publishes.
//!
//! For the runner it is a part of the simulator: it subscribes to the topics of evidence, and publishes states and
//! mitigation, so operations disturb both as for any other part. It hears what is delivered and nothing else.
//!
//! In lock-step, what a monitor decides is published within the same step: before the simulator hears the message that
//! caused it, the relay has what the monitor says about it. What the simulator sends with the end of a step goes to the
//! relay just before it, so that the monitor hears it at once. The simulator still receives it with the next step.

mod between;
mod error;
mod freely;
mod hearing;
mod in_step;
mod request;

use std::io::{Read, Write};
use std::sync::mpsc::sync_channel;

use sesame_plan::CampaignPlan;

use self::between::{Between, Side, read};
pub use self::error::BesideError;
use self::hearing::Hearing;
use self::request::Request;
use super::protocol::Line;
use crate::metric::MetricTable;
use crate::monitor::Decided;
use crate::wire::WireTable;

/// How many lines are read ahead of each side.
const READ_AHEAD: usize = 1 << 12;

/// The two sides of the monitor. Each ends when its stream does.
#[derive(Debug)]
pub struct Beside<RI, RO, SI, SO> {
    /// What the runner says.
    pub from_runner: RI,
    /// What the runner hears.
    pub to_runner: RO,
    /// What the simulator says.
    pub from_simulator: SI,
    /// What the simulator hears.
    pub to_simulator: SO,
}

/// Runs the monitors of a plan between a runner and a simulator until the runner closes its stream. `decided` is told
/// of each decision, and in which run it was made, counted from 1.
pub fn beside<RI, RO, SI, SO>(
    plan: &CampaignPlan,
    sides: Beside<RI, RO, SI, SO>,
    decided: &mut dyn FnMut(u32, &Decided),
) -> Result<(), BesideError>
where
    RI: Read + Send + 'static,
    RO: Write,
    SI: Read + Send + 'static,
    SO: Write,
{
    let wires = WireTable::new(plan);
    let table =
        MetricTable::new(plan, &wires, &[]).map_err(|error| BesideError::Runner { problem: error.to_string() })?;
    let Beside { from_runner, mut to_runner, from_simulator, mut to_simulator } = sides;
    let (queue, lines) = sync_channel(READ_AHEAD);
    read(from_runner, Side::Runner, queue.clone());
    read(from_simulator, Side::Simulator, queue);
    let mut between = Between {
        lines,
        closed: [false; 2],
        to_runner: &mut to_runner,
        to_simulator: &mut to_simulator,
        line: Line::default(),
    };
    let mut run = 0;
    let mut reset = between.runner()?;
    while let Some(line) = reset {
        let Request::Reset(asked) = Request::parse(&line)? else {
            return Err(BesideError::Runner { problem: "a test did not begin with `reset`".to_owned() });
        };
        run += 1;
        between.say_to_simulator(&line);
        let metrics = table.start();
        let mut tell = |what: &Decided| decided(run, what);
        let hearing = Hearing::new(plan, &wires, &metrics, &mut tell);
        reset = match asked.step {
            Some(_) => in_step::run(&mut between, hearing)?,
            None => freely::run(&mut between, hearing)?,
        };
    }
    Ok(())
}

#[cfg(test)]
mod tests;
