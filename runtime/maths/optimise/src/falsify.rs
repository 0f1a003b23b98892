//! Focused falsification: find a violation of each requirement within a few dozen simulations.
//!
//! Each test targets one requirement, which a `bandit` chooses. A Gaussian process is fitted to the
//! margins of that requirement in all tests so far, and the candidate with the lowest lower confidence bound (mean
//! minus κ standard deviations) is asked for. κ alternates between 0 and more, so the search both refines and explores.
//! The first few tests are quasi-random.
//!
//! What is searched is a [`SearchDomain`]: the vectors of a unit box, or the tests of a campaign.

mod bandit;
mod gaussian_process;
mod unit_box;

use bandit::Bandit;
use gaussian_process::{GaussianProcess, SquaredDistances};

use sesame_rng::Stream;

pub use unit_box::UnitBox;

/// What is searched: points, and how far apart they are.
pub trait SearchDomain {
    /// One candidate.
    type Point: Clone;

    /// Point number `index` of a low-discrepancy sequence.
    fn quasi_random(&mut self, index: u32) -> Self::Point;

    /// A random point.
    fn random(&self, stream: &mut Stream) -> Self::Point;

    /// A random point near another; `step` is roughly the size of the change as a share of the domain, in `0..1`.
    fn perturb(&self, point: &Self::Point, step: f64, stream: &mut Stream) -> Self::Point;

    /// A point that does not come from the surrogate, for every second test of a requirement. `best` are the best
    /// points so far, the best first, at least one. `None` for domains on which margins are smooth enough to rely on
    /// the surrogate alone.
    fn explore(&self, _turn: u32, _best: &[&Self::Point], _stream: &mut Stream) -> Option<Self::Point> {
        None
    }

    /// How many components a distance has, at least one.
    fn components(&self) -> usize;

    /// Pushes the squared distance of two points in each component: 0 in each component for equal points, and the sum
    /// is a squared distance in some Euclidean space.
    fn squared_distances(&self, a: &Self::Point, b: &Self::Point, squares: &mut Vec<f64>);
}

/// How far a requirement is from its violation in one run.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Margin {
    /// The margin, never NaN, smaller the nearer the requirement is to its violation; `None` if the run is
    /// inconclusive.
    pub value: Option<f64>,
    /// Whether it is violated.
    pub violated: bool,
}

/// The sizes of a search.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Settings {
    /// How many requirements there are, at least one.
    pub requirements: usize,
    /// Tests in total.
    pub evaluations: u32,
    /// Tests asked for at once after the first ones, at least one. Each test of a batch is chosen as if the earlier
    /// ones of the batch had the margins that the surrogate predicts for them.
    pub batch: u32,
    /// The seed of all draws.
    pub seed: u64,
}

/// The most tests that a surrogate is fitted to: its cost grows with their cube.
const HISTORY: usize = 100;
/// Candidates that are compared for a test: perturbed from the best points, and random.
const NEAR: u64 = 200;
const RANDOM: u64 = 100;
/// Then, in this many rounds, points perturbed from the best candidate.
const REFINEMENTS: u64 = 3;
const PER_REFINEMENT: u64 = 30;
/// How many of the best points are perturbed.
const BASES: usize = 3;
/// How many of the best points [`SearchDomain::explore`] is given.
const PARENTS: usize = 6;
/// The weights κ of the standard deviation in the lower confidence bound, in turn.
const KAPPAS: [f64; 3] = [0.0, 1.0, 2.0];

/// Margins are outliers if they are this many times further above the median than the lowest one is below it.
const OUTLIER_SCALE: f64 = 4.0;

/// A focused falsification by ask and tell.
#[derive(Debug, Clone)]
pub struct Falsifier<D: SearchDomain> {
    domain: D,
    settings: Settings,
    bandit: Bandit,
    /// Per requirement, the tests that its surrogate is fitted to.
    histories: Vec<History<D::Point>>,
    asked: u32,
    /// The target of each point that was asked for and not told yet; `None` for the first, quasi-random ones.
    awaited: Vec<Option<usize>>,
}

#[derive(Debug, Clone)]
struct History<P> {
    /// In the order of evaluation.
    points: Vec<(P, Option<f64>)>,
}

impl<D: SearchDomain> Falsifier<D> {
    /// A search before its first test.
    pub fn new(domain: D, settings: Settings) -> Self {
        assert!(settings.requirements > 0 && settings.batch > 0, "a search has a requirement, and a batch has a test");
        let histories = (0..settings.requirements).map(|_| History { points: Vec::new() }).collect();
        Falsifier {
            domain,
            settings,
            bandit: Bandit::new(settings.requirements),
            histories,
            asked: 0,
            awaited: Vec::new(),
        }
    }

    /// The domain, for what becomes known of it before the first points are asked for.
    pub fn domain_mut(&mut self) -> &mut D {
        &mut self.domain
    }

    /// How many quasi-random tests come first.
    fn first(&self) -> u32 {
        let components = u32::try_from(self.domain.components()).unwrap_or(u32::MAX);
        (components.saturating_add(5)).clamp(6, 12).min(self.settings.evaluations)
    }

    /// The next points; empty when all evaluations are used up.
    pub fn ask(&mut self) -> Vec<D::Point> {
        assert!(self.awaited.is_empty(), "a batch is told before the next is asked");
        let left = self.settings.evaluations - self.asked;
        let batch = if self.asked == 0 {
            let first = self.first();
            self.awaited = vec![None; first as usize];
            (0..first).map(|index| self.domain.quasi_random(index)).collect()
        } else {
            self.next_batch(self.settings.batch.min(left))
        };
        self.asked += u32::try_from(batch.len()).expect("no more than there are evaluations");
        batch
    }

    /// Takes the margins of exactly the points asked last, in their order: one margin of each requirement.
    pub fn tell(&mut self, results: Vec<(D::Point, Vec<Margin>)>) {
        assert!(results.len() == self.awaited.len(), "exactly what was asked last is told");
        let awaited = std::mem::take(&mut self.awaited);
        for ((point, margins), target) in results.into_iter().zip(awaited) {
            assert!(margins.len() == self.settings.requirements, "each requirement has a margin");
            self.bandit.update(&margins, target);
            for (history, margin) in self.histories.iter_mut().zip(&margins) {
                history.add(point.clone(), margin.value);
            }
        }
    }

    fn next_batch(&mut self, batch: u32) -> Vec<D::Point> {
        let mut pending = vec![0; self.settings.requirements];
        let mut surrogates: Vec<Option<Surrogate<D::Point>>> = vec![None; self.settings.requirements];
        let mut points: Vec<D::Point> = Vec::new();
        for at in 0..batch {
            let requirement = self.bandit.choose(&pending);
            let turn = self.bandit.pulls(requirement) + pending[requirement];
            let mut stream = Stream::derive(self.settings.seed, "falsify", &[u64::from(self.asked + at)]);
            pending[requirement] += 1;
            self.awaited.push(Some(requirement));
            if turn % 2 == 1 {
                let best = self.histories[requirement].best();
                if let Some(point) = self.domain.explore(turn / 2, &best, &mut stream) {
                    points.push(point);
                    continue;
                }
            }
            let mut surrogate = match surrogates[requirement].take() {
                Some(surrogate) => surrogate,
                None => Surrogate::fit(&self.domain, &self.histories[requirement]),
            };
            let kappa = KAPPAS[turn as usize % KAPPAS.len()];
            let point = surrogate.minimise_acquisition(&self.domain, kappa, &mut stream);
            points.push(point.clone());
            if at + 1 < batch {
                surrogate.assume(&self.domain, point);
                surrogates[requirement] = Some(surrogate);
            }
        }
        points
    }
}

impl<P> History<P> {
    /// The best points, the best first; of equal ones, the earlier first.
    fn best(&self) -> Vec<&P> {
        let margin = |at: &usize| self.points[*at].1.unwrap_or(f64::INFINITY);
        let mut order: Vec<usize> = (0..self.points.len()).collect();
        order.sort_by(|a, b| margin(a).total_cmp(&margin(b)));
        order.into_iter().take(PARENTS).map(|at| &self.points[at].0).collect()
    }

    fn add(&mut self, point: P, margin: Option<f64>) {
        self.points.push((point, margin));
        if self.points.len() > HISTORY {
            // The worst of the older half is removed, so the best and the latest remain.
            let worse = |(_, margin): &(P, Option<f64>)| margin.unwrap_or(f64::INFINITY);
            let older = self.points[..HISTORY / 2].iter().enumerate();
            let worst = older.max_by(|a, b| worse(a.1).total_cmp(&worse(b.1))).expect("there is an older half").0;
            self.points.remove(worst);
        }
    }
}

/// A Gaussian process fitted to the margins of one requirement.
#[derive(Debug, Clone)]
struct Surrogate<P> {
    points: Vec<P>,
    values: Vec<f64>,
    distances: SquaredDistances,
    process: GaussianProcess,
}

impl<P: Clone> Surrogate<P> {
    fn fit<D: SearchDomain<Point = P>>(domain: &D, history: &History<P>) -> Self {
        let points: Vec<P> = history.points.iter().map(|(point, _)| point.clone()).collect();
        let values = compress_outliers(&history.points.iter().map(|(_, margin)| *margin).collect::<Vec<_>>());
        let mut distances = SquaredDistances::new(domain.components());
        let mut squares = Vec::new();
        for (at, point) in points.iter().enumerate() {
            squares.clear();
            points[..at].iter().for_each(|earlier| domain.squared_distances(point, earlier, &mut squares));
            distances.add(&squares);
        }
        let process = GaussianProcess::fit(&distances, &values);
        Surrogate { points, values, distances, process }
    }

    /// The point with the lowest lower confidence bound of those compared.
    fn minimise_acquisition<D: SearchDomain<Point = P>>(&self, domain: &D, kappa: f64, stream: &mut Stream) -> P {
        let mut order: Vec<usize> = (0..self.points.len()).collect();
        order.sort_by(|&a, &b| self.values[a].total_cmp(&self.values[b]));
        order.truncate(BASES);
        let mut best: Option<(P, f64)> = None;
        let mut squares = Vec::new();
        let mut compare = |point: P, best: &mut Option<(P, f64)>| {
            squares.clear();
            self.points.iter().for_each(|known| domain.squared_distances(&point, known, &mut squares));
            if squares.chunks_exact(domain.components()).any(|of| of.iter().sum::<f64>() < 1e-12) {
                // A known point is not tried again.
                return;
            }
            let (mean, deviation) = self.process.predict(&squares);
            let reserved = mean - kappa * deviation;
            if best.as_ref().is_none_or(|(_, least)| reserved < *least) {
                *best = Some((point, reserved));
            }
        };
        for _ in 0..RANDOM {
            compare(domain.random(stream), &mut best);
        }
        for _ in 0..NEAR {
            let from = &self.points[order[stream.below(order.len())]];
            let step = step(0.003, 0.5, stream);
            compare(domain.perturb(from, step, stream), &mut best);
        }
        for round in 0..REFINEMENTS {
            for _ in 0..PER_REFINEMENT {
                let Some((from, _)) = best.clone() else { break };
                let step = step(0.001, 0.1 / (round + 1) as f64, stream);
                compare(domain.perturb(&from, step, stream), &mut best);
            }
        }
        // If all candidates are known, the domain has few points, and any will do.
        best.map_or_else(|| domain.random(stream), |(point, _)| point)
    }

    /// Adds a point with the margin that is predicted for it.
    fn assume<D: SearchDomain<Point = P>>(&mut self, domain: &D, point: P) {
        let mut squares = Vec::new();
        self.points.iter().for_each(|known| domain.squared_distances(&point, known, &mut squares));
        let (mean, _) = self.process.predict(&squares);
        self.distances.add(&squares);
        self.points.push(point);
        self.values.push(mean);
        self.process = self.process.refit(&self.distances, &self.values);
    }
}

/// A point that a surrogate of what is known proposes: the one with the lowest lower confidence bound of those
/// compared, for a random weight of the deviation. `known` are at least one point with their margins, where these are
/// known; the cost grows with the cube of their number.
pub fn propose<D: SearchDomain>(domain: &D, known: &[(D::Point, Option<f64>)], stream: &mut Stream) -> D::Point {
    let surrogate = Surrogate::fit(domain, &History { points: known.to_vec() });
    let kappa = KAPPAS[stream.below(KAPPAS.len())];
    surrogate.minimise_acquisition(domain, kappa, stream)
}

/// A random step between two, uniform in its logarithm.
fn step(least: f64, most: f64, stream: &mut Stream) -> f64 {
    least * libm::pow(most / least, stream.unit())
}

/// Scales margins and compresses outliers above the median logarithmically: a default of 999 s must not hide the
/// differences between the others. Unknown margins count as the greatest.
fn compress_outliers(margins: &[Option<f64>]) -> Vec<f64> {
    let mut known: Vec<f64> = margins.iter().flatten().copied().filter(|margin| margin.is_finite()).collect();
    known.sort_by(f64::total_cmp);
    let (Some(&least), Some(&most)) = (known.first(), known.last()) else { return vec![0.0; margins.len()] };
    let median = known[known.len() / 2];
    let scale = (median - least).max(1e-300);
    margins
        .iter()
        .map(|margin| {
            let margin = margin.unwrap_or(f64::INFINITY).clamp(least, most);
            let above = (margin - median).max(0.0) / scale;
            (margin.min(median) - least) / scale
                + above.min(OUTLIER_SCALE)
                + libm::log1p((above - OUTLIER_SCALE).max(0.0))
        })
        .collect()
}
