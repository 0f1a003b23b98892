//! Ports in which tests do not hear each other.

use std::fmt;
use std::net::{Ipv4Addr, TcpListener, UdpSocket};
use std::ops::RangeInclusive;
use std::os::fd::OwnedFd;

/// The ports of servers of TCP, and those of servers of UDP. They lie below the ports that the system assigns itself,
/// so nobody takes a port before its server does, or while the server is restarted. No example names one of them, so
/// the ports of an example can be replaced one after the other.
const OF_TCP: RangeInclusive<u16> = 10_000..=12_499;
const OF_UDP: RangeInclusive<u16> = 12_500..=14_499;

/// A port for a server that no other test on this machine uses meanwhile.
#[derive(Debug)]
pub struct Port {
    number: u16,
    /// The port of the same number of the other kind, which no server uses. A search for a free port binds that one
    /// first, so no search binds a port, not even for a moment, whose server is about to start.
    _held: OwnedFd,
}

impl Port {
    /// A port for a server of TCP.
    pub fn free() -> Self {
        Port::first_of(OF_TCP, |number| {
            let held = UdpSocket::bind((Ipv4Addr::LOCALHOST, number)).ok()?;
            TcpListener::bind((Ipv4Addr::LOCALHOST, number)).ok()?;
            Some(held.into())
        })
    }

    /// A port for a server of UDP.
    pub fn free_of_udp() -> Self {
        Port::first_of(OF_UDP, |number| {
            let held = TcpListener::bind((Ipv4Addr::LOCALHOST, number)).ok()?;
            UdpSocket::bind((Ipv4Addr::LOCALHOST, number)).ok()?;
            Some(held.into())
        })
    }

    fn first_of(all: RangeInclusive<u16>, hold: fn(u16) -> Option<OwnedFd>) -> Self {
        let free = from_own_place(all).into_iter().find_map(|number| Some(Port { number, _held: hold(number)? }));
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
pub fn from_own_place(all: RangeInclusive<u16>) -> Vec<u16> {
    let mut all: Vec<u16> = all.collect();
    let own = std::process::id() as usize % all.len();
    all.rotate_left(own);
    all
}
