//! How a real cell differs from the model: what a stand-in for a lab does otherwise.

use sesame_runtime::time::SimTime;

/// How a cell differs from the model. Nothing of it is in the model, so that tools which compare the two have something
/// to find.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Reality {
    /// How long targets take from the PLC to the drives: the field bus and the shared memory between them. They act at
    /// the next step.
    pub latency: SimTime,
    /// The strength of the torque noise, as a share of that of [`crate::NoisyCell`].
    pub noise_share: f64,
    /// How far the zones are from where the model has them, in m: they were measured by hand.
    pub zone_shift: [f64; 3],
    /// The software limit of the product arm's second axis, in rad: whoever put the cell into service set it, and the
    /// model does not know of it. Targets beyond are cut to it. The PLC's own are below 0.9 rad, so only strong
    /// disturbances are weaker than in the model.
    pub soft_limit: Option<f64>,
}

impl Reality {
    /// What does not differ from [`crate::NoisyCell`].
    pub const AS_MODELLED: Reality =
        Reality { latency: SimTime::ZERO, noise_share: 1.0, zone_shift: [0.0; 3], soft_limit: None };
}

impl Default for Reality {
    fn default() -> Self {
        Reality {
            latency: SimTime::from_nanos(50_000_000),
            zone_shift: [0.03, -0.02, 0.0],
            soft_limit: Some(1.1),
            ..Reality::AS_MODELLED
        }
    }
}
