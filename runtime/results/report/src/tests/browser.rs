//! The page in Chromium: what its policy forbids, whether all text can be read, and what its script does.
//!
//! Scripts in the folder `browser` are added to a copy of the page. Each leaves its findings as JSON in the element
//! `findings`, which the browser prints with the rest of the document.

#![expect(clippy::disallowed_types, reason = "starts a browser")]

use std::process::Command;

use serde_json::Value;

use sesame_present::number;
use sesame_record::sample;

use super::monitors::monitored_page;
use super::page::full_page;
use super::pairs::plan_of;
use crate::{page, study};

/// Whether the browser prefers light or dark pages.
#[derive(Debug, Clone, Copy)]
enum Scheme {
    Light,
    Dark,
}

/// The browser's program; `None` if there is none, which it prints, and which is a failure where `CI=true`.
fn browser() -> Option<&'static str> {
    let runs = |name: &&str| Command::new(name).arg("--version").output().is_ok_and(|output| output.status.success());
    let found = ["chromium", "chromium-browser", "google-chrome"].into_iter().find(runs);
    if found.is_none() {
        assert!(std::env::var("CI").as_deref() != Ok("true"), "Chromium is not installed; `apt-get install chromium`");
        println!("skipped: there is no Chromium to open the page with");
    }
    found
}

/// What the browser shows of a page, and what it logs.
fn opened(browser: &str, html: &str, width: u32, scheme: Scheme) -> (String, String) {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("page.html");
    std::fs::write(&file, html).unwrap();
    let preferred = match scheme {
        Scheme::Dark => 0,
        Scheme::Light => 1,
    };
    let output = Command::new(browser)
        .args(["--headless", "--no-sandbox", "--disable-gpu", "--disable-quic", "--no-first-run"])
        .args(["--disable-background-networking", "--disable-component-update", "--disable-sync"])
        .args(["--enable-logging=stderr", "--virtual-time-budget=20000", "--dump-dom"])
        .arg(format!("--blink-settings=preferredColorScheme={preferred}"))
        .arg(format!("--window-size={width},900"))
        .arg(format!("--user-data-dir={}", folder.path().join("profile").display()))
        .arg(format!("file://{}", file.display()))
        .output()
        .unwrap();
    let text = |bytes: &[u8]| String::from_utf8_lossy(bytes).into_owned();
    (text(&output.stdout), text(&output.stderr))
}

/// What a script finds on a page. The page's policy would refuse the script, so this copy has none.
fn findings(browser: &str, html: &str, script: &str, width: u32, scheme: Scheme) -> Value {
    let policy = html.split_once("<meta http-equiv").unwrap().1.split_once("/>").unwrap().0;
    let without = html.replace(&format!("<meta http-equiv{policy}/>"), "");
    assert_ne!(without, html);
    let shared = include_str!("browser/shared.js");
    let added = format!("<script>{shared}{script}</script></body>");
    let (shown, log) = opened(browser, &without.replace("</body>", &added), width, scheme);
    let found = shown.split_once("<pre id=\"findings\">").and_then(|(_, after)| after.split_once("</pre>"));
    let (found, _) = found.unwrap_or_else(|| panic!("the script left no findings: {log}"));
    let found = found.replace("&lt;", "<").replace("&gt;", ">").replace("&amp;", "&");
    let found: Value = serde_json::from_str(&found).unwrap();
    assert_eq!(found["error"], Value::Null, "{log}");
    found
}

#[test]
fn a_browser_finds_nothing_on_the_page_that_its_policy_forbids() {
    let Some(browser) = browser() else { return };
    let refused = |log: &str| log.lines().filter(|line| line.contains("Content Security Policy")).count();
    let html = full_page();
    assert!(!html.contains("<select"));
    let (shown, log) = opened(browser, &html, 1280, Scheme::Light);
    assert!(shown.contains("<select"), "the script did its work: {shown}");
    assert_eq!(refused(&log), 0, "{log}");
    assert!(!log.contains("Uncaught"), "{log}");
    // It is looked for where it would be: what has no hash is refused, and does nothing.
    let foreign = "<script>document.title = 'taken'</script><p style=\"color: red\" onclick=\"1\">x</p>\
                   <img src=\"data:image/gif;base64,R0lGODlhAQABAAAAACw=\"/>";
    let main = "<main id=\"main\">";
    assert!(html.contains(main));
    let foreign = html.replace(main, &format!("{main}{foreign}"));
    let (shown, log) = opened(browser, &foreign, 1280, Scheme::Light);
    assert!(!shown.contains("<title>taken"));
    assert!(refused(&log) >= 3, "{log}");
}

#[test]
fn all_text_has_a_contrast_of_at_least_4_5_in_light_and_in_dark() {
    let Some(browser) = browser() else { return };
    let html = full_page();
    for scheme in [Scheme::Light, Scheme::Dark] {
        let found = findings(browser, &html, include_str!("browser/contrast.js"), 1280, scheme);
        assert!(found["measured"].as_u64().unwrap() > 500, "{found}");
        assert_eq!(found["dark"], matches!(scheme, Scheme::Dark), "the browser shows the page in {scheme:?}");
        let low = found["low"].as_array().unwrap();
        assert!(low.is_empty(), "{scheme:?}: {low:#?}");
    }
    // The measure sees what is hard to read.
    let pale = html.replace("--quiet: #5d6878", "--quiet: #9aa5b4");
    let found = findings(browser, &pale, include_str!("browser/contrast.js"), 1280, Scheme::Light);
    assert!(!found["low"].as_array().unwrap().is_empty());
}

#[test]
fn a_narrow_screen_shows_the_page_without_scrolling_sideways() {
    let Some(browser) = browser() else { return };
    let found = findings(browser, &full_page(), include_str!("browser/narrow.js"), 390, Scheme::Light);
    assert!(found["width"].as_u64().unwrap() <= 500, "{found}");
    assert_eq!(found["beyond"], Value::Array(Vec::new()), "what is wider than the screen");
    assert!(found["tallest"].as_f64().unwrap() < 110.0, "rows of the front are not tall: {found}");
}

#[test]
fn pairs_of_many_operations_can_be_read_on_any_screen() {
    let Some(browser) = browser() else { return };
    let folder = tempfile::tempdir().unwrap();
    let html = page(&sample::campaign(folder.path(), &plan_of(24), 30)).unwrap();
    let found = findings(browser, &html, include_str!("browser/narrow.js"), 390, Scheme::Light);
    assert_eq!(found["beyond"], Value::Array(Vec::new()), "what is wider than the screen");
    for scheme in [Scheme::Light, Scheme::Dark] {
        let found = findings(browser, &html, include_str!("browser/contrast.js"), 1280, scheme);
        let low = found["low"].as_array().unwrap();
        assert!(low.is_empty(), "{scheme:?}: {low:#?}");
    }
}

/// Runs a script that uses the page and says of each of its checks whether it holds.
fn assert_checks(browser: &str, script: &str, more_than: usize) {
    assert_checks_of(browser, &full_page(), script, 1280, more_than);
}

fn assert_checks_of(browser: &str, html: &str, script: &str, width: u32, more_than: usize) {
    let found = findings(browser, html, script, width, Scheme::Light);
    let checks = found["checks"].as_object().unwrap();
    for (what, seen) in checks {
        assert_eq!(seen, &Value::Bool(true), "{what}: {found:#}");
    }
    assert!(checks.len() > more_than, "{found:#}");
}

#[test]
fn the_table_of_tests_sorts_filters_and_selects_everywhere() {
    let Some(browser) = browser() else { return };
    assert_checks(browser, include_str!("browser/tests.js"), 15);
}

#[test]
fn timelines_have_a_cursor_a_zoom_and_a_second_test() {
    let Some(browser) = browser() else { return };
    assert_checks(browser, include_str!("browser/timelines.js"), 10);
}

#[test]
fn certificates_can_be_read_on_any_screen_and_keep_with_the_policy() {
    let Some(browser) = browser() else { return };
    let html = monitored_page();
    let (shown, log) = opened(browser, &html, 1280, Scheme::Light);
    assert!(
        shown.contains("<select") && !log.contains("Content Security Policy") && !log.contains("Uncaught"),
        "{log}"
    );
    for scheme in [Scheme::Light, Scheme::Dark] {
        let found = findings(browser, &html, include_str!("browser/contrast.js"), 1280, scheme);
        assert!(found["measured"].as_u64().unwrap() > 500, "{found}");
        let low = found["low"].as_array().unwrap();
        assert!(low.is_empty(), "{scheme:?}: {low:#?}");
    }
    let found = findings(browser, &html, include_str!("browser/narrow.js"), 390, Scheme::Light);
    assert_eq!(found["beyond"], Value::Array(Vec::new()), "what is wider than the screen");
}

#[test]
fn certificates_follow_the_cursor_and_the_zoom() {
    let Some(browser) = browser() else { return };
    assert_checks_of(browser, &monitored_page(), include_str!("browser/certificates.js"), 1280, 6);
}

#[test]
fn a_study_chooses_anew_at_each_weight_and_can_be_turned_on_wide_and_narrow_screens() {
    let Some(browser) = browser() else { return };
    let (html, _) = study::tests::page();
    for width in [1280, 390] {
        assert_checks_of(browser, &html, include_str!("browser/space.js"), width, 12);
    }
}

#[test]
fn a_study_can_be_read_on_any_screen_and_its_policy_forbids_nothing_on_it() {
    let Some(browser) = browser() else { return };
    let (html, _) = study::tests::page();
    let (shown, log) = opened(browser, &html, 1280, Scheme::Light);
    assert!(shown.contains("type=\"range\""), "the script did its work");
    assert!(!log.contains("Content Security Policy") && !log.contains("Uncaught"), "{log}");
    for scheme in [Scheme::Light, Scheme::Dark] {
        let found = findings(browser, &html, include_str!("browser/contrast.js"), 1280, scheme);
        assert!(found["measured"].as_u64().unwrap() > 200, "{found}");
        let low = found["low"].as_array().unwrap();
        assert!(low.is_empty(), "{scheme:?}: {low:#?}");
    }
    let found = findings(browser, &html, include_str!("browser/narrow.js"), 390, Scheme::Light);
    assert!(found["width"].as_u64().unwrap() <= 500, "{found}");
    assert_eq!(found["beyond"], Value::Array(Vec::new()), "what is wider than the screen");
}

#[test]
fn the_script_writes_numbers_as_the_rest_of_the_page_does() {
    let Some(browser) = browser() else { return };
    let columns: [&[f64]; 9] = [
        &[1.4e-4, 1.69e-4],
        &[20_000.0, 0.537, 0.36],
        &[49.238, 12.0],
        &[18.0, 0.0, -3.0],
        &[0.27, 0.3],
        &[-0.001, 49.2],
        &[123_456.7],
        &[1.5e12, -2.0],
        &[0.0],
    ];
    let marks = include_str!("../../../../../templates/report/script/marks.js");
    let functions = marks.split_once("function decimalsOf").unwrap().1.split_once("function withUnit").unwrap().0;
    let script = format!(
        "leave(() => {{ function decimalsOf{functions}\n return {}.map(column => column.map(value => \
         fixed(value, decimalsOf(column)))); }});",
        serde_json::to_string(&columns).unwrap()
    );
    let written = |column: &[f64]| -> Vec<String> {
        let decimals = number::decimals(column.iter().copied());
        column.iter().map(|&value| number::fixed(value, decimals)).collect()
    };
    let expected: Vec<Vec<String>> = columns.iter().map(|column| written(column)).collect();
    let found = findings(browser, &full_page(), &script, 1280, Scheme::Light);
    assert_eq!(found, serde_json::to_value(expected).unwrap());
}

#[test]
fn pictures_tables_tests_and_commands_can_be_taken_along() {
    let Some(browser) = browser() else { return };
    assert_checks(browser, include_str!("browser/save.js"), 11);
}
