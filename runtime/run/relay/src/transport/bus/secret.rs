//! Secrets and certificates, read when they are needed and never shown.

use std::fmt;
use std::path::Path;

use sesame_plan::{Identity, Secret};

use crate::transport::TransportError;

/// The most bytes of a file with a secret or with certificates.
const MOST: u64 = 1 << 20;

/// What a server wants to be shown. It is not printed, not even for debugging.
#[derive(Clone, PartialEq, Eq)]
pub struct Token(String);

impl Token {
    /// Reads a secret; files are relative to this folder.
    pub fn read(secret: &Secret, folder: &Path) -> Result<Token, TransportError> {
        let text = match secret {
            Secret::Environment { name } => std::env::var(name).map_err(|_| {
                wrong(format!("the secret in the environment variable `{name}` is missing; set it and run again"))
            })?,
            Secret::File { path } => {
                let unreadable = |reason: String| wrong(format!("the secret in `{path}` cannot be read: {reason}"));
                let bytes = file(&folder.join(path)).map_err(unreadable)?;
                String::from_utf8(bytes).map_err(|_| unreadable("it is not UTF-8".to_owned()))?
            }
        };
        let text = text.trim_end();
        if text.is_empty() {
            return Err(wrong("the secret of the simulator is empty".to_owned()));
        }
        Ok(Token(text.to_owned()))
    }

    /// The secret itself, for whoever it is shown to.
    pub fn reveal(&self) -> &str {
        &self.0
    }
}

impl fmt::Debug for Token {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("Token(…)")
    }
}

/// The certificates of authorities in a file, relative to this folder.
pub fn trusted(path: &str, folder: &Path) -> Result<Vec<u8>, TransportError> {
    file(&folder.join(path))
        .map_err(|reason| wrong(format!("the trusted certificates in `{path}` cannot be read: {reason}")))
}

/// What a server of ours shows to its clients, from files relative to this folder: its certificate and its key.
pub fn identity(identity: &Identity, folder: &Path) -> Result<(Vec<u8>, Vec<u8>), TransportError> {
    let read = |what: &str, path: &str| {
        file(&folder.join(path)).map_err(|reason| wrong(format!("the {what} in `{path}` cannot be read: {reason}")))
    };
    Ok((read("certificate", &identity.certificate)?, read("key", &identity.key)?))
}

fn file(path: &Path) -> Result<Vec<u8>, String> {
    let metadata = std::fs::metadata(path).map_err(|error| error.to_string())?;
    if !metadata.is_file() {
        return Err("it is not a file".to_owned());
    }
    if metadata.len() > MOST {
        return Err(format!("it has more than {MOST} bytes"));
    }
    std::fs::read(path).map_err(|error| error.to_string())
}

fn wrong(problem: String) -> TransportError {
    TransportError::Wiring(problem)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_secret_is_read_without_the_space_at_its_end_and_never_shown() {
        let folder = tempfile::tempdir().unwrap();
        std::fs::write(folder.path().join("token"), "s3cret \n").unwrap();
        let token = Token::read(&Secret::File { path: "token".to_owned() }, folder.path()).unwrap();
        assert_eq!(token.reveal(), "s3cret");
        assert_eq!(format!("{token:?}"), "Token(…)");
    }

    #[test]
    fn a_secret_that_is_not_there_is_an_error_with_its_place() {
        let folder = tempfile::tempdir().unwrap();
        std::fs::write(folder.path().join("empty"), "\n").unwrap();
        let said = |secret: Secret| Token::read(&secret, folder.path()).unwrap_err().to_string();
        let named = |name: &str| Secret::Environment { name: name.to_owned() };
        assert_eq!(
            said(named("SESAME_NO_SUCH_SECRET")),
            "the secret in the environment variable `SESAME_NO_SUCH_SECRET` is missing; set it and run again"
        );
        assert!(said(Secret::File { path: "none".to_owned() }).starts_with("the secret in `none` cannot be read: "));
        assert_eq!(said(Secret::File { path: "empty".to_owned() }), "the secret of the simulator is empty");
        assert_eq!(said(Secret::File { path: ".".to_owned() }), "the secret in `.` cannot be read: it is not a file");
    }
}
