//! Models and plans in few lines, for snapshots: what a base does not have as well.
//!
//! A snapshot of a whole model in the layout of `{:#?}` has thousands of lines, and a new field of a type that is
//! everywhere changes all of them. Here a field is left out where its value is the ordinary one, which a [`Base`] says:
//! a model or plan with each kind of part in its plainest form. What is ordinary is in the snapshot of the base alone,
//! so a new field changes that one, and those of whatever says more about the field.
//!
//! What is left out can be told from what is there and from the base, so nothing is hidden: of the same types and with
//! the same base, different values print differently. [`variant`] lets a test check that on its own values.
//!
//! A [`Tree`] is read from what `{:?}` prints, which every model and plan has, or from JSON, whose names belong to what
//! a test of a file format is about.

use std::collections::{BTreeMap, BTreeSet};

/// How many characters a line holds at most, where it can be divided.
const WIDTH: usize = 120;

/// What stands for a field that the base always has, and that is missing.
const MISSING: &str = "missing";

/// A value as it was printed. Numbers, texts and names are kept as they were written.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Tree {
    /// A number, a text in its quotes, or a name such as that of a variant without values.
    Scalar(String),
    /// Fields with names.
    Struct {
        /// The name of the type or variant; empty for an object in JSON, whose type is known by its place.
        kind: String,
        /// What is printed before the fields: the type, until a test finds better words; for an object its `kind`,
        /// which is then not a field.
        head: String,
        /// Names and values, in order.
        fields: Vec<(String, Tree)>,
    },
    /// Fields without names, after the name of their type or variant, which a tuple does not have.
    Tuple(String, Vec<Tree>),
    /// A list.
    List(Vec<Tree>),
    /// A map whose keys are not names.
    Map(Vec<(Tree, Tree)>),
}

impl Tree {
    /// Reads what `{:?}` or `{:#?}` printed, or JSON.
    pub fn read(text: &str) -> Tree {
        let mut reader = Reader { rest: text };
        let tree = reader.value();
        assert!(reader.rest.trim().is_empty(), "nothing follows a value, not {:.40}", reader.rest);
        tree
    }

    /// A field of a struct.
    pub fn field(&self, name: &str) -> Option<&Tree> {
        let Tree::Struct { fields, .. } = self else { return None };
        fields.iter().find(|(field, _)| field == name).map(|(_, value)| value)
    }

    /// The text of a scalar.
    pub fn scalar(&self) -> Option<&str> {
        let Tree::Scalar(text) = self else { return None };
        Some(text)
    }

    /// It, with each part replaced by what a function makes of it: the innermost parts first.
    #[must_use]
    pub fn map(self, change: &impl Fn(Tree) -> Tree) -> Tree {
        let all = |of: Vec<Tree>| of.into_iter().map(|part| part.map(change)).collect();
        change(match self {
            Tree::Scalar(text) => Tree::Scalar(text),
            Tree::Struct { kind, head, fields } => {
                let fields = fields.into_iter().map(|(name, value)| (name, value.map(change))).collect();
                Tree::Struct { kind, head, fields }
            }
            Tree::Tuple(name, of) => Tree::Tuple(name, all(of)),
            Tree::List(of) => Tree::List(all(of)),
            Tree::Map(of) => {
                Tree::Map(of.into_iter().map(|(key, value)| (key.map(change), value.map(change))).collect())
            }
        })
    }

    /// Each struct in it, this one included, with what its type is known by.
    pub fn each_struct<'a>(&'a self, found: &mut impl FnMut(&str, &'a Tree)) {
        self.visit("", &mut |key, part| {
            found(key, part);
            true
        });
    }

    /// The same, and only the structs within those for which the function says true.
    fn visit<'a>(&'a self, place: &str, found: &mut impl FnMut(&str, &'a Tree) -> bool) {
        match self {
            Tree::Scalar(_) => {}
            Tree::Struct { kind, head, fields } => {
                let key = key(kind, head, fields, place);
                if found(&key, self) {
                    for (name, value) in fields {
                        value.visit(&format!("{key}.{name}"), found);
                    }
                }
            }
            Tree::Tuple(_, of) | Tree::List(of) => of.iter().for_each(|part| part.visit(place, found)),
            Tree::Map(of) => of.iter().for_each(|(key, value)| {
                key.visit(place, found);
                value.visit(place, found);
            }),
        }
    }

    /// The value that says nothing, of a field that also has this one; as far as this one shows it.
    fn empty(&self) -> Option<Tree> {
        match self {
            Tree::Scalar(text) => ["None", "null", "false", "\"\""].contains(&text.as_str()).then(|| self.clone()),
            Tree::Tuple(name, _) => (name == "Some").then(|| Tree::Scalar("None".to_owned())),
            Tree::List(_) => Some(Tree::List(Vec::new())),
            Tree::Struct { .. } | Tree::Map(_) => None,
        }
    }
}

/// What a type is known by: its name and fields, for several types can have one name; in JSON the place of an object,
/// and its `kind`.
fn key(kind: &str, head: &str, fields: &[(String, Tree)], place: &str) -> String {
    match (kind, head) {
        ("", "") => place.to_owned(),
        ("", variant) => format!("{place}.{variant}"),
        _ => {
            let names: Vec<&str> = fields.iter().map(|(name, _)| name.as_str()).collect();
            format!("{kind} {{ {} }}", names.join(", "))
        }
    }
}

/// What is ordinary.
#[derive(Debug, Default)]
pub struct Base {
    /// What is ordinary of each field, by the key of its struct. A field that only some of them have is not here.
    structs: BTreeMap<String, BTreeMap<String, Usual>>,
}

/// What is ordinary of a field.
#[derive(Debug)]
enum Usual {
    /// This value.
    Value(Tree),
    /// A struct of this type in which each field is ordinary.
    Struct(String),
    /// Nothing: all values are shown.
    Nothing,
}

impl Base {
    /// What is ordinary in these models or plans: of a type that several of them have, in the first one.
    ///
    /// Where all values of a field are the same, and there are two at least, that is the ordinary one; of one alone
    /// nobody could say what is ordinary and what is just its own. Where they differ, or where there is one, a value
    /// that says nothing is ordinary: an empty list, `None`, and where one has it an empty text or `false`. Other
    /// fields are always shown.
    pub fn of(models: &[Tree]) -> Base {
        let mut structs = BTreeMap::new();
        for model in models {
            for (key, usual) in ordinary(model) {
                structs.entry(key).or_insert(usual);
            }
        }
        Base { structs }
    }

    /// Whether it has a [type](Tree::each_struct).
    pub fn has(&self, key: &str) -> bool {
        self.structs.contains_key(key)
    }

    /// What is ordinary of the types that another base does not have: a line for each.
    pub fn ordinary(&self, beside: &Base) -> String {
        let mut out = String::new();
        for (key, fields) in self.structs.iter().filter(|(key, _)| !beside.has(key)) {
            let part = |(name, usual): (&String, &Usual)| {
                let shown = match usual {
                    Usual::Value(value) => Base::default().shown(value, ""),
                    // At a place in JSON without variants there is nothing else.
                    Usual::Struct(of) => match of.strip_prefix(&format!("{key}.{name}")) {
                        Some("") => return None,
                        Some(variant) => Shown::Word(variant.trim_start_matches('.').to_owned()),
                        None => Shown::Word(name_of(of).to_owned()),
                    },
                    Usual::Nothing => return None,
                };
                Some((format!("{name}: "), shown))
            };
            let parts: Vec<(String, Shown)> = fields.iter().filter_map(part).collect();
            if !parts.is_empty() {
                let open = format!("{} {{", name_of(key)).trim_start().to_owned();
                Shown::Group { open, parts, close: '}' }.write(&mut out, 0, 0);
                out.push('\n');
            }
        }
        out
    }

    /// A model or plan without what is ordinary.
    pub fn compact(&self, tree: &Tree) -> String {
        let mut out = String::new();
        self.shown(tree, "").write(&mut out, 0, 0);
        out.push('\n');
        out
    }

    /// What there is to show of a value at a place.
    fn shown(&self, tree: &Tree, place: &str) -> Shown {
        let all = |of: &[Tree]| of.iter().map(|part| (String::new(), self.shown(part, place))).collect();
        match tree {
            Tree::Scalar(text) => Shown::Word(text.clone()),
            Tree::Struct { kind, head, fields } => {
                let parts = self.shown_fields(&key(kind, head, fields, place), fields);
                let open = if head.is_empty() { "{".to_owned() } else { format!("{head} {{") };
                match (parts.is_empty(), head.is_empty()) {
                    (true, true) => Shown::Word("{}".to_owned()),
                    (true, false) => Shown::Word(head.clone()),
                    (false, _) => Shown::Group { open, parts, close: '}' },
                }
            }
            // An optional value is shown as the value: only another option in it could not be told from none.
            Tree::Tuple(name, of) if name == "Some" && !of.iter().any(is_option) => match of.as_slice() {
                [value] => self.shown(value, place),
                _ => Shown::Group { open: "Some(".to_owned(), parts: all(of), close: ')' },
            },
            // A variant that holds a type of its own name.
            Tree::Tuple(name, of) => match of.as_slice() {
                [value @ Tree::Struct { kind, .. }] if kind == name => self.shown(value, place),
                _ => Shown::Group { open: format!("{name}("), parts: all(of), close: ')' },
            },
            Tree::List(of) => Shown::Group { open: "[".to_owned(), parts: all(of), close: ']' },
            Tree::Map(of) => {
                let part = |(key, value): &(Tree, Tree)| {
                    let mut name = String::new();
                    self.shown(key, place).write_in_line(&mut name);
                    (name + ": ", self.shown(value, place))
                };
                Shown::Group { open: "{".to_owned(), parts: of.iter().map(part).collect(), close: '}' }
            }
        }
    }

    /// The fields of a struct that are not ordinary.
    fn shown_fields(&self, key: &str, fields: &[(String, Tree)]) -> Vec<(String, Shown)> {
        let usual = self.structs.get(key);
        let mut parts = Vec::new();
        for (name, value) in fields {
            let shown = self.shown(value, &format!("{key}.{name}"));
            let ordinary = match usual.and_then(|usual| usual.get(name)) {
                Some(Usual::Value(usual)) => value == usual,
                Some(Usual::Struct(usual)) => match value {
                    Tree::Struct { kind, head, fields } => {
                        let alike = *usual == self::key(kind, head, fields, &format!("{key}.{name}"));
                        alike && (kind.is_empty() || head == kind) && matches!(shown, Shown::Word(_))
                    }
                    _ => false,
                },
                Some(Usual::Nothing) | None => false,
            };
            if !ordinary {
                parts.push((format!("{name}: "), shown));
            }
        }
        let missing = usual.into_iter().flatten().filter(|(name, _)| !fields.iter().any(|(field, _)| field == *name));
        let missing = missing.filter(|(_, usual)| !matches!(usual, Usual::Nothing));
        parts.extend(missing.map(|(name, _)| (format!("{name}: "), Shown::Word(MISSING.to_owned()))));
        parts
    }
}

/// The name of a type in its key.
fn name_of(key: &str) -> &str {
    key.split(" {").next().unwrap_or(key).trim_start_matches('.')
}

/// What is ordinary of each field in a model or plan, by its type. What has a name, and is the same in several plans of
/// a list, counts once.
fn ordinary(model: &Tree) -> BTreeMap<String, BTreeMap<String, Usual>> {
    let mut seen: BTreeMap<String, (usize, BTreeMap<&str, Vec<&Tree>>)> = BTreeMap::new();
    let mut named = BTreeSet::new();
    model.visit("", &mut |key, part| {
        let Tree::Struct { fields, .. } = part else { return true };
        if part.field("name").is_some() && !named.insert((key.to_owned(), format!("{part:?}"))) {
            return false;
        }
        let (count, values) = seen.entry(key.to_owned()).or_default();
        *count += 1;
        for (name, value) in fields {
            values.entry(name).or_default().push(value);
        }
        true
    });
    let usual = |(key, (count, fields)): (String, (usize, BTreeMap<&str, Vec<&Tree>>))| {
        let always = fields.into_iter().filter(|(_, values)| values.len() == count);
        let usual = always.map(|(name, values)| (name.to_owned(), Usual::of(&values, &format!("{key}.{name}"))));
        let usual = usual.collect();
        (key, usual)
    };
    seen.into_iter().map(usual).collect()
}

impl Usual {
    /// What is ordinary of a field at a place that has these values, one at least.
    fn of(values: &[&Tree], place: &str) -> Usual {
        let [first, others @ ..] = values else { return Usual::Nothing };
        if !others.is_empty() && others.iter().all(|other| other == first) {
            return Usual::Value((*first).clone());
        }
        if let Some(empty) = values.iter().find_map(|value| value.empty()) {
            return Usual::Value(empty);
        }
        let key_of = |value: &Tree| match value {
            Tree::Struct { kind, head, fields } => Some(key(kind, head, fields, place)),
            _ => None,
        };
        match key_of(first) {
            Some(key) if others.iter().all(|other| key_of(other).as_ref() == Some(&key)) => Usual::Struct(key),
            _ => Usual::Nothing,
        }
    }
}

fn is_option(tree: &Tree) -> bool {
    match tree {
        Tree::Scalar(text) => text == "None" || text == "null",
        Tree::Tuple(name, _) => name == "Some",
        _ => false,
    }
}

/// What is shown, before it is divided into lines.
enum Shown {
    /// A word or number.
    Word(String),
    /// Parts with what is written before each, between brackets.
    Group { open: String, parts: Vec<(String, Shown)>, close: char },
}

impl Shown {
    fn write_in_line(&self, out: &mut String) {
        match self {
            Shown::Word(text) => out.push_str(text),
            Shown::Group { open, parts, close } => {
                let space = if *close == '}' && !parts.is_empty() { " " } else { "" };
                out.push_str(open);
                out.push_str(space);
                for (position, (name, part)) in parts.iter().enumerate() {
                    out.push_str(if position == 0 { "" } else { ", " });
                    out.push_str(name);
                    part.write_in_line(out);
                }
                out.push_str(space);
                out.push(*close);
            }
        }
    }

    /// Writes it in one line if it fits after what is already in the line, else each part in lines of its own.
    fn write(&self, out: &mut String, indent: usize, before: usize) {
        let mut line = String::new();
        self.write_in_line(&mut line);
        let Shown::Group { open, parts, close } = self else { return out.push_str(&line) };
        if indent + before + line.chars().count() <= WIDTH {
            return out.push_str(&line);
        }
        out.push_str(open);
        if let ([(name, part)], ')') = (parts.as_slice(), *close) {
            part.write(out, indent, before + open.chars().count() + name.chars().count());
            return out.push(*close);
        }
        let inner = indent + 2;
        let start = format!("\n{:inner$}", "");
        if parts.iter().all(|(name, part)| name.is_empty() && matches!(part, Shown::Word(_))) {
            // Words and numbers fill their lines.
            let mut column = WIDTH;
            for (_, part) in parts {
                let mut word = String::new();
                part.write_in_line(&mut word);
                let length = word.chars().count() + 1;
                if column + 1 + length > WIDTH {
                    out.push_str(&start);
                    column = inner;
                } else {
                    out.push(' ');
                    column += 1;
                }
                out.push_str(&word);
                out.push(',');
                column += length;
            }
        } else {
            for (name, part) in parts {
                out.push_str(&start);
                out.push_str(name);
                part.write(out, inner, name.chars().count());
            }
        }
        let end = format!("\n{:indent$}{close}", "");
        out.push_str(&end);
    }
}

/// How many [variants](variant) a value has.
pub fn variants(tree: &Tree) -> usize {
    let mut skipped = usize::MAX;
    change(&mut tree.clone(), &mut skipped);
    usize::MAX - skipped
}

/// A value that differs from another in one place. There is one for each number, up to the last: with another number,
/// text or name, with a value where there was none or none where there was one, with an element less or one more, and
/// in JSON with a field less. A test that nothing is hidden prints them all.
pub fn variant(tree: &Tree, number: usize) -> Option<Tree> {
    let mut changed = tree.clone();
    let mut skipped = number;
    change(&mut changed, &mut skipped).then_some(changed)
}

/// Makes one change after so many others that it skips; says whether there are so many.
fn change(tree: &mut Tree, skipped: &mut usize) -> bool {
    let mut others = Vec::new();
    match tree {
        Tree::Scalar(text) if text == "None" => {
            for value in ["None", "()", "\"\""] {
                others.push(Tree::Tuple("Some".to_owned(), vec![Tree::Scalar(value.to_owned())]));
            }
        }
        Tree::Scalar(text) => others.push(Tree::Scalar(other_word(text))),
        Tree::Struct { kind, head, fields } => {
            let other = other_word(if kind.is_empty() { head } else { kind });
            let kind = if kind.is_empty() { String::new() } else { other.clone() };
            if kind.is_empty() {
                // A field of an object may be absent.
                for at in 0..fields.len() {
                    let (kind, mut fields) = (kind.clone(), fields.clone());
                    fields.remove(at);
                    others.push(Tree::Struct { kind, head: head.clone(), fields });
                }
            }
            others.push(Tree::Struct { kind, head: other, fields: fields.clone() });
        }
        Tree::Tuple(name, _) if name == "Some" => others.push(Tree::Scalar("None".to_owned())),
        Tree::Tuple(name, of) => others.push(Tree::Tuple(other_word(name), of.clone())),
        Tree::List(of) => {
            let last = of.last().cloned().unwrap_or_else(|| Tree::Scalar("1".to_owned()));
            others.push(Tree::List(of.iter().cloned().chain([last]).collect()));
            others.extend((1..=of.len()).map(|end| Tree::List([&of[..end - 1], &of[end..]].concat())));
        }
        Tree::Map(of) => others.push(Tree::Map(of[1..].to_vec())),
    }
    if *skipped < others.len() {
        *tree = others.swap_remove(*skipped);
        return true;
    }
    *skipped -= others.len();
    match tree {
        Tree::Scalar(_) => false,
        Tree::Struct { fields, .. } => fields.iter_mut().any(|(_, value)| change(value, skipped)),
        Tree::Tuple(_, of) | Tree::List(of) => of.iter_mut().any(|part| change(part, skipped)),
        Tree::Map(of) => of.iter_mut().any(|(key, value)| change(key, skipped) || change(value, skipped)),
    }
}

/// Another word or number of the same form.
fn other_word(text: &str) -> String {
    match (text, text.parse::<u64>(), text.strip_suffix('"')) {
        ("true", ..) => "false".to_owned(),
        ("false", ..) => "true".to_owned(),
        ("0", ..) => "1".to_owned(),
        (_, Ok(number), _) => (number - 1).to_string(),
        (_, _, Some(text)) => format!("{text}~\""),
        _ => format!("{text}1"),
    }
}

/// Text that is still to be read.
struct Reader<'a> {
    rest: &'a str,
}

impl<'a> Reader<'a> {
    fn value(&mut self) -> Tree {
        self.rest = self.rest.trim_start();
        match self.rest.chars().next() {
            Some('"' | '\'') => Tree::Scalar(self.quoted().to_owned()),
            Some('[') => Tree::List(self.group(']', Self::value)),
            Some('(') => Tree::Tuple(String::new(), self.group(')', Self::value)),
            Some('{') => braces(self.group('}', Self::entry)),
            Some(_) => {
                let name = self.word();
                match self.rest.trim_start().chars().next() {
                    Some('(') => Tree::Tuple(name.to_owned(), self.group(')', Self::value)),
                    Some('{') => {
                        let fields = self.group('}', Self::entry).into_iter();
                        let name_of = |key: Tree| key.scalar().map(str::to_owned).unwrap_or_default();
                        let fields = fields.map(|(key, value)| (name_of(key), value)).collect();
                        Tree::Struct { kind: name.to_owned(), head: name.to_owned(), fields }
                    }
                    _ => Tree::Scalar(name.to_owned()),
                }
            }
            None => panic!("the text ends where a value should be"),
        }
    }

    fn entry(&mut self) -> (Tree, Tree) {
        let key = self.value();
        self.expect(':');
        (key, self.value())
    }

    /// What is between brackets, divided by commas.
    fn group<T>(&mut self, close: char, read: fn(&mut Self) -> T) -> Vec<T> {
        self.rest = &self.rest.trim_start()[1..];
        let mut found = Vec::new();
        loop {
            self.rest = self.rest.trim_start();
            if let Some(rest) = self.rest.strip_prefix(close) {
                self.rest = rest;
                return found;
            }
            found.push(read(self));
            self.rest = self.rest.trim_start();
            if !self.rest.starts_with(close) {
                self.expect(',');
            }
        }
    }

    fn expect(&mut self, character: char) {
        let rest = self.rest.trim_start();
        self.rest = rest.strip_prefix(character).unwrap_or_else(|| panic!("{character} should be before {rest:.40}"));
    }

    /// A text with its quotes.
    fn quoted(&mut self) -> &'a str {
        let quote = self.rest.chars().next();
        let mut escaped = false;
        let end = self.rest.char_indices().skip(1).find(|&(_, character)| {
            let ends = !escaped && Some(character) == quote;
            escaped = !escaped && character == '\\';
            ends
        });
        let (end, _) = end.unwrap_or_else(|| panic!("a text without an end: {:.40}", self.rest));
        self.take(end + 1)
    }

    /// A number or name: up to what cannot be in one. Types have their colons and brackets in pairs.
    fn word(&mut self) -> &'a str {
        let mut end = 0;
        while let Some(character) = self.rest[end..].chars().next() {
            let paired = self.rest[end..].starts_with("::");
            if !paired && (character.is_whitespace() || "(){}[],:".contains(character)) {
                break;
            }
            end += if paired { 2 } else { character.len_utf8() };
        }
        assert!(end > 0, "a value should be before {:.40}", self.rest);
        self.take(end)
    }

    fn take(&mut self, length: usize) -> &'a str {
        let (taken, rest) = self.rest.split_at(length);
        self.rest = rest;
        taken
    }
}

/// An object of JSON if all keys are texts with nothing but a name, else a map.
fn braces(entries: Vec<(Tree, Tree)>) -> Tree {
    let name = |key: &Tree| {
        let name = key.scalar()?.strip_prefix('"')?.strip_suffix('"')?;
        let plain = |byte: u8| byte.is_ascii_alphanumeric() || byte == b'_';
        (!name.is_empty() && name.bytes().all(plain)).then(|| name.to_owned())
    };
    let names: Option<Vec<String>> = entries.iter().map(|(key, _)| name(key)).collect();
    let Some(names) = names else { return Tree::Map(entries) };
    let mut fields: Vec<(String, Tree)> = names.into_iter().zip(entries.into_iter().map(|(_, value)| value)).collect();
    let variant = fields.iter().position(|(name, value)| name == "kind" && matches!(value, Tree::Scalar(_)));
    let head = variant.map(|at| fields.remove(at).1.scalar().unwrap_or_default().trim_matches('"').to_owned());
    Tree::Struct { kind: String::new(), head: head.unwrap_or_default(), fields }
}

#[cfg(test)]
mod tests;
