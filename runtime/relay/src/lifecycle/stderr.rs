//! The standard error of a program: the beginning of each test's part is logged, and the last lines are kept.

use std::collections::VecDeque;
use std::io::{self, Read, Write};
use std::process::ChildStderr;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError, mpsc};
use std::thread;

use crate::lifecycle::limits::END_LIMIT;

/// How many bytes of a test are logged.
const LOGGED_BYTES: u64 = 1 << 20;

/// How many bytes and lines are kept for error messages.
const KEPT_BYTES: usize = 4096;
const KEPT_LINES: usize = 3;

/// Reads a program's standard error in a thread and copies it to this process's own, up to a limit for each test.
pub(super) struct StderrTail {
    captured: Arc<Mutex<Captured>>,
    end: mpsc::Receiver<()>,
}

/// What was written in this test.
#[derive(Default)]
struct Captured {
    tail: VecDeque<u8>,
    logged: u64,
    omitted: u64,
}

impl StderrTail {
    pub(super) fn capture(from: ChildStderr) -> Self {
        Self::capture_into(from, io::stderr())
    }

    fn capture_into(mut from: impl Read + Send + 'static, mut log: impl Write + Send + 'static) -> Self {
        let captured = Arc::new(Mutex::new(Captured::default()));
        let (sender, end) = mpsc::channel();
        let target = Arc::clone(&captured);
        thread::spawn(move || {
            // Dropped at the end of the stream, which is what the receiver waits for.
            let _sender: mpsc::Sender<()> = sender;
            let mut buffer = vec![0; 1 << 14];
            loop {
                match from.read(&mut buffer) {
                    Ok(0) => return,
                    // The program must not block because the log cannot be written.
                    Ok(count) => {
                        lock(&target).append(&buffer[..count], &mut log).ok();
                    }
                    Err(error) if error.kind() == io::ErrorKind::Interrupted => {}
                    Err(_) => return,
                }
            }
        });
        StderrTail { captured, end }
    }

    /// A new test begins: forgets everything written so far.
    pub(super) fn clear(&self) {
        lock(&self.captured).clear();
    }

    /// The last lines of a program that has ended.
    pub(super) fn last_lines(&self) -> String {
        self.end.recv_timeout(END_LIMIT).ok();
        let bytes: Vec<u8> = lock(&self.captured).tail.iter().copied().collect();
        let text = String::from_utf8_lossy(&bytes);
        let lines: Vec<&str> = text.lines().filter(|line| !line.trim().is_empty()).collect();
        lines[lines.len().saturating_sub(KEPT_LINES)..].join("\n")
    }
}

impl Captured {
    fn append(&mut self, written: &[u8], log: &mut impl Write) -> io::Result<()> {
        self.tail.extend(&written[written.len().saturating_sub(KEPT_BYTES)..]);
        let over = self.tail.len().saturating_sub(KEPT_BYTES);
        self.tail.drain(..over);
        let room = usize::try_from(LOGGED_BYTES - self.logged).unwrap_or(usize::MAX);
        let (logged, omitted) = written.split_at(written.len().min(room));
        self.logged += logged.len() as u64;
        log.write_all(logged)?;
        if self.omitted == 0 && !omitted.is_empty() {
            let limit = LOGGED_BYTES >> 20;
            writeln!(log, "\n[the simulator wrote more than {limit} MiB in this test; the rest is omitted]")?;
        }
        self.omitted += omitted.len() as u64;
        Ok(())
    }

    fn clear(&mut self) {
        *self = Captured::default();
    }
}

/// A panic leaves no partial change here.
fn lock<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// What is logged of these tests, each given as what it writes.
    fn logged(tests: &[&[u8]]) -> Vec<u8> {
        let mut captured = Captured::default();
        let mut log = Vec::new();
        for written in tests {
            for part in written.chunks(1000) {
                captured.append(part, &mut log).unwrap();
            }
            captured.clear();
        }
        log
    }

    #[test]
    fn a_test_that_floods_standard_error_has_only_its_share_of_the_log_and_the_next_test_has_its_own() {
        let flood = vec![b'x'; 3 << 20];
        let log = logged(&[b"before\n", &flood, b"after\n"]);
        let room = usize::try_from(LOGGED_BYTES).unwrap();
        let (start, rest) = log.split_at("before\n".len() + room);
        assert!(start.ends_with(b"xxx"));
        assert_eq!(
            String::from_utf8_lossy(rest),
            "\n[the simulator wrote more than 1 MiB in this test; the rest is omitted]\nafter\n"
        );
    }

    #[test]
    fn the_last_lines_of_a_flood_are_kept() {
        let written = [vec![b'x'; 3 << 20], b"\none\ntwo\n\nthree\n".to_vec()].concat();
        let tail = StderrTail::capture_into(io::Cursor::new(written), io::sink());
        assert_eq!(tail.last_lines(), "one\ntwo\nthree");
        tail.clear();
        assert_eq!(tail.last_lines(), "");
    }
}
