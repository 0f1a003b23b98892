//! How supervisor and worker are connected.
//!
//! On Unix a worker inherits one end of a pair of sockets as its standard input. The pair has no name and no address,
//! so nobody else can connect to it. Other systems have nothing like it in the standard library: there the worker
//! connects to a [`port`](super::port) and proves with a token that it is the one that was started.

use std::io;
use std::process::Command;
use std::time::Duration;

pub use self::system::Address;
#[cfg(target_os = "linux")]
pub(super) use self::system::pair;
pub(super) use self::system::{Offer, Stream, connect, offer};

#[cfg(unix)]
mod system {
    use std::fs::File;
    use std::os::fd::{AsFd as _, OwnedFd};
    use std::os::unix::net::UnixStream;
    use std::process::Stdio;
    use std::time::Instant;

    use super::{Command, Duration, io};
    use crate::campaign::protocol::{self, Greeting, Hello};

    /// The connection between supervisor and worker.
    pub(in crate::campaign) type Stream = UnixStream;

    /// What a worker's command line says of its supervisor: nothing, its standard input is the connection.
    #[derive(Debug, Clone, clap::Args)]
    pub struct Address {}

    /// The supervisor's end of a connection whose other end a worker inherits.
    pub(in crate::campaign) struct Offer {
        ours: Stream,
    }

    /// Gives one end of a fresh connection to the worker that this command starts. The command must be dropped once the
    /// worker has started: until then this process holds the worker's end too, and would not notice that it is closed.
    pub(in crate::campaign) fn offer(command: &mut Command) -> io::Result<Offer> {
        let (offer, theirs) = pair()?;
        command.stdin(Stdio::from(theirs));
        Ok(offer)
    }

    /// A fresh connection, and the end of it that the worker is to have as its standard input.
    pub(in crate::campaign) fn pair() -> io::Result<(Offer, OwnedFd)> {
        // Both ends are closed in every other program that this process starts.
        let (ours, theirs) = UnixStream::pair()?;
        Ok((Offer { ours }, theirs.into()))
    }

    impl Offer {
        /// Waits until the worker has reported. `alive` is asked again and again; its error ends the wait.
        pub(in crate::campaign) fn taken(
            mut self,
            limit: Duration,
            alive: &mut dyn FnMut() -> io::Result<()>,
        ) -> io::Result<(Stream, Hello)> {
            let mut greeting = Greeting::default();
            let started = Instant::now();
            self.ours.set_read_timeout(Some(Duration::from_millis(20)))?;
            while started.elapsed() < limit {
                match greeting.hear(&mut self.ours) {
                    Ok(None) => alive()?,
                    Ok(Some(hello)) => return Ok((self.ours, hello)),
                    Err(error) => {
                        // It closed its end; that it has ended says more, where it has.
                        alive()?;
                        return Err(error);
                    }
                }
            }
            Err(protocol::not_reported(limit))
        }
    }

    /// Takes the standard input of this process, which is a worker, as the connection to its supervisor. Programs that
    /// the worker starts do not inherit it, and hooks that read standard input find it empty.
    pub(in crate::campaign) fn connect(_: &Address, lock_stepped: bool, end_limit: Duration) -> io::Result<Stream> {
        let not_started = |_| io::Error::other("`worker` is started by `run`, not by hand");
        let mut stream = UnixStream::from(io::stdin().as_fd().try_clone_to_owned()?);
        stream.peer_addr().map_err(not_started)?;
        rustix::stdio::dup2_stdin(File::open("/dev/null")?)?;
        protocol::send(&mut stream, &Hello { lock_stepped, end_limit, token: None })?;
        Ok(stream)
    }
}

#[cfg(not(unix))]
mod system {
    use std::net::{SocketAddr, TcpStream};
    use std::process::Stdio;

    use super::{Command, Duration, io};
    use crate::campaign::port::{self, Port};
    use crate::campaign::protocol::Hello;

    /// Where a worker finds its token.
    const TOKEN: &str = "SESAME_WORKER_TOKEN";

    /// The connection between supervisor and worker.
    pub(in crate::campaign) type Stream = TcpStream;

    /// What a worker's command line says of its supervisor.
    #[derive(Debug, Clone, clap::Args)]
    pub struct Address {
        /// Where it listens
        supervisor: SocketAddr,
    }

    /// A port to which a worker is to connect.
    pub(in crate::campaign) struct Offer {
        port: Port,
    }

    /// Opens a port, and tells the worker that this command starts where it is.
    pub(in crate::campaign) fn offer(command: &mut Command) -> io::Result<Offer> {
        let port = Port::open()?;
        command.arg(port.address()?.to_string()).env(TOKEN, port.token()).stdin(Stdio::null());
        Ok(Offer { port })
    }

    impl Offer {
        /// Waits until the worker has reported. `alive` is asked again and again; its error ends the wait.
        pub(in crate::campaign) fn taken(
            self,
            limit: Duration,
            alive: &mut dyn FnMut() -> io::Result<()>,
        ) -> io::Result<(Stream, Hello)> {
            self.port.accept(limit, alive)
        }
    }

    /// Connects this process, which is a worker, to its supervisor.
    pub(in crate::campaign) fn connect(
        address: &Address,
        lock_stepped: bool,
        end_limit: Duration,
    ) -> io::Result<Stream> {
        let token = std::env::var(TOKEN).map_err(|_| io::Error::other("`worker` is started by `run`, not by hand"))?;
        port::connect(address.supervisor, &Hello { lock_stepped, end_limit, token: Some(token) })
    }
}

#[cfg(all(test, unix))]
mod tests {
    use super::*;

    #[test]
    fn a_program_that_is_no_worker_ends_the_wait() {
        let mut command = Command::new("true");
        let offer = offer(&mut command).unwrap();
        let mut process = command.spawn().unwrap();
        drop(command);
        let mut alive = || match process.try_wait()? {
            Some(status) => Err(io::Error::other(format!("it ended: {status}"))),
            None => Ok(()),
        };
        let error = offer.taken(sesame_patience::LIMIT, &mut alive).unwrap_err();
        assert!(
            error.kind() == io::ErrorKind::UnexpectedEof || error.to_string().contains("it ended: exit status: 0"),
            "{error}"
        );
    }

    #[test]
    fn a_worker_that_says_nothing_is_given_up_after_the_limit() {
        let mut command = Command::new("true");
        let offer = offer(&mut command).unwrap();
        // The command holds the worker's end.
        let error = offer.taken(Duration::from_millis(100), &mut || Ok(())).unwrap_err();
        assert_eq!(error.kind(), io::ErrorKind::TimedOut, "{error}");
    }
}
