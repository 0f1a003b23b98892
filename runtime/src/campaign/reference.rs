//! What the reference run, without any disturbance, says about a campaign before and after its search.

use std::collections::BTreeSet;
use std::fmt;

use sesame_base::observation::Observation;
use sesame_base::silence::{PlannedWire, wires};
use sesame_plan::{CampaignPlan, OperationId, Requirement, Span, Task, Test};
use sesame_record::{Difference, Verdict, differences, verdict};
use sesame_relay::wire::WireTable;
use sesame_report::CLOSING_RUN_DIFFERS as CLOSING;

/// Why an operation cannot have an effect, as far as the reference run shows.
#[derive(Debug, Clone, PartialEq)]
pub enum Ineffective {
    /// Nothing in the system receives its topic, or some of its members.
    NoReceiver {
        /// The operation.
        operation: String,
        /// Its topics.
        topics: Vec<String>,
        /// The wires without a receiver.
        paths: Vec<String>,
        /// How many wires the topics have.
        of: usize,
    },
    /// Its topics have no message at the times at which it may be active.
    NoMessage {
        /// The operation.
        operation: String,
        /// Its topics.
        topics: Vec<String>,
        /// When it may be active.
        within: Span,
        /// The time of the nearest message; `None` without any.
        nearest: Option<f64>,
    },
}

impl Ineffective {
    /// Whether it cannot have an effect at all.
    pub(super) fn wholly(&self) -> bool {
        match self {
            Ineffective::NoReceiver { paths, of, .. } => paths.len() == *of,
            Ineffective::NoMessage { .. } => true,
        }
    }

    /// What to do about these, in one sentence without its full stop.
    pub(super) fn remedies(found: &[Ineffective]) -> String {
        let received = found.iter().any(|reason| matches!(reason, Ineffective::NoReceiver { .. })).then_some(
            "Disturb what the simulator subscribes to, let it subscribe to this topic, or read the topic by a metric with \
             `outbound`",
        );
        let reached = found.iter().any(|reason| matches!(reason, Ineffective::NoMessage { .. })).then_some(
            "Let `within` include a message of the reference run, where its start counts and its end does not",
        );
        received.into_iter().chain(reached).collect::<Vec<_>>().join(". ")
    }
}

impl fmt::Display for Ineffective {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Ineffective::NoReceiver { operation, topics, paths, .. } => {
                let named = quoted(paths);
                let (word, topics) = (if topics.len() == 1 { "topic" } else { "topics" }, quoted(topics));
                if self.wholly() {
                    write!(
                        f,
                        "nothing receives what operation `{operation}` disturbs: the simulator does not subscribe to its \
                         {word} {topics} ({named}), and no outbound metric and no monitor reads it"
                    )
                } else {
                    write!(
                        f,
                        "nothing receives what operation `{operation}` disturbs on {named}: of {word} {topics}, the \
                         simulator subscribes to other paths only"
                    )
                }
            }
            Ineffective::NoMessage { operation, topics, within: Span { start, end }, nearest } => {
                let (has, it) = if topics.len() == 1 { ("has", "it has") } else { ("have", "they have") };
                write!(
                    f,
                    "operation `{operation}` cannot act: in the reference run, {} {has} no message from {start} s to \
                     {end} s, the only time at which the operation may be active",
                    quoted(topics)
                )?;
                match nearest {
                    Some(time) => write!(f, "; the nearest message is at {time} s"),
                    None => write!(f, "; {it} no message at all"),
                }
            }
        }
    }
}

/// Names in a sentence: `` `scan`, `odom` ``.
fn quoted(names: &[String]) -> String {
    names.iter().map(|name| format!("`{name}`")).collect::<Vec<_>>().join(", ")
}

/// The operations that tests of this campaign may hold and that cannot have an effect, wholly or in part, as far as its
/// reference run shows: their messages had no receiver, or there were none.
pub(super) fn ineffective(plan: &CampaignPlan, task: &Task, reference: &Observation) -> Vec<Ineffective> {
    let of_test = |test: &Test| -> Vec<OperationId> { test.operations.iter().map(|used| used.operation).collect() };
    let operations: BTreeSet<OperationId> = match (task, task.repeated(plan)) {
        (_, Some(repeated)) => of_test(repeated.test).into_iter().collect(),
        (Task::Known { tests, .. }, _) => tests.iter().flat_map(|&id| of_test(&plan.test(id).test)).collect(),
        (Task::Shrink(_) | Task::ShrinkEach { .. }, _) => {
            task.shrinkings().iter().flat_map(|shrinking| of_test(&shrinking.test)).collect()
        }
        (Task::Variations(variations), _) => variations.tests.iter().flat_map(of_test).collect(),
        (Task::Undisturbed(_), _) => BTreeSet::new(),
        (Task::Lab(lab) | Task::Compensated(lab), _) => {
            lab.tests.iter().flat_map(|selected| of_test(&selected.test)).collect()
        }
        (Task::Campaign | Task::Repeat { .. }, _) => plan.campaign.operations.iter().copied().collect(),
    };
    let wires = WireTable::new(plan);
    let found = operations.into_iter().filter_map(|id| {
        let operation = plan.operation(id);
        let topics: Vec<String> = operation.topics().map(|topic| plan.topic(topic).name.clone()).collect();
        if let Some(unreached) = reference.unreached.iter().find(|unreached| unreached.operation == id) {
            return Some(Ineffective::NoMessage {
                operation: operation.name.clone(),
                topics,
                within: operation.within,
                nearest: unreached.nearest,
            });
        }
        let acted_on: Vec<&str> = wires.acted_on(operation).map(|wire| wires.path(wire)).collect();
        let of = acted_on.len();
        let paths = acted_on.into_iter().filter(|path| reference.unheard.iter().any(|unheard| unheard == path));
        let paths: Vec<String> = paths.map(str::to_owned).collect();
        let operation = operation.name.clone();
        (!paths.is_empty()).then_some(Ineffective::NoReceiver { operation, topics, paths, of })
    });
    found.collect()
}

/// Whether a run violates a requirement.
pub(super) fn violates(plan: &CampaignPlan, observation: &Observation) -> bool {
    plan.requirements.iter().any(|requirement| {
        let value = observation.value(requirement.metric);
        verdict(requirement.bound, &observation.outcome, value) == Verdict::Violated
    })
}

/// The requirements that the system violates without any disturbance, each in a sentence.
pub(super) fn violations(plan: &CampaignPlan, reference: &Observation) -> Vec<String> {
    let violated = plan.requirements.iter().filter_map(|requirement| {
        let value = reference.value(requirement.metric);
        (verdict(requirement.bound, &reference.outcome, value) == Verdict::Violated).then(|| {
            let name = &plan.metric(requirement.metric).name;
            let value = value.value.map_or_else(|| "no value".to_owned(), |value| value.to_string());
            format!("requirement {} is violated before anything is fuzzed: `{name}` is {value}", requirement.name)
        })
    });
    violated.collect()
}

/// What the reference run after a campaign differs in from the one before it, in a sentence. In a system that is
/// stepped, equal seeds must give equal runs. In one that runs freely, the same topics must speak about as often, and
/// the verdicts must be the same.
pub(super) fn difference(
    plan: &CampaignPlan,
    lock_stepped: bool,
    first: &Observation,
    last: &Observation,
) -> Option<String> {
    if lock_stepped {
        let differing = differences(plan, &Test::default(), first, last);
        return differing.first().map(|Difference { what, before, after }| {
            format!("{CLOSING} {what} was {before} and is {after}; the simulator does not start afresh for each test")
        });
    }
    let other = of_verdicts(plan, first, last).or_else(|| of_traffic(plan, first, last))?;
    Some(format!("{CLOSING} {other}; what the tests in between showed may be of a system that no longer works"))
}

/// A verdict that is no longer what it was.
fn of_verdicts(plan: &CampaignPlan, first: &Observation, last: &Observation) -> Option<String> {
    if first.outcome != last.outcome {
        return Some(format!("the outcome was {} and is {}", first.outcome.word(), last.outcome.word()));
    }
    let word = |run: &Observation, requirement: &Requirement| {
        verdict(requirement.bound, &run.outcome, run.value(requirement.metric)).word()
    };
    plan.requirements.iter().find_map(|requirement| {
        let (before, after) = (word(first, requirement), word(last, requirement));
        (before != after).then(|| format!("requirement {} was {before} and is {after}", requirement.name))
    })
}

/// A wire that was silent, began to speak, or spoke less than half as often or more than twice as often as before.
fn of_traffic(plan: &CampaignPlan, first: &Observation, last: &Observation) -> Option<String> {
    let heard = |run: &Observation, wire: u32| {
        run.traffic.iter().find(|traffic| traffic.wire == wire).map_or(0, |traffic| traffic.messages)
    };
    (0..).zip(wires(plan)).find_map(|(wire, PlannedWire { path, .. })| {
        let (before, after) = (heard(first, wire), heard(last, wire));
        // With few messages, half as many are chance.
        let (less, more) = (before.min(after), before.max(after));
        (more >= FEWEST && 2 * less < more)
            .then(|| format!("the number of messages on `{path}` was {before} and is {after}"))
    })
}

/// How many messages a wire must have in one of two runs for their numbers to be compared.
const FEWEST: u64 = 10;

#[cfg(test)]
mod tests {
    use sesame_base::observation::{Outcome, Reach, Traffic, Unreached};
    use sesame_record::sample;

    use super::*;
    use crate::campaign::error::CampaignError;

    #[test]
    fn an_operation_without_a_receiver_is_named_and_a_group_has_one_if_a_member_has() {
        let plan = sample::plan();
        let heard = |unheard: &[&str]| {
            let mut reference = sample::observe(&plan, &Test::default(), 1);
            reference.unheard = unheard.iter().map(|&path| path.to_owned()).collect();
            super::ineffective(&plan, &Task::Campaign, &reference)
        };
        assert_eq!(heard(&[]), []);
        let operation = plan.operation(plan.campaign.operations[0]);
        let topic = plan.topic(operation.topic.unwrap());
        let paths: Vec<&str> = topic.paths.iter().map(String::as_str).collect();
        let found = heard(&paths);
        assert!(found[0].wholly());
        let message = CampaignError::Ineffective(found.clone()).to_string();
        for part in [&operation.name, &topic.name, &topic.paths[0], "--allow-unheard"] {
            assert!(message.contains(part), "{message}");
        }
        let Ineffective::NoReceiver { operation, topics, paths, of } = found[0].clone() else { unreachable!() };
        let partly = Ineffective::NoReceiver { operation, topics, paths, of: of + 1 };
        assert!(!partly.wholly() && partly.to_string().contains("other paths only"));
        let known = Task::Known { tests: Vec::new(), lab: None };
        let mut reference = sample::observe(&plan, &Test::default(), 1);
        reference.unheard = topic.paths.clone();
        assert_eq!(super::ineffective(&plan, &known, &reference), [], "only what is to be run counts");
    }

    #[test]
    fn an_operation_that_may_act_only_when_there_is_nothing_to_disturb_is_named_with_the_nearest_message() {
        let mut plan = sample::plan();
        let id = plan.campaign.operations[0];
        plan.operations[id.index()].within = Span { start: 0.0, end: 0.05 };
        let mut reference = sample::observe(&plan, &Test::default(), 1);
        let mut said = |nearest| {
            reference.unreached = vec![Unreached { operation: id, nearest }];
            let found = super::ineffective(&plan, &Task::Campaign, &reference);
            assert!(found[0].wholly());
            CampaignError::Ineffective(found).to_string()
        };
        let late = said(Some(0.05));
        assert!(late.contains("has no message from 0 s to 0.05 s, the only time"), "{late}");
        assert!(late.contains("the nearest message is at 0.05 s") && late.contains("Let `within` include"), "{late}");
        assert!(!late.contains("subscribes to"), "{late}");
        assert!(said(None).contains("it has no message at all"));
    }

    #[test]
    fn of_a_system_that_runs_freely_the_last_reference_run_must_hear_and_decide_the_same() {
        let plan = sample::plan();
        let traffic = |wire: u32, messages: u64| Traffic {
            wire,
            messages,
            first: 0.0,
            last: 70.0,
            gap: Span { start: 0.0, end: 0.1 },
            median_gap: 0.1,
        };
        let mut first = sample::observe(&plan, &Test::default(), 1);
        first.traffic = vec![traffic(0, 100), traffic(1, 6)];
        let said = |change: &dyn Fn(&mut Observation)| {
            let mut last = first.clone();
            change(&mut last);
            difference(&plan, false, &first, &last)
        };
        assert_eq!(said(&|_| {}), None);
        assert_eq!(said(&|last| last.traffic[0].messages = 60), None, "chance makes such differences");
        assert_eq!(said(&|last| last.traffic[1].messages = 2), None, "and few messages are no number");
        let silent = said(&|last| last.traffic.retain(|traffic| traffic.wire != 0)).unwrap();
        let path = &plan.topics[0].paths[0];
        assert!(silent.contains(&format!("the number of messages on `{path}` was 100 and is 0")), "{silent}");
        assert!(said(&|last| last.traffic[0].messages = 201).is_some());
        let gone = said(&|last| last.outcome = Outcome::Disconnect { message: "gone".to_owned() }).unwrap();
        assert!(gone.contains("the outcome was completed and is disconnect"), "{gone}");
        let metric = plan.requirements[0].metric.index();
        let other = said(&|last| last.metrics[metric].reach = Reach::ANY).unwrap();
        assert!(other.contains("requirement R1 was ") && other.contains(" and is inconclusive"), "{other}");
    }
}
