//! Who may call: everybody, or whoever has the token.

use tonic::service::Interceptor;
use tonic::{Request, Status};

/// Lets calls with a token pass, if there is one.
#[derive(Debug, Clone)]
pub(super) struct Bearer(Option<String>);

impl Bearer {
    pub(super) fn new(token: Option<String>) -> Self {
        Bearer(token.map(|token| format!("Bearer {token}")))
    }
}

impl Interceptor for Bearer {
    fn call(&mut self, request: Request<()>) -> Result<Request<()>, Status> {
        let Some(wanted) = &self.0 else { return Ok(request) };
        let given = request.metadata().get("authorization").map_or(&b""[..], |value| value.as_bytes());
        if same(given, wanted.as_bytes()) {
            Ok(request)
        } else {
            Err(Status::unauthenticated("the call does not carry the token of this simulator"))
        }
    }
}

/// Whether two texts are equal, in a time that does not say where they differ.
fn same(left: &[u8], right: &[u8]) -> bool {
    left.len() == right.len() && left.iter().zip(right).fold(0, |differ, (left, right)| differ | (left ^ right)) == 0
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_the_token_passes() {
        let mut guard = Bearer::new(Some("secret".to_owned()));
        let mut call = |given: Option<&'static str>| {
            let mut request = Request::new(());
            if let Some(given) = given {
                request.metadata_mut().insert("authorization", given.parse().unwrap());
            }
            guard.call(request).is_ok()
        };
        assert!(call(Some("Bearer secret")));
        assert!(!call(Some("Bearer secreT")) && !call(Some("secret")) && !call(Some("")) && !call(None));
        assert!(Bearer::new(None).call(Request::new(())).is_ok());
    }
}
