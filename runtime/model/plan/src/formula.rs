//! Declarative metrics as data. Units are resolved: constants and factors are such that numbers are taken as they are
//! on the wire.

use serde::{Deserialize, Serialize};

use crate::{FieldRef, Finite, Step, TopicId};

/// A metric computed from messages without any code of the user.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Formula {
    /// What its expressions refer to by position; at least one.
    pub inputs: Vec<Input>,
    /// What becomes of the values over time.
    pub aggregate: Aggregate,
    /// Only messages at which it holds count.
    pub when: Option<Condition>,
    /// Shortest simulation time between two messages that count, in seconds; positive.
    pub every: Option<f64>,
    /// A text or whole number in the messages of one of the inputs' topics: one state for each of its values.
    pub per: Option<FieldRef>,
    /// Where it listens.
    pub side: Side,
}

/// Where a metric listens to the messages of its topics.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Side {
    /// Before operations: messages as they were published.
    Inbound,
    /// After operations: messages as they are delivered.
    Outbound,
}

/// A value held from the messages of a topic: a number, true or false (1 or 0), or a point.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct Input {
    /// Where it comes from. Its path may end with `x`, `y` or `z` of a point.
    pub field: FieldRef,
    /// What is made of a group's members; [`Members::Min`] for a single topic.
    pub members: Members,
    /// For a value in a list: the way from the field, which is the list, to it. `None` for all others, and then not
    /// written.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub list: Option<InList>,
    /// For a field that is a text: the input is whether this holds of it. `None` for all others, and then not written.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub text: Option<TextTest>,
    /// What is computed from the values of successive messages, the innermost first: that of each member of a group
    /// from its own messages. Empty for the value of the last message, and then not written.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub memory: Vec<Memory>,
}

impl Input {
    /// The value that a field has in the last message, which is neither a list nor a text.
    pub fn new(field: FieldRef, members: Members) -> Self {
        Input { field, members, list: None, text: None, memory: Vec::new() }
    }

    /// The most that is computed from successive messages, one from the other: that of acceleration is two, of jerk
    /// three.
    pub const DEEPEST_MEMORY: usize = 8;

    /// Whether it is an integral, which grows between messages: [`Expression::Integral`] reads it, and nothing else
    /// does.
    pub fn is_integral(&self) -> bool {
        self.memory.last() == Some(&Memory::Integral)
    }

    /// Where its messages come from.
    pub fn source(&self) -> Source {
        Source { topic: self.field.topic, only: self.only() }
    }

    /// Whether it reads the messages of a path of a topic, by its position.
    pub fn reads(&self, topic: TopicId, member: usize) -> bool {
        self.source().reads(topic, member)
    }

    /// The only member that it reads.
    pub fn only(&self) -> Option<u32> {
        if let Members::Only(member) = self.members { Some(member) } else { None }
    }
}

/// A topic that is read: all of it or one member of a group.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Source {
    /// The topic.
    pub topic: TopicId,
    /// The only member that is read, by its position; `None` for all of them.
    pub only: Option<u32>,
}

impl Source {
    /// The whole topic.
    pub fn whole(topic: TopicId) -> Source {
        Source { topic, only: None }
    }

    /// Whether it has the messages of a path of a topic, by its position.
    pub fn reads(self, topic: TopicId, member: usize) -> bool {
        self.topic == topic && self.only.is_none_or(|only| only as usize == member)
    }
}

/// Values in a list. For what reads them, a message without any is as if it had not come; only their number and their
/// sum are 0 then.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct InList {
    /// From the list to the values. For the length of the list it is empty. It may end with `x`, `y` or `z` of a point.
    pub steps: Vec<Step>,
    /// What is made of the values.
    pub reduction: Reduction,
}

/// What is made of values in a list. Numbers that are not finite are left out, except as a single value.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Reduction {
    /// The first, where only one is meant.
    First,
    /// The least.
    Min,
    /// The greatest.
    Max,
    /// The sum; 0 without any.
    Sum,
    /// The mean.
    Mean,
    /// How many there are; of truth values, how many are true.
    Count,
    /// How many elements the list has.
    Length,
    /// Each of them: the formula is evaluated for each, together with the values at the same place that other inputs
    /// read in the same list.
    Each,
}

/// A comparison of a text.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum TextTest {
    /// It is equal to this one.
    Is(String),
    /// It is not equal to this one.
    IsNot(String),
}

/// What is computed from the values of successive messages. A value that is not finite makes it begin anew.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Memory {
    /// The value of the message before the last one; nothing before the second message.
    Previous,
    /// The difference quotient of the last message and the last one of an earlier instant, per second; nothing before
    /// there are two such messages.
    Rate,
    /// The integral over time since the first message, in seconds times its unit. Each value holds until the next
    /// message. It is of one number, and the last that is computed.
    Integral,
    /// An angle that is followed from message to message: it differs from the value by as many whole turns as bring it
    /// nearest to what it was before. It is of one number.
    Unwrapped {
        /// A whole turn, in the unit of the value; positive.
        turn: Finite,
    },
}

impl Memory {
    /// Its name in the language.
    pub const fn name(self) -> &'static str {
        match self {
            Memory::Previous => "previous",
            Memory::Rate => "rate",
            Memory::Integral => "integral",
            Memory::Unwrapped { .. } => "unwrapped",
        }
    }
}

/// What is made of the last values of a group's members, of those that had a message.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Members {
    /// The least.
    Min,
    /// The greatest.
    Max,
    /// The sum.
    Sum,
    /// The latest. Those of several groups are of members at the same position.
    Each,
    /// The first member of a pair: the formula is that of each pair of different members of one group or, if the second
    /// ones are of another group, of each member of one with each of the other.
    First,
    /// The second member of a pair.
    Second,
    /// This one only, by its position. Where a formula reads a member of a group and each member too, these are all
    /// others.
    Only(u32),
}

/// How a formula's values become the metric's.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(tag = "kind", rename_all = "snake_case")]
pub enum Aggregate {
    /// The last value.
    Last {
        /// The expression.
        of: Expression,
    },
    /// The least value.
    Min {
        /// The expression.
        of: Expression,
    },
    /// The greatest value.
    Max {
        /// The expression.
        of: Expression,
    },
    /// The mean over messages.
    Mean {
        /// The expression.
        of: Expression,
    },
    /// The number of messages at which it held.
    Count {
        /// The condition.
        of: Condition,
    },
    /// The simulation time during which it held, in seconds.
    Duration {
        /// The condition.
        of: Condition,
    },
}

/// A number computed from inputs.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Expression {
    /// A constant.
    Constant(f64),
    /// An input that is a number: position in [`Formula::inputs`].
    Input(u32),
    /// An input that [is an integral](Input::is_integral), up to the time at which it is read: position in
    /// [`Formula::inputs`].
    Integral(u32),
    /// The number with its sign changed.
    Negate(Box<Expression>),
    /// The sum, from left to right.
    Sum(Vec<Expression>),
    /// The product, from left to right.
    Product(Vec<Expression>),
    /// A quotient.
    Divide {
        /// What is divided.
        value: Box<Expression>,
        /// By what.
        by: Box<Expression>,
    },
    /// The number without its sign.
    Absolute(Box<Expression>),
    /// The least.
    Min(Vec<Expression>),
    /// The greatest.
    Max(Vec<Expression>),
    /// How far two points are from each other, in the unit of the first.
    Distance(Box<Distance>),
    /// How far a point is from the boundary of a region, in its own unit: positive outside, negative inside.
    SignedDistance(Box<SignedDistance>),
    /// The simulation time since the beginning of the run, in seconds.
    Time,
    /// What the clock of the simulator's stamps shows, in seconds: the same time, from where that clock counts.
    Now,
    /// The value that the test chose for a parameter of the space.
    Scene {
        /// The operation of that kind, by its name: the plan holds it only if the campaign's tests may choose it.
        operation: String,
        /// The value in tests that do not choose it, in the unit of the parameter; finite.
        usual: f64,
    },
    /// A function of one number.
    Unary {
        /// Which.
        function: UnaryFunction,
        /// The argument.
        of: Box<Expression>,
    },
    /// A function of two numbers.
    Binary {
        /// Which.
        function: BinaryFunction,
        /// Its first argument.
        left: Box<Expression>,
        /// Its second argument.
        right: Box<Expression>,
    },
}

impl Expression {
    /// Whether it contains the simulation time or an integral, so that its value changes without a message.
    pub fn reads_time(&self) -> bool {
        matches!(self, Expression::Time | Expression::Now | Expression::Integral(_))
            || self.parts().into_iter().any(Expression::reads_time)
    }

    /// Whether it contains an integral.
    pub fn integrates(&self) -> bool {
        matches!(self, Expression::Integral(_)) || self.parts().into_iter().any(Expression::integrates)
    }

    /// Whether it contains the value of a parameter of the space.
    pub fn reads_scene(&self) -> bool {
        matches!(self, Expression::Scene { .. }) || self.parts().into_iter().any(Expression::reads_scene)
    }

    /// The expressions that it is directly computed from, in order.
    pub fn parts(&self) -> Vec<&Expression> {
        match self {
            Expression::Constant(_)
            | Expression::Input(_)
            | Expression::Integral(_)
            | Expression::Distance(_)
            | Expression::SignedDistance(_)
            | Expression::Time
            | Expression::Now
            | Expression::Scene { .. } => Vec::new(),
            Expression::Negate(of) | Expression::Absolute(of) | Expression::Unary { of, .. } => vec![of],
            Expression::Divide { value: left, by: right } | Expression::Binary { left, right, .. } => vec![left, right],
            Expression::Sum(of) | Expression::Product(of) | Expression::Min(of) | Expression::Max(of) => {
                of.iter().collect()
            }
        }
    }

    /// The points that it is directly computed from, in order.
    pub fn points(&self) -> Vec<Point> {
        match self {
            Expression::Distance(distance) => vec![distance.from, distance.to],
            Expression::SignedDistance(distance) => vec![distance.from],
            _ => Vec::new(),
        }
    }
}

/// How far two points are from each other.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Distance {
    /// The first.
    pub from: Point,
    /// The second.
    pub to: Point,
    /// How many units of the first one unit of the second is.
    pub scale: f64,
}

/// How far a point is from the boundary of a region.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct SignedDistance {
    /// The point.
    pub from: Point,
    /// The region, in the unit of the point.
    pub to: Region,
}

/// A point in space.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(untagged)]
pub enum Point {
    /// An input that is a point: position in [`Formula::inputs`].
    Input(u32),
    /// A point that is written in the space.
    Constant([f64; 3]),
}

/// A part of space with an inside and an outside.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Region {
    /// Along each axis between two numbers.
    Box {
        /// The corner with the least coordinates.
        low: [f64; 3],
        /// The corner with the greatest coordinates: along each axis above the other one.
        high: [f64; 3],
    },
    /// All points whose `x` and `y` lie in a simple polygon, at any `z`.
    Polygon {
        /// At least three, in order around the polygon, in either direction.
        corners: Vec<[f64; 2]>,
    },
}

/// A function of one number. Angles are in radians.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum UnaryFunction {
    /// The square root.
    Sqrt,
    /// The sine of an angle.
    Sin,
    /// The cosine of an angle.
    Cos,
    /// The tangent of an angle.
    Tan,
    /// The angle from -π/2 to π/2 with this sine.
    Asin,
    /// The angle from 0 to π with this cosine.
    Acos,
    /// The angle from -π/2 to π/2 with this tangent.
    Atan,
    /// The power of e.
    Exp,
    /// The natural logarithm.
    Ln,
}

impl UnaryFunction {
    /// Its name in the language.
    pub const fn name(self) -> &'static str {
        match self {
            UnaryFunction::Sqrt => "sqrt",
            UnaryFunction::Sin => "sin",
            UnaryFunction::Cos => "cos",
            UnaryFunction::Tan => "tan",
            UnaryFunction::Asin => "asin",
            UnaryFunction::Acos => "acos",
            UnaryFunction::Atan => "atan",
            UnaryFunction::Exp => "exp",
            UnaryFunction::Ln => "ln",
        }
    }
}

/// A function of two numbers.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum BinaryFunction {
    /// The angle from -π to π of the point (x, y), in radians; the arguments are y and x.
    Atan2,
    /// The root of the sum of squares.
    Hypot,
    /// The first to the power of the second.
    Pow,
    /// What is left of an angle without whole turns, the second: from minus half a turn up to and not including half a
    /// turn.
    Wrapped,
}

impl BinaryFunction {
    /// Its name in the language.
    pub const fn name(self) -> &'static str {
        match self {
            BinaryFunction::Atan2 => "atan2",
            BinaryFunction::Hypot => "hypot",
            BinaryFunction::Pow => "pow",
            BinaryFunction::Wrapped => "wrapped",
        }
    }
}

/// Something that holds or does not.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Condition {
    /// Always or never.
    Constant(bool),
    /// An input that is true or false: position in [`Formula::inputs`].
    Input(u32),
    /// A comparison of numbers; one with a NaN does not hold.
    Compare {
        /// The left side.
        left: Expression,
        /// How the sides are compared.
        by: Comparison,
        /// The right side.
        right: Expression,
    },
    /// Whether two conditions both hold or both do not.
    Same {
        /// The one.
        left: Box<Condition>,
        /// The other.
        right: Box<Condition>,
    },
    /// All of them hold.
    All(Vec<Condition>),
    /// At least one of them holds.
    Any(Vec<Condition>),
    /// It does not hold.
    Not(Box<Condition>),
}

impl Condition {
    /// Whether it contains the simulation time or an integral, so that it changes without a message.
    pub fn reads_time(&self) -> bool {
        self.any_expression(&Expression::reads_time)
    }

    /// Whether it contains the value of a parameter of the space.
    pub fn reads_scene(&self) -> bool {
        self.any_expression(&Expression::reads_scene)
    }

    fn any_expression(&self, is: &dyn Fn(&Expression) -> bool) -> bool {
        match self {
            Condition::Constant(_) | Condition::Input(_) => false,
            Condition::Compare { left, right, .. } => is(left) || is(right),
            Condition::Same { left, right } => left.any_expression(is) || right.any_expression(is),
            Condition::All(parts) | Condition::Any(parts) => parts.iter().any(|part| part.any_expression(is)),
            Condition::Not(of) => of.any_expression(is),
        }
    }
}

/// How two numbers are compared.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Comparison {
    /// `<=`
    AtMost,
    /// `<`
    Below,
    /// `>=`
    AtLeast,
    /// `>`
    Above,
    /// `==`
    Equal,
    /// `!=`
    NotEqual,
}

impl Comparison {
    /// Its sign in the language.
    pub const fn sign(self) -> &'static str {
        match self {
            Comparison::AtMost => "<=",
            Comparison::Below => "<",
            Comparison::AtLeast => ">=",
            Comparison::Above => ">",
            Comparison::Equal => "==",
            Comparison::NotEqual => "!=",
        }
    }

    /// Whether it holds between two numbers; with a NaN none does.
    pub fn holds(self, left: f64, right: f64) -> bool {
        match self {
            Comparison::AtMost => left <= right,
            Comparison::Below => left < right,
            Comparison::AtLeast => left >= right,
            Comparison::Above => left > right,
            Comparison::Equal => left == right,
            Comparison::NotEqual => left != right && !left.is_nan() && !right.is_nan(),
        }
    }
}
