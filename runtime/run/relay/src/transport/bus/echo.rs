//! Messages of the runner that come back from a server: by them the way through it is measured.
//!
//! A message that the runner relays takes the way through the server once more than it would without the relay: so what
//! the relay adds to it is the time from its arrival at the runner until the runner, as a subscriber, has it back.

use std::collections::VecDeque;
use std::time::{Duration, Instant};

/// How many messages may be on their way; the oldest are forgotten.
const ON_THEIR_WAY: usize = 1000;

/// Messages that were published and are awaited.
#[derive(Debug, Default)]
pub struct Echoes {
    awaited: VecDeque<Published>,
}

#[derive(Debug)]
struct Published {
    line: usize,
    sink: usize,
    content: u64,
    /// When it had come to the runner; `None` if an operation delayed or made it.
    arrived: Option<Instant>,
}

impl Echoes {
    /// A message was published on a sink of a line. `content` is a hash of what it says.
    pub fn published(&mut self, line: usize, sink: usize, content: u64) {
        if self.awaited.len() == ON_THEIR_WAY {
            self.awaited.pop_front();
        }
        self.awaited.push_back(Published { line, sink, content, arrived: None });
    }

    /// What was published last on this sink had come to the runner at this moment.
    pub fn came(&mut self, line: usize, sink: usize, arrived: Instant) {
        if let Some(last) = self.awaited.iter_mut().rev().find(|last| (last.line, last.sink) == (line, sink)) {
            last.arrived = Some(arrived);
        }
    }

    /// A message was heard on a sink: how long ago it had come to the runner, if it is one of the runner's that no
    /// operation delayed. Those published on this sink before it were lost, since servers keep their order.
    pub fn heard(&mut self, line: usize, sink: usize, content: u64, at: Instant) -> Option<Duration> {
        let of_sink = |published: &Published| (published.line, published.sink) == (line, sink);
        let found = self.awaited.iter().position(|published| of_sink(published) && published.content == content)?;
        let arrived = self.awaited[found].arrived;
        let mut position = 0;
        self.awaited.retain(|published| {
            position += 1;
            !of_sink(published) || position > found + 1
        });
        arrived.map(|arrived| at.saturating_duration_since(arrived))
    }

    /// Forgets all, as after a lost connection.
    pub fn clear(&mut self) {
        self.awaited.clear();
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const MILLISECOND: Duration = Duration::from_millis(1);

    #[test]
    fn what_comes_back_is_known_by_its_content() {
        let mut echoes = Echoes::default();
        let begin = Instant::now();
        echoes.published(0, 0, 7);
        echoes.came(0, 0, begin);
        assert_eq!(echoes.heard(0, 0, 8, begin), None, "it is of somebody else");
        assert_eq!(echoes.heard(0, 1, 7, begin), None);
        assert_eq!(echoes.heard(0, 0, 7, begin + 3 * MILLISECOND), Some(3 * MILLISECOND));
        assert_eq!(echoes.heard(0, 0, 7, begin + 4 * MILLISECOND), None, "it came back once");
    }

    #[test]
    fn lost_messages_do_not_make_later_ones_late_and_delayed_ones_are_not_measured() {
        let mut echoes = Echoes::default();
        let begin = Instant::now();
        for number in 0..3u32 {
            echoes.published(0, 0, u64::from(number));
            echoes.came(0, 0, begin + number * 10 * MILLISECOND);
        }
        // The first two are lost.
        assert_eq!(echoes.heard(0, 0, 2, begin + 21 * MILLISECOND), Some(MILLISECOND));
        assert_eq!(echoes.heard(0, 0, 0, begin + 30 * MILLISECOND), None);
        echoes.published(0, 0, 3);
        assert_eq!(echoes.heard(0, 0, 3, begin + 40 * MILLISECOND), None);
    }

    #[test]
    fn what_never_comes_back_takes_no_more_memory() {
        let mut echoes = Echoes::default();
        for number in 0..5000 {
            echoes.published(0, 0, number);
        }
        assert_eq!(echoes.awaited.len(), ON_THEIR_WAY);
    }
}
