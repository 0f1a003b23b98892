//! What a campaign does: it searches by a strategy, or it repeats one test.

use std::ops::RangeInclusive;

use serde::{Deserialize, Serialize};

use crate::{Copies, KnownTestId, Times};

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
    /// Grid search: the full factorial of equally spaced levels.
    Grid {
        /// Levels of each number, and of the times at which windows begin and end; 2 to 64.
        levels: u32,
    },
    /// Focused falsification: the tests that most probably violate a requirement.
    Falsification {
        /// Tests at a time, after the first ones; at least 1.
        population: u32,
    },
    /// Combinatorial interaction testing with aligned windows, attribution of violations, and goal-directed search.
    Interleaved {
        /// Whether it goes on to draw operations that are known to violate a requirement alone.
        #[serde(default, skip_serializing_if = "std::ops::Not::not")]
        keep_causes: bool,
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
            Strategy::Grid { .. } => StrategyKind::Grid,
            Strategy::Falsification { .. } => StrategyKind::Falsification,
            Strategy::Interleaved { .. } => StrategyKind::Interleaved,
        }
    }

    /// The value of its [own setting](StrategyProperties::own), if it has one.
    pub fn own(self) -> Option<u32> {
        match self {
            Strategy::Nsga2 { population }
            | Strategy::Nsga3 { population }
            | Strategy::MapElites { population }
            | Strategy::Falsification { population } => Some(population),
            Strategy::Grid { levels } => Some(levels),
            Strategy::Random | Strategy::LatinHypercube | Strategy::Sobol | Strategy::Interleaved { .. } => None,
        }
    }

    /// How many copies of one operation its tests by time may contain.
    pub fn most_copies(self, copies: Copies, times: Times) -> u32 {
        match (self, copies, times) {
            // In a grid copies differ in their windows, which begin and end at levels.
            (Strategy::Grid { .. }, _, Times::Offline) => 1,
            (Strategy::Grid { levels }, Copies::Apart, Times::Windows { lengths: None, .. }) => {
                levels.saturating_sub(1)
            }
            (Strategy::Grid { levels }, Copies::MayOverlap, Times::Windows { lengths: None, .. }) => {
                levels.saturating_mul(levels.saturating_sub(1)) / 2
            }
            // Windows of bounded lengths begin at levels that leave room for the longest, and have a level as length.
            (Strategy::Grid { levels }, Copies::Apart, Times::Windows { room, lengths: Some(lengths) }) => {
                let steps = levels.saturating_sub(1);
                let spacing = (room - lengths.high) / f64::from(steps.max(1));
                let apart = (1..=steps).find(|&apart| f64::from(apart) * spacing >= lengths.low);
                1 + apart.map_or(0, |apart| steps / apart)
            }
            (Strategy::Grid { levels }, Copies::MayOverlap, Times::Windows { room, lengths: Some(lengths) }) => {
                let several = |some: bool| if some { levels } else { 1 };
                several(lengths.high < room).saturating_mul(several(lengths.low < lengths.high))
            }
            (_, copies, times) => copies.most(times),
        }
    }

    /// Its own setting and the value, if the value is not permitted.
    pub fn not_permitted(self) -> Option<(Setting, u32)> {
        let setting = self.kind().properties().own?.setting;
        self.own().filter(|value| !setting.permitted().contains(value)).map(|value| (setting, value))
    }

    /// Its name and settings in reports: `NSGA-II, population 10`.
    pub fn title(self) -> String {
        let title = self.kind().properties().title;
        match self {
            Strategy::Nsga2 { population } | Strategy::Nsga3 { population } | Strategy::MapElites { population } => {
                format!("{title}, population {population}")
            }
            Strategy::Grid { levels } => format!("{title}, {levels} levels"),
            Strategy::Falsification { population } if population > 1 => {
                format!("{title}, {population} tests at a time")
            }
            Strategy::Interleaved { keep_causes: true } => format!("{title}, known causes are kept"),
            _ => title.to_owned(),
        }
    }

    /// Its settings as a `search` block of the language has them, without those that every strategy has.
    pub fn settings(self) -> String {
        if matches!(self, Strategy::Interleaved { keep_causes: true }) {
            return "keep causes  ".to_owned();
        }
        let own = self.kind().properties().own.zip(self.own());
        own.map_or_else(String::new, |(own, value)| format!("{} {value}  ", own.setting.keyword()))
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
    /// See [`Strategy::Grid`].
    Grid,
    /// See [`Strategy::Falsification`].
    Falsification,
    /// See [`Strategy::Interleaved`].
    Interleaved,
}

/// A setting that only some strategies have. Its value is a whole number.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Setting {
    /// How many tests are varied, or asked for, together.
    Population,
    /// How many values of each number are tried.
    Levels,
}

impl Setting {
    /// All of them.
    pub const ALL: [Setting; 2] = [Setting::Population, Setting::Levels];

    /// Its word in the language.
    pub const fn keyword(self) -> &'static str {
        match self {
            Setting::Population => "population",
            Setting::Levels => "levels",
        }
    }

    /// The setting with this word.
    pub fn from_keyword(keyword: &str) -> Option<Setting> {
        Setting::ALL.into_iter().find(|setting| setting.keyword() == keyword)
    }

    /// What it is in a sentence, after an article: `the population`.
    pub const fn noun(self) -> &'static str {
        match self {
            Setting::Population => "population",
            Setting::Levels => "number of levels",
        }
    }

    /// The values with which a strategy works.
    pub const fn permitted(self) -> RangeInclusive<u32> {
        match self {
            Setting::Population => 1..=u32::MAX,
            Setting::Levels => 2..=64,
        }
    }

    /// The values with which a strategy works, in words: `at least 1`.
    pub fn bounds(self) -> String {
        match self.permitted().into_inner() {
            (least, u32::MAX) => format!("at least {least}"),
            (least, most) => format!("{least} to {most}"),
        }
    }
}

/// A strategy's own setting, which not all strategies have.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct OwnSetting {
    /// Which.
    pub setting: Setting,
    /// Its value in a campaign that does not have the setting; `None` if every campaign must have it.
    pub default: Option<u32>,
    /// A value that suits many campaigns, for examples.
    pub example: u32,
    /// Whether it is a number of tests that are bred in pairs: even, and at most the number of evaluations.
    pub bred: bool,
}

impl OwnSetting {
    /// The tests of a generation, bred in pairs.
    const BRED: OwnSetting = OwnSetting { setting: Setting::Population, default: None, example: 10, bred: true };
    /// The tests that are asked for at a time.
    const BATCH: OwnSetting = OwnSetting { setting: Setting::Population, default: Some(1), example: 4, bred: false };
    /// The levels of each number.
    const LEVELS: OwnSetting = OwnSetting { setting: Setting::Levels, default: None, example: 4, bred: false };
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
    /// What it is in a sentence: `a Sobol search`.
    pub noun: &'static str,
    /// The setting that it has and others do not.
    pub own: Option<OwnSetting>,
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
    /// What it reads of the undisturbed run to place windows, which that run has to record for it.
    pub course: CourseRead,
    /// Whether its tests are drawn independently of each other.
    pub independent: bool,
}

/// What a strategy reads of the course of the undisturbed run.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum CourseRead {
    /// Nothing: its windows are the same whatever happens.
    Nothing,
    /// When messages come, so that it draws no window without any.
    Messages,
    /// When messages come and what happens in them, so that it aligns windows with it.
    Happenings,
}

impl StrategyKind {
    /// All of them.
    pub const ALL: [StrategyKind; 9] = [
        StrategyKind::Nsga2,
        StrategyKind::Nsga3,
        StrategyKind::MapElites,
        StrategyKind::Random,
        StrategyKind::LatinHypercube,
        StrategyKind::Sobol,
        StrategyKind::Grid,
        StrategyKind::Falsification,
        StrategyKind::Interleaved,
    ];

    /// The strategy with this word.
    pub fn from_keyword(keyword: &str) -> Option<StrategyKind> {
        StrategyKind::ALL.into_iter().find(|kind| kind.properties().keyword == keyword)
    }

    /// The strategy with the value of its [own setting](StrategyProperties::own), which is not used if it has none.
    pub fn with_own(self, value: u32) -> Strategy {
        match self {
            StrategyKind::Nsga2 => Strategy::Nsga2 { population: value },
            StrategyKind::Nsga3 => Strategy::Nsga3 { population: value },
            StrategyKind::MapElites => Strategy::MapElites { population: value },
            StrategyKind::Random => Strategy::Random,
            StrategyKind::LatinHypercube => Strategy::LatinHypercube,
            StrategyKind::Sobol => Strategy::Sobol,
            StrategyKind::Grid => Strategy::Grid { levels: value },
            StrategyKind::Falsification => Strategy::Falsification { population: value },
            StrategyKind::Interleaved => Strategy::Interleaved { keep_causes: false },
        }
    }

    /// What is fixed for it.
    pub const fn properties(self) -> StrategyProperties {
        match self {
            StrategyKind::Nsga2 => StrategyProperties {
                own: Some(OwnSetting::BRED),
                averaging: Averaging::Possible,
                explores: true,
                ..properties("nsga2", "NSGA-II", "an NSGA-II search")
            },
            StrategyKind::Nsga3 => StrategyProperties {
                own: Some(OwnSetting::BRED),
                averaging: Averaging::Possible,
                ..properties("nsga3", "NSGA-III", "an NSGA-III search")
            },
            StrategyKind::MapElites => StrategyProperties {
                own: Some(OwnSetting::BRED),
                averaging: Averaging::Possible,
                needs_coverage: true,
                ..properties("map_elites", "MAP-Elites", "a MAP-Elites search")
            },
            StrategyKind::Random => {
                StrategyProperties { independent: true, ..properties("random", "random", "a random search") }
            }
            StrategyKind::LatinHypercube => StrategyProperties {
                by_time_only: true,
                ..properties("latin_hypercube", "Latin hypercube", "a Latin hypercube")
            },
            StrategyKind::Sobol => {
                StrategyProperties { by_time_only: true, ..properties("sobol", "Sobol points", "a Sobol search") }
            }
            StrategyKind::Grid => StrategyProperties {
                own: Some(OwnSetting::LEVELS),
                by_time_only: true,
                course: CourseRead::Nothing,
                ..properties("grid", "grid", "a grid search")
            },
            StrategyKind::Falsification => StrategyProperties {
                own: Some(OwnSetting::BATCH),
                averaging: Averaging::ByItself,
                by_time_only: true,
                needs_requirements: true,
                ..properties("falsification", "falsification", "a falsification")
            },
            StrategyKind::Interleaved => StrategyProperties {
                averaging: Averaging::ByItself,
                needs_requirements: true,
                course: CourseRead::Happenings,
                ..properties("interleaved", "interleaved", "an interleaved search")
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
        own: None,
        averaging: Averaging::LearnsNothing,
        by_time_only: false,
        needs_requirements: false,
        needs_coverage: false,
        explores: false,
        course: CourseRead::Messages,
        independent: false,
    }
}
