//! Message types: their order, their size, and the types of their fields.

use std::collections::BTreeMap;

use super::ros_types::Layout;
use super::{Kind, Resolver};
use crate::diagnostic::{Code, Diagnostic};
use crate::model::{self, Id as _, MessageId, Type};
use crate::similar::most_similar;
use crate::span::Span;
use crate::synonyms::meanings;
use crate::syntax::ast::{self, Name, TypeKind};

impl<'a> Resolver<'a> {
    pub(super) fn messages(&mut self) {
        let messages: Vec<&'a ast::Message> = self.ast_messages().collect();
        self.layouts(&messages);
        let (order, cyclic) = self.topological_order(&messages);
        self.system.message_ids = vec![MessageId::from_index(0); messages.len()];
        for &index in &order {
            let layout = std::mem::take(&mut self.system.ros.layouts[index]);
            let message = self.message(messages[index], layout).filter(|_| !cyclic[index]);
            self.system.message_ids[index] = self.add_message(message, messages[index].head.name.span);
        }
    }

    /// Adds a message after those it contains, unless it is too large.
    pub(super) fn add_message(&mut self, message: Option<model::Message>, at: Span) -> MessageId {
        let held = message.iter().flat_map(|message| &message.fields);
        let count = held.map(|field| values_in(&field.ty, &self.system.values)).fold(0, u64::saturating_add);
        let id = MessageId::from_index(self.system.messages.len());
        self.system.values.push(count);
        if let Some(message) = message.as_ref().filter(|_| count > MAX_VALUES) {
            self.too_many_values(message, at, count);
        }
        self.system.messages.push(message.filter(|_| count <= MAX_VALUES));
        id
    }

    /// Reports a message that is too large, unless a message in it is too large and was reported.
    fn too_many_values(&mut self, message: &model::Message, at: Span, count: u64) {
        let model::Message { declaration, fields, interface: _, constants: _ } = message;
        let values = &self.system.values;
        if fields.iter().any(|field| values_in(&field.ty, values) > MAX_VALUES) {
            return;
        }
        let title = format!("message `{}` has {count} values, but the limit is {MAX_VALUES}", declaration.name);
        let mut diagnostic = Diagnostic::new(Code::LARGE_MESSAGE, at, title)
            .label("including the values of the messages in it")
            .note("a list counts as one of its elements");
        let largest = fields.iter().max_by_key(|field| values_in(&field.ty, values));
        if let Some(field) = largest
            && values_in(&field.ty, values) > 1
        {
            let of = values_in(&field.ty, values);
            diagnostic = diagnostic.secondary(field.declaration.span, format!("this field alone has {of} values"));
        }
        self.report(diagnostic);
    }

    /// Positions of messages such that each comes after those it contains, and which of them contain themselves.
    fn topological_order(&mut self, messages: &[&'a ast::Message]) -> (Vec<usize>, Vec<bool>) {
        #[derive(Clone, Copy, PartialEq)]
        enum Mark {
            New,
            Open,
            Done,
        }
        // Contained messages by position, with the place of the mention. Unknown names are reported where types are.
        let contained: Vec<Vec<(usize, Span)>> = messages
            .iter()
            .enumerate()
            .map(|(index, message)| {
                let names = message.fields.iter().filter_map(|field| message_name(&field.ty));
                let of_fields = names.filter_map(|name| {
                    let definition = self.names.get(name.text.as_str())?;
                    (definition.kind == Kind::Message).then_some((definition.index, name.span))
                });
                of_fields.chain(self.contained_by_layout(index, message)).collect()
            })
            .collect();
        let mut marks = vec![Mark::New; messages.len()];
        let mut cyclic = vec![false; messages.len()];
        let mut order = Vec::new();
        for root in 0..messages.len() {
            if marks[root] != Mark::New {
                continue;
            }
            // An explicit stack: a chain of messages may be as long as the file.
            marks[root] = Mark::Open;
            let mut stack = vec![(root, 0)];
            while let Some((message, next)) = stack.pop() {
                let Some(&(inner, mention)) = contained[message].get(next) else {
                    marks[message] = Mark::Done;
                    order.push(message);
                    continue;
                };
                stack.push((message, next + 1));
                match marks[inner] {
                    Mark::Done => {}
                    Mark::New => {
                        marks[inner] = Mark::Open;
                        stack.push((inner, 0));
                    }
                    Mark::Open => {
                        let start = stack.iter().position(|&(open, _)| open == inner).unwrap_or(0);
                        let cycle: Vec<usize> = stack[start..].iter().map(|&(open, _)| open).collect();
                        for &member in &cycle {
                            cyclic[member] = true;
                        }
                        self.recursive(messages, &cycle, mention);
                    }
                }
            }
        }
        (order, cyclic)
    }

    fn recursive(&mut self, messages: &[&'a ast::Message], cycle: &[usize], mention: Span) {
        let name = |index: usize| &messages[index].head.name;
        let first = name(cycle[0]);
        let title = if cycle.len() == 1 {
            format!("message `{}` contains itself", first.text)
        } else {
            let through: Vec<&str> = cycle.iter().skip(1).map(|&index| name(index).text.as_str()).collect();
            format!("message `{}` contains itself through {}", first.text, super::words::list(&through))
        };
        let diagnostic = Diagnostic::new(Code::RECURSIVE_MESSAGE, mention, title)
            .label("a value of this type would be infinite")
            .secondary(first.span, "declared here");
        self.report(diagnostic);
    }

    fn message(&mut self, message: &'a ast::Message, layout: Layout) -> Option<model::Message> {
        let mut first: BTreeMap<&str, Span> = BTreeMap::new();
        let mut fields = Vec::new();
        let mut complete = !message.has_errors;
        for field in &message.fields {
            let name = &field.head.name;
            if let Some(&before) = first.get(name.text.as_str()) {
                let title = format!("field `{}` of `{}` is defined twice", name.text, message.head.name.text);
                self.defined_twice(title, name.span, before);
                complete = false;
            }
            first.entry(&name.text).or_insert(name.span);
            if let Some(word) = field.optional {
                complete &= self.may_be_optional(word, name);
            }
            match self.type_of(&field.ty) {
                Some(ty) => fields.push((field, ty)),
                None => complete = false,
            }
        }
        let interface = match layout {
            Layout::Found(found) => {
                let message = self.message_of_layout(message, fields, &found)?;
                return complete.then_some(message);
            }
            Layout::Block(name) => {
                let layout = self.layout_of_block(&name, &fields)?;
                if complete {
                    self.keep(&[layout]);
                }
                Some(name)
            }
            Layout::None => {
                // Nothing is known of a type that has a mistake.
                complete &= message.ros_type.is_none();
                None
            }
        };
        if message.fields.is_empty() && message.block && !message.has_errors && interface.is_none() {
            let name = &message.head.name;
            self.missing(name.span, &name.text, "a field", "level: real[mm]");
            complete = false;
        }
        let declared = fields.into_iter();
        let fields = declared.map(|(field, ty)| model::Field {
            declaration: self.declaration(&field.head),
            ty,
            optional: field.optional.is_some(),
        });
        let fields = fields.collect();
        let constants = self.constants_of(message, interface.as_deref());
        complete.then(|| model::Message { declaration: self.declaration(&message.head), fields, interface, constants })
    }

    /// Whether messages of the simulator may lack a field; reports the word `optional` if not.
    fn may_be_optional(&mut self, word: Span, field: &'a Name) -> bool {
        let Some((kind, simulator)) = self.without(|kind| kind.optional_fields) else { return true };
        let title = format!("`{}` is optional, but messages of simulator kind `{kind}` have all fields", field.text);
        let diagnostic = Diagnostic::new(Code::NOT_OPTIONAL, word, title)
            .label("only messages in JSON may lack fields")
            .suggest("remove the word", Span { hi: field.span.lo, ..word }, "")
            .secondary(simulator, "the simulator is declared here");
        self.report(diagnostic);
        false
    }

    pub(super) fn type_of(&mut self, ty: &'a ast::Type) -> Option<Type> {
        let unit = match &ty.unit {
            Some(name) => Some(self.unit(name)?),
            None => None,
        };
        let without_unit = |resolver: &mut Self, found: Type| match &ty.unit {
            None => Some(found),
            Some(unit) => {
                let title = format!("`{}` cannot have a unit", resolver.text(ty.span));
                let brackets = Span { lo: unit.span.lo - 1, hi: unit.span.hi + 1, ..unit.span };
                let diagnostic = Diagnostic::new(Code::WRONG_TYPE, unit.span, title)
                    .label("only `int`, `real` and `point` can have a unit")
                    .suggest("remove the unit", brackets, "");
                resolver.report(diagnostic);
                None
            }
        };
        match &ty.kind {
            TypeKind::Bool => without_unit(self, Type::Bool),
            TypeKind::Text => without_unit(self, Type::Text),
            TypeKind::Int => Some(Type::Int(unit)),
            TypeKind::Real => Some(Type::Real(unit)),
            TypeKind::Point => Some(Type::Point(unit)),
            TypeKind::List(of) => Some(Type::List(Box::new(self.type_of(of)?))),
            TypeKind::Message(name) => {
                let index = self.find_type(name)?;
                without_unit(self, Type::Message(self.system.message_ids[index]))
            }
        }
    }

    fn find_type(&mut self, name: &'a Name) -> Option<usize> {
        const SCALARS: [&str; 5] = ["bool", "int", "real", "text", "point"];
        if self.names.contains_key(name.text.as_str()) || self.silent.contains(name.text.as_str()) {
            return self.find(name, Kind::Message);
        }
        self.silent.insert(&name.text);
        if self.file.incomplete {
            return None;
        }
        let comparable = self.compared.more(self.names.len());
        let messages = if comparable { self.names_of(Kind::Message) } else { Vec::new() };
        let mut diagnostic = Diagnostic::new(Code::UNKNOWN_NAME, name.span, format!("no type named `{}`", name.text))
            .label("not a built-in type and not a message of this space");
        // What reads the field or topic is not checked while its type is unknown, so even a synonym is only likely.
        let synonym = meanings(&name.text, |word| SCALARS.contains(&word)).first().map(|synonym| synonym.meant);
        diagnostic = match synonym.or_else(|| most_similar(&name.text, messages.iter().copied().chain(SCALARS))) {
            Some(similar) => diagnostic.did_you_mean(name.span, similar),
            None => diagnostic.note(
                "the types are `bool`, `int`, `real`, `text`, `point`, `list of …` and the messages of this space",
            ),
        };
        self.report(diagnostic);
        None
    }
}

/// The most values that a message may have: a runner represents each message as one Rust value.
const MAX_VALUES: u64 = 10_000;

/// The number of values of a type, given those of messages by their ids.
fn values_in(ty: &Type, messages: &[u64]) -> u64 {
    match ty {
        Type::Bool | Type::Int(_) | Type::Real(_) | Type::Text => 1,
        Type::Point(_) => 3,
        Type::List(of) => values_in(of, messages),
        // Messages that contain themselves have no order, and were reported.
        Type::Message(id) => messages.get(id.index()).copied().unwrap_or(0),
    }
}

/// The message a type mentions, inside of lists too.
fn message_name(ty: &ast::Type) -> Option<&Name> {
    match &ty.kind {
        TypeKind::Message(name) => Some(name),
        TypeKind::List(of) => message_name(of),
        _ => None,
    }
}
