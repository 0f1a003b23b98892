//! Where names stand beside dots, so that they cover neither each other nor a dot.

/// The size for which names are placed, in pixels.
#[derive(Debug, Clone, Copy)]
pub struct Screen {
    /// From left to right.
    pub width: f64,
    /// From top to bottom.
    pub height: f64,
}

/// Where a name stands beside its dot.
#[derive(Debug, Clone, Copy)]
pub struct Placed {
    /// How far to the right of its dot it is anchored, in pixels.
    pub dx: f64,
    /// How far below its dot it is anchored, in pixels.
    pub dy: f64,
    /// The class that says which part of the name is there: its middle, its end, or without a class its beginning. A
    /// space precedes it, so that it can follow other classes.
    pub anchor: &'static str,
    frame: Frame,
}

/// A place for each name, in order of importance, earlier ones first; `None` where there is none. Places of dots are
/// shares of the screen, and names have these lengths in pixels.
pub fn place_names(places: &[(f64, f64)], lengths: &[f64], screen: Screen) -> Vec<Option<Placed>> {
    let dots = places.iter().map(|(x, y)| Frame::around(x * screen.width, y * screen.height, 7.0));
    let mut frames: Vec<Frame> = dots.collect();
    // Above, to the left, to the right, below: a step line leaves its points to the sides. The share is that of the
    // name's length which lies left of where it is anchored.
    let sides =
        [(0.0, -11.0, 0.5, " middle"), (-10.0, 4.0, 1.0, " end"), (10.0, 4.0, 0.0, ""), (0.0, 20.0, 0.5, " middle")];
    places
        .iter()
        .zip(lengths)
        .map(|((x, y), length)| {
            let found = sides.iter().find_map(|&(dx, dy, share, anchor)| {
                let left = x * screen.width + dx - share * length;
                let base = y * screen.height + dy;
                let frame = Frame { left, right: left + length, top: base - 11.0, bottom: base + 3.0 };
                let inside = left >= -24.0
                    && frame.right <= screen.width + 10.0
                    && frame.top >= -16.0
                    && frame.bottom <= screen.height + 8.0;
                let free = inside && frames.iter().all(|other| !frame.overlaps(*other));
                free.then_some(Placed { dx, dy, anchor, frame })
            });
            frames.extend(found.map(|placed| placed.frame));
            found
        })
        .collect()
}

#[derive(Debug, Clone, Copy)]
struct Frame {
    left: f64,
    right: f64,
    top: f64,
    bottom: f64,
}

impl Frame {
    fn around(x: f64, y: f64, radius: f64) -> Frame {
        Frame { left: x - radius, right: x + radius, top: y - radius, bottom: y + radius }
    }

    fn overlaps(self, other: Frame) -> bool {
        self.left < other.right && other.left < self.right && self.top < other.bottom && other.top < self.bottom
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    proptest! {
        #[test]
        fn names_cover_neither_each_other_nor_a_point(
            places in prop::collection::vec((0.0f64..=1.0, 0.0f64..=1.0), 1..40), length in 10.0f64..60.0,
        ) {
            let screen = Screen { width: 300.0, height: 280.0 };
            let placed = place_names(&places, &vec![length; places.len()], screen);
            prop_assert!(placed.iter().any(Option::is_some), "one name at least finds a place");
            for (at, name) in placed.iter().enumerate() {
                let Some(name) = name else { continue };
                for other in placed[..at].iter().flatten() {
                    prop_assert!(!name.frame.overlaps(other.frame));
                }
                for (x, y) in &places {
                    let (x, y) = (x * screen.width, y * screen.height);
                    let inside = (name.frame.left..name.frame.right).contains(&x) && (name.frame.top..name.frame.bottom).contains(&y);
                    prop_assert!(!inside, "a dot lies under a name");
                }
            }
        }
    }
}
