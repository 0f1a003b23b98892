//! `.msg` and `.srv` files of ROS 2: a line per field or constant, as `rosidl_adapter` reads them.

use sesame_plan::{Primitive, WireType};

use crate::{Constant, Definition, DefinitionError, Field, LONGEST_ARRAY, definition, is_name};

/// The interface that a `.msg` file declares: package and name are those of its folder and of the file.
pub fn msg(package: &str, name: &str, text: &str) -> Result<Definition, DefinitionError> {
    part(package, format!("{package}/msg/{name}"), text.lines(), 1)
}

/// The interfaces of requests and replies that a `.srv` file declares: `NAME_Request` and `NAME_Response`.
pub fn srv(package: &str, name: &str, text: &str) -> Result<[Definition; 2], DefinitionError> {
    parts(package, "srv", text, [&format!("{name}_Request"), &format!("{name}_Response")])
}

/// The interfaces of an action that a `.action` file declares: `NAME_Goal`, `NAME_Result` and `NAME_Feedback`. What is
/// on the wire contains them; see [`crate::action::messages`].
pub fn action(package: &str, name: &str, text: &str) -> Result<[Definition; 3], DefinitionError> {
    let names = ["Goal", "Result", "Feedback"].map(|part| format!("{name}_{part}"));
    parts(package, "action", text, [&names[0], &names[1], &names[2]])
}

/// The parts of a file, with lines `---` between them.
fn parts<const N: usize>(
    package: &str,
    kind: &str,
    text: &str,
    names: [&str; N],
) -> Result<[Definition; N], DefinitionError> {
    let lines: Vec<&str> = text.lines().collect();
    let ends: Vec<usize> = (0..lines.len()).filter(|&at| lines[at].trim() == "---").collect();
    if ends.len() < N - 1 {
        let between = if N == 2 { "request and reply" } else { "goal, result and feedback" };
        let problem = format!("a line `---` between {between} is missing");
        return Err(DefinitionError { line: lines.len().max(1), problem });
    }
    let begin = |part: usize| if part == 0 { 0 } else { ends[part - 1] + 1 };
    // A line too many is in the last part, which refuses it.
    let end = |part: usize| if part == N - 1 { lines.len() } else { ends[part] };
    let mut made = Vec::with_capacity(N);
    for (at, name) in names.iter().enumerate() {
        let lines = lines[begin(at)..end(at)].iter().copied();
        made.push(part(package, format!("{package}/{kind}/{name}"), lines, begin(at) + 1)?);
    }
    Ok(made.try_into().expect("there is one for each name"))
}

fn part<'a>(
    package: &str,
    name: String,
    lines: impl Iterator<Item = &'a str>,
    first: usize,
) -> Result<Definition, DefinitionError> {
    let (mut fields, mut constants) = (Vec::<Field>::new(), Vec::new());
    for (at, line) in lines.enumerate() {
        let wrong = |problem: String| DefinitionError { line: first + at, problem };
        // A comment begins at the sign wherever it stands, so even in quotes.
        let line = line.split('#').next().unwrap_or_default().trim();
        if line.is_empty() {
            continue;
        }
        if line == "---" {
            return Err(wrong("`---` separates parts of services and actions only".to_owned()));
        }
        let (ty, rest) = line.split_once(char::is_whitespace).ok_or_else(|| wrong(format!("`{line}` has no name")))?;
        let ty = wire_type(package, ty).map_err(wrong)?;
        let rest = rest.trim_start();
        let end = rest.find(|c: char| !c.is_ascii_alphanumeric() && c != '_').unwrap_or(rest.len());
        let (field, rest) = rest.split_at(end);
        if !is_name(field) {
            return Err(wrong(format!("`{}` is not a field name", rest.split_whitespace().next().unwrap_or(field))));
        }
        if let Some(value) = rest.trim_start().strip_prefix('=') {
            constants.push(Constant { name: field.to_owned(), value: value.trim().to_owned() });
            continue;
        }
        if !rest.is_empty() && !rest.starts_with(char::is_whitespace) {
            return Err(wrong(format!("`{field}{rest}` is not a field name")));
        }
        if fields.iter().any(|other| other.name == field) {
            return Err(wrong(format!("field `{field}` is there twice")));
        }
        fields.push(Field { name: field.to_owned(), ty });
    }
    Ok(definition(name, fields, constants))
}

/// A type as `.msg` files write it, for example `float64[9]` or `geometry_msgs/Point[]`.
fn wire_type(package: &str, written: &str) -> Result<WireType, String> {
    array(written, &|written| element(package, written))
}

/// A type that may be an array, as it is written.
pub(crate) fn array(written: &str, element: &dyn Fn(&str) -> Result<WireType, String>) -> Result<WireType, String> {
    let Some((of, length)) = written.split_once('[') else { return element(written) };
    let of = Box::new(element(of)?);
    let length = length.strip_suffix(']').ok_or_else(|| format!("type `{written}` has no `]` at its end"))?;
    let number = |length: &str| {
        let number = length.parse().ok().filter(|&number: &u32| (1..=LONGEST_ARRAY).contains(&number));
        number.ok_or_else(|| format!("`{length}` is not the length of an array from 1 to {LONGEST_ARRAY}"))
    };
    match (length, length.strip_prefix("<=")) {
        ("", _) => Ok(WireType::Sequence { of, bound: None }),
        (_, Some(bound)) => Ok(WireType::Sequence { of, bound: Some(number(bound)?) }),
        _ => Ok(WireType::Array { of, length: number(length)? }),
    }
}

fn element(package: &str, written: &str) -> Result<WireType, String> {
    if let Some((name, bound)) = written.split_once("<=") {
        return match (name, bound.parse()) {
            ("string", Ok(bound)) => Ok(WireType::String { bound: Some(bound) }),
            ("wstring", Ok(bound)) => Ok(WireType::WString { bound: Some(bound) }),
            _ => Err(format!("`{written}` is not a bounded text")),
        };
    }
    let name = written;
    if let Some(primitive) = Primitive::named(name) {
        return Ok(WireType::Primitive { primitive });
    }
    let name = match name {
        "string" => return Ok(WireType::STRING),
        "wstring" => return Ok(WireType::WSTRING),
        "time" | "duration" => {
            return Err(format!("`{name}` is of ROS 1; in ROS 2 it is `builtin_interfaces/{}`", capital(name)));
        }
        // A bare name is of the same package. That holds for `Header` as well, which ROS 1 takes from `std_msgs`.
        name => match *name.split('/').collect::<Vec<_>>() {
            [name] => format!("{package}/msg/{name}"),
            [package, name] | [package, "msg", name] => format!("{package}/msg/{name}"),
            _ => name.to_owned(),
        },
    };
    let is_interface = name.rsplit('/').next().is_some_and(|last| last.starts_with(|c: char| c.is_ascii_uppercase()));
    if name.split('/').count() != 3 || !name.split('/').all(is_name) || !is_interface {
        return Err(format!("`{written}` is not a type"));
    }
    Ok(WireType::Interface { name })
}

fn capital(name: &str) -> &'static str {
    if name == "time" { "Time" } else { "Duration" }
}
