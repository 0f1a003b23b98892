//! A worker as a process: started, waited for, and ended with everything that it started.
//!
//! A worker ends what it started by itself, once its connection is closed: its simulator's input is closed, and what is
//! left a second later is killed. The supervisor waits for that, and kills what remains: the worker's group of
//! processes, and on Linux also what left the group. For that the supervisor becomes the parent of processes whose own
//! parent ended ("subreaper"), as each worker is while it lives. What comes to the supervisor therefore comes of a
//! worker that has ended, whichever it was, and can be ended without asking which: orphans of workers that live stay
//! with them.

use std::collections::BTreeSet;
use std::process::{Child, Command, ExitStatus};
use std::sync::{Mutex, MutexGuard, PoisonError};
use std::time::{Duration, Instant};
use std::{io, thread};

use sesame_lifecycle::{descendants, process_group};

#[cfg(target_os = "linux")]
use crate::campaign::fork_server::Forked;

/// The environment variable with a worker's number, which everything inherits that the worker starts.
pub(super) const WORKER: &str = "SESAME_WORKER";

/// How long a worker whose connection is closed may take to end what it started, and itself; and how long what outlives
/// it may take after that.
const END_LIMIT: Duration = Duration::from_secs(2);

/// How much more time a worker may ask for.
const MOST_MORE: Duration = Duration::from_secs(60);

/// The children of this process that are not to be taken for orphans. A process adopts orphans as a whole, so there is
/// one list for all pools in it.
static CHILDREN: Mutex<Children> = Mutex::new(Children { workers: BTreeSet::new(), earlier: None });

struct Children {
    /// Ids of workers that are not reaped yet.
    workers: BTreeSet<u32>,
    /// Ids of what there was below this process before its first worker: children of the shell that became this
    /// process.
    earlier: Option<BTreeSet<u32>>,
}

impl Children {
    fn lock() -> MutexGuard<'static, Children> {
        // It is whole between any two calls of it.
        CHILDREN.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Whether a child of this process is none that a worker left behind.
    fn are_without(id: u32) -> bool {
        let children = Children::lock();
        let Some(earlier) = &children.earlier else { return true };
        // Where there were others before, what comes to us may be an orphan of theirs.
        children.workers.contains(&id) || earlier.contains(&id) || !earlier.is_empty() && !is_of_a_worker(id)
    }
}

/// A worker's process. Dropping it ends the process and everything that it started.
pub(super) struct WorkerProcess {
    process: Process,
    status: Option<ExitStatus>,
    /// How long it may take to end once its connection is closed.
    end_limit: Duration,
}

/// Who can wait for it.
enum Process {
    /// This process: it is its child.
    Child(Child),
    /// The process that forked it.
    #[cfg(target_os = "linux")]
    Forked(Forked),
}

impl WorkerProcess {
    /// Takes a worker that was forked in a group of its own.
    #[cfg(target_os = "linux")]
    pub(super) fn forked(forked: Forked) -> WorkerProcess {
        WorkerProcess { process: Process::Forked(forked), status: None, end_limit: END_LIMIT }
    }

    /// Starts it, in a group of its own where the system has groups.
    pub(super) fn start(mut command: Command) -> io::Result<WorkerProcess> {
        process_group::own(&mut command);
        // Held until the child is in the list: until then it would be taken for an orphan.
        let mut children = Children::lock();
        if children.earlier.is_none() {
            children.earlier = Some(descendants::adopted(|_| false).iter().map(|process| process.id()).collect());
            // Where the system cannot do that, groups have to do.
            descendants::adopt_orphans();
        }
        let child = command.spawn()?;
        children.workers.insert(child.id());
        Ok(WorkerProcess { process: Process::Child(child), status: None, end_limit: END_LIMIT })
    }

    /// Gives it this much more time to end once its connection is closed.
    pub(super) fn extend_end_limit(&mut self, more: Duration) {
        self.end_limit = END_LIMIT + more.min(MOST_MORE);
    }

    /// Its status once it has ended; then everything that it started is ended too.
    pub(super) fn ended(&mut self) -> Option<ExitStatus> {
        if self.status.is_none() {
            let has_ended = match &mut self.process {
                Process::Child(child) => process_group::has_ended(child),
                #[cfg(target_os = "linux")]
                Process::Forked(forked) => forked.has_ended(),
            };
            if has_ended {
                self.end();
            }
        }
        self.status
    }

    /// Waits until it has ended, at most this long.
    pub(super) fn wait(&mut self, limit: Duration) -> Option<ExitStatus> {
        let started = Instant::now();
        let mut pause = Duration::from_micros(500);
        loop {
            let ended = self.ended();
            if ended.is_some() || started.elapsed() >= limit {
                return ended;
            }
            thread::sleep(pause);
            pause = (pause * 2).min(Duration::from_millis(10));
        }
    }

    /// Ends its group and it, and what either left behind.
    fn end(&mut self) {
        match &mut self.process {
            Process::Child(child) => {
                // It is reaped afterwards: until then its id is given to no other process, and no other group.
                process_group::kill(child);
                self.status = child.wait().ok();
                Children::lock().workers.remove(&child.id());
                // What the system does not let go is left to it.
                descendants::end_adopted(Children::are_without, END_LIMIT);
            }
            #[cfg(target_os = "linux")]
            Process::Forked(forked) => self.status = Some(forked.end()),
        }
    }
}

impl Drop for WorkerProcess {
    fn drop(&mut self) {
        if self.status.is_none() && self.wait(self.end_limit).is_none() {
            self.end();
        }
    }
}

/// Whether a process inherited the environment of a worker. What has ended has none any more.
fn is_of_a_worker(id: u32) -> bool {
    let environment = std::fs::read(format!("/proc/{id}/environ")).unwrap_or_default();
    environment.split(|&byte| byte == 0).any(|variable| variable.starts_with(format!("{WORKER}=").as_bytes()))
}
