//! The monitor as a guest in a system on a bus.

use std::process::ExitCode;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

use sesame_base::gathered::gathered;
use sesame_base::observation::Outcome;
use sesame_base::time::SimTime;
use sesame_base::visible::visible;
use sesame_plan::{CampaignPlan, Test};
use sesame_relay::evaluate::{Custom, Run, evaluate_tapped};
use sesame_relay::metric::MetricTable;
use sesame_relay::monitor::Decided;
use sesame_relay::panic_capture;
use sesame_relay::relay::{Exchange, Listener};
use sesame_relay::simulator::Progress;
use sesame_relay::transport::{Capabilities, Connect, Incidents, Transport, TransportError};
use sesame_relay::value::Value;
use sesame_relay::wire::{Wire, WireTable};

use crate::output::{Failure, say};
use crate::standalone::show::Shown;

/// How often it is asked whether there is something to note.
const NOTES: Duration = Duration::from_secs(1);

pub(super) fn run(plan: &CampaignPlan, connect: &Connect, shown: &mut Shown<'_>) -> Result<ExitCode, Failure> {
    panic_capture::install();
    let [asked_to_stop, running] = [(); 2].map(|()| Arc::new(AtomicBool::new(false)));
    let (asked, is_running) = (Arc::clone(&asked_to_stop), Arc::clone(&running));
    ctrlc::set_handler(move || {
        // While the system is awaited, and when the monitor does not end in good order, nothing is left to be done.
        if asked.swap(true, Ordering::Relaxed) || !is_running.load(Ordering::Relaxed) {
            std::process::exit(0);
        }
    })?;
    let wires = WireTable::new(plan);
    let table = MetricTable::new(plan, &wires, &[])?;
    let transport = connect.transport(plan);
    let mut transport = UntilStopped { transport, asked_to_stop, running, noted: Instant::now() };
    let mut told = Told { shown, asked_to_stop: Arc::clone(&transport.asked_to_stop), failure: None };
    let test = Test { operations: Vec::new() };
    let run = Run::of(&test);
    let ended = evaluate_tapped(plan, &wires, &table, &mut transport, &run, &mut Custom::none(), Some(&mut told))?;
    transport.note();
    transport.close();
    if let Some(failure) = told.failure {
        return Err(failure);
    }
    for warning in gathered(&ended.warnings) {
        say(format_args!("warning: {}", visible(&warning)));
    }
    match ended.outcome {
        Outcome::Completed | Outcome::NoEffect | Outcome::Unknown => Ok(ExitCode::SUCCESS),
        Outcome::Crash { message }
        | Outcome::LaunchFailed { message }
        | Outcome::Disconnect { message }
        | Outcome::WrongClock { message } => Err(Failure(message)),
        Outcome::Timeout { limit } => Err(Failure(format!("nothing was heard for {limit} s"))),
    }
}

/// Shows decisions as they are made.
struct Told<'s, 'p> {
    shown: &'s mut Shown<'p>,
    asked_to_stop: Arc<AtomicBool>,
    /// The first decision that could not be shown ends the monitor: nobody would know of others.
    failure: Option<Failure>,
}

impl Listener for Told<'_, '_> {
    fn published(&mut self, _: SimTime, _: Wire, _: u64, _: &Value) {}
    fn delivered(&mut self, _: SimTime, _: Wire, _: u64, _: &Value) {}
    fn decided(&mut self, decided: &Decided) {
        if self.failure.is_none()
            && let Err(failure) = self.shown.decided(None, decided)
        {
            self.failure = Some(failure);
            self.asked_to_stop.store(true, Ordering::Relaxed);
        }
    }
}

/// A transport whose run ends when the user says so.
struct UntilStopped {
    transport: Box<dyn Transport>,
    asked_to_stop: Arc<AtomicBool>,
    /// Set when the system was found.
    running: Arc<AtomicBool>,
    noted: Instant,
}

impl UntilStopped {
    fn note(&mut self) {
        self.noted = Instant::now();
        for note in gathered(self.transport.incidents().notes) {
            say(format_args!("note: {}", visible(&note)));
        }
    }
}

impl Transport for UntilStopped {
    fn capabilities(&self) -> Capabilities {
        self.transport.capabilities()
    }

    fn reset(&mut self, seed: u64, relay: &mut dyn Exchange) -> Result<(), TransportError> {
        self.transport.reset(seed, relay)?;
        self.running.store(true, Ordering::Relaxed);
        Ok(())
    }

    fn advance(&mut self, until: SimTime, relay: &mut dyn Exchange) -> Result<Progress, TransportError> {
        if self.noted.elapsed() >= NOTES {
            self.note();
        }
        if self.asked_to_stop.load(Ordering::Relaxed) {
            return Ok(Progress::Ended);
        }
        self.transport.advance(until, relay)
    }

    fn now(&self) -> SimTime {
        self.transport.now()
    }

    fn close(&mut self) {
        self.transport.close();
    }

    fn incidents(&mut self) -> Incidents {
        self.transport.incidents()
    }
}
