//! A simulator that does not always do the same, for the tests across crates: a gust comes at a time that only the seed
//! knows, and does harm where the robot is being pushed.
//!
//! Who pushes hard between 0.8 s and 0.9 s does harm with every seed.

use sesame_runtime::rng::Stream;
use sesame_runtime::simulator::{Bus, Port, Progress, Setup, Simulator, SimulatorError};

pub struct Gusty {
    push: Port,
    harm: Port,
    /// When the gust comes, in seconds.
    gust: f64,
    /// Whether a gust throws the robot over.
    weak: bool,
}

impl Simulator for Gusty {
    fn start(setup: &Setup, bus: &mut Bus<'_>) -> Result<Self, SimulatorError> {
        // So that a test can count the runs.
        if let Ok(path) = std::env::var("RUNS") {
            use std::io::Write as _;
            let file = std::fs::OpenOptions::new().create(true).append(true).open(&path);
            file.and_then(|mut file| file.write_all(b"run\n")).expect("runs can be counted");
            // And kill before there are more than so many: until then, this one is not over.
            let most = std::env::var("MOST_RUNS").map_or(usize::MAX, |most| most.parse().expect("a number of runs"));
            let runs = || std::fs::read(&path).map_or(0, |text| text.len() / "run\n".len());
            while runs() > most {
                std::thread::sleep(std::time::Duration::from_millis(20));
            }
        }
        let mut stream = Stream::derive(setup.seed, "gust", &[]);
        let (push, harm) = (bus.open("gusty/push"), bus.open("gusty/harm"));
        bus.subscribe(push);
        // STILL makes it do always the same.
        let still = std::env::var_os("STILL").is_some();
        let (gust, weak) = if still { (0.35, false) } else { (stream.uniform(0.0, 0.8), stream.chance(0.1)) };
        Ok(Gusty { push, harm, gust, weak })
    }

    fn step(&mut self, bus: &mut Bus<'_>) -> Result<Progress, SimulatorError> {
        if let Ok(pause) = std::env::var("PAUSE_US") {
            std::thread::sleep(std::time::Duration::from_micros(pause.parse().expect("microseconds")));
        }
        bus.publish(self.push, 0.0);
        let mut push: f64 = 0.0;
        while let Some(message) = bus.receive(self.push) {
            push = push.max(message.number_at::<&str>(&[]).unwrap_or(0.0));
        }
        let now = bus.now().seconds();
        let gust = (self.gust..self.gust + 0.02).contains(&now) && push > 0.2;
        if gust && self.weak {
            return Err(SimulatorError(format!("a gust threw the robot over at {now} s")));
        }
        let hard = if (0.8..0.9).contains(&now) { 3.0 * push } else { push };
        bus.publish(self.harm, if gust { 5.0 } else { hard });
        Ok(Progress::Running)
    }
}
