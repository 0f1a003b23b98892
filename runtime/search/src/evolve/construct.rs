//! Evolution that constructs tests for cells that need them.
//!
//! A share of each generation's tests, including the first, are changed as little as possible so that they lie in a
//! feasible cell with too few hits. They are first made like every other test, by selection, crossover and mutation, so
//! a constructed test descends from good parents and keeps of them what the cell leaves open. Of the cells that need
//! tests the nearest is chosen, so that little is changed.
//!
//! Two things can fail: a constructed test may miss its cell when it runs (no effect, or a run that broke off), or no
//! test can be built. Cells with fewer failures come first. After three misses, or five attempts to build without
//! success, each from another test, a cell is given up. The end of the search reports what was given up and why.

pub(crate) mod placement;

use sesame_base::observation::Observation;
use sesame_optimise::nsga2::{Child, Variation};
use sesame_plan::Test;
use sesame_rng::Stream;

use crate::coverage::{Grid, edge};
use crate::evolve::cells::Cells;
use crate::evolve::construct::placement::CellPlacer;
use crate::strategy::Learning;
use crate::{Evaluated, TestVariation};

/// Misses after which a cell is given up.
const MOST_MISSES: u32 = 3;
/// Attempts to build a test for a cell, each from another test, after which it is given up.
const MOST_ATTEMPTS: u32 = 5;
/// Cells named where some were given up.
const MOST_NAMED: usize = 20;
/// Cells tried for one test before it stays as it is.
const MOST_CELLS_TRIED: usize = 8;

/// How much is constructed.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Construction {
    /// The share of the tests of each generation, in `0..=1`.
    pub(crate) share: f64,
    /// The share of all cells from which on none is constructed any more.
    pub(crate) until: f64,
}

/// Variation of tests with construction.
#[derive(Debug, Clone)]
pub(crate) struct ConstructingVariation {
    tests: TestVariation,
    cells: Cells,
    placer: CellPlacer,
    construction: Construction,
    seed: u64,
    /// Per cell, how often a test constructed for it fell elsewhere.
    missed: Vec<u32>,
    /// Per cell, how often no test for it could be built.
    unbuilt: Vec<u32>,
    /// Per test of the generation asked last, the cell it was constructed for.
    aims: Vec<Option<usize>>,
}

impl ConstructingVariation {
    pub(crate) fn new(
        tests: TestVariation,
        cells: Cells,
        placer: CellPlacer,
        construction: Construction,
        seed: u64,
    ) -> Self {
        let none = vec![0; cells.grid().len()];
        ConstructingVariation {
            tests,
            cells,
            placer,
            construction,
            seed,
            missed: none.clone(),
            unbuilt: none,
            aims: Vec::new(),
        }
    }

    fn is_given_up(&self, cell: usize) -> bool {
        self.missed[cell] >= MOST_MISSES || self.unbuilt[cell] >= MOST_ATTEMPTS
    }

    /// Whether the test at this place of its generation is constructed: as evenly spread as the share permits.
    fn constructs(&self, place: u64) -> bool {
        let before = libm::floor(place as f64 * self.construction.share);
        let after = libm::floor((place + 1) as f64 * self.construction.share);
        after > before && self.cells.expected_share() < self.construction.until
    }

    /// The test, or one constructed from it.
    fn place(&mut self, test: Test, place: u64, mut stream: Stream) -> Test {
        let constructed = if self.constructs(place) { self.constructed(&test, &mut stream) } else { None };
        let aim = constructed.as_ref().map(|(cell, _)| *cell);
        let test = constructed.map_or(test, |(_, test)| test);
        if let Some(cell) = aim.or_else(|| self.cells.cell_of(&test)) {
            self.cells.reserve(cell);
        }
        self.aims.push(aim);
        test
    }

    fn constructed(&mut self, test: &Test, stream: &mut Stream) -> Option<(usize, Test)> {
        let point = self.cells.point_of(test);
        let grid = self.cells.grid();
        let mut wanting: Vec<(u32, f64, u64, usize)> = (0..grid.len())
            .filter(|&cell| !self.is_given_up(cell) && self.cells.can_reach(cell) && self.cells.needs_tests(cell))
            .map(|cell| {
                let distance = point.as_ref().map_or(0.0, |point| distance(grid, point, cell));
                (self.missed[cell] + self.unbuilt[cell], distance, stream.bits(), cell)
            })
            .collect();
        wanting.sort_by(|a, b| a.0.cmp(&b.0).then(a.1.total_cmp(&b.1)).then(a.2.cmp(&b.2)));
        for (.., cell) in wanting.into_iter().take(MOST_CELLS_TRIED) {
            match self.placer.place_in_cell(test, cell, self.cells.plan(), stream) {
                Some(test) if self.tests.claim(&test) => return Some((cell, test)),
                Some(_) => {}
                // Feasible as far as known, and yet not found.
                None => self.unbuilt[cell] += 1,
            }
        }
        None
    }
}

/// How far a point is from a cell: Euclidean, each axis in shares of its length.
fn distance(grid: &Grid, point: &crate::sspr::Point, cell: usize) -> f64 {
    let axes = grid.axes().iter().zip(grid.place(cell));
    let squares = axes.map(|(axis, at)| {
        let (low, high) = Grid::bounds(axis, at);
        let length = axis.high - axis.low;
        // A test without parameters has no intensity, and gets some wherever it is put.
        let outside = point.get(axis.dimension).map_or(0.0, |value| (low - value).max(value - high).max(0.0));
        outside * outside / (length * length)
    });
    libm::sqrt(squares.sum())
}

impl Variation for ConstructingVariation {
    type Genome = Test;

    fn initial(&mut self, index: u64) -> Test {
        let test = self.tests.initial(index);
        self.place(test, index, Stream::derive(self.seed, "construct initial", &[index]))
    }

    fn offspring(&mut self, parents: [&Test; 2], generation: u64, pair: u64) -> [Child<Test>; 2] {
        let mut place = 2 * pair;
        self.tests.offspring(parents, generation, pair).map(|child| {
            let stream = Stream::derive(self.seed, "construct", &[generation, place]);
            let genome = self.place(child.genome, place, stream);
            place += 1;
            Child { genome, ..child }
        })
    }
}

impl Learning for ConstructingVariation {
    fn begin(&mut self, reference: &Observation) {
        self.tests.take_reference(reference);
        self.placer.take_reference(reference);
    }

    fn learn(&mut self, results: &[Evaluated]) {
        for (aim, result) in self.aims.drain(..).zip(results) {
            let hit = result.point.as_ref().and_then(|point| self.cells.grid().cell_of(point));
            if let Some(cell) = aim.filter(|_| hit != aim) {
                self.missed[cell] += 1;
            }
        }
        self.cells.learn(results);
    }

    fn given_up(&self) -> Vec<String> {
        let grid = self.cells.grid();
        // A cell that any test has hit after all is not given up.
        let cells = |why: &dyn Fn(usize) -> bool| -> Vec<usize> {
            (0..grid.len()).filter(|&cell| self.cells.needs_tests(cell) && why(cell)).collect()
        };
        let missed = cells(&|cell| self.missed[cell] >= MOST_MISSES);
        let unbuilt = cells(&|cell| self.missed[cell] < MOST_MISSES && self.unbuilt[cell] >= MOST_ATTEMPTS);
        let exact = self.cells.feasible().is_exact();
        let no_test = if exact { "no test could be built" } else { "no test could be built, and there may be none" };
        [(missed, "three constructed tests had no effect or fell elsewhere"), (unbuilt, no_test)]
            .into_iter()
            .filter(|(cells, _)| !cells.is_empty())
            .map(|(cells, why)| {
                let named: Vec<String> = cells.iter().take(MOST_NAMED).map(|&cell| named(grid, cell)).collect();
                let more = cells.len() - named.len();
                let more = if more > 0 { format!("; and {more} more") } else { String::new() };
                let (count, noun) = (cells.len(), if cells.len() == 1 { "cell" } else { "cells" });
                format!("construction gave up {count} {noun}, for each of which {why}: {}{more}", named.join("; "))
            })
            .collect()
    }
}

/// A cell by its ranges, as `T1 0.5–0.667, P1 0–0.333`.
fn named(grid: &Grid, cell: usize) -> String {
    let round = |x: f64| libm::rint(x * 1000.0) / 1000.0 + 0.0;
    let axes = grid.axes().iter().zip(grid.place(cell)).map(|(axis, at)| {
        let (low, high) = (edge(axis, at), edge(axis, at + 1));
        format!("{} {}–{}", axis.dimension.name(), round(low), round(high))
    });
    axes.collect::<Vec<_>>().join(", ")
}
