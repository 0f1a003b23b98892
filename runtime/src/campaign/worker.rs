//! A worker process: runs the tests it is sent, one after another, until the supervisor is gone.

use std::io;
use std::net::{SocketAddr, TcpStream};
use std::path::Path;
use std::sync::mpsc;
use std::thread;

use sesame_plan::CampaignPlan;

use super::frames::{self, Hello, Job, Reply};
use super::traced;
use crate::changed_files::ChangedFiles;
use crate::evaluate::Custom;
use crate::last_panic;
use crate::metric::MetricTable;
use crate::observation::{Observation, Outcome, WallTime};
use crate::runner::Runner;
use crate::wire::WireTable;

/// Serves the supervisor at this address until it closes the connection.
///
/// A panic of the simulator or of a hook is the outcome of its test; the worker goes on with a fresh connection to the
/// simulator.
pub fn serve(runner: &Runner, plan: &CampaignPlan, supervisor: SocketAddr, token: String) -> io::Result<()> {
    let mut stream = TcpStream::connect(supervisor)?;
    stream.set_nodelay(true)?;
    frames::send(&mut stream, &Hello { token })?;
    last_panic::listen();

    let wires = WireTable::new(plan);
    let metrics = MetricTable::new(plan, &wires, runner.hooks).map_err(io::Error::other)?;
    let jobs = read_jobs(stream.try_clone()?);
    let space = Path::new(runner.directory).join(runner.space);
    let may_change = plan.operations.iter().any(|operation| operation.kind.is_offline());
    let files = if may_change { ChangedFiles::for_worker(&space) } else { Ok(ChangedFiles::unlocked(&space)) };
    let mut custom = Custom { hooks: runner.operations, files: files.map_err(io::Error::other)? };
    let mut transport = None;
    let directory = std::env::current_dir()?;
    for job in jobs {
        let simulator = transport.get_or_insert_with(|| runner.connect.transport(plan));
        let (observation, trace_failure) =
            traced::run(plan, &wires, &metrics, simulator.as_mut(), &job, &directory, &mut custom);
        if matches!(observation.outcome, Outcome::Crash { .. }) {
            transport = None;
        }
        frames::send(&mut stream, &Reply { number: job.number, observation, trace_failure })?;
    }
    Ok(())
}

/// Reads jobs in a thread of its own. When the supervisor is gone the process ends at once, even in the middle of a
/// test that hangs, so that no worker outlives its supervisor.
fn read_jobs(mut stream: TcpStream) -> mpsc::Receiver<Job> {
    let (sender, jobs) = mpsc::channel();
    thread::spawn(move || {
        while let Ok(job) = frames::receive(&mut stream) {
            if sender.send(job).is_err() {
                return;
            }
        }
        #[cfg(feature = "process")]
        crate::transport::end_simulators();
        std::process::exit(0);
    });
    jobs
}

/// The observation of a run that left nothing but its cause.
pub(super) fn crashed(message: String) -> Observation {
    empty(Outcome::Crash { message })
}

pub(super) fn empty(outcome: Outcome) -> Observation {
    Observation {
        outcome,
        end: 0.0,
        operations: Vec::new(),
        unheard: Vec::new(),
        metrics: Vec::new(),
        messages: 0,
        warnings: Vec::new(),
        wall: WallTime::default(),
    }
}
