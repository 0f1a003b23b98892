//! Ctrl-C in a program that runs a campaign.

use std::os::unix::process::CommandExt as _;
use std::process::Stdio;

use nix::sys::signal::{Signal, kill, killpg};
use nix::unistd::Pid;
use sesame_patience::until;
use sesame_peers::Ended;
use sesame_record::Repository;

use crate::package::{CART, Place};

/// What a program does while a run is stopped: the first is what a terminal does.
#[derive(Debug, Clone, Copy)]
enum Sent {
    ToAll,
    ToTheProgram,
}

#[test]
fn a_run_that_is_stopped_goes_on_with_resume() {
    let slow =
        CART.replace("        self.speed +=", "        __import__(\"time\").sleep(0.0003)\n        self.speed +=");
    let Some(place) = Place::new("python_stopped", &slow) else { return };
    let whole = place.run("", "results='whole', evaluations=30").expect(0).digest();
    for (sent, results) in [(Sent::ToAll, "stopped"), (Sent::ToTheProgram, "alone")] {
        let program = format!(
            "import sesamec\nfrom sim import World\n\
             try:\n    sesamec.run('cart/cart.sesame', simulator=World, results='{results}', evaluations=30)\n\
             except sesamec.Stopped:\n    raise SystemExit(7)\n"
        );
        let mut run = place.python(&program);
        run.process_group(0);
        let mut run = Ended(run.stdout(Stdio::null()).stderr(Stdio::null()).spawn().unwrap());
        let folder = place.folder.join(results).join("1");
        until("some tests are recorded", || {
            Repository::open(&folder).is_ok_and(|results| results.numbers().is_ok_and(|all| all.len() > 10))
        });
        let process = Pid::from_raw(run.0.id().cast_signed());
        match sent {
            Sent::ToAll => killpg(process, Signal::SIGINT).unwrap(),
            Sent::ToTheProgram => kill(process, Signal::SIGINT).unwrap(),
        }
        let mut status = None;
        until("it has ended", || {
            status = run.0.try_wait().unwrap();
            status.is_some()
        });
        assert_eq!(status.and_then(|status| status.code()), Some(7), "{sent:?}");
        let resumed = place.run("", &format!("resume='{}'", folder.display()));
        assert_eq!(resumed.expect(0).digest(), whole, "{sent:?}");
    }
}
