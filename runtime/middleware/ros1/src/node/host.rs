//! Under which name a node is reached, and where it listens.

use std::net::{IpAddr, Ipv4Addr, ToSocketAddrs as _};

/// The address of a node.
pub(super) struct Host {
    /// The name by which others reach it.
    pub(super) name: String,
    /// The address of this machine that it binds.
    pub(super) bind: IpAddr,
}

/// As ROS has it: `ROS_HOSTNAME`, or else `ROS_IP`; but without both, a node is reached from this machine only.
pub(super) fn host() -> Result<Host, String> {
    let variables = ["ROS_HOSTNAME", "ROS_IP"];
    let set =
        variables.map(|name| std::env::var(name).ok().filter(|value| !value.is_empty()).map(|value| (name, value)));
    named(set.into_iter().flatten().next())
}

fn named(variable: Option<(&str, String)>) -> Result<Host, String> {
    let Some((variable, name)) = variable else {
        return Ok(Host { name: Ipv4Addr::LOCALHOST.to_string(), bind: Ipv4Addr::LOCALHOST.into() });
    };
    let problem = |problem: &str| format!("{variable} is `{name}`, {problem}; name an address of this machine in it");
    let addresses = (name.as_str(), 0).to_socket_addrs().map_err(|error| problem(&error.to_string()))?;
    let addresses: Vec<IpAddr> = addresses.map(|address| address.ip()).collect();
    let first = addresses.iter().find(|address| address.is_ipv4()).or(addresses.first());
    let bind = *first.ok_or_else(|| problem("which has no address"))?;
    Ok(Host { name, bind })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_this_machine_is_listened_to_unless_another_address_is_named() {
        let shown = |variable| named(variable).map(|host| format!("{} {}", host.name, host.bind));
        assert_eq!(shown(None), Ok("127.0.0.1 127.0.0.1".to_owned()));
        assert_eq!(shown(Some(("ROS_IP", "10.0.0.7".to_owned()))), Ok("10.0.0.7 10.0.0.7".to_owned()));
        assert_eq!(shown(Some(("ROS_HOSTNAME", "localhost".to_owned()))), Ok("localhost 127.0.0.1".to_owned()));
        let error = shown(Some(("ROS_IP", "no address".to_owned()))).unwrap_err();
        assert!(error.starts_with("ROS_IP is `no address`, "), "{error}");
    }
}
