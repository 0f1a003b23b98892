//! What a step owes, compared with a naive rule that knows nothing of wires.

use proptest::collection::vec;
use proptest::prelude::*;
use sesame_plan::testing::{self, minimal, node, ros2, topic};
use sesame_plan::{Answer, Node, TopicMembers, Type, Wiring};

use super::*;

/// A plan with groups of these sizes; by topic, the nodes to which its messages go by links.
fn plan(sizes: &[usize], nodes: Vec<Node>, links: &[Vec<NodeId>]) -> CampaignPlan {
    let group = |(at, &size): (usize, &usize)| {
        let paths: Vec<String> = (0..size).map(|member| format!("t{at}/{member}")).collect();
        let paths: Vec<&str> = paths.iter().map(String::as_str).collect();
        topic(&format!("t{at}"), &paths, Type::Bool)
    };
    let wiring = links.iter().map(|links| Wiring { cut: true, subscribers: links.clone(), ..Wiring::default() });
    let mut plan = minimal();
    plan.topics = sizes.iter().enumerate().map(group).collect();
    plan.nodes = nodes;
    plan.simulator = ros2(0, wiring.collect());
    plan
}

fn topics(topics: &[u32]) -> Vec<TopicId> {
    topics.iter().copied().map(TopicId).collect()
}

fn answers(pairs: &[(u32, u32)]) -> Vec<Answer> {
    pairs.iter().map(|&(to, with)| Answer { to: TopicId(to), with: TopicId(with) }).collect()
}

#[test]
fn a_node_that_publishes_twice_never_ends_a_step_early() {
    let both = Node { every_step: topics(&[0]), publishes: testing::topics(&[0]), ..node("robots") };
    let answering = Node {
        answers: answers(&[(1, 0)]),
        publishes: testing::topics(&[0]),
        subscribes: testing::topics(&[1]),
        ..node("arms")
    };
    let plan = plan(&[2, 1], vec![both, answering], &[]);
    let wires = WireTable::new(&plan);
    let [first, second, asked] = wires.iter().collect::<Vec<_>>()[..] else { panic!("there are three wires") };
    let promises = Promises::new(&plan, &wires);
    let mut owed = Owed::default();
    owed.extend(promises.every_step().iter().copied());
    owed.pay(first);
    owed.pay(first);
    assert!(!owed.is_empty(), "two messages of one do not stand for a message of the other");
    assert_eq!(owed.awaited(&wires), "a message of the step (1 on `t0/1`)");
    owed.pay(second);
    assert!(owed.is_empty());
    // The surplus message does not stand for one that is owed later either.
    owed.extend(promises.answers(asked).iter().map(|&(_, with)| with));
    owed.pay(second);
    assert_eq!(owed.awaited(&wires), "a message of the step (1 on `t0/0`)");
}

#[test]
fn a_member_answers_a_member_of_a_group_of_the_same_size_and_otherwise_all_do() {
    let all = testing::topics(&[0, 1, 2]);
    let arms =
        Node { answers: answers(&[(0, 1), (0, 2), (2, 0)]), publishes: all.clone(), subscribes: all, ..node("arms") };
    let plan = plan(&[2, 2, 1], vec![arms], &[]);
    let wires = WireTable::new(&plan);
    let promises = Promises::new(&plan, &wires);
    let owed = |path: &str| {
        let answers = promises.answers(wires.find(path).expect("it is a wire")).iter();
        answers.map(|&(_, with)| wires.path(with)).collect::<Vec<_>>()
    };
    assert_eq!(owed("t0/0"), ["t1/0", "t2/0"]);
    assert_eq!(owed("t0/1"), ["t1/1", "t2/0"]);
    assert_eq!(owed("t1/0"), [""; 0]);
    assert_eq!(owed("t2/0"), ["t0/0", "t0/1"]);
    let said = |is: fn(&Promises, Wire) -> bool| wires.iter().map(|wire| is(&promises, wire)).collect::<Vec<_>>();
    assert_eq!(said(Promises::is_answered), [true, true, false, false, true]);
    assert_eq!(said(Promises::is_counted), [true; 5], "of each of them nodes say how many messages it has");
}

#[test]
fn a_robot_answers_on_its_own_member() {
    let own = |member| {
        vec![0, 1].into_iter().map(TopicId).map(move |topic| TopicMembers::Only { topic, members: vec![member] })
    };
    let robot = |member| Node {
        answers: answers(&[(0, 1)]),
        every_step: topics(&[1]),
        publishes: own(member).skip(1).collect(),
        subscribes: own(member).take(1).collect(),
        ..node("robot")
    };
    let plan = plan(&[3, 3], vec![robot(0), robot(2)], &[vec![NodeId(1)], vec![]]);
    let wires = WireTable::new(&plan);
    let promises = Promises::new(&plan, &wires);
    let paths = |of: &[Wire]| of.iter().map(|&wire| wires.path(wire).to_owned()).collect::<Vec<_>>();
    assert_eq!(paths(promises.every_step()), ["t1/0", "t1/2"]);
    let links: Vec<Wire> = wires.links().iter().map(|link| link.wire).collect();
    assert_eq!(paths(&links), ["t0/2/to/robot"], "only the way of its own member leads to it");
    let owed = |wire: Wire| {
        let with = promises.answers(wire).iter().map(|&(_, with)| with);
        paths(&with.collect::<Vec<_>>())
    };
    assert_eq!(
        wires.iter().chain(links.iter().copied()).map(owed).collect::<Vec<_>>(),
        [vec!["t1/0"], vec![], vec![], vec![], vec![], vec![], vec!["t1/2"],]
    );
}

/// A member of a group: the position of its topic, and its own.
type Member = (usize, usize);

/// What happens in a step.
#[derive(Debug, Clone, Copy)]
enum Event {
    Begins,
    /// A message of this member reaches one node over its link, or all nodes that have none.
    Delivered(Member, Option<NodeId>),
    Comes(Member),
}

/// Whether a node lists a member.
fn lists(of: &[TopicMembers], (topic, member): Member) -> bool {
    of.iter().any(|listed| match listed {
        TopicMembers::All(id) => id.index() == topic,
        TopicMembers::Only { topic: id, members } => {
            id.index() == topic && members.iter().any(|&at| at as usize == member)
        }
    })
}

/// How many messages of a member are owed after all these events, from what nodes declare and nothing else.
fn naive(plan: &CampaignPlan, links: &[Vec<NodeId>], events: &[Event], (topic, member): Member) -> u32 {
    let mut owed: u32 = 0;
    for &event in events {
        for (at, node) in (0u32..).map(NodeId).zip(&plan.nodes) {
            if !lists(&node.publishes, (topic, member)) {
                continue;
            }
            match event {
                Event::Begins => {
                    owed += node.every_step.iter().map(|expected| u32::from(expected.index() == topic)).sum::<u32>();
                }
                Event::Delivered(to, only)
                    if lists(&node.subscribes, to)
                        && (only == Some(at) || only.is_none() && !links[to.0].contains(&at)) =>
                {
                    let sizes = [topic, to.0].map(|topic| plan.topics[topic].paths.len());
                    let is_its = sizes[0] != sizes[1] || member == to.1;
                    let answer = |answer: &Answer| answer.to.index() == to.0 && answer.with.index() == topic && is_its;
                    owed += node.answers.iter().map(|expected| u32::from(answer(expected))).sum::<u32>();
                }
                Event::Delivered(..) | Event::Comes(_) => {}
            }
        }
        if matches!(event, Event::Comes(which) if which == (topic, member)) {
            owed = owed.saturating_sub(1);
        }
    }
    owed
}

proptest! {
    #[test]
    fn what_is_owed_is_what_a_naive_rule_says(
        sizes in vec(1usize..4, 1..5),
        nodes in vec((vec(any::<prop::sample::Index>(), 0..3), vec(any::<[prop::sample::Index; 2]>(), 0..4)), 1..4),
        told_apart in vec(vec(any::<bool>(), 4), 5),
        used in vec(vec([1u32..8, 1u32..8], 5), 4),
        happens in vec((0..3, any::<prop::sample::Index>()), 0..30),
    ) {
        let some = |index: &prop::sample::Index| TopicId(u32::try_from(index.index(sizes.len())).unwrap());
        // The members of each topic whose bits are set; all where none is left out.
        let members_of = |of: &[[u32; 2]], side: usize| -> Vec<TopicMembers> {
            (0u32..).map(TopicId).zip(&sizes).zip(of).map(|((topic, &size), bits)| {
                let members = (0u32..).take(size).filter(|member| bits[side] & (1 << member) != 0);
                let members: Vec<u32> = members.collect();
                match members.len() {
                    0 => TopicMembers::All(topic),
                    count if count == size => TopicMembers::All(topic),
                    _ => TopicMembers::Only { topic, members },
                }
            }).collect()
        };
        let nodes: Vec<Node> = nodes.iter().zip(&used).map(|((every_step, pairs), used)| Node {
            every_step: every_step.iter().map(some).collect(),
            answers: pairs.iter().map(|[to, with]| Answer { to: some(to), with: some(with) }).collect(),
            publishes: members_of(used, 0),
            subscribes: members_of(used, 1),
            ..node("one")
        }).collect();
        let links: Vec<Vec<NodeId>> = told_apart[..sizes.len()].iter().map(|told_apart| {
            (0u32..).map(NodeId).zip(told_apart).take(nodes.len()).filter(|(_, told)| **told).map(|(id, _)| id).collect()
        }).collect();
        let plan = plan(&sizes, nodes, &links);
        let wires = WireTable::new(&plan);
        let promises = Promises::new(&plan, &wires);
        let members: Vec<Member> =
            sizes.iter().enumerate().flat_map(|(topic, &size)| (0..size).map(move |member| (topic, member))).collect();
        let wire = |(topic, member): Member| wires.find(&format!("t{topic}/{member}")).unwrap();
        let reached: Vec<(Member, Option<NodeId>)> = members.iter().flat_map(|&member| {
            let subscribed = |node: &&NodeId| lists(&plan.node(**node).subscribes, member);
            let by_links = links[member.0].iter().filter(subscribed).map(|&node| (member, Some(node)));
            std::iter::once((member, None)).chain(by_links.collect::<Vec<_>>())
        }).collect();

        let (mut owed, mut events) = (Owed::default(), Vec::new());
        for (kind, index) in happens {
            let event = match kind {
                0 => Event::Begins,
                1 => { let (member, only) = *index.get(&reached); Event::Delivered(member, only) }
                _ => Event::Comes(*index.get(&members)),
            };
            match event {
                Event::Begins => owed.extend(promises.every_step().iter().copied()),
                Event::Delivered(member, only) => {
                    let link = wires.links().iter().find(|link| link.of == wire(member) && Some(link.to) == only);
                    let delivered = link.map_or(wire(member), |link| link.wire);
                    prop_assert_eq!(link.is_some(), only.is_some());
                    owed.extend(promises.answers(delivered).iter().map(|&(_, with)| with));
                }
                Event::Comes(member) => owed.pay(wire(member)),
            }
            events.push(event);
            let counts = members.iter().map(|&member| (member, naive(&plan, &links, &events, member)));
            let counts: Vec<(Member, u32)> = counts.filter(|(_, count)| *count > 0).collect();
            prop_assert_eq!(owed.is_empty(), counts.is_empty());
            let named: Vec<String> =
                counts.iter().map(|((topic, member), count)| format!("{count} on `t{topic}/{member}`")).collect();
            prop_assert_eq!(owed.awaited(&wires), format!("a message of the step ({})", named.join(", ")));
        }
    }
}
