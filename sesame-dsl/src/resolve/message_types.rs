//! Message types: their order, their size, and the types of their fields.

use std::collections::BTreeMap;

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
        let (order, cyclic) = self.topological_order(&messages);
        self.system.message_ids = vec![MessageId::from_index(0); messages.len()];
        for (id, &index) in order.iter().enumerate() {
            self.system.message_ids[index] = MessageId::from_index(id);
        }
        // The number of values of each message, by its id.
        let mut values: Vec<u64> = Vec::new();
        for &index in &order {
            let message = self.message(messages[index]).filter(|_| !cyclic[index]);
            let held = message.iter().flat_map(|message| &message.fields);
            let count = held.map(|field| values_in(&field.ty, &values)).fold(0, u64::saturating_add);
            values.push(count);
            if count > MAX_VALUES {
                self.too_many_values(messages[index], message.as_ref(), count, &values);
            }
            self.system.messages.push(message.filter(|_| count <= MAX_VALUES));
        }
    }

    /// Reports a message that is too large, unless a message in it is too large and was reported.
    fn too_many_values(
        &mut self,
        message: &ast::Message,
        resolved: Option<&model::Message>,
        count: u64,
        values: &[u64],
    ) {
        let fields = resolved.map_or(&[][..], |message| &message.fields);
        if fields.iter().any(|field| values_in(&field.ty, values) > MAX_VALUES) {
            return;
        }
        let name = &message.head.name;
        let title = format!("message `{}` has {count} values, but the limit is {MAX_VALUES}", name.text);
        let mut diagnostic = Diagnostic::new(Code::LARGE_MESSAGE, name.span, title)
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
            .map(|message| {
                let names = message.fields.iter().filter_map(|field| message_name(&field.ty));
                names
                    .filter_map(|name| {
                        let definition = self.names.get(name.text.as_str())?;
                        (definition.kind == Kind::Message).then_some((definition.index, name.span))
                    })
                    .collect()
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
            format!("message `{}` contains itself through {}", first.text, super::list(&through))
        };
        let diagnostic = Diagnostic::new(Code::RECURSIVE_MESSAGE, mention, title)
            .label("a value of this type would be infinite")
            .secondary(first.span, "declared here");
        self.report(diagnostic);
    }

    fn message(&mut self, message: &'a ast::Message) -> Option<model::Message> {
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
            match self.type_of(&field.ty) {
                Some(ty) => fields.push(model::Field { declaration: self.declaration(&field.head), ty }),
                None => complete = false,
            }
        }
        if message.fields.is_empty() && !message.has_errors {
            self.missing(&message.head.name, "a field", "level: real[mm]");
            complete = false;
        }
        complete.then(|| model::Message { declaration: self.declaration(&message.head), fields })
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
