//! A queue in a folder that all machines share, for clusters whose nodes reach no broker.
//!
//! Each message is a file with a name of its own, which comes into being by a rename: readers see it whole or not at
//! all, and nothing is ever overwritten. Who renames a test takes it: a file can be renamed once. A test that is held
//! is touched again and again; one that was not touched for long is delivered to somebody else.

#![expect(
    clippy::disallowed_methods,
    clippy::disallowed_types,
    reason = "an adapter: the queue is files, and tests that are held are touched by a thread"
)]

use std::ffi::OsStr;
use std::fs::{self, File};
use std::io::{self, Write as _};
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::mpsc;
use std::thread;
use std::time::{Duration, Instant, SystemTime};

use crate::announcement::is_campaign_id;
use crate::message::digest_of;
use crate::queue::{Held, PRESENT, Queue, QueueError};

/// A test that was not touched for so long is delivered to somebody else. Machines may see the times of files late: NFS
/// keeps them for three seconds and more.
const LOST: Duration = Duration::from_secs(15);

/// How often a test that is held is touched.
const TOUCH: Duration = Duration::from_secs(2);

/// How often it is looked for new files while they are awaited.
const LOOK: Duration = Duration::from_millis(50);

/// How much longer than with a broker an agent counts as present: times of files are seen late.
const PRESENCE_SEEN_LATE: u32 = 5;

/// How long what an agent said of itself is kept after it was lost.
const FORGOTTEN: Duration = Duration::from_secs(3600);

/// A queue in a folder.
#[derive(Debug)]
pub struct Folder {
    root: PathBuf,
    /// What tells this process's files from those of all others.
    own: String,
    counter: AtomicU64,
    lost: Duration,
}

impl Folder {
    /// The queue in this folder, which is made if it is not there.
    pub fn open(root: &Path) -> Result<Self, QueueError> {
        let mut own = [0; 8];
        getrandom::fill(&mut own).map_err(|error| {
            let (place, reason) = (root.display().to_string(), format!("cannot get random numbers: {error}"));
            QueueError::Refused { place, reason }
        })?;
        let folder =
            Folder { root: root.to_owned(), own: crate::token::hex(&own), counter: AtomicU64::new(0), lost: LOST };
        for below in ["campaigns", "agents", "new"] {
            folder.make(&root.join(below))?;
        }
        Ok(folder)
    }

    /// The same, where a test counts as lost after another time.
    #[cfg(test)]
    fn losing_after(mut self, lost: Duration) -> Self {
        self.lost = lost;
        self
    }

    fn make(&self, folder: &Path) -> Result<(), QueueError> {
        fs::create_dir_all(folder).map_err(|error| self.unreachable(&error))
    }

    fn unreachable(&self, error: &io::Error) -> QueueError {
        QueueError::Unreachable { place: self.place(), reason: error.to_string() }
    }

    fn campaign(&self, campaign: &str) -> PathBuf {
        assert!(is_campaign_id(campaign), "`{campaign}` names no campaign");
        self.root.join("campaigns").join(campaign)
    }

    /// A name that sorts after all that this process gave before, and that nobody else gives.
    fn fresh_name(&self) -> String {
        let since = SystemTime::now().duration_since(SystemTime::UNIX_EPOCH).unwrap_or_default();
        let count = self.counter.fetch_add(1, Ordering::Relaxed);
        format!("{:020}-{count:010}-{}", since.as_nanos(), self.own)
    }

    /// Writes a file that becomes visible whole. One that is there already stays, unless it may be `replaced`.
    fn put(&self, path: &Path, content: &[u8], replaced: bool) -> Result<(), QueueError> {
        let unfinished = self.root.join("new").join(self.fresh_name());
        let put = || -> io::Result<()> {
            let mut file = File::create_new(&unfinished)?;
            file.write_all(content)?;
            file.sync_all()?;
            if replaced {
                return fs::rename(&unfinished, path);
            }
            // A link fails where a rename would overwrite.
            let linked = match fs::hard_link(&unfinished, path) {
                Err(error) if error.kind() != io::ErrorKind::AlreadyExists => Err(error),
                _ => Ok(()),
            };
            linked.and(fs::remove_file(&unfinished))
        };
        put().map_err(|error| {
            // What cannot be removed is left: it is never read.
            fs::remove_file(&unfinished).ok();
            self.unreachable(&error)
        })
    }

    /// The files of a folder, in the order of their names; none if it is not there.
    fn files(&self, folder: &Path) -> Result<Vec<PathBuf>, QueueError> {
        let read = || -> io::Result<Vec<PathBuf>> {
            let mut files = fs::read_dir(folder)?.map(|entry| Ok(entry?.path())).collect::<io::Result<Vec<_>>>()?;
            files.sort_unstable();
            Ok(files)
        };
        match read() {
            Err(error) if error.kind() == io::ErrorKind::NotFound => Ok(Vec::new()),
            read => read.map_err(|error| self.unreachable(&error)),
        }
    }

    /// The content of a file; `None` if it is not there any more.
    fn read(&self, path: &Path) -> Result<Option<Vec<u8>>, QueueError> {
        match fs::read(path) {
            Ok(content) => Ok(Some(content)),
            Err(error) if error.kind() == io::ErrorKind::NotFound => Ok(None),
            Err(error) => Err(self.unreachable(&error)),
        }
    }

    fn remove_if_there(&self, path: &Path) -> Result<(), QueueError> {
        unless_gone(fs::remove_file(path)).map_err(|error| self.unreachable(&error))
    }

    /// What the time is by the clock of the file system: machines need not agree on it.
    fn now(&self) -> Option<SystemTime> {
        let probe = self.root.join("new").join(self.fresh_name());
        let now = File::create_new(&probe).and_then(|file| file.metadata()).and_then(|probe| probe.modified());
        fs::remove_file(&probe).ok();
        now.ok()
    }

    /// Takes a file to a place where nobody else looks for it: `None` if somebody else was faster.
    fn take(&self, from: &Path, to: &Path) -> Result<bool, QueueError> {
        match fs::rename(from, to) {
            Ok(()) => Ok(true),
            Err(error) if error.kind() == io::ErrorKind::NotFound => Ok(false),
            Err(error) => Err(self.unreachable(&error)),
        }
    }

    /// Delivers what was taken and is not held any more.
    fn return_lost(&self, campaign: &Path) -> Result<(), QueueError> {
        let all = self.files(&campaign.join("held"))?;
        if all.is_empty() {
            return Ok(());
        }
        let now = self.now();
        for held in all {
            let Some((waiting, _)) = held.file_name().and_then(OsStr::to_str).and_then(|name| name.split_once('@'))
            else {
                continue;
            };
            if age(&held, now).is_some_and(|age| age > self.lost) {
                self.take(&held, &campaign.join("tests").join(waiting))?;
            }
        }
        Ok(())
    }

    /// The oldest test that may be taken now.
    fn take_now(&self, campaign: &Path) -> Result<Option<FileHeld>, QueueError> {
        for waiting in self.files(&campaign.join("tests"))? {
            let Some(name) = waiting.file_name().and_then(OsStr::to_str).and_then(TestName::read) else { continue };
            let next = TestName { deliveries: name.deliveries + 1, ..name };
            let held = campaign.join("held").join(format!("{}@{}", next.text(), self.own));
            if !self.take(&waiting, &held)? {
                continue;
            }
            // From now on it is held; a rename keeps the time at which it was put in.
            touch(&held).map_err(|error| self.unreachable(&error))?;
            let Some(mut test) = self.read(&held)? else { continue };
            test.truncate(test.trim_ascii_end().len());
            return Ok(Some(FileHeld::new(self.place(), held, next.deliveries, test)));
        }
        Ok(None)
    }
}

impl Queue for Folder {
    fn place(&self) -> String {
        self.root.display().to_string()
    }

    fn make_room(&self, campaign: &str) -> Result<(), QueueError> {
        let folder = self.campaign(campaign);
        ["tests", "held", "results", "files"].iter().try_for_each(|below| self.make(&folder.join(below)))
    }

    fn announce(&self, campaign: &str, announcement: &[u8]) -> Result<(), QueueError> {
        self.put(&self.campaign(campaign).join("announcement"), announcement, true)
    }

    fn announcements(&self) -> Result<Vec<(String, Vec<u8>)>, QueueError> {
        let mut found = Vec::new();
        for folder in self.files(&self.root.join("campaigns"))? {
            let Some(name) = folder.file_name().and_then(OsStr::to_str).filter(|name| is_campaign_id(name)) else {
                continue;
            };
            if let Some(announcement) = self.read(&folder.join("announcement"))? {
                found.push((name.to_owned(), announcement));
            }
        }
        Ok(found)
    }

    fn withdraw(&self, campaign: &str) -> Result<(), QueueError> {
        let folder = self.campaign(campaign);
        for below in ["tests", "held"] {
            for file in self.files(&folder.join(below))? {
                self.remove_if_there(&file)?;
            }
        }
        Ok(())
    }

    fn remove(&self, campaign: &str) -> Result<(), QueueError> {
        let folder = self.campaign(campaign);
        // First what makes it known, so that nobody begins with it.
        self.remove_if_there(&folder.join("announcement"))?;
        unless_gone(fs::remove_dir_all(&folder)).map_err(|error| self.unreachable(&error))
    }

    fn put_test(&self, campaign: &str, test: &[u8]) -> Result<(), QueueError> {
        let name = TestName { id: self.fresh_name(), deliveries: 0 };
        self.put(&self.campaign(campaign).join("tests").join(name.text()), test, false)
    }

    fn take_test(&self, campaign: &str, wait: Duration) -> Result<Option<Box<dyn Held>>, QueueError> {
        let (folder, until) = (self.campaign(campaign), Instant::now() + wait);
        loop {
            if let Some(held) = self.take_now(&folder)? {
                return Ok(Some(Box::new(held)));
            }
            self.return_lost(&folder)?;
            if Instant::now() >= until {
                return Ok(None);
            }
            thread::sleep(LOOK);
        }
    }

    fn put_result(&self, campaign: &str, result: &[u8]) -> Result<(), QueueError> {
        self.put(&self.campaign(campaign).join("results").join(self.fresh_name()), result, false)
    }

    fn take_result(&self, campaign: &str, wait: Duration) -> Result<Option<Vec<u8>>, QueueError> {
        let (folder, until) = (self.campaign(campaign).join("results"), Instant::now() + wait);
        loop {
            if let Some(first) = self.files(&folder)?.first()
                && let Some(result) = self.read(first)?
            {
                self.remove_if_there(first)?;
                return Ok(Some(result));
            }
            if Instant::now() >= until {
                return Ok(None);
            }
            thread::sleep(LOOK);
        }
    }

    fn put_file(&self, campaign: &str, hash: &str, content: &[u8]) -> Result<(), QueueError> {
        self.put(&self.campaign(campaign).join("files").join(file_name(hash)), content, false)
    }

    fn has_file(&self, campaign: &str, hash: &str) -> Result<bool, QueueError> {
        let path = self.campaign(campaign).join("files").join(file_name(hash));
        path.try_exists().map_err(|error| self.unreachable(&error))
    }

    fn file(&self, campaign: &str, hash: &str) -> Result<Option<Vec<u8>>, QueueError> {
        self.read(&self.campaign(campaign).join("files").join(file_name(hash)))
    }

    fn remove_file(&self, campaign: &str, hash: &str) -> Result<(), QueueError> {
        self.remove_if_there(&self.campaign(campaign).join("files").join(file_name(hash)))
    }

    fn present(&self, agent: &str, presence: &[u8]) -> Result<(), QueueError> {
        self.put(&self.root.join("agents").join(file_name(agent)), presence, true)
    }

    fn absent(&self, agent: &str) -> Result<(), QueueError> {
        self.remove_if_there(&self.root.join("agents").join(file_name(agent)))
    }

    fn presences(&self) -> Result<Vec<Vec<u8>>, QueueError> {
        let (mut present, now) = (Vec::new(), self.now());
        for file in self.files(&self.root.join("agents"))? {
            match age(&file, now) {
                // The agent that left it was lost.
                Some(age) if age > FORGOTTEN => self.remove_if_there(&file)?,
                Some(age) if age >= PRESENT * PRESENCE_SEEN_LATE => {}
                _ => present.extend(self.read(&file)?),
            }
        }
        Ok(present)
    }
}

/// What came of removing something: if it was gone already, that is as good.
fn unless_gone(removed: io::Result<()>) -> io::Result<()> {
    match removed {
        Err(error) if error.kind() == io::ErrorKind::NotFound => Ok(()),
        removed => removed,
    }
}

/// How long before a time a file was touched.
fn age(file: &Path, now: Option<SystemTime>) -> Option<Duration> {
    let touched = fs::metadata(file).and_then(|file| file.modified()).ok()?;
    now?.duration_since(touched).ok()
}

/// The name of the file of a test: when it came, and how often it was delivered.
#[derive(Debug, Clone, PartialEq, Eq)]
struct TestName {
    id: String,
    deliveries: u64,
}

impl TestName {
    fn text(&self) -> String {
        format!("{}.{}", self.id, self.deliveries)
    }

    fn read(text: &str) -> Option<Self> {
        let (id, deliveries) = text.split_once('.')?;
        Some(TestName { id: id.to_owned(), deliveries: deliveries.parse().ok()? })
    }
}

/// A test that this process holds, touched by a thread as long as this lives.
#[derive(Debug)]
struct FileHeld {
    place: String,
    path: PathBuf,
    deliveries: u64,
    test: Vec<u8>,
    /// Dropped to end the thread.
    stop: Option<mpsc::Sender<()>>,
    thread: Option<thread::JoinHandle<()>>,
}

impl FileHeld {
    fn new(place: String, path: PathBuf, deliveries: u64, test: Vec<u8>) -> Self {
        let (stop, stopped) = mpsc::channel();
        let touched = path.clone();
        let thread = thread::spawn(move || {
            while stopped.recv_timeout(TOUCH) == Err(mpsc::RecvTimeoutError::Timeout) {
                // If it was taken away, somebody else has it, and the supervisor takes the first result.
                touch(&touched).ok();
            }
        });
        FileHeld { place, path, deliveries, test, stop: Some(stop), thread: Some(thread) }
    }

    fn let_go(&mut self) {
        self.stop = None;
        if let Some(thread) = self.thread.take() {
            thread.join().ok();
        }
    }
}

impl Drop for FileHeld {
    fn drop(&mut self) {
        self.let_go();
    }
}

impl Held for FileHeld {
    fn test(&self) -> &[u8] {
        &self.test
    }

    fn deliveries(&self) -> u64 {
        self.deliveries
    }

    fn finish(mut self: Box<Self>) -> Result<(), QueueError> {
        self.let_go();
        let removed = unless_gone(fs::remove_file(&self.path));
        removed.map_err(|error| QueueError::Unreachable { place: self.place.clone(), reason: error.to_string() })
    }
}

/// Touches a test: a line break is added, so that the clock of the file system says when, which all machines share.
fn touch(path: &Path) -> io::Result<()> {
    File::options().append(true).open(path)?.write_all(b"\n")
}

/// A name as that of a file: what has other characters than those of hashes and agents is named by its hash.
fn file_name(name: &str) -> String {
    let is_plain = |byte: u8| byte.is_ascii_alphanumeric() || byte == b'-';
    if !name.is_empty() && name.len() <= 64 && name.bytes().all(is_plain) {
        name.to_owned()
    } else {
        digest_of(name.as_bytes())
    }
}

#[cfg(test)]
mod tests;
