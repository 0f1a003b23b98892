//! Figures of the page for a page of others, such as a notebook: a piece of HTML with its style, without a script.

use std::path::Path;

use sesame_present::markup::Markup;
use sesame_record::{RecordError, Repository};

use crate::facts::summary::summarise;
use crate::html::front::front;
use crate::html::header::header;
use crate::html::page::{causes, requirements, worst_of_causes};
use crate::html::test::test;

/// The class of the element around the figures. Its style applies to nothing else.
const CLASS: &str = "sesame-figures";

/// The figures of a run are its findings, causes, requirements and front; those of a test are its timeline and tables
/// of everything on it. A run may still be going on.
///
/// Links lead nowhere but to other tests of the same piece.
pub fn figures(repository: &Repository, of_test: Option<u32>) -> Result<String, RecordError> {
    let rows = repository.tests()?;
    let members = repository.latest_result_set()?.map_or_else(Vec::new, |set| set.members);
    let summary = summarise(repository, &rows, &members)?;
    let mut body = Markup::default();
    body.open("div", &[("class", CLASS)]);
    if let Some(number) = of_test {
        test(&mut body, repository, &summary, number, Path::new(""))?;
    } else {
        header(&mut body, repository, &summary);
        causes(&mut body, &summary, &[]);
        if let Some(number) = worst_of_causes(&summary) {
            test(&mut body, repository, &summary, number, Path::new(""))?;
        }
        requirements(&mut body, &summary, &[]);
        front(&mut body, repository, &summary, &rows, &[]);
    }
    body.close();
    let style = sesame_templates::report::style_below(CLASS);
    Ok(format!("<style>\n{style}</style>\n{}", body.finish()))
}
