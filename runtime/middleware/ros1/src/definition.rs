//! Definitions of types, as ROS 1 hands them out: the text of a `.msg` file with those that it contains, and the MD5
//! that identifies the type.
//!
//! A subscriber and a publisher connect only if they have the same MD5. It depends on constants too, so it cannot be
//! had from a layout.

use std::collections::BTreeMap;
use std::fmt::Write as _;

use sesame_interfaces::{Catalogue, DefinitionError, ResolveError, ros1};
use sesame_plan::Interface;

/// What is between the texts of a definition.
const SEPARATOR: &str = "================================================================================";

/// The deepest nesting of types.
const DEEPEST: usize = 50;

/// The most types in a definition.
const MOST: usize = 1_000;

/// Texts of `.msg` files by the names of their types in ROS 1, for example `std_msgs/Header`.
#[derive(Debug, Clone, Default)]
pub struct Texts(BTreeMap<String, String>);

/// Why a type has no definition.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum TypeError {
    /// There is no text for it, or for one that it contains.
    #[error("there is no definition of `{0}`")]
    Missing(String),
    /// Its text has a mistake.
    #[error("in the definition of `{name}`: {error}")]
    Wrong {
        /// The type.
        name: String,
        /// The mistake.
        error: DefinitionError,
    },
    /// It contains itself, or nests too deeply.
    #[error("`{0}` contains itself, or more than {DEEPEST} types in each other")]
    TooDeep(String),
    /// There are too many.
    #[error("it contains more than {MOST} types")]
    TooMany,
    /// Its layout cannot be put together.
    #[error(transparent)]
    Layout(#[from] ResolveError),
}

impl Texts {
    /// Adds the text of a type.
    pub fn add(&mut self, name: &str, text: &str) {
        self.0.insert(name.to_owned(), text.to_owned());
    }

    /// The texts in the definition of a type.
    pub fn of_definition(name: &str, definition: &str) -> Result<Self, TypeError> {
        let mut texts = Texts::default();
        let (mut name, mut text) = (name.to_owned(), String::new());
        let mut lines = definition.split('\n');
        while let Some(line) = lines.next() {
            let is_separator = line.len() >= SEPARATOR.len() && line.bytes().all(|byte| byte == b'=');
            if !is_separator {
                text.push_str(line);
                text.push('\n');
                continue;
            }
            let next = lines.next().and_then(|line| line.strip_prefix("MSG:")).unwrap_or_default().trim().to_owned();
            text.pop();
            texts.0.insert(std::mem::replace(&mut name, next), std::mem::take(&mut text));
            if texts.0.len() > MOST {
                return Err(TypeError::TooMany);
            }
        }
        text.pop();
        texts.0.insert(name, text);
        Ok(texts)
    }

    /// The texts of layouts. A layout has no constants, so that the MD5 of a type that declares some is another one.
    pub fn of_layout(interfaces: &[Interface]) -> Self {
        Texts(interfaces.iter().map(|interface| (ros1::type_name(&interface.name), ros1::text(interface))).collect())
    }

    /// The definition of a type: its text, and the text of each type that it contains.
    pub fn definition(&self, name: &str) -> Result<String, TypeError> {
        let mut all = Vec::new();
        self.collect(name, 0, &mut all)?;
        let mut definition = self.text(name)?.to_owned();
        for contained in all {
            let text = self.text(&contained)?;
            let _ = write!(definition, "\n{SEPARATOR}\nMSG: {contained}\n{text}");
        }
        Ok(definition)
    }

    /// The types that a type contains, each once, in the order in which they are met.
    fn collect(&self, name: &str, depth: usize, all: &mut Vec<String>) -> Result<(), TypeError> {
        if depth > DEEPEST {
            return Err(TypeError::TooDeep(name.to_owned()));
        }
        let contained = ros1::contained(package(name), self.text(name)?);
        for contained in contained.map_err(|error| TypeError::Wrong { name: name.to_owned(), error })? {
            if !all.contains(&contained) {
                all.push(contained.clone());
                self.collect(&contained, depth + 1, all)?;
            }
            if all.len() > MOST {
                return Err(TypeError::TooMany);
            }
        }
        Ok(())
    }

    /// The MD5 of a type, in hexadecimal digits.
    pub fn md5(&self, name: &str) -> Result<String, TypeError> {
        let text = self.hashed(name, self.text(name)?, &mut Known::default(), 0)?;
        Ok(hex(&text))
    }

    /// The MD5 of a service, whose `.srv` file has this text.
    pub fn service_md5(&self, name: &str, text: &str) -> Result<String, TypeError> {
        let parts = ros1::parts(text).map_err(|error| TypeError::Wrong { name: name.to_owned(), error })?;
        let mut known = Known::default();
        let [request, reply] = parts.map(|part| self.hashed(name, &part, &mut known, 0));
        Ok(hex(&(request? + &reply?)))
    }

    /// What of a type is hashed.
    fn hashed(&self, name: &str, text: &str, known: &mut Known, depth: usize) -> Result<String, TypeError> {
        if depth > DEEPEST {
            return Err(TypeError::TooDeep(name.to_owned()));
        }
        let mut problem = None;
        let hashed = ros1::hashed_text(package(name), text, &mut |contained| {
            if let Some(md5) = known.get(contained) {
                return Ok(md5.clone());
            }
            let text = self.text(contained).and_then(|text| self.hashed(contained, text, known, depth + 1));
            let md5 = text.map(|text| hex(&text)).map_err(|error| {
                let stop = DefinitionError { line: 0, problem: error.to_string() };
                problem = Some(error);
                stop
            })?;
            known.insert(contained.to_owned(), md5.clone());
            Ok(md5)
        });
        match problem {
            Some(problem) => Err(problem),
            None => hashed.map_err(|error| TypeError::Wrong { name: name.to_owned(), error }),
        }
    }

    /// The layout of a type, preceded by those that it contains.
    pub fn layout(&self, name: &str) -> Result<Vec<Interface>, TypeError> {
        let mut all = vec![name.to_owned()];
        self.collect(name, 0, &mut all)?;
        let mut catalogue = Catalogue::default();
        for definition in ros1::builtin() {
            catalogue.add(definition);
        }
        for name in all {
            let last = name.rsplit('/').next().unwrap_or_default();
            let definition = ros1::msg(package(&name), last, self.text(&name)?);
            catalogue.add(definition.map_err(|error| TypeError::Wrong { name: name.clone(), error })?);
        }
        Ok(catalogue.layout(&ros1::interface(name))?)
    }

    fn text(&self, name: &str) -> Result<&str, TypeError> {
        self.0.get(name).map(String::as_str).ok_or_else(|| TypeError::Missing(name.to_owned()))
    }
}

/// MD5s that were computed.
type Known = BTreeMap<String, String>;

fn package(name: &str) -> &str {
    name.split('/').next().unwrap_or_default()
}

fn hex(text: &str) -> String {
    format!("{:x}", md5::compute(text))
}
