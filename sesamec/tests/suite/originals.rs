//! Files in the format of the original platform, small and written for these tests: the platform's own are not ours to
//! publish.

use std::fs::File;
use std::path::{Path, PathBuf};

use sesame_legacy::{Broken, Imported, Kind, Recorded};
use sesame_plan::CampaignPlan;
use sesame_plan::testing::compact::{Base, Tree};
use sesame_record::Repository;
use sesame_search::sspr::Convention;
use sesamec::frontend::{Look, SESAME};
use tempfile::TempDir;

/// A space in a dialect: its head, and names of elements and attributes that changed over the years.
pub(crate) fn space(head: &str, body: &str) -> String {
    format!(
        r#"<?xml version="1.0" encoding="ASCII"?>
<TestingMM:TestingSpace xmi:version="2.0" xmlns:xmi="http://www.omg.org/XMI" xmlns:xsi="http://www.w3.org/2001/XMLSchema-instance" {head} xmi:id="_space" name="arm-space">
{body}
</TestingMM:TestingSpace>
"#
    )
}

pub(crate) const NUMBERED: &str =
    r#"xmlns="Metrics" xmlns:TestingMM="TestingMM" xmlns:_1="FuzzingOperations" xmlns:_2="MRSPackage""#;

pub(crate) const SYSTEM: &str = r#"
  <mrs launchDelaySeconds="10">
    <variables xmi:id="_v0" name="arm/link0" type="_t0"/>
    <variables xmi:id="_v1" name="/arm/velocityIN" type="_t1"/>
    <variables xmi:id="_v2" name="zones/Z1" type="_t2"/>
    <nodes name="arm" publisher="_v0 _v1"/>
    <simulator xsi:type="_2:TTSSimulator" hostname="localhost" port="8089"/>
    <propertyType xmi:id="_t0" name="doubleEncodedAsString" parsingMethod="STRING"/>
    <propertyType xmi:id="_t1" name="geometry_msgs/Twist"/>
    <propertyType xmi:id="_t2" name="SafetyZone"/>
  </mrs>"#;

pub(crate) const METRICS: &str = r#"
  <metrics xsi:type="FuzzingOperationTimesMetric" xmi:id="_m0" name="times" dir="LOWEST" useInOptimisation="true"><valueIfNotReceived defaultVal="1000.0"/></metrics>
  <metrics xsi:type="StreamMetric" xmi:id="_m1" name="hits" relatedVariables="_v2" useInOptimisation="true"><valueIfNotReceived/></metrics>
  <metrics xsi:type="StreamMetric" xmi:id="_m2" name="near" relatedVariables="_v2"><initValue defaultVal="10.0"/></metrics>"#;

pub(crate) const OPERATIONS: &str = r#"
  <possibleFuzzingOperations xsi:type="_1:RandomValueFromSetOperation" xmi:id="_o0" name="push" variableToAffect="_v0" isRelative="true">
    <activation xsi:type="_1:FixedTimeActivation" endTime="60.0"/>
    <valueSet xsi:type="_1:DoubleRange" propertyName="" lowerBound="0.3" upperBound="-0.3"/>
  </possibleFuzzingOperations>
  <possibleFuzzingOperations xsi:type="_1:PacketLossNetworkOperation" xmi:id="_o1" name="lose" variableToAffect="_v0" inclusionProbability="0.25">
    <activation xsi:type="_1:FixedTimeActivation" startTime="10.0" endTime="60.0"/>
    <frequency lowerBound="0.4" upperBound="0.7"/>
  </possibleFuzzingOperations>
  <possibleFuzzingOperations xsi:type="_1:RandomValueFromSetOperation" xmi:id="_o2" name="steer" variableToAffect="_v1">
    <activation xsi:type="_1:FixedTimeActivation" startTime="10.0" endTime="60.0"/>
    <valueSet xsi:type="_1:DoubleRange" propertyName="geometry_msgs/Twist.linear.X" lowerBound="-1.0" upperBound="1.0"/>
    <valueSet xsi:type="_1:DoubleRange" propertyName="geometry_msgs/Twist.angular.Z" lowerBound="-2.0" upperBound="2.0"/>
  </possibleFuzzingOperations>"#;

pub(crate) const CAMPAIGN: &str = r#"
  <campaigns name="first-campaign" metrics="_m0 _m1" includedOperations="_o0 _o1 _o2">
    <approach xsi:type="TestingMM:NSGAWithCoverageCells" populationSize="5" iterations="40" targetCoverageProportion="0.5" useMutationEnhancingCoverage="true">
      <dimensionRecords maxValue="1.0" count="4"/>
      <dimensionRecords dimID="O2_DELAY_COUNT" maxValue="3.0" count="3"/>
    </approach>
    <performedTests xmi:id="_p0" name="Test_001">
      <operations xsi:type="_1:RandomValueFromSetOperation" name="push" variableToAffect="_v0" fromTemplate="_o0" seed="-1" isRelative="true">
        <activation xsi:type="_1:FixedTimeActivation" startTime="6.0" endTime="18.0"/>
        <valueSet xsi:type="_1:DoubleRange" propertyName="" lowerBound="-0.15" upperBound="0.15"/>
      </operations>
      <operations xsi:type="_1:PacketLossNetworkOperation" name="lose" variableToAffect="_v0" fromTemplate="//@possibleFuzzingOperations.1">
        <activation xsi:type="_1:FixedTimeActivation" startTime="10.0" endTime="35.0"/>
        <frequency lowerBound="0.5" upperBound="0.6"/>
      </operations>
      <metrics metric="_m0"><result name="times" value="37.0"/></metrics>
      <metrics metric="_m1"><result name="hits" value="4.0"/></metrics>
    </performedTests>
    <performedTests name="Test_002" developedFrom="//@campaigns.0/@performedTests.0 _p0">
      <operations xsi:type="_1:RandomValueFromSetOperation" name="push" variableToAffect="_v0" fromTemplate="_o0" isRelative="true">
        <activation xsi:type="_1:ConditionBasedActivation">
          <starting><c xsi:type="_3:CompositeCondition" binop="OR">
            <left xsi:type="_3:BasicCondition" bincomp="GREATER_THAN"><left metric="_m2"/><right xsi:type="_3:ConditionInteger" value="5"/></left>
            <right xsi:type="_3:BasicCondition"><left metric="_m2"/><right xsi:type="_3:ConditionVariable" metric="_m1"/></right>
          </c></starting>
          <ending><c xsi:type="_3:BasicCondition" bincomp="EQUALS"><left metric="_m2"/><right xsi:type="_3:ConditionInteger"/></c></ending>
        </activation>
        <recordedTimings startTime="20.0" endTime="50.0"/>
        <valueSet xsi:type="_1:DoubleRange" propertyName="" lowerBound="0.1" upperBound="0.1"/>
      </operations>
      <metrics metric="_m1"><result name="hits"/></metrics>
    </performedTests>
    <resultSets name="FULL-01-intermediate-2" status="INTERMEDIATE" results="_p0 //@campaigns.0/@performedTests.1"/>
    <resultSets name="NONDOM-01-intermediate-2" status="INTERMEDIATE" results="_p0"/>
    <endTrigger xsi:type="TestingMM:TimeBasedEnd" timeLimitSeconds="70"/>
  </campaigns>
  <campaigns name="again" metrics="_m1">
    <approach xsi:type="TestingMM:RepeatedExecution" testToRepeat="_p0" repeatCount="3"/>
    <endTrigger xsi:type="TestingMM:TimeBasedEnd" timeLimitSeconds="70"/>
  </campaigns>"#;

pub(crate) fn whole() -> String {
    space(NUMBERED, &[METRICS, OPERATIONS, CAMPAIGN, SYSTEM].concat())
}

/// A file of these words.
fn written(words: &str) -> (TempDir, PathBuf) {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("arm.model");
    std::fs::write(&path, words).unwrap();
    (folder, path)
}

fn read(path: &Path) -> Result<Imported, Broken> {
    Imported::read(path, File::open(path).unwrap())
}

pub(crate) fn imported(words: &str) -> Imported {
    let (_folder, path) = written(words);
    read(&path).unwrap_or_else(|broken| panic!("{broken}"))
}

fn broken(words: &str) -> String {
    let (_folder, path) = written(words);
    let broken = read(&path).map(|_| ()).unwrap_err().to_string();
    broken.strip_prefix(&path.display().to_string()).unwrap().to_owned()
}

/// The plan of a campaign of the space that was written, which has no errors.
pub(crate) fn plan(imported: &Imported, campaign: &str) -> CampaignPlan {
    let checked = (SESAME.check)("arm.sesame", imported.text(), Look::Human { colour: false });
    assert_eq!(checked.errors, 0, "{}\n{}", checked.diagnostics, imported.text());
    let plan = checked.plans.into_iter().find(|runner| runner.plan.campaign.name == campaign);
    plan.unwrap_or_else(|| panic!("{}", imported.text())).plan
}

#[test]
fn a_space_is_written_in_the_words_of_the_language() {
    let imported = imported(&whole());
    plan(&imported, "first_campaign");
    insta::assert_snapshot!(imported.text());
}

#[test]
fn what_is_not_as_it_was_is_told() {
    let notes: Vec<String> =
        imported(&whole()).notes.iter().map(|(kind, text)| format!("{:>8} {text}", kind.word())).collect();
    insta::assert_snapshot!(notes.join("\n"));
}

#[test]
fn performed_tests_are_recorded_with_ancestry_timings_values_and_sets() {
    let mut imported = imported(&whole());
    let plan = plan(&imported, "first_campaign");
    let folder = tempfile::tempdir().unwrap();
    let performed: Vec<(usize, String)> = imported.performed().map(|(at, name)| (at, name.to_owned())).collect();
    assert_eq!(performed, [(0, "first_campaign".to_owned())]);
    let recorded = imported.record(0, &plan, folder.path()).unwrap();
    assert_eq!(recorded, Recorded { tests: 2, sets: 2 });
    let repository = Repository::open(folder.path()).unwrap();
    let first = repository.test(1).unwrap();
    let second = repository.test(2).unwrap();
    let shown = |recorded: String| Base::default().compact(&Tree::read(&recorded));
    let of_the_first = (&first.test, &first.observation.operations, &first.observation.metrics);
    insta::assert_snapshot!(shown(format!("{of_the_first:?}")));
    insta::assert_snapshot!(shown(format!("{:?}", (&second.test, &second.observation.operations))));
    assert_eq!((first.parents, second.parents), (vec![], vec![1, 1]));
    assert_eq!(first.observation.outcome.word(), "unknown");
    assert_eq!(second.observation.metrics[1].value, Some(0.0));
    assert!(!second.observation.metrics[1].set, "it is the default");
    assert_eq!(repository.find("Test_002").unwrap(), 2);
    let sets = repository.result_sets().unwrap();
    assert_eq!(sets[1].members, [1]);
    assert_eq!(sets[0].members, [1, 2]);
    let mut points = Vec::new();
    repository.scan(&mut |test| points.push(test.point(&plan, Convention::Original))).unwrap();
    let point = points[0].unwrap();
    let at = |name| point.get(sesame_plan::Dimension::named(name).unwrap()).unwrap();
    // Midpoints 0.2 and 0.25, lengths 0.2 and 0.5; half of the offsets, and a keep probability a third of the way.
    assert!((at("T1") - 0.225).abs() < 1e-12 && (at("T2") - 0.35).abs() < 1e-12);
    assert!((at("P1") - f64::midpoint(0.5, 1.0 / 3.0)).abs() < 1e-12, "{}", at("P1"));
    let point = points[1].unwrap();
    assert_eq!(point.get(sesame_plan::Dimension::T2), Some(0.5), "what was recorded, not what was planned");
}

#[test]
fn all_dialects_of_one_space_are_one_space() {
    let numbered = imported(&whole());
    let dotted = whole()
        .replace("xmlns=\"Metrics\"", "xmlns:TestingMM.Metrics=\"Metrics\"")
        .replace("_1:", "TestingMM.FuzzingOperations:")
        .replace("_2:", "TestingMM.MRSPackage:")
        .replace("type=\"Stream", "type=\"TestingMM.Metrics:Stream");
    assert_eq!(imported(&dotted).text(), numbered.text());
    let old = whole()
        .replace("possibleFuzzingOperations", "possibleAttacks")
        .replace("<operations", "<attacks")
        .replace("</operations", "</attacks")
        .replace("includedOperations", "includedAttacks")
        .replace("variableToAffect", "topicToAttack")
        .replace("<variables", "<topics")
        .replace("relatedVariables", "relatedTopics")
        .replace("valueIfNotReceived", "default")
        .replace("<activation", "<attackActivation")
        .replace("</activation", "</attackActivation")
        .replace("FixedTimeActivation", "AttackFixedTime")
        .replace("FromSetOperation", "FromSetAttack")
        .replace("FuzzingOperationTimesMetric", "AttackTimesMetric")
        .replace("NetworkOperation", "NetworkAttack");
    let old = imported(&old);
    assert_eq!(old.text(), numbered.text());
    assert!(old.notes.iter().filter(|(kind, text)| *kind == Kind::Renamed && text.contains(" since")).count() >= 10);
    assert_eq!(
        numbered.notes.iter().filter(|(kind, text)| *kind == Kind::Renamed && text.contains(" since")).count(),
        0
    );
}

#[test]
fn names_that_would_be_code_or_paths_are_names() {
    let hostile = whole()
        .replace("name=\"hits\"", "name=\"&quot;} fn main() { std::process::exit(3) } //\"")
        .replace("name=\"first-campaign\"", "name=\"../../../etc/cron.d/x\"")
        .replace("name=\"Test_001\"", "name=\"&lt;script>alert(1)&lt;/script>'); DROP TABLE tests; --&#10;x\"")
        .replace("name=\"arm/link0\"", "name=\"a&quot; b{c}\\\"")
        .replace("name=\"push\"", "name=\"campaign\"");
    let imported = imported(&hostile);
    let plan = plan(&imported, "etc_cron_d_x");
    assert_eq!(sesame_codegen::names::campaign_folder(&plan.campaign.name), "etc_cron_d_x");
    let code = imported.text().lines().filter(|line| !line.trim_start().starts_with("//"));
    for line in code {
        assert!(!line.contains("exit(") && !line.contains("<script") && !line.contains("../"), "{line}");
    }
}

#[test]
fn a_broken_file_gives_one_diagnostic_with_its_place() {
    let said = [
        (
            "a conflict that was never resolved",
            whole().replace("  <campaigns name=\"again\"", "<<<<<<< HEAD\n  <campaigns name=\"again\""),
        ),
        ("a file that was cut off", whole()[..whole().len() / 2].to_owned()),
        (
            "an element that is closed by another",
            whole().replace("</valueIfNotReceived>", "").replace("</mrs>", "</mr>"),
        ),
        ("a number that is none", whole().replace("endTime=\"35.0\"", "endTime=\"soon\"")),
        ("a number without end", whole().replace("endTime=\"35.0\"", "endTime=\"NaN\"")),
        ("another kind of file", "<html><body/></html>".to_owned()),
        ("nothing", String::new()),
        ("no variables", space(NUMBERED, METRICS)),
        ("an entity that grows", "<!DOCTYPE x [<!ENTITY a \"aaaa\">]><x/>".to_owned()),
        ("a condition without a side", whole().replace("<left metric=\"_m2\"/>", "")),
        ("nested without end", format!("<TestingSpace>{}", "<a>".repeat(100_000))),
    ];
    let said: Vec<String> = said.iter().map(|(what, words)| format!("{what}\n  {}", broken(words))).collect();
    insta::assert_snapshot!(said.join("\n"));
}

#[test]
fn an_element_without_an_end_is_refused() {
    let (_folder, path) = written("<TestingSpace name=\"a\">\n  <mrs name=\"");
    // What follows are zeros, which no disk has to hold.
    let file = std::fs::File::options().append(true).open(&path).unwrap();
    file.set_len(64 << 20).unwrap();
    let refused = read(&path).unwrap_err();
    assert_eq!(refused.place, Some((2, 3)));
    assert!(refused.what.starts_with("what begins here has more than 32 MiB"), "{refused}");
}

#[test]
fn a_file_of_any_bytes_is_imported_or_refused() {
    use proptest::prelude::*;
    let words = whole().into_bytes();
    let config = ProptestConfig { cases: 256, failure_persistence: None, ..ProptestConfig::default() };
    proptest!(config, |(at in 0..words.len(), bytes in prop::collection::vec(any::<u8>(), 1..6))| {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("arm.model");
        let mut damaged = words.clone();
        damaged.splice(at..(at + bytes.len()).min(words.len()), bytes.iter().copied());
        std::fs::write(&path, &damaged).unwrap();
        if let Ok(imported) = read(&path) {
            let checked = (SESAME.check)("arm.sesame", imported.text(), Look::Human { colour: false });
            // A test that does not fit its template any more is a mistake that the command tells, and nothing worse.
            prop_assert_eq!(checked.errors == 0, !checked.plans.is_empty(), "{}", imported.text());
        }
    });
}
