//! Runs that go on for as long as a test wants.

use std::time::{Duration, Instant};

use sesame_base::time::SimTime;
use sesame_relay::relay::Exchange;
use sesame_relay::transport::{Transport, TransportError};

/// For how long a run is relayed before the test looks again.
const MOMENT: Duration = Duration::from_millis(5);

/// Relays for a moment of real time.
///
/// The run itself ends later than any test. A transport notes no time past the end that it is given. With an end only
/// a moment away, a message that arrives while this process waits for its turn would be noted before it arrived.
pub fn relay_for_a_moment(transport: &mut dyn Transport, relay: &mut dyn Exchange) -> Result<(), TransportError> {
    let begun = Instant::now();
    loop {
        transport.advance(SimTime::from_seconds(86_400.0), relay)?;
        if begun.elapsed() >= MOMENT {
            return Ok(());
        }
    }
}
