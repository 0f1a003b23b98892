//! A file as its words, signs and comments, with what decides about the blanks between them.

use pest::iterators::Pair as PestPair;
use sesame_grammar::Rule;

use crate::syntax::{is_keyword, token_at};

type Pair<'i> = PestPair<'i, Rule>;

/// What stands together without blanks.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct Token<'t> {
    /// As it stands; comments without blanks at their end.
    pub(super) text: &'t str,
    pub(super) kind: Kind,
    /// What begins with this token; both with a doc comment and with what it is about.
    pub(super) begins: Begins,
    /// The syntax asks for no blank before it.
    pub(super) glued: bool,
    /// It follows a list of names.
    pub(super) after_names: bool,
    /// How many line ends are before it.
    pub(super) line_ends: usize,
    /// How many blanks are between it and the token before it, when both are on one line.
    pub(super) blanks: usize,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Kind {
    /// A keyword or a name.
    Word,
    /// A number, with its unit if it has one.
    Quantity,
    /// In quotes.
    Text,
    /// A sign that stands between two things, or around them.
    Sign,
    /// A sign that belongs to what follows it.
    Prefix,
    /// A doc comment.
    Doc,
    /// Any other comment.
    Comment,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Begins {
    Nothing,
    /// A member of a block.
    Member,
    /// A declaration of the file.
    Item,
}

impl Token<'_> {
    pub(super) fn is(&self, sign: &str) -> bool {
        self.kind == Kind::Sign && self.text == sign
    }

    /// Whether it always ends its line.
    pub(super) fn is_comment(&self) -> bool {
        matches!(self.kind, Kind::Doc | Kind::Comment)
    }

    /// Whether two tokens differ in nothing but the blanks around them.
    pub(super) fn says_what(&self, other: &Token<'_>) -> bool {
        let part = |token: &Token<'_>| (token.kind, token.begins);
        self.text == other.text && part(self) == part(other)
    }
}

/// The tokens of a file.
pub(super) fn tokens<'t>(text: &'t str, file: &Pair<'t>) -> Vec<Token<'t>> {
    let mut walk = Walk { text, at: 0, tokens: Vec::new(), begins: Begins::Nothing, after_names: false };
    for item in file.clone().into_inner() {
        if !matches!(item.as_rule(), Rule::COMMENT | Rule::EOI) {
            walk.begins = Begins::Item;
        }
        walk.pair(&item, false);
    }
    walk.loose(text.len());
    walk.tokens
}

struct Walk<'t> {
    text: &'t str,
    /// Where the last token ends.
    at: usize,
    tokens: Vec<Token<'t>>,
    /// What the next token begins.
    begins: Begins,
    /// Whether the last token ended a list of names.
    after_names: bool,
}

impl<'t> Walk<'t> {
    /// The tokens of a pair. `glued`: no blank before the first of them.
    fn pair(&mut self, pair: &Pair<'t>, glued: bool) {
        let start = pair.as_span().start();
        match pair.as_rule() {
            Rule::EOI => {}
            Rule::COMMENT => self.token(start, pair.as_str(), Kind::Comment, false),
            Rule::doc => self.token(start, pair.as_str(), Kind::Doc, false),
            Rule::quantity | Rule::number => self.token(start, pair.as_str(), Kind::Quantity, glued),
            Rule::text => self.token(start, pair.as_str(), Kind::Text, glued),
            Rule::path | Rule::target | Rule::with_member | Rule::unit => {
                self.token(start, pair.as_str(), Kind::Word, glued);
            }
            _ if pair.clone().into_inner().all(|inner| inner.as_rule() == Rule::COMMENT) => self.leaf(pair, glued),
            _ => self.inner(pair, glued),
        }
    }

    /// A word or sign. A rule that looks ahead may have gone on over blanks and comments behind it.
    fn leaf(&mut self, pair: &Pair<'t>, glued: bool) {
        let start = pair.as_span().start();
        let end = pair.clone().into_inner().next().map_or(pair.as_span().end(), |comment| comment.as_span().start());
        let word = self.text[start..end].trim_end();
        if !word.is_empty() {
            let kind = if word.contains(|c: char| c.is_alphanumeric() || c == '_') { Kind::Word } else { Kind::Sign };
            self.token(start, word, kind, glued);
        }
        for comment in pair.clone().into_inner() {
            self.pair(&comment, false);
        }
    }

    fn inner(&mut self, pair: &Pair<'t>, glued: bool) {
        let mut in_block = false;
        let mut before: Option<Rule> = None;
        for inner in pair.clone().into_inner() {
            let rule = inner.as_rule();
            if rule == Rule::COMMENT {
                self.pair(&inner, false);
                continue;
            }
            in_block = (in_block || rule == Rule::open) && rule != Rule::close;
            let leaf = inner.clone().into_inner().all(|inner| inner.as_rule() == Rule::COMMENT);
            if in_block && rule != Rule::open && !leaf {
                self.begins = Begins::Member;
            }
            let called = rule == Rule::paren_open
                && before.is_some()
                && self.tokens.last().is_some_and(|last| last.kind == Kind::Word);
            let of_type = rule == Rule::unit_in_brackets;
            self.pair(&inner, called || of_type || (glued && before.is_none()));
            if matches!(rule, Rule::minus | Rule::plus)
                && matches!(before, None | Some(Rule::minus | Rule::plus))
                && let Some(sign) = self.tokens.iter_mut().rev().find(|token| token.kind != Kind::Comment)
            {
                sign.kind = Kind::Prefix;
            }
            // An empty pair, as of doc comments that are not there, is nothing to stand after.
            if !inner.as_str().is_empty() {
                before = Some(rule);
            }
        }
        self.after_names |= matches!(pair.as_rule(), Rule::names | Rule::metric_names | Rule::with_members);
    }

    fn token(&mut self, start: usize, text: &'t str, kind: Kind, glued: bool) {
        self.loose(start);
        self.push(start, text.trim_end(), kind, glued);
        self.at = start + text.len();
    }

    /// Words and signs before an offset that the grammar has no rule for.
    fn loose(&mut self, end: usize) {
        loop {
            let token = token_at(self.text, self.at);
            if token.lo >= end || token.text.is_empty() {
                break;
            }
            let kind = match token.text.chars().next() {
                Some('"') => Kind::Text,
                Some(first) if first.is_ascii_digit() => Kind::Quantity,
                Some(first) if first.is_alphabetic() || first == '_' => Kind::Word,
                _ => Kind::Sign,
            };
            self.push(token.lo, token.text, kind, false);
            self.at = token.hi();
        }
    }

    fn push(&mut self, start: usize, text: &'t str, kind: Kind, glued: bool) {
        let between = &self.text[self.at..start];
        let line_ends = between.matches('\n').count();
        // A tab is as good as two blanks.
        let blanks = between.chars().map(|c| if c == '\t' { 2 } else { 1 }).sum();
        let begins = match kind {
            Kind::Comment => Begins::Nothing,
            Kind::Doc => self.begins,
            _ => std::mem::replace(&mut self.begins, Begins::Nothing),
        };
        let after_names = kind != Kind::Comment && std::mem::take(&mut self.after_names);
        // A unit may follow a parenthesis, and then belongs to it.
        let closed = self.tokens.last().is_some_and(|last| last.is(")"));
        let unit = closed && between.is_empty() && begins == Begins::Nothing && kind == Kind::Word && !is_keyword(text);
        let glued = glued || unit;
        self.tokens.push(Token { text, kind, begins, glued, after_names, line_ends, blanks });
    }
}
