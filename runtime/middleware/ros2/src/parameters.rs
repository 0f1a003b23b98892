//! Parameters of nodes, read and set by the services that every node of ROS has for them.

use std::sync::Arc;

use sesame_plan::NewValue;
use sesame_relay::value::{Fields, Record, Text, Value};

use crate::dds::{DdsError, Endpoint, Participant};
use crate::layouts::Layout;
use crate::node_service::{Service, Ticket};

/// The parameters of one node.
pub(crate) struct Parameters {
    get: Service,
    set: Service,
}

/// The value of a parameter as the node has it, to be given back as it is.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct ParameterValue(Value);

const VALUE: &str = "rcl_interfaces/msg/ParameterValue";

/// What parameters can be, by their numbers in ROS, the first of which is that of a parameter without a value: where
/// the value is, and what it is in words.
const TYPES: [(&str, &str); 10] = [
    ("", "without a value"),
    ("bool_value", "a `bool`"),
    ("integer_value", "a number"),
    ("double_value", "a number"),
    ("string_value", "a text"),
    ("byte_array_value", "a list of bytes"),
    ("bool_array_value", "a list of `bool`"),
    ("integer_array_value", "a list of numbers"),
    ("double_array_value", "a list of numbers"),
    ("string_array_value", "a list of texts"),
];

const LAYOUTS: &[Layout] = &[
    (
        VALUE,
        &[
            ("type", "uint8"),
            ("bool_value", "bool"),
            ("integer_value", "int64"),
            ("double_value", "float64"),
            ("string_value", "string"),
            ("byte_array_value", "uint8[]"),
            ("bool_array_value", "bool[]"),
            ("integer_array_value", "int64[]"),
            ("double_array_value", "float64[]"),
            ("string_array_value", "string[]"),
        ],
    ),
    ("rcl_interfaces/msg/Parameter", &[("name", "string"), ("value", VALUE)]),
    ("rcl_interfaces/msg/SetParametersResult", &[("successful", "bool"), ("reason", "string")]),
    ("rcl_interfaces/srv/GetParameters_Request", &[("names", "string[]")]),
    ("rcl_interfaces/srv/GetParameters_Response", &[("values", "rcl_interfaces/msg/ParameterValue[]")]),
    ("rcl_interfaces/srv/SetParameters_Request", &[("parameters", "rcl_interfaces/msg/Parameter[]")]),
    ("rcl_interfaces/srv/SetParameters_Response", &[("results", "rcl_interfaces/msg/SetParametersResult[]")]),
];

impl Parameters {
    pub(crate) fn join(node: &str, dds: &mut Participant) -> Result<Self, DdsError> {
        Ok(Parameters {
            get: Service::join(node, "get_parameters", "rcl_interfaces/srv/GetParameters", LAYOUTS, dds)?,
            set: Service::join(node, "set_parameters", "rcl_interfaces/srv/SetParameters", LAYOUTS, dds)?,
        })
    }

    /// What is missing before a run, in a phrase.
    pub(crate) fn missing(&self, subscribers: &[Endpoint]) -> Option<String> {
        [&self.get, &self.set].into_iter().find_map(|service| service.missing(subscribers))
    }

    /// Asks for the value of a parameter.
    pub(crate) fn ask(&self, name: &str, dds: &Participant) -> Result<Ticket, DdsError> {
        let names = Value::List(vec![Value::Text(Text::from(name))]);
        self.get.call(&Record::new(&Fields::new(["names"]), vec![names]).into(), dds)
    }

    /// The value in the reply; `None` if the node has no such parameter.
    pub(crate) fn asked(&self, reply: Arc<[u8]>) -> Option<ParameterValue> {
        let reply = self.get.read(reply).ok()?;
        let Value::List(values) = reply.at(&["values"])? else { return None };
        let value = values.first()?.clone();
        (value.number_at(&["type"])? != 0.0).then_some(ParameterValue(value))
    }

    /// Sets a parameter.
    pub(crate) fn set(&self, name: &str, value: &ParameterValue, dds: &Participant) -> Result<Ticket, DdsError> {
        let fields = Fields::new(["name", "value"]);
        let parameter = Record::new(&fields, vec![Value::Text(Text::from(name)), value.0.clone()]);
        let parameters = Value::List(vec![parameter.into()]);
        self.set.call(&Record::new(&Fields::new(["parameters"]), vec![parameters]).into(), dds)
    }

    /// Whether a parameter was set; the error is the reason that the node gives.
    pub(crate) fn was_set(&self, reply: Arc<[u8]>) -> Result<(), String> {
        let unreadable = || "its answer cannot be read".to_owned();
        let reply = self.set.read(reply)?;
        let Some(Value::List(results)) = reply.at(&["results"]) else { return Err(unreadable()) };
        let result = results.first().ok_or_else(unreadable)?;
        match (result.number_at(&["successful"]), result.at(&["reason"])) {
            (Some(successful), _) if successful != 0.0 => Ok(()),
            (_, Some(Value::Text(reason))) => Err(reason.to_string()),
            _ => Err(unreadable()),
        }
    }
}

impl ParameterValue {
    /// The same parameter with this value. Whole numbers are the nearest ones. An error if it is of another type.
    pub(crate) fn with(&self, new: &NewValue) -> Result<ParameterValue, String> {
        let (field, is) = self.ty();
        let value = match (field, new) {
            ("bool_value", NewValue::Bool(truth)) => Value::Bool(*truth),
            ("integer_value", NewValue::Number(number)) => whole(*number),
            ("double_value", NewValue::Number(number)) => Value::Real(*number),
            ("string_value", NewValue::Text(text)) => Value::Text(Text::from(text.as_str())),
            ("byte_array_value", NewValue::Numbers(numbers)) => {
                if !numbers.iter().all(|number| (0.0..=255.0).contains(&number.round())) {
                    return Err("it is a list of bytes, which are from 0 to 255".to_owned());
                }
                listed(numbers, |number| whole(*number))
            }
            ("bool_array_value", NewValue::Bools(truths)) => listed(truths, |truth| Value::Bool(*truth)),
            ("integer_array_value", NewValue::Numbers(numbers)) => listed(numbers, |number| whole(*number)),
            ("double_array_value", NewValue::Numbers(numbers)) => listed(numbers, |number| Value::Real(*number)),
            ("string_array_value", NewValue::Texts(texts)) => {
                listed(texts, |text| Value::Text(Text::from(text.as_str())))
            }
            ("bool_array_value" | "string_array_value", NewValue::Numbers(none)) if none.is_empty() => {
                Value::List(Vec::new())
            }
            _ => return Err(format!("it is {is}, not {}", new.is())),
        };
        let mut with = self.0.clone();
        if let Some(place) = with.at_mut(&[field]) {
            *place = value;
        }
        Ok(ParameterValue(with))
    }

    /// Where its value is, and what it is in words.
    fn ty(&self) -> (&'static str, &'static str) {
        let number = self.0.number_at(&["type"]).unwrap_or_default();
        let found = (0u8..).zip(TYPES).find(|(known, _)| f64::from(*known) == number);
        found.map_or(("", "of an unknown type"), |(_, ty)| ty)
    }
}

#[expect(clippy::cast_possible_truncation, reason = "casts of reals saturate")]
fn whole(number: f64) -> Value {
    Value::Int(number.round() as i64)
}

fn listed<T>(items: &[T], value: impl Fn(&T) -> Value) -> Value {
    Value::List(items.iter().map(value).collect())
}
