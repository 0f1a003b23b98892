//! A folder as it travels: a list of its files with their hashes, and each file on its own, so that what a machine or
//! a queue has already is not sent again.

#![expect(
    clippy::disallowed_methods,
    clippy::disallowed_types,
    reason = "an adapter: it reads and writes the files of a bundle"
)]

use std::fs;
use std::io::{self, Write as _};
use std::path::{Component, Path, PathBuf};

use serde::{Deserialize, Serialize};

use crate::message::{digest_of, digest_of_all};
use crate::queue::LARGEST_FILE;

/// The most files of a bundle.
pub const MOST_FILES: usize = 20_000;

/// The most bytes of a bundle.
pub const LARGEST_BUNDLE: u64 = 4 << 30;

/// Folders that are made by tools and made again on the machine that needs them: they are left behind.
const LEFT_BEHIND: [&str; 6] = [".git", ".hg", "__pycache__", "node_modules", "target", "results"];

/// The files of a folder, in the order of their paths.
#[derive(Debug, Clone, PartialEq, Eq, Default, Serialize, Deserialize)]
pub struct Manifest {
    /// Each file.
    pub files: Vec<Entry>,
}

/// A file of a folder.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct Entry {
    /// Its path from the folder, with `/` between names.
    pub path: String,
    /// The hash of its content.
    pub hash: String,
    /// Its length in bytes.
    pub length: u64,
    /// Whether it is a program.
    pub executable: bool,
}

/// Why a folder cannot travel, or cannot be unpacked.
#[derive(Debug, thiserror::Error)]
pub enum BundleError {
    /// A file cannot be read or written.
    #[error("{}: {error}", path.display())]
    Io {
        /// Which one.
        path: PathBuf,
        /// Why not.
        error: io::Error,
    },
    /// There is too much.
    #[error(
        "{} has more than {MOST_FILES} files or 4 GiB: move out of it what the simulator does not need, or use \
         `--prepared` where agents have the folder already",
        folder.display()
    )]
    TooLarge {
        /// The folder.
        folder: PathBuf,
    },
    /// One file is too large.
    #[error("{} has more than 1 GiB: use `--prepared` where agents have the folder already", path.display())]
    TooLargeFile {
        /// The file.
        path: PathBuf,
    },
    /// Links lead round in a circle.
    #[error("{} is a link that leads to a folder around it", path.display())]
    Circle {
        /// The link.
        path: PathBuf,
    },
    /// A link leads out of the folder, so what is behind it would be missing on other machines.
    #[error("{} is a link that leads out of the folder: agents would not have what is behind it", path.display())]
    LeadsOut {
        /// The link.
        path: PathBuf,
    },
    /// The name of a file is not UTF-8.
    #[error("{} has a name that is not UTF-8", path.display())]
    Name {
        /// The file.
        path: PathBuf,
    },
    /// The list of files was not made by this program.
    #[error("`{0}` is not a path inside of a folder")]
    Path(String),
    /// A file of a prepared folder is not that of the campaign.
    #[error("{} has another content than where the campaign was started", path.display())]
    Differs {
        /// The file.
        path: PathBuf,
    },
    /// A file is not what its hash says.
    #[error("`{0}` has another content than the campaign announced")]
    Content(String),
}

fn at(path: &Path) -> impl FnOnce(io::Error) -> BundleError + '_ {
    move |error| BundleError::Io { path: path.to_owned(), error }
}

/// Lists the files of a folder that is to travel. Folders of tools and earlier results are left behind, and so is what
/// `skip` says.
pub fn list(folder: &Path, skip: &dyn Fn(&Path) -> bool) -> Result<Manifest, BundleError> {
    listed(folder, skip, true)
}

/// The same of a folder that agents have already, however large it is.
pub fn list_prepared(folder: &Path, skip: &dyn Fn(&Path) -> bool) -> Result<Manifest, BundleError> {
    listed(folder, skip, false)
}

fn listed(folder: &Path, skip: &dyn Fn(&Path) -> bool, travels: bool) -> Result<Manifest, BundleError> {
    let root = folder.canonicalize().map_err(at(folder))?;
    let (mut files, mut total) = (Vec::new(), 0);
    // Each with the folders that it lies in, behind all links.
    let mut folders = vec![(folder.to_owned(), vec![root.clone()])];
    while let Some((current, around)) = folders.pop() {
        for entry in fs::read_dir(&current).map_err(at(&current))? {
            let path = entry.map_err(at(&current))?.path();
            let name = path.file_name().and_then(|name| name.to_str());
            let name = name.ok_or_else(|| BundleError::Name { path: path.clone() })?;
            if skip(&path) {
                continue;
            }
            let real = path.canonicalize().map_err(at(&path))?;
            if !real.starts_with(&root) {
                if travels {
                    return Err(BundleError::LeadsOut { path });
                }
                continue;
            }
            let behind = fs::metadata(&path).map_err(at(&path))?;
            if behind.is_dir() {
                if !LEFT_BEHIND.contains(&name) {
                    if around.contains(&real) {
                        return Err(BundleError::Circle { path });
                    }
                    let around = around.iter().cloned().chain([real]).collect();
                    folders.push((path, around));
                }
                continue;
            }
            if !behind.is_file() {
                continue;
            }
            total += behind.len();
            if travels && behind.len() > LARGEST_FILE {
                return Err(BundleError::TooLargeFile { path });
            }
            if travels && (files.len() == MOST_FILES || total > LARGEST_BUNDLE) {
                return Err(BundleError::TooLarge { folder: folder.to_owned() });
            }
            let below = path.strip_prefix(folder).expect("it is below the folder");
            let names: Option<Vec<&str>> = below.iter().map(|name| name.to_str()).collect();
            let names = names.ok_or_else(|| BundleError::Name { path: path.clone() })?;
            files.push(entry_of(&path, names.join("/"))?);
        }
    }
    files.sort_by(|a, b| a.path.cmp(&b.path));
    Ok(Manifest { files })
}

/// A file that travels under this name.
pub fn entry_of(file: &Path, name: String) -> Result<Entry, BundleError> {
    let executable = is_executable(&fs::metadata(file).map_err(at(file))?);
    let (hash, length) = fs::File::open(file).and_then(digest_of_all).map_err(at(file))?;
    Ok(Entry { path: name, hash, length, executable })
}

/// Compares a folder with a manifest, of which it has to have each file; it may have others. The error names the first
/// file that differs.
pub fn compare(manifest: &Manifest, folder: &Path) -> Result<(), BundleError> {
    for entry in &manifest.files {
        let path = folder.join(inside(&entry.path)?);
        let here = entry_of(&path, entry.path.clone())?;
        if (&here.hash, here.length) != (&entry.hash, entry.length) {
            return Err(BundleError::Differs { path });
        }
    }
    Ok(())
}

/// Writes the files of a manifest into a folder, which need not exist; `content` gets each by its hash. Paths that
/// lead out of the folder are refused, and so is any other content than the manifest says.
pub fn unpack(
    manifest: &Manifest,
    folder: &Path,
    content: &mut dyn FnMut(&Entry) -> Result<Vec<u8>, BundleError>,
) -> Result<(), BundleError> {
    let total: u64 = manifest.files.iter().map(|file| file.length).fold(0, u64::saturating_add);
    if manifest.files.len() > MOST_FILES || total > LARGEST_BUNDLE {
        return Err(BundleError::TooLarge { folder: folder.to_owned() });
    }
    fs::create_dir_all(folder).map_err(at(folder))?;
    for entry in &manifest.files {
        let path = folder.join(inside(&entry.path)?);
        let bytes = content(entry)?;
        if bytes.len() as u64 != entry.length || digest_of(&bytes) != entry.hash {
            return Err(BundleError::Content(entry.path.clone()));
        }
        let parent = path.parent().expect("it is below the folder");
        fs::create_dir_all(parent).map_err(at(parent))?;
        let mut file = fs::File::create_new(&path).map_err(at(&path))?;
        file.write_all(&bytes).map_err(at(&path))?;
        if entry.executable {
            make_executable(&file).map_err(at(&path))?;
        }
    }
    Ok(())
}

/// A path of a manifest, which must stay inside of its folder.
pub fn inside(path: &str) -> Result<PathBuf, BundleError> {
    let parsed = Path::new(path);
    let is_inside = parsed.components().all(|component| matches!(component, Component::Normal(_)));
    if !is_inside || path.is_empty() || path.contains('\\') || path.contains('\0') {
        return Err(BundleError::Path(path.to_owned()));
    }
    Ok(parsed.to_owned())
}

#[cfg(unix)]
fn is_executable(metadata: &fs::Metadata) -> bool {
    use std::os::unix::fs::PermissionsExt as _;
    metadata.permissions().mode() & 0o100 != 0
}

#[cfg(not(unix))]
fn is_executable(_: &fs::Metadata) -> bool {
    false
}

#[cfg(unix)]
fn make_executable(file: &fs::File) -> io::Result<()> {
    use std::os::unix::fs::PermissionsExt as _;
    let mut permissions = file.metadata()?.permissions();
    permissions.set_mode(permissions.mode() | 0o100);
    file.set_permissions(permissions)
}

#[cfg(not(unix))]
fn make_executable(_: &fs::File) -> io::Result<()> {
    Ok(())
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeMap;

    use super::*;

    fn write(folder: &Path, path: &str, content: &str) {
        let path = folder.join(path);
        fs::create_dir_all(path.parent().unwrap()).unwrap();
        fs::write(path, content).unwrap();
    }

    /// The files below a folder, by their paths.
    fn files(folder: &Path) -> BTreeMap<String, String> {
        list(folder, &|_| false)
            .unwrap()
            .files
            .into_iter()
            .map(|entry| (entry.path.clone(), fs::read_to_string(folder.join(&entry.path)).unwrap()))
            .collect()
    }

    #[test]
    fn a_folder_arrives_as_it_was_without_what_tools_made() {
        let (from, to) = (tempfile::tempdir().unwrap(), tempfile::tempdir().unwrap());
        write(from.path(), "cell.sesame", "space cell");
        write(from.path(), "world/models/arm.urdf", "<robot/>");
        write(from.path(), "__pycache__/sim.pyc", "compiled");
        write(from.path(), "world/.git/HEAD", "main");
        write(from.path(), "runners/1/out", "earlier");
        let manifest = list(from.path(), &|path| path.ends_with("runners")).unwrap();
        let paths: Vec<&str> = manifest.files.iter().map(|entry| entry.path.as_str()).collect();
        assert_eq!(paths, ["cell.sesame", "world/models/arm.urdf"]);
        let to = to.path().join("new");
        unpack(&manifest, &to, &mut |entry| Ok(fs::read(from.path().join(&entry.path)).unwrap())).unwrap();
        assert_eq!(files(&to).into_keys().collect::<Vec<_>>(), paths);
        assert_eq!(files(&to)["world/models/arm.urdf"], "<robot/>");
    }

    #[test]
    fn a_prepared_folder_may_have_more_files_and_each_that_it_should_have_is_compared() {
        let (here, there) = (tempfile::tempdir().unwrap(), tempfile::tempdir().unwrap());
        write(here.path(), "cell.sesame", "space cell");
        write(here.path(), "world/arm.urdf", "<robot/>");
        let manifest = list_prepared(here.path(), &|_| false).unwrap();
        write(there.path(), "cell.sesame", "space cell");
        assert!(matches!(compare(&manifest, there.path()), Err(BundleError::Io { .. })), "a file is missing");
        write(there.path(), "world/arm.urdf", "<robot/>");
        write(there.path(), "engine/engine.so", "large");
        compare(&manifest, there.path()).unwrap();
        write(there.path(), "world/arm.urdf", "<Robot/>");
        let differs = compare(&manifest, there.path());
        assert!(matches!(&differs, Err(BundleError::Differs { path }) if path.ends_with("arm.urdf")), "{differs:?}");
    }

    #[cfg(unix)]
    #[test]
    fn programs_stay_programs_and_a_link_that_leads_out_is_refused() {
        use std::os::unix::fs::PermissionsExt as _;
        let (from, to) = (tempfile::tempdir().unwrap(), tempfile::tempdir().unwrap());
        write(from.path(), "sim.py", "#!/usr/bin/env python3");
        fs::set_permissions(from.path().join("sim.py"), fs::Permissions::from_mode(0o755)).unwrap();
        let manifest = list(from.path(), &|_| false).unwrap();
        unpack(&manifest, to.path(), &mut |_| Ok(fs::read(from.path().join("sim.py")).unwrap())).unwrap();
        assert_eq!(fs::metadata(to.path().join("sim.py")).unwrap().permissions().mode() & 0o100, 0o100);

        std::os::unix::fs::symlink("sim.py", from.path().join("inside.py")).unwrap();
        assert_eq!(list(from.path(), &|_| false).unwrap().files.len(), 2);
        std::os::unix::fs::symlink("/etc/hostname", from.path().join("outside")).unwrap();
        let error = list(from.path(), &|_| false).unwrap_err();
        assert!(
            error
                .to_string()
                .ends_with("outside is a link that leads out of the folder: agents would not have what is behind it"),
            "{error}"
        );
    }

    #[test]
    fn no_path_leads_out_of_the_folder_and_no_other_content_is_written() {
        let folder = tempfile::tempdir().unwrap();
        let manifest = |path: &str| Manifest {
            files: vec![Entry { path: path.to_owned(), hash: digest_of(b"a"), length: 1, executable: false }],
        };
        for path in ["../a", "/a", "a/../../b", "", ".", "a\\b", "a\0"] {
            let error = unpack(&manifest(path), folder.path(), &mut |_| Ok(b"a".to_vec())).unwrap_err();
            assert!(matches!(error, BundleError::Path(_)), "{path}: {error}");
        }
        for content in [&b"b"[..], b"", b"aa"] {
            let error = unpack(&manifest("a"), folder.path(), &mut |_| Ok(content.to_vec())).unwrap_err();
            assert!(matches!(error, BundleError::Content(_)), "{error}");
        }
        assert_eq!(files(folder.path()).len(), 0);
    }
}
