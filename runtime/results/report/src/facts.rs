//! The facts of reports, each computed once from the results. They serialise to JSON as they are.

pub(super) mod causes;
pub(super) mod certificate;
pub(super) mod coverage;
pub(super) mod disturbances;
pub(super) mod monitors;
pub(super) mod pairs;
pub(super) mod readable;
pub(super) mod recording;
pub(super) mod repetition;
pub(super) mod replay;
pub(super) mod show;
pub(super) mod shrinking;
pub(super) mod stacked;
pub(super) mod summary;
pub(super) mod twin;
pub(super) mod violated;
pub(super) mod wording;
