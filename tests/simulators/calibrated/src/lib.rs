//! A simulator that reads a number from `calibration.txt` beside its space when a run starts, and passes joints on, for
//! the tests across crates.

use sesame_runtime::message::record;
use sesame_runtime::simulator::{Bus, Port, Progress, Setup, Simulator, SimulatorError};
use sesame_runtime::value::Value;

pub struct Calibrated {
    gain: f64,
    gains: Port,
    path: Port,
    heard: Port,
}

impl Simulator for Calibrated {
    fn start(_: &Setup, bus: &mut Bus<'_>) -> Result<Self, SimulatorError> {
        let file = concat!(env!("CARGO_MANIFEST_DIR"), "/../calibration.txt");
        let text = std::fs::read_to_string(file).map_err(|error| SimulatorError(error.to_string()))?;
        let gain = text.trim().parse().map_err(|_| SimulatorError(format!("`{text}` is not a gain")))?;
        let path = bus.open("path");
        bus.subscribe(path);
        let gains = bus.open("gain");
        bus.subscribe(gains);
        Ok(Calibrated { gain, gains, path, heard: bus.open("heard") })
    }

    fn step(&mut self, bus: &mut Bus<'_>) -> Result<Progress, SimulatorError> {
        bus.publish(self.gains, self.gain);
        while bus.receive(self.gains).is_some() {}
        let joint = [
            ("name", Value::Text("elbow".into())),
            ("position", Value::Real(0.0)),
            ("undeclared", Value::Int(7)),
        ];
        bus.publish(self.path, record(&joint));
        while let Some(message) = bus.receive(self.path) {
            assert_eq!(message.at(&["undeclared"]), Some(&Value::Int(7)), "what hooks do not know of stays");
            bus.publish(self.heard, message.number_at(&["position"]).unwrap_or(f64::NAN));
        }
        Ok(Progress::Running)
    }
}
