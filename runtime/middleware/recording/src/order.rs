//! Messages in order of time. Recorders write them nearly so, and a few of the last ones are kept until none that is
//! earlier can be expected.

use std::cmp::Reverse;
use std::collections::BinaryHeap;

/// How many bytes of messages are kept.
const KEPT: usize = 1 << 26;

/// What a message needs besides its content.
const EACH: usize = 64;

/// A message that waits.
#[derive(Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) struct Waiting {
    pub(crate) time: u64,
    /// Where it is in the file.
    at: u64,
    pub(crate) channel: u32,
    pub(crate) data: Vec<u8>,
}

/// Messages that wait for earlier ones. Those of one time come in the order of the file.
#[derive(Debug, Default)]
pub(crate) struct Order {
    waiting: BinaryHeap<Reverse<Waiting>>,
    came: u64,
    size: usize,
}

impl Order {
    /// A message comes. What is returned is the next one, if there are enough.
    pub(crate) fn add(&mut self, time: u64, channel: u32, data: &[u8]) {
        self.size += data.len() + EACH;
        self.waiting.push(Reverse(Waiting { time, at: self.came, channel, data: data.to_vec() }));
        self.came += 1;
    }

    /// The next message, if more wait than are kept.
    pub(crate) fn due(&mut self) -> Option<Waiting> {
        if self.size > KEPT { self.next() } else { None }
    }

    /// The next message.
    pub(crate) fn next(&mut self) -> Option<Waiting> {
        let Reverse(first) = self.waiting.pop()?;
        self.size -= first.data.len() + EACH;
        Some(first)
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    proptest! {
        #[test]
        fn messages_come_in_order_of_time_and_then_of_the_file(times in proptest::collection::vec(0u64..20, 0..50)) {
            let mut order = Order::default();
            for (at, time) in (0u32..).zip(&times) {
                order.add(*time, at, &[]);
                prop_assert!(order.due().is_none());
            }
            let mut expected: Vec<(u64, u32)> = times.iter().copied().zip(0..).collect();
            expected.sort_unstable();
            let came: Vec<(u64, u32)> = std::iter::from_fn(|| order.next()).map(|next| (next.time, next.channel)).collect();
            prop_assert_eq!(came, expected);
            prop_assert_eq!(order.size, 0);
        }

        #[test]
        fn memory_is_bounded(sizes in proptest::collection::vec(1usize..(1 << 24), 1..20)) {
            let mut order = Order::default();
            let largest = vec![0; 1 << 24];
            for (time, size) in (0..).zip(sizes) {
                order.add(time, 0, &largest[..size]);
                while order.due().is_some() {}
                prop_assert!(order.size <= KEPT);
            }
        }
    }
}
