//! Agents that a cluster starts: Debian's Slurm with two nodes, one of which is lost.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};

use sesame_patience::until;
use sesame_peers::Ended;
use sesame_tests::{Done, command, done};

use crate::fleet::{Cell, TESTS, finished, started};
use crate::network::Network;

const HEAD: &str = "head";
const NODES: [&str; 2] = ["n1", "n2"];

/// A cluster of namespaces. Dropping it ends all of its programs.
struct Cluster {
    folder: PathBuf,
    nodes: Vec<Ended>,
    /// What all nodes need.
    others: Vec<Ended>,
    network: Network,
}

impl Cluster {
    /// Starts one; `None` where Slurm is not installed, or networks cannot be made.
    fn start(folder: &Path) -> Option<Self> {
        sesame_peers::installed(&["slurmctld"], &["-V"])?;
        sesame_peers::installed(&["slurmd"], &["-V"])?;
        sesame_peers::installed(&["munged"], &["--version"])?;
        let network = Network::of(&[&[HEAD], &NODES[..]].concat())?;
        let folder = folder.join("slurm");
        for each in ["state", "log"] {
            fs::create_dir_all(folder.join(each)).expect("a folder can be made");
        }
        let mut cluster = Cluster { folder, nodes: Vec::new(), others: Vec::new(), network };
        cluster.write_settings();
        let munge = cluster.munge();
        let head = cluster.program(HEAD, &["slurmctld", "-D", "-c"]);
        cluster.others.extend([munge, head]);
        cluster.nodes = NODES.iter().map(|node| cluster.program(node, &["slurmd", "-D", "-N", node])).collect();
        until("both nodes are idle", || {
            let said = done(cluster.command("sinfo").args(["--noheader", "--format=%T %D"]));
            said.out.trim() == "idle 2"
        });
        Some(cluster)
    }

    fn place(&self, name: &str) -> String {
        self.folder.join(name).display().to_string()
    }

    fn write_settings(&self) {
        let folder = self.folder.display();
        let mut settings = format!(
            "ClusterName=tested\nSlurmctldHost={HEAD}({})\nSlurmUser=root\nSlurmdUser=root\nAuthType=auth/munge\n\
             AuthInfo=socket={folder}/munge.socket\nCredType=cred/munge\nStateSaveLocation={folder}/state\n\
             SlurmdSpoolDir={folder}/spool-%n\nSlurmctldPidFile={folder}/slurmctld.pid\n\
             SlurmdPidFile={folder}/slurmd-%n.pid\nSlurmctldLogFile={folder}/log/slurmctld\n\
             SlurmdLogFile={folder}/log/slurmd-%n\nProctrackType=proctrack/linuxproc\nTaskPlugin=task/none\n\
             SelectType=select/cons_tres\nSelectTypeParameters=CR_Core\nMpiDefault=none\nJobRequeue=1\n\
             SlurmdTimeout=10\nSlurmctldTimeout=10\nReturnToService=2\n\
             SchedulerParameters=batch_sched_delay=0,sched_interval=1\n",
            self.network.address(HEAD),
        );
        settings.extend(NODES.map(|node| {
            let address = self.network.address(node);
            format!("NodeName={node} NodeHostname={node} NodeAddr={address} CPUs=1 State=UNKNOWN\n")
        }));
        settings += "PartitionName=all Nodes=n1,n2 Default=YES MaxTime=INFINITE State=UP\n";
        fs::write(self.folder.join("slurm.conf"), settings).expect("settings can be written");
    }

    /// What tells the programs of the cluster that they belong together.
    fn munge(&self) -> Ended {
        let key = self.folder.join("munge.key");
        fs::write(&key, [7; 128]).expect("a key can be written");
        #[cfg(unix)]
        {
            use std::os::unix::fs::PermissionsExt as _;
            fs::set_permissions(&key, fs::Permissions::from_mode(0o600)).expect("it is this test's");
        }
        let mut munged = command("munged");
        munged.args(["--foreground", "--force", "--key-file"]).arg(&key);
        for (option, name) in [
            ("--socket", "munge.socket"),
            ("--pid-file", "munge.pid"),
            ("--log-file", "log/munge"),
            ("--seed-file", "munge.seed"),
        ] {
            munged.arg(format!("{option}={}", self.place(name)));
        }
        let started = munged.stdout(Stdio::null()).stderr(Stdio::null()).spawn();
        let munged = Ended(started.expect("munged starts"));
        until("munged listens", || self.folder.join("munge.socket").exists());
        munged
    }

    /// A program on a machine, which has a host name of its own.
    fn program(&self, machine: &str, words: &[&str]) -> Ended {
        let mut named = command("unshare");
        named.args(["--uts", "sh", "-c", "hostname \"$0\" && exec \"$@\"", machine]).args(words);
        named.env("SLURM_CONF", self.place("slurm.conf"));
        let log = fs::File::create(self.folder.join(format!("log/{machine}"))).expect("a log can be written");
        let mut named = self.network.on(machine, &named);
        Ended(named.stdout(Stdio::null()).stderr(log).spawn().expect("it starts"))
    }

    /// A command of Slurm's, or one that calls them.
    fn command(&self, program: impl AsRef<Path>) -> Command {
        let mut command = command(program);
        command.env("SLURM_CONF", self.place("slurm.conf"));
        self.network.on(HEAD, &command)
    }
}

#[test]
#[ignore = "long: a node that is lost is noticed after ten seconds, and it takes root"]
fn agents_that_slurm_starts_come_to_the_results_of_one_machine_although_a_node_is_lost() {
    let cell = Cell::new("agents_slurm");
    let Some(mut cluster) = Cluster::start(&cell.folder) else { return };
    let digest = cell.local_digest();
    let on = cell.folder.join("queue").display().to_string();
    let submit = cell.command(&[
        "agents",
        "slurm",
        &on,
        "--nodes",
        "2",
        "--time",
        "20min",
        "--workers",
        "1",
        "--",
        "--comment=agents of a test",
    ]);
    let mut submit = cluster.network.on(HEAD, &submit);
    let submitted: Done = done(submit.env("SLURM_CONF", cluster.place("slurm.conf"))).expect(0);
    let id = submitted.out.trim().to_owned();
    assert!(id.parse::<u32>().is_ok(), "{submitted:?}");
    let job = done(cluster.command("scontrol").args(["show", "job", &id])).expect(0);
    assert!(job.out.contains("Comment=agents of a test"), "{job:?}");
    let run = started(&mut cluster.network.on(HEAD, &cell.run("remote", Some(&on))));
    cell.await_tests("remote", TESTS / 3);
    cluster.network.kill_all_on("n1");
    drop(cluster.nodes.remove(0));
    let ended = finished(run).expect(0);
    assert_eq!(ended.digest(), digest);
    done(cluster.command("scancel").arg(&id)).expect(0);
    until("no agent is left", || {
        done(cluster.command("squeue").args(["--noheader", "--states=RUNNING"])).out.trim().is_empty()
    });
}
