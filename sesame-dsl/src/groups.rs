//! Groups: a path that stands for several, `/{r1,r2}/odom`, and which member of one belongs to which of another.

use std::collections::HashSet;
use std::hash::Hash;

/// The most members of a group in a path with several pairs of braces, whose members multiply.
const MOST_MEMBERS: usize = 10_000;

/// One of the paths that a path stands for.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Expanded {
    /// The path.
    pub path: String,
    /// The name of the member: what its braces were replaced with, joined by `/`; empty where there are no braces.
    pub name: String,
    /// For each pair of braces, where the part of the path with it ends.
    ends: Vec<usize>,
}

impl Expanded {
    /// A path without braces, which stands for itself.
    pub fn one(path: &str) -> Self {
        Expanded { path: path.to_owned(), name: String::new(), ends: Vec::new() }
    }

    /// The beginning of the path up to the part with this pair of braces.
    fn beginning(&self, braces: usize) -> &str {
        self.path[..self.ends[braces]].trim_start_matches('/')
    }
}

/// Which members of a group belong to the node of this name: those whose paths begin like the name, up to the part with
/// the braces. `/r1/vehicle` has `/r1/odom` of `/{r1,r2}/odom`. Braces of which no member begins like it say nothing.
/// `None` if none of them does.
pub fn own_members(members: &[Expanded], node: &str) -> Option<Vec<u32>> {
    let node = node.trim_start_matches('/');
    let begins =
        |beginning: &str| node.strip_prefix(beginning).is_some_and(|rest| rest.is_empty() || rest.starts_with('/'));
    let braces = members.first()?.ends.len();
    let deciding: Vec<usize> =
        (0..braces).filter(|&at| members.iter().any(|member| begins(member.beginning(at)))).collect();
    if deciding.is_empty() {
        return None;
    }
    let own = |member: &Expanded| deciding.iter().all(|&at| begins(member.beginning(at)));
    Some((0u32..).zip(members).filter(|(_, member)| own(member)).map(|(at, _)| at).collect())
}

/// Writes out a path with groups, `zones/{A,B}/level`: the last pair of braces varies first. The error says why it is
/// not a path: blanks, braces without a partner, members that are empty or twice, or too many of them.
pub fn expand(path: &str) -> Result<Vec<Expanded>, String> {
    if let Some(c) = path.chars().find(|c| c.is_whitespace() || c.is_control()) {
        return Err(format!("a path cannot contain {}", if c == ' ' { "spaces".to_owned() } else { format!("{c:?}") }));
    }
    let mut expanded = vec![Expanded { path: String::new(), name: String::new(), ends: Vec::new() }];
    let mut rest = path;
    loop {
        let (literal, group) = match rest.split_once('{') {
            Some((literal, group)) => (literal, Some(group)),
            None => (rest, None),
        };
        if literal.contains('}') {
            return Err("`}` without a matching `{`".to_owned());
        }
        for member in &mut expanded {
            member.path.push_str(literal);
        }
        let Some(group) = group else { break };
        let Some((group, after)) = group.split_once('}') else { return Err("the group is not closed".to_owned()) };
        if group.contains('{') {
            return Err("a group cannot contain another group".to_owned());
        }
        let members: Vec<&str> = group.split(',').collect();
        if members.contains(&"") {
            return Err("the group has an empty member".to_owned());
        }
        if let Some(member) = first_twice(&members) {
            return Err(format!("the group lists `{member}` twice"));
        }
        let count = expanded.len().saturating_mul(members.len());
        if expanded.len() > 1 && count > MOST_MEMBERS {
            return Err(format!("the groups have {count} members together, but the limit is {MOST_MEMBERS}"));
        }
        let with = |before: &Expanded, member: &&str| {
            let mut ends = before.ends.clone();
            let path = format!("{}{member}", before.path);
            ends.push(path.len());
            let name = if before.name.is_empty() { (*member).to_owned() } else { format!("{}/{member}", before.name) };
            Expanded { path, name, ends }
        };
        expanded = expanded.iter().flat_map(|before| members.iter().map(move |member| with(before, member))).collect();
        rest = after;
    }
    // A part of a path ends at the next `/`.
    for member in &mut expanded {
        for end in &mut member.ends {
            *end += member.path[*end..].find('/').unwrap_or(member.path.len() - *end);
        }
    }
    let mut paths = HashSet::with_capacity(expanded.len());
    match expanded.iter().find(|member| !paths.insert(member.path.as_str())) {
        Some(twice) => Err(format!("the groups lead to `{}` twice", twice.path)),
        None => Ok(expanded),
    }
}

/// The first member that occurs a second time.
fn first_twice<T: Hash + Eq>(members: &[T]) -> Option<&T> {
    let mut known = HashSet::with_capacity(members.len());
    members.iter().find(|&member| !known.insert(member))
}

#[cfg(test)]
mod tests {
    use std::cell::Cell;
    use std::hash::{Hash, Hasher};

    use super::{expand, first_twice, own_members};

    /// A member that counts how often it is compared.
    struct Counted<'a>(usize, &'a Cell<usize>);

    impl PartialEq for Counted<'_> {
        fn eq(&self, other: &Self) -> bool {
            self.1.set(self.1.get() + 1);
            self.0 == other.0
        }
    }

    impl Eq for Counted<'_> {}

    impl Hash for Counted<'_> {
        fn hash<H: Hasher>(&self, state: &mut H) {
            self.0.hash(state);
        }
    }

    #[test]
    fn work_on_a_group_grows_with_its_members_and_not_with_their_square() {
        let compared = Cell::new(0);
        let count = 100_000;
        let mut members: Vec<Counted<'_>> = (0..count).map(|n| Counted(n, &compared)).collect();
        assert!(first_twice(&members).is_none());
        members.push(Counted(7, &compared));
        assert_eq!(first_twice(&members).map(|member| member.0), Some(7));
        assert!(compared.get() < count, "{} comparisons", compared.get());
    }

    fn paths(path: &str) -> Vec<(String, String)> {
        expand(path).unwrap().into_iter().map(|member| (member.path, member.name)).collect()
    }

    fn pairs(pairs: &[(&str, &str)]) -> Vec<(String, String)> {
        pairs.iter().map(|&(path, name)| (path.to_owned(), name.to_owned())).collect()
    }

    #[test]
    fn groups_are_written_out_in_order() {
        assert_eq!(paths("a/{Z2,Z1}/x"), pairs(&[("a/Z2/x", "Z2"), ("a/Z1/x", "Z1")]));
        assert_eq!(paths("/plain"), pairs(&[("/plain", "")]));
        assert_eq!(paths("{one}"), pairs(&[("one", "one")]));
        let two = [("acme/1/state", "acme/1"), ("acme/2/state", "acme/2"), ("bolt/1/state", "bolt/1")];
        assert_eq!(paths("{acme,bolt}/{1,2}/state")[..3], pairs(&two));
        assert_eq!(paths("{acme/1,bolt/7}/state"), pairs(&[("acme/1/state", "acme/1"), ("bolt/7/state", "bolt/7")]));
    }

    #[test]
    fn malformed_groups_are_refused() {
        let many = format!("{{{}}}/{{{}}}", (0..101).map(|n| n.to_string()).collect::<Vec<_>>().join(","), {
            (0..100).map(|n| n.to_string()).collect::<Vec<_>>().join(",")
        });
        let twice = "{a,ab}{bc,c}";
        let wrong = ["a b", "a/{", "a/}", "}{", "{a,}", "{}", "{a,a}", "{a{b}}", "a\tb", "{a}/{b,b}", twice, &many];
        for path in wrong {
            assert!(expand(path).is_err(), "{path}");
        }
    }

    #[test]
    fn a_node_has_the_members_whose_paths_begin_like_its_name() {
        let own = |group: &str, node: &str| own_members(&expand(group).unwrap(), node);
        assert_eq!(own("/{r1,r2}/odom", "/r2/vehicle"), Some(vec![1]));
        assert_eq!(own("/{r1,r2}/odom", "r1"), Some(vec![0]));
        assert_eq!(own("/{r1,r2}/odom", "/r12/vehicle"), None);
        assert_eq!(own("/{r1,r2}/odom", "/fleet"), None);
        assert_eq!(own("/robot{1,2}/odom", "/robot2/vehicle"), Some(vec![1]));
        assert_eq!(own("/robot{1,2}_a/odom", "/robot2_a/vehicle"), Some(vec![1]));
        assert_eq!(own("/odom/{r1,r2}", "/r1/vehicle"), None, "it may be of the robot, and it may be about it");
        assert_eq!(own("/zones/{1,2}/level", "/robots/1/driver"), None);
        assert_eq!(own("{acme,bolt}/{1,2}/state", "bolt/2/agv"), Some(vec![3]));
        assert_eq!(own("{acme,bolt}/{1,2}/state", "acme/manager"), Some(vec![0, 1]));
        assert_eq!(own("/odom", "/odom"), None);
    }
}
