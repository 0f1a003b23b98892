//! Hooks that are still stubs, found in their text, so that nobody waits for a build to hear of them.

use std::path::{Path, PathBuf};

use proc_macro2::{TokenStream, TokenTree};

use crate::input;
use crate::names;
use crate::plan::RunnerPlan;

/// The metrics that the campaign optimises and whose hook calls `ctx.unimplemented()`, with the files of the hooks.
///
/// What a file cannot tell, rustc and the runner find later: a file that cannot be read or is not Rust is not listed.
pub fn unfilled_objectives(runner: &RunnerPlan, hooks: &Path) -> Vec<(String, PathBuf)> {
    let objectives = runner.plan.campaign.objectives.iter().map(|&id| &runner.plan.metric(id).name);
    objectives
        .filter(|&name| runner.hooks.iter().any(|hook| hook.metric == *name))
        .map(|name| (name.clone(), hooks.join(format!("{}.rs", names::snake(name)))))
        .filter(|(_, file)| input::text(file).is_ok_and(|text| is_stub(&text)))
        .collect()
}

/// The hooks that the campaign calls and that are filled in in this folder, with their files. One that cannot be read
/// is not listed.
pub fn filled_in(runner: &RunnerPlan, hooks: &Path) -> Vec<(String, PathBuf)> {
    let files = runner.called_hooks().map(|name| (name.to_owned(), hooks.join(format!("{}.rs", names::snake(name)))));
    files.filter(|(_, file)| input::text(file).is_ok_and(|text| !is_stub(&text))).collect()
}

/// The hooks that the text of a module in Python does not seem to have. It is not run, so names are looked for where
/// they are written: in a decorator, or as the name of a function or class.
pub fn missing_in_python(module: &str, needed: &[String]) -> Vec<String> {
    let code: Vec<&str> = module.lines().map(|line| line.split('#').next().unwrap_or_default().trim()).collect();
    let defines = |line: &str, name: &str| {
        let defined = line.strip_prefix("def ").or_else(|| line.strip_prefix("class "));
        let defined = defined.and_then(|rest| rest.split(['(', ':', '[', ' ']).next()).unwrap_or_default();
        defined == name || heck::ToSnakeCase::to_snake_case(defined) == *name
    };
    let names = |line: &str, name: &str| {
        line.starts_with('@') && [format!("\"{name}\""), format!("'{name}'")].iter().any(|name| line.contains(name))
    };
    let is_there = |name: &str| code.iter().any(|line| defines(line, name) || names(line, name));
    needed.iter().filter(|name| !is_there(name)).cloned().collect()
}

/// Whether a hook is still a stub: whether its code calls a method `unimplemented`; comments and texts do not count.
pub fn is_stub(code: &str) -> bool {
    code.parse::<TokenStream>().is_ok_and(calls)
}

fn calls(code: TokenStream) -> bool {
    let mut after_dot = false;
    for token in code {
        match token {
            TokenTree::Ident(name) if after_dot && name == "unimplemented" => return true,
            TokenTree::Group(group) if calls(group.stream()) => return true,
            TokenTree::Punct(punct) => {
                after_dot = punct.as_char() == '.';
                continue;
            }
            _ => {}
        }
        after_dot = false;
    }
    false
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_a_call_counts() {
        assert!(is_stub("fn on_speed(ctx: &mut Context) { let _ = 1; ctx.unimplemented(); }"));
        assert!(!is_stub("// ctx.unimplemented();\nfn f() { ctx.set(1.0); }"));
        assert!(!is_stub("fn f() { let text = \"ctx.unimplemented()\"; unimplemented!() }"));
        assert!(!is_stub("not Rust {"));
    }
}
