//! Files of the corpus, for the tests that go over them.

use std::path::{Path, PathBuf};

use sesame_dsl::interfaces::{DialectMessage, Folders, Interfaces, UnusableFile};
use sesame_dsl::source::SourceMap;
use sesame_dsl::{Analysis, analyse_with};
use sesame_interfaces::mavlink::{Definition, Definitions};
use sesame_plan::Interface;

/// The files of a folder of the corpus: names without `.sesame`, and texts.
#[expect(clippy::disallowed_methods, reason = "the crate is pure; its tests read their corpus")]
pub(crate) fn corpus(folder: &str) -> Vec<(String, String)> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests").join(folder);
    let mut files: Vec<PathBuf> = std::fs::read_dir(folder)
        .expect("the corpus is beside this file")
        .map(|entry| entry.expect("the corpus can be listed").path())
        .collect();
    files.retain(|file| file.extension().is_some_and(|extension| extension == "sesame"));
    files.sort();
    assert!(!files.is_empty());
    let name =
        |file: &PathBuf| file.file_stem().and_then(|stem| stem.to_str()).expect("corpus names are plain").to_owned();
    files.iter().map(|file| (name(file), std::fs::read_to_string(file).expect("the corpus is text"))).collect()
}

/// A text, analysed as the file of a name.
pub(crate) fn analyse_text(name: &str, text: &str) -> (SourceMap, Analysis) {
    let mut sources = SourceMap::new();
    let file = sources.add(format!("{name}.sesame"), text);
    let analysis = analyse_with(&sources, file, &Dialects);
    (sources, analysis)
}

/// The files in `dialects/`, which spaces of the corpus name as those beside them. Others are not read.
pub(crate) struct Dialects;

impl Interfaces for Dialects {
    fn find(&self, _: Folders<'_>, _: &str) -> Result<Option<Vec<Interface>>, String> {
        Ok(None)
    }

    #[expect(clippy::disallowed_methods, reason = "the crate is pure; its tests read their corpus")]
    fn dialect(&self, files: &[String], _: &str) -> Result<Option<Vec<DialectMessage>>, Vec<UnusableFile>> {
        if files.iter().any(|file| !file.starts_with("../dialects/")) {
            return Ok(None);
        }
        let contents = |path: &Path| std::fs::read_to_string(path).map_err(|_| "there is no such file".to_owned());
        let definitions = Definitions::read(files, Path::new("tests/bad"), &contents).map_err(|unusable| {
            let why = unusable.into_iter().map(|file| UnusableFile { named: file.named, why: file.why() });
            why.collect::<Vec<_>>()
        })?;
        let message = |definition: &Definition| {
            let entries = definitions.entries(definition);
            let entries = entries.map(|(field, entry)| (field.name.as_str(), entry.name.as_str(), entry.value));
            DialectMessage::new(definition.interface(), entries)
        };
        Ok(Some(definitions.iter().map(message).collect()))
    }
}
