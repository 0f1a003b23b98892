//! Paths into messages: fields, elements of lists, and what a formula makes of several of them.

use sesame_plan::{Compared, Filter, FilterKey, Finite, InList, Reduction, Step, WireType};

use super::boolean::relation;
use super::words::type_in_words;
use super::{Kind, Resolver};
use crate::diagnostic::{Code, Diagnostic};
use crate::interfaces::{self, ConstantValue};
use crate::model::{Comparison, FieldPath, Id as _, Input, Members, Memory, Target, TextTest, TopicId, Type};
use crate::similar::most_similar;
use crate::span::Span;
use crate::syntax::ast::{self, ComparedWith, Name, Path};
use crate::units::Unit;

/// Where a path leads.
pub(super) struct Place {
    pub(super) topic: TopicId,
    /// The member of a group that the path names.
    pub(super) only: Option<u32>,
    /// Fields up to the first list whose elements are chosen.
    pub(super) fields: Vec<String>,
    /// From that list on.
    pub(super) steps: Vec<Step>,
    /// Whether it may lead to several values of a message.
    pub(super) many: bool,
    /// The field before the last one, if that is a coordinate of a point.
    pub(super) point: Option<String>,
    pub(super) ty: Type,
}

/// What a formula reads.
pub(super) struct Reading {
    pub(super) field: FieldPath,
    pub(super) members: Members,
    pub(super) list: Option<InList>,
    /// What is computed from successive values, the innermost first.
    pub(super) memory: Vec<Memory>,
    pub(super) ty: Type,
}

impl Reading {
    pub(super) fn input(self, text: Option<TextTest>) -> Input {
        let Reading { field, members, list, memory, ty: _ } = self;
        Input { field, members, list, text, memory }
    }
}

/// What a word before a path makes of the values of a list; `None` for pairs.
fn reduction(word: ast::Members) -> Option<Reduction> {
    Some(match word {
        ast::Members::Min => Reduction::Min,
        ast::Members::Max => Reduction::Max,
        ast::Members::Sum => Reduction::Sum,
        ast::Members::Mean => Reduction::Mean,
        ast::Members::Count => Reduction::Count,
        ast::Members::Length => Reduction::Length,
        ast::Members::Each => Reduction::Each,
        ast::Members::EachPair => return None,
    })
}

/// Whether a word takes all elements of a list at which a path ends or which it passes.
fn takes_all(word: Option<ast::Members>) -> bool {
    word.and_then(reduction).is_some_and(|reduction| reduction != Reduction::Length)
}

impl<'a> Resolver<'a> {
    /// What a formula reads at a path, with the word before it.
    pub(super) fn reading(&mut self, path: &'a Path, word: Option<(ast::Members, Span)>) -> Option<Reading> {
        let before = word.map(|(word, _)| word);
        let Place { topic, only, fields, steps, many, ty, .. } = self.place(path, takes_all(before))?;
        let field = FieldPath { topic, fields };
        let of_list = many || (before == Some(ast::Members::Length) && matches!(ty, Type::List(_)));
        let whole = word.map_or(path.span, |(_, word)| word.to(path.span));
        let Some(reduction) = before.and_then(reduction).filter(|_| of_list) else {
            if many {
                self.several_values(path);
                return None;
            }
            if let Some((ast::Members::Mean | ast::Members::Count | ast::Members::Length, of)) = word {
                let title = format!("`{}` is not a list", self.text(path.span));
                let label = format!("it is {}, and `{} of` is of a list", type_in_words(&ty), self.text(of));
                self.report(Diagnostic::new(Code::WRONG_TYPE, whole, title).label(label));
                return None;
            }
            let members = self.members(path, &field, only, word)?;
            let list = (!steps.is_empty()).then_some(InList { steps, reduction: Reduction::First });
            return Some(Reading { field, members, list, memory: Vec::new(), ty });
        };
        let members = match reduction {
            Reduction::Max => Members::Max,
            Reduction::Sum => Members::Sum,
            _ => Members::Min,
        };
        let members = only.map_or(members, Members::Only);
        let of_group = matches!(reduction, Reduction::Min | Reduction::Max | Reduction::Sum);
        if self.members_of(&field) > 1 && only.is_none() && !of_group {
            let title = format!("`{}` is a group of topics, each with a list", path.topic.text);
            let diagnostic = Diagnostic::new(Code::UNPAIRED, whole, title)
                .label("whose elements are meant is not clear")
                .note("`min of`, `max of` and `sum of` are over the elements of all members")
                .note(format!("to read the list of one member, write its name: {}", self.example_of_member(topic)));
            self.report(diagnostic);
            return None;
        }
        if reduction == Reduction::Sum && matches!(ty, Type::Bool | Type::Text) {
            let title = format!("`{}` is {}, which cannot be summed", self.text(path.span), type_in_words(&ty));
            self.report(Diagnostic::new(Code::WRONG_TYPE, path.span, title).label("expected numbers after `sum of`"));
            return None;
        }
        let ty = match reduction {
            Reduction::Count | Reduction::Length => Type::Int(None),
            _ => ty,
        };
        if matches!(ty, Type::Point(_)) && reduction != Reduction::Each {
            let title = format!("`{}` is a list of points", self.text(path.span));
            let diagnostic = Diagnostic::new(Code::WRONG_TYPE, whole, title)
                .label("points have no order and no sum")
                .note("`each of` stands for each of them, for example `min(distance(p, each of path))`");
            self.report(diagnostic);
            return None;
        }
        Some(Reading { field, members, list: Some(InList { steps, reduction }), memory: Vec::new(), ty })
    }

    fn several_values(&mut self, path: &'a Path) {
        let written = self.text(path.span);
        let title = format!("`{written}` is several values, but one value is needed");
        let diagnostic = Diagnostic::new(Code::WRONG_TYPE, path.span, title)
            .label("expected one value")
            .note("`min of`, `max of`, `mean of`, `sum of` and `count of` make one value of them")
            .suggest("use the least of them", path.span, format!("min of {written}"));
        self.report(diagnostic);
    }

    /// Where a path leads. If `all` elements are taken, so are those of a list that has none chosen.
    pub(super) fn place(&mut self, path: &'a Path, all: bool) -> Option<Place> {
        let index = self.find(&path.topic, Kind::Topic)?;
        let topic = self.system.topics[index].as_ref()?;
        let of_group = topic.paths.len() > 1;
        let ty = topic.ty.clone();
        let (only, elements) = self.member_of_path(TopicId::from_index(index), path)?;
        let place = Place {
            topic: TopicId::from_index(index),
            only,
            fields: Vec::new(),
            steps: Vec::new(),
            many: false,
            point: None,
            ty,
        };
        let mut walk = Walk { place, outer: None, holder: format!("topic `{}`", path.topic.text) };
        for name in &path.fields {
            self.step_into_field(&mut walk, name, all, index)?;
        }
        for step in elements {
            match step {
                ast::Step::Field(name) => self.step_into_field(&mut walk, name, all, index)?,
                step => {
                    let only_topic = of_group && path.fields.is_empty();
                    self.step_into_element(&mut walk, step, all, only_topic.then_some(path))?;
                }
            }
        }
        if all {
            walk.take_all();
        }
        Some(walk.place)
    }

    fn step_into_field(&mut self, walk: &mut Walk, name: &'a Name, all: bool, topic: usize) -> Option<()> {
        if all {
            walk.take_all();
        }
        if let Type::List(_) = &walk.place.ty {
            let title = format!("{} is a list, which has no fields", walk.holder);
            let diagnostic = Diagnostic::new(Code::WRONG_TYPE, name.span, title)
                .label("expected an element before it, such as `[0]`")
                .note(
                    "brackets choose elements: `[0]` by position, `[name == \"elbow\"]` by a field, `[*]` all of them",
                );
            self.report(diagnostic);
            return None;
        }
        let ty = if let Type::Point(unit) = &walk.place.ty {
            let unit = unit.clone();
            self.is_coordinate(name)?;
            walk.place.point = Some(walk.holder.clone());
            Type::Real(unit)
        } else {
            let Some(ty) = self.field_in(&walk.place.ty, &walk.holder, name) else {
                self.note_on_members(topic, name);
                return None;
            };
            ty
        };
        if walk.place.steps.is_empty() {
            walk.place.fields.push(name.text.clone());
        } else {
            walk.place.steps.push(Step::Field(name.text.clone()));
        }
        walk.outer = Some(std::mem::replace(&mut walk.place.ty, ty));
        walk.holder = format!("field `{}`", name.text);
        Some(())
    }

    fn is_coordinate(&mut self, name: &Name) -> Option<()> {
        if matches!(name.text.as_str(), "x" | "y" | "z") {
            return Some(());
        }
        let title = format!("a point has no coordinate `{}`", name.text);
        let diagnostic = Diagnostic::new(Code::UNKNOWN_NAME, name.span, title).label("expected `x`, `y` or `z`");
        self.report(match name.text.to_lowercase().as_str() {
            lower @ ("x" | "y" | "z") => diagnostic.did_you_mean(name.span, lower),
            _ => diagnostic,
        });
        None
    }

    /// `group` is the path of a group of topics, if its members may be meant.
    fn step_into_element(
        &mut self,
        walk: &mut Walk,
        step: &'a ast::Step,
        all: bool,
        group: Option<&Path>,
    ) -> Option<()> {
        let span = step.span();
        let Type::List(of) = walk.place.ty.clone() else {
            let title = format!("{} has no elements", walk.holder);
            let label = format!("it is {}", type_in_words(&walk.place.ty));
            let mut diagnostic = Diagnostic::new(Code::WRONG_TYPE, span, title).label(label);
            if group.is_some() {
                let example = group.map_or(String::new(), |path| self.example_of_path(path));
                diagnostic = diagnostic.note(format!(
                    "a member of a group is chosen by its name: {example}; `each of` stands for each of them, `max \
                     of` for the greatest value, and the name alone for the least"
                ));
            }
            self.report(diagnostic);
            return None;
        };
        let chosen = match step {
            ast::Step::Field(_) => return None,
            ast::Step::Element(at, _) => Step::Element(self.position(at, walk)?),
            ast::Step::Elements(first, last, _) => {
                let (first_at, last_at) = (self.position(first, walk)?, self.position(last, walk)?);
                if first_at > last_at {
                    let title = format!("`{}` chooses no element", self.text(span));
                    let diagnostic = Diagnostic::new(Code::OUT_OF_RANGE, span, title)
                        .label("the first position is after the last")
                        .suggest("swap the two", span, format!("[{last_at}..{first_at}]"));
                    self.report(diagnostic);
                    return None;
                }
                walk.place.many = true;
                Step::Elements { first: first_at, last: last_at }
            }
            ast::Step::Each(_) => {
                walk.place.many = true;
                Step::Each
            }
            ast::Step::Filter(filter) => {
                // Without a word, the first element that passes counts.
                walk.place.many |= all;
                Step::Filter(self.filter(filter, &of, walk.outer.as_ref())?)
            }
        };
        walk.place.steps.push(chosen);
        walk.place.ty = *of;
        walk.outer = None;
        "an element".clone_into(&mut walk.holder);
        Some(())
    }

    /// A position in the list at hand, which may have it.
    fn position(&mut self, count: &ast::Count, walk: &Walk) -> Option<u32> {
        let Ok(position) = u32::try_from(count.value?) else {
            let title = format!("`{}` is not a valid index", self.text(count.span));
            let label = "expected a whole number below 2^32";
            self.report(Diagnostic::new(Code::BAD_NUMBER, count.span, title).label(label));
            return None;
        };
        if let Some((longest, wire)) = self.longest(walk).filter(|(longest, _)| position >= *longest) {
            let title = format!("{} has no element {position}: it is `{wire}`", walk.holder);
            let diagnostic = Diagnostic::new(Code::OUT_OF_RANGE, count.span, title)
                .label(format!("expected at most {}", longest - 1))
                .note("positions count from 0");
            self.report(diagnostic);
            return None;
        }
        Some(position)
    }

    /// How many elements the list at hand can have, and its type on the wire, if that says so.
    fn longest(&self, walk: &Walk) -> Option<(u32, String)> {
        let name = match walk.place.steps.last() {
            Some(Step::Field(name)) => name,
            Some(_) => return None,
            None => walk.place.fields.last()?,
        };
        let ty = self.on_wire(walk.outer.as_ref()?, name)?;
        match ty {
            WireType::Array { length, .. } => Some((*length, interfaces::in_words(ty))),
            WireType::Sequence { bound: Some(bound), .. } => Some((*bound, interfaces::in_words(ty))),
            _ => None,
        }
    }

    /// The type on the wire of a field of a message, if the message has a layout.
    fn on_wire(&self, message: &Type, field: &str) -> Option<&WireType> {
        let Type::Message(id) = message else { return None };
        let interface = self.system.messages.get(id.index())?.as_ref()?.interface.as_ref()?;
        let layout = self.system.ros.interfaces.iter().find(|layout| layout.name == *interface)?;
        Some(&layout.fields.iter().find(|known| known.name == field)?.ty)
    }

    /// The type on the wire of the text at a place in the messages of a topic, if a layout says it.
    fn text_on_wire(&self, topic: TopicId, place: &[Step]) -> Option<&WireType> {
        let mut ty = &self.system.topics.get(topic.index())?.as_ref()?.ty;
        let mut wire = None;
        for step in place {
            match (step, ty) {
                (Step::Field(name), Type::Message(id)) => {
                    wire = self.on_wire(ty, name);
                    let fields = &self.system.messages.get(id.index())?.as_ref()?.fields;
                    ty = &fields.iter().find(|field| field.declaration.name == *name)?.ty;
                }
                (_, Type::List(of)) => ty = of,
                _ => return None,
            }
        }
        wire.map(interfaces::innermost)
    }

    /// Whether texts are no longer than the type at each of their places permits; reported if not.
    pub(super) fn texts_fit(&mut self, target: &Target, written: &'a ast::Target, texts: &'a [ast::Text]) -> bool {
        let mut fit = true;
        for text in texts {
            let wires = target.places.iter().filter_map(|place| self.text_on_wire(target.topic, place));
            let exceeded = |wire: &WireType| wire.exceeded_by(&text.text).map(|found| (found, wire.clone()));
            let Some(((length, bound), wire)) = wires.into_iter().find_map(exceeded) else { continue };
            fit = false;
            let units = if matches!(wire, WireType::WString { .. }) { "UTF-16 code units" } else { "bytes" };
            let (of, wire) = (self.text(written.span), interfaces::in_words(&wire));
            let title = format!("`{}` is too long for a `{wire}` in `{of}`", self.text(text.span));
            let diagnostic = Diagnostic::new(Code::OUT_OF_RANGE, text.span, title)
                .label(format!("expected at most {bound} {units}, not {length}"));
            self.report(diagnostic);
        }
        fit
    }

    /// A filter for a list whose elements have this type, in a message of the type `outer`.
    fn filter(&mut self, filter: &'a ast::Filter, of: &Type, outer: Option<&Type>) -> Option<Filter> {
        let (key, ty) = match filter.key.as_slice() {
            [] => (FilterKey::Own(Vec::new()), of.clone()),
            [name] if self.own_field(of, &name.text).is_none() && self.beside(outer, &name.text).is_some() => {
                (FilterKey::Parallel(name.text.clone()), self.beside(outer, &name.text)?)
            }
            [name] if !matches!(of, Type::Message(_) | Type::Point(_)) => {
                self.nothing_beside(name, outer);
                return None;
            }
            names => {
                let mut ty = of.clone();
                let mut holder = "an element".to_owned();
                for name in names {
                    ty = match ty {
                        Type::Point(unit) => {
                            self.is_coordinate(name)?;
                            Type::Real(unit)
                        }
                        ty => self.field_in(&ty, &holder, name)?,
                    };
                    holder = format!("field `{}`", name.text);
                }
                (FilterKey::Own(names.iter().map(|name| name.text.clone()).collect()), ty)
            }
        };
        let by = relation(filter.by);
        let what = format!("`{}`", self.text(filter.key_span));
        let equality = matches!(by, Comparison::Equal | Comparison::NotEqual);
        let constant = match &filter.with {
            ComparedWith::Constant(name) => Some(self.constant_in_filter(name)?),
            _ => None,
        };
        let compared = |value, unit: &Option<Unit>| Compared::Number {
            value: Finite(value),
            unit: unit.as_ref().map(|unit| unit.text().to_owned()),
        };
        let with = match (&filter.with, &constant, &ty) {
            (_, Some(ConstantValue::Text(text)), Type::Text) if equality => Compared::Text(text.clone()),
            (_, Some(ConstantValue::Number(number)), Type::Int(unit) | Type::Real(unit)) => compared(*number, unit),
            (ComparedWith::Text(text), _, Type::Text) if equality => Compared::Text(text.text.clone()),
            (ComparedWith::Truth(truth, _), _, Type::Bool) if equality => Compared::Truth(*truth),
            (ComparedWith::Number(number), _, Type::Int(unit) | Type::Real(unit)) => {
                let value = self.value(number, unit.as_ref(), &what)?;
                compared(value, unit)
            }
            (with, _, ty) => {
                let span = match with {
                    ComparedWith::Number(number) => number.span,
                    ComparedWith::Text(text) => text.span,
                    ComparedWith::Truth(_, span) => *span,
                    ComparedWith::Constant(path) => path.span,
                };
                let fits =
                    matches!((with, ty), (ComparedWith::Text(_), Type::Text) | (ComparedWith::Truth(..), Type::Bool));
                let diagnostic = if fits {
                    let title = format!("{what} is {}, which has no order", type_in_words(ty));
                    Diagnostic::new(Code::WRONG_TYPE, filter.span, title).label("compare with `==` or `!=`")
                } else {
                    let title = format!("`{}` cannot be compared with {what}", self.text(span));
                    Diagnostic::new(Code::WRONG_TYPE, span, title).label(format!("{what} is {}", type_in_words(ty)))
                };
                self.report(diagnostic);
                return None;
            }
        };
        Some(Filter { key, by, with })
    }

    /// Reports that a message has no list with the name of a filter's key, and the elements have no fields either.
    fn nothing_beside(&mut self, name: &Name, outer: Option<&Type>) {
        let message = match outer {
            Some(Type::Message(id)) => self.system.messages.get(id.index()).and_then(Option::as_ref),
            _ => None,
        };
        let fields = message.iter().flat_map(|message| &message.fields);
        let lists = fields.filter(|field| matches!(field.ty, Type::List(_)));
        let lists: Vec<&str> = lists.map(|field| field.declaration.name.as_str()).collect();
        let title = format!("the message has no list named `{}`", name.text);
        let diagnostic = Diagnostic::new(Code::UNKNOWN_NAME, name.span, title)
            .label("expected `*` for the element itself, or a list of the same message");
        let diagnostic = match most_similar(&name.text, lists.iter().copied()) {
            Some(similar) => diagnostic.did_you_mean(name.span, similar),
            None => diagnostic,
        };
        self.report(diagnostic);
    }

    /// The type of a field of an element; `None` also for one that does not exist. Reports nothing.
    fn own_field(&self, of: &Type, name: &str) -> Option<Type> {
        let Type::Message(id) = of else { return None };
        let message = self.system.messages.get(id.index())?.as_ref()?;
        message.fields.iter().find(|field| field.declaration.name == name).map(|field| field.ty.clone())
    }

    /// The type of the elements of a list of this name in a message.
    fn beside(&self, outer: Option<&Type>, name: &str) -> Option<Type> {
        match self.own_field(outer?, name)? {
            Type::List(of) => Some(*of),
            _ => None,
        }
    }

    /// The type of what a formula reads at a path; `None` also for a path with a mistake. Reports nothing.
    pub(super) fn type_read(&self, path: &Path, word: Option<ast::Members>) -> Option<Type> {
        let definition = self.names.get(path.topic.text.as_str()).filter(|found| found.kind == Kind::Topic)?;
        let mut ty = self.system.topics.get(definition.index)?.as_ref()?.ty.clone();
        let all = takes_all(word);
        let elements = match path.elements.as_slice() {
            [ast::Step::Element(..), rest @ ..]
                if self.may_name_a_member(TopicId::from_index(definition.index), path) =>
            {
                rest
            }
            elements => elements,
        };
        let element = |ty: Type| match ty {
            Type::List(of) if all => *of,
            other => other,
        };
        let field = |ty: Type, name: &Name| match element(ty) {
            Type::Point(unit) if matches!(name.text.as_str(), "x" | "y" | "z") => Some(Type::Real(unit)),
            ty => self.own_field(&ty, &name.text),
        };
        for name in &path.fields {
            ty = field(ty, name)?;
        }
        for step in elements {
            ty = match (step, ty) {
                (ast::Step::Field(name), ty) => field(ty, name)?,
                (_, Type::List(of)) => *of,
                _ => return None,
            };
        }
        match word {
            Some(ast::Members::Count | ast::Members::Length) => Some(Type::Int(None)),
            _ => Some(element(ty)),
        }
    }

    /// Checks that a formula which is evaluated for each element of a list is one that can be: the elements are of one
    /// list, and nothing lasts from one message to the next, in which the same element may be at another place.
    pub(super) fn elements_fit(&mut self, inputs: &[Input], lasting: Option<&str>, whole: Span) -> Option<()> {
        let each = inputs.iter().filter_map(|input| {
            let list = input.list.as_ref().filter(|list| list.reduction == Reduction::Each)?;
            let end = list.steps.iter().rposition(|step| !matches!(step, Step::Field(_)))?;
            Some((&input.field, &list.steps[..=end]))
        });
        let mut each = each.peekable();
        let first = each.peek().copied();
        let Some(first) = first else { return Some(()) };
        if let Some(lasting) = lasting {
            let title = format!("{lasting} cannot be combined with `each of` a list");
            let diagnostic = Diagnostic::new(Code::UNPAIRED, whole, title)
                .label("an element has no identity from one message to the next")
                .note("`min of`, `max of`, `mean of`, `sum of` and `count of` make one value of a list");
            self.report(diagnostic);
            return None;
        }
        if each.any(|other| other != first) {
            let diagnostic = Diagnostic::new(Code::UNPAIRED, whole, "`each of` refers to two lists in one formula")
                .label("expected the elements of one list")
                .note("the formula is evaluated for each element, with the values that this element has");
            self.report(diagnostic);
            return None;
        }
        Some(())
    }
}

/// The way along a path.
struct Walk {
    place: Place,
    /// The type of the message that has the last field.
    outer: Option<Type>,
    /// The value at hand, in words.
    holder: String,
}

impl Walk {
    /// Takes all elements, if the value at hand is a list.
    fn take_all(&mut self) {
        if let Type::List(of) = &self.place.ty {
            self.place.ty = (**of).clone();
            self.place.steps.push(Step::Each);
            self.place.many = true;
        }
    }
}
