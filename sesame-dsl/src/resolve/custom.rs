//! Custom operations: what their parameters permit, and when their code is called.

use std::collections::BTreeMap;

use super::Resolver;
use crate::diagnostic::{Code, Diagnostic, Suggestion};
use crate::model::{self, ChoiceKind, Domain, Moment, OperationKind, Parameter, Target};
use crate::span::Span;
use crate::syntax::ast;
use crate::units::Unit;

impl<'a> Resolver<'a> {
    pub(super) fn custom(
        &mut self,
        custom: &'a ast::Custom,
        body: &'a ast::OperationBody,
    ) -> Option<(Vec<Target>, OperationKind, Vec<Parameter>)> {
        let parameters = self.custom_parameters(custom);
        let (targets, moment) = match (self.at_most_one_topic(&body.targets)?, custom.moment) {
            (Some(topic), None) => {
                (vec![self.whole_messages(topic, "a custom operation receives")?], Moment::OnMessage)
            }
            (None, Some((_, ast::Moment::BeforeStart))) => (Vec::new(), Moment::BeforeStart),
            (None, Some((_, ast::Moment::AfterEnd))) => (Vec::new(), Moment::AfterEnd),
            (Some(topic), Some((moment, _))) => {
                let title = format!("an operation `{}` cannot have a topic", self.text(moment));
                let diagnostic = Diagnostic::new(Code::WRONG_TYPE, topic.span, title)
                    .label("remove `on` and the topic")
                    .secondary(moment, "no messages are sent at this time");
                self.report(diagnostic);
                return None;
            }
            (None, None) => {
                let title = "a custom operation needs a topic, `before start` or `after end`";
                let diagnostic = Diagnostic::new(Code::CLAUSE_MISSING, custom.span, title)
                    .label("add `on` and a topic before the `=`, or `before start` or `after end` after `custom`");
                self.report(diagnostic);
                return None;
            }
        };
        let mut complete = true;
        if targets.is_empty() {
            let within = body.within.first().map(|(span, _)| (*span, "within"));
            let lengths = body.lengths.first().map(|(span, _)| (*span, "for"));
            let contains = body.contains.first().map(|(span, _)| (*span, "start contains"));
            for (span, word) in within.into_iter().chain(lengths).chain(contains) {
                let title =
                    format!("`{word}` has no effect on an operation before the start or after the end of a run");
                self.report(Diagnostic::new(Code::BAD_WINDOW, span, title).label("remove this"));
                complete = false;
            }
        }
        let parameters = parameters?;
        complete.then_some((targets, OperationKind::Custom { moment }, parameters))
    }

    fn custom_parameters(&mut self, custom: &'a ast::Custom) -> Option<Vec<Parameter>> {
        let mut first: BTreeMap<&str, Span> = BTreeMap::new();
        let mut parameters = Vec::new();
        for written in &custom.parameters {
            let name = &written.name;
            if let Some(&before) = first.get(name.text.as_str()) {
                let title = format!("parameter `{}` is defined twice", name.text);
                self.defined_twice(title, name.span, before);
                continue;
            }
            first.insert(&name.text, name.span);
            let resolved = self.domain(&written.domain, &format!("`{}`", name.text));
            parameters.extend(resolved.map(|(unit, domain)| Parameter {
                name: name.text.clone(),
                doc: written.doc.clone(),
                unit,
                domain,
            }));
        }
        (parameters.len() == custom.parameters.len() && !custom.has_errors).then_some(parameters)
    }

    fn domain(&mut self, domain: &'a ast::Domain, what: &str) -> Option<(Option<Unit>, Domain)> {
        match domain {
            ast::Domain::Number { integer, unit, range } => {
                let unit = self.declared_unit([unit.as_ref(), range.low.unit.as_ref(), range.high.unit.as_ref()])?;
                let permitted = self.range(range, unit.as_ref(), what)?;
                if *integer {
                    let low = self.whole(permitted.low, range.low.span, what);
                    if !self.whole(permitted.high, range.high.span, what) || !low {
                        return None;
                    }
                }
                self.one_value(permitted, range.span);
                Some((unit, Domain::Number { range: permitted, shape: ChoiceKind::Value, integer: *integer }))
            }
            ast::Domain::Point { unit, corners } => {
                let [low, high] = &**corners;
                let [of_low, of_high] = [low, high].map(|point| point.coordinates[0].unit.as_ref());
                let unit = self.declared_unit([unit.as_ref(), of_low, of_high])?;
                let (from, to) = self.corners(corners, unit.as_ref(), what)?;
                Some((unit, Domain::Point { low: from, high: to }))
            }
            ast::Domain::Texts(texts) => Some((None, Domain::Texts(self.items(texts)?))),
            ast::Domain::Files(texts) => {
                let paths = self.items(texts)?;
                let good = texts.iter().filter(|text| self.is_path(text)).count();
                (good == texts.len()).then_some((None, Domain::Files(paths)))
            }
        }
    }

    /// Two opposite corners of a box in a unit, the lower one first.
    pub(super) fn corners(
        &mut self,
        corners: &[ast::Point; 2],
        unit: Option<&Unit>,
        what: &str,
    ) -> Option<([f64; 3], [f64; 3])> {
        let [low, high] = corners;
        if let (None, None, Some(unit)) = (&low.coordinates[0].unit, &high.coordinates[0].unit, unit) {
            let title = format!("`{}` and `{}` have no unit", self.text(low.span), self.text(high.span));
            let mut diagnostic = Diagnostic::new(Code::WRONG_UNIT, low.span.to(high.span), title)
                .label(format!("{what} is in `{}`", unit.text()));
            let edits = corners.iter().map(|point| (point.span.end(), unit.text().to_owned())).collect();
            let message = format!("add the unit `{}`", unit.text());
            diagnostic.suggestions.push(Suggestion::possible(message, edits));
            self.report(diagnostic);
            return None;
        }
        let from = self.coordinates(low, unit, what);
        let to = self.coordinates(high, unit, what);
        let [from, to] = [from?, to?];
        let mut complete = true;
        for axis in 0..3 {
            if from[axis] > to[axis] {
                let [a, b] = [low, high].map(|point| self.text(point.coordinates[axis].span).to_owned());
                let title = format!("this box is reversed along its {} axis", ["x", "y", "z"][axis]);
                let diagnostic = Diagnostic::new(Code::REVERSED_RANGE, low.coordinates[axis].span.to(high.span), title)
                    .label(format!("`{a}` is greater than `{b}`"));
                self.report(diagnostic);
                complete = false;
            }
        }
        complete.then_some((from, to))
    }

    /// The first unit that is written, if any; the outer `None` for one that does not exist.
    #[expect(clippy::option_option, reason = "the outer `None` means a mistake")]
    pub(super) fn declared_unit(&mut self, written: [Option<&ast::UnitName>; 3]) -> Option<Option<Unit>> {
        match written.into_iter().flatten().next() {
            Some(name) => self.unit(name).map(Some),
            None => Some(None),
        }
    }

    /// The coordinates of a point in a unit.
    pub(super) fn coordinates(&mut self, point: &ast::Point, unit: Option<&Unit>, what: &str) -> Option<[f64; 3]> {
        if let (None, Some(unit)) = (&point.coordinates[0].unit, unit) {
            let title = format!("`{}` has no unit", self.text(point.span));
            let diagnostic = Diagnostic::new(Code::WRONG_UNIT, point.span, title)
                .label(format!("{what} is in `{}`", unit.text()))
                .suggest(format!("add the unit `{}`", unit.text()), point.span.end(), unit.text());
            self.report(diagnostic);
            return None;
        }
        let mut coordinates = [0.0; 3];
        for (coordinate, written) in coordinates.iter_mut().zip(&point.coordinates) {
            // One unit for all three: a mistake in it is reported once.
            *coordinate = self.value(written, unit, what)?;
        }
        Some(coordinates)
    }

    pub(super) fn items(&mut self, texts: &'a [ast::Text]) -> Option<Vec<String>> {
        let mut first: BTreeMap<&str, Span> = BTreeMap::new();
        let mut complete = true;
        for text in texts {
            if let Some(before) = first.insert(&text.text, text.span) {
                self.listed_twice(text.span, before);
                complete = false;
            }
        }
        complete.then(|| texts.iter().map(|text| text.text.clone()).collect())
    }

    /// Whether a text is the path of a file below the space's folder.
    fn is_path(&mut self, text: &ast::Text) -> bool {
        let plain = |part: &str| !part.is_empty() && part != "." && part != "..";
        let good = text.text.split('/').all(plain) && !text.text.contains(['\\', ':', '\0']);
        if !good {
            let title = format!("`{}` is not the path of a file below the folder of the space", self.text(text.span));
            let diagnostic = Diagnostic::new(Code::BAD_PATH, text.span, title)
                .label("expected a path such as `config/calibration.yaml`");
            self.report(diagnostic);
        }
        good
    }

    /// Whether a test gives an operation `before start` or `after end` exactly if the operation acts then.
    pub(super) fn fits_moment(
        &mut self,
        test: &'a ast::TestOperation,
        index: usize,
        operation: &model::Operation,
    ) -> bool {
        let declared = match &operation.kind {
            OperationKind::Custom { moment: Moment::BeforeStart } | OperationKind::Scene { .. } => {
                ast::Moment::BeforeStart
            }
            OperationKind::Custom { moment: Moment::AfterEnd } => ast::Moment::AfterEnd,
            _ => return self.no_moment(test, index),
        };
        let span = match &test.activation {
            ast::Activation::Moment(_, written) if *written == declared => return true,
            ast::Activation::Moment(span, _) => *span,
            ast::Activation::Window(window) => window.span,
            ast::Activation::Trigger(trigger) => trigger.start.span,
        };
        let (words, when) = match declared {
            ast::Moment::BeforeStart => ("before start", "before the start of a run"),
            ast::Moment::AfterEnd => ("after end", "after the end of a run"),
        };
        let title = format!("`{}` acts {when}", test.operation.text);
        let diagnostic = Diagnostic::new(Code::BAD_WINDOW, span, title).label(format!("expected `{words}`"));
        self.report(diagnostic);
        false
    }

    fn no_moment(&mut self, test: &'a ast::TestOperation, index: usize) -> bool {
        let ast::Activation::Moment(span, _) = test.activation else { return true };
        let title = format!("`{}` acts during a run", test.operation.text);
        let declared = self.file.operations[index].head.name.span;
        let diagnostic = Diagnostic::new(Code::BAD_WINDOW, span, title)
            .label("expected a window such as `from 8s to 57s`, or `when` and a condition")
            .secondary(declared, "declared here");
        self.report(diagnostic);
        false
    }
}
