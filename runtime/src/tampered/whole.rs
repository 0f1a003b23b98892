//! Small results of every kind, before any change.

use std::fs;
use std::path::Path;

use sesame_base::observation::{OperationEffect, Outcome};
use sesame_plan::condition::ConditionEnd;
use sesame_plan::testing::lab;
use sesame_plan::{
    Adjustment, BoostedChildren, CampaignPlan, Compensation, Confirmation, CoverageGoal, Dimension, Expectation,
    Exploration, Failing, Fit, Fitted, GridAxis, Lab, LabBudget, LabExclusion, LabShape, LabTask, LabTest,
    LabTolerance, MetricId, RankKey, RankOrder, RequirementId, ShapeForm, ShapePlace, Shrinking, Statistic, StopRule,
    Task, TopicId,
};
use sesame_record::{
    DATABASE, Entered, GenerationCoverage, Origin, Provenance, Recorder, Repetition, entered_outcome, sample,
};
use sesame_search as search;

/// The contents of a results folder before any change: the database, and its log if there is one.
pub(super) struct Whole {
    pub(super) name: &'static str,
    pub(super) database: Vec<u8>,
    pub(super) log: Option<Vec<u8>>,
}

/// What is in a folder of results.
fn taken(name: &'static str, folder: &Path) -> Whole {
    let database = fs::read(folder.join(DATABASE)).unwrap();
    let log = fs::read(folder.join(format!("{DATABASE}-wal"))).ok();
    Whole { name, database, log }
}

fn again(recorder: &mut Recorder, plan: &CampaignPlan, test: u32) {
    let record = recorder.repository().test(test).unwrap();
    for position in 1..=3 {
        let mut observed = sample::observe(plan, &record.test, u64::from(position));
        if position == 2 {
            observed.outcome = Outcome::Crash { message: "again".to_owned() };
        }
        recorder.put_repetition(&Repetition::of(test, position, 9, &observed), &["a word".to_owned()]).unwrap();
    }
}

/// A plan with all that a search by time can have.
pub(super) fn rich() -> CampaignPlan {
    let mut plan = sample::plan();
    let axis = |dimension, high, cells| GridAxis { dimension, low: 0.0, high, cells };
    let axes = vec![axis(Dimension::T1, 1.0, 4), axis(Dimension::P1, 1.0, 3)];
    plan.campaign.coverage = Some(CoverageGoal { axes, hits: 1, stop_at: Some(0.9) });
    let children = BoostedChildren::Falling { first: 9, last: 2, drop: 1 };
    plan.campaign.exploration = Some(Exploration::Boost { every_generations: 2, children, tries: 5 });
    plan.campaign.confirm = Some(Confirmation { times: 3, by: Statistic::Quantile { share: 0.5 }, violations: true });
    plan.campaign.stop = vec![
        StopRule::Stagnation { generations: 3, below: 0.01 },
        StopRule::Completeness { share: 0.9 },
        StopRule::NoNewCause { tests: 40 },
        StopRule::EveryPair,
    ];
    let bound = plan.requirements[0].bound;
    plan.tests[0].expectations = vec![Expectation { metric: MetricId(0), bound }];
    plan.labs = vec![Lab {
        exclude: vec![LabExclusion { metric: MetricId(0), bound }],
        rank: vec![RankKey { metric: MetricId(0), order: RankOrder::ClosestTo { value: 5.0 } }],
        budget: Some(LabBudget { limit: 5.0, lambda: 0.5, over: vec![Dimension::T1, Dimension::P1] }),
        tolerances: vec![LabTolerance { metric: MetricId(1), value: 1.0 }],
        interlock: vec![MetricId(0)],
        shapes: vec![
            LabShape {
                name: "gripper".to_owned(),
                doc: String::new(),
                form: ShapeForm::Sphere { radius: 0.3 },
                place: ShapePlace::Pose { pose: "r3200/gripper".to_owned() },
                expand: 0.0,
            },
            LabShape {
                name: "Z1".to_owned(),
                doc: String::new(),
                form: ShapeForm::Box { edges: [0.8, 1.2, 2.0] },
                place: ShapePlace::Fixed { centre: [1.2, 0.4, 1.0] },
                expand: 0.15,
            },
        ],
        fits: vec![Fit { what: Fitted::Delay { topic: Some(TopicId(0)) }, low: 0.0, high: 0.5 }],
        ..lab("lab")
    }];
    let servo = Fitted::Parameter { name: "servo_gain".to_owned() };
    plan.compensation = Some(Compensation {
        lab: "lab".to_owned(),
        adjustments: vec![
            Adjustment { what: Fitted::Delay { topic: None }, levels: vec![0.04] },
            Adjustment { what: servo, levels: vec![0.9, 1.1] },
        ],
    });
    plan
}

/// Results of every kind, small.
pub(super) fn wholes() -> Vec<Whole> {
    let mut wholes = Vec::new();
    {
        let folder = tempfile::tempdir().unwrap();
        let plan = rich();
        drop(sample::campaign_with_fronts(folder.path(), &plan, 45));
        let mut recorder = Recorder::reopen(folder.path(), 1).unwrap();
        again(&mut recorder, &plan, 1);
        again(&mut recorder, &plan, 17);
        for generation in 0..4 {
            let coverage = GenerationCoverage { generation, evaluations: 10, covered: 3, cells: 12, feasible: 11 };
            recorder.put_coverage(&coverage).unwrap();
        }
        recorder.finish("all evaluations done").unwrap();
        wholes.push(taken("searched", folder.path()));
    }
    {
        let folder = tempfile::tempdir().unwrap();
        let plan = sample::offline_plan(ConditionEnd::Length { low: 0.5, high: 4.0 });
        let mut recorder = Recorder::create(folder.path(), &plan, 7, 1).unwrap();
        for record in &sample::records(&plan, 12) {
            recorder.commit(record).unwrap();
        }
        let conditional = sample::record(&plan, 20, Origin::Search, sample::conditional_test());
        recorder.commit(&conditional).unwrap();
        // As a kill leaves it: with its log.
        wholes.push(taken("killed", folder.path()));
        recorder.finish("all evaluations done").unwrap();
        wholes.push(taken("by condition", folder.path()));
    }
    {
        let folder = tempfile::tempdir().unwrap();
        let plan = sample::plan();
        let mut recorder = Recorder::create(folder.path(), &plan, 1, 0).unwrap();
        for number in 1..6 {
            let test = plan.tests[0].test.clone();
            let mut record = sample::record(&plan, number, Origin::Search, test);
            record.observation.outcome = Outcome::Unknown;
            for effect in &mut record.observation.operations {
                *effect = OperationEffect { intervals: effect.intervals.clone(), ..OperationEffect::default() };
            }
            recorder.commit(&record).unwrap();
        }
        recorder.put_original_names([(1, "Test_001"), (2, "Test_002")]).unwrap();
        recorder.finish("imported").unwrap();
        wholes.push(taken("imported", folder.path()));
    }
    {
        let folder = tempfile::tempdir().unwrap();
        let mut plan = sample::plan();
        let task = Task::Shrink(Shrinking {
            name: "known_jitter".to_owned(),
            test: plan.tests[0].test.clone(),
            failing: Failing::Violation { requirements: vec![RequirementId(0)], margins: Vec::new() },
            simulator_seed: u64::MAX,
            runs: 1,
            evaluations: 12,
            messages: false,
            when: false,
        });
        plan = task.plan(&plan);
        let mut recorder = Recorder::create_for(folder.path(), &plan, &task, 1, 0).unwrap();
        recorder.commit(&sample::record(&plan, 0, Origin::Reference, sesame_plan::Test::default())).unwrap();
        let mut search = search::strategy_of_task(&plan, &task, 1).unwrap();
        let (mut number, mut asked) = (1, search.ask());
        while !asked.is_empty() && number < 12 {
            let mut told = Vec::new();
            for candidate in asked {
                let record = sample::record(&plan, number, Origin::Search, candidate.test.clone());
                recorder.commit(&record).unwrap();
                told.push(search::Evaluated {
                    number,
                    test: candidate.test,
                    fitness: search::fitness(&plan, &record.observation),
                    point: None,
                    run: std::sync::Arc::new(record.observation),
                    fresh_runs: Vec::new(),
                });
                number += 1;
            }
            search.tell(&told);
            asked = search.ask();
        }
        recorder.finish("nothing more to try").unwrap();
        wholes.push(taken("shrunk", folder.path()));
    }
    {
        let folder = tempfile::tempdir().unwrap();
        let plan = rich();
        let test = plan.tests[0].test.clone();
        let mut other = test.clone();
        other.operations[0].operation_seed += 1;
        let tests = vec![LabTest { number: 7, test }, LabTest { number: 12, test: other }];
        let task = Task::Lab(LabTask { lab: "lab".to_owned(), results: "0".repeat(64), tests, repeats: 3 });
        let plan = task.plan(&plan);
        let mut recorder = Recorder::create_for(folder.path(), &plan, &task, 1, 1).unwrap();
        let candidates = search::strategy_of_task(&plan, &task, 1).unwrap().ask();
        assert_eq!(candidates.len(), 6);
        for (number, candidate) in (1..).zip(candidates) {
            recorder.commit(&sample::record(&plan, number, Origin::Search, candidate.test)).unwrap();
        }
        recorder.finish("all tests are done").unwrap();
        wholes.push(taken("lab", folder.path()));
    }
    {
        let folder = tempfile::tempdir().unwrap();
        let plan = rich();
        let tests = vec![LabTest { number: 7, test: plan.tests[0].test.clone() }];
        let task = LabTask { lab: "lab".to_owned(), results: "0".repeat(64), tests, repeats: 3 };
        let plan = Task::Lab(task.clone()).plan(&plan);
        let mut recorder = Recorder::create_for(folder.path(), &plan, &Task::Lab(task.clone()), 1, 0).unwrap();
        let run = |(run, word)| Entered {
            of: 7,
            run,
            outcome: entered_outcome(word, &plan).unwrap(),
            values: (0..).take(plan.metrics.len()).map(|at: u32| (at != 2).then(|| f64::from(at))).collect(),
            provenance: Provenance { operator: Some("Ada".to_owned()), ..Provenance::default() },
        };
        let runs: Vec<Entered> = (1..).zip(["completed", "unknown", "timeout"]).map(run).collect();
        recorder.put_entered_runs(task, &runs).unwrap();
        recorder.finish("entered by hand").unwrap();
        wholes.push(taken("entered", folder.path()));
    }
    wholes
}
