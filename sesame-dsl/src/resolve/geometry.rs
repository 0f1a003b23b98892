//! Points in formulas: their distances from each other and from regions.

use super::Resolver;
use super::elements::Reading;
use super::formula::{Number, position};
use super::read::{Read, memory_named, read_in};
use super::region::scaled;
use crate::diagnostic::{Code, Diagnostic, Suggestion};
use crate::model::{self, Distance, Expression, FieldPath, Input, Point, SignedDistance, Type};
use crate::span::Span;
use crate::synonyms::region_otherwise;
use crate::syntax::ast::{self, ExpressionKind, Members, Path};
use crate::units::{Unit, convert, dimension};

/// An argument that is a point.
enum Operand<'a> {
    /// From messages: the position of an input, with its unit.
    Read { at: u32, unit: Option<Unit> },
    /// In the space, with its unit.
    Written(&'a ast::Point, Option<Unit>),
}

impl<'a> Resolver<'a> {
    /// The distance of two points, or those of the pairs of a group's members.
    pub(super) fn distance(
        &mut self,
        inputs: &mut Vec<Input>,
        call: Span,
        arguments: &'a [ast::Expression],
    ) -> Option<Number> {
        let (from, to) = match arguments {
            [pairs] => {
                if let ExpressionKind::Members(Members::EachPair, word, path) = &pairs.kind {
                    return self.pairs(inputs, path, *word);
                }
                self.one_point(call, pairs);
                return None;
            }
            [pairs, other] if matches!(pairs.kind, ExpressionKind::Members(Members::EachPair, ..)) => {
                let ExpressionKind::Members(_, word, path) = &pairs.kind else { return None };
                return self.pairs_of_two(inputs, path, *word, other);
            }
            [from, to] => (from, to),
            _ => {
                self.wrong_count(call, "distance", "two points", arguments.len());
                return None;
            }
        };
        if self.same_point(call, from, to) {
            return None;
        }
        // Checked first, so that no suggestion leads to members that cannot be paired.
        if let (Some((_, left)), Some((_, right))) = (self.group_of(from), self.group_of(to))
            && self.members_of(&left) > 1
            && self.members_of(&right) > 1
        {
            self.same_members(left.topic, right.topic, call)?;
        }
        // Both are resolved, so that a mistake in one does not hide one in the other.
        let (left, right) = (self.operand(inputs, from), self.operand(inputs, to));
        let (left, right) = (left?, right?);
        // As with numbers, what is written takes the unit of what is read.
        match (left, right) {
            (Operand::Read { at, unit }, Operand::Written(point, _)) => {
                let to = Point::Constant(self.coordinates(point, unit.as_ref(), &self.quoted(from))?);
                Some((between(Point::Input(at), to, 1.0), unit))
            }
            (Operand::Written(point, _), Operand::Read { at, unit }) => {
                let from = Point::Constant(self.coordinates(point, unit.as_ref(), &self.quoted(to))?);
                Some((between(from, Point::Input(at), 1.0), unit))
            }
            (Operand::Written(left, unit), Operand::Written(right, _)) => {
                let left = Point::Constant(self.coordinates(left, unit.as_ref(), "this point")?);
                let right = Point::Constant(self.coordinates(right, unit.as_ref(), &self.quoted(from))?);
                Some((between(left, right, 1.0), unit))
            }
            (Operand::Read { at: from_at, unit }, Operand::Read { at: to_at, unit: to_unit }) => {
                let [found, wanted] = [dimension(to_unit.as_ref()), dimension(unit.as_ref())];
                if found != wanted {
                    let [from_name, to_name] = [from, to].map(|side| self.text(side.span));
                    let title = format!("`{to_name}` is {}, but `{from_name}` is {}", found.name(), wanted.name());
                    let label = format!("expected {}", wanted.name());
                    self.report(Diagnostic::new(Code::WRONG_UNIT, to.span, title).label(label));
                    return None;
                }
                let scale = convert(1.0, to_unit.as_ref(), unit.as_ref());
                Some((between(Point::Input(from_at), Point::Input(to_at), scale), unit))
            }
        }
    }

    pub(super) fn quoted(&self, expression: &ast::Expression) -> String {
        format!("`{}`", self.text(expression.span))
    }

    /// The distances among a group's members.
    fn pairs(&mut self, inputs: &mut Vec<Input>, path: &'a Path, word: Span) -> Option<Number> {
        let (read, unit) = self.point_read(&Read::plain(path))?;
        if read.list.is_some() {
            let title = "`each pair of` is of the members of a group, not of the elements of a list";
            let label = "expected a group of topics";
            self.report(Diagnostic::new(Code::UNPAIRED, word.to(path.span), title).label(label));
            return None;
        }
        let [first, second] = self.pair_of((path, &read.field), None, word)?;
        let [from, to] = [first, second].map(|input| Point::Input(position(inputs, input)));
        Some((between(from, to, 1.0), unit))
    }

    /// The distances of each member of a group from each member of another: `distance(each pair of robots, people)`.
    fn pairs_of_two(
        &mut self,
        inputs: &mut Vec<Input>,
        path: &'a Path,
        word: Span,
        other: &'a ast::Expression,
    ) -> Option<Number> {
        let whole = word.to(other.span);
        let ExpressionKind::Field(of_other) = &other.kind else {
            let title = format!("`{}` is not a group of topics", self.text(other.span));
            let diagnostic = Diagnostic::new(Code::UNPAIRED, other.span, title)
                .label("expected the name of a group")
                .note("`each pair of` combines each member of one group with each member of another");
            self.report(diagnostic);
            return None;
        };
        let (left, right) = (self.point_read(&Read::plain(path)), self.point_read(&Read::plain(of_other)));
        let ((left, unit), (right, right_unit)) = (left?, right?);
        let one = left.list.is_some() || right.list.is_some() || left.field.topic == right.field.topic;
        if one || self.members_of(&right.field) < 2 || right.members != model::Members::Min {
            let title = format!("`{}` is not another group of topics", self.text(other.span));
            let diagnostic = Diagnostic::new(Code::UNPAIRED, whole, title)
                .label("expected a group in addition to the first one")
                .note("for one topic, write `each of` before the group; for pairs of one group, write it alone");
            self.report(diagnostic);
            return None;
        }
        let [found, wanted] = [dimension(right_unit.as_ref()), dimension(unit.as_ref())];
        if found != wanted {
            let title = format!(
                "`{}` is {}, but `{}` is {}",
                self.text(other.span),
                found.name(),
                path.topic.text,
                wanted.name()
            );
            let label = format!("expected {}", wanted.name());
            self.report(Diagnostic::new(Code::WRONG_UNIT, other.span, title).label(label));
            return None;
        }
        let [first, second] = self.pair_of((path, &left.field), Some(&right.field), word)?;
        let [from, to] = [first, second].map(|input| Point::Input(position(inputs, input)));
        Some((between(from, to, convert(1.0, right_unit.as_ref(), unit.as_ref())), unit))
    }

    fn one_point(&mut self, call: Span, argument: &'a ast::Expression) {
        let title = "`distance(…)` takes two points, not 1";
        let mut diagnostic = Diagnostic::new(Code::NOT_A_FORMULA, call, title).label("expected two points");
        if let Some((path, field)) = self.group_of(argument)
            && self.members_of(&field) > 1
        {
            let pairs = format!("each pair of {}", self.text(path.span));
            diagnostic = diagnostic.suggest("use the pairs of members of the group", argument.span, pairs);
        }
        self.report(diagnostic);
    }

    /// The path of an argument, and its field if it is a point without mistakes. Reports nothing.
    fn group_of(&mut self, argument: &'a ast::Expression) -> Option<(&'a Path, FieldPath)> {
        let (ExpressionKind::Field(path) | ExpressionKind::Members(_, _, path)) = &argument.kind else { return None };
        let is_point = matches!(self.type_read(path, None), Some(Type::Point(_)));
        (is_point && path.elements.is_empty() && path.member.is_none()).then_some(())?;
        Some((path, self.field(path)?.0))
    }

    /// Reports the distance of a value of a group from itself, which is always 0.
    fn same_point(&mut self, call: Span, from: &'a ast::Expression, to: &'a ast::Expression) -> bool {
        let (Some((path, field)), Some((_, other))) = (self.group_of(from), self.group_of(to)) else { return false };
        if field != other || self.members_of(&field) == 1 {
            return false;
        }
        let title = format!("this is the distance of each member of `{}` from itself", path.topic.text);
        let pairs = format!("each pair of {}", self.text(path.span));
        let diagnostic = Diagnostic::new(Code::UNPAIRED, call, title).label("always 0");
        self.report(diagnostic.suggest("use the pairs of members of the group", from.span.to(to.span), pairs));
        true
    }

    fn operand(&mut self, inputs: &mut Vec<Input>, expression: &'a ast::Expression) -> Option<Operand<'a>> {
        let written = match &expression.kind {
            ExpressionKind::Field(_) | ExpressionKind::Members(..) => read_in(expression)?,
            ExpressionKind::Call(name, _) if memory_named(&name.text).is_some() => {
                let Some(read) = read_in(expression) else {
                    // It is reported as any number is.
                    self.number(inputs, expression);
                    return None;
                };
                read
            }
            ExpressionKind::Point(point) => {
                let unit = match &point.coordinates[0].unit {
                    Some(name) => Some(self.unit(name)?),
                    None => None,
                };
                return Some(Operand::Written(point, unit));
            }
            ExpressionKind::Number(_)
            | ExpressionKind::Truth(_)
            | ExpressionKind::Text(_)
            | ExpressionKind::Region(_)
            | ExpressionKind::Negate(_)
            | ExpressionKind::Sum(_)
            | ExpressionKind::Product(_)
            | ExpressionKind::Compare(..)
            | ExpressionKind::AtLeast(..)
            | ExpressionKind::Prefixed(..)
            | ExpressionKind::Until(..)
            | ExpressionKind::All(_)
            | ExpressionKind::Any(_)
            | ExpressionKind::Implies(..)
            | ExpressionKind::Call(..) => {
                let title = format!("`{}` is not a point", self.text(expression.span));
                let diagnostic = Diagnostic::new(Code::WRONG_TYPE, expression.span, title);
                self.report(
                    diagnostic.label("expected a topic or field of type `point`, or one such as `(1, 0, -0.5)m`"),
                );
                return None;
            }
        };
        let (path, members) = (written.path, written.word);
        let (read, unit) = self.point_read(&written)?;
        let is_one = matches!(read.members, model::Members::Only(_));
        if self.members_of(&read.field) > 1
            && !is_one
            && !matches!(members, Some((Members::Each | Members::EachPair, _)))
        {
            let title = format!("`{}` is a group of topics, but a single point is needed", path.topic.text);
            let diagnostic = Diagnostic::new(Code::WRONG_TYPE, expression.span, title)
                .label("expected one point")
                .suggest("use each member of the group", expression.span, format!("each of {}", self.text(path.span)));
            self.report(diagnostic);
            return None;
        }
        Some(Operand::Read { at: position(inputs, read.input(None)), unit })
    }

    /// What a formula reads at a path that leads to a point, with its unit.
    fn point_read(&mut self, written: &Read<'a>) -> Option<(Reading, Option<Unit>)> {
        let path = written.path;
        let read = self.read(written)?;
        if let Type::Point(unit) = &read.ty {
            let unit = unit.clone();
            return Some((read, unit));
        }
        let ty = read.ty;
        let title = format!("`{}` is not a point", self.text(path.span));
        let label = format!("it is {}", super::words::type_in_words(&ty));
        self.report(Diagnostic::new(Code::WRONG_TYPE, path.span, title).label(label));
        None
    }

    /// The distance of a point from the boundary of a region.
    pub(super) fn signed_distance(
        &mut self,
        inputs: &mut Vec<Input>,
        from: &'a ast::Expression,
        to: &'a ast::Expression,
    ) -> Option<Number> {
        let region = match (&from.kind, &to.kind) {
            (_, ExpressionKind::Region(region)) => region,
            (ExpressionKind::Region(_), _) => {
                let title = "the arguments of `signed_distance` are reversed";
                let [point, region] = [to, from].map(|side| self.text(side.span).to_owned());
                let mut diagnostic = Diagnostic::new(Code::WRONG_TYPE, from.span.to(to.span), title)
                    .label("expected a point, then a region");
                diagnostic
                    .suggestions
                    .push(Suggestion::possible("swap the two", vec![(from.span, point), (to.span, region)]));
                self.report(diagnostic);
                return None;
            }
            _ => {
                self.operand(inputs, from);
                let title = format!("`{}` is not a region", self.text(to.span));
                let diagnostic =
                    Diagnostic::new(Code::WRONG_TYPE, to.span, title).label("expected a `box` or a `polygon`");
                let otherwise = match &to.kind {
                    ExpressionKind::Call(name, _) => region_otherwise(&name.text),
                    _ => None,
                };
                self.report(diagnostic.note(otherwise.unwrap_or(
                    "its corners are written as numbers, for example `polygon((0, 0), (50, 0), (50, 50))m`",
                )));
                return None;
            }
        };
        // Both are resolved, so that a mistake in one does not hide one in the other.
        let resolved = self.region(region, to.span);
        let (from, unit) = match self.operand(inputs, from)? {
            Operand::Read { at, unit } => {
                self.fits(region, to.span, unit.as_ref(), from)?;
                (Point::Input(at), unit)
            }
            Operand::Written(point, unit) => {
                self.fits(region, to.span, unit.as_ref(), from)?;
                (Point::Constant(self.coordinates(point, unit.as_ref(), "this point")?), unit)
            }
        };
        let written = region.corners.iter().find_map(|corner| corner.coordinates[0].unit.as_ref());
        let own = written.and_then(|name| Unit::parse(&name.text).ok());
        let to = scaled(resolved?, convert(1.0, own.as_ref(), unit.as_ref()));
        Some((Expression::SignedDistance(Box::new(SignedDistance { from, to })), unit))
    }
}

fn between(from: Point, to: Point, scale: f64) -> Expression {
    Expression::Distance(Box::new(Distance { from, to, scale }))
}
