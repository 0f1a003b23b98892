//! What a field of messages does: it changes, jumps, turns, sets out, comes to rest.

use sesame_base::observation::{Entered, Happening, SignalEvent};
use sesame_base::time::SimTime;

use crate::value::{Text, Value};

/// A number that takes at most so many values is a state: each of its changes is an event.
const STATES: usize = 6;
/// How many values of a number are kept.
const SAMPLES: usize = 4096;
/// How many events of a field are kept.
const EVENTS: usize = 400;
/// The longest text that is a state, in bytes.
const STATE_TEXT: usize = 64;

/// A jump is a change from one value to the next by more than this share of the range.
const JUMP: f64 = 0.2;
/// A number moves if it changes from one value to the next by more than this share of the range.
const MOVES: f64 = 1e-4;
/// How many values in a row a number rests before it sets out, and after it came to rest.
const AT_REST: usize = 3;
/// Between these shares of the range on both sides of zero a number has no sign.
const SIGN: f64 = 0.02;
/// A turn counts if the number goes back by more than this share of the range.
const TURN: f64 = 0.1;

/// A field that is followed.
pub(super) struct Field {
    /// The field from the message inwards.
    pub(super) name: String,
    last: Option<State>,
    /// When it changed.
    changes: Evenly<SimTime>,
    /// When it took which value; `None` if that happened too often, or with too long a text.
    entered: Option<Vec<(SimTime, State)>>,
    /// The numbers that it took, as long as they are at most [`STATES`], or one more.
    numbers: Vec<f64>,
    /// The numbers that it took over time.
    samples: Evenly<(SimTime, f64)>,
}

/// A value that is compared with the one before.
#[derive(Debug, Clone, PartialEq)]
enum State {
    Name(Text),
    Truth(bool),
    Number(f64),
}

impl State {
    fn is_short(&self) -> bool {
        match self {
            State::Name(text) => text.len() <= STATE_TEXT,
            State::Truth(_) | State::Number(_) => true,
        }
    }

    fn words(&self) -> String {
        match self {
            State::Name(text) => text.to_string(),
            State::Truth(truth) => truth.to_string(),
            State::Number(number) => number.to_string(),
        }
    }
}

/// An even selection of items: every `stride`th.
struct Evenly<T> {
    kept: Vec<T>,
    most: usize,
    seen: u64,
    stride: u64,
}

impl Field {
    pub(super) fn new(name: String) -> Self {
        let (changes, samples) = (Evenly::at_most(EVENTS), Evenly::at_most(SAMPLES));
        Field { name, last: None, changes, entered: Some(Vec::new()), numbers: Vec::new(), samples }
    }

    /// A message has this value in the field.
    pub(super) fn take(&mut self, now: SimTime, value: &Value) {
        if let Value::Text(text) = value {
            self.take_state(now, State::Name(text.clone()));
        } else if let Value::Bool(truth) = value {
            self.take_state(now, State::Truth(*truth));
        } else if let Some(number) = value.number() {
            self.take_number(now, number);
        }
    }

    /// A message has this number in the field.
    pub(super) fn take_number(&mut self, now: SimTime, number: f64) {
        if !number.is_finite() {
            return;
        }
        self.samples.take((now, number));
        if self.is_state() {
            if !self.numbers.contains(&number) {
                self.numbers.push(number);
            }
            self.take_state(now, State::Number(number));
        }
    }

    /// Whether it has had too few values so far to be a number that moves.
    fn is_state(&self) -> bool {
        self.numbers.len() <= STATES
    }

    fn take_state(&mut self, now: SimTime, state: State) {
        if self.last.as_ref() == Some(&state) {
            return;
        }
        if self.last.is_some() {
            self.changes.take(now);
        }
        let room = |entered: &Vec<(SimTime, State)>| entered.len() < EVENTS && state.is_short();
        self.entered = self.entered.take().filter(room);
        if let Some(entered) = &mut self.entered {
            entered.push((now, state.clone()));
        }
        self.last = Some(state);
    }

    /// Which value it had when, if it took few, at least two.
    pub(super) fn states(&self) -> Option<Vec<Entered>> {
        let entered = self.entered.as_ref().filter(|entered| self.is_state() && entered.len() > 1)?;
        Some(entered.iter().map(|(at, state)| Entered { at: at.seconds(), value: state.words() }).collect())
    }

    /// What happened in it, in order of time.
    pub(super) fn events(&self) -> Vec<SignalEvent> {
        if !self.is_state() {
            return thinned(happenings(&self.samples.kept));
        }
        let changes = self.changes.kept.iter();
        thinned(changes.map(|at| SignalEvent { at: at.seconds(), what: Happening::Changes }).collect())
    }
}

impl<T> Evenly<T> {
    fn at_most(most: usize) -> Self {
        Evenly { kept: Vec::new(), most, seen: 0, stride: 1 }
    }

    /// Takes the next item. When there are too many, every second one of them leaves and the stride doubles.
    fn take(&mut self, item: T) {
        if self.seen.is_multiple_of(self.stride) {
            if self.kept.len() == self.most {
                let mut at = 0;
                self.kept.retain(|_| {
                    at += 1;
                    at % 2 == 1
                });
                self.stride *= 2;
            }
            if self.seen.is_multiple_of(self.stride) {
                self.kept.push(item);
            }
        }
        self.seen += 1;
    }
}

/// An even selection of events, in order of time.
pub(super) fn thinned(mut events: Vec<SignalEvent>) -> Vec<SignalEvent> {
    events.sort_by(|a, b| a.at.total_cmp(&b.at).then(a.what.cmp(&b.what)));
    events.dedup();
    let stride = events.len().div_ceil(EVENTS).max(1);
    events.into_iter().step_by(stride).collect()
}

/// What a number does, by its values in order of time.
fn happenings(samples: &[(SimTime, f64)]) -> Vec<SignalEvent> {
    let values = || samples.iter().map(|&(_, value)| value);
    let (least, most) = (values().fold(f64::INFINITY, f64::min), values().fold(f64::NEG_INFINITY, f64::max));
    let range = most - least;
    if range.is_nan() || range <= 0.0 {
        return Vec::new();
    }
    let mut events = Vec::new();
    let mut happens = |at: SimTime, what| events.push(SignalEvent { at: at.seconds(), what });
    let steps: Vec<f64> = samples.windows(2).map(|pair| (pair[1].1 - pair[0].1).abs()).collect();
    for (step, &(at, _)) in steps.iter().zip(&samples[1..]) {
        if *step > JUMP * range {
            happens(at, Happening::Jumps);
        }
    }
    let moves: Vec<bool> = steps.iter().map(|step| *step > MOVES * range).collect();
    for at in AT_REST..moves.len().saturating_sub(AT_REST) {
        // `moves[at]` is the step from value `at` to the next one.
        if moves[at] && !moves[at - AT_REST..at].contains(&true) {
            happens(samples[at + 1].0, Happening::SetsOut);
        }
        if moves[at - 1] && !moves[at..at + AT_REST].contains(&true) {
            happens(samples[at].0, Happening::Rests);
        }
    }
    let mut sign = 0i8;
    for &(at, value) in samples {
        let now = i8::from(value > SIGN * range) - i8::from(value < -SIGN * range);
        if now != 0 {
            if sign != 0 && now != sign {
                happens(at, Happening::ChangesSign);
            }
            sign = now;
        }
    }
    let (mut rising, mut extreme) = (None, samples[0]);
    for &(at, value) in samples {
        let goes_on = match rising {
            Some(true) => value > extreme.1,
            Some(false) => value < extreme.1,
            None => false,
        };
        if goes_on {
            extreme = (at, value);
        } else if (value - extreme.1).abs() > TURN * range {
            if rising.is_some() {
                happens(extreme.0, Happening::Turns);
            }
            rising = Some(value > extreme.1);
            extreme = (at, value);
        }
    }
    events
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The events of a field that takes these values, one each tenth of a second.
    fn events(values: impl IntoIterator<Item = f64>) -> Vec<(f64, Happening)> {
        let mut field = Field::new(String::new());
        for (tenth, value) in (0i64..).zip(values) {
            field.take(SimTime::from_nanos(tenth * 100_000_000), &Value::Real(value));
        }
        field.events().iter().map(|event| (event.at, event.what)).collect()
    }

    #[test]
    fn a_number_of_few_values_changes() {
        assert_eq!(events([0.0, 0.0, 1.0, 1.0, 0.0]), [(0.2, Happening::Changes), (0.4, Happening::Changes)]);
        assert_eq!(events([5.0; 10]), []);
    }

    #[test]
    fn a_number_that_moves_turns_and_changes_its_sign() {
        let triangle = (0..40).map(|at: i32| f64::from(10 - (at - 20).abs()));
        assert_eq!(
            events(triangle),
            [(1.1, Happening::ChangesSign), (2.0, Happening::Turns), (3.1, Happening::ChangesSign),]
        );
    }

    #[test]
    fn a_number_jumps() {
        let ramp = (0..40).map(|at: i32| 100.0 + f64::from(at) + if at >= 25 { 80.0 } else { 0.0 });
        assert_eq!(events(ramp), [(2.5, Happening::Jumps)]);
    }

    #[test]
    fn a_number_sets_out_and_comes_to_rest() {
        let moved = (0..60).map(|at: i32| 5.0 + f64::from(at.clamp(20, 40)));
        assert_eq!(events(moved), [(2.1, Happening::SetsOut), (4.0, Happening::Rests)]);
    }

    #[test]
    fn what_takes_few_values_has_states_and_what_moves_or_never_changes_has_none() {
        let states = |values: &[Value]| {
            let mut field = Field::new(String::new());
            for (second, value) in (0..).zip(values) {
                field.take(SimTime::from_nanos(second * 1_000_000_000), value);
            }
            field
                .states()
                .map(|states| states.into_iter().map(|entered| (entered.at, entered.value)).collect::<Vec<_>>())
        };
        let entered = |states: &[(f64, &str)]| Some(states.iter().map(|&(at, value)| (at, value.to_owned())).collect());
        let text = |text: &str| Value::Text(text.into());
        assert_eq!(
            states(&[text("IDLE"), text("IDLE"), text("CHARGE"), text("IDLE")]),
            entered(&[(0.0, "IDLE"), (2.0, "CHARGE"), (3.0, "IDLE")])
        );
        assert_eq!(states(&[false, true, true].map(Value::Bool)), entered(&[(0.0, "false"), (1.0, "true")]));
        assert_eq!(states(&[1, 1, 2].map(Value::Int)), entered(&[(0.0, "1"), (2.0, "2")]));
        assert_eq!(states(&[0.5, 0.5].map(Value::Real)), None, "it says nothing about when");
        assert_eq!(states(&[0.0, 1.0, 2.0, 3.0, 4.0, 5.0, 6.0].map(Value::Real)), None, "too many values");
        assert_eq!(states(&[text("a"), text(&"long".repeat(20)), text("a")]), None);
        let often: Vec<Value> = (0..1000).map(|at| Value::Bool(at % 2 == 0)).collect();
        assert_eq!(states(&often), None, "too many changes to tell them all");
    }

    #[test]
    fn names_change_however_many_there_are() {
        let mut field = Field::new("mode".to_owned());
        for at in 0..20 {
            field
                .take(SimTime::from_nanos(at * 1_000_000_000), &Value::Text(format!("job {}", at / 2).as_str().into()));
        }
        let found: Vec<f64> = field.events().iter().map(|event| event.at).collect();
        assert_eq!(found, (1..10).map(|at| f64::from(2 * at)).collect::<Vec<_>>());
    }
}
