//! Others come to the node: the master and nodes with questions, subscribers and clients with connections.

use std::net::{TcpListener, TcpStream};
use std::sync::Arc;
use std::time::{Duration, Instant};

use super::lock::lock;
use super::shared::Shared;
use crate::connection::Connection;
use crate::protocol::header::{self, Header};
use crate::protocol::http;
use crate::protocol::xmlrpc::{self, Value};

/// How long a question, or the header of a connection, may take.
const PATIENCE: Duration = Duration::from_secs(5);

/// The most bytes of the header of somebody who comes.
const MOST_HEADER: usize = header::MOST;

/// Takes connections until the node ends.
fn accept(shared: &Arc<Shared>, listener: &TcpListener, met: fn(&Arc<Shared>, Connection)) {
    for stream in listener.incoming() {
        if shared.stop.is_set() {
            return;
        }
        let taken = |stream: TcpStream| Connection::new(stream, &shared.stop);
        match stream.and_then(taken) {
            Ok(connection) => shared.spawn_connection(move |shared| met(shared, connection)),
            // For example, there are too many open files: those that there are may close.
            Err(_) => shared.pause(Duration::from_millis(100)),
        }
    }
}

/// Answers what the master and other nodes ask.
pub(super) fn answer_questions(shared: &Arc<Shared>, listener: &TcpListener) {
    accept(shared, listener, |shared, mut connection| {
        let deadline = Instant::now() + PATIENCE;
        let Ok((_, body)) = http::read(&mut connection, deadline) else { return };
        let answer = match xmlrpc::read_call(&body) {
            Ok((method, parameters)) => shared.answer(&method, &parameters),
            Err(problem) => failure(&problem),
        };
        // Who has gone needs no answer.
        let _ = connection.write_all(http::answer(&xmlrpc::answer(answer)).as_bytes(), Some(deadline));
    });
}

/// Serves subscribers and clients.
pub(super) fn meet(shared: &Arc<Shared>, listener: &TcpListener) {
    accept(shared, listener, |shared, mut connection| {
        let deadline = Some(Instant::now() + PATIENCE);
        let Ok(bytes) = connection.read_frame(MOST_HEADER, deadline) else { return };
        match Header::read(&bytes) {
            Ok(header) if !header.get("topic").is_empty() => shared.serve_subscriber(connection, &header),
            Ok(header) if !header.get("service").is_empty() => shared.serve_client(connection, &header),
            Ok(_) => refuse(connection, "the header names neither a topic nor a service", deadline),
            Err(problem) => refuse(connection, &format!("the header is broken: {problem}"), deadline),
        }
    });
}

fn refuse(mut connection: Connection, why: &str, deadline: Option<Instant>) {
    // Who has gone cannot be told.
    let _ = connection.write_all(&Header::refusal(why).write(), deadline);
}

fn success(value: Value) -> Value {
    Value::List(vec![Value::Int(1), "".into(), value])
}

fn failure(problem: &str) -> Value {
    Value::List(vec![Value::Int(-1), problem.into(), Value::Int(0)])
}

impl Shared {
    /// The answer to a question, as ROS's Slave API has it.
    fn answer(self: &Arc<Self>, method: &str, parameters: &[Value]) -> Value {
        match (method, parameters) {
            ("publisherUpdate", [_, Value::Text(topic), publishers]) => {
                self.update_publishers(topic, &publishers.texts());
                success(Value::Int(0))
            }
            ("requestTopic", [_, Value::Text(topic), protocols]) => {
                let spoken = protocols
                    .items()
                    .iter()
                    .any(|protocol| protocol.items().first().and_then(Value::text) == Some("TCPROS"));
                let offered = lock(&self.publications)
                    .iter()
                    .any(|publication| publication.topic == *topic && publication.offer.is_some());
                match (spoken, offered) {
                    (true, true) => success(Value::List(vec![
                        "TCPROS".into(),
                        self.host.as_str().into(),
                        Value::Int(self.port.into()),
                    ])),
                    (false, _) => failure("no protocol but TCPROS is spoken here"),
                    (_, false) => failure("this topic is not published here"),
                }
            }
            ("getPid", _) => success(Value::Int(i32::try_from(std::process::id()).unwrap_or(0))),
            ("getMasterUri", _) => success(format!("http://{}/", self.master.at).as_str().into()),
            ("getBusInfo", _) => success(Value::List(Vec::new())),
            ("getBusStats", _) => success(Value::List(vec![Value::List(Vec::new()); 3])),
            ("getSubscriptions", _) => {
                let pairs = lock(&self.subscriptions)
                    .iter()
                    .map(|subscription| pair(&subscription.topic, &subscription.ty))
                    .collect();
                success(Value::List(pairs))
            }
            ("getPublications", _) => {
                let publications = lock(&self.publications);
                let offered = publications
                    .iter()
                    .filter_map(|publication| Some(pair(&publication.topic, &publication.offer.as_ref()?.ty)));
                success(Value::List(offered.collect()))
            }
            ("paramUpdate", _) => success(Value::Int(0)),
            ("shutdown", _) => {
                // A run ends by what the plan says, and not because somebody asks for it.
                let why = parameters.get(1).and_then(Value::text).unwrap_or("without a reason");
                self.note(format!("`{}` was asked to shut down, and goes on: {why}", self.name));
                success(Value::Int(0))
            }
            _ => failure("this is not a question of ROS, or not its parameters"),
        }
    }
}

fn pair(topic: &str, ty: &str) -> Value {
    Value::List(vec![topic.into(), ty.into()])
}
