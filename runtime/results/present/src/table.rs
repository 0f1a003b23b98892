//! A table of typed cells, which is rendered as text for a terminal, as HTML, as CSV and as JSON.

mod data;
mod html;
mod text;

use sesame_base::test_number::TestNumber;

use crate::number;

pub use html::link_to_test;
pub use text::{TextOptions, wrap};

/// Rows of cells under named columns.
#[derive(Debug, Clone, PartialEq)]
pub struct Table {
    columns: Vec<Column>,
    rows: Vec<Vec<Cell>>,
}

/// A column: its title, and how its cells are laid out.
#[derive(Debug, Clone, PartialEq)]
pub struct Column {
    title: String,
    /// Follows each number for people.
    unit: Option<String>,
    style: Style,
}

/// How the cells of a column are laid out for people.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Style {
    /// As its cells are: numbers to the right, anything else to the left. The title is a name of the data.
    Data,
    /// The heading of each row.
    Heading,
    /// Words.
    Words,
    /// Words that stay on one line.
    Line,
    /// Words that may need several lines.
    Sentence,
    /// Numbers.
    Number,
    /// Numbers under the name of a metric, which is shown as it is.
    Metric,
    /// A picture, which only HTML has.
    Picture,
}

impl Column {
    fn new(title: &str, style: Style) -> Column {
        Column { title: title.to_owned(), unit: None, style }
    }

    /// The heading of each row.
    pub fn heading(title: &str) -> Column {
        Column::new(title, Style::Heading)
    }

    /// Words.
    pub fn words(title: &str) -> Column {
        Column::new(title, Style::Words)
    }

    /// Words that stay on one line.
    pub fn line(title: &str) -> Column {
        Column::new(title, Style::Line)
    }

    /// Words that may need several lines. In a terminal only the last column is wrapped.
    pub fn sentence(title: &str) -> Column {
        Column::new(title, Style::Sentence)
    }

    /// Numbers, or words that stand like numbers.
    pub fn number(title: &str) -> Column {
        Column::new(title, Style::Number)
    }

    /// Values of a metric in its unit.
    pub fn metric(name: &str, unit: Option<&str>) -> Column {
        Column { unit: unit.map(str::to_owned), ..Column::new(name, Style::Metric) }
    }

    /// A picture, which only HTML has.
    pub fn picture(title: &str) -> Column {
        Column::new(title, Style::Picture)
    }
}

/// A cell: a datum, and the tone in which it is shown.
#[derive(Debug, Clone, PartialEq)]
pub struct Cell {
    datum: Datum,
    tone: Tone,
}

/// How a cell stands out among others.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Tone {
    /// Not at all.
    Plain,
    /// It is a finding.
    Bad,
    /// It is of less interest.
    Quiet,
}

/// One value of a [`Table`].
#[derive(Debug, Clone, PartialEq)]
pub enum Datum {
    /// There is none.
    Missing,
    /// Words.
    Text(String),
    /// A whole number.
    Whole(i64),
    /// A number, finite. All numbers of a column are shown with the same decimals.
    Real(f64),
    /// A number, finite, in a column of numbers of other things: it is shown with decimals of its own.
    Lone(f64),
    /// A number, finite, that is shown with these decimals.
    Rounded(f64, usize),
    /// Yes or no.
    Truth(bool),
    /// A test; HTML links it where the page shows more of it.
    Test(TestNumber),
    /// Something about a test, in words that follow its name.
    OfTest(TestNumber, String),
    /// How many there are of each kind; HTML draws their shares as a bar. The words are also the classes of its parts.
    Shares(Vec<(usize, &'static str)>),
}

impl Datum {
    /// A number that may be missing.
    pub fn real(value: Option<f64>) -> Datum {
        value.filter(|value| value.is_finite()).map_or(Datum::Missing, Datum::Real)
    }

    /// A number that may be missing, in a column of numbers of other things.
    pub fn lone(value: Option<f64>) -> Datum {
        value.filter(|value| value.is_finite()).map_or(Datum::Missing, Datum::Lone)
    }

    /// How many of something.
    pub fn count(count: usize) -> Datum {
        i64::try_from(count).map_or(Datum::Missing, Datum::Whole)
    }

    /// The number of a test.
    pub fn test(number: u32) -> Datum {
        Datum::Test(TestNumber(number))
    }

    /// Words.
    pub fn text(text: impl Into<String>) -> Datum {
        Datum::Text(text.into())
    }

    /// Words that may be missing.
    pub fn maybe(text: Option<String>) -> Datum {
        text.map_or(Datum::Missing, Datum::Text)
    }

    /// A cell that is a finding, if so.
    pub fn bad_if(self, bad: bool) -> Cell {
        Cell { datum: self, tone: if bad { Tone::Bad } else { Tone::Plain } }
    }

    /// A cell of less interest than others.
    pub fn quiet(self) -> Cell {
        Cell { datum: self, tone: Tone::Quiet }
    }

    fn is_number(&self) -> bool {
        matches!(self, Datum::Whole(_) | Datum::Real(_) | Datum::Lone(_) | Datum::Rounded(..))
    }
}

impl From<Datum> for Cell {
    fn from(datum: Datum) -> Cell {
        datum.bad_if(false)
    }
}

impl Table {
    /// A table of data without rows yet: its columns are laid out as their cells are.
    pub fn new(columns: impl IntoIterator<Item = String>) -> Table {
        let column = |title| Column { title, unit: None, style: Style::Data };
        Table::with(columns.into_iter().map(column))
    }

    /// A table of data that others have computed: its columns are laid out as their cells are. Each row has a cell for
    /// each column.
    pub fn of(columns: impl IntoIterator<Item = String>, rows: impl IntoIterator<Item = Vec<Datum>>) -> Table {
        let mut table = Table::new(columns);
        rows.into_iter().for_each(|row| table.row(row));
        table
    }

    /// A table without rows yet.
    pub fn with(columns: impl IntoIterator<Item = Column>) -> Table {
        Table { columns: columns.into_iter().collect(), rows: Vec::new() }
    }

    /// Adds a row; a cell for each column.
    pub fn row<C: Into<Cell>>(&mut self, row: impl IntoIterator<Item = C>) {
        let row: Vec<Cell> = row.into_iter().map(Into::into).collect();
        assert_eq!(row.len(), self.columns.len(), "a row has a cell for each column");
        self.rows.push(row);
    }

    /// The titles of the columns.
    pub fn columns(&self) -> Vec<&str> {
        self.columns.iter().map(|column| column.title.as_str()).collect()
    }

    /// A copy of the data of each row.
    pub fn rows(&self) -> Vec<Vec<Datum>> {
        self.rows.iter().map(|row| row.iter().map(|cell| cell.datum.clone()).collect()).collect()
    }

    /// Whether there is no row.
    pub fn is_empty(&self) -> bool {
        self.rows.is_empty()
    }

    /// Leaves out the rows after so many; gives how many these are.
    pub fn truncate(&mut self, most: usize) -> usize {
        let more = self.rows.len().saturating_sub(most);
        self.rows.truncate(most);
        more
    }

    /// The cells of a column as people read them: numbers with the digits that tell them apart, and with their unit.
    fn words(&self, column: usize) -> Vec<String> {
        let Column { unit, .. } = &self.columns[column];
        let data = || self.rows.iter().map(|row| &row[column].datum);
        let numbers = data().filter_map(|datum| if let Datum::Real(value) = datum { Some(*value) } else { None });
        let decimals = number::decimals(numbers);
        let with_unit = |number: String| number::with_unit(number, unit.as_deref());
        let word = |datum: &Datum| match datum {
            Datum::Missing => "–".to_owned(),
            Datum::Text(text) => text.clone(),
            Datum::Whole(number) => number.to_string(),
            Datum::Real(value) => with_unit(number::fixed(*value, decimals)),
            Datum::Lone(value) => with_unit(number::number(*value)),
            Datum::Rounded(value, decimals) => with_unit(number::fixed(*value, *decimals)),
            Datum::Truth(truth) => if *truth { "yes" } else { "no" }.to_owned(),
            Datum::Test(test) => test.to_string(),
            Datum::OfTest(test, text) => format!("{test} {text}"),
            Datum::Shares(shares) => shares_in_words(shares),
        };
        data().map(word).collect()
    }

    /// Whether a column's cells stand to the right, as numbers do.
    fn is_right(&self, column: usize) -> bool {
        match self.columns[column].style {
            Style::Data => self.rows.iter().any(|row| row[column].datum.is_number()),
            Style::Number | Style::Metric => true,
            Style::Heading | Style::Words | Style::Line | Style::Sentence | Style::Picture => false,
        }
    }
}

/// Counts with their words, as in `3 violated, 12 satisfied`.
fn shares_in_words(shares: &[(usize, &str)]) -> String {
    shares.iter().map(|(count, word)| format!("{count} {word}")).collect::<Vec<_>>().join(", ")
}
