//! The reality gap in traces: how signals of a lab differ from those of a simulation, test by test, and how much later
//! and how much greater they are over all tests.

use std::collections::{BTreeMap, BTreeSet};

use sesame_base::test_number::TestNumber;
use sesame_gap::localise::{self, Extent, Words, localise};
use sesame_gap::samples::{Moments, Welch};
use sesame_gap::series::{Between, Series};
use sesame_gap::split::Located;
use sesame_gap::traces::{self, Comparison};
use sesame_plan::Dimension;
use sesame_present::number::{fixed, quantity};
use sesame_present::table::Table;

use crate::Datum;
use crate::gap::ALPHA;

/// Signals that differ by less of their own spread are taken to agree in level.
const SMALL: f64 = 0.01;

/// The greatest lag that is looked for, in seconds, in either direction.
const GREATEST_LAG: f64 = 1.0;

/// How far one series may locally run ahead of the other in the DTW distance, in seconds.
const BAND: f64 = 0.5;

/// Permutations that decide whether a gap is in a range of a dimension. Many questions are asked, so p values are to be
/// small.
const PERMUTATIONS: u32 = 4999;

/// A number in the messages of a topic, over time.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Signal {
    /// Seconds since the start of the run, ascending.
    pub times: Vec<f64>,
    /// The value at each time; finite.
    pub values: Vec<f64>,
}

/// The signals of a run by name, such as `zones/Z1.level`.
pub type Signals = BTreeMap<String, Signal>;

/// A test of which there are traces on both sides.
#[derive(Debug, Clone, PartialEq)]
pub struct TracedTest {
    /// Its number in the results of the campaign.
    pub test: u32,
    /// Its coordinates in the dimensions in which a gap is looked for.
    pub at: Vec<Option<f64>>,
    /// The run of the simulation.
    pub simulation: Signals,
    /// The runs of the lab; at least one.
    pub lab: Vec<Signals>,
}

/// How traces differ.
#[derive(Debug, Clone, PartialEq)]
pub struct TraceGap {
    /// Each signal of each test, as the mean over the runs of the lab.
    pub comparisons: Vec<Compared>,
    /// Each signal that moves on both sides.
    pub signals: Vec<SignalGap>,
    /// The names of dimensions in which gaps were looked for.
    pub dimensions: Vec<Dimension>,
}

/// One signal of one test.
#[derive(Debug, Clone, PartialEq)]
pub struct Compared {
    /// The number of the test.
    pub test: u32,
    /// The signal.
    pub signal: String,
    /// The comparison with each run of the lab; at least one.
    pub runs: Vec<Comparison>,
}

/// One signal over all tests.
#[derive(Debug, Clone, PartialEq)]
pub struct SignalGap {
    /// The signal.
    pub signal: String,
    /// By how much the lab is later, in seconds.
    pub lag: Over,
    /// By how much the lab is greater on average once the lag is taken out.
    pub level: Over,
}

/// One number over all tests.
#[derive(Debug, Clone, PartialEq)]
pub struct Over {
    /// How far it extends. Its positions are those of the tests.
    pub extent: Extent,
    /// The numbers of the tests that have it.
    pub tests: Vec<u32>,
}

/// Compares the traces of tests.
///
/// The simulation has one trace per test, so how far its runs are apart is taken to be as in the lab. Questions are
/// asked of all signals at once, so α is divided by their number (Bonferroni).
pub fn compare(tests: &[TracedTest], dimensions: &[Dimension]) -> TraceGap {
    let settings = traces::Settings { step: None, greatest_lag: GREATEST_LAG, band: BAND };
    let mut comparisons = Vec::new();
    for test in tests {
        for (name, simulated) in &test.simulation {
            let Some(simulated) = of(simulated) else { continue };
            let runs = test.lab.iter().filter_map(|run| {
                let lab = of(run.get(name)?)?;
                traces::compare(&simulated, &lab, settings).ok()
            });
            let runs: Vec<Comparison> = runs.collect();
            if !runs.is_empty() {
                comparisons.push(Compared { test: test.test, signal: name.clone(), runs });
            }
        }
    }
    let moving = comparisons.iter().filter(|compared| compared.runs.iter().any(|run| run.lag.is_ok()));
    let names: BTreeSet<&str> = moving.map(|compared| compared.signal.as_str()).collect();
    let questions = (2 * names.len()).max(1) as f64;
    let signals = names.into_iter().map(|name| {
        let over = |tolerance: f64, value: &dyn Fn(&Comparison) -> Option<f64>| {
            let mut located = Vec::new();
            let mut numbers = Vec::new();
            for compared in comparisons.iter().filter(|compared| compared.signal == name) {
                let values: Vec<f64> = compared.runs.iter().filter_map(value).collect();
                let test = tests.iter().find(|test| test.test == compared.test);
                let (Some(difference), Some(test)) = (of_one_simulation(&values), test) else { continue };
                located.push(Located { at: test.at.clone(), difference });
                numbers.push(compared.test);
            }
            let settings =
                localise::Settings { tolerance, alpha: ALPHA / questions, permutations: PERMUTATIONS, seed: 0 };
            Over { extent: localise(&located, settings), tests: numbers }
        };
        let spread = comparisons.iter().filter(|compared| compared.signal == name).filter_map(Compared::spread);
        let spread = spread.fold(0.0, f64::max);
        let steps = comparisons.iter().filter(|compared| compared.signal == name).map(|compared| compared.runs[0].step);
        let step = steps.fold(f64::INFINITY, f64::min);
        SignalGap {
            signal: name.to_owned(),
            // Half a sample is what sampling itself makes of a lag.
            lag: over(step / 2.0, &|run| Some(run.lag.ok()?.seconds)),
            level: over(SMALL * spread, &|run| run.level.ok()),
        }
    });
    let signals = signals.collect();
    TraceGap { comparisons, signals, dimensions: dimensions.to_vec() }
}

fn of(Signal { times, values }: &Signal) -> Option<Series<'_>> {
    Series::new(times, values, Between::Linear).ok()
}

/// The mean of values that all have one run of the simulation in common, with the standard error that is due to it too;
/// `None` without several values or without spread.
fn of_one_simulation(values: &[f64]) -> Option<Welch> {
    let moments = Moments::of(values)?;
    let deviation = moments.deviation.filter(|deviation| *deviation > 0.0)?;
    let count = values.len() as f64;
    let standard_error = deviation * libm::sqrt(1.0 + 1.0 / count);
    Some(Welch { difference: moments.mean, standard_error, degrees: count - 1.0 })
}

impl Compared {
    /// The mean over the runs of the lab; `None` if no run has it.
    fn mean(&self, value: impl Fn(&Comparison) -> Option<f64>) -> Option<f64> {
        let values: Vec<f64> = self.runs.iter().filter_map(value).collect();
        (!values.is_empty()).then(|| values.iter().sum::<f64>() / values.len() as f64)
    }

    /// How far both sides are apart, in standard deviations of the signal in the simulation; `None` for a signal that
    /// does not move there.
    pub fn apart(&self) -> Option<f64> {
        let spread = self.spread().filter(|spread| *spread > 0.0)?;
        Some(self.mean(|run| Some(run.rms))? / spread)
    }

    /// The standard deviation of the signal in the simulation.
    fn spread(&self) -> Option<f64> {
        self.mean(|run| Some(run.spread))
    }
}

impl TraceGap {
    /// Each signal of each test: how far both sides are apart, and how much of that is a lag.
    pub fn table(&self) -> Table {
        let columns =
            ["test", "signal", "runs", "rms", "correlation", "dtw", "lag_s", "rms_without_lag", "gain", "level"];
        let mut table = Table::new(columns.map(str::to_owned));
        for compared in &self.comparisons {
            table.row([
                Datum::test(compared.test),
                Datum::text(&compared.signal),
                Datum::count(compared.runs.len()),
                Datum::real(compared.mean(|run| Some(run.rms))),
                Datum::real(compared.mean(|run| run.correlation.ok())),
                Datum::real(compared.mean(|run| Some(run.warping.rms()))),
                Datum::real(compared.mean(|run| Some(run.lag.ok()?.seconds))),
                Datum::real(compared.mean(|run| run.rms_without_lag.ok())),
                Datum::real(compared.mean(|run| Some(run.line.ok()?.gain))),
                Datum::real(compared.mean(|run| run.level.ok())),
            ]);
        }
        table
    }

    /// What the traces say: for each signal, how much later and how much greater it is in the lab. Signals that agree
    /// are counted.
    pub fn sentences(&self) -> Vec<String> {
        let mut sentences = Vec::new();
        let mut agreeing = 0;
        for SignalGap { signal, lag, level } in &self.signals {
            let mut agrees = true;
            let name = format!("`{signal}`");
            let quantities: [(&Over, [&str; 2], Option<&str>); 2] =
                [(lag, ["earlier", "later"], Some("s")), (level, ["smaller", "greater"], None)];
            for (over, than, unit) in quantities {
                let found = !matches!(over.extent, Extent::None | Extent::Undecided(_));
                if found {
                    let words = Words {
                        metric: &name,
                        than,
                        value: &|value| quantity(value, unit),
                        dimension: &|at| self.dimensions[at].name().to_owned(),
                        coordinate: &|_, value| fixed(value, 2),
                        test: &|at| TestNumber(over.tests[at]).to_string(),
                    };
                    sentences.push(localise::sentence(&over.extent, over.tests.len(), &words));
                    agrees = false;
                }
            }
            agreeing += usize::from(agrees);
        }
        if agreeing > 0 {
            sentences
                .push(format!("Of {} signals, {agreeing} show neither a lag nor another level.", self.signals.len()));
        }
        sentences
    }
}
