use proptest::prelude::*;

use super::*;

/// A stream that gives what it has in parts, and has nothing for now between them.
struct InParts {
    bytes: Vec<u8>,
    parts: Vec<usize>,
    given: usize,
    left: usize,
}

impl InParts {
    fn of(bytes: &[u8], parts: &[usize]) -> InParts {
        InParts { bytes: bytes.to_vec(), parts: parts.to_vec(), given: 0, left: 0 }
    }
}

impl Read for InParts {
    fn read(&mut self, into: &mut [u8]) -> io::Result<usize> {
        if self.given == self.bytes.len() {
            return Ok(0);
        }
        if self.left == 0 {
            self.left = self.parts.pop().unwrap_or(usize::MAX);
            return Err(io::ErrorKind::WouldBlock.into());
        }
        let count = into.len().min(self.left).min(self.bytes.len() - self.given);
        into[..count].copy_from_slice(&self.bytes[self.given..self.given + count]);
        self.given += count;
        self.left -= count;
        Ok(count)
    }
}

fn heard(stream: &mut InParts) -> Result<Option<String>, ()> {
    let mut greeting = Greeting::default();
    loop {
        match greeting.hear(stream) {
            Ok(None) => {}
            Ok(Some(Hello { token, .. })) => return Ok(token),
            Err(_) => return Err(()),
        }
    }
}

proptest! {
    /// However a greeting comes in parts, it is the one that would have been read in one go, and nothing after it is
    /// taken.
    #[test]
    fn a_greeting_in_parts_is_what_it_is_in_one_go(
        token in proptest::option::of(".{0,300}"),
        follows in proptest::collection::vec(any::<u8>(), 0..50),
        parts in proptest::collection::vec(1usize..40, 0..60),
    ) {
        let mut bytes = Vec::new();
        send(&mut bytes, &Hello { lock_stepped: true, end_limit: Duration::ZERO, token: token.clone() }).unwrap();
        let whole = bytes.len();
        prop_assume!(whole <= 4 + GREETING_LIMIT);
        bytes.extend(follows);
        let mut stream = InParts::of(&bytes, &parts);
        prop_assert_eq!(heard(&mut stream), Ok(token));
        prop_assert_eq!(stream.given, whole);
    }

    /// If other bytes come, no more are read than the longest greeting has, and only a greeting is accepted.
    #[test]
    fn no_more_is_read_than_the_longest_greeting(
        length in prop_oneof![any::<u32>(), 0u32..1100],
        body in proptest::collection::vec(any::<u8>(), 0..2000),
        parts in proptest::collection::vec(1usize..400, 0..60),
    ) {
        let bytes = [&length.to_le_bytes()[..], &body].concat();
        let mut stream = InParts::of(&bytes, &parts);
        let taken = heard(&mut stream);
        prop_assert!(stream.given <= 4 + GREETING_LIMIT);
        let expected = receive::<Hello>(&mut bytes.as_slice());
        let expected = expected.ok().filter(|_| (1..=GREETING_LIMIT).contains(&(length as usize)));
        prop_assert_eq!(taken.ok(), expected.map(|hello| hello.token));
    }
}
