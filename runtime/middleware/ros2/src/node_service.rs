//! Services that every node of ROS has for itself, such as those of its parameters.

use std::sync::Arc;

use rustdds::rpc::SampleIdentity;
use rustdds::{GUID, SequenceNumber};
use sesame_codec::cdr::Codec;
use sesame_relay::value::Value;
use sesame_relay::wire::Wanted;

use crate::dds::{DdsError, Endpoint, Participant, ReaderId, Sample, WriterId, mirrored};
use crate::layouts::{Layout, interfaces};
use crate::names;

/// A service of a node, with what encodes its requests and decodes its replies.
pub(crate) struct Service {
    path: String,
    request: Codec,
    reply: Codec,
    writer: WriterId,
    reader: ReaderId,
    address: GUID,
}

/// What a call waits for.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Ticket {
    pub(crate) reader: ReaderId,
    pub(crate) number: SequenceNumber,
}

impl Service {
    /// Joins the service of a node, whose type is among these layouts.
    pub(crate) fn join(
        node: &str,
        service: &str,
        ty: &str,
        layouts: &[Layout],
        dds: &mut Participant,
    ) -> Result<Self, DdsError> {
        let path = format!("{node}/{service}");
        let interfaces = interfaces(layouts);
        let codec = |part: &str| {
            Codec::new(&interfaces, &format!("{ty}_{part}"), &Wanted::All).map_err(|error| DdsError(error.to_string()))
        };
        let type_name = |part: &str| names::type_name(&format!("{ty}_{part}"));
        let qos = mirrored([]);
        let reader = dds.read(&names::reply(&path), &type_name("Response"), &qos)?;
        let writer = dds.publish(&names::request(&path), &type_name("Request"), &qos)?;
        let address = dds.reader_guid(reader).unwrap_or(GUID::GUID_UNKNOWN);
        Ok(Service { request: codec("Request")?, reply: codec("Response")?, path, writer, reader, address })
    }

    /// Calls it.
    pub(crate) fn call(&self, request: &Value, dds: &Participant) -> Result<Ticket, DdsError> {
        let sample = self.request.write(request).map_err(|error| DdsError(error.to_string()))?;
        let related = SampleIdentity { writer_guid: self.address, sequence_number: SequenceNumber::UNKNOWN };
        match dds.write(self.writer, Sample(sample), Some(related))? {
            Some(sent) => Ok(Ticket { reader: self.reader, number: sent.sequence_number }),
            None => Err(DdsError(format!("service `{}` takes no calls", self.path))),
        }
    }

    /// What a reply says; an error for the user if it cannot be read.
    pub(crate) fn read(&self, reply: Arc<[u8]>) -> Result<Value, String> {
        self.reply.read(reply).map_err(|error| error.to_string())
    }

    /// What is missing before a run, in a phrase.
    pub(crate) fn missing(&self, subscribers: &[Endpoint]) -> Option<String> {
        let topic = names::request(&self.path);
        let served = subscribers.iter().any(|endpoint| endpoint.topic == topic);
        (!served).then(|| format!("nobody serves `{}`", self.path))
    }
}
