//! Messages of topics, between the JSON of a bridge and the values of the relay.
//!
//! Bridges write what JSON has no number for as `null`, lists of bytes in base64, and points and times as objects. ROS
//! 1 and ROS 2 differ in the names of the parts of a time: a space uses those of ROS 2.

use std::collections::BTreeMap;
use std::sync::Arc;

use base64::Engine as _;
use base64::engine::general_purpose::STANDARD;
use serde_json::{Map, Value as Json, json};

use sesame_plan::{CampaignPlan, Dialect, Interface, Primitive, TopicId, Type, WireType};
use sesame_relay::message::Mismatch;
use sesame_relay::value::{Fields, Record, Value};

use crate::bare;

/// The largest whole number up to which JSON's reals are exact.
const EXACT: f64 = 9_007_199_254_740_992.0;

/// The parts of a time: in ROS 1, in ROS 2.
const TIMES: [[&str; 2]; 2] = [["secs", "nsecs"], ["sec", "nanosec"]];

/// Reads and writes the messages of a plan's topics.
#[derive(Debug)]
pub struct Payloads {
    plan: CampaignPlan,
    dialect: Dialect,
    /// Per interface: a message of zeros.
    blanks: BTreeMap<String, Json>,
}

impl Payloads {
    /// The payloads of a plan, as a bridge to this ROS writes them. Each interface follows those that it contains.
    pub fn new(plan: &CampaignPlan, dialect: Dialect, interfaces: &[Interface]) -> Self {
        let mut blanks = BTreeMap::new();
        for interface in interfaces {
            let of_field = |ty: &WireType| blank(ty, dialect, &blanks);
            let fields: Map<String, Json> =
                interface.fields.iter().map(|field| (field.name.clone(), of_field(&field.ty))).collect();
            blanks.insert(interface.name.clone(), Json::Object(fields));
        }
        Payloads { plan: plan.clone(), dialect, blanks }
    }

    /// Reads a message of a topic. It keeps what came, so that what nobody changes is written as it was read.
    pub fn read(&self, topic: TopicId, message: &Json) -> Result<Value, Mismatch> {
        let value = self.value(&self.plan.topic(topic).ty, message)?;
        Ok(match value {
            Value::Record(record) => {
                let came = Arc::from(message.to_string().into_bytes());
                Value::Record(Record::decoded(record.fields(), record.values().to_vec(), came))
            }
            other => other,
        })
    }

    /// Writes a message of a topic as a text in JSON: changes are written into what came.
    pub fn write(&self, topic: TopicId, value: &Value) -> String {
        let mut message = match value {
            Value::Record(record) => match record.origin() {
                Some(origin) => {
                    let text = std::str::from_utf8(&origin.bytes).expect("JSON was made of text");
                    if record.unchanged().is_some() {
                        return text.to_owned();
                    }
                    serde_json::from_str(text).expect("it was written as JSON")
                }
                None => self.blank_of(topic),
            },
            // It came as JSON.
            Value::Opaque(bytes) => return String::from_utf8_lossy(bytes).into_owned(),
            _ => Json::Null,
        };
        self.patch(&mut message, value);
        message.to_string()
    }

    fn blank_of(&self, topic: TopicId) -> Json {
        let interface = self.plan.topic(topic).interface.as_ref();
        interface.and_then(|name| self.blanks.get(name)).cloned().unwrap_or_else(|| json!({}))
    }

    fn value(&self, ty: &Type, json: &Json) -> Result<Value, Mismatch> {
        let wrong = |expected| mismatch(expected, json);
        Ok(match ty {
            Type::Bool => Value::Bool(json.as_bool().ok_or_else(|| wrong("bool"))?),
            Type::Int { .. } => Value::Int(whole(json).ok_or_else(|| wrong("int"))?),
            Type::Real { .. } => Value::Real(real(json).ok_or_else(|| wrong("real"))?),
            Type::Text => Value::from(json.as_str().ok_or_else(|| wrong("text"))?),
            Type::Point { .. } => {
                let axis = |name: &str| {
                    let part = json.get(name).ok_or_else(|| Mismatch::missing(name))?;
                    real(part).ok_or_else(|| mismatch("real", part).inside(name))
                };
                if !json.is_object() {
                    return Err(wrong("point"));
                }
                Value::Point([axis("x")?, axis("y")?, axis("z")?])
            }
            Type::List { of } => match (json, &**of) {
                (Json::Array(items), of) => {
                    let item = |(at, item)| self.value(of, item).map_err(|error| error.inside(&format!("[{at}]")));
                    Value::List(items.iter().enumerate().map(item).collect::<Result<_, _>>()?)
                }
                (Json::String(text), Type::Int { .. }) => {
                    let bytes = STANDARD.decode(text).map_err(|_| wrong("list"))?;
                    Value::List(bytes.into_iter().map(|byte| Value::Int(byte.into())).collect())
                }
                _ => return Err(wrong("list")),
            },
            Type::Message { id } => {
                let Json::Object(entries) = json else { return Err(wrong("message")) };
                let declared = &self.plan.message(*id).fields;
                let mut values = Vec::with_capacity(entries.len());
                for (name, value) in entries {
                    let name = in_ros2(name, entries);
                    values.push(match declared.iter().find(|field| field.name == name) {
                        Some(field) => self.value(&field.ty, value).map_err(|error| error.inside(name))?,
                        None => Value::Undeclared(value.to_string().into()),
                    });
                }
                let there = |wanted: &str| entries.keys().any(|name| in_ros2(name, entries) == wanted);
                if let Some(absent) = declared.iter().find(|field| !there(&field.name)) {
                    return Err(Mismatch::missing(&absent.name));
                }
                let names = entries.keys().map(|name| in_ros2(name, entries));
                Value::Record(Record::new(&Fields::new(names), values))
            }
        })
    }

    /// Writes a value in place of another one, in the shape that is there.
    fn patch(&self, there: &mut Json, value: &Value) {
        match value {
            Value::Bool(truth) => *there = Json::from(*truth),
            Value::Int(number) => *there = Json::from(*number),
            Value::Real(number) => {
                // What JSON has no number for becomes `null`, or a bare word where the bridge wrote one.
                let word = bare::number(there).and_then(|_| bare::word(*number));
                *there = match time_names(there) {
                    Some(names) => time(*number, names),
                    None => word.unwrap_or_else(|| Json::from(*number)),
                };
            }
            Value::Text(text) => *there = Json::from(text.as_str()),
            Value::Point([x, y, z]) => *there = json!({ "x": x, "y": y, "z": z }),
            Value::List(items) => {
                if there.is_string()
                    && let Some(bytes) = items.iter().map(byte).collect::<Option<Vec<u8>>>()
                {
                    *there = Json::from(STANDARD.encode(bytes));
                    return;
                }
                let mut before = std::mem::take(there).as_array_mut().map(std::mem::take).unwrap_or_default();
                before.resize(items.len(), before.first().cloned().unwrap_or_default());
                for (there, item) in before.iter_mut().zip(items) {
                    self.patch(there, item);
                }
                *there = Json::Array(before);
            }
            Value::Record(record) => {
                if !there.is_object() {
                    *there = json!({});
                }
                let Json::Object(entries) = there else { return };
                let is_time = time_names(&Json::Object(entries.clone())).is_some();
                for (name, value) in record.iter() {
                    let name = if is_time { in_dialect(name, self.dialect) } else { name.as_str() };
                    self.patch(entries.entry(name).or_insert(Json::Null), value);
                }
            }
            Value::Undeclared(text) => *there = serde_json::from_str(text).unwrap_or(Json::Null),
            Value::Opaque(bytes) => *there = serde_json::from_slice(bytes).unwrap_or(Json::Null),
        }
    }
}

/// A value of zeros.
fn blank(ty: &WireType, dialect: Dialect, known: &BTreeMap<String, Json>) -> Json {
    match ty {
        WireType::Primitive { primitive: Primitive::Bool } => Json::from(false),
        WireType::Primitive { primitive: Primitive::Float32 | Primitive::Float64 } => Json::from(0.0),
        WireType::Primitive { .. } => Json::from(0),
        WireType::String { .. } | WireType::WString { .. } => Json::from(""),
        WireType::Interface { name } => match name.as_str() {
            "builtin_interfaces/msg/Time" | "builtin_interfaces/msg/Duration" => time(0.0, names_of(dialect)),
            name => known.get(name).cloned().unwrap_or_else(|| json!({})),
        },
        WireType::Array { of, length } => Json::Array(vec![blank(of, dialect, known); *length as usize]),
        WireType::Sequence { .. } => json!([]),
    }
}

/// A type of ROS 2 as this ROS calls it: `geometry_msgs/msg/Twist` is `geometry_msgs/Twist` in ROS 1.
pub fn type_name(interface: &str, dialect: Dialect) -> String {
    match dialect {
        Dialect::Ros1 => sesame_interfaces::ros1::type_name(interface),
        Dialect::Ros2 => interface.to_owned(),
    }
}

fn names_of(dialect: Dialect) -> [&'static str; 2] {
    match dialect {
        Dialect::Ros1 => TIMES[0],
        Dialect::Ros2 => TIMES[1],
    }
}

/// The names of the parts, if this is a time.
fn time_names(json: &Json) -> Option<[&'static str; 2]> {
    let entries = json.as_object()?;
    TIMES.into_iter().find(|names| entries.len() == names.len() && names.iter().all(|name| entries.contains_key(*name)))
}

/// A field of a bridge's message in the words of ROS 2. Only an object that is a time has other words.
fn in_ros2<'a>(name: &'a str, entries: &Map<String, Json>) -> &'a str {
    let is_time = entries.len() == 2 && TIMES[0].iter().all(|name| entries.contains_key(*name));
    match TIMES[0].iter().position(|known| is_time && *known == name) {
        Some(part) => TIMES[1][part],
        None => name,
    }
}

/// A part of a time in the words of this ROS.
fn in_dialect(name: &str, dialect: Dialect) -> &str {
    match TIMES[1].iter().position(|known| *known == name) {
        Some(part) => names_of(dialect)[part],
        None => name,
    }
}

/// A time of so many seconds. What has no such number is the nearest one that has.
fn time(seconds: f64, [whole, nanos]: [&str; 2]) -> Json {
    #[expect(clippy::cast_possible_truncation, reason = "it is limited to what fits")]
    let total = (seconds * 1e9).round().clamp(-2e18, 2e18) as i64;
    json!({ whole: total.div_euclid(1_000_000_000), nanos: total.rem_euclid(1_000_000_000) })
}

/// A real number; `null`, or a bare word, stands for what JSON has no number for. A time is a number of seconds.
fn real(json: &Json) -> Option<f64> {
    match time_names(json) {
        Some([whole, nanos]) => Some(json[whole].as_i64()? as f64 + json[nanos].as_i64()? as f64 * 1e-9),
        None if json.is_null() => Some(f64::NAN),
        None => json.as_f64().or_else(|| bare::number(json)),
    }
}

/// A whole number in any notation: some languages have no other numbers than reals.
fn whole(json: &Json) -> Option<i64> {
    #[expect(clippy::cast_possible_truncation, reason = "it is whole and within the exact range")]
    json.as_i64().or_else(|| {
        json.as_f64().filter(|number| number.fract() == 0.0 && number.abs() <= EXACT).map(|number| number as i64)
    })
}

fn byte(value: &Value) -> Option<u8> {
    match value {
        Value::Int(number) => u8::try_from(*number).ok(),
        _ => None,
    }
}

fn mismatch(expected: &'static str, json: &Json) -> Mismatch {
    let found = match json {
        Json::Null => "null",
        Json::Bool(_) => "bool",
        Json::Number(_) if expected == "int" => "a number that is not whole, or too large",
        Json::Number(_) => "a number",
        Json::String(_) if bare::number(json).is_some() => "a number that is not finite",
        Json::String(_) => "text",
        Json::Array(_) => "a list",
        Json::Object(_) => "an object",
    };
    Mismatch { path: Vec::new(), expected, found }
}

#[cfg(test)]
mod tests {
    use sesame_plan::testing::{field, message, plan, topic};
    use sesame_plan::{InterfaceField, MessageId, Topic};

    use super::*;

    const REAL: Type = Type::Real { unit: None };
    const INT: Type = Type::Int { unit: None };

    /// Topic 0 has messages with a stamp in parts, one in seconds, a level, a point and bytes.
    fn payloads(dialect: Dialect) -> Payloads {
        let mut plan = plan(Vec::new());
        plan.messages = vec![
            message("Time", vec![field("sec", INT), field("nanosec", INT)]),
            message(
                "Reading",
                vec![
                    field("stamp", Type::Message { id: MessageId(0) }),
                    field("seen", REAL),
                    field("level", REAL),
                    field("at", Type::Point { unit: None }),
                    field("data", Type::List { of: Box::new(INT) }),
                ],
            ),
        ];
        let reading = topic("reading", &["/reading"], Type::Message { id: MessageId(1) });
        plan.topics = vec![Topic { interface: Some("a/msg/Reading".to_owned()), ..reading }];
        let interface = |name: &str| WireType::Interface { name: name.to_owned() };
        let number = |primitive| WireType::Primitive { primitive };
        let layout = |name: &str, fields: Vec<(&str, WireType)>| Interface {
            name: name.to_owned(),
            fields: fields.into_iter().map(|(name, ty)| InterfaceField { name: name.to_owned(), ty }).collect(),
        };
        let axes = ["x", "y", "z"].map(|axis| (axis, number(Primitive::Float64)));
        let time = "builtin_interfaces/msg/Time";
        let interfaces = [
            layout(time, vec![("sec", number(Primitive::Int32)), ("nanosec", number(Primitive::Uint32))]),
            layout("a/msg/Point", axes.to_vec()),
            layout(
                "a/msg/Reading",
                vec![
                    ("stamp", interface(time)),
                    ("seen", interface(time)),
                    ("level", number(Primitive::Float64)),
                    ("at", interface("a/msg/Point")),
                    ("data", WireType::Sequence { of: Box::new(number(Primitive::Uint8)), bound: None }),
                ],
            ),
        ];
        Payloads::new(&plan, dialect, &interfaces)
    }

    fn reading(stamp: &Json, level: &Json) -> Json {
        json!({
            "at": { "x": 1.0, "y": 2.0, "z": -0.5 }, "data": "AAH/", "extra": [null, "x"], "level": level,
            "seen": stamp, "stamp": stamp
        })
    }

    #[test]
    fn numbers_that_json_does_not_have_are_read_and_stay_where_they_are() {
        let payloads = payloads(Dialect::Ros2);
        let stamp = json!({ "sec": 1, "nanosec": 5 });
        let read = |level: &str| {
            let text = reading(&stamp, &json!("LEVEL")).to_string().replace("\"LEVEL\"", level);
            let json = parsed(&bare::marked(&text).unwrap_or(text));
            payloads.read(TopicId(0), &json).unwrap()
        };
        let level = |value: &Value| value.number_at(&["level"]).unwrap();
        assert!(level(&read("NaN")).is_nan() && level(&read("null")).is_nan());
        assert_eq!(level(&read("-Infinity")), f64::NEG_INFINITY);
        let written = |value: &Value| bare::unmarked(payloads.write(TopicId(0), value));
        assert!(written(&read("Infinity")).contains(r#""level":Infinity,"#));
        let mut changed = read("Infinity");
        let Value::Record(record) = &mut changed else { unreachable!() };
        *record.get_mut("seen").unwrap() = Value::Real(2.5);
        assert!(written(&changed).contains(r#""level":Infinity,"#), "what is beside a change");
        let Value::Record(record) = &mut changed else { unreachable!() };
        *record.get_mut("level").unwrap() = Value::Real(f64::NAN);
        assert!(written(&changed).contains(r#""level":NaN,"#), "as the bridge writes it");
        let mut null = read("null");
        let Value::Record(record) = &mut null else { unreachable!() };
        *record.get_mut("level").unwrap() = Value::Real(f64::INFINITY);
        assert!(written(&null).contains(r#""level":null,"#), "JSON has no word for it");
    }

    fn parsed(text: &str) -> Json {
        serde_json::from_str(text).unwrap()
    }

    #[test]
    fn both_kinds_of_ros_are_read_alike_and_written_as_they_came() {
        for (dialect, stamp) in
            [(Dialect::Ros1, json!({"nsecs": 5, "secs": 7})), (Dialect::Ros2, json!({"nanosec": 5, "sec": 7}))]
        {
            let payloads = payloads(dialect);
            let came = reading(&stamp, &json!(1.5));
            let mut value = payloads.read(TopicId(0), &came).unwrap();
            assert_eq!(value.number_at(&["stamp", "nanosec"]), Some(5.0));
            assert_eq!(value.number_at(&["seen"]), Some(7.000_000_005));
            assert_eq!(value.number_at(&["at", "z"]), Some(-0.5));
            assert_eq!(value.at(&["data"]), Some(&Value::List([0, 1, 255].map(Value::Int).to_vec())));
            assert_eq!(payloads.write(TopicId(0), &value), came.to_string());

            let [whole, nanos] = names_of(dialect);
            *value.at_mut(&["seen"]).unwrap() = Value::Real(8.25);
            *value.at_mut(&["stamp", "sec"]).unwrap() = Value::Int(9);
            *value.at_mut(&["data"]).unwrap() = Value::List(vec![Value::Int(7)]);
            let mut expected = came;
            expected["seen"] = json!({ whole: 8, nanos: 250_000_000 });
            expected["stamp"] = json!({ whole: 9, nanos: 5 });
            expected["data"] = json!("Bw==");
            assert_eq!(parsed(&payloads.write(TopicId(0), &value)), expected);
        }
    }

    #[test]
    fn a_message_that_never_came_is_written_by_its_layout() {
        let payloads = payloads(Dialect::Ros1);
        let point = Value::Point([1.0, 2.0, 3.0]);
        let made = Record::new(&Fields::new(["seen", "at", "level"]), vec![(-0.5).into(), point, 2.0.into()]);
        let written = parsed(&payloads.write(TopicId(0), &Value::Record(made)));
        let expected = json!({
            "at": { "x": 1.0, "y": 2.0, "z": 3.0 }, "data": [], "level": 2.0,
            "seen": { "secs": -1, "nsecs": 500_000_000 }, "stamp": { "secs": 0, "nsecs": 0 }
        });
        assert_eq!(written, expected);
    }

    #[test]
    fn null_stands_for_a_number_that_is_not_finite() {
        let payloads = payloads(Dialect::Ros2);
        let came = reading(&json!({"sec": 0, "nanosec": 0}), &Json::Null);
        let mut value = payloads.read(TopicId(0), &came).unwrap();
        assert!(value.number_at(&["level"]).unwrap().is_nan());
        *value.at_mut(&["level"]).unwrap() = Value::Real(f64::INFINITY);
        assert_eq!(parsed(&payloads.write(TopicId(0), &value))["level"], Json::Null);
    }

    #[test]
    fn what_does_not_fit_says_where_and_what() {
        let payloads = payloads(Dialect::Ros2);
        let said = |json: Json| payloads.read(TopicId(0), &json).unwrap_err().to_string();
        let stamp = json!({"sec": 0, "nanosec": 0});
        assert_eq!(said(reading(&stamp, &json!("1"))), "field `level`: expected real, found text");
        let mut half = reading(&stamp, &json!(1));
        half["stamp"] = json!({"sec": 0.5, "nanosec": 0});
        assert_eq!(said(half), "field `stamp.sec`: expected int, found a number that is not whole, or too large");
        let mut part = reading(&stamp, &json!(1));
        part["stamp"] = json!({"sec": 1});
        assert_eq!(said(part), "field `stamp.nanosec`: expected a value, found nothing");
        let mut bytes = reading(&stamp, &json!(1));
        bytes["data"] = json!("not base64!");
        assert_eq!(said(bytes), "field `data`: expected list, found text");
    }

    #[test]
    fn types_are_named_as_each_ros_names_them() {
        assert_eq!(type_name("geometry_msgs/msg/Twist", Dialect::Ros1), "geometry_msgs/Twist");
        assert_eq!(type_name("geometry_msgs/Twist", Dialect::Ros1), "geometry_msgs/Twist");
        assert_eq!(type_name("geometry_msgs/msg/Twist", Dialect::Ros2), "geometry_msgs/msg/Twist");
    }
}
