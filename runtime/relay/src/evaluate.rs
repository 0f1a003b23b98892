//! One test, one run: relay, metrics and transport put together.

use std::panic::{self, AssertUnwindSafe};
use std::time::Instant;

use sesame_base::observation::{Observation, Outcome, WallTime};
use sesame_base::time::SimTime;
use sesame_plan::{CampaignPlan, Moment, Test};

use crate::changed_files::ChangedFiles;
use crate::fuzz::{ChoiceError, OperationEntry};
use crate::metric::MetricTable;
use crate::panic_capture as last_panic;
use crate::relay::{Relay, Tap};
use crate::simulator::Progress;
use crate::transport::{Transport, TransportError};
use crate::wire::WireTable;

/// Runs a test and reports what was observed. A simulator that fails, or a panic in it or in a hook, is an observation
/// too, with what was seen until then; only a test that does not fit the plan is an error. After a crash the transport
/// is in an unknown state and must not be used again.
///
/// Files that operations of the test changed are put back; where that fails, the run counts as a crash.
pub fn evaluate(
    plan: &CampaignPlan,
    wires: &WireTable,
    metrics: &MetricTable<'_>,
    transport: &mut dyn Transport,
    test: &Test,
    simulator_seed: u64,
    custom: &mut Custom<'_>,
) -> Result<Observation, ChoiceError> {
    evaluate_tapped(plan, wires, metrics, transport, &Run { test, simulator_seed }, custom, None)
}

/// What is run.
#[derive(Debug, Clone, Copy)]
pub struct Run<'a> {
    /// The test.
    pub test: &'a Test,
    /// The seed of everything random in the simulator.
    pub simulator_seed: u64,
}

/// As [`evaluate`], telling a tap what happens.
pub fn evaluate_tapped(
    plan: &CampaignPlan,
    wires: &WireTable,
    metrics: &MetricTable<'_>,
    transport: &mut dyn Transport,
    &Run { test, simulator_seed }: &Run<'_>,
    custom: &mut Custom<'_>,
    tap: Option<&mut dyn Tap>,
) -> Result<Observation, ChoiceError> {
    let started = Instant::now();
    let mut relay = Relay::new(plan, wires, test, metrics.start(), custom.hooks)?;
    if let Some(tap) = tap {
        relay = relay.tapped(tap);
    }
    let until = SimTime::from_seconds(plan.campaign.end_after);
    let files = &mut custom.files;
    let driven = AssertUnwindSafe(|| drive(transport, &mut relay, simulator_seed, until, files));
    let mut failure = match panic::catch_unwind(driven) {
        Ok(driven) => driven.err(),
        Err(_) => Some(last_panic::take()),
    };
    if plan.operations.iter().any(|operation| operation.kind.is_offline())
        && let Err(error) = custom.files.put_back()
    {
        failure.get_or_insert_with(|| error.to_string());
    }
    let end = transport.now();
    let finished = relay.finish(end);
    let effect = finished.operations.iter().any(|operation| operation.counters.any_effect());
    let outcome = match failure {
        Some(message) => Outcome::crash(message),
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
        metrics: finished.metrics,
        messages: finished.messages,
        warnings: finished.warnings,
        wall: WallTime { run: started.elapsed().as_secs_f64() },
    })
}

/// What custom operations need: the user's code and the files it may change.
#[derive(Debug)]
pub struct Custom<'h> {
    /// The hooks of the runner.
    pub hooks: &'h [OperationEntry],
    /// The files of the space.
    pub files: ChangedFiles,
}

impl Custom<'static> {
    /// For plans without custom operations.
    pub fn none() -> Self {
        Custom { hooks: &[], files: ChangedFiles::unlocked(std::path::Path::new(".")) }
    }
}

/// The error says what failed.
fn drive(
    transport: &mut dyn Transport,
    relay: &mut Relay<'_>,
    seed: u64,
    end: SimTime,
    files: &mut ChangedFiles,
) -> Result<(), String> {
    let words = |error: TransportError| error.to_string();
    relay.beside_run(Moment::BeforeStart, files)?;
    relay.begin();
    transport.reset(seed, relay).map_err(words)?;
    while transport.advance(end, relay).map_err(words)? == Progress::Running {}
    relay.end(transport.now());
    relay.beside_run(Moment::AfterEnd, files)
}

#[cfg(test)]
mod tests {
    use sesame_plan::testing::{operation, plan, test_of, use_of};
    use sesame_plan::{MetricSource, OperationKind, TopicId};

    use super::*;
    use crate::metric::{Context, Hook, HookEntry};
    use crate::relay::Exchange;
    use crate::transport::Capabilities;
    use crate::value::Value;

    /// Publishes its time on `arm/command` every tenth of a second, and fails at some time if told to.
    struct Ticker {
        now: SimTime,
        fails_at: Option<f64>,
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
                return Err(TransportError::Simulator("out of breath".to_owned()));
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
    fn observed(build: fn() -> Box<dyn Hook>, fails_at: Option<f64>) -> Observation {
        let mut plan = plan(vec![operation(0, OperationKind::Blackhole)]);
        let mut counted = plan.metrics[1].clone();
        "counted".clone_into(&mut counted.name);
        counted.default = Some(7.0);
        counted.source = MetricSource::Hook { topics: vec![TopicId(0)] };
        plan.metrics.push(counted);
        let wires = WireTable::new(&plan);
        let metrics = MetricTable::new(&plan, &wires, &[HookEntry { metric: "counted", build }]).unwrap();
        let test = test_of(vec![use_of(0, 1.0, 2.0, vec![], 1)]);
        evaluate(&plan, &wires, &metrics, &mut Ticker { now: SimTime::ZERO, fails_at }, &test, 1, &mut Custom::none())
            .unwrap()
    }

    #[test]
    fn a_run_to_its_end_is_complete() {
        let run = observed(|| Box::new(Counter { panics: false }), None);
        assert_eq!((run.outcome, run.end, run.messages), (Outcome::Completed, 10.0, 100));
        assert_eq!(run.metrics[2].value, Some(1100.0), "a hundred messages, and the end");
        assert_eq!(run.operations[0].counters.dropped, 10);
    }

    #[test]
    fn a_run_of_a_passive_campaign_is_complete_and_not_void() {
        let plan = plan(vec![operation(0, OperationKind::Blackhole)]);
        let wires = WireTable::new(&plan);
        let metrics = MetricTable::new(&plan, &wires, &[]).unwrap();
        let mut ticker = Ticker { now: SimTime::ZERO, fails_at: None };
        let run = evaluate(&plan, &wires, &metrics, &mut ticker, &test_of(vec![]), 1, &mut Custom::none()).unwrap();
        assert_eq!((run.outcome, run.messages), (Outcome::Completed, 100));
        assert_eq!((run.operations.len(), run.metrics[0].value), (0, Some(0.0)));
    }

    #[test]
    fn what_was_seen_before_a_hook_panics_stands() {
        let run = observed(|| Box::new(Counter { panics: true }), None);
        assert!(matches!(&run.outcome, Outcome::Crash { .. }), "{:?}", run.outcome);
        assert_eq!(run.end, 5.0);
        assert_eq!(run.metrics[2].value, Some(49.0), "and nobody is told of an end");
        assert_eq!(run.metrics[0].value, Some(1.0), "fuzzing time");
        assert_eq!(run.operations[0].counters.dropped, 10);
    }

    #[test]
    fn what_was_seen_before_a_simulator_fails_stands() {
        let run = observed(|| Box::new(Counter { panics: false }), Some(3.0));
        assert_eq!(run.outcome, Outcome::Crash { message: "the simulator failed: out of breath".to_owned() });
        assert_eq!((run.end, run.metrics[2].value), (3.0, Some(29.0)));
    }

    #[test]
    fn a_hook_that_is_not_filled_in_has_no_value_not_even_its_default() {
        let run = observed(|| Box::new(Stub), None);
        assert_eq!((run.metrics[2].value, run.metrics[2].set), (None, false));
    }
}
