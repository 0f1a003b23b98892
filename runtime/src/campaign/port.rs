//! A port on the loopback interface, for systems where a worker cannot inherit its connection.
//!
//! Any user of the machine can connect to it, so what comes before the token is not trusted: connections are listened to
//! side by side, so that a silent one holds up none of the others; each may say a kilobyte; and there is one deadline for
//! all of them together. A program that does not know the token can delay a worker by no more than that.

use std::collections::VecDeque;
use std::net::{Ipv4Addr, SocketAddr, TcpListener, TcpStream};
use std::time::{Duration, Instant};
use std::{io, thread};

use crate::campaign::protocol::{self, Greeting, Hello};

/// How many connections are listened to at the same time. With one more, the oldest is closed: a worker says all it has
/// to say as soon as it is connected.
const MOST_STRANGERS: usize = 64;

/// A port that waits for one worker.
pub(super) struct Port {
    listener: TcpListener,
    token: String,
}

/// A connection that has not said the token yet.
struct Stranger {
    stream: TcpStream,
    greeting: Greeting,
}

impl Port {
    /// Opens a port that the system chooses, with a fresh token.
    pub(super) fn open() -> io::Result<Port> {
        let listener = TcpListener::bind((Ipv4Addr::LOCALHOST, 0))?;
        listener.set_nonblocking(true)?;
        Ok(Port { listener, token: token()? })
    }

    /// Where it is.
    pub(super) fn address(&self) -> io::Result<SocketAddr> {
        self.listener.local_addr()
    }

    /// What the worker has to say first.
    pub(super) fn token(&self) -> &str {
        &self.token
    }

    /// Waits for the connection that says the token. `alive` is asked again and again; its error ends the wait.
    pub(super) fn accept(self, limit: Duration, alive: &mut dyn FnMut() -> io::Result<()>) -> io::Result<TcpStream> {
        let mut strangers: VecDeque<Stranger> = VecDeque::new();
        let started = Instant::now();
        while started.elapsed() < limit {
            alive()?;
            // No more at a time than are listened to: each gets its turn before it may be closed.
            for _ in 0..MOST_STRANGERS {
                match self.listener.accept() {
                    Ok((stream, _)) => {
                        stream.set_nonblocking(true)?;
                        strangers.push_back(Stranger { stream, greeting: Greeting::default() });
                    }
                    Err(error) if error.kind() == io::ErrorKind::WouldBlock => break,
                    // One that went away before it was looked at says nothing of the others.
                    Err(error) if is_of_one_connection(&error) => {}
                    Err(error) => return Err(error),
                }
            }
            for mut stranger in std::mem::take(&mut strangers) {
                match stranger.greeting.hear(&mut stranger.stream) {
                    Ok(None) => strangers.push_back(stranger),
                    Ok(Some(Hello { token })) if token.as_ref() == Some(&self.token) => {
                        stranger.stream.set_nonblocking(false)?;
                        stranger.stream.set_nodelay(true)?;
                        return Ok(stranger.stream);
                    }
                    Ok(Some(_)) | Err(_) => {}
                }
            }
            strangers.drain(..strangers.len().saturating_sub(MOST_STRANGERS));
            thread::sleep(Duration::from_millis(2));
        }
        Err(protocol::not_reported(limit))
    }
}

/// Connects to a port and says its token.
pub(super) fn connect(port: SocketAddr, token: String) -> io::Result<TcpStream> {
    let mut stream = TcpStream::connect(port)?;
    stream.set_nodelay(true)?;
    protocol::send(&mut stream, &Hello { token: Some(token) })?;
    Ok(stream)
}

fn is_of_one_connection(error: &io::Error) -> bool {
    matches!(
        error.kind(),
        io::ErrorKind::ConnectionAborted | io::ErrorKind::ConnectionReset | io::ErrorKind::Interrupted
    )
}

fn token() -> io::Result<String> {
    let random = || getrandom::u64().map_err(|error| io::Error::other(error.to_string()));
    Ok(format!("{:016x}{:016x}", random()?, random()?))
}

#[cfg(test)]
mod tests;
