//! A fleet in namespaces, of nodes that know nothing of it: each has its own member of a group, one of them is
//! disturbed by its name or by the choice of a test, a scene sets a parameter of a node, another one is in the
//! arguments of all carts, and a start that waits for one says so.

use sesame_tests::workspace;

use crate::environment::{Domain, Space, Vendor};

/// Two carts and their manager, with further declarations of their system.
fn fleet(name: &str, more: &str) -> Option<Space> {
    let python = Vendor::Jazzy.python()?.display().to_string();
    let domain = Domain::first_of(2);
    let program = workspace().join("tests/ros2/peers/cart.py").display().to_string();
    let ready = "{ ready when line \"up\" within 120s }";
    let text = format!(
        "space carts\n\
             system {{\n\
               simulator carts = ros2 {{ domain {domain} }}\n\
               message Place = \"std_msgs/msg/Float64\" {{ data: real[m] }}\n\
               message Speed = \"std_msgs/msg/Float64\" {{ data: real[m/s] }}\n\
               topic place = \"/{{r1,r2}}/place\" : Place\n\
               topic speed = \"/{{r1,r2}}/speed\" : Speed\n\
               node cart \"/{{r1,r2}}/cart\" {{\n\
                 launch {python:?} {program:?} \"cart\" \"{{ros-args}}\" \"--ros-args\" \"-r\" \"__ns:=/{{member}}\"\n\
                        \"-p\" \"start:={{start}}\" {ready}\n\
                 publishes place  subscribes speed\n\
               }}\n\
               node manager \"/manager\" {{\n\
                 launch {python:?} {program:?} \"manager\" \"r1\" \"r2\" \"{{ros-args}}\" {ready}\n\
                 publishes speed  subscribes place\n\
               }}\n\
               {more}\n\
             }}\n\
             metric ahead  maximise default 0m = max(place[r2].data - place[r1].data) outbound\n\
             metric behind maximise default 0m = max(place[r1].data - place[r2].data) outbound\n\
             metric apart  maximise default 0m = max(max of place.data - place.data) outbound\n\
             metric far    maximise default 0m = max(max of place.data) outbound\n\
             parameter pace \"manager/pace\": real[m/s] in [0m/s, 4m/s] default 1m/s\n\
             parameter start: real[m] in [-9km, 9km] default 0m\n\
             operation slip on place[r2].data from cart = bias [0m, 9m]\n\
             operation deaf on one of speed.data to cart = stuck at [0m/s, 1m/s]\n\
             operation stop on node one of cart = pause\n\
             operation skid on parameter \"grip\" of one of cart = set [0, 1]\n\
             test slips {{ slip bias 9m from 1s to 2s }}\n\
             test stands {{ stop member \"r1\" from 1s to 5s }}\n\
             test hears_nothing {{ deaf value 0m/s member \"r2\" from 1s to 6s }}\n\
             test skids {{ skid value 0 member \"r2\" from 1s to 6s }}\n\
             test races {{ pace value 4m/s before start }}\n\
             test starts_behind {{ start value -9km before start }}\n\
             campaign first {{\n\
               objectives apart\n\
               observes   ahead, behind, far\n\
               operations slip, deaf, stop, skid, pace, start 1 per test\n\
               search     random {{ evaluations 2 }}\n\
               end        after 6s\n\
             }}\n",
        domain = domain.number,
    );
    Some(Space::write(name, domain, "carts.sesame", &text))
}

#[test]
fn each_cart_has_its_own_topics_one_of_them_is_disturbed_and_a_scene_drives_them_faster() {
    let Some(fleet) = fleet("fleet_in_namespaces", "") else { return };
    let checked = fleet.sesamec(&["check", "carts.sesame"]).expect(0);
    assert!(!checked.err.contains("W0013"), "each publishes for itself: {}", checked.err);
    let wiring = fleet.sesamec(&["explain", "wiring", "carts.sesame"]).expect(0).out;
    for line in ["-r /r1/place:=/r1/place/from/cart/r1 -r /r1/speed:=/r1/speed/to/cart/r1", "/r2/speed/to/cart/r2"] {
        assert!(wiring.contains(line), "{wiring}");
    }
    assert!(!wiring.contains("/r1/place/from/cart/r2"), "{wiring}");

    let tests = ["slips", "stands", "hears_nothing", "skids", "races", "starts_behind"];
    fleet.sesamec(&[&["known", "carts.sesame", "--workers", "2"], &tests[..]].concat()).expect(0);
    let listed = fleet.listed("known");
    let value = |test: &str, metric: &str| listed.value(test, metric);
    // Undisturbed they drive side by side, but for what a busy machine does to one of them.
    let beside = 1.5;
    assert!(value("T0", "apart") < beside, "{listed:#}");
    let (fore, aft) = (|test: &str| value(test, "ahead"), |test: &str| value(test, "behind"));
    assert!(fore("T1") > 9.0 - beside && aft("T1") < beside, "only `r2` slips: {listed:#}");
    assert!(fore("T2") > 4.0 - beside && aft("T2") < beside, "only `r1` stands: {listed:#}");
    assert!(aft("T3") > 5.0 - beside && fore("T3") < beside, "only `r2` hears nothing: {listed:#}");
    assert!(aft("T4") > 5.0 - beside && fore("T4") < beside, "only `r2` has no grip: {listed:#}");
    // Each cart has it as a parameter of floating point, or it would not start.
    assert!(value("T6", "far") < -8000.0 && value("T0", "far") > -1.0, "both start behind: {listed:#}");
    assert!(value("T5", "far") > 2.0 * value("T0", "far"), "the manager has another pace: {listed:#}");
}

#[test]
fn a_start_says_what_it_waits_for() {
    let Some(fleet) = fleet("fleet_that_waits", "node ghost \"/ghost\" { subscribes place }") else { return };
    let run = fleet.sesamec(&["run", "carts.sesame"]);
    let said = "first: the system is not complete yet: 1 of 2 subscribe to `/r1/place`: `manager`, `ghost`; 1 of 2 \
                subscribe to `/r2/place`: `manager`, `ghost`";
    assert!(run.err.contains(said), "{}", run.err);
}
