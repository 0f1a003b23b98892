//! What one middleware publishes, the runner passes on to the others unchanged, in order, and completely.

use sesame_plan::Test;

use crate::environment::{Domain, Vendor};
use crate::peer::Peer;
use crate::relaying::{Exchange, System, plan, space};

/// The vendors with the program that plays a part.
const VENDORS: [Vendor; 3] = [Vendor::Kilted, Vendor::Jazzy, Vendor::Cyclone];

fn start(vendor: Vendor, part: &str, domain: &Domain, arguments: &[&str]) -> Option<Peer> {
    let python = vendor.python()?;
    let program = match (vendor, part) {
        (Vendor::Cyclone, _) => "cyclone.py",
        (_, "publish") => "publisher.py",
        _ => "subscriber.py",
    };
    let mut all = Vec::new();
    all.extend((vendor == Vendor::Cyclone).then_some(part));
    all.extend(arguments);
    // Cyclone's does both without being told.
    all.extend((vendor != Vendor::Cyclone).then_some(if part == "subscribe" { "--content" } else { "--hold" }));
    Some(Peer::start(&python, domain, program, &all))
}

/// Samples of a type from a vendor to subscribers of all of them.
fn relayed(publisher: Vendor, subscribers: &[Vendor], kind: &str, count: u32, rate: u32) {
    let domain = Domain::free();
    let (count, rate) = (count.to_string(), rate.to_string());
    let arguments = ["--type", kind, "--count", &count, "--depth", "10000"];
    let mut hearing = Vec::new();
    for vendor in subscribers {
        let Some(peer) = start(*vendor, "subscribe", &domain, &arguments) else { return };
        hearing.push((*vendor, peer));
    }
    let speaking = [&arguments[..], &["--topic", "/peer/undisturbed", "--rate", &rate]].concat();
    let Some(speaking) = start(publisher, "publish", &domain, &speaking) else { return };
    let named = |at: usize| format!("node s{at} {{ subscribes peer }}");
    let nodes: Vec<String> = (0..hearing.len()).map(named).collect();
    let mut system = System::new(plan(&space(&domain, kind, &nodes.join("\n"), "", "1000s")));
    let to: Vec<&Peer> = hearing.iter().map(|(_, peer)| peer).collect();
    let relayed = system.exchange(&Test::default(), &Exchange::new(&speaking, &to));
    let sent = speaking.expect();
    for (vendor, peer) in hearing {
        let (code, heard) = peer.end();
        let heard = (code, &heard["count"], &heard["content"]);
        assert_eq!(heard, (Some(0), &sent["count"], &sent["content"]), "{kind} from {publisher:?} to {vendor:?}");
    }
    assert_eq!(relayed.messages().to_string(), count);
    assert_eq!(system.notes(), [""; 0], "{kind} from {publisher:?}");
}

/// Types that all of the vendors exchange without a runner too. `sensor_msgs/msg/JointState` and `std_msgs/msg/Float64`
/// are not among them: between Fast DDS and Cyclone DDS nothing arrives.
const COMMON: [&str; 2] = ["geometry_msgs/msg/PointStamped", "std_msgs/msg/String"];

#[test]
fn what_kilted_publishes_arrives_at_all_vendors() {
    for kind in COMMON {
        relayed(Vendor::Kilted, &VENDORS, kind, 300, 500);
    }
}

#[test]
fn what_jazzy_publishes_arrives_at_all_vendors() {
    for kind in COMMON {
        relayed(Vendor::Jazzy, &VENDORS, kind, 300, 500);
    }
}

#[test]
fn what_cyclone_publishes_arrives_at_all_vendors() {
    for kind in COMMON {
        relayed(Vendor::Cyclone, &VENDORS, kind, 300, 500);
    }
}

/// Samples of many types at once, of installed ones with ROS and of random definitions with Cyclone DDS, from one peer
/// to another of the same vendor.
fn relayed_of_many_types(vendor: Vendor, types: u32, count: u32) {
    let Some(python) = vendor.python() else { return };
    let domain = Domain::free();
    let definitions = tempfile::tempdir().expect("there is room for a folder");
    let folder = definitions.path().to_str().expect("it has a name");
    let share = if vendor == Vendor::Cyclone { definitions.path().to_path_buf() } else { Vendor::share(&python) };
    let options = ["--types", &types.to_string(), "--count", &count.to_string()];
    let options =
        if vendor == Vendor::Cyclone { [&options[..], &["--folder", folder]].concat() } else { options.into() };
    let start = |part: &str| Peer::start(&python, &domain, "any_types.py", &[&[part], &options[..]].concat());
    let listed = start("types").text();
    let kinds: Vec<&str> = listed.lines().collect();
    assert!(kinds.len() > 20, "{kinds:?}");

    let each = |text: &dyn Fn(usize, &str) -> String| -> String {
        kinds.iter().enumerate().map(|(at, kind)| text(at, kind)).collect()
    };
    let text = format!(
        "space peers\nsystem {{\n  simulator peers = ros2 {{ domain {domain}  types \"{share}\" }}\n{messages}{topics}\
         }}\nmetric disturbed minimise = fuzzing_time()\n{operations}campaign look {{\n  objectives disturbed\n  \
         operations {names}  1 per test\n  search random {{ evaluations 1 }}\n  end after 10000s\n}}\n",
        domain = domain.number,
        share = share.display(),
        messages = each(&|at, kind| format!("  message M{at} = \"{kind}\"\n")),
        topics =
            each(&|at, _| format!("  topic t{at} = \"/peer_{at}\" : M{at}\n  node n{at} {{ subscribes t{at} }}\n")),
        operations = each(&|at, _| format!("operation hole{at} on t{at} = blackhole\n")),
        names = each(&|at, _| format!("{}hole{at}", if at == 0 { "" } else { ", " })),
    );
    let (hearing, speaking) = (start("subscribe"), start("publish"));
    let mut system = System::new(plan(&text));
    let to = [&hearing];
    let exchange = Exchange { begins: true, ..Exchange::new(&speaking, &to) };
    let relayed = system.exchange(&Test::default(), &exchange);
    let (sent, heard) = (speaking.expect(), hearing.expect());
    for (at, kind) in kinds.iter().enumerate() {
        assert_eq!(heard["digests"][at], sent["digests"][at], "{kind} through {vendor:?}");
    }
    assert_eq!(system.notes(), [""; 0]);
    assert_eq!(heard["count"], sent["count"]);
    assert_eq!(Some(relayed.messages()), sent["count"].as_u64());
}

#[test]
fn installed_types_of_kilted_arrive_as_they_were_sent() {
    relayed_of_many_types(Vendor::Kilted, 30, 10);
}

#[test]
fn installed_types_of_jazzy_arrive_as_they_were_sent() {
    relayed_of_many_types(Vendor::Jazzy, 30, 10);
}

#[test]
fn random_types_of_cyclone_arrive_as_they_were_sent() {
    relayed_of_many_types(Vendor::Cyclone, 30, 10);
}

#[test]
#[ignore = "long: 10,000 samples with each vendor"]
fn ten_thousand_samples_of_random_types_arrive_as_they_were_sent() {
    relayed_of_many_types(Vendor::Kilted, 100, 100);
    relayed_of_many_types(Vendor::Jazzy, 100, 100);
    relayed_of_many_types(Vendor::Cyclone, 100, 100);
}

#[test]
#[ignore = "long: 10,000 messages of each type from each vendor to all of them"]
fn ten_thousand_messages_of_each_type_arrive_at_all_vendors() {
    for publisher in VENDORS {
        for kind in COMMON {
            relayed(publisher, &VENDORS, kind, 10_000, 1000);
        }
    }
    let ros = [Vendor::Kilted, Vendor::Jazzy];
    for (publisher, kind) in
        ros.iter().flat_map(|ros| ["std_msgs/msg/Float64", "sensor_msgs/msg/JointState"].map(|kind| (*ros, kind)))
    {
        relayed(publisher, &ros, kind, 10_000, 1000);
    }
}
