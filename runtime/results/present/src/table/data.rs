//! Tables for programs: CSV and JSON.

use std::fmt::Write as _;

use serde_json::{Map, Value};
use sesame_base::visible::visible_json;

use super::{Datum, Table, shares_in_words};

impl Table {
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
        line(&mut self.columns.iter().map(|column| quoted(&column.title)));
        for row in &self.rows {
            line(&mut row.iter().map(|cell| match &cell.datum {
                Datum::Missing => String::new(),
                Datum::Text(text) => quoted(text),
                Datum::Whole(number) => number.to_string(),
                // The shortest text that reads back as this very number.
                Datum::Real(number) | Datum::Lone(number) | Datum::Rounded(number, _) => number.to_string(),
                Datum::Truth(truth) => truth.to_string(),
                Datum::Test(test) => test.to_string(),
                Datum::OfTest(test, text) => quoted(&format!("{test} {text}")),
                Datum::Shares(shares) => quoted(&shares_in_words(shares)),
            }));
        }
        text
    }

    /// As JSON: a list with an object for each row, numbers with all digits, `null` for what is missing.
    pub fn json(&self) -> String {
        let mut text = String::from("[");
        for (at, row) in self.rows.iter().enumerate() {
            let cells = self.columns.iter().zip(row);
            let object: Map<String, Value> =
                cells.map(|(column, cell)| (column.title.clone(), as_json(&cell.datum))).collect();
            let _ = write!(text, "{}\n  {}", if at > 0 { "," } else { "" }, Value::Object(object));
        }
        text.push_str(if self.is_empty() { "]\n" } else { "\n]\n" });
        visible_json(&text).into_owned()
    }
}

fn as_json(datum: &Datum) -> Value {
    match datum {
        Datum::Missing => Value::Null,
        Datum::Text(text) => Value::from(text.as_str()),
        Datum::Whole(number) => Value::from(*number),
        Datum::Real(number) | Datum::Lone(number) | Datum::Rounded(number, _) => Value::from(*number),
        Datum::Truth(truth) => Value::from(*truth),
        Datum::Test(test) => Value::from(test.to_string()),
        Datum::OfTest(test, text) => Value::from(format!("{test} {text}")),
        Datum::Shares(shares) => Value::from(shares_in_words(shares)),
    }
}

/// A field as CSV has it.
fn quoted(text: &str) -> String {
    if text.contains(['"', ',', '\n', '\r']) { format!("\"{}\"", text.replace('"', "\"\"")) } else { text.to_owned() }
}
