//! A TCP port of this machine that no other worker uses.

use std::io;
use std::net::{Ipv4Addr, TcpListener};

/// The ports that workers use: below those that systems give to outgoing connections.
const FIRST: u16 = 20_000;
const LAST: u16 = 29_999;

/// From one worker's port to the next: some programs also use the ports after the one they are given.
const STRIDE: u16 = 10;

/// A port that is reserved as long as this exists.
///
/// On Linux the reservation is a socket with a name without a file, which only one process of the machine can have and
/// which the system takes back when that process ends, however it ends; so all runners of the machine agree. The port
/// itself stays free for the program. Elsewhere it is only checked to be free.
#[derive(Debug)]
pub(super) struct Port {
    number: u16,
    #[cfg(target_os = "linux")]
    _reservation: std::os::unix::net::UnixListener,
}

impl Port {
    /// Reserves a port that is free now: the first for the first worker, if no other runner has it.
    pub(super) fn reserve(worker: u32) -> io::Result<Port> {
        let ports: Vec<u16> = (FIRST..=LAST).step_by(usize::from(STRIDE)).collect();
        let first = usize::try_from(worker.saturating_sub(1)).unwrap_or(0) % ports.len();
        let (before, from) = ports.split_at(first);
        for &number in from.iter().chain(before) {
            let Some(port) = Port::reserved(number) else { continue };
            if TcpListener::bind((Ipv4Addr::UNSPECIFIED, number)).is_ok() {
                return Ok(port);
            }
        }
        Err(io::Error::new(io::ErrorKind::AddrInUse, format!("all ports from {FIRST} to {LAST} are in use")))
    }

    pub(super) fn number(&self) -> u16 {
        self.number
    }

    #[cfg(target_os = "linux")]
    fn reserved(number: u16) -> Option<Port> {
        use std::os::linux::net::SocketAddrExt as _;
        use std::os::unix::net::{SocketAddr, UnixListener};

        let name = SocketAddr::from_abstract_name(format!("sesame-port-{number}")).ok()?;
        Some(Port { number, _reservation: UnixListener::bind_addr(&name).ok()? })
    }

    #[cfg(not(target_os = "linux"))]
    fn reserved(number: u16) -> Option<Port> {
        Some(Port { number })
    }
}

#[cfg(all(test, target_os = "linux"))]
mod tests {
    use super::*;

    #[test]
    fn two_workers_never_have_the_same_port_and_one_in_use_is_passed_over() {
        let one = Port::reserve(500).unwrap();
        let other = Port::reserve(500).unwrap();
        assert_ne!(one.number(), other.number());
        let used = TcpListener::bind((Ipv4Addr::LOCALHOST, one.number())).unwrap();
        let number = one.number();
        drop(one);
        let third = Port::reserve(500).unwrap();
        assert_ne!(third.number(), number, "another program listens there");
        drop(used);
    }
}
