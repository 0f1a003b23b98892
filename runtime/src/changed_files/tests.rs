use super::*;

fn space() -> (tempfile::TempDir, ChangedFiles) {
    let folder = tempfile::tempdir().unwrap();
    fs::create_dir(folder.path().join("config")).unwrap();
    fs::write(folder.path().join("config/a.yaml"), "gain: 1\n").unwrap();
    let files = ChangedFiles::unlocked(folder.path());
    (folder, files)
}

#[test]
fn files_changed_twice_and_files_created_are_restored() {
    let (folder, mut files) = space();
    let (old, new) = (Path::new("config/a.yaml"), Path::new("config/b.yaml"));
    assert!(files.replace_contents(old, b"gain: 2\n").unwrap());
    assert!(files.replace_contents(old, b"gain: 3\n").unwrap());
    assert!(!files.replace_contents(old, b"gain: 3\n").unwrap(), "that is what it holds");
    assert!(files.replace_contents(new, b"\xff\n").unwrap());
    assert!(matches!(files.text(new), Err(FileError::NoText { .. })));
    assert_eq!(files.restore_all().unwrap(), [old, new]);
    assert_eq!(fs::read_to_string(folder.path().join(old)).unwrap(), "gain: 1\n");
    assert!(!folder.path().join(new).exists());
    assert!(files.restore_all().unwrap().is_empty());
}

#[test]
fn the_next_runner_restores_what_was_left_changed() {
    let (folder, mut files) = space();
    files.replace_contents(Path::new("config/a.yaml"), b"gain: 2\n").unwrap();
    drop(files);
    let (_later, restored) = ChangedFiles::for_supervisor(folder.path(), false).unwrap();
    assert_eq!(restored, [Path::new("config/a.yaml")]);
    assert_eq!(fs::read_to_string(folder.path().join("config/a.yaml")).unwrap(), "gain: 1\n");
}

#[test]
fn one_runner_at_a_time_may_change_files_and_no_other_runs_meanwhile() {
    let (folder, _) = space();
    let (first, _) = ChangedFiles::for_supervisor(folder.path(), true).unwrap();
    for may_change in [true, false] {
        let refused = ChangedFiles::for_supervisor(folder.path(), may_change).unwrap_err();
        assert!(refused.to_string().starts_with("another runner of this space"), "{refused}");
    }
    drop(first);
    ChangedFiles::for_supervisor(folder.path(), true).unwrap();
}

#[test]
fn nothing_outside_the_folder_is_touched() {
    let (folder, mut files) = space();
    let elsewhere = tempfile::tempdir().unwrap();
    let secret = elsewhere.path().join("secret");
    fs::write(&secret, "mine").unwrap();
    let mut paths = vec!["../x", "/etc/passwd", "config/../../x", "", "config", ".sesame-originals/1.json"];
    #[cfg(unix)]
    {
        std::os::unix::fs::symlink(&secret, folder.path().join("link")).unwrap();
        std::os::unix::fs::symlink(elsewhere.path(), folder.path().join("folder")).unwrap();
        paths.extend(["link", "folder/secret", "folder/new"]);
    }
    fs::create_dir_all(folder.path().join(FOLDER)).unwrap();
    for path in paths {
        let refused = files.replace_contents(Path::new(path), b"yours").unwrap_err();
        assert!(matches!(refused, FileError::Outside { .. }), "{path}: {refused}");
    }
    assert_eq!(fs::read_to_string(&secret).unwrap(), "mine");
}

/// What a hostile space has in its folder of originals, or beside it.
#[cfg(unix)]
#[derive(Debug, Clone)]
enum Trap {
    /// A link at a place.
    Link { at: &'static str, to: &'static str },
    /// A file at a place.
    File { at: &'static str },
    /// An entry with a path to be restored.
    Entry { number: u8, path: &'static str, existed: bool, original: bool },
}

#[cfg(unix)]
fn trap() -> impl proptest::strategy::Strategy<Value = Trap> {
    const PLACES: &[&str] = &[
        ".sesame-originals",
        ".sesame-originals/.gitignore",
        ".sesame-originals/1.json",
        ".sesame-originals/1.original",
        ".sesame-originals/2.json",
        ".sesame-originals/2.original",
        ".sesame-originals/2.fresh",
        ".sesame-originals/3.fresh",
        ".sesame-originals/3.original",
        ".sesame-originals/supervisor.lock",
        ".sesame-originals/worker.lock",
        "config",
        "config/a.yaml",
        "config/b.yaml",
        "deep/er",
    ];
    const TARGETS: &[&str] = &["outside", "outside/victim", "outside/folder", "outside/new", "space/config", ""];
    const PATHS: &[&str] = &[
        "config/a.yaml",
        "config/new.yaml",
        "config",
        "deep/er/victim",
        "../outside/victim",
        "ABSOLUTE",
        "config/../../outside/victim",
        ".sesame-originals/1.original",
        "",
        "/",
    ];
    use proptest::prelude::*;
    prop_oneof![
        3 => (prop::sample::select(PLACES), prop::sample::select(TARGETS))
            .prop_map(|(at, to)| Trap::Link { at, to }),
        1 => prop::sample::select(PLACES).prop_map(|at| Trap::File { at }),
        4 => (1..3u8, prop::sample::select(PATHS), any::<bool>(), any::<bool>())
            .prop_map(|(number, path, existed, original)| Trap::Entry { number, path, existed, original }),
    ]
}

/// Every name below a folder, with what it holds or leads to.
#[cfg(unix)]
fn snapshot(folder: &Path) -> std::collections::BTreeMap<PathBuf, Vec<u8>> {
    use std::os::unix::fs::PermissionsExt as _;
    let mut all = std::collections::BTreeMap::new();
    let mut folders = vec![folder.to_owned()];
    while let Some(folder) = folders.pop() {
        for entry in fs::read_dir(&folder).unwrap() {
            let path = entry.unwrap().path();
            let metadata = fs::symlink_metadata(&path).unwrap();
            let mut what = format!("{:o} ", metadata.permissions().mode()).into_bytes();
            if metadata.is_symlink() {
                what.extend(fs::read_link(&path).unwrap().as_os_str().as_encoded_bytes());
            } else if metadata.is_file() {
                what.extend(fs::read(&path).unwrap());
            } else {
                folders.push(path.clone());
            }
            all.insert(path, what);
        }
    }
    all
}

#[cfg(unix)]
proptest::proptest! {
    #![proptest_config(proptest::prelude::ProptestConfig { cases: 200, failure_persistence: None, ..Default::default() })]

    #[test]
    fn nothing_outside_a_hostile_space_is_touched_by_restoring(
        traps in proptest::collection::vec(trap(), 1..8),
        may_change: bool,
    ) {
        let all = tempfile::tempdir().unwrap();
        let (space, outside) = (all.path().join("space"), all.path().join("outside"));
        for folder in [space.join("config"), space.join(FOLDER), space.join("deep"), outside.join("folder")] {
            fs::create_dir_all(folder).unwrap();
        }
        fs::write(space.join("config/a.yaml"), "gain: 1\n").unwrap();
        fs::write(outside.join("victim"), "mine").unwrap();
        fs::write(outside.join("folder/a.yaml"), "mine").unwrap();
        let absolute = outside.join("victim");
        let absolute = absolute.to_str().unwrap();
        for trap in traps {
            match trap {
                Trap::Link { at, to } => {
                    let (at, to) = (space.join(at), all.path().join(to));
                    // Only what the trap itself made may be in its way.
                    if fs::symlink_metadata(&at).is_ok_and(|metadata| metadata.is_dir()) && at.starts_with(&space) {
                        fs::remove_dir_all(&at).unwrap();
                    }
                    drop(std::os::unix::fs::symlink(to, at));
                }
                Trap::File { at } => {
                    if snapshot(&space).contains_key(space.join(at).parent().unwrap()) {
                        drop(File::create_new(space.join(at)));
                    }
                }
                Trap::Entry { number, path, existed, original } => {
                    let folder = space.join(FOLDER);
                    if fs::symlink_metadata(&folder).is_ok_and(|metadata| metadata.is_dir()) {
                        let entry = Entry { path: path.replace("ABSOLUTE", absolute).into(), existed };
                        let entry = serde_json::to_vec(&entry).unwrap();
                        let made = File::create_new(folder.join(format!("{number}.json")));
                        drop(made.and_then(|mut file| file.write_all(&entry)));
                        if original {
                            let made = File::create_new(folder.join(format!("{number}.original")));
                            drop(made.and_then(|mut file| file.write_all(b"yours")));
                        }
                    }
                }
            }
        }
        let before = snapshot(&outside);
        let done = ChangedFiles::for_supervisor(&space, may_change);
        let done = done.map(|(files, _)| drop(files));
        let worked = ChangedFiles::for_worker(&space).and_then(|mut files| {
            for path in ["config/a.yaml", "config/new.yaml", "deep/er/victim"] {
                drop(files.replace_contents(Path::new(path), b"yours"));
            }
            files.restore_all()
        });
        proptest::prop_assert_eq!(snapshot(&outside), before, "{:?} {:?}", done, worked);
        for error in done.err().into_iter().chain(worked.err()) {
            proptest::prop_assert!(error.to_string().contains(space.to_str().unwrap()), "{}", error);
        }
    }
}

#[test]
fn an_entry_that_leads_out_of_the_space_stops_all_and_is_named() {
    let (folder, mut files) = space();
    files.replace_contents(Path::new("config/a.yaml"), b"gain: 2\n").unwrap();
    let entry = folder.path().join(FOLDER).join("2.json");
    for path in ["../x", "/etc/passwd", "config/../../x", "config", "", ".sesame-originals/1.original"] {
        fs::write(&entry, serde_json::to_vec(&Entry { path: path.into(), existed: false }).unwrap()).unwrap();
        let refused = files.restore_all().unwrap_err();
        assert!(matches!(refused, FileError::EntryOutside { .. }), "{path}: {refused}");
        assert!(refused.to_string().contains("2.json"), "{refused}");
        assert_eq!(fs::read_to_string(folder.path().join("config/a.yaml")).unwrap(), "gain: 2\n", "nothing is");
    }
    fs::remove_file(&entry).unwrap();
    assert_eq!(files.restore_all().unwrap(), [Path::new("config/a.yaml")]);
}

#[test]
fn a_missing_original_is_named() {
    let (folder, mut files) = space();
    files.replace_contents(Path::new("config/a.yaml"), b"gain: 2\n").unwrap();
    fs::remove_file(folder.path().join(FOLDER).join("1.original")).unwrap();
    let refused = files.restore_all().unwrap_err().to_string();
    for part in ["1.original is missing", "1.json", "config/a.yaml"] {
        assert!(refused.contains(part), "{refused}");
    }
}
