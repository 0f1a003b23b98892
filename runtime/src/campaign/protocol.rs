//! What supervisor and worker say to each other: JSON in length-prefixed frames over a connection of their own.
//!
//! Standard output stays the worker's, so that a hook may print.

use std::io::{self, Read, Write};
use std::time::Duration;

use serde::de::DeserializeOwned;
use serde::{Deserialize, Serialize};

use sesame_base::observation::Observation;
use sesame_relay::transport::Incidents;
use sesame_relay::transport::relay_latency::AddedOnWire;

/// The largest frame either side accepts; time series of a long test are the largest thing sent.
const FRAME_LIMIT: u32 = 1 << 30;

/// The largest frame that is taken from a connection before it is known whose it is.
const GREETING_LIMIT: usize = 1 << 10;

/// A worker's first words.
#[derive(Debug, Serialize, Deserialize)]
pub(super) struct Hello {
    /// Whether its simulator is stepped, so that equal tests give equal results.
    pub(super) lock_stepped: bool,
    /// How long it may take to end what the plan launches, in addition to the simulator, when the connection is closed.
    pub(super) end_limit: Duration,
    /// Proves that the worker is the one that the supervisor started, where other programs could connect.
    pub(super) token: Option<String>,
}

/// What the worker says while it runs a test, and at its end.
#[derive(Debug, Serialize, Deserialize)]
pub(super) enum Said {
    /// The start of the system waits for this, and has for a while.
    Waits(String),
    /// The test has ended.
    Reply(Box<Reply>),
}

/// What the worker answers.
#[derive(Debug, Serialize, Deserialize)]
pub(super) struct Reply {
    pub(super) number: u32,
    pub(super) observation: Observation,
    /// Why the trace that was asked for could not be written.
    pub(super) trace_failure: Option<String>,
    /// What happened to the simulator's process meanwhile.
    pub(super) incidents: Incidents,
    /// How long the relay kept messages, wire by wire.
    pub(super) added: Vec<AddedOnWire>,
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

/// The first frame of a connection, as far as it has come.
#[derive(Debug, Default)]
pub(super) struct Greeting {
    heard: Vec<u8>,
}

impl Greeting {
    /// Takes what has come of it, and nothing that follows it; `None` while it is not whole and the stream has no more
    /// for now. Anything longer than a kilobyte is an error, and so is anything that is not a greeting.
    pub(super) fn hear(&mut self, stream: &mut impl Read) -> io::Result<Option<Hello>> {
        loop {
            let whole = match self.heard.first_chunk() {
                None => size_of::<u32>(),
                Some(length) => {
                    let length = usize::try_from(u32::from_le_bytes(*length)).unwrap_or(usize::MAX);
                    if length == 0 || length > GREETING_LIMIT {
                        return Err(io::Error::other(format!("{length} bytes are not a greeting")));
                    }
                    size_of::<u32>() + length
                }
            };
            if self.heard.len() == whole && whole > size_of::<u32>() {
                return Ok(Some(serde_json::from_slice(&self.heard[size_of::<u32>()..])?));
            }
            let mut more = [0; size_of::<u32>() + GREETING_LIMIT];
            match stream.read(&mut more[..whole - self.heard.len()]) {
                Ok(0) => return Err(io::ErrorKind::UnexpectedEof.into()),
                Ok(count) => self.heard.extend_from_slice(&more[..count]),
                Err(error) if error.kind() == io::ErrorKind::Interrupted => {}
                Err(error) if matches!(error.kind(), io::ErrorKind::WouldBlock | io::ErrorKind::TimedOut) => {
                    return Ok(None);
                }
                Err(error) => return Err(error),
            }
        }
    }
}

/// That nobody has reported in time.
pub(super) fn not_reported(limit: Duration) -> io::Error {
    io::Error::new(io::ErrorKind::TimedOut, format!("it did not report within {} s", limit.as_secs()))
}

#[cfg(test)]
mod tests;
