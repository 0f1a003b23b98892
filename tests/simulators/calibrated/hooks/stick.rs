//! Changes a file and never comes back.

use crate::generated::operations::{StickHook, StickParameters};
use sesame_runtime::fuzz::RunContext;

#[derive(Default)]
pub struct Stick;

impl StickHook for Stick {
    fn before_start(&mut self, _: &StickParameters, ctx: &mut RunContext<'_>) {
        ctx.edit_file("calibration.txt", |text| format!("9{text}"));
        loop {
            std::thread::park();
        }
    }
}
