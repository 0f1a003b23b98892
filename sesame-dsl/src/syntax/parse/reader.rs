//! What all of the parser works with: the reader of one file, blocks and their members, and parts of pairs.

use pest::iterators::Pair as PestPair;
use sesame_grammar::Rule;

use crate::diagnostic::{Code, Diagnostic};
use crate::span::{FileId, Span};
use crate::syntax::ast::{Comparison, File, Name};
use crate::syntax::blocks::{self, Block};
use crate::syntax::syntax_error::explain;
use crate::syntax::token::{TokenKind, token_at};

pub(super) type Pair<'i> = PestPair<'i, Rule>;

pub(super) struct Reader<'s> {
    pub(super) file: FileId,
    pub(super) text: &'s str,
    pub(super) diagnostics: &'s mut Vec<Diagnostic>,
    pub(super) out: File,
    /// Where the last syntax error is.
    pub(super) mistake: Option<usize>,
}

pub(super) fn child<'i>(pair: &Pair<'i>, rule: Rule) -> Option<Pair<'i>> {
    pair.clone().into_inner().find(|inner| inner.as_rule() == rule)
}

pub(super) fn expect_child<'i>(pair: &Pair<'i>, rule: Rule) -> Pair<'i> {
    child(pair, rule).unwrap_or_else(|| panic!("the grammar puts a {rule:?} into every {:?}", pair.as_rule()))
}

pub(super) fn children<'i>(pair: &Pair<'i>, rule: Rule) -> impl Iterator<Item = Pair<'i>> {
    pair.clone().into_inner().filter(move |inner| inner.as_rule() == rule)
}

pub(super) fn first_of<'i>(pair: &Pair<'i>, rules: &[Rule]) -> Option<Pair<'i>> {
    pair.clone().into_inner().find(|inner| rules.contains(&inner.as_rule()))
}

/// The sign by which a bound or a relation compares, if it does.
pub(super) fn comparison(pair: &Pair<'_>) -> Option<Comparison> {
    pair.clone().into_inner().find_map(|inner| match inner.as_rule() {
        Rule::at_most => Some(Comparison::AtMost),
        Rule::at_least => Some(Comparison::AtLeast),
        Rule::equal_to => Some(Comparison::Equal),
        Rule::below => Some(Comparison::Below),
        Rule::above => Some(Comparison::Above),
        _ => None,
    })
}

/// Where a construct's last word ends. pest's own span goes on over the blanks before an optional part that is not
/// there.
fn end_of(pair: &Pair<'_>) -> usize {
    let last = pair.clone().into_inner().rfind(|inner| inner.as_rule() != Rule::COMMENT);
    match last {
        // The closing quote is not a pair.
        Some(_) if pair.as_rule() == Rule::text => pair.as_span().end(),
        Some(last) => end_of(&last),
        None => pair.as_span().end(),
    }
}

impl Reader<'_> {
    pub(super) fn span_of(&self, lo: usize, hi: usize) -> Span {
        let offset = |at: usize| u32::try_from(at).expect("files are at most MAX_BYTES long");
        Span { file: self.file, lo: offset(lo), hi: offset(hi) }
    }

    pub(super) fn span(&self, pair: &Pair<'_>) -> Span {
        self.span_of(pair.as_span().start(), end_of(pair))
    }

    /// The span of a clause's first word.
    pub(super) fn keyword_span(&self, pair: &Pair<'_>) -> Span {
        let first = pair.clone().into_inner().find(|inner| !matches!(inner.as_rule(), Rule::docs | Rule::COMMENT));
        self.span(&first.unwrap_or_else(|| pair.clone()))
    }

    pub(super) fn report(&mut self, diagnostic: Diagnostic) {
        self.diagnostics.push(diagnostic);
    }

    /// Visits the members of a block. What could not be read is explained; returns whether there was such a thing.
    pub(super) fn members<'i>(&mut self, block: &Pair<'i>, mut visit: impl FnMut(&mut Self, Pair<'i>)) -> bool {
        let row = blocks::block(block.as_rule());
        let mut has_errors = false;
        let mut previous = None;
        let mut opened = None;
        // Words that are not members, from the first that was not explained yet.
        let mut stretch: Option<Span> = None;
        for pair in block.clone().into_inner() {
            let rule = pair.as_rule();
            if rule == Rule::COMMENT {
                continue;
            }
            if rule == Rule::error_setting {
                let span = self.span(&pair);
                let begins = row.begins_with(token_at(self.text, pair.as_span().start()).text);
                if let Some(before) = stretch.filter(|_| !begins) {
                    stretch = Some(before.to(span));
                    continue;
                }
                self.unread(row, stretch.replace(span), &mut previous);
                has_errors = true;
                continue;
            }
            self.unread(row, stretch.take(), &mut previous);
            if rule == Rule::open {
                opened = Some(self.span(&pair));
            } else if matches!(rule, Rule::not_closed | Rule::fields_not_closed) {
                has_errors = true;
                self.not_closed(row, &pair, opened);
            } else if rule == row.error {
                has_errors = true;
                self.unread(row, Some(self.span(&pair)), &mut previous);
            } else if row.members.iter().any(|member| member.rule == rule) {
                previous = Some(self.span(&pair));
                visit(self, pair);
            }
        }
        self.unread(row, stretch, &mut previous);
        has_errors
    }

    /// Explains a stretch of a block that could not be read, if there is one, given the member before it, which none is
    /// for the next.
    fn unread(&mut self, row: &Block, stretch: Option<Span>, previous: &mut Option<Span>) {
        let Some(stretch) = stretch else { return };
        self.undeclared_names(stretch);
        let previous = previous.take();
        // A stretch that begins at the mistake before it is the rest of the same mistake.
        let start = token_at(self.text, stretch.lo as usize).lo;
        if self.mistake == Some(start) {
            return;
        }
        let diagnostic = explain(self.file, self.text, stretch, row, previous);
        self.mistake = Some(diagnostic.span.lo as usize);
        self.report(diagnostic);
    }

    fn not_closed(&mut self, row: &Block, end: &Pair<'_>, opened: Option<Span>) {
        let opened = opened.expect("a block begins with its brace");
        let at = token_at(self.text, end.as_span().start());
        let span = self.span_of(at.lo, at.hi());
        let label = if at.text.is_empty() {
            "the file ends here".to_owned()
        } else {
            format!("`{}` begins a new declaration", at.text)
        };
        let diagnostic =
            Diagnostic::new(Code::NOT_CLOSED, span, format!("the block of this `{}` is not closed", row.name))
                .label(label)
                .secondary(opened, "opened here");
        self.report(diagnostic);
    }

    /// Keeps the name that a broken or unsupported construct was about to declare.
    fn undeclared_names(&mut self, stretch: Span) {
        let [lo, end] = [stretch.lo as usize, stretch.hi as usize];
        let mut at = lo;
        // A misspelt first word may have been about to declare the second.
        let first = token_at(self.text, lo);
        let second = token_at(self.text, first.hi());
        let both_words = [first, second].iter().all(|token| token.kind == TokenKind::Word);
        if both_words && second.lo < end {
            let span = self.span_of(second.lo, second.hi());
            self.out.undeclared.push(Name { text: second.text.to_owned(), span });
        }
        loop {
            let token = token_at(self.text, at);
            if token.lo >= end || token.text.is_empty() {
                return;
            }
            at = token.hi();
            if blocks::declares(token.text) {
                let name = token_at(self.text, at);
                if name.kind == TokenKind::Word && name.lo < end {
                    let span = self.span_of(name.lo, name.hi());
                    self.out.undeclared.push(Name { text: name.text.to_owned(), span });
                    at = name.hi();
                }
            }
        }
    }

    /// Says that a construct belongs to a later version. Its first word decides where; its rule decides what it is
    /// called.
    pub(super) fn unsupported(&mut self, pair: &Pair<'_>) {
        let span = self.keyword_span(pair);
        let word = &self.text[span.range()];
        let what = match pair.as_rule() {
            Rule::unsupported_transport => format!("simulator kind `{word}`"),
            Rule::unsupported_strategy => format!("search strategy `{word}`"),
            _ => format!("`{word}`"),
        };
        self.undeclared_names(self.span(pair));
        self.report(
            Diagnostic::new(Code::NOT_SUPPORTED, span, format!("{what} is not supported yet"))
                .label("part of the language, but not supported by this version of sesamec"),
        );
    }
}
