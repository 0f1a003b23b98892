//! The shells of pages: of a campaign's results, and of a study with a lab.

/// The page as plain text with placeholders `{{policy}}`, `{{title}}` and `{{body}}`, each filled in with
/// finished markup. Style and script are included, so the page needs no other file.
pub fn page() -> String {
    shell(STYLE, &SCRIPT)
}

/// The page of a study, with the same placeholders. `figures` is the style of its figures.
pub fn study(figures: &str) -> String {
    shell(&[STYLE, STUDY_STYLE, figures].concat(), &STUDY_SCRIPT)
}

/// The style of the page for its elements below an element of this class, in a page of others: as nested rules.
pub fn style_below(class: &str) -> String {
    let nested = STYLE.lines().map(|line| {
        let rule = line.trim_start();
        let blanks = &line[..line.len() - rule.len()];
        // What the page says of the whole document goes for that element.
        match [":root {", "html {", "body {"].iter().find_map(|whole| rule.strip_prefix(whole)) {
            Some(rest) => format!("{blanks}& {{{rest}\n"),
            None => format!("{line}\n"),
        }
    });
    format!(".{class} {{\n{}}}\n", nested.collect::<String>())
}

fn shell(style: &str, script: &[&str]) -> String {
    let script: String = script.concat();
    PAGE.replace("{{style}}", style)
        .replace("{{script}}", &format!("(function () {{\n\"use strict\";\n{script}}})();\n"))
}

const PAGE: &str = include_str!("../report/page.html");

const STYLE: &str = include_str!("../report/page.css");

const STUDY_STYLE: &str = include_str!("../report/study.css");

/// The parts of the script of a study's page.
const STUDY_SCRIPT: [&str; 3] = [
    include_str!("../report/script/marks.js"),
    include_str!("../report/script/save.js"),
    include_str!("../report/script/space.js"),
];

/// The parts of the script, in one scope: later ones use what earlier ones define.
const SCRIPT: [&str; 8] = [
    include_str!("../report/script/marks.js"),
    include_str!("../report/script/save.js"),
    include_str!("../report/script/tests.js"),
    include_str!("../report/script/table.js"),
    include_str!("../report/script/parallel.js"),
    include_str!("../report/script/fronts.js"),
    include_str!("../report/script/map.js"),
    include_str!("../report/script/timeline.js"),
];

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_style_of_figures_applies_below_their_class_only() {
        let style = style_below("figures");
        assert!(style.starts_with(".figures {\n& {\n") && style.ends_with("\n}\n"));
        assert_eq!(style.matches('{').count(), style.matches('}').count());
        // Nothing is lost, and nothing is meant for the whole document any more.
        assert_eq!(style.matches('{').count(), STYLE.matches('{').count() + 1);
        let whole = |line: &str| ["html", "body", ":root"].iter().any(|it| line.trim_start().starts_with(it));
        assert!(STYLE.lines().any(whole) && !style.lines().any(whole));
    }
}
