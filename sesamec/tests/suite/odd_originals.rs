//! What files of the original platform hold besides what its documentation shows, each as it was found in one.

use sesame_legacy::{Counted, Imported, Kind};
use sesame_plan::Dimension;
use sesame_record::{Repository, ScannedTest};
use sesame_search::sspr::Convention;
use tempfile::TempDir;

use crate::originals::{CAMPAIGN, METRICS, NUMBERED, OPERATIONS, SYSTEM, imported, plan, space, whole};

/// A file with something else in the place of words that it holds.
pub(crate) fn with(changes: &[(&str, &str)]) -> String {
    changes.iter().fold(whole(), |text, (from, to)| {
        assert!(text.contains(from), "{from}");
        text.replace(from, to)
    })
}

/// The results of the campaign at a position.
pub(crate) fn recorded(imported: &mut Imported, at: usize) -> (TempDir, Repository) {
    let (_, name) = imported.performed().find(|(found, _)| *found == at).expect("the campaign performed tests");
    let plan = plan(imported, name);
    let folder = tempfile::tempdir().unwrap();
    imported.record(at, &plan, folder.path()).unwrap();
    let repository = Repository::open(folder.path()).unwrap();
    (folder, repository)
}

pub(crate) fn scanned(repository: &Repository) -> Vec<ScannedTest> {
    let mut tests = Vec::new();
    repository.scan(&mut |test| tests.push(test)).unwrap();
    tests
}

/// All that an import says, one note a line.
pub(crate) fn said(imported: &Imported) -> String {
    let notes: Vec<String> = imported.notes.iter().map(|(kind, text)| format!("{} {text}", kind.word())).collect();
    notes.join("\n")
}

/// A coordinate of a test.
pub(crate) fn at(test: &ScannedTest, repository: &Repository, convention: Convention, dimension: &str) -> Option<f64> {
    test.point(repository.plan(), convention)?.get(Dimension::named(dimension).unwrap())
}

#[test]
fn variables_of_one_name_are_one_topic() {
    let link = "<variables xmi:id=\"_v0\" name=\"arm/link0\" type=\"_t0\"/>";
    let again = link.replace("_v0", "_again");
    let text = with(&[
        (link, &format!("{link}{again}")),
        ("name=\"lose\" variableToAffect=\"_v0\" inclusion", "name=\"lose\" variableToAffect=\"_again\" inclusion"),
    ]);
    let imported = imported(&text);
    let paths = imported.text().matches("\"arm/link0\"").count();
    assert_eq!(paths, 1, "{}", imported.text());
    assert!(imported.text().contains("operation lose on arm_link0 "), "{}", imported.text());
}

#[test]
fn values_that_refer_to_no_metric_are_found_by_name() {
    let text = with(&[
        ("<metrics metric=\"_m0\"><result name=\"times\"", "<metrics><result name=\"times\""),
        (
            "<metrics metric=\"_m1\"><result name=\"hits\" value=\"4.0\"/></metrics>",
            "<metrics metric=\"_gone\"><result name=\"hits\" value=\"4.0\"/></metrics>\
             <metrics><result name=\"nobody\" value=\"1.0\"/></metrics><metrics metric=\"_m2\"/>",
        ),
    ]);
    let mut imported = imported(&text);
    let (_folder, repository) = recorded(&mut imported, 0);
    let values: Vec<Option<f64>> = scanned(&repository)[0].values.iter().map(|value| value.value).collect();
    assert_eq!(values, [Some(37.0), Some(4.0), None]);
    let said = said(&imported);
    assert!(said.contains("Mapped values that refer to no metric are of `times`, which has their name"), "{said}");
    assert!(said.contains("Left out values of performed tests that are of no metric of the file"), "{said}");
    assert!(said.contains("Left out metrics of performed tests that have no value"), "{said}");
    assert_eq!(imported.notes.lost(Counted::Value), 2);
}

#[test]
fn a_name_that_two_metrics_have_names_neither() {
    let text = with(&[
        ("name=\"near\"", "name=\"times\""),
        ("<metrics metric=\"_m0\"><result name=\"times\"", "<metrics><result name=\"times\""),
    ]);
    let mut imported = imported(&text);
    drop(recorded(&mut imported, 0));
    assert_eq!(imported.notes.lost(Counted::Value), 1);
}

#[test]
fn elements_of_lists_are_disturbed() {
    let text = with(&[
        ("geometry_msgs/Twist.linear.X", "DetectedObjectList.objects[0].object.sector.center_angle"),
        ("geometry_msgs/Twist.angular.Z", "DetectedObjectList.objects[0].object.sector.Opening_Angle"),
        ("name=\"geometry_msgs/Twist\"", "name=\"perception_msgs/DetectedObjectList\""),
    ]);
    let imported = imported(&text);
    drop(plan(&imported, "first_campaign"));
    let text = imported.text();
    for line in [
        "message DetectedObjectList { objects: list of DetectedObjectList_objects }",
        "message DetectedObjectList_objects_object_sector { center_angle: real  opening_angle: real }",
        "on arm_velocityIN.objects[0].object.sector.center_angle = random absolute [-1, 1]",
        "on arm_velocityIN.objects[0].object.sector.opening_angle = random absolute [-2, 2]",
    ] {
        assert!(text.contains(line), "{line}\n{text}");
    }
}

#[test]
fn what_names_no_element_of_a_list_is_left_out() {
    for path in ["objects[", "objects[-1]", "objects[x]", "objects[0][1]", "objects[]", "[0]", "linear[0].x"] {
        let imported = imported(&with(&[("geometry_msgs/Twist.linear.X", &format!("Twist.{path}.X"))]));
        drop(plan(&imported, "first_campaign"));
        let said = said(&imported);
        assert!(said.contains("Left out operation `steer`, its value `Twist."), "{path}: {said}");
    }
}

/// A test that holds `steer`, which draws two values, and `push`.
const STEERING: &str = r#"<performedTests xmi:id="_p0" name="Test_001">
      <operations xsi:type="_1:RandomValueFromSetOperation" name="steer" variableToAffect="_v1" fromTemplate="_o2">
        <activation xsi:type="_1:FixedTimeActivation" startTime="10.0" endTime="35.0"/>
        <valueSet xsi:type="_1:DoubleRange" propertyName="geometry_msgs/Twist.linear.X" lowerBound="-1.0" upperBound="1.0"/>
        <valueSet xsi:type="_1:DoubleRange" propertyName="geometry_msgs/Twist.angular.Z" lowerBound="1.0" upperBound="1.0"/>
      </operations>"#;

#[test]
fn several_values_of_one_operation_are_one_operation_in_points_and_counts() {
    let text = with(&[("<performedTests xmi:id=\"_p0\" name=\"Test_001\">", STEERING)]);
    let mut imported = imported(&text);
    let (_folder, repository) = recorded(&mut imported, 0);
    let test = scanned(&repository).swap_remove(0);
    let parts: Vec<Option<usize>> = test.operations.iter().map(|operation| operation.part_of).collect();
    assert_eq!(parts, [None, Some(0), None, None], "`steer` is two operations here");
    for convention in [Convention::Ours, Convention::Original] {
        let at = |dimension| at(&test, &repository, convention, dimension).unwrap();
        assert_eq!((at("O0"), at("O1")), (3.0, 2.0), "steer, push and lose; steer and push");
        // Lengths of `steer` 25 of 50, `push` 12 of 60, `lose` 25 of 50.
        assert!((at("T2") - (0.5 + 0.2 + 0.5) / 3.0).abs() < 1e-12);
    }
    // Each value counts: all of the range, nothing of it, half of it, and a keep probability a third of the way.
    let p1 = at(&test, &repository, Convention::Original, "P1").unwrap();
    assert!((p1 - (1.0 + 0.0 + 0.5 + 1.0 / 3.0) / 4.0).abs() < 1e-12, "{p1}");
    assert_eq!(imported.notes.lost(Counted::Operation), 0);
}

/// A campaign without tests of its own cannot be compared with anything; this one, which the authors called null
/// fuzzing, repeats a test whose only window begins after the campaign's end.
const NULL_FUZZING: &str = r#"
  <campaigns name="null-fuzzing" metrics="_m1">
    <approach xsi:type="TestingMM:RepeatedExecution" testToRepeat="_null" repeatCount="2"/>
    <performedTests xmi:id="_null" name="Test_null">
      <operations xsi:type="_1:RandomValueFromSetOperation" name="push" variableToAffect="_v0" fromTemplate="_o0" isRelative="true">
        <activation xsi:type="_1:FixedTimeActivation" startTime="8000.0" endTime="8010.0"/>
        <valueSet xsi:type="_1:DoubleRange" propertyName="" lowerBound="-0.1" upperBound="0.1"/>
      </operations>
      <metrics metric="_m1"><result name="hits" value="7.0"/></metrics>
    </performedTests>
    <endTrigger xsi:type="TestingMM:TimeBasedEnd" timeLimitSeconds="70"/>
  </campaigns>"#;

#[test]
fn a_repeated_test_whose_window_lies_after_the_end_keeps_its_results() {
    let text = space(NUMBERED, &[METRICS, OPERATIONS, CAMPAIGN, NULL_FUZZING, SYSTEM].concat());
    let mut imported = imported(&text);
    let (_folder, repository) = recorded(&mut imported, 2);
    let tests = scanned(&repository);
    assert_eq!((tests.len(), tests[0].operations.len()), (1, 1));
    assert!(tests[0].values.iter().any(|value| value.value == Some(7.0)));
    let said = said(&imported);
    for line in [
        "Left out known test `Test_null`, operation `push`: its window begins when the test is over, after 70s",
        "Changed known test `Test_null` has no operation left: it holds `push offset [0, 0]`",
    ] {
        assert!(said.contains(line), "{line}\n{said}");
    }
    assert_eq!(imported.notes.lost(Counted::Operation), 0);
}

#[test]
fn a_campaign_of_which_nothing_can_be_said_observes_and_keeps_its_results() {
    // Nothing that could be harmless: no offset around 0, no loss of nothing.
    let operation =
        OPERATIONS.replace("lowerBound=\"0.3\" upperBound=\"-0.3\"", "lowerBound=\"0.2\" upperBound=\"0.3\"");
    let text = space(NUMBERED, &[METRICS, &operation, CAMPAIGN, NULL_FUZZING, SYSTEM].concat());
    let mut imported = imported(&text);
    assert!(imported.text().contains("passive    2 times"), "{}", imported.text());
    let (_folder, repository) = recorded(&mut imported, 2);
    let tests = scanned(&repository);
    assert_eq!((tests.len(), tests[0].operations.len()), (1, 0));
    assert!(tests[0].values.iter().any(|value| value.value == Some(7.0)));
    assert_eq!(imported.notes.lost(Counted::Operation), 1, "{}", said(&imported));
}

#[test]
fn a_campaign_without_operations_may_use_those_that_act_before_its_end() {
    let campaign = r#"
  <campaigns name="short" metrics="_m1">
    <performedTests name="Test_idle"><metrics metric="_m1"><result name="hits" value="3.0"/></metrics></performedTests>
    <endTrigger xsi:type="TestingMM:TimeBasedEnd" timeLimitSeconds="8"/>
  </campaigns>"#;
    let mut imported = imported(&space(NUMBERED, &[METRICS, OPERATIONS, CAMPAIGN, campaign, SYSTEM].concat()));
    let (_folder, repository) = recorded(&mut imported, 2);
    let operations: Vec<&str> = repository.plan().operations.iter().map(|operation| operation.name.as_str()).collect();
    assert_eq!(operations, ["push"], "`lose` and `steer` begin after 10 s");
}

#[test]
fn what_a_repeated_test_has_beyond_its_operation_is_told() {
    let imported = imported(&with(&[
        ("startTime=\"6.0\" endTime=\"18.0\"", "startTime=\"6.0\" endTime=\"68.0\""),
        ("lowerBound=\"-0.15\" upperBound=\"0.15\"", "lowerBound=\"-0.15\" upperBound=\"0.45\""),
    ]));
    drop(plan(&imported, "again"));
    let said = said(&imported);
    let beyond = "Changed known test `Test_001`, beyond what operation `push` permits:";
    for line in ["its offset [-0.15, 0.45] is [-0.15, 0.3] now", "its window from 6s to 68s is from 6s to 60s now"] {
        assert!(said.contains(&format!("{beyond} {line}")), "{line}\n{said}");
    }
}

#[test]
fn an_activation_of_length_zero_has_a_point() {
    let text = with(&[
        ("startTime=\"20.0\" endTime=\"50.0\"", "startTime=\"30.0\" endTime=\"30.0\""),
        ("startTime=\"6.0\" endTime=\"18.0\"", "startTime=\"6.0\" endTime=\"6.0\""),
    ]);
    let mut imported = imported(&text);
    let (_folder, repository) = recorded(&mut imported, 0);
    let tests = scanned(&repository);
    let conditional = |dimension| at(&tests[1], &repository, Convention::Original, dimension);
    assert_eq!((conditional("T1"), conditional("T2")), (Some(0.5), Some(0.0)));
    assert_eq!(at(&tests[0], &repository, Convention::Ours, "O0"), Some(2.0));
}

#[test]
fn activity_after_the_end_counts_for_the_original_alone() {
    let text = with(&[("timeLimitSeconds=\"70\"", "timeLimitSeconds=\"12\"")]);
    let mut imported = imported(&text);
    let (_folder, repository) = recorded(&mut imported, 0);
    let test = &scanned(&repository)[0];
    let t2 = |convention| at(test, &repository, convention, "T2").unwrap();
    // `push` 6 to 18 of 0 to 60, `lose` 10 to 35 of 10 to 60.
    assert!((t2(Convention::Original) - f64::midpoint(0.2, 0.5)).abs() < 1e-12);
    assert!((t2(Convention::Ours) - f64::midpoint(0.1, 0.04)).abs() < 1e-12);
    let said = said(&imported);
    assert!(said.contains("activity of `push` in performed tests is cut at the end of the test"), "{said}");
}

#[test]
fn what_is_odd_about_a_file_is_told() {
    let imported = imported(&with(&[
        (
            "<right xsi:type=\"_3:ConditionVariable\" metric=\"_m1\"/>",
            "<right xsi:type=\"_3:ConditionVariable\" metric=\"_m2\"/>",
        ),
        ("useInOptimisation=\"true\"", "useInOptimisation=\"false\""),
        ("publisher=\"_v0 _v1\"", "publisher=\"_v1\""),
        ("    <simulator xsi:type=\"_2:TTSSimulator\" hostname=\"localhost\" port=\"8089\"/>\n", ""),
        (
            "xsi:type=\"_1:PacketLossNetworkOperation\" xmi:id=\"_o1\" name=\"lose\"",
            "xsi:type=\"_1:LatencyNetworkOperation\" xmi:id=\"_o1\" name=\"lose\"",
        ),
        ("    <resultSets name=\"FULL-01", "    <performedTests name=\"Test_003\"/>\n    <resultSets name=\"FULL-01"),
    ]));
    let said: Vec<String> =
        imported.notes.iter().filter(|(kind, _)| *kind == Kind::Noted).map(|(_, text)| text).collect();
    insta::assert_snapshot!(said.join("\n"), @"
    campaign `first-campaign` marks no metric for optimisation: all that it has are objectives
    campaign `first-campaign`: conditions of its tests compare what is not among its condition metrics: near
    campaign `first-campaign`: conditions of performed tests that compare a metric with itself, which decides nothing
    campaign `first-campaign`: performed tests without operations, which disturb nothing
    operation `lose`: no node of the file publishes `arm_link0`, which it disturbs (2 times)
    operation `lose`: the file gives no range of delays, so it delays by 0s
    operation `push`: no node of the file publishes `arm_link0`, which it disturbs
    the file names no simulator: the line of the simulator is a placeholder to be replaced
    ");
}
