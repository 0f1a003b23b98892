//! What came in and was not taken yet: bounded, shared between the connection's thread and whoever takes it.

use std::collections::{BTreeMap, VecDeque};
use std::mem;
use std::sync::{Condvar, Mutex, MutexGuard, PoisonError};
use std::time::Duration;

use super::error::ClientError;
use crate::message::Message;

/// A message that came in.
#[derive(Debug, Clone, PartialEq)]
pub struct Heard {
    /// The client's stream that it came on, counted from 0 in the order in which they were asked for.
    pub stream: usize,
    /// The message.
    pub message: Message,
}

/// How much may wait.
#[derive(Debug, Clone, Copy)]
pub struct Bounds {
    /// Messages.
    pub messages: usize,
    /// Their bytes on the wire.
    pub bytes: usize,
}

impl Default for Bounds {
    fn default() -> Self {
        Bounds { messages: 100_000, bytes: 256 << 20 }
    }
}

#[derive(Debug)]
pub(super) struct Inbox {
    url: String,
    bounds: Bounds,
    state: Mutex<State>,
    /// Something has changed.
    more: Condvar,
}

#[derive(Debug, Default)]
struct State {
    queue: VecDeque<Heard>,
    bytes: usize,
    /// Why nothing more can come; the first reason.
    fault: Option<ClientError>,
    /// How many streams the simulator has acknowledged.
    open: usize,
    /// The streams of names, where one connection carries them all.
    streams: BTreeMap<String, usize>,
}

impl Inbox {
    pub(super) fn new(url: &str, bounds: Bounds) -> Self {
        Inbox { url: url.to_owned(), bounds, state: Mutex::default(), more: Condvar::new() }
    }

    fn state(&self) -> MutexGuard<'_, State> {
        // Nobody panics in between.
        self.state.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// A message came in. False if it is too much: nothing more is kept.
    pub(super) fn put(&self, stream: usize, name: &str, message: Message) -> bool {
        let mut state = self.state();
        let bytes = state.bytes + message.size();
        let messages = state.queue.len() + 1;
        if messages > self.bounds.messages || bytes > self.bounds.bytes {
            let (url, name) = (self.url.clone(), name.to_owned());
            state.fault.get_or_insert(ClientError::Overflow { url, name, messages, bytes });
        } else {
            state.bytes = bytes;
            state.queue.push_back(Heard { stream, message });
        }
        self.more.notify_all();
        state.fault.is_none()
    }

    pub(super) fn fail(&self, fault: ClientError) {
        self.state().fault.get_or_insert(fault);
        self.more.notify_all();
    }

    pub(super) fn opened(&self) {
        self.state().open += 1;
        self.more.notify_all();
    }

    /// From now on a name belongs to a stream.
    pub(super) fn name(&self, name: &str, stream: usize) {
        self.state().streams.insert(name.to_owned(), stream);
    }

    pub(super) fn stream(&self, name: &str) -> Option<usize> {
        self.state().streams.get(name).copied()
    }

    /// Waits until so many streams are open, at most so long. Whether they are.
    pub(super) fn await_open(&self, streams: usize, limit: Duration) -> Result<bool, ClientError> {
        let waiting = |state: &mut State| state.open < streams && state.fault.is_none();
        let waited = self.more.wait_timeout_while(self.state(), limit, waiting);
        let (state, _) = waited.unwrap_or_else(PoisonError::into_inner);
        match &state.fault {
            Some(fault) => Err(fault.clone()),
            None => Ok(state.open >= streams),
        }
    }

    /// What has come in, as soon as something has, at most after so long. What came before a fault is given first.
    pub(super) fn take(&self, limit: Duration) -> Result<Vec<Heard>, ClientError> {
        let waiting = |state: &mut State| state.queue.is_empty() && state.fault.is_none();
        let waited = self.more.wait_timeout_while(self.state(), limit, waiting);
        let (mut state, _) = waited.unwrap_or_else(PoisonError::into_inner);
        state.bytes = 0;
        let overflowed = matches!(state.fault, Some(ClientError::Overflow { .. }));
        match &state.fault {
            Some(fault) if state.queue.is_empty() || overflowed => Err(fault.clone()),
            _ => Ok(mem::take(&mut state.queue).into()),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::proto::v2::RosMessage;

    fn message(text: &str) -> Message {
        Message::V2(Box::new(RosMessage { value: text.to_owned(), ..RosMessage::default() }))
    }

    fn inbox(messages: usize, bytes: usize) -> Inbox {
        Inbox::new("http://there", Bounds { messages, bytes })
    }

    #[test]
    fn what_is_too_much_is_said() {
        let inbox_of_messages = inbox(2, 1000);
        assert!(inbox_of_messages.put(0, "joint", message("1")) && inbox_of_messages.put(0, "joint", message("2")));
        assert!(!inbox_of_messages.put(1, "zone", message("3")));
        let said = inbox_of_messages.take(Duration::ZERO).unwrap_err().to_string();
        assert!(said.contains("http://there") && said.contains("3 messages") && said.contains("`zone`"), "{said}");
        let inbox_of_bytes = inbox(1000, 10);
        assert!(!inbox_of_bytes.put(0, "joint", message(&"x".repeat(20))));
    }

    #[test]
    fn what_came_before_the_end_is_given_first() {
        let inbox = inbox(9, 999);
        assert!(inbox.put(0, "joint", message("1")));
        let lost = ClientError::Lost { url: "http://there".to_owned(), how: "it ended".to_owned() };
        inbox.fail(lost.clone());
        assert_eq!(inbox.take(Duration::ZERO).map(|all| all.len()), Ok(1));
        assert_eq!(inbox.take(Duration::ZERO), Err(lost.clone()));
        assert_eq!(inbox.await_open(1, Duration::ZERO), Err(lost));
    }

    #[test]
    fn room_that_was_taken_is_free_again() {
        let inbox = inbox(2, 1000);
        for _ in 0..10 {
            assert!(inbox.put(0, "joint", message("1")) && inbox.put(0, "joint", message("2")));
            assert_eq!(inbox.take(Duration::ZERO).map(|all| all.len()), Ok(2));
        }
        assert_eq!(inbox.take(Duration::ZERO), Ok(Vec::new()));
    }
}
