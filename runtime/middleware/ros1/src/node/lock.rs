//! A lock that is taken also after a thread has panicked.

use std::sync::{Mutex, MutexGuard, PoisonError};

/// What a thread that panicked left is used all the same: each change is complete in itself.
pub(super) fn lock<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}
