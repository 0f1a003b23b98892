//! Systems whose messages go over a bus: addresses, and what is shown to whoever is there.

use sesame_plan::{
    Broker, Dialect, Mqtt, Remote, Ros1, Ros2, Rosbridge, Schemes, Secret, Simlog, SimlogVersion, SimulatorKind,
    WireNames,
};

use super::{Kind, Resolver};
use crate::diagnostic::{Code, Diagnostic};
use crate::model::Transport;
use crate::span::Span;
use crate::syntax::ast::{self, Name, Text};

impl<'a> Resolver<'a> {
    /// A simulator that is neither a part of the runner nor a program with which it talks in lines.
    pub(super) fn on_a_bus(&mut self, name: &Name, written: &'a ast::Transport) -> Option<Transport> {
        match written.kind {
            SimulatorKind::Ros2 => Some(Transport::Ros2(Ros2 { domain: self.first_domain(written)? })),
            SimulatorKind::Rosbridge => self.rosbridge(written),
            SimulatorKind::Ros1 => self.ros1(written),
            SimulatorKind::Mqtt => self.mqtt(written),
            SimulatorKind::Simlog => self.simlog(name, written),
            SimulatorKind::Mavlink => self.mavlink(name, written),
            SimulatorKind::InProcess | SimulatorKind::Process => unreachable!("it is on no bus"),
        }
    }

    /// Nodes of ROS behind a bridge.
    fn rosbridge(&mut self, written: &'a ast::Transport) -> Option<Transport> {
        let settings = &written.settings;
        let remote = self.remote(written, "token");
        let domain = self.first_domain(written);
        let dialect = self.single(&settings.dialects, "dialect").copied().unwrap_or_default();
        let compression = self.single(&settings.compressions, "compression").copied().unwrap_or_default();
        if let (Dialect::Ros1, Some((span, _))) = (dialect, settings.domains.first()) {
            let title = "ROS 1 has no domains".to_owned();
            let diagnostic = Diagnostic::new(Code::NOT_ROS, *span, title).label("remove it, or `dialect ros1`");
            self.report(diagnostic);
            return None;
        }
        Some(Transport::Rosbridge(Rosbridge { remote: remote?, domain: domain?, dialect, compression }))
    }

    /// Nodes of ROS 1.
    fn ros1(&mut self, written: &'a ast::Transport) -> Option<Transport> {
        let master = self.address(written.first_text(), written)?;
        Some(Transport::Ros1(Ros1 { master }))
    }

    /// A system whose messages go over brokers of MQTT.
    fn mqtt(&mut self, written: &'a ast::Transport) -> Option<Transport> {
        let remote = self.remote(written, "password");
        let quality = self.single(&written.settings.qualities, "quality").copied().unwrap_or_default();
        let user = self.single(&written.settings.users, "user").map(|user| user.text.clone());
        let broker = Broker { remote: remote?, user };
        Some(Transport::Mqtt(Mqtt { broker, brokers: Vec::new(), quality }))
    }

    /// Vehicles that speak `MAVLink`, and their ground station.
    fn mavlink(&mut self, name: &Name, written: &'a ast::Transport) -> Option<Transport> {
        let settings = &written.settings;
        let url = self.address(written.first_text(), written);
        let definitions = self.single(&settings.types, "types");
        if definitions.is_none() && !settings.has_errors {
            self.missing(name.span, &name.text, "the definitions of its messages", "types \"common.xml\"");
        }
        if settings.proxies.is_empty() && !settings.has_errors {
            let node = self.declared_or(Kind::Node, "vehicle");
            let example = format!("proxy {node} \"udp://127.0.0.1:14551\"");
            self.missing(name.span, &name.text, "an address to which vehicles send", &example);
            return None;
        }
        let definitions = definitions?.iter().map(|file| file.text.clone()).collect();
        Some(Transport::Mavlink { url: url?, definitions })
    }

    /// Where a bus is, and what it wants to be shown, which the language calls so.
    fn remote(&mut self, written: &'a ast::Transport, secret: &str) -> Option<Remote> {
        let url = self.address(written.first_text(), written);
        let trust = self.single(&written.settings.trusts, "trust").map(|file| file.text.clone());
        let token = self.secret(&written.settings.secrets, secret);
        Some(Remote { url: url?, token, trust })
    }

    /// The address of a node's own broker, if it has one. An error was reported.
    pub(super) fn broker_of(&mut self, node: &'a ast::Node) -> Result<Option<String>, ()> {
        let Some(written) = self.single(&node.brokers, "broker") else { return Ok(None) };
        if let Some((kind, simulator)) = self.without(|kind| kind.brokers) {
            let title = format!("simulator kind `{kind}` has no brokers");
            let diagnostic = Diagnostic::new(Code::BAD_ADDRESS, written.span, title)
                .label("only nodes of an `mqtt` simulator have a broker; remove it")
                .secondary(simulator, "the simulator is declared here");
            self.report(diagnostic);
            return Err(());
        }
        let transport = self.transport().ok_or(())?;
        self.address(written, transport).map(Some).ok_or(())
    }

    /// What is to be shown, if anything.
    pub(super) fn secret(&mut self, secrets: &'a [(Span, ast::Secret)], word: &str) -> Option<Secret> {
        self.single(secrets, word).map(|secret| match secret {
            ast::Secret::Environment(name) => Secret::Environment { name: name.text.clone() },
            ast::Secret::File(path) => Secret::File { path: path.text.clone() },
        })
    }

    /// A simulator that speaks `SimlogAPI`.
    fn simlog(&mut self, name: &Name, written: &'a ast::Transport) -> Option<Transport> {
        const MILLISECOND: u64 = 1_000_000;
        let settings = &written.settings;
        let url = self.address(written.first_text(), written);
        let topics_url = match self.single(&settings.topics, "topics at") {
            Some(address) => self.address(address, written).map(Some).ok_or(()),
            None => Ok(None),
        };
        let step_ns = self.step_of(name, settings);
        let whole = step_ns.is_none_or(|step| step % MILLISECOND == 0);
        if let (false, Some((_, step))) = (whole, settings.steps.first()) {
            let title = format!("`{}` is not a step of SimlogAPI", self.text(step.span));
            let label = "expected whole milliseconds, which the protocol counts in";
            self.report(Diagnostic::new(Code::OUT_OF_RANGE, step.span, title).label(label));
        }
        let protocol =
            match self.single(&settings.protocols, "protocol").map(|protocol| (protocol.value, protocol.span)) {
                None | Some((Some(2), _)) => Some(SimlogVersion::V2),
                Some((Some(3), _)) => Some(SimlogVersion::V3),
                Some((_, span)) => {
                    let title = format!("SimlogAPI has no version `{}`", self.text(span));
                    self.report(Diagnostic::new(Code::OUT_OF_RANGE, span, title).label("expected 2 or 3"));
                    None
                }
            };
        let settle_ns = match self.single(&settings.settles, "settle") {
            Some(settle) => self.step(settle),
            None => Some(5 * MILLISECOND),
        };
        let marker = self.single(&settings.markers, "marker").map(|marker| marker.text.clone());
        let mut names = match protocol? {
            SimlogVersion::V2 => WireNames::default(),
            SimlogVersion::V3 => WireNames::of_version_3(),
        };
        let mut replace = |written: &'a [(Span, Text)], word: &str, name: &mut String| {
            if let Some(text) = self.single(written, word) {
                name.clone_from(&text.text);
            }
        };
        replace(&settings.prefixes, "prefix", &mut names.prefix);
        replace(&settings.cuts, "cut", &mut names.cut);
        replace(&settings.heards, "heard", &mut names.heard);
        replace(&settings.injecteds, "injected", &mut names.injected);
        if let Some(bare) = self.single(&settings.bares, "bare") {
            names.bare = bare.iter().map(|text| text.text.clone()).collect();
        }
        if let (SimlogVersion::V2, Some((span, _))) = (protocol?, settings.topics.first().or(settings.markers.first()))
        {
            let title = "version 2 of SimlogAPI has one server, and no marker".to_owned();
            self.report(Diagnostic::new(Code::BAD_ADDRESS, *span, title).label("remove it, or add `protocol 3`"));
            return None;
        }
        let ca = self.single(&settings.trusts, "trust").map(|file| file.text.clone());
        let (protocol, settle_ns, step_ns) = (protocol?, settle_ns?, step_ns.filter(|_| whole)?);
        let (url, topics_url) = (url?, topics_url.ok()?);
        let cut = Vec::new();
        Some(Transport::Simlog(Simlog { url, topics_url, step_ns, protocol, names, marker, cut, settle_ns, ca }))
    }

    /// An address: its scheme, a host, and a port. A secret goes over plain text on this machine only.
    fn address(&mut self, written: &Text, transport: &ast::Transport) -> Option<String> {
        let Schemes { plain, encrypted, .. } = transport.kind.properties().address?;
        let (scheme, host) = self.well_formed(written, transport.kind)?;
        if let (Some(encrypted), Some((span, _))) = (encrypted, transport.settings.secrets.first())
            && scheme == plain
            && !is_here(host)
        {
            let title = format!("a secret would go to `{host}` in plain text");
            let diagnostic = Diagnostic::new(Code::BAD_ADDRESS, written.span, title)
                .label(format!("expected `{encrypted}` for an address beyond this machine"))
                .secondary(*span, "the secret is named here");
            self.report(diagnostic);
            return None;
        }
        Some(written.text.clone())
    }

    /// The scheme and the host of an address of a kind, which is one that has addresses.
    pub(super) fn well_formed<'t>(
        &mut self,
        written: &'t Text,
        kind: SimulatorKind,
    ) -> Option<(&'static str, &'t str)> {
        // An empty text was reported where it was read.
        if written.text.trim().is_empty() {
            return None;
        }
        let Schemes { plain, encrypted, example } = kind.properties().address?;
        let scheme = [Some(plain), encrypted].into_iter().flatten().find(|scheme| written.text.starts_with(scheme));
        let problem = match scheme {
            None => {
                let schemes = match encrypted {
                    Some(encrypted) => format!("`{plain}` or `{encrypted}`"),
                    None => format!("`{plain}`"),
                };
                Some(format!("expected an address that begins with {schemes}"))
            }
            Some(scheme) => malformed(&written.text[scheme.len()..]),
        };
        if let Some(problem) = problem {
            let title = format!("`{}` is not the address of a simulator of this kind", written.text);
            let diagnostic = Diagnostic::new(Code::BAD_ADDRESS, written.span, title).label(problem);
            self.report(diagnostic.note(format!("for example `\"{example}\"`")));
            return None;
        }
        scheme.map(|scheme| (scheme, host(&written.text[scheme.len()..])))
    }
}

/// What is wrong with an address behind its scheme, if anything is. Placeholders may stand for any part of it.
fn malformed(rest: &str) -> Option<String> {
    if let Some(c) = rest.chars().find(|c| c.is_whitespace() || c.is_control()) {
        return Some(format!("expected a host and a port without `{}`", c.escape_default()));
    }
    if rest.contains('@') {
        return Some(
            "a name or password in an address would be in every log; write `user`, `password` or `token`".into(),
        );
    }
    if host(rest).is_empty() {
        return Some("expected a host after the scheme".to_owned());
    }
    let authority = rest.split('/').next().unwrap_or_default();
    let port =
        authority.strip_prefix('[').and_then(|bracketed| bracketed.split_once(']')).map_or(authority, |(_, port)| port);
    match port.rsplit_once(':').map(|(_, port)| port) {
        Some(port) if !port.contains('{') && !port.parse::<u16>().is_ok_and(|port| port > 0) => {
            Some(format!("`{port}` is not a port; expected a number from 1 to 65535"))
        }
        _ => None,
    }
}

/// The host in an address behind its scheme.
fn host(rest: &str) -> &str {
    let authority = rest.split('/').next().unwrap_or_default();
    match authority.strip_prefix('[') {
        Some(v6) => v6.split(']').next().unwrap_or_default(),
        None => authority.rsplit_once(':').map_or(authority, |(host, _)| host),
    }
}

/// Whether a host is this machine, whatever the network says.
pub(super) fn is_here(host: &str) -> bool {
    host == "localhost" || host.parse::<std::net::IpAddr>().is_ok_and(|address| address.is_loopback())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn addresses_have_a_host_and_perhaps_a_port() {
        for good in ["127.0.0.1:9090", "localhost", "[::1]:9090/path", "robot.local:{port}", "{worker}.lab:1"] {
            assert_eq!(malformed(good), None, "{good}");
        }
        for bad in ["", ":9090", "a b:1", "user:pass@host:1", "host:0", "host:70000", "host:x"] {
            assert!(malformed(bad).is_some(), "{bad}");
        }
    }

    #[test]
    fn only_loopback_is_here() {
        assert!(["127.0.0.1", "127.8.9.1", "::1", "localhost"].into_iter().all(is_here));
        assert!(!["10.0.0.1", "robot", "localhost.example", "0.0.0.0", "{host}"].into_iter().any(is_here));
        assert_eq!(["[::1]:9090", "robot:1/x", "robot"].map(host), ["::1", "robot", "robot"]);
    }
}
