//! Which test tells most about where a gap begins and ends.

/// A test whose comparison is known.
#[derive(Debug, Clone, PartialEq)]
pub struct Tried {
    /// Its coordinates, finite and of similar size in each dimension; `None` for one that it does not have.
    pub at: Vec<Option<f64>>,
    /// Whether it has a gap; `None` if that is undecided.
    pub gap: Option<bool>,
}

/// A candidate, and why it is the one.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Next {
    /// Its position among the candidates.
    pub candidate: usize,
    /// Why.
    pub why: Why,
}

/// Why a test tells most.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Why {
    /// It is between a test with a gap and one without: the edge of the gap is somewhere between these.
    Between {
        /// The position of the test with a gap, among those tried.
        gap: usize,
        /// The position of that without.
        none: usize,
    },
    /// No candidate is between such tests, and it is farthest from all that were tried.
    Farthest {
        /// The distance to the nearest of these; infinite if there are none, or none with a coordinate in common.
        distance: f64,
    },
}

/// The candidate that tells most; `None` without an untried one.
///
/// An edge is looked for between a test with a gap and one without, with no decided test between them. With a
/// dimension, such as that of the range in which a gap was found, a place is between two if its coordinate is, and the
/// pair that is widest apart comes first. Without one, it is between if it is nearer to both than they are to each
/// other, and the pair that is nearest comes first. Of several candidates the nearest to the middle of both is taken,
/// so edges are halved. If nothing is between, the candidate that is farthest from all tests is taken (maximin). A
/// candidate where a test was tried is never taken: to repeat it is another question.
pub fn next(tried: &[Tried], candidates: &[Vec<Option<f64>>], along: Option<usize>) -> Option<Next> {
    let between = pairs(tried, along).into_iter().find_map(|(gap, none)| {
        let (a, b) = (&tried[gap].at, &tried[none].at);
        let middle: Vec<Option<f64>> = a.iter().zip(b).map(|(x, y)| Some(f64::midpoint((*x)?, (*y)?))).collect();
        let is_between = |at: &[Option<f64>]| match along {
            Some(dimension) => strictly_between(at[dimension], a[dimension], b[dimension]),
            None => in_lens(at, a, b),
        };
        let inside = candidates.iter().enumerate().filter(|(_, at)| is_between(at) && !is_tried(tried, at));
        let nearest = inside.min_by(|x, y| distance(x.1, &middle).total_cmp(&distance(y.1, &middle)));
        nearest.map(|(candidate, _)| Next { candidate, why: Why::Between { gap, none } })
    });
    between.or_else(|| farthest(tried, candidates))
}

fn farthest(tried: &[Tried], candidates: &[Vec<Option<f64>>]) -> Option<Next> {
    let mut best: Option<(usize, f64)> = None;
    for (candidate, at) in candidates.iter().enumerate().filter(|(_, at)| !is_tried(tried, at)) {
        let nearest = tried.iter().map(|test| distance(at, &test.at)).fold(f64::INFINITY, f64::min);
        if best.is_none_or(|(_, distance)| nearest > distance) {
            best = Some((candidate, nearest));
        }
    }
    best.map(|(candidate, distance)| Next { candidate, why: Why::Farthest { distance } })
}

/// The pairs of a test with a gap and one without between which the edge is looked for, the first first.
fn pairs(tried: &[Tried], along: Option<usize>) -> Vec<(usize, usize)> {
    let mut pairs: Vec<(usize, usize, f64)> = Vec::new();
    if let Some(dimension) = along {
        let known = tried.iter().enumerate().filter_map(|(at, test)| Some((at, test.gap?, test.at[dimension]?)));
        let mut known: Vec<(usize, bool, f64)> = known.collect();
        known.sort_by(|a, b| a.2.total_cmp(&b.2));
        for pair in known.windows(2).filter(|pair| pair[0].1 != pair[1].1) {
            let (gap, none) = if pair[0].1 { (pair[0].0, pair[1].0) } else { (pair[1].0, pair[0].0) };
            pairs.push((gap, none, pair[0].2 - pair[1].2));
        }
    } else {
        let with = |gap: bool| (0..tried.len()).filter(move |&at| tried[at].gap == Some(gap));
        for (gap, none) in with(true).flat_map(|gap| with(false).map(move |none| (gap, none))) {
            let (a, b) = (&tried[gap].at, &tried[none].at);
            let mut decided = tried.iter().filter(|test| test.gap.is_some());
            if !decided.any(|test| in_lens(&test.at, a, b)) {
                pairs.push((gap, none, distance(a, b)));
            }
        }
    }
    pairs.sort_by(|a, b| a.2.total_cmp(&b.2));
    pairs.into_iter().map(|(gap, none, _)| (gap, none)).collect()
}

/// Whether a place is nearer to both of two than they are to each other.
fn in_lens(at: &[Option<f64>], a: &[Option<f64>], b: &[Option<f64>]) -> bool {
    let apart = distance(a, b);
    distance(at, a) < apart && distance(at, b) < apart
}

fn is_tried(tried: &[Tried], at: &[Option<f64>]) -> bool {
    tried.iter().any(|test| test.at == at)
}

fn strictly_between(x: Option<f64>, a: Option<f64>, b: Option<f64>) -> bool {
    let (Some(x), Some(a), Some(b)) = (x, a, b) else { return false };
    a.min(b) < x && x < a.max(b)
}

/// The root mean square of the differences in the coordinates that both have; infinite if there are none.
fn distance(a: &[Option<f64>], b: &[Option<f64>]) -> f64 {
    assert!(a.len() == b.len(), "all tests have as many coordinates");
    let squares = a.iter().zip(b).filter_map(|(x, y)| Some(((*x)? - (*y)?) * ((*x)? - (*y)?)));
    let (count, sum) = squares.fold((0, 0.0), |(count, sum), square| (count + 1, sum + square));
    if count == 0 { f64::INFINITY } else { libm::sqrt(sum / f64::from(count)) }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn tried(at: &[f64], gap: Option<bool>) -> Tried {
        Tried { at: place(at), gap }
    }

    fn place(at: &[f64]) -> Vec<Option<f64>> {
        at.iter().map(|&x| Some(x)).collect()
    }

    #[test]
    fn the_edge_of_a_gap_is_halved_until_no_candidate_is_left() {
        let edge = 0.37;
        let candidates: Vec<Vec<Option<f64>>> = (1..100).map(|i| place(&[f64::from(i) / 100.0, 0.5])).collect();
        for along in [Some(0), None] {
            let mut known = vec![tried(&[0.0, 0.5], Some(false)), tried(&[1.0, 0.5], Some(true))];
            let mut steps = 0;
            while let Some(Next { candidate, why: Why::Between { .. } }) = next(&known, &candidates, along) {
                let at = candidates[candidate][0].unwrap();
                known.push(tried(&[at, 0.5], Some(at > edge)));
                steps += 1;
            }
            assert!(steps <= 8, "{steps} tests, where seven divide a hundred");
            let has = |x: f64, gap| known.iter().any(|test| test.at[0] == Some(x) && test.gap == Some(gap));
            assert!(has(0.37, false) && has(0.38, true));
        }
    }

    #[test]
    fn without_an_edge_the_emptiest_place_is_next() {
        let candidates = [place(&[0.1]), place(&[0.6]), place(&[0.95])];
        let known = [tried(&[0.0], Some(true)), tried(&[1.0], None)];
        let found = next(&known, &candidates, None).unwrap();
        assert_eq!(found.candidate, 1);
        assert!(matches!(found.why, Why::Farthest { distance } if (distance - 0.4).abs() < 1e-12));
        assert_eq!(next(&[], &candidates, None).unwrap().why, Why::Farthest { distance: f64::INFINITY });
        assert_eq!(next(&known, &[], None), None);
        assert_eq!(next(&known, &[place(&[1.0])], None), None, "what was tried is not tried again");
    }

    #[test]
    fn a_test_that_is_undecided_or_lacks_the_coordinate_is_no_end_of_an_edge() {
        let candidates = [place(&[0.5]), vec![None]];
        let known = [tried(&[0.0], Some(true)), tried(&[1.0], None), Tried { at: vec![None], gap: Some(false) }];
        assert!(matches!(next(&known, &candidates, Some(0)).unwrap().why, Why::Farthest { .. }));
    }
}
