//! A worker process: runs the tests it is sent, one after another, until the supervisor is gone.

use std::sync::{Arc, Mutex, PoisonError, mpsc};
use std::time::Duration;
use std::{io, thread};

use sesame_lifecycle::descendants;
use sesame_plan::CampaignPlan;
use sesame_relay::evaluate::Custom;
use sesame_relay::metric::MetricTable;
use sesame_relay::panic_capture;
use sesame_relay::wire::WireTable;

use crate::campaign::executor::Job;
use crate::campaign::link::{self, Address, Stream};
use crate::campaign::protocol::{self, Reply, Said};
use crate::campaign::traces;
use crate::changed_files::ChangedFiles;
use crate::runner::Runner;

/// Serves the supervisor that started this process until it closes the connection, and then ends what was started for
/// it.
///
/// A panic of the simulator or of a hook is the outcome of its test; the worker goes on with a fresh connection to the
/// simulator.
pub fn serve(runner: &Runner, plan: &CampaignPlan, supervisor: &Address) -> io::Result<()> {
    // Nothing is started before the first test.
    let mut transport = runner.connect.transport(plan);
    let stream = link::connect(supervisor, transport.capabilities().lock_stepped, end_limit(plan))?;
    let jobs = read_jobs(stream.try_clone()?);
    let stream = Arc::new(Mutex::new(stream));
    transport.tell_waiting(says_waiting(&stream));
    panic_capture::install();
    // So that what leaves its parents can be found when it is to end. Where the system cannot do that, groups have to
    // do.
    descendants::adopt_orphans();

    let wires = WireTable::new(plan);
    let metrics = MetricTable::new(plan, &wires, runner.hooks).map_err(io::Error::other)?;
    let space = runner.directory.join(&runner.space);
    let may_change = plan.operations.iter().any(|operation| operation.kind.calls_code_outside_the_run());
    let files = if may_change { ChangedFiles::for_worker(&space) } else { Ok(ChangedFiles::unlocked(&space)) };
    let mut custom = Custom { hooks: runner.operations, files: Box::new(files.map_err(io::Error::other)?) };
    let mut transport = Some(transport);
    let directory = std::env::current_dir()?;
    let mut compensated = plan.clone();
    for job in jobs {
        let simulator = transport.get_or_insert_with(|| {
            let mut transport = runner.connect.transport(plan);
            transport.tell_waiting(says_waiting(&stream));
            transport
        });
        compensated.compensation.clone_from(&job.compensation);
        let (observation, trace_failure) =
            traces::run(&compensated, &wires, &metrics, simulator.as_mut(), &job, &directory, &mut custom);
        let (incidents, added) = (simulator.incidents(), simulator.added());
        if !observation.outcome.is_whole() {
            transport = None;
        }
        let reply = Reply { number: job.number, observation, trace_failure, incidents, added };
        let sent = say(&stream, &Said::Reply(Box::new(reply)));
        if sent.is_err() {
            end_what_was_started();
            return sent;
        }
    }
    unreachable!("jobs come until the process is ended")
}

/// Tells the supervisor something.
fn say(stream: &Mutex<Stream>, said: &Said) -> io::Result<()> {
    // A frame that was broken off by a panic makes the rest unreadable: the supervisor then replaces this worker.
    protocol::send(&mut *stream.lock().unwrap_or_else(PoisonError::into_inner), said)
}

/// Tells the supervisor what the start of a system waits for.
fn says_waiting(stream: &Arc<Mutex<Stream>>) -> Box<dyn FnMut(&str) + Send> {
    let stream = Arc::clone(stream);
    // If the supervisor is gone, the worker ends anyway.
    Box::new(move |missing| _ = say(&stream, &Said::Waits(missing.to_owned())))
}

/// How long it may take to end the programs that the plan starts.
fn end_limit(plan: &CampaignPlan) -> Duration {
    #[cfg(feature = "process")]
    return sesame_lifecycle::launch::end_limit(plan);
    #[cfg(not(feature = "process"))]
    {
        let _ = plan;
        Duration::ZERO
    }
}

/// Reads jobs in a thread of its own. When the supervisor is gone, this thread ends what the worker started, and then
/// the worker, even in the middle of a test that hangs: so no worker outlives its supervisor, and no simulator its
/// worker.
fn read_jobs(mut stream: Stream) -> mpsc::Receiver<Job> {
    let (sender, jobs) = mpsc::channel();
    thread::spawn(move || {
        while let Ok(job) = protocol::receive(&mut stream) {
            if sender.send(job).is_err() {
                break;
            }
        }
        end_what_was_started();
        std::process::exit(0);
    });
    jobs
}

/// Ends simulators, after the time that they are given to end by themselves, and then everything else that is below
/// this process.
fn end_what_was_started() {
    // The later one of the two threads that may get here waits until the earlier one is done.
    static TURN: Mutex<()> = Mutex::new(());
    let _turn = TURN.lock();
    #[cfg(feature = "process")]
    sesame_relay::transport::end_simulators();
    descendants::end_adopted(|_| false, Duration::ZERO);
}
