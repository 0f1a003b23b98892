//! When evidence changes without a message: a heap with one place for each piece of evidence, so that nothing is
//! allocated after the start.
//!
//! A message usually puts a timer off, and often. So a time in the heap may be earlier than the true one: it is
//! corrected when it comes to the top, not at each message.

const ABSENT: u32 = u32::MAX;

/// Times of evidence, the least first; of equal ones, that of the evidence with the least number.
#[derive(Debug, Clone)]
pub(super) struct Timers {
    heap: Vec<u32>,
    /// Per evidence: its time, if it is in the heap.
    time: Vec<i64>,
    /// Per evidence: its place in the heap, or [`ABSENT`].
    place: Vec<u32>,
}

impl Timers {
    pub(super) fn new(evidence: usize) -> Self {
        Timers { heap: Vec::with_capacity(evidence), time: vec![i64::MAX; evidence], place: vec![ABSENT; evidence] }
    }

    /// The evidence with the least time.
    pub(super) fn first(&self) -> Option<(u32, i64)> {
        self.heap.first().map(|&evidence| (evidence, self.time[evidence as usize]))
    }

    /// Makes sure that the time of evidence is not later than this one; [`i64::MAX`] is never.
    #[inline]
    pub(super) fn by(&mut self, evidence: u32, time: i64) {
        let at = evidence as usize;
        if time == i64::MAX || (self.place[at] != ABSENT && self.time[at] <= time) {
            return;
        }
        self.bring_forward(evidence, time);
    }

    /// Gives evidence a time before the one that it has, or a first one: seldom, as most messages put timers off.
    #[inline(never)]
    fn bring_forward(&mut self, evidence: u32, time: i64) {
        let at = evidence as usize;
        self.time[at] = time;
        if self.place[at] == ABSENT {
            self.place[at] = place(self.heap.len());
            self.heap.push(evidence);
        }
        self.rise(self.place[at] as usize);
    }

    /// Gives the first evidence a later time; [`i64::MAX`] removes it.
    pub(super) fn put_off_first(&mut self, time: i64) {
        let first = self.heap[0];
        if time == i64::MAX {
            self.heap.swap_remove(0);
            self.place[first as usize] = ABSENT;
            let Some(&moved) = self.heap.first() else { return };
            self.place[moved as usize] = 0;
        } else {
            self.time[first as usize] = time;
        }
        self.sink(0);
    }

    fn before(&self, a: usize, b: usize) -> bool {
        let key = |place: usize| (self.time[self.heap[place] as usize], self.heap[place]);
        key(a) < key(b)
    }

    fn swap(&mut self, a: usize, b: usize) {
        self.heap.swap(a, b);
        self.place[self.heap[a] as usize] = place(a);
        self.place[self.heap[b] as usize] = place(b);
    }

    fn rise(&mut self, mut at: usize) {
        while at > 0 && self.before(at, (at - 1) / 2) {
            self.swap(at, (at - 1) / 2);
            at = (at - 1) / 2;
        }
    }

    fn sink(&mut self, mut at: usize) {
        loop {
            let children = [2 * at + 1, 2 * at + 2].into_iter().filter(|&child| child < self.heap.len());
            let Some(least) = children.reduce(|a, b| if self.before(b, a) { b } else { a }) else { return };
            if !self.before(least, at) {
                return;
            }
            self.swap(at, least);
            at = least;
        }
    }
}

fn place(at: usize) -> u32 {
    u32::try_from(at).expect("a plan has fewer than 2^32 pieces of evidence")
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    proptest! {
        #[test]
        fn the_first_is_the_least_of_all(steps in prop::collection::vec((0..6_u32, 0..20_i64, any::<bool>()), 0..60)) {
            let mut timers = Timers::new(6);
            let mut naive: std::collections::BTreeMap<u32, i64> = std::collections::BTreeMap::new();
            for (evidence, time, put_off) in steps {
                let least = naive.iter().map(|(&evidence, &time)| (time, evidence)).min();
                match least {
                    Some((first, of)) if put_off => {
                        let later = if time == 0 { i64::MAX } else { first + time };
                        timers.put_off_first(later);
                        naive.remove(&of);
                        if later != i64::MAX {
                            naive.insert(of, later);
                        }
                    }
                    _ => {
                        timers.by(evidence, time);
                        let entry = naive.entry(evidence).or_insert(time);
                        *entry = time.min(*entry);
                    }
                }
                let least = naive.iter().map(|(&evidence, &time)| (time, evidence)).min();
                prop_assert_eq!(timers.first(), least.map(|(time, evidence)| (evidence, time)));
            }
        }
    }
}
