//! What formulas read of messages, as it is written: a path, a word before it, and functions of successive messages
//! around it.

use crate::span::Span;
use crate::syntax::ast::{self, ExpressionKind, Name, Path};

/// What a function computes from the values of successive messages.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Remembers {
    Previous,
    Rate,
    Integral,
    Unwrapped,
}

/// The functions of successive messages.
const FUNCTIONS: [(&str, Remembers); 4] = [
    ("previous", Remembers::Previous),
    ("rate", Remembers::Rate),
    ("integral", Remembers::Integral),
    ("unwrapped", Remembers::Unwrapped),
];

/// What a formula reads of messages, as it is written.
pub(super) struct Read<'a> {
    pub(super) path: &'a Path,
    /// The word before the path.
    pub(super) word: Option<(ast::Members, Span)>,
    /// What is computed from successive values, the innermost first, with the name that it has.
    pub(super) memory: Vec<(Remembers, &'a Name)>,
}

impl<'a> Read<'a> {
    /// What a path alone stands for.
    pub(super) fn plain(path: &'a Path) -> Self {
        Read { path, word: None, memory: Vec::new() }
    }
}

/// What is computed from successive values by a function of this name.
pub(super) fn memory_named(name: &str) -> Option<Remembers> {
    FUNCTIONS.into_iter().find(|(known, _)| *known == name).map(|(_, remembers)| remembers)
}

/// What an expression reads of messages, if that is all it is.
pub(super) fn read_in(expression: &ast::Expression) -> Option<Read<'_>> {
    let (memory, of) = computed(expression);
    let (path, word) = match &of.kind {
        ExpressionKind::Field(path) => (path, None),
        ExpressionKind::Members(members, word, path) => (path, Some((*members, *word))),
        _ => return None,
    };
    Some(Read { path, word, memory })
}

/// What an expression computes from successive values of another one, the innermost first, and that one.
pub(super) fn computed(expression: &ast::Expression) -> (Vec<(Remembers, &Name)>, &ast::Expression) {
    let (mut memory, mut of) = (Vec::new(), expression);
    while let ExpressionKind::Call(name, arguments) = &of.kind
        && let ([argument], Some(next)) = (arguments.as_slice(), memory_named(&name.text))
    {
        memory.push((next, name));
        of = argument;
    }
    memory.reverse();
    (memory, of)
}
