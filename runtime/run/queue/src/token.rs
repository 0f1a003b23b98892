//! The secret that a supervisor and its agents share, and what is signed with it.

use std::fmt;

use hmac::{Hmac, KeyInit as _, Mac as _};
use serde::Serialize;
use serde::de::DeserializeOwned;
use sha2::Sha256;

/// The bytes of a token, and of a signature.
const LENGTH: usize = 32;

/// A secret of 256 bits. Who has it may have agents run programs, and may say what came of tests.
#[derive(Clone, PartialEq, Eq)]
pub struct Token([u8; LENGTH]);

/// Why bytes are not what they claim to be.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum SealError {
    /// It was signed with another token, or changed on its way.
    #[error("it is signed with another token")]
    OtherToken,
    /// It is signed and says something else than is expected here.
    #[error("it cannot be read: {0}")]
    Unreadable(String),
}

/// What is signed. A signature of one kind is none of another.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Kind {
    /// A campaign with all that its agents run.
    Announcement,
    /// A test on its way to an agent.
    Work,
    /// What came of a test.
    Ended,
    /// An agent that is there.
    Presence,
    /// The supervisor of a campaign that is there.
    Supervision,
}

impl Kind {
    fn word(self) -> &'static [u8] {
        match self {
            Kind::Announcement => b"announcement",
            Kind::Work => b"work",
            Kind::Ended => b"ended",
            Kind::Presence => b"presence",
            Kind::Supervision => b"supervision",
        }
    }
}

impl Token {
    /// A fresh one, of the system's random numbers. The error says why there are none.
    pub fn random() -> Result<Self, String> {
        let mut bytes = [0; LENGTH];
        getrandom::fill(&mut bytes).map_err(|error| error.to_string())?;
        Ok(Token(bytes))
    }

    /// Reads a token as [`Token::text`] writes it; white space around it does not matter.
    pub fn read(text: &str) -> Option<Self> {
        from_hex(text.trim()).map(Token)
    }

    /// Its 64 hexadecimal digits.
    pub fn text(&self) -> String {
        hex(&self.0)
    }

    fn mac(&self, kind: Kind, campaign: &str, body: &[u8]) -> Hmac<Sha256> {
        let mut mac = Hmac::<Sha256>::new_from_slice(&self.0).expect("a key may have any length");
        // Lengths, so that nothing can be moved from one part to the next.
        for part in [kind.word(), campaign.as_bytes(), body] {
            mac.update(&(part.len() as u64).to_le_bytes());
            mac.update(part);
        }
        mac
    }

    /// A message as bytes, signed for this campaign (empty for none): the signature in hexadecimal digits, a line
    /// break, and the message as JSON.
    pub fn seal(&self, kind: Kind, campaign: &str, message: &impl Serialize) -> Vec<u8> {
        let body = serde_json::to_vec(message).expect("messages are JSON");
        let mut sealed = hex(&self.mac(kind, campaign, &body).finalize().into_bytes()).into_bytes();
        sealed.push(b'\n');
        sealed.extend_from_slice(&body);
        sealed
    }

    /// Reads what [`Token::seal`] wrote with the same token, for the same campaign.
    pub fn open<T: DeserializeOwned>(&self, kind: Kind, campaign: &str, sealed: &[u8]) -> Result<T, SealError> {
        let split = sealed.iter().position(|&byte| byte == b'\n').ok_or(SealError::OtherToken)?;
        let (signature, body) = (&sealed[..split], &sealed[split + 1..]);
        let signature = std::str::from_utf8(signature).ok().and_then(from_hex::<LENGTH>);
        let signature = signature.ok_or(SealError::OtherToken)?;
        self.mac(kind, campaign, body).verify_slice(&signature).map_err(|_| SealError::OtherToken)?;
        serde_json::from_slice(body).map_err(|error| SealError::Unreadable(error.to_string()))
    }
}

impl fmt::Debug for Token {
    fn fmt(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        out.write_str("Token")
    }
}

/// Bytes as hexadecimal digits.
pub(crate) fn hex(bytes: &[u8]) -> String {
    let digit = |digit: u8| char::from_digit(u32::from(digit), 16).expect("it is below 16");
    bytes.iter().flat_map(|byte| [digit(byte >> 4), digit(byte & 15)]).collect()
}

fn from_hex<const N: usize>(text: &str) -> Option<[u8; N]> {
    let digits = text.as_bytes();
    if digits.len() != 2 * N {
        return None;
    }
    let mut bytes = [0; N];
    for (byte, pair) in bytes.iter_mut().zip(digits.chunks(2)) {
        let digit = |at: usize| char::from(pair[at]).to_digit(16);
        *byte = u8::try_from(digit(0)? * 16 + digit(1)?).ok()?;
    }
    Some(bytes)
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    #[test]
    fn a_token_is_read_as_it_is_written_and_never_shown() {
        let token = Token::random().unwrap();
        assert_eq!(Token::read(&format!(" {}\n", token.text())), Some(token.clone()));
        assert_ne!(Token::random().unwrap(), token);
        assert_eq!(format!("{token:?}"), "Token");
        for wrong in ["", "00", "zz", &"é".repeat(32), &token.text()[1..], &format!("{}0", token.text())] {
            assert_eq!(Token::read(wrong), None, "{wrong}");
        }
    }

    #[test]
    fn what_is_signed_is_read_only_with_its_token_as_its_kind_and_for_its_campaign() {
        let (token, other) = (Token::random().unwrap(), Token::random().unwrap());
        let sealed = token.seal(Kind::Work, "a", &7);
        assert_eq!(token.open(Kind::Work, "a", &sealed), Ok(7));
        assert_eq!(other.open::<u32>(Kind::Work, "a", &sealed), Err(SealError::OtherToken));
        assert_eq!(token.open::<u32>(Kind::Ended, "a", &sealed), Err(SealError::OtherToken));
        assert_eq!(token.open::<u32>(Kind::Work, "b", &sealed), Err(SealError::OtherToken));
        assert!(matches!(token.open::<String>(Kind::Work, "a", &sealed), Err(SealError::Unreadable(_))));
    }

    proptest! {
        #[test]
        fn no_change_of_a_byte_and_no_other_bytes_pass(at in any::<prop::sample::Index>(), change in 1u8..) {
            let token = Token([7; LENGTH]);
            let mut sealed = token.seal(Kind::Ended, "campaign", &"what came of it");
            let at = at.index(sealed.len());
            sealed[at] ^= change;
            let opened = token.open::<String>(Kind::Ended, "campaign", &sealed);
            // A digit of the signature may be written as a capital letter.
            prop_assert!(opened.is_err() || at < 2 * LENGTH && change == 0x20, "{opened:?}");
            prop_assert!(token.open::<String>(Kind::Ended, "campaign", &sealed[..at]).is_err());
        }
    }
}
