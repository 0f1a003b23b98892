//! The crate of a monitor that is a program of its own.

use std::collections::BTreeMap;
use std::path::Path;

use quote::{format_ident, quote};
use serde::Serialize;

use super::package::Kind;
use super::{ABI, Environment, Problem, add_options, by, doc_lines, package, problem, rust, sha256};
use crate::files::{MANIFEST, Owner, Tree};
use crate::names;
use crate::plan::{MonitorPlan, runtime_feature};

/// The features of the runtime that every monitor uses.
const FEATURES: [&str; 1] = ["standalone"];

/// The file with the plan.
const PLAN: &str = "monitor.plan.json";

#[derive(Serialize)]
struct Readme {
    space: String,
    source: String,
    monitor: String,
    doc: Vec<String>,
    program: String,
    /// How the monitor reaches its system, in words; empty if it is not a bus.
    bus: String,
}

/// The crate of a monitor. Of the environment it takes the runtime, and nothing that hooks need.
pub fn monitor(monitor: &MonitorPlan, environment: &Environment) -> Result<Tree, Vec<Problem>> {
    let MonitorPlan { name, plan, system_file } = monitor;
    let problems = problem::problems_of_monitor(monitor);
    if !problems.is_empty() {
        return Err(problems);
    }
    let mut options = environment.options.clone();
    options.insert("eddi".to_owned(), name.clone());
    if !environment.vendored.is_empty() {
        options.insert("vendor".to_owned(), String::new());
    }
    let mut command = format!("sesamec generate {}", plan.source);
    add_options(&mut command, &options);
    let note = by(plan, &command);
    let header = format!("// {note}\n");
    let mut json = serde_json::to_string_pretty(plan).expect("a plan is plain data");
    json.push('\n');
    let mut tree = Tree {
        folder: names::monitor_folder(name),
        manifest: MANIFEST.to_owned(),
        files: BTreeMap::new(),
        generator: plan.generator.clone(),
        source: plan.source.clone(),
        options,
        model: sha256(std::iter::once(json.clone())),
        hooks: BTreeMap::new(),
        runners: Vec::new(),
    };
    let program = names::package(&plan.space, &names::monitor_folder(name));
    let features: Vec<&str> = FEATURES.into_iter().chain(runtime_feature(&plan.simulator)).collect();
    let runtime = environment.dependencies.iter().filter(|(name, _)| *name == "sesame-runtime");
    let runtime: BTreeMap<String, toml::Value> = runtime.map(|(name, value)| (name.clone(), value.clone())).collect();
    let dependencies = package::with_features(&runtime, &features);
    let vendored = !environment.vendored.is_empty();
    let manifest = package::cargo_toml(Kind::Monitor, &note, &program, &dependencies, vendored);
    tree.add("Cargo.toml", Owner::Machine, manifest);
    if let Some(lock) = &environment.lock {
        tree.add("Cargo.lock", Owner::Seed, lock.clone());
    }
    tree.add(".gitignore", Owner::Machine, format!("# {note}\n/target/\n"));
    tree.add(PLAN, Owner::Machine, json);
    let readme = Readme {
        space: plan.space.clone(),
        source: rust::one_line(&plan.source),
        monitor: name.clone(),
        doc: doc_lines(
            plan.monitors.iter().find(|monitor| monitor.name == *name).map_or("", |monitor| monitor.doc.as_str()),
        ),
        program,
        bus: plan.simulator.properties().bus.unwrap_or_default().to_owned(),
    };
    let readme = environment.templates.render("runner/monitor_readme.md.tera", &readme).map_err(|error| vec![error])?;
    tree.add("README.md", Owner::Machine, readme);
    let system = Path::new(system_file).parent().unwrap_or(Path::new(""));
    let system = Path::new(&environment.space_folder).join(system);
    tree.add("src/main.rs", Owner::Machine, main(monitor, &header, &system.display().to_string()));
    for (path, contents) in &environment.vendored {
        tree.add(path, Owner::Machine, contents.clone());
    }
    Ok(tree)
}

fn main(monitor: &MonitorPlan, header: &str, system: &str) -> String {
    let MonitorPlan { name, plan, .. } = monitor;
    let docs = rust::module_docs([format!("The monitor `{name}` of the space `{}` as a program.", plan.space)]);
    let abi = proc_macro2::Literal::u32_unsuffixed(ABI);
    let kind = plan.simulator.properties();
    let transport = format_ident!("{}", kind.keyword);
    let (folder, connect) = if kind.bus.is_none() {
        (quote! {}, quote! { ::core::option::Option::None })
    } else {
        let folder = quote! {
            /// The folder of the file that declares the simulator, as seen from this crate's.
            const SYSTEM: &str = #system;
        };
        let connect = quote! {
            ::core::option::Option::Some(::sesame_runtime::transport::#transport(
                ::std::path::Path::new(::core::env!("CARGO_MANIFEST_DIR")).join(SYSTEM)
            ))
        };
        (folder, connect)
    };
    rust::file(
        header,
        quote! {
            #docs
            ::sesame_runtime::assert_generator_abi!(#abi);

            #folder

            fn main() -> ::std::process::ExitCode {
                ::sesame_runtime::standalone::main(&::sesame_runtime::standalone::Standalone {
                    plan: ::core::include_str!("../monitor.plan.json").into(),
                    connect: #connect,
                })
            }
        },
    )
}
