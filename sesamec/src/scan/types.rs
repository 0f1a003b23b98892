//! The types of what was found: where each has its layout from.

use std::collections::{BTreeMap, BTreeSet};

use sesame_dsl::interfaces::{self, Folders, Interfaces};
use sesame_plan::{Dialect, Interface, InterfaceField, WireType};
use sesame_scan::{Facts, FoundField, FoundType, LeftOut, TypeSource};

/// What a point is called that has no type of ROS.
pub(super) const POINT: &str = "point";

/// The most types that nodes may describe.
const MOST: usize = 2000;

/// The longest chain of types that contain each other.
const DEEPEST: usize = 50;

/// Types by their names.
#[derive(Debug, Default)]
pub struct Types {
    by_name: BTreeMap<String, Type>,
    /// Types of topics that are not messages, by their words.
    plain: BTreeMap<String, WireType>,
    /// Those of them that turned out to be of no use, with the reason.
    refused: BTreeMap<String, String>,
}

#[derive(Debug)]
struct Type {
    source: TypeSource,
    fields: Vec<InterfaceField>,
    left_out: Vec<LeftOut>,
    problem: Option<String>,
    /// What else is known of fields: their units, values that came, whether messages may lack them.
    details: BTreeMap<String, FoundField>,
}

impl Type {
    /// One with a layout.
    fn of(source: TypeSource, fields: Vec<InterfaceField>) -> Self {
        Type { source, fields, left_out: Vec::new(), problem: None, details: BTreeMap::new() }
    }

    /// One without.
    fn unknown(problem: Option<String>) -> Self {
        Type { problem, ..Type::of(TypeSource::Unknown, Vec::new()) }
    }
}

impl Types {
    /// The types of all topics, as far as they are known or folders have them.
    pub fn of_topics(facts: &Facts, files: &dyn Interfaces, folders: Folders<'_>) -> Self {
        let mut types = Types::default();
        for ty in facts.topics.iter().filter_map(|topic| topic.ty.as_deref()) {
            types.look_up(ty, files, folders);
        }
        types
    }

    /// Types whose layouts are among the facts already.
    pub fn of_found(found: &[FoundType]) -> Self {
        let mut types = Types::default();
        for FoundType { name, source, fields, .. } in found {
            let field = |field: &FoundField| {
                Some(InterfaceField {
                    name: field.name.clone(),
                    ty: interfaces::wire_type(&field.ty, Dialect::default())?,
                })
            };
            let details = fields.iter().map(|field| (field.name.clone(), field.clone())).collect();
            let ty = Type { details, ..Type::of(*source, fields.iter().filter_map(field).collect()) };
            types.by_name.insert(name.clone(), ty);
        }
        types
    }

    /// Notes which fields of a type some messages lacked.
    pub(super) fn set_optional(&mut self, name: &str, fields: Vec<String>) {
        let Some(ty) = self.by_name.get_mut(name) else { return };
        let optional = |field: String| (field, FoundField { optional: true, ..FoundField::default() });
        ty.details.extend(fields.into_iter().map(optional));
    }

    /// What else is known of a field: its unit, a value that came, whether messages may lack it.
    pub(super) fn detail(&self, name: &str, field: &str) -> Option<&FoundField> {
        self.by_name.get(name)?.details.get(field)
    }

    /// Adds a type of ROS that needs no folder.
    pub(super) fn add_known(&mut self, name: &str) {
        self.look_up(name, &interfaces::NoInterfaces, Folders { written: &[], file: "", dialect: Dialect::Ros2 });
    }

    fn look_up(&mut self, name: &str, files: &dyn Interfaces, folders: Folders<'_>) {
        if self.by_name.contains_key(name) {
            return;
        }
        let unknown = Type::unknown;
        let of = |source, found: Vec<Interface>| match found.into_iter().next_back() {
            Some(last) => Type::of(source, last.fields),
            None => unknown(None),
        };
        let found = if interfaces::full_name(name, "msg", folders.dialect).as_deref() != Some(name) {
            unknown(Some("this is not a type of messages in ROS".to_owned()))
        } else if let Some(known) = interfaces::known(name) {
            of(TypeSource::Known, known)
        } else {
            match files.find(folders, name) {
                Ok(Some(found)) => of(TypeSource::Folder, found),
                Ok(None) => unknown(None),
                Err(why) => unknown(Some(why)),
            }
        };
        self.by_name.insert(name.to_owned(), found);
    }

    /// Types of which no folder has a definition, and nothing else is wrong.
    pub fn missing(&self) -> Vec<String> {
        let missing = self.by_name.iter();
        let missing = missing.filter(|(_, ty)| ty.source == TypeSource::Unknown && ty.problem.is_none());
        missing.map(|(name, _)| name.clone()).collect()
    }

    /// Adds layouts as nodes describe them, by the type for which they were asked.
    pub fn add_described(
        &mut self,
        described: &BTreeMap<String, Vec<Interface>>,
        files: &dyn Interfaces,
        folders: Folders<'_>,
    ) {
        for interface in described.values().flatten().take(MOST) {
            self.look_up(&interface.name, files, folders);
            let Some(ty) = self.by_name.get_mut(&interface.name) else { continue };
            if ty.source == TypeSource::Unknown && ty.problem.is_none() {
                *ty = match wrong_field(&interface.fields, folders.dialect) {
                    Some(problem) => Type::unknown(Some(problem)),
                    None => Type::of(TypeSource::Node, interface.fields.clone()),
                };
            }
        }
        let of_nodes = self.by_name.values().filter(|ty| ty.source == TypeSource::Node).flat_map(|ty| &ty.fields);
        let inner: BTreeSet<String> = of_nodes.filter_map(|field| contained(&field.ty)).map(str::to_owned).collect();
        for name in inner {
            self.look_up(&name, files, folders);
        }
        let names: Vec<String> = self.by_name.keys().cloned().collect();
        let mut whole = BTreeSet::new();
        for name in names {
            if let Some(problem) = self.gap(&name, &mut Vec::new(), &mut whole) {
                self.refuse(&name, problem);
            }
        }
    }

    /// Why what a node described does not make a layout; `open` are the types that contain it, and `whole` those that
    /// are known to have none of these mistakes.
    fn gap(&self, name: &str, open: &mut Vec<String>, whole: &mut BTreeSet<String>) -> Option<String> {
        let Some(ty) = self.by_name.get(name).filter(|ty| ty.source != TypeSource::Unknown) else {
            return (!open.is_empty()).then(|| format!("it contains `{name}`, which is unknown"));
        };
        if ty.source != TypeSource::Node || whole.contains(name) {
            return None;
        }
        if open.len() >= DEEPEST || open.iter().any(|outer| outer == name) {
            return Some("it contains itself, or too many in each other".to_owned());
        }
        open.push(name.to_owned());
        let mut inner = ty.fields.iter().filter_map(|field| contained(&field.ty));
        let gap = inner.find_map(|inner| self.gap(inner, open, whole));
        open.pop();
        if gap.is_none() {
            whole.insert(name.to_owned());
        }
        gap
    }

    /// A type turned out to be of no use.
    pub fn refuse(&mut self, name: &str, problem: String) {
        if let Some(ty) = self.by_name.get_mut(name) {
            *ty = Type::unknown(Some(problem));
        } else if self.plain.contains_key(name) {
            self.refused.insert(name.to_owned(), problem);
        }
    }

    /// Adds a message that payloads have in common, unless there is one of this name that has a layout.
    pub(super) fn add_payload(&mut self, name: &str, fields: Vec<InterfaceField>, left_out: Vec<LeftOut>) {
        if self.source(name) == TypeSource::Unknown {
            let ty = Type { left_out, ..Type::of(TypeSource::Payloads, fields) };
            self.by_name.insert(name.to_owned(), ty);
        }
    }

    /// Gives a message that payloads have in common its fields.
    pub(super) fn set_payload(&mut self, name: &str, fields: Vec<InterfaceField>, left_out: Vec<LeftOut>) {
        if let Some(ty) = self.by_name.get_mut(name) {
            (ty.fields, ty.left_out) = (fields, left_out);
        }
    }

    /// Adds the type of topics that are not messages; gives its words.
    pub(super) fn add_plain(&mut self, wire: WireType) -> String {
        let words = interfaces::in_words(&wire);
        self.plain.insert(words.clone(), wire);
        words
    }

    /// Whether topics of this type are not messages.
    pub(super) fn is_plain(&self, words: &str) -> bool {
        self.plain.contains_key(words)
    }

    /// The type of topics that are not messages.
    pub(super) fn wire(&self, words: &str) -> Option<&WireType> {
        self.plain.get(words)
    }

    /// Whether there is a type of this name.
    pub(super) fn has(&self, name: &str) -> bool {
        self.by_name.contains_key(name)
    }

    /// The fields that payloads have and a space cannot declare.
    pub(super) fn left_out(&self, name: &str) -> &[LeftOut] {
        self.by_name.get(name).map(|ty| ty.left_out.as_slice()).unwrap_or_default()
    }

    /// Where the layout of a type comes from.
    pub fn source(&self, name: &str) -> TypeSource {
        self.by_name.get(name).map_or(TypeSource::Unknown, |ty| ty.source)
    }

    /// The fields that a type has for people.
    pub fn fields(&self, name: &str) -> impl Iterator<Item = &InterfaceField> {
        let fields = self.by_name.get(name).map(|ty| ty.fields.as_slice()).unwrap_or_default();
        fields.iter().filter(|field| field.name != interfaces::NO_FIELDS)
    }

    /// Why a type cannot be used, in a clause.
    pub fn problem(&self, name: &str) -> Option<&str> {
        match self.by_name.get(name) {
            Some(ty) => ty.problem.as_deref(),
            None => self.refused.get(name).map(String::as_str),
        }
    }

    /// What messages of a type are in the language where that is not a message: times, and points that need no block.
    pub fn plain(&self, name: &str) -> Option<&'static str> {
        if interfaces::is_time(name) {
            return Some("real[s]");
        }
        if name == POINT {
            return Some("point");
        }
        let has_block = |ty: &&Type| matches!(ty.source, TypeSource::Node | TypeSource::Dialect);
        let ty = self.by_name.get(name).filter(|ty| !has_block(ty))?;
        let layout = Interface { name: name.to_owned(), fields: ty.fields.clone() };
        interfaces::is_point(&layout).then_some("point")
    }

    /// The types of these names that can be used, and those that the blocks of described types need, each once.
    pub fn needed<'a>(&'a self, of_topics: impl IntoIterator<Item = &'a str>) -> Vec<&'a str> {
        let mut needed: Vec<&str> = Vec::new();
        for name in of_topics {
            // What is plain itself is a list of messages, perhaps.
            let name = match self.plain.get(name) {
                Some(wire) => contained(wire).unwrap_or_default(),
                None => name,
            };
            if self.source(name) != TypeSource::Unknown && !needed.contains(&name) {
                needed.push(name);
            }
        }
        let mut at = 0;
        while let Some(&name) = needed.get(at) {
            at += 1;
            if !matches!(self.source(name), TypeSource::Node | TypeSource::Payloads) {
                continue;
            }
            for inner in self.fields(name).filter_map(|field| contained(&field.ty)) {
                if self.plain(inner).is_none() && !needed.contains(&inner) {
                    needed.push(inner);
                }
            }
        }
        needed
    }

    /// All of them as facts.
    pub fn facts(&self) -> Vec<FoundType> {
        let field = |ty: &Type, field: &InterfaceField| {
            let detail = ty.details.get(&field.name).cloned().unwrap_or_default();
            FoundField { name: field.name.clone(), ty: interfaces::in_words(&field.ty), ..detail }
        };
        let of = |(name, ty): (&String, &Type)| FoundType {
            name: name.clone(),
            source: ty.source,
            fields: self.fields(name).map(|found| field(ty, found)).collect(),
            left_out: ty.left_out.clone(),
            problem: ty.problem.clone(),
        };
        self.by_name.iter().map(of).collect()
    }
}

/// What is wrong with the fields that a node described.
fn wrong_field(fields: &[InterfaceField], dialect: Dialect) -> Option<String> {
    let is_name = |field: &InterfaceField| field.name.len() <= 100 && sesame_notation::is_name(&field.name);
    if fields.iter().any(|field| !is_name(field)) {
        return Some("one of its fields has no name of ROS".to_owned());
    }
    let known = |field: &InterfaceField| {
        contained(&field.ty).is_none_or(|name| interfaces::full_name(name, "msg", dialect).as_deref() == Some(name))
    };
    (!fields.iter().all(known)).then(|| "one of its fields has no type of ROS".to_owned())
}

/// The type of messages that values of a type are or hold.
fn contained(ty: &WireType) -> Option<&str> {
    if let WireType::Interface { name } = interfaces::innermost(ty) { Some(name) } else { None }
}
