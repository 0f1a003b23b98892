//! What an import says of what it leaves out or changes, and what results say of it later: all of it is true.

use std::collections::BTreeSet;
use std::fs;
use std::path::Path;

use sesame_analysis as analysis;
use sesame_analysis::Selection;
use sesame_legacy::{Counted, Imported, LACKS, LEFT_OUT};
use sesame_plan::Exploration;
use sesame_record::{NoPoint, Repository};
use sesame_report as report;
use sesame_report::TextOptions;
use sesame_search::sspr::Convention;
use sesamec::frontend::{Look, SESAME};

use crate::odd_originals::{at, recorded, said, scanned, with};
use crate::originals::{CAMPAIGN, METRICS, NUMBERED, OPERATIONS, SYSTEM, imported, plan, space};

/// The words in quotes in the grammar.
fn words_of_the_language() -> BTreeSet<String> {
    let grammar = Path::new(env!("CARGO_MANIFEST_DIR")).join("../grammars/sesame.pest");
    let text = fs::read_to_string(grammar).unwrap();
    text.lines().flat_map(|line| line.split('"').skip(1).step_by(2)).map(str::to_owned).collect()
}

#[test]
fn what_imports_leave_out_has_the_words_that_they_name_and_no_word_that_would_say_it() {
    let words = words_of_the_language();
    assert!(words.contains("boost") && words.contains("untimed"), "{words:?}");
    let mut names = BTreeSet::new();
    for left in &LEFT_OUT {
        for word in left.has {
            assert!(words.contains(*word), "`{word}` is no word of the language any more: {left:?}");
        }
        for word in left.lacks {
            assert!(!words.contains(*word), "the language has `{word}` now: is this still true? {left:?}");
        }
        for word in left.why.split('`').skip(1).step_by(2).flat_map(str::split_whitespace) {
            assert!(words.contains(word), "`{word}` is no word of the language: {left:?}");
        }
        for name in left.names {
            assert!(names.insert(name), "`{name}` is there twice");
        }
    }
}

#[test]
fn what_imports_say_that_the_language_lacks_it_refuses() {
    let space = "space s\nsystem {\n  simulator c = process \"c\" { step 20ms }\n  topic joint = \"joint\" : real\n  \
                 topic other = \"other\" : real\n  node n { publishes joint, other }\n}\n\
                 metric near minimise default 0 = min(other)\nmetric time_active minimise = fuzzing_time()\n\
                 operation push on joint = random offset [-1, 1] within [0s, 9s]\n";
    let errors = |text: &str| (SESAME.check)("s.sesame", text, Look::Human { colour: false });
    let plain = errors(space);
    assert_eq!(plain.errors, 0, "{}", plain.diagnostics);
    for lack in &LACKS {
        let found = errors(&format!("{space}{}\n", lack.attempt));
        assert!(found.errors > 0, "the language can do this now: {lack:?}");
        // It is refused for what it says, and not because its words are wrong.
        assert!(!found.diagnostics.contains("E0101"), "{lack:?}\n{}", found.diagnostics);
    }
}

const BOOSTS: &str = "useMutationEnhancingCoverage=\"true\">";

/// The campaign with a strategy for boosting in the place of the old attribute.
fn boosted_by(strategy: &str) -> Imported {
    let instead = format!(">\n      <coverageBoostingStrategy xsi:type=\"TestingMM:{strategy}/>");
    imported(&with(&[(&format!(" {BOOSTS}"), &instead)]))
}

fn exploration(imported: &Imported) -> Option<Exploration> {
    plan(imported, "first_campaign").campaign.exploration
}

#[test]
fn coverage_boosting_is_imported_with_the_numbers_of_the_file() {
    let fixed = "FixedNSGACoverageBoostingStrategy\"";
    let linear = "LinearNSGACoverageBoostingStrategy\"";
    let counts = "campaign `first-campaign`: `boost fixed` counts children where the original counted parents, so that";
    for (strategy, boost, note) in [
        (
            fixed.to_owned(),
            "fixed { every 2 generations  every 2 iterations  tries 10 }",
            format!("{counts} its 2 boosted all children"),
        ),
        (
            format!("{fixed} useBoostingOnceEveryGenerations=\"3\" useBoostingOnceEveryIterations=\"4\""),
            "fixed { every 3 generations  every 4 iterations  tries 10 }",
            format!("{counts} its 4 boosted both children of every second pair of parents"),
        ),
        (
            format!("{fixed} useBoostingOnceEveryGenerations=\"0\" useBoostingOnceEveryIterations=\"1\""),
            "fixed { every 1 generations  every 1 iterations  tries 10 }",
            "boosting every 0 generations, which the original cannot do, is every generation now".to_owned(),
        ),
        (
            format!(
                "{linear} startingBoostingCount=\"10\" endingBoostingCount=\"1\" countDropEveryGeneration=\"1\" \
                 useBoostingOnceEveryGenerations=\"1\""
            ),
            "linear { every 1 generations  from 10 to 1  drop 1  tries 10 }",
            String::new(),
        ),
        (
            format!("{linear} startingBoostingCount=\"2\" endingBoostingCount=\"5\""),
            "linear { every 2 generations  from 5 to 5  drop 0  tries 10 }",
            "boosting from 2 to 5 children is from 5 to 5 now".to_owned(),
        ),
    ] {
        let imported = boosted_by(&strategy);
        assert!(matches!(exploration(&imported), Some(Exploration::Boost { .. })), "{strategy}");
        assert!(imported.text().contains(&format!("boost      {boost}\n")), "{strategy}\n{}", imported.text());
        let said = said(&imported);
        assert!(said.contains(&note), "{note}\n{said}");
        assert!(!said.contains("Left out campaign") && !said.contains("BoostingStrategy"), "{said}");
    }
    let old = imported(&with(&[]));
    assert!(old.text().contains("boost      fixed { every 2 generations  every 2 iterations  tries 10 }"));
    assert!(said(&old).contains("campaign `first-campaign` boosts coverage, and the file does not say how"));
    let not = imported(&with(&[(BOOSTS, "useMutationEnhancingCoverage=\"false\">")]));
    assert_eq!(exploration(&not), None);
}

#[test]
fn boosting_that_a_campaign_cannot_have_is_told_with_the_reason() {
    let unknown = boosted_by("OtherStrategy\"");
    assert_eq!(exploration(&unknown), None);
    let told = said(&unknown);
    assert!(told.contains("its boosting: the original has no strategy `OtherStrategy`"), "{told}");
    let without_cells = imported(&with(&[
        ("      <dimensionRecords maxValue=\"1.0\" count=\"4\"/>\n", ""),
        ("      <dimensionRecords dimID=\"O2_DELAY_COUNT\" maxValue=\"3.0\" count=\"3\"/>\n", ""),
    ]));
    assert_eq!(exploration(&without_cells), None);
    let told = said(&without_cells);
    let needs = "its boosting: `boost` needs the cells of a `coverage`, which the file does not give; \
                 add `coverage { … }` and `boost fixed { }`";
    assert!(told.contains(needs), "{told}");
    let by_condition = imported(&with(&[(
        "includedOperations=\"_o0 _o1 _o2\">",
        "conditionMetrics=\"_m1 _m2\" includedOperations=\"_o0 _o1 _o2\">",
    )]));
    assert_eq!(exploration(&by_condition), None);
    let told = said(&by_condition);
    assert!(told.contains("its boosting: `boost` works with `activate by time` only; `predict { }` is for"), "{told}");
}

#[test]
fn an_operation_whose_time_does_not_count_is_untimed() {
    let imported =
        imported(&with(&[("xmi:id=\"_o1\" name=\"lose\"", "xmi:id=\"_o1\" includeInTiming=\"false\" name=\"lose\"")]));
    let plan = plan(&imported, "first_campaign");
    let timed: Vec<(&str, bool)> =
        plan.operations.iter().map(|operation| (operation.name.as_str(), operation.timed)).collect();
    assert_eq!(timed, [("push", true), ("lose", false), ("steer_x", true), ("steer_z", true)]);
    assert!(!said(&imported).contains("includeInTiming"));
}

/// What `results sspr` and `results coverage` say aside.
fn without_point(repository: &Repository, convention: Convention) -> Vec<String> {
    analysis::without_point(repository, &Selection::default(), convention).unwrap()
}

#[test]
fn a_window_that_a_space_cannot_have_still_measures_points_of_the_original() {
    let mut imported = imported(&with(&[
        ("<activation xsi:type=\"_1:FixedTimeActivation\" endTime=\"60.0\"/>", LATE),
        ("startTime=\"6.0\" endTime=\"18.0\"", "startTime=\"100000.25\" endTime=\"100000.75\""),
        (LOSE, ""),
    ]));
    assert!(said(&imported).contains("operation `push`: its window begins when tests are over"));
    let (_folder, repository) = recorded(&mut imported, 0);
    let test = &scanned(&repository)[0];
    let t = |dimension| at(test, &repository, Convention::Original, dimension);
    assert_eq!((t("T1"), t("T2")), (Some(0.5), Some(0.5)));
    assert_eq!(test.placed(repository.plan(), Convention::Ours), Err(NoPoint::Inactive), "the test was over");
}

const LATE: &str = "<activation xsi:type=\"_1:FixedTimeActivation\" startTime=\"100000.0\" endTime=\"100001.0\"/>";

/// The second operation of the first test.
const LOSE: &str = r#"      <operations xsi:type="_1:PacketLossNetworkOperation" name="lose" variableToAffect="_v0" fromTemplate="//@possibleFuzzingOperations.1">
        <activation xsi:type="_1:FixedTimeActivation" startTime="10.0" endTime="35.0"/>
        <frequency lowerBound="0.5" upperBound="0.6"/>
      </operations>
"#;

#[test]
fn a_range_that_a_space_cannot_have_still_measures_points_of_the_original() {
    let mut imported = imported(&with(&[
        ("<frequency lowerBound=\"0.4\" upperBound=\"0.7\"/>", "<frequency lowerBound=\"-1.0\" upperBound=\"3.0\"/>"),
        ("<frequency lowerBound=\"0.5\" upperBound=\"0.6\"/>", "<frequency lowerBound=\"2.0\" upperBound=\"2.0\"/>"),
    ]));
    let (_folder, repository) = recorded(&mut imported, 0);
    let test = &scanned(&repository)[0];
    // Half of the offsets, and three quarters of the probabilities.
    let p1 = at(test, &repository, Convention::Original, "P1").unwrap();
    assert!((p1 - f64::midpoint(0.5, 0.75)).abs() < 1e-12, "{p1}");
    assert_eq!(test.placed(repository.plan(), Convention::Ours), Err(NoPoint::Outside), "no probability is 2");
}

#[test]
fn a_test_beyond_its_window_has_no_point_and_that_is_said() {
    let mut imported = imported(&with(&[
        ("startTime=\"6.0\" endTime=\"18.0\"", "startTime=\"0.0\" endTime=\"69.0\""),
        ("startTime=\"10.0\" endTime=\"35.0\"", "startTime=\"10.0\" endTime=\"69.0\""),
    ]));
    let (_folder, repository) = recorded(&mut imported, 0);
    for convention in [Convention::Ours, Convention::Original, Convention::Paper] {
        assert_eq!(scanned(&repository)[0].placed(repository.plan(), convention), Err(NoPoint::Outside));
        let told = without_point(&repository, convention);
        let beyond =
            "1 test has no point, since operations acted or chose values beyond what the file permits them: T1";
        assert_eq!(told, [beyond], "{convention:?}");
        let table = analysis::sspr(&repository, &Selection::default(), &sesame_plan::Dimension::ALL, convention);
        assert_eq!(table.unwrap().csv().lines().count(), 1 + 1, "T2 has a point");
    }
}

/// The first campaign and its operations, of which `steer` and `lose` name no variable: they cannot be said.
fn without_variables() -> Imported {
    let lose = |of: &str| (format!("name=\"lose\" variableToAffect=\"_v0\"{of}"), format!("name=\"lose\"{of}"));
    let (template, used) = (lose(" inclusion"), lose(" from"));
    imported(&with(&[(&template.0, &template.1), (&used.0, &used.1)]))
}

#[test]
fn a_test_whose_operations_were_not_imported_never_looks_as_if_it_disturbed_less() {
    let mut imported = without_variables();
    let (_folder, repository) = recorded(&mut imported, 0);
    assert_eq!(imported.notes.lost(Counted::Operation), 1);
    let list = report::list(&repository).unwrap();
    assert_eq!(list.tests[0].operations, "push, 1 not imported");
    assert_eq!(list.tests[1].operations, "push");
    let warning = "not imported: 1 operation of this test, which disturbed more than is shown here \
                   (operation `lose` of the space was left out)";
    let shown = report::show(&repository, "T1").unwrap();
    assert_eq!(shown.warnings, [warning]);
    let text = report::test_text(&shown, TextOptions { width: None, colour: false });
    assert!(text.contains(&format!("warning: {warning}")), "{text}");
    let summary = report::summary(&repository).unwrap();
    let one = "1 test held operations that were not imported: more was disturbed than is shown, and such a test has no \
               point";
    assert_eq!(summary.warnings, [one]);
    let page = report::page(&repository).unwrap();
    assert!(page.contains(r#""not_imported":["1 not imported",null]"#) && page.contains(one), "{page}");
    let tests = analysis::tests(&repository, &Selection::default()).unwrap().csv();
    assert!(tests.contains("push (1 not imported)"), "{tests}");
    for convention in [Convention::Ours, Convention::Original, Convention::Paper] {
        assert_eq!(scanned(&repository)[0].placed(repository.plan(), convention), Err(NoPoint::LeftOut));
        let told = without_point(&repository, convention);
        assert_eq!(told, ["1 test has no point, since operations were not imported: T1"]);
    }
    let exported = report::export(&repository, "T1", None, report::Expected::Requirements).unwrap_err().to_string();
    assert!(exported.contains("T1 held operations that were not imported"), "{exported}");
}

/// A search whose only operation names no variable, with a test and its front.
const NOTHING_TO_SAY: &str = r#"
  <campaigns name="late" metrics="_m1 _m2" includedOperations="_o0">
    <approach xsi:type="TestingMM:NSGAEvolutionaryAlgorithm" populationSize="10" iterations="40"/>
    <performedTests xmi:id="_t" name="T1">
      <operations xsi:type="_1:RandomValueFromSetOperation" name="push" fromTemplate="_o0" isRelative="true">
        <activation xsi:type="_1:FixedTimeActivation" startTime="6.0" endTime="18.0"/>
        <valueSet xsi:type="_1:DoubleRange" propertyName="" lowerBound="-0.15" upperBound="0.15"/>
      </operations>
      <metrics metric="_m1"><result name="hits" value="3.0"/></metrics>
      <metrics metric="_m2"><result name="near" value="4.0"/></metrics>
    </performedTests>
    <resultSets name="NONDOM-01-final" results="_t"/>
  </campaigns>"#;

/// A file of that campaign alone, with nothing else that could be disturbed.
fn nothing_to_say() -> Imported {
    let operation = r#"
  <possibleFuzzingOperations xsi:type="_1:RandomValueFromSetOperation" xmi:id="_o0" name="push" isRelative="true">
    <activation xsi:type="_1:FixedTimeActivation" endTime="60.0"/>
    <valueSet xsi:type="_1:DoubleRange" propertyName="" lowerBound="-0.3" upperBound="0.3"/>
  </possibleFuzzingOperations>"#;
    imported(&space(NUMBERED, &[METRICS, operation, NOTHING_TO_SAY, SYSTEM].concat()))
}

#[test]
fn a_search_that_only_observes_now_keeps_its_objectives_in_results() {
    let mut imported = nothing_to_say();
    assert!(imported.text().contains("passive    1 times"), "{}", imported.text());
    let (_folder, repository) = recorded(&mut imported, 0);
    let objectives: Vec<&str> = repository
        .plan()
        .objectives()
        .map(|objective| repository.plan().metric(objective.metric).name.as_str())
        .collect();
    assert_eq!(objectives, ["hits"], "`near` is not optimised");
    let front = analysis::front(&repository, &Selection::default()).unwrap().csv();
    assert_eq!(front.lines().collect::<Vec<_>>(), ["test,hits,same_as", "T1,3,"]);
    assert_eq!(report::summary(&repository).unwrap().objectives.len(), 1);
}

#[test]
fn notes_on_a_search_that_only_observes_now_do_not_contradict_each_other() {
    let imported = nothing_to_say();
    let said = said(&imported);
    let of_it: Vec<&str> = said.lines().filter(|line| line.contains("campaign `late`")).collect();
    let observes = "Changed campaign `late`: none of its operations can be said, so it only observes now; its results \
                    are kept, with its objectives";
    let ends = "Changed campaign `late` does not say when its tests end: after 100s now";
    assert_eq!(of_it, [ends, observes]);
}

#[test]
fn nothing_is_noted_on_clauses_that_an_operation_does_not_have() {
    let late = ("<activation xsi:type=\"_1:FixedTimeActivation\" endTime=\"60.0\"/>", LATE);
    let kept = said(&imported(&with(&[late])));
    assert!(kept.contains("operation `push`: its window begins when tests are over, so it may be"), "{kept}");
    let nameless = ("name=\"push\" variableToAffect=\"_v0\" isRelative", "name=\"push\" isRelative");
    let left_out = said(&imported(&with(&[late, nameless])));
    assert!(left_out.contains("Left out operation `push`: it names no variable"), "{left_out}");
    assert!(!left_out.contains("operation `push`: its window"), "{left_out}");
}

#[test]
fn nothing_is_noted_on_a_campaign_that_is_left_out_but_that() {
    let nothing = NOTHING_TO_SAY.split("    <performedTests").next().unwrap().replace("\"_m1 _m2\"", "\"_m2\"");
    let operation = OPERATIONS.replace("variableToAffect=\"_v0\"", "").replace("variableToAffect=\"_v1\"", "");
    let campaign = CAMPAIGN.split("  <campaigns name=\"again\"").next().unwrap();
    let text = space(NUMBERED, &[METRICS, &operation, campaign, &nothing, "  </campaigns>", SYSTEM].concat());
    let said = said(&imported(&text));
    let of_it: Vec<&str> = said.lines().filter(|line| line.contains("campaign `late`")).collect();
    assert_eq!(of_it, ["Left out campaign `late`: none of its operations can be said"]);
}
