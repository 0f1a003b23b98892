//! Payloads of any format as trees: where texts, JSON and the protocol's own messages meet.

use std::borrow::Cow;

use sesame_relay::message::Mismatch;
use sesame_relay::value::Value;

use crate::expected_type::ExpectedType;

/// The largest whole number up to which reals are exact.
const EXACT: f64 = 9_007_199_254_740_992.0;

/// A payload as it is on the wire.
#[derive(Debug, Clone, PartialEq)]
pub(crate) enum Tree {
    Nothing,
    Bool(bool),
    /// Wide enough for all whole numbers of the wire.
    Int(i128),
    Real(f64),
    Text(String),
    List(Vec<Tree>),
    Fields(Vec<(Cow<'static, str>, Tree)>),
}

impl Tree {
    pub(crate) fn kind(&self) -> &'static str {
        match self {
            Tree::Nothing => "nothing",
            Tree::Bool(_) => "bool",
            Tree::Int(_) => "int",
            Tree::Real(_) => "real",
            Tree::Text(_) => "text",
            Tree::List(_) => "list",
            Tree::Fields(_) => "message",
        }
    }

    pub(crate) fn field(&self, name: &str) -> Option<&Tree> {
        let Tree::Fields(fields) = self else { return None };
        fields.iter().find(|(known, _)| known == name).map(|(_, tree)| tree)
    }

    pub(crate) fn mismatch(&self, expected: &'static str) -> Mismatch {
        Mismatch { path: Vec::new(), expected, found: self.kind() }
    }

    /// A real number, also from a whole one, or from the text that stands for what JSON has no number for.
    pub(crate) fn real(&self) -> Result<f64, Mismatch> {
        match self {
            Tree::Real(x) => Ok(*x),
            Tree::Int(n) => Ok(*n as f64),
            Tree::Text(text) => match text.as_str() {
                "NaN" => Ok(f64::NAN),
                "Infinity" => Ok(f64::INFINITY),
                "-Infinity" => Ok(f64::NEG_INFINITY),
                _ => Err(self.mismatch("real")),
            },
            _ => Err(self.mismatch("real")),
        }
    }

    /// A whole number, also written as a real one.
    pub(crate) fn whole(&self) -> Result<i128, Mismatch> {
        match self {
            Tree::Int(n) => Ok(*n),
            #[expect(clippy::cast_possible_truncation, reason = "it is whole and within the exact range")]
            Tree::Real(x) if x.fract() == 0.0 && x.abs() <= EXACT => Ok(*x as i128),
            Tree::Real(_) => Err(Mismatch { path: Vec::new(), expected: "int", found: "a number that is not whole" }),
            _ => Err(self.mismatch("int")),
        }
    }

    /// The value as this type.
    pub(crate) fn read(&self, expected: &ExpectedType) -> Result<Value, Mismatch> {
        match expected {
            ExpectedType::Bool => match self {
                Tree::Bool(truth) => Ok(Value::Bool(*truth)),
                _ => Err(self.mismatch("bool")),
            },
            ExpectedType::Int => {
                let whole = self.whole()?;
                let large = |_| Mismatch { path: Vec::new(), expected: "int", found: "a number that is too large" };
                i64::try_from(whole).map(Value::Int).map_err(large)
            }
            ExpectedType::Real => self.real().map(Value::Real),
            ExpectedType::Text => match self {
                Tree::Text(text) => Ok(Value::Text(text.as_str().into())),
                _ => Err(self.mismatch("text")),
            },
            ExpectedType::Point => self.point().map(Value::Point),
            ExpectedType::List(of) => {
                let Tree::List(items) = self else { return Err(self.mismatch("list")) };
                let items = items.iter().enumerate();
                let items = items.map(|(at, item)| item.read(of).map_err(|error| error.inside(&format!("[{at}]"))));
                items.collect::<Result<_, _>>().map(Value::List)
            }
            ExpectedType::Record(fields) => {
                let Tree::Fields(_) = self else { return Err(self.mismatch("message")) };
                fields.read(|name| self.field(name)).map(Value::Record)
            }
        }
    }

    /// `x`, `y` and `z` of a message, or of a list.
    fn point(&self) -> Result<[f64; 3], Mismatch> {
        let mut point = [0.0; 3];
        for (at, axis) in ["x", "y", "z"].into_iter().enumerate() {
            let coordinate = match self {
                Tree::List(items) if items.len() == 3 => &items[at],
                Tree::Fields(_) => self.field(axis).ok_or_else(|| Mismatch::missing(axis))?,
                _ => return Err(self.mismatch("point")),
            };
            point[at] = coordinate.real().map_err(|error| error.inside(axis))?;
        }
        Ok(point)
    }

    /// A tree that has nothing but this value.
    pub(crate) fn of(value: &Value) -> Tree {
        match value {
            Value::Bool(truth) => Tree::Bool(*truth),
            Value::Int(n) => Tree::Int(i128::from(*n)),
            Value::Real(x) => Tree::Real(*x),
            Value::Text(text) | Value::Undeclared(text) => Tree::Text(text.to_string()),
            Value::Opaque(bytes) => Tree::Text(String::from_utf8_lossy(bytes).into_owned()),
            Value::Point(axes) => Tree::List(axes.map(Tree::Real).to_vec()),
            Value::List(items) => Tree::List(items.iter().map(Tree::of).collect()),
            Value::Record(record) => {
                let fields = record.iter().map(|(name, value)| (Cow::Owned(name.to_string()), Tree::of(value)));
                Tree::Fields(fields.collect())
            }
        }
    }

    /// Writes a value over this, and leaves what the value does not have.
    pub(crate) fn write(&mut self, value: &Value) {
        match (&mut *self, value) {
            (Tree::Fields(fields), Value::Record(record)) => {
                for (name, value) in record.iter() {
                    match fields.iter_mut().find(|(known, _)| known == name.as_str()) {
                        Some((_, tree)) => tree.write(value),
                        None => fields.push((Cow::Owned(name.to_string()), Tree::of(value))),
                    }
                }
            }
            (Tree::Fields(fields), Value::Point(axes)) => {
                for (axis, coordinate) in ["x", "y", "z"].into_iter().zip(axes) {
                    match fields.iter_mut().find(|(known, _)| known == axis) {
                        Some((_, tree)) => *tree = Tree::Real(*coordinate),
                        None => fields.push((Cow::Borrowed(axis), Tree::Real(*coordinate))),
                    }
                }
            }
            (Tree::List(trees), Value::List(items)) => {
                trees.truncate(items.len());
                for (at, item) in items.iter().enumerate() {
                    match trees.get_mut(at) {
                        Some(tree) => tree.write(item),
                        None => trees.push(Tree::of(item)),
                    }
                }
            }
            (tree, value) => *tree = Tree::of(value),
        }
    }
}
