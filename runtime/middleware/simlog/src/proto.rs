//! The messages and calls of the protocol. A program in `generate` generates these modules from the protocol's files,
//! so that a build needs neither `protoc` nor a compiler for such files in Rust.

/// Version 2.
#[rustfmt::skip]
#[expect(missing_docs, reason = "generated; the protocol's file describes it")]
#[expect(clippy::pedantic, reason = "generated")]
#[cfg_attr(
    any(feature = "client", feature = "server"),
    expect(clippy::allow_attributes_without_reason, reason = "generated")
)]
#[cfg_attr(feature = "server", expect(clippy::allow_attributes, reason = "generated"))]
pub mod v2;

/// Version 3: topics.
#[rustfmt::skip]
#[expect(missing_docs, reason = "generated; the protocol's file describes it")]
#[expect(clippy::pedantic, reason = "generated")]
#[cfg_attr(feature = "client", expect(clippy::allow_attributes_without_reason, reason = "generated"))]
pub mod v3;

/// Version 3: steps.
#[rustfmt::skip]
#[cfg(feature = "client")]
#[expect(missing_docs, reason = "generated; the protocol's file describes it")]
#[expect(clippy::pedantic, clippy::allow_attributes_without_reason, reason = "generated")]
pub mod simulator3;

#[cfg(test)]
mod tests;
