//! What a program writes in addition to its protocol: the beginning of each test's part is logged, and the last lines
//! are kept.
//!
//! For a simulator that is its standard error; for a program in the background both its streams, as they come.

use std::collections::VecDeque;
use std::io::{self, Read, Write};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError, mpsc};
use std::thread;
use std::time::Duration;

/// How many bytes of a test are logged.
const LOGGED_BYTES: u64 = 1 << 20;

/// How many bytes and lines are kept for error messages.
const KEPT_BYTES: usize = 4096;
const KEPT_LINES: usize = 3;

/// How long it may take until all that an ended program has written is read. It takes longer than a moment if this
/// process is not given a turn, or if another one holds the stream that cannot be ended.
const READ_LIMIT: Duration = Duration::from_secs(10);

/// Reads what a program writes in threads and copies it to this process's own standard error, up to a limit for each
/// test.
pub(crate) struct OutputTail {
    captured: Arc<Mutex<Captured>>,
    end: mpsc::Receiver<()>,
}

/// What was written in this test.
#[derive(Default)]
struct Captured {
    /// Who writes, for the log.
    writer: String,
    /// The last lines, in the order in which they began. Two streams may write at once, in pieces: a line consists of
    /// what one stream wrote.
    lines: VecDeque<Line>,
    logged: u64,
    omitted: u64,
}

/// A line, or the end of a long one.
struct Line {
    stream: Stream,
    text: Vec<u8>,
    ended: bool,
}

/// One of the two streams of a program.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Stream {
    Output,
    Error,
}

/// Looks for a text in the lines that a program writes.
#[derive(Debug, Clone, Default)]
pub(crate) struct Watch {
    wanted: Option<Arc<str>>,
    seen: Arc<AtomicBool>,
}

impl Watch {
    /// One that looks for this text, if there is one.
    pub(crate) fn new(wanted: Option<&str>) -> Self {
        Watch { wanted: wanted.map(Arc::from), seen: Arc::default() }
    }

    /// Whether a line contained it.
    pub(crate) fn seen(&self) -> bool {
        self.seen.load(Ordering::Relaxed)
    }

    /// Looks at what one stream brought next. `before` is kept from call to call: the end of what it brought earlier,
    /// as much as the text may begin in.
    fn look(&self, before: &mut Vec<u8>, written: &[u8]) {
        let Some(wanted) = self.wanted.as_deref().filter(|_| !self.seen()) else { return };
        before.extend_from_slice(written);
        // The text has no end of a line, so what contains it is one line.
        if wanted.is_empty() || before.windows(wanted.len()).any(|window| window == wanted.as_bytes()) {
            self.seen.store(true, Ordering::Relaxed);
        }
        let kept = before.len().min(wanted.len().saturating_sub(1));
        before.drain(..before.len() - kept);
    }
}

impl OutputTail {
    /// Captures a stream whose writer has this name in the log.
    pub(crate) fn capture(from: impl Read + Send + 'static, writer: &str) -> Self {
        let (tail, sender) = OutputTail::of(writer);
        tail.read(Stream::Error, from, io::stderr(), Watch::default(), sender);
        tail
    }

    /// Captures both streams of a program.
    pub(crate) fn capture_both(
        output: impl Read + Send + 'static,
        error: impl Read + Send + 'static,
        writer: &str,
        watch: &Watch,
    ) -> Self {
        let (tail, sender) = OutputTail::of(writer);
        tail.read(Stream::Output, output, io::stderr(), watch.clone(), sender.clone());
        tail.read(Stream::Error, error, io::stderr(), watch.clone(), sender);
        tail
    }

    fn of(writer: &str) -> (Self, mpsc::Sender<()>) {
        let captured = Captured { writer: writer.to_owned(), ..Captured::default() };
        let (sender, end) = mpsc::channel();
        (OutputTail { captured: Arc::new(Mutex::new(captured)), end }, sender)
    }

    fn read(
        &self,
        stream: Stream,
        mut from: impl Read + Send + 'static,
        mut log: impl Write + Send + 'static,
        watch: Watch,
        sender: mpsc::Sender<()>,
    ) {
        let target = Arc::clone(&self.captured);
        thread::spawn(move || {
            // Dropped at the end of the stream, which is what the receiver waits for.
            let _sender: mpsc::Sender<()> = sender;
            let (mut buffer, mut before) = (vec![0; 1 << 14], Vec::new());
            loop {
                match from.read(&mut buffer) {
                    Ok(0) => return,
                    // The program must not block because the log cannot be written.
                    Ok(count) => {
                        lock(&target).append(stream, &buffer[..count], &mut log).ok();
                        watch.look(&mut before, &buffer[..count]);
                    }
                    Err(error) if error.kind() == io::ErrorKind::Interrupted => {}
                    Err(_) => return,
                }
            }
        });
    }

    /// A new test begins: forgets everything written so far.
    pub(crate) fn clear(&self) {
        lock(&self.captured).clear();
    }

    /// The last lines of a program that has ended.
    pub(crate) fn last_lines(&self) -> String {
        self.end.recv_timeout(READ_LIMIT).ok();
        self.last_lines_so_far()
    }

    /// The last lines of a program that is running.
    pub(crate) fn last_lines_so_far(&self) -> String {
        let captured = lock(&self.captured);
        let text = |line: &Line| String::from_utf8_lossy(&line.text).trim_end_matches('\r').to_owned();
        let lines: Vec<String> = captured.lines.iter().filter(|line| !line.is_blank()).map(text).collect();
        lines[lines.len().saturating_sub(KEPT_LINES)..].join("\n")
    }
}

impl Line {
    fn is_blank(&self) -> bool {
        self.text.trim_ascii().is_empty()
    }
}

impl Captured {
    fn append(&mut self, stream: Stream, written: &[u8], log: &mut impl Write) -> io::Result<()> {
        for piece in written.split_inclusive(|byte| *byte == b'\n') {
            self.keep(stream, piece);
        }
        let room = usize::try_from(LOGGED_BYTES - self.logged).unwrap_or(usize::MAX);
        let (logged, omitted) = written.split_at(written.len().min(room));
        self.logged += logged.len() as u64;
        log.write_all(logged)?;
        if self.omitted == 0 && !omitted.is_empty() {
            let limit = LOGGED_BYTES >> 20;
            writeln!(log, "\n[{} wrote more than {limit} MiB in this test; the rest is omitted]", self.writer)?;
        }
        self.omitted += omitted.len() as u64;
        Ok(())
    }

    /// Adds what one stream wrote of one line, and forgets the oldest lines.
    fn keep(&mut self, stream: Stream, piece: &[u8]) {
        let begun = self.lines.iter().position(|line| line.stream == stream && !line.ended);
        let at = begun.unwrap_or(self.lines.len());
        if begun.is_none() {
            self.lines.push_back(Line { stream, text: Vec::new(), ended: false });
        }
        let line = &mut self.lines[at];
        line.ended = piece.ends_with(b"\n");
        line.text.extend_from_slice(piece.strip_suffix(b"\n").unwrap_or(piece));
        if line.ended && line.is_blank() {
            self.lines.remove(at);
        }
        if self.lines.len() > KEPT_LINES {
            // A line that has not ended may still grow, so it is kept as well.
            let oldest = self.lines.iter().position(|line| line.ended).unwrap_or(0);
            self.lines.remove(oldest);
        }
        let mut over = self.lines.iter().map(|line| line.text.len()).sum::<usize>().saturating_sub(KEPT_BYTES);
        for line in &mut self.lines {
            let forgotten = over.min(line.text.len());
            line.text.drain(..forgotten);
            over -= forgotten;
        }
    }

    fn clear(&mut self) {
        *self = Captured { writer: std::mem::take(&mut self.writer), ..Captured::default() };
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
        let mut captured = Captured { writer: "the simulator".to_owned(), ..Captured::default() };
        let mut log = Vec::new();
        for written in tests {
            for part in written.chunks(1000) {
                captured.append(Stream::Error, part, &mut log).unwrap();
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
        let (tail, sender) = OutputTail::of("the simulator");
        tail.read(Stream::Error, io::Cursor::new(written), io::sink(), Watch::default(), sender);
        assert_eq!(tail.last_lines(), "one\ntwo\nthree");
        tail.clear();
        assert_eq!(tail.last_lines(), "");
    }

    #[test]
    fn a_line_consists_of_what_one_stream_wrote_however_the_pieces_of_both_come() {
        use Stream::{Error, Output};
        let last_lines = |pieces: &[(Stream, &str)]| {
            let (tail, _sender) = OutputTail::of("a program");
            for (stream, piece) in pieces {
                lock(&tail.captured).append(*stream, piece.as_bytes(), &mut io::sink()).unwrap();
            }
            tail.last_lines_so_far()
        };
        assert_eq!(last_lines(&[(Output, "up"), (Error, "out of memory\n"), (Output, "\n")]), "up\nout of memory");
        assert_eq!(last_lines(&[(Output, "up"), (Error, "out "), (Output, "\n\n"), (Error, "of")]), "up\nout of");
        assert_eq!(last_lines(&[(Output, "1\n2\n3\n"), (Error, "a"), (Output, "\r\n4\r\n"), (Error, "b")]), "3\nab\n4");
        // However much comes at once, what ends a line ends it.
        let much = format!("\n{}\nend\n", "x".repeat(KEPT_BYTES));
        assert_eq!(
            last_lines(&[(Output, "out\n"), (Error, "begun"), (Error, &much), (Error, "new")]).lines().last(),
            Some("new")
        );
        assert!(!last_lines(&[(Output, "out\n"), (Error, "begun"), (Error, &much)]).contains("begunx"));
        // A stream that never ends its line has one line, however much the other one writes.
        assert_eq!(last_lines(&[(Error, "50 %"), (Output, "1\n2\n3\n4\n"), (Error, "\r90 %")]), "50 %\r90 %\n3\n4");
    }

    #[test]
    fn a_text_is_found_in_a_line_that_comes_in_pieces_and_not_in_two_streams_together() {
        let watch = Watch::new(Some("is ready"));
        let (mut one, mut other) = (Vec::new(), Vec::new());
        watch.look(&mut one, b"the bridge is r");
        watch.look(&mut other, b"eady");
        watch.look(&mut one, b"unning\nis re");
        assert!(!watch.seen());
        watch.look(&mut one, b"ady");
        assert!(watch.seen());
        assert!(!Watch::new(None).seen());
    }
}
