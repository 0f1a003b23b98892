//! What JSON payloads of one topic have in common. It is bounded whatever comes in: so many parts, so deep.

use std::collections::BTreeMap;

use serde_json::Value as Json;

/// The most fields, of objects in objects too, that are kept.
const MOST_PARTS: usize = 2000;

/// The deepest objects and lists that are looked into.
const DEEPEST: usize = 16;

/// The longest name of a field that is kept.
const LONGEST_NAME: usize = 100;

/// What was seen in one place of all payloads: how often a value of each kind.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub(crate) struct Seen {
    pub(crate) nulls: u64,
    pub(crate) bools: u64,
    /// Whole numbers of 64 bits with a sign.
    pub(crate) wholes: u64,
    pub(crate) reals: u64,
    /// Texts that stand for numbers which JSON does not have: `NaN`, `Infinity`, `-Infinity`.
    pub(crate) words: u64,
    pub(crate) texts: u64,
    pub(crate) lists: u64,
    pub(crate) objects: u64,
    /// Lists and objects that are too deep to be looked into.
    pub(crate) deep: u64,
    /// What was in the lists, all elements together.
    pub(crate) items: Option<Box<Seen>>,
    pub(crate) fields: BTreeMap<String, Seen>,
    /// Whether objects had fields that are not kept.
    pub(crate) more: bool,
}

/// Payloads of one topic: what they have in common.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct Samples {
    pub(crate) root: Seen,
    /// How many places there are in it.
    parts: usize,
}

impl Samples {
    /// One more payload.
    pub fn add(&mut self, payload: &Json) {
        self.root.add(payload, 0, &mut self.parts);
    }

    /// The payloads of another topic of the same type as well.
    pub fn merge(&mut self, other: &Samples) {
        self.root.merge(&other.root, &mut self.parts);
    }

    /// How many payloads there were.
    pub fn count(&self) -> u64 {
        self.root.values()
    }

    /// How many places there are in what is kept.
    pub(crate) fn parts(&self) -> usize {
        self.parts
    }

    /// Whether the payloads of two topics look as if they were of one type: objects that share half of the names of
    /// their fields or more, or values of the same kinds.
    pub fn resemble(&self, other: &Samples) -> bool {
        let (one, other) = (&self.root, &other.root);
        if one.kinds() != other.kinds() {
            return false;
        }
        let shared = one.fields.keys().filter(|name| other.fields.contains_key(*name)).count();
        2 * shared >= one.fields.len().max(other.fields.len())
    }
}

impl Seen {
    fn add(&mut self, value: &Json, depth: usize, parts: &mut usize) {
        match value {
            Json::Null => self.nulls += 1,
            Json::Bool(_) => self.bools += 1,
            Json::Number(number) if number.is_i64() => self.wholes += 1,
            Json::Number(_) => self.reals += 1,
            Json::String(text) if matches!(text.as_str(), "NaN" | "Infinity" | "-Infinity") => self.words += 1,
            Json::String(_) => self.texts += 1,
            Json::Array(_) | Json::Object(_) if depth == DEEPEST => self.deep += 1,
            Json::Array(items) => {
                self.lists += 1;
                if items.is_empty() || (self.items.is_none() && !room(parts)) {
                    return;
                }
                let seen = self.items.get_or_insert_default();
                for item in items {
                    seen.add(item, depth + 1, parts);
                }
            }
            Json::Object(fields) => {
                self.objects += 1;
                for (name, value) in fields {
                    match self.field(name, parts) {
                        Some(field) => field.add(value, depth + 1, parts),
                        None => self.more = true,
                    }
                }
            }
        }
    }

    /// The field of a name, which is new if there is room for it.
    fn field(&mut self, name: &str, parts: &mut usize) -> Option<&mut Seen> {
        if !self.fields.contains_key(name) {
            if name.len() > LONGEST_NAME || !room(parts) {
                return None;
            }
            self.fields.insert(name.to_owned(), Seen::default());
        }
        self.fields.get_mut(name)
    }

    fn merge(&mut self, other: &Seen, parts: &mut usize) {
        let counts = [
            (&mut self.nulls, other.nulls),
            (&mut self.bools, other.bools),
            (&mut self.wholes, other.wholes),
            (&mut self.reals, other.reals),
            (&mut self.words, other.words),
            (&mut self.texts, other.texts),
            (&mut self.lists, other.lists),
            (&mut self.objects, other.objects),
            (&mut self.deep, other.deep),
        ];
        for (count, more) in counts {
            *count += more;
        }
        self.more |= other.more;
        if let Some(items) = &other.items
            && (self.items.is_some() || room(parts))
        {
            self.items.get_or_insert_default().merge(items, parts);
        }
        for (name, seen) in &other.fields {
            match self.field(name, parts) {
                Some(field) => field.merge(seen, parts),
                None => self.more = true,
            }
        }
    }

    /// How many values there were.
    pub(crate) fn values(&self) -> u64 {
        self.nulls + self.bools + self.numbers() + self.texts + self.lists + self.objects + self.deep
    }

    /// How many of them are numbers.
    pub(crate) fn numbers(&self) -> u64 {
        self.wholes + self.reals + self.words
    }

    /// The kinds of values that there were.
    fn kinds(&self) -> [bool; 5] {
        [self.bools, self.numbers(), self.texts, self.lists, self.objects].map(|count| count > 0)
    }
}

/// Whether there is room for one more place, which is then taken.
fn room(parts: &mut usize) -> bool {
    let has = *parts < MOST_PARTS;
    *parts += usize::from(has);
    has
}
