//! Definitions of messages, read from the files of a dialect when a run begins.

use std::fs::File;
use std::io::Read as _;
use std::path::Path;

use sesame_interfaces::mavlink::Definitions;

/// The largest file, in bytes. The files of the common dialects have up to half a million.
const LARGEST_FILE: u64 = 8_000_000;

/// The messages that these files define, relative to a folder. An error names the file.
pub(crate) fn read(files: &[String], folder: &Path) -> Result<Definitions, String> {
    Definitions::read(files, folder, &contents).map_err(|unusable| unusable[0].to_string())
}

fn contents(path: &Path) -> Result<String, String> {
    let said = |error: std::io::Error| error.to_string();
    if !path.metadata().map_err(said)?.is_file() {
        return Err("it is not a file".to_owned());
    }
    let mut text = String::new();
    let read = File::open(path).map_err(said)?.take(LARGEST_FILE + 1).read_to_string(&mut text).map_err(said)?;
    if read as u64 > LARGEST_FILE {
        return Err(format!("it has more than {LARGEST_FILE} bytes"));
    }
    Ok(text)
}

#[cfg(test)]
#[expect(clippy::disallowed_types, reason = "they ask another program")]
mod tests;
