//! What the services of rosapi say, of ROS 1 and of ROS 2: read from JSON that anybody may have written.

use serde_json::Value as Json;
use sesame_interfaces::ros1::interface;
use sesame_plan::{Interface, InterfaceField, Primitive, WireType};

/// The most names that are taken of a list.
pub(super) const MOST_NAMES: usize = 10_000;

/// The most types that are taken of a description, and the most fields of each.
const MOST_TYPES: usize = 500;
const MOST_FIELDS: usize = 1000;

/// The longest array of a fixed length.
const LONGEST: i64 = 1 << 20;

/// What a node does.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub(super) struct Details {
    pub(super) publishes: Vec<String>,
    pub(super) subscribes: Vec<String>,
    pub(super) serves: Vec<String>,
}

/// A text of an answer.
pub(super) fn text(answer: &Json, field: &str) -> Option<String> {
    answer.get(field)?.as_str().filter(|text| !text.is_empty()).map(str::to_owned)
}

/// A list of texts of an answer; none if there is none.
pub(super) fn texts(answer: &Json, field: &str) -> Vec<String> {
    let items = answer.get(field).and_then(Json::as_array).map(Vec::as_slice).unwrap_or_default();
    items.iter().take(MOST_NAMES).filter_map(|item| item.as_str().map(str::to_owned)).collect()
}

/// Topics with their types, which are empty where the answer does not have as many.
pub(super) fn topics(answer: &Json) -> Vec<(String, String)> {
    let (topics, types) = (texts(answer, "topics"), texts(answer, "types"));
    let fits = topics.len() == types.len();
    let types = types.into_iter().map(Some).chain(std::iter::repeat(None));
    topics.into_iter().zip(types).map(|(topic, ty)| (topic, ty.filter(|_| fits).unwrap_or_default())).collect()
}

/// What `node_details` says.
pub(super) fn details(answer: &Json) -> Details {
    Details {
        publishes: texts(answer, "publishing"),
        subscribes: texts(answer, "subscribing"),
        serves: texts(answer, "services"),
    }
}

/// What `message_details` says: the layout of the type, and of those that it contains. `None` if a part of it cannot be
/// understood, so that half a layout is never taken for a whole one.
pub(super) fn layouts(answer: &Json) -> Option<Vec<Interface>> {
    let typedefs = answer.get("typedefs")?.as_array()?;
    if typedefs.is_empty() || typedefs.len() > MOST_TYPES {
        return None;
    }
    // A time is described as if it were a message.
    let is_time = |typedef: &&Json| matches!(typedef.get("type").and_then(Json::as_str), Some("time" | "duration"));
    typedefs.iter().filter(|typedef| !is_time(typedef)).map(layout).collect()
}

/// The layout of one type.
fn layout(typedef: &Json) -> Option<Interface> {
    let name = typedef.get("type")?.as_str()?;
    let list = |field: &str| typedef.get(field).and_then(Json::as_array);
    let (names, types, lengths) = (list("fieldnames")?, list("fieldtypes")?, list("fieldarraylen")?);
    if names.len() > MOST_FIELDS || names.len() != types.len() || names.len() != lengths.len() {
        return None;
    }
    let fields = names.iter().zip(types).zip(lengths).map(|((name, ty), length)| {
        let name = name.as_str()?;
        // Some versions tell how the class in Python stores a field.
        let name = name.strip_prefix('_').filter(|rest| !rest.is_empty()).unwrap_or(name);
        let of = Box::new(scalar(ty.as_str()?)?);
        let ty = match length.as_i64()? {
            ..=-1 => *of,
            0 => WireType::Sequence { of, bound: None },
            length @ 1..=LONGEST => WireType::Array { of, length: u32::try_from(length).ok()? },
            _ => return None,
        };
        Some(InterfaceField { name: name.to_owned(), ty })
    });
    Some(Interface { name: interface(name), fields: fields.collect::<Option<_>>()? })
}

/// The type of a value, in the words of either ROS; of a bounded sequence or text without the bound.
fn scalar(written: &str) -> Option<WireType> {
    let base = written.split([',', '<']).next().unwrap_or_default().trim();
    let interface_of = |name: &str| Some(WireType::Interface { name: name.to_owned() });
    let primitive = match base {
        "boolean" => Primitive::Bool,
        "octet" => Primitive::Uint8,
        "float" => Primitive::Float32,
        "double" => Primitive::Float64,
        "string" => return Some(WireType::STRING),
        "wstring" => return Some(WireType::WSTRING),
        "time" => return interface_of("builtin_interfaces/msg/Time"),
        "duration" => return interface_of("builtin_interfaces/msg/Duration"),
        name if name.contains('/') => return interface_of(&interface(name)),
        name => Primitive::named(name)?,
    };
    Some(WireType::Primitive { primitive })
}
