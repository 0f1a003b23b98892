//! How a broker is reached: who vouches for it, who logs in, and whether it is one that keeps streams.

use std::path::PathBuf;
use std::time::Duration;

use async_nats::jetstream::{self, Context};
use async_nats::{Client, ConnectErrorKind, ConnectOptions, ServerAddr};
use tokio::runtime::{Builder, Runtime};

use super::{LOST, PATIENCE, is_missing};
use crate::queue::{QueueError, without_secrets};

/// The oldest version of the broker whose answers this client reads.
const OLDEST: [u32; 2] = [2, 10];

/// How long a broken connection rests before the next try.
const RECONNECT: Duration = Duration::from_millis(200);

/// How a broker is reached, in addition to its URL.
#[derive(Debug, Clone, Default)]
pub struct Access {
    /// A file of credentials, as NATS writes them.
    pub credentials: Option<PathBuf>,
    /// A file of certificates in PEM of those who vouch for the broker, in place of those that the system trusts.
    pub certificates: Option<PathBuf>,
}

/// A connection to a broker that keeps streams.
pub(super) struct Connection {
    /// Where it is, without secrets.
    pub(super) place: String,
    /// What the connection runs on.
    pub(super) runtime: Runtime,
    pub(super) client: Client,
    pub(super) context: Context,
}

/// Connects to a broker, for example at `nats://127.0.0.1:4222`. It must be there now; a connection that breaks
/// later is made again.
pub(super) fn connect(url: &str, access: &Access) -> Result<Connection, QueueError> {
    let place = without_secrets(url);
    let refused = |reason: String| QueueError::Refused { place: place.clone(), reason };
    let runtime = Builder::new_multi_thread()
        .worker_threads(1)
        .thread_name("nats")
        .enable_all()
        .build()
        .map_err(|error| refused(error.to_string()))?;
    let mut options = ConnectOptions::new()
        .name("sesame")
        .max_reconnects(None)
        .connection_timeout(PATIENCE)
        .request_timeout(Some(PATIENCE))
        .ping_interval(LOST)
        .reconnect_delay_callback(|_| RECONNECT);
    let address: ServerAddr =
        url.parse().map_err(|error| refused(format!("this is not the URL of a broker: {error}")))?;
    if let (Some(user), Some(password)) = (address.username(), address.password()) {
        options = options.user_and_password(user.to_owned(), password.to_owned());
    }
    if let Some(file) = &access.certificates {
        options = options.add_root_certificates(file.clone()).require_tls(true);
    }
    if let Some(file) = &access.credentials {
        let text = std::fs::read_to_string(file).map_err(|error| refused(format!("{}: {error}", file.display())))?;
        options = options.credentials(&text).map_err(|error| refused(format!("{}: {error}", file.display())))?;
    }
    let client = runtime.block_on(options.connect(address)).map_err(|error| match error.kind() {
        ConnectErrorKind::Io | ConnectErrorKind::TimedOut | ConnectErrorKind::Dns => {
            QueueError::Unreachable { place: place.clone(), reason: error.to_string() }
        }
        _ => refused(error.to_string()),
    })?;
    let connected = runtime.block_on(async {
        let mut context = jetstream::new(client.clone());
        context.set_timeout(PATIENCE);
        let version = client.server_info().version;
        if !is_recent(&version) {
            let [major, minor] = OLDEST;
            return Err(format!("it is version {version} of NATS: at least {major}.{minor} is needed"));
        }
        // Whether it keeps streams at all: then it says that it has none of this name.
        if let Err(error) = context.get_stream("sesame-none").await
            && !is_missing(&error.kind())
        {
            return Err(format!("it keeps no streams: start it with `nats-server --jetstream` ({error})"));
        }
        Ok(context)
    });
    let context = connected.map_err(refused)?;
    Ok(Connection { place, runtime, client, context })
}

/// Whether a version such as `2.15.1` is not older than [`OLDEST`].
fn is_recent(version: &str) -> bool {
    let mut numbers = version.split('.').map(|number| number.parse::<u32>().unwrap_or(0));
    [numbers.next().unwrap_or(0), numbers.next().unwrap_or(0)] >= OLDEST
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn versions_are_compared_number_by_number() {
        for (version, recent) in [("2.15.1", true), ("2.10.0", true), ("2.9.10", false), ("3.0.0", true), ("", false)] {
            assert_eq!(is_recent(version), recent, "{version}");
        }
    }
}
