//! Recordings: traces of tests are written as MCAP files, and these and the recordings of others are read.
//!
//! A [`TraceWriter`] writes a [`trace`] while its test runs. Whatever a recording is, it is read as messages with
//! topics and times: MCAP, rosbag2 in SQLite, folders of either, and bags of ROS 1, compressed or not, with messages in
//! JSON, CDR and as ROS 1 serialises them. Layouts are those that the file itself says, else those of the space. From
//! there on all are the same: [`feed()`] gives their messages to metrics and monitors, [`monitors`] keeps what monitors
//! hear, [`signals`] collects numbers over time.
//!
//! Files are not trusted: memory is bounded, whatever lengths a file claims, and what is damaged is read up to the
//! damage, which is said.

#![expect(clippy::disallowed_methods, clippy::disallowed_types, reason = "an adapter: it writes and reads files")]
// These macros panic where nothing can be written: on a full disk, or after the reader has gone.
#![warn(clippy::print_stdout, clippy::print_stderr)]

mod container;
mod error;
mod feed;
mod heard;
mod layout;
mod messages;
mod order;
mod pass;
mod payload;
mod signals;
pub mod trace;

pub use error::RecordingError;
pub use feed::{Fed, feed, feed_telling};
pub use heard::monitors;
pub use messages::{RecordedMessage, messages};
pub use pass::{RecordedMetric, RecordedRun};
pub use sesame_relay::monitor::recorded::{Heard, RecordedMonitors};
pub use signals::{Signal, signals};
pub use trace::{Subject, TraceError, TraceWriter, recover};

#[cfg(test)]
mod tests;
