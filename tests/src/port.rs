//! Ports in which tests do not hear each other.

use std::fmt;
use std::net::{Ipv4Addr, TcpListener, UdpSocket};

/// A port for a server that no other test on this machine uses meanwhile.
#[derive(Debug)]
pub struct Port {
    number: u16,
    /// Reserves the port: each test binds the port of the same number of the other kind, UDP or TCP, which no server
    /// uses.
    _held: (Option<UdpSocket>, Option<TcpListener>),
}

impl Port {
    /// A port that nobody listens on. The range lies below the ports that the system assigns by itself, so nobody takes
    /// the port before the server does, or while the server is restarted.
    pub fn free() -> Self {
        Port::where_both_are(|udp, _| (Some(udp), None))
    }

    /// The same for a server of UDP.
    pub fn free_of_udp() -> Self {
        Port::where_both_are(|_, tcp| (None, Some(tcp)))
    }

    fn where_both_are(held: fn(UdpSocket, TcpListener) -> (Option<UdpSocket>, Option<TcpListener>)) -> Self {
        let free = from_own_place(10_000..=14_999).into_iter().find_map(|number| {
            let udp = UdpSocket::bind((Ipv4Addr::LOCALHOST, number)).ok()?;
            let tcp = TcpListener::bind((Ipv4Addr::LOCALHOST, number)).ok()?;
            Some(Port { number, _held: held(udp, tcp) })
        });
        free.expect("so many ports are enough for the tests of one machine")
    }

    /// Its number.
    pub fn number(&self) -> u16 {
        self.number
    }
}

impl fmt::Display for Port {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.number.fmt(f)
    }
}

/// All of these numbers. Each process starts at another one, since a late message may still be on its way to a number
/// that was just in use.
pub fn from_own_place(all: std::ops::RangeInclusive<u16>) -> Vec<u16> {
    let mut all: Vec<u16> = all.collect();
    let own = std::process::id() as usize % all.len();
    all.rotate_left(own);
    all
}
