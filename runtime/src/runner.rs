//! What the runtime is told of a campaign's runner.

use std::borrow::Cow;
use std::path::PathBuf;

use sesame_relay::fuzz::OperationEntry;
use sesame_relay::metric::HookEntry;
use sesame_relay::transport::Connect;

/// A campaign's runner: what a generated crate hands to the runtime.
#[derive(Debug, Clone)]
pub struct Runner {
    /// The plan, as `campaign.plan.json` holds it.
    pub plan: Cow<'static, str>,
    /// Folder of the runner's crate; results go into `results/` inside it.
    pub directory: PathBuf,
    /// Folder of the `.sesame` file, as seen from there.
    pub space: PathBuf,
    /// The metric hooks this campaign uses.
    pub hooks: &'static [HookEntry],
    /// The operation hooks this campaign uses.
    pub operations: &'static [OperationEntry],
    /// How the simulator is reached.
    pub connect: Connect,
}
