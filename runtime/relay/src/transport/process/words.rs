//! What a simulator says on standard error: a part of it is logged, and its last words are kept.

use std::collections::VecDeque;
use std::io::{self, Read, Write};
use std::process::ChildStderr;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError, mpsc};
use std::thread;

use crate::transport::process::child::END_LIMIT;

/// How much of a test is logged, in bytes.
const LOGGED_BYTES: u64 = 1 << 20;

/// How much is kept for error messages, in bytes and in lines.
const KEPT_BYTES: usize = 4096;
const KEPT_LINES: usize = 3;

/// Listens to a simulator's standard error and writes it to this process's own, so much of each test as there is room.
pub(super) struct LastWords {
    heard: Arc<Mutex<Heard>>,
    end: mpsc::Receiver<()>,
}

/// What was heard in this test.
#[derive(Default)]
struct Heard {
    kept: VecDeque<u8>,
    logged: u64,
    left_out: u64,
}

impl LastWords {
    pub(super) fn listen(from: ChildStderr) -> Self {
        Self::listen_to(from, io::stderr())
    }

    fn listen_to(mut from: impl Read + Send + 'static, mut log: impl Write + Send + 'static) -> Self {
        let heard = Arc::new(Mutex::new(Heard::default()));
        let (sender, end) = mpsc::channel();
        let hear = Arc::clone(&heard);
        thread::spawn(move || {
            // Dropped at the end of the stream, which is what the receiver waits for.
            let _sender: mpsc::Sender<()> = sender;
            let mut buffer = vec![0; 1 << 14];
            loop {
                match from.read(&mut buffer) {
                    Ok(0) => return,
                    // A log that cannot be written is no reason to stop listening.
                    Ok(count) => {
                        lock(&hear).hear(&buffer[..count], &mut log).ok();
                    }
                    Err(error) if error.kind() == io::ErrorKind::Interrupted => {}
                    Err(_) => return,
                }
            }
        });
        LastWords { heard, end }
    }

    /// Forgets what was said so far: a new test begins.
    pub(super) fn forget(&self) {
        lock(&self.heard).forget();
    }

    /// The last lines, once the stream has ended; its process has.
    pub(super) fn take(&self) -> String {
        self.end.recv_timeout(END_LIMIT).ok();
        let bytes: Vec<u8> = lock(&self.heard).kept.iter().copied().collect();
        let text = String::from_utf8_lossy(&bytes);
        let lines: Vec<&str> = text.lines().filter(|line| !line.trim().is_empty()).collect();
        lines[lines.len().saturating_sub(KEPT_LINES)..].join("\n")
    }
}

impl Heard {
    fn hear(&mut self, said: &[u8], log: &mut impl Write) -> io::Result<()> {
        self.kept.extend(&said[said.len().saturating_sub(KEPT_BYTES)..]);
        let over = self.kept.len().saturating_sub(KEPT_BYTES);
        self.kept.drain(..over);
        let room = usize::try_from(LOGGED_BYTES - self.logged).unwrap_or(usize::MAX);
        let (logged, left_out) = said.split_at(said.len().min(room));
        self.logged += logged.len() as u64;
        log.write_all(logged)?;
        if self.left_out == 0 && !left_out.is_empty() {
            let limit = LOGGED_BYTES >> 20;
            writeln!(log, "\n[the simulator wrote more than {limit} MiB in this test; the rest of it is left out]")?;
        }
        self.left_out += left_out.len() as u64;
        Ok(())
    }

    fn forget(&mut self) {
        *self = Heard::default();
    }
}

/// A panic leaves nothing half done here.
fn lock<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// What is logged of these tests, each given as what was said in it.
    fn logged(tests: &[&[u8]]) -> Vec<u8> {
        let mut heard = Heard::default();
        let mut log = Vec::new();
        for said in tests {
            for part in said.chunks(1000) {
                heard.hear(part, &mut log).unwrap();
            }
            heard.forget();
        }
        log
    }

    #[test]
    fn a_test_that_floods_standard_error_fills_no_more_than_its_part_of_the_log_and_the_next_has_its_own() {
        let flood = vec![b'x'; 3 << 20];
        let log = logged(&[b"before\n", &flood, b"after\n"]);
        let room = usize::try_from(LOGGED_BYTES).unwrap();
        let (start, rest) = log.split_at("before\n".len() + room);
        assert!(start.ends_with(b"xxx"));
        assert_eq!(
            String::from_utf8_lossy(rest),
            "\n[the simulator wrote more than 1 MiB in this test; the rest of it is left out]\nafter\n"
        );
    }

    #[test]
    fn the_last_words_are_kept_also_of_a_flood() {
        let said = [vec![b'x'; 3 << 20], b"\none\ntwo\n\nthree\n".to_vec()].concat();
        let words = LastWords::listen_to(io::Cursor::new(said), io::sink());
        assert_eq!(words.take(), "one\ntwo\nthree");
        words.forget();
        assert_eq!(words.take(), "");
    }
}
