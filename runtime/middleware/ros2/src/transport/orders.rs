//! What operations want done to nodes and their parameters, and everything as it was before.

use std::time::Duration;

use sesame_plan::NodeId;
use sesame_relay::fuzz::{Order, Resource};
use sesame_relay::relay::Exchange;
use sesame_relay::transport::TransportError;

use super::change::{Change, Changed, Slowed};
use super::session::{Session, parameter_of_node};
use super::wall_clock::now;
use super::{COMPLETE_WITHIN, System};
use crate::parameters::ParameterValue;

/// How long a node may take to tell or set a parameter.
const ANSWER: Duration = Duration::from_secs(2);

/// How long it takes until a slowed node has had its share and its pause.
const PERIOD: Duration = Duration::from_millis(50);

/// In place of the position of an operation: what compensates for a reality gap is undone with everything else.
const COMPENSATION: usize = usize::MAX;

impl System {
    /// Does what operations want since the last call.
    pub(super) fn obey(&mut self, relay: &mut dyn Exchange) -> Result<(), TransportError> {
        for Order { operation, resource, begins } in relay.take_orders() {
            if !begins {
                self.undo(Some(operation))?;
                continue;
            }
            let what = match resource {
                Resource::Set { node, parameter, value } => self.set_parameter(node, parameter, value)?,
                Resource::Pause { node } => {
                    let done = self.launched.pause(node);
                    self.running(node, done).then_some(Changed::Paused(node))
                }
                Resource::Slow { node, share } => {
                    Some(Changed::Slowed(Slowed { node, share, since: now(), paused: false }))
                }
                Resource::Kill { node } => {
                    let done = self.launched.kill(node);
                    if let Some(session) = &mut self.session {
                        session.bury(&self.plan, node);
                    }
                    self.running(node, done).then_some(Changed::Killed(node))
                }
            };
            if let Some(what) = what {
                self.changes.push(Change { operation, what });
                relay.carried_out(self.now, operation);
            }
        }
        Ok(())
    }

    /// Whether something was done to a node; if not, the results note it.
    fn running(&mut self, node: NodeId, done: bool) -> bool {
        if !done {
            let name = &self.plan.node(node).name;
            self.incidents.notes.push(format!("nothing could be done to node `{name}`: it is not running"));
        }
        done
    }

    /// Sets the parameters of a scene, and those that compensate for a reality gap, for this run. A name is
    /// `NODE/PARAMETER`, with the node as the space calls it.
    pub(super) fn set_parameters(&mut self, parameters: &[(String, f64)]) -> Result<(), TransportError> {
        for (name, value) in parameters {
            let Some((node, parameter)) = parameter_of_node(&self.plan, name) else {
                let known: Vec<String> = self.plan.nodes.iter().map(|node| format!("`{}/…`", node.name)).collect();
                return Err(TransportError::Wiring(format!(
                    "`{name}` is not a parameter of a node; a node and its parameter are {}",
                    known.join(", ")
                )));
            };
            let notes = self.incidents.notes.len();
            let what = self.set_parameter(node, parameter.to_owned(), *value)?;
            // A run without it would be that of another simulation.
            if let Some(note) = self.incidents.notes.drain(notes..).next() {
                return Err(TransportError::Wiring(note));
            }
            self.changes.extend(what.map(|what| Change { operation: COMPENSATION, what }));
        }
        Ok(())
    }

    /// Sets a parameter; `None` if it already has that value.
    fn set_parameter(&mut self, node: NodeId, name: String, value: f64) -> Result<Option<Changed>, TransportError> {
        let Some(session) = &mut self.session else { return Ok(None) };
        let set = session.set_parameter(node, &name, value)?;
        match set {
            Ok(Some(before)) => Ok(Some(Changed::Parameter { node, name, before })),
            Ok(None) => Ok(None),
            Err(reason) => {
                let node = &self.plan.node(node).name;
                self.incidents.notes.push(format!("parameter `{name}` of node `{node}` cannot be set: {reason}"));
                Ok(None)
            }
        }
    }

    /// Makes undone what an operation did, or all operations for `None`.
    pub(super) fn undo(&mut self, operation: Option<usize>) -> Result<(), TransportError> {
        let concerns = |change: &Change| operation.is_none_or(|operation| change.operation == operation);
        // The last one first: of two changes of one parameter the first one knows how it was.
        while let Some(at) = self.changes.iter().rposition(concerns) {
            match self.changes.remove(at).what {
                Changed::Parameter { node, name, before } => {
                    let Some(session) = &mut self.session else { continue };
                    if let Err(reason) = session.restore_parameter(node, &name, &before)? {
                        let node = &self.plan.node(node).name;
                        self.incidents
                            .notes
                            .push(format!("parameter `{name}` of node `{node}` cannot be restored: {reason}"));
                        // The next run starts with new processes.
                        self.spoilt = true;
                    }
                }
                Changed::Paused(node) => {
                    self.launched.resume(node);
                }
                Changed::Slowed(slowed) => {
                    if slowed.paused {
                        self.launched.resume(slowed.node);
                    }
                }
                Changed::Killed(node) => {
                    self.launched.restart(node)?;
                    self.restarted.insert(node);
                    if self.ros.step.is_some() || operation.is_none() {
                        self.complete()?;
                    }
                }
            }
        }
        Ok(())
    }

    /// Waits until a system of which a part was started again is complete.
    fn complete(&mut self) -> Result<(), TransportError> {
        let Some(session) = &mut self.session else { return Ok(()) };
        session.assemble(&self.plan, &mut self.launched, COMPLETE_WITHIN)
    }

    /// Stops slowed nodes and lets them go on; returns after how long the next of them is to be looked at.
    pub(super) fn slow_down(&mut self) -> Option<Duration> {
        let mut next = None;
        for change in &mut self.changes {
            let Changed::Slowed(Slowed { node, share, since, paused }) = &mut change.what else { continue };
            let within = since.elapsed().as_secs_f64() % PERIOD.as_secs_f64();
            let runs = PERIOD.as_secs_f64() * *share;
            let pause = within >= runs;
            if pause != *paused {
                *paused = if pause { self.launched.pause(*node) } else { !self.launched.resume(*node) };
            }
            let left = if pause { PERIOD.as_secs_f64() - within } else { runs - within };
            let left = Duration::from_secs_f64(left.max(0.001));
            next = Some(next.map_or(left, |next: Duration| next.min(left)));
        }
        next
    }

    /// Whether a node is stopped or dead, so that it answers nothing.
    pub(super) fn is_absent(&self, node: NodeId) -> bool {
        self.changes.iter().any(|change| match change.what {
            Changed::Paused(absent) | Changed::Killed(absent) => absent == node,
            Changed::Parameter { .. } | Changed::Slowed(_) => false,
        })
    }
}

impl Session {
    /// Sets a parameter to a number. Gives what it was before; nothing if it was that number; an error for the user if
    /// the node refuses.
    fn set_parameter(
        &mut self,
        node: NodeId,
        name: &str,
        value: f64,
    ) -> Result<Result<Option<ParameterValue>, String>, TransportError> {
        let Some(parameters) = self.parameters.get(&node) else { return Ok(Err("it has no parameters".to_owned())) };
        let ticket = parameters.ask(name, &self.dds)?;
        let Some(reply) = self.reply(ticket, ANSWER)? else { return Ok(Err("the node does not answer".to_owned())) };
        let Some(before) = self.parameters.get(&node).and_then(|parameters| parameters.asked(reply)) else {
            return Ok(Err("the node has no such parameter".to_owned()));
        };
        let after = match before.with(value) {
            Ok(after) => after,
            Err(reason) => return Ok(Err(reason)),
        };
        if after == before {
            return Ok(Ok(None));
        }
        Ok(self.restore_parameter(node, name, &after)?.map(|()| Some(before)))
    }

    /// Sets a parameter to a value that the node had.
    fn restore_parameter(
        &mut self,
        node: NodeId,
        name: &str,
        value: &ParameterValue,
    ) -> Result<Result<(), String>, TransportError> {
        let Some(parameters) = self.parameters.get(&node) else { return Ok(Err("it has no parameters".to_owned())) };
        let ticket = parameters.set(name, value, &self.dds)?;
        let Some(reply) = self.reply(ticket, ANSWER)? else { return Ok(Err("the node does not answer".to_owned())) };
        Ok(self.parameters.get(&node).map_or(Ok(()), |parameters| parameters.was_set(reply)))
    }
}
