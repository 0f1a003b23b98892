//! A formula as a tree of operators, each of which turns the robustness signals of its parts into its own.
//!
//! There are five kinds; the others follow by duality, which is exact, since negating a floating-point number is.

use std::collections::VecDeque;

use sesame_base::time::SimTime;
use sesame_plan::Comparison;
use sesame_plan::stl::{Formula, Interval};

use crate::FormulaError;
use crate::minimum::SlidingMinimum;
use crate::piece::{Pair, Piece, Span, Window, put, signed};
use crate::until::SlidingUntil;

/// The next part of the trace, in which no signal changes.
#[derive(Debug, Clone, Copy)]
pub(super) struct Stretch<'u> {
    /// Where it ends, excluded.
    pub(super) end: i64,
    /// Whether the trace ends there too.
    pub(super) last: bool,
    /// What stands for everything of which nothing is known.
    pub(super) unknown: Option<&'u Unknown>,
    /// Whether only windows count that are completely within the trace.
    pub(super) whole: bool,
}

/// What stands for the robustness where nothing is known of the signals, and maybe not even whether there is a trace.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Unknown {
    /// Up to where signals are known, excluded; the trace may end there or at any later time.
    pub(super) known: i64,
    /// For predicates: negative or positive infinity.
    pub(super) extreme: f64,
}

impl Unknown {
    /// For what has a robustness only if the trace goes on. It differs from the infinity of what has one that is
    /// unknown.
    fn undecided(&self) -> f64 {
        f64::MAX.copysign(self.extreme)
    }
}

impl Stretch<'_> {
    /// Whether windows are cut here. Where nothing is known the trace goes on for ever, and has no end to cut them.
    fn cuts(self) -> bool {
        self.last && !self.whole && self.unknown.is_none()
    }
}

/// An operator, and the span for which its robustness is needed.
#[derive(Debug, Clone)]
pub(super) struct FormulaNode {
    asked: Span,
    /// The time up to which its robustness is known.
    told: i64,
    operator: Operator,
}

#[derive(Debug, Clone)]
enum Operator {
    Predicate(Predicate),
    Not { of: Box<FormulaNode>, input: VecDeque<Piece> },
    And { left: Box<FormulaNode>, right: Box<FormulaNode>, input: Pair },
    Always(Box<Always>),
    Until(Box<Until>),
}

/// How far a signal is on the right side of a constant.
#[derive(Debug, Clone, Copy)]
struct Predicate {
    signal: usize,
    comparison: Comparison,
    constant: f64,
}

impl Predicate {
    fn margin(&self, values: &[f64]) -> f64 {
        margin(values[self.signal], self.comparison, self.constant)
    }
}

/// The least of a formula in a window, or its negative: `eventually` is `not always not`, and does both negations on
/// the way.
#[derive(Debug, Clone)]
struct Always {
    /// The formula, or its negation.
    of: FormulaNode,
    negated: bool,
    /// What came from `of`.
    input: VecDeque<Piece>,
    minimum: SlidingMinimum,
    /// All values of the formula, where the signal is asked for.
    kept: Option<VecDeque<Piece>>,
}

/// `left until right` is computed as two parts that both hold: `left` holds up to the beginning of the window, and from
/// there on it is an `until` with a window that begins at once. A weak one, too: `left` all through is `left` up to the
/// window and `left` all through that.
#[derive(Debug, Clone)]
struct Until {
    left: FormulaNode,
    right: FormulaNode,
    /// What came from the left.
    lead: VecDeque<Piece>,
    /// Both sides, from the beginning of the first window on.
    input: Pair,
    /// How far ahead the window begins.
    delay: i64,
    before: SlidingMinimum,
    within: SlidingUntil,
    /// The second part, at the times of its windows' beginnings.
    ahead: VecDeque<Piece>,
    /// Both parts.
    parts: Pair,
}

impl FormulaNode {
    /// The operators of a formula of which a span is asked. Marks the signals it names.
    pub(super) fn new(formula: &Formula, asked: Span, used: &mut [bool]) -> Result<Self, FormulaError> {
        let operator = match formula {
            &Formula::Predicate { signal, comparison, constant } => {
                if !constant.is_finite() {
                    return Err(FormulaError::Constant { signal, constant });
                }
                let count = used.len();
                let index = signal as usize;
                *used.get_mut(index).ok_or(FormulaError::Signal { signal, count })? = true;
                Operator::Predicate(Predicate { signal: index, comparison, constant })
            }
            Formula::Not { of } => return Ok(FormulaNode::new(of, asked, used)?.negated()),
            Formula::And { left, right } => {
                and(FormulaNode::new(left, asked, used)?, FormulaNode::new(right, asked, used)?)
            }
            Formula::Or { left, right } => {
                let (left, right) = (FormulaNode::new(left, asked, used)?, FormulaNode::new(right, asked, used)?);
                return Ok(FormulaNode::from_operator(asked, and(left.negated(), right.negated())).negated());
            }
            Formula::Implies { left, right } => {
                let (left, right) = (FormulaNode::new(left, asked, used)?, FormulaNode::new(right, asked, used)?);
                return Ok(FormulaNode::from_operator(asked, and(left, right.negated())).negated());
            }
            Formula::Always { interval, of } => {
                let window = window(*interval)?;
                always(window, asked, FormulaNode::new(of, asked.seen_through(window), used)?)
            }
            Formula::Eventually { interval, of } => {
                let window = window(*interval)?;
                let of = FormulaNode::new(of, asked.seen_through(window), used)?;
                return Ok(FormulaNode::from_operator(asked, always(window, asked, of.negated())).negated());
            }
            Formula::Until { interval, weak, left, right } => {
                let window = window(*interval)?;
                let seen = asked.seen_through(window);
                let delay = Window { from: window.from, to: Some(window.from) };
                Operator::Until(Box::new(Until {
                    left: FormulaNode::new(left, Span { start: asked.start, end: seen.end }, used)?,
                    right: FormulaNode::new(right, seen, used)?,
                    lead: VecDeque::new(),
                    input: Pair::default(),
                    delay: window.from,
                    before: SlidingMinimum::new(Window { from: 0, to: Some(window.from) }, asked),
                    within: SlidingUntil::new(window.to.map(|to| to - window.from), *weak, asked.seen_through(delay)),
                    ahead: VecDeque::new(),
                    parts: Pair::default(),
                }))
            }
        };
        Ok(FormulaNode::from_operator(asked, operator))
    }

    fn from_operator(asked: Span, operator: Operator) -> Self {
        FormulaNode { asked, told: asked.start, operator }
    }

    /// Its negation; that of a negation is what was negated.
    fn negated(self) -> Self {
        match self.operator {
            Operator::Not { of, .. } => *of,
            Operator::Always(mut always) => {
                always.minimum.negated ^= true;
                FormulaNode { operator: Operator::Always(always), ..self }
            }
            _ => FormulaNode::from_operator(self.asked, Operator::Not { of: Box::new(self), input: VecDeque::new() }),
        }
    }

    /// Follows the trace, on which the signals have these values, and tells what becomes known of the robustness.
    pub(super) fn extend(&mut self, stretch: Stretch<'_>, values: &[f64], out: &mut VecDeque<Piece>) {
        if self.told >= self.asked.end {
            return;
        }
        match &mut self.operator {
            Operator::Predicate(predicate) => {
                if stretch.end > self.told {
                    let known = predicate.margin(values);
                    put(out, stretch.end, stretch.unknown.map_or(known, |unknown| unknown.extreme));
                }
            }
            Operator::Not { of, input } => {
                let unknown = stretch.unknown.map(|unknown| Unknown { extreme: -unknown.extreme, ..*unknown });
                let stretch = Stretch { unknown: unknown.as_ref(), ..stretch };
                of.each(stretch, values, input, |piece| put(out, piece.end, -piece.value));
            }
            Operator::And { left, right, input } => {
                left.extend(stretch, values, &mut input.left);
                right.extend(stretch, values, &mut input.right);
                let undecided = |value: &f64| stretch.unknown.is_some_and(|unknown| *value == unknown.undecided());
                while let Some((end, left, right)) = input.pop() {
                    put(out, end, [left, right].into_iter().find(undecided).unwrap_or(left.min(right)));
                }
            }
            Operator::Always(always) => always.extend(stretch, values, self.told, out),
            Operator::Until(until) => until.extend(stretch, values, self.told, out),
        }
        if let Some(last) = out.back() {
            self.told = self.told.max(last.end);
        }
    }

    /// As [`FormulaNode::extend`], with each piece handed to `take`. The queue is empty before and afterwards; what is
    /// known of each stretch at once needs none.
    fn each(&mut self, stretch: Stretch<'_>, values: &[f64], queue: &mut VecDeque<Piece>, mut take: impl FnMut(Piece)) {
        if let Some(value) = self.at_once(stretch, values) {
            if self.told < self.asked.end && stretch.end > self.told {
                self.told = stretch.end;
                take(Piece { end: stretch.end, value });
            }
            return;
        }
        self.extend(stretch, values, queue);
        while let Some(piece) = queue.pop_front() {
            take(piece);
        }
    }

    /// The robustness of a predicate, negated or not, on a stretch; `None` for what depends on other stretches, too.
    #[expect(clippy::inline_always, reason = "once per sample, and the call costs as much as the work")]
    #[inline(always)]
    fn at_once(&self, stretch: Stretch<'_>, values: &[f64]) -> Option<f64> {
        let known = match &self.operator {
            Operator::Predicate(predicate) => predicate.margin(values),
            Operator::Not { of, .. } => match &of.operator {
                Operator::Predicate(predicate) => -predicate.margin(values),
                _ => return None,
            },
            _ => return None,
        };
        // What is unknown of a predicate is as much so of its negation.
        Some(stretch.unknown.map_or(known, |unknown| unknown.extreme))
    }

    /// Up to where it has a robustness, excluded, on a trace that ends here.
    fn defined(&self, end: i64, whole: bool) -> i64 {
        match &self.operator {
            Operator::Predicate(_) => end,
            Operator::Not { of, .. } => of.defined(end, whole),
            Operator::And { left, right, .. } => left.defined(end, whole).min(right.defined(end, whole)),
            Operator::Always(always) => always.defined(end, whole),
            Operator::Until(until) => until.defined(end, whole),
        }
    }

    /// From now on keeps what its outermost `always` go over: the signal of a formula that has a quantifier.
    pub(super) fn keep_signal(&mut self) {
        match &mut self.operator {
            Operator::Always(always) => always.kept = Some(VecDeque::new()),
            Operator::Not { of, .. } => of.keep_signal(),
            Operator::And { left, right, .. } => {
                left.keep_signal();
                right.keep_signal();
            }
            Operator::Predicate(_) | Operator::Until(_) => {}
        }
    }

    /// The signal that was kept, and where it begins; of several `always` the least at each time.
    pub(super) fn signal(self) -> Option<(i64, VecDeque<Piece>)> {
        match self.operator {
            Operator::Always(always) => {
                let Span { start, end } = always.of.asked;
                let (kept, negated) = (always.kept?, always.minimum.negated);
                let kept = kept
                    .into_iter()
                    .map(|piece| Piece { end: piece.end.min(end), value: signed(piece.value, negated) });
                Some((start, kept.filter(|piece| piece.end > start).collect()))
            }
            Operator::Not { of, .. } => {
                let (start, pieces) = of.signal()?;
                Some((start, pieces.into_iter().map(|piece| Piece { value: -piece.value, ..piece }).collect()))
            }
            Operator::And { left, right, .. } => Some(least(left.signal()?, right.signal()?)),
            Operator::Predicate(_) | Operator::Until(_) => None,
        }
    }

    /// How many pieces are held in all queues.
    #[cfg(test)]
    pub(super) fn held(&self) -> usize {
        let pair = |pair: &Pair| pair.left.len() + pair.right.len();
        match &self.operator {
            Operator::Predicate(_) => 0,
            Operator::Not { of, input } => of.held() + input.len(),
            Operator::And { left, right, input } => left.held() + right.held() + pair(input),
            Operator::Always(always) => always.of.held() + always.input.len() + always.minimum.held(),
            Operator::Until(until) => {
                let Until { left, right, lead, input, before, within, ahead, parts, .. } = &**until;
                let queues = lead.len() + pair(input) + before.held() + within.held() + ahead.len() + pair(parts);
                left.held() + right.held() + queues
            }
        }
    }
}

impl Always {
    /// `told` is the time up to which its robustness is known.
    fn extend(&mut self, stretch: Stretch<'_>, values: &[f64], told: i64, out: &mut VecDeque<Piece>) {
        match stretch.unknown {
            // For every sample: it says directly what it says.
            None => self.minima(stretch, values, out),
            Some(unknown) => self.put_decided(unknown, stretch, values, told, out),
        }
    }

    fn minima(&mut self, stretch: Stretch<'_>, values: &[f64], out: &mut VecDeque<Piece>) {
        let Always { of, negated, input, minimum, kept } = self;
        of.each(stretch, values, input, |piece| {
            let piece = Piece { value: signed(piece.value, *negated), ..piece };
            if let Some(kept) = kept {
                put(kept, piece.end, piece.value);
            }
            minimum.push(piece, out);
        });
        if stretch.cuts() || stretch.last && !minimum.is_bounded() {
            minimum.finish(of.told, out);
        }
    }

    #[cold]
    fn put_decided(
        &mut self,
        unknown: &Unknown,
        stretch: Stretch<'_>,
        values: &[f64],
        told: i64,
        out: &mut VecDeque<Piece>,
    ) {
        let inside = Unknown { extreme: signed(unknown.extreme, self.negated != self.minimum.negated), ..*unknown };
        let mut all = VecDeque::new();
        self.minima(Stretch { unknown: Some(&inside), ..stretch }, values, &mut all);
        put_decided(unknown, self.defined(unknown.known, stretch.whole), told, all, out);
    }

    /// As [`FormulaNode::defined`].
    fn defined(&self, end: i64, whole: bool) -> i64 {
        self.of.defined(end, whole).saturating_sub(self.minimum.reaches_ahead(whole))
    }
}

impl Until {
    /// `told` is the time up to which its robustness is known.
    fn extend(&mut self, stretch: Stretch<'_>, values: &[f64], told: i64, out: &mut VecDeque<Piece>) {
        self.left.each(stretch, values, &mut self.lead, |piece| {
            self.before.push(piece, &mut self.parts.left);
            if self.within.asks(piece.end) {
                put(&mut self.input.left, piece.end, piece.value);
            }
        });
        self.right.extend(stretch, values, &mut self.input.right);
        // The robustness of a window that begins at once needs no shift.
        let ahead = if self.delay == 0 { &mut self.parts.right } else { &mut self.ahead };
        while let Some((end, left, right)) = self.input.pop() {
            self.within.push(end, left, right, ahead);
        }
        if stretch.cuts() || stretch.last && !self.within.is_bounded() {
            self.within.finish(self.left.told.min(self.right.told), ahead);
        }
        while let Some(piece) = self.ahead.pop_front() {
            put(&mut self.parts.right, piece.end - self.delay, piece.value);
        }
        match stretch.unknown {
            None => self.parts.least(out),
            Some(unknown) => self.put_decided(unknown, stretch.whole, told, out),
        }
    }

    #[cold]
    fn put_decided(&mut self, unknown: &Unknown, whole: bool, told: i64, out: &mut VecDeque<Piece>) {
        let mut both = VecDeque::new();
        self.parts.least(&mut both);
        put_decided(unknown, self.defined(unknown.known, whole), told, both, out);
    }

    /// As [`FormulaNode::defined`].
    fn defined(&self, end: i64, whole: bool) -> i64 {
        let ahead = if whole { self.delay + self.within.length().unwrap_or(0) } else { self.delay };
        self.left.defined(end, whole).min(self.right.defined(end, whole)).saturating_sub(ahead)
    }
}

/// Passes on what an operator says. From `defined` on it has a robustness only if the trace goes on, so what it says
/// there is undecided. It has spoken of times before `told`.
#[cold]
fn put_decided(unknown: &Unknown, defined: i64, told: i64, pieces: VecDeque<Piece>, out: &mut VecDeque<Piece>) {
    let mut told = told;
    for piece in pieces {
        if piece.end > defined {
            if told < defined {
                put(out, defined, piece.value);
            }
            put(out, piece.end, unknown.undecided());
        } else {
            put(out, piece.end, piece.value);
        }
        told = piece.end;
    }
}

fn and(left: FormulaNode, right: FormulaNode) -> Operator {
    Operator::And { left: Box::new(left), right: Box::new(right), input: Pair::default() }
}

fn always(window: Window, asked: Span, of: FormulaNode) -> Operator {
    let minimum = SlidingMinimum::new(window, asked);
    let (of, negated) = match of.operator {
        Operator::Not { of, .. } => (*of, true),
        _ => (of, false),
    };
    Operator::Always(Box::new(Always { of, negated, input: VecDeque::new(), minimum, kept: None }))
}

fn window(interval: Interval) -> Result<Window, FormulaError> {
    let Interval { from, to } = interval;
    let sound = from.is_finite() && from >= 0.0 && to.is_none_or(|to| to.is_finite() && to >= from);
    if !sound {
        return Err(FormulaError::Interval { from, to: to.unwrap_or(f64::INFINITY) });
    }
    let nanos = |seconds| SimTime::from_seconds(seconds).nanos();
    Ok(Window { from: nanos(from), to: to.map(nanos) })
}

/// The lesser of two signals at each time; where there is only one of them, that one.
pub(super) fn least(a: (i64, VecDeque<Piece>), b: (i64, VecDeque<Piece>)) -> (i64, VecDeque<Piece>) {
    let start = a.0.min(b.0);
    let last = |pieces: &VecDeque<Piece>| pieces.back().map_or(start, |piece| piece.end);
    let end = last(&a.1).max(last(&b.1));
    // Nothing is below infinity, so it stands for what is missing before the beginning and after the end.
    let whole = |(from, mut pieces): (i64, VecDeque<Piece>)| {
        if from > start {
            pieces.push_front(Piece { end: from, value: f64::INFINITY });
        }
        if last(&pieces) < end {
            put(&mut pieces, end, f64::INFINITY);
        }
        pieces
    };
    let mut pair = Pair { left: whole(a), right: whole(b) };
    let mut pieces = VecDeque::new();
    while let Some((end, left, right)) = pair.pop() {
        put(&mut pieces, end, left.min(right));
    }
    (start, pieces)
}

/// By how much a value satisfies a comparison; never NaN.
fn margin(value: f64, comparison: Comparison, constant: f64) -> f64 {
    if value.is_nan() {
        return f64::NEG_INFINITY;
    }
    match comparison {
        Comparison::Above | Comparison::AtLeast => value - constant,
        Comparison::Below | Comparison::AtMost => constant - value,
        Comparison::Equal => -(value - constant).abs(),
        Comparison::NotEqual => (value - constant).abs(),
    }
}
