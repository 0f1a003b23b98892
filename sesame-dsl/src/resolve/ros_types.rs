//! Messages with a ROS type: their layouts, and what the fields of a layout are in the language.

use std::collections::{BTreeMap, BTreeSet};

use heck::ToUpperCamelCase as _;
use sesame_plan::{Interface, InterfaceField, Primitive, WireType};

use super::Resolver;
use super::words::type_in_words;
use crate::diagnostic::{Code, Diagnostic};
use crate::interfaces::{self, Folders};
use crate::model::{self, Declaration, Id as _, MessageId, Type};
use crate::similar::most_similar;
use crate::span::Span;
use crate::syntax::ast::{self, Text};
use crate::units::Unit;

/// Types of ROS, as far as the space uses them.
#[derive(Default)]
pub(super) struct RosTypes {
    /// All layouts, each after those it contains.
    pub(super) interfaces: Vec<Interface>,
    /// Per message of the file: what is known of its type.
    pub(super) layouts: Vec<Layout>,
    /// The messages of the file by their types; of several the first.
    declared: BTreeMap<String, usize>,
    /// Messages that no file declares, by their types.
    implicit: BTreeMap<String, MessageId>,
    /// Names of types in generated code.
    taken: BTreeSet<String>,
}

/// What is known of the ROS type of a message.
#[derive(Debug, Clone, Default)]
pub(super) enum Layout {
    /// It has none, or there was a mistake.
    #[default]
    None,
    /// It comes from a folder: last, after what it contains.
    Found(Vec<Interface>),
    /// Its block is the layout.
    Block(String),
}

/// The kinds of interfaces of ROS, what they are the types of, and an example.
const KINDS: [(&str, &str, &str); 3] = [
    ("msg", "a message", "sensor_msgs/msg/JointState"),
    ("srv", "a service", "std_srvs/srv/SetBool"),
    ("action", "an action", "nav2_msgs/action/NavigateToPose"),
];

impl<'a> Resolver<'a> {
    /// The message of the file with this type.
    pub(super) fn declared_message(&self, interface: &str) -> Option<MessageId> {
        self.system.ros.declared.get(interface).map(|&index| self.system.message_ids[index])
    }

    /// Looks the layouts of all messages up.
    pub(super) fn layouts(&mut self, messages: &[&'a ast::Message]) {
        self.system.ros.taken = messages.iter().map(|message| message.head.name.text.to_upper_camel_case()).collect();
        self.system.ros.layouts = vec![Layout::None; messages.len()];
        for (index, message) in messages.iter().enumerate() {
            let Some(written) = &message.ros_type else {
                self.no_wire_types(message);
                continue;
            };
            let Some(name) = self.ros_type(written, "msg") else { continue };
            if let Some((kind, simulator)) = self.other_than_ros() {
                let title = format!(
                    "message `{}` has a ROS type, but simulator kind `{kind}` is not ROS",
                    message.head.name.text
                );
                let diagnostic = Diagnostic::new(Code::NOT_ROS, written.span, title)
                    .label("only messages of a simulator of ROS have one; remove it and declare the fields in a block")
                    .secondary(simulator, "the simulator is declared here");
                self.report(diagnostic);
                continue;
            }
            self.system.ros.declared.entry(name.clone()).or_insert(index);
            self.system.ros.layouts[index] = match self.layout(&name, written.span) {
                Ok(Some(found)) => Layout::Found(found),
                Ok(None) if message.block => Layout::Block(name),
                Ok(None) => {
                    self.not_found(&name, written.span, "and declare its fields in a block");
                    Layout::None
                }
                Err(()) => Layout::None,
            };
        }
    }

    fn no_wire_types(&mut self, message: &'a ast::Message) {
        let Some(wire) = message.fields.iter().find_map(|field| field.wire.as_ref()) else { return };
        let title =
            format!("message `{}` has no ROS type, so its fields have no type on the wire", message.head.name.text);
        let diagnostic = Diagnostic::new(Code::NOT_ROS, wire.span, title)
            .label("only fields of a message with a ROS type have one")
            .note(format!("for example `message {} = \"cell_msgs/msg/{0}\" {{ … }}`", message.head.name.text));
        self.report(diagnostic);
    }

    /// The full name of a type of ROS; reports what is none.
    pub(super) fn ros_type(&mut self, written: &Text, kind: &str) -> Option<String> {
        if written.text.trim().is_empty() {
            return None;
        }
        let name = interfaces::full_name(&written.text, kind, self.dialect());
        if name.is_none() {
            let (_, what, example) =
                KINDS.into_iter().find(|(of, ..)| *of == kind).expect("each kind of an interface has a row");
            let title = format!("`{}` is not the type of {what} in ROS", written.text);
            let mut diagnostic = Diagnostic::new(Code::BAD_PATH, written.span, title)
                .label(format!("expected a package and a type, for example `{example}`"));
            let other = KINDS.into_iter().find(|(of, ..)| {
                let named = written.text.split('/').nth(1) == Some(of);
                *of != kind && named && interfaces::full_name(&written.text, of, self.dialect()).is_some()
            });
            if let Some((of, other, _)) = other {
                diagnostic = diagnostic.note(match of {
                    "action" => format!(
                        "it is the type of {other}: declare it with `action NAME = \"PATH\" : \"{0}\"`; the messages that \
                         it consists of have types of their own, such as `{0}_Goal`",
                        written.text
                    ),
                    _ => format!("it is the type of {other}"),
                });
            }
            self.report(diagnostic);
        }
        name
    }

    /// The folders with definitions, as written, and the name of the file that names the first of them.
    pub(super) fn folders(&self) -> (Vec<String>, &'a str) {
        let types = self.ast_types().iter();
        let types = types.flat_map(|(span, folders)| folders.iter().map(move |folder| (*span, folder.text.clone())));
        let (spans, written): (Vec<Span>, Vec<String>) = types.unzip();
        (written, spans.first().map_or("", |span| self.sources.file(span.file).name()))
    }

    /// The layout of an interface, last after those it contains; `None` if no folder has it. Mistakes are reported.
    pub(super) fn layout(&mut self, name: &str, at: Span) -> Result<Option<Vec<Interface>>, ()> {
        if let Some(known) = interfaces::known(name) {
            return Ok(Some(known));
        }
        let (written, file) = self.folders();
        match self.interfaces.find(Folders { written: &written, file, dialect: self.dialect() }, name) {
            Ok(Some(found)) if found.last().is_some_and(|last| last.name == name) => Ok(Some(found)),
            Ok(_) => Ok(None),
            Err(why) => {
                let title = format!("the layout of `{name}` cannot be read");
                self.report(Diagnostic::new(Code::NO_LAYOUT, at, title).label(why));
                Err(())
            }
        }
    }

    pub(super) fn not_found(&mut self, name: &str, at: Span, remedy: &str) {
        let folders = self.ast_types().len();
        let title = format!("no folder has a definition of `{name}`");
        let diagnostic = Diagnostic::new(Code::NO_LAYOUT, at, title);
        let diagnostic = if folders == 0 {
            diagnostic.label("the simulator names no folders with `types`")
        } else {
            diagnostic.label("not found in the folders that the simulator names with `types`")
        };
        let package = name.split('/').next().unwrap_or_default();
        let note = format!(
            "name the folder that contains `{package}`, for example `types \"/opt/ros/jazzy/share\"`, or leave the \
             folders aside {remedy}"
        );
        self.report(diagnostic.note(note));
    }

    /// The messages of the file that a message contains according to its layout, with the place that says so.
    pub(super) fn contained_by_layout(&self, index: usize, message: &ast::Message) -> Vec<(usize, Span)> {
        let declared = |name: &str| self.system.ros.declared.get(name).copied();
        match (&self.system.ros.layouts[index], &message.ros_type) {
            (Layout::Found(found), Some(written)) => {
                let inner = found.iter().take(found.len().saturating_sub(1));
                let inner = inner.filter_map(|interface| declared(&interface.name)).filter(|&inner| inner != index);
                inner.map(|inner| (inner, written.span)).collect()
            }
            (Layout::Block(_), _) => {
                let wires = message.fields.iter().filter_map(|field| field.wire.as_ref());
                let inner = wires.filter_map(|wire| {
                    match interfaces::innermost(&interfaces::wire_type(&wire.text, self.dialect())?) {
                        WireType::Interface { name } => Some((declared(name)?, wire.span)),
                        _ => None,
                    }
                });
                inner.collect()
            }
            _ => Vec::new(),
        }
    }

    /// Keeps layouts, each once.
    pub(super) fn keep(&mut self, found: &[Interface]) {
        for interface in found {
            if !self.system.ros.interfaces.iter().any(|known| known.name == interface.name) {
                self.system.ros.interfaces.push(interface.clone());
            }
        }
    }

    /// A message whose layout was found: all its fields, with the units and comments of those that are listed.
    pub(super) fn message_of_layout(
        &mut self,
        message: &'a ast::Message,
        listed: Vec<(&'a ast::Field, Type)>,
        found: &[Interface],
    ) -> Option<model::Message> {
        self.keep(found);
        let last = found.last()?;
        let at = message.ros_type.as_ref()?.span;
        let mut fields = self.fields_of(last, found, at);
        let mut complete = true;
        for (field, ty) in listed {
            let name = &field.head.name;
            let mut of_layout = last.fields.iter().filter(|field| field.name != interfaces::NO_FIELDS).enumerate();
            let Some((position, of_wire)) = of_layout.find(|(_, field)| field.name == name.text) else {
                self.unknown_field(message, name, last);
                complete = false;
                continue;
            };
            let has = &fields[position].ty;
            let another = field
                .wire
                .as_ref()
                .filter(|wire| interfaces::wire_type(&wire.text, self.dialect()).as_ref() != Some(&of_wire.ty));
            if !fits(&ty, has) || another.is_some() {
                let wire = interfaces::in_words(&of_wire.ty);
                let title = format!("field `{}` of `{}` is `{wire}`", name.text, last.name);
                let span = another.map_or(field.ty.span, |wire| wire.span);
                let diagnostic = Diagnostic::new(Code::NO_LAYOUT, span, title).label(if another.is_some() {
                    "another type on the wire".to_owned()
                } else {
                    format!("expected {}", expected(has))
                });
                self.report(diagnostic);
                complete = false;
                continue;
            }
            let field = model::Field { declaration: self.declaration(&field.head), ty, optional: false };
            fields[position] = field;
        }
        let interface = Some(last.name.clone());
        let constants = self.constants_of(message, interface.as_deref());
        complete.then(|| model::Message { declaration: self.declaration(&message.head), fields, interface, constants })
    }

    fn unknown_field(&mut self, message: &ast::Message, name: &ast::Name, layout: &Interface) {
        let title = format!("`{}` has no field named `{}`", layout.name, name.text);
        let mut diagnostic = Diagnostic::new(Code::UNKNOWN_NAME, name.span, title).label("unknown field");
        if let Some(written) = &message.ros_type {
            diagnostic = diagnostic.secondary(written.span, "the type of the message");
        }
        let known = layout.fields.iter().map(|field| field.name.as_str());
        let known: Vec<&str> = known.filter(|&name| name != interfaces::NO_FIELDS).collect();
        if self.compared.more(known.len()) {
            diagnostic = match most_similar(&name.text, known.iter().copied()) {
                Some(similar) => diagnostic.did_you_mean(name.span, similar),
                None if known.is_empty() => diagnostic.note("it has no fields"),
                None => diagnostic.note(format!("its fields are {}", super::words::list(&known))),
            };
        }
        self.report(diagnostic);
    }

    /// The layout that the block of a message is.
    pub(super) fn layout_of_block(&mut self, name: &str, listed: &[(&'a ast::Field, Type)]) -> Option<Interface> {
        let mut fields = Vec::new();
        let mut complete = true;
        for (field, ty) in listed {
            let wire = match &field.wire {
                Some(wire) => self.written_wire(wire, field, ty),
                None => self.usual_wire(ty, field),
            };
            match wire {
                Some(wire) => fields.push(InterfaceField { name: field.head.name.text.clone(), ty: wire }),
                None => complete = false,
            }
        }
        complete.then(|| interfaces::interface(name.to_owned(), fields))
    }

    /// The type on the wire that a field has if none is written.
    fn usual_wire(&mut self, ty: &Type, field: &ast::Field) -> Option<WireType> {
        Some(match ty {
            Type::Bool => WireType::Primitive { primitive: Primitive::Bool },
            Type::Int(_) => WireType::Primitive { primitive: Primitive::Int32 },
            Type::Real(_) => WireType::Primitive { primitive: Primitive::Float64 },
            Type::Text => WireType::STRING,
            Type::Point(_) => {
                let name = "geometry_msgs/msg/Point".to_owned();
                self.keep(&interfaces::known(&name).unwrap_or_default());
                WireType::Interface { name }
            }
            Type::List(of) => WireType::Sequence { of: Box::new(self.usual_wire(of, field)?), bound: None },
            Type::Message(id) => {
                let message = self.system.messages.get(id.index())?.as_ref()?;
                let Some(name) = message.interface.clone() else {
                    let title = format!("message `{}` has no ROS type", message.declaration.name);
                    let diagnostic = Diagnostic::new(Code::NOT_ROS, field.ty.span, title)
                        .label("what a message with a ROS type contains needs one as well")
                        .secondary(message.declaration.span, "the message is declared here")
                        .note(format!(
                            "for example `message {} = \"cell_msgs/msg/{0}\" {{ … }}`",
                            message.declaration.name
                        ));
                    self.report(diagnostic);
                    return None;
                };
                WireType::Interface { name }
            }
        })
    }

    /// The type on the wire of a field that says it.
    fn written_wire(&mut self, written: &Text, field: &ast::Field, ty: &Type) -> Option<WireType> {
        if written.text.trim().is_empty() {
            return None;
        }
        let Some(wire) = interfaces::wire_type(&written.text, self.dialect()) else {
            let title = format!("`{}` is not a type of ROS", written.text);
            let mut diagnostic = Diagnostic::new(Code::NO_LAYOUT, written.span, title)
                .label("expected a type as in a `.msg` file, for example `uint8` or `float64[36]`");
            let base = written.text.split(['[', '<']).next().unwrap_or_default();
            if let Some(similar) = most_similar(base, interfaces::SCALARS) {
                let meant = format!("\"{similar}{}\"", &written.text[base.len()..]);
                diagnostic = diagnostic.suggest(format!("did you mean `{similar}`?"), written.span, meant);
            }
            self.report(diagnostic);
            return None;
        };
        if let WireType::Interface { name } = interfaces::innermost(&wire) {
            let declared = self.system.ros.declared.get(name).map(|&index| self.system.message_ids[index]);
            let known =
                declared.is_some() || self.system.ros.interfaces.iter().any(|interface| interface.name == *name);
            if !known {
                match self.layout(name, written.span) {
                    Ok(Some(found)) => self.keep(&found),
                    Ok(None) => {
                        self.not_found(name, written.span, "and declare a message of this type with a block");
                        return None;
                    }
                    Err(()) => return None,
                }
            }
        }
        let all = match interfaces::innermost(&wire) {
            WireType::Interface { .. } => self.system.ros.interfaces.clone(),
            _ => Vec::new(),
        };
        let has = self.language_type(&wire, &all, written.span);
        if !fits(ty, &has) {
            let title = format!("`{}` on the wire is not {}", written.text, type_in_words(ty));
            let diagnostic = Diagnostic::new(Code::NO_LAYOUT, written.span, title)
                .label(format!("expected a type of ROS for `{}`", self.text(field.ty.span)))
                .note(format!("values of this type are {}", expected(&has)));
            self.report(diagnostic);
            return None;
        }
        Some(wire)
    }

    /// What the fields of a layout are in the language. `all` has the layouts of what it contains.
    fn fields_of(&mut self, layout: &Interface, all: &[Interface], at: Span) -> Vec<model::Field> {
        let line = self.sources.position(at).line;
        let mut field = |field: &InterfaceField| {
            let declaration = Declaration { name: field.name.clone(), span: at, line, doc: String::new() };
            model::Field { declaration, ty: self.language_type(&field.ty, all, at), optional: false }
        };
        let fields = layout.fields.iter().filter(|field| field.name != interfaces::NO_FIELDS);
        fields.map(&mut field).collect()
    }

    /// What a type on the wire is in the language.
    fn language_type(&mut self, wire: &WireType, all: &[Interface], at: Span) -> Type {
        match wire {
            WireType::Primitive { primitive: Primitive::Bool } => Type::Bool,
            WireType::Primitive { primitive: Primitive::Float32 | Primitive::Float64 } => Type::Real(None),
            WireType::Primitive { .. } => Type::Int(None),
            WireType::String { .. } | WireType::WString { .. } => Type::Text,
            WireType::Array { of, .. } | WireType::Sequence { of, .. } => {
                Type::List(Box::new(self.language_type(of, all, at)))
            }
            WireType::Interface { name } => {
                if let Some(&index) = self.system.ros.declared.get(name) {
                    return Type::Message(self.system.message_ids[index]);
                }
                if interfaces::is_time(name) {
                    return Type::Real(Some(Unit::seconds()));
                }
                let layout = all.iter().find(|interface| interface.name == *name);
                match layout {
                    Some(layout) if interfaces::is_point(layout) => Type::Point(None),
                    Some(layout) => Type::Message(self.implicit(layout, all, at)),
                    None => unreachable!("a layout comes with those of what it contains"),
                }
            }
        }
    }

    /// The message of a layout that no file declares: named by the last part of its name, or with a number after that.
    pub(super) fn implicit(&mut self, layout: &Interface, all: &[Interface], at: Span) -> MessageId {
        if let Some(&id) = self.system.ros.implicit.get(&layout.name) {
            return id;
        }
        let fields = self.fields_of(layout, all, at);
        let last = layout.name.rsplit('/').next().unwrap_or_default().replace('_', "");
        let mut numbers = 2..;
        let mut name = last.clone();
        while !self.system.ros.taken.insert(name.to_upper_camel_case()) {
            name = format!("{last}{}", numbers.next().unwrap_or(0u32));
        }
        let line = self.sources.position(at).line;
        let doc = format!("The ROS type `{}`.", layout.name);
        let declaration = Declaration { name, span: at, line, doc };
        let constants = self.constants_defined(&layout.name);
        let message = model::Message { declaration, fields, interface: Some(layout.name.clone()), constants };
        let id = self.add_message(Some(message), at);
        self.system.ros.implicit.insert(layout.name.clone(), id);
        id
    }
}

/// Whether a declared type can stand for that of a layout: the same, but for units that the layout does not have.
fn fits(declared: &Type, layout: &Type) -> bool {
    match (declared, layout) {
        (Type::Bool, Type::Bool)
        | (Type::Text, Type::Text)
        | (Type::Int(_), Type::Int(None))
        | (Type::Real(_), Type::Real(None))
        | (Type::Point(_), Type::Point(None)) => true,
        (Type::Real(unit), Type::Real(of_layout)) => {
            unit.as_ref().map(Unit::text) == of_layout.as_ref().map(Unit::text)
        }
        (Type::List(declared), Type::List(layout)) => fits(declared, layout),
        (Type::Message(declared), Type::Message(layout)) => declared == layout,
        _ => false,
    }
}

/// The type of a layout in a message.
fn expected(ty: &Type) -> String {
    fn written(ty: &Type) -> Option<String> {
        let with = |word: &str, unit: &Option<Unit>| {
            Some(unit.as_ref().map_or(word.to_owned(), |unit| format!("{word}[{}]", unit.text())))
        };
        match ty {
            Type::Bool => Some("bool".to_owned()),
            Type::Int(unit) => with("int", unit),
            Type::Real(unit) => with("real", unit),
            Type::Text => Some("text".to_owned()),
            Type::Point(unit) => with("point", unit),
            Type::List(of) => written(of).map(|of| format!("list of {of}")),
            Type::Message(_) => None,
        }
    }
    match (written(ty), ty) {
        (Some(written), _) => format!("`{written}`"),
        (None, Type::List(_)) => "a list of messages of its own type".to_owned(),
        (None, _) => "a message of its own type".to_owned(),
    }
}
