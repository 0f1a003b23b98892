//! The results of a campaign as JUnit XML, for build servers.

use std::path::Path;

use sesame_analysis::confirmed::ConfirmedTest;
use sesame_present::markup::Markup;
use sesame_present::number;
use sesame_record::{RecordError, Repository, Verdict};

use crate::facts::causes::CauseSummary;
use crate::facts::disturbances::disturbances_text;
use crate::facts::summary::{ExpectationSummary, Failure, NotFinite, RequirementSummary, Summary, summary};
use crate::file::write_aside;
use crate::sentences::headline;

/// Writes the JUnit file of a campaign's results.
pub fn write_junit(repository: &Repository, path: &Path) -> Result<(), RecordError> {
    write_aside(path, &junit(&summary(repository)?)).map_err(|e| RecordError::io("write the JUnit file", path, e))
}

/// A summary as a JUnit test suite.
///
/// Each cause of a violated requirement is a test case that fails. Each other requirement is a test case: it fails if a
/// test violates it, and is skipped with a reason if none does but some are inconclusive. Each expectation of a
/// regression test is a test case: it fails if it is violated, and is an error if it is inconclusive. Each crash and
/// each timeout is an error, and so is each test in which a metric read a number that was not finite. Tests that were
/// run again count with the verdicts of their fresh runs: a finding of the first run that no fresh run shows is named,
/// but fails nothing.
pub fn junit(summary: &Summary) -> String {
    let class = format!("{}.{}", summary.space, summary.campaign);
    let mut cases = Vec::new();
    for requirement in &summary.requirements {
        let causes = summary.causes.iter().flat_map(|found| &found.causes);
        let causes: Vec<&CauseSummary> =
            causes.filter(|cause| cause.requirement == requirement.requirement && requirement.violated > 0).collect();
        if causes.is_empty() {
            cases.push(requirement_case(&class, requirement, &summary.confirmed));
        }
        cases.extend(causes.into_iter().map(|cause| cause_case(&class, requirement, cause)));
    }
    cases.extend(summary.expectations.iter().map(|expectation| expectation_case(&class, expectation)));
    cases.extend(summary.failures.iter().map(|failure| failure_case(&class, failure)));
    cases.extend(summary.not_finite.iter().map(|found| not_finite_case(&class, found)));
    let count = |tag: &str| {
        let of_this_kind = |case: &&Case| case.result.as_ref().is_some_and(|result| result.tag == tag);
        cases.iter().filter(of_this_kind).count().to_string()
    };
    let (tests, failures, errors, skipped) =
        (cases.len().to_string(), count("failure"), count("error"), count("skipped"));
    let mut xml = Markup::default();
    let totals = [("tests", tests.as_str()), ("failures", &failures), ("errors", &errors), ("skipped", &skipped)];
    xml.open("testsuites", &totals);
    xml.line();
    let mut attributes = vec![("name", class.as_str())];
    attributes.extend(totals);
    xml.open("testsuite", &attributes);
    xml.line();
    xml.open("properties", &[]);
    xml.leaf("property", &[("name", "seed"), ("value", &summary.seed.to_string())]);
    xml.close();
    xml.line();
    for case in &cases {
        xml.open("testcase", &[("classname", &case.class), ("name", &case.name)]);
        if let Some(Outcome { tag, kind, message, text }) = &case.result {
            let mut attributes = Vec::new();
            if !message.is_empty() {
                attributes.push(("message", message.as_str()));
            }
            if let Some(kind) = kind {
                attributes.push(("type", kind));
            }
            xml.element(tag, &attributes, text);
        }
        xml.close();
        xml.line();
    }
    xml.element("system-out", &[], &headline(summary));
    xml.line();
    if !summary.warnings.is_empty() {
        xml.element("system-err", &[], &summary.warnings.join("\n"));
        xml.line();
    }
    xml.close();
    xml.line();
    xml.close();
    format!("<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n{}\n", xml.finish())
}

struct Case {
    class: String,
    name: String,
    /// `None` for a case that passed without output.
    result: Option<Outcome>,
}

/// The result of a case that did not pass, or the output of one that passed.
struct Outcome {
    tag: &'static str,
    kind: Option<&'static str>,
    message: String,
    text: String,
}

/// A cause, as a case that fails. Tests that were run again have the verdicts of their fresh runs, so a violation that
/// no fresh run shows does not count.
fn cause_case(class: &str, requirement: &RequirementSummary, cause: &CauseSummary) -> Case {
    let CauseSummary { test, metric, value, bound, violating, held, acting, .. } = cause;
    let again =
        cause.again.as_ref().map_or(String::new(), |again| format!("; in fresh runs: {test} {}", again.words()));
    let message = format!(
        "violated by {violating} of {} with {}; smallest is {test}: {value}, required is {metric} {bound}{again}",
        number::plural(*held, "test", "tests"),
        cause.name()
    );
    Case {
        class: format!("{class}.requirements"),
        name: format!("{}: {} ({})", requirement.requirement, requirement.text, cause.name()),
        result: Some(Outcome { tag: "failure", kind: Some("cause"), message, text: disturbances_text(acting) }),
    }
}

fn requirement_case(class: &str, requirement: &RequirementSummary, confirmed: &[ConfirmedTest]) -> Case {
    let RequirementSummary { requirement: name, text, metric, bound, satisfied, violated, inconclusive, worst, .. } =
        requirement;
    let counts = format!("{violated} violated, {satisfied} satisfied, {inconclusive} inconclusive");
    let again: Vec<String> = confirmed
        .iter()
        .filter_map(|test| {
            let finding = test.findings.iter().find(|finding| finding.finding == *name)?;
            Some(format!("{} {}", test.test, finding.words()))
        })
        .collect();
    let again = if again.is_empty() { String::new() } else { format!("; in fresh runs: {}", again.join("; ")) };
    let result = if *violated > 0 {
        let tests = number::plural(*violated, "test", "tests");
        let worst = worst.as_ref().map_or(String::new(), |worst| format!("; worst is {}: {}", worst.test, worst.text));
        let message = format!("violated by {tests}{worst}, required is {metric} {bound}{again}");
        Some(Outcome { tag: "failure", kind: Some("requirement"), message, text: counts })
    } else if *satisfied == 0 {
        let message = format!("all tests are inconclusive{again}");
        Some(Outcome { tag: "skipped", kind: None, message, text: counts })
    } else if *inconclusive > 0 {
        let message = format!(
            "{inconclusive} of {} tests are inconclusive, the others satisfy it{again}",
            inconclusive + satisfied
        );
        Some(Outcome { tag: "skipped", kind: None, message, text: counts })
    } else if again.is_empty() {
        None
    } else {
        // The case passes; findings of the first run are still named.
        Some(Outcome { tag: "system-out", kind: None, message: String::new(), text: format!("{counts}{again}") })
    };
    Case { class: format!("{class}.requirements"), name: format!("{name}: {text}"), result }
}

fn expectation_case(class: &str, expectation: &ExpectationSummary) -> Case {
    let ExpectationSummary { test, known_test, metric, bound, value, verdict } = expectation;
    let value = value.map_or("no value".to_owned(), number::exact);
    let message = format!("{metric} is {value}, expected is {bound}");
    let text = format!("in {test}");
    let result = match verdict {
        Verdict::Satisfied => None,
        Verdict::Violated => Some(Outcome { tag: "failure", kind: Some("expectation"), message, text }),
        Verdict::Inconclusive => {
            let message = format!("{message}; the run is inconclusive");
            Some(Outcome { tag: "error", kind: Some("inconclusive"), message, text })
        }
    };
    Case { class: format!("{class}.{known_test}"), name: format!("{metric} {bound}"), result }
}

fn failure_case(class: &str, failure: &Failure) -> Case {
    let Failure { test, outcome, at, detail, again } = failure;
    let again = again.as_ref().map_or(String::new(), |again| format!("; in fresh runs: {}", again.words()));
    let message = format!("{outcome} at {} s{again}", number::fixed(*at, 2));
    let (tag, kind) = match outcome.as_str() {
        _ if !failure.stands() => ("skipped", None),
        "timeout" => ("error", Some("timeout")),
        "launch_failed" => ("error", Some("launch_failed")),
        "disconnect" => ("error", Some("disconnect")),
        "wrong_clock" => ("error", Some("wrong_clock")),
        _ => ("error", Some("crash")),
    };
    Case {
        class: format!("{class}.runs"),
        name: format!("{test} runs to its end"),
        result: Some(Outcome { tag, kind, message, text: detail.clone() }),
    }
}

fn not_finite_case(class: &str, found: &NotFinite) -> Case {
    let NotFinite { test, at, metrics } = found;
    let message = format!("a number that is not finite at {} s", number::fixed(*at, 2));
    let text = format!("read by {}", metrics.join(", "));
    Case {
        class: format!("{class}.runs"),
        name: format!("{test} has finite numbers only"),
        result: Some(Outcome { tag: "error", kind: Some("not_finite"), message, text }),
    }
}

#[cfg(test)]
mod tests {
    use sesame_record::sample;

    use super::*;

    fn sample_summary() -> Summary {
        let folder = tempfile::tempdir().unwrap();
        let mut plan = sample::plan();
        let expect = |metric, bound| sesame_plan::Expectation { metric: sesame_plan::MetricId(metric), bound };
        plan.tests[0].expectations = vec![
            expect(0, sesame_plan::Bound::Within { low: 1.0, high: 40.0 }),
            expect(3, sesame_plan::Bound::AtMost { value: 12.5 }),
        ];
        summary(&sample::campaign(folder.path(), &plan, 40)).unwrap()
    }

    fn parsed(xml: &str) -> roxmltree::Document<'_> {
        roxmltree::Document::parse(xml).unwrap()
    }

    #[test]
    fn a_build_server_sees_requirements_expectations_and_crashes() {
        insta::assert_snapshot!(junit(&sample_summary()));
    }

    #[test]
    fn the_counts_are_those_of_the_cases() {
        let xml = junit(&sample_summary());
        let document = parsed(&xml);
        let count = |tag: &str| document.descendants().filter(|node| node.has_tag_name(tag)).count().to_string();
        for suite in
            document.descendants().filter(|node| node.has_tag_name("testsuite") || node.has_tag_name("testsuites"))
        {
            for (attribute, tag) in
                [("tests", "testcase"), ("failures", "failure"), ("errors", "error"), ("skipped", "skipped")]
            {
                assert_eq!(suite.attribute(attribute), Some(count(tag).as_str()), "{attribute}");
            }
        }
    }

    #[test]
    fn what_is_inconclusive_does_not_pass() {
        let mut summary = sample_summary();
        summary.requirements.iter_mut().for_each(|requirement| {
            (requirement.satisfied, requirement.violated, requirement.worst) = (0, 0, None);
        });
        summary.expectations.iter_mut().for_each(|expectation| expectation.verdict = Verdict::Inconclusive);
        summary.failures.clear();
        let xml = junit(&summary);
        let document = parsed(&xml);
        let cases = document.descendants().filter(|node| node.has_tag_name("testcase"));
        let results: Vec<&str> = cases.map(|case| case.first_element_child().unwrap().tag_name().name()).collect();
        assert_eq!(results, ["skipped", "skipped", "skipped", "skipped", "error", "error"]);
    }

    #[test]
    fn a_requirement_about_which_some_tests_are_inconclusive_is_skipped_with_the_reason() {
        let mut summary = sample_summary();
        summary.requirements.truncate(1);
        (summary.requirements[0].violated, summary.requirements[0].satisfied, summary.requirements[0].inconclusive) =
            (0, 30, 2);
        let xml = junit(&summary);
        let document = parsed(&xml);
        let skipped = document.descendants().find(|node| node.has_tag_name("skipped")).unwrap();
        assert_eq!(skipped.attribute("message"), Some("2 of 32 tests are inconclusive, the others satisfy it"));
    }

    #[test]
    fn hostile_words_stay_words() {
        let hostile = "<b a='\"'>]]>& \u{1b}\u{0}\u{FFFE}\u{202E}\r\n--><!--";
        let mut summary = sample_summary();
        for text in [&mut summary.space, &mut summary.campaign, &mut summary.failures[0].detail] {
            *text = hostile.to_owned();
        }
        summary.requirements[0].text = hostile.to_owned();
        summary.expectations[0].known_test = hostile.to_owned();
        summary.warnings.push(hostile.to_owned());
        let xml = junit(&summary);
        let document = parsed(&xml);
        let tame = "<b a='\"'>]]>& \u{FFFD}\u{FFFD}\u{FFFD}\u{FFFD}\u{FFFD}\n--><!--";
        let error = document.descendants().find(|node| node.has_tag_name("error")).unwrap();
        assert_eq!(error.text(), Some(tame));
        let known = [
            "testsuites",
            "testsuite",
            "properties",
            "property",
            "testcase",
            "failure",
            "error",
            "skipped",
            "system-out",
            "system-err",
        ];
        assert!(
            document
                .descendants()
                .filter(roxmltree::Node::is_element)
                .all(|node| known.contains(&node.tag_name().name()))
        );
    }
}
