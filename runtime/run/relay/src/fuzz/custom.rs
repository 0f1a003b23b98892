//! Custom operations: the user's Rust code, called with each message, before the start or after the end of a run.
//!
//! Generated code wraps the user's typed hook in an [`OperationHook`]; each occurrence of an operation in a test has a
//! hook of its own in each run. Random numbers come from the context only, keyed like those of every other operation.

use std::fmt;
use std::path::{Path, PathBuf};

use sesame_base::time::SimTime;
use sesame_plan::{CampaignPlan, Choice, Moment, Operation, OperationId, OperationKind};

use crate::files::SpaceFiles;
use crate::fuzz::draws::KeyedRng;
use crate::message::{FromValue, Mismatch, ToValue};
use crate::value::{Text, Value};

/// A user's operation hook as the runtime calls it. Generated code implements it around the typed hook trait.
pub trait OperationHook {
    /// A message on the operation's topic, which may be changed in place.
    fn on_message(&mut self, message: &mut Value, call: &mut MessageCall<'_>) {
        let _ = (message, call);
    }
    /// Before the start or after the end of a run, as the operation's declaration says.
    fn before_or_after_run(&mut self, ctx: &mut RunContext<'_>) {
        let _ = ctx;
    }
}

/// An operation hook that generated code registers.
#[derive(Debug, Clone, Copy)]
pub struct OperationEntry {
    /// The operation's name in the space.
    pub operation: &'static str,
    /// A fresh hook for the operation of this name, with the choices of a test, which fit the operation's parameters.
    pub build: fn(&str, &[Choice]) -> Box<dyn OperationHook>,
}

/// A choice for a parameter, as generated code reads it.
pub trait FromChoice: Sized {
    /// The choice; `None` if it is of another kind.
    fn from_choice(choice: &Choice) -> Option<Self>;
}

impl FromChoice for f64 {
    fn from_choice(choice: &Choice) -> Option<Self> {
        match choice {
            Choice::Value { value } => Some(*value),
            _ => None,
        }
    }
}

impl FromChoice for i64 {
    #[expect(clippy::cast_possible_truncation, reason = "choices of whole numbers are at most 2^53")]
    fn from_choice(choice: &Choice) -> Option<Self> {
        f64::from_choice(choice).map(|value| value as i64)
    }
}

impl FromChoice for [f64; 3] {
    fn from_choice(choice: &Choice) -> Option<Self> {
        match choice {
            Choice::Point { point } => Some(*point),
            _ => None,
        }
    }
}

impl FromChoice for Text {
    fn from_choice(choice: &Choice) -> Option<Self> {
        match choice {
            Choice::Text { text } => Some(Text::from(text.as_str())),
            _ => None,
        }
    }
}

/// The choice of a test for the parameter at this position.
pub fn chosen<T: FromChoice>(choices: &[Choice], position: usize) -> T {
    choices.get(position).and_then(T::from_choice).expect("choices are checked before a hook is built")
}

/// The context of a hook for messages: what it may do besides changing its message, which has the type `M`.
#[derive(Debug)]
pub struct OperationContext<'a, M> {
    now: SimTime,
    topic: &'a str,
    draws: KeyedRng,
    next_draw: u64,
    dropped: bool,
    injected: Vec<M>,
    unimplemented: bool,
}

impl<M> OperationContext<'_, M> {
    /// Simulation time in seconds.
    pub fn now(&self) -> f64 {
        self.now.seconds()
    }

    /// Name on the wire of the message's topic; if the operation is on a group, the name of the member.
    pub fn topic(&self) -> &str {
        self.topic
    }

    /// The next random number for this message, uniform in `[0, 1)`. It depends on the operation seed, the message's
    /// index, and how many numbers were drawn for this message before, so a repeated test draws the same numbers.
    pub fn draw(&mut self) -> f64 {
        self.next_draw += 1;
        self.draws.unit(self.next_draw - 1)
    }

    /// The next random number, uniform in `[low, high)`.
    pub fn draw_between(&mut self, low: f64, high: f64) -> f64 {
        low + (high - low) * self.draw()
    }

    /// Drops the message. Injected messages are still delivered.
    pub fn drop_message(&mut self) {
        self.dropped = true;
    }

    /// Publishes a further message on the same topic, directly after this one. Later operations act on it too.
    pub fn inject(&mut self, message: M) {
        self.injected.push(message);
    }

    /// Marks this hook as not implemented yet.
    pub fn unimplemented(&mut self) {
        self.unimplemented = true;
    }
}

/// The call of a hook for one message, without the message's type.
#[derive(Debug)]
pub struct MessageCall<'a> {
    now: SimTime,
    topic: &'a str,
    draws: KeyedRng,
    pub(crate) changed: bool,
    pub(crate) dropped: bool,
    pub(crate) injected: Vec<Value>,
    pub(crate) unimplemented: bool,
    pub(crate) mismatch: Option<Mismatch>,
}

impl<'a> MessageCall<'a> {
    pub(crate) fn new(now: SimTime, topic: &'a str, draws: KeyedRng) -> Self {
        MessageCall {
            now,
            topic,
            draws,
            changed: false,
            dropped: false,
            injected: Vec::new(),
            unimplemented: false,
            mismatch: None,
        }
    }

    /// The context of one call.
    fn context<M>(&self) -> OperationContext<'a, M> {
        OperationContext {
            now: self.now,
            topic: self.topic,
            draws: self.draws,
            next_draw: 0,
            dropped: false,
            injected: Vec::new(),
            unimplemented: false,
        }
    }

    /// Calls a hook that reads and writes the message without its type. The error says that what it made is not of the
    /// declared type; then the message is passed on as the hook left it, with a warning of the run.
    pub fn dynamic(
        &mut self,
        value: &mut Value,
        call: impl FnOnce(&mut Value, &mut OperationContext<'_, Value>) -> Result<(), Mismatch>,
    ) {
        let before = value.clone();
        let mut ctx = self.context();
        self.mismatch = call(value, &mut ctx).err();
        self.dropped = ctx.dropped;
        self.unimplemented |= ctx.unimplemented;
        self.injected.append(&mut ctx.injected);
        self.changed = !value.is_same(&before);
    }

    /// Reads the message, calls the hook, and writes the message back. A message that is not of its declared type is
    /// passed on unchanged, with a warning of the run.
    pub fn typed<M: FromValue + ToValue>(
        &mut self,
        value: &mut Value,
        call: impl FnOnce(&mut M, &mut OperationContext<'_, M>),
    ) {
        let mut message = match M::from_value(value) {
            Ok(message) => message,
            Err(mismatch) => {
                self.mismatch = Some(mismatch);
                return;
            }
        };
        let mut ctx = self.context();
        call(&mut message, &mut ctx);
        self.dropped = ctx.dropped;
        self.unimplemented |= ctx.unimplemented;
        for injected in &ctx.injected {
            // Undeclared fields are those of the original message.
            let mut copy = value.clone();
            injected.write_to(&mut copy);
            self.injected.push(copy);
        }
        self.changed = message.write_to(value);
    }
}

/// The context of a hook before the start or after the end of a run.
///
/// Files are named by their path relative to the folder of the `.sesame` file, and are always restored after the run.
/// If an action fails, the test is a crash that gives the reason; the hook continues, but no further changes are made.
#[derive(Debug)]
pub struct RunContext<'a> {
    /// `None` in a probe, which only finds out whether the hook is implemented.
    files: Option<&'a mut dyn SpaceFiles>,
    draws: KeyedRng,
    next_draw: u64,
    pub(crate) side_effects: u64,
    pub(crate) failure: Option<String>,
    pub(crate) unimplemented: bool,
}

impl<'a> RunContext<'a> {
    pub(crate) fn new(files: &'a mut dyn SpaceFiles, draws: KeyedRng) -> Self {
        RunContext { files: Some(files), draws, next_draw: 0, side_effects: 0, failure: None, unimplemented: false }
    }

    /// A context that changes nothing: a hook that uses it is implemented, and is stopped there.
    pub(crate) fn probing() -> Self {
        let draws = KeyedRng::new(0, 0, 0);
        RunContext { files: None, draws, next_draw: 0, side_effects: 0, failure: None, unimplemented: false }
    }

    /// The files, or the end of a probe.
    fn files(&mut self) -> &mut dyn SpaceFiles {
        match &mut self.files {
            Some(files) => *files,
            None => std::panic::resume_unwind(Box::new("a probe ends here")),
        }
    }

    /// The folder of the `.sesame` file.
    pub fn folder(&mut self) -> PathBuf {
        self.files().folder().to_owned()
    }

    /// Replaces the contents of a file until the run is over; a file that does not exist is created, and removed again.
    /// Counts as a side effect unless the file already had these contents.
    pub fn replace_file(&mut self, path: impl AsRef<Path>, contents: impl AsRef<[u8]>) {
        if self.failure.is_some() {
            return;
        }
        match self.files().replace(path.as_ref(), contents.as_ref()) {
            Ok(changed) => self.side_effects += u64::from(changed),
            Err(error) => self.failure = Some(error.to_string()),
        }
    }

    /// Changes the text of a file until the run is over: `edit` computes the new text from the old one.
    pub fn edit_file(&mut self, path: impl AsRef<Path>, edit: impl FnOnce(&str) -> String) {
        if self.failure.is_some() {
            return;
        }
        match self.files().read_text(path.as_ref()) {
            Ok(text) => {
                let new = edit(&text);
                self.replace_file(path, new);
            }
            Err(error) => self.failure = Some(error.to_string()),
        }
    }

    /// Counts another side effect of the hook, so that the test has an effect. The hook must undo it itself.
    pub fn count_side_effect(&mut self) {
        self.files();
        self.side_effects += 1;
    }

    /// The next random number, uniform in `[0, 1)`; a repeated test draws the same numbers.
    pub fn draw(&mut self) -> f64 {
        self.files();
        self.next_draw += 1;
        self.draws.unit(self.next_draw - 1)
    }

    /// The next random number, uniform in `[low, high)`.
    pub fn draw_between(&mut self, low: f64, high: f64) -> f64 {
        low + (high - low) * self.draw()
    }

    /// Marks this hook as not implemented yet.
    pub fn unimplemented(&mut self) {
        self.unimplemented = true;
    }
}

/// A custom operation with the choices of one test.
pub struct Custom {
    pub(crate) moment: Moment,
    pub(crate) hook: Box<dyn OperationHook>,
    /// The first message that was not of its declared type.
    pub(crate) mismatch: Option<String>,
}

impl fmt::Debug for Custom {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Custom").field("moment", &self.moment).finish_non_exhaustive()
    }
}

impl Custom {
    pub(super) fn new(
        operation: &Operation,
        moment: Moment,
        choices: &[Choice],
        hooks: &[OperationEntry],
    ) -> Option<Self> {
        let entry = hooks.iter().find(|entry| entry.operation == operation.name)?;
        Some(Custom { moment, hook: (entry.build)(entry.operation, choices), mismatch: None })
    }

    /// Lets the hook at a message.
    pub(crate) fn on_message<'c>(
        &mut self,
        now: SimTime,
        topic: &'c str,
        draws: KeyedRng,
        message: &mut Value,
    ) -> MessageCall<'c> {
        let mut call = MessageCall::new(now, topic, draws);
        self.hook.on_message(message, &mut call);
        if let Some(mismatch) = &call.mismatch {
            self.mismatch
                .get_or_insert_with(|| format!("a message on `{topic}` is not of its declared type: {mismatch}"));
        }
        call
    }
}

/// The custom operations of a plan, with what is permitted of them and their hooks.
pub(crate) fn custom_operations(plan: &CampaignPlan) -> impl Iterator<Item = (OperationId, Moment, &Operation)> {
    (0u32..).map(OperationId).zip(&plan.operations).filter_map(|(id, operation)| match operation.kind {
        OperationKind::Custom { moment } => Some((id, moment, operation)),
        _ => None,
    })
}
