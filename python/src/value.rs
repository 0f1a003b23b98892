//! Payloads as Python's values, with the meaning that they have in the JSON of the process protocol: points are lists
//! of three numbers, messages are dictionaries, and parts that the space does not declare are passed on.

use std::collections::BTreeMap;
use std::sync::Arc;

use pyo3::prelude::*;
use pyo3::sync::PyOnceLock;
use pyo3::types::{PyBool, PyDict, PyFloat, PyInt, PyList, PyString, PyTuple};

use sesame_plan::{CampaignPlan, MessageId, Type, python};
use sesame_relay::message::Mismatch;
use sesame_relay::value::{Fields, Record, Text, Value};

/// The largest whole number up to which reals are exact.
const EXACT: f64 = 9_007_199_254_740_992.0;

/// The latest field names per message type, so that all records of a type share them.
#[derive(Debug, Default)]
pub(crate) struct Shapes(BTreeMap<MessageId, Arc<Fields>>);

/// Reads a payload of a declared type.
pub(crate) fn read(
    plan: &CampaignPlan,
    shapes: &mut Shapes,
    ty: &Type,
    payload: &Bound<'_, PyAny>,
) -> Result<Value, Mismatch> {
    match ty {
        Type::Bool => match payload.cast::<PyBool>() {
            Ok(truth) => Ok(Value::Bool(truth.is_true())),
            Err(_) => Err(mismatch("bool", payload)),
        },
        Type::Int { .. } => int(payload).map(Value::Int),
        Type::Real { .. } => real(payload).map(Value::Real),
        Type::Text => match payload.extract::<&str>() {
            Ok(text) => Ok(Value::Text(text.into())),
            Err(_) => Err(mismatch("text", payload)),
        },
        Type::Point { .. } => {
            let items = items(payload).filter(|items| items.len() == 3).ok_or_else(|| mismatch("point", payload))?;
            let mut point = [0.0; 3];
            for ((place, item), axis) in point.iter_mut().zip(&items).zip(["x", "y", "z"]) {
                *place = real(item).map_err(|mismatch| mismatch.inside(axis))?;
            }
            Ok(Value::Point(point))
        }
        Type::List { of } => {
            let items = items(payload).ok_or_else(|| mismatch("list", payload))?;
            let items = items
                .iter()
                .enumerate()
                .map(|(at, item)| read(plan, shapes, of, item).map_err(|mismatch| mismatch.inside(&format!("[{at}]"))));
            items.collect::<Result<_, _>>().map(Value::List)
        }
        Type::Message { id } => record(plan, shapes, *id, payload).map(Value::Record),
    }
}

fn record(
    plan: &CampaignPlan,
    shapes: &mut Shapes,
    id: MessageId,
    payload: &Bound<'_, PyAny>,
) -> Result<Record, Mismatch> {
    let entries = entries(payload).ok_or_else(|| mismatch("message", payload))?;
    let declared = &plan.message(id).fields;
    let mut names = Vec::with_capacity(entries.len());
    let mut values = Vec::with_capacity(entries.len());
    for (name, value) in entries.iter() {
        let Ok(key) = name.cast::<PyString>() else { return Err(mismatch("a name", &name)) };
        let key = key.to_str().map_err(|_| mismatch("a name", &name))?.to_owned();
        values.push(match declared.iter().find(|field| *field.name == *key) {
            Some(field) if field.optional && value.is_none() => Value::Undeclared(Text::from("null")),
            Some(field) => read(plan, shapes, &field.ty, &value).map_err(|mismatch| mismatch.inside(&key))?,
            None => Value::Undeclared(undeclared(&value).map_err(|mismatch| mismatch.inside(&key))?),
        });
        names.push(key);
    }
    let required = || declared.iter().filter(|field| !field.optional);
    if let Some(missing) = required().find(|field| names.iter().all(|name| *name != field.name)) {
        return Err(Mismatch::missing(&missing.name));
    }
    let same = |fields: &Arc<Fields>| {
        fields.names().len() == names.len() && fields.names().iter().zip(&names).all(|(known, name)| **known == **name)
    };
    let fields = if let Some(fields) = shapes.0.get(&id).filter(|&fields| same(fields)) {
        Arc::clone(fields)
    } else {
        let fields = Fields::new(names.iter().map(String::as_str));
        shapes.0.insert(id, Arc::clone(&fields));
        fields
    };
    Ok(Record::new(&fields, values))
}

fn real(payload: &Bound<'_, PyAny>) -> Result<f64, Mismatch> {
    if let Ok(number) = payload.cast::<PyFloat>() {
        return Ok(number.value());
    }
    match payload.extract::<&str>() {
        Ok("NaN") => return Ok(f64::NAN),
        Ok("Infinity") => return Ok(f64::INFINITY),
        Ok("-Infinity") => return Ok(f64::NEG_INFINITY),
        _ => {}
    }
    if payload.is_instance_of::<PyBool>() {
        return Err(mismatch("real", payload));
    }
    // Also the numbers of other packages, such as those of NumPy.
    payload.extract::<f64>().map_err(|_| mismatch("real", payload))
}

/// A whole number, also as a real.
fn int(payload: &Bound<'_, PyAny>) -> Result<i64, Mismatch> {
    if payload.is_instance_of::<PyBool>() {
        return Err(mismatch("int", payload));
    }
    if let Ok(whole) = payload.extract::<i64>() {
        return Ok(whole);
    }
    match payload.extract::<f64>() {
        #[expect(clippy::cast_possible_truncation, reason = "it is whole and within the exact range")]
        Ok(number) if number.fract() == 0.0 && number.abs() <= EXACT => Ok(number as i64),
        _ => Err(mismatch("int", payload)),
    }
}

/// The items of a list, a tuple, or an array of another package.
pub(crate) fn items<'py>(payload: &Bound<'py, PyAny>) -> Option<Vec<Bound<'py, PyAny>>> {
    if let Ok(list) = payload.cast::<PyList>() {
        return Some(list.iter().collect());
    }
    if let Ok(tuple) = payload.cast::<PyTuple>() {
        return Some(tuple.iter().collect());
    }
    let list = payload.call_method0("tolist").ok()?;
    list.cast::<PyList>().ok().map(|list| list.iter().collect())
}

/// The entries of a dictionary, or the fields of an object with attributes.
fn entries<'py>(payload: &Bound<'py, PyAny>) -> Option<Bound<'py, PyDict>> {
    if let Ok(entries) = payload.cast::<PyDict>() {
        return Some(entries.clone());
    }
    if let Some(fields) = fields_of_class(payload) {
        let entries = PyDict::new(payload.py());
        for (name, value) in fields {
            entries.set_item(name, value).ok()?;
        }
        return Some(entries);
    }
    payload.getattr("__dict__").ok()?.cast_into::<PyDict>().ok()
}

/// The fields of an object of a class that stands for a message of a space, by their names on the wire. Those that are
/// not set are left out.
pub(crate) fn fields_of_class<'py>(payload: &Bound<'py, PyAny>) -> Option<Vec<(String, Bound<'py, PyAny>)>> {
    let names =
        payload.getattr_opt(pyo3::intern!(payload.py(), "__sesame_fields__")).ok()??.cast_into::<PyTuple>().ok()?;
    let fields = names.iter().filter_map(|name| {
        let name = name.cast_into::<PyString>().ok()?;
        let value = payload.getattr(&name).ok()?;
        Some((python::named(name.to_str().ok()?).to_owned(), value))
    });
    Some(fields.collect())
}

/// A function of Python's module for JSON, looked up once.
fn json<'py>(py: Python<'py>, name: &'static str, cell: &'static PyOnceLock<Py<PyAny>>) -> PyResult<Bound<'py, PyAny>> {
    cell.get_or_try_init(py, || py.import("json")?.getattr(name).map(Bound::unbind)).map(|it| it.bind(py).clone())
}

static DUMPS: PyOnceLock<Py<PyAny>> = PyOnceLock::new();
static LOADS: PyOnceLock<Py<PyAny>> = PyOnceLock::new();

/// A part that the space does not declare, in JSON.
pub(crate) fn undeclared(value: &Bound<'_, PyAny>) -> Result<Text, Mismatch> {
    let text = json(value.py(), "dumps", &DUMPS).and_then(|dumps| dumps.call1((value,))?.extract::<String>());
    text.map(Text::from).map_err(|_| mismatch("what JSON can hold", value))
}

/// The same as a value of Python.
pub(crate) fn of_undeclared<'py>(py: Python<'py>, text: &Text) -> PyResult<Bound<'py, PyAny>> {
    json(py, "loads", &LOADS)?.call1((text.as_str(),))
}

/// The payload as Python's.
pub(crate) fn write<'py>(py: Python<'py>, value: &Value) -> PyResult<Bound<'py, PyAny>> {
    Ok(match value {
        Value::Bool(truth) => PyBool::new(py, *truth).to_owned().into_any(),
        Value::Int(whole) => whole.into_pyobject(py)?.into_any(),
        Value::Real(number) => PyFloat::new(py, *number).into_any(),
        Value::Text(text) => PyString::new(py, text.as_str()).into_any(),
        Value::Point(point) => PyList::new(py, point)?.into_any(),
        Value::List(values) => {
            let list = PyList::empty(py);
            for value in values {
                list.append(write(py, value)?)?;
            }
            list.into_any()
        }
        Value::Record(record) => {
            let entries = PyDict::new(py);
            for (name, value) in record.iter() {
                entries.set_item(PyString::intern(py, name.as_str()), write(py, value)?)?;
            }
            entries.into_any()
        }
        Value::Undeclared(text) => of_undeclared(py, text)?,
        Value::Opaque(bytes) => pyo3::types::PyBytes::new(py, bytes).into_any(),
    })
}

/// A payload of its own for whoever receives it: what one part of a simulator changes in it, no other part sees.
pub(crate) fn copied<'py>(payload: &Bound<'py, PyAny>) -> PyResult<Bound<'py, PyAny>> {
    let py = payload.py();
    if payload.is_instance_of::<PyFloat>() || payload.is_instance_of::<PyInt>() || payload.is_instance_of::<PyString>()
    {
        return Ok(payload.clone());
    }
    if let Some(entries) = entries(payload) {
        let copy = PyDict::new(py);
        for (name, value) in entries.iter() {
            copy.set_item(name, copied(&value)?)?;
        }
        return Ok(copy.into_any());
    }
    if let Some(items) = items(payload) {
        let copy = PyList::empty(py);
        for item in items {
            copy.append(copied(&item)?)?;
        }
        return Ok(copy.into_any());
    }
    Ok(payload.clone())
}

pub(crate) fn mismatch(expected: &'static str, payload: &Bound<'_, PyAny>) -> Mismatch {
    let found = if payload.is_none() {
        "null"
    } else if payload.is_instance_of::<PyBool>() {
        "bool"
    } else if payload.is_instance_of::<PyString>() {
        "text"
    } else if entries(payload).is_some() {
        "an object"
    } else if items(payload).is_some() {
        if expected == "point" { "a list that is not [x, y, z]" } else { "a list" }
    } else if expected == "int" && payload.is_instance_of::<PyFloat>() {
        "a number that is not whole"
    } else if payload.is_instance_of::<PyInt>() {
        if expected == "int" || expected == "real" { "a number that is too large" } else { "a number" }
    } else if payload.is_instance_of::<PyFloat>() {
        "a number"
    } else {
        "an object of Python"
    };
    Mismatch { path: Vec::new(), expected, found }
}
