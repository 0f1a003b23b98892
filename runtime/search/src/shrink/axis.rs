//! The numbers of a test that can be shrunk, step by step.
//!
//! Along an axis a test only shrinks: a window gets shorter, a range narrower or nearer to its neutral value, never the
//! reverse. So shrinking ends, in any order of axes.
//!
//! At last, numbers may go to round ones: multiples of the greatest power of ten that is no more than a step, which is
//! the third significant digit of what is permitted. People read them in reviews.

use sesame_plan::{Activation, Choice, Test};

use crate::shrink::space::{NeutralValue, ShrinkSpace};

/// The share of a step below which a difference is but rounding.
const ROUNDING: f64 = 1e-9;

/// One number of one operation of a test.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct ShrinkAxis {
    /// The operation's position in the test.
    place: usize,
    component: Component,
}

/// Which number.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Component {
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
    /// A sub-range that does not hold its neutral end goes towards it as a whole.
    Whole(usize),
    /// A value goes towards its neutral end.
    Value(usize),
    /// A coordinate of a point goes towards its neutral end.
    Coordinate(usize, usize),
}

/// The axes for when operations are active.
pub(super) fn times(test: &Test) -> Vec<ShrinkAxis> {
    let components = |activation: &Activation| match activation {
        Activation::Time { .. } => vec![Component::Start, Component::End],
        Activation::Condition { .. } => vec![Component::Times],
        Activation::ConditionFor { .. } => vec![Component::Times, Component::Length],
        Activation::Offline => Vec::new(),
    };
    let axes = test.operations.iter().enumerate().flat_map(|(place, used)| {
        let components = components(&used.activation).into_iter();
        components.map(move |component| ShrinkAxis { place, component })
    });
    axes.collect()
}

/// The axes for how strong operations are.
pub(super) fn parameters(test: &Test) -> Vec<ShrinkAxis> {
    let components = |(at, choice): (usize, &Choice)| match choice {
        Choice::Value { .. } => vec![Component::Value(at)],
        Choice::Range { .. } => vec![Component::High(at), Component::Low(at), Component::Whole(at)],
        Choice::Point { .. } => (0..3).map(|axis| Component::Coordinate(at, axis)).collect(),
        Choice::Text { .. } => Vec::new(),
    };
    let axes = test.operations.iter().enumerate().flat_map(|(place, used)| {
        let components: Vec<Component> = used.parameters.iter().enumerate().flat_map(components).collect();
        components.into_iter().map(move |component| ShrinkAxis { place, component })
    });
    axes.collect()
}

impl ShrinkAxis {
    /// How many steps there are to the smallest that is permitted; 0 there.
    pub(super) fn steps(self, space: &ShrinkSpace, test: &Test) -> u32 {
        let Some((from, to, step)) = self.bounds(space, test) else { return 0 };
        count((to - from).abs() / step)
    }

    /// The test with the axis shrunk by so many steps, from 1 to [`ShrinkAxis::steps`]; the last one is shorter where
    /// they do not come out even.
    pub(super) fn shrink_along(self, space: &ShrinkSpace, test: &Test, steps: u32) -> Test {
        let mut shrunk = test.clone();
        let Some((from, to, step)) = self.bounds(space, test) else { return shrunk };
        let way = f64::from(steps) * step;
        let number = if steps >= self.steps(space, test) {
            to
        } else if from < to {
            (from + way).min(to)
        } else {
            (from - way).max(to)
        };
        self.set(&mut shrunk, number);
        shrunk
    }

    /// The test with the axis shrunk by less than a step, to the next round number; `None` where it is on one, or none
    /// is permitted.
    pub(super) fn rounded(self, space: &ShrinkSpace, test: &Test) -> Option<Test> {
        let (from, to, step) = self.bounds(space, test)?;
        let round = on_grid(from, step, if from < to { libm::ceil } else { libm::floor });
        let is_permitted = (from.min(to)..=from.max(to)).contains(&round);
        (is_permitted && (round - from).abs() > step * ROUNDING).then(|| {
            let mut rounded = test.clone();
            self.set(&mut rounded, round);
            rounded
        })
    }

    /// From where to where the number can go, and in which steps; `None` where it cannot go anywhere.
    fn bounds(self, space: &ShrinkSpace, test: &Test) -> Option<(f64, f64, f64)> {
        let used = &test.operations[self.place];
        let operation = used.operation;
        let number = |at: usize, axis: Option<usize>| -> Option<NeutralValue> {
            match axis {
                None => space.number(operation, at),
                Some(axis) => space.point(operation, at).map(|axes| axes[axis]),
            }
        };
        let (from, to, step) = match (self.component, &used.activation) {
            (Component::Start, &Activation::Time { start, end }) => {
                (start, (end - space.shortest(operation)).max(start), space.time_step(operation))
            }
            (Component::End, &Activation::Time { start, end }) => {
                (end, (start + space.shortest(operation)).min(end), space.time_step(operation))
            }
            (Component::Length, &Activation::ConditionFor { length, .. }) => {
                (length, space.shortest_length(operation).min(length), space.time_step(operation))
            }
            (Component::Times, Activation::Condition { times, .. } | Activation::ConditionFor { times, .. }) => {
                (f64::from(*times), 1.0, 1.0)
            }
            (Component::High(at), _) => {
                let (Choice::Range { low, high }, neutral) = (&used.parameters[at], number(at, None)?) else {
                    return None;
                };
                (*high, neutral.end.map_or(*low, |end| end.max(*low)).min(*high), neutral.step)
            }
            (Component::Low(at), _) => {
                let (Choice::Range { low, high }, neutral) = (&used.parameters[at], number(at, None)?) else {
                    return None;
                };
                (*low, neutral.end.map_or(*high, |end| end.min(*high)).max(*low), neutral.step)
            }
            (Component::Whole(at), _) => {
                let (&Choice::Range { low, high }, neutral) = (&used.parameters[at], number(at, None)?) else {
                    return None;
                };
                let end = neutral.end?;
                // The end of the sub-range that is nearer to the neutral one goes there, and takes the other along.
                let nearer = if end < low { low } else { high };
                (nearer, if (low..=high).contains(&end) { nearer } else { end }, neutral.step)
            }
            (Component::Value(at), _) => {
                let (&Choice::Value { value }, neutral) = (&used.parameters[at], number(at, None)?) else {
                    return None;
                };
                (value, neutral.end?, neutral.step)
            }
            (Component::Coordinate(at, axis), _) => {
                let (Choice::Point { point }, neutral) = (&used.parameters[at], number(at, Some(axis))?) else {
                    return None;
                };
                (point[axis], neutral.end?, neutral.step)
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
        match (self.component, &mut used.activation) {
            (Component::Start, Activation::Time { start, .. }) => *start = number,
            (Component::End, Activation::Time { end, .. }) => *end = number,
            (Component::Length, Activation::ConditionFor { length, .. }) => *length = number,
            (Component::Times, Activation::Condition { times, .. } | Activation::ConditionFor { times, .. }) => {
                *times = count(number);
            }
            (Component::High(at), _) => {
                if let Choice::Range { high, .. } = &mut used.parameters[at] {
                    *high = number;
                }
            }
            (Component::Low(at), _) => {
                if let Choice::Range { low, .. } = &mut used.parameters[at] {
                    *low = number;
                }
            }
            (Component::Whole(at), _) => {
                if let Choice::Range { low, high } = &mut used.parameters[at] {
                    let width = *high - *low;
                    // Rounding must carry neither end away from the neutral one.
                    (*low, *high) = if number < *low {
                        (number, (number + width).min(*high))
                    } else {
                        ((number - width).max(*low), number)
                    };
                }
            }
            (Component::Value(at), _) => {
                if let Choice::Value { value } = &mut used.parameters[at] {
                    *value = number;
                }
            }
            (Component::Coordinate(at, axis), _) => {
                if let Choice::Point { point } = &mut used.parameters[at] {
                    point[axis] = number;
                }
            }
            (Component::Start | Component::End | Component::Length | Component::Times, _) => {}
        }
    }
}

/// The multiple of the greatest power of ten within a step that is next to a number in this direction.
fn on_grid(number: f64, step: f64, direction: fn(f64) -> f64) -> f64 {
    let power = libm::floor(libm::log10(step));
    let unit = libm::exp10(power.abs());
    // A division by a power of ten is exact where a multiplication by its inverse is not.
    if power < 0.0 { direction(number * unit) / unit } else { direction(number / unit) * unit }
}

/// The number of steps, the last one perhaps shorter. A rest that is only rounding is not a step.
#[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "a small count, clamped")]
fn count(steps: f64) -> u32 {
    libm::ceil(steps - ROUNDING).clamp(1.0, f64::from(u32::MAX)) as u32
}
