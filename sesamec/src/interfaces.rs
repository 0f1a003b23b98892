//! Definitions of messages in files. For ROS, these are messages, services and actions in folders: each file is read
//! when it is asked for, in the order in which one contains another. For `MAVLink`, these are the files of a dialect,
//! read once.
//!
//! A folder holds packages, as `share` of a distribution and the folder of a workspace's sources do:
//! `PACKAGE/msg/NAME.msg`, `PACKAGE/srv/NAME.srv`, `PACKAGE/action/NAME.action`, or `.idl` in their place. A package
//! that is not there is searched in the repositories below ([`workspace`]).

mod workspace;

use std::cell::RefCell;
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use sesame_codegen::input::{self, Unreadable};
use sesame_dsl::interfaces::{
    Constant, ConstantValue, DialectMessage, Folders, Interfaces, UnusableFile, defined_in, known,
};
use sesame_interfaces::mavlink::{self, Definitions};
use sesame_plan::{Dialect, Interface, InterfaceField, WireType};

/// The most files that are read for one space.
const MOST_FILES: usize = 2000;

/// The longest chain of messages that contain each other.
const DEEPEST: usize = 64;

/// A file that defines a message, a service or an action.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct Definition {
    /// Where it is.
    pub file: PathBuf,
    /// How it is written.
    pub format: Format,
    /// The ROS that it is for.
    pub dialect: Dialect,
    /// What it says.
    pub text: String,
}

/// How a definition is written.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Format {
    /// A message.
    Msg,
    /// A service.
    Srv,
    /// An action of ROS 2.
    Action,
    /// Any of these, in the notation of DDS.
    Idl,
}

/// What a definition is of: of the interface `PACKAGE/msg/NAME` one layout, of `PACKAGE/srv/NAME` those of
/// `PACKAGE/srv/NAME_Request` and `PACKAGE/srv/NAME_Response`, of `PACKAGE/action/NAME` those of all messages that it
/// consists of. What they contain is named in full.
pub(crate) type Parse = fn(name: &str, definition: &Definition) -> Result<Vec<Interface>, String>;

/// The layouts of a definition; `None` where no folder has one.
type Read = Result<Option<Vec<Interface>>, String>;

/// The messages of a dialect.
type Dialects = Result<Vec<DialectMessage>, Vec<UnusableFile>>;

/// Layouts from files.
pub(crate) struct Files {
    parse: Parse,
    /// By the name of the message, service or action.
    read: RefCell<BTreeMap<String, Read>>,
    /// By the files, and the file to which they are relative.
    dialects: RefCell<BTreeMap<(Vec<String>, String), Dialects>>,
    /// The packages in repositories below a folder, by the folder.
    packages: RefCell<BTreeMap<PathBuf, BTreeMap<String, PathBuf>>>,
}

impl Default for Files {
    fn default() -> Self {
        Files::new(parse)
    }
}

/// The layouts of a definition of ROS.
fn parse(name: &str, definition: &Definition) -> Result<Vec<Interface>, String> {
    let layout = |definition: sesame_interfaces::Definition| Interface {
        name: definition.name,
        fields: definition.fields.into_iter().map(|field| InterfaceField { name: field.name, ty: field.ty }).collect(),
    };
    Ok(definitions(name, definition)?.into_iter().map(layout).collect())
}

/// A constant with a number or a text, as a file writes it; `None` for any other.
fn constant(written: &sesame_interfaces::Constant) -> Option<Constant> {
    let text = written.value.trim();
    let quoted = |quote: char| text.strip_prefix(quote).and_then(|rest| rest.strip_suffix(quote));
    let hexadecimal = || i64::from_str_radix(text.strip_prefix("0x").or(text.strip_prefix("0X"))?, 16).ok();
    #[expect(clippy::cast_precision_loss, reason = "the language has no other numbers")]
    let number = text.parse().ok().or_else(|| hexadecimal().map(|number| number as f64));
    let value = match (number, quoted('"').or(quoted('\''))) {
        (Some(number), _) if f64::is_finite(number) => ConstantValue::Number(number),
        (_, Some(text)) => ConstantValue::Text(text.to_owned()),
        _ => return None,
    };
    Some(Constant { name: written.name.clone(), value })
}

/// What a definition of ROS declares.
fn definitions(name: &str, definition: &Definition) -> Result<Vec<sesame_interfaces::Definition>, String> {
    let package = name.split('/').next().unwrap_or_default();
    let last = name.rsplit('/').next().unwrap_or_default();
    let text = definition.text.as_str();
    let mut definitions = match (definition.format, definition.dialect) {
        (Format::Msg, Dialect::Ros1) => sesame_interfaces::ros1::msg(package, last, text).map(|one| vec![one]),
        (Format::Srv, Dialect::Ros1) => sesame_interfaces::ros1::srv(package, last, text).map(Vec::from),
        (Format::Msg, Dialect::Ros2) => sesame_interfaces::msg(package, last, text).map(|one| vec![one]),
        (Format::Srv, Dialect::Ros2) => sesame_interfaces::srv(package, last, text).map(Vec::from),
        (Format::Action, _) => sesame_interfaces::action(package, last, text).map(Vec::from),
        (Format::Idl, _) => sesame_interfaces::idl(text),
    };
    if let (Ok(definitions), true) = (&mut definitions, name.split('/').nth(1) == Some("action")) {
        definitions.extend(sesame_interfaces::action::messages(package, last));
    }
    definitions.map_err(|error| error.to_string())
}

impl Files {
    /// No file is read yet.
    pub(crate) fn new(parse: Parse) -> Self {
        Files { parse, read: RefCell::default(), dialects: RefCell::default(), packages: RefCell::default() }
    }

    /// The layout of an interface itself.
    fn layout(&self, folders: Folders<'_>, name: &str) -> Result<Option<Interface>, String> {
        let defined = defined_in(name);
        if !self.read.borrow().contains_key(defined) {
            let read = self.read.borrow().len();
            let found = if read < MOST_FILES {
                self.definition(folders, defined)
            } else {
                Err(format!("it needs more than {MOST_FILES} files, which is the limit for a space"))
            };
            self.read.borrow_mut().insert(defined.to_owned(), found);
        }
        let read = self.read.borrow();
        let found = read[defined].clone()?;
        Ok(found.and_then(|found| found.into_iter().find(|interface| interface.name == name)))
    }

    fn definition(&self, folders: Folders<'_>, name: &str) -> Read {
        let Some(definition) = self.text(folders, name)? else { return Ok(None) };
        (self.parse)(name, &definition).map(Some).map_err(|why| format!("{}: {why}", definition.file.display()))
    }

    /// The file that defines an interface, with what it says.
    fn text(&self, folders: Folders<'_>, name: &str) -> Result<Option<Definition>, String> {
        let Some((file, format)) = self.file(folders, name) else { return Ok(None) };
        let text = input::text(&file).map_err(|unreadable| match unreadable {
            Unreadable::System(error) => format!("{} cannot be read: {error}", file.display()),
            other => format!("{}: {other}", file.display()),
        })?;
        Ok(Some(Definition { file, format, dialect: folders.dialect, text }))
    }

    /// The first file of the folders that may define an interface: each folder's own packages, then those below it.
    fn file(&self, folders: Folders<'_>, name: &str) -> Option<(PathBuf, Format)> {
        let mut parts = name.split('/');
        let (Some(package), Some(kind), Some(last)) = (parts.next(), parts.next(), parts.next()) else {
            return None;
        };
        let plain =
            |part: &str| !part.is_empty() && part.bytes().all(|byte| byte.is_ascii_alphanumeric() || byte == b'_');
        if !plain(package) || !plain(last) || !FORMATS.iter().any(|(of, _)| *of == kind) || parts.next().is_some() {
            return None;
        }
        let beside = Path::new(folders.file).parent().unwrap_or(Path::new(""));
        for folder in folders.written.iter().map(|folder| beside.join(folder)) {
            if let Some(found) = in_package(&folder.join(package), kind, last) {
                return Some(found);
            }
            // What needs no file is not worth a search through a workspace.
            if is_known(name) {
                continue;
            }
            let mut packages = self.packages.borrow_mut();
            let below = packages.entry(folder.clone()).or_insert_with(|| workspace::packages(&folder));
            if let Some(found) = below.get(package).and_then(|package| in_package(package, kind, last)) {
                return Some(found);
            }
        }
        None
    }

    /// Adds an interface to those that are found, after those that it contains. `open` are those that contain it.
    fn add(
        &self,
        folders: Folders<'_>,
        name: &str,
        open: &mut Vec<String>,
        found: &mut Vec<Interface>,
    ) -> Result<bool, String> {
        if found.iter().any(|interface| interface.name == name) {
            return Ok(true);
        }
        if open.iter().any(|outer| outer == name) {
            return Err(format!("`{name}` contains itself"));
        }
        if open.len() >= DEEPEST {
            return Err(format!("messages are nested more than {DEEPEST} levels deep"));
        }
        let Some(layout) = self.layout(folders, name)? else {
            // Some need no file.
            let known = known(name).unwrap_or_default();
            let there = !known.is_empty();
            for interface in known {
                if found.iter().all(|known| known.name != interface.name) {
                    found.push(interface);
                }
            }
            return Ok(there);
        };
        open.push(name.to_owned());
        for field in &layout.fields {
            let Some(inner) = contained(&field.ty) else { continue };
            if !self.add(folders, inner, open, found)? {
                let header = inner.ends_with("/msg/Header") && folders.dialect == Dialect::Ros2;
                let hint = if header {
                    "; a bare `Header` is of its own package, and the common one is `std_msgs/Header`"
                } else {
                    ""
                };
                return Err(format!("it contains `{inner}`, of which no folder has a definition{hint}"));
            }
        }
        open.pop();
        found.push(layout);
        Ok(true)
    }
}

impl Interfaces for Files {
    fn find(&self, folders: Folders<'_>, name: &str) -> Read {
        let mut found = Vec::new();
        let there = self.add(folders, name, &mut Vec::new(), &mut found)?;
        Ok(there.then_some(found))
    }

    fn constants(&self, folders: Folders<'_>, name: &str) -> Vec<Constant> {
        let defined = defined_in(name);
        let Ok(Some(definition)) = self.text(folders, defined) else { return Vec::new() };
        let found = definitions(defined, &definition).unwrap_or_default();
        let of = found.iter().filter(|definition| definition.name == name);
        of.flat_map(|definition| &definition.constants).filter_map(constant).collect()
    }

    fn dialect(&self, files: &[String], beside: &str) -> Result<Option<Vec<DialectMessage>>, Vec<UnusableFile>> {
        let mut dialects = self.dialects.borrow_mut();
        let read = dialects.entry((files.to_vec(), beside.to_owned()));
        read.or_insert_with(|| dialect(files, beside)).clone().map(Some)
    }
}

fn dialect(files: &[String], beside: &str) -> Dialects {
    let folder = Path::new(beside).parent().unwrap_or(Path::new(""));
    let contents = |path: &Path| input::text(path).map_err(|unreadable| unreadable.to_string());
    let definitions = Definitions::read(files, folder, &contents).map_err(|unusable| {
        let of = |it: mavlink::Unusable| UnusableFile { named: it.named, why: it.why() };
        unusable.into_iter().map(of).collect::<Vec<_>>()
    })?;
    let message = |definition: &mavlink::Definition| {
        let entries = definitions.entries(definition);
        let entries = entries.map(|(field, entry)| (field.name.as_str(), entry.name.as_str(), entry.value));
        DialectMessage::new(definition.interface(), entries)
    };
    Ok(definitions.iter().map(message).collect())
}

/// Whether a message or service needs no file.
fn is_known(name: &str) -> bool {
    known(name).is_some() || known(&format!("{name}_Request")).is_some()
}

/// The kinds of interfaces, and how those of a kind are written in a file that ends with its name.
const FORMATS: [(&str, Format); 3] = [("msg", Format::Msg), ("srv", Format::Srv), ("action", Format::Action)];

/// The file in a package that may define an interface of a kind.
fn in_package(package: &Path, kind: &str, name: &str) -> Option<(PathBuf, Format)> {
    let own = FORMATS.into_iter().find(|(of, _)| *of == kind);
    own.into_iter().chain([("idl", Format::Idl)]).find_map(|(extension, format)| {
        let file = package.join(kind).join(format!("{name}.{extension}"));
        file.exists().then_some((file, format))
    })
}

/// The interface that values of a type are or hold.
fn contained(ty: &WireType) -> Option<&str> {
    match ty {
        WireType::Interface { name } => Some(name),
        WireType::Array { of, .. } | WireType::Sequence { of, .. } => contained(of),
        WireType::Primitive { .. } | WireType::String { .. } | WireType::WString { .. } => None,
    }
}

#[cfg(test)]
mod tests {
    use std::fs;

    use super::*;

    /// Each word of a text is a field with a message of that type; `---` is between requests and replies.
    fn words(name: &str, definition: &Definition) -> Result<Vec<Interface>, String> {
        if definition.text.contains('!') {
            return Err("its line 1 is not a field".to_owned());
        }
        let field = |(at, name): (usize, &str)| InterfaceField {
            name: format!("f{at}"),
            ty: WireType::Sequence { of: Box::new(WireType::Interface { name: name.to_owned() }), bound: None },
        };
        let of = |name: String, text: &str| Interface {
            name,
            fields: text.split_whitespace().enumerate().map(field).collect(),
        };
        Ok(match definition.text.split_once("---") {
            Some((request, reply)) => {
                vec![of(format!("{name}_Request"), request), of(format!("{name}_Response"), reply)]
            }
            None => vec![of(name.to_owned(), &definition.text)],
        })
    }

    fn found(files: &[(&str, &str)], name: &str) -> Result<Option<Vec<String>>, String> {
        let folder = tempfile::tempdir().unwrap();
        for (path, text) in files {
            let path = folder.path().join(path);
            fs::create_dir_all(path.parent().unwrap()).unwrap();
            fs::write(path, text).unwrap();
        }
        let file = folder.path().join("cell.sesame");
        let written = ["first".to_owned(), "second".to_owned()];
        let folders = Folders { written: &written, file: file.to_str().unwrap(), dialect: Dialect::Ros2 };
        let found = Files::new(words).find(folders, name);
        let names = |found: Vec<Interface>| found.into_iter().map(|interface| interface.name).collect();
        found
            .map(|found| found.map(names))
            .map_err(|why| why.replace(folder.path().to_str().unwrap(), "").replace(std::path::MAIN_SEPARATOR, "/"))
    }

    #[test]
    fn what_a_message_contains_comes_before_it_and_once() {
        let files = [
            ("second/a/msg/Outer.msg", "a/msg/Inner b/msg/Leaf a/msg/Inner"),
            ("first/a/msg/Inner.idl", "b/msg/Leaf"),
            ("second/b/msg/Leaf.msg", ""),
            ("first/c/msg/Broken.msg", "!"),
        ];
        assert_eq!(
            found(&files, "a/msg/Outer").unwrap().unwrap(),
            ["b/msg/Leaf", "a/msg/Inner", "a/msg/Outer"],
            "what is not needed is not read"
        );
        assert_eq!(found(&files, "a/msg/Other").unwrap(), None);
        assert_eq!(found(&files, "a/../b/msg/Leaf").unwrap(), None);
        assert_eq!(found(&files, "c/msg/Broken").unwrap_err(), "/first/c/msg/Broken.msg: its line 1 is not a field");
    }

    #[test]
    fn packages_of_a_workspace_lie_in_repositories() {
        let manifest = |name: &str| format!("<package><name>{name}</name></package>");
        let files = [
            ("first/repository/a/package.xml", &*manifest("a")),
            ("first/repository/a/msg/Outer.msg", "b/msg/Leaf"),
            ("first/other/renamed/package.xml", &*manifest("b")),
            ("first/other/renamed/msg/Leaf.msg", ""),
            ("second/b/msg/Leaf.msg", "c/msg/None"),
        ];
        assert_eq!(found(&files, "a/msg/Outer").unwrap().unwrap(), ["b/msg/Leaf", "a/msg/Outer"]);
        assert_eq!(found(&files, "renamed/msg/Leaf").unwrap(), None);
    }

    #[test]
    fn a_dialect_is_relative_to_the_space_and_read_with_the_files_that_it_includes() {
        let folder = tempfile::tempdir().unwrap();
        let message = r#"<message id="1" name="LEVEL"><field type="float[3]" name="level"/></message>"#;
        fs::write(folder.path().join("level.xml"), format!("<mavlink><messages>{message}</messages></mavlink>"))
            .unwrap();
        let own = "<mavlink><include>level.xml</include></mavlink>";
        fs::write(folder.path().join("own.xml"), own).unwrap();
        fs::write(folder.path().join("bad.xml"), own.replace("level", "none")).unwrap();
        let space = folder.path().join("cell.sesame");
        let files = Files::default();
        let read = |names: &[&str]| {
            let names: Vec<String> = names.iter().map(|name| (*name).to_owned()).collect();
            files.dialect(&names, space.to_str().unwrap())
        };
        let found = read(&["own.xml"]).unwrap().unwrap();
        let number = WireType::Primitive { primitive: sesame_plan::Primitive::Float32 };
        let level =
            InterfaceField { name: "level".to_owned(), ty: WireType::Array { of: Box::new(number), length: 3 } };
        let layout = Interface { name: "LEVEL".to_owned(), fields: vec![level] };
        assert_eq!(found, [DialectMessage { interface: layout, constants: Vec::new() }]);
        let unusable = read(&["own.xml", ".", "bad.xml"]).unwrap_err();
        assert_eq!((unusable[0].named, unusable[0].why.as_str()), (1, "it is a folder, not a regular file"));
        assert_eq!(unusable[1].named, 2);
        assert!(unusable[1].why.ends_with("none.xml`, and there is no such file"), "{unusable:?}");
    }

    #[test]
    fn files_of_ros_are_read_in_all_three_notations() {
        let folder = tempfile::tempdir().unwrap();
        let header = "module std_msgs { module msg { struct Level { double data; }; }; };";
        for (path, text) in [
            ("a/msg/Joint.msg", "std_msgs/Level[] levels # of each\nuint8 COUNT=3\nfloat32[3] axes\n"),
            ("a/srv/Move.srv", "Joint to\nstd_msgs/Header header\n---\n"),
            ("a/msg/Own.msg", "Header header\n"),
            ("a/msg/Header.msg", "uint32 number\n"),
            ("b/msg/Stamped.msg", "Header header\n"),
            ("std_msgs/msg/Level.idl", header),
        ] {
            let path = folder.path().join(path);
            fs::create_dir_all(path.parent().unwrap()).unwrap();
            fs::write(path, text).unwrap();
        }
        let file = folder.path().join("cell.sesame");
        let written = [".".to_owned()];
        let folders = Folders { written: &written, file: file.to_str().unwrap(), dialect: Dialect::Ros2 };
        let files = Files::default();
        let names = |name| {
            let found = files.find(folders, name).unwrap().unwrap();
            found.into_iter().map(|interface| interface.name).collect::<Vec<_>>()
        };
        let header = ["builtin_interfaces/msg/Time", "std_msgs/msg/Header"];
        let expected = ["std_msgs/msg/Level", "a/msg/Joint", header[0], header[1], "a/srv/Move_Request"];
        assert_eq!(names("a/srv/Move_Request"), expected, "headers are known without a file");
        assert_eq!(names("a/srv/Move_Response"), ["a/srv/Move_Response"]);
        // A bare name is of the same package in ROS 2, `Header` too.
        assert_eq!(names("a/msg/Own"), ["a/msg/Header", "a/msg/Own"]);
        let why = files.find(folders, "b/msg/Stamped").unwrap_err();
        let hint = "a bare `Header` is of its own package, and the common one is `std_msgs/Header`";
        assert!(why.contains("`b/msg/Header`") && why.ends_with(hint), "{why}");
    }

    #[test]
    fn files_of_ros_1_have_its_types() {
        let folder = tempfile::tempdir().unwrap();
        for (path, text) in [
            ("std_msgs/msg/Header.msg", "uint32 seq\ntime stamp\nstring frame_id\n"),
            ("a/msg/Joint.msg", "Header header\nduration[] all\n"),
            ("a/srv/Move.srv", "Joint to\n---\ntime at\n"),
        ] {
            let path = folder.path().join(path);
            fs::create_dir_all(path.parent().unwrap()).unwrap();
            fs::write(path, text).unwrap();
        }
        let file = folder.path().join("cell.sesame");
        let written = [".".to_owned()];
        let folders = Folders { written: &written, file: file.to_str().unwrap(), dialect: Dialect::Ros1 };
        let found = Files::default().find(folders, "a/srv/Move_Request").unwrap().unwrap();
        let names: Vec<&str> = found.iter().map(|interface| interface.name.as_str()).collect();
        let [time, duration] = ["Time", "Duration"].map(|name| format!("builtin_interfaces/msg/{name}"));
        assert_eq!(names, [&time, "std_msgs/msg/Header", &duration, "a/msg/Joint", "a/srv/Move_Request"]);
        assert_eq!(found[1].fields.len(), 3, "a header has its `seq` there");
        let folders = Folders { dialect: Dialect::Ros2, ..folders };
        let why = Files::default().find(folders, "a/msg/Joint").unwrap_err();
        assert!(why.contains("ROS 1"), "{why}");
    }

    #[test]
    fn a_service_has_two_layouts() {
        let files = [("first/a/srv/Move.srv", "a/msg/Leaf --- "), ("first/a/msg/Leaf.msg", "")];
        assert_eq!(found(&files, "a/srv/Move_Request").unwrap().unwrap(), ["a/msg/Leaf", "a/srv/Move_Request"]);
        assert_eq!(found(&files, "a/srv/Move_Response").unwrap().unwrap(), ["a/srv/Move_Response"]);
    }

    #[test]
    fn an_action_is_all_messages_that_it_consists_of() {
        let folder = tempfile::tempdir().unwrap();
        let idl = "module a { module action {\n\
                     struct Stop_Goal { boolean now; };\n\
                     struct Stop_Result { boolean done; };\n\
                     struct Stop_Feedback { double left; };\n\
                   }; };\n";
        for (path, text) in [
            ("a/action/Move.action", "Spot to\n---\nbool done\n---\nfloat64 left\n"),
            ("a/action/Stop.idl", idl),
            ("a/msg/Spot.msg", "float64 x\n"),
        ] {
            let path = folder.path().join(path);
            fs::create_dir_all(path.parent().unwrap()).unwrap();
            fs::write(path, text).unwrap();
        }
        let file = folder.path().join("cell.sesame");
        let written = [".".to_owned()];
        let folders = Folders { written: &written, file: file.to_str().unwrap(), dialect: Dialect::Ros2 };
        let files = Files::default();
        let names = |name: &str| -> Vec<String> {
            let found = files.find(folders, name).unwrap().unwrap();
            found.into_iter().map(|interface| interface.name).collect()
        };
        let id = "unique_identifier_msgs/msg/UUID";
        assert_eq!(
            names("a/action/Move_FeedbackMessage"),
            [id, "a/action/Move_Feedback", "a/action/Move_FeedbackMessage"]
        );
        let goal = [id, "a/msg/Spot", "a/action/Move_Goal", "a/action/Move_SendGoal_Request"];
        assert_eq!(names("a/action/Move_SendGoal_Request"), goal);
        assert_eq!(
            names("a/action/Stop_GetResult_Response"),
            ["a/action/Stop_Result", "a/action/Stop_GetResult_Response"]
        );
        assert_eq!(files.find(folders, "a/action/Move"), Ok(None), "it is not a message");
    }

    #[test]
    fn circles_gaps_and_endless_chains_are_refused() {
        let circle = [("first/a/msg/A.msg", "a/msg/B"), ("first/a/msg/B.msg", "a/msg/A")];
        assert_eq!(found(&circle, "a/msg/A").unwrap_err(), "`a/msg/A` contains itself");
        let gap = [("first/a/msg/A.msg", "a/msg/B")];
        let why = "it contains `a/msg/B`, of which no folder has a definition";
        assert_eq!(found(&gap, "a/msg/A").unwrap_err(), why);
        let chain: Vec<(String, String)> =
            (0..70).map(|n| (format!("first/a/msg/M{n}.msg"), format!("a/msg/M{}", n + 1))).collect();
        let chain: Vec<(&str, &str)> = chain.iter().map(|(path, text)| (path.as_str(), text.as_str())).collect();
        assert_eq!(found(&chain, "a/msg/M0").unwrap_err(), "messages are nested more than 64 levels deep");
    }

    #[test]
    fn only_regular_files_are_read() {
        let folder = [("first/a/msg/A.msg/file", "")];
        assert_eq!(found(&folder, "a/msg/A").unwrap_err(), "/first/a/msg/A.msg: it is a folder, not a regular file");
    }
}
