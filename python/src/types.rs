//! Messages as hooks get and return them: objects of the classes that `sesamec generate --python` writes, or else of
//! `types.SimpleNamespace`. What the space does not declare is passed on.

use std::sync::Arc;

use pyo3::exceptions::PyTypeError;
use pyo3::prelude::*;
use pyo3::types::{PyBool, PyDict, PyFloat, PyList, PyString};

use sesame_plan::{CampaignPlan, MessageId, Type, python};
use sesame_relay::message::Mismatch;
use sesame_relay::value::{Fields, Record, Text, Value};

use crate::value::{self, Shapes};

/// The classes of a space's messages.
#[derive(Debug)]
pub(crate) struct Types {
    /// In place of a class.
    namespace: Py<PyAny>,
    /// For each message.
    messages: Vec<Message>,
}

#[derive(Debug)]
struct Message {
    class: Option<Py<PyAny>>,
    /// For each field.
    attributes: Vec<Py<PyString>>,
}

/// Why a payload cannot be made or read.
#[derive(Debug)]
pub(crate) enum Unfit {
    /// It is not of its declared type.
    Mismatch(Mismatch),
    /// Python raised something.
    Raised(PyErr),
}

impl From<Mismatch> for Unfit {
    fn from(mismatch: Mismatch) -> Self {
        Unfit::Mismatch(mismatch)
    }
}

impl From<PyErr> for Unfit {
    fn from(error: PyErr) -> Self {
        Unfit::Raised(error)
    }
}

impl Unfit {
    fn inside(self, name: &str) -> Self {
        match self {
            Unfit::Mismatch(mismatch) => Unfit::Mismatch(mismatch.inside(name)),
            raised @ Unfit::Raised(_) => raised,
        }
    }
}

impl Types {
    /// With the registered classes, by the names of messages.
    pub(crate) fn new(py: Python<'_>, plan: &CampaignPlan, classes: &Bound<'_, PyDict>) -> PyResult<Self> {
        let messages = plan.messages.iter().map(|message| {
            let name = |name: &str| PyString::intern(py, &python::attribute(name)).unbind();
            let attributes = message.fields.iter().map(|field| name(&field.name)).collect();
            Ok(Message { class: classes.get_item(&message.name)?.map(Bound::unbind), attributes })
        });
        let messages = messages.collect::<PyResult<_>>()?;
        let namespace = py.import("types")?.getattr("SimpleNamespace")?.unbind();
        Ok(Types { namespace, messages })
    }

    /// A payload of a declared type as hooks get it.
    pub(crate) fn object<'py>(
        &self,
        py: Python<'py>,
        plan: &CampaignPlan,
        ty: &Type,
        payload: &Value,
    ) -> Result<Bound<'py, PyAny>, Unfit> {
        Ok(match (ty, payload) {
            (Type::Bool, Value::Bool(truth)) => PyBool::new(py, *truth).to_owned().into_any(),
            (Type::Real { .. }, Value::Real(number)) => PyFloat::new(py, *number).into_any(),
            #[expect(clippy::cast_precision_loss, reason = "as JSON reads it")]
            (Type::Real { .. }, Value::Int(whole)) => PyFloat::new(py, *whole as f64).into_any(),
            (Type::Int { .. }, Value::Int(_))
            | (Type::Text, Value::Text(_))
            | (Type::Point { .. }, Value::Point(_)) => value::write(py, payload)?,
            (Type::List { of }, Value::List(items)) => {
                let list = PyList::empty(py);
                for (at, item) in items.iter().enumerate() {
                    let item = self.object(py, plan, of, item).map_err(|unfit| unfit.inside(&format!("[{at}]")))?;
                    list.append(item)?;
                }
                list.into_any()
            }
            (Type::Message { id }, Value::Record(record)) => self.message(py, plan, *id, record)?,
            (Type::Bool, _) => return Err(Mismatch::new("bool", payload).into()),
            (Type::Real { .. }, _) => return Err(Mismatch::new("real", payload).into()),
            (Type::Int { .. }, _) => return Err(Mismatch::new("int", payload).into()),
            (Type::Text, _) => return Err(Mismatch::new("text", payload).into()),
            (Type::Point { .. }, _) => return Err(Mismatch::new("point", payload).into()),
            (Type::List { .. }, _) => return Err(Mismatch::new("list", payload).into()),
            (Type::Message { .. }, _) => return Err(Mismatch::new("message", payload).into()),
        })
    }

    fn message<'py>(
        &self,
        py: Python<'py>,
        plan: &CampaignPlan,
        id: MessageId,
        record: &Record,
    ) -> Result<Bound<'py, PyAny>, Unfit> {
        let Message { class, attributes } = &self.messages[id.index()];
        let declared = &plan.message(id).fields;
        let given = PyDict::new(py);
        for (field, attribute) in declared.iter().zip(attributes) {
            let part = match record.get(&field.name) {
                None if field.optional && class.is_none() => continue,
                None | Some(Value::Undeclared(_)) if field.optional => py.None().into_bound(py),
                None => return Err(Mismatch::missing(&field.name).into()),
                Some(part) => self.object(py, plan, &field.ty, part).map_err(|unfit| unfit.inside(&field.name))?,
            };
            given.set_item(attribute, part)?;
        }
        if let Some(class) = class {
            return Ok(class.bind(py).call((), Some(&given))?);
        }
        for (name, part) in record.iter().filter(|(name, _)| declared.iter().all(|field| *field.name != ***name)) {
            given.set_item(&*python::attribute(name), value::write(py, part)?)?;
        }
        Ok(self.namespace.bind(py).call((), Some(&given))?)
    }

    /// Writes what a hook made into the payload that it was made from, or of which it is a copy. Parts that the space
    /// does not declare stay, unless the hook changed them.
    pub(crate) fn write_back(
        &self,
        plan: &CampaignPlan,
        shapes: &mut Shapes,
        ty: &Type,
        payload: &mut Value,
        made: &Bound<'_, PyAny>,
    ) -> Result<(), Unfit> {
        match (ty, &mut *payload) {
            (Type::List { of }, Value::List(items)) => {
                let new = value::items(made).ok_or_else(|| value::mismatch("list", made))?;
                items.truncate(new.len());
                for (at, item) in new.iter().enumerate() {
                    let inside = |unfit: Unfit| unfit.inside(&format!("[{at}]"));
                    match items.get_mut(at) {
                        Some(old) => self.write_back(plan, shapes, of, old, item).map_err(inside)?,
                        None => items.push(self.read(plan, shapes, of, item).map_err(inside)?),
                    }
                }
            }
            (Type::Message { id }, Value::Record(record)) => self.write_message(plan, shapes, *id, record, made)?,
            #[expect(clippy::cast_precision_loss, reason = "as JSON reads it")]
            (Type::Real { .. }, Value::Int(whole)) => {
                let old = *whole as f64;
                match value::read(plan, shapes, ty, made)? {
                    // One number in JSON.
                    Value::Real(new) if new.to_bits() == old.to_bits() => {}
                    new => *payload = new,
                }
            }
            _ => *payload = self.read(plan, shapes, ty, made)?,
        }
        Ok(())
    }

    /// A payload that a hook made and that no message had before.
    fn read(
        &self,
        plan: &CampaignPlan,
        shapes: &mut Shapes,
        ty: &Type,
        made: &Bound<'_, PyAny>,
    ) -> Result<Value, Unfit> {
        match ty {
            Type::List { .. } => {
                let mut list = Value::List(Vec::new());
                self.write_back(plan, shapes, ty, &mut list, made)?;
                Ok(list)
            }
            Type::Message { id } => {
                let mut record = Record::new(&Fields::new([]), Vec::new());
                self.write_message(plan, shapes, *id, &mut record, made)?;
                Ok(record.into())
            }
            _ => Ok(value::read(plan, shapes, ty, made)?),
        }
    }

    fn write_message(
        &self,
        plan: &CampaignPlan,
        shapes: &mut Shapes,
        id: MessageId,
        record: &mut Record,
        made: &Bound<'_, PyAny>,
    ) -> Result<(), Unfit> {
        let message = plan.message(id);
        let parts = parts(made).ok_or_else(|| value::mismatch("message", made))?;
        let mut added: Vec<(&str, Value)> = Vec::new();
        for field in &message.fields {
            let inside = |unfit: Unfit| unfit.inside(&field.name);
            let Some((_, part)) = parts.iter().find(|(name, _)| *name == field.name) else {
                if field.optional {
                    continue;
                }
                return Err(Mismatch::missing(&field.name).into());
            };
            let none = field.optional && part.is_none();
            match record.get_mut(&field.name) {
                Some(Value::Undeclared(_)) | None if none => {}
                Some(old) if none => *old = Value::Undeclared(Text::from("null")),
                Some(old @ Value::Undeclared(_)) => {
                    *old = self.read(plan, shapes, &field.ty, part).map_err(inside)?;
                }
                Some(old) => self.write_back(plan, shapes, &field.ty, old, part).map_err(inside)?,
                None => added.push((&field.name, self.read(plan, shapes, &field.ty, part).map_err(inside)?)),
            }
        }
        for (name, part) in parts.iter().filter(|(name, _)| message.fields.iter().all(|field| field.name != *name)) {
            match record.get_mut(name) {
                Some(Value::Undeclared(text)) => {
                    if !value::of_undeclared(part.py(), text)?.eq(part)? {
                        *text = value::undeclared(part)?;
                    }
                }
                // A note of the user's.
                _ if name.starts_with('_') => {}
                _ => return Err(Unfit::Raised(unknown(&message.name, &message.fields, name))),
            }
        }
        if !added.is_empty() {
            let old: Vec<(Text, Value)> = record.iter().map(|(name, value)| (name.clone(), value.clone())).collect();
            let names = old.iter().map(|(name, _)| name.as_str()).chain(added.iter().map(|(name, _)| *name));
            let fields: Arc<Fields> = Fields::new(names);
            let values = old.iter().map(|(_, value)| value.clone()).chain(added.iter().map(|(_, value)| value.clone()));
            *record = Record::new(&fields, values.collect());
        }
        Ok(())
    }
}

/// The parts of a message that a hook made, by their names on the wire.
fn parts<'py>(made: &Bound<'py, PyAny>) -> Option<Vec<(String, Bound<'py, PyAny>)>> {
    let text = |name: &Bound<'py, PyAny>| name.extract::<String>().ok();
    if let Ok(entries) = made.cast::<PyDict>() {
        return entries.iter().map(|(name, part)| Some((text(&name)?, part))).collect();
    }
    if let Some(fields) = value::fields_of_class(made) {
        return Some(fields);
    }
    let entries = made.getattr("__dict__").ok()?.cast_into::<PyDict>().ok()?;
    entries.iter().map(|(name, part)| Some((python::named(&text(&name)?).to_owned(), part))).collect()
}

fn unknown(message: &str, fields: &[sesame_plan::Field], name: &str) -> PyErr {
    let names: Vec<String> = fields.iter().map(|field| python::attribute(&field.name).into_owned()).collect();
    PyTypeError::new_err(format!("message `{message}` has no field `{name}`: it has {}", names.join(", ")))
}
