//! Addresses of brokers.

/// The port of MQTT, and that of MQTT over TLS.
const PORTS: [u16; 2] = [1883, 8883];

/// Where a broker is.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct Address {
    pub(crate) host: String,
    pub(crate) port: u16,
    pub(crate) tls: bool,
}

impl Address {
    /// Reads `mqtt://HOST:PORT`, or `mqtts://HOST:PORT` for TLS; a port may be left out. An error says what is wrong.
    pub(crate) fn read(url: &str) -> Result<Address, String> {
        let (tls, rest) = match (url.strip_prefix("mqtt://"), url.strip_prefix("mqtts://")) {
            (Some(rest), _) => (false, rest),
            (_, Some(rest)) => (true, rest),
            _ => return Err(format!("`{url}` is not the address of a broker; write `mqtt://HOST:PORT`")),
        };
        let rest = rest.trim_end_matches('/');
        let (host, port) = match rest.strip_prefix('[').and_then(|bracketed| bracketed.split_once(']')) {
            Some((host, port)) => (host, port.strip_prefix(':')),
            None => rest.split_once(':').map_or((rest, None), |(host, port)| (host, Some(port))),
        };
        let port = match port {
            None => PORTS[usize::from(tls)],
            Some(text) => text.parse().map_err(|_| format!("`{text}` in `{url}` is not a port"))?,
        };
        if host.is_empty() {
            return Err(format!("`{url}` has no host"));
        }
        Ok(Address { host: host.to_owned(), port, tls })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn addresses_have_a_host_and_perhaps_a_port() {
        let read = |url: &str| Address::read(url).map(|address| (address.host, address.port, address.tls));
        assert_eq!(read("mqtt://127.0.0.1:4000"), Ok(("127.0.0.1".to_owned(), 4000, false)));
        assert_eq!(read("mqtt://fleet"), Ok(("fleet".to_owned(), 1883, false)));
        assert_eq!(read("mqtts://[::1]:9000/"), Ok(("::1".to_owned(), 9000, true)));
        assert_eq!(read("mqtts://[::1]"), Ok(("::1".to_owned(), 8883, true)));
        for bad in ["tcp://a", "mqtt://", "mqtt://a:b", "mqtt://a:70000"] {
            assert!(read(bad).is_err(), "{bad}");
        }
    }
}
