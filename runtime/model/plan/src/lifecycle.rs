//! The life of a system around its simulator: what starts it, when it is ready, what ends it.

use serde::{Deserialize, Serialize};

use crate::{CampaignPlan, Domain, Operation, TopicId};

/// What a system says in addition to its simulator.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
pub struct Lifecycle {
    /// What starts it as a whole; nodes may have launches of their own.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub launch: Option<Launch>,
    /// What ends it, before what is left of it is ended by signals.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub terminate: Option<Command>,
    /// What the relay may add to a message's way.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub relay_budget: Option<RelayBudget>,
}

impl Lifecycle {
    /// Whether it says nothing.
    pub fn is_default(&self) -> bool {
        *self == Lifecycle::default()
    }
}

/// A program that the runner starts and ends.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Launch {
    /// The program.
    pub command: Command,
    /// When it counts as ready; `None` is at once.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub ready: Option<Ready>,
}

/// A program to run, without a shell.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct Command {
    /// A name to be found on `PATH`, or a path with `/` in it, relative to the folder of the `.sesame` file, in which
    /// the program runs.
    pub program: String,
    /// Its arguments, one by one. `{worker}`, `{domain}`, `{port}`, `{folder}` and `{seed}` in them are replaced by
    /// what the worker has of its own; an argument `{ros-args}` by the remappings that cut the topics of the node.
    /// `{NAME}` of a [scene](crate::OperationKind::Scene) without a parameter of the simulator is replaced by its value
    /// in the run.
    pub arguments: Vec<String>,
}

/// When a launched program is ready.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Ready {
    /// What shows it.
    pub when: ReadyWhen,
    /// Wall time after which it has failed to start, in seconds; positive.
    pub within: f64,
}

/// What shows that a launched program is ready.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
#[serde(tag = "kind", rename_all = "snake_case")]
pub enum ReadyWhen {
    /// The first message on a topic.
    Topic {
        /// Which.
        topic: TopicId,
    },
    /// A connection to a TCP port of this machine succeeds. The text may contain `{port}` and `{worker}`.
    Port {
        /// The number, after replacements.
        port: String,
    },
    /// The clock of the simulator advances.
    Clock,
    /// A line of standard output or standard error contains this text.
    Line {
        /// The text.
        text: String,
    },
}

/// What the relay may add to a message's way, in seconds of wall time.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct RelayBudget {
    /// Delay at most; positive.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub latency: Option<f64>,
    /// Difference of two delays at most; positive.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub jitter: Option<f64>,
}

impl CampaignPlan {
    /// All commands that start or end programs of the system: that of the system as a whole, those of nodes, and the
    /// one that ends it.
    pub fn commands_mut(&mut self) -> impl Iterator<Item = &mut Command> {
        let Lifecycle { launch, terminate, relay_budget: _ } = &mut self.simulator.lifecycle;
        let launches = launch.iter_mut().chain(self.nodes.iter_mut().filter_map(|node| node.launch.as_mut()));
        launches.map(|launch| &mut launch.command).chain(terminate)
    }

    /// The same to read.
    pub fn commands(&self) -> impl Iterator<Item = &Command> {
        let Lifecycle { launch, terminate, relay_budget: _ } = &self.simulator.lifecycle;
        let launches = launch.iter().chain(self.nodes.iter().filter_map(|node| node.launch.as_ref()));
        launches.map(|launch| &launch.command).chain(terminate)
    }
}

impl Operation {
    /// A value of a scene as an argument of a program: a whole number, or a number with a decimal point and without an
    /// exponent, so that ROS takes it for one of floating point.
    pub fn as_argument(&self, value: f64) -> String {
        // There is no `-0`.
        let written = (value + 0.0).to_string();
        let integer =
            self.parameters.iter().any(|parameter| matches!(parameter.domain, Domain::Number { integer: true, .. }));
        if integer || written.contains('.') { written } else { format!("{written}.0") }
    }
}

/// A text with words in braces replaced by their values, each once: what is put in is not looked at again. Words that
/// have no value stay as they are, with their braces.
pub fn fill_placeholders(text: &str, value: impl Fn(&str) -> Option<String>) -> String {
    let mut filled = String::with_capacity(text.len());
    let mut rest = text;
    while let Some((before, after)) = rest.split_once('{') {
        filled.push_str(before);
        rest = after;
        match after.split_once('}').and_then(|(word, after)| Some((value(word)?, after))) {
            Some((value, after)) => {
                filled.push_str(&value);
                rest = after;
            }
            None => filled.push('{'),
        }
    }
    filled.push_str(rest);
    filled
}

/// Whether a text has this word in braces.
pub fn has_placeholder(text: &str, word: &str) -> bool {
    text.contains(&format!("{{{word}}}"))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::OperationKind;
    use crate::testing::operation;

    #[test]
    fn a_real_number_has_a_decimal_point_in_an_argument_and_a_whole_one_has_none() {
        let mut scene = operation(0, OperationKind::Scene { parameter: None, usual: Some(0.0) });
        let written = |scene: &Operation| [1.5, -2.0, -0.0, 1e-7, 1e20].map(|value| scene.as_argument(value));
        assert_eq!(written(&scene), ["1.5", "-2.0", "0.0", "0.0000001", "100000000000000000000.0"]);
        let Domain::Number { integer, .. } = &mut scene.parameters[0].domain else { panic!("it is a number") };
        *integer = true;
        assert_eq!([3.0, -0.0].map(|value| scene.as_argument(value)), ["3", "0"]);
    }
}
