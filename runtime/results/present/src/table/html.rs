//! Tables as HTML.

use sesame_base::test_number::TestNumber;

use super::{Column, Datum, Style, Table, Tone, shares_in_words};
use crate::markup::{Markup, coordinate};

impl Table {
    /// As HTML. Tests that are in `linked` are links to the elements that have their names as ids.
    pub fn html(&self, markup: &mut Markup, linked: &[u32]) {
        self.rows_of(markup, linked, false);
    }

    /// The same; on a narrow screen each row becomes a block with a line for each of its cells, after the title of its
    /// column.
    pub fn html_stacking(&self, markup: &mut Markup, linked: &[u32]) {
        self.rows_of(markup, linked, true);
    }

    fn rows_of(&self, markup: &mut Markup, linked: &[u32], stacking: bool) {
        let words: Vec<Vec<String>> = (0..self.columns.len()).map(|column| self.words(column)).collect();
        markup.open("div", &[("class", "scroll")]);
        let titles: Vec<String> = (0..self.columns.len()).map(|column| self.shown_title(column)).collect();
        let stacks: &[(&str, &str)] = if stacking { &[("class", "stacks")] } else { &[] };
        markup.open("table", stacks);
        self.titles(markup, &titles);
        markup.open("tbody", &[]);
        for (at, row) in self.rows.iter().enumerate() {
            markup.open("tr", &[]);
            for (column, cell) in row.iter().enumerate() {
                let class = self.class(column, cell.tone);
                let mut attributes: Vec<(&str, &str)> = Vec::new();
                attributes.extend(stacking.then_some(("data-title", titles[column].as_str())));
                let is_heading = self.columns[column].style == Style::Heading;
                if is_heading {
                    attributes.push(("scope", "row"));
                } else if !class.is_empty() {
                    attributes.push(("class", &class));
                }
                markup.open(if is_heading { "th" } else { "td" }, &attributes);
                match &cell.datum {
                    Datum::Test(test) => link_to_test(markup, *test, linked),
                    Datum::OfTest(test, text) => {
                        link_to_test(markup, *test, linked);
                        markup.text(&format!(" {text}"));
                    }
                    Datum::Shares(shares) => bar(markup, shares),
                    _ => markup.text(&words[column][at]),
                }
                markup.close();
            }
            markup.close();
        }
        markup.close();
        markup.close();
        markup.close();
    }

    /// A title for each column; those of columns of numbers stand to the right, as the numbers do.
    fn titles(&self, markup: &mut Markup, titles: &[String]) {
        markup.open("thead", &[]);
        markup.open("tr", &[]);
        for (at, title) in titles.iter().enumerate() {
            let class = if self.is_right(at) { "number" } else { "words" };
            markup.element("th", &[("scope", "col"), ("class", class)], title);
        }
        markup.close();
        markup.close();
    }

    /// The title of a column. Names of metrics and of data stay as they are.
    fn shown_title(&self, column: usize) -> String {
        let Column { title, style, .. } = &self.columns[column];
        let mut title = title.clone();
        if let Some(first) = title.get_mut(..1).filter(|_| !matches!(style, Style::Metric | Style::Data)) {
            first.make_ascii_uppercase();
        }
        title
    }

    fn class(&self, column: usize, tone: Tone) -> String {
        let layout = match self.columns[column].style {
            Style::Line => "keep",
            Style::Sentence => "sentence",
            _ if self.is_right(column) => "number",
            Style::Data | Style::Heading | Style::Words | Style::Number | Style::Metric | Style::Picture => "",
        };
        let tone = match tone {
            Tone::Plain => "",
            Tone::Bad => "bad",
            Tone::Quiet => "quiet",
        };
        [layout, tone].into_iter().filter(|class| !class.is_empty()).collect::<Vec<_>>().join(" ")
    }
}

/// The name of a test, as a link if there is an element to lead to.
pub fn link_to_test(markup: &mut Markup, test: TestNumber, linked: &[u32]) {
    let name = test.to_string();
    if linked.contains(&test.0) {
        markup.element("a", &[("href", &format!("#{name}"))], &name);
    } else {
        markup.text(&name);
    }
}

/// The shares as parts of a bar.
fn bar(markup: &mut Markup, shares: &[(usize, &'static str)]) {
    let total = shares.iter().map(|(count, _)| count).sum::<usize>().max(1) as f64;
    let label = shares_in_words(shares);
    markup.open("svg", &[("class", "bar"), ("viewBox", "0 0 100 10"), ("role", "img"), ("aria-label", &label)]);
    let mut left = 0.0;
    for &(count, class) in shares {
        let width = 100.0 * count as f64 / total;
        let (x, width_text) = (coordinate(left), coordinate(width));
        markup.leaf("rect", &[("class", class), ("x", &x), ("y", "0"), ("width", &width_text), ("height", "10")]);
        left += width;
    }
    markup.close();
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_cells_of_a_stacking_table_know_the_titles_of_their_columns() {
        let mut table = Table::with([Column::heading("cause"), Column::words("smallest test")]);
        table.row([Datum::text("lag"), Datum::test(3)]);
        let mut markup = Markup::default();
        table.html_stacking(&mut markup, &[]);
        let html = markup.finish();
        let document = roxmltree::Document::parse(&html).unwrap();
        let titles: Vec<_> = document.descendants().filter_map(|node| node.attribute("data-title")).collect();
        assert_eq!(titles, ["Cause", "Smallest test"]);
        let class = |name| document.descendants().find(|node| node.has_tag_name("table")).unwrap().attribute(name);
        assert_eq!(class("class"), Some("stacks"));
    }

    #[test]
    fn a_test_is_a_link_where_the_page_shows_it_and_findings_stand_out() {
        let columns = [Column::heading("test"), Column::metric("cycle_time", Some("s")), Column::line("worst")];
        let mut table = Table::with(columns.into_iter().chain([Column::picture("tests")]));
        let shares = || Datum::Shares(vec![(1, "violated"), (3, "satisfied")]);
        table.row([
            Datum::test(1).into(),
            Datum::Real(68.25).bad_if(true),
            Datum::OfTest(TestNumber(2), "<5".to_owned()).into(),
            shares().into(),
        ]);
        table.row([Datum::test(2), Datum::Real(7.0), Datum::Missing, shares()]);
        let mut markup = Markup::default();
        table.html(&mut markup, &[2]);
        let html = markup.finish();
        let document = roxmltree::Document::parse(&html).unwrap();
        let texts = |name: &str| {
            let cells = document.descendants().filter(|node| node.has_tag_name(name));
            let text = |node: roxmltree::Node<'_, '_>| {
                let texts = node.descendants().filter(roxmltree::Node::is_text).filter_map(|text| text.text());
                texts.collect::<String>().trim().to_owned()
            };
            cells.map(text).collect::<Vec<String>>()
        };
        assert_eq!(texts("th"), ["Test", "cycle_time", "Worst", "Tests", "T1", "T2"]);
        assert_eq!(texts("td"), ["68.25 s", "T2 <5", "", "7.00 s", "–", ""]);
        let links: Vec<_> = document.descendants().filter_map(|node| node.attribute("href")).collect();
        assert_eq!(links, ["#T2", "#T2"]);
        let bad = document.descendants().find(|node| node.attribute("class") == Some("number bad")).unwrap();
        assert_eq!(bad.text(), Some("68.25 s"));
        let bar = document.descendants().find(|node| node.has_tag_name("svg")).unwrap();
        assert_eq!(bar.attribute("aria-label"), Some("1 violated, 3 satisfied"));
        let widths: Vec<_> = bar.children().map(|part| part.attribute("width").unwrap()).collect();
        assert_eq!(widths, ["25", "75"]);
    }
}
