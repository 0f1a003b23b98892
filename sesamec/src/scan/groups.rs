//! Topics that differ in one part of their paths, as one group: `/workers/{a,b}/distance`.

use std::collections::BTreeMap;

use sesame_scan::FoundTopic;

/// A topic of the space: one that was found, or several.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Line<'a> {
    /// The path as it is written.
    pub(super) path: String,
    /// What its name is made of: the path without the part that differs.
    pub(super) name: String,
    /// Those that it stands for.
    pub(super) topics: Vec<&'a FoundTopic>,
}

/// What the members of a group have in common: the parts before and after the one that differs, the type, who
/// publishes and who subscribes, and with which quality.
type Common<'a> = (Vec<&'a str>, Vec<&'a str>, Option<&'a str>, &'a [String], &'a [String], Quality);

/// Whether it is reliable, transient local, latched, retained, and can be cut; and its quality of service.
type Quality = ([Option<bool>; 5], Option<u8>);

/// Folds topics into groups: if they have the same type, publishers, subscribers and quality, and differ in one part of
/// their paths other than the last, which says what is published.
pub(super) fn fold<'a>(topics: &[&'a FoundTopic]) -> Vec<Line<'a>> {
    let mut groups = BTreeMap::<Common<'a>, Vec<(usize, &'a str)>>::new();
    for (at, topic) in topics.iter().enumerate() {
        let parts: Vec<&str> = topic.path.split('/').collect();
        for differs in (0..parts.len() - 1).filter(|differs| is_member(parts[*differs])) {
            let common = (
                parts[..differs].to_vec(),
                parts[differs + 1..].to_vec(),
                topic.ty.as_deref(),
                topic.publishers.as_slice(),
                topic.subscribers.as_slice(),
                quality(topic),
            );
            groups.entry(common).or_default().push((at, parts[differs]));
        }
    }
    let mut groups: Vec<_> = groups.into_iter().filter(|(_, members)| members.len() > 1).collect();
    // A topic that fits into several goes into the largest.
    groups.sort_by_key(|(_, members)| std::cmp::Reverse(members.len()));
    let mut lines: BTreeMap<usize, Line<'a>> = BTreeMap::new();
    let mut grouped = vec![false; topics.len()];
    for ((before, after, ..), mut members) in groups {
        members.retain(|(at, _)| !grouped[*at]);
        let [(first, _), _, ..] = members[..] else { continue };
        for (at, _) in &members {
            grouped[*at] = true;
        }
        let differing: Vec<&str> = members.iter().map(|(_, part)| *part).collect();
        let group = format!("{{{}}}", differing.join(","));
        let parts: Vec<&str> = before.iter().copied().chain([group.as_str()]).chain(after.iter().copied()).collect();
        let path = parts.join("/");
        let name: Vec<&str> = before.iter().chain(&after).copied().filter(|part| !part.is_empty()).collect();
        let name = name.join("/");
        lines.insert(first, Line { path, name, topics: members.iter().map(|(at, _)| topics[*at]).collect() });
    }
    for (at, topic) in topics.iter().enumerate().filter(|(at, _)| !grouped[*at]) {
        lines.insert(at, Line { path: topic.path.clone(), name: topic.path.clone(), topics: vec![*topic] });
    }
    lines.into_values().collect()
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
    fn topics_that_differ_in_one_part_are_a_group_if_the_same_nodes_use_them() {
        let topics = [
            topic("/cell/distance", "cell"),
            topic("/cell/force", "cell"),
            topic("/robots/r1/pose", "cell"),
            topic("/robots/r1/state", "r1"),
            topic("/robots/r2/pose", "cell"),
            topic("/robots/r2/state", "r2"),
            topic("/robots/r3/pose", "cell"),
            topic("/zones/r3/pose", "cell"),
            topic("fleet/a/state", "cell"),
            topic("fleet/b/state", "cell"),
            topic("fleet/c,d/state", "cell"),
            topic("fleet//state", "cell"),
        ];
        let lines = fold(&topics.iter().collect::<Vec<_>>());
        let lines: Vec<(&str, &str, usize)> =
            lines.iter().map(|line| (line.path.as_str(), line.name.as_str(), line.topics.len())).collect();
        let expected = [
            ("/cell/distance", "/cell/distance", 1),
            ("/cell/force", "/cell/force", 1),
            ("/robots/{r1,r2,r3}/pose", "robots/pose", 3),
            ("/robots/r1/state", "/robots/r1/state", 1),
            ("/robots/r2/state", "/robots/r2/state", 1),
            ("/zones/r3/pose", "/zones/r3/pose", 1),
            ("fleet/{a,b}/state", "fleet/state", 2),
            ("fleet/c,d/state", "fleet/c,d/state", 1),
            ("fleet//state", "fleet//state", 1),
        ];
        assert_eq!(lines, expected);
    }
}
