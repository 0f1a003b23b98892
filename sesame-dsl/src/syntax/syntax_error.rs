//! What is wrong where the grammar gave up, in words.
//!
//! pest reports only the first failure of a parse and speaks in rule names. So each swallowed stretch is read once
//! more, by the rule its first word asks for, or as the continuation of the construct before it; the furthest failure
//! of that reading is the mistake, and the rules it names are what would fit.

use pest::error::{ErrorVariant, InputLocation};
use pest::iterators::Pairs;
use sesame_grammar::Rule;

use super::blocks::{self, Block};
use super::bounds;
use super::foreign::{self, Expected, Rewrite};
use super::limits::parse_bounded;
use super::phrases::{keyword_of, phrases_of, rule_name};
use super::token::{Token, TokenKind, is_keyword, token_at, tokens};
use super::values;
use crate::diagnostic::{Applicability, Code, Diagnostic, Suggestion};
use crate::span::{FileId, Span};
use crate::synonyms::{self, Synonym};
use crate::units::Unit;

/// The furthest failure of a reading: where, and which rules would have fitted.
struct Failure {
    at: usize,
    expected: Vec<Rule>,
}

fn read(text: &str, lo: usize, hi: usize, rule: Rule) -> Option<Failure> {
    let error = parse_bounded(rule, &text[lo..hi]).err()?;
    let at = match error.location {
        InputLocation::Pos(at) | InputLocation::Span((at, _)) => lo + at,
    };
    match error.variant {
        ErrorVariant::ParsingError { positives, .. } => Some(Failure { at, expected: positives }),
        ErrorVariant::CustomError { .. } => None,
    }
}

/// Explains a swallowed stretch, given the good construct before it.
///
/// A fix that leaves the stretch unreadable may not be what its author means, so only one after which it can be read is
/// for a program to apply.
pub(super) fn explain(file: FileId, text: &str, region: Span, block: &Block, previous: Option<Span>) -> Diagnostic {
    let mut diagnostic = explained(file, text, region, block, previous);
    let after = token_at(text, region.hi as usize);
    let member = block.begins_with(after.text) || (block.begins_with_a_name() && after.kind == TokenKind::Word);
    let ends = member || matches!(after.kind, TokenKind::End | TokenKind::Doc) || after.text == "}";
    let starts = || std::iter::once(region.lo).chain(previous.map(|previous| previous.lo));
    let last = with_signs(text, region.hi);
    let mut readable = Vec::new();
    diagnostic.suggestions.retain_mut(|suggestion| {
        let inside = |lo: u32| suggestion.edits.iter().all(|(span, _)| lo <= span.lo && span.hi <= region.hi);
        let readings: Vec<Reading> =
            starts().filter(|&lo| inside(lo)).map(|lo| reading(text, lo, region.hi, suggestion, block)).collect();
        if !ends || !readings.contains(&Reading::Whole) {
            suggestion.applicability = Applicability::MaybeIncorrect;
        }
        let keeps = readings.is_empty() || readings.iter().any(|reading| *reading != Reading::NotEvenTheSuggestion);
        if keeps {
            let whole = |lo| reading(text, lo, last, suggestion, block) == Reading::Whole;
            readable.push(readings.is_empty() || starts().filter(|&lo| inside(lo)).any(whole));
        }
        keeps
    });
    // What leads to no other mistake is likelier.
    if readable.contains(&true) {
        let mut readable = readable.into_iter();
        diagnostic.suggestions.retain(|_| readable.next().unwrap_or(true));
    }
    diagnostic
}

/// Where the signs end that follow a stretch: it ends at its last word or number.
fn with_signs(text: &str, hi: u32) -> u32 {
    let mut end = hi as usize;
    loop {
        let after = token_at(text, end);
        if after.kind != TokenKind::Sign || matches!(after.text, "{" | "}") {
            return u32::try_from(end).expect("files are small");
        }
        end = after.hi();
    }
}

/// How far a stretch can be read with a suggestion applied.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Reading {
    Whole,
    Beyond,
    NotEvenTheSuggestion,
}

fn reading(text: &str, lo: u32, hi: u32, suggestion: &Suggestion, block: &Block) -> Reading {
    let mut mended = text[lo as usize..hi as usize].to_owned();
    let mut written = 0;
    for (span, replacement) in suggestion.edits.iter().rev() {
        let from = (span.lo - lo) as usize;
        mended.replace_range(from..(span.hi - lo) as usize, replacement);
        // Where something is removed, what follows has to fit.
        written = written.max(from + replacement.len().max(1));
    }
    if mended.trim().is_empty() {
        return Reading::Whole;
    }
    // Settings that cannot be read are swallowed, so what contains some can be read as well.
    let swallows = |pairs: Pairs<'_, Rule>| pairs.flatten().any(|pair| rule_name(pair.as_rule()).starts_with("error_"));
    match read(&mended, 0, mended.len(), block.one) {
        None if parse_bounded(block.one, &mended).is_ok_and(swallows) => Reading::Beyond,
        None => Reading::Whole,
        Some(failure) if failure.at < written => Reading::NotEvenTheSuggestion,
        Some(_) => Reading::Beyond,
    }
}

fn explained(file: FileId, text: &str, region: Span, block: &Block, previous: Option<Span>) -> Diagnostic {
    let span_of = |token: Token<'_>| placed(file, token.lo..token.hi());
    let [lo, hi] = [region.lo as usize, region.hi as usize];
    let mut first = token_at(text, lo);
    while first.kind == TokenKind::Doc && first.hi() < hi {
        first = token_at(text, first.hi());
    }
    if first.kind == TokenKind::Doc || first.lo >= hi {
        let doc = token_at(text, lo);
        return Diagnostic::new(Code::SYNTAX, span_of(doc), "this doc comment documents nothing")
            .label("expected a declaration after it")
            .suggest("use a plain comment", Span { hi: region.lo + 3, ..region }, "//");
    }
    if first.text == "}" {
        let title = "unmatched `}`";
        return Diagnostic::new(Code::NOT_CLOSED, span_of(first), title).label("no block is open here");
    }

    let begins = block.begins_with(first.text) || block.begins_with_a_name();
    let continued = previous
        .and_then(|previous| read(text, previous.lo as usize, hi, block.one))
        .filter(|failure| token_at(text, failure.at).lo >= first.lo);
    let alone = || read(text, lo, hi, block.one).filter(|failure| failure.at >= lo);
    // What no member begins with is not read on its own: it may be a setting of another block.
    let failure = if begins { alone().or(continued) } else { continued };
    let failure = failure.unwrap_or(Failure { at: first.lo, expected: vec![] });

    let found = token_at(text, failure.at);
    let span = span_of(found);
    let wants_name = failure.expected.iter().any(|&rule| {
        matches!(
            rule,
            Rule::name
                | Rule::names
                | Rule::metric_name
                | Rule::metric_names
                | Rule::path
                | Rule::target
                | Rule::targets
                | Rule::condition_variable
        )
    });
    let at_start = found.lo == first.lo;
    let fitting = fitting(&failure.expected, block, at_start);
    let expected = alternatives(&fitting);

    let before = text[..found.lo].chars().next_back();
    let after = text[found.hi()..].chars().next();
    let counts = |rule: Rule| failure.expected.contains(&rule);
    let counted = match found.text {
        "[" if counts(Rule::comma) && (counts(Rule::count) || counts(Rule::number)) => counted_in_brackets(text, found),
        _ if counts(Rule::dots) => counted_otherwise(text, found),
        _ => None,
    };
    if let Some((range, join, count)) = counted {
        return Diagnostic::new(Code::SYNTAX, span, format!("unexpected `{}`", found.text))
            .label(format!("expected {expected}"))
            .fix(format!("write `{range}`"), placed(file, join), count);
    }
    if let Some((operator, rewrites)) = foreign::operator(text, failure.at).filter(|_| !counts(Rule::equals)) {
        let title = format!("unexpected `{}`", &text[operator.clone()]);
        let diagnostic = Diagnostic::new(Code::SYNTAX, placed(file, operator), title);
        return rewritten(diagnostic.label("not an operator of the language"), rewrites);
    }
    let joins = |c: Option<char>| c.is_some_and(|c| c.is_alphanumeric() || c == '_');
    if found.text == "-" && joins(before) && joins(after) {
        let diagnostic = Diagnostic::new(Code::NOT_A_NAME, span, "a name cannot contain `-`")
            .label("names consist of letters, digits and `_`");
        let from = text[..found.lo].trim_end_matches(|c| joins(Some(c))).len();
        let to = token_at(text, found.hi()).hi();
        let declared = text[..from].trim_end().rsplit(|c| !joins(Some(c))).next().unwrap_or_default();
        let declares = [Rule::file, Rule::system].iter().any(|&rule| blocks::block(rule).begins_with(declared));
        let meanings = synonyms::meanings(&text[from..to], |_| !declares);
        let diagnostic = match meanings.first() {
            Some(synonym) => diagnostic.did_you_mean(placed(file, from..to), synonym.meant),
            None => diagnostic,
        };
        return diagnostic.suggest("use `_`", span, "_");
    }
    if found.kind == TokenKind::OpenText {
        let title = "this text does not end on its line";
        return Diagnostic::new(Code::BAD_TEXT, span, title).label("missing closing `\"`");
    }
    if found.kind == TokenKind::Doc {
        return Diagnostic::new(Code::SYNTAX, span, "a doc comment is not allowed here")
            .label(format!("expected {expected}"))
            .note("`///` documents the declaration after it; use `//` for any other comment");
    }
    let next = token_at(text, found.hi());
    // A keyword that begins the next declaration is in its place: what is missing is the name before it.
    let [in_file, in_system] = [Rule::file, Rule::system].map(|rule| blocks::block(rule).begins_with(found.text));
    let declares = (in_file || in_system) && (next.kind == TokenKind::Word || next.text == "{");
    if first.text == "requirement"
        && let Some(formula) = bounds::formula(text, first.lo, found.lo)
    {
        let title = "a requirement is a bound on a metric, not a formula";
        return Diagnostic::new(Code::SYNTAX, span, title)
            .label(if wants_name { "expected the name of a metric" } else { "expected a bound such as `<= 0`" })
            .note(formula);
    }
    if matches!(found.text, "maximise" | "minimise") && wants_name && next.kind == TokenKind::Word && !declares {
        let title = format!("`{}` belongs to the declaration of the metric", found.text);
        let gap = placed(file, found.lo..next.lo);
        return Diagnostic::new(Code::KEYWORD_AS_NAME, span, title)
            .label("expected the name of a metric")
            .suggest("remove the direction", gap, "")
            .note(format!("the direction is declared as in `metric {} {} = …`", next.text, found.text));
    }
    if wants_name && found.kind == TokenKind::Word && is_keyword(found.text) && !declares {
        let title = format!("`{}` is a keyword and cannot be a name", found.text);
        let diagnostic = Diagnostic::new(Code::KEYWORD_AS_NAME, span, title);
        let before = tokens(text, first.lo, found.lo).last().map_or("", |word| word.text);
        let named = [Rule::file, Rule::system, Rule::eddi].iter().any(|&rule| blocks::block(rule).begins_with(before));
        return if named {
            let other = format!("{}_1", found.text);
            diagnostic.label("choose another name").suggest(format!("use `{other}`"), span, other)
        } else {
            diagnostic.label("nothing that is declared has this name")
        };
    }

    let title = match found.kind {
        TokenKind::End => "the file ends in the middle of a declaration".to_owned(),
        TokenKind::Text => format!("unexpected text {}", found.text),
        TokenKind::Number => format!("unexpected number `{}`", found.text),
        _ => format!("unexpected `{}`", found.text),
    };
    let from = previous.map_or(region.lo, |previous| previous.lo) as usize;
    let mut diagnostic = Diagnostic::new(Code::SYNTAX, span, title).label(format!("expected {expected}"));
    if found.kind == TokenKind::Word {
        let mut candidates: Vec<&'static str> = failure.expected.iter().filter_map(|&rule| keyword_of(rule)).collect();
        candidates.extend(block.words().filter(|_| at_start));
        let candidates = candidates.into_iter().chain(fitting.iter().filter_map(|phrase| first_word(phrase)));
        let candidates: Vec<&str> = candidates.collect();
        // A word of the language is not a misspelling of another.
        let known = Rule::all_rules().iter().any(|&rule| keyword_of(rule) == Some(found.text));
        let (phrase, meanings) = foreign_words(text, found, &candidates);
        let phrase = placed(file, found.lo..phrase);
        // What may stand only once would stand there twice.
        let direction = |word: &str| matches!(word, "maximise" | "minimise");
        let said_already = |word: &str| {
            tokens(text, from, hi).any(|token| token.text == word || direction(word) && direction(token.text))
        };
        for synonym in &meanings {
            let message = format!("did you mean `{}`?", synonym.meant);
            diagnostic = if synonym.same && !said_already(synonym.meant) {
                diagnostic.fix(message, phrase, synonym.meant)
            } else {
                diagnostic.suggest(message, phrase, synonym.meant)
            };
        }
        let similar = || crate::similar::most_similar(found.text, candidates.iter().copied());
        if meanings.is_empty()
            && !known
            && let Some(meant) = similar()
        {
            diagnostic = diagnostic.did_you_mean(span, meant);
        }
        let number_before = before.is_some_and(char::is_whitespace)
            && text[..found.lo].trim_end().ends_with(|c: char| c.is_ascii_digit());
        if number_before && Unit::parse(found.text).is_ok() {
            let gap = text[..found.lo].trim_end().len();
            let gap = placed(file, gap..found.lo);
            diagnostic = diagnostic.suggest("remove the space before the unit", gap, "");
        }
        if block.rule == Rule::file && in_system {
            diagnostic = diagnostic.note(format!("`{}` is declared inside `system {{ … }}`", found.text));
        }
    }
    let part = if counts(Rule::times) { Expected::Operator } else { Expected::Operand };
    diagnostic = rewritten(diagnostic, foreign::notation(text, from, found.lo, part));
    if part == Expected::Operator && found.text == "[" && is_index(text, found) {
        diagnostic = diagnostic.note(
            "brackets stand directly behind the name of a group or a list; `each of` stands for each member, `max of` for \
             the greatest value, and the name alone for the least",
        );
    }
    let open = open_bracket(text, from, found.lo);
    if let Some(open) = open {
        // What begins like a choice of elements may be the interval of a temporal operator: `G[0s, 2s]`.
        diagnostic = rewritten(diagnostic, foreign::notation(text, from, open, Expected::Operator));
    }
    if counts(Rule::each_element) && found.kind == TokenKind::Word || open.is_some() && counts(Rule::equal_to) {
        diagnostic = diagnostic.note(
            "brackets choose elements of a list, such as `[0]`, or a member of a group by its name, such as `odom[r1]`",
        );
    }
    let mut region = tokens(text, from, found.lo).skip_while(|token| token.text != "signed_distance");
    let otherwise = region.find_map(|token| synonyms::region_otherwise(token.text));
    diagnostic.notes.extend(otherwise.map(str::to_owned));
    if found.text == "and"
        && let Some(previous) = previous
    {
        diagnostic = rewritten(diagnostic, bounds::both(text, previous.lo as usize, found));
    }
    if counts(Rule::range) || counts(Rule::bracket_open) {
        diagnostic = rewritten(diagnostic, values::one_value(text, from, found));
    }
    if counts(Rule::text) || counts(Rule::texts) {
        diagnostic = rewritten(diagnostic, values::without_brackets(text, from, found));
        diagnostic.notes.extend(values::numbers_are_not_listed(text, from, found).map(str::to_owned));
    } else if matches!(found.text, "true" | "false") {
        diagnostic = rewritten(diagnostic, values::without_brackets(text, from, found));
    }
    if found.kind == TokenKind::Sign && found.text == "=" && failure.expected.contains(&Rule::equal_to) {
        // A number may be what is needed, not a condition.
        if foreign::following(text, found.hi(), Rule::sum).is_some() {
            diagnostic = diagnostic.suggest("use `==` to compare", span, "==");
        }
    }
    diagnostic
}

/// Where the bracket behind a name begins that is not closed before a place.
fn open_bracket(text: &str, from: usize, at: usize) -> Option<usize> {
    let inside = tokens(text, from, at).fold(None, |open, token| match token.text {
        "[" => Some(token.lo),
        "]" => None,
        _ => open,
    });
    inside.filter(|&open| text[..open].ends_with(|c: char| c.is_alphanumeric() || c == '_'))
}

fn placed(file: FileId, range: std::ops::Range<usize>) -> Span {
    let [lo, hi] = [range.start, range.end].map(|at| u32::try_from(at).expect("files are small"));
    Span { file, lo, hi }
}

fn rewritten(mut diagnostic: Diagnostic, rewrites: impl IntoIterator<Item = Rewrite>) -> Diagnostic {
    let file = diagnostic.span.file;
    for Rewrite { message, edits, same } in rewrites {
        let edits = edits.into_iter().map(|(range, written)| (placed(file, range), written)).collect();
        let mut suggestion = Suggestion::possible(message, edits);
        if same {
            suggestion.applicability = Applicability::MachineApplicable;
        }
        diagnostic.suggestions.push(suggestion);
    }
    diagnostic
}

/// What foreign words at a token mean, of what can stand there, and where they end: two words that belong together,
/// such as `gaussian noise` or `nsga-ii`, or otherwise one.
fn foreign_words(text: &str, found: Token<'_>, candidates: &[&str]) -> (usize, Vec<Synonym>) {
    let expected = |word: &str| candidates.contains(&word);
    let next = token_at(text, found.hi());
    let last = if next.text == "-" { token_at(text, next.hi()) } else { next };
    if matches!(last.kind, TokenKind::Word | TokenKind::Number) && !text[found.lo..last.hi()].contains(['\n', '/']) {
        let phrase = synonyms::meanings(&text[found.lo..last.hi()], expected);
        if !phrase.is_empty() {
            return (last.hi(), phrase);
        }
    }
    (found.hi(), synonyms::meanings(found.text, expected))
}

/// Whether brackets contain what chooses one of several: a count or a text.
fn is_index(text: &str, open: Token<'_>) -> bool {
    let inside = token_at(text, open.hi());
    (is_count(inside) || inside.kind == TokenKind::Text) && token_at(text, inside.hi()).text == "]"
}

/// Two numbers of a count, where they stand, and what to write there.
type Counted = (String, std::ops::Range<usize>, String);

fn is_count(token: Token<'_>) -> bool {
    token.kind == TokenKind::Number && token.text.bytes().all(|byte| byte.is_ascii_digit())
}

/// Two numbers of a count that are not joined by `..`: `1-5`, `1 to 5`.
fn counted_otherwise(text: &str, found: Token<'_>) -> Option<Counted> {
    let mut last = token_at(text, found.hi());
    while last.text == "." {
        last = token_at(text, last.hi());
    }
    let joined = matches!(found.text, "-" | "–" | "—" | "…" | "~" | ":" | "." | "to" | "until");
    let gap = text[..found.lo].trim_end().len();
    let first = text[..gap].trim_end_matches(|c: char| c.is_ascii_digit()).len();
    let whole = !text[..first].ends_with(|c: char| c == '.' || c.is_alphanumeric());
    let both = joined && is_count(last) && first < gap && whole;
    both.then(|| (format!("{}..{}", &text[first..gap], last.text), gap..last.lo, "..".to_owned()))
}

/// Two numbers of a count that are written as a range of quantities: `[1, 5]`.
fn counted_in_brackets(text: &str, open: Token<'_>) -> Option<Counted> {
    let first = token_at(text, open.hi());
    let comma = token_at(text, first.hi());
    let last = token_at(text, comma.hi());
    let close = token_at(text, last.hi());
    let range = format!("{}..{}", first.text, last.text);
    let both = is_count(first) && comma.text == "," && is_count(last) && close.text == "]";
    both.then(|| (range.clone(), open.lo..close.hi(), range))
}

/// What would fit, in phrases: those with words of the language first, otherwise in the order of the grammar.
fn fitting(expected: &[Rule], block: &Block, at_start: bool) -> Vec<String> {
    let mut phrases: Vec<String> = Vec::new();
    let mut members = false;
    let value = phrases_of(Rule::truth);
    let only_words = expected.iter().filter(|&&rule| phrases_of(rule) == value).eq([&Rule::truth]);
    for &rule in expected {
        let begins_member = keyword_of(rule).is_some_and(|word| block.begins_with(word));
        if rule == Rule::EOI || rule == block.one || (at_start && begins_member) {
            members = true;
            continue;
        }
        let words = || vec!["`true`".to_owned(), "`false`".to_owned()];
        for phrase in if only_words && rule == Rule::truth { words() } else { phrases_of(rule) } {
            if !phrases.contains(&phrase) {
                phrases.push(phrase);
            }
        }
    }
    let only_members = phrases.is_empty();
    phrases.sort_by_key(|phrase| !phrase.starts_with('`'));
    if only_members || (members && at_start) {
        if block.rule == Rule::file {
            phrases.push(if only_members {
                format!("a declaration: {}", alternatives(&listed(block)))
            } else {
                "a declaration".to_owned()
            });
        } else {
            phrases.extend(listed(block));
        }
    }
    phrases
}

/// The members of a block, as a message lists them.
fn listed(block: &Block) -> Vec<String> {
    block.members.iter().map(blocks::Member::phrase).collect()
}

/// Phrases joined for a sentence.
fn alternatives(phrases: &[String]) -> String {
    match phrases {
        [] => String::new(),
        [only] => only.clone(),
        [others @ .., last] => format!("{} or {last}", others.join(", ")),
    }
}

/// The first word of a phrase that quotes words of the language.
fn first_word(phrase: &str) -> Option<&str> {
    let quoted = phrase.strip_prefix('`')?;
    let end = quoted.find(|c: char| !(c.is_ascii_alphanumeric() || c == '_'))?;
    (end > 0).then(|| &quoted[..end])
}
