//! Plans → files in memory. Pure: nothing here reads or writes a file, a clock or the environment.
//!
//! No name or text of a space becomes code, a path or the structure of a file: names are checked first ([`Problem`]),
//! Rust goes through quote, data through serialisers, and text through templates without logic.

mod handlers;
mod messages;
mod metrics;
mod monitor;
mod operations;
mod package;
mod problem;
mod python;
mod registry;
mod rust;
mod stub;
mod text;

use std::collections::{BTreeMap, BTreeSet};

use quote::{format_ident, quote};
use serde::Serialize;
use sesame_plan::{CampaignPlan, Simulator};
use sha2::{Digest as _, Sha256};

use self::messages::Messages;
pub use self::monitor::monitor;
use self::package::Kind;
pub(crate) use self::package::is_dependency as is_package_name;
pub use self::problem::Problem;
pub use self::python::{Python, python, python_stubs};
pub use self::text::Templates;
use crate::files::{File, Hook, MANIFEST, Owner, Tree};
use crate::names;
use crate::plan::{OperationPlan, RunnerPlan, runtime_feature};

/// The version of the interface between generated code and the runtime that this generator writes for.
const ABI: u32 = 4;

/// What the crates of a space need of the world around them.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Environment {
    /// `[dependencies]` of every runner, `sesame-runtime` and the simulator's crate included; paths as seen from a
    /// runner's folder.
    pub dependencies: BTreeMap<String, toml::Value>,
    /// A `Cargo.lock` to start from, so that all runners build the same versions.
    pub lock: Option<String>,
    /// The target folder that runners share, as seen from the folder they are in; `target` in it where nothing is said.
    pub target: Option<String>,
    /// Options of the command line that had a say, by name.
    pub options: BTreeMap<String, String>,
    /// The folder of the `.sesame` file, as seen from a runner's folder.
    pub space_folder: String,
    /// The folder of the file that declares the simulator, as seen from a runner's folder.
    pub simulator_folder: String,
    /// Where the user's hooks are.
    pub hooks: HooksFolder,
    /// Crates that every runner brings along, by path inside its folder; empty if it brings none.
    pub vendored: BTreeMap<String, Vec<u8>>,
    /// The texts for people.
    pub templates: Templates,
}

/// Where the user's hooks are.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub enum HooksFolder {
    /// In one folder beside the runners, which all of them share.
    #[default]
    Shared,
    /// In each runner's own `src/hooks/`, for a crate that is to be moved elsewhere.
    Own {
        /// What the shared folder holds so far, by path inside it: what the runner's own hooks start from.
        shared: BTreeMap<String, String>,
    },
}

impl Environment {
    /// Options that have a say in runners, by name, but none in what they share.
    fn runner_options(&self) -> BTreeMap<String, String> {
        let mut options = self.options.clone();
        if !self.vendored.is_empty() {
            options.insert("vendor".to_owned(), String::new());
        } else if matches!(self.hooks, HooksFolder::Own { .. }) {
            options.insert("self-contained".to_owned(), String::new());
        }
        options
    }
}

/// The files of a space and of its campaigns: first what all runners share, then one tree for each plan.
///
/// All plans are of one space, and there is at least one.
pub fn emit(plans: &[RunnerPlan], environment: &Environment) -> Result<Vec<Tree>, Vec<Problem>> {
    let problems = problem::problems(plans, &environment.dependencies);
    if !problems.is_empty() {
        return Err(problems);
    }
    let mut trees = vec![shared(plans, environment)];
    trees.extend(plans.iter().map(|runner| self::runner(runner, environment)));
    let mut problems = Vec::new();
    let trees = trees.into_iter().filter_map(|tree| tree.map_err(|problem| problems.push(problem)).ok()).collect();
    problems.dedup();
    if problems.is_empty() { Ok(trees) } else { Err(problems) }
}

/// The simulator's type, part by part; `None` for a simulator that is none of Rust's.
pub(crate) fn simulator_path(simulator: &Simulator) -> Option<Vec<&str>> {
    simulator.rust_type().map(|path| path.split("::").collect())
}

#[derive(Serialize)]
struct SharedReadme {
    space: String,
    source: String,
    doc: Vec<String>,
    hooks: Vec<ReadmeHook>,
    campaigns: Vec<ReadmeCampaign>,
}

#[derive(Serialize)]
struct ReadmeHook {
    file: String,
    /// What it is of, for example ``metric `speed` ``.
    of: String,
    source: String,
    line: u32,
    doc: String,
}

#[derive(Serialize)]
struct ReadmeCampaign {
    name: String,
    folder: String,
    doc: String,
}

#[derive(Serialize)]
struct RunnerReadme {
    hooks_folder: &'static str,
    space: String,
    source: String,
    campaign: String,
    doc: Vec<String>,
    hooks: Vec<ReadmeHook>,
    evaluations: u32,
    seed: u64,
    /// How nodes of ROS 2 are remapped, line by line; empty for other systems.
    wiring: Vec<String>,
}

/// The hooks of a space, metrics first; if `used`, only those that this campaign uses.
fn readme_hooks(runner: &RunnerPlan, used: bool) -> Vec<ReadmeHook> {
    let entry = |what: &str, name: &str, source: &str, line: u32, doc: &str| ReadmeHook {
        file: format!("{}.rs", names::snake(name)),
        of: format!("{what} `{name}`"),
        source: rust::one_line(source),
        line,
        doc: rust::one_line(doc.lines().next().unwrap_or_default()),
    };
    let metrics = runner.hooks.iter().filter(|hook| !used || runner.uses(hook));
    let operations = runner.operations.iter().filter(|operation| !used || runner.applies(operation));
    metrics
        .map(|hook| entry("metric", &hook.metric, &hook.source, hook.line, &hook.doc))
        .chain(operations.map(|operation| {
            entry("operation", &operation.operation, &operation.source, operation.line, &operation.doc)
        }))
        .collect()
}

fn doc_lines(doc: &str) -> Vec<String> {
    doc.lines().map(rust::one_line).collect()
}

fn tree(folder: String, runner: &RunnerPlan, environment: &Environment, model: String) -> Tree {
    Tree {
        folder,
        manifest: MANIFEST.to_owned(),
        files: BTreeMap::new(),
        generator: runner.plan.generator.clone(),
        source: runner.plan.source.clone(),
        options: environment.options.clone(),
        model,
        hooks: BTreeMap::new(),
        runners: Vec::new(),
    }
}

/// What all runners of a space share: the hooks, and what makes the folder pleasant.
fn shared(plans: &[RunnerPlan], environment: &Environment) -> Result<Tree, Problem> {
    let first = plans.first().expect("a space without campaigns has nothing to generate");
    let model = sha256(plans.iter().map(plan_json));
    let mut tree = tree(String::new(), first, environment, model);
    tree.runners = plans.iter().map(|runner| names::campaign_folder(&runner.plan.campaign.name)).collect();

    let note = format!("# {}\n", generated_by(first, &environment.options));
    tree.add(
        ".cargo/config.toml",
        Owner::Machine,
        format!(
            "{note}# One target folder for all runners, so that what they share is compiled once.\n[build]\n\
             target-dir = {}\n",
            toml::Value::from(environment.target.as_deref().unwrap_or("target"))
        ),
    );
    tree.add(".gitignore", Owner::Machine, note + "/target/\n/*/results/\n");
    let readme = SharedReadme {
        space: first.plan.space.clone(),
        source: rust::one_line(&first.plan.source),
        doc: doc_lines(&first.plan.doc),
        hooks: readme_hooks(first, false),
        campaigns: plans
            .iter()
            .map(|runner| ReadmeCampaign {
                name: runner.plan.campaign.name.clone(),
                folder: names::campaign_folder(&runner.plan.campaign.name),
                doc: rust::one_line(runner.plan.campaign.doc.lines().next().unwrap_or_default()),
            })
            .collect(),
    };
    tree.add("README.md", Owner::Machine, environment.templates.render("runner/shared_readme.md.tera", &readme)?);

    let types = Messages::new(&first.plan);
    hooks(&mut tree, "hooks", first, &types, environment)?;
    Ok(tree)
}

/// The user's hooks of a space, in a folder of a tree.
fn hooks(
    tree: &mut Tree,
    folder: &str,
    runner: &RunnerPlan,
    types: &Messages<'_>,
    environment: &Environment,
) -> Result<(), Problem> {
    for hook in &runner.hooks {
        let path = format!("{folder}/{}.rs", names::snake(&hook.metric));
        tree.add(&path, Owner::User, stub::stub(&environment.templates, runner, types, hook)?);
        let inputs = handlers::inputs(&runner.plan, types, &hook.inputs);
        tree.hooks.insert(path, Hook { of: format!("metric `{}`", hook.metric), inputs });
    }
    for operation in &runner.operations {
        let path = format!("{folder}/{}.rs", names::snake(&operation.operation));
        tree.add(&path, Owner::User, operations::stub(&environment.templates, runner, types, operation)?);
        let inputs = operations::inputs(runner, types, operation);
        tree.hooks.insert(path, Hook { of: format!("operation `{}`", operation.operation), inputs });
    }
    Ok(())
}

/// The crate of one campaign.
fn runner(runner: &RunnerPlan, environment: &Environment) -> Result<Tree, Problem> {
    let plan = &runner.plan;
    let json = plan_json(runner);
    let mut tree =
        tree(names::campaign_folder(&plan.campaign.name), runner, environment, sha256(std::iter::once(json.clone())));
    tree.options = environment.runner_options();
    let package = names::package(&plan.space, &plan.campaign.name);
    let note = generated_by(runner, &tree.options);
    let header = format!("// {note}\n");

    let mut features = FEATURES.to_vec();
    let in_labs = plan.labs.iter().filter_map(|lab| lab.simulator.as_ref());
    let reached = std::iter::once(&plan.simulator).chain(in_labs);
    let wanted: BTreeSet<&str> = reached.filter_map(runtime_feature).collect();
    features.extend(wanted);
    let dependencies = package::with_features(&environment.dependencies, &features);
    tree.add(
        "Cargo.toml",
        Owner::Machine,
        package::cargo_toml(Kind::Runner, &note, &package, &dependencies, !environment.vendored.is_empty()),
    );
    if let Some(lock) = &environment.lock {
        tree.add("Cargo.lock", Owner::Seed, lock.clone());
    }
    tree.add(CAMPAIGN_PLAN, Owner::Machine, json);
    // As seen from the runner's folder, and from its src/generated/.
    let (hooks_folder, hooks_path) = match environment.hooks {
        HooksFolder::Shared => ("../hooks", "../../../hooks"),
        HooksFolder::Own { .. } => ("src/hooks", "../hooks"),
    };
    let readme = RunnerReadme {
        hooks_folder,
        space: plan.space.clone(),
        source: rust::one_line(&plan.source),
        campaign: plan.campaign.name.clone(),
        doc: doc_lines(&plan.campaign.doc),
        hooks: readme_hooks(runner, true),
        evaluations: plan.campaign.search.evaluations(),
        seed: plan.campaign.seed,
        wiring: match plan.simulator.properties().bus {
            Some(_) => doc_lines(&crate::wiring::text(plan)),
            None => Vec::new(),
        },
    };
    tree.add("README.md", Owner::Machine, environment.templates.render("runner/runner_readme.md.tera", &readme)?);

    let docs = rust::module_docs([format!("The test runner of campaign `{}`.", plan.campaign.name)]);
    let main = rust::file(
        &header,
        quote! {
            #docs
            mod generated;

            fn main() -> ::std::process::ExitCode {
                ::sesame_runtime::main(generated::campaign::runner())
            }
        },
    );
    tree.add("src/main.rs", Owner::Machine, main);
    let docs = rust::module_docs([format!("What `{}` says, as Rust.", plan.source)]);
    let custom = !runner.operations.is_empty();
    let operations = custom.then(|| quote! { mod operation_registry; pub mod operations; });
    let modules = rust::file(
        &header,
        quote! {
            #docs
            pub mod campaign;
            pub mod messages;
            pub mod metrics;
            #operations
            mod registry;
        },
    );
    tree.add("src/generated/mod.rs", Owner::Machine, modules);
    tree.add("src/generated/campaign.rs", Owner::Machine, campaign(runner, environment, &header));
    let types = Messages::new(plan);
    tree.add("src/generated/messages.rs", Owner::Machine, types.file(&header, custom));
    tree.add("src/generated/metrics.rs", Owner::Machine, metrics::traits(runner, &types, &header));
    tree.add("src/generated/registry.rs", Owner::Machine, metrics::registry(runner, &types, &header, hooks_path));
    if custom {
        tree.add("src/generated/operations.rs", Owner::Machine, operations::traits(runner, &types, &header));
        let registry = operations::registry(runner, &types, &header, hooks_path);
        tree.add("src/generated/operation_registry.rs", Owner::Machine, registry);
    }
    if let HooksFolder::Own { shared } = &environment.hooks {
        tree.add(".gitignore", Owner::Machine, format!("# {note}\n/target/\n/results/\n"));
        hooks(&mut tree, "src/hooks", runner, &types, environment)?;
        for (path, text) in shared {
            let file = File { owner: Owner::User, contents: text.clone().into_bytes() };
            tree.files.insert(format!("src/hooks/{path}"), file);
        }
    }
    for (path, contents) in &environment.vendored {
        tree.add(path, Owner::Machine, contents.clone());
    }
    Ok(tree)
}

/// The features of the runtime that runners use. They are the same for all campaigns, whatever transport or traces one
/// asks for, so that a change of the space does not compile the runtime again. Only ROS 2 is another, because it costs
/// more to compile than all of these, and a space hardly ever changes to it.
const FEATURES: [&str; 4] = ["campaign", "in-process", "mcap", "process"];

/// `campaign.rs`: the campaign as the runtime takes it.
fn campaign(runner: &RunnerPlan, environment: &Environment, header: &str) -> String {
    let plan = &runner.plan;
    let docs = rust::module_docs([format!("Campaign `{}`, for the runtime.", plan.campaign.name)]);
    // A runner that can go elsewhere leads out of itself only for files that operations beside the run work on.
    let beside = runner.operations.iter().any(OperationPlan::is_offline);
    let folder =
        if environment.hooks == HooksFolder::Shared || beside { environment.space_folder.as_str() } else { "." };
    let operations = if runner.operations.is_empty() {
        quote! { &[] }
    } else {
        quote! { super::operation_registry::OPERATIONS }
    };
    let abi = proc_macro2::Literal::u32_unsuffixed(ABI);
    let (simulator, connect) = if let Some(path) = simulator_path(&plan.simulator) {
        let path = path.into_iter().map(names::ident);
        let simulator = quote! {
            /// The simulator under test.
            type Simulator = #(::#path)*;
        };
        (simulator, quote! { ::sesame_runtime::transport::in_process::<Simulator>() })
    } else {
        let folder = &environment.simulator_folder;
        let simulator = quote! {
            /// The folder that the simulator runs in, as seen from this crate's.
            const SIMULATOR: &str = #folder;
        };
        let transport = format_ident!("{}", plan.simulator.properties().keyword);
        let connect = quote! {
            ::sesame_runtime::transport::#transport(::std::path::Path::new(::core::env!("CARGO_MANIFEST_DIR")).join(SIMULATOR))
        };
        (simulator, connect)
    };
    let source = rust::file(
        header,
        quote! {
            #docs
            ::sesame_runtime::assert_generator_abi!(#abi);

            #simulator

            /// The folder of the `.sesame` file, as seen from this crate's.
            const SPACE: &str = #folder;

            /// Everything the runtime is told.
            pub fn runner() -> ::sesame_runtime::Runner {
                ::sesame_runtime::Runner {
                    plan: ::core::include_str!("../../campaign.plan.json").into(),
                    directory: ::core::env!("CARGO_MANIFEST_DIR").into(),
                    space: SPACE.into(),
                    hooks: super::registry::HOOKS,
                    operations: #operations,
                    connect: #connect,
                }
            }
        },
    );
    let place = format!("simulator `{}` in {}", plan.simulator.name, runner.system_file);
    rust::note_lines(&source, &[("type Simulator =".to_owned(), place)])
}

/// What every machine file says at its top.
fn generated_by(runner: &RunnerPlan, options: &BTreeMap<String, String>) -> String {
    let mut command = format!("sesamec generate {}", runner.plan.source);
    add_options(&mut command, options);
    by(&runner.plan, &command)
}

/// Adds options to a command.
fn add_options(command: &mut String, options: &BTreeMap<String, String>) {
    for (name, value) in options {
        let space = if value.is_empty() { "" } else { " " };
        *command = format!("{command} --{name}{space}{value}");
    }
}

/// The same for a command.
fn by(plan: &CampaignPlan, command: &str) -> String {
    rust::one_line(&format!(
        "@generated by {} from {}. Do not edit: `{command}` writes it anew.",
        plan.generator, plan.source
    ))
}

/// The file of a runner with its plan.
pub const CAMPAIGN_PLAN: &str = "campaign.plan.json";

/// The plan of a runner, as the file `campaign.plan.json` holds it.
pub fn plan_json(runner: &RunnerPlan) -> String {
    let mut json = serde_json::to_string_pretty(&runner.plan).expect("a plan is plain data");
    json.push('\n');
    json
}

/// SHA-256 of texts in a row, in hexadecimal.
fn sha256(texts: impl Iterator<Item = String>) -> String {
    let mut hash = Sha256::new();
    texts.for_each(|text| hash.update(text.as_bytes()));
    hex(&hash.finalize())
}

/// SHA-256 of a file's contents, in hexadecimal.
pub(crate) fn hash(contents: &[u8]) -> String {
    hex(&Sha256::digest(contents))
}

fn hex(bytes: &[u8]) -> String {
    use std::fmt::Write as _;
    bytes.iter().fold(String::with_capacity(2 * bytes.len()), |mut text, byte| {
        write!(text, "{byte:02x}").expect("text grows as needed");
        text
    })
}
