//! A simulator that breaks in a given way when a message on a given topic is disturbed, for the tests across crates.
//!
//! Undisturbed, every message is 0 and nothing happens. What has to go wrong without a disturbance is asked for by the
//! environment variable `FAULT`.

use std::io::Read as _;

use sesame_runtime::simulator::{Bus, Port, Progress, Setup, Simulator, SimulatorError};

const FAULTS: [&str; 6] = ["panic", "error", "hang", "abort", "hook_panic", "hook_nan"];

pub struct Faulty {
    faults: Vec<Port>,
    heard: Port,
    level: Port,
    fault: String,
}

impl Simulator for Faulty {
    fn start(_: &Setup, bus: &mut Bus<'_>) -> Result<Self, SimulatorError> {
        let fault = std::env::var("FAULT").unwrap_or_default();
        let faults = FAULTS.iter().map(|name| bus.open(&format!("faulty/{name}"))).collect::<Vec<_>>();
        for &port in &faults {
            bus.subscribe(port);
        }
        let level = bus.open(if fault == "missing topic" { "faulty/lvel" } else { "faulty/level" });
        bus.subscribe(level);
        Ok(Faulty { faults, heard: bus.open("faulty/heard"), level, fault })
    }

    fn step(&mut self, bus: &mut Bus<'_>) -> Result<Progress, SimulatorError> {
        match self.fault.as_str() {
            "crash" => panic!("the reference run is to crash"),
            "kill" => {
                let itself = std::process::id().to_string();
                std::process::Command::new("kill").args(["-9", &itself]).status().expect("there is a `kill`");
            }
            "wrong type" => bus.publish(self.level, "high"),
            "flood" => (0..1_000_000).for_each(|_| bus.publish(self.level, 1.0)),
            "early end" if bus.now().seconds() >= 0.5 => return Ok(Progress::Ended),
            "reads input" => {
                let mut input = String::new();
                std::io::stdin().read_to_string(&mut input).expect("it can be read");
                assert_eq!(input, "", "nobody says anything to a simulator there");
                bus.publish(self.level, 1.0);
            }
            "broken requirement" => bus.publish(self.level, 5.0),
            _ => bus.publish(self.level, 1.0),
        }
        while bus.receive(self.level).is_some() {}
        if let Ok(pause) = std::env::var("PAUSE_US") {
            std::thread::sleep(std::time::Duration::from_micros(pause.parse().expect("microseconds")));
        }
        for (at, name) in FAULTS.into_iter().enumerate() {
            bus.publish(self.faults[at], 0.0);
            let mut disturbed = false;
            while let Some(message) = bus.receive(self.faults[at]) {
                disturbed |= message.number_at::<&str>(&[]) != Some(0.0);
            }
            match name {
                _ if !disturbed => {}
                "panic" => panic!("the simulator was disturbed at {}", bus.now()),
                "error" => return Err(SimulatorError(format!("a joint broke at {}", bus.now()))),
                "hang" => loop {
                    std::thread::park();
                },
                "abort" => {
                    eprintln!("about to abort");
                    std::process::abort();
                }
                "hook_panic" => bus.publish(self.heard, 1.0),
                _ => bus.publish(self.heard, 2.0),
            }
        }
        Ok(Progress::Running)
    }
}
