//! Parts of runtime monitors: evidence with its condition, how long that must hold and when it is stale; mitigation.
//!
//! Numbers are in the unit of the field on the wire with which they are compared, whichever unit the space uses.

use std::fmt::Write as _;

use sesame_plan::{
    CampaignPlan, Condition, Evidence, Expression, FieldRef, InList, Input, Members, Mitigation, MitigationValue,
    Point, Reduction, Region, Side, StaleIs, Step, TextTest, Type, value_path_in_words,
};

use crate::text::quoted;
use crate::unit::Unit;

/// What is behind the name and `=` of evidence in the language: `brake_pressure >= 4bar held 0.1s`.
pub fn evidence(plan: &CampaignPlan, evidence: &Evidence) -> String {
    let names = Names { plan, inputs: &evidence.inputs };
    let mut text = names.condition(&evidence.condition);
    if evidence.held > 0.0 {
        let _ = write!(text, " held {}", Unit::SECONDS.number(evidence.held));
    }
    if let Some(stale) = evidence.stale {
        let is = match stale.is {
            StaleIs::False => "false",
            StaleIs::Unknown => "unknown",
        };
        let all = if stale.all { " all" } else { "" };
        let _ = write!(text, "{all} stale after {} is {is}", Unit::SECONDS.number(stale.after));
    }
    if evidence.side == Side::Inbound {
        text += " inbound";
    }
    text
}

/// What a mitigation sets: `drive.speed = 0m/s`.
pub fn mitigation(plan: &CampaignPlan, mitigation: &Mitigation) -> String {
    let value = match &mitigation.value {
        MitigationValue::Bool(value) => value.to_string(),
        MitigationValue::Int(value) => {
            format!("{value}{}", unit_of_field(plan, &mitigation.field).unwrap_or(Unit::None).symbol())
        }
        MitigationValue::Real(value) => unit_of_field(plan, &mitigation.field).unwrap_or(Unit::None).number(*value),
        MitigationValue::Text(text) => quoted(text),
    };
    format!("{} = {value}", name_of_field(plan, &mitigation.field))
}

/// A topic, or a field of its messages: `drive.speed`.
fn name_of_field(plan: &CampaignPlan, field: &FieldRef) -> String {
    let topic = &plan.topic(field.topic).name;
    std::iter::once(topic).chain(&field.path).map(String::as_str).collect::<Vec<_>>().join(".")
}

/// The unit of a field that is a number or a point, or a coordinate of one.
fn unit_of_field<'a>(plan: &'a CampaignPlan, field: &FieldRef) -> Option<Unit<'a>> {
    unit_in(plan, field, &[])
}

/// The unit of the value behind the steps from a field.
pub(crate) fn unit_in<'a>(plan: &'a CampaignPlan, field: &FieldRef, steps: &[Step]) -> Option<Unit<'a>> {
    let mut ty = &plan.topic(field.topic).ty;
    let fields = field.path.iter().map(Some);
    let steps = steps.iter().map(|step| match step {
        Step::Field(name) => Some(name),
        _ => None,
    });
    for name in fields.chain(steps) {
        ty = match (ty, name) {
            (Type::Message { id }, Some(name)) => {
                &plan.message(*id).fields.iter().find(|field| field.name == *name)?.ty
            }
            (Type::List { of }, None) => of,
            // A coordinate of a point.
            (other, _) => other,
        };
    }
    match ty {
        Type::Int { unit } | Type::Real { unit } | Type::Point { unit } => Some(Unit::named(unit.as_deref())),
        Type::Bool | Type::Text | Type::List { .. } | Type::Message { .. } => None,
    }
}

struct Names<'a> {
    plan: &'a CampaignPlan,
    inputs: &'a [Input],
}

impl<'a> Names<'a> {
    fn condition(&self, condition: &Condition) -> String {
        let joined = |parts: &[Condition], word: &str| {
            let parts: Vec<String> = parts.iter().map(|part| self.part(part)).collect();
            parts.join(word)
        };
        match condition {
            Condition::Constant(holds) => holds.to_string(),
            Condition::Input(at) => self.input(*at),
            Condition::Compare { left, by, right } => {
                let unit = self.unit(left).or_else(|| self.unit(right)).unwrap_or(Unit::None);
                format!("{} {} {}", self.expression(left, unit), by.sign(), self.expression(right, unit))
            }
            Condition::Same { left, right } => format!("{} == {}", self.part(left), self.part(right)),
            Condition::All(parts) => joined(parts, " and "),
            Condition::Any(parts) => joined(parts, " or "),
            Condition::Not(of) => format!("not {}", self.part(of)),
        }
    }

    /// A condition inside of another.
    fn part(&self, condition: &Condition) -> String {
        let text = self.condition(condition);
        match condition {
            Condition::All(_) | Condition::Any(_) | Condition::Same { .. } => format!("({text})"),
            _ => text,
        }
    }

    fn expression(&self, expression: &Expression, unit: Unit<'_>) -> String {
        let inner = |of: &Expression| self.expression(of, unit);
        // A factor or a divisor has no unit that could be told from here.
        let plain = |of: &Expression| self.operand(of, Unit::None);
        let all = |of: &[Expression], with: &dyn Fn(&Expression) -> String, between: &str| {
            of.iter().map(with).collect::<Vec<_>>().join(between)
        };
        match expression {
            Expression::Constant(number) => unit.number(*number),
            Expression::Input(at) | Expression::Integral(at) => self.input(*at),
            Expression::Negate(of) => format!("-{}", self.operand(of, unit)),
            Expression::Sum(of) => all(of, &|of| self.operand(of, unit), " + ").replace(" + -", " - "),
            Expression::Product(of) => all(of, &plain, " * "),
            Expression::Divide { value, by } => format!("{} / {}", plain(value), plain(by)),
            Expression::Absolute(of) => format!("abs({})", inner(of)),
            Expression::Min(of) => format!("min({})", all(of, &inner, ", ")),
            Expression::Max(of) => format!("max({})", all(of, &inner, ", ")),
            Expression::Distance(of) => format!("distance({}, {})", self.point(of.from), self.point(of.to)),
            Expression::SignedDistance(of) => {
                format!("signed_distance({}, {})", self.point(of.from), self.region(&of.to, of.from))
            }
            Expression::Time => "time".to_owned(),
            Expression::Now => "now".to_owned(),
            Expression::Scene { operation, .. } => operation.clone(),
            Expression::Unary { function, of } => {
                format!("{}({})", function.name(), self.expression(of, Unit::None))
            }
            Expression::Binary { function, left, right } => {
                let [left, right] = [left, right].map(|of| self.expression(of, Unit::None));
                format!("{}({left}, {right})", function.name())
            }
        }
    }

    /// An expression inside of another.
    fn operand(&self, expression: &Expression, unit: Unit<'_>) -> String {
        let text = self.expression(expression, unit);
        match expression {
            Expression::Sum(_) | Expression::Product(_) | Expression::Divide { .. } => format!("({text})"),
            _ => text,
        }
    }

    /// The unit of what an expression adds up or chooses from, if it is that of a field.
    fn unit(&self, expression: &Expression) -> Option<Unit<'a>> {
        match expression {
            Expression::Input(at) | Expression::Integral(at) => self.unit_of_input(*at),
            Expression::Negate(of) | Expression::Absolute(of) => self.unit(of),
            Expression::Sum(of) | Expression::Min(of) | Expression::Max(of) => of.iter().find_map(|of| self.unit(of)),
            Expression::Distance(of) => self.unit_of_point(of.from).or_else(|| self.unit_of_point(of.to)),
            Expression::SignedDistance(of) => self.unit_of_point(of.from),
            _ => None,
        }
    }

    fn unit_of_input(&self, at: u32) -> Option<Unit<'a>> {
        let input = self.inputs.get(at as usize)?;
        match &input.list {
            None => unit_of_field(self.plan, &input.field),
            Some(InList { reduction: Reduction::Count | Reduction::Length, .. }) => Some(Unit::None),
            Some(list) => unit_in(self.plan, &input.field, &list.steps),
        }
    }

    fn unit_of_point(&self, point: Point) -> Option<Unit<'a>> {
        match point {
            Point::Input(at) => self.unit_of_input(at),
            Point::Constant(_) => None,
        }
    }

    fn point(&self, point: Point) -> String {
        match point {
            Point::Input(at) => self.input(at),
            Point::Constant(point) => Unit::None.point(point),
        }
    }

    fn region(&self, region: &Region, of: Point) -> String {
        let unit = self.unit_of_point(of).unwrap_or(Unit::None);
        match region {
            Region::Box { low, high } => format!("box({}, {})", unit.point(*low), unit.point(*high)),
            Region::Polygon { corners } => {
                let corners = corners.iter().map(|[x, y]| format!("({}, {})", unit.number(*x), unit.number(*y)));
                format!("polygon({})", corners.collect::<Vec<_>>().join(", "))
            }
        }
    }

    fn input(&self, at: u32) -> String {
        let Some(input) = self.inputs.get(at as usize) else { return "?".to_owned() };
        let Input { field, members, list, text, memory } = input;
        let mut name = name_of_field(self.plan, field);
        if let Members::Only(member) = members {
            let topic = self.plan.topic(field.topic);
            let behind = name.strip_prefix(topic.name.as_str()).unwrap_or_default();
            name = format!("{}{behind}", topic.member_in_words(*member));
        }
        if let Some(InList { steps, reduction }) = list {
            name.push_str(&value_path_in_words(steps));
            name = match reduction {
                Reduction::First => name,
                Reduction::Min => format!("min of {name}"),
                Reduction::Max => format!("max of {name}"),
                Reduction::Sum => format!("sum of {name}"),
                Reduction::Mean => format!("mean of {name}"),
                Reduction::Count => format!("count of {name}"),
                Reduction::Length => format!("length of {name}"),
                Reduction::Each => format!("each of {name}"),
            };
        }
        if self.plan.topic(field.topic).paths.len() > 1 {
            match members {
                Members::Min => name = format!("min({name})"),
                Members::Max => name = format!("max({name})"),
                Members::Sum => name = format!("sum({name})"),
                Members::Each | Members::First | Members::Second | Members::Only(_) => {}
            }
        }
        for of in memory {
            name = format!("{}({name})", of.name());
        }
        match text {
            Some(TextTest::Is(text)) => format!("{name} == {}", quoted(text)),
            Some(TextTest::IsNot(text)) => format!("{name} != {}", quoted(text)),
            None => name,
        }
    }
}

#[cfg(test)]
mod tests {
    use sesame_plan::testing::{evidence_above, minimal, topic};
    use sesame_plan::{Comparison, Stale, TopicId};

    use super::*;

    fn plan() -> CampaignPlan {
        let real = |unit: &str| Type::Real { unit: Some(unit.to_owned()) };
        CampaignPlan {
            topics: vec![
                topic("pressure", &["brakes/pressure"], real("kPa")),
                topic("gaps", &["gap/1", "gap/2"], real("m")),
                topic("mode", &["mode"], Type::Text),
            ],
            ..minimal()
        }
    }

    #[test]
    fn a_condition_has_the_unit_of_its_topic_and_all_that_belongs_to_evidence() {
        let stale = Some(Stale { after: 0.25, is: StaleIs::Unknown, all: false });
        let whole = Evidence { held: 0.1, stale, side: Side::Inbound, ..evidence_above("ok", 0, 400.0) };
        assert_eq!(evidence(&plan(), &whole), "pressure > 400kPa held 0.1s stale after 0.25s is unknown inbound");
        assert_eq!(evidence(&plan(), &evidence_above("far", 1, 0.5)), "min(gaps) > 0.5m");
    }

    #[test]
    fn a_mitigation_sets_a_field_to_a_value_in_its_unit() {
        let sent = |topic, value| {
            mitigation(&plan(), &Mitigation { field: FieldRef { topic: TopicId(topic), path: Vec::new() }, value })
        };
        assert_eq!(sent(0, MitigationValue::Real(0.5)), "pressure = 0.5kPa");
        assert_eq!(sent(0, MitigationValue::Int(3)), "pressure = 3kPa");
        assert_eq!(sent(2, MitigationValue::Text("stop".to_owned())), "mode = \"stop\"");
        assert_eq!(sent(2, MitigationValue::Bool(true)), "mode = true");
    }

    #[test]
    fn connectives_texts_and_arithmetic_are_written_with_the_parentheses_that_they_need() {
        let input = |topic, text| Input {
            field: FieldRef { topic: TopicId(topic), path: Vec::new() },
            members: Members::Min,
            list: None,
            text,
            memory: Vec::new(),
        };
        let halves = Expression::Product(vec![
            Expression::Constant(0.5),
            Expression::Sum(vec![Expression::Input(0), Expression::Negate(Box::new(Expression::Input(1)))]),
        ]);
        let low = Condition::Compare { left: halves, by: Comparison::Below, right: Expression::Constant(3.0) };
        let condition = Condition::Any(vec![
            Condition::Not(Box::new(Condition::All(vec![low, Condition::Input(2)]))),
            Condition::Constant(true),
        ]);
        let inputs = vec![input(0, None), input(1, None), input(2, Some(TextTest::IsNot("auto".to_owned())))];
        let made = Evidence { inputs, condition, ..evidence_above("odd", 0, 0.0) };
        assert_eq!(evidence(&plan(), &made), "not (0.5 * (pressure - min(gaps)) < 3 and mode != \"auto\") or true");
    }
}
