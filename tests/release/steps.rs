//! What build servers run, read from the files that users copy or refer to, and carried out by bash.
//!
//! These files are YAML. This reads only what is in them: keys and values on a line, and blocks of text.

use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

use sesame_tests::{Done, command, copy, done, fresh_folder, sesamec};

/// A line of such a file: how far it is indented, and what it says.
fn lines(text: &str) -> impl Iterator<Item = (usize, &str)> {
    text.lines().map(|line| (line.len() - line.trim_start().len(), line.trim()))
}

/// What follows a line, as far as it is indented further, without the lines after that.
fn block<'t>(text: &'t str, line: &str) -> &'t str {
    let begin = text.find(&format!("\n{line}\n")).unwrap_or_else(|| panic!("there is no `{line}`")) + line.len() + 2;
    let indented = line.len() - line.trim_start().len();
    let ends = |line: &str| !line.trim().is_empty() && line.len() - line.trim_start().len() <= indented;
    let mut end = begin;
    for line in text[begin..].split_inclusive('\n') {
        if ends(line) {
            break;
        }
        end += line.len();
    }
    &text[begin..end]
}

fn unquoted(value: &str) -> String {
    value.trim_matches('"').to_owned()
}

/// A step of an action that runs a script.
#[derive(Debug, Default)]
pub(crate) struct Step {
    pub(crate) name: String,
    id: String,
    condition: String,
    environment: Vec<(String, String)>,
    script: String,
}

/// A composite action.
#[derive(Debug)]
pub(crate) struct Action {
    pub(crate) defaults: BTreeMap<String, String>,
    pub(crate) steps: Vec<Step>,
}

impl Action {
    pub(crate) fn read(text: &str) -> Self {
        let mut defaults = BTreeMap::new();
        let mut name = "";
        for (indented, line) in lines(block(text, "inputs:")) {
            match line.strip_suffix(':') {
                Some(input) if indented == 2 => name = input,
                _ => {
                    if let Some(value) = line.strip_prefix("default: ") {
                        defaults.insert(name.to_owned(), unquoted(value));
                    }
                }
            }
        }
        let text = block(text, "  steps:");
        let steps = text.split("    - name: ").skip(1).map(|step| {
            let step = format!("      name: {step}");
            let value = |key: &str| {
                let line = step.lines().find_map(|line| line.strip_prefix(&format!("      {key}: ")));
                unquoted(line.unwrap_or_default())
            };
            let environment = if step.contains("\n      env:\n") { block(&step, "      env:") } else { "" };
            let environment = environment.lines().filter_map(|line| line.trim().split_once(": "));
            let script = if step.contains("\n      run: |\n") { block(&step, "      run: |") } else { "" };
            Step {
                name: value("name"),
                id: value("id"),
                condition: value("if"),
                environment: environment.map(|(name, value)| (name.to_owned(), unquoted(value))).collect(),
                script: script.lines().map(|line| line.get(8..).unwrap_or_default().to_owned() + "\n").collect(),
            }
        });
        Action { defaults, steps: steps.collect() }
    }
}

/// A repository on a build server: a demo with a simulator in Python, in a folder whose name has to be quoted.
pub(crate) struct Checkout {
    pub(crate) folder: PathBuf,
    /// What the server gives to jobs, and what they leave for it.
    server: PathBuf,
    path: Vec<PathBuf>,
}

/// What came of an action.
#[derive(Debug)]
pub(crate) struct Job {
    /// The steps that ran; the last one failed, or all went well.
    pub(crate) ran: Vec<(String, Done)>,
    /// Outputs, by step and name, such as `run.page`.
    pub(crate) outputs: BTreeMap<String, String>,
    /// The summary of the job.
    pub(crate) summary: String,
}

impl Job {
    /// The step that ran last, and its exit code.
    pub(crate) fn last(&self) -> (&str, Option<i32>) {
        let (name, done) = self.ran.last().expect("a step ran");
        (name, done.code)
    }
}

/// A path to the space that a careless script would take apart.
pub(crate) const SPACE: &str = "a $(touch folder)/demo.sesame";

impl Checkout {
    /// `None` on a machine without Python, which the demo's simulator needs.
    pub(crate) fn new(name: &str) -> Option<Self> {
        if !sesame_peers::has_python3() {
            return None;
        }
        let place = fresh_folder(name);
        let (folder, server) = (place.join("checkout"), place.join("server"));
        for folder in [&folder, &server, &server.join("bin")] {
            fs::create_dir(folder).expect("a folder can be made");
        }
        done(command(sesamec()).args(["new", "--python", "demo"]).current_dir(&folder)).expect(0);
        fs::rename(folder.join("demo"), folder.join(SPACE).parent().expect("it is in a folder")).expect("it is moved");
        std::os::unix::fs::symlink(sesamec(), server.join("bin/sesamec")).expect("a link can be made");
        let path = std::env::var_os("PATH").expect("there is a PATH");
        let path = [server.join("bin")].into_iter().chain(std::env::split_paths(&path)).collect();
        Some(Checkout { folder, server, path })
    }

    /// Without the `sesamec` of this workspace: a job has to install one.
    pub(crate) fn without_sesamec(mut self) -> Self {
        self.path.remove(0);
        self
    }

    /// Bash, as both servers start it: it ends with the first command that fails.
    pub(crate) fn bash(&self, script: &str, environment: &[(String, String)]) -> Done {
        let mut bash = command("bash");
        bash.args(["--noprofile", "--norc", "-eo", "pipefail", "-c", script]).current_dir(&self.folder);
        bash.env("PATH", std::env::join_paths(&self.path).expect("no colon"));
        done(bash.envs(environment.iter().map(|(name, value)| (name, value))))
    }

    /// Runs the steps of an action from the one of this name, with these inputs, up to the first that fails.
    pub(crate) fn run(&mut self, action: &Action, from: &str, with: &[(&str, &str)]) -> Job {
        let mut inputs = action.defaults.clone();
        inputs.extend(with.iter().map(|(name, value)| ((*name).to_owned(), (*value).to_owned())));
        let input = |text: &str| {
            let name = text.strip_prefix("${{ inputs.").and_then(|rest| rest.strip_suffix(" }}"));
            let name = name.unwrap_or_else(|| panic!("`{text}` is not the value of an input"));
            inputs.get(name).unwrap_or_else(|| panic!("the input `{name}` is required")).clone()
        };
        let mut job = Job { ran: Vec::new(), outputs: BTreeMap::new(), summary: String::new() };
        let files: Vec<(&str, PathBuf)> =
            [("GITHUB_PATH", "path"), ("GITHUB_OUTPUT", "output"), ("GITHUB_STEP_SUMMARY", "summary")]
                .map(|(variable, file)| (variable, self.server.join(file)))
                .into();
        for step in action.steps.iter().skip_while(|step| step.name != from).filter(|step| !step.script.is_empty()) {
            if let Some((name, value)) = step.condition.split_once(" == ") {
                let wanted = value.trim_end_matches(" }}").trim_matches('\'');
                if input(&format!("{name} }}}}")) != wanted {
                    continue;
                }
            }
            let mut environment: Vec<(String, String)> =
                step.environment.iter().map(|(name, value)| (name.clone(), input(value))).collect();
            environment.push(("RUNNER_TEMP".to_owned(), self.server.display().to_string()));
            for (variable, file) in &files {
                fs::write(file, "").expect("a file can be written");
                environment.push(((*variable).to_owned(), file.display().to_string()));
            }
            let ran = self.bash(&step.script, &environment);
            let [path, output, summary] = [0, 1, 2].map(|file: usize| read(&files[file].1));
            self.path.splice(0..0, path.lines().map(PathBuf::from));
            let outputs = output.lines().map(|line| line.split_once('=').expect("an output has a value"));
            job.outputs.extend(outputs.map(|(name, value)| (format!("{}.{name}", step.id), value.to_owned())));
            job.summary += &summary;
            let failed = ran.code != Some(0);
            job.ran.push((step.name.clone(), ran));
            if failed {
                break;
            }
        }
        job
    }

    pub(crate) fn has(&self, file: &str) -> bool {
        self.folder.join(file).exists()
    }

    /// Adds a recorded test of a run to the space, as a regression test: `test` is its number, and how it is exported.
    pub(crate) fn keep(&self, results: &str, test: &[&str]) {
        let mut export = command(sesamec());
        export.args(["export", SPACE, "--results", results]).args(test).current_dir(&self.folder);
        let block = done(&mut export).expect(0).out;
        let space = self.folder.join(SPACE);
        fs::write(&space, format!("{}\n{block}", read(&space))).expect("a space can be written");
    }
}

/// The commands of a job of GitLab: the items of its list, each on a line or on several.
pub(crate) fn gitlab_script(text: &str, job: &str) -> String {
    let script = block(block_of(text, job), "  script:");
    script.split("    - ").map(|item| item.split_whitespace().collect::<Vec<_>>().join(" ") + "\n").collect()
}

fn block_of<'t>(text: &'t str, job: &str) -> &'t str {
    block(text, &format!("{job}:"))
}

pub(crate) fn read(file: &Path) -> String {
    fs::read_to_string(file).unwrap_or_else(|error| panic!("{}: {error}", file.display()))
}

/// A copy of this file in the checkout, in place of what is there.
pub(crate) fn put(from: &Path, to: &Path) {
    if from.is_dir() {
        copy(from, to);
    } else {
        fs::copy(from, to).expect("a file can be copied");
    }
}

/// Whether a program is somewhere on the PATH of this process.
pub(crate) fn on_path(program: &str) -> bool {
    Command::new(program).arg("--version").output().is_ok()
}
