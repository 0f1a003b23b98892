//! What runtime monitors did, and why: in a test, at one of its moments, and in a campaign.

pub(crate) mod before_after;
pub(crate) mod campaign;
mod history;
pub(crate) mod moment;
pub(crate) mod test;
pub(crate) mod why;
