//! What stands against generating crates from plans: names that could not safely become Rust or files, and the like.

use std::collections::BTreeMap;

use sesame_plan::MetricSource;

use super::package;
use crate::names;
use crate::plan::{MonitorPlan, RunnerPlan};

/// Why no crate can be generated from a plan. The language refuses all of this with a place in the `.sesame` file; it
/// is checked here again because what is generated from is data.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum Problem {
    /// A name that could not safely become one of Rust or of a file.
    #[error("the {what} name `{}` is not an identifier of ASCII letters, digits and `_`", name.escape_debug())]
    Name {
        /// What is so called.
        what: &'static str,
        /// The name.
        name: String,
    },
    /// Two metrics, or two campaigns, that would share a file or a type.
    #[error("the {what}s `{first}` and `{second}` would both be called `{generated}` in what is generated: rename one")]
    SharedName {
        /// What they are.
        what: &'static str,
        /// The one declared first.
        first: String,
        /// The other.
        second: String,
        /// The name they would share.
        generated: String,
    },
    /// A dependency whose name is not one of cargo.
    #[error("`{}` is not the name of a package, as [dependencies] has them", name.escape_debug())]
    Dependency {
        /// The name.
        name: String,
    },
    /// The path of the simulator's type is not one.
    #[error("the simulator `{}` is not a path of Rust such as `my_simulator::World`", path.escape_debug())]
    SimulatorPath {
        /// The path.
        path: String,
    },
    /// A template of the user's that replaces none.
    #[error("there is no template `{}` to replace; there are {}", name.escape_debug(), template_names())]
    NoSuchTemplate {
        /// Its name.
        name: String,
    },
    /// A template of the user's that cannot be filled in.
    #[error("the template `{name}` cannot be filled in: {problem}")]
    Template {
        /// Its name.
        name: String,
        /// What is wrong with it.
        problem: String,
    },
    /// The simulator's program, or one of its arguments, is not one.
    #[error("the simulator's program and arguments must be texts without NUL, the program not empty")]
    SimulatorProgram,
    /// A program that is launched, or the one that ends the system, or one of their arguments, is not one.
    #[error(
        "a program that is launched or terminates others is empty, or it or an argument contains the character NUL"
    )]
    LaunchedProgram,
}

fn template_names() -> String {
    let names: Vec<&str> = sesame_templates::ALL.iter().map(|(name, _)| *name).collect();
    names.join(", ")
}

/// Everything that stands against generating the crate of a monitor: only its name and that of its space become names
/// of files and packages, all else is data.
pub(super) fn problems_of_monitor(monitor: &MonitorPlan) -> Vec<Problem> {
    let names = [("space", &monitor.plan.space), ("monitor", &monitor.name)];
    let bad = names.into_iter().filter(|(_, name)| !names::check(name));
    bad.map(|(what, name)| Problem::Name { what, name: name.clone() }).collect()
}

/// Everything that stands against generating crates from these plans, with these dependencies.
pub(super) fn problems(plans: &[RunnerPlan], dependencies: &BTreeMap<String, toml::Value>) -> Vec<Problem> {
    let mut problems = Vec::new();
    let mut check = |what: &'static str, name: &str| {
        if !names::check(name) {
            let problem = Problem::Name { what, name: name.to_owned() };
            if !problems.contains(&problem) {
                problems.push(problem);
            }
        }
    };
    for RunnerPlan { plan, hooks, operations, .. } in plans {
        check("space", &plan.space);
        check("campaign", &plan.campaign.name);
        for message in &plan.messages {
            check("message", &message.name);
            for field in &message.fields {
                check("field", &field.name);
            }
        }
        for topic in &plan.topics {
            check("topic", &topic.name);
        }
        for operation in operations {
            check("operation", &operation.operation);
            for (parameter, _) in &operation.parameters {
                check("parameter", &parameter.name);
            }
        }
        for metric in &plan.metrics {
            match metric.source {
                // A part of a monitor is named with its monitor before a dot.
                MetricSource::Monitor { .. } => metric.name.split('.').for_each(|name| check("metric", name)),
                _ => check("metric", &metric.name),
            }
        }
        for metric in hooks.iter().map(|hook| &hook.metric) {
            check("metric", metric);
        }
    }
    for RunnerPlan { plan, .. } in plans {
        let of_type = plan.simulator.rust_type().and_then(|path| {
            let here = ["self", "Self", "super", "crate"];
            let parts: Vec<&str> = path.split("::").collect();
            let good = parts.len() >= 2 && parts.iter().all(|part| names::check(part) && !here.contains(part));
            (!good).then(|| Problem::SimulatorPath { path: path.to_owned() })
        });
        let of_program = plan.simulator.program().and_then(|(program, arguments)| {
            let nul = program.contains('\0') || arguments.iter().any(|text| text.contains('\0'));
            (program.is_empty() || nul).then_some(Problem::SimulatorProgram)
        });
        let lifecycle = &plan.simulator.lifecycle;
        let launches = plan.nodes.iter().filter_map(|node| node.launch.as_ref()).chain(&lifecycle.launch);
        let mut commands = launches.map(|launch| &launch.command).chain(&lifecycle.terminate);
        let bad = commands.any(|command| {
            let nul = std::iter::once(&command.program).chain(&command.arguments).any(|text| text.contains('\0'));
            command.program.is_empty() || nul
        });
        let problem = of_type.or(of_program).or(bad.then_some(Problem::LaunchedProgram));
        problems.extend(problem.filter(|problem| !problems.contains(problem)));
    }
    for name in dependencies.keys().filter(|name| !package::is_dependency(name)) {
        problems.push(Problem::Dependency { name: name.clone() });
    }
    let first = || plans.iter().take(1);
    let hooks = || {
        let metrics = first().flat_map(|runner| &runner.hooks).map(|hook| hook.metric.as_str());
        metrics.chain(first().flat_map(|runner| &runner.operations).map(|operation| operation.operation.as_str()))
    };
    let what = if first().any(|runner| !runner.operations.is_empty()) { "metric or operation" } else { "metric" };
    let mut shared = shared_names(what, hooks(), names::snake);
    if shared.is_empty() {
        shared = shared_names(what, hooks(), names::hook_type);
    }
    problems.extend(shared);
    // Some file systems do not tell `Jitter` from `jitter`.
    let campaigns = plans.iter().map(|runner| runner.plan.campaign.name.as_str());
    problems.extend(shared_names("campaign", campaigns, |name| names::campaign_folder(name).to_ascii_lowercase()));
    problems
}

fn shared_names<'a>(
    what: &'static str,
    names: impl Iterator<Item = &'a str>,
    generated: impl Fn(&str) -> String,
) -> Vec<Problem> {
    let mut firsts: BTreeMap<String, &str> = BTreeMap::new();
    let mut problems = Vec::new();
    for second in names {
        let generated = generated(second);
        match firsts.get(&generated) {
            Some(&first) => {
                let (first, second) = (first.to_owned(), second.to_owned());
                problems.push(Problem::SharedName { what, first, second, generated });
            }
            None => {
                firsts.insert(generated, second);
            }
        }
    }
    problems
}
