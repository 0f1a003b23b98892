//! Writes another gain.

use crate::generated::operations::{SpoilHook, SpoilParameters};
use sesame_runtime::fuzz::RunContext;

#[derive(Default)]
pub struct Spoil;

impl SpoilHook for Spoil {
    fn before_start(&mut self, parameters: &SpoilParameters, ctx: &mut RunContext<'_>) {
        ctx.replace_file(&*parameters.file, format!("{}\n", parameters.gain));
        match parameters.fate.as_str() {
            "panic" => panic!("spoilt too much"),
            "abort" => std::process::abort(),
            "leave" => ctx.replace_file("../elsewhere.txt", "gone"),
            _ => {}
        }
    }
}
