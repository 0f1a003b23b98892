//! The reality gap: how a simulation and a lab differ, as statistics on numbers; no plan, no results, no files.
//!
//! - [`samples`]: two samples of one metric of one test: the difference of their means, and effect sizes.
//! - [`bootstrap`]: intervals of any statistic of two samples.
//! - [`equivalence`]: whether a difference is within a tolerance; [`power`]: how likely that can be shown at all.
//! - [`holm`]: p values of many questions at once.
//! - [`violations`]: false alarms and misses of a simulation; [`proportion`]: shares, and whether two differ.
//! - [`traces`]: two time series compared, by [`series`] (RMS, correlation, gain and offset), [`lag`] and [`warping`]
//!   (DTW).
//! - [`localise`]: whether a gap is everywhere or in a part of the tests, by what estimates say together ([`pooled`])
//!   and where they change ([`split`]); [`next`]: which test tells more about it.
//! - [`fit`]: parameters of a simulation under which it is closer to the lab; [`discrepancy`]: how close it is.
//! - [`distribution`]: the distributions that all this needs.
//!
//! Every difference is the lab's value minus the simulation's, and a positive lag says that the lab is later.
//! What has no value, such as the standard deviation of one run, is an [`Undefined`](samples::Undefined) with its
//! reason: no function returns NaN. Numbers that come in are finite, which the caller ensures. Everything is a function
//! of its arguments and a seed; equal seeds give equal results on every machine.

pub mod bootstrap;
pub mod discrepancy;
pub mod distribution;
pub mod equivalence;
pub mod fit;
pub mod holm;
pub mod lag;
pub mod localise;
pub mod next;
pub mod pooled;
pub mod power;
pub mod proportion;
pub mod samples;
pub mod series;
pub mod split;
pub mod traces;
pub mod violations;
pub mod warping;
