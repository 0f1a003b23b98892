//! Random valid spaces, as bad as the language permits: names of other languages' keywords, names that differ in case
//! only, very long ones, and texts that would be code, paths, markup or queries if anything took them for more than
//! texts.

mod disturbances;
mod items;
mod words;

use std::fs;
use std::path::Path;

use sesame_rng::Stream;

/// What stands in hostile texts and nowhere else: where it turns up as anything but text, a text became something.
pub const MARK: &str = "injected";

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

/// Random choices.
pub(crate) struct Draw(Stream);

impl Draw {
    pub(crate) fn below(&mut self, n: usize) -> usize {
        self.0.below(n)
    }

    /// From `low` to `high`, both included.
    pub(crate) fn between(&mut self, low: usize, high: usize) -> usize {
        low + self.0.below(high - low + 1)
    }

    pub(crate) fn chance(&mut self, probability: f64) -> bool {
        self.0.chance(probability)
    }

    pub(crate) fn one<'a, T>(&mut self, of: &'a [T]) -> &'a T {
        &of[self.0.below(of.len())]
    }

    /// Two different positions below `n` at most, ascending; at least one.
    pub(crate) fn some(&mut self, n: usize, most: usize) -> Vec<usize> {
        let count = self.between(1, most.min(n));
        let mut chosen = self.0.permutation(n);
        chosen.truncate(count);
        chosen
    }

    /// A decimal number from -20 to 20, sometimes a great or a tiny one.
    pub(crate) fn number(&mut self) -> f64 {
        match self.below(12) {
            0 => 1e6 * self.0.uniform(-1.0, 1.0).round(),
            1 => 1e-6,
            2 => 0.0,
            3..=6 => self.0.uniform(-20.0, 20.0).round(),
            _ => (100.0 * self.0.uniform(-20.0, 20.0)).round() / 100.0,
        }
    }

    /// Two numbers, ascending.
    pub(crate) fn range(&mut self) -> (f64, f64) {
        let (a, b) = (self.number(), self.number());
        (a.min(b), a.max(b))
    }

    /// A part of a range: an end, or both of it.
    pub(crate) fn part(&mut self, (low, high): (f64, f64)) -> (f64, f64) {
        *self.one(&[(low, high), (low, low), (high, high)])
    }
}
