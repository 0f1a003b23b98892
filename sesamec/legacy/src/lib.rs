//! Testing spaces of the original SESAME platform, with all that was done with them: from its EMF files (XMI) to a
//! `.sesame` file and results.
//!
//! A file is read into an [`Original`] (`xml`, `dialect`, `read`), which is mapped to the text of a space that passes
//! `check` (`space`, `campaigns`, `boosting`, `known_tests`, `monitors`, with `writer`, `parts`, `types`, `naming`),
//! and its performed tests to records (`results`, `extents`). Everything that changes on the way is listed in
//! [`Notes`]; what these say of the language is listed in `lacks`, for a test. No name or text of the file becomes
//! anything but a name, a quoted text or a comment.

mod boosting;
mod campaigns;
mod dialect;
mod extents;
mod known_tests;
mod lacks;
mod monitors;
mod naming;
mod notes;
mod original;
mod parts;
mod read;
mod results;
mod space;
mod types;
mod writer;
mod xml;

use std::fs::File;
use std::path::Path;

use sesame_plan::CampaignPlan;
use sesame_record::RecordError;

pub use dialect::{Dialect, LEFT_OUT, LeftOut};
pub use lacks::{LACKS, Lack};
pub use naming::Names;
pub use notes::{Counted, Kind, Notes};
pub use original::Original;
pub use results::Recorded;
pub use xml::Broken;

/// A file as it was imported: the text of a space, and results that are ready to be recorded.
#[derive(Debug, Clone, PartialEq)]
pub struct Imported {
    /// What was in the file.
    pub original: Original,
    /// What an import did that a user should know.
    pub notes: Notes,
    mapped: writer::Mapped,
}

impl Imported {
    /// Reads a file, which the caller has opened, and maps it. A file that is broken, or not of the original platform,
    /// gives one diagnostic, in which the file is called by this path.
    pub fn read(path: &Path, file: File) -> Result<Imported, Broken> {
        let original = read::read(path, file)?;
        let mut notes = Notes::default();
        let name = path.file_name().unwrap_or_default().to_string_lossy();
        let mapped = space::map(&original, &name, &mut notes).map_err(|what| Broken {
            file: path.to_owned(),
            place: None,
            what,
        })?;
        Ok(Imported { original, notes, mapped })
    }

    /// The `.sesame` file.
    pub fn text(&self) -> &str {
        &self.mapped.text
    }

    /// The campaigns that performed tests and are in the `.sesame` file: position in the original, and name.
    pub fn performed(&self) -> impl Iterator<Item = (usize, &str)> {
        let campaigns = self.original.campaigns.iter().zip(&self.mapped.campaigns).enumerate();
        campaigns
            .filter(|(_, (campaign, _))| !campaign.tests.is_empty())
            .filter_map(|(at, (_, name))| Some((at, name.as_deref()?)))
    }

    /// Records the tests of one of these campaigns into a folder without results. The plan is that of the campaign in
    /// the `.sesame` file.
    pub fn record(&mut self, at: usize, plan: &CampaignPlan, folder: &Path) -> Result<Recorded, RecordError> {
        results::record(&self.original, &self.mapped, at, plan, folder, &mut self.notes)
    }
}
