//! Types of messages. The files of the original platform name them and seldom say what is in them, so the common ones
//! are known here, with the fields that metrics and operations ask for; a message may hold more than is declared.

use std::collections::BTreeMap;
use std::fmt::Write as _;

use crate::naming::{Names, is_field};
use crate::original::{FieldOfType, Original, Reference, TypeOfValue};
use crate::xml::printable;

/// Message types by their names: fields with a primitive, another type here, or a list (`[]`) of one.
const COMMON: &[(&str, &[(&str, &str)])] = &[
    ("SafetyZone", &[("zone", "text"), ("level", "real"), ("object1", "text"), ("object2", "text")]),
    ("std_msgs/Bool", &[("data", "bool")]),
    ("std_msgs/String", &[("data", "text")]),
    ("std_msgs/Int32", &[("data", "int")]),
    ("std_msgs/Int64", &[("data", "int")]),
    ("std_msgs/Float32", &[("data", "real")]),
    ("std_msgs/Float64", &[("data", "real")]),
    ("std_msgs/Float64MultiArray", &[("data", "[]real")]),
    ("geometry_msgs/Vector3", &[("x", "real"), ("y", "real"), ("z", "real")]),
    ("geometry_msgs/Point", &[("x", "real"), ("y", "real"), ("z", "real")]),
    ("geometry_msgs/Quaternion", &[("x", "real"), ("y", "real"), ("z", "real"), ("w", "real")]),
    ("geometry_msgs/Twist", &[("linear", "geometry_msgs/Vector3"), ("angular", "geometry_msgs/Vector3")]),
    ("geometry_msgs/TwistStamped", &[("twist", "geometry_msgs/Twist")]),
    ("geometry_msgs/TwistWithCovariance", &[("twist", "geometry_msgs/Twist")]),
    ("geometry_msgs/Pose", &[("position", "geometry_msgs/Point"), ("orientation", "geometry_msgs/Quaternion")]),
    ("geometry_msgs/PoseStamped", &[("pose", "geometry_msgs/Pose")]),
    ("geometry_msgs/PoseWithCovariance", &[("pose", "geometry_msgs/Pose")]),
    ("geometry_msgs/PoseWithCovarianceStamped", &[("pose", "geometry_msgs/PoseWithCovariance")]),
    (
        "nav_msgs/Odometry",
        &[("pose", "geometry_msgs/PoseWithCovariance"), ("twist", "geometry_msgs/TwistWithCovariance")],
    ),
    ("nav_msgs/Path", &[("poses", "[]geometry_msgs/PoseStamped")]),
    (
        "sensor_msgs/LaserScan",
        &[
            ("angle_min", "real"),
            ("angle_max", "real"),
            ("angle_increment", "real"),
            ("range_min", "real"),
            ("range_max", "real"),
            ("ranges", "[]real"),
        ],
    ),
    (
        "turtlesim/Pose",
        &[("x", "real"), ("y", "real"), ("theta", "real"), ("linear_velocity", "real"), ("angular_velocity", "real")],
    ),
];

/// A type in the `.sesame` file.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) enum Type {
    Real,
    Int,
    Bool,
    Text,
    List(Box<Type>),
    /// Position in [`Messages`].
    Message(usize),
}

#[derive(Debug)]
struct MessageType {
    name: String,
    fields: Vec<(String, Type)>,
}

/// The message types of a file, as they are needed.
#[derive(Debug, Default)]
pub(crate) struct Messages {
    list: Vec<MessageType>,
    known: BTreeMap<String, usize>,
}

impl Messages {
    /// The type of a variable.
    pub(crate) fn of(&mut self, original: &Original, ty: Option<Reference>, names: &mut Names) -> Type {
        match ty.and_then(|ty| original.ty(ty)) {
            None => Type::Real,
            Some(ty) if ty.text => text_type(&ty.name),
            Some(ty) => self.declared(original, ty, names, 0),
        }
    }

    fn declared(&mut self, original: &Original, ty: &TypeOfValue, names: &mut Names, depth: u32) -> Type {
        // In ROS 2 a type's name says that it is a message.
        let name = ty.name.replace("/msg/", "/");
        if let Some(primitive) = primitive(&name) {
            return primitive;
        }
        if let Some(common) = self.common(&name, names) {
            return common;
        }
        if let Some(&known) = self.known.get(&name) {
            return Type::Message(known);
        }
        let at = self.add(&name, names);
        let fields = self.fields(original, &ty.fields, &name, names, depth);
        self.list[at].fields = fields;
        Type::Message(at)
    }

    /// Fields as the file has them. On the wire their names are in small letters.
    fn fields(
        &mut self,
        original: &Original,
        declared: &[FieldOfType],
        of: &str,
        names: &mut Names,
        depth: u32,
    ) -> Vec<(String, Type)> {
        let mut fields: Vec<(String, Type)> = Vec::new();
        for field in declared {
            let name = field.name.to_ascii_lowercase();
            if !is_field(&name) || fields.iter().any(|(other, _)| *other == name) {
                continue;
            }
            let ty = if field.fields.is_empty() {
                match field.ty.and_then(|ty| original.ty(ty)) {
                    Some(ty) if ty.text => text_type(&ty.name),
                    // Types that hold each other end somewhere.
                    Some(ty) if depth < 8 && !self.known.contains_key(&ty.name) => {
                        let ty = ty.clone();
                        self.declared(original, &ty, names, depth + 1)
                    }
                    _ => continue,
                }
            } else {
                let inner = format!("{of} {name}");
                let at = self.add(&inner, names);
                let inner = self.fields(original, &field.fields, &inner, names, depth + 1);
                self.list[at].fields = inner;
                Type::Message(at)
            };
            fields.push((name, ty));
        }
        fields
    }

    fn common(&mut self, name: &str, names: &mut Names) -> Option<Type> {
        let ends = |full: &str| full == name || full.rsplit('/').next() == Some(name);
        let (full, fields) = COMMON.iter().find(|(full, _)| ends(full))?;
        if let Some(&known) = self.known.get(*full) {
            return Some(Type::Message(known));
        }
        let fields = fields.iter().map(|(field, ty)| {
            let (list, ty) = ty.strip_prefix("[]").map_or((false, *ty), |ty| (true, ty));
            let ty = primitive(ty).or_else(|| self.common(ty, names)).expect("the table holds what it mentions");
            ((*field).to_owned(), if list { Type::List(Box::new(ty)) } else { ty })
        });
        let fields = fields.collect();
        let at = self.add(full, names);
        self.list[at].fields = fields;
        Some(Type::Message(at))
    }

    fn add(&mut self, name: &str, names: &mut Names) -> usize {
        let short = name.rsplit('/').next().unwrap_or_default();
        let at = self.list.len();
        self.list.push(MessageType { name: names.take(short, "Message"), fields: Vec::new() });
        self.known.insert(name.to_owned(), at);
        at
    }

    /// Makes sure that a path leads from a type to a number, if need be by declaring fields on the way. A step may name
    /// an element of a list, `objects[0]`. The error says what stands in the way.
    pub(crate) fn reach(&mut self, from: &Type, path: &[String], names: &mut Names) -> Result<(), String> {
        let mut ty = from.clone();
        for (at, step) in path.iter().enumerate() {
            let Type::Message(message) = ty else { return Err(format!("there is no field `{}`", printable(step))) };
            let (name, in_list) = field_of(step)?;
            let found = self.list[message].fields.iter().find(|(field, _)| field == name).map(|(_, ty)| ty.clone());
            let field = if let Some(found) = found {
                found
            } else {
                let new = if at + 1 == path.len() {
                    Type::Real
                } else {
                    let inner = format!("{}_{name}", self.list[message].name);
                    Type::Message(self.add(&inner, names))
                };
                let new = if in_list { Type::List(Box::new(new)) } else { new };
                self.list[message].fields.push((name.to_owned(), new.clone()));
                new
            };
            ty = match field {
                Type::List(element) if in_list => *element,
                _ if in_list => return Err(format!("`{name}` is not a list")),
                field => field,
            };
        }
        match ty {
            Type::Real | Type::Int => Ok(()),
            _ => Err("it does not name a number".to_owned()),
        }
    }

    /// What follows a topic of this type where a condition reads the one truth in it: nothing, or a field.
    pub(crate) fn truth(&self, ty: &Type) -> Option<String> {
        match ty {
            Type::Bool => Some(String::new()),
            Type::Message(at) => match &self.list[*at].fields[..] {
                [(field, Type::Bool)] => Some(format!(".{field}")),
                _ => None,
            },
            _ => None,
        }
    }

    /// A type in the words of the language.
    pub(crate) fn words(&self, ty: &Type) -> String {
        match ty {
            Type::Real => "real".to_owned(),
            Type::Int => "int".to_owned(),
            Type::Bool => "bool".to_owned(),
            Type::Text => "text".to_owned(),
            Type::List(of) => format!("list of {}", self.words(of)),
            Type::Message(at) => self.list[*at].name.clone(),
        }
    }

    /// Names of messages of which no field is known.
    pub(crate) fn empty(&self) -> Vec<&str> {
        self.list.iter().filter(|message| message.fields.is_empty()).map(|message| message.name.as_str()).collect()
    }

    /// All messages in the words of the language. One without a known field gets one to be replaced.
    pub(crate) fn write(&self) -> String {
        let mut text = String::new();
        for message in &self.list {
            if message.fields.is_empty() {
                text.push_str("  // The file does not say what it holds: declare the fields that you need.\n");
                let _ = writeln!(text, "  message {} {{ undeclared: text }}", message.name);
                continue;
            }
            let fields: Vec<String> =
                message.fields.iter().map(|(name, ty)| format!("{name}: {}", self.words(ty))).collect();
            let _ = writeln!(text, "  message {} {{ {} }}", message.name, fields.join("  "));
        }
        text
    }
}

/// The field that a step of a path names, and whether the step goes on to an element of it.
fn field_of(step: &str) -> Result<(&str, bool), String> {
    let (name, position) = match step.split_once('[') {
        Some((name, rest)) => (name, Some(rest.strip_suffix(']').unwrap_or_default())),
        None => (step, None),
    };
    if !is_field(name) {
        return Err(format!("`{}` is not the name of a field", printable(step)));
    }
    let is_position = |text: &str| (1..=6).contains(&text.len()) && text.bytes().all(|byte| byte.is_ascii_digit());
    match position {
        Some(position) if !is_position(position) => {
            Err(format!("`{}` does not name an element of a list", printable(step)))
        }
        position => Ok((name, position.is_some())),
    }
}

fn primitive(name: &str) -> Option<Type> {
    match name {
        "real" | "double" | "float" | "float32" | "float64" => Some(Type::Real),
        "int" | "int8" | "int16" | "int32" | "int64" | "uint8" | "uint16" | "uint32" | "uint64" => Some(Type::Int),
        "bool" | "boolean" => Some(Type::Bool),
        "text" | "string" => Some(Type::Text),
        _ => None,
    }
}

/// The type of what is a single text on the wire of the original, by the name of its type: `doubleEncodedAsString`.
fn text_type(name: &str) -> Type {
    let name = name.to_ascii_lowercase();
    if name.starts_with("bool") {
        Type::Bool
    } else if name.starts_with("int") || name.starts_with("long") {
        Type::Int
    } else if name.starts_with("string") || name.starts_with("text") {
        Type::Text
    } else {
        Type::Real
    }
}
