//! Names, texts, numbers with their units, and bounds: what all constructs are made of.

use super::formula::Relation;
use crate::span::Span;

/// A name, where it stands.
#[derive(Debug, Clone)]
pub(crate) struct Name {
    pub(crate) text: String,
    pub(crate) span: Span,
}

/// A topic or node, and perhaps which member of a group.
#[derive(Debug, Clone)]
pub(crate) struct WithMember {
    pub(crate) name: Name,
    pub(crate) member: Option<Member>,
    /// All of it.
    pub(crate) span: Span,
}

/// Which member of a group, in brackets.
#[derive(Debug, Clone)]
pub(crate) struct Member {
    /// Its name; `None` for all of them, which is written `[*]`.
    pub(crate) name: Option<String>,
    /// With the brackets.
    pub(crate) span: Span,
}

/// The head of a declaration.
#[derive(Debug, Clone)]
pub(crate) struct Head {
    pub(crate) name: Name,
    pub(crate) doc: String,
    /// All of the declaration but its doc comment.
    pub(crate) full_span: Span,
}

/// A quoted text without its quotes and escapes; the span includes the quotes.
#[derive(Debug, Clone)]
pub(crate) struct Text {
    pub(crate) text: String,
    pub(crate) span: Span,
}

impl Text {
    /// The words in braces that are names, or made of words with hyphens, each with its place without the braces: other
    /// braces are the text's own. No place is known in a text with unknown escapes.
    pub(crate) fn placeholders(&self) -> impl Iterator<Item = (&str, Option<Span>)> {
        let words = self.text.match_indices('{').filter_map(|(open, _)| {
            let at = open + 1;
            Some((at, self.text[at..].split_once('}')?.0))
        });
        let words = words.filter(|(_, word)| {
            word.starts_with(|first: char| first.is_alphabetic() || first == '_')
                && word.chars().all(|char| char.is_alphanumeric() || matches!(char, '-' | '_'))
        });
        words.map(|(at, word)| (word, self.part(at, word.len())))
    }

    /// Where a part of the text stands.
    fn part(&self, at: usize, length: usize) -> Option<Span> {
        // In the file, each of them has a backslash before it.
        let in_file = |text: &str| text.len() + text.bytes().filter(|byte| matches!(byte, b'"' | b'\\')).count();
        let Span { file, lo, hi } = self.span;
        let inner = lo + u32::try_from("\"".len()).ok()?;
        let is_all = usize::try_from(hi - lo).ok()? == in_file(&self.text) + "\"\"".len();
        let lo = inner + u32::try_from(in_file(&self.text[..at])).ok()?;
        is_all.then_some(Span { file, lo, hi: lo + u32::try_from(length).ok()? })
    }
}

#[derive(Debug, Clone)]
pub(crate) struct UnitName {
    pub(crate) text: String,
    pub(crate) span: Span,
}

/// A number with its sign and unit.
#[derive(Debug, Clone)]
pub(crate) struct Quantity {
    /// Finite, or NaN for one whose digits were already reported.
    pub(crate) value: f64,
    pub(crate) unit: Option<UnitName>,
    pub(crate) span: Span,
}

#[derive(Debug, Clone)]
pub(crate) struct Range {
    pub(crate) low: Quantity,
    pub(crate) high: Quantity,
    pub(crate) span: Span,
}

/// A whole number as written.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Count {
    /// `None` for one that was already reported.
    pub(crate) value: Option<u64>,
    pub(crate) span: Span,
}

impl Path {
    /// Whether it is a name alone.
    pub(crate) fn is_name(&self) -> bool {
        self.fields.is_empty() && self.elements.is_empty() && self.member.is_none()
    }

    /// What stands behind the dot, if it is two names alone.
    pub(crate) fn part(&self) -> Option<&Name> {
        match (self.fields.as_slice(), self.elements.as_slice()) {
            ([part], []) if self.member.is_none() => Some(part),
            _ => None,
        }
    }
}

/// One step into a message.
#[derive(Debug, Clone)]
pub(crate) enum Step {
    Field(Name),
    /// `[3]`; the span includes the brackets.
    Element(Count, Span),
    /// `[3..5]`, both included.
    Elements(Count, Count, Span),
    /// `[*]`
    Each(Span),
    /// `[name == "elbow"]`, `[* < 0.5m]`
    Filter(Box<Filter>),
}

impl Step {
    /// Where it is written.
    pub(crate) fn span(&self) -> Span {
        match self {
            Step::Field(name) => name.span,
            Step::Element(_, span) | Step::Elements(_, _, span) | Step::Each(span) => *span,
            Step::Filter(filter) => filter.span,
        }
    }
}

/// Which elements of a list pass.
#[derive(Debug, Clone)]
pub(crate) struct Filter {
    /// What is compared: the element itself, or the field at the end of this path.
    pub(crate) key: Vec<Name>,
    /// Where that is written.
    pub(crate) key_span: Span,
    pub(crate) by: Relation,
    pub(crate) with: ComparedWith,
    /// With the brackets.
    pub(crate) span: Span,
}

/// What the elements of a list are compared with.
#[derive(Debug, Clone)]
pub(crate) enum ComparedWith {
    Number(Quantity),
    Text(Text),
    Truth(bool, Span),
    /// The name of a constant.
    Constant(Path),
}

/// Three numbers of one unit.
#[derive(Debug)]
pub(crate) struct Point {
    /// Each with the point's unit.
    pub(crate) coordinates: [Quantity; 3],
    pub(crate) span: Span,
}

/// A place in the messages of a topic.
#[derive(Debug, Clone)]
pub(crate) struct Path {
    pub(crate) topic: Name,
    /// Fields, up to the first list of which an element is chosen.
    pub(crate) fields: Vec<Name>,
    /// From the first choice of elements on.
    pub(crate) elements: Vec<Step>,
    /// The member of a group, if its name is in brackets. A number may be one too; then it is the first of `elements`.
    pub(crate) member: Option<Member>,
    pub(crate) span: Span,
}

#[derive(Debug)]
pub(crate) enum Bound {
    Compare(Comparison, Quantity),
    /// With the number of a constant.
    Constant(Comparison, Path),
    Within(Range),
}

#[derive(Debug, Clone, Copy)]
pub(crate) enum Comparison {
    AtMost,
    Below,
    AtLeast,
    Above,
    Equal,
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::span::FileId;

    #[test]
    fn braces_of_the_program_s_own_are_no_placeholders() {
        let text = r#"{"a": 1} {worker} ${HOME}x{ros-args}{} {2} {a b} {{seed}} {start_x2} {2x} {é} {open"#;
        let file = format!("\"{}\"", text.replace('"', "\\\""));
        let hi = u32::try_from(file.len()).unwrap();
        let written = Text { text: text.to_owned(), span: Span { file: FileId(0), lo: 0, hi } };
        let words: Vec<_> = written.placeholders().collect();
        let names: Vec<&str> = words.iter().map(|(word, _)| *word).collect();
        assert_eq!(names, ["worker", "HOME", "ros-args", "seed", "start_x2", "é"]);
        for (word, span) in words {
            let Span { lo, hi, .. } = span.unwrap();
            assert_eq!(&file[lo as usize..hi as usize], word);
        }
    }
}
