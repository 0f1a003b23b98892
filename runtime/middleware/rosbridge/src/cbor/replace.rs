//! One text in bytes of CBOR in place of another one, with everything else as it came: so that a message passes through
//! a proxy without being read.

/// Deeper than messages are nested.
const DEPTH: usize = 128;

/// What an item begins with: its kind, and a number whose meaning depends on the kind. `None` for one that goes on
/// until it says that it ends.
struct Head {
    kind: u8,
    number: Option<u64>,
    /// Where it ends.
    end: usize,
}

const BYTES: u8 = 2;
const TEXT: u8 = 3;
const LIST: u8 = 4;
const MAP: u8 = 5;
const TAG: u8 = 6;
const BREAK: u8 = 0xff;

/// The same map with another text under this key; `None` if there is no text under it, if `new` wants to keep it, or if
/// these bytes are not a map in CBOR.
pub(crate) fn text(bytes: &[u8], key: &str, new: impl FnOnce(&str) -> Option<String>) -> Option<Vec<u8>> {
    let map = head(bytes, 0).filter(|head| head.kind == MAP)?;
    let (mut at, mut left) = (map.end, map.number);
    while left != Some(0) && bytes.get(at) != Some(&BREAK) {
        let (found, value) = whole_text(bytes, at)
            .map_or_else(|| Some((None, end(bytes, at)?)), |(text, end)| Some((Some(text), end)))?;
        let end = end(bytes, value)?;
        if found == Some(key) {
            let text = new(whole_text(bytes, value)?.0)?;
            let mut replaced = bytes[..value].to_vec();
            write_head(TEXT, text.len(), &mut replaced);
            replaced.extend_from_slice(text.as_bytes());
            replaced.extend_from_slice(&bytes[end..]);
            return Some(replaced);
        }
        at = end;
        left = left.map(|left| left - 1);
    }
    None
}

/// The text that begins here, if it is not in pieces, and where it ends.
fn whole_text(bytes: &[u8], at: usize) -> Option<(&str, usize)> {
    let head = head(bytes, at).filter(|head| head.kind == TEXT)?;
    let end = head.end.checked_add(usize::try_from(head.number?).ok()?)?;
    Some((std::str::from_utf8(bytes.get(head.end..end)?).ok()?, end))
}

/// Where the item ends that begins here. It takes no more memory than the item is deep.
fn end(bytes: &[u8], mut at: usize) -> Option<usize> {
    // How many items each open list or map still has; `None` for one that says where it ends.
    let mut open: Vec<Option<u64>> = vec![Some(1)];
    while let Some(left) = open.last_mut() {
        match left {
            Some(0) => {
                open.pop();
                continue;
            }
            Some(left) => *left -= 1,
            None if bytes.get(at) == Some(&BREAK) => {
                at += 1;
                open.pop();
                continue;
            }
            None => {}
        }
        let head = head(bytes, at)?;
        at = head.end;
        match (head.kind, head.number) {
            (BYTES | TEXT, Some(length)) => {
                at = at.checked_add(usize::try_from(length).ok()?).filter(|&end| end <= bytes.len())?;
            }
            (LIST, number @ Some(_)) => open.push(number),
            (MAP, Some(entries)) => open.push(Some(entries.checked_mul(2)?)),
            (TAG, _) => open.push(Some(1)),
            (BYTES | TEXT | LIST | MAP, None) => open.push(None),
            _ => {}
        }
        if open.len() > DEPTH {
            return None;
        }
    }
    Some(at)
}

fn head(bytes: &[u8], at: usize) -> Option<Head> {
    let &first = bytes.get(at)?;
    let (kind, low) = (first >> 5, first & 0x1f);
    let length = match low {
        0..24 => 0,
        24..28 => 1 << (low - 24),
        // Only what has parts can go on without a number.
        31 if (BYTES..=MAP).contains(&kind) => return Some(Head { kind, number: None, end: at + 1 }),
        _ => return None,
    };
    let end = at + 1 + length;
    let number = bytes.get(at + 1..end)?.iter().fold(0, |number, &byte| number << 8 | u64::from(byte));
    Some(Head { kind, number: Some(if length == 0 { low.into() } else { number }), end })
}

fn write_head(kind: u8, number: usize, out: &mut Vec<u8>) {
    let first = kind << 5;
    if let Ok(byte) = u8::try_from(number) {
        if byte < 24 {
            out.push(first | byte);
        } else {
            out.extend([first | 0x18, byte]);
        }
    } else if let Ok(short) = u16::try_from(number) {
        out.push(first | 0x19);
        out.extend(short.to_be_bytes());
    } else {
        out.push(first | 0x1b);
        out.extend((number as u64).to_be_bytes());
    }
}

#[cfg(test)]
mod tests {
    use ciborium::Value as Cbor;
    use proptest::prelude::*;

    use super::*;

    fn bytes(value: &Cbor) -> Vec<u8> {
        let mut bytes = Vec::new();
        ciborium::into_writer(value, &mut bytes).unwrap();
        bytes
    }

    fn values() -> impl Strategy<Value = Cbor> {
        let leaf = prop_oneof![
            any::<i64>().prop_map(Cbor::from),
            any::<f64>().prop_filter("comparable", |number| !number.is_nan()).prop_map(Cbor::from),
            any::<bool>().prop_map(Cbor::from),
            Just(Cbor::Null),
            ".{0,30}".prop_map(Cbor::Text),
            prop::collection::vec(any::<u8>(), 0..300).prop_map(Cbor::Bytes),
        ];
        leaf.prop_recursive(4, 24, 4, |inner| {
            prop_oneof![
                prop::collection::vec(inner.clone(), 0..4).prop_map(Cbor::Array),
                prop::collection::vec(("[a-z]{1,3}".prop_map(Cbor::Text), inner.clone()), 0..4).prop_map(Cbor::Map),
                inner.prop_map(|inner| Cbor::Tag(86, Box::new(inner))),
            ]
        })
    }

    proptest! {
        #[test]
        fn only_the_text_under_the_key_is_another_one(
            before in values(), after in values(), old in ".{0,40}", new in ".{0,300}",
        ) {
            let message = |topic: &str| {
                let entry = |key: &str, value: Cbor| (Cbor::Text(key.to_owned()), value);
                let topic = entry("topic", Cbor::Text(topic.to_owned()));
                bytes(&Cbor::Map(vec![entry("op", before.clone()), topic, entry("msg", after.clone())]))
            };
            let replaced = text(&message(&old), "topic", |found| (found == old).then(|| new.clone()));
            prop_assert_eq!(replaced, Some(message(&new)));
            prop_assert_eq!(text(&message(&old), "type", |_| Some(new.clone())), None);
            prop_assert_eq!(text(&message(&old), "topic", |_| None), None);
        }

        #[test]
        fn any_bytes_are_replaced_or_left(bytes in prop::collection::vec(any::<u8>(), 0..100), at in 0usize..100) {
            let _ = text(&bytes, "topic", |_| Some(String::new()));
            let _ = end(&bytes, at);
        }
    }

    #[test]
    fn items_without_a_length_end_where_they_say() {
        // {_ "a": [_ 1, h'01'], "topic": "/b"}, as RFC 8949 writes it.
        let item = b"\xbf\x61a\x9f\x01\x41\x01\xff\x65topic\x62/b\xff";
        let replaced = text(item, "topic", |_| Some("/cd".to_owned())).unwrap();
        assert_eq!(replaced, b"\xbf\x61a\x9f\x01\x41\x01\xff\x65topic\x63/cd\xff");
        assert_eq!(text(item, "z", |_| Some(String::new())), None);
    }

    #[test]
    fn a_length_that_is_not_there_is_no_item() {
        for bytes in [&b"\x7b\xff\xff\xff\xff\xff\xff\xff\xff"[..], b"\x9a\xff\xff\xff\xff", b"\x81", b"\xff", b""] {
            assert_eq!(end(bytes, 0), None, "{bytes:?}");
        }
        assert_eq!(end(&[0x81; 1000], 0), None, "it is nested too deeply");
    }
}
