//! Interfaces by their names.

use std::collections::BTreeMap;

use sesame_plan::{Interface, InterfaceField};

use crate::Definition;

/// The deepest nesting of interfaces; those of ROS nest five deep.
const DEEPEST: usize = 50;

/// Interfaces that were read.
#[derive(Debug, Clone, Default)]
pub struct Catalogue {
    definitions: BTreeMap<String, Definition>,
}

/// Why an interface has no layout.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum ResolveError {
    /// It is not there, or one that it contains is not.
    #[error("{}there is no interface `{name}`", contained(path))]
    Missing {
        /// Its name.
        name: String,
        /// The interfaces that contain it, the outermost first.
        path: Vec<String>,
    },
    /// It contains itself.
    #[error("interface `{name}` contains itself")]
    Circle {
        /// Its name.
        name: String,
    },
    /// It nests too deeply.
    #[error("interface `{name}` nests more than {DEEPEST} deep")]
    TooDeep {
        /// The outermost.
        name: String,
    },
}

fn contained(path: &[String]) -> String {
    if path.is_empty() { String::new() } else { format!("in `{}`: ", path.join("` in `")) }
}

impl Catalogue {
    /// Adds an interface. The first one of a name stays.
    pub fn add(&mut self, definition: Definition) {
        self.definitions.entry(definition.name.clone()).or_insert(definition);
    }

    /// Whether it holds an interface.
    pub fn contains(&self, name: &str) -> bool {
        self.definitions.contains_key(name)
    }

    /// The interface of a name, as its file declares it.
    pub fn get(&self, name: &str) -> Option<&Definition> {
        self.definitions.get(name)
    }

    /// All names, in order.
    pub fn names(&self) -> impl Iterator<Item = &str> {
        self.definitions.keys().map(String::as_str)
    }

    /// The names of interfaces that those at hand contain and that are not there.
    pub fn missing(&self) -> Vec<String> {
        let contained = self.definitions.values().flat_map(|definition| &definition.fields);
        let mut missing: Vec<String> = contained
            .filter_map(|field| field.ty.interface())
            .filter(|name| !self.definitions.contains_key(*name))
            .map(str::to_owned)
            .collect();
        missing.sort_unstable();
        missing.dedup();
        missing
    }

    /// The layout of an interface, preceded by those that it contains, each after those that it contains itself.
    pub fn layout(&self, name: &str) -> Result<Vec<Interface>, ResolveError> {
        let mut found = Vec::new();
        self.collect(name, &mut Vec::new(), &mut found)?;
        Ok(found)
    }

    fn collect(&self, name: &str, path: &mut Vec<String>, found: &mut Vec<Interface>) -> Result<(), ResolveError> {
        if found.iter().any(|interface| interface.name == name) {
            return Ok(());
        }
        if path.iter().any(|outer| outer == name) {
            return Err(ResolveError::Circle { name: name.to_owned() });
        }
        if path.len() >= DEEPEST {
            return Err(ResolveError::TooDeep { name: path.first().cloned().unwrap_or_default() });
        }
        let definition = self.definitions.get(name);
        let definition =
            definition.ok_or_else(|| ResolveError::Missing { name: name.to_owned(), path: path.clone() })?;
        path.push(name.to_owned());
        for name in definition.fields.iter().filter_map(|field| field.ty.interface()) {
            self.collect(name, path, found)?;
        }
        path.pop();
        let fields = definition.fields.iter();
        let fields = fields.map(|field| InterfaceField { name: field.name.clone(), ty: field.ty.clone() });
        found.push(Interface { name: name.to_owned(), fields: fields.collect() });
        Ok(())
    }
}
