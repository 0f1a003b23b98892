//! What starting and ending a program have in common, whether a keeper or a worker does it.

use std::io;
use std::time::Duration;

/// How long a program whose input is closed may take to exit by itself.
pub(crate) const END_LIMIT: Duration = Duration::from_secs(1);

/// How long a program in the background, which is asked with `SIGTERM`, may take to exit by itself: it may have many
/// programs of its own to end.
pub(crate) const BACKGROUND_END_LIMIT: Duration = Duration::from_secs(3);

/// The exit status, by the convention of shells, in place of a program that cannot be started.
pub(crate) const NOT_FOUND: i32 = 127;

/// Why a program does not start, in words for the user.
pub(crate) fn reason(error: &io::Error) -> String {
    match error.kind() {
        io::ErrorKind::NotFound => "there is no such program; install it, or give its path".to_owned(),
        io::ErrorKind::PermissionDenied => format!("{error}; is it marked as executable?"),
        _ => error.to_string(),
    }
}
