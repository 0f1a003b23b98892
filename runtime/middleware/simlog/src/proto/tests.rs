use sha2::{Digest, Sha256};

#[test]
fn each_module_was_generated_from_the_file_that_is_there() {
    let of = [
        ("simlog2", &include_bytes!("../../proto/simlog2.proto")[..], include_str!("v2.rs")),
        ("simlog3", &include_bytes!("../../proto/simlog3.proto")[..], include_str!("v3.rs")),
        ("simserver3", &include_bytes!("../../proto/simserver3.proto")[..], include_str!("simulator3.rs")),
    ];
    for (name, file, module) in of {
        let digest = Sha256::digest(file).iter().map(|byte| format!("{byte:02x}")).collect::<Vec<_>>().concat();
        let mend = "call `cargo run` in runtime/middleware/simlog/generate";
        assert!(module.contains(&digest), "proto/{name}.proto has changed: {mend}");
    }
}
