//! What stands at a place, for messages: words, texts, numbers, signs.

use sesame_grammar::Rule;

use super::limits::parse_bounded;
use super::text::text_end;

/// The token at or after an offset, comments skipped.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Token<'t> {
    pub(super) kind: TokenKind,
    pub(crate) lo: usize,
    pub(crate) text: &'t str,
}

impl Token<'_> {
    pub(crate) fn hi(&self) -> usize {
        self.lo + self.text.len()
    }
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum TokenKind {
    Word,
    Number,
    Text,
    /// A quote that does not end on its line, with the rest of the line.
    OpenText,
    Doc,
    Sign,
    End,
}

/// The tokens that begin in a stretch of a text.
pub(crate) fn tokens(text: &str, lo: usize, hi: usize) -> impl Iterator<Item = Token<'_>> {
    let mut at = lo;
    std::iter::from_fn(move || {
        let token = token_at(text, at);
        at = token.hi();
        (token.kind != TokenKind::End && token.lo < hi).then_some(token)
    })
}

/// The token at or after an offset.
pub(crate) fn token_at(text: &str, offset: usize) -> Token<'_> {
    let mut at = offset;
    loop {
        let rest = &text[at..];
        let trimmed = rest.trim_start_matches([' ', '\t', '\r', '\n', '\u{FEFF}']);
        at += rest.len() - trimmed.len();
        if !trimmed.starts_with("//") || is_doc(trimmed) {
            break;
        }
        at += trimmed.find('\n').unwrap_or(trimmed.len());
    }
    let rest = &text[at..];
    let token = |kind, length| Token { kind, lo: at, text: &rest[..length] };
    let line = || rest.find(['\r', '\n']).unwrap_or(rest.len());
    let Some(first) = rest.chars().next() else { return token(TokenKind::End, 0) };
    let word = |rest: &str| rest.find(|c: char| !(c.is_alphanumeric() || c == '_')).unwrap_or(rest.len());
    match first {
        '"' => match text_end(text, at) {
            Some(end) => token(TokenKind::Text, end - at),
            None => token(TokenKind::OpenText, line()),
        },
        _ if is_doc(rest) => token(TokenKind::Doc, line()),
        _ if first.is_ascii_digit() => {
            let length = parse_bounded(Rule::quantity, rest).map_or(1, |pairs| pairs.as_str().len());
            token(TokenKind::Number, length)
        }
        _ if first.is_alphabetic() || first == '_' => token(TokenKind::Word, word(rest)),
        '<' | '>' | '=' | '.' if rest[1..].starts_with(['=', '.']) => token(TokenKind::Sign, 2),
        _ => token(TokenKind::Sign, first.len_utf8()),
    }
}

fn is_doc(text: &str) -> bool {
    text.starts_with("///") && !text.starts_with("////")
}

/// Whether a word is reserved.
pub(crate) fn is_keyword(word: &str) -> bool {
    parse_bounded(Rule::keyword, word).is_ok_and(|pairs| pairs.as_str() == word)
}
