//! The automaton of one piece of evidence: what its condition says, for how long it has said so, and how old that is.
//!
//! Its value at an instant is a function of the messages until then, exact to the nanosecond:
//!
//! - Unknown until each of its sources, which are topics or members of groups, had a message.
//! - While any of its sources has been silent for longer than `stale after`, or all of them with `all stale after`:
//!   false or unknown, as declared. A message exactly that old is still fresh.
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
    /// When it is too old.
    pub stale: Option<Stale>,
}

/// When evidence is too old, in nanoseconds.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Stale {
    /// The longest silence.
    pub after: i64,
    /// The value when it has been longer.
    pub is: Truth,
    /// Whether the silence is that of all sources; else that of the one which has been silent longest.
    pub all: bool,
}

impl Rule {
    /// The rule of this evidence. Lengths are rounded to the nearest nanosecond.
    pub fn of(evidence: &Evidence) -> Self {
        let stale = evidence.stale.map(|stale| {
            let is = match stale.is {
                StaleIs::False => Truth::False,
                StaleIs::Unknown => Truth::Unknown,
            };
            Stale { after: SimTime::from_seconds(stale.after).nanos(), is, all: stale.all }
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
    /// Since when the silence that counts lasts; `i64::MAX` before the first message, and while it is stale.
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

    /// Takes what the condition says at a message, and since when the source is silent that has been silent longest:
    /// for evidence with one source, since this message. Timers due until then must have been taken with
    /// [`Automaton::pass`].
    pub fn observe(&mut self, rule: &Rule, at: SimTime, raw: Truth, oldest: SimTime) {
        let at = at.nanos();
        let broken = self.raw != Truth::True || self.is_stale();
        if raw == Truth::True && broken {
            self.since = at;
        }
        self.raw = raw;
        self.heard = true;
        self.last = at;
        self.value = match raw {
            Truth::True => Truth::from(at.saturating_sub(self.since) >= rule.held),
            other => other,
        };
        if oldest.nanos() < at
            && let Some(stale) = rule.stale.filter(|stale| !stale.all)
        {
            self.last = oldest.nanos();
            if at.saturating_sub(self.last) > stale.after {
                (self.last, self.value) = (i64::MAX, stale.is);
            }
        }
    }

    /// Takes that time has passed until this instant without a message.
    pub fn pass(&mut self, rule: &Rule, to: SimTime) {
        if self.last == i64::MAX {
            return;
        }
        let to = to.nanos();
        match rule.stale {
            Some(Stale { after, is, .. }) if to.saturating_sub(self.last) > after => {
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
        let stale = rule.stale.map_or(i64::MAX, |stale| self.last.saturating_add(stale.after).saturating_add(1));
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
    const STALE: Rule = Rule { held: 0, stale: Some(after(200, Truth::False)) };
    const BOTH: Rule = Rule { held: 100, stale: Some(after(60, Truth::Unknown)) };

    const fn after(after: i64, is: Truth) -> Stale {
        Stale { after, is, all: false }
    }

    /// The values at these instants, with nothing between.
    fn values(rule: &Rule, heard: &[(i64, Truth)], at: &[i64]) -> Vec<Truth> {
        let value = |&instant: &i64| {
            let mut automaton = Automaton::new();
            for &(when, raw) in heard.iter().filter(|(when, _)| *when <= instant) {
                while automaton.due(rule) <= when {
                    let due = automaton.due(rule);
                    automaton.pass(rule, T(due));
                }
                automaton.observe(rule, T(when), raw, T(when));
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
        let rule = Rule { held: 61, stale: Some(after(60, Truth::False)) };
        assert_eq!(values(&rule, &[(0, True)], &[60, 61, 1000]), [False, False, False]);
        assert_eq!(values(&rule, &[(0, True), (30, True)], &[60, 61, 90, 91]), [False, True, True, False]);
    }

    #[test]
    fn one_silent_source_makes_it_stale_and_with_all_the_last_one_does() {
        let any = Rule { held: 0, stale: Some(after(60, False)) };
        let all = Rule { held: 0, stale: Some(Stale { all: true, ..after(60, False) }) };
        // One source speaks at 10 only, the other at 10, 50 and 90.
        let value = |rule: &Rule, instant: i64| {
            let mut automaton = Automaton::new();
            for at in [10, 50, 90].into_iter().filter(|at| *at <= instant) {
                while automaton.due(rule) <= at {
                    let due = automaton.due(rule);
                    automaton.pass(rule, T(due));
                }
                automaton.observe(rule, T(at), True, T(10));
            }
            automaton.pass(rule, T(instant));
            automaton.value()
        };
        assert_eq!([10, 70, 71, 90, 200].map(|at| value(&any, at)), [True, True, False, False, False]);
        assert_eq!([10, 70, 71, 90, 150, 151].map(|at| value(&all, at)), [True, True, True, True, True, False]);
    }

    #[test]
    fn unknown_evidence_that_falls_silent_has_the_declared_value() {
        assert_eq!(values(&STALE, &[(0, Unknown)], &[0, 200, 201]), [Unknown, Unknown, False]);
    }
}
