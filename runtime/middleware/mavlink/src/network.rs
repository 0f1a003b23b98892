//! The runner between vehicles and their ground station: proxies, links, and the messages on both.

use std::collections::{BTreeMap, BTreeSet, VecDeque};
use std::io::ErrorKind;
use std::net::{IpAddr, Ipv4Addr, Ipv6Addr, SocketAddr, ToSocketAddrs as _, UdpSocket};
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{Receiver, RecvTimeoutError, SyncSender, TrySendError, sync_channel};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

use sesame_interfaces::mavlink::Definitions;
use sesame_lifecycle::launch::LaunchContext;
use sesame_plan::mavlink::TopicName;
use sesame_plan::{CampaignPlan, NodeId};
use sesame_relay::transport::bus::{Bus, Event, Settings, on_bus};
use sesame_relay::transport::{Connect, Transport, TransportError};
use sesame_relay::value::Value;
use sesame_relay::wire::Line;

use crate::definitions;
use crate::frame::{Frame, Layout, Sender};

/// How many datagrams may wait for the relay. When the queue is full, sockets are not read, and the operating system
/// drops what does not fit into their buffers, as it does for every slow receiver of UDP.
const WAITING: usize = 1000;

/// The largest datagram, in bytes.
pub(crate) const LARGEST_DATAGRAM: usize = 65_535;

/// The largest number of senders at all proxies together.
const MOST_LINKS: usize = 64;

/// How often a thread that reads a socket checks whether it should end.
const LOOK: Duration = Duration::from_millis(50);

/// The usual port of ground stations, for an address without a port.
const PORT: u16 = 14_550;

/// The sender of a message that the runner makes before it has heard one like it: system and component of a ground
/// station.
const GROUND_STATION: (u8, u8) = (255, 190);

/// Connects to a system that speaks `MAVLink`; launched programs run in this folder.
pub fn mavlink(folder: PathBuf) -> Connect {
    Connect::new(connect, folder)
}

fn connect(plan: &CampaignPlan, folder: &Path) -> Box<dyn Transport> {
    let sesame_plan::Transport::Mavlink { url, definitions } = &plan.simulator.transport else {
        unreachable!("the generator connects each kind of simulator by its own transport")
    };
    let context = LaunchContext::of_worker(folder.to_owned()).remapping(plan);
    let bus = Network::new(plan, url.clone(), definitions.clone(), folder.to_owned());
    on_bus(plan, Box::new(bus), Settings::of(plan), context)
}

/// The position of a link.
type LinkAt = u16;

/// Where a datagram arrived: at a proxy from some sender, or on a link from the ground station.
#[derive(Debug, Clone, Copy)]
enum At {
    Proxy(usize, SocketAddr),
    Link(LinkAt),
}

#[derive(Debug)]
struct Datagram {
    at: At,
    bytes: Vec<u8>,
    arrived: Instant,
}

/// An end of a link.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum End {
    Ground,
    Vehicle,
}

/// The way of a frame: a link, and the end that it goes to.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
struct Way {
    link: LinkAt,
    to: End,
}

impl Way {
    /// The length of a way as bytes, which stand before the frame.
    const LENGTH: usize = 3;

    /// What a message remembers: its way, and its frame.
    fn with(self, frame: &[u8]) -> Arc<[u8]> {
        let [low, high] = self.link.to_le_bytes();
        [&[low, high, u8::from(self.to == End::Vehicle)], frame].concat().into()
    }

    /// The way and the frame that a message remembers.
    fn of(origin: &[u8]) -> Option<(Way, &[u8])> {
        let (&[low, high, down], frame) = origin.split_first_chunk::<{ Way::LENGTH }>()?;
        let to = if down == 0 { End::Ground } else { End::Vehicle };
        Some((Way { link: u16::from_le_bytes([low, high]), to }, frame))
    }
}

/// A thread that reads a socket. Dropping this waits for its end.
struct Reader {
    stop: Arc<AtomicBool>,
    thread: Option<JoinHandle<()>>,
}

impl Reader {
    fn start(
        socket: &UdpSocket,
        queue: SyncSender<Datagram>,
        at: impl Fn(SocketAddr) -> At + Send + 'static,
    ) -> std::io::Result<Reader> {
        let socket = socket.try_clone()?;
        socket.set_read_timeout(Some(LOOK))?;
        let stop = Arc::new(AtomicBool::new(false));
        let stopped = Arc::clone(&stop);
        let read = move || {
            let mut buffer = vec![0; LARGEST_DATAGRAM];
            while !stopped.load(Ordering::Relaxed) {
                match socket.recv_from(&mut buffer) {
                    Ok((length, from)) => {
                        let bytes = buffer[..length].to_vec();
                        if !hand_over(&queue, Datagram { at: at(from), bytes, arrived: Instant::now() }, &stopped) {
                            return;
                        }
                    }
                    // Most errors report an earlier send, for example that nobody listens there yet.
                    Err(error) if matches!(error.kind(), ErrorKind::WouldBlock | ErrorKind::TimedOut) => {}
                    Err(_) => std::thread::sleep(Duration::from_millis(1)),
                }
            }
        };
        let thread = std::thread::Builder::new().name("mavlink".to_owned()).spawn(read)?;
        Ok(Reader { stop, thread: Some(thread) })
    }
}

/// Puts a datagram into the queue and waits while the queue is full. Returns false if nobody takes it any more.
fn hand_over(queue: &SyncSender<Datagram>, datagram: Datagram, stopped: &AtomicBool) -> bool {
    let mut datagram = datagram;
    loop {
        match queue.try_send(datagram) {
            Ok(()) => return true,
            Err(TrySendError::Full(back)) if !stopped.load(Ordering::Relaxed) => datagram = back,
            Err(_) => return false,
        }
        std::thread::sleep(Duration::from_millis(1));
    }
}

impl Drop for Reader {
    fn drop(&mut self) {
        self.stop.store(true, Ordering::Relaxed);
        if let Some(thread) = self.thread.take() {
            // The thread cannot panic; if it did, there would be nothing left to read.
            let _ = thread.join();
        }
    }
}

/// An address of the runner to which the vehicles of a node send.
struct Proxy {
    node: NodeId,
    url: String,
    socket: UdpSocket,
    /// Reads the socket as long as the proxy exists.
    _reader: Reader,
}

/// A sender at a proxy, with its own socket to the ground station.
struct Link {
    proxy: usize,
    peer: SocketAddr,
    socket: UdpSocket,
    reader: Reader,
}

/// A part of a datagram that has not been handled yet.
enum Part {
    /// It goes on as it came.
    Unchanged(Way, Vec<u8>),
    Said(Event),
}

/// The system and the component that send a message, as far as the name of a topic says so.
type SaidSender = (Option<u8>, Option<u8>);

/// A line, and how its messages are read and written.
struct Topic {
    line: Line,
    layout: Layout,
    sender: SaidSender,
}

struct Network {
    plan: CampaignPlan,
    url: String,
    files: Vec<String>,
    folder: PathBuf,
    /// The definitions of the files, once they were read: a run does not change them.
    definitions: Option<Definitions>,
    topics: Vec<Topic>,
    /// Lines by the sender and the number of their messages.
    lines: BTreeMap<(SaidSender, u32), usize>,
    ground: Option<SocketAddr>,
    incoming: Receiver<Datagram>,
    queue: SyncSender<Datagram>,
    proxies: Vec<Proxy>,
    links: Vec<Link>,
    /// The rest of the latest datagram.
    parts: VecDeque<Part>,
    /// For each line the way, the system and the component of its latest message.
    latest: BTreeMap<usize, (Way, u8, u8)>,
    /// The number of the next frame that the runner makes in the name of each sender.
    made: BTreeMap<(u8, u8), u8>,
    /// What was noted already, with the line if it concerns one.
    noted: BTreeSet<(Option<usize>, &'static str)>,
}

impl Network {
    fn new(plan: &CampaignPlan, url: String, files: Vec<String>, folder: PathBuf) -> Network {
        let (queue, incoming) = sync_channel(WAITING);
        Network {
            plan: plan.clone(),
            url,
            files,
            folder,
            definitions: None,
            topics: Vec::new(),
            lines: BTreeMap::new(),
            ground: None,
            incoming,
            queue,
            proxies: Vec::new(),
            links: Vec::new(),
            parts: VecDeque::new(),
            latest: BTreeMap::new(),
            made: BTreeMap::new(),
            noted: BTreeSet::new(),
        }
    }

    /// Finds the message of each topic, and how its fields are read.
    fn start(&mut self, lines: &[Line]) -> Result<(), TransportError> {
        let definitions = match self.definitions.take() {
            Some(definitions) => definitions,
            None => definitions::read(&self.files, &self.folder).map_err(TransportError::Wiring)?,
        };
        let definitions = self.definitions.insert(definitions);
        self.topics.clear();
        self.lines.clear();
        for (at, line) in lines.iter().enumerate() {
            let wrong = |problem: String| TransportError::Wiring(format!("topic `{}`: {problem}", line.path));
            let TopicName { system, component, message } = TopicName::read(&line.path).map_err(wrong)?;
            let definition = definitions.named(message);
            let definition = definition.ok_or_else(|| wrong(format!("the definitions have no message `{message}`")))?;
            let sender = (system, component);
            let layout = Layout::new(&self.plan, &self.plan.topic(line.topic).ty, definition).map_err(wrong)?;
            self.lines.insert((sender, layout.id()), at);
            self.topics.push(Topic { line: line.clone(), layout, sender });
        }
        Ok(())
    }

    /// The topic of a frame: the one that names its sender most precisely.
    fn topic_of(&self, frame: &Frame<'_>) -> Option<usize> {
        let (system, component) = (Some(frame.system), Some(frame.component));
        let keys = [(system, component), (system, None), (None, None)];
        keys.into_iter().find_map(|sender| self.lines.get(&(sender, frame.id)).copied())
    }

    /// The link of a sender at a proxy. A new sender gets a new link, unless there are too many.
    fn link_of(&mut self, proxy: usize, peer: SocketAddr) -> Result<Option<LinkAt>, TransportError> {
        let known = self.links.iter().position(|link| link.proxy == proxy && link.peer == peer);
        let at = known.unwrap_or(self.links.len());
        let Some(number) = LinkAt::try_from(at).ok().filter(|_| at < MOST_LINKS) else { return Ok(None) };
        if known.is_none() {
            let Some(ground) = self.ground else { return Ok(None) };
            let wrong = |error: std::io::Error| {
                TransportError::Wiring(format!("the ground station at `{ground}` cannot be reached: {error}"))
            };
            // For a ground station on this machine, no other machine should reach the socket.
            let own: IpAddr = match (ground.ip().is_loopback(), ground.ip()) {
                (true, IpAddr::V4(_)) => Ipv4Addr::LOCALHOST.into(),
                (true, IpAddr::V6(_)) => Ipv6Addr::LOCALHOST.into(),
                (false, IpAddr::V4(_)) => Ipv4Addr::UNSPECIFIED.into(),
                (false, IpAddr::V6(_)) => Ipv6Addr::UNSPECIFIED.into(),
            };
            let socket = UdpSocket::bind((own, 0)).map_err(wrong)?;
            socket.connect(ground).map_err(wrong)?;
            let reader = Reader::start(&socket, self.queue.clone(), move |_| At::Link(number)).map_err(wrong)?;
            self.links.push(Link { proxy, peer, socket, reader });
        }
        Ok(Some(number))
    }

    /// Takes a datagram apart. Frames that no operation acts on stay together, and everything stays in order.
    fn take(&mut self, datagram: &Datagram) -> Result<(), TransportError> {
        let way = match datagram.at {
            At::Proxy(proxy, peer) => {
                let Some(link) = self.link_of(proxy, peer)? else {
                    let why = format!("there are more than {MOST_LINKS} senders; what further ones send is lost");
                    self.note(None, "senders", why);
                    return Ok(());
                };
                Way { link, to: End::Ground }
            }
            At::Link(link) => Way { link, to: End::Vehicle },
        };
        let (mut unchanged, mut rest) = (Vec::new(), datagram.bytes.as_slice());
        // Messages that are only observed are reported after they have been forwarded.
        let mut heard = Vec::new();
        while let Some(frame) = Frame::first(rest) {
            rest = &rest[frame.bytes.len()..];
            match self.event(&frame, way, datagram.arrived) {
                Some((event, true)) => {
                    self.flush(way, &mut unchanged, &mut heard);
                    self.parts.push_back(Part::Said(event));
                }
                Some((event, false)) => {
                    unchanged.extend_from_slice(frame.bytes);
                    heard.push(event);
                }
                None => unchanged.extend_from_slice(frame.bytes),
            }
        }
        unchanged.extend_from_slice(rest);
        self.flush(way, &mut unchanged, &mut heard);
        Ok(())
    }

    fn flush(&mut self, way: Way, unchanged: &mut Vec<u8>, heard: &mut Vec<Event>) {
        if !unchanged.is_empty() {
            self.parts.push_back(Part::Unchanged(way, std::mem::take(unchanged)));
        }
        self.parts.extend(heard.drain(..).map(Part::Said));
    }

    /// The message in a frame, if the frame belongs to a topic, and whether it passes through the relay. A frame that
    /// cannot be read, or must not be changed, is forwarded as it came.
    fn event(&mut self, frame: &Frame<'_>, way: Way, arrived: Instant) -> Option<(Event, bool)> {
        let at = self.topic_of(frame)?;
        let topic = &self.topics[at];
        let source = self.source(topic, way)?;
        let Line { cut, path, .. } = &topic.line;
        if *cut && frame.is_signed() {
            let why = format!("messages on `{path}` are signed, so nothing can act on them: they go on as they came");
            self.note(Some(at), "signed", why);
            return None;
        }
        match topic.layout.read(frame, way.with(frame.bytes)) {
            Ok(value) => {
                let cut = *cut;
                self.latest.insert(at, (way, frame.system, frame.component));
                Some((Event::Message { line: at, source, value, call: None, arrived }, cut))
            }
            Err(problem) => {
                let why = format!("a message on `{path}` is not as declared and goes on as it came: {problem}");
                self.note(Some(at), "misfit", why);
                None
            }
        }
    }

    /// Reports something once for a topic.
    fn note(&mut self, of: Option<usize>, what: &'static str, why: String) {
        if self.noted.insert((of, what)) {
            self.parts.push_back(Part::Said(Event::Note(why)));
        }
    }

    /// Whether a node is at this end of a link. At the end of the vehicle is the node of the proxy, at the end of the
    /// ground station are all nodes without a proxy.
    fn is_at(&self, link: LinkAt, end: End, node: NodeId) -> bool {
        match end {
            End::Vehicle => self.links.get(usize::from(link)).is_some_and(|link| self.proxies[link.proxy].node == node),
            End::Ground => self.proxies.iter().all(|proxy| proxy.node != node),
        }
    }

    /// The source that a message came from: the source of its publisher if operations distinguish it, otherwise the
    /// source that all other publishers share, if there is one.
    fn source(&self, topic: &Topic, way: Way) -> Option<usize> {
        let sources = &topic.line.sources;
        let from = if way.to == End::Ground { End::Vehicle } else { End::Ground };
        let publishes = |publisher: Option<NodeId>| publisher.is_some_and(|node| self.is_at(way.link, from, node));
        let told_apart = sources.iter().position(|source| publishes(source.publisher));
        told_apart.or_else(|| sources.iter().position(|source| source.publisher.is_none()))
    }

    /// The ways of a message that the runner makes: the way of the latest message of its topic or, before there is one,
    /// the ways to all vehicles that subscribe to it.
    fn ways(&self, line: usize) -> Vec<Way> {
        if let Some(&(way, ..)) = self.latest.get(&line) {
            return vec![way];
        }
        let topic = self.topics[line].line.topic;
        let subscribes = |node: NodeId| self.plan.node(node).subscribes(topic);
        let numbers = (0..).zip(&self.links);
        let down = numbers.filter(|(_, link)| subscribes(self.proxies[link.proxy].node));
        let down: Vec<Way> = down.map(|(link, _)| Way { link, to: End::Vehicle }).collect();
        if down.is_empty() { vec![Way { link: 0, to: End::Ground }] } else { down }
    }

    /// Whether a sink is for messages on this way: the sink of the receiver if operations distinguish it, otherwise the
    /// sink that all other receivers share.
    fn is_for(&self, line: usize, sink: usize, way: Way) -> bool {
        let sinks = &self.topics[line].line.sinks;
        let receives = |subscriber: Option<NodeId>| subscriber.is_some_and(|node| self.is_at(way.link, way.to, node));
        // Several receivers at one address need one datagram only.
        let told_apart = sinks.iter().position(|sink| receives(sink.subscriber));
        told_apart.map_or(sinks[sink].subscriber.is_none(), |of| of == sink)
    }

    fn send(&mut self, way: Way, bytes: &[u8]) {
        let Some(link) = self.links.get(usize::from(way.link)) else { return };
        let send = || match way.to {
            End::Ground => link.socket.send(bytes),
            End::Vehicle => self.proxies[link.proxy].socket.send_to(bytes, link.peer),
        };
        // The error may be the one of an earlier datagram that nobody took; then this one has not been sent yet.
        if let Err(error) = send().or_else(|_| send())
            && error.kind() != ErrorKind::ConnectionRefused
        {
            self.note(None, "sending", format!("a datagram could not be sent: {error}"));
        }
    }

    /// The number of the next frame that the runner makes in the name of a sender.
    fn next_number(&mut self, sender: (u8, u8)) -> u8 {
        let next = self.made.entry(sender).or_default();
        let number = *next;
        *next = number.wrapping_add(1);
        number
    }
}

/// The socket address that `udp://HOST:PORT` stands for.
pub(crate) fn read_url(url: &str) -> Result<SocketAddr, TransportError> {
    let wrong = |problem: String| TransportError::Wiring(format!("`{url}` is not an address of UDP: {problem}"));
    let rest = url.strip_prefix("udp://").ok_or_else(|| wrong("write `udp://HOST:PORT`".to_owned()))?;
    let rest = rest.trim_end_matches('/');
    let has_port = rest.rsplit(']').next().is_some_and(|behind| behind.contains(':'));
    let text = if has_port { rest.to_owned() } else { format!("{rest}:{PORT}") };
    let found: Vec<SocketAddr> = text.to_socket_addrs().map_err(|error| wrong(error.to_string()))?.collect();
    // Where a host has both kinds of addresses, ground stations listen at those of version 4.
    let best = found.iter().find(|address| address.is_ipv4()).or(found.first());
    best.copied().ok_or_else(|| wrong("its host has no address".to_owned()))
}

impl Bus for Network {
    fn listen(&mut self, address: &dyn Fn(&str) -> String) -> Result<(), TransportError> {
        // Programs of an earlier run may have sent these.
        while self.incoming.try_recv().is_ok() {}
        if !self.proxies.is_empty() {
            return Ok(());
        }
        for (at, proxy) in self.plan.simulator.proxies.iter().enumerate() {
            let url = address(&proxy.url);
            let wrong = |problem: String| TransportError::Wiring(format!("the proxy at `{url}`: {problem}"));
            let own = read_url(&url)?;
            if !own.ip().is_loopback() {
                return Err(wrong("other machines could connect; expected `127.0.0.1`".to_owned()));
            }
            let socket = UdpSocket::bind(own).map_err(|error| wrong(error.to_string()))?;
            let reader = Reader::start(&socket, self.queue.clone(), move |from| At::Proxy(at, from));
            let reader = reader.map_err(|error| wrong(error.to_string()))?;
            self.proxies.push(Proxy { node: proxy.node, url, socket, _reader: reader });
        }
        Ok(())
    }

    fn connect(&mut self, lines: &[Line], address: &dyn Fn(&str) -> String) -> Result<bool, TransportError> {
        self.ground = Some(read_url(&address(&self.url))?);
        self.start(lines)?;
        Ok(true)
    }

    fn missing(&mut self) -> Vec<String> {
        let silent = self.proxies.iter().enumerate();
        let silent = silent.filter(|(at, _)| self.links.iter().all(|link| link.proxy != *at));
        let said = silent.map(|(_, Proxy { node, url, .. })| {
            format!("node `{}` has sent nothing to `{url}`", self.plan.node(*node).name)
        });
        said.collect()
    }

    fn receive(&mut self, timeout: Duration) -> Result<Option<Event>, TransportError> {
        let limit = Instant::now() + timeout;
        loop {
            match self.parts.pop_front() {
                Some(Part::Said(event)) => return Ok(Some(event)),
                Some(Part::Unchanged(way, bytes)) => {
                    self.send(way, &bytes);
                    continue;
                }
                None => {}
            }
            match self.incoming.recv_timeout(limit.saturating_duration_since(Instant::now())) {
                Ok(datagram) => self.take(&datagram)?,
                Err(RecvTimeoutError::Timeout) => return Ok(None),
                Err(RecvTimeoutError::Disconnected) => unreachable!("the other end is kept here"),
            }
        }
    }

    fn publish(&mut self, line: usize, sink: usize, value: &Value, _: Option<u64>) -> Result<(), TransportError> {
        let Value::Record(record) = value else { return Ok(()) };
        let origin = record.origin().and_then(|origin| Way::of(&origin.bytes).map(|(way, frame)| (origin, way, frame)));
        let topic = &self.topics[line];
        let (ways, bytes) = match origin {
            Some((_, way, frame)) if record.unchanged().is_some() => (vec![way], frame.to_vec()),
            Some((origin, way, bytes)) => {
                let Some(frame) = Frame::first(bytes) else { return Ok(()) };
                (vec![way], topic.layout.write(&frame, &origin.values, record.values()))
            }
            None => {
                let latest = self.latest.get(&line).map(|&(_, system, component)| (system, component));
                let (system, component) = latest.unwrap_or(GROUND_STATION);
                let sender = (topic.sender.0.unwrap_or(system), topic.sender.1.unwrap_or(component));
                let sequence = self.next_number(sender);
                let sender = Sender { system: sender.0, component: sender.1, sequence };
                (self.ways(line), self.topics[line].layout.make(sender, record.values()))
            }
        };
        for way in ways {
            if self.is_for(line, sink, way) {
                self.send(way, &bytes);
            }
        }
        Ok(())
    }

    fn disconnect(&mut self) {
        // Every thread learns first that it should end, because each may take a moment.
        for link in &self.links {
            link.reader.stop.store(true, Ordering::Relaxed);
        }
        self.links.clear();
        self.parts.clear();
        self.latest.clear();
        self.made.clear();
        self.noted.clear();
    }
}

#[cfg(test)]
#[expect(clippy::disallowed_methods, clippy::disallowed_types, reason = "they have sockets, files and limits")]
mod tests;
