//! A system of ROS 2: the settings of its simulator, and the names that ROS permits.

use sesame_plan::Dialect;

use super::Resolver;
use crate::diagnostic::{Code, Diagnostic};
use crate::model::{Clock, StepBy, Stepping, Transport};
use crate::span::Span;
use crate::syntax::ast::{self, BusKind, Name, StepChannel, Text};

/// The highest domain whose ports exist on every system.
const MOST_DOMAIN: u64 = 232;

impl<'a> Resolver<'a> {
    /// The settings of a ROS 2 simulator, if the simulator is one.
    pub(super) fn ast_ros2(&self) -> Option<&'a ast::Ros2> {
        match &self.simulators().next()?.transport {
            Some(ast::Transport::Ros2(ros2)) => Some(ros2),
            _ => None,
        }
    }

    /// The settings of a simulator on a bus, if the simulator is one.
    pub(super) fn ast_bus(&self) -> Option<&'a ast::Bus> {
        match &self.simulators().next()?.transport {
            Some(ast::Transport::Bus(bus)) => Some(bus),
            _ => None,
        }
    }

    /// Of which ROS the simulator is; ROS 2 where it is of none.
    pub(super) fn dialect(&self) -> Dialect {
        match self.ast_bus() {
            Some(bus) if bus.kind == BusKind::Ros1 => Dialect::Ros1,
            Some(bus) => bus.dialects.first().map(|(_, dialect)| *dialect).unwrap_or_default(),
            None => Dialect::Ros2,
        }
    }

    /// Whether the simulator's messages are those of ROS, whichever way they come.
    pub(super) fn is_of_ros(&self) -> bool {
        self.simulators().next().and_then(|simulator| simulator.transport.as_ref()).is_some_and(is_of_ros)
    }

    /// Whether the messages of some lab are those of ROS.
    fn has_a_lab_of_ros(&self) -> bool {
        let simulators = self.file.physicals.iter().flat_map(|lab| &lab.simulators);
        simulators.filter_map(|(_, simulator)| simulator.transport.as_ref()).any(is_of_ros)
    }

    /// The folders with definitions of messages that the simulator names.
    pub(super) fn ast_types(&self) -> &'a [(Span, Vec<Text>)] {
        match (self.ast_ros2(), self.ast_bus()) {
            (Some(ros2), _) => &ros2.types,
            (None, Some(bus)) => &bus.types,
            (None, None) => &[],
        }
    }

    /// Whether the simulator has a clock of its own.
    pub(super) fn has_a_clock(&self) -> bool {
        let clocks = match (self.ast_ros2(), self.ast_bus()) {
            (Some(ros2), _) => &ros2.clocks[..],
            (None, Some(bus)) => &bus.clocks,
            (None, None) => &[],
        };
        clocks.iter().any(|(_, clock)| matches!(clock, ast::Clock::Topic(_)))
    }

    /// The word of the simulator's kind, and where it is declared, if the kind is known and not ROS 2.
    pub(super) fn other_than_ros2(&self) -> Option<(&'static str, Span)> {
        self.kind().filter(|(word, _)| *word != "ros2")
    }

    /// The same if its messages are not those of ROS, and those of no lab are.
    pub(super) fn other_than_ros(&self) -> Option<(&'static str, Span)> {
        self.kind().filter(|_| !self.is_of_ros() && !self.has_a_lab_of_ros())
    }

    /// The same if the simulator itself brings all messages, so that nobody is told apart.
    pub(super) fn one_for_all(&self) -> Option<(&'static str, Span)> {
        self.kind().filter(|(word, _)| matches!(*word, "in_process" | "process" | "simlog"))
    }

    /// The word of the simulator's kind, if that is known, and where it is declared.
    pub(super) fn kind(&self) -> Option<(&'static str, Span)> {
        let simulator = self.simulators().next()?;
        let word = match simulator.transport.as_ref()? {
            ast::Transport::InProcess(_) => "in_process",
            ast::Transport::Process(_) => "process",
            ast::Transport::Ros2(_) => "ros2",
            ast::Transport::Bus(bus) => match bus.kind {
                BusKind::Rosbridge => "rosbridge",
                BusKind::Ros1 => "ros1",
                BusKind::Mqtt => "mqtt",
                BusKind::Simlog => "simlog",
            },
        };
        Some((word, simulator.head.name.span))
    }

    pub(super) fn ros2(&mut self, name: &Name, ros2: &'a ast::Ros2) -> Option<Transport> {
        let domain = match self.single(&ros2.domains, "domain") {
            Some(domain) => self.domain_id(*domain),
            None => Some(0),
        };
        self.single(&ros2.types, "types");
        let clock = self.simulator_clock(&ros2.clocks);
        let step = match self.single(&ros2.steps, "step") {
            Some(step) => self.stepping(name, step, ros2).map(Some),
            None => Some(None),
        };
        let reset = self.reset_service(&ros2.resets);
        Some(Transport::Ros2 { domain: domain?, clock: clock?, step: step?, reset: reset.ok()? })
    }

    pub(super) fn simulator_clock(&mut self, clocks: &'a [(Span, ast::Clock)]) -> Option<Clock> {
        match self.single(clocks, "clock") {
            Some(ast::Clock::Topic(path)) => self.ros_name(path, "topic").map(|path| Clock::Topic { path }),
            Some(ast::Clock::Wall) | None => Some(Clock::Wall),
        }
    }

    /// The service that resets the simulator, if there is one. An error was reported.
    pub(super) fn reset_service(&mut self, resets: &'a [(Span, Text)]) -> Result<Option<String>, ()> {
        match self.single(resets, "reset") {
            Some(path) => self.ros_name(path, "service").map(Some).ok_or(()),
            None => Ok(None),
        }
    }

    pub(super) fn domain_id(&mut self, domain: ast::Count) -> Option<u16> {
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

    fn stepping(&mut self, name: &Name, step: &'a ast::Stepping, ros2: &ast::Ros2) -> Option<Stepping> {
        let step_ns = self.step(&step.time);
        let Some(by) = &step.by else {
            if ros2.has_errors {
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
                if !ros2.clocks.iter().any(|(_, clock)| matches!(clock, ast::Clock::Topic(_))) {
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
                let title = format!("`{name}` is not the name of a {what} in ROS");
                self.report(Diagnostic::new(Code::BAD_PATH, span, title).label(why));
                None
            }
        }
    }
}

/// Whether messages that come this way are those of ROS.
pub(super) fn is_of_ros(transport: &ast::Transport) -> bool {
    match transport {
        ast::Transport::InProcess(_) | ast::Transport::Process(_) => false,
        ast::Transport::Ros2(_) => true,
        ast::Transport::Bus(bus) => matches!(bus.kind, BusKind::Rosbridge | BusKind::Ros1),
    }
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
