//! Workers that another process forks: the one whose code they run, such as a session of Python with the user's
//! simulator in it.
//!
//! That process starts the supervisor with one end of a pair of sockets as its standard input, and sets
//! `SESAME_FORK_SERVER`. The pair has no name and no address, so nobody else can connect to it. Each request is a
//! packet of JSON, and so is each answer:
//!
//! | request | answer |
//! |---|---|
//! | `{"fork": {"arguments": […], "folder": "…", "worker": 1}}` | `{"id": 1234}`, or `{"failed": "…"}` |
//! | `{"end": 1234}` | `{"status": 9}`: its group of processes is killed, and it is reaped |
//!
//! A fork comes with two descriptors: its standard input, and where its output goes. A process is reaped by nothing
//! but `end`, so its id names no other process before.

use std::fs::File;
use std::io::{self, IoSlice, IoSliceMut};
use std::mem::MaybeUninit;
use std::os::fd::{AsFd as _, BorrowedFd, OwnedFd};
use std::os::unix::process::ExitStatusExt as _;
use std::path::Path;
use std::process::{Command, ExitStatus};
use std::sync::{Arc, Mutex, OnceLock, PoisonError};

use rustix::event::{PollFd, PollFlags, Timespec, poll};
use rustix::net::{
    RecvAncillaryBuffer, RecvFlags, SendAncillaryBuffer, SendAncillaryMessage, SendFlags, recvmsg, sendmsg,
};
use rustix::process::{Pid, PidfdFlags, pidfd_open};
use serde::{Deserialize, Serialize};

/// Says that standard input is the connection to a process that forks.
const VARIABLE: &str = "SESAME_FORK_SERVER";

/// The status of a process that was killed.
const KILLED: i32 = 9;

/// The longest answer.
const ANSWER_LIMIT: usize = 4096;

/// A process that forks workers.
#[derive(Debug)]
pub(super) struct ForkServer(Mutex<OwnedFd>);

#[derive(Serialize)]
#[serde(rename_all = "snake_case")]
enum Request<'a> {
    Fork { arguments: Vec<&'a str>, folder: &'a Path, worker: usize },
    End(u32),
}

#[derive(Deserialize)]
#[serde(rename_all = "snake_case")]
enum Answer {
    Id(u32),
    Status(i32),
    Failed(String),
}

impl ForkServer {
    /// The one that started this process, if one did.
    pub(super) fn of_this_process() -> Option<Arc<ForkServer>> {
        static SERVER: OnceLock<Option<Arc<ForkServer>>> = OnceLock::new();
        let taken = SERVER.get_or_init(|| {
            std::env::var_os(VARIABLE)?;
            let connection = io::stdin().as_fd().try_clone_to_owned().ok()?;
            rustix::net::getpeername(&connection).ok()?;
            // Programs that this process starts do not inherit it.
            rustix::stdio::dup2_stdin(File::open("/dev/null").ok()?).ok()?;
            Some(Arc::new(ForkServer(Mutex::new(connection))))
        });
        taken.clone()
    }

    /// Forks a worker with this number and the arguments of this command, in this folder.
    pub(super) fn fork(
        self: &Arc<Self>,
        command: &Command,
        folder: &Path,
        worker: usize,
        input: &OwnedFd,
        output: &File,
    ) -> io::Result<Forked> {
        let arguments: Option<Vec<&str>> = command.get_args().map(|argument| argument.to_str()).collect();
        let arguments = arguments.ok_or_else(|| io::Error::other("an argument of the worker is not UTF-8"))?;
        let folder = folder.canonicalize()?;
        let request = Request::Fork { arguments, folder: &folder, worker };
        match self.ask(&request, &[input.as_fd(), output.as_fd()])? {
            Answer::Id(id) => {
                let process = Pid::from_raw(id.cast_signed()).ok_or_else(|| io::Error::other("it has no id"))?;
                let handle = pidfd_open(process, PidfdFlags::empty())?;
                Ok(Forked { server: Arc::clone(self), id, handle })
            }
            Answer::Failed(reason) => Err(io::Error::other(reason)),
            Answer::Status(_) => Err(io::Error::other("the process that forks gave another answer")),
        }
    }

    fn ask(&self, request: &Request<'_>, descriptors: &[BorrowedFd<'_>]) -> io::Result<Answer> {
        let text = serde_json::to_vec(request)?;
        // It is whole between any two requests.
        let connection = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        let mut space = [MaybeUninit::uninit(); rustix::cmsg_space!(ScmRights(2))];
        let mut attached = SendAncillaryBuffer::new(&mut space);
        if !descriptors.is_empty() {
            attached.push(SendAncillaryMessage::ScmRights(descriptors));
        }
        sendmsg(&*connection, &[IoSlice::new(&text)], &mut attached, SendFlags::NOSIGNAL)?;
        let mut answer = vec![0; ANSWER_LIMIT];
        let mut nothing = RecvAncillaryBuffer::default();
        let length = loop {
            match recvmsg(&*connection, &mut [IoSliceMut::new(&mut answer)], &mut nothing, RecvFlags::empty()) {
                Err(rustix::io::Errno::INTR) => {}
                received => break received?.bytes,
            }
        };
        if length == 0 {
            return Err(io::Error::other("the process that forks workers has ended"));
        }
        Ok(serde_json::from_slice(&answer[..length])?)
    }
}

/// A worker that was forked.
#[derive(Debug)]
pub(super) struct Forked {
    server: Arc<ForkServer>,
    id: u32,
    /// Readable once it has ended.
    handle: OwnedFd,
}

impl Forked {
    /// Whether it has ended. It is not reaped.
    pub(super) fn has_ended(&self) -> bool {
        let now = Timespec { tv_sec: 0, tv_nsec: 0 };
        let mut handles = [PollFd::new(&self.handle, PollFlags::IN)];
        poll(&mut handles, Some(&now)).is_ok_and(|ready| ready > 0)
    }

    /// Ends it with its group, and reaps it: its status. It must not be called twice.
    pub(super) fn end(&self) -> ExitStatus {
        match self.server.ask(&Request::End(self.id), &[]) {
            Ok(Answer::Status(status)) => ExitStatus::from_raw(status),
            // Then the process that forks has ended, and has killed all that it forked.
            _ => ExitStatus::from_raw(KILLED),
        }
    }
}
