//! The run of one test: relay, metrics and transport put together.

use std::panic::{self, AssertUnwindSafe};
use std::time::Instant;

use sesame_base::observation::{Observation, Outcome, WallTime};
use sesame_base::time::SimTime;
use sesame_plan::condition::Condition;
use sesame_plan::{CampaignPlan, Moment, MonitorId, Test};

use crate::files::{NoFiles, SpaceFiles};
use crate::fuzz::{ChoiceError, OperationEntry};
use crate::metric::MetricTable;
use crate::panic_capture;
use crate::relay::{AlteredList, Listener, Relay};
use crate::simulator::Progress;
use crate::transport::{Fault, Transport, TransportError};
use crate::wire::WireTable;

/// Why a run in which nobody spoke is none.
const NOTHING_HEARD: &str =
    "nothing was heard: no message came on any topic of the space from the beginning of the run to its end";

/// Runs a test and returns what was observed. If the simulator fails, or the simulator or a hook panics, this is an
/// observation too, with everything seen until then; only a test that does not match the plan is an error. After a
/// crash the transport is in an unknown state and must not be used again.
///
/// Files that operations of the test changed are restored; if that fails, the run counts as a crash.
pub fn evaluate(
    plan: &CampaignPlan,
    wires: &WireTable,
    metrics: &MetricTable<'_>,
    transport: &mut dyn Transport,
    test: &Test,
    simulator_seed: u64,
    custom: &mut Custom<'_>,
) -> Result<Observation, ChoiceError> {
    evaluate_tapped(plan, wires, metrics, transport, &Run { simulator_seed, ..Run::of(test) }, custom, None)
}

/// The input of a run.
#[derive(Debug, Clone, Copy)]
pub struct Run<'a> {
    /// The test.
    pub test: &'a Test,
    /// The seed of everything random in the simulator.
    pub simulator_seed: u64,
    /// Monitors whose mitigation is not sent.
    pub withheld: &'a [MonitorId],
    /// Whether the messages that operations alter are listed.
    pub lists_altered: bool,
}

impl<'a> Run<'a> {
    /// A run of a test with the simulator's seed 0, in which monitors mitigate and no messages are listed.
    pub fn of(test: &'a Test) -> Run<'a> {
        Run { test, simulator_seed: 0, withheld: &[], lists_altered: false }
    }
}

/// As [`evaluate`], with a listener besides the metrics.
pub fn evaluate_tapped(
    plan: &CampaignPlan,
    wires: &WireTable,
    metrics: &MetricTable<'_>,
    transport: &mut dyn Transport,
    &Run { test, simulator_seed, withheld, lists_altered }: &Run<'_>,
    custom: &mut Custom<'_>,
    tap: Option<&mut dyn Listener>,
) -> Result<Observation, ChoiceError> {
    #[expect(clippy::disallowed_methods, reason = "how long a run took is recorded, and decides nothing")]
    let started = Instant::now();
    let mut altered = lists_altered.then(|| AlteredList::new(plan, wires, test));
    let relay = Relay::new(plan, wires, test, metrics.start(), custom.hooks)?;
    let mut relay = relay.compensated(plan, test, simulator_seed).withholding(withheld);
    if let Some(tap) = tap {
        relay = relay.tapped(tap);
    }
    if let Some(altered) = &mut altered {
        relay = relay.tapped(altered);
    }
    let until = (SimTime::from_seconds(plan.campaign.end_after), plan.campaign.end_when.as_ref());
    let files = custom.files.as_mut();
    let driven = AssertUnwindSafe(|| drive(transport, &mut relay, simulator_seed, until, files));
    let mut failure = match panic::catch_unwind(driven) {
        Ok(driven) => driven.err(),
        Err(_) => Some(Failure::crash(panic_capture::take())),
    };
    if plan.operations.iter().any(|operation| operation.kind.calls_code_outside_the_run())
        && let Err(error) = custom.files.restore()
    {
        failure.get_or_insert_with(|| Failure::crash(error.to_string()));
    }
    let end = transport.now();
    let finished = relay.finish(end);
    let silent = finished.traffic.is_empty() && wires.iter().next().is_some();
    let effect = finished.operations.iter().any(|operation| operation.counters.any_effect());
    let outcome = match failure {
        Some(Failure { fault, message }) => outcome(fault, message),
        // A system that is stepped says by its steps that it is there.
        None if silent && !transport.capabilities().lock_stepped => {
            outcome(Fault::Disconnect, NOTHING_HEARD.to_owned())
        }
        None if test.operations.is_empty() || effect => Outcome::Completed,
        None => Outcome::NoEffect,
    };
    let ended = matches!(outcome, Outcome::Completed | Outcome::NoEffect);
    Ok(Observation {
        outcome,
        end: end.seconds(),
        operations: finished.operations,
        // A run that broke off may have been about to subscribe.
        unheard: if ended { finished.unheard } else { Vec::new() },
        unreached: if ended { finished.unreached } else { Vec::new() },
        traffic: finished.traffic,
        course: finished.course,
        altered: altered.map(AlteredList::listed),
        metrics: finished.metrics,
        monitors: finished.monitors,
        messages: finished.messages,
        warnings: finished.warnings,
        wall: WallTime { run: started.elapsed().as_secs_f64() },
    })
}

/// What custom operations need: the user's code, and the files that they may change.
#[derive(Debug)]
pub struct Custom<'h> {
    /// The hooks of the runner.
    pub hooks: &'h [OperationEntry],
    /// The files of the space.
    pub files: Box<dyn SpaceFiles>,
}

impl Custom<'static> {
    /// For plans without custom operations.
    pub fn none() -> Self {
        Custom { hooks: &[], files: Box::new(NoFiles) }
    }
}

/// Why a run broke off.
struct Failure {
    fault: Fault,
    message: String,
}

impl Failure {
    fn crash(message: String) -> Self {
        Failure { fault: Fault::Crash, message }
    }
}

impl From<TransportError> for Failure {
    fn from(error: TransportError) -> Self {
        Failure { fault: error.fault(), message: error.to_string() }
    }
}

fn outcome(fault: Fault, message: String) -> Outcome {
    let message = Outcome::message_of(message);
    match fault {
        Fault::Crash => Outcome::Crash { message },
        Fault::Timeout { limit } => Outcome::Timeout { limit },
        Fault::LaunchFailed => Outcome::LaunchFailed { message },
        Fault::Disconnect => Outcome::Disconnect { message },
        Fault::WrongClock => Outcome::WrongClock { message },
    }
}

/// The error gives the reason.
fn drive(
    transport: &mut dyn Transport,
    relay: &mut Relay<'_>,
    seed: u64,
    (end, when): (SimTime, Option<&Condition>),
    files: &mut dyn SpaceFiles,
) -> Result<(), Failure> {
    relay.before_or_after_run(Moment::BeforeStart, files).map_err(Failure::crash)?;
    relay.begin();
    transport.reset(seed, relay)?;
    // What comes at the end of an instant is known when the next one begins, so the condition is weighed between steps.
    let is_over = |relay: &Relay<'_>| when.is_some_and(|condition| relay.holds(condition));
    while transport.advance(end, relay)? == Progress::Running && !is_over(relay) {}
    transport.ended()?;
    relay.end(transport.now());
    relay.before_or_after_run(Moment::AfterEnd, files).map_err(Failure::crash)
}

#[cfg(test)]
mod tests {
    use sesame_plan::condition::{Comparison, Operand};
    use sesame_plan::testing::{operation, plan, test_of, use_of};
    use sesame_plan::{MetricId, MetricSource, OperationKind, Span, TopicId};

    use super::*;
    use crate::metric::{Context, Hook, HookEntry};
    use crate::relay::Exchange;
    use crate::transport::Capabilities;
    use crate::value::Value;

    /// Publishes its time on `arm/command` every tenth of a second, and fails at some time if told to.
    struct Ticker {
        now: SimTime,
        fails_at: Option<f64>,
        error: TransportError,
    }

    impl Transport for Ticker {
        fn capabilities(&self) -> Capabilities {
            Capabilities { lock_stepped: true, resets: true }
        }
        fn reset(&mut self, _: u64, relay: &mut dyn Exchange) -> Result<(), TransportError> {
            self.now = SimTime::ZERO;
            relay.subscribed(relay.wires().find("arm/command").unwrap());
            Ok(())
        }
        fn advance(&mut self, until: SimTime, relay: &mut dyn Exchange) -> Result<Progress, TransportError> {
            if self.now >= until {
                return Ok(Progress::Ended);
            }
            self.now = self.now + SimTime::from_seconds(0.1);
            if self.fails_at.is_some_and(|time| self.now.seconds() >= time) {
                return Err(self.error.clone());
            }
            let wire = relay.wires().find("arm/command").unwrap();
            relay.advance(self.now, &mut Vec::new());
            relay.message(self.now, wire, Value::Real(self.now.seconds()), &mut Vec::new());
            Ok(Progress::Running)
        }
        fn now(&self) -> SimTime {
            self.now
        }
        fn close(&mut self) {}
    }

    fn ticker(fails_at: Option<f64>) -> Ticker {
        Ticker { now: SimTime::ZERO, fails_at, error: TransportError::Simulator("out of breath".to_owned()) }
    }

    /// Counts messages, panics at five seconds, and has an opinion on the end.
    struct Counter {
        panics: bool,
    }

    impl Hook for Counter {
        fn on_start(&mut self, _: &mut Context) {}
        fn on_message(&mut self, _: usize, _: &Value, ctx: &mut Context) {
            assert!(!self.panics || ctx.now() < 5.0, "five seconds are too much");
            ctx.add(1.0);
        }
        fn on_end(&mut self, ctx: &mut Context) {
            ctx.add(1000.0);
        }
    }

    /// A stub as the generator writes it.
    struct Stub;

    impl Hook for Stub {
        fn on_start(&mut self, _: &mut Context) {}
        fn on_message(&mut self, _: usize, _: &Value, ctx: &mut Context) {
            ctx.unimplemented();
        }
        fn on_end(&mut self, _: &mut Context) {}
    }

    /// A run with a blackhole from one to two seconds and a third metric with this hook, default 7.
    fn observed(build: fn(&str) -> Box<dyn Hook>, fails_at: Option<f64>) -> Observation {
        let mut plan = plan(vec![operation(0, OperationKind::Blackhole)]);
        let mut counted = plan.metrics[1].clone();
        "counted".clone_into(&mut counted.name);
        counted.default = Some(7.0);
        counted.source = MetricSource::Hook { topics: vec![TopicId(0)] };
        plan.metrics.push(counted);
        let wires = WireTable::new(&plan);
        let metrics = MetricTable::new(&plan, &wires, &[HookEntry { metric: "counted", build }]).unwrap();
        let test = test_of(vec![use_of(0, 1.0, 2.0, vec![], 1)]);
        let mut ticker = ticker(fails_at);
        evaluate(&plan, &wires, &metrics, &mut ticker, &test, 1, &mut Custom::none()).unwrap()
    }

    #[test]
    fn a_run_to_its_end_is_complete() {
        let run = observed(|_| Box::new(Counter { panics: false }), None);
        assert_eq!((run.outcome, run.end, run.messages), (Outcome::Completed, 10.0, 100));
        assert_eq!(run.metrics[2].value, Some(1100.0), "a hundred messages, and the end");
        assert_eq!(run.operations[0].counters.dropped, 10);
    }

    #[test]
    fn a_run_ends_after_the_step_in_which_its_condition_begins_to_hold() {
        let mut plan = plan(vec![operation(0, OperationKind::Blackhole)]);
        let (fuzzing_time, by) = (Operand::Variable(MetricId(0)), Comparison::Above);
        plan.campaign.end_when = Some(Condition::Compare { left: fuzzing_time, by, right: Operand::Number(0.5) });
        let wires = WireTable::new(&plan);
        let metrics = MetricTable::new(&plan, &wires, &[]).unwrap();
        let ended = |test: &Test| {
            let mut ticker = ticker(None);
            evaluate(&plan, &wires, &metrics, &mut ticker, test, 1, &mut Custom::none()).unwrap()
        };
        let disturbed = ended(&test_of(vec![use_of(0, 1.0, 2.0, vec![], 1)]));
        assert_eq!((disturbed.outcome, disturbed.end, disturbed.messages), (Outcome::Completed, 1.6, 16));
        assert_eq!(disturbed.operations[0].intervals, [Span { start: 1.0, end: 1.6 }]);
        let reference = ended(&test_of(vec![]));
        assert_eq!((reference.outcome, reference.end), (Outcome::Completed, 10.0));
    }

    #[test]
    fn a_run_of_a_passive_campaign_is_complete_and_not_void() {
        let plan = plan(vec![operation(0, OperationKind::Blackhole)]);
        let wires = WireTable::new(&plan);
        let metrics = MetricTable::new(&plan, &wires, &[]).unwrap();
        let mut ticker = ticker(None);
        let run = evaluate(&plan, &wires, &metrics, &mut ticker, &test_of(vec![]), 1, &mut Custom::none()).unwrap();
        assert_eq!((run.outcome, run.messages), (Outcome::Completed, 100));
        assert_eq!((run.operations.len(), run.metrics[0].value), (0, Some(0.0)));
    }

    #[test]
    fn what_was_seen_before_a_hook_panics_stands() {
        let run = observed(|_| Box::new(Counter { panics: true }), None);
        assert!(matches!(&run.outcome, Outcome::Crash { .. }), "{:?}", run.outcome);
        assert_eq!(run.end, 5.0);
        assert_eq!(run.metrics[2].value, Some(49.0), "and nobody is told of an end");
        assert_eq!(run.metrics[0].value, Some(1.0), "fuzzing time");
        assert_eq!(run.operations[0].counters.dropped, 10);
    }

    #[test]
    fn what_was_seen_before_a_simulator_fails_stands() {
        let run = observed(|_| Box::new(Counter { panics: false }), Some(3.0));
        assert_eq!(run.outcome, Outcome::Crash { message: "the simulator failed: out of breath".to_owned() });
        assert_eq!((run.end, run.metrics[2].value), (3.0, Some(29.0)));
    }

    #[test]
    fn how_a_run_broke_off_is_told_apart() {
        let plan = plan(vec![operation(0, OperationKind::Blackhole)]);
        let wires = WireTable::new(&plan);
        let metrics = MetricTable::new(&plan, &wires, &[]).unwrap();
        let second = SimTime::from_seconds;
        let ended = |error: TransportError| {
            let mut ticker = Ticker { error, ..ticker(Some(3.0)) };
            let run = evaluate(&plan, &wires, &metrics, &mut ticker, &test_of(vec![]), 1, &mut Custom::none()).unwrap();
            (run.outcome, run.end)
        };
        let text = str::to_owned;
        let lost = TransportError::ConnectionLost { to: text("the bridge"), how: text("it closed") };
        let message = text("the connection to the bridge was lost: it closed");
        assert_eq!(ended(lost), (Outcome::Disconnect { message }, 3.0));
        let back = TransportError::ClockBack { from: second(2.0), to: second(1.5) };
        let message = text("the clock of the simulator went back, from 2.000 s to 1.500 s");
        assert_eq!(ended(back), (Outcome::WrongClock { message }, 3.0));
        let silent = TransportError::Silent { awaited: text("the clock"), limit: 20.0 };
        assert_eq!(ended(silent), (Outcome::Timeout { limit: 20.0 }, 3.0));
        #[cfg(feature = "process")]
        {
            use sesame_lifecycle::launch::LaunchError::{Ended, Failed};
            let (what, last_lines) = (text("`x`"), text("a"));
            let failed = Failed { what: what.clone(), problem: text("hangs"), last_lines };
            let message = text("the launch failed: `x` hangs; the last lines that it wrote:\na");
            assert_eq!(ended(failed.into()), (Outcome::LaunchFailed { message }, 3.0));
            let gone = Ended { what, how: text("ended"), last_lines: String::new() };
            assert_eq!(ended(gone.into()), (Outcome::Crash { message: text("`x` ended") }, 3.0));
        }
    }

    #[test]
    fn a_hook_that_is_not_filled_in_has_no_value_not_even_its_default() {
        let run = observed(|_| Box::new(Stub), None);
        assert_eq!((run.metrics[2].value, run.metrics[2].set), (None, false));
    }
}
