//! Moves joints, and more.

use crate::generated::messages::Joint;
use crate::generated::operations::{BendHook, BendParameters};
use sesame_runtime::fuzz::OperationContext;

#[derive(Default)]
pub struct Bend;

impl BendHook for Bend {
    fn on_path(&mut self, joint: &mut Joint, parameters: &BendParameters, ctx: &mut OperationContext<'_, Joint>) {
        for _ in 0..parameters.copies {
            ctx.inject(joint.clone());
        }
        match parameters.way.as_str() {
            "drop" => ctx.drop_message(),
            "scatter" => joint.position += ctx.draw_between(-1.0, 1.0),
            _ => joint.position += parameters.shift[0],
        }
    }
}
