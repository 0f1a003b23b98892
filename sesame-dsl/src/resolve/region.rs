//! Regions in formulas: what their corners enclose.

use super::Resolver;
use crate::diagnostic::{Code, Diagnostic};
use crate::model::Region;
use crate::span::Span;
use crate::syntax::ast::{self, RegionKind};
use crate::units::Unit;

/// The most corners of a polygon: all its sides are looked at for each message.
const MOST_CORNERS: usize = 1_000;

impl<'a> Resolver<'a> {
    /// Checks that the unit of a region is of the dimension of a point.
    pub(super) fn fits(
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
    pub(super) fn region(&mut self, region: &'a ast::Region, span: Span) -> Option<Region> {
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
pub(super) fn scaled(region: Region, scale: f64) -> Region {
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

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    /// The oracle: whether two segments with whole corners have a point in common, by solving for it in whole numbers.
    fn share_a_point([a, b]: [[i64; 2]; 2], [c, d]: [[i64; 2]; 2]) -> bool {
        let way = |from: [i64; 2], to: [i64; 2]| [to[0] - from[0], to[1] - from[1]];
        let cross = |left: [i64; 2], right: [i64; 2]| left[0] * right[1] - left[1] * right[0];
        let (first, second, gap) = (way(a, b), way(c, d), way(a, c));
        let determinant = cross(first, second);
        if determinant == 0 {
            let on = |point: [i64; 2], [from, to]: [[i64; 2]; 2]| {
                cross(way(from, to), way(from, point)) == 0
                    && (0..2)
                        .all(|axis| point[axis] >= from[axis].min(to[axis]) && point[axis] <= from[axis].max(to[axis]))
            };
            return on(a, [c, d]) || on(b, [c, d]) || on(c, [a, b]) || on(d, [a, b]);
        }
        // a + t * first = c + u * second, with t and u as fractions of the determinant.
        let within = |numerator: i64| {
            let numerator = numerator * determinant.signum();
            numerator >= 0 && numerator <= determinant.abs()
        };
        within(cross(gap, second)) && within(cross(gap, first))
    }

    /// The oracle: whether the sides of a polygon meet only at their common corners.
    fn is_simple(corners: &[[i64; 2]]) -> bool {
        let count = corners.len();
        let side = |at: usize| [corners[at], corners[(at + 1) % count]];
        (0..count).all(|one| side(one)[0] != side(one)[1])
            && (0..count).flat_map(|one| (one + 1..count).map(move |other| (one, other))).all(|(one, other)| {
                let ([a, b], [c, d]) = (side(one), side(other));
                // Neighbours have one corner in common: no other end of one lies on the other.
                let lies = |point, on| share_a_point([point, point], on);
                if one + 1 == other {
                    !lies(a, [c, d]) && !lies(d, [a, b])
                } else if one == 0 && other + 1 == count {
                    !lies(b, [c, d]) && !lies(c, [a, b])
                } else {
                    !share_a_point([a, b], [c, d])
                }
            })
    }

    proptest! {
        #[test]
        fn a_polygon_is_refused_exactly_when_its_sides_meet_elsewhere(
            corners in prop::collection::vec(prop::array::uniform2(0i64..6), 3..8),
        ) {
            let real: Vec<[f64; 2]> = corners.iter().map(|corner| corner.map(|end| end as f64)).collect();
            prop_assert_eq!(crossing(&real).is_none(), is_simple(&corners), "{:?}", corners);
        }
    }

    #[test]
    fn a_star_of_a_thousand_corners_is_simple_and_with_two_of_them_swapped_it_is_not() {
        let spike = |at: usize| {
            let half = (at / 250, at % 250);
            // Four sides of a saw-toothed square.
            let (along, out) = (half.1 as f64, if half.1.is_multiple_of(2) { 0.0 } else { -5.0 });
            match half.0 {
                0 => [along, out],
                1 => [250.0 - out, along],
                2 => [250.0 - along, 250.0 - out],
                _ => [out, 250.0 - along],
            }
        };
        let mut corners: Vec<[f64; 2]> = (0..MOST_CORNERS).map(spike).collect();
        assert_eq!(crossing(&corners), None);
        corners.swap(100, 500);
        assert!(crossing(&corners).is_some());
    }
}
