//! A table that prints for people and for programs.

use std::fmt::Write as _;

use serde_json::{Map, Value};

use crate::report::{TextOptions, text_table};

/// Rows of data under named columns.
#[derive(Debug, Clone, PartialEq)]
pub struct Dataset {
    columns: Vec<String>,
    rows: Vec<Vec<Datum>>,
}

/// One value of a [`Dataset`].
#[derive(Debug, Clone, PartialEq)]
pub enum Datum {
    /// There is none.
    Missing,
    /// Words.
    Text(String),
    /// A whole number.
    Whole(i64),
    /// A number, finite.
    Real(f64),
    /// A number, finite, in a column of numbers of other things.
    Lone(f64),
    /// Yes or no.
    Truth(bool),
}

impl Datum {
    /// A number that may be missing.
    pub fn real(value: Option<f64>) -> Datum {
        value.filter(|value| value.is_finite()).map_or(Datum::Missing, Datum::Real)
    }

    /// A number that may be missing, in a column of numbers of other things: people are shown digits that befit it alone.
    pub fn lone(value: Option<f64>) -> Datum {
        value.filter(|value| value.is_finite()).map_or(Datum::Missing, Datum::Lone)
    }

    /// How many of something.
    pub fn count(count: usize) -> Datum {
        i64::try_from(count).map_or(Datum::Missing, Datum::Whole)
    }

    fn as_json(&self) -> Value {
        match self {
            Datum::Missing => Value::Null,
            Datum::Text(text) => Value::from(text.as_str()),
            Datum::Whole(number) => Value::from(*number),
            Datum::Real(number) | Datum::Lone(number) => Value::from(*number),
            Datum::Truth(truth) => Value::from(*truth),
        }
    }
}

impl Dataset {
    /// A table without rows yet.
    pub fn new(columns: impl IntoIterator<Item = String>) -> Dataset {
        Dataset { columns: columns.into_iter().collect(), rows: Vec::new() }
    }

    /// Adds a row; a datum for each column.
    pub fn row(&mut self, row: impl IntoIterator<Item = Datum>) {
        let row: Vec<Datum> = row.into_iter().collect();
        assert_eq!(row.len(), self.columns.len(), "a row has a datum for each column");
        self.rows.push(row);
    }

    /// The names of the columns.
    pub fn columns(&self) -> &[String] {
        &self.columns
    }

    /// The rows.
    pub fn rows(&self) -> &[Vec<Datum>] {
        &self.rows
    }

    /// As a table for a terminal: numbers with the digits that tell them apart.
    pub fn text(&self, options: TextOptions) -> String {
        text_table(self, options)
    }

    /// As comma-separated values (RFC 4180, lines ending in a line feed): numbers with all digits, nothing for what is
    /// missing.
    pub fn csv(&self) -> String {
        let mut text = String::new();
        let mut line = |cells: &mut dyn Iterator<Item = String>| {
            for (at, cell) in cells.enumerate() {
                if at > 0 {
                    text.push(',');
                }
                text.push_str(&cell);
            }
            text.push('\n');
        };
        line(&mut self.columns.iter().map(|column| quoted(column)));
        for row in &self.rows {
            line(&mut row.iter().map(|datum| match datum {
                Datum::Missing => String::new(),
                Datum::Text(text) => quoted(text),
                Datum::Whole(number) => number.to_string(),
                // The shortest text that reads back as this very number.
                Datum::Real(number) | Datum::Lone(number) => number.to_string(),
                Datum::Truth(truth) => truth.to_string(),
            }));
        }
        text
    }

    /// As JSON: a list with an object for each row, numbers with all digits, `null` for what is missing.
    pub fn json(&self) -> String {
        let mut text = String::from("[");
        for (at, row) in self.rows.iter().enumerate() {
            let object: Map<String, Value> =
                self.columns.iter().zip(row).map(|(column, datum)| (column.clone(), datum.as_json())).collect();
            let _ = write!(text, "{}\n  {}", if at > 0 { "," } else { "" }, Value::Object(object));
        }
        text.push_str(if self.rows.is_empty() { "]\n" } else { "\n]\n" });
        text
    }
}

/// A field as CSV has it.
fn quoted(text: &str) -> String {
    if text.contains(['"', ',', '\n', '\r']) { format!("\"{}\"", text.replace('"', "\"\"")) } else { text.to_owned() }
}
