//! Payloads read by their declared types.

use std::borrow::Cow;
use std::collections::BTreeMap;
use std::fmt;
use std::sync::Arc;

use serde::de::{Deserialize, Deserializer, MapAccess, Visitor};
use serde_json::value::RawValue;

use sesame_plan::{CampaignPlan, MessageId, Type};

use super::{int, mismatch, real};
use crate::message::Mismatch;
use crate::value::{Fields, Record, Text, Value};

/// The latest field names per message type, so that all records of a type share them.
#[derive(Debug, Default)]
pub struct Shapes(BTreeMap<MessageId, Arc<Fields>>);

/// Reads a payload of a declared type.
pub fn decode(plan: &CampaignPlan, shapes: &mut Shapes, ty: &Type, json: &RawValue) -> Result<Value, Mismatch> {
    let text = json.get();
    match ty {
        Type::Bool => match text {
            "true" => Ok(Value::Bool(true)),
            "false" => Ok(Value::Bool(false)),
            _ => Err(mismatch("bool", text)),
        },
        Type::Int { .. } => int(text).map(Value::Int),
        Type::Real { .. } => real(text).map(Value::Real),
        Type::Text => match serde_json::from_str::<Cow<'_, str>>(text) {
            Ok(found) => Ok(Value::Text(found.into_owned().into())),
            Err(_) => Err(mismatch("text", text)),
        },
        Type::Point { .. } => {
            let Ok([x, y, z]) = serde_json::from_str::<[&RawValue; 3]>(text) else {
                return Err(mismatch("point", text));
            };
            let axis = |name: &str, value: &RawValue| real(value.get()).map_err(|mismatch| mismatch.inside(name));
            Ok(Value::Point([axis("x", x)?, axis("y", y)?, axis("z", z)?]))
        }
        Type::List { of } => {
            let items: Vec<&RawValue> = serde_json::from_str(text).map_err(|_| mismatch("list", text))?;
            let items = items.into_iter().enumerate().map(|(at, item)| {
                decode(plan, shapes, of, item).map_err(|mismatch| mismatch.inside(&format!("[{at}]")))
            });
            items.collect::<Result<_, _>>().map(Value::List)
        }
        Type::Message { id } => record(plan, shapes, *id, text).map(Value::Record),
    }
}

fn record(plan: &CampaignPlan, shapes: &mut Shapes, id: MessageId, text: &str) -> Result<Record, Mismatch> {
    let Object(entries) = serde_json::from_str(text).map_err(|_| mismatch("message", text))?;
    let declared = &plan.message(id).fields;
    let mut values = Vec::with_capacity(entries.len());
    for (at, (name, value)) in entries.iter().enumerate() {
        if entries[..at].iter().any(|(before, _)| before == name) {
            let twice = Mismatch { path: Vec::new(), expected: "one value", found: "two" };
            return Err(twice.inside(name));
        }
        values.push(match declared.iter().find(|field| field.name == *name) {
            Some(field) if field.optional && value.get() == "null" => Value::Undeclared(Text::from("null")),
            Some(field) => decode(plan, shapes, &field.ty, value).map_err(|mismatch| mismatch.inside(name))?,
            None => Value::Undeclared(Text::from(value.get())),
        });
    }
    let required = || declared.iter().filter(|field| !field.optional);
    if let Some(missing) = required().find(|field| entries.iter().all(|(name, _)| *name != field.name)) {
        return Err(Mismatch::missing(&missing.name));
    }
    let same = |fields: &Arc<Fields>| {
        fields.names().len() == entries.len()
            && fields.names().iter().zip(&entries).all(|(known, (name, _))| **known == **name)
    };
    let fields = if let Some(fields) = shapes.0.get(&id).filter(|&fields| same(fields)) {
        Arc::clone(fields)
    } else {
        let fields = Fields::new(entries.iter().map(|(name, _)| name.as_ref()));
        shapes.0.insert(id, Arc::clone(&fields));
        fields
    };
    Ok(Record::new(&fields, values))
}

/// The entries of an object, in their order, including duplicates.
struct Object<'a>(Vec<(Cow<'a, str>, &'a RawValue)>);

impl<'de> Deserialize<'de> for Object<'de> {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        struct Entries;
        impl<'de> Visitor<'de> for Entries {
            type Value = Object<'de>;
            fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
                f.write_str("an object")
            }
            fn visit_map<A: MapAccess<'de>>(self, mut map: A) -> Result<Object<'de>, A::Error> {
                let mut entries = Vec::with_capacity(map.size_hint().unwrap_or(8));
                while let Some((Name(name), value)) = map.next_entry()? {
                    entries.push((name, value));
                }
                Ok(Object(entries))
            }
        }
        deserializer.deserialize_map(Entries)
    }
}

/// A name, borrowed unless it has escapes.
#[derive(serde::Deserialize)]
struct Name<'a>(#[serde(borrow)] Cow<'a, str>);

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use sesame_plan::testing::{field, message};

    use super::*;
    use crate::json::encode;

    const REAL: Type = Type::Real { unit: None };
    const INT: Type = Type::Int { unit: None };
    const POINT: Type = Type::Point { unit: None };

    /// Message 0 is `Inner { level: real, count: int }`, message 1 `Outer { inner: Inner, at: point, tags: list of text
    /// }`.
    fn plan() -> CampaignPlan {
        let mut plan = sesame_plan::testing::plan(Vec::new());
        let tags = Type::List { of: Box::new(Type::Text) };
        let inner = Type::Message { id: MessageId(0) };
        plan.messages.push(message("Outer", vec![field("inner", inner), field("at", POINT), field("tags", tags)]));
        plan
    }

    fn read(ty: &Type, json: &str) -> Result<Value, String> {
        let raw: &RawValue = serde_json::from_str(json).unwrap();
        decode(&plan(), &mut Shapes::default(), ty, raw).map_err(|mismatch| mismatch.to_string())
    }

    fn written(value: &Value) -> String {
        let mut out = Vec::new();
        encode(value, &mut out);
        String::from_utf8(out).unwrap()
    }

    #[test]
    fn scalars_are_read_by_their_declared_type() {
        assert_eq!(read(&REAL, "1"), Ok(Value::Real(1.0)));
        assert_eq!(read(&REAL, "-2.5e-3"), Ok(Value::Real(-0.0025)));
        assert_eq!(read(&INT, "9007199254740993"), Ok(Value::Int(9_007_199_254_740_993)));
        assert_eq!(read(&INT, "3.0"), Ok(Value::Int(3)));
        assert_eq!(read(&Type::Bool, "true"), Ok(Value::Bool(true)));
        assert_eq!(read(&Type::Text, r#""a\n\"b\"""#), Ok(Value::from("a\n\"b\"")));
        assert_eq!(read(&POINT, "[1, 2.5, -3]"), Ok(Value::Point([1.0, 2.5, -3.0])));
    }

    #[test]
    fn what_json_has_no_number_for_is_a_text_in_place_of_a_real() {
        assert!(matches!(read(&REAL, r#""NaN""#), Ok(Value::Real(x)) if x.is_nan()));
        assert_eq!(
            read(&POINT, r#"[0, "Infinity", "-Infinity"]"#).map(|value| written(&value)).unwrap(),
            r#"[0.0,"Infinity","-Infinity"]"#
        );
        assert_eq!(written(&Value::Real(f64::NAN)), r#""NaN""#);
    }

    #[test]
    fn misfits_say_where_and_what() {
        let outer = Type::Message { id: MessageId(1) };
        let said = [
            read(&REAL, r#""1""#),
            read(&REAL, "1e999"),
            read(&INT, "2.5"),
            read(&INT, "9223372036854775808"),
            read(&Type::Bool, "1"),
            read(&Type::Text, "null"),
            read(&POINT, "[1, 2]"),
            read(&outer, "[]"),
            read(&outer, r#"{"inner": {"level": 1, "count": 2}, "tags": []}"#),
            read(&outer, r#"{"inner": {"level": true, "count": 2}, "at": [0,0,0], "tags": []}"#),
            read(&outer, r#"{"inner": {"level": 1, "count": 2}, "at": [0,0,{}], "tags": []}"#),
            read(&outer, r#"{"inner": {"level": 1, "count": 2}, "at": [0,0,0], "tags": ["a", 1]}"#),
            read(&outer, r#"{"inner": {"level": 1, "level": 1, "count": 2}, "at": [0,0,0], "tags": []}"#),
        ]
        .map(|result| result.expect_err("it does not fit"));
        insta::assert_snapshot!(said.join("\n"));
    }

    #[test]
    fn what_is_not_declared_is_passed_on_byte_for_byte() {
        let zone = Type::Message { id: MessageId(0) };
        let json = r#"{"seq":18446744073709551615,"level":1.5,"extra":{ "a" : [1.50, null ] },"count":2,"none":null}"#;
        let value = read(&zone, json).unwrap();
        assert_eq!(value.number_at(&["level"]), Some(1.5));
        assert_eq!(written(&value), json);
    }

    #[test]
    fn records_of_a_kind_share_their_names() {
        let (plan, mut shapes) = (plan(), Shapes::default());
        let mut record = |json: &str| {
            let raw: &RawValue = serde_json::from_str(json).unwrap();
            match decode(&plan, &mut shapes, &Type::Message { id: MessageId(0) }, raw) {
                Ok(Value::Record(record)) => record,
                other => panic!("{other:?}"),
            }
        };
        let first = record(r#"{"level": 1, "count": 2}"#);
        let second = record(r#"{"level": 3, "count": 4}"#);
        let other = record(r#"{"count": 4, "level": 3}"#);
        assert!(Arc::ptr_eq(first.fields(), second.fields()));
        assert_eq!(other.fields().names()[0], "count");
    }

    proptest! {
        /// Whatever a message holds, what is written is read back the same, and is one line.
        #[test]
        fn what_is_written_is_read_back(
            level in any::<f64>().prop_filter("NaN is not equal to itself", |x| !x.is_nan()),
            count in any::<i64>(),
            at in any::<[f64; 3]>().prop_filter("as above", |axes| axes.iter().all(|x| !x.is_nan())),
            tags in prop::collection::vec("\\PC{0,6}|[\\x00-\\x7f]{0,6}", 0..4),
        ) {
            let inner = Record::new(&Fields::new(["level", "count"]), vec![Value::Real(level), Value::Int(count)]);
            let tags = tags.iter().map(|tag| Value::from(tag.as_str())).collect();
            let value = Value::Record(Record::new(
                &Fields::new(["inner", "at", "tags"]),
                vec![Value::Record(inner), Value::Point(at), Value::List(tags)],
            ));
            let json = written(&value);
            prop_assert!(!json.contains('\n'));
            prop_assert_eq!(read(&Type::Message { id: MessageId(1) }, &json), Ok(value));
        }
    }
}
