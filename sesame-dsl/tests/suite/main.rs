//! The front end as those who use it meet it: what it says, what it takes, and that no text is too much for it.
#![cfg(test)]

#[path = "../files/mod.rs"]
mod files;
mod sound;

mod diagnostics;
mod docs;
mod fixes;
mod format;
mod fuzz;
mod hints;
mod index;
mod interfaces;
mod next_mistake;
mod operations;
mod pages;
mod robustness;
mod several_files;
mod suggestions;
mod undecided;
