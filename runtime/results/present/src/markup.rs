//! A writer of HTML and SVG that escapes by construction.
//!
//! Names of elements and attributes are the program's own (`'static`), everything else goes through one escape. What
//! comes out is well-formed as XML too, so that any XML parser can check it.

use std::fmt::Write as _;

use serde_json::Value;
use sesame_base::visible::{is_hidden, visible_lines};

/// Markup in the making.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct Markup {
    text: String,
    open: Vec<&'static str>,
    headings: Vec<Heading>,
}

/// The heading of a section, to which a table of contents leads.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Heading {
    /// The id of its element.
    pub id: String,
    /// Its words.
    pub title: String,
}

/// Attributes of an element.
pub type Attributes<'a> = &'a [(&'static str, &'a str)];

impl Markup {
    /// Opens an element; [`Markup::close`] closes it.
    pub fn open(&mut self, tag: &'static str, attributes: Attributes<'_>) {
        self.tag(tag, attributes);
        self.text.push('>');
        self.open.push(tag);
    }

    /// Closes the innermost open element.
    pub fn close(&mut self) {
        let tag = self.open.pop().expect("every `close` has its `open`");
        self.text.push_str("</");
        self.text.push_str(tag);
        self.text.push('>');
        if matches!(tag, "tr" | "div" | "section" | "figure" | "table" | "svg" | "p" | "h1" | "h2" | "h3" | "details") {
            self.text.push('\n');
        }
    }

    /// An element without content.
    pub fn leaf(&mut self, tag: &'static str, attributes: Attributes<'_>) {
        self.tag(tag, attributes);
        self.text.push_str("/>");
    }

    /// An element with nothing but text in it.
    pub fn element(&mut self, tag: &'static str, attributes: Attributes<'_>, text: &str) {
        self.open(tag, attributes);
        self.text(text);
        self.close();
    }

    /// The heading of a section, under an id that is its own.
    pub fn heading(&mut self, title: &str) {
        let word = |c: char| if c.is_ascii_alphanumeric() { c.to_ascii_lowercase() } else { '-' };
        let id = format!("section-{}-{}", self.headings.len() + 1, title.chars().map(word).collect::<String>());
        self.element("h2", &[("id", &id)], title);
        self.headings.push(Heading { id, title: title.to_owned() });
    }

    /// The headings of sections so far, in order.
    pub fn headings(&self) -> &[Heading] {
        &self.headings
    }

    /// Text.
    pub fn text(&mut self, text: &str) {
        escape(text, &mut self.text);
    }

    /// Words in which backticks mark what is code.
    pub fn prose(&mut self, text: &str) {
        let parts: Vec<&str> = text.split('`').collect();
        // An odd backtick is one that means itself.
        let pairs = (parts.len() - 1) / 2;
        for (at, part) in parts.iter().enumerate() {
            match at {
                at if at > 2 * pairs => self.text(&format!("`{part}")),
                at if at % 2 == 1 => self.element("code", &[], part),
                _ => self.text(part),
            }
        }
    }

    /// Data for the page's script. A document in HTML and one in XML read it alike, since it has none of the characters
    /// that end a script or that only one of them decodes.
    pub fn json(&mut self, id: &str, data: &Value) {
        self.open("script", &[("type", "application/json"), ("id", id)]);
        for c in shown(data).to_string().chars() {
            match c {
                '<' | '>' | '&' => {
                    let _ = write!(self.text, "\\u{:04x}", u32::from(c));
                }
                c => self.text.push(c),
            }
        }
        self.close();
    }

    /// Appends other markup, in which every element must be closed. Only one of the two may have headings of sections,
    /// so that their ids differ.
    pub fn append(&mut self, mut other: Markup) {
        assert!(self.headings.is_empty() || other.headings.is_empty(), "ids of headings would repeat");
        self.headings.append(&mut other.headings);
        self.text.push_str(&other.finish());
    }

    /// A line end, where markup is to be read as a file.
    pub fn line(&mut self) {
        self.text.push('\n');
    }

    /// The whole; every element must be closed.
    pub fn finish(self) -> String {
        assert!(self.open.is_empty(), "elements left open: {:?}", self.open);
        self.text
    }

    fn tag(&mut self, tag: &'static str, attributes: Attributes<'_>) {
        self.text.push('<');
        self.text.push_str(tag);
        for (name, value) in attributes {
            self.text.push(' ');
            self.text.push_str(name);
            self.text.push_str("=\"");
            escape(value, &mut self.text);
            self.text.push('"');
        }
    }
}

/// Data whose texts have no characters that must not be shown: the script shows them as they are.
fn shown(data: &Value) -> Value {
    match data {
        Value::String(text) => Value::from(visible_lines(text)),
        Value::Array(items) => items.iter().map(shown).collect(),
        Value::Object(fields) => {
            fields.iter().map(|(name, value)| (visible_lines(name).into_owned(), shown(value))).collect()
        }
        other => other.clone(),
    }
}

/// Appends text so that it is nothing but text, inside and outside of attributes. Characters that must not be shown are
/// replaced.
fn escape(text: &str, into: &mut String) {
    for c in text.chars() {
        match c {
            '&' => into.push_str("&amp;"),
            '<' => into.push_str("&lt;"),
            '>' => into.push_str("&gt;"),
            '"' => into.push_str("&quot;"),
            '\'' => into.push_str("&#39;"),
            '\n' | '\t' => into.push(c),
            c if is_hidden(c) => into.push('\u{FFFD}'),
            c => into.push(c),
        }
    }
}

/// Fills a template's placeholders `{{name}}` with finished markup, in one pass: what is filled in is not looked at
/// again. The template is ours, so a placeholder without a value is a bug.
pub fn fill(template: &str, values: &[(&str, &str)]) -> String {
    let mut filled = String::with_capacity(template.len() + values.iter().map(|(_, value)| value.len()).sum::<usize>());
    let mut rest = template;
    while let Some((before, after)) = rest.split_once("{{") {
        let (name, after) = after.split_once("}}").expect("every placeholder of a template ends");
        let (_, value) =
            values.iter().find(|(key, _)| *key == name).expect("every placeholder of a template has a value");
        filled.push_str(before);
        filled.push_str(value);
        rest = after;
    }
    filled.push_str(rest);
    filled
}

/// A coordinate with at most two decimals.
pub fn coordinate(x: f64) -> String {
    let text = format!("{x:.2}");
    let text = text.trim_end_matches('0').trim_end_matches('.');
    if text == "-0" { "0".to_owned() } else { text.to_owned() }
}

/// A share of the whole width or height, in per cent.
pub fn percent(share: f64) -> String {
    format!("{}%", coordinate(share * 100.0))
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    proptest! {
        #[test]
        fn any_text_comes_back_as_it_was_and_nothing_else(text in any::<String>(), title in "[<>\"'&{}/a-z]{0,20}") {
            let mut markup = Markup::default();
            markup.open("p", &[("title", &title)]);
            markup.element("b", &[], &text);
            markup.close();
            let html = markup.finish();
            let document = roxmltree::Document::parse(&html).unwrap();
            let p = document.root_element();
            prop_assert_eq!(p.attribute("title"), Some(title.as_str()));
            let b = p.first_element_child().unwrap();
            prop_assert_eq!(b.text().unwrap_or_default(), visible_lines(&text));
            prop_assert_eq!(p.children().count(), 1);
        }
    }

    proptest! {
        #[test]
        fn any_data_comes_back_from_html_and_from_xml(text in any::<String>(), tag in "[<>/!&;a-z-]{0,12}") {
            let data = serde_json::json!({"text": text, "end": format!("</script>{tag}<!--<script>]]>"), tag: 1});
            let mut markup = Markup::default();
            markup.json("data", &data);
            let html = markup.finish();
            // HTML ends a script at the first end tag and decodes nothing.
            let (_, raw) = html.split_once('>').unwrap();
            let raw = raw.split_once("</").unwrap().0;
            prop_assert!(!raw.contains(['<', '>', '&']), "{}", raw);
            prop_assert_eq!(serde_json::from_str::<Value>(raw).unwrap(), shown(&data));
            let document = roxmltree::Document::parse(&html).unwrap();
            let read = document.root_element().text().unwrap();
            prop_assert_eq!(serde_json::from_str::<Value>(read).unwrap(), shown(&data));
        }

        #[test]
        fn prose_has_every_word_of_its_text(text in "[a`b ]{0,20}") {
            let mut markup = Markup::default();
            markup.open("p", &[]);
            markup.prose(&text);
            markup.close();
            let html = markup.finish();
            let document = roxmltree::Document::parse(&html).unwrap();
            let read: String = document.descendants().filter(roxmltree::Node::is_text).filter_map(|node| node.text()).collect();
            let read = read.trim_end_matches('\n').to_owned();
            let codes = document.descendants().filter(|node| node.has_tag_name("code")).count();
            let backticks = text.matches('`').count();
            prop_assert_eq!(codes, backticks / 2);
            prop_assert_eq!(read.replace('`', ""), text.replace('`', ""));
            prop_assert_eq!(read.matches('`').count(), backticks % 2);
        }
    }

    #[test]
    fn prose_marks_code() {
        let mut markup = Markup::default();
        markup.prose("`reserve` is <2`");
        assert_eq!(markup.finish(), "<code>reserve</code> is &lt;2`");
    }

    #[test]
    fn placeholders_in_values_stay_what_they_are() {
        assert_eq!(fill("<{{a}}|{{b}}>", &[("a", "{{b}}"), ("b", "2")]), "<{{b}}|2>");
    }

    #[test]
    fn coordinates_are_short() {
        assert_eq!(
            ["0", "12.5", "0.33", "0"],
            [0.0, 12.5, 1.0 / 3.0, -0.001].map(coordinate).each_ref().map(String::as_str)
        );
        assert_eq!(percent(0.125), "12.5%");
    }
}
