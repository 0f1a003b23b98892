//! The message and place of the last panic: `catch_unwind` alone does not give the place.

#![expect(clippy::disallowed_methods, reason = "an adapter: it prints panics as they happen")]

use std::sync::Mutex;

static LAST: Mutex<Option<String>> = Mutex::new(None);

/// From now on, prints every panic and keeps its message. For a process of our own, such as a worker.
pub fn install() {
    std::panic::set_hook(Box::new(|panic| {
        // A log that cannot be written must not turn a panic into an abort.
        std::io::Write::write_all(&mut std::io::stderr(), format!("{panic}\n").as_bytes()).ok();
        if let Ok(mut last) = LAST.lock() {
            *last = Some(panic.to_string());
        }
    }));
}

/// Ends a run by a panic with this message, which names no place in this program: for code of the user's in another
/// language.
pub fn raise(message: String) -> ! {
    if let Ok(mut last) = LAST.lock() {
        *last = Some(message.clone());
    }
    // Without the hook, which would print a place.
    std::panic::resume_unwind(Box::new(message))
}

/// The message of the last panic since the last call.
pub fn take() -> String {
    let message = LAST.lock().ok().and_then(|mut last| last.take());
    message.unwrap_or_else(|| "a panic without a message".to_owned())
}
