//! Makes a file after the end.

use crate::generated::operations::{TidyHook, TidyParameters};
use sesame_runtime::fuzz::RunContext;

#[derive(Default)]
pub struct Tidy;

impl TidyHook for Tidy {
    fn after_end(&mut self, _: &TidyParameters, ctx: &mut RunContext<'_>) {
        ctx.replace_file("made.txt", "by the operation");
        ctx.count_side_effect();
    }
}
