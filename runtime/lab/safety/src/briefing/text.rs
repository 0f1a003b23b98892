//! A briefing sheet as plain text: no line is wider than 80 columns, as terminals count them.

use unicode_width::{UnicodeWidthChar as _, UnicodeWidthStr as _};

use sesame_base::visible::visible;

use super::{Briefing, sections};

/// The width of a sheet, in columns.
pub const COLUMNS: usize = 80;

/// The sheet as text, with a line end after each line.
pub fn text(briefing: &Briefing) -> String {
    let mut sheet = String::new();
    let title = visible(&briefing.title);
    wrapped(&mut sheet, "", "", &title);
    sheet.push_str(&"=".repeat(title.width().clamp(1, COLUMNS)));
    sheet.push('\n');
    if !briefing.warnings.is_empty() {
        sheet.push('\n');
    }
    for warning in &briefing.warnings {
        wrapped(&mut sheet, "WARNING: ", "         ", &visible(warning));
    }
    for section in sections(briefing) {
        sheet.push('\n');
        sheet.push_str(section.title);
        sheet.push('\n');
        if section.lines.is_empty() {
            wrapped(&mut sheet, "  ", "  ", section.empty);
        }
        for line in &section.lines {
            wrapped(&mut sheet, "  - ", "    ", &visible(line));
        }
    }
    sheet
}

/// Appends a paragraph: its first line after one indentation, and the others after another. A word that is wider than a
/// line is broken.
fn wrapped(sheet: &mut String, first: &str, then: &str, paragraph: &str) {
    let mut line = first.to_owned();
    let mut empty = true;
    let mut flush = |line: &mut String| {
        sheet.push_str(line.trim_end());
        sheet.push('\n');
        then.clone_into(line);
    };
    for word in paragraph.split_whitespace() {
        let space = usize::from(!empty);
        if !empty && line.width() + space + word.width() > COLUMNS {
            flush(&mut line);
            empty = true;
        }
        if !empty {
            line.push(' ');
        }
        for c in word.chars() {
            if line.width() + c.width().unwrap_or(0) > COLUMNS {
                flush(&mut line);
            }
            line.push(c);
        }
        empty = false;
    }
    flush(&mut line);
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;
    use crate::briefing::Person;
    use crate::briefing::tests::example;

    #[test]
    fn a_sheet_as_text() {
        insta::assert_snapshot!(text(&example()));
    }

    #[test]
    fn an_empty_sheet_says_what_is_missing() {
        insta::assert_snapshot!(text(&Briefing { title: "T0".to_owned(), ..Briefing::default() }));
    }

    proptest! {
        #[test]
        fn lines_fit_and_no_character_is_lost(
            title in any::<String>(), warning in "[a-zé漢 \u{1b}\u{202e}]{0,300}", task in any::<String>(),
        ) {
            let present = vec![Person { role: "pilot".to_owned(), task }];
            let briefing =
                Briefing { title, warnings: vec![warning.clone()], present, ..Briefing::default() };
            let sheet = text(&briefing);
            for line in sheet.lines() {
                prop_assert!(line.width() <= COLUMNS, "{line:?}");
                prop_assert!(!line.chars().any(sesame_base::visible::is_hidden), "{line:?}");
            }
            let solid = |text: &str| text.chars().filter(|c| !c.is_whitespace()).collect::<String>();
            prop_assert!(solid(&sheet).contains(&solid(&visible(&warning))));
        }
    }
}
