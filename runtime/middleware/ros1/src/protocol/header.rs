//! Connection headers: what both ends of a connection say of themselves before the first message.

use std::collections::BTreeMap;

/// The most bytes of a header; definitions of types are in it.
pub(crate) const MOST: usize = 4 << 20;

/// The most fields of a header; those of ROS have less than ten.
const MOST_FIELDS: usize = 100;

/// What stands for every type and every MD5.
pub(crate) const ANY: &str = "*";

/// The fields of a connection header.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub(crate) struct Header(BTreeMap<String, String>);

impl Header {
    pub(crate) fn new(fields: &[(&str, &str)]) -> Self {
        Header(fields.iter().map(|(name, value)| ((*name).to_owned(), (*value).to_owned())).collect())
    }

    /// That a connection is refused, and why.
    pub(crate) fn refusal(why: &str) -> Self {
        Header::new(&[("error", why)])
    }

    /// The value of a field; nothing if it is not there.
    pub(crate) fn get(&self, name: &str) -> &str {
        self.0.get(name).map_or("", String::as_str)
    }

    /// Whether a field is there and says yes.
    pub(crate) fn is(&self, name: &str) -> bool {
        matches!(self.get(name), "1" | "true" | "True")
    }

    /// The fields of a header, without the length before it; what is wrong with it, in a phrase.
    pub(crate) fn read(mut bytes: &[u8]) -> Result<Self, String> {
        let mut fields = BTreeMap::new();
        while !bytes.is_empty() {
            let (length, rest) = bytes.split_first_chunk().ok_or("it ends within the length of a field")?;
            let length = u32::from_le_bytes(*length) as usize;
            let (field, rest) = rest
                .split_at_checked(length)
                .ok_or_else(|| format!("a field of {length} bytes goes beyond its end"))?;
            let field = String::from_utf8_lossy(field);
            let (name, value) = field.split_once('=').ok_or_else(|| format!("its field `{field}` has no value"))?;
            fields.insert(name.to_owned(), value.to_owned());
            if fields.len() > MOST_FIELDS {
                return Err(format!("it has more than {MOST_FIELDS} fields"));
            }
            bytes = rest;
        }
        Ok(Header(fields))
    }

    /// The header with the length before it.
    pub(crate) fn write(&self) -> Vec<u8> {
        let mut bytes = vec![0; 4];
        for (name, value) in &self.0 {
            let field = format!("{name}={value}");
            bytes.extend(length(field.len()));
            bytes.extend(field.bytes());
        }
        let whole = length(bytes.len() - 4);
        bytes[..4].copy_from_slice(&whole);
        bytes
    }
}

/// A length on the wire.
pub(crate) fn length(length: usize) -> [u8; 4] {
    u32::try_from(length).unwrap_or(u32::MAX).to_le_bytes()
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    #[test]
    fn a_header_is_what_the_wiki_of_ros_shows() {
        let header = Header::new(&[("message_definition", "string data\n\n"), ("latching", "1")]);
        let bytes = header.write();
        assert_eq!(&bytes[..4], length(bytes.len() - 4));
        assert_eq!(&bytes[4..8], [10, 0, 0, 0]);
        assert_eq!(&bytes[8..18], b"latching=1");
        assert_eq!(&bytes[18..22], [0x20, 0, 0, 0]);
        assert_eq!(Header::read(&bytes[4..]), Ok(header.clone()));
        assert!(header.is("latching"));
        assert_eq!(header.get("absent"), "");
    }

    #[test]
    fn what_is_wrong_with_a_header_is_said() {
        let problem = |bytes: &[u8]| Header::read(bytes).unwrap_err();
        assert_eq!(problem(&[1, 0]), "it ends within the length of a field");
        assert_eq!(problem(&[255, 255, 255, 255, b'a']), "a field of 4294967295 bytes goes beyond its end");
        assert_eq!(problem(&[1, 0, 0, 0, b'a']), "its field `a` has no value");
        let many: Vec<u8> =
            (0..200).flat_map(|at| [&[4, 0, 0, 0][..], format!("{at:03}=").as_bytes()].concat()).collect();
        assert_eq!(problem(&many), "it has more than 100 fields");
    }

    proptest! {
        #[test]
        fn any_bytes_are_a_header_or_a_problem(bytes: Vec<u8>) {
            let _ = Header::read(&bytes);
        }
    }
}
