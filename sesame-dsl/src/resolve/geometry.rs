//! Points and regions in formulas: distances, and regions by their corners.

use super::Resolver;
use super::formula::{Number, position};
use crate::diagnostic::{Code, Diagnostic, Suggestion};
use crate::model::{Expression, FieldPath, Input, Point, Region, Type};
use crate::span::Span;
use crate::syntax::ast::{self, ExpressionKind, Members, Path, RegionKind};
use crate::units::{Unit, convert, dimension};

/// The most corners of a polygon: all its sides are looked at for each message.
const MOST_CORNERS: usize = 1_000;

/// An argument that is a point.
enum Operand<'a> {
    /// From messages: with its field and unit.
    Read { at: u32, field: FieldPath, unit: Option<Unit> },
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
            [pairs] => match &pairs.kind {
                ExpressionKind::Members(Members::EachPair, word, path) => return self.pairs(inputs, path, *word),
                _ => {
                    self.one_point(call, pairs);
                    return None;
                }
            },
            [from, to] => (from, to),
            _ => {
                self.wrong_count(call, "distance", "two points", arguments.len());
                return None;
            }
        };
        if self.same_point(call, from, to) {
            return None;
        }
        // Both are resolved, so that a mistake in one does not hide one in the other.
        let (left, right) = (self.operand(inputs, from), self.operand(inputs, to));
        let (left, right) = (left?, right?);
        // As with numbers, what is written takes the unit of what is read.
        match (left, right) {
            (Operand::Read { at, unit, .. }, Operand::Written(point, _)) => {
                let to = Point::Constant(self.coordinates(point, unit.as_ref(), &self.quoted(from))?);
                Some((Expression::Distance { from: Point::Input(at), to, scale: 1.0 }, unit))
            }
            (Operand::Written(point, _), Operand::Read { at, unit, .. }) => {
                let from = Point::Constant(self.coordinates(point, unit.as_ref(), &self.quoted(to))?);
                Some((Expression::Distance { from, to: Point::Input(at), scale: 1.0 }, unit))
            }
            (Operand::Written(left, unit), Operand::Written(right, _)) => {
                let left = Point::Constant(self.coordinates(left, unit.as_ref(), "this point")?);
                let right = Point::Constant(self.coordinates(right, unit.as_ref(), &self.quoted(from))?);
                Some((Expression::Distance { from: left, to: right, scale: 1.0 }, unit))
            }
            (
                Operand::Read { at: from_at, field: from_field, unit },
                Operand::Read { at: to_at, field: to_field, unit: to_unit },
            ) => {
                let [found, wanted] = [dimension(to_unit.as_ref()), dimension(unit.as_ref())];
                if found != wanted {
                    let [from_name, to_name] = [from, to].map(|side| self.text(side.span));
                    let title = format!("`{to_name}` is {}, but `{from_name}` is {}", found.name(), wanted.name());
                    let label = format!("expected {}", wanted.name());
                    self.report(Diagnostic::new(Code::WRONG_UNIT, to.span, title).label(label));
                    return None;
                }
                if self.members_of(&from_field) > 1 && self.members_of(&to_field) > 1 {
                    self.same_members(from_field.topic, to_field.topic, call)?;
                }
                let scale = convert(1.0, to_unit.as_ref(), unit.as_ref());
                Some((Expression::Distance { from: Point::Input(from_at), to: Point::Input(to_at), scale }, unit))
            }
        }
    }

    fn quoted(&self, expression: &ast::Expression) -> String {
        format!("`{}`", self.text(expression.span))
    }

    /// The distances among a group's members.
    fn pairs(&mut self, inputs: &mut Vec<Input>, path: &'a Path, word: Span) -> Option<Number> {
        let (field, unit) = self.point_field(path)?;
        let [first, second] = self.pair_of(path, field, word)?;
        let [from, to] = [first, second].map(|input| Point::Input(position(inputs, input)));
        Some((Expression::Distance { from, to, scale: 1.0 }, unit))
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
        matches!(self.type_at(&path.topic, &path.fields), Some(Type::Point(_))).then_some(())?;
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
        let (path, members) = match &expression.kind {
            ExpressionKind::Field(path) => (path, None),
            ExpressionKind::Members(members, word, path) => (path, Some((*members, *word))),
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
        let (field, unit) = self.point_field(path)?;
        if self.members_of(&field) > 1 && !matches!(members, Some((Members::Each | Members::EachPair, _))) {
            let title = format!("`{}` is a group of topics, but a single point is needed", path.topic.text);
            let diagnostic = Diagnostic::new(Code::WRONG_TYPE, expression.span, title)
                .label("expected one point")
                .suggest("use each member of the group", expression.span, format!("each of {}", self.text(path.span)));
            self.report(diagnostic);
            return None;
        }
        let at = self.input(inputs, path, field.clone(), members, None)?;
        Some(Operand::Read { at, field, unit })
    }

    /// A topic or field that is a point, with its unit.
    fn point_field(&mut self, path: &'a Path) -> Option<(FieldPath, Option<Unit>)> {
        let (field, ty) = self.value_field(path)?;
        if let Type::Point(unit) = ty {
            return Some((field, unit));
        }
        let title = format!("`{}` is not a point", self.text(path.span));
        let label = format!("it is {}", super::system::type_in_words(&ty));
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
                diagnostic.suggestions.push(Suggestion {
                    message: "swap the two".to_owned(),
                    edits: vec![(from.span, point), (to.span, region)],
                });
                self.report(diagnostic);
                return None;
            }
            _ => {
                self.operand(inputs, from);
                let title = format!("`{}` is not a region", self.text(to.span));
                let diagnostic = Diagnostic::new(Code::WRONG_TYPE, to.span, title);
                self.report(
                    diagnostic
                        .label("expected a `box` or a `polygon`")
                        .note("its corners are written as numbers, for example `polygon((0, 0), (50, 0), (50, 50))m`"),
                );
                return None;
            }
        };
        // Both are resolved, so that a mistake in one does not hide one in the other.
        let resolved = self.region(region, to.span);
        let (from, unit) = match self.operand(inputs, from)? {
            Operand::Read { at, unit, .. } => {
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
        Some((Expression::SignedDistance { from, to }, unit))
    }

    /// Checks that the unit of a region is of the dimension of a point.
    fn fits(
        &mut self,
        region: &'a ast::Region,
        span: Span,
        unit: Option<&Unit>,
        point: &ast::Expression,
    ) -> Option<()> {
        let first = &region.corners[0].coordinates[0];
        let what = self.quoted(point);
        match (&first.unit, unit) {
            (None, Some(unit)) => {
                let title = format!("`{}` has no unit", self.text(span));
                let diagnostic = Diagnostic::new(Code::WRONG_UNIT, span, title)
                    .label(format!("{what} is in `{}`", unit.text()))
                    .suggest(format!("add the unit `{}`", unit.text()), span.end(), unit.text());
                self.report(diagnostic);
                None
            }
            // The unit of the region as such: the number does not matter.
            _ => self.value(first, unit, &what).map(|_| ()),
        }
    }

    /// A region in the unit in which it is written.
    fn region(&mut self, region: &'a ast::Region, span: Span) -> Option<Region> {
        let (name, counts) = match region.kind {
            RegionKind::Box => ("box", [2, 3].as_slice()),
            RegionKind::Polygon => ("polygon", [2].as_slice()),
        };
        let first = region.corners[0].coordinates.len();
        let wanted = if counts.contains(&first) { first } else { counts[0] };
        for corner in &region.corners {
            let count = corner.coordinates.len();
            if count == wanted {
                continue;
            }
            let numbers = match (region.kind, counts.contains(&first)) {
                (RegionKind::Box, false) => "two or three coordinates".to_owned(),
                (RegionKind::Box, true) => format!("{wanted} coordinates, as the first corner"),
                (RegionKind::Polygon, _) => "two coordinates".to_owned(),
            };
            let coordinates = if count == 1 { "coordinate" } else { "coordinates" };
            let title = format!("a corner of this {name} has {count} {coordinates}");
            let diagnostic = Diagnostic::new(Code::BAD_REGION, corner.span, title).label(format!("expected {numbers}"));
            self.report(match region.kind {
                RegionKind::Box => diagnostic,
                RegionKind::Polygon => {
                    diagnostic.note("a polygon lies in the x-y plane and holds points at any height")
                }
            });
            return None;
        }
        let number = |quantity: &ast::Quantity| (!quantity.value.is_nan()).then_some(quantity.value);
        let corners: Vec<Vec<f64>> = region
            .corners
            .iter()
            .map(|corner| corner.coordinates.iter().map(number).collect::<Option<_>>())
            .collect::<Option<_>>()?;
        match region.kind {
            RegionKind::Box => self.cuboid(&corners, span),
            RegionKind::Polygon => {
                let corners: Vec<[f64; 2]> = corners.iter().map(|corner| [corner[0], corner[1]]).collect();
                self.polygon(region, corners, span)
            }
        }
    }

    /// The box between two opposite corners; one of two axes has all heights.
    fn cuboid(&mut self, corners: &[Vec<f64>], span: Span) -> Option<Region> {
        let [from, to] = corners else {
            let title = format!("a box has two opposite corners, not {}", corners.len());
            let diagnostic = Diagnostic::new(Code::BAD_REGION, span, title).label("expected two corners");
            self.report(diagnostic.note("for example `box((0, 0, 0), (50, 50, 20))m`"));
            return None;
        };
        if let Some(axis) = (0..from.len()).find(|&axis| from[axis] == to[axis]) {
            let title = "this box has no inside";
            let label = format!("both corners have the same {}", ["x", "y", "z"][axis]);
            self.report(Diagnostic::new(Code::BAD_REGION, span, title).label(label));
            return None;
        }
        let end = |join: fn(f64, f64) -> f64| move |axis: usize| join(from[axis], to[axis]);
        let (low, high) = (end(f64::min), end(f64::max));
        Some(if from.len() == 3 {
            Region::Box { low: [0, 1, 2].map(low), high: [0, 1, 2].map(high) }
        } else {
            let ([left, bottom], [right, top]) = ([0, 1].map(low), [0, 1].map(high));
            Region::Polygon { corners: vec![[left, bottom], [right, bottom], [right, top], [left, top]] }
        })
    }

    fn polygon(&mut self, region: &'a ast::Region, corners: Vec<[f64; 2]>, span: Span) -> Option<Region> {
        let count = corners.len();
        if let [first, .., last] = corners.as_slice()
            && first == last
        {
            let title = "the last corner of this polygon is the first one again";
            let [before, last] = [count - 2, count - 1].map(|at| region.corners[at].span);
            let diagnostic = Diagnostic::new(Code::BAD_REGION, last, title)
                .label("a polygon closes by itself")
                .suggest("remove the last corner", Span { lo: before.hi, ..last }, "");
            self.report(diagnostic);
            return None;
        }
        if count < 3 {
            let title = format!("a polygon has three corners or more, not {count}");
            self.report(Diagnostic::new(Code::BAD_REGION, span, title).label("expected three corners or more"));
            return None;
        }
        if count > MOST_CORNERS {
            let title = format!("this polygon has {count} corners, but the limit is {MOST_CORNERS}");
            self.report(Diagnostic::new(Code::TOO_LARGE, span, title).label("too many corners"));
            return None;
        }
        if let Some((one, other)) = crossing(&corners) {
            let side = |at: usize| {
                let [from, to] = [at, (at + 1) % count].map(|at| self.text(region.corners[at].span));
                format!("the side from `{from}` to `{to}`")
            };
            let title = format!("{} touches or crosses {}", side(one), side(other));
            let diagnostic = Diagnostic::new(Code::BAD_REGION, span, title)
                .label("the sides of a polygon may only meet at their common corners")
                .note("list the corners in the order in which one meets them going around the polygon");
            self.report(diagnostic);
            return None;
        }
        Some(Region::Polygon { corners })
    }
}

/// A region in another unit.
fn scaled(region: Region, scale: f64) -> Region {
    match region {
        region if scale == 1.0 => region,
        Region::Box { low, high } => Region::Box { low: low.map(|end| end * scale), high: high.map(|end| end * scale) },
        Region::Polygon { corners } => {
            Region::Polygon { corners: corners.into_iter().map(|corner| corner.map(|end| end * scale)).collect() }
        }
    }
}

/// Two sides of a polygon, by their first corners, that have another point in common than the corner between them.
fn crossing(corners: &[[f64; 2]]) -> Option<(usize, usize)> {
    let count = corners.len();
    let side = |at: usize| [corners[at], corners[(at + 1) % count]];
    (0..count).flat_map(|one| (one + 1..count).map(move |other| (one, other))).find(|&(one, other)| {
        let ([a, b], [c, d]) = (side(one), side(other));
        if one + 1 == other {
            return turns_back(a, b, d);
        }
        if one == 0 && other + 1 == count {
            return turns_back(c, d, b);
        }
        meet([a, b], [c, d])
    })
}

/// Which side of the line from `a` to `b` a point is on: positive to the left, 0 on the line.
fn turn(a: [f64; 2], b: [f64; 2], c: [f64; 2]) -> f64 {
    (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0])
}

/// Whether the way from `a` to `b` and on to `c` goes over a part of itself, or does not move.
fn turns_back(a: [f64; 2], b: [f64; 2], c: [f64; 2]) -> bool {
    let ahead = (b[0] - a[0]) * (c[0] - b[0]) + (b[1] - a[1]) * (c[1] - b[1]);
    a == b || b == c || (turn(a, b, c) == 0.0 && ahead < 0.0)
}

/// Whether two segments have a point in common.
fn meet([a, b]: [[f64; 2]; 2], [c, d]: [[f64; 2]; 2]) -> bool {
    let apart =
        |axis: usize| a[axis].max(b[axis]) < c[axis].min(d[axis]) || c[axis].max(d[axis]) < a[axis].min(b[axis]);
    if apart(0) || apart(1) {
        return false;
    }
    let both_sides = |one: f64, other: f64| (one <= 0.0 && other >= 0.0) || (one >= 0.0 && other <= 0.0);
    both_sides(turn(a, b, c), turn(a, b, d)) && both_sides(turn(c, d, a), turn(c, d, b))
}
