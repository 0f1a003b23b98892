//! One launched program: started, awaited, watched.

use std::time::{Duration, Instant};

use sesame_plan::{Launch, ReadyWhen};

use crate::launch::Probe;
use crate::launch::signals;
use crate::output::Watch;
use crate::program::{Alarm, PostMortem, Program, Running};

/// A program that is launched, and how far it is.
pub(super) struct Started {
    pub(super) launch: Launch,
    /// Program and owner, for messages.
    pub(super) shown: String,
    /// What is awaited of it, as a phrase.
    awaited: Option<String>,
    state: State,
}

enum State {
    /// It has not been started, or was ended.
    Off,
    /// It runs; awaited if it is not ready.
    On { running: Box<Running>, watch: Watch, since: Instant, ready: bool, paused: bool },
}

/// What is wrong with a launched program.
pub(super) struct Problem {
    /// What, as a phrase.
    pub(super) what: String,
    pub(super) last_lines: String,
    /// Whether the program could not be started at all.
    pub(super) not_started: bool,
    /// Whether it was killed by another process or the system.
    pub(super) killed: bool,
}

impl Started {
    pub(super) fn new(launch: Launch, shown: String, awaited: Option<String>) -> Self {
        Started { launch, shown, awaited, state: State::Off }
    }

    /// Starts the program; its reason if that is not possible.
    pub(super) fn start(&mut self, program: &Program, alarm: &Alarm) -> Result<(), Problem> {
        let ready = self.launch.ready.as_ref();
        let watch = Watch::new(ready.and_then(|ready| match &ready.when {
            ReadyWhen::Line { text } => Some(text.as_str()),
            _ => None,
        }));
        let running = program.start_in_background(&watch, alarm).map_err(|error| Problem {
            what: format!("cannot be started in {}: {}", error.folder.display(), error.reason),
            last_lines: String::new(),
            not_started: true,
            killed: false,
        })?;
        let (running, since) = (Box::new(running), Instant::now());
        self.state = State::On { running, watch, since, ready: ready.is_none(), paused: false };
        Ok(())
    }

    pub(super) fn is_on(&self) -> bool {
        matches!(self.state, State::On { .. })
    }

    /// Whether it runs and is ready, or is not to run.
    pub(super) fn is_ready(&self) -> bool {
        !matches!(self.state, State::On { ready: false, .. })
    }

    /// Looks whether it is ready now. `port` is the one that is awaited, if one is.
    pub(super) fn poll(&mut self, port: Option<u16>, asked: &mut dyn FnMut(Probe) -> bool) -> Result<bool, Problem> {
        self.check()?;
        let (State::On { running, watch, since, ready, paused }, Some(awaited)) = (&mut self.state, &self.launch.ready)
        else {
            return Ok(true);
        };
        *ready = *ready
            || match &awaited.when {
                ReadyWhen::Port { .. } => port.is_some_and(accepts),
                ReadyWhen::Line { .. } => watch.seen(),
                ReadyWhen::Topic { topic } => asked(Probe::Topic(*topic)),
                ReadyWhen::Clock => asked(Probe::Clock),
            };
        if !*ready && !*paused && since.elapsed().as_secs_f64() >= awaited.within {
            let what = self.awaited.as_deref().unwrap_or("its sign that it is ready");
            return Err(Problem {
                what: format!("was not ready within {} s: {what} was awaited", awaited.within),
                last_lines: running.last_lines_so_far(),
                not_started: false,
                killed: false,
            });
        }
        Ok(*ready)
    }

    /// That it runs, unless it is off.
    pub(super) fn check(&mut self) -> Result<(), Problem> {
        let State::On { running, ready, .. } = &self.state else { return Ok(()) };
        if !running.has_ended() {
            return Ok(());
        }
        let ready = *ready;
        let State::On { running, .. } = std::mem::replace(&mut self.state, State::Off) else { return Ok(()) };
        let PostMortem { how, last_lines, not_found, killed, success: _ } = running.post_mortem();
        let while_awaited = match &self.awaited {
            Some(awaited) if !ready => format!(" while {awaited} was awaited"),
            _ => String::new(),
        };
        Err(Problem { what: format!("{how}{while_awaited}"), last_lines, not_started: not_found, killed })
    }

    /// Stops its processes, until [`Started::resume`]; whether it runs.
    pub(super) fn pause(&mut self) -> bool {
        let State::On { running, paused, .. } = &mut self.state else { return false };
        *paused = signals::pause(running);
        *paused
    }

    /// Lets its processes go on; whether they were paused.
    pub(super) fn resume(&mut self) -> bool {
        let State::On { running, paused, .. } = &mut self.state else { return false };
        std::mem::take(paused) && signals::resume(running)
    }

    /// Ends its processes at once; whether it ran.
    pub(super) fn kill(&mut self) -> bool {
        let State::On { running, .. } = std::mem::replace(&mut self.state, State::Off) else { return false };
        let ran = !running.has_ended();
        running.expect_end();
        signals::kill(&running);
        ran
    }

    /// Asks it to end.
    pub(super) fn ask_to_end(&mut self) {
        self.resume();
        if let State::On { running, .. } = &self.state {
            running.ask_to_end();
        }
    }

    /// The last lines that it has written, while it runs.
    #[cfg(test)]
    pub(super) fn last_lines(&self) -> String {
        match &self.state {
            State::On { running, .. } => running.last_lines_so_far(),
            State::Off => String::new(),
        }
    }

    /// Waits for its end, and ends it if it takes too long.
    pub(super) fn end(&mut self) {
        self.state = State::Off;
    }
}

/// Whether a program of this machine accepts connections on a port.
fn accepts(port: u16) -> bool {
    let address = std::net::SocketAddr::from((std::net::Ipv4Addr::LOCALHOST, port));
    std::net::TcpStream::connect_timeout(&address, Duration::from_millis(200)).is_ok()
}
