//! The words of the last panic, with its place: `catch_unwind` alone does not tell where it was.

use std::sync::Mutex;

static LAST: Mutex<Option<String>> = Mutex::new(None);

/// Keeps the words of every panic from now on, and prints them. For a process of our own, such as a worker.
pub fn listen() {
    std::panic::set_hook(Box::new(|panic| {
        // A log that cannot be written must not turn a panic into an abort.
        std::io::Write::write_all(&mut std::io::stderr(), format!("{panic}\n").as_bytes()).ok();
        if let Ok(mut last) = LAST.lock() {
            *last = Some(panic.to_string());
        }
    }));
}

/// The words of the last panic since they were last taken.
pub fn take() -> String {
    let words = LAST.lock().ok().and_then(|mut last| last.take());
    words.unwrap_or_else(|| "a panic without words".to_owned())
}
