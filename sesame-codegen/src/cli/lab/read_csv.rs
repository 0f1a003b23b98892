//! A filled-in form as comma-separated values [RFC 4180], as spreadsheets save it.
//!
//! The `csv` crate reads the cells; where each begins is found in the text of its row.

use sesame_plan::CampaignPlan;

use super::mistakes::Mistakes;
use super::sheet::{At, Conversion, FIRST_COLUMNS, Given, RESULTS, Row, Sheet, column, conversion, given, metric};

/// A line of the file, or several if there are line breaks in quotes.
struct Line {
    cells: Vec<At<String>>,
    /// The offset behind it.
    end: usize,
}

/// What a column is about: a metric of the plan by its position, and how its numbers are read. `None` if that was told
/// to be a mistake.
type Column = Option<(usize, Conversion)>;

/// Reads the text of a file, and tells all that is wrong with it as a form.
pub(super) fn read(text: &str, plan: &CampaignPlan, mistakes: &mut Mistakes<'_>) -> Sheet {
    let mut sheet = Sheet { results: results(text), rows: Vec::new() };
    let mut lines = lines(text, mistakes).into_iter();
    let Some(header) = lines.next() else {
        mistakes.say(0, || {
            format!("there is no header; begin with `{}` and the metrics, as `lab form` does", FIRST_COLUMNS.join(","))
        });
        return sheet;
    };
    let Some(columns) = columns(&header, plan, mistakes) else { return sheet };
    for line in lines {
        sheet.rows.extend(row(line, header.cells.len(), &columns, plan, mistakes));
    }
    sheet
}

/// The digest in the comments before the header.
fn results(text: &str) -> Option<At<String>> {
    let mut at = 0;
    for line in text.split_inclusive('\n') {
        let content = line.trim();
        if !content.is_empty() && !content.starts_with('#') {
            return None;
        }
        if let Some(digest) = content.trim_start_matches(['#', ' ']).strip_prefix(RESULTS) {
            // Spreadsheets fill up every line to the same number of cells.
            return Some(At { at, it: digest.trim_end_matches([',', '"']).trim().to_owned() });
        }
        at += line.len();
    }
    None
}

/// All lines but comments and empty ones.
fn lines(text: &str, mistakes: &mut Mistakes<'_>) -> Vec<Line> {
    let mut reader = csv::ReaderBuilder::new()
        .has_headers(false)
        .flexible(true)
        .comment(Some(b'#'))
        .trim(csv::Trim::All)
        .from_reader(text.as_bytes());
    let mut record = csv::StringRecord::new();
    let mut lines = Vec::new();
    let mut begin = 0;
    while reader.read_record(&mut record).expect("text in memory is read, with rows of any length") {
        let end = usize::try_from(reader.position().byte()).expect("the text is in memory");
        let (starts, closed) = starts(&text[begin..end], begin);
        if !closed {
            mistakes.say(starts.last().copied().unwrap_or(begin), || {
                "this quote is not closed; write `\"` at the end of the cell".to_owned()
            });
        }
        begin = end;
        if record.iter().all(str::is_empty) {
            continue;
        }
        let cells = record.iter().zip(starts).map(|(cell, at)| At { at, it: cell.to_owned() }).collect();
        lines.push(Line { cells, end });
    }
    lines
}

/// Where each cell of a row begins, behind its quote and spaces, and whether the last quote is closed. Comments and
/// empty lines may come before the row.
fn starts(raw: &str, offset: usize) -> (Vec<usize>, bool) {
    let mut begin = 0;
    loop {
        let rest = &raw[begin..];
        if rest.starts_with(['\n', '\r']) {
            begin += 1;
        } else if rest.starts_with('#') {
            begin += rest.find('\n').map_or(rest.len(), |end| end + 1);
        } else {
            break;
        }
    }
    let mut found = vec![begin];
    // A quote opens a cell only at its very beginning; within quotes, two of them are one.
    let (mut quoted, mut cell) = (false, begin);
    for (at, byte) in raw.bytes().enumerate().skip(begin) {
        match byte {
            b'"' if quoted || at == cell => quoted = !quoted,
            b',' if !quoted => {
                cell = at + 1;
                found.push(cell);
            }
            // The second of two quotes opens the cell again.
            b'"' if at > cell && raw.as_bytes()[at - 1] == b'"' && raw.as_bytes()[cell] == b'"' => quoted = true,
            _ => {}
        }
    }
    let shown = |at: usize| offset + at + raw[at..].bytes().take_while(|byte| b" \t\"".contains(byte)).count();
    (found.into_iter().map(shown).collect(), !quoted)
}

/// The columns of the metrics; `None` if the header is none.
fn columns(header: &Line, plan: &CampaignPlan, mistakes: &mut Mistakes<'_>) -> Option<Vec<Column>> {
    let cells = &header.cells;
    let first = &cells[0];
    if cells.len() == 1 && (first.it.contains(';') || first.it.contains('\t')) {
        mistakes.say(first.at, || "the columns are not separated by commas; save the file with commas".to_owned());
        return None;
    }
    if !cells.iter().map(|cell| cell.it.as_str()).take(FIRST_COLUMNS.len()).eq(FIRST_COLUMNS) {
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
        let (name, unit) = match cell.it.strip_suffix(']').and_then(|head| head.rsplit_once('[')) {
            Some((name, unit)) => (name.trim(), Some(unit.trim())),
            None => (cell.it.as_str(), None),
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
        mistakes.say(header.end - 1, || {
            format!(
                "there is no column for metric `{}`; add `{}`, with `unmeasured` where it was not measured",
                metric.name,
                column(metric)
            )
        });
    }
    Some(columns)
}

fn row(line: Line, width: usize, columns: &[Column], plan: &CampaignPlan, mistakes: &mut Mistakes<'_>) -> Option<Row> {
    let whole = line.cells.len() == width;
    let begin = line.cells[0].at;
    if !whole {
        let count = line.cells.len();
        mistakes.say(begin, || {
            let remedy = if count > width {
                "write numbers with a point, such as `12.5`, and texts with commas in quotes"
            } else {
                "write one in each column"
            };
            format!("this row has {count} cells, and the header has {width}; {remedy}")
        });
    }
    let mut cells = line.cells.into_iter();
    let [test, run, outcome] = [cells.next()?, cells.next()?, cells.next()?];
    let values = whole.then(|| {
        let mut values = vec![At { at: begin, it: Given::Mistaken }; plan.metrics.len()];
        for (cell, column) in cells.zip(columns) {
            let Some((metric, conversion)) = column else { continue };
            let it = given(&cell.it, conversion).unwrap_or_else(|wrong| {
                mistakes.say(cell.at, || wrong);
                Given::Mistaken
            });
            values[*metric] = At { at: cell.at, it };
        }
        values
    });
    Some(Row { test, run, outcome, values })
}
