//! What supervisor and worker say to each other: JSON in length-prefixed frames over a loopback connection.
//!
//! Standard output stays the worker's own, so that a hook may print.

use std::io::{self, Read, Write};

use serde::de::DeserializeOwned;
use serde::{Deserialize, Serialize};
use sesame_plan::Test;

use super::traced::TraceOrder;
use crate::observation::Observation;

/// The largest frame either side accepts; time series of a long test are the largest thing sent.
const FRAME_LIMIT: u32 = 1 << 30;

/// A worker's first words.
#[derive(Debug, Serialize, Deserialize)]
pub(super) struct Hello {
    /// Proves that the worker is the one the supervisor started.
    pub(super) token: String,
}

/// What the supervisor asks for.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub struct Job {
    /// The test's number, given back with the result.
    pub number: u32,
    /// The test.
    pub test: Test,
    /// Seed of the simulator's own randomness.
    pub simulator_seed: u64,
    /// The trace that is asked for, if any.
    pub trace: Option<TraceOrder>,
}

/// What the worker answers.
#[derive(Debug, Serialize, Deserialize)]
pub(super) struct Reply {
    pub(super) number: u32,
    pub(super) observation: Observation,
    /// Why the trace that was asked for could not be written.
    pub(super) trace_failure: Option<String>,
}

pub(super) fn send(stream: &mut impl Write, message: &impl Serialize) -> io::Result<()> {
    let body = serde_json::to_vec(message)?;
    let length = u32::try_from(body.len()).ok().filter(|&length| length <= FRAME_LIMIT);
    let length = length.ok_or_else(|| io::Error::other(format!("a frame of {} bytes is too large", body.len())))?;
    stream.write_all(&length.to_le_bytes())?;
    stream.write_all(&body)?;
    stream.flush()
}

pub(super) fn receive<T: DeserializeOwned>(stream: &mut impl Read) -> io::Result<T> {
    let mut length = [0; 4];
    stream.read_exact(&mut length)?;
    let length = u32::from_le_bytes(length);
    if length > FRAME_LIMIT {
        return Err(io::Error::other(format!("a frame of {length} bytes is too large")));
    }
    let mut body = Vec::new();
    stream.take(u64::from(length)).read_to_end(&mut body)?;
    if body.len() != length as usize {
        return Err(io::ErrorKind::UnexpectedEof.into());
    }
    Ok(serde_json::from_slice(&body)?)
}
