//! Spaces of several files, and campaigns made from others.

use std::collections::BTreeMap;

use sesame_dsl::diagnostic::render;
use sesame_dsl::model::{ActivationMode, Exploration, Recorded, Search, Space, Strategy};
use sesame_dsl::source::SourceMap;
use sesame_dsl::{Analysis, analyse, load_imports};

const CELL: &str = r#"
/// A space of its own as well.
space cell
system {
  simulator sim = in_process "cell_sim::Cell" { step 20ms }
  topic link0 = "joints/link0" : real[rad]
  topic spare = "spare" : int
}
metric fuzzing_time minimise = fuzzing_time()
/// Where links are too high.
metric high default 0 { hook on link0 }
operation jitter on link0 = random offset [-0.3rad, 0.3rad]
operation unused on link0 = blackhole
"#;

const MAIN: &str = r#"space demo
import "shared/cell.sesame"
campaign c { objectives fuzzing_time  observes high  operations jitter 1 per test
  search random { evaluations 10  seed 3 }  end after 70s }
"#;

/// Analyses the first of some files, of which `broken.sesame` cannot be read.
fn analyse_files(files: &[(&str, &str)]) -> (SourceMap, Analysis, Vec<String>) {
    let by_name: BTreeMap<&str, &str> = files.iter().copied().collect();
    let mut sources = SourceMap::new();
    let mut read = Vec::new();
    let root = sources.add(files[0].0, files[0].1);
    load_imports(&mut sources, root, |name| {
        read.push(name.to_owned());
        let text = by_name.get(name).map(|text| (*text).to_owned());
        text.ok_or_else(|| "there is no such file".to_owned())
    });
    let analysis = analyse(&sources, root);
    (sources, analysis, read)
}

fn said(files: &[(&str, &str)]) -> String {
    let (sources, analysis, _) = analyse_files(files);
    assert_eq!(analysis.model.is_some(), !analysis.has_errors());
    render::human(&analysis.diagnostics, &sources, false)
}

fn space(files: &[(&str, &str)]) -> Space {
    let (sources, analysis, _) = analyse_files(files);
    let said = render::human(&analysis.diagnostics, &sources, false);
    analysis.model.unwrap_or_else(|| panic!("{said}"))
}

#[test]
fn an_imported_system_is_as_if_it_stood_here() {
    let files = [("spaces/demo.sesame", MAIN), ("spaces/shared/cell.sesame", CELL)];
    let space = space(&files);
    assert_eq!(space.declaration.name, "demo", "the imported file's own name is none here");
    assert_eq!(space.topics.len(), 2);
    let high = space.metrics.values().find(|metric| metric.declaration.name == "high").unwrap();
    assert_eq!((space.file_of(&high.declaration), high.declaration.line), ("shared/cell.sesame", 11));
    let campaign = &space.campaigns.values().next().unwrap().declaration;
    assert_eq!((space.file_of(campaign), campaign.line), ("demo.sesame", 3));
    assert_eq!(said(&files), "", "unused declarations of an import are not reported");
}

#[test]
fn a_file_that_two_others_import_is_there_once_and_before_them() {
    let files = [
        ("demo.sesame", "space demo import \"a.sesame\" import \"b/b.sesame\""),
        ("a.sesame", "import \"cell.sesame\" operation a on link0 = blackhole"),
        ("b/b.sesame", "import \"../cell.sesame\" operation b on link0 = blackhole"),
        ("cell.sesame", CELL),
    ];
    let (_, analysis, mut read) = analyse_files(&files);
    read.sort();
    assert_eq!(read, ["a.sesame", "b/b.sesame", "cell.sesame"], "each is read once");
    let space = analysis.model.unwrap();
    let names: Vec<&str> = space.operations.values().map(|operation| operation.declaration.name.as_str()).collect();
    assert_eq!(names, ["jitter", "unused", "a", "b"]);
}

#[test]
fn messages_may_come_from_one_file_and_the_simulator_from_another() {
    let types = "system { message Zone { level: real[mm] } }";
    let main = "space demo import \"types.sesame\" system {
        simulator sim = in_process \"a::B\" { step 1ms }  topic zones = \"zones\" : Zone }";
    assert_eq!(space(&[("demo.sesame", main), ("types.sesame", types)]).messages.len(), 1);
}

#[test]
fn a_missing_import_is_one_mistake_and_names_what_was_tried() {
    insta::assert_snapshot!(said(&[("spaces/demo.sesame", MAIN)]));
}

#[test]
fn a_name_of_two_files_is_shown_in_both() {
    let main = format!("{MAIN}metric high default 0 {{ hook on link0 }}\n");
    insta::assert_snapshot!(said(&[("demo.sesame", &main), ("shared/cell.sesame", CELL)]));
}

#[test]
fn a_mistake_is_shown_in_the_file_it_is_in() {
    let cell = CELL.replace("hook on link0", "hook on lnk0");
    let (sources, analysis, _) = analyse_files(&[("demo.sesame", MAIN), ("shared/cell.sesame", &cell)]);
    let shown = render::short(&analysis.diagnostics, &sources);
    assert_eq!(shown, "shared/cell.sesame:11:33: error[E0203]: no topic named `lnk0`: not found in this space\n");
    let json = render::json(&analysis.diagnostics, &sources);
    assert!(json.contains("shared/cell.sesame"), "{json}");
}

#[test]
fn files_that_import_each_other_are_a_circle() {
    insta::assert_snapshot!(said(&[
        ("demo.sesame", "space demo\nimport \"a.sesame\"\n"),
        ("a.sesame", "import \"b.sesame\"\n"),
        ("b.sesame", "// here\nimport \"./demo.sesame\"\nimport \"b.sesame\"\n"),
        ("cell.sesame", CELL),
    ]));
}

#[test]
fn a_long_chain_of_imports_is_refused_and_not_followed_for_ever() {
    let files: Vec<(String, String)> =
        (0..200).map(|n| (format!("f{n}.sesame"), format!("import \"f{}.sesame\"", n + 1))).collect();
    let files: Vec<(&str, &str)> = files.iter().map(|(name, text)| (name.as_str(), text.as_str())).collect();
    assert!(said(&files).contains("more than 64 levels deep"));
}

/// The campaign of a name, after some more text in the demo.
fn campaign(more: &str, name: &str) -> (Space, sesame_dsl::model::Campaign) {
    let main = format!("{MAIN}{more}");
    let space = space(&[("demo.sesame", &main), ("shared/cell.sesame", CELL)]);
    let id = space.campaign(name).expect("the text declares it");
    let campaign = space.campaigns[id].clone();
    (space, campaign)
}

#[test]
fn a_clause_replaces_the_inherited_one_whole_and_all_others_stay() {
    let (space, first) = campaign("campaign d from c { search random { evaluations 20 } }", "c");
    let (_, second) = campaign("campaign d from c { search random { evaluations 20 } }", "d");
    assert_eq!((&second.objectives, second.end_after), (&first.objectives, 70.0));
    assert_eq!(second.observed, first.observed);
    assert_eq!(second.from, space.campaign("c"));
    let Search::Strategy { evaluations, template, strategy: Strategy::Random } = second.search else {
        panic!("{second:?}")
    };
    assert_eq!((evaluations, template.operations.len()), (20, 1));
    assert_eq!((first.seed, second.seed), (3, 1), "the inherited seed went with its search");
}

#[test]
fn chains_inherit_from_what_was_inherited_wherever_they_stand() {
    let (_, last) = campaign("campaign f from e { } campaign e from d { end after 9s } campaign d from c { }", "f");
    assert_eq!((last.end_after, last.seed), (9.0, 3));
}

#[test]
fn a_campaign_that_does_not_search_inherits_nothing_of_a_search() {
    let test = "test t { jitter offset [0rad, 0.1rad] from 1s to 2s }";
    let (_, repeats) = campaign(&format!("{test} campaign d from c {{ repeat t 3 times }}"), "d");
    assert!(matches!(repeats.search, Search::Repeat { times: 3, .. }));
    assert_eq!((repeats.objectives.len(), repeats.observed.len(), repeats.end_after), (0, 1, 70.0));
    let (_, watches) = campaign("campaign d from c { passive 5 times { seed 8 } }", "d");
    assert_eq!((watches.search, watches.seed, watches.objectives.len()), (Search::Passive { times: 5 }, 8, 0));
}

#[test]
fn explorations_are_inherited_where_they_can_work_and_reasons_to_stop_by_every_search() {
    let base = "metric near = last(spare)
        test t { jitter offset [0rad, 0.1rad] from 1s to 2s }
        campaign base from c { search nsga2 { population 4  evaluations 20 }  coverage { T1 [0, 1] cells 6 }
          construct { share 30% }  stop { completeness 90% }  confirm 3 times }";
    let inherited = |text: &str| {
        let (_, campaign) = campaign(&format!("{base} campaign d from base {{ {text} }}"), "d");
        let explores = campaign.exploration.map(|exploration| match exploration {
            Exploration::Boost { .. } => "boost",
            Exploration::Construct { .. } => "construct",
            Exploration::Predict { .. } => "predict",
            Exploration::Novelty { .. } => "novelty",
        });
        assert_eq!(
            campaign.confirm.is_some(),
            campaign.search.template().is_some(),
            "every search confirms what it finds"
        );
        (explores, campaign.coverage.is_some(), campaign.stop.len())
    };
    assert_eq!(inherited(""), (Some("construct"), true, 1));
    assert_eq!(inherited("search nsga2 { population 6  evaluations 30 }"), (Some("construct"), true, 1));
    assert_eq!(inherited("boost fixed { }"), (Some("boost"), true, 1), "one way replaces the other");
    assert_eq!(inherited("search random { evaluations 20 }"), (None, true, 1), "a baseline");
    assert_eq!(inherited("search map_elites { population 4  evaluations 20 }"), (None, true, 1));
    assert_eq!(inherited("activate by condition over near"), (None, true, 1));
    assert_eq!(inherited("activate by condition over near  predict { }"), (Some("predict"), true, 1));
    assert_eq!(inherited("repeat t 2 times"), (None, false, 0));
    assert_eq!(inherited("passive 2 times"), (None, false, 0));
}

#[test]
fn a_mistake_in_a_clause_is_reported_once_however_often_it_is_inherited() {
    let main = MAIN.replace("evaluations 10", "evaluations 0");
    let main = format!("{main}campaign d from c {{ }} campaign e from d {{ end after 3s }}");
    let said = said(&[("demo.sesame", &main), ("shared/cell.sesame", CELL)]);
    assert_eq!(said.matches("error[").count(), 1, "{said}");
}

/// A campaign by condition with an operation of the user's and traces, to be imported.
const GROWN: &str = r"
metric near = last(link0)
operation bend on link0 = custom { points: int [3, 20] } start contains near
campaign base { objectives fuzzing_time  operations bend 1 per test  activate by condition over high, near
  search random { evaluations 10 }  end after 70s  record mcap failing }
";

#[test]
fn conditions_traces_and_custom_operations_come_from_imports_and_other_campaigns() {
    let cell = format!("{CELL}{GROWN}");
    let main = "space demo import \"cell.sesame\"
        metric gap = last(spare)
        campaign more from base { search random { evaluations 20 } }
        campaign watch from base { passive 3 times  observes high }
        campaign all from more { record mcap all  activate by condition over gap, near }";
    let files = [("demo.sesame", main), ("cell.sesame", cell.as_str())];
    let space = space(&files);
    let campaign = |name| &space.campaigns[space.campaign(name).unwrap()];
    let variables = |name| {
        let Search::Strategy { template, strategy: Strategy::Random, .. } = &campaign(name).search else {
            panic!("{name} searches")
        };
        let ActivationMode::Condition(grown) = &template.activation else { panic!("{name} grows conditions") };
        let names = grown.variables.iter().map(|variable| space.metrics[variable.metric].declaration.name.as_str());
        names.collect::<Vec<_>>()
    };
    assert_eq!((variables("more"), variables("all")), (vec!["high", "near"], vec!["gap", "near"]));
    assert_eq!(campaign("watch").search, Search::Passive { times: 3 });
    let recorded = ["more", "watch", "all"].map(|name| campaign(name).record);
    assert_eq!(recorded, [Some(Recorded::Failing), Some(Recorded::Failing), Some(Recorded::All)]);
    assert_eq!(said(&files), "", "a metric that conditions compare is measured");
}

#[test]
fn what_inherited_conditions_cannot_contain_is_said_of_the_campaign_that_wrote_them() {
    let cell = format!("{CELL}{}", GROWN.replace("over high, near", "over high"));
    let main =
        "space demo import \"cell.sesame\" campaign more from base { end after 60s } campaign most from more { }";
    let said = said(&[("demo.sesame", main), ("cell.sesame", &cell)]);
    assert_eq!(said.matches("error[E0505]").count(), 1, "{said}");
    assert!(said.contains("not a variable of campaign `base`"), "{said}");
}
