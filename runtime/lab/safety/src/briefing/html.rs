//! Briefing sheets as one page in HTML that is printed on A4, each test on a sheet of its own. The page loads nothing
//! and runs nothing: everything that is not written here is escaped.

use sesame_base::visible::visible;

use super::{Briefing, sections};

/// How a page looks on the screen and on paper. Warnings have a border and not only a colour, as many print in grey.
const STYLE: &str = "\
@page { size: A4; margin: 18mm; }
body { font: 11pt/1.4 sans-serif; color: #000; background: #fff; max-width: 174mm; margin: 0 auto; padding: 1em; }
h1 { font-size: 18pt; margin: 0 0 .5em; overflow-wrap: anywhere; }
h2 { font-size: 12pt; margin: 1em 0 .2em; break-after: avoid; }
ul { margin: 0; padding-left: 1.4em; }
li, p { overflow-wrap: anywhere; break-inside: avoid; }
.warning { border: 2pt solid #a00; padding: .4em .6em; font-weight: bold; }
.empty { font-style: italic; }
.briefing + .briefing { break-before: page; }
@media print { body { max-width: none; padding: 0; } }
";

/// What a browser may do with a page: show it, with the style in it.
const POLICY: &str = "default-src 'none'; style-src 'unsafe-inline'; base-uri 'none'; form-action 'none'";

/// A whole page with these sheets.
pub fn page(title: &str, briefings: &[Briefing]) -> String {
    let mut page = format!(
        "<!DOCTYPE html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\"/>\n\
         <meta http-equiv=\"Content-Security-Policy\" content=\"{}\"/>\n<title>{}</title>\n<style>\n{STYLE}</style>\n\
         </head>\n<body>\n",
        escaped(POLICY),
        escaped(title)
    );
    for briefing in briefings {
        page.push_str(&section(briefing));
    }
    page.push_str("</body>\n</html>\n");
    page
}

/// One sheet as a `section` element, without a style of its own: for pages of others.
pub fn section(briefing: &Briefing) -> String {
    let mut sheet = String::from("<section class=\"briefing\">\n");
    element(&mut sheet, "h1", "", &briefing.title);
    for warning in &briefing.warnings {
        element(&mut sheet, "p", " class=\"warning\"", &format!("Warning: {warning}"));
    }
    for section in sections(briefing) {
        element(&mut sheet, "h2", "", section.title);
        if section.lines.is_empty() {
            element(&mut sheet, "p", " class=\"empty\"", section.empty);
            continue;
        }
        sheet.push_str("<ul>\n");
        for line in &section.lines {
            element(&mut sheet, "li", "", line);
        }
        sheet.push_str("</ul>\n");
    }
    sheet.push_str("</section>\n");
    sheet
}

/// Appends an element with nothing but text in it.
fn element(sheet: &mut String, tag: &'static str, attributes: &'static str, text: &str) {
    for part in ["<", tag, attributes, ">", &escaped(text), "</", tag, ">\n"] {
        sheet.push_str(part);
    }
}

/// Text that is nothing but text, inside and outside of attributes.
fn escaped(text: &str) -> String {
    let mut escaped = String::with_capacity(text.len());
    for c in visible(text).chars() {
        match c {
            '&' => escaped.push_str("&amp;"),
            '<' => escaped.push_str("&lt;"),
            '>' => escaped.push_str("&gt;"),
            '"' => escaped.push_str("&quot;"),
            '\'' => escaped.push_str("&#39;"),
            c => escaped.push(c),
        }
    }
    escaped
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;
    use crate::briefing::Person;
    use crate::briefing::tests::example;

    #[test]
    fn a_page_of_two_sheets() {
        let hostile = Briefing {
            title: "<script>alert('T0')</script>".to_owned(),
            warnings: vec!["a & b \"c\" \u{1b}[31m\u{202e}".to_owned()],
            ..Briefing::default()
        };
        insta::assert_snapshot!(page("Lab on Monday", &[example(), hostile]));
    }

    proptest! {
        #[test]
        fn any_text_is_text_and_comes_back(title in any::<String>(), role in "[<>\"'&;/!a-z-]{0,30}", stop in any::<String>()) {
            let briefing = Briefing {
                title: title.clone(),
                present: vec![Person { role: role.clone(), task: String::new() }],
                stop_when: vec![stop.clone()],
                ..Briefing::default()
            };
            let html = page(&title, &[briefing]);
            let document = roxmltree::Document::parse(html.trim_start_matches("<!DOCTYPE html>")).unwrap();
            let texts = |tag: &str| -> Vec<String> {
                let elements = document.descendants().filter(|node| node.has_tag_name(tag));
                elements.map(|node| node.text().unwrap_or_default().to_owned()).collect()
            };
            prop_assert_eq!(texts("h1"), [visible(&title)]);
            prop_assert_eq!(texts("title"), [visible(&title)]);
            prop_assert_eq!(texts("li"), [format!("{role}: "), visible(&stop)]);
            prop_assert_eq!(texts("script").len(), 0);
        }
    }
}
