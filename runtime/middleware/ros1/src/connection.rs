//! Connections over TCP that end when they are told to: a read or a write looks every 50 ms whether it may go on.

use std::io::{self, ErrorKind, Read as _, Write as _};
use std::net::{TcpStream, ToSocketAddrs as _};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

/// How often it is looked whether to stop.
pub(crate) const LOOK: Duration = Duration::from_millis(50);

/// How many bytes are made room for at first, whatever length was announced.
const ROOM: usize = 64 << 10;

/// Whether to stop.
#[derive(Debug, Clone, Default)]
pub(crate) struct Stop(Arc<AtomicBool>);

impl Stop {
    pub(crate) fn set(&self) {
        self.0.store(true, Ordering::Relaxed);
    }

    pub(crate) fn is_set(&self) -> bool {
        self.0.load(Ordering::Relaxed)
    }
}

/// A connection.
#[derive(Debug)]
pub(crate) struct Connection {
    stream: TcpStream,
    stop: Stop,
}

impl Connection {
    /// Connects to a host; an address that does not answer is given up after this long.
    pub(crate) fn to(host: &str, port: u16, within: Duration, stop: &Stop) -> io::Result<Self> {
        let mut last = io::Error::new(ErrorKind::NotFound, format!("`{host}` has no address"));
        for address in (host, port).to_socket_addrs()? {
            match TcpStream::connect_timeout(&address, within) {
                Ok(stream) => return Connection::new(stream, stop),
                Err(error) => last = error,
            }
        }
        Err(last)
    }

    pub(crate) fn new(stream: TcpStream, stop: &Stop) -> io::Result<Self> {
        // Small messages are not held back to be sent together.
        stream.set_nodelay(true)?;
        stream.set_read_timeout(Some(LOOK))?;
        stream.set_write_timeout(Some(LOOK))?;
        Ok(Connection { stream, stop: stop.clone() })
    }

    /// Reads what has come, at most so many bytes, to the end of a buffer; false at the end of the connection.
    pub(crate) fn read_some(&mut self, buffer: &mut Vec<u8>, most: usize, deadline: Instant) -> io::Result<bool> {
        let start = buffer.len();
        buffer.resize(start + most.min(ROOM), 0);
        let read = self.patient(Some(deadline), |stream| stream.read(&mut buffer[start..]));
        buffer.truncate(start + *read.as_ref().unwrap_or(&0));
        read.map(|read| read > 0)
    }

    /// Reads exactly so many bytes.
    pub(crate) fn read_exact(&mut self, bytes: &mut [u8], deadline: Option<Instant>) -> io::Result<()> {
        let mut at = 0;
        while at < bytes.len() {
            match self.patient(deadline, |stream| stream.read(&mut bytes[at..]))? {
                0 => return Err(ErrorKind::UnexpectedEof.into()),
                read => at += read,
            }
        }
        Ok(())
    }

    /// Reads a length and as many bytes, at most so many. Memory is taken as bytes come in.
    pub(crate) fn read_frame(&mut self, most: usize, deadline: Option<Instant>) -> io::Result<Vec<u8>> {
        let mut length = [0; 4];
        self.read_exact(&mut length, deadline)?;
        let length = u32::from_le_bytes(length) as usize;
        if length > most {
            return Err(io::Error::new(ErrorKind::InvalidData, format!("{length} bytes are more than {most}")));
        }
        let mut bytes = Vec::new();
        while bytes.len() < length {
            let start = bytes.len();
            bytes.resize(length.min(start + start.max(ROOM)), 0);
            self.read_exact(&mut bytes[start..], deadline)?;
        }
        Ok(bytes)
    }

    /// Reads a length and throws away as many bytes; whatever length was announced, it ends at the deadline.
    pub(crate) fn skip_frame(&mut self, deadline: Instant) -> io::Result<()> {
        let mut length = [0; 4];
        self.read_exact(&mut length, Some(deadline))?;
        let (mut left, mut bytes) = (u32::from_le_bytes(length) as usize, [0; 4096]);
        while left > 0 {
            if Instant::now() >= deadline {
                return Err(ErrorKind::TimedOut.into());
            }
            let some = left.min(bytes.len());
            self.read_exact(&mut bytes[..some], Some(deadline))?;
            left -= some;
        }
        Ok(())
    }

    pub(crate) fn write_all(&mut self, mut bytes: &[u8], deadline: Option<Instant>) -> io::Result<()> {
        while !bytes.is_empty() {
            match self.patient(deadline, |stream| stream.write(bytes))? {
                0 => return Err(ErrorKind::WriteZero.into()),
                written => bytes = &bytes[written..],
            }
        }
        Ok(())
    }

    /// Writes a length and the bytes.
    pub(crate) fn write_frame(&mut self, bytes: &[u8], deadline: Option<Instant>) -> io::Result<()> {
        let length = crate::protocol::header::length(bytes.len());
        if bytes.len() > ROOM {
            self.write_all(&length, deadline)?;
            return self.write_all(bytes, deadline);
        }
        self.write_all(&[&length, bytes].concat(), deadline)
    }

    /// Whether the other end has closed it, which is asked where nothing is to be read. It takes no time.
    pub(crate) fn is_closed(&self) -> bool {
        if self.stream.set_nonblocking(true).is_err() {
            return true;
        }
        let peeked = self.stream.peek(&mut [0]);
        let restored = self.stream.set_nonblocking(false);
        match peeked {
            Ok(0) => true,
            Ok(_) => restored.is_err(),
            Err(error) => error.kind() != ErrorKind::WouldBlock || restored.is_err(),
        }
    }

    /// Does something with the stream until it is done, the time is up, or it is to stop.
    fn patient<T>(
        &mut self,
        deadline: Option<Instant>,
        mut act: impl FnMut(&mut TcpStream) -> io::Result<T>,
    ) -> io::Result<T> {
        loop {
            if self.stop.is_set() {
                return Err(ErrorKind::ConnectionAborted.into());
            }
            match act(&mut self.stream) {
                Err(error)
                    if matches!(error.kind(), ErrorKind::WouldBlock | ErrorKind::TimedOut | ErrorKind::Interrupted) =>
                {
                    if deadline.is_some_and(|deadline| Instant::now() >= deadline) {
                        return Err(ErrorKind::TimedOut.into());
                    }
                }
                done => return done,
            }
        }
    }
}
