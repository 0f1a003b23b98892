//! Variations of the windows of a smallest test, which show when its operations have to act: each operation by time is
//! moved by itself, the others stay as they are.
//!
//! A third of the windows contain that of the smallest test, a third are a little longer than it and lie anywhere, and
//! the lengths of a third are log-uniform. So that a description of when a test fails can be held against windows that
//! it was not made of, every third variation is fresh. Whatever their number, there are some of each sort.

use sesame_plan::{Activation, Span, Test};
use sesame_rng::Stream;

use crate::shrink::space::ShrinkSpace;
use crate::space::range::Range;

/// How many variations there are of each operation.
pub(super) const OF_EACH: usize = 48;
/// The sorts of windows.
const SORTS: usize = 3;
/// How much longer than that of the smallest test windows of the second sort are.
const LITTLE_LONGER: f64 = 1.5;
/// How often a window is drawn until it meets no copy that it must not meet.
const ATTEMPTS: usize = 30;

/// A variation of a test.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Variation {
    /// The position of the operation of which the window differs.
    pub(super) operation: usize,
    /// Its window.
    pub(super) window: Span,
    /// Whether descriptions are held against it, rather than made of it.
    pub(super) fresh: bool,
    pub(super) test: Test,
}

/// The variations of a test, those of all operations in turn. Where copies of an operation must not overlap and leave
/// no room, there are fewer than [`OF_EACH`].
pub(super) fn variations(space: &ShrinkSpace, test: &Test, seed: u64) -> Vec<Variation> {
    let mut of_each: Vec<Vec<Variation>> = Vec::new();
    for (operation, used) in test.operations.iter().enumerate() {
        let Activation::Time { start, end } = used.activation else { continue };
        let range = space.window(used.operation);
        let mut stream = Stream::derive(seed, "variations", &[operation as u64]);
        let meets = |window: &Span| {
            let others = test.operations.iter().enumerate();
            let copies = others.filter(|(at, other)| *at != operation && other.operation == used.operation);
            let mut windows = copies.filter_map(|(_, other)| match other.activation {
                Activation::Time { start, end } => Some(Span { start, end }),
                _ => None,
            });
            space.apart && windows.any(|other| window.start < other.end && other.start < window.end)
        };
        let windows = windows(range, Span { start, end }, &meets, &mut stream);
        let varied = windows.into_iter().map(|(at, window)| {
            let mut test = test.clone();
            test.operations[operation].activation = Activation::Time { start: window.start, end: window.end };
            // Each sort has fresh ones: at first of one, then of the next.
            let fresh = (at / SORTS + at % SORTS).is_multiple_of(3);
            Variation { operation, window, fresh, test }
        });
        of_each.push(varied.collect());
    }
    let in_turn = (0..OF_EACH).flat_map(|at| of_each.iter().filter_map(move |varied| varied.get(at).cloned()));
    in_turn.collect()
}

/// Windows in a permitted range with their numbers, those of each sort spread evenly over it in a random order. Those
/// that meet something are drawn again.
fn windows(range: Range, smallest: Span, meets: &dyn Fn(&Span) -> bool, stream: &mut Stream) -> Vec<(usize, Span)> {
    let (shortest, longest) = (range.shortest, range.greatest_length());
    let rounds = OF_EACH / SORTS;
    let places = [(); SORTS].map(|()| stream.permutation(rounds));
    let mut window = |sort: usize, round: usize, attempt: usize| {
        let place = match attempt {
            0 => (places[sort][round] as f64 + stream.unit()) / rounds as f64,
            _ => stream.unit(),
        };
        let length = match sort {
            0 => stream.uniform(smallest.length(), longest.max(smallest.length())),
            1 => (smallest.length() * LITTLE_LONGER).min(longest),
            _ => shortest * libm::pow(longest / shortest, stream.unit()),
        };
        let (first, last) = match sort {
            0 => ((smallest.end - length).max(range.low), smallest.start.min(range.high - length)),
            _ => (range.low, range.high - length),
        };
        let start = first + (last - first).max(0.0) * place;
        Span { start, end: (start + length).min(range.high) }
    };
    let drawn = (0..OF_EACH).filter_map(|at| {
        let window =
            (0..ATTEMPTS).map(|attempt| window(at % SORTS, at / SORTS, attempt)).find(|window| !meets(window))?;
        Some((at, window))
    });
    drawn.collect()
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    proptest! {
        #[test]
        fn windows_are_permitted_and_some_contain_the_smallest(
            low in 0.0..100.0f64,
            size in 0.5..200.0f64,
            bounds in (0.01..1.0f64, 0.01..1.0f64),
            place in (0.0..1.0f64, 0.0..1.0f64),
            seed: u64,
        ) {
            let (shortest, longest) = (bounds.0.min(bounds.1) * size, bounds.0.max(bounds.1) * size);
            let range = Range { shortest, longest, ..Range::window(low, low + size) };
            let length = shortest + (longest - shortest) * place.0;
            let start = low + (size - length) * place.1;
            let smallest = Span { start, end: start + length };
            let windows = windows(range, smallest, &|_| false, &mut Stream::derive(seed, "test", &[]));
            prop_assert_eq!(windows.len(), OF_EACH);
            let near = 1e-9 * (low + size);
            for (at, window) in windows {
                prop_assert!(window.start >= low - near && window.end <= low + size + near, "{:?} of {:?}", window, range);
                let length = window.length();
                prop_assert!((shortest - near..=longest + near).contains(&length), "{} of {:?}", length, range);
                if at % SORTS == 0 {
                    prop_assert!(window.start <= smallest.start + near && window.end >= smallest.end - near);
                }
            }
        }
    }

    #[test]
    fn a_third_of_each_sort_is_fresh() {
        let fresh = |at: usize| (at / SORTS + at % SORTS).is_multiple_of(3);
        let of_sort = |sort| (0..OF_EACH).filter(|at| at % SORTS == sort && fresh(*at)).count();
        assert_eq!([0, 1, 2].map(of_sort), [6, 5, 5]);
    }
}
