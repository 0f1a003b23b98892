//! Bodies: a shape, and where it is.
//!
//! A shape is a core (a point, a segment or a box, with its centre in the origin of the body's pose) and everything
//! within a distance of the core (its Minkowski sum with a ball). A shape that is expanded has a greater distance and
//! the same core, so the corners of an expanded box are rounded: no point of it is farther from the box than the
//! expansion.

use parry3d_f64::math::{Pose, Vector};

use crate::trace::{FARTHEST, Trace};

/// How much the length of a fixed body's quaternion may differ from 1.
const UNIT: f64 = 1e-6;

/// What a shape consists of, before anything is added on every side.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) enum Core {
    Point,
    /// From the negative of this vector to the vector.
    Segment(Vector),
    /// Half of each edge.
    Box(Vector),
}

/// A shape around the origin.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Shape {
    core: Core,
    radius: f64,
}

/// A length that no shape can have.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[error("{what} is {value} m: it must be {permitted} and at most {FARTHEST} m")]
pub struct ShapeError {
    /// The length's name.
    pub what: &'static str,
    /// Its value.
    pub value: f64,
    /// What is permitted.
    pub permitted: &'static str,
}

impl Shape {
    /// A sphere.
    pub fn sphere(radius: f64) -> Result<Shape, ShapeError> {
        Ok(Shape { core: Core::Point, radius: positive("the radius of a sphere", radius)? })
    }

    /// A box with these whole edges along x, y and z.
    pub fn cuboid(edges: [f64; 3]) -> Result<Shape, ShapeError> {
        for edge in edges {
            positive("an edge of a box", edge)?;
        }
        Ok(Shape { core: Core::Box(Vector::from_array(edges) / 2.0), radius: 0.0 })
    }

    /// A capsule: all within a radius of the segment from `-half_axis` to `half_axis`.
    pub fn capsule(half_axis: Vector, radius: f64) -> Result<Shape, ShapeError> {
        positive("half of the axis of a capsule", half_axis.length())?;
        Ok(Shape { core: Core::Segment(half_axis), radius: positive("the radius of a capsule", radius)? })
    }

    /// The shape with this length more on every side, 0 or more.
    pub fn expanded(self, by: f64) -> Result<Shape, ShapeError> {
        if !(0.0..=FARTHEST).contains(&by) {
            return Err(ShapeError { what: "an expansion", value: by, permitted: "0 or more" });
        }
        Ok(Shape { radius: self.radius + by, ..self })
    }

    pub(crate) fn core(&self) -> Core {
        self.core
    }

    /// The distance from the core up to which the shape extends.
    pub(crate) fn radius(&self) -> f64 {
        self.radius
    }

    /// The greatest distance of a point of the core from the origin: how far a turn by a small angle moves it, for each
    /// radian.
    pub(crate) fn reach(&self) -> f64 {
        match self.core {
            Core::Point => 0.0,
            Core::Segment(half) | Core::Box(half) => half.length(),
        }
    }

    fn turns_visibly(&self) -> bool {
        self.core != Core::Point
    }
}

/// A shape somewhere.
#[derive(Debug, Clone, PartialEq)]
pub struct Body {
    shape: Shape,
    placement: Placement,
}

/// Where a body is.
#[derive(Debug, Clone, PartialEq)]
pub enum Placement {
    /// Always here.
    Fixed(Pose),
    /// With a recorded pose, as long as that is known.
    Moving(Trace),
}

/// Why a shape cannot be there.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum BodyError {
    /// The shape looks different from different sides, and nobody knows from which side.
    #[error(
        "a box or a capsule moves with a recording without orientations: record them, or use a sphere around the shape"
    )]
    NoOrientations,
    /// A pose is not valid.
    #[error(
        "the pose of a fixed body needs finite coordinates of at most {FARTHEST} m and a quaternion of length 1, but is {0:?}"
    )]
    Pose(Pose),
}

impl Body {
    /// A body that does not move.
    pub fn fixed(shape: Shape, pose: Pose) -> Result<Body, BodyError> {
        let near = pose.translation.is_finite() && pose.translation.abs().max_element() <= FARTHEST;
        // NaN is not within any distance.
        let unit = (pose.rotation.length() - 1.0).abs() <= UNIT;
        if !near || !unit {
            return Err(BodyError::Pose(pose));
        }
        let pose = Pose::from_parts(pose.translation, pose.rotation.normalize());
        Ok(Body { shape, placement: Placement::Fixed(pose) })
    }

    /// A body that does not move, with its edges along the axes.
    pub fn fixed_at(shape: Shape, centre: Vector) -> Result<Body, BodyError> {
        Body::fixed(shape, Pose::from_translation(centre))
    }

    /// A body that moves with a recorded pose. All shapes except spheres need recorded orientations.
    pub fn moving(shape: Shape, trace: Trace) -> Result<Body, BodyError> {
        if shape.turns_visibly() && trace.orientations().is_none() {
            return Err(BodyError::NoOrientations);
        }
        Ok(Body { shape, placement: Placement::Moving(trace) })
    }

    /// The body with this length more on every side, 0 or more.
    pub fn expanded(self, by: f64) -> Result<Body, ShapeError> {
        Ok(Body { shape: self.shape.expanded(by)?, ..self })
    }

    /// Its shape.
    pub fn shape(&self) -> &Shape {
        &self.shape
    }

    /// Where it is.
    pub fn placement(&self) -> &Placement {
        &self.placement
    }

    /// Its pose at a time; `None` where it is not known.
    pub fn at(&self, time: f64) -> Option<Pose> {
        match &self.placement {
            Placement::Fixed(pose) => Some(*pose),
            Placement::Moving(trace) => trace.at(time),
        }
    }
}

fn positive(what: &'static str, value: f64) -> Result<f64, ShapeError> {
    if value > 0.0 && value <= FARTHEST {
        return Ok(value);
    }
    Err(ShapeError { what, value, permitted: "more than 0" })
}

#[cfg(test)]
mod tests {
    use parry3d_f64::math::Rotation;

    use super::*;

    #[test]
    fn lengths_that_no_shape_can_have_are_named() {
        assert_eq!(
            Shape::sphere(0.0).unwrap_err().to_string(),
            "the radius of a sphere is 0 m: it must be more than 0 and at most 10000000 m"
        );
        assert_eq!(Shape::cuboid([1.0, f64::NAN, 1.0]).unwrap_err().what, "an edge of a box");
        assert_eq!(Shape::capsule(Vector::ZERO, 1.0).unwrap_err().what, "half of the axis of a capsule");
        let sphere = Shape::sphere(1.0).unwrap();
        assert_eq!(
            sphere.expanded(-0.5).unwrap_err().to_string(),
            "an expansion is -0.5 m: it must be 0 or more and at most 10000000 m"
        );
        assert!(sphere.expanded(f64::INFINITY).is_err());
    }

    #[test]
    fn only_a_sphere_can_move_without_orientations() {
        let trace = Trace::new(vec![0.0, 1.0], vec![Vector::ZERO; 2], None).unwrap();
        assert!(Body::moving(Shape::sphere(1.0).unwrap(), trace.clone()).is_ok());
        let cuboid = Shape::cuboid([1.0; 3]).unwrap();
        assert_eq!(Body::moving(cuboid, trace), Err(BodyError::NoOrientations));
    }

    #[test]
    fn a_body_is_fixed_at_a_pose_only() {
        let sphere = Shape::sphere(1.0).unwrap();
        assert!(Body::fixed_at(sphere, Vector::new(f64::NAN, 0.0, 0.0)).is_err());
        assert!(Body::fixed_at(sphere, Vector::new(2e7, 0.0, 0.0)).is_err());
        let stretched = Pose::from_parts(Vector::ZERO, Rotation::from_xyzw(0.0, 0.0, 1.0, 1.0));
        assert!(Body::fixed(sphere, stretched).is_err());
    }
}
