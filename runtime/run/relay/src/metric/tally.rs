//! What is aggregated of the values of a formula.

use sesame_base::time::SimTime;
use sesame_plan::{Aggregate, Formula};

use crate::metric::Context;
use crate::metric::expression::{Moment, greatest, holds, least, number};
use crate::metric::held::HeldInputs;

/// Aggregates the values as they are now, once all are known. Returns the number that counted, if numbers do.
pub(super) fn step(formula: &Formula, held: &HeldInputs, tally: &mut Tally, context: &mut Context) -> Option<f64> {
    let now = context.now;
    let Some(inputs) = held.values() else {
        // While a value is not finite, it is not known what holds.
        tally.stop(now);
        return None;
    };
    let moment = Moment::new(inputs, context.given());
    let counted = tally.take(formula, &moment, now);
    match (moment.undefined(), &counted) {
        (Some(undefined), _) => context.note(format!("{undefined} at {now}")),
        (None, Err(Refused(value))) => context.note(format!("refused the value {value} at {now}")),
        (None, Ok(_)) => {}
    }
    counted.ok().flatten()
}

/// A value that is not finite.
struct Refused(f64);

/// The aggregate of a formula's values.
#[derive(Debug, Clone, Default)]
pub(super) struct Tally {
    /// `None` before the first value. For a duration it says only whether there was one, see [`Tally::held_until`].
    pub(super) value: Option<f64>,
    /// For a mean.
    messages: f64,
    sum: f64,
    /// When the last message counted.
    counted: Option<SimTime>,
    /// For a duration: how long it had held when it last began or ceased to hold, and since when it holds.
    held: SimTime,
    holds_since: Option<SimTime>,
}

impl Tally {
    /// Aggregates the values of a moment. Returns the number that counted, if numbers do.
    fn take(&mut self, formula: &Formula, moment: &Moment<'_>, now: SimTime) -> Result<Option<f64>, Refused> {
        let due = |tally: &mut Tally| formula.every.is_none_or(|period| tally.due(now, SimTime::from_seconds(period)));
        let counts = formula.when.as_ref().is_none_or(|when| holds(when, moment));
        let of = match &formula.aggregate {
            Aggregate::Duration { of } => {
                self.hold(now, counts && holds(of, moment));
                return Ok(None);
            }
            Aggregate::Count { of } => {
                let before = *self.value.get_or_insert(0.0);
                if counts && holds(of, moment) && due(self) {
                    self.value = Some(before + 1.0);
                }
                return Ok(None);
            }
            Aggregate::Last { of } | Aggregate::Min { of } | Aggregate::Max { of } | Aggregate::Mean { of } => of,
        };
        if !counts {
            return Ok(None);
        }
        let value = number(of, moment);
        if !value.is_finite() {
            return Err(Refused(value));
        }
        if !due(self) {
            return Ok(None);
        }
        self.messages += 1.0;
        self.sum += value;
        self.value = Some(match (&formula.aggregate, self.value) {
            (Aggregate::Min { .. }, Some(before)) => least(before, value),
            (Aggregate::Max { .. }, Some(before)) => greatest(before, value),
            (Aggregate::Mean { .. }, _) => self.sum / self.messages,
            _ => value,
        });
        Ok(Some(value))
    }

    /// Whether a message at this time counts.
    fn due(&mut self, now: SimTime, period: SimTime) -> bool {
        let due = self.counted.is_none_or(|counted| now - counted >= period);
        if due {
            self.counted = Some(now);
        }
        due
    }

    /// Sets whether it holds from now on.
    fn hold(&mut self, now: SimTime, holds: bool) {
        self.value = Some(0.0);
        match (self.holds_since, holds) {
            (Some(_), false) => self.stop(now),
            (None, true) => self.holds_since = Some(now),
            (Some(_), true) | (None, false) => {}
        }
    }

    /// It holds no longer.
    pub(super) fn stop(&mut self, now: SimTime) {
        self.held = self.held_until(now);
        self.holds_since = None;
    }

    /// Whether it holds now.
    pub(super) fn holds(&self) -> bool {
        self.holds_since.is_some()
    }

    /// For how long it has held.
    pub(super) fn held_until(&self, now: SimTime) -> SimTime {
        self.holds_since.map_or(self.held, |since| self.held + (now - since))
    }
}
