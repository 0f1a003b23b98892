//! How a client finds its simulator.

use std::time::{Duration, Instant};

use tonic::metadata::{Ascii, MetadataValue};
use tonic::service::Interceptor;
use tonic::transport::{Channel, Endpoint};
use tonic::{Request, Status};

use super::error::{ClientError, root};

/// How long an attempt waits after the one before it.
const PAUSE: Duration = Duration::from_millis(50);

/// Sends a token with each call, if there is one.
#[derive(Debug, Clone)]
pub(super) struct Bearer(Option<MetadataValue<Ascii>>);

impl Bearer {
    pub(super) fn new(url: &str, token: Option<&str>) -> Result<Self, ClientError> {
        let Some(token) = token else { return Ok(Bearer(None)) };
        let mut value: MetadataValue<Ascii> = format!("Bearer {token}").parse().map_err(|_| ClientError::Url {
            url: url.to_owned(),
            reason: "its token has characters that a header cannot have".to_owned(),
        })?;
        value.set_sensitive(true);
        Ok(Bearer(Some(value)))
    }
}

impl Interceptor for Bearer {
    fn call(&mut self, mut request: Request<()>) -> Result<Request<()>, Status> {
        if let Some(value) = &self.0 {
            request.metadata_mut().insert("authorization", value.clone());
        }
        Ok(request)
    }
}

/// The server at a URL. Nothing is connected yet.
pub(super) fn endpoint(url: &str, ca: Option<&[u8]>) -> Result<Endpoint, ClientError> {
    let wrong = |reason: String| ClientError::Url { url: url.to_owned(), reason };
    let endpoint = Endpoint::from_shared(url.to_owned()).map_err(|error| wrong(root(&error)))?;
    match (url.starts_with("https://"), ca) {
        (false, None) => Ok(endpoint),
        (false, Some(_)) => Err(wrong("certificates are for `https://`".to_owned())),
        (true, ca) => over_tls(endpoint, ca).map_err(wrong),
    }
}

#[cfg(feature = "tls")]
fn over_tls(endpoint: Endpoint, ca: Option<&[u8]>) -> Result<Endpoint, String> {
    use tonic::transport::{Certificate, ClientTlsConfig};

    let Some(ca) = ca else {
        return Err("it needs a file with the certificates of the authorities that vouch for it (`trust`)".to_owned());
    };
    let settings = ClientTlsConfig::new().ca_certificate(Certificate::from_pem(ca));
    endpoint.tls_config(settings).map_err(|error| root(&error))
}

#[cfg(not(feature = "tls"))]
fn over_tls(_: Endpoint, _: Option<&[u8]>) -> Result<Endpoint, String> {
    Err("this program was built without TLS: build it with the feature `simlog-tls`".to_owned())
}

/// Connects, trying again until the time is over: what was just launched may not listen yet.
pub(super) async fn connected(url: String, endpoint: Endpoint, within: Duration) -> Result<Channel, ClientError> {
    let began = Instant::now();
    let mut how = "it does not answer".to_owned();
    loop {
        let left = within.saturating_sub(began.elapsed());
        match tokio::time::timeout(left, endpoint.connect()).await {
            Ok(Ok(channel)) => return Ok(channel),
            Ok(Err(error)) => how = root(&error),
            // How an attempt failed before says more.
            Err(_) => {}
        }
        if began.elapsed() + PAUSE >= within {
            return Err(ClientError::Unreachable { url, limit: within, how });
        }
        tokio::time::sleep(PAUSE).await;
    }
}

/// The URL of the next port.
pub(super) fn next_port(url: &str) -> Result<String, ClientError> {
    let next = url.rsplit_once(':').and_then(|(host, port)| {
        let port: u16 = port.trim_end_matches('/').parse().ok()?;
        Some(format!("{host}:{}", port.checked_add(1)?))
    });
    next.ok_or_else(|| ClientError::Url {
        url: url.to_owned(),
        reason: "it names no port after which there is another one for topics".to_owned(),
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn topics_are_on_the_next_port() {
        assert_eq!(next_port("http://localhost:8089").unwrap(), "http://localhost:8090");
        assert!(next_port("http://localhost").is_err() && next_port("http://localhost:65535").is_err());
    }

    #[test]
    fn what_cannot_be_used_is_said() {
        let said = |url: &str, ca: Option<&[u8]>| endpoint(url, ca).unwrap_err().to_string();
        assert!(said("http://a b", None).contains("`http://a b` cannot be used"));
        assert!(said("http://localhost:1", Some(b"")).contains("certificates are for `https://`"));
        assert!(said("https://localhost:1", None).contains("https://localhost:1"));
        assert!(Bearer::new("http://there", Some("a\nb")).unwrap_err().to_string().contains("token"));
    }
}
