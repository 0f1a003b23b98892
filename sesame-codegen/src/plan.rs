//! What the generator is given: one campaign of a checked space, as data.
//!
//! `lower` makes it from the language's model. Everything a runner needs at run time is in the
//! [`CampaignPlan`]; beside it stands only what decides the generated code.

use std::path::Path;

use sesame_plan::{CampaignPlan, Direction, MetricSource, Parameter, Simulator, TopicId};

/// The plan of one runner crate.
#[derive(Debug, Clone, PartialEq)]
pub struct RunnerPlan {
    /// The campaign as the runner will read it. Its topics and messages are those of the whole space.
    pub plan: CampaignPlan,
    /// Every hook metric of the space in declaration order, measured by this campaign or not: the traits of all are
    /// generated, so that a hook file shared by several campaigns compiles in each of them.
    pub hooks: Vec<HookPlan>,
    /// Every custom operation of the space in declaration order, used by this campaign or not, for the same reason.
    pub operations: Vec<OperationPlan>,
    /// Folder of the simulator's crate as the `.sesame` file has it (`crate "simulator"`), relative to the file that
    /// declares it.
    /// `None` when the file names none: the crate of an in-process simulator then comes from `[dependencies]` in
    /// `sesame.toml`.
    pub simulator_crate: Option<String>,
    /// The file that declares the simulator, as seen from the folder of the space's own. The simulator's crate or
    /// program is relative to its folder.
    pub system_file: String,
}

/// The plan of a monitor that is a program of its own.
#[derive(Debug, Clone, PartialEq)]
pub struct MonitorPlan {
    /// The monitor.
    pub name: String,
    /// Its [plan](CampaignPlan::of_monitor_alone).
    pub plan: CampaignPlan,
    /// The file that declares the simulator, as seen from the folder of the space's own.
    pub system_file: String,
}

/// A metric that the user writes in Rust.
#[derive(Debug, Clone, PartialEq)]
pub struct HookPlan {
    /// The metric's name in the space.
    pub metric: String,
    /// Its doc comment, lines joined by `\n`; empty when there is none.
    pub doc: String,
    /// The unit of its value; `None` for a plain number.
    pub unit: Option<String>,
    /// Which end of it is of interest.
    pub direction: Option<Direction>,
    /// The file of its declaration, as seen from the folder of the space's own.
    pub source: String,
    /// Line of its declaration, from 1.
    pub line: u32,
    /// Its inputs in declaration order: positions in [`CampaignPlan::topics`], each at most once.
    pub inputs: Vec<TopicId>,
}

/// An operation that the user writes in Rust.
#[derive(Debug, Clone, PartialEq)]
pub struct OperationPlan {
    /// The operation's name in the space.
    pub operation: String,
    /// Its doc comment, lines joined by `\n`; empty when there is none.
    pub doc: String,
    /// The file of its declaration, as seen from the folder of the space's own.
    pub source: String,
    /// Line of its declaration, from 1.
    pub line: u32,
    /// When it is called.
    pub called: Called,
    /// Its parameters, in declaration order, with their doc comments.
    pub parameters: Vec<(Parameter, String)>,
}

/// When a custom operation is called.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Called {
    /// With each message of this topic while the operation is active.
    OnMessage(TopicId),
    /// Once for a run, on files instead of messages.
    Offline(Offline),
}

/// When an operation that does not act on messages is called.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Offline {
    /// Before the simulator starts afresh for the test.
    BeforeStart,
    /// After a run that came to its end.
    AfterEnd,
}

impl OperationPlan {
    /// Whether it acts before the start or after the end of a run.
    pub fn is_offline(&self) -> bool {
        matches!(self.called, Called::Offline(_))
    }
}

/// The feature of the runtime for a transport that not every runner has: its libraries take long to compile.
pub(crate) fn runtime_feature(simulator: &Simulator) -> Option<&'static str> {
    let kind = simulator.properties();
    let encrypted = kind.address.and_then(|schemes| schemes.encrypted);
    let over_tls = encrypted.zip(simulator.addresses().first().copied());
    let over_tls = over_tls.is_some_and(|(encrypted, address)| address.starts_with(encrypted));
    kind.feature_over_tls.filter(|_| over_tls).or(kind.feature)
}

impl RunnerPlan {
    /// The folder of the file that declares the simulator, as seen from that of the space; empty where they are one.
    pub fn system_folder(&self) -> &Path {
        Path::new(&self.system_file).parent().unwrap_or(Path::new(""))
    }

    /// Whether a runner of this campaign contains Rust that a command with these features of the runtime does not,
    /// whatever hooks it has: the user's simulator, or a transport that the command was built without.
    pub fn needs_a_runner(&self, is_built_in: fn(feature: &str) -> bool) -> bool {
        let simulator = &self.plan.simulator;
        simulator.properties().in_runner || runtime_feature(simulator).is_some_and(|feature| !is_built_in(feature))
    }

    /// What of this campaign is in Rust, for sentences: the user's simulator and hooks. Nothing, when its runner is
    /// built for another reason.
    pub fn parts_in_rust(&self) -> Vec<String> {
        let simulator = self.plan.simulator.rust_type().map(|path| format!("the simulator `{path}`"));
        let metrics = self.hooks.iter().filter(|hook| self.uses(hook));
        let metrics = metrics.map(|hook| format!("the metric `{}`", hook.metric));
        let operations = self.operations.iter().filter(|operation| self.applies(operation));
        let operations = operations.map(|operation| format!("the operation `{}`", operation.operation));
        simulator.into_iter().chain(metrics).chain(operations).collect()
    }

    /// Whether this campaign calls hooks of the user's.
    pub fn has_hooks(&self) -> bool {
        self.called_hooks().next().is_some()
    }

    /// The metrics and operations whose hooks this campaign calls.
    pub fn called_hooks(&self) -> impl Iterator<Item = &str> {
        let metrics = self.hooks.iter().filter(|hook| self.uses(hook)).map(|hook| hook.metric.as_str());
        let operations = self.operations.iter().filter(|operation| self.applies(operation));
        metrics.chain(operations.map(|operation| operation.operation.as_str()))
    }

    /// Whether a test of this campaign may hold a custom operation, and so needs its hook to be compiled.
    pub(crate) fn applies(&self, operation: &OperationPlan) -> bool {
        self.plan.operations.iter().any(|used| used.name == operation.operation)
    }

    /// Whether this campaign measures a hook metric, and so needs its hook to be compiled.
    pub fn uses(&self, hook: &HookPlan) -> bool {
        self.plan
            .metrics
            .iter()
            .any(|metric| metric.name == hook.metric && matches!(metric.source, MetricSource::Hook { .. }))
    }
}
