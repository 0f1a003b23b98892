//! All that these properties know of how the runtime is called and what it reports: what changes there, changes here.

use std::fmt::Write as _;
use std::path::Path;

use rusqlite::Connection;

use sesame_base::observation::{Counters, MetricObservation, Observation, OperationEffect, Outcome};
use sesame_plan::stl::{self, Robustness};
use sesame_plan::testing;
use sesame_plan::{
    Aggregate, Campaign, CampaignPlan, Copies, Drain, Expression, Input, MessageId, Metric, MetricSource, Operation,
    OperationKind, Requirement, Side, Test, Topic, Trend, Type,
};
use sesame_record::{DATABASE, MetricValue, Origin, Recorder, TestRecord, Verdict, verdict};
use sesame_relay::evaluate::{Custom, Run, evaluate_tapped};
use sesame_relay::metric::MetricTable;
use sesame_relay::relay::OperationEvent;
use sesame_relay::transport::{Transport, in_process};
use sesame_relay::wire::WireTable;

use crate::hooks::{HookKind, entries};
use crate::ledger::Ledger;
use crate::robot::{Carries, Robot, Script, set_script};

/// The length of a step of every simulator here, in nanoseconds.
pub(crate) const STEP: i64 = 100_000_000;

/// A metric; of a hook with its trend declared.
pub(crate) fn metric(name: &str, default: Option<f64>, initial: Option<f64>, source: MetricSource) -> Metric {
    let trend = match &source {
        MetricSource::Hook { .. } => trend(HookKind::named(name)),
        MetricSource::FuzzingTime => Some(Trend::Rising),
        MetricSource::Formula { formula } => match formula.aggregate {
            Aggregate::Max { .. } | Aggregate::Count { .. } | Aggregate::Duration { .. } => Some(Trend::Rising),
            Aggregate::Min { .. } => Some(Trend::Falling),
            Aggregate::Last { .. } | Aggregate::Mean { .. } => None,
        },
        MetricSource::Last { .. } | MetricSource::Robustness { .. } => None,
        MetricSource::Monitor { score, .. } => score.trend(),
    };
    Metric { default, initial, trend, ..testing::metric(name, source) }
}

fn trend(kind: HookKind) -> Option<Trend> {
    match kind {
        HookKind::Counting => Some(Trend::Rising),
        HookKind::Least => Some(Trend::Falling),
        HookKind::Latest => None,
    }
}

/// Whether the runtime is told which way the values of this hook go.
pub(crate) fn declares_trend(kind: HookKind) -> bool {
    trend(kind).is_some()
}

/// A temporal formula as a metric.
pub(crate) fn robustness(
    inputs: Vec<Input>,
    signals: Vec<Expression>,
    formula: stl::Formula,
    side: Side,
    whole_windows: bool,
) -> Robustness {
    Robustness { inputs, signals, formula, side, whole_windows }
}

/// Whether the end of a run leaves out the windows that it would cut.
pub(crate) fn over_whole_windows(robustness: &Robustness) -> bool {
    robustness.whole_windows
}

/// What a topic carries, as a plan has it.
pub(crate) fn ty(carries: Carries) -> Type {
    match carries {
        Carries::Real => Type::Real { unit: None },
        Carries::Int => Type::Int { unit: None },
        Carries::Bool => Type::Bool,
        Carries::Zone => Type::Message { id: MessageId(0) },
    }
}

/// A plan around what a case made up.
pub(crate) fn plan(
    topics: Vec<Topic>,
    metrics: Vec<Metric>,
    requirements: Vec<Requirement>,
    operations: &[Operation],
    copies: Copies,
    end_after: f64,
) -> CampaignPlan {
    let fields = vec![
        testing::field("level", Type::Real { unit: None }),
        testing::field("count", Type::Int { unit: None }),
        testing::field("inside", Type::Bool),
        testing::field("name", Type::Text),
    ];
    CampaignPlan {
        source: "made_up.sesame".to_owned(),
        space: "made_up".to_owned(),
        simulator: testing::in_process("robot", "robot::Robot", STEP.unsigned_abs()),
        messages: vec![testing::message("Zone", fields)],
        topics,
        metrics,
        requirements,
        operations: operations.to_vec(),
        campaign: Campaign { copies, end_after, ..testing::campaign("made_up", operations.len()) },
        ..testing::minimal()
    }
}

/// What a run of a robot showed, and all its messages.
pub(crate) fn run(plan: &CampaignPlan, test: &Test, script: &Script) -> (Observation, Ledger) {
    run_over(in_process::<Robot>().transport(plan), plan, test, 1, script)
}

/// The same with a simulator that is reached in another way. The script is for a robot on this thread.
pub(crate) fn run_over(
    mut transport: Box<dyn Transport>,
    plan: &CampaignPlan,
    test: &Test,
    simulator_seed: u64,
    script: &Script,
) -> (Observation, Ledger) {
    let wires = WireTable::new(plan);
    let metrics = MetricTable::new(plan, &wires, &entries()).expect("made-up metrics are sound");
    let mut ledger = Ledger::new(&wires);
    set_script(script.clone());
    let run = Run { simulator_seed, ..Run::of(test) };
    let observation =
        evaluate_tapped(plan, &wires, &metrics, transport.as_mut(), &run, &mut Custom::none(), Some(&mut ledger));
    transport.close();
    let observation = observation.expect("made-up tests fit their plans");
    ledger.end = sesame_base::time::SimTime::from_seconds(observation.end).nanos();
    // Nobody knows whether the step was over in which a run broke off.
    let ended = matches!(observation.outcome, Outcome::Completed | Outcome::NoEffect);
    ledger.steps = if ended { ledger.end } else { ledger.end - 1 };
    (observation, ledger)
}

/// The same run, had its worker been stopped where it crashed.
pub(crate) fn hung(observation: &Observation) -> Observation {
    Observation { outcome: Outcome::Timeout { limit: 1.0 }, ..observation.clone() }
}

/// What the runtime says of a requirement.
pub(crate) fn said(requirement: &Requirement, observation: &Observation) -> Verdict {
    let value =
        observation.metrics.get(requirement.metric.index()).map_or_else(MetricValue::default, MetricValue::from);
    verdict(requirement.bound, &observation.outcome, value)
}

/// The values that the runtime takes a metric to have had at the end of the run, had nothing broken it off.
pub(crate) fn reach(shown: &MetricObservation) -> (f64, f64) {
    (shown.reach.low.unwrap_or(f64::NEG_INFINITY), shown.reach.high.unwrap_or(f64::INFINITY))
}

/// Whether the runtime noticed that a metric heard what is not a number.
pub(crate) fn heard_no_number(shown: &MetricObservation) -> bool {
    shown.not_finite.is_some()
}

/// Whether copies of an operation wait for each other, where a campaign keeps them apart.
pub(crate) const KEEPS_COPIES_APART: bool = true;

/// Whether an operation had an effect.
pub(crate) fn has_effect(effect: &OperationEffect) -> bool {
    effect.counters.any_effect()
}

/// Messages that an operation held back after it had ended, behind others.
pub(crate) fn queued(counters: &Counters) -> u64 {
    counters.queued
}

/// The time in which operations that count are active or hold messages back, in nanoseconds.
pub(crate) fn busy(plan: &CampaignPlan, test: &Test, observation: &Observation, ledger: &Ledger) -> i64 {
    let nanos = |seconds: f64| (seconds * 1e9).round() as i64;
    let mut sum = 0;
    for (at, (used, effect)) in test.operations.iter().zip(&observation.operations).enumerate() {
        let operation = plan.operation(used.operation);
        if !operation.timed {
            continue;
        }
        let own = || ledger.deeds.iter().filter(|(_, of, _)| *of == at);
        let mut spans: Vec<(i64, i64)> =
            effect.intervals.iter().map(|span| (nanos(span.start), nanos(span.end))).collect();
        for (held, _, event) in own() {
            let OperationEvent::Delayed(_, release) = event else { continue };
            // What it does not let run its time goes when the activity ends.
            let stays = matches!(
                operation.kind,
                OperationKind::Latency { drain: Drain::Finish, .. } | OperationKind::Reorder { drain: Drain::Finish }
            );
            let ended =
                own().find(|(time, _, event)| *event == OperationEvent::Ended && time >= held).map(|(time, ..)| *time);
            let until = if stays { release.nanos() } else { ended.unwrap_or(i64::MAX).min(release.nanos()) };
            spans.push((*held, until.min(ledger.end)));
        }
        spans.sort_unstable();
        let mut covered = i64::MIN;
        for (start, end) in spans {
            sum += (end - start.max(covered)).max(0);
            covered = covered.max(end);
        }
    }
    sum
}

/// Records the run of a test in a folder, as a campaign would.
pub(crate) fn record(folder: &Path, plan: &CampaignPlan, test: &Test, observation: &Observation) {
    let mut recorder = Recorder::create(folder, plan, 1, 1).expect("the folder is new");
    let record = TestRecord {
        number: 0,
        origin: Origin::Search,
        generation: Some(0),
        parents: Vec::new(),
        test: test.clone(),
        simulator_seed: 1,
        duplicate_of: None,
        observation: observation.clone(),
    };
    recorder.commit(&record).expect("a run can be recorded");
    recorder.finish("the test was run").expect("a run can be recorded");
}

/// The digest of the results in a folder.
pub(crate) fn digest(folder: &Path) -> String {
    sesame_record::digest(&folder.join(DATABASE)).expect("what was recorded can be read")
}

/// Takes all that a wider plan added out of the results in a folder, row by row: what is left is to be what the plan
/// without it leaves, in another folder. `metrics` has for each metric of that plan its place in the wider one, and
/// `unread` is the number of messages on topics that were added.
pub(crate) fn leave_out_additions(folder: &Path, without: &Path, metrics: &[usize], unread: usize) {
    let database = Connection::open(folder.join(DATABASE)).expect("the results are there");
    let narrow = Connection::open(without.join(DATABASE)).expect("the results are there");
    let text = |sql: &str| narrow.query_row(sql, [], |row| row.get::<_, String>(0)).expect("there is one row");
    let plan = text("SELECT plan FROM campaign");
    let mut sql = String::from("PRAGMA foreign_keys = OFF; BEGIN;");
    for (table, column) in
        [("metrics", "id"), ("requirements", "metric"), ("metric_values", "metric"), ("series_pieces", "metric")]
    {
        // Twice, so that no number is taken before it is free.
        for (place, wider) in metrics.iter().enumerate() {
            write!(sql, "UPDATE {table} SET {column} = -1 - {place} WHERE {column} = {wider};").unwrap();
        }
        write!(sql, "DELETE FROM {table} WHERE {column} >= 0; UPDATE {table} SET {column} = -1 - {column};").unwrap();
    }
    // What is said of a metric that was added belongs to it.
    write!(
        sql,
        "DELETE FROM events WHERE text LIKE 'metric `unread%'; UPDATE tests SET messages = messages - {unread}; COMMIT;"
    )
    .unwrap();
    database.execute_batch(&sql).expect("these tables and columns are there");
    // Views with a column for each metric.
    for view in ["results", "front"] {
        let made = text(&format!("SELECT sql FROM sqlite_schema WHERE name = '{view}'"));
        database.execute_batch(&format!("DROP VIEW {view}; {made};")).expect("there is such a view");
    }
    database.execute("UPDATE campaign SET plan = ?1", [plan]).expect("there is a campaign");
}
