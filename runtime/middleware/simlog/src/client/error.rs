//! What can go wrong between a client and a simulator.

use std::time::Duration;

use tonic::{Code, Status};

/// What went wrong, in words for the user. Each names the URL.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum ClientError {
    /// The URL, or what belongs to it, cannot be used.
    #[error("`{url}` cannot be used: {reason}")]
    Url {
        /// The URL.
        url: String,
        /// The reason.
        reason: String,
    },
    /// Nobody answers there.
    #[error("nobody answers at {url} within {} s: {how}", limit.as_secs_f64())]
    Unreachable {
        /// The URL.
        url: String,
        /// For how long it was tried.
        limit: Duration,
        /// How the last attempt failed.
        how: String,
    },
    /// The connection was lost.
    #[error("the connection to {url} was lost: {how}")]
    Lost {
        /// The URL.
        url: String,
        /// How, as a phrase.
        how: String,
    },
    /// The simulator answered with an error.
    #[error("{url} refuses {what}: {how}")]
    Refused {
        /// The URL.
        url: String,
        /// What was asked.
        what: String,
        /// Its words.
        how: String,
    },
    /// The simulator has no such topic.
    #[error("{url} has no topic `{name}`")]
    NoTopic {
        /// The URL.
        url: String,
        /// Its name on the wire.
        name: String,
    },
    /// The simulator did not answer in time.
    #[error("{url} did not answer {what} within {} s", limit.as_secs_f64())]
    Silent {
        /// The URL.
        url: String,
        /// What was asked.
        what: String,
        /// For how long it was awaited.
        limit: Duration,
    },
    /// More came in than is kept.
    #[error(
        "{url} sends faster than its messages are taken: {messages} messages with {bytes} bytes wait, the last one on \
         `{name}`; listen to fewer topics, or take smaller steps"
    )]
    Overflow {
        /// The URL.
        url: String,
        /// The topic of the message that was too much, by its name on the wire.
        name: String,
        /// How many messages wait.
        messages: usize,
        /// How many bytes they have.
        bytes: usize,
    },
}

impl ClientError {
    /// The error of a call.
    pub(super) fn of(url: &str, what: &str, status: &Status) -> Self {
        let url = url.to_owned();
        // Only what did not come from the other side has a cause.
        match std::error::Error::source(status) {
            Some(cause) => ClientError::Lost { url, how: format!("{what} was not answered: {}", root(cause)) },
            None if status.code() == Code::Unavailable => ClientError::Lost { url, how: status.message().to_owned() },
            None => {
                let how = format!("{} ({:?})", status.message(), status.code());
                ClientError::Refused { url, what: what.to_owned(), how }
            }
        }
    }
}

/// What is behind an error, which says most.
pub(super) fn root(error: &(dyn std::error::Error + 'static)) -> String {
    let mut error = error;
    while let Some(cause) = error.source() {
        error = cause;
    }
    error.to_string()
}
