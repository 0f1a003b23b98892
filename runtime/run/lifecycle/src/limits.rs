//! What starting and ending a program have in common, whether a keeper or a worker does it.

use std::io;
use std::time::Duration;

/// How long a program may take to exit by itself once its input is closed, or, in the background, once it is asked with
/// `SIGTERM`: it may have many programs of its own to end, on a machine that does much else. One that hangs delays the
/// next test by as much.
pub(crate) const END_LIMIT: Duration = Duration::from_secs(5);

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
