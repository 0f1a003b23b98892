//! When messages came on a wire.

use sesame_base::observation::{Happening, RARE, SignalEvent};
use sesame_base::time::SimTime;
use sesame_plan::Span;

/// How many stretches are kept. A wire with more messages joins those that came regularly.
const KEPT: usize = 2000;
/// A silence is long if it is longer than so many usual ones.
const LONG: i64 = 3;

/// Stretches of time in which messages came one soon after the other.
pub(super) struct Stretches {
    spans: Vec<(SimTime, SimTime)>,
    /// Messages no further apart than this, in nanoseconds, are in one stretch.
    apart: i64,
    /// The usual silence between two messages, in nanoseconds, once stretches have been joined.
    usual: Option<i64>,
}

impl Stretches {
    pub(super) fn new() -> Self {
        Stretches { spans: Vec::new(), apart: 0, usual: None }
    }

    pub(super) fn heard(&mut self, now: SimTime) {
        match self.spans.last_mut() {
            Some((_, last)) if (now - *last).nanos() <= self.apart => *last = now,
            _ => self.spans.push((now, now)),
        }
        if self.spans.len() > KEPT {
            self.join();
        }
    }

    /// Joins stretches until at most half as many are left as are kept.
    fn join(&mut self) {
        let usual = self.median_silence();
        self.usual.get_or_insert(usual);
        self.apart = (LONG * usual).max(2 * self.apart);
        while self.spans.len() > KEPT / 2 {
            let apart = self.apart;
            let mut joined: Vec<(SimTime, SimTime)> = Vec::with_capacity(KEPT + 1);
            for &(start, end) in &self.spans {
                match joined.last_mut() {
                    Some((_, last)) if (start - *last).nanos() <= apart => *last = end,
                    _ => joined.push((start, end)),
                }
            }
            self.spans = joined;
            self.apart *= 2;
        }
        self.apart /= 2;
    }

    /// The lower median of the times between stretches, in nanoseconds; 0 if there is none.
    fn median_silence(&self) -> i64 {
        let mut gaps: Vec<i64> = self.spans.windows(2).map(|pair| (pair[1].0 - pair[0].1).nanos()).collect();
        gaps.sort_unstable();
        gaps.get(gaps.len().saturating_sub(1) / 2).copied().unwrap_or(0)
    }

    /// All stretches, in order.
    pub(super) fn spans(&self) -> Vec<Span> {
        self.spans.iter().map(|(start, end)| Span { start: start.seconds(), end: end.seconds() }).collect()
    }

    /// Each message, where there are few; else the begins and ends of long silences in a run that ended at a time.
    pub(super) fn events(&self, end: SimTime) -> Vec<SignalEvent> {
        let event = |at: SimTime, what| SignalEvent { at: at.seconds(), what };
        if self.usual.is_none() && self.spans.len() <= RARE {
            return self.spans.iter().map(|&(at, _)| event(at, Happening::Message)).collect();
        }
        let long = LONG * self.usual.unwrap_or_else(|| self.median_silence());
        let mut events = Vec::new();
        let mut last = SimTime::ZERO;
        for &(start, end) in &self.spans {
            if (start - last).nanos() > long {
                if last > SimTime::ZERO {
                    events.push(event(last, Happening::Ends));
                }
                events.push(event(start, Happening::Begins));
            }
            last = end;
        }
        if (end - last).nanos() > long {
            events.push(event(last, Happening::Ends));
        }
        super::happenings::thinned(events)
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    proptest! {
        /// Beside the list of all messages.
        #[test]
        fn every_message_lies_in_a_stretch_and_stretches_of_few_messages_are_these(
            gaps in prop::collection::vec(0i64..50, 1..300), times in 1usize..20,
        ) {
            let mut stretches = Stretches::new();
            let mut all = Vec::new();
            let mut now = 0;
            for _ in 0..times {
                for gap in &gaps {
                    now += gap;
                    all.push(now);
                    stretches.heard(SimTime::from_nanos(now));
                }
            }
            prop_assert!(stretches.spans.len() <= KEPT);
            prop_assert!(stretches.spans.windows(2).all(|pair| pair[0].1 < pair[1].0));
            let inside = |&at: &i64| {
                stretches.spans.iter().any(|(start, end)| (start.nanos()..=end.nanos()).contains(&at))
            };
            prop_assert!(all.iter().all(inside));
            all.dedup();
            if all.len() <= KEPT {
                let each: Vec<i64> = stretches.spans.iter().map(|(start, _)| start.nanos()).collect();
                prop_assert_eq!(each, all);
            }
        }
    }

    #[test]
    fn a_long_silence_has_a_begin_and_an_end() {
        let mut stretches = Stretches::new();
        let second = |tenths: i64| SimTime::from_nanos(tenths * 100_000_000);
        (1..=20).chain(60..=80).for_each(|tenths| stretches.heard(second(tenths)));
        let found: Vec<(f64, Happening)> = stretches.events(second(100)).iter().map(|e| (e.at, e.what)).collect();
        assert_eq!(found, [(2.0, Happening::Ends), (6.0, Happening::Begins), (8.0, Happening::Ends)]);
    }
}
