//! Which fields somebody reads.

use std::collections::BTreeMap;

/// Which fields of a message are read.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Wanted {
    /// All of them.
    All,
    /// These, each with what of it is read.
    Fields(BTreeMap<String, Wanted>),
}

impl Wanted {
    /// No field at all.
    pub fn nothing() -> Self {
        Wanted::Fields(BTreeMap::new())
    }

    /// Adds the field at the end of a path, with everything in it.
    pub fn add<'a>(&mut self, mut path: impl Iterator<Item = &'a str>) {
        let Wanted::Fields(fields) = self else { return };
        match path.next() {
            None => *self = Wanted::All,
            Some(field) => fields.entry(field.to_owned()).or_insert_with(Wanted::nothing).add(path),
        }
    }
}
