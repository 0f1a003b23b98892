//! Choosing a parameter: anew, or near what was chosen.

use sesame_plan::{Choice, ChoiceKind, Domain};
use sesame_rng::Stream;

use crate::space::range::{Range, StepSizes};

/// What a campaign permits a test to choose for a parameter.
#[derive(Debug, Clone, PartialEq)]
pub enum ParameterSpace {
    /// A number of a range, or a sub-range of it.
    Number(Range, ChoiceKind),
    /// A point: its range on each axis.
    Point([Range; 3]),
    /// One of these texts or files; at least one.
    Items(Vec<String>),
}

impl ParameterSpace {
    /// What a domain permits; `None` where a number must be whole and no whole number is permitted.
    pub fn from_domain(domain: &Domain) -> Option<Self> {
        match domain {
            Domain::Number { low, high, shape, integer } => {
                Some(ParameterSpace::Number(Range::numbers(*low, *high, *integer)?, *shape))
            }
            Domain::Point { low, high } => {
                let axis = |axis: usize| Range::between(low[axis], high[axis]);
                Some(ParameterSpace::Point([axis(0), axis(1), axis(2)]))
            }
            Domain::Texts { texts: items } | Domain::Files { files: items } => {
                Some(ParameterSpace::Items(items.clone()))
            }
        }
    }

    /// Whether a test has nothing to choose.
    pub fn is_fixed(&self) -> bool {
        match self {
            ParameterSpace::Number(range, _) => range.is_fixed(),
            ParameterSpace::Point(axes) => axes.iter().all(|range| range.is_fixed()),
            ParameterSpace::Items(items) => items.len() <= 1,
        }
    }

    /// A choice: values, points and items are uniform over what is permitted, sub-ranges over all feasible pairs.
    pub fn fresh(&self, stream: &mut Stream) -> Choice {
        match self {
            ParameterSpace::Number(range, ChoiceKind::Value) => Choice::Value { value: range.number(stream) },
            ParameterSpace::Number(range, ChoiceKind::Range) => {
                let (low, high) = range.interval(stream);
                Choice::Range { low, high }
            }
            ParameterSpace::Point(axes) => Choice::Point { point: axes.map(|range| range.number(stream)) },
            ParameterSpace::Items(items) => Choice::Text { text: items[stream.below(items.len())].clone() },
        }
    }

    /// A choice near another: numbers and points move a little, of texts and files another one is taken.
    pub fn near(&self, choice: &Choice, steps: StepSizes, stream: &mut Stream) -> Choice {
        match (self, choice) {
            (ParameterSpace::Number(range, _), Choice::Value { value }) => {
                Choice::Value { value: range.number_near(*value, steps, stream) }
            }
            (ParameterSpace::Number(range, _), Choice::Range { low, high }) => {
                let (low, high) = range.interval_near((*low, *high), steps, stream);
                Choice::Range { low, high }
            }
            (ParameterSpace::Point(axes), Choice::Point { point }) => {
                let mut point = *point;
                for (coordinate, range) in point.iter_mut().zip(axes) {
                    *coordinate = range.number_near(*coordinate, steps, stream);
                }
                Choice::Point { point }
            }
            (ParameterSpace::Items(items), Choice::Text { text }) => {
                let others: Vec<&String> = items.iter().filter(|item| *item != text).collect();
                let text = if others.is_empty() { text } else { others[stream.below(others.len())] };
                Choice::Text { text: text.clone() }
            }
            // A choice of another kind is none that this campaign made.
            _ => self.fresh(stream),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const STEPS: StepSizes = StepSizes { finest: 0.01, boldest: 0.3 };

    #[test]
    fn points_stay_in_their_box_and_fill_it() {
        let permitted =
            ParameterSpace::from_domain(&Domain::Point { low: [-1.0, 0.0, 5.0], high: [1.0, 0.0, 9.0] }).unwrap();
        let mut stream = Stream::derive(1, "test", &[]);
        let mut choice = permitted.fresh(&mut stream);
        let (mut least, mut most) = ([f64::INFINITY; 3], [f64::NEG_INFINITY; 3]);
        for _ in 0..2_000 {
            choice = permitted.near(&choice, STEPS, &mut stream);
            let Choice::Point { point } = choice else { panic!("a point stays one") };
            for axis in 0..3 {
                least[axis] = least[axis].min(point[axis]);
                most[axis] = most[axis].max(point[axis]);
            }
        }
        assert_eq!((least, most), ([-1.0, 0.0, 5.0], [1.0, 0.0, 9.0]), "and the ends are reached");
    }

    #[test]
    fn items_are_uniform_and_a_change_is_always_to_another() {
        let texts = ["a", "b", "c"].map(str::to_owned).to_vec();
        let permitted = ParameterSpace::from_domain(&Domain::Texts { texts }).unwrap();
        let mut stream = Stream::derive(1, "test", &[]);
        let mut counts = std::collections::BTreeMap::new();
        for _ in 0..6_000 {
            let fresh = permitted.fresh(&mut stream);
            let near = permitted.near(&fresh, STEPS, &mut stream);
            assert_ne!(fresh, near);
            let Choice::Text { text } = fresh else { panic!("a text stays one") };
            *counts.entry(text).or_insert(0u32) += 1;
        }
        assert!(counts.len() == 3 && counts.values().all(|n| (1_850..2_150).contains(n)), "{counts:?}");
        let only = ParameterSpace::Items(vec!["a".to_owned()]);
        assert!(only.is_fixed());
        let choice = Choice::Text { text: "a".to_owned() };
        assert_eq!(only.near(&choice, STEPS, &mut stream), choice);
    }
}
