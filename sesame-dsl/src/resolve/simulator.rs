//! The simulator: how a runner reaches it, and how it moves on in time.

use sesame_plan::SimulatorKind;

use super::Resolver;
use super::quantity::is_bare_and_not_positive;
use crate::diagnostic::{Code, Diagnostic};
use crate::model::{Simulator, Transport};
use crate::syntax::ast::{self, Name};
use crate::units::Unit;

impl<'a> Resolver<'a> {
    pub(super) fn simulator(&mut self, simulator: &'a ast::Simulator) -> Option<Simulator> {
        let written = simulator.transport.as_ref()?;
        let name = &simulator.head.name;
        let crate_folder = self.single(&written.settings.crates, "crate").map(|folder| folder.text.clone());
        let ros = match written.kind.properties().ros {
            Some(_) => self.ros(name, written).map(Some),
            None => Some(None),
        };
        let transport = match written.kind {
            SimulatorKind::InProcess => self.in_process(name, written),
            SimulatorKind::Process => self.process(name, written),
            _ => self.on_a_bus(name, written),
        };
        let proxies = self.proxies(&written.settings.proxies, written.kind);
        let declaration = self.declaration(&simulator.head);
        Some(Simulator { declaration, transport: transport?, crate_folder, ros: ros?, proxies: proxies? })
    }

    fn in_process(&mut self, name: &Name, written: &'a ast::Transport) -> Option<Transport> {
        let path = self.rust_path(written.first_text());
        let step_ns = self.step_of(name, &written.settings);
        Some(Transport::InProcess { path: path?, step_ns: step_ns? })
    }

    fn process(&mut self, name: &Name, written: &'a ast::Transport) -> Option<Transport> {
        let program = self.program(written.first_text());
        // Empty texts were reported where they were read.
        let arguments = written.texts[1..].iter().map(|argument| argument.text.clone()).collect();
        let step_ns = self.pace_of(name, &written.settings);
        Some(Transport::Process { program: program?, arguments, step_ns: step_ns.ok()? })
    }

    /// How a program moves on in time: in steps of so many nanoseconds, or freely. An error was reported.
    fn pace_of(&mut self, name: &Name, settings: &'a ast::Settings) -> Result<Option<u64>, ()> {
        let Some((free, ())) = settings.free_running.first() else {
            return self.step_of(name, settings).map(Some).ok_or(());
        };
        self.single(&settings.free_running, "free running");
        if let Some((step, _)) = settings.steps.first() {
            let title = "a simulator that runs freely has no step".to_owned();
            let diagnostic = Diagnostic::new(Code::CLAUSE_TWICE, *step, title)
                .label("remove `step`, or `free running`")
                .secondary(*free, "it runs freely");
            self.report(diagnostic);
            return Err(());
        }
        Ok(None)
    }

    pub(super) fn step_of(&mut self, name: &Name, settings: &'a ast::Settings) -> Option<u64> {
        let step = self.single(&settings.steps, "step");
        if step.is_none() && !settings.has_errors {
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
        let value = if is_bare_and_not_positive(step) {
            0.0
        } else {
            self.value(step, Some(&seconds), "a step size")?;
            let unit = step.unit.as_ref().and_then(|unit| Unit::parse(&unit.text).ok())?;
            unit.convert(step.value, &nanoseconds)
        };
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
