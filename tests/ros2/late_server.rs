//! A client that waits for its service and calls it once, while the server takes long to come up: its call is answered
//! as without the runner, although the service is cut.

use sesame_tests::workspace;

use crate::environment::{Domain, Space, Vendor};

#[test]
fn the_only_call_of_a_client_is_answered_however_late_the_server_comes() {
    let Some(python) = Vendor::Jazzy.python() else { return };
    let python = python.display().to_string();
    let domain = Domain::free();
    let program = workspace().join("tests/ros2/peers/gripper.py").display().to_string();
    let ready = "{ ready when line \"up\" within 120s }";
    let text = format!(
        "space gripper\n\
         system {{\n\
           simulator cell = ros2 {{ domain {domain} }}\n\
           message Closed = \"std_msgs/msg/Float64\"\n\
           topic closed = \"/closed\" : Closed\n\
           service grip = \"/gripper/close\" : \"std_srvs/srv/SetBool\"\n\
           node client \"/client\" {{\n\
             launch {python:?} {program:?} \"client\" \"{{ros-args}}\" {ready}\n\
             publishes closed, grip_request  subscribes grip_reply\n\
           }}\n\
           node server \"/server\" {{\n\
             launch {python:?} {program:?} \"server\" \"{{ros-args}}\" {ready}\n\
             publishes grip_reply  subscribes grip_request\n\
           }}\n\
         }}\n\
         metric finished maximise default 0 = max(closed.data)\n\
         operation lag on grip_reply = latency [0s, 1s]\n\
         campaign c {{\n\
           objectives finished\n\
           operations lag 1 per test\n\
           search     random {{ evaluations 1 }}\n\
           end        after 8s\n\
         }}\n",
        domain = domain.number,
    );
    let gripper = Space::write("late_server", domain, "gripper.sesame", &text);
    // The call comes before the run begins, as soon as all nodes are there, so nothing is left to be late in it.
    gripper
        .sesamec(&["run", "gripper.sesame", "--", "--allow-unheard", "--workers", "1", "--results", "one"])
        .expect(3);
    let listed = gripper.listed("one/1");
    assert_eq!(["T0", "T1"].map(|test| listed.value(test, "finished")), [1.0, 1.0], "{listed:#}");
}
