//! R2: the highest speed of any gripper.
//!
//! Metric `top_speed` of `kuka_cell` (kuka_cell.sesame:45). This file is yours: it is never overwritten.

use crate::generated::metrics::TopSpeedHook;
use sesame_runtime::metric::Context;

/// Stateless: the context keeps the value so far.
#[derive(Default)]
pub struct TopSpeed;

impl TopSpeedHook for TopSpeed {
    /// A message on `speed` ("cell/gripper_speed"), as the simulator sent it, in m/s.
    fn on_speed(&mut self, speed: f64, ctx: &mut Context) {
        ctx.set(ctx.value().map_or(speed, |highest| highest.max(speed)));
    }
}
