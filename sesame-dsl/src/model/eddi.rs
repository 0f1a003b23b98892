//! Runtime monitors: conditional safety certificates that watch evidence and publish which guarantee holds.

use sesame_plan::Condition;
pub use sesame_plan::{Gate, MitigationValue, MonitorPart, MonitorState, Score, Stale, StaleIs};

use super::declaration::Declaration;
use super::formula::Input;
use super::ids::{EddiId, TopicId};
use super::system::FieldPath;

/// A runtime monitor.
#[derive(Debug, Clone, PartialEq)]
pub struct Eddi {
    /// Its name and doc comment.
    pub declaration: Declaration,
    /// Where it publishes what holds: a topic that carries a `bool` (whether any guarantee holds), an `int` (the
    /// integrity of the best one) or a `text` (its name). `None` for an external monitor, which is a part of the
    /// system.
    pub publishes: Option<TopicId>,
    /// Guarantees of other monitors that it relies on, in written order.
    pub demands: Vec<Demand>,
    /// What it watches, in written order. Of an external monitor whose state a topic says: for each guarantee, in
    /// written order, whether it says that one.
    pub evidence: Vec<Evidence>,
    /// What it can guarantee, highest integrity first; at least one, no two of one integrity.
    pub guarantees: Vec<Guarantee>,
    /// What holds when no guarantee does.
    pub otherwise: Otherwise,
}

impl Eddi {
    /// What can be true, false or unknown of it, each name once: evidence, demands, guarantees, and whether none holds.
    pub fn parts(&self) -> impl Iterator<Item = (MonitorPart, &Declaration)> {
        let own = |declaration: &Declaration| {
            self.guarantees.iter().any(|guarantee| guarantee.declaration.name == declaration.name)
        };
        let evidence =
            (0..).zip(&self.evidence).map(|(at, evidence)| (MonitorPart::Evidence(at), &evidence.declaration));
        // What a topic says of a guarantee is not named besides it.
        let evidence = evidence.filter(move |(_, declaration)| !own(declaration));
        let demands = (0..).zip(&self.demands).map(|(at, demand)| (MonitorPart::Demand(at), &demand.declaration));
        let guarantees =
            (0..).zip(&self.guarantees).map(|(at, guarantee)| (MonitorPart::Guarantee(at), &guarantee.declaration));
        let otherwise = std::iter::once((MonitorPart::Otherwise, &self.otherwise.declaration));
        evidence.chain(demands).chain(guarantees).chain(otherwise)
    }
}

/// A guarantee of another monitor that one relies on. Its name is that of the guarantee.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Demand {
    /// Its name and doc comment.
    pub declaration: Declaration,
    /// Whose it is: never, by any chain of demands, the monitor that demands.
    pub eddi: EddiId,
}

/// A condition on messages, with three values: true, false, unknown. Before each of its topics had a message it is
/// unknown.
#[derive(Debug, Clone, PartialEq)]
pub struct Evidence {
    /// Its name and doc comment.
    pub declaration: Declaration,
    /// What [`Evidence::condition`] refers to by position; at least one.
    pub inputs: Vec<Input>,
    /// When it is true.
    pub condition: Condition,
    /// How long the condition must have held without a break, in seconds. Default 0.
    pub held: f64,
    /// When it has become too old to be believed; `None` is never.
    pub stale: Option<Stale>,
    /// Whether it hears messages before operations, and not as they are delivered.
    pub inbound: bool,
}

/// Something a monitor can vouch for.
#[derive(Debug, Clone, PartialEq)]
pub struct Guarantee {
    /// Its name and doc comment.
    pub declaration: Declaration,
    /// Its integrity: 1 or more, larger is stronger.
    pub integrity: u32,
    /// What it needs.
    pub gate: Gate,
}

/// What holds when no guarantee does.
#[derive(Debug, Clone, PartialEq)]
pub struct Otherwise {
    /// Its name and doc comment.
    pub declaration: Declaration,
    /// What is sent then.
    pub mitigation: Option<Mitigation>,
}

/// A message that is to make the system safe.
#[derive(Debug, Clone, PartialEq)]
pub struct Mitigation {
    /// What is set.
    pub field: FieldPath,
    /// What it is set to, of the field's type and in its unit.
    pub value: MitigationValue,
}
