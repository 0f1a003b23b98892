//! HTTP/1.0, as far as XML-RPC needs it: one request and one answer on a connection, each with its length.

use std::io;
use std::time::Instant;

use crate::connection::Connection;

/// The most bytes before a body.
const MOST_HEAD: usize = 16 << 10;

/// The most bytes of a body; the state of large systems is some hundred kilobytes.
const MOST_BODY: usize = 16 << 20;

/// The text of a request.
pub(crate) fn request(host: &str, body: &str) -> String {
    format!("POST / HTTP/1.0\r\nHost: {host}\r\nContent-Type: text/xml\r\nContent-Length: {}\r\n\r\n{body}", body.len())
}

/// The text of an answer.
pub(crate) fn answer(body: &str) -> String {
    // A client of roscpp knows the length in this spelling.
    format!("HTTP/1.0 200 OK\r\nContent-Type: text/xml\r\nContent-length: {}\r\n\r\n{body}", body.len())
}

/// Reads a request or an answer: its first line, and its body.
pub(crate) fn read(connection: &mut Connection, deadline: Instant) -> io::Result<(String, String)> {
    let invalid = |problem: &str| io::Error::new(io::ErrorKind::InvalidData, problem.to_owned());
    let mut read = Vec::new();
    let end = loop {
        if let Some(end) = read.windows(4).position(|window| window == b"\r\n\r\n") {
            break end;
        }
        if read.len() > MOST_HEAD {
            return Err(invalid("its head has no end"));
        }
        if !connection.read_some(&mut read, MOST_HEAD, deadline)? {
            return Err(io::ErrorKind::UnexpectedEof.into());
        }
    };
    let head = String::from_utf8_lossy(&read[..end]).into_owned();
    let length = head.lines().skip(1).find_map(|line| {
        let (name, value) = line.split_once(':')?;
        name.trim().eq_ignore_ascii_case("content-length").then(|| value.trim().parse::<usize>().ok())?
    });
    let mut body = read.split_off(end + 4);
    let most = length.unwrap_or(MOST_BODY);
    if most > MOST_BODY {
        return Err(invalid("its body is too long"));
    }
    while body.len() < most {
        let left = most - body.len();
        if !connection.read_some(&mut body, left, deadline)? {
            if length.is_some() {
                return Err(io::ErrorKind::UnexpectedEof.into());
            }
            break;
        }
    }
    body.truncate(most);
    let first = head.lines().next().unwrap_or_default().to_owned();
    String::from_utf8(body).map(|body| (first, body)).map_err(|_| invalid("its body is not UTF-8"))
}
