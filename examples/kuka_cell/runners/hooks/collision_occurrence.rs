//! R1: intervals of 0.2 s in which the gripper was inside a safety zone.
//!
//! Metric `collision_occurrence` of `kuka_cell` (kuka_cell.sesame:42). This file is yours: it is never overwritten.

use crate::generated::messages::SafetyZone;
use crate::generated::metrics::CollisionOccurrenceHook;
use sesame_runtime::metric::Context;

/// Counts at most once in 0.2 s, at any rate of messages and for any number of zones ([SESAME 2023, Figure 12]).
#[derive(Default)]
pub struct CollisionOccurrence;

impl CollisionOccurrenceHook for CollisionOccurrence {
    /// A message on `zones` ("safetyzones/{Z1,Z2,Z3}"), as the simulator sent it.
    fn on_zones(&mut self, zone: &SafetyZone, ctx: &mut Context) {
        if zone.level < 0.0 && ctx.every_seconds(0.2) {
            ctx.add(1.0);
        }
    }
}
