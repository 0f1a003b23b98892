//! Tables as text for a terminal.

use sesame_base::visible::visible;
use unicode_width::UnicodeWidthStr as _;

use super::{Column, Style, Table};

/// How text is laid out.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct TextOptions {
    /// Columns of the terminal; `None` for no limit, as for a file.
    pub width: Option<usize>,
    /// Whether headings and findings are coloured (ANSI sequences).
    pub colour: bool,
}

impl TextOptions {
    /// A heading, in bold where the text is coloured.
    pub fn heading(self, text: &str) -> String {
        if self.colour { format!("\x1b[1m{text}\x1b[0m") } else { text.to_owned() }
    }
}

/// Space before each line and between columns.
const GAP: &str = "  ";

/// A wrapped column is never narrower than this.
const NARROWEST: usize = 16;

/// A column as text: its cells, and whether they stand to the right.
struct Laid {
    title: String,
    cells: Vec<String>,
    right: bool,
    width: usize,
}

impl Table {
    /// As text for a terminal: each line ends in a line feed and in no space, and the last column is wrapped where the
    /// terminal is too narrow. Control characters are made visible, so that a message of a simulator cannot play with
    /// the terminal. Pictures are left out.
    pub fn text(&self, options: TextOptions) -> String {
        let shown = |(_, column): &(usize, &Column)| column.style != Style::Picture;
        let laid = self.columns.iter().enumerate().filter(shown).map(|(at, column)| {
            let cells: Vec<String> = self.words(at).iter().map(|cell| visible(cell)).collect();
            let width = cells.iter().map(|cell| cell.width()).fold(column.title.width(), usize::max);
            Laid { title: column.title.clone(), cells, right: self.is_right(at), width }
        });
        let mut columns: Vec<Laid> = laid.collect();
        if let (Some(limit), Some((last, before))) = (options.width, columns.split_last_mut()) {
            let used: usize = before.iter().map(|column| column.width + GAP.len()).sum::<usize>() + GAP.len();
            last.width = last.width.min(limit.saturating_sub(used).max(NARROWEST));
        }
        let mut text = String::new();
        let titles: Vec<&str> = columns.iter().map(|column| column.title.as_str()).collect();
        for line in lines(&columns, &titles) {
            text.push_str(&options.heading(&line));
            text.push('\n');
        }
        for row in 0..self.rows.len() {
            let cells: Vec<&str> = columns.iter().map(|column| column.cells[row].as_str()).collect();
            for line in lines(&columns, &cells) {
                text.push_str(&line);
                text.push('\n');
            }
        }
        text
    }
}

/// The lines of one row.
fn lines(columns: &[Laid], cells: &[&str]) -> Vec<String> {
    let last = cells.len().saturating_sub(1);
    let wrapped = cells.last().map_or_else(Vec::new, |cell| wrap(cell, columns[last].width));
    (0..wrapped.len().max(1))
        .map(|at| {
            let mut line = String::new();
            for (column, laid) in columns.iter().enumerate() {
                let cell = match (column == last, at) {
                    (true, _) => wrapped.get(at).map_or("", String::as_str),
                    (false, 0) => cells[column],
                    (false, _) => "",
                };
                let space = " ".repeat(laid.width.saturating_sub(cell.width()));
                line.push_str(GAP);
                if laid.right { line.extend([&space, cell]) } else { line.extend([cell, &space]) }
            }
            line.truncate(line.trim_end().len());
            line
        })
        .collect()
}

/// Words in lines no wider than `width`, but for words that are wider themselves.
pub fn wrap(text: &str, width: usize) -> Vec<String> {
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

    use super::super::Datum;
    use super::*;

    fn table() -> Table {
        let mut table =
            Table::with([Column::heading("test"), Column::number("hits"), Column::sentence("what it does")]);
        table.row([Datum::test(1), Datum::Whole(18), Datum::text("jitter_link0 ×2, lose_link0, cut_link1")]);
        table.row([Datum::test(158), Datum::Whole(7), Datum::text("é\x1b[31m\nend")]);
        table
    }

    #[test]
    fn columns_are_aligned_and_the_last_one_wraps() {
        let wide = table().text(TextOptions { width: None, colour: false });
        assert_eq!(
            wide,
            "  test  hits  what it does\n  T1      18  jitter_link0 ×2, lose_link0, cut_link1\n  T158     7  é�[31m end\n"
        );
        let narrow = table().text(TextOptions { width: Some(32), colour: false });
        assert_eq!(
            narrow,
            "  test  hits  what it does\n  T1      18  jitter_link0 ×2,\n              lose_link0,\n              cut_link1\n  T158     7  é�[31m end\n"
        );
    }

    #[test]
    fn colour_is_only_there_when_asked_for() {
        assert!(!table().text(TextOptions { width: None, colour: false }).contains('\x1b'));
        assert!(table().text(TextOptions { width: None, colour: true }).starts_with("\x1b[1m  test"));
    }

    proptest! {
        #[test]
        fn no_line_is_wider_than_the_terminal_unless_a_word_is(
            cells in prop::collection::vec(("[a-z]{0,6}", "([a-z]{1,9} ){0,12}"), 0..6), width in 30usize..100,
        ) {
            let mut table = Table::with([Column::words("a"), Column::words("b")]);
            for (a, b) in &cells {
                table.row([a, b].map(|text| Datum::text(text.as_str())));
            }
            for line in table.text(TextOptions { width: Some(width), colour: false }).lines() {
                prop_assert!(line.width() <= width, "{line}");
                prop_assert!(!line.ends_with(' '));
            }
        }
    }
}
