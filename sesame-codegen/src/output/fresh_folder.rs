//! A folder that is filled all at once: until everything is ready, it lies elsewhere under another name.

use std::fs;
use std::io;
use std::path::{Path, PathBuf};

use super::{Error, is_empty_but_for};

/// A folder that is being filled. Dropped before it is [settled](FreshFolder::settle), it leaves nothing behind; a
/// process that is killed leaves nothing in the folder, and what it had written goes with the next one that fills it.
#[derive(Debug)]
pub struct FreshFolder {
    target: PathBuf,
    /// What is written until then: in the target, if that is there, or else beside it, so that both are on one disk.
    begun: PathBuf,
    was_there: bool,
}

impl FreshFolder {
    /// Begins to fill a folder that must be empty or not there yet. A link in the place of what is
    /// written is removed, never followed.
    pub fn begin(target: &Path) -> Result<FreshFolder, Error> {
        const BEGUN: &str = ".sesamec-import";
        let was_there = is_empty_but_for(target, BEGUN)?;
        let begun = if was_there {
            target.join(BEGUN)
        } else {
            let name = target.file_name().unwrap_or_default().to_string_lossy();
            let parent = target.ancestors().skip(1).find(|folder| folder.as_os_str().is_empty() || folder.exists());
            parent.unwrap_or(Path::new("")).join(format!(".{name}{BEGUN}"))
        };
        match fs::remove_dir_all(&begun) {
            Err(cause) if cause.kind() != io::ErrorKind::NotFound => {
                return Err(Error::Io { action: "remove", path: begun, cause });
            }
            _ => {}
        }
        fs::create_dir(&begun).map_err(|cause| Error::Io { action: "create", path: begun.clone(), cause })?;
        Ok(FreshFolder { target: target.to_owned(), begun, was_there })
    }

    /// Where to write what will be in the folder.
    pub fn path(&self) -> &Path {
        &self.begun
    }

    /// Puts everything in its place.
    pub fn settle(self) -> Result<(), Error> {
        let failed = |action, path: &Path, cause| Error::Io { action, path: path.to_owned(), cause };
        if !self.was_there {
            if let Some(parent) = self.target.parent().filter(|parent| !parent.as_os_str().is_empty()) {
                fs::create_dir_all(parent).map_err(|cause| failed("create", parent, cause))?;
            }
            return fs::rename(&self.begun, &self.target).map_err(|cause| failed("create", &self.target, cause));
        }
        let listed = |cause| failed("look into", &self.begun, cause);
        let mut names = Vec::new();
        for entry in fs::read_dir(&self.begun).map_err(listed)? {
            let entry = entry.map_err(listed)?;
            names.push((!entry.file_type().map_err(listed)?.is_dir(), entry.file_name()));
        }
        // Folders first: who finds the file finds what belongs to it.
        names.sort();
        for (at, (_, name)) in names.iter().enumerate() {
            if let Err(cause) = fs::rename(self.begun.join(name), self.target.join(name)) {
                for (_, done) in &names[..at] {
                    drop(fs::rename(self.target.join(done), self.begun.join(done)));
                }
                return Err(failed("write", &self.target.join(name), cause));
            }
        }
        Ok(())
    }
}

impl Drop for FreshFolder {
    fn drop(&mut self) {
        // What was put in its place is not there any more; the first error is the one to hear of.
        drop(fs::remove_dir_all(&self.begun));
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn fill(folder: &FreshFolder) {
        fs::create_dir(folder.path().join("results")).unwrap();
        fs::write(folder.path().join("results/one"), "1").unwrap();
        fs::write(folder.path().join("a.sesame"), "space a").unwrap();
    }

    fn names(folder: &Path) -> Vec<String> {
        let mut names: Vec<String> =
            fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().file_name().into_string().unwrap()).collect();
        names.sort();
        names
    }

    #[test]
    fn everything_is_in_its_place_or_nothing_is_there() {
        let folder = tempfile::tempdir().unwrap();
        let root = folder.path();
        fs::create_dir(root.join("empty")).unwrap();
        for target in ["empty", "new", "deep/below/new"] {
            let target = root.join(target);
            let there = target.exists();
            let begun = FreshFolder::begin(&target).unwrap();
            fill(&begun);
            drop(begun);
            assert_eq!((target.exists(), root.join("deep").exists()), (there, false), "dropped: {}", target.display());
            let begun = FreshFolder::begin(&target).unwrap();
            fill(&begun);
            begun.settle().unwrap();
            assert_eq!(names(&target), ["a.sesame", "results"]);
            assert_eq!(names(&target.join("results")), ["one"]);
        }
        assert_eq!(names(root), ["deep", "empty", "new"]);
    }

    #[test]
    fn what_a_killed_process_began_goes_with_the_next() {
        let folder = tempfile::tempdir().unwrap();
        for target in [folder.path().to_owned(), folder.path().join("new")] {
            let killed = FreshFolder::begin(&target).unwrap();
            fill(&killed);
            std::mem::forget(killed);
            let begun = FreshFolder::begin(&target).unwrap();
            assert_eq!(names(begun.path()), [""; 0]);
        }
        assert_eq!(names(folder.path()), [""; 0]);
    }

    #[test]
    fn a_folder_that_holds_something_is_left_alone() {
        let folder = tempfile::tempdir().unwrap();
        fs::write(folder.path().join("mine"), "").unwrap();
        assert!(matches!(FreshFolder::begin(folder.path()), Err(Error::NotEmpty { .. })));
        let begun = FreshFolder::begin(&folder.path().join("new")).unwrap();
        fill(&begun);
        fs::create_dir(folder.path().join("new")).unwrap();
        fs::write(folder.path().join("new/mine"), "").unwrap();
        begun.settle().unwrap_err();
        assert_eq!(names(folder.path()), ["mine", "new"]);
        assert_eq!(names(&folder.path().join("new")), ["mine"]);
    }

    #[cfg(unix)]
    #[test]
    fn no_link_is_followed() {
        let folder = tempfile::tempdir().unwrap();
        let elsewhere = folder.path().join("elsewhere");
        fs::create_dir(&elsewhere).unwrap();
        fs::write(elsewhere.join("mine"), "").unwrap();
        fs::create_dir(folder.path().join("out")).unwrap();
        for (target, link) in [("out", "out/.sesamec-import"), ("new", ".new.sesamec-import")] {
            let (target, link) = (folder.path().join(target), folder.path().join(link));
            for behind in [&elsewhere, &elsewhere.join("mine"), &folder.path().join("missing")] {
                std::os::unix::fs::symlink(behind, &link).unwrap();
                let begun = FreshFolder::begin(&target).unwrap();
                assert_eq!(begun.path(), link);
                assert!(fs::symlink_metadata(&link).unwrap().is_dir(), "the link gives way to a folder");
                fill(&begun);
                assert_eq!(names(&elsewhere), ["mine"], "written through {}", link.display());
            }
            std::os::unix::fs::symlink(&elsewhere, &link).unwrap();
            let begun = FreshFolder::begin(&target).unwrap();
            fill(&begun);
            begun.settle().unwrap();
            assert_eq!(names(&target), ["a.sesame", "results"]);
            assert_eq!(names(&elsewhere), ["mine"]);
        }
        assert_eq!(names(folder.path()), ["elsewhere", "new", "out"]);
    }
}
