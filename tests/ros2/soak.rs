//! Many messages through one relay: all of them arrive, and its memory does not grow.

use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::thread;
use std::time::{Duration, Instant};

use sesame_plan::Test;
use sesame_tests::dds::{JOINTS, Reader, Writer, joints, number, participant};

use crate::environment::{Domain, Vendor};
use crate::peer::Peer;
use crate::relaying::{Exchange, System, plan, space};

const KIND: &str = "std_msgs/msg/Float64";

/// Resident memory of this process, in kB.
fn memory() -> u64 {
    let status = std::fs::read_to_string("/proc/self/status").expect("this is Linux");
    let line = status.lines().find_map(|line| line.strip_prefix("VmRSS:")).expect("it has memory");
    line.trim().trim_end_matches(" kB").parse().expect("it is a number")
}

/// After how many messages of ROS it is seen to it that they arrive.
const BATCH: u64 = 500;

/// So many messages of ROS; the memory after a tenth of them, and after each part of the others. Few are under way at
/// any time, so a machine that is busy fills no queue.
fn soaked(count: u64) -> Option<Vec<u64>> {
    let python = Vendor::Kilted.python()?;
    let domain = Domain::free();
    let (count_text, batch) = (count.to_string(), BATCH.to_string());
    let arguments = ["--type", KIND, "--depth", "20000", "--count", &count_text];
    let subscriber = Peer::start(&python, &domain, "subscriber.py", &[&arguments[..], &["--tell", &batch]].concat());
    let speaking = ["--topic", "/peer/undisturbed", "--hold", "--batch", &batch];
    let publisher = Peer::start(&python, &domain, "publisher.py", &[&arguments[..], &speaking].concat());
    let mut system = System::new(plan(&space(&domain, KIND, "node hearing { subscribes peer }", "", "1000s")));
    let (mut memories, begin) = (Vec::new(), Instant::now());
    let to = [&subscriber];
    let exchange = Exchange { batch: Some(BATCH), ..Exchange::new(&publisher, &to) };
    let relayed = system.exchange_until(&Test::default(), &exchange, |_| {
        if subscriber.told("count") >= count / 10 + count * 9 / 10 / PARTS * memories.len() as u64 {
            memories.push(memory());
        }
        subscriber.is_done()
    });
    println!("{} relayed in {:.0} s, {memories:?} kB", relayed.messages(), begin.elapsed().as_secs_f64());
    let sent = publisher.expect();
    let heard = subscriber.expect();
    assert_eq!((relayed.messages(), &heard["digest"]), (count, &sent["digest"]), "{heard} {sent}");
    assert_eq!(system.notes(), [""; 0]);
    Some(memories)
}

/// In how many parts the messages come after caches are full.
const PARTS: u64 = 4;

/// By how much memory may grow in the part in which it grows least, in kB. A machine that has something else to do lets
/// queues grow once, and what is lost with each message is lost in every part.
const SLACK_OF_PART: u64 = 5_000;

/// The same for a part of the messages of ROS, which are few.
const SLACK_OF_FEW: u64 = 1_000;

#[test]
fn twenty_thousand_messages_of_ros_pass_and_memory_stays() {
    let Some(memories) = soaked(20_000) else { return };
    assert_eq!(memories.len() as u64, PARTS + 1, "{memories:?} kB");
    let growth = memories.windows(2).map(|two| two[1].saturating_sub(two[0])).min();
    assert!(growth.is_some_and(|growth| growth < SLACK_OF_FEW), "{memories:?} kB");
}

/// How many messages of the quick peers are under way.
const WINDOW: u64 = 100;

/// After so many messages the caches of DDS are full: a thousand messages for each reader and writer, each with the
/// datagram that it came in.
const WARM: u64 = 300_000;

/// As many messages as pass, in order, with quick peers; the memory once caches are full, and after each part.
fn rushed(count: u64, limit: Duration) -> Vec<u64> {
    const KIND: &str = "sensor_msgs/msg/JointState";
    let domain = Domain::free();
    let (publisher, subscriber) = (participant(domain.number), participant(domain.number));
    let writer = Writer::new(&publisher, "rt/peer/undisturbed", JOINTS);
    let mut reader = Reader::new(&subscriber, "rt/peer", JOINTS);
    let mut system = System::new(plan(&space(&domain, KIND, "node hearing { subscribes peer }", "", "100000s")));
    let (go, heard) = (AtomicBool::new(false), AtomicU64::new(0));
    let begin = Instant::now();
    let mut memories = Vec::new();
    let relayed = thread::scope(|scope| {
        scope.spawn(|| {
            while !go.load(Ordering::Acquire) {
                thread::yield_now();
            }
            for sent in 0..count {
                while sent - heard.load(Ordering::Acquire) >= WINDOW && begin.elapsed() < limit {
                    thread::yield_now();
                }
                writer.write(joints(sent));
            }
        });
        scope.spawn(|| {
            let mut expected = 0;
            while expected < count && begin.elapsed() < limit {
                reader.take(|message| {
                    assert_eq!(number(&message), expected, "every message comes once, in its order");
                    expected += 1;
                    heard.store(expected, Ordering::Release);
                });
            }
        });
        system.relay_until(
            &Test::default(),
            || go.store(true, Ordering::Release),
            |_| {
                let heard = heard.load(Ordering::Acquire);
                let part = memories.len() as u64;
                if part < PARTS && heard >= WARM + count.saturating_sub(WARM) / PARTS * part {
                    memories.push(memory());
                }
                heard >= count || begin.elapsed() > limit
            },
        )
    });
    memories.push(memory());
    println!("{} relayed in {:.0} s, {memories:?} kB", relayed.messages, begin.elapsed().as_secs_f64());
    assert_eq!((relayed.messages, heard.into_inner()), (count, count));
    assert_eq!(system.notes(), [""; 0]);
    memories
}

/// That memory does not grow with the messages.
fn assert_stays(memories: &[u64]) {
    let growth = memories.windows(2).map(|two| two[1].saturating_sub(two[0])).min();
    assert!(growth.is_some_and(|growth| growth < SLACK_OF_PART), "{memories:?} kB");
}

/// Fewer than fill the caches, so nothing is known of memory: the long suite measures that, and the test of twenty
/// thousand messages of ROS.
#[test]
fn sixty_thousand_messages_pass_in_their_order_as_fast_as_they_can() {
    rushed(60_000, Duration::from_secs(900));
}

#[test]
#[ignore = "long: half a million messages"]
fn two_hundred_thousand_messages_pass_after_caches_are_full_and_memory_stays() {
    assert_stays(&rushed(WARM + 200_000, Duration::from_secs(900)));
}

#[test]
#[ignore = "long: ten million messages"]
fn ten_million_messages_pass_and_memory_stays() {
    assert_stays(&rushed(10_000_000, Duration::from_secs(6000)));
}
