//! One session with a broker: packets of MQTT 5 over a socket, until it ends.

use std::time::{Duration, Instant};

use bytes::BytesMut;
use rumqttc::v5::mqttbytes::v5::{
    Connect, ConnectProperties, ConnectReturnCode, Filter, Login, Packet, Publish, RetainForwardRule, Subscribe,
    SubscribeReasonCode,
};
use rumqttc::v5::mqttbytes::{Error as PacketError, QoS};
use rumqttc::v5::{MqttState, Request};
use rustls::pki_types::ServerName;
use tokio::io::{AsyncRead, AsyncReadExt as _, AsyncWrite, AsyncWriteExt as _};
use tokio::net::TcpStream;
use tokio::sync::mpsc;
use tokio_rustls::TlsConnector;

use crate::connection::{Account, Passed, Received};
use crate::quick_ack::QuickAck;

/// The largest packet that is taken, in bytes.
const PACKET_LIMIT: u32 = 4 << 20;

/// How often a silent connection is probed.
const KEEP_ALIVE: Duration = Duration::from_secs(5);

/// How long a broker may take until a session stands.
const BEGIN_WITHIN: Duration = Duration::from_secs(5);

/// How many messages of quality 1 and 2 may be unacknowledged, unless the broker permits fewer.
const UNACKNOWLEDGED: u16 = 100;

trait Socket: AsyncRead + AsyncWrite + Unpin {}
impl<T: AsyncRead + AsyncWrite + Unpin> Socket for T {}

/// Why there is no session any more, or none yet.
pub(crate) enum End {
    /// Whoever wanted it is gone.
    Dropped,
    /// Nobody is there; it may be tried again. In words.
    Broken(String),
    /// Somebody is there, and trying again does not help. In words.
    Refused(String),
}

/// A session that stands: everything is subscribed to.
pub(crate) struct Session {
    socket: Box<dyn Socket>,
    incoming: BytesMut,
    outgoing: BytesMut,
    state: MqttState,
    limit: u16,
    spoken: Instant,
    probed: Option<Instant>,
}

impl Session {
    /// Connects, logs in, and subscribes, within a few seconds.
    pub(crate) async fn begin(account: &Account) -> Result<Session, End> {
        match tokio::time::timeout(BEGIN_WITHIN, Session::begin_at_once(account)).await {
            Ok(begun) => begun,
            Err(_) => Err(End::Broken(format!("no answer within {} s", BEGIN_WITHIN.as_secs()))),
        }
    }

    async fn begin_at_once(account: &Account) -> Result<Session, End> {
        let mut session = Session {
            socket: open(account).await?,
            incoming: BytesMut::new(),
            outgoing: BytesMut::new(),
            state: MqttState::new(UNACKNOWLEDGED, false),
            limit: UNACKNOWLEDGED,
            spoken: Instant::now(),
            probed: None,
        };
        session.log_in(account).await?;
        session.subscribe(account).await?;
        Ok(session)
    }

    async fn log_in(&mut self, account: &Account) -> Result<(), End> {
        let mut properties = ConnectProperties::new();
        properties.receive_maximum = Some(UNACKNOWLEDGED);
        properties.max_packet_size = Some(PACKET_LIMIT);
        let connect = Connect {
            keep_alive: u16::try_from(2 * KEEP_ALIVE.as_secs()).unwrap_or(u16::MAX),
            client_id: account.client.clone(),
            clean_start: true,
            properties: Some(properties),
        };
        let login = account.user.as_ref().map(|user| Login::new(user, account.password()));
        self.write(&Packet::Connect(connect, None, login)).await?;
        let answer = self.packet().await.map_err(|end| match end {
            End::Broken(how) => {
                End::Refused(format!("{how} before it let the runner in; does it speak TLS, or MQTT 5?"))
            }
            end => end,
        })?;
        let Packet::ConnAck(answer) = answer else {
            return Err(End::Refused("it does not answer as a broker of MQTT 5".to_owned()));
        };
        match answer.code {
            ConnectReturnCode::Success => {}
            ConnectReturnCode::NotAuthorized | ConnectReturnCode::BadUserNamePassword => {
                return Err(End::Refused(match &account.user {
                    Some(_) => "it does not accept the user or the password".to_owned(),
                    None => "it wants a user; add `user` and `password` to the simulator, or `--user` and `--password-env` to a scan"
                        .to_owned(),
                }));
            }
            ConnectReturnCode::ServerBusy | ConnectReturnCode::ServerUnavailable => {
                return Err(End::Broken("it is busy".to_owned()));
            }
            code => return Err(End::Refused(format!("it answers {code:?}"))),
        }
        if let Some(permitted) = answer.properties.and_then(|properties| properties.receive_max) {
            self.limit = self.limit.min(permitted.max(1));
            self.state = MqttState::new(self.limit, false);
        }
        Ok(())
    }

    async fn subscribe(&mut self, account: &Account) -> Result<(), End> {
        for (topic, own) in &account.subscriptions {
            let filter = Filter {
                path: topic.clone(),
                qos: account.quality,
                // What the runner publishes is heard only where it is measured.
                nolocal: !own,
                preserve_retain: true,
                // What is retained is part of a system's state; what comes back is not asked for.
                retain_forward_rule: if *own { RetainForwardRule::Never } else { RetainForwardRule::OnEverySubscribe },
            };
            self.request(Request::Subscribe(Subscribe::new(filter, None))).await?;
        }
        let mut unanswered = account.subscriptions.len();
        let mut early = Vec::new();
        while unanswered > 0 {
            match self.packet().await? {
                Packet::SubAck(answer) => {
                    let refused =
                        answer.return_codes.iter().find(|code| !matches!(code, SubscribeReasonCode::Success(_)));
                    if let Some(code) = refused {
                        return Err(End::Refused(format!("it refuses a subscription: {code:?}")));
                    }
                    unanswered -= 1;
                }
                packet => early.push(packet),
            }
        }
        for packet in early {
            self.take(packet).await?;
        }
        Ok(())
    }

    /// Passes messages on until the session ends.
    pub(crate) async fn serve(&mut self, to_send: &mut mpsc::Receiver<Publish>, received: &Received) -> End {
        loop {
            while let Some(message) = self.state_message() {
                if received.pass(Passed::Message(Box::new(message), Instant::now())).await.is_err() {
                    return End::Dropped;
                }
            }
            let may_send = self.state.inflight() < self.limit && self.state.collision.is_none();
            let step = tokio::select! {
                publish = to_send.recv(), if may_send => match publish {
                    None => {
                        // A broker that does not answer is not waited for.
                        let farewell = self.request(Request::Disconnect);
                        tokio::time::timeout(Duration::from_millis(200), farewell).await.ok();
                        return End::Dropped;
                    }
                    Some(publish) => self.request(Request::Publish(publish)).await,
                },
                packet = read(&mut self.socket, &mut self.incoming) => match packet {
                    Ok(packet) => self.take(packet).await,
                    Err(end) => Err(end),
                },
                () = tokio::time::sleep(KEEP_ALIVE.saturating_sub(self.spoken.elapsed())) => self.probe().await,
            };
            if let Err(end) = step {
                return end;
            }
        }
    }

    /// What was not acknowledged, to be said again in another session.
    pub(crate) fn unacknowledged(&mut self) -> Vec<Publish> {
        let pending = self.state.clean().into_iter();
        pending
            .filter_map(
                |request| if let Request::Publish(it) = request { Some(Publish { pkid: 0, ..it }) } else { None },
            )
            .collect()
    }

    /// Says once more what an earlier session was not acknowledged.
    pub(crate) async fn resend(&mut self, again: &mut Vec<Publish>) -> Result<(), End> {
        for publish in again.drain(..) {
            while self.state.inflight() >= self.limit || self.state.collision.is_some() {
                let packet = self.packet().await?;
                self.take(packet).await?;
            }
            self.request(Request::Publish(publish)).await?;
        }
        Ok(())
    }

    /// The next message that the state has taken in.
    fn state_message(&mut self) -> Option<Publish> {
        while let Some(event) = self.state.events.pop_front() {
            if let rumqttc::v5::Event::Incoming(Packet::Publish(publish)) = event {
                return Some(publish);
            }
        }
        None
    }

    async fn probe(&mut self) -> Result<(), End> {
        if self.probed.is_some_and(|probed| probed.elapsed() >= KEEP_ALIVE) {
            return Err(End::Broken("it no longer answers".to_owned()));
        }
        self.probed.get_or_insert_with(Instant::now);
        self.request(Request::PingReq).await
    }

    /// Takes a packet in, and answers it.
    async fn take(&mut self, packet: Packet) -> Result<(), End> {
        self.probed = None;
        let answer = self.state.handle_incoming_packet(packet).map_err(|error| End::Broken(error.to_string()))?;
        match answer {
            Some(answer) => self.write(&answer).await,
            None => Ok(()),
        }
    }

    async fn request(&mut self, request: Request) -> Result<(), End> {
        let packet = self.state.handle_outgoing_packet(request).map_err(|error| End::Broken(error.to_string()))?;
        match packet {
            Some(packet) => self.write(&packet).await,
            None => Ok(()),
        }
    }

    async fn write(&mut self, packet: &Packet) -> Result<(), End> {
        self.outgoing.clear();
        packet
            .write(&mut self.outgoing, Some(PACKET_LIMIT))
            .map_err(|error| End::Broken(format!("a packet cannot be written: {error}")))?;
        self.socket.write_all(&self.outgoing).await.map_err(|error| broken(&error))?;
        self.socket.flush().await.map_err(|error| broken(&error))?;
        self.spoken = Instant::now();
        Ok(())
    }

    async fn packet(&mut self) -> Result<Packet, End> {
        read(&mut self.socket, &mut self.incoming).await
    }
}

/// The next packet. Nothing is lost if this is given up.
async fn read(socket: &mut Box<dyn Socket>, incoming: &mut BytesMut) -> Result<Packet, End> {
    loop {
        match Packet::read(incoming, Some(PACKET_LIMIT)) {
            Ok(packet) => return Ok(packet),
            Err(PacketError::InsufficientBytes(missing)) => incoming.reserve(missing),
            Err(error) => return Err(End::Broken(format!("it sends something that is not a packet: {error}"))),
        }
        if socket.read_buf(incoming).await.map_err(|error| broken(&error))? == 0 {
            return Err(End::Broken("it closed the connection".to_owned()));
        }
    }
}

async fn open(account: &Account) -> Result<Box<dyn Socket>, End> {
    let address = &account.address;
    let socket = TcpStream::connect((address.host.as_str(), address.port)).await.map_err(|error| broken(&error))?;
    let socket = QuickAck::new(socket).map_err(|error| broken(&error))?;
    let Some(config) = &account.tls else { return Ok(Box::new(socket)) };
    let name = ServerName::try_from(address.host.clone())
        .map_err(|_| End::Refused(format!("`{}` is not a name that a certificate can have", address.host)))?;
    // Somebody is there, so a handshake that fails would fail again.
    let secured = TlsConnector::from(std::sync::Arc::clone(config)).connect(name, socket).await;
    let refused =
        |error: std::io::Error| End::Refused(format!("{error}; does it speak TLS, with a trusted certificate?"));
    Ok(Box::new(secured.map_err(refused)?))
}

fn broken(error: &std::io::Error) -> End {
    End::Broken(error.to_string())
}

/// The quality of service of a plan.
pub(crate) fn quality(quality: sesame_plan::Quality) -> QoS {
    match quality {
        sesame_plan::Quality::AtMostOnce => QoS::AtMostOnce,
        sesame_plan::Quality::AtLeastOnce => QoS::AtLeastOnce,
        sesame_plan::Quality::ExactlyOnce => QoS::ExactlyOnce,
    }
}
