//! A connection that acknowledges segments at once.

use std::io;
use std::pin::Pin;
use std::task::{Context, Poll, ready};

use tokio::io::{AsyncRead, AsyncWrite, ReadBuf};
use tokio::net::TcpStream;

/// A connection on which neither side waits for an acknowledgement of TCP.
///
/// A broker usually leaves Nagle's algorithm on (Mosquitto's `set_tcp_nodelay` is off by default): after the `PUBACK`
/// for a message that it took, it holds back the next message until that segment is acknowledged. A client that has
/// nothing to say delays this by up to 40 ms, so a runner that both publishes and subscribes would add 20 to 40 ms to
/// each message. Linux forgets the setting as it goes, so it is made again after each read.
pub(crate) struct QuickAck(TcpStream);

impl QuickAck {
    pub(crate) fn new(socket: TcpStream) -> io::Result<QuickAck> {
        socket.set_nodelay(true)?;
        let socket = QuickAck(socket);
        socket.acknowledge()?;
        Ok(socket)
    }

    #[cfg(target_os = "linux")]
    fn acknowledge(&self) -> io::Result<()> {
        self.0.set_quickack(true)
    }

    /// Other systems have no such setting.
    #[cfg(not(target_os = "linux"))]
    fn acknowledge(&self) -> io::Result<()> {
        Ok(())
    }
}

impl AsyncRead for QuickAck {
    fn poll_read(
        mut self: Pin<&mut Self>,
        context: &mut Context<'_>,
        buffer: &mut ReadBuf<'_>,
    ) -> Poll<io::Result<()>> {
        ready!(Pin::new(&mut self.0).poll_read(context, buffer))?;
        Poll::Ready(self.acknowledge())
    }
}

impl AsyncWrite for QuickAck {
    fn poll_write(mut self: Pin<&mut Self>, context: &mut Context<'_>, bytes: &[u8]) -> Poll<io::Result<usize>> {
        Pin::new(&mut self.0).poll_write(context, bytes)
    }

    fn poll_flush(mut self: Pin<&mut Self>, context: &mut Context<'_>) -> Poll<io::Result<()>> {
        Pin::new(&mut self.0).poll_flush(context)
    }

    fn poll_shutdown(mut self: Pin<&mut Self>, context: &mut Context<'_>) -> Poll<io::Result<()>> {
        Pin::new(&mut self.0).poll_shutdown(context)
    }
}
