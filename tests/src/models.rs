//! Random valid spaces, as bad as the language permits: names of other languages' keywords, names that differ in case
//! only, very long ones, and texts that would be code, paths, markup or queries if anything took them for more than
//! texts.

mod disturbances;
mod draw;
mod items;
mod words;

use std::fs;
use std::path::Path;

use sesame_rng::Stream;

use self::draw::Draw;
pub use self::words::MARK;

/// A space.
#[derive(Debug, Clone)]
pub struct Model {
    /// The text of its file.
    pub text: String,
    /// A file that it imports, beside it: its name and its text.
    pub imported: Option<(String, String)>,
    /// Its campaigns, those of the imported file included.
    pub campaigns: Vec<String>,
    /// Files that its custom operations may choose, relative to the folder of the space.
    pub files: Vec<String>,
}

impl Model {
    /// Writes the space into a folder as `random.sesame`, with what it imports and its files. Its simulator's crate is
    /// in `simulator`, as seen from there.
    pub fn write(&self, folder: &Path, simulator: &str) {
        let settled = |text: &str| text.replace("crate \"simulator\"", &format!("crate \"{simulator}\""));
        fs::create_dir_all(folder).expect("a folder can be made");
        fs::write(folder.join("random.sesame"), settled(&self.text)).expect("a space can be written");
        if let Some((name, text)) = &self.imported {
            fs::write(folder.join(name), settled(text)).expect("a space can be written");
        }
        for file in &self.files {
            let file = folder.join(file);
            fs::create_dir_all(file.parent().expect("it lies in a folder")).expect("a folder can be made");
            fs::write(file, "a file").expect("a file can be written");
        }
    }
}

/// The space of a seed: the same always. Its simulator is `anything_sim::Anything`, in the folder `simulator`.
pub fn model(seed: u64) -> Model {
    let mut space = items::Space::new(Draw(Stream::derive(seed, "model", &[])));
    let head = space.head();
    let system = space.system();
    let mut items = space.metrics();
    items.extend(space.operations());
    items.extend(space.tests());
    let (campaigns, written) = space.campaigns();
    items.extend(written);
    items.push(system);
    items.extend(space.monitor());
    items.extend(space.lab());
    let order = space.draw.0.permutation(items.len());
    let kept = if space.draw.chance(0.3) { space.draw.below(items.len()) } else { items.len() };
    let part = |of: &[usize]| of.iter().map(|&at| items[at].as_str()).collect::<Vec<_>>().join("\n");
    let (here, there) = order.split_at(kept);
    let mut text = part(here);
    // The head may stand anywhere.
    text = if space.draw.chance(0.5) { head + &text } else { text + &head };
    let imported = (!there.is_empty()).then(|| {
        let name = words::file(&mut space.draw, 0).replace(['/', ' '], "") + ".sesame";
        text = format!("import {}\n{text}", words::quoted(&name));
        (name, part(there))
    });
    Model { text, imported, campaigns, files: space.files }
}
