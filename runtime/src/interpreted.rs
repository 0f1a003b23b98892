//! Runners without a crate: of a campaign whose simulator is a program and that uses no hooks in Rust, the plan says
//! everything but the code of hooks in Python, which its workers import. So one program, `sesamec`, can run any of
//! them at once, with nothing to generate or to compile.

use std::path::{Path, PathBuf};

use serde::{Deserialize, Serialize};
use sesame_base::time::SimTime;
use sesame_plan::CampaignPlan;
use sesame_plan::python::PythonHooks;
use sesame_relay::fuzz::OperationEntry;
use sesame_relay::metric::HookEntry;
use sesame_relay::relay::Exchange;
use sesame_relay::simulator::Progress;
use sesame_relay::transport::{Capabilities, Connect, Transport, TransportError};

use crate::runner::Runner;
use crate::transport;

/// An interpreted runner as data: what a compiled one has in its crate.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct Interpreted {
    /// The plan, as `campaign.plan.json` holds it.
    pub plan: String,
    /// The runner's folder; results go into `results/` inside it. It need not exist.
    pub directory: PathBuf,
    /// Folder of the `.sesame` file, as seen from there.
    pub space: PathBuf,
    /// Folder that the simulator runs in, as seen from there.
    pub simulator: PathBuf,
    /// The hooks in Python that it calls; `None` if it calls none.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub hooks: Option<PythonHooks>,
}

/// The transport to the simulator of a plan, which is not part of the runner.
pub(crate) fn connect(plan: &CampaignPlan, folder: &Path) -> Box<dyn Transport> {
    match transport::of_kind(plan.simulator.transport.kind(), folder) {
        Some(connect) => connect.transport(plan),
        None => Box::new(Unavailable(plan.simulator.properties().keyword)),
    }
}

/// In place of a transport that this program was built without. A campaign's own transport is always there: the
/// generator asks for it. That of a lab may not be.
struct Unavailable(&'static str);

impl Transport for Unavailable {
    fn capabilities(&self) -> Capabilities {
        Capabilities { lock_stepped: false, resets: false }
    }

    fn reset(&mut self, _: u64, _: &mut dyn Exchange) -> Result<(), TransportError> {
        let problem = format!(
            "this runner was built without `{0}`; build it with that feature of `sesame-runtime`, or run the campaign \
             with a `sesamec` that was built with `--features {0}`",
            self.0
        );
        Err(TransportError::Wiring(problem))
    }

    fn advance(&mut self, _: SimTime, relay: &mut dyn Exchange) -> Result<Progress, TransportError> {
        self.reset(0, relay).map(|()| Progress::Ended)
    }

    fn now(&self) -> SimTime {
        SimTime::ZERO
    }

    fn close(&mut self) {}
}

impl Interpreted {
    /// Reads what a supervisor wrote for its worker.
    pub fn read(file: &Path) -> std::io::Result<Self> {
        Ok(serde_json::from_slice(&std::fs::read(file)?)?)
    }

    /// Code for any plan: hooks, and what connects to the simulator, if not as the plan says.
    pub(crate) fn code(
        hooks: &'static [HookEntry],
        operations: &'static [OperationEntry],
        to_simulator: Option<Connect>,
    ) -> Runner {
        let connect = to_simulator.unwrap_or_else(|| Connect::new(connect, PathBuf::new()));
        Runner { plan: "".into(), directory: PathBuf::new(), space: PathBuf::new(), hooks, operations, connect }
    }

    /// The runner that the runtime takes.
    pub(crate) fn runner(&self) -> Runner {
        self.with_code_of(&Interpreted::code(&[], &[], None))
    }

    /// A compiled runner with this plan and these folders in place of its own.
    pub(crate) fn with_code_of(&self, compiled: &Runner) -> Runner {
        let Interpreted { plan, directory, space, simulator, hooks: _ } = self;
        Runner {
            plan: plan.clone().into(),
            directory: directory.clone(),
            space: space.clone(),
            connect: compiled.connect.clone().in_folder(directory.join(simulator)),
            ..compiled.clone()
        }
    }
}
