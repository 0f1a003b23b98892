//! What a space is made of, besides what was found.

use std::collections::BTreeSet;

/// Where definitions are, and how the system was reached.
#[derive(Debug, Clone, Copy)]
pub struct Origin<'a> {
    /// The folders with definitions of types, as they are written.
    pub folders: &'a [String],
    /// The types of services and actions that have a layout.
    pub services: &'a BTreeSet<String>,
    /// Lines of the simulator that say how it was reached, such as where a secret is.
    pub settings: &'a [String],
}
