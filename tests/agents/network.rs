//! Machines with networks of their own: namespaces of Linux, joined by a bridge in a further one.

use std::process::{Command, Stdio};

/// A bridge, and machines at it. Dropping this removes them.
pub(crate) struct Network {
    name: String,
    machines: Vec<String>,
}

impl Network {
    /// Machines of these names at the addresses [`Network::address`]. Without the right to make them the test is to be
    /// skipped, which is printed here; with `CI=true` that is an error.
    pub(crate) fn of(machines: &[&str]) -> Option<Self> {
        sesame_peers::installed(&["nsenter"], &["--version"])?;
        sesame_peers::permitted("namespaces of networks", Command::new("unshare").args(["--net", "true"]))?;
        let mut network = Network { name: format!("sesame{}", std::process::id()), machines: Vec::new() };
        let switch = network.namespace("switch");
        Network::ip(&["netns", "add", &switch]);
        Network::ip(&["-n", &switch, "link", "add", "bridge", "type", "bridge"]);
        Network::ip(&["-n", &switch, "link", "set", "bridge", "up"]);
        for (at, machine) in machines.iter().enumerate() {
            let own = network.namespace(machine);
            let port = format!("port{at}");
            Network::ip(&["netns", "add", &own]);
            network.machines.push((*machine).to_owned());
            Network::ip(&["-n", &own, "link", "set", "lo", "up"]);
            Network::ip(&[
                "link", "add", &port, "netns", &switch, "type", "veth", "peer", "name", "eth0", "netns", &own,
            ]);
            Network::ip(&["-n", &switch, "link", "set", &port, "master", "bridge", "up"]);
            let address = format!("{}/24", network.address(machine));
            Network::ip(&["-n", &own, "addr", "add", &address, "dev", "eth0"]);
            Network::ip(&["-n", &own, "link", "set", "eth0", "up"]);
        }
        Some(network)
    }

    fn namespace(&self, machine: &str) -> String {
        format!("{}-{machine}", self.name)
    }

    fn ip(arguments: &[&str]) {
        let said = Command::new("ip").args(arguments).output().expect("`ip` starts");
        assert!(said.status.success(), "ip {arguments:?}: {}", String::from_utf8_lossy(&said.stderr));
    }

    fn position(&self, machine: &str) -> usize {
        self.machines.iter().position(|known| known == machine).expect("the machine is one of the network's")
    }

    /// The address of a machine.
    pub(crate) fn address(&self, machine: &str) -> String {
        format!("10.77.0.{}", self.position(machine) + 1)
    }

    /// The same command, on a machine. What is killed is the program itself.
    pub(crate) fn on(&self, machine: &str, command: &Command) -> Command {
        let mut within = Command::new("nsenter");
        within.arg(format!("--net=/run/netns/{}", self.namespace(machine)));
        within.arg(command.get_program()).args(command.get_args());
        for (name, value) in command.get_envs() {
            match value {
                Some(value) => within.env(name, value),
                None => within.env_remove(name),
            };
        }
        if let Some(folder) = command.get_current_dir() {
            within.current_dir(folder);
        }
        within.stdin(Stdio::null());
        within
    }

    /// Cuts the cable of a machine, or joins it again.
    pub(crate) fn set_connected(&self, machine: &str, connected: bool) {
        let port = format!("port{}", self.position(machine));
        let switch = self.namespace("switch");
        Network::ip(&["-n", &switch, "link", "set", &port, if connected { "up" } else { "down" }]);
    }
}

impl Network {
    /// Kills everything on a machine, as if it had lost its power.
    pub(crate) fn kill_all_on(&self, machine: &str) {
        let said = Command::new("ip").args(["netns", "pids", &self.namespace(machine)]).output().expect("`ip` starts");
        for id in String::from_utf8_lossy(&said.stdout).split_whitespace() {
            // It may have ended by itself.
            Command::new("kill").args(["-9", id]).status().ok();
        }
    }
}

impl Drop for Network {
    fn drop(&mut self) {
        for machine in self.machines.iter().map(String::as_str).chain(["switch"]) {
            Command::new("ip").args(["netns", "del", &self.namespace(machine)]).status().ok();
        }
    }
}
