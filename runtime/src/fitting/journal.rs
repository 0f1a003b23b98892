//! What a fit has tried, kept in a file, so that one that was interrupted or killed goes on where it was.
//!
//! A fit asks for the same sets of values in the same order each time. So values that were found before are all that is
//! needed to go on.

use std::collections::BTreeMap;
use std::fs::{File, OpenOptions};
use std::io::{self, Write as _};
use std::path::{Path, PathBuf};

/// A file with a line for what the fit is of, and a line for each set of values that was tried.
#[derive(Debug)]
pub(crate) struct Journal {
    path: PathBuf,
    file: File,
    known: BTreeMap<String, f64>,
}

impl Journal {
    /// Opens a journal. What is in it counts only if it is of the same fit: same tests, simulator, and everything
    /// random. Otherwise it begins anew.
    pub(crate) fn open(path: &Path, of: &str) -> io::Result<Journal> {
        let text = match std::fs::read(path) {
            Ok(bytes) => String::from_utf8_lossy(&bytes).into_owned(),
            Err(error) if error.kind() == io::ErrorKind::NotFound => String::new(),
            Err(error) => return Err(error),
        };
        let head = serde_json::Value::from(of).to_string();
        let mut known = BTreeMap::new();
        let mut kept = head.clone() + "\n";
        if let Some((first, rest)) = text.split_once('\n')
            && first == head
        {
            // A line that was not written to its end says nothing.
            for line in rest.split_inclusive('\n').filter(|line| line.ends_with('\n')) {
                // The bits, since text may round.
                let Ok((key, bits)) = serde_json::from_str::<(String, u64)>(line) else { continue };
                known.insert(key, f64::from_bits(bits));
                kept.push_str(line);
            }
        }
        // What is kept is what was there, except for an unfinished end.
        if kept != text {
            std::fs::write(path, &kept)?;
        }
        let file = OpenOptions::new().append(true).open(path)?;
        Ok(Journal { path: path.to_owned(), file, known })
    }

    /// How many sets of values are known.
    pub(crate) fn known(&self) -> usize {
        self.known.len()
    }

    /// What came of a set of values, if it was tried.
    pub(super) fn find(&self, key: &str) -> Option<f64> {
        self.known.get(key).copied()
    }

    /// Keeps what came of a set of values.
    pub(super) fn keep(&mut self, key: String, value: f64) -> io::Result<()> {
        let line = serde_json::to_string(&(&key, value.to_bits())).map_err(io::Error::other)? + "\n";
        self.file.write_all(line.as_bytes())?;
        self.known.insert(key, value);
        Ok(())
    }

    /// Removes the file: the fit is complete.
    pub(crate) fn done(self) -> io::Result<()> {
        std::fs::remove_file(self.path)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_was_tried_is_known_again_to_the_last_bit_and_an_unfinished_line_is_not() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("fit.jsonl");
        let mut journal = Journal::open(&path, "study").unwrap();
        let values = [0.1 + 0.2, f64::INFINITY, 5e-324];
        for (key, value) in ["a", "b", "c"].into_iter().zip(values) {
            journal.keep(key.to_owned(), value).unwrap();
        }
        drop(journal);
        let mut text = std::fs::read_to_string(&path).unwrap();
        text.push_str("[\"d\",46071");
        std::fs::write(&path, text).unwrap();
        let mut journal = Journal::open(&path, "study").unwrap();
        assert_eq!(
            ["a", "b", "c", "d"].map(|key| journal.find(key)),
            [Some(values[0]), Some(values[1]), Some(values[2]), None]
        );
        journal.keep("d".to_owned(), 2.0).unwrap();
        drop(journal);
        let journal = Journal::open(&path, "study").unwrap();
        assert_eq!((journal.find("d"), journal.known()), (Some(2.0), 4));
        journal.done().unwrap();
        assert!(!path.exists());
    }

    #[test]
    fn what_is_of_another_fit_does_not_count() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("fit.jsonl");
        Journal::open(&path, "one\nspace").unwrap().keep("a".to_owned(), 1.0).unwrap();
        assert_eq!(Journal::open(&path, "other").unwrap().known(), 0);
        assert_eq!(Journal::open(&path, "one\nspace").unwrap().known(), 0, "the other one took its place");
        std::fs::write(&path, [0xff, 0xfe, b'\n', 0]).unwrap();
        assert_eq!(Journal::open(&path, "one").unwrap().known(), 0);
    }
}
