//! What runtime monitors did, and why: in a test, at one of its moments, and in a campaign.

pub(in crate::report) mod campaign;
mod history;
pub(in crate::report) mod mend;
pub(in crate::report) mod moment;
pub(in crate::report) mod test;
pub(in crate::report) mod why;
