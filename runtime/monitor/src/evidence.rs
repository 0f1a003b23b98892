//! The automaton of one piece of evidence: what its condition says, for how long it has said so, and how old that is.
//!
//! Its value at an instant is a function of the messages until then, exact to the nanosecond:
//!
//! - Unknown before the first message of any of its topics.
//! - While its topics have been silent for longer than `stale after`: false or unknown, as declared. A message exactly
//!   that old is still fresh.
//! - Otherwise the truth of its condition at the last message. If that is true and must be `held`, it is false until
//!   the condition has been true that long without a break, and true from then on. A condition that is false or
//!   unknown is a break, and so is silence that made it stale.

use sesame_base::time::SimTime;
use sesame_plan::{Evidence, StaleIs};

use crate::truth::Truth;

/// How evidence follows from its condition: `held` and `stale after`, in nanoseconds.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Rule {
    /// How long the condition must have been true; 0 is at once.
    pub held: i64,
    /// The longest silence, and the value when it has been longer.
    pub stale: Option<(i64, Truth)>,
}

impl Rule {
    /// The rule of this evidence. Lengths are rounded to the nearest nanosecond.
    pub fn of(evidence: &Evidence) -> Self {
        let stale = evidence.stale.map(|stale| {
            let is = match stale.is {
                StaleIs::False => Truth::False,
                StaleIs::Unknown => Truth::Unknown,
            };
            (SimTime::from_seconds(stale.after).nanos(), is)
        });
        Rule { held: SimTime::from_seconds(evidence.held).nanos(), stale }
    }
}

/// What is known of one piece of evidence at an instant.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Automaton {
    /// What the condition said at the last message; unknown before.
    raw: Truth,
    /// The value.
    value: Truth,
    /// When the condition became true without a break since; of meaning only while it is true and fresh.
    since: i64,
    /// When the topics became silent; `i64::MAX` before the first message, and while it is stale.
    last: i64,
    /// Whether there was a message.
    heard: bool,
}

impl Automaton {
    /// Before the first message.
    pub fn new() -> Self {
        Automaton { last: i64::MAX, ..Automaton::default() }
    }

    /// Its value at the latest instant that it was told of.
    pub fn value(&self) -> Truth {
        self.value
    }

    /// What the condition said at the last message, whatever its age; unknown before the first.
    pub fn raw(&self) -> Truth {
        self.raw
    }

    /// Takes what the condition says at a message. Timers due until then must have been taken with
    /// [`Automaton::pass`].
    pub fn observe(&mut self, rule: &Rule, at: SimTime, raw: Truth) {
        let at = at.nanos();
        let broken = self.raw != Truth::True || self.is_stale();
        if raw == Truth::True && broken {
            self.since = at;
        }
        self.raw = raw;
        self.last = at;
        self.heard = true;
        self.value = match raw {
            Truth::True => Truth::from(at.saturating_sub(self.since) >= rule.held),
            other => other,
        };
    }

    /// Takes that time has passed until this instant without a message.
    pub fn pass(&mut self, rule: &Rule, to: SimTime) {
        if self.last == i64::MAX {
            return;
        }
        let to = to.nanos();
        match rule.stale {
            Some((after, is)) if to.saturating_sub(self.last) > after => {
                self.last = i64::MAX;
                self.value = is;
            }
            _ if self.raw == Truth::True && to.saturating_sub(self.since) >= rule.held => self.value = Truth::True,
            _ => {}
        }
    }

    /// The next instant at which its value changes without a message, if nothing is heard until then: it may be stale
    /// or held by then. (A change to the same value counts.) [`i64::MAX`] for never.
    pub fn due(&self, rule: &Rule) -> i64 {
        if self.last == i64::MAX {
            return i64::MAX;
        }
        let stale = rule.stale.map_or(i64::MAX, |(after, _)| self.last.saturating_add(after).saturating_add(1));
        if self.raw == Truth::True && self.value != Truth::True {
            stale.min(self.since.saturating_add(rule.held))
        } else {
            stale
        }
    }

    fn is_stale(&self) -> bool {
        self.heard && self.last == i64::MAX
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const T: fn(i64) -> SimTime = SimTime::from_nanos;
    const HELD: Rule = Rule { held: 100, stale: None };
    const STALE: Rule = Rule { held: 0, stale: Some((200, Truth::False)) };
    const BOTH: Rule = Rule { held: 100, stale: Some((60, Truth::Unknown)) };

    /// The values at these instants, with nothing between.
    fn values(rule: &Rule, heard: &[(i64, Truth)], at: &[i64]) -> Vec<Truth> {
        let value = |&instant: &i64| {
            let mut automaton = Automaton::new();
            for &(when, raw) in heard.iter().filter(|(when, _)| *when <= instant) {
                while automaton.due(rule) <= when {
                    let due = automaton.due(rule);
                    automaton.pass(rule, T(due));
                }
                automaton.observe(rule, T(when), raw);
            }
            while automaton.due(rule) <= instant {
                let due = automaton.due(rule);
                automaton.pass(rule, T(due));
            }
            automaton.value()
        };
        at.iter().map(value).collect()
    }

    use Truth::{False, True, Unknown};

    #[test]
    fn it_is_unknown_until_the_first_message() {
        assert_eq!(values(&STALE, &[(500, True)], &[0, 499, 500]), [Unknown, Unknown, True]);
    }

    #[test]
    fn it_holds_from_the_nanosecond_at_which_its_condition_was_held() {
        assert_eq!(values(&HELD, &[(7, True), (50, True)], &[7, 106, 107]), [False, False, True]);
    }

    #[test]
    fn a_break_begins_a_hold_anew() {
        let heard = [(0, True), (50, False), (60, True), (159, Unknown), (160, True)];
        assert_eq!(values(&HELD, &heard, &[50, 100, 158, 159, 259, 260]), [False, False, False, Unknown, False, True]);
    }

    #[test]
    fn it_is_stale_a_nanosecond_after_its_age() {
        assert_eq!(values(&STALE, &[(10, True)], &[10, 210, 211]), [True, True, False]);
        assert_eq!(values(&STALE, &[(10, True), (210, True), (411, True)], &[211, 410, 411]), [True, True, True]);
    }

    #[test]
    fn silence_breaks_a_hold() {
        let heard = [(0, True), (60, True), (121, True), (160, True), (220, True), (280, True)];
        assert_eq!(
            values(&BOTH, &heard, &[100, 120, 121, 220, 221, 340, 341]),
            [True, True, False, False, True, True, Unknown]
        );
    }

    #[test]
    fn what_is_stale_and_held_at_one_instant_is_stale() {
        let rule = Rule { held: 61, stale: Some((60, Truth::False)) };
        assert_eq!(values(&rule, &[(0, True)], &[60, 61, 1000]), [False, False, False]);
        assert_eq!(values(&rule, &[(0, True), (30, True)], &[60, 61, 90, 91]), [False, True, True, False]);
    }

    #[test]
    fn unknown_evidence_that_falls_silent_has_the_declared_value() {
        assert_eq!(values(&STALE, &[(0, Unknown)], &[0, 200, 201]), [Unknown, Unknown, False]);
    }
}
