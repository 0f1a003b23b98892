//! Who comes and goes while a run goes on, in words for its notes.
//!
//! Nothing here changes what a run does: it looks at what DDS has announced, and never more often than twice a second
//! of wall time.

use std::collections::{BTreeMap, BTreeSet};
use std::time::{Duration, Instant};

use rustdds::GUID;

use crate::graph::NAMES;

/// How often it is looked who is there while a run goes on.
pub(super) const LOOK: Duration = Duration::from_millis(500);

/// What a node does on a topic or with a service.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub(super) enum Role {
    Publishes,
    Subscribes,
    Serves,
}

/// An endpoint that the space declares: what is done at a wire, and where.
#[derive(Debug, Clone, PartialEq, Eq, PartialOrd, Ord)]
pub(super) struct DeclaredEndpoint {
    pub(super) role: Role,
    /// The name in ROS that the space has for the topic or service.
    pub(super) path: String,
    /// The topic of DDS where this takes place: a topic that is cut has several.
    pub(super) topic: String,
    /// How many the space declares; `None` for as many as there are.
    pub(super) most: Option<usize>,
}

/// Somebody who is such an endpoint.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct Present {
    pub(super) guid: GUID,
    pub(super) declared: DeclaredEndpoint,
    /// The name of its node, as far as its participant has said it.
    pub(super) name: Option<String>,
    /// Whether the name is yet to come.
    pub(super) will_be_named: bool,
}

/// Somebody by what people know of them, who stay the same if they are started again.
type Known = (Role, String, String);

/// What is remembered from one look to the next.
#[derive(Debug, Default)]
pub(super) struct Watch {
    looked: Option<Instant>,
    there: BTreeMap<GUID, Present>,
    /// Who has appeared, and when; until it has a name, or long enough.
    fresh: BTreeMap<GUID, Instant>,
    /// Who was there at the beginning of the first run.
    familiar: BTreeSet<Known>,
    /// Who has come since, without those who came back, in the order in which they came.
    newcomers: Vec<GUID>,
    /// Who has gone and not come back.
    gone: BTreeSet<Known>,
    /// Who is beyond those declared, in a sentence.
    beyond: BTreeMap<GUID, String>,
    /// What was noted in this run.
    said: BTreeSet<String>,
}

impl Watch {
    /// A run begins. Who is there at the beginning of the first one was judged when the system was assembled.
    pub(super) fn begin(&mut self, present: impl FnOnce() -> Vec<Present>) {
        self.said.clear();
        if self.looked.is_none() {
            self.there = present().into_iter().map(|present| (present.guid, present)).collect();
            self.familiar = self.there.values().map(known).collect();
        }
    }

    /// Whether it is time to look.
    pub(super) fn is_due(&self, now: Instant) -> bool {
        self.looked.is_none_or(|looked| now.duration_since(looked) >= LOOK)
    }

    /// Somebody else looked, at this moment.
    pub(super) fn looked(&mut self, now: Instant) {
        self.looked = Some(now);
    }

    /// Forgets whom an operation has taken away.
    pub(super) fn forget(&mut self, gone: impl Fn(GUID) -> bool) {
        self.there.retain(|&guid, _| !gone(guid));
    }

    /// Compares who is there with who was, and gives what is new, each in a sentence and once a run. Of nodes that
    /// operations have stopped or killed it is not said that they have gone.
    pub(super) fn look(&mut self, now: Instant, present: Vec<Present>, absent: &BTreeSet<String>) -> Vec<String> {
        self.looked = Some(now);
        let present: BTreeMap<GUID, Present> = present.into_iter().map(|present| (present.guid, present)).collect();
        let mut notes = Vec::new();
        for earlier in std::mem::take(&mut self.there).into_values() {
            if let Some(now) = present.get(&earlier.guid) {
                // A node that ends takes its name back before its publishers.
                self.there
                    .insert(earlier.guid, Present { name: earlier.name.or_else(|| now.name.clone()), ..now.clone() });
                continue;
            }
            let stays = present.values().any(|other| known(other) == known(&earlier));
            if !stays && earlier.name.as_ref().is_none_or(|name| !absent.contains(name)) {
                self.gone.insert(known(&earlier));
            }
        }
        self.fresh.retain(|guid, _| present.contains_key(guid));
        self.newcomers.retain(|guid| present.contains_key(guid));
        self.beyond.retain(|guid, _| present.contains_key(guid));
        for (&guid, newcomer) in &present {
            if self.there.contains_key(&guid) {
                continue;
            }
            let since = *self.fresh.entry(guid).or_insert(now);
            if newcomer.will_be_named && now.duration_since(since) < NAMES {
                continue;
            }
            self.fresh.remove(&guid);
            if self.gone.remove(&known(newcomer)) {
                notes.push(came_back(&known(newcomer)));
            } else {
                self.newcomers.push(guid);
            }
            self.there.insert(guid, newcomer.clone());
        }
        self.find_those_beyond(&present);
        notes.extend(self.gone.iter().map(has_gone));
        notes.extend(self.beyond.values().cloned());
        notes.retain(|note| self.said.insert(note.clone()));
        notes
    }

    /// Finds who is one too many where more are there than are declared. Newcomers are: nodes with new names before
    /// those with familiar ones, and later ones before earlier ones. A newcomer may have been there before it became
    /// one too many, for example while a declared node was away.
    fn find_those_beyond(&mut self, present: &BTreeMap<GUID, Present>) {
        let mut newcomers: Vec<&Present> = self.newcomers.iter().rev().map(|guid| &present[guid]).collect();
        newcomers.sort_by_key(|newcomer| self.familiar.contains(&known(newcomer)));
        let mut found: BTreeMap<&DeclaredEndpoint, usize> = BTreeMap::new();
        for newcomer in newcomers {
            let declared = &newcomer.declared;
            let Some(most) = declared.most else { continue };
            let there = present.values().filter(|other| other.declared == *declared).count();
            let found = found.entry(declared).or_default();
            if *found < there.saturating_sub(most) {
                *found += 1;
                self.beyond.entry(newcomer.guid).or_insert_with(|| too_many(newcomer, there, most));
            }
        }
    }
}

fn known(Present { guid, declared, name, .. }: &Present) -> Known {
    (declared.role, declared.path.clone(), name.clone().unwrap_or_else(|| format!("participant {:?}", guid.prefix)))
}

fn came_back((role, path, name): &Known) -> String {
    match role {
        Role::Publishes => format!("`{name}` publishes on `{path}` again"),
        Role::Subscribes => format!("`{name}` subscribes to `{path}` again"),
        Role::Serves => format!("`{name}` serves `{path}` again"),
    }
}

fn has_gone((role, path, name): &Known) -> String {
    match role {
        Role::Publishes => format!("`{name}` no longer publishes on `{path}`"),
        Role::Subscribes => format!("`{name}` no longer subscribes to `{path}`"),
        Role::Serves => format!("`{name}` no longer serves `{path}`"),
    }
}

fn too_many(present: &Present, there: usize, most: usize) -> String {
    let (_, _, name) = known(present);
    let path = present.declared.topic.strip_prefix("rt").unwrap_or(&present.declared.topic);
    match most {
        0 => format!("`{name}` publishes on `{path}` past the relay since the run began"),
        1 => format!("`{name}` publishes on `{path}` since the run began: {there} publish there, and 1 is declared"),
        _ => format!(
            "`{name}` publishes on `{path}` since the run began: {there} publish there, and {most} are declared"
        ),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn present(participant: u8, role: Role, name: Option<&str>) -> Present {
        let guid = GUID::from_bytes(std::array::from_fn(|at| if at < 12 { participant } else { role as u8 }));
        let most = (role == Role::Publishes).then_some(1);
        let topic = if role == Role::Publishes { "rt/arm/undisturbed" } else { "rt/arm" };
        let declared = DeclaredEndpoint { role, path: "/arm".to_owned(), topic: topic.to_owned(), most };
        Present { guid, declared, name: name.map(str::to_owned), will_be_named: name.is_none() }
    }

    /// What each look says, one every half a second.
    fn said(first: &[Present], looks: &[(&[Present], &[&str])]) -> Vec<Vec<String>> {
        let (mut watch, mut now) = (Watch::default(), super::super::wall_clock::now());
        watch.begin(|| first.to_vec());
        let look = |(present, absent): &(&[Present], &[&str])| {
            assert!(watch.is_due(now));
            let absent = absent.iter().map(|&name| name.to_owned()).collect();
            let notes = watch.look(now, present.to_vec(), &absent);
            assert!(!watch.is_due(now));
            now += LOOK;
            notes
        };
        looks.iter().map(look).collect()
    }

    #[test]
    fn who_leaves_and_who_returns_is_said_once_by_name_even_if_everything_of_it_is_new() {
        let (arm, ear) = (present(1, Role::Publishes, Some("/arm")), present(2, Role::Subscribes, Some("/ear")));
        let again = present(3, Role::Publishes, Some("/arm"));
        let nameless = present(1, Role::Publishes, None);
        let both = [arm.clone(), ear.clone()];
        let seen =
            said(&both, &[(&both, &[]), (&[nameless, ear.clone()], &[]), (&[ear], &[]), (&[again], &[]), (&[], &[])]);
        let gone = "`/arm` no longer publishes on `/arm`";
        let [none, still, left, returned, last] = &seen[..] else { panic!("{seen:?}") };
        assert_eq!((none.len(), still.len()), (0, 0), "{seen:?}");
        assert_eq!(*left, [gone]);
        assert_eq!(*returned, ["`/arm` publishes on `/arm` again", "`/ear` no longer subscribes to `/arm`"]);
        assert_eq!(last.len(), 0, "it was said: {last:?}");
    }

    #[test]
    fn who_is_replaced_at_once_has_not_left() {
        let first = present(1, Role::Serves, Some("/grip"));
        let next = present(2, Role::Serves, Some("/grip"));
        assert_eq!(said(&[first], &[(&[next], &[])]), [[""; 0]]);
    }

    #[test]
    fn what_an_operation_stops_or_kills_has_not_left() {
        let arm = present(1, Role::Publishes, Some("/arm"));
        let stopped: &[&str] = &["/arm"];
        let seen = said(std::slice::from_ref(&arm), &[(&[], stopped), (&[], &[]), (std::slice::from_ref(&arm), &[])]);
        assert_eq!(seen, [[""; 0]; 3]);

        let mut watch = Watch::default();
        watch.begin(|| vec![arm.clone()]);
        watch.forget(|guid| guid == arm.guid);
        let restarted = present(2, Role::Publishes, Some("/arm"));
        let now = super::super::wall_clock::now();
        assert_eq!(watch.look(now, Vec::new(), &BTreeSet::new()), [""; 0]);
        assert_eq!(watch.look(now, vec![restarted], &BTreeSet::new()), [""; 0]);
    }

    #[test]
    fn who_publishes_beside_those_declared_is_said_as_soon_as_it_has_a_name_or_will_have_none() {
        let arm = present(1, Role::Publishes, Some("/arm"));
        let (fresh, stray) = (present(2, Role::Publishes, None), present(2, Role::Publishes, Some("/stray")));
        let named: Vec<Present> = vec![arm.clone(), stray];
        let nameless: Vec<Present> = vec![arm.clone(), fresh];
        let seen = said(std::slice::from_ref(&arm), &[(&nameless, &[]), (&named, &[]), (&named, &[])]);
        let sentence =
            "`/stray` publishes on `/arm/undisturbed` since the run began: 2 publish there, and 1 is declared";
        assert_eq!(seen, [vec![], vec![sentence.to_owned()], vec![]]);

        let looks_meanwhile = (NAMES.as_millis() / LOOK.as_millis()) as usize;
        let looks: Vec<(&[Present], &[&str])> = vec![(&nameless, &[]); looks_meanwhile + 1];
        let seen = said(&[arm], &looks);
        let (last, awaited) = seen.split_last().expect("it is looked at least once");
        assert!(awaited.iter().all(Vec::is_empty), "{seen:?}");
        assert!(last.len() == 1 && last[0].starts_with("`participant 0202"), "{seen:?}");
    }

    #[test]
    fn who_came_while_a_declared_node_was_away_is_one_too_many_when_that_returns() {
        let (arm, again) = (present(1, Role::Publishes, Some("/arm")), present(3, Role::Publishes, Some("/arm")));
        let stray = present(2, Role::Publishes, Some("/stray"));
        let (alone, both) = ([stray.clone()], [stray, again]);
        let seen = said(&[arm], &[(&alone, &[]), (&both, &[]), (&both, &[])]);
        let sentence =
            "`/stray` publishes on `/arm/undisturbed` since the run began: 2 publish there, and 1 is declared";
        let returned = "`/arm` publishes on `/arm` again";
        assert_eq!(
            seen,
            [
                vec!["`/arm` no longer publishes on `/arm`".to_owned()],
                vec![returned.to_owned(), sentence.to_owned()],
                vec![]
            ]
        );
    }

    #[test]
    fn a_restarted_node_is_not_the_one_too_many_and_a_second_one_of_its_name_is() {
        let [arm, restarted, second] = [1, 2, 4].map(|participant| present(participant, Role::Publishes, Some("/arm")));
        let stray = present(3, Role::Publishes, Some("/stray"));
        let mut watch = Watch::default();
        watch.begin(|| vec![arm.clone()]);
        watch.forget(|guid| guid == arm.guid);
        let mut look = |present: &[&Present]| {
            let present = present.iter().map(|&each| each.clone()).collect();
            watch.look(super::super::wall_clock::now(), present, &BTreeSet::new())
        };
        assert_eq!(look(&[&stray]), [""; 0]);
        let [note] = &look(&[&stray, &restarted])[..] else { panic!("a note is missing") };
        assert!(note.starts_with("`/stray` publishes"), "{note}");
        let notes = look(&[&restarted, &second]);
        assert_eq!(notes[0], "`/stray` no longer publishes on `/arm`");
        assert!(notes[1].starts_with("`/arm` publishes on `/arm/undisturbed` since"), "{notes:?}");
    }

    #[test]
    fn what_lasts_is_said_again_in_the_next_run() {
        let arm = present(1, Role::Publishes, Some("/arm"));
        let (mut watch, now) = (Watch::default(), super::super::wall_clock::now());
        watch.begin(|| vec![arm]);
        let first = watch.look(now, Vec::new(), &BTreeSet::new());
        watch.begin(|| panic!("who was there is known"));
        assert_eq!(first, ["`/arm` no longer publishes on `/arm`"]);
        assert_eq!(watch.look(now + LOOK, Vec::new(), &BTreeSet::new()), first);
    }
}
