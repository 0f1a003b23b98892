//! A simulator of ours over SimlogAPI, version 2: what other platforms drive over that protocol can drive it too.
//!
//! The simulator stays on the thread that serves it; calls come from the threads of the connections. A run begins when
//! a client sets the length of a step, and again when it does so again. What the simulator publishes as it starts goes
//! to the first who subscribes before the first step. Topics that are cut stay cut as long as the stream of the cut is
//! there. The code of a step is 0, or -1 once the simulation has ended.

mod bearer;
mod calls;
mod world;

use std::io;
use std::net::SocketAddr;
use std::sync::mpsc::{Receiver, SyncSender, sync_channel};

use sesame_plan::WireNames;
use sesame_relay::simulator::{Bus, Setup, Simulator, SimulatorError};
use tokio::net::TcpListener;
use tokio::runtime::Builder;
use tonic::transport::Server;
use tonic::transport::server::TcpIncoming;

use self::bearer::Bearer;
use self::calls::Calls;
use self::world::{Request, World};
use crate::proto::v2::simlog_api_server::SimlogApiServer;

/// How many calls may wait for the simulator.
const WAITING: usize = 64;

/// The largest message that is taken, in bytes.
const MESSAGE_LIMIT: usize = 4 << 20;

/// Where and for whom a simulator is served.
#[derive(Debug, Clone)]
pub struct ServerOptions {
    /// Where it listens. An address that is not of this machine alone needs a token.
    pub address: SocketAddr,
    /// What each call has to carry (`authorization: Bearer …`); `None` for anybody on this machine.
    pub token: Option<String>,
    /// How topics are named on the wire.
    pub names: WireNames,
    /// The seed of the simulator's own randomness: the protocol has none.
    pub seed: u64,
}

impl ServerOptions {
    /// The options for an address: without a token, with the names of the original platform, and seed 1.
    pub fn new(address: SocketAddr) -> Self {
        ServerOptions { address, token: None, names: WireNames::default(), seed: 1 }
    }
}

/// Serves a simulator until the process ends. `ready` is told the address, which says the port if none was given.
/// `start` makes the simulator of each run; most often it is [`Simulator::start`]. An error means that nobody can be
/// served.
pub fn serve<S: Simulator>(
    options: &ServerOptions,
    ready: impl FnOnce(SocketAddr),
    start: impl FnMut(&Setup, &mut Bus<'_>) -> Result<S, SimulatorError>,
) -> io::Result<()> {
    if options.token.as_deref().unwrap_or_default().is_empty() && !options.address.ip().is_loopback() {
        let problem = format!("{} can be reached from other machines: it needs a token", options.address);
        return Err(io::Error::new(io::ErrorKind::InvalidInput, problem));
    }
    let (sender, receiver): (SyncSender<Request>, Receiver<Request>) = sync_channel(WAITING);
    let runtime = Builder::new_current_thread().enable_io().enable_time().build()?;
    let listener = runtime.block_on(TcpListener::bind(options.address))?;
    let address = listener.local_addr()?;
    let calls = SimlogApiServer::new(Calls::new(sender)).max_decoding_message_size(MESSAGE_LIMIT);
    let guarded = tonic::service::interceptor::InterceptedService::new(calls, Bearer::new(options.token.clone()));
    let server = Server::builder().add_service(guarded);
    // Answers are small, and none may wait for the next one.
    let incoming = TcpIncoming::from(listener).with_nodelay(Some(true));
    let serving = std::thread::Builder::new()
        .name("simlog".to_owned())
        .spawn(move || runtime.block_on(server.serve_with_incoming(incoming)))?;
    ready(address);
    World::new(options.names.clone(), options.seed, start).serve(&receiver);
    // All callers are gone, so the server has ended.
    match serving.join() {
        Ok(Ok(())) => Ok(()),
        Ok(Err(error)) => Err(io::Error::other(error)),
        Err(_) => Err(io::Error::other("the server ended by a panic")),
    }
}
