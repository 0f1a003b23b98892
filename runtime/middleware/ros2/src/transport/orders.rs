//! What operations want done to nodes and their parameters, and everything as it was before.

use std::time::Duration;

use sesame_plan::{NewValue, NodeId, Transition};
use sesame_relay::fuzz::{Order, Resource};
use sesame_relay::relay::Exchange;
use sesame_relay::transport::TransportError;

use super::change::{Change, Changed, Slowed};
use super::session::{Session, parameter_of_node};
use super::wall_clock::now;
use super::{COMPLETE_WITHIN, System};
use crate::lifecycle::State;
use crate::parameters::ParameterValue;

/// How long a node may take to tell or set a parameter.
const ANSWER: Duration = Duration::from_secs(2);

/// How long a node may take for a transition.
const TRANSITION: Duration = Duration::from_secs(10);

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
                Resource::Set { node, parameter, value } => self.set_parameter(node, parameter, &value)?,
                Resource::Transition { node, transition } => self.take_through(node, transition)?,
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
            let what = self.set_parameter(node, parameter.to_owned(), &NewValue::Number(*value))?;
            // A run without it would be that of another simulation.
            if let Some(note) = self.incidents.notes.drain(notes..).next() {
                return Err(TransportError::Wiring(note));
            }
            self.changes.extend(what.map(|what| Change { operation: COMPENSATION, what }));
        }
        Ok(())
    }

    /// Sets a parameter; `None` if it already has that value.
    fn set_parameter(
        &mut self,
        node: NodeId,
        name: String,
        value: &NewValue,
    ) -> Result<Option<Changed>, TransportError> {
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

    /// Takes a node through a transition, and through those that have to come before it; `None` if nothing changed.
    fn take_through(&mut self, node: NodeId, transition: Transition) -> Result<Option<Changed>, TransportError> {
        let Some(session) = &mut self.session else { return Ok(None) };
        let word = transition.word();
        let reason = match session.state(node)? {
            Err(reason) => reason,
            Ok(before) => match before.after(transition) {
                None => format!("it is {}", before.name()),
                Some(after) => match session.go(node, before, after)? {
                    Ok(()) => return Ok(Some(Changed::State { node, before, after })),
                    Err(reason) => {
                        // It may have come a part of the way.
                        self.bring_back(node, before)?;
                        reason
                    }
                },
            },
        };
        let node = &self.plan.node(node).name;
        self.incidents.notes.push(format!("node `{node}` cannot `{word}`: {reason}"));
        Ok(None)
    }

    /// Brings a node back to a state in which it was, from the one in which it is.
    fn bring_back(&mut self, node: NodeId, before: State) -> Result<(), TransportError> {
        // It does not answer what it was sent while it was not active.
        self.restarted.insert(node);
        let Some(session) = &mut self.session else { return Ok(()) };
        let back = match session.state(node)? {
            Ok(state) => session.go(node, state, before)?,
            Err(reason) => Err(reason),
        };
        if let Err(reason) = back {
            let (node, before) = (&self.plan.node(node).name, before.name());
            self.incidents.notes.push(format!("node `{node}` cannot be made {before} again: {reason}"));
            // The next run starts with new processes.
            self.spoilt = true;
        }
        Ok(())
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
                Changed::State { node, before, .. } => self.bring_back(node, before)?,
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

    /// Whether a node is stopped, dead or not active any more, so that it answers nothing.
    pub(super) fn is_absent(&self, node: NodeId) -> bool {
        self.changes.iter().any(|change| match change.what {
            Changed::Paused(absent) | Changed::Killed(absent) => absent == node,
            Changed::State { node: changed, before, after } => changed == node && after < before,
            Changed::Parameter { .. } | Changed::Slowed(_) => false,
        })
    }
}

impl Session {
    /// Sets a parameter to a value. Gives what it was before; nothing if it was that value; an error for the user if
    /// the node refuses.
    fn set_parameter(
        &mut self,
        node: NodeId,
        name: &str,
        value: &NewValue,
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

    /// The state of a node; an error for the user if it says none.
    fn state(&mut self, node: NodeId) -> Result<Result<State, String>, TransportError> {
        let Some(lifecycle) = self.lifecycles.get(&node) else { return Ok(Err("it has no lifecycle".to_owned())) };
        let ticket = lifecycle.ask(&self.dds)?;
        let Some(reply) = self.reply(ticket, ANSWER)? else { return Ok(Err("the node does not answer".to_owned())) };
        Ok(self.lifecycles.get(&node).map_or_else(|| Err("it has no lifecycle".to_owned()), |of| of.asked(reply)))
    }

    /// Takes a node from one state to another; an error for the user if it refuses.
    fn go(&mut self, node: NodeId, from: State, to: State) -> Result<Result<(), String>, TransportError> {
        for transition in from.to(to) {
            let Some(lifecycle) = self.lifecycles.get(&node) else { break };
            let ticket = lifecycle.change(transition, &self.dds)?;
            let Some(reply) = self.reply(ticket, TRANSITION)? else {
                return Ok(Err(format!("it does not answer `{}`", transition.word())));
            };
            match self.lifecycles.get(&node).map_or(Ok(true), |lifecycle| lifecycle.was_changed(reply)) {
                Ok(true) => {}
                Ok(false) => return Ok(Err(format!("it refuses to `{}`", transition.word()))),
                Err(reason) => return Ok(Err(reason)),
            }
        }
        Ok(Ok(()))
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
