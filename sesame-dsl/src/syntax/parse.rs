//! From the grammar's pairs to the syntax tree.

mod campaign;
mod eddi;
mod exploration;
mod formula;
mod lifecycle;
mod metric;
mod operation;
mod physical;
mod reader;
mod system;
mod test;
mod words;

use sesame_grammar::Rule;

use self::reader::{Pair, Reader, expect_child};
use super::ast::File;
use super::limits::{MAX_BYTES, parse_bounded, too_deep};
use crate::diagnostic::{Code, Diagnostic};
use crate::span::{FileId, Span};

/// Reads one file. Never fails: what could not be read is in the diagnostics, and the rest is in the tree.
pub(crate) fn parse(file: FileId, text: &str, diagnostics: &mut Vec<Diagnostic>) -> File {
    let mut reader = Reader { file, text, diagnostics, out: File::default(), mistake: None };
    if text.len() > MAX_BYTES {
        let span = Span { file, lo: 0, hi: 0 };
        let title = format!("the file has {} bytes, but the limit is {MAX_BYTES}", text.len());
        reader.diagnostics.push(Diagnostic::new(Code::TOO_LARGE, span, title));
    } else if let Some((at, title)) = too_deep(text) {
        let span = reader.span_of(at, at + 1);
        reader.diagnostics.push(Diagnostic::new(Code::TOO_LARGE, span, title).label("nested too deeply"));
    } else {
        match parse_bounded(Rule::file, text) {
            Ok(mut pairs) => {
                let root = pairs.next().expect("a parse that succeeds has its rule's pair");
                reader.file(&root);
                return reader.out;
            }
            // The entry rule accepts every text, so only the limit on calls is left.
            Err(error) => {
                let span = Span { file, lo: 0, hi: 0 };
                let title = format!("the file takes too long to read: {}", error.variant.message());
                reader.diagnostics.push(Diagnostic::new(Code::TOO_LARGE, span, title));
            }
        }
    }
    reader.out.has_errors = true;
    reader.out
}

impl Reader<'_> {
    fn file(&mut self, root: &Pair<'_>) {
        let has_errors = self.members(root, |reader, item| match item.as_rule() {
            Rule::space => {
                let head = reader.head(&item);
                reader.out.spaces.push(head);
            }
            Rule::system => {
                let system = reader.system(&item);
                reader.out.systems.push(system);
            }
            Rule::metric => {
                let metric = reader.metric(&item);
                reader.out.metrics.push(metric);
            }
            Rule::requirement => {
                let requirement = reader.requirement(&item);
                reader.out.requirements.push(requirement);
            }
            Rule::scene_parameter => {
                let parameter = reader.scene_parameter(&item);
                reader.out.operations.push(parameter);
            }
            Rule::operation => {
                let operation = reader.operation(&item);
                reader.out.operations.push(operation);
            }
            Rule::test => {
                let test = reader.test(&item);
                reader.out.tests.push(test);
            }
            Rule::campaign => {
                let campaign = reader.campaign(&item);
                reader.out.campaigns.push(campaign);
            }
            Rule::import => {
                let import = reader.text_of(&expect_child(&item, Rule::text));
                reader.out.imports.push(import);
            }
            Rule::eddi => {
                let eddi = reader.eddi(&item);
                reader.out.eddis.push(eddi);
            }
            Rule::physical => {
                let physical = reader.physical(&item);
                reader.out.physicals.push(physical);
            }
            other => unreachable!("{other:?} is not a declaration"),
        });
        self.out.has_errors |= has_errors;
    }
}
