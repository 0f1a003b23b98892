//! Monitors compared with naive ones that know nothing but the whole history.

#![expect(clippy::unwrap_used, reason = "in tests, and in what is only for tests")]
#![expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "the numbers of tests are small")]

mod check;
mod difference;
mod naive;
mod random;
mod run;
mod score;
mod tolerance;
mod why;
