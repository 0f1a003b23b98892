//! Parameters of the simulator: what a scenario is, and may vary from test to test.

use super::Resolver;
use crate::diagnostic::{Code, Diagnostic};
use crate::model::{ChoiceKind, Domain, OperationKind, Parameter};
use crate::span::Span;
use crate::syntax::ast::{self, Name};

impl<'a> Resolver<'a> {
    /// The operation that sets a parameter, and what a test may choose for it.
    pub(super) fn scene(&mut self, name: &'a Name, scene: &'a ast::Scene) -> Option<(OperationKind, Parameter)> {
        let takes_parameters = self.takes_parameters(name.span);
        let ends = [scene.range.low.unit.as_ref(), scene.range.high.unit.as_ref()];
        let unit = self.declared_unit([scene.unit.as_ref(), ends[0], ends[1]])?;
        let what = format!("`{}`", name.text);
        let permitted = self.range(&scene.range, unit.as_ref(), &what)?;
        let usual = match &scene.usual {
            Some(usual) => Some(self.value(usual, unit.as_ref(), &what)?),
            None => None,
        };
        let mut whole = true;
        if scene.integer {
            whole &= self.whole(permitted.low, scene.range.low.span, &what);
            whole &= self.whole(permitted.high, scene.range.high.span, &what);
            if let (Some(value), Some(written)) = (usual, &scene.usual) {
                whole &= self.whole(value, written.span, &what);
            }
        }
        self.one_value(permitted, scene.range.span);
        let known_as = match &scene.known_as {
            // An empty text was reported where it was read.
            Some(text) if text.text.trim().is_empty() => return None,
            Some(text) => text.text.clone(),
            None => name.text.clone(),
        };
        let domain = Domain::Number { range: permitted, shape: ChoiceKind::Value, integer: scene.integer };
        let value = Parameter { name: "value".to_owned(), doc: String::new(), unit, domain };
        (takes_parameters && whole).then_some((OperationKind::Scene { parameter: known_as, usual }, value))
    }

    /// Reports a simulator that takes no parameters.
    fn takes_parameters(&mut self, span: Span) -> bool {
        let Some((word, simulator)) = self.without(|kind| kind.takes_parameters) else { return true };
        let title = format!("simulator kind `{word}` takes no parameters");
        let diagnostic = Diagnostic::new(Code::NODE_OUT_OF_REACH, span, title)
            .label("only `in_process`, `process` and `ros2` simulators begin a run with other values")
            .secondary(simulator, "the simulator is declared here")
            .note("a custom operation `before start` can change the files with which a system starts");
        self.report(diagnostic);
        false
    }
}
