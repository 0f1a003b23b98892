//! Indicators of a search: after each generation, how good its front is and what its tests came to.
//!
//! While a campaign runs, it is not known how far its front will get, so hypervolumes are measured from a point that is
//! fixed early and never moved: of each objective the worst value of the reference run and of the tests up to and
//! including the first generation with a measured one, and half of the range of these values beyond it. Only finite
//! values count. It follows from results alone, so a resumed campaign has the same one.

use serde::Serialize;

use sesame_base::observation::Outcome;
use sesame_optimise::dominance::Fitness;
use sesame_optimise::front::Front;
use sesame_optimise::hypervolume::{self, Volume};

/// How far beyond the worst value the reference point lies, as a share of the range of values: far enough that a front
/// counts which later spreads beyond the first tests, near enough that what is gained shows.
const MARGIN: f64 = 0.5;

/// What a search has come to after a generation.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct GenerationIndicators {
    /// The generation.
    pub generation: u32,
    /// Tests evaluated by then.
    pub evaluations: u32,
    /// How many of these were simulated: exact duplicates of an earlier test are not.
    pub unique: u32,
    /// How many of these had no operation with any effect.
    pub no_effect: u32,
    /// How many of these ended in a crash.
    pub crashes: u32,
    /// How many of these were stopped at their time limit.
    pub timeouts: u32,
    /// Tests on the front.
    pub front: u32,
    /// The hypervolume of the front up to the reference point, in the product of the objectives' units; `None` without
    /// objectives, before there is a reference point, and where the front has no end.
    pub hypervolume: Option<f64>,
    /// The standard error of the hypervolume where it is an estimate, as an exact one would have taken too long; `None`
    /// where it is exact, and where there is none.
    pub standard_error: Option<f64>,
}

/// Watches a search. Tests of one generation may come in any order.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Indicators {
    /// What the reference point is to be made of, while there is none.
    early: Vec<Vec<f64>>,
    reference: Option<Vec<f64>>,
    evaluations: u32,
    duplicates: u32,
    no_effect: u32,
    crashes: u32,
    timeouts: u32,
    /// The front's members at the latest generation with their hypervolume: mostly the next one has the same.
    latest: Option<(Vec<u32>, Option<Volume>)>,
}

impl Indicators {
    /// Before the first generation, after the reference run, of which an import has none.
    pub fn new(reference_run: Option<&Fitness>) -> Indicators {
        let early = reference_run.and_then(Fitness::objectives).map(<[f64]>::to_vec).into_iter().collect();
        Indicators { early, ..Indicators::default() }
    }

    /// Takes a test into account.
    pub fn add(&mut self, outcome: &Outcome, duplicate: bool, fitness: &Fitness) {
        self.evaluations += 1;
        self.duplicates += u32::from(duplicate);
        match outcome {
            Outcome::Completed
            | Outcome::Unknown
            | Outcome::LaunchFailed { .. }
            | Outcome::Disconnect { .. }
            | Outcome::WrongClock { .. } => {}
            Outcome::NoEffect => self.no_effect += 1,
            Outcome::Crash { .. } => self.crashes += 1,
            Outcome::Timeout { .. } => self.timeouts += 1,
        }
        if self.reference.is_none() {
            self.early.extend(fitness.objectives().map(<[f64]>::to_vec));
        }
    }

    /// The indicators at the end of a generation, with the front by then.
    pub fn after(&mut self, generation: u32, front: &Front) -> GenerationIndicators {
        if self.reference.is_none() && !front.members().is_empty() {
            self.reference = reference_point(&self.early);
            self.early.clear();
        }
        let numbers = front.numbers();
        let measured = match &self.latest {
            Some((members, volume)) if *members == numbers => *volume,
            _ => self.reference.as_ref().and_then(|reference| volume(front, reference)),
        };
        // Before there is a reference point nothing is remembered: the same front has a volume once there is one.
        self.latest = self.reference.is_some().then_some((numbers, measured));
        GenerationIndicators {
            generation,
            evaluations: self.evaluations,
            unique: self.evaluations - self.duplicates,
            no_effect: self.no_effect,
            crashes: self.crashes,
            timeouts: self.timeouts,
            front: u32::try_from(front.members().len()).unwrap_or(u32::MAX),
            hypervolume: measured.map(|volume| volume.value),
            standard_error: measured.and_then(|volume| volume.error),
        }
    }

    /// The point hypervolumes are measured from, oriented as a fitness is, once there is one.
    pub fn reference(&self) -> Option<&[f64]> {
        self.reference.as_deref()
    }
}

/// The hypervolume of a front up to a point, estimated where an exact one would take too long; `None` where it has no
/// end.
pub fn volume(front: &Front, reference: &[f64]) -> Option<Volume> {
    let points: Vec<&[f64]> = front.members().iter().map(|member| member.objectives.as_slice()).collect();
    let volume = hypervolume::measured(&points, reference, hypervolume::WORK);
    (volume.value.is_finite() && !reference.is_empty()).then_some(volume)
}

/// The worst finite value of each objective, and half of the range of all beyond it; `None` where an objective has no
/// finite value.
pub fn reference_point<P: AsRef<[f64]>>(points: &[P]) -> Option<Vec<f64>> {
    let objectives = points.first()?.as_ref().len();
    let place = |at: usize| {
        let values = points.iter().map(|point| point.as_ref()[at]).filter(|value| value.is_finite());
        let (best, worst) = values.fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), x| (low.min(x), high.max(x)));
        Some(worst + MARGIN * (worst - best)).filter(|place| place.is_finite())
    };
    (0..objectives).map(place).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn measured(values: [f64; 2]) -> Fitness {
        Fitness::Measured(values.to_vec())
    }

    #[test]
    fn hypervolumes_are_measured_from_beyond_the_worst_of_the_first_generation_that_measured_anything() {
        let mut indicators = Indicators::new(Some(&measured([0.0, 0.0])));
        let crash = Outcome::Crash { message: "gone".to_owned() };
        let mut front = Front::default();
        indicators.add(&crash, false, &Fitness::Unfit(sesame_optimise::dominance::Unfit::Crash));
        let nothing = indicators.after(0, &front);
        assert_eq!((nothing.crashes, nothing.evaluations, nothing.hypervolume), (1, 1, None));
        for (number, values) in [(2, [10.0, -3.0]), (3, [4.0, f64::NEG_INFINITY]), (4, [20.0, -5.0])] {
            indicators.add(&Outcome::Completed, false, &measured(values));
            if values[1].is_finite() {
                front.add(number, &measured(values));
            }
        }
        let second = indicators.after(1, &front);
        assert_eq!(indicators.reference(), Some(&[30.0, 2.5][..]));
        assert_eq!((second.front, second.hypervolume), (2, Some(20.0 * 5.5 + 10.0 * 2.0)));
        // What is worse later moves nothing.
        indicators.add(&Outcome::Completed, true, &measured([100.0, 50.0]));
        let third = indicators.after(2, &front);
        assert_eq!((third.hypervolume, third.evaluations, third.unique), (second.hypervolume, 5, 4));
    }

    #[test]
    fn a_front_without_end_or_objectives_has_no_hypervolume() {
        let mut indicators = Indicators::new(None);
        let mut front = Front::default();
        for (number, values) in [(1, [1.0, f64::NEG_INFINITY]), (2, [0.0, 3.0])] {
            indicators.add(&Outcome::Completed, false, &measured(values));
            front.add(number, &measured(values));
        }
        assert_eq!(indicators.after(0, &front).hypervolume, None);
        assert!(indicators.reference().is_some());
        let mut indicators = Indicators::new(None);
        let front = Front::from_tests([(1, &Fitness::Measured(Vec::new()))]);
        indicators.add(&Outcome::Completed, false, &Fitness::Measured(Vec::new()));
        assert_eq!(indicators.after(0, &front).hypervolume, None);
    }

    #[test]
    fn a_front_of_many_objectives_has_an_estimated_hypervolume_that_says_so() {
        let mut stream = sesame_rng::Stream::derive(1, "test", &[]);
        let points: Vec<Fitness> =
            (0..80).map(|_| Fitness::Measured((0..12).map(|_| stream.unit()).collect())).collect();
        let mut indicators = Indicators::new(None);
        for point in &points {
            indicators.add(&Outcome::Completed, false, point);
        }
        let front = Front::from_tests((0u32..).zip(&points));
        let after = indicators.after(0, &front);
        let (volume, error) = (after.hypervolume.unwrap(), after.standard_error.unwrap());
        assert!(error > 0.0 && error < 0.05 * volume, "{volume} and {error}");
        // The front of the next generation is the same, and so is what is known of it.
        assert_eq!(indicators.after(1, &front), GenerationIndicators { generation: 1, ..after });
    }
}
