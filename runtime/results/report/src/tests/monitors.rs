//! What reports say of monitors: hazards foreseen and missed, decisions with their reasons, certificates.

use sesame_base::observation::{MonitorDecision, MonitorHazard, Outcome};
use sesame_plan::{MonitorState, RequirementId};

use super::*;
use crate::facts::certificate::moment::MomentError;

/// A campaign with two monitors, in which hazards are missed.
fn monitored() -> (tempfile::TempDir, Repository) {
    let folder = tempfile::tempdir().unwrap();
    let repository = sample::campaign(folder.path(), &sample::monitored_plan(), 40);
    (folder, repository)
}

/// The same tests before and after a certificate was mended.
fn mended() -> ([tempfile::TempDir; 2], [Repository; 2]) {
    let folders = [(); 2].map(|()| tempfile::tempdir().unwrap());
    let before = sample::campaign(folders[0].path(), &sample::monitored_plan(), 40);
    let after = sample::campaign(folders[1].path(), &sample::mended_plan(), 40);
    (folders, [before, after])
}

/// The page on such campaigns.
pub(super) fn monitored_page() -> String {
    let ([_before, folder], [before, after]) = mended();
    let path = folder.path().join("report.html");
    write_page_against(&after, Some(&before), &path, &after.digest().unwrap()).unwrap();
    std::fs::read_to_string(path).unwrap()
}

/// A test with a missed hazard, and one with a hazard that was foreseen.
fn found(repository: &Repository) -> [u32; 2] {
    let rows = repository.tests().unwrap();
    let hazard = |number: u32, missed: bool| {
        let monitors = show(repository, &number.to_string()).unwrap().monitors;
        monitors.iter().flat_map(|monitor| &monitor.hazards).any(|hazard| hazard.foreseen != missed)
    };
    [true, false].map(|missed| rows.iter().find(|row| hazard(row.number, missed)).unwrap().number)
}

#[test]
fn the_summary_counts_hazards_and_lists_missed_ones_first() {
    let (_folder, repository) = monitored();
    let summary = summary(&repository).unwrap();
    let text = summary_text(&summary, WIDE);
    let (_, of_monitors) = text.split_once("Missed hazards\n").unwrap();
    insta::assert_snapshot!("monitors_summary", of_monitors.split("\nRegression tests").next().unwrap());
    let monitors = summary.monitors.as_ref().unwrap();
    let missed: Vec<u32> = monitors.missed.iter().map(|missed| missed.test.0).collect();
    assert!(!missed.is_empty() && missed.is_sorted());
    assert!(headline(&summary).contains(&format!("hazards missed in {} test", missed.len())), "{}", headline(&summary));
    // The metric of the space says the same.
    let of_metric = summary.spreads.iter().find(|spread| spread.metric == "missed").unwrap();
    let sum = of_metric.mean * of_metric.count as f64;
    assert!((sum - monitors.hazards[0].missed as f64).abs() < 1e-9, "{sum}");
    let json = serde_json::to_value(&summary).unwrap();
    assert_eq!(json["monitors"]["hazards"][0]["missed"], missed.len());
}

/// A noisy system: what the run that selected a test showed may have been chance.
#[test]
fn the_hazards_of_a_test_that_was_run_again_are_those_of_its_fresh_runs() {
    use sesame_record::{MetricValue, Recorder, Repetition};

    let (folder, repository) = monitored();
    let [missed, foreseen] = found(&repository);
    let before = summary(&repository).unwrap().monitors.unwrap();
    let satisfied = repository.row(0).unwrap().values;
    let values: Vec<MetricValue> = satisfied.iter().map(|value| MetricValue::whole(value.value, value.set)).collect();
    drop(repository);
    let mut recorder = Recorder::reopen(folder.path(), 1).unwrap();
    let hazard = MonitorHazard { requirement: RequirementId(0), time: 5.0, lead: None };
    for (test, position, hazards) in
        [(missed, 1, vec![]), (missed, 2, vec![]), (foreseen, 1, vec![hazard]), (foreseen, 2, vec![])]
    {
        recorder
            .put_repetition(
                &Repetition {
                    test,
                    position,
                    simulator_seed: u64::from(position),
                    outcome: Outcome::Completed,
                    end: 70.0,
                    messages: 1,
                    values: values.clone(),
                    hazards: vec![hazards],
                },
                &[],
            )
            .unwrap();
    }
    let repository = recorder.finish("all evaluations done").unwrap();
    let summary = summary(&repository).unwrap();
    let monitors = summary.monitors.as_ref().unwrap();
    assert_eq!(monitors.run_again, 2);
    assert_eq!(monitors.missed.len(), before.missed.len(), "one is none, and one is new");
    assert!(monitors.missed.iter().all(|hazard| hazard.test.0 != missed));
    let new = monitors.missed.iter().find(|hazard| hazard.test.0 == foreseen).unwrap();
    let again = new.again.as_ref().unwrap();
    assert_eq!((new.at, &new.state, again.again, again.conclusive, again.first), (5.0, &None, 1, 2, false));
    let [now, then] = [&monitors.hazards[0], &before.hazards[0]];
    assert_eq!((now.missed, now.foreseen), (then.missed, then.foreseen - 1));
    let text = summary_text(&summary, WIDE);
    assert!(text.contains("1 of 2 (0.09–0.91) flaky, not in its first run"), "{text}");
    assert!(text.contains("The hazards of 2 tests that were run again are those of their fresh runs"), "{text}");
    let list = list(&repository).unwrap();
    let of = |number: u32| list.tests.iter().find(|test| test.test.0 == number).unwrap().missed.clone();
    assert_eq!((of(missed), of(foreseen)), (vec![], vec!["R1 by transport".to_owned()]));
    // The view of the database follows the same rule.
    let open = rusqlite::Connection::open(folder.path().join(sesame_record::DATABASE)).unwrap();
    let mut view = open.prepare("SELECT test, repetition FROM hazards WHERE test IN (?1, ?2)").unwrap();
    let rows = view.query_map([missed, foreseen], |row| Ok((row.get(0)?, row.get(1)?))).unwrap();
    assert_eq!(rows.collect::<Result<Vec<(u32, Option<u32>)>, _>>().unwrap(), [(foreseen, Some(1))]);
}

#[test]
fn the_list_marks_tests_with_missed_hazards() {
    let (_folder, repository) = monitored();
    let [missed, foreseen] = found(&repository);
    let list = list(&repository).unwrap();
    let of = |number: u32| list.tests.iter().find(|test| test.test.0 == number).unwrap().missed.clone();
    assert_eq!((of(missed), of(foreseen)), (vec!["R1 by transport".to_owned()], vec![]));
    let text = list_text(&list, WIDE);
    assert!(text.lines().next().unwrap().contains("missed"), "{text}");
    assert!(text.contains("R1 by transport"));
    // Where there are no monitors there is no such column.
    let (_folder, without) = repository_without();
    assert!(!list_text(&super::list(&without).unwrap(), WIDE).contains("missed"));
}

fn repository_without() -> (tempfile::TempDir, Repository) {
    super::repository()
}

#[test]
fn a_test_shows_hazards_and_decisions_with_reasons() {
    let (_folder, repository) = monitored();
    let [missed, foreseen] = found(&repository);
    let text = test_text(&show(&repository, &missed.to_string()).unwrap(), WIDE);
    let (_, of_monitors) = text.split_once("\nHazards\n").unwrap();
    insta::assert_snapshot!("monitors_of_a_test", of_monitors);
    assert!(of_monitors.contains("MISSED"), "{of_monitors}");
    let shown = show(&repository, &foreseen.to_string()).unwrap();
    assert!(test_text(&shown, WIDE).contains("foreseen"));
    let json = serde_json::to_value(show(&repository, &missed.to_string()).unwrap()).unwrap();
    insta::assert_snapshot!("monitors_of_a_test_json", serde_json::to_string_pretty(&json["monitors"][0]).unwrap());
}

#[test]
fn each_decision_has_a_reason_that_decides_it() {
    let (_folder, repository) = monitored();
    let plan = repository.plan();
    let mut decisions = 0;
    for row in repository.tests().unwrap() {
        for (monitor, declared) in
            show(&repository, &row.number.to_string()).unwrap().monitors.iter().zip(&plan.monitors)
        {
            for decision in &monitor.decisions {
                decisions += 1;
                let held = declared.guarantees.iter().position(|guarantee| guarantee.name == decision.state);
                let expected = held.map_or(declared.guarantees.len(), |at| at + 1);
                assert_eq!(decision.why.len(), expected, "{}: {decision:#?}", row.number);
                let last = decision.why.last().unwrap();
                assert_eq!(last.holds == "true", held.is_some());
                assert!(last.because.iter().all(|because| because.since <= decision.at));
                assert_eq!(decision.cause.is_none(), decision.at == 0.0 && held.is_none());
            }
        }
    }
    assert!(decisions > 100, "{decisions}");
}

#[test]
fn a_moment_shows_the_values_of_a_certificate_and_what_decided() {
    let (_folder, repository) = monitored();
    let [missed, _] = found(&repository);
    let name = missed.to_string();
    let monitors = show(&repository, &name).unwrap().monitors;
    let hazard = monitors.iter().flat_map(|monitor| &monitor.hazards).find(|hazard| !hazard.foreseen).unwrap();
    let moment = show_at(&repository, &name, hazard.at).unwrap();
    insta::assert_snapshot!("moment", moment_text(&moment, WIDE));
    insta::assert_snapshot!("moment_json", serde_json::to_string_pretty(&moment.monitors[0]).unwrap());
    // At each decision, its state is that of the moment.
    for (at, monitor) in monitors.iter().enumerate() {
        for decision in &monitor.decisions {
            let later = monitor.decisions.iter().rev().find(|other| other.at == decision.at).unwrap();
            let moment = show_at(&repository, &name, decision.at).unwrap();
            let shown = &moment.monitors[at];
            assert_eq!((&shown.state, shown.since), (&later.state, decision.at));
        }
    }
    let outside = show_at(&repository, &name, 1000.0).unwrap_err();
    assert!(matches!(outside, MomentError::Outside { .. }));
    assert!(outside.to_string().ends_with("ran from 0 s to 70 s; 1000 s is not in it"), "{outside}");
    let (_folder, without) = repository_without();
    let said = show_at(&without, "5", 1.0).unwrap_err().to_string();
    assert_eq!(said, "T5 has no decisions of monitors: its space has no `eddi`");
}

#[test]
fn the_page_shows_certificates_over_time_and_marks_missed_hazards_in_words() {
    let html = page(&monitored().1).unwrap();
    let document = parsed(&html);
    let section = |id: &str| document.descendants().find(|node| node.attribute("id") == Some(id)).unwrap();
    let text = |node: roxmltree::Node<'_, '_>| -> String {
        node.descendants().filter(roxmltree::Node::is_text).filter_map(|node| node.text()).collect::<Vec<_>>().join(" ")
    };
    let front = text(section("monitors"));
    assert!(front.contains("Missed hazards") && front.contains("transport"), "{front}");
    let link = section("monitors").descendants().find_map(|node| node.attribute("href")).unwrap();
    let article = section(link.strip_prefix('#').unwrap());
    let words = text(article);
    assert!(words.contains("hazard of R1 missed by transport") && words.contains("✗ R1 MISSED"), "{words}");
    let titles: Vec<String> =
        article.descendants().filter(|node| node.tag_name().name() == "title").map(text).collect();
    let of = |start: &str| titles.iter().find(|title| title.starts_with(start)).unwrap_or_else(|| panic!("{start}"));
    let fast = of("transport: fast (integrity 3) from ");
    assert!(fast.contains("Caused by: ") && fast.contains("fast holds because brakes_ok is true"), "{fast}");
    assert!(of("R1 (Grippers stay out of the safety zones)").contains("MISSED"));
    assert!(html.contains("✓ R1 foreseen"), "a hazard that was foreseen");
    assert!(html.contains("mitigation sent at "));
    // A certificate is a tree with all that it needs.
    let tree = text(section("certificates"));
    for part in [
        "2 of 3",
        "demanded from perception",
        "link1 &gt; 0.1rad stale after 1s is unknown",
        "otherwise, with stop = true",
    ] {
        let part = part.replace("&gt;", ">");
        assert!(tree.contains(&part), "{part}: {tree}");
    }
}

#[test]
fn lanes_and_trees_are_drawn() {
    let (_folder, repository) = monitored();
    let html = page(&repository).unwrap();
    let [missed, _] = found(&repository);
    let article = html.split_once(&format!("id=\"T{missed}\"")).unwrap().1.split_once("</article>").unwrap().0;
    let lanes = article.split_once("<b>transport</b>").unwrap().1.split_once("<b>perception</b>").unwrap().0;
    insta::assert_snapshot!("certificate_lanes", lanes.replace("><", ">\n<"));
    let trees = html.split_once("<h3 id=\"certificate-1\">").unwrap().1.split_once("</section>").unwrap().0;
    insta::assert_snapshot!("certificate_tree", trees.replace("><", ">\n<"));
}

#[test]
fn a_mend_is_shown_in_the_same_tests_before_and_after() {
    let (_folders, [before, after]) = mended();
    let mend = mend(&after, &before).unwrap();
    let [old, new] = [&before, &after].map(|side| summary(side).unwrap().monitors.unwrap().missed);
    let tests_of = |missed: &[MissedHazard]| missed.iter().map(|missed| missed.test).collect::<Vec<_>>();
    assert_eq!((mend.tests, &mend.difference), (41, &None), "all but the crash and the duplicate");
    assert_eq!((mend.missed_before, mend.missed_after), (old.len(), new.len()));
    assert!(0 < mend.missed_after && mend.missed_after < mend.missed_before, "{mend:#?}");
    assert!(mend.changed.iter().all(|test| test.test == test.before && test.same_seed));
    let of = |side: fn(&MendedTest) -> &Vec<String>| {
        let mut tests: Vec<_> =
            mend.changed.iter().filter(|test| !side(test).is_empty()).map(|test| test.test).collect();
        tests.sort();
        tests
    };
    assert_eq!((of(|test| &test.missed_before), of(|test| &test.missed_after)), (tests_of(&old), tests_of(&new)));
    // In text, in JSON, and on the page.
    let mut summary = summary(&after).unwrap();
    assert_eq!(serde_json::to_value(&summary).unwrap()["mend"], serde_json::Value::Null);
    summary.mend = Some(Mend { before: "before".into(), ..mend.clone() });
    let text = summary_text(&summary, WIDE);
    let (_, text) = text.split_once("Before and after the mend\n").unwrap();
    insta::assert_snapshot!("mend", text.split("\n\n").next().unwrap());
    let html = monitored_page();
    let document = parsed(&html);
    let section = document.descendants().find(|node| node.attribute("id") == Some("mend")).unwrap();
    let sides: Vec<&str> = section
        .descendants()
        .filter(|node| node.attribute("class").is_some_and(|class| class.starts_with("side")))
        .map(|node| node.text().unwrap())
        .collect();
    assert_eq!(sides.len(), 2 * mend.changed.len().min(12));
    for (test, pair) in mend.changed.iter().zip(sides.chunks(2)) {
        let words = |side: &str, missed: &[String]| match missed {
            [] => format!("{side}: no hazard missed"),
            missed => format!("{side}: hazard of {} MISSED", missed.join(", ")),
        };
        assert_eq!(pair, [words("Before", &test.missed_before), words("After", &test.missed_after)]);
    }
}

#[test]
fn tests_are_the_same_by_what_they_do_and_other_changes_are_named() {
    let folders = [(); 2].map(|()| tempfile::tempdir().unwrap());
    let before = sample::campaign(folders[0].path(), &sample::monitored_plan(), 20);
    let mut plan = sample::mended_plan();
    plan.requirements[1].bound = sesame_plan::Bound::AtMost { value: 2.0 };
    let mut recorder = sesame_record::Recorder::create(folders[1].path(), &plan, 42, 1).unwrap();
    // Other numbers, as if they had been exported; the last one does not exist before.
    for (number, mut record) in
        (0..).zip(sample::records(&plan, 19).into_iter().skip(15).chain(sample::records(&plan, 30).pop()))
    {
        record.number = number;
        record.parents = Vec::new();
        recorder.commit(&record).unwrap();
    }
    let after = recorder.finish("all evaluations done").unwrap();
    let mend = mend(&after, &before).unwrap();
    assert_eq!(mend.tests, after.tests().unwrap().len() - 1);
    assert_eq!(mend.difference.as_deref(), Some("requirement `R2` has changed"));
    assert!(mend.changed.iter().all(|test| test.before.0 == test.test.0 + 15), "{mend:#?}");
    assert!(!mend.changed.is_empty());
}

#[test]
fn very_many_changes_are_drawn_as_a_few() {
    let folder = tempfile::tempdir().unwrap();
    let plan = sample::monitored_plan();
    let mut recorder = sesame_record::Recorder::create(folder.path(), &plan, 42, 1).unwrap();
    for mut record in sample::records(&plan, 1) {
        let decisions = &mut record.observation.monitors[0].decisions;
        let state = |at: u32| if at.is_multiple_of(2) { MonitorState::Otherwise } else { MonitorState::Guarantee(0) };
        *decisions = (0..4_000).map(|at| MonitorDecision { time: f64::from(at) / 100.0, state: state(at) }).collect();
        recorder.commit(&record).unwrap();
    }
    let html = page(&recorder.finish("all evaluations done").unwrap()).unwrap();
    let drawn = html.matches("class=\"state ").count();
    assert!(drawn < 200, "{drawn}");
    assert!(html.contains("transport changes "), "and says so");
}

#[test]
fn of_an_inconclusive_requirement_nobody_can_tell_whether_there_was_a_hazard() {
    let folder = tempfile::tempdir().unwrap();
    let plan = sample::monitored_plan();
    let foreseen = plan.hazards_to_foresee();
    let mut recorder = sesame_record::Recorder::create(folder.path(), &plan, 42, 1).unwrap();
    for mut record in sample::records(&plan, 8) {
        for shown in &mut record.observation.metrics {
            (shown.not_finite, shown.reach) = (Some(2.0), sesame_base::observation::Reach::ANY);
        }
        record.observation.monitors.iter_mut().for_each(|monitor| monitor.hazards.clear());
        recorder.commit(&record).unwrap();
    }
    let summary = summary(&recorder.finish("all evaluations done").unwrap()).unwrap();
    let monitors = summary.monitors.as_ref().unwrap();
    assert!(monitors.tests > 0 && monitors.unknown == monitors.tests, "{monitors:?}");
    assert_eq!(monitors.hazards.len(), foreseen.len());
    assert!(
        monitors.hazards.iter().all(|pair| pair.unknown == monitors.tests && pair.false_alarms == 0),
        "{monitors:?}"
    );
    let text = summary_text(&summary, WIDE);
    assert!(text.contains("nobody can tell whether there was a hazard: requirements are inconclusive"), "{text}");
    assert!(!text.contains("there was no hazard"), "{text}");
}
