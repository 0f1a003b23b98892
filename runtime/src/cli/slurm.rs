//! `sesamec agents slurm`: agents as jobs of a cluster.
//!
//! Slurm starts agents, and the queue gives them their tests. A job for each test would wait seconds in Slurm, and
//! minutes after a node was lost.

use std::fmt::Write as _;
use std::io::{self, Write as _};
use std::num::NonZeroU32;
use std::path::{Path, PathBuf};
use std::process::{Command, ExitCode, Stdio};
use std::time::Duration;

use clap::Args;

use sesame_base::shell::quoted;
use sesame_queue::queue::without_secrets;

use crate::cli::execution::seconds;
use crate::cli::failure::Failure;
use crate::cli::fleet::{QueueArgs, is_of_each_machine};
use crate::cli::terminal::{print, say};

/// How long before the end of its time a job is asked to end, so that its agent gives back what it runs.
const NOTICE: Duration = Duration::from_secs(60);

/// Start agents on the nodes of a cluster that Slurm manages, as one array of jobs.
#[derive(Debug, Args)]
pub(super) struct SlurmArgs {
    /// The queue: the URL of a broker of NATS that the nodes reach, or a folder that they share
    #[arg(value_name = "URL")]
    queue: String,
    /// How many nodes, with an agent on each
    #[arg(long, value_name = "N")]
    nodes: NonZeroU32,
    /// How long the agents run at most, for example `4h` or `90min`
    #[arg(long, value_name = "TIME", value_parser = time)]
    time: Duration,
    /// How many tests run at once on each node, with a processor for each; by default an agent has a whole node
    #[arg(long, value_name = "N")]
    workers: Option<NonZeroU32>,
    /// An agent ends after this many seconds without a test
    #[arg(long, value_name = "SECONDS", value_parser = seconds, default_value = "600")]
    leave_after: Duration,
    /// Folder on each node for files of campaigns, for example on its own disk; by default the one of `sesamec agent`
    #[arg(long, value_name = "DIR")]
    folder: Option<PathBuf>,
    /// A folder of a space that is on the nodes already, as `--prepared NAME` of a campaign names it
    #[arg(long, value_name = "NAME=DIR")]
    prepared: Vec<String>,
    /// Print the script, and submit nothing
    #[arg(long)]
    print: bool,
    #[command(flatten)]
    access: QueueArgs,
    /// Options for `sbatch`, after `--`, for example `--partition=long`
    #[arg(last = true, value_name = "OPTION")]
    options: Vec<String>,
}

/// A length of time as Slurm's users say it, from a second to a year.
fn time(text: &str) -> Result<Duration, String> {
    const UNITS: [(&str, u64); 4] = [("min", 60), ("h", 3600), ("d", 86400), ("s", 1)];
    let parsed = UNITS.iter().find_map(|(unit, seconds)| {
        let number: f64 = text.strip_suffix(unit)?.trim_end().parse().ok()?;
        #[expect(clippy::cast_precision_loss, reason = "there are few seconds in a day")]
        Duration::try_from_secs_f64((number * *seconds as f64).ceil()).ok()
    });
    let sensible = Duration::from_secs(1)..=Duration::from_secs(366 * 86400);
    parsed
        .filter(|length| sensible.contains(length))
        .ok_or_else(|| "expected a number and a unit of `s`, `min`, `h` or `d`, for example `4h`".to_owned())
}

/// A length of time as `sbatch` reads it: days-hours:minutes:seconds.
fn slurm_time(length: Duration) -> String {
    let seconds = length.as_secs();
    format!("{}-{:02}:{:02}:{:02}", seconds / 86400, seconds / 3600 % 24, seconds / 60 % 60, seconds % 60)
}

/// The script of the jobs: comments that `sbatch` reads, and the agent in place of the shell.
fn script(args: &SlurmArgs, program: &Path, queue: &str, access: &[String]) -> String {
    let cpus = args.workers.map_or_else(|| "exclusive".to_owned(), |count| format!("cpus-per-task={count}"));
    let options = [
        "job-name=sesame-agents".to_owned(),
        format!("array=1-{}", args.nodes),
        "nodes=1".to_owned(),
        "ntasks=1".to_owned(),
        cpus,
        format!("time={}", slurm_time(args.time)),
        // To the agent itself, which takes the place of the script.
        format!("signal=B:TERM@{}", NOTICE.as_secs()),
        // The agent of a node that is lost starts on another one.
        "requeue".to_owned(),
        "output=sesame-agents-%A_%a.log".to_owned(),
        "open-mode=append".to_owned(),
    ];
    let mut script = "#!/bin/sh\n".to_owned();
    let options = options.into_iter().map(|option| format!("--{option}"));
    for option in options.chain(args.options.iter().map(|option| quoted(option))) {
        writeln!(script, "#SBATCH {option}").expect("a text can be written");
    }
    let mut words = vec![program.display().to_string(), "agent".to_owned(), queue.to_owned()];
    words.extend(["--leave-after".to_owned(), args.leave_after.as_secs_f64().to_string()]);
    words.extend(args.workers.iter().flat_map(|count| ["--workers".to_owned(), count.to_string()]));
    words.extend(args.folder.iter().flat_map(|folder| ["--folder".to_owned(), folder.display().to_string()]));
    words.extend(args.prepared.iter().flat_map(|prepared| ["--prepared".to_owned(), prepared.clone()]));
    words.extend_from_slice(access);
    let words: Vec<String> = words.iter().map(|word| quoted(word)).collect();
    writeln!(script, "exec {}", words.join(" ")).expect("a text can be written");
    script
}

/// Carries out `sesamec agents slurm`.
pub(super) fn submit(args: &SlurmArgs) -> Result<ExitCode, Failure> {
    // Jobs start in the folder in which they were submitted, but it need not be the one that a path was meant from.
    let queue = if args.queue.contains("://") {
        args.queue.clone()
    } else {
        absolute(Path::new(&args.queue))?.display().to_string()
    };
    // The nodes find the token where this machine has it, or each would make one of its own.
    args.access.token()?;
    let mut access = Vec::new();
    for (option, file) in args.access.files() {
        access.extend([option.to_owned(), absolute(file)?.display().to_string()]);
    }
    let script = script(args, &std::env::current_exe()?, &queue, &access);
    let shown = without_secrets(&args.queue);
    if shown.contains("://") && is_of_each_machine(&shown) {
        say(format_args!("warning: `{shown}` is another machine on each node: name the one of the broker"));
    }
    if args.print {
        return print(&script);
    }
    let failed = |error: io::Error| match error.kind() {
        io::ErrorKind::NotFound => Failure(
            "there is no `sbatch`: this is for a machine that submits jobs to Slurm. `--print` prints the script"
                .to_owned(),
        ),
        _ => Failure(format!("cannot run `sbatch`: {error}")),
    };
    let mut sbatch = Command::new("sbatch")
        .arg("--parsable")
        .stdin(Stdio::piped())
        .stdout(Stdio::piped())
        .spawn()
        .map_err(failed)?;
    sbatch.stdin.take().expect("it is piped").write_all(script.as_bytes())?;
    let output = sbatch.wait_with_output()?;
    if !output.status.success() {
        return Err(Failure(format!("`sbatch` refused the jobs ({})", output.status)));
    }
    // The id, and the cluster if there are several.
    let said = String::from_utf8_lossy(&output.stdout);
    let id = said.trim().split(';').next().unwrap_or_default();
    say(format_args!("submitted as job {id}: `squeue --job {id}` shows its agents, and `scancel {id}` ends them"));
    print(&format!("{id}\n"))
}

fn absolute(path: &Path) -> Result<PathBuf, Failure> {
    std::path::absolute(path).map_err(|error| Failure(format!("{}: {error}", path.display())))
}

#[cfg(test)]
mod tests {
    use clap::Parser;

    use super::*;

    #[derive(Parser)]
    struct Parsed {
        #[command(flatten)]
        slurm: SlurmArgs,
    }

    #[test]
    fn times_are_read_with_their_units_and_written_as_sbatch_reads_them() {
        for (text, written) in [
            ("4h", "0-04:00:00"),
            ("90min", "0-01:30:00"),
            ("1.5d", "1-12:00:00"),
            ("61 s", "0-00:01:01"),
            ("0.1s", "0-00:00:01"),
        ] {
            assert_eq!(time(text).map(slurm_time).as_deref(), Ok(written), "{text}");
        }
        for text in ["", "4", "h", "-1h", "0s", "1e9h", "nanh", "4:00:00"] {
            assert!(time(text).is_err(), "{text}");
        }
    }

    #[test]
    fn the_script_asks_for_an_array_of_agents_and_quotes_what_a_shell_would_read() {
        let words = ["slurm", "/shared/my queue", "--nodes", "20", "--time", "4h", "--prepared", "cell=/opt/$x"];
        let args = Parsed::parse_from(words).slurm;
        let access = ["--token".to_owned(), "/home/it's/token".to_owned()];
        let written = script(&args, Path::new("/opt/sesamec"), "/shared/my queue", &access);
        assert_eq!(
            written,
            "#!/bin/sh\n#SBATCH --job-name=sesame-agents\n#SBATCH --array=1-20\n#SBATCH --nodes=1\n#SBATCH --ntasks=1\n\
             #SBATCH --exclusive\n#SBATCH --time=0-04:00:00\n#SBATCH --signal=B:TERM@60\n#SBATCH --requeue\n\
             #SBATCH --output=sesame-agents-%A_%a.log\n#SBATCH --open-mode=append\n\
             exec /opt/sesamec agent '/shared/my queue' --leave-after 600 --prepared 'cell=/opt/$x' --token \
             '/home/it'\\''s/token'\n"
        );
        let words = ["slurm", "nats://broker", "--nodes", "2", "--time", "30min", "--workers", "4"];
        let words = words.iter().chain(&["--", "--partition=long", "--comment=two words"]);
        let args = Parsed::parse_from(words).slurm;
        let written = script(&args, Path::new("sesamec"), "nats://broker", &[]);
        assert!(written.contains("#SBATCH --cpus-per-task=4\n") && written.contains(" --workers 4\n"), "{written}");
        assert!(!written.contains("exclusive"), "{written}");
        let last = "#SBATCH --open-mode=append\n#SBATCH --partition=long\n#SBATCH '--comment=two words'\nexec ";
        assert!(written.contains(last), "{written}");
    }
}
