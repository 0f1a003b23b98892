//! Windows of copies of one operation that are never active at the same time.
//!
//! Windows of `k` copies are disjoint (one may begin where another ends), each at least as long as a window of the
//! operation has to be, all inside what is permitted. Two functions make them, and both are continuous in the windows
//! they begin with as long as those keep their order:
//!
//! - [`spread`] makes fresh windows of independent ones. All disjoint windows are equally likely then: of `k` windows
//!   the `2k` ends are independent uniform numbers but for their order, so their ends are sorted and paired. No copy is
//!   likelier to be late or short than another. Where lengths are bounded from above, windows keep the lengths that
//!   they were drawn with, and their places are uniform.
//! - [`nearest`] moves given windows apart, as little as may be: among all disjoint windows in the order of the given
//!   ones' midpoints it takes those whose ends are nearest to the given ends, by the sum of squares. Two that overlap
//!   meet in the middle of what they shared; what is disjoint already stays as it is, to the last bit. None gets
//!   longer, unless it was shorter than it has to be: an end moves outwards only together with the other end.

use crate::space::range::Range;

/// Windows that are uniform over all disjoint ones, of independent [windows](Range::interval) that are uniform each.
pub(crate) fn spread(permitted: Range, windows: &mut [(f64, f64)]) {
    let copies = windows.len() as f64;
    if windows.len() < 2 {
        return;
    }
    if permitted.longest.is_finite() {
        return spread_bounded(permitted, windows);
    }
    let Range { low, high, shortest, .. } = permitted;
    // An independent window leaves out the shortest length once, `copies` disjoint ones do so as often.
    let scale = (high - low - copies * shortest) / (high - low - shortest);
    let mut ends: Vec<f64> =
        windows.iter().flat_map(|(start, end)| [start - low, end - shortest - low]).map(|x| x * scale).collect();
    ends.sort_by(f64::total_cmp);
    let order = by_midpoint(windows);
    place(permitted, windows, &order, &ends);
}

/// Where windows must not be too long, they keep their lengths, unless these do not fit together: then what is above
/// the shortest length shrinks in proportion. The places of windows of given lengths are uniform over all disjoint
/// ones.
fn spread_bounded(permitted: Range, windows: &mut [(f64, f64)]) {
    let Range { low, high, shortest, .. } = permitted;
    let room = high - low;
    // Where a window lies, as a share of what its length leaves; in their order these are the gaps.
    let mut drawn: Vec<(f64, f64, usize)> = windows
        .iter()
        .enumerate()
        .map(|(at, (start, end))| {
            let left = room - (end - start);
            (if left > 0.0 { ((start - low) / left).clamp(0.0, 1.0) } else { 0.0 }, end - start, at)
        })
        .collect();
    drawn.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.2.cmp(&b.2)));
    let all: f64 = drawn.iter().map(|(_, length, _)| length).sum();
    let least = shortest * drawn.len() as f64;
    // Half of the time stays free, as it is certain to do with the shortest windows.
    let fitting = if all > room / 2.0 { ((room / 2.0 - least) / (all - least)).clamp(0.0, 1.0) } else { 1.0 };
    let lengths: Vec<f64> = drawn.iter().map(|(_, length, _)| shortest + (length - shortest) * fitting).collect();
    let free = (room - lengths.iter().sum::<f64>()).max(0.0);
    let (mut before, mut earliest) = (0.0, low);
    for (&(place, _, window), length) in drawn.iter().zip(lengths) {
        let start = (low + place * free + before).clamp(earliest, high);
        let end = (start + length).min(high);
        windows[window] = (start, end);
        (before, earliest) = (before + length, end);
    }
}

/// The nearest disjoint windows in the order of the given ones' midpoints.
pub(crate) fn nearest(permitted: Range, windows: &mut [(f64, f64)]) {
    let order = by_midpoint(windows);
    if order.windows(2).all(|pair| windows[pair[0]].1 <= windows[pair[1]].0) {
        return;
    }
    let Range { low, high, shortest, .. } = permitted;
    // With the shortest lengths taken out, disjoint windows are rising numbers, and the nearest ones an isotonic
    // regression: neighbours that fall are pooled to their mean, until none fall.
    let mut pools: Vec<(f64, f64)> = Vec::new();
    for (at, &window) in order.iter().enumerate() {
        let (start, end) = windows[window];
        for end in [start - at as f64 * shortest, end - (at + 1) as f64 * shortest] {
            let mut pool = (end - low, 1.0);
            while let Some(before) = pools.pop_if(|before| before.0 > pool.0) {
                let count = before.1 + pool.1;
                pool = ((before.0 * before.1 + pool.0 * pool.1) / count, count);
            }
            pools.push(pool);
        }
    }
    let room = (high - low - windows.len() as f64 * shortest).max(0.0);
    // A bound on all of them only cuts the regression off.
    #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "a count of ends")]
    let ends: Vec<f64> = pools
        .into_iter()
        .flat_map(|(mean, count)| std::iter::repeat_n(mean.clamp(0.0, room), count as usize))
        .collect();
    place(permitted, windows, &order, &ends);
}

/// Which window is first, second and so on.
fn by_midpoint(windows: &[(f64, f64)]) -> Vec<usize> {
    let mut order: Vec<usize> = (0..windows.len()).collect();
    order.sort_by(|&a, &b| {
        let ((a, b), (c, d)) = (windows[a], windows[b]);
        (a + b).total_cmp(&(c + d)).then(a.total_cmp(&c))
    });
    order
}

/// Gives windows, in this order, these rising ends, which count from the permitted beginning without the shortest
/// lengths.
fn place(permitted: Range, windows: &mut [(f64, f64)], order: &[usize], ends: &[f64]) {
    let Range { low, high, shortest, longest, .. } = permitted;
    let mut free = low;
    for (at, &window) in order.iter().enumerate() {
        // Rounding must carry no window into the one before it or beyond what is permitted.
        let start = (low + (ends[2 * at] + at as f64 * shortest)).clamp(free, high);
        let end = (low + (ends[2 * at + 1] + (at + 1) as f64 * shortest)).clamp(start, high).min(start + longest);
        windows[window] = (start, end);
        free = end;
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use sesame_rng::Stream;

    use super::*;

    fn windows() -> impl Strategy<Value = Vec<(f64, f64)>> {
        let range = Range::window(2.0, 12.0);
        (1usize..7, any::<u64>()).prop_map(move |(copies, seed)| {
            let mut stream = Stream::derive(seed, "test", &[]);
            (0..copies).map(|_| range.interval(&mut stream)).collect()
        })
    }

    /// What is wrong with disjoint windows, naively.
    fn wrong(range: Range, windows: &[(f64, f64)]) -> bool {
        let short =
            |&(start, end): &(f64, f64)| end - start < range.shortest * 0.999 || start < range.low || end > range.high;
        let meets = |a: &(f64, f64), b: &(f64, f64)| a.0 < b.1 && b.0 < a.1;
        windows.iter().any(short) || (0..windows.len()).any(|i| (0..i).any(|j| meets(&windows[i], &windows[j])))
    }

    fn far(a: &[(f64, f64)], b: &[(f64, f64)]) -> f64 {
        a.iter().zip(b).map(|(a, b)| (a.0 - b.0) * (a.0 - b.0) + (a.1 - b.1) * (a.1 - b.1)).sum()
    }

    proptest! {
        #[test]
        fn windows_come_out_disjoint_and_long_enough(given in windows()) {
            let range = Range::window(2.0, 12.0);
            for apart in [spread, nearest] {
                let mut windows = given.clone();
                apart(range, &mut windows);
                prop_assert!(!wrong(range, &windows), "{given:?} {windows:?}");
                let before = windows.clone();
                nearest(range, &mut windows);
                prop_assert_eq!(&windows, &before, "what is disjoint stays");
            }
        }

        #[test]
        fn windows_of_bounded_lengths_come_out_disjoint_and_of_permitted_lengths(
            copies in 1usize..7, low in 0.0..1.6f64, more in 0.0..3.0f64, seed: u64,
        ) {
            let range = Range { shortest: low.max(0.01), longest: low.max(0.01) + more, ..Range::window(2.0, 12.0) };
            let mut stream = Stream::derive(seed, "test", &[]);
            let given: Vec<(f64, f64)> = (0..copies).map(|_| range.interval(&mut stream)).collect();
            for apart in [spread, nearest] {
                let mut windows = given.clone();
                apart(range, &mut windows);
                prop_assert!(!wrong(range, &windows), "{given:?} {windows:?}");
                let long = windows.iter().any(|(start, end)| end - start > range.longest + 1e-9);
                prop_assert!(!long, "{given:?} {windows:?}");
            }
        }

        #[test]
        fn no_disjoint_windows_in_the_same_order_are_nearer(given in windows(), seed: u64) {
            let range = Range::window(2.0, 12.0);
            let mut windows = given.clone();
            nearest(range, &mut windows);
            let order = by_midpoint(&given);
            let mut stream = Stream::derive(seed, "test", &[]);
            for turn in 0..200 {
                // Others near the found ones and anywhere.
                let mut other = windows.clone();
                for window in &mut other {
                    let size = if turn % 2 == 0 { 0.05 } else { 3.0 };
                    let mut ends = [window.0, window.1].map(|end| (end + size * stream.normal()).clamp(2.0, 12.0));
                    ends.sort_by(f64::total_cmp);
                    *window = (ends[0], ends[1]);
                }
                if !wrong(range, &other) && by_midpoint(&other) == order {
                    prop_assert!(far(&given, &other) >= far(&given, &windows) - 1e-9, "{given:?} {windows:?} {other:?}");
                }
            }
        }
    }

    #[test]
    fn two_that_overlap_meet_in_the_middle_of_what_they_shared() {
        let range = Range::window(0.0, 40.0);
        let mut windows = [(12.0, 32.0), (10.0, 30.0)];
        nearest(range, &mut windows);
        assert!((windows[0].0 - windows[1].1).abs() < 1e-12 && (windows[0].0 - 21.0).abs() < 0.1, "{windows:?}");
        assert_eq!((windows[0].1, windows[1].0), (32.0, 10.0));
        let mut touching = [(3.0, 9.0), (1.0, 3.0)];
        nearest(range, &mut touching);
        assert_eq!(touching, [(3.0, 9.0), (1.0, 3.0)]);
    }

    /// Compares with windows drawn anew until they are disjoint, which are uniform over the disjoint ones by
    /// definition.
    #[test]
    fn fresh_windows_are_as_uniform_as_rejected_ones() {
        let range = Range::window(0.0, 1.0);
        let mut stream = Stream::derive(3, "test", &[]);
        let mut sums = [[0.0; 4]; 2];
        let n = 20_000;
        for _ in 0..n {
            let draw = |stream: &mut Stream| [(); 2].map(|()| range.interval(stream));
            let mut ours = draw(&mut stream);
            spread(range, &mut ours);
            let naive = loop {
                let drawn = draw(&mut stream);
                if !wrong(range, &drawn) {
                    break drawn;
                }
            };
            for (sums, [first, second]) in sums.iter_mut().zip([ours, naive]) {
                // Start, length, square of the length, and how often the first of the list is the earlier.
                let length = first.1 - first.0;
                let values = [first.0, length, length * length, f64::from(u8::from(first.0 < second.0))];
                sums.iter_mut().zip(values).for_each(|(sum, value)| *sum += value / f64::from(n));
            }
        }
        let [ours, naive] = sums;
        assert!(ours.iter().zip(naive).all(|(a, b)| (a - b).abs() < 0.012), "{ours:?} {naive:?}");
        // Each of the five gaps around four sorted numbers is a fifth on average.
        assert!((ours[1] - 0.2).abs() < 0.01, "{ours:?}");
    }
}
