//! The numbers of a test that can be made smaller, step by step.
//!
//! Every dial turns one way only: a window gets shorter, a range narrower or nearer to its mild end, never the reverse.
//! So whatever order dials are turned in, an end is reached.

use sesame_plan::{Activation, Choice, Test};

use crate::shrink::space::{Mild, Space};

/// The share of a step below which a difference is but rounding.
const ROUNDING: f64 = 1e-9;

/// One number of one operation of a test.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Dial {
    /// The operation's position in the test.
    place: usize,
    part: Part,
}

/// Which number.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Part {
    /// The window starts later.
    Start,
    /// The window ends earlier.
    End,
    /// An activation by condition is shorter.
    Length,
    /// There are fewer activations by condition.
    Times,
    /// The upper end of a sub-range goes down.
    High(usize),
    /// The lower end of a sub-range goes up.
    Low(usize),
    /// A sub-range that does not hold its mild end goes towards it as a whole.
    Whole(usize),
    /// A value goes towards its mild end.
    Value(usize),
    /// A coordinate of a point goes towards its mild end.
    Axis(usize, usize),
}

/// The dials for when operations are active.
pub(super) fn times(test: &Test) -> Vec<Dial> {
    let parts = |activation: &Activation| match activation {
        Activation::Time { .. } => vec![Part::Start, Part::End],
        Activation::Condition { .. } => vec![Part::Times],
        Activation::ConditionFor { .. } => vec![Part::Times, Part::Length],
        Activation::Offline => Vec::new(),
    };
    let dials = test.operations.iter().enumerate().flat_map(|(place, used)| {
        let parts = parts(&used.activation).into_iter();
        parts.map(move |part| Dial { place, part })
    });
    dials.collect()
}

/// The dials for how strong operations are.
pub(super) fn parameters(test: &Test) -> Vec<Dial> {
    let parts = |(at, choice): (usize, &Choice)| match choice {
        Choice::Value { .. } => vec![Part::Value(at)],
        Choice::Range { .. } => vec![Part::High(at), Part::Low(at), Part::Whole(at)],
        Choice::Point { .. } => (0..3).map(|axis| Part::Axis(at, axis)).collect(),
        Choice::Text { .. } => Vec::new(),
    };
    let dials = test.operations.iter().enumerate().flat_map(|(place, used)| {
        let parts: Vec<Part> = used.parameters.iter().enumerate().flat_map(parts).collect();
        parts.into_iter().map(move |part| Dial { place, part })
    });
    dials.collect()
}

impl Dial {
    /// How many steps there are to the smallest that is permitted; 0 there.
    pub(super) fn steps(self, space: &Space, test: &Test) -> u32 {
        let Some((from, to, step)) = self.stretch(space, test) else { return 0 };
        count((to - from).abs() / step)
    }

    /// The test with the dial turned by so many steps, from 1 to [`Dial::steps`]; the last one is shorter where they do
    /// not come out even.
    pub(super) fn turned(self, space: &Space, test: &Test, steps: u32) -> Test {
        let mut turned = test.clone();
        let Some((from, to, step)) = self.stretch(space, test) else { return turned };
        let way = f64::from(steps) * step;
        let number = if steps >= self.steps(space, test) {
            to
        } else if from < to {
            (from + way).min(to)
        } else {
            (from - way).max(to)
        };
        self.set(&mut turned, number);
        turned
    }

    /// From where to where the number can go, and in which steps; `None` where it cannot go anywhere.
    fn stretch(self, space: &Space, test: &Test) -> Option<(f64, f64, f64)> {
        let used = &test.operations[self.place];
        let operation = used.operation;
        let number = |at: usize, axis: Option<usize>| -> Option<Mild> {
            match axis {
                None => space.number(operation, at),
                Some(axis) => space.point(operation, at).map(|axes| axes[axis]),
            }
        };
        let (from, to, step) = match (self.part, &used.activation) {
            (Part::Start, &Activation::Time { start, end }) => {
                (start, (end - space.shortest(operation)).max(start), space.time_step(operation))
            }
            (Part::End, &Activation::Time { start, end }) => {
                (end, (start + space.shortest(operation)).min(end), space.time_step(operation))
            }
            (Part::Length, &Activation::ConditionFor { length, .. }) => {
                (length, space.shortest_length(operation).min(length), space.time_step(operation))
            }
            (Part::Times, Activation::Condition { times, .. } | Activation::ConditionFor { times, .. }) => {
                (f64::from(*times), 1.0, 1.0)
            }
            (Part::High(at), _) => {
                let (Choice::Range { low, high }, mild) = (&used.parameters[at], number(at, None)?) else {
                    return None;
                };
                (*high, mild.end.map_or(*low, |end| end.max(*low)).min(*high), mild.step)
            }
            (Part::Low(at), _) => {
                let (Choice::Range { low, high }, mild) = (&used.parameters[at], number(at, None)?) else {
                    return None;
                };
                (*low, mild.end.map_or(*high, |end| end.min(*high)).max(*low), mild.step)
            }
            (Part::Whole(at), _) => {
                let (&Choice::Range { low, high }, mild) = (&used.parameters[at], number(at, None)?) else {
                    return None;
                };
                let end = mild.end?;
                // The end of the sub-range that is nearer to the mild one goes there, and takes the other along.
                let nearer = if end < low { low } else { high };
                (nearer, if (low..=high).contains(&end) { nearer } else { end }, mild.step)
            }
            (Part::Value(at), _) => {
                let (&Choice::Value { value }, mild) = (&used.parameters[at], number(at, None)?) else { return None };
                (value, mild.end?, mild.step)
            }
            (Part::Axis(at, axis), _) => {
                let (Choice::Point { point }, mild) = (&used.parameters[at], number(at, Some(axis))?) else {
                    return None;
                };
                (point[axis], mild.end?, mild.step)
            }
            _ => return None,
        };
        // A step is at least what a number of this size can move by: a range that a campaign permits may be tiny beside
        // the numbers in it, and a step that leads nowhere would be taken for ever.
        let mut step = step;
        while step > 0.0 && (if from < to { from + step } else { from - step }) == from {
            step *= 2.0;
        }
        // What is left by rounding is not a way to go.
        (step > 0.0 && (to - from).abs() > step * ROUNDING).then_some((from, to, step))
    }

    fn set(self, test: &mut Test, number: f64) {
        let used = &mut test.operations[self.place];
        match (self.part, &mut used.activation) {
            (Part::Start, Activation::Time { start, .. }) => *start = number,
            (Part::End, Activation::Time { end, .. }) => *end = number,
            (Part::Length, Activation::ConditionFor { length, .. }) => *length = number,
            (Part::Times, Activation::Condition { times, .. } | Activation::ConditionFor { times, .. }) => {
                *times = count(number);
            }
            (Part::High(at), _) => {
                if let Choice::Range { high, .. } = &mut used.parameters[at] {
                    *high = number;
                }
            }
            (Part::Low(at), _) => {
                if let Choice::Range { low, .. } = &mut used.parameters[at] {
                    *low = number;
                }
            }
            (Part::Whole(at), _) => {
                if let Choice::Range { low, high } = &mut used.parameters[at] {
                    let width = *high - *low;
                    // Rounding must carry neither end away from the mild one.
                    (*low, *high) = if number < *low {
                        (number, (number + width).min(*high))
                    } else {
                        ((number - width).max(*low), number)
                    };
                }
            }
            (Part::Value(at), _) => {
                if let Choice::Value { value } = &mut used.parameters[at] {
                    *value = number;
                }
            }
            (Part::Axis(at, axis), _) => {
                if let Choice::Point { point } = &mut used.parameters[at] {
                    point[axis] = number;
                }
            }
            (Part::Start | Part::End | Part::Length | Part::Times, _) => {}
        }
    }
}

/// Steps of a stretch, the last one perhaps shorter. What is but rounding is no step of its own.
#[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "a small count, clamped")]
fn count(steps: f64) -> u32 {
    libm::ceil(steps - ROUNDING).clamp(1.0, f64::from(u32::MAX)) as u32
}
