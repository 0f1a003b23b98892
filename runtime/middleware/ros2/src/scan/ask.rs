//! Asks nodes for the layouts of types: each has a service `~/get_type_description` for that, from Jazzy on.

use std::collections::BTreeMap;
use std::time::{Duration, Instant};

use rustdds::rpc::SampleIdentity;
use rustdds::{GUID, SequenceNumber};
use sesame_plan::Interface;
use sesame_scan::Facts;

use super::described::{Descriptions, SERVICE};
use super::listen::now;
use crate::dds::{DdsError, Participant, ReaderId, Sample, WriterId, mirrored};
use crate::names;

/// The most nodes that are asked.
const MOST_NODES: usize = 100;

/// How long an answer is awaited before the question is asked again: the first one is lost if the node has not yet
/// discovered who asks.
const AGAIN: Duration = Duration::from_millis(500);

/// A client of a node's service.
struct Client {
    writer: WriterId,
    reader: ReaderId,
    /// What a reply names as the address of its request.
    addresses: [GUID; 2],
    asked: BTreeMap<SequenceNumber, usize>,
}

/// A type whose layout is wanted.
struct Question<'a> {
    name: &'a str,
    hash: &'a str,
    /// The nodes that have topics of it.
    nodes: Vec<&'a str>,
    asked: Option<Instant>,
    times: usize,
    answer: Option<Vec<Interface>>,
}

/// The layouts of types, as nodes describe them.
pub(super) fn describe(
    dds: &mut Participant,
    facts: &Facts,
    types: &[String],
    within: Duration,
) -> Result<BTreeMap<String, Vec<Interface>>, DdsError> {
    let descriptions = Descriptions::new();
    let mut clients = BTreeMap::<&str, Client>::new();
    let mut questions: Vec<Question<'_>> = types.iter().filter_map(|name| question(facts, name)).collect();
    let servers: Vec<String> = dds.subscribers().into_iter().map(|endpoint| endpoint.topic).collect();
    let serves = |node: &str| servers.contains(&names::request(&service(node)));
    for question in &mut questions {
        question.nodes.retain(|node| serves(node));
        for &node in &question.nodes {
            if clients.len() < MOST_NODES && !clients.contains_key(node) {
                clients.insert(node, Client::new(node, dds)?);
            }
        }
        question.nodes.retain(|node| clients.contains_key(node));
    }
    questions.retain(|question| !question.nodes.is_empty());
    let (start, mut received, mut unreadable) = (now(), Vec::new(), Vec::new());
    while questions.iter().any(|question| question.answer.is_none()) {
        let at = now();
        if at - start >= within {
            break;
        }
        for (number, question) in questions.iter_mut().enumerate().filter(|(_, question)| question.answer.is_none()) {
            if question.asked.is_some_and(|asked| at - asked < AGAIN) {
                continue;
            }
            let node = question.next_node();
            question.asked = Some(at);
            let (Some(client), Some(request)) = (clients.get_mut(node), descriptions.ask(question.name, question.hash))
            else {
                continue;
            };
            client.ask(dds, number, Sample(request))?;
        }
        let left = within.saturating_sub(at - start).min(Duration::from_millis(50));
        dds.wait(Some(left)).map_err(|error| DdsError(format!("cannot listen: {error}")))?;
        while dds.event().is_some() {}
        dds.take(&mut received, &mut unreadable);
        unreadable.clear();
        for received in received.drain(..) {
            let answered = clients.values().find_map(|client| {
                let related = received.related.filter(|_| received.reader == client.reader)?;
                let known = client.addresses.contains(&related.writer_guid);
                client.asked.get(&related.sequence_number).copied().filter(|_| known)
            });
            let Some(question) = answered.and_then(|number| questions.get_mut(number)) else { continue };
            let layouts = descriptions.read(received.sample.0);
            question.answer =
                layouts.filter(|layouts| layouts.first().is_some_and(|first| first.name == question.name));
        }
    }
    let answers = questions.into_iter().filter_map(|question| Some((question.name.to_owned(), question.answer?)));
    Ok(answers.collect())
}

/// The service of a node.
fn service(node: &str) -> String {
    format!("{node}/get_type_description")
}

/// Whom to ask about a type; `None` if nobody announces its hash.
fn question<'a>(facts: &'a Facts, name: &'a str) -> Option<Question<'a>> {
    let topics = || facts.topics.iter().filter(|topic| topic.ty.as_deref() == Some(name));
    let hash = topics().find_map(|topic| topic.hash.as_deref())?;
    let mut nodes = Vec::new();
    let publishers = topics().flat_map(|topic| &topic.publishers);
    for node in publishers.chain(topics().flat_map(|topic| &topic.subscribers)) {
        if !nodes.contains(&node.as_str()) {
            nodes.push(node.as_str());
        }
    }
    Some(Question { name, hash, nodes, asked: None, times: 0, answer: None })
}

impl<'a> Question<'a> {
    /// Whom to ask now. Each node is asked twice: one that does not answer may be of another middleware, so the next
    /// one is asked then.
    fn next_node(&mut self) -> &'a str {
        let node = self.nodes[self.times / 2 % self.nodes.len()];
        self.times += 1;
        node
    }
}

impl Client {
    fn new(node: &str, dds: &mut Participant) -> Result<Self, DdsError> {
        let [request, reply] = ["Request", "Response"].map(|part| names::type_name(&format!("{SERVICE}_{part}")));
        let (service, qos) = (service(node), mirrored([]));
        let reader = dds.read(&names::reply(&service), &reply, &qos)?;
        let writer = dds.publish(&names::request(&service), &request, &qos)?;
        let addresses =
            [dds.reader_guid(reader), dds.writer_guid(writer)].map(|guid| guid.unwrap_or(GUID::GUID_UNKNOWN));
        Ok(Client { writer, reader, addresses, asked: BTreeMap::new() })
    }

    fn ask(&mut self, dds: &Participant, question: usize, request: Sample) -> Result<(), DdsError> {
        let related = SampleIdentity { writer_guid: self.addresses[0], sequence_number: SequenceNumber::UNKNOWN };
        if let Some(sent) = dds.write(self.writer, request, Some(related))? {
            self.asked.insert(sent.sequence_number, question);
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_node_is_asked_twice_and_then_the_next_one() {
        let nodes = vec!["/silent", "/other"];
        let mut question = Question { name: "a", hash: "b", nodes, asked: None, times: 0, answer: None };
        let asked: Vec<&str> = (0..6).map(|_| question.next_node()).collect();
        assert_eq!(asked, ["/silent", "/silent", "/other", "/other", "/silent", "/silent"]);
    }
}
