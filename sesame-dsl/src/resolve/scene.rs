//! Parameters of the simulator or of launched programs: what a scenario is, and may vary from test to test.

use super::formula::Number;
use super::{Definition, Kind, Resolver};
use crate::diagnostic::{Code, Diagnostic, Suggestion};
use crate::model::{ChoiceKind, Domain, Expression, OperationKind, Parameter};
use crate::span::Span;
use crate::syntax::ast::{self, Name, Path, UnitName};

impl<'a> Resolver<'a> {
    /// The operation that sets a parameter, and what a test may choose for it.
    pub(super) fn scene(&mut self, name: &'a Name, scene: &'a ast::Scene) -> Option<(OperationKind, Parameter)> {
        let in_arguments = self.in_arguments.get(&name.text).copied();
        let is_given = match in_arguments {
            Some(place) => self.can_be_in_arguments(name, scene, place),
            None => self.takes_parameters(name),
        };
        let unit = self.declared_unit(units_of(scene))?;
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
        let parameter = in_arguments.is_none().then_some(known_as);
        (is_given && whole).then_some((OperationKind::Scene { parameter, usual }, value))
    }

    /// Reports a parameter that launched programs cannot have in their arguments.
    fn can_be_in_arguments(&mut self, name: &Name, scene: &ast::Scene, place: Span) -> bool {
        let (text, head) = (&name.text, "a launched program has it in its arguments");
        let mut sound = true;
        if let Some(known_as) = &scene.known_as {
            let title = format!("`{text}` is given to launched programs, not to the simulator");
            let diagnostic = Diagnostic::new(Code::PLACEHOLDER, known_as.span, title)
                .label("the simulator is not asked for a parameter of this name; remove it")
                .secondary(place, head);
            self.report(diagnostic);
            sound = false;
        }
        if scene.usual.is_none() {
            let title = format!("`{text}` needs a `default`");
            let end = scene.range.span.end();
            let low = self.text(scene.range.low.span);
            let diagnostic = Diagnostic::new(Code::CLAUSE_MISSING, name.span, title)
                .label("programs would be launched without its value in tests that do not choose it")
                .secondary(place, head)
                .suggest("add the value of the undisturbed run", end, format!(" default {low}"));
            self.report(diagnostic);
            sound = false;
        }
        sound
    }

    /// The parameter of the space with this name, and where it is declared.
    pub(super) fn scene_named(&self, name: &str) -> Option<(Span, &'a ast::Scene)> {
        let Definition { kind, index, span } = *self.names.get(name)?;
        if kind != Kind::Operation {
            return None;
        }
        match &self.file.operations.get(index)?.body.kind {
            ast::OperationKind::Scene(scene) => Some((span, scene)),
            _ => None,
        }
    }

    /// The parameter of the space that a path is.
    pub(super) fn scene_at(&self, path: &Path) -> Option<&'a ast::Scene> {
        self.scene_named(&path.topic.text).filter(|_| path.is_name()).map(|(_, scene)| scene)
    }

    /// The value of a parameter in a formula: what the test chose, or else its usual value, without which it is
    /// reported. Mistakes of the declaration are reported there.
    pub(super) fn value_of_scene(&mut self, path: &'a Path, scene: &'a ast::Scene) -> Option<Number> {
        let name = &path.topic.text;
        let Some(usual) = &scene.usual else {
            let title = format!("`{name}` has no value in tests that do not choose one");
            let low = self.text(scene.range.low.span);
            let mut diagnostic = Diagnostic::new(Code::CLAUSE_MISSING, path.span, title)
                .label("a formula needs its value in every test")
                .secondary(scene.range.span, "declared without `default`");
            let add = format!("add the value with which such tests begin, such as `default {low}`");
            let after = scene.range.span.end();
            diagnostic.suggestions.push(Suggestion::possible(add, vec![(after, format!(" default {low}"))]));
            self.report(diagnostic);
            return None;
        };
        let before = self.diagnostics.len();
        let number = self.declared_unit(units_of(scene)).and_then(|unit| {
            let usual = self.value(usual, unit.as_ref(), &format!("`{name}`"))?;
            Some((Expression::Scene { operation: name.clone(), usual }, unit))
        });
        self.diagnostics.truncate(before);
        number
    }

    /// Reports a simulator that takes no parameters.
    fn takes_parameters(&mut self, Name { text: name, span }: &Name) -> bool {
        let Some((word, simulator)) = self.without(|kind| kind.takes_parameters) else { return true };
        let title = format!("simulator kind `{word}` takes no parameters");
        let diagnostic = Diagnostic::new(Code::NODE_OUT_OF_REACH, *span, title)
            .label("only `in_process`, `process` and `ros2` simulators begin a run with other values")
            .secondary(simulator, "the simulator is declared here")
            .note(format!(
                "launched programs can have it in their arguments, as in `launch \"./robot\" \"{{{name}}}\"`"
            ))
            .note("a custom operation `before start` can change the files with which a system starts");
        self.report(diagnostic);
        false
    }
}

/// The units that say what the unit of a parameter is, the first of which does.
fn units_of(scene: &ast::Scene) -> [Option<&UnitName>; 3] {
    [scene.unit.as_ref(), scene.range.low.unit.as_ref(), scene.range.high.unit.as_ref()]
}
