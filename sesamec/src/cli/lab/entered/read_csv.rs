//! A filled-in form as comma-separated values [RFC 4180], as spreadsheets save it.

use sesame_dsl::similar::most_similar;
use sesame_plan::CampaignPlan;

use super::mistakes::Mistakes;
use super::sheet::{At, Conversion, FIRST_COLUMNS, Given, HEAD, Row, Sheet, column, conversion, given, metric, quoted};

/// The cells of one row, which may span several lines if there are line breaks in quotes; at least one cell.
struct Cells(Vec<At<String>>);

/// What a column is about: a metric of the plan by its position, and how its numbers are read. `None` if that was told
/// to be a mistake.
type Column = Option<(usize, Conversion)>;

/// Reads the text of a file, and tells all that is wrong with it as a form; `None` if it is none at all.
pub(super) fn read(text: &str, plan: &CampaignPlan, mistakes: &mut Mistakes<'_>) -> Option<Sheet> {
    let mut sheet = Sheet::default();
    let mut rows = rows(text, &mut sheet, mistakes).into_iter();
    let Some(header) = rows.next() else {
        mistakes.say(0, || {
            format!("there is no header; begin with `{}` and the metrics, as `lab form` does", FIRST_COLUMNS.join(","))
        });
        return None;
    };
    let Some(columns) = columns(&header, plan, mistakes) else { return Some(sheet) };
    for cells in rows {
        sheet.rows.extend(row(cells, header.0.len(), &columns, plan, mistakes));
    }
    Some(sheet)
}

/// All rows but comments and empty ones. What comments say is put into the sheet.
fn rows(text: &str, sheet: &mut Sheet, mistakes: &mut Mistakes<'_>) -> Vec<Cells> {
    let mut rows = Vec::new();
    let mut at = 0;
    while at < text.len() {
        // A quote in a comment has no meaning, but a spreadsheet may put a comment with commas into quotes.
        if text[at..].starts_with('#') {
            let line = text[at..].split(['\n', '\r']).next().unwrap_or_default();
            // Spreadsheets fill up every line to the same number of cells.
            comment(at, line.trim_end_matches(','), sheet, mistakes);
            at += line.len() + 1;
            continue;
        }
        let (cells, end) = cells(text, at, mistakes);
        at = end;
        match cells.0.first() {
            Some(first) if first.value.starts_with('#') => comment(first.at, &first.value, sheet, mistakes),
            _ if cells.0.iter().all(|cell| cell.value.is_empty()) => {}
            _ => rows.push(cells),
        }
    }
    rows
}

/// The cells of the row that begins here, without blanks around them, and where the next row begins. Each cell is at
/// its first character, behind its quote.
fn cells(text: &str, begin: usize, mistakes: &mut Mistakes<'_>) -> (Cells, usize) {
    let bytes = text.as_bytes();
    let until = |from: usize, ends: &[u8]| {
        bytes[from..].iter().position(|byte| ends.contains(byte)).map_or(bytes.len(), |length| from + length)
    };
    let mut found = Vec::new();
    let mut at = begin;
    loop {
        while matches!(bytes.get(at), Some(b' ' | b'\t')) {
            at += 1;
        }
        let mut cell = String::new();
        let mut place = at;
        if bytes.get(at) == Some(&b'"') {
            place += 1;
            loop {
                let end = until(at + 1, b"\"");
                cell.push_str(&text[at + 1..end]);
                at = end + 1;
                match bytes.get(end..) {
                    // Two quotes are one.
                    Some([b'"', b'"', ..]) => cell.push('"'),
                    Some([b'"', ..]) => break,
                    _ => {
                        mistakes
                            .say(place, || "this quote is not closed; write `\"` at the end of the cell".to_owned());
                        at = text.len();
                        break;
                    }
                }
            }
        }
        let end = until(at, b",\r\n");
        cell.push_str(&text[at..end]);
        found.push(At { at: place, value: cell.trim().to_owned() });
        at = (end + 1).min(text.len());
        if bytes.get(end) != Some(&b',') {
            return (Cells(found), at);
        }
    }
}

/// Takes what a comment such as `# operator: Ada` says.
fn comment(at: usize, text: &str, sheet: &mut Sheet, mistakes: &mut Mistakes<'_>) {
    let Some((name, value)) = text.trim_start_matches(['#', ' ']).split_once(':') else { return };
    let (name, value) = (name.trim(), value.trim());
    if let Some(name) = HEAD.into_iter().find(|known| *known == name) {
        if value.is_empty() {
            return;
        }
        if sheet.head.insert(name, At { at, value: value.to_owned() }).is_some() {
            mistakes.say(at, || format!("`# {name}:` is there twice; remove one"));
        }
    } else if let Some(meant) = most_similar(name, HEAD) {
        mistakes.say(at, || format!("{} is unknown; did you mean `# {meant}:`?", quoted(&format!("# {name}:"))));
    }
}

/// The columns of the metrics; `None` if the header is none.
fn columns(Cells(cells): &Cells, plan: &CampaignPlan, mistakes: &mut Mistakes<'_>) -> Option<Vec<Column>> {
    let first = &cells[0];
    if cells.len() == 1 && (first.value.contains(';') || first.value.contains('\t')) {
        mistakes.say(first.at, || "the columns are not separated by commas; save the file with commas".to_owned());
        return None;
    }
    if !cells.iter().map(|cell| cell.value.as_str()).take(FIRST_COLUMNS.len()).eq(FIRST_COLUMNS) {
        mistakes.say(first.at, || {
            format!(
                "the first columns are not `{}`; begin with the header that `lab form` prints",
                FIRST_COLUMNS.join(",")
            )
        });
        return None;
    }
    let mut there = vec![false; plan.metrics.len()];
    let mut columns = Vec::new();
    for cell in &cells[FIRST_COLUMNS.len()..] {
        let (name, unit) = match cell.value.strip_suffix(']').and_then(|head| head.rsplit_once('[')) {
            Some((name, unit)) => (name.trim(), Some(unit.trim())),
            None => (cell.value.as_str(), None),
        };
        let found = metric(plan, name).and_then(|at| {
            let metric = &plan.metrics[at];
            if std::mem::replace(&mut there[at], true) {
                return Err(format!("`{name}` has two columns; remove one"));
            }
            Ok((at, conversion(metric, unit, &format!("`{}`", column(metric)))?))
        });
        columns.push(found.map_err(|wrong| mistakes.say(cell.at, || wrong)).ok());
    }
    for (metric, _) in plan.metrics.iter().zip(there).filter(|(_, there)| !there) {
        mistakes.say(first.at, || {
            format!(
                "there is no column for metric `{}`; add `{}`, with `unmeasured` where it was not measured",
                metric.name,
                column(metric)
            )
        });
    }
    Some(columns)
}

fn row(
    Cells(cells): Cells,
    width: usize,
    columns: &[Column],
    plan: &CampaignPlan,
    mistakes: &mut Mistakes<'_>,
) -> Option<Row> {
    let (count, begin) = (cells.len(), cells[0].at);
    if count != width {
        mistakes.say(begin, || {
            let remedy = if count > width {
                "write numbers with a point, such as `12.5`, and texts with commas in quotes"
            } else {
                "write one in each column"
            };
            format!("this row has {count} cells, and the header has {width}; {remedy}")
        });
    }
    let mut cells = cells.into_iter();
    let [test, run, outcome] = [cells.next()?, cells.next()?, cells.next()?];
    let values = (count == width).then(|| {
        let mut values = vec![At { at: begin, value: Given::Mistaken }; plan.metrics.len()];
        for (cell, column) in cells.zip(columns) {
            let Some((metric, conversion)) = column else { continue };
            let value = given(&cell.value, conversion).unwrap_or_else(|wrong| {
                mistakes.say(cell.at, || wrong);
                Given::Mistaken
            });
            values[*metric] = At { at: cell.at, value };
        }
        values
    });
    Some(Row { test, run, outcome, values })
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use proptest::prelude::*;

    use super::*;

    proptest! {
        #[test]
        fn cells_are_read_as_they_were_written_and_each_is_where_its_text_is(
            table in proptest::collection::vec(proptest::collection::vec("[a-c,\"\r\n 1]{0,4}", 1..4), 0..5),
            blanks in "[ \t]{0,2}",
            end in proptest::sample::select(vec!["\n", "\r\n", "\r"]),
        ) {
            let plain = |cell: &str| !cell.contains([',', '"', '\r', '\n']);
            let write = |cell: &String| {
                let cell = if plain(cell) { cell.clone() } else { format!("\"{}\"", cell.replace('"', "\"\"")) };
                format!("{blanks}{cell}{blanks}")
            };
            let text: String = table.iter().map(|row| row.iter().map(write).collect::<Vec<_>>().join(",") + end).collect();
            let mut mistakes = Mistakes::new(Path::new("x"), &text);
            let read = rows(&text, &mut Sheet::default(), &mut mistakes);
            prop_assert!(mistakes.are_none());
            let trimmed = |row: &Vec<String>| row.iter().map(|cell| cell.trim().to_owned()).collect::<Vec<_>>();
            let expected: Vec<Vec<String>> =
                table.iter().map(trimmed).filter(|row| row.iter().any(|cell| !cell.is_empty())).collect();
            let found: Vec<Vec<String>> =
                read.iter().map(|row| row.0.iter().map(|cell| cell.value.clone()).collect()).collect();
            prop_assert_eq!(found, expected);
            for cell in read.iter().flat_map(|row| &row.0) {
                let written = text[cell.at..].trim_start().replace("\"\"", "\"");
                prop_assert!(written.starts_with(&cell.value), "{:?} at {} of {:?}", cell.value, cell.at, text);
            }
        }
    }
}
