//! What came in and is yet to be looked at: a queue with bounds, at which connections wait.

use std::collections::VecDeque;
use std::sync::{Arc, Condvar, Mutex};
use std::time::{Duration, Instant};

use super::lock::lock;

/// The most messages that wait.
const MOST: usize = 10_000;

/// The most bytes of messages that wait, in addition to the last message.
const MOST_BYTES: usize = 256 << 20;

/// The most notes; others could cause any number of them.
const MOST_NOTES: usize = 1_000;

/// Something that came in.
#[derive(Debug)]
pub(crate) enum Incoming {
    /// A message of a subscription, by its position.
    Message { subscription: usize, bytes: Arc<[u8]>, arrived: Instant },
    /// A call of a service, by its position.
    Call { service: usize, call: u64, bytes: Arc<[u8]>, arrived: Instant },
    /// The answer of the server of a service.
    Reply { service: usize, call: u64, bytes: Arc<[u8]>, arrived: Instant },
    /// Something for the user to know.
    Note(String),
}

impl Incoming {
    fn size(&self) -> usize {
        match self {
            Incoming::Message { bytes, .. } | Incoming::Call { bytes, .. } | Incoming::Reply { bytes, .. } => {
                bytes.len()
            }
            Incoming::Note(_) => 0,
        }
    }
}

/// The queue.
#[derive(Debug, Default)]
pub(crate) struct Inbox {
    state: Mutex<State>,
    filled: Condvar,
    emptied: Condvar,
}

#[derive(Debug, Default)]
struct State {
    queue: VecDeque<Incoming>,
    bytes: usize,
    notes: usize,
    closed: bool,
}

impl Inbox {
    /// Puts something in; where there is no room, waits until there is: then its publisher is no longer read from, and
    /// TCP holds it back. False once the node ends.
    pub(super) fn push(&self, incoming: Incoming) -> bool {
        let mut state = lock(&self.state);
        while !state.closed && (state.queue.len() >= MOST || state.bytes >= MOST_BYTES) {
            state = self.emptied.wait(state).unwrap_or_else(std::sync::PoisonError::into_inner);
        }
        if state.closed {
            return false;
        }
        state.bytes += incoming.size();
        state.queue.push_back(incoming);
        self.filled.notify_one();
        true
    }

    /// Puts a note in, unless there were too many; the last one says so.
    pub(super) fn note(&self, note: String) {
        let mut state = lock(&self.state);
        if state.notes < MOST_NOTES {
            state.notes += 1;
            let last = state.notes == MOST_NOTES;
            let note = if last { format!("after {MOST_NOTES} notes on ROS 1, no more are kept") } else { note };
            state.queue.push_back(Incoming::Note(note));
            self.filled.notify_one();
        }
    }

    /// Takes the next out, waited for at most this long.
    pub(crate) fn pop(&self, timeout: Duration) -> Option<Incoming> {
        let state = lock(&self.state);
        let waited = self.filled.wait_timeout_while(state, timeout, |state| state.queue.is_empty());
        let (mut state, _) = waited.unwrap_or_else(std::sync::PoisonError::into_inner);
        let incoming = state.queue.pop_front()?;
        state.bytes -= incoming.size();
        self.emptied.notify_all();
        Some(incoming)
    }

    /// Lets nobody wait any more.
    pub(super) fn close(&self) {
        lock(&self.state).closed = true;
        self.emptied.notify_all();
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn message(subscription: usize, size: usize) -> Incoming {
        Incoming::Message { subscription, bytes: vec![0; size].into(), arrived: Instant::now() }
    }

    #[test]
    fn a_full_inbox_holds_publishers_back_and_loses_nothing() {
        let inbox = Arc::new(Inbox::default());
        let pushed = Arc::clone(&inbox);
        let publisher = std::thread::spawn(move || (0..3 * MOST).all(|at| pushed.push(message(at, 1))));
        let mut next = 0;
        while next < 3 * MOST {
            assert!(lock(&inbox.state).queue.len() <= MOST);
            let Some(Incoming::Message { subscription, .. }) = inbox.pop(Duration::from_secs(5)) else {
                panic!("{next}")
            };
            assert_eq!(subscription, next);
            next += 1;
        }
        assert!(publisher.join().unwrap());
        assert_eq!(lock(&inbox.state).bytes, 0);
    }

    #[test]
    fn who_waits_for_room_is_told_when_the_node_ends() {
        let inbox = Arc::new(Inbox::default());
        assert!(inbox.push(message(0, MOST_BYTES)));
        let pushed = Arc::clone(&inbox);
        let publisher = std::thread::spawn(move || pushed.push(message(1, 1)));
        inbox.close();
        assert!(!publisher.join().unwrap());
    }

    #[test]
    fn notes_beyond_their_number_are_not_kept() {
        let inbox = Inbox::default();
        (0..2 * MOST_NOTES).for_each(|at| inbox.note(at.to_string()));
        assert_eq!(lock(&inbox.state).queue.len(), MOST_NOTES);
        let mut last = None;
        while let Some(Incoming::Note(note)) = inbox.pop(Duration::ZERO) {
            last = Some(note);
        }
        assert_eq!(last.as_deref(), Some("after 1000 notes on ROS 1, no more are kept"));
    }
}
