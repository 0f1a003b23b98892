//! Formulas of metrics, from the model to the plan.

use sesame_dsl::model;
use sesame_plan as plan;

use super::id::topic_id;

pub(super) fn field(field: &model::FieldPath) -> plan::FieldRef {
    plan::FieldRef { topic: topic_id(field.topic), path: field.fields.clone() }
}

pub(super) fn formula(formula: &model::Formula) -> plan::Formula {
    plan::Formula {
        inputs: inputs(&formula.inputs),
        aggregate: formula.aggregate.clone(),
        when: formula.when.clone(),
        every: formula.every,
        per: formula.per.as_ref().map(field),
        side: side(formula.outbound),
    }
}

pub(super) fn inputs(inputs: &[model::Input]) -> Vec<plan::Input> {
    let inputs = inputs.iter().map(|input| plan::Input {
        field: field(&input.field),
        members: input.members,
        list: input.list.clone(),
        text: input.text.clone(),
        memory: input.memory.clone(),
    });
    inputs.collect()
}

pub(super) fn side(outbound: bool) -> plan::Side {
    if outbound { plan::Side::Outbound } else { plan::Side::Inbound }
}

#[cfg(test)]
mod tests {
    use sesame_plan::{Distance, Expression, Input, Members, Point, Region, SignedDistance};

    #[test]
    fn what_earlier_versions_wrote_is_read_and_written_as_it_was() {
        let input = r#"{"field":{"topic":1,"path":["level"]},"members":"each"}"#;
        let distance = r#"{"distance":{"from":0,"to":1,"scale":0.001}}"#;
        let read: Input = serde_json::from_str(input).unwrap();
        assert_eq!((read.members, &read.text), (Members::Each, &None));
        assert_eq!(serde_json::to_string(&read).unwrap(), input);
        let read: Expression = serde_json::from_str(distance).unwrap();
        let (from, to) = (Point::Input(0), Point::Input(1));
        assert_eq!(read, Expression::Distance(Box::new(Distance { from, to, scale: 0.001 })));
        assert_eq!(serde_json::to_string(&read).unwrap(), distance);
    }

    #[test]
    fn written_points_and_regions_read_back_bit_for_bit() {
        let from = Point::Constant([0.1, -2.0, 1e-300]);
        let to = Region::Polygon { corners: vec![[0.0, 0.0], [1.0 / 3.0, 0.0], [0.0, 7.0]] };
        for of in [
            Expression::SignedDistance(Box::new(SignedDistance { from, to })),
            Expression::Distance(Box::new(Distance { from, to: Point::Input(3), scale: 1.0 })),
            Expression::Time,
            Expression::Now,
            Expression::Scene { operation: "start_x".to_owned(), usual: -0.1 },
        ] {
            let text = serde_json::to_string(&of).unwrap();
            assert_eq!(serde_json::from_str::<Expression>(&text).unwrap(), of, "{text}");
        }
    }
}
