//! Runtime monitors of the original platform come along as `external` monitors, and their warnings as lead times.

use sesame_legacy::{Imported, Kind};

use crate::originals::{NUMBERED, imported, plan, space};

const MONITORED: &str = r#"
  <metrics xsi:type="StreamMetric" xmi:id="_m0" name="M1_crush" relatedVariables="_v1 _v2" useInOptimisation="true"><valueIfNotReceived/></metrics>
  <metrics xsi:type="StreamMetric" xmi:id="_m1" name="M0_seen" relatedVariables="_v1"/>
  <metrics xsi:type="StreamMetric" xmi:id="_m2" name="M4_LiftWarningTime" relatedVariables="_v1 _v3 _v4 _v5"><valueIfNotReceived defaultVal="-50.0"/></metrics>
  <metrics xsi:type="StreamMetric" xmi:id="_m3" name="M5_LiftWarningTimeHighOnly" relatedVariables="_v1 _v3 _v4" dir="LOWEST"><initValue defaultVal="9.0"/></metrics>
  <metrics xsi:type="StreamMetric" xmi:id="_m4" name="M6_LiftWarningTimeFastOnly" relatedVariables="_v1 _v3"/>
  <metrics xsi:type="StreamMetric" xmi:id="_m5" name="M7_HandWarningTime" relatedVariables="_v5"/>
  <possibleFuzzingOperations xsi:type="_1:PacketLossNetworkOperation" xmi:id="_o0" name="lose" variableToAffect="_v3">
    <activation xsi:type="_1:FixedTimeActivation" endTime="30.0"/>
    <frequency lowerBound="0.0" upperBound="1.0"/>
  </possibleFuzzingOperations>
  <campaigns name="first" metrics="_m0 _m1 _m2 _m3 _m4 _m5" includedOperations="_o0">
    <approach xsi:type="TestingMM:NSGAEvolutionaryAlgorithm" populationSize="10" iterations="4"/>
    <performedTests xmi:id="_p0" name="Test_1">
      <operations xsi:type="_1:PacketLossNetworkOperation" name="lose" variableToAffect="_v3" fromTemplate="_o0">
        <activation xsi:type="_1:ConditionBasedActivation">
          <starting><c xsi:type="_3:BasicCondition" bincomp="GREATER_THAN"><left metric="_m3"/><right xsi:type="_3:ConditionInteger" value="5"/></c></starting>
        </activation>
        <frequency lowerBound="0.5" upperBound="0.5"/>
      </operations>
      <metrics metric="_m0"><result name="M1_crush" value="2.0"/></metrics>
      <metrics metric="_m2"><result name="M4_LiftWarningTime" value="1.5"/></metrics>
    </performedTests>
    <endTrigger xsi:type="TestingMM:TimeBasedEnd" timeLimitSeconds="40"/>
  </campaigns>
  <mrs>
    <variables xmi:id="_v0" name="lift/height" type="_t0"/>
    <variables xmi:id="_v1" name="lift/SafetyZone1" type="_t1"/>
    <variables xmi:id="_v2" name="lift/SafetyZone2" type="_t1"/>
    <variables xmi:id="_v3" name="Consert_Lift/guarantee_carry_medium" type="_t2"/>
    <variables xmi:id="_v4" name="Consert_Lift/guarantee_carry_high" type="_t3"/>
    <variables xmi:id="_v5" name="hall/Consert_Hand/guarantee_grip" type="_t2"/>
    <variables xmi:id="_v6" name="hall/Consert_Hand/guarantee_hold" type="_t2"/>
    <variables xmi:id="_v7" name="hall/Consert_Hand/guarantee_force" type="_t0"/>
    <nodes name="EDDI" publisher="_v3 _v4"/>
    <propertyType xmi:id="_t0" name="doubleEncodedAsString" parsingMethod="STRING"/>
    <propertyType xmi:id="_t1" name="SafetyZone"/>
    <propertyType xmi:id="_t2" name="boolean"/>
    <propertyType xmi:id="_t3" name="std_msgs/Bool"/>
  </mrs>"#;

fn monitored() -> Imported {
    imported(&space(NUMBERED, MONITORED))
}

/// What is said of ConSerts and of warnings.
fn told(imported: &Imported) -> Vec<String> {
    let about = |text: &String| text.contains("ConSert") || text.contains("WarningTime");
    let notes = imported.notes.iter().filter(|(kind, text)| *kind != Kind::Renamed && about(text));
    notes.map(|(kind, text)| format!("{:>8} {text}", kind.word())).collect()
}

#[test]
fn conserts_are_external_monitors_and_their_warnings_lead_times() {
    let imported = monitored();
    let plan = plan(&imported, "first");
    assert_eq!(plan.monitors.len(), 3);
    insta::assert_snapshot!(format!("{}\n---\n{}", imported.text(), told(&imported).join("\n")));
}

#[test]
fn values_of_warnings_that_were_measured_are_kept() {
    let mut imported = monitored();
    let plan = plan(&imported, "first");
    let folder = tempfile::tempdir().unwrap();
    imported.record(0, &plan, folder.path()).unwrap();
    let repository = sesame_record::Repository::open(folder.path()).unwrap();
    let tests = repository.tests().unwrap();
    let of = |name: &str| {
        let at = plan.metrics.iter().position(|metric| metric.name == name).unwrap();
        tests[0].values[at].value
    };
    assert_eq!([of("M1_crush"), of("M4_LiftWarningTime")], [Some(2.0), Some(1.5)]);
}
