//! `.msg` and `.srv` files of ROS 1. They differ from those of ROS 2 in a few types, in constants, and in that an empty
//! message has no bytes.
//!
//! Names are those of ROS 2 (`std_msgs/msg/Header`), so that one catalogue serves both; [`type_name`] and [`interface`]
//! go from one to the other. `time` and `duration` are the interfaces `builtin_interfaces/msg/Time` and `Duration`
//! ([`builtin`]).

use sesame_plan::{Interface, Primitive, WireType};

use crate::msg::array;
use crate::{Constant, Definition, DefinitionError, Field, is_name};

/// The types of `time` and `duration`.
const TIMES: [(&str, &str); 2] =
    [("time", "builtin_interfaces/msg/Time"), ("duration", "builtin_interfaces/msg/Duration")];

/// What has a number in ROS 1 that it does not have in ROS 2.
const HEADER: &str = "std_msgs/msg/Header";

/// What stands in ROS 2 for a message without fields.
pub const NOTHING: &str = "structure_needs_at_least_one_member";

/// The most characters of a file.
const LONGEST: usize = 1 << 20;

/// The interface that a `.msg` file declares: package and name are those of its folder and of the file. An empty file
/// is an interface without fields.
pub fn msg(package: &str, name: &str, text: &str) -> Result<Definition, DefinitionError> {
    definition(package, format!("{package}/msg/{name}"), text, 1)
}

/// The interfaces of requests and replies that a `.srv` file declares: `NAME_Request` and `NAME_Response`.
pub fn srv(package: &str, name: &str, text: &str) -> Result<[Definition; 2], DefinitionError> {
    let [request, reply] = parts(text)?;
    let before = text.split('\n').count() - reply.split('\n').count();
    Ok([
        definition(package, format!("{package}/srv/{name}_Request"), &request, 1)?,
        definition(package, format!("{package}/srv/{name}_Response"), &reply, before + 1)?,
    ])
}

/// The text of a request and that of its reply in a `.srv` file.
pub fn parts(text: &str) -> Result<[String; 2], DefinitionError> {
    let lines: Vec<&str> = text.split('\n').collect();
    let middle = lines.iter().position(|line| line.trim() == "---").ok_or_else(|| DefinitionError {
        line: lines.len(),
        problem: "a line `---` between request and reply is missing".to_owned(),
    })?;
    Ok([lines[..middle].join("\n"), lines[middle + 1..].join("\n")])
}

/// The interfaces that stand for `time` and `duration`.
pub fn builtin() -> [Definition; 2] {
    TIMES.map(|(name, interface)| {
        let seconds = if name == "time" { Primitive::Uint32 } else { Primitive::Int32 };
        let fields = [("sec", seconds), ("nanosec", Primitive::Uint32)];
        let fields =
            fields.map(|(name, primitive)| Field { name: name.to_owned(), ty: WireType::Primitive { primitive } });
        Definition { name: interface.to_owned(), fields: fields.into(), constants: Vec::new() }
    })
}

/// A type as ROS 1 names it: `std_msgs/msg/Header` is `std_msgs/Header`.
pub fn type_name(interface: &str) -> String {
    interface.replacen("/msg/", "/", 1).replacen("/srv/", "/", 1)
}

/// The interface of a type of ROS 1: `std_msgs/Header` is `std_msgs/msg/Header`.
pub fn interface(type_name: &str) -> String {
    match type_name.split_once('/') {
        Some((package, name)) if !name.contains('/') => format!("{package}/msg/{name}"),
        _ => type_name.to_owned(),
    }
}

/// The text of a `.msg` file of ROS 1 that declares these fields, as far as a layout knows: without constants and
/// comments, and with `int8` and `uint8` where the file may say `byte` and `char`.
pub fn text(interface: &Interface) -> String {
    let fields = interface.fields.iter().filter(|field| field.name != NOTHING);
    let mut lines: Vec<String> = fields.map(|field| format!("{} {}\n", written(&field.ty), field.name)).collect();
    let is_header = interface.name == HEADER && interface.fields.iter().all(|field| field.name != "seq");
    if is_header {
        lines.insert(0, "uint32 seq\n".to_owned());
    }
    lines.concat()
}

/// A type as `.msg` files of ROS 1 write it.
fn written(ty: &WireType) -> String {
    match ty {
        WireType::Primitive { primitive } => primitive.name().to_owned(),
        WireType::String { .. } | WireType::WString { .. } => "string".to_owned(),
        WireType::Interface { name } => {
            let time = TIMES.iter().find(|(_, interface)| interface == name);
            time.map_or_else(|| type_name(name), |(word, _)| (*word).to_owned())
        }
        WireType::Array { of, length } => format!("{}[{length}]", written(of)),
        WireType::Sequence { of, .. } => format!("{}[]", written(of)),
    }
}

/// The types of other messages that a `.msg` file contains, as ROS 1 names them, in the order of its fields; a type
/// that is there twice is named twice.
pub fn contained(package: &str, text: &str) -> Result<Vec<String>, DefinitionError> {
    let lines = lines(text, 1)?;
    Ok(lines.iter().filter(|line| line.value.is_none()).filter_map(|line| message(package, line.ty)).collect())
}

/// The text whose MD5 identifies a type in ROS 1: constants and fields without comments, with the MD5 of each contained
/// type in the place of its name.
pub fn hashed_text(
    package: &str,
    text: &str,
    md5: &mut dyn FnMut(&str) -> Result<String, DefinitionError>,
) -> Result<String, DefinitionError> {
    let mut hashed: Vec<String> = Vec::new();
    let lines = lines(text, 1)?;
    for line in &lines {
        if let Some(value) = &line.value {
            hashed.push(format!("{} {}={value}", line.ty, line.name));
        }
    }
    for line in lines.iter().filter(|line| line.value.is_none()) {
        hashed.push(match message(package, line.ty) {
            Some(contained) => format!("{} {}", md5(&contained)?, line.name),
            None => format!("{} {}", line.ty, line.name),
        });
    }
    Ok(hashed.join("\n"))
}

/// A declaration.
struct Line<'a> {
    at: usize,
    ty: &'a str,
    name: &'a str,
    /// The value of a constant.
    value: Option<&'a str>,
}

impl Line<'_> {
    fn wrong(&self, problem: String) -> DefinitionError {
        DefinitionError { line: self.at, problem }
    }
}

fn lines(text: &str, first: usize) -> Result<Vec<Line<'_>>, DefinitionError> {
    if text.len() > LONGEST {
        return Err(DefinitionError { line: first, problem: format!("it has more than {LONGEST} characters") });
    }
    let mut lines = Vec::new();
    for (at, whole) in (first..).zip(text.split('\n')) {
        let clean = without_comment(whole);
        if clean.is_empty() {
            continue;
        }
        let wrong = |problem: String| DefinitionError { line: at, problem };
        let (ty, rest) =
            clean.split_once(char::is_whitespace).ok_or_else(|| wrong(format!("`{clean}` has no name")))?;
        let (name, value) = match rest.split_once('=') {
            // A text goes on to the end of the line, with the sign of comments and all.
            Some((name, _)) if ty == "string" => (name, whole.split_once('=').map(|(_, value)| value.trim())),
            Some((name, value)) => (name, Some(value.trim())),
            None => (rest, None),
        };
        let name = name.trim();
        if !is_name(name) {
            return Err(wrong(format!("`{name}` is not a field name")));
        }
        lines.push(Line { at, ty, name, value });
    }
    Ok(lines)
}

fn without_comment(line: &str) -> &str {
    line.split('#').next().unwrap_or_default().trim()
}

fn definition(package: &str, name: String, text: &str, first: usize) -> Result<Definition, DefinitionError> {
    let mut made = Definition { name, fields: Vec::new(), constants: Vec::new() };
    for line in lines(text, first)? {
        let ty = wire_type(package, line.ty).map_err(|problem| line.wrong(problem))?;
        if let Some(value) = line.value {
            made.constants.push(Constant { name: line.name.to_owned(), value: value.to_owned() });
        } else if made.fields.iter().any(|field| field.name == line.name) {
            return Err(line.wrong(format!("field `{}` is there twice", line.name)));
        } else {
            made.fields.push(Field { name: line.name.to_owned(), ty });
        }
    }
    Ok(made)
}

fn wire_type(package: &str, written: &str) -> Result<WireType, String> {
    array(written, &|element| {
        if let Some(primitive) = of_ros1(element) {
            return Ok(WireType::Primitive { primitive });
        }
        if element == "string" {
            return Ok(WireType::STRING);
        }
        if let Some((_, name)) = TIMES.iter().find(|(time, _)| *time == element) {
            return Ok(WireType::Interface { name: (*name).to_owned() });
        }
        // Names in small letters exist (`tf/tfMessage`), but without a package they are mistakes.
        let is_type = element.contains('/') || element.starts_with(|first: char| first.is_ascii_uppercase());
        let name = message(package, written).map(|name| interface(&name));
        let name = name.filter(|name| is_type && element.split('/').count() <= 2 && name.split('/').all(is_name));
        name.map(|name| WireType::Interface { name }).ok_or_else(|| format!("`{element}` is not a type of ROS 1"))
    })
}

/// The type of the message that a field contains, if it contains one.
fn message(package: &str, written: &str) -> Option<String> {
    let bare = written.split('[').next().unwrap_or_default();
    if of_ros1(bare).is_some() || bare == "string" || TIMES.iter().any(|(time, _)| *time == bare) {
        return None;
    }
    Some(match bare {
        // An array of them needs the package.
        "Header" if written == bare => "std_msgs/Header".to_owned(),
        name if name.contains('/') => name.to_owned(),
        name => format!("{package}/{name}"),
    })
}

/// A number of ROS 1, where a `byte` has a sign.
fn of_ros1(written: &str) -> Option<Primitive> {
    if written == "byte" { Some(Primitive::Int8) } else { Primitive::named(written) }
}

#[cfg(test)]
mod tests {
    use sesame_plan::InterfaceField;

    use super::*;

    fn text_of(name: &str, fields: &[(&str, &str)]) -> String {
        let field = |&(ty, name): &(&str, &str)| InterfaceField {
            name: name.to_owned(),
            ty: match ty {
                "string" => WireType::STRING,
                "uint32" => WireType::Primitive { primitive: Primitive::Uint32 },
                _ => WireType::Interface { name: ty.to_owned() },
            },
        };
        text(&Interface { name: name.to_owned(), fields: fields.iter().map(field).collect() })
    }

    #[test]
    fn a_header_has_a_number_and_nothing_else_gets_one() {
        let [stamp, frame] = [("builtin_interfaces/msg/Time", "stamp"), ("string", "frame_id")];
        let of_ros1 = "uint32 seq\ntime stamp\nstring frame_id\n";
        assert_eq!(text_of(HEADER, &[stamp, frame]), of_ros1, "ROS 2 has none");
        assert_eq!(text_of(HEADER, &[("uint32", "seq"), stamp, frame]), of_ros1);
        assert_eq!(text_of("made_up/msg/Header", &[stamp, frame]), "time stamp\nstring frame_id\n");
        assert_eq!(text_of("made_up/msg/Stamped", &[(HEADER, "header")]), "std_msgs/Header header\n");
        assert_eq!(text_of("std_msgs/msg/Empty", &[("uint32", NOTHING)]), "");
    }
}
