//! Numbers as the wires of ROS have them.

use sesame_plan::Primitive;

use crate::value::Value;

/// The value of a number on the wire, from its bits; `None` for a `uint64` of 2^63 or more, which the language does not
/// have.
#[expect(
    clippy::cast_possible_truncation,
    clippy::cast_possible_wrap,
    reason = "each has the size of its primitive, whose bits it holds"
)]
pub fn value_of(primitive: Primitive, bits: u64) -> Option<Value> {
    Some(match primitive {
        Primitive::Bool => Value::Bool(bits != 0),
        Primitive::Int8 => Value::Int(i64::from(bits as i8)),
        Primitive::Int16 => Value::Int(i64::from(bits as i16)),
        Primitive::Int32 => Value::Int(i64::from(bits as i32)),
        Primitive::Int64 => Value::Int(bits as i64),
        Primitive::Uint8 | Primitive::Uint16 | Primitive::Uint32 | Primitive::Uint64 => {
            Value::Int(i64::try_from(bits).ok()?)
        }
        Primitive::Float32 => Value::Real(f64::from(f32::from_bits(bits as u32))),
        Primitive::Float64 => Value::Real(f64::from_bits(bits)),
    })
}

/// The bits of a number, held inside the range of its primitive: whole numbers beyond it become its nearest number,
/// reals are rounded to the nearest one that it has. Without a number they are zero.
#[expect(
    clippy::cast_possible_truncation,
    clippy::cast_sign_loss,
    reason = "whole numbers are clamped before; a real that is written as a single is rounded to the nearest one"
)]
pub fn bits_of(primitive: Primitive, value: Option<&Value>) -> u64 {
    let real = match value {
        Some(Value::Real(real)) => *real,
        Some(Value::Int(number)) => *number as f64,
        Some(Value::Bool(truth)) => f64::from(u8::from(*truth)),
        _ => 0.0,
    };
    let whole = match value {
        Some(Value::Int(number)) => *number,
        _ => real.round() as i64,
    };
    let clamped = |low: i64, high: i64| whole.clamp(low, high) as u64;
    match primitive {
        Primitive::Bool => u64::from(whole != 0),
        Primitive::Int8 => clamped(i8::MIN.into(), i8::MAX.into()),
        Primitive::Uint8 => clamped(0, u8::MAX.into()),
        Primitive::Int16 => clamped(i16::MIN.into(), i16::MAX.into()),
        Primitive::Uint16 => clamped(0, u16::MAX.into()),
        Primitive::Int32 => clamped(i32::MIN.into(), i32::MAX.into()),
        Primitive::Uint32 => clamped(0, u32::MAX.into()),
        Primitive::Int64 => whole as u64,
        Primitive::Uint64 => clamped(0, i64::MAX),
        Primitive::Float32 => u64::from((real as f32).to_bits()),
        Primitive::Float64 => real.to_bits(),
    }
}

/// A time in seconds as whole seconds, rounded down, and the nanoseconds after them.
#[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "casts of reals saturate")]
pub fn seconds_and_nanos(time: f64) -> (i64, u32) {
    let whole = time.floor();
    let nanos = ((time - whole) * 1e9).round();
    let (whole, nanos) = if nanos >= 1e9 { (whole + 1.0, 0.0) } else { (whole, nanos) };
    (whole as i64, nanos as u32)
}
