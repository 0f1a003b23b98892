//! Old data comes along: files of the original platform, imported as a user would. They are not ours to keep, so
//! `SESAME_LEGACY_DIR` names the folder they lie in; without it these tests say so and check nothing, and small files
//! of our own stand in for them where the importer is tested by itself.

use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::path::{Path, PathBuf};

use sesame_analysis as analysis;
use sesame_analysis::{Datum, Selection};
use sesame_record::{DATABASE, Origin, Repository, Status};
use sesame_tests::{Done, Project, command, done, fresh_folder, sesamec, turn, workspace};

const LEGACY: &str = "SESAME_LEGACY_DIR";

/// The folder of the original platform's files.
pub(crate) fn legacy() -> Option<PathBuf> {
    let folder = std::env::var_os(LEGACY).map(PathBuf::from);
    if folder.is_none() {
        eprintln!("skipped: {LEGACY} names no folder of files of the original platform");
    }
    folder
}

fn import(file: &Path, out: &Path) -> Done {
    done(command(sesamec()).arg("import").arg(file).arg("-o").arg(out))
}

/// A file of that folder, imported into a fresh folder of this name.
pub(crate) fn imported(file: &str, name: &str) -> Option<PathBuf> {
    let out = fresh_folder(name);
    import(&legacy()?.join(file), &out).expect(0);
    Some(out)
}

pub(crate) fn results(out: &Path, campaign: &str) -> Repository {
    Repository::open(&out.join("results").join(campaign)).unwrap()
}

/// `sesamec results …` as rows of CSV, with its head.
pub(crate) fn rows(arguments: &[&str], folder: &Path) -> Vec<Vec<String>> {
    let said = done(command(sesamec()).arg("results").args(arguments).args(["--format", "csv"]).arg(folder)).expect(0);
    said.out.lines().map(|line| line.split(',').map(str::to_owned).collect()).collect()
}

#[test]
fn every_file_of_the_original_platform_is_imported_with_all_its_tests_and_a_broken_one_refused() {
    let Some(folder) = legacy() else { return };
    let mut files: Vec<PathBuf> = fs::read_dir(&folder).unwrap().map(|entry| entry.unwrap().path()).collect();
    files.retain(|file| file.extension().is_some_and(|extension| extension == "model"));
    files.sort();
    assert!(files.len() >= 12, "{files:?}");
    for file in files {
        let stem = file.file_stem().unwrap().to_str().unwrap().to_owned();
        let out = fresh_folder(&format!("imported_{stem}"));
        let said = import(&file, &out);
        if stem == "merge-markers" {
            let said = said.expect(1);
            assert!(said.err.contains("merge-markers.model:3:1: two versions of the file were merged"), "{}", said.err);
            assert_eq!(said.err.lines().count(), 1, "{}", said.err);
            assert!(fs::read_dir(&out).unwrap().next().is_none(), "nothing is left behind");
            continue;
        }
        let said = said.expect(0);
        let space = out.join(format!("{stem}.sesame"));
        done(command(sesamec()).arg("check").arg(&space)).expect(0);
        done(command(sesamec()).args(["fmt", "--check"]).arg(&space)).expect(0);
        let mut recorded = 0;
        if out.join("results").exists() {
            for campaign in fs::read_dir(out.join("results")).unwrap() {
                let repository = Repository::open(&campaign.unwrap().path().join(DATABASE)).unwrap();
                let tests = repository.tests().unwrap();
                assert!(tests.iter().all(|row| row.outcome.word() == "unknown" && row.origin == Origin::Search));
                assert!(repository.campaign().stop.is_some());
                recorded += tests.len();
            }
        }
        let performed = fs::read_to_string(&file).unwrap().matches("<performedTests").count();
        assert_eq!(recorded, performed, "{stem}: {}", said.err);
    }
}

#[test]
#[ignore = "long: compiles every campaign of a dozen spaces"]
fn every_imported_space_generates_crates_that_compile() {
    let Some(folder) = legacy() else { return };
    let mut compiled = 0;
    for entry in fs::read_dir(&folder).unwrap() {
        let file = entry.unwrap().path();
        let stem = file.file_stem().unwrap().to_str().unwrap().to_owned();
        if stem == "merge-markers" || file.extension().is_none_or(|extension| extension != "model") {
            continue;
        }
        let out = fresh_folder(&format!("compiled_{stem}"));
        import(&file, &out).expect(0);
        let space = out.join(format!("{stem}.sesame"));
        let project = Project { space, runners: out.join("runners"), folder: out };
        project.sesamec("generate", &[]).expect(0);
        for runner in fs::read_dir(&project.runners).unwrap() {
            let runner = runner.unwrap().path();
            if runner.join("Cargo.toml").exists() {
                let campaign = runner.file_name().unwrap().to_str().unwrap().to_owned();
                let checked = project.cargo(&turn(), &campaign, "check");
                assert_eq!(checked.code, Some(0), "{stem}, {campaign}: {}", checked.err);
                compiled += 1;
            }
        }
    }
    assert!(compiled >= 20, "{compiled} campaigns");
}

#[test]
fn old_names_and_flipped_probabilities_are_told() {
    let Some(folder) = legacy() else { return };
    let told = |file: &str, name: &str| import(&folder.join(file), &fresh_folder(name)).expect(0).err;
    let old = told("healthcare-old-dialect.model", "told_old");
    assert!(old.contains("Renamed `possibleAttacks` is `possibleFuzzingOperations` since (4 times)"), "{old}");
    let lost = told("locomotec.model", "told_lost");
    let flipped = "operation `baseScanPacketLoss`: it kept messages with [0.4, 0.7], which is `packet loss [30%, 60%]`";
    assert!(lost.contains(flipped), "{lost}");
    let swapped = told("aircraft.model", "told_swapped");
    assert!(swapped.contains("[20, 3] is [3, 20] now"), "{swapped}");
    let boosted = told("kuka-coverage-ga.model", "told_boosted");
    assert!(boosted.contains("Left out `useMutationEnhancingCoverage`"), "{boosted}");
}

#[test]
fn the_originals_reduced_tests_and_their_ranks_come_out_of_the_imported_results() {
    let Some(out) = imported("kuka-coverage-ga.model", "imported_sspr") else { return };
    let table = fs::read_to_string(legacy().unwrap().join("kuka-coverage-ga.sspr.csv")).unwrap();
    let expected: Vec<Vec<&str>> = table.lines().skip(1).map(|line| line.split(',').collect()).collect();
    let folder = out.join("results/coverageExperiment");
    let found = rows(&["sspr", "--compat", "original"], &folder);
    assert_eq!(found[0], ["test", "T1", "T2", "T3", "P1", "P2", "O0", "O1", "O2", "O3"]);
    assert_eq!((expected.len(), found.len()), (220, 221));
    let repository = Repository::open(&folder).unwrap();
    let names = repository.original_names().unwrap();
    let tests = repository.tests().unwrap();
    // Rank of each test by collisions, ascending; equal ones in the order of their numbers.
    let collisions = repository.plan().metrics.iter().position(|metric| metric.name == "collisionOccurance").unwrap();
    let mut order: Vec<usize> = (0..tests.len()).collect();
    order.sort_by(|&a, &b| {
        let value = |at: usize| tests[at].values[collisions].value.unwrap();
        value(a).total_cmp(&value(b))
    });
    let mut farthest: f64 = 0.0;
    for (at, (expected, found)) in expected.iter().zip(&found[1..]).enumerate() {
        assert_eq!(expected[0], names[&u32::try_from(at + 1).unwrap()]);
        assert_eq!(found[0], format!("T{}", at + 1));
        for (written, computed) in expected[2..11].iter().zip(&found[1..]) {
            farthest = farthest.max((written.parse::<f64>().unwrap() - computed.parse::<f64>().unwrap()).abs());
        }
        let rank = order.iter().position(|&other| other == at).unwrap();
        let quality: f64 = expected[11].parse().unwrap();
        farthest = farthest.max((quality - rank as f64 / 220.0).abs());
    }
    assert!(farthest < 1e-12, "{farthest}");
}

#[test]
fn the_originals_coverage_curves_come_out_of_the_imported_results() {
    let grid = ["coverage", "--compat", "original", "--grid", "T1:0:1:6,T2:0:0.5:6,P1:0:1:3"];
    let covered = |out: &Path, after: u32| -> (String, String, String) {
        let curve = rows(&grid, &out.join("results/coverageExperiment"));
        assert_eq!(curve[0][..5], ["evaluations", "covered", "cells", "coverage", "feasible"]);
        let reached = curve[1..].iter().rfind(|row| row[0].parse::<u32>().unwrap() <= after).unwrap();
        (reached[1].clone(), reached[2].clone(), reached[4].clone())
    };
    let cells = |covered: &str| (covered.to_owned(), "108".to_owned(), "96".to_owned());
    let Some(example) = imported("kuka-coverage-ga-example.model", "imported_curve_example") else { return };
    assert_eq!([covered(&example, 110), covered(&example, 210)], [cells("45"), cells("54")]);
    let other = imported("kuka-coverage-ga.model", "imported_curve").unwrap();
    assert_eq!([covered(&other, 210), covered(&other, 220)], [cells("53"), cells("55")]);
}

#[test]
fn every_stored_front_is_computed_again_from_the_stored_values() {
    let Some(folder) = legacy() else { return };
    let mut pairs = 0;
    for file in
        ["kuka-coverage-ga", "kuka-coverage-ga-example", "kuka-conditions", "turtlesim-256", "healthcare-old-dialect"]
    {
        let out = fresh_folder(&format!("imported_fronts_{file}"));
        import(&folder.join(format!("{file}.model")), &out).expect(0);
        for campaign in fs::read_dir(out.join("results")).unwrap() {
            let repository = Repository::open(&campaign.unwrap().path()).unwrap();
            let sets: BTreeMap<String, _> =
                repository.result_sets().unwrap().into_iter().map(|set| (set.name.clone(), set)).collect();
            for (name, full) in sets.iter().filter(|(name, _)| name.starts_with("FULL-")) {
                // One that was interrupted between the two has no front.
                let Some(stored) = sets.get(&name.replace("FULL-", "NONDOM-")) else { continue };
                let selection = Selection::of(&repository, Some(name)).unwrap();
                let front = analysis::front(&repository, &selection).unwrap();
                let computed: BTreeSet<String> = front
                    .rows()
                    .iter()
                    .map(|row| match &row[0] {
                        Datum::Test(test) => test.to_string(),
                        other => panic!("{other:?}"),
                    })
                    .collect();
                let stored: BTreeSet<String> = stored.members.iter().map(|number| format!("T{number}")).collect();
                assert!(
                    !full.members.is_empty() && full.status == Status::Intermediate || full.status == Status::Final
                );
                assert_eq!(computed, stored, "{file}, {name}");
                pairs += 1;
            }
        }
    }
    assert!(pairs >= 60, "{pairs} fronts");
    let out = fresh_folder("imported_candidates");
    import(&folder.join("kuka-coverage-ga.model"), &out).expect(0);
    let repository = results(&out, "coverageExperiment");
    let sets = repository.result_sets().unwrap();
    let set = sets.iter().find(|set| set.name == "NONDOM-20_06_2023_18_50_18-intermediate-210").unwrap();
    let mut members = set.members.clone();
    members.sort_unstable();
    assert_eq!(members, [27, 103, 137, 158, 161, 174, 187, 201, 202, 209], "the candidates of the paper's Table 4");
}

#[test]
fn an_imported_search_has_indicators_of_its_sets() {
    let Some(out) = imported("kuka-coverage-ga.model", "imported_indicators") else { return };
    let repository = results(&out, "coverageExperiment");
    let analysis = analysis::indicators(&repository, None).unwrap();
    let sets = repository.result_sets().unwrap();
    assert_eq!(analysis.generations.len(), sets.len());
    assert_eq!(analysis.reference.len(), 2);
    for (row, set) in analysis.generations.iter().zip(&sets) {
        assert_eq!(row.set.as_ref(), Some(&set.name));
        let evaluations = row.evaluations.unwrap();
        assert!(set.name.ends_with(&format!("-{evaluations}")) && evaluations % 10 == 0, "{}", set.name);
        assert_eq!((row.no_effect, row.unique), (None, None), "nobody counted");
    }
    let last = analysis.generations.last().unwrap();
    assert_eq!((last.evaluations, last.igd_plus), (Some(220), Some(0.0)));
    let volumes: Vec<f64> = analysis.generations.iter().map(|generation| generation.hypervolume.unwrap()).collect();
    assert!(volumes.is_sorted() && volumes[0] < last.hypervolume.unwrap(), "{volumes:?}");
}

#[test]
fn recorded_timings_are_observed_intervals_and_what_never_activated_has_no_point() {
    let Some(out) = imported("kuka-conditions-timed.model", "imported_timed") else { return };
    let folder = out.join("results/coverageExperiment_condbased");
    let repository = Repository::open(&folder).unwrap();
    let intervals: usize = (1..=4)
        .map(|number| repository.test(number).unwrap().observation.operations)
        .map(|operations| operations.iter().map(|effect| effect.intervals.len()).sum::<usize>())
        .sum();
    let recorded = fs::read_to_string(legacy().unwrap().join("kuka-conditions-timed.model")).unwrap();
    assert_eq!(intervals, recorded.matches("<recordedTimings").count());
    let points = rows(&["sspr", "--compat", "original"], &folder).len() - 1;
    assert!(points > 0 && points < 4, "{points}");
    let out = imported("kuka-conditions.model", "imported_untimed").unwrap();
    let untimed = out.join("results/conditionExperiment");
    assert_eq!(rows(&["sspr"], &untimed).len(), 1, "nobody recorded when its operations were active");
}

#[test]
fn the_conserts_of_the_original_are_watched_and_their_warnings_are_lead_times() {
    let Some(out) = imported("kuka-a50-eddi.model", "imported_conserts") else { return };
    let text = fs::read_to_string(out.join("kuka-a50-eddi.sesame")).unwrap();
    let monitor = text.split("eddi Consert_Robot_Left external {").nth(1).expect("the ConSert is a monitor");
    let monitor = monitor.split('}').next().unwrap();
    assert_eq!([monitor.matches("evidence ").count(), monitor.matches("guarantee ").count()], [2, 2], "{monitor}");
    for (metric, monitor) in [
        ("M4_EDDIWarningTime", "Consert_Robot_Left"),
        ("M7_EDDIWarningTimeHighOnly", "Consert_Robot_Left_high"),
        ("M8_EDDIWarningTimeMediumOnly", "Consert_Robot_Left_medium"),
    ] {
        let metric = format!("metric {metric} maximise default -99999s = lead_time({monitor}, R1)");
        assert!(text.contains(&metric), "no `{metric}` in\n{text}");
    }
    assert!(text.contains("= M1_collisionDriveShaft <= 0\n"), "{text}");
    // M5 and M6 are what the ConSert's evidence is about, as far as the file says, and stay hooks.
    assert!(text.contains("metric M5_KR22Aligned maximise default 100 { hook on KR22_left_sim_aligned_centerpoint }"));
    let again =
        import(&legacy().unwrap().join("kuka-a50-eddi.model"), &fresh_folder("imported_conserts_told")).expect(0);
    assert!(again.err.contains("the file does not say which guarantee is stronger"), "{}", again.err);
    assert!(again.err.contains("What it decides from is not in the file"), "{}", again.err);
}

/// What a user does: import, name the simulator, generate, fill in the hook, run. As docs/import.md tells it.
#[test]
fn an_imported_experiment_runs_on_the_built_in_cell() {
    let Some(out) = imported("kuka-coverage-ga.model", "imported_run") else { return };
    let space = out.join("kuka-coverage-ga.sesame");
    let project = Project { space: space.clone(), runners: out.join("runners"), folder: out.clone() };
    let text = fs::read_to_string(&space).unwrap();
    let cell = workspace().join("examples/kuka_cell/simulator");
    let named = format!("in_process \"kuka_cell_sim::Cell\" {{ crate \"{}\"  step 20ms }}", cell.display());
    let pointed = text.replace("process \"simulator\" { step 20ms }", &named);
    assert_ne!(pointed, text, "{text}");
    fs::write(&space, pointed).unwrap();
    project.sesamec("generate", &["--campaign", "coverageExperiment"]).expect(0);
    let hook = project.runners.join("hooks/collision_occurance.rs");
    let mut filled = fs::read_to_string(&hook).unwrap();
    let stub = "let _ = zone;\n        ctx.unimplemented();";
    assert_eq!(filled.matches(stub).count(), 3, "{filled}");
    filled =
        filled.replace(stub, "if zone.level < 0.0 && ctx.every_seconds(0.2) {\n            ctx.add(1.0);\n        }");
    fs::write(&hook, filled).unwrap();
    let runner = project.build("coverageExperiment");
    let said = runner.run(&["run", "--evaluations", "40", "--results", "own"]).expect(0);
    let repository = Repository::open(&out.join("own/1")).unwrap();
    assert_eq!(repository.tests().unwrap().len(), 42, "{}", said.out);
    assert!(repository.latest_result_set().unwrap().is_some_and(|set| !set.members.is_empty()));
    let most = repository.tests().unwrap().iter().filter_map(|row| row.values[1].value).fold(0.0, f64::max);
    assert!(most >= 1.0, "a hook that counts nothing finds nothing");
    // Its new results are read beside the imported ones.
    let campaigns = rows(&["campaigns"], &out);
    assert!(campaigns.len() > 1 + 3, "{campaigns:?}");
}

/// A file of so many tests in the words of the original platform, made up here.
fn made_up(tests: usize) -> String {
    use std::fmt::Write as _;
    let mut text = String::from(
        r#"<?xml version="1.0" encoding="ASCII"?>
<TestingMM:TestingSpace xmi:version="2.0" xmlns:xmi="http://www.omg.org/XMI" xmlns:xsi="http://www.w3.org/2001/XMLSchema-instance" xmlns="Metrics" xmlns:TestingMM="TestingMM" xmlns:_1="FuzzingOperations" name="large">
  <metrics xsi:type="FuzzingOperationTimesMetric" xmi:id="_m0" name="times" dir="LOWEST" useInOptimisation="true"/>
  <metrics xsi:type="StreamMetric" xmi:id="_m1" name="hits" relatedVariables="_v1" useInOptimisation="true"><valueIfNotReceived/></metrics>
  <possibleFuzzingOperations xsi:type="_1:RandomValueFromSetOperation" xmi:id="_o0" name="push" variableToAffect="_v0" isRelative="true">
    <activation xsi:type="_1:FixedTimeActivation" endTime="65.0"/>
    <valueSet xsi:type="_1:DoubleRange" propertyName="" lowerBound="-0.3" upperBound="0.3"/>
  </possibleFuzzingOperations>
  <campaigns name="seeking" metrics="_m0 _m1" includedOperations="_o0">
    <approach xsi:type="TestingMM:NSGAEvolutionaryAlgorithm" populationSize="10" iterations="1000"/>
"#,
    );
    for test in 0..tests {
        let start = (test % 600) as f64 / 10.1;
        let end = start + (65.0 - start) * ((test % 7) as f64 + 1.0) / 7.1;
        let _ = writeln!(
            text,
            r#"    <performedTests xmi:id="_TestOfTheCampaign{test:06}" name="Test_{test:06}" developedFrom="//@campaigns.0/@performedTests.{} _TestOfTheCampaign{:06}">"#,
            test / 2,
            test / 3
        );
        for operation in 0..2 {
            let _ = write!(
                text,
                r#"      <operations xsi:type="_1:RandomValueFromSetOperation" xmi:id="_Operation{operation}OfTest{test:06}" name="push" variableToAffect="_v0" fromTemplate="_o0" isRelative="true" seed="{test}">
        <activation xsi:type="_1:FixedTimeActivation" xmi:id="_Activation{operation}OfTest{test:06}" startTime="{start}" endTime="{end}"/>
        <valueSet xsi:type="_1:DoubleRange" xmi:id="_ValueSet{operation}OfTest{test:06}" propertyName="" lowerBound="-0.1" upperBound="0.{test}"/>
      </operations>
"#
            );
        }
        let _ = write!(
            text,
            r#"      <metrics xmi:id="_TimesOfTest{test:06}" metric="_m0"><result xmi:id="_ResultOfTimes{test:06}" name="times" value="{}"/></metrics>
      <metrics xmi:id="_HitsOfTest{test:06}" metric="_m1"><result xmi:id="_ResultOfHits{test:06}" name="hits" value="{}.0"/></metrics>
    </performedTests>
"#,
            end - start,
            test % 20
        );
    }
    text.push_str(
        r#"    <endTrigger xsi:type="TestingMM:TimeBasedEnd" timeLimitSeconds="70"/>
  </campaigns>
  <mrs>
    <variables xmi:id="_v0" name="arm/link0" type="_t0"/>
    <variables xmi:id="_v1" name="zones/Z1" type="_t1"/>
    <propertyType xmi:id="_t0" name="doubleEncodedAsString" parsingMethod="STRING"/>
    <propertyType xmi:id="_t1" name="SafetyZone"/>
  </mrs>
</TestingMM:TestingSpace>
"#,
    );
    text
}

/// Imports a made-up file with so much address space, in KiB, and says how large it was and how many tests came of it.
#[cfg(target_os = "linux")]
fn within(name: &str, tests: usize, kilobytes: u64) -> (usize, usize) {
    let folder = fresh_folder(name);
    let (file, out) = (folder.join("large.model"), folder.join("out"));
    let text = made_up(tests);
    fs::write(&file, &text).unwrap();
    let limited = format!("ulimit -v {kilobytes}; exec \"$0\" import \"$1\" -o \"$2\"");
    done(command("sh").args(["-c", &limited]).arg(sesamec()).arg(&file).arg(&out)).expect(0);
    let mut found = 0;
    results(&out, "seeking").scan(&mut |_| found += 1).unwrap();
    fs::remove_dir_all(&folder).unwrap();
    (text.len(), found)
}

#[test]
#[cfg(target_os = "linux")]
#[ignore = "long: 100 MB"]
fn a_hundred_megabytes_are_imported_in_less_than_five_hundred_of_memory() {
    let (size, tests) = within("imported_large", 72_000, 500_000);
    assert!(size > 100_000_000 && tests == 72_000, "{tests} tests of {size} bytes");
}
