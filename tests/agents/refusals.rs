//! What agents and supervisors refuse, and in which words.

use std::fs;

use sesame_patience::until;
use sesame_tests::done;

use crate::fleet::{Cell, started_with_log, token_in};

fn failure(cell: &Cell, arguments: &[&str]) -> String {
    done(&mut cell.command(arguments)).expect(1).err
}

#[test]
fn a_queue_that_is_none_is_refused_in_a_sentence() {
    let cell = Cell::new("agents_no_queue");
    let of = |place: &str| failure(&cell, &["agent", place]);
    assert!(of("amqp://localhost").contains("`amqp` is not a kind of queue"), "{}", of("amqp://localhost"));
    let nobody = failure(&cell, &["agents", "nats://127.0.0.1:1"]);
    assert!(nobody.contains("error: nats://127.0.0.1:1 cannot be reached: "), "{nobody}");
    let run = done(&mut cell.run("remote", Some("nats://127.0.0.1:1"))).expect(1).err;
    assert!(run.contains("nats://127.0.0.1:1 cannot be reached: ") && !cell.folder.join("remote").exists(), "{run}");
    assert!(!cell.folder.join("settings").exists(), "no token was made for a queue that is not there");
}

#[test]
fn an_agent_with_another_token_refuses_a_campaign_and_says_what_to_do() {
    let cell = Cell::new("agents_other_token");
    let on = cell.folder.join("queue").display().to_string();
    let log = cell.folder.join("run.log");
    let run = started_with_log(&mut cell.run("remote", Some(&on)), &log);
    until("it is announced", || fs::read_dir(cell.folder.join("queue/campaigns")).is_ok_and(|all| all.count() == 1));
    let other = cell.folder.join("another_token").display().to_string();
    let missing = failure(&cell, &["agent", &on, "--token", &other]);
    assert!(missing.contains(&format!("the token in {other}: ")), "a token that was named is not made: {missing}");
    let other = token_in(&cell.folder);
    let mut agent = cell.command(&["agent", &on, "--token", &other]);
    let agent = agent.stderr(fs::File::create(cell.folder.join("agent.log")).unwrap()).spawn().unwrap();
    let agent = sesame_peers::Ended(agent);
    until("it refuses", || {
        let said = fs::read_to_string(cell.folder.join("agent.log")).unwrap();
        said.contains("is refused: it is signed with another token: copy the file of the token")
    });
    let strangers = format!("no agent works for this campaign; 1 agent or campaign on {on} has another token");
    until("the campaign says so, too", || fs::read_to_string(&log).unwrap().contains(&strangers));
    drop(agent);
    run.kill();
    let text = fs::read_to_string(cell.folder.join("settings/sesame/token")).unwrap();
    assert_eq!(text.trim().len(), 64);
    #[cfg(unix)]
    {
        use std::os::unix::fs::PermissionsExt as _;
        let mode = fs::metadata(cell.folder.join("settings/sesame/token")).unwrap().permissions().mode();
        assert_eq!(mode & 0o777, 0o600, "only its owner reads a token");
    }
    fs::write(cell.folder.join("settings/sesame/token"), "not a token").unwrap();
    assert!(failure(&cell, &["agents", &on]).contains("is not a token: 64 hexadecimal digits"));
}
