//! The messages and calls of the protocol, as the build makes them of its files.

/// Version 2.
#[expect(missing_docs, reason = "generated; the protocol's file describes it")]
#[expect(clippy::pedantic, reason = "generated")]
pub mod v2 {
    tonic::include_proto!("simulation.server");
}

/// Version 3: topics.
#[expect(missing_docs, reason = "generated; the protocol's file describes it")]
#[expect(clippy::pedantic, reason = "generated")]
pub mod v3 {
    tonic::include_proto!("simlog.server");
}

/// Version 3: steps.
#[cfg(feature = "client")]
#[cfg_attr(feature = "server", expect(non_camel_case_types, reason = "named after a method of the protocol"))]
#[expect(missing_docs, reason = "generated; the protocol's file describes it")]
#[expect(clippy::pedantic, reason = "generated")]
pub mod simulator3 {
    tonic::include_proto!("com.ttsnetwork.simulator3");
}
