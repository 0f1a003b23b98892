//! What a generated crate hands to the runtime.

use sesame_relay::fuzz::OperationEntry;
use sesame_relay::metric::HookEntry;
use sesame_relay::transport::Connect;

/// A campaign's runner: everything that generated code knows.
#[derive(Debug, Clone, Copy)]
pub struct Runner {
    /// The plan, as `campaign.plan.json` holds it.
    pub plan: &'static str,
    /// Folder of the runner's crate; results go into `results/` inside it.
    pub directory: &'static str,
    /// Folder of the `.sesame` file, as seen from there.
    pub space: &'static str,
    /// The metric hooks this campaign uses.
    pub hooks: &'static [HookEntry],
    /// The operation hooks this campaign uses.
    pub operations: &'static [OperationEntry],
    /// How the simulator is reached.
    pub connect: Connect,
}
