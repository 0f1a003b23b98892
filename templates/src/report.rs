//! The shell of a campaign's results page.

/// The page as plain text with placeholders `{{policy}}`, `{{title}}` and `{{body}}`, each filled in with
/// finished markup. Style and script are included, so the page needs no other file.
pub fn page() -> String {
    let script: String = SCRIPT.concat();
    PAGE.replace("{{style}}", STYLE)
        .replace("{{script}}", &format!("(function () {{\n\"use strict\";\n{script}}})();\n"))
}

const PAGE: &str = include_str!("../report/page.html");

const STYLE: &str = include_str!("../report/page.css");

/// The parts of the script, in one scope: later ones use what earlier ones define.
const SCRIPT: [&str; 7] = [
    include_str!("../report/script/marks.js"),
    include_str!("../report/script/tests.js"),
    include_str!("../report/script/table.js"),
    include_str!("../report/script/parallel.js"),
    include_str!("../report/script/fronts.js"),
    include_str!("../report/script/map.js"),
    include_str!("../report/script/timeline.js"),
];
