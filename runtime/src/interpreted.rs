//! Runners without a crate: of a campaign whose simulator is a program and that uses no hooks, the plan says
//! everything. So one program, `sesamec`, can run any of them at once, with nothing to generate or to compile.

use std::path::{Path, PathBuf};

use serde::{Deserialize, Serialize};
use sesame_plan::CampaignPlan;
use sesame_relay::transport::{self, Connect, Transport};

use crate::runner::Runner;

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
}

/// The transport to the simulator of a plan, which is a program or a system of ROS nodes.
pub(crate) fn connect(plan: &CampaignPlan, folder: &Path) -> Box<dyn Transport> {
    let connect = match &plan.simulator.transport {
        #[cfg(feature = "ros1")]
        sesame_plan::Transport::Ros1(_) => sesame_ros1::ros1(folder.to_owned()),
        #[cfg(feature = "ros2")]
        sesame_plan::Transport::Ros2(_) => sesame_ros2::ros2(folder.to_owned()),
        _ => transport::process(folder.to_owned()),
    };
    connect.transport(plan)
}

impl Interpreted {
    /// Reads what a supervisor wrote for its worker.
    pub(crate) fn read(file: &Path) -> std::io::Result<Self> {
        Ok(serde_json::from_slice(&std::fs::read(file)?)?)
    }

    /// The runner that the runtime takes.
    pub(crate) fn runner(&self) -> Runner {
        let Interpreted { plan, directory, space, simulator } = self;
        Runner {
            plan: plan.clone().into(),
            directory: directory.clone(),
            space: space.clone(),
            hooks: &[],
            operations: &[],
            connect: Connect::new(connect, directory.join(simulator)),
        }
    }
}
