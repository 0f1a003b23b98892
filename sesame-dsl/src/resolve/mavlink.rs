//! Topics whose names say which messages they carry, compared with the definitions in the user's files.

use std::collections::{BTreeMap, BTreeSet};

use sesame_plan::Interface;
use sesame_plan::mavlink::{self, TopicName};

use super::Resolver;
use super::words::{list, type_in_words};
use crate::diagnostic::{Code, Diagnostic};
use crate::interfaces::DialectMessage;
use crate::model::{Id as _, MessageId, Type};
use crate::similar::most_similar;
use crate::syntax::ast::{self, Name, Text, TypeKind};

/// The messages that files define, by their names; `None` where no files are read.
type Defined = Option<BTreeMap<String, DialectMessage>>;

impl<'a> Resolver<'a> {
    /// Compares all topics with the definitions that their simulator names, and those that a lab's names. What has a
    /// mistake is unknown from then on.
    pub(super) fn defined_messages(&mut self) {
        let file = self.file;
        let of_labs = file.physicals.iter().flat_map(|lab| &lab.simulators).map(|(_, simulator)| simulator);
        let transports = self.simulators().take(1).chain(of_labs).filter_map(|simulator| simulator.transport.as_ref());
        let mut read: BTreeSet<Vec<&str>> = BTreeSet::new();
        for transport in transports.filter(|transport| transport.kind.properties().named_messages) {
            let files = transport.settings.types.first().map(|(_, files)| files.as_slice()).unwrap_or_default();
            if read.insert(files.iter().map(|file| file.text.as_str()).collect()) {
                let defined = self.definitions(files);
                self.topics_as_defined(&defined);
            }
        }
    }

    /// What these files define.
    fn definitions(&mut self, files: &'a [Text]) -> Defined {
        // Empty texts were reported where they were read.
        if files.is_empty() || files.iter().any(|file| file.text.trim().is_empty()) {
            return None;
        }
        let written: Vec<String> = files.iter().map(|file| file.text.clone()).collect();
        match self.interfaces.dialect(&written, self.sources.file(self.root).name()) {
            Ok(defined) => Some(
                defined?
                    .into_iter()
                    .map(|message| (message.interface.name.clone(), message))
                    .collect::<BTreeMap<_, _>>(),
            ),
            Err(mistakes) => {
                for mistake in mistakes {
                    let Some(file) = files.get(mistake.named) else { continue };
                    let title = format!("the definitions in `{}` cannot be used", file.text);
                    let diagnostic = Diagnostic::new(Code::NO_LAYOUT, file.span, title).label(mistake.why);
                    self.report(diagnostic.note(
                        "expected the XML file of a dialect, such as `common.xml`, relative to the folder of the \
                         `.sesame` file",
                    ));
                }
                None
            }
        }
    }

    fn topics_as_defined(&mut self, defined: &Defined) {
        // A message that several topics carry is compared with each definition once.
        let mut compared = BTreeMap::new();
        for (index, topic) in self.ast_topics().enumerate() {
            let Some(resolved) = self.system.topics[index].as_ref() else { continue };
            let (paths, ty) = (resolved.paths.clone(), resolved.ty.clone());
            let mut names = BTreeSet::new();
            let mut correct = true;
            for path in &paths {
                match TopicName::read(path) {
                    Ok(name) => _ = names.insert(name.message),
                    Err(why) => {
                        let title =
                            format!("`{path}` does not say which messages topic `{}` has", topic.head.name.text);
                        self.report(Diagnostic::new(Code::BAD_PATH, topic.path.span, title).label(why));
                        correct = false;
                    }
                }
            }
            for name in names {
                let Some(defined) = defined else { break };
                let Some(message) = defined.get(name) else {
                    self.not_defined(topic, name, defined);
                    correct = false;
                    continue;
                };
                let Type::Message(id) = ty else {
                    self.not_a_message(topic, &ty, &message.interface);
                    correct = false;
                    break;
                };
                correct &=
                    *compared.entry((id, name.to_owned())).or_insert_with(|| self.as_defined(topic, id, message));
            }
            if !correct {
                self.system.topics[index] = None;
            }
        }
    }

    /// Reports a topic with messages that no file defines.
    fn not_defined(&mut self, topic: &ast::Topic, name: &str, defined: &BTreeMap<String, DialectMessage>) {
        let title = format!("the definitions have no message `{name}`");
        let mut diagnostic = Diagnostic::new(Code::NO_LAYOUT, topic.path.span, title)
            .label("not in the files that the simulator names with `types`");
        if self.compared.more(defined.len())
            && let Some(similar) = most_similar(name, defined.keys().map(String::as_str))
        {
            let written = &topic.path.text;
            if let Some(before) = written.strip_suffix(name) {
                let meant = sesame_notation::quoted(&format!("{before}{similar}"));
                diagnostic = diagnostic.suggest(format!("did you mean `{similar}`?"), topic.path.span, meant);
            } else {
                diagnostic = diagnostic.note(format!("they have `{similar}`"));
            }
        }
        self.report(diagnostic);
    }

    /// Reports a topic whose values are not messages.
    fn not_a_message(&mut self, topic: &ast::Topic, ty: &Type, defined: &Interface) {
        let title = format!("topic `{}` does not carry a message", topic.head.name.text);
        let mut diagnostic = Diagnostic::new(Code::WRONG_TYPE, topic.ty.span, title).label(format!(
            "expected a message with fields of `{}`, not {}",
            defined.name,
            type_in_words(ty)
        ));
        let fields = defined.fields.iter();
        if let Some((name, word)) =
            fields.into_iter().find_map(|field| Some((&field.name, mavlink::nearest_type(&field.ty, "")?)))
        {
            diagnostic = diagnostic.note(format!("for example `message State {{ {name}: {word} }}`"));
        }
        self.report(diagnostic);
    }

    /// Whether all fields of a message are those of a definition. The message then has the constants of their
    /// enumerations.
    fn as_defined(&mut self, topic: &ast::Topic, id: MessageId, defined: &DialectMessage) -> bool {
        let DialectMessage { interface: defined, constants } = defined;
        let declared = self.system.message_ids.iter().position(|of| *of == id);
        let Some(message) = declared.and_then(|at| self.ast_messages().nth(at)) else { return true };
        if self.system.messages[id.index()].is_none() {
            return true;
        }
        let mut correct = true;
        for field in &message.fields {
            let name = &field.head.name;
            match defined.fields.iter().find(|of| of.name == name.text) {
                Some(of) if can_be(&field.ty, &of.ty) => {}
                Some(of) => {
                    self.other_type(topic, field, defined, of);
                    correct = false;
                }
                None => {
                    self.no_such_field(topic, name, defined);
                    correct = false;
                }
            }
        }
        if let Some(own) = &mut self.system.messages[id.index()] {
            let fields = message.fields.iter().map(|field| &field.head.name.text);
            for name in fields {
                for (_, constant) in constants.iter().filter(|(field, _)| field == name) {
                    if own.constants.iter().all(|known| known.name != constant.name) {
                        own.constants.push(constant.clone());
                    }
                }
            }
        }
        correct
    }

    fn no_such_field(&mut self, topic: &ast::Topic, name: &Name, defined: &Interface) {
        let title = format!("`{}` has no field named `{}`", defined.name, name.text);
        let mut diagnostic = Diagnostic::new(Code::UNKNOWN_NAME, name.span, title)
            .label("unknown field")
            .secondary(topic.path.span, format!("the message is that of topic `{}`", topic.head.name.text));
        let known: Vec<&str> = defined.fields.iter().map(|field| field.name.as_str()).collect();
        if self.compared.more(known.len()) {
            diagnostic = match most_similar(&name.text, known.iter().copied()) {
                Some(similar) => diagnostic.did_you_mean(name.span, similar),
                None => diagnostic.note(format!("its fields are {}", list(&known))),
            };
        }
        self.report(diagnostic);
    }

    fn other_type(
        &mut self,
        topic: &ast::Topic,
        field: &ast::Field,
        defined: &Interface,
        of: &sesame_plan::InterfaceField,
    ) {
        let title = format!("field `{}` of `{}` is of another type", of.name, defined.name);
        let mut diagnostic = Diagnostic::new(Code::NO_LAYOUT, field.ty.span, title)
            .label(format!("expected {}", mavlink::types_in_words(&of.ty)))
            .secondary(topic.path.span, format!("the message is that of topic `{}`", topic.head.name.text));
        let (_, word, unit) = parts(&field.ty);
        if let Some(meant) = mavlink::nearest_type(&of.ty, word) {
            let unit = unit.filter(|_| meant.ends_with("int") || meant.ends_with("real"));
            let meant = unit.map_or(meant.clone(), |unit| format!("{meant}[{unit}]"));
            diagnostic = diagnostic.suggest(format!("declare it as `{meant}`"), field.ty.span, meant);
        }
        self.report(diagnostic);
    }
}

/// Whether a field of a definition can be declared so.
fn can_be(declared: &ast::Type, defined: &sesame_plan::WireType) -> bool {
    let (list, word, _) = parts(declared);
    mavlink::can_be_declared(defined, list, word)
}

/// Whether a type is a list, the word for what it is or holds, which is empty if definitions have no such type, and the
/// unit.
fn parts(ty: &ast::Type) -> (bool, &'static str, Option<&str>) {
    let (is_list, of) = if let TypeKind::List(of) = &ty.kind { (true, &**of) } else { (false, ty) };
    let word = match &of.kind {
        TypeKind::Bool => "bool",
        TypeKind::Int => "int",
        TypeKind::Real => "real",
        TypeKind::Text => "text",
        TypeKind::Point | TypeKind::List(_) | TypeKind::Message(_) => "",
    };
    (is_list, word, of.unit.as_ref().map(|unit| unit.text.as_str()))
}
