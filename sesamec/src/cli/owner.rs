//! Whose a runner's folder is: the space of which it holds results, or from which it was generated.

use std::fs::File;
use std::io::Read as _;
use std::path::Path;

use anyhow::bail;
use sesame_codegen::emit;

/// The most bytes of a plan that are read for its source.
const LARGEST_PLAN: u64 = 64 << 20;

/// The file name of another space in the folder of this one to which a runner's folder belongs. A space that was
/// renamed or removed owns nothing any more.
pub(super) fn other_than(file: &Path, folder: &Path) -> Option<String> {
    let source = sesame_runtime::cli::recorded_source(&folder.join("results")).or_else(|| generated_from(folder))?;
    let is_own = file.file_name().is_some_and(|name| name == source.as_str());
    (!is_own && file.with_file_name(&source).is_file()).then_some(source)
}

/// The file name of the space from which a runner was generated.
fn generated_from(folder: &Path) -> Option<String> {
    let mut plan = Vec::new();
    File::open(folder.join(emit::CAMPAIGN_PLAN)).ok()?.take(LARGEST_PLAN).read_to_end(&mut plan).ok()?;
    let plan: serde_json::Value = serde_json::from_slice(&plan).ok()?;
    Some(plan.get("source")?.as_str()?.to_owned())
}

/// Fails if a runner's folder, which the user has named, belongs to another space that has a campaign of the same name.
pub(super) fn check(file: &Path, folder: &Path) -> anyhow::Result<()> {
    let Some(source) = other_than(file, folder) else { return Ok(()) };
    bail!(
        "{} belongs to `{source}`, not to `{}`: choose another folder for the runners of one of them with `-o`",
        folder.display(),
        file.display()
    )
}
