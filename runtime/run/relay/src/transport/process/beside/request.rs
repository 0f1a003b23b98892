//! What the runner says, as one hears it who stands for the simulator.

use std::borrow::Cow;

use serde::Deserialize;
use serde_json::value::RawValue;

use super::error::BesideError;
use crate::simulator::OrderToNode;

/// A line of the runner.
#[derive(Debug, Deserialize)]
#[serde(rename_all = "snake_case")]
pub(super) enum Request<'a> {
    Reset(Reset),
    #[serde(borrow)]
    Step(Step<'a>),
    #[serde(borrow)]
    Deliver(Vec<Delivered<'a>>),
    Orders(Vec<OrderToNode>),
}

#[derive(Debug, Deserialize)]
pub(super) struct Reset {
    /// The length of a step in seconds; `None` for a simulator that runs freely.
    pub(super) step: Option<f64>,
}

#[derive(Debug, Deserialize)]
pub(super) struct Step<'a> {
    /// Its end, in seconds.
    pub(super) time: f64,
    /// For nodes that are parts of the simulator.
    #[serde(default)]
    pub(super) orders: Vec<OrderToNode>,
    #[serde(default, borrow)]
    pub(super) messages: Vec<Delivered<'a>>,
}

/// A message that was delivered.
#[derive(Debug, Deserialize)]
pub(super) struct Delivered<'a> {
    #[serde(borrow)]
    pub(super) topic: Cow<'a, str>,
    /// When, in seconds.
    pub(super) time: f64,
    #[serde(borrow)]
    pub(super) value: &'a RawValue,
}

impl<'a> Request<'a> {
    pub(super) fn parse(line: &'a [u8]) -> Result<Self, BesideError> {
        let text = std::str::from_utf8(line).map_err(|_| BesideError::Runner { problem: "not UTF-8".to_owned() })?;
        serde_json::from_str(text).map_err(|error| BesideError::Runner { problem: error.to_string() })
    }
}
