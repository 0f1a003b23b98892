//! The command, with a language that reads every text as the same space.

use std::fs;
use std::path::Path;
use std::process::ExitCode;

use sesame_codegen::project::Simulator;
use sesamec::cli::{Shell, run};
use sesamec::frontend::{Checked, Declarations, Diagnosed, Found, Language, Look};

use crate::plans::small;

fn check(file: &str, text: &str, _look: Look) -> Checked {
    if text.contains("mistake") {
        return Checked { diagnostics: format!("error: {file}"), errors: 1, ..Checked::default() };
    }
    let warnings = usize::from(text.contains("doubtful"));
    Checked { warnings, summary: "2 campaigns".into(), plans: vec![small("day"), small("night")], ..Checked::default() }
}

/// Knows of nothing but blanks at the ends of lines.
fn format(_file: &str, text: &str, _look: Look) -> Result<String, Diagnosed> {
    if text.contains("mistake") {
        return Err(Diagnosed { diagnostics: "error".into(), errors: 1 });
    }
    Ok(text.lines().flat_map(|line| [line.trim_end(), "\n"]).collect())
}

/// Knows the two campaigns, and a topic.
fn find(_file: &str, text: &str, name: &str) -> Result<Found, String> {
    let campaign = match name {
        "day" | "night" => true,
        "speed" => false,
        _ => return Err(format!("nothing is named `{name}`")),
    };
    let errors = usize::from(text.contains("mistake"));
    Ok(Found { campaign, text: String::new(), uses: String::new(), json: String::new(), errors })
}

const LANGUAGE: Language = Language {
    check,
    format,
    explain: |code| (code == "E0203").then_some("# E0203"),
    codes: || vec![("E0203", "There is no such name.")],
    find,
    declarations: |_, text| {
        let errors = usize::from(text.contains("mistake"));
        Declarations { text: String::new(), json: String::new(), errors }
    },
};

pub(crate) fn sesamec(arguments: &[&str]) -> bool {
    let arguments = ["sesamec"].iter().chain(arguments);
    run(Shell::plain(), &LANGUAGE, arguments) == ExitCode::SUCCESS
}

/// A project whose space is read by the language above.
pub(crate) fn project(folder: &Path, text: &str) -> String {
    fs::create_dir_all(folder.join("simulator")).unwrap();
    fs::write(folder.join("simulator/Cargo.toml"), "[package]\nname = \"kuka_cell_sim\"\n").unwrap();
    let file = folder.join("kuka_cell.sesame");
    fs::write(&file, text).unwrap();
    file.to_str().unwrap().to_owned()
}

#[test]
fn generating_makes_all_runners_beside_the_space() {
    let folder = tempfile::tempdir().unwrap();
    let file = project(folder.path(), "");
    assert!(sesamec(&["generate", &file]));
    for path in ["hooks/top_speed.rs", "day/src/main.rs", "night/src/main.rs", "night/Cargo.lock", "README.md"] {
        assert!(folder.path().join("runners").join(path).is_file(), "{path}");
    }
}

#[test]
fn generating_one_campaign_makes_only_its_runner_and_it_stays_the_same_with_the_others() {
    let folder = tempfile::tempdir().unwrap();
    let file = project(folder.path(), "");
    assert!(sesamec(&["generate", &file, "--campaign", "night"]));
    assert!(!folder.path().join("runners/day").exists());
    let before = fs::read_to_string(folder.path().join("runners/.sesame/manifest.json")).unwrap();
    assert!(sesamec(&["generate", &file]));
    assert_eq!(fs::read_to_string(folder.path().join("runners/.sesame/manifest.json")).unwrap(), before);
}

#[test]
fn a_campaign_that_is_not_there_is_an_error() {
    let folder = tempfile::tempdir().unwrap();
    let file = project(folder.path(), "");
    assert!(!sesamec(&["generate", &file, "--campaign", "nihgt"]));
    assert!(!sesamec(&["run", &file]), "there are two to choose from");
    assert!(!folder.path().join("runners").exists());
}

#[test]
fn a_space_with_mistakes_generates_nothing() {
    let folder = tempfile::tempdir().unwrap();
    let file = project(folder.path(), "mistake");
    assert!(!sesamec(&["check", &file]));
    assert!(!sesamec(&["generate", &file]));
    assert!(!folder.path().join("runners").exists());
}

#[test]
fn warnings_are_refused_on_demand_only() {
    let folder = tempfile::tempdir().unwrap();
    let file = project(folder.path(), "doubtful");
    assert!(sesamec(&["check", &file]));
    assert!(!sesamec(&["check", "--deny", "warnings", &file]));
    let file = project(folder.path(), "fine");
    assert!(sesamec(&["check", &file, "--deny", "warnings"]));
}

#[test]
fn checking_what_was_generated_tells_by_its_exit_code() {
    let folder = tempfile::tempdir().unwrap();
    let file = project(folder.path(), "");
    assert!(!sesamec(&["generate", "--check", &file]));
    assert!(sesamec(&["generate", &file]));
    assert!(sesamec(&["generate", "--check", &file]));
}

#[test]
fn a_new_project_is_never_mixed_with_something_else() {
    let folder = tempfile::tempdir().unwrap();
    let demo = folder.path().join("demo");
    assert!(sesamec(&["new", demo.to_str().unwrap()]));
    assert!(!sesamec(&["new", demo.to_str().unwrap()]));
    fs::create_dir(folder.path().join("empty")).unwrap();
    assert!(sesamec(&["new", folder.path().join("empty").to_str().unwrap()]));
}

#[test]
fn a_new_project_has_a_name_that_a_space_can_have() {
    let folder = tempfile::tempdir().unwrap();
    for name in ["My-Cell", "1st", "cell.two", "Cell"] {
        assert!(!sesamec(&["new", folder.path().join(name).to_str().unwrap()]), "{name}");
        assert!(!folder.path().join(name).exists(), "{name}");
    }
}

fn new_project(simulator: Simulator) -> String {
    let runtime = sesame_codegen::environment::RuntimeChoice::Version("0.1.0".into());
    let templates = sesame_codegen::emit::Templates::default();
    let files = sesame_codegen::project::files(Path::new("demo"), simulator, Some(&runtime), &templates).unwrap();
    let shown: Vec<String> = files.iter().map(|(path, text)| format!("═══ {path}\n{text}")).collect();
    shown.join("\n")
}

#[test]
fn the_texts_of_a_new_project() {
    insta::assert_snapshot!(new_project(Simulator::Rust));
}

#[test]
fn the_texts_of_a_new_project_in_python() {
    insta::assert_snapshot!(new_project(Simulator::Python));
}

#[test]
fn explaining_an_unknown_code_is_an_error() {
    assert!(sesamec(&["explain", "E0203"]));
    assert!(!sesamec(&["explain", "E9999"]));
}

#[test]
fn a_campaign_is_explained_from_its_file() {
    let folder = tempfile::tempdir().unwrap();
    let file = project(folder.path(), "");
    assert!(sesamec(&["explain", "night", &file]));
    assert!(!sesamec(&["explain", "nihgt", &file]));
    assert!(!sesamec(&["explain", "night"]), "nobody knows which space it is in");
    assert!(!folder.path().join("runners").exists(), "explaining writes nothing");
}

#[test]
fn what_a_space_with_errors_declares_is_explained_all_the_same() {
    let folder = tempfile::tempdir().unwrap();
    let file = project(folder.path(), "mistake");
    assert!(sesamec(&["explain", "speed", &file]));
    assert!(sesamec(&["explain", "speed", &file, "--format", "json"]));
    assert!(!sesamec(&["explain", "sped", &file]));
    assert!(sesamec(&["explain", &file]));
    assert!(sesamec(&["explain", &file, "--format", "json"]));
    assert!(!sesamec(&["explain", "E0203", "--format", "json"]), "a code has a page of text");
    assert!(!sesamec(&["explain", "day", &file]), "what a campaign does cannot be told from a space with errors");
    assert!(sesamec(&["explain", "day", &file, "--format", "json"]), "where it is declared can");
}

#[test]
fn a_dry_run_writes_nothing() {
    let folder = tempfile::tempdir().unwrap();
    let file = project(folder.path(), "");
    assert!(sesamec(&["generate", "--dry-run", &file]));
    assert!(!folder.path().join("runners").exists());
}

#[test]
fn a_self_contained_runner_stands_alone() {
    let folder = tempfile::tempdir().unwrap();
    let file = project(folder.path(), "");
    assert!(sesamec(&["generate", &file, "-c", "day", "--self-contained"]));
    assert!(folder.path().join("runners/day/src/hooks/top_speed.rs").is_file());
    assert!(!folder.path().join("runners/hooks").exists() && !folder.path().join("runners/README.md").exists());
    assert!(sesamec(&["generate", &file, "-c", "day", "--self-contained", "--check"]));
    assert!(!sesamec(&["generate", &file, "-c", "day"]), "it would lose what it carries");
    assert!(sesamec(&["generate", &file, "-c", "night"]), "its neighbour shares as ever");
}

#[test]
fn files_are_formatted_in_place_or_only_looked_at() {
    let folder = tempfile::tempdir().unwrap();
    let (untidy, tidy, broken) = ("a.sesame", "b.sesame", "c.sesame");
    let path = |name: &str| folder.path().join(name);
    let text = |name: &str| fs::read_to_string(path(name)).unwrap();
    fs::write(path(untidy), "space a  \n").unwrap();
    fs::write(path(tidy), "space b\n").unwrap();
    fs::write(path("notes.txt"), "blanks  \n").unwrap();
    let all = folder.path().to_str().unwrap();
    assert!(!sesamec(&["fmt", "--check", all]));
    assert_eq!(text(untidy), "space a  \n");
    assert!(sesamec(&["fmt", path(tidy).to_str().unwrap(), "--check"]));
    fs::write(path(broken), "mistake  \n").unwrap();
    assert!(!sesamec(&["fmt", all]), "one has a mistake");
    assert_eq!((text(untidy).as_str(), text(broken).as_str()), ("space a\n", "mistake  \n"));
    assert_eq!(text("notes.txt"), "blanks  \n");
    fs::remove_file(path(broken)).unwrap();
    assert!(sesamec(&["fmt", "--check", all]));
    assert!(!sesamec(&["fmt", path("none.sesame").to_str().unwrap()]));
}

#[cfg(unix)]
#[test]
fn formatting_keeps_links_and_permissions() {
    use std::os::unix::fs::PermissionsExt as _;

    let folder = tempfile::tempdir().unwrap();
    let (file, link) = (folder.path().join("a.sesame"), folder.path().join("link.sesame"));
    fs::write(&file, "space a  \n").unwrap();
    fs::set_permissions(&file, fs::Permissions::from_mode(0o640)).unwrap();
    std::os::unix::fs::symlink(&file, &link).unwrap();
    assert!(sesamec(&["fmt", link.to_str().unwrap()]));
    assert_eq!(fs::read_to_string(&file).unwrap(), "space a\n");
    assert_eq!(fs::metadata(&file).unwrap().permissions().mode() & 0o777, 0o640);
    assert!(fs::symlink_metadata(&link).unwrap().is_symlink());
}
