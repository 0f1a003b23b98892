//! Makes Rust of the protocol's files, in Rust alone: no `protoc` is needed.

#![expect(clippy::disallowed_methods, reason = "a build script: cargo speaks to it by variables")]

use std::env::var_os;
use std::error::Error;

fn main() -> Result<(), Box<dyn Error>> {
    println!("cargo::rerun-if-changed=proto");
    let client = var_os("CARGO_FEATURE_CLIENT").is_some();
    let server = var_os("CARGO_FEATURE_SERVER").is_some();
    // Only version 2 is served.
    for (files, server) in [(&["simlog2.proto"][..], server), (&["simlog3.proto", "simserver3.proto"], false)] {
        tonic_prost_build::configure()
            .build_client(client)
            .build_server(server)
            .build_transport(false)
            .compile_fds(protox::compile(files, ["proto"])?)?;
    }
    Ok(())
}
