//! The safety concept of the transport: a scanner sees how near the product arm comes to people, and a brake stops it.
//!
//! The concept acts on what it is told. That the scanner sees and the brake holds is not its business: a runtime
//! monitor above it vouches for both, and stops the transport if it cannot.

use std::sync::Arc;

use sesame_runtime::simulator::{Bus, Port};
use sesame_runtime::time::SimTime;
use sesame_runtime::value::{Fields, Record, Value};

/// The topic of the light in the hall, in lx: hall → scanner.
pub const LUMINANCE_TOPIC: &str = "hall/luminance";
/// The topic of what the scanner sees, a message with the [`SCAN_FIELDS`]: scanner → safety PLC.
pub const SCAN_TOPIC: &str = "scanner/zones";
/// The topic of the air supply's pressure, in bar: compressor → brake.
pub const SUPPLY_TOPIC: &str = "hall/air_supply";
/// The topic of the pressure in the brake's reservoir, in bar: brake → whoever watches it.
pub const BRAKE_TOPIC: &str = "brakes/R3200ProductMove/pressure";
/// The topic on which `true` stops the transport: → safety PLC.
pub const STOP_TOPIC: &str = "plc/stop_transport";
/// The topic that says whether the transport is safe: → safety PLC. A stop only holds while the last message is
/// `false`.
pub const PERMISSION_TOPIC: &str = "eddi/safe";
/// The topic of whether the transport stands: safety PLC → whoever watches it.
pub const STANDS_TOPIC: &str = "plc/transport_stands";

/// The fields of a scan: distance of the product arm's gripper to the nearest of Z1 to Z3 in mm, and luminance in lx.
pub const SCAN_FIELDS: [&str; 2] = ["clearance", "luminance"];

/// The light of the hall when nothing is wrong, in lx.
pub const LUMINANCE: f64 = 400.0;
/// Below this luminance in lx the scanner sees nothing at all.
const BLIND_BELOW: f64 = 80.0;
/// What the scanner says when it sees nothing, in m: as far as it can see.
const RANGE: f64 = 8.0;

/// The supply's pressure when nothing is wrong, in bar.
pub const SUPPLY: f64 = 6.0;
/// How fast the reservoir follows the supply: its time constant in s.
const RESERVOIR: f64 = 2.0;
/// At this pressure and below the brake does not bite, in bar.
const SLACK_PRESSURE: f64 = 1.5;
/// From this pressure on it brakes as hard as it can, in bar.
const FULL_PRESSURE: f64 = 4.5;

/// The clearance that is kept from a gripper that stands, in m.
const CLEARANCE: f64 = 0.075;
/// The time within which the concept reacts, in s; a gripper that comes nearer is stopped earlier by the way that it
/// makes in this time.
const REACTION: f64 = 0.1;
/// The deceleration of the gripper with which the concept plans, in m/s².
const DECELERATION: f64 = 20.0;

/// The scanner, the brake, and the safety PLC that acts on what it hears.
#[derive(Debug, Clone)]
pub(crate) struct SafetyConcept {
    scanner: Scanner,
    brake: Brake,
    plc: SafetyPlc,
}

#[derive(Debug, Clone)]
struct Scanner {
    light: Port,
    luminance: f64,
    scan: Port,
    fields: Arc<Fields>,
}

#[derive(Debug, Clone)]
struct Brake {
    supply: Port,
    pressure: Port,
    level: f64,
}

#[derive(Debug, Clone)]
struct SafetyPlc {
    scan: Port,
    stop: Port,
    permission: Port,
    stands: Port,
    /// When something was seen last, and how far away it was.
    seen: Option<(SimTime, f64)>,
    /// The gripper came too near: only a person can let go of the brake again.
    tripped: bool,
    stopped: bool,
    permitted: bool,
}

impl SafetyConcept {
    /// With a brake under pressure, and light; opens its topics.
    pub(crate) fn open(bus: &mut Bus<'_>) -> Self {
        let mut listening = |topic| {
            let port = bus.open(topic);
            bus.subscribe(port);
            port
        };
        let [light, supply] = [LUMINANCE_TOPIC, SUPPLY_TOPIC].map(&mut listening);
        let [scan, stop, permission] = [SCAN_TOPIC, STOP_TOPIC, PERMISSION_TOPIC].map(&mut listening);
        let [pressure, stands] = [BRAKE_TOPIC, STANDS_TOPIC].map(|topic| bus.open(topic));
        SafetyConcept {
            scanner: Scanner { light, luminance: LUMINANCE, scan, fields: Fields::new(SCAN_FIELDS) },
            brake: Brake { supply, pressure, level: SUPPLY },
            plc: SafetyPlc {
                scan,
                stop,
                permission,
                stands,
                seen: None,
                tripped: false,
                stopped: false,
                permitted: false,
            },
        }
    }

    /// What the brake does in this step: nothing, or brake with this share of its force.
    pub(crate) fn braking(&mut self, bus: &mut Bus<'_>) -> Option<f64> {
        self.plc.decides(bus).then(|| self.brake.force())
    }

    /// The end of a step of `seconds`: the scanner sees a gripper at this distance in m from the nearest zone.
    pub(crate) fn publish(&mut self, clearance: f64, seconds: f64, bus: &mut Bus<'_>) {
        bus.publish(self.scanner.light, LUMINANCE);
        bus.publish(self.brake.supply, SUPPLY);
        self.scanner.see(clearance, bus);
        self.brake.breathe(seconds, bus);
        bus.publish(self.plc.stands, self.plc.stands());
    }
}

impl Scanner {
    fn see(&mut self, clearance: f64, bus: &mut Bus<'_>) {
        self.luminance = last_number(self.light, bus).unwrap_or(self.luminance);
        let seen = if self.luminance >= BLIND_BELOW { clearance.min(RANGE) } else { RANGE };
        let values = vec![Value::Real(seen * 1000.0), Value::Real(self.luminance)];
        bus.publish(self.scan, Record::new(&self.fields, values));
    }
}

impl Brake {
    /// The reservoir follows its supply.
    fn breathe(&mut self, seconds: f64, bus: &mut Bus<'_>) {
        if let Some(supply) = last_number(self.supply, bus) {
            self.level += (supply.max(0.0) - self.level) * (seconds / (RESERVOIR + seconds));
        }
        bus.publish(self.pressure, self.level);
    }

    fn force(&self) -> f64 {
        ((self.level - SLACK_PRESSURE) / (FULL_PRESSURE - SLACK_PRESSURE)).clamp(0.0, 1.0)
    }
}

impl SafetyPlc {
    /// Hears what there is; whether the transport is to stand.
    fn decides(&mut self, bus: &mut Bus<'_>) -> bool {
        let now = bus.now();
        while let Some(scan) = bus.receive(self.scan) {
            let Some(clearance) = scan.number_at(&["clearance"]) else { continue };
            let clearance = clearance / 1000.0;
            self.tripped |= clearance < protective_distance(self.approach(now, clearance));
            self.seen = Some((now, clearance));
        }
        while let Some(message) = bus.receive(self.stop) {
            self.stopped |= message == Value::Bool(true);
        }
        while let Some(message) = bus.receive(self.permission) {
            self.permitted = message == Value::Bool(true);
        }
        self.stopped &= !self.permitted;
        self.stands()
    }

    fn stands(&self) -> bool {
        self.tripped || self.stopped
    }

    /// How fast what is seen comes nearer, in m/s.
    fn approach(&self, now: SimTime, clearance: f64) -> f64 {
        match self.seen {
            Some((before, was)) if before < now => ((was - clearance) / (now - before).seconds()).max(0.0),
            _ => 0.0,
        }
    }
}

/// How near a gripper may come that approaches at this speed (in the manner of ISO 13855).
fn protective_distance(speed: f64) -> f64 {
    CLEARANCE + speed * REACTION + speed * speed / (2.0 * DECELERATION)
}

/// The last of the messages that have arrived; `None` without one that is a number.
fn last_number(port: Port, bus: &mut Bus<'_>) -> Option<f64> {
    std::iter::from_fn(|| bus.receive(port)).filter_map(|message| message.number_at::<&str>(&[])).last()
}
