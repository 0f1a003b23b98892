//! The commands of a runner, as a command line names them.

use std::path::Path;
use std::process::ExitCode;

use clap::Subcommand;
use sesame_plan::{CampaignPlan, Recorded};

use crate::campaign;
#[cfg(all(feature = "process", feature = "mcap"))]
use crate::cli::compensate;
use crate::cli::failure::Failure;
use crate::cli::session::Session;
use crate::cli::{
    confirm, explore, export, known, monitors, repeat, replay, replay_recording, report, run, shrink, twin, view,
};
#[cfg(feature = "process")]
use crate::cli::{mitm, null, physical, prepare};
#[cfg(feature = "process")]
use crate::runner::Runner;

/// What runs tests, or takes them from a recording.
#[derive(Debug, Subcommand)]
pub enum Running {
    /// Continue a run that was stopped, to the same results
    Resume(run::ResumeArgs),
    /// Run the regression tests and check their expectations
    Known(known::KnownArgs),
    /// Run one test several times, to see how much of its result is chance
    Repeat(repeat::RepeatArgs),
    /// Run recorded tests again with fresh simulator seeds, and report whether their findings recur
    Confirm(confirm::ConfirmArgs),
    /// Run variations of a recorded test along one dimension, to see where something begins and ends
    Explore(explore::ExploreArgs),
    /// Run recorded tests in a lab, and record the lab's results
    #[cfg(feature = "process")]
    Physical(physical::PhysicalArgs),
    /// Run the scenario without disturbance, in simulation and in a lab, and compare
    #[cfg(feature = "process")]
    Null(null::NullArgs),
    /// Let topics pass through the relay, one more in each stage, and measure what that adds and changes
    #[cfg(feature = "process")]
    Mitm(mitm::MitmArgs),
    /// Prepare a campaign: `null`, `mitm`, `known` and `monitors` in this order, up to the first that fails
    #[cfg(feature = "process")]
    Prepare(prepare::PrepareArgs),
    /// Fit the simulation to the recordings of a lab, and report how much smaller the reality gap becomes
    #[cfg(all(feature = "process", feature = "mcap"))]
    Compensate(compensate::CompensateArgs),
    /// Run a recorded test again unchanged, and report whether its result is the same, bit for bit
    Replay(replay::ReplayArgs),
    /// Reduce a failing test while it still fails in the same way: fewer operations, shorter, milder
    Shrink(shrink::ShrinkArgs),
    /// Feed a recording to the campaign's metrics, without a simulator
    ReplayRecording(replay_recording::ReplayRecordingArgs),
    /// Compare what the monitors decide on two recordings, and report how late messages may be
    Monitors(monitors::MonitorsArgs),
    /// Run a recorded test again without the mitigation of its monitors, and report what the mitigation was worth
    Twin(twin::TwinArgs),
}

/// What shows recorded results: it needs neither the runner nor its plan.
#[derive(Debug, Subcommand)]
pub enum Showing {
    /// Print a recorded test as a `test` block for the `.sesame` file
    Export(export::ExportArgs),
    /// Write the page again and print the findings, also of an unfinished run
    Report(report::ReportArgs),
    /// The causes of violations: for each requirement the smallest sets of operations with which tests violate it
    Causes(view::Which),
    /// List all tests of a run
    List(view::Which),
    /// Show one test in full: operations, effects, metrics, requirements
    Show {
        /// The test, for example `T158`
        test: String,
        /// Show the certificates of monitors at this moment, for example `12.3s`: the value of each part, and why each
        /// guarantee held or did not
        #[arg(long, value_name = "TIME", value_parser = view::moment)]
        at: Option<f64>,
        /// Which run, and how it is shown
        #[command(flatten)]
        which: view::Which,
    },
    /// Print the hash of a run's content: equal runs have equal digests
    Digest(view::Which),
}

/// What a runner starts of itself, which is nothing for users.
#[derive(Debug, Subcommand)]
pub enum Internal {
    /// Serve a supervisor; started by `run`
    #[command(hide = true)]
    Worker {
        /// The file with a plan, and with folders, in place of those that the program contains
        #[cfg(feature = "process")]
        #[arg(long, value_name = "FILE")]
        runner: Option<std::path::PathBuf>,
        /// The program that keeps the programs that it starts; by default its own
        #[cfg(feature = "process")]
        #[arg(long, value_name = "FILE")]
        keeper: Option<std::path::PathBuf>,
        /// The lab in which it runs tests, instead of the simulator
        #[cfg(feature = "process")]
        #[arg(long, value_name = "NAME")]
        lab: Option<String>,
        /// It may be asked for traces, also if the campaign records none
        #[arg(long)]
        record: bool,
        /// How many of the topics that operations can act on pass through the relay; by default all
        #[arg(long, value_name = "N")]
        relay: Option<u32>,
        /// Where the supervisor is
        #[command(flatten)]
        supervisor: campaign::Address,
    },
    /// Keep a program of a worker; started by `worker`
    #[cfg(all(feature = "process", target_os = "linux"))]
    #[command(hide = true)]
    Simulator {
        /// Process id of the worker
        worker: u32,
        /// The file that is told how the simulator ended
        report: std::path::PathBuf,
        /// It has no input of its own
        #[arg(long)]
        background: bool,
        /// The simulator's program with its arguments
        #[arg(required = true, last = true)]
        program: Vec<std::ffi::OsString>,
    },
    /// Become a simulator; started by `simulator`
    #[cfg(all(feature = "process", target_os = "linux"))]
    #[command(hide = true)]
    Simulated {
        /// Process id of the keeper
        keeper: u32,
        /// It has no input of its own
        #[arg(long)]
        background: bool,
        /// The simulator's program with its arguments
        #[arg(required = true, last = true)]
        program: Vec<std::ffi::OsString>,
    },
}

impl Running {
    /// Whether it only reads recordings, so that it reaches no simulator.
    pub fn only_reads(&self) -> bool {
        matches!(self, Running::ReplayRecording(_) | Running::Monitors(_))
    }

    pub(super) fn carry_out(&self, session: &Session) -> Result<ExitCode, Failure> {
        match self {
            Running::Resume(args) => run::resume(session, args),
            Running::Known(args) => known::known(session, args),
            Running::Repeat(args) => repeat::repeat(session, args),
            Running::Confirm(args) => confirm::confirm(session, args),
            Running::Explore(args) => explore::explore(session, args),
            #[cfg(feature = "process")]
            Running::Physical(args) => physical::physical(session, args),
            #[cfg(feature = "process")]
            Running::Null(args) => null::null(session, args),
            #[cfg(feature = "process")]
            Running::Mitm(args) => mitm::mitm(session, args),
            #[cfg(feature = "process")]
            Running::Prepare(args) => prepare::prepare(session, args),
            #[cfg(all(feature = "process", feature = "mcap"))]
            Running::Compensate(args) => compensate::compensate(session, args),
            Running::Replay(args) => replay::replay(session, args),
            Running::Shrink(args) => shrink::shrink(session, args),
            Running::ReplayRecording(args) => replay_recording::replay_recording(session, args),
            Running::Monitors(args) => monitors::monitors(session, args),
            Running::Twin(args) => twin::twin(session, args),
        }
    }
}

impl Showing {
    /// Carries it out on the runs in a folder of results.
    pub(super) fn carry_out(&self, results: &Path) -> Result<ExitCode, Failure> {
        match self {
            Showing::Export(args) => export::export(results, args),
            Showing::Report(args) => report::report(results, args),
            Showing::Causes(which) => view::causes(results, which),
            Showing::List(which) => view::list(results, which),
            Showing::Show { test, at, which } => view::show(results, which, test, *at),
            Showing::Digest(which) => view::digest(results, which),
        }
    }
}

impl Internal {
    /// Carries it out; `compiled` is the session of a runner that contains its own plan.
    pub(super) fn carry_out(&self, compiled: Option<&Session>) -> Result<ExitCode, Failure> {
        match self {
            #[cfg(feature = "process")]
            Internal::Worker { runner: Some(_), .. } => self.serve_with(compiled.map(|session| &session.runner)),
            #[cfg(feature = "process")]
            Internal::Worker { lab: Some(lab), record, relay, supervisor, .. } => {
                let session = of_its_own(compiled)?;
                serve(session.runner.clone(), recorded(session.plan.clone(), *record), Some(lab), *relay, supervisor)
            }
            Internal::Worker { record, relay, supervisor, .. } => {
                let session = of_its_own(compiled)?;
                let plan = relaying(recorded(session.plan.clone(), *record), *relay);
                campaign::serve(&session.runner, &plan, supervisor)?;
                Ok(ExitCode::SUCCESS)
            }
            #[cfg(all(feature = "process", target_os = "linux"))]
            Internal::Simulator { worker, report, background, program } => {
                let (program, arguments) = program.split_first().expect("the program is required");
                Ok(sesame_relay::transport::keep_simulator(*worker, report, program, arguments, *background))
            }
            #[cfg(all(feature = "process", target_os = "linux"))]
            Internal::Simulated { keeper, background, program } => {
                let (program, arguments) = program.split_first().expect("the program is required");
                Ok(sesame_relay::transport::become_simulator(*keeper, program, arguments, *background))
            }
        }
    }

    /// Serves a supervisor that sent a plan, with this code for it, if there is any.
    #[cfg(feature = "process")]
    pub(super) fn serve_with(&self, code: Option<&Runner>) -> Result<ExitCode, Failure> {
        let Internal::Worker { runner: Some(file), keeper, lab, record, relay, supervisor } = self else {
            return Err(Failure("a worker needs the file with its plan".to_owned()));
        };
        #[cfg(target_os = "linux")]
        if let Some(keeper) = keeper {
            sesame_lifecycle::use_keeper(keeper.clone());
        }
        #[cfg(not(target_os = "linux"))]
        let _ = keeper;
        let sent = crate::interpreted::Interpreted::read(file)
            .map_err(|error| Failure(format!("cannot read {}: {error}", file.display())))?;
        let runner = code.map_or_else(|| sent.runner(), |code| sent.with_code_of(code));
        let plan = serde_json::from_str(&runner.plan)?;
        serve(runner, recorded(plan, *record), lab.as_deref(), *relay, supervisor)
    }
}

/// The session of a runner that contains its own plan.
fn of_its_own(compiled: Option<&Session>) -> Result<&Session, Failure> {
    compiled.ok_or_else(|| Failure("`worker` is started by `run`, not by hand".to_owned()))
}

/// A plan whose tests are recorded whole if that may be asked for.
fn recorded(plan: CampaignPlan, record: bool) -> CampaignPlan {
    let mut plan = plan;
    if record {
        plan.campaign.record = Some(Recorded::All);
    }
    plan
}

/// A plan in which so many topics pass through the relay.
fn relaying(plan: CampaignPlan, relay: Option<u32>) -> CampaignPlan {
    match relay {
        Some(first) => plan.relaying(first),
        None => plan,
    }
}

/// Serves a supervisor, in a lab if one is named.
#[cfg(feature = "process")]
fn serve(
    runner: Runner,
    plan: CampaignPlan,
    lab: Option<&str>,
    relay: Option<u32>,
    supervisor: &campaign::Address,
) -> Result<ExitCode, Failure> {
    let (runner, plan) = match lab {
        Some(lab) => crate::lab::in_lab(runner, plan, lab)?,
        None => (runner, plan),
    };
    campaign::serve(&runner, &relaying(plan, relay), supervisor)?;
    Ok(ExitCode::SUCCESS)
}
