//! How a command ends when it does not simply succeed.

pub(super) use crate::output::Failure;

/// Exit code of a command that did its work and found that something is not as required: what `--fail-on` names was
/// found, a campaign says too little, or a test came out different.
pub(super) const NOT_AS_REQUIRED: u8 = 3;

/// Exit code of a run that the user stopped, as shells have it for an interrupted program.
pub(super) const STOPPED: u8 = 130;
