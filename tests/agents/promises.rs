//! What a queue promises is tried with a real broker and with a folder alike.

use std::sync::atomic::{AtomicUsize, Ordering};
use std::time::{Duration, Instant};

use sesame_patience::LIMIT;
use sesame_queue::folder::Folder;
use sesame_queue::nats::{Access, Nats};
use sesame_queue::queue::{Held, Queue, QueueError};

use crate::fleet::Broker;

const CAMPAIGN: &str = "0123456789abcdef";
const OTHER: &str = "fedcba9876543210";
const SOON: Duration = Duration::from_millis(300);

/// Tries a promise with two connections to one queue, of each kind.
fn of_each(promise: fn(&dyn Queue, &dyn Queue)) {
    let folder = tempfile::tempdir().expect("a folder can be made");
    let connections = [(); 2].map(|()| Folder::open(folder.path()).expect("a folder is a queue"));
    announce(&connections[0]);
    promise(&connections[0], &connections[1]);
    let Some((_broker, connections)) = connected() else { return };
    promise(&connections[0], &connections[1]);
}

/// A broker with an announced campaign, and two connections to it.
fn connected() -> Option<(Broker, [Nats; 2])> {
    let broker = Broker::start()?;
    let connections =
        [(); 2].map(|()| eventually("the broker answers", || Nats::connect(&broker.url(), &Access::default()).ok()));
    announce(&connections[0]);
    Some((broker, connections))
}

fn announce(queue: &dyn Queue) {
    queue.make_room(CAMPAIGN).expect("there is room");
    queue.announce(CAMPAIGN, b"announced").expect("a campaign is announced");
}

fn eventually<T>(what: &str, mut look: impl FnMut() -> Option<T>) -> T {
    let begun = Instant::now();
    loop {
        if let Some(found) = look() {
            return found;
        }
        assert!(begun.elapsed() < LIMIT, "{what}");
        std::thread::sleep(Duration::from_millis(10));
    }
}

fn text(held: &dyn Held) -> String {
    String::from_utf8(held.test().to_vec()).expect("these tests are text")
}

#[test]
fn tests_come_in_their_order_each_to_one_who_takes_it_and_a_finished_one_never_again() {
    of_each(|one, two| {
        for number in 0..10 {
            one.put_test(CAMPAIGN, format!("test {number}").as_bytes()).unwrap();
        }
        let mut held = Vec::new();
        for number in 0..10 {
            let queue = if number % 2 == 0 { one } else { two };
            let test = queue.take_test(CAMPAIGN, LIMIT).unwrap().expect("it was put in");
            assert_eq!((text(&*test), test.deliveries()), (format!("test {number}"), 1));
            held.push(test);
        }
        assert!(two.take_test(CAMPAIGN, SOON).unwrap().is_none());
        for test in held {
            test.finish().unwrap();
        }
        assert!(one.take_test(CAMPAIGN, SOON).unwrap().is_none());
    });
}

#[test]
fn a_test_that_is_lost_is_delivered_again_and_counted() {
    of_each(|one, two| {
        one.put_test(CAMPAIGN, b"test").unwrap();
        let test = two.take_test(CAMPAIGN, LIMIT).unwrap().unwrap();
        assert_eq!(test.deliveries(), 1);
        drop(test);
        let test = eventually("it was lost", || one.take_test(CAMPAIGN, SOON).unwrap());
        assert_eq!((text(&*test), test.deliveries()), ("test".to_owned(), 2));
        test.finish().unwrap();
    });
}

#[test]
fn a_test_stays_with_who_holds_it_for_longer_than_a_lost_one_waits() {
    let Some((_broker, [one, two])) = connected() else { return };
    one.put_test(CAMPAIGN, b"test").unwrap();
    let held = one.take_test(CAMPAIGN, LIMIT).unwrap().unwrap();
    assert!(two.take_test(CAMPAIGN, Duration::from_secs(6)).unwrap().is_none());
    held.finish().unwrap();
}

#[test]
fn results_come_once_and_whole_whatever_their_size() {
    of_each(|one, two| {
        let large = vec![b'7'; 5_000_000];
        one.put_result(CAMPAIGN, b"small").unwrap();
        one.put_result(CAMPAIGN, &large).unwrap();
        assert_eq!(two.take_result(CAMPAIGN, LIMIT).unwrap(), Some(b"small".to_vec()));
        assert!(two.take_result(CAMPAIGN, LIMIT).unwrap() == Some(large.clone()));
        assert_eq!(two.take_result(CAMPAIGN, SOON).unwrap(), None);
        one.put_test(CAMPAIGN, &large).unwrap();
        let test = two.take_test(CAMPAIGN, LIMIT).unwrap().unwrap();
        assert!(test.test() == large);
        test.finish().unwrap();
        one.announce(CAMPAIGN, &large).unwrap();
        assert!(two.announcements().unwrap() == [(CAMPAIGN.to_owned(), large)]);
    });
}

#[test]
fn files_are_there_for_all_until_they_are_removed() {
    of_each(|one, two| {
        let content: Vec<u8> = (0..3_000_000u32).map(|at| at.to_le_bytes()[0]).collect();
        assert!(!two.has_file(CAMPAIGN, "00aa").unwrap());
        assert_eq!(two.file(CAMPAIGN, "00aa").unwrap(), None);
        one.put_file(CAMPAIGN, "00aa", &content).unwrap();
        one.put_file(CAMPAIGN, "00bb", b"").unwrap();
        assert!(two.has_file(CAMPAIGN, "00aa").unwrap());
        assert!(two.file(CAMPAIGN, "00aa").unwrap() == Some(content));
        assert_eq!(two.file(CAMPAIGN, "00bb").unwrap(), Some(Vec::new()));
        two.remove_file(CAMPAIGN, "00aa").unwrap();
        two.remove_file(CAMPAIGN, "00aa").unwrap();
        assert_eq!(one.file(CAMPAIGN, "00aa").unwrap(), None);
    });
}

#[test]
fn campaigns_and_agents_are_seen_by_all_and_nothing_is_left_of_a_removed_campaign() {
    of_each(|one, two| {
        two.make_room(OTHER).unwrap();
        two.announce(OTHER, b"another").unwrap();
        let both = [(CAMPAIGN.to_owned(), b"announced".to_vec()), (OTHER.to_owned(), b"another".to_vec())];
        assert_eq!(one.announcements().unwrap(), both);
        two.present("a-1", b"here").unwrap();
        eventually("it is there", || (one.presences().unwrap() == [b"here".to_vec()]).then_some(()));
        two.absent("a-1").unwrap();
        eventually("it has left", || one.presences().unwrap().is_empty().then_some(()));

        one.put_test(CAMPAIGN, b"test").unwrap();
        one.withdraw(CAMPAIGN).unwrap();
        assert!(two.take_test(CAMPAIGN, SOON).unwrap().is_none());
        one.put_test(CAMPAIGN, b"another test").unwrap();
        one.put_file(CAMPAIGN, "00", b"content").unwrap();
        two.remove(CAMPAIGN).unwrap();
        two.remove(CAMPAIGN).unwrap();
        assert_eq!(one.announcements().unwrap(), [(OTHER.to_owned(), b"another".to_vec())]);
        one.make_room(CAMPAIGN).unwrap();
        one.announce(CAMPAIGN, b"anew").unwrap();
        assert!(eventually("it is there again", || two.take_test(CAMPAIGN, SOON).ok()).is_none());
        assert_eq!(one.file(CAMPAIGN, "00").unwrap(), None);
    });
}

#[test]
fn an_agent_that_says_nothing_any_more_is_not_present() {
    let Some((_broker, [one, two])) = connected() else { return };
    one.present("a-1", b"here").unwrap();
    eventually("it is there", || (two.presences().unwrap().len() == 1).then_some(()));
    eventually("it is lost", || two.presences().unwrap().is_empty().then_some(()));
}

#[test]
fn many_who_take_at_once_get_each_test_once() {
    of_each(|one, two| {
        const TESTS: usize = 60;
        for number in 0..TESTS {
            one.put_test(CAMPAIGN, number.to_string().as_bytes()).unwrap();
        }
        let finished = AtomicUsize::new(0);
        std::thread::scope(|scope| {
            for at in 0..4 {
                let queue = if at % 2 == 0 { one } else { two };
                let finished = &finished;
                scope.spawn(move || {
                    while finished.load(Ordering::Relaxed) < TESTS {
                        let Some(test) = queue.take_test(CAMPAIGN, SOON).unwrap() else { continue };
                        queue.put_result(CAMPAIGN, test.test()).unwrap();
                        test.finish().unwrap();
                        finished.fetch_add(1, Ordering::Relaxed);
                    }
                });
            }
        });
        let mut results = Vec::new();
        while let Some(result) = two.take_result(CAMPAIGN, SOON).unwrap() {
            results.push(String::from_utf8(result).unwrap().parse::<usize>().unwrap());
        }
        results.sort_unstable();
        assert_eq!(results, (0..TESTS).collect::<Vec<_>>());
    });
}

/// What can be asked again after the broker could not be reached.
fn again<T>(mut call: impl FnMut() -> Result<T, QueueError>) -> T {
    eventually("the broker is there again", || call().ok())
}

#[test]
fn what_was_put_in_is_there_after_the_broker_was_killed_and_connections_heal() {
    let Some((mut broker, [queue, _])) = connected() else { return };
    for number in 0..20 {
        queue.put_test(CAMPAIGN, number.to_string().as_bytes()).unwrap();
    }
    let first = queue.take_test(CAMPAIGN, LIMIT).unwrap().unwrap();
    queue.put_result(CAMPAIGN, b"result").unwrap();
    queue.put_file(CAMPAIGN, "00", b"content").unwrap();
    broker.kill();
    assert!(matches!(queue.put_test(CAMPAIGN, b"lost"), Err(QueueError::Unreachable { .. })));
    broker.start_again();
    assert_eq!(again(|| queue.take_result(CAMPAIGN, SOON)), Some(b"result".to_vec()));
    assert_eq!(again(|| queue.file(CAMPAIGN, "00")), Some(b"content".to_vec()));
    assert_eq!(again(|| queue.announcements()), [(CAMPAIGN.to_owned(), b"announced".to_vec())]);
    drop(first);
    let mut left = std::collections::BTreeSet::new();
    eventually("all tests are there", || {
        if let Ok(Some(test)) = queue.take_test(CAMPAIGN, SOON) {
            left.insert(text(&*test));
            test.finish().ok();
        }
        (0..20).all(|number| left.contains(&number.to_string())).then_some(())
    });
}

#[test]
fn a_broker_that_is_not_there_or_keeps_no_streams_is_refused_in_a_sentence() {
    let Some((broker, _)) = connected() else { return };
    let nobody = "nats://127.0.0.1:1";
    let error = Nats::connect(nobody, &Access::default()).err().unwrap();
    assert!(error.to_string().starts_with("nats://127.0.0.1:1 cannot be reached: "), "{error}");
    let credentials = Some("/nowhere/agent.creds".into());
    let error = Nats::connect(&broker.url(), &Access { credentials, certificates: None }).err().unwrap();
    assert!(error.to_string().contains("/nowhere/agent.creds: "), "{error}");
}

#[test]
fn a_broker_with_tls_and_a_password_is_reached_with_both_and_the_password_is_never_shown() {
    let folder = tempfile::tempdir().unwrap();
    let [certificate, key] = ["broker.pem", "broker.key"].map(|name| folder.path().join(name));
    let made = std::process::Command::new("openssl")
        .args(["req", "-x509", "-newkey", "rsa:2048", "-nodes", "-days", "2", "-subj", "/CN=localhost"])
        .args(["-addext", "subjectAltName=DNS:localhost,IP:127.0.0.1", "-addext", "basicConstraints=critical,CA:FALSE"])
        .args(["-out".as_ref(), certificate.as_os_str(), "-keyout".as_ref(), key.as_os_str()])
        .stderr(std::process::Stdio::null())
        .status();
    assert!(made.expect("openssl starts").success());
    let [certificate_file, key] = [&certificate, &key].map(|path| path.display().to_string());
    let arguments = ["--tls", "--tlscert", &certificate_file, "--tlskey", &key, "--user", "robot", "--pass", "secret"];
    let Some(broker) = Broker::start_with(arguments.map(str::to_owned).to_vec()) else { return };
    let vouched = Access { certificates: Some(certificate), ..Access::default() };
    let at = |login: &str| format!("tls://{login}localhost:{}", broker.port());
    let queue = eventually("the broker answers", || Nats::connect(&at("robot:secret@"), &vouched).ok());
    queue.make_room(CAMPAIGN).unwrap();
    queue.put_test(CAMPAIGN, b"test").unwrap();
    assert!(queue.take_test(CAMPAIGN, LIMIT).unwrap().is_some());
    assert_eq!(queue.place(), at(""));
    for (url, access) in [
        (at("robot:secret@"), Access::default()),
        (at("robot:wrong-secret@"), vouched.clone()),
        (at(""), vouched.clone()),
        (at("robot:secret@").replace("tls://", "nats://"), Access::default()),
    ] {
        let Err(refused) = Nats::connect(&url, &access) else { panic!("{url} was not refused") };
        assert!(!refused.to_string().contains("secret"), "{refused}");
    }
}
