//! Systems of ROS: the settings of their simulator, and the names that ROS permits.

use sesame_plan::{Dialect, SimulatorKind, SimulatorProperties};

use super::Resolver;
use super::words::article;
use crate::diagnostic::{Code, Diagnostic};
use crate::model::{Clock, Ros, StepBy, Stepping};
use crate::span::Span;
use crate::syntax::ast::{self, Name, StepChannel, Text};

/// The highest domain whose ports exist on every system.
const MOST_DOMAIN: u64 = 232;

impl<'a> Resolver<'a> {
    /// How the simulator is reached, if that is known.
    pub(super) fn transport(&self) -> Option<&'a ast::Transport> {
        self.simulators().next()?.transport.as_ref()
    }

    /// The ROS of the simulator; ROS 2 if it has none.
    pub(super) fn dialect(&self) -> Dialect {
        let Some(transport) = self.transport() else { return Dialect::default() };
        let written = transport.settings.dialects.first().map(|(_, dialect)| *dialect);
        written.or(transport.kind.properties().ros).unwrap_or_default()
    }

    /// Whether the simulator's messages are those of ROS, whichever way they come.
    pub(super) fn is_of_ros(&self) -> bool {
        self.transport().is_some_and(is_of_ros)
    }

    /// Whether the messages of some lab are those of ROS.
    fn has_a_lab_of_ros(&self) -> bool {
        let simulators = self.file.physicals.iter().flat_map(|lab| &lab.simulators);
        simulators.filter_map(|(_, simulator)| simulator.transport.as_ref()).any(is_of_ros)
    }

    /// The folders with definitions of messages that the simulator names.
    pub(super) fn ast_types(&self) -> &'a [(Span, Vec<Text>)] {
        match self.transport() {
            Some(transport) => &transport.settings.types,
            None => &[],
        }
    }

    /// Whether the simulator has a clock of its own.
    pub(super) fn has_a_clock(&self) -> bool {
        let is_topic = |(_, clock): &(Span, ast::Clock)| matches!(clock, ast::Clock::Topic(_));
        self.transport().is_some_and(|transport| transport.settings.clocks.iter().any(is_topic))
    }

    /// The simulator's kind, if that is known, and where it is declared.
    pub(super) fn kind(&self) -> Option<(SimulatorKind, Span)> {
        let simulator = self.simulators().next()?;
        Some((simulator.transport.as_ref()?.kind, simulator.head.name.span))
    }

    /// The word of the simulator's kind, and where it is declared, if the kind is known and does not have what is asked
    /// for.
    pub(super) fn without(&self, has: impl Fn(SimulatorProperties) -> bool) -> Option<(&'static str, Span)> {
        let (kind, simulator) = self.kind()?;
        let properties = kind.properties();
        (!has(properties)).then_some((properties.keyword, simulator))
    }

    /// The same if its messages are not those of ROS, and those of no lab are.
    pub(super) fn other_than_ros(&self) -> Option<(&'static str, Span)> {
        self.without(|kind| kind.ros.is_some()).filter(|_| !self.has_a_lab_of_ros())
    }

    /// The kind of the simulator and where it is declared, if neither it nor some lab is of ROS 2.
    pub(super) fn other_than_ros_2(&self) -> Option<(&'static str, Span)> {
        if self.dialect() == Dialect::Ros1 && !self.has_a_lab_of_ros() {
            return self.without(|_| false);
        }
        self.other_than_ros()
    }

    /// The domain of the first worker.
    pub(super) fn first_domain(&mut self, written: &'a ast::Transport) -> Option<u16> {
        match self.single(&written.settings.domains, "domain") {
            Some(domain) => self.domain_id(*domain),
            None => Some(0),
        }
    }

    /// What systems of ROS have in common.
    pub(super) fn ros(&mut self, name: &Name, written: &'a ast::Transport) -> Option<Ros> {
        let settings = &written.settings;
        self.single(&settings.types, "types");
        let clock = self.simulator_clock(&settings.clocks);
        let step = match self.single(&settings.steppings, "step") {
            Some(step) => self.stepping(name, step, settings).map(Some),
            None => Some(None),
        };
        let reset = self.reset_service(&settings.resets);
        Some(Ros { clock: clock?, step: step?, reset: reset.ok()?, interfaces: Vec::new() })
    }

    fn simulator_clock(&mut self, clocks: &'a [(Span, ast::Clock)]) -> Option<Clock> {
        match self.single(clocks, "clock") {
            Some(ast::Clock::Topic(path)) => self.ros_name(path, "topic").map(|path| Clock::Topic { path }),
            Some(ast::Clock::Wall) | None => Some(Clock::Wall),
        }
    }

    /// The service that resets the simulator, if there is one. An error was reported.
    fn reset_service(&mut self, resets: &'a [(Span, Text)]) -> Result<Option<String>, ()> {
        match self.single(resets, "reset") {
            Some(path) => self.ros_name(path, "service").map(Some).ok_or(()),
            None => Ok(None),
        }
    }

    fn domain_id(&mut self, domain: ast::Count) -> Option<u16> {
        let value = domain.value?;
        if value > MOST_DOMAIN {
            let title = format!("`{}` is not a domain", self.text(domain.span));
            let diagnostic = Diagnostic::new(Code::OUT_OF_RANGE, domain.span, title)
                .label(format!("expected a whole number from 0 to {MOST_DOMAIN}"));
            self.report(diagnostic.note("worker N uses the Nth domain after it"));
            return None;
        }
        u16::try_from(value).ok()
    }

    fn stepping(&mut self, name: &Name, step: &'a ast::Stepping, settings: &ast::Settings) -> Option<Stepping> {
        let step_ns = self.step(&step.time);
        let Some(by) = &step.by else {
            if settings.has_errors {
                return None;
            }
            let title = format!("the step of `{}` does not say what takes it", name.text);
            let diagnostic = Diagnostic::new(Code::CLAUSE_MISSING, step.time.span, title)
                .label("add a service or a topic")
                .suggest("add `by service \"/step\"`", step.time.span.end(), " by service \"/step\"")
                .note("without `step`, the simulator runs freely");
            self.report(diagnostic);
            return None;
        };
        let what = match by.channel {
            StepChannel::Service => "service",
            StepChannel::Topic => "topic",
        };
        let path = self.ros_name(&by.path, what);
        let by = match by.channel {
            StepChannel::Service => StepBy::Service { path: path? },
            StepChannel::Topic => {
                if !settings.clocks.iter().any(|(_, clock)| matches!(clock, ast::Clock::Topic(_))) {
                    let title = format!("a step by topic needs a clock, but `{}` has none", name.text);
                    let diagnostic = Diagnostic::new(Code::CLAUSE_MISSING, by.span.to(by.path.span), title)
                        .label("a topic does not answer: only the clock shows that the step was taken")
                        .note("add the topic of the simulation time, for example `clock \"/clock\"`");
                    self.report(diagnostic);
                    return None;
                }
                StepBy::Topic { path: path? }
            }
        };
        Some(Stepping { step_ns: step_ns?, by })
    }

    /// The absolute name of a topic, service or node.
    pub(super) fn ros_name(&mut self, written: &Text, what: &str) -> Option<String> {
        // An empty text was reported where it was read.
        if written.text.trim().is_empty() {
            return None;
        }
        self.absolute(&written.text, written.span, what)
    }

    /// The absolute name of something in ROS; reports one that ROS does not permit.
    pub(super) fn absolute(&mut self, name: &str, span: Span, what: &str) -> Option<String> {
        match absolute(name) {
            Ok(name) => Some(name),
            Err(why) => {
                let title = format!("`{name}` is not the name of {} in ROS", article(what));
                self.report(Diagnostic::new(Code::BAD_PATH, span, title).label(why));
                None
            }
        }
    }
}

/// Whether messages that come this way are those of ROS.
pub(super) fn is_of_ros(transport: &ast::Transport) -> bool {
    transport.kind.properties().ros.is_some()
}

/// A name with a `/` before it, or why ROS does not permit it.
fn absolute(name: &str) -> Result<String, String> {
    const LONGEST: usize = 247;
    let relative = name.strip_prefix('/').unwrap_or(name);
    if name.contains('~') {
        return Err("`~` stands for a node's own name, which only the node knows; write the whole name".to_owned());
    }
    if let Some(c) = name.chars().find(|&c| !(c.is_ascii_alphanumeric() || c == '_' || c == '/')) {
        let c = if c == ' ' { "a space".to_owned() } else { format!("`{}`", c.escape_default()) };
        return Err(format!("it contains {c}; a name consists of ASCII letters, digits, `_` and `/`"));
    }
    for part in relative.split('/') {
        match part.chars().next() {
            None if relative.is_empty() => return Err("expected a name after the `/`".to_owned()),
            None if relative.ends_with('/') && !relative.contains("//") => {
                return Err("a name does not end in `/`".to_owned());
            }
            None => return Err("a name does not contain `//`".to_owned()),
            Some(first) if first.is_ascii_digit() => {
                return Err(format!("`{part}` begins with a digit"));
            }
            Some(_) => {}
        }
    }
    if relative.len() > LONGEST {
        return Err(format!("a name has at most {LONGEST} letters"));
    }
    Ok(format!("/{relative}"))
}

#[cfg(test)]
mod tests {
    use super::absolute;

    #[test]
    fn a_name_becomes_absolute() {
        assert_eq!(absolute("arm/joint_states").unwrap(), "/arm/joint_states");
        assert_eq!(absolute("/clock").unwrap(), "/clock");
    }

    #[test]
    fn a_name_that_ros_does_not_permit_is_refused() {
        for name in ["~/a", "a b", "a//b", "//a", "a/", "/", "a/3d", "3d", "a-b", "ä", "a.b"] {
            assert!(absolute(name).is_err(), "{name}");
        }
    }
}
