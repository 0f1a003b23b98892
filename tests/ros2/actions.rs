//! Actions between real servers and clients: goals, their answers, feedback, results and cancellations pass through the
//! relay undisturbed, and each of them can be lost, late or changed.

use std::fs;

use sesame_tests::{command, done, fresh_folder, sesamec, workspace};

use crate::environment::{Domain, Space, Vendor};
use crate::peer::Peer;
use crate::scans::looked;

/// Two robots that count, and a manager that calls both: it lets the first one count to the end, and cancels what the
/// second one does.
fn robots(name: &str) -> Option<Space> {
    let python = Vendor::Jazzy.python()?;
    let domain = Domain::free();
    let share = Vendor::share(&python).display().to_string();
    let python = python.display().to_string();
    let program = workspace().join("tests/ros2/peers/counter.py").display().to_string();
    let ready = "{ ready when line \"up\" within 120s }";
    let text = format!(
        "space robots\n\
             system {{\n\
               simulator robots = ros2 {{ domain {domain}  types {share:?} }}\n\
               message Word = \"std_msgs/msg/String\" {{ data: text }}\n\
               message Time = \"std_msgs/msg/Float64\" {{ data: real[s] }}\n\
               topic said = \"/{{r1,r2}}/said\" : Word\n\
               topic took = \"/{{r1,r2}}/took\" : Time\n\
               topic counted = \"/{{r1,r2}}/counted\" : Time\n\
               action nav = \"/{{r1,r2}}/count\" : \"test_msgs/action/Fibonacci\"\n\
               node counter \"/{{r1,r2}}/counter\" {{\n\
                 launch {python:?} {program:?} \"counter\" \"{{ros-args}}\" \"--ros-args\" \"-r\" \"__ns:=/{{member}}\" {ready}\n\
                 serves nav\n\
               }}\n\
               node manager \"/manager\" {{\n\
                 launch {python:?} {program:?} \"manager\" \"r1\" \"r2-\" \"{{ros-args}}\" {ready}\n\
                 publishes said, took, counted  calls nav\n\
               }}\n\
             }}\n\
             metric succeeded maximise default 0 = count(said[r1].data == \"succeeded\")\n\
             metric cancelled default 0 = count(said[r2].data == \"cancelled\")\n\
             metric uncancelled default 0 = count(said[r2].data == \"succeeded\")\n\
             metric accepted  default 0 = count(said[r1].data == \"accepted\")\n\
             metric refused   default 0 = count(said[r1].data == \"refused\")\n\
             metric unanswered default 0 = count(said[r1].data == \"no answer\")\n\
             metric felt      default 0 = count(said[r1].data == \"feedback\")\n\
             metric longest   default 0s = max(took[r1].data)\n\
             metric furthest  default 0s = max(counted[r1].data)\n\
             metric goals     default 0 = count(nav_goal_request[r1].goal.order == 4)\n\
             metric reached   default 0 = count(nav_result_reply[r1].status == STATUS_SUCCEEDED)\n\
             metric executing default 0s = duration(count of nav_status[r1].status_list[status == STATUS_EXECUTING] > 0)\n\
             metric goal_time default 0s = max(now - each of nav_status[r1].status_list[status == STATUS_EXECUTING].goal_info.stamp)\n\
             operation lost   on nav_goal_request = blackhole\n\
             operation late   on nav_result_reply = latency [0s, 3s]\n\
             operation silent on nav_feedback from counter[r1] = blackhole\n\
             operation refuse on nav_goal_reply.accepted = stuck at false\n\
             operation deaf   on nav_cancel_request = blackhole\n\
             operation more   on nav_goal_request.goal.order = stuck at [0, 20]\n\
             test no_goals   {{ lost from 1s to 4s }}\n\
             test is_late    {{ late delay 1s from 0s to 6s }}\n\
             test is_silent  {{ silent from 0s to 6s }}\n\
             test is_refused {{ refuse from 0s to 6s }}\n\
             test goes_on    {{ deaf from 0s to 6s }}\n\
             test counts_on  {{ more value 8 from 0s to 6s }}\n\
             campaign first {{\n\
               objectives succeeded\n\
               observes   cancelled, uncancelled, accepted, refused, unanswered, felt, longest, furthest, goals, reached, executing, goal_time\n\
               operations lost, late, silent, refuse, deaf, more 1 per test\n\
               search     random {{ evaluations 2 }}\n\
               end        after 6s\n\
             }}\n",
        domain = domain.number,
    );
    Some(Space::write(name, domain, "robots.sesame", &text))
}

#[test]
fn each_part_of_an_action_passes_undisturbed_and_can_be_disturbed() {
    let Some(robots) = robots("actions") else { return };
    robots.sesamec(&["check", "robots.sesame"]).expect(0);
    let wiring = robots.sesamec(&["explain", "wiring", "robots.sesame"]).expect(0).out;
    for part in ["send_goal", "cancel_goal", "get_result", "status"] {
        let rule = format!("-r /r1/count/_action/{part}:=/r1/count/_action/{part}/undisturbed");
        assert!(wiring.contains(&rule), "{wiring}");
    }
    let rule = "-r /r1/count/_action/feedback:=/r1/count/_action/feedback/from/counter/r1";
    assert!(wiring.contains(rule), "{wiring}");
    assert!(!wiring.contains("# node manager"), "a client keeps its names: {wiring}");

    let tests = ["no_goals", "is_late", "is_silent", "is_refused", "goes_on", "counts_on"];
    robots.sesamec(&[&["known", "robots.sesame"], &tests[..]].concat()).expect(0);
    let listed = robots.listed("known");
    let value = |test: &str, metric: &str| listed.value(test, metric);
    let one = |metric: &str| value("T0", metric);
    // Undisturbed, goals are reached or cancelled, and what the topics of the action say is what happened.
    assert!(one("succeeded") >= 2.0 && one("accepted") >= 2.0 && one("cancelled") >= 2.0, "{listed:#}");
    assert!(one("refused") == 0.0, "{listed:#}");
    assert!(one("felt") >= 2.0 * one("succeeded") && one("furthest") == 4.0, "{listed:#}");
    // On a busy machine an answer may come too late for the manager.
    assert!((one("goals") - one("accepted") - one("unanswered")).abs() <= 1.0, "{listed:#}");
    assert!((one("reached") - one("succeeded")).abs() <= 1.0 && one("executing") > 1.0, "{listed:#}");
    // A goal counts to four, with a pause of 100 ms after each number, and stamps are those of the wall clock.
    assert!(one("goal_time") > 0.39 && one("goal_time") < 6.0, "{listed:#}");

    assert!(value("T1", "unanswered") >= 1.0, "goals are lost: {listed:#}");
    assert!(value("T1", "goals") > value("T1", "reached") + 1.0, "the server never had them: {listed:#}");
    assert!(value("T2", "longest") > 1.3 && value("T2", "succeeded") >= 1.0, "results are late: {listed:#}");
    assert!(value("T3", "felt") <= 4.0 && value("T3", "succeeded") >= 2.0, "no feedback comes: {listed:#}");
    assert!(value("T4", "refused") >= 2.0 && value("T4", "accepted") <= 1.0, "goals are refused: {listed:#}");
    assert!(value("T5", "uncancelled") >= 1.0 && value("T5", "cancelled") <= 1.0, "nothing is cancelled: {listed:#}");
    assert!(value("T6", "furthest") == 8.0, "it counts to another number: {listed:#}");
}

#[test]
fn a_scan_declares_actions_with_their_servers_and_clients() {
    let Some(python) = Vendor::Jazzy.python() else { return };
    let (folder, domain) = (fresh_folder("scanned_actions"), Domain::free());
    let start = |arguments: &[&str]| Peer::start(&python, &domain, "counter.py", arguments);
    let _robots_and_manager = [
        start(&["counter", "--ros-args", "-r", "__ns:=/r1"]),
        start(&["counter", "--ros-args", "-r", "__ns:=/r2"]),
        start(&["manager", "r1", "r2"]),
    ];
    let share = Vendor::share(&python).display().to_string();
    let number = domain.number.to_string();
    let arguments = ["scan", "ros2", "--domain", &number, "--types", &share, "--seconds", "8"];
    let all = [
        "action count = \"/{r1,r2}/count\" : \"test_msgs/action/Fibonacci\"  // 1 server, 1 client",
        "node counter \"/{r1,r2}/counter\"",
        "serves count",
        "calls count",
    ];
    let squeezed = |text: &str| text.split_whitespace().collect::<Vec<_>>().join(" ");
    let space = looked(&folder, &arguments, |found| {
        let found = squeezed(found);
        all.iter().all(|part| found.contains(&squeezed(part)))
    });
    fs::write(folder.join("scanned.sesame"), space).expect("a space can be written");
    done(command(sesamec()).args(["check", "scanned.sesame"]).current_dir(&folder)).expect(0);
}
