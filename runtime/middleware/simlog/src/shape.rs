//! What values are to be read: the declared types of a plan, without the plan.

use std::sync::Arc;

use sesame_plan::{CampaignPlan, Type};
use sesame_relay::message::Mismatch;
use sesame_relay::value::{Fields, Record, Value};

use crate::tree::Tree;

/// What kind of value is expected.
#[derive(Debug, Clone)]
pub enum Shape {
    /// True or false.
    Bool,
    /// A whole number.
    Int,
    /// A real number.
    Real,
    /// Text.
    Text,
    /// A point in space.
    Point,
    /// Values of one shape.
    List(Box<Shape>),
    /// Named values.
    Record(Named),
}

/// The fields of a record.
#[derive(Debug, Clone)]
pub struct Named {
    names: Arc<Fields>,
    shapes: Vec<Shape>,
}

impl Shape {
    /// That of a type which a plan declares.
    pub fn of_type(plan: &CampaignPlan, ty: &Type) -> Shape {
        match ty {
            Type::Bool => Shape::Bool,
            Type::Int { .. } => Shape::Int,
            Type::Real { .. } => Shape::Real,
            Type::Text => Shape::Text,
            Type::Point { .. } => Shape::Point,
            Type::List { of } => Shape::List(Box::new(Shape::of_type(plan, of))),
            Type::Message { id } => {
                let fields = &plan.message(*id).fields;
                let names = Fields::new(fields.iter().map(|field| field.name.as_str()));
                let shapes = fields.iter().map(|field| Shape::of_type(plan, &field.ty)).collect();
                Shape::Record(Named { names, shapes })
            }
        }
    }

    /// That of a value. A list takes the shape of its first item; an empty one is taken for a list of reals.
    pub fn of_value(value: &Value) -> Shape {
        match value {
            Value::Bool(_) => Shape::Bool,
            Value::Int(_) => Shape::Int,
            Value::Real(_) => Shape::Real,
            Value::Text(_) | Value::Undeclared(_) => Shape::Text,
            Value::Point(_) => Shape::Point,
            Value::List(items) => Shape::List(Box::new(items.first().map_or(Shape::Real, Shape::of_value))),
            Value::Record(record) => Shape::Record(Named {
                names: Arc::clone(record.fields()),
                shapes: record.values().iter().map(Shape::of_value).collect(),
            }),
        }
    }
}

impl Named {
    /// A record of what is found under each name.
    pub(crate) fn read<'a>(&self, find: impl Fn(&str) -> Option<&'a Tree>) -> Result<Record, Mismatch> {
        let fields = self.names.names().iter().zip(&self.shapes).map(|(name, shape)| {
            let tree = find(name).ok_or_else(|| Mismatch::missing(name))?;
            tree.read(shape).map_err(|mismatch| mismatch.inside(name))
        });
        Ok(Record::new(&self.names, fields.collect::<Result<_, _>>()?))
    }
}
