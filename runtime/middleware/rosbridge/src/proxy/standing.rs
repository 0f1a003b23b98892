//! What a client has sent that lasts: it is sent again to a bridge that is found again.

/// The most bytes that are kept for one client.
const MOST: usize = 1 << 20;

/// What something lasting is about.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum About {
    Publishing,
    Subscribing,
    Serving,
}

/// What lasts, in the order in which it was sent.
#[derive(Debug, Default)]
pub(super) struct Standing {
    said: Vec<Said>,
    bytes: usize,
}

#[derive(Debug)]
struct Said {
    about: About,
    name: String,
    id: Option<String>,
    frame: String,
}

impl Standing {
    /// Keeps what was said; what was said before about the same name under the same id is over. False if that is more
    /// than a client may say.
    #[must_use]
    pub(super) fn add(&mut self, about: About, name: &str, id: Option<String>, frame: &str) -> bool {
        self.forget(|said| said.about == about && said.name == name && said.id == id);
        if self.bytes + cost(name, frame) > MOST {
            return false;
        }
        self.bytes += cost(name, frame);
        self.said.push(Said { about, name: name.to_owned(), id, frame: frame.to_owned() });
        true
    }

    /// What was said about a name under this id is over; without one, all about that name.
    pub(super) fn end(&mut self, about: About, name: &str, id: Option<&str>) {
        self.forget(|said| {
            said.about == about && said.name == name && id.is_none_or(|id| said.id.as_deref() == Some(id))
        });
    }

    /// Whether something lasts about a name.
    pub(super) fn has(&self, about: About, name: &str) -> bool {
        self.said.iter().any(|said| said.about == about && said.name == name)
    }

    /// The frames to say again.
    pub(super) fn frames(&self) -> Vec<String> {
        self.said.iter().map(|said| said.frame.clone()).collect()
    }

    fn forget(&mut self, is_over: impl Fn(&Said) -> bool) {
        let bytes = &mut self.bytes;
        self.said.retain(|said| {
            let stays = !is_over(said);
            if !stays {
                *bytes -= cost(&said.name, &said.frame);
            }
            stays
        });
    }
}

/// What it takes to keep something, so that many small things cannot fill the memory.
fn cost(name: &str, frame: &str) -> usize {
    name.len() + frame.len() + 128
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_over_is_not_said_again() {
        let mut standing = Standing::default();
        let id = |id: &str| Some(id.to_owned());
        assert!(standing.add(About::Subscribing, "/a", id("1"), "one"));
        assert!(standing.add(About::Subscribing, "/a", id("2"), "two"));
        assert!(standing.add(About::Publishing, "/a", None, "three"));
        assert!(standing.add(About::Subscribing, "/a", id("1"), "four"), "in place of the first");
        assert_eq!(standing.frames(), ["two", "three", "four"]);
        standing.end(About::Subscribing, "/a", Some("2"));
        assert_eq!(standing.frames(), ["three", "four"]);
        standing.end(About::Subscribing, "/a", None);
        assert_eq!(standing.frames(), ["three"]);
        assert!(standing.has(About::Publishing, "/a") && !standing.has(About::Subscribing, "/a"));
        standing.end(About::Publishing, "/a", Some("other"));
        standing.end(About::Publishing, "/a", None);
        assert_eq!(standing.bytes, 0);
    }

    #[test]
    fn a_client_cannot_fill_the_memory() {
        let mut standing = Standing::default();
        let said = (0..1_000_000).take_while(|at| standing.add(About::Subscribing, "/a", Some(at.to_string()), "x"));
        assert!(said.count() < 10_000);
        standing.end(About::Subscribing, "/a", None);
        assert!(standing.add(About::Subscribing, "/a", None, "x"));
    }
}
