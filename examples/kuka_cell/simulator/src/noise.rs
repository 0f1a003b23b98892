//! Torque noise: what makes two runs of a real cell differ.

use sesame_runtime::rng::Stream;

use crate::arm::ArmModel;
use crate::kinematics::Joints;

/// Strength of the noise: its standard deviation as a part of a joint's highest acceleration.
const STRENGTH: f64 = 0.05;

/// The correlation time of the noise, in s: friction and ripple change as fast as the arm turns, not from step to step.
const CORRELATION_SECONDS: f64 = 0.2;

/// Coloured noise on the torque of each joint of an arm.
#[derive(Debug, Clone)]
pub struct TorqueNoise {
    stream: Stream,
    strength: Joints,
    remembered: f64,
    renewed: f64,
    state: Joints,
}

impl TorqueNoise {
    /// The noise of an arm: its own stream under the run's seed.
    pub fn new(seed: u64, arm_idx: usize, model: &ArmModel, step_seconds: f64) -> Self {
        let remembered = libm::exp(-step_seconds / CORRELATION_SECONDS);
        TorqueNoise {
            stream: Stream::derive(seed, "torque noise", &[arm_idx as u64]),
            strength: model.joints.map(|limits| STRENGTH * limits.acceleration),
            remembered,
            // Keeps the variance at one from step to step.
            renewed: libm::sqrt(1.0 - remembered * remembered),
            state: [0.0; 6],
        }
    }

    /// The disturbance of the next step, in rad/s² per joint.
    pub fn draw(&mut self) -> Joints {
        for state in &mut self.state {
            *state = self.remembered * *state + self.renewed * self.stream.normal();
        }
        std::array::from_fn(|joint| self.strength[joint] * self.state[joint])
    }
}
