//! Files that people give to `sesamec`, or that lie beside those: opened only if they are regular files, and read up to
//! a limit.
//!
//! So a pipe without a writer cannot block a command, and an endless device cannot fill the memory. Texts may be quoted
//! in messages, so a link must not lead to a file of another kind: otherwise a checkout from someone else could show a
//! password or an environment in the log of its checks.

use std::fs::{self, File};
use std::io::{self, Read as _};
use std::path::{Path, PathBuf};

/// The most that is read of a text that people write, or that cargo does: 8 MiB, as of a `.sesame` file.
pub const MOST_OF_A_TEXT: u64 = 8 << 20;

/// The most that is read of a file that is copied, or compared with what is generated: 256 MiB.
pub(crate) const MOST_OF_A_COPY: u64 = 256 << 20;

/// Why a file cannot be read: what was found, and what to do about it.
#[derive(Debug, thiserror::Error)]
pub enum Unreadable {
    /// There is none.
    #[error("there is no such file")]
    Missing,
    /// Something else is in its place.
    #[error("it is {what}, not a regular file{remedy}")]
    NotAFile {
        /// What, with its article.
        what: &'static str,
        /// What to do, if there is something to say.
        remedy: &'static str,
    },
    /// It is larger than what is read.
    #[error("it is larger than {} MiB, which is the limit for such a file", .most >> 20)]
    TooLarge {
        /// The limit in bytes.
        most: u64,
    },
    /// It holds no text.
    #[error("it is not text in UTF-8")]
    NotText,
    /// A link that leads to a file of another kind.
    #[error(
        "it is a link to {}, a file of another kind, which is not followed; replace the link with a copy",
        target.display()
    )]
    OtherKind {
        /// The file at the end of the link.
        target: PathBuf,
    },
    /// The system refused.
    #[error("{0}")]
    System(io::Error),
}

impl From<io::Error> for Unreadable {
    fn from(error: io::Error) -> Self {
        if error.kind() == io::ErrorKind::NotFound { Unreadable::Missing } else { Unreadable::System(error) }
    }
}

/// Opens a regular file; links are followed.
pub fn open(path: &Path) -> Result<File, Unreadable> {
    // Looked at before it is opened, since opening a pipe waits for its other end.
    regular(&fs::metadata(path)?)?;
    let file = File::open(path)?;
    regular(&file.metadata()?)?;
    Ok(file)
}

/// What a regular file holds, of at most so many bytes; links are followed.
pub fn bytes(path: &Path, most: u64) -> Result<Vec<u8>, Unreadable> {
    let file = open(path)?;
    if file.metadata()?.len() > most {
        return Err(Unreadable::TooLarge { most });
    }
    let mut bytes = Vec::new();
    // Some files are longer than they say, or grow.
    file.take(most + 1).read_to_end(&mut bytes)?;
    if u64::try_from(bytes.len()).is_ok_and(|length| length > most) {
        return Err(Unreadable::TooLarge { most });
    }
    Ok(bytes)
}

/// The text of a regular file, of at most [`MOST_OF_A_TEXT`]. A link is followed if the file that it leads to has the
/// same ending in its name.
pub fn text(path: &Path) -> Result<String, Unreadable> {
    regular(&fs::metadata(path)?)?;
    let target = path.canonicalize()?;
    if target.extension() != path.extension() {
        return Err(Unreadable::OtherKind { target });
    }
    String::from_utf8(bytes(path, MOST_OF_A_TEXT)?).map_err(|_| Unreadable::NotText)
}

fn regular(metadata: &fs::Metadata) -> Result<(), Unreadable> {
    if metadata.is_file() {
        return Ok(());
    }
    let (what, remedy) = what_else(metadata);
    Err(Unreadable::NotAFile { what, remedy })
}

#[cfg(unix)]
fn what_else(metadata: &fs::Metadata) -> (&'static str, &'static str) {
    use std::os::unix::fs::FileTypeExt as _;
    let kind = metadata.file_type();
    if kind.is_fifo() {
        ("a pipe", "; write its output into a file and use that")
    } else if kind.is_char_device() || kind.is_block_device() {
        ("a device", "")
    } else if kind.is_socket() {
        ("a socket", "")
    } else {
        ("a folder", "")
    }
}

#[cfg(not(unix))]
fn what_else(metadata: &fs::Metadata) -> (&'static str, &'static str) {
    if metadata.is_dir() { ("a folder", "") } else { ("a device", "") }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_file_is_read_up_to_the_limit_and_no_further() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.txt");
        fs::write(&path, "12345").unwrap();
        assert_eq!(bytes(&path, 5).unwrap(), b"12345");
        assert!(matches!(bytes(&path, 4), Err(Unreadable::TooLarge { most: 4 })));
        assert!(matches!(bytes(&folder.path().join("b.txt"), 4), Err(Unreadable::Missing)));
        assert_eq!(text(folder.path()).unwrap_err().to_string(), "it is a folder, not a regular file");
        fs::write(&path, b"\xff").unwrap();
        assert!(matches!(text(&path), Err(Unreadable::NotText)));
        File::create(&path).unwrap().set_len(MOST_OF_A_TEXT + 1).unwrap();
        let refused = text(&path).unwrap_err().to_string();
        assert_eq!(refused, "it is larger than 8 MiB, which is the limit for such a file");
    }

    #[cfg(unix)]
    #[test]
    fn pipes_and_devices_are_refused_before_they_are_opened() {
        let folder = tempfile::tempdir().unwrap();
        let pipe = folder.path().join("pipe.sesame");
        assert!(std::process::Command::new("mkfifo").arg(&pipe).status().unwrap().success());
        let refused = text(&pipe).unwrap_err().to_string();
        assert!(refused.starts_with("it is a pipe, not a regular file; write"), "{refused}");
        let refused = bytes(Path::new("/dev/zero"), 10).unwrap_err().to_string();
        assert_eq!(refused, "it is a device, not a regular file");
    }

    #[cfg(unix)]
    #[test]
    fn a_link_is_followed_to_a_file_of_its_own_kind_only() {
        let folder = tempfile::tempdir().unwrap();
        let at = |name: &str| folder.path().join(name);
        fs::write(at("secret"), "mine").unwrap();
        fs::write(at("other.sesame"), "space a").unwrap();
        for (name, target) in
            [("leak.sesame", "secret"), ("hop.sesame", "leak.sesame"), ("link.sesame", "other.sesame")]
        {
            std::os::unix::fs::symlink(target, at(name)).unwrap();
        }
        for name in ["leak.sesame", "hop.sesame"] {
            let refused = text(&at(name)).unwrap_err();
            assert!(matches!(refused, Unreadable::OtherKind { .. }), "{refused}");
        }
        assert_eq!(text(&at("link.sesame")).unwrap(), "space a");
    }

    #[cfg(target_os = "linux")]
    #[test]
    fn a_file_that_is_longer_than_it_says_is_read_up_to_the_limit() {
        let path = Path::new("/proc/self/cmdline");
        assert_eq!(fs::metadata(path).unwrap().len(), 0);
        assert!(matches!(bytes(path, 3), Err(Unreadable::TooLarge { most: 3 })));
    }
}
