//! The messages and calls of the protocol, as the build makes them of its files.

/// Version 2.
#[expect(missing_docs, reason = "generated; the protocol's file describes it")]
#[expect(clippy::pedantic, reason = "generated")]
#[cfg_attr(
    any(feature = "client", feature = "server"),
    expect(clippy::allow_attributes_without_reason, reason = "generated")
)]
#[cfg_attr(feature = "server", expect(clippy::allow_attributes, reason = "generated"))]
pub mod v2 {
    tonic::include_proto!("simulation.server");
}

/// Version 3: topics.
#[expect(missing_docs, reason = "generated; the protocol's file describes it")]
#[expect(clippy::pedantic, reason = "generated")]
#[cfg_attr(feature = "client", expect(clippy::allow_attributes_without_reason, reason = "generated"))]
pub mod v3 {
    tonic::include_proto!("simlog.server");
}

/// Version 3: steps.
#[cfg(feature = "client")]
#[expect(missing_docs, reason = "generated; the protocol's file describes it")]
#[expect(clippy::pedantic, clippy::allow_attributes_without_reason, reason = "generated")]
pub mod simulator3 {
    tonic::include_proto!("com.ttsnetwork.simulator3");
}
