//! Makes Rust of the protocol's files, in Rust alone: no `protoc` is needed.

use std::env::var_os;
use std::error::Error;

fn main() -> Result<(), Box<dyn Error>> {
    println!("cargo::rerun-if-changed=proto");
    let files = protox::compile(["simlog2.proto", "simlog3.proto", "simserver3.proto"], ["proto"])?;
    tonic_prost_build::configure()
        .build_client(var_os("CARGO_FEATURE_CLIENT").is_some())
        .build_server(var_os("CARGO_FEATURE_SERVER").is_some())
        .build_transport(false)
        .compile_fds(files)?;
    Ok(())
}
