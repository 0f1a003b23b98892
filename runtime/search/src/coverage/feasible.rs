//! Which cells a test of a campaign can reach.

use std::collections::{BTreeMap, BTreeSet};

use sesame_plan::{ActivationMode, CampaignPlan, ChoiceKind, Copies, Dimension, Domain, GridAxis, OperationId};
use sesame_rng::derive_seed;

use crate::coverage::grid::{Grid, place_on};
use crate::coverage::spread::{self, Member};
use crate::space::parameter_space::ParameterSpace;
use crate::space::range::Range;
use crate::space::test_space::{ActivationSpace, TestSpace};
use crate::sspr::{Class, Window};

/// The most distinct ways to compose a test of operations; beyond it, every cell counts as feasible.
const MOST_MIXTURES: usize = 20_000;
/// The most sums of integer parameters that are listed; beyond it, all values between them count as reachable.
const MOST_SUMS: usize = 20_000;
/// The most ways to compose a test that are remembered per cell.
const WAYS: usize = 6;
/// How far the reachable values must extend into a cell; a cell that they only touch, in a point or along an edge, is
/// not reached.
const MARGIN: f64 = 1e-9;

/// The cells of a grid that a test can reach if its run is completed.
///
/// The campaign declares what is permitted: windows, shortest and longest intervals, ranges and numbers of operations.
/// For each way to compose a test, timing, intensity and counts do not constrain each other, so a cell is reached if
/// its timing, its intensity and its counts are:
/// - an interval of length `l` has its midpoint at least `l / 2` from both ends of its window, so (T1, T2) of one
///   interval lies in a triangle, which the shortest and the longest permitted length cut off, and that of several in
///   the mean of their triangles;
/// - inside a cell of T1 and T2, T3 takes all values between a minimum and a maximum;
/// - P1 takes all values, and P2 all from 0 to a maximum that depends on P1;
/// - integer parameters take their possible values.
///
/// Copies of one operation whose windows may not overlap are together at most as long as one window; other constraints
/// between them are ignored.
///
/// A cell that is only touched, in a point or along an edge, is not feasible: a test drawn at random is never there.
/// Copies that are moved apart can be; once a cell is hit, [`Coverage`](crate::coverage::Coverage) counts it as
/// feasible.
///
/// Since those other constraints are ignored, a cell that only tests with copies reach counts as feasible although it
/// may not be; then the computation says that it is not exact.
#[derive(Debug, Clone, PartialEq)]
pub struct Feasible {
    reaches: Vec<bool>,
    exact: bool,
    /// Kinds of operations: those of one kind are the same for the grid.
    kinds: Vec<Vec<OperationId>>,
    /// Ways to compose a test: how many operations of each kind.
    mixtures: Vec<Vec<usize>>,
    /// Per cell some mixtures that reach it, the most certain first.
    ways: Vec<Vec<u32>>,
}

impl Feasible {
    /// The feasible cells of a campaign.
    pub fn from_plan(plan: &CampaignPlan, grid: &Grid) -> Feasible {
        Feasible::with_margin(plan, grid, MARGIN)
    }

    /// Whether a test can reach a cell.
    pub fn reaches(&self, cell: usize) -> bool {
        self.reaches[cell]
    }

    /// How many cells can be reached.
    pub fn count(&self) -> usize {
        self.reaches.iter().filter(|&&reaches| reaches).count()
    }

    /// Whether exactly these cells are feasible. Otherwise no other cell is feasible, and some of these may not be
    /// either:
    /// - where a cell needs several copies of one operation that must not be active at the same time;
    /// - where the grid has T3, and midpoints in different windows cannot meet, or there are many such windows;
    /// - where the grid has P2, and only some parameters are integers, or they have very many values;
    /// - where there are very many kinds of operations.
    pub fn is_exact(&self) -> bool {
        self.exact
    }

    /// Some of the ways to compose a test that reach a cell, the most certain first: kinds of operations, each with how
    /// many of them the test has. There are none where every cell counts as feasible.
    pub(crate) fn ways(&self, cell: usize) -> impl Iterator<Item = Vec<(&[OperationId], usize)>> {
        let mixtures = self.ways.get(cell).into_iter().flatten().map(|&way| &self.mixtures[way as usize]);
        mixtures.map(|mixture| {
            let kinds = self.kinds.iter().map(Vec::as_slice).zip(mixture.iter().copied());
            kinds.filter(|(_, count)| *count > 0).collect()
        })
    }

    fn with_margin(plan: &CampaignPlan, grid: &Grid, margin: f64) -> Feasible {
        let one_interval_each = match plan.campaign.activation {
            ActivationMode::Time => true,
            ActivationMode::Condition { .. } => false,
        };
        Feasible::compute(plan, grid, one_interval_each, margin)
    }

    /// With `one_interval_each`, every operation of a test is active once; otherwise any number of times, or never.
    fn compute(plan: &CampaignPlan, grid: &Grid, one_interval_each: bool, margin: f64) -> Feasible {
        let reaches = vec![true; grid.len()];
        let all = Feasible { reaches, exact: false, kinds: Vec::new(), mixtures: Vec::new(), ways: Vec::new() };
        let Ok(test_space) = TestSpace::from_plan(plan) else { return all };
        let sectors = Sectors::of(grid, one_interval_each, margin);
        let (kinds, operations) = sectors.kinds(plan, &test_space);
        // Offline operations do not contribute to the point, and may replace others.
        let offline = test_space.operations().iter().any(|operation| operation.activation == ActivationSpace::Offline);
        let fewest = if one_interval_each && !offline { test_space.fewest() } else { 1 };
        let Some(mut mixtures) = mixtures(kinds.len(), fewest, test_space.most()) else { return all };

        // Whether a test has copies of one operation, which may constrain each other.
        let crowded = |mixture: &[usize]| mixture.iter().zip(&operations).any(|(count, kind)| *count > kind.len());
        match plan.campaign.copies {
            Copies::MayOverlap => {}
            Copies::Once => mixtures.retain(|mixture| !crowded(mixture)),
            // The first of several equal ways is kept: the one without copies.
            Copies::Apart => mixtures.sort_by_key(|mixture| crowded(mixture)),
        }
        let apart = one_interval_each
            && plan.campaign.copies == Copies::Apart
            && sectors.has(&[Dimension::T1, Dimension::T2, Dimension::T3]);

        let mut timings: BTreeMap<[Vec<usize>; 2], Reached> = BTreeMap::new();
        let mut intensities: BTreeMap<Vec<usize>, Reached> = BTreeMap::new();
        let (windows, window_of) = distinct(kinds.iter().map(|kind| kind.window));
        let (parameters, parameters_of) = distinct(kinds.iter().map(|kind| kind.parameters.clone()));
        let mut done = BTreeSet::new();
        let mut different = Vec::new();
        for mixture in mixtures {
            // Disjoint copies share one window, so only so many windows count with their whole length.
            let whole: Vec<usize> =
                mixture.iter().zip(&operations).map(|(&n, kind)| if apart { n.min(kind.len()) } else { n }).collect();
            let by_window = [&mixture, &whole].map(|counts| counted(counts, &window_of, windows.len()));
            let by_parameters = counted(&mixture, &parameters_of, parameters.len());
            let numbers = sectors.numbers(&kinds, &mixture);
            if !done.insert((by_window.clone(), by_parameters.clone(), numbers)) {
                continue;
            }
            let timing = timings.entry(by_window.clone()).or_insert_with_key(|[counts, whole]| {
                let lengths = windows.iter().zip(whole).map(|(window, &n)| (window.end - window.start) * n as f64);
                sectors.timing(&paired(&windows, counts), lengths.sum())
            });
            let intensity = intensities
                .entry(by_parameters.clone())
                .or_insert_with_key(|counts| sectors.intensity(&paired(&parameters, counts)));
            let rank = if apart && crowded(&mixture) { 2 } else { u8::from(!(timing.exact && intensity.exact)) };
            different.push((rank, mixture, by_window, by_parameters, numbers));
        }

        // The most certain ways come first, so that they are remembered.
        different.sort_by_key(|(rank, ..)| *rank);
        // A cell that one way reaches for certain is certain, even if other ways to it are not.
        let mut certain = vec![false; grid.len()];
        let mut reaches = vec![false; grid.len()];
        let mut ways = Ways { kept: vec![Vec::new(); grid.len()], met: vec![(0, 0, 0); grid.len()] };
        for (way, (rank, _, by_window, by_parameters, numbers)) in different.iter().enumerate() {
            let (timing, intensity) = (&timings[by_window], &intensities[by_parameters]);
            for &timing in &timing.cells {
                for &intensity in &intensity.cells {
                    let cell = timing + intensity + numbers;
                    certain[cell] |= *rank == 0;
                    reaches[cell] = true;
                    ways.add(cell, way, *rank);
                }
            }
        }
        let mixtures = different.into_iter().map(|(_, mixture, ..)| mixture).collect();
        let exact = one_interval_each && reaches == certain;
        Feasible { reaches, exact, kinds: operations, mixtures, ways: ways.kept }
    }
}

/// Some ways per cell: of equally certain ones a uniform sample, so that they differ.
struct Ways {
    kept: Vec<Vec<u32>>,
    /// Per cell the rank of the last way, how many ways had that rank, and how many of lower ranks are kept.
    met: Vec<(u8, usize, usize)>,
}

impl Ways {
    /// Adds a way that reaches a cell; ranks must not decrease.
    fn add(&mut self, cell: usize, way: usize, rank: u8) {
        let (last, met, surer) = &mut self.met[cell];
        let kept = &mut self.kept[cell];
        if *last != rank {
            (*last, *met, *surer) = (rank, 0, kept.len());
        }
        *met += 1;
        let way = u32::try_from(way).expect("there are at most as many ways as mixtures");
        if kept.len() < WAYS {
            kept.push(way);
            return;
        }
        let drawn = derive_seed(0, "ways", &[cell as u64, u64::from(way)]) % *met as u64;
        let place = usize::try_from(drawn).unwrap_or(WAYS);
        if let Some(slot) = kept.get_mut(*surer..).and_then(|open| open.get_mut(place)) {
            *slot = way;
        }
    }
}

/// The properties of an operation on which the grid's dimensions depend.
#[derive(Debug, Clone, PartialEq)]
struct KindOfOperation {
    window: Window,
    parameters: Vec<Values>,
    class: Class,
}

/// The possible values of a normalised parameter.
#[derive(Debug, Clone, PartialEq)]
enum Values {
    /// All in `0..=1`.
    All,
    /// These only, ascending.
    These(Vec<f64>),
}

impl Values {
    /// The possible values of each number of a parameter: one for a number, three for a point, none for a text, a file,
    /// or a range without width.
    fn of(domain: &Domain, parameter_space: &ParameterSpace) -> Vec<Values> {
        match (domain, parameter_space) {
            (&Domain::Number { low, high, .. }, &ParameterSpace::Number(range, shape)) => {
                Values::of_number((low, high), range, shape).into_iter().collect()
            }
            (Domain::Point { low, high }, _) => {
                (0..3).filter(|&axis| low[axis] < high[axis]).map(|_| Values::All).collect()
            }
            _ => Vec::new(),
        }
    }

    fn of_number((low, high): (f64, f64), range: Range, shape: ChoiceKind) -> Option<Values> {
        let width = high - low;
        if width.is_nan() || width <= 0.0 {
            return None;
        }
        if !range.integer {
            return Some(Values::All);
        }
        let first = match shape {
            ChoiceKind::Value => (range.low - low) / width,
            ChoiceKind::Range => 0.0,
        };
        let steps = range.high - range.low;
        // So many values are treated as all.
        if steps > MOST_SUMS as f64 {
            return Some(Values::All);
        }
        let values = std::iter::successors(Some(0.0), |step| Some(step + 1.0)).take_while(|&step| step <= steps);
        Some(Values::These(values.map(|step| first + step / width).collect()))
    }
}

/// Cells of some of the grid's axes, each as its contribution to the number of a cell.
struct Reached {
    cells: Vec<usize>,
    exact: bool,
}

/// The grid's axes, by what their values depend on.
struct Sectors {
    /// Per dimension of the grid: its axis, and its stride, by which the number of a cell grows from one cell of the
    /// axis to the next.
    axes: BTreeMap<Dimension, (GridAxis, usize)>,
    one_interval_each: bool,
    margin: f64,
}

/// One cell of one axis: its contribution to the number of a cell, and its bounds.
#[derive(Debug, Clone, Copy)]
struct Slice {
    offset: usize,
    low: f64,
    high: f64,
}

impl Sectors {
    fn of(grid: &Grid, one_interval_each: bool, margin: f64) -> Sectors {
        let mut axes = BTreeMap::new();
        let mut stride = 1;
        for axis in grid.axes().iter().rev() {
            axes.insert(axis.dimension, (*axis, stride));
            stride *= axis.cells as usize;
        }
        Sectors { axes, one_interval_each, margin }
    }

    fn has(&self, dimensions: &[Dimension]) -> bool {
        dimensions.iter().any(|dimension| self.axes.contains_key(dimension))
    }

    /// The kinds of operations of a campaign that are active during the run, and the operations of each kind.
    /// Operations are of one kind if the grid does not distinguish them.
    fn kinds(&self, plan: &CampaignPlan, test_space: &TestSpace) -> (Vec<KindOfOperation>, Vec<Vec<OperationId>>) {
        let timed = self.has(&[Dimension::T1, Dimension::T2, Dimension::T3]);
        let graded = self.has(&[Dimension::P1, Dimension::P2]);
        let classed = self.has(&[Dimension::O1, Dimension::O2, Dimension::O3]);
        let mut kinds: Vec<KindOfOperation> = Vec::new();
        let mut operations: Vec<Vec<OperationId>> = Vec::new();
        for used in test_space.operations() {
            let operation = plan.operation(used.operation);
            let Some(window) = Window::of(plan, used) else { continue };
            let window = if self.one_interval_each { window } else { Window::anywhere(window.start, window.end) };
            let parameters = operation.parameters.iter().zip(&used.parameters);
            let kind = KindOfOperation {
                window: if timed { window } else { Window::anywhere(0.0, 1.0) },
                parameters: parameters
                    .filter(|_| graded)
                    .flat_map(|(parameter, parameter_space)| Values::of(&parameter.domain, parameter_space))
                    .collect(),
                class: if classed { operation.kind.class() } else { Class::Other },
            };
            if let Some(at) = kinds.iter().position(|other| *other == kind) {
                operations[at].push(used.operation);
            } else {
                kinds.push(kind);
                operations.push(vec![used.operation]);
            }
        }
        (kinds, operations)
    }

    /// The cells of an axis; a single one without bounds if the grid lacks the dimension.
    fn slices(&self, dimension: Dimension) -> Vec<Slice> {
        let Some((axis, stride)) = self.axes.get(&dimension) else {
            return vec![Slice { offset: 0, low: f64::NEG_INFINITY, high: f64::INFINITY }];
        };
        (0..axis.cells)
            .map(|at| {
                let (low, high) = Grid::bounds(axis, at);
                Slice { offset: at as usize * stride, low, high }
            })
            .collect()
    }

    /// The cells of an axis that contain a value: two if it lies on the edge between them, since rounding may put it
    /// into either.
    fn at(&self, dimension: Dimension, value: f64) -> Vec<usize> {
        let Some((axis, stride)) = self.axes.get(&dimension) else { return vec![0] };
        let near = 1e-9 * (axis.high - axis.low);
        let mut offsets = [value - near, value + near].map(|value| place_on(axis, value) as usize * stride).to_vec();
        offsets.dedup();
        offsets
    }

    /// The cells of an axis that contain values between these bounds; if the bounds are equal, those that contain the
    /// value.
    fn between(&self, dimension: Dimension, low: f64, high: f64) -> Vec<usize> {
        if high - low <= 1e-9 {
            return self.at(dimension, f64::midpoint(low, high));
        }
        let slices = self.slices(dimension).into_iter();
        slices.filter(|cell| cell.high.min(high) - cell.low.max(low) > self.margin).map(|cell| cell.offset).collect()
    }

    /// The cell of a mixture's counts, as its contribution to the number of a cell.
    fn numbers(&self, kinds: &[KindOfOperation], mixture: &[usize]) -> usize {
        let count = |class: Option<Class>| {
            let of_class = kinds.iter().zip(mixture).filter(|(kind, _)| class.is_none_or(|class| kind.class == class));
            of_class.map(|(_, count)| *count as f64).sum::<f64>()
        };
        let dimensions = [
            (Dimension::O0, None),
            (Dimension::O1, Some(Class::Value)),
            (Dimension::O2, Some(Class::Loss)),
            (Dimension::O3, Some(Class::Delay)),
        ];
        let offsets = dimensions.iter().filter_map(|(dimension, class)| {
            let (axis, stride) = self.axes.get(dimension)?;
            Some(place_on(axis, count(*class)) as usize * stride)
        });
        offsets.sum()
    }

    /// The cells of T1, T2 and T3 that intervals in these windows can reach if the sum of their lengths is at most
    /// `longest`.
    fn timing(&self, windows: &[(Window, usize)], longest: f64) -> Reached {
        let count: usize = windows.iter().map(|(_, count)| count).sum();
        let n = count as f64;
        let mean =
            |value: fn(&Window) -> f64| windows.iter().map(|(window, n)| value(window) * *n as f64).sum::<f64>() / n;
        let centre = mean(|window| f64::midpoint(window.start, window.end));
        let (width, shortest) = (mean(|window| window.end - window.start), mean(|window| window.shortest));
        let greatest = mean(Window::greatest_length);
        // With conditions, intervals can be anywhere in the windows, so the means can be those of any part of them.
        let reached_by_any = (
            windows.iter().map(|(window, _)| window.start).fold(f64::INFINITY, f64::min),
            windows.iter().map(|(window, _)| window.end).fold(f64::NEG_INFINITY, f64::max),
        );
        let members: Vec<(Member, usize)> = windows
            .iter()
            .map(|(window, n)| {
                let reach = (window.end - window.start - window.shortest) / 2.0;
                let free = (window.end - window.start - window.longest).max(0.0) / 2.0;
                (Member { centre: f64::midpoint(window.start, window.end), reach, free }, *n)
            })
            .collect();
        let free: f64 = members.iter().map(|(member, n)| member.free * *n as f64).sum();
        let mut reached = Reached { cells: Vec::new(), exact: true };
        for t2 in self.slices(Dimension::T2) {
            let (centre, width, greatest) = if self.one_interval_each {
                (centre, width, greatest)
            } else {
                let (start, end) = reached_by_any;
                (f64::midpoint(start, end), end - start, end - start)
            };
            // The shortest intervals in the cell leave most room for their midpoints.
            let length = t2.low.max(shortest);
            // Disjoint copies can touch, so the whole length can be reached too.
            let too_long = self.one_interval_each && length > longest / n + MARGIN;
            // Where only one length is possible, the cell that contains it is reached.
            let one_length = self.one_interval_each && greatest - shortest <= 1e-9;
            let reaches_length = if one_length {
                self.at(Dimension::T2, shortest).contains(&t2.offset)
            } else {
                t2.high.min(greatest) - length > self.margin
            };
            if too_long || !reaches_length {
                continue;
            }
            let length = if one_length { shortest } else { length };
            let room = (width - length) / 2.0;
            for t1 in self.slices(Dimension::T1) {
                let (low, high) = (t1.low.max(centre - room), t1.high.min(centre + room));
                let one_place = one_length && room <= 1e-9;
                let reaches_midpoint = if one_place {
                    self.at(Dimension::T1, centre).contains(&t1.offset)
                } else {
                    high - low > self.margin
                };
                if !reaches_midpoint {
                    continue;
                }
                let base = t1.offset + t2.offset;
                if !self.has(&[Dimension::T3]) {
                    reached.cells.push(base);
                    continue;
                }
                let spread = if !self.one_interval_each {
                    spread::Spread { least: 0.0, greatest: width / 2.0, exact: false }
                } else if count == 1 {
                    spread::Spread { least: 0.0, greatest: 0.0, exact: true }
                } else {
                    spread::midpoints(&members, n * room - free, low, high)
                };
                reached.exact &= spread.exact;
                // Disjoint copies can touch; then the extreme values are reached too.
                let touching = self.one_interval_each && longest < n * width - MARGIN;
                let beyond = if touching { 2.0 * self.margin } else { 0.0 };
                let t3 = self.between(Dimension::T3, spread.least - beyond, spread.greatest + beyond);
                reached.cells.extend(t3.into_iter().map(|offset| base + offset));
            }
        }
        reached
    }

    /// The cells of P1 and P2 that operations with these parameters can reach.
    fn intensity(&self, parameters: &[(Vec<Values>, usize)]) -> Reached {
        let nothing = Reached { cells: vec![0], exact: true };
        if !self.has(&[Dimension::P1, Dimension::P2]) {
            return nothing;
        }
        let all: Vec<&Values> =
            parameters.iter().flat_map(|(values, count)| std::iter::repeat_n(values, *count).flatten()).collect();
        let n = all.len() as f64;
        if all.is_empty() {
            return Reached { cells: Vec::new(), exact: true };
        }
        let listed: Option<Vec<&[f64]>> = all
            .iter()
            .map(|values| match values {
                Values::All => None,
                Values::These(these) => Some(these.as_slice()),
            })
            .collect();
        if let Some(sums) = listed.and_then(|listed| sums(&listed)) {
            let cells = sums.into_iter().flat_map(|(sum, squares)| {
                let mean = sum / n;
                let spread = libm::sqrt((squares / n - mean * mean).max(0.0));
                let p2 = self.at(Dimension::P2, spread);
                self.at(Dimension::P1, mean)
                    .into_iter()
                    .flat_map(move |p1| p2.clone().into_iter().map(move |p2| p1 + p2))
            });
            let cells: BTreeSet<usize> = cells.collect();
            return Reached { cells: cells.into_iter().collect(), exact: true };
        }
        let ends = |values: &&Values| match values {
            Values::All => (0.0, 1.0),
            Values::These(these) => (these[0], these[these.len() - 1]),
        };
        let (least, greatest) = all.iter().map(ends).fold((0.0, 0.0), |(a, b), (low, high)| (a + low, b + high));
        let (least, greatest) = (least / n, greatest / n);
        // One parameter with all values fills the gaps between the sums of the others.
        let whole = all.iter().any(|values| matches!(values, Values::These(_)));
        let filled = all.iter().any(|values| matches!(values, Values::All));
        let spread_matters = self.has(&[Dimension::P2]) && all.len() > 1;
        let mut reached = Reached { cells: Vec::new(), exact: filled && !(whole && spread_matters) };
        for p1 in self.slices(Dimension::P1) {
            let (low, high) = (p1.low.max(least), p1.high.min(greatest));
            if high - low <= self.margin {
                continue;
            }
            let p2 = self.between(Dimension::P2, 0.0, spread::shares(all.len(), low.max(0.0), high.min(1.0)));
            reached.cells.extend(p2.into_iter().map(|offset| p1.offset + offset));
        }
        reached
    }
}

/// All sums of one value from each list, each with its sum of squares; `None` if there are too many.
fn sums(lists: &[&[f64]]) -> Option<Vec<(f64, f64)>> {
    // Sums that differ only by rounding have the same key.
    let key = |(sum, squares): (f64, f64)| [sum, squares].map(|x| libm::rint(x * 1e9).to_bits());
    let mut sums = BTreeMap::from([(key((0.0, 0.0)), (0.0, 0.0))]);
    for list in lists {
        if sums.len().checked_mul(list.len())? > MOST_SUMS {
            return None;
        }
        let next = sums.values().flat_map(|&(sum, squares)| list.iter().map(move |x| (sum + x, squares + x * x)));
        sums = next.map(|both| (key(both), both)).collect();
    }
    Some(sums.into_values().collect())
}

/// Every way to choose `fewest` to `most` operations of this number of kinds, as a count per kind; `None` if there are
/// too many.
fn mixtures(kinds: usize, fewest: usize, most: usize) -> Option<Vec<Vec<usize>>> {
    let mut open: Vec<(Vec<usize>, usize)> = vec![(Vec::new(), 0)];
    for kind in 0..kinds {
        let last = kind + 1 == kinds;
        let mut next = Vec::new();
        for (counts, total) in open {
            let least = if last { fewest.saturating_sub(total) } else { 0 };
            for count in least..=most - total {
                let mut counts = counts.clone();
                counts.push(count);
                next.push((counts, total + count));
            }
            if next.len() > MOST_MIXTURES {
                return None;
            }
        }
        open = next;
    }
    Some(open.into_iter().map(|(counts, _)| counts).collect())
}

/// The distinct items, and for each item its position among them.
fn distinct<T: PartialEq>(items: impl Iterator<Item = T>) -> (Vec<T>, Vec<usize>) {
    let mut kept: Vec<T> = Vec::new();
    let places = items.map(|item| {
        kept.iter().position(|other| *other == item).unwrap_or_else(|| {
            kept.push(item);
            kept.len() - 1
        })
    });
    let places = places.collect();
    (kept, places)
}

/// How many of a mixture's operations are of each sort.
fn counted(mixture: &[usize], sort_of: &[usize], sorts: usize) -> Vec<usize> {
    let mut counts = vec![0; sorts];
    for (count, &sort) in mixture.iter().zip(sort_of) {
        counts[sort] += count;
    }
    counts
}

/// The sorts that occur, each with its count.
fn paired<T: Clone>(sorts: &[T], counts: &[usize]) -> Vec<(T, usize)> {
    sorts.iter().cloned().zip(counts.iter().copied()).filter(|(_, count)| *count > 0).collect()
}

#[cfg(test)]
mod tests;
