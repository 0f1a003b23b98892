//! The way of what monitors publish.

/// How what monitors publish goes on.
#[derive(Debug, Default)]
pub(super) struct Publishing {
    /// Whether subscribers are there, so that messages can be sent.
    pub(super) open: bool,
    /// Whether the queue is being emptied.
    pub(super) busy: bool,
    /// Whether there was no end of it.
    pub(super) endless: bool,
}
