//! Files of reports.

use std::path::Path;

/// Writes a file aside and renames it, so that a reader never sees half of it.
pub fn write_aside(path: &Path, content: &str) -> std::io::Result<()> {
    let mut aside = path.as_os_str().to_owned();
    aside.push(".tmp");
    std::fs::write(&aside, content).and_then(|()| std::fs::rename(&aside, path))
}
