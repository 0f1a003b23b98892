//! States of monitors, as the values of evidence change.

use sesame_base::time::SimTime;
use sesame_plan::{MonitorId, MonitorState};

use super::{EvidenceId, Network};
use crate::circuit::{NodeIndex, Values};
use crate::truth::Truth;

/// The state of a monitor.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum State {
    /// This guarantee is the strongest one that holds: a position in [`sesame_plan::Monitor::guarantees`].
    Guarantee(u32),
    /// No guarantee holds: [`sesame_plan::Monitor::otherwise`].
    Safe,
}

impl From<MonitorState> for State {
    fn from(state: MonitorState) -> Self {
        match state {
            MonitorState::Guarantee(at) => State::Guarantee(at),
            MonitorState::Otherwise => State::Safe,
        }
    }
}

impl From<State> for MonitorState {
    fn from(state: State) -> Self {
        match state {
            State::Guarantee(at) => MonitorState::Guarantee(at),
            State::Safe => MonitorState::Otherwise,
        }
    }
}

/// A monitor begins with a state, or changes it.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Decision {
    /// Which monitor.
    pub monitor: MonitorId,
    /// Its new state.
    pub state: State,
    /// When.
    pub at: SimTime,
    /// Whether a guarantee was lost and none is left, so that [`sesame_plan::SafeState::mitigation`] is due.
    pub mitigate: bool,
}

/// Values of everything that follows from evidence, and the states of all monitors.
#[derive(Debug, Clone)]
pub(crate) struct Deciding {
    values: Values,
    states: Vec<State>,
    /// Ranks of monitors of which a guarantee began or ceased to hold, each once.
    touched: Vec<u32>,
    is_touched: Vec<bool>,
}

impl Deciding {
    /// All evidence is unknown, so that all monitors are in their safe states.
    pub(crate) fn new(network: &Network) -> Self {
        Deciding {
            values: Values::new(network.circuit()),
            states: vec![State::Safe; network.positions.len()],
            touched: Vec::with_capacity(network.positions.len()),
            is_touched: vec![false; network.positions.len()],
        }
    }

    /// The value of a node of the network's circuit.
    pub(crate) fn get(&self, node: NodeIndex) -> Truth {
        self.values.get(node)
    }

    /// The state of a monitor.
    pub(crate) fn state(&self, monitor: MonitorId) -> State {
        self.states[monitor.index()]
    }

    /// Sets the value of evidence. Monitors are not decided before [`Deciding::decide`].
    #[inline]
    pub(crate) fn set(&mut self, network: &Network, evidence: EvidenceId, truth: Truth) {
        let Deciding { values, touched, is_touched, .. } = self;
        values.set(&network.circuit, evidence.0, truth, |node, before, after| {
            if before != Truth::True && after != Truth::True {
                return;
            }
            let Some(monitor) = network.guarantor(node) else { return };
            if !std::mem::replace(&mut is_touched[monitor.index()], true) {
                touched.push(network.positions[monitor.index()].rank);
            }
        });
    }

    /// Ends an event: decides each monitor that it concerns, in the order of their demands.
    pub(crate) fn decide(&mut self, network: &Network, at: SimTime, mut decided: impl FnMut(Decision)) {
        self.touched.sort_unstable();
        for rank in self.touched.drain(..) {
            let monitor = network.order[rank as usize];
            self.is_touched[monitor.index()] = false;
            let positions = &network.positions[monitor.index()];
            let holds = |&position: &u32| self.values.get(positions.first_guarantee + position) == Truth::True;
            let state = (0..positions.guarantees).find(holds).map_or(State::Safe, State::Guarantee);
            let before = std::mem::replace(&mut self.states[monitor.index()], state);
            if before != state {
                decided(Decision { monitor, state, at, mitigate: state == State::Safe });
            }
        }
    }
}
