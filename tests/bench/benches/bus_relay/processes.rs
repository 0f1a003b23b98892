//! Servers and forwarders that are programs of their own.

use std::io::{BufRead as _, BufReader, Write as _};
use std::net::{Ipv4Addr, TcpListener, TcpStream};
use std::process::{Child, ChildStdout, Command, Stdio};
use std::time::{Duration, Instant};

/// A program that is ended when it is dropped.
pub(crate) struct Program {
    child: Child,
    output: BufReader<ChildStdout>,
}

impl Program {
    pub(crate) fn start(command: &mut Command) -> Program {
        let mut child = command
            .stdin(Stdio::piped())
            .stdout(Stdio::piped())
            .stderr(Stdio::null())
            .spawn()
            .unwrap_or_else(|error| panic!("{command:?} does not start: {error}"));
        let output = BufReader::new(child.stdout.take().expect("its output is a pipe"));
        Program { child, output }
    }

    /// Says a line to it.
    pub(crate) fn tell(&mut self, line: &str) {
        let input = self.child.stdin.as_mut().expect("its input is a pipe");
        writeln!(input, "{line}").and_then(|()| input.flush()).expect("it listens");
    }

    /// The next line that ends like this.
    pub(crate) fn says(&mut self, end: &str) -> String {
        let mut line = String::new();
        while !line.trim_end().ends_with(end) {
            line.clear();
            assert!(self.output.read_line(&mut line).expect("it speaks UTF-8") > 0, "it ended before `{end}`");
        }
        line
    }
}

impl Drop for Program {
    fn drop(&mut self) {
        // Some end when their input does, and end what they have started.
        drop(self.child.stdin.take());
        let limit = Instant::now() + Duration::from_secs(5);
        while Instant::now() < limit && matches!(self.child.try_wait(), Ok(None)) {
            std::thread::sleep(Duration::from_millis(20));
        }
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}

pub(crate) fn free_port() -> u16 {
    let listener = TcpListener::bind((Ipv4Addr::LOCALHOST, 0)).expect("there is a free port");
    listener.local_addr().expect("it has an address").port()
}

/// Waits until somebody listens.
pub(crate) fn listens(port: u16) {
    let limit = Instant::now() + Duration::from_secs(30);
    while TcpStream::connect((Ipv4Addr::LOCALHOST, port)).is_err() {
        assert!(Instant::now() < limit, "nobody listens at port {port}");
        std::thread::sleep(Duration::from_millis(50));
    }
}
