//! What operations do to messages.

use serde::{Deserialize, Serialize};

use crate::{NamedNumber, NodeId};

/// What an operation does to the messages of its topic, with the parameters that a test chooses for it.
///
/// Only numbers, points, texts and truth values at an operation's places are changed as the kind says; the generator
/// makes sure that they are of a type that the kind is for. Numbers are in the unit of their field. Results of whole
/// numbers are rounded to the nearest whole number, halves away from zero, and held inside 64 bits.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(tag = "kind", rename_all = "snake_case")]
pub enum OperationKind {
    /// Replaces or shifts numbers and points by fresh uniform draws per message. Of numbers one parameter, a sub-range
    /// ([`crate::ChoiceKind::Range`]) in the field's unit: `value` or `offset`. Of points three of them: `x`, `y`, `z`.
    RandomValue {
        /// Whether the draw replaces the value or is added to it.
        mode: ValueMode,
        /// Whether the values are whole numbers; the draw is then uniform over the whole numbers of the range.
        integer: bool,
    },
    /// Replaces texts by a fresh draw per message. No parameters.
    RandomText {
        /// What is drawn from, each alike: at least one, none twice.
        texts: Vec<String>,
    },
    /// Replaces numbers by those of constants, a fresh draw per message. No parameters.
    RandomConstant {
        /// What is drawn from, each alike: at least one, no name twice.
        constants: Vec<NamedNumber>,
    },
    /// Replaces values by one and the same. One parameter `value`: a number, a point or a text; of truth values none.
    StuckAt {
        /// The truth value, where that is what is replaced.
        truth: Option<bool>,
    },
    /// Replaces numbers by that of a constant. One parameter `value`: the name of the constant, a text.
    StuckAtConstant {
        /// The number of each name that the parameter permits; finite.
        numbers: Vec<f64>,
    },
    /// Adds one and the same. One parameter `bias`: a number, or a point.
    Bias,
    /// Adds what grows with the time since the operation went on. One parameter `rate`: a number or a point, in the
    /// field's unit per second.
    Drift,
    /// Adds a fresh normal draw per message and number, of mean zero. One parameter `sigma`, not negative: its standard
    /// deviation, on each axis of a point.
    Noise,
    /// Adds a Brownian motion per number that starts at 0 when the operation becomes active. One parameter `sigma`, not
    /// negative: its standard deviation after one second of being active, on each axis of a point.
    RandomWalk,
    /// Multiplies. One parameter `factor`: a number.
    Scale,
    /// Replaces reals, and all coordinates of points, by a value that is not a finite number. No parameters.
    NotFinite {
        /// By what.
        number: NotFinite,
    },
    /// Repeats, on each wire, the values that were there last before the operation went on; if none were, the first
    /// ones after that. With no places: the whole message. No parameters.
    Freeze,
    /// Replaces values by those that were there some time ago. With no places: the whole message. One parameter `age`
    /// in seconds, not negative.
    Stale,
    /// Adds to time stamps. One parameter `skew`, in the field's unit.
    ClockSkew,
    /// Drops each message independently. One parameter `loss`: the probability to drop, a value in `0..=1`.
    PacketLoss,
    /// Drops messages in bursts (Gilbert 1960, Elliott 1963). Parameters, values in `0..=1`: `enter` and `leave`, the
    /// probabilities per message that a burst begins and ends, and where it is not 1, `loss`, the probability to drop a
    /// message of a burst.
    BurstLoss,
    /// Drops what comes sooner after the last message that passed on the wire than the period of a rate. One parameter
    /// `rate` in hertz; positive.
    RateLimit,
    /// Delays each message, order kept. One parameter `delay` in seconds: a value if fixed, else a sub-range.
    Latency {
        /// How each message's delay is drawn.
        distribution: Distribution,
        /// What becomes of held messages when the window ends.
        drain: Drain,
    },
    /// Delays each message by a fresh uniform draw from zero to a parameter `window` in seconds; order is not kept.
    Reorder {
        /// What becomes of held messages when the window ends.
        drain: Drain,
    },
    /// Sends copies right after each message. One parameter `copies`: how many, a whole number from 1.
    Duplicate,
    /// Drops every message. No parameters.
    Blackhole,
    /// Sets a parameter of a node while it is active, and then to what it was before. One parameter `value`: a number,
    /// or where there are values, a text for one of them.
    Set {
        /// The node.
        node: NodeId,
        /// The name of the parameter in the node.
        parameter: String,
        /// One for each text that the parameter `value` permits, in their order; none where it is a number.
        #[serde(default, skip_serializing_if = "Vec::is_empty")]
        values: Vec<NewValue>,
    },
    /// Takes a node through a transition of its lifecycle when it becomes active, and back to the state in which the
    /// node was when it ends. No parameters.
    Transition {
        /// The node.
        node: NodeId,
        /// Which transition; those before it are made too where they have to be.
        transition: Transition,
    },
    /// A node, or all of its processes, stands still while it is active. No parameters.
    Pause {
        /// The node, which the runner launches, or which is a part of the simulator.
        node: NodeId,
    },
    /// Leaves a node only a share of the time while it is active. One parameter `share`, between 0 and 1.
    Slow {
        /// The node, which the runner launches, or which is a part of the simulator.
        node: NodeId,
    },
    /// Kills a node, or all of its processes, when it becomes active, and starts the node again when it ends. No
    /// parameters.
    Kill {
        /// The node, which the runner launches, or which is a part of the simulator.
        node: NodeId,
    },
    /// Sets a parameter of the simulator for the whole run, when that begins anew: what the scenario is. One parameter
    /// `value`.
    Scene {
        /// The name of the parameter in the simulator; `None` where launched programs have it in their arguments, as
        /// `{NAME}` with the name of the operation, and the simulator is not asked for it.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        parameter: Option<String>,
        /// Its value in runs that do not set it; `None` where only the simulator knows it, which is never so where
        /// launched programs have it in their arguments.
        usual: Option<f64>,
    },
    /// The user's Rust code, with parameters as declared.
    Custom {
        /// When it is called.
        moment: Moment,
    },
}

/// A transition in the lifecycle of a node of ROS 2 that can be undone.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Transition {
    /// From unconfigured to inactive.
    Configure,
    /// From inactive to active.
    Activate,
    /// From active to inactive.
    Deactivate,
    /// From inactive to unconfigured.
    Cleanup,
}

impl Transition {
    /// All of them.
    pub const ALL: [Transition; 4] =
        [Transition::Configure, Transition::Activate, Transition::Deactivate, Transition::Cleanup];

    /// Its name in ROS.
    pub fn word(self) -> &'static str {
        self.words().strip_prefix("transition ").unwrap_or_default()
    }

    /// An operation with this transition, in words.
    fn words(self) -> &'static str {
        match self {
            Transition::Configure => "transition configure",
            Transition::Activate => "transition activate",
            Transition::Deactivate => "transition deactivate",
            Transition::Cleanup => "transition cleanup",
        }
    }
}

/// A value that is given to a parameter of a node.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(untagged)]
pub enum NewValue {
    /// A truth value.
    Bool(bool),
    /// A number; finite.
    Number(f64),
    /// A text.
    Text(String),
    /// Numbers, or an empty list for a parameter that is a list of anything.
    Numbers(Vec<f64>),
    /// Truth values; at least one.
    Bools(Vec<bool>),
    /// Texts; at least one.
    Texts(Vec<String>),
}

impl NewValue {
    /// What it is, in words.
    pub fn is(&self) -> &'static str {
        match self {
            NewValue::Bool(_) => "a `bool`",
            NewValue::Number(_) => "a number",
            NewValue::Text(_) => "a text",
            NewValue::Numbers(numbers) if numbers.is_empty() => "an empty list",
            NewValue::Numbers(_) => "a list of numbers",
            NewValue::Bools(_) => "a list of `bool`",
            NewValue::Texts(_) => "a list of texts",
        }
    }
}

/// A value that is not a finite number.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum NotFinite {
    /// Not a number.
    Nan,
    /// Larger than every number.
    Infinity,
    /// Smaller than every number.
    MinusInfinity,
}

/// When the code of a custom operation is called.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Moment {
    /// With each message of its topic while the operation is active.
    OnMessage,
    /// Once, before the simulator starts afresh for the test.
    BeforeStart,
    /// Once, after a run that came to its end.
    AfterEnd,
}

impl OperationKind {
    /// Whether it acts outside the run, before its start or after its end: its activation in a test is then
    /// [`crate::Activation::Offline`], and it has no observed intervals.
    pub fn is_offline(&self) -> bool {
        matches!(self, OperationKind::Scene { .. }) || self.calls_code_outside_the_run()
    }

    /// Whether it calls the user's code before the start of a run, or after its end.
    pub fn calls_code_outside_the_run(&self) -> bool {
        matches!(self, OperationKind::Custom { moment: Moment::BeforeStart | Moment::AfterEnd })
    }

    /// The node on which it acts, if it acts on a node or its parameters instead of messages.
    pub fn node(&self) -> Option<NodeId> {
        match self {
            OperationKind::Set { node, .. }
            | OperationKind::Transition { node, .. }
            | OperationKind::Pause { node }
            | OperationKind::Slow { node }
            | OperationKind::Kill { node } => Some(*node),
            _ => None,
        }
    }

    /// Whether it adds to numbers, so that it can keep angles within one turn.
    pub fn adds(&self) -> bool {
        matches!(
            self,
            OperationKind::RandomValue { mode: ValueMode::Offset, .. }
                | OperationKind::Bias
                | OperationKind::Drift
                | OperationKind::Noise
                | OperationKind::RandomWalk
        )
    }

    /// Whether it acts on messages, so that it has a topic.
    pub fn acts_on_messages(&self) -> bool {
        !self.is_offline() && self.node().is_none()
    }

    /// Whether its parameters are probabilities: fractions here, percentages in the `.sesame` file.
    pub fn has_probabilities(&self) -> bool {
        matches!(self, OperationKind::PacketLoss | OperationKind::BurstLoss | OperationKind::Slow { .. })
    }

    /// Whether it draws numbers, so that the seed of a test's operation makes a difference. Of the user's code that is
    /// not known, so it counts as drawing.
    pub fn draws(&self) -> bool {
        match self {
            OperationKind::RandomValue { .. }
            | OperationKind::RandomText { .. }
            | OperationKind::RandomConstant { .. }
            | OperationKind::Noise
            | OperationKind::RandomWalk
            | OperationKind::PacketLoss
            | OperationKind::BurstLoss
            | OperationKind::Reorder { .. }
            | OperationKind::Custom { .. } => true,
            OperationKind::Latency { distribution, .. } => *distribution != Distribution::Fixed,
            OperationKind::StuckAt { .. }
            | OperationKind::StuckAtConstant { .. }
            | OperationKind::Bias
            | OperationKind::Drift
            | OperationKind::Scale
            | OperationKind::NotFinite { .. }
            | OperationKind::Freeze
            | OperationKind::Stale
            | OperationKind::ClockSkew
            | OperationKind::RateLimit
            | OperationKind::Duplicate
            | OperationKind::Blackhole
            | OperationKind::Set { .. }
            | OperationKind::Transition { .. }
            | OperationKind::Pause { .. }
            | OperationKind::Slow { .. }
            | OperationKind::Kill { .. }
            | OperationKind::Scene { .. } => false,
        }
    }

    /// What it does to messages, as far as the dimensions O1 to O3 of the reduced space distinguish it.
    pub fn class(&self) -> Class {
        match self {
            OperationKind::RandomValue { .. }
            | OperationKind::RandomText { .. }
            | OperationKind::RandomConstant { .. }
            | OperationKind::StuckAt { .. }
            | OperationKind::StuckAtConstant { .. }
            | OperationKind::Bias
            | OperationKind::Drift
            | OperationKind::Noise
            | OperationKind::RandomWalk
            | OperationKind::Scale
            | OperationKind::NotFinite { .. }
            | OperationKind::Freeze
            | OperationKind::ClockSkew
            | OperationKind::Duplicate
            | OperationKind::Set { .. } => Class::Value,
            OperationKind::PacketLoss
            | OperationKind::BurstLoss
            | OperationKind::RateLimit
            | OperationKind::Blackhole
            | OperationKind::Transition { transition: Transition::Deactivate | Transition::Cleanup, .. }
            | OperationKind::Kill { .. } => Class::Loss,
            OperationKind::Latency { .. }
            | OperationKind::Reorder { .. }
            | OperationKind::Stale
            | OperationKind::Pause { .. }
            | OperationKind::Slow { .. } => Class::Delay,
            // What the user's code or a node that becomes active does is not known, and a scene does nothing to
            // messages.
            OperationKind::Custom { .. }
            | OperationKind::Scene { .. }
            | OperationKind::Transition { transition: Transition::Configure | Transition::Activate, .. } => {
                Class::Other
            }
        }
    }

    /// The number at which a parameter disturbs nothing, or least: the permitted number nearest to it is the mildest.
    ///
    /// | kind | mildest |
    /// |---|---|
    /// | random offset, bias, drift, noise, random walk, clock skew | 0 |
    /// | scale | factor 1 |
    /// | stale, latency, reorder | no delay |
    /// | packet loss; burst loss `enter` and `loss` | 0 |
    /// | burst loss `leave` | 1: a burst that ends at once |
    /// | rate limit | the highest rate |
    /// | duplicate | one copy |
    /// | custom | 0, since what the user's code does is not known |
    /// | slow | 1: all of the time |
    /// | scene | its usual value; none where only the simulator knows that |
    /// | set, random absolute, stuck at | none: of a sub-range only a narrower one is milder |
    pub fn neutral_value(&self, parameter: &str) -> Option<f64> {
        match self {
            OperationKind::Scene { usual, .. } => *usual,
            OperationKind::RandomValue { mode: ValueMode::Absolute, .. }
            | OperationKind::StuckAt { .. }
            | OperationKind::StuckAtConstant { .. }
            | OperationKind::RandomText { .. }
            | OperationKind::RandomConstant { .. }
            | OperationKind::NotFinite { .. }
            | OperationKind::Freeze
            | OperationKind::Blackhole
            | OperationKind::Set { .. }
            | OperationKind::Transition { .. }
            | OperationKind::Pause { .. }
            | OperationKind::Kill { .. } => None,
            OperationKind::Scale | OperationKind::Duplicate | OperationKind::Slow { .. } => Some(1.0),
            OperationKind::BurstLoss if parameter == "leave" => Some(1.0),
            OperationKind::RateLimit => Some(f64::INFINITY),
            OperationKind::RandomValue { mode: ValueMode::Offset, .. }
            | OperationKind::Bias
            | OperationKind::Drift
            | OperationKind::Noise
            | OperationKind::RandomWalk
            | OperationKind::Stale
            | OperationKind::ClockSkew
            | OperationKind::PacketLoss
            | OperationKind::BurstLoss
            | OperationKind::Latency { .. }
            | OperationKind::Reorder { .. }
            | OperationKind::Custom { .. } => Some(0.0),
        }
    }

    /// The kind in words, as the `.sesame` file has it.
    pub fn words(&self) -> &'static str {
        match self {
            OperationKind::RandomValue { mode: ValueMode::Absolute, .. } => "random absolute",
            OperationKind::RandomValue { mode: ValueMode::Offset, .. } => "random offset",
            OperationKind::RandomText { .. } | OperationKind::RandomConstant { .. } => "random one of",
            OperationKind::StuckAt { truth: None } | OperationKind::StuckAtConstant { .. } => "stuck at",
            OperationKind::StuckAt { truth: Some(true) } => "stuck at true",
            OperationKind::StuckAt { truth: Some(false) } => "stuck at false",
            OperationKind::Bias => "bias",
            OperationKind::Drift => "drift",
            OperationKind::Noise => "noise",
            OperationKind::RandomWalk => "random walk",
            OperationKind::Scale => "scale",
            OperationKind::NotFinite { number: NotFinite::Nan } => "nan",
            OperationKind::NotFinite { number: NotFinite::Infinity } => "infinity",
            OperationKind::NotFinite { number: NotFinite::MinusInfinity } => "-infinity",
            OperationKind::Freeze => "freeze",
            OperationKind::Stale => "stale",
            OperationKind::ClockSkew => "clock skew",
            OperationKind::PacketLoss => "packet loss",
            OperationKind::BurstLoss => "burst loss",
            OperationKind::RateLimit => "rate limit",
            OperationKind::Latency { .. } => "latency",
            OperationKind::Reorder { .. } => "reorder",
            OperationKind::Duplicate => "duplicate",
            OperationKind::Blackhole => "blackhole",
            OperationKind::Set { .. } => "set",
            OperationKind::Transition { transition, .. } => transition.words(),
            OperationKind::Pause { .. } => "pause",
            OperationKind::Slow { .. } => "slow",
            OperationKind::Kill { .. } => "kill",
            OperationKind::Scene { .. } => "parameter",
            OperationKind::Custom { moment: Moment::OnMessage } => "custom",
            OperationKind::Custom { moment: Moment::BeforeStart } => "custom before start",
            OperationKind::Custom { moment: Moment::AfterEnd } => "custom after end",
        }
    }
}

/// What an operation does to messages, as far as the dimensions O1 to O3 of the reduced space distinguish it.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Class {
    /// It changes values; counted in O1.
    Value,
    /// It loses messages; counted in O2.
    Loss,
    /// It delays messages; counted in O3.
    Delay,
    /// None of these; counted in O0 only.
    Other,
}

/// Whether a random value replaces or shifts the original.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum ValueMode {
    /// The draw replaces the value.
    Absolute,
    /// The draw is added to the value.
    Offset,
}

/// How the delay of each message is drawn.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Distribution {
    /// The same for every message.
    Fixed,
    /// Uniform over the test's sub-range, drawn anew per message.
    Uniform,
    /// Normal around the middle of the test's sub-range with a quarter of its width as standard deviation, drawn anew
    /// per message, and drawn again where it would leave the sub-range.
    Normal,
}

/// What becomes of held messages when an operation's window ends.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Drain {
    /// Held ones go out on time, later ones queue behind them.
    #[default]
    Finish,
    /// Held ones go out at once.
    Flush,
    /// Held ones are lost.
    Drop,
}
