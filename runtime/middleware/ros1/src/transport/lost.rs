//! The loss of the master.

use sesame_relay::transport::TransportError;

use crate::master::Address;

/// That the master at this address was lost, and how that shows.
pub(super) fn lost(at: &Address, how: &str) -> TransportError {
    TransportError::ConnectionLost { to: format!("the master at `{at}`"), how: how.to_owned() }
}
