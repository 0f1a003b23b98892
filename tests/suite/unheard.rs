//! Campaigns in which no node subscribes to the disturbed topics: they end before they fuzz, and say why.

use sesame_base::observation::Outcome;
use sesame_record::{EventKind, Repository};
use sesame_tests::Project;

/// Hides what only metrics listen to: in the cell, no robot subscribes to its zones and its speed.
const HIDDEN: &str = "
    operation hide_zones on zones = blackhole within [0s, 65s]
    operation hide_speed on speed = blackhole within [0s, 65s]
    campaign hidden {
      objectives fuzzing_time
      operations hide_zones, hide_speed 1..3 per test
      activate   by time
      search     falsification { evaluations 10  seed 1 }
      coverage   { T1 [0, 1] cells 6  T2 [0, 0.5] cells 6 }
      end        after 70s
    }
";

/// May act only before the belt has said anything, and only after everything was said.
const UNREACHED: &str = "
    operation too_early on link0 = blackhole within [0s, 10ms]
    operation reaches   on link0 = blackhole within [0s, 65s]
    campaign early {
      objectives top_speed
      operations too_early, reaches 1..2 per test each at most once
      activate   by time
      search     random { evaluations 6  seed 1 }
      end        after 70s
    }
";

#[test]
fn a_campaign_with_an_operation_that_can_never_act_ends_before_it_fuzzes_and_is_not_green_afterwards() {
    let project = Project::kuka_cell_with("kuka_cell_unreached", UNREACHED);
    let runner = project.build("early");
    for command in [&["run", "--results", "r"][..], &["resume", "r/1"]] {
        let refused = runner.run(command).expect(1);
        let said = "operation `too_early` cannot act: in the reference run, `link0` has no message from 0 s to 0.01 s, the \
                    only time at which the operation may be active; the nearest message is at ";
        assert!(refused.err.contains(said) && !refused.err.contains("`reaches`"), "{command:?}: {}", refused.err);
    }
    let ran = runner.run(&["resume", "r/1", "--allow-unheard"]);
    assert!(ran.err.contains("operation `too_early` cannot act"), "{}", ran.err);
}

#[test]
fn a_campaign_that_nobody_hears_ends_before_it_fuzzes_and_names_its_operations() {
    let project = Project::kuka_cell_with("kuka_cell_unheard", HIDDEN);
    let checked = project.sesamec("generate", &["--campaign", "hidden"]).expect(0);
    assert!(
        checked.err.contains("operation `hide_zones` has no effect: no node subscribes to `zones`"),
        "{}",
        checked.err
    );
    let runner = project.build("hidden");
    for command in [&["run", "--results", "r"][..], &["resume", "r/1"]] {
        let refused = runner.run(command).expect(1);
        for part in ["`hide_zones`", "`zones`", "`hide_speed`", "`speed`", "nothing was fuzzed", "--allow-unheard"] {
            assert!(refused.err.contains(part), "{command:?}, {part}: {}", refused.err);
        }
    }
    let refused = Repository::open(&runner.folder.join("r/1")).unwrap();
    assert_eq!(refused.tests().unwrap().len(), 1, "only the reference run");
    drop(refused);

    let vain = runner.run(&["resume", "r/1", "--allow-unheard"]).expect(3);
    assert!(vain.err.contains("no operation had an effect in any of 10 tests"), "{}", vain.err);
    let repository = Repository::open(&runner.folder.join("r/1")).unwrap();
    let rows = repository.tests().unwrap();
    assert_eq!(rows.len(), 12);
    assert!(rows[1..11].iter().all(|row| row.outcome == Outcome::NoEffect), "nothing was disturbed: {rows:?}");
    let mut unheard = 0;
    for row in &rows {
        let record = repository.test(row.number).unwrap();
        unheard += record.observation.operations.iter().map(|effect| effect.counters.unheard).sum::<u64>();
        assert!(record.observation.operations.iter().all(|effect| effect.first_touch.is_none()), "T{}", row.number);
    }
    assert!(unheard > 0, "what they did is counted apart");
    let warnings = repository.events().unwrap().into_iter().filter(|event| event.kind == EventKind::Warning);
    let warnings: Vec<String> = warnings.map(|event| event.text).collect();
    assert!(
        warnings.iter().any(|text| text.contains("nothing receives what operation `hide_speed` disturbs")),
        "{warnings:?}"
    );
}
