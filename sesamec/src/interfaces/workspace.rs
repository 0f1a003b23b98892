//! Where the packages of a workspace are: in the folder itself, or in a repository below it, as colcon and catkin find
//! them.

use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};

use sesame_codegen::input;

/// The most folders that are looked into below one folder.
const MOST_FOLDERS: usize = 20_000;

/// The deepest package below a folder: repositories have packages in groups of packages.
const DEEPEST: usize = 6;

/// A file by which colcon, catkin or ament leave a folder out.
const LEFT_OUT: [&str; 3] = ["COLCON_IGNORE", "CATKIN_IGNORE", "AMENT_IGNORE"];

/// The packages below a folder, by their names. If two have the same name, the first counts, in the order of their
/// paths. A package is a folder with a `package.xml`, and contains no other. No link is followed, and what lies beyond
/// the limits is not found: a folder such as `/usr/share` has packages and much else.
pub(super) fn packages(folder: &Path) -> BTreeMap<String, PathBuf> {
    let mut found = BTreeMap::new();
    let mut left = MOST_FOLDERS;
    look_into(folder, 0, &mut left, &mut found);
    found
}

fn look_into(folder: &Path, depth: usize, left: &mut usize, found: &mut BTreeMap<String, PathBuf>) {
    let Some(fewer) = left.checked_sub(1) else { return };
    *left = fewer;
    if depth > 0 {
        if LEFT_OUT.iter().any(|mark| folder.join(mark).exists()) {
            return;
        }
        if let Some(name) = package(folder) {
            found.entry(name).or_insert_with(|| folder.to_owned());
            return;
        }
    }
    if depth == DEEPEST {
        return;
    }
    // A folder that cannot be read has no package for us.
    let Ok(entries) = fs::read_dir(folder) else { return };
    let mut inner: Vec<PathBuf> = entries
        .filter_map(Result::ok)
        .filter(|entry| entry.file_type().is_ok_and(|ty| ty.is_dir()))
        .filter(|entry| !entry.file_name().to_string_lossy().starts_with('.'))
        .map(|entry| entry.path())
        .collect();
    inner.sort_unstable();
    for folder in inner {
        look_into(&folder, depth + 1, left, found);
    }
}

/// The name of the package that a folder is.
fn package(folder: &Path) -> Option<String> {
    let text = input::text(&folder.join("package.xml")).ok()?;
    let manifest = roxmltree::Document::parse(&text).ok()?;
    let name = manifest.root_element().children().find(|element| element.has_tag_name("name"))?;
    Some(name.text()?.trim().to_owned())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn packages_are_found_in_repositories_and_named_by_their_manifests() {
        let folder = tempfile::tempdir().unwrap();
        let package = |path: &str, name: &str| {
            let path = folder.path().join(path);
            fs::create_dir_all(&path).unwrap();
            let text =
                format!("<?xml version=\"1.0\"?>\n<package><!-- <name>x</name> --><name> {name} </name></package>");
            fs::write(path.join("package.xml"), text).unwrap();
        };
        package("autoware_msgs/autoware_planning_msgs", "autoware_planning_msgs");
        package("autoware_msgs/autoware_planning_msgs/test/inner", "inner");
        package("nav/stack/core/msgs", "nav_msgs_of_ours");
        package("b/same", "same");
        package("a/same", "same");
        package("a/b/c/d/e/f/deep", "deep");
        package(".hidden/hidden", "hidden");
        package("out/ignored", "ignored");
        fs::write(folder.path().join("out/COLCON_IGNORE"), "").unwrap();
        fs::create_dir_all(folder.path().join("plain/msg")).unwrap();
        fs::create_dir_all(folder.path().join("broken")).unwrap();
        fs::write(folder.path().join("broken/package.xml"), "<package>").unwrap();
        std::os::unix::fs::symlink(folder.path(), folder.path().join("nav/again")).unwrap();

        let found = packages(folder.path());
        let found: Vec<(&str, &Path)> =
            found.iter().map(|(name, path)| (name.as_str(), path.strip_prefix(folder.path()).unwrap())).collect();
        let expected = [
            ("autoware_planning_msgs", "autoware_msgs/autoware_planning_msgs"),
            ("nav_msgs_of_ours", "nav/stack/core/msgs"),
            ("same", "a/same"),
        ];
        assert_eq!(found, expected.map(|(name, path)| (name, Path::new(path))));
        assert_eq!(packages(&folder.path().join("none")), BTreeMap::new());
    }
}
