//! `sesamec lab`: what a lab needs to know before tests are run there, what people saw in it, and what its recordings
//! show.

mod brief;
mod briefing;
mod contacts;
mod entered;
mod interlocks;
mod poses;
mod replay;
#[cfg(test)]
mod tests;

use std::process::ExitCode;

use clap::Subcommand;

use super::shell::Shell;
use crate::frontend::Language;
pub(super) use brief::{Conditions, sheets};

/// What is done for a lab.
#[derive(Debug, Subcommand)]
pub(super) enum Lab {
    /// Print a briefing for people who run tests in a lab: what is disturbed, what the simulation showed, and when to
    /// stop.
    Brief(brief::Brief),
    /// Print a form for runs in a lab, to be filled in: a row for each run of each test.
    Form(entered::Form),
    /// Check filled-in forms, and record their runs as results of the lab.
    Add(entered::Add),
    /// Find contacts between the shapes of a lab in recordings: between a robot and objects that were not there, and
    /// between robots that were recorded one at a time.
    Contacts(contacts::Asked),
    /// Judge by recordings whether an interlock on expanded shapes acts early enough, and in exactly the tests in which
    /// shapes would touch.
    Interlocks(interlocks::Asked),
}

/// Does what is asked.
pub(super) fn lab(shell: Shell, language: &Language, asked: &Lab) -> anyhow::Result<ExitCode> {
    match asked {
        Lab::Brief(asked) => brief::brief(shell, asked)?,
        Lab::Form(asked) => entered::print_form(shell, asked)?,
        Lab::Add(asked) => entered::add(shell, asked)?,
        Lab::Contacts(asked) => contacts::print_contacts(shell, language, asked)?,
        Lab::Interlocks(asked) => interlocks::print_interlocks(shell, asked)?,
    }
    Ok(ExitCode::SUCCESS)
}
