//! What differs in one part of its path, as one group: `/workers/{a,b}/distance`.

use std::collections::BTreeMap;

use sesame_scan::{FoundAction, FoundService, FoundTopic};

/// One that was found, or several as a group.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Line<T> {
    /// The path as it is written.
    pub(super) path: String,
    /// What its name is made of: the path without the part that differs.
    pub(super) name: String,
    /// Those that it stands for, in the order of its members.
    pub(super) of: Vec<T>,
}

/// Whether it is reliable, transient local, latched, retained, and can be cut; and its quality of service.
type Quality = ([Option<bool>; 5], Option<u8>);

/// Folds topics into groups: if they have the same type, publishers, subscribers and quality, and differ in one part of
/// their paths other than the last, which says what is published. Publishers that differ in the same part as their
/// topics, as those of robots in namespaces do, are the same.
pub(super) fn fold<'a>(topics: &[&'a FoundTopic]) -> Vec<Line<&'a FoundTopic>> {
    fold_by(
        topics,
        |topic| topic.path.clone(),
        |topic, part| {
            let nodes = [&topic.publishers, &topic.subscribers].map(|nodes| without(nodes, part));
            (topic.ty.clone(), nodes, quality(topic))
        },
    )
}

/// Folds services into groups in the same way.
pub(super) fn fold_services<'a>(services: &[&'a FoundService]) -> Vec<Line<&'a FoundService>> {
    fold_by(
        services,
        |service| service.path.clone(),
        |service, part| {
            let nodes = [&service.servers, &service.clients].map(|nodes| without(nodes, part));
            (service.ty.clone(), nodes)
        },
    )
}

/// Folds actions into groups in the same way.
pub(super) fn fold_actions<'a>(actions: &[&'a FoundAction]) -> Vec<Line<&'a FoundAction>> {
    fold_by(
        actions,
        |action| action.path.clone(),
        |action, part| {
            let nodes = [&action.servers, &action.clients].map(|nodes| without(nodes, part));
            (action.ty.clone(), nodes)
        },
    )
}

/// Folds things into groups whose paths differ in one part other than the last, and which have in common what `common`
/// says of a thing with this part.
pub(super) fn fold_by<T: Copy, C: Ord>(
    things: &[T],
    path: impl Fn(T) -> String,
    common: impl Fn(T, &str) -> C,
) -> Vec<Line<T>> {
    let paths: Vec<String> = things.iter().map(|&thing| path(thing)).collect();
    let mut groups = BTreeMap::<(Vec<&str>, Vec<&str>, C), Vec<(usize, &str)>>::new();
    for (at, path) in paths.iter().enumerate() {
        let parts: Vec<&str> = path.split('/').collect();
        for differs in (0..parts.len() - 1).filter(|differs| is_member(parts[*differs])) {
            let common = common(things[at], parts[differs]);
            let key = (parts[..differs].to_vec(), parts[differs + 1..].to_vec(), common);
            groups.entry(key).or_default().push((at, parts[differs]));
        }
    }
    let mut groups: Vec<_> = groups.into_iter().filter(|(_, members)| members.len() > 1).collect();
    // What fits into several groups goes into the largest.
    groups.sort_by_key(|(_, members)| std::cmp::Reverse(members.len()));
    let mut lines: BTreeMap<usize, Line<T>> = BTreeMap::new();
    let mut grouped = vec![false; things.len()];
    for ((before, after, _), mut members) in groups {
        members.retain(|(at, _)| !grouped[*at]);
        let [(first, _), _, ..] = members[..] else { continue };
        for (at, _) in &members {
            grouped[*at] = true;
        }
        let differing: Vec<&str> = members.iter().map(|(_, part)| *part).collect();
        let group = format!("{{{}}}", differing.join(","));
        let parts: Vec<&str> = before.iter().copied().chain([group.as_str()]).chain(after.iter().copied()).collect();
        let name: Vec<&str> = before.iter().chain(&after).copied().filter(|part| !part.is_empty()).collect();
        let of = members.iter().map(|(at, _)| things[*at]).collect();
        lines.insert(first, Line { path: parts.join("/"), name: name.join("/"), of });
    }
    for (at, path) in paths.iter().enumerate().filter(|(at, _)| !grouped[*at]) {
        lines.insert(at, Line { path: path.clone(), name: path.clone(), of: vec![things[at]] });
    }
    lines.into_values().collect()
}

/// Names of nodes, in which one part of a path stands for any.
fn without(nodes: &[String], part: &str) -> Vec<String> {
    let generic = |node: &String| {
        let parts: Vec<&str> = node.split('/').map(|of| if of == part { "*" } else { of }).collect();
        parts.join("/")
    };
    nodes.iter().map(generic).collect()
}

/// Whether a part of a path can be written between the braces of a group.
fn is_member(part: &str) -> bool {
    !part.is_empty() && !part.contains(',')
}

fn quality(topic: &FoundTopic) -> Quality {
    let FoundTopic { reliable, transient_local, latching, retained, can_be_cut, .. } = *topic;
    ([reliable, transient_local, latching, retained, can_be_cut], topic.quality)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn topic(path: &str, publisher: &str) -> FoundTopic {
        FoundTopic {
            path: path.to_owned(),
            ty: Some("T".to_owned()),
            publishers: vec![publisher.to_owned()],
            ..FoundTopic::default()
        }
    }

    #[test]
    fn topics_that_differ_in_one_part_are_a_group_if_the_same_nodes_use_them_or_each_has_its_own() {
        let topics = [
            topic("/cell/distance", "cell"),
            topic("/cell/force", "cell"),
            topic("/robots/r1/pose", "cell"),
            topic("/robots/r1/state", "r1"),
            topic("/robots/r2/pose", "cell"),
            topic("/robots/r2/state", "r2"),
            topic("/robots/r3/pose", "cell"),
            topic("/zones/r3/pose", "cell"),
            topic("/zones/r1/level", "/zones/r1/meter"),
            topic("/zones/r2/level", "/zones/r2/meter"),
            topic("/zones/r4/level", "/zones/r5/meter"),
            topic("fleet/a/state", "cell"),
            topic("fleet/b/state", "cell"),
            topic("fleet/c,d/state", "cell"),
            topic("fleet//state", "cell"),
        ];
        let lines = fold(&topics.iter().collect::<Vec<_>>());
        let lines: Vec<(&str, &str, usize)> =
            lines.iter().map(|line| (line.path.as_str(), line.name.as_str(), line.of.len())).collect();
        let expected = [
            ("/cell/distance", "/cell/distance", 1),
            ("/cell/force", "/cell/force", 1),
            ("/robots/{r1,r2,r3}/pose", "robots/pose", 3),
            ("/robots/{r1,r2}/state", "robots/state", 2),
            ("/zones/r3/pose", "/zones/r3/pose", 1),
            ("/zones/{r1,r2}/level", "zones/level", 2),
            ("/zones/r4/level", "/zones/r4/level", 1),
            ("fleet/{a,b}/state", "fleet/state", 2),
            ("fleet/c,d/state", "fleet/c,d/state", 1),
            ("fleet//state", "fleet//state", 1),
        ];
        assert_eq!(lines, expected);
    }
}
