/// A dimension of the reduced parameter space: a number that says where a test lies among all possible ones.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum ReducedDimension {
    /// Mean of the midpoints of activations.
    T1,
    /// Mean of their lengths.
    T2,
    /// Spread of their midpoints.
    T3,
    /// Mean of normalised parameters.
    P1,
    /// Spread of normalised parameters.
    P2,
    /// Number of operations.
    O0,
    /// Number of operations that change values.
    O1,
    /// Number of operations that lose messages.
    O2,
    /// Number of operations that delay messages.
    O3,
}

impl ReducedDimension {
    /// All names, in the usual order.
    pub const NAMES: [&'static str; 9] = ["T1", "T2", "T3", "P1", "P2", "O0", "O1", "O2", "O3"];

    /// The dimension of a name.
    pub fn named(name: &str) -> Option<ReducedDimension> {
        Some(match name {
            "T1" => ReducedDimension::T1,
            "T2" => ReducedDimension::T2,
            "T3" => ReducedDimension::T3,
            "P1" => ReducedDimension::P1,
            "P2" => ReducedDimension::P2,
            "O0" => ReducedDimension::O0,
            "O1" => ReducedDimension::O1,
            "O2" => ReducedDimension::O2,
            "O3" => ReducedDimension::O3,
            _ => return None,
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_name_has_its_dimension() {
        for name in ReducedDimension::NAMES {
            assert_eq!(ReducedDimension::named(name).map(|it| format!("{it:?}")).as_deref(), Some(name));
        }
    }
}
