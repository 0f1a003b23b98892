//! What each command of a runner works with.

use std::borrow::Cow;
use std::path::PathBuf;

use clap::Args;

use sesame_plan::CampaignPlan;

use crate::campaign::WorkerProgram;
use crate::cli::caller::Caller;
use crate::cli::failure::Failure;
use crate::runner::Runner;

/// A runner whose command is carried out.
#[derive(Debug, Clone)]
pub(super) struct Session {
    pub runner: Runner,
    pub plan: CampaignPlan,
    /// The folder of all results.
    pub results: PathBuf,
    /// What is started as each worker.
    pub program: WorkerProgram,
    pub caller: Caller,
}

impl Session {
    /// The same with a lab in place of the simulator.
    #[cfg(feature = "process")]
    pub(super) fn in_lab(&self, name: &str) -> Result<Self, Failure> {
        let (runner, plan) = crate::lab::in_lab(self.runner.clone(), self.plan.clone(), name)?;
        let (results, caller) = (self.results.clone(), self.caller.clone());
        Ok(Session { runner, plan, results, program: self.program.clone().in_lab(name), caller })
    }

    /// No lab is reached without programs.
    #[cfg(not(feature = "process"))]
    pub(super) fn in_lab(&self, name: &str) -> Result<Self, Failure> {
        let runner = &self.runner.directory;
        Err(Failure(format!("cannot reach lab `{name}`: {} was built without `process`", runner.display())))
    }

    /// The same with only the first so many of the topics that operations can act on passing through the relay.
    pub(super) fn relaying(&self, first: u32) -> Self {
        Session {
            runner: self.runner.clone(),
            plan: self.plan.relaying(first),
            results: self.results.clone(),
            program: self.program.clone().relaying(first),
            caller: self.caller.clone(),
        }
    }

    pub(super) fn new(runner: Runner, program: WorkerProgram, caller: Caller) -> Result<Self, Failure> {
        let plan = serde_json::from_str(&runner.plan).map_err(|error| {
            Failure(format!("the plan in this runner is damaged ({error}): run `sesamec generate` again"))
        })?;
        let results = runner.directory.join("results");
        Ok(Session { runner, plan, results, program, caller })
    }
}

/// Where tests are run.
#[derive(Debug, Default, Args)]
pub(super) struct World {
    /// Run in this lab of the space, in place of its simulator
    #[arg(long, value_name = "LAB")]
    simulator: Option<String>,
}

impl World {
    /// The session, in the lab that is named.
    pub(super) fn of<'a>(&self, session: &'a Session) -> Result<Cow<'a, Session>, Failure> {
        self.simulator.as_deref().map_or(Ok(Cow::Borrowed(session)), |lab| session.in_lab(lab).map(Cow::Owned))
    }

    /// What the name of a run has behind its seed.
    pub(super) fn suffix(&self) -> String {
        self.simulator.as_ref().map_or(String::new(), |lab| format!("-with-{lab}"))
    }
}
