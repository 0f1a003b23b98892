//! Wall time, by which it is waited for other processes.

use std::time::Instant;

#[expect(clippy::disallowed_methods, reason = "an adapter: it waits for other processes")]
pub(super) fn now() -> Instant {
    Instant::now()
}
