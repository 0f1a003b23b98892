//! Wall time, by which it is waited for other processes.

use std::time::{Duration, Instant};

/// How long a peer that is matched on this side may need to match us. So long nobody may appear before the system
/// counts as complete.
pub(super) const SETTLE: Duration = Duration::from_millis(300);

#[expect(clippy::disallowed_methods, reason = "an adapter: it waits for other processes")]
pub(super) fn now() -> Instant {
    Instant::now()
}
