//! The certificates of a test at one of its moments: what each part of them was, and why each guarantee held or not.

use serde::Serialize;

use sesame_base::observation::ChangeCause;
use sesame_base::test_number::TestNumber;
use sesame_base::time::SimTime;
use sesame_monitor::State;
use sesame_monitor::why::{Depth, Part, What, certificate, text, why};
use sesame_plan::{CampaignPlan, Monitor, MonitorId};
use sesame_record::{RecordError, Repository, TestRecord};

use crate::facts::certificate::history::{History, Values};
use crate::facts::certificate::why::{WhyReport, explained, named};

/// Why there is nothing to show of a moment.
#[derive(Debug, thiserror::Error)]
pub enum MomentError {
    /// The results cannot be read.
    #[error(transparent)]
    Record(#[from] RecordError),
    /// There is nothing to explain.
    #[error("{test} has no decisions of monitors: {}", if *.declared { "it was recorded without them" } else { "its space has no `eddi`" })]
    NoDecisions {
        /// The test.
        test: TestNumber,
        /// Whether its space has monitors.
        declared: bool,
    },
    /// It lies outside of the run.
    #[error("{test} ran from 0 s to {end} s; {at} s is not in it")]
    Outside {
        /// The test.
        test: TestNumber,
        /// The moment, in seconds.
        at: f64,
        /// The end of the run, in seconds.
        end: f64,
    },
    /// A run keeps so many changes only.
    #[error("{test} had so many decisions and changes of evidence that those after {last} s were not kept")]
    NotKept {
        /// The test.
        test: TestNumber,
        /// The last change that was kept, in seconds.
        last: f64,
    },
}

/// The certificates of a test at a moment.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct MomentReport {
    /// The test.
    pub test: TestNumber,
    /// The moment, in seconds; everything that happens at this time has happened.
    pub at: f64,
    /// All monitors of the space.
    pub monitors: Vec<MonitorMoment>,
}

/// A monitor at a moment.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct MonitorMoment {
    /// Its name.
    pub monitor: String,
    /// Its state.
    pub state: String,
    /// The integrity of its state; 0 for the safe state.
    pub integrity: u32,
    /// Since when, in seconds.
    pub since: f64,
    /// Its certificate, with the value of each part.
    pub certificate: PartReport,
    /// Why each guarantee held or did not, the strongest first.
    pub why: Vec<WhyReport>,
    /// The certificate as text.
    #[serde(skip)]
    pub(crate) text: String,
}

/// A part of a certificate with its value.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct PartReport {
    /// `monitor`, `guarantee`, `gate`, `evidence` or `demand`.
    pub kind: &'static str,
    /// Its name; `None` for a gate.
    pub name: Option<String>,
    /// For a demand: the monitor whose guarantee it is.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub from: Option<String>,
    /// For a guarantee: its integrity.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub integrity: Option<u32>,
    /// For a gate: how many of its parts must hold.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub needs: Option<u32>,
    /// `true`, `false` or `unknown`; for a monitor, whether any guarantee holds.
    pub is: String,
    /// For evidence: since when it has had this value, in seconds.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub since: Option<f64>,
    /// For evidence: what made it so, unless it has been unknown from the beginning.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub cause: Option<ChangeCause>,
    /// What it depends on.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub parts: Vec<PartReport>,
}

/// The certificates of a test, which a user names as for [`show`](crate::show), at a time in seconds.
pub fn show_at(repository: &Repository, name: &str, at: f64) -> Result<MomentReport, MomentError> {
    moment(repository.plan(), &repository.test(repository.find(name)?)?, at)
}

pub(crate) fn moment(plan: &CampaignPlan, record: &TestRecord, at: f64) -> Result<MomentReport, MomentError> {
    let (test, shown) = (TestNumber(record.number), &record.observation.monitors);
    let end = record.observation.end;
    let Some(history) = History::new(plan, shown) else {
        return Err(MomentError::NoDecisions { test, declared: !plan.monitors.is_empty() });
    };
    if !(0.0..=end).contains(&at) {
        return Err(MomentError::Outside { test, at, end });
    }
    let times = shown.iter().flat_map(|monitor| {
        monitor.decisions.iter().map(|decision| decision.time).chain(monitor.evidence.iter().map(|change| change.time))
    });
    let last = times.fold(0.0, f64::max);
    if at > last && shown.iter().any(|monitor| monitor.omitted > 0) {
        return Err(MomentError::NotKept { test, last });
    }
    let instant = SimTime::from_seconds(at);
    let values = history.at(instant);
    let now = values.moment();
    let monitors = (0..).map(MonitorId).zip(plan.monitors.iter().zip(shown)).map(|(id, (monitor, shown))| {
        let tree = certificate(&now, &plan.monitors, id);
        let (state, integrity) = named(monitor, now.state(id));
        let past = shown.decisions.iter().take_while(|decision| SimTime::from_seconds(decision.time) <= instant);
        let guarantees = 0..history.network().guarantees(id);
        MonitorMoment {
            monitor: monitor.name.clone(),
            state: state.to_owned(),
            integrity,
            since: past.last().map_or(0.0, |decision| decision.time),
            why: guarantees.map(|at| explained(&why(&now, id, at, Depth::Evidence), &values)).collect(),
            text: text(&tree, &plan.monitors),
            certificate: part(&tree, id, monitor, &values),
        }
    });
    Ok(MomentReport { test, at, monitors: monitors.collect() })
}

fn part(tree: &Part, id: MonitorId, monitor: &Monitor, values: &Values<'_>) -> PartReport {
    let mut report = PartReport {
        kind: "gate",
        name: None,
        from: None,
        integrity: None,
        needs: None,
        is: tree.truth.to_string(),
        since: None,
        cause: None,
        parts: tree.parts.iter().map(|inner| part(inner, id, monitor, values)).collect(),
    };
    match tree.what {
        What::Monitor(..) => (report.kind, report.name) = ("monitor", Some(monitor.name.clone())),
        What::Guarantee(at) => {
            let (name, integrity) = named(monitor, State::Guarantee(at));
            (report.kind, report.name) = ("guarantee", Some(name.to_owned()));
            report.integrity = Some(integrity);
        }
        What::AtLeast(needs) => report.needs = Some(needs),
        What::Evidence(at) => {
            let last = values.last(id, at);
            (report.kind, report.name) = ("evidence", Some(monitor.evidence[at as usize].name.clone()));
            report.since = Some(last.map_or(0.0, |change| change.time));
            report.cause = last.map(|change| change.cause.clone());
        }
        What::Demand(at) => {
            let demand = &monitor.demands[at as usize];
            (report.kind, report.name) = ("demand", Some(demand.name.clone()));
            report.from = Some(values.plan().monitor(demand.monitor).name.clone());
        }
    }
    report
}
