//! Random valid spaces: all of them are checked and generated, and some are compiled and run.

use std::fmt::Write as _;
use std::fs;
use std::ops::Range;
use std::panic::catch_unwind;
use std::path::{Path, PathBuf};

use proc_macro2::{TokenStream, TokenTree};
use sesame_codegen::emit::emit;
use sesame_codegen::environment::{EnvironmentOptions, environment};
use sesame_codegen::files::Tree;
use sesame_codegen::output::{Mode, apply};
use sesame_codegen::plan::RunnerPlan;
use sesame_plan::CampaignPlan;
use sesame_tests::models::{MARK, Model, model};
use sesame_tests::{Done, cargo, command, copy, done, fresh_folder, target, turn, workspace};
use sesamec::frontend::{Look, SESAME};

/// The plans of a space in a folder, which has to be free of errors.
fn plans(seed: u64, model: &Model, folder: &Path) -> Vec<RunnerPlan> {
    let file = folder.join("random.sesame");
    let text = fs::read_to_string(&file).unwrap();
    let checked = (SESAME.check)(file.to_str().unwrap(), &text, Look::Human { colour: false });
    assert_eq!(checked.errors, 0, "space {seed} in {}:\n{}", folder.display(), checked.diagnostics);
    assert_eq!(checked.plans.len(), model.campaigns.len(), "space {seed}");
    checked.plans
}

fn trees(seed: u64, folder: &Path, plans: &[RunnerPlan]) -> Vec<Tree> {
    let options = EnvironmentOptions::default();
    let environment = environment(&folder.join("random.sesame"), &folder.join("runners"), plans, &options)
        .unwrap_or_else(|errors| panic!("space {seed}: {errors:?}"));
    emit(plans, &environment).unwrap_or_else(|problems| panic!("space {seed}: {problems:?}"))
}

/// The crate of the simulator that all these spaces name.
fn simulator(folder: &Path) {
    copy(&workspace().join("tests/simulators/anything"), folder);
    let manifest = format!(
        "[package]\nname = \"anything_sim\"\nversion = \"0.1.0\"\nedition = \"2024\"\n\n[dependencies]\n\
         sesame-runtime = {{ path = \"{}\" }}\nserde_json = \"1\"\n",
        workspace().join("runtime").display()
    );
    fs::write(folder.join("Cargo.toml"), manifest).unwrap();
}

/// All words that are code. Comments are none, and what stands in quotes is none.
fn words(tokens: TokenStream, found: &mut Vec<String>) {
    for token in tokens {
        match token {
            TokenTree::Group(group) => words(group.stream(), found),
            TokenTree::Ident(word) => found.push(word.to_string()),
            TokenTree::Punct(_) | TokenTree::Literal(_) => {}
        }
    }
}

/// Insists that no text of the space became anything else.
fn texts_are_texts(seed: u64, path: &str, contents: &str) {
    let parts: Vec<&str> = path.split('/').collect();
    let plain = |part: &&str| {
        !part.is_empty() && !part.trim_matches('.').is_empty() && !part.contains(|c: char| c == '\\' || c.is_control())
    };
    assert!(parts.iter().all(plain) && !path.contains(MARK), "space {seed}: {path:?}");
    match path.rsplit('.').next() {
        Some("rs") => {
            syn::parse_file(contents).unwrap_or_else(|error| panic!("space {seed}: {path}: {error}\n{contents}"));
            let mut found = Vec::new();
            words(contents.parse().expect("it is Rust"), &mut found);
            assert!(!found.iter().any(|word| word.contains(MARK)), "space {seed}: {path}:\n{contents}");
            // What rustc says of a missing hook is a format, and no name of a file is one.
            for line in contents.lines().filter(|line| line.starts_with("    message = ")) {
                assert!(!line.replace("\\u{", "").replace("{{", "").contains('{'), "space {seed}: {path}: {line}");
            }
            // What rustc refuses even in a comment: signs that make a line read other than it is.
            let turning = |c: char| matches!(c, '\u{202a}'..='\u{202e}' | '\u{2066}'..='\u{2069}');
            assert!(!contents.contains(turning), "space {seed}: {path}:\n{contents}");
        }
        Some("toml") => {
            let table: toml::Table =
                toml::from_str(contents).unwrap_or_else(|error| panic!("space {seed}: {path}: {error}"));
            assert!(!table.keys().any(|key| key.contains(MARK)), "space {seed}: {path}:\n{contents}");
        }
        _ => {}
    }
}

#[test]
fn random_valid_spaces_generate_and_their_texts_stay_texts() {
    generate("random spaces in memory", 0..60);
}

#[test]
#[ignore = "long: generates for thousands of spaces"]
fn thousands_of_random_valid_spaces_generate_and_their_texts_stay_texts() {
    generate("many random spaces in memory", 10_000..13_000);
}

fn generate(name: &str, seeds: Range<u64>) {
    let folder = fresh_folder(name);
    simulator(&folder.join("simulator"));
    let failed: Vec<u64> = seeds.filter(|&seed| catch_unwind(|| generates(seed, &folder)).is_err()).collect();
    assert!(failed.is_empty(), "spaces {failed:?}");
}

fn generates(seed: u64, folder: &Path) {
    let model = model(seed);
    model.write(folder, "simulator");
    let plans = plans(seed, &model, folder);
    let made = trees(seed, folder, &plans);
    assert_eq!(made, trees(seed, folder, &plans), "space {seed} generates the same again");
    for tree in &made {
        for (path, file) in &tree.files {
            let path = [&tree.folder, path.as_str()].into_iter().filter(|part| !part.is_empty());
            let path = path.collect::<Vec<_>>().join("/");
            texts_are_texts(seed, &path, str::from_utf8(&file.contents).unwrap());
            if path.ends_with("campaign.plan.json") {
                let plan: CampaignPlan = serde_json::from_slice(&file.contents).unwrap();
                assert!(plans.iter().any(|runner| runner.plan == plan), "space {seed}");
            }
            if path.ends_with("Cargo.toml") {
                let manifest: toml::Table = str::from_utf8(&file.contents).unwrap().parse().unwrap();
                assert_eq!(features_that_are_missing(&manifest), [""; 0], "space {seed}: {path}");
            }
        }
    }
}

/// The features of the runtime that a manifest asks for and the runtime does not have.
fn features_that_are_missing(manifest: &toml::Table) -> Vec<String> {
    let asked = manifest.get("dependencies").and_then(|all| all.get("sesame-runtime")?.get("features")?.as_array());
    let runtime: toml::Table = fs::read_to_string(workspace().join("runtime/Cargo.toml")).unwrap().parse().unwrap();
    let has = runtime["features"].as_table().unwrap();
    let asked = asked.into_iter().flatten().map(|name| name.as_str().unwrap());
    asked.filter(|name| !has.contains_key(*name)).map(str::to_owned).collect()
}

/// Compiles the runners of these spaces, one campaign of each, and runs one search or repetition with each.
///
/// Linking as many programs would take most of the time and of the disk, so runners become libraries of one program
/// that is told by `RUNNER` which of them it is. Nothing else of them is changed, and of the stubs only that they are
/// filled in.
fn compile_and_run(name: &str, seeds: impl IntoIterator<Item = u64>) {
    let folder = fresh_folder(name);
    simulator(&folder.join("simulator"));
    let [mut members, mut dependencies, mut arms, mut profiles] = [const { String::new() }; 4];
    let mut spaces: Vec<(u64, PathBuf, PathBuf)> = Vec::new();
    for seed in seeds {
        let model = model(seed);
        let home = folder.join(format!("space {seed}"));
        model.write(&home, "../simulator");
        let plans = plans(seed, &model, &home);
        let mut trees = trees(seed, &home, &plans);
        trees.truncate(2);
        let runner = trees[1].folder.clone();
        apply(&home.join("runners"), &trees, Mode::Write).unwrap();
        filled_in(&home.join("runners/hooks"));
        let runner = home.join("runners").join(runner);
        as_library(&runner, &format!("runner-{seed}"));
        let path = runner.strip_prefix(&folder).unwrap().display();
        writeln!(members, "  {:?},", path.to_string()).unwrap();
        writeln!(dependencies, "runner-{seed} = {{ path = {:?} }}", path.to_string()).unwrap();
        writeln!(profiles, "\n[profile.dev.package.runner-{seed}]\nopt-level = 0").unwrap();
        writeln!(arms, "        Ok(\"{seed}\") => runner_{seed}::main(),").unwrap();
        spaces.push((seed, home, runner));
    }
    // The profile of runners, so that what they are made of is compiled once for all tests.
    let manifest = format!(
        "[workspace]\nresolver = \"3\"\nmembers = [\n{members}]\n\n[package]\nname = \"random-runners\"\nversion = \"0.0.0\"\n\
         edition = \"2024\"\n\n[dependencies]\n{dependencies}\n[profile.dev]\nopt-level = 3\ndebug = false\n\n\
         [profile.dev.package.libsqlite3-sys]\nopt-level = 1\n{profiles}"
    );
    fs::write(folder.join("Cargo.toml"), manifest).unwrap();
    fs::copy(workspace().join("Cargo.lock"), folder.join("Cargo.lock")).unwrap();
    fs::create_dir_all(folder.join("src")).unwrap();
    let main = format!(
        "fn main() -> std::process::ExitCode {{\n    match std::env::var(\"RUNNER\").as_deref() {{\n{arms}        \
         other => panic!(\"{{other:?}}\"),\n    }}\n}}\n"
    );
    fs::write(folder.join("src/main.rs"), main).unwrap();
    let built = cargo(&turn(), &folder, &["build"]).expect(0);
    let warned = built.err.lines().filter(|line| line.starts_with("warning")).collect::<Vec<_>>();
    assert!(warned.is_empty(), "{}", built.err);
    let program = target().join("debug/random-runners");
    let failed: Vec<u64> = spaces
        .into_iter()
        .filter(|(seed, home, runner)| catch_unwind(|| runs(&program, *seed, home, runner)).is_err())
        .map(|(seed, ..)| seed)
        .collect();
    assert!(failed.is_empty(), "spaces {failed:?}");
}

fn runs(program: &Path, seed: u64, home: &Path, runner: &Path) {
    let Done { code, out, err } = done(
        command(program)
            // Random spaces often disturb nothing, or break off.
            .args(["run", "--workers", "1", "--fail-on", "nothing"])
            .env("RUNNER", seed.to_string())
            .env("PLAN", runner.join("campaign.plan.json"))
            .current_dir(home),
    );
    assert_eq!(code, Some(0), "space {seed}:\n{out}\n{err}");
    let results = fs::read_dir(runner.join("results")).unwrap().next().unwrap().unwrap().path();
    came_out_well(seed, &results);
}

/// What a run left: every test completed or was void, and no text of the space is more than one in it.
fn came_out_well(seed: u64, results: &Path) {
    let database = rusqlite::Connection::open(results.join("results.sqlite")).unwrap();
    let count = |what: &str| database.query_row(what, [], |row| row.get::<_, i64>(0)).unwrap();
    assert_eq!(count("SELECT count(*) FROM tests WHERE outcome NOT IN ('completed', 'no_effect')"), 0, "space {seed}");
    assert!(count("SELECT count(*) FROM tests") >= 2, "space {seed}");
    assert_eq!(count("SELECT count(*) FROM results"), count("SELECT count(*) FROM tests"), "space {seed}");
    assert_eq!(count(&format!("SELECT count(*) FROM sqlite_master WHERE name LIKE '%{MARK}%'")), 0, "space {seed}");
    let page = fs::read_to_string(results.join("report.html")).unwrap();
    for tag in ["<script>injected", "<b injected", "<!-- injected"] {
        assert!(!page.contains(tag), "space {seed}: {tag}");
    }
}

fn filled_in(hooks: &Path) {
    let Ok(entries) = fs::read_dir(hooks) else { return };
    for entry in entries {
        let path = entry.unwrap().path();
        let stub = fs::read_to_string(&path).unwrap();
        let by = if stub.contains("sesame_runtime::metric::Context;") { "ctx.set(1.0);" } else { "let _ = ctx;" };
        assert!(stub.contains("ctx.unimplemented();"), "{stub}");
        fs::write(&path, stub.replace("ctx.unimplemented();", by)).unwrap();
    }
}

/// Makes a runner the member of a workspace, as a library with its `main`.
fn as_library(runner: &Path, name: &str) {
    let main = fs::read_to_string(runner.join("src/main.rs")).unwrap();
    let library = main.replace("\nfn main()", "\npub fn main()");
    assert_ne!(main, library);
    fs::write(runner.join("src/lib.rs"), library).unwrap();
    fs::remove_file(runner.join("src/main.rs")).unwrap();
    let mut manifest: toml::Table = fs::read_to_string(runner.join("Cargo.toml")).unwrap().parse().unwrap();
    manifest["package"].as_table_mut().unwrap().insert("name".into(), name.into());
    manifest.retain(|key, _| key != "workspace" && key != "profile");
    fs::write(runner.join("Cargo.toml"), toml::to_string(&manifest).unwrap()).unwrap();
    fs::remove_file(runner.join("Cargo.lock")).unwrap();
}

/// Whether the runners of a space need no library that nothing else in the suite compiles: those of a lab over
/// SimlogAPI take more time than all the rest, and are compiled by the long suite.
fn shares_what_it_needs(seed: u64) -> bool {
    let Model { text, imported, .. } = model(seed);
    let imported = imported.map(|(_, text)| text).unwrap_or_default();
    ![text, imported].iter().any(|text| text.contains("= simlog \""))
}

#[test]
fn six_random_valid_spaces_compile_and_run() {
    compile_and_run("random spaces", (0..).filter(|&seed| shares_what_it_needs(seed)).take(6));
}

#[test]
#[ignore = "long: compiles two hundred runners"]
fn two_hundred_random_valid_spaces_compile_and_run() {
    for batch in 0..4 {
        compile_and_run("many random spaces", 1_000 + 50 * batch..1_050 + 50 * batch);
        println!("{} random spaces compile and run", 50 * (batch + 1));
    }
}
