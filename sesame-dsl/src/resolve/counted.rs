//! Which messages an operation alters while it is active: the clauses `next` and `every`.

use sesame_plan::Counted;

use super::Resolver;
use crate::diagnostic::{Code, Diagnostic};
use crate::model::{ChoiceKind, Domain, OperationKind, Parameter, Range};
use crate::span::Span;
use crate::syntax::ast;

impl<'a> Resolver<'a> {
    /// By what a test counts messages, with the parameters for that, in the order of a plan.
    pub(super) fn counted(
        &mut self,
        body: &'a ast::OperationBody,
        kind: &OperationKind,
    ) -> Option<Vec<(Counted, Parameter)>> {
        let mut found = Vec::new();
        let mut complete = true;
        for by in [Counted::Next, Counted::Every] {
            let clauses: Vec<&(Counted, Span, ast::Range)> =
                body.counted.iter().filter(|(counted, ..)| *counted == by).collect();
            let spans: Vec<Span> = clauses.iter().map(|(_, word, _)| *word).collect();
            self.at_most_one(&spans, by.name());
            let Some((_, word, range)) = clauses.first() else { continue };
            match self.count_of_messages(by, *word, range, kind) {
                Some(parameter) => found.push((by, parameter)),
                None => complete = false,
            }
        }
        complete.then_some(found)
    }

    fn count_of_messages(
        &mut self,
        by: Counted,
        word: Span,
        written: &'a ast::Range,
        kind: &OperationKind,
    ) -> Option<Parameter> {
        let name = by.name();
        if !kind.acts_on_messages() {
            let title = format!("`{name}` has no effect on `{}`", kind.words());
            let diagnostic = Diagnostic::new(Code::IDLE_CLAUSE, word.to(written.span), title)
                .label("remove this")
                .note("only operations on messages and on values in them can count messages");
            self.report(diagnostic);
            return None;
        }
        let what = format!("`{name}`");
        let range = self.range(written, None, &what)?;
        let all = Range { low: 1.0, high: Counted::MOST };
        let whole = self.whole(range.low, written.low.span, &what) & self.whole(range.high, written.high.span, &what);
        if !whole
            || !self.inside(range, written.span, all, "the number of messages", "1 or more, up to a billion", None)
        {
            return None;
        }
        let domain = Domain::Number { range, shape: ChoiceKind::Value, integer: true };
        Some(Parameter { name: name.to_owned(), doc: String::new(), unit: None, domain })
    }
}
