//! Columns: words that their author aligned in lines that follow each other.
//!
//! The blanks before a word tell whether it is in a column: two or more in any of the lines. So the author decides, and
//! what was aligned once stays aligned when a name grows. How far a column stays away from the longest of what is
//! before it is the author's too, within reason.

use super::lines::{Line, Placed};
use super::tokens::Kind;

/// What can be in a column, in the order in which it stands in a line. A word that comes in another order is in none,
/// so that one column never moves another that is left of it.
const COLUMNS: &[&str] = &[
    "on",
    "maximise",
    "minimise",
    "default",
    "initial",
    "rising",
    "falling",
    "accepts",
    "=",
    ":",
    "then",
    "{",
    "when",
    "every",
    "from",
    "until",
    "to",
    "for",
    "within",
    "priority",
    "inclusion",
    "untimed",
    "seed",
];

/// The farthest that a column stays away from what is before it.
const WIDEST_GAP: usize = 4;

/// Aligns columns, and comments behind lines that follow each other.
pub(super) fn align(lines: &mut [Line<'_>]) {
    let mut start = 0;
    while start < lines.len() {
        let end = group_end(lines, start);
        if end > start {
            let group = &mut lines[start..end];
            second_words(group);
            let mut first = 0;
            for at in 1..=group.len() {
                if at == group.len() || kind_of_line(group, at) != kind_of_line(group, first) {
                    columns(&mut group[first..at]);
                    first = at;
                }
            }
        }
        start = end.max(start + 1);
    }
    comments(lines);
}

/// One past the last line of the group that begins with a line; the same line when it begins none.
fn group_end(lines: &[Line<'_>], start: usize) -> usize {
    let indent = lines[start].indent;
    let mut end = start;
    for (at, line) in lines.iter().enumerate().skip(start) {
        let opens = line.tokens.last().is_some_and(|last| last.text == "{");
        let goes_on = at > start && goes_on(line) && line.indent > indent;
        let fits = goes_on || line.indent == indent && !self::goes_on(line);
        if !fits || opens || (line.after_empty && at > start) {
            break;
        }
        end = at + 1;
    }
    end
}

/// Whether it goes on with what the line before it began. Such a line has no columns, and takes none from others.
fn goes_on(line: &Line<'_>) -> bool {
    !line.begins && !line.only_comment
}

/// Lines are of one kind when they begin with the same word, or with names: names stand where no keyword is needed. A
/// comment is of the kind of the line it is above.
fn kind_of_line<'t>(group: &[Line<'t>], at: usize) -> Option<&'t str> {
    let line = group[at..].iter().find(|line| line.begins)?;
    let first = line.tokens.first()?.text;
    crate::syntax::is_keyword(first).then_some(first)
}

/// Clauses that follow each other, one per line: what stands behind their first words.
fn second_words(group: &mut [Line<'_>]) {
    let second = |line: &Line<'_>| {
        // A block of one line stands where other clauses have their content.
        let content = line.tokens.get(1)?.text != "{" || line.tokens.last()?.text == "}";
        (!goes_on(line) && line.tokens[1].gap == 1 && content).then_some(1)
    };
    align_at(group, &group.iter().map(second).collect::<Vec<_>>());
}

fn columns(group: &mut [Line<'_>]) {
    // Found before anything is moved: where columns are does not depend on which of them are aligned.
    let found: Vec<Vec<Option<usize>>> = group
        .iter()
        .map(|line| if goes_on(line) { vec![None; COLUMNS.len()] } else { positions(&line.tokens) })
        .collect();
    for column in 0..COLUMNS.len() {
        align_at(group, &found.iter().map(|positions| positions[column]).collect::<Vec<_>>());
    }
}

/// Where each column's word is in a line, outside of brackets and blocks.
fn positions(tokens: &[Placed<'_>]) -> Vec<Option<usize>> {
    // The second word is a column of its own.
    let mut from = 2;
    let mut depth = 0_usize;
    let depths: Vec<usize> = tokens
        .iter()
        .map(|token| {
            let outside = depth;
            match token.text {
                "{" | "[" | "(" => depth += 1,
                "}" | "]" | ")" => depth = depth.saturating_sub(1),
                _ => {}
            }
            outside
        })
        .collect();
    let fits = |at: &usize, word: &str| {
        let token = &tokens[*at];
        depths[*at] == 0 && token.gap == 1 && token.text == word && matches!(token.kind, Kind::Word | Kind::Sign)
    };
    let mut find = |word: &str| {
        let found = (from..tokens.len()).find(|at| fits(at, word))?;
        from = found + 1;
        Some(found)
    };
    COLUMNS.iter().map(|word| find(word)).collect()
}

/// Aligns these tokens of a group, if its author did so in any of its lines.
fn align_at(group: &mut [Line<'_>], positions: &[Option<usize>]) {
    let rows: Vec<(usize, usize)> =
        positions.iter().enumerate().filter_map(|(row, position)| Some((row, (*position)?))).collect();
    let blanks = || rows.iter().map(|&(row, at)| group[row].tokens[at].blanks);
    if blanks().all(|blanks| blanks < 2) {
        return;
    }
    // A single line is not a column, and needs no space for others.
    let gap = if rows.len() > 1 { blanks().min().unwrap_or(1).clamp(1, WIDEST_GAP) } else { 1 };
    let widths: Vec<usize> = rows.iter().map(|&(row, at)| width(&group[row].tokens[..at])).collect();
    let widest = widths.iter().copied().max().unwrap_or(0);
    for (&(row, at), width) in rows.iter().zip(widths) {
        group[row].tokens[at].gap = widest - width + gap;
    }
}

fn comments(lines: &mut [Line<'_>]) {
    for run in lines.chunk_by_mut(|line, next| line.comment.is_some() && next.comment.is_some() && !next.after_empty) {
        let end = |line: &Line<'_>| line.indent + width(&line.tokens);
        let widest = run.iter().map(end).max().unwrap_or(0);
        for line in run {
            let end = end(line);
            if let Some(comment) = &mut line.comment {
                comment.gap = widest - end + 2;
            }
        }
    }
}

fn width(tokens: &[Placed<'_>]) -> usize {
    tokens.iter().map(|token| token.gap + token.text.chars().count()).sum()
}
