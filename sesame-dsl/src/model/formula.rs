//! Declarative metrics: what they compute, with units resolved.
//!
//! Numbers are in the units of the wire or of a conversion that is part of the expression; so whoever evaluates one needs
//! no units.

use sesame_plan::{Comparison, Members};

use super::system::FieldPath;

/// A metric computed from messages without any code of the user.
#[derive(Debug, Clone, PartialEq)]
pub struct Formula {
    /// What its expressions refer to by position; each once, at least one.
    pub inputs: Vec<Input>,
    /// What becomes of the values over time.
    pub aggregate: Aggregate,
    /// Only messages at which it holds count.
    pub when: Option<Condition>,
    /// Shortest simulation time between two messages that count, in seconds; positive.
    pub every: Option<f64>,
    /// A text or whole number in the messages of one of the inputs' topics: one state for each of its values.
    pub per: Option<FieldPath>,
    /// Whether it hears messages after operations, as they are delivered, and not as they were published.
    pub outbound: bool,
}

/// A value held from the messages of a topic.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Input {
    /// Where it comes from.
    pub field: FieldPath,
    /// What is made of a group's members.
    pub members: Members,
}

/// How a formula's values become the metric's.
#[derive(Debug, Clone, PartialEq)]
pub enum Aggregate {
    /// The last value.
    Last(Expression),
    /// The least value.
    Min(Expression),
    /// The greatest value.
    Max(Expression),
    /// The mean over messages.
    Mean(Expression),
    /// The number of messages at which it held.
    Count(Condition),
    /// The simulation time during which it held, in seconds.
    Duration(Condition),
}

/// A number computed from inputs.
#[derive(Debug, Clone, PartialEq)]
pub enum Expression {
    /// A constant.
    Constant(f64),
    /// An input that is a number.
    Input(usize),
    /// The number with its sign changed.
    Negate(Box<Expression>),
    /// The sum of two or more.
    Sum(Vec<Expression>),
    /// The product of two or more.
    Product(Vec<Expression>),
    /// The first divided by the second.
    Divide(Box<Expression>, Box<Expression>),
    /// The number without its sign.
    Absolute(Box<Expression>),
    /// The least of two or more.
    Min(Vec<Expression>),
    /// The greatest of two or more.
    Max(Vec<Expression>),
    /// How far two inputs that are points are from each other, in the unit of the first; and how many of its units one
    /// of the second is.
    Distance(usize, usize, f64),
}

impl Expression {
    /// How many expressions are inside of each other, this one included.
    pub fn depth(&self) -> usize {
        1 + match self {
            Expression::Constant(_) | Expression::Input(_) | Expression::Distance(..) => 0,
            Expression::Negate(of) | Expression::Absolute(of) => of.depth(),
            Expression::Divide(value, by) => value.depth().max(by.depth()),
            Expression::Sum(of) | Expression::Product(of) | Expression::Min(of) | Expression::Max(of) => {
                of.iter().map(Expression::depth).max().unwrap_or(0)
            }
        }
    }
}

/// Something that holds or does not.
#[derive(Debug, Clone, PartialEq)]
pub enum Condition {
    /// Always or never.
    Constant(bool),
    /// An input that is true or false.
    Input(usize),
    /// A comparison of numbers.
    Compare(Expression, Comparison, Expression),
    /// Whether two conditions both hold or both do not.
    Same(Box<Condition>, Box<Condition>),
    /// All of two or more hold.
    All(Vec<Condition>),
    /// At least one of two or more holds.
    Any(Vec<Condition>),
    /// It does not hold.
    Not(Box<Condition>),
}

impl Condition {
    /// How many conditions and expressions are inside of each other, this one included.
    pub fn depth(&self) -> usize {
        1 + match self {
            Condition::Constant(_) | Condition::Input(_) => 0,
            Condition::Compare(left, _, right) => left.depth().max(right.depth()),
            Condition::Not(of) => of.depth(),
            Condition::Same(left, right) => left.depth().max(right.depth()),
            Condition::All(of) | Condition::Any(of) => of.iter().map(Condition::depth).max().unwrap_or(0),
        }
    }
}
