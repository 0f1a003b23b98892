//! Processes that a process started, directly and indirectly, and how they are ended.
//!
//! A process group contains only the processes that stay in it: one that calls `setsid` leaves it, and a process whose
//! parent ends is no longer below its grandparent. On Linux this process can become the parent of such orphans, so that
//! it finds all of them by walking `/proc`. On other systems nothing is found here, and only groups can be ended.

use std::time::{Duration, Instant};

/// How long processes may take to end after `SIGKILL`. It takes longer only if the system itself blocks the process.
const GONE_LIMIT: Duration = Duration::from_secs(5);

/// A process: its id and its start time, since ids are reused.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct Process {
    id: u32,
    #[cfg(target_os = "linux")]
    started: u64,
}

impl Process {
    /// Its id.
    pub fn id(self) -> u32 {
        self.id
    }
}

/// Makes this process the parent of all processes below it whose own parent ends. Returns whether the system supports
/// this.
pub fn adopt_orphans() -> bool {
    #[cfg(target_os = "linux")]
    {
        rustix::process::set_child_subreaper(Some(rustix::process::getpid())).is_ok()
    }
    #[cfg(not(target_os = "linux"))]
    {
        false
    }
}

/// The children that this process adopted, with all processes below them. Children for which `is_own` holds are those
/// that it started itself.
pub fn adopted(is_own: impl Fn(u32) -> bool) -> Vec<Process> {
    #[cfg(target_os = "linux")]
    {
        linux::adopted(is_own)
    }
    #[cfg(not(target_os = "linux"))]
    {
        let _ = is_own;
        Vec::new()
    }
}

/// The living processes below a process.
#[cfg(target_os = "linux")]
pub fn below(id: u32) -> Vec<Process> {
    linux::below(&linux::all(), vec![id])
}

/// Waits up to `patience` until all these processes have ended; then ends the remaining ones, all processes below them,
/// and all in groups and sessions that they lead. Returns how many remain: processes that the system blocks, or does
/// not permit us to end. Children of this process among them are reaped, so no other code may wait for them.
fn end(processes: Vec<Process>, patience: Duration) -> usize {
    #[cfg(target_os = "linux")]
    {
        linux::end(processes, patience)
    }
    #[cfg(not(target_os = "linux"))]
    {
        let _ = patience;
        processes.len()
    }
}

/// Ends the processes that [`adopted`] finds, as `end` does, until there are none; returns how many remain.
pub fn end_adopted(is_own: impl Fn(u32) -> bool, patience: Duration) -> usize {
    let started = Instant::now();
    loop {
        let found = adopted(&is_own);
        if found.is_empty() {
            return 0;
        }
        let left = end(found, patience.saturating_sub(started.elapsed()));
        if left > 0 || started.elapsed() >= patience + GONE_LIMIT {
            return left;
        }
    }
}

#[cfg(target_os = "linux")]
mod linux {
    use std::collections::BTreeSet;
    use std::time::{Duration, Instant};
    use std::{fs, thread};

    use rustix::process::{Pid, Signal, WaitOptions, kill_process, waitpid};

    use super::{GONE_LIMIT, Process};

    /// A process as `/proc` describes it.
    pub(super) struct Entry {
        process: Process,
        parent: u32,
        group: u32,
        session: u32,
        is_alive: bool,
    }

    /// All processes that can be seen.
    pub(super) fn all() -> Vec<Entry> {
        let Ok(folder) = fs::read_dir("/proc") else { return Vec::new() };
        let ids = folder.filter_map(|entry| entry.ok()?.file_name().to_str()?.parse().ok());
        ids.filter_map(entry).collect()
    }

    fn entry(id: u32) -> Option<Entry> {
        // The name of a process may contain spaces, parentheses, and bytes that are not UTF-8.
        let stat = fs::read(format!("/proc/{id}/stat")).ok()?;
        let after_name = stat.iter().rposition(|&byte| byte == b')')? + 1;
        let fields = String::from_utf8_lossy(&stat[after_name..]).into_owned();
        let fields: Vec<&str> = fields.split_whitespace().collect();
        let number = |at: usize| fields.get(at)?.parse().ok();
        Some(Entry {
            process: Process { id, started: fields.get(19)?.parse().ok()? },
            parent: number(1)?,
            group: number(2)?,
            session: number(3)?,
            is_alive: !matches!(*fields.first()?, "Z" | "X" | "x"),
        })
    }

    /// The living processes below these.
    pub(super) fn below(all: &[Entry], mut known: Vec<u32>) -> Vec<Process> {
        let mut found = Vec::new();
        let mut at = 0;
        while let Some(&parent) = known.get(at) {
            at += 1;
            for entry in all.iter().filter(|entry| entry.parent == parent) {
                if known.contains(&entry.process.id) {
                    continue;
                }
                known.push(entry.process.id);
                if entry.is_alive {
                    found.push(entry.process);
                }
            }
        }
        found
    }

    #[cfg(test)]
    pub(super) fn leads_a_session(process: Process) -> bool {
        entry(process.id).is_some_and(|entry| entry.session == process.id)
    }

    pub(super) fn adopted(is_own: impl Fn(u32) -> bool) -> Vec<Process> {
        let this = std::process::id();
        let all = all();
        // Ended ones are included, since they have to be reaped.
        let children = all.iter().filter(|entry| entry.parent == this && !is_own(entry.process.id));
        let mut found: Vec<Process> = children.map(|entry| entry.process).collect();
        let deeper = below(&all, found.iter().map(|process| process.id).collect());
        found.extend(deeper);
        found
    }

    pub(super) fn end(processes: Vec<Process>, patience: Duration) -> usize {
        let this = std::process::id();
        let mut wanted: BTreeSet<Process> = processes.into_iter().collect();
        let started = Instant::now();
        let mut pause = Duration::from_micros(500);
        loop {
            let all = all();
            let kill = started.elapsed() >= patience;
            if kill {
                widen(&mut wanted, &all, this);
            }
            let mut left = 0;
            for entry in all.iter().filter(|entry| wanted.contains(&entry.process)) {
                let Some(id) = Pid::from_raw(entry.process.id.cast_signed()) else { continue };
                if kill && entry.is_alive {
                    // An error means that it has just ended.
                    kill_process(id, Signal::KILL).ok();
                }
                if entry.parent == this {
                    // One that is still alive is reaped in a later round.
                    let reaped = waitpid(Some(id), WaitOptions::NOHANG);
                    left += usize::from(!matches!(reaped, Ok(Some(_)) | Err(rustix::io::Errno::CHILD)));
                } else {
                    left += usize::from(entry.is_alive);
                }
            }
            if left == 0 || started.elapsed() >= patience + GONE_LIMIT {
                return left;
            }
            thread::sleep(pause);
            pause = (pause * 2).min(Duration::from_millis(10));
        }
    }

    /// Adds the processes below the wanted ones, and those in groups and sessions that one of them leads.
    fn widen(wanted: &mut BTreeSet<Process>, all: &[Entry], this: u32) {
        let leaders: BTreeSet<u32> = wanted.iter().map(|process| process.id).collect();
        let led = |entry: &&Entry| leaders.contains(&entry.group) || leaders.contains(&entry.session);
        let mut members: Vec<Process> =
            all.iter().filter(led).map(|entry| entry.process).filter(|process| process.id != this).collect();
        let roots = all.iter().map(|entry| entry.process);
        let roots = roots.filter(|process| wanted.contains(process) || members.contains(process));
        let deeper = below(all, roots.map(|process| process.id).collect());
        members.extend(deeper);
        wanted.extend(members);
    }
}

#[cfg(target_os = "linux")]
#[cfg(test)]
mod tests {
    use std::io::{BufRead as _, BufReader};
    use std::process::{Child, Command, Stdio};

    use sesame_patience as patience;

    use super::*;

    /// A shell that has started these and waits. Dropping it ends all.
    struct Shell(Child);

    impl Shell {
        fn new(starts: &str) -> Shell {
            let script = format!("{starts}\necho ready\nread _");
            let mut command = Command::new("sh");
            let command = command.args(["-c", &script]).stdin(Stdio::piped()).stdout(Stdio::piped());
            let mut shell = Shell(command.spawn().unwrap());
            let mut line = String::new();
            BufReader::new(shell.0.stdout.take().unwrap()).read_line(&mut line).unwrap();
            assert_eq!(line, "ready\n");
            shell
        }

        fn below(&self) -> Vec<Process> {
            linux::below(&linux::all(), vec![self.0.id()])
        }
    }

    impl Drop for Shell {
        fn drop(&mut self) {
            end(self.below(), Duration::ZERO);
            drop(self.0.stdin.take());
            self.0.wait().unwrap();
        }
    }

    #[test]
    fn all_descendants_are_found_and_ended_even_in_sessions_of_their_own() {
        let shell = Shell::new("sleep 1001 &\nsetsid sleep 1002 &\nsh -c 'sleep 1003 & sleep 1004' &");
        patience::until("five processes, one of them with a session of its own", || {
            let leads = |process: &Process| linux::leads_a_session(*process);
            shell.below().len() == 5 && shell.below().iter().any(leads)
        });
        let found = shell.below();
        assert_eq!(found.len(), 5, "four sleeping processes and the inner shell: {found:?}");
        assert!(!found.iter().any(|process| process.id == shell.0.id()));
        assert_eq!(end(found, Duration::ZERO), 0);
        assert_eq!(shell.below(), []);
    }

    #[test]
    fn a_process_that_ends_in_time_is_not_killed() {
        let folder = tempfile::tempdir().unwrap();
        let ended = folder.path().join("ended");
        let shell = Shell::new(&format!("(sleep 0.2; echo yes > '{}') &", ended.display()));
        assert_eq!(end(shell.below(), patience::LIMIT), 0);
        assert_eq!(std::fs::read_to_string(ended).unwrap(), "yes\n");
    }

    #[test]
    fn a_process_with_the_reused_id_of_an_ended_one_is_not_ended() {
        let shell = Shell::new("sleep 1000 &");
        let found = shell.below();
        assert_eq!(found.len(), 1);
        let stale = found.iter().map(|process| Process { started: process.started - 1, ..*process }).collect();
        assert_eq!(end(stale, Duration::ZERO), 0);
        assert_eq!(shell.below(), found, "it lives");
    }
}
