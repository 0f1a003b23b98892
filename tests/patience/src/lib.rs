//! How tests wait: for something they can see, with a limit that only a hang reaches.
//!
//! A test that sleeps for as long as something usually takes fails on a machine that is busy, and wastes time on one
//! that is not. Here a condition is asked again and again until it holds. The limit is so generous that a machine ten
//! times as slow does not reach it, and it is below the one at which nextest ends a test, so that a test that hangs
//! says what it waited for.

use std::fmt::Display;
use std::sync::mpsc::{RecvTimeoutError, Sender, channel};
use std::thread::sleep;
use std::time::{Duration, Instant};

/// How long something may take until it counts as a hang.
pub const LIMIT: Duration = Duration::from_secs(120);

/// How long it is waited between two questions.
const PAUSE: Duration = Duration::from_millis(5);

/// Waits until a condition holds. If it never does, the test fails and says that `what` was awaited.
#[track_caller]
pub fn until(what: impl Display, holds: impl FnMut() -> bool) {
    let came = comes(holds);
    assert!(came, "{}", in_vain(&what, LIMIT));
}

/// Waits until there is something to be seen, and returns it. If there never is, the test fails and says that `what`
/// was awaited.
#[track_caller]
pub fn until_some<T>(what: impl Display, mut look: impl FnMut() -> Option<T>) -> T {
    let mut seen = None;
    until(what, || {
        seen = look();
        seen.is_some()
    });
    seen.expect("it was seen")
}

/// Waits until a condition holds; false if it never does. For tests that clean up before they fail, or that show more
/// of what they see.
#[must_use]
pub fn comes(holds: impl FnMut() -> bool) -> bool {
    within(LIMIT, holds)
}

/// Watches a test whose own code may hang, where no condition can be asked any more. If the test neither says that it
/// goes on nor drops the watch within the limit, the watch names what hangs and aborts the test's process.
#[derive(Debug)]
pub struct Watch(Sender<()>);

impl Watch {
    /// Watches from now on.
    #[must_use]
    pub fn over(what: impl Display) -> Watch {
        Watch::within(what.to_string(), 2 * LIMIT)
    }

    fn within(what: String, limit: Duration) -> Watch {
        let (signs, seen) = channel();
        std::thread::spawn(move || {
            let end = std::iter::repeat_with(|| seen.recv_timeout(limit)).find_map(Result::err);
            if end == Some(RecvTimeoutError::Timeout) {
                eprintln!("{what} hangs: it has not gone on for {limit:?}");
                std::process::abort();
            }
        });
        Watch(signs)
    }

    /// The test goes on.
    pub fn goes_on(&self) {
        // The other end stays until this one is dropped.
        let _ = self.0.send(());
    }
}

fn within(limit: Duration, mut holds: impl FnMut() -> bool) -> bool {
    let started = Instant::now();
    loop {
        // The time is taken first: a test that was not scheduled for long asks once more before it gives up.
        let late = started.elapsed() >= limit;
        if holds() {
            return true;
        }
        if late {
            return false;
        }
        sleep(PAUSE);
    }
}

fn in_vain(what: &dyn Display, limit: Duration) -> String {
    format!("{what}: awaited for {} s in vain", limit.as_secs())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_condition_is_asked_until_it_holds() {
        let mut asked = 0;
        until("the third question", || {
            asked += 1;
            asked == 3
        });
        assert_eq!(asked, 3);
    }

    #[test]
    fn what_is_seen_at_last_is_returned() {
        let mut left = vec![Some("door"), None, None];
        assert_eq!(until_some("the door", || left.pop().flatten()), "door");
    }

    /// Set in a process whose test is to hang.
    const HANGS: &str = "SESAME_PATIENCE_HANGS";

    #[test]
    fn a_test_whose_own_code_hangs_is_ended_and_what_hangs_is_named() {
        if std::env::var_os(HANGS).is_some() {
            let watch = Watch::within("the door".to_owned(), Duration::from_millis(100));
            watch.goes_on();
            sleep(LIMIT);
            return drop(watch);
        }
        let name = "tests::a_test_whose_own_code_hangs_is_ended_and_what_hangs_is_named";
        let program = std::env::current_exe().expect("a test has a program");
        let hung = std::process::Command::new(program).args(["--exact", name, "--nocapture"]).env(HANGS, "1").output();
        let hung = hung.expect("the program starts");
        assert!(!hung.status.success());
        let said = String::from_utf8_lossy(&hung.stderr).into_owned();
        assert!(said.contains("the door hangs: it has not gone on for 100ms"), "{said}");
    }

    #[test]
    fn what_never_comes_is_given_up_at_the_limit_and_named() {
        let mut asked = 0;
        assert!(!within(Duration::ZERO, || {
            asked += 1;
            false
        }));
        assert_eq!(asked, 1, "it is asked at least once");
        assert_eq!(in_vain(&"the door opens", LIMIT), "the door opens: awaited for 120 s in vain");
    }
}
