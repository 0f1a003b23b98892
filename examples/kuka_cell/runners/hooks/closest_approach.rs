//! R3: the closest approach of the product arm to an assembly arm.
//!
//! Metric `closest_approach` of `kuka_cell` (kuka_cell.sesame:48). This file is yours: it is never overwritten.

use crate::generated::messages::SafetyZone;
use crate::generated::metrics::ClosestApproachHook;
use sesame_runtime::metric::Context;

/// Stateless: the context keeps the value so far.
#[derive(Default)]
pub struct ClosestApproach;

impl ClosestApproachHook for ClosestApproach {
    /// A message on `arms` ("safetyzones/{ZR270073,ZR270072}"), as the simulator sent it.
    fn on_arms(&mut self, arms: &SafetyZone, ctx: &mut Context) {
        ctx.set(ctx.value().map_or(arms.level, |closest| closest.min(arms.level)));
    }
}
