//! Words and numbers of the syntax tree: names, texts, quantities, doc comments.

use sesame_grammar::Rule;

use super::reader::{Pair, Reader, child, children, comparison, expect_child};
use crate::diagnostic::{Code, Diagnostic};
use crate::span::Span;
use crate::syntax::ast::{
    ComparedWith, Count, Filter, Head, Member, Name, Path, Point, Quantity, Range, Relation, Step, Text, UnitName,
    WithMember,
};

impl Reader<'_> {
    pub(super) fn head(&mut self, pair: &Pair<'_>) -> Head {
        Head { name: self.name(&expect_child(pair, Rule::name)), doc: Self::doc(pair), full_span: self.full_span(pair) }
    }

    /// All of a declaration but its doc comment.
    pub(super) fn full_span(&self, pair: &Pair<'_>) -> Span {
        self.keyword_span(pair).to(self.span(pair).end())
    }

    pub(super) fn doc(pair: &Pair<'_>) -> String {
        let docs = expect_child(pair, Rule::docs);
        let lines = children(&docs, Rule::doc).map(|doc| {
            let line = doc.as_str().trim_start_matches("///").trim_end();
            line.strip_prefix(' ').unwrap_or(line).to_owned()
        });
        lines.collect::<Vec<_>>().join("\n")
    }

    pub(super) fn names(&mut self, pair: &Pair<'_>) -> Vec<Name> {
        let names = expect_child(pair, Rule::names);
        children(&names, Rule::name).map(|name| self.name(&name)).collect()
    }

    pub(super) fn with_members(&mut self, pair: &Pair<'_>) -> Vec<WithMember> {
        let listed = expect_child(pair, Rule::with_members);
        children(&listed, Rule::with_member).map(|one| self.with_member(&one)).collect()
    }

    pub(super) fn with_member(&mut self, pair: &Pair<'_>) -> WithMember {
        let member = child(pair, Rule::one_member).map(|member| {
            let name = match (child(&member, Rule::member_name), child(&member, Rule::number)) {
                (Some(name), _) => Some(self.member_name(&name)),
                (None, number) => number.map(|number| number.as_str().to_owned()),
            };
            Member { name, span: self.span(&member) }
        });
        WithMember { name: self.name(&expect_child(pair, Rule::name)), member, span: self.span(pair) }
    }

    fn member_name(&mut self, pair: &Pair<'_>) -> String {
        match child(pair, Rule::text) {
            Some(text) => self.text_of(&text).text,
            None => pair.as_str().to_owned(),
        }
    }

    pub(super) fn metric_names(&mut self, pair: &Pair<'_>) -> Vec<Name> {
        let names = expect_child(pair, Rule::metric_names);
        children(&names, Rule::metric_name).map(|name| self.metric_name(&name)).collect()
    }

    /// The name of a metric, or that of a part of a monitor, with the monitor's before a dot.
    pub(super) fn metric_name(&mut self, pair: &Pair<'_>) -> Name {
        self.name(pair)
    }

    pub(super) fn name(&mut self, pair: &Pair<'_>) -> Name {
        let name = Name { text: pair.as_str().to_owned(), span: self.span(pair) };
        let starts = name.text.starts_with(|first: char| first.is_ascii_alphabetic());
        if !starts || !name.text.is_ascii() {
            self.bad_name(&name, "a name begins with an ASCII letter and continues with ASCII letters, digits and `_`");
        }
        name
    }

    pub(super) fn field_name(&mut self, pair: &Pair<'_>) -> Name {
        let name = Name { text: pair.as_str().to_owned(), span: self.span(pair) };
        if !name.text.is_ascii() || !name.text.contains(|c: char| c.is_ascii_alphanumeric()) {
            self.bad_name(
                &name,
                "the name of a field consists of ASCII letters, digits and `_`, with at least one letter or digit",
            );
        }
        name
    }

    fn bad_name(&mut self, name: &Name, rule: &str) {
        let title = format!("`{}` is not a valid name", name.text);
        let label = match name.text.chars().find(|c| !c.is_ascii()) {
            Some(c) => format!("`{c}` is not ASCII"),
            None => "begins with `_`".to_owned(),
        };
        self.report(Diagnostic::new(Code::NOT_A_NAME, name.span, title).label(label).note(rule));
    }

    pub(super) fn path(&mut self, pair: &Pair<'_>) -> Path {
        let mut path = Path {
            topic: self.name(&expect_child(pair, Rule::name)),
            fields: Vec::new(),
            elements: Vec::new(),
            member: None,
            span: self.span(pair),
        };
        for step in pair.clone().into_inner() {
            match step.as_rule() {
                Rule::element if child(&step, Rule::member_name).is_some() => {
                    let name = self.member_name(&expect_child(&step, Rule::member_name));
                    let member = Member { name: Some(name), span: self.span(&step) };
                    if let Some(first) = path.member.replace(member) {
                        let title = "a path names one member of a group";
                        let diagnostic = Diagnostic::new(Code::LISTED_TWICE, self.span(&step), title)
                            .label("another member")
                            .secondary(first.span, "the first one");
                        self.report(diagnostic);
                    }
                }
                Rule::field_name if path.elements.is_empty() => path.fields.push(self.field_name(&step)),
                Rule::field_name => path.elements.push(Step::Field(self.field_name(&step))),
                Rule::element => path.elements.push(self.element(&step)),
                _ => {}
            }
        }
        path
    }

    fn element(&mut self, pair: &Pair<'_>) -> Step {
        let span = self.span(pair);
        if let Some(range) = child(pair, Rule::element_range) {
            let mut ends = children(&range, Rule::number).map(|end| self.count(&end)).collect::<Vec<_>>();
            let last = ends.pop().expect("a range has two ends");
            let first = ends.pop().expect("a range has two ends");
            return Step::Elements(first, last, span);
        }
        if let Some(filter) = child(pair, Rule::element_filter) {
            return Step::Filter(Box::new(self.filter(&filter, span)));
        }
        match child(pair, Rule::number) {
            Some(number) => Step::Element(self.count(&number), span),
            None => Step::Each(span),
        }
    }

    fn filter(&mut self, pair: &Pair<'_>, span: Span) -> Filter {
        let key = child(pair, Rule::element_key).or_else(|| child(pair, Rule::each_element));
        let key = key.expect("a filter says what it compares");
        let with = if let Some(text) = child(pair, Rule::text) {
            ComparedWith::Text(self.any_text(&text))
        } else if let Some(truth) = child(pair, Rule::truth) {
            ComparedWith::Truth(child(&truth, Rule::k_true).is_some(), self.span(&truth))
        } else if let Some(constant) = child(pair, Rule::constant_name) {
            ComparedWith::Constant(self.path(&constant))
        } else {
            ComparedWith::Number(self.signed(&expect_child(pair, Rule::signed)))
        };
        Filter {
            key: children(&key, Rule::field_name).map(|name| self.field_name(&name)).collect(),
            key_span: self.span(&key),
            by: comparison(pair).map_or(Relation::NotEqual, Relation::Comparison),
            with,
            span,
        }
    }

    pub(super) fn unit(&mut self, pair: &Pair<'_>) -> UnitName {
        UnitName { text: pair.as_str().to_owned(), span: self.span(pair) }
    }

    pub(super) fn range(&mut self, pair: &Pair<'_>) -> Range {
        let mut ends = children(pair, Rule::signed).map(|end| self.signed(&end)).collect::<Vec<_>>();
        let high = ends.pop().expect("a range has two ends");
        let low = ends.pop().expect("a range has two ends");
        Range { low, high, span: self.span(pair) }
    }

    pub(super) fn point(&mut self, pair: &Pair<'_>) -> Point {
        let mut unit = child(&expect_child(pair, Rule::point_end), Rule::unit).map(|unit| self.unit(&unit));
        let mut written = children(pair, Rule::coordinate).map(|coordinate| self.signed(&coordinate));
        let mut next = || written.next().expect("a point has three coordinates");
        let mut coordinates = [next(), next(), next()];
        drop(written);
        if let Some(own) = coordinates.iter().find_map(|coordinate| coordinate.unit.clone()) {
            let title = "the unit of a point is given once, after the `)`";
            let diagnostic = Diagnostic::new(Code::WRONG_UNIT, own.span, title);
            self.report(match unit {
                Some(_) => diagnostic.label("unexpected unit").suggest("remove the unit", own.span, ""),
                None => diagnostic.label("move the unit after the `)`").note("for example `(1, 0, -0.5)m`"),
            });
            unit = unit.or(Some(own));
        }
        for coordinate in &mut coordinates {
            coordinate.unit.clone_from(&unit);
        }
        Point { coordinates, span: self.span(pair) }
    }

    pub(super) fn signed(&mut self, pair: &Pair<'_>) -> Quantity {
        let mut signed = self.quantity(&expect_child(pair, Rule::quantity));
        signed.span = self.span(pair);
        if child(pair, Rule::minus).is_some() && signed.value != 0.0 {
            signed.value = -signed.value;
        }
        signed
    }

    pub(super) fn quantity(&mut self, quantity: &Pair<'_>) -> Quantity {
        let span = self.span(quantity);
        let number = expect_child(quantity, Rule::number);
        let mut value: f64 = number.as_str().parse().expect("the grammar's numbers are Rust's");
        if !value.is_finite() {
            let title = format!("`{}` is too large", number.as_str());
            let diagnostic = Diagnostic::new(Code::BAD_NUMBER, self.span(&number), title);
            self.report(diagnostic.label("greater than 1.8e308"));
            value = f64::NAN;
        }
        Quantity { value, unit: child(quantity, Rule::unit).map(|unit| self.unit(&unit)), span }
    }

    pub(super) fn count(&mut self, pair: &Pair<'_>) -> Count {
        let span = self.span(pair);
        let value = pair.as_str().parse::<u64>().ok();
        if value.is_none() {
            let title = format!("`{}` is not a valid count or seed", pair.as_str());
            let label = "expected a whole number of at most 18446744073709551615";
            self.report(Diagnostic::new(Code::BAD_NUMBER, span, title).label(label));
        }
        Count { value, span }
    }

    /// A text that names something, so it is not empty.
    pub(super) fn text_of(&mut self, pair: &Pair<'_>) -> Text {
        let text = self.any_text(pair);
        if text.text.trim().is_empty() {
            let diagnostic = Diagnostic::new(Code::BAD_TEXT, text.span, "this text is empty")
                .label("expected at least one visible character");
            self.report(diagnostic);
        }
        text
    }

    /// A text, which may be empty.
    pub(super) fn any_text(&mut self, pair: &Pair<'_>) -> Text {
        let span = self.span(pair);
        let inner = expect_child(pair, Rule::text_inner);
        let mut text = String::new();
        let mut characters = inner.as_str().char_indices();
        while let Some((offset, c)) = characters.next() {
            if c != '\\' {
                text.push(c);
                continue;
            }
            let (_, escaped) = characters.next().expect("the grammar has a character after each backslash");
            text.push(escaped);
            if !matches!(escaped, '"' | '\\') {
                let at = inner.as_span().start() + offset;
                let span = self.span_of(at, at + 1 + escaped.len_utf8());
                let title = format!("unknown escape `\\{escaped}` in a text");
                let diagnostic =
                    Diagnostic::new(Code::BAD_TEXT, span, title).label("the only escapes are `\\\"` and `\\\\`");
                self.report(diagnostic.fix("write `\\\\` for a backslash", span, format!("\\\\{escaped}")));
            }
        }
        Text { text, span }
    }
}
