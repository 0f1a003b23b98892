//! Evolution that constructs tests for cells that want them.
//!
//! A share of each generation's tests, those of the first included, are changed as little as may be so that they lie in a
//! feasible cell that too few tests have hit. They are first made like every other test, by selection, crossover and
//! mutation: so what is constructed descends from good parents and keeps of them what the cell leaves open, and coverage
//! is not paid for with fitness alone. Of the cells that want tests the nearest is chosen, so that little is changed; one
//! that constructed tests have missed before (no effect, or a run that broke off) comes after all others, and after three
//! misses it is given up.

use sesame_plan::Test;

use crate::coverage::Grid;
use crate::rng::Stream;
use crate::search::cells::Cells;
use crate::search::construct::Constructor;
use crate::search::nsga2::{Child, Variation};
use crate::search::{Evaluated, Learning, TestVariation};

/// Misses after which a cell is given up.
const MOST_MISSES: u32 = 3;
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
pub(crate) struct Constructing {
    tests: TestVariation,
    cells: Cells,
    constructor: Constructor,
    construction: Construction,
    seed: u64,
    /// Per cell, how often a test constructed for it fell elsewhere.
    missed: Vec<u32>,
    /// Per test of the generation asked last, the cell it was constructed for.
    aims: Vec<Option<usize>>,
}

impl Constructing {
    pub(crate) fn new(
        tests: TestVariation,
        cells: Cells,
        constructor: Constructor,
        construction: Construction,
        seed: u64,
    ) -> Self {
        let missed = vec![0; cells.grid().len()];
        Constructing { tests, cells, constructor, construction, seed, missed, aims: Vec::new() }
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
            self.cells.promise(cell);
        }
        self.aims.push(aim);
        test
    }

    fn constructed(&mut self, test: &Test, stream: &mut Stream) -> Option<(usize, Test)> {
        let point = self.cells.point_of(test);
        let grid = self.cells.grid();
        let mut wanting: Vec<(u32, f64, u64, usize)> = (0..grid.len())
            .filter(|&cell| self.missed[cell] < MOST_MISSES && self.cells.can_reach(cell) && self.cells.wants(cell))
            .map(|cell| {
                let distance = point.as_ref().map_or(0.0, |point| distance(grid, point, cell));
                (self.missed[cell], distance, stream.bits(), cell)
            })
            .collect();
        wanting.sort_by(|a, b| a.0.cmp(&b.0).then(a.1.total_cmp(&b.1)).then(a.2.cmp(&b.2)));
        for (.., cell) in wanting.into_iter().take(MOST_CELLS_TRIED) {
            match self.constructor.place_in_cell(test, cell, self.cells.plan(), stream) {
                Some(test) if self.tests.claim(&test) => return Some((cell, test)),
                Some(_) => {}
                // Said to be feasible, and yet not found.
                None => self.missed[cell] += 1,
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

impl Variation for Constructing {
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

impl Learning for Constructing {
    fn learn(&mut self, results: &[Evaluated]) {
        for (aim, result) in self.aims.drain(..).zip(results) {
            let hit = result.point.as_ref().and_then(|point| self.cells.grid().cell_of(point));
            if let Some(cell) = aim.filter(|_| hit != aim) {
                self.missed[cell] += 1;
            }
        }
        self.cells.learn(results);
    }
}
