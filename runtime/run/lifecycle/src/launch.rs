//! The programs that a plan launches in addition to its simulator: what starts the system as a whole, and its nodes.
//!
//! A transport starts them with the seed of a run, asks [`poll_ready`](Launched::poll_ready) until all are ready, asks
//! [`check`](Launched::check) while the run lasts, and ends them. Each is started without a shell, in the folder of the
//! `.sesame` file, with an empty standard input; what it writes goes to the log of its worker. What starts the system
//! is ready before any node is launched. Each program has a keeper of its own, so nothing outlives the worker.

mod part;
mod placeholders;
mod port;
mod signals;
mod terminate;
mod waiting;

use std::collections::BTreeMap;
use std::path::PathBuf;
use std::sync::Arc;
use std::thread;
use std::time::{Duration, Instant};

use sesame_plan::{CampaignPlan, Command, Launch, NodeId, ReadyWhen, TopicId};
use thiserror::Error;

use self::part::{Problem, Started};
use self::placeholders::{Own, asks_for_port};
use self::port::Port;
use self::terminate::Terminate;
use self::waiting::Waiting;
use crate::limits::END_LIMIT;
use crate::program::{Alarm, Program};

pub use self::terminate::terminate_all;
pub use self::waiting::Tell;

/// How often it is looked whether a program is ready.
const PAUSE: Duration = Duration::from_millis(10);

/// A program that did not start, or did not stay.
#[derive(Debug, Clone, PartialEq, Error)]
pub enum LaunchError {
    /// One could not be started, or was not ready in time.
    #[error("the launch failed: {what} {problem}{}", quoted(last_lines))]
    Failed {
        /// The program, and whose it is.
        what: String,
        /// The problem, as a phrase.
        problem: String,
        /// The last lines that it wrote.
        last_lines: String,
    },
    /// One ended in the middle of a run.
    #[error("{what} {how}{}", quoted(last_lines))]
    Ended {
        /// The program, and whose it is.
        what: String,
        /// How it ended, as a phrase.
        how: String,
        /// The last lines that it wrote.
        last_lines: String,
    },
}

fn quoted(last_lines: &str) -> String {
    if last_lines.is_empty() { String::new() } else { format!("; the last lines that it wrote:\n{last_lines}") }
}

/// What is launched.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Part {
    /// What starts the system as a whole.
    System,
    /// A node.
    Node(NodeId),
}

/// What a launched program's transport is asked: only it knows.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Probe {
    /// Whether there was a message on a topic since the launch.
    Topic(TopicId),
    /// Whether the clock of the simulator has advanced since the launch.
    Clock,
}

/// What programs are given of their worker and of their transport.
#[derive(Debug, Clone)]
pub struct LaunchContext {
    /// The number of the worker.
    pub worker: u32,
    /// The worker's own folder.
    pub folder: PathBuf,
    /// The folder of the `.sesame` file, in which programs run.
    pub space: PathBuf,
    /// What `{domain}` stands for.
    pub domain: u32,
    /// What is in the environment of all programs in addition to `SESAME_WORKER`, `SESAME_WORKER_FOLDER` and
    /// `SESAME_SEED`. Placeholders in its values are replaced as in arguments.
    pub environment: Vec<(String, String)>,
    /// What an argument `{ros-args}` stands for; nothing for what is not in it.
    pub ros_args: BTreeMap<Part, Vec<String>>,
    /// Whether this process is a runner, whose executable can be the keeper of programs.
    pub in_runner: bool,
}

impl LaunchContext {
    /// The context of the worker that this process is. The number of the worker is its domain.
    pub fn of_worker(space: PathBuf) -> Self {
        let worker = std::env::var("SESAME_WORKER").ok().and_then(|number| number.parse().ok()).unwrap_or(1);
        LaunchContext {
            worker,
            folder: std::env::current_dir().unwrap_or_default(),
            space,
            domain: worker,
            environment: Vec::new(),
            ros_args: BTreeMap::new(),
            in_runner: true,
        }
    }

    /// The same for nodes of ROS, which `{ros-args}` remaps.
    pub fn remapping(self, plan: &CampaignPlan) -> Self {
        let nodes = (0u32..).map(NodeId).take(plan.nodes.len());
        let ros_args = std::iter::once((Part::System, plan.ros_args(None)))
            .chain(nodes.map(|node| (Part::Node(node), plan.ros_args(Some(node)))));
        LaunchContext { ros_args: ros_args.collect(), ..self }
    }

    /// The same for nodes of ROS 2, in the domain of this worker; `first` is that of the first one. Nothing beyond this
    /// machine is addressed.
    pub fn in_domain(self, first: u16) -> Self {
        // Workers are counted from 1.
        let before = u16::try_from(self.worker.saturating_sub(1)).unwrap_or(u16::MAX);
        let domain = first.saturating_add(before);
        let environment = vec![
            ("ROS_DOMAIN_ID".to_owned(), domain.to_string()),
            ("ROS_LOG_DIR".to_owned(), self.folder.join("ros").display().to_string()),
            ("ROS_AUTOMATIC_DISCOVERY_RANGE".to_owned(), "LOCALHOST".to_owned()),
        ];
        LaunchContext { domain: domain.into(), environment, ..self }
    }
}

/// How long the end of all programs that a plan starts may take.
pub fn end_limit(plan: &CampaignPlan) -> Duration {
    let lifecycle = &plan.simulator.lifecycle;
    let launches = lifecycle.launch.is_some() || plan.nodes.iter().any(|node| node.launch.is_some());
    if !launches && plan.simulator.program().is_none() {
        return Duration::ZERO;
    }
    END_LIMIT + if lifecycle.terminate.is_some() { terminate::LIMIT } else { Duration::ZERO }
}

/// The programs that a plan launches. Dropping it ends them.
pub struct Launched {
    context: LaunchContext,
    parts: Vec<(Part, Started)>,
    terminate: Option<Command>,
    seed: u64,
    /// The values of scenes in arguments, by their names.
    scene: Vec<(String, String)>,
    port: Option<Port>,
    /// To be run at the end; `None` while nothing is launched.
    pending: Option<Arc<Terminate>>,
    /// Whether all were ready once since the last start.
    ready: bool,
    /// How many of the parts were started.
    begun: usize,
    alarm: Alarm,
    killed: bool,
    notes: Vec<String>,
    waiting: Waiting,
}

impl Launched {
    /// The programs of this plan. Nothing is started yet.
    pub fn new(plan: &CampaignPlan, context: LaunchContext) -> Self {
        let awaited = |launch: &Launch| launch.ready.as_ref().map(|ready| phrase(plan, &ready.when));
        let part = |part, launch: &Launch, of: &str| {
            let shown = format!("the program `{}` of {of}", shown(&launch.command));
            (part, Started::new(launch.clone(), shown, awaited(launch)))
        };
        let system = plan.simulator.lifecycle.launch.as_ref().map(|launch| part(Part::System, launch, "the system"));
        let nodes = (0..).map(NodeId).zip(&plan.nodes).filter_map(|(id, node)| {
            node.launch.as_ref().map(|launch| part(Part::Node(id), launch, &format!("node `{}`", node.name)))
        });
        Launched {
            context,
            parts: system.into_iter().chain(nodes).collect(),
            terminate: plan.simulator.lifecycle.terminate.clone(),
            seed: 0,
            scene: Vec::new(),
            port: None,
            pending: None,
            ready: false,
            begun: 0,
            alarm: Alarm::default(),
            killed: false,
            notes: Vec::new(),
            waiting: Waiting::default(),
        }
    }

    /// Calls this from now on when a start takes long, with what it waits for.
    pub fn tell_waiting(&mut self, tell: Tell) {
        self.waiting.tell(tell);
    }

    /// Notes what the system lacks before a run can begin, each in a phrase. Call it again and again until the system
    /// lacks nothing, or ends.
    pub fn lacks(&mut self, missing: &[String]) {
        self.waiting.lacks(missing, Instant::now());
    }

    /// Whether the plan launches nothing.
    pub fn is_empty(&self) -> bool {
        self.parts.is_empty()
    }

    /// Whether programs were started and not ended.
    pub fn is_started(&self) -> bool {
        self.begun > 0
    }

    /// Whether the programs of a run with these values in their arguments are those of the last start. Otherwise they
    /// have to be started anew, even where a simulator is reset between runs.
    pub fn are_of(&self, scene: &[(String, String)]) -> bool {
        self.scene == scene
    }

    /// Ends what is running, and starts the programs for a run with this seed and these values in their arguments, by
    /// the names of placeholders: what starts the system as a whole, or, if there is no such program, all nodes.
    /// [`poll_ready`](Self::poll_ready) starts the others.
    pub fn start(&mut self, seed: u64, scene: &[(String, String)]) -> Result<(), LaunchError> {
        self.end();
        scene.clone_into(&mut self.scene);
        if self.parts.is_empty() {
            self.ready = true;
            return Ok(());
        }
        self.seed = seed;
        self.alarm = Alarm::default();
        self.killed = false;
        self.reserve_port()?;
        if let Some(command) = &self.terminate {
            self.pending = Some(Terminate::pending(self.program(command, Part::System), shown(command)));
        }
        self.begin()
    }

    /// Starts them and waits until all are ready, for a simulator that has neither topics nor a clock before
    /// `until_then`, a phrase: a program that awaits either would never be ready, so that is an error.
    pub fn start_first(&mut self, seed: u64, scene: &[(String, String)], until_then: &str) -> Result<(), LaunchError> {
        self.start(seed, scene)?;
        let mut asked = false;
        self.await_ready(&mut |_| {
            asked = true;
            true
        })?;
        if asked {
            self.end();
            return Err(LaunchError::Failed {
                what: "a program".to_owned(),
                problem: format!(
                    "is awaited by a topic or the clock, which a simulator of this kind has only {until_then}; await a \
                     port or a line instead"
                ),
                last_lines: String::new(),
            });
        }
        Ok(())
    }

    /// Reserves the port that `{port}` stands for, if programs ask for it and there is none yet.
    pub fn reserve_port(&mut self) -> Result<(), LaunchError> {
        if self.port.is_none() && self.asks_for_port() {
            let reserved = Port::reserve(self.context.worker).map_err(|error| LaunchError::Failed {
                what: "`{port}`".to_owned(),
                problem: format!("cannot be replaced: {error}"),
                last_lines: String::new(),
            });
            self.port = Some(reserved?);
        }
        Ok(())
    }

    /// Whether all programs are ready; to be asked until they are. Starts programs whose turn has come. `asked` is
    /// called for what only the transport knows. After an error, everything is ended.
    pub fn poll_ready(&mut self, asked: &mut dyn FnMut(Probe) -> bool) -> Result<bool, LaunchError> {
        let mut ready = true;
        for at in 0..self.begun {
            let port = self.awaited_port(at)?;
            match self.parts[at].1.poll(port, asked) {
                Ok(is_ready) => ready &= is_ready,
                Err(problem) => return Err(self.failed(at, problem)),
            }
        }
        if ready && self.begun < self.parts.len() {
            self.begin()?;
            return self.poll_ready(asked);
        }
        self.ready |= ready;
        Ok(ready)
    }

    /// Waits until all programs are ready.
    pub fn await_ready(&mut self, asked: &mut dyn FnMut(Probe) -> bool) -> Result<(), LaunchError> {
        while !self.poll_ready(asked)? {
            thread::sleep(PAUSE);
        }
        Ok(())
    }

    /// That no program has ended, apart from those that [`kill`](Self::kill) ended. After an error, everything is
    /// ended.
    pub fn check(&mut self) -> Result<(), LaunchError> {
        for at in 0..self.begun {
            if let Err(problem) = self.parts[at].1.check() {
                return Err(self.failed(at, problem));
            }
        }
        Ok(())
    }

    /// Set as soon as a program of the current start has ended, until the next start: then [`check`](Self::check) says
    /// which. For a transport that waits elsewhere; `None` if the plan launches nothing.
    pub fn alarm(&self) -> Option<Alarm> {
        (!self.is_empty()).then(|| Alarm::clone(&self.alarm))
    }

    /// Whether a program that has ended was killed (`SIGKILL`) by a user, or by the system when memory ran out.
    pub fn was_killed(&self) -> bool {
        self.killed
    }

    /// What went wrong and concerns no run, in words for the user; once each.
    pub fn take_notes(&mut self) -> Vec<String> {
        std::mem::take(&mut self.notes)
    }

    /// The number of the worker that it runs for.
    pub fn worker(&self) -> u32 {
        self.context.worker
    }

    /// A text with its placeholders replaced by what this worker has.
    pub fn fill(&self, text: &str) -> String {
        self.own().fill(text)
    }

    /// The port that `{port}` stands for, once programs were started that ask for it.
    pub fn port(&self) -> Option<u16> {
        self.port.as_ref().map(Port::number)
    }

    /// Stops all processes of a node (`SIGSTOP`); false if it does not run, or the system has no way.
    pub fn pause(&mut self, node: NodeId) -> bool {
        self.node(node).is_some_and(Started::pause)
    }

    /// Lets all processes of a paused node go on; false if it was not paused.
    pub fn resume(&mut self, node: NodeId) -> bool {
        self.node(node).is_some_and(Started::resume)
    }

    /// Ends all processes of a node at once (`SIGKILL`); false if it does not run. From now on it may be off.
    pub fn kill(&mut self, node: NodeId) -> bool {
        self.node(node).is_some_and(Started::kill)
    }

    /// Kills a node if it runs, and starts it again. [`poll_ready`](Self::poll_ready) says when it is ready. False if
    /// the plan does not launch it.
    pub fn restart(&mut self, node: NodeId) -> Result<bool, LaunchError> {
        let Some(at) = self.parts[..self.begun].iter().position(|(part, _)| *part == Part::Node(node)) else {
            return Ok(false);
        };
        self.parts[at].1.kill();
        self.launch(at)?;
        Ok(true)
    }

    /// Ends everything: runs the command that ends the system, then asks each program to end, then ends what is left.
    pub fn end(&mut self) {
        for (_, started) in &mut self.parts {
            started.resume();
        }
        if let Some(terminate) = self.pending.take()
            && let Some(note) = terminate.run()
        {
            self.notes.push(note);
        }
        // The last one first. All are asked before any is waited for.
        for (_, started) in self.parts.iter_mut().rev() {
            started.ask_to_end();
        }
        for (_, started) in self.parts.iter_mut().rev() {
            started.end();
        }
        self.begun = 0;
        self.ready = false;
        self.lacks(&[]);
    }

    /// Starts the programs whose turn it is: what starts the system, or all nodes.
    fn begin(&mut self) -> Result<(), LaunchError> {
        let system = self.begun == 0 && self.parts.first().is_some_and(|(part, _)| *part == Part::System);
        let until = if system { 1 } else { self.parts.len() };
        for at in self.begun..until {
            self.begun = at + 1;
            self.launch(at)?;
        }
        Ok(())
    }

    fn launch(&mut self, at: usize) -> Result<(), LaunchError> {
        let (part, started) = &self.parts[at];
        let program = self.program(&started.launch.command, *part);
        let alarm = Alarm::clone(&self.alarm);
        self.parts[at].1.start(&program, &alarm).map_err(|problem| self.failed(at, problem))
    }

    /// The error for a problem of a program; everything is ended.
    fn failed(&mut self, at: usize, problem: Problem) -> LaunchError {
        let Problem { what: problem, last_lines, not_started, killed } = problem;
        let what = self.parts[at].1.shown.clone();
        let were_ready = self.ready;
        self.killed |= killed;
        self.end();
        if were_ready && !not_started {
            LaunchError::Ended { what, how: problem, last_lines }
        } else {
            LaunchError::Failed { what, problem, last_lines }
        }
    }

    /// The program of a command for the current run.
    fn program(&self, command: &Command, part: Part) -> Program {
        let LaunchContext { worker, folder, space, environment, ros_args, in_runner, .. } = &self.context;
        let own = self.own();
        let list = ros_args.get(&part).map_or(&[][..], Vec::as_slice);
        let filled = environment.iter().map(|(name, value)| (name.clone(), own.fill(value)));
        let of_worker = [
            ("SESAME_WORKER".to_owned(), worker.to_string()),
            ("SESAME_WORKER_FOLDER".to_owned(), folder.display().to_string()),
            ("SESAME_SEED".to_owned(), self.seed.to_string()),
        ];
        Program {
            name: command.program.clone(),
            arguments: own.arguments(&command.arguments, list),
            folder: space.clone(),
            environment: of_worker.into_iter().chain(filled).collect(),
            in_runner: *in_runner,
        }
    }

    fn own(&self) -> Own {
        Own {
            worker: self.context.worker,
            domain: self.context.domain,
            port: self.port(),
            folder: self.context.folder.display().to_string(),
            seed: self.seed,
            scene: self.scene.clone(),
        }
    }

    fn asks_for_port(&self) -> bool {
        let ready = |launch: &Launch| match launch.ready.as_ref().map(|ready| &ready.when) {
            Some(ReadyWhen::Port { port }) => asks_for_port(port),
            _ => false,
        };
        let asks = |command: &Command| command.arguments.iter().any(|argument| asks_for_port(argument));
        self.parts.iter().any(|(_, started)| asks(&started.launch.command) || ready(&started.launch))
            || self.terminate.as_ref().is_some_and(asks)
            || self.context.environment.iter().any(|(_, value)| asks_for_port(value))
    }

    /// The port on which a program is awaited, if one is.
    fn awaited_port(&mut self, at: usize) -> Result<Option<u16>, LaunchError> {
        let started = &self.parts[at].1;
        let Some(ReadyWhen::Port { port }) = started.launch.ready.as_ref().map(|ready| &ready.when) else {
            return Ok(None);
        };
        if started.is_ready() {
            return Ok(None);
        }
        let text = self.own().fill(port);
        if let Ok(number) = text.trim().parse() {
            return Ok(Some(number));
        }
        let what = format!("is awaited on port `{text}`, which is not a number from 1 to 65535");
        Err(self.failed(at, Problem { what, last_lines: String::new(), not_started: true, killed: false }))
    }

    fn node(&mut self, node: NodeId) -> Option<&mut Started> {
        let (_, started) = self.parts.iter_mut().find(|(part, _)| *part == Part::Node(node))?;
        started.is_on().then_some(started)
    }
}

impl Drop for Launched {
    fn drop(&mut self) {
        self.end();
    }
}

/// A command as it is written in the space: the same for each worker.
fn shown(command: &Command) -> String {
    Program {
        name: command.program.clone(),
        arguments: command.arguments.clone(),
        folder: PathBuf::new(),
        environment: Vec::new(),
        in_runner: false,
    }
    .shown()
}

/// What is awaited, as a phrase.
fn phrase(plan: &CampaignPlan, when: &ReadyWhen) -> String {
    match when {
        ReadyWhen::Topic { topic } => format!("the first message on topic `{}`", plan.topic(*topic).name),
        ReadyWhen::Port { port } => format!("a connection to port {port}"),
        ReadyWhen::Clock => "the clock of the simulator".to_owned(),
        ReadyWhen::Line { text } => format!("a line with `{text}`"),
    }
}

#[cfg(test)]
mod tests;
