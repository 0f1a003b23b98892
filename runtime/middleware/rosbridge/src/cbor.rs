//! Messages in CBOR: a frame of bytes with the same operation, in which lists of numbers are typed arrays (RFC 8746).

#[cfg(feature = "client")]
pub(crate) mod replace;

use ciborium::Value as Cbor;
use serde_json::{Map, Number, Value};

/// Why bytes are not a message.
#[derive(Debug, thiserror::Error)]
pub enum CborError {
    /// They are not CBOR.
    #[error("not CBOR: {0}")]
    Syntax(String),
    /// They hold something that JSON does not.
    #[error("{0} in CBOR is not part of a message")]
    Kind(&'static str),
    /// A typed array does not end with an element.
    #[error("a typed array of {tag} has {length} bytes")]
    Array {
        /// The tag.
        tag: u64,
        /// Its length.
        length: usize,
    },
    /// It is nested more deeply than messages are.
    #[error("nested more than {DEPTH} times")]
    Deep,
}

/// How deeply messages may be nested.
const DEPTH: usize = 64;

/// What bytes in CBOR are as JSON: typed arrays as lists of numbers, byte strings as lists of bytes. Numbers that are
/// not finite are `null`, as in the JSON of this protocol.
pub fn read(bytes: &[u8]) -> Result<Value, CborError> {
    let found: Cbor = ciborium::de::from_reader_with_recursion_limit(bytes, DEPTH * 2)
        .map_err(|error| CborError::Syntax(error.to_string()))?;
    json(&found, 0)
}

fn json(value: &Cbor, depth: usize) -> Result<Value, CborError> {
    if depth > DEPTH {
        return Err(CborError::Deep);
    }
    Ok(match value {
        Cbor::Null => Value::Null,
        Cbor::Bool(truth) => Value::Bool(*truth),
        Cbor::Integer(number) => {
            let number = i128::from(*number);
            let found = u64::try_from(number).map(Number::from).or_else(|_| i64::try_from(number).map(Number::from));
            Value::Number(found.map_err(|_| CborError::Kind("an integer of more than 64 bits"))?)
        }
        Cbor::Float(number) => real(*number),
        Cbor::Text(text) => Value::String(text.clone()),
        Cbor::Bytes(bytes) => bytes.iter().map(|&byte| Value::from(byte)).collect(),
        Cbor::Array(items) => {
            Value::Array(items.iter().map(|item| json(item, depth + 1)).collect::<Result<Vec<_>, _>>()?)
        }
        Cbor::Map(entries) => {
            let mut fields = Map::new();
            for (key, value) in entries {
                let Cbor::Text(key) = key else { return Err(CborError::Kind("a key that is not text")) };
                fields.insert(key.clone(), json(value, depth + 1)?);
            }
            Value::Object(fields)
        }
        Cbor::Tag(tag, inner) => match &**inner {
            Cbor::Bytes(bytes) => typed(*tag, bytes)?,
            // Other tags say how something is meant, not what it is.
            inner => json(inner, depth + 1)?,
        },
        _ => return Err(CborError::Kind("an unknown kind")),
    })
}

fn real(number: f64) -> Value {
    Number::from_f64(number).map_or(Value::Null, Value::Number)
}

/// A typed array of RFC 8746, section 2.
fn typed(tag: u64, bytes: &[u8]) -> Result<Value, CborError> {
    /// Each element, as a number of so many bytes.
    macro_rules! elements {
        ($ty:ty, $from:ident, $make:expr) => {{
            const SIZE: usize = size_of::<$ty>();
            let chunks = bytes.chunks_exact(SIZE);
            if !chunks.remainder().is_empty() {
                return Err(CborError::Array { tag, length: bytes.len() });
            }
            let make: fn($ty) -> Value = $make;
            chunks
                .map(|chunk| make(<$ty>::$from(chunk.try_into().expect("a chunk has the size of its type"))))
                .collect()
        }};
    }
    Ok(match tag {
        64 | 68 => elements!(u8, from_be_bytes, Value::from),
        65 => elements!(u16, from_be_bytes, Value::from),
        66 => elements!(u32, from_be_bytes, Value::from),
        67 => elements!(u64, from_be_bytes, Value::from),
        69 => elements!(u16, from_le_bytes, Value::from),
        70 => elements!(u32, from_le_bytes, Value::from),
        71 => elements!(u64, from_le_bytes, Value::from),
        72 => elements!(i8, from_be_bytes, Value::from),
        73 => elements!(i16, from_be_bytes, Value::from),
        74 => elements!(i32, from_be_bytes, Value::from),
        75 => elements!(i64, from_be_bytes, Value::from),
        77 => elements!(i16, from_le_bytes, Value::from),
        78 => elements!(i32, from_le_bytes, Value::from),
        79 => elements!(i64, from_le_bytes, Value::from),
        81 => elements!(f32, from_be_bytes, |x| real(f64::from(x))),
        82 => elements!(f64, from_be_bytes, real),
        85 => elements!(f32, from_le_bytes, |x| real(f64::from(x))),
        86 => elements!(f64, from_le_bytes, real),
        // Half and quadruple precision, which no message of ROS has.
        80 | 83 | 84 | 87 => return Err(CborError::Kind("a typed array of half or quadruple precision")),
        _ => bytes.iter().map(|&byte| Value::from(byte)).collect(),
    })
}

/// A value as CBOR. Lists of numbers with a fraction are typed arrays of `f64`, lists of others are lists.
pub fn write(value: &Value) -> Vec<u8> {
    let mut bytes = Vec::new();
    ciborium::into_writer(&cbor(value), &mut bytes).expect("memory takes all bytes");
    bytes
}

fn cbor(value: &Value) -> Cbor {
    match value {
        Value::Null => Cbor::Null,
        Value::Bool(truth) => Cbor::Bool(*truth),
        Value::Number(number) => match (number.as_u64(), number.as_i64()) {
            (Some(number), _) => Cbor::from(number),
            (_, Some(number)) => Cbor::from(number),
            _ => Cbor::Float(number.as_f64().unwrap_or(f64::NAN)),
        },
        Value::String(text) => Cbor::Text(text.clone()),
        Value::Array(items) => {
            let reals: Option<Vec<f64>> = items.iter().map(|item| item.as_f64().filter(|_| item.is_f64())).collect();
            match reals {
                Some(reals) if !reals.is_empty() => {
                    let bytes = reals.iter().flat_map(|real| real.to_le_bytes()).collect();
                    Cbor::Tag(86, Box::new(Cbor::Bytes(bytes)))
                }
                _ => Cbor::Array(items.iter().map(cbor).collect()),
            }
        }
        Value::Object(fields) => {
            Cbor::Map(fields.iter().map(|(key, value)| (Cbor::Text(key.clone()), cbor(value))).collect())
        }
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;
    use serde_json::json;

    use super::*;

    fn any_message() -> impl Strategy<Value = Value> {
        let leaf = prop_oneof![
            Just(Value::Null),
            any::<bool>().prop_map(Value::from),
            any::<i64>().prop_map(Value::from),
            any::<u64>().prop_map(Value::from),
            (-1e9f64..1e9).prop_map(Value::from),
            "[a-zä]{0,8}".prop_map(Value::from),
            prop::collection::vec(-1e3f64..1e3, 0..5).prop_map(Value::from),
        ];
        leaf.prop_recursive(4, 40, 5, |inner| {
            prop_oneof![
                prop::collection::vec(inner.clone(), 0..5).prop_map(Value::from),
                prop::collection::btree_map("[a-z]{1,5}", inner, 0..5)
                    .prop_map(|fields| Value::Object(fields.into_iter().collect())),
            ]
        })
    }

    proptest! {
        #[test]
        fn a_message_comes_back(message in any_message()) {
            prop_assert_eq!(read(&write(&message)).unwrap(), message);
        }

        #[test]
        fn any_bytes_are_a_message_or_an_error(bytes in prop::collection::vec(any::<u8>(), 0..300)) {
            let _ = read(&bytes);
        }
    }

    /// {"a": …} with a typed array.
    fn with_array(tag: u8, bytes: &[u8]) -> Vec<u8> {
        let length = u8::try_from(bytes.len()).unwrap();
        [&[0xa1, 0x61, b'a', 0xd8, tag, 0x58, length][..], bytes].concat()
    }

    #[test]
    fn typed_arrays_of_the_standard_are_lists_of_numbers() {
        let read = |tag, bytes: &[u8]| super::read(&with_array(tag, bytes)).unwrap()["a"].clone();
        assert_eq!(read(64, &[1, 255]), json!([1, 255]));
        assert_eq!(read(69, &[1, 2, 0, 128]), json!([513, 32768]));
        assert_eq!(read(72, &[255, 128]), json!([-1, -128]));
        assert_eq!(read(78, &(-7i32).to_le_bytes()), json!([-7]));
        assert_eq!(read(82, &1.5f64.to_be_bytes()), json!([1.5]));
        assert_eq!(read(85, &[0.25f32.to_le_bytes(), f32::NAN.to_le_bytes()].concat()), json!([0.25, null]));
        let half = super::read(&with_array(85, &[0; 6])).unwrap_err().to_string();
        assert_eq!(half, "a typed array of 85 has 6 bytes");
    }

    #[test]
    fn nesting_without_end_is_refused() {
        let mut deep = vec![0x81; 100_000];
        deep.push(0x00);
        assert!(read(&deep).is_err());
    }
}
