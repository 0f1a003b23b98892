//! Systems whose messages go over a bus: addresses, and what is shown to whoever is there.

use sesame_plan::{Broker, Dialect, Remote};

use super::Resolver;
use crate::diagnostic::{Code, Diagnostic};
use crate::model::Transport;
use crate::syntax::ast::{self, BusKind, Text};

/// How addresses of a kind begin.
struct Schemes {
    plain: &'static str,
    /// Over TLS, if there is such a way.
    encrypted: Option<&'static str>,
    example: &'static str,
}

impl Schemes {
    fn of(kind: BusKind) -> Schemes {
        match kind {
            BusKind::Rosbridge => Schemes { plain: "ws://", encrypted: Some("wss://"), example: "ws://127.0.0.1:9090" },
            BusKind::Ros1 => Schemes { plain: "http://", encrypted: None, example: "http://127.0.0.1:11311" },
            BusKind::Mqtt => {
                Schemes { plain: "mqtt://", encrypted: Some("mqtts://"), example: "mqtt://127.0.0.1:1883" }
            }
        }
    }
}

impl<'a> Resolver<'a> {
    pub(super) fn bus(&mut self, bus: &'a ast::Bus) -> Option<Transport> {
        let address = self.address(&bus.address, bus);
        let clock = self.simulator_clock(&bus.clocks);
        let reset = self.reset_service(&bus.resets);
        let domain = match self.single(&bus.domains, "domain") {
            Some(domain) => self.domain_id(*domain),
            None => Some(0),
        };
        self.single(&bus.types, "types");
        let dialect = self.single(&bus.dialects, "dialect").copied().unwrap_or_default();
        let compression = self.single(&bus.compressions, "compression").copied().unwrap_or_default();
        let quality = self.single(&bus.qualities, "quality").copied().unwrap_or_default();
        let user = self.single(&bus.users, "user").map(|user| user.text.clone());
        let trust = self.single(&bus.trusts, "trust").map(|file| file.text.clone());
        let word = if bus.kind == BusKind::Mqtt { "password" } else { "token" };
        let token = self.single(&bus.secrets, word).map(|secret| match secret {
            ast::Secret::Environment(name) => sesame_plan::Secret::Environment { name: name.text.clone() },
            ast::Secret::File(path) => sesame_plan::Secret::File { path: path.text.clone() },
        });
        if let (Dialect::Ros1, Some((span, _))) = (dialect, bus.domains.first()) {
            let title = "ROS 1 has no domains".to_owned();
            let diagnostic = Diagnostic::new(Code::NOT_ROS, *span, title).label("remove it, or `dialect ros1`");
            self.report(diagnostic);
            return None;
        }
        let remote = Remote { url: address?, token, trust };
        Some(match bus.kind {
            BusKind::Rosbridge => Transport::Rosbridge {
                remote,
                domain: domain?,
                dialect,
                compression,
                clock: clock?,
                reset: reset.ok()?,
            },
            BusKind::Ros1 => Transport::Ros1 { master: remote.url, clock: clock?, reset: reset.ok()? },
            BusKind::Mqtt => Transport::Mqtt { broker: Broker { remote, user }, quality },
        })
    }

    /// The address of a node's own broker, if it has one. An error was reported.
    pub(super) fn broker_of(&mut self, node: &'a ast::Node) -> Result<Option<String>, ()> {
        let Some(written) = self.single(&node.brokers, "broker") else { return Ok(None) };
        match (self.kind(), self.ast_bus()) {
            (_, Some(bus)) if bus.kind == BusKind::Mqtt => self.address(written, bus).map(Some).ok_or(()),
            (Some((kind, simulator)), _) => {
                let title = format!("simulator kind `{kind}` has no brokers");
                let diagnostic = Diagnostic::new(Code::BAD_ADDRESS, written.span, title)
                    .label("only nodes of an `mqtt` simulator have a broker; remove it")
                    .secondary(simulator, "the simulator is declared here");
                self.report(diagnostic);
                Err(())
            }
            (None, _) => Err(()),
        }
    }

    /// An address: its scheme, a host, and a port. A secret goes over plain text on this machine only.
    fn address(&mut self, written: &Text, bus: &ast::Bus) -> Option<String> {
        // An empty text was reported where it was read.
        if written.text.trim().is_empty() {
            return None;
        }
        let Schemes { plain, encrypted, example } = Schemes::of(bus.kind);
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
        let host = scheme.map_or("", |scheme| host(&written.text[scheme.len()..]));
        if let (Some(encrypted), Some((span, _))) = (encrypted, bus.secrets.first())
            && scheme == Some(plain)
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
}

/// What is wrong with an address behind its scheme, if anything is. Placeholders may stand for any part of it.
fn malformed(rest: &str) -> Option<String> {
    if let Some(c) = rest.chars().find(|c| c.is_whitespace() || c.is_control()) {
        return Some(format!("expected a host and a port without `{}`", c.escape_default()));
    }
    if rest.contains('@') {
        return Some(
            "a name or password in an address would be in every log; write `user`, `token` or `password`".into(),
        );
    }
    if host(rest).is_empty() {
        return Some("expected a host after the scheme".to_owned());
    }
    let authority = rest.split('/').next().unwrap_or_default();
    let port = authority.strip_prefix('[').and_then(|it| it.split_once(']')).map_or(authority, |(_, port)| port);
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
fn is_here(host: &str) -> bool {
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
