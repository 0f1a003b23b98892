//! The strongest choices of an operation: the ends of its ranges that are farthest from where it disturbs nothing.

use sesame_plan::{Choice, ChoiceKind, Operation};
use sesame_rng::Stream;

use crate::space::parameter_space::ParameterSpace;
use crate::space::range::Range;

/// Of how many texts or files each counts as a strongest choice.
const ITEMS: usize = 4;

/// The ways in which one operation is strongest.
#[derive(Debug, Clone, PartialEq)]
pub struct Strongest {
    /// Per parameter its strongest choices, at least one.
    parameters: Vec<Vec<Choice>>,
    ways: usize,
}

impl Strongest {
    /// Those of an operation with these parameters to choose.
    pub(crate) fn of(operation: &Operation, spaces: &[ParameterSpace]) -> Strongest {
        let spaces_of = spaces.iter().enumerate();
        let parameters: Vec<Vec<Choice>> =
            spaces_of.map(|(at, space)| choices(space, operation.neutral_value(at))).collect();
        let count = |(choices, space): (&Vec<Choice>, &ParameterSpace)| match space {
            ParameterSpace::Point(_) => 1,
            ParameterSpace::Number(..) | ParameterSpace::Items(_) => choices.len(),
        };
        let ways = parameters.iter().zip(spaces).map(count).max().unwrap_or(1);
        Strongest { parameters, ways }
    }

    /// How many ways a search tries one by one: corners of a box are too many.
    pub(crate) fn ways(&self) -> usize {
        self.ways
    }

    /// One of the [ways](Strongest::ways), by its number. A parameter with more choices than there are ways, such as
    /// the corners of a box, gets any of them.
    pub(crate) fn way(&self, way: usize, stream: &mut Stream) -> Vec<Choice> {
        let choose = |choices: &Vec<Choice>| {
            let at = if choices.len() > self.ways { stream.below(choices.len()) } else { way % choices.len() };
            choices[at].clone()
        };
        self.parameters.iter().map(choose).collect()
    }

    /// Any way.
    pub(crate) fn any(&self, stream: &mut Stream) -> Vec<Choice> {
        let way = stream.below(self.ways);
        self.way(way, stream)
    }

    /// The strongest choices that are nearest to these.
    pub(crate) fn closest_to(&self, chosen: &[Choice]) -> Vec<Choice> {
        let nearest = |(choices, chosen): (&Vec<Choice>, &Choice)| {
            let nearest = choices.iter().min_by(|a, b| distance(a, chosen).total_cmp(&distance(b, chosen)));
            nearest.unwrap_or(chosen).clone()
        };
        self.parameters.iter().zip(chosen).map(nearest).collect()
    }

    /// The strongest choices of a parameter, at least one.
    pub(crate) fn choices(&self, parameter: usize) -> &[Choice] {
        &self.parameters[parameter]
    }

    /// One of the strongest choices of a parameter.
    pub(crate) fn choice(&self, parameter: usize, stream: &mut Stream) -> Choice {
        let choices = self.choices(parameter);
        choices[stream.below(choices.len())].clone()
    }

    /// Which of its strongest choices the first parameter has, if all parameters have one.
    pub(crate) fn which(&self, chosen: &[Choice]) -> Option<usize> {
        let mut places = self
            .parameters
            .iter()
            .zip(chosen)
            .map(|(choices, chosen)| choices.iter().position(|choice| choice == chosen));
        let first = places.next().unwrap_or(Some(0))?;
        places.all(|place| place.is_some()).then_some(first)
    }
}

/// How far two choices of a parameter are from each other; those of texts are or are not the same.
fn distance(a: &Choice, b: &Choice) -> f64 {
    let square = |x: f64, y: f64| (x - y) * (x - y);
    match (a, b) {
        (Choice::Value { value: a }, Choice::Value { value: b }) => square(*a, *b),
        (Choice::Range { low, high }, Choice::Range { low: other_low, high: other_high }) => {
            square(*low, *other_low) + square(*high, *other_high)
        }
        (Choice::Point { point: a }, Choice::Point { point: b }) => a.iter().zip(b).map(|(&x, &y)| square(x, y)).sum(),
        _ => f64::from(u8::from(a != b)),
    }
}

fn choices(space: &ParameterSpace, neutral: Option<f64>) -> Vec<Choice> {
    match space {
        ParameterSpace::Number(range, ChoiceKind::Value) => {
            ends(*range, neutral).into_iter().map(|value| Choice::Value { value }).collect()
        }
        ParameterSpace::Number(range, ChoiceKind::Range) => {
            let mut choices: Vec<Choice> =
                ends(*range, neutral).into_iter().map(|end| Choice::Range { low: end, high: end }).collect();
            if !range.is_fixed() {
                choices.push(Choice::Range { low: range.low, high: range.high });
            }
            choices
        }
        ParameterSpace::Point(axes) => {
            let ends = axes.map(|axis| ends(axis, neutral));
            let mut corners = Vec::new();
            for &x in &ends[0] {
                for &y in &ends[1] {
                    corners.extend(ends[2].iter().map(|&z| Choice::Point { point: [x, y, z] }));
                }
            }
            corners
        }
        ParameterSpace::Items(items) => {
            items.iter().take(ITEMS).map(|text| Choice::Text { text: text.clone() }).collect()
        }
    }
}

/// The ends of a range at which a number is strongest: both, where it is mildest between them or nowhere; else the one
/// that is farther away.
fn ends(range: Range, neutral: Option<f64>) -> Vec<f64> {
    let Range { low, high, .. } = range;
    match neutral {
        _ if range.is_fixed() => vec![low],
        Some(neutral) if neutral <= low => vec![high],
        Some(neutral) if neutral >= high => vec![low],
        _ => vec![high, low],
    }
}

#[cfg(test)]
mod tests {
    use sesame_plan::OperationKind;
    use sesame_plan::testing::{operation_with, plan, range, value};

    use super::*;
    use crate::space::test_space::TestSpace;

    fn strongest(kind: OperationKind, parameter: sesame_plan::Parameter) -> Vec<Choice> {
        let plan = plan(vec![operation_with("o", 0, kind, vec![parameter])]);
        let space = TestSpace::from_plan(&plan).unwrap();
        space.operations()[0].strongest.choices(0).to_vec()
    }

    #[test]
    fn the_strongest_choices_are_the_ends_far_from_where_nothing_is_disturbed() {
        let value_of = |value| Choice::Value { value };
        assert_eq!(strongest(OperationKind::Bias, value("bias", 1.0, 3.0)), [value_of(3.0)]);
        assert_eq!(strongest(OperationKind::Bias, value("bias", -1.0, 3.0)), [value_of(3.0), value_of(-1.0)]);
        assert_eq!(strongest(OperationKind::Scale, value("factor", 0.0, 1.0)), [value_of(0.0)]);
        assert_eq!(strongest(OperationKind::RateLimit, value("rate", 1.0, 10.0)), [value_of(1.0)]);
        assert_eq!(strongest(OperationKind::PacketLoss, value("loss", 0.2, 0.2)), [value_of(0.2)]);
        let stuck = OperationKind::StuckAt { truth: None };
        assert_eq!(strongest(stuck, value("value", 0.0, 5.0)), [value_of(5.0), value_of(0.0)]);
        let noise = strongest(OperationKind::Noise, range("sigma", 0.0, 2.0));
        assert_eq!(noise, [Choice::Range { low: 2.0, high: 2.0 }, Choice::Range { low: 0.0, high: 2.0 }]);
    }
}
