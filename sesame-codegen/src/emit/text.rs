//! Text from templates: this project's, or the user's in their place.

use std::collections::BTreeMap;

use serde::Serialize;
use tera::{Context, Tera};

use super::problem::Problem;

/// The templates to fill in. Those of this project hold loops and no logic.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct Templates {
    replaced: BTreeMap<String, String>,
}

impl Templates {
    /// The templates of this project, some of them replaced: by name, such as `runner/hook.rs.tera`.
    ///
    /// Refuses names that no template has, and texts that are not templates.
    pub fn replacing(replaced: BTreeMap<String, String>) -> Result<Self, Vec<Problem>> {
        let problems: Vec<Problem> = replaced
            .iter()
            .filter_map(|(name, text)| {
                if sesame_templates::ALL.iter().all(|(known, _)| known != name) {
                    return Some(Problem::NoSuchTemplate { name: name.clone() });
                }
                let problem = Tera::default().add_raw_template(name, text).err()?;
                Some(Problem::Template { name: name.clone(), problem: explained(&problem) })
            })
            .collect();
        if problems.is_empty() { Ok(Templates { replaced }) } else { Err(problems) }
    }

    /// Fills in the template of a name. Only one of the user's can fail.
    ///
    /// That this project's templates fit what they are given is an invariant of this crate; its tests render each of
    /// them.
    pub(crate) fn render(&self, name: &str, values: &impl Serialize) -> Result<String, Problem> {
        let ours = || sesame_templates::ALL.iter().find(|(known, _)| *known == name).map(|(_, text)| *text);
        let replaced = self.replaced.get(name).map(String::as_str);
        let text = replaced.or_else(ours).expect("what is asked for is a template");
        let context = Context::from_serialize(values).expect("a struct serialises");
        let mut tera = Tera::default();
        let rendered = tera.add_raw_template(name, text).and_then(|()| tera.render(name, &context));
        rendered.map_err(|problem| {
            assert!(replaced.is_some(), "our templates use only what they are given: {problem:?}");
            Problem::Template { name: name.to_owned(), problem: explained(&problem) }
        })
    }
}

/// What tera says of a template, with the causes.
fn explained(problem: &tera::Error) -> String {
    let mut text = problem.to_string().trim().to_owned();
    let mut cause = std::error::Error::source(problem);
    while let Some(error) = cause {
        text = format!("{text}: {}", error.to_string().trim());
        cause = error.source();
    }
    text
}
