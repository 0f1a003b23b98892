//! What monitors publish: their states, and what is to bring the system into a safe state.

use std::collections::VecDeque;
use std::sync::Arc;

use sesame_monitor::{Decision, State};
use sesame_plan::{CampaignPlan, FieldRef, Mitigation, MitigationValue, Monitor, MonitorId, Type};

use crate::metric::sample;
use crate::value::{Fields, Record, Text, Value};
use crate::wire::{Wire, WireTable};

/// Where monitors publish.
pub(super) struct Outlets<'p> {
    /// Per monitor.
    monitors: Vec<Outlet<'p>>,
    /// Per wire: the last message that was delivered, where a mitigation sets a field of it; zeros before the first.
    last: Vec<Option<Value>>,
}

struct Outlet<'p> {
    /// The wire of its state, with the type of it, and with the fields of its message if it has any.
    state: Option<(Wire, &'p Type, Option<Arc<Fields>>)>,
    mitigation: Option<(&'p Mitigation, Vec<Wire>)>,
}

impl<'p> Outlets<'p> {
    pub(super) fn new(plan: &'p CampaignPlan, wires: &WireTable) -> Self {
        let of_topic = |topic| wires.iter().filter(move |&wire| wires.topic(wire) == topic);
        let mut last = vec![None; wires.len()];
        let monitors = plan.monitors.iter().map(|monitor| {
            // An external monitor only observes.
            let publishes = monitor.publishes?;
            let (ty, field) = plan.state_on(publishes)?;
            let fields = field.map(|field| Fields::new([field]));
            let state = of_topic(publishes).next().map(|wire| (wire, ty, fields));
            let mitigation = monitor.otherwise.mitigation.as_ref().map(|mitigation| {
                let wires: Vec<Wire> = of_topic(mitigation.field.topic).collect();
                (mitigation, wires)
            });
            Some(Outlet { state, mitigation })
        });
        let monitors: Vec<Outlet<'p>> =
            monitors.map(|outlet| outlet.unwrap_or(Outlet { state: None, mitigation: None })).collect();
        for (Mitigation { field, .. }, wires) in monitors.iter().filter_map(|outlet| outlet.mitigation.as_ref()) {
            if !field.path.is_empty() {
                for wire in wires {
                    last[wire.index()] = Some(sample(plan, &plan.topic(field.topic).ty));
                }
            }
        }
        Outlets { monitors, last }
    }

    /// These monitors send no mitigation.
    pub(super) fn withhold(&mut self, monitors: &[MonitorId]) {
        for monitor in monitors {
            self.monitors[monitor.index()].mitigation = None;
        }
    }

    /// A message is delivered.
    pub(super) fn remember(&mut self, wire: Wire, value: &Value) {
        if let Some(last) = &mut self.last[wire.index()] {
            last.clone_from(value);
        }
    }

    /// Queues what a decision causes: first the state, then the mitigation.
    pub(super) fn publish(&self, plan: &CampaignPlan, decision: &Decision, outbox: &mut VecDeque<(Wire, Value)>) {
        let Outlet { state, mitigation } = &self.monitors[decision.monitor.index()];
        if let Some((wire, ty, fields)) = state {
            let said = said(plan.monitor(decision.monitor), decision.state, ty);
            let message = match fields {
                Some(fields) => Record::new(fields, vec![said]).into(),
                None => said,
            };
            outbox.push_back((*wire, message));
        }
        let Some((mitigation, wires)) = mitigation.as_ref().filter(|_| decision.mitigate) else { return };
        for &wire in wires {
            outbox.push_back((wire, self.message(mitigation, wire)));
        }
    }

    fn message(&self, Mitigation { field, value }: &Mitigation, wire: Wire) -> Value {
        let value = match value {
            MitigationValue::Bool(value) => Value::Bool(*value),
            MitigationValue::Int(value) => Value::Int(*value),
            MitigationValue::Real(value) => Value::Real(*value),
            MitigationValue::Text(value) => Value::Text(Text::from(value.as_str())),
        };
        let Some(last) = &self.last[wire.index()] else { return value };
        let mut message = last.clone();
        set(&mut message, field, value);
        message
    }
}

/// Sets a field of a message, which may be a coordinate of a point.
fn set(message: &mut Value, field: &FieldRef, value: Value) {
    if let Some(place) = message.at_mut(&field.path) {
        *place = value;
        return;
    }
    let Some((coordinate, before)) = field.path.split_last() else { return };
    let axis = ["x", "y", "z"].iter().position(|axis| axis == coordinate);
    if let (Some(axis), Some(Value::Point(point)), Some(number)) = (axis, message.at_mut(before), value.number()) {
        point[axis] = number;
    }
}

/// A state as the monitor publishes it.
fn said(monitor: &Monitor, state: State, ty: &Type) -> Value {
    match ty {
        Type::Bool => Value::Bool(state != State::Safe),
        Type::Int { .. } => Value::Int(i64::from(integrity(monitor, state))),
        _ => Value::Text(Text::from(monitor.state_name(state.into()))),
    }
}

/// The integrity of a state; 0 of the safe state.
pub(super) fn integrity(monitor: &Monitor, state: State) -> u32 {
    match state {
        State::Guarantee(at) => monitor.guarantees[at as usize].integrity,
        State::Safe => 0,
    }
}
