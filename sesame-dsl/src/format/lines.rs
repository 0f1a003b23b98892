//! Tokens → lines: where lines end, how far they are indented, and the blanks between tokens.

use super::tokens::{Begins, Kind, Token};

/// A line to be.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct Line<'t> {
    /// Whether an empty line comes before it.
    pub(super) after_empty: bool,
    /// Blanks before the first token.
    pub(super) indent: usize,
    pub(super) tokens: Vec<Placed<'t>>,
    /// Behind the tokens.
    pub(super) comment: Option<Placed<'t>>,
    /// Whether an item or a member begins with it.
    pub(super) begins: bool,
    /// Whether it is a comment and nothing else.
    pub(super) only_comment: bool,
}

/// A token in its line.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct Placed<'t> {
    pub(super) text: &'t str,
    pub(super) kind: Kind,
    /// Blanks before it; none before the first of its line.
    pub(super) gap: usize,
    /// Blanks before it as its author had them; none when it was on a line of its own.
    pub(super) blanks: usize,
}

/// Breaks tokens into lines.
pub(super) fn lines<'t>(tokens: &[Token<'t>]) -> Vec<Line<'t>> {
    let several = blocks_of_several_lines(tokens);
    let mut lines: Vec<Line<'t>> = Vec::new();
    let mut open: Vec<bool> = Vec::new();
    for (at, token) in tokens.iter().enumerate() {
        let before = at.checked_sub(1).map(|at| &tokens[at]);
        let in_several = open.last().copied().unwrap_or(true);
        let closes = token.is("}");
        let gap = before.map_or(0, |before| gap(before, token));
        let breaks = match before {
            None => true,
            Some(before) if before.is_comment() || token.kind == Kind::Doc => true,
            _ if token.kind == Kind::Comment => token.line_ends > 0,
            _ if token.begins == Begins::Item => true,
            Some(before) if before.is("{") || closes || token.begins == Begins::Member => in_several && gap > 0,
            // Where no blank may be, no line may end; and a block begins where what it belongs to ends.
            _ => token.line_ends > 0 && gap > 0 && !token.is("{"),
        };
        if closes {
            open.pop();
        }
        let boundary = is_boundary(&tokens[at..]);
        let placed = Placed {
            text: token.text,
            kind: token.kind,
            gap: if breaks { 0 } else { gap },
            blanks: if token.line_ends > 0 { 0 } else { token.blanks },
        };
        if breaks {
            let depth = open.iter().filter(|&&several| several).count();
            let first = before.is_none_or(|before| before.is("{"));
            let said = tokens[..at].iter().rev().find(|before| before.kind != Kind::Comment);
            let after_doc = said.is_some_and(|said| said.kind == Kind::Doc);
            lines.push(Line {
                after_empty: boundary && !closes && !first && !after_doc && token.line_ends > 1,
                indent: 2 * if boundary { depth } else { depth + 1 },
                tokens: vec![placed],
                comment: None,
                begins: token.begins != Begins::Nothing && !token.is_comment(),
                only_comment: token.is_comment(),
            });
        } else {
            let line = lines.last_mut().expect("the first token begins a line");
            match token.kind {
                Kind::Comment => line.comment = Some(placed),
                _ => line.tokens.push(placed),
            }
        }
        if token.is("{") {
            open.push(several[at]);
        }
    }
    lines
}

/// Whether what begins here stands between members, or ends their block, and not inside of one.
fn is_boundary(tokens: &[Token<'_>]) -> bool {
    let next = tokens.iter().find(|token| token.kind != Kind::Comment);
    next.is_none_or(|next| next.begins != Begins::Nothing || next.kind == Kind::Doc || next.is("}"))
}

/// For each opening brace, whether its block is of several lines: a line ends in it, and it is not empty.
fn blocks_of_several_lines(tokens: &[Token<'_>]) -> Vec<bool> {
    let mut several = vec![false; tokens.len()];
    let mut open: Vec<usize> = Vec::new();
    for (at, token) in tokens.iter().enumerate() {
        let empty = token.is("}") && open.last().is_some_and(|&brace| brace + 1 == at);
        if (token.line_ends > 0 || token.is_comment()) && !empty {
            for &brace in &open {
                several[brace] = true;
            }
        }
        if token.is("{") {
            open.push(at);
        } else if token.is("}") {
            open.pop();
        }
    }
    several
}

/// The blanks between two tokens on one line.
fn gap(before: &Token<'_>, token: &Token<'_>) -> usize {
    let either = |sign: &str| before.is(sign) || token.is(sign);
    match token.text {
        _ if token.kind == Kind::Comment => 2,
        "}" if before.is("{") => 0,
        _ if either("{") || token.is("}") => 1 + usize::from(token.begins == Begins::Member && !before.is("{")),
        _ if token.glued || before.kind == Kind::Prefix || before.is("(") || before.is("[") => 0,
        _ if either(".") || either("..") => 0,
        ")" | "]" | "," if token.kind == Kind::Sign => 0,
        // `"path" : type`, but `name: type`.
        ":" if token.kind == Kind::Sign => usize::from(before.kind == Kind::Text),
        // The eye should find the end of a list of names.
        _ if token.after_names && (token.begins == Begins::Member || token.kind == Kind::Quantity) => 3,
        _ if token.begins == Begins::Member => 2,
        _ => 1,
    }
}

/// Lines as text.
pub(super) fn text(lines: &[Line<'_>]) -> String {
    let mut text = String::new();
    let blanks = |text: &mut String, n: usize| text.extend(std::iter::repeat_n(' ', n));
    for line in lines {
        if line.after_empty {
            text.push('\n');
        }
        blanks(&mut text, line.indent);
        for token in line.tokens.iter().chain(&line.comment) {
            blanks(&mut text, token.gap);
            text.push_str(token.text);
        }
        text.push('\n');
    }
    text
}
