//! MITM testing [SESAME 2023, §3.3.2]: what the relay adds, and what that changes, as more and more topics pass through
//! it without any operation.

use std::collections::BTreeMap;

use serde::Serialize;

use sesame_base::latency::Latencies;
use sesame_plan::{CampaignPlan, Channel, MetricId, Test, TopicId};
use sesame_present::number::{number, plural};
use sesame_record::{RecordError, Repository, TestRecord, differences};

use crate::preparation::sides::{Values, VerdictCounts, broken_off, place, runs};

/// Below so many messages there is no one in a hundred, and the time of every second message is judged.
const FEWEST: u64 = 100;

/// What the relay adds, stage by stage.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct MitmTesting {
    /// The lab; `None` for the simulation.
    pub lab: Option<String>,
    /// Whether the simulator is stepped: time stands still while the relay works, so nothing that it adds is measured.
    pub lock_stepped: bool,
    /// Whether topics that are not relayed bypass the relay, as with ROS 2 nodes. With other simulators, all messages
    /// pass through the runner.
    pub bypass: bool,
    /// The declared `relay budget`, if there is one.
    pub budget: Option<Budget>,
    /// The stages: each relays one more topic than the one before, and the first relays none.
    pub stages: Vec<Stage>,
    /// Whether the budget was exceeded in any stage.
    pub over_budget: bool,
    /// Each deviation from what is required, as a sentence.
    pub objections: Vec<String>,
}

/// What the relay may add, in seconds of wall time.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Budget {
    /// The most that may be added to 99 of 100 messages, in seconds; `None` if nothing is declared.
    pub latency: Option<f64>,
    /// The largest permitted difference between the 99th percentile and the median of what is added, in seconds; `None`
    /// if nothing is declared.
    pub jitter: Option<f64>,
}

/// Runs without operations, with some topics relayed.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Stage {
    /// How many topics were relayed.
    pub relayed: usize,
    /// The topic that was relayed for the first time; `None` in the first stage.
    pub topic: Option<String>,
    /// How many runs there were.
    pub runs: usize,
    /// What the relay added, per topic; empty where it is not measured.
    pub added: Vec<AddedToTopic>,
    /// All metrics, in declaration order.
    pub metrics: Vec<Drift>,
    /// The number of runs that violate a requirement, for each requirement that any run violates.
    pub violated: BTreeMap<String, usize>,
    /// Whether all runs are equal, bit for bit; `None` for a single run.
    pub deterministic: Option<bool>,
    /// The first difference of two runs, in words.
    pub difference: Option<String>,
    /// Whether the budget was exceeded.
    pub over_budget: bool,
    /// Each deviation from what is required, as a sentence.
    pub objections: Vec<String>,
}

/// What the relay added to the way of a topic's messages, in seconds of wall time.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct AddedToTopic {
    /// The topic or service.
    pub topic: String,
    /// How many messages were measured, in all runs.
    pub messages: u64,
    /// The most that was added to half of the messages, in seconds.
    pub p50: Option<f64>,
    /// The most that was added to 99 of 100 messages, in seconds; `None` below a hundred messages.
    pub p99: Option<f64>,
    /// The most that was added to any message, in seconds.
    pub max: Option<f64>,
    /// How far `p99` is above `p50`.
    pub jitter: Option<f64>,
    /// Whether that is more than the budget.
    pub over_budget: bool,
}

/// A metric compared with the runs in which nothing was relayed.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Drift {
    /// The metric.
    pub metric: String,
    /// Its unit; `None` for a plain number.
    pub unit: Option<String>,
    /// Its values in this stage; `None` where it has none.
    pub values: Option<Values>,
    /// The mean in this stage minus that without relay.
    pub drift: Option<f64>,
    /// The standard deviation of the runs without relay.
    pub spread_before: Option<f64>,
}

/// What was found in the stages, from the results of each, in their order; the first relays nothing. There is at least
/// one.
pub fn mitm(stages: &[Repository]) -> Result<MitmTesting, RecordError> {
    let plan = stages[0].plan();
    let budget =
        plan.simulator.lifecycle.relay_budget.map(|budget| Budget { latency: budget.latency, jitter: budget.jitter });
    // Then time stands still while the relay works.
    let lock_stepped = plan.simulator.step_ns().is_some();
    let lab = stages[0].task().lab().map(str::to_owned);
    // The topics are those of the last stage: with fewer topics relayed, fewer are cut.
    let last = stages.last().map_or(plan, Repository::plan);
    let topics: Vec<(String, Vec<TopicId>)> = last.relayable().into_iter().map(|ids| (name(last, &ids), ids)).collect();
    let before = runs(&stages[0])?;
    let mut found = Vec::with_capacity(stages.len());
    for (relayed, repository) in stages.iter().enumerate() {
        let measured = if lock_stepped { BTreeMap::new() } else { repository.relay_latencies()? };
        let relayed_topics = &topics[..relayed.min(topics.len())];
        let added = relayed_topics.iter().filter(|_| !lock_stepped);
        let added = added.map(|(name, ids)| added_to(plan, name, ids, &measured, budget)).collect();
        let records = if relayed == 0 { before.clone() } else { runs(repository)? };
        let topic = relayed_topics.last().map(|(name, _)| name.clone());
        found.push(stage(plan, (relayed, topic), added, &before, &records, budget, lab.as_deref()));
    }
    Ok(MitmTesting {
        over_budget: found.iter().any(|stage| stage.over_budget),
        objections: found.iter().flat_map(|stage| stage.objections.clone()).collect(),
        stages: found,
        lab,
        lock_stepped,
        bypass: !plan.simulator.wiring.is_empty(),
        budget,
    })
}

/// The name of a topic; that of a service is its path.
fn name(plan: &CampaignPlan, ids: &[TopicId]) -> String {
    let topic = plan.topic(ids[0]);
    match (topic.channel, topic.paths.first()) {
        (Channel::Request | Channel::Reply, Some(path)) => path.clone(),
        _ => topic.name.clone(),
    }
}

fn added_to(
    plan: &CampaignPlan,
    name: &str,
    ids: &[TopicId],
    measured: &BTreeMap<String, Latencies>,
    budget: Option<Budget>,
) -> AddedToTopic {
    let mut paths: Vec<&str> = ids.iter().flat_map(|&id| &plan.topic(id).paths).map(String::as_str).collect();
    paths.sort_unstable();
    paths.dedup();
    let mut all = Latencies::default();
    paths.iter().filter_map(|&path| measured.get(path)).for_each(|latencies| all.add(latencies));
    let p50 = all.percentile(50);
    let p99 = all.percentile(99).filter(|_| all.messages() >= FEWEST);
    let jitter = p99.zip(p50).map(|(p99, p50)| p99 - p50);
    let above = |value: Option<f64>, limit: Option<f64>| value.zip(limit).is_some_and(|(value, limit)| value > limit);
    let over_budget = budget.is_some_and(|budget| above(p99.or(p50), budget.latency) || above(jitter, budget.jitter));
    let (topic, messages, max) = (name.to_owned(), all.messages(), all.longest());
    AddedToTopic { topic, messages, p50, p99, max, jitter, over_budget }
}

fn stage(
    plan: &CampaignPlan,
    (relayed, topic): (usize, Option<String>),
    added: Vec<AddedToTopic>,
    before: &[TestRecord],
    records: &[TestRecord],
    budget: Option<Budget>,
    lab: Option<&str>,
) -> Stage {
    let place = format!("{} with {} relayed", place(lab), plural(relayed, "topic", "topics"));
    let exceeded = budget.iter().flat_map(|&budget| added.iter().flat_map(move |topic| over(topic, budget, relayed)));
    let mut objections: Vec<String> = exceeded.collect();
    objections.extend(broken_off(records, &place));
    let mut violated = BTreeMap::new();
    for requirement in &plan.requirements {
        let counts = VerdictCounts::of(records, requirement);
        if counts.violated > 0 {
            violated.insert(requirement.name.clone(), counts.violated);
            // What is violated without relay is not the relay's fault, and `null` says it.
            if relayed > 0 && VerdictCounts::of(before, requirement).violated == 0 {
                let runs = plural(records.len(), "run", "runs");
                let name = &requirement.name;
                objections.push(format!(
                    "{name} is violated in {} of {runs} in {place}, and not without relay",
                    counts.violated
                ));
            }
        }
    }
    let metrics = (0u32..).map(MetricId).zip(&plan.metrics).map(|(id, metric)| {
        let (values, without) = (Values::of(records, id), Values::of(before, id));
        Drift {
            metric: metric.name.clone(),
            unit: metric.unit.clone(),
            values,
            drift: values.zip(without).map(|(values, without)| values.mean - without.mean),
            spread_before: without.and_then(|without| without.deviation),
        }
    });
    let difference = records.split_first().and_then(|(first, others)| {
        let differing = |other: &TestRecord| {
            let found = differences(plan, &Test::default(), &first.observation, &other.observation);
            found.first().map(|difference| {
                format!("{} was {} in one run and {} in another", difference.what, difference.before, difference.after)
            })
        };
        others.iter().find_map(differing)
    });
    Stage {
        relayed,
        topic,
        runs: records.len(),
        over_budget: added.iter().any(|topic| topic.over_budget),
        added,
        metrics: metrics.collect(),
        violated,
        deterministic: (records.len() > 1).then_some(difference.is_none()),
        difference,
        objections,
    }
}

/// Where the budget is exceeded on a topic, in a sentence each.
fn over(added: &AddedToTopic, budget: Budget, relayed: usize) -> Vec<String> {
    let AddedToTopic { topic, p50, p99, jitter, .. } = added;
    let with = format!("with {} relayed", plural(relayed, "topic", "topics"));
    let mut said = Vec::new();
    if let Some(limit) = budget.latency {
        match (p99, p50) {
            (Some(p99), _) if *p99 > limit => said.push(format!(
                "{with}, the relay added {} to one message in a hundred of `{topic}`; the budget is {} latency",
                milliseconds(*p99),
                milliseconds(limit)
            )),
            (None, Some(p50)) if *p50 > limit => said.push(format!(
                "{with}, the relay added {} to every second message of `{topic}`; the budget is {} latency",
                milliseconds(*p50),
                milliseconds(limit)
            )),
            _ => {}
        }
    }
    if let Some((limit, jitter)) = budget.jitter.zip(*jitter).filter(|(limit, jitter)| jitter > limit) {
        said.push(format!(
            "{with}, what the relay added to messages of `{topic}` varied by {}; the budget is {} jitter",
            milliseconds(jitter),
            milliseconds(limit)
        ));
    }
    said
}

/// A time in milliseconds.
pub(super) fn milliseconds(seconds: f64) -> String {
    format!("{} ms", number(seconds * 1000.0))
}
