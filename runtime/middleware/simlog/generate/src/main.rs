//! Generates Rust code from the protocol's files, in Rust alone: no `protoc` is needed.
//!
//! `cargo run` writes the modules of the crate anew. `cargo run -- FOLDER` writes them into a folder for comparison.

use std::env::args_os;
use std::error::Error;
use std::fs;
use std::path::{Path, PathBuf};

use sha2::{Digest, Sha256};

/// A file of the protocol, and the module that is generated from it.
struct Protocol {
    file: &'static str,
    package: &'static str,
    module: &'static str,
    /// Whether one of our simulators can serve it.
    served: bool,
}

const PROTOCOLS: [Protocol; 3] = [
    Protocol { file: "simlog2.proto", package: "simulation.server", module: "v2", served: true },
    Protocol { file: "simlog3.proto", package: "simlog.server", module: "v3", served: false },
    Protocol { file: "simserver3.proto", package: "com.ttsnetwork.simulator3", module: "simulator3", served: false },
];

fn main() -> Result<(), Box<dyn Error>> {
    let package = Path::new(env!("CARGO_MANIFEST_DIR")).parent().expect("the folder lies in the package");
    let folder = args_os().nth(1).map_or_else(|| package.join("src/proto"), PathBuf::from);
    fs::create_dir_all(&folder)?;
    for protocol in PROTOCOLS {
        let made = tempfile::tempdir()?;
        tonic_prost_build::configure()
            .build_server(protocol.served)
            .build_transport(false)
            .client_mod_attribute(".", "#[cfg(feature = \"client\")]")
            .server_mod_attribute(".", "#[cfg(feature = \"server\")]")
            .out_dir(&made)
            .compile_fds(protox::compile([protocol.file], [package.join("proto")])?)?;
        let text = fs::read_to_string(made.path().join(format!("{}.rs", protocol.package)))?;
        let digest = Sha256::digest(fs::read(package.join("proto").join(protocol.file))?);
        let digest: String = digest.iter().map(|byte| format!("{byte:02x}")).collect();
        let begin = format!(
            "//! Messages and calls of `proto/{file}`. `cargo run` in `generate` generated this file from it.\n//!\n\
             //! SHA-256 of `proto/{file}`: {digest}\n\n",
            file = protocol.file
        );
        fs::write(folder.join(protocol.module).with_extension("rs"), begin + &text)?;
    }
    Ok(())
}
