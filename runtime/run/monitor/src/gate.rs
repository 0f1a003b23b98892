//! Gates: what a guarantee needs of evidence and demands.

use sesame_plan::Gate;

use crate::truth::{Truth, at_least};

/// What a gate finally reads.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Leaf {
    /// Evidence of the same monitor, by position.
    Evidence(u32),
    /// A demand of the same monitor, by position.
    Demand(u32),
}

/// How many of a gate's parts must hold, and the parts; `None` for a leaf.
pub fn parts(gate: &Gate) -> Option<(usize, &[Gate])> {
    match gate {
        Gate::Evidence(_) | Gate::Demand(_) => None,
        Gate::All(of) => Some((of.len(), of)),
        Gate::Any(of) => Some((1, of)),
        Gate::AtLeast { count, of } => Some((*count as usize, of)),
    }
}

/// The value of a gate, given those of its leaves.
pub fn value(gate: &Gate, of: &impl Fn(Leaf) -> Truth) -> Truth {
    match gate {
        Gate::Evidence(at) => of(Leaf::Evidence(*at)),
        Gate::Demand(at) => of(Leaf::Demand(*at)),
        Gate::All(parts) => parts.iter().map(|part| value(part, of)).min().unwrap_or(Truth::True),
        Gate::Any(parts) => parts.iter().map(|part| value(part, of)).max().unwrap_or(Truth::False),
        Gate::AtLeast { count, of: parts } => at_least(*count as usize, parts.iter().map(|part| value(part, of))),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_gate_is_computed_from_its_leaves() {
        use Truth::{False, True, Unknown};
        let two = Gate::AtLeast { count: 2, of: (0..3).map(Gate::Evidence).collect() };
        let gate = Gate::All(vec![two.clone(), Gate::Any(vec![Gate::Demand(0), Gate::Evidence(0)])]);
        let with = |gate: &Gate, evidence: [Truth; 3], demand| {
            value(gate, &|leaf| match leaf {
                Leaf::Evidence(at) => evidence[at as usize],
                Leaf::Demand(_) => demand,
            })
        };
        assert_eq!(with(&two, [True, Unknown, False], False), Unknown);
        assert_eq!(with(&two, [True, True, False], False), True);
        assert_eq!(with(&two, [Unknown, False, False], True), False);
        assert_eq!(with(&gate, [True, True, False], False), True);
        assert_eq!(with(&gate, [False, True, True], Unknown), Unknown);
        assert_eq!(with(&gate, [False, True, True], False), False);
    }
}
