//! A breakpoint in a simulator, at a terminal.

use sesame_tests::done;

use crate::package::{CART, Place};

/// A terminal with a user who looks at a value and goes on.
const USER: &str = r#"
import os, pty, select, subprocess, sys

ours, theirs = pty.openpty()
debugged = subprocess.Popen([sys.executable, "debugged.py"], stdin=theirs, stdout=theirs, stderr=theirs)
os.close(theirs)
seen, typed = b"", [b"p 40 + self.position\n", b"c\n"]
while select.select([ours], [], [], 60)[0]:
    try:
        seen += os.read(ours, 4096)
    except OSError:
        break
    if seen.count(b"(Pdb)") > 2 - len(typed) and typed:
        os.write(ours, typed.pop(0))
assert debugged.wait() == 0 and b"45.0" in seen and b"finished True" in seen, seen.decode()
"#;

#[test]
fn a_breakpoint_in_a_simulator_stops_in_the_terminal_and_the_run_goes_on_after_it() {
    let stops = CART.replace(
        "        bus.publish(POSITION, self.position)",
        "        if not World.has_stopped:\n            World.has_stopped = True\n            breakpoint()\n        \
         bus.publish(POSITION, self.position)",
    );
    let Some(place) =
        Place::new("python_debugging", &stops.replace("class World:", "class World:\n    has_stopped = False"))
    else {
        return;
    };
    let program = "import sesamec\nfrom sim import World\n\
                   run = sesamec.run('cart/cart.sesame', simulator=World, evaluations=1, debug=True)\n\
                   print('finished', run.stop is not None)\n";
    place.write("debugged.py", program);
    done(&mut place.python(USER)).expect(0);
}
