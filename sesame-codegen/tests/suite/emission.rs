//! The files that come out of a plan.

use proptest::prelude::*;
use sesame_codegen::emit::{Problem, emit};
use sesame_codegen::files::Tree;
use sesame_codegen::plan::RunnerPlan;
use sesame_plan::testing::{node, ros2};

use crate::placed::environment;
use crate::plans::{awkward, small, with_program};

/// All files of trees in one text, those that only copy data left out.
fn shown(trees: &[Tree]) -> String {
    let mut text = String::new();
    for tree in trees {
        for (path, file) in &tree.files {
            if path == "campaign.plan.json" {
                continue;
            }
            let folder = if tree.folder.is_empty() { "." } else { &tree.folder };
            text = format!("{text}═══ {folder}/{path} ({:?})\n{}\n", file.owner, file.text());
        }
        text = format!("{text}═══ hooks: {:#?}\n", tree.hooks);
    }
    text
}

fn problems(runner: RunnerPlan) -> Vec<String> {
    emit(&[runner], &environment()).expect_err("the plan is bad").iter().map(Problem::to_string).collect()
}

#[test]
fn a_small_space() {
    let trees = emit(&[small("coverage_experiment"), small("random_experiment")], &environment()).unwrap();
    insta::assert_snapshot!(shown(&trees[..2]));
}

#[test]
fn every_type_and_awkward_names() {
    let trees = emit(&[awkward()], &environment()).unwrap();
    insta::assert_snapshot!(shown(&trees));
}

#[test]
fn a_simulator_that_is_a_program_needs_its_transport_and_no_crate() {
    let mut environment = environment();
    environment.dependencies.remove("kuka_cell_sim");
    let trees = emit(&[with_program("c")], &environment).unwrap();
    let file = |path: &str| trees[1].files[path].text().into_owned();
    insta::assert_snapshot!(file("src/generated/campaign.rs"));
    let features = r#"features = ["campaign", "in-process", "mcap", "process"]"#;
    assert!(file("Cargo.toml").contains(features), "{}", file("Cargo.toml"));
    let plan: sesame_plan::CampaignPlan = serde_json::from_str(&file("campaign.plan.json")).unwrap();
    assert_eq!(plan, with_program("c").plan);
}

#[test]
fn a_runner_of_a_ros_system_has_its_transport_and_says_how_nodes_are_remapped() {
    let mut runner = with_program("c");
    runner.plan.nodes = vec![sesame_plan::Node { publishes: sesame_plan::testing::topics(&[0]), ..node("arm") }];
    let path = format!("/{}", runner.plan.topics[0].paths[0]);
    runner.plan.topics[0].paths = vec![path.clone()];
    let cut = |cut| sesame_plan::Wiring { cut, ..sesame_plan::Wiring::default() };
    let wiring = (0..runner.plan.topics.len()).map(|topic| cut(topic == 0)).collect();
    runner.plan.simulator = ros2(0, wiring);
    let without_hooks = RunnerPlan { hooks: Vec::new(), operations: Vec::new(), ..runner.clone() };
    assert!(without_hooks.needs_a_runner(|_| false) && !without_hooks.has_hooks());
    assert!(!without_hooks.needs_a_runner(|feature| feature == "ros2"));
    let trees = emit(&[runner], &environment()).unwrap();
    let file = |path: &str| trees[1].files[path].text().into_owned();
    assert!(file("src/generated/campaign.rs").contains("::sesame_runtime::transport::ros2("));
    let features = r#"features = ["campaign", "in-process", "mcap", "process", "ros2"]"#;
    assert!(file("Cargo.toml").contains(features), "{}", file("Cargo.toml"));
    let line = format!("# node arm\nros2 run … --ros-args -r {path}:={path}/undisturbed\n```\n");
    assert!(file("README.md").contains(&line), "{}", file("README.md"));
}

#[test]
fn a_program_that_no_system_could_start_is_refused() {
    let mut runner = with_program("c");
    let transport = |program: &str, argument: &str| sesame_plan::Transport::Process {
        program: program.into(),
        arguments: vec![argument.into()],
        step_ns: Some(1),
    };
    for (program, argument) in [("", "a"), ("a\0", "a"), ("a", "\0")] {
        runner.plan.simulator.transport = transport(program, argument);
        assert_eq!(problems(runner.clone()).len(), 1, "{program:?} {argument:?}");
    }
    let mut runner = with_program("c");
    let command = sesame_plan::Command { program: "./stop".into(), arguments: vec!["\0".into()] };
    runner.plan.simulator.lifecycle.terminate = Some(command);
    assert_eq!(problems(runner).len(), 1);
}

#[test]
fn the_plan_is_in_the_crate_as_it_was_given() {
    let trees = emit(&[awkward()], &environment()).unwrap();
    let plan: sesame_plan::CampaignPlan = serde_json::from_str(&trees[1].files["campaign.plan.json"].text()).unwrap();
    assert_eq!(plan, awkward().plan);
}

#[test]
fn the_same_plans_give_the_same_bytes() {
    assert_eq!(emit(&[awkward()], &environment()), emit(&[awkward()], &environment()));
}

#[test]
fn a_metric_that_one_campaign_leaves_out_is_not_compiled_there_but_has_its_trait() {
    let trees = emit(&[small("c")], &environment()).unwrap();
    let generated = |file: &str| trees[1].files[&format!("src/generated/{file}.rs")].text().into_owned();
    assert!(generated("metrics").contains("trait TopSpeedHook"));
    assert!(!generated("registry").contains("top_speed"));
    assert!(trees[0].files.contains_key("hooks/top_speed.rs"));
}

#[test]
fn names_that_are_none_are_refused_all_at_once() {
    let mut runner = small("../../etc");
    runner.plan.topics[0].name = "a; fn evil() {}".into();
    runner.plan.messages[0].fields[0].name = "é".into();
    runner.hooks[1].metric = "..".into();
    runner.plan.simulator.transport =
        sesame_plan::Transport::InProcess { path: "crate::Evil<{ x }>".into(), step_ns: 1 };
    insta::assert_snapshot!(problems(runner).join("\n"));
}

#[test]
fn a_dependency_that_cargo_would_not_know_by_its_name_is_refused() {
    let mut environment = environment();
    let runtime = environment.dependencies["sesame-runtime"].clone();
    environment.dependencies.insert("a]\nb".to_owned(), runtime);
    let refused = emit(&[small("c")], &environment).expect_err("the name ends its table");
    let refused: Vec<String> = refused.iter().map(Problem::to_string).collect();
    assert_eq!(refused, ["`a]\\nb` is not the name of a package, as [dependencies] has them"]);
}

#[test]
fn metrics_that_would_share_a_file_are_refused() {
    let mut runner = small("c");
    runner.hooks[1].metric = "CollisionOccurrence".into();
    insta::assert_snapshot!(problems(runner).join("\n"));
}

#[test]
fn metrics_that_would_share_a_type_are_refused() {
    let mut runner = small("c");
    runner.hooks[0].metric = "level_1".into();
    runner.hooks[1].metric = "level1".into();
    assert!(problems(runner)[0].contains("`level_1` and `level1` would both be called `Level1`"));
}

#[test]
fn campaigns_that_differ_in_case_alone_are_refused() {
    let problems = emit(&[small("Night"), small("night")], &environment()).unwrap_err();
    assert_eq!(problems.len(), 1);
    assert!(problems[0].to_string().contains("`Night` and `night`"), "{}", problems[0]);
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(64))]

    /// Whatever the texts of a space are, every generated Rust file parses, and holds the same items as ever.
    #[test]
    fn texts_never_become_code(text in "\\PC{0,12}|[\\x00-\\x7f]{0,40}") {
        let mut runner = awkward();
        let plan = &mut runner.plan;
        plan.source.clone_from(&text);
        plan.doc.clone_from(&text);
        plan.generator.clone_from(&text);
        plan.messages[0].doc.clone_from(&text);
        plan.messages[0].fields[0].doc.clone_from(&text);
        plan.topics[1].doc.clone_from(&text);
        plan.topics[1].paths = vec![text.clone(), format!("{text}/x")];
        plan.topics[2].ty = sesame_plan::Type::Real { unit: Some(text.clone()) };
        plan.campaign.doc.clone_from(&text);
        runner.hooks[0].doc.clone_from(&text);
        runner.hooks[0].unit = Some(text.clone());
        let trees = emit(&[runner], &environment()).unwrap();
        let usual = emit(&[awkward()], &environment()).unwrap();
        for (tree, usual) in trees.iter().zip(&usual) {
            prop_assert_eq!(tree.files.keys().collect::<Vec<_>>(), usual.files.keys().collect::<Vec<_>>());
            for (path, file) in &tree.files {
                let kind = std::path::Path::new(path).extension().and_then(|kind| kind.to_str());
                if kind == Some("rs") {
                    let items = |source: &str| syn::parse_file(source).map(|file| file.items.len());
                    prop_assert_eq!(
                        items(&file.text()).unwrap(),
                        items(&usual.files[path].text()).unwrap(),
                        "{}", path
                    );
                }
                if kind == Some("toml") {
                    prop_assert!(toml::from_str::<toml::Table>(&file.text()).is_ok(), "{}", file.text());
                }
            }
        }
    }
}
