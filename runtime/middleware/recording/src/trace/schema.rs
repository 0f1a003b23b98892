//! JSON Schemas of the payloads in a trace.

use serde_json::{Value as Json, json};

use sesame_plan::{CampaignPlan, Type};

/// The name and text of the schema for messages of a declared type. A type that is not an object becomes one with the
/// field `value`, since readers expect objects.
pub(super) fn of_messages(plan: &CampaignPlan, ty: &Type) -> (String, Vec<u8>) {
    let name = name(plan, ty);
    let mut schema = match ty {
        Type::Message { .. } => of_type(plan, ty),
        _ => value_alone(of_type(plan, ty)),
    };
    schema["title"] = name.clone().into();
    (name, text(&schema))
}

/// The schema of the actions of operations.
pub(super) fn of_operations() -> (String, Vec<u8>) {
    let described = |ty: &str, words: &str| json!({ "type": ty, "description": words });
    let schema = json!({
        "title": "sesame.Operation",
        "type": "object",
        "properties": {
            "operation": described("string", "its name in the space"),
            "position": described("integer", "its position in the test, from 0"),
            "did": { "enum": ["started", "ended", "changed", "dropped", "delayed"] },
            "topic": described("string", "of the message it touched"),
            "message": described("integer", "sequence number of the message it touched, on the topic's channel"),
            "until_s": described("number", "simulation time until which the message is held back, in seconds"),
        },
        "required": ["operation", "position", "did"],
    });
    ("sesame.Operation".to_owned(), text(&schema))
}

/// The schema of a metric's change points.
pub(super) fn of_metric(unit: Option<&str>) -> (String, Vec<u8>) {
    let name = in_unit("sesame.Metric", unit);
    let mut schema = value_alone(number(unit));
    schema["title"] = name.clone().into();
    (name, text(&schema))
}

fn text(schema: &Json) -> Vec<u8> {
    schema.to_string().into_bytes()
}

/// An object with only a value of this schema.
fn value_alone(schema: Json) -> Json {
    let mut object = json!({ "type": "object", "required": ["value"] });
    object["properties"]["value"] = schema;
    object
}

fn number(unit: Option<&str>) -> Json {
    // NaN and infinity are strings, since JSON has no numbers for them.
    let mut schema = json!({ "type": "number" });
    if let Some(unit) = unit {
        schema["description"] = format!("in {unit}").into();
    }
    schema
}

fn in_unit(name: &str, unit: Option<&str>) -> String {
    unit.map_or_else(|| name.to_owned(), |unit| format!("{name}[{unit}]"))
}

/// A type as the language names it.
fn name(plan: &CampaignPlan, ty: &Type) -> String {
    match ty {
        Type::Bool => "bool".to_owned(),
        Type::Text => "text".to_owned(),
        Type::Int { unit } => in_unit("int", unit.as_deref()),
        Type::Real { unit } => in_unit("real", unit.as_deref()),
        Type::Point { unit } => in_unit("point", unit.as_deref()),
        Type::List { of } => format!("list of {}", name(plan, of)),
        Type::Message { id } => plan.message(*id).name.clone(),
    }
}

fn of_type(plan: &CampaignPlan, ty: &Type) -> Json {
    match ty {
        Type::Bool => json!({ "type": "boolean" }),
        Type::Text => json!({ "type": "string" }),
        Type::Int { unit } => {
            let mut schema = number(unit.as_deref());
            schema["type"] = "integer".into();
            schema
        }
        Type::Real { unit } => number(unit.as_deref()),
        Type::Point { unit } => {
            json!({ "type": "array", "items": number(unit.as_deref()), "minItems": 3, "maxItems": 3 })
        }
        Type::List { of } => json!({ "type": "array", "items": of_type(plan, of) }),
        Type::Message { id } => {
            let message = plan.message(*id);
            let described = |schema: Json, doc: &str| {
                let mut schema = schema;
                if !doc.is_empty() {
                    let unit = schema["description"].as_str().map(|unit| format!(" ({unit})")).unwrap_or_default();
                    schema["description"] = format!("{doc}{unit}").into();
                }
                schema
            };
            let properties: serde_json::Map<String, Json> = message
                .fields
                .iter()
                .map(|field| (field.name.clone(), described(of_type(plan, &field.ty), &field.doc)))
                .collect();
            let required: Vec<&str> = message.fields.iter().map(|field| field.name.as_str()).collect();
            described(json!({ "type": "object", "properties": properties, "required": required }), &message.doc)
        }
    }
}
