//! Where clients of a bridge connect that are one node each.

use std::collections::BTreeMap;

use sesame_plan::{Identity, Proxy, Schemes, SimulatorKind};

use super::Resolver;
use super::bus::is_here;
use super::nodes::node_of_plans;
use crate::diagnostic::{Code, Diagnostic};
use crate::span::Span;
use crate::syntax::ast;

impl<'a> Resolver<'a> {
    pub(super) fn proxies(&mut self, written: &'a [ast::Proxy], kind: SimulatorKind) -> Option<Vec<Proxy>> {
        let mut nodes: BTreeMap<sesame_plan::NodeId, Span> = BTreeMap::new();
        let mut addresses: BTreeMap<&str, Span> = BTreeMap::new();
        let mut proxies = Some(Vec::new());
        for proxy in written {
            let mut resolved = self.proxy(proxy, kind);
            let twice = resolved.as_ref().and_then(|resolved| nodes.insert(resolved.node, proxy.node.span));
            if let Some(first) = twice {
                self.listed_twice(proxy.node.span, first);
                resolved = None;
            }
            if let Some(first) = addresses.insert(&proxy.address.text, proxy.address.span) {
                let title = format!("two proxies listen at `{}`", proxy.address.text);
                let diagnostic = Diagnostic::new(Code::BAD_ADDRESS, proxy.address.span, title)
                    .label("expected another port: by its address a proxy knows which node its clients are")
                    .secondary(first, "first used here");
                self.report(diagnostic);
                resolved = None;
            }
            match (&mut proxies, resolved) {
                (Some(proxies), Some(proxy)) => proxies.push(proxy),
                _ => proxies = None,
            }
        }
        proxies
    }

    fn proxy(&mut self, proxy: &'a ast::Proxy, kind: SimulatorKind) -> Option<Proxy> {
        let node = self.node_named(&proxy.node).map(node_of_plans);
        let address = self.well_formed(&proxy.address, kind);
        let token = self.secret(&proxy.secrets, "token");
        let certificate = self.single(&proxy.certificates, "certificate").map(|file| file.text.clone());
        let key = self.single(&proxy.keys, "key").map(|file| file.text.clone());
        let public = self.single(&proxy.publics, "public").is_some();
        let (scheme, host) = address?;
        let Schemes { encrypted: tls, .. } = kind.properties().address?;
        let encrypted = tls == Some(scheme);
        let has_settings = token.is_some() || certificate.is_some() || key.is_some() || public;
        let problem = if !has_port_alone(&proxy.address.text[scheme.len()..]) {
            Some("expected a host and a port to listen at, and nothing after them")
        } else if tls.is_none() && has_settings {
            Some("whoever is on this machine may connect, and nobody else; remove the settings of the proxy")
        } else if tls.is_none() && !is_here(host) {
            Some("other machines could connect; expected `127.0.0.1`")
        } else if encrypted && (certificate.is_none() || key.is_none()) {
            Some("expected `{ certificate \"FILE\" key \"FILE\" }` after an address of TLS")
        } else if !encrypted && (certificate.is_some() || key.is_some()) {
            Some("expected `wss://` for a proxy with a certificate or a key")
        } else if !is_here(host) && !public {
            Some("other machines could connect; expected `127.0.0.1`, or `public` if they may")
        } else if !is_here(host) && (token.is_none() || !encrypted) {
            Some("other machines may connect; expected `wss://` and a `token` that they have to show")
        } else {
            None
        };
        if let Some(problem) = problem {
            let title = format!("a proxy cannot listen at `{}`", proxy.address.text);
            self.report(Diagnostic::new(Code::BAD_ADDRESS, proxy.address.span, title).label(problem));
            return None;
        }
        let identity = certificate.zip(key).map(|(certificate, key)| Identity { certificate, key });
        Some(Proxy { node: node?, url: proxy.address.text.clone(), token, identity, public })
    }
}

/// Whether an address behind its scheme is a host and a port, without a path.
fn has_port_alone(rest: &str) -> bool {
    let port = rest.rsplit(']').next().unwrap_or_default();
    port.contains(':') && !rest.contains('/')
}
