use std::collections::BTreeSet;

use super::*;

const CAMPAIGN: &str = "0123456789abcdef";
const AT_ONCE: Duration = Duration::ZERO;

fn queue() -> (tempfile::TempDir, Folder) {
    let folder = tempfile::tempdir().unwrap();
    let queue = Folder::open(folder.path()).unwrap();
    queue.make_room(CAMPAIGN).unwrap();
    queue.announce(CAMPAIGN, b"announced").unwrap();
    (folder, queue)
}

fn taken(queue: &Folder) -> Option<(Vec<u8>, u64, Box<dyn Held>)> {
    let held = queue.take_test(CAMPAIGN, AT_ONCE).unwrap()?;
    Some((held.test().to_vec(), held.deliveries(), held))
}

#[test]
fn tests_are_taken_in_their_order_by_one_at_a_time() {
    let (folder, queue) = queue();
    let other = Folder::open(folder.path()).unwrap();
    for number in 0..20 {
        queue.put_test(CAMPAIGN, format!("test {number}").as_bytes()).unwrap();
    }
    let mut all = Vec::new();
    while let Some((test, deliveries, held)) = taken(if all.len() % 2 == 0 { &queue } else { &other }) {
        assert_eq!((String::from_utf8(test).unwrap(), deliveries), (format!("test {}", all.len()), 1));
        all.push(held);
    }
    assert_eq!(all.len(), 20);
}

#[test]
fn a_test_that_nobody_holds_any_more_is_delivered_again_and_a_finished_one_never() {
    let (folder, queue) = queue();
    let other = Folder::open(folder.path()).unwrap().losing_after(AT_ONCE);
    queue.put_test(CAMPAIGN, b"test").unwrap();
    let (_, _, held) = taken(&queue).unwrap();
    drop(held);
    assert!(taken(&queue).is_none(), "it may still be held by another machine");
    let (test, deliveries, held) = loop {
        if let Some(taken) = taken(&other) {
            break taken;
        }
    };
    assert_eq!((test, deliveries), (b"test".to_vec(), 2));
    held.finish().unwrap();
    other.return_lost(&other.campaign(CAMPAIGN)).unwrap();
    assert!(taken(&other).is_none());
}

#[test]
fn what_touches_a_test_is_not_part_of_it() {
    let (_folder, queue) = queue();
    queue.put_test(CAMPAIGN, b"test").unwrap();
    let (test, _, held) = taken(&queue).unwrap();
    let file = queue.files(&queue.campaign(CAMPAIGN).join("held")).unwrap().remove(0);
    assert_eq!(test, b"test");
    assert_eq!(fs::read(file).unwrap(), b"test\n");
    drop(held);
}

#[test]
fn an_agent_that_was_lost_long_ago_leaves_nothing() {
    let (_folder, queue) = queue();
    queue.present("lost", b"here").unwrap();
    let file = queue.root.join("agents/lost");
    let long_ago = SystemTime::now() - 2 * FORGOTTEN;
    File::options().append(true).open(&file).unwrap().set_modified(long_ago).unwrap();
    assert_eq!(queue.presences().unwrap(), Vec::<Vec<u8>>::new());
    assert!(!file.exists());
}

#[test]
fn results_and_files_come_whole_and_nothing_is_overwritten() {
    let (_folder, queue) = queue();
    for result in ["first", "second"] {
        queue.put_result(CAMPAIGN, result.as_bytes()).unwrap();
    }
    assert_eq!(queue.take_result(CAMPAIGN, AT_ONCE).unwrap(), Some(b"first".to_vec()));
    assert_eq!(queue.take_result(CAMPAIGN, AT_ONCE).unwrap(), Some(b"second".to_vec()));
    assert_eq!(queue.take_result(CAMPAIGN, AT_ONCE).unwrap(), None);

    queue.put_file(CAMPAIGN, "00", b"content").unwrap();
    queue.put_file(CAMPAIGN, "00", b"other").unwrap();
    assert_eq!(queue.file(CAMPAIGN, "00").unwrap(), Some(b"content".to_vec()));
    assert!(queue.has_file(CAMPAIGN, "00").unwrap() && !queue.has_file(CAMPAIGN, "11").unwrap());
    queue.put_file(CAMPAIGN, "../../escaped", b"inside").unwrap();
    assert_eq!(queue.file(CAMPAIGN, "../../escaped").unwrap(), Some(b"inside".to_vec()));
    assert_eq!(queue.files(&queue.campaign(CAMPAIGN).join("files")).unwrap().len(), 2);
    queue.remove_file(CAMPAIGN, "00").unwrap();
    assert_eq!(queue.file(CAMPAIGN, "00").unwrap(), None);
    assert_eq!(queue.files(&queue.root.join("new")).unwrap(), Vec::<PathBuf>::new(), "nothing is left of writing");
}

#[test]
fn campaigns_and_agents_are_found_until_they_leave() {
    let (_folder, queue) = queue();
    assert_eq!(queue.announcements().unwrap(), [(CAMPAIGN.to_owned(), b"announced".to_vec())]);
    queue.announce(CAMPAIGN, b"again").unwrap();
    assert_eq!(queue.announcements().unwrap(), [(CAMPAIGN.to_owned(), b"again".to_vec())]);
    queue.present("agent-1", b"here").unwrap();
    assert_eq!(queue.presences().unwrap(), [b"here".to_vec()]);
    queue.absent("agent-1").unwrap();
    assert_eq!(queue.presences().unwrap(), Vec::<Vec<u8>>::new());

    queue.put_test(CAMPAIGN, b"test").unwrap();
    queue.withdraw(CAMPAIGN).unwrap();
    assert!(taken(&queue).is_none());
    queue.remove(CAMPAIGN).unwrap();
    queue.remove(CAMPAIGN).unwrap();
    assert_eq!(queue.announcements().unwrap(), []);
}

#[test]
fn of_many_who_take_at_once_each_test_comes_to_one() {
    let (folder, queue) = queue();
    for number in 0..100 {
        queue.put_test(CAMPAIGN, format!("{number}").as_bytes()).unwrap();
    }
    let taking = || {
        let queue = Folder::open(folder.path()).unwrap();
        let mut tests = Vec::new();
        while let Some((test, _, held)) = taken(&queue) {
            held.finish().unwrap();
            tests.push(String::from_utf8(test).unwrap());
        }
        tests
    };
    let all: Vec<String> = thread::scope(|scope| {
        let threads: Vec<_> = (0..4).map(|_| scope.spawn(taking)).collect();
        threads.into_iter().flat_map(|thread| thread.join().unwrap()).collect()
    });
    assert_eq!(all.len(), 100);
    assert_eq!(all.into_iter().collect::<BTreeSet<_>>().len(), 100);
}
