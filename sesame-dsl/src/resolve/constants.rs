//! Constants of messages: what is declared in a message, or in the definition of its type, and what a name stands for.

use super::words::list;
use super::{Kind, Resolver};
use crate::diagnostic::{Code, Diagnostic};
use crate::interfaces::{self, Constant, ConstantValue, Folders};
use crate::model::Id as _;
use crate::similar::most_similar;
use crate::syntax::ast::{self, Path};

impl<'a> Resolver<'a> {
    /// The constants that a message declares, then those of the definition of its type. A name that is declared twice
    /// is reported.
    pub(super) fn constants_of(&mut self, message: &'a ast::Message, interface: Option<&str>) -> Vec<Constant> {
        let mut found: Vec<Constant> = Vec::new();
        for (at, ast::Constant { name, value }) in message.constants.iter().enumerate() {
            let earlier = message.constants[..at].iter().find(|earlier| earlier.name.text == name.text);
            let field = message.fields.iter().find(|field| field.head.name.text == name.text);
            if let Some(first) = earlier.map(|earlier| &earlier.name).or(field.map(|field| &field.head.name)) {
                let title = format!("`{}` of `{}` is defined twice", name.text, message.head.name.text);
                self.defined_twice(title, name.span, first.span);
                continue;
            }
            let value = match value {
                ast::ConstantValue::Text(text) => Some(ConstantValue::Text(text.text.clone())),
                ast::ConstantValue::Number(quantity) => {
                    let what = format!("constant `{}`", name.text);
                    self.value(quantity, None, &what).map(ConstantValue::Number)
                }
            };
            found.extend(value.map(|value| Constant { name: name.text.clone(), value }));
        }
        let defined = interface.map_or_else(Vec::new, |interface| self.constants_defined(interface));
        let new = |constant: &Constant| found.iter().all(|known| known.name != constant.name);
        let new: Vec<Constant> = defined.into_iter().filter(new).collect();
        found.extend(new);
        found
    }

    /// The constants of the definition of an interface.
    pub(super) fn constants_defined(&self, interface: &str) -> Vec<Constant> {
        let known = interfaces::known_constants(interface);
        if !known.is_empty() {
            return known;
        }
        let (written, file) = self.folders();
        self.interfaces.constants(Folders { written: &written, file, dialect: self.dialect() }, interface)
    }

    /// The constants that a name, or `MESSAGE.NAME`, may stand for, with their messages. Reports nothing.
    fn constants_named(&self, path: &Path) -> Vec<(&str, &ConstantValue)> {
        if !path.elements.is_empty() {
            return Vec::new();
        }
        let known = self.names.get(path.topic.text.as_str()).copied();
        let (only, name) = match (path.fields.as_slice(), known) {
            ([], None) => (None, &path.topic.text),
            ([field], Some(message)) if message.kind == Kind::Message => {
                (self.system.message_ids.get(message.index).copied(), &field.text)
            }
            _ => return Vec::new(),
        };
        let messages =
            self.system.messages.iter().enumerate().filter_map(|(at, message)| Some((at, message.as_ref()?)));
        let meant = messages.filter(|(at, _)| only.is_none_or(|only| only.index() == *at));
        let constants = meant.flat_map(|(_, message)| {
            message.constants.iter().map(move |constant| (message.declaration.name.as_str(), constant))
        });
        constants.filter(|(_, constant)| constant.name == *name).map(|(message, of)| (message, &of.value)).collect()
    }

    /// Whether a path is the name of a constant. Reports nothing.
    pub(super) fn is_constant(&self, path: &Path) -> bool {
        !self.constants_named(path).is_empty()
    }

    /// The text that a constant is in all messages that may be meant. Reports nothing.
    pub(super) fn text_constant(&self, path: &Path) -> Option<String> {
        let found = self.constants_named(path);
        let (_, first) = found.first()?;
        match first {
            ConstantValue::Text(text) if found.iter().all(|(_, value)| value == first) => Some(text.clone()),
            _ => None,
        }
    }

    /// What a path stands for if it is the name of a constant; `None` inside of what was reported: a name that means
    /// different things in several messages.
    #[expect(clippy::option_option, reason = "the outer one is for what is not a constant")]
    pub(super) fn constant_of(&mut self, path: &'a Path) -> Option<Option<ConstantValue>> {
        let found = self.constants_named(path);
        if found.is_empty() && self.is_of_message(path) {
            self.no_constant(path, "a number");
            return Some(None);
        }
        let (_, first) = *found.first()?;
        if found.iter().all(|(_, value)| *value == first) {
            return Some(Some(first.clone()));
        }
        let mut messages: Vec<&str> = found.iter().map(|(message, _)| *message).collect();
        messages.dedup();
        let title = format!("`{}` is a constant of {}", path.topic.text, list(&messages));
        let first = messages[0].to_owned();
        let diagnostic = Diagnostic::new(Code::OTHER_KIND, path.span, title)
            .label("it has a different value in each")
            .did_you_mean(path.topic.span, format!("{first}.{}", path.topic.text));
        self.report(diagnostic);
        Some(None)
    }

    /// Whether a path begins with the name of a message that has constants.
    fn is_of_message(&self, path: &Path) -> bool {
        let message = self.names.get(path.topic.text.as_str()).filter(|known| known.kind == Kind::Message);
        let id = message.and_then(|message| self.system.message_ids.get(message.index));
        let message = id.and_then(|id| self.system.messages.get(id.index())?.as_ref());
        path.fields.len() == 1 && message.is_some_and(|message| !message.constants.is_empty())
    }

    /// The numbers of constants that are written with their names; reports anything else.
    pub(super) fn numbers_of_constants(&mut self, names: &'a [Path]) -> Option<Vec<f64>> {
        let numbers: Vec<Option<f64>> = names
            .iter()
            .map(|name| self.number_of_constant(name, "a range such as `[0, 1]`, `true`, `false`"))
            .collect();
        numbers.into_iter().collect()
    }

    /// The number of a constant that is written with its name; reports anything else. `expected` is what else may stand
    /// there.
    pub(super) fn number_of_constant(&mut self, name: &'a Path, expected: &str) -> Option<f64> {
        match self.constant_of(name) {
            Some(Some(ConstantValue::Number(number))) => return Some(number),
            Some(None) => {}
            Some(Some(ConstantValue::Text(text))) => {
                let title = format!("`{}` is the text \"{text}\"", self.text(name.span));
                let label = "expected a constant that is a number; write texts in quotes";
                self.report(Diagnostic::new(Code::WRONG_TYPE, name.span, title).label(label));
            }
            None => self.no_constant(name, expected),
        }
        None
    }

    /// The value of a constant that a filter of a list names. `None` was reported.
    pub(super) fn constant_in_filter(&mut self, path: &'a Path) -> Option<ConstantValue> {
        self.constant_of(path).unwrap_or_else(|| {
            self.no_constant(path, "a number, a text, `true`, `false`");
            None
        })
    }

    fn no_constant(&mut self, path: &'a Path, expected: &str) {
        let written = self.text(path.span).to_owned();
        let all = self.system.messages.iter().flatten().flat_map(|message| &message.constants);
        let all: Vec<String> = all.map(|constant| constant.name.clone()).collect();
        let title = format!("no constant named `{written}`");
        let diagnostic = Diagnostic::new(Code::UNKNOWN_NAME, path.span, title);
        let name = path.fields.last().unwrap_or(&path.topic);
        let diagnostic = match most_similar(&name.text, all.iter().map(String::as_str)) {
            Some(similar) => diagnostic.label("not a constant of any message").did_you_mean(name.span, similar),
            None if !path.fields.is_empty() => diagnostic.label("the message has no such constant"),
            None => diagnostic
                .label(format!("expected {expected}, or the name of a constant"))
                .note("constants are those of messages: `constant IDLE = 0`, or of the definitions of their types"),
        };
        self.report(diagnostic);
    }
}
