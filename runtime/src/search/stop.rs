//! Whether a search has gone on for long enough.
//!
//! Two of the rules estimate what a search has not seen from what it has seen once or twice:
//!
//! - Good and Turing (1953): of n tests, f₁ fell into cells that no other fell into; the next test falls into a cell that
//!   is new with a probability of about f₁ / n.
//! - Chao (1984, bias-corrected): c cells were hit, f₁ of them once and f₂ twice; about c + f₁ (f₁ − 1) / (2 (f₂ + 1)) ever
//!   would be.
//!
//! Both assume that tests are drawn independently. Random search draws so; a search that learns does not, and the reason
//! to stop says that the estimate is biased then.

use std::collections::VecDeque;
use std::time::Duration;

use sesame_plan::{CampaignPlan, Search, StopRule};

use crate::coverage::{Coverage, Grid};
use crate::search::hypervolume::hypervolume;
use crate::search::{Evaluated, Fitness, Front};

/// Watches a search by the rules of its campaign. What it says depends on the results of whole generations, and on the
/// wall time only where a rule asks for that.
#[derive(Debug, Clone)]
pub struct StopRules {
    rules: Vec<StopRule>,
    /// Whether the tests are drawn independently of each other.
    independent: bool,
    cells: Option<Coverage>,
    /// Tests that fell into a cell.
    counted: u32,
    front: Front,
    /// The worst value of each objective so far: what hypervolumes are measured from.
    worst: Vec<f64>,
    /// After each generation the objectives of the front, the latest last, as many as a rule looks back.
    fronts: VecDeque<Vec<Vec<f64>>>,
}

impl StopRules {
    /// The rules of a plan's campaign, before its first generation.
    pub fn of(plan: &CampaignPlan) -> StopRules {
        // A plan whose cells are no grid is refused before.
        let cells = plan.campaign.coverage.as_ref().and_then(|goal| Grid::new(goal.axes.clone()).ok());
        // Making a test smaller is not what the campaign's rules are about.
        let shrinks = matches!(plan.campaign.search, Search::Shrink { .. });
        StopRules {
            rules: if shrinks { Vec::new() } else { plan.campaign.stop.clone() },
            independent: matches!(plan.campaign.search, Search::Random { .. }),
            cells: cells.map(|grid| Coverage::new(grid, 1)),
            counted: 0,
            front: Front::default(),
            worst: Vec::new(),
            fronts: VecDeque::new(),
        }
    }

    /// Takes the results of a generation.
    pub fn tell(&mut self, results: &[Evaluated]) {
        for result in results {
            if let (Some(cells), Some(point)) = (&mut self.cells, &result.point)
                && cells.grid().cell_of(point).is_some()
            {
                cells.add(point);
                self.counted += 1;
            }
            let Fitness::Measured(objectives) = &result.fitness else { continue };
            self.front.add(result.number, &result.fitness);
            self.worst.resize(objectives.len(), f64::NEG_INFINITY);
            for (worst, value) in self.worst.iter_mut().zip(objectives) {
                // What has no end is no place to measure from.
                if value.is_finite() {
                    *worst = worst.max(*value);
                }
            }
        }
        let looks_back = self.rules.iter().map(|rule| match rule {
            StopRule::Stagnation { generations, .. } => *generations as usize + 1,
            _ => 0,
        });
        let looks_back = looks_back.max().unwrap_or(0);
        self.fronts.push_back(self.front.members().iter().map(|member| member.objectives.clone()).collect());
        while self.fronts.len() > looks_back {
            self.fronts.pop_front();
        }
    }

    /// Why the search stops now, if it does. `elapsed` is the wall time since it was started or taken up again.
    pub fn reached(&self, elapsed: Duration) -> Option<String> {
        self.rules.iter().find_map(|rule| self.holds(*rule, elapsed))
    }

    fn holds(&self, rule: StopRule, elapsed: Duration) -> Option<String> {
        match rule {
            StopRule::WallTime { seconds } => (elapsed.as_secs_f64() >= seconds)
                .then(|| format!("it has gone on for {seconds} s of wall time, as long as it may")),
            StopRule::Stagnation { generations, below } => {
                let growth = self.growth(generations as usize)?;
                (growth < below).then(|| {
                    format!(
                        "its hypervolume grew by {} in {generations} generations, less than {}",
                        percent(growth),
                        percent(below)
                    )
                })
            }
            StopRule::Discovery { below } => {
                let (once, _) = self.rare()?;
                let probability = f64::from(once) / f64::from(self.counted);
                // With fewer tests even one cell hit once would be too likely, or none at all say little.
                let enough = f64::from(self.counted) * below >= 1.0;
                (enough && probability < below).then(|| {
                    format!(
                        "the next test would fall into a new cell with a probability of about {} (Good and Turing, \
                         {once} of {} tests alone in their cell), less than {}{}",
                        percent(probability),
                        self.counted,
                        percent(below),
                        self.bias()
                    )
                })
            }
            StopRule::Completeness { share } => {
                let (once, twice) = self.rare()?;
                let hit = self.cells.as_ref()?.covered() as f64;
                let (f1, f2) = (f64::from(once), f64::from(twice));
                let ever = hit + f1 * (f1 - 1.0).max(0.0) / (2.0 * (f2 + 1.0));
                // As long as every test is alone in its cell, the estimate has nothing to go by.
                (once < self.counted && hit >= share * ever).then(|| {
                    format!(
                        "it has hit {hit} of about {ever:.0} cells that it would ever hit (Chao), at least {}{}",
                        percent(share),
                        self.bias()
                    )
                })
            }
        }
    }

    /// By how much the hypervolume has grown over so many generations, as a share of what it is; `None` so early that
    /// there are not as many yet, or nothing is on the front. Both fronts are measured from the worst values seen by now.
    fn growth(&self, generations: usize) -> Option<f64> {
        let now = self.fronts.back()?;
        let then = &self.fronts[self.fronts.len().checked_sub(generations + 1)?];
        if self.worst.is_empty() || !self.worst.iter().all(|worst| worst.is_finite()) {
            return None;
        }
        let volume = |front: &[Vec<f64>]| {
            let points: Vec<&[f64]> = front.iter().map(Vec::as_slice).collect();
            hypervolume(&points, &self.worst)
        };
        let (now, then) = (volume(now), volume(then));
        // A front of one point at the worst of all has no volume, and has not grown.
        Some(if now > 0.0 { (now - then) / now } else { 0.0 })
    }

    /// How many cells were hit once, and how many twice; `None` before a test has hit any.
    fn rare(&self) -> Option<(u32, u32)> {
        let hits = self.cells.as_ref().filter(|_| self.counted > 0)?.hits();
        let count = |times: u32| u32::try_from(hits.iter().filter(|&&it| it == times).count()).unwrap_or(u32::MAX);
        Some((count(1), count(2)))
    }

    fn bias(&self) -> &'static str {
        if self.independent { "" } else { "; a biased estimate, as this search does not draw its tests independently" }
    }
}

fn percent(share: f64) -> String {
    format!("{:.1} %", 100.0 * share)
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;
    use sesame_plan::CoverageGoal;

    use super::*;
    use crate::rng::Stream;
    use crate::search::landscape::LANDSCAPES;
    use crate::search::strategy;

    fn plan(search: Search, stop: &[StopRule]) -> CampaignPlan {
        let mut plan = LANDSCAPES[0].plan(search);
        let grid = Grid::parse("T1:0:1:6,T2:0:0.5:6,P1:0:1:3").unwrap();
        plan.campaign.coverage = Some(CoverageGoal { axes: grid.axes().to_vec(), hits: 1, stop_at: None });
        plan.campaign.stop = stop.to_vec();
        plan
    }

    /// Evaluations after which a search stops, and why; `None` where it does not.
    fn stopped(plan: &CampaignPlan, seed: u64) -> Option<(usize, String)> {
        let run = LANDSCAPES[0].campaign(strategy(plan, seed).unwrap().as_mut());
        let mut rules = StopRules::of(plan);
        let mut done = 0;
        for generation in run.tests.chunks(10) {
            rules.tell(generation);
            done += generation.len();
            if let Some(why) = rules.reached(Duration::ZERO) {
                return Some((done, why));
            }
        }
        None
    }

    fn random(evaluations: u32, rule: StopRule) -> CampaignPlan {
        plan(Search::Random { evaluations }, &[rule])
    }

    #[test]
    fn a_random_search_stops_when_new_cells_have_become_as_unlikely_as_was_said() {
        let (mut told, mut true_shares) = (0, Vec::new());
        for seed in 1..=10 {
            let plan = random(1_000, StopRule::Discovery { below: 0.1 });
            let (done, why) = stopped(&plan, seed).unwrap();
            assert!(why.contains("Good and Turing") && !why.contains("biased"), "{why}");
            told += done;
            // What the next thousand tests really did, each against the cells known when the search stopped.
            let run = LANDSCAPES[0].campaign(
                strategy(&random(u32::try_from(done).unwrap() + 1_000, plan.campaign.stop[0]), seed).unwrap().as_mut(),
            );
            let grid = Grid::parse("T1:0:1:6,T2:0:0.5:6,P1:0:1:3").unwrap();
            let cells: Vec<Option<usize>> = run.tests.iter().map(|it| grid.cell_of(it.point.as_ref()?)).collect();
            let new = cells[done..].iter().filter(|cell| cell.is_some() && !cells[..done].contains(cell)).count();
            true_shares.push(new as f64 / 1_000.0);
        }
        let mean = true_shares.iter().sum::<f64>() / 10.0;
        assert!(told > 500 && (0.03..0.15).contains(&mean), "{told}: {true_shares:?}");
    }

    #[test]
    fn a_search_that_learns_is_told_that_its_estimates_are_biased() {
        let search = Search::Nsga2 { population: 10, evaluations: 600 };
        let (done, why) = stopped(&plan(search.clone(), &[StopRule::Discovery { below: 0.15 }]), 1).unwrap();
        assert!(done < 600 && why.contains("biased"), "{why}");
        let (_, why) = stopped(&plan(search, &[StopRule::Completeness { share: 0.7 }]), 1).unwrap();
        assert!(why.contains("(Chao)") && why.contains("biased"), "{why}");
    }

    #[test]
    fn a_search_stops_where_its_front_no_longer_grows_and_the_first_rule_that_holds_counts() {
        let search = Search::Nsga2 { population: 10, evaluations: 400 };
        let slow = StopRule::Stagnation { generations: 5, below: 0.02 };
        let (done, why) = stopped(&plan(search.clone(), &[slow]), 2).unwrap();
        assert!(why.starts_with("its hypervolume grew by") && done >= 60, "{done}: {why}");
        let never = StopRule::WallTime { seconds: 3600.0 };
        assert_eq!(stopped(&plan(search.clone(), &[never, slow]), 2), Some((done, why)));
        assert_eq!(stopped(&plan(search, &[never]), 2), None);
    }

    #[test]
    fn time_is_up_when_it_is() {
        let plan = random(10, StopRule::WallTime { seconds: 5.0 });
        let rules = StopRules::of(&plan);
        assert_eq!(rules.reached(Duration::from_millis(4_999)), None);
        assert!(rules.reached(Duration::from_secs(5)).unwrap().contains("5 s of wall time"));
    }

    proptest! {
        #[test]
        fn growth_is_what_two_fronts_measured_from_one_place_differ_by(seed: u64, generations in 1usize..4) {
            let plan = random(10, StopRule::Stagnation { generations: 6, below: 0.1 });
            let mut rules = StopRules::of(&plan);
            let mut stream = Stream::derive(seed, "test", &[]);
            let mut all: Vec<Evaluated> = Vec::new();
            for number in 0..6u32 {
                let fitness = Fitness::Measured(vec![stream.unit(), stream.unit()]);
                let result = Evaluated { number, test: sesame_plan::Test::default(), fitness, point: None, course: None, margins: Vec::new(), failing: false };
                rules.tell(std::slice::from_ref(&result));
                all.push(result);
            }
            let worst = |at: usize| all.iter().map(|it| match &it.fitness {
                Fitness::Measured(objectives) => objectives[at],
                _ => unreachable!("all are measured"),
            }).fold(f64::NEG_INFINITY, f64::max);
            let reference = [worst(0), worst(1)];
            let volume = |tests: &[Evaluated]| {
                let front = Front::of(tests.iter().map(|it| (it.number, &it.fitness)));
                let points: Vec<&[f64]> = front.members().iter().map(|it| it.objectives.as_slice()).collect();
                hypervolume(&points, &reference)
            };
            let (now, then) = (volume(&all), volume(&all[..6 - generations]));
            let expected = if now > 0.0 { (now - then) / now } else { 0.0 };
            prop_assert!((rules.growth(generations).unwrap() - expected).abs() < 1e-12);
            prop_assert_eq!(rules.growth(6), None);
        }
    }
}
