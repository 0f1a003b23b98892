//! What a campaign says of itself, so that agents can decide whether they can run its tests.

use serde::{Deserialize, Serialize};

use crate::bundle::{Entry, Manifest};
use crate::message::digest_of;

/// A campaign whose tests agents may take.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct Announcement {
    /// What names the campaign in the queue; see [`is_campaign_id`].
    pub campaign: String,
    /// What people call it, for example `coverage_experiment of kuka_cell, seed 42`.
    pub title: String,
    /// The version of the program that results depend on: an agent with another one refuses the campaign.
    pub version: String,
    /// What runs the tests.
    pub program: Program,
    /// Agents whose machines were put aside, by their names, each with the reason.
    pub put_aside: Vec<(String, String)>,
}

impl Announcement {
    /// What tells this campaign from an earlier one of the same id that had another program or other files.
    pub fn edition(&self) -> String {
        let parts = serde_json::to_vec(&(&self.version, &self.program)).expect("an announcement is JSON");
        digest_of(&parts)
    }
}

/// What an agent runs tests with.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct Program {
    /// The plan, as JSON.
    pub plan: String,
    /// The folder of the space.
    pub space: Files,
    /// The folder that the simulator runs in, as seen from that of the space.
    pub simulator: String,
    /// The hooks in Python that its tests call, as JSON; `None` if they call none.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub hooks: Option<String>,
    /// The runner that was compiled for the campaign; `None` if the agent's own program interprets the plan.
    pub compiled: Option<Compiled>,
    /// Whether an agent can run only one test at a time: operations change files of the space, or all tests use the
    /// same address.
    pub one_at_a_time: bool,
}

/// A compiled runner.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct Compiled {
    /// Its architecture and system, for example `x86_64-linux`: an agent with another one refuses the campaign.
    pub target: String,
    /// Its program.
    pub program: Entry,
}

/// Where an agent gets a folder from.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
#[serde(tag = "kind", rename_all = "snake_case")]
pub enum Files {
    /// Out of the queue, file by file.
    Bundle(Manifest),
    /// It is on the agent's machine already, under this name.
    Prepared {
        /// The name, as `--prepared NAME=FOLDER` gives it to an agent.
        name: String,
        /// The files that have to be in it, and what is in them.
        files: Manifest,
    },
}

/// Whether a text names a campaign in a queue: 16 hexadecimal digits in small letters. It becomes part of names of
/// files and subjects, so nothing else is accepted.
pub fn is_campaign_id(text: &str) -> bool {
    text.len() == 16 && text.bytes().all(|byte| matches!(byte, b'0'..=b'9' | b'a'..=b'f'))
}
