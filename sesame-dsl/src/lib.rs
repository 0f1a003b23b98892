//! The front end of the Sesame language: text in, resolved model and diagnostics out.
//!
//! Pure: no file system, no environment, no clock. [`analyse`] never stops at the first mistake, never panics on any
//! text, and reports one mistake once.

mod check;
mod clocks;
pub mod diagnostic;
pub mod format;
pub mod groups;
mod import;
pub mod index;
pub mod interfaces;
pub mod location;
pub mod model;
mod resolve;
pub mod similar;
pub mod source;
pub mod span;
mod synonyms;
mod syntax;
mod tried;
pub mod units;

use diagnostic::{Diagnostic, Severity};
use index::Index;
use interfaces::{Interfaces, NoInterfaces};
use model::Space;
use source::SourceMap;
use span::{FileId, Span};

pub use import::load_imports;
pub use syntax::MAX_BYTES;

/// What an analysis found.
#[derive(Debug, Clone, PartialEq)]
pub struct Analysis {
    /// What is declared and where it is mentioned, as far as it could be read: also there if something is an error.
    pub index: Index,
    /// The model; `Some` exactly when no diagnostic is an error.
    pub model: Option<Space>,
    /// Errors and warnings, sorted by position.
    pub diagnostics: Vec<Diagnostic>,
    /// What could not be decided about monitors within a bound on the work, in sentences.
    pub undecided: Vec<(Span, String)>,
}

impl Analysis {
    /// Whether anything is an error.
    pub fn has_errors(&self) -> bool {
        self.diagnostics.iter().any(|diagnostic| diagnostic.severity() == Severity::Error)
    }
}

/// Analyses the file `root` of `sources` with all it imports, which [`load_imports`] has added: syntax, names, types
/// and units, ranges, campaigns, and what deserves a warning.
///
/// All mistakes of all these kinds come out of one call. Of the types of ROS only those are known that need no files,
/// and nothing is known of the messages that other files define.
pub fn analyse(sources: &SourceMap, root: FileId) -> Analysis {
    analyse_with(sources, root, &NoInterfaces)
}

/// [`analyse`] with definitions of messages from elsewhere.
pub fn analyse_with(sources: &SourceMap, root: FileId, interfaces: &dyn Interfaces) -> Analysis {
    let (mut diagnostics, mut undecided) = (Vec::new(), Vec::new());
    let merged = import::merge(sources, root, &mut diagnostics);
    let index = index::build::index(&merged);
    let model = resolved(sources, root, merged, interfaces, &mut diagnostics, Some(&mut undecided));
    tried::keep_what_mends(sources, &mut diagnostics, |changed| diagnose_with(changed, root, interfaces));
    Analysis { index, model, diagnostics, undecided }
}

/// The diagnostics of [`analyse`] alone, in a fraction of its time: certificates of monitors are not checked, and no
/// suggestion has been tried.
pub fn diagnose(sources: &SourceMap, root: FileId) -> Vec<Diagnostic> {
    diagnose_with(sources, root, &NoInterfaces)
}

/// [`diagnose`] with layouts from elsewhere.
pub fn diagnose_with(sources: &SourceMap, root: FileId, interfaces: &dyn Interfaces) -> Vec<Diagnostic> {
    let mut diagnostics = Vec::new();
    let merged = import::merge(sources, root, &mut diagnostics);
    resolved(sources, root, merged, interfaces, &mut diagnostics, None);
    diagnostics
}

/// The model of what was read, with all diagnostics in order. Certificates are checked if what is undecided about them
/// is asked for.
fn resolved(
    sources: &SourceMap,
    root: FileId,
    merged: import::Merged,
    interfaces: &dyn Interfaces,
    diagnostics: &mut Vec<Diagnostic>,
    undecided: Option<&mut Vec<(Span, String)>>,
) -> Option<Space> {
    let model = resolve::resolve(sources, root, merged, interfaces, diagnostics, undecided);
    if let Some(space) = &model {
        diagnostics.extend(check::check(space, root));
    }
    diagnostics.sort_by_key(|diagnostic| (diagnostic.span, diagnostic.code));
    diagnostics.dedup();
    model
}

/// Whether a word is reserved, so that nothing but a message field can be named by it.
pub fn is_reserved(word: &str) -> bool {
    syntax::is_keyword(word)
}
