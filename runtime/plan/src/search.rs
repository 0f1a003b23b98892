//! What a campaign does: it searches by a strategy, or it repeats one test.

use serde::{Deserialize, Serialize};

use crate::KnownTestId;

/// What a campaign does.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(tag = "kind", rename_all = "snake_case")]
pub enum Search {
    /// It searches: a strategy chooses its tests.
    Strategy {
        /// Which.
        strategy: Strategy,
        /// Tests in total.
        evaluations: u32,
    },
    /// It repeats one known test.
    Repeat {
        /// Which.
        test: KnownTestId,
        /// How often.
        times: u32,
    },
}

impl Search {
    /// A search by a strategy, with this many tests in total.
    pub fn new(strategy: Strategy, evaluations: u32) -> Search {
        Search::Strategy { strategy, evaluations }
    }

    /// How many tests the campaign evaluates, at most.
    pub fn evaluations(&self) -> u32 {
        match self {
            Search::Strategy { evaluations, .. } => *evaluations,
            Search::Repeat { times, .. } => *times,
        }
    }

    /// Changes how many tests the campaign evaluates.
    pub fn set_evaluations(&mut self, wanted: u32) {
        match self {
            Search::Strategy { evaluations, .. } => *evaluations = wanted,
            Search::Repeat { times, .. } => *times = wanted,
        }
    }

    /// The strategy of a search; `None` for a campaign that repeats a test.
    pub fn strategy(&self) -> Option<&Strategy> {
        match self {
            Search::Strategy { strategy, .. } => Some(strategy),
            Search::Repeat { .. } => None,
        }
    }

    /// The word that tables use for it.
    pub fn keyword(&self) -> &'static str {
        self.strategy().map_or("repeat", |strategy| strategy.kind().properties().keyword)
    }
}

/// How a search chooses its tests, with its settings.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(tag = "kind", rename_all = "snake_case")]
pub enum Strategy {
    /// The genetic algorithm NSGA-II.
    Nsga2 {
        /// Tests per generation; at least 1.
        population: u32,
    },
    /// The genetic algorithm NSGA-III, for three and more objectives.
    Nsga3 {
        /// Tests per generation; at least 1.
        population: u32,
    },
    /// MAP-Elites over the cells of the campaign's coverage.
    MapElites {
        /// Tests per generation; at least 1.
        population: u32,
    },
    /// Independent random tests.
    Random,
    /// Latin hypercube sampling: tests are spread evenly over each of their choices.
    LatinHypercube,
    /// Sobol' sampling: tests are spread evenly over their choices, and so is every beginning of the sequence.
    Sobol,
    /// Focused falsification: the tests that most probably violate a requirement.
    Falsification {
        /// Tests at a time, after the first ones; at least 1.
        population: u32,
    },
}

impl Strategy {
    /// Which strategy it is.
    pub fn kind(self) -> StrategyKind {
        match self {
            Strategy::Nsga2 { .. } => StrategyKind::Nsga2,
            Strategy::Nsga3 { .. } => StrategyKind::Nsga3,
            Strategy::MapElites { .. } => StrategyKind::MapElites,
            Strategy::Random => StrategyKind::Random,
            Strategy::LatinHypercube => StrategyKind::LatinHypercube,
            Strategy::Sobol => StrategyKind::Sobol,
            Strategy::Falsification { .. } => StrategyKind::Falsification,
        }
    }

    /// The size of its population, if it has this setting.
    pub fn population(self) -> Option<u32> {
        match self {
            Strategy::Nsga2 { population }
            | Strategy::Nsga3 { population }
            | Strategy::MapElites { population }
            | Strategy::Falsification { population } => Some(population),
            Strategy::Random | Strategy::LatinHypercube | Strategy::Sobol => None,
        }
    }

    /// Its name and settings in reports: `NSGA-II, population 10`.
    pub fn title(self) -> String {
        let properties = self.kind().properties();
        match (properties.population, self.population()) {
            (Population::Bred, Some(size)) => format!("{}, population {size}", properties.title),
            (Population::Batch, Some(size)) if size > 1 => format!("{}, {size} tests at a time", properties.title),
            _ => properties.title.to_owned(),
        }
    }

    /// Its settings as a `search` block of the language has them, without those that every strategy has.
    pub fn settings(self) -> String {
        self.population().map_or_else(String::new, |size| format!("population {size}  "))
    }
}

/// A strategy without its settings.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum StrategyKind {
    /// See [`Strategy::Nsga2`].
    Nsga2,
    /// See [`Strategy::Nsga3`].
    Nsga3,
    /// See [`Strategy::MapElites`].
    MapElites,
    /// See [`Strategy::Random`].
    Random,
    /// See [`Strategy::LatinHypercube`].
    LatinHypercube,
    /// See [`Strategy::Sobol`].
    Sobol,
    /// See [`Strategy::Falsification`].
    Falsification,
}

/// What a strategy's `population` means.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Population {
    /// It has no such setting.
    None,
    /// The tests of a generation, bred in pairs: even, and required.
    Bred,
    /// The tests that are asked for at a time: 1 by default.
    Batch,
}

/// Why a strategy has no setting `neighbours`.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Averaging {
    /// It has the setting.
    Possible,
    /// Results do not change what it does.
    LearnsNothing,
    /// It tells noise from margins itself.
    ByItself,
}

/// What is fixed for a strategy: the one table of names, settings and requirements.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[expect(clippy::struct_excessive_bools, reason = "a row of a table, most columns of which are yes or no")]
pub struct StrategyProperties {
    /// Its word in the language, and in tables.
    pub keyword: &'static str,
    /// Its name in reports.
    pub title: &'static str,
    /// What it is in a sentence, after an article: `a Sobol search`.
    pub noun: &'static str,
    /// Its setting `population`.
    pub population: Population,
    /// Its setting `neighbours`.
    pub averaging: Averaging,
    /// Whether it chooses windows of time, so that campaigns by condition cannot use it.
    pub by_time_only: bool,
    /// Whether it needs a requirement to violate.
    pub needs_requirements: bool,
    /// Whether it needs the cells of a coverage.
    pub needs_coverage: bool,
    /// Whether an exploration (`boost`, `construct`, `predict`, `novelty`) can direct it.
    pub explores: bool,
    /// Whether its tests are drawn independently of each other.
    pub independent: bool,
}

impl StrategyKind {
    /// All of them.
    pub const ALL: [StrategyKind; 7] = [
        StrategyKind::Nsga2,
        StrategyKind::Nsga3,
        StrategyKind::MapElites,
        StrategyKind::Random,
        StrategyKind::LatinHypercube,
        StrategyKind::Sobol,
        StrategyKind::Falsification,
    ];

    /// The strategy with this word.
    pub fn from_keyword(keyword: &str) -> Option<StrategyKind> {
        StrategyKind::ALL.into_iter().find(|kind| kind.properties().keyword == keyword)
    }

    /// The strategy with its settings; `population` is not used by one without this setting.
    pub fn with_settings(self, population: u32) -> Strategy {
        match self {
            StrategyKind::Nsga2 => Strategy::Nsga2 { population },
            StrategyKind::Nsga3 => Strategy::Nsga3 { population },
            StrategyKind::MapElites => Strategy::MapElites { population },
            StrategyKind::Random => Strategy::Random,
            StrategyKind::LatinHypercube => Strategy::LatinHypercube,
            StrategyKind::Sobol => Strategy::Sobol,
            StrategyKind::Falsification => Strategy::Falsification { population },
        }
    }

    /// What is fixed for it.
    pub const fn properties(self) -> StrategyProperties {
        match self {
            StrategyKind::Nsga2 => StrategyProperties {
                population: Population::Bred,
                averaging: Averaging::Possible,
                explores: true,
                ..properties("nsga2", "NSGA-II", "NSGA-II search")
            },
            StrategyKind::Nsga3 => StrategyProperties {
                population: Population::Bred,
                averaging: Averaging::Possible,
                ..properties("nsga3", "NSGA-III", "NSGA-III search")
            },
            StrategyKind::MapElites => StrategyProperties {
                population: Population::Bred,
                averaging: Averaging::Possible,
                needs_coverage: true,
                ..properties("map_elites", "MAP-Elites", "MAP-Elites search")
            },
            StrategyKind::Random => {
                StrategyProperties { independent: true, ..properties("random", "random", "random search") }
            }
            StrategyKind::LatinHypercube => StrategyProperties {
                by_time_only: true,
                ..properties("latin_hypercube", "Latin hypercube", "Latin hypercube")
            },
            StrategyKind::Sobol => {
                StrategyProperties { by_time_only: true, ..properties("sobol", "Sobol points", "Sobol search") }
            }
            StrategyKind::Falsification => StrategyProperties {
                population: Population::Batch,
                averaging: Averaging::ByItself,
                by_time_only: true,
                needs_requirements: true,
                ..properties("falsification", "falsification", "falsification")
            },
        }
    }
}

/// A strategy that samples tests, by time or by condition.
const fn properties(keyword: &'static str, title: &'static str, noun: &'static str) -> StrategyProperties {
    StrategyProperties {
        keyword,
        title,
        noun,
        population: Population::None,
        averaging: Averaging::LearnsNothing,
        by_time_only: false,
        needs_requirements: false,
        needs_coverage: false,
        explores: false,
        independent: false,
    }
}
