//! Parameters of nodes, read and set by the services that every node of ROS has for them.

use std::sync::Arc;

use rustdds::rpc::SampleIdentity;
use rustdds::{GUID, SequenceNumber};
use sesame_codec::cdr::Codec;
use sesame_plan::{Interface, InterfaceField, Primitive, WireType};
use sesame_relay::value::{Fields, Record, Text, Value};
use sesame_relay::wire::Wanted;

use crate::dds::{DdsError, Endpoint, Participant, ReaderId, Sample, WriterId, mirrored};
use crate::names;

/// The parameters of one node.
pub(crate) struct Parameters {
    get: Service,
    set: Service,
}

/// A service with what encodes its requests and decodes its replies.
pub(crate) struct Service {
    path: String,
    request: Codec,
    reply: Codec,
    writer: WriterId,
    pub(crate) reader: ReaderId,
    address: GUID,
}

/// What a call waits for.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Ticket {
    pub(crate) reader: ReaderId,
    pub(crate) number: SequenceNumber,
}

/// The value of a parameter as the node has it, to be given back as it is.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct ParameterValue(Value);

const VALUE: &str = "rcl_interfaces/msg/ParameterValue";
const PARAMETER: &str = "rcl_interfaces/msg/Parameter";
const RESULT: &str = "rcl_interfaces/msg/SetParametersResult";

/// What a parameter is, by the numbers of ROS.
const INTEGER: i64 = 2;
const DOUBLE: i64 = 3;

fn interfaces() -> Vec<Interface> {
    let field = |name: &str, ty| InterfaceField { name: name.to_owned(), ty };
    let primitive = |primitive| WireType::Primitive { primitive };
    let list = |of| WireType::Sequence { of: Box::new(of), bound: None };
    let nested = |name: &str| WireType::Interface { name: name.to_owned() };
    let interface = |name: &str, fields| Interface { name: name.to_owned(), fields };
    vec![
        interface(
            VALUE,
            vec![
                field("type", primitive(Primitive::Uint8)),
                field("bool_value", primitive(Primitive::Bool)),
                field("integer_value", primitive(Primitive::Int64)),
                field("double_value", primitive(Primitive::Float64)),
                field("string_value", WireType::String),
                field("byte_array_value", list(primitive(Primitive::Uint8))),
                field("bool_array_value", list(primitive(Primitive::Bool))),
                field("integer_array_value", list(primitive(Primitive::Int64))),
                field("double_array_value", list(primitive(Primitive::Float64))),
                field("string_array_value", list(WireType::String)),
            ],
        ),
        interface(PARAMETER, vec![field("name", WireType::String), field("value", nested(VALUE))]),
        interface(RESULT, vec![field("successful", primitive(Primitive::Bool)), field("reason", WireType::String)]),
        interface("rcl_interfaces/srv/GetParameters_Request", vec![field("names", list(WireType::String))]),
        interface("rcl_interfaces/srv/GetParameters_Response", vec![field("values", list(nested(VALUE)))]),
        interface("rcl_interfaces/srv/SetParameters_Request", vec![field("parameters", list(nested(PARAMETER)))]),
        interface("rcl_interfaces/srv/SetParameters_Response", vec![field("results", list(nested(RESULT)))]),
    ]
}

impl Service {
    fn join(node: &str, service: &str, ty: &str, dds: &mut Participant) -> Result<Self, DdsError> {
        let path = format!("{node}/{service}");
        let codec = |part: &str| {
            let name = format!("rcl_interfaces/srv/{ty}_{part}");
            Codec::new(&interfaces(), &name, &Wanted::All).map_err(|error| DdsError(error.to_string()))
        };
        let type_name = |part: &str| names::type_name(&format!("rcl_interfaces/srv/{ty}_{part}"));
        let qos = mirrored([]);
        let reader = dds.read(&names::reply(&path), &type_name("Response"), &qos)?;
        let writer = dds.publish(&names::request(&path), &type_name("Request"), &qos)?;
        let address = dds.reader_guid(reader).unwrap_or(GUID::GUID_UNKNOWN);
        Ok(Service { request: codec("Request")?, reply: codec("Response")?, path, writer, reader, address })
    }

    fn call(&self, request: &Value, dds: &Participant) -> Result<Ticket, DdsError> {
        let sample = self.request.write(request).map_err(|error| DdsError(error.to_string()))?;
        let related = SampleIdentity { writer_guid: self.address, sequence_number: SequenceNumber::UNKNOWN };
        match dds.write(self.writer, Sample(sample), Some(related))? {
            Some(sent) => Ok(Ticket { reader: self.reader, number: sent.sequence_number }),
            None => Err(DdsError(format!("service `{}` takes no calls", self.path))),
        }
    }

    fn is_served(&self, subscribers: &[Endpoint]) -> bool {
        let topic = names::request(&self.path);
        subscribers.iter().any(|endpoint| endpoint.topic == topic)
    }
}

impl Parameters {
    pub(crate) fn join(node: &str, dds: &mut Participant) -> Result<Self, DdsError> {
        Ok(Parameters {
            get: Service::join(node, "get_parameters", "GetParameters", dds)?,
            set: Service::join(node, "set_parameters", "SetParameters", dds)?,
        })
    }

    /// What is missing before a run, in a phrase.
    pub(crate) fn missing(&self, subscribers: &[Endpoint]) -> Option<String> {
        let unserved = [&self.get, &self.set].into_iter().find(|service| !service.is_served(subscribers))?;
        Some(format!("nobody serves `{}`", unserved.path))
    }

    /// Asks for the value of a parameter.
    pub(crate) fn ask(&self, name: &str, dds: &Participant) -> Result<Ticket, DdsError> {
        let names = Value::List(vec![Value::Text(Text::from(name))]);
        self.get.call(&Record::new(&Fields::new(["names"]), vec![names]).into(), dds)
    }

    /// The value in the reply; `None` if the node has no such parameter.
    pub(crate) fn asked(&self, reply: Arc<[u8]>) -> Option<ParameterValue> {
        let reply = self.get.reply.read(reply).ok()?;
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
        let reply = self.set.reply.read(reply).map_err(|error| error.to_string())?;
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
    /// The same parameter with this number; an error if it is none.
    pub(crate) fn with(&self, number: f64) -> Result<ParameterValue, String> {
        let mut value = self.0.clone();
        let (field, number) = match value.number_at(&["type"]) {
            Some(kind) if kind == DOUBLE as f64 => ("double_value", Value::Real(number)),
            #[expect(clippy::cast_possible_truncation, reason = "casts of reals saturate")]
            Some(kind) if kind == INTEGER as f64 => ("integer_value", Value::Int(number.round() as i64)),
            _ => return Err("it is not a number".to_owned()),
        };
        match value.at_mut(&[field]) {
            Some(place) => *place = number,
            None => return Err("it is not a number".to_owned()),
        }
        Ok(ParameterValue(value))
    }
}
