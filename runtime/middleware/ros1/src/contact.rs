//! First contact with a publisher or a server: connections whose other end has said what it is.

use std::io;
use std::time::{Duration, Instant};

use crate::connection::{Connection, Stop};
use crate::master::{self, Address};
use crate::protocol::header::{self, ANY, Header};
use crate::protocol::xmlrpc::Value;

/// How long a connection may take.
const CONNECT: Duration = Duration::from_secs(2);

/// How long the other end may take to say what it is.
const HANDSHAKE: Duration = Duration::from_secs(5);

/// Why there is no contact.
#[derive(Debug)]
pub(crate) enum ContactError {
    /// Nobody answers.
    Unreachable(io::Error),
    /// The answer cannot be understood, in a phrase.
    Broken(String),
}

impl From<io::Error> for ContactError {
    fn from(error: io::Error) -> Self {
        ContactError::Unreachable(error)
    }
}

/// Subscribes to a topic of this type at a publisher: its messages follow, unless its header has an `error`.
pub(crate) fn subscribe(
    publisher: &Address,
    [caller, topic, ty]: [&str; 3],
    stop: &Stop,
) -> Result<(Connection, Header), ContactError> {
    let absent = |problem: String| ContactError::Unreachable(io::Error::other(problem));
    let protocols = Value::List(vec![Value::List(vec!["TCPROS".into()])]);
    let request = [caller.into(), topic.into(), protocols];
    let place = master::ask(publisher, "requestTopic", &request, stop).map_err(|error| absent(error.to_string()))?;
    let [Value::Text(_), Value::Text(host), Value::Int(port)] = place.items() else {
        return Err(absent("it does not say where it publishes".to_owned()));
    };
    let port = u16::try_from(*port).map_err(|_| absent(format!("{port} is not a port")))?;
    let ours = [
        ("callerid", caller),
        ("md5sum", ANY),
        ("message_definition", ""),
        ("tcp_nodelay", "1"),
        ("topic", topic),
        ("type", ty),
    ];
    greet(&Address { host: host.clone(), port }, &ours, stop)
}

/// Connects to the server of a service. A probe is only told what it serves.
pub(crate) fn serve(
    server: &Address,
    [caller, service]: [&str; 2],
    probe: bool,
    stop: &Stop,
) -> Result<(Connection, Header), ContactError> {
    let mut ours = vec![("callerid", caller), ("md5sum", ANY), ("service", service)];
    if probe {
        ours.push(("probe", "1"));
    }
    greet(server, &ours, stop)
}

fn greet(at: &Address, ours: &[(&str, &str)], stop: &Stop) -> Result<(Connection, Header), ContactError> {
    let mut connection = Connection::to(&at.host, at.port, CONNECT, stop)?;
    let deadline = Some(Instant::now() + HANDSHAKE);
    connection.write_all(&Header::new(ours).write(), deadline)?;
    let theirs = connection.read_frame(header::MOST, deadline)?;
    Ok((connection, Header::read(&theirs).map_err(ContactError::Broken)?))
}
