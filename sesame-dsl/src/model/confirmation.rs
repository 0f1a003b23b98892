//! How a campaign makes sure of what it finds.

/// Tests that enter the front are run again with fresh seeds of the simulator, and are then what these runs say.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Confirmation {
    /// How often each is run again: 1 or more.
    pub times: u32,
    /// How the values of an objective in these runs become one. Default the mean.
    pub by: Typical,
}

/// How the values of an objective in several runs become one.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Typical {
    /// Their mean.
    Mean,
    /// Their median.
    Median,
    /// The value that this share of them, in `0..=1` and above 0, reach or go beyond in the objective's direction.
    Quantile(f64),
}
