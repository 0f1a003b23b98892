//! Where a campaign's tests run, if not on this machine: the queue, its token, and what agents have to know.

use std::ffi::{OsStr, OsString};
use std::fs::{self, File};
use std::io::{self, Write as _};
use std::path::{Path, PathBuf};
use std::sync::Arc;

use clap::Args;

use sesame_plan::CampaignPlan;
use sesame_queue::announcement::{Announcement, Compiled, Files, Program};
use sesame_queue::bundle;
use sesame_queue::folder::Folder;
use sesame_queue::message::digest_of;
use sesame_queue::queue::{Queue, QueueError, without_secrets};
use sesame_queue::token::Token;

use crate::campaign::Fleet;
use crate::cli::execution::shown;
use crate::cli::failure::Failure;
use crate::cli::session::Session;
use crate::cli::terminal::say;

/// The version that results depend on.
pub(super) const VERSION: &str = env!("CARGO_PKG_VERSION");

/// How a queue is reached.
#[derive(Debug, Clone, Default, Args)]
pub(super) struct QueueArgs {
    /// The file with the token that agents and campaigns share; by default `sesame/token` in the user's folder of
    /// settings, which `sesamec agent` and `run --on` make if it is not there
    #[arg(long, value_name = "FILE")]
    token: Option<PathBuf>,
    /// A file of credentials for the broker, as NATS writes them
    #[arg(long, value_name = "FILE")]
    credentials: Option<PathBuf>,
    /// A file of certificates in PEM that vouch for the broker, in place of those that the system trusts
    #[arg(long, value_name = "FILE")]
    certificates: Option<PathBuf>,
}

/// Where tests are run.
#[derive(Debug, Clone, Default, Args)]
pub struct FleetArgs {
    /// Run the tests by agents: the URL of a broker of NATS, for example `nats://127.0.0.1:4222`, or a folder that all
    /// machines share. `sesamec agent URL` starts an agent
    #[arg(long, value_name = "URL")]
    on: Option<String>,
    /// The folder of the space is on the machines of agents already, under this name: they compare its files, and none
    /// is sent
    #[arg(long, value_name = "NAME", requires = "on")]
    prepared: Option<String>,
    #[command(flatten)]
    queue: QueueArgs,
}

impl QueueArgs {
    /// The files that are named, each with the option that names it.
    pub(super) fn files(&self) -> impl Iterator<Item = (&'static str, &Path)> {
        let QueueArgs { token, credentials, certificates } = self;
        let named = [("--token", token), ("--credentials", credentials), ("--certificates", certificates)];
        named.into_iter().filter_map(|(option, file)| Some((option, file.as_deref()?)))
    }

    /// The queue at a URL or in a folder.
    pub(super) fn open(&self, place: &str) -> Result<Arc<dyn Queue>, Failure> {
        self.connect(place).map_err(|error| Failure(error.to_string()))
    }

    /// The same, where it matters whether the queue may be there later.
    #[cfg_attr(not(feature = "nats"), expect(clippy::unused_self, reason = "a folder needs no credentials"))]
    pub(super) fn connect(&self, place: &str) -> Result<Arc<dyn Queue>, QueueError> {
        let refused = |reason: String| Err(QueueError::Refused { place: without_secrets(place), reason });
        match place.split_once("://") {
            None => Ok(Arc::new(Folder::open(Path::new(place))?)),
            #[cfg(feature = "nats")]
            Some(("nats" | "tls", _)) => {
                let (credentials, certificates) = (self.credentials.clone(), self.certificates.clone());
                let access = sesame_queue::nats::Access { credentials, certificates };
                Ok(Arc::new(sesame_queue::nats::Nats::connect(place, &access)?))
            }
            #[cfg(not(feature = "nats"))]
            Some(("nats" | "tls", _)) => refused(
                "this program was built without NATS: build it with `--features nats`, or use a folder that all machines \
                 share"
                    .to_owned(),
            ),
            Some((scheme, _)) => refused(format!(
                "`{scheme}` is not a kind of queue: there are `nats://`, `tls://` and folders that all machines share"
            )),
        }
    }

    /// The token. The one in the user's folder of settings is made if it is not there.
    pub(super) fn token(&self) -> Result<Token, Failure> {
        self.known_token()?.map_or_else(Self::made_token, Ok)
    }

    /// The token, if there is one. A file that was named has to be there.
    pub(super) fn known_token(&self) -> Result<Option<Token>, Failure> {
        let path = self.token.clone().map_or_else(default_token_file, Ok)?;
        match fs::read_to_string(&path) {
            Ok(text) => Token::read(&text).map(Some).ok_or_else(|| {
                Failure(format!(
                    "{} is not a token: 64 hexadecimal digits, as `sesamec agent` writes them",
                    path.display()
                ))
            }),
            Err(error) if error.kind() == io::ErrorKind::NotFound && self.token.is_none() => Ok(None),
            Err(error) => Err(Failure(format!("the token in {}: {error}", path.display()))),
        }
    }

    /// A fresh token in the user's folder of settings.
    fn made_token() -> Result<Token, Failure> {
        let path = default_token_file()?;
        let failed = |error: io::Error| Failure(format!("the token in {}: {error}", path.display()));
        let token = Token::random().map_err(Failure)?;
        if let Some(parent) = path.parent() {
            fs::create_dir_all(parent).map_err(failed)?;
        }
        match create_private(&path, &format!("{}\n", token.text())) {
            // Another program that was started at the same time was faster.
            Err(error) if error.kind() == io::ErrorKind::AlreadyExists => return QueueArgs::default().token(),
            created => created.map_err(failed)?,
        }
        say(format_args!(
            "note: created the token {}. Copy it to every machine that takes part; whoever has it can run programs on your \
             agents",
            path.display()
        ));
        Ok(token)
    }
}

/// Makes a file that only its owner reads, and that others see whole or not at all; one that is there stays.
fn create_private(path: &Path, content: &str) -> io::Result<()> {
    let unfinished = path.with_extension(format!("unfinished-{}", std::process::id()));
    let mut options = File::options();
    options.write(true).create_new(true);
    #[cfg(unix)]
    std::os::unix::fs::OpenOptionsExt::mode(&mut options, 0o600);
    let created = options.open(&unfinished).and_then(|mut file| {
        file.write_all(content.as_bytes())?;
        file.sync_all()?;
        fs::hard_link(&unfinished, path)
    });
    fs::remove_file(&unfinished).ok();
    created
}

fn default_token_file() -> Result<PathBuf, Failure> {
    let settings = std::env::var_os("XDG_CONFIG_HOME").map(PathBuf::from).filter(|folder| folder.is_absolute());
    let home = || std::env::home_dir().map(|home| home.join(".config"));
    let settings = settings.or_else(home).map(|settings| settings.join("sesame").join("token"));
    settings
        .ok_or_else(|| Failure("the user's folder of settings is unknown: name a file with `--token FILE`".to_owned()))
}

/// The architecture and system that programs of this machine are for.
pub(super) fn target() -> String {
    format!("{}-{}", std::env::consts::ARCH, std::env::consts::OS)
}

/// Whether an address leads to another system on each machine.
pub(super) fn is_of_each_machine(address: &str) -> bool {
    let host = address.split_once("://").map_or(address, |(_, rest)| rest);
    let host = host.split('/').next().unwrap_or(host);
    let host = host.rsplit_once(':').map_or(host, |(host, _)| host).trim_matches(['[', ']']);
    host == "localhost"
        || host.parse::<std::net::IpAddr>().is_ok_and(|address| address.is_loopback() || address.is_unspecified())
}

/// The name of this machine.
pub(super) fn machine() -> String {
    #[cfg(unix)]
    let name = rustix::system::uname().nodename().to_string_lossy().into_owned();
    #[cfg(not(unix))]
    let name = std::env::var("COMPUTERNAME").unwrap_or_default();
    if name.is_empty() { "unnamed".to_owned() } else { name }
}

/// A queue that was reached, before anything of a run is written.
pub(super) struct Reached {
    queue: Arc<dyn Queue>,
    token: Token,
    prepared: Option<String>,
}

impl FleetArgs {
    /// These arguments for the runner of a campaign.
    pub fn arguments(&self) -> Vec<OsString> {
        let named = [("--on", &self.on), ("--prepared", &self.prepared)];
        let named = named.into_iter().filter_map(|(option, value)| Some((option, OsStr::new(value.as_ref()?))));
        let all = named.chain(self.queue.files().map(|(option, file)| (option, file.as_os_str())));
        all.flat_map(|(option, value)| [OsString::from(option), value.to_owned()]).collect()
    }

    /// The same for a command that goes on with the run, as people may read it: without a password.
    pub(super) fn shown(&self) -> Vec<String> {
        let on = self.on.as_deref().map(without_secrets);
        let shown = FleetArgs { on, ..self.clone() };
        shown.arguments().iter().map(|word| word.to_string_lossy().into_owned()).collect()
    }

    /// The queue; `None` if the campaign runs here.
    pub(super) fn reach(&self) -> Result<Option<Reached>, Failure> {
        let Some(place) = &self.on else { return Ok(None) };
        let (queue, token) = (self.queue.open(place)?, self.queue.token()?);
        Ok(Some(Reached { queue, token, prepared: self.prepared.clone() }))
    }
}

impl Reached {
    /// The agents that are to run a campaign whose results come into this folder.
    pub(super) fn fleet(
        self,
        session: &Session,
        plan: &CampaignPlan,
        folder: &Path,
        seed: u64,
    ) -> Result<Fleet, Failure> {
        let Some(runner) = session.program.sent() else {
            return Err(Failure("agents run tests in the simulator only: run this without `--on`".to_owned()));
        };
        let space = runner.directory.join(&runner.space);
        let simulator = runner.directory.join(&runner.simulator);
        let below = simulator.strip_prefix(&space).ok().and_then(Path::to_str);
        let simulator = below.ok_or_else(|| {
            Failure(format!(
                "the simulator runs in {}, which is outside of the folder of the space: agents get only what is in {}",
                simulator.display(),
                shown(&space)
            ))
        })?;
        let unread = |error: bundle::BundleError| Failure(error.to_string());
        // What earlier runs left is of no use to agents.
        let own = &runner.directory;
        let run = folder.canonicalize()?;
        let results = run.parent().filter(|results| !space.canonicalize().is_ok_and(|space| space == **results));
        let is_ours = |path: &Path| {
            path == own || path.canonicalize().is_ok_and(|path| path == run || Some(path.as_path()) == results)
        };
        let (files, mut bundle) = if let Some(name) = self.prepared {
            (Files::Prepared { name, files: bundle::list_prepared(&space, &is_ours).map_err(unread)? }, Vec::new())
        } else {
            let manifest = bundle::list(&space, &is_ours).map_err(unread)?;
            let at = |entry: &bundle::Entry| (entry.clone(), space.join(&entry.path));
            let bundle = manifest.files.iter().map(at).collect();
            (Files::Bundle(manifest), bundle)
        };
        let mut compiled = None;
        if let Some(program) = session.program.of_another_process() {
            let entry = bundle::entry_of(program, "runner".to_owned()).map_err(unread)?;
            compiled = Some(Compiled { target: target(), program: entry.clone() });
            bundle.push((entry, program.to_owned()));
        }
        if let Some(address) = plan.simulator.addresses().into_iter().find(|address| !is_of_each_machine(address)) {
            return Err(Failure(format!(
                "agents on all machines would use the one system at `{address}`: an address on each machine, such as \
                 `127.0.0.1`, gives each its own"
            )));
        }
        let changes_files = plan.operations.iter().any(|operation| operation.kind.calls_code_outside_the_run());
        let program = Program {
            plan: runner.plan,
            hooks: runner.hooks.as_ref().map(serde_json::to_string).transpose()?,
            space: files,
            simulator: simulator.replace('\\', "/"),
            compiled,
            one_at_a_time: changes_files || plan.simulator.shared_address().is_some(),
        };
        let place_of_results = folder.canonicalize()?;
        let identity = format!("{}\n{}\n{seed}\n{}", machine(), place_of_results.display(), program.plan);
        let campaign = digest_of(identity.as_bytes())[..16].to_owned();
        let announcement = Announcement {
            campaign,
            title: format!("`{}` of `{}`, seed {seed}, from {}", plan.campaign.name, plan.space, machine()),
            version: VERSION.to_owned(),
            program,
            put_aside: Vec::new(),
        };
        let lock_stepped = plan.simulator.step_ns().is_some();
        let Reached { queue, token, .. } = self;
        Ok(Fleet { queue, token, announcement, files: bundle, lock_stepped })
    }
}

#[cfg(test)]
mod tests {
    use clap::Parser;

    use super::*;

    #[derive(Parser)]
    struct Parsed {
        #[command(flatten)]
        fleet: FleetArgs,
    }

    #[test]
    fn a_runner_gets_all_options_and_people_see_no_password() {
        let words = ["run", "--on", "nats://robot:secret@broker:4222", "--prepared", "cell", "--token", "a token"];
        let fleet = Parsed::parse_from(words).fleet;
        assert_eq!(fleet.arguments(), words[1..]);
        assert_eq!(fleet.shown(), ["--on", "nats://broker:4222", "--prepared", "cell", "--token", "a token"]);
        let local = Parsed::parse_from(["run"]).fleet;
        assert!(local.arguments().is_empty() && local.shown().is_empty());
    }
}
