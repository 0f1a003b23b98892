//! What operations disturb, and what tests may choose: each kind with its units and bounds.

use std::collections::BTreeMap;

use sesame_grammar::Rule;

use super::Resolver;
use super::elements::Place;
use super::quantity::is_of_times;
use super::words::type_in_words;
use crate::diagnostic::{Code, Diagnostic};
use crate::model::{
    ChoiceKind, Distribution, Domain, Drain, Id as _, MembersOf, NamedNumber, NotFinite, OperationKind, Parameter,
    Range, Step, Target, TopicId, Type, ValueMode,
};
use crate::span::Span;
use crate::syntax::ast;
use crate::units::{Dimension, Unit, dimension};

/// The most copies of a message that one operation makes.
const MOST_COPIES: f64 = 100.0;

/// The type of the values that an operation disturbs.
enum Held {
    Number { unit: Option<Unit>, integer: bool },
    Point { unit: Option<Unit> },
}

/// A place that an operation changes.
#[derive(Clone)]
struct Disturbed {
    topic: TopicId,
    /// The member of a group that is named.
    only: Option<u32>,
    steps: Vec<Step>,
    ty: Type,
}

/// What an operation disturbs, how, and with which parameters.
pub(super) type Resolved = (Target, OperationKind, Vec<Parameter>);

impl<'a> Resolver<'a> {
    /// An operation on messages, of any kind but a custom one.
    pub(super) fn disturbance(&mut self, target: &'a ast::Target, body: &'a ast::OperationBody) -> Option<Resolved> {
        match &body.kind {
            ast::OperationKind::OnNode(kind) => {
                self.needs_a_node(target, kind, body.kind_word);
                None
            }
            ast::OperationKind::Plain { rule: Rule::packet_loss, amounts: Some(ast::Amounts::Range(range)) }
                if is_of_times(range) =>
            {
                self.whole_messages(target, "packet loss drops");
                self.loss_of_times(range, body.kind_word);
                None
            }
            ast::OperationKind::Plain { rule, amounts } => self.plain(target, *rule, amounts.as_ref()),
            ast::OperationKind::Random { absolute, amounts } => self.random_value(target, *absolute, amounts),
            ast::OperationKind::RandomText(texts) => {
                let found = self.values(target, "a random text", "a `text`", |ty| matches!(ty, Type::Text));
                let items = self.items(texts)?;
                let (found, _) = found?;
                let fit = self.texts_fit(&found, target, texts);
                fit.then_some((found, OperationKind::RandomText { texts: items }, Vec::new()))
            }
            ast::OperationKind::RandomConstant(names) => {
                let (target, constants) = self.constants_put(target, "a random constant", names)?;
                Some((target, OperationKind::RandomConstant { constants }, Vec::new()))
            }
            ast::OperationKind::StuckAt(at) => self.stuck_at(target, at),
            ast::OperationKind::NotFinite(written) => {
                let wants = "a real number or a point";
                let real = |ty: &Type| matches!(ty, Type::Real(_) | Type::Point(_));
                let (target, _) = self.values(target, "this operation", wants, real)?;
                let number = match written {
                    ast::NotFinite::Nan => NotFinite::Nan,
                    ast::NotFinite::Infinity => NotFinite::Infinity,
                    ast::NotFinite::MinusInfinity => NotFinite::MinusInfinity,
                };
                Some((target, OperationKind::NotFinite { number }, Vec::new()))
            }
            ast::OperationKind::BurstLoss { span, enter, leave, loss } => {
                self.burst_loss(target, *span, [enter, leave, loss])
            }
            ast::OperationKind::Latency { range, distribution, drain } => {
                let target = self.whole_messages(target, "latency delays");
                if let [(first, _), (again, _), ..] = distribution.as_slice() {
                    let title = "a latency can have only one distribution";
                    let diagnostic = Diagnostic::new(Code::CLAUSE_TWICE, *again, title)
                        .label("remove one of the two")
                        .secondary(*first, "first given here");
                    self.report(diagnostic);
                }
                let (distribution, shape) = match distribution.first() {
                    None | Some((_, ast::Distribution::Fixed)) => (Distribution::Fixed, ChoiceKind::Value),
                    Some((_, ast::Distribution::Uniform)) => (Distribution::Uniform, ChoiceKind::Range),
                    Some((_, ast::Distribution::Normal)) => (Distribution::Normal, ChoiceKind::Range),
                };
                let drain = self.drain(drain);
                let domain = Domain::Number { range: self.times(range, "the delay")?, shape, integer: false };
                let unit = Some(Unit::seconds());
                let parameter = Parameter { name: "delay".to_owned(), doc: String::new(), unit, domain };
                Some((target?, OperationKind::Latency { distribution, drain }, vec![parameter]))
            }
            ast::OperationKind::Reorder { range, drain } => {
                let target = self.whole_messages(target, "reordering delays");
                let drain = self.drain(drain);
                let window = number("window", Some(Unit::seconds()), self.times(range, "the window")?);
                Some((target?, OperationKind::Reorder { drain }, vec![window]))
            }
            ast::OperationKind::Custom(_) | ast::OperationKind::Scene(_) => {
                unreachable!("what acts on no messages is resolved apart")
            }
        }
    }

    /// A kind of which the rule of the grammar says everything but the amount after its words.
    pub(super) fn plain(
        &mut self,
        target: &'a ast::Target,
        rule: Rule,
        amounts: Option<&'a ast::Amounts>,
    ) -> Option<Resolved> {
        match (rule, amounts) {
            (Rule::bias, Some(amounts)) => {
                let (target, held) = self.amounts_of(target, "a bias")?;
                let parameter = self.one_amount("bias", amounts, &held, &target)?;
                Some((target.found, OperationKind::Bias, vec![parameter]))
            }
            (Rule::drift, Some(amounts)) => {
                let (target, held) = self.amounts_of(target, "a drift")?;
                let per_second = |unit: Option<Unit>| {
                    let text = unit.map_or("Hz".to_owned(), |unit| format!("{}/s", unit.text()));
                    Some(Unit::parse(&text).expect("a unit of a field goes through being divided by a second"))
                };
                let rate = match held {
                    Held::Number { unit, .. } => Held::Number { unit: per_second(unit), integer: false },
                    Held::Point { unit } => Held::Point { unit: per_second(unit) },
                };
                let parameter = self.one_amount("rate", amounts, &rate, &target)?;
                Some((target.found, OperationKind::Drift, vec![parameter]))
            }
            (Rule::noise, Some(ast::Amounts::Range(range))) => {
                let (target, sigma) = self.sigma(target, "noise", range)?;
                Some((target, OperationKind::Noise, vec![sigma]))
            }
            (Rule::random_walk, Some(ast::Amounts::Range(range))) => {
                let (target, sigma) = self.sigma(target, "a random walk", range)?;
                Some((target, OperationKind::RandomWalk, vec![sigma]))
            }
            (Rule::scale, Some(ast::Amounts::Range(range))) => {
                let found = self.amounts_of(target, "a scale");
                let factor = self.range(range, None, "`factor`")?;
                Some((found?.0.found, OperationKind::Scale, vec![number("factor", None, factor)]))
            }
            (Rule::freeze, None) => {
                let (target, _) = self.values(target, "a freeze", "anything", |_| true)?;
                Some((whole_or_parts(target), OperationKind::Freeze, Vec::new()))
            }
            (Rule::stale_value, Some(ast::Amounts::Range(range))) => {
                let found = self.values(target, "a stale value", "anything", |_| true);
                let age = self.times(range, "the age")?;
                let parameter = number("age", Some(Unit::seconds()), age);
                Some((whole_or_parts(found?.0), OperationKind::Stale, vec![parameter]))
            }
            (Rule::clock_skew, Some(ast::Amounts::Range(range))) => self.clock_skew(target, range),
            (Rule::packet_loss, Some(ast::Amounts::Range(range))) => {
                let target = self.whole_messages(target, "packet loss drops");
                let loss = self.probabilities(range, "the loss")?;
                Some((target?, OperationKind::PacketLoss, vec![number("loss", None, loss)]))
            }
            (Rule::rate_limit, Some(ast::Amounts::Range(range))) => {
                let target = self.whole_messages(target, "a rate limit drops");
                let unit = Unit::parse("Hz").expect("`Hz` is in the table");
                let rate = self.range(range, Some(&unit), "the rate")?;
                let all = Range { low: f64::MIN_POSITIVE, high: f64::INFINITY };
                if !self.inside(rate, range.span, all, "a rate limit", "more than 0Hz", None) {
                    return None;
                }
                Some((target?, OperationKind::RateLimit, vec![number("rate", Some(unit), rate)]))
            }
            (Rule::duplicate, Some(ast::Amounts::Range(range))) => {
                let target = self.whole_messages(target, "duplication copies");
                let copies = self.range(range, None, "`copies`")?;
                let all = Range { low: 1.0, high: MOST_COPIES };
                if !self.whole_ends(copies, range, "`copies`")
                    || !self.inside(copies, range.span, all, "the number of copies", "1 to 100", None)
                {
                    return None;
                }
                let domain = Domain::Number { range: copies, shape: ChoiceKind::Value, integer: true };
                let parameter = Parameter { name: "copies".to_owned(), doc: String::new(), unit: None, domain };
                Some((target?, OperationKind::Duplicate, vec![parameter]))
            }
            (Rule::blackhole, None) => {
                Some((self.whole_messages(target, "a blackhole drops")?, OperationKind::Blackhole, Vec::new()))
            }
            (rule, _) => unreachable!("the grammar has no operation that is {rule:?} with this amount"),
        }
    }

    /// Reports a packet loss that is given as a time.
    fn loss_of_times(&mut self, range: &ast::Range, word: Span) {
        let written = self.text(range.span);
        let title = format!("`{written}` is a range of times, but the loss is a percentage in `%`");
        let meant = format!("blackhole for {written}");
        let diagnostic = Diagnostic::new(Code::WRONG_UNIT, range.span, title)
            .label("expected percentages such as `[0%, 100%]`")
            .suggest(format!("use `{meant}` to lose every message for a time"), word.to(range.span), meant);
        self.report(diagnostic);
    }

    /// The values of an operation that adds normally distributed numbers, and their standard deviation, which is in the
    /// unit of the values.
    fn sigma(&mut self, target: &'a ast::Target, user: &str, range: &'a ast::Range) -> Option<(Target, Parameter)> {
        let (target, held) = self.amounts_of(target, user)?;
        let (Held::Number { unit, .. } | Held::Point { unit }) = held;
        let sigma = self.range(range, unit.as_ref(), "`sigma`")?;
        let all = Range { low: 0.0, high: f64::INFINITY };
        let fits = self.inside(sigma, range.span, all, "a standard deviation", "0 or more", None);
        fits.then(|| (target.found, number("sigma", unit, sigma)))
    }

    fn burst_loss(
        &mut self,
        target: &'a ast::Target,
        span: Span,
        [enter, leave, loss]: [&'a [(Span, ast::Range)]; 3],
    ) -> Option<Resolved> {
        let target = self.whole_messages(target, "burst loss drops");
        let mut parameters = Vec::new();
        let mut complete = true;
        for (name, clauses, what) in [
            ("enter", enter, "the probability that a burst begins"),
            ("leave", leave, "the probability that a burst ends"),
            ("loss", loss, "the loss in a burst"),
        ] {
            match self.single(clauses, name) {
                Some(range) => match self.probabilities(range, what) {
                    Some(range) => parameters.push(number(name, None, range)),
                    None => complete = false,
                },
                None if name == "loss" => {}
                None => {
                    let title = format!("burst loss is missing `{name}`, {what}");
                    let diagnostic = Diagnostic::new(Code::CLAUSE_MISSING, span, title)
                        .label(format!("add it in the braces, for example `{name} [0%, 20%]`"));
                    self.report(diagnostic);
                    complete = false;
                }
            }
        }
        complete.then_some((target?, OperationKind::BurstLoss, parameters))
    }

    fn drain(&mut self, drain: &'a [(Span, ast::Drain)]) -> Drain {
        match self.single(drain, "drain") {
            None | Some(ast::Drain::Finish) => Drain::Finish,
            Some(ast::Drain::Flush) => Drain::Flush,
            Some(ast::Drain::Drop) => Drain::Drop,
        }
    }

    fn random_value(&mut self, target: &'a ast::Target, absolute: bool, amounts: &'a ast::Amounts) -> Option<Resolved> {
        let (target, held) = self.amounts_of(target, "a random value")?;
        let (mode, name) = if absolute { (ValueMode::Absolute, "value") } else { (ValueMode::Offset, "offset") };
        let permitted = self.one_amount(name, amounts, &held, &target)?;
        let sub_range = |name: &str, range, integer| Parameter {
            name: name.to_owned(),
            doc: String::new(),
            unit: permitted.unit.clone(),
            domain: Domain::Number { range, shape: ChoiceKind::Range, integer },
        };
        let (integer, parameters) = match &permitted.domain {
            Domain::Number { range, integer, .. } => (*integer, vec![sub_range(name, *range, *integer)]),
            Domain::Point { low, high } => {
                let axes = [("x", 0), ("y", 1), ("z", 2)];
                let range = |axis: usize| Range { low: low[axis], high: high[axis] };
                (false, axes.map(|(name, axis)| sub_range(name, range(axis), false)).to_vec())
            }
            Domain::Texts(_) | Domain::Files(_) => unreachable!("amounts are numbers or points"),
        };
        Some((target.found, OperationKind::RandomValue { mode, integer }, parameters))
    }

    fn stuck_at(&mut self, target: &'a ast::Target, at: &'a ast::Stuck) -> Option<Resolved> {
        match at {
            ast::Stuck::Amounts(amounts) => {
                let (target, held) = self.amounts_of(target, "`stuck at` a range")?;
                let parameter = self.one_amount("value", amounts, &held, &target)?;
                Some((target.found, OperationKind::StuckAt { truth: None }, vec![parameter]))
            }
            ast::Stuck::Texts(texts) => {
                let found = self.values(target, "`stuck at` texts", "a `text`", |ty| matches!(ty, Type::Text));
                let domain = Domain::Texts(self.items(texts)?);
                let parameter = Parameter { name: "value".to_owned(), doc: String::new(), unit: None, domain };
                let (found, _) = found?;
                let fit = self.texts_fit(&found, target, texts);
                fit.then_some((found, OperationKind::StuckAt { truth: None }, vec![parameter]))
            }
            ast::Stuck::Constants(names) => {
                let (target, constants) = self.constants_put(target, "`stuck at` a constant", names)?;
                let (texts, numbers) = constants.into_iter().map(|constant| (constant.name, constant.number)).unzip();
                let domain = Domain::Texts(texts);
                let parameter = Parameter { name: "value".to_owned(), doc: String::new(), unit: None, domain };
                Some((target, OperationKind::StuckAtConstant { numbers }, vec![parameter]))
            }
            ast::Stuck::Truth(truth, span) => {
                let user = format!("`stuck at {}`", self.text(*span));
                let (target, _) = self.values(target, &user, "a `bool`", |ty| matches!(ty, Type::Bool))?;
                Some((target, OperationKind::StuckAt { truth: Some(*truth) }, Vec::new()))
            }
        }
    }

    /// The values in whose place constants are put, with these constants.
    fn constants_put(
        &mut self,
        target: &'a ast::Target,
        user: &str,
        names: &'a [ast::Path],
    ) -> Option<(Target, Vec<NamedNumber>)> {
        let is = |ty: &Type| matches!(ty, Type::Int(None) | Type::Real(None));
        let found = self.values(target, user, "a number without a unit", is);
        let numbers = self.numbers_of_constants(names)?;
        let mut first: BTreeMap<&str, Span> = BTreeMap::new();
        for name in names {
            if let Some(before) = first.insert(self.text(name.span), name.span) {
                self.listed_twice(name.span, before);
                return None;
            }
        }
        let named = |(name, number): (&ast::Path, f64)| NamedNumber { name: self.text(name.span).to_owned(), number };
        Some((found?.0, names.iter().zip(numbers).map(named).collect()))
    }

    fn clock_skew(&mut self, target: &'a ast::Target, range: &ast::Range) -> Option<Resolved> {
        let stamp = |ty: &Type| match ty {
            Type::Int(unit) | Type::Real(unit) => dimension(unit.as_ref()) == Dimension::TIME,
            _ => false,
        };
        let wants = "a number with a unit of time, such as `real[s]` or `int[ns]`";
        let (found, ty) = self.values(target, "a clock skew", wants, stamp)?;
        let (unit, integer) = match ty {
            Type::Int(unit) => (unit, true),
            Type::Real(unit) => (unit, false),
            _ => unreachable!("a time stamp is a number"),
        };
        let skew = self.range(range, unit.as_ref(), "`skew`")?;
        if integer && !self.whole_ends(skew, range, "`skew`") {
            return None;
        }
        let domain = Domain::Number { range: skew, shape: ChoiceKind::Value, integer };
        let parameter = Parameter { name: "skew".to_owned(), doc: String::new(), unit, domain };
        Some((found, OperationKind::ClockSkew, vec![parameter]))
    }

    /// Numbers or points.
    fn amounts_of(&mut self, target: &'a ast::Target, user: &str) -> Option<(Amounted, Held)> {
        let is = |ty: &Type| matches!(ty, Type::Int(_) | Type::Real(_) | Type::Point(_));
        let (found, ty) = self.values(target, user, "a number or a point", is)?;
        let held = match ty {
            Type::Int(unit) => Held::Number { unit, integer: true },
            Type::Real(unit) => Held::Number { unit, integer: false },
            Type::Point(unit) => Held::Point { unit },
            _ => unreachable!("it is a number or a point"),
        };
        Some((Amounted { found, first: target.places[0].span }, held))
    }

    /// A parameter for an amount: a range of numbers, or a box of points.
    fn one_amount(
        &mut self,
        name: &str,
        amounts: &'a ast::Amounts,
        held: &Held,
        target: &Amounted,
    ) -> Option<Parameter> {
        // A rate has another unit than the value that changes at this rate.
        let what = if name == "rate" { "the rate".to_owned() } else { format!("`{}`", self.text(target.first)) };
        let (unit, domain) = match (held, amounts) {
            (Held::Number { unit, integer }, ast::Amounts::Range(range)) => {
                let permitted = self.range(range, unit.as_ref(), &what)?;
                if *integer && !self.whole_ends(permitted, range, &what) {
                    return None;
                }
                (unit, Domain::Number { range: permitted, shape: ChoiceKind::Value, integer: *integer })
            }
            (Held::Point { unit }, ast::Amounts::Corners(corners, _)) => {
                let (low, high) = self.corners(corners, unit.as_ref(), &what)?;
                (unit, Domain::Point { low, high })
            }
            (held, amounts) => {
                let (Held::Number { unit, .. } | Held::Point { unit }) = held;
                let unit = unit.as_ref().map_or("", Unit::text);
                let (is, needs, example) = match held {
                    Held::Number { .. } => ("a number", "a range of numbers", format!("[0{unit}, 1{unit}]")),
                    Held::Point { .. } => {
                        ("a point", "a range of points", format!("[(0, 0, 0){unit}, (1, 1, 1){unit}]"))
                    }
                };
                let title = format!("`{}` is {is}, so `{name}` must be {needs}", self.text(target.first));
                let diagnostic = Diagnostic::new(Code::WRONG_TYPE, amounts.span(), title)
                    .label(format!("expected, for example, `{example}`"));
                self.report(diagnostic);
                return None;
            }
        };
        Some(Parameter { name: name.to_owned(), doc: String::new(), unit: unit.clone(), domain })
    }

    fn whole_ends(&mut self, range: Range, written: &ast::Range, what: &str) -> bool {
        let low = self.whole(range.low, written.low.span, what);
        self.whole(range.high, written.high.span, what) && low
    }

    // ----- targets

    /// Whole messages of one topic.
    pub(super) fn whole_messages(&mut self, target: &'a ast::Target, does: &str) -> Option<Target> {
        let (found, _) = self.values(target, does, "whole messages", |_| true)?;
        let [steps] = found.places.as_slice() else {
            let title = format!("{does} whole messages of one topic");
            let diagnostic = Diagnostic::new(Code::WRONG_TYPE, target.span, title).label("expected one topic");
            self.report(diagnostic);
            return None;
        };
        if steps.is_empty() {
            return Some(Target { places: Vec::new(), ..found });
        }
        let place = target.places.first()?;
        let parts = Span { lo: place.topic.span.hi, ..place.span };
        let title = format!("{does} whole messages, not parts of them");
        let diagnostic = Diagnostic::new(Code::WRONG_TYPE, parts, title).label("expected a topic").suggest(
            "use the whole topic",
            parts,
            "",
        );
        self.report(diagnostic);
        None
    }

    /// The values at the places of a target, all of one topic and one type, which must satisfy `is_for`; `wants` is
    /// that in words.
    fn values(
        &mut self,
        target: &'a ast::Target,
        user: &str,
        wants: &str,
        is_for: impl Fn(&Type) -> bool,
    ) -> Option<(Target, Type)> {
        let mut found: Vec<Disturbed> = Vec::new();
        let mut first_words = "";
        let mut complete = true;
        for place in &target.places {
            let Some(disturbed) = self.disturbed(place) else {
                complete = false;
                continue;
            };
            let Disturbed { topic: _, only, steps, ty } = &disturbed;
            let written = self.text(place.span);
            if let Some(Disturbed { ty: first_type, .. }) = found.first() {
                let same_place = |before: &Disturbed| before.only == *only && before.steps == *steps;
                let wrong = if first_type != ty {
                    let label =
                        format!("this is {}, but `{first_words}` is {}", type_in_words(ty), type_in_words(first_type));
                    Some((Code::WRONG_TYPE, format!("`{written}` and `{first_words}` have different types"), label))
                } else if found.iter().any(same_place) {
                    Some((Code::LISTED_TWICE, format!("`{written}` is listed twice"), "listed again here".to_owned()))
                } else {
                    None
                };
                if let Some((code, title, label)) = wrong {
                    self.report(Diagnostic::new(code, place.span, title).label(label));
                    complete = false;
                    continue;
                }
            } else {
                first_words = written;
            }
            if !is_for(ty) {
                self.report_unfit(place, user, wants, ty, &is_for);
                complete = false;
            }
            found.push(disturbed);
        }
        let Disturbed { topic, ty, .. } = found.first().filter(|_| complete).cloned()?;
        // Each member with its places, which are the same for all.
        let mut by_member: BTreeMap<Option<u32>, Vec<Vec<Step>>> = BTreeMap::new();
        for Disturbed { only, steps, .. } in found {
            by_member.entry(only).or_default().push(steps);
        }
        let mut all = by_member.values();
        let places = all.next()?.clone();
        if all.any(|other| *other != places) || by_member.len() > 1 && by_member.contains_key(&None) {
            let diagnostic =
                Diagnostic::new(Code::WRONG_TYPE, target.span, "an operation changes the same in each member")
                    .label("these are different values of different members")
                    .note("declare another operation for the other values");
            self.report(diagnostic);
            return None;
        }
        let named: Vec<u32> = by_member.into_keys().flatten().collect();
        Some((Target { topic, members: (!named.is_empty()).then_some(MembersOf::These(named)), places }, ty))
    }

    /// Where a place is that an operation changes, and its type.
    fn disturbed(&mut self, path: &'a ast::Path) -> Option<Disturbed> {
        let Place { topic, only, fields, steps, point, ty, .. } = self.place(path, false)?;
        if let Some(holder) = point {
            let in_list = path.elements.iter().rev().find_map(|step| match step {
                ast::Step::Field(name) => Some(name),
                _ => None,
            });
            let span = in_list.or(path.fields.last()).map_or(path.span, |last| last.span);
            let title = format!("{holder} has no fields");
            let label = "it is a point, which an operation changes as a whole";
            self.report(Diagnostic::new(Code::WRONG_TYPE, span, title).label(label));
            return None;
        }
        Some(Disturbed { topic, only, steps: fields.into_iter().map(Step::Field).chain(steps).collect(), ty })
    }

    fn report_unfit(&mut self, place: &ast::Path, user: &str, wants: &str, ty: &Type, is_for: impl Fn(&Type) -> bool) {
        let written = self.text(place.span);
        let title = format!("{user} needs {wants}, but `{written}` is {}", type_in_words(ty));
        let mut diagnostic = Diagnostic::new(Code::WRONG_TYPE, place.span, title).label(format!("expected {wants}"));
        match ty {
            Type::Message(id) => {
                if let Some(message) = self.system.messages[id.index()].as_ref() {
                    for field in message.fields.iter().filter(|field| is_for(&field.ty)).take(3) {
                        let name = &field.declaration.name;
                        diagnostic =
                            diagnostic.suggest(format!("use its field `{name}`"), place.span.end(), format!(".{name}"));
                    }
                }
            }
            Type::List(of) if is_for(of) => {
                diagnostic = diagnostic.suggest("use each of its elements", place.span.end(), "[*]");
            }
            _ => {}
        }
        self.report(diagnostic);
    }
}

/// A target with where its first place is written.
struct Amounted {
    found: Target,
    first: Span,
}

/// A target that is one whole message has no places.
fn whole_or_parts(target: Target) -> Target {
    match target.places.as_slice() {
        [only] if only.is_empty() => Target { places: Vec::new(), ..target },
        _ => target,
    }
}

/// A parameter of which a test chooses one number.
pub(super) fn number(name: &str, unit: Option<Unit>, range: Range) -> Parameter {
    let domain = Domain::Number { range, shape: ChoiceKind::Value, integer: false };
    Parameter { name: name.to_owned(), doc: String::new(), unit, domain }
}
