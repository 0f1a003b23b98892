//! The master, which tells nodes of each other, and what nodes ask each other before they connect.

use std::time::{Duration, Instant};

use crate::connection::{Connection, Stop};
use crate::protocol::http;
use crate::protocol::xmlrpc::{self, Value};

/// The port of a master whose address names none.
const PORT: u16 = 11_311;

/// How long an answer may take.
const ANSWER: Duration = Duration::from_secs(3);

/// How long a connection may take.
const CONNECT: Duration = Duration::from_secs(1);

/// Why a question has no answer.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum AskError {
    /// Nobody answers, or nothing that can be understood.
    #[error("`{at}` does not answer: {problem}")]
    Silent {
        /// Who was asked.
        at: String,
        /// The problem.
        problem: String,
    },
    /// The answer is that it cannot be done.
    #[error("`{at}` refuses: {why}")]
    Refused {
        /// Who was asked.
        at: String,
        /// Its reason.
        why: String,
    },
}

/// Where somebody listens.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct Address {
    pub(crate) host: String,
    pub(crate) port: u16,
}

impl Address {
    /// From `http://HOST:PORT/` or `rosrpc://HOST:PORT`.
    pub(crate) fn read(uri: &str) -> Option<Self> {
        let (scheme, rest) = uri.split_once("://")?;
        if !matches!(scheme, "http" | "rosrpc") {
            return None;
        }
        let place = rest.split('/').next().unwrap_or_default();
        let (host, port) = match place.rsplit_once(':') {
            Some((host, port)) => (host, port.parse().ok()?),
            None => (place, PORT),
        };
        let host = host.trim_start_matches('[').trim_end_matches(']').to_owned();
        (!host.is_empty()).then_some(Address { host, port })
    }
}

impl std::fmt::Display for Address {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "{}:{}", self.host, self.port)
    }
}

/// Calls a method of the master or of a node. Their answers are a code, a message, and a value.
pub(crate) fn ask(at: &Address, method: &str, parameters: &[Value], stop: &Stop) -> Result<Value, AskError> {
    let silent = |problem: String| AskError::Silent { at: at.to_string(), problem };
    let deadline = Instant::now() + ANSWER;
    let answer = Connection::to(&at.host, at.port, CONNECT, stop).and_then(|mut connection| {
        let request = http::request(&at.to_string(), &xmlrpc::call(method, parameters));
        connection.write_all(request.as_bytes(), Some(deadline))?;
        http::read(&mut connection, deadline)
    });
    let (first, body) = answer.map_err(|error| silent(error.to_string()))?;
    if first.split_whitespace().nth(1) != Some("200") {
        return Err(silent(format!("its answer is `{first}`")));
    }
    let answer = xmlrpc::read_answer(&body).map_err(silent)?;
    match answer.items() {
        [Value::Int(1), _, value, ..] => Ok(value.clone()),
        [Value::Int(_), why, ..] => {
            Err(AskError::Refused { at: at.to_string(), why: why.text().unwrap_or_default().to_owned() })
        }
        _ => Err(silent("its answer is not a code, a message and a value".to_owned())),
    }
}

/// Who publishes, subscribes and serves, as the master knows it. Nodes that ended without a word are still there.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub(crate) struct State {
    pub(crate) publishers: Vec<(String, Vec<String>)>,
    pub(crate) subscribers: Vec<(String, Vec<String>)>,
    pub(crate) servers: Vec<(String, Vec<String>)>,
}

impl State {
    fn read(value: &Value) -> Option<Self> {
        let side = |value: &Value| -> Vec<(String, Vec<String>)> {
            let entry = |entry: &Value| match entry.items() {
                [name, nodes] => Some((name.text()?.to_owned(), nodes.texts())),
                _ => None,
            };
            value.items().iter().filter_map(entry).collect()
        };
        let [publishers, subscribers, servers] = value.items() else { return None };
        Some(State { publishers: side(publishers), subscribers: side(subscribers), servers: side(servers) })
    }
}

/// The nodes at a name.
pub(crate) fn nodes<'a>(side: &'a [(String, Vec<String>)], name: &str) -> &'a [String] {
    side.iter().find(|(other, _)| other == name).map_or(&[], |(_, nodes)| nodes)
}

/// A master, as a node asks it.
#[derive(Debug, Clone)]
pub(crate) struct Master {
    pub(crate) at: Address,
    /// The name of the node.
    pub(crate) caller: String,
    /// Where the node is asked.
    pub(crate) uri: String,
    pub(crate) stop: Stop,
}

impl Master {
    /// Asks it something; the name of the node goes first.
    pub(crate) fn ask(&self, method: &str, parameters: &[&str]) -> Result<Value, AskError> {
        let parameters: Vec<Value> =
            std::iter::once(self.caller.as_str()).chain(parameters.iter().copied()).map(Value::from).collect();
        ask(&self.at, method, &parameters, &self.stop)
    }

    pub(crate) fn state(&self) -> Result<State, AskError> {
        let state = self.ask("getSystemState", &[])?;
        let problem = || "it has no state with publishers, subscribers and servers".to_owned();
        State::read(&state).ok_or_else(|| AskError::Silent { at: self.at.to_string(), problem: problem() })
    }

    /// The types of topics, by name.
    pub(crate) fn types(&self) -> Result<Vec<(String, String)>, AskError> {
        let types = self.ask("getTopicTypes", &[])?;
        let pair = |pair: &Value| match pair.items() {
            [name, ty] => Some((name.text()?.to_owned(), ty.text()?.to_owned())),
            _ => None,
        };
        Ok(types.items().iter().filter_map(pair).collect())
    }

    /// Registers as a subscriber; the addresses of the publishers.
    pub(crate) fn subscribe(&self, topic: &str, ty: &str) -> Result<Vec<String>, AskError> {
        Ok(self.ask("registerSubscriber", &[topic, ty, &self.uri])?.texts())
    }

    pub(crate) fn publish(&self, topic: &str, ty: &str) -> Result<(), AskError> {
        self.ask("registerPublisher", &[topic, ty, &self.uri]).map(drop)
    }

    pub(crate) fn serve(&self, service: &str, at: &str) -> Result<(), AskError> {
        self.ask("registerService", &[service, at, &self.uri]).map(drop)
    }

    /// Where a service is served; `None` if nobody does.
    pub(crate) fn server(&self, service: &str) -> Result<Option<Address>, AskError> {
        match self.ask("lookupService", &[service]) {
            Ok(uri) => Ok(uri.text().and_then(Address::read)),
            Err(AskError::Refused { .. }) => Ok(None),
            Err(error) => Err(error),
        }
    }

    /// Whether a node that the master knows can be reached.
    pub(crate) fn is_alive(&self, node: &str) -> bool {
        let at = self.ask("lookupNode", &[node]).ok().and_then(|uri| Address::read(uri.text()?));
        at.is_some_and(|at| Connection::to(&at.host, at.port, CONNECT, &self.stop).is_ok())
    }
}
