//! Tables of text for a terminal.

use unicode_width::UnicodeWidthStr as _;

use crate::analysis::{Dataset, Datum};
use crate::report::number;

pub(crate) use sesame_base::visible::visible;

/// How text is laid out.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct TextOptions {
    /// Columns of the terminal; `None` for no limit, as for a file.
    pub width: Option<usize>,
    /// Whether headings and findings are coloured (ANSI sequences).
    pub colour: bool,
}

impl TextOptions {
    pub(crate) fn heading(self, text: &str) -> String {
        if self.colour { format!("\x1b[1m{text}\x1b[0m") } else { text.to_owned() }
    }
}

/// Where a column's cells stand.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Align {
    Left,
    Right,
}

/// A table whose last column is wrapped where the terminal is too narrow.
#[derive(Debug)]
pub(crate) struct Table {
    columns: Vec<(String, Align)>,
    rows: Vec<Vec<String>>,
}

/// Space before each line and between columns.
const GAP: &str = "  ";

/// A wrapped column is never narrower than this.
const NARROWEST: usize = 16;

impl Table {
    pub(crate) fn new(columns: impl IntoIterator<Item = (String, Align)>) -> Self {
        Table { columns: columns.into_iter().collect(), rows: Vec::new() }
    }

    /// Adds a row; a cell for each column. Control characters are made visible, so that a message of a simulator
    /// cannot play with the terminal.
    pub(crate) fn row(&mut self, cells: impl IntoIterator<Item = String>) {
        let cells: Vec<String> = cells.into_iter().map(|cell| visible(&cell)).collect();
        assert_eq!(cells.len(), self.columns.len(), "a row has a cell for each column");
        self.rows.push(cells);
    }

    /// The table, each line ending in a line feed and in no space.
    pub(crate) fn render(&self, options: TextOptions) -> String {
        let mut widths: Vec<usize> = self.columns.iter().map(|(title, _)| title.width()).collect();
        for row in &self.rows {
            for (width, cell) in widths.iter_mut().zip(row) {
                *width = (*width).max(cell.width());
            }
        }
        if let (Some(limit), Some((last, before))) = (options.width, widths.split_last_mut()) {
            let used: usize = before.iter().map(|width| width + GAP.len()).sum::<usize>() + GAP.len();
            *last = (*last).min(limit.saturating_sub(used).max(NARROWEST));
        }
        let titles: Vec<String> = self.columns.iter().map(|(title, _)| title.clone()).collect();
        let mut text = String::new();
        for line in self.lines(&titles, &widths) {
            text.push_str(&options.heading(&line));
            text.push('\n');
        }
        for line in self.rows.iter().flat_map(|row| self.lines(row, &widths)) {
            text.push_str(&line);
            text.push('\n');
        }
        text
    }

    fn lines(&self, cells: &[String], widths: &[usize]) -> Vec<String> {
        let last = cells.len().saturating_sub(1);
        let wrapped = cells.last().map_or_else(Vec::new, |cell| wrap(cell, widths[last]));
        (0..wrapped.len().max(1))
            .map(|at| {
                let mut line = String::new();
                for (column, (width, (_, align))) in widths.iter().zip(&self.columns).enumerate() {
                    let cell = match (column == last, at) {
                        (true, _) => wrapped.get(at).map_or("", String::as_str),
                        (false, 0) => &cells[column],
                        (false, _) => "",
                    };
                    let space = " ".repeat(width.saturating_sub(cell.width()));
                    line.push_str(GAP);
                    match align {
                        Align::Left => line.extend([cell, &space]),
                        Align::Right => line.extend([&space, cell]),
                    }
                }
                line.truncate(line.trim_end().len());
                line
            })
            .collect()
    }
}

/// A data set as a table for a terminal: the numbers of a column with the same decimals.
pub(crate) fn text_table(dataset: &Dataset, options: TextOptions) -> String {
    let column = |at: usize| dataset.rows().iter().map(move |row| &row[at]);
    let mut aligned = Vec::new();
    let mut decimals = Vec::new();
    for (at, title) in dataset.columns().iter().enumerate() {
        let numbers = || {
            column(at).filter_map(|datum| match datum {
                Datum::Real(value) => Some(*value),
                _ => None,
            })
        };
        let numeric = column(at).any(|datum| matches!(datum, Datum::Real(_) | Datum::Lone(_) | Datum::Whole(_)));
        aligned.push((title.clone(), if numeric { Align::Right } else { Align::Left }));
        decimals.push(number::decimals(numbers()));
    }
    let mut table = Table::new(aligned);
    for row in dataset.rows() {
        table.row(row.iter().zip(&decimals).map(|(datum, &decimals)| match datum {
            Datum::Missing => "–".to_owned(),
            Datum::Text(text) => text.clone(),
            Datum::Whole(number) => number.to_string(),
            Datum::Real(value) => number::fixed(*value, decimals),
            Datum::Lone(value) => number::number(*value),
            Datum::Truth(truth) => if *truth { "yes" } else { "no" }.to_owned(),
        }));
    }
    table.render(options)
}

/// Words in lines no wider than `width`, but for words that are wider themselves.
pub(crate) fn wrap(text: &str, width: usize) -> Vec<String> {
    let mut lines = vec![String::new()];
    for word in text.split(' ') {
        let line = lines.last_mut().expect("there is always a line");
        if line.is_empty() {
            line.push_str(word);
        } else if line.width() + 1 + word.width() <= width {
            line.push(' ');
            line.push_str(word);
        } else {
            lines.push(word.to_owned());
        }
    }
    lines
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    fn table() -> Table {
        let mut table = Table::new([
            ("test".to_owned(), Align::Left),
            ("hits".to_owned(), Align::Right),
            ("what it does".to_owned(), Align::Left),
        ]);
        table.row(["T1".to_owned(), "18".to_owned(), "jitter_link0 ×2, lose_link0, cut_link1".to_owned()]);
        table.row(["T158".to_owned(), "7".to_owned(), "é\x1b[31m\nend".to_owned()]);
        table
    }

    #[test]
    fn columns_are_aligned_and_the_last_one_wraps() {
        let wide = table().render(TextOptions { width: None, colour: false });
        assert_eq!(
            wide,
            "  test  hits  what it does\n  T1      18  jitter_link0 ×2, lose_link0, cut_link1\n  T158     7  é�[31m end\n"
        );
        let narrow = table().render(TextOptions { width: Some(32), colour: false });
        assert_eq!(
            narrow,
            "  test  hits  what it does\n  T1      18  jitter_link0 ×2,\n              lose_link0,\n              cut_link1\n  T158     7  é�[31m end\n"
        );
    }

    #[test]
    fn colour_is_only_there_when_asked_for() {
        assert!(!table().render(TextOptions { width: None, colour: false }).contains('\x1b'));
        assert!(table().render(TextOptions { width: None, colour: true }).starts_with("\x1b[1m  test"));
    }

    proptest! {
        #[test]
        fn no_line_is_wider_than_the_terminal_unless_a_word_is(
            cells in prop::collection::vec(("[a-z]{0,6}", "([a-z]{1,9} ){0,12}"), 0..6), width in 30usize..100,
        ) {
            let mut table = Table::new([("a".to_owned(), Align::Left), ("b".to_owned(), Align::Left)]);
            for (a, b) in &cells {
                table.row([a.clone(), b.clone()]);
            }
            for line in table.render(TextOptions { width: Some(width), colour: false }).lines() {
                prop_assert!(line.width() <= width, "{line}");
                prop_assert!(!line.ends_with(' '));
            }
        }
    }
}
