//! An interface with everything that it contains in one text, as recordings hold it: the definition of the interface,
//! then those of the others, each below a line of `=` and a line with its name.

use std::fmt::Write as _;

use sesame_plan::{Interface, Primitive, WireType};

use crate::{Catalogue, Definition, DefinitionError, Field, definition, idl, msg, ros1};

/// The line between two definitions.
const SEPARATOR: &str = "================================================================================";

/// Shorter lines of `=` are part of a comment that somebody underlined.
const SHORTEST: usize = 40;

/// The most bytes of a text.
const LONGEST: usize = 1 << 24;

/// In which language definitions are written.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Notation {
    /// `.msg` files of ROS 2.
    Msg,
    /// `.idl` files of ROS 2.
    Idl,
    /// `.msg` files of ROS 1.
    Ros1,
}

impl Notation {
    /// Each with the name that MCAP has for it.
    pub const ALL: [(Notation, &'static str); 3] =
        [(Notation::Msg, "ros2msg"), (Notation::Idl, "ros2idl"), (Notation::Ros1, "ros1msg")];

    /// The notation of a name.
    pub fn named(name: &str) -> Option<Notation> {
        Self::ALL.iter().find(|(_, known)| *known == name).map(|(notation, _)| *notation)
    }
}

/// The interfaces of a text, and the full name of the one that it is of: `std_msgs/msg/Header` of `std_msgs/Header`.
///
/// What every system of ROS has may be missing in the text: times, and what ROS 2 adds to events of services.
pub fn read(notation: Notation, name: &str, text: &str) -> Result<(Catalogue, String), DefinitionError> {
    if text.len() > LONGEST {
        return Err(DefinitionError { line: 1, problem: format!("it has more than {LONGEST} bytes") });
    }
    let name = full(name).ok_or_else(|| DefinitionError { line: 1, problem: format!("`{name}` is not a type") })?;
    let mut catalogue = Catalogue::default();
    for part in parts(&name, text) {
        let lines = |mut error: DefinitionError| {
            error.line += part.line - 1;
            error
        };
        let known = full(&part.name);
        let wrong = || DefinitionError { line: part.line, problem: format!("`{}` is not a type", part.name) };
        for definition in definitions(notation, &known.ok_or_else(wrong)?, &part.text).map_err(lines)? {
            catalogue.add(definition);
        }
    }
    match notation {
        Notation::Ros1 => ros1::builtin().into_iter().for_each(|definition| catalogue.add(definition)),
        Notation::Msg | Notation::Idl => everywhere().into_iter().for_each(|definition| catalogue.add(definition)),
    }
    Ok((catalogue, name))
}

/// The text of an interface with those that it contains, as far as a layout knows it: without constants and comments.
/// The interfaces are in the order of a layout, so the last one is the one that the text is of.
pub fn written(notation: Notation, interfaces: &[Interface]) -> String {
    let mut text = String::new();
    for (at, interface) in interfaces.iter().rev().enumerate() {
        // In ROS 1, times are words of the language.
        if notation == Notation::Ros1 && ros1::builtin().iter().any(|builtin| builtin.name == interface.name) {
            continue;
        }
        if at > 0 {
            writeln!(text, "{SEPARATOR}\nMSG: {}", short(&interface.name)).expect("a text takes everything");
        }
        match notation {
            Notation::Ros1 => text.push_str(&ros1::text(interface)),
            Notation::Msg | Notation::Idl => text.push_str(&of_ros2(interface)),
        }
    }
    text
}

/// A part of a text, with the line where it begins.
struct Part {
    name: String,
    line: usize,
    text: String,
}

fn parts(name: &str, text: &str) -> Vec<Part> {
    let mut parts = vec![Part { name: name.to_owned(), line: 1, text: String::new() }];
    let mut separated = false;
    for (at, line) in (1..).zip(text.lines()) {
        let bare = line.trim();
        if bare.len() >= SHORTEST && bare.bytes().all(|byte| byte == b'=') {
            separated = true;
            continue;
        }
        let head = bare.strip_prefix("MSG:").or_else(|| bare.strip_prefix("IDL:"));
        if let Some(head) = head.filter(|_| separated) {
            parts.push(Part { name: head.trim().to_owned(), line: at + 1, text: String::new() });
        } else if let Some(part) = parts.last_mut() {
            part.text.push_str(line);
            part.text.push('\n');
        }
        separated = false;
    }
    // In IDL, the first definition has a head too.
    if parts.len() > 1 && parts[0].text.trim().is_empty() && parts[1..].iter().any(|part| part.name == name) {
        parts.remove(0);
    }
    parts
}

/// A name with package and kind; a name without a kind, as older recordings have it, is that of a message.
pub fn full(name: &str) -> Option<String> {
    match *name.split('/').collect::<Vec<_>>() {
        [package, name] if !package.is_empty() && !name.is_empty() => Some(format!("{package}/msg/{name}")),
        [package, kind @ ("msg" | "srv" | "action"), last] if !package.is_empty() && !last.is_empty() => {
            Some(format!("{package}/{kind}/{last}"))
        }
        _ => None,
    }
}

/// A name as texts have it: messages without their kind.
fn short(name: &str) -> String {
    name.replacen("/msg/", "/", 1)
}

fn definitions(notation: Notation, name: &str, text: &str) -> Result<Vec<Definition>, DefinitionError> {
    if notation == Notation::Idl {
        return idl(text);
    }
    let (package, rest) = name.split_once('/').unwrap_or_default();
    let (kind, last) = rest.split_once('/').unwrap_or_default();
    if notation == Notation::Ros1 {
        return Ok(vec![Definition { name: name.to_owned(), ..ros1::msg(package, last, text)? }]);
    }
    // A recorded event of a service comes with the definition of the service.
    if kind == "srv"
        && let Some(service) = last.strip_suffix("_Event").or(Some(last)).filter(|_| text.lines().any(is_middle))
    {
        let [request, reply] = crate::srv(package, service, text)?;
        let event = event(package, service);
        return Ok(vec![request, reply, event]);
    }
    Ok(vec![Definition { name: name.to_owned(), ..msg(package, last, text)? }])
}

fn is_middle(line: &str) -> bool {
    line.trim() == "---"
}

fn field(name: &str, ty: WireType) -> Field {
    Field { name: name.to_owned(), ty }
}

/// What ROS 2 records of a call of a service.
fn event(package: &str, service: &str) -> Definition {
    let of = |name: String| Box::new(WireType::Interface { name });
    let at_most_one =
        |part: &str| WireType::Sequence { of: of(format!("{package}/srv/{service}_{part}")), bound: Some(1) };
    let info = WireType::Interface { name: "service_msgs/msg/ServiceEventInfo".to_owned() };
    let fields =
        vec![field("info", info), field("request", at_most_one("Request")), field("response", at_most_one("Response"))];
    definition(format!("{package}/srv/{service}_Event"), fields, Vec::new())
}

/// What every system of ROS 2 has.
fn everywhere() -> [Definition; 3] {
    let number = |primitive| WireType::Primitive { primitive };
    let time = |name: &str| {
        let fields = vec![field("sec", number(Primitive::Int32)), field("nanosec", number(Primitive::Uint32))];
        definition(format!("builtin_interfaces/msg/{name}"), fields, Vec::new())
    };
    let stamp = WireType::Interface { name: "builtin_interfaces/msg/Time".to_owned() };
    let fields = vec![
        field("event_type", number(Primitive::Uint8)),
        field("stamp", stamp),
        field("client_gid", WireType::Array { of: Box::new(number(Primitive::Uint8)), length: 16 }),
        field("sequence_number", number(Primitive::Int64)),
    ];
    let info = definition("service_msgs/msg/ServiceEventInfo".to_owned(), fields, Vec::new());
    [time("Time"), time("Duration"), info]
}

/// The text of a `.msg` file of ROS 2 that declares these fields.
fn of_ros2(interface: &Interface) -> String {
    let fields = interface.fields.iter().filter(|field| field.name != ros1::NOTHING);
    let lines: Vec<String> = fields.map(|field| format!("{} {}\n", type_in_ros2(&field.ty), field.name)).collect();
    lines.concat()
}

fn type_in_ros2(ty: &WireType) -> String {
    match ty {
        WireType::Primitive { primitive } => primitive.name().to_owned(),
        WireType::String { bound: None } => "string".to_owned(),
        WireType::String { bound: Some(bound) } => format!("string<={bound}"),
        WireType::WString { bound: None } => "wstring".to_owned(),
        WireType::WString { bound: Some(bound) } => format!("wstring<={bound}"),
        WireType::Interface { name } => short(name),
        WireType::Array { of, length } => format!("{}[{length}]", type_in_ros2(of)),
        WireType::Sequence { of, bound: None } => format!("{}[]", type_in_ros2(of)),
        WireType::Sequence { of, bound: Some(bound) } => format!("{}[<={bound}]", type_in_ros2(of)),
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    const STAMPED: &str = "\
# A comment.
# ==========
std_msgs/Header header
Level[<=3] levels
string<=5 name
================================================================================
MSG: std_msgs/Header
builtin_interfaces/Time stamp
string frame_id
================================================================================
MSG: made_up/Level
float64[2] data
";

    #[test]
    fn a_text_is_read_with_everything_in_it_and_written_so_that_it_reads_back() {
        let (catalogue, name) = read(Notation::Msg, "made_up/msg/Stamped", STAMPED).unwrap();
        let layout = catalogue.layout(&name).unwrap();
        let names: Vec<&str> = layout.iter().map(|interface| interface.name.as_str()).collect();
        let all = ["builtin_interfaces/msg/Time", "std_msgs/msg/Header", "made_up/msg/Level", "made_up/msg/Stamped"];
        assert_eq!(names, all, "times are there although the text has none");
        let text = written(Notation::Msg, &layout);
        let (again, _) = read(Notation::Msg, "made_up/Stamped", &text).unwrap();
        assert_eq!(again.layout(&name).unwrap(), layout, "{text}");
    }

    #[test]
    fn a_text_of_ros_1_has_its_header_and_its_times() {
        let text = "Header header\ntime[] at\n================================================================================\n\
                    MSG: std_msgs/Header\nuint32 seq\ntime stamp\nstring frame_id\n";
        let (catalogue, name) = read(Notation::Ros1, "made_up/Stamped", text).unwrap();
        let layout = catalogue.layout(&name).unwrap();
        assert_eq!(layout.len(), 3);
        assert!(written(Notation::Ros1, &layout).starts_with("std_msgs/Header header\ntime[] at\n====="));
    }

    #[test]
    fn an_event_of_a_service_has_its_request_and_its_reply() {
        let (catalogue, name) = read(Notation::Msg, "made_up/srv/Add_Event", "int64 a\n---\nint64 sum\n").unwrap();
        let layout = catalogue.layout(&name).unwrap();
        assert_eq!(layout.last().unwrap().fields.len(), 3);
        assert_eq!(layout.len(), 5, "with info, its time, request and reply");
    }

    #[test]
    fn errors_name_the_line_in_the_whole_text() {
        let text = "float64 a\n================================================================================\nMSG: p/B\n\nnothing\n";
        assert_eq!(read(Notation::Msg, "p/A", text).unwrap_err().line, 5);
        assert!(read(Notation::Msg, "a/b/c/d", "").is_err());
    }

    proptest! {
        #[test]
        fn no_text_is_too_much(name in "[a-zA-Z/_]{0,12}", text in "([=#MSGID: \n\\[\\]<a-z0-9/]|={80}\n|MSG: a/B\n){0,60}") {
            for (notation, _) in Notation::ALL {
                if let Ok((catalogue, name)) = read(notation, &name, &text) {
                    let _ = catalogue.layout(&name);
                }
            }
        }
    }
}
