//! Focused falsification: a violation of each requirement within a few dozen simulations.
//!
//! Requirements are gone for one at a time, as a [bandit] chooses. Of the chosen one the margin to its violation is learned from
//! all tests so far as a Gaussian process ([field]), and the candidate that promises the least margin is asked for: sometimes
//! by the process's mean, sometimes with its doubt counted in (lower confidence bounds), so that it both refines and looks
//! elsewhere. A few tests spread evenly come first.
//!
//! What is searched is a [`Ground`]: vectors of a unit box, or the tests of a campaign.

mod bandit;
mod box_ground;
mod field;

use bandit::Bandit;
use field::{Field, Separations};

use sesame_rng::Stream;

pub use box_ground::UnitBox;

/// What can be tried: places, and what is known of how far they are from each other.
pub trait Ground {
    /// What is tried.
    type Place: Clone;

    /// Place number `index` of a sequence that fills the ground evenly.
    fn spread(&mut self, index: u32) -> Self::Place;

    /// A place anywhere.
    fn anywhere(&self, stream: &mut Stream) -> Self::Place;

    /// A place near another; `reach` is roughly the share of the ground that is moved, in `0..1`.
    fn near(&self, place: &Self::Place, reach: f64, stream: &mut Stream) -> Self::Place;

    /// A place found otherwise than by what is to be expected of it, for every second test; `best` are the best places so far,
    /// the best first, at least one. `None` on grounds that are smooth enough to go by expectations alone.
    fn otherwise(&self, _turn: u32, _best: &[&Self::Place], _stream: &mut Stream) -> Option<Self::Place> {
        None
    }

    /// How many components separations have, at least one.
    fn components(&self) -> usize;

    /// Pushes the squared separation of two places in each component: 0 in all where they are the same, and such that the sum
    /// is a squared distance in some Euclidean space.
    fn separation(&self, a: &Self::Place, b: &Self::Place, squares: &mut Vec<f64>);
}

/// How far a requirement is from its violation in one test.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Margin {
    /// The margin, never NaN, smaller where the requirement is nearer to its violation; `None` where the run says nothing.
    pub value: Option<f64>,
    /// Whether it is violated.
    pub violated: bool,
}

/// How much is tried.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Settings {
    /// How many requirements there are, at least one.
    pub requirements: usize,
    /// Tests in total.
    pub evaluations: u32,
    /// Tests asked for at once after the first ones, at least one. Each but the first of a batch is chosen as if the others had
    /// come to what is expected of them.
    pub batch: u32,
    /// The seed of all draws.
    pub seed: u64,
}

/// Tests that a process is fitted to at most: what it costs grows with their cube.
const MEMORY: usize = 100;
/// Places compared for a test: near the best ones, and anywhere.
const NEAR: u64 = 200;
const ANYWHERE: u64 = 100;
/// Then, in so many rounds, places near the most promising one.
const ROUNDS: u64 = 3;
const PER_ROUND: u64 = 30;
/// How many of the best places are gone out from.
const BEST: usize = 3;
/// How many of the best are offered to what is found otherwise.
const PARENTS: usize = 6;
/// How much of the doubt counts in favour of a place, in turn.
const DOUBTS: [f64; 3] = [0.0, 1.0, 2.0];

/// Margins so many times further above the median than the least one is below are outliers.
const STRAIGHT: f64 = 4.0;

/// A focused falsification by ask and tell.
#[derive(Debug, Clone)]
pub struct Falsifier<G: Ground> {
    ground: G,
    settings: Settings,
    bandit: Bandit,
    /// Per requirement, what is remembered of its tests.
    memories: Vec<Memory<G::Place>>,
    asked: u32,
    /// Of each place that was asked for and not told yet, the requirement it goes for.
    awaited: Vec<Option<usize>>,
}

#[derive(Debug, Clone)]
struct Memory<P> {
    /// In the order of evaluation.
    places: Vec<(P, Option<f64>)>,
}

impl<G: Ground> Falsifier<G> {
    /// A search before its first test.
    pub fn new(ground: G, settings: Settings) -> Self {
        assert!(settings.requirements > 0 && settings.batch > 0, "there is something to go for, and a test at a time");
        let memories = (0..settings.requirements).map(|_| Memory { places: Vec::new() }).collect();
        Falsifier {
            ground,
            settings,
            bandit: Bandit::new(settings.requirements),
            memories,
            asked: 0,
            awaited: Vec::new(),
        }
    }

    /// How many tests come first, spread evenly.
    fn first(&self) -> u32 {
        let components = u32::try_from(self.ground.components()).unwrap_or(u32::MAX);
        (components.saturating_add(5)).clamp(6, 12).min(self.settings.evaluations)
    }

    /// The next places; none when all evaluations are used up.
    pub fn ask(&mut self) -> Vec<G::Place> {
        assert!(self.awaited.is_empty(), "what was asked is told before the next is asked");
        let left = self.settings.evaluations - self.asked;
        let batch = if self.asked == 0 {
            let first = self.first();
            self.awaited = vec![None; first as usize];
            (0..first).map(|index| self.ground.spread(index)).collect()
        } else {
            self.chosen(self.settings.batch.min(left))
        };
        self.asked += u32::try_from(batch.len()).expect("no more than there are evaluations");
        batch
    }

    /// Takes the margins of exactly the places asked last, in their order: one margin of each requirement.
    pub fn tell(&mut self, results: Vec<(G::Place, Vec<Margin>)>) {
        assert!(results.len() == self.awaited.len(), "exactly what was asked last is told");
        let awaited = std::mem::take(&mut self.awaited);
        for ((place, margins), went_for) in results.into_iter().zip(awaited) {
            assert!(margins.len() == self.settings.requirements, "each requirement has a margin");
            self.bandit.learn(&margins, went_for);
            for (memory, margin) in self.memories.iter_mut().zip(&margins) {
                memory.add(place.clone(), margin.value);
            }
        }
    }

    fn chosen(&mut self, batch: u32) -> Vec<G::Place> {
        let mut coming = vec![0; self.settings.requirements];
        let mut expected: Vec<Option<Fitted<G::Place>>> = vec![None; self.settings.requirements];
        let mut places: Vec<G::Place> = Vec::new();
        for at in 0..batch {
            let requirement = self.bandit.choice(&coming);
            let turn = self.bandit.pulls(requirement) + coming[requirement];
            let mut stream = Stream::derive(self.settings.seed, "falsify", &[u64::from(self.asked + at)]);
            coming[requirement] += 1;
            self.awaited.push(Some(requirement));
            if turn % 2 == 1 {
                let best = self.memories[requirement].best();
                if let Some(place) = self.ground.otherwise(turn / 2, &best, &mut stream) {
                    places.push(place);
                    continue;
                }
            }
            let mut fitted = match expected[requirement].take() {
                Some(fitted) => fitted,
                None => Fitted::of(&self.ground, &self.memories[requirement]),
            };
            let doubt = DOUBTS[turn as usize % DOUBTS.len()];
            let place = fitted.most_promising(&self.ground, doubt, &mut stream);
            places.push(place.clone());
            if at + 1 < batch {
                fitted.expect(&self.ground, place);
                expected[requirement] = Some(fitted);
            }
        }
        places
    }
}

impl<P> Memory<P> {
    /// The best places, of equals the earliest first.
    fn best(&self) -> Vec<&P> {
        let margin = |at: &usize| self.places[*at].1.unwrap_or(f64::INFINITY);
        let mut order: Vec<usize> = (0..self.places.len()).collect();
        order.sort_by(|a, b| margin(a).total_cmp(&margin(b)));
        order.into_iter().take(PARENTS).map(|at| &self.places[at].0).collect()
    }

    fn add(&mut self, place: P, margin: Option<f64>) {
        self.places.push((place, margin));
        if self.places.len() > MEMORY {
            // Of the older half the worst goes: the best stay, and so does what was learned last.
            let worse = |(_, margin): &(P, Option<f64>)| margin.unwrap_or(f64::INFINITY);
            let older = self.places[..MEMORY / 2].iter().enumerate();
            let worst = older.max_by(|a, b| worse(a.1).total_cmp(&worse(b.1))).expect("there is an older half").0;
            self.places.remove(worst);
        }
    }
}

/// What is known of one requirement, fitted.
#[derive(Debug, Clone)]
struct Fitted<P> {
    places: Vec<P>,
    values: Vec<f64>,
    separations: Separations,
    field: Field,
}

impl<P: Clone> Fitted<P> {
    fn of<G: Ground<Place = P>>(ground: &G, memory: &Memory<P>) -> Self {
        let places: Vec<P> = memory.places.iter().map(|(place, _)| place.clone()).collect();
        let values = flattened(&memory.places.iter().map(|(_, margin)| *margin).collect::<Vec<_>>());
        let mut separations = Separations::new(ground.components());
        let mut squares = Vec::new();
        for (at, place) in places.iter().enumerate() {
            squares.clear();
            places[..at].iter().for_each(|earlier| ground.separation(place, earlier, &mut squares));
            separations.add(&squares);
        }
        let field = Field::fitted(&separations, &values);
        Fitted { places, values, separations, field }
    }

    /// The place with the least margin to be expected, part of the doubt subtracted.
    fn most_promising<G: Ground<Place = P>>(&self, ground: &G, doubt: f64, stream: &mut Stream) -> P {
        let mut order: Vec<usize> = (0..self.places.len()).collect();
        order.sort_by(|&a, &b| self.values[a].total_cmp(&self.values[b]));
        order.truncate(BEST);
        let mut best: Option<(P, f64)> = None;
        let mut squares = Vec::new();
        let mut compare = |place: P, best: &mut Option<(P, f64)>| {
            squares.clear();
            self.places.iter().for_each(|known| ground.separation(&place, known, &mut squares));
            if squares.chunks_exact(ground.components()).any(|of| of.iter().sum::<f64>() < 1e-12) {
                // What is known is not tried again.
                return;
            }
            let (mean, deviation) = self.field.at(&squares);
            let promised = mean - doubt * deviation;
            if best.as_ref().is_none_or(|(_, least)| promised < *least) {
                *best = Some((place, promised));
            }
        };
        for _ in 0..ANYWHERE {
            compare(ground.anywhere(stream), &mut best);
        }
        for _ in 0..NEAR {
            let from = &self.places[order[stream.below(order.len())]];
            let reach = reach(0.003, 0.5, stream);
            compare(ground.near(from, reach, stream), &mut best);
        }
        for round in 0..ROUNDS {
            for _ in 0..PER_ROUND {
                let Some((from, _)) = best.clone() else { break };
                let reach = reach(0.001, 0.1 / (round + 1) as f64, stream);
                compare(ground.near(&from, reach, stream), &mut best);
            }
        }
        // Where nothing new was found, the ground has few places and any will do.
        best.map_or_else(|| ground.anywhere(stream), |(place, _)| place)
    }

    /// Takes it that a place comes to what is expected of it.
    fn expect<G: Ground<Place = P>>(&mut self, ground: &G, place: P) {
        let mut squares = Vec::new();
        self.places.iter().for_each(|known| ground.separation(&place, known, &mut squares));
        let (mean, _) = self.field.at(&squares);
        self.separations.add(&squares);
        self.places.push(place);
        self.values.push(mean);
        self.field = self.field.refitted(&self.separations, &self.values);
    }
}

/// A reach between two, any order of magnitude alike.
fn reach(least: f64, most: f64, stream: &mut Stream) -> f64 {
    least * libm::pow(most / least, stream.unit())
}

/// Margins with outliers above drawn together: a default of 999 s must not hide the differences of those below. What is not
/// known counts as the worst.
fn flattened(margins: &[Option<f64>]) -> Vec<f64> {
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
            (margin.min(median) - least) / scale + above.min(STRAIGHT) + libm::log1p((above - STRAIGHT).max(0.0))
        })
        .collect()
}
