//! Who is there is looked at again and again; a master that forgot the node is told of it again.

use std::sync::Arc;
use std::time::{Duration, Instant};

use super::lock::lock;
use super::publication::Publication;
use super::service::Service;
use super::shared::Shared;
use super::subscription::Subscription;
use crate::master::{AskError, State, nodes};

/// How often the master is asked.
const EVERY: Duration = Duration::from_millis(250);

/// Asks the master until the node ends.
pub(super) fn watch(shared: &Arc<Shared>) {
    while !shared.stop.is_set() {
        match shared.look() {
            Ok(state) => {
                let mut seen = lock(&shared.seen);
                if seen.silent_since.take().is_some() {
                    shared.note(format!("the master at `{}` answers again", shared.master.at));
                }
                seen.state = Some(state);
            }
            Err(error) => {
                let mut seen = lock(&shared.seen);
                if seen.silent_since.is_none() && !shared.stop.is_set() {
                    seen.silent_since = Some(Instant::now());
                    shared.note(error.to_string());
                }
            }
        }
        shared.pause(EVERY);
    }
}

impl Shared {
    /// Asks the master who is there, and tells it what it does not know.
    fn look(self: &Arc<Self>) -> Result<State, AskError> {
        let state = self.master.state()?;
        let is_known = |side: &[(String, Vec<String>)], name: &str| nodes(side, name).contains(&self.name);
        let is_forgotten = {
            let (subscriptions, publications, services) =
                (lock(&self.subscriptions), lock(&self.publications), lock(&self.services));
            !subscriptions.iter().all(|subscription| is_known(&state.subscribers, &subscription.topic))
                || !publications
                    .iter()
                    .all(|publication| publication.offer.is_none() || is_known(&state.publishers, &publication.topic))
                || !services.iter().all(|service| service.offer.is_none() || is_known(&state.servers, &service.path))
        };
        if is_forgotten {
            self.subscribe_again()?;
            self.offer_again()?;
            self.serve_again()?;
        }
        self.offer_services(&|server| !nodes(&state.servers, server).is_empty())?;
        Ok(state)
    }

    /// What the master knows; `None` until it has answered.
    pub(crate) fn state(&self) -> Option<State> {
        lock(&self.seen).state.clone()
    }

    /// How long the master has not answered.
    pub(crate) fn silent_for(&self) -> Duration {
        lock(&self.seen).silent_since.map_or(Duration::ZERO, |since| since.elapsed())
    }

    /// Looks at a subscription.
    pub(crate) fn with_subscription<T>(&self, at: usize, look: impl FnOnce(&Subscription) -> T) -> T {
        look(&lock(&self.subscriptions)[at])
    }

    /// Looks at a publication.
    pub(crate) fn with_publication<T>(&self, at: usize, look: impl FnOnce(&Publication) -> T) -> T {
        look(&lock(&self.publications)[at])
    }

    /// Looks at a service.
    pub(crate) fn with_service<T>(&self, at: usize, look: impl FnOnce(&Service) -> T) -> T {
        look(&lock(&self.services)[at])
    }
}
