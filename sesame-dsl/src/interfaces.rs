//! Definitions of messages in files: where they come from; and the names of interfaces of ROS, with those that need no
//! file.
//!
//! This crate reads no files, so whoever calls it hands over [`Interfaces`].

use sesame_plan::{Dialect, Interface, InterfaceField, Primitive, WireType};

/// Where definitions of messages come from: the layouts of ROS interfaces, and what a dialect of `MAVLink` has.
pub trait Interfaces {
    /// The layout of an interface such as `sensor_msgs/msg/JointState`, or of one that a service or an action consists
    /// of, such as `std_srvs/srv/SetBool_Request`: last in a list in which each comes after those that it contains.
    /// `None` if no folder has it; an error is a clause such as "it cannot be read".
    fn find(&self, folders: Folders<'_>, name: &str) -> Result<Option<Vec<Interface>>, String>;

    /// The constants of an interface that are numbers or texts, in declared order; none if no folder has it.
    fn constants(&self, folders: Folders<'_>, name: &str) -> Vec<Constant> {
        let _ = (folders, name);
        Vec::new()
    }

    /// The messages that these files define, and those that they include. The files are relative to the folder of the
    /// `.sesame` file `beside`. `None` where no files are read, so that nothing is known of any message.
    fn dialect(&self, files: &[String], beside: &str) -> Result<Option<Vec<DialectMessage>>, Vec<UnusableFile>> {
        let _ = (files, beside);
        Ok(None)
    }
}

/// A message of a dialect of `MAVLink`.
#[derive(Debug, Clone, PartialEq)]
pub struct DialectMessage {
    /// Its fields.
    pub interface: Interface,
    /// The values that a field may have by name, with the name of that field.
    pub constants: Vec<(String, Constant)>,
}

impl DialectMessage {
    /// A message with these fields; `entries` are the names of fields, with a name and the number of a value of each.
    pub fn new<'e>(interface: Interface, entries: impl Iterator<Item = (&'e str, &'e str, u64)>) -> Self {
        let constants = entries.map(|(field, name, number)| {
            #[expect(clippy::cast_precision_loss, reason = "large values are bits of masks, which are powers of two")]
            let value = ConstantValue::Number(number as f64);
            (field.to_owned(), Constant { name: name.to_owned(), value })
        });
        DialectMessage { interface, constants: constants.collect() }
    }
}

/// A value with a name, which messages of a type have in their fields.
#[derive(Debug, Clone, PartialEq)]
pub struct Constant {
    /// Its name.
    pub name: String,
    /// Its value.
    pub value: ConstantValue,
}

/// The value of a constant.
#[derive(Debug, Clone, PartialEq)]
pub enum ConstantValue {
    /// A number; finite.
    Number(f64),
    /// A text.
    Text(String),
}

/// A file of a dialect that cannot be used, or includes one that cannot.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct UnusableFile {
    /// Its position among the files that were asked for.
    pub named: usize,
    /// Why, in a clause such as "it is not XML".
    pub why: String,
}

/// Folders that hold packages.
#[derive(Debug, Clone, Copy)]
pub struct Folders<'a> {
    /// As written, in the order in which they are searched.
    pub written: &'a [String],
    /// The name of the file that names them; they are relative to its folder.
    pub file: &'a str,
    /// The ROS that their files are for: a `.msg` file of ROS 1 has types that ROS 2 does not have.
    pub dialect: Dialect,
}

/// No files: only interfaces that need none are known.
#[derive(Debug, Clone, Copy, Default)]
pub struct NoInterfaces;

impl Interfaces for NoInterfaces {
    fn find(&self, _: Folders<'_>, _: &str) -> Result<Option<Vec<Interface>>, String> {
        Ok(None)
    }
}

/// What interfaces consist of: their kind, the kind of those, and the ends of their names.
const CONSISTS_OF: [(&str, &str, &[&str]); 3] = [
    ("srv", "msg", &["_Request", "_Response"]),
    ("action", "srv", &["_SendGoal", "_GetResult"]),
    (
        "action",
        "msg",
        &[
            "_Goal",
            "_Result",
            "_Feedback",
            "_FeedbackMessage",
            "_SendGoal_Request",
            "_SendGoal_Response",
            "_GetResult_Request",
            "_GetResult_Response",
        ],
    ),
];

/// The interface that has a definition of its own: for `std_srvs/srv/SetBool_Request`, it is `std_srvs/srv/SetBool`.
pub fn defined_in(name: &str) -> &str {
    let kind = name.split('/').nth(1);
    let of = CONSISTS_OF.iter().filter(|(whole, part, _)| kind == Some(whole) && *part == "msg");
    let mut ends = of.flat_map(|(.., ends)| *ends);
    ends.find_map(|end| name.strip_suffix(end)).unwrap_or(name)
}

/// The full name of an interface of a kind, `msg`, `srv` or `action`: `sensor_msgs/JointState` is short for
/// `sensor_msgs/msg/JointState`. What services and actions consist of are interfaces too, such as
/// `std_srvs/srv/SetBool_Request`. `None` if it cannot be the name of one. ROS 1 allows underscores and small letters
/// where ROS 2 does not: `ublox_msgs/CfgGNSS_Block`, `tf/tfMessage`.
pub fn full_name(written: &str, kind: &str, dialect: Dialect) -> Option<String> {
    let parts: Vec<&str> = written.split('/').collect();
    let (package, whole, name, end) = match parts[..] {
        [package, name] => (package, kind, name, ""),
        [package, of, name] if of == kind => (package, kind, name, ""),
        [package, of, name] => {
            let ends = CONSISTS_OF.iter().filter(|(whole, part, _)| *whole == of && *part == kind);
            let mut ends = ends.flat_map(|(.., ends)| *ends);
            let (name, end) = ends.find_map(|end| Some((name.strip_suffix(end)?, *end)))?;
            (package, of, name, end)
        }
        _ => return None,
    };
    let package_fits = package.starts_with(|first: char| first.is_ascii_lowercase())
        && package.bytes().all(|byte| byte.is_ascii_lowercase() || byte.is_ascii_digit() || byte == b'_');
    let of_ros1 = dialect == Dialect::Ros1;
    let name_fits = name.starts_with(|first: char| first.is_ascii_uppercase() || of_ros1 && first.is_ascii_lowercase())
        && name.bytes().all(|byte| byte.is_ascii_alphanumeric() || of_ros1 && byte == b'_');
    (package_fits && name_fits).then(|| format!("{package}/{whole}/{name}{end}"))
}

/// Interfaces that are the same in every distribution of ROS, with their fields as in a `.msg` file.
const KNOWN: &[(&str, &[(&str, &str)])] = &[
    (
        "action_msgs/msg/GoalInfo",
        &[("unique_identifier_msgs/msg/UUID", "goal_id"), ("builtin_interfaces/msg/Time", "stamp")],
    ),
    ("action_msgs/msg/GoalStatus", &[("action_msgs/msg/GoalInfo", "goal_info"), ("int8", "status")]),
    ("action_msgs/msg/GoalStatusArray", &[("action_msgs/msg/GoalStatus[]", "status_list")]),
    ("action_msgs/srv/CancelGoal_Request", &[("action_msgs/msg/GoalInfo", "goal_info")]),
    (
        "action_msgs/srv/CancelGoal_Response",
        &[("int8", "return_code"), ("action_msgs/msg/GoalInfo[]", "goals_canceling")],
    ),
    ("builtin_interfaces/msg/Time", &[("int32", "sec"), ("uint32", "nanosec")]),
    ("builtin_interfaces/msg/Duration", &[("int32", "sec"), ("uint32", "nanosec")]),
    ("geometry_msgs/msg/Point", &[("float64", "x"), ("float64", "y"), ("float64", "z")]),
    ("geometry_msgs/msg/Point32", &[("float32", "x"), ("float32", "y"), ("float32", "z")]),
    ("geometry_msgs/msg/Vector3", &[("float64", "x"), ("float64", "y"), ("float64", "z")]),
    ("std_msgs/msg/Bool", &[("bool", "data")]),
    ("std_msgs/msg/Float32", &[("float32", "data")]),
    ("std_msgs/msg/Float64", &[("float64", "data")]),
    ("std_msgs/msg/Header", &[("builtin_interfaces/msg/Time", "stamp"), ("string", "frame_id")]),
    ("std_msgs/msg/Int32", &[("int32", "data")]),
    ("std_msgs/msg/Int64", &[("int64", "data")]),
    ("std_msgs/msg/String", &[("string", "data")]),
    ("std_srvs/srv/Empty_Request", &[]),
    ("std_srvs/srv/Empty_Response", &[]),
    ("std_srvs/srv/SetBool_Request", &[("bool", "data")]),
    ("std_srvs/srv/SetBool_Response", &[("bool", "success"), ("string", "message")]),
    ("std_srvs/srv/Trigger_Request", &[]),
    ("std_srvs/srv/Trigger_Response", &[("bool", "success"), ("string", "message")]),
    ("unique_identifier_msgs/msg/UUID", &[("uint8[16]", "uuid")]),
];

/// An interface that needs no file, after those that it contains.
pub fn known(name: &str) -> Option<Vec<Interface>> {
    let (_, fields) = KNOWN.iter().find(|(known, _)| *known == name)?;
    let mut found = Vec::new();
    let mut of = Vec::new();
    for (ty, field) in *fields {
        let ty = wire_type(ty, Dialect::Ros2).expect("the table has types");
        if let WireType::Interface { name } = innermost(&ty) {
            found.extend(known(name).expect("the table has what its interfaces contain"));
        }
        of.push(InterfaceField { name: (*field).to_owned(), ty });
    }
    found.push(interface(name.to_owned(), of));
    Some(found)
}

/// The constants of interfaces that need no file.
const CONSTANTS: &[(&str, &[(&str, f64)])] = &[(
    "action_msgs/msg/GoalStatus",
    &[
        ("STATUS_UNKNOWN", 0.0),
        ("STATUS_ACCEPTED", 1.0),
        ("STATUS_EXECUTING", 2.0),
        ("STATUS_CANCELING", 3.0),
        ("STATUS_SUCCEEDED", 4.0),
        ("STATUS_CANCELED", 5.0),
        ("STATUS_ABORTED", 6.0),
    ],
)];

/// The constants of an interface that needs no file.
pub(crate) fn known_constants(name: &str) -> Vec<Constant> {
    let of = CONSTANTS.iter().filter(|(known, _)| *known == name).flat_map(|(_, constants)| *constants);
    of.map(|(name, value)| Constant { name: (*name).to_owned(), value: ConstantValue::Number(*value) }).collect()
}

/// What is on the wire of an interface without fields. It means nothing, so the language does not show it.
pub const NO_FIELDS: &str = "structure_needs_at_least_one_member";

/// An interface of these fields; without any, it has the one that is on the wire in their place.
pub(crate) fn interface(name: String, mut fields: Vec<InterfaceField>) -> Interface {
    if fields.is_empty() {
        let ty = WireType::Primitive { primitive: Primitive::Uint8 };
        fields.push(InterfaceField { name: NO_FIELDS.to_owned(), ty });
    }
    Interface { name, fields }
}

/// A type as it is written in a `.msg` file, such as `uint8`, `float64[36]`, `string<=10` or `geometry_msgs/Point[]`.
pub fn wire_type(written: &str, dialect: Dialect) -> Option<WireType> {
    let (base, array) = match written.split_once('[') {
        Some((base, rest)) => (base, Some(rest.strip_suffix(']')?)),
        None => (written, None),
    };
    let number =
        |digits: &str| digits.parse::<u32>().ok().filter(|_| digits.bytes().all(|digit| digit.is_ascii_digit()));
    let of = match base.split_once("<=") {
        Some(("string", bound)) => WireType::String { bound: Some(number(bound)?) },
        Some(("wstring", bound)) => WireType::WString { bound: Some(number(bound)?) },
        Some(_) => return None,
        None => scalar(base, dialect)?,
    };
    let Some(array) = array else { return Some(of) };
    let of = Box::new(of);
    if array.is_empty() {
        return Some(WireType::Sequence { of, bound: None });
    }
    match array.strip_prefix("<=") {
        Some(bound) => Some(WireType::Sequence { of, bound: Some(number(bound)?) }),
        None => Some(WireType::Array { of, length: number(array)? }),
    }
}

fn scalar(name: &str, dialect: Dialect) -> Option<WireType> {
    match name {
        "string" => Some(WireType::STRING),
        "wstring" => Some(WireType::WSTRING),
        _ => match Primitive::named(name) {
            Some(primitive) => Some(WireType::Primitive { primitive }),
            None => full_name(name, "msg", dialect).map(|name| WireType::Interface { name }),
        },
    }
}

/// The names of types that are not interfaces, for suggestions.
pub(crate) const SCALARS: [&str; 15] = [
    "bool", "int8", "uint8", "byte", "char", "int16", "uint16", "int32", "uint32", "int64", "uint64", "float32",
    "float64", "string", "wstring",
];

/// Whether messages of this layout are points: exactly x, y and z, all in one precision.
pub fn is_point(interface: &Interface) -> bool {
    let [x, y, z] = &interface.fields[..] else { return false };
    let named = [x, y, z].iter().map(|field| field.name.as_str()).eq(["x", "y", "z"]);
    let real = [Primitive::Float32, Primitive::Float64]
        .iter()
        .any(|&primitive| [x, y, z].iter().all(|field| field.ty == WireType::Primitive { primitive }));
    named && real
}

/// Whether it is a time or a duration in seconds and nanoseconds.
pub fn is_time(name: &str) -> bool {
    matches!(name, "builtin_interfaces/msg/Time" | "builtin_interfaces/msg/Duration")
}

/// What a message of a layout contains, lists and arrays aside.
pub fn innermost(ty: &WireType) -> &WireType {
    match ty {
        WireType::Array { of, .. } | WireType::Sequence { of, .. } => innermost(of),
        _ => ty,
    }
}

/// A type as a `.msg` file has it.
pub fn in_words(ty: &WireType) -> String {
    match ty {
        WireType::Primitive { primitive } => primitive.name().to_owned(),
        WireType::String { bound: None } => "string".to_owned(),
        WireType::String { bound: Some(bound) } => format!("string<={bound}"),
        WireType::WString { bound: None } => "wstring".to_owned(),
        WireType::WString { bound: Some(bound) } => format!("wstring<={bound}"),
        WireType::Interface { name } => name.clone(),
        WireType::Array { of, length } => format!("{}[{length}]", in_words(of)),
        WireType::Sequence { of, bound: None } => format!("{}[]", in_words(of)),
        WireType::Sequence { of, bound: Some(bound) } => format!("{}[<={bound}]", in_words(of)),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_of_types_are_completed_and_checked() {
        let of_ros2 = |written: &str, kind: &str| full_name(written, kind, Dialect::Ros2);
        assert_eq!(of_ros2("sensor_msgs/JointState", "msg").as_deref(), Some("sensor_msgs/msg/JointState"));
        assert_eq!(of_ros2("std_srvs/srv/SetBool", "srv").as_deref(), Some("std_srvs/srv/SetBool"));
        for wrong in ["JointState", "a/srv/B", "A/B", "a/b", "a//B", "a/msg/b/C", "a/msg/B_C", "", "1a/B", "a/B "] {
            assert_eq!(of_ros2(wrong, "msg"), None, "{wrong}");
        }
        for (written, full) in [("tf/tfMessage", "tf/msg/tfMessage"), ("a/B_C", "a/msg/B_C")] {
            assert_eq!(full_name(written, "msg", Dialect::Ros1).as_deref(), Some(full));
            assert_eq!(of_ros2(written, "msg"), None, "{written}");
        }
        for wrong in ["a/_B", "a/B-C", "a/1B"] {
            assert_eq!(full_name(wrong, "msg", Dialect::Ros1), None, "{wrong}");
        }
    }

    #[test]
    fn what_services_and_actions_consist_of_has_types_too() {
        let of_ros2 = |written: &str, kind: &str| full_name(written, kind, Dialect::Ros2);
        for (part, whole) in [
            ("std_srvs/srv/SetBool_Request", "std_srvs/srv/SetBool"),
            ("a/action/B_Feedback", "a/action/B"),
            ("a/action/B_FeedbackMessage", "a/action/B"),
            ("a/action/B_SendGoal_Response", "a/action/B"),
            ("a/action/B_GetResult_Request", "a/action/B"),
        ] {
            assert_eq!(of_ros2(part, "msg").as_deref(), Some(part));
            assert_eq!(defined_in(part), whole);
        }
        for service in ["a/action/B_SendGoal", "a/action/B_GetResult"] {
            assert_eq!(of_ros2(service, "srv").as_deref(), Some(service));
        }
        assert_eq!(of_ros2("a/B", "action").as_deref(), Some("a/action/B"));
        for wrong in ["a/action/B", "a/action/B_Request", "a/action/_Goal", "a/action/B_C_Goal", "a/msg/B_Goal"] {
            assert_eq!(of_ros2(wrong, "msg"), None, "{wrong}");
        }
        assert_eq!(defined_in("a/msg/B"), "a/msg/B");
    }

    #[test]
    fn types_on_the_wire_are_those_of_msg_files() {
        for text in ["uint8", "float64[36]", "string[]", "int8[<=5]", "wstring", "geometry_msgs/msg/Point[2]"] {
            assert_eq!(in_words(&wire_type(text, Dialect::Ros2).unwrap()), text);
        }
        assert_eq!(wire_type("byte", Dialect::Ros2), wire_type("uint8", Dialect::Ros2));
        assert_eq!(wire_type("string<=10", Dialect::Ros2), Some(WireType::String { bound: Some(10) }));
        for wrong in ["uint", "float64[", "float64[-1]", "float64[<]", "int8<=5", "float64[+3]", "float64[3][3]", ""] {
            assert_eq!(wire_type(wrong, Dialect::Ros2), None, "{wrong}");
        }
    }

    #[test]
    fn what_is_known_comes_after_what_it_contains() {
        let header = known("std_msgs/msg/Header").unwrap();
        let names: Vec<&str> = header.iter().map(|interface| interface.name.as_str()).collect();
        assert_eq!(names, ["builtin_interfaces/msg/Time", "std_msgs/msg/Header"]);
        for (name, fields) in KNOWN {
            assert_eq!(known(name).unwrap().last().unwrap().fields.len(), fields.len().max(1));
        }
        assert!(is_point(known("geometry_msgs/msg/Point32").unwrap().last().unwrap()));
        assert!(!is_point(header.last().unwrap()));
        let status = known("action_msgs/msg/GoalStatusArray").unwrap();
        let names: Vec<&str> = status.iter().map(|interface| interface.name.rsplit('/').next().unwrap()).collect();
        assert_eq!(names, ["UUID", "Time", "GoalInfo", "GoalStatus", "GoalStatusArray"]);
    }
}
