//! The cell as a simulator: PLC, arms, conveyors and zones, which communicate over the bus.

use sesame_runtime::simulator::{Bus, Port, Progress, Setup, Simulator, SimulatorError};
use sesame_runtime::time::SimTime;

use crate::arm::{Arm, R3200, R270072, R270073};
use crate::conveyor::{Conveyor, INFEED, OUTFEED};
use crate::geometry::Vector;
use crate::lab::Reality;
use crate::noise::TorqueNoise;
use crate::plc::Plc;
use crate::program::programs;
use crate::safety::SafetyConcept;
use crate::zones::ZoneMonitor;

/// The topic of the fastest gripper's speed, in m/s.
pub const GRIPPER_SPEED_TOPIC: &str = "cell/gripper_speed";

/// Parameters: how far the zones are from where the model has them, in m.
pub(crate) const ZONE_SHIFT: [&str; 3] = ["zone_shift_x", "zone_shift_y", "zone_shift_z"];

/// The longest step that still moves smoothly.
const LONGEST_STEP: SimTime = SimTime::from_nanos(50_000_000);

/// The servos are integrated in parts of a step no longer than this.
const LONGEST_PART: SimTime = SimTime::from_nanos(4_000_000);

/// The gearbox cell without randomness: the same messages give the same run for every seed.
#[derive(Debug, Clone)]
pub struct Cell(World);

/// The same with the [safety concept](crate::safety) of its transport: a scanner of the zones with people, a brake of
/// the product arm, and a stop that others can command.
#[derive(Debug, Clone)]
pub struct TransportCell {
    world: World,
    safety: SafetyConcept,
}

/// The gearbox cell with torque noise drawn from the run's seed.
#[derive(Debug, Clone)]
pub struct NoisyCell {
    world: World,
    noise: [TorqueNoise; 3],
}

/// A stand-in for the real cell: [as noisy](NoisyCell), and different from the model where reality often is.
#[derive(Debug, Clone)]
pub struct RealCell {
    world: World,
    noise: [TorqueNoise; 3],
    noise_share: f64,
}

impl RealCell {
    /// Starts a cell that differs so from the model.
    pub fn start_as(reality: &Reality, setup: &Setup, bus: &mut Bus<'_>) -> Result<Self, SimulatorError> {
        let mut world = World::start_shifted(setup, Vector::from_array(reality.zone_shift), bus)?;
        for (at, arm) in world.arms.iter_mut().enumerate() {
            // The first one moves the product.
            arm.reach_drives_by(reality.latency, reality.soft_limit.filter(|_| at == 0));
        }
        let noise = torque_noise(setup, &world);
        Ok(RealCell { world, noise, noise_share: reality.noise_share })
    }
}

impl Simulator for RealCell {
    fn start(setup: &Setup, bus: &mut Bus<'_>) -> Result<Self, SimulatorError> {
        RealCell::start_as(&Reality::default(), setup, bus)
    }

    fn step(&mut self, bus: &mut Bus<'_>) -> Result<Progress, SimulatorError> {
        let share = self.noise_share;
        let disturbances = self.noise.each_mut().map(|noise| noise.draw().map(|torque| share * torque));
        self.world.step(bus, &disturbances);
        Ok(Progress::Running)
    }
}

/// The noise of each arm.
fn torque_noise(setup: &Setup, world: &World) -> [TorqueNoise; 3] {
    std::array::from_fn(|arm| TorqueNoise::new(setup.seed, arm, world.arms[arm].model(), setup.step.seconds()))
}

impl Simulator for Cell {
    fn start(setup: &Setup, bus: &mut Bus<'_>) -> Result<Self, SimulatorError> {
        World::start(setup, bus).map(Cell)
    }

    fn step(&mut self, bus: &mut Bus<'_>) -> Result<Progress, SimulatorError> {
        self.0.step(bus, &[[0.0; 6]; 3]);
        Ok(Progress::Running)
    }
}

impl Simulator for TransportCell {
    fn start(setup: &Setup, bus: &mut Bus<'_>) -> Result<Self, SimulatorError> {
        Ok(TransportCell { world: World::start(setup, bus)?, safety: SafetyConcept::open(bus) })
    }

    fn step(&mut self, bus: &mut Bus<'_>) -> Result<Progress, SimulatorError> {
        let braking = self.safety.braking(bus);
        self.world.step_braking(bus, &[[0.0; 6]; 3], braking);
        let clearance = self.world.monitor.clearance_from_people(&self.world.arms[0]);
        self.safety.publish(clearance, self.world.step.seconds(), bus);
        Ok(Progress::Running)
    }
}

impl Simulator for NoisyCell {
    fn start(setup: &Setup, bus: &mut Bus<'_>) -> Result<Self, SimulatorError> {
        let world = World::start(setup, bus)?;
        let noise = torque_noise(setup, &world);
        Ok(NoisyCell { world, noise })
    }

    fn step(&mut self, bus: &mut Bus<'_>) -> Result<Progress, SimulatorError> {
        let disturbances = self.noise.each_mut().map(TorqueNoise::draw);
        self.world.step(bus, &disturbances);
        Ok(Progress::Running)
    }
}

impl Cell {
    /// The arms: R3200, R270073, R270072.
    pub fn arms(&self) -> &[Arm; 3] {
        &self.0.arms
    }
}

impl NoisyCell {
    /// The arms: R3200, R270073, R270072.
    pub fn arms(&self) -> &[Arm; 3] {
        &self.world.arms
    }
}

/// Everything in the cell.
#[derive(Debug, Clone)]
struct World {
    plc: Plc,
    arms: [Arm; 3],
    conveyors: [Conveyor; 2],
    monitor: ZoneMonitor,
    gripper_speed: Port,
    step: SimTime,
    n_parts: u32,
    part_seconds: f64,
}

impl World {
    fn start(setup: &Setup, bus: &mut Bus<'_>) -> Result<Self, SimulatorError> {
        World::start_shifted(setup, Vector::ZERO, bus)
    }

    /// With the zones elsewhere by so many metres.
    ///
    /// Where the zones are is also what a study may fit to a lab: three parameters of the simulator, in metres.
    fn start_shifted(setup: &Setup, zone_shift: Vector, bus: &mut Bus<'_>) -> Result<Self, SimulatorError> {
        let zone_shift = zone_shift + Vector::from_array(ZONE_SHIFT.map(|axis| setup.parameter(axis, 0.0)));
        let step = setup.step;
        if step <= SimTime::ZERO || step > LONGEST_STEP {
            return Err(SimulatorError(format!(
                "a step of {step} does not suit the gearbox cell: give it more than 0 ms and at most 50 ms (its PLC runs \
                 at 20 ms)"
            )));
        }
        let n_parts = u32::try_from((step.nanos() + LONGEST_PART.nanos() - 1) / LONGEST_PART.nanos())
            .expect("a step of at most 50 ms has few parts");
        let programs = programs()?;
        let [product_home, housing_home, shaft_home] = programs.homes;
        let arms = [
            Arm::open(&R3200, &product_home, bus),
            Arm::open(&R270073, &housing_home, bus),
            Arm::open(&R270072, &shaft_home, bus),
        ];
        let conveyors = [Conveyor::open(&INFEED, bus), Conveyor::open(&OUTFEED, bus)];
        Ok(World {
            plc: Plc::open(programs, bus),
            monitor: ZoneMonitor::open(&arms, zone_shift, bus),
            arms,
            conveyors,
            gripper_speed: bus.open(GRIPPER_SPEED_TOPIC),
            step,
            n_parts,
            part_seconds: step.seconds() / f64::from(n_parts),
        })
    }

    fn step(&mut self, bus: &mut Bus<'_>, disturbances: &[[f64; 6]; 3]) {
        self.step_braking(bus, disturbances, None);
    }

    /// The same while the product arm is stopped by its brake, with this share of the brake's force.
    fn step_braking(&mut self, bus: &mut Bus<'_>, disturbances: &[[f64; 6]; 3], braking: Option<f64>) {
        self.plc.scan(braking.map_or(SimTime::ZERO, |_| self.step), bus);
        for (at, (arm, disturbance)) in self.arms.iter_mut().zip(disturbances).enumerate() {
            arm.receive(bus);
            // The first one moves the product.
            match braking.filter(|_| at == 0) {
                Some(force) => arm.brake(self.n_parts, self.part_seconds, force),
                None => arm.advance(self.n_parts, self.part_seconds, disturbance),
            }
            arm.publish_state(bus);
        }
        for conveyor in &mut self.conveyors {
            conveyor.receive(bus);
            conveyor.advance(self.n_parts, self.part_seconds);
            conveyor.publish_measured(bus);
        }
        self.monitor.publish(&self.arms, bus);
        let fastest = self.arms.iter().map(Arm::gripper_speed).fold(0.0, f64::max);
        bus.publish(self.gripper_speed, fastest);
    }
}
