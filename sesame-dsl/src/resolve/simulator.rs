//! The simulator: how a runner reaches it, and how it moves on in time.

use super::Resolver;
use crate::diagnostic::{Code, Diagnostic};
use crate::model::{Simulator, Transport};
use crate::span::Span;
use crate::syntax::ast::{self, Name};
use crate::units::Unit;

/// How a simulator's program moves on in time.
enum Pace {
    /// When it is told to, by this much.
    LockStepped { step_ns: u64 },
    /// By its own clock.
    FreeRunning,
}

impl<'a> Resolver<'a> {
    pub(super) fn simulator(&mut self, simulator: &'a ast::Simulator) -> Option<Simulator> {
        let name = &simulator.head.name;
        let transport = match simulator.transport.as_ref()? {
            ast::Transport::InProcess(in_process) => {
                let path = self.rust_path(&in_process.path);
                let folder = self.single(&in_process.crates, "crate");
                let step_ns = self.step_of(name, &in_process.steps, in_process.has_errors);
                let crate_folder = folder.map(|folder| folder.text.clone());
                Transport::InProcess { path: path?, crate_folder, step_ns: step_ns? }
            }
            ast::Transport::Process(process) => {
                let program = self.program(&process.program);
                let pace = self.pace_of(name, process);
                // Empty texts were reported where they were read.
                let arguments = process.arguments.iter().map(|argument| argument.text.clone()).collect();
                let step_ns = match pace? {
                    Pace::LockStepped { step_ns } => Some(step_ns),
                    Pace::FreeRunning => None,
                };
                Transport::Process { program: program?, arguments, step_ns }
            }
            ast::Transport::Ros2(ros2) => self.ros2(name, ros2)?,
            ast::Transport::Bus(bus) => self.bus(name, bus)?,
        };
        Some(Simulator { declaration: self.declaration(&simulator.head), transport })
    }

    /// How a program moves on in time; nothing if that is not clear.
    fn pace_of(&mut self, name: &Name, process: &'a ast::Process) -> Option<Pace> {
        let Some((free, ())) = process.free_running.first() else {
            let step_ns = self.step_of(name, &process.steps, process.has_errors)?;
            return Some(Pace::LockStepped { step_ns });
        };
        self.single(&process.free_running, "free running");
        if let Some((step, _)) = process.steps.first() {
            let title = "a simulator that runs freely has no step".to_owned();
            let diagnostic = Diagnostic::new(Code::CLAUSE_TWICE, *step, title)
                .label("remove `step`, or `free running`")
                .secondary(*free, "it runs freely");
            self.report(diagnostic);
            return None;
        }
        Some(Pace::FreeRunning)
    }

    pub(super) fn step_of(&mut self, name: &Name, steps: &'a [(Span, ast::Quantity)], has_errors: bool) -> Option<u64> {
        let step = self.single(steps, "step");
        if step.is_none() && !has_errors {
            self.missing(name.span, &name.text, "its step size", "step 20ms");
        }
        self.step(step?)
    }

    /// The program and each argument are texts of their own. A path with spaces must begin like `./my robots/`, so that
    /// a whole command line in one text is recognised.
    pub(super) fn program(&mut self, program: &ast::Text) -> Option<String> {
        if program.text.trim().is_empty() {
            return None;
        }
        let first = program.text.split_whitespace().next().unwrap_or_default();
        if !program.text.contains(char::is_whitespace) || first.contains('/') {
            return Some(program.text.clone());
        }
        let parts: Vec<String> = program.text.split_whitespace().map(sesame_notation::quoted).collect();
        let title = format!("`{}` is not a program", program.text);
        let diagnostic = Diagnostic::new(Code::BAD_PATH, program.span, title)
            .label("write the program and each argument as a text of its own; no shell splits them")
            .fix("split the command into a program and its arguments", program.span, parts.join(" "));
        self.report(diagnostic);
        None
    }

    fn rust_path(&mut self, path: &ast::Text) -> Option<String> {
        if path.text.trim().is_empty() {
            return None;
        }
        let identifier = |part: &str| {
            part.starts_with(|first: char| first.is_ascii_alphabetic() || first == '_')
                && part.bytes().all(|byte| byte.is_ascii_alphanumeric() || byte == b'_')
                && !matches!(part, "self" | "Self" | "super" | "crate" | "_")
        };
        let parts: Vec<&str> = path.text.split("::").collect();
        if parts.len() >= 2 && parts.iter().all(|part| identifier(part)) {
            return Some(path.text.clone());
        }
        let title = format!("`{}` is not the path of a Rust type", path.text);
        let diagnostic = Diagnostic::new(Code::BAD_PATH, path.span, title)
            .label("expected a crate and a type, for example `kuka_cell_sim::Cell`");
        self.report(diagnostic);
        None
    }

    pub(super) fn step(&mut self, step: &ast::Quantity) -> Option<u64> {
        let nanoseconds = Unit::parse("ns").expect("`ns` is in the table");
        let seconds = Unit::seconds();
        self.value(step, Some(&seconds), "a step size")?;
        let unit = step.unit.as_ref().and_then(|unit| Unit::parse(&unit.text).ok())?;
        let value = unit.convert(step.value, &nanoseconds);
        // A whole number of nanoseconds in decimals may differ from it by a rounding error.
        let rounded = value.round();
        if (1.0..=3.6e12).contains(&rounded) && (value - rounded).abs() <= rounded * 1e-12 {
            #[expect(
                clippy::cast_possible_truncation,
                clippy::cast_sign_loss,
                reason = "it is whole and in 1..=3.6e12"
            )]
            return Some(rounded as u64);
        }
        let title = format!("`{}` is not a valid step size", self.text(step.span));
        let label = "expected a whole number of nanoseconds from 1ns to 1h";
        self.report(Diagnostic::new(Code::OUT_OF_RANGE, step.span, title).label(label));
        None
    }
}
