//! A domain belongs to one worker at a time: in one that is shared, runs would hear each other.

#[cfg(target_os = "linux")]
use std::os::linux::net::SocketAddrExt as _;
#[cfg(target_os = "linux")]
use std::os::unix::net::{SocketAddr, UnixListener};

use sesame_relay::transport::TransportError;

/// A domain that no other runner on this machine uses meanwhile. It is free again when this is dropped, or when the
/// process ends, however it ends.
#[derive(Debug)]
pub(super) struct Domain {
    #[cfg(target_os = "linux")]
    _reserved: UnixListener,
}

impl Domain {
    /// Takes a domain; an error if another runner has it.
    #[cfg(target_os = "linux")]
    pub(super) fn take(domain: u16) -> Result<Self, TransportError> {
        // A name that no file has, so that nothing is left behind.
        let name = format!("sesame/ros2/domain/{domain}");
        let reserved = SocketAddr::from_abstract_name(name).and_then(|address| UnixListener::bind_addr(&address));
        match reserved {
            Ok(reserved) => Ok(Domain { _reserved: reserved }),
            Err(_) => Err(TransportError::Wiring(format!(
                "domain {domain} is used by another runner on this machine; wait until it has ended, or choose another \
                 `domain` (each worker uses the next one)"
            ))),
        }
    }

    /// Nothing is reserved here.
    #[cfg(not(target_os = "linux"))]
    pub(super) fn take(_: u16) -> Result<Self, TransportError> {
        Ok(Domain {})
    }
}
