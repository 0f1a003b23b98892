//! The names of one client of a proxy, in both directions: what it calls `/joints` is another name at the bridge.
//!
//! What is not about such a name passes byte for byte.

use std::collections::BTreeMap;

use sesame_plan::{Remapping, Renamed};

use super::envelope::Envelope;
use super::standing::{About, Standing};
use crate::cbor::replace;
use crate::fragment::{Pieces, cut};
use crate::operation::{Level, Operation};
use crate::png;
use crate::reader::Limits;

/// How many layers of pictures and pieces an operation may have.
const LAYERS: usize = 2;

/// What becomes of a frame of a client.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) enum FromClient {
    /// It goes on as it came.
    Unchanged,
    /// This goes on in its place.
    Changed(String),
    /// It is not passed on, and the client gets this answer.
    Refused(String),
    /// It is a piece of something that is not complete.
    Waits,
}

/// What becomes of a frame of the bridge.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) enum FromBridge {
    /// It goes on as it came.
    Unchanged,
    /// These go on in its place.
    Texts(Vec<String>),
    /// This goes on in its place.
    Bytes(Vec<u8>),
}

/// The names of one client.
#[derive(Debug)]
pub(super) struct Names {
    published: BTreeMap<String, String>,
    subscribed: BTreeMap<String, String>,
    served: BTreeMap<String, String>,
    /// What the client calls the names at the bridge that it subscribed to, and how it wants messages.
    heard: BTreeMap<String, Heard>,
    /// What the client calls the services that it offers at the bridge.
    offered: BTreeMap<String, String>,
    standing: Standing,
    pieces: Pieces,
    limits: Limits,
    /// Counts operations that are cut.
    cut: u64,
}

/// A topic with another name at the bridge. The bridge is asked for whole texts, so that the name can be found in them.
#[derive(Debug, Clone)]
struct Heard {
    name: String,
    fragment_size: Option<usize>,
    picture: bool,
}

impl Names {
    pub(super) fn new(renamed: &Renamed) -> Names {
        let names = |remappings: &[Remapping]| {
            remappings.iter().map(|remapping| (remapping.from.clone(), remapping.to.clone())).collect()
        };
        Names {
            published: names(&renamed.publishes),
            subscribed: names(&renamed.subscribes),
            served: names(&renamed.serves),
            heard: BTreeMap::new(),
            offered: BTreeMap::new(),
            standing: Standing::default(),
            pieces: Pieces::default(),
            limits: Limits::default(),
            cut: 0,
        }
    }

    /// What is to be said to a bridge that is found again.
    pub(super) fn standing(&self) -> Vec<String> {
        self.standing.frames()
    }

    /// A text that the client sends.
    pub(super) fn client_text(&mut self, frame: &str) -> FromClient {
        self.operation(frame, 0)
    }

    fn operation(&mut self, frame: &str, layer: usize) -> FromClient {
        let mut copy = None;
        let envelope = match Envelope::read_marked(frame, &mut copy) {
            Ok(envelope) => envelope,
            Err(problem) => return refused(None, &problem),
        };
        let id = envelope.text("id");
        let Some(op) = envelope.text("op") else { return refused(id, "`op` is missing") };
        let (about, names, field) = match op.as_str() {
            "fragment" | "png" => return self.unpacked(&op, &envelope, id, layer),
            "publish" | "advertise" | "unadvertise" => (About::Publishing, &self.published, "topic"),
            "subscribe" | "unsubscribe" => (About::Subscribing, &self.subscribed, "topic"),
            "advertise_service" | "unadvertise_service" | "service_response" => {
                (About::Serving, &self.served, "service")
            }
            // Whatever else there is in this protocol or a later one is not about names that are cut.
            _ => return FromClient::Unchanged,
        };
        let Some(name) = envelope.text(field) else { return refused(id, &format!("`{op}`: `{field}` is missing")) };
        let to = names.get(&absolute(&name)).cloned();
        let changed = to.as_ref().map(|to| {
            // What the client wants for itself is done here: in a piece or a picture no name could be found.
            let own: &[&str] = if op == "subscribe" { &["fragment_size"] } else { &[] };
            let is_picture = op == "subscribe" && envelope.text("compression").as_deref() == Some("png");
            let own = if is_picture { &["fragment_size", "compression"] } else { own };
            envelope.with(field, to, own)
        });
        let said = changed.as_deref().unwrap_or(frame);
        match op.as_str() {
            "advertise" | "subscribe" | "advertise_service"
                if !self.standing.add(about, &absolute(&name), id.clone(), said) =>
            {
                return refused(id, &format!("`{op}`: there is more than a client of this proxy may ask for"));
            }
            "unadvertise" | "unsubscribe" | "unadvertise_service" => {
                self.standing.end(about, &absolute(&name), id.as_deref());
            }
            _ => {}
        }
        match (op.as_str(), to) {
            ("subscribe", Some(to)) => self.hears(to, name, &envelope),
            ("unsubscribe", Some(to)) if !self.standing.has(About::Subscribing, &absolute(&name)) => {
                self.heard.remove(&to);
            }
            ("advertise_service", Some(to)) => {
                self.offered.insert(to, name);
            }
            ("unadvertise_service", Some(to)) => {
                self.offered.remove(&to);
            }
            _ => {}
        }
        match changed {
            Some(changed) => FromClient::Changed(changed),
            None => FromClient::Unchanged,
        }
    }

    /// What pieces or a picture hold, once all are there.
    fn unpacked(&mut self, op: &str, envelope: &Envelope<'_>, id: Option<String>, layer: usize) -> FromClient {
        if layer == LAYERS {
            return refused(id, &format!("`{op}` inside of another one"));
        }
        let Some(data) = envelope.text("data") else { return refused(id, &format!("`{op}`: `data` is missing")) };
        let number = |field| envelope.number(field).map(u32::try_from).transpose();
        let (Ok(num), Ok(total)) = (number("num"), number("total")) else {
            return refused(id, &format!("`{op}`: there are too many pieces"));
        };
        let whole = match (op, num, total) {
            ("png", None, None) => data,
            (_, num, total) => {
                let key = format!("{op} {}", id.as_deref().unwrap_or_default());
                let number = (num.unwrap_or(0), total.unwrap_or(1));
                match self.pieces.take(&key, &data, number, self.limits.pieces) {
                    Ok(Some(whole)) => whole,
                    Ok(None) => return FromClient::Waits,
                    Err(problem) => return refused(id, &problem.to_string()),
                }
            }
        };
        let whole = if op == "png" { png::text(&whole, self.limits.operation) } else { Ok(whole) };
        let whole = match whole {
            Ok(whole) if whole.len() <= self.limits.operation => whole,
            Ok(whole) => return refused(id, &format!("an operation of {} bytes is too long", whole.len())),
            Err(problem) => return refused(id, &problem.to_string()),
        };
        match self.operation(&whole, layer + 1) {
            FromClient::Unchanged => FromClient::Changed(whole),
            other => other,
        }
    }

    fn hears(&mut self, to: String, name: String, envelope: &Envelope<'_>) {
        let fragment_size = envelope.number("fragment_size").map(|size| usize::try_from(size).unwrap_or(usize::MAX));
        let picture = envelope.text("compression").as_deref() == Some("png");
        let new = Heard { name, fragment_size, picture };
        // A client that subscribes twice gets each message once, in the way that asks for more, as from a bridge.
        let heard = match self.heard.get(&to) {
            Some(old) => Heard {
                fragment_size: old.fragment_size.into_iter().chain(new.fragment_size).min(),
                picture: old.picture || new.picture,
                name: new.name,
            },
            None => new,
        };
        self.heard.insert(to, heard);
    }

    /// A text that the bridge sends.
    pub(super) fn bridge_text(&mut self, frame: &str) -> FromBridge {
        if self.heard.is_empty() && self.offered.is_empty() {
            return FromBridge::Unchanged;
        }
        // What is wrong with it is for the client to say.
        let mut copy = None;
        let Ok(envelope) = Envelope::read_marked(frame, &mut copy) else { return FromBridge::Unchanged };
        match envelope.text("op").as_deref() {
            Some("publish") => {
                let heard = envelope.text("topic").and_then(|topic| self.heard.get(&topic));
                let Some(heard) = heard.cloned() else { return FromBridge::Unchanged };
                FromBridge::Texts(self.packed(envelope.with("topic", &heard.name, &[]), &heard))
            }
            Some("call_service") => {
                let offered = envelope.text("service").and_then(|service| self.offered.get(&service));
                let Some(name) = offered else { return FromBridge::Unchanged };
                FromBridge::Texts(vec![envelope.with("service", name, &[])])
            }
            _ => FromBridge::Unchanged,
        }
    }

    /// Bytes that the bridge sends: messages in CBOR.
    pub(super) fn bridge_bytes(&self, frame: &[u8]) -> FromBridge {
        if self.heard.is_empty() {
            return FromBridge::Unchanged;
        }
        let name = |topic: &str| self.heard.get(topic).map(|heard| heard.name.clone());
        replace::text(frame, "topic", name).map_or(FromBridge::Unchanged, FromBridge::Bytes)
    }

    /// A message as a client asked for it.
    fn packed(&mut self, message: String, heard: &Heard) -> Vec<String> {
        let message = if heard.picture {
            let data = png::picture(&message);
            Operation::Png { id: None, data, num: None, total: None }.text()
        } else {
            message
        };
        match heard.fragment_size {
            Some(most) if message.len() > most => {
                self.cut += 1;
                cut(&format!("sesame {}", self.cut), &message, most).iter().map(Operation::text).collect()
            }
            _ => vec![message],
        }
    }
}

/// That something does not go on, for the client.
pub(super) fn refused(id: Option<String>, problem: &str) -> FromClient {
    let msg = format!("the proxy did not pass this on: {problem}");
    FromClient::Refused(Operation::Status { id, level: Level::Error, msg }.text())
}

/// A name as the bridge has it: clients may leave out its first sign.
fn absolute(name: &str) -> String {
    if name.starts_with('/') { name.to_owned() } else { format!("/{name}") }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;
    use serde_json::{Value, json};

    use super::*;
    use crate::reader::Reader;

    fn names() -> Names {
        let of = |from: &str, end: &str| vec![Remapping { from: from.to_owned(), to: format!("{from}/{end}") }];
        Names::new(&Renamed {
            publishes: of("/goal", "from/hmi"),
            subscribes: of("/joints", "to/hmi"),
            serves: of("/grip", "undisturbed"),
        })
    }

    fn changed(names: &mut Names, frame: &Value) -> Value {
        match names.client_text(&frame.to_string()) {
            FromClient::Changed(text) => serde_json::from_str(&text).unwrap(),
            other => panic!("{other:?}"),
        }
    }

    fn said(names: &mut Names, frame: &str) -> String {
        match names.client_text(frame) {
            FromClient::Refused(status) => {
                serde_json::from_str::<Value>(&status).unwrap()["msg"].as_str().unwrap().to_owned()
            }
            other => panic!("{other:?}"),
        }
    }

    #[test]
    fn names_change_where_they_are_cut_and_in_the_direction_that_is_cut() {
        let mut names = names();
        for op in ["advertise", "publish", "unadvertise"] {
            let frame = json!({ "op": op, "topic": "/goal", "type": "a/B", "msg": { "x": 1 } });
            assert_eq!(changed(&mut names, &frame)["topic"], "/goal/from/hmi", "{op}");
            let frame = json!({ "op": op, "topic": "goal", "type": "a/B", "msg": { "x": 1 } });
            assert_eq!(changed(&mut names, &frame)["topic"], "/goal/from/hmi", "{op} of a relative name");
            let other = json!({ "op": op, "topic": "/joints", "type": "a/B", "msg": {} });
            assert_eq!(names.client_text(&other.to_string()), FromClient::Unchanged, "{op}");
        }
        for op in ["subscribe", "unsubscribe"] {
            assert_eq!(changed(&mut names, &json!({ "op": op, "topic": "/joints" }))["topic"], "/joints/to/hmi");
            let other = json!({ "op": op, "topic": "/goal" });
            assert_eq!(names.client_text(&other.to_string()), FromClient::Unchanged, "{op}");
        }
        for op in ["advertise_service", "service_response", "unadvertise_service"] {
            let frame = json!({ "op": op, "service": "/grip", "type": "a/B" });
            assert_eq!(changed(&mut names, &frame)["service"], "/grip/undisturbed", "{op}");
        }
        for op in ["call_service", "set_level", "auth", "advertise_action"] {
            let other = json!({ "op": op, "service": "/grip", "topic": "/goal" });
            assert_eq!(names.client_text(&other.to_string()), FromClient::Unchanged, "{op}");
        }
    }

    #[test]
    fn what_comes_back_has_the_name_that_the_client_gave() {
        let mut names = names();
        let message = json!({ "op": "publish", "topic": "/joints/to/hmi", "msg": { "data": 1 } });
        assert_eq!(names.bridge_text(&message.to_string()), FromBridge::Unchanged, "nobody subscribed");
        changed(&mut names, &json!({ "op": "subscribe", "topic": "joints", "id": "1" }));
        let FromBridge::Texts(texts) = names.bridge_text(&message.to_string()) else { panic!() };
        assert_eq!(texts, [r#"{"msg":{"data":1},"op":"publish","topic":"joints"}"#]);
        let FromBridge::Bytes(bytes) = names.bridge_bytes(&crate::cbor::write(&message)) else { panic!() };
        assert_eq!(crate::cbor::read(&bytes).unwrap()["topic"], "joints");
        assert_eq!(names.bridge_bytes(&[0xff, 0]), FromBridge::Unchanged);
        changed(&mut names, &json!({ "op": "advertise_service", "service": "/grip", "type": "a/B" }));
        let call = json!({ "op": "call_service", "service": "/grip/undisturbed", "id": "7" });
        let FromBridge::Texts(texts) = names.bridge_text(&call.to_string()) else { panic!() };
        assert_eq!(texts, [r#"{"id":"7","op":"call_service","service":"/grip"}"#]);
        changed(&mut names, &json!({ "op": "unsubscribe", "topic": "/joints", "id": "1" }));
        assert_eq!(names.bridge_text(&message.to_string()), FromBridge::Unchanged);
    }

    #[test]
    fn pieces_and_pictures_of_a_client_are_put_together() {
        let mut names = names();
        let publish = json!({ "op": "publish", "topic": "/goal", "msg": { "text": "ä".repeat(300) } }).to_string();
        let picture = Operation::Png { id: None, data: png::picture(&publish), num: None, total: None }.text();
        let pieces = cut("a", &picture, 100);
        let (last, others) = pieces.split_last().unwrap();
        for piece in others {
            assert_eq!(names.client_text(&piece.text()), FromClient::Waits);
        }
        let FromClient::Changed(whole) = names.client_text(&last.text()) else { panic!() };
        let whole: Value = serde_json::from_str(&whole).unwrap();
        assert_eq!((&whole["topic"], &whole["msg"]["text"]), (&json!("/goal/from/hmi"), &json!("ä".repeat(300))));
        let mut nested = publish;
        for _ in 0..3 {
            nested = Operation::Png { id: None, data: png::picture(&nested), num: None, total: None }.text();
        }
        assert_eq!(said(&mut names, &nested), "the proxy did not pass this on: `png` inside of another one");
    }

    #[test]
    fn a_client_gets_pieces_and_pictures_as_it_asked_although_the_bridge_sends_whole_texts() {
        let mut names = names();
        let subscribe = json!({
            "op": "subscribe", "topic": "/joints", "fragment_size": 120, "compression": "png", "throttle_rate": 5,
        });
        let asked = changed(&mut names, &subscribe);
        assert_eq!(asked, json!({ "op": "subscribe", "topic": "/joints/to/hmi", "throttle_rate": 5 }));
        let message = json!({ "op": "publish", "topic": "/joints/to/hmi", "msg": { "data": vec![1.5; 500] } });
        let FromBridge::Texts(texts) = names.bridge_text(&message.to_string()) else { panic!() };
        assert!(texts.len() > 1);
        let mut client = Reader::default();
        let whole = texts.iter().filter_map(|text| client.text(text).unwrap()).next_back();
        let Some(Operation::Publish { topic, msg, .. }) = whole else { panic!("{whole:?}") };
        assert_eq!((topic.as_str(), &msg), ("/joints", &message["msg"]));
        // CBOR is renamed as it is.
        let asked = changed(&mut names, &json!({ "op": "subscribe", "topic": "/joints", "compression": "cbor-raw" }));
        assert_eq!(asked["compression"], "cbor-raw");
    }

    #[test]
    fn what_is_no_operation_does_not_go_on_and_the_client_is_told() {
        let mut names = names();
        let not_json = said(&mut names, "{");
        assert!(not_json.starts_with("the proxy did not pass this on: it is not an operation in JSON: "), "{not_json}");
        assert_eq!(said(&mut names, "{}"), "the proxy did not pass this on: `op` is missing");
        assert_eq!(
            said(&mut names, r#"{"op":"publish","msg":{}}"#),
            "the proxy did not pass this on: `publish`: `topic` is missing"
        );
        assert_eq!(
            said(&mut names, r#"{"op":"fragment","id":"a","num":3,"total":2,"data":""}"#),
            "the proxy did not pass this on: a fragment has number 3 of 2"
        );
    }

    #[test]
    fn what_lasts_is_said_again_under_the_names_of_the_bridge() {
        let mut names = names();
        let subscribe = json!({ "op": "subscribe", "topic": "/joints", "id": "1" });
        let advertise = json!({ "op": "advertise", "topic": "/other", "type": "a/B" });
        names.client_text(&subscribe.to_string());
        names.client_text(&advertise.to_string());
        names.client_text(&json!({ "op": "publish", "topic": "/goal", "msg": {} }).to_string());
        assert_eq!(
            names.standing(),
            [r#"{"id":"1","op":"subscribe","topic":"/joints/to/hmi"}"#, &advertise.to_string()]
        );
    }

    proptest! {
        #[test]
        fn nothing_that_a_client_sends_reaches_a_name_that_is_cut(
            text in any::<String>(), at in any::<prop::sample::Index>(), put in any::<char>(),
        ) {
            let mut names = names();
            let _ = names.client_text(&text);
            let frame = json!({ "op": "publish", "topic": "/goal", "msg": { "data": [1, 2] } }).to_string();
            let mut signs: Vec<char> = frame.chars().collect();
            let place = at.index(signs.len());
            signs[place] = put;
            let mutilated: String = signs.into_iter().collect();
            if names.client_text(&mutilated) == FromClient::Unchanged {
                let value: Value = serde_json::from_str(&mutilated).unwrap();
                prop_assert!(value["op"] != "publish" || value["topic"] != "/goal", "{mutilated}");
            }
        }
    }
}
