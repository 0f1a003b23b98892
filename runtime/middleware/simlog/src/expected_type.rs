//! What values are to be read: the declared types of a plan, without the plan.

use std::sync::Arc;

use sesame_plan::{CampaignPlan, Type};
use sesame_relay::message::Mismatch;
use sesame_relay::value::{Fields, Record, Value};

use crate::tree::Tree;

/// What kind of value is expected.
#[derive(Debug, Clone)]
pub enum ExpectedType {
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
    /// Values of one type.
    List(Box<ExpectedType>),
    /// Named values.
    Record(Named),
}

/// The fields of a record.
#[derive(Debug, Clone)]
pub struct Named {
    names: Arc<Fields>,
    types: Vec<ExpectedType>,
}

impl ExpectedType {
    /// The type that a plan declares.
    pub fn of_type(plan: &CampaignPlan, ty: &Type) -> ExpectedType {
        match ty {
            Type::Bool => ExpectedType::Bool,
            Type::Int { .. } => ExpectedType::Int,
            Type::Real { .. } => ExpectedType::Real,
            Type::Text => ExpectedType::Text,
            Type::Point { .. } => ExpectedType::Point,
            Type::List { of } => ExpectedType::List(Box::new(ExpectedType::of_type(plan, of))),
            Type::Message { id } => {
                let fields = &plan.message(*id).fields;
                let names = Fields::new(fields.iter().map(|field| field.name.as_str()));
                let types = fields.iter().map(|field| ExpectedType::of_type(plan, &field.ty)).collect();
                ExpectedType::Record(Named { names, types })
            }
        }
    }

    /// The type of a value. A list takes the type of its first item; an empty one is taken for a list of reals.
    pub fn of_value(value: &Value) -> ExpectedType {
        match value {
            Value::Bool(_) => ExpectedType::Bool,
            Value::Int(_) => ExpectedType::Int,
            Value::Real(_) => ExpectedType::Real,
            Value::Text(_) | Value::Undeclared(_) | Value::Opaque(_) => ExpectedType::Text,
            Value::Point(_) => ExpectedType::Point,
            Value::List(items) => {
                ExpectedType::List(Box::new(items.first().map_or(ExpectedType::Real, ExpectedType::of_value)))
            }
            Value::Record(record) => ExpectedType::Record(Named {
                names: Arc::clone(record.fields()),
                types: record.values().iter().map(ExpectedType::of_value).collect(),
            }),
        }
    }
}

impl Named {
    /// A record of what is found under each name.
    pub(crate) fn read<'a>(&self, find: impl Fn(&str) -> Option<&'a Tree>) -> Result<Record, Mismatch> {
        let fields = self.names.names().iter().zip(&self.types).map(|(name, expected)| {
            let tree = find(name).ok_or_else(|| Mismatch::missing(name))?;
            tree.read(expected).map_err(|mismatch| mismatch.inside(name))
        });
        Ok(Record::new(&self.names, fields.collect::<Result<_, _>>()?))
    }
}
