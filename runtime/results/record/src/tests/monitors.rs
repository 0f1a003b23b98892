//! What monitors did, in results: read back, outside the digest, and missing in results that have none.

use rusqlite::Connection;

use sesame_base::observation::{ChangeCause, EvidenceChange, MonitorDecision, MonitorHazard, MonitorObservation};
use sesame_plan::testing::{evidence_above, guarantee, monitor, topic};
use sesame_plan::{CampaignPlan, Gate, MonitorState, RequirementId, Type};

use super::folder;
use crate::{DATABASE, Origin, Recorder, Repository, sample};

fn plan() -> CampaignPlan {
    let mut plan = sample::plan();
    let state = u32::try_from(plan.topics.len()).unwrap();
    plan.topics.push(topic("state", &["state"], Type::Bool));
    let evidence = vec![evidence_above("ok", 0, 4.0)];
    plan.monitors = vec![monitor("cell", state, evidence, vec![guarantee("safe", 3, Gate::Evidence(0))])];
    plan
}

fn shown() -> MonitorObservation {
    let decision = |time, state| MonitorDecision { time, state };
    let message = ChangeCause::Message { topic: "a".to_owned(), index: 7 };
    let change = |time, holds, cause| EvidenceChange { time, evidence: 0, holds, cause };
    MonitorObservation {
        decisions: vec![
            decision(0.0, MonitorState::Otherwise),
            decision(1.5, MonitorState::Guarantee(0)),
            decision(2.500_000_001, MonitorState::Otherwise),
        ],
        evidence: vec![change(1.5, Some(true), message), change(2.500_000_001, None, ChangeCause::Stale)],
        hazards: vec![
            MonitorHazard { requirement: RequirementId(0), time: 2.0, lead: None },
            MonitorHazard { requirement: RequirementId(2), time: 3.5, lead: Some(0.999_999_999) },
        ],
        omitted: 4,
    }
}

fn recorded(folder: &std::path::Path, shown: Vec<MonitorObservation>) -> Repository {
    let plan = plan();
    let mut recorder = Recorder::create(folder, &plan, 1, 1).unwrap();
    let mut record = sample::record(&plan, 3, Origin::Search, plan.tests[0].test.clone());
    record.observation.monitors = shown;
    recorder.commit(&record).unwrap();
    recorder.finish("done").unwrap()
}

#[test]
fn what_a_monitor_did_comes_back_with_its_test_and_sql_reads_it_with_names() {
    let folder = folder();
    let repository = recorded(folder.path(), vec![shown()]);
    assert_eq!(repository.test(3).unwrap().observation.monitors, [shown()]);
    assert!(repository.records(3..=3, false).unwrap()[0].observation.monitors.is_empty());
    let open = Connection::open(folder.path().join(DATABASE)).unwrap();
    let rows = |sql: &str| -> Vec<String> {
        let mut statement = open.prepare(sql).unwrap();
        statement.query_map([], |row| row.get(0)).unwrap().collect::<Result<_, _>>().unwrap()
    };
    let decisions =
        rows("SELECT monitor || ' ' || time_s || ' ' || state || ' ' || integrity FROM decisions WHERE test = 3");
    assert_eq!(decisions, ["cell 0.0 unsafe 0", "cell 1.5 safe 3", "cell 2.500000001 unsafe 0"]);
    let evidence = rows(
        "SELECT evidence || ' ' || coalesce(holds, '?') || ' ' || cause || coalesce(' ' || path || message, '') FROM evidence",
    );
    assert_eq!(evidence, ["ok 1 message a7", "ok ? stale"]);
    let hazards = rows(
        "SELECT monitor || ' ' || requirement || ' ' || time_s || ' ' || foreseen || ' ' || coalesce(lead_s, '-') \
         FROM hazards WHERE test_name = 'T3' ORDER BY time_s",
    );
    assert_eq!(hazards, ["cell R1 2.0 0 -", "cell R3 3.5 1 0.999999999"]);
}

#[test]
fn results_of_before_hazards_were_recorded_are_read_and_go_on() {
    let folder = folder();
    drop(recorded(folder.path(), vec![shown()]));
    let open = Connection::open(folder.path().join(DATABASE)).unwrap();
    open.execute_batch("DROP VIEW hazards; DROP TABLE repetition_hazards; DROP TABLE monitor_hazards").unwrap();
    let repository = Repository::open(folder.path()).unwrap();
    let read = repository.test(3).unwrap().observation.monitors;
    assert_eq!(read, [MonitorObservation { hazards: Vec::new(), ..shown() }]);
    crate::monitors::install(&open, &plan()).unwrap();
    assert!(crate::monitors::have_hazards(&open).unwrap());
}

#[test]
fn the_digest_is_of_scores_and_not_of_decisions() {
    let (with, without) = (folder(), folder());
    let digest = |repository: Repository| repository.digest().unwrap();
    assert_eq!(digest(recorded(with.path(), vec![shown()])), digest(recorded(without.path(), Vec::new())));
}

#[test]
fn results_without_monitors_have_no_tables_of_them_and_others_in_their_place_are_refused() {
    let folder = folder();
    drop(sample::campaign(folder.path(), &sample::plan(), 12));
    let open = Connection::open(folder.path().join(DATABASE)).unwrap();
    assert!(!crate::monitors::are_in(&open).unwrap());
    open.execute_batch("CREATE TABLE monitor_decisions (test INTEGER)").unwrap();
    drop(open);
    let said = Repository::open(folder.path()).err().unwrap().to_string();
    assert!(said.contains("the table `monitor_decisions` is not the one that a run makes"), "{said}");
}
